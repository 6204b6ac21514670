"""Periodic orbits: their periods, multipliers, doublings and ends against closed forms and published values."""

import math

import numpy as np
import pytest

import contin
from contin import AlgebraicProblem, CycleProblem, MeshControl, ProblemError
from contin.continuation import plain_on_mesh
from contin.cycles import equations as cycles
from contin.cycles import floquet
from contin.events import hopf
from contin.search import motions, orbits


def circle(u, p):
    square = u.x**2 + u.y**2
    return p.mu * u.x - u.y - u.x * square, u.x + p.mu * u.y - u.y * square


def bautin(u, p):
    s = u.x**2 + u.y**2
    growth = p.mu + s - s * s
    return growth * u.x - u.y, u.x + growth * u.y


def van_der_pol(u, p):
    return u.v, p.mu * (1 - u.x**2) * u.v - u.x


def lorenz(u, p):
    return 10 * (u.y - u.x), p.r * u.x - u.y - u.x * u.z, u.x * u.y - 8 / 3 * u.z


def roessler(u, p):
    return -u.y - u.z, u.x + 0.2 * u.y, 0.2 + u.z * (u.x - p.c)


def brusselator(u, p):
    return p.a - (p.b + 1) * u.x + u.x**2 * u.y, p.b * u.x - u.x**2 * u.y


def round_and_round(radius):
    return lambda t: (radius * math.cos(2 * math.pi * t), radius * math.sin(2 * math.pi * t))


def test_the_circle_of_the_normal_form():
    """Radius sqrt(mu), period 2 pi, multipliers 1 and exp(-4 pi mu): the Hopf normal form in polar coordinates."""
    orbit = contin.solve(CycleProblem(circle, ["x", "y"], {"mu": 0.25}), round_and_round(0.6), {"period": 6}, degree=7)
    branch = contin.trace(orbit, free=["mu"], limits={"mu": (0.01, 1)})
    for point in branch:
        assert point["period"] == pytest.approx(2 * math.pi, abs=1e-11)
        assert point["max_x"] == pytest.approx(math.sqrt(point["mu"]), abs=1e-10)
        exponents = point.system.eigenvalues(point.x)
        assert np.abs(exponents - [0, -4 * math.pi * point["mu"]]).max() < 1e-9


@pytest.mark.parametrize("free", [["nu"], ["nu", "period"]])
def test_cycles_in_another_parameter_than_that_of_the_hopf_point(free):
    """Both parameters add up: mu = 0.5 stays where the Hopf point was found, at nu = -0.5, and r**2 = 0.5 + nu."""

    def both(u, p):
        square = u.x**2 + u.y**2
        growth = p.mu + p.nu - square
        return growth * u.x - u.y, u.x + growth * u.y

    problem = AlgebraicProblem(both, ["x", "y"], {"mu": 0.0, "nu": -0.5})
    (hopf,) = contin.trace(contin.solve(problem, [0.0, 0.0]), free=["mu"], limits={"mu": (0, 1)}).labelled("HB")
    branch = contin.trace(hopf, branch=1, free=free, limits={"nu": (-1, 1)})
    assert branch.stop.message == "reached nu = 1"
    for point in branch:
        assert point["mu"] == pytest.approx(0.5, abs=1e-12)
        assert point["max_x"] ** 2 == pytest.approx(0.5 + point["nu"], abs=1e-9)


def test_cycles_begin_on_as_many_intervals_as_the_run_has():
    """Bounds of the mesh hold from the first point of a branch on."""
    start, limits = contin.solve(AlgebraicProblem(circle, ["x", "y"], {"mu": -0.5}), [0.0, 0.0]), {"mu": (-1, 0.5)}
    (hopf,) = contin.trace(start, free=["mu"], limits=limits).labelled("HB")
    branch = contin.trace(hopf, branch=1, limits=limits, mesh=MeshControl(min_intervals=30, max_intervals=30))
    assert {point.system.intervals for point in branch} == {30}


