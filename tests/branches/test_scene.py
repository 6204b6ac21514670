"""One road for closed and open strips: columns stated once, stages, what an interrupted run and a law's end become."""

import dataclasses
import json
import re
import signal

import h5py
import numpy as np
import pytest
from matplotlib.figure import Figure

import contin
from branches.explore.gather import gather
from branches.graph.kinds import graph_kind
from branches.graph.parts import add
from branches.graph.picture import circles
from branches.graph.stored import new_graph, read, save
from branches.run.display import Display, Progress
from branches.run.many import run_many
from branches.run.runner import run_scene
from branches.scene.closed_stage import ClosedStage
from branches.scene.columns import FOUND, Column, error_of
from branches.scene.fields import ConfigError
from branches.scene.parse import dump, load, parse
from branches.scene.stages import stages_of
from branches.secondary import follow_all
from branches.store.read import read_branch
from ribbon_model import laws

COARSE = "mesh: {degree: 5, tolerance: 1.0e-7}\n"


def test_a_column_is_one_line(tmp_path, monkeypatch, capsys):
    """It is in the file with its words and its error, in the graph, on the page, and on the axes of pictures."""
    usual = ClosedStage.columns

    def columns(self):
        found = usual(self)
        twice = Column("twice", "twice the energy", error=error_of("energy"), role=FOUND, axis="twice the energy",
                       value=lambda row: 2 * row.values["energy"])  # fmt: skip
        return dataclasses.replace(found, values=(*found.values, twice))

    scene = parse(f"m: 1\nn: 2\n{COARSE}", "scene")
    run_scene(scene, tmp_path / "older.h5", Display(silent=True))
    monkeypatch.setattr(ClosedStage, "columns", columns)
    assert run_scene(scene, tmp_path / "x.h5", Display(silent=True)) == "complete"
    branch = read_branch(tmp_path / "x.h5")
    assert np.array_equal(branch.points["twice"], 2 * branch.points["energy"])
    assert branch.events["error_twice"].tolist() == branch.events["error_energy"].tolist()
    with h5py.File(tmp_path / "x.h5") as file:
        assert file["points"].attrs["twice"] == "twice the energy"
    kind = graph_kind(scene)
    graph = new_graph("", kind.FORMAT)
    add(graph, kind.part(branch, "x.h5", {}))
    assert all(np.allclose(edge["twice"], 2 * np.array(edge["energy"])) for *_, edge in graph.edges(data=True))
    save(graph, tmp_path)
    assert "twice" in json.loads((tmp_path / "diagram.json").read_text())["edges"][0]
    page = gather([str(tmp_path / "x.h5")])
    assert ("twice", "twice the energy", "twice") in page["axes"]
    assert "twice" in page["families"][0]["branches"][0]["columns"]
    (axes,) = branch.plot(shapes=0, x="kappa_n", y="twice").axes
    assert axes.get_ylabel() == "twice the energy"
    older = kind.part(read_branch(tmp_path / "older.h5"), "older.h5", {})  # a file of the version before, without it
    add(graph, older)
    both = gather([str(tmp_path / "x.h5"), str(tmp_path / "older.h5")])
    assert [name for name, *_ in both["axes"]] == [name for name, *_ in page["axes"] if name != "twice"]


def test_a_column_that_follows_from_others_is_in_no_file(tmp_path):
    run_scene(parse(f"m: 1\nn: 2\n{COARSE}", "scene"), tmp_path / "x.h5", Display(silent=True))
    branch = read_branch(tmp_path / "x.h5")
    assert "elastic" not in branch.points.dtype.names
    assert np.allclose(branch.column("elastic"), branch.points["energy"] + branch.points["kappa_n"] ** 2 / 2)
    (axes,) = branch.plot(shapes=0, y="elastic").axes
    assert "elastic energy" in axes.get_ylabel()


@pytest.mark.parametrize("text", ["m: 1\nn: 2\nstability: true\n", None])
def test_every_column_has_words_of_its_own_kind(text, root):
    scene = load(root / "configs" / "open_release.yaml") if text is None else parse(text, "scene")
    columns = stages_of(scene)[0].columns()
    for name, (_, words, _) in columns.table("events").items():
        assert len(words) > len(name) and words != name, name
    assert ("2 pi" in columns.all["energy"].words) == (text is not None)


def test_errors_of_what_is_found_cover_the_exact_values(tmp_path):
    """On the m-fold circle kappa* is m and the energy m^2/2 - m kappa_n; the ends of (1, 2) are at 2.5 and -1/2."""
    run_scene(parse("m: 1\nn: 2\n", "scene"), tmp_path / "x.h5", Display(silent=True))
    first, fold, last = read_branch(tmp_path / "x.h5").events
    for event, m, kappa_n in ((first, 1, 2.5), (last, 3, -0.5)):
        assert abs(event["kappa_star"] - m) <= event["error_kappa_star"] < 1e-12
        assert abs(event["energy"] - (m**2 / 2 - m * kappa_n)) <= event["error_energy"] < 1e-12
    assert 0 < fold["error_kappa_star"] < 1e-10 and 0 < fold["error_energy"] < 1e-10


