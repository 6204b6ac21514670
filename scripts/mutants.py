"""Make wrong changes, one at a time, in a copy of this checkout, and tell which of them the default tests notice.

    python scripts/mutants.py              # all 17, some seven minutes on an idle machine
    python scripts/mutants.py A4 B2        # these only

Each change replaces a text in one file; then the tests that should notice run until the first of them fails. They must pass
without the change. The exit code is 1 if a change is not noticed.
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
#: Longest time in seconds for the tests of a change; one that makes them hang is noticed, too.
LONGEST = 900


@dataclass(frozen=True)
class Mutant:
    """A wrong change: what it does, the file, the text that is replaced, its replacement, and the tests that should notice."""

    what: str
    file: str
    text: str
    wrong: str
    tests: str


MUTANTS = {
    "A1": Mutant("flat rod's H has 1 - nu", "ribbon_model/laws.py", "M3 * (1 + nu) / 4", "M3 * (1 - nu) / 4",
                 "ribbon_model/test_laws.py ribbon_model/test_linear.py"),
    "A2": Mutant("sign in the ribbon's twisting modulus", "ribbon_model/laws.py", "2 * (1 - nu * kappa_n / bending)",
                 "2 * (1 + nu * kappa_n / bending)", "ribbon_model/test_linear.py"),
    "A3": Mutant("index counts pairs of modes once", "ribbon_model/stability.py", "entry.multiplicity * entry.negative",
                 "entry.negative", "ribbon_model/test_stability.py"),
    "A4": Mutant("sign of dead forces", "ribbon_model/statement.py",
                 "value - part * getattr(p, number) * ends.along", "value + part * getattr(p, number) * ends.along",
                 "ribbon_model/test_open_strip.py"),
    "A5": Mutant("wrong component in angles_of", "ribbon_model/ends.py", "math.atan2(-d[2], d[8])", "math.atan2(-d[2], d[7])",
                 "ribbon_model/test_changed_supports.py"),
    "B1": Mutant("resume keeps one solution too many", "branches/store/writer.py", 'index["point"] < points',
                 'index["point"] <= points', "branches/test_run.py"),
    "B2": Mutant("Newton's part of errors of found numbers x 100", "branches/scene/stage.py", "left = point.newton_error",
                 "left = 100 * point.newton_error", "branches/test_open_accuracy.py"),
    "B3": Mutant("upper end of --folds LOW HIGH less 1", "branches/graph/closed.py", '<= data["kappa_n"] <= high',
                 '<= data["kappa_n"] <= high - 1', "branches/test_diagram.py"),
    "B4": Mutant("bisection the wrong way", "branches/graph/interpolation.py", "before, middle, low), np.where(before,",
                 "~before, middle, low), np.where(~before,", "branches/test_diagram.py"),
    "B5": Mutant("1 mm is 10 mm", "branches/scene/units.py", '"mm": "1e-3"', '"mm": "1e-2"', "branches/test_strip.py"),
    "B6": Mutant("glTF files are mirrored", "branches/export/mesh_files.py", "[1, 1, -1]", "[1, 1, 1]",
                 "branches/test_export.py"),
    "B7": Mutant("unfinished branches of a sweep count as complete", "branches/run/many.py", 'if branch.status == "complete":',
                 "if branch.status:", "branches/test_diagram.py"),
    "B8": Mutant("exact solution of the page off by 1e-6", "branches/explore/exact.js", "(c * (1 - beta)) /",
                 "(1.000001 * c * (1 - beta)) /", "branches/test_explore.py"),
    "B9": Mutant("exact solution of the page off by 1 %", "branches/explore/exact.js", "(c * (1 - beta)) /",
                 "(1.01 * c * (1 - beta)) /", "branches/test_explore.py"),
    "C1": Mutant("level LOCATED x 100", "contin/levels.py", "\nLOCATED = 1e-9\n", "\nLOCATED = 1e-7\n",
                 "contin/continuation/test_bank.py"),
    "C2": Mutant("refinement stops after one halving", "contin/events/refinement.py", "\n_HALVINGS = 4\n", "\n_HALVINGS = 1\n",
                 "contin/events/test_refinement.py contin/continuation/test_bank.py"),
    "C3": Mutant("multiple branch points are not reported", "contin/events/inspection.py",
                 "found.append(self.branch_points.multiple)", "pass", "contin/events/test_random_equilibria.py"),
}  # fmt: skip


def copied(folder: Path) -> None:
    """Copy the files of this checkout that git knows, as they are now."""
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    for name in filter(None, listed.split("\0")):
        if os.path.lexists(ROOT / name):
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, folder / name, follow_symlinks=False)


def noticed(mutant: Mutant, folder: Path) -> str:
    """Return the first test that fails with a wrong change in the copy; empty if none does."""
    tests = [str(Path("tests") / name) for name in mutant.tests.split()]
    command = [sys.executable, "-m", "pytest", "-x", "-q", "-n", "0", "--tb=no", "-p", "no:cacheprovider", *tests]
    path, environment = folder / mutant.file, {**os.environ, "PYTHONPATH": str(folder)}
    right = path.read_text(encoding="utf-8")
    path.write_text(right.replace(mutant.text, mutant.wrong), encoding="utf-8")
    try:
        done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, timeout=LONGEST)
    except subprocess.TimeoutExpired:
        return f"no end within {LONGEST} s"
    finally:
        path.write_text(right, encoding="utf-8")
    found = re.search(r"^(?:FAILED|ERROR) tests/(.*?)(?: - .*)?$", done.stdout, re.MULTILINE)
    if done.returncode not in (0, 1) and not found:
        raise SystemExit(f"pytest has not run:\n{done.stdout}{done.stderr}")
    return found[1] if found else ""


def main(arguments=None) -> int:
    """Return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"wrong changes, of {', '.join(MUTANTS)}; all by default")
    names = parser.parse_args(arguments).names or list(MUTANTS)
    if unknown := [name for name in names if name not in MUTANTS]:
        parser.error(f"NAME: {unknown[0]!r} must be one of {', '.join(MUTANTS)}")
    for name in names:
        mutant = MUTANTS[name]
        count = (ROOT / mutant.file).read_text(encoding="utf-8").count(mutant.text)
        if count != 1:
            shown = f"{mutant.file} holds {mutant.text.strip()!r} {count} times, not once"
            parser.error(f"{name}: {shown}; change its line in scripts/mutants.py")
    print("| | wrong change | noticed by | seconds |", "|---|---|---|---|", sep="\n")
    caught = 0
    with tempfile.TemporaryDirectory() as folder:
        copied(Path(folder))
        for name in names:
            began, mutant = time.monotonic(), MUTANTS[name]
            test = noticed(mutant, Path(folder))
            caught += bool(test)
            row = f"| {name} | {mutant.what}, {mutant.file} | {test or 'nothing'} | {time.monotonic() - began:.0f} |"
            print(row, flush=True)
    print(f"\n{caught} of {len(names)} wrong changes are noticed")
    return int(caught < len(names))


if __name__ == "__main__":
    sys.exit(main())
