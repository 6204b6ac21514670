"""The command: its numbers against the exact solution, its answers to mistakes, and that an interrupted run loses nothing."""

import os
import random
import shutil
import signal
import subprocess
import time

import h5py
import numpy as np
import pandas as pd
import pytest

from branches.read import read_branch
from branches.run.__main__ import main
from branches.run.display import Display
from branches.run.runner import Interruption, run_scene
from branches.scene.closed import ClosedScene
from branches.scene.fields import ConfigError
from branches.scene.parse import load
from branches.store.files import StoreError
from ribbon_model import exact

#: A run of a second or two, so that there is time to interrupt it.
LONG = {"steps": {"largest": 0.008, "max_points": 100_000}, "stability": True}  # as of a command
LONG_SETTINGS = ("--set", "steps.largest=0.008", "--set", "steps.max_points=100000")


def scene_of(**fields):
    return ClosedScene(**{"m": 1, "n": 2, "zeros": {"kappa_n": [3.0, 1.0]}, "stride": 3, **fields})


@pytest.fixture
def scene(tmp_path):
    path = tmp_path / "scene.yaml"
    path.write_text("m: 1\nn: 2\n")
    return path


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory, silent, tables):
    """The columns of runs that nothing interrupts, by scene."""
    folder, known = tmp_path_factory.mktemp("undisturbed"), {}

    def columns(config):
        key = repr(config)
        if key not in known:
            path = folder / f"{len(known)}.h5"
            run_scene(config, path, silent())
            known[key] = tables(path)
        return known[key]

    return columns


def rows(path):
    with h5py.File(path) as file:
        return file["points"][:]


def test_zeros_that_agree_in_six_digits_have_names_of_their_own(tmp_path, capsys):
    path, values = tmp_path / "x.h5", [3.0, 3.0000001, 3.00000014]
    run_scene(scene_of(zeros={"kappa_n": values}, limits={"kappa_n": (-100.0, 3.2000001)}), path, Display())
    with h5py.File(path) as file:
        events = file["events"][:]
    zeros = events[events["label"] == b"UZ"]
    assert zeros["name"].tolist() == [b"kappa_n = 3", b"kappa_n = 3.0000001", b"kappa_n = 3.00000014"]
    assert zeros["kappa_n"] == pytest.approx(values, abs=1e-11)
    assert events["name"][-1] == b"kappa_n = 3.2000001"
    said = capsys.readouterr().out
    assert "user value (kappa_n = 3.0000001) at" in said
    assert "stopped: reached kappa_n = 3.2000001, the scene's own limit" in said


# --- the main job ---------------------------------------------------------------------------------------------------


@pytest.mark.full
def test_main_job(command, root):
    """From an unrelated folder, with a result whose name has a space and letters beyond ASCII."""
    done = command(root / "configs" / "m1_n2.yaml", "--out", "a folder/résultat 1.h5")
    assert (done.returncode, done.err) == (0, "")
    with h5py.File(command.folder / "a folder" / "résultat 1.h5") as file:
        events = pd.DataFrame(file["events"][:])
    assert events["label"].tolist() == [b"BP", b"LP", b"EP"]
    start, fold, end = events["kappa_n"]
    assert abs(start - 2.5) < 1e-10  # equation (27) with (m, n) = (1, 2) at nu = 0.3
    # the exact quadrature of the same equilibrium, ribbon_model.exact.folds(1, 2, 0.3); 4.08 in Audoly & Seffen, section 6.3
    assert abs(fold - 4.07566753526546525) < 1e-10
    assert round(fold, 2) == 4.08
    assert abs(end + 0.5) < 1e-8  # equation (27) with (m, n) = (3, 2): the triple loop
    assert abs(events["kappa_star"].iloc[-1] - 3) < 1e-8
    assert (events["error_kappa_n"] < 1e-10).all()
    for line in (
        "leaves the 1-covered circle at kappa_n L/2pi = 2.5000000000",
        "fold at kappa_n L/2pi = 4.0756675353",
        "ends on the 3-covered circle at kappa_n L/2pi = -0.5000000000",
        "written to a folder/résultat 1.h5",
    ):
        assert line in done.out


