"""Result files: what they hold, that they are whole at any instant, and that docs/file-format.md tells the truth."""

import dataclasses
import errno
import os
import re
import signal
import stat
import time
from pathlib import Path

import h5py
import numpy as np
import pandas as pd
import pytest

from branches.read import read_branch
from branches.run.runner import run_scene
from branches.scene.closed import ClosedScene
from branches.store import files
from branches.store.files import StoreError, prepare, write_bytes
from branches.store.writer import open_branch
from ribbon_model.segments import discretized


@pytest.fixture(scope="module")
def results(tmp_path_factory, silent):
    """The branch (1, 2) of the cell, and a piece of it on the half loop with every fifth solution kept."""
    folder = tmp_path_factory.mktemp("results")
    assert run_scene(ClosedScene(m=1, n=2, title="é"), folder / "m1_n2.h5", silent()) == "complete"
    half = ClosedScene(m=1, n=2, domain="half loop", stride=5, steps={"max_points": 12}, zeros={"kappa_n": [2.51]})
    assert run_scene(half, folder / "half.h5", silent()) == "complete"
    return folder


# --- what a file holds ----------------------------------------------------------------------------------------------


def test_plain_h5py_and_pandas_read_it(results):
    with h5py.File(results / "m1_n2.h5") as file:
        points, events = (pd.DataFrame(file[name][:]) for name in ("points", "events"))
        assert file.attrs["status"] == "complete" and file.attrs["stop_reason"] == "trivial branch"
    assert (points["point"] == np.arange(len(points))).all() and (np.diff(points["arclength"]) > 0).all()
    labelled = points[points["label"] != b""].reset_index(drop=True)
    assert labelled.equals(events[points.columns])
    assert events["label"].tolist() == [b"BP", b"LP", b"EP"]
    assert np.isfinite(points.select_dtypes("number")).all(axis=None)


def test_every_column_says_what_it_means(results):
    for path in results.glob("*.h5"):
        with h5py.File(path) as file:
            for table in ("points", "events"):
                for column in file[table].dtype.names:
                    assert len(file[table].attrs[column]) > 5


def test_solutions_belong_to_their_points(results):
    """The quaternion is a unit one at mesh points: Gauss collocation keeps its length, up to the error of Newton's method."""
    branch = read_branch(results / "half.h5")
    labelled = np.flatnonzero(branch.points["label"] != b"")
    assert branch.kept().tolist() == sorted({*range(0, len(branch.points), 5), *labelled})
    for point in branch.kept():
        solution = branch.solution(point)
        t, states, degree, parameters = solution.t, solution.states, solution.degree, solution.parameters
        assert (len(t) - 1) // degree == branch.points[point]["intervals"] and t[0] == 0 and t[-1] == 1
        assert states.shape == (len(t), 7)
        assert np.abs(np.linalg.norm(states[::degree, :4], axis=1) - 1).max() < 1e-10
        assert parameters["kappa_n"] == branch.points[point]["kappa_n"]
    with pytest.raises(StoreError, match="point 1 is not kept"):
        branch.solution(1)


def test_a_result_is_printed_on_a_screen(results):
    """The branch with its labelled points, and what is made of it: lines and no numbers of arrays."""
    branch = read_branch(results / "m1_n2.h5")
    lines = repr(branch).splitlines()
    assert lines[0] == f"ClosedBranch({branch.about}: {len(branch.points)} points, complete; {branch.stop})"
    assert [line.split()[:3] for line in lines[1:]] == [
        ["point", str(event["point"]), event["label"].decode()] for event in branch.events
    ]
    many = dataclasses.replace(branch, events=np.tile(branch.events, 30))
    assert len(repr(many).splitlines()) <= 24 and repr(many).endswith("... 70 more in events")
    solution = branch.solution(0)
    equilibrium = solution.equilibrium()
    for found in (solution, solution.shape(), equilibrium, discretized(equilibrium, 24), solution.law):
        assert len(repr(found)) < 400 and "\n" not in repr(found) and " 0x" not in repr(found)


