"""Further states of closed strips, beside the quadratures of primary branches, and solved again on the whole loop."""

import numpy as np
import pytest

from branches.run import __main__ as run
from branches.run import further_closed
from branches.run.further_closed import places, report
from contin.lowlevel import correct
from ribbon_model import exact
from ribbon_model.closed_search import further, is_odd, waves
from ribbon_model.domains import LOOP
from ribbon_model.laws import FLAT_ROD, RIBBON
from ribbon_model.solution import Solution

SCENE = "law: ribbon\nnu: 0.3\nm: 1\nn: 2\nlimits: {kappa_n: [-100, 100]}\nzeros: {kappa_n: [3.0]}\n"


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    folder = tmp_path_factory.mktemp("closed")
    (folder / "scene.yaml").write_text(SCENE)
    assert run.main([str(folder / "scene.yaml"), "--quiet", "--out", str(folder / "scene.h5")]) == 0
    return folder / "scene.h5"


@pytest.fixture(scope="module")
def place(path):
    (found,) = places(path, [3.0], 8)
    return found


def on_the_loop(solution):
    """Return kappa* and energy of a state, solved again on the whole loop, with conditions of closure in place of symmetry."""
    system, x = solution.on(LOOP).discretized()
    system, x = system.with_free(LOOP.free[1:], x)
    found = correct(system, x).x
    assert abs(system.parameter(found, "unfold")) < 1e-8
    assert np.abs(system.states(found) - system.states(x)).max() < 1e-6  # it was a solution already
    return dict(zip(system.problem.functionals, system.functionals(found)))


@pytest.mark.full
def test_states_of_other_primary_branches(place):
    """The branch (1, 2) joins the circles 1 and 3, and passes 3 twice: four states are known. Others have other wavenumbers."""
    assert (place.law, place.nu, place.kappa_n, place.known) == ("ribbon", 0.3, 3.0, 4)
    without_force = [state for state in place.found if np.linalg.norm(state.solution.force) < 1e-6]
    assert {6, 8} <= {waves(state.solution) for state in without_force}
    (third,) = (state for state in without_force if waves(state.solution) == 6)
    nearest = min(exact.curve(1, 3, {"nu": 0.3}, (0, 4)), key=lambda one: abs(one.kappa_n - 3))
    quadrature = exact.solve(1, 3, {"nu": 0.3}, nearest, kappa_n=3.0)
    assert third.kappa_star == pytest.approx(quadrature.kappa_star, rel=1e-8)
    assert third.energy == pytest.approx(quadrature.energy, rel=1e-8)


@pytest.mark.full
def test_every_state_is_one_of_the_whole_loop(place):
    for state in place.found:
        assert state.solution.shape().closure() < 1e-8 and is_odd(state.solution)
        again = on_the_loop(state.solution)
        assert again["energy"] == pytest.approx(state.energy, rel=1e-7, abs=1e-7)
        assert again["kappa_star"] == pytest.approx(state.kappa_star, rel=1e-7, abs=1e-7)


@pytest.mark.full
def test_a_state_of_a_secondary_branch():
    """One that leaves (3, 1) at kappa_n = -21.6 and comes back at -114.3: it has a force and one mirror."""
    points = further(RIBBON, {"nu": 0.3}, -60.0, [], [1, 3], 32)
    forced = [Solution.of(point) for point in points if abs(point["energy"] - 172.7327) < 1e-3]
    (solution,) = forced
    assert waves(solution) == 1 and 4.1 < np.linalg.norm(solution.force) < 4.2
    on_the_loop(solution)


@pytest.mark.full
def test_even_circles_have_states_of_their_own():
    points = list(further(FLAT_ROD, {"nu": 0.3}, 0.0, [], [2], 8))
    assert points and not any(is_odd(Solution.of(point)) for point in points)


@pytest.mark.full
def test_the_report(path, place, monkeypatch):
    monkeypatch.setattr(further_closed, "places", lambda *given: [place])
    lines = report(path, [3.0], 8)
    assert lines[0] == "further states of strips with a mirror or a two-fold axis, besides planar circles:"
    assert lines[1] == f"  ribbon, nu = 0.3, kappa_n = 3: 4 known, {len(place.found)} more"
    assert lines[-1] == "  what no draw leads to is not found: there are more"
    assert any("no force, 6 equal waves, index " in line for line in lines)


def test_values_are_needed(tmp_path, call):
    (tmp_path / "scene.yaml").write_text("m: 1\nn: 2\n")
    done = call(run.main, "scene.yaml", "--search", "2")
    assert done.returncode == 2 and "closed strips are searched at labelled values of kappa_n" in done.err
    assert not list(tmp_path.glob("*.h5"))
