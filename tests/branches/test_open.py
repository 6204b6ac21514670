"""Scenes of open strips: what is asked of them, their files, pictures and pages. Their numbers: test_open_independent."""

import math
import re
import signal

import numpy as np
import pytest
from browser import CHROMIUM, Browser

import contin
from branches import secondary
from branches.explore import __main__ as page
from branches.explore.gather import gather
from branches.export import __main__ as export
from branches.graph import __main__ as graph
from branches.graph import open_strips as open_graph
from branches.graph.parts import add
from branches.graph.stored import OPEN_FORMAT, new_graph
from branches.read import read_branch
from branches.run import __main__ as run
from branches.run.display import Display
from branches.run.runner import run_scene
from branches.scene.fields import ConfigError
from branches.scene.open_stage import first_state
from branches.scene.parse import dump, load, parse
from branches.store.files import StoreError
from branches.store.open_branch import OpenBranch

TIP = "material: {law: flat rod, nu: 0.3}\nfinish: free\nstages: [{follow: force_width, to: -6}]\n"
SIZES = (
    "material: {}\nbegin: arch\nroller: {at: 0.5}\nnumbers: {distance: 0.39}\n"
    "dimensions: {width: 10mm, thickness: 0.5mm, length: 0.4, poisson_ratio: 0.3, youngs_modulus: 200GPa}\n"
)
#: Scenes with one mistake, and a part of the sentence.
MISTAKES = {
    "stages: []": "the field 'material' is missing",
    TIP.replace("flat rod", "flat"): "law: 'flat' (did you mean 'flat rod'?) must be one of",
    TIP.replace("nu: 0.3", "nu: 0.3, mu: 1, Gamma: 2"): "Gamma: is not a number of the law 'flat rod'",
    TIP.replace("nu: 0.3", "nu: x"): "material: nu: must be a number, not 'x'",
    TIP.replace("free", "fre"): "finish: 'fre' (did you mean 'free'?) must be clamped, hinged, ball joint, free",
    TIP.replace("free", "{rotation: hinged}"): "finish: about: is missing; the rotation 'hinged' needs it",
    TIP.replace("free", "{about: width}"): "finish: about: belongs to the rotation hinged or joint",
    TIP.replace("free", "{slides: width}"): "unknown field 'finish.slides' (did you mean 'slides_along'?); the fields are",
    TIP.replace("free", "{slides_along: up}"): "must be width, normal, tangent or three numbers, not 'up'",
    TIP.replace("to: -6", "too: -6"): "unknown field 'stages.0.too' (did you mean 'to'?)",
    TIP.replace("force_width", "force"): "stage 1: follow: 'force' must be one of the numbers here",
    TIP.replace("-6}", "-6, start_at: BP}"): "stage 1: start_at: the first stage starts from the first state",
    TIP.replace("-6}", "-6, finish: clamped}"): "stage 1: start, finish, numbers: those of the scene are the first stage's",
    TIP.replace("-6}", "-6}, {follow: force_width, to: 0, finish: clamped}"): "stage 2: follow: 'force_width' must be one of",
    TIP.replace("-6}", "-6}, {follow: force_width, to: 0, numbers: {bend: 1}}"): "stage 2: numbers: 'bend' must be one of",
    TIP + "roller: {at: 1.5}\n": "roller.at: must be below 1, not 1.5",
    TIP + "roller: {at: 0.123456789}\n": "roller: at: 0.123457 must be a multiple of 1/N",
    TIP + "roller: {at: 0.5, held: up}\n": "roller.held: must be width, normal, tangent or three numbers",
    TIP.replace("0.3", "[]"): "material.nu: must be a number, or a list of numbers, not []",
    TIP.replace("0.3", "[0.3, 0.30]"): "the branch nu = 0.3 is listed twice",
    TIP.replace("0.3", "[0.8, 0.9]"): "none of its branches can be run (nu: 0.8 must be",
    TIP.replace("0.3", "[0.2, 0.3]").replace("to: -6", "too: -6"): "unknown field 'stages.0.too' (did you",
    TIP + "closed: {half_twists: 1}\n": "closed: must not be given together with start or finish",
    TIP + "numbers: {distance: 1}\n": "numbers: distance is used by nothing here",
    TIP + "numbers: {weigth: 1}\n": "numbers: weigth (did you mean 'weight'?) is used by nothing here",
    SIZES + "stages: [{follow: rollr, to: -20mm}]\n": "'-20mm' must be a number; 'rollr' (did you mean 'roller'?) has no unit",
    TIP + "along: {kappa_n: 'exp(x)'}\n": "along: kappa_n: 'exp(x)': 'x' is not allowed",
    TIP + "along: {kappa_n: [[0, 1]]}\n": "a table must have 2 to 12 points",
    TIP + "along: {kappa_n: [[0, 1], [0.5, 2]]}\n": "the places s of a table must increase from 0 to 1",
    TIP + "dimensions: {width: 1}\n": "the fields 'dimensions.thickness', 'dimensions.length', 'dimensions",
}  # fmt: skip


