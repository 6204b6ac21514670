"""Special points from formulas: zeros of functions of one variable, and equilibria whose branch is known in closed form.

Nothing of the engine is used here: derivatives are complex steps of the same plain functions, zeros are bracketed by scipy.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import combinations

import numpy as np
from scipy.optimize import brentq

from bank.case import Special

#: The zeros of an interval are looked for between so many places.
GRID = 401
#: Reference values from these formulas are good to this, relative to max(1, |value|).
ERROR = 2e-14


def zeros(function: Callable[[float], float], low: float, high: float, grid=GRID) -> list[float]:
    """All simple zeros behind ``low`` and up to ``high``, in this order."""
    places = np.linspace(low, high, grid)
    values = [function(s) for s in places]
    found = []
    for a, b, f, g in zip(places, places[1:], values, values[1:]):
        if f * g < 0:
            found.append(brentq(function, min(a, b), max(a, b), xtol=1e-15, rtol=8.9e-16))
        elif g == 0:
            found.append(float(b))
    return found


def slope(function: Callable[[complex], complex]) -> Callable[[float], float]:
    """The derivative of an analytic function, to round-off."""
    return lambda s: np.imag(function(s + 1e-30j)) / 1e-30


class _Values:
    """Numbers by name, complex ones too."""

    def __init__(self, numbers: Mapping[str, complex]):
        self.__dict__.update(numbers)


def jacobian(problem, states: Sequence[float], parameters: Mapping[str, float]) -> np.ndarray:
    """The derivatives of an algebraic problem by its states, by the complex step."""
    p, names = _Values({**problem.parameters, **parameters}), problem.state_names
    columns = []
    for i in range(len(names)):
        moved = np.array(states, complex)
        moved[i] += 1e-30j
        columns.append(np.imag(problem.residual(_Values(dict(zip(names, moved))), p)) / 1e-30)
    return np.array(columns).T


def sums(matrix: np.ndarray) -> float:
    """The product of the sums of all pairs of eigenvalues: zero at Hopf points and neutral saddles."""
    pairs = combinations(np.linalg.eigvals(matrix), 2)
    return float(np.real(np.prod([a + b for a, b in pairs])))


def frequency(matrix: np.ndarray) -> float:
    """The imaginary part of the pair of eigenvalues with the smallest sum; 0 for two real ones."""
    first, _ = min(combinations(np.linalg.eigvals(matrix), 2), key=lambda pair: abs(sum(pair)))
    return abs(float(np.imag(first)))


def equilibria(problem, free: str, curve: Callable, low: float, high: float, held: Mapping[str, float] | None = None):
    """The special points of a branch of equilibria given by ``curve(s)``, which returns its states and the free parameter.

    Folds are where the parameter turns, branch points other zeros of the determinant, Hopf points zeros of ``sums`` between
    complex eigenvalues. The last point is the end. Every special point has the free parameter, and the states that the problem
    has among its functionals.
    """

    def matrix(s):
        states, value = curve(s)
        return jacobian(problem, states, {**(held or {}), free: value})

    def special(label, s):
        states, value = curve(s)
        known = {name: float(u) for name, u in zip(problem.state_names, states) if name in problem.functionals}
        return Special(label, {free: float(value), **known}, ERROR)

    folds = zeros(slope(lambda s: curve(s)[1]), low, high)
    singular = zeros(lambda s: np.linalg.det(matrix(s)), low, high)
    crossings = [s for s in singular if min((abs(s - fold) for fold in folds), default=1) > 1e-6 * abs(high - low)]
    found = [(s, special("LP", s)) for s in folds] + [(s, special("BP", s)) for s in crossings]
    for s in zeros(lambda s: sums(matrix(s)), low, high) if len(problem.state_names) > 1 else ():
        if frequency(matrix(s)) > 1e-6:
            hopf = special("HB", s)
            found.append((s, Special("HB", {**hopf.values, "frequency": frequency(matrix(s))}, ERROR)))
    found.sort(key=lambda entry: entry[0] if high > low else -entry[0])
    return [entry for _, entry in found] + [special("EP", high)]
