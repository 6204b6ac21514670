"""Handling of Ctrl-C and SIGTERM by all commands: one line that says what is kept, exit code 130, no half-written file.

A command calls `begin` before its heavy imports, so that Ctrl-C is answered from its first moments, and ends in
``sys.exit(interrupt.run(main))``. During the computation Ctrl-C ends the process at once: an exception inside a
compilation or an import would print a traceback. `held` and `unwinding` change this for two kinds of code.
"""

# Nothing heavy is imported here: this module is imported before all others.

from __future__ import annotations

import contextlib
import gc
import os
import signal
import sys
from collections.abc import Callable, Iterator

EXIT_INTERRUPTED = 130
#: What is kept by commands that compute branch after branch.
BRANCHES_KEPT = "finished branches are kept, and the same command computes what is missing"
#: What is kept by commands that only print.
NO_FILES = "this command writes no files"
#: New objects at which garbage is collected. Python's 700 make 130 collections of what is imported: with the one at the end, a
#: fifth of the time of a short run. Ten times more gain nothing, and keep arrays of discarded systems.
_OBJECTS = 20_000


class _State:
    """The current reaction to Ctrl-C."""

    process = 0  # the one that called `begin`; a forked worker inherits the handler at its start
    line = "interrupted"
    held = 0
    unwinding = 0
    asked = raised = False
    last: list[Callable[[], object]] = []  # what is called before the process ends


def begin(kept: str = "") -> None:
    """Handle Ctrl-C and SIGTERM from now on, unless they are ignored; ``kept`` says what an interrupted command keeps."""
    _State.process, _State.raised = os.getpid(), False
    change(kept)
    for number, usual in ((signal.SIGINT, signal.default_int_handler), (signal.SIGTERM, signal.SIG_DFL)):
        if signal.getsignal(number) is usual:
            signal.signal(number, leave)


def at_last(function: Callable[[], object]) -> None:
    """Call a function before Ctrl-C ends the process."""
    _State.last.append(function)


def change(kept: str) -> None:
    """Change the line of an interrupted command."""
    _State.line = f"interrupted; {kept}" if kept else "interrupted"


def run(main: Callable[[], int]) -> int:
    """Call the ``main`` of a command; return its exit code, or that of an interrupted command.

    Compiled code of other libraries may make another error of Ctrl-C: what comes after it is the interruption.
    """
    gc.set_threshold(_OBJECTS)
    os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")  # it reads all installed packages to find any
    try:
        return main()
    except (Exception, KeyboardInterrupt) as error:
        if not (_State.raised or isinstance(error, KeyboardInterrupt)):
            raise
    finally:
        gc.freeze()  # the process ends, and its memory with it
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # no second line
    _say()
    if os.getpid() == _State.process:  # after exec() Python would end by the signal, not with the code
        os._exit(EXIT_INTERRUPTED)
    return EXIT_INTERRUPTED


@contextlib.contextmanager
def held() -> Iterator[None]:
    """Delay Ctrl-C until a file, or several that belong together, are complete."""
    _State.held += 1
    try:
        yield
    finally:
        _State.held -= 1
        if _State.asked and not _State.held:
            _State.asked = False
            _act()


@contextlib.contextmanager
def unwinding() -> Iterator[None]:
    """Let Ctrl-C raise KeyboardInterrupt, for code that must end other programs; a second Ctrl-C is ignored."""
    _State.unwinding += 1
    try:
        yield
    finally:
        _State.unwinding -= 1


def leave(number, frame) -> None:
    """Handle Ctrl-C or SIGTERM."""
    if os.getpid() != _State.process:
        os._exit(EXIT_INTERRUPTED)
    if _State.held:
        _State.asked = True
    else:
        _act()


def _act() -> None:
    if _State.unwinding:
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        _State.raised = True
        raise KeyboardInterrupt
    for function in _State.last:
        function()
    _say()
    os._exit(EXIT_INTERRUPTED)


def _say() -> None:
    moving = "\n" if sys.stderr is not None and sys.stderr.isatty() else ""  # leave the line of progress
    with contextlib.suppress(OSError):  # a closed terminal
        os.write(2, f"{moving}{_State.line}\n".encode())