@pytest.mark.sample(2)
@pytest.mark.parametrize(("m", "n"), [(1, 2), (1, 3), (3, 1), (3, 4), (3, 5), (5, 6)])
def test_a_branch_of_the_diagram_against_the_exact_solution(m, n, tmp_path, root, silent):
    """Labelled points of a branch of Fig. 12a, in order, against the quadrature of ribbon_model.exact."""
    config = load(root / "configs" / "fig12.yaml", [f"m={m}", f"n={n}", "stability=false"])
    path, mode = tmp_path / "branch.h5", (config.m, config.n, config.nu)
    assert run_scene(config, path, silent()) == "complete"
    with h5py.File(path) as file:
        events = file["events"][:]
    limits = config.limits["kappa_n"]
    known = [point for point in exact.curve(*mode, limits) if point.label]
    assert events["label"].tolist() == [b"BP", *(b"LP" for _ in known[1:-1]), b"EP"], mode
    assert np.abs(events["kappa_n"] - [point.kappa_n for point in known]).max() < 1e-9
    assert np.abs(events["kappa_star"] - [point.kappa_star for point in known]).max() < 1e-9
    folds, end = exact.folds(*mode, limits), exact.end(*mode)
    assert np.abs(events["kappa_n"][1:-1] - [fold.kappa_n for fold in folds]).max(initial=0) < 1e-9
    assert (events["name"][-1] == b"trivial branch") == (end is not None)
    if end is not None:  # (covering index, kappa_n) of the circle, equation (27)
        assert abs(events["kappa_star"][-1] - end[0]) < 1e-9 and abs(events["kappa_n"][-1] - end[1]) < 1e-9


def test_help_imports_nothing_heavy(command):
    code = (
        "import sys; from branches.run import main\n"
        "try: main(['--help'])\nexcept SystemExit as stop: print('code', stop.code)\n"
        "print(sorted({'numpy', 'numba', 'h5py', 'pydantic', 'yaml', 'contin', 'ribbon_model'} & set(sys.modules)))"
    )
    done = command(program=("-c", code))
    assert "--resume" in done.out and done.out.endswith("code 0\n[]\n") and done.err == ""


# --- mistakes: one sentence, exit code 2, nothing written -------------------------------------------------------------