def test_a_kept_solution_is_a_closed_strip(results):
    branch = read_branch(results / "m1_n2.h5")
    for point in (0, 18, len(branch.points) - 1):
        centreline = branch.shape(point).centreline
        assert np.abs(centreline[-1] - centreline[0]).max() < 1e-10


def test_the_user_value_is_met(results):
    events = read_branch(results / "half.h5").events
    (met,) = events[events["label"] == b"UZ"]
    assert abs(met["kappa_n"] - 2.51) < 1e-12 and met["name"] == b"kappa_n = 2.51"


# --- the page that describes it -------------------------------------------------------------------------------------


def test_the_snippets_of_the_page_run(results, root, monkeypatch, capsys):
    page = (root / "docs" / "file-format.md").read_text(encoding="utf-8")
    monkeypatch.chdir(results)
    names = {}
    for snippet in re.findall(r"```python\n(.*?)```", page, re.DOTALL):
        exec(snippet, names)
    # the fold from the exact quadrature; see test_run.py
    assert "fold at kappa_n = 4.0756675353" in capsys.readouterr().out
    assert np.abs(np.linalg.norm(names["d3"], axis=0)[:: names["row"].degree] - 1).max() < 1e-10
    assert abs(names["S"][-1] - np.pi / 4) < 1e-15  # the cell is L/4n long, with L = 2 pi and n = 2


def test_the_page_names_everything_in_the_file(results, root):
    page = (root / "docs" / "file-format.md").read_text(encoding="utf-8")
    named = set(re.findall(r"`([^`\n]+)`", page))
    for path in results.glob("*.h5"):
        with h5py.File(path) as file:
            columns = set(file["points"].dtype.names) | set(file["solutions"]) | set(file["solutions/index"].dtype.names)
            columns |= {name for name in file["events"].dtype.names if not name.startswith("error_")} | set(file.attrs)
        assert columns <= named, columns - named


def test_the_examples_for_matlab_and_julia_name_what_is_in_the_file(results, root):
    page = (root / "docs" / "file-format.md").read_text(encoding="utf-8")
    matlab, julia = (re.search(rf"```{language}\n(.*?)```", page, re.DOTALL)[1] for language in ("matlab", "julia"))
    with h5py.File(results / "m1_n2.h5") as file:
        paths = {*re.findall(r"h5read\('m1_n2.h5', '([^']+)'", matlab), *re.findall(r'file\["([^"]+)"\]', julia)}
        assert {path.strip("/") for path in paths} == {"points", "events", "solutions/index", "solutions/states", "solutions/t"}
        assert all(path in file for path in paths)
        for table, columns in (("events", "events|fold"), ("points", "points"), ("solutions/index", "index|row")):
            used = set(re.findall(rf"\b(?:{columns})\.(\w+)", matlab + julia))
            assert used and used <= set(file[table].dtype.names), (table, used)
        assert {*re.findall(r"'/', '(\w+)'", matlab), *re.findall(r'attributes\(file\)\["(\w+)"', julia)} == {"stop"}
        states, row = file["solutions/states"], file["solutions/index"][0]
        assert states.shape[1] == 4 and row["start"] == 0  # rows are nodes, which others read as columns


# --- written whole, or not at all -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "trouble", [OSError(errno.ENOSPC, "No space left on device"), KeyboardInterrupt()], ids=["full", "Ctrl-C"]
)
@pytest.mark.parametrize("where", ["fsync", "replace"])
def test_a_failed_write_leaves_the_file_as_it_was(tmp_path, monkeypatch, trouble, where):
    path = tmp_path / "x.h5"
    path.write_bytes(b"before")

    def fail(*arguments):
        raise trouble

    monkeypatch.setattr(files.os, where, fail)
    with pytest.raises((StoreError, KeyboardInterrupt)) as caught:
        write_bytes(path, b"after")
    if isinstance(trouble, OSError):
        assert str(caught.value) == f"cannot write {str(path)!r}: No space left on device"
    assert path.read_bytes() == b"before" and os.listdir(tmp_path) == ["x.h5"]


