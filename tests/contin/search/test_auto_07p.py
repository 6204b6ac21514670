"""Branches of AUTO-07p: read from stored files, and from files that AUTO writes here; runs go on from their labels.

The stored files are what ``auto_07p/write.py`` wrote with AUTO-07p 0.9.2 of Debian.
"""

import dataclasses
import importlib.util
import math
import shutil
from pathlib import Path

import numpy as np
import pytest

from contin import AlgebraicProblem, BoundaryValueProblem, ConvergenceError, CycleProblem, ProblemError, solve, trace
from contin.auto07p import AutoSolution, from_auto, read_auto  # fmt: skip

STORED = Path(__file__).parent / "auto_07p"
#: The fold of Bratu's problem, from its closed form.
BRATU = 3.513830719125161


def ab(u, p):
    reaction = p.p1 * (1 - u.x) * math.exp(u.y)
    return reaction - u.x, p.p2 * reaction - 4 * u.y


EQUILIBRIA = AlgebraicProblem(ab, ["x", "y"], {"p1": 0.0, "p2": 14.0})
NAMES = {1: "p1", 2: "p2"}


def bratu():
    return BoundaryValueProblem(
        lambda t, u, p: (u.v, -p.lam * math.exp(u.u)), lambda a, b, p: (a.u, b.u), states=["u", "v"], parameters={"lam": 0.0}
    )


def test_columns_and_labels_of_equilibria():
    (branch,) = read_auto(STORED, "rest", parameters=NAMES)
    assert list(branch.columns) == ["p1", "L2-NORM", "U(1)", "U(2)"] and len(branch) == len(branch.labels) == 41
    assert list(filter(None, branch.labels)) == ["EP", "HB", "HB", "UZ"]
    norm = np.hypot(branch.columns["U(1)"], branch.columns["U(2)"])
    assert np.allclose(branch.columns["L2-NORM"], norm, rtol=1e-9)
    first, second = branch.labelled("HB")
    assert (first.number, second.number) == (2, 3) and first.states.shape == (1, 2)
    places = [i for i, label in enumerate(branch.labels) if label == "HB"]
    assert [first.parameters["p1"], second.parameters["p1"]] == branch.columns["p1"][places].tolist()


def test_a_solution_on_a_mesh_and_names_that_auto_was_given():
    (branch,) = read_auto(STORED, "bratu")
    fold = branch.labelled("LP")[0]
    assert "lam" in branch.columns and abs(fold.parameters["lam"] - BRATU) < 1e-6
    assert (fold.intervals, fold.degree, fold.t.shape, fold.states.shape) == (20, 4, (81,), (81, 2))
    assert fold.t[0] == 0 and fold.t[-1] == 1 and np.abs(fold.states[[0, -1], 0]).max() < 1e-8


def test_a_run_goes_on_from_a_hopf_point():
    branch = read_auto(STORED, "rest", parameters=NAMES)[0]
    for solution in branch.labelled("HB"):
        hopf = from_auto(EQUILIBRIA, solution, free=["p1"])
        assert hopf.label == "HB" and abs(hopf["p1"] - solution.parameters["p1"]) < 1e-6
    cycles = trace(hopf, branch=1, max_points=3)
    assert cycles.points[-1]["max_x"] > cycles.points[-1]["min_x"]


def test_a_cycle_is_a_guess_and_a_point():
    solution = read_auto(STORED, "cycles", parameters=NAMES)[0].labelled("UZ")[0]
    point = from_auto(CycleProblem.of(EQUILIBRIA), solution, free=["p1"])
    assert abs(point["period"] - 7.1) < 1e-3 and point["p1"] == pytest.approx(solution.parameters["p1"], abs=1e-12)


def test_a_fold_is_located_and_the_run_goes_on():
    problem, solutions = bratu(), read_auto(STORED, "bratu")[0].solutions
    fold = from_auto(problem, next(s for s in solutions if s.label == "LP"), free=["lam"])
    assert fold.label == "LP" and abs(fold["lam"] - BRATU) < 1e-11
    lower, upper = (s for s in solutions if s.label == "UZ")
    low, high = (from_auto(problem, solution, free=["lam"]) for solution in (lower, upper))
    passed = trace(low, limits={"lam": (1.0, 4.0)}, zeros={"lam": [2.0]})
    assert abs(passed.labelled("LP")[0]["lam"] - BRATU) < 1e-11
    (beyond,) = [point for point in passed.labelled("UZ") if point["lam"] == pytest.approx(2, abs=1e-9)][-1:]
    middle = [point.system.evaluate(point.x, np.array([0.5]))[0, 0] for point in (beyond, high)]
    assert middle[0] == pytest.approx(middle[1], abs=1e-6)  # AUTO locates lam = 2 to 4e-7
    again = solve(problem, (upper.t, upper.states), {"lam": 2.0})
    assert again.system.evaluate(again.x, np.array([0.5]))[0, 0] == pytest.approx(middle[0], abs=1e-8)


