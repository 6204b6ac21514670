"""Scenes of many branches: the graph, the questions, the executor."""

import contextlib
import gc
import itertools
import json
import multiprocessing.connection
import os
import shutil
import signal
import sys
import time
from concurrent.futures import Future

import h5py
import networkx
import numpy as np
import pytest
from crossings import crossings
from scipy.interpolate import CubicSpline

from branches import plot
from branches.explore.gather import gather
from branches.export.__main__ import main as export_command
from branches.graph import closed as diagram
from branches.graph import picture as draw_diagram
from branches.graph.__main__ import main as graph_command
from branches.graph.closed import preview
from branches.graph.interpolation import places
from branches.graph.parts import Part
from branches.graph.stored import read
from branches.read import read_branch
from branches.run import executor as executors
from branches.run import many as diagrams
from branches.run.__main__ import main as run_command
from branches.run.display import Display
from branches.run.executor import ExecutorError, executor
from branches.run.many import run_many
from branches.scene.fields import ConfigError
from branches.scene.parse import parse
from branches.store.files import StoreError, only_run
from ribbon_model import exact

#: Fig. 12a of Audoly & Seffen (2015), a part of it: all ends of m = 1 and 3 up to n = 4.
SCENE = "{law: ribbon, nu: 0.3, m: [1, 3, 5], n: [1, 2, 3, 4], limits: {kappa_n: [-60, 100]}, stride: 20}"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("diagram")
    assert run_many(parse(SCENE, "scene"), folder, Display(silent=True)) == "complete"
    return folder


def test_every_branch_once(folder):
    """Of 10 pairs (m, n) three are another one from its other end: (3, 2), (5, 3) and (5, 4)."""
    graph = read(folder)
    assert [family[2:] for family in diagram.families(graph)] == [(1, 2), (1, 3), (1, 4), (3, 1), (3, 4), (5, 1), (5, 2)]


def test_folds_and_ends_are_those_of_the_quadrature(folder):
    graph = read(folder)
    for law, nu, m, n in diagram.families(graph):
        (branch,) = diagram.course(graph, m, n, law, nu)
        found = [node["kappa_n"] for node in branch["nodes"] if node["kind"] == "fold"]
        expected = [point.kappa_n for point in exact.folds(m, n, nu, kappa_limits=(-60.0, 100.0))]
        assert found == pytest.approx(expected, abs=1e-9)
        assert branch["nodes"][0]["kappa_n"] == pytest.approx(exact.bifurcation(m, n, nu), abs=1e-9)
        last, end = branch["nodes"][-1], exact.end(m, n, nu)
        if end is None:
            assert last["kind"] == "leaves" and last["kappa_n"] == pytest.approx(-60, abs=1e-9)
        else:
            assert (last["covering"], last["kappa_n"]) == (end[0], pytest.approx(end[1], abs=1e-8))


def test_an_unfinished_branch_of_a_folder_is_computed_again(folder, tmp_path):
    """A single run that was killed leaves such a file; a diagram's own branches are written when they are complete."""
    again = shutil.copytree(folder, tmp_path / "again")
    path = min(again.glob("*.h5"), key=lambda path: path.stat().st_size)
    with h5py.File(path, "r+") as file:
        file.attrs["status"] = "running"
    assert run_many(parse(SCENE, "scene"), again, Display(silent=True)) == "complete"
    assert read_branch(path).status == "complete"


def test_where_does_a_branch_go_from_either_end(folder):
    graph = read(folder)
    (there,), (back,) = diagram.course(graph, 1, 3), diagram.course(graph, 5, 3)
    kinds = [node["kind"] for node in there["nodes"]]
    assert kinds == ["circle", "fold", "fold", "circle"]
    assert [node["kappa_n"] for node in back["nodes"]] == [node["kappa_n"] for node in reversed(there["nodes"])]
    with pytest.raises(KeyError, match=r"\(9, 9\)"):
        diagram.course(graph, 9, 9)


