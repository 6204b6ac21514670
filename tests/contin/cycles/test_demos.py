"""AUTO-07p's demos with cycles, stated as a newcomer would: every label in order, none missed, none invented, and the values.

The last number of a test bounds the distance of the multiplier 1 from 1. Long orbits near homoclinic ones lose digits: the
number is about round-off times the largest multiplier's root.
"""

import functools
import math

import pytest
from cycles.noted import NOTES, check_unstable, compare, worst_trivial

import contin
from contin import AlgebraicProblem, CycleProblem


def ab(u, p):
    rate = math.exp(u.y)
    return -u.x + p.p1 * (1 - u.x) * rate, -u.y + p.p1 * p.p2 * (1 - u.x) * rate - 3 * u.y


def abc(u, p):
    rate = p.d * math.exp(u.z)
    return (
        -u.x + rate * (1 - u.x), -u.y + rate * (1 - u.x - 0.04 * u.y),
        -u.z - 1.55 * u.z + 8 * rate * (1 - u.x + 0.04 * u.y),
    )  # fmt: skip


def lorenz(u, p):
    return 10 * (u.y - u.x), p.rho * u.x - u.y - u.x * u.z, u.x * u.y - 8 / 3 * u.z


def pp2(u, p):
    return 3 * u.x * (1 - u.x) - u.x * u.y - p.p1 * (1 - math.exp(-5 * u.x)), -u.y + 3 * u.x * u.y


def pp3(u, p):
    return (
        u.x * (1 - u.x) - 4 * u.x * u.y,
        -u.y / 4 + 4 * u.x * u.y - 3 * u.y * u.z - p.p1 * (1 - math.exp(-5 * u.y)),
        -u.z / 2 + 3 * u.y * u.z,
    )


def ppp(u, p):
    return (
        u.x * (1 - u.x) - 3 * u.x * u.y,
        -u.y / 4 + 3 * u.x * u.y - 3 * u.y * u.z - p.p1 * (1 - math.exp(-5 * u.y)),
        -u.z / 2 + 3 * u.y * u.z,
    )


def tor(u, p):
    apart = u.y - u.x
    return (
        (-(0.5 + p.rn) * u.x + 0.5 * u.y - 0.328578 * u.x**3 + 0.933578 * apart**3) / 0.6,
        0.5 * u.x + 0.1 * u.y - u.z - 0.933578 * apart**3,
        u.y,
    )


def plp(u, p):
    rate = p.rho * u.x * u.y / (1 + u.x + 0.1 * u.x**2)
    return 110 - u.x - rate, 0.2 * (500 - u.y) - rate


def square2(u, p):
    return u.x**2 + u.y**2


def square3(u, p):
    return u.x**2 + u.y**2 + u.z**2


@functools.cache
def hopf_points(field, parameter, value, guess, limits, p2=0.0):
    """The Hopf points on the branch of equilibria through a guess."""
    states = ["x", "y", "z"][: len(guess)]
    functionals = {"square": square2 if len(guess) == 2 else square3}
    problem = AlgebraicProblem(field, states, {parameter: value, "p2": p2}, functionals=functionals)
    branch = contin.trace(contin.solve(problem, guess), free=[parameter], limits={parameter: limits})
    return branch.labelled("HB")


SIDE = math.sqrt(8 / 3 * 19)
#: Study, run, the equilibria with its Hopf points, which of those, limits of the cycles, whether they shrink onto the next Hopf
#: point, and a bound of the multiplier 1.
FAMILIES = [
    ("ab 14", "cycles", (ab, "p1", 0.0, (0.0, 0.0), (0, 0.35), 14.0), 0, (0.01, 0.35, 30), True, 1e-9),
    ("ab 18", "cycles", (ab, "p1", 0.0, (0.0, 0.0), (0, 0.35), 18.0), 0, (0.01, 0.35, 30), False, 1e-7),
    ("abc", "cycles 1", (abc, "d", 0.0, (0.0, 0.0, 0.0), (0, 0.4)), 0, (0.1, 0.4, 30), True, 1e-9),
    ("abc", "cycles 4", (abc, "d", 0.0, (0.0, 0.0, 0.0), (0, 0.4)), 3, (0.1, 0.4, 30), True, 1e-9),
    ("lrz", "cycles", (lorenz, "rho", 20.0, (SIDE, SIDE, 19.0), (15, 30)), 0, (10, 30, 4), False, 1e-8),
    ("pp2", "cycles", (pp2, "p1", 0.5, (1 / 3, 0.78331), (0.1, 0.8)), 0, (0.1, 0.9, 36), False, 1e-9),
    ("pp3", "cycles", (pp3, "p1", 0.0, (1 / 3, 1 / 6, 13 / 36), (-0.1, 1)), 0, (-0.1, 1, 60), True, 1e-9),
    ("ppp", "cycles", (ppp, "p1", 0.0, (1 / 12, 11 / 36, 0.0), (0, 0.36)), 0, (-0.1, 0.6, 60), True, 1e-9),
    ("plp", "cycles 1", (plp, "rho", 2.021628, (45.55974, 177.7987), (1, 6)), 0, (1, 6, 30), True, 1e-9),
    ("plp", "cycles 2", (plp, "rho", 2.021628, (45.55974, 177.7987), (1, 6)), 1, (1, 6, 30), True, 1e-9),
]  # fmt: skip


