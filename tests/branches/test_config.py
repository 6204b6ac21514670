"""Scenes: what is accepted, and the one sentence that a mistake gets."""

import math
from typing import get_args

import h5py
import pytest
from pydantic import ValidationError

from branches.scene.closed import ClosedScene
from branches.scene.fields import ConfigError
from branches.scene.parse import dump, load, parse
from ribbon_model.domains import DOMAINS, LOOP

SCENE = "m: 1\nn: 2\n"
HUGE = "1" + "0" * 5000
BOMB = "a: &a [x, x]\n" + "".join(f"{c}: &{c} [*{p}, *{p}, *{p}, *{p}]\n" for p, c in zip("abcdefghijklmno", "bcdefghijklmnop"))

# text of the file, and what the sentence must say: the field, the value, what is allowed
BAD = {
    "unknown field": (SCENE + "foo: 1\n", ["'foo'", "title, law, nu, Gamma, m, n"]),
    "unknown nested field": (SCENE + "mesh: {foo: 1}\n", ["'mesh.foo'", "degree, intervals"]),
    "junk below a number": (SCENE + "mesh: {degree: {a: {b: 1}}}\n", ["mesh.degree", "whole number", "{'a': {'b': 1}}"]),
    "missing field": ("m: 1\n", ["'n'", "missing"]),
    "load of another name": (
        "material: {law: flat rod, nu: 0.3}\nstages: [{follow: weigth, to: 1}]\n",
        ["follow: 'weigth' (did you mean 'weight'?)"],
    ),
    "number with a unit that has none": (
        "material: {law: flat rod, nu: 0.3}\nstages: [{follow: weight, to: 3 N/m}]\n",
        ["stages.0.to: must be a number, not '3 N/m'; write the number alone, in a scene with dimensions in m"],
    ),
    "two mistakes": ("m: 0\nn: 0\n", ["m:", "1 more"]),
    "bool for an integer": ("m: true\nn: 2\n", ["m:", "whole number", "True"]),
    "text for an integer": ("m: '1'\nn: 2\n", ["m:", "whole number", "'1'"]),
    "float for an integer": ("m: 1.0\nn: 2\n", ["m:", "whole number", "1.0"]),
    "fraction": ("m: 1.5\nn: 2\n", ["m:", "whole number", "1.5"]),
    "nan for an integer": ("m: .nan\nn: 2\n", ["m:", "whole number", "nan"]),
    "infinite integer": ("m: .inf\nn: 2\n", ["m:", "whole number", "inf"]),
    "huge integer": (f"m: {10**25}\nn: 2\n", ["m:", "1000"]),
    "integer of 5001 digits": (f"m: {HUGE}\nn: 2\n", ["m:", "whole number", "10000"]),
    "hexadecimal": ("m: 0x" + "f" * 6000 + "\nn: 2\n", ["m:", "whole number", "0xfff"]),
    "octal": ("m: 010\nn: 2\n", ["m:", "whole number", "'010'"]),
    "sexagesimal": ("m: 1\nn: 1:30\n", ["n:", "whole number", "'1:30'"]),
    "date": ("m: 2020-13-45\nn: 2\n", ["m:", "whole number", "2020-13-45"]),
    "list for a number": (SCENE + "mesh: {tolerance: [1]}\n", ["mesh.tolerance", "number", "[1]"]),
    "bool for a number": (SCENE + "nu: true\n", ["nu:", "number", "True"]),
    "nothing for a number": (SCENE + "nu:\n", ["nu:", "number", "None"]),
    "nan": (SCENE + "nu: .nan\n", ["nu:", "finite", "nan"]),
    "number beyond all floats": (SCENE + "nu: 1e999\n", ["nu:", "finite", "inf"]),
    "number for text": (SCENE + "title: 3\n", ["title:", "text", "3"]),
    "n = m": ("m: 2\nn: 2\n", ["n = m = 2", "rotation"]),
    "n < 1": ("m: 1\nn: 0\n", ["n:", "at least 1", "not 0"]),
    "m < 1": ("m: -1\nn: 2\n", ["m:", "at least 1", "not -1"]),
    "nu = -1": (SCENE + "nu: -1\n", ["nu:", "above -1", "not -1"]),
    "nu > 1/2": (SCENE + "nu: 0.6\n", ["nu:", "at most 0.5", "not 0.6"]),
    # the cell does not close if every two-fold axis lies in the mirror plane
    "m / n even": ("m: 4\nn: 2\n", ["m = 4, n = 2", "even"]),
    # 1 + 2 nu (n^2/m^2 - 1) <= 0 in equation (27): the twisting modulus is not positive there
    "no threshold": (SCENE + "nu: -0.3\n", ["nu = -0.3", "threshold"]),
    "unknown law": (SCENE + "law: steel\n", ["law:", "'flat rod'", "'steel'"]),
    "unknown domain": (SCENE + "domain: loop\n", ["domain:", "'half loop'", "'loop'"]),
    "limits of what": (SCENE + "limits: {foo: [1, 5]}\n", ["limits.foo", "'kappa_star'"]),
    "limits without end": (SCENE + "limits: {kappa_n: [1]}\n", ["limits.kappa_n", "two", "[1]"]),
    "limits reversed": (SCENE + "limits: {kappa_n: [3, 1]}\n", ["limits.kappa_n", "smaller first", "[3, 1]"]),
    "limits infinite": (SCENE + "limits: {kappa_n: [-.inf, 5]}\n", ["limits.kappa_n", "finite", "-inf"]),
    "limits of text": (SCENE + "limits: {kappa_n: ab}\n", ["limits.kappa_n", "two", "'ab'"]),
    "limits scalar": (SCENE + "limits: 3\n", ["limits:", "key: value", "3"]),
    # on the 1-covered circle (27) gives kappa_n = 2.5, there kappa* = 1 and the energy is 1/2 - 2.5
    "limits beyond the start": (SCENE + "limits: {kappa_n: [3, 5]}\n", ["limits: kappa_n: 3, 5", "kappa_n = 2.5"]),
    "limits that touch the start": (SCENE + "limits: {kappa_n: [2.5, 5]}\n", ["limits: kappa_n", "2.5"]),
    "other limits beyond the start": (SCENE + "limits: {energy: [2, 5]}\n", ["limits: energy: 2, 5", "energy = -2"]),
    "zeros scalar": (SCENE + "zeros: {kappa_n: 3}\n", ["zeros.kappa_n", "list", "3"]),
    "zeros nan": (SCENE + "zeros: {kappa_n: [1, .nan]}\n", ["zeros.kappa_n.1", "finite", "nan"]),
    "zeros without number": (
        SCENE + "zeros: {kappa_n: [" + "3, " * 5000 + "]}\n",
        ["zeros.kappa_n: must have at most 100 items, not 5000"],
    ),
    "stride": (SCENE + "stride: 0\n", ["stride:", "1", "not 0"]),
    "steps apart in the seventh digit": (SCENE + "steps: {first: 0.1, smallest: 0.1000001}\n", ["0.1 must", "= 0.1000001"]),
    "limits apart in the seventh digit": (SCENE + "limits: {kappa_n: [2.5000001, 5]}\n", ["2.5000001, 5", "kappa_n = 2.5"]),
    "steps are a list": (SCENE + "steps: [1]\n", ["steps:", "key: value", "[1]"]),
    "steps out of order": (SCENE + "steps: {first: 5, largest: 1}\n", ["steps:", "first = 5", "largest = 1"]),
    "no step possible": (SCENE + "steps: {smallest: 0.1, largest: 0.01}\n", ["steps:", "smallest = 0.1", "largest = 0.01"]),
    "mesh out of order": (SCENE + "mesh: {intervals: 50, max_intervals: 20}\n", ["mesh:", "intervals = 50", "20"]),
    "degree": (SCENE + "mesh: {degree: 9}\n", ["mesh.degree", "8", "not 9"]),
    "empty": ("", ["empty"]),
    "comment only": ("# nothing\n", ["empty"]),
    "list": ("- 1\n- 2\n", ["key: value", "[1, 2]"]),
    "word": ("hello\n", ["key: value", "'hello'"]),
    "two documents": ("m: 1\n---\nn: 2\n", ["line 2"]),
    "bracket left open": ("m: [1\n", ["line 2", "']'"]),
    "tab": ("m:\t1\n\tn: 2\n", ["line 1", "'\\t'"]),
    "key twice": (SCENE + "n: 3\n", ["line 3", "'n'", "twice"]),
    "number as key": (SCENE + "1: 2\n", ["1:", "words"]),
    "decimal comma": ("{m: 1, n: 2, nu: 0,3}\n", ["3:", "decimal point"]),
    "list as key": (SCENE + "? [1]\n: 2\n", ["line 3", "unhashable"]),
    "Python object": (SCENE + "title: !!python/object/apply:os.getcwd []\n", ["line 3", "tags"]),
    "alias": ("m: &a 1\nn: *a\n", ["line 2", "aliases"]),
    "aliases that expand": (BOMB + "m: *p\n", ["line 2", "aliases"]),
    "alias of itself": ("m: &m [*m]\n", ["line 1", "aliases"]),
    "nested without end": ("m: " + "[" * 5000, ["nested too deeply"]),
    "control character": ("m: 1\x07\n", ["#x0007"]),
    "escape sequence": ('m: "\\e[31m"\nn: 2\n', ["m:", "\\x1b[31m"]),
}