def test_a_fold_of_cycles():
    """r' = mu r + r**3 - r**5: both cycles meet at mu = -1/4, r**2 = 1/2; multiplier exp(2 pi r d(growth)/dr)."""
    problem = CycleProblem(bautin, ["x", "y"], {"mu": 1.0})
    orbit = contin.solve(problem, round_and_round(1.2), {"period": 6.0}, degree=6)
    branch = contin.trace(orbit, free=["mu"], limits={"mu": (-1, 1.1), "max_x": (0.3, 2)}, direction=-1)
    (fold,) = branch.labelled("LP")
    assert fold["mu"] == pytest.approx(-0.25, abs=1e-10) and fold["max_x"] ** 2 == pytest.approx(0.5, abs=1e-6)
    for point in (branch.points[0], branch.points[-1]):
        s = point["max_x"] ** 2
        values = np.sort(point.system.eigenvalues(point.x).real)
        assert np.abs(values - np.sort([0, 4 * math.pi * (s - 2 * s * s)])).max() < 1e-8


@pytest.mark.full
def test_van_der_pol_to_a_multiplier_that_no_number_holds():
    """Periods: published, 6.6632868593 at mu = 1 and 19.0783695 at mu = 10. Liouville gives their product."""
    orbit = contin.cycle(CycleProblem(van_der_pol, ["x", "v"], {"mu": 1.0}), [0.1, 0.0])
    assert orbit["period"] == pytest.approx(6.6632868593, abs=1e-10)
    branch = contin.trace(orbit, free=["mu"], limits={"mu": (0.5, 10)}, mesh=MeshControl(max_intervals=1000))
    end = branch.points[-1]
    assert end["period"] == pytest.approx(19.0783695, abs=1e-7)
    found = end.floquet()
    trivial, small = found.logarithms
    assert abs(trivial) < 1e-9 and small.real < -240 and found.errors[0] == abs(trivial) and found.errors[1] < 1e-6
    assert found.unstable == 0


@pytest.mark.parametrize(("mu", "period"), [(1.0, 6.6632868593), (1000.0, 1614.29)])
def test_motions_settle_by_an_explicit_method_and_by_others(mu, period):
    """SciPy integrates functions that are not recorded, and stiff ones. The period for 1000 is that of Dorodnitsyn."""

    def unrecorded(u, p):
        return van_der_pol(u, type(p)(float(str(float(p.mu)))))

    for field in (van_der_pol, unrecorded):
        problem = CycleProblem(field, ["x", "v"], {"mu": mu})
        given = orbits._field(problem, problem.parameters)
        done = motions.integrated(given, np.array([2.0, 0.0]), 3 * period, 1e-9)
        assert (motions.explicit(given, done.y[:, 0], 3 * period, 1e-9) is None) == (mu > 1 or field is unrecorded)
        first, second, *_ = motions.passages(done.t, lambda t, sol=done.sol: sol(t)[0] - 1.5)
        assert second - first == pytest.approx(period, rel=1e-4)


def test_from_a_hopf_point():
    """Brusselator, a = 1: the Hopf point at b = 1 + a**2 with frequency a. Its cycles are stable, and small near it."""
    equilibria = AlgebraicProblem(brusselator, ["x", "y"], {"a": 1.0, "b": 1.0})
    line = contin.trace(contin.solve(equilibria, [1, 1]), free=["b"], limits={"b": (0.5, 3)})
    (hopf,) = line.labelled("HB")
    cycles = contin.trace(hopf, branch=1, limits={"b": (1, 3)})
    first, last = cycles.points[0], cycles.points[-1]
    assert first["period"] == pytest.approx(2 * math.pi, abs=1e-9) and first["max_x"] == pytest.approx(
        first["min_x"], abs=1e-12
    )
    assert last["b"] == pytest.approx(3, abs=1e-12) and last["max_x"] > 3
    assert all(point.system.eigenvalues(point.x).real.max() < 1e-7 for point in cycles.points[1:])


