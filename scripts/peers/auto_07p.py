"""AUTO-07p, as distributed (``apt-get install auto-07p gfortran``), run without its Python front end.

The Fortran files in ``auto/`` state the ribbon three times, with analytic Jacobians: ``half`` and ``loop`` in all thirteen
components of equations (1)-(4) of Audoly & Seffen (2015), ``cell`` in the four of the quarter wave. A study is two runs: the
planar circle up to its bifurcation at kappa_n = 2.5, then the branch that leaves there. ``bratu`` is Bratu's problem.
"""

from __future__ import annotations

import functools
import os
import re
import resource
import shutil
import subprocess
import tempfile
import time
from pathlib import Path

SOURCES = Path(__file__).parent / "auto"
LIBRARY = Path(os.environ.get("AUTO_DIR", "/usr/lib/auto-07p")) / "lib"

#: NDIM, NBC and the free parameters of each statement; PAR(3) is printed with half and loop, free on the cell.
SHAPES = {"half": (13, 13, "1, 3"), "loop": (13, 13, "1, 3"), "cell": (4, 6, "1, 4, 3")}

CONSTANTS = """\
NDIM={ndim}, IPS=4, IRS={restart}, ISW={switch}, ICP=[{free}], NBC={nbc}, NINT=0, JAC=1
NTST={intervals}, NCOL={degree}, IAD=3, ILP={folds}, ISP={branch_points}, NMX=2000, NPR=0, MXBF=0, IID={diagnostics}, IPLT=0
ITMX=9, ITNW=7, NWTN=3, EPSL={tolerance}, EPSU={tolerance}, EPSS={event_tolerance}
DS={first_step}, DSMIN=1e-6, DSMAX={longest_step}, IADS=1, SP=['{stop}']
"""


def missing() -> str | None:
    """Return the reason why AUTO-07p cannot be run, or None."""
    if shutil.which("gfortran") is None:
        return "gfortran is not on the path"
    if not (LIBRARY / "main.o").exists():
        return f"no AUTO-07p in {LIBRARY} (apt-get install auto-07p, or set AUTO_DIR)"
    return None


@functools.cache
def build(statement: str) -> tuple[Path, float]:
    """Return the executable of one statement, and the seconds that compiling took. Removed when the process ends."""
    folder = tempfile.TemporaryDirectory(prefix="bench-auto-")
    _FOLDERS.append(folder)
    program = Path(folder.name) / "program"
    sources = [str(SOURCES / "ribbon.f90"), str(SOURCES / f"{statement}.f90")]
    objects = [str(path) for path in sorted(LIBRARY.glob("*.o"))]
    began = time.perf_counter()
    command = ["gfortran", "-O3", "-march=native", "-fopenmp", "-J", folder.name, *sources, *objects, "-o", str(program)]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode:
        raise RuntimeError(f"gfortran failed on {statement}.f90:\n{done.stderr}")
    return program, time.perf_counter() - began


_FOLDERS: list[tempfile.TemporaryDirectory] = []


def study(
    statement: str, stop: str = "BP", intervals=40, degree=4, tolerance=1e-10, longest_step=1.0, first_step=0.05, count=False
) -> dict:
    """Follow the circle through its bifurcation, and the branch to its first fold (``stop`` LP) or its end (BP).

    ``seconds`` is AUTO's own "Total Time" of the second run, ``circle_seconds`` of the first, ``process_seconds`` the wall
    clock of both processes. ``fold`` and ``end`` are in full precision. ``iterations`` are known with ``count`` only, which
    makes AUTO write its diagnostics.
    """
    program, _ = build(statement)
    ndim, nbc, free = SHAPES[statement]
    values = {"ndim": ndim, "nbc": nbc, "free": free, "intervals": intervals, "degree": degree, "tolerance": tolerance,
              "event_tolerance": 10 * tolerance, "longest_step": longest_step, "first_step": first_step,
              "diagnostics": 2 if count else 0}  # fmt: skip
    first = {"restart": 0, "switch": 1, "folds": 0, "branch_points": 1, "stop": "BP1"}
    second = {"restart": 2, "switch": -1, "folds": 1, "branch_points": 1 if stop == "BP" else 0, "stop": f"{stop}1"}
    with tempfile.TemporaryDirectory(prefix="bench-auto-") as name:
        folder = Path(name)
        circle = _run(program, folder, CONSTANTS.format(**values, **first))
        (folder / "fort.8").replace(folder / "fort.3")
        branch = _run(program, folder, CONSTANTS.format(**values, **second))
    folds = [value for label, value in branch["labels"] if label == "LP"]
    ends = [value for label, value in branch["labels"] if label == "BP"]
    return {
        "seconds": branch["seconds"], "circle_seconds": circle["seconds"],
        "process_seconds": circle["process_seconds"] + branch["process_seconds"],
        "points": branch["points"], "iterations": branch["iterations"], "labels": branch["labels"],
        "fold": in_full(branch, folds[0]) if folds else None,
        "end": in_full(branch, ends[-1]) if ends else None,
        "circle": circle["labels"][-1][1],
    }  # fmt: skip


