"""Networks in m and N: the same states as without units, and as of the open strip with the same dimensions."""

import numpy as np
import pytest

from branches.read import read_branch
from branches.run.display import Display
from branches.run.runner import run_scene
from branches.scene.fields import ConfigError
from branches.scene.open_stage import OpenStage
from branches.scene.parse import parse

#: Length, and E w h^3/12 of the flat rod.
L, B = 0.3, 200e9 * 0.02 * 0.0005**3 / 12
STEEL = "width: 20mm, thickness: 0.5mm, poisson_ratio: 0.3, youngs_modulus: 200GPa"
#: A frame on a hinge, with numbers of every kind.
FRAME = """
{head}
strips:
  post: {{begin: [0, 0, 0], end: [0, {post}, 0], normal: [0, 0, 1]}}
  beam: {{begin: [0, {post}, {arm}], along: z, normal: y, length: {beam}}}
joints:
  A: [post start]
  B: {{strips: [post finish, beam start], arm: {{post finish: [0, {arm}, 0]}}, angle: {{beam start: turned}}}}
  tip: [beam finish]
held: {{A: {{rotation: hinged, about: [1, 0, 0]}}, tip: {{rotation: free, slides_in_plane: [0, 1, 0]}}}}
loads:
  P: {{B: {{force: [0, 0, 1], arm: [0, {arm}, 0]}}}}
  M: {{A: {{moment: 1.0}}}}
numbers: {{P: {force}, M: {moment}, tip_dy: {move}, turned: 0.1, weight: {line}, foundation: {bed}, field: {couple}}}
stages: [{{follow: tip_dy, to: {to}}}]
"""
#: Powers of L and B of the first letters of columns, the longest first.
UNITS = {
    "P": (-2, 1), "M_": (-1, 1), "M": (-1, 1), "F_": (-2, 1), "energy": (-1, 1), "potential": (-1, 1), "weight": (-3, 1),
    "foundation": (-4, 1), "field": (-2, 1), "tip": (1, 0), "A_b": (0, 0), "A_": (1, 0), "B_": (1, 0), "kappa_n": (-1, 0),
    "tau_n": (-1, 0),
}  # fmt: skip


def _frame(head, L, B):
    numbers = {"post": L, "beam": 0.7 * L, "arm": 0.1 * L, "move": -0.01 * L, "to": -0.2 * L, "force": 0.3 * B / L**2}
    numbers |= {"moment": 0.2 * B / L, "line": 0.5 * B / L**3, "bed": 0.4 * B / L**4, "couple": 0.1 * B / L**2}
    stage = OpenStage(parse(FRAME.format(head=head, **numbers), "scene.yaml"), 1)
    point = stage.first()
    names = stage.columns().shown()
    values = stage.values(point, names)
    return stage.scene, {name: values[name] for name in names}, stage.errors(point)


@pytest.mark.parametrize("length", ["0.3", "12cm"])
def test_every_number_is_that_without_units_times_powers_of_length_and_modulus(length):
    """Closed form of units, whatever length the scene computes in."""
    steel = f"material: {{law: flat rod, kappa_n: {0.6 / L!r}}}\ndimensions: {{length: {length}, {STEEL}}}"
    scene, real, errors = _frame(steel, L, B)
    _, plain, others = _frame("material: {law: flat rod, nu: 0.3, kappa_n: 0.6}", 1.0, 1.0)
    assert real.keys() == plain.keys() and {"field", "foundation", "M", "F_A_y", "M_A_x", "tip_z"} <= real.keys()
    for name, value in plain.items():
        powers = next((powers for start, powers in UNITS.items() if name.startswith(start)), (0, 0))
        unit, error = L ** powers[0] * B ** powers[1], errors.get(name, 0.0) * scene.factor(name)
        slack = 2 * (error + others.get(name, 0.0) * unit) + 1e-12 * unit
        assert abs(real[name] * scene.factor(name) - value * unit) < slack, name


