"""Problems that other tools have as demos, written as their users write them (docs/outside.md), beside their known answers."""

import math
from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.optimize import brentq

import contin


def labelled(branches, label, name):
    return sorted(point[name] for branch in branches for point in branch.labelled(label))


@pytest.mark.full
def test_morris_and_lecar():
    """Rinzel and Ermentrout 1989: 93.86 and 212; here the trace of the Jacobian along the equilibria."""
    c, vk, gk, vca, gca, vl, gl, phi, v1, v2, v3, v4 = 20, -84, 8, 120, 4.4, -60, 2, 0.04, -1.2, 18, 2, 30
    m_inf = lambda v: 0.5 * (1 + np.tanh((v - v1) / v2))  # noqa: E731
    w_inf = lambda v: 0.5 * (1 + np.tanh((v - v3) / v4))  # noqa: E731

    def neuron(y, p):
        v, w = y[0], y[1]
        rate = (p.I - gl * (v - vl) - gk * w * (v - vk) - gca * m_inf(v) * (v - vca)) / c
        return np.array([rate, phi * (w_inf(v) - w) * np.cosh((v - v3) / (2 * v4))])

    problem = contin.AlgebraicProblem(neuron, ["v", "w"], {"I": 0.0})
    branch = contin.trace(contin.solve(problem, [-60, 0.01]), free=["I"], limits={"I": (0, 300)})

    def trace(v):
        slope = (1 - np.tanh((v - v1) / v2) ** 2) / (2 * v2)
        own = -(gl + gk * w_inf(v) + gca * (m_inf(v) + slope * (v - vca))) / c
        return own - phi * np.cosh((v - v3) / (2 * v4))

    def current(v):
        return gl * (v - vl) + gk * w_inf(v) * (v - vk) + gca * m_inf(v) * (v - vca)

    known = [current(brentq(trace, *ends)) for ends in ((-30, -20), (0, 15))]
    assert labelled([branch], "HB", "I") == pytest.approx(known, rel=1e-9)
    cycles = contin.trace(branch.labelled("HB")[0], branch=1, limits={"I": (0, 300)})
    assert labelled([cycles], "LP", "I") == pytest.approx([88.2933, 216.8998], abs=1e-3)


def test_adaptive_control():
    """MatCont's tutorial: Hopf point at alpha beta = 1, coefficient -0.3, doubling at 0.6303. Parameters are unpacked."""

    def feedback(x, par):
        alpha, beta = par
        return x[1], x[2], -alpha * x[2] - beta * x[1] - x[0] + x[0] ** 2

    problem = contin.AlgebraicProblem(feedback, ["x", "y", "z"], {"alpha": 2.0, "beta": 1.0})
    start = contin.solve(problem, [0, 0, 0])
    (hopf,) = contin.trace(start, free=["alpha"], direction=-1, limits={"alpha": (0.5, 3)}).labelled("HB")
    assert hopf["alpha"] == pytest.approx(1) and hopf.normal_form == pytest.approx(-0.3, rel=1e-6)
    cycles = contin.trace(hopf, branch=1, limits={"alpha": (0.5, 3)}, max_points=200)
    assert labelled([cycles], "PD", "alpha") == pytest.approx([0.6303], abs=5e-5)