HALF_LOOP = ["scene.yaml", "--set", "domain=half loop", "--set", "mesh.intervals=8"]
MISTAKES = {
    "no such config": (["none.yaml"], "cannot read the config 'none.yaml': No such file"),
    "a folder as config": (["."], "cannot read the config '.': it is a folder; a scene is a YAML file"),
    "a device as config": (["/dev/zero"], "megabyte"),
    "unknown field": (["scene.yaml", "--set", "foo=1"], "unknown field 'foo'"),
    "impossible value": (["scene.yaml", "--set", "nu=0.7"], "--set nu=0.7: nu: must be at most 0.5, not 0.7"),
    "n = m": (["scene.yaml", "--set", "n=1"], "n = m = 1 is a rigid rotation"),
    "m / n even": (["scene.yaml", "--set", "m=4"], "m = 4, n = 2: m / n must not be even"),
    "no threshold": (["scene.yaml", "--set", "nu=-0.5"], "nu = -0.5: no threshold"),
    # a few intervals for tens of half waves: the discrete equations have no bifurcation there, or another one
    "mesh too coarse": ([*HALF_LOOP, "--set", "n=51"], "do not resolve the mode (m, n) = (1, 51) on the half loop; take more"),
    "mesh that shows another mode": (
        [*HALF_LOOP, "--set", "m=3", "--set", "n=41", "--set", "nu=0.1"],
        "do not resolve the mode",
    ),
    "result is a folder": (["scene.yaml", "--out", "results"], "--out 'results/scene.h5': is a folder"),
    "result is a device": (["scene.yaml", "--out", "/dev/null", "--overwrite"], "is neither a file nor a folder"),
    "result is the config": (["scene.yaml", "--out", "scene.yaml", "--overwrite"], "is the config itself"),
    "result without a name": (["scene.yaml", "--out", ""], "--out '': must name"),
    "name too long": (["scene.yaml", "--out", "x" * 300 + ".h5"], "too long"),
    "result with the name of a table": (
        ["scene.yaml", "--out", "x.csv"],
        "--out 'x.csv': must end in .h5 or .hdf5, or be a folder",
    ),
    "result without an ending": (["scene.yaml", "--out", "new"], "or be a folder, as in 'new/'"),
    "a folder with the name of a file": (
        ["scene.yaml", "--set", "n=[2]", "--out", "y.h5"],
        "--out 'y.h5': must be a folder, as in 'y'",
    ),
    "a file for a folder": (["scene.yaml", "--set", "n=[2]", "--out", "foreign.h5"], "must be a folder, and is a file"),
    "folder is a file": (["scene.yaml", "--out", "scene.yaml/x.h5"], "scene.yaml' is not a folder"),
    "folder cannot be made": (["scene.yaml", "--out", "/proc/none/x.h5"], "cannot write '/proc/none/x.h5'"),
    "foreign file": (["scene.yaml", "--out", "foreign.h5"], "exists and is not a readable result of this program"),
    "foreign file to resume": (["scene.yaml", "--out", "foreign.h5", "--resume"], "not a readable HDF5 file"),
    "another scene": (["scene.yaml", "--out", "other.h5"], "another scene (n = 3 there, 2 here); --overwrite"),
    "another scene to resume": (["scene.yaml", "--out", "other.h5", "--resume"], "another scene (n = 3 there, 2 here); resume"),
}


#: Windows has no devices among its files, makes the folder, and has another word for one.
OF_POSIX = {"a device as config", "result is a device", "folder cannot be made"}


@pytest.mark.parametrize(
    "arguments, said",
    [pytest.param(*case, id=name, marks=[pytest.mark.posix("files")] * (name in OF_POSIX)) for name, case in MISTAKES.items()],
)
def test_a_mistake_gets_one_sentence_and_changes_nothing(scene, arguments, said, monkeypatch, capsys, silent):
    folder = scene.parent
    monkeypatch.chdir(folder)
    (folder / "results" / "scene.h5").mkdir(parents=True)
    (folder / "foreign.h5").write_bytes(b"precious\n")
    run_scene(ClosedScene(m=1, n=3, steps={"max_points": 2}), folder / "other.h5", silent())
    before = {path: path.is_file() and path.read_bytes() for path in folder.rglob("*")}
    assert main([*arguments, "--quiet"]) == 2
    printed = capsys.readouterr()
    assert printed.out == "" and printed.err.startswith("error: ") and printed.err.count("\n") == 1
    assert said in printed.err and "Traceback" not in printed.err
    assert before == {path: path.is_file() and path.read_bytes() for path in folder.rglob("*")}


@pytest.mark.parametrize("arguments", [[], ["a", "b"], ["a", "--resume", "--overwrite"], ["a", "--res"], ["a", "--out"]])
def test_a_mistake_in_the_command_line_itself(arguments, capsys):
    with pytest.raises(SystemExit) as stop:
        main(arguments)
    assert stop.value.code == 2 and "error: " in capsys.readouterr().err


def test_an_unfinished_result_is_not_replaced_unasked(tmp_path, silent, undisturbed, tables):
    path, config = tmp_path / "x.h5", scene_of()
    stop = silent({9: lambda: signal.raise_signal(signal.SIGINT)})
    assert run_scene(config, path, stop) == "interrupted"
    with pytest.raises(StoreError, match="unfinished run of this scene; --resume continues it"):
        run_scene(config, path, silent())
    assert run_scene(config, path, silent(), overwrite=True) == "complete"
    assert tables(path) == undisturbed(config)
    assert run_scene(config, path, silent()) == "complete"  # a finished one of the same scene may be computed again


