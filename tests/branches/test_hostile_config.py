"""Any text in a scene or behind ``--set`` gives a run, or one sentence; no other exception, no hang, no code executed."""

import os
import time

import pytest
import yaml

from branches.run.runner import run_scene
from branches.scene.closed import ClosedScene, OriginConfig
from branches.scene.fields import ConfigError
from branches.scene.parse import dump, load, parse
from branches.scene.sweep import Sweep
from branches.store.files import StoreError

hypothesis = pytest.importorskip("hypothesis", reason="hypothesis is not installed")
from hypothesis import example, given, settings  # noqa: E402
from hypothesis import strategies as st  # noqa: E402

FIELDS = [*ClosedScene.model_fields, "pairs", "strip", "origin"]
LAWS = ["ribbon", "flat rod", "isotropic rod", "finite width"]
DOMAINS = ["cell", "half loop", "half loop between axes"]
WORDS = [*LAWS, *DOMAINS, "wavenumber 1 even"]
numbers = st.one_of(
    st.integers(-3, 12), st.integers(), st.floats(), st.floats(-1, 1),
    st.sampled_from([10**400, 2**63, -(2**63), 5e-324, 1.8e308, float("nan"), float("inf")]),
)  # fmt: skip
scalars = st.one_of(numbers, st.booleans(), st.none(), st.sampled_from(WORDS), st.text(max_size=6))
names = st.one_of(
    st.sampled_from([*FIELDS, "degree", "intervals", "kappa_n", "first", "mode", "thickness"]), st.text(max_size=4)
)
anything = st.recursive(
    scalars,
    lambda inner: st.one_of(st.lists(inner, max_size=4), st.dictionaries(st.one_of(names, scalars), inner, max_size=3)),
    max_leaves=12,
)
scenes = st.dictionaries(st.sampled_from(FIELDS), anything, max_size=5).map(lambda scene: {"m": 1, "n": 2, **scene})


def scene_or_sentence(text, changes=()):
    """The scene, or None after a look at the sentence."""
    began = time.monotonic()
    try:
        return parse(text, "scene", list(changes))
    except ConfigError as error:
        said = str(error)
        assert said.isprintable() and len(said) < 1000, said
        return None
    finally:
        assert time.monotonic() - began < 10  # a bomb would take years


@given(st.one_of(st.text(), st.binary().map(lambda data: data.decode("latin-1"))))
@example("a: &a [x, x]\nb: &b [*a, *a, *a]\nm: *b\n")
@example("!!python/object/apply:os.system ['touch executed']")
@example("{" * 2000)
@example("m: " + "9" * 100_000)
@example("? " * 3000)
@example("a: " * 3000)
def test_any_text(text):
    scene_or_sentence(text)
    assert not os.path.exists("executed")


@given(scenes)
def test_any_value_of_any_field(values):
    """A scene that is accepted can be written to a file and read back unchanged."""
    config = scene_or_sentence(yaml.safe_dump(values, sort_keys=False, allow_unicode=True))
    if config is not None:
        assert parse(dump(config), "again") == config


@given(st.lists(st.one_of(st.text(max_size=12), st.builds("{}={}".format, names, st.text(max_size=8))), max_size=3))
@example(["__class__.__init__=1"])
@example(["m=!!python/name:os.system"])
@example(["limits.kappa_n=" + "[" * 3000])
@example([".".join(["mesh"] * 3000) + "=1"])
def test_any_setting(changes):
    scene_or_sentence("m: 1\nn: 2\n", changes)


@settings(max_examples=settings().max_examples // 12)
@given(st.data())
def test_what_is_accepted_runs(tmp_path_factory, silent, data):
    """Scenes within the bounds of every field: to an end, or a sentence, and never half a file."""
    draw = data.draw
    values = {
        "m": draw(st.integers(1, 9)), "n": draw(st.integers(1, 9)), "nu": draw(st.floats(-0.99, 0.5)),
        "law": draw(st.sampled_from(LAWS)), "domain": draw(st.sampled_from(DOMAINS[:2])),
        "mesh": {
            "degree": draw(st.integers(2, 8)), "intervals": draw(st.integers(1, 30)), "max_intervals": 40,
            "tolerance": draw(st.floats(1e-14, 1e-2)), "adapt_every": draw(st.integers(0, 3)),
        },
        "steps": {
            "max_points": 4, "largest": draw(st.one_of(st.floats(1e-5, 1e308), st.floats(0.01, 1))),
            "smallest": draw(st.sampled_from([5e-324, 1e-300, 1e-6])), "angle": draw(st.floats(0.0011, 1.0)),
        },
        "stability": draw(st.booleans()), "stride": draw(st.integers(1, 10**6)),
    }  # fmt: skip
    if values["law"] == "finite width":
        values["Gamma"] = draw(st.one_of(st.floats(0, 1e12), st.floats(0, 100)))
    config = scene_or_sentence(yaml.safe_dump(values))
    if config is None or isinstance(config, Sweep):
        return
    path = tmp_path_factory.mktemp("run") / "x.h5"
    try:
        assert run_scene(config, path, silent()) in ("complete", "lost")
    except (ConfigError, StoreError) as error:
        assert "\n" not in str(error) and not os.listdir(path.parent)


@pytest.mark.full
def test_the_least_number_as_smallest_step(tmp_path, silent):
    """Where a run fails, no smaller step can be advised."""
    mesh = "{degree: 2, intervals: 5, max_intervals: 40, tolerance: 1.0e-14, adapt_every: 3}"
    steps = "{max_points: 4, largest: 2.888934874210801e+24, smallest: 5.0e-324, angle: 0.8597091859224091}"
    text = f"{{m: 2, n: 9, nu: 0.0, law: flat rod, domain: cell, mesh: {mesh}, steps: {steps}, stability: true}}"
    assert run_scene(parse(text, "least"), tmp_path / "x.h5", silent()) in ("complete", "lost")


def test_no_field_is_left_out_here():
    assert set(OriginConfig.model_fields) == {"kappa_n", "kappa_star", "mode"} and set(ClosedScene.model_fields) < set(FIELDS)


@pytest.mark.parametrize(
    "name", ["a b.yaml", "é ±.yaml", "-rf.yaml", "a'b\".yaml", "$(touch executed).yaml", "a\nb.yaml", "~.yaml"]
)
def test_names_of_files(tmp_path, silent, name):
    (tmp_path / name).write_text("m: 1\nn: 2\nsteps: {max_points: 2}\n")
    path = (tmp_path / name).with_suffix(".h5")
    assert run_scene(load(tmp_path / name), path, silent()) == "complete"
    assert sorted(os.listdir(tmp_path)) == sorted([name, path.name])
