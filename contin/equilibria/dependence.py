"""Equations that are singular everywhere: some depend on each other, or states occur only together, as in differences.

The null vectors that the Jacobian has at several places alike: w^T F_u = 0 everywhere says that w.F is a constant, F_u v = 0
everywhere that a solution u comes with all u + c v.
"""

from __future__ import annotations

import contextlib
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from contin import errors as checks
from contin.arrays import Array
from contin.draws import ASIDE, PLACES, generator
from contin.levels import APART, CERTAIN, LOCATED
from contin.linalg.matrices import DenseFactors
from contin.text import COLUMNS

if TYPE_CHECKING:
    from contin.equilibria.equations import Algebraic

#: More states are not looked at: 1000 take a tenth of a second, and five where the equations are singular.
MOST_STATES = 1000
#: Sizes of the states at places where a total must stay, one after the other: conditions on states, such as a threshold, would
#: have to lie beyond all of them to be missed.
_SIZES = (1.0, 0.1, 3.0, 10.0, 100.0)


def dependence(system: Algebraic, x: Array) -> str:
    """Return which equations are dependent near x, or which states occur only together, as a sentence with advice; or ""."""
    if system.size != system.state_size or system.size > MOST_STATES:
        return ""
    with np.errstate(all="ignore"):
        matrix = _balanced(system.jacobian(x))[0]
        if not DenseFactors(matrix).reciprocal_condition <= _zero(len(matrix)):
            return ""
        places = _around(system, x)
    if len(places) < PLACES:
        return ""
    matrices = [system.jacobian(place) for place in places]
    equations = reduced(_null_vectors(np.hstack(matrices).T))
    states = reduced(_null_vectors(np.vstack(matrices)))
    return _of_equations(system, places, equations, bool(len(states))) or _of_states(system, states)


def conservation_laws(problem: Any) -> Array:
    """Return the totals that no motion of u' = F changes, (m, n): rows w with w.F = 0 whatever states and parameters are.

    Each total has a state of its own, with the factor 1: rows are in reduced echelon form. Of the forms that the first and
    the last states lead to, that with fewer negative factors is taken. Angles have no totals.
    """
    n = len(problem.state_names)
    none = np.empty((0, n))
    if not problem.dynamics or n > MOST_STATES:
        return none
    random = generator("dependence")
    columns: list[Array] = []
    for size in _SIZES:
        p = {name: value + ASIDE * (1 + abs(value)) * random.uniform(0.1, 1.0) for name, value in problem.parameters.items()}
        system, u = problem.discretized((), p), size * random.uniform(0.1, 1.0, n)
        with contextlib.suppress(ArithmeticError, ValueError), np.errstate(all="ignore"):
            matrix, rates = system.jacobian(u), system.residual(u)
            if not (np.isfinite(matrix).all() and np.isfinite(rates).all()):
                continue
            if not columns and not DenseFactors(_balanced(matrix)[0]).reciprocal_condition <= _zero(n):
                return none
            columns += [matrix, rates[:, None]]
    vectors = _null_vectors(np.hstack(columns).T) if len(columns) > len(_SIZES) else none
    if len(vectors) == n:
        return none  # nothing moves
    forms = [reduced(vectors), reduced(vectors[:, ::-1])[:, ::-1]]
    fewest: Array = min(forms, key=lambda form: np.count_nonzero(form < 0))
    found: Array = np.where(np.abs(fewest - np.rint(fewest)) < LOCATED, np.rint(fewest), fewest)
    return none if any(problem.angles.get(problem.state_names[i]) for i in np.flatnonzero(found.any(axis=0))) else found


def _around(system: Algebraic, x: Array) -> list[Array]:
    """Return places near x where the equations are defined; above x first, where logarithms and roots are."""
    random, found = generator("dependence"), []
    for sign in np.repeat((1.0, -1.0), PLACES):
        place = x + sign * ASIDE * (1 + np.abs(x)) * random.uniform(0.1, 1.0, x.size)
        with contextlib.suppress(ArithmeticError, ValueError):
            if np.isfinite(system.jacobian(place)).all() and np.isfinite(system.residual(place)).all():
                found.append(place)
    return found[:PLACES]