def test_states_at_a_curvature_against_the_quadrature(folder):
    """At kappa_n = 3.2 the branch (1, 2) has two states; kappa* from the exact curve, the circles' energy m^2/2 - m kappa_n."""
    states = diagram.states_at(read(folder), 3.2)
    found = sorted(state["kappa_star"] for state in states if state.get("branch") == (1, 2))
    expected = [exact.solve(1, 2, 0.3, guess, kappa_n=3.2).kappa_star for guess in _guesses(1, 2, 3.2)]
    assert found == pytest.approx(sorted(expected), abs=1e-5)
    circles = {state["circle"]: state["energy"] for state in states if "circle" in state}
    assert circles[1] == pytest.approx(0.5 - 3.2) and set(circles) == {1, 3, 5, 7}
    assert [state["energy"] for state in states] == sorted(state["energy"] for state in states)


def test_values_between_points_are_those_of_single_splines():
    """SciPy's spline of each piece; straight lines through two and three points. One piece has a point twice."""
    random, pieces = np.random.default_rng(5), []
    for count in (2, 3, 4, 5, 30, 4, 2, 12):
        s = np.cumsum(random.uniform(0.5, 1, count))
        columns = {"arclength": s, "kappa_n": np.tanh(s - s.mean()), "energy": np.cos(s)}
        pieces.append({name: values.tolist() for name, values in columns.items()})
    pieces[-1] = {name: [*values[:5], values[4], *values[5:]] for name, values in pieces[-1].items()}
    for value in (-0.3, 0.0, 0.2):
        found = places(pieces, "kappa_n", value, ["energy"])
        assert [number for number, _ in found] == list(range(len(pieces)))
        for number, values in found:
            s, keep = np.unique(pieces[number]["arclength"], return_index=True)
            kappa_n, energy = (np.array(pieces[number][name])[keep] for name in ("kappa_n", "energy"))
            if len(s) < 4:
                expected = np.interp(value, kappa_n, energy)
            else:
                (place,) = CubicSpline(s, kappa_n - value).roots(extrapolate=False)
                expected = CubicSpline(s, energy)(place)
            assert values["energy"] == pytest.approx(expected, abs=1e-12)
    assert places(pieces, "kappa_n", 5.0, ["energy"]) == [] == places([], "kappa_n", 0.0, [])


def _guesses(m, n, kappa_n):
    """Points of the exact curve next to where it passes kappa_n."""
    points = exact.curve(m, n, 0.3)
    values = np.array([point.kappa_n for point in points]) - kappa_n
    return [points[i] for i in np.flatnonzero(values[:-1] * values[1:] < 0)]


@pytest.fixture(scope="module")
def known():
    """The folds of the diagram by the quadrature."""
    return sorted(p.kappa_n for m, n in ((1, 2), (1, 3), (3, 4)) for p in exact.folds(m, n, 0.3))


def test_folds_in_a_window(folder, known):
    found = diagram.folds(read(folder), -8, 14)
    assert [node["kappa_n"] for node in found] == pytest.approx([k for k in known if -8 < k < 14], abs=1e-9)


@pytest.mark.parametrize("outside", [0, 1])
def test_the_ends_of_a_window_of_folds(folder, known, outside):
    """Folds 1e-8 inside or outside both ends; their places are those of the quadrature, known to 1e-9."""
    margin = -1e-8 if outside else 1e-8
    found = diagram.folds(read(folder), known[1] - margin, known[-2] + margin)
    inside = known[1 + outside : len(known) - 1 - outside]
    assert [node["kappa_n"] for node in found] == pytest.approx(inside, abs=1e-9)


def test_folds_are_listed_with_their_branches(folder, call):
    listed = call(graph_command, folder, "--folds", -8, 14).out.splitlines()
    assert len(listed) == len(diagram.folds(read(folder), -8, 14))
    assert [line for line in listed if line.startswith("ribbon, nu = 0.3: fold of branch (1, 2) at kappa_n = 4.075667535")]
    assert call(graph_command, folder, "--folds", 4.1, 4.2).out == "no folds between 4.1 and 4.2\n"
    assert call(graph_command, folder, "--folds", 14, -8).err == "error: --folds 14 -8: the first number must be the smaller\n"


