"""Where independent jobs run: processes of this machine, or a Dask cluster. Nothing else in the project knows which."""

from __future__ import annotations

import concurrent.futures as futures
import contextlib
import multiprocessing
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator


class ExecutorError(Exception):
    """A scheduler that cannot be used; the message is one sentence."""


@contextlib.contextmanager
def executor(
    scheduler: str | None = None, workers: int | None = None, time_limit: float | None = None
) -> Iterator[tuple[Callable[..., futures.Future], int]]:
    """A function ``submit(function, job)`` that returns a future, and the number of jobs that run at a time.

    Parameters
    ----------
    scheduler : str, optional
        Address of a Dask scheduler, as in ``tcp://host:8786``; local processes without.
    workers : int, optional
        Local processes; `cores` by default.
    time_limit : float, optional
        Seconds after which a job in a local process is killed; its future then raises TimeoutError. A process that dies takes
        its own job with it and no other.

    Raises
    ------
    ExecutorError
        Dask is not installed, or the scheduler does not answer.
    """
    if scheduler is None:
        from pebble import CONSTS, ProcessPool

        CONSTS.sleep_unit = 0.02  # seconds between its looks at its processes, the last of which the end of a run waits for
        count = workers or cores()
        context = multiprocessing.get_context(_start_method())
        with ProcessPool(count, initializer=_begin_worker, context=context) as pool:
            yield lambda function, job: pool.schedule(function, [job], timeout=time_limit), count
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
        yield client.get_executor().submit, max(1, sum(client.nthreads().values()))


#: What the schedulers of clusters (Slurm, PBS, Grid Engine, LSF) call the cores that a job was given.
_GRANTED = ("SLURM_CPUS_PER_TASK", "PBS_NUM_PPN", "NSLOTS", "LSB_DJOB_NUMPROC")


def cores() -> int:
    """How many cores this process may use: those it is bound to, but no more than a cluster's scheduler granted."""
    bound = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    granted = [os.environ.get(name, "") for name in _GRANTED]
    return min([bound, *(int(text) for text in granted if text.isdecimal() and int(text) > 0)])


def _start_method() -> str:
    """A forked process has the compiled kernels already; elsewhere than on Linux forks are not safe or not there."""
    return "fork" if sys.platform.startswith("linux") else "spawn"


def _begin_worker():
    """Leave Ctrl-C to the parent, and never outlive it, however it ended."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)

    def follow_the_parent():
        multiprocessing.parent_process().join()
        os._exit(1)

    threading.Thread(target=follow_the_parent, daemon=True).start()


def trouble(error: BaseException) -> str:
    """Why a job gave no result, in words."""
    if isinstance(error, TimeoutError):
        return "not finished within the time limit"
    if hasattr(error, "exitcode"):  # pebble's ProcessExpired
        return f"its process died (exit code {error.exitcode})"
    return f"{type(error).__name__}: {error}"


#: What a source of jobs returns when the next one depends on jobs that are still running.
WAIT = object()


def run_jobs(source: Callable, function: Callable, submit: Callable, limit: int) -> Iterator[tuple[object, object]]:
    """Run ``function(job)`` for every job, ``limit`` at a time; yield (job, result or exception) as they finish.

    Parameters
    ----------
    source : callable
        ``source(running)``, given the list of jobs handed out, returns the next one; None at the end; or :data:`WAIT`.
    function : callable
        At module level, so that it can be sent to another process.
    """
    running: dict[futures.Future, object] = {}
    exhausted = False
    while True:
        while not exhausted and len(running) <= limit:  # one waits, so that no process does
            job = source(list(running.values()))
            if job is WAIT:
                break
            if job is None:
                exhausted = True
            else:
                running[submit(function, job)] = job
        if not running:
            return
        done, _ = futures.wait(running, return_when=futures.FIRST_COMPLETED)
        for future in done:
            job = running.pop(future)
            yield job, future.exception() or future.result()
