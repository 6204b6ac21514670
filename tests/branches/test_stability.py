"""Scenes that ask for the index: its column, and the bifurcations that the cell's own equations cannot see."""

import numpy as np
import pytest

from branches import diagram_graph as diagram
from branches.config import parse
from branches.display import Display
from branches.job import run_branch
from branches.read import read_branch

SCENE = "{m: 3, n: 1, stability: true, limits: {kappa_n: [-30, 0]}, stride: 50}"


@pytest.fixture(scope="module")
def branch(tmp_path_factory):
    path = tmp_path_factory.mktemp("stability") / "x.h5"
    run_branch(parse(SCENE, "scene"), path, Display(silent=True))
    return read_branch(path)


def test_a_secondary_bifurcation_is_located_and_changes_the_index_by_one(branch):
    """kappa_n from the half loop, whose equations see the same point as a branch point of their own."""
    (event,) = branch.events[branch.events["label"] == b"SB"]
    assert event["kappa_n"] == pytest.approx(-21.62681748742, abs=1e-8)
    assert event["name"] == b"wavenumber 1 even"
    assert np.isnan(event["error_kappa_n"])  # the index has errors of its own, which finer meshes of the state do not show
    at = int(event["point"])
    index = branch.points["index"]
    assert set(index[1:at]) == {2} and set(index[at + 1 :]) == {1} and index[0] == index[at] == -1
    assert [event[name] for name in ("index_before", "index_after", "kernel")] == [2, 1, 1]
    assert event["breaks"] == b"one two-fold axis, 2-fold rotary reflection"


def test_pieces_of_the_diagram_carry_the_index(branch):
    graph = diagram.new_graph()
    diagram.add_branch(graph, branch, "x.h5")
    assert [data["index"] for _, _, data in graph.edges(data=True)] == [2, 1]
    (secondary,) = [data for _, data in graph.nodes(data=True) if data["kind"] == "secondary bifurcation"]
    assert secondary["what"] == "wavenumber 1 even"


def test_the_same_points_without_and_no_column(branch, tmp_path):
    run_branch(parse(SCENE.replace("stability: true, ", ""), "scene"), tmp_path / "x.h5", Display(silent=True))
    plain = read_branch(tmp_path / "x.h5")
    assert "index" not in plain.points.dtype.names
    regular = branch.points[branch.points["label"] != b"SB"]
    assert np.array_equal(regular["kappa_n"], plain.points["kappa_n"])


def test_the_fold_of_the_single_loop_is_where_stability_ends(tmp_path):
    """Index 0 up to the fold of (1, 2), 1 after it (Fig. 12 of the paper has it as a guess)."""
    run_branch(parse("{m: 1, n: 2, stability: true, stride: 50}", "scene"), tmp_path / "x.h5", Display(silent=True))
    found = read_branch(tmp_path / "x.h5")
    assert list(found.events["label"]) == [b"BP", b"LP", b"EP"]
    (fold,) = found.events["point"][found.events["label"] == b"LP"]
    index = found.points["index"]
    assert set(index[1:fold]) == {0} and set(index[fold + 1 : -1]) == {1}
    changes = [[event[name] for name in ("index_before", "index_after", "kernel", "breaks")] for event in found.events]
    assert changes == [[-1, -1, 0, b""], [0, 1, 1, b""], [-1, -1, 0, b""]]


def test_a_pair_of_modes_changes_the_index_by_two(tmp_path):
    run_branch(
        parse("{m: 5, n: 2, stability: true, limits: {kappa_n: [-30, 0]}}", "scene"), tmp_path / "x.h5", Display(silent=True)
    )
    (event,) = [event for event in read_branch(tmp_path / "x.h5").events if event["label"] == b"SB"]
    assert [event[name] for name in ("index_before", "index_after", "kernel")] == [4, 2, 2]
    one, other = event["breaks"].decode().split(" or ")
    assert one == "one mirror, 2 two-fold axes, 4-fold rotary reflection"
    assert other == "2 mirrors, one two-fold axis, 4-fold rotary reflection"


def test_a_run_resumed_is_the_run_undisturbed(silent, tables, tmp_path):
    whole, stopped = tmp_path / "whole.h5", tmp_path / "stopped.h5"
    run_branch(parse(SCENE, "scene"), whole, silent())
    run_branch(parse(SCENE.replace("stability", "steps: {max_points: 20}, stability"), "scene"), stopped, silent())
    run_branch(parse(SCENE, "scene", ["steps.max_points=2000"]), stopped, silent(), resume=True)
    assert tables(whole) == tables(stopped)


def test_the_index_ends_with_the_law(silent, tmp_path):
    """Beyond the end of its convex energy a strip of finite width has no index; the run ends there, as without the index."""
    scene = "{m: 3, n: 1, law: finite width, Gamma: 10, stability: true, limits: {kappa_n: [-60, 100]}, stride: 50}"
    assert run_branch(parse(scene, "scene"), tmp_path / "x.h5", silent()) == "complete"
    branch = read_branch(tmp_path / "x.h5")
    assert branch.events[-1]["name"] == b"the end of the convex strain energy" and branch.events[-1]["index"] == -1