class Interrupts(Display):
    """Ctrl-C is pressed at a point."""

    def __init__(self, at):
        super().__init__(silent=True)
        self.at = at

    def point(self, stage, point, number, step):
        if number == self.at:
            signal.raise_signal(signal.SIGINT)


@pytest.mark.full
@pytest.mark.parametrize(("name", "stage", "number"), [("open_release", 4, 2), ("network_portal", 2, 9)])
def test_a_run_goes_on_in_a_later_stage_to_the_same_bits(tmp_path, root, tables, name, stage, number):
    """With other ends, and where factors of the step before decide that no branch point is near."""
    scene = load(root / "configs" / f"{name}.yaml")
    whole, parts = tmp_path / "whole.h5", tmp_path / "parts.h5"
    run_scene(scene, whole, Display(silent=True))
    at = int(np.flatnonzero(read_branch(whole).points["stage"] == stage)[number])
    assert run_scene(scene, parts, Interrupts(at)) == "interrupted"
    assert run_scene(scene, parts, Display(silent=True), resume=True) == "complete"
    assert tables(parts) == tables(whole)


def test_a_secondary_branch_goes_on_without_its_primary_branch(tmp_path, monkeypatch):
    text = (
        "m: 3\nn: 1\norigin: {kappa_n: -21.62681748, kappa_star: 2.78375737, mode: wavenumber 1 even}\ndomain: half loop\n"
        "mesh: {degree: 5}\nlimits: {kappa_n: [-30, 20]}\n"
    )
    path = tmp_path / "x.h5"
    assert run_scene(parse(text, "scene"), path, Interrupts(4)) == "interrupted"
    monkeypatch.setattr("branches.scene.closed_stage.seed", None)  # it followed the primary branch
    assert run_scene(parse(text, "scene"), path, Display(silent=True), resume=True) == "complete"


def test_the_end_of_a_law_ends_a_stage_and_no_later_one_starts(tmp_path):
    text = 'material: {law: ribbon, nu: 0.3, kappa_n: 1}\nalong: {thickness: "1 - s/2"}\nfinish: free\n'
    stages = "stages: [{follow: force_normal, to: 5}, {follow: force_normal, to: 0}]\n"
    assert run_scene(parse(text + stages, "scene"), tmp_path / "x.h5", Display(silent=True)) == "complete"
    branch = read_branch(tmp_path / "x.h5")
    assert set(branch.points["stage"]) == {1} and branch.stop.startswith("stage 1: the end of the law")


def test_any_column_of_an_open_strip_against_any_other(tmp_path, root):
    run_scene(load(root / "configs" / "open_tip.yaml"), tmp_path / "x.h5", Display(silent=True))
    branch = read_branch(tmp_path / "x.h5")
    (axes,) = branch.plot(shapes=0, x="energy", y="M_normal").axes
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("energy in B/L", "moment about the normal in B/L")
    with pytest.raises(Exception, match="there is no column 'M_up' of numbers"):
        branch.plot(shapes=0, y="M_up")


LAW = """
from ribbon_model import RIBBON, Law, Parameter


def quartic(w1, w2, w3, kappa_n, twist, core):
    bent = w1 - kappa_n
    return bent**2 / 2 + core**2 * bent**4 / 4 + twist * w3**2 / 2 - kappa_n**2 / 2


QUARTIC = Law.of_energy("quartic", quartic, {"twist": Parameter(), "core": Parameter(1)})
"""


@pytest.mark.full
def test_a_law_of_one_s_own_is_a_sweep_a_diagram_and_a_page_of_closed_strips(tmp_path, monkeypatch):
    """It has a length of its own and no nu. (1, 2) leaves the circle where M r0 = t (1 - n^2/m^2) with the moment M there."""
    (tmp_path / "quartic.py").write_text(LAW)
    for name, law in laws.laws_of(tmp_path / "quartic.py").items():
        monkeypatch.setitem(laws.LAWS, name, law)
    text = "law: quartic\nm: 1\nn: 2\nparameters: {twist: 1.5, core: [0.1, 0.4]}\nlimits: {kappa_n: [-10, 10]}\n"
    sweep = parse(text + COARSE, "scene")
    assert list(sweep.scenes) == ["quartic_twist1.5_core0.1_m1_n2.h5", "quartic_twist1.5_core0.4_m1_n2.h5"]
    assert run_many(sweep, tmp_path, Display(silent=True), workers=1) == "complete"
    for file, core in zip(sweep.scenes, (0.1, 0.4)):
        start = read_branch(tmp_path / file).events[0]
        bent = 1 - start["kappa_n"]
        assert bent + core**2 * bent**3 == pytest.approx(1.5 * (1 - 2**2), rel=1e-9)
    page = gather([str(tmp_path)])
    assert [branch["exact"]["points"][0]["kappa_n"] for family in page["families"] for branch in family["branches"]] == [
        pytest.approx(read_branch(tmp_path / file).events["kappa_n"][0], abs=1e-9) for file in sweep.scenes
    ]
    assert [family["law"] for family in page["families"]] == [
        "quartic, twist = 1.5, core = 0.1",
        "quartic, twist = 1.5, core = 0.4",
    ]
    assert all(len(family["circles"]) == 2 for family in page["families"])
    with pytest.raises(ConfigError, match="twist"):
        parse(text.replace("twist: 1.5, ", ""), "scene")