@pytest.mark.parametrize("text", MISTAKES)
def test_mistakes_are_told_in_one_sentence(text):
    with pytest.raises(ConfigError) as caught:
        parse(text, "scene")
    assert MISTAKES[text] in str(caught.value) and "\n" not in str(caught.value)


def test_a_scene_is_written_and_read_back(root):
    for file in [*(root / "configs").glob("open_*.yaml"), root / "configs" / "moebius.yaml"]:
        config = load(file)
        assert parse(dump(config), "scene") == config


@pytest.fixture(scope="module")
def tip(tmp_path_factory, root):
    path = tmp_path_factory.mktemp("open") / "open_tip.h5"
    assert run_scene(load(root / "configs" / "open_tip.yaml"), path, Display(silent=True)) == "complete"
    return path


def test_a_run_says_where_stability_ended_and_how_to_go_on(tmp_path, capsys):
    """A strip on edge buckles at 4.0126 sqrt(B C) (Michell, Prandtl), C = 2 B/(1 + nu). The stage that is advised runs."""
    said = []
    for more in ("", ", {follow: force_width, to: -5.1, start_at: BP 1}"):
        scene = parse(TIP.replace("}]", "}" + more + "]"), "scene")
        assert run_scene(scene, tmp_path / f"{bool(more)}.h5", Display(quiet=True)) == "complete"
        out = capsys.readouterr().out
        said.append([line.strip() for line in out.splitlines() if "unstable" in line])
        assert "  stage 1: nothing moves before force_width = -4.977016946\n" in out and out.count("nothing moves") == 1
    assert said[1] == [] and len(said[0]) == 1
    words = r"stage 1: unstable beyond force_width = (\S+) \(BP 1\): a stage with start_at: BP 1 follows .*"
    found = re.fullmatch(words, said[0][0])
    assert float(found[1]) == pytest.approx(-4.0126 * math.sqrt(2 / 1.3), rel=2e-5)


def test_a_run_says_that_stability_ended_at_a_fold(tip):
    """The events of a run of another kind: with a fold in place of its branch point, and one that is stable again."""
    branch = read_branch(tip)
    events = branch.events[branch.events["stage"] == 1]
    events["label"][1], events["force_width"][1] = b"LP", -5.0
    fold = "stage 1: unstable beyond force_width = -5 (LP 1)"
    snaps = "the branch turns back there, and what is pushed further snaps"
    assert branch.stages[0].described(events)[-1] == f"{fold}: {snaps}"
    (events["index_before"][-1], events["index_after"][-1]), events["force_width"][-1] = (1, 0), -4.0
    assert branch.stages[0].described(events)[-1] == f"{fold}, stable again from force_width = -4 on: {snaps}"