def test_what_is_no_diagram_is_told_with_the_command_for_it(folder, call, tmp_path):
    branch = next(folder.glob("*.h5"))
    said = call(graph_command, branch).err
    assert "it is one branch, not a diagram; " in said and f"plot {branch} draws it" in said
    assert f"name one of its branches, such as {folder}" in call(export_command, folder, "--point", "LP", "--out", "a.stl").err
    (tmp_path / "empty").mkdir()
    assert "the folder holds no diagram.json" in call(graph_command, "empty").err
    assert "there is no such file (did you mean 'empty'?)" in call(graph_command, "emty").err
    (tmp_path / "scene.yaml").write_text("{m: 1, n: 2}")
    assert (
        "it is a scene; compute its result first: " in call(export_command, "scene.yaml", "--point", "LP", "--out", "a.stl").err
    )
    (tmp_path / "b.npz").write_bytes(b"PK")
    assert "explore b.npz shows and contin.load" in call(export_command, "b.npz", "--point", "LP", "--out", "a.stl").err


def test_exports(folder):
    """GraphML holds the same nodes and edges, with the same columns as text."""
    graph = read(folder)
    other = networkx.read_graphml(folder / "diagram.graphml", force_multigraph=True)
    assert set(other) == set(graph) and other.number_of_edges() == graph.number_of_edges()
    ours, theirs = ({data["file"]: data for _, _, data in edges.edges(data=True)} for edges in (graph, other))
    assert ours.keys() == theirs.keys() and len(ours) == 7
    for file, data in theirs.items():
        for column in ("kappa_n", "kappa_star", "energy"):
            assert json.loads(data[column]) == list(ours[file][column])
    assert graph.graph["failed"] == "{}"


def test_a_second_run_computes_what_is_missing_only(folder, capsys):
    scene = parse(SCENE, "scene")
    gone = folder / list(scene.scenes)[1]
    before = {path: path.stat().st_mtime_ns for path in folder.glob("*.h5") if path != gone}
    image = read_branch(gone).points
    gone.unlink()
    run_many(scene, folder, Display())
    assert {path: path.stat().st_mtime_ns for path in before} == before
    assert np.array_equal(read_branch(gone).points, image)
    assert "computed before" in capsys.readouterr().out


@pytest.mark.parametrize("change, said", [
    ("nu=0.25", "ribbon_nu0.3_m1_n2.h5 is not a branch of this one"),
    ("limits={kappa_n: [-50, 100]}", "ribbon_nu0.3_m1_n2.h5: limits = "),
])  # fmt: skip
def test_a_folder_of_another_scene_is_refused(folder, change, said):
    before = {path: path.read_bytes() for path in folder.iterdir()}
    with pytest.raises(StoreError, match="holds another scene") as caught:
        run_many(parse(SCENE, "scene", [change]), folder, Display(silent=True))
    assert said in str(caught.value) and "--overwrite replaces its diagram" in str(caught.value)
    assert {path: path.read_bytes() for path in folder.iterdir()} == before


def test_a_scene_with_more_branches_goes_on_and_overwrite_replaces(tmp_path):
    limits = "limits: {kappa_n: [0, 100]}, stride: 50"
    for nu in ("[0.3]", "[0.3, 0.31]"):
        run_many(parse(f"{{m: 1, n: 2, nu: {nu}, {limits}}}", "scene"), tmp_path, Display(silent=True))
    assert [family[1] for family in diagram.families(read(tmp_path))] == [0.3, 0.31]
    other = parse(f"{{m: 1, n: 2, nu: [0.32], {limits}}}", "scene")
    assert run_many(other, tmp_path, Display(silent=True), overwrite=True) == "complete"
    assert [family[1] for family in diagram.families(read(tmp_path))] == [0.32]
    (tmp_path / "diagram.json").write_text("{}")
    with pytest.raises(StoreError, match="not a result of branches.run"):
        run_many(other, tmp_path, Display(silent=True))


PAIR = "{m: [3], n: [4, 5], stride: 20}"


@pytest.fixture(scope="module")
def computed_here(tmp_path_factory):
    """Two branches, computed by this process: their points."""
    folder, scene = tmp_path_factory.mktemp("one"), parse(PAIR, "scene")
    run_many(scene, folder, Display(silent=True), workers=1)
    return [read_branch(folder / file).points for file in scene.scenes]


def points_of(folder):
    return [read_branch(folder / file).points for file in parse(PAIR, "scene").scenes]


