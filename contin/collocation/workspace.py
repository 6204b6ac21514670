"""The arrays in which a kernel solves the discrete equations of one mesh: made once, filled in each call."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from contin.arrays import Array
from contin.collocation.assembly import Tables
from contin.collocation.projection import Projections
from contin.functions.interpreter import Loaded
from contin.functions.kernel_parts import IndexVector, Matrix, Stack, Vector, helper
from contin.linalg.layout import Layout
from contin.linalg.segments import Share


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


def workspace(system: Any, rows: int) -> Workspace:
    """Return the work space of a system on a mesh with so many linear conditions besides, which each call fills."""
    n, field, ends = system._n, system._field, system._boundary
    of_field, of_ends = system._columns
    codes = Codes(field.load(), field.load(of_field), ends.load(), ends.load(of_ends))
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
        empty((0, n)), empty((0, 0, 0)), np.zeros(1), system.projections,
    )  # fmt: skip
    return Workspace(codes, mesh, values)
