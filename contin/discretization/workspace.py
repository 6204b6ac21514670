"""The arrays in which a kernel solves the discrete equations of one mesh: made once, filled in each call."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from contin.arrays import Array
from contin.discretization.assembly import Tables
from contin.functions.batch import Batch
from contin.functions.interpreter import Loaded, load
from contin.functions.kernel_parts import IndexVector, Matrix, Stack, Vector, helper
from contin.functions.program import Program
from contin.linalg.layout import Layout
from contin.linalg.segments import Share, share


class Codes(NamedTuple):
    """Right-hand side and integrands, and boundary conditions; each alone and with its derivatives."""

    field: Loaded
    field_slopes: Loaded
    ends: Loaded
    ends_slopes: Loaded


class Sizes(NamedTuple):
    """What the equations are divided by, and their unknowns: `contin.discretization.scales`.

    ``states`` (n,), ``free`` (k,), ``field`` (n + n_int,) and ``ends`` (n_bc,) of values, ``field_inputs`` (n + k,) and
    ``ends_inputs`` (2 n + k,) of what they are differentiated by.
    """

    states: Vector
    free: Vector
    field: Vector
    ends: Vector
    field_inputs: Vector
    ends_inputs: Vector


class Mesh(NamedTuple):
    """The discretization. ``free`` are places of parameters, ``states`` is the place of the first one in x."""

    layout: Layout
    tables: Tables
    h: Vector
    times: Vector
    sizes: Sizes
    free: IndexVector
    states: int
    conditions: int
    whole: Share


class Values(NamedTuple):
    """What is computed at one x: parameters p, states at Gauss points and at both ends, values and derivatives of functions.

    ``at`` (size,) is where derivatives were taken last. ``rows`` (r, size) are linear conditions with the values ``targets``
    (r,), the last one that of a step. ``none``, ``nothing`` and ``zero`` are absent second states, absent derivatives, and
    the t of boundary conditions.
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


class Workspace(NamedTuple):
    """All of it."""

    codes: Codes
    mesh: Mesh
    values: Values


@helper
def scale(values: Array, sizes: Array) -> None:
    """Divide rows by sizes."""
    for i in range(values.shape[0]):
        for a in range(values.shape[1]):
            values[i, a] /= sizes[a]


@helper
def put_free(mesh: Mesh, values: Values, x: Array) -> None:
    """Put the free parameters of x among all, in the user's units."""
    for i in range(mesh.free.size):
        values.p[mesh.free[i]] = x[mesh.states + i] * mesh.sizes.free[i]


def workspace(system: Any, rows: int) -> Workspace:
    """Return the work space of a system on a mesh with so many linear conditions besides, which each call fills."""
    n, problem = system._n, system.problem
    field, ends = problem.batch("field"), problem.batch("boundary")
    of_field, of_ends = system._columns
    codes = Codes(*map(load, (*_programs(field, of_field.key), *_programs(ends, of_ends.key))))
    scales, ones = system.scales, np.ones
    states = ones(n) if scales is None else scales.states
    free = system.free_scales
    sizes = Sizes(
        states, free,
        ones(field.count) if scales is None else np.concatenate([states, scales.rows["integrals"]]),
        ones(ends.count) if scales is None else scales.rows["boundary"],
        np.concatenate([states[system._layout.order], free]), np.concatenate([states, states, free]),
    )  # fmt: skip
    tables = Tables(system.basis.value, system.basis.slope, system.basis.weights)
    whole = share(system.intervals, 0)
    mesh = Mesh(
        system._layout, tables, system._h, system._times, sizes, system._free, system.state_size, system._conditions, whole
    )
    points, empty = system._times.size, np.empty
    values = Values(
        system.parameters.copy(), np.full(system.size, np.nan), empty((points, n)), empty((1, n)), empty((1, n)),
        empty((points, field.count)),
        np.zeros((points, field.count, of_field.width)), empty((1, ends.count)), np.zeros((1, ends.count, of_ends.width)),
        empty((rows, system.size)), empty(rows), empty((0, system._conditions + rows - 1)), empty((1, system.size)),
        empty((1, system.size)),
        empty((0, n)), empty((0, 0, 0)), np.zeros(1),
    )  # fmt: skip
    return Workspace(codes, mesh, values)


def _programs(batch: Batch, columns: tuple[int, ...]) -> tuple[Program, Program]:
    """Return the programs of values, and of values with derivatives."""
    return batch._values_program(), batch._slopes(columns)[0]