def _balanced(matrix: Array) -> tuple[Array, Array]:
    """Return a matrix with rows and columns of size one, and what its columns were divided by."""
    rows = np.abs(matrix).max(axis=1, keepdims=True)
    matrix = matrix / np.where(rows > 0, rows, 1.0)
    columns = np.abs(matrix).max(axis=0)
    columns = np.where(columns > 0, columns, 1.0)
    return matrix / columns, columns


def _zero(size: int) -> float:
    """Return the smallest singular value of a matrix of this size that is not round-off, of 1 for the largest."""
    return float(CERTAIN * size * np.finfo(float).eps)


def _null_vectors(matrix: Array) -> Array:
    """Return a basis of the v with matrix v = 0, as rows; there are as many rows as columns, or more."""
    balanced, columns = _balanced(matrix)
    _, values, vectors = np.linalg.svd(np.linalg.qr(balanced, mode="r"))
    return vectors[values <= _zero(len(values)) * values[0]] / columns


def reduced(vectors: Array) -> Array:
    """Return the basis in reduced echelon form, which does not depend on the one given; small numbers are zero."""
    vectors, number = vectors.copy(), 0
    for place in range(vectors.shape[1]):
        if number == len(vectors):
            break
        chosen = number + int(np.abs(vectors[number:, place]).argmax())
        if abs(vectors[chosen, place]) > APART * np.abs(vectors[number:]).max():
            vectors[[number, chosen]] = vectors[[chosen, number]]
            vectors[number] /= vectors[number, place]
            others = np.arange(len(vectors)) != number
            vectors[others] -= vectors[others, place, None] * vectors[number]
            number += 1
    return np.where(np.abs(vectors) > LOCATED, vectors, 0.0)


def _first(vector: Array) -> int:
    return int(np.flatnonzero(vector)[0])


def _of_equations(system: Algebraic, places: Sequence[Array], vectors: Array, is_shifted: bool) -> str:
    """Return what is said of combinations of equations that are constants."""
    if not len(vectors):
        return ""
    numbers, names = [f"equation {i + 1}" for i in range(vectors.shape[1])], system.named_states
    residuals = np.array([system.residual(place) for place in places])
    for vector in vectors:
        terms = vector * residuals
        value = float(terms.sum(axis=1).mean())
        if abs(value) > LOCATED * np.abs(terms).max():
            what = f"{written(vector, numbers)} is {value:.6g} whatever the states are"
            return f"residual: {what}: there is no solution, unless a parameter takes this number to zero"
    combined = checks.listed(written(vector, numbers) for vector in vectors)
    replaced = checks.listed(numbers[_first(vector)] for vector in vectors)
    totals = checks.listed(written(vector, names) for vector in vectors)
    what = f"{combined} {'is' if len(vectors) == 1 else 'are'} 0 whatever the states are"
    condition = "a condition that fixes" if len(vectors) == 1 else f"{len(vectors)} conditions that fix"
    held = " (or holds one state)" if is_shifted else ""
    return f"residual: {what}: put {condition} {totals}, where the equations are rates of these{held}, in place of {replaced}"


def _of_states(system: Algebraic, vectors: Array) -> str:
    if not len(vectors):
        return ""
    names = system.named_states
    moved = [f"{name} by {part:.6g}" for name, part in zip(names, vectors[0]) if part]
    text = ", ".join(moved[:COLUMNS]) + (", ..." if len(moved) > COLUMNS else "")
    held = names[_first(vectors[0])]
    what = f"residual: no equation changes when states change together ({text})"
    return f"{what}: add the equation that {held} is held, and free a parameter"


def written(vector: Array, names: Sequence[str]) -> str:
    """Return a combination of names, such as "x + 2 y"."""
    text = ""
    places = np.flatnonzero(vector)
    for i in places[:COLUMNS]:
        size = "" if abs(abs(vector[i]) - 1) < LOCATED else f"{abs(vector[i]):.6g} "
        sign = "-" if vector[i] < 0 else "+"
        text += f" {sign} {size}{names[i]}" if text else f"{'-' if vector[i] < 0 else ''}{size}{names[i]}"
    return text + (" + ..." if len(places) > COLUMNS else "")
