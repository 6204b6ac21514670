"""What scenes of any version say and what files of 0.2 hold: sentences word by word, results that are opened and resumed."""

import base64
import gzip
import json
import math
import shutil
from pathlib import Path

import numpy as np
import pytest

from branches.explore.gather import gather
from branches.explore.page import assemble
from branches.graph.closed import describe_node
from branches.run.display import Display
from branches.run.runner import run_scene
from branches.scene.fields import ConfigError
from branches.scene.parse import dump, load, parse
from branches.store.files import StoreError
from branches.store.read import read_branch

KEPT = Path(__file__).parent / "kept"
SENTENCES = json.loads((KEPT / "sentences.json").read_text())
FILES = sorted(path.name.removesuffix(".h5.gz") for path in KEPT.glob("*.h5.gz"))


@pytest.mark.parametrize("case", SENTENCES, ids=[f"{number}" for number in range(len(SENTENCES))])
def test_a_mistake_gets_the_sentence_that_it_always_got(case):
    with pytest.raises(ConfigError) as caught:
        parse(case["text"], "scene.yaml", case["set"])
    assert str(caught.value) == case["said"]


def test_scenes_of_the_package_are_written_and_read_back(root):
    for path in (root / "configs").glob("*.yaml"):
        scene = load(path)
        again = parse(dump(scene), "again")
        assert again == scene and dump(again) == dump(scene)


def unpacked(name, folder):
    with gzip.open(KEPT / f"{name}.h5.gz") as file:
        (folder / f"{name}.h5").write_bytes(file.read())
    return folder / f"{name}.h5"


@pytest.mark.parametrize("name", FILES)
def test_a_file_of_the_version_before_is_read(name, tmp_path):
    path = unpacked(name, tmp_path)
    branch = read_branch(path)
    assert branch.scene == load(KEPT / f"{name}.yaml") and f"{len(branch.points)} points" in repr(branch)
    assert branch.shape(int(branch.kept()[-1])).centreline.shape[1] == 3
    assert set(branch.points.dtype.names) <= set(branch.columns.table("points"))
    assert set(branch.events.dtype.names) <= set(branch.columns.table("events"))


def test_a_page_has_the_units_of_the_table(tmp_path):
    """A strip of 10 mm x 400 mm: values in m and N as `in_units` has them, and its width in percent of its length."""
    path = unpacked("dimensions", tmp_path)
    branch, page = read_branch(path), gather([str(path)])
    table, name = branch.in_units(), "F_tangent [N]"
    title, brief, decimals = next(axis[1:] for axis in page["axes"] if axis[0] == "F_tangent")
    assert name in title and brief == name and decimals == 8 + 1 - math.ceil(math.log10(branch.scene.factor("F_tangent")))
    first = page["families"][0]["branches"][0]["columns"]
    for column in ("distance", "F_tangent"):
        kind, text = first[column][0], first[column][1:]
        values = np.frombuffer(base64.b64decode(text), "<f8")
        assert kind == "d" and np.array_equal(values, table[branch.titled(column)][: len(values)])
    assert values.min() < -1.0 and math.isclose(page["width"], 2.5) and 'value="2.5"' in assemble(page)
    other = unpacked("open", tmp_path)
    with pytest.raises(StoreError, match=r"several units: energy \[B/L\], energy \[J\]"):
        gather([str(path), str(other)])


def test_an_end_says_why_in_pictures_and_lists(tmp_path):
    branch, name = read_branch(unpacked("closed", tmp_path)), "the end of the convex strain energy"
    branch.events["label"][-1], branch.events["name"][-1] = b"EP", name.encode()
    assert [mark.word for mark in branch.marks()][-1] == f"end: {name}"
    assert describe_node({"kind": "end", "kappa_n": 9.302262, "what": name}) == f"end at 9.302262 ({name})"


@pytest.mark.sample(1)
@pytest.mark.parametrize("name", [name for name in FILES if name.endswith("unfinished")])
def test_an_unfinished_file_of_the_version_before_goes_on(name, tmp_path):
    """It keeps its columns, and its new rows are those of a run without an interruption."""
    path, whole = unpacked(name, tmp_path), tmp_path / "whole.h5"
    scene, before = load(KEPT / f"{name}.yaml"), read_branch(path)
    assert run_scene(scene, path, Display(silent=True), resume=True) == "complete"
    assert run_scene(scene, whole, Display(silent=True)) == "complete"
    after, expected = read_branch(path), read_branch(whole)
    assert after.points.dtype == before.points.dtype and after.events.dtype == before.events.dtype
    assert after.points[: len(before.points) - 1].tobytes() == before.points[:-1].tobytes()
    assert after.events["label"].tolist() == expected.events["label"].tolist()
    labelled = [name for name in after.events.dtype.names if after.events.dtype[name] == np.float64 and "error" not in name]
    for column in labelled:
        if column != "arclength":  # steps may differ
            assert np.allclose(after.events[column], expected.events[column], rtol=1e-6, atol=1e-6), column


def test_a_finished_file_of_the_version_before_is_finished(tmp_path):
    path = unpacked("open", tmp_path)
    shutil.copy(path, tmp_path / "copy.h5")
    assert run_scene(load(KEPT / "open.yaml"), path, Display(silent=True), resume=True) == "complete"
    assert path.read_bytes() == (tmp_path / "copy.h5").read_bytes()
