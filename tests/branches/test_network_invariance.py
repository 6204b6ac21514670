"""Networks are the same wherever they stand, and however they are drawn: turned, moved, with strips drawn from their other end,
in another order, under other names, cut. Labelled points, their values, index, places and reactions are compared.
"""

import functools
import re
from pathlib import Path

import numpy as np
import pytest
import yaml
from scipy.spatial.transform import Rotation

from branches.read import read_branch
from branches.run.display import Display
from branches.run.runner import run_scene
from branches.scene.fields import ConfigError
from branches.scene.parse import parse
from ribbon_model.equilibrium import directors

CONFIGS = Path(__file__).parents[2] / "configs"
TURN, SHIFT = Rotation.from_rotvec([0.7, -0.4, 1.1]).as_matrix(), np.array([1.5, -4.0, 2.5])
CHANGES = ("all", "turned", "moved", "against", "order", "names", "cut")


class _Plain(yaml.SafeDumper):
    """A scene has no aliases."""

    def ignore_aliases(self, data):
        return True


class Redrawn:
    """A scene as fields, redrawn: what each change does to strips, joints, supports and loads."""

    def __init__(self, fields: dict, change: str):
        self.scene, self.fields = parse(yaml.dump(fields, Dumper=_Plain), "scene.yaml"), fields
        does = {one for one in CHANGES[1:] if change in ("all", one)}
        self.turn = TURN if "turned" in does else np.eye(3)
        self.shift = SHIFT if "moved" in does else np.zeros(3)
        self.order = -1 if "order" in does else 1
        self.joint, self.strip = ("j_{}", "t_{}") if "names" in does else ("{}", "{}")
        self.against = set(list(fields["strips"])[::2]) if "against" in does else set()
        self.cut = next(iter(fields["strips"])) if "cut" in does else None

    def vector(self, values) -> list[float]:
        return (self.turn @ np.array(values, dtype=float)).tolist()

    def place(self, words: str) -> str:
        name, _, where = words.partition(" ")
        if name in self.against:
            at = where.removeprefix("at ")
            where = {"start": "finish", "finish": "start"}.get(where) or f"at {1 - float(at):.12g}"
        return f"{self.strip.format(name)} {where}"

    def strips(self) -> dict:
        found = {}
        for name, member in list(self.scene._drawn.items())[:: self.order]:
            state = member.drawn([member.length if name in self.against else 0.0])[0]
            _, normal, tangent = np.reshape(directors(*state[:4]), (3, 3))
            bend, _, twist = member.strains
            found[self.strip.format(name)] = {
                "begin": (self.turn @ state[4:] + self.shift).tolist(), "normal": self.vector(normal), "length": member.length,
                "along": self.vector(-tangent if name in self.against else tangent), "bend": bend * member.length,
                "twist": twist * member.length, **({"section": member.section} if "sections" in self.fields else {}),
            }  # fmt: skip
        return found

    def joints(self) -> dict:
        found = {}
        for name, joint in list(self.fields["joints"].items())[:: self.order]:
            given = dict(joint) if isinstance(joint, dict) else {"strips": joint}
            changed = {"strips": [self.place(one) for one in given["strips"]]}
            for part in ("angle", "arm"):
                for place, value in given.get(part, {}).items():
                    flip = np.array([-1, 1, -1]) if place.split()[0] in self.against and part == "arm" else 1
                    value = (flip * np.array(value)).tolist() if part == "arm" else value
                    changed.setdefault(part, {})[self.place(place)] = value
            if "angle" in given:
                about = self.scene.joints[name].about
                changed["about"] = self.vector(self.scene.axes_at(name).get(about, about))
            changed |= {"hinge": self.vector(given["hinge"])} if "hinge" in given else {}
            found[self.joint.format(name)] = changed | ({"ball": True} if given.get("ball") else {})
        if self.cut:
            found["cut"] = [f"{self.strip.format(self.cut)} at 0.37"]
        return found

    def held(self, given: dict) -> dict:
        vectors = ("about", "slides_along", "slides_in_plane")
        return {
            self.joint.format(name): end if isinstance(end, str) else
            {field: self.vector(value) if field in vectors else value for field, value in end.items()}
            for name, end in given.items()
        }  # fmt: skip

    def loads(self) -> dict:
        def acting(action):
            if isinstance(action, list):
                return self.vector(action)
            return {field: self.vector(value) if field in ("force", "arm") else value for field, value in action.items()}

        return {
            number: {
                self.joint.format(at) if at in self.fields["joints"] else self.place(at): acting(one) for at, one in of.items()
            }
            for number, of in self.fields.get("loads", {}).items()
        }

    def changed(self) -> dict:
        directions = {name: self.vector(value) for name, value in self.scene.directions.model_dump().items()}
        return self.fields | {
            "strips": self.strips(), "joints": self.joints(), "held": self.held(self.fields.get("held", {})),
            "loads": self.loads(), "directions": directions,
        }  # fmt: skip


