"""Newton's method on a mesh in one call of a kernel, which decides as `contin.core.newton` does.

It serves functions that are recorded, meshes of one segment, and linear conditions besides. What it cannot decide by itself,
whether updates that no longer shrink are round-off, is left to Python.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from contin.collocation.assembly import Bordering, assemble, at_points, collocate
from contin.collocation.projection import fill_projections
from contin.collocation.workspace import Workspace, put_free
from contin.functions.interpreter import Points, run_loaded
from contin.functions.kernel import kernel
from contin.functions.kernel_parts import Vector, helper
from contin.linalg.condensation import Factored
from contin.linalg.convergence import CHORDS, diverges, estimated_rate, has_converged, stagnates, subtract, wants_jacobian
from contin.linalg.elimination import factorize
from contin.linalg.layout import Blocks
from contin.linalg.substitution import solve

#: With factors from elsewhere the first update is below this, and each of the next below this part of the one before: then a
#: few steps reach round-off, where slower ones would take as long as a factorization.
CLOSE = 0.03
#: An update of a few units in the last place: with it x solves the equations as well as any number can.
EXACT = 1e-15

#: An update with a new Jacobian below this leaves that one right at the solution, but for so much: tangents are as exact.
RIGHT_THERE = 1e-13

#: What a call comes to: converged; updates no longer shrink, or Python must evaluate conditions; no convergence; the equations
#: are not finite at x. Inside it, converged with factors that are right at x.
CONVERGED, STAGNATES, FAILED, NOT_FINITE, RIGHT = range(5)
#: Places in the report: iterations, the error left, the sign of the determinant; then the updates' sizes.
ITERATIONS, ERROR, SIGN, UPDATES = range(4)


class Control(NamedTuple):
    """The tolerance, the most iterations (0: x is a solution), and what is wanted.

    ``chords``: no more than chord steps with the factors at hand. ``linearize``: the matrix right at the corrected x, and the
    unit tangent.
    """

    tolerance: float
    most: int
    chords: int
    linearize: int


@helper
def _evaluate(codes, mesh, room, x, slopes):
    """Fill values at x and, with ``slopes``, derivatives; return whether Python need not do it."""
    n = room.points.shape[1]
    put_free(mesh, room, x)
    at_points(mesh.tables.value, x, room.points)
    for a in range(n):
        room.start[0, a], room.end[0, a] = x[a], x[mesh.states - n + a]
    inside, ends = Points(mesh.times, room.points, room.none), Points(room.zero, room.start, room.end)
    if slopes:
        room.at[0] = math.nan
        run_loaded(codes.field_slopes, room.p, inside, room.field, room.jacobian)
        run_loaded(codes.ends_slopes, room.p, ends, room.boundary, room.at_ends)
    else:
        run_loaded(codes.field, room.p, inside, room.field, room.nothing)
        run_loaded(codes.ends, room.p, ends, room.boundary, room.nothing)
    given = room.projections, room.p, x, mesh.states, room.rows, 1 if slopes else 0
    return room.projections.total == 0 or fill_projections(*given) == 1


@helper
def _fill_residual(mesh, room, x):
    """Fill the residual at x, that of the linear conditions included, from the values there."""
    right = room.right[0]
    collocate(
        room.points.shape[1], mesh.tables.slope, mesh.tables.weights, mesh.h, x, room.field, room.boundary,
        right[: mesh.conditions],
    )  # fmt: skip
    projections = room.projections
    for q in range(projections.total):
        right[mesh.conditions + q] = projections.values[q]
    for q in range(projections.total, room.rows.shape[0]):
        total = 0.0
        for i in range(x.size):
            total += room.rows[q, i] * x[i]
        right[mesh.conditions + q] = total - room.targets[q]


@helper
def _factor(mesh, room, matrix):
    """Factor the matrix of the derivatives at hand; return the sign of its determinant."""
    factors = matrix.factors
    blocks = Blocks(factors.local, factors.border, matrix.corners[0], matrix.first, matrix.last)
    around = Bordering(room.columns, room.rows)
    assemble(mesh.layout, mesh.tables, mesh.h, room.jacobian, room.at_ends, around, blocks, mesh.whole)
    return factorize(mesh.layout, factors, matrix.corners, matrix.first, matrix.last, matrix.carried, mesh.whole)


@helper
def _solve(mesh, room, matrix):
    """Solve for the right-hand side at hand."""
    solve(mesh.layout, matrix.factors, room.right, room.update, matrix.work, mesh.whole)


@helper
def _chord_steps(codes, mesh, room, matrix, x, tolerance, report):
    """Chord steps with the factors at hand, for an x that is close."""
    before = 1.0
    for number in range(CHORDS):
        if not _evaluate(codes, mesh, room, x, False):
            return STAGNATES
        _fill_residual(mesh, room, x)
        _solve(mesh, room, matrix)
        size = subtract(x, room.update[0])
        report[ITERATIONS], report[ERROR], report[UPDATES + number] = number + 1, size, size
        if size <= EXACT:
            return CONVERGED
        if not size < CLOSE * before:
            return FAILED
        if number > 0:
            ratio = size / before
            report[ERROR] = size * ratio / (1 - ratio)
            if report[ERROR] <= tolerance:
                return CONVERGED
        before = size
    return FAILED


@helper
def _iterate(codes, mesh, room, matrix, x, control, report):
    """Newton's method with a new Jacobian where chord steps are not expected to do."""
    before, size, moved, fresh, tolerance = math.inf, math.inf, 1.0, True, control.tolerance
    for number in range(control.most):
        if not _evaluate(codes, mesh, room, x, fresh):
            return STAGNATES
        _fill_residual(mesh, room, x)
        if fresh:
            report[SIGN] = _factor(mesh, room, matrix)
        _solve(mesh, room, matrix)
        before, size = size, subtract(x, room.update[0])
        report[ITERATIONS], report[UPDATES + number] = number + 1, size
        if not size < math.inf:
            return FAILED
        moved = size if fresh else moved + size
        rate = estimated_rate(size, before, moved, fresh)
        report[ERROR] = size * rate
        if has_converged(size, rate, number + 1, tolerance):
            return RIGHT if fresh and size <= RIGHT_THERE else CONVERGED
        if stagnates(size, rate, number + 1):
            return STAGNATES
        if number > 1 and diverges(size, before):
            return FAILED
        fresh = wants_jacobian(size, rate, tolerance)
    return FAILED