@pytest.mark.parametrize("text, said", BAD.values(), ids=BAD.keys())
def test_a_mistake_gets_one_sentence(text, said):
    with pytest.raises(ConfigError) as caught:
        parse(text, "scene.yaml")
    message = str(caught.value)
    assert message.startswith("scene.yaml: ") and message.isprintable() and len(message) < 250
    for part in said:
        assert part in message.removeprefix("scene.yaml: ")


BAD_SETTINGS = {
    "=3": "must be key=value", "": "must be key=value", "m": "must be key=value", "a..b=3": "must be key=value",
    "mesh.=3": "must be key=value", "m=": "--set m=: m:", "m=two": "--set m=two: m:", "m=[": "--set m: not usable YAML",
    "m.x=3": "'m' has no fields", "mesh.degree.x=2": "mesh.degree", "steps=5": "--set steps=5: steps", "m=1=2": "'1=2'",
    "foo.bar=1": "unknown field 'foo'", "__class__=1": "unknown field '__class__'", "m=*a": "aliases", "m=\0": "#x0000",
    "limits.kappa_n.low=3": "limits.kappa_n", "n=1": "n = m = 1", "nu=nan": "--set nu=nan: nu: must be a number",
}  # fmt: skip


@pytest.mark.parametrize("setting, said", BAD_SETTINGS.items())
def test_a_mistake_in_a_setting_gets_one_sentence(setting, said):
    with pytest.raises(ConfigError) as caught:
        parse(SCENE, "scene.yaml", [setting])
    assert said in str(caught.value) and str(caught.value).isprintable()