@pytest.mark.full
def test_lorenz_from_its_hopf_point_to_its_homoclinic_orbit():
    """HB at r = 470/19 (closed form); the period runs away at r = 13.926557 (published)."""
    equilibria = AlgebraicProblem(lorenz, ["x", "y", "z"], {"r": 20.0})
    start = [math.sqrt(8 / 3 * 19), math.sqrt(8 / 3 * 19), 19.0]
    line = contin.trace(contin.solve(equilibria, start), free=["r"], limits={"r": (15, 30)})
    (hopf,) = line.labelled("HB")
    assert hopf["r"] == pytest.approx(470 / 19, abs=1e-10)
    cycles = contin.trace(hopf, branch=1, limits={"period": (0, 10), "r": (10, 30)})
    assert cycles.points[-1]["period"] == pytest.approx(10, abs=1e-9)
    assert cycles.points[-1]["r"] == pytest.approx(13.926557, abs=1e-6)


@pytest.mark.full
def test_a_doubling_of_lorenz(monkeypatch):
    """A cycle of large r, from an integration; AUTO-07p finds the doubling at r = 229.40670855.

    The multiplier -1 has the angle pi, but no partner: it is not located as a torus bifurcation, too.
    """
    monkeypatch.setattr(hopf, "_located", lambda *_: pytest.fail("a multiplier alone is no pair"))
    orbit = contin.cycle(CycleProblem(lorenz, ["x", "y", "z"], {"r": 260.0}), [1.0, 1.0, 200.0], settle=60, intervals=60)
    (doubling,) = contin.trace(orbit, free=["r"], direction=-1, limits={"r": (225, 300)}).labelled("PD")
    assert doubling["r"] == pytest.approx(229.40670855, abs=2e-8)


@pytest.mark.parametrize(
    ("statement", "words"),
    [
        (lambda: CycleProblem(lambda u, p: (u.x,), ["x", "y"], {}), "field returns 1 values for the 2 states x, y"),
        (lambda: CycleProblem(circle, ["x", "y"], {"mu": 0.1, "period": 1.0}), "period is a column of every cycle by itself"),
        (lambda: CycleProblem(lambda t, u, p: (u.x,), ["x"], {}), r"field: must be a function of \(u, p\)"),
        (lambda: contin.cycle(CycleProblem(circle, ["x", "y"], {"mu": -0.5}), [0.1, 0.0]), "comes to rest near"),
        (lambda: contin.cycle(CycleProblem(circle, ["x", "y"], {"mu": 0.5}), [0.1]), "must be 2 finite numbers"),
        (lambda: contin.cycle(CycleProblem(lambda u, p: (1.0 + 0 * u.x,), ["x"], {}), [0.0]), "does not come back"),
        (lambda: contin.solve(AlgebraicProblem(circle, ["x", "y"], {"mu": 0.5})).floquet(), "floquet: the point is no cycle"),
        (lambda: contin.solve(CycleProblem(circle, ["x", "y"], {"mu": 0.5}), [0.1, 0.0]), "goes round"),
    ],
)
def test_what_is_refused(statement, words):
    with pytest.raises(ProblemError, match=words):
        statement()


def test_a_branch_between_two_hopf_points_ends_at_the_second():
    """Growth mu (1 - mu) - r**2: Hopf points at 0 and 1. The first and the last point have no size and the period 2 pi."""

    def field(u, p):
        growth = p.mu * (1 - p.mu) - u.x**2 - u.y**2
        return growth * u.x - u.y - 0.3 * u.x * u.y, u.x + growth * u.y

    line = contin.solve(AlgebraicProblem(field, ["x", "y"], {"mu": -0.5}), [0, 0])
    first = contin.trace(line, free=["mu"], limits={"mu": (-0.5, 2)}).labelled("HB")[0]
    cycles = contin.trace(first, branch=1, limits={"mu": (-1, 2)})
    assert [point.label for point in cycles if point.label] == ["HB", "HB"] and cycles.stop.reason == "Hopf"
    end = cycles.points[-1]
    assert end["mu"] == pytest.approx(1, abs=1e-10) and end["period"] == pytest.approx(2 * math.pi, abs=1e-9)
    assert end["max_x"] - end["min_x"] < 1e-9


