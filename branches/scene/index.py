"""The index along a branch: a column, and test functions of secondary bifurcations."""

from __future__ import annotations

import numpy as np

from branches.scene.columns import Change
from branches.scene.stage import Watch
from contin import ConvergenceError, Event
from contin.lowlevel import Label, correct, levels
from ribbon_model.law_end import margin
from ribbon_model.laws import Law
from ribbon_model.modes import REVERSALS, Mode
from ribbon_model.seeds import force
from ribbon_model.solution import Solution
from ribbon_model.stability import Stability

#: Label of a secondary bifurcation. It breaks a symmetry of the domain, so the equations of the domain do not detect it.
LABEL = "SB"
#: The value of an index that could not be decided (on a bifurcation, an eigenvalue is zero).
UNDECIDED = -1
#: Near a primary branch, with less force than this, ...
_LITTLE_FORCE = 0.5
#: The class that keeps all symmetry. One of its eigenvalues passes zero at a fold, which the engine detects.
_FULL = (0, "even")
#: Number of points inside a step where the sign is evaluated: two secondary bifurcations in one step leave it unchanged.
#: Pairs closer than a quarter of a step are missed.
_LOOKS = 3
#: A step is looked at inside where an eigenvalue changes over it by more than this part of what it is at the end where it is
#: nearer to zero. On the branches of configs/fig12.yaml those of 7 % of the steps do, those of all that pass zero by more than
#: twice what they are. Ten times smaller, half of the steps are looked at.
_MOVES = 0.25
#: The computed value of the known zero, that of the shift of phase, is the error of the eigenvalues. Where it is not small, the
#: mesh of the state is too coarse for its index, and is halved at most so often. (Strips of finite width that are nearly folded
#: need this: the zero was 1e-2, and an eigenvalue of 1e-3 changed its sign twice.)
_HALVINGS = 4
#: Number of points whose stability is kept: all symmetry classes are evaluated at the same points of a step.
_KEPT = 2 * _LOOKS + 4


class SymmetryWatch(Watch):
    """Compute the index of points of one branch, each once.

    The first point ``system, x`` determines the symmetry of the branch. One ``from_circle`` begins on a circle, and may end on
    one.
    """

    def __init__(self, law: Law, system, x, from_circle: bool = True):
        self._from_circle, self._margin = from_circle, margin(law)
        self._known: dict = {}
        self._n = system.problem.on.wavenumber(Solution.at(system, x).parameters)
        self._step: tuple = None, None, set()  # both ends of the last one, and what may pass zero inside
        self._names = {entry.name for entry in self.at(system, x).classes}
        self.monitors = [self._monitor(name) for name in sorted(self._names - {_FULL})]

    def at(self, system, x, point=None) -> Stability:
        """Return the stability of a state; for a ``point`` of the branch (with tangent) on the mesh that the index needs."""
        key = id(system), x.tobytes()
        if key not in self._known:
            result = self._resolved(system, x, point)
            while len(self._known) >= _KEPT:
                self._known.pop(next(iter(self._known)))
            self._known[key] = system, result  # keep the system, so that no other object gets its id
        return self._known[key][1]

    def _resolved(self, system, x, point) -> Stability:
        """Return the stability on the system's mesh, or on a finer one if the known zero of a point is not small."""
        result = Solution.at(system, x).index()
        if point is None or result.residual <= levels.APART or np.abs(system.residual(x)).max() > levels.APART:
            return result
        tangent = point.tangent
        for _ in range(_HALVINGS):
            system, carry = system.refined()
            x, tangent = carry(x), carry(tangent)
            row = system.weights * tangent
            try:
                x = correct(system, x, row, row @ x).x
            except ConvergenceError:
                break
            result = Solution.at(system, x).index()
            if result.residual <= levels.APART:
                break
        return result

    def _within_law(self, system, x, point) -> Stability | None:
        """Return the stability of a state; None without an index: no convex energy, or no closed loop near it."""
        if self._margin is not None and not self._margin(system, x) > levels.APART:
            return None
        try:
            return self.at(system, x, point)
        except ValueError:  # not convex between the points where the margin was computed, or too far from the branch
            return None

    def index(self, point, x=None) -> int:
        """Return the index of a point, or of unknowns beside it; `UNDECIDED` where there is none."""
        result = self._within_law(point.system, point.x if x is None else x, point)
        return result.index if result is not None and result.decided else UNDECIDED

    def change(self, point) -> Change:
        """Return the index on both sides of a fold or secondary bifurcation, from two nearby points on the branch."""
        if point.label not in (Label.FOLD, LABEL):
            return Change()
        before, after = (self._beside(point, side) for side in (-1, 1))
        if point.label == Label.FOLD:
            return Change(before, after, 1)
        return Change(before, after, *_broken(point))

    def _beside(self, point, side: int) -> int:
        """Return the index at a small distance along the branch."""
        tangent = point.tangent / np.linalg.norm(point.tangent)
        distance = side * levels.BESIDE * (1 + np.linalg.norm(point.x))
        try:
            there = correct(point.system, point.x + distance * tangent, tangent, tangent @ point.x + distance)
        except ConvergenceError:  # for example at a bifurcation that was not located
            return UNDECIDED
        return self.index(point, there.x)

    def _monitor(self, name) -> Event:
        """Return the test function of one symmetry class: its determinant, which is zero where the symmetry is broken."""

        def determinant(trial):
            result = self._within_law(trial.system, trial.x, trial)
            if result is None:
                return np.nan  # no zero: the run ends before
            entry = result[name]
            values = entry.eigenvalues
            if not self._from_circle:
                beside = force(trial) < _LITTLE_FORCE and abs(values[entry.nearest]) < levels.DOUBLED
                return np.nan if beside else float(np.prod(values))
            if name[0] == 0 and abs(trial["M2"]) < levels.APART:  # zeros of rotations of a circle, not of the branch's phase
                values = values[np.abs(values) > levels.APART]
            return float(np.prod(values))

        mode = Mode(self._n, *name)
        return Event(
            LABEL, str(mode), determinant, looks=_LOOKS, asks=lambda arc: name in self._moved(arc), describe=lambda trial: mode
        )

    def _moved(self, arc) -> set:
        """Return the classes with an eigenvalue that may pass zero inside a step, looked for once a step."""
        if self._step[0] is not arc.before or self._step[1] is not arc.trial:
            self._step = arc.before, arc.trial, self._moving(arc)
        return self._step[2]

    def _moving(self, arc) -> set:
        ends = [self._within_law(trial.system, trial.x, trial) for trial in (arc.before, arc.trial)]
        if None in ends:
            return self._names
        first, last = (np.array([entry.eigenvalues for entry in end.classes]) for end in ends)
        if first.shape != last.shape:  # another number of intervals was condensed
            return self._names
        moved = np.any(np.abs(last - first) > _MOVES * np.minimum(np.abs(first), np.abs(last)), axis=1)
        return {entry.name for entry, one in zip(ends[0].classes, moved) if one}


def _broken(point) -> tuple[int, str]:
    """Return the dimension of the kernel of a secondary bifurcation, and the symmetries that it breaks."""
    reversal, how = point.system.problem.on.reversal, point.details
    if reversal:  # a half loop has only one reversal
        return 1, REVERSALS[reversal]
    n = how.n
    if not how.keeps:
        return how.dimension, f"{n} mirrors, {n} two-fold axes"
    return how.dimension, " or ".join(how.broken(reversal) for reversal in how.keeps)
