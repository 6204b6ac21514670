"""Fields over one coordinate whose rates are given: their form, and their linearization in time.

The characteristic matrix A - z B of a steady state of fields, and its forms: Re d / omega is the first Lyapunov coefficient.

On the mesh B x' = F(x), so that w.B v = 1 of the critical vectors (`contin.events.normal_forms`). The mean of |v|^2 over the
domain is one, of the states whose rates occur.

Steady states solve boundary value problems: with U' = rhs(t, U, p) + M U_t, where M (n, n) has entries in the rows of a few
equations only, a perturbation that grows as exp(z t) solves, on the mesh of the steady state,

    A v = z B v,        B = P S,

A being the matrix of the collocation equations and conditions at fixed parameters. S v (m,) are the rates M v at the Gauss
points, times the length of the interval, and P puts them into the rows of these equations. Most of B is zero, and with it most
eigenvalues of the pair are infinite. With a shift s,

    T(s) = S (A - s B)^-1 P,        T(s) w = w / (z - s),

has the finite ones alone. Of meshes that are not long T is formed, and all its eigenvalues are found; otherwise those right of
the imaginary axis, or near to it, by Arnoldi's method (`contin.linalg.matrices`).

Collocation at Gauss points makes no unstable eigenvalues of its own: of u_t = u_xx it replaces exp(h sqrt z) over an interval h
by a diagonal Pade approximant, which has the modulus 1 on the imaginary axis only, so that all z are negative on any mesh.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from contin.arrays import Array, ComplexArray, Function, Numbers
from contin.boundary.system import Collocation
from contin.core.labels import Label
from contin.core.spectral import Eigenvalues, Spectral
from contin.core.system import Inputs
from contin.core.trial import Event
from contin.defining.critical import HopfCurve
from contin.draws import generator
from contin.errors import ProblemError
from contin.events.arc import SpecialPoint
from contin.events.error import Solution
from contin.events.hopf import hopf
from contin.events.labelled import frequency_of
from contin.events.normal_forms import Coefficient, DenseForm, at_special_point
from contin.levels import DEPENDENT, LOCATED
from contin.linalg.border import Borders
from contin.linalg.matrices import SparseFactors, nearest_of, rightmost_of


class FieldForm(DenseForm):
    """That of a steady state of fields.

    - ``system`` (Fields)
    - ``x`` (ndarray, shape (size,))
    """

    def __init__(self, system: Any, x: Array) -> None:
        pencil, held = system.pencil(x), system.size - system.equations
        self._system, self._x, self._matrix, self._rates = system, x, pencil.matrix, pencil.into @ pencil.rates
        self.places = np.append(np.arange(system.state_size), np.arange(system.state_size + held, system.size))
        self.equations, self.weights = system.equations, system.weights[self.places]

    def solver(self, coupling: complex | Numbers, border: Borders | None = None) -> Any:
        from scipy.sparse import block_array, csc_array, kron  # type: ignore[import-untyped]  # .1 s

        small = np.atleast_2d(coupling)
        one = np.eye(len(small))
        matrix = kron(one, self._matrix) - kron(small, self._rates)
        if border is None:
            return SparseFactors(csc_array(matrix))
        columns, rows = (kron(one, csc_array(each[:, None])) for each in border)
        return SparseFactors(csc_array(block_array([[matrix, columns], [rows.T, None]])), borders=len(small))

    def coupled_parts(self, left: Numbers, right: Numbers) -> tuple[Numbers, Numbers]:
        """Return w and B v."""
        return left, (self._rates @ right.T).T

    def coupled_gradient(self, left: Array, right: Array) -> Array:
        """Return the derivatives of the sum of w.B v over the copies by x: coefficients of rates depend on parameters."""
        system, wide = self._system, np.zeros(self._system.size)
        found = np.zeros(system.size)
        for w, v in zip(left, right):
            wide[self.places] = v
            found += system.rates_gradient(self._x, w, wide)
        return found

    def _along(self, stacks: Any) -> Array:
        system = self._system
        wide = [np.zeros((len(stack), system.size)) for stack in stacks]
        for each, stack in zip(wide, stacks):
            each[:, self.places] = stack
        return np.array([system.along(self._x, parts) for parts in zip(*wide)])

    def length(self, right: Numbers) -> float:
        """Return the root of the mean of |v|^2 over the states with rates, in the user's units."""
        system, count = self._system, self._system.state_size
        moving = np.tile(system.moving_states, count // len(system.moving_states))
        squares = np.abs(right[:count] * system.unscaled_factors[:count]) ** 2
        return float(np.sqrt((system.weights[:count] * squares) @ moving))


#: Most rates at Gauss points for which T is formed: its eigenvalues take half a second then. Arnoldi's method takes 0.15 s of
#: the Brusselator there, but ten seconds of the equation of Swift and Hohenberg.
_DENSE = 1000
#: Eigenvalues that are kept, those furthest to the right, besides all that are unstable. Fewer than ten would leave out
#: pairs that move to the axis over one step.
_KEPT = 24
#: The shift is this multiple of a bound on the rates that the equations without derivatives allow: an eigenvalue that is equal
#: to the bound, as that of a uniform state, is not the shift.
_BEYOND = 1.37


#: Entries of a matrix, and their rows and columns.
Entries = tuple[Array, Any, Any]


class Pencil(NamedTuple):
    """The matrices A, P and S, sparse, and the shift s of `Fields.spectra`."""

    matrix: Any
    into: Any
    rates: Any
    shift: float


class Fields(Spectral, Collocation):
    """A `BoundaryValueProblem` with ``rates`` on a mesh."""

    plain = False
    finds_nearest = True

    def events(self) -> list[Event]:
        """Return also that of Hopf points."""
        return [*super().events(), hopf()]

    @property
    def is_sparse(self) -> bool:
        """Not all eigenvalues are computed: the mesh is long."""
        return self.gauss_times.size * len(self.problem.rate_rows) > _DENSE

    @property
    def curves(self) -> Mapping[str, type]:
        """That of Hopf points."""
        return {HopfCurve.kind: HopfCurve}

    def defining(self, point: Solution, x: Array) -> tuple[HopfCurve, Array] | None:
        """Return that of Hopf points."""
        frequency = frequency_of(point)
        if point.label != Label.HOPF or frequency is None:
            return None
        return HopfCurve(self, size=frequency**2), np.append(x, 1.0)

    def form(self, x: Array) -> FieldForm:
        """Return that of a steady state."""
        return FieldForm(self, x)

    def coefficient(self, point: SpecialPoint) -> Coefficient | None:
        """Return the first Lyapunov coefficient at a Hopf point, unless coefficients of rates depend on the states."""
        at_hopf = point.label == Label.HOPF and not self.problem.batch("rates").depends[:, : self._n].any()
        return at_special_point(self, point) if at_hopf else None

    def unstable(self, x: Array) -> int:
        """Return the number of unstable eigenvalues."""
        return int(np.count_nonzero(self.eigenvalues(x).real > 0))

    def spectra(self, places: Sequence[Array]) -> list[Eigenvalues]:
        """Return the eigenvalues at places, those furthest to the right first."""
        return [Eigenvalues(self._rightmost(x)) for x in places]

    def eigenvalue_near(self, x: Array, value: complex) -> complex:
        """Return the eigenvalue that is nearest to a value; NaN where none is found."""
        pencil = self.pencil(x)
        if not np.isfinite(pencil.matrix.data).all():
            return complex("nan")
        return nearest_of(_inverse(pencil, complex), pencil.into.shape[1], value)

    def _rightmost(self, x: Array) -> ComplexArray:
        pencil = self.pencil(x)
        if not (np.isfinite(pencil.matrix.data).all() and np.isfinite(pencil.rates.data).all()):
            return np.full(2, np.nan, dtype=complex)
        count, inverse = pencil.into.shape[1], _inverse(pencil, float)
        if self.is_sparse:
            found = rightmost_of(inverse, count, pencil.shift)
        else:
            try:
                values = np.linalg.eigvals(inverse(pencil.shift)(np.eye(count)))
            except RuntimeError:  # no shift has an inverse
                return np.full(2, np.nan, dtype=complex)
            found = pencil.shift + 1 / values[np.abs(values) > DEPENDENT * np.abs(values).max(initial=0.0)]
        found = found[np.lexsort((-found.imag, -found.real))]
        kept = max(_KEPT, 2 + int(np.count_nonzero(found.real > 0)))
        if kept < len(found) and found[kept].imag < 0:
            kept += 1  # the conjugate of the last one
        return found[:kept].astype(complex)

    def pencil(self, x: Array) -> Pencil:
        """Return the linearization in time at x, at fixed parameters.

        On curves the first free parameters are held; others, as multipliers or a speed, follow the states.
        """
        from scipy.sparse import csr_array  # .1 s

        n, points, rows = self._n, self.gauss_times.size, np.array(self.problem.rate_rows)
        free = self._free[self.size - self.equations :]
        field = self._field.jacobian(*self._inside(x), self.problem.batch("field").columns(free))[1]
        ends = self._boundary.jacobian(*self._at_ends(x), self.problem.batch("boundary").columns(free))[1][0]
        inside, last = np.arange(points * n).reshape(points, n, 1), np.arange(self.state_size, self.state_size + len(free))
        at_ends = np.concatenate([np.arange(n), np.arange(self.state_size - n, self.state_size), last])
        integrals = [self._to_nodes(self.gauss_weights[:, None] * field[:, q]) for q in range(n, field.shape[1])]
        slopes = -self._h_points[:, :, None] * field[:, :n]
        entries = [
            self._by_nodes(slopes[:, :, :n], np.eye(n)), (slopes[:, :, n:], inside, last),
            (ends, points * n + np.arange(len(ends))[:, None], at_ends),
            *((row, np.array(points * n + len(ends) + q), np.arange(row.size)) for q, row in enumerate(integrals)),
        ]  # fmt: skip
        rates = self._rates(x)
        taken = self._by_nodes(self._h_points[:, :, None] * rates)
        places = inside[:, rows, 0].ravel()
        into = csr_array((np.ones(places.size), (places, np.arange(places.size))), shape=(self.equations, places.size))
        matrix = _gathered(entries, (self.equations, self.equations))
        sizes = np.abs(rates).max(axis=2)
        quotients = np.abs(field[:, rows, :n]).sum(axis=2)[sizes > 0] / sizes[sizes > 0]
        fastest = float(quotients.max(initial=0.0)) or 1.0
        return Pencil(matrix, into, _gathered([taken], (places.size, self.equations)), _BEYOND * fastest)

    def _by_nodes(self, values: Array, slopes: Array | None = None) -> Entries:
        """Return the entries by the states at the nodes of rows (N d, r, n) by those at Gauss points, and by their slopes."""
        found = np.einsum("qm,qrb->qrmb", np.tile(self.basis.value, (self.intervals, 1)), values)
        if slopes is not None:
            found += np.einsum("qm,rb->qrmb", np.tile(self.basis.slope, (self.intervals, 1)), slopes)
        rows = np.arange(found.shape[0] * found.shape[1]).reshape(*found.shape[:2], 1, 1)
        nodes = np.repeat(self.by_interval, self._d, axis=0)
        return found, rows, nodes[:, None, :, None] * self._n + np.arange(self._n)

    def _rates(self, x: Array) -> Array:
        """Return the entries of M in the rows with rates at the Gauss points, (N d, R, n), in sizes of the states."""
        n, batch = self._n, self.problem.batch("rates")
        at = self._with_rates(x, np.zeros((self.gauss_times.size, n)))
        found = batch.jacobian(*at, batch.columns((), range(n, 2 * n)))[1]
        sizes = self.scales.states
        return found * sizes / sizes[self.problem.rate_rows][:, None]

    def _with_rates(self, x: Array, rates: Array) -> Inputs:
        """Return what the functions of states and rates (N d, n) at the Gauss points are called with."""
        both = np.hstack([self.states_at_gauss_points(x), rates])
        return self.gauss_times, both, np.empty((0, both.shape[1])), self.all_parameters(x)

    @property
    def moving_states(self) -> Array:
        """1 for the states whose rates occur, else 0, shape (n,)."""
        return self.problem.batch("rates").depends[:, self._n : 2 * self._n].any(axis=0).astype(float)

    def rates_gradient(self, x: Array, w: Array, v: Array) -> Array:
        """Return the derivatives of w.B v by x, shape (size,), for w (equations,) and v (size,)."""
        n, batch, rows, sizes = self._n, self.problem.batch("rates"), self.problem.rate_rows, self.scales.states
        at = self._with_rates(x, self.states_at_gauss_points(v))
        slopes = batch.jacobian(*at, batch.columns(self._free, range(n)))[1] / sizes[rows][:, None]
        weights = self._h_points * w[: self._inner].reshape(-1, n)[:, rows]
        return self._to_nodes(np.einsum("qr,qrb->qb", weights, slopes) * np.append(sizes, self.free_scales))

    def check_solution(self, x: Array) -> None:
        """Check that the rates are linear functions of those of the states, and that perturbations do not grow without bound.

        Raises ProblemError otherwise.
        """
        batch, sizes = self.problem.batch("rates"), self.scales.states
        rates = generator("fields").uniform(1, 2, (self.gauss_times.size, self._n))

        def values(w: Array) -> Array:
            return batch.values(*self._with_rates(x, w * sizes)) / sizes[self.problem.rate_rows]

        there, rest = values(rates), values(0 * rates)
        linear = np.einsum("qrb,qb->qr", self._rates(x), rates)
        if not (np.isfinite(there).all() and np.isfinite(linear).all()):
            raise ProblemError("rates: they are not finite at the solution")
        size = np.abs(there).max(initial=0.0)
        if max(np.abs(rest).max(initial=0.0), np.abs(there - linear).max(initial=0.0)) > LOCATED * size:
            raise ProblemError("rates: each must be a linear function of the rates w, without a constant term")
        if not size > 0:
            raise ProblemError("rates: they do not depend on the rates w of any state at the solution")
        found = self.eigenvalues(x)
        if np.isnan(found).any():
            raise ProblemError("rates: the equations and conditions do not determine how a perturbation moves in time")
        if 2 * np.count_nonzero(found.real > 0) > self.gauss_times.size * len(self.problem.rate_rows):
            raise ProblemError(
                "rates: most perturbations grow, the shorter the faster, as if time ran backwards: a sign is wrong "
                "(u_t = u_xx + f, with u' = v, has v' = -f + u_t)"
            )


def _gathered(entries: Sequence[Entries], shape: tuple[int, int]) -> Any:
    """Return the sparse array of entries that are given with their rows and columns, which are broadcast."""
    from scipy.sparse import csr_array

    whole = [np.broadcast_arrays(*each) for each in entries]
    values, rows, columns = (np.concatenate([each[k].ravel() for each in whole]) for k in range(3))
    return csr_array((values, (rows, columns)), shape=shape)


def _inverse(pencil: Pencil, kind: type) -> Function:
    """Return the function of a shift s that returns T(s), as a function of vectors (m,) or of columns."""
    from scipy.sparse import csc_array
    from scipy.sparse.linalg import splu  # type: ignore[import-untyped]

    matrix, into, rates, _ = pencil

    def inverse(shift: object) -> Function:
        factors = splu(csc_array(matrix - shift * (into @ rates), dtype=kind))
        return lambda v: rates @ factors.solve(np.asarray(into @ v, dtype=kind))

    return inverse
