"""Scenes that ask for the index: its column, and the bifurcations that the cell's own equations cannot see."""

import pytest

from branches.graph import closed as diagram
from branches.graph.stored import new_graph
from branches.read import read_branch
from branches.run.display import Display
from branches.run.runner import run_scene
from branches.scene.index import LABEL, SymmetryWatch
from branches.scene.parse import parse
from contin import Settings, trace
from contin.lowlevel import locate_branch_point, point_of
from ribbon_model.domains import HALF_LOOPS
from ribbon_model.laws import RIBBON
from ribbon_model.seeds import primary_branch, secondary_branch
from ribbon_model.solution import Solution

SCENE = "{m: 3, n: 1, stability: true, limits: {kappa_n: [-30, 0]}, stride: 50}"


@pytest.fixture(scope="module")
def branch(tmp_path_factory):
    path = tmp_path_factory.mktemp("stability") / "x.h5"
    run_scene(parse(SCENE, "scene"), path, Display(silent=True))
    return read_branch(path)


def test_a_secondary_bifurcation_is_located_and_changes_the_index_by_one(branch):
    """kappa_n from the half loop, whose equations see the same point as a branch point of their own."""
    (event,) = branch.events[branch.events["label"] == b"SB"]
    assert event["kappa_n"] == pytest.approx(-21.62681748742, abs=3e-11)
    assert event["name"] == b"wavenumber 1 even"
    assert 0 < event["error_kappa_n"] < 1e-10
    at = int(event["point"])
    index = branch.points["index"]
    assert set(index[1:at]) == {2} and set(index[at + 1 :]) == {1} and index[0] == index[at] == -1
    assert [event[name] for name in ("index_before", "index_after", "kernel")] == [2, 1, 1]
    assert event["breaks"] == b"one two-fold axis, 2-fold rotary reflection"


def test_pieces_of_the_diagram_carry_the_index(branch):
    graph = new_graph()
    diagram.add_branch(graph, branch, "x.h5")
    assert [data["index"] for _, _, data in graph.edges(data=True)] == [2, 1]
    (secondary,) = [data for _, data in graph.nodes(data=True) if data["kind"] == "secondary bifurcation"]
    assert secondary["what"] == "wavenumber 1 even"


def test_the_same_points_without_and_no_column(branch, tmp_path):
    """Another step would move all later points by a part of a step; round-off in the lengths moves them by 5e-12."""
    run_scene(parse(SCENE.replace("stability: true, ", ""), "scene"), tmp_path / "x.h5", Display(silent=True))
    plain = read_branch(tmp_path / "x.h5")
    assert "index" not in plain.points.dtype.names
    regular = branch.points[branch.points["label"] != b"SB"]
    assert regular["kappa_n"] == pytest.approx(plain.points["kappa_n"], rel=1e-6)


@pytest.mark.full
def test_the_fold_of_the_single_loop_is_where_stability_ends(tmp_path):
    """Index 0 up to the fold of (1, 2), 1 after it (Fig. 12 of the paper has it as a guess)."""
    run_scene(parse("{m: 1, n: 2, stability: true, stride: 50}", "scene"), tmp_path / "x.h5", Display(silent=True))
    found = read_branch(tmp_path / "x.h5")
    assert list(found.events["label"]) == [b"BP", b"LP", b"EP"]
    (fold,) = found.events["point"][found.events["label"] == b"LP"]
    index = found.points["index"]
    assert set(index[1:fold]) == {0} and set(index[fold + 1 : -1]) == {1}
    changes = [[event[name] for name in ("index_before", "index_after", "kernel", "breaks")] for event in found.events]
    assert changes == [[-1, -1, 0, b""], [0, 1, 1, b""], [-1, -1, 0, b""]]


@pytest.mark.full
def test_a_pair_of_modes_changes_the_index_by_two(tmp_path):
    run_scene(
        parse("{m: 5, n: 2, stability: true, limits: {kappa_n: [-30, 0]}}", "scene"), tmp_path / "x.h5", Display(silent=True)
    )
    (event,) = [event for event in read_branch(tmp_path / "x.h5").events if event["label"] == b"SB"]
    assert [event[name] for name in ("index_before", "index_after", "kernel")] == [4, 2, 2]
    one, other = event["breaks"].decode().split(" or ")
    assert one == "one mirror, 2 two-fold axes, 4-fold rotary reflection"
    assert other == "2 mirrors, one two-fold axis, 4-fold rotary reflection"


@pytest.mark.full
def test_a_run_resumed_is_the_run_undisturbed(silent, tables, tmp_path):
    whole, stopped = tmp_path / "whole.h5", tmp_path / "stopped.h5"
    run_scene(parse(SCENE, "scene"), whole, silent())
    run_scene(parse(SCENE.replace("stability", "steps: {max_points: 20}, stability"), "scene"), stopped, silent())
    run_scene(parse(SCENE, "scene", ["steps.max_points=2000"]), stopped, silent(), resume=True)
    assert tables(whole) == tables(stopped)


