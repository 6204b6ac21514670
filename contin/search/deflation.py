"""Deflation: solutions other than the known ones (Farrell, Birkisson & Funke 2015).

Newton's method is applied to F multiplied by prod (1 + 1 / |x - r|^2) over the known solutions r. Its step is that of F,
stretched: known solutions repel it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from contin.arrays import Array
from contin.core.newton import Corrected, Newton, correct
from contin.core.protocol import Discretization, inner
from contin.draws import ASIDE
from contin.errors import ConvergenceError
from contin.levels import APART, MOST_STEPS
from contin.linalg.orientation import first_least
from contin.results.point import Point

#: Where a deflated iteration starts, as multiples of the guess's distance from the nearest known solution, and its longest
#: step. It wanders before it converges, and may not come back; then it is the turn of the next.
_STARTS = [(m, longest) for longest in (3.0, 1.0, 0.3) for m in (1.0, -1.0, 5.0, -5.0, 20.0, -20.0, 50.0, -50.0)]


def correct_away(system: Discretization, x: Array, others: Sequence[Point], newton: Newton) -> Corrected:
    """Return a solution near x that is none of the ``others``.

    Raises
    ------
    ConvergenceError
        None was found.
    """
    known = [point.system.carrier(system)(point.x)[: system.state_size] for point in others]
    known = [system.lifted(np.append(states, x[system.state_size :]), x) for states in known]
    nearest = known[first_least([inner(system, x - root, x - root) for root in known])]
    away = x - nearest
    if np.max(np.abs(away)) < APART:  # the known solution itself for a guess
        away = np.where(np.arange(x.size) < system.state_size, ASIDE * (1 + np.abs(x)), 0.0)
    for multiple, longest in _STARTS:
        with np.errstate(all="ignore"):
            found = deflated(system, nearest + multiple * away, known, longest)
        if found is not None:
            done = correct(system, found, newton=newton)
            if all(np.max(np.abs(done.x - system.lifted(root, done.x))) > APART for root in known):
                return done
    raise ConvergenceError("no further solution was found from this guess; another guess may lead to one")


def deflated(system: Discretization, x: Array, known: list[Array], longest: float) -> Array | None:
    """Return where the deflated iteration from x converges, or None; ``longest`` bounds its steps, relative to 1 + |x|."""
    for _ in range(MOST_STEPS):
        residual, factors = system.linearize(x)
        step = -factors.solve(residual)
        stretch = 0.0  # the derivative of log(prod (1 + 1 / |x - r|^2)) along the step
        for root in known:
            away = x - system.lifted(root, x)
            distance = inner(system, away, away) or np.finfo(float).tiny  # at the known solution itself
            stretch -= 2 * inner(system, away, step) / (distance * (1 + distance))
        step = step / (1 - stretch)
        size = np.max(np.abs(step) / (1 + np.abs(x)))
        if not np.isfinite(size):
            return None
        x = x + step * min(1.0, longest / size)
        if size < APART:
            return x
    return None
