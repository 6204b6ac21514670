"""What a person sees of a run: a table of points, a line that moves, a summary to quote."""

from __future__ import annotations

import argparse
import contextlib
import math
import os
import shlex
import shutil
import sys
import time
from typing import TYPE_CHECKING

from branches.labels import CONJUGATE, label_of, without_round_off

if TYPE_CHECKING:  # nothing heavy is imported here: the command line uses this module before it knows what to do
    from contin import Point

_HEADER = "   PT  TY  LAB         kappa_n      kappa_star          energy      step   N  it"
#: Every that many regular points one is printed between the labelled ones.
_EVERY = 5


def survive_any_encoding() -> None:
    """Let standard output escape what its encoding lacks (± in ASCII, an odd file name) instead of failing."""
    if hasattr(sys.stdout, "reconfigure"):
        sys.stdout.reconfigure(errors="backslashreplace")


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


class Parser(argparse.ArgumentParser):
    """A command line whose mistakes are answered in one sentence."""

    def error(self, message):
        complain(f"error: {message} (--help shows what there is)")
        raise SystemExit(2)


class Display:
    """Prints points and a summary to standard output, and a moving line to a terminal on standard error."""

    def __init__(self, quiet: bool = False, silent: bool = False):
        self._quiet, quiet = quiet or silent, quiet or silent
        self._silent = silent
        self._moving = not quiet and sys.stderr is not None and sys.stderr.isatty()
        self._label = self._first = self._most = 0
        self._largest = 0.0  # value of the number that the stage follows
        self._began = self._shown = time.monotonic()

    def note(self, text: str) -> None:
        """One line, or several."""
        if not self._silent:
            write_output(text + "\n")

    def begin(self, config, count: int, labels: int) -> None:
        """Say what is about to be computed, after ``count`` points, ``labels`` of them labelled, of a run resumed."""
        self._first, self._label, self._most = count, labels, config.steps.max_points
        if not self._quiet:
            resumed = f", resumed after {count} points" if count else ""
            self.note(f"{name_of(config)} on the {config.domain}{resumed}\n{_HEADER}")

    def point(self, point: Point, number: int, step: float) -> None:
        """Show a point, in the table or in the moving line."""
        if self._quiet:
            return
        if point.label or number % _EVERY == 0:
            self.clear()
            self._label += bool(point.label)
            label = f"{self._label:3d}" if point.label else "   "
            self.note(
                f"{number:5d}  {point.label:2s}  {label}  {point['kappa_n']:14.8f}  {point['kappa_star']:14.8f}"
                f"  {point['energy']:14.8f}  {step:8.1e} {point.system.intervals:3d} {point.iterations:3d}"
            )
        now = time.monotonic()
        if self._moving and now - self._shown > 0.1:
            self._shown = now
            rate = (number - self._first) / max(now - self._began, 1e-9)
            self._line(
                f"point {number}: kappa_n = {point['kappa_n']:.4f}, step {step:.1e}, error {point.newton_error:.0e}, "
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

    def summary(self, config, events, count: int, seconds: float, path, outcome: str, stop) -> None:
        """What came out, in lines to quote; ``events`` are rows of the result's table of labelled points."""
        from contin import Reason  # loaded by then

        self.clear()
        lines = [] if self._quiet else [""]
        lines.append(f"{name_of(config)}: {count} points in {seconds:.2f} s")
        lines += [f"  {_describe(config, event)}" for event in events]
        if outcome == "interrupted":
            lines.append(f"  interrupted; go on with --resume --out {shlex.quote(str(path))}")
        elif stop is not None and stop.reason != Reason.TRIVIAL_BRANCH:
            lines.append(f"  stopped: {stop}")
        self.note("\n".join([*lines, f"  written to {path}"]))

    # --- open strips ---------------------------------------------------------------------------------------------

    def begin_stages(self, config, count: int, labels: int) -> None:
        """Say what is about to be computed, after ``count`` points, ``labels`` of them labelled, of a run resumed."""
        self._label = labels
        if not self._quiet:
            self.note(f"{config.title or config.name}{f', resumed after {count} points' if count else ''}")

    def stage(self, config, number: int) -> None:
        """Say which stage begins."""
        self._largest = abs(config.stages[number - 1].to)
        if not self._quiet:
            name, unit = config.stages[number - 1].follow, config.unit(config.stages[number - 1].follow)
            head = f"stage {number}: {name}{f' in {unit}' if unit else ''}"
            self.note(f"{head}\n   PT  TY  LAB  {name:>14s}     energy      F_tangent      index   N  it")

    def stage_point(self, config, stage, point: Point, number: int) -> None:
        """Show a point of a stage."""
        self._largest = max(self._largest, abs(point[stage.follow] * config.factor(stage.follow)))
        if self._quiet or not (point.label or number % _EVERY == 0):
            return
        self._label += bool(point.label)
        label = f"{self._label:3d}" if point.label else "   "
        strip = config.strip()
        force, energy = (
            without_round_off(found, strip.section.stiffness) * config.factor(name)
            for name, found in (("F_tangent", strip.reactions(point)["F_tangent"]), ("energy", point["energy"]))
        )
        value = without_round_off(point[stage.follow] * config.factor(stage.follow), self._largest)
        self.note(
            f"{number:5d}  {point.label:2s}  {label}  {value:14.8g}  {energy:12.6g}  {force:12.6g}"
            f"  {'-' if point.index is None else point.index:>5}  {point.system.intervals:4d} {point.iterations:3d}"
        )

    def stages_summary(self, config, events, count: int, seconds: float, path, ended) -> None:
        """What came out of all stages, in lines to quote; ``ended`` is the outcome and the reason of the stop."""
        self.clear()
        outcome, stop = ended
        lines = [] if self._quiet else [""]
        lines.append(f"{config.title or config.name}: {count} points in {seconds:.2f} s")
        lines += [f"  {_describe_stage(config, event, _largest(config, events, event['stage']))}" for event in events]
        if outcome == "interrupted":
            lines.append(f"  interrupted; go on with --resume --out {shlex.quote(str(path))}")
        elif outcome == "lost":
            lines.append(f"  stopped: {stop}")
        self.note("\n".join([*lines, f"  written to {path}"]))

    # --- diagrams ------------------------------------------------------------------------------------------------

    def begin_diagram(self, config, total: int, kept: int) -> None:
        """Say how many branches a diagram has, and how many of them are there already."""
        self._total, self._kept, self._began = total, kept, time.monotonic()
        if not self._quiet:
            there = f", {kept} of them computed before" if kept else ""
            self.note(f"{config.title or 'diagram'}: {total} branches{there}")

    def branch_done(self, config, problem: str, nodes: list[dict], settled: int) -> None:
        """Show a branch: its special points, or why it failed. So many branches are ``settled``: there, failed or left out."""
        if self._quiet:
            return
        from branches.diagram_graph import describe  # not for --help

        self.clear()
        self.note(f"  {name_of(config)}: {'FAILED: ' + problem if problem else describe(nodes)}")
        self._to_go(settled)

    def sweep_done(self, lines: list[str], problem: str, settled: int) -> None:
        """Show one of many open strips, as `branch_done`; ``lines`` are what it is, and its stages."""
        if self._quiet:
            return
        self.clear()
        self.note("\n".join(f"  {line}" for line in lines) + (f": FAILED: {problem}" if problem else ""))
        self._to_go(settled)

    def _to_go(self, settled: int) -> None:
        each = (time.monotonic() - self._began) / (settled - self._kept)
        self._line(f"{settled} of {self._total} branches, about {duration(each * (self._total - settled))} to go")

    def diagram_summary(self, summary: list[str]) -> None:
        """What came out."""
        self.clear()
        self.note("\n".join(summary if self._quiet else ["", *summary]))


#: Seconds below which times are given in seconds, above in minutes.
_MINUTES_FROM = 120.0


def duration(seconds: float) -> str:
    """Return a time in words."""
    return f"{seconds:.0f} s" if seconds < _MINUTES_FROM else f"{seconds / 60:.0f} min"


def name_of(config) -> str:
    """The branch in words."""
    from contin.lowlevel import exact_text  # not for --help

    what = "secondary branch from " if config.origin else ""
    return f"{config.material}, {what}(m, n) = ({config.m}, {config.n}), nu = {exact_text(config.nu)}"


def _largest(config, events, stage: int) -> float:
    """Return the largest value at a labelled point of the number that a stage follows."""
    name = config.stages[stage - 1].follow
    return max(abs(event[name]) for event in events if event["stage"] == stage)


def _describe_stage(config, event, largest: float) -> str:
    """A labelled point of an open strip in words; ``largest`` is the largest value of its stage."""
    name = config.stages[event["stage"] - 1].follow
    label, error = event["label"].decode(), event[f"error_{name}"] * config.factor(name)
    found = label in ("LP", "BP") and not math.isnan(error)
    others = "".join(f", {text}" for text in (_with_error(config, event, column) for column in _shown(name)) if text)
    place = f"{name} = {_rounded(without_round_off(event[name], largest) * config.factor(name), error)}" + (
        f" (± {error:.0e})" if found else ""
    )
    what = event["name"].decode()
    change = f", index {event['index_before']} -> {event['index_after']}" if event["index_before"] >= 0 else ""
    broken = f", breaks {event['breaks'].decode()}" if event["breaks"] else ""
    shown = what if "=" not in what and (label not in ("LP", "BP") or "kernel" in what) else ""  # not the value once more
    kind = f" ({shown})" if shown else ""
    return f"stage {event['stage']}: {label_of(label).word}{kind} at {place}{others}{change}{broken}"


def _shown(name: str) -> tuple[str, ...]:
    """Return the columns that a labelled point is shown with: the energy, and what is conjugate to the followed number."""
    return tuple(dict.fromkeys(("energy", CONJUGATE.get(name, "energy"))))


def _with_error(config, event, column: str) -> str:
    """Return a column of a labelled point with its error, '' where it has none."""
    if f"error_{column}" not in event.dtype.names or math.isnan(event[f"error_{column}"]):
        return ""
    value, error = (event[field] * config.factor(column) for field in (column, f"error_{column}"))
    unit = config.unit(column)
    return f"{column} = {_rounded(value, error)}{f' {unit}' if unit else ''} (± {error:.0e})"


def _rounded(value: float, error: float) -> str:
    """Return a number with ten digits; 0 where it is smaller than its error."""
    return "0" if abs(value) < error else f"{value:.10g}"


def _describe(config, event) -> str:
    label, name = event["label"], event["name"].decode()
    place = f"kappa_n L/2pi = {event['kappa_n']:.10f}"
    found = name in ("trivial branch", "primary branch")
    held = label == b"UZ" or (label == b"EP" and not found)  # kappa_n was given, not found
    error = event["error_kappa_n"]
    certain = "" if held or math.isnan(error) else f" (± {error:.0e})"
    if name == "start" and config.origin:
        return f"leaves the branch ({config.m}, {config.n}) at {place}{certain}, {config.origin.mode}"
    if name == "start":
        return f"leaves the {config.m}-covered circle at {place}{certain}"
    if name == "trivial branch":
        from ribbon_model.laws import LAWS
        from ribbon_model.linear import covering

        columns = (float(event[name]) for name in ("kappa_n", "kappa_star", "energy"))
        index = covering(LAWS[config.law], config.parameters, *columns)
        inside_out = ", curled against its natural curvature" if index < 0 else ""
        return f"ends on the {abs(index)}-covered circle{inside_out} at {place}{certain}"
    what = f" ({name})" if name and label != b"LP" else ""
    return f"{label_of(label.decode()).word}{what} at {place}{certain}, kappa* = {event['kappa_star']:.10f}"
