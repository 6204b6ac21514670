"""Run independent jobs in processes of this machine or on a Dask cluster; the callers do not know which.

The processes are our own: `concurrent.futures.ProcessPoolExecutor` and loky fail all jobs where one process dies, and cannot
end a job that takes too long. pebble can, but a process that is killed while it sends blocks the others for a minute and more.
"""

from __future__ import annotations

import collections
import concurrent.futures as futures
import contextlib
import functools
import math
import multiprocessing
import multiprocessing.connection
import os
import pickle
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from typing import Any

from branches.scene.fields import ConfigError


class ExecutorError(ConfigError):
    """A scheduler that cannot be used; the message is one sentence."""


Submit = Callable[[Callable[[Any], Any], Any], futures.Future]
Wait = Callable[[Iterable[futures.Future]], set[futures.Future]]


@contextlib.contextmanager
def executor(
    scheduler: str | None = None, workers: int | None = None, time_limit: float | None = None
) -> Iterator[tuple[Submit, Wait, int]]:
    """Yield ``submit(function, job)``, which returns a future, a function that waits for some, and the number of parallel jobs.

    Raises ExecutorError where Dask is not installed, the scheduler does not answer or has no workers, or all of its workers
    have left.

    Parameters
    ----------
    scheduler : str, optional
        Address of a Dask scheduler, as in ``tcp://host:8786``; local processes if None.
    workers : int, optional
        Number of local processes; `cores` by default.
    time_limit : float, optional
        Seconds after which a job in a local process is killed; its future then raises TimeoutError. If a process dies,
        only its own job fails.
    """
    if scheduler is None:
        count = workers or cores()
        with contextlib.closing(_Processes(count, time_limit)) as processes:
            yield processes.submit, processes.wait, count
        return
    try:
        from distributed import Client
    except ImportError as error:
        raise ExecutorError("--scheduler needs Dask: pip install 'ribbon-continuation[cluster]'") from error
    try:
        client = Client(scheduler, timeout=10)
    except (OSError, ValueError) as error:
        raise ExecutorError(f"--scheduler {scheduler!r}: no Dask scheduler answers there") from error.with_traceback(None)
    with client:
        _await_workers(client, scheduler)
        submit = functools.partial(client.get_executor().submit, _alone)
        yield submit, _first_done_by(client, scheduler), max(1, sum(client.nthreads().values()))


#: Seconds to wait for the first worker, and for another one when all have left: a scheduler and its workers are often started
#: together. With ten times more, a scheduler without workers looks like a long job.
_WORKERS_WITHIN = 10.0


def _await_workers(client, scheduler: str) -> None:
    """Wait until the scheduler has a worker; raise ExecutorError if none comes."""
    try:
        client.wait_for_workers(1, timeout=_WORKERS_WITHIN)
    except TimeoutError as error:
        raise ExecutorError(
            f"--scheduler {scheduler!r}: the scheduler answers, but has no workers, and none joined it within "
            f"{_WORKERS_WITHIN:g} s; start some, as in: dask worker {scheduler}"
        ) from error


def _first_done_by(client, scheduler: str) -> Wait:
    """Return a function that waits until some futures are done; it raises ExecutorError if the scheduler loses all workers."""

    def wait(running: Iterable[futures.Future]) -> set[futures.Future]:
        while not (done := futures.wait(running, _WORKERS_WITHIN, futures.FIRST_COMPLETED).done):
            _await_workers(client, scheduler)
        return done

    return wait


def first_done(running: Iterable[futures.Future]) -> set[futures.Future]:
    """Wait until some futures are done."""
    return futures.wait(running, return_when=futures.FIRST_COMPLETED).done


class _Worker:
    """A process that does one job after the other, with its own pipe, so that its failure affects no other process."""

    def __init__(self, context):
        self.pipe, its_end = context.Pipe()
        self.process = context.Process(target=_work, args=(its_end,), daemon=True)
        self.process.start()
        its_end.close()
        self.future: futures.Future | None = None
        self.deadline = math.inf

    def begin(self, future: futures.Future, task: tuple, time_limit: float | None) -> None:
        """Send it a job."""
        self.future = future
        self.deadline = time.monotonic() + time_limit if time_limit else math.inf
        with contextlib.suppress(OSError):  # it died; `finish` reports that
            self.pipe.send(task)

    def finish(self) -> futures.Future:
        """Read its answer, or find that it died; return the finished future."""
        future, self.future, self.deadline = self.future, None, math.inf
        try:
            good, result = pickle.loads(self.pipe.recv_bytes())
        except (EOFError, OSError):
            self.process.join()
            good, result = False, WorkerDied(f"its process died (exit code {self.process.exitcode})")
        (future.set_result if good else future.set_exception)(result)
        return future

    def kill(self) -> None:
        """End it at once."""
        self.process.kill()
        self.process.join()
        self.pipe.close()


class WorkerDied(Exception):
    """A process that ended before its job."""


