"""Many small problems: one function of a problem at many sets of parameter values, in this process or in several."""

from __future__ import annotations

import functools
import multiprocessing
import os
import pickle
import sys
import traceback
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from contin import errors as checks
from contin.boundary.statement import BoundaryValueProblem
from contin.equilibria.statement import AlgebraicProblem
from contin.errors import ContinError, ProblemError
from contin.problems.statement import is_importable
from contin.text import Shown
from contin.threads import MOST

#: Sets of values that a process takes at a time: handing over takes .03 ms a set, .1 ms one at a time. With ten times more,
#: some processes wait for others at the end.
_TOGETHER = 4
#: Files of the package begin with this.
_PACKAGE = str(Path(__file__).parents[1])
#: Problems that a process of a cluster keeps, with the recordings of their functions.
_KEPT = 8


@dataclass(frozen=True, repr=False)
class Row(Shown):
    """What a function made of a problem at one set of values: the ``result``, or a ``failure``, a sentence ("" without one)."""

    values: Mapping[str, float]
    result: Any = None
    failure: str = ""


@checks.arguments
def batch(
    function: Callable[..., Any], problem: BoundaryValueProblem | AlgebraicProblem, values: Sequence[Mapping[str, float]], *,
    workers: Any = 1,
) -> list[Row]:  # fmt: skip
    """Return what a function makes of a problem at many sets of parameter values, a row each, in their order.

    A call that raises an exception is a row with a ``failure``; the others go on. Each process records the functions of the
    problem once.

    Parameters
    ----------
    function : callable
        ``function(problem, values)`` returns anything that can be pickled, such as a branch, a point or a number.
    problem : BoundaryValueProblem or AlgebraicProblem
    values : sequence of mappings
        Parameter values by name; those that are left out have the problem's defaults.
    workers : int, or executor
        Number of processes of this machine; 1 computes here. Or anything with ``submit(function, job)`` that returns futures (a
        client of Dask, an executor of `concurrent.futures`), or with ``map(function, jobs)`` (a pool of `multiprocessing`). On
        Linux processes are forks, and take any function; a pool of processes takes one that can be imported. Where a process
        dies, the rows that it leaves are failures; a pool of `multiprocessing` does not come back.

    Returns
    -------
    list of Row
        With ``values``, ``result`` and ``failure``, in the order of ``values``.

    Raises
    ------
    ProblemError
        Values that are no numbers; a function that cannot be sent. What `solve` says of a value is a failure of its row.

    Examples
    --------
    >>> from contin import AlgebraicProblem, solve
    >>> root = AlgebraicProblem(lambda u, p: (u.x**2 - p.a,), ["x"], {"a": 1.0})
    >>> rows = batch(lambda problem, values: solve(problem, [1.0], values)["x"], root, [{"a": 4.0}, {"a": -1.0}, {"a": 9.0}])
    >>> [row.result and round(row.result, 9) for row in rows], rows[1].failure[:23]
    ([2.0, None, 3.0], 'Newton did not converge')
    """
    jobs = [[dict(each) for each in values[first : first + _TOGETHER]] for first in range(0, len(values), _TOGETHER)]
    if hasattr(workers, "submit"):
        job = functools.partial(_sent, function, pickle.dumps(problem))
        return list(_gathered([(workers.submit(job, each), each) for each in jobs]))
    if hasattr(workers, "map"):
        return [row for rows in workers.map(functools.partial(_sent, function, pickle.dumps(problem)), jobs) for row in rows]
    if not hasattr(workers, "__index__"):
        raise ProblemError(f"workers: {workers!r} must be a whole number, or have submit or map, as executors and pools have")
    checks.whole("workers", workers, 1, MOST)
    first = _rows(function, problem, jobs[0]) if jobs else []  # processes are forked with what this one has recorded
    if workers == 1 or len(jobs) < 3:
        return [*first, *(row for each in jobs[1:] for row in _rows(function, problem, each))]
    return [*first, *_in_processes(function, problem, jobs[1:], workers)]


def _rows(function: Callable[..., Any], problem: object, job: Sequence[Mapping[str, float]]) -> list[Row]:
    rows = []
    for values in job:
        try:
            rows.append(Row(values, function(problem, values)))
        except Exception as error:  # a user's function may raise anything
            rows.append(Row(values, failure=_said(error)))
    return rows


def _said(error: BaseException) -> str:
    """Return what an exception says; of one that is not of contin its kind, too, and the line of the user's function."""
    if isinstance(error, ContinError):
        return str(error)
    own = [frame for frame in traceback.extract_tb(error.__traceback__) if not frame.filename.startswith(_PACKAGE)]
    place = f" (in {own[0].name}, line {own[0].lineno} of {Path(own[0].filename).name})" if own else ""
    return f"{type(error).__name__}: {error}{place}"


# --- processes --------------------------------------------------------------------------------------------------------


def _in_processes(function: Callable[..., Any], problem: object, jobs: Sequence[Any], workers: int) -> list[Row]:
    """Return the rows of jobs, computed by processes of this machine."""
    from concurrent.futures import ProcessPoolExecutor  # 20 ms; only this needs it

    forks = sys.platform.startswith("linux")  # they have all that is compiled and recorded; elsewhere they are not safe
    if not (forks or is_importable(function)):
        raise ProblemError("function: must be one that other processes can import, or workers 1")
    context = multiprocessing.get_context("fork" if forks else "spawn")
    with ProcessPoolExecutor(min(workers, len(jobs)), context, _begin, (function, problem)) as pool:
        return list(_gathered([(pool.submit(_here, job), job) for job in jobs]))


#: The function and the problem of this process, where it works for another one.
_WORK: list[Any] = []


def _begin(function: Callable[..., Any], problem: object) -> None:
    """Take the function and the problem; one thread computes, since other cores have jobs of their own."""
    os.environ["CONTIN_THREADS"] = "1"
    _WORK[:] = function, problem


def _here(job: Sequence[Mapping[str, float]]) -> list[Row]:
    return _sendable(_rows(_WORK[0], _WORK[1], job))


def _sent(function: Callable[..., Any], problem: bytes, job: Sequence[Mapping[str, float]]) -> list[Row]:
    """Return the rows of a job with a problem that was sent."""
    os.environ["CONTIN_THREADS"] = "1"
    return _sendable(_rows(function, _unpacked(problem), job))


@functools.lru_cache(_KEPT)
def _unpacked(problem: bytes) -> Any:
    """Return a problem, the same one for all jobs, so that its functions are recorded once."""
    return pickle.loads(problem)


def _sendable(rows: Sequence[Row]) -> list[Row]:
    """Return rows with failures in the place of results that cannot be pickled."""
    found = []
    for row in rows:
        try:
            pickle.dumps(row.result)
            found.append(row)
        except Exception as error:  # whatever pickling it raises
            found.append(Row(row.values, failure=f"the result cannot be sent to this process: {_said(error)}"))
    return found


def _gathered(futures: Sequence[tuple[Any, Sequence[Mapping[str, float]]]]) -> Iterator[Row]:
    """Yield the rows of all jobs; those of a job whose process died are failures."""
    for future, job in futures:
        try:
            yield from future.result()
        except Exception as error:  # that of a process that died
            yield from (Row(values, failure=f"the process that computed it failed: {_said(error)}") for values in job)
