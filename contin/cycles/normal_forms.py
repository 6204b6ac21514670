"""Normal forms of bifurcations of cycles (Kuznetsov, Govaerts, Doedel & Dhooge 2005), by linear boundary value problems.

Time is measured in periods, s = t / T, so that the field is G = T F; J, B and C are its derivatives of first, second and third
order along the cycle. Near it u = u0(s) + xi v(s) + ..., and in the coordinates (s, xi) of the centre manifold

    fold               ds/dt = (1 - alpha xi) / T,      dxi/dt = b xi^2,
    period doubling    ds/dt = (1 + a xi^2) / T,        dxi/dt = c xi^3,
    torus              ds/dt = (1 + a |xi|^2) / T,      dxi/dt = i theta xi / T + d xi |xi|^2.

The expansion of both sides gives, power by power of xi, equations L h = r with L h = h' - J h and a condition h(1) = mu h(0).
Where L is singular, w.r = 0 for the left null vector w is the condition that determines a coefficient:

    fold               L v = alpha u0', periodic;  w.v = 1:             b T = w.(B(v, v) + 2 alpha J v) / 2
    period doubling    L v = 0, v(1) = -v(0);  w.v = 1
                       L h = B(v, v) - 2 a u0', periodic:               c T = w.(C(v, v, v) + 3 B(v, h) - 6 a J v) / 6
    torus              L v = 0, v(1) = e^(i theta) v(0);  w.v = 1
                       L h = B(v, v*) - a u0', periodic
                       L k = B(v, v), k(1) = e^(2 i theta) k(0):
                                            d T = w.(C(v, v, v*) + 2 B(v, h) + B(v*, k) - 2 a (J v - i theta v)) / 2

The mean of |v|^2 over the period is one, and at folds v is normal to u0' in the mean. Products with w are those of the
discrete equations, so that the coefficients converge with the cycle. With a symmetry of order n all this is done over one n-th
of the period, with S v(0) for v(0). Where c or the real part of d is negative, the bifurcation
is supercritical: the doubled cycle, or the torus, attracts on the centre manifold. The sign of b depends on that of v, and its
absolute value is given; it vanishes at a cusp. With a forcing the time s goes on evenly, and alpha and a are zero.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from contin.arrays import Array
from contin.core.multilinear import of_complex
from contin.cycles.equations import PeriodicEquations
from contin.cycles.floquet import has_double_one
from contin.cycles.round import Round, Solver
from contin.events.arc import SpecialPoint
from contin.events.coefficient import Coefficient
from contin.problems.own_names import PERIOD

#: Rounds of inverse iteration for null vectors, from random borders; the first leaves an error of the size of the multiplier's.
_ROUNDS = 3
#: The random borders.
_SEED = 11


class NormalForms:
    """The normal forms at one cycle; each method returns the coefficient at a bifurcation of that kind.

    Parameters
    ----------
    system : PeriodicEquations
    x : ndarray, shape (size,)
    """

    def __init__(self, system: PeriodicEquations, x: Array) -> None:
        self.system, self.x = system, x
        self.plain = Round(system, x, phased=False)
        self.phased = self.plain.with_period() if system.autonomous else self.plain
        self.points = system.at_gauss_points(x)
        self.jacobian = system.rates_by_states(x, self.points)
        self.h = np.repeat(np.diff(system.mesh), system.degree)[:, None]
        self.period = float(x[system.parameter_index(PERIOD)]) if system.autonomous else 1.0  # as it stands in x

    def fold(self) -> Coefficient:
        """Return the absolute value of b."""
        found = self._coefficient(NormalForms._of_fold)
        return Coefficient(abs(found.value), found.error, found.size)

    def period_doubling(self) -> Coefficient:
        """Return c."""
        return self._coefficient(NormalForms._of_period_doubling)

    def torus(self, angle: float) -> Coefficient:
        """Return the real part of d."""
        return self._coefficient(lambda forms: forms._of_torus(angle))

    def _coefficient(self, terms: Callable[[NormalForms], Array]) -> Coefficient:
        """Return a coefficient per unit of time from its terms in x."""
        return Coefficient.of(lambda x: terms(self if x is self.x else NormalForms(self.system, x)), self.x, self.system)

    # --- the terms of the coefficients ---------------------------------------------------------------------------

    def _of_fold(self) -> Array:
        v, w = self._null_vectors(self.phased, 1.0)
        system: Any = self.system
        if system.autonomous:
            states = np.ascontiguousarray(self.x[: system.state_size].reshape(system.nodes.size, -1))
            along = system.rates(self.x, states).ravel()
            v[: along.size] -= self._mean(v, along) / self._mean(along, along) * along
        v = v / np.sqrt(self._mean(v, v))
        u, alpha = self._at_points(v), (v[-1] / self.period if self.system.autonomous else 0.0)
        w = w / self._product(w, u)
        return self._products(w, [self._along(u, u), 2 * alpha * self._apply(u)], 2)

    def _of_period_doubling(self) -> Array:
        u, w = self._critical(-1.0)
        h, change = self._periodic(self._along(u, u))
        a = -change / (2 * self.period)
        return self._products(w, [self._along(u, u, u), 3 * self._along(u, h), -6 * a * self._apply(u)], 6)

    def _of_torus(self, angle: float) -> Array:
        u, w = self._critical(np.exp(1j * angle))
        h, change = self._periodic(self._along(u, u.conj()).real)
        a = -change / self.period
        twice = self.plain.solver(np.exp(2j * angle))
        k = self._at_points(twice.solve(self._right_side(self._along(u, u), self.plain)))
        slope = -2 * a * (self._apply(u) - 1j * angle * u)
        return self._products(w, [self._along(u, u, u.conj()), 2 * self._along(u, h), self._along(u.conj(), k), slope], 2)

    def _products(self, w: Array, terms: Sequence[Array], factor: float) -> Array:
        """Return the real parts of the products of w with the terms, per unit of time, over a factor."""
        return np.array([self._product(w, term).real for term in terms]) / (factor * self.system.unit_time(self.x))

    # --- solutions of the linear problems ------------------------------------------------------------------------

    def _null_vectors(self, matrix: Round, multiplier: Any) -> tuple[Array, Array]:
        """Return the right and the left null vector."""
        random = np.random.default_rng(_SEED)
        b, c = random.standard_normal(matrix.size), random.standard_normal(matrix.size)
        unit = np.zeros(matrix.size + 1, dtype=np.result_type(multiplier))
        unit[-1] = 1.0
        for _ in range(_ROUNDS):
            solver = matrix.solver(multiplier, (b, c))
            v, w = solver.solve(unit)[:-1], solver.solve_transposed(unit)[:-1]
            b, c = w.conj() / np.linalg.norm(w), v.conj() / np.linalg.norm(v)
        return v, w

    def _critical(self, multiplier: Any) -> tuple[Array, Array]:
        """Return v at the Gauss points, and w, of a multiplier that is not one."""
        v, w = self._null_vectors(self.plain, multiplier)
        v = v / np.sqrt(self._mean(v, v.conj()).real)
        here = self._at_points(v)
        return here, w / self._product(w, here)

    def _periodic(self, right_side: Array) -> tuple[Array, float]:
        """Return the periodic h with L h = right side + change * F, at the Gauss points, and this change of the period."""
        solution = self._periodic_solver.solve(self._right_side(right_side, self.phased))
        return self._at_points(solution), float(solution[-1]) if self.system.autonomous else 0.0

    @functools.cached_property
    def _periodic_solver(self) -> Solver:
        return self.phased.solver(np.eye(1))

    def _right_side(self, values: Array, matrix: Round) -> Array:
        """Return values at the Gauss points as the right side of the discrete equations."""
        result = np.zeros(matrix.size, dtype=values.dtype)
        result[: values.size] = (self.h * values).ravel()
        return result

    def _product(self, w: Array, values: Array) -> Any:
        """Return w.values."""
        return w[: values.size] @ (self.h * values).ravel()

    def _mean(self, v: Array, w: Array) -> Any:
        """Return the mean of v.w over the period, in the user's units."""
        size = self.system.state_size
        weights = self.system.weights[:size] * self.system.unscaled_factors[:size] ** 2
        return weights @ (v[:size] * w[:size])

    def _at_points(self, v: Array) -> Array:
        """Return states at the nodes, interpolated to the Gauss points."""
        system, n = self.system, self.points.shape[1]
        local = v[: system.state_size].reshape(-1, n)[system.by_interval]
        points: Array = np.einsum("qm,jma->jqa", system.basis.value, local).reshape(-1, n)
        return points

    # --- derivatives ---------------------------------------------------------------------------------------------

    def _along(self, *directions: Any) -> Any:
        """Return B or C along directions at the Gauss points, real or complex."""
        along = self.system.rates_along
        return of_complex(lambda stacks: np.array([along(self.x, parts) for parts in zip(*stacks)]), directions)

    def _apply(self, v: Array) -> Array:
        """Return J v."""
        result: Array = np.einsum("kij,kj->ki", self.jacobian, v)
        return result


def at_special_point(system: PeriodicEquations, point: SpecialPoint) -> Coefficient | None:
    """Return the coefficients of folds, and of period doublings and torus bifurcations where one multiplier or pair crosses.

    These have none where a multiplier is 1, too: the cycle is not isolated, as in conservative systems.
    """
    with np.errstate(all="ignore"):
        if point.label == "LP" and point.details is None and point.is_located:
            return NormalForms(system, point.trial.x).fold()
        if point.label not in ("PD", "BP", "TR") or not point.is_simple or has_double_one(system, point.trial.x):
            return None
        if point.label in ("PD", "BP"):
            return NormalForms(system, point.trial.x).period_doubling()
        return NormalForms(system, point.trial.x).torus(point.details["frequency"])