def bratu(intervals: int, degree: int, tolerance: float, longest_step: float) -> dict:
    """Follow Bratu's problem from u = 0 to its fold; ``fold`` is in full precision."""
    values = {"ndim": 2, "nbc": 2, "free": "1", "restart": 0, "switch": 1, "folds": 1, "branch_points": 0, "stop": "LP1",
              "intervals": intervals, "degree": degree, "tolerance": tolerance, "event_tolerance": 10 * tolerance,
              "longest_step": longest_step, "first_step": 0.1, "diagnostics": 0}  # fmt: skip
    with tempfile.TemporaryDirectory(prefix="bench-auto-") as name:
        found = _run(build("bratu")[0], Path(name), CONSTANTS.format(**values))
    return found | {"fold": in_full(found, found["labels"][-1][1])}


def in_full(found: dict, known: float) -> float:
    """Return the first free parameter of a run in full precision where AUTO's own files have it with eleven digits."""
    return min((row[0] for row in found["trace"]), key=lambda value: abs(value - known))


def _run(program: Path, folder: Path, constants: str) -> dict:
    """Run AUTO once in a folder that may hold a restart file."""
    (folder / "fort.2").write_text(constants)
    (folder / "fort.97").unlink(missing_ok=True)
    environment = os.environ | {"OMP_NUM_THREADS": "1"}
    began, used = time.perf_counter(), _processor_seconds()
    done = subprocess.run([str(program)], cwd=folder, env=environment, capture_output=True, text=True, timeout=600)
    elapsed, used = time.perf_counter() - began, _processor_seconds() - used
    if done.returncode:
        raise RuntimeError(f"AUTO-07p failed:\n{done.stdout[-2000:]}\n{done.stderr[-2000:]}")
    written = (folder / "fort.97").read_text()
    parsed = parse((folder / "fort.7").read_text(), (folder / "fort.9").read_text(), done.stdout)
    rows = [tuple(map(float, line.split())) for line in written.splitlines()]
    return parsed | {"process_seconds": elapsed, "processor_seconds": used, "trace": rows}


def _processor_seconds() -> float:
    """Return the processor time of all child processes that have ended."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


#: AUTO's codes of special points in the branch file.
LABELS = {1: "BP", 2: "LP", 3: "HB", 4: "UZ", 5: "LP", 6: "BP", 9: "EP", -4: "UZ", -9: "MX"}


def parse(branch_file: str, diagnostics: str, printed: str) -> dict:
    """Return seconds, number of points, all Newton iterations (location of special points included) and labels of a run.

    Parameters
    ----------
    branch_file, diagnostics, printed : str
        AUTO's fort.7, fort.9 and standard output.

    Raises
    ------
    ValueError
        No "Total Time", or no points.
    """
    times = re.findall(r"Total Time\s+(\S+)", printed)
    rows = [line.split() for line in branch_file.splitlines()]
    rows = [row for row in rows if len(row) > 5 and row[0] not in ("0", "BR")]
    if not times or not rows:
        raise ValueError("AUTO-07p printed no total time or no points")
    iterations = len(re.findall(r"^\s+\d+\s+-?\d+\s+[1-9]\d*\s+[-+.\dE]+\s+[-+.\dE]+\s*$", diagnostics, re.MULTILINE))
    labels = [
        (LABELS.get(int(row[2]) % 10 if int(row[2]) > 0 else int(row[2]), "?"), float(row[4])) for row in rows if row[2] != "0"
    ]
    return {"seconds": float(times[-1]), "points": len(rows), "iterations": iterations, "labels": labels}
