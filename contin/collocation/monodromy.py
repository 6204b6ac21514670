"""Floquet multipliers of a cycle in a kernel, from the derivatives of the right-hand side at the Gauss points."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from contin.functions.kernel import kernel
from contin.functions.kernel_parts import IndexVector, Matrix, Stack, Vector, helper
from contin.levels import APART, LOCATED
from contin.linalg.periodic import Product, fill_logarithms, product_of
from contin.linalg.transitions import condense

#: What comes of it: multipliers; one of an autonomous system that should be 1 and has drifted; none, which are NaN.
KNOWN, DRIFTED, NOT_FINITE = range(3)


class Monodromy(NamedTuple):
    """The room for it.

    ``jacobian`` (N d, n, n) is given; ``order`` (n,) are the states by which its columns stand in a linearized system.
    ``matrices`` (N, n, n) are transitions and, where there is a symmetry, its inverse. ``real`` and ``imaginary`` (n,) are the
    logarithms found.
    """

    value: Matrix
    slope: Matrix
    h: Vector
    quadrature: Vector
    order: IndexVector
    autonomous: int
    planar: int
    jacobian: Stack
    block: Matrix
    pivots: IndexVector
    matrices: Stack
    product: Product
    real: Vector
    imaginary: Vector


def monodromy_of(system: Any) -> Monodromy:
    """Return the room of a system of cycles."""
    n, d, intervals = system.states_count, system.degree, system.intervals
    symmetric = system.order > 1
    matrices = np.empty((intervals + symmetric, n, n))
    if symmetric:
        matrices[-1] = np.linalg.inv(system.turn)
    return Monodromy(
        system.basis.value, system.basis.slope, np.diff(system.mesh), system.gauss_weights, system.order_of_states,
        int(system.autonomous), int(system.autonomous and n == 2 and not symmetric), np.empty((intervals * d, n, n)),
        np.empty((d * n, (d + 1) * n)), np.empty((d + 1) * n, np.int64), matrices, product_of(len(matrices), n),
        np.empty(n), np.empty(n),
    )  # fmt: skip


@kernel(reorder=False, last=True)
def fill_multipliers(room: Monodromy, known: int) -> int:
    """Fill in the logarithms, or put right by Liouville's formula those that are ``known``; return what comes of it."""
    real, imaginary, n = room.real, room.imaginary, room.real.size
    if not known:
        condense(room.value, room.slope, room.h, room.jacobian, room.block, room.pivots, room.matrices[: room.h.size])
        fill_logarithms(room.matrices, room.product, real, imaginary)
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
def nearest_to_one(room: Monodromy) -> tuple[int, float]:
    """Return the place of the logarithm nearest to zero, and its size."""
    place, least = 0, math.inf
    for a in range(room.real.size):
        size = math.hypot(room.real[a], room.imaginary[a])
        if size < least:
            place, least = a, size
    return place, least
