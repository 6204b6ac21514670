"""Branches in files."""

import numpy as np
import pytest
from bank.closed_forms import elastica, parabola

from contin import ProblemError, load, save, solve, trace


def test_a_stored_branch_point_can_be_left_again(tmp_path):
    branch = trace(solve(elastica(), [0, 0], intervals=8, degree=6), free=["lam"], limits={"lam": (1, 20)})
    save(branch, tmp_path / "b.npz")
    again = load(elastica(), tmp_path / "b.npz")
    assert [p.label for p in again] == [p.label for p in branch] and again.stop == branch.stop
    for name in ("lam", "k", "mode"):
        assert np.array_equal(again.column(name), branch.column(name))
    for one, other in zip(branch, again):
        assert np.array_equal(one.x, other.x) and one.errors == other.errors and one.arclength == other.arclength
    first, second = (trace(b.labelled("BP")[0], branch=1, limits={"lam": (1, 15)}) for b in (branch, again))
    assert np.array_equal(first.column("lam"), second.column("lam"))


def test_algebraic_branches_too(tmp_path):
    problem = parabola()
    branch = trace(solve(problem, [1.0]), free=["mu"], direction=-1, limits={"mu": (-1, 2)})
    save(branch, tmp_path / "a.npz")
    again = load(problem, tmp_path / "a.npz")
    assert [p.label for p in again] == [p.label for p in branch] and len(branch.labelled("LP")) == 1
    assert np.array_equal([p.x for p in again], [p.x for p in branch])


def test_what_is_no_branch_of_this_problem_is_refused(tmp_path):
    (tmp_path / "junk.npz").write_bytes(b"junk")
    with pytest.raises(ProblemError, match="no branch stored"):
        load(elastica(), tmp_path / "junk.npz")
    problem = parabola()
    save(trace(solve(problem, [1.0]), free=["mu"], limits={"mu": (0, 2)}), tmp_path / "a.npz")
    with pytest.raises(ProblemError, match="states"):
        load(elastica(), tmp_path / "a.npz")
    with pytest.raises(FileNotFoundError):
        load(problem, tmp_path / "absent.npz")