@pytest.mark.full
def test_a_cluster_makes_no_difference(computed_here, tmp_path):
    """One process and a Dask cluster: the same bits."""
    distributed = pytest.importorskip("distributed", reason="Dask is not installed")
    scene = parse(PAIR, "scene")
    with distributed.LocalCluster(n_workers=1, threads_per_worker=1, processes=True, dashboard_address=None) as cluster:
        run_many(scene, tmp_path / "dask", Display(silent=True), scheduler=cluster.scheduler_address)
    assert all(map(np.array_equal, computed_here, points_of(tmp_path / "dask")))


@pytest.mark.full
@pytest.mark.forks("workers inherit what the test has replaced")
def test_a_branch_that_dies_or_hangs_takes_no_other_with_it(tmp_path, monkeypatch, capsys):
    scene, compute = parse("{m: [1, 3], n: [2, 4], stride: 20}", "scene"), diagrams.compute_scene

    def troubled(config, display):
        if (config.m, config.n) == (1, 4):
            os.kill(os.getpid(), signal.SIGKILL)
        if (config.m, config.n) == (3, 4):
            time.sleep(60)
        return compute(config, display)

    monkeypatch.setattr(diagrams, "compute_scene", troubled)
    assert run_many(scene, tmp_path, Display(), workers=2, time_limit=5) == "lost"
    graph = read(tmp_path)
    assert [family[2:] for family in diagram.families(graph)] == [(1, 2)]
    failed = json.loads(graph.graph["failed"])
    reasons = [failed[list(scene.scenes)[i]] for i in (1, 3)]
    assert reasons == ["its process died (exit code -9)", "not finished within the time limit"]
    assert "failed" in capsys.readouterr().out
    monkeypatch.undo()
    assert run_many(scene, tmp_path, Display(), workers=2) == "complete"
    assert "1 of them computed before" in capsys.readouterr().out