def test_oxidation_of_carbon_monoxide():
    """Bykov, Yablonskii and Kim, as MatCont and BifurcationKit have it; here from the characteristic polynomial."""
    q = SimpleNamespace(q1=2.5, q3=10.0, q4=0.0675, q5=1.0, q6=0.1, k=0.4)

    def rates(u, p):
        x, y, s = u
        z = 1 - x - y - s
        return 2 * q.q1 * z**2 - 2 * q.q5 * x**2 - q.q3 * x * y, p.q2 * z - q.q6 * y - q.q3 * x * y, q.q4 * (z - q.k * s)

    problem = contin.AlgebraicProblem(rates, ["x", "y", "s"], {"q2": 2.204678})
    start = contin.solve(problem, [0.0029538, 0.76211, 0.1678])
    branch = contin.trace(start, free=["q2"], direction=-1, limits={"q2": (0.3, 3)})

    def at(x):  # the equilibrium with this x: z from the first equation, by a quadratic
        share = 1 + 1 / q.k  # z + s
        a, b, c = 2 * q.q1, q.q3 * x * share, -(2 * q.q5 * x**2 + q.q3 * x * (1 - x))
        z = (-b + math.sqrt(b * b - 4 * a * c)) / (2 * a)
        y = 1 - x - share * z
        return z, y, (q.q6 * y + q.q3 * x * y) / z

    def hurwitz(x):
        z, y, q2 = at(x)
        d = 4 * q.q1 * z
        matrix = [
            [-d - 4 * q.q5 * x - q.q3 * y, -d - q.q3 * x, -d],
            [-q2 - q.q3 * y, -q2 - q.q6 - q.q3 * x, -q2],
            [-q.q4, -q.q4, -q.q4 * (1 + q.k)],
        ]
        _, a, b, c = np.poly(np.array(matrix))
        return a * b - c

    known = sorted(at(brentq(hurwitz, *ends))[2] for ends in ((0.01, 0.02), (0.06, 0.1)))
    assert labelled([branch], "HB", "q2") == pytest.approx(known, rel=1e-8)
    assert labelled([branch], "LP", "q2") == pytest.approx([1.0420485, 1.0522003], abs=1e-7)


def test_front_of_nagumo():
    """AUTO's `nag`: the speed is (1 - 2 a) / sqrt(2). The guess has its own time, and equilibria at its ends."""

    def wave(u, p):
        return u.v, -p.c * u.v - u.w * (1 - u.w) * (u.w - p.a)

    problem = contin.ConnectionProblem(wave, ["w", "v"], {"a": 0.25, "c": -0.3}, unstable=1, stable=1)
    t = np.linspace(-20, 20, 401)
    w = 1 / (1 + np.exp(-t / np.sqrt(2)))
    front = contin.solve(problem, (t, np.stack([w, np.gradient(w, t)], axis=1)), free=["c"])
    assert front["time"] == 40 and front["to_w"] == pytest.approx(1) and front["c"] == pytest.approx(-0.5 / np.sqrt(2))
    curve = contin.trace(front, free=["a", "c"], limits={"a": (0.05, 0.45)})
    assert np.abs(curve["c"] + (1 - 2 * curve["a"]) / np.sqrt(2)).max() < 1e-8


def test_henon():
    """The cycles of the map in closed form, b = 0.3."""
    problem = contin.MapProblem(lambda x, p: [1 - p.a * x[0] ** 2 + x[1], p.b * x[0]], ["x", "y"], {"a": 0.1, "b": 0.3})
    fixed = contin.trace(contin.solve(problem, [0.9, 0.3]), free=["a"], limits={"a": (0.05, 2)})
    (first,) = fixed.labelled("PD")
    (second,) = contin.trace(first, branch=1, limits={"a": (0.05, 2)}).labelled("PD")
    assert [first["a"], second["a"]] == pytest.approx([0.75 * 0.7**2, 0.7**2 + 1.3**2 / 4], rel=1e-11)


def test_soap_film():
    """COCO's catenary: half the distance at which no film spans two rings of radius 1, cosh(x) / sinh(x) = x."""

    def rhs(t, u, p):
        y, slope = u
        return np.vstack((p.L * slope, p.L * (1 + slope**2) / y))

    problem = contin.BoundaryValueProblem(rhs, lambda a, b, p: (a[1], b[0] - 1), ["y", "slope"], {"L": 0.1})
    branch = contin.trace(contin.solve(problem, [1.0, 0.0]), free=["L"], limits={"L": (0.05, 1)})
    x = brentq(lambda x: math.cosh(x) - x * math.sinh(x), 1, 1.5)
    assert labelled([branch], "LP", "L") == pytest.approx([x / math.cosh(x)], rel=1e-11)


