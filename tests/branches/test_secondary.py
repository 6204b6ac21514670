"""Secondary branches as a user gets them: scenes with an origin, the command, the diagram."""

import dataclasses
import json

import numpy as np
import pytest

from branches.graph import closed as diagram
from branches.graph.stored import new_graph, read
from branches.read import read_branch
from branches.run.display import Display
from branches.run.runner import run_scene
from branches.scene.closed import ClosedScene
from branches.scene.fields import ConfigError
from branches.scene.parse import dump, parse
from branches.secondary import main

PAIR = "{m: 5, n: 2, stability: true, limits: {kappa_n: [-21, 100]}, stride: 20}"
ORIGIN = "origin: {kappa_n: -21.62681748, kappa_star: 2.78375737, mode: wavenumber 1 even}"
SCENE = f"{{m: 3, n: 1, domain: half loop, {ORIGIN}, limits: {{kappa_n: [-200, 100]}}, stride: 20}}"


@pytest.fixture(scope="module")
def returned(tmp_path_factory):
    """The branch that leaves (3, 1), without its index."""
    path = tmp_path_factory.mktemp("secondary") / "x.h5"
    assert run_scene(parse(SCENE, "scene"), path, Display(silent=True)) == "complete"
    return read_branch(path)


def test_the_branch_of_m3_n1_returns_to_it(returned):
    """It ends at the change of the index of (3, 1), -114.309355, which is found on the cell, independently of the half loop."""
    assert returned.reason == "primary branch"
    end = returned.events[-1]
    assert end["name"] == b"primary branch" and end["kappa_n"] == pytest.approx(-114.3093550622, abs=1e-7)
    assert abs(end["R3"]) < 1e-7 and np.abs(returned.points["R3"]).max() > 1
    assert not np.any(returned.events["label"] == b"LP")  # the turns of the pitchforks are no folds


@pytest.mark.full
def test_a_branch_is_put_between_the_bifurcations_that_it_joins(returned, tmp_path):
    run_scene(
        parse("{m: 3, n: 1, stability: true, limits: {kappa_n: [-120, 100]}, stride: 50}", "scene"), tmp_path / "p.h5",
        Display(silent=True),
    )  # fmt: skip
    graph = new_graph()
    diagram.add_branch(graph, read_branch(tmp_path / "p.h5"), "p.h5")
    count = graph.number_of_nodes()
    assert diagram.add_branch(graph, returned, "x.h5") and graph.number_of_nodes() == count
    assert not diagram.add_branch(graph, returned, "again.h5")
    (branch,) = diagram.secondaries(graph)
    assert [node["kind"] for node in branch["nodes"]] == ["secondary bifurcation"] * 2
    assert diagram.families(graph) == [("ribbon", 0.3, 3, 1)]
    assert [node["kind"] for node in diagram.course(graph, 3, 1)[0]["nodes"]][1:3] == ["secondary bifurcation"] * 2
    at = diagram.states_at(graph, -60.0)
    assert [state.get("origin") for state in at].count(None) == 2  # the circle, and (3, 1) itself
    assert sum("origin" in state for state in at) == 1


@pytest.mark.full
def test_the_command_follows_both_kinds_of_a_pair_and_says_so(command, tmp_path):
    run_scene(parse(PAIR, "scene"), tmp_path / "x.h5", Display(silent=True))
    done = command("x.h5", "--out", "all", program=("-m", "branches.secondary"))
    assert done.returncode == 0, done.err
    assert done.out.count("kernel of dimension 2") == 2 and "keeps one two-fold axis" in done.out
    graph = read(tmp_path / "all")
    switches = json.loads(graph.graph["switches"])
    assert [(one["domain"], one["outcome"]) for one in switches] == [
        ("half loop", "followed"),
        ("half loop between axes", "followed"),
    ]
    mirror, axis = diagram.secondaries(graph)
    start = next(data for _, data in graph.nodes(data=True) if data["kind"] == "secondary bifurcation")
    for branch, index in ((mirror, 4), (axis, 3)):  # 5 -> 3 along (5, 2)
        assert branch["nodes"][0] is start and branch["nodes"][-1]["kind"] == "leaves"
        first = branch["edges"][0][2]
        assert first["index"] == index and first["energy"][0] == pytest.approx(start["energy"], abs=1e-5)
    assert (tmp_path / "all" / mirror["file"]).exists()
    assert main([str(tmp_path / "x.h5"), "--out", str(tmp_path / "all"), "--quiet"]) == 0  # takes what is there
    assert len(diagram.secondaries(read(tmp_path / "all"))) == 2


def test_places_that_agree_in_six_digits_have_files_of_their_own():
    config, taken = parse(SCENE, "scene"), set()
    for place in ("-21.6268", "-21.62681748", "-21.62681748_2.78375737"):
        name = config.secondary_file(taken)
        assert name == f"ribbon_nu0.3_m3_n1_from{place}_half_loop.h5"
        taken.add(name)


def test_places_that_agree_in_nine_digits_have_nodes_of_their_own(returned):
    """A branch like the one at hand, from a place with the same kappa_n and another kappa*."""
    points, events = returned.points.copy(), returned.events.copy()
    for table in (points, events):
        table["kappa_star"] += 0.5
    origin = returned.scene.origin.model_copy(update={"kappa_star": returned.scene.origin.kappa_star + 0.5})
    scene = returned.scene.model_copy(update={"origin": origin})
    other = dataclasses.replace(returned, points=points, events=events, scene=scene)
    graph = new_graph()
    assert diagram.add_branch(graph, returned, "a.h5")
    first = set(graph)
    assert diagram.add_branch(graph, other, "b.h5") and not diagram.add_branch(graph, other, "again.h5")
    assert len(first) == 2 and first < set(graph) and graph.number_of_nodes() == 4
    assert [name for name in first if "(3,1) from -21.6268175 on the half loop secondary bifurcation 0" in name]
    for branch in diagram.secondaries(graph):
        assert branch["nodes"][0]["kappa_star"] == branch["edges"][0][2]["kappa_star"][0]


def test_a_file_holds_its_scene(returned):
    text = dump(ClosedScene.model_validate(returned.config))
    assert parse(text, "again") == parse(SCENE, "scene")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ("domain=cell", "domain: 'cell' must be 'half loop' for 'wavenumber 1 even'"),
        ("domain=half loop between axes", "must be 'half loop'"),
        ("origin.mode=sideways", "mode: 'sideways' must be"),
        ("origin.kappa_n=-300", "limits: kappa_n"),
        ("m=[3, 5]", "must not be given in a scene of many branches"),
    ],
)
def test_origins_that_are_none(change, message):
    with pytest.raises(ConfigError, match=message):
        parse(SCENE, "scene", [change])


def test_an_origin_beside_the_branch_is_refused(tmp_path):
    with pytest.raises(ConfigError, match="is not on the branch"):
        run_scene(parse(SCENE, "scene", ["origin.kappa_star=2.5"]), tmp_path / "x.h5", Display(silent=True))


def test_results_that_the_command_cannot_use(capsys, tmp_path):
    run_scene(parse("{m: 1, n: 2, stride: 50}", "scene"), tmp_path / "x.h5", Display(silent=True))
    for name, words in (("x.h5", "stability: true"), ("absent.h5", "no such file")):
        assert main([str(tmp_path / name)]) == 2
        said = capsys.readouterr().err
        assert words in said and said.count("\n") == 1
