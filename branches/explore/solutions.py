"""The solution of every point of a branch file: read where the file keeps it, otherwise computed from the one before."""

from __future__ import annotations

import contextlib
import itertools
from collections.abc import Iterator

import numpy as np

from branches.store.branch import StoredBranch
from branches.store.files import StoreError
from contin import ConvergenceError, Newton
from contin.lowlevel import Collocation, correct
from ribbon_model.solution import Solution

#: Largest residual of a kept solution with the columns of its point, relative to 1 + the largest parameter. The largest of 311
#: solutions had 4e-13. With ten times more, columns that are wrong in the sixth digit would pass.
_RESIDUAL = 1e-6
#: Newton's tolerance, and the largest difference of parameters from the columns, relative to 1 + their size: shapes need four
#: digits, and the mesh is that of a kept solution from before, which may be too coarse here for more.
_TOLERANCE, _SAME = 1e-8, 1e-4


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
    for number, solution in _walk(branch, kept, range(numbers[-1], len(found)), numbers[-2:][0]):  # an interrupted run
        found[number] = solution
    return found


def _kept(branch: StoredBranch, number: int) -> Solution:
    """Return a solution that the file keeps; raise StoreError unless it solves the equations with the columns of its point."""
    found = branch.solution(number)
    system, x = found.discretized()
    residual = np.abs(system.residual(x)).max()
    if not residual <= _RESIDUAL * (1 + np.abs(system.parameters).max()):
        m, n = branch.config["m"], branch.config["n"]
        raise StoreError(f"branch ({m}, {n}), point {number}: its columns are not those of a closed strip")
    return found


def _walk(branch: StoredBranch, kept: dict[int, Solution], numbers: range, other: int) -> Iterator[tuple[int, Solution]]:
    """Yield the points after the first of ``numbers``, which is kept, with their solutions on its mesh, until none is found.

    The first step is on the secant through the solution at the point ``other``.
    """
    start, arclength = kept[numbers[0]], branch.points["arclength"]
    system, parameters = start.discretized()[0], start.parameters
    before, here = (arclength[other], kept[other].on_nodes(start.t)), (arclength[numbers[0]], start.states)
    for number in numbers[1:]:
        row = branch.points[number]
        values = {name: float(row[name]) if name in row.dtype.names else value for name, value in parameters.items()}
        ratio = (row["arclength"] - here[0]) / (here[0] - before[0]) if here[0] != before[0] else 0.0
        guess = system.pack(here[1] + ratio * (here[1] - before[1]), values)
        x = _corrected(system, system.pack(here[1], parameters), guess)
        if x is None:
            return
        before, here, parameters = here, (row["arclength"], system.states(x)), values
        yield number, Solution(start.law, start.domain, start.t, here[1], start.degree, values)


def _corrected(system: Collocation, last: np.ndarray, guess: np.ndarray) -> np.ndarray | None:
    """Return the solution near a guess that has the free parameters of the guess; None if Newton's method does not find it.

    One free parameter is held, the others are solved for and compared: first the one that has changed most since the ``last``
    solution, then the others; first in one step, then in four.
    """
    free = slice(system.state_size, None)
    wanted = guess[free]
    order = np.argsort(np.abs(wanted - last[free]) / (1 + np.abs(wanted)))[::-1]
    for steps, held in itertools.product((1, 4), system.state_size + order):
        row, x, past = np.eye(1, system.size, held)[0], last, last - (guess - last) / steps
        with contextlib.suppress(ConvergenceError):
            for step in range(1, steps + 1):
                target = last[held] + (guess[held] - last[held]) * step / steps
                past, x = x, correct(system, 2 * x - past, row, target, Newton(_TOLERANCE)).x
            if np.all(np.abs(x[free] - wanted) <= _SAME * (1 + np.abs(wanted))):
                return x
    return None
