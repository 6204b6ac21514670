"""Names of version 0.2 work for one version more, and warn where they are used."""

import math
import pickle

import pytest

import contin
from contin import AlgebraicProblem, BoundaryValueProblem, ConnectionProblem, CycleProblem, Event, MapProblem, ProblemError

PARABOLA = AlgebraicProblem(lambda u, p: (p.a - u.x**2,), ["x"], {"a": 1.0})
HALF = Event("UZ", "half", lambda trial: trial.x[0] - 0.5)
DOWN = {"free": ["a"], "direction": -1, "limits": {"a": (-1, 4)}}


@pytest.mark.parametrize("name, place", [
    ("TestFunction", "contin.Event"), ("Monitor", "contin.Event"), ("Collocation", "contin.lowlevel.Collocation"),
    ("read_auto", "contin.auto07p.read_auto"), ("minimum", "contin.lowlevel.minimum"), ("Stop", "contin.lowlevel.Stop"),
    ("sensitivities", "contin.Point.sensitivities"),
])  # fmt: skip
def test_a_first_name(name, place):
    with pytest.warns(DeprecationWarning, match=f"contin.{name} is {place} now") as told:
        found = getattr(contin, name)
    module, _, new = place.rpartition(".")
    assert found is getattr(contin if module == "contin" else getattr(contin, module.removeprefix("contin.")), new)
    assert told[0].filename == __file__


def test_follow_is_trace():
    system = contin.lowlevel.Algebraic(PARABOLA, ["a"])
    settings = contin.Settings(direction=-1, limits={"a": (-1, 4)})
    with pytest.warns(DeprecationWarning, match="follow.*is contin.trace") as told:
        old = contin.lowlevel.follow(system, [1.0, 1.0], settings)
    assert told[0].filename == __file__
    new = contin.trace(contin.lowlevel.point_of(system, [1.0, 1.0]), settings)
    assert [(point.label, *point.x) for point in old] == [(point.label, *point.x) for point in new]
    with pytest.warns(DeprecationWarning, match="sensitivities"):
        assert contin.sensitivities(new.labelled("LP")[0]) == {}


@pytest.mark.parametrize("name", ["test_functions", "monitors"])
def test_events_by_a_first_name(name):
    start = contin.solve(PARABOLA, [1.0])
    for call in (lambda: contin.Settings(**{name: [HALF]}), lambda: contin.trace(start, **DOWN, **{name: [HALF]})):
        with pytest.warns(DeprecationWarning, match=f"{name}= is called events= now") as told:
            found = call()
        assert [(warning.filename, warning.lineno) for warning in told] == [(__file__, call.__code__.co_firstlineno)]
        if isinstance(found, contin.Settings):
            assert found.events == (HALF,)
        else:
            assert [point.name for point in found.labelled("UZ")] == ["half"]


def test_events_given_anew_replace_those_of_settings(recwarn):
    settings = contin.Settings(events=[HALF])
    assert not contin.trace(contin.solve(PARABOLA, [1.0]), settings, events=[], **DOWN).labelled("UZ")
    assert len(contin.trace(contin.solve(PARABOLA, [1.0]), settings, **DOWN).labelled("UZ")) == 1
    assert not recwarn.list


def bratu():
    problem = BoundaryValueProblem(
        lambda t, u, p: (u.v, -p.lam * math.exp(u.u)), lambda a, b, p: (a.u - p.e, b.u), ["u", "v"], {"lam": 0.0, "e": 0.0}
    )
    return contin.trace(
        contin.solve(problem, [0, 0]), free=["lam"], zeros={"lam": [1.0]}, limits={"lam": (0, 4)}, max_points=40
    )


def test_points_of_curves_are_drawn_and_pickled():
    branch = bratu()
    assert len(contin.curve(branch.labelled("LP")[0], "e", max_points=3)[0].plot("series").lines) == 2
    point = contin.curve(branch.labelled("UZ")[0], "e", max_points=3)[1]
    assert pickle.loads(pickle.dumps(point)).parameters == point.parameters
    with pytest.raises(ProblemError, match="segment: the problem has no segments"):
        point.segment(0)


def test_a_motion_that_ends_in_finite_time_is_told():
    with pytest.raises(ProblemError, match="no finite value after t = "):
        contin.cycle(CycleProblem(lambda u, p: (u.x**2, u.y), ["x", "y"], {}), [1.0, 1.0])


def test_what_problems_say_of_themselves():
    assert CycleProblem(lambda u, p: (u.y, -u.x), ["x", "y"], {}).describe().count("\n") == 1
    assert ConnectionProblem(lambda u, p: (u.y, u.x), ["x", "y"], {"c": 0.0}, unstable=1).describe().count("\n") == 1


def test_sensitivities_of_maps_leave_out_rounds():
    """The fold of Hénon's map is at a = -(1 - b)^2 / 4."""
    henon = MapProblem(lambda u, p: (1 - p.a * u.x**2 + u.y, p.b * u.x), ["x", "y"], {"a": 0.1, "b": 0.3})
    (fold,) = contin.trace(contin.solve(henon, [0.9, 0.3]), free=["a"], direction=-1, max_points=60).labelled("LP")
    assert list(fold.sensitivities()) == ["b"]
    assert fold.sensitivities()["b"]["a"] == pytest.approx(0.35, abs=1e-12)