def test_settings_go_over_the_file_in_order():
    config = parse(SCENE, "scene", ["nu=0.2", "mesh.degree=4", "limits.kappa_n=[-5, 5]", "nu = 1e-1", "title=a"])
    assert (config.nu, config.mesh.degree, config.limits, config.title) == (0.1, 4, {"kappa_n": (-5.0, 5.0)}, "a")


NUMBERS = {"1e-3": 1e-3, "1E-3": 1e-3, "-.25": -0.25, "+0.5": 0.5, "0": 0, "1.e-1": 0.1}


@pytest.mark.parametrize("text, value", NUMBERS.items())
def test_numbers_are_read_as_a_physicist_writes_them(text, value):
    assert parse(f"m: 3\nn: 2\nnu: {text}\n", "scene").nu == value


TITLES = ["", "1e-3", "yes", "null", "0x10", "1:30", "2020-01-01", "é ± \U0001f300", "a\nb\x85c", '"', "<<", "*a", "\0"]


@pytest.mark.parametrize("title", TITLES)
def test_what_is_written_is_read_back(title):
    config = ClosedScene(
        title=title, m=3, n=5, nu=1e-7, limits={"M2": (-1e-5, 3)}, zeros={"kappa_n": [1, 2.5]},
        mesh={"tolerance": 1e-9}, steps={"first": 1e-3, "largest": 1e30},
    )  # fmt: skip
    assert parse(dump(config), "again") == config


def test_the_first_step_is_chosen_within_its_bounds():
    for steps, first in ({}, 0.05), ({"largest": 0.01}, 0.01), ({"smallest": 0.2}, 0.2), ({"first": 0.3}, 0.3):
        assert ClosedScene(m=1, n=2, steps=steps).steps.first_step == first


def test_the_start_of_a_branch():
    """Equation (27): kappa_n = m (2 n^2 - m^2) / (m^2 + 2 nu (n^2 - m^2)) = 3 * 23 / 13.2 for (3, 4) at nu = 0.3."""
    start = ClosedScene(m=3, n=4).at_bifurcation()
    assert math.isclose(start["kappa_n"], 69 / 13.2, rel_tol=1e-14)
    assert (start["kappa_star"], start["M2"]) == (3, 0)
    assert math.isclose(start["M1"], 3 - 69 / 13.2) and math.isclose(start["energy"], 4.5 - 3 * 69 / 13.2)


def test_a_scene_is_not_changed_once_made():
    with pytest.raises(ValidationError):
        ClosedScene(m=1, n=2).nu = 0.1


def test_domains_are_those_of_the_model():
    assert {*get_args(ClosedScene.model_fields["domain"].annotation), LOOP.name} == set(DOMAINS)


def test_the_half_loop_takes_what_the_cell_cannot():
    assert ClosedScene(m=2, n=1, domain="half loop").m == 2


def test_files_that_are_no_scene(tmp_path):
    binary, latin, large = tmp_path / "binary", tmp_path / "latin", tmp_path / "large"
    binary.write_bytes(bytes(range(256)))
    latin.write_bytes("title: é\n".encode("latin-1"))
    large.write_bytes(b"#" * 2_000_000)
    result = tmp_path / "result.h5"
    h5py.File(result, "w").close()
    with pytest.raises(ConfigError, match="it is a result, which 'ribbon plot' draws"):
        load(result)
    files = {
        tmp_path / "none.yaml": "No such file",
        tmp_path: "it is a folder; a scene is a YAML file",
        binary: "UTF-8",
        latin: "UTF-8",
        large: "megabyte",
    }
    for path, said in files.items():
        with pytest.raises(ConfigError, match=said) as caught:
            load(path)
        assert repr(str(path)) in str(caught.value)


def test_every_scene_of_the_project_is_one(root):
    scenes = sorted((root / "configs").glob("m*_n*.yaml"))
    assert len(scenes) >= 3
    for path in scenes:
        config = load(path)
        assert path.stem == f"m{config.m}_n{config.n}"
