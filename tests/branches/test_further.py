"""Further states of open strips, beside a boundary value solver that knows nothing of the project."""

import numpy as np
import pytest
from scipy.integrate import solve_bvp

from branches.read import read_branch
from branches.run import __main__ as run
from branches.run import further
from branches.run.further import places, report

SCENE = """
title: arch between clamps
material: {law: flat rod, nu: 0.3}
numbers: {distance: 0.98}
begin: arch
stages:
  - {follow: distance, to: 0.75}
"""


def planar(guess, load):
    """Energy of a planar strip whose clamped ends are at three quarters of its length, by SciPy's collocation."""

    def rhs(t, y, p):
        return np.vstack([y[1], -p[0] * np.sin(y[0]) + p[1] * np.cos(y[0]), np.cos(y[0]), np.sin(y[0]), y[1] ** 2 / 2])

    def ends(a, b, p):
        return np.array([a[0], a[2], a[3], a[4], b[0], b[2] - 0.75, b[3]])

    t = np.linspace(0, 1, 201)
    angle = guess(t)
    guesses = np.vstack([angle, np.gradient(angle, t), 0.75 * t, 0 * t, 0 * t])
    found = solve_bvp(rhs, ends, t, guesses, [load, 0.0], tol=1e-8, max_nodes=100_000)
    assert found.success
    return found.y[4, -1]


@pytest.fixture(scope="module")
def result(tmp_path_factory):
    folder = tmp_path_factory.mktemp("further")
    (folder / "arch.yaml").write_text(SCENE)
    assert run.main([str(folder / "arch.yaml"), "--quiet", "--out", str(folder / "arch.h5")]) == 0
    return read_branch(folder / "arch.h5")


@pytest.fixture(scope="module")
def searched(result):
    """The first four further states. With 8 draws, round-off of the known state decides whether the S is found."""
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(further, "MOST", 4)
        return places(result, 16)


@pytest.mark.full
def test_the_arch_and_the_shape_of_an_s(result, searched):
    """The arch to the other side is stable; the S is planar, a saddle, and to either side. The run has neither."""
    (place,) = searched
    assert result.points["distance"][place.row] == pytest.approx(0.75)
    (known,) = place.known
    arch = planar(lambda t: 1.2 * np.sin(2 * np.pi * t), 39.0)
    s_shape = planar(lambda t: 1.2 * np.sin(3 * np.pi * t), 80.0)
    assert known.potential == pytest.approx(arch, rel=1e-7)
    energies = [(state.potential, state.index) for state in place.found]
    assert (pytest.approx(arch, rel=1e-7), 0) in energies and (pytest.approx(s_shape, rel=1e-7), 1) in energies
    for state in place.found:
        assert np.abs(state.point.system.residual(state.point.x)).max() < 1e-8
        assert state.point["distance"] == pytest.approx(0.75, abs=1e-12)


@pytest.mark.full
def test_the_report(result, searched, monkeypatch):
    monkeypatch.setattr(further, "places", lambda *given: searched)
    lines = report(result, 16)
    assert lines[0] == "further states:" and lines[-1] == "  what no guess leads to is not found: there may be more"
    assert lines[1].startswith("  distance = 0.75 of stage 1: 1 known, ")
    assert "    energy 10.5515 (that of a known state), index 0" in lines and "    energy 21.1472, index 1" in lines


def test_a_search_of_one_draw(result, monkeypatch):
    """It is compared with the arch that the run has, whose energy is that of the other solver."""
    (place,) = places(result, 1)
    assert place.known[0].potential == pytest.approx(planar(lambda t: 1.2 * np.sin(2 * np.pi * t), 39.0), rel=1e-7)
    monkeypatch.setattr(further, "places", lambda *given: [place])
    lines = report(result, 1)
    assert lines[0] == "further states:" and lines[1].startswith("  distance = 0.75 of stage 1: 1 known, ")


@pytest.mark.parametrize("scene, option, said", [
    (SCENE, "0", "--search 0: must be from 1 to 1000"),
    (SCENE.replace("0.3}", "[0.2, 0.3]}"), "2", "--search: is for a scene of one open strip, or of closed strips"),
])  # fmt: skip
def test_what_cannot_be_searched(tmp_path, call, scene, option, said):
    (tmp_path / "scene.yaml").write_text(scene)
    done = call(run.main, "scene.yaml", "--search", option)
    assert done.returncode == 2 and said in done.err and not list(tmp_path.glob("*.h5"))
