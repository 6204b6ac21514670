"""Floquet multipliers: transition matrices of intervals, and eigenvalues of their product, of any size, to relative accuracy.

The product P = F_N ... F_1 of transition matrices may have eigenvalues of 1e8 and 1e-16, or far beyond what numbers hold. With
orthogonal Q_j and upper triangular R_j, F_j Q_{j-1} = Q_j R_j, so

    Q_0^T P Q_0 = (Q_0^T Q_N) (R_N ... R_1).

Repeated with Q_N as the next Q_0 (orthogonal iteration; Lust 2001 begins in the same way), Q_0^T Q_N becomes block diagonal,
with a block for each group of eigenvalues of similar size. The product of the triangular matrices is taken block by block, its
size kept as a logarithm, so that groups of very different size do not meet.

Transition matrices of a linearized collocation: each takes a perturbation at the left end of an interval to its right end.

The collocation equations of an interval, for degree 3 and n states, in blocks of n rows and n columns:

                   left   interior   right
    Gauss point 1 [ S-A   S-A  S-A   S-A ]
    Gauss point 2 [ S-A   S-A  S-A   S-A ]     S: slope of the node on the diagonal, A: h times value of the node times J
    Gauss point 3 [ S-A   S-A  S-A   S-A ]

With the interior eliminated n rows [A B] are left, and the transition matrix is -B^-1 A.
"""

from __future__ import annotations

import functools
import math
from typing import NamedTuple

import numpy as np

from contin.arrays import Array, ComplexArray
from contin.draws import generator
from contin.kernels.kernel import kernel
from contin.kernels.kernel_parts import IndexVector, Matrix, Stack, Vector, helper
from contin.levels import MOST_STEPS, ROUND_OFF, TINY
from contin.linalg.elimination import Step, eliminate
from contin.linalg.small import fill_eigenvalues
from contin.linalg.vector import PANEL

#: Groups whose sizes differ by less than this factor are one: iteration would take long to separate them, and the
#: eigenvalues of a block with such a spread are accurate.
_APART = 1e4


class Iterates(NamedTuple):
    """The work space of an orthogonal iteration; bases are given by rows.

    ``first`` and ``last`` (n, n) are Q_0 and Q_N, ``triangles`` (N, n, n) are R_j, ``coupling`` (n, n) is Q_0^T Q_N,
    ``product`` (n, n) one of the products of triangles, ``vectors`` (n, n) are columns of F_j Q_{j-1}, ``sizes`` (n,) are
    logarithms.
    """

    first: Matrix
    last: Matrix
    triangles: Stack
    coupling: Matrix
    product: Matrix
    vectors: Matrix
    sizes: Vector


class Groups(NamedTuple):
    """Groups of eigenvalues of similar size: ``starts`` (n + 1,) are their first places, and n.

    Those of group g are the eigenvalues of its diagonal block in ``blocks`` (n, n), times the exponential of ``sizes[g]``.
    """

    starts: IndexVector
    blocks: Matrix
    sizes: Vector


class Product(NamedTuple):
    """Where the eigenvalues of a product are computed: the ``basis`` (n, n) to start from, and room for those of one block."""

    basis: Matrix
    iterates: Iterates
    groups: Groups
    square: Stack
    parts: Matrix


def log_eigenvalues(factors: Array) -> ComplexArray:
    """Return the logarithms of the eigenvalues of F_N ... F_1, shape (n,), largest first; ``factors`` is (N, n, n), F_1 first.

    The imaginary part is in (-pi, pi]; a zero eigenvalue gives -inf. All are NaN where a factor is not finite.

    Examples
    --------
    >>> print(log_eigenvalues(np.array([np.diag([1e200, 1e-200]), np.diag([1e200, -1e-200])])).round(3))
    [ 921.034+0.j    -921.034+3.142j]
    """
    count, n, _ = factors.shape
    found = np.empty(n, dtype=complex)
    parts = np.empty((2, n))
    fill_logarithms(np.ascontiguousarray(factors), product_of(count, n), *parts)
    found.real, found.imag = parts
    return found


def product_of(count: int, n: int) -> Product:
    """Return the room for so many factors (n, n), or fewer."""
    first, last, coupling, product, vectors = np.empty((5, n, n))
    iterates = Iterates(first, last, np.empty((count, n, n)), coupling, product, vectors, np.empty(n))
    groups = Groups(np.empty(n + 1, np.int64), np.empty((n, n)), np.empty(n))
    return Product(_first_basis(n), iterates, groups, np.empty((1, n, n)), np.empty((2, n)))


