"""Where time-periodic states of fields begin: at Hopf points of steady states."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from contin import checks
from contin.arrays import Array
from contin.boundary.fields import Fields
from contin.boundary.oscillating import TIMES, oscillating, turned
from contin.collocation.mesh import MeshControl
from contin.core.labels import Label
from contin.errors import ProblemError
from contin.events.labelled import frequency_of
from contin.problems.own_names import PERIOD
from contin.results.point import Point, point_of

#: Degree of the polynomials that stand for the critical vector in the phase condition. They need not be right: any weights do
#: that move with the oscillation. A spline through the nodes is not smooth, and the mesh was refined to 224 intervals for it.
_SMOOTH = 12
#: Most times of one period.
_MOST = 201


def begins_oscillations(point: Point) -> bool:
    """Return whether time-periodic states of a field begin at a point."""
    return point.label == Label.HOPF and isinstance(point.system, Fields)


def oscillation(point: Point, times: int = TIMES) -> tuple[Point, Array]:
    """Return the first of the time-periodic states that begin at a Hopf point of a field, of no size, and the tangent there.

    Parameters
    ----------
    point : Point
        A Hopf point of a `BoundaryValueProblem` with ``rates``.
    times : int
        Odd number of times of one period at which the states are unknowns, at least 5. `trace` takes 11.

    Raises
    ------
    ProblemError
        It is no such point, or the field has integral conditions.

    Examples
    --------
    >>> import contin, math
    >>> field = contin.BoundaryValueProblem(
    ...     lambda t, u, p: (u.da, p.w * u.b - u.a * (p.r - u.a**2 - u.b**2), u.db, -p.w * u.a - u.b * (p.r - u.a**2 - u.b**2)),
    ...     lambda a, b, p: (a.da, b.da, a.db, b.db), ["a", "da", "b", "db"], {"r": -0.1, "w": 2.0},
    ...     rates={"da": lambda t, u, w, p: w.a, "db": lambda t, u, w, p: w.b})
    >>> (hopf,) = contin.trace(contin.solve(field, [0.0] * 4), free=["r"], limits={"r": (-0.1, 0.1)}).labelled("HB")
    >>> first, tangent = oscillation(hopf, 5)
    >>> waves = contin.trace(first, tangent=tangent, limits={"r": (-1, 1)})
    >>> print(round(waves[-1]["r"], 9), round(waves[-1]["period"] / math.pi, 9), round(waves[-1]["swing_a"], 9))
    1.0 1.0 0.5
    """
    frequency = frequency_of(point)
    if not begins_oscillations(point) or frequency is None:
        raise ProblemError(f"point: one with the label {point.label!r} is no Hopf point of a field")
    checks.whole("times", times, 5, _MOST)
    if times % 2 == 0:
        raise ProblemError(f"times: {times} must be odd")
    given: Any = point.system
    system, x = given.without_scales(point.x)
    count = len(system.problem.states)
    _, critical = system.form(x).critical(1j * frequency)
    vector = np.asarray(critical.states)[: system.state_size].reshape(-1, count)
    phase = {
        int(k): (_smooth(system.nodes, vector[:, k].real), _smooth(system.nodes, vector[:, k].imag))
        for k in np.flatnonzero(system.moving_states)
    }
    problem = oscillating(system.problem, phase, times)
    values = {**dict(zip(system.problem.parameters, map(float, system.all_parameters(x)))), PERIOD: 2 * math.pi / frequency}
    degree = problem.usual_degree(MeshControl().tolerance)  # less than that of the field: there are more states
    found: Any = problem.discretized([system.free[0], PERIOD], values, None, system.mesh, degree)

    def carried(states: Array) -> Array:
        return system.evaluate(system.pack(states, dict.fromkeys(system.free, 0.0)), found.nodes)

    first = found.pack(np.tile(carried(system.states(x)), (1, times)), values)
    wave = carried(vector.real) + 1j * carried(vector.imag)
    tangent = found.pack(turned(wave, times), dict.fromkeys(found.free, 0.0))
    return point_of(found, first), tangent / np.abs(tangent).max()


def _smooth(nodes: Array, values: Array) -> Callable[[Any], Any]:
    """Return a polynomial that fits values at the nodes."""
    fit = np.polynomial.Polynomial.fit(nodes, values, min(_SMOOTH, len(nodes) - 1))
    (low, high), coefficients = fit.domain.tolist(), fit.coef.tolist()

    def polynomial(t: Any) -> Any:
        z, found = (2 * t - low - high) / (high - low), 0.0
        for coefficient in coefficients[::-1]:
            found = found * z + coefficient
        return found

    return polynomial