@pytest.fixture
def disk(tmp_path):
    """A function that mounts a small disk; it is skipped where that is not permitted."""
    if shutil.which("mount") is None:
        pytest.skip("no small disk can be mounted: there is no mount")
    folder = tmp_path / "disk"
    folder.mkdir()

    def mount(options):
        done = subprocess.run(["mount", "-t", "tmpfs", "-o", options, "tmpfs", folder], capture_output=True, text=True)
        if done.returncode:
            pytest.skip(f"no small disk can be mounted: {done.stderr.strip()}")
        return folder

    yield mount
    subprocess.run(["umount", folder], capture_output=True)


def test_a_disk_full_from_the_start(call, scene, disk):
    folder = disk("size=64k")
    done = call(main, scene, "--out", folder / "x.h5", "--quiet")
    assert (done.returncode, done.out) == (2, "") and list(folder.iterdir()) == []
    assert done.err == f"error: cannot write '{folder}/x.h5': No space left on device\n"


def test_a_disk_that_fills_up(call, scene, disk, tables):
    """Room for a first result, not for the second one that is to take its place, until there is."""
    folder = disk("size=1m")
    path = folder / "x.h5"
    assert call(main, scene, "--out", path, "--quiet").returncode == 0
    before = path.read_bytes()
    (folder / "ballast").write_bytes(bytes(2**20 - len(before) - 100_000))
    done = call(main, scene, "--out", path, "--overwrite", "--quiet", *LONG_SETTINGS)
    assert (done.returncode, done.err) == (2, f"error: cannot write '{path}': No space left on device\n")
    assert path.read_bytes() == before and sorted(os.listdir(folder)) == ["ballast", "x.h5"]


def test_a_disk_that_is_read_only(call, scene, disk):
    folder = disk("size=64k,ro")
    done = call(main, scene, "--out", folder / "new" / "x.h5", "--quiet")
    assert (done.returncode, done.err) == (2, f"error: cannot write '{folder}/new/x.h5': Read-only file system\n")


# --- interrupted, and gone on with ------------------------------------------------------------------------------------


def test_a_run_stopped_at_a_labelled_point_keeps_it(tmp_path, silent, undisturbed, tables):
    """It lies inside a step, from whose beginning the run goes on."""
    path, config = tmp_path / "x.h5", scene_of()
    run_scene(config, path, silent())
    number = int(np.flatnonzero(rows(path)["label"])[1])
    stopped = silent({number: lambda: signal.raise_signal(signal.SIGINT)})
    assert run_scene(config, path, stopped, overwrite=True) == "interrupted"
    assert len(rows(path)) == number + 1 and rows(path)["label"][number]
    assert run_scene(config, path, silent(), resume=True) == "complete" and tables(path) == undisturbed(config)


@pytest.mark.full
def test_a_run_stopped_at_every_single_point(tmp_path, silent, undisturbed, tables):
    """Ctrl-C after each point in turn, labelled ones too; the columns are in the end bit by bit those of one run."""
    path, config, outcome, stops = tmp_path / "x.h5", scene_of(), "", 0
    while outcome != "complete":
        number = len(rows(path)) if path.exists() else 0
        display = silent({number: lambda: signal.raise_signal(signal.SIGINT)})
        outcome = run_scene(config, path, display, resume=path.exists())
        stops += outcome == "interrupted"
        assert os.listdir(tmp_path) == ["x.h5"]
    assert tables(path) == undisturbed(config)
    assert stops > 25


@pytest.mark.sample(1)
@pytest.mark.parametrize("number", [0, 7, 18])
def test_sigterm_does_the_same(tmp_path, silent, undisturbed, tables, number):
    path, config = tmp_path / "x.h5", scene_of()
    assert run_scene(config, path, silent({number: lambda: signal.raise_signal(signal.SIGTERM)})) == "interrupted"
    assert len(rows(path)) > number
    assert run_scene(config, path, silent(), resume=True) == "complete"
    assert tables(path) == undisturbed(config)


