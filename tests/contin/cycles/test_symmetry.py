"""Declared symmetries of cycles, u(t + T/n) = S u(t): against the same cycles computed as a whole."""

import math

import numpy as np
import pytest
from matplotlib.figure import Figure

import contin
from contin import CycleProblem, ProblemError


def van_der_pol(u, p):
    return u.y, p.mu * (1 - u.x**2) * u.y - u.x


def lorenz(u, p):
    return 10 * (u.y - u.x), p.r * u.x - u.y - u.x * u.z, u.x * u.y - 8 / 3 * u.z


def ring(u, p):
    """Three van der Pol oscillators, each coupled to the next one."""

    def rate(x, v, behind):
        return (p.a - x**2) * v - x + p.k * (behind - x)

    return u.v1, rate(u.x1, u.v1, u.x2), u.v2, rate(u.x2, u.v2, u.x3), u.v3, rate(u.x3, u.v3, u.x1)


RING = ["x1", "v1", "x2", "v2", "x3", "v3"]
SHIFT = np.kron(np.roll(np.eye(3), 1, axis=1), np.eye(2))  # the state of each is that of the next one


def turning(t):
    return 2 * math.cos(2 * math.pi * t), -2 * math.sin(2 * math.pi * t)


def three_turning(t, later=1 / 3):
    return [value for place in range(3) for value in turning(t + later * place)]


def pair_of_van_der_pol():
    """Return the cycle at mu = 1 as half and as a whole."""
    half, whole = (CycleProblem(van_der_pol, ["x", "y"], {"mu": 1.0}, symmetry=s) for s in ([-1, -1], None))
    return (
        contin.solve(half, turning, {"period": 6.5}, intervals=50, degree=6),
        contin.solve(whole, turning, {"period": 6.5}, intervals=100, degree=6),
    )


def test_half_a_cycle_of_van_der_pol_is_the_whole_one():
    """T(1) = 6.6632868593 as published. The columns of both are those of the whole cycle."""
    half, whole = pair_of_van_der_pol()
    assert half["period"] == pytest.approx(6.6632868593, abs=1e-9)
    assert half["period"] == pytest.approx(whole["period"], abs=1e-11)
    assert half.functionals == pytest.approx(whole.functionals, abs=2e-8)  # between mesh points
    assert half.floquet().logarithms == pytest.approx(whole.floquet().logarithms, abs=1e-10)
    times, x = half.plot("series", axes=Figure().subplots()).lines[0].get_data()
    assert times[-1] == pytest.approx(half["period"]) and x.min() < -2 < 2 < x.max()


def test_solutions_are_guesses_for_each_other():
    half, whole = pair_of_van_der_pol()
    again, other = contin.solve(half.system.problem, whole), contin.solve(whole.system.problem, half)
    assert again["period"] == pytest.approx(half["period"], abs=1e-11)
    assert other["period"] == pytest.approx(whole["period"], abs=1e-11)


@pytest.mark.full
@pytest.mark.parametrize(("matrix", "later", "order"), [(SHIFT, 1 / 3, 3), (-SHIFT.T, 1 / 3, 6)])
def test_a_ring_of_three_oscillators(matrix, later, order):
    """A third, and a sixth of the rotating wave: period, columns, means and multipliers are those of the whole one."""
    means = {"first": lambda u, p: u.x1**2}
    part, whole = (CycleProblem(ring, RING, {"a": 1.0, "k": 0.2}, symmetry=s, functionals=means) for s in (matrix, None))
    wave = contin.solve(part, lambda t: three_turning(t, later), {"period": 6.0}, degree=6)
    assert part.order == order
    same = contin.solve(whole, wave, degree=6)
    assert wave["period"] == pytest.approx(same["period"], abs=1e-11)
    assert wave.functionals == pytest.approx(same.functionals, abs=1e-10)
    ours, theirs = (np.sort(abs(point.floquet().multipliers)) for point in (wave, same))
    assert ours == pytest.approx(theirs, abs=1e-8)


@pytest.fixture(scope="module")
def symmetric():
    problem = CycleProblem(lorenz, ["x", "y", "z"], {"r": 330.0}, symmetry=[-1, -1, 1])
    orbit = contin.cycle(problem, [1.0, 1.0, 330.0], settle=15)
    return contin.trace(orbit, free=["r"], direction=-1, limits={"r": (225, 400)})


def test_the_symmetry_of_lorenz_breaks(symmetric):
    """The branch point of the whole problem (a pitchfork) is an eigenvalue -1 of the half; the stability changes there."""
    (breaking,) = symmetric.labelled("BP")
    assert breaking.name == "symmetry breaking, supercritical"
    whole = contin.solve(CycleProblem(lorenz, ["x", "y", "z"], {"r": 330.0}), symmetric.points[0])
    (point,) = contin.trace(whole, free=["r"], direction=-1, limits={"r": (300, 400)}).labelled("BP")
    assert breaking["r"] == pytest.approx(point["r"], abs=1e-8)
    assert [symmetric.points[i].floquet().unstable for i in (0, -1)] == [0, 1]


