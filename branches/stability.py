"""The index along a branch: a column, and the events where it changes other than at a fold."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from threadpoolctl import ThreadpoolController

from contin import ConvergenceError, TestFunction, correct
from ribbon_model.convexity import margin
from ribbon_model.laws import Law
from ribbon_model.modes import REVERSALS, Mode
from ribbon_model.secondary import force
from ribbon_model.solution import Solution
from ribbon_model.stability import Stability

#: Label of a secondary bifurcation: one that breaks a symmetry of the domain, which its own equations cannot see.
LABEL = "SB"
#: The column's value where the index could not be decided (on a bifurcation, an eigenvalue is zero).
UNDECIDED = -1
_ON_CIRCLE = 1e-6
#: Beside a primary branch, with less force than this, ...
_LITTLE_FORCE = 0.5
#: ... an eigenvalue below this may be one that vanishes there, and its sign says nothing.
_ZERO_BESIDE = 1e-8
#: The class that keeps all symmetry: an eigenvalue of it passes zero at folds, which the engine finds by itself.
_FULL = (0, "even")
#: A strain energy with a smaller margin of convexity is at its end: there is no index.
_CONVEX = 1e-6
#: Places inside a step where the sign is looked at: two secondary bifurcations in one step leave it as it was at the ends.
#: Pairs closer than a quarter of a step pass unseen.
_LOOKS = 3
#: The known zero, of the shift of phase, comes out as the error of the eigenvalues. Where it is larger than this, the mesh of
#: the state is too coarse for its index, and is halved so often at most. (It happens to strips of finite width that are nearly
#: folded: the zero is 1e-2 there, and an eigenvalue of 1e-3 changed its sign twice.)
_RESOLVED, _HALVINGS = 1e-6, 4
#: A point with a larger residual is a guess beside the branch, whose known zero is none.
_ON_BRANCH = 1e-7
#: Points whose stability is kept: the looks of all symmetry classes are at the same places of a step.
_KEPT = 2 * _LOOKS + 4
#: Distance along the branch at which the index beside a bifurcation is taken, relative to 1 + |x|.
_BESIDE = 1e-3


@dataclass(frozen=True)
class Change:
    """How the index changes at a labelled point.

    Attributes
    ----------
    before, after : int
        The index on either side, in the direction of travel; `UNDECIDED` elsewhere than at folds and secondary bifurcations.
    kernel : int
        Number of modes that are neutral there.
    breaks : str
        The symmetries of the branch that its neutral modes break, '' at a fold: what a branch that leaves there has lost. A
        pair of modes may have two kinds of branches, 'or' between them.
    """

    before: int = UNDECIDED
    after: int = UNDECIDED
    kernel: int = 0
    breaks: str = ""


class Watch:
    """Evaluates the index of points of one branch, each once.

    Parameters
    ----------
    law : Law
    system, x :
        The first point: what symmetry the branch has.
    from_circle : bool
        Whether the branch comes from a circle, and may end on one.
    """

    def __init__(self, law: Law, system, x, from_circle: bool = True):
        self._blas, self._from_circle = ThreadpoolController(), from_circle
        self._known: dict = {}
        self._margin = margin(law)
        self._n = system.problem.on.wavenumber(Solution.at(system, x).parameters)
        names = [entry.name for entry in self.at(system, x).classes]
        self.monitors = [self._monitor(name) for name in names if name != _FULL]

    def at(self, system, x, point=None) -> Stability:
        """The stability of a state; on the mesh that its index needs, if a ``point`` is given whose tangent is the branch's."""
        key = id(system), x.tobytes()
        if key not in self._known:
            result = self._resolved(system, x, point)
            while len(self._known) >= _KEPT:
                self._known.pop(next(iter(self._known)))
            self._known[key] = system, result  # the system, lest another one should get its id
        return self._known[key][1]

    def _resolved(self, system, x, point) -> Stability:
        """The stability on the system's mesh; on a finer one where a state of the branch has a known zero that is not small."""
        result = self._evaluated(system, x)
        if point is None or result.residual <= _RESOLVED or np.abs(system.residual(x)).max() > _ON_BRANCH:
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
            result = self._evaluated(system, x)
            if result.residual <= _RESOLVED:
                break
        return result

    def _evaluated(self, system, x) -> Stability:
        """The stability on the system's mesh."""
        with self._blas.limit(limits=1, user_api="blas"):  # more threads only slow down matrices this small
            return Solution.at(system, x).index()

    def _within_law(self, system, x, point) -> Stability | None:
        """The stability of a state; None at the end of a law whose energy is convex no further, where there is no index."""
        if self._margin is None:
            return self.at(system, x, point)
        if not self._margin(system, x) > _CONVEX:
            return None
        try:
            return self.at(system, x, point)
        except ValueError:  # not convex somewhere between the places where the margin was looked at
            return None

    def index(self, point) -> int:
        """The index of a point, or `UNDECIDED`."""
        result = self._within_law(point.system, point.x, point)
        return result.index if result is not None and result.decided else UNDECIDED

    def change(self, point) -> Change:
        """The index on both sides of a fold or secondary bifurcation, from two points close by on the branch."""
        if point.label not in ("LP", LABEL):
            return Change()
        before, after = (self._beside(point, side) for side in (-1, 1))
        if point.label == "LP":
            return Change(before, after, 1)
        return Change(before, after, *_broken(point))

    def _beside(self, point, side: int) -> int:
        """The index at a small distance along the branch."""
        tangent = point.tangent / np.linalg.norm(point.tangent)
        distance = side * _BESIDE * (1 + np.linalg.norm(point.x))
        try:
            there = correct(point.system, point.x + distance * tangent, tangent, tangent @ point.x + distance)
        except ConvergenceError:  # at a bifurcation that could not be located, say
            return UNDECIDED
        result = self._within_law(point.system, there.x, point)
        return result.index if result is not None and result.decided else UNDECIDED

    def _monitor(self, name) -> TestFunction:
        """The determinant of one symmetry class, whose zeros are bifurcations that break the symmetry."""

        def determinant(trial):
            try:
                result = self._within_law(trial.system, trial.x, trial)
            except ValueError:  # a guess too far beside the branch: no closed loop, or no convex energy
                return np.nan
            if result is None:
                return np.nan  # no event: the run ends before
            entry = result[name]
            values = entry.eigenvalues
            if not self._from_circle:
                beside = force(trial) < _LITTLE_FORCE and abs(values[entry.nearest]) < _ZERO_BESIDE
                return np.nan if beside else float(np.prod(values))
            if name[0] == 0 and abs(trial["M2"]) < _ON_CIRCLE:  # of a circle, rotations that the branch's own phase replaces
                values = values[np.abs(values) > _ON_CIRCLE]
            return float(np.prod(values))

        mode = Mode(self._n, *name)
        return TestFunction(LABEL, str(mode), determinant, looks=_LOOKS, describe=lambda trial: mode)


def _broken(point) -> tuple[int, str]:
    """Dimension of the kernel of a secondary bifurcation, and the symmetries that it breaks."""
    reversal, how = point.system.problem.on.reversal, point.details
    if reversal:  # a half loop: its one reversal is all that there is
        return 1, REVERSALS[reversal]
    n = how.n
    if not how.keeps:
        return how.dimension, f"{n} mirrors, {n} two-fold axes"
    return how.dimension, " or ".join(how.broken(reversal) for reversal in how.keeps)