def test_the_file(tip):
    branch = read_branch(tip)
    assert isinstance(branch, OpenBranch) and branch.status == "complete"
    assert branch.points["stage"].tolist() == sorted(branch.points["stage"]) and set(branch.points["stage"]) == {1, 2}
    (first, _) = branch.events[branch.events["label"] == b"BP"]
    assert (first["index_before"], first["index_after"], first["breaks"]) == (0, 1, b"plane")
    last = branch.points[-1]
    assert last["F_width"] == pytest.approx(last["force_width"], abs=1e-9)
    assert last["start_F_width"] == pytest.approx(-last["force_width"], abs=1e-9)
    shape = branch.shape(len(branch.points) - 1)
    assert np.allclose(shape.centreline[-1], [last["shear"], last["rise"], last["distance"]], atol=1e-8)
    with pytest.raises(StoreError, match="loops are of closed strips"):
        branch.solution(0)


def test_the_file_is_printed_on_a_screen(tip):
    branch = read_branch(tip)
    lines = repr(branch).splitlines()
    assert lines[0].startswith(f"OpenBranch({branch.about}: {len(branch.points)} points, complete; ")
    assert len(lines) == 1 + len(branch.events) and "of stage 2" in lines[-1]
    strip = branch.scene.strip()
    for found in (strip, strip.problem, branch.shape(0)):
        assert len(repr(found)) < 400 and "\n" not in repr(found) and " 0x" not in repr(found)


def test_run_again_and_resume(tip, root, capsys):
    arguments = [str(root / "configs" / "open_tip.yaml"), "--out", str(tip)]
    assert run.main([*arguments, "--resume"]) == 0
    assert "complete already" in capsys.readouterr().out
    assert run.main([*arguments, "--set", "material.nu=0.2"]) == 2
    assert "holds another scene (material" in capsys.readouterr().err


def test_picture_and_page(tip, tmp_path):
    branch = read_branch(tip)
    assert {piece.stable for piece in branch.pieces()} == {True, False}
    figure = branch.plot(3)
    assert len(figure.axes) == 4
    data = gather([str(tip)])
    assert data["kind"] == "open" and data["shown"] == ["force_width", "shear"]
    assert [one["name"] for one in data["families"][0]["branches"]] == ["stage 1: force_width", "stage 2: force_width"]
    assert export.main([str(tip), "--point", "1", "--out", str(tmp_path / "tip.csv")]) == 0
    assert (tmp_path / "tip.csv").read_text().startswith("s,x,y,z")


@pytest.mark.full
@pytest.mark.skipif(CHROMIUM is None, reason="there is no Chromium")
def test_the_page_in_a_browser(tip, tmp_path):
    pytest.importorskip("websocket", reason="the package websocket-client drives the browser")
    assert page.main([str(tip), "--out", str(tmp_path / "tip.html")]) == 0
    browser = Browser(tmp_path / "chromium")
    try:
        browser.open(tmp_path / "tip.html", address=f"#branch={tip.stem}_2&point=10")  # a bent strip has many colours
        assert browser.colours("#diagram") > 20 and browser.colours("#ribbon") > 20
        assert browser.errors == []
    finally:
        browser.close()


@pytest.mark.full
def test_dimensions_scale_the_numbers(tmp_path):
    """A strip in SI units is the dimensionless one with Gamma = w**2/(h L); forces are in B/L**2."""
    sizes = "{width: 0.02, thickness: 0.0005, length: 0.3, poisson_ratio: 0.3, youngs_modulus: 200.0e9}"
    stages = "begin: arch\nstages: [{follow: distance, to: %s}]\n"
    real = parse(f"material: {{}}\ndimensions: {sizes}\nnumbers: {{distance: 0.27}}\n" + stages % 0.26, "scene")
    Gamma = 0.02**2 / (0.0005 * 0.3)
    same = parse(
        f"material: {{law: finite width, nu: 0.3, Gamma: {Gamma!r}}}\nnumbers: {{distance: 0.9}}\n" + stages % 0.8, "s"
    )
    forces = [config.strip().reactions(first_state(config))["F_tangent"] for config in (real, same)]
    assert forces[0] == pytest.approx(forces[1], rel=1e-10)
    B = 200e9 * 0.0005**3 * 0.02 / (12 * (1 - 0.3**2))
    assert math.isclose(real.factor("F_tangent"), B / 0.3**2) and real.unit("F_tangent") == "N"
    assert math.isclose(real.factor("M_width"), B / 0.3) and real.unit("energy") == "J"