@pytest.mark.full
@pytest.mark.parametrize(("study", "run", "equilibria", "which", "limits", "shrinks", "bound"), FAMILIES)
def test_families_from_hopf_points(study, run, equilibria, which, limits, shrinks, bound):
    parameter, (low, high, longest) = equilibria[1], limits
    points = hopf_points(*equilibria)
    branch = contin.trace(points[which], branch=1, limits={parameter: (low, high), "period": (0, longest)})
    compare(branch, study, run, (parameter, "period", "square"), shrinks=shrinks)
    check_unstable(branch)
    assert worst_trivial(branch) < bound
    if shrinks:
        end = branch.points[-1]
        others = [point for place, point in enumerate(points) if place != which]
        assert min(abs(end[parameter] - point[parameter]) for point in others) < 1e-10


@pytest.mark.full
def test_the_middle_family_of_abc():
    """Between the second and third Hopf point, from both ends. AUTO-07p turns back at the fold and ends where it began."""
    points = hopf_points(abc, "d", 0.0, (0.0, 0.0, 0.0), (0, 0.4))
    for first, last in ((1, 2), (2, 1)):
        branch = contin.trace(points[first], branch=1, limits={"d": (0.1, 0.4), "period": (0, 30)})
        assert [point.label for point in branch if point.label] == ["HB", "LP", "HB"]
        assert branch.points[-1]["d"] == pytest.approx(points[last]["d"], abs=1e-10)
        assert branch.labelled("LP")[0]["d"] == pytest.approx(0.22496206554, abs=1e-8)  # AUTO-07p, "abc", "cycles 2"
        check_unstable(branch)
        assert worst_trivial(branch) < 1e-9


@pytest.mark.full
def test_the_isola_of_plp():
    """At S0 = 111 the cycles have parted from both Hopf points: their branch closes, at another phase than it began."""

    def isola(u, p):
        rate = p.rho * u.x * u.y / (1 + u.x + 0.1 * u.x**2)
        return 111 - u.x - rate, 0.2 * (500 - u.y) - rate

    problem = CycleProblem(isola, ["x", "y"], {"rho": 4.0}, functionals={"square": square2})
    branch = contin.trace(contin.cycle(problem, [5.0, 50.0], settle=300), free=["rho"], limits={"rho": (1, 8)})
    assert [point.label for point in branch if point.label] == ["EP", "LP", "LP", "EP"] and branch.stop.reason == "closed"
    for point, way in zip(branch.labelled("LP"), ("up", "down")):
        (known,) = NOTES["plp isola"][way]
        assert (known["label"], point["rho"]) == ("LP", pytest.approx(known["parameter"], abs=1e-8))
        assert point["square"] == pytest.approx(known["square"], rel=1e-8)
    assert branch.points[-1]["square"] == pytest.approx(branch.points[0]["square"], rel=1e-9)
    check_unstable(branch)
    assert worst_trivial(branch) < 1e-9


