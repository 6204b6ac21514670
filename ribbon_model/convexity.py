"""The end of a law that is given by its strain energy: U must be convex at every strain along the strip.

Beyond that, H = max(M.omega - U) has several values or none. A branch reaches the end smoothly, with strains that grow like a
square root, or through a jump: two neighbouring places of the strip take different minima of U - M.omega.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from contin import Event
from contin.lowlevel import Collocation
from ribbon_model.law import Law
from ribbon_model.solution import Solution

#: Parts of a line between strains at neighbouring nodes. U is concave on a tenth of a jump at least (measured on (3, 1)).
_PARTS = 16
NAME = "the end of the convex strain energy"


def least_on_lines(margin: Callable[[np.ndarray, np.ndarray], np.ndarray], t: np.ndarray, strains: np.ndarray) -> float:
    """Return the least ``margin(t, strains)`` at nodes (K,) and on straight lines between the strains of neighbouring ones.

    At a jump, U is concave on the line. Without a response the margin is -1.
    """
    both = np.column_stack([t, strains])
    lines = np.concatenate([both[:-1] + part * np.diff(both, axis=0) for part in np.arange(_PARTS) / _PARTS] + [both[-1:]])
    return float(margin(lines[:, 0], lines[:, 1:]).min()) if np.all(np.isfinite(lines)) else -1.0


def margin(law: Law) -> Callable[[Collocation, np.ndarray], float] | None:
    """Return ``margin(system, x)``, the least `Law.margin` along a closed strip: 1 on planar circles, -1 without a response.

    None for a law whose H is a closed expression, because its domain is known.
    """

    def least(system: Collocation, x: np.ndarray) -> float:
        solution = Solution.at(system, x)
        return least_on_lines(lambda _, w: law.margin(w, w, *solution.material), solution.t, solution.strains())

    return least if law.ends_with_convexity else None


def test_functions(law: Law) -> list[Event]:
    """Return the test function that ends a run where the law ends; none for a law with a closed expression for H."""
    least = margin(law)
    return [Event("EP", NAME, lambda trial: least(trial.system, trial.x), terminal=True)] if least else []
