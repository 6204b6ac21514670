"""Notes of a run: what was seen and not understood, corners and jumps that a solution decides, phase conditions that load."""

from __future__ import annotations

import math

import numpy as np

from contin.collocation.switching import Switching
from contin.core.trial import Event, Trial
from contin.events.arc import Arc, SpecialPoint
from contin.events.index import contradiction
from contin.events.labelled import finding_of
from contin.events.phase_loads import phase_loads


class Notes:
    """The sentences about a run.

    Attributes
    ----------
    texts : list of str
    primary : str
        Places are told by this parameter.
    tolerance : float
        Of the mesh.
    moves : bool
        Mesh points follow corners.
    is_noisy : bool
        Some point is not known to the tolerance of Newton's method.
    """

    def __init__(self, primary: str, tolerance: float, moves: bool) -> None:
        self.texts: list[str] = []
        self.primary, self.tolerance, self.moves, self.is_noisy = primary, tolerance, moves, False
        self._said: set[str] = set()

    def place(self, trial: Trial) -> str:
        """Return where a point lies."""
        return f"{self.primary} = {trial[self.primary]:.10g}"

    def add(self, text: str) -> None:
        self.texts.append(text)

    def inside(self, text: str, arc: Arc) -> None:
        """Note what was seen inside a step and not understood."""
        ends = (trial[self.primary] for trial in (arc.before, arc.trial))
        self.add(f"{text} (between {self.primary} = {' and '.join(f'{end:.10g}' for end in ends)})")

    def doubts(self, index: Event | None, arc: Arc, found: list[SpecialPoint], doubt: str) -> None:
        """Note what the labelled points of a step do not explain: a change of the index or, without one, a doubt."""
        contradicts = contradiction(index, arc, found)
        if contradicts and not found:  # beside points, changes of the index are noted
            self.inside(f"{contradicts}, and the labelled points do not explain it", arc)
        elif doubt and not contradicts:
            self.inside(doubt, arc)

    def corners(self, trial: Trial) -> None:
        """Note once that conditions on states make the equations jump, and once that mesh points do not follow them."""
        tolerance = self.tolerance if self.moves else math.inf
        for kind, note in (("jump", jump(trial, self.primary)), ("unsettled", unsettled(trial, tolerance, self.primary))):
            if note and kind not in self._said:
                self._said.add(kind)
                self.add(note)

    def phases(self, found: SpecialPoint, error: float) -> None:
        """Note the phase conditions that load a labelled point, which is known to ``error``."""
        trial, modes = found.trial, list(finding_of(found.details).arrays.get("kernel", ()))
        known = trial.newton_error + (self.tolerance if math.isnan(error) else error)
        for name, load, is_mode in phase_loads(trial.system, trial.x, modes, known):
            place = f"at {found.label} ({self.place(trial)})"
            what = f"has {load:.3g} of the largest number of a mode {place}" if is_mode else f"= {load:.6g} {place}"
            self.add(f"phases: {name} {what} and not zero, so the phase condition loads the structure; leave it out")

    def noise(self, arc: Arc, allowed: float) -> None:
        """Note once that a point is known worse than ``allowed``."""
        if arc.trial.newton_error > allowed and not self.is_noisy:
            self.is_noisy = True
            what = "the updates of Newton's method are round-off above its tolerance: see newton_error"
            self.inside(f"from here on {what}", arc)


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
    return "was not found again on a finer mesh" if is_located else "was bracketed, and not located"
