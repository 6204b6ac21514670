"""What a person sees of a run: a table of points, a line that moves, a summary to quote."""

from __future__ import annotations

import math
import shutil
import sys
import time

from contin import Branch, Point

_HEADER = "   PT  TY  LAB         kappa_n      kappa_star          energy      step   N  it"
#: Every that many regular points one is printed between the labelled ones.
_EVERY = 5
_KINDS = {"LP": "fold", "BP": "branch point", "UZ": "user value"}


class Display:
    """Prints points and a summary to standard output, and a moving line to a terminal on standard error."""

    def __init__(self, quiet: bool = False):
        self._quiet = quiet
        self._moving = not quiet and sys.stderr.isatty()
        self._label = 0
        self._began = self._shown = time.monotonic()

    def note(self, text: str) -> None:
        """One line."""
        print(text)

    def begin(self, config, run, count: int) -> None:
        """Say what is about to be computed."""
        if not self._quiet:
            resumed = f", resumed after {count} points" if count else ""
            print(f"{name_of(config)} on the {config.domain}{resumed}")
            print(_HEADER)

    def point(self, point: Point, number: int, step: float) -> None:
        """Show a point, in the table or in the moving line."""
        if self._quiet:
            return
        if point.label or number % _EVERY == 0:
            self.clear()
            self._label += bool(point.label)
            label = f"{self._label:3d}" if point.label else "   "
            print(
                f"{number:5d}  {point.label:2s}  {label}  {point['kappa_n']:14.8f}  {point['kappa_star']:14.8f}"
                f"  {point['energy']:14.8f}  {step:8.1e} {point.system.intervals:3d} {point.iterations:3d}"
            )
        now = time.monotonic()
        if self._moving and now - self._shown > 0.1:
            self._shown = now
            rate = number / max(now - self._began, 1e-9)
            line = f"point {number}: kappa_n = {point['kappa_n']:.4f}, step {step:.1e}, {rate:.0f} points/s"
            print("\r" + line[: shutil.get_terminal_size().columns - 1].ljust(60), end="", file=sys.stderr, flush=True)

    def clear(self) -> None:
        """Take the moving line away."""
        if self._moving:
            print("\r" + " " * (shutil.get_terminal_size().columns - 1) + "\r", end="", file=sys.stderr, flush=True)

    def summary(self, config, branch: Branch, count: int, seconds: float, path, outcome: str) -> None:
        """What came out, in lines to quote."""
        self.clear()
        if not self._quiet:
            print()
        print(f"{name_of(config)}: {count} points in {seconds:.2f} s")
        for point in branch.points:
            print(f"  {_describe(config, point)}")
        if outcome == "interrupted":
            print(f"  interrupted; go on with --resume --out {path}")
        elif branch.stop is not None and branch.stop.reason != "trivial branch":
            print(f"  stopped: {branch.stop}")
        print(f"  written to {path}")


def name_of(config) -> str:
    """The branch in words."""
    return f"{config.law}, (m, n) = ({config.m}, {config.n}), nu = {config.nu:g}"


def _describe(config, point: Point) -> str:
    place = f"kappa_n L/2pi = {point['kappa_n']:.10f}"
    held = point.label == "UZ" or (point.label == "EP" and point.name != "trivial branch")  # kappa_n was given, not found
    error = point.errors.get("kappa_n", math.nan)
    certain = "" if held or math.isnan(error) else f" (± {error:.0e})"
    star = f"kappa* = {point['kappa_star']:.10f}"
    if point.name == "start":
        return f"leaves the {config.m}-covered circle at {place}{certain}"
    if point.name == "trivial branch":
        return f"ends on the {round(abs(point['kappa_star']))}-covered circle at {place}{certain}"
    kind = _KINDS.get(point.label, "end")
    what = f" ({point.name})" if point.name and point.label != "LP" else ""
    return f"{kind}{what} at {place}{certain}, {star}"
