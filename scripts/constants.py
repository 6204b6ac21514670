"""Measure levels of error and private constants of contin: changes on the bank if one is ten times larger, or smaller.

    python scripts/constants.py                 # all of them, a line each; takes minutes
    python scripts/constants.py _FAR _CHORDS    # these only

A line says how many of the bank's runs then miss a special point, find one too many or misplace one by more than 1e-9, and how
the number of matrices changes that are factored outside kernels: where steps are looked at, and points located.
"""

from __future__ import annotations

import argparse
import ast
import functools
import importlib
import json
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
#: Rooms whose constants do not decide what a run does: they are sizes of tables and of vectors.
OTHERS = ("functions", "kernels", "linalg", "problems", "results")
#: Runs of the bank that take longer than the others together.
SLOW = ("kar", "bru", "spb")


def constants() -> Iterator[tuple[str, str]]:
    """Yield (module, name) of every level of error, and of every private constant that is a number."""
    for name, value in vars(importlib.import_module("contin.levels")).items():
        if isinstance(value, float):
            yield "contin.levels", name
    for path in sorted((ROOT / "contin").glob("*/*.py")):
        if path.parent.name in OTHERS:
            continue
        for node in ast.parse(path.read_text()).body:
            if isinstance(node, ast.Assign):
                names = [name.id for target in node.targets for name in ast.walk(target) if isinstance(name, ast.Name)]
                values = node.value.elts if isinstance(node.value, ast.Tuple) else [node.value]
                if all(isinstance(value, ast.Constant) and isinstance(value.value, (int, float)) for value in values):
                    yield from ((f"contin.{path.parent.name}.{path.stem}", name) for name in names if name.startswith("_"))


def bank() -> dict[str, int]:
    """Run the bank and return the numbers of runs, of wrong ones, of points and of factorizations."""
    sys.path.insert(0, str(ROOT))
    import contin

    case = importlib.import_module("bank.case")
    count = {"runs": 0, "wrong": 0, "points": 0, "factorizations": 0}
    for kind in (contin.lowlevel.Collocation, contin.lowlevel.Algebraic):
        kind.linearize = _counted(kind.linearize, count)
    for path in sorted((ROOT / "bank").glob("*.py")):
        for known in getattr(importlib.import_module(f"bank.{path.stem}"), "CASES", ()):
            if known.name.split()[0].split("-")[0] in SLOW or path.stem in SLOW:
                continue
            count["runs"] += 1
            try:
                case.check(known)
            except (AssertionError, contin.ContinError):
                count["wrong"] += 1
    return count


def _counted(linearize, count):
    @functools.wraps(linearize)
    def counted(*arguments, **options):
        count["factorizations"] += 1
        return linearize(*arguments, **options)

    return counted


def main() -> int:
    sys.path.insert(0, str(ROOT))
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", help="constants; all by default")
    parser.add_argument("--one", nargs=3, metavar=("MODULE", "NAME", "FACTOR"), help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.one:
        module, name, factor = arguments.one
        if module:
            changed = importlib.import_module(module)
            setattr(changed, name, type(getattr(changed, name))(getattr(changed, name) * float(factor)))
        print(json.dumps(bank()))
        return 0
    usual = _run("", "", 1)
    print(f"as it is: {usual['runs']} runs, {usual['wrong']} wrong, {usual['factorizations']} factorizations")
    for module, name in constants():
        if arguments.names and name not in arguments.names:
            continue
        said = []
        for factor in (10, 0.1):
            found = _run(module, name, factor)
            said.append(f"x{factor:<4g} {_compared(found, usual) if found else 'fails'}")
        print(f"{module.removeprefix('contin.'):28} {name:18} {'   '.join(said)}", flush=True)
    return 0


def _compared(found: dict[str, int], usual: dict[str, int]) -> str:
    return f"{found['wrong'] - usual['wrong']:3d} wrong, work {found['factorizations'] / usual['factorizations']:.2f}"


def _run(module: str, name: str, factor: float) -> dict[str, int]:
    done = subprocess.run(
        [sys.executable, __file__, "--one", module, name, str(factor)], capture_output=True, text=True, timeout=900
    )
    return json.loads(done.stdout.splitlines()[-1]) if done.returncode == 0 else {}


if __name__ == "__main__":
    sys.exit(main())
