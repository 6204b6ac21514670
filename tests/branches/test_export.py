"""A strip as a file for other programs, each read by a library that did not write it where there is one; a branch as a film."""

import dataclasses
import json
import math
import shutil
import signal
import struct
import sys
import time

import h5py
import numpy as np
import pytest

from branches.draw.solid import solid, thickest, widest
from branches.export import __main__ as export
from branches.read import read_branch
from branches.run.runner import run_scene
from branches.scene.closed import ClosedScene

WIDTH, THICKNESS = 0.06, 0.004


@pytest.fixture(scope="module")
def results(tmp_path_factory, silent):
    """The branch (1, 2) of the ribbon."""
    folder = tmp_path_factory.mktemp("results")
    run_scene(ClosedScene(m=1, n=2), folder / "m1_n2.h5", silent())
    return folder / "m1_n2.h5"


@pytest.fixture
def write(call, results, tmp_path):
    """A function that exports the fold with options, and returns the one file written."""

    def write(name, *options):
        done = call(export.main, results, "--point", "LP", "--out", name, *options)
        assert done.returncode == 0, done.err
        return tmp_path / name

    return write


SOLID = ("--width", WIDTH, "--thickness", THICKNESS)
#: Volume and area of cells with flat faces are smaller than those of the strip by about (curvature * step)**2/12, where a step
#: is L/896 and the curvature up to 15/L: 2e-5.
DISCRETIZED = 1e-4


# --- solids and surfaces ----------------------------------------------------------------------------------------------


@pytest.mark.sample(1)
@pytest.mark.parametrize("ending", ["stl", "obj"])
def test_a_solid_is_closed_and_has_the_volume_of_the_strip(write, ending):
    trimesh, meshio = pytest.importorskip("trimesh"), pytest.importorskip("meshio")
    path = write(f"solid.{ending}", *SOLID)
    written = trimesh.load_mesh(path)
    assert written.is_watertight and written.is_winding_consistent
    assert written.volume == pytest.approx(WIDTH * THICKNESS, rel=DISCRETIZED)
    other = meshio.read(path)  # wrote neither
    corners = other.points[other.cells_dict["triangle"]].astype(float)
    assert np.einsum("ki,ki->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6 == pytest.approx(
        WIDTH * THICKNESS, rel=DISCRETIZED
    )


def test_a_length_scales_the_solid(write):
    trimesh = pytest.importorskip("trimesh")
    written = trimesh.load_mesh(write("print.stl", "--length", 300, "--width", 18, "--thickness", 1.2))
    assert written.volume == pytest.approx(300 * 18 * 1.2, rel=DISCRETIZED)


def test_a_glb_holds_the_surface_upright(write):
    trimesh = pytest.importorskip("trimesh")
    path = write("strip.glb", "--width", WIDTH)
    written = trimesh.load_mesh(path)
    assert written.area == pytest.approx(WIDTH, rel=DISCRETIZED)
    data = path.read_bytes()  # as the standard has it: a header of 12 bytes, then a chunk of JSON
    assert data[:4] == b"glTF" and struct.unpack("<I", data[8:12])[0] == len(data)
    told = json.loads(data[20 : 20 + struct.unpack("<I", data[12:16])[0]])
    assert told["materials"][0]["doubleSided"]


def test_a_glb_is_turned_and_not_mirrored(write):
    """The second axis of glTF is up: (x, y, z) becomes (x, z, -y). Faces look outward, as those of the STL file do."""
    trimesh = pytest.importorskip("trimesh")
    written, stl = (trimesh.load_mesh(write(f"solid.{ending}", *SOLID)) for ending in ("glb", "stl"))
    assert written.volume == pytest.approx(WIDTH * THICKNESS, rel=DISCRETIZED)  # negative for a mirrored solid
    turned = stl.triangles[..., [0, 2, 1]] * [1, 1, -1]
    np.testing.assert_allclose(np.sort(written.triangles_center, axis=0), np.sort(turned.mean(axis=1), axis=0), atol=1e-6)


def test_a_gltf_is_one_file(write):
    trimesh = pytest.importorskip("trimesh")
    path = write("strip.gltf", "--width", WIDTH)
    assert trimesh.load_mesh(path).area == pytest.approx(WIDTH, rel=DISCRETIZED)
    assert json.loads(path.read_text())["buffers"][0]["uri"].startswith("data:")


