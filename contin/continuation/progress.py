"""One line on standard error while a run is under way: it is overwritten in place, and cleared at the end."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from typing import TextIO

from contin import errors as checks
from contin.continuation.run import Continuation
from contin.core.step import Reason, Stop
from contin.errors import ProblemError
from contin.results.branch import Branch
from contin.results.point import Point
from contin.text import WIDTH

#: Seconds before a line is shown, and between two of them: calls that are done at once show none, and the terminal is not
#: flooded.
_FIRST, _BETWEEN = 1.0, 0.2


class Progress:
    """The line of progress of one call; raise ProblemError where ``wanted`` is neither True, False nor None.

    None shows it where standard error is a terminal.
    """

    def __init__(self, wanted: bool | None) -> None:
        if wanted is not None:
            checks.truth("progress", wanted)
        self._file: TextIO = sys.stderr
        self._on = self._file is not None and (self._file.isatty() if wanted is None else wanted)
        self._next, self._shown = time.monotonic() + _FIRST, False

    def watch(self, run: Continuation, what: str = "") -> Iterator[Point]:
        """Yield the points of a run, and show how far it is; ``what`` comes first on the line."""
        labels: list[str] = []
        count = 0
        try:
            for point in run:
                count += not point.label
                if point.label:
                    labels.append(point.label)
                if self._on and time.monotonic() >= self._next:
                    place = f"{run.primary} = {point[run.primary]:.6g}"
                    self._show(f"{what}{count} points, {place}, step {run.state.step:.2g}  {' '.join(labels[-8:])}")
                yield point
        finally:
            self.clear()

    def _show(self, text: str) -> None:
        self._file.write(f"\r{text[: WIDTH - 1]:<{WIDTH - 1}}")
        self._file.flush()
        self._next, self._shown = time.monotonic() + _BETWEEN, True

    def clear(self) -> None:
        """Leave an empty line."""
        if self._shown:
            self._file.write(f"\r{'':<{WIDTH - 1}}\r")
            self._file.flush()
            self._shown = False


def follow_until_interrupted(run: Continuation, progress: Progress) -> Branch:
    """Run to the end, or to the first Ctrl-C, and return the branch.

    Raises KeyboardInterrupt at Ctrl-C before the first point; ProblemError where the run starts outside its limits, which
    leaves it with its first point.
    """
    branch = Branch()
    try:
        for point in progress.watch(run):
            branch.points.append(point)
    except KeyboardInterrupt:
        if not branch.points:
            raise
        run.stop = Stop(Reason.INTERRUPTED, f"interrupted after {len(branch.points)} points", "trace from the last one goes on")
        print(f"contin: {run.stop}", file=sys.stderr)
    branch.stop, branch.notes = run.stop, run.notes
    if len(branch.points) == 1 and branch.stop is not None and branch.stop.reason == Reason.LIMIT:
        raise ProblemError(f"limits: {branch.stop.message}; widen them, or start inside them")
    return branch
