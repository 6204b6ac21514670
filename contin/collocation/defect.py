"""The discretization error of a solution on a mesh, from the factors that the corrector has left.

The polynomial u of degree d has a defect r = u' - h f(u) in an interval, which vanishes at the d Gauss points: it is the
Legendre polynomial P of degree d there, times a slowly changing a. The errors at the mesh points are integrals of r against
smooth functions; P is orthogonal to polynomials of lower degree, and so they are of the order h^(2 d).

1. c = the value of a in the middle, from r at both ends of the interval, where P is 1 and (-1)^d.
2. w = u - c Q, with Q' = P and Q = 0 at both ends, is better inside the intervals: the coefficient of P in its defect is of
   higher order. Without this step nothing would be seen of linear equations with constant coefficients.
3. g = the projection of the defect of w to polynomials of degree d - 1, at the Gauss points. It takes a quadrature at d + 1
   points; with d of them it is zero.
4. [F_x; row] e = [g; 0]: the errors e at the mesh points, and of the free parameters. What g leaves out of the defect of w is
   smaller by h.

Where a condition that the solution decides switches inside an interval (`contin.collocation.corners`), c is zero and the
projection is taken by a quadrature on either side of that place: the defect has a corner or a jump there.

The estimate takes values of the functions at d + 2 points an interval, and one substitution. It holds where the error is small;
where the mesh is much too coarse it is large, and no more than that.
"""

from __future__ import annotations

import functools
import threading
from typing import Any, NamedTuple

import numpy as np

from contin.arrays import Array
from contin.collocation.assembly import at_points
from contin.collocation.corners import Switching
from contin.collocation.mesh import basis, interpolation, near
from contin.collocation.newton import Codes, Values, Workspace, put_free
from contin.functions.interpreter import Loaded, Points, run_loaded
from contin.kernels.kernel import kernel
from contin.kernels.kernel_parts import Matrix, ReadOnlyVector, Vector, helper
from contin.levels import LOCATED
from contin.linalg.condensation import Factored, Factorization, solve
from contin.text import shown


class Finer(NamedTuple):
    """Tables of a degree d on the unit interval.

    ``points`` (d + 1,) Gauss points, one more than the collocation has, and ``weights`` theirs; ``value`` (d + 1, d + 1) takes
    nodal values there, ``bubble`` (d + 1,) holds Q there, and ``projection`` (d, d + 1) takes values there to values of the
    projection at the points of the collocation. ``slope`` (d, d + 1) takes nodal values to slopes at the latter points,
    ``end_slopes`` (2, d + 1) to slopes at both ends, the first one times (-1)^d.
    """

    points: Vector
    weights: Vector
    value: Matrix
    bubble: Vector
    projection: Matrix
    slope: Matrix
    end_slopes: Matrix

    def __repr__(self) -> str:
        return shown(self)


@functools.cache
def finer(degree: int) -> Finer:
    """Return the tables of a degree.

    Examples
    --------
    >>> tables = finer(2)
    >>> (tables.projection @ tables.points).round(12).tolist() == basis(2).points.round(12).tolist()  # linear functions stay
    True
    """
    tables, legendre = basis(degree), np.polynomial.legendre
    y, weights = legendre.leggauss(degree + 1)
    points, weights = (y + 1) / 2, weights / 2
    values, wanted = legendre.legvander(y, degree + 1), legendre.legvander(2 * tables.points - 1, degree - 1)
    bubble = (values[:, degree + 1] - values[:, degree - 1]) / (2 * (2 * degree + 1))
    projection = (wanted * (2 * np.arange(degree) + 1)) @ (values[:, :degree] * weights[:, None]).T
    value = interpolation(tables.nodes, tables.barycentric, points)
    # the slope has the degree d - 1: it is known from its values at the Gauss points
    lagrange = 1 / np.prod(tables.points[:, None] - tables.points + np.eye(degree), axis=1)
    end_slopes = interpolation(tables.points, lagrange, np.array([0.0, 1.0])) @ tables.slope
    end_slopes[0] *= (-1) ** degree
    return Finer(points, weights, value, bubble, projection, tables.slope, end_slopes)


