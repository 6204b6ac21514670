"""Threads: independent calls of compiled functions, which run without Python's lock, on several cores."""

from __future__ import annotations

import collections
import functools
import os
import threading
from collections.abc import Callable, Sequence
from typing import Any, TypeVar

from contin.errors import ProblemError

_Job = TypeVar("_Job")
_Result = TypeVar("_Result")

#: More threads than any machine has cores for: a bound for what users give.
MOST = 1024
#: Parts of one job that threads share: more than cores usually, so that a core that is busy with something else gets fewer. Two
#: threads take as long with 4 to 32 parts; with ten times more 1.16 times as long.
PARTS = 16


def count() -> int:
    """Return the number of threads: ``CONTIN_THREADS``, by default the number of cores that this process may use.

    Raises ProblemError where ``CONTIN_THREADS`` is no number of threads.
    """
    given = os.environ.get("CONTIN_THREADS", "")
    if not given:
        return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    if not given.isdecimal() or not 1 <= int(given) <= MOST:
        raise ProblemError(f"CONTIN_THREADS: {given!r} must be a whole number from 1 to {MOST}")
    return int(given)


def each(function: Callable[[_Job], _Result], jobs: Sequence[_Job]) -> list[_Result]:
    """Return the results of a function for all jobs, in their order, from this thread and others.

    If calls raise exceptions, that of the first of these jobs is raised, as in a loop.
    """
    threads = min(count(), len(jobs))
    if threads < 2:
        return [function(job) for job in jobs]
    found: list[Any] = [None] * len(jobs)
    failed: dict[int, Exception] = {}
    left = iter(range(len(jobs)))  # each thread takes the next number

    def work() -> None:
        for i in left:
            try:
                found[i] = function(jobs[i])
            except Exception as error:
                failed[i] = error  # all jobs before it were taken
                collections.deque(left, maxlen=0)  # no more are

    with _LOCK:
        others = [_pool(count() - 1).submit(work) for _ in range(threads - 1)]
    try:
        work()
        for other in others:
            if not other.cancel():  # all jobs are taken: a thread that has not begun has nothing to do
                other.result()
    finally:
        collections.deque(left, maxlen=0)
    if failed:
        raise failed[min(failed)]
    return found


#: Pools of threads by their size. They live until the process ends or forks.
_POOLS: dict[int, Any] = {}
#: Held while pools are made, used or ended.
_LOCK = threading.RLock()


def _pool(size: int) -> Any:
    """Return a pool of this size; its threads start when there is work for them."""
    if size not in _POOLS:
        from concurrent.futures import ThreadPoolExecutor  # only large problems need it

        _end_before_forks()
        _POOLS[size] = ThreadPoolExecutor(size, thread_name_prefix="contin")
    return _POOLS[size]


@functools.cache
def _end_before_forks() -> None:
    """Let pools end before this process forks: a child has none of its parent's threads, but all of their locks."""

    def end() -> None:
        _LOCK.acquire()
        while _POOLS:
            _POOLS.popitem()[1].shutdown()

    if hasattr(os, "register_at_fork"):  # after concurrent.futures was loaded: its own locks are then taken later
        os.register_at_fork(before=end, after_in_parent=_LOCK.release, after_in_child=_LOCK.release)
