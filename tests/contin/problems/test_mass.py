"""Mass matrices: M u' = F with regular and singular M, against the explicit equations and closed forms."""

import math
import pickle

import numpy as np
import pytest
import scipy.sparse

import contin
from contin import AlgebraicProblem, CycleProblem, ProblemError

MASS = np.array([[2.0, 1.0], [-1.0, 3.0]])


def brusselator(u, p):
    return p.a - (p.b + 1) * u.x + u.x**2 * u.y, p.b * u.x - u.x**2 * u.y


def weighted(u, p):
    """The same, times `MASS`."""
    f, g = brusselator(u, p)
    return 2 * f + g, -f + 3 * g


def filled(u, p, out):
    f, g = p[0] - (p[1] + 1) * u[0] + u[0] ** 2 * u[1], p[1] * u[0] - u[0] ** 2 * u[1]
    out[0], out[1] = 2 * f + g, -f + 3 * g


def jacobian(u, p):
    x, y, b = (*u, p[1])
    return MASS @ np.array([[-b - 1 + 2 * x * y, x * x], [b - 2 * x * y, -x * x]])


def sparse_jacobian(u, p):
    return scipy.sparse.csr_array(jacobian(u, p))


@pytest.mark.parametrize("kind", ["returned", "filled", "jacobian", "sparse"])
def test_a_regular_matrix(kind):
    """The Hopf point at b = 1 + a^2 with the frequency a and the first Lyapunov coefficient of the explicit equations."""
    options = {}
    if kind in ("jacobian", "sparse"):
        options["jacobian"] = jacobian if kind == "jacobian" else sparse_jacobian
    field = filled if kind == "filled" else weighted
    mass = scipy.sparse.csr_array(MASS) if kind == "sparse" else MASS
    problem = AlgebraicProblem(field, ["x", "y"], {"a": 1.2, "b": 1.0}, mass=mass, **options)
    branch = contin.trace(contin.solve(problem, [1.2, 0.8]), free=["b"], limits={"b": (0.5, 4)})
    (hopf,) = branch.labelled("HB")
    assert hopf["b"] == pytest.approx(1 + 1.2**2, abs=1e-9) and hopf.details["frequency"] == pytest.approx(1.2, abs=1e-9)
    assert hopf.normal_form == pytest.approx(-(2 + 1.44) / (2 * 1.2 * (1 + 2 * 1.44)), rel=1e-6)
    again = pickle.loads(pickle.dumps(problem))
    assert contin.solve(again, [1.2, 0.8]).x == pytest.approx([1.2, 1 / 1.2], abs=1e-12)


def test_cycles_with_a_regular_matrix():
    """Those of the explicit equations, autonomous and forced; a diagonal is enough."""
    plain = contin.cycle(CycleProblem(brusselator, ["x", "y"], {"a": 1.0, "b": 2.5}), [1.0, 1.0])
    other = contin.cycle(CycleProblem(weighted, ["x", "y"], {"a": 1.0, "b": 2.5}, mass=MASS), [1.0, 1.0])
    for name in ("period", "max_x", "min_y"):
        assert other[name] == pytest.approx(plain[name], rel=1e-8)

    def forced(t, u, p):
        return 2 * u.v, -0.5 * u.x + 0.5 * math.cos(p.w * t)

    driven = CycleProblem(forced, ["x", "v"], {"w": 2.0}, period=lambda p: 2 * math.pi / p.w, mass=[2, 0.5])
    assert contin.solve(driven, [0.0, 0.0])["max_x"] == pytest.approx(1 / 3, abs=1e-9)


def implicit(u, p):
    """A Hopf normal form in which the square of the radius is s + s^3 / 10."""
    return p.mu * u.x - u.y - u.x * u.s, u.s + 0.1 * u.s**3 - u.x**2 - u.y**2, u.x + p.mu * u.y - u.y * u.s


#: The rates of x and y stand in the first and third equation.
SINGULAR = np.array([[1.0, 0, 0], [0, 0, 0], [0, 0, 1]])


