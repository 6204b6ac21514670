"""What a person sees of a run: a table of points, a line that moves, a summary to quote."""

from __future__ import annotations

import shlex
import shutil
import sys
import time
from typing import TYPE_CHECKING

from branches.store.command import write_output

if TYPE_CHECKING:  # nothing heavy is imported here: the command line uses this module before it knows what to do
    from branches.scene.fields import Scene
    from branches.scene.stage import Stage
    from contin import Point, Stop

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
