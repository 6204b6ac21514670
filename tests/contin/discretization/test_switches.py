"""Corners and jumps that states decide become mesh points that move with the solution.

Known values: integration from switch to switch with DOP853 at 1e-13 (SciPy), and closed forms.
"""

import functools

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq, fsolve, minimize_scalar

import contin
from contin import BoundaryValueProblem, CycleProblem
from contin.discretization.basis import basis
from contin.discretization.defect import split
from contin.discretization.mesh import MeshControl, moved_to_breaks
from contin.errors import InterpretedWarning


def flow(rates, levels, place, y, end, most=60):
    """The state at the end: `rates(t, y, piece)` is smooth between ``levels`` of y[place], and ``piece`` counts those below."""
    t, y, piece = 0.0, np.array(y, dtype=float), 0
    piece = int(np.searchsorted(levels, y[place]))
    if piece < len(levels) and levels[piece] == y[place]:
        piece += bool(rates(0.0, y, piece)[place] > 0)
    for _ in range(most):
        events = []
        for level, direction in ((levels[piece - 1] if piece else None, -1), (levels[piece] if piece < len(levels) else None, 1)):
            if level is not None:
                event = lambda t, y, level=level: y[place] - level  # noqa: E731
                event.terminal, event.direction = True, direction
                events.append(event)
        found = solve_ivp(
            functools.partial(lambda t, y, piece: rates(t, y, piece), piece=piece), (t, end), y, method="DOP853", rtol=1e-13,
            atol=1e-14, events=events,
        )  # fmt: skip
        t, y = found.t[-1], found.y[:, -1]
        if found.status == 0:
            return y
        piece += 1 if y[place] > (levels[0] if len(levels) == 1 else np.mean(levels[max(piece - 1, 0) : piece + 1])) else -1
        if len(levels) == 1:
            piece = 1 if rates(t, y, piece)[place] > 0 else 0
    raise AssertionError("too many switches")


# --- one solution: conditions of all kinds -----------------------------------------------------------------------------------

LAWS = {
    "abs": (lambda u: 1 + 3 * abs(u - 0.1), [0.1]),
    "clip": (lambda u: 1 + 4 * np.clip(u, 0.1, 0.4), [0.1, 0.4]),
    "smoother": (lambda u: 1 + np.where(u > 0.2, 20 * (u - 0.2) ** 2, 0.0), [0.2]),
    "table": (lambda u: np.interp(u, [0, 0.1, 0.2, 0.9], [1, 1.5, 1.2, 2]), [0.1, 0.2]),
    "pieces": (lambda u: 1.0 if u < 0.1 else (1 + 5 * (u - 0.1) if u < 0.25 else 1.75), [0.1, 0.25]),
    "maximum": (lambda u: 2 + max(0, u - 0.2) - min(0.35, u), [0.2, 0.35]),
}


def loaded(law):
    """u'' + q law(u) = 0, u(0) = u(1) = 0."""
    return BoundaryValueProblem(
        lambda t, u, p: (u.v, -p.q * law(u.u)), lambda a, b, p: (a.u, b.u), ["u", "v"], {"q": 2.0}
    )


def slope_at_start(law, levels, near, q=2.0):
    """u'(0) close to a value: u goes up from level to level, and is largest at t = 1/2."""

    def late(first):
        t, y = 0.0, np.array([0.0, first])
        for level in [*levels, np.inf]:
            stops = [lambda t, y: y[1], lambda t, y, level=min(level, 1e9): y[0] - level]
            for stop in stops:
                stop.terminal = True

            def rates(t, y, level=level):  # the law on this side of the level
                return y[1], -q * float(law(min(y[0], np.nextafter(level, 0))))

            found = solve_ivp(rates, (t, 5.0), y, method="DOP853", rtol=1e-13, atol=1e-15, events=stops)
            t, y = found.t[-1], found.y[:, -1]
            if found.t_events[0].size:
                break
        return t - 0.5

    return brentq(late, near - 1e-3, near + 1e-3, xtol=1e-14)


@pytest.mark.parametrize("name", LAWS)
@pytest.mark.parametrize("degree", [3, 7])
def test_conditions_on_a_state(name, degree):
    law, levels = LAWS[name]
    point = contin.solve(loaded(law), lambda t: (2 * t * (1 - t), 2 - 4 * t), degree=degree)
    found = point.system.switching(point.x)
    near = np.abs(point.system.mesh[:, None] - found.places).min(axis=0)
    assert near.size and near.max() < 1e-6
    assert not found.jumps.any()
    first = point.system.states(point.x)[0, 1]
    assert first == pytest.approx(slope_at_start(law, levels, first), abs=5e-12)
