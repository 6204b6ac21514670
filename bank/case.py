"""A reference problem: its runs, and the special points of each, in order; a run must find exactly these."""

from __future__ import annotations

import functools
import importlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import pytest

from contin import Branch, Point, Settings
from contin.lowlevel import Continuation, Stop, levels

#: Wanted agreement with the reference, relative to max(1, |value|).
TOLERANCE = 1e-9
#: An error may be so many times its estimate, ten: the estimate is the change from one mesh to the next, a size and no bound.
UNDERRATED = 10.0
#: Largest quotient of an estimate and its error, or round-off where the error is below it. The largest of 499 estimates is 185,
#: with each of three draws of round-off. One estimate ten times too large goes unseen; all a hundred times too large are seen.
OVERRATED = 1000.0
#: Units in the last place that neither an error nor an estimate is expected to resolve.
ROUND_OFF = 4e-16


@dataclass(frozen=True, eq=False)
class Special:
    """A labelled point of a run: AUTO's two letters, and reference values of parameters and functionals.

    ``error`` bounds the error of the reference values themselves, relative to max(1, |value|).
    """

    label: str
    values: Mapping[str, float]
    error: float = 1e-15


@dataclass(frozen=True, eq=False)
class Case:
    """One run of a problem.

    Attributes
    ----------
    name : str
    run : callable
        ``run()`` computes the branch.
    known : sequence of Special, or callable
        Everything labelled after the first point, in the order of the run, its end included. What takes long is computed when
        it is asked for.
    """

    name: str
    run: Callable[[], Branch]
    known: Sequence[Special] | Callable[[], Sequence[Special]]

    @functools.cached_property
    def specials(self) -> Sequence[Special]:
        """What is known."""
        return self.known() if callable(self.known) else self.known


def value(point: Point, name: str) -> float:
    """A parameter or functional of a point, or the frequency of a Hopf point."""
    return point.details["frequency"] if name == "frequency" else point[name]


def labelled(branch: Branch) -> list[Point]:
    """The points of a run that are to be compared."""
    return [point for point in branch.points[1:] if point.label]


def deviations(point: Point, special: Special) -> dict[str, float]:
    """|computed - reference| / max(1, |reference|) for every value."""
    return {name: abs(value(point, name) - known) / max(1.0, abs(known)) for name, known in special.values.items()}


@dataclass(frozen=True)
class Estimate:
    """An error estimate of a special point beside the true error.

    Attributes
    ----------
    error, estimate : float
    least : float
        Uncertainty of the reference, or round-off if that is more: no error below it can be told from zero.
    round_off : float
        What contin states at least.
    """

    error: float
    estimate: float
    least: float
    round_off: float

    @property
    def is_underrated(self) -> bool:
        """Whether the error is more than ten times its estimate; also if there is no estimate."""
        return not self.error <= UNDERRATED * (self.estimate + self.least)

    @property
    def is_overrated(self) -> bool:
        """Whether the estimate is more than a thousand times the error and what cannot be told from it."""
        return self.estimate > OVERRATED * max(self.error, self.least, self.round_off)


def estimates(point: Point, special: Special) -> dict[str, Estimate]:
    """The error estimates of a point's free parameters whose reference values are known."""
    sizes = {name: max(1.0, abs(known)) for name, known in special.values.items() if name in point.errors}
    return {
        name: Estimate(
            abs(point[name] - special.values[name]), point.errors[name], max(special.error, ROUND_OFF) * size,
            levels.LAST_PLACES * (1 + abs(point[name])),
        )
        for name, size in sizes.items()
    }  # fmt: skip


def run_until(start: Point, free: Sequence[str], labels: int, **settings) -> Branch:
    """Follow a branch that has no end of its own until it has come past so many labelled points."""
    system, x = start.system.with_free(free, start.x)
    run = Continuation(system, x, Settings(**settings))
    points, found = [], -1
    for point in run:
        points.append(point)
        found += bool(point.label)
        if found == labels:
            return Branch(points, Stop("cut", f"{labels} labelled points passed"))
    return Branch(points, run.stop)


#: Cases that take two seconds or more, most of it compiling.
LONG = {"grid of 3 x 3", "spb: gam", "Hodgkin-Huxley", "kar", "Cahn-Hilliard", "beam on a foundation, double"}


def bank(*names: str) -> list:
    """The cases of these problems as pytest's parameters."""
    cases = [case for name in names for case in importlib.import_module(f"bank.{name}").CASES]
    return [pytest.param(case, id=case.name, marks=[pytest.mark.full] if case.name in LONG else []) for case in cases]


def check(case: Case) -> None:
    """Run a case, assert that what came out is what is known and that error estimates are neither too small nor too large."""
    branch = case.run()
    found = labelled(branch)
    assert [point.label for point in found] == [special.label for special in case.specials], branch.stop
    assert not branch.notes
    for point, special in zip(found, case.specials):
        for name, deviation in deviations(point, special).items():
            assert deviation <= max(TOLERANCE, special.error), (point.label, name, value(point, name), special.values[name])
    seen = [(point, name, e) for point, special in zip(found, case.specials) for name, e in estimates(point, special).items()]
    for point, name, estimate in seen:
        assert not estimate.is_underrated, (point.label, point.name, name, estimate)
        assert not estimate.is_overrated, (point.label, point.name, name, estimate)
