"""The watch list of a run: which steps want a closer look, and why one is not believed.

It is made when a run begins, from the system and the settings: who is not concerned is not asked. An entry that asks compares
numbers of both ends of a step; a step for which none asks is plain, and nothing else is computed of it. An entry that
doubts says of a step that was looked at, as a clause, that it may have left its branch or passed something unseen.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from contin.core.labels import Label
from contin.core.settings import Settings
from contin.core.trial import Event, Trial, same_sign
from contin.events.arc import Arc, SpecialPoint
from contin.events.folds import may_turn, sense
from contin.events.inspection import Inspection, Sought, Start, crossed
from contin.events.labelled import contradiction

#: What a note says of a step that no shorter one explains.
_STRAYS = "the determinant changes its sign, and no branch point was found"

#: Returns whether a step wants a closer look.
Asks = Callable[[Inspection], bool]
#: Returns why a step cannot be believed; "" where it can.
Doubts = Callable[[Inspection], str]


class Watch:
    """What the test functions of a run say of its steps.

    - ``start`` (tuple (system, x, tangent)): The first point of the run; other systems of it have the same free parameters.
    - ``settings`` (Settings)
    - ``tests``, ``general`` (sequence of Event): All, and those that have the same sign on every mesh.
    - ``fold`` (Event, optional): The rate of the primary parameter; None where folds are not wanted.
    """

    def __init__(
        self, start: Start, settings: Settings, tests: Sequence[Event], general: Sequence[Event], fold: Event | None
    ) -> None:
        system = start[0]
        shrinks, self.index = system.size_of_solutions, system.index
        #: The test functions at whose zeros the run ends, but for limits.
        self.ends = [test for test in tests if test.terminal and not test.limit]
        held = [test for test in tests if test.holds_one_of(system.free)]
        self._asks: list[Asks] = [_determinant(settings.branch_points), Inspection.may_close]
        self._values: list[Asks] = [_value(system.free.index(test.column), test) for test in held]
        self._asks += self._values
        self._asks += [_sign(test) for test in tests if test not in held]
        #: Those of the equations, which are singular where a kind of problem knows its branch to end, and others.
        self._of_equations: list[Doubts] = [_unclear] if settings.branch_points else []
        self._doubts: list[Doubts] = []
        homes: list[Callable[[Inspection], SpecialPoint | None]] = []
        if shrinks is not None:
            homes.append(lambda inspection: inspection.arc.trial.system.home(inspection.arc))  # the kind of problem knows it
            self._asks.append(_sign(shrinks))
        if (name := settings.trivial) is not None:
            homes.append(Inspection.trivial_end)
            self._asks.append(lambda each: crossed(each.arc.before, each.arc.trial, name, each.arc.newton))
            self._of_equations.append(_lost_home(name))
        self._of_equations.append(_lost_branch_point if settings.branch_points else _strays)
        if (index := self.index) is not None:
            self._asks.append(lambda each: abs(each.arc.before.value(index) - each.arc.trial.value(index)) > 0)
            self._doubts.append(_contradicts(index))
        if self.ends:
            self._doubts.append(self._lost_end)
        if any(test.label == Label.GRAZING for test in tests):
            self._doubts.append(_lost_grazing)
        if settings.mesh.every:
            self._asks.append(lambda inspection: inspection.arc.trial.settled is not inspection.arc.trial)
            self._doubts.append(_moved_past(general, fold, settings))
        if fold is not None:
            self._asks.append(lambda inspection: may_turn(inspection.arc, fold))
            self._doubts.append(_lost_fold(fold.name))
        self._sought, self._values_sought = Sought(settings, start, tests, fold, homes), Sought(settings, start, held, None, ())

    def inspection(self, arc: Arc, plain: bool = False) -> Inspection:
        """Return the inspection of a step; a ``plain`` one can only pass values of free parameters."""
        return Inspection(arc, self._values_sought if plain else self._sought, plain)

    def asks(self, inspection: Inspection) -> bool:
        """Return whether a step must be looked at closely, by what both its ends say."""
        return any(asks(inspection) for asks in (self._values if inspection.plain else self._asks))

    def doubt(self, inspection: Inspection) -> str:
        """Return why a step cannot be believed, as a clause; "" where it can.

        Raises ConvergenceError where a point inside the step that is needed to tell is not found.
        """
        home = inspection.home
        known = home is not None and home.is_located and not home.is_trivial  # what the equations say there is blurred
        doubts = self._doubts if known else [*self._of_equations, *self._doubts]
        return "" if inspection.plain else next((clause for says in doubts if (clause := says(inspection))), "")

    def ends_inside(self, arc: Arc) -> bool:
        """Return whether the run ends inside a step, and not at a limit: the point at its end is not accepted.

        The equations may not hold there, and no mesh be fine enough.
        """
        return any(arc.passes(test) for test in self.ends)

    def _lost_end(self, inspection: Inspection) -> str:
        if not self.ends_inside(inspection.arc):
            return ""
        ends = [point for point in inspection.special_points if point.stop is not None]
        return "" if all(point.is_located for point in ends) else "the end of the run inside the step was not located"


# --- who asks ----------------------------------------------------------------------------------------------------------


def _determinant(counts: bool) -> Asks:
    """That of the determinant's sign and, where branch points are looked for, of singular values that come near zero."""

    def asks(inspection: Inspection) -> bool:
        before, trial = inspection.arc.before, inspection.arc.trial
        return not same_sign(before.sign, trial.sign) or (counts and inspection.branch_points.count != (0, True))

    return asks


