"""The solution of every point of a branch file: read where the file keeps it, otherwise computed from the one before."""

from __future__ import annotations

import contextlib
import itertools
from collections.abc import Iterator, Sequence

import numpy as np

from branches.store.branch import StoredBranch
from branches.store.files import StoreError
from contin import ConvergenceError, Newton
from contin.lowlevel import Collocation, correct, levels, point_of

#: Newton's tolerance, and the largest difference from the columns, relative to 1 + their size: shapes need four
#: digits, and the mesh is that of a kept solution from before, which may be too coarse here for more.
_TOLERANCE, _SAME = 1e-8, 1e-4

#: A discretized problem and its unknowns.
Solution = tuple[Collocation, np.ndarray]


def solutions(branch: StoredBranch) -> list[Solution | None]:
    """Return the solution of every point, in order; None for a point at which Newton's method does not find it.

    The parameters of a point are columns, so solutions between two that the file keeps are found as on the branch itself, by a
    secant and Newton's method: from the first of the two on its mesh, and where that fails from the second on its mesh.

    Raises
    ------
    StoreError
        A solution that the file keeps does not belong to the columns of its point.
    """
    kept = {number: _kept(branch, number) for number in branch.kept().tolist()}
    found: list[Solution | None] = [kept.get(number) for number in range(len(branch.points))]
    numbers = list(kept)
    for first, last in itertools.pairwise(numbers):
        for number, solution in _walk(branch, kept, range(first, last), last):
            found[number] = solution
        for number, solution in _walk(branch, kept, range(last, first, -1), first):
            if found[number] is not None:
                break
            found[number] = solution
    other, last = numbers[-2:][0], numbers[-1]
    other = other if branch.stage_of[other] == branch.stage_of[last] else last
    for number, solution in _walk(branch, kept, range(last, len(found)), other):  # an interrupted run
        found[number] = solution
    return found


def filled(branch: StoredBranch, known: Sequence[int], values: np.ndarray) -> np.ndarray:
    """Return values (points, ...) of all points from those of the ``known`` ones: linear over arclength between neighbours."""
    if len(known) == len(branch.points):
        return values
    place = np.interp(branch.way, branch.way[known], np.arange(len(known)))
    low = np.minimum(place.astype(int), len(known) - 2)
    part = (place - low)[:, None, None]
    return (1 - part) * values[low] + part * values[low + 1]


def _kept(branch: StoredBranch, number: int) -> Solution:
    """Return a solution that the file keeps; raise StoreError unless it solves the equations with the columns of its point."""
    system, x = branch.discretized(number)
    residual = np.abs(system.residual(x)).max()
    if not residual <= levels.APART * (1 + np.abs(system.parameters).max()):
        raise StoreError(f"{branch.about}: point {number}: its columns are not those of its solution")
    return system, x


def _walk(
    branch: StoredBranch, kept: dict[int, Solution], numbers: range, other: int
) -> Iterator[tuple[int, Solution]]:  # fmt: skip
    """Yield the points after the first of ``numbers``, which is kept, with their solutions on its mesh, until none is found.

    The first step is on the secant through the solution at the point ``other``.
    """
    system, x = kept[numbers[0]]
    if len(numbers) == 1:
        return
    there, arclength = kept[other], branch.points["arclength"]
    known = [name for name in system.free if name in branch.points.dtype.names]
    before = arclength[other], there[0].evaluate(there[1], system.nodes)
    here = arclength[numbers[0]], system.states(x)
    for number in numbers[1:]:
        row = branch.points[number]
        values = {name: system.parameter(x, name) for name in system.free} | {name: float(row[name]) for name in known}
        ratio = (row["arclength"] - here[0]) / (here[0] - before[0]) if here[0] != before[0] else 0.0
        guess = system.pack(here[1] + ratio * (here[1] - before[1]), values)
        found = next((one for one in _corrected(system, x, guess, known) if _fits(branch, number, system, one)), None)
        if found is None:
            return
        before, here, x = here, (row["arclength"], system.states(found)), found
        yield number, (system, x)


def _fits(branch: StoredBranch, number: int, system: Collocation, x: np.ndarray) -> bool:
    """Return whether a solution has the columns of a point: beside a fold, another one has the same parameter."""
    names, row = branch.columns.shown(), branch.points[number]
    values = branch.stages[branch.stage_of[number] - 1].values(point_of(system, x), names)
    return all(abs(values[name] - row[name]) <= _SAME * (1 + abs(row[name])) for name in names)


def _corrected(system: Collocation, last: np.ndarray, guess: np.ndarray, known: Sequence[str]) -> Iterator[np.ndarray]:
    """Yield solutions near a guess, by Newton's method with one of the ``known`` free parameters held at that of the guess.

    First it is the one that has changed most since the ``last`` solution, then the others; first in one step, then in four.
    """
    places = np.array([system.parameter_index(name) for name in known])
    order = np.argsort(np.abs(guess[places] - last[places]) / (1 + np.abs(guess[places])))[::-1]
    for steps, held in itertools.product((1, 4), places[order]):
        row, x, past = np.eye(1, system.size, held)[0], last, last - (guess - last) / steps
        with contextlib.suppress(ConvergenceError):
            for step in range(1, steps + 1):
                target = last[held] + (guess[held] - last[held]) * step / steps
                past, x = x, correct(system, 2 * x - past, row, target, Newton(_TOLERANCE)).x
            yield x