def test_runs_that_were_appended_are_branches_each(tmp_path):
    for letter in "bs":
        (tmp_path / f"{letter}.both").write_text(
            "".join((STORED / f"{letter}.{run}").read_text(encoding="utf-8") for run in ("rest", "cycles")), encoding="utf-8"
        )
    rest, cycles = read_auto(tmp_path, "both", parameters=NAMES)
    assert (len(rest.solutions), len(cycles.solutions)) == (4, 1) and "PERIOD" in cycles.columns


def test_fort_files_of_a_folder(tmp_path):
    shutil.copy(STORED / "b.rest", tmp_path / "fort.7")
    shutil.copy(STORED / "s.rest", tmp_path / "fort.8")
    assert len(read_auto(tmp_path)[0]) == 41


def test_numbers_of_fortran_with_three_digits_of_exponent(tmp_path):
    for letter in "bs":
        text = (STORED / f"{letter}.rest").read_text(encoding="utf-8")
        (tmp_path / f"{letter}.x").write_text(text.replace("0.0000000000E+000", "1.0000000000-100"), encoding="utf-8")
    (branch,) = read_auto(tmp_path, "x")
    assert branch.columns["PAR(1)"][0] == 1e-100 == branch.solutions[0].states[0, 0]


MISTAKES = {
    "other equations": (lambda s: from_auto(_other(), s, free=["p1"]), ConvergenceError, "compare the equations|converge"),
    "no name": (lambda s: from_auto(_other("k"), s, free=["k"]), ProblemError, "has no parameter 'k'; give its number"),
    "states": (lambda s: from_auto(bratu(), _three(s), free=["lam"]), ProblemError, "3 states must be 2"),
    "no mesh": (lambda s: from_auto(bratu(), s, free=["lam"], parameters={"lam": 1}), ProblemError, "is an equilibrium"),
    "no solution": (lambda s: from_auto(EQUILIBRIA, 3, free=["p1"]), ProblemError, "solution: 3 must be an AutoSolution"),
}


def _other(name="p1"):
    return AlgebraicProblem(lambda u, p: (p[0] + u.x**2 + 1, u.y), ["x", "y"], {name: 0.0})


def _three(solution):
    return dataclasses.replace(solution, states=np.zeros((1, 3)))


@pytest.mark.parametrize(("call", "kind", "said"), MISTAKES.values(), ids=MISTAKES.keys())
def test_what_cannot_be_is_said(call, kind, said):
    hopf = read_auto(STORED, "rest", parameters=NAMES)[0].labelled("HB")[0]
    with pytest.raises(kind, match=said):
        call(hopf)


@pytest.mark.parametrize("text", ["", "hello\n", "   1     1   9    1  0.0E+00\n", "   0  nothing\n"])
def test_a_file_that_is_none_of_auto_is_named(tmp_path, text):
    (tmp_path / "b.x").write_text(text)
    (tmp_path / "s.x").write_text("")
    with pytest.raises(ProblemError, match="b.x' is no file of branches of AUTO-07p"):
        read_auto(tmp_path, "x")
    shutil.copy(STORED / "b.rest", tmp_path / "b.x")
    (tmp_path / "s.x").write_text("1 2 3\n")
    with pytest.raises(ProblemError, match="s.x' is no file of solutions"):
        read_auto(tmp_path, "x")
    with pytest.raises(FileNotFoundError):
        read_auto(tmp_path, "none")
    with pytest.raises(ProblemError, match="parameters: .* must be a dict from whole numbers to names"):
        read_auto(STORED, "rest", parameters={"p1": 1})


def test_auto_writes_what_is_stored(tmp_path):
    """The columns agree to AUTO's tolerances, with whatever version of AUTO-07p is installed."""
    spec = importlib.util.spec_from_file_location("write", STORED / "write.py")
    program = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(program)
    if reason := program.missing():
        pytest.skip(f"AUTO-07p cannot run: {reason}")
    program.write(tmp_path)
    for run in program.RUNS:
        (here,), (stored,) = read_auto(tmp_path, run), read_auto(STORED, run)
        assert here.labels == stored.labels and list(here.columns) == list(stored.columns)
        for name in here.columns:
            assert np.allclose(here.columns[name], stored.columns[name], rtol=1e-5, atol=1e-5)
        for one, other in zip(here.solutions, stored.solutions):
            assert np.allclose(one.states, other.states, rtol=1e-5, atol=1e-5)


@pytest.mark.parametrize(("x", "a"), [(0.0, 1e-5), (0.0, -1e-5), (1e-3, 1e-6), (0.0, 0.0)])
def test_a_branch_point_that_auto_located_roughly(x, a):
    """The pitchfork a x - x^3 at 0; AUTO's default tolerance of special points is 1e-4."""
    pitchfork = AlgebraicProblem(lambda u, p: (u.x * (p.a - u.x**2),), ["x"], {"a": 0.0})
    found = AutoSolution("BP", 7, {"a": a}, np.zeros(1), np.array([[x]]), 1, 0)
    point = from_auto(pitchfork, found, free=["a"])
    assert point.label == "BP" and abs(point["a"]) < 1e-8
    assert len(trace(point, branch=1, max_points=3)) == 4
