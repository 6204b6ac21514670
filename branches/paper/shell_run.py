"""``python -m branches.shell --out FILE``: compute the unfolding strip as a solid with CalculiX; finished cases are kept.

This checks the one-dimensional theory: for each `Case`, the first xi at which the planar strip has an unstable
out-of-plane vibration. `branches.paper.shell_deck` writes the decks and reads the answers.
"""

from __future__ import annotations

import contextlib
import io
import math
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass
from pathlib import Path

from branches.run.display import Progress
from branches.run.executor import cores, run_jobs
from branches.scene.fields import ConfigError
from branches.store import interrupt
from branches.store.command import Parser, answered, write_output
from branches.store.files import BRANCHES, StoreError, check_name, only_run, prepare, write_bytes
from contin.lowlevel import exact_text

PROGRAM = "ccx"
INSTALL = "CalculiX (the program ccx) is not installed; on Debian and Ubuntu: apt-get install calculix-ccx"
#: Largest time in seconds of one run of CalculiX: one state, or all states of a path.
TIME_LIMITS = {"thermal": 120.0, "direct": 600.0}
#: Width in xi of the bracket in which a root is interpolated.
BRACKET = 1e-3


class ShellError(ConfigError):
    """CalculiX cannot be used at all; the message is one sentence."""


class Unusable(Exception):
    """A run of CalculiX that gave no planar state; the message says why."""


@dataclass(frozen=True)
class Case:
    """A strip, its method (``way``, see `branches.paper.shell_deck`), and the interval of xi that is searched."""

    way: str
    nu: float
    slenderness: float
    thinness: float
    along: int = 60
    across: int = 6
    first: float = 0.3
    last: float = 0.95
    step: float = 0.1

    def __post_init__(self):
        if self.way not in TIME_LIMITS:
            raise ValueError(f"way = {self.way!r}: must be {' or '.join(map(repr, TIME_LIMITS))}")
        search = ", ".join(f"{name} = {exact_text(getattr(self, name))}" for name in ("first", "last", "step"))
        if not (0 < self.first < self.last and self.step > 0):
            raise ValueError(f"{search}: must be positive, ascending")
        if self.way == "thermal" and self.last >= 1:
            raise ValueError(f"last = {exact_text(self.last)}: the thermal method is for xi < 1")
        _ = self.strip

    @property
    def strip(self):
        """The strip with its mesh."""
        from branches.paper.shell_deck import Strip

        return Strip(self.nu, self.slenderness, self.thinness, self.along, self.across)

    @property
    def number(self) -> float:
        """w**2/(R h)."""
        return self.thinness / self.slenderness

    def __str__(self):
        nu, slenderness, thinness = map(exact_text, (self.nu, self.slenderness, self.thinness))
        return f"{self.way}, nu = {nu}, R/w = {slenderness}, w/h = {thinness}, {self.along} x {self.across} elements"


@dataclass(frozen=True)
class Outcome:
    """The result of a case.

    Attributes
    ----------
    root : float or None
        The first xi with a marginal vibration, to about `BRACKET`; None if there is none, or if ``problem`` says
        why it is not known.
    samples : tuple of (xi, omega**2)
        Ascending; omega**2 of the lowest out-of-plane vibration in units of D/(rho h R**4).
    problem : str
        The reason why the search ended early, or ''.
    version : str
        Of CalculiX.
    """

    case: Case
    root: float | None
    samples: tuple[tuple[float, float], ...]
    problem: str
    seconds: float
    version: str


# --- one run of CalculiX ----------------------------------------------------------------------------------------------


def version() -> str:
    """Return the version of CalculiX; raise ShellError where it is not installed, or does not run."""
    program = shutil.which(PROGRAM)
    if program is None:
        raise ShellError(INSTALL)
    try:
        done = subprocess.run([program, "-v"], capture_output=True, text=True, errors="replace", timeout=20)
    except (OSError, subprocess.TimeoutExpired) as error:
        raise ShellError(f"{program} does not run: {error}") from error
    _, found, number = done.stdout.partition("Version")
    return number.split()[0] if found and number.split() else "of unknown version"


