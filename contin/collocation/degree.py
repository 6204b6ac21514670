"""The degree of the collocation where none is given: the one that suits easy and difficult solutions best."""

from __future__ import annotations

import functools

import numpy as np

from contin.collocation.basis import basis
from contin.collocation.mesh import MeshControl, share

#: Degrees among which is chosen, and those that they are compared with. Meshes of degree 8 are made from the eighth derivative,
#: whose round-off often gives them as many intervals as degree 7 has. Degrees below 4 need many intervals wherever they are not
#: the cheapest.
_CHOSEN, _COMPARED = range(4, 8), range(4, 9)
#: That of cycles. At degree 7 the mesh has fewer intervals, which suit the cycle but not its multipliers: in AUTO's demos their
#: errors are 1e-8 to 1e-6 in place of 1e-9.
CYCLE_DEGREE = 4
#: Solutions are considered from one for which every degree has the fewest intervals to one that needs so many times as many.
#: Ten times more changes no degree.
_HARDEST = 1e4
#: Time that a Newton iteration takes for an interval, over that for its Python code (1 ms; docs/performance.md, cost laws). Ten
#: times less, the degree at 1e-12 would be 7 for more than 30 states instead of up to 12.
_INTERVAL = 3e-3
#: The same for each of the (n d)^2 entries of an interval's block. Ten times more, the degree would be 7 for up to 3 states.
_ENTRY = 7.5e-6


@functools.cache
def usual_degree(states: int, tolerance: float) -> int:
    """Return the degree for n states and a tolerance that is never far from the cheapest one, whatever the solution is.

    A Newton iteration on N intervals of degree d takes the time a + N (b + c (n d)^2). A solution whose density has the
    integral K needs N = K / share(d) intervals, but no fewer than some number. Many states and easy solutions (small K) want a
    low degree, few states and difficult solutions a high one. K is not known before the solution is. The result is the degree
    whose time, divided by that of the cheapest degree, is smallest at the K that is worst for it. That quotient is below 2 for
    tolerances from 1e-12 and any number of states, and below 1.6 for fewer than 20 states.
    """
    shares = {d: share(basis(d), tolerance) for d in _COMPARED}
    fewest = 2 * MeshControl.min_intervals  # of special points
    easiest = fewest * min(shares.values())
    integrals = np.geomspace(easiest, _HARDEST * easiest)
    times = {d: 1 + (_INTERVAL + _ENTRY * (states * d) ** 2) * np.maximum(fewest, integrals / shares[d]) for d in _COMPARED}
    cheapest = np.min(list(times.values()), axis=0)
    return min(_CHOSEN, key=lambda d: float((times[d] / cheapest).max()))