def split(degree: int, ends: Array) -> tuple[Array, Array]:
    """Return points of Gauss quadratures between ``ends`` on the unit interval, and the projection from values there.

    Examples
    --------
    >>> points, projection = split(2, np.array([0.0, 0.4, 1.0]))
    >>> corner = projection @ np.maximum(0, points - 0.4)  # its mean is .18
    >>> round(float(basis(2).weights @ corner), 12)
    0.18
    """
    tables, legendre = finer(degree), np.polynomial.legendre
    lengths = np.diff(ends)[:, None]
    points = (ends[:-1, None] + lengths * tables.points).ravel()
    weights = (lengths * tables.weights).ravel()
    wanted = legendre.legvander(2 * basis(degree).points - 1, degree - 1) * (2 * np.arange(degree) + 1)
    return points, wanted @ (legendre.legvander(2 * points - 1, degree - 1) * weights[:, None]).T


class Defect:
    """What the estimates of all solutions on one mesh share."""

    def __repr__(self) -> str:
        return f"Defect({self.system!r})"

    def __init__(self, system: Any) -> None:
        self.system, self.tables, self.h = system, finer(system.degree), system._h
        self.times = (system.mesh[:-1, None] + self.h[:, None] * self.tables.points).ravel()
        self.weights = (self.h[:, None] * self.tables.weights).ravel()
        self.n = system.states_count
        #: Places in a residual where the integral conditions begin.
        self.conditions = self.n * system.degree * system.intervals + system.problem.boundary_size
        self.least_sizes = self._least_sizes()
        #: Mesh points where the right-hand side jumps: it has no value there that holds on both sides.
        self.broken = near(system.mesh, system.breaks, system.mesh[-1] - system.mesh[0])
        self._rooms: dict[int, Estimate | None] = {}  # by thread

    @property
    def room(self) -> Estimate | None:
        """Where a kernel makes the estimate; None where Python does: the functions are not recorded, or have jumps."""
        system, thread = self.system, threading.get_ident()
        if thread not in self._rooms:
            smooth = system.plain and system.workspace is not None and not system.breaks.size and not system.has_selections
            self._rooms[thread] = estimate_of(self) if smooth and system.size == system.equations + 1 else None
        return self._rooms[thread]

    def error(self, x: Array, factors: Any, columns: Any) -> float:
        """Return the largest estimated error of states, rates, free parameters and integrals, relative to 1 + size.

        It is NaN where the functions are not finite. States and rates (times the length of the domain) are divided by the sizes
        of the states. The size of an integral is that of its integrand, integrated, plus its size where all unknowns are as
        large as their sizes: an energy may vanish. Factors are those of [F_x; row] at the solution x or close to it;
        ``columns[name]`` are the integrals on this mesh; a kernel takes its own.
        """
        if isinstance(factors, Factorization) and factors.unknowns == self.system.size and (room := self.room) is not None:
            return estimate(self.system.workspace, factors.room, room, x)
        system, h, tables, n = self.system, self.h, self.tables, self.n
        points, left = np.empty((self.times.size, n)), np.zeros(system.equations + 1)
        at_mesh = x[: system.state_size].reshape(-1, n)[:: system.degree].copy()
        with np.errstate(all="ignore"):
            p = system.scaled_parameters(x)
            rates, moving = system.field_values(system.mesh, at_mesh, p), system.switching(x)
            if moving.places.size:  # a rate has no value there
                jumps = moving.places[moving.jumps & moving.settled]
                rates[np.abs(system.mesh[:, None] - jumps).argmin(axis=0)] = np.nan
            fill_points(n, tables, h, x, *self._rates_of_intervals(rates, at_mesh, p), points)
            rates[self.broken] = np.nan
            fill_left(n, tables, h, x, system.field_values(self.times, points, p), left, self.conditions)
            if moving.places.size:
                self._fill_split(x, p, moving, left)
            error = factors.solve(left)
            better = x - error
            largest = move(n, tables, x, error, points, at_mesh)
            largest = self._with_rates(better, rates, at_mesh, largest)
            if system.integrated:
                known = np.array([columns[name] for name in system.integrated])
                integrands = system.integrands(better, self.times, points)
                largest = largest_miss(self.weights, integrands, known, self.least_sizes, largest)
        return float(largest)

    def _fill_split(self, x: Array, p: Array, found: Switching, left: Array) -> None:
        """Fill g, step 3, anew in the intervals inside which a condition switches."""
        system, inside = self.system, found.places[~found.settled]
        intervals = np.clip(np.searchsorted(system.mesh, inside, side="right") - 1, 0, self.h.size - 1)
        for j in np.unique(intervals).tolist():
            h, rows = self.h[j], system.degree * self.n
            ends = np.concatenate([[0.0], (inside[intervals == j] - system.mesh[j]) / h, [1.0]])
            points, projection = split(system.degree, ends)
            field = system.field_values(system.mesh[j] + h * points, system.evaluate_scaled_in(x, j, points), p)[:, : self.n]
            local = x[j * rows : (j + 1) * rows + self.n].reshape(-1, self.n)
            left[j * rows : (j + 1) * rows] = (self.tables.slope @ local - h * (projection @ field)).ravel()

    def _rates_of_intervals(self, rates: Array, at_mesh: Array, p: Array) -> tuple[Array, Array]:
        """Return the rates at the first and at the last ends of the intervals, from those at the mesh points.

        At a jump they are taken beside it.
        """
        first, last, mesh = rates[:-1], rates[1:], self.system.mesh
        if self.broken.any():
            aside = LOCATED * self.h
            first = self.system.field_values(mesh[:-1] + aside, at_mesh[:-1], p)
            last = self.system.field_values(mesh[1:] - aside, at_mesh[1:], p)
        return first, last

    def left_by_newton(self, x: Array, residual: Array, factors: Any) -> float:
        """Return the part of such an error that no mesh makes smaller: of states, rates and free parameters, by the residual.

        Newton's method has left it, or round-off.
        """
        system, n, none = self.system, self.n, np.empty((0, self.n))
        at_mesh = x[: system.state_size].reshape(-1, n)[:: system.degree].copy()
        with np.errstate(all="ignore"):
            error = factors.solve(np.append(residual, 0.0))
            rates = system.field_values(system.mesh, at_mesh, system.scaled_parameters(x))
            largest = move(n, self.tables, x, error, none, at_mesh)
            return self._with_rates(x - error, rates, at_mesh, largest)

    def _with_rates(self, better: Array, rates: Array, at_mesh: Array, least: float) -> float:
        """Return the largest change of a rate at the mesh points, or a number that is larger."""
        system = self.system
        changed = system.field_values(system.mesh, at_mesh, system.scaled_parameters(better))
        return float(largest_change(self.n, system.mesh[-1] - system.mesh[0], rates, changed, least))

    def _least_sizes(self) -> Array:
        """Return the sizes of the integrals where all unknowns are as large as their sizes; 1 where that has no value."""
        system = self.system
        if not system.integrated:
            return np.empty(0)
        ones = np.ones((system.mesh.size, self.n))
        with np.errstate(all="ignore"):
            values = np.abs(system.integrands(np.ones(system.size), system.mesh, ones))
        values[~np.isfinite(values)] = 0.0
        found = self.h @ (values[1:] + values[:-1]) / 2
        return np.where(found > 0, found, 1.0)