def run_ccx(deck: str, time_limit: float, stopped: Callable[[], bool] = lambda: False) -> tuple[str, str]:
    """Run CalculiX on a deck, on one core; return the ``.dat`` file (incomplete after a failure) and why it failed, or ''."""
    with tempfile.TemporaryDirectory(prefix="ccx-") as name:
        folder = Path(name)
        (folder / "strip.inp").write_text(deck)
        environment = {**os.environ, "OMP_NUM_THREADS": "1"}
        began = time.monotonic()
        with open(folder / "log", "wb") as log:
            try:
                process = subprocess.Popen(
                    [PROGRAM, "strip"], cwd=folder, env=environment, stdin=subprocess.DEVNULL, stdout=log, stderr=log
                )
            except OSError as error:
                return "", f"{PROGRAM} does not start: {error.strerror}"
            late = False
            while process.poll() is None:
                late = time.monotonic() - began > time_limit
                if late or stopped():
                    process.kill()
                    process.wait()
                    break
                with contextlib.suppress(subprocess.TimeoutExpired):
                    process.wait(0.1)
        answer = folder / "strip.dat"
        text = answer.read_text(errors="replace") if answer.exists() else ""
        if late:
            return text, f"not finished within {time_limit:g} s"
        if process.returncode:
            lines = (line.strip() for line in (folder / "log").read_text(errors="replace").splitlines())
            errors = (line.removeprefix("*ERROR").lstrip(": ")[:80] for line in lines if line.startswith("*ERROR"))
            return text, f"{PROGRAM} ended with exit code {process.returncode}{next((f' ({one})' for one in errors), '')}"
        return text, ""


class _States:
    """omega**2 of a case at any xi, from runs of CalculiX; each state is computed once, all states of a path in one run."""

    def __init__(self, case: Case, stopped):
        self.case, self.stopped, self.known = case, stopped, {}

    def __call__(self, xi: float) -> float:
        """Return omega**2 at xi; raise `Unusable` if CalculiX gave no planar state."""
        if xi not in self.known:
            self._compute([xi])
        found = self.known[xi]
        if isinstance(found, str):
            raise Unusable(found)
        return found

    def _compute(self, xis):
        from branches.paper.shell_deck import direct_deck, states, thermal_deck

        case, strip = self.case, self.case.strip
        if case.way == "direct" and not self.known:
            xis = grid(case.first, case.last, case.step)
        deck = direct_deck(strip, xis) if case.way == "direct" else thermal_deck(strip, *xis)
        text, problem = run_ccx(deck, TIME_LIMITS[case.way], self.stopped)
        try:
            found = states(text, strip)
        except ValueError as error:
            found, problem = [], problem or str(error)
        for xi, state in zip(xis, found):
            self.known[xi] = state.omega_squared if state.planar else "the state is not planar"
        for xi in xis[len(found) :]:
            self.known[xi] = problem or f"{PROGRAM} ended well, but its answer lacks this state"


# --- one case ---------------------------------------------------------------------------------------------------------


def grid(first: float, last: float, step: float) -> list[float]:
    """Return the grid from first to last; its last step may be shorter."""
    count = math.ceil((last - first) / step - 1e-9)
    return [round(first + step * i, 9) for i in range(count)] + [last]


def first_root(function: Callable[[float], float], first: float, last: float, step: float) -> float | None:
    """Return the first zero of a function that is positive at ``first``; where it has no value, it raises `Unusable`.

    Steps are taken until the sign changes, but hardly beyond the zero of the straight line through the last two points, because
    CalculiX is slow or fails beyond the zero. Then false position, or halving where that is one-sided, until the bracket is not
    wider than `BRACKET`. Where the function has no value, points nearer to the last value are tried. Raises Unusable where
    there is no positive value at the first point, or no zero before the function has no value any more.
    """
    low, at_low, falls_to_zero = first, function(first), math.inf
    if at_low <= 0:
        raise Unusable(f"unstable already at xi = {first:g}, where the search begins")
    high, at_high, barrier, reason = None, 0.0, None, ""
    for target in grid(first, last, step)[1:]:
        while low < target:
            if barrier is not None:
                x = (low + barrier) / 2
            elif high is None:
                x = min(target, falls_to_zero + BRACKET / 2)
            else:
                part = at_low / (at_low - at_high)
                x = low + (high - low) * (part if 0.1 < part < 0.9 else 0.5)
            try:
                value = function(x)
            except Unusable as error:
                barrier, reason = x, str(error)
            else:
                if value > 0:
                    falls_to_zero = x + (x - low) * value / (at_low - value) if value < at_low else math.inf
                    low, at_low = x, value
                else:
                    high, at_high, barrier = x, value, None
            if high is not None and high - low <= BRACKET:
                return low + (high - low) * at_low / (at_low - at_high)
            if barrier is not None and barrier - low <= BRACKET:
                raise Unusable(f"stable up to xi = {low:.4f}, unknown beyond: {reason}")
    return None


