"""One line of progress on a terminal, for commands that compute for long: it is overwritten in place and leaves no trace."""

from __future__ import annotations

import threading
import time
from typing import TYPE_CHECKING, ClassVar

from branches.run.display import Display, duration
from branches.store.command import write_output

if TYPE_CHECKING:  # nothing heavy is imported here: the line is to be shown while the heavy modules are imported
    from branches.scene.stage import Stage
    from contin import Point

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
    ...     for name in ("(1, 2)", "(1, 3)"):
    ...         progress.part(name)  # "0 of 2 branches done, 1 s so far: (1, 2)"
    ...         progress.part_done()  # "1 of 2 branches done, 1 s so far, about 1 s to go"
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
        """Return the estimate of the seconds left: the mean time of the parts, for each part that is left.

        The mean is that of the finished parts, or of these and the current part if that is larger. The time spent on the
        current part is taken off, but not more than the mean.
        """
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
        """Take the moving line away."""
        self._start.stop()
        super().clear()

    def point(self, stage: Stage, point: Point, number: int, step: float) -> None:
        """Show a point; the rate counts from the first one, without the time of the start."""
        if number == self._first:
            self._began = self._shown = time.monotonic()
        super().point(stage, point, number, step)
