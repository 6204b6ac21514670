"""What all commands share: the command line, one sentence for a mistake in it, and standard output."""

from __future__ import annotations

import argparse
import contextlib
import functools
import os
import re
import sys
from collections.abc import Callable

# Nothing heavy is imported here: `--help` and invalid command lines are answered at once.


#: What is typed before the name of a command; the program ``ribbon`` sets another.
prefix = "python -m branches."


class StoreError(Exception):
    """A file that cannot be written or read; the message is one sentence."""


def typed(command: str) -> str:
    """Return how a command is typed: as the present one, ``ribbon run`` or ``python -m branches.run``."""
    return f"{prefix}{command}"


class Parser(argparse.ArgumentParser):
    """The command line of a command; a mistake in it is answered in one sentence."""

    def __init__(self, command: str, description: str, epilog: str | None = None):
        super().__init__(typed(command), allow_abbrev=False, description=description, epilog=epilog)
        self.register("type", float, Quantity(""))
        self.register("type", int, _whole)
        self._negative_number_matcher = re.compile(r"-(\.?\d|inf)")  # -30mm is a value, too

    def parse_args(self, args=None, namespace=None):
        """Return the options; a mistyped one is named before those that are then missing."""
        for word in sys.argv[1:] if args is None else args:
            name = word.partition("=")[0]
            if word == "--":
                break
            if name.startswith("--") and name not in self._option_string_actions:
                from contin.lowlevel import meant

                self.error(f"there is no option {name}{meant(name, self._option_string_actions)}")
        options, rest = self.parse_known_args(args, namespace)
        if rest:
            field = "; a field of a scene is changed by --set KEY=VALUE" if "--set" in self._option_string_actions else ""
            self.error(f"unrecognized arguments: {' '.join(rest)}{field}")
        return options

    def error(self, message):
        complain(f"error: {message} (--help shows what there is)")
        raise SystemExit(2)


class Quantity:
    """The type of an option that is a number in an SI unit, or has a unit."""

    def __init__(self, unit: str):
        self._unit = unit

    def __call__(self, text: str) -> float:
        """Return the number in the SI unit; raise argparse.ArgumentTypeError for a text that is none."""
        from branches.scene.units import quantity

        try:
            return quantity(text, self._unit)
        except ValueError as error:
            raise argparse.ArgumentTypeError(str(error)) from error


def _whole(text: str) -> int:
    """Return a whole number; raise argparse.ArgumentTypeError for a text that is none."""
    try:
        return int(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(f"{text!r} must be a whole number") from error


def answered(*more: type[Exception]) -> Callable[[Callable], Callable[..., int]]:
    """Return a decorator of the ``main`` of a command: what cannot be done is one line, and the exit code 2.

    That is what ConfigError, StoreError and ContinError tell, and ``more`` errors. Standard output escapes what its encoding
    lacks (± in ASCII, an odd file name) instead of failing.
    """

    def decorate(main: Callable) -> Callable[..., int]:
        @functools.wraps(main)
        def command(argv=None) -> int:
            if hasattr(sys.stdout, "reconfigure"):
                sys.stdout.reconfigure(errors="backslashreplace")
            try:
                return main(argv)
            except Exception as error:
                from branches.scene.fields import ConfigError  # these take .1 s, and are needed here only
                from contin import ContinError

                if not isinstance(error, (ConfigError, StoreError, ContinError, *more)):
                    raise
                complain(f"error: {error.args[0] if isinstance(error, KeyError) else error}")
                return 2

        return command

    return decorate


def check_view(view: list[float] | None) -> None:
    """Raise ConfigError if the option --view is no direction."""
    if view is not None and not (abs(view[0]) <= 360 and abs(view[1]) <= 90):
        from branches.scene.fields import ConfigError

        asked = f"--view {view[0]:g} {view[1]:g}"
        raise ConfigError(f"{asked}: the azimuth must lie between -360 and 360, the elevation between -90 and 90 (degrees)")


def complain(text: str) -> None:
    """One line to standard error; where that fails too (a closed terminal), the exit code is all that is left to say it."""
    with contextlib.suppress(OSError):
        print(text, file=sys.stderr, flush=True)


def write_output(text: str = "") -> None:
    """Write to standard output at once; nobody reading it any more (``| head``) is no error, the run goes on without."""
    if sys.stdout is None:  # closed from the start
        return
    try:
        sys.stdout.write(text)
        sys.stdout.flush()
    except OSError as error:
        if not isinstance(error, BrokenPipeError):
            complain(f"error: cannot write to standard output: {error.strerror}")
        # what is still buffered must go somewhere, or Python complains about it at exit
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
