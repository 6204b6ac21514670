"""Normal forms of bifurcations of maps (Kuznetsov, Elements of Applied Bifurcation Theory, sections 4.5, 4.7 and 5.4).

Near a cycle u_1, ..., u_k of f, the points are u_j + xi v_j + ..., and f applied k times maps xi, a coordinate of the centre
manifold, to

    fold                xi + b xi^2,
    period doubling     -xi + c xi^3,
    torus               e^(i theta) (xi + d xi |xi|^2).

With the derivatives A, B and C of f at all points, and the cyclic linear equations

    M(mu) h = r:    A_j h_j - h_(j+1) = r_j,  and  A_k h_k - mu h_1 = r_k,

where M(mu) v = 0 = w M(mu) for the critical multiplier mu, with |v_1| = 1 and w_k.v_1 = 1, the expansion gives, power by power,

    fold                b = w.B(v, v) / 2
    period doubling     c = w.(C(v, v, v) + 3 B(v, h)) / 6,                           M(1) h = -B(v, v)
    torus               d = e^(-i theta) w.(C(v, v, v*) + 2 B(v, h) + B(v*, g)) / 2,  M(1) h = -B(v, v*),
                                                                                      M(e^(2 i theta)) g = -B(v, v).

For k = 1 these are Kuznetsov's formulas; for k > 1 they are those of f applied k times, at the first point. The doubled cycle
attracts, on the centre manifold, where c is positive, the closed curve where the real part of d is negative: the bifurcation is
supercritical. The sign of b depends on that of v, and its absolute value is given.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from contin.arrays import Array
from contin.core.multilinear import of_complex
from contin.cycles.map_equations import MapEquations
from contin.events.arc import SpecialPoint
from contin.events.coefficient import Coefficient

#: Rounds of inverse iteration for null vectors, from random borders of this seed, as for cycles of vector fields.
_ROUNDS, _SEED = 3, 11
#: Largest number of unknown states: with twice as many, dense factors take eight times as long, a minute.
_MOST = 2000


def at_special_point(system: MapEquations, point: SpecialPoint) -> Coefficient | None:
    """Return the coefficients of folds, and of period doublings and torus bifurcations where one multiplier or pair crosses."""
    x = point.trial.x
    with np.errstate(all="ignore"):
        if point.label == "LP" and point.details is None and point.is_located:
            return fold(system, x)
        if point.label not in ("PD", "TR") or not point.is_simple:
            return None
        return period_doubling(system, x) if point.label == "PD" else torus(system, x, point.details["frequency"])


def fold(system: MapEquations, x: Array) -> Coefficient | None:
    """Return the absolute value of b."""
    found = _coefficient(system, x, _of_fold)
    return None if found is None else Coefficient(abs(found.value), found.error, found.size)


def period_doubling(system: MapEquations, x: Array) -> Coefficient | None:
    """Return c, which is positive where they are supercritical."""
    found = _coefficient(system, x, _of_period_doubling)
    return None if found is None else found._replace(side=-1)


def torus(system: MapEquations, x: Array, angle: float) -> Coefficient | None:
    """Return the real part of d."""
    return _coefficient(system, x, lambda forms: _of_torus(forms, angle))


def _coefficient(system: MapEquations, x: Array, terms: Callable[[_Forms], Array]) -> Coefficient | None:
    """Return a coefficient from its terms; None for very long cycles, NaN where another multiplier makes it infinite."""
    if system.state_size > _MOST:
        return None
    try:
        with np.errstate(divide="ignore", invalid="ignore"):  # of a double multiplier w.v vanishes: there is no coefficient
            return Coefficient.of(lambda point: terms(_Forms(system, point)), x, system)
    except np.linalg.LinAlgError:
        return Coefficient(float("nan"), float("nan"), float("nan"))


class _Forms:
    """The matrices M(mu) at one cycle, and the derivatives of the map."""

    def __init__(self, system: MapEquations, x: Array) -> None:
        self.system, self.x, size = system, x, system.state_size
        matrix = system.jacobian(x)
        self._closing = np.zeros((size, size))
        n = self.n = len(system.problem.state_names)
        self._closing[size - n :, :n] = np.eye(n)
        self._open = matrix + self._closing

    def matrix(self, multiplier: Any) -> Array:
        """Return M(mu)."""
        found: Array = self._open - multiplier * self._closing
        return found

    def along(self, *vectors: Any) -> Any:
        """Return B or C along real or complex directions."""
        return of_complex(lambda stacks: self.system.stack_along(self.x, stacks), vectors)

    def critical(self, multiplier: Any) -> tuple[Array, Array]:
        """Return v and w."""
        random, matrix = np.random.default_rng(_SEED), self.matrix(multiplier)
        size = len(matrix)
        b, c = random.standard_normal(size), random.standard_normal(size)
        unit = np.append(np.zeros(size), 1.0)
        for _ in range(_ROUNDS):
            bordered = np.block([[matrix, b[:, None]], [c[None], np.zeros((1, 1))]])
            v, w = np.linalg.solve(bordered, unit)[:-1], np.linalg.solve(bordered.T, unit)[:-1]
            b, c = w.conj() / np.linalg.norm(w), v.conj() / np.linalg.norm(v)
        v = v / np.linalg.norm(v[: self.n])
        return v, w / (w[-self.n :] @ v[: self.n])


def _of_fold(forms: _Forms) -> Array:
    v, w = forms.critical(1.0)
    return np.array([w @ forms.along(v, v) / 2])


def _of_period_doubling(forms: _Forms) -> Array:
    v, w = forms.critical(-1.0)
    h = np.linalg.solve(forms.matrix(1.0), -forms.along(v, v))
    return np.array([w @ forms.along(v, v, v), 3 * w @ forms.along(v, h)]) / 6


def _of_torus(forms: _Forms, angle: float) -> Array:
    v, w = forms.critical(np.exp(1j * angle))
    h = np.linalg.solve(forms.matrix(1.0), -forms.along(v, v.conj()).real)
    g = np.linalg.solve(forms.matrix(np.exp(2j * angle)), -forms.along(v, v))
    vectors = np.array([forms.along(v, v, v.conj()), 2 * forms.along(v, h), forms.along(v.conj(), g)])
    found: Array = (np.exp(-1j * angle) * (vectors @ w)).real / 2
    return found