@pytest.mark.full
def test_the_ribbon_ends_where_its_bending_vanishes(tmp_path):
    """Twisted back to straight, the arc passes a place without bending: the run says so, and names the law that goes on."""
    text = "material: {law: ribbon, nu: 0.3, kappa_n: 3}\nstages: [{follow: swing, to: 1.5}]\n"
    path = tmp_path / "ribbon.h5"
    outcome = run_scene(parse(text, "scene"), path, Display(silent=True))
    if outcome == "lost":
        assert "the law 'finite width' goes on" in read_branch(path).stop


@pytest.mark.full
def test_a_film_of_an_open_strip(tip, tmp_path):
    assert export.main([str(tip), "--movie", str(tmp_path / "tip.gif"), "--frames", "3"]) == 0
    assert (tmp_path / "tip.gif").read_bytes().startswith(b"GIF89a")


@pytest.mark.parametrize(
    "main, words, sentence",
    [
        (secondary.main, ["FILE"], "holds no branch with its index on the cell"),
        (graph.main, ["SCENE"], "no exact solution"),
        (export.main, ["FILE", "--point", "LP", "--out", "tip.csv"], "1 (EP at force_width = 0.0000 of stage 1)"),
    ],
    ids=["secondary", "graph", "export"],
)
def test_what_other_commands_say(tip, root, call, main, words, sentence):
    places = {"FILE": tip, "SCENE": root / "configs" / "open_tip.yaml"}
    done = call(main, *[places.get(word, word) for word in words])
    assert done.returncode == 2 and sentence in done.err and done.err.count("\n") == 1


@pytest.mark.full
def test_interrupted_and_run_again(tip, root, tmp_path, tables):
    """Ctrl-C keeps the points so far; --resume goes on from there, in any stage, to the same bits."""
    config, path = load(root / "configs" / "open_tip.yaml"), tmp_path / "tip.h5"
    shown = []

    class Interrupts(Display):
        def __init__(self, at):
            super().__init__(silent=True)
            self.at = at

        def point(self, stage, point, number, step):
            shown.append(number)
            if number == self.at:
                signal.raise_signal(signal.SIGINT)

    stage = read_branch(tip).points["stage"]
    places = [0, 5, int(np.flatnonzero(stage == 2)[0]), len(stage) - 2]
    for place in places:
        assert run_scene(config, path, Interrupts(place), resume=place > 0) == "interrupted"
        assert read_branch(path).status == "interrupted" and len(read_branch(path).points) == place + 1
    with pytest.raises(StoreError, match="unfinished run of this scene; --resume"):
        run_scene(config, path, Display(silent=True))
    assert run_scene(config, path, Interrupts(None), resume=True) == "complete"
    assert shown == sorted(shown) and len(shown) < len(stage) + len(places)  # nothing is computed twice but ends inside a step
    assert tables(path) == tables(tip)