def _die_while_sending(size):
    """A job whose process is killed when it has sent a part of its result."""
    if size > 100:

        def half(connection, data):
            os.write(connection.fileno(), data[: len(data) // 2])
            os.kill(os.getpid(), signal.SIGKILL)

        multiprocessing.connection.Connection._send = half
    return bytes(size)


class _Odd(Exception):
    def __init__(self, a, b):
        super().__init__("odd")


def _raise(job):
    raise _Odd(1, 2)


@pytest.mark.posix("a process is killed by a signal")
def test_a_process_killed_while_it_sends_its_result():
    """A part of a result in the pipe must not keep anybody waiting; nor may an error that cannot be sent."""
    with executor(workers=2) as (submit, wait, _):
        jobs = [submit(_die_while_sending, size) for size in (100_000, 10, 100_000, 20)]
        time.sleep(0.5)
        while not all(job.done() for job in jobs):
            wait([job for job in jobs if not job.done()])
        assert [jobs[i].result() for i in (1, 3)] == [bytes(10), bytes(20)]
        for i in (0, 2):
            assert executors.trouble(jobs[i].exception()) == "its process died (exit code -9)"
        odd = submit(_raise, None)
        wait([odd])
        assert "odd" in str(odd.exception())


@pytest.mark.sample(1)
@pytest.mark.parametrize("method", [pytest.param("fork", marks=pytest.mark.forks("they are tested")), "spawn"])
def test_how_processes_start_makes_no_difference(computed_here, tmp_path, monkeypatch, method):
    """Forked, or each from nothing as on Windows and macOS: the same bits as from one process."""
    monkeypatch.setattr(executors, "_START_METHOD", method)
    run_many(parse(PAIR, "scene"), tmp_path, Display(silent=True), workers=2)
    assert all(map(np.array_equal, computed_here, points_of(tmp_path)))


def test_the_order_in_which_processes_are_done_makes_no_difference(tmp_path, monkeypatch):
    """The same files, and the failed branches in the same order."""
    scene, compute, files = parse("{m: [1, 3], n: [4, 5], stride: 20}", "scene"), diagrams.compute, []

    def failing(job):
        config = scene.scenes[job[0]]
        return RuntimeError(f"({config.m}, {config.n})") if config.n == 5 else compute(job)

    for order in (list, reversed):

        def finished(source, function, submit, limit, wait, order=order):
            jobs = []
            while (job := source([])) is not None:
                jobs.append(job)
            yield from [(job, failing(job)) for job in order(jobs)]

        monkeypatch.setattr(diagrams, "run_jobs", finished)
        folder = tmp_path / order.__name__
        assert run_many(scene, folder, Display(silent=True), workers=1) == "lost"
        files.append([(folder / name).read_bytes() for name in ("diagram.json", "diagram.graphml")])
    assert files[0] == files[1]


def test_two_runs_into_one_folder(tmp_path):
    scene = parse(PAIR, "scene")
    with only_run(tmp_path / "diagram.json"), pytest.raises(StoreError, match="another run"):
        run_many(scene, tmp_path, Display(silent=True))
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(("variables", "expected"), [
    ({}, 4), ({"SLURM_CPUS_PER_TASK": "2"}, 2), ({"NSLOTS": "3", "PBS_NUM_PPN": "16"}, 3), ({"SLURM_CPUS_PER_TASK": "all"}, 4),
    ({"SLURM_CPUS_PER_TASK": "0", "LSB_DJOB_NUMPROC": "1"}, 1),
])  # fmt: skip
def test_no_more_processes_than_cores_that_were_granted(monkeypatch, variables, expected):
    for name in executors._GRANTED:
        monkeypatch.delenv(name, raising=False)
    for name, value in variables.items():
        monkeypatch.setenv(name, value)
    monkeypatch.setattr(os, "sched_getaffinity", lambda process: {0, 1, 2, 5}, raising=False)
    assert executors.cores() == expected


@pytest.mark.full
def test_a_scheduler_that_is_not_there():
    pytest.importorskip("distributed", reason="Dask is not installed")
    with pytest.raises(ExecutorError, match="no Dask scheduler answers"), executor("nowhere://x"):
        pass
    gc.collect()  # Dask's client closes itself when it is freed, and waits for ever where that is while another one starts


@pytest.mark.full
def test_a_scheduler_without_workers_is_refused(tmp_path, call, monkeypatch):
    """At the start; and, after all workers have left, while jobs are waited for."""
    distributed = pytest.importorskip("distributed", reason="Dask is not installed")
    monkeypatch.setattr(executors, "_WORKERS_WITHIN", 0.3)
    (tmp_path / "scene.yaml").write_text(PAIR)
    with distributed.LocalCluster(n_workers=0, processes=False, dashboard_address=None) as cluster:
        done = call(run_command, "scene.yaml", "--out", "x", "--scheduler", cluster.scheduler_address)
        assert done.returncode == 2 and done.err.count("\n") == 1
        assert "the scheduler answers, but has no workers" in done.err and "dask worker" in done.err
        with distributed.Client(cluster) as client, pytest.raises(ExecutorError, match="no workers"):
            executors._first_done_by(client, cluster.scheduler_address)([Future()])


def test_a_sweep_over_laws_and_nu_says_what_does_not_exist():
    scene = parse("{law: [ribbon, flat rod], nu: [0.3, -0.9], pairs: [[1, 2], [3, 4]]}", "scene")
    assert len(scene.scenes) == 6
    assert list(scene.absent) == ["ribbon, nu = -0.9, (1, 2)", "ribbon, nu = -0.9, (3, 4)"]
    assert "twisting modulus" in scene.absent["ribbon, nu = -0.9, (1, 2)"]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("{m: [1, 2.5], n: 2}", "m: "),
        ("{m: [1], n: [1]}", "none of its branches"),
        ("{m: [], n: [1]}", "m: .*the list is empty"),
        ("{m: [1, 1], n: [2]}", r"ribbon, nu = 0.3, \(1, 2\) is listed twice"),
        ("{m: 1, n: 2, nu: [0.3, 0.3]}", r"ribbon, nu = 0.3, \(1, 2\) is listed twice"),
        ("{m: 1, n: 2, nu: [0, 0.0]}", "nu = 0, .* is listed twice"),
        ("{m: 1, n: 2, law: finite width, Gamma: [1.0, 1.0000000000001]}", "1 and 1.0000000000001 agree in 12 digits"),
        ("{pairs: [[1, 2]], m: 3}", "pairs"),
        ("{pairs: [[1, 2, 3]]}", "pairs: must be a list of"),
        ("{m: [1], n: [2], colour: red}", "unknown field 'colour'"),
        ("{m: [1]}", "'n' is missing"),
        ("{m: [1], n: [2], nu: [0.7]}", "nu"),
    ],
)
def test_bad_scenes(text, said):
    with pytest.raises(ConfigError, match=said):
        parse(text, "scene")


