"""Scenes of networks: their values against closed forms and shooting, their files, pictures and sentences."""

import functools
import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml
from scipy.optimize import brentq
from test_explore import decoded

from branches.draw.strip import reach_of, rendered
from branches.explore.gather import gather
from branches.export.__main__ import main as export
from branches.read import read_branch
from branches.run.barriers import falls, places, report, told
from branches.run.display import Display
from branches.run.runner import run_scene
from branches.scene.fields import ConfigError
from branches.scene.network import NetworkScene
from branches.scene.open_stage import OpenStage
from branches.scene.parse import dump, load, parse
from contin import ContinError, trace
from ribbon_model.descent import PAST
from ribbon_model.network import START, column
from ribbon_model.network_first import first_state
from tests.ribbon_model.test_network_independent import Shooting

ROD = "{law: rod, B1: 1.0, B2: 1.0, C: 0.75}"
#: A cantilever in two pieces, with a load at its tip.
CANTILEVER = f"""
material: {ROD}
strips:
  a: {{begin: [0, 0, 0], end: [0, 0, 0.4], normal: [0, 1, 0]}}
  b: {{after: a, length: 0.6}}
joints:
  A: [a start]
  cut: [a finish, b start]
  tip: [b finish]
held: {{A: clamped}}
loads:
  P: {{tip: [0, 0, -1]}}
stages:
  - {{follow: P, to: 3.0}}
"""


@pytest.fixture
def run(tmp_path):
    def of(text):
        path = tmp_path / "result.h5"
        assert run_scene(parse(text, "scene.yaml"), path, Display(silent=True), overwrite=True) == "complete"
        return read_branch(path)

    return of


@pytest.fixture(scope="module")
def shipped(root, tmp_path_factory):
    """A function that returns the result of a shipped scene, which is run once. Tests only read it."""
    folder = tmp_path_factory.mktemp("shipped")

    @functools.cache
    def of(name):
        path = folder / f"{name}.h5"
        assert run_scene(load(root / "configs" / f"{name}.yaml"), path, Display(silent=True)) == "complete"
        return path

    return of


@pytest.fixture(scope="module")
def frame(root, tmp_path_factory):
    """The shipped portal frame, past the load at which it sways. Tests only read it."""
    text = (root / "configs" / "network_portal.yaml").read_text("utf-8").replace("to: 9.0", "to: 7.5")
    path = tmp_path_factory.mktemp("frame") / "network_portal.h5"
    scene = parse(
        text.replace("stages:\n  - {follow: P, to: 12.0}", "numbers: {P: 7.2}\nstages:\n  - {follow: P, to: 7.6}"), "frame"
    )
    assert run_scene(scene, path, Display(silent=True)) == "complete"
    return path


def _events(branch, label, name, stage=1):
    rows = branch.events[(branch.events["label"] == label.encode()) & (branch.events["stage"] == stage)]
    return [(float(row[name]), float(row[f"error_{name}"]), int(row["index_before"]), int(row["index_after"])) for row in rows]