def solve(case: Case, stopped: Callable[[], bool] = lambda: False) -> Outcome:
    """Find the first instability of a case. Failures of CalculiX are in the outcome and raise nothing."""
    began, states, root, problem = time.monotonic(), _States(case, stopped), None, ""
    try:
        root = first_root(states, case.first, case.last, case.step)
    except Unusable as error:
        problem = str(error)
    samples = tuple(sorted((xi, value) for xi, value in states.known.items() if not isinstance(value, str)))
    return Outcome(case, root, samples, problem, time.monotonic() - began, version())


# --- many cases ------------------------------------------------------------------------------------------------------


def compute(
    cases: Sequence[Case], path: Path, report: Callable[[Outcome, int], None] = lambda outcome, left: None, quiet: bool = False
) -> None:
    """Compute the cases that the file at ``path`` does not hold yet, one on each core, and keep each when it is finished.

    A case that failed before is tried again. ``report(outcome, left)`` is called after each. Unless ``quiet``, a line of
    progress is shown. Raises ShellError where CalculiX is not installed, and there are cases to compute; StoreError where the
    file cannot be read or written.
    """
    kept = {outcome.case: outcome for outcome in read(path)}
    missing = [case for case in cases if case not in kept or kept[case].problem]
    if not missing:
        return
    version()
    prepare(path)
    stop, waiting, count = threading.Event(), iter(missing), len(missing)
    with (
        interrupt.unwinding(),
        only_run(path),
        Progress("cases", count, quiet) as progress,
        ThreadPoolExecutor(cores()) as pool,
    ):
        try:
            jobs = run_jobs(lambda running: next(waiting, None), lambda case: solve(case, stop.is_set), pool.submit, cores())
            for number, (_, outcome) in enumerate(jobs, 1):
                if isinstance(outcome, BaseException):
                    raise outcome
                kept[outcome.case] = outcome
                _write(path, kept.values())
                progress.clear()
                report(outcome, count - number)
                progress.part_done()
        finally:
            stop.set()  # after an interrupt no CalculiX keeps running


_FIELDS = ("way", "nu", "slenderness", "thinness", "along", "across", "first", "last", "step")


def read(path: Path) -> list[Outcome]:
    """Return all outcomes of a file; none if there is no file. Raises StoreError where it is not a file of shell results."""
    if not path.exists():
        return []
    import h5py

    try:
        with h5py.File(path, "r") as file:
            rows, samples = file["cases"][:], file["samples"][:]
            outcomes = []
            for number, row in enumerate(rows):
                case = Case(row["way"].decode(), *(row[name].item() for name in _FIELDS[1:]))
                own = samples[samples["case"] == number]
                pairs = tuple(zip(own["xi"].tolist(), own["omega_squared"].tolist()))
                root = None if math.isnan(row["root"]) else float(row["root"])
                texts = row["problem"].decode(), row["version"].decode()
                outcomes.append(Outcome(case, root, pairs, texts[0], float(row["seconds"]), texts[1]))
    except (OSError, KeyError, ValueError, AttributeError) as error:
        raise StoreError(f"{str(path)!r} is not a file of shell results: remove it, or choose another name") from error
    return outcomes