@pytest.mark.full
def test_a_torus_bifurcation():
    """The cycle r = 1 of r' = r - r**3 in a plane, and beside it w' = (mu + i a) w: multipliers exp(2 pi (mu +- i a))."""

    def field(u, p):
        square = u.x**2 + u.y**2
        damping = u.a**2 + u.b**2
        return (
            u.x - u.y - u.x * square, u.x + u.y - u.y * square,
            p.mu * u.a - 0.3 * u.b - u.a * damping, 0.3 * u.a + p.mu * u.b - u.b * damping,
        )  # fmt: skip

    problem = CycleProblem(field, ["x", "y", "a", "b"], {"mu": -0.2})
    orbit = contin.solve(
        problem, lambda t: (math.cos(2 * math.pi * t), math.sin(2 * math.pi * t), 0, 0), {"period": 6.0}, degree=6
    )
    branch = contin.trace(orbit, free=["mu"], limits={"mu": (-0.2, 0.2)})
    (torus,) = branch.labelled("TR")
    assert torus["mu"] == pytest.approx(0, abs=1e-10)
    assert torus.details["frequency"] == pytest.approx(2 * math.pi * 0.3, abs=1e-8)


def test_a_stored_branch_goes_on(tmp_path):
    problem = CycleProblem(bautin, ["x", "y"], {"mu": 1.0})
    orbit = contin.solve(problem, round_and_round(1.2), {"period": 6.0}, degree=6)
    branch = contin.trace(orbit, free=["mu"], limits={"mu": (0.5, 1.5)})
    contin.save(branch, tmp_path / "cycles.npz")
    last = contin.load(problem, tmp_path / "cycles.npz").points[-1]
    assert last["mu"] == branch.points[-1]["mu"] and last["max_x"] == branch.points[-1]["max_x"]
    further = contin.trace(last, limits={"mu": (0.5, 2)})
    assert further.points[-1]["period"] == pytest.approx(2 * math.pi, abs=1e-10)


@pytest.mark.full
def test_folds_of_cycles_in_two_parameters():
    """r' = mu r + a r**3 - r**5: the fold lies at mu = -a**2 / 4, and dmu/da there is -a / 2."""

    def field(u, p):
        s = u.x**2 + u.y**2
        growth = p.mu + p.a * s - s * s
        return growth * u.x - u.y, u.x + growth * u.y

    orbit = contin.solve(
        CycleProblem(field, ["x", "y"], {"mu": 0.5, "a": 1.0}), round_and_round(1.2), {"period": 6.0}, degree=6
    )
    (fold,) = contin.trace(orbit, free=["mu"], limits={"mu": (-1, 0.6), "max_x": (0.5, 2)}, direction=-1).labelled("LP")
    assert fold.sensitivities()["a"]["mu"] == pytest.approx(-0.5, abs=1e-9)
    for point in contin.curve(fold, "a", limits={"a": (0.5, 2)}):
        assert point["mu"] == pytest.approx(-(point["a"] ** 2) / 4, abs=1e-9)