@pytest.mark.full
def test_a_scene_with_further_stages_goes_on(tip, root, tmp_path, tables):
    """The file of the first stage alone becomes that of both."""
    both, path = load(root / "configs" / "open_tip.yaml"), tmp_path / "tip.h5"
    one = both.model_copy(update={"stages": both.stages[:1]})
    assert run_scene(one, path, Display(silent=True)) == "complete"
    assert run_scene(both, path, Display(silent=True), resume=True) == "complete"
    assert tables(path) == tables(tip)
    other = both.model_copy(update={"stages": [both.stages[1], both.stages[1]]})
    with pytest.raises(StoreError, match="holds another scene"):
        run_scene(other, path, Display(silent=True), resume=True)


@pytest.mark.full
def test_a_scene_of_many_strips(call, tmp_path):
    """Lists give one result for each combination, and one graph: the tip loads of Michell, 4.0126 sqrt(2/(1 + nu))."""
    (tmp_path / "tip.yaml").write_text(TIP.replace("nu: 0.3", "nu: [0.2, 0.9, 0.5]").replace("to: -6", "to: [-5, -6]"))
    done = call(run.main, "tip.yaml", "--out", "tips", "--workers", "1")
    assert done.returncode == 0 and "4 branches" in done.out
    assert "left out: nu = 0.9, stage 1 to = -5: nu: 0.9 must be" in done.out
    assert sorted(path.name for path in (tmp_path / "tips").glob("*.h5")) == [
        f"nu{nu}_stage_1_to{to}.h5" for nu in (0.2, 0.5) for to in (-5, -6)
    ]  # fmt: skip
    diagram = graph.read(tmp_path / "tips")
    found = {data["nu"]: data["force_width"] for _, data in diagram.nodes(data=True) if data["kind"] == "branch point"}
    for nu, force in found.items():
        assert force == pytest.approx(-4.012599 * math.sqrt(2 / (1 + nu)), rel=1e-6)
    assert len(found) == 2 and diagram.number_of_edges() == 7  # that of nu = 0.2 is beyond -5
    listed = call(graph.main, "tips")
    assert "nu = 0.2, stage 1 to = -5\n  stage 1, force_width: 0 -> -5\n" in listed.out
    assert "nu = 0.5, stage 1 to = -5\n  stage 1, force_width: 0 -> branch point at -4.63" in listed.out
    for words in (["tips", "--at", "3"], ["tips", "--folds", "0", "1"]):
        refused = call(graph.main, *words)
        assert refused.returncode == 2 and "without --where, --at and --folds" in refused.err
    again = call(run.main, "tip.yaml", "--out", "tips")
    assert again.returncode == 0 and "4 of them computed before" in again.out
    (tmp_path / "tip.yaml").write_text(TIP.replace("nu: 0.3", "nu: [0.2, 0.4]"))
    other = call(run.main, "tip.yaml", "--out", "tips")
    assert other.returncode == 2 and "holds another scene" in other.err


def test_where_lists_stand_in_place_of_numbers():
    """Of the material, the ends of stages and the roller; a direction and a table are lists in any case."""
    text = TIP.replace("flat rod", "[flat rod, ribbon]").replace("to: -6", "to: -6, numbers: {}")
    text += "roller: {at: [0.25, 0.5], held: [0, 1, 0]}\nalong: {kappa_n: [[0, 1], [1, 2]]}\n"
    sweep = parse(text, "scene")
    assert sweep.numbers["lawribbon_roller_at0.5.h5"] == {"law": "ribbon", "roller at": 0.5} and len(sweep.scenes) == 4
    assert parse(dump(sweep), "scene") == sweep


def test_a_stage_begins_at_the_node_of_the_one_before(tip):
    """The graph of one result: the second stage leaves the branch point of the first one."""
    one = new_graph("", OPEN_FORMAT)
    add(one, open_graph.part(read_branch(tip), "tip.h5", {"nu": 0.3}))
    edges = [(data["ends"], data["stage"], data["index"]) for *_, data in one.edges(data=True)]
    point = edges[0][0][1]
    assert "stage 1, branch point" in point and [ends[0] for ends, stage, _ in edges if stage == 2] == [point]
    assert [index for *_, index in edges] == [0, 1, 0]