def _write(path: Path, outcomes: Iterable[Outcome]) -> None:
    import h5py
    import numpy as np

    outcomes, text = list(outcomes), h5py.string_dtype()
    kinds = {"way": text, "along": int, "across": int}
    columns = [(name, kinds.get(name, float)) for name in _FIELDS]
    columns += [("root", float), ("problem", text), ("seconds", float), ("version", text)]
    rows = [
        (*asdict(o.case).values(), math.nan if o.root is None else o.root, o.problem, o.seconds, o.version) for o in outcomes
    ]
    samples = [(number, *sample) for number, o in enumerate(outcomes) for sample in o.samples]
    whole = io.BytesIO()
    with h5py.File(whole, "w") as file:
        file["cases"] = np.array(rows, dtype=columns)
        file["samples"] = np.array(samples, dtype=[("case", int), ("xi", float), ("omega_squared", float)])
        file.attrs["about"] = "first instability of the unfolding semicircle by finite elements; columns as in branches.shell"
    write_bytes(path, whole.getvalue())


# --- the command ------------------------------------------------------------------------------------------------------

#: The dimensions of section 5.4 of the paper by the direct method: R = 100 mm, w = 5 mm.
PAPER = tuple(Case("direct", nu, 20.0, thinness, 60, 4, 0.1, 0.95, 0.1) for nu in (0.1, 0.3) for thinness in (5.0, 20.0, 50.0))
#: w**2/(R h) of the thin strips, by R/w, and the elements along them.
WIDTHS = {4.0: (36.0, 50.0, 75.0, 100.0, 125.0, 150.0, 200.0, 250.0), 8.0: (75.0, 100.0, 125.0, 150.0)}
ALONG = {4.0: 60, 8.0: 90}
#: From rod to ribbon, by the thermal method.
WIDE = tuple(
    Case("thermal", 0.3, slenderness, slenderness * number, ALONG[slenderness])
    for slenderness, numbers in WIDTHS.items()
    for number in numbers
)
DEFAULT = PAPER + WIDE
#: Further cases: a finer mesh; strips for which CalculiX is slow or fails; another nu.
FULLER = (
    Case("thermal", 0.3, 4.0, 300.0, 90, 10),
    Case("thermal", 0.3, 8.0, 600.0, 120, 10),
    *(Case("thermal", 0.3, 8.0, 8 * number, 90) for number in (36.0, 50.0, 200.0, 250.0)),
    *(Case("thermal", 0.2, 8.0, 8 * number, 90) for number in (100.0, 150.0)),
)


def describe(outcome: Outcome) -> str:
    """Return an outcome as one line."""
    case = outcome.case
    root = f"first instability at xi = {outcome.root:.4f}" if outcome.root else f"none in {case.first:g} ... {case.last:g}"
    return f"{case}: {'FAILED: ' + outcome.problem if outcome.problem else root} ({outcome.seconds:.0f} s)"


def parser() -> Parser:
    """Return the command line."""
    parser = Parser(
        "shell",
        "The unfolding semicircle by finite elements (CalculiX), for fig7 of branches.paper. What the file holds already is "
        "not computed again.",
    )
    parser.add_argument("-o", "--out", required=True, metavar="FILE", type=Path, help="HDF5 file; fig7 looks for DIR/shell.h5")
    parser.add_argument("--full", action="store_true", help="compute further cases: finer meshes, other strips")
    parser.add_argument("--quiet", action="store_true", help="show no line of progress")
    return parser


@answered()
def main(argv: Sequence[str] | None = None) -> int:
    """Compute the missing cases and list all; return the exit code: 0, 1 if a case failed, 2 for bad input."""
    options = parser().parse_args(argv)
    signal.signal(signal.SIGTERM, lambda number, frame: sys.exit(128 + number))  # unwinding also ends CalculiX
    cases = DEFAULT + FULLER if options.full else DEFAULT
    check_name(options.out, BRANCHES)
    compute(cases, options.out, lambda outcome, left: write_output(f"{describe(outcome)}, {left} to go\n"), options.quiet)
    outcomes = read(options.out)
    write_output("\n".join(["", *map(describe, outcomes), ""]))
    return 1 if any(outcome.problem for outcome in outcomes) else 0