def test_multipliers_are_computed_about_once_a_cycle(monkeypatch):
    """On the Lorenz cycles from 24.7 to 16 nothing happens: at each cycle, and once more where its mesh changes.

    That is every third step, and where the error of an accepted point asks for a finer one, which round-off may decide; and
    where a step that kernels have made is looked at. The first step takes six, to see that multipliers near -1 and on the
    circle stay close to those of the Hopf point, and is made again on a finer mesh.
    """
    calls = []

    def counted(kernel):
        def counting(*given):
            calls.append(kernel)
            return kernel(*given)

        return counting

    monkeypatch.setattr(cycles, "fill_multipliers", counted(cycles.fill_multipliers))
    monkeypatch.setattr(plain_on_mesh, "multipliers_ask", counted(plain_on_mesh.multipliers_ask))
    rest = contin.solve(AlgebraicProblem(lorenz, ["x", "y", "z"], {"r": 20.0}), [math.sqrt(8 / 3 * 19)] * 2 + [19.0])
    (hopf,) = contin.trace(rest, free=["r"], limits={"r": (19, 26)}).labelled("HB")
    branch = contin.trace(hopf, branch=1, limits={"r": (16, 25)}, errors=False)
    assert branch.points[-1].name == "r = 16" and not branch.labelled("PD") and not branch.labelled("TR")
    assert len(calls) - 2 * 6 < 4 * len(branch)


def test_one_multiplier_that_leaves_1_is_no_pair(monkeypatch):
    """Beside the Hopf point of the Lorenz equations it is 1 up to round-off, and outside the circle at the end of the step."""
    monkeypatch.setattr(floquet, "hopf_points", lambda *_: pytest.fail("a torus bifurcation is searched for"))
    rest = contin.solve(AlgebraicProblem(lorenz, ["x", "y", "z"], {"r": 24.0}), [math.sqrt(8 / 3 * 23)] * 2 + [23.0])
    (hopf,) = contin.trace(rest, free=["r"], limits={"r": (20, 26)}).labelled("HB")
    mesh, newton = MeshControl(min_intervals=27, max_intervals=27), contin.Newton(1e-8)
    branch = contin.trace(hopf, branch=1, limits={"r": (20, 25)}, mesh=mesh, newton=newton, errors=False)
    assert [point.label for point in branch if point.label] == ["HB", "EP"]
    assert branch[1].floquet().unstable == 1


def test_a_multiplier_that_has_drifted_from_1_needs_no_closer_look(monkeypatch):
    """On 70 intervals of degree 2 that of the Lorenz cycles is off by 4e-6; the others are far from the circle."""
    asked, kernel, mesh = [], plain_on_mesh.multipliers_ask, MeshControl(min_intervals=70, max_intervals=70)
    monkeypatch.setattr(plain_on_mesh, "multipliers_ask", lambda *given: asked.append(kernel(*given)) or asked[-1])
    rest = contin.solve(AlgebraicProblem(lorenz, ["x", "y", "z"], {"r": 24.0}), [math.sqrt(8 / 3 * 23)] * 2 + [23.0])
    (hopf,) = contin.trace(rest, free=["r"], limits={"r": (20, 26)}).labelled("HB")
    start = contin.trace(hopf, branch=1, limits={"r": (15, 25)}, max_points=10, errors=False)[-1]
    orbit = contin.solve(start.system.problem, start, degree=2, intervals=70, mesh=mesh)
    asked.clear()
    contin.trace(orbit, free=["r"], step=0.05, max_step=0.05, max_points=20, mesh=mesh, errors=False)
    assert orbit.system.is_drifted(orbit.x)
    assert len(asked) > 20 and plain_on_mesh.ASK not in asked


def test_a_branch_that_begins_at_a_hopf_point_is_read_back(tmp_path):
    """Its first point is a cycle without a size; from there, and from others, the branch is followed again."""

    def circle(u, p):
        square = u.x**2 + u.y**2
        return p.mu * u.x - u.y - u.x * square, u.x + p.mu * u.y - u.y * square

    rest = contin.solve(contin.AlgebraicProblem(circle, ["x", "y"], {"mu": -0.5}), [0.0, 0.0])
    (hopf,) = contin.trace(rest, free=["mu"], limits={"mu": (-1, 1)}).labelled("HB")
    branch = contin.trace(hopf, branch=1, limits={"mu": (-1, 0.5)})
    contin.save(branch, tmp_path / "cycles.npz")
    again = contin.load(branch.points[0].system.problem, tmp_path / "cycles.npz")
    assert [point.label for point in again] == [point.label for point in branch]
    further = contin.trace(again.points[-1], limits={"mu": (-1, 1)})
    assert further.points[-1]["max_x"] == pytest.approx(1, abs=1e-9)