@pytest.mark.full
def test_schnakenberg():
    """pde2path's demo: Turing's bifurcation at sqrt(60) sqrt(3 - sqrt 8), but for the differences."""
    n, wave = 100, np.sqrt(np.sqrt(2) - 1)
    h = 2 * np.pi / wave / (n - 1)

    def laplace(u):
        wide = np.concatenate([u[1:2], u, u[-2:-1]])
        return (wide[2:] - 2 * wide[1:-1] + wide[:-2]) / h**2

    def field(x, p):
        u, v = x[:n], x[n:]
        return np.hstack([-u + u**2 * v + laplace(u), p.lam - u**2 * v + 60 * laplace(v)])

    problem = contin.AlgebraicProblem(field, 2 * n, {"lam": 3.5}, count=2 * n)
    start = contin.solve(problem, np.r_[3.5 * np.ones(n), np.ones(n) / 3.5])
    branch = contin.trace(start, free=["lam"], direction=-1, limits={"lam": (3.1, 3.5)})
    square = (2 - 2 * np.cos(wave * h)) / h**2
    known = brentq(lambda lam: (1 - square) * (-(lam**2) - 60 * square) + 2 * lam**2, 3, 3.4)
    assert labelled([branch], "BP", "lam") == pytest.approx([known], rel=1e-9)
    assert known == pytest.approx(np.sqrt(60) * np.sqrt(3 - np.sqrt(8)), rel=1e-6)


@pytest.mark.full
def test_ginzburg_and_landau():
    """pde2path and BifurcationKit: the field begins to oscillate at r = j^2, with frequency nu = 1."""
    mu, c3 = 0.1, -1.0

    def rhs(t, u, p):
        a, da, b, db = u
        square = a**2 + b**2
        growth_a = p.r * a - b - square * (c3 * a - mu * b) - square**2 * a
        growth_b = p.r * b + a - square * (c3 * b + mu * a) - square**2 * b
        return da, -growth_a, db, -growth_b

    problem = contin.BoundaryValueProblem(
        rhs, lambda a, b, p: (a[0], a[2], b[0], b[2]), ["a", "da", "b", "db"], {"r": 0.5}, domain=(0, np.pi),
        rates={"da": lambda t, u, w, p: w.a, "db": lambda t, u, w, p: w.b},
    )  # fmt: skip
    branch = contin.trace(contin.solve(problem, [0, 0, 0, 0]), free=["r"], limits={"r": (0.5, 10)})
    assert labelled([branch], "HB", "r") == pytest.approx([1, 4, 9], rel=1e-11)


@pytest.mark.full
def test_kuramoto_and_sivashinsky():
    """Odd states by Galerkin's method; Kevrekidis, Nicolaenko and Scovel 1990: 16.1399, 22.559, Hopf point at 30.345."""
    count = 16

    def field(a, p):
        rates = []
        for m in range(1, count + 1):
            total = 0
            for i in range(1, count + 1):
                if 1 <= m - i <= count:
                    total += a[i - 1] * a[m - i - 1] * m / 4
                if m + i <= count:
                    total -= a[i - 1] * a[m + i - 1] * m / 2
            rates.append((-4 * m**4 + p.alpha * m**2) * a[m - 1] - p.alpha * total)
        return rates

    problem = contin.AlgebraicProblem(field, [f"a{i}" for i in range(count)], {"alpha": 1.0})
    start = contin.solve(problem, np.zeros(count))
    found = contin.diagram(start, free=["alpha"], limits={"alpha": (1, 40)}, depth=1)
    assert labelled(found.branches[:1], "BP", "alpha") == pytest.approx([4, 16, 36])
    assert all(branch.stop.reason in ("limit", "closed", "known branch") for branch in found.branches)
    places = labelled(found.branches[1:], "BP", "alpha")
    assert any(abs(place - 16.1399) < 1e-4 for place in places) and any(abs(place - 22.556) < 1e-3 for place in places)
    assert labelled(found.branches[1:], "HB", "alpha") == pytest.approx([30.345], abs=1e-3)


