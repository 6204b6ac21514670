"""Whether a step that was corrected is to be believed, and whether it must be looked at closely."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from contin.core.settings import Settings
from contin.core.trial import Event, Trial, same_sign
from contin.events.arc import Arc
from contin.events.index import contradiction
from contin.events.inspection import Inspection, Start
from contin.events.watch import watch_list


class Judge:
    """What the test functions of a run say of its steps.

    Parameters
    ----------
    start : tuple (system, x, tangent)
        The first point of the run.
    settings : Settings
    tests, general : sequence of Event
        All, and those that have the same sign on every mesh.
    fold : Event, optional
        None where folds are not wanted.
    sense : callable
        ``sense(trial)``: the sense in which the primary parameter goes.
    """

    def __init__(
        self, start: Start, settings: Settings, tests: Sequence[Event], general: Sequence[Event],
        fold: Event | None, sense: Callable[[Trial], float],
    ) -> None:  # fmt: skip
        self._start, self._tests, self._general, self._fold, self._sense = start, tests, general, fold, sense
        #: The test functions at whose zeros the run ends, but for limits.
        self.ends = [test for test in tests if test.terminal and not test.limit]
        self.index = start[0].index
        self._watch = watch_list(start[0], settings, tests, fold, self.index)

    def inspection(self, arc: Arc, settings: Settings) -> Inspection:
        """Return the inspection of a step."""
        return Inspection(arc, settings, self._start, self._fold)

    def asks(self, inspection: Inspection) -> bool:
        """Return whether a step must be looked at closely, by what both its ends say."""
        arc = inspection.arc
        return arc.is_moved or any(asks(inspection) for asks in self._watch)

    def doubt(self, inspection: Inspection) -> str:
        """Return why a step cannot be believed, as a clause; "" where it can.

        Raises
        ------
        ConvergenceError
            A point inside the step that is needed to tell is not found.
        """
        arc = inspection.arc
        doubt = inspection.doubt() or self._contradiction(inspection) or self._lost_end(inspection)
        return doubt or self._moved_past(arc.trial) or inspection.strays(self._tests)

    def ends_inside(self, arc: Arc) -> bool:
        """Return whether the run ends inside a step, and not at a limit: the point at its end is not accepted.

        The equations may not hold there, and no mesh be fine enough.
        """
        return any(arc.passes(test) for test in self.ends)

    def _contradiction(self, inspection: Inspection) -> str:
        """Return how the change of index over a step contradicts its special points; "" if not."""
        if not contradiction(self.index, inspection.arc, ()):
            return ""  # without special points, which take time
        return contradiction(self.index, inspection.arc, inspection.special_points(self._tests))

    def _lost_end(self, inspection: Inspection) -> str:
        """Return a clause if the run ends inside a step, at a place that was not located; "" otherwise."""
        if not self.ends_inside(inspection.arc):
            return ""
        ends = [point for point in inspection.special_points(self._tests) if point.stop is not None]
        return "" if all(point.is_located for point in ends) else "the end of the run inside the step was not located"

    def _moved_past(self, trial: Trial) -> str:
        """Return a clause if special points lie between a point and the same one with other mesh points; "" otherwise."""
        end = trial.settled
        if end is trial:
            return ""
        same = same_sign(end.sign, trial.sign) and self._sense(end) * self._sense(trial) >= 0
        same = same and all(np.sign(trial.value(test)) == np.sign(end.value(test)) for test in self._general)
        return "" if same else "a special point moves out of the step with the places where conditions on states switch"