def lorenz_84(u, p):
    return -(u.y**2) - u.z**2 - (u.x - p.F) / 4, u.x * u.y - 4 * u.x * u.z - u.y + 0.25, 4 * u.x * u.y + u.x * u.z - u.z


@pytest.mark.sample(1)
@pytest.mark.parametrize("errors", [True, False])
def test_cycles_that_outgrow_the_sizes_of_their_hopf_point(errors):
    """There y is 2e-4; on the cycles it is of order one. The doubling by shooting (DOP853, det(M + I) = 0)."""
    equilibria = AlgebraicProblem(lorenz_84, ["x", "y", "z"], {"F": 0.0})
    line = contin.trace(contin.solve(equilibria, [0.0, 0.25, 0.0]), free=["F"], limits={"F": (0, 2)})
    cycles = contin.trace(line.labelled("HB")[0], branch=1, errors=errors, limits={"F": (1, 8.5)})
    (doubling,) = cycles.labelled("PD")
    assert doubling["F"] == pytest.approx(8.157983671848, abs=5e-11)
    assert all("round-off" in note for note in cycles.notes)
    assert np.all(cycles[-2].system.scales.states >= 0.01)  # not 2e-4
    assert not errors or doubling.errors["F"] < 1e-10


def catalytic(u, p):
    z = 1 - u.x - u.y - u.s
    return 5 * z**2 - 2 * u.x**2 - 10 * u.x * u.y, p.q * z - 0.1 * u.y - 10 * u.x * u.y, 0.0675 * (z - 0.4 * u.s)


@pytest.mark.full
def test_cycles_whose_period_changes_fast_beside_hopf_points():
    """The catalytic oscillator of MatCont's manual: both Hopf points of the equilibria are the ends of one branch of cycles."""
    equilibria = AlgebraicProblem(catalytic, ["x", "y", "s"], {"q": 0.5})
    line = contin.trace(contin.solve(equilibria, [0.238, 0.0415, 0.515]), free=["q"], limits={"q": (0.5, 1.5)})
    first, last = line.labelled("HB")
    cycles = contin.trace(first, branch=1, limits={"q": (0.5, 1.5)}, max_points=250)
    end = cycles[-1]
    assert end.label == "HB" and end["q"] == pytest.approx(last["q"], abs=1e-12)
    assert end["period"] == pytest.approx(2 * math.pi / last.details["frequency"], rel=1e-11)
    assert [fold["q"] for fold in cycles.labelled("LP")] == pytest.approx([1.039162965369, 1.053610280788], abs=1e-11)
    assert not cycles.notes


def test_a_parameter_of_an_autonomous_field_may_be_called_rounds():
    """Only forced cycles have a number of rounds. The cycle is a circle of the radius sqrt(rounds) with the period 2 pi."""

    def field(u, p):
        growth = p.rounds - u.x**2 - u.y**2
        return growth * u.x - u.y, u.x + growth * u.y

    guess = lambda t: (0.6 * math.cos(2 * math.pi * t), 0.6 * math.sin(2 * math.pi * t))  # noqa: E731
    orbit = contin.solve(CycleProblem(field, ["x", "y"], {"rounds": 0.25}), guess, {"period": 6})
    assert (orbit["max_x"], orbit["period"]) == (pytest.approx(0.5, abs=1e-10), pytest.approx(2 * math.pi, abs=1e-10))