@pytest.mark.full
def test_the_number_of_threads_makes_no_difference(command, scene, tables):
    """With the index, whose eigenvalues come from LAPACK; and whatever the scheduler of a cluster sets."""
    found = []
    for count in ("1", "4"):
        names = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS", "SLURM_CPUS_PER_TASK")
        path = command.folder / f"{count}.h5"
        done = command(scene, "--out", path, "--quiet", "--set", "stability=true", env=dict.fromkeys(names, count))
        assert (done.returncode, done.err) == (0, "")
        found.append(tables(path))
    assert found[0] == found[1]


def test_a_second_ctrl_c_stops_at_once(tmp_path, silent):
    path = tmp_path / "x.h5"
    run_scene(scene_of(), path, silent())
    before = path.read_bytes()

    def twice():
        signal.raise_signal(signal.SIGINT)
        time.sleep(0.01)
        signal.raise_signal(signal.SIGINT)
        time.sleep(0.01)

    with pytest.raises(KeyboardInterrupt):
        run_scene(scene_of(), path, silent({5: twice}))
    assert path.read_bytes() == before and os.listdir(tmp_path) == ["x.h5"]


@pytest.mark.posix("signals")
def test_sigterm_ends_a_point_that_takes_long(monkeypatch):
    monkeypatch.setattr(Interruption, "GRACE", 0.05)
    with pytest.raises(KeyboardInterrupt), Interruption() as interruption:
        signal.raise_signal(signal.SIGTERM)
        assert interruption.asked
        until = time.monotonic() + 5
        while time.monotonic() < until:
            pass
    with Interruption():
        signal.raise_signal(signal.SIGTERM)
    time.sleep(0.1)  # it ended in time: nothing comes afterwards


@pytest.mark.posix("signals")
@pytest.mark.full
def test_killed_again_and_again(command, scene, undisturbed, tables):
    """SIGKILL, SIGINT and SIGTERM at random moments; after each the file opens with plain h5py and holds a piece of the run.

    The slowest test of the folder: six processes, each of which loads the compiled kernels and computes for a while.
    tests/test_torture.py has each fault once.
    """
    config = ClosedScene(m=1, n=2, **LONG)
    whole = undisturbed(config)["points"]
    path, chance = command.folder / "x.h5", random.Random(4)
    arguments = (scene, "--out", path, "--quiet", *LONG_SETTINGS)
    process = command.start(*arguments)
    while not path.exists() and process.poll() is None:  # the first one as soon as there is anything to lose
        time.sleep(0.01)
    for number in (signal.SIGKILL, signal.SIGINT, signal.SIGKILL, signal.SIGTERM, signal.SIGKILL):
        process.send_signal(number)
        out, err = process.communicate()
        early = ("interrupted\n", f"interrupted; nothing new is in {path}; the same command starts again\n")
        assert err in ("", *early) and process.returncode in (0, 130, -number)
        if process.returncode == 130 and not err:
            assert f"interrupted; go on with --resume --out {path}" in out
        assert whole.startswith(rows(path).tobytes())
        process = command.start(*arguments, "--resume")
        time.sleep(chance.uniform(0.9, 1.6))
    out, err = process.communicate()
    assert (process.returncode, err) == (0, "")
    assert tables(path) == undisturbed(config)


@pytest.mark.full
@pytest.mark.posix("a process is stopped by a signal")
@pytest.mark.parametrize(
    "option", ["--resume", *(pytest.param(other, marks=pytest.mark.full) for other in ("--overwrite", "--quiet"))]
)
def test_a_second_run_on_the_same_file_is_refused(command, call, scene, undisturbed, tables, option):
    """With every option; the first run loses nothing."""
    path = command.folder / "x.h5"
    assert call(main, scene, "--out", path, "--quiet").returncode == 0
    first = command.start(scene, "--out", path, "--quiet", "--overwrite", *LONG_SETTINGS)
    lock = path.with_name(".x.h5.lock")
    while not (lock.exists() and lock.stat().st_size > 1) and first.poll() is None:  # that is right at the beginning
        time.sleep(0.002)
    first.send_signal(signal.SIGSTOP)  # it must not end while the second one starts
    second = call(main, scene, "--out", path, *LONG_SETTINGS, option)
    first.send_signal(signal.SIGCONT)
    assert (second.returncode, second.out) == (2, "")
    assert second.err.startswith(f"error: another run (process {first.pid} on ") and second.err.count("\n") == 1
    assert first.communicate()[1] == "" and first.returncode == 0
    assert tables(path) == undisturbed(ClosedScene(m=1, n=2, **LONG))
    assert sorted(os.listdir(command.folder)) == ["scene.yaml", "x.h5"]


