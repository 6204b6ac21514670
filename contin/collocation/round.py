"""What kernels tell of a cycle: its Floquet multipliers, and extreme values of its states."""

from __future__ import annotations

import functools
import math
from typing import Any, NamedTuple

import numpy as np

from contin.arrays import Array
from contin.collocation.mesh import basis, interpolation
from contin.kernels.kernel import kernel
from contin.kernels.kernel_parts import IndexVector, Matrix, ReadOnlyVector, Stack, Vector, helper
from contin.levels import APART, LOCATED
from contin.linalg.periodic import Product, condense, fill_logarithms, product_of
from contin.linalg.small import fill_eigenvalues

#: What comes of it: multipliers; one of an autonomous system that should be 1 and has drifted; none, which are NaN; none, as
#: intervals want more parts than there is room for.
KNOWN, DRIFTED, NOT_FINITE, FULL = range(4)
#: Largest size z of a rate times the length of an interval by the error that a method of degree d makes in exp(z), for which it
#: takes (1 + z / 2 + ...) / (1 - z / 2 + ...), which tends to 1 or -1 on both sides: 2 at degree 4, 4.2 at degree 6. At a
#: thousand times the error intervals may be one and a half to two times as long, and no digit of the logarithm is right.
_LONG = 2e-5
#: Intervals are divided where perturbations grow by more than this as a logarithm: beside saddles, where cycles of long periods
#: have long intervals, growth and decay cancel. Ten times larger, they do not beside a saddle that is near a fold; ten times
#: smaller, stiff relaxation oscillations take longer, all modes of which decay.
_GROWS = 0.1
#: Largest number of parts of an interval: they hold a growth by exp(200).
_PARTS = 100


class Monodromy(NamedTuple):
    """The room for it.

    ``jacobian`` (N d, n, n) is given; ``order`` (n,) are the states by which its columns stand in a linearized system. An
    interval may have the ``length``, times the size of a rate; longer ones are divided, and those of each begin in ``starts``
    (N + 1,) among the ``matrices``, which are transitions and, where there is a symmetry, its inverse ``turn`` (0 or 1, n, n).
    ``real`` and ``imaginary`` (n,) are the logarithms found. ``flow`` is the field at the ``ends`` where matrices begin,
    ``normal`` are transitions across it.
    """

    points: Vector
    value: Matrix
    slope: Matrix
    h: Vector
    starts: IndexVector
    turn: Stack
    quadrature: Vector
    order: IndexVector
    length: float
    autonomous: int
    planar: int
    jacobian: Stack
    part: Stack
    length_of_part: Vector
    block: Matrix
    pivots: IndexVector
    matrices: Stack
    product: Product
    real: Vector
    imaginary: Vector
    ends: Matrix
    flow: Matrix
    normal: Stack
    others: Product


def monodromy_of(system: Any, parts: int = 0) -> Monodromy:
    """Return the room of a system of cycles, for no fewer than so many parts of intervals."""
    n, d, intervals = system.states_count, system.degree, system.intervals
    length = (_LONG * math.factorial(2 * d) * math.factorial(2 * d + 1) / math.factorial(d) ** 2) ** (1 / (2 * d + 1))
    turn = np.linalg.inv(system.turn)[None] if system.order > 1 else np.empty((0, n, n))
    matrices, planar = np.empty((max(intervals, parts) + len(turn), n, n)), system.autonomous and n == 2 and not len(turn)
    return Monodromy(
        system.basis.points, system.basis.value, system.basis.slope, np.diff(system.mesh),
        np.empty(intervals + 1, np.int64), turn, system.gauss_weights, system.order_of_states, length,
        int(system.autonomous), int(planar), np.empty((intervals * d, n, n)), np.empty((d, n, n)), np.empty(1),
        np.empty((d * n, (d + 1) * n)), np.empty((d + 1) * n, np.int64), matrices, product_of(len(matrices), n),
        np.empty(n), np.empty(n), np.empty((len(matrices), n)), np.empty((len(matrices), system._field.count)),
        np.empty((len(matrices), n - 1, n - 1)), product_of(len(matrices), max(n - 1, 1)),
    )  # fmt: skip


