"""Newton's method on a mesh in one call of a kernel, which decides as `contin.core.newton` does, and the arrays it works in.

It serves functions that are recorded, meshes of one segment, and linear conditions besides. What it cannot decide by itself,
whether updates that no longer shrink are round-off, is left to Python.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from contin.arrays import Array
from contin.collocation.assembly import Bordering, Tables, assemble, at_points, collocate
from contin.collocation.projection import Projections, fill_projections
from contin.functions.interpreter import Loaded, Points, run_loaded
from contin.kernels.kernel import kernel
from contin.kernels.kernel_parts import IndexVector, Matrix, Stack, Vector, helper
from contin.linalg import convergence
from contin.linalg.blocks import Blocks, Layout, Share
from contin.linalg.condensation import Factored, solve
from contin.linalg.convergence import CHORDS, judge_update, subtract
from contin.linalg.elimination import factorize


class Codes(NamedTuple):
    """Right-hand side and integrands, and boundary conditions; each alone and with its derivatives."""

    field: Loaded
    field_slopes: Loaded
    ends: Loaded
    ends_slopes: Loaded


class Mesh(NamedTuple):
    """The discretization. ``free`` are places of parameters, ``states`` is the place of the first one in x."""

    layout: Layout
    tables: Tables
    h: Vector
    times: Vector
    free: IndexVector
    states: int
    conditions: int
    whole: Share


class Values(NamedTuple):
    """What is computed at one x: parameters p, states at Gauss points and at both ends, values and derivatives of functions.

    ``at`` (size,) is where derivatives were taken last. ``rows`` (r, size) are linear conditions with the values ``targets``
    (r,), the last one that of a step; the first ones are derivatives where there are ``projections``. ``none``, ``nothing`` and
    ``zero`` are absent second states, absent derivatives, and the t of boundary conditions.
    """

    p: Vector
    at: Vector
    points: Matrix
    start: Matrix
    end: Matrix
    field: Matrix
    jacobian: Stack
    boundary: Matrix
    at_ends: Stack
    rows: Matrix
    targets: Vector
    columns: Matrix
    right: Matrix
    update: Matrix
    none: Matrix
    nothing: Stack
    zero: Vector
    projections: Projections


class Workspace(NamedTuple):
    """All of it."""

    codes: Codes
    mesh: Mesh
    values: Values


@helper
def put_free(mesh: Mesh, values: Values, x: Array) -> None:
    """Put the free parameters of x among all."""
    for i in range(mesh.free.size):
        values.p[mesh.free[i]] = x[mesh.states + i]


def codes_of(system: Any) -> Codes:
    """Return the programs of a system, the same on all meshes."""
    field, ends, (of_field, of_ends) = system._field, system._boundary, system._columns
    return Codes(field.load(), field.load(of_field), ends.load(), ends.load(of_ends))


def workspace(system: Any, codes: Codes, projections: Projections, rows: int) -> Workspace:
    """Return the work space of a system on a mesh with so many linear conditions besides, which each call fills."""
    n, field, ends, (of_field, of_ends) = system._n, system._field, system._boundary, system._columns
    whole = system._segments(0)
    mesh = Mesh(
        system._layout, system.tables, system._h, system.gauss_times, system._free, system.state_size, system._conditions, whole
    )
    points, empty = system.gauss_times.size, np.empty
    values = Values(
        system.scaled_parameters(np.zeros(system.size)), np.full(system.size, np.nan), empty((points, n)), empty((1, n)),
        empty((1, n)), empty((points, field.count)),
        np.zeros((points, field.count, of_field.width)), empty((1, ends.count)), np.zeros((1, ends.count, of_ends.width)),
        empty((rows, system.size)), empty(rows), empty((0, system._conditions + rows - 1)), empty((1, system.size)),
        empty((1, system.size)),
        empty((0, n)), empty((0, 0, 0)), np.zeros(1), projections,
    )  # fmt: skip
    return Workspace(codes, mesh, values)


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
def evaluate(codes: Codes, mesh: Mesh, room: Values, x: Array, slopes: bool) -> bool:
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
def _factor(mesh, room, matrix, around):
    """Factor the matrix of the derivatives at hand, bordered; return the sign of its determinant."""
    factors = matrix.factors
    blocks = Blocks(factors.local, factors.border, matrix.corners[0], matrix.first, matrix.last)
    assemble(mesh.layout, mesh.tables, mesh.h, room.jacobian, room.at_ends, around, blocks, mesh.whole)
    return factorize(mesh.layout, factors, matrix.corners, matrix.first, matrix.last, matrix.carried, mesh.whole)


@helper
def _solve(mesh, room, matrix):
    solve(mesh.layout, matrix.factors, room.right, room.update, matrix.work, mesh.whole)


@helper
def _chord_steps(codes, mesh, room, matrix, x, tolerance, report):
    """Chord steps with the factors at hand, for an x that is close."""
    before = 1.0
    for number in range(CHORDS):
        if not evaluate(codes, mesh, room, x, False):
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
    before, size, moved, fresh = math.inf, math.inf, 1.0, True
    for number in range(control.most):
        if not evaluate(codes, mesh, room, x, fresh):
            return STAGNATES
        _fill_residual(mesh, room, x)
        if fresh:
            report[SIGN] = _factor(mesh, room, matrix, Bordering(room.columns, room.rows))
        _solve(mesh, room, matrix)
        before, size = size, subtract(x, room.update[0])
        report[ITERATIONS], report[UPDATES + number] = number + 1, size
        said, report[ERROR], moved = judge_update(size, before, moved, number + 1, fresh, control.tolerance)
        if said == convergence.CONVERGED:
            return RIGHT if fresh and size <= RIGHT_THERE else CONVERGED
        if said == convergence.STAGNATES:
            return STAGNATES
        if said == convergence.DIVERGES:
            return FAILED
        fresh = said == convergence.FRESH
    return FAILED


@helper
def _linearize(work, matrix, x, weights, tangent, report, known):
    """Factor the matrix right at x, unless the factors at hand are ``known`` to be those, and fill the unit tangent."""
    codes, mesh, room = work
    if not evaluate(codes, mesh, room, x, not known):
        return STAGNATES
    _fill_residual(mesh, room, x)
    for i in range(room.right.shape[1] - 1):
        if not abs(room.right[0, i]) < math.inf:
            return NOT_FINITE
    for i in range(x.size):
        room.at[i] = x[i]
    if not known:
        report[SIGN] = _factor(mesh, room, matrix, Bordering(room.columns, room.rows))
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


@kernel(reorder=False)
def linearize_on_mesh(work: Workspace, matrix: Factored, around: Bordering, x: Vector, residual: Vector) -> float:
    """Fill the residual at x of the conditions of the problem, and factor their derivatives, bordered; return the sign."""
    codes, mesh, room = work
    evaluate(codes, mesh, room, x, True)
    n, tables = room.points.shape[1], mesh.tables
    collocate(n, tables.slope, tables.weights, mesh.h, x, room.field, room.boundary, residual)
    return _factor(mesh, room, matrix, around)