@pytest.mark.posix("modes of files")
@pytest.mark.parametrize("mask, mode", [(0o022, 0o644), (0o077, 0o600)])
def test_a_new_file_has_the_mode_that_the_umask_says(tmp_path, mask, mode):
    before = os.umask(mask)
    try:
        write_bytes(tmp_path / "x", b"1")
    finally:
        os.umask(before)
    assert stat.S_IMODE((tmp_path / "x").stat().st_mode) == mode


@pytest.mark.posix("modes of files, links")
def test_a_replaced_file_keeps_its_mode_and_a_link_stays_one(tmp_path):
    path, link = tmp_path / "x", tmp_path / "link"
    write_bytes(path, b"1")
    path.chmod(0o640)
    link.symlink_to("x")
    write_bytes(link, b"2")
    assert link.is_symlink() and path.read_bytes() == b"2" and stat.S_IMODE(path.stat().st_mode) == 0o640


@pytest.mark.parametrize("name", ["with space.h5", "\u00fc\u4f60\U0001f300.h5", "é" * 126 + ".h5", "[a]*?.h5"])
def test_any_name_that_the_file_system_takes(tmp_path, name):
    prepare(tmp_path / name)
    write_bytes(tmp_path / name, b"1")
    assert os.listdir(tmp_path) == [name]


def test_what_killed_runs_left_is_removed(tmp_path):
    old, young, other = (tmp_path / f".{name}.part" for name in ("x.h5.01234567", "x.h5.89abcdef", "y.h5.01234567"))
    for path in (old, young, other):
        path.write_bytes(b"1")
    for path in (old, other):
        os.utime(path, (time.time() - 3600,) * 2)
    prepare(tmp_path / "x.h5")
    assert not old.exists() and young.exists() and other.exists()


@pytest.mark.posix("a folder that nobody can make")
def test_where_nothing_can_be_written(tmp_path, monkeypatch):
    (tmp_path / "file").write_bytes(b"1")
    with pytest.raises(StoreError, match="file' is not a folder"):
        prepare(tmp_path / "file" / "x.h5")
    with pytest.raises(StoreError, match="cannot write '/proc/none/x.h5'"):
        prepare(Path("/proc/none/x.h5"))
    monkeypatch.setattr(files.os, "access", lambda path, mode: False)  # root may write everything
    with pytest.raises(StoreError, match="read-only"):
        prepare(tmp_path / "file")


# --- files that are none --------------------------------------------------------------------------------------------


