"""Runs of ``branches.run`` as processes that report their progress, and their scenes."""

from __future__ import annotations

import contextlib
import dataclasses
import multiprocessing
import os
import random
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
TABLES = ("points", "events", "solutions/index", "solutions/t", "solutions/states")
#: A run that does not end within so many seconds hangs.
PATIENCE = 120.0


class Fault(Exception):
    """A failure of a trial; the message says what is wrong."""


def claim(fact: object, text: str) -> None:
    """Raise Fault unless ``fact``."""
    if not fact:
        raise Fault(text)


class Run:
    """``python -m branches.run ...`` in a folder: forked from this process, which has the compiled code, or started anew.

    Attributes
    ----------
    progress : shared array of float
        Number of points on disk; time when the last one was written; time when the last one was computed (monotonic clock).
    """

    def __init__(self, folder: Path, *words: str, fresh: bool = False, prepare: Callable[[], None] | None = None):
        self.began = time.monotonic()
        self.progress = multiprocessing.RawArray("d", [0.0, self.began, self.began])
        self._said = [folder.parent / f"{folder.name}.{name}" for name in ("out", "err")]
        argv = [*words, "--quiet"]
        if fresh:
            with open(self._said[0], "w") as out, open(self._said[1], "w") as err:
                self._process = subprocess.Popen(
                    [sys.executable, "-m", "branches.run", *argv], cwd=folder, stdout=out, stderr=err,
                    env={**os.environ, "PYTHONPATH": str(ROOT)}, preexec_fn=_default_signals,
                )  # fmt: skip
            self.pid = self._process.pid
            return
        self._process = None
        self.pid = os.fork()
        if self.pid == 0:
            _child(folder, argv, self._said, self.progress, prepare)

    def send(self, number: int) -> None:
        """Send a signal, if it still runs."""
        with contextlib.suppress(ProcessLookupError):
            os.kill(self.pid, number)

    def wait(self) -> int:
        """Return the exit code, negative for a signal; raise Fault if it hangs, or reports an error in more than one line."""
        until = time.monotonic() + PATIENCE
        while (code := self._poll()) is None:
            if time.monotonic() > until:
                self.send(signal.SIGKILL)
                raise Fault(f"hangs: no end after {PATIENCE:g} s")
            time.sleep(0.002)
        said = self.said()
        lines = [line for line in said.splitlines() if line]
        claim(len(lines) <= 1 and "Traceback" not in said, f"exit code {code} with {said!r}")
        claim(code != 2 or said.startswith("error: "), f"exit code 2 with {said!r}")
        return code

    def _poll(self) -> int | None:
        if self._process is not None:
            return self._process.poll()
        pid, status = os.waitpid(self.pid, os.WNOHANG)
        return None if pid == 0 else os.waitstatus_to_exitcode(status)

    def said(self) -> str:
        """Return its standard error."""
        return self._said[1].read_text(errors="replace")


def _default_signals() -> None:
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.SIG_DFL)


def _child(folder: Path, argv: list[str], said: list[Path], progress, prepare) -> None:
    """Do a forked run; never returns."""
    code = 70
    try:
        os.setpgid(0, 0)
        for path, number in zip(said, (1, 2)):
            os.dup2(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o666), number)
        sys.stdout, sys.stderr = open(1, "w", closefd=False), open(2, "w", closefd=False)  # noqa: SIM115
        os.chdir(folder)
        from branches.run import __main__ as run
        from branches.store import interrupt

        signal.signal(signal.SIGTERM, signal.SIG_DFL)
        signal.signal(signal.SIGINT, signal.default_int_handler)
        interrupt.begin()
        _report(progress)
        if prepare is not None:
            prepare()
        code = interrupt.run(lambda: run.main(argv))
        sys.stdout.flush()
    except BaseException:
        import traceback

        traceback.print_exc()
        sys.stderr.flush()
    finally:
        os._exit(code)


def _report(progress) -> None:
    """Let the writer report its progress, and write as often as possible."""
    from branches.store.writer import BranchWriter

    append, checkpoint = BranchWriter.append, BranchWriter.checkpoint

    def told_append(self, point, stage):
        append(self, point, stage)
        progress[2] = time.monotonic()

    def told_checkpoint(self, *arguments):
        checkpoint(self, *arguments)
        if self.path is not None:
            progress[0], progress[1] = self.count, time.monotonic()

    BranchWriter.append, BranchWriter.checkpoint, BranchWriter.INTERVAL = told_append, told_checkpoint, 0.0


@dataclasses.dataclass
class Scene:
    """A scene under test: its folder, the words of its command, its time without faults, and its result."""

    name: str
    folder: Path
    words: tuple[str, ...]
    seconds: float
    lines: int
    expected: dict

    @property
    def path(self) -> Path:
        """The result."""
        return self.folder / "x.h5"

    def start(self, **options) -> Run:
        """Return a run that resumes."""
        return Run(self.folder, *self.words, *(["--resume"] if self.path.exists() else []), **options)

    def moment(self, chance: random.Random) -> float:
        """Return a random time within the run."""
        return chance.uniform(0, 1.05 * self.seconds)


def columns(path: Path) -> dict[str, bytes]:
    """Return all columns of a result, bit by bit, with plain h5py."""
    import h5py

    with h5py.File(path, "r") as file:
        return {name: file[name][:].tobytes() for name in TABLES}
