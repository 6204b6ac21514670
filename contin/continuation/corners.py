"""Sentences about corners and jumps that a solution decides."""

from __future__ import annotations

import numpy as np

from contin.detection.refinement import BENT
from contin.discretization.switching import Switching
from contin.stepping.trial import Trial


def jump(trial: Trial, primary: str) -> str:
    """Return a note if the equations jump at some place of a solution; "" otherwise."""
    found = trial.system.switching(trial.x)
    if not (found.places.size and found.jumps.any()):
        return ""
    where = _where(found, int(np.argmax(found.jumps)), trial, primary)
    return (
        f"the equations jump where {where}: derivatives leave this out, so special points and stability are not told from "
        "there on; a SegmentedProblem with one segment on each side of the jump tells them"
    )


def unsettled(trial: Trial, tolerance: float, primary: str) -> str:
    """Return a note if conditions switch inside intervals of the mesh, and that matters; "" otherwise."""
    found = trial.system.switching(trial.x)
    if not (found.places.size and (found.costs > tolerance).any()):
        return ""
    where = _where(found, int(np.argmax(found.costs)), trial, primary)
    return f"no mesh has a point where {where}: from there on the points are as exact as discretization_error says"


def _where(found: Switching, at: int, trial: Trial, primary: str) -> str:
    return f"{found.names[at]} changes its sign (t = {found.places[at]:.6g} at {primary} = {trial[primary]:.10g})"


def why_lost(trial: Trial, is_located: bool) -> str:
    """Return why a special point has no label: a clause."""
    if trial.system.switching(trial.x).jumps.any():
        return "lies where the equations jump"
    why = "was not found again on a finer mesh" if is_located else "was bracketed, and not located"
    bends = trial.system.bends(trial.x)
    if bends is None or not bends.max() > BENT:
        return why
    at = trial.system.nodes[trial.system.degree * (int(bends.argmax()) + 1)]
    return f"{why} (the functions are evaluated in Python, and may have a corner or jump near t = {at:.4g})"
