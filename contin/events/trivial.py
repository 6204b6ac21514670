"""The quantity that vanishes on a trivial branch (``settings.trivial``): its round-off, and what its values at two points say.

A branch ends on the trivial one where the quantity crosses zero with a slope: at both ends of the step it is well above its
round-off, and its signs differ. Where it falls from well above its round-off to next to nothing Newton's method has left for
the trivial branch: the step is refused. Where it is round-off at the beginning already (it can decay along a branch that runs
on, beside a homoclinic orbit), its sign says nothing.
"""

from __future__ import annotations

import numpy as np

from contin.core.newton import Newton
from contin.core.trial import Trial, sign_changed
from contin.levels import CERTAIN, ROUND_OFF

#: A value this many times its round-off that falls by this factor in one step has jumped, or the step ends right at a zero, or
#: a decay is fast: all are then taken in shorter steps. At 10 a decay beside a homoclinic orbit would be cut into many steps,
#: at 1e6 a jump from a branch of small amplitude would pass.
_CLEAR = 1e3


def round_off(trial: Trial, name: str, newton: Newton) -> float:
    """Return about how large the quantity can be by errors of the corrector alone."""
    relative = CERTAIN * max(newton.tolerance, trial.newton_error, ROUND_OFF)
    system = trial.system
    if name in system.free:
        at = system.parameter_index(name)
        return float(relative * (1 + abs(trial.x[at])) * system.free_scales[at - system.state_size])
    signs = np.where(np.arange(system.size) % 2, 1.0, -1.0)  # of the errors: not all alike, which a difference would hide
    moved = Trial.without_tangent(system, trial.x + relative * signs * (1 + np.abs(trial.x)))
    return abs(moved[name] - trial[name])


def jumped(before: Trial, trial: Trial, name: str, newton: Newton) -> bool:
    """Return whether the quantity, well above its round-off at one end of a step, is next to nothing at the other."""
    value, after = abs(before[name]), abs(trial[name])
    return after * _CLEAR < value and value > _CLEAR * round_off(trial, name, newton)


def crossed(before: Trial, trial: Trial, name: str, newton: Newton) -> bool:
    """Return whether the quantity changes its sign from one end of a step to the other, well above its round-off at both."""
    if not sign_changed(before[name], trial[name]):
        return False
    return min(abs(before[name]), abs(trial[name])) > round_off(trial, name, newton)
