"""Curves of period doublings and of torus bifurcations in two parameters, against closed forms and AUTO-07p."""

import functools
import math
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.special import mathieu_a, mathieu_b

import contin
from contin import CycleProblem


def roessler(u, p):
    return -u.y - u.z, u.x + p.a * u.y, 0.2 + u.z * (u.x - p.c)


def mathieu(u, p):
    """The circle r = 1 with the period 2 pi drives x'' - 2 mu x' + (k + e cos t) x = 0."""
    s = u.x**2 + u.y**2
    return u.x - u.y - u.x * s, u.x + u.y - u.y * s, u.b, -(p.k + p.e * u.x) * u.a + 2 * p.mu * u.b


@functools.cache
def driven(**parameters):
    problem = CycleProblem(mathieu, ["x", "y", "a", "b"], {"mu": -0.1, "k": 0.1, "e": 0.1, **parameters})
    return contin.solve(
        problem, lambda t: (math.cos(2 * math.pi * t), math.sin(2 * math.pi * t), 0, 0), {"period": 6.0}, degree=7
    )


def edges(e):
    """Where a multiplier of x'' + (k + e cos t) x = 0 is 1 (the lowest k), and where one is -1 (the next two)."""
    return mathieu_a(0, 2 * e) / 4, mathieu_b(1, 2 * e) / 4, mathieu_a(1, 2 * e) / 4


def labels(branch):
    return [point.label for point in branch if point.label]


@pytest.mark.full
def test_doublings_of_roessler():
    """AUTO-07p (ISW=2, NTST=200, NCOL=5, EPSL=EPSU=1e-8) prints these c and periods at a = .1 and a = .35."""
    orbit = contin.cycle(CycleProblem(roessler, ["x", "y", "z"], {"c": 2.0, "a": 0.2}), [1.0, 1.0, 0.0])
    (doubling,) = contin.trace(orbit, free=["c"], limits={"c": (1.5, 3)}).labelled("PD")
    known = {-1: (0.1, 6.37577730345, 6.07426398015), 1: (0.35, 1.89042115041, 5.23439264921)}
    for direction, (a, c, period) in known.items():
        found = contin.curve(doubling, free=["c", "a"], direction=direction, limits={"a": (0.1, 0.35)})
        end = found.points[-1]
        assert labels(found) == ["EP", "EP"] and end["a"] == pytest.approx(a, abs=1e-12)
        assert (end["c"], end["period"]) == pytest.approx((c, period), abs=1e-10)
        for point in found:
            exponents = point.system.base.eigenvalues(point.x)
            assert np.abs(np.abs(exponents.imag) - math.pi + np.abs(exponents.real) * 1j).min() < 1e-9


@pytest.mark.full
def test_a_curve_of_tori_passes_all_strong_resonances():
    """On mu = 0 the pair lies on the circle between the edges of Mathieu's equation, which are the resonances 1:1 and 1:2."""
    (torus,) = contin.trace(driven(), free=["mu"], limits={"mu": (-0.1, 0.1)}).labelled("TR")
    lowest, second, _ = edges(0.1)
    for direction, expected, k in ((1, ["EP", "R3", "R2"], second), (-1, ["EP", "R4", "R1"], lowest)):
        found = contin.curve(torus, "k", direction=direction, limits={"k": (-1, 1)})
        end = found.points[-1]
        assert labels(found) == expected and end["k"] == pytest.approx(k, abs=1e-12)
        for point in found.points[:-1]:
            assert point["mu"] == pytest.approx(0, abs=1e-11)
            exponents = point.system.base.eigenvalues(point.x[:-1])
            assert np.abs(exponents - 1j * point["angle"]).min() < 1e-7
    angles = {"R3": 2 * math.pi / 3, "R4": math.pi / 2, "R1": 0.0}
    assert end["angle"] == pytest.approx(0, abs=1e-6)
    for point in found:
        if point.label in angles:
            assert point["angle"] == pytest.approx(angles[point.label], abs=1e-6)


def test_a_curve_of_doublings_passes_a_resonance():
    """With the product of both multipliers exp(4 pi mu), a second one is -1 at mu = 0, on an edge of Mathieu's equation."""
    start = driven(mu=-0.02, e=0.4)
    doubling = contin.trace(start, free=["k"], direction=-1, limits={"k": (-0.1, 0.2)}).labelled("PD")[0]
    found = contin.curve(doubling, free=["k", "mu"], limits={"mu": (-0.05, 0.05)})
    (resonance,) = found.labelled("R2")
    assert resonance["mu"] == pytest.approx(0, abs=1e-9)
    assert min(abs(resonance["k"] - edge) for edge in edges(0.4)) < 1e-9