@pytest.mark.full
def test_points_that_later_stages_miss(tmp_path):
    """What was computed before is kept, and the reason is a sentence."""
    ring = "material: {law: rod, B1: 1, B2: 1, C: 0.8}\nclosed: {half_twists: 0}\nnumbers: {turn: 13}\n"
    ring += "begin: circle\nphases: [spin]\n"
    stages = "stages: [{follow: turn, to: 14}, {follow: turn, to: 10, start_at: %s}]\n"
    for start_at, sentence in (
        ("BP 1", "stage 2: start_at: 'BP 1': 2 modes are neutral there"), ("LP 1", "stage 2: start_at: 'LP 1' is not among"),
    ):  # fmt: skip
        path = tmp_path / f"{start_at}.h5"
        assert run_scene(parse(ring + stages % start_at, "scene"), path, Display(silent=True)) == "lost"
        branch = read_branch(path)
        assert sentence in branch.stop and set(branch.points["stage"]) == {1}


@pytest.mark.full
def test_an_arch_under_a_roller(root, tmp_path):
    """Symmetric about its middle until it leaves for the branch on which it snaps through; then its second mode grows.

    It meets the roller where the first state touches it, and leaves it where the force is zero: at half of the way by symmetry.
    """
    path = tmp_path / "roller.h5"
    assert run_scene(load(root / "configs" / "open_roller.yaml"), path, Display(silent=True)) == "complete"
    branch = read_branch(path)
    (first, *_) = branch.events[branch.events["label"] == b"BP"]
    assert (first["index_before"], first["index_after"]) == (0, 1)
    through = branch.points[branch.points["stage"] == 2]
    met, lost, left = branch.events[branch.events["label"] == b"BC"]
    assert met["name"] == b"roller touches: goes on" and met["roller"] == pytest.approx(0.0894671648, abs=1e-9)
    assert lost["name"] == left["name"] == b"roller lifts off: fold" and (left["index_before"], left["index_after"]) == (0, 1)
    assert left["roller"] == pytest.approx(0.0, abs=1e-9) and abs(left["F_roller"]) < 1e-9 and lost["roller"] < 0
    last = int(np.argmin(through["roller"]))
    assert set(through["index"][2:last]) == {0} and through["F_roller"].max() < 1e-9
    shape = branch.shape(int(np.flatnonzero(branch.points["stage"] == 2)[last]))
    assert np.interp(0.5, shape.arclength, shape.centreline[:, 1]) == pytest.approx(0.0, abs=1e-9)
    sums = through["F_normal"] + through["start_F_normal"] + through["F_roller"]
    assert np.abs(sums).max() < 1e-8


@pytest.mark.full
def test_ends_that_change(root, tmp_path):
    """States agree whether a number or its conjugate is prescribed, and the fold is that of the moment."""
    path = tmp_path / "release.h5"
    assert run_scene(load(root / "configs" / "open_release.yaml"), path, Display(silent=True)) == "complete"
    branch = read_branch(path)
    stages = [branch.points[branch.points["stage"] == number] for number in (1, 2, 3, 4)]
    for before, after in ((stages[0], stages[1]), (stages[2], stages[3])):
        for name in ("distance", "energy", "F_tangent", "M_width", "F_normal"):
            assert after[0][name] == pytest.approx(before[-1][name], rel=1e-8, abs=1e-8)
    assert stages[1][0]["force_tangent"] == pytest.approx(stages[0][-1]["F_tangent"], rel=1e-8)
    assert stages[3][0]["moment"] == pytest.approx(stages[2][-1]["M_width"], rel=1e-8)
    assert stages[0][0]["moment"] == 0 and stages[3][0]["distance"] == pytest.approx(0.9)
    (fold,) = branch.events[branch.events["label"] == b"LP"]
    assert (fold["stage"], fold["index_before"], fold["index_after"]) == (4, 0, 1)
    assert branch.plot(3).axes and len(branch.strains(len(branch.points) - 1))


