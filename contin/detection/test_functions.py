"""Monitors: named functions of a point that make events; and locating where they vanish."""

from __future__ import annotations

import functools

from contin.detection.hopf import hopf
from contin.discretization.algebraic import Algebraic
from contin.discretization.protocol import Discretization
from contin.stepping.trial import Monitor


def user_zero(name: str, value: float) -> Monitor:
    """The event that a parameter or functional takes a value."""
    return Monitor("UZ", f"{name} = {value:g}", lambda trial: trial[name] - value)


def limit(name: str, value: float, side: int) -> Monitor:
    """The end of a run where a parameter or functional rises (``side`` +1) or falls (-1) to a value."""
    return Monitor("EP", f"{name} = {value:g}", lambda trial: side * (trial[name] - value), terminal=True, limit=True)


def fold(name: str) -> Monitor:
    """The event that a free parameter turns round (AUTO's limit point)."""
    return Monitor("LP", name, lambda trial: trial.tangent[trial.system.parameter_index(name)])


@functools.singledispatch
def kind_monitors(system: Discretization) -> list[Monitor]:
    """Monitors that this kind of problem brings, beyond folds and branch points; each kind registers its own."""
    return []


@kind_monitors.register
def _of_equilibria(system: Algebraic) -> list[Monitor]:
    return [hopf()] if system.problem.dynamics else []
