"""AUTO-07p's demos, run by AUTO's own front end from their own scripts and constants.

AUTO's front end starts each run of a demo as the command ``PREFIX ./demo.exe`` and writes the constants and the first solution
to its standard input. The prefix here is this file: it runs the executable, measures its processor time, and notes the labelled
points that AUTO writes to ``fort.7``. On request it first asks for tighter tolerances and a finer mesh; nothing else of the
demo is changed.
"""

from __future__ import annotations

import json
import os
import re
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

AUTO = Path(os.environ.get("AUTO_DIR", "/usr/lib/auto-07p"))
#: Width in characters of a column of AUTO's files of branches; the first holds branch, point, type and label.
WIDTH = 19
#: Seconds by which the clock of the file system may lie behind.
CLOCK = 0.1
#: Most processor seconds of one run of a demo.
LONGEST = 60
#: AUTO's front end without pictures: where it finds matplotlib, but no screen, a script that draws stops there.
FRONT_END = (
    "import runpy, sys; sys.modules['matplotlib'] = None; sys.argv = ['auto', {script!r}]; "
    "runpy.run_module('auto', run_name='__main__')"
)
LABELS = {
    0: "", 1: "BP", 2: "LP", 3: "HB", 4: "RG", 5: "LP", 6: "BP", 7: "PD", 8: "TR", 9: "EP",
    -1: "BT", -2: "CP", -3: "ZH", -4: "UZ", -5: "R1", -6: "R2", -7: "R3", -8: "R4", -9: "MX", -32: "GH",
    23: "LTR", 77: "PTR", 28: "LPD", 88: "TTR",
}  # fmt: skip
#: Constants of finer runs, which replace the demo's own, and the number by which intervals are multiplied. At the tightest
#: tolerances AUTO does not find all points, in silence; the second and the third are for these.
FINER = (
    ({"EPSL": "1e-11", "EPSU": "1e-11", "EPSS": "1e-09", "ITMX": "20", "ITNW": "9"}, 4),
    ({"EPSL": "1e-09", "EPSU": "1e-09", "EPSS": "1e-07", "ITMX": "20", "ITNW": "9"}, 3),
    ({}, 4),
)


def missing() -> str | None:
    """Return the reason why AUTO-07p cannot be run, or None."""
    if shutil.which("gfortran") is None:
        return "gfortran is not on the path"
    if not (AUTO / "lib" / "main.o").exists():
        return f"no AUTO-07p in {AUTO} (apt-get install auto-07p gfortran, or set AUTO_DIR)"
    return None


def run(demos: Path, name: str, script: str, level: int = -1, timeout: float = 600) -> list[dict]:
    """Run one script of a demo; return its runs: constants, seconds of the processor, columns and labelled points.

    Parameters
    ----------
    demos : Path
        The folder ``demos`` of AUTO's distribution. It is not changed: the demo runs in a copy.
    name, script : str
        The demo's folder, and the script in it.
    level : int
        Which of ``FINER``: tighter tolerances and a finer mesh; none for -1.
    """
    with tempfile.TemporaryDirectory(prefix="demo-") as temporary:
        folder = Path(temporary) / name
        shutil.copytree(demos / name, folder)
        log = Path(temporary) / "runs.jsonl"
        words = [sys.executable, str(Path(__file__).resolve()), str(log), str(level), "--"]
        environment = os.environ | {
            "AUTO_DIR": str(AUTO), "AUTO_COMMAND_PREFIX": " ".join(words), "PYTHONPATH": str(AUTO / "python"),
            "OMP_NUM_THREADS": "1",
        }  # fmt: skip
        command = [sys.executable, "-c", FRONT_END.format(script=script)]
        done = subprocess.run(
            command, cwd=folder, env=environment, stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=timeout
        )
        text = log.read_text() if log.exists() else ""
        runs = [json.loads(line) for line in text.splitlines()]
        if not runs:
            raise RuntimeError(f"AUTO ran nothing of {name}:\n{done.stdout[-2000:]}\n{done.stderr[-2000:]}")
        return runs