def fold_and_flip(u, p):
    """r' = mu r + r**3 - r**5 has a fold at mu = -1/4; beside it p' = nu p - p**3 in a direction that turns by pi."""
    square = u.x**2 + u.y**2
    x, y = u.x / math.sqrt(square), u.y / math.sqrt(square)
    part = ((u.a**2 - u.b**2) * x + 2 * u.a * u.b * y + u.a**2 + u.b**2) / 2
    a, b = x * u.a + y * u.b, y * u.a - x * u.b
    growth, turn = p.mu + square - square**2, 1 + 0.3 * (square - 0.5)
    both, other = (p.nu - 1) / 2, (p.nu + 1) / 2
    return (
        growth * u.x - turn * u.y, turn * u.x + growth * u.y, -turn * u.b / 2 + both * u.a + other * a - part * (u.a + a) / 2,
        turn * u.a / 2 + both * u.b + other * b - part * (u.b + b) / 2,
    )  # fmt: skip


@pytest.mark.full
def test_a_fold_flip_lies_on_both_curves():
    """Folds at mu = -1/4, doublings at nu = 0."""
    problem = CycleProblem(fold_and_flip, ["x", "y", "a", "b"], {"mu": 0.3, "nu": -0.1})
    orbit = contin.solve(
        problem, lambda t: (1.1 * math.cos(2 * math.pi * t), 1.1 * math.sin(2 * math.pi * t), 0, 0), {"period": 6.0}, degree=6
    )
    limits = {"mu": (-0.5, 0.5), "nu": (-0.3, 0.3), "max_x": (0.5, 2)}
    (fold,) = contin.trace(orbit, free=["mu"], direction=-1, limits=limits).labelled("LP")
    (doubling,) = contin.trace(orbit, free=["nu"], limits=limits).labelled("PD")
    folds = contin.curve(fold, free=["mu", "nu"], limits=limits)
    doublings = contin.curve(doubling, free=["nu", "mu"], direction=-1, limits=limits)
    assert labels(folds) == ["EP", "LPPD", "EP"] and labels(doublings) == ["EP", "LP", "LPPD", "EP"]
    for point in (*folds.labelled("LPPD"), *doublings.labelled("LPPD")):
        assert (point["mu"], point["nu"]) == pytest.approx((-0.25, 0), abs=1e-9)


def driven_takens(u, p):
    """Bogdanov and Takens's normal form, driven by the cycle r = 1."""
    s = u.x**2 + u.y**2
    return u.x - u.y - u.x * s, u.x + u.y - u.y * s, u.b, p.k - u.a**2 + p.n * u.b + u.a * u.b + 0.1 * u.x * u.a


def langford(u, p):
    """In cylindrical coordinates r' = (z - b) r, theta' = 3.5, z' = lam + z - z**3 / 3 - r**2 (1 + z / 4)."""
    square, growth = u.x**2 + u.y**2, u.z - p.b
    return growth * u.x - 3.5 * u.y, 3.5 * u.x + growth * u.y, p.lam + u.z - u.z**3 / 3 - square * (1 + u.z / 4)


def meridian(u, p):
    return (u.z - p.b) * u.r, p.lam + u.z - u.z**3 / 3 - u.r**2 * (1 + u.z / 4)


@pytest.mark.full
def test_tori_of_langford():
    """Tori are cycles of r and z: Hopf points at r**2 = 4 (1 - b**2), z = b, with the same frequency and l1.

    There lam = r**2 (1 + b / 4) - b + b**3 / 3, the determinant is 2 r**2 (1 + b / 4), and Re d is l1 times the frequency.
    """
    radius = math.sqrt(4 * 0.51)
    problem = CycleProblem(langford, ["x", "y", "z"], {"lam": 1.7, "b": 0.7})
    guess = lambda t: (radius * math.cos(2 * math.pi * t), radius * math.sin(2 * math.pi * t), 0.7)  # noqa: E731
    orbit = contin.solve(problem, guess, {"period": 2 * math.pi / 3.5}, degree=6)
    (torus,) = contin.trace(orbit, free=["lam"], limits={"lam": (1.5, 2)}).labelled("TR")
    found = contin.curve(torus, free=["lam", "b"], direction=1, limits={"b": (0.5, 0.9)})
    for point in found:
        b = point["b"]
        square = 4 * (1 - b * b)
        assert point["lam"] == pytest.approx(square * (1 + b / 4) - b + b**3 / 3, abs=1e-9)
        assert math.cos(point["angle"]) == pytest.approx(
            math.cos(math.sqrt(2 * square * (1 + b / 4)) * 2 * math.pi / 3.5), abs=1e-9
        )
    rest = contin.solve(contin.AlgebraicProblem(meridian, ["r", "z"], {"lam": 1.7, "b": 0.7}), [radius, 0.7])
    (hopf,) = contin.trace(rest, free=["lam"], limits={"lam": (1.5, 2)}).labelled("HB")
    assert torus["lam"] == pytest.approx(hopf["lam"], abs=1e-10)
    assert torus.normal_form == pytest.approx(hopf.normal_form * hopf.details["frequency"], rel=1e-8)


