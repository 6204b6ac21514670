"""The watch list of a run: what both ends of a step say of special points inside it, and of whether it stays on its branch.

It is made when a run begins. Each entry compares numbers of both ends, and asks for a closer look at the step
(`contin.events.inspection`) where something may happen in between. A step for which no entry asks is plain: nothing else is
computed of it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from contin.core.protocol import Discretization
from contin.core.settings import Settings
from contin.core.trial import Event, same_sign
from contin.events.folds import may_turn
from contin.events.inspection import Inspection
from contin.events.trivial import crossed

#: Returns whether a step wants a closer look.
Entry = Callable[[Inspection], bool]


def watch_list(
    system: Discretization,
    settings: Settings,
    tests: Sequence[Event],
    fold: Event | None,
    index: Event | None,
) -> list[Entry]:
    """Return the entries of a run; each returns whether it asks for a closer look at a step.

    Parameters
    ----------
    system : Discretization
        Of the first point; others of the run have the same free parameters.
    settings : Settings
    tests : sequence of Event
    fold, index : Event, optional
        The rate of the primary parameter, and the index of a variational problem.
    """
    held = [test for test in tests if test.holds_one_of(system.free)]
    entries: list[Entry] = [_determinant(settings.branch_points), Inspection.may_close]
    entries += [_value(system.free.index(test.column), test) for test in held]
    entries += [_sign(test) for test in tests if test not in held]
    if fold is not None:
        entries.append(lambda inspection: may_turn(inspection.arc, fold))
    if settings.trivial is not None:
        entries.append(_trivial(settings.trivial))
    if index is not None:
        entries.append(_changed(index))
    if system.size_of_solutions is not None:
        entries.append(_sign(system.size_of_solutions))
    return entries


def _determinant(counts: bool) -> Entry:
    """That of the determinant's sign and, where branch points are looked for, of singular values that come near zero."""

    def asks(inspection: Inspection) -> bool:
        before, trial = inspection.arc.before, inspection.arc.trial
        return not same_sign(before.sign, trial.sign) or (counts and inspection.branch_points.count != (0, True))

    return asks


def _value(place: int, test: Event) -> Entry:
    """That of a value of a free parameter, the one at this place."""
    value = test.value
    assert value is not None

    def asks(inspection: Inspection) -> bool:
        before, trial = inspection.arc.before, inspection.arc.trial
        system = trial.system
        at, size = system.state_size + place, system.free_scales[place]
        first, last = before.x[at] * size - value, trial.x[at] * size - value
        same = first < 0 > last or first > 0 < last
        return not same or (test.limit and trial.value(test) >= 0)

    return asks


def _sign(test: Event) -> Entry:
    """That of a test function: what it says of a step itself or, where it has nothing to say, the signs at both ends."""

    def asks(inspection: Inspection) -> bool:
        arc = inspection.arc
        if test.asks is not None:
            return test.asks(arc)
        if test.search is not None or test.looks:
            return True
        return arc.passes(test)

    return asks


def _trivial(name: str) -> Entry:
    def asks(inspection: Inspection) -> bool:
        arc = inspection.arc
        return crossed(arc.before, arc.trial, name, arc.newton)

    return asks


def _changed(index: Event) -> Entry:
    def asks(inspection: Inspection) -> bool:
        return abs(inspection.arc.before.value(index) - inspection.arc.trial.value(index)) > 0

    return asks