@pytest.mark.full
def test_ends_that_let_go_of_a_moment(tmp_path):
    """The run ends with what is not carried, and keeps what was computed."""
    text = "material: {law: rod, B1: 1, B2: 4, C: 0.8}\nnumbers: {distance: 0.98}\nbegin: arch\n"
    text += "stages: [{follow: distance, to: 0.97}, {follow: distance, to: 0.9, finish: ball joint}]\n"
    path = tmp_path / "arch.h5"
    assert run_scene(parse(text, "scene"), path, Display(silent=True)) == "lost"
    branch = read_branch(path)
    assert branch.stop.startswith("stage 2: start, finish: they let go of what no load replaces") and len(branch.points) > 2


@pytest.mark.full
def test_a_table_and_a_taper():
    """A table is the polynomial through its points; a strip with half the width at its tip buckles under less weight."""
    text = "material: {law: flat rod, nu: 0.3}\nfinish: free\ndirections: {weight: [-1, 0, 0]}\n"
    text += "stages: [{follow: weight, to: 25}]\n"
    tapered = parse(text + "along: {width: [[0, 1], [0.5, 0.75], [1, 0.5]]}\n", "scene")
    width = tapered.strip().section.datum("width")
    assert [width(s, None) for s in (0, 0.25, 1)] == pytest.approx([1, 0.875, 0.5])
    found = []
    for config in (parse(text, "scene"), tapered):
        start = first_state(config)
        branch = contin.trace(start, free=["weight"], limits={"weight": (-1, 25)})
        found.append(branch.labelled("BP")[0]["weight"])
    assert found[1] < found[0]


@pytest.mark.full
def test_the_snap_of_the_clamped_strip(root, tmp_path):
    """At the fold the stable branch ends; it snaps to the one that was left, whose energy at this turn is interpolated."""
    path = tmp_path / "clamped.h5"
    assert run_scene(load(root / "configs" / "open_clamped.yaml"), path, Display(silent=True)) == "complete"
    branch = read_branch(path)
    (snap,) = branch.snaps()
    fold = next(event for event in branch.events if event["label"] == b"LP" and event["stage"] == 3)
    assert snap.row == fold["point"] and fold["index_before"] == 0 and fold["index_after"] == 1
    before = branch.points[branch.points["stage"] == 2]
    nearest = before[np.argmin(abs(before["turn"] - fold["turn"]))]
    # dE/dturn is the moment, so the nearest point gives the energy up to the square of the distance
    below = nearest["energy"] + nearest["M_tangent"] * (fold["turn"] - nearest["turn"])
    assert snap.released == pytest.approx(fold["energy"] - below, rel=1e-3)
    assert snap.to["M_tangent"] == pytest.approx(nearest["M_tangent"], abs=0.3)


def test_notes_of_stages(tmp_path, capsys):
    """What a stage notes is printed and kept: here that a phase holds a mode which no symmetry makes."""
    scene = "material: {law: rod, B1: 1, B2: 1, C: 0.8}\nfinish: free\nnumbers: {force_tangent: -9}\nphases: [spin]\n"
    config = parse(scene + "stages: [{follow: force_tangent, to: -10}, {follow: force_tangent, to: -12}]\n", "scene")
    assert run_scene(config, tmp_path / "column.h5", Display(quiet=True)) == "complete"
    notes = read_branch(tmp_path / "column.h5").notes
    shown = capsys.readouterr().out
    assert [note[:16] for note in notes] == [f"stage {i}: phases:" for i in (1, 1, 2, 2)]
    assert len(set(notes)) == 4 and all(note in shown for note in notes)
    assert "the index 1 at EP" in notes[0] and "makes this branch point, which gets no label" in notes[3]