@pytest.fixture(scope="module")
def close(tmp_path_factory):
    """Two values of nu that agree in six digits."""
    folder = tmp_path_factory.mktemp("close")
    scene = parse("{m: 1, n: 2, nu: [0.3, 0.3000001], limits: {kappa_n: [0, 100]}, stride: 50}", "scene")
    assert run_many(scene, folder, Display(), workers=1) == "complete"
    return folder


def test_values_that_agree_in_six_digits_are_two_branches(close, capsys):
    """In files, in the graph, in its answers, and in the list of a second run."""
    names = ["ribbon_nu0.3000001_m1_n2.h5", "ribbon_nu0.3_m1_n2.h5"]
    assert sorted(path.name for path in close.glob("*.h5")) == names
    assert [read_branch(close / name).config["nu"] for name in names] == [0.3000001, 0.3]
    graph = read(close)
    assert diagram.families(graph) == [("ribbon", 0.3, 1, 2), ("ribbon", 0.3000001, 1, 2)]
    for nu in (0.3, 0.3000001):
        (branch,) = diagram.course(graph, 1, 2, nu=nu)
        assert branch["nodes"][0]["kappa_n"] == pytest.approx(exact.bifurcation(1, 2, nu), abs=1e-9)
    assert graph_command([str(close)]) == 0
    said = capsys.readouterr().out
    assert said.startswith("2 branches, 6 special points\n")
    assert "  ribbon, nu = 0.3, (1, 2): " in said and "  ribbon, nu = 0.3000001, (1, 2): " in said
    scene = parse("{m: 1, n: 2, nu: [0.3, 0.3000001], limits: {kappa_n: [0, 100]}, stride: 50}", "scene")
    assert diagram.families(preview(scene)) == diagram.families(graph)
    assert run_many(scene, close, Display()) == "complete"
    assert "2 of them computed before" in capsys.readouterr().out


@pytest.mark.full
def test_pictures_and_pages_of_close_values_have_titles_of_their_own(close):
    graph = read(close)
    titles = {draw_diagram.figure(graph, "ribbon", nu, disentangle=False).get_suptitle() for nu in (0.3, 0.3000001)}
    tables = {read_branch(path)._repr_html_().partition("nu = ")[2].partition("<")[0] for path in close.glob("*.h5")}
    assert len(titles) == len(tables) == 2
    assert [family["nu"] for family in gather([str(close)])["families"]] == [0.3, 0.3000001]


def test_what_is_absent_is_named_exactly():
    scene = parse("{nu: [-0.9, -0.9000001], law: [ribbon, flat rod], m: 1, n: 2}", "scene")
    assert list(scene.absent) == ["ribbon, nu = -0.9, (1, 2)", "ribbon, nu = -0.9000001, (1, 2)"]


@pytest.mark.full
@pytest.mark.posix("Windows sends Ctrl-C in another way")
def test_an_interrupted_diagram_leaves_no_process_and_goes_on(command, tmp_path):
    """Ctrl-C: workers hold the other end of standard output, so it ends only when they are gone; the rest is computed later."""
    (tmp_path / "scene.yaml").write_text(SCENE)
    process = command.start("scene.yaml", "--out", "here", "--workers", "2", start_new_session=True)
    until = time.monotonic() + 120
    while not list(tmp_path.glob("here/*.h5")) and time.monotonic() < until:
        time.sleep(0.01)
    os.killpg(process.pid, signal.SIGINT)
    out, err = process.communicate(timeout=30)
    assert process.returncode == 130 and "finished branches are kept" in err
    kept = {path: path.read_bytes() for path in tmp_path.glob("here/*.h5")}
    again = command("scene.yaml", "--out", "here")
    assert again.returncode == 0 and f"{len(kept)} of them computed before" in again.out
    assert all(path.read_bytes() == image for path, image in kept.items())
    assert len(list(tmp_path.glob("here/*.h5"))) == 7