def _value(place: int, test: Event) -> Asks:
    """That of a value of a free parameter, the one at this place."""
    value = test.value
    assert value is not None

    def asks(inspection: Inspection) -> bool:
        before, trial = inspection.arc.before, inspection.arc.trial
        system = trial.system
        at, size = system.state_size + place, system.free_scales[place]
        first, last = before.x[at] * size - value, trial.x[at] * size - value
        return not (first < 0 > last or first > 0 < last) or (test.limit and trial.value(test) >= 0)

    return asks


def _sign(test: Event) -> Asks:
    """That of a test function: what it says of a step itself or, where it has nothing to say, the signs at both ends."""
    if test.asks is not None:
        asks = test.asks
        return lambda inspection: asks(inspection.arc)
    if test.search is not None or test.looks:
        return lambda _: True
    return lambda inspection: inspection.arc.passes(test)


# --- who doubts --------------------------------------------------------------------------------------------------------


def _unclear(inspection: Inspection) -> str:
    _, clear = inspection.branch_points.count
    return "" if clear else "the linearized equations come close to singular: branch points may have been passed"


def _lost_home(trivial: str) -> Doubts:
    """A change of sign of the trivial quantity without a zero on the branch means that Newton's method left the branch."""
    clause = f"{trivial} changes its sign, and no zero of it was found on the branch"
    return lambda inspection: "" if inspection.home is None or inspection.home.is_located else clause


def _lost_branch_point(inspection: Inspection) -> str:
    """So does one of the determinant without a branch point."""
    search = inspection.branch_points
    if (count := search.count[0]) > 1:
        return "" if search.multiple.is_located else f"{count} branch points in one step were not told apart"
    return "" if not search.sign_changes or search.simple.is_located else _STRAYS


def _strays(inspection: Inspection) -> str:
    """The same where branch points get no label.

    The sign changes where branches cross, labelled or not, and where a kind of problem knows its equations to be singular.
    """
    if not inspection.branch_points.sign_changes:
        return ""
    for point in inspection.special_points:
        ends = point.stop is not None and not (point.test is not None and point.test.limit)
        if point.is_located and (point.label == Label.BRANCH_POINT or ends):
            return ""
    return "" if inspection.branch_points.simple.is_located else _STRAYS


def _lost_fold(primary: str) -> Doubts:
    """Where the parameter turns on the branch, a fold is located: another arm beside a fold is passed the other way."""

    def doubt(inspection: Inspection) -> str:
        for point in inspection.special_points if inspection.folds else []:
            if point.stop is not None:
                break  # what lies beyond the end of the run is none of its branch
            if not point.is_located and any(point is fold for fold in inspection.folds):
                return f"{primary} turns, and no fold was found on the branch"
        return ""

    return doubt


def _lost_grazing(inspection: Inspection) -> str:
    lost = any(point.label == Label.GRAZING and not point.is_located for point in inspection.special_points)
    return "a grazing point inside the step was not located" if lost else ""


def _contradicts(index: Event) -> Doubts:
    def doubt(inspection: Inspection) -> str:
        if not contradiction(index, inspection.arc, ()):
            return ""  # without special points, which take time
        return contradiction(index, inspection.arc, inspection.special_points)

    return doubt


def _moved_past(general: Sequence[Event], fold: Event | None, settings: Settings) -> Doubts:
    """Special points lie between a point and the same one with other mesh points."""

    def way(trial: Trial) -> float:
        return 0.0 if fold is None else sense(trial, fold, settings.newton)

    def doubt(inspection: Inspection) -> str:
        trial = inspection.arc.trial
        end = trial.settled
        if end is trial:
            return ""
        same = same_sign(end.sign, trial.sign) and way(end) * way(trial) >= 0
        same = same and all(np.sign(trial.value(test)) == np.sign(end.value(test)) for test in general)
        return "" if same else "a special point moves out of the step with the places where conditions on states switch"

    return doubt
