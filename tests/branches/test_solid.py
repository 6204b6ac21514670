"""Volume, area and bounding box of exported strips of every kind, against closed forms."""

import dataclasses
import math

import numpy as np
import pytest
from scipy.integrate import quad

from branches.draw.solid import Mesh, solid, surface, thickest, widest
from branches.export import __main__ as export
from branches.read import read_branch
from branches.run.display import Display
from branches.run.runner import run_scene
from branches.scene.parse import parse
from ribbon_model.section import natural_states, section_of
from ribbon_model.shape import Shape, frames, shape_of

WIDTH, THICKNESS, CELLS = 0.06, 0.004, 2000
#: Cells are flat: volume and area are too small by (angle of a cell)**2/12 where a strip bends, and by as much of its twist.
FLAT = 2e-5


def strip(ruled=False, **strains) -> Shape:
    """A strip of length 1 with constant strains: its centreline is a helix, straight or a circle, in closed form."""
    rod = section_of("rod", {"B1": 1.0, "B2": 1.0, "C": 1.0, **strains})
    t = np.linspace(0, 1, CELLS + 1)
    omega = np.tile([strains.get(name, 0.0) for name in ("kappa_n", "kappa_2", "tau_n")], (len(t), 1))
    return shape_of(t, natural_states(rod, t), omega if ruled else 0 * omega)


def ring(half_twists: int) -> Shape:
    """A circle of length 1 whose frame turns about the tangent by half twists."""
    angle = 2 * math.pi * np.linspace(0, 1, CELLS + 1)
    zero, turn = np.zeros_like(angle), half_twists * angle / 2
    out, up = np.stack([np.cos(angle), np.sin(angle), zero], axis=1), np.array([0.0, 0.0, 1.0])
    ahead = np.stack([-np.sin(angle), np.cos(angle), zero], axis=1)
    d1 = np.cos(turn)[:, None] * out + np.sin(turn)[:, None] * up
    directors = np.stack([d1, np.cross(ahead, d1), ahead], axis=1)
    return Shape(angle / (2 * math.pi), out / (2 * math.pi), directors, zero)


STRIPS = {
    "straight": strip(),
    "arc": strip(kappa_n=2.0),
    "nearly a loop": strip(kappa_n=2 * math.pi - 0.1),
    "loop": strip(kappa_n=2 * math.pi),
    "twice round": strip(kappa_n=4 * math.pi),
    "twisted": strip(tau_n=7.0),
    "helix of a rod": strip(kappa_n=5.0, kappa_2=2.0, tau_n=3.0),
    "bent in its plane": strip(kappa_2=1.5),
    "helix of a ribbon": strip(ruled=True, kappa_n=5.0, tau_n=3.0),
    **{f"ring with {twists} half twists": ring(twists) for twists in range(5)},
}


def volume(mesh: Mesh) -> float:
    a, b, c = (mesh.vertices[mesh.triangles[:, i]] for i in range(3))
    return float(np.einsum("ki,ki->", a, np.cross(b, c)) / 6)


def area(mesh: Mesh) -> float:
    a, b, c = (mesh.vertices[mesh.triangles[:, i]] for i in range(3))
    return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2)


def box(mesh: Mesh) -> np.ndarray:
    return np.ptp(mesh.vertices, axis=0)


def closed(mesh: Mesh) -> bool:
    """Return whether each edge belongs to two cells, which pass it in opposite directions, and each vertex to some cell."""
    edges = np.concatenate([mesh.quads[:, [i, (i + 1) % 4]] for i in range(4)])
    ahead, back = ({tuple(edge) for edge in some.tolist()} for some in (edges, edges[:, ::-1]))
    return len(ahead) == len(edges) and ahead == back and len(np.unique(edges)) == len(mesh.vertices)


@pytest.mark.sample(1)
@pytest.mark.parametrize("name", STRIPS)
def test_a_solid_is_closed_and_has_the_volume_of_its_length_width_and_thickness(name):
    """The volume element is 1 - v omega_2 + z omega_1 + v eta', whose mean over the section is 1 (eta is constant here)."""
    mesh = solid(STRIPS[name], WIDTH, THICKNESS)
    assert closed(mesh)
    assert volume(mesh) == pytest.approx(WIDTH * THICKNESS, rel=FLAT)
    open_ended = name in ("straight", "arc", "nearly a loop", "twisted", "bent in its plane") or name.startswith("helix")
    assert len(mesh.vertices) == 18 * (CELLS + open_ended)
    assert len(mesh.quads) == 18 * CELLS + 16 * open_ended


