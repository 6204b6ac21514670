"""How far a labelled cycle of contin is from being critical, by SciPy: the third method for bifurcations of cycles."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
from scipy.integrate import solve_ivp

from contin import CycleProblem, Point

#: Longest period that is integrated: round-off of the integration grows with the largest multiplier.
LONGEST = 60.0
#: Most states: beyond them a call in Python for each state takes minutes, and fields take arrays.
MOST_STATES = 6
#: Step of central differences of the field, relative to 1 + |u|: error about 1e-10, of which the multipliers have their errors.
STEP = 1e-5


def distance(point: Point) -> float | None:
    """Return the distance of the multipliers from their critical values at a labelled cycle; None where it is not integrated.

    The variational equation is integrated along the cycle from the first of its states by DOP853. At PD a multiplier is -1, at
    TR a pair lies on the unit circle, at LP and BP a second multiplier is 1.
    """
    problem = point.system.problem
    if not isinstance(problem, CycleProblem) or point.label not in ("PD", "TR", "LP", "BP"):
        return None
    states = list(problem.state_names)
    if problem.period is not None or len(states) > MOST_STATES or point["period"] > LONGEST:
        return None
    parameters = SimpleNamespace(**{name: point[name] for name in problem.parameters})
    count = len(states)

    def field(u):
        return np.array(problem.field(SimpleNamespace(**dict(zip(states, u))), parameters), dtype=float)

    def both(t, z):
        u, flow = z[:count], z[count:].reshape(count, count)
        steps = STEP * (1 + np.abs(u))
        columns = [(field(u + step) - field(u - step)) / (2 * step.max()) for step in np.diag(steps)]
        return np.concatenate([field(u), (np.array(columns).T @ flow).ravel()])

    start = np.concatenate([point.system.evaluate(point.x, np.array([0.0]))[0], np.eye(count).ravel()])
    found = solve_ivp(both, (0, point["period"]), start, method="DOP853", rtol=1e-11, atol=1e-13)
    return critical(np.linalg.eigvals(found.y[count:, -1].reshape(count, count)), point.label)


def critical(multipliers: np.ndarray, label: str) -> float:
    """Return the distance from the critical value; one multiplier is 1 at every cycle."""
    if label == "PD":
        return float(np.abs(multipliers + 1).min())
    others = np.delete(multipliers, np.abs(multipliers - 1).argmin())
    if label == "TR":
        pairs = others[np.abs(others.imag) > 0]
        return float(np.abs(np.abs(pairs) - 1).min()) if pairs.size else float("inf")
    # two multipliers beside 1 form a Jordan block, which parts by the root of the error: their mean is known as well as others
    nearest = others[np.abs(others - 1).argmin()]
    return float(abs((nearest + multipliers[np.abs(multipliers - 1).argmin()]) / 2 - 1))
