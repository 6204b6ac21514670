"""New problems: processor time from the statement to the first solution, and ns a point for f and its Jacobian.

Kernels of the engine are compiled before. A process solves every program of `benchmarks.statements` once, which loads
modules, and then again with functions that it has not seen: they are made by ``exec``, and a name in them is a new one each
time, so that nothing that was kept for other functions serves them. With ``--before`` an earlier version of contin runs the
same programs, in turns with this one. Times are processor times, so that other programs hardly matter.
"""

from __future__ import annotations

import importlib
import json
import math
import os
import re
import subprocess
import sys
import time
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.measure import SCRIPTS, child, in_turn, median
from benchmarks.statements import LARGE, NEWCOMERS, VARIATIONAL, Statement

#: Groups of programs, by the name in the table.
GROUPS = {"docs/outside.md": NEWCOMERS, "variational": VARIATIONAL, "large": LARGE}
#: Seconds after which a program is not run a second time: loading modules is then a small part of it.
LONG = 5.0
#: Seconds up to which the median of three runs counts.
SHORT = 1.0
#: Points of a 40 x 4 mesh.
POINTS = 160
#: Most states of a vector field of the bank whose cycles are evaluated: larger ones are grids, of which steady states count.
FEW = 5
#: Calls whose median counts: 160 points take 2 to 600 us.
CALLS = 200


def run(quick: bool, before: str | None = None, before_python: str = sys.executable) -> dict:
    """Return times of this version, and of an earlier one in the folder ``before``."""
    versions: dict[str, tuple[str, str]] = {"now": (sys.executable, str(SCRIPTS.parent))}
    if before is not None:
        versions["before"] = (before_python, str(Path(before).resolve()))
    firsts = _in_turn("first_solutions", versions, 1 if quick else 3)
    slopes = _in_turn("evaluations", versions, 1 if quick else 3)
    return {
        "first": _joined(firsts),
        "ns": _joined(slopes),
        "versions": {name: _commit(at) for name, (_, at) in versions.items()},
    }


def _in_turn(what: str, versions: dict[str, tuple[str, str]], repeats: int) -> dict[str, list[dict]]:
    """Run one of the functions below in a process of each version, in turns, after one process that compiles the engine."""
    calls: dict[str, Callable[[], dict]] = {}
    for name, (python, folder) in versions.items():
        path = os.pathsep.join([str(SCRIPTS), folder])
        calls[name] = lambda python=python, path=path: child(
            python, "-m", "benchmarks.problems", what, timeout=7200, PYTHONPATH=path, PYTHONSAFEPATH="1"
        )
    for call in calls.values() if what == "first_solutions" else ():
        call()
    return in_turn(calls, repeats)


def _joined(runs: dict[str, list[dict]]) -> list[dict]:
    """Return a row for every case, with the median of each version; None where a version does not compute it."""
    rows = []
    for name in runs["now"][0]["times"]:
        row: dict[str, Any] = {"name": name}
        for version, some in runs.items():
            times = [one["times"].get(name) for one in some]
            row[version] = None if None in times else median(times)
        rows.append(row)
    return rows


def _commit(folder: str) -> str:
    done = subprocess.run(["git", "-C", folder, "rev-parse", "--short=7", "HEAD"], capture_output=True, text=True)
    return done.stdout.strip() or "unknown"


# --- in a process of its own ------------------------------------------------------------------------------------------------


def first_solutions() -> dict[str, float | None]:
    """Return the seconds to the first solution of every program; None for one that fails or gives another solution."""
    return {statement.name: _seconds(statement) for group in GROUPS.values() for statement in group}


def _seconds(statement: Statement) -> float | None:
    try:
        first = time_of(statement, 0)
        if first > LONG:
            return first
        return median(time_of(statement, number + 1) for number in range(1 if first > SHORT else 3))
    except Exception as error:  # an earlier version may fail in any way; the row says that it did
        print(f"{statement.name}: {type(error).__name__}: {error}", file=sys.stderr)
        return None


def time_of(statement: Statement, number: int) -> float:
    """Run a program; return its processor time.

    Raises
    ------
    AssertionError
        It found another solution than the known one.
    """
    import contin

    scope: dict[str, Any] = {"np": np, "math": math, "contin": contin}
    exec(statement.setup, scope)
    code = compile(renamed(statement, f"_{os.getpid()}_{number}"), f"<{statement.name}, {number}>", "exec")
    began = time.process_time()
    exec(code, scope)
    seconds = time.process_time() - began
    found = scope["found"]
    scope |= known()
    scope["u"] = lambda t: found.system.evaluate(found.x, np.array([float(t)]))[0]
    assert eval(statement.check, scope), f"{statement.name}: not the known solution"
    return seconds


def renamed(statement: Statement, end: str) -> str:
    """Return the text with another name in the place of the statement's word; as an argument p, it stays in strings."""
    if statement.word in ("p", "par"):
        return re.sub(rf"(?<![\w.\"']){statement.word}(?![\w\"'])", statement.word + end, statement.text)
    return re.sub(rf"\b{statement.word}\b", statement.word + end, statement.text)


def known() -> dict[str, Any]:
    """Return what the checks compare with: closed forms, and values by SciPy."""
    from scipy.special import ellipk

    return {"PENDULUM": lambda angle: 2 * ellipk(math.sin(angle / 2) ** 2), **VALUES}


