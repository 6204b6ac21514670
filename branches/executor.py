"""Where independent jobs run: processes of this machine, or a Dask cluster. Nothing else in the project knows which."""

from __future__ import annotations

import concurrent.futures as futures
import contextlib
import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Iterator


class ExecutorError(Exception):
    """A scheduler that cannot be used; the message is one sentence."""


@contextlib.contextmanager
def executor(scheduler: str | None = None, workers: int | None = None) -> Iterator[tuple[futures.Executor, int]]:
    """A ``concurrent.futures`` executor and the number of jobs it can run at a time.

    Parameters
    ----------
    scheduler : str, optional
        Address of a Dask scheduler, as in ``tcp://host:8786``; local processes without.
    workers : int, optional
        Local processes; as many as this process may use cores by default.

    Raises
    ------
    ExecutorError
        Dask is not installed, or the scheduler does not answer.
    """
    if scheduler is None:
        cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
        count = workers or cores or 1
        # a forked process has the compiled kernels already; where there is no fork each one loads them
        methods = multiprocessing.get_all_start_methods()
        context = multiprocessing.get_context("fork" if "fork" in methods else None)
        with futures.ProcessPoolExecutor(count, mp_context=context, initializer=_begin_worker) as pool:
            yield pool, count
        return
    try:
        from distributed import Client
    except ImportError as error:
        raise ExecutorError("--scheduler needs Dask: pip install 'ribbon-continuation[cluster]'") from error
    try:
        client = Client(scheduler, timeout=10)
    except (OSError, ValueError) as error:
        raise ExecutorError(f"--scheduler {scheduler!r}: no Dask scheduler answers there") from error
    with client:
        yield client.get_executor(), max(1, sum(client.nthreads().values()))


def _begin_worker():
    """Leave Ctrl-C to the parent, and never outlive it, however it ended."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)

    def follow_the_parent():
        multiprocessing.parent_process().join()
        os._exit(1)

    threading.Thread(target=follow_the_parent, daemon=True).start()


#: What a source of jobs returns when the next one depends on jobs that are still running.
WAIT = object()


def run_jobs(source: Callable, function: Callable, pool: futures.Executor, limit: int) -> Iterator[tuple[object, object]]:
    """Run ``function(job)`` for every job, at most ``limit`` at a time; yield (job, result or exception) as they finish.

    Parameters
    ----------
    source : callable
        ``source(running)`` returns the next job, None when there are no more, or :data:`WAIT`, given the list of jobs that run.
    function : callable
        At module level, so that it can be sent to another process.
    """
    running: dict[futures.Future, object] = {}
    exhausted = False
    while True:
        while not exhausted and len(running) < limit:
            job = source(list(running.values()))
            if job is WAIT:
                break
            if job is None:
                exhausted = True
            else:
                running[pool.submit(function, job)] = job
        if not running:
            return
        done, _ = futures.wait(running, return_when=futures.FIRST_COMPLETED)
        for future in done:
            job = running.pop(future)
            yield job, future.exception() or future.result()