@pytest.mark.full
def test_a_resonance_lies_on_the_curves_of_folds_and_of_tori():
    """Both curves are followed by equations of their own; no closed form."""
    problem = CycleProblem(driven_takens, ["x", "y", "a", "b"], {"k": 0.5, "n": -0.6})
    guess = lambda t: (math.cos(2 * math.pi * t), math.sin(2 * math.pi * t), math.sqrt(0.5), 0)  # noqa: E731
    orbit = contin.solve(problem, guess, {"period": 6.0}, degree=6)
    branch = contin.trace(orbit, free=["k"], direction=-1, limits={"k": (0.35, 1)})
    limits = {"k": (0.35, 1), "n": (-1, 0)}
    tori = contin.curve(branch.labelled("TR")[0], free=["k", "n"], limits=limits)
    folds = contin.curve(branch.labelled("LP")[0], free=["k", "n"], limits=limits)
    end, passed = tori.points[-1], folds.labelled("R1")[0]
    assert end.label == "R1" and tori.stop.message == "met resonance 1:1"
    assert (end["k"], end["n"], end["period"]) == pytest.approx((passed["k"], passed["n"], 2 * math.pi), abs=1e-9)


def test_a_curve_of_folds_ends_at_a_generalized_hopf_point():
    """Folds of r' = mu r + a r**3 - r**5 at mu = -a**2 / 4, r**2 = a / 2, for a > 0; the curve ends near 0."""

    def field(u, p):
        s = u.x**2 + u.y**2
        growth = p.mu + p.a * s - s * s
        return growth * u.x - u.y, u.x + growth * u.y

    guess = lambda t: (1.2 * math.cos(2 * math.pi * t), 1.2 * math.sin(2 * math.pi * t))  # noqa: E731
    orbit = contin.solve(CycleProblem(field, ["x", "y"], {"mu": 0.5, "a": 1.0}), guess, {"period": 6.0}, degree=6)
    (fold,) = contin.trace(orbit, free=["mu"], limits={"mu": (-1, 0.6), "max_x": (0.5, 2)}, direction=-1).labelled("LP")
    found = contin.curve(fold, "a", direction=-1, limits={"a": (-1, 2)})
    end = found.points[-1]
    assert (
        labels(found) == ["EP", "EP"] and found.stop.message == "met the end, near a Hopf point where the cycles have no size"
    )
    assert (end["mu"], end["max_x"] ** 2) == pytest.approx((-(end["a"] ** 2) / 4, end["a"] / 2), abs=1e-9)
    assert 0 < end["a"] < 1e-3


def test_a_stored_torus_bifurcation_starts_a_curve(tmp_path):
    branch = contin.trace(driven(), free=["mu"], limits={"mu": (-0.1, 0.1)})
    contin.save(branch, tmp_path / "cycles.npz")
    (loaded,) = contin.load(branch.points[0].system.problem, tmp_path / "cycles.npz").labelled("TR")
    found = contin.curve(loaded, "e", limits={"e": (0.0, 0.15)})
    assert found.points[-1]["e"] == pytest.approx(0.15, abs=1e-12) and abs(found.points[-1]["mu"]) < 1e-10


def test_what_is_refused():
    with pytest.raises(contin.ProblemError, match="labelled 'EP' must be one of LP, BP"):
        contin.curve(contin.trace(driven(), free=["mu"], limits={"mu": (-0.1, 0.1)}).points[0], "k")


def circuit(u, p):
    """The oscillator of Freire, Rodriguez-Luis, Gamero & Ponce (1993), with the numbers of AUTO's demo ``tor``."""
    d = u.y - u.x
    return (
        (-(p.be + p.nu) * u.x + p.be * u.y - 0.328578 * u.x**3 + 0.933578 * d**3) / 0.6,
        p.be * u.x - (p.be - 0.6) * u.y - u.z - 0.933578 * d**3,
        u.y,
    )


