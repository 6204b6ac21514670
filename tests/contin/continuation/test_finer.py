"""A step whose end needs a finer mesh: its end is moved there where nothing is looked for in it; else it is made again."""

import numpy as np
import pytest

from contin import BoundaryValueProblem, Event, Settings, solve
from contin.collocation.mesh import MeshControl
from contin.continuation.meshes import MeshPolicy
from contin.lowlevel import Continuation

#: u'' = k^2 u with u = 1 at both ends has layers of thickness 1 / k.
LAYERS = BoundaryValueProblem(
    lambda t, u, p: (p.k * u.v, p.k * u.u), lambda a, b, p: (a.u - 1, b.u - 1), ["u", "v"], {"k": 1.0}
)
MESH = MeshControl(tolerance=1e-8)


def run(**settings):
    start = solve(LAYERS, lambda t: (1.0, 0.0), mesh=MESH)
    system, x = start.system.with_free(["k"], start.x)
    return Continuation(system, x, Settings(**{"limits": {"k": (0.5, 200)}, "mesh": MESH, **settings}))


@pytest.fixture
def ways(monkeypatch):
    """What is done where a mesh is too poor: whether the end of a step moves, and "again" where the step is made again."""
    found = []
    move, again = MeshPolicy.ends_finer, MeshPolicy.good_step
    monkeypatch.setattr(MeshPolicy, "ends_finer", lambda *given: found.append(move(*given)) or found[-1])
    monkeypatch.setattr(MeshPolicy, "good_step", lambda *given: found.append("again") or again(*given))
    return found


def test_ends_move_to_finer_meshes(ways):
    points = list(run())
    assert ways == [True, True, True, "again"]  # the last step passes a limit
    assert points[-1].system.intervals > 1.5 * points[0].system.intervals
    for point in points:
        assert point.discretization_error <= MESH.tolerance
        middle = point.system.evaluate(point.x, np.array([0.5]))[0, 0]
        assert middle == pytest.approx(1 / np.cosh(point.parameters["k"] / 2), abs=5 * MESH.tolerance)


def test_a_run_goes_on_from_any_state(ways):
    first = run()
    seen = [(first.state, point.x) for point in first]
    for number in range(2, len(seen) - 1, 3):
        state, x = seen[number]
        points = list(Continuation(state.system, x, first.settings, state=state, start=first.start))
        assert len(points) == len(seen) - number - 1
        assert np.allclose(points[-1].x, seen[-1][1], rtol=1e-13, atol=1e-13)
    assert True in ways


def test_steps_that_are_made_again_end_at_the_same_places(ways, monkeypatch):
    moved = list(run(zeros={"k": [10.0, 50.0]}))
    monkeypatch.setattr(MeshPolicy, "ends_finer", lambda *_: False)
    again = list(run(zeros={"k": [10.0, 50.0]}))
    assert ways.count("again") > 3 and True in ways
    assert [point.label for point in moved] == [point.label for point in again]
    assert [point.arclength for point in moved] == pytest.approx([point.arclength for point in again], rel=1e-4)


def test_a_test_function_that_passes_between_both_meshes_keeps_the_end_where_it_is(ways, monkeypatch):
    first, own = run().state.system.intervals, MeshPolicy.__init__
    other = Event("UZ", "between", lambda trial: 1.0 if trial.system.intervals > first else -1.0, asks=lambda _: False)
    monkeypatch.setattr(MeshPolicy, "__init__", lambda policy, steps, tests, _: own(policy, steps, tests, [other]))
    list(run())
    assert ways[0] is False and ways[1] == "again"