def test_a_cantilever_is_the_open_strip_of_its_dimensions(tmp_path):
    """In the units of both: what is followed, label and limits, places, reactions, energies; and the sizes of pictures."""
    head = f"material: {{}}\ndimensions: {{length: {L}, {STEEL}}}\n"
    how = f"to: 2.0, label: {{energy: [0.05]}}, limits: {{energy: [-1, 0.1]}}}}]\nnumbers: {{weight: {B / L**3}}}\n"
    drawn = f"strips: {{a: {{begin: [0, 0, 0], end: [0, 0, {L}], normal: y}}}}\njoints: {{A: [a start], T: [a finish]}}\n"
    strip = f"{head}finish: free\nstages: [{{follow: force_normal, {how}"
    network = f"{head}{drawn}held: {{A: clamped}}\nloads: {{P: {{T: [0, 1, 0]}}}}\nstages: [{{follow: P, {how}"
    found = []
    for name, text in (("strip.h5", strip), ("network.h5", network)):
        assert run_scene(parse(text, name), tmp_path / name, Display(silent=True)) == "complete"
        found.append(read_branch(tmp_path / name))
    open_strip, other = found
    assert other.length == open_strip.length == L and other.length_unit == "m"
    assert other.width_at(1.0, None) == pytest.approx(0.02 / L) and other.axis("P")[1] == "P in N"
    assert {"P [N]", "T_y [m]", "M_A_x [N m]", "energy [J]"} <= other.in_units().keys()
    assert [*other.events["label"]] == [*open_strip.events["label"]] == [b"EP", b"UZ", b"EP"]
    same = {"P": "force_normal", "T_y": "rise", "T_z": "distance", "F_A_y": "start_F_normal", "M_A_x": "start_M_width"}
    for mine, its in (same | {"energy": "energy", "potential": "potential"}).items():
        units = [branch.scene.factor(name) for branch, name in ((other, mine), (open_strip, its))]
        assert np.isclose(*units, rtol=1e-12) and other.scene.unit(mine) == open_strip.scene.unit(its)
        values = other.events[mine] * units[0], open_strip.events[its] * units[1]
        slack = 2 * units[0] * sum(np.nan_to_num(b.events[f"error_{n}"]) for b, n in ((other, mine), (open_strip, its)))
        assert np.all(np.abs(values[0] - values[1]) < slack + 1e-12 * units[0]), mine


@pytest.mark.parametrize(
    "fields, sentence",
    {
        "loads: {P: {T: [0, 0, 1], A: {moment: 0.1}}}": "loads: P: a force and a moment have no common unit; give each a load",
        "material: {law: flat rod, nu: 0.3}": "material: nu must not be given together with dimensions",
        "material: {law: rod, B1: 1.0}": "material: law: 'rod' must be one of finite width, flat rod, ribbon together with",
        "sections: {a: {law: ribbon}, b: {law: flat rod}}": "sections: b: law: 'flat rod' must be that of the first section",
    }.items(),
)
def test_what_has_no_unit_is_one_sentence(fields, sentence):
    held = "held: {A: {rotation: hinged, about: width}, T: {rotation: free, slides_in_plane: y}}".replace("y}", "[0, 1, 0]}")
    drawn = "strips: {s: {section: a, begin: [0, 0, 0], end: [0, 0, 0.3], normal: y}}\njoints: {A: [s start], T: [s finish]}"
    drawn = drawn if "sections" in fields else drawn.replace("section: a, ", "")
    head = fields if "sections" in fields or "material" in fields else f"{fields}\nmaterial: {{}}"
    text = f"{head}\n{drawn}\n{held}\ndimensions: {{length: 0.3, {STEEL}}}\nstages: [{{follow: T_dy, to: 0.1}}]"
    with pytest.raises(ConfigError) as raised:
        parse(text, "scene.yaml")
    assert sentence in str(raised.value) and "\n" not in str(raised.value)


def test_a_message_says_what_its_numbers_are_in_and_dimensions_can_be_listed():
    drawn = "strips: {s: {begin: [0, 0, 0], end: [0, 0, 0.3], normal: y}}\njoints: {A: [s start], T: [s finish]}\n"
    text = (
        f"material: {{}}\n{drawn}held: {{A: clamped, T: clamped}}\nnumbers: {{T_dz: 0.15}}\nstages: [{{follow: T_dy, to: 0}}]\n"
    )
    scene = parse(f"{text}dimensions: {{length: 0.3, {STEEL}}}", "scene.yaml")
    with pytest.raises(ConfigError, match=r"held: A and T are 1.5 apart, .* \(numbers in units of L and B\)$"):
        OpenStage(scene, 1).first()
    steels = STEEL.replace("200GPa", "[100GPa, 200GPa]")
    assert len(parse(f"{text}dimensions: {{length: 0.3, {steels}}}", "scene.yaml").scenes) == 2
