"""Result files that are damaged, foreign or made to do harm: refused in one sentence by all that read them, or read rightly."""

import contextlib
import itertools
import json
import random
import shutil

import h5py
import numpy as np
import pytest

from branches.graph import closed as diagram
from branches.graph.stored import new_graph, read, save
from branches.read import read_branch
from branches.run.runner import run_scene
from branches.scene.closed import ClosedScene
from branches.store.files import StoreError

SCENE = {"m": 1, "n": 2, "stride": 3}


@pytest.fixture(scope="module")
def good(tmp_path_factory, silent):
    path = tmp_path_factory.mktemp("good") / "x.h5"
    run_scene(ClosedScene(**SCENE, steps={"max_points": 15}), path, silent())
    return path


def read_all(path):
    """Read a branch as every reader of the project does."""
    branch = read_branch(path)
    for point in branch.kept():
        branch.shape(point)
    graph = new_graph()
    diagram.add_branch(graph, branch, path.name)
    return diagram.states_at(graph, 3.0)


def refused(call):
    """The sentence, if there is one."""
    try:
        call()
    except StoreError as error:
        assert "\n" not in str(error) and len(str(error)) < 400
        return str(error)
    return ""


def replace(name, value):
    def change(file):
        del file[name]
        file[name] = value

    return change


def claim(name, rows=2**44):
    """A table of so many rows, none of which is on disk."""

    def change(file):
        old = file[name]
        kind, more, attributes = old.dtype, old.shape[1:], dict(old.attrs)
        del file[name]
        file.create_dataset(name, (rows, *more), kind, chunks=(1024, *more)).attrs.update(attributes)

    return change


def cell(table, column, row, value):
    def change(file):
        rows = file[table][:]
        rows[column][row] = value
        file[table][:] = rows

    return change


def outside(file):
    """A column whose numbers are the bytes of another file."""
    del file["solutions/t"]
    file["solutions"].create_dataset("t", (64,), "f8", external=[("/etc/passwd", 0, 512)])


HARM = {
    "petabytes of points": claim("points"),
    "petabytes of events": claim("events"),
    "petabytes of solutions": claim("solutions/states"),
    "petabytes of index": claim("solutions/index"),
    "a table that is a group": replace("points", h5py.SoftLink("/solutions")),
    "a table that is a number": replace("events", 3.0),
    "a table of text": replace("solutions/t", np.array([b"a", b"b"])),
    "a link to nowhere": replace("solutions/t", h5py.SoftLink("/none")),
    "a link to itself": replace("solutions/t", h5py.SoftLink("/solutions/t")),
    "a link to another file": replace("solutions/t", h5py.ExternalLink("/etc/passwd", "/t")),
    "another file's bytes": outside,
    "no points": lambda file: file["points"].resize(0, axis=0),
    "solutions beyond their table": cell("solutions/index", "start", 1, 2**40),
    "solutions before their table": cell("solutions/index", "start", 1, -5),
    "solutions of no degree": cell("solutions/index", "degree", 1, 0),
    "a column of texts": lambda file: replace("events", np.zeros(3, [("point", "i4"), ("kappa_n", "S3")]))(file),
    "events of points that are not there": cell("events", "point", -1, 10**6),
    "a label that is no text": cell("events", "name", 0, b"\xff\xfe"),
    "a scene that is an array": lambda file: file.attrs.__setitem__("config", np.zeros(3)),
    "a version that is an array": lambda file: file.attrs.__setitem__("format_version", np.zeros(3)),
    "a version that is text": lambda file: file.attrs.__setitem__("format_version", "one\ntwo"),
}  # fmt: skip
HARM_TO_RESUMING = {
    "petabytes of state": claim("resume/here/x"),
    "a state of another size": replace("resume/here/x", np.zeros(5)),
    "a tangent of another size": replace("resume/start/tangent", np.zeros(5)),
    "a state that is not finite": lambda file: file["resume/here/x"].__setitem__(3, np.nan),
    "a mesh that goes back": lambda file: file["resume/here/mesh"].__setitem__(2, 0.9),
    "no degree": lambda file: file["resume/here"].attrs.__setitem__("degree", np.inf),
    "a step that is not finite": lambda file: file["resume"].attrs.__setitem__("step", np.nan),
    "more points than there are": lambda file: file["resume"].attrs.__setitem__("points", 10**9),
    "parameters missing": replace("resume/start/parameters", np.zeros(1)),
    "no state": lambda file: file.__delitem__("resume/start/x"),
}