@kernel(reorder=False)
def fill_points(n: int, tables: Finer, h: Vector, x: ReadOnlyVector, begins: Matrix, ends: Matrix, points: Matrix) -> None:
    """Fill the states of w, step 2, at the finer Gauss points, (N (d + 1), n), from rates at both ends of the intervals.

    c is taken from one end of an interval where the rate at the other one is not finite; it is zero without either.
    """
    d, slopes = tables.slope.shape[0], tables.end_slopes
    sign = 1.0 - 2.0 * (d % 2)
    for j in range(h.size):
        for a in range(n):
            first, last = -sign * h[j] * begins[j, a], -h[j] * ends[j, a]
            for node in range(d + 1):
                value = x[(j * d + node) * n + a]
                first += slopes[0, node] * value
                last += slopes[1, node] * value
            if first - first != 0:
                first = last
            if last - last != 0:
                last = first
            c = (first + last) / 2 if first - first == 0 else 0.0
            for q in range(d + 1):
                total = -tables.bubble[q] * c
                for node in range(d + 1):
                    total += tables.value[q, node] * x[(j * d + node) * n + a]
                points[j * (d + 1) + q, a] = total


@kernel
def fill_left(n: int, tables: Finer, h: Vector, x: ReadOnlyVector, field: Matrix, left: Vector, conditions: int) -> None:
    """Fill g, step 3, and the integral conditions by the finer quadrature, from rhs and integrands (N (d + 1), n + n_int)."""
    d = tables.slope.shape[0]
    for j in range(h.size):
        for i in range(d):
            for a in range(n):
                total = 0.0
                for q in range(d + 1):
                    total -= tables.projection[i, q] * field[j * (d + 1) + q, a]
                total *= h[j]
                for node in range(d + 1):
                    total += tables.slope[i, node] * x[(j * d + node) * n + a]
                left[(j * d + i) * n + a] = total
        for b in range(field.shape[1] - n):
            for q in range(d + 1):
                left[conditions + b] += h[j] * tables.weights[q] * field[j * (d + 1) + q, n + b]