def test_files_that_cannot_be_read_get_one_sentence(tmp_path, results):
    good = (results / "m1_n2.h5").read_bytes()
    contents = {"empty": b"", "text": b"hello\n", "cut": good[: len(good) // 2]}
    for name, data in contents.items():
        (tmp_path / name).write_bytes(data)
        with pytest.raises(StoreError, match=f"{name}': it is not a readable HDF5 file"):
            read_branch(tmp_path / name)
    with pytest.raises(StoreError, match="there is no such file"):
        read_branch(tmp_path / "none")
    with h5py.File(tmp_path / "foreign", "w") as file:
        file["a"] = 1
    with pytest.raises(StoreError, match="not a branch written by this program"):
        read_branch(tmp_path / "foreign")


@pytest.mark.parametrize("change, said", [
    (lambda file: file.attrs.__setitem__("format_version", 99), "format version is 99, not 1"),
    (lambda file: file.attrs.__delitem__("format_version"), "damaged"),
    (lambda file: file.__delitem__("solutions/t"), "damaged"),
    (lambda file: file.attrs.__delitem__("config"), "damaged"),
    (lambda file: file.attrs.__setitem__("config", "m: 1\nn: 2\nfuture: 3\n"), "unknown field 'future'"),
])  # fmt: skip
def test_files_of_another_version_or_with_parts_missing(tmp_path, results, change, said):
    path = tmp_path / "x.h5"
    path.write_bytes((results / "m1_n2.h5").read_bytes())
    with h5py.File(path, "r+") as file:
        change(file)
    with pytest.raises(StoreError, match=said):
        read_branch(path)


def test_an_error_of_the_reader_is_not_called_damage(results):
    with pytest.raises(ZeroDivisionError), open_branch(results / "m1_n2.h5"):
        1 / 0  # noqa: B018


# --- two runs on one file -------------------------------------------------------------------------------------------

HOLD = """
import sys, time
from pathlib import Path
from branches.store.files import only_run
with only_run(Path(sys.argv[1])):
    print("held", flush=True)
    time.sleep(60)
"""


def test_a_file_has_one_run_at_a_time_and_a_killed_one_blocks_nobody(command, tmp_path):
    path = tmp_path / "x.h5"
    for _ in range(3):
        process = command.start(path, program=("-c", HOLD))
        assert process.stdout.readline() == "held\n"
        with pytest.raises(StoreError) as caught, files.only_run(path):
            pass
        assert str(caught.value).startswith(f"another run (process {process.pid} on ") and "wait for its end" in str(
            caught.value
        )
        process.kill()
        process.communicate()
        assert os.listdir(tmp_path) == [".x.h5.lock"]
        with files.only_run(path):
            pass
        assert os.listdir(tmp_path) == []


def test_one_run_at_a_time_within_a_process_too(tmp_path):
    with files.only_run(tmp_path / "x.h5"):
        for _ in range(2):  # to look is not to take the lock away
            with pytest.raises(StoreError, match="of this process"), files.only_run(tmp_path / "x.h5"):
                pass
        with files.only_run(tmp_path / "y.h5"):
            pass
        assert os.listdir(tmp_path) == [".x.h5.lock"]


@pytest.mark.posix("forks")
def test_processes_that_a_run_starts_do_not_keep_its_lock(command, tmp_path):
    """Workers may live a moment longer than the run that was killed."""
    code = "import multiprocessing\n" + HOLD.replace(
        "    print",
        "    multiprocessing.get_context('fork').Process(target=time.sleep, args=[20], daemon=True).start()\n    print",
    )
    process = command.start(tmp_path / "x.h5", program=("-c", code), start_new_session=True)
    assert process.stdout.readline() == "held\n"
    process.kill()
    process.wait()
    with files.only_run(tmp_path / "x.h5"):
        pass
    os.killpg(process.pid, signal.SIGKILL)
    process.communicate()


@pytest.mark.posix("its locks are those of fcntl")
@pytest.mark.parametrize("number", [errno.ENOLCK, errno.ENOSYS, errno.EIO])
def test_where_there_are_no_locks_there_is_no_lock(tmp_path, monkeypatch, number):
    def unsupported(descriptor, operation):
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr("fcntl.flock", unsupported)
    for path in (tmp_path / "x.h5", tmp_path / "none" / "x.h5"):
        for _ in range(2):
            with files.only_run(path):
                assert files._held == {}
    assert not (tmp_path / "none").exists()


@pytest.mark.full
def test_two_processes_never_hold_it_both(command, tmp_path):
    """Four processes take it and give it up all the time; each writes a file of its own name while it has it."""
    code = """
import os, sys, time
from pathlib import Path
from branches.store.files import StoreError, only_run
folder, ends, times = Path(sys.argv[1]), time.monotonic() + 1, 0
while time.monotonic() < ends:
    try:
        with only_run(folder / "x.h5"):
            mark = folder / f"{os.getpid()}.mark"
            mark.touch()
            assert len(list(folder.glob("*.mark"))) == 1
            mark.unlink()
            times += 1
    except StoreError:
        pass
print(times)
"""
    processes = [command.start(tmp_path, program=("-c", code)) for _ in range(4)]
    ended = [process.communicate(timeout=60) for process in processes]
    assert all(err == "" for _, err in ended) and sum(int(out) for out, _ in ended) > 100
    assert os.listdir(tmp_path) == []
