"""Branches in files."""

import json
import math
from pathlib import Path

import numpy as np
import pytest

from bank.closed_forms import elastica, parabola
from contin import (
    AlgebraicProblem,
    BoundaryValueProblem,
    CycleProblem,
    MapProblem,
    ProblemError,
    curve,
    diagram,
    load,
    save,
    solve,
    trace,
)
from contin.lowlevel import read_branches, read_columns

#: Files that version 0.2.0 wrote.
KEPT = Path(__file__).parent / "kept"


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


def test_the_kind_and_the_symmetry_are_compared(tmp_path):
    """Fixed points of a map and equilibria of a field have the same names; a rotation has a symmetry that may be declared."""

    def field(u, p):
        square = u.x**2 + u.y**2
        return p.mu * u.x - u.y - u.x * square, u.x + p.mu * u.y - u.y * square

    rest, fixed = (kind(field, ["x", "y"], {"mu": -1.0}) for kind in (AlgebraicProblem, MapProblem))
    save(trace(solve(rest, [0, 0]), free=["mu"], max_points=3), tmp_path / "a.npz")
    assert load(rest, tmp_path / "a.npz").points
    with pytest.raises(ProblemError, match=r"AlgebraicProblem\(states x, y; parameters mu\), not MapProblem\("):
        load(fixed, tmp_path / "a.npz")
    plain, half = (CycleProblem(field, ["x", "y"], {"mu": 1.0}, **more) for more in ({}, {"symmetry": [[-1, 0], [0, -1]]}))
    save(
        trace(solve(half, lambda t: (np.cos(2 * np.pi * t), np.sin(2 * np.pi * t))), free=["mu"], max_points=3), tmp_path / "b"
    )
    assert load(half, tmp_path / "b").points
    with pytest.raises(ProblemError, match="symmetry"):
        load(plain, tmp_path / "b")


def test_files_of_version_2_open_and_go_on():
    """Branches that version 0.2.0 wrote: a thermal explosion, and equilibria and cycles of van der Pol's oscillator."""

    def oscillator(u, p):
        return u.y, p.m * u.y - u.x**2 * u.y - u.x

    explosion = BoundaryValueProblem(
        lambda t, u, p: (u.v, -p.lam * math.exp(u.u / (1 + p.eps * u.u))), lambda a, b, p: (a.u, b.u), ["u", "v"],
        {"lam": 0.0, "eps": 0.2}, functionals={"mean": lambda t, u, p: u.u},
    )  # fmt: skip
    heat = load(explosion, KEPT / "bvp.npz")
    assert [point.label for point in heat if point.label] == ["EP", "UZ", "LP", "EP"]
    assert read_columns(KEPT / "bvp.npz").columns["lam"].tolist() == heat["lam"].tolist()
    assert trace(heat[-1], limits={"mean": (-1, 20), "lam": (0, 10)}).labelled("LP")
    (cusp,) = curve(heat.labelled("LP")[0], "eps", limits={"eps": (0.2, 0.26)}).labelled("CP")
    assert cusp["eps"] == pytest.approx(0.2457804, abs=1e-6)  # docs/contin.md

    rest = load(AlgebraicProblem(oscillator, ["x", "y"], {"m": -1.0}), KEPT / "rest.npz")
    cycles = load(CycleProblem(oscillator, ["x", "y"], {"m": -1.0}), KEPT / "cycles.npz")
    more = trace(cycles[-1], limits={"m": (-1, 1.5)})
    anew = trace(rest.labelled("HB")[0], branch=1, limits={"m": (-1, 1.5)})
    assert str(more.stop) == str(anew.stop) == "reached m = 1.5"
    assert more[-1]["period"] == pytest.approx(anew[-1]["period"], abs=1e-9)


def test_files_of_other_versions_are_refused(tmp_path):
    problem = parabola()
    save(trace(solve(problem, [1.0]), free=["mu"], max_points=2), tmp_path / "a.npz")
    with np.load(tmp_path / "a.npz") as file:
        arrays = {name: file[name] for name in file.files}
    head = json.loads(arrays.pop("head").tobytes())
    text = json.dumps(head | {"format": "contin branch 0"}).encode()
    np.savez(tmp_path / "0.npz", head=np.frombuffer(text, dtype=np.uint8), **arrays)
    with pytest.raises(ProblemError, match="no branch stored"):
        load(problem, tmp_path / "0.npz")


