"""Events that every run may ask for: user zeros, limits and folds; what the coefficient of a normal form adds to a point."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Mapping, Sequence

from contin.core.labels import Label
from contin.core.trial import Event, Trial
from contin.events import normal_forms
from contin.events.arc import Arc, Place, SpecialPoint
from contin.events.coefficient import Coefficient
from contin.levels import APART
from contin.names import value_names


def user_zeros(zeros: Mapping[str, Sequence[float]]) -> list[Event]:
    """Return the test functions of points where a parameter or functional takes given values (AUTO's UZ).

    A value that is given twice counts once. Different values have different names.
    """
    return [_user_zero(name, value, text) for name, values in zeros.items() for value, text in value_names(values).items()]


def _user_zero(name: str, value: float, text: str) -> Event:
    return Event(Label.USER_ZERO, f"{name} = {text}", lambda trial: trial[name] - value, column=name, value=value)


def limits(intervals: Mapping[str, Sequence[float]]) -> list[Event]:
    """Return the test functions that end a run where a parameter or functional reaches an end of its interval."""
    result = []
    for name, (low, high) in intervals.items():
        texts = value_names((low, high))
        result += [_limit(name, low, texts[low], -1), _limit(name, high, texts[high], 1)]
    return result


def _limit(name: str, value: float, text: str, side: int) -> Event:
    """Return the one of the upper (``side`` +1) or lower (-1) end."""

    def function(trial: Trial) -> float:
        return side * (trial[name] - value)

    return Event(Label.END, f"{name} = {text}", function, terminal=True, limit=True, column=name, value=value)


def within_limits(arc: Arc, points: list[SpecialPoint], ends: Sequence[Event]) -> list[SpecialPoint]:
    """Return the special points of a step up to where it first leaves the limits, which may have been seen at a point only.

    A quantity that passes its limit and comes back in one step has the same sign at both ends of the step.
    """
    last: Place = (arc.low, arc.before)
    for number, point in enumerate(points):
        if point.stop is not None:
            break
        for test in ends:
            value, before = test.function(point.trial), last[1].value(test)
            if before < 0 and value > APART * (abs(before) + value):
                return [*points[:number], arc.locate(test, last, (point.at, point.trial))]
        last = (point.at, point.trial)
    return points


@functools.lru_cache(maxsize=64)
def fold(name: str) -> Event:
    """Return the test function of folds with respect to a free parameter: its component of the tangent (AUTO's LP)."""
    return Event(Label.FOLD, name, lambda trial: trial.tangent[trial.system.parameter_index(name)], column=name,
                 normal_form=normal_forms.fold)  # fmt: skip


def with_normal_form(point: SpecialPoint, found: Coefficient, coarse: Coefficient, errors: bool) -> SpecialPoint:
    """Return a special point with the coefficient in its details and, but for folds, what it means in its name.

    The error is that of the derivatives, and what the coefficient differs from that on the mesh of the run. A coefficient that
    is nothing but error is left out, and its error is stated. Where ``errors`` are not wanted, and none could change the sign,
    it is not estimated.
    """
    unknown = not errors and found.is_certain
    error = 0.0 if unknown else found.error + abs(found.value - coarse.value)
    value = {} if found.is_meaningless(error) else {"normal_form": found.value}
    details = {**(point.details or {}), **value, **({} if unknown else {"normal_form_error": error})}
    attracts, repels = found.side * found.value < -error, found.side * found.value > error
    is_fold = point.test is not None and point.test.normal_form is normal_forms.fold
    kind = "" if is_fold else ", supercritical" if attracts else ", subcritical" if repels else ""
    return dataclasses.replace(point, name=point.name + kind, details=details)
