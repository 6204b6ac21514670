"""Scenes of open strips: what is asked of them, their files, pictures and pages. Their numbers: test_open_independent."""

import math
import signal

import numpy as np
import pytest
from browser import CHROMIUM, Browser

import contin
from branches import export, run
from branches.config import ConfigError, dump, load, parse
from branches.display import Display
from branches.explore import __main__ as page
from branches.explore.gather import gather
from branches.files import StoreError
from branches.open_branch import OpenBranch
from branches.open_job import first_state, run_stages
from branches.read import read_branch

TIP = "material: {law: flat rod, nu: 0.3}\nfinish: free\nstages: [{follow: force_width, to: -6}]\n"
#: Scenes with one mistake, and a part of the sentence.
MISTAKES = {
    "stages: []": "the field 'material' is missing",
    TIP.replace("flat rod", "flat"): "law: 'flat' must be one of",
    TIP.replace("nu: 0.3", "nu: 0.3, mu: 1, Gamma: 2"): "Gamma: is not a number of the law 'flat rod'",
    TIP.replace("nu: 0.3", "nu: x"): "material: nu: must be a number, not 'x'",
    TIP.replace("free", "fre"): "finish: 'fre' must be clamped, hinged, ball joint, free",
    TIP.replace("free", "{rotation: hinged}"): "finish: about: is missing; the rotation 'hinged' needs it",
    TIP.replace("free", "{about: width}"): "finish: about: belongs to the rotation hinged or joint",
    TIP.replace("free", "{slides: width}"): "unknown field 'finish.slides'; the fields are rotation, about",
    TIP.replace("free", "{slides_along: up}"): "must be width, normal, tangent or three numbers, not 'up'",
    TIP.replace("to: -6", "too: -6"): "the field 'stages.0.to' is missing",
    TIP.replace("force_width", "force"): "stage 1: follow: 'force' must be one of the numbers here",
    TIP.replace("-6}", "-6, start_at: BP}"): "stage 1: start_at: the first stage starts from the first state",
    TIP + "closed: {half_twists: 1}\n": "closed: must not be given together with start or finish",
    TIP + "numbers: {distance: 1}\n": "numbers: distance is used by nothing here",
    TIP + "along: {kappa_n: 'exp(x)'}\n": "along: kappa_n: 'exp(x)': 'x' is not allowed",
    TIP + "along: {kappa_n: [[0, 1]]}\n": "a table must have 2 to 12 points",
    TIP + "along: {kappa_n: [[0, 1], [0.5, 2]]}\n": "the places s of a table must increase from 0 to 1",
    TIP + "dimensions: {width: 1}\n": "the field 'dimensions.thickness' is missing",
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
    assert run_stages(load(root / "configs" / "open_tip.yaml"), path, Display(silent=True)) == "complete"
    return path


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
    with pytest.raises(StoreError, match="films and loops"):
        branch.solution(0)


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
    assert [stage["name"].split(", ")[1] for stage in data["families"][0]["branches"]] == [
        "stage 1: force_width", "stage 2: force_width"
    ]  # fmt: skip
    assert export.main([str(tip), "--point", "1", "--out", str(tmp_path / "tip.csv")]) == 0
    assert (tmp_path / "tip.csv").read_text().startswith("s,x,y,z")


@pytest.mark.full
@pytest.mark.skipif(CHROMIUM is None, reason="there is no Chromium")
def test_the_page_in_a_browser(tip, tmp_path):
    pytest.importorskip("websocket", reason="the package websocket-client drives the browser")
    assert page.main([str(tip), "--out", str(tmp_path / "tip.html")]) == 0
    browser = Browser(tmp_path / "chromium")
    try:
        browser.open(tmp_path / "tip.html")
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
    outcome = run_stages(parse(text, "scene"), path, Display(silent=True))
    if outcome == "lost":
        assert "the law 'finite width' goes on" in read_branch(path).stop


@pytest.mark.parametrize(
    "words, sentence",
    [
        (["branches.secondary", "FILE"], "holds no branch with its index on the cell"),
        (["branches.graph", "SCENE"], "no exact solution"),
        (["branches.export", "FILE", "--point", "1", "--movie", "tip.gif"], "films and loops are of closed strips"),
        (["branches.export", "FILE", "--point", "LP", "--out", "tip.csv"], "1 (EP at force_width = 0.0000 of stage 1)"),
    ],
)
def test_what_other_commands_say(tip, root, command, words, sentence):
    places = {"FILE": tip, "SCENE": root / "configs" / "open_tip.yaml"}
    done = command(*[places.get(word, word) for word in words[1:]], program=("-m", words[0]))
    assert done.returncode == 2 and sentence in done.err and done.err.count("\n") == 1


def test_interrupted_and_run_again(root, tmp_path):
    """Ctrl-C keeps the points so far; --resume computes the scene again, to the same points."""

    class Interrupts(Display):
        def stage_point(self, config, stage, point, number):
            if number == 5:
                signal.raise_signal(signal.SIGINT)

    config, path = load(root / "configs" / "open_tip.yaml"), tmp_path / "tip.h5"
    assert run_stages(config, path, Interrupts(silent=True)) == "interrupted"
    assert read_branch(path).status == "interrupted" and len(read_branch(path).points) == 6
    with pytest.raises(StoreError, match="unfinished run of this scene; --resume"):
        run_stages(config, path, Display(silent=True))
    assert run_stages(config, path, Display(silent=True), resume=True) == "complete"
    assert len(read_branch(path).points) > 20


def test_points_that_later_stages_miss(tmp_path):
    """What was computed before is kept, and the reason is a sentence."""
    ring = "material: {law: rod, B1: 1, B2: 1, C: 0.8}\nclosed: {half_twists: 0}\nnumbers: {turn: 13}\n"
    ring += "begin: circle\nphases: [spin]\n"
    stages = "stages: [{follow: turn, to: 14}, {follow: turn, to: 10, start_at: %s}]\n"
    for start_at, sentence in (
        ("BP 1", "stage 2: start_at: 'BP 1': 2 modes are neutral there"), ("LP 1", "stage 2: start_at: 'LP 1' is not among"),
    ):  # fmt: skip
        path = tmp_path / f"{start_at}.h5"
        assert run_stages(parse(ring + stages % start_at, "scene"), path, Display(silent=True)) == "lost"
        branch = read_branch(path)
        assert sentence in branch.stop and set(branch.points["stage"]) == {1}


@pytest.mark.full
def test_a_table_and_a_taper():
    """A table is the polynomial through its points; a strip with half the width at its tip buckles under less weight."""
    text = "material: {law: flat rod, nu: 0.3}\nfinish: free\ndirections: {weight: [-1, 0, 0]}\n"
    text += "stages: [{follow: weight, to: 25}]\n"
    tapered = parse(text + "along: {width: [[0, 1], [0.5, 0.75], [1, 0.5]]}\n", "scene")
    width = tapered.strip().material.datum("width")
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
    assert run_stages(load(root / "configs" / "open_clamped.yaml"), path, Display(silent=True)) == "complete"
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