def test_columns_and_states_without_the_problem(tmp_path):
    """Those of the branch itself, on its meshes; a file that is no branch is refused as `load` refuses it."""
    branch = trace(solve(elastica(), [0, 0], intervals=8, degree=6), free=["lam"], limits={"lam": (1, 20)})
    other = trace(branch.labelled("BP")[0], branch=1, limits={"lam": (1, 15)})
    save(other, tmp_path / "b.npz")
    stored = read_columns(tmp_path / "b.npz")
    assert stored.labels == [point.label for point in other] and stored.stop == str(other.stop)
    for name in ("lam", "k", "mode"):
        assert np.array_equal(stored.columns[name], other.column(name))
    for (times, states), point in zip(stored.profiles, other, strict=True):
        assert np.array_equal(times, point.system.nodes) and np.array_equal(states, point.system.states(point.x))
    (tmp_path / "junk.npz").write_bytes(b"junk")
    with pytest.raises(ProblemError, match="no branch stored"):
        read_columns(tmp_path / "junk.npz")


def test_a_whole_diagram_in_one_file(tmp_path):
    """Brusselator: equilibria and the cycles that leave them, which are read as cycles of the same equations."""
    equations = AlgebraicProblem(
        lambda u, p: (1 - (p.b + 1) * u.x + u.x**2 * u.y, p.b * u.x - u.x**2 * u.y), ["x", "y"], {"b": 1.0}
    )
    found = diagram(solve(equations, [1, 1]), free=["b"], depth=1, limits={"b": (1, 2.2)}, errors=False)
    save(found, tmp_path / "d.npz")
    again = load(equations, tmp_path / "d.npz")
    assert repr(again) == repr(found)
    for one, other in zip(found.branches, again.branches):
        assert all(np.array_equal(p.x, q.x) for p, q in zip(one, other))
    (junction,) = again.junctions
    assert junction.point is again.branches[0].labelled("HB")[0] and junction.taken == found.junctions[0].taken
    assert again.graph().number_of_edges() == found.graph().number_of_edges()
    assert trace(again.branches[-1].points[-1], limits={"b": (1, 2.3)}).stop.reason == "limit"
    equilibria, _, cycles = read_branches(tmp_path / "d.npz")
    assert read_columns(tmp_path / "d.npz").columns.keys() == equilibria.columns.keys()
    for stored, branch in ((equilibria, found.branches[0]), (cycles, found.branches[2])):
        for name in ("max_x", "min_y", "norm"):
            assert stored.columns[name] == pytest.approx(branch[name], rel=1e-12)
    hopf = [point.label for point in found.branches[0]].index("HB")
    assert equilibria.columns["index"].tolist() == [0] * hopf + [-1] + [2] * (len(found.branches[0]) - hopf - 1)
    assert (cycles.columns["index"][1:] == 0).all()


def test_columns_of_scaled_and_algebraic_problems(tmp_path):
    """A problem of large numbers is stored divided by its sizes; its columns are not."""
    problem = AlgebraicProblem(lambda u, p: (p.a - 1e-6 * u.x**2,), ["x"], {"a": 1e12})
    branch = trace(solve(problem, [1e9]), free=["a"], direction=-1, limits={"a": (5e11, 2e12)})
    save(branch, tmp_path / "a.npz")
    stored = read_columns(tmp_path / "a.npz")
    assert np.array_equal(stored.columns["a"], branch.column("a"))
    for (times, states), point in zip(stored.profiles, branch, strict=True):
        assert len(times) == 1 and np.array_equal(states, point.system.states(point.x))


def test_the_degree_is_stored(tmp_path):
    """A branch of the default degree goes on from a file as from memory, bit by bit."""
    branch = trace(solve(elastica(), [0, 0]), free=["lam"], limits={"lam": (1, 20)})
    save(branch, tmp_path / "b.npz")
    again = load(elastica(), tmp_path / "b.npz")
    assert {point.system.degree for point in (*branch, *again)} == {7} and repr(again) == repr(branch)
    first, second = (trace(b.points[-1], free=["lam"], limits={"lam": (1, 60)}) for b in (branch, again))
    assert np.array_equal(first.column("lam"), second.column("lam"))