def _result(fields: dict, path: Path):
    """The result of a scene, or why it has no first state."""
    try:
        run_scene(parse(yaml.dump(fields, Dumper=_Plain), "scene.yaml"), path, Display(silent=True), overwrite=True)
    except ConfigError as error:
        return str(error)
    return read_branch(path)


def _compare(fields: dict, change: str, folder: Path, first=None) -> None:
    redrawn = Redrawn(fields, change)
    one = _result(fields, folder / "one.h5") if first is None else first
    other = _result(redrawn.changed(), folder / "other.h5")
    if isinstance(one, str):  # both can move, or forces are undetermined in both: the same words, with the names of either
        assert isinstance(other, str) and set(one.split()) == set(re.sub(r"\b[jt]_", "", other).split()), other
        return
    assert not isinstance(other, str), other
    a, b = one.events, other.events
    assert a["label"].tolist() == b["label"].tolist()
    for name in ("index_before", "index_after", "kernel", "stage", "index"):
        assert a[name].tolist() == b[name].tolist(), name
    for name in dict.fromkeys(stage["follow"] for stage in fields["stages"]):
        size = 1 + np.abs(a[name]).max()
        np.testing.assert_allclose(b[name], a[name], rtol=0, atol=1e-8 * size, err_msg=name)
    forces = 1 + max((np.abs(a[name]).max() for name in a.dtype.names if name[:2] in ("F_", "M_")), default=0.0)
    if "weight" not in a.dtype.names:  # whose potential is zero at the origin
        np.testing.assert_allclose(b["energy"], a["energy"], rtol=0, atol=1e-7 * (1 + np.abs(a["energy"]).max()))
    if "floating" in a.dtype.names:  # which is held at the first end of its first strip
        assert max(a["floating"].max(), b["floating"].max()) < 1e-7
        return
    for name in one.scene.joints:

        def vectors(table, name, before=""):
            return np.array([table[f"{before}{name}_{axis}"] for axis in "xyz"]).T

        there = redrawn.joint.format(name)
        np.testing.assert_allclose(vectors(b, there), vectors(a, name) @ redrawn.turn.T + redrawn.shift, rtol=0, atol=1e-7)
        for kind in ("F_", "M_") if name in one.scene.held else ():
            np.testing.assert_allclose(
                vectors(b, there, kind),
                vectors(a, name, kind) @ redrawn.turn.T,
                rtol=0,
                atol=1e-7 * forces,
                err_msg=kind + name,
            )


#: Where the first stage of scenes ends here that take long: behind their first branch points.
ENDS = {"network_arches": 36.0, "network_bigon_ring": 3.7, "network_hexagon": 1.1, "network_hexagram": 0.9}


@functools.cache
def _shipped(name: str) -> dict:
    """The fields of a shipped scene, up to the first stage that leaves a branch point: to either side, as its mode is drawn."""
    fields = yaml.safe_load((CONFIGS / f"{name}.yaml").read_text("utf-8"))
    leaves = [number for number, stage in enumerate(fields["stages"]) if str(stage.get("start_at", "")).startswith("BP")]
    first, *stages = fields["stages"][: leaves[0] if leaves else None]
    return fields | {"stages": [first | {"to": ENDS.get(name, first["to"])}, *stages]}


NAMES = sorted(path.stem for path in CONFIGS.glob("network_*.yaml"))
#: Short: tried by default, and each change by itself with --full.
QUICK = "network_weight"