def run_finer(demos: Path, name: str, script: str, runs: list[dict]) -> list[dict]:
    """Run a demo with finer constants: each of its runs at the finest level at which AUTO finds as many points, or most."""
    found = []
    for level in range(len(FINER)):
        try:
            found.append(run(demos, name, script, level))
        except (RuntimeError, subprocess.TimeoutExpired) as error:
            print(f"{name}: no finer run {level}: {type(error).__name__}", file=sys.stderr)
            continue
        if len(found[-1]) == len(runs) and all(count(one) >= count(own) for one, own in zip(found[-1], runs)):
            break
    best = []
    for number, own in enumerate(runs):
        tries = [each[number] for each in found if number < len(each)]
        alike = [each for each in tries if each["constants"]["ICP"] == own["constants"]["ICP"]]
        wanted = count(own)
        enough = [each for each in alike if count(each) >= wanted]
        empty = {"constants": own["constants"], "seconds": 0.0, "points": []}
        best.append(enough[0] if enough else max(alike, key=count, default=empty))
    return best


def count(run: dict) -> int:
    """Return the number of special points of a run."""
    return sum(point["label"] not in ("", "RG", "EP", "MX") for point in run["points"])


# --- the prefix -------------------------------------------------------------------------------------------------------


def finer(constants: str, level: int) -> str:
    """Return AUTO's constants with tighter tolerances and more intervals."""
    changes, times = FINER[level]
    for key, value in changes.items():
        if constant(constants, key):
            constants = re.sub(rf"\b{key}\s*=\s*[-+.\deEdD]+", f"{key}={value}", constants)
        else:
            constants += f"{key}={value}\n"
    return re.sub(r"\bNTST\s*=\s*(\d+)", lambda found: f"NTST={times * int(found[1])}", constants)


def constant(constants: str, key: str) -> str:
    """Return the text of one of AUTO's constants, empty if it is not stated."""
    found = re.search(rf"(?<![A-Za-z]){key}\s*=\s*(\[[^\]]*\]|[^\s,]+)", constants)
    return found[1] if found else ""


def parse(text: str) -> tuple[list[str], list[dict]]:
    """Return the columns of AUTO's file of branches, and its labelled points."""
    columns: list[str] = []
    points = []
    for line in text.splitlines():
        cells = [line[place : place + WIDTH].strip() for place in range(WIDTH, len(line), WIDTH)]
        first = line[:WIDTH]
        if first.split()[:1] == ["0"]:
            if "TY" in first:
                columns = cells
            continue
        branch, point, kind, label = (int(first[a:b]) for a, b in ((0, 4), (4, 10), (10, 14), (14, 19)))
        if label:
            values = dict(zip(columns, map(number, cells)))
            points.append({"branch": branch, "point": point, "label": name_of(kind), "values": values})
    return columns, points


def number(text: str) -> float:
    """Return a number that Fortran wrote; exponents of three digits lack their letter."""
    return float(re.sub(r"(?<=\d)([-+]\d{3})$", r"E\1", text.replace("D", "E")))


def name_of(kind: int) -> str:
    """Return the letters of one of AUTO's codes of points."""
    if kind in (-32, 23, 28, 77, 88):
        return LABELS[kind]
    return LABELS.get(kind % 10 if kind >= 0 else -(-kind % 10), "?")


def branches_written(constants: str, began: float) -> str:
    """Return the file of branches that a run wrote: ``fort.7``, or the one that its constants name; empty if there is none."""
    name = constant(constants, "sv").strip("'\"")
    files = [Path(file) for file in ("fort.7", f"b.{name}") if Path(file).exists()]
    files = [file for file in files if file.stat().st_mtime >= began - CLOCK]
    return max(files, key=lambda file: file.stat().st_mtime).read_text() if files else ""


def execute(log: Path, level: int, command: list[str]) -> int:
    """Run AUTO's executable on the constants and the solution from standard input; note what it found."""
    given = sys.stdin.buffer.read()
    end = given.index(b"s='/'")
    constants = given[:end].decode()
    if level >= 0:
        constants = finer(constants, level)
    began = time.time()
    done = subprocess.run(
        command, input=constants.encode() + given[end:], stdout=subprocess.PIPE,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_CPU, (LONGEST, LONGEST)),
    )  # fmt: skip
    sys.stdout.buffer.write(done.stdout)
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    columns, points = parse(branches_written(constants, began))
    keys = "NDIM", "IPS", "ISW", "ISP", "ILP", "NTST", "NCOL", "ICP", "IRS", "EPSL", "EPSS"
    note = {
        "constants": {key: constant(constants, key) for key in keys}, "seconds": used.ru_utime + used.ru_stime,
        "failed": done.returncode, "columns": columns, "points": points,
    }  # fmt: skip
    with log.open("a") as file:
        file.write(json.dumps(note) + "\n")
    return done.returncode


if __name__ == "__main__":
    split = sys.argv.index("--")
    sys.exit(execute(Path(sys.argv[1]), int(sys.argv[2]), sys.argv[split + 1 :]))