@pytest.mark.full
def test_a_singular_matrix(tmp_path):
    """s = mu on the cycle: radius, period, multiplier; d = -1 at the Hopf point, for which s = x^2 + y^2 to second order."""
    problem = AlgebraicProblem(implicit, ["x", "s", "y"], {"mu": -0.5}, mass=SINGULAR)
    branch = contin.trace(contin.solve(problem, [0, 0.1, 0]), free=["mu"], limits={"mu": (-1, 1)})
    (hopf,) = branch.labelled("HB")
    assert abs(hopf["mu"]) < 1e-9 and hopf.normal_form == pytest.approx(-2.0, rel=1e-9)
    assert len(branch[0].system.eigenvalues(branch[0].x)) == 2
    cycles = contin.trace(hopf, branch=1, limits={"mu": (-1, 1)})
    for point in cycles[1:]:
        mu = point["mu"]
        assert point["s"] == pytest.approx(mu, abs=1e-9) and point["period"] == pytest.approx(2 * math.pi, rel=1e-9)
        assert point["max_x"] == pytest.approx(math.sqrt(mu + 0.1 * mu**3), rel=1e-8)
        radial = -2 * (mu + 0.1 * mu**3) / (1 + 0.3 * mu**2)
        assert point.floquet().logarithms[1].real == pytest.approx(radial * 2 * math.pi, rel=1e-6)
    contin.save(cycles, tmp_path / "cycles.npz")
    cyclic = CycleProblem(implicit, ["x", "s", "y"], {"mu": 1.0}, mass=SINGULAR)
    assert contin.load(cyclic, tmp_path / "cycles.npz")[-1]["s"] == cycles[-1]["s"]
    settled = contin.cycle(cyclic, [0.5, 0.2, 0.0])
    assert settled["max_x"] == pytest.approx(math.sqrt(1.1), rel=1e-8)
    assert contin.solve(cyclic, settled, {"mu": 0.5})["s"] == pytest.approx(0.5, abs=1e-9)


def test_rows_of_rates_that_are_mixed():
    """M = [[1, 1], [1, 1]] of x' alone is no mass matrix of two states; one of full columns with mixed rows is."""

    def field(u, p):  # x' = a - x - z and 0 = z - x^2, in the combinations sum and difference
        rate, rest = p.a - u.x - u.z, u.z - u.x**2
        return rate + rest, rate - rest

    problem = AlgebraicProblem(field, ["x", "z"], {"a": 2.0}, mass=[[1, 0], [1, 0]])
    point = contin.solve(problem, [0.5, 0.2])
    assert point["x"] == pytest.approx(1.0, abs=1e-12) and point["z"] == pytest.approx(1.0, abs=1e-12)
    assert point.system.eigenvalues(point.x) == pytest.approx([-3.0], abs=1e-12)
    sums = contin.solve(AlgebraicProblem(field, ["x", "z"], {"a": 2.0}, mass=[[1, 1], [1, 1]]), [0.5, 0.2])
    assert [sums["mass_x"], sums["x"], sums["z"]] == pytest.approx([2, 1, 1], abs=1e-12)
    assert sums.system.eigenvalues(sums.x) == pytest.approx([-1.0], abs=1e-12)  # (x + z)' = a - (x + z)


def test_a_capacitor_between_two_nodes(tmp_path):
    """C (v1 - v2)' is what flows between two nodes, one grounded by a resistor: with w = v1 - v2, an inductor and a
    conductance, w'' - (k - 1/10 - 3 w^2) w' + w = 0. A Hopf point at k = 1/10 with the frequency 1, then
    w^2 = 4 (k - 1/10) / 3 at most."""

    def nodes(u, p):
        flow = -u.i + (p.k - 0.1) * (u.v1 - u.v2) - (u.v1 - u.v2) ** 3
        return flow, -flow - u.v2, u.v1 - u.v2

    tank = AlgebraicProblem(nodes, ["v1", "v2", "i"], {"k": 0.0}, mass=[[1, -1, 0], [-1, 1, 0], [0, 0, 1]])
    branch = contin.trace(contin.solve(tank, [0, 0, 0]), free=["k"], limits={"k": (0, 1)})
    (hopf,) = branch.labelled("HB")
    assert hopf["k"] == pytest.approx(0.1, abs=1e-12) and hopf.details["frequency"] == pytest.approx(1, abs=1e-9)
    cycles = contin.trace(hopf, branch=1, limits={"k": (0, 0.11)})
    assert cycles[-1]["max_v1"] == pytest.approx(math.sqrt(4 / 3 * 0.01), rel=1e-3)
    contin.save(branch, tmp_path / "branch.npz")
    assert contin.load(tank, tmp_path / "branch.npz")[-1]["v1"] == branch[-1]["v1"]