class _Processes:
    """Local processes, managed by the thread that uses them, without shared locks: a killed process leaves no lock behind."""

    def __init__(self, count: int, time_limit: float | None):
        self._context = multiprocessing.get_context(_START_METHOD)
        self._count, self._time_limit = count, time_limit
        self._workers: list[_Worker] = []
        self._queue: collections.deque[tuple[futures.Future, tuple]] = collections.deque()

    def submit(self, function: Callable[[Any], Any], job: object) -> futures.Future:
        """Queue ``function(job)`` for the next free process."""
        future: futures.Future = futures.Future()
        self._queue.append((future, (function, job)))
        self._dispatch()
        return future

    def _dispatch(self) -> None:
        while self._queue:
            self._workers = [worker for worker in self._workers if worker.future is not None or worker.process.is_alive()]
            worker = next((worker for worker in self._workers if worker.future is None), None)
            if worker is None:
                if len(self._workers) == self._count:
                    return
                worker = _Worker(self._context)
                self._workers.append(worker)
            worker.begin(*self._queue.popleft(), self._time_limit)

    def wait(self, running: Iterable[futures.Future]) -> set[futures.Future]:
        """Wait until some are done."""
        while not (done := {future for future in running if future.done()}):
            busy = {worker.pipe: worker for worker in self._workers if worker.future is not None}
            left = min(worker.deadline for worker in busy.values()) - time.monotonic()
            for pipe in multiprocessing.connection.wait(list(busy), None if left == math.inf else max(left, 0)):
                worker = busy[pipe]
                worker.finish()
                if not worker.process.is_alive():
                    self._workers.remove(worker)
            for worker in [worker for worker in self._workers if time.monotonic() > worker.deadline]:
                self._workers.remove(worker)
                worker.kill()
                worker.future.set_exception(TimeoutError())
            self._dispatch()
        return done

    def close(self) -> None:
        """End all processes."""
        for worker in self._workers:
            worker.kill()


def _work(pipe) -> None:
    """Do jobs in a worker process until its end."""
    _begin_worker()
    while True:
        function, job = pipe.recv()
        try:
            answer = pickle.dumps((True, _alone(function, job)))
        except Exception as error:
            answer = pickle.dumps((False, _sendable(error)))
        pipe.send_bytes(answer)


def _sendable(error: Exception) -> Exception:
    """Return the error, or a RuntimeError with its message if it cannot be pickled."""
    try:
        pickle.loads(pickle.dumps(error))
    except Exception:  # the methods of the error can raise anything
        return RuntimeError(f"{type(error).__name__}: {error}")
    return error


#: How processes start: forks have the compiled kernels; outside Linux they are not safe or not available.
_START_METHOD = "fork" if sys.platform.startswith("linux") else "spawn"
#: Environment variables with the number of cores that a cluster's scheduler (Slurm, PBS, Grid Engine, LSF) grants.
_GRANTED = ("SLURM_CPUS_PER_TASK", "PBS_NUM_PPN", "NSLOTS", "LSB_DJOB_NUMPROC")


def cores() -> int:
    """Return the number of cores that this process may use: those it is bound to, at most as many as a scheduler grants."""
    bound = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    granted = [os.environ.get(name, "") for name in _GRANTED]
    return min([bound, *(int(text) for text in granted if text.isdecimal() and int(text) > 0)])


def _alone(function: Callable[[Any], Any], job: object) -> Any:
    """Return ``function(job)``, computed by one thread: other cores have jobs of their own."""
    os.environ["CONTIN_THREADS"] = "1"
    return function(job)


def _begin_worker():
    """Leave Ctrl-C to the parent, and end when the parent ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)

    def follow_the_parent():
        multiprocessing.parent_process().join()
        os._exit(1)

    threading.Thread(target=follow_the_parent, daemon=True).start()


def trouble(error: BaseException) -> str:
    """Return the reason why a job gave no result."""
    if isinstance(error, TimeoutError):
        return "not finished within the time limit"
    return str(error) if isinstance(error, WorkerDied) else f"{type(error).__name__}: {error}"


#: A source of jobs returns this if its next job depends on running jobs.
WAIT = object()


def run_jobs(
    source: Callable, function: Callable, submit: Submit, limit: int, wait: Wait = first_done
) -> Iterator[tuple[object, object]]:
    """Run ``function(job)`` for every job, ``limit`` at a time; yield (job, result or exception) as they finish.

    ``source(running)`` gets the list of running jobs and returns the next job, `WAIT`, or None at the end. The function is at
    module level, so that it can be sent to another process.
    """
    running: dict[futures.Future, object] = {}
    exhausted = False
    while True:
        while not exhausted and len(running) <= limit:  # one job more than processes, so that no process waits
            job = source(list(running.values()))
            if job is WAIT:
                break
            if job is None:
                exhausted = True
            else:
                running[submit(function, job)] = job
        if not running:
            return
        for future in wait(running):
            job = running.pop(future)
            yield job, future.exception() or future.result()