def test_a_closed_branch_in_closed_form():
    """Growth 1/4 - mu^2 - (s - 1)^2, s the squared distance from (.3 mu, .2 mu): a circle in mu and s, folds at mu = +-1/2."""

    def field(u, p):
        x, y = u.x - 0.3 * p.mu, u.y - 0.2 * p.mu
        s = x * x + y * y
        growth, turn = 0.25 - (s - 1) ** 2 - p.mu**2, 1 + 0.3 * x + 0.2 * y * p.mu
        return growth * x - turn * y, turn * x + growth * y

    orbit = contin.cycle(CycleProblem(field, ["x", "y"], {"mu": 0.0}), [1.2, 0.0])
    branch = contin.trace(orbit, free=["mu"], limits={"mu": (-1, 1)})
    assert branch.stop.reason == "closed"
    assert [point["mu"] for point in branch.labelled("LP")] == pytest.approx([0.5, -0.5], abs=1e-11)
    assert [point["max_x"] for point in branch.labelled("LP")] == pytest.approx([1.15, 0.85], abs=1e-6)


@pytest.mark.full
def test_lor():
    """An asymmetric cycle at rho = 280 doubles at rho = 229.4 and again at 218.2."""
    problem = CycleProblem(lorenz, ["x", "y", "z"], {"rho": 280.0}, functionals={"square": square3})
    orbit = contin.cycle(problem, [-4.0674614, -24.183805, 219.00338])
    branch = contin.trace(orbit, free=["rho"], direction=-1, limits={"rho": (200, 400)})
    compare(branch, "lor", "first", ("rho", "period", "square"))
    doubled = contin.trace(branch.labelled("PD")[0], branch=1, limits={"rho": (200, 400)})
    compare(doubled, "lor", "double", ("rho", "period", "square"))
    for each in (branch, doubled):
        check_unstable(each)
        assert worst_trivial(each) < 1e-9


@pytest.mark.full
def test_tor():
    """A branch of symmetric cycles, and the one that leaves it where the symmetry breaks, to the period 30.

    AUTO-07p finds some of these at tolerances where periods are good to six digits only: parameters are compared. It passes a
    branch point that lies beside a fold, and all period doublings after the first.
    """
    (hopf,) = hopf_points(tor, "rn", -0.9, (0.0, 0.0, 0.0), (-0.91, -0.4))
    limits = {"rn": (-0.91, -0.4), "period": (0, 30)}
    branch = contin.trace(hopf, branch=1, limits=limits)
    compare(branch, "tor", "cycles", ("rn", None, None), beyond=(4,))
    beside = contin.trace(branch.labelled("BP")[0], branch=1, limits=limits)
    compare(beside, "tor", "beside", ("rn", None, None), beyond=(2, 5, 6, 9))
    assert [point.label for point in beside.points[1:] if point.label] == [
        "TR", "PD", "PD", "LP", "LP", "PD", "PD", "LP", "LP", "PD", "EP",
    ]  # fmt: skip
    for each in (branch, beside):
        check_unstable(each)
        assert worst_trivial(each) < 1e-6


@pytest.mark.full
def test_folds_beside_branch_points_of_tor():
    """Fold and branch point come closer by a factor of about 4 in the period each time: all are told apart to the period 55."""
    (hopf,) = hopf_points(tor, "rn", -0.9, (0.0, 0.0, 0.0), (-0.91, -0.4))
    branch = contin.trace(hopf, branch=1, limits={"rn": (-0.91, -0.4), "period": (0, 55)})
    found = [point for point in branch if point.label in ("LP", "BP")][2:]
    assert sorted(point.label for point in found) == ["BP"] * 4 + ["LP"] * 4
    gaps = [abs(one["period"] - other["period"]) for one, other in zip(found[::2], found[1::2])]
    assert all(3 < before / after < 5 for before, after in zip(gaps, gaps[1:]))


@pytest.mark.full
def test_the_tail_of_tor_ends_at_a_homoclinic_orbit():
    """Without a limit of the period: folds and period doublings follow each other ever faster, to an equilibrium beside."""
    (hopf,) = hopf_points(tor, "rn", -0.9, (0.0, 0.0, 0.0), (-0.91, -0.4))
    branch = contin.trace(hopf, branch=1, limits={"rn": (-0.91, -0.4), "period": (0, 9)})
    tail = contin.trace(branch.labelled("BP")[0], branch=1, limits={"rn": (-0.91, -0.4)})
    assert str(tail.stop).startswith(
        "met homoclinic orbit; the cycle spends 8"
    ) and "of its time near the equilibrium x = " in str(tail.stop)
    assert len(tail) < 200 and tail.points[-1]["period"] < 200