CONFIGS = Path(__file__).parents[2] / "configs"
RODS = sorted(path.stem for path in CONFIGS.glob("network_*.yaml") if "law: rod" in path.read_text("utf-8"))
#: Scenes of many strips or of long branches.
LONG = (
    "network_arch", "network_arches", "network_bigon", "network_bigon_ring", "network_hexagon", "network_hexagram",
    "network_loop", "network_overcurved", "network_portal", "network_right_angle",
    "network_weight",
)  # fmt: skip
#: Scene, followed number, and the first special point of its first stage: closed forms, see tests/ribbon_model/test_network.py.
KNOWN = {
    "network_portal": ("P", "BP", 2.71645974768613**2, (0, 1)),
    "network_right_angle": ("M", "BP", math.pi * math.sqrt(1.526717557251908 / 2), (0, 1)),
    "network_ring_pressure": ("pressure", "BP", 3.0, (0, 1)),
    "network_hexagon": ("kappa_n", "BP", 1.0088095252717388, (0, 2)),
    "network_loop": ("kappa_n", "BP", 5 * math.pi, (0, 2)),
    "network_overcurved": (
        "kappa_n", "BP",
        2 * math.pi * (1 + (-(1 / 16 + 1 / 1.5) + math.sqrt((1 / 16 + 1 / 1.5) ** 2 + 12 / 24)) * 12), (0, 2),
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", [pytest.param(name, marks=pytest.mark.full) if name in LONG else name for name in KNOWN])
def test_shipped_scenes_have_their_closed_forms(shipped, name):
    number, label, known, change = KNOWN[name]
    branch = read_branch(shipped(name))
    value, error, *changes = _events(branch, label, number)[0]
    assert value == pytest.approx(known, abs=max(error, 1e-10))
    assert error < 1e-9
    assert tuple(changes) == change
    if "floating" in branch.points.dtype.names:
        assert branch.points["floating"].max() < 1e-7


@pytest.mark.full
def test_the_hexagon_as_far_as_its_first_bifurcation(run, root):
    """Where two modes meet; the whole scene takes long, and `tests/ribbon_model/test_network.py` has all its bifurcations."""
    text = (root / "configs" / "network_hexagon.yaml").read_text("utf-8")
    branch = run(text[: text.index("  - {follow: kappa_n, to: 4.0")].replace("to: 3.5", "to: 1.2"))
    ((value, error, *changes),) = _events(branch, "BP", "kappa_n")
    assert value == pytest.approx(KNOWN["network_hexagon"][2], abs=max(error, 1e-10))
    assert error < 1e-9 and changes == [0, 2]
    assert branch.points["floating"].max() < 1e-7


@pytest.mark.parametrize("name", [pytest.param(name, marks=pytest.mark.full) if name in LONG else name for name in RODS])
def test_shooting_finds_the_same_states(name, shipped):
    """Of all shipped networks of rods. Where Newton's method ends, places, reactions and energy are those of the scene."""
    path = shipped(name)
    branch = read_branch(path)
    for stage in np.unique(branch.stage_of):
        row = int([point for point in branch.kept() if branch.stage_of[point] == stage][-1])
        network, (_, states) = branch.scene.strip(int(stage)), branch.states_at(row)
        numbers = branch._numbers(row)
        shooting = Shooting(network, numbers)
        both, moved = shooting.solved([states[0, list(piece.at)] for piece in network.problem.pieces])
        size = 1 + max(np.abs(states[:, list(piece.at[11:14])]).max() for piece in network.problem.pieces)
        assert moved < 1e-8 * size, f"{name}, stage {stage}"
        assert sum(energy for *_, energy in both) == pytest.approx(float(branch.points["energy"][row]), abs=1e-9 * size)
        for joint_name, joint in network.joints.items():
            each = joint.members[0]
            end = both[shooting.order.index(each.member)][0 if each.end == START else 1]
            if len(joint.members) == 1 and joint_name in network.held and not network.loads:
                pulls = [float(branch.points[f"F_{joint_name}_{x}"][row]) for x in "xyz"]
                assert end.force == pytest.approx(pulls, abs=1e-8 * size)
            place = end.place + end.frame @ each.arm
            assert place == pytest.approx(
                [float(branch.points[f"{column(joint_name)}_{x}"][row]) for x in "xyz"], abs=1e-9 * size
            )


@pytest.mark.full
def test_the_determinant_vanishes_where_a_bigon_buckles(shipped):
    """3.682897251: of the flat bigon of 60 degrees, C = .75; central differences leave 1e-8."""
    branch = read_branch(shipped("network_bigon"))
    network, (_, states) = branch.scene.strip(), branch.states_at(0)
    buckling = _events(branch, "BP", "kappa_n")[0][0]

    def determinant(kappa_n):
        shooting, starts = Shooting(network, {**branch._numbers(0), "kappa_n": kappa_n}), []
        for piece in network.problem.pieces:
            state = states[0, list(piece.at)].copy()
            state[7:11] *= 1 - kappa_n / (math.pi / 3)  # M = B1 (2 alpha - kappa_n)
            starts.append(state)
        bases, x, both = shooting.begun(starts)
        assert np.abs(shooting.missed(both)).max() < 1e-10
        return np.linalg.det(shooting.slopes(bases, x, 1e-5))

    assert brentq(determinant, buckling - 1e-3, buckling + 1e-3, xtol=1e-9) == pytest.approx(buckling, abs=3e-8)


@pytest.mark.full
def test_a_closed_strip_with_a_phase(shipped):
    """The fold of (1, 2) without symmetry; `tests/ribbon_model/test_network_loop.py` compares more."""
    ((fold, error, *change),) = _events(read_branch(shipped("network_loop")), "LP", "kappa_n", 2)
    assert fold / (2 * math.pi) == pytest.approx(4.0756675352654635, abs=max(error, 1e-10))
    assert change == [0, 1]


def test_loads_that_follow_have_no_index(root, tmp_path):
    """The scene of a hanging loop, under a pressure that follows it."""
    text = (root / "configs" / "network_weight.yaml").read_text("utf-8").replace("weight", "follower_pressure")
    path, display = tmp_path / "result.h5", Display(silent=True)
    assert run_scene(parse(text.replace("to: 400.0", "to: 20.0"), "scene.yaml"), path, display) == "complete"
    branch = read_branch(path)
    assert set(branch.points["index"]) == {-1}
    assert branch.columns.all["follower_pressure"].words == "pressure that stays normal to the strips, per length"


def test_a_phase_of_a_network_that_is_held(root):
    text = (root / "configs" / "network_loop.yaml").read_text("utf-8")
    with pytest.raises(ConfigError, match="phase: a network that is held does not shift"):
        parse("held: {J: clamped}\n" + text, "scene.yaml")


@pytest.mark.full
def test_the_portal_frame_in_all_stages(shipped):
    """In its plane it sways at 2.716**2 = 7.379 and leaves it at (pi/2)**2 B2 = 9.870 (clamped columns, B2 = 4)."""
    branch = read_branch(shipped("network_portal"))
    (sway, *_), (out, *_) = _events(branch, "BP", "P")
    assert sway == pytest.approx(2.71645974768613**2, abs=1e-10)
    assert out == pytest.approx((math.pi / 2) ** 2 * 4, abs=1e-10)
    assert np.ptp(branch.points["F_A_y"] + branch.points["F_D_y"] - 2 * branch.points["P"]) < 1e-8
    assert branch.conjugate("P") == "B_y"


def test_the_ring_under_pressure_touches_itself(shipped):
    branch = read_branch(shipped("network_ring_pressure"))
    last = branch.points[-1]
    gap = math.dist([last[f"A_{x}"] for x in "xyz"], [last[f"B_{x}"] for x in "xyz"])
    side = abs(last["side_y"] + 1)  # of the other branch, the sides come together: they move by the radius
    assert (
        gap == pytest.approx(0, abs=1e-8) or side == pytest.approx(0, abs=1e-8) or last["side_z"] == pytest.approx(0, abs=1e-8)
    )


def test_a_place_along_a_strip_is_a_joint(run):
    """A load in the middle of a clamped strip is that of the strip in two pieces: half of the load at both ends."""
    text = f"""
material: {ROD}
strips:
  beam: {{begin: [0, 0, 0], end: [0, 0, 1], normal: [0, 1, 0]}}
joints: {{A: [beam start], B: [beam finish]}}
held: {{A: clamped, B: {{rotation: clamped, slides_along: [0, 0, 1]}}}}
loads:
  P: {{beam at 0.5: [0, -1, 0]}}
stages:
  - {{follow: P, to: 1.0}}
"""
    branch = run(text)
    last = branch.points[-1]
    assert last["F_A_y"] == pytest.approx(0.5, abs=1e-9)
    assert last["F_B_y"] == pytest.approx(0.5, abs=1e-9)
    assert -last["beam_at_0_5_y"] == pytest.approx(1 / 192, rel=2e-3)  # P L^3 / 192 B for small loads


@pytest.mark.full
def test_pieces_of_a_cut_strip_have_names_that_no_strip_has(run):
    """A cut strip s beside one with the name s_1: each bears its own load; loads in two spellings of one place add up."""
    text = f"""
material: {ROD}
strips:
  s: {{begin: [0, 0, 0], end: [0, 0, 1], normal: [0, 1, 0]}}
  s_1: {{begin: [1, 0, 0], end: [1, 0, 1], normal: [0, 1, 0]}}
joints: {{A: [s start], B: [s_1 start]}}
held: {{A: clamped, B: clamped}}
loads: {{P: {{s at 0.5: [0, -1, 0]}}, Q: {{s at .5: [0, -1, 0], s_1 finish: [0, -1, 0]}}}}
numbers: {{Q: 0.25}}
stages:
  - {{follow: P, to: 0.5}}
"""
    branch = run(text)
    assert list(branch.scene.strip().joints) == ["A", "B", "s at 0.5", "s_1 finish"]
    last = branch.points[-1]
    assert (last["F_A_y"], last["F_B_y"]) == pytest.approx((0.75, 0.25), abs=1e-9)
    assert last["s_at_0_5_y"] == pytest.approx(-0.75 / 24, rel=2e-2) and last["s_1_finish_y"] == pytest.approx(
        -0.25 / 3, rel=2e-2
    )


#: Roorda's frame: a column and a beam of equal lengths, both on hinges, in the plane of two axes (u, v).
ROORDA = """
material: {{law: rod, B1: 1.0, B2: 4.0, C: 0.8}}
strips:
  column: {{begin: {o}, end: {u}, normal: {v}}}
  beam: {{begin: {u}, end: {uv}, normal: {u}}}
joints: {{A: [column start], K: [column finish, beam start], B: [beam finish]}}
held: {{A: hinged, B: hinged}}
loads: {{P: {{K: {down}}}}}
numbers: {{P: 13.0}}
stages:
  - {{follow: P, to: 14.5}}
"""


@pytest.mark.sample(1)
@pytest.mark.parametrize("plane", ["yz", "xy"])
def test_hinges_are_those_of_the_strip_in_whatever_plane_it_is_drawn(tmp_path, capsys, plane):
    """A moment 1 at K turns the end of the column by (1 - k / tan k) / k**2, k**2 = P, and that of the beam by 1/3."""
    u, v = (np.eye(3, dtype=int)["xyz".index(axis)] for axis in plane)
    text = ROORDA.format(o=[0, 0, 0], u=u.tolist(), v=v.tolist(), uv=(u + v).tolist(), down=(-u).tolist())
    run_scene(parse(text, "scene.yaml"), tmp_path / "frame.h5", Display())
    branch = read_branch(tmp_path / "frame.h5")
    ((value, error, *changes),) = _events(branch, "BP", "P")
    k = brentq(lambda k: (1 - k / math.tan(k)) / k**2 + 1 / 3, 3.2, 4.4, xtol=1e-15)
    assert value == pytest.approx(k**2, abs=1e-9) and changes == [0, 1]
    axis = np.cross(u, v)
    assert f"held: A: about: width is the direction ({', '.join(str(abs(x)) for x in axis)})" in capsys.readouterr().out


@pytest.mark.full
def test_what_a_file_holds(run, tmp_path):
    """Columns, words, shapes; the scene is written and read back; the picture has every member."""
    branch = run(CANTILEVER)
    assert parse(dump(branch.scene), "again") == branch.scene
    shape = branch.shape(0)
    assert len(shape.parts) == 2
    assert shape.centreline[-1] == pytest.approx([0, 0, 1], abs=1e-12)
    assert branch.columns.all["F_A_z"].words == "force on the network at A, along z"
    assert _events(branch, "BP", "P")[0][0] == pytest.approx((math.pi / 2) ** 2, abs=1e-10)  # Euler's column, double
    branch.plot(shapes=2).savefig(tmp_path / "picture.png")
    nodes = len(shape.parts[0].arclength)
    assert branch.strains(0) == pytest.approx(np.zeros((2 * nodes, 3)), abs=1e-12)
    placed, _ = branch.placed(0, 12.0, 100)  # the longest strip has 0.6 of the length
    assert [part.arclength[-1] for part in placed.parts] == pytest.approx([8.0, 12.0])
    assert sum(len(part.arclength) - 1 for part in placed.parts) >= 100


@pytest.mark.full
def test_a_run_that_is_interrupted_goes_on(root, tmp_path, monkeypatch, shipped):
    """Interrupted in its second stage and resumed, a scene gives the points of a run in one go, up to their errors."""
    import branches.run.runner as runner

    scene, parts = load(root / "configs" / "network_portal.yaml"), tmp_path / "parts.h5"

    class Soon(runner.Interruption):
        def __init__(self):
            super().__init__(())
            self._points = 0

        @property
        def asked(self):
            self._points += 1
            return self._points > 30

        @asked.setter
        def asked(self, value):
            pass

    with monkeypatch.context() as patched:
        patched.setattr(runner, "Interruption", Soon)
        assert run_scene(scene, parts, Display(silent=True)) == "interrupted"
    assert run_scene(scene, parts, Display(silent=True), resume=True) == "complete"
    one, other = read_branch(shipped("network_portal")), read_branch(parts)
    assert one.events["P"] == pytest.approx(other.events["P"], abs=1e-9)
    assert one.events["energy"] == pytest.approx(other.events["energy"], abs=1e-9)


@pytest.mark.full
def test_several_sections_and_a_sweep(run):
    text = CANTILEVER.replace(f"material: {ROD}", f"sections: {{soft: {ROD}, stiff: {{law: rod, B1: 2.0, B2: 2.0, C: 2.0}}}}")
    text = text.replace("a: {begin", "a: {section: soft, begin").replace("after: a,", "section: stiff, after: a,")
    branch = run(text)
    assert {"B1_soft", "kappa_n_stiff"} <= set(branch.points.dtype.names)
    soft, stiff = 0.4, 0.6  # lengths; tan(k1 l1) tan(k2 l2) = k2 / k1 where the column of two parts buckles, k_i^2 = P / B_i
    value = _events(branch, "BP", "P")[0][0]
    k1, k2 = math.sqrt(value), math.sqrt(value / 2)
    assert math.tan(k1 * soft) * math.tan(k2 * stiff) == pytest.approx(k2 / k1, abs=1e-8)
    sweep = parse(text.replace("C: 0.75", "C: [0.75, 1.0]"), "sweep.yaml")
    assert len(sweep.scenes) == 2


MISTAKES = {
    "strips: {a: {end: [0, 0, 1]}}": "strips.a: begin, after: give one of them",
    "strips: {a: {begin: [0, 0, 0]}}": "strips.a: end, length: give one of them",
    "strips: {a: {begin: [0, 0, 0], length: 1.0}}": "strips.a: along: is missing; a strip that begins at a place needs it",
    "strips: {a: {begin: [0, 0, 0], end: [0, 0, 0], normal: [0, 1, 0]}}": "strips: a: a member from [0.0, 0.0, 0.0] to",
    "strips: {a: {begin: [0, 0], end: [0, 0, 1], normal: [0, 1, 0]}}": "strips.a.begin: must be three numbers, not [0, 0]",
    "strips: {a: {after: b, length: 1.0}}": "strips: a: after: 'b' must be one of the strips before it: none",
    "joints: {A: [a middle]}": "joints: A: 'a middle' must be a strip and start, finish or a part of its length",
    "joints: {A: [c start]}": "joints: A: 'c start' (did you mean 'b start'?) must be a strip and",
    "joints: {A: {strips: [a start], ball: true, hinge: [1, 0, 0]}}": "joints.A: hinge, ball: give one of them",
    "held: {Z: clamped}": "held: 'Z' must be one of A, cut, tip",
    "strips: {a: {begin: [0, 0, 0], along: tangent, normal: [0, 1, 0], length: 1.0}}": "a.along: must be x, y, z or",
    "directions: {weight: normal}": "directions.weight: must be x, y, z or three numbers, not 'normal'",
    "held: {A: {slides_along: x}}": "held.A.slides_along: must be width, normal, tangent or three numbers, not 'x'",
    "held: {AA: clamped}": "held: 'AA' (did you mean 'A'?) must be one of A, cut, tip",
    "held: {A: {rotaton: clamped}}": "unknown field 'held.A.rotaton' (did you mean 'rotation'?); the fields are rotation,",
    "loads: {P: {tipp: [0, 0, 1]}}": "loads: P: 'tipp' (did you mean 'tip'?) must be a joint, or a strip",
    "strips: {a: {begin: [0, 0, 0], end: [0, 0, 1], normal: x, copies: 1 about z}}": "a: copies: '1 about z' must be a number",
    "stages: [{follow: P, to: 1.0}, {follow: P, to: 2.0, joints: {ct: ball}}]": "joints: 'ct' (did you mean 'cut'?)",
    "stages: [{follow: P, to: 1.0}, {follow: P, to: 2.0, joints: {cut: hinged}}]": "must be 'rigid', 'hinge' or 'ball', not",
    "held: {A: welded}": "held.A: 'welded' must be clamped, hinged, ball joint, free",
    "loads: {P: {tip: {moment: 1.0}}}": "loads: P: moments: tip must be held by a hinge",
    "loads: {P: {tip: {force: [0, 0, 1], moment: 1.0}}}": "loads.P.tip: force, moment: give one of them",
    "material: {B1: 1.0}": "material: the field 'law' is missing",
    "material: {law: rubber}": "material: law: 'rubber' must be one of",
    "stages: [{follow: Q, to: 1.0}]": "stage 1: follow: 'Q' must be one of the numbers here",
    "stages: [{follow: P, to: 1.0, held: {A: free}}]": "stage 1: held, joints, numbers: those of the scene are the",
    "stages: [{follow: P, to: 1.0}, {follow: P, to: 2.0, held: {Z: free}}]": "stage 2: held: 'Z' must be one of A, cut, tip",
    "stages: [{follow: P, to: 1.0, limits: {tip_w: [0, 1]}}]": "stage 1: 'tip_w'",
    "loads: {weight: {tip: [0, 0, -1]}}": "loads: weight: is the name of another number of this network; give another name",
    "loads: {B1: {tip: [0, 0, -1]}}": "loads: B1: is the name of another number",
    "loads: {assembly: {tip: [0, 0, -1]}}": "loads: assembly: is the name of another number",
    "loads: {A_dx: {tip: [0, 0, -1]}}": "loads: A_dx: is the name of another number",
    "loads: {q0_1: {tip: [0, 0, -1]}}": "loads: q0_1: is the name of another number",
    "loads: {P: {tip: [0, 0, 1]}, A_x: {tip: [0, 0, 1]}}": "A_x: is the name of two columns; give",
    "loads: {P: {tip: [0, 0, 1]}, F_A_x: {tip: [0, 0, 1]}}": "F_A_x: is the name of two columns",
    "loads: {P: {tip: [0, 0, 1]}, index: {tip: [0, 0, 1]}}": "index: is the name of two columns",
    "loads: {P: {tip: [0, 0, 1]}, error_tip_x: {tip: [0, 0, 1]}}": "error_tip_x: is the name of two columns",
    "loads: {P: {tip: [0, 0, 1]}, stage: {tip: [0, 0, 1]}}": "stage: is the name of two columns",
    "loads: {lambda: {tip: [0, 0, -1]}}": "'lambda' is not usable as a name",
    "loads: {P: {b at 0.5: [0, 0, -1]}, b_at_0_5_y: {tip: [0, 0, -1]}}": "b_at_0_5_y: is the name of two columns",
    "loads: {P: {b finish: [0, 0, -1]}}": "loads: P: 'b finish' is joined at tip; give tip in its place",
    "joints: {A: [a start], cut: [a finish], M: [b at 0.5], N: [b at .5], tip: [b finish]}": "joints: N: 'b at 0.5' is joined",
}


@pytest.mark.parametrize("change", MISTAKES)
def test_a_mistake_is_one_sentence(change):
    field = change.partition(":")[0]
    text = re.sub(rf"^{field}:.*?(?=^\w|\Z)", change + "\n", CANTILEVER + "directions: {}\n", flags=re.M | re.S)
    with pytest.raises(ConfigError) as raised:
        parse(text, "scene.yaml")
    assert MISTAKES[change] in str(raised.value)
    assert "\n" not in str(raised.value)


def test_copies_about_an_axis_are_the_strips_written_out(root):
    """The hexagon of configs, whose strips and joints are written one by one, with what turns with them."""
    whole = load(root / "configs" / "network_hexagon.yaml")
    text = (
        "material: {law: rod, B1: 1.0, B2: 1.2, C: 0.8, kappa_n: 0.0}\n"
        "strips: {s: {begin: [0, 1, 0], end: [0, 0.5, 0.866025403784], normal: y, copies: 6 about x}}\n"
        "joints: {J: {strips: [s finish, next s start], hinge: [0, 1, 0], arm: {s finish: [0, 1, 0]}}}\n"
        "held: {J: {rotation: free, slides_along: [0, 1, 0]}}\nloads: {P: {J: [0, 0, 2], s at 0.5: {force: [0, 1, 0]}}}\n"
        "numbers: {P: 1}\nstages: [{follow: P, to: 3, limits: {P: [0, 4]}, label: {P: [1, 2, 3]}, held: {J: free}}]\n"
    )
    values = NetworkScene.prepared(yaml.safe_load(text))
    for number, (own, other) in enumerate(zip(values["strips"].values(), whole.strips.values()), 1):
        np.testing.assert_allclose([own["begin"], own["end"]], [other.begin, other.end], atol=1e-11)
        across = np.array([0, math.cos((number - 1) * math.pi / 3), math.sin((number - 1) * math.pi / 3)])
        np.testing.assert_allclose(own["normal"], across, atol=1e-11)
        joint, end = values["joints"][f"J_{number}"], f"s_{number} finish"
        assert joint["strips"] == [place.replace("s", "s_", 1) for place in whole.joints[f"J{number}"].strips]
        assert joint["arm"] == {end: [0, 1, 0]}
        held, loads = values["held"][f"J_{number}"], values["loads"]["P"]
        for vector in (joint["hinge"], held["slides_along"], loads[f"s_{number} at 0.5"]["force"]):
            np.testing.assert_allclose(vector, across, atol=1e-12)
    stage = values["stages"][0]
    assert stage["held"] == {f"J_{number}": "free" for number in range(1, 7)} and stage["label"] == {"P": [1, 2, 3]}
    hub = "strips: {s: {begin: [0, 1, 0], end: [0, 0, 0], normal: x, copies: 3 about x}}\njoints: {hub: [every s finish]}\n"
    assert NetworkScene.prepared(yaml.safe_load(hub))["joints"] == {"hub": [f"s_{k} finish" for k in (1, 2, 3)]}


def test_places_and_reactions_are_labelled_and_limited(run):
    """The support of a column carries its load: F_A_z = P; a reaction that is zero throughout is labelled nowhere."""
    stage = "follow: P, to: 3.0, label: {F_A_z: [1.5], F_A_x: [0]}, limits: {F_A_z: [0, 2]}"
    branch = run(CANTILEVER.replace("follow: P, to: 3.0", stage))
    found = [(event["label"].decode(), event["P"]) for event in branch.events]
    assert [label for label, _ in found] == ["EP", "UZ", "EP"] and np.allclose([P for _, P in found], [0, 1.5, 2], atol=1e-9)
    with pytest.raises(ConfigError, match="limits: F_A_z = 0 at the start of the stage is outside its limits, 1 to 2"):
        run(CANTILEVER.replace("to: 3.0", "to: 3.0, limits: {F_A_z: [1, 2]}"))


# --- supports that change -----------------------------------------------------------------------------------------------


def test_a_joint_that_becomes_a_hinge(run):
    """A propped cantilever with a hinge: tan ka = k (a + b) for a clamped part a and a link b (their moments balance)."""
    held = "held: {A: clamped, tip: {rotation: hinged, about: width, slides_along: tangent}}"
    stages = "{follow: P, to: 5}\n  - {follow: P, to: 12, joints: {cut: hinge}}\n  - {follow: P, to: 13, joints: {cut: rigid}}"
    branch = run(CANTILEVER.replace("held: {A: clamped}", held).replace("{follow: P, to: 3.0}", stages))
    (first, *_) = (event for event in branch.events if event["label"] == b"BP")
    k = brentq(lambda k: math.tan(0.4 * k) - k, 2.5, 3.9)
    assert (first["stage"], first["index_before"], first["index_after"]) == (2, 0, 1)
    assert first["P"] == pytest.approx(k * k, abs=1e-9)
    assert branch.points["index"][-1] == 0  # rigid again at P = 13 < 20.19


@pytest.mark.parametrize(
    ("kind", "then", "said"),
    [
        ("[a finish, b start]", "ball", "stage 2: held, joints: the supports let go of what no load replaces"),
        ("{strips: [a finish, b start], hinge: [1, 0, 0]}", "rigid", "stage 2: held, joints: they hold a place or a rotation"),
    ],
)
def test_a_joint_lets_go_of_no_moment_and_turns_nothing(kind, then, said, tmp_path):
    """A bent beam carries a moment at its joint; a hinge that has turned is not rigid as it was drawn."""
    bent = CANTILEVER.replace("tip: [0, 0, -1]", "cut: [0, 1, 0]").replace("[a finish, b start]", kind)
    held = "held: {A: clamped, tip: {rotation: hinged, about: [1, 0, 0], slides_along: [0, 0, 1]}}"
    stages = f"{{follow: P, to: 1}}\n  - {{follow: P, to: 2, joints: {{cut: {then}}}}}"
    text = bent.replace("held: {A: clamped}", held).replace("{follow: P, to: 3.0}", stages)
    assert run_scene(parse(text, "scene.yaml"), tmp_path / "x.h5", Display(silent=True)) == "lost"
    assert read_branch(tmp_path / "x.h5").stop.startswith(said)


_CHANGES = [  # of an open strip: what is followed, to which value, what is held; of the network of one strip
    ("force_normal", -2.0, None, "P", None),
    ("distance", 0.7, "clamped", "B_dz", "clamped"),
    ("force_tangent", -8.0, "{slides_along: tangent}", "B_force_z", "{slides_along: [0, 0, 1]}"),
    ("moment", 0.0, "{rotation: hinged, about: width, slides_along: tangent}",
     "B_moment", "{rotation: hinged, about: [1, 0, 0], slides_along: [0, 0, 1]}"),
]  # fmt: skip


TAPERED = """
material: {law: flat rod, nu: 0.3}
along: {kappa_n: 1 + s**2, thickness: 1 - 0.3*s, width: [[0, 1], [1, 0.5]]}
"""


@pytest.mark.sample(1)
@pytest.mark.parametrize("joints", ["", ", M: [a at 0.3]"])
def test_data_along_a_strip_are_those_of_the_open_strip_also_where_it_is_cut(joints):
    drawn = "strips: {a: {begin: [1, 2, 3], along: z, normal: y, length: 1.0, bend: 1.3}}\nheld: {A: clamped}\n"
    drawn += f"joints: {{A: [a start], B: [a finish]{joints}}}\nloads: {{P: {{B: [0, 1, 0]}}}}\nnumbers: {{P: 2.0}}\n"
    network = parse(f"{TAPERED}{drawn}stages: [{{follow: P, to: 3.0}}]", "scene.yaml").strip()
    strip = parse(
        f"{TAPERED}finish: free\nnumbers: {{force_normal: 2.0}}\nstages: [{{follow: force_normal, to: 3.0}}]", "s"
    ).strip()
    assert network.first_point()[0]["energy"] == pytest.approx(strip.first_point()["energy"], rel=1e-9)


def test_data_along_no_section_are_refused():
    text = "sections: {a: {law: rod, B1: 1, B2: 1, C: 1}, b: {law: rod, B1: 1, B2: 1, C: 1}}\nalong: {kappa_n: s}\n"
    text += "strips: {a: {section: a, begin: [0, 0, 0], end: [0, 0, 1], normal: y}}\nstages: [{follow: C_a, to: 2}]"
    with pytest.raises(ConfigError, match="along: 'kappa_n' must end in the name of a section, as in kappa_n_a"):
        parse(text, "scene.yaml")


@pytest.mark.full
def test_supports_that_change_are_those_of_open_strips(run):
    """A strip that is pushed, clamped, compressed, and let go twice: the network of one strip is the open strip."""
    stages = [
        (f"  - {{follow: {one}, to: {to}{f', finish: {end}' if end else ''}}}\n",
         f"  - {{follow: {other}, to: {to - (one == 'distance')}{f', held: {{B: {held}}}' if held else ''}}}\n")
        for one, to, end, other, held in _CHANGES
    ]  # fmt: skip
    strip = run(f"material: {ROD}\nfinish: free\nstages:\n" + "".join(one for one, _ in stages))
    known = [strip.points[strip.stage_of == number][-1] for number in range(1, 5)]
    network = run(
        f"material: {ROD}\nstrips: {{beam: {{begin: [0, 0, 0], end: [0, 0, 1], normal: [0, 1, 0]}}}}\n"
        "joints: {A: [beam start], B: [beam finish]}\nheld: {A: clamped}\nloads: {P: {B: [0, 1, 0]}}\nstages:\n"
        + "".join(other for _, other in stages)
    )
    for number, there in enumerate(known, 1):
        here = network.points[network.stage_of == number][-1]
        for name, same in (
            ("energy", "energy"), ("index", "index"), ("B_y", "rise"), ("B_z", "distance"), ("B_bend", "bend"),
            ("F_A_y", "start_F_normal"), ("F_A_z", "start_F_tangent"), ("M_A_x", "start_M_width"), ("F_B_z", "F_tangent"),
        ):  # fmt: skip
            if same != "F_tangent" or number == 2:  # a dead force is none of a support: F_tangent has both
                assert here[name] == pytest.approx(there[same], abs=1e-7)  # the open strip rounds numbers that go on to 1e-9
        assert here["B_dz"] == pytest.approx(there["distance"] - 1, abs=1e-7)


ROLLERS = f"""
material: {ROD}
strips: {{beam: {{begin: [0, 0, 0], end: [0, 0, 1], normal: [0, 1, 0]}}}}
joints: {{A: [beam start], M: [beam at 0.5], Q: [beam at 0.25]}}
held: {{A: clamped, M: {{rotation: free, slides_in_plane: [0, 1, 0]}}}}
stages:
  - {{follow: M_dy, to: -0.2}}
  - {{follow: Q_dy, to: -0.04, held: {{Q: {{rotation: free, slides_in_plane: [0, 1, 0]}}}}}}
  - {{follow: M_force_y, to: 0.0, held: {{M: free}}}}
  - {{follow: Q_force_y, to: 0.0, held: {{Q: free}}}}
"""


@pytest.mark.full
def test_rollers_that_come_and_go(run):
    """A second roller begins where the strip is, without force; let go one after the other, the strip is straight again."""
    branch = run(ROLLERS)
    first, second, third, last = (branch.points[branch.stage_of == number] for number in range(1, 5))
    assert second[0]["F_Q_y"] == pytest.approx(0, abs=1e-8)
    assert second[0]["energy"] == pytest.approx(first[-1]["energy"], abs=1e-10)
    assert third[0]["M_force_y"] == pytest.approx(second[-1]["F_M_y"], abs=1e-8)
    assert third["F_M_y"] == pytest.approx(0, abs=0)
    for stage, forms in ((2, [*["arrow"] * 2, "block", "ball", "ball"]), (3, [*["arrow"] * 5, "block", "ball"])):
        shown = branch.shape(int(np.flatnonzero(branch.stage_of == stage)[0]))
        assert [one.form for one in shown.fixtures] == forms
        assert len(shown.solids(0.1)) == 3  # of the dead forces one is not zero, at the roller that was let go
    assert last[-1]["energy"] == pytest.approx(0, abs=1e-12)
    assert last[-1]["Q_dy"] == pytest.approx(0, abs=1e-9)
    assert last[-1]["M_dy"] == pytest.approx(0, abs=1e-9)  # it is not prescribed there, and found


@pytest.mark.full
def test_a_table_has_a_column_once():
    text = "material: {law: flat rod, nu: 0.3}\nstrips: {one: {begin: [0, 0, 0], end: [0, 1, 0], normal: z}}\n"
    text += "joints: {A: [one start], B: [one finish]}\nheld: {A: clamped}\nloads: {P: {B: [0, -1, 0]}}\n"
    scene = parse(text + "stages: [{follow: P, to: 1}, {follow: kappa_n, to: 1}]\n", "scene")
    heads = [OpenStage(scene, number).head.split()[:-3] for number in (1, 2)]
    assert heads[0][:2] == ["P", "energy"] and heads[1] == ["kappa_n", "energy"]


def test_reactions_that_no_load_replaces_are_told(tmp_path):
    """A moment at a clamp that becomes a ball joint: no dead moment has an energy there."""
    text = CANTILEVER.replace("tip: [0, 0, -1]", "tip: [0, 1, 0]")
    text += "  - {follow: P, to: 2.0, held: {A: ball joint, tip: clamped}}\n"
    path = tmp_path / "result.h5"
    assert run_scene(parse(text, "scene.yaml"), path, Display(silent=True)) == "lost"
    assert read_branch(path).stop.startswith("stage 2: held, joints: the supports let go of what no load replaces")


# --- barriers and snaps -------------------------------------------------------------------------------------------------

COLUMN = """
material: {law: rod, B1: 1.0, B2: 20.0, C: 15.0}
strips:
  a: {begin: [0, 0, 0], end: [0, 0, 0.4], normal: [0, 1, 0]}
  b: {after: a, length: 0.6}
joints: {A: [a start], cut: [a finish, b start], B: [b finish]}
held: {A: clamped, B: {slides_along: [0, 0, 1]}}
loads: {P: {B: [0, 0, -1]}}
stages:
  - {follow: P, to: 90}
  - {follow: P, to: 86, start_at: BP 1, stage: 1, label: {P: [85]}}
  - {follow: P, to: 86, start_at: BP 2, stage: 1, label: {P: [85]}}
"""


@pytest.mark.full
def test_the_barrier_of_a_buckled_column(run, monkeypatch):
    """From one side to the other over the second mode: the difference of two potentials that the run has located."""
    branch = run(COLUMN)
    stable, saddle = branch.events[branch.events["label"] == b"UZ"]
    assert (stable["index"], saddle["index"]) == (0, 1)
    found = places(branch)
    place, at_the_end = found
    assert branch.points["P"][[place.row, at_the_end.row]].round(9).tolist() == [85.0, 86.0]
    ((name, way),) = place.ways.items()
    assert name == f"point {stable['point']}"
    assert way.behind == f"an image of {name}"
    assert way.height == pytest.approx(saddle["potential"] - stable["potential"], abs=1e-8)
    monkeypatch.setattr("branches.run.barriers.places", lambda *given: found)  # computed already
    head, line, *_ = report(branch)
    assert head == "to leave stable states:" and line.startswith("  P = 85 of stage ")


@pytest.mark.full
def test_the_snap_of_an_arch(run, root, shipped, monkeypatch):
    """Past its fold it falls to the other side: the energy is that of an arch that is drawn there, without the segments."""
    branch = read_branch(shipped("network_arch"))
    (fall,) = falls(branch)
    (stage,) = gather([str(shipped("network_arch"))])["families"][0]["branches"]
    assert [mark["fall"] for mark in stage["marks"] if "fall" in mark] == [f"Let go past it, the strip {told(branch, fall)}."]
    assert fall.into is None
    assert fall.value == pytest.approx((1 + PAST) * branch.points["P"][fall.row])
    before = branch.points[fall.row]
    start = before["potential"] + (fall.value - before["P"]) * before["arch_at_0_45_y"]  # to first order
    text = (root / "configs" / "network_arch.yaml").read_text()
    text = text.replace("[0, 0.3894", "[0, -0.3894").replace("bend: 0.8", "bend: -0.8").replace(
        "to: 60.0, limits: {P: [-60, 60]}", f"to: {fall.value!r}"
    )  # fmt: skip
    below = run(text).points[-1]
    assert below["index"] == 0
    assert fall.released == pytest.approx(start - below["potential"], abs=5e-4)
    monkeypatch.setattr("branches.run.barriers.falls", lambda *given: [fall])  # computed already
    line = report(branch)[-1]
    assert re.fullmatch(
        r"  P = 14\.1498 of stage 1, point 17: falls into a state that is not in the result, which releases 1\.760\d*", line
    )


# --- joints, as pictures show them --------------------------------------------------------------------------------------

#: Two strips that are joined by a hinge of a strut, whose middle ends are turned, held in three ways.
JOINED = f"""
material: {ROD}
strips:
  a: {{begin: [0, 0, 0], end: [0, 0, 1], normal: [0, 1, 0]}}
  b: {{begin: [0, 0, 1], end: [0, 1, 1], normal: [0, 0, 1]}}
  c: {{begin: [0, 1, 1], end: [0, 2, 2], normal: [1, 0, 0]}}
joints:
  A: [a start]
  corner: [a finish, b start]
  pin: {{strips: [b finish, c start], hinge: [1, 0, 0]}}
  end: [c finish]
held:
  A: clamped
  end: {{rotation: free, place: held}}
loads:
  P: {{b at 0.5: [0, 0, -1]}}
stages:
  - {{follow: P, to: 1.0}}
"""


@pytest.mark.full
def test_joints_are_fixed_on_strips(run):
    """Supports and joints are where the columns say; at the load, where the strip goes on, is an arrow that ends there."""
    branch = run(JOINED)
    last = len(branch.points) - 1
    shape = branch.shape(last)
    assert [(one.form, one.held) for one in shape.fixtures] == [
        ("arrow", False), ("block", True), ("block", False), ("pin", False), ("ball", True),
    ]  # fmt: skip
    (_, arrow), *others = shape.solids(0.1)
    place = [branch.points[last][f"b_at_0_5_{axis}"] for axis in "xyz"]
    away = arrow.vertices - place
    assert away.min(axis=0)[2] == pytest.approx(0, abs=1e-9)  # the force is downwards
    assert np.abs(away[np.argmin(away[:, 2])]).max() < 1e-9
    assert np.ptp(away[:, 2]) > 3 * np.ptp(away[:, :2])
    assert len(branch.shape(0).solids(0.1)) == 4  # without force there is no arrow
    standing = branch.posed([last])[last]
    assert standing.fixtures[0].axis == pytest.approx([0, 0, -1])  # the load points down, as it does in the drawing
    for name, (one, solid) in zip(("A", "corner", "pin", "end"), others):
        place = [branch.points[last][f"{name}_{axis}"] for axis in "xyz"]
        sides, profile = one.turned
        middle = (solid.vertices.min(axis=0) + solid.vertices.max(axis=0)) / 2
        assert middle == pytest.approx(place, abs=0.01)  # a part of the width: 24 sides of a turned pin are not symmetric
        x, y, z = solid.vertices[solid.triangles].transpose(1, 0, 2)
        area = sides / 2 * math.sin(2 * math.pi / sides)  # of a polygon in the unit circle
        (h, r) = 0.1 * profile.T
        cones = area * np.diff(h) * (r[1:] ** 2 + r[1:] * r[:-1] + r[:-1] ** 2) / 3
        assert np.linalg.det(np.stack([x, y, z], axis=1)).sum() / 6 == pytest.approx(cones.sum(), rel=1e-12)  # closed, outwards
    pin = shape.fixtures[3]
    state = shape.parts[pin.part]
    axis = np.array(pin.axis) @ state.directors[-1 if pin.last else 0]
    assert abs(axis @ [1, 0, 0]) == pytest.approx(1, abs=1e-9)  # the plane of the drawing is that of the state


@pytest.mark.full
def test_a_force_that_follows_is_an_arrow_that_turns(run, tmp_path):
    """It keeps its angle to the strip; the page, too, turns it with the end, and says nothing of an index."""
    branch = run(CANTILEVER.replace("{tip: [0, 0, -1]}", "{tip: {force: [0, -1, 0], follows: true}}"))
    last = len(branch.points) - 1
    shape = branch.shape(last)
    (_, arrow), *_ = shape.solids(0.1)
    end = shape.parts[-1]
    tip = end.centreline[-1]
    behind = arrow.vertices.mean(axis=0) - tip
    assert behind / np.linalg.norm(behind) == pytest.approx(end.directors[-1, 1], abs=1e-3)
    assert end.directors[-1, 1] != pytest.approx([0, 1, 0], abs=0.5)
    (stage,) = gather([str(tmp_path / "result.h5")])["families"][0]["branches"]
    assert (stage["fixtures"][0]["inSpace"], "index" in stage["columns"]) == (False, False)


def test_a_picture_shows_joints(frame):
    """Blocks and supports have their own colours, in front of the strips."""
    branch = read_branch(frame)
    shape = branch.posed([0])[0]
    assert [one.form for one in shape.fixtures] == ["arrow", "arrow", *["block"] * 4]
    shape = replace(shape, fixtures=shape.fixtures[2:])
    without = replace(shape, fixtures=())
    one, other = (rendered(each, 0.06, reach_of([shape], 0.06, branch.view), 300, branch.view) for each in (shape, without))
    changed = np.abs(one - other).max(axis=-1) > 0.05
    assert 100 < np.count_nonzero(changed) < 0.05 * changed.size
    blue = one[changed & (one[..., 3] > 0.99)][:, :3]
    assert np.mean(blue[:, 2] > blue[:, 0]) > 0.9  # steel, where strips are orange or violet


def test_meshes_of_networks(frame, tmp_path):
    """A closed solid for each strip and joint; the volume of strips is length times width times thickness."""
    trimesh = pytest.importorskip("trimesh")
    path, out = frame, tmp_path / "frame.stl"
    words = ["--point", "5", "--out", str(out), "--out", str(tmp_path / "frame.csv"), "--length", "0.2", "--width", "0.01"]
    assert export([str(path), *words, "--thickness", "0.002"]) == 0
    pieces = trimesh.load(out).split()
    volumes = sorted((piece.volume for piece in pieces), reverse=True)
    assert len(pieces) == 3 + 2 + 2
    assert all(piece.is_watertight for piece in pieces)
    assert volumes[:3] == pytest.approx([0.2 * 0.01 * 0.002] * 3, rel=1e-4)
    table = np.genfromtxt(tmp_path / "frame.csv", delimiter=",", names=True)
    assert sorted(set(table["strip"])) == [1, 2, 3]
    assert table["s"].max() == pytest.approx(0.2)


def test_the_page_of_a_network(frame):
    """All stages, the strips side by side, and joints; the states are those of the file."""
    branch = read_branch(frame)
    page = gather([str(frame)])
    (family,) = page["families"]
    first, second = family["branches"]
    assert (first["name"], second["name"]) == ("stage 1: P", "stage 2: P")
    assert page["shown"] == ["P", "B_y"]
    assert [mark["tag"] for mark in first["marks"][1:-1]] == ["BP 1"]
    assert [["signs" in fixture for fixture in one["fixtures"]] for one in (first, second)] == [[True] * 2 + [False] * 4] * 2
    assert second["fixtures"][0]["signs"] == 1  # at all points; of the first stage there is none at P = 0
    assert first["shapes"]["channels"] == 3 * 8
    shown = branch.posed([len(branch.points) - 1])[len(branch.points) - 1]
    places = decoded(second)[-1].reshape(-1, 3, 8)[..., -3:]
    lengths = np.linalg.norm(np.diff(places, axis=0), axis=-1).sum(axis=0)
    assert lengths == pytest.approx([2 * np.pi] * 3, rel=1e-3)  # of chords
    for strip, part in zip(places.transpose(1, 0, 2), shown.parts):  # moved by one vector for all points of the page
        ends = 2 * np.pi * (part.centreline[-1] - part.centreline[0])
        assert strip[-1] - strip[0] == pytest.approx(ends, abs=1e-3)


# --- first states that are not there ------------------------------------------------------------------------------------

#: A portal of three rods; its right column is drawn from a height up.
_PORTAL = """
material: {{law: {law}}}
strips:
  left: {{begin: [0, 0, 0], end: [0, {L}, 0], normal: [0, 0, 1]}}
  beam: {{begin: [0, {L}, 0], end: [0, {L}, {L}], normal: [0, 1, 0]}}
  right: {{begin: [0, {foot}, {L}], end: [0, {head}, {L}], normal: [0, 0, 1]}}
joints: {{A: [left start], B: [left finish, beam start], C: {C}, D: [right start]}}
held: {{A: clamped, D: {D}}}
loads: {{P: {{B: [0, -1, 0], C: [0, -1, 0]}}}}
stages:
  - {{follow: P, to: {to}}}
"""
_STIFF = "rod, B1: 1.0, B2: 4.0, C: 0.8"
_JOINED = "[beam finish, right finish]"


def _portal(law=_STIFF, L=1.0, up=0.0, C=_JOINED, D="clamped", to=0.1):
    return _PORTAL.format(law=law, L=L, foot=up, head=up + L, C=C, D=D, to=to)


def test_up_is_against_the_load_and_what_is_round_off_is_a_line(run):
    """A column along z under a load: it stands in pictures, and before it buckles nothing moves sideways."""
    text = """
material: {law: rod, B1: 1.0, B2: 4.0, C: 0.8}
strips: {column: {begin: [0, 0, 0], end: [0, 0, 1], normal: [0, 1, 0]}}
joints: {A: [column start], B: [column finish]}
held: {A: clamped}
loads: {P: {B: [0, 0, -1]}}
stages: [{follow: P, to: 1.0}]
"""
    branch = run(text)
    assert branch.up == (0, 0, 1)
    (part,) = branch.posed([0])[0].parts
    assert np.ptp(part.centreline @ branch.view.axes[1]) > 0.9
    low, high = branch.plot(shapes=0, y="B_x").axes[0].get_ylim()
    assert (low, high) == pytest.approx((-0.5, 0.5), abs=1e-9)


@pytest.mark.parametrize(
    "text, sentence",
    [
        (
            _portal(up=6.0),
            "held: A and D are 6.083 apart, and the strips between them 3 long; draw longer strips, or hold less",
        ),
        (
            _portal(C=f"{{strips: {_JOINED}, ball: true}}", D="{rotation: free}"),
            "joints: right can move, or turn about itself, without a change of energy",
        ),
        (_portal("ribbon, nu: 0.3"), "strips: left: the law 'ribbon' has no value where the bending vanishes"),
    ],
)
def test_why_there_is_no_first_state(text, sentence, tmp_path):
    with pytest.raises(ConfigError, match=re.escape(sentence)):
        run_scene(parse(text, "scene.yaml"), tmp_path / "result.h5", Display(silent=True))
    assert not (tmp_path / "result.h5").exists()


@pytest.mark.parametrize("end", ["[0, 0, 1]", "[0.5, 0.3, 1]"])
def test_a_strut_that_floats_begins_where_its_forces_grow(end):
    """It turns into the line of the forces, and buckles at (pi/L)^2 B1 as with hinged ends; two turns lower its energy."""
    scene = parse(
        f"material: {{law: {_STIFF}}}\nstrips: {{a: {{begin: [0, 0, 0], end: {end}, normal: [0, 1, 0]}}}}\n"
        "joints: {A: [a start], B: [a finish]}\nloads: {P: {A: [0, 0, 1], B: [0, 0, -1]}}\n"
        "stages:\n  - {follow: P, to: 10}\n",
        "scene.yaml",
    )
    strut, load = scene.strip(), math.pi**2 / scene.longest**2
    point, how = first_state(strut, grows={"P": 10})
    assert 0 < point["P"] < 1e-5 and "at 0 nothing determines how" in how
    branch = trace(point, free=["P"], limits={"P": (0, 1.05 * load)}, progress=False)
    assert [(one["P"], one.index_change) for one in branch.labelled("BP")] == [(pytest.approx(load, rel=1e-9), (2, 3))]
    np.testing.assert_allclose(strut.place(branch[-1], "B"), [0, 0, scene.longest], atol=1e-9)
    with pytest.raises(ContinError, match=re.escape("P = 0 does not determine how; begin with another value")):
        strut.first_point()


@pytest.mark.full
def test_a_gap_that_was_closed_is_said(tmp_path, capsys):
    run_scene(parse(_portal(up=0.02), "scene.yaml"), tmp_path / "result.h5", Display())
    assert "stage 1: the drawing has a gap of 0.02 at C, which was closed" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("L", "B"),
    [(1e-3, 1e-9), *(pytest.param(*both, marks=pytest.mark.full) for both in [(1e3, 1e6), (1e3, 1e-9), (1e-3, 1e6)])],
)  # fmt: skip
def test_a_frame_buckles_alike_in_all_units(L, B):
    """k L cot(k L) = -6, with as many steps: L = 1e-3 and B = 1e-9, as in m and N m^2, have forces of 1e-3."""
    force = B / L**2
    network = parse(_portal(f"rod, B1: {B:e}, B2: {4 * B:e}, C: {0.8 * B:e}", L, to=9 * force), "scene.yaml").strip()
    branch = trace(network.first_point()[0], free=["P"], limits={"P": (0, 8 * force)}, progress=False)
    (point,) = branch.labelled("BP")
    assert (point["P"], point.index_change) == (pytest.approx(force * 2.71645974768613**2, rel=1e-9), (0, 1))
    assert len(branch) < 20


#: A cantilever above a stop, which pushes.
STOP = """
material: {law: rod, B1: 1, B2: 100, C: 1}
strips: {beam: {begin: [0, 0, 0], end: [1, 0, 0], normal: y}}
joints: {A: [beam start], tip: [beam finish]}
held: {A: clamped, tip: {rotation: free, slides_in_plane: [0, 1, 0], only: pushes}}
numbers: {tip_dy: -0.2, load: 0}
loads: {load: {tip: [0, -1, 0]}}
stages: [{follow: load, to: 5}, {follow: load, to: 0.1}]
"""


def test_a_stop_under_a_tip(tmp_path):
    """It is met at the load of the free tip at this depth (Bisshopp & Drucker 1945), and left there; its force is the rest."""
    assert run_scene(parse(STOP, "scene"), tmp_path / "stop.h5", Display(silent=True)) == "complete"
    branch = read_branch(tmp_path / "stop.h5")
    met, left = branch.events[branch.events["label"] == b"BC"]
    assert (met["name"], left["name"]) == (b"tip touches: goes on", b"tip lifts off: goes on")
    assert met["load"] == pytest.approx(0.6258923107865, rel=1e-10) == left["load"]
    pressed = branch.points[branch.points["load"] == 5][0]
    assert pressed["F_tip_y"] == pytest.approx(5 - 0.6258923107865, rel=1e-9) and branch.points["F_tip_y"].min() > -1e-9
    away = first_state(parse(STOP.replace("-0.2", "-1.5"), "scene").strip())[0]  # a stop that the strip cannot reach
    assert away.contacts == ()
    with pytest.raises(ConfigError, match="held.A: only: belongs to slides_in_plane"):
        parse(STOP.replace("A: clamped", "A: {only: pushes}"), "scene")
