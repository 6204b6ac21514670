"""What a person sees of a run: a table of points, a summary to quote, and a line of progress.

The line is overwritten in place on a terminal and leaves no trace; commands that compute for long have it, too.
"""

from __future__ import annotations

import shlex
import shutil
import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from typing import TYPE_CHECKING, ClassVar, TypeVar

from branches.store.command import write_output

if TYPE_CHECKING:  # nothing heavy is imported here: the line is to be shown while the heavy modules are imported
    from branches.scene.fields import Scene
    from branches.scene.stage import Stage
    from contin import Point, Stop

Part = TypeVar("Part")
#: Every that many regular points one is printed between the labelled ones.
_EVERY = 5


class Display:
    """Prints points and a summary to standard output, and a moving line to a terminal on standard error."""

    def __init__(self, quiet: bool = False, silent: bool = False):
        self._quiet, quiet = quiet or silent, quiet or silent
        self._silent = silent
        self._moving = not quiet and sys.stderr is not None and sys.stderr.isatty()
        self._label = self._first = self._most = 0
        self._began = self._shown = time.monotonic()

    def note(self, text: str) -> None:
        """One line, or several."""
        if not self._silent:
            write_output(text + "\n")

    def begin(self, scene: Scene, count: int, labels: int) -> None:
        """Say what is about to be computed, after ``count`` points, ``labels`` of them labelled, of a run resumed."""
        self._first, self._label, self._most = count, labels, scene.steps.max_points
        if not self._quiet:
            self.note(f"{scene.heading}{f', resumed after {count} points' if count else ''}")

    def stage(self, stage: Stage) -> None:
        """Say which stage begins."""
        if not self._quiet:
            self.note(f"{stage.title}   PT  TY  LAB  {stage.head}")

    def point(self, stage: Stage, point: Point, number: int, step: float) -> None:
        """Show a point, in the table or in the moving line."""
        if self._quiet:
            return
        row = stage.row(point, step)
        if point.label or number % _EVERY == 0:
            self.clear()
            self._label += bool(point.label)
            label = f"{self._label:3d}" if point.label else "   "
            self.note(f"{number:5d}  {point.label:2s}  {label}  {row}")
        now = time.monotonic()
        if self._moving and now - self._shown > 0.1:
            self._shown = now
            rate = (number - self._first) / max(now - self._began, 1e-9)
            here = point[stage.follow] * stage.scene.factor(stage.follow)
            self._line(
                f"point {number}: {stage.follow} = {here:.4f}, step {step:.1e}, error {point.newton_error:.0e}, "
                f"{rate:.0f} points/s, max_points in {(self._most - number) / max(rate, 1e-9):.0f} s"
            )

    def clear(self) -> None:
        """Take the moving line away."""
        self._line("")

    def _line(self, text: str) -> None:
        """Write over the moving line, never wider than the terminal."""
        if self._moving:
            width = shutil.get_terminal_size().columns - 1
            try:
                print("\r" + text[:width].ljust(width) + "\r" + text[:width], end="", file=sys.stderr, flush=True)
            except OSError:
                self._moving = False  # the terminal is gone; the run is not

    def summary(self, stages: list[Stage], events, count: int, seconds: float, path, outcome: str, stop: Stop | None) -> None:
        """What came out, in lines to quote; ``events`` are rows of the result's table of labelled points."""
        self.clear()
        lines = [] if self._quiet else [""]
        lines.append(f"{stages[0].scene.title_or_name}: {count} points in {seconds:.2f} s")
        lines += [f"  {text}" for stage in stages for text in stage.described(events)]
        told = None if stop is None else stages[-1].ending(stop, outcome)
        if outcome == "interrupted":
            lines.append(f"  interrupted; go on with --resume --out {shlex.quote(str(path))}")
        elif told is not None:
            lines.append(f"  stopped: {told}")
        self.note("\n".join([*lines, f"  written to {path}"]))

    # --- many branches -----------------------------------------------------------------------------------------------

    def begin_many(self, title: str, total: int, kept: int) -> None:
        """Say how many branches a scene has, and how many of them are there already."""
        self._total, self._kept, self._began = total, kept, time.monotonic()
        if not self._quiet:
            there = f", {kept} of them computed before" if kept else ""
            self.note(f"{title}: {total} branches{there}")

    def branch_done(self, lines: list[str], problem: str, settled: int) -> None:
        """Show a branch, or why it failed. So many branches are ``settled``: there, failed or left out."""
        if self._quiet:
            return
        self.clear()
        self.note("\n".join(f"  {line}" for line in lines) + (f": FAILED: {problem}" if problem else ""))
        each = (time.monotonic() - self._began) / (settled - self._kept)
        self._line(f"{settled} of {self._total} branches, about {duration(each * (self._total - settled))} to go")

    def many_summary(self, summary: list[str]) -> None:
        """What came out."""
        self.clear()
        self.note("\n".join(summary if self._quiet else ["", *summary]))


#: Seconds below which times are given in seconds, above in minutes.
_MINUTES_FROM = 120.0