@pytest.mark.full
def test_a_file_with_a_law_is_all_that_commands_need(tmp_path, command):
    """Closed and open strips: at the moment 4 the open one is an arc whose bending y satisfies y + core^2 y^3 = 4."""
    (tmp_path / "quartic.py").write_text(LAW)
    (tmp_path / "closed.yaml").write_text("law: quartic\nm: 1\nn: 2\nparameters: {twist: 1.5, core: 0.4}\n")
    (tmp_path / "open.yaml").write_text(
        "material: {law: quartic, twist: 1.5, core: 0.4, kappa_n: 0.5}\nfinish: {rotation: hinged, about: width, place: free}\n"
        "stages: [{follow: moment, to: 4}]\n"
    )
    env = {"RIBBON_LAWS": "quartic.py"}
    assert "leaves the 1-covered circle at kappa_n L/2pi = 3.370" in command("closed.yaml", env=env).out
    done = command("closed.h5", "--shapes", "1", program=("-m", "branches.plot"), env=env)
    assert (done.returncode, done.out) == (0, "written to closed.pdf\n")
    preview = command("closed.yaml", program=("-m", "branches.graph"), env=env).out
    assert "quartic, twist = 1.5, core = 0.4, (1, 2): circle 1 at 3.370" in preview
    assert command("open.yaml", env=env).returncode == 0
    with h5py.File(tmp_path / "open.h5") as file:
        energy = file["points"]["energy"][-1]
    y = max(root.real for root in np.roots([0.4**2, 0, 1, -4]) if not root.imag)
    assert energy == pytest.approx(y**2 / 2 + 0.4**2 * y**4 / 4, rel=1e-9)


@pytest.mark.full
def test_secondary_branches_and_circles_of_a_law_of_one_s_own(tmp_path, monkeypatch):
    """Its branch (3, 1) has a secondary branch that joins two bifurcations; kappa* of its circles is no straight line."""
    (tmp_path / "quartic.py").write_text(LAW)
    (law,) = laws.laws_of(tmp_path / "quartic.py").values()
    monkeypatch.setitem(laws.LAWS, law.name, law)
    text = "law: quartic\nm: 3\nn: 1\nparameters: {twist: 1.5, core: 0.1}\nlimits: {kappa_n: [-3, 1.15]}\n"
    run_scene(parse(f"{text}stability: true\n", "scene"), tmp_path / "x.h5", Display(silent=True))
    switches = follow_all(tmp_path / "x.h5", tmp_path / "all", [], Progress("", quiet=True))
    assert [switch["outcome"] for switch in switches] == ["followed", "followed", "known", "known"]
    panel = Figure().subplots()
    window = (-2.0, 2.0)
    circles(panel, read(tmp_path / "all"), "quartic, twist = 1.5, core = 0.1", 0.3, window)
    line = panel.lines[0].get_xydata()
    bent = 3 - line[:, 0]
    assert line[:, 1] == pytest.approx(line[:, 0] + bent + 0.1**2 * bent**3, rel=1e-12)  # kappa_n + M1


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (None, "must be a Python file that states laws"),
        ("1 / 0", "cannot be run: division by zero"),
        ("from ribbon_model import RIBBON", "states no law: no name in it is a ribbon_model.Law"),
        (LAW.replace('"quartic"', '"ribbon"'), "the name 'ribbon' must be letters, digits, spaces or -, and none of ribbon,"),
        (LAW.replace('"quartic"', '"a, b"'), "the name 'a, b' must be"),
    ],
)
def test_a_file_with_a_law_that_cannot_be_used(text, said, tmp_path):
    path = tmp_path / "law.py"
    if text is not None:
        path.write_text(text)
    with pytest.raises(contin.ProblemError, match=re.escape(said)) as caught:
        laws.laws_of(path)
    assert str(caught.value).startswith("RIBBON_LAWS: ") and "law.py" in str(caught.value)


@pytest.mark.sample(1)
@pytest.mark.parametrize("name", ["m1_n2", "open_tip"])
def test_newton_s_tolerance_is_a_field_of_scenes(name, root, tmp_path):
    """A looser one leaves more of Newton's error in plain points, and labelled points are as good as before."""
    largest, ends = [], []
    for tolerance in (1e-12, 1e-7):
        scene = load(root / "configs" / f"{name}.yaml", [f"steps.newton_tolerance={tolerance}"])
        assert parse(dump(scene), "again") == scene
        run_scene(scene, tmp_path / "x.h5", Display(silent=True), overwrite=True)
        branch = read_branch(tmp_path / "x.h5")
        largest.append(branch.points["newton_error"].max())
        ends.append(branch.events["energy"])
    assert largest[0] <= 1e-12 < largest[1] <= 1e-7
    assert ends[0] == pytest.approx(ends[1], rel=1e-9, abs=1e-9)
