"""Branches in files."""

import math

import numpy as np
import pytest

from contin import AlgebraicProblem, BoundaryValueProblem, ProblemError, load, save, solve, trace


def elastica():
    return BoundaryValueProblem(
        lambda t, u, p: (u.v, -p.lam * math.sin(u.theta)), lambda a, b, p: (a.v, b.v), ["theta", "v"], {"lam": 5.0}
    )


def test_a_stored_branch_point_can_be_left_again(tmp_path):
    branch = trace(solve(elastica(), [0, 0], intervals=8, degree=6), free=["lam"], limits={"lam": (1, 20)})
    save(branch, tmp_path / "b.npz")
    again = load(elastica(), tmp_path / "b.npz")
    assert [p.label for p in again] == [p.label for p in branch] and again.stop == branch.stop
    assert np.array_equal(again.column("lam"), branch.column("lam"))
    first, second = (trace(b.labelled("BP")[0], branch=1, limits={"lam": (1, 15)}) for b in (branch, again))
    assert np.array_equal(first.column("lam"), second.column("lam"))


def test_algebraic_branches_too(tmp_path):
    problem = AlgebraicProblem(lambda u, p: (p.mu - u.x**2,), ["x"], {"mu": 1.0})
    branch = trace(solve(problem, [1.0]), free=["mu"], direction=-1, limits={"mu": (-1, 2)})
    save(branch, tmp_path / "a.npz")
    assert load(problem, tmp_path / "a.npz").labelled("LP")[0]["mu"] == branch.labelled("LP")[0]["mu"]


def test_what_is_no_branch_of_this_problem_is_refused(tmp_path):
    (tmp_path / "junk.npz").write_bytes(b"junk")
    with pytest.raises(ProblemError, match="no branch stored"):
        load(elastica(), tmp_path / "junk.npz")
    problem = AlgebraicProblem(lambda u, p: (p.mu - u.x**2,), ["x"], {"mu": 1.0})
    save(trace(solve(problem, [1.0]), free=["mu"], limits={"mu": (0, 2)}), tmp_path / "a.npz")
    with pytest.raises(ProblemError, match="states"):
        load(elastica(), tmp_path / "a.npz")
    with pytest.raises(FileNotFoundError):
        load(problem, tmp_path / "absent.npz")