@pytest.mark.full
@pytest.mark.posix("Windows sends Ctrl-C in another way")
def test_ctrl_c_before_the_first_point(command, scene, tmp_path_factory):
    """While the kernels are being compiled: no traceback, no file."""
    cache = tmp_path_factory.mktemp("cache")
    process = command.start(scene, "--out", "x.h5", env={"CONTIN_CACHE_DIR": cache})
    while not (command.folder / ".x.h5.lock").exists() and process.poll() is None:
        time.sleep(0.01)
    time.sleep(0.2)
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=60)
    kept = "nothing new is in x.h5; the same command starts again"
    assert (process.returncode, out, err) == (130, "", f"interrupted; {kept}\n")
    assert os.listdir(command.folder) == ["scene.yaml"]


def test_resuming_a_complete_run_does_nothing(tmp_path, silent):
    path, display = tmp_path / "x.h5", silent()
    run_scene(scene_of(), path, silent())
    before = path.read_bytes()
    assert run_scene(scene_of(), path, display, resume=True) == "complete"
    assert display.notes == [f"{path} is complete already (returned to the trivial branch (M2 = 0)); nothing to do"]
    assert path.read_bytes() == before


def test_resuming_without_a_file_starts_and_says_so(tmp_path, silent):
    path, display = tmp_path / "none" / "x.h5", silent()
    assert run_scene(scene_of(), path, display, resume=True) == "complete"
    assert display.notes == [f"--resume: there is no file {str(path)!r}; the run starts from the beginning"]
    assert path.exists()