def test_with_a_conserved_total():
    """A <-> B with twice the volume for B: A + 2 B stays. C is found from it, without a rate."""

    def field(u, p):
        flow = p.k * u.A - u.B
        return -flow, flow, u.C - u.A * u.B

    problem = AlgebraicProblem(field, ["A", "B", "C"], {"k": 2.0}, mass=[1, 2, 0])
    point = contin.solve(problem, [5, 0, 0])
    assert point["total_A"] == 5 and [point[name] for name in "ABC"] == pytest.approx([1, 2, 2], abs=1e-12)
    branch = contin.trace(point, free=["total_A"], limits={"total_A": (1, 10)})
    assert branch[-1]["C"] == pytest.approx(8.0, abs=1e-10)


def test_a_forced_one():
    """x' = v, 0 = v + x - cos t: x = (cos t + sin t) / 2, and the mean of v^2 is 1 / 4."""

    def field(t, u, p):
        return p.one * u.v, u.v + u.x - math.cos(t)

    problem = CycleProblem(field, ["x", "v"], {"one": 1.0}, period=2 * math.pi, mass=[1, 0],
                           functionals={"power": lambda t, u, p: u.v**2})  # fmt: skip
    point = contin.solve(problem, [0.0, 1.0])
    assert "recorded" in point.system.problem.describe().partition("\n")[0]
    assert point["max_v"] == pytest.approx(math.sqrt(0.5), abs=1e-9)
    assert point["max_x"] == pytest.approx(math.sqrt(0.5), abs=1e-9) and point["power"] == pytest.approx(0.25, abs=1e-9)


def test_what_is_refused():
    def pendulum(u, p):  # in Cartesian coordinates: index 3
        return u.vx, u.vy, -u.force * u.x, -u.force * u.y - p.g, u.x**2 + u.y**2 - 1

    names = ["x", "y", "vx", "vy", "force"]
    for kind in (AlgebraicProblem, CycleProblem):
        with pytest.raises(ProblemError, match="do not determine force at the guess, .* the index is larger than one"):
            contin.solve(kind(pendulum, names, {"g": 1.0}, mass=[1, 1, 1, 1, 0]), [0.6, -0.8, 0, 0, 0.8])
    for mass, message in (
        ([1, 2], "must be 5 finite numbers"),
        (np.eye(4), "must be 5 x 5 finite numbers"),
        ("heavy", "must be numbers"),
        (np.zeros(5), "mass: it is zero; leave it out and state dynamics=False"),
    ):
        with pytest.raises(ProblemError, match=message):
            CycleProblem(pendulum, names, {"g": 1.0}, mass=mass)
    with pytest.raises(ProblemError, match="mass: is for as many equations as states"):
        AlgebraicProblem(lambda u, p: (u.x + u.y,), ["x", "y"], {}, mass=[1, 1])
    many = [f"u{i}" for i in range(20)]
    with pytest.raises(ProblemError, match="mass: 19 states have no rates, at most 16 can be found"):
        AlgebraicProblem(lambda u, p: list(u), many, {}, mass=[1] + [0] * 19)
    with pytest.raises(ProblemError, match="symmetry: must be left out where states have no rates"):
        CycleProblem(lambda u, p: (u.y, -u.x, u.z - u.x), ["x", "y", "z"], {}, mass=[1, 1, 0], symmetry=[-1, -1, -1])