def test_a_phase_that_no_symmetry_implies_is_not_taken(tmp_path):
    """A circle that is cut, turned at one end, and joined."""
    scene = "material: {law: rod, B1: 1, B2: 1, C: 0.8, kappa_n: 6.283185307179586}\nphases: ['shift, right']\n"
    config = parse(f"{scene}stages: [{{follow: turn, to: 1}}]\n", "scene")
    with pytest.raises(ConfigError, match="phases: lam_phase_shift_right grows along the branch at the start"):
        run_scene(config, tmp_path / "cut.h5", Display(silent=True))


# --- sizes of states and numbers ------------------------------------------------------------------------------------------


@pytest.mark.full
@pytest.mark.parametrize("B2", [1.0001, 1.001, 1.01])
def test_a_strip_whose_components_are_small_at_first(B2, tmp_path):
    """A rod that is nearly isotropic: half a twist leaves the circle plane but for (B2 - 1)**2, which is no size of its place.

    At B2 = 1 bending and twist are even, and the energy is (2 pi)**2/2 + pi**2/2; at B2 = 10 it is that of the branch from 1.2
    on, on 40 intervals.
    """
    text = (
        f"material: {{law: rod, B1: 1, B2: {B2}, C: 1}}\nclosed: {{half_twists: 1}}\nbegin: circle\nphases: ['shift, left']\n"
        "stages: [{follow: B2, to: 10}]\n"
    )
    assert run_scene(parse(text, "scene"), tmp_path / "moebius.h5", Display(silent=True)) == "complete"
    branch = read_branch(tmp_path / "moebius.h5")
    assert len(branch.points) < 40
    first, last = branch.events[0], branch.events[-1]
    assert first["energy"] == pytest.approx(2.5 * math.pi**2, rel=(B2 - 1))
    assert last["energy"] == pytest.approx(37.24952826, abs=1e-8) and last["error_energy"] < 1e-10


@pytest.mark.full
def test_a_stage_that_begins_at_round_off(tmp_path, capsys):
    """A weight that was taken to zero and is 1e-29 there: the next stage goes on as from zero, and zero is what is printed."""
    text = (
        "material: {law: rod, B1: 1, B2: 4, C: 0.8}\nfinish: free\n"
        "stages: [{follow: weight, to: 5}, {follow: weight, to: -5}, {follow: weight, to: 0}, {follow: weight, to: 3}]\n"
    )
    assert run_scene(parse(text, "scene"), tmp_path / "weight.h5", Display()) == "complete"
    branch = read_branch(tmp_path / "weight.h5")
    assert len(branch.points) < 60 and branch.events[-1]["weight"] == pytest.approx(3, rel=1e-15)
    forth = [event["rise"] for event in branch.events if math.isclose(abs(event["weight"]), 5)]
    assert forth == pytest.approx([-0.4959050446, -0.4959050446, 0.4959050446, 0.4959050446], abs=1e-9)
    assert not re.search(r"(weight = |EP .*[ \d.])e-\d\d ", capsys.readouterr().out)


def test_sizes_of_an_open_strip():
    """Places and angles have the size of the length; forces and moments have one size."""
    scene = parse(
        "material: {law: rod, B1: 1.0e-3, B2: 2, C: 2.0e-3}\nnumbers: {distance: 0.9}\nbegin: arch\n"
        "stages: [{follow: distance, to: 0.8}]\n", "scene"
    )  # fmt: skip
    strip, point = scene.strip(), first_state(scene)
    sizes = strip.sizes(point.system, point.x)
    assert {sizes[name] for name in ("q0", "q3", "x1", "x3", "distance", "turn")} == {1.0}
    forces = {size for name, size in sizes.items() if name.startswith(("lam_", "sigma_"))}
    states = point.system.states(point.x)
    assert (
        forces == {max(abs(states[:, 7:]).max(), *(abs(point[name]) for name in strip.problem.multipliers))}
        and "B1" not in sizes
    )
