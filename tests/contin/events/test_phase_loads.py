"""Phase conditions: silent where a symmetry makes their multipliers vanish, else said with the load. Closed forms."""

import math

import pytest
from scipy.optimize import brentq

import contin


def loads(branch) -> list[str]:
    return [note for note in branch.notes if note.startswith("phases:")]


def disc(push: float) -> contin.VariationalProblem:
    """A point of the plane drawn to the circle of radius sqrt(a), and along y by a force: turns by itself without the force."""
    return contin.VariationalProblem(
        energy=lambda t, x, w, p: (w.x**2 + w.y**2) / 2 + (x.x**2 + x.y**2 - p.a) ** 2 / 4 - p.push * x.y,
        states=["x", "y"], parameters={"a": 1.0, "push": push}, integrals={"angle": lambda t, x, w, p: x.y}, phases=["angle"],
    )  # fmt: skip


def test_a_circle_of_solutions_takes_a_phase():
    """At y = 0 it picks one of them, and its multiplier vanishes."""
    branch = contin.trace(contin.solve(disc(0.0), [1.0, 0.0]), free=["a"], limits={"a": (1, 2)})
    assert not branch.notes and all(abs(point["mu_angle"]) < 1e-11 for point in branch)


@pytest.mark.parametrize(("push", "free"), [(1e-7, "a"), (0.5, "a"), (0.0, "push")])
def test_a_phase_that_no_symmetry_implies_is_not_taken(push, free):
    """A force along y, or one that grows from zero: the phase holds it by itself, mu = push."""
    what = f"= {push:.6g}" if push else "grows along the branch"
    with pytest.raises(contin.ProblemError, match=f"phases: mu_angle {what} at the start .*: no symmetry of the problem"):
        contin.trace(contin.solve(disc(push), [1.0, 0.0]), free=[free])


def column(phases) -> contin.VariationalProblem:
    """Clamped and free, under a load, by its angle; the integral of the angle vanishes where it is asked to."""
    return contin.VariationalProblem(
        energy=lambda t, x, w, p: w.angle**2 / 2 + p.load * math.cos(x.angle), states=["angle"], parameters={"load": 15.0},
        ends=lambda a, b, p: (a.angle,), integrals={"place": lambda t, x, w, p: x.angle}, phases=phases,
    )  # fmt: skip


def test_a_phase_that_makes_a_branch_point():
    """angle'' + load angle = mu with the integral zero: modes 1 - cos(k (1-t)) / cos k with tan k = k, each with mu = k^2."""
    branch = contin.trace(contin.solve(column(["place"]), [0.0]), free=["load"], limits={"load": (15, 40)})
    k = brentq(lambda k: math.tan(k) - k, 4.4, 4.6, xtol=1e-14)
    begin, note, end = branch.notes
    assert not branch.labelled("BP") and "the index 0 at EP (load = 15)" in begin and "the index 1 at EP (load = 40)" in end
    assert "out what they hold: 1 without them" in begin and "out what they hold: 2 without them" in end
    assert abs(float(note.partition("BP (load = ")[2].partition(")")[0]) - k**2) < 1e-8 and "gets no label" in note
    assert not loads(contin.trace(contin.solve(column([]), [0.0]), free=["load"], limits={"load": (15, 40)}))


def test_loads_of_any_size():
    """The same column in units in which forces are 1e9 times smaller: the phase loads it as much."""
    small = contin.VariationalProblem(
        energy=lambda t, x, w, p: 1e-9 * w.y**2 / 2 + p.load * x.y, states=["y"], parameters={"load": 1e-9},
        ends=lambda a, b, p: (a.y, b.y), integrals={"place": lambda t, x, w, p: x.y}, phases=["place"],
    )  # fmt: skip
    with pytest.raises(contin.ProblemError, match=r"phases: mu_place = -1e-09 at the start \(load = 1e-09\)"):
        contin.trace(contin.solve(small, [0.0]), free=["load"])


@pytest.mark.parametrize("slope", [0.0, 0.3])
def test_the_unfolding_number_of_a_boundary_value_problem(slope):
    """u'' = slope + c with u' = 0 at both ends: u may be shifted, and the mean fixes it; c = -slope is zero without a slope."""
    problem = contin.BoundaryValueProblem(
        lambda t, u, p: (u.v, p.slope + p.c), lambda a, b, p: (a.v, b.v), ["u", "v"],
        {"mean": 1.0, "slope": slope, "c": 0.0}, integrals=lambda t, u, p: (u.u - p.mean,), phases=["c"],
    )  # fmt: skip
    point = contin.solve(problem, [0.0, 0.0], free=["c"])
    if slope:
        with pytest.raises(contin.ProblemError, match=f"phases: c = {-slope:g} at the start .* no symmetry of the problem"):
            contin.trace(point, free=["mean", "c"])
    else:
        assert not contin.trace(point, free=["mean", "c"], limits={"mean": (1, 2)}).notes


@pytest.mark.parametrize(("phases", "sentence"), [
    ("angle", "phases: 'angle' must be a list of names"), (["turn"], "phases: 'turn' must be one of angle"),
    (["angle", "angle"], "phases: angle is given twice"),
])  # fmt: skip
def test_phases_that_are_none(phases, sentence):
    """One sentence."""
    with pytest.raises(contin.ProblemError, match=f"^{sentence}$"):
        contin.VariationalProblem(
            lambda t, x, w, p: w.x**2 / 2, ["x"], {"a": 1.0}, integrals={"angle": lambda t, x, w, p: x.x}, phases=phases
        )