def duration(seconds: float) -> str:
    """Return a time in words."""
    return f"{seconds:.0f} s" if seconds < _MINUTES_FROM else f"{seconds / 60:.0f} min"


_STARTING = "starting (the first run compiles machine code, which takes half a minute)"


class Progress(Display):
    """A line on standard error: how many parts of the work are done, the time so far, an estimate of the time left.

    The line is shown on a terminal only, and not if ``quiet``. Nothing goes to standard output, except by `tell`. It is shown
    between ``with Progress(...) as progress`` and the end of the block.

    Parameters
    ----------
    what : str
        The name of the parts, as in "branches"; without a ``total``, what is being done.
    total : int
        The number of parts; 0 where it is not known.
    quiet : bool

    Examples
    --------
    >>> with Progress("branches", total=2) as progress:
    ...     for m, n in progress.each([(1, 2), (1, 3)], str):
    ...         pass  # "1 of 2 branches done, 1 s so far, about 1 s to go: (1, 3)"
    """

    #: The lines that are open. A line inside the block of another one is shown in its place.
    _open: ClassVar[list[Progress]] = []

    def __init__(self, what: str, total: int = 0, quiet: bool = False, period: float = 1.0):
        """Updates come ``period`` seconds apart where nothing else happens; ten times more look like a program that hangs."""
        super().__init__(quiet)
        self._period = period
        self._tells = not quiet
        self._quiet = self._silent = True  # as a display of a run, it shows the moving line only
        self._what, self._total, self._done = what, total, 0
        self._part = self._detail = ""
        self._part_began = self._done_at = self._began
        self._lock, self._over, self._ticker = threading.RLock(), threading.Event(), None

    def __enter__(self) -> Progress:
        if self._moving:
            self._open.append(self)
            self._ticker = threading.Thread(target=self._tick, daemon=True)
            self._ticker.start()
        return self

    def __exit__(self, *exception) -> None:
        self.stop()

    def stop(self) -> None:
        """Take the line away for good."""
        self._over.set()
        if self._ticker is not None:
            self._ticker.join()
            self._ticker = None
            self._open.remove(self)
            self.clear()

    def expect(self, total: int) -> None:
        """Set the number of parts."""
        self._total = total

    def each(self, parts: Iterable[Part], name: Callable[[Part], str]) -> Iterator[Part]:
        """Yield the parts of the work; each one is shown by its name until the next one is asked for."""
        for part in parts:
            self.part(name(part))
            yield part
            self.part_done()

    def part(self, name: str) -> None:
        """Say which part begins."""
        self._part, self._detail, self._part_began = name, "", time.monotonic()
        self._show()

    def part_done(self) -> None:
        """Count a part that is finished."""
        self._done, self._done_at = self._done + 1, time.monotonic()
        self._part = self._detail = ""
        self._part_began = self._done_at
        self._show()

    def point(self, stage: Stage, point: Point, number: int, step: float) -> None:
        """Say how far the branch of the current part has come."""
        self._detail = f", point {number}, {stage.follow} = {point[stage.follow]:.4f}"

    def tell(self, text: str) -> None:
        """Write lines to standard output, above the line of progress; nothing if quiet."""
        if self._tells:
            with self._lock:
                self.clear()
                write_output(text)

    def text(self) -> str:
        """Return the line."""
        now = time.monotonic()
        so_far = f"{duration(now - self._began)} so far"
        if not self._total:
            return f"{self._what}: {so_far}{self._detail}"
        left = self._left(now)
        estimate = "" if left is None else f", about {duration(left)} to go"
        part = f": {self._part}{self._detail}" if self._part else ""
        return f"{self._done} of {self._total} {self._what} done, {so_far}{estimate}{part}"

    def _left(self, now: float) -> float | None:
        """Return the estimated seconds left: the mean time of a part for each one left, less what the current one has taken."""
        if not self._done:
            return None
        mean = max((self._done_at - self._began) / self._done, (now - self._began) / (self._done + 1))
        return max(mean * (self._total - self._done) - min(now - self._part_began, mean), 0.0)

    def _tick(self) -> None:
        while not self._over.wait(self._period):
            self._show()

    def _show(self) -> None:
        with self._lock:
            if self._ticker is not None and not self._over.is_set() and self._open[-1] is self:
                self._line(self.text())


class StartingDisplay(Display):
    """The display of a run; until its first output, a line says that the command is starting."""

    def __init__(self, quiet: bool = False, period: float = 1.0):
        super().__init__(quiet)
        self._start = Progress(_STARTING, quiet=quiet, period=period).__enter__()

    def note(self, text: str) -> None:
        """Write one line, or several."""
        self._start.stop()
        super().note(text)

    def clear(self) -> None:
        self._start.stop()
        super().clear()

    def point(self, stage: Stage, point: Point, number: int, step: float) -> None:
        """Show a point; the rate counts from the first one, without the time of the start."""
        if number == self._first:
            self._began = self._shown = time.monotonic()
        super().point(stage, point, number, step)