def larger(system: Any, room: Monodromy) -> Monodromy:
    """Return a room for the parts of intervals that another one had no room for, and some more."""
    return monodromy_of(system, 3 * int(room.starts[-1]) // 2)


def ends_of_parts(mesh: Array, room: Monodromy) -> Array:
    """Return where the parts of intervals begin, and where the last ends."""
    counts = np.diff(room.starts)
    begins, h, first = (np.repeat(each, counts) for each in (mesh[:-1], room.h / counts, room.starts[:-1]))
    return np.append(begins + h * (np.arange(len(first)) - first), mesh[-1])


@kernel(reorder=False, last=True)
def fill_multipliers(room: Monodromy, drifted: int) -> int:
    """Fill in the logarithms, or where one has ``drifted`` with the flow split off; return what comes of it."""
    real, imaginary, n = room.real, room.imaginary, room.real.size
    if drifted:
        _split_flow(room, room.turn.shape[0] + room.starts[room.h.size])
    else:
        room.starts[0] = 0
        for j in range(room.h.size):
            room.starts[j + 1] = room.starts[j] + (1 if room.planar else _parts(room, j))
        count = room.turn.shape[0] + room.starts[room.h.size]
        if count > room.matrices.shape[0]:
            return FULL
        _condense(room)
        fill_logarithms(room.matrices[:count], room.product, real, imaginary)
        if real[0] != real[0] and not room.planar:  # noqa: PLR0124
            return NOT_FINITE
        if room.autonomous and not room.planar and not nearest_to_one(room)[1] <= APART:
            return DRIFTED
    total, sum_, least = 0.0, 0.0, math.inf
    for q in range(room.quadrature.size):
        trace = 0.0
        for a in range(n):
            trace += room.jacobian[q, a, a]
        total += room.quadrature[q] * trace
    for a in range(n):
        sum_, least = sum_ + real[a], min(least, real[a])
    nearest, count = nearest_to_one(room)[0], 0
    for a in range(n):
        count += 1 if real[a] <= least + LOCATED else 0
    if not room.autonomous or not real[nearest] <= least + LOCATED:  # the error of the one that is 1 shall show
        for a in range(n):  # over one interval a Gauss method takes e^-1000 for a number near one
            if real[a] <= least + LOCATED:
                real[a] += (total - sum_) / count
    if room.planar:  # the other one is known whatever round-off has made of the one that is 1
        nearest, error = nearest_to_one(room)
        one = 0.0 if not error <= APART else real[nearest] if imaginary[nearest] == 0.0 else error
        real[0], real[1] = max(one, total), min(one, total)
        imaginary[0] = imaginary[1] = 0.0
    return KNOWN


@helper
def _split_flow(room: Monodromy, count: int) -> None:
    """Fill in the logarithms where each matrix takes the direction of the flow to the next one, which is split off.

    With v_j of unit length and an orthonormal basis Q_j of what is normal to it, of a reflection,

        F_j [v_j-1  Q_j-1] = [v_j  Q_j] [ a_j   *  ]
                                        [  0   B_j ]

    and the eigenvalues are the product of the numbers a_j, which are positive, and those of the product of the B_j. What
    the matrices leave of the zeros is round-off and dropped: it would grow with the product.
    """
    n, total, at = room.real.size, 0.0, room.real.size - 1
    for j in range(count):
        size = 0.0
        for a in range(n):
            size += room.flow[j, a] ** 2
        for a in range(n):
            room.ends[j, a] = room.flow[j, a] / math.copysign(math.sqrt(size), room.flow[j, 0]) + (1.0 if a == 0 else 0.0)
    for j in range(count):
        left, right, matrix = room.ends[(j + 1) % count], room.ends[j], room.matrices[j]
        for side in range(2):
            for a in range(n):
                part = 0.0
                for b in range(n):
                    part += matrix[b, a] * left[b] / left[0] if side else matrix[a, b] * right[b] / right[0]
                for b in range(n):
                    if side:
                        matrix[b, a] -= part * left[b]
                    else:
                        matrix[a, b] -= part * right[b]
        total += math.log(abs(matrix[0, 0]))
        for a in range(n - 1):
            for b in range(n - 1):
                room.normal[j, a, b] = matrix[a + 1, b + 1]
    if n > 1:
        fill_logarithms(room.normal[:count], room.others, room.real[: n - 1], room.imaginary[: n - 1])
    while at > 0 and not room.real[at - 1] >= total:
        room.real[at], room.imaginary[at] = room.real[at - 1], room.imaginary[at - 1]
        at -= 1
    room.real[at], room.imaginary[at] = total, 0.0


@helper
def nearest_to_one(room: Monodromy) -> tuple[int, float]:
    """Return the place of the logarithm nearest to zero, and its size."""
    place, least = 0, math.inf
    for a in range(room.real.size):
        size = math.hypot(room.real[a], room.imaginary[a])
        if size < least:
            place, least = a, size
    return place, least


@helper
def _parts(room: Monodromy, j: int) -> int:
    """Return into how many parts an interval is divided: those over which perturbations do not grow and decay too much.

    By the eigenvalues in its middle.
    """
    n, d, size, growth = room.real.size, room.jacobian.shape[0] // room.h.size, 0.0, 0.0
    middle = room.jacobian[j * d + d // 2]
    for a in range(n):  # bounds of both
        others = 0.0
        for b in range(n):
            others += abs(middle[a, b]) if b != a else 0.0
        size, growth = max(size, others + abs(middle[a, a])), max(growth, others + middle[a, a])
    if not (room.h[j] * size > room.length and room.h[j] * growth > _GROWS):
        return 1
    for a in range(n):
        for b in range(n):
            room.product.square[0, a, b] = middle[a, b]
    real, imaginary = room.product.parts[:1], room.product.parts[1:]
    fill_eigenvalues(room.product.square, n, real, imaginary)
    size, growth = 0.0, 0.0
    for a in range(n):
        size, growth = max(size, math.hypot(real[0, a], imaginary[0, a])), max(growth, real[0, a])
    return 1 + int(min(room.h[j] * size / room.length, _PARTS - 1.0)) if room.h[j] * growth > _GROWS else 1


@helper
def _condense(room: Monodromy) -> None:
    """Fill the transition matrices of all parts, with the polynomial through the derivatives at the Gauss points."""
    d, n, intervals = room.points.size, room.real.size, room.h.size
    if room.starts[intervals] == intervals:
        condense(room.value, room.slope, room.h, room.jacobian, room.block, room.pivots, room.matrices[:intervals])
    for j in range(0 if room.starts[intervals] == intervals else intervals):
        first, parts = room.starts[j], room.starts[j + 1] - room.starts[j]
        room.length_of_part[0] = room.h[j] / parts
        for i in range(parts):
            for q in range(d):
                for a in range(n):
                    for b in range(n):
                        room.part[q, a, b] = 0.0
                for m in range(d):
                    share = 1.0
                    for k in range(d):
                        place = (i + room.points[q]) / parts - room.points[k]
                        share *= place / (room.points[m] - room.points[k]) if k != m else 1.0
                    for a in range(n):
                        for b in range(n):
                            room.part[q, a, b] += share * room.jacobian[j * d + m, a, b]
            matrices = room.matrices[first + i : first + i + 1]
            condense(room.value, room.slope, room.length_of_part, room.part, room.block, room.pivots, matrices)
    for a in range(n if room.turn.shape[0] else 0):
        for b in range(n):
            room.matrices[room.starts[intervals], a, b] = room.turn[0, a, b]


#: Values that are compared in each interval, per degree.
_LOOKS = 4
#: Parabolas through three places near an extreme value: the error falls with the sixth power of their distance.
_PARABOLAS = 2


class Curve(NamedTuple):
    """A piecewise polynomial: ``nodes`` and ``barycentric`` (d + 1,) of its basis, ``mesh`` (N + 1,) from 0 to 1."""

    nodes: Vector
    barycentric: Vector
    mesh: Vector


def extremes(degree: int, mesh: Array, x: Array, n: int) -> Array:
    """Return the largest and the smallest value of each state, shape (n, 2); x begins with the states at the nodes.

    The extreme one of several values in each interval is moved to the vertex of the parabola through three places near it.
    """
    tables, found = basis(degree), np.empty((n, 2))
    find(Curve(tables.nodes, tables.barycentric, mesh), _values(degree), x, found)
    return found


@functools.cache
def _values(degree: int) -> Array:
    """Return the matrix from the nodal values of an interval to the values that are compared."""
    tables, count = basis(degree), _LOOKS * degree
    return interpolation(tables.nodes, tables.barycentric, np.linspace(0, 1, count, endpoint=False))


@helper
def _at(curve: Curve, x: ReadOnlyVector, n: int, state: int, t: float) -> float:
    """Return the value of a state at a time from 0 to 1."""
    nodes, barycentric, mesh = curve
    low, high = 0, mesh.size - 1
    while high - low > 1:
        middle = (low + high) // 2
        if mesh[middle] <= t:
            low = middle
        else:
            high = middle
    s, first = (t - mesh[low]) / (mesh[high] - mesh[low]), low * (nodes.size - 1)
    above, below = 0.0, 0.0
    for m in range(nodes.size):
        value: float = x[(first + m) * n + state]
        if s == nodes[m]:
            return value
        share = barycentric[m] / (s - nodes[m])
        above += share * value
        below += share
    return above / below


@kernel(reorder=False, last=True)
def find(curve: Curve, values: Matrix, x: ReadOnlyVector, found: Matrix) -> None:
    """Fill the extremes (n, 2) of the states in x; ``values`` (looks, d + 1) takes nodal values to those that are compared."""
    n, looks, d, mesh = found.shape[0], values.shape[0], curve.nodes.size - 1, curve.mesh
    for state in range(n):
        for side in range(2):
            sign, known, at, apart = 1.0 - 2.0 * side, -math.inf, 0.0, 0.0
            for j in range(mesh.size - 1):
                for i in range(looks):
                    value = 0.0
                    for m in range(d + 1):
                        value += values[i, m] * x[(j * d + m) * n + state]
                    if sign * value > known:
                        known, apart = sign * value, (mesh[j + 1] - mesh[j]) / looks
                        at = mesh[j] + i * apart
            for _ in range(_PARABOLAS):
                before, here = sign * _at(curve, x, n, state, (at - apart) % 1.0), sign * _at(curve, x, n, state, at % 1.0)
                behind = sign * _at(curve, x, n, state, (at + apart) % 1.0)
                bend = before - 2 * here + behind
                if bend < 0:
                    at += apart * min(1.0, max(-1.0, (before - behind) / (2 * bend)))
                apart /= 10
            found[state, side] = sign * max(known, sign * _at(curve, x, n, state, at % 1.0))