@kernel(reorder=False)
def move(n: int, tables: Finer, x: ReadOnlyVector, error: ReadOnlyVector, points: Matrix, at_mesh: Matrix) -> float:
    """Subtract the error from the states at the finer Gauss points, if there are any, and at the mesh points.

    Return the largest one at the mesh points, or of a free parameter, relative to 1 + size; NaN if one is NaN.
    """
    largest, d = 0.0, tables.slope.shape[0]
    intervals = at_mesh.shape[0] - 1
    for j in range(intervals):
        for q in range(d + 1):
            for node in range(d + 1 if points.shape[0] > 0 else 0):
                value, first = tables.value[q, node], (j * d + node) * n
                for a in range(n):
                    points[j * (d + 1) + q, a] -= value * error[first + a]
    for j in range(intervals + 1):
        for a in range(n):
            change = error[j * d * n + a]
            size = abs(change) / (1 + abs(at_mesh[j, a]))
            if size > largest or size != size:  # noqa: PLR0124
                largest = size
            at_mesh[j, a] -= change
    for i in range((intervals * d + 1) * n, x.size):
        size = abs(error[i]) / (1 + abs(x[i]))
        if size > largest or size != size:  # noqa: PLR0124
            largest = size
    return largest


@kernel(reorder=False)
def largest_change(n: int, length: float, rates: Matrix, changed: Matrix, least: float) -> float:
    """Return the largest change of a rate, relative to 1 + the largest rate of that state, or a number that is larger.

    NaN if that is NaN. Rates may have no value at the ends, as u / r at r = 0.
    """
    largest = least
    for a in range(n):
        rate, change = 0.0, 0.0
        for j in range(rates.shape[0]):
            difference = abs(changed[j, a] - rates[j, a])
            if rates[j, a] - rates[j, a] == 0:
                rate = max(rate, abs(rates[j, a]))
                if difference > change:
                    change = difference
        size = change * length / (1 + rate * length)
        if size > largest:
            largest = size
    return largest


@kernel(reorder=False)
def largest_miss(weights: Vector, integrands: Matrix, known: Vector, sizes: Vector, least: float) -> float:
    """Return the largest error of the integrals known, relative to a size, or a number that is larger; NaN if one is NaN."""
    largest = least
    for b in range(known.size):
        total, size = -known[b], sizes[b]
        for q in range(weights.size):
            total += weights[q] * integrands[q, b]
            size += weights[q] * abs(integrands[q, b])
        missed = abs(total) / size
        if missed > largest or missed != missed:  # noqa: PLR0124
            largest = missed
    return largest