@pytest.mark.full
@pytest.mark.parametrize(
    ("name", "change"),
    [(QUICK, "all"), *(pytest.param(name, "all", marks=pytest.mark.full) for name in NAMES if name != QUICK)]
    + [pytest.param(QUICK, one, marks=pytest.mark.full) for one in CHANGES[1:]],
)  # fmt: skip
def test_shipped_networks_are_the_same_however_they_are_drawn(name, change, tmp_path):
    _compare(_shipped(name), change, tmp_path)


#: Two strips that float, at first without loads; a pair of forces, or three in a plane.
FLOATS = """
material: {law: rod, B1: 1, B2: 4, C: 0.8, kappa_n: 0.5}
strips:
  a: {begin: [0, 0, 0], end: [0.5, 0.3, 1], normal: [0, 1, 0]}
  b: {begin: [0.5, 0.3, 1], end: [1.2, 0.3, 1.4], normal: [0, 1, 0]}
joints: {A: [a start], B: [b finish], C: [a finish, b start]}
"""
FORCES = [{"A": [0, 0, -1], "B": [0, 0, 1]}, {"A": [0, 0, 1], "B": [0.3, 0, 0], "C": [-0.3, 0, -1]}]


@pytest.mark.full
@pytest.mark.parametrize("load", [{"loads": {"P": forces}} for forces in FORCES] + [{"magnetized": "normal"}])
def test_networks_that_float_are_the_same_however_they_are_drawn(load, tmp_path):
    _compare(
        yaml.safe_load(FLOATS) | load | {"stages": [{"follow": "P" if "loads" in load else "field", "to": 2}]}, "all", tmp_path
    )


def _random(seed: int) -> dict:
    """Strips in a row, a ring or a tree, with joints of all kinds, supports and a load in any direction."""
    rng = np.random.default_rng(seed)

    def vector(size=1.0):
        return (size * rng.standard_normal(3)).round(3).tolist()

    kind, count = ("row", "ring", "tree")[seed % 3], int(rng.integers(2, 5))
    places = [vector() for _ in range(count + (kind != "ring"))]
    far = {"row": lambda i: i + 1, "ring": lambda i: (i + 1) % count, "tree": lambda i: i + 1}[kind]
    near = {"row": lambda i: i, "ring": lambda i: i, "tree": lambda i: int(rng.integers(i + 1))}[kind]
    pairs = [(near(i), far(i)) for i in range(count)] + ([(0, 1)] if kind == "ring" and count == 2 else [])
    pairs = pairs[:1] if kind == "ring" and count == 2 else pairs
    strips = {f"s{i}": {"begin": places[a], "end": places[b], "normal": vector()} for i, (a, b) in enumerate(pairs)}
    at: dict[int, list[str]] = {}
    for i, (a, b) in enumerate(pairs):
        at.setdefault(a, []).append(f"s{i} start")
        at.setdefault(b, []).append(f"s{i} finish")
    joints = {}
    for number, ends in at.items():
        more = [{}, {}, {}, {"hinge": vector()}, {"ball": True}][int(rng.integers(5))] if len(ends) > 1 else {}
        joints[f"J{number}"] = {"strips": ends, **more}
    support = ["clamped"] * 2 + ["hinged"] + [{"rotation": "hinged", "about": vector()}, {"slides_along": vector()}]
    held = {name: support[int(rng.integers(5))] for name in (["J0", f"J{max(at)}"] if kind != "tree" else ["J0"])}
    loads = {"P": {f"s{int(rng.integers(len(strips)))} at 0.6": {"force": vector(), "follows": seed % 7 == 3}}}
    stiffness = dict(zip(("B1", "B2", "C"), rng.uniform(0.5, 3, 3).round(3).tolist()))
    return {
        "material": {"law": "rod", **stiffness, "kappa_n": round(float(rng.uniform(-1, 1)), 3), "tau_n": 0.2},
        "strips": strips, "joints": joints, "held": held, "loads": loads, "numbers": {"weight": 0.5} if seed % 2 else {},
        "stages": [{"follow": "P", "to": 1.0}],
    }  # fmt: skip


#: One under weight is tried by default; others take longer.
FEW = (27,)


@pytest.mark.parametrize("seed", [*FEW, *(pytest.param(n, marks=pytest.mark.full) for n in range(30) if n not in FEW)])
def test_random_networks_are_the_same_however_they_are_drawn(seed, tmp_path):
    _compare(_random(seed), "all", tmp_path)