@functools.lru_cache(maxsize=32)
def _first_basis(n: int) -> Array:
    """Return an orthogonal matrix to start from, always the same."""
    return np.ascontiguousarray(np.linalg.qr(generator("periodic").standard_normal((n, n)))[0].T)


@kernel(reorder=False, last=True)
def separate(factors: Stack, iterates: Iterates, groups: Groups) -> int:
    """Iterate from the first basis until groups of eigenvalues are apart; fill the groups, and return their number."""
    first, last, room, coupling, product, vectors, sizes = iterates
    n, count, triangles = sizes.size, 1, room[: factors.shape[0]]
    for _ in range(MOST_STEPS):
        for a in range(n):
            for b in range(n):
                last[a, b] = first[a, b]
        _triangularize(factors, last, triangles, vectors)
        for a in range(n):
            sizes[a] = 0.0
            for j in range(triangles.shape[0]):
                sizes[a] += math.log(max(abs(triangles[j, a, a]), TINY))
            for b in range(n):
                coupling[a, b] = 0.0
                for c in range(n):
                    coupling[a, b] += first[a, c] * last[b, c]
        count, coupled = 1, 0.0
        for g in range(1, n):
            if sizes[g - 1] - sizes[g] > math.log(_APART):
                groups.starts[count] = g
                count += 1
                for a in range(g, n):
                    for b in range(g):
                        coupled = max(coupled, abs(coupling[a, b]))
        if coupled < ROUND_OFF:
            break
        for a in range(n):
            for b in range(n):
                first[a, b] = last[a, b]
    groups.starts[0], groups.starts[count] = 0, n
    for g in range(count):
        start, end = groups.starts[g], groups.starts[g + 1]
        groups.sizes[g] = _multiply(triangles, start, end, product)
        for a in range(start, end):
            for b in range(start, end):
                groups.blocks[a, b] = 0.0
                for c in range(start, end):
                    groups.blocks[a, b] += coupling[a, c] * product[c, b]
    return count


@helper
def _triangularize(factors, q, triangles, work):
    """Overwrite Q_0 by Q_N, and fill all R_j, by Gram and Schmidt's method, each vector orthogonalized twice."""
    n = q.shape[0]
    for j in range(factors.shape[0]):
        for b in range(n):
            for a in range(n):
                work[b, a] = 0.0
                triangles[j, b, a] = 0.0
                for c in range(n):
                    work[b, a] += factors[j, a, c] * q[b, c]
        for b in range(n):
            for turn in range(2 * b):
                c, part = turn % b, 0.0
                for a in range(n):
                    part += q[c, a] * work[b, a]
                triangles[j, c, b] += part
                for a in range(n):
                    work[b, a] -= part * q[c, a]
            largest = 0.0  # the sum of squares may overflow
            for a in range(n):
                largest = max(largest, abs(work[b, a]))
            length = 0.0
            for a in range(n):
                length += (work[b, a] / largest) ** 2 if largest > 0 else 0.0
            length = largest * math.sqrt(length)
            triangles[j, b, b] = length
            factor = 1 / length if length > 0 else 0.0
            for a in range(n):
                q[b, a] = work[b, a] * factor


@helper
def _multiply(triangles, start, end, product):
    """Fill the block from ``start`` to ``end`` of a product of upper triangular matrices; return its size as a logarithm."""
    size = 0.0
    for a in range(start, end):
        for b in range(start, end):
            product[a, b] = 1.0 if a == b else 0.0
    for j in range(triangles.shape[0]):
        largest = 0.0
        for b in range(start, end):
            for a in range(start, end):  # row a needs the rows below it as they were
                value = 0.0
                for c in range(a, end):
                    value += triangles[j, a, c] * product[c, b]
                product[a, b] = value
                largest = max(largest, abs(value))
        if largest == 0:
            return -math.inf
        for a in range(start, end):
            for b in range(start, end):
                product[a, b] /= largest
        size += math.log(largest)
    return size