@pytest.mark.parametrize("name", STRIPS)
def test_a_surface_has_the_area_of_the_strip(name):
    """Of a rod: the integral of |(1 - v omega_2) d3 + v omega_3 d2| over the width; of a ribbon, length times width."""
    shape, error = STRIPS[name], FLAT
    if "ribbon" in name:
        expected = WIDTH
    else:
        step, d = np.diff(shape.arclength)[0], shape.directors
        w2, w3 = (np.vecdot(d[1:, i], d[:-1, j]) / step for i, j in ((2, 0), (0, 1)))  # d3' = omega_2 d1, d1' = omega_3 d2
        pairs = zip(w2[::100], w3[::100])
        expected = np.mean([quad(lambda v, a=a, b=b: math.hypot(1 - v * a, v * b), -WIDTH / 2, WIDTH / 2)[0] for a, b in pairs])
        error += (WIDTH / 8 * abs(w3).max()) ** 2 / 10  # a rod's section is straight, and has 8 cells: their size over 12
    assert area(surface(shape, WIDTH)) == pytest.approx(expected, rel=error)


def test_a_straight_strip_is_a_block():
    mesh = solid(STRIPS["straight"], WIDTH, THICKNESS)
    np.testing.assert_allclose(box(mesh), [WIDTH, THICKNESS, 1], rtol=1e-14)
    assert area(mesh) == pytest.approx(2 * (WIDTH + THICKNESS + WIDTH * THICKNESS), rel=1e-13)
    assert volume(mesh) == pytest.approx(WIDTH * THICKNESS, rel=1e-13)


def test_bounding_boxes_of_an_arc_a_loop_and_a_twisted_strip():
    sagitta = (1 + THICKNESS) - (1 - THICKNESS) * math.cos(1.0)  # radius 1/2, opened by 2: halves of inner and outer circle
    arc = box(solid(STRIPS["arc"], WIDTH, THICKNESS))
    turn = frames(natural_states(section_of("rod", {"B1": 1, "B2": 1, "C": 1, "kappa_n": 2.0}), [0.5]))[0]
    mesh = solid(STRIPS["arc"], WIDTH, THICKNESS)
    seen = np.ptp(mesh.vertices @ turn.T, axis=0)  # on the axes of its middle
    chord = (1 + THICKNESS) * math.sin(1.0)
    np.testing.assert_allclose(seen, [WIDTH, sagitta / 2, chord], rtol=1e-5)
    assert arc[0] == pytest.approx(WIDTH)
    loop = box(solid(STRIPS["loop"], WIDTH, THICKNESS))
    np.testing.assert_allclose(loop, [WIDTH, 1 / math.pi + THICKNESS, 1 / math.pi + THICKNESS], rtol=1e-5)
    twisted = box(solid(STRIPS["twisted"], WIDTH, THICKNESS))
    np.testing.assert_allclose(twisted, [math.hypot(WIDTH, THICKNESS)] * 2 + [1], rtol=1e-5)


@pytest.mark.full
@pytest.mark.parametrize("name", ["straight", "arc", "twisted", "helix of a ribbon"])
def test_a_width_and_a_thickness_that_vary_along_the_strip_are_those_of_the_solid(name):
    """Volume: the integral of width times thickness; area of a developable surface: that of the width."""
    s = STRIPS[name].arclength
    tapered = dataclasses.replace(STRIPS[name], breadth=1 - s / 2, depth=1 + s)
    mesh = solid(tapered, WIDTH, THICKNESS)
    assert closed(mesh)
    if name != "helix of a ribbon":  # its generators are oblique: a section is not at one s
        assert volume(mesh) == pytest.approx(WIDTH * THICKNESS * (1 + 1 / 4 - 1 / 6), rel=FLAT)
    if name in ("straight", "arc"):
        assert area(surface(tapered, WIDTH)) == pytest.approx(0.75 * WIDTH, rel=FLAT)
    if name == "straight":
        ends = [np.ptp(mesh.vertices[mesh.stations == k], axis=0)[:2] for k in (0, CELLS)]
        np.testing.assert_allclose(ends, [[WIDTH, THICKNESS], [WIDTH / 2, 2 * THICKNESS]], rtol=1e-12)