@pytest.mark.parametrize("change", HARM.values(), ids=HARM.keys())
def test_files_made_to_do_harm(good, tmp_path, silent, change):
    path = shutil.copy(good, tmp_path / "x.h5")
    with h5py.File(path, "r+") as file:
        change(file)
    assert refused(lambda: read_all(path))
    assert refused(lambda: run_scene(ClosedScene(**SCENE), path, silent(), resume=True))


@pytest.mark.parametrize("change", HARM_TO_RESUMING.values(), ids=HARM_TO_RESUMING.keys())
def test_states_that_no_run_was_in(good, tmp_path, silent, change):
    path = shutil.copy(good, tmp_path / "x.h5")
    with h5py.File(path, "r+") as file:
        change(file)
    before = path.read_bytes()
    assert "damaged" in refused(lambda: run_scene(ClosedScene(**SCENE), path, silent(), resume=True))
    assert path.read_bytes() == before


@pytest.mark.full
def test_bits_that_turn_on_disk_are_noticed(good, tmp_path):
    """One byte in a hundred files each: what is still read is what was written."""
    image, chance, seen = good.read_bytes(), random.Random(5), 0
    whole = read_branch(good)
    path = tmp_path / "x.h5"
    for _ in range(100):
        garbled = bytearray(image)
        garbled[chance.randrange(len(garbled))] ^= chance.randrange(1, 256)
        path.write_bytes(garbled)
        if refused(lambda: read_all(path)):
            seen += 1
            continue
        found = read_branch(path)
        for name in ("points", "events", "index", "t", "states"):
            assert getattr(found, name).tobytes() == getattr(whole, name).tobytes()
    assert seen > 40


@pytest.mark.parametrize("part", [0.0, 0.01, 0.3, 0.9, 0.999])
def test_files_that_lost_their_end(good, tmp_path, silent, part):
    path, image = tmp_path / "x.h5", good.read_bytes()
    path.write_bytes(image[: int(part * len(image))])
    assert "not a readable HDF5 file" in refused(lambda: read_all(path))
    assert "not a readable HDF5 file" in refused(lambda: run_scene(ClosedScene(**SCENE), path, silent(), resume=True))


@pytest.mark.parametrize("text", ["", "[]", "{}", "null", "[" * 100_000, '{"nodes": 3}', '{"nodes": [], "edges": 1}', "\0"])
def test_diagrams_that_are_none(tmp_path, text):
    (tmp_path / "diagram.json").write_text(text)
    assert "not a diagram" in refused(lambda: read(tmp_path))


def test_diagrams_with_a_value_changed(good, tmp_path):
    """Every value of every node and edge in turn, by every kind of JSON: refused, or answers."""
    graph = new_graph()
    diagram.add_branch(graph, read_branch(good), "x.h5")
    save(graph, tmp_path)
    text, count = (tmp_path / "diagram.json").read_text(), 0
    whole = json.loads(text)
    places = [("graph",), *((part, number) for part in ("nodes", "edges") for number in range(len(whole[part])))]
    for place in places:
        for name, value in itertools.product(_at(whole, place), (None, 1, -1e400, "a", [], [1, "a"], {}, {"a": []})):
            data = json.loads(text)
            _at(data, place)[name] = value
            (tmp_path / "diagram.json").write_text(json.dumps(data))
            count += bool(refused(lambda: _ask(tmp_path)))
    assert count > 100


def _at(data, place):
    for key in place:
        data = data[key]
    return data


def _ask(folder):
    graph = read(folder)
    diagram.families(graph), diagram.folds(graph, -8, 14), diagram.states_at(graph, 3.0)
    with contextlib.suppress(KeyError):  # there is no such branch
        diagram.course(graph, 1, 2)
