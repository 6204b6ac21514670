"""Ctrl-C, answered in one way by all commands: one line that says what is kept, exit code 130, no half-written file.

A command calls `begin` before its heavy imports, so that Ctrl-C is answered from its first moments, and ends in
``sys.exit(interrupt.run(main))``. While it computes, Ctrl-C ends the process at once: an exception amid a compilation or an
import would end in noise. Two pieces of code need something else, `held` and `unwinding`.
"""

# Nothing heavy is imported here: this module is imported before all others.

from __future__ import annotations

import contextlib
import os
import signal
import sys
from collections.abc import Callable, Iterator

EXIT_INTERRUPTED = 130
#: What is kept by commands that compute branch after branch.
BRANCHES_KEPT = "finished branches are kept, and the same command computes what is missing"
#: What is kept by commands that only print.
NO_FILES = "this command writes no files"


class _State:
    """What Ctrl-C does now."""

    process = 0  # that called `begin`; a forked worker inherits the handler for its first moments
    line = "interrupted"
    held = 0
    unwinding = 0
    asked = False


def begin(kept: str = "") -> None:
    """Answer Ctrl-C from now on; ``kept`` says what an interrupted command keeps. A shell's choice to ignore Ctrl-C stays."""
    _State.process = os.getpid()
    change(kept)
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, leave)


def change(kept: str) -> None:
    """Say something else from now on."""
    _State.line = f"interrupted; {kept}" if kept else "interrupted"


def run(main: Callable[[], int]) -> int:
    """Call the ``main`` of a command; its exit code, or that of an interrupted command."""
    try:
        return main()
    except KeyboardInterrupt:
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # no second line
        _say()
        if os.getpid() == _State.process:  # where it passed through exec(), Python would end by the signal, not by the code
            os._exit(EXIT_INTERRUPTED)
        return EXIT_INTERRUPTED


@contextlib.contextmanager
def held() -> Iterator[None]:
    """Put Ctrl-C off until a file, or several that belong together, are whole."""
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
    """Have Ctrl-C raise KeyboardInterrupt, for code that must end other programs; a second Ctrl-C is ignored."""
    _State.unwinding += 1
    try:
        yield
    finally:
        _State.unwinding -= 1


def leave(number, frame) -> None:
    """Handle Ctrl-C."""
    if os.getpid() != _State.process:
        os._exit(EXIT_INTERRUPTED)
    if _State.held:
        _State.asked = True
    else:
        _act()


def _act() -> None:
    if _State.unwinding:
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        raise KeyboardInterrupt
    files = sys.modules.get("branches.files")
    if files is not None and hasattr(files, "unlock_all"):  # it may be half imported
        files.unlock_all()
    _say()
    os._exit(EXIT_INTERRUPTED)


def _say() -> None:
    moving = "\n" if sys.stderr is not None and sys.stderr.isatty() else ""  # a line of progress may be there
    with contextlib.suppress(OSError):  # a closed terminal
        os.write(2, f"{moving}{_State.line}\n".encode())