@helper
def _linearize(work, matrix, x, weights, tangent, report, known):
    """Factor the matrix right at x, unless the factors at hand are ``known`` to be those, and fill the unit tangent."""
    codes, mesh, room = work
    if not _evaluate(codes, mesh, room, x, not known):
        return STAGNATES
    _fill_residual(mesh, room, x)
    for i in range(room.right.shape[1] - 1):
        if not abs(room.right[0, i]) < math.inf:
            return NOT_FINITE
    for i in range(x.size):
        room.at[i] = x[i]
    if not known:
        report[SIGN] = _factor(mesh, room, matrix)
    right, last = room.right[0], room.right.shape[1] - 1
    for i in range(last):
        right[i] = 0.0
    right[last] = 1.0
    _solve(mesh, room, matrix)
    total = 0.0
    for i in range(x.size):
        tangent[i] = room.update[0, i]
        total += weights[i] * tangent[i] * tangent[i]
    length = math.sqrt(total)
    for i in range(x.size):
        tangent[i] /= length
    return CONVERGED


@kernel(reorder=False)
def correct_on_mesh(
    work: Workspace, matrix: Factored, control: Control, x: Vector, weights: Vector, tangent: Vector, report: Vector
) -> int:
    """Correct x in place; return what it came to, with the numbers in the ``report``."""
    codes, mesh, room = work
    done: int = CONVERGED
    if control.chords:
        done = _chord_steps(codes, mesh, room, matrix, x, control.tolerance, report)
    elif control.most > 0:
        done = _iterate(codes, mesh, room, matrix, x, control, report)
    if done in (CONVERGED, RIGHT) and control.linearize:
        done = _linearize(work, matrix, x, weights, tangent, report, done == RIGHT)
    return CONVERGED if done == RIGHT else done