def test_the_largest_width_and_thickness_are_those_of_the_widest_and_thickest_place():
    bent = strip(kappa_2=1.5)
    assert widest(bent) == pytest.approx(2 / 1.5, rel=1e-5)
    assert widest(dataclasses.replace(bent, breadth=1 + bent.arclength)) == pytest.approx(1 / 1.5, rel=1e-3)
    assert thickest(dataclasses.replace(STRIPS["arc"], depth=1 + bent.arclength), WIDTH) == pytest.approx(0.5, rel=1e-3)


# --- scenes -------------------------------------------------------------------------------------------------------------------

DIMENSIONS = "{width: 0.01, thickness: 0.0005, length: 0.4, poisson_ratio: 0.3, youngs_modulus: 200.0e9}"
SCENES = {
    "steel": (
        f"material: {{}}\ndimensions: {DIMENSIONS}\nnumbers: {{distance: 0.39}}\nbegin: arch\n"
        "stages: [{follow: distance, to: 0.3}]\n"
    ),
    "tapered": (
        f"material: {{}}\ndimensions: {DIMENSIONS}\nalong: {{width: 1 - s/2, thickness: 1 + s/4}}\nfinish: free\n"
        "stages: [{follow: force_normal, to: 0.05}]\n"
    ),
    "straight": "material: {law: flat rod, nu: 0.3}\nfinish: free\nstages: [{follow: force_tangent, to: 1}]\n",
    "Moebius": (
        "material: {law: flat rod, nu: 0.3, softness: 1}\nclosed: {half_twists: 1}\nbegin: circle\n"
        "phases: ['shift, right']\nstages: [{follow: softness, to: 0.9}]\n"
    ),
}  # fmt: skip
#: Volume over length times width times thickness.
VOLUMES = {"steel": 1, "tapered": 1 - 1 / 2 / 2 + 1 / 4 / 2 - 1 / 8 / 3, "straight": 1, "Moebius": 1}


@pytest.fixture(scope="module")
def result(tmp_path_factory):
    """A function that returns the result file of a scene."""
    folder, known = tmp_path_factory.mktemp("solids"), {}

    def result(name):
        if name not in known:
            known[name] = folder / f"{name}.h5"
            scene = parse(SCENES[name], name)
            run_scene(scene, known[name], Display(silent=True))
        return known[name]

    return result


@pytest.mark.sample(1)
@pytest.mark.parametrize("name", VOLUMES)
def test_a_scene_is_exported_with_its_volume(name, result, tmp_path):
    trimesh = pytest.importorskip("trimesh")
    out = tmp_path / "strip.stl"
    options = [str(result(name)), "--point", "2", "--out", str(out), "--length", "400", "--thickness", "0.5"]
    assert export.main([*options, "--width", "10"]) == 0
    written = trimesh.load_mesh(out)
    assert written.is_watertight and written.is_winding_consistent
    assert written.volume == pytest.approx(2000 * VOLUMES[name], rel=1e-4)
    if name == "straight":
        assert sorted(written.extents) == pytest.approx([0.5, 10, 400], rel=1e-6)


@pytest.mark.full
def test_the_width_of_the_dimensions_is_that_of_the_export(result, tmp_path, capsys):
    trimesh = pytest.importorskip("trimesh")
    for options, length in (([], 0.4), (["--length", "400"], 400)):
        assert export.main([str(result("steel")), "--point", "2", "--out", str(tmp_path / "s.glb"), *options]) == 0
        written = trimesh.load_mesh(tmp_path / "s.glb", force="mesh")
        assert written.area == pytest.approx(length**2 / 40, rel=1e-4)
    assert "width 10: the scene's" in capsys.readouterr().out


@pytest.mark.full
def test_the_shape_of_a_scene_knows_its_width_along_the_strip(result):
    branch = read_branch(result("tapered"))
    shape = branch.shape(0)
    np.testing.assert_allclose(shape.breadth, 1 - shape.arclength / 2, rtol=1e-14)
    np.testing.assert_allclose(shape.depth, 1 + shape.arclength / 4, rtol=1e-14)
    assert branch.width_at(400, None) == pytest.approx(10)


@pytest.mark.full
def test_Gamma_and_a_thickness_give_the_width_of_an_open_strip(result, tmp_path):
    scene = "material: {law: finite width, nu: 0.3, Gamma: 4.0}\nfinish: free\nstages: [{follow: force_tangent, to: 1}]\n"
    run_scene(parse(scene, "s"), tmp_path / "s.h5", Display(silent=True))
    assert read_branch(tmp_path / "s.h5").width_at(10, 0.02) == pytest.approx(math.sqrt(4 * 0.02 * 10))