@pytest.mark.full
def test_a_curve_of_doublings_does_not_slide_onto_an_equilibrium():
    """An equilibrium solves the equations of the curve, too, with a period of half a round: not a point of it is one.

    The curve that leaves the first doubling of ``tor`` turns at be = .767089 with cycles of the size .036, where a step used to
    end with a size of 1e-14. Doublings on AUTO's branch: nu = -.614955.
    """
    problem = contin.AlgebraicProblem(circuit, ["x", "y", "z"], {"nu": -0.9, "be": 0.5})
    rest = contin.trace(contin.solve(problem, [0, 0, 0]), free=["nu"], limits={"nu": (-0.95, -0.55)})
    limits = {"nu": (-0.62, -0.5), "period": (0, 10)}
    single = contin.trace(rest.labelled("HB")[0], branch=1, limits=limits, max_points=60)
    beside = contin.trace(single.labelled("BP")[0], branch=1, limits=limits, max_points=40)
    (doubling,) = beside.labelled("PD")
    assert doubling["nu"] == pytest.approx(-0.614955, abs=1e-6)
    found = contin.curve(doubling, "be", limits={"be": (0.4, 1.5)}, newton=contin.Newton(tolerance=1e-9), max_points=60)
    assert found.labelled("LP")[0]["be"] == pytest.approx(0.767089, abs=1e-6)
    for point in found:
        assert point["max_x"] - point["min_x"] > 0.03


@pytest.mark.full
def test_a_curve_of_doublings_does_not_go_back_on_itself():
    """Beside its corner at the period 58.47 both arms of the same curve lie close together, and a step led to the other arm.

    From there the curve led back to where it came from. Here it ends elsewhere: nu is another one at the same be = .6, with the
    multiplier -1 there by integration over a round.
    """
    problem = contin.AlgebraicProblem(circuit, ["x", "y", "z"], {"nu": -0.9, "be": 0.5})
    rest = contin.trace(contin.solve(problem, [0, 0, 0]), free=["nu"], limits={"nu": (-0.95, -0.55)})
    limits = {"nu": (-0.62, -0.5), "period": (0, 20)}
    single = contin.trace(rest.labelled("HB")[0], branch=1, limits=limits, max_points=60)
    (doubling,) = contin.trace(single.labelled("BP")[0], branch=1, limits=limits, max_points=60).labelled("PD")
    found = contin.curve(doubling, "be", limits={"be": (0.49, 1.5)}, zeros={"be": [0.6]})
    there, back = found.labelled("UZ")
    assert len(found.labelled("LP")) == 1 and there["nu"] - back["nu"] > 0.05
    for point in (there, back):
        monodromy = integrated(point)
        assert np.abs(np.linalg.eigvals(monodromy) + 1).min() < 1e-5


def integrated(point):
    """The monodromy matrix of a cycle of `circuit`, by SciPy's integrator and complex steps."""
    start = point.system.base.evaluate(point.x, np.array([0.0]))[0, :3]
    numbers = SimpleNamespace(nu=point["nu"], be=point["be"])
    columns = []
    for k in range(3):
        first = start.astype(complex)
        first[k] += 1e-30j
        orbit = solve_ivp(
            lambda t, u: circuit(SimpleNamespace(x=u[0], y=u[1], z=u[2]), numbers), (0, point["period"]), first,
            method="DOP853", rtol=1e-12, atol=1e-12,
        )  # fmt: skip
        columns.append(orbit.y[:, -1].imag / 1e-30)
    return np.transpose(columns)


@pytest.mark.full
def test_multipliers_on_curves():
    """On a curve of period doublings one is -1, of torus bifurcations a pair has the column's angle; at a given period none."""
    problem = CycleProblem(
        lambda u, p: (-u.y - u.z, u.x + p.a * u.y, 0.2 + u.z * (u.x - p.c)), ["x", "y", "z"], {"a": 0.2, "c": 2.0}
    )
    single = contin.trace(contin.cycle(problem, [1.0, 1.0, 0.0]), free=["c"], limits={"c": (1.5, 3)}, zeros={"period": [5.72]})
    doublings = contin.curve(single.labelled("PD")[0], "a", limits={"a": (0.18, 0.22)})
    for point in doublings:
        found = point.floquet()
        assert np.abs(np.exp(found.logarithms) + 1).min() < 1e-10 and found.unstable == 0
        assert (found.errors < 1e-8).all()
    (torus,) = contin.trace(driven(), free=["mu"], limits={"mu": (-0.1, 0.1)}).labelled("TR")
    for point in contin.curve(torus, "k", limits={"k": (torus["k"] - 0.01, torus["k"] + 0.01)}):
        found = point.floquet()
        assert np.abs(found.logarithms - 1j * point["angle"]).min() < 1e-9
    held = contin.curve(single.labelled("UZ")[0], "a", limits={"a": (0.19, 0.21)})
    for point in held:
        assert point["period"] == pytest.approx(5.72, abs=1e-11)
        total = point.floquet().logarithms.sum().real  # by Liouville's formula, with the mean of x by the trapezoidal rule
        x = point.system.base.evaluate(point.x, np.linspace(0, 1, 4001)[:-1])[:, 0]
        assert total == pytest.approx(point["period"] * (point["a"] + x.mean() - point["c"]), abs=1e-8)