class Estimate(NamedTuple):
    """What `estimate` works with and in: the tables, points and weights of `Defect`, and rooms for what it computes.

    ``integrals`` is the program of the integrands of functionals, ``least`` (m,) are their sizes, m may be 0.
    """

    tables: Finer
    times: Vector
    weights: Vector
    mesh: Vector
    conditions: int
    integrals: Loaded
    least: Vector
    known: Vector
    quadrature: Vector
    rates: Matrix
    changed: Matrix
    at_mesh: Matrix
    points: Matrix
    field: Matrix
    integrands: Matrix
    at_gauss: Matrix
    left: Matrix
    error: Matrix
    better: Vector


def estimate_of(defect: Defect) -> Estimate:
    """Return the room of a mesh, whose right-hand side jumps nowhere."""
    system, n = defect.system, defect.n
    points, mesh, count = defect.times.size, system.mesh.size, len(system.integrated)
    codes, _, values = system.workspace
    width, empty = values.field.shape[1], np.empty
    integrals = system._batch("functionals").load() if count else codes.field
    return Estimate(
        defect.tables, defect.times, defect.weights, system.mesh, defect.conditions, integrals, defect.least_sizes,
        empty(count), system.gauss_weights, empty((mesh, width)), empty((mesh, width)), empty((mesh, n)),
        empty((points, n)), empty((points, width)), empty((points, count)),
        empty((values.points.shape[0], count)), empty((1, system.equations + 1)), empty((1, system.size)), empty(system.size),
    )  # fmt: skip


@helper
def _fill_field(codes: Codes, values: Values, times: Array, states: Array, found: Array) -> None:
    """Fill in right-hand side and integrands of conditions at states."""
    run_loaded(codes.field, values.p, Points(times, states, values.none), found, values.nothing)


@kernel
def estimate(work: Workspace, factored: Factored, room: Estimate, x: ReadOnlyVector) -> float:
    """Return `Defect.error` at x, for factors right there."""
    codes, mesh, values = work
    n, h = room.points.shape[1], mesh.h
    degree, size = room.tables.slope.shape[0], x.size
    put_free(mesh, values, x)
    for b in range(room.known.size):
        room.known[b] = 0.0
    if room.known.size:
        at_points(mesh.tables.value, x, values.points)
        run_loaded(room.integrals, values.p, Points(mesh.times, values.points, values.none), room.at_gauss, values.nothing)
        for q in range(room.quadrature.size):
            for b in range(room.known.size):
                room.known[b] += room.quadrature[q] * room.at_gauss[q, b]
    for j in range(room.mesh.size):
        for a in range(n):
            room.at_mesh[j, a] = x[j * degree * n + a]
    _fill_field(codes, values, room.mesh, room.at_mesh, room.rates)
    fill_points(n, room.tables, h, x, room.rates[:-1], room.rates[1:], room.points)
    _fill_field(codes, values, room.times, room.points, room.field)
    for i in range(room.left.shape[1]):
        room.left[0, i] = 0.0
    fill_left(n, room.tables, h, x, room.field, room.left[0], room.conditions)
    solve(mesh.layout, factored.factors, room.left, room.error, factored.work, mesh.whole)
    for i in range(size):
        room.better[i] = x[i] - room.error[0, i]
    largest = move(n, room.tables, x, room.error[0], room.points, room.at_mesh)
    put_free(mesh, values, room.better)
    _fill_field(codes, values, room.mesh, room.at_mesh, room.changed)
    largest = largest_change(n, room.mesh[-1] - room.mesh[0], room.rates, room.changed, largest)
    if room.known.size:
        given = Points(room.times, room.points, values.none)
        run_loaded(room.integrals, values.p, given, room.integrands, values.nothing)
        largest = largest_miss(room.weights, room.integrands, room.known, room.least, largest)
    put_free(mesh, values, x)
    return float(largest)