def test_lorenz():
    """AUTO's `lor`: Hopf points at 470/19, whose cycles end at the homoclinic orbit at r = 13.926557407."""

    class Lorenz:
        sigma, b = 10.0, 8 / 3

        def field(self, u, p):
            x, y, z = u
            return [self.sigma * (y - x), p["r"] * x - y - x * z, x * y - self.b * z]

    problem = contin.AlgebraicProblem(Lorenz().field, ["x", "y", "z"], {"r": 0.5})
    found = contin.diagram(
        contin.solve(problem, [0, 0, 0]), free=["r"], limits={"r": (0.5, 30), "period": (0, 8)}, max_points=300,
        symmetries=[lambda t, u: u * [-1, -1, 1]],
    )  # fmt: skip
    (hopf,) = (branch.labelled("HB")[0] for branch in found.branches if branch[0].label != "HB" and branch.labelled("HB"))
    assert hopf["r"] == pytest.approx(470 / 19, rel=1e-12)
    assert found.branches[-1][-1]["r"] == pytest.approx(13.926557407, abs=1e-6)


def test_roessler():
    """a = b = 0.2: the cycle doubles at c = 2.832445, here and in XPPAUT's manual at 2.83."""

    def roessler(u, c, a=0.2, b=0.2):
        return np.array([-u[1] - u[2], u[0] + a * u[1], b + u[2] * (u[0] - c)])

    problem = contin.CycleProblem(lambda u, p: roessler(u, p.c), ["x", "y", "z"], {"c": 2.5})
    branch = contin.trace(contin.cycle(problem, [1, 1, 1]), free=["c"], limits={"c": (2, 3)})
    assert labelled([branch], "PD", "c") == pytest.approx([2.832445], abs=1e-6)


def test_ziegler():
    """A column with a follower force: flutter at 41/28 + c^2/2 (Herrmann and Jong 1965); np.linalg.solve with the masses."""
    mass = np.array([[3.0, 1], [1, 1]])

    def column(u, p):
        damping = p.c * np.array([[2, -1], [-1, 1]])
        stiffness = np.array([[2 - p.load, p.load - 1], [-1, 1]])
        return np.concatenate([u[2:], np.linalg.solve(mass, -damping @ u[2:] - stiffness @ u[:2])])

    problem = contin.AlgebraicProblem(column, ["a", "b", "va", "vb"], {"load": 0.5, "c": 0.1})
    assert "evaluated in Python" not in problem.describe()
    branch = contin.trace(contin.solve(problem, np.zeros(4)), free=["load"], limits={"load": (0.5, 3)})
    assert labelled([branch], "HB", "load") == pytest.approx([41 / 28 + 0.005], rel=1e-11)


def test_lugiato_and_lefever():
    """Bistable light in a cavity: S^2 = X (1 + (X - delta)^2) turns at 3 X = 2 delta +- sqrt(delta^2 - 3)."""

    def light(u, p):
        field = u[0] + 1j * u[1]
        rate = -(1 + 1j * p.delta) * field + 1j * abs(field) ** 2 * field + p.S
        return rate.real, rate.imag

    problem = contin.AlgebraicProblem(light, ["re", "im"], {"S": 0.1, "delta": 3.0})
    branch = contin.trace(contin.solve(problem, [0.01, 0]), free=["S"], limits={"S": (0.05, 3)})
    places = [(6 + sign * np.sqrt(6)) / 3 for sign in (1, -1)]
    assert labelled([branch], "LP", "S") == pytest.approx([np.sqrt(x * (1 + (x - 3) ** 2)) for x in places], rel=1e-11)


def test_hindmarsh_and_rose():
    a, b, c, d, s, rest, r = 1, 3, 1, 5, 4, -1.6, 0.006

    def neuron(t, x, current):
        return [x[1] - a * x[0] ** 3 + b * x[0] ** 2 - x[2] + current, c - d * x[0] ** 2 - x[1], r * (s * (x[0] - rest) - x[2])]

    problem = contin.AlgebraicProblem(lambda u, p: neuron(0, u, p["I"]), ["x", "y", "z"], {"I": 0.0})
    branch = contin.trace(contin.solve(problem, [-1.6, -12, 0]), free=["I"], limits={"I": (0, 30)})

    def hurwitz(x):
        matrix = [[-3 * a * x * x + 2 * b * x, 1, -1], [-2 * d * x, -1, 0], [r * s, 0, -r]]
        _, one, two, three = np.poly(np.array(matrix))
        return one * two - three

    places = np.linspace(-2, 3, 2001)
    values = [hurwitz(x) for x in places]
    roots = [brentq(hurwitz, *places[i : i + 2]) for i in range(2000) if values[i] * values[i + 1] < 0]
    known = [-(c - d * x * x - a * x**3 + b * x * x - s * (x - rest)) for x in roots]
    assert labelled([branch], "HB", "I") == pytest.approx(known, rel=1e-9)