def test_asymmetric_cycles_leave_there(symmetric):
    """AUTO-07p finds the doubling of the asymmetric cycle at r = 229.40670855."""
    branch = contin.trace(symmetric.labelled("BP")[0], branch=1, limits={"r": (225, 330)})
    assert [point.label for point in branch if point.label] == ["BP", "PD", "EP"]
    assert branch.labelled("PD")[0]["r"] == pytest.approx(229.40670855, abs=2e-8)
    assert branch.points[-1].system.order == 1


@pytest.mark.full
def test_symmetry_breaking_in_a_diagram_and_in_two_parameters(symmetric):
    found = contin.diagram(symmetric.points[0], free=["r"], depth=1, limits={"r": (225, 331)})
    assert [junction.point.label for junction in found.junctions][:2] == ["BP", "PD"] and not found.junctions[0].failed

    def general(u, p):
        return p.s * (u.y - u.x), p.r * u.x - u.y - u.x * u.z, u.x * u.y - 8 / 3 * u.z

    problem = CycleProblem(general, ["x", "y", "z"], {"r": 330.0, "s": 10.0}, symmetry=[-1, -1, 1])
    branch = contin.trace(contin.solve(problem, symmetric.points[0]), free=["r"], direction=-1, limits={"r": (300, 400)})
    last = contin.curve(branch.labelled("BP")[0], free=["r", "s"], limits={"s": (9, 11)}, max_points=4).points[-1]
    values = {"s": last["s"], "r": last["r"] + 3}
    orbit = contin.solve(problem, branch.points[0], values)
    fixed = contin.trace(orbit, free=["r"], direction=-1, limits={"r": (last["r"] - 3, 400)})
    assert fixed.labelled("BP")[0]["r"] == pytest.approx(last["r"], abs=1e-7)


def test_a_stored_branch_remembers_its_symmetry(symmetric, tmp_path):
    contin.save(symmetric, tmp_path / "branch.npz")
    problem = symmetric.points[0].system.problem
    assert contin.load(problem, tmp_path / "branch.npz").labelled("BP")[0].name == symmetric.labelled("BP")[0].name
    with pytest.raises(ProblemError, match=r"is of another problem: .*; symmetry \[\[-1"):
        contin.load(CycleProblem(lorenz, ["x", "y", "z"], {"r": 330.0}), tmp_path / "branch.npz")


def test_the_angle_is_that_of_the_whole_round():
    """The logarithm of a multiplier over six parts has six times the angle, in (-pi, pi]."""
    problem = CycleProblem(ring, RING, {"a": 1.0, "k": 0.2}, symmetry=-SHIFT)
    system = contin.solve(problem, lambda t: three_turning(t, -1 / 3), {"period": 6.0}, degree=6).system
    assert system.whole_round(np.array([0.5 + 1j * math.pi / 6, 1j * math.pi])) == pytest.approx([3 + 1j * math.pi, 0])


@pytest.mark.parametrize(
    ("symmetry", "words"),
    [
        ([1, -1], "symmetry: the field does not have it; the rate of . at S u differs by .* for u = "),
        ([-1], r"symmetry: \[-1\] must be 2 signs, or a matrix of 2 rows and columns"),
        ("odd", "symmetry: 'odd' must be 2 signs"),
        ([1, 1], "symmetry: the identity is none; leave it out"),
        ([2, 1], "symmetry: no power of the matrix up to 60 is the identity"),
    ],
)
def test_what_is_refused(symmetry, words):
    with pytest.raises(ProblemError, match=words):
        CycleProblem(van_der_pol, ["x", "y"], {"mu": 1.0}, symmetry=symmetry)


def test_no_symmetry_of_forced_fields():
    with pytest.raises(ProblemError, match="symmetry: must be left out where a period is given"):
        CycleProblem(lambda t, u, p: (u.y, -u.x), ["x", "y"], {}, period=1.0, symmetry=[-1, -1])


@pytest.mark.full
def test_van_der_pol_to_a_thousand():
    """The second multiplier at mu = 100 is 10^-12593.67, that is the integral of mu (1 - x^2) over the period.

    The period at mu = 1000 is that of the expansion (3 - 2 log 2) mu + 7.014322 mu^(-1/3) - (2/3) log(mu) / mu - 1.3233 / mu
    (Urabe 1963), whose next term is of the order mu^(-5/3).
    """
    problem = CycleProblem(van_der_pol, ["x", "y"], {"mu": 1.0}, symmetry=[-1, -1])
    orbit = contin.solve(problem, turning, {"period": 6.5})
    branch = contin.trace(orbit, free=["mu"], limits={"mu": (1, 1000)}, zeros={"mu": [10, 100]})
    ten, hundred = branch.labelled("UZ")
    assert ten["period"] == pytest.approx(19.0783695, abs=1e-7)
    assert hundred.floquet().logarithms[1].real / math.log(10) == pytest.approx(-12593.67, abs=5e-3)
    last = branch.points[-1]
    expansion = (3 - 2 * math.log(2)) * 1000 + 7.014322 / 10 - 2 / 3 * math.log(1000) / 1000 - 1.3233 / 1000
    assert str(branch.stop) == "reached mu = 1000" and last["period"] == pytest.approx(expansion, abs=1e-4)
    assert last.floquet().unstable == 0