def test_one_branch_has_its_stability(tmp_path, monkeypatch, capsys):
    """Unless the scene says otherwise, or a file that is there has none; a second run is that of the same scene."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "one.yaml").write_text("{m: 1, n: 2, steps: {max_points: 8}}")
    first, plain = ["one.yaml", "--quiet"], ["one.yaml", "--quiet", "--out", "plain.h5", "--set", "stability=false"]
    assert [main(arguments) for arguments in (first, first, plain, plain[:4])] == [0] * 4
    assert read_branch("one.h5").points["index"].tolist()[1:] == [0] * (len(rows("one.h5")) - 1)
    assert "index" not in read_branch("plain.h5").points.dtype.names


def test_a_run_that_is_lost(scene, capsys, monkeypatch):
    """No step of 0.5 turns by less than 0.01 rad: exit code 1, what there is is kept, with the reason."""
    monkeypatch.chdir(scene.parent)
    arguments = ["scene.yaml", "--quiet", "--set", "steps.smallest=0.5", "--set", "steps.angle=0.01"]
    for _ in range(2):  # there is nothing in the way of trying again
        assert main(arguments) == 1
        out = capsys.readouterr().out
        assert "stopped: no state was found beyond kappa_n = 2.5 with steps down to 0.5; the run goes on with steps." in out
        with h5py.File("scene.h5") as file:
            assert file.attrs["status"] == "lost" and file["events"]["label"].tolist() == [b"BP", b"MX"]
    assert main([*arguments, "--resume"]) == 1
    assert len(rows("scene.h5")) == 2


EXTENSIONS = {
    "more points": ({"steps": {"max_points": 10}}, {}),
    "from the first point": ({"steps": {"max_points": 1}}, {}),
    "limits moved": ({"limits": {"kappa_n": (-100, 3.5)}}, {}),
    "limits moved behind a fold": ({"limits": {"kappa_star": (0, 2.0)}}, {}),
    "limits and points": ({"limits": {"M2": (-1, 1.0)}}, {"steps": {"max_points": 25}}),
}


@pytest.mark.sample(2)
@pytest.mark.parametrize("first, then", EXTENSIONS.values(), ids=EXTENSIONS.keys())
def test_a_run_extended_is_the_run_that_went_on(tmp_path, silent, undisturbed, tables, first, then):
    path = tmp_path / "x.h5"
    assert run_scene(scene_of(**first), path, silent()) == "complete"
    fewer = len(rows(path))
    assert run_scene(scene_of(**then), path, silent(), resume=True) == "complete"
    assert tables(path) == undisturbed(scene_of(**then))
    assert len(rows(path)) > fewer
    with h5py.File(path) as file:  # the scene in the file is that of the last run
        assert "max_points: 10" not in file.attrs["config"] and "3.5" not in file.attrs["config"]


@pytest.mark.parametrize("first, then, said", [
    ({"steps": {"max_points": 10}}, {"nu": 0.2, "steps": {"max_points": 20}}, "nu = 0.3 there, 0.2 here"),
    ({"steps": {"max_points": 10}}, {"steps": {"max_points": 20, "largest": 0.1}}, "steps = "),
    ({"steps": {"max_points": 10}}, {"steps": {"max_points": 5}}, "max_points: 5 must exceed the 9 points taken already"),
    ({"steps": {"max_points": 20}}, {"limits": {"kappa_n": (0, 3)}}, "kappa_n: 0, 3 must contain the last point of the file"),
])  # fmt: skip
def test_a_run_that_cannot_be_extended_so(tmp_path, silent, first, then, said):
    path = tmp_path / "x.h5"
    run_scene(scene_of(**first), path, silent())
    before = path.read_bytes()
    with pytest.raises((StoreError, ConfigError), match=said):
        run_scene(scene_of(**then), path, silent(), resume=True)
    assert path.read_bytes() == before


# --- standard output, terminals ---------------------------------------------------------------------------------------


@pytest.mark.full
def test_nobody_reads_the_output_to_its_end(command, scene):
    """As with ``| head -1``: the run goes on quietly, its product is the file."""
    process = command.start(scene)
    assert process.stdout.readline().startswith("ribbon, (m, n) = (1, 2)")
    process.stdout.close()
    assert process.stderr.read() == "" and process.wait() == 0
    process.stderr.close()
    with h5py.File(command.folder / "scene.h5") as file:
        assert file.attrs["status"] == "complete"


@pytest.mark.full
@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="needs /dev/full, which Linux has")
def test_output_that_cannot_be_written(command, scene):
    with open("/dev/full", "w") as full:
        done = command(scene, stdout=full)
    assert done.returncode == 0 and (command.folder / "scene.h5").exists()
    assert done.err == "error: cannot write to standard output: No space left on device\n"


@pytest.mark.full
def test_an_encoding_without_the_letters(command, scene):
    done = command(scene, "--out", "é.h5", "--quiet", env={"PYTHONIOENCODING": "ascii"})
    assert (done.returncode, done.err) == (0, "") and "written to \\xe9.h5" in done.out


@pytest.mark.parametrize("columns", [1, 12, 80])
def test_the_moving_line_fits_the_terminal(columns, tmp_path, silent, monkeypatch, capsys):
    """Drawn on whatever standard error is, and told that this is a terminal of so many columns."""
    from branches.run.display import Display

    monkeypatch.setenv("COLUMNS", str(columns))
    display = Display()
    display._moving, display._shown = True, -1e9
    run_scene(scene_of(steps={"max_points": 4}), tmp_path / "x.h5", display)
    drawn = capsys.readouterr().err.split("\r")
    assert max(map(len, drawn)) <= max(columns - 1, 0)
    assert columns < 80 or any("step" in line and "error" in line and "points/s" in line for line in drawn)


@pytest.mark.full
def test_on_a_terminal(command, scene):
    shown = command.on_terminal(scene, streams=("stdout", "stderr"), env={"COLUMNS": "20"})
    assert b"fold at kappa_n" in shown and b"Traceback" not in shown