@pytest.mark.parametrize("ending", ["vtk", "vtu"])
def test_vtk_files_hold_strains_and_directors(write, results, ending):
    meshio = pytest.importorskip("meshio")
    written = meshio.read(write(f"strip.{ending}", "--width", WIDTH))
    assert {"s", "d1", "d2", "d3", "omega_1", "omega_2", "omega_3"} <= set(written.point_data)
    solution = read_branch(results).solution(_fold(results))
    largest = np.abs(solution.strains()[:, 0]).max() * 2 * math.pi
    assert np.abs(written.point_data["omega_1"]).max() == pytest.approx(largest, rel=1e-12)
    assert len(written.cells_dict["quad"]) * 9 == len(written.points) * 8


def test_limits_of_width_and_thickness_are_those_of_a_regular_solid(results):
    """Just within them, all cells of the solid are on the right side: its faces look outward everywhere."""
    shape, _ = read_branch(results).placed(_fold(results), 1.0)
    width = 0.95 * widest(shape)
    mesh = solid(shape, width, 0.95 * thickest(shape, width))
    assert _along(mesh, shape).min() > 0
    wider = solid(shape, 1.05 * widest(shape), 1e-6)
    assert _along(wider, shape).min() < 0


def _along(mesh, shape):
    """Return the components along d3 of the edges that lead from each node to the next one."""
    nodes, edges = len(shape.arclength) - 1, np.concatenate([mesh.quads[:, [i, (i + 1) % 4]] for i in range(4)])
    edges = edges[(mesh.stations[edges[:, 1]] - mesh.stations[edges[:, 0]]) % nodes == 1]
    step = mesh.vertices[edges[:, 1]] - mesh.vertices[edges[:, 0]]
    return np.einsum("ki,ki->k", step, shape.directors[mesh.stations[edges[:, 0]], 2])


def test_a_law_of_rods_has_straight_sections_and_Gamma_gives_a_width(results):
    branch = read_branch(results)
    options = export.parser().parse_args(["x.h5", "--point", "LP", "--out", "x.stl", "--length", "10", "--thickness", "0.02"])
    wide = dataclasses.replace(branch, scene=branch.scene.model_copy(update={"Gamma": 4.0}))
    assert wide.width_at(10, options.thickness) == pytest.approx(math.sqrt(4.0 * 0.02 * 10 / (2 * math.pi)))
    assert branch.width_at(10, options.thickness) is None
    rod = dataclasses.replace(branch, scene=branch.scene.model_copy(update={"law": "flat rod"}))
    assert not rod.placed(_fold(results), 1.0)[0].eta.any()


# --- table ------------------------------------------------------------------------------------------------------------


def _fold(results):
    with h5py.File(results) as file:
        events = file["events"][:]
    return int(events["point"][events["label"] == b"LP"][0])


def test_the_table_is_the_solution(write, results):
    path = write("strip.csv", "--length", 2)
    table = np.genfromtxt(path, delimiter=",", names=True)
    solution = read_branch(results).solution(_fold(results))
    assert table["s"][[0, -1]] == pytest.approx([0, 2], abs=1e-14)
    x = np.column_stack([table[name] for name in "xyz"])
    d = np.array([[table[f"d{i}_{axis}"] for axis in "xyz"] for i in (1, 2, 3)]).transpose(2, 0, 1)
    assert np.abs(d @ d.transpose(0, 2, 1) - np.eye(3)).max() < 1e-12
    assert np.abs(x[-1] - x[0]).max() < 1e-12 and np.abs(d[-1] - d[0]).max() < 1e-12
    shape = solution.shape()  # the same strip, turned, moved and scaled: distances between its nodes agree
    nodes = shape.centreline[::50], x[::50]
    theirs, ours = (np.linalg.norm(points[:, None] - points, axis=2) for points in nodes)
    assert np.sort(theirs.ravel()) / math.pi == pytest.approx(np.sort(ours.ravel()), abs=1e-10)
    omega = np.column_stack([table[f"omega_{i}"] for i in (1, 2, 3)])
    step = np.diff(table["s"])[:, None]  # dx/ds = d3 and d(d3)/ds = omega_2 d1 - omega_1 d2, in the units of the file
    middle = (d[1:] + d[:-1]) / 2, (omega[1:] + omega[:-1]) / 2
    assert np.abs(np.diff(x, axis=0) / step - middle[0][:, 2]).max() < 1e-3
    bend = middle[1][:, 1:2] * middle[0][:, 0] - middle[1][:, 0:1] * middle[0][:, 1]
    assert np.abs(np.diff(d[:, 2], axis=0) / step - bend).max() < 1e-2


# --- films ------------------------------------------------------------------------------------------------------------