def test_the_preview_is_the_diagram(folder):
    """From the quadrature alone: the same nodes (folds and ends to 1e-8) and the same answers, and it says what it is."""
    computed, ahead = read(folder), preview(parse(SCENE, "scene"))
    assert "exact quadrature" in ahead.graph["source"] and "source" not in computed.graph
    assert diagram.families(ahead) == diagram.families(computed)
    for _, _, m, n in diagram.families(computed):
        (ours,), (theirs,) = (diagram.course(graph, m, n) for graph in (computed, ahead))
        for column in ("kappa_n", "kappa_star", "energy"):
            values = [[node[column] for node in branch["nodes"]] for branch in (ours, theirs)]
            assert values[0] == pytest.approx(values[1], abs=1e-8)
        assert [node["kind"] for node in ours["nodes"]] == [node["kind"] for node in theirs["nodes"]]
    there, here = (sorted(state["energy"] for state in diagram.states_at(graph, 3.2)) for graph in (computed, ahead))
    assert here == pytest.approx(there, abs=1e-3)  # between points both are splines, the preview's through fewer


@pytest.mark.full
def test_disentangled_lines_cross_less_and_keep_kappa_n(folder):
    graph, window = read(folder), (-8.0, 14.0)
    lines = draw_diagram.lines(graph, "ribbon", 0.3)

    def count(heights):
        return crossings([np.column_stack([line.kappa_n, height]) for line, height in zip(lines, heights)], window)

    heights = draw_diagram.heights(lines, window)
    assert count(heights) == 0 < count([line.kappa_star for line in lines])
    for line, height in zip(lines, heights):
        for number, mark in ((0, line.marks[0]), (-1, line.marks[-1])):
            assert mark.kind != "circle" or height[number] == pytest.approx(mark.covering)


def test_crossings_of_polylines():
    """A zigzag and two levels: counted by hand."""
    low, high = (np.array([[0, height], [3, height]]) for height in (1.0, 3.0))
    zigzag = np.array([[0, 0], [1, 2], [2, 0], [3, 2.0]])
    assert crossings([zigzag, low, high], (0.0, 3.0)) == 3
    assert crossings([zigzag, low], (1.0, 3.0)) == 2  # the first is outside


@pytest.mark.sample(1)
@pytest.mark.parametrize("source", ["diagram", "scene"])
def test_the_pictures(folder, call, tmp_path, source):
    (tmp_path / "scene.yaml").write_text(SCENE)
    what = folder if source == "diagram" else "scene.yaml"
    main = plot.main
    done = call(main, what, "--out", "x.svg")
    assert done.returncode == 0, done.err
    assert (tmp_path / "x.svg").stat().st_size > 10_000
    refused = call(main, what, "--out", "x.gif")
    assert refused.returncode == 2 and "must end in .pdf, .svg or .png" in refused.err


@pytest.mark.full
def test_the_work_for_a_branch_does_not_grow_with_the_diagram(tmp_path, monkeypatch):
    """Calls of functions in the process that collects the branches, each with its line, for one of 60 and for one of 240."""

    @contextlib.contextmanager
    def at_once(*options):
        yield lambda function, job: _done((b"", "", _course(parse(job[1], "job")))), executors.first_done, 1

    monkeypatch.setattr(diagrams, "executor", at_once)
    monkeypatch.setattr(diagrams, "write_bytes", lambda path, data: None)
    monkeypatch.setattr(diagrams, "_load_kernels", lambda configs: None)
    calls = {}
    for count in (60, 240):
        scene, counter = parse(f"{{m: 1, n: 2, nu: {[k / 1000 for k in range(count)]}}}", "scene"), itertools.count()
        sys.setprofile(lambda frame, event, argument, counter=counter: next(counter) if event == "call" else None)
        try:
            run_many(scene, tmp_path / str(count), Display())
        finally:
            sys.setprofile(None)
        calls[count] = next(counter) / count
        assert len(diagram.families(read(tmp_path / str(count)))) == count
    assert calls[240] < calls[60]


def _done(result):
    """A future with its result."""
    future = Future()
    future.set_result(result)
    return future


def _course(config):
    """A branch of two points."""
    family = {"law": config.law, "nu": config.nu, "m": config.m, "n": config.n}
    values = {"kappa_n": 1.0, "kappa_star": 1.0, "energy": -0.5}
    nodes = [diagram.node(family, kind, values, number) for number, kind in enumerate(("circle", "leaves"))]
    ends = [name for name, _ in nodes]
    return Part(nodes, [(*ends, {**family, "file": config.file, **dict.fromkeys(diagram.COLUMNS, [0.0, 1.0])})])