def test_goodwin():
    """Equal rates, exponent 10: a Hopf point where the exponent times z^n / (1 + z^n) is 8."""

    def gene(u, p):
        x, y, z = u
        return p.k / (1 + z**10) - x, x - y, y - z

    problem = contin.AlgebraicProblem(gene, ("x", "y", "z"), {"k": 0.5})
    branch = contin.trace(contin.solve(problem, [0.5, 0.5, 0.5]), free=["k"], limits={"k": (0.5, 10)})
    z = (8 / 2) ** 0.1
    assert labelled([branch], "HB", "k") == pytest.approx([z * (1 + z**10)], rel=1e-10)


def test_delayed_logistic_map():
    problem = contin.MapProblem(lambda x, p: (p.r * x[0] * (1 - x[1]), x[0]), ["x", "y"], {"r": 1.5})
    branch = contin.trace(contin.solve(problem, [1 / 3, 1 / 3]), free=["r"], limits={"r": (1.1, 2.5)})
    assert labelled([branch], "TR", "r") == pytest.approx([2.0], rel=1e-10)


def test_beam_on_a_foundation():
    """w'''' + P w'' + w + w^3 = 0 between hinges: P = k^2 + 1 / k^2, k = j pi / 10."""

    def rhs(x, y, p):
        return np.vstack([y[1], y[2], y[3], -p.P * y[2] - y[0] - y[0] ** 3])

    problem = contin.BoundaryValueProblem(
        rhs, lambda a, b, p: np.array([a[0], a[2], b[0], b[2]]), ["w", "w1", "w2", "w3"], {"P": 1.5}, domain=(0, 10.0)
    )
    branch = contin.trace(contin.solve(problem, np.zeros(4)), free=["P"], limits={"P": (1.5, 4)})
    k = np.arange(1, 8) * np.pi / 10
    known = np.sort(k**2 + 1 / k**2)
    assert labelled([branch], "BP", "P") == pytest.approx(known[known < 4], rel=1e-10)


def test_predator_and_prey():
    """Rosenzweig and MacArthur: the predator invades at K = 2/9, and cycles begin at K = 22/9."""

    @dataclass
    class Rates:
        h: float = 0.5
        d: float = 0.2

    par = Rates()

    def field(u, p):
        prey, predator = u
        eaten = prey / (1 + par.h * prey)
        return prey * (1 - prey / p.K) - eaten * predator, eaten * predator - par.d * predator

    problem = contin.AlgebraicProblem(field, ["N", "P"], {"K": 0.1})
    limits = {"K": (0.1, 5), "P": (-1, 10), "period": (0, 60)}
    found = contin.diagram(contin.solve(problem, [0.1, 0.0]), free=["K"], limits=limits, max_points=150)
    assert labelled(found.branches[:1], "BP", "K") == pytest.approx([2 / 9], rel=1e-11)
    assert {round(place, 9) for place in labelled(found.branches, "HB", "K")} == {round(22 / 9, 9)}


def test_josephson():
    """A pendulum with a torque: rotations end at a homoclinic orbit near 4 friction / pi, for little friction."""
    problem = contin.CycleProblem(
        lambda u, p: [u[1], p.I - np.sin(u[0]) - p.drag * u[1]], ["phi", "v"], {"I": 0.5, "drag": 0.05}, angles=["phi"]
    )
    branch = contin.trace(contin.cycle(problem, [0.0, 3.0]), free=["I"], direction=-1, limits={"I": (0, 2), "period": (0, 200)})
    assert branch[-1]["I"] == pytest.approx(4 * 0.05 / np.pi, rel=1e-3)