def test_a_film_as_gif(call, results, tmp_path):
    from PIL import Image

    done = call(export.main, results, "--movie", "fold.gif", "--frames", 4)
    assert done.returncode == 0, done.err
    with Image.open(tmp_path / "fold.gif") as film:
        assert (film.format, film.n_frames, film.size) == ("GIF", 6, (480, 480))  # four there, two back
        pictures = []
        for frame in range(film.n_frames):
            film.seek(frame)
            pictures.append(film.convert("RGB").tobytes())
        assert len(set(pictures)) == 4


def test_a_film_as_mp4(call, results, tmp_path):
    if shutil.which("ffmpeg") is None:
        pytest.importorskip("imageio_ffmpeg", reason="neither ffmpeg nor imageio-ffmpeg is installed")
    done = call(export.main, results, "--movie", "fold.mp4", "--frames", 3)
    assert done.returncode == 0, done.err
    assert (tmp_path / "fold.mp4").read_bytes()[4:8] == b"ftyp"


# --- what is refused --------------------------------------------------------------------------------------------------


REFUSED = {
    "--out: is needed": [],
    "--point: is needed": ["--out", "x.csv"],
    "--point 'SB': there is no such labelled point: 1 (BP at": ["--point", "SB", "--out", "x.csv"],
    "--point '4': there is no such labelled point": ["--point", "4", "--out", "x.csv"],
    "--out 'x.step': must end in .stl, .obj": ["--point", "LP", "--out", "x.step"],
    "--movie 'x.avi': must end in .gif or .mp4": ["--movie", "x.avi"],
    "--out 'x.csv': is named twice": ["--point", "LP", "--out", "x.csv", "--out", "x.csv"],
    "--width 2: must not exceed the length, 1": ["--point", "LP", "--out", "x.stl", "--width", "2"],
    "--width nan: must be from": ["--point", "LP", "--out", "x.stl", "--width", "nan"],
    "--width 0.3: must be below 0.0779": ["--point", "LP", "--out", "x.csv", "--out", "x.stl", "--width", "0.3"],
    "--thickness 0.05: must be below 0.03": ["--point", "LP", "--out", "x.stl", "--width", "0.03", "--thickness", "0.05"],
    "--frames 1: must be from 2 to 2000": ["--movie", "x.gif", "--frames", "1"],
    "argument --width: 'wide' must be a number (in m), or one with a unit": ["--width", "wide"],
}


@pytest.mark.parametrize("sentence", REFUSED)
def test_a_mistake_is_answered_in_one_sentence_and_nothing_is_written(call, results, tmp_path, sentence):
    if ".stl" in "".join(REFUSED[sentence]):
        pytest.importorskip("trimesh")
    done = call(export.main, results, *REFUSED[sentence])
    assert done.returncode == 2 and f"error: {sentence}" in done.err and done.err.count("\n") == 1
    assert not list(tmp_path.iterdir())


def test_a_missing_library_is_named(call, results, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "trimesh", None)
    done = call(export.main, results, "--point", "LP", "--out", "x.csv", "--out", "x.stl")
    assert done.returncode == 2 and "pip install trimesh" in done.err and not list(tmp_path.iterdir())


def test_of_several_points_with_a_label_one_is_to_be_named(call, results, tmp_path):
    shutil.copy(results, tmp_path / "two.h5")
    with h5py.File(tmp_path / "two.h5", "r+") as file:
        row = file["events"][2]
        row["label"] = b"LP"
        file["events"][2] = row
    done = call(export.main, "two.h5", "--point", "LP", "--out", "x.csv")
    assert "2 points have this label; name one by its number: 2 (LP at" in done.err and done.returncode == 2


@pytest.mark.full
@pytest.mark.posix("Windows sends Ctrl-C in another way")
def test_ctrl_c_ends_in_one_line_and_leaves_nothing(command, results, tmp_path):
    process = command.start(results, "--movie", "x.gif", program=("-m", "branches.export"))
    time.sleep(1.5)
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=60)
    assert (process.returncode, err, out) == (130, "interrupted\n", "") and not list(tmp_path.iterdir())


# --- for other programs, in memory ------------------------------------------------------------------------------------


def test_a_table_for_xarray(results):
    pytest.importorskip("xarray")
    data = read_branch(results).to_xarray()
    assert data["kappa_n"].dims == ("point",) and "natural curvature" in data["kappa_n"].attrs["long_name"]
    assert list(data["label"].values).count("LP") == 1 and data.attrs["status"] == "complete"
    assert "m: 1" in data.attrs["config"]
