"""Test functions: of user zeros, limits and folds, and those that a kind of problem brings."""

from __future__ import annotations

import functools

from contin.detection.hopf import hopf
from contin.discretization.algebraic import Algebraic
from contin.discretization.protocol import Discretization
from contin.stepping.trial import TestFunction


def user_zero(name: str, value: float) -> TestFunction:
    """Return the test function of points where a parameter or functional takes a value (AUTO's UZ)."""
    return TestFunction("UZ", f"{name} = {value:g}", lambda trial: trial[name] - value)


def limit(name: str, value: float, side: int) -> TestFunction:
    """Return the test function that ends a run where a parameter or functional rises (``side`` +1) or falls (-1) to a value."""
    return TestFunction("EP", f"{name} = {value:g}", lambda trial: side * (trial[name] - value), terminal=True, limit=True)


def fold(name: str) -> TestFunction:
    """Return the test function of folds with respect to a free parameter: its component of the tangent (AUTO's LP)."""
    return TestFunction("LP", name, lambda trial: trial.tangent[trial.system.parameter_index(name)])


@functools.singledispatch
def own_test_functions(system: Discretization) -> list[TestFunction]:
    """Return the test functions that a kind of problem brings, beyond folds and branch points. Each kind registers its own.

    Their signs may differ between meshes.
    """
    return []


@own_test_functions.register
def _of_equilibria(system: Algebraic) -> list[TestFunction]:
    return [hopf()] if system.problem.dynamics else []
