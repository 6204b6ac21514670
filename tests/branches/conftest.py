"""The command line as a user runs it, in a folder of its own: as a process, or called where a process makes no difference."""

import os
import signal
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import h5py
import pytest

sys.path.insert(0, str(Path(__file__).parent))  # makes the browser of tests (tests/branches/browser.py) importable

ROOT = Path(__file__).resolve().parents[2]
TABLES = ("points", "events", "solutions/index", "solutions/t", "solutions/states")


if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:  # tests started in the background of a shell are told to ignore Ctrl-C
    signal.signal(signal.SIGINT, signal.default_int_handler)


class Silent:
    """A display that shows nothing; ``at`` maps the number of a point to what is to happen when it is shown."""

    def __init__(self, at=None):
        self.at, self.notes = at or {}, []

    def note(self, text):
        self.notes.append(text)

    def begin(self, *arguments):
        pass

    def stage(self, stage):
        pass

    def point(self, stage, point, number, step):
        if number in self.at:
            self.at[number]()

    def summary(self, *arguments):
        pass


class Command:
    """``python -m branches.run`` in a folder; with ``program`` given, something else in its place."""

    def __init__(self, folder):
        self.folder = folder

    def start(self, *arguments, program=("-m", "branches.run"), env=(), **more):
        environment = {**os.environ, "PYTHONPATH": str(ROOT), "PYTHONIOENCODING": "utf-8", **dict(env)}
        options = {"cwd": self.folder, "stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "encoding": "utf-8", **more}
        if os.name == "posix":
            options["preexec_fn"] = _default_signals
        words = [sys.executable, *program, *map(str, arguments)]
        return subprocess.Popen(words, env=environment, **options)

    def __call__(self, *arguments, **more):
        process = self.start(*arguments, **more)
        process.out, process.err = process.communicate(timeout=300)
        return process

    def on_terminal(self, *arguments, streams=("stderr",), **more) -> bytes:
        """What a command writes to these streams on a pseudo-terminal; it ends with exit code 0."""
        pty = pytest.importorskip("pty")
        ours, theirs = pty.openpty()
        process = self.start(*arguments, **dict.fromkeys(streams, theirs), **more)
        os.close(theirs)
        shown = b""
        while True:
            try:
                part = os.read(ours, 65536)
            except OSError:  # how Linux says that the other end is closed
                break
            if not part:
                break
            shown += part
        os.close(ours)
        if process.stdout is not None:
            process.stdout.close()
        assert process.wait() == 0
        return shown


def _default_signals():
    # a shell that starts pytest in the background has it ignore Ctrl-C, and so would everything below it
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)


def tables_of(path) -> dict[str, bytes]:
    """All columns of a result, bit by bit."""
    with h5py.File(path) as file:
        return {name: file[name][:].tobytes() for name in TABLES}


@pytest.fixture
def command(tmp_path):
    return Command(tmp_path)


@pytest.fixture
def call(tmp_path, monkeypatch, capsys):
    """A function that calls the ``main`` of a program with arguments, in ``tmp_path``: its exit code, and what it printed."""

    def call(main, *arguments):
        monkeypatch.chdir(tmp_path)
        capsys.readouterr()
        try:
            code = main([*map(str, arguments)])
        except SystemExit as stop:
            code = stop.code
        printed = capsys.readouterr()
        return SimpleNamespace(returncode=code, out=printed.out, err=printed.err)

    return call


@pytest.fixture(scope="session")
def silent():
    return Silent


@pytest.fixture(scope="session")
def tables():
    return tables_of


@pytest.fixture(scope="session")
def root():
    return ROOT