#: Values of states: by SciPy's ``solve_bvp`` (tolerance 1e-9), ``solve_ivp`` (DUFFING, SEGMENTS; 1e-11) and quadrature.
VALUES = {
    "CARRIER": 1.1826367428908058, "BEAM": 0.10897520674722777, "BALL": 0.19026604075910902, "DUFFING": 0.13125356175216277,
    "QUARTIC": 0.19767652245091122, "CATENARY": -0.2923437976009286, "SEGMENTS": 0.09105277274803104,
}  # fmt: skip


def evaluations() -> dict[str, float | None]:
    """Return the ns that f and its Jacobian take a point, for problems of the test bank and for the strip's laws."""
    return {name: _nanoseconds(*given) for name, *given in (*_of_bank(), *_of_laws())}


def _nanoseconds(problem: Any, t: Any, u: Any, p: Any) -> float | None:
    batch = problem.batch("rhs")
    columns = (batch.columns if hasattr(batch, "columns") else batch.colouring)([0])
    none, times = np.empty((0, u.shape[1])), []
    for _ in range(CALLS):
        began = time.process_time_ns()
        batch.jacobian(t, u, none, p, columns)
        times.append(time.process_time_ns() - began)
    return median(times) / len(u)


def _of_bank() -> Iterator[tuple[str, Any, Any, Any, Any]]:
    """The boundary value problems of the test bank, and cycles of its small vector fields, at states near .5."""
    import contin

    table = importlib.import_module("bank.table")
    random = np.random.default_rng(1)
    for module in (importlib.import_module(f"bank.{name}") for name in (*table.BANK, *table.OUTSIDE)):
        for name, value in vars(module).items():
            problem = value() if name == "problem" else value
            title = module.__name__.removeprefix("bank.") + ("" if name == "problem" else f": {name.lower()}")
            if isinstance(problem, contin.AlgebraicProblem) and problem.dynamics and len(problem.state_names) <= FEW:
                title += ", cycle"
                problem = contin.CycleProblem(problem.residual, problem.state_names, problem.parameters)
            if isinstance(problem, contin.BoundaryValueProblem):
                n, p = len(problem.state_names), np.array(list(problem.parameters.values()), dtype=float)
                yield title, problem, np.linspace(*problem.domain, POINTS), random.uniform(0.3, 0.7, (POINTS, n)), p


def _of_laws() -> Iterator[tuple[str, Any, Any, Any, Any]]:
    """The strip's laws on a cell (without force) and on a half loop (with force), on the circle at kappa_n = .5."""
    from ribbon_model.domains import CELL, HALF_LOOP
    from ribbon_model.laws import LAWS

    for law in LAWS.values():
        for domain, forces in ((CELL, "without force"), (HALF_LOOP, "with force")):
            system = domain.discretize(law, 40, 4, law.defaults | {"kappa_n": 0.5})
            x = domain.circle(system, 1, 0.5)
            u = np.ascontiguousarray(system.states(x)[:POINTS])
            yield (
                f"{law.name}, {forces}",
                system.problem,
                np.ascontiguousarray(system.nodes[:POINTS]),
                u,
                system.all_parameters(x),
            )


# --- the tables -------------------------------------------------------------------------------------------------------------


def table(results: dict) -> str:
    """Return the results as Markdown."""
    both = "before" in results["versions"]
    versions = ", ".join(f"{name}: {commit}" for name, commit in results["versions"].items())
    lines = [
        *_summary(results["first"], both),
        "",
        "| first solution of | now |" + (" before | before / now |" if both else ""),
    ]
    lines += ["|---|---|" + ("---|---|" if both else ""), *(_line(row, both, "ms", 1e3) for row in results["first"])]
    lines += [
        "",
        "| f and J | now |" + (" before | before / now |" if both else ""),
        "|---|---|" + ("---|---|" if both else ""),
    ]
    lines += [_line(row, both, "ns", 1.0) for row in results["ns"]]
    return "\n".join([*lines, "", f"Commits: {versions}. Times are processor times."])


def _summary(rows: list[dict], both: bool) -> list[str]:
    lines = ["| first solution | version | median | worst | without a time |", "|---|---|---|---|---|"]
    for group, statements in GROUPS.items():
        names = {statement.name for statement in statements}
        for version in ("now", "before")[: 1 + both]:
            times = [row[version] for row in rows if row["name"] in names]
            solved = [1e3 * time for time in times if time is not None]
            if solved:
                ends = f"{median(solved):.0f} ms | {max(solved):.0f} ms"
                lines.append(f"| {group} | {version} | {ends} | {len(times) - len(solved)} |")
    return lines


def _line(row: dict, both: bool, unit: str, factor: float) -> str:
    cells = [
        f"{factor * row[version]:.0f} {unit}" if row[version] is not None else "–" for version in ("now", "before")[: 1 + both]
    ]
    if both:
        cells.append(f"{row['before'] / row['now']:.1f}" if row["now"] and row["before"] else "–")
    return f"| {row['name']} | {' | '.join(cells)} |"


def main() -> None:
    """Print the times of ``first_solutions`` or ``evaluations`` as JSON."""
    warnings.simplefilter("ignore")  # what an earlier version evaluates in Python, it says
    print(json.dumps({"times": {"first_solutions": first_solutions, "evaluations": evaluations}[sys.argv[1]]()}))


if __name__ == "__main__":
    main()