@pytest.mark.full
def test_the_index_ends_with_the_law(silent, tmp_path):
    """Beyond the end of its convex energy a strip of finite width has no index; the run ends there, as without the index."""
    scene = "{m: 3, n: 1, law: finite width, Gamma: 10, stability: true, limits: {kappa_n: [-60, 100]}, stride: 50}"
    assert run_scene(parse(scene, "scene"), tmp_path / "x.h5", silent()) == "complete"
    branch = read_branch(tmp_path / "x.h5")
    assert branch.events[-1]["name"] == b"the end of the convex strain energy"
    assert branch.events[-1]["index"] in (-1, branch.points["index"][-2])  # right at the end there may be one


#: Primary branches of the ribbon and nu, and the number of their secondary bifurcations down to kappa_n = -150.
AGREEMENT = {
    (3, 1, 0.1): 3, (3, 1, 0.2): 3, (3, 1, 0.3): 2, (3, 1, 0.4): 0,
    (5, 1, 0.1): 3, (5, 1, 0.2): 3, (5, 1, 0.3): 3, (5, 1, 0.4): 0,
    (5, 2, 0.1): 1, (5, 2, 0.2): 1, (5, 2, 0.3): 2, (5, 2, 0.4): 0,
    (7, 1, 0.1): 3, (7, 1, 0.2): 3, (7, 1, 0.3): 3, (7, 1, 0.4): 3,
    (7, 2, 0.1): 1, (7, 2, 0.2): 1, (7, 2, 0.3): 1, (7, 2, 0.4): 0,
    (7, 3, 0.1): 1, (7, 3, 0.2): 1, (7, 3, 0.3): 1, (7, 3, 0.4): 0,
}  # fmt: skip


@pytest.mark.full
@pytest.mark.parametrize(("m", "n", "nu"), AGREEMENT)
def test_the_index_changes_where_the_half_loop_branches(m, n, nu):
    """Within the errors of both: located by an eigenvalue on the cell, and as a branch point of the half loop's equations."""
    system, x, tangent = primary_branch(RIBBON, m, n, nu, 10, 7)
    settings = Settings(trivial="M2", limits={"kappa_n": (-150, 100)}, events=SymmetryWatch(RIBBON, system, x).monitors)
    found = trace(point_of(system, x), settings, tangent=tangent).labelled(LABEL)
    assert len(found) == AGREEMENT[m, n, nu]
    for point in found:
        for reversal in point.details.keeps:
            half, start, _ = secondary_branch(Solution.of(point), HALF_LOOPS[reversal])
            finer, carry = half.refined()
            places = [
                finer.parameter(locate_branch_point(finer, carry(start)).x, "kappa_n"), half.parameter(start, "kappa_n"),
            ]  # fmt: skip
            error = point.errors["kappa_n"] + abs(places[1] - places[0])
            assert error < 1e-8
            assert abs(point["kappa_n"] - places[0]) < 3 * error + 1e-12


@pytest.mark.full
def test_a_pair_of_bifurcations_in_one_step(tmp_path):
    """(5, 1) at nu = .302 loses its symmetry under the mirror, and twice under the axes, between two neighbouring points."""
    scene = "{m: 5, n: 1, nu: 0.302, stability: true, limits: {kappa_n: [-40, 0]}}"
    run_scene(parse(scene, "scene"), tmp_path / "x.h5", Display(silent=True))
    events = [event for event in read_branch(tmp_path / "x.h5").events if event["label"] == b"SB"]
    places = [event["kappa_n"] for event in events]
    assert places == pytest.approx([-24.058306547949, -25.6395938179, -28.4919621576], abs=1e-9)
    assert [event["name"].decode()[-4:].strip() for event in events] == ["even", "odd", "odd"]
    assert [(event["index_before"], event["index_after"]) for event in events] == [(6, 5), (5, 4), (4, 5)]


@pytest.mark.full
def test_a_mesh_too_coarse_for_the_index_is_halved(tmp_path):
    """A strip of finite width beyond kappa_n = 14: on the mesh of the run an eigenvalue of 1e-3 has the error 1e-2."""
    scene = "{m: 3, n: 1, law: finite width, Gamma: 3, stability: true, limits: {kappa_n: [-5, 20]}}"
    run_scene(parse(scene, "scene"), tmp_path / "x.h5", Display(silent=True))
    branch = read_branch(tmp_path / "x.h5")
    (event,) = branch.events[branch.events["label"] == b"SB"]
    assert event["kappa_n"] == pytest.approx(2.5185316810, abs=1e-8) and event["error_kappa_n"] < 1e-11
    assert set(branch.points["index"][branch.points["kappa_n"] > 4][:-1]) == {2}