@helper
def _fill_of_two(a, b, c, d, real, imaginary):
    """Fill in the eigenvalues of [[a, b], [c, d]], without cancellation."""
    half, product = (a - d) / 2, b * c
    square = half * half + product
    if square < 0:
        real[0] = real[1] = (a + d) / 2
        imaginary[0], imaginary[1] = math.sqrt(-square), -math.sqrt(-square)
        return
    larger = half + math.copysign(math.sqrt(square), half)
    real[0], real[1] = d + larger, d - product / larger if larger != 0.0 else d
    imaginary[0] = imaginary[1] = 0.0


@helper
def _fill_of_block(room, start, end, real, imaginary):
    """Fill in the eigenvalues of a diagonal block."""
    blocks, m = room.groups.blocks, end - start
    if m == 1:
        real[0], imaginary[0] = blocks[start, start], 0.0
    elif m == 2:
        a, b = blocks[start, start], blocks[start, start + 1]
        _fill_of_two(a, b, blocks[start + 1, start], blocks[start + 1, start + 1], real, imaginary)
    else:
        for i in range(m):
            for j in range(m):
                room.square[0, i, j] = blocks[start + i, start + j]
        fill_eigenvalues(room.square, m, room.parts[:1], room.parts[1:])
        for i in range(m):
            real[i], imaginary[i] = room.parts[0, i], room.parts[1, i]


@kernel(reorder=False, last=True)
def fill_logarithms(factors: Stack, room: Product, real: Vector, imaginary: Vector) -> None:
    """Fill in the logarithms of the eigenvalues of F_N ... F_1, as `log_eigenvalues` returns them."""
    n, first, groups = real.size, room.iterates.first, room.groups
    for a in range(n):
        real[a], imaginary[a] = math.nan, 0.0
        for b in range(n):
            first[a, b] = room.basis[a, b]
    for j in range(factors.shape[0]):
        for a in range(n):
            for b in range(n):
                if not abs(factors[j, a, b]) < math.inf:
                    return
    count = separate(factors, room.iterates, groups)
    for g in range(count):
        start, end = groups.starts[g], groups.starts[g + 1]
        _fill_of_block(room, start, end, real[start:end], imaginary[start:end])
        for i in range(start, end):
            x, y = real[i], imaginary[i]
            if (x == 0.0 and y == 0.0) or groups.sizes[g] == -math.inf:
                x, y = -math.inf, 0.0
            else:
                x, y = math.log(math.hypot(x, y)) + groups.sizes[g], math.atan2(y, x)
            at = i
            while at > 0 and real[at - 1] < x:
                real[at], imaginary[at] = real[at - 1], imaginary[at - 1]
                at -= 1
            real[at], imaginary[at] = x, y


@helper
def _fill_block(value, slope, h, jacobian, first, turn, block):
    """Fill the equations of one interval, with the Gauss points from ``first`` on, by its nodes turned by so many places."""
    d, n = value.shape[0], jacobian.shape[1]
    for q in range(d):
        point = jacobian[first + q]
        for a in range(n):
            row = block[q * n + a]
            for m in range(d + 1):
                factor, start = -h * value[q, m], (m + turn) % (d + 1) * n
                for b in range(n):
                    row[start + b] = factor * point[a, b]
                row[start + a] += slope[q, m]


@kernel(last=True)
def condense(
    value: Matrix, slope: Matrix, h: Vector, jacobian: Stack, block: Matrix, pivots: IndexVector, result: Stack
) -> None:
    """Fill the transition matrices; ``block`` (d n, (d + 1) n) is work space for equations by [interior | right | left]."""
    rows, width = block.shape
    n = width - rows
    inner = rows - n
    for j in range(h.size):
        found = result[j]
        _fill_block(value, slope, h[j], jacobian, j * value.shape[0], value.shape[0], block)
        eliminate(block, Step(0, rows, 0, inner, inner, width), pivots)
        eliminate(block, Step(inner, rows, inner, rows, rows, width), pivots)
        for start in range((n - 1) // PANEL * PANEL, -1, -PANEL):  # of each panel the inverse triangle is kept
            end = min(start + PANEL, n)
            for a in range(start, end):
                for b in range(n):
                    found[a, b] = -block[inner + a, rows + b]
                    for c in range(end, n):
                        found[a, b] -= block[inner + a, inner + c] * found[c, b]
            for a in range(start, end):  # row a needs the rows below it as they were
                for b in range(n):
                    total = 0.0
                    for c in range(a, end):
                        total += block[inner + a, inner + c] * found[c, b]
                    found[a, b] = total
