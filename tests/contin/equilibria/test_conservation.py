"""Conserved totals: reaction networks as they are written down, against closed forms and time integration."""

import math
import pickle
from collections import namedtuple
from fractions import Fraction

import numpy as np
import pytest
import scipy.sparse
from matplotlib.figure import Figure
from scipy.integrate import solve_ivp

import contin
from contin import AlgebraicProblem, ProblemError


def enzyme(u, p):
    """E + S <-> C <-> E + P."""
    binds, makes = p.k1 * u.E * u.S - p.k2 * u.C, p.k3 * u.C - p.k4 * u.E * u.P
    return makes - binds, -binds, binds - makes, makes


RATES = {"k1": 1.0, "k2": 0.5, "k3": 0.3, "k4": 0.1}


def integrated(field, names, parameters, start, time, **options):
    """The motion from a start, by SciPy."""
    state, known = namedtuple("U", names), namedtuple("P", parameters)(**parameters)
    return solve_ivp(lambda t, u: field(state(*u), known), (0, time), start, "LSODA", rtol=1e-11, atol=1e-11, **options)


def test_an_enzyme():
    """The state at rest is that of the motion from the guess, and its eigenvalues are those of all states but two zeros."""
    problem = AlgebraicProblem(enzyme, ["E", "S", "C", "P"], RATES)
    point = contin.solve(problem, [1, 10, 0, 0])
    assert point["total_E"] == 1 and point["total_S"] == 10
    late = integrated(enzyme, "E S C P", RATES, [1, 10, 0, 0], 2000).y[:, -1]
    states = np.array([point[name] for name in ("E", "S", "C", "P")])
    assert states == pytest.approx(late, abs=1e-8)  # the tolerance of the integration times its steps
    whole = contin.lowlevel.Algebraic(problem, [], {}).jacobian(states)
    values = sorted(np.linalg.eigvals(whole).real, key=abs)
    assert np.abs(values[:2]).max() < 1e-12
    assert sorted(point.system.eigenvalues(point.x).real, key=abs) == pytest.approx(values[2:], rel=1e-10)


def test_totals_are_followed_and_given():
    """K = k2 k4 / (k1 k3) fixes P / S; a total is given among the parameters, whatever the guess has."""
    problem = AlgebraicProblem(enzyme, ["E", "S", "C", "P"], RATES)
    branch = contin.trace(contin.solve(problem, [1, 10, 0, 0]), free=["total_E"], limits={"total_E": (0.5, 4)})
    assert branch.notes[0].startswith("E + C, S + C + P are conserved: the parameters total_E, total_S are their values")
    for point in branch:
        assert point["P"] / point["S"] == pytest.approx(1.0 * 0.3 / (0.5 * 0.1), rel=1e-10)
        assert point["E"] + point["C"] == pytest.approx(point["total_E"], rel=1e-12)
    given = contin.solve(problem, [1, 10, 0, 0], {"total_E": branch[-1]["total_E"]})
    assert given["C"] == pytest.approx(branch[-1]["C"], rel=1e-9)
    again = contin.solve(problem, given, {"total_S": 5.0})
    assert (again["total_E"], again["total_S"]) == (given["total_E"], 5.0)


def switch(u, p):
    """Goldbeter and Koshland (1981): one enzyme turns W into V, another one turns it back."""
    one, other = p.a * u.W * u.E - p.d * u.X, p.a * u.V * u.F - p.d * u.Y
    made, back = p.k * u.X, p.r * u.Y
    return back - one, made - other, made - one, back - other, one - made, other - back


def test_a_switch():
    """Along the branch the totals of Michaelis and Menten's law, exact for what is free: K = (d + k) / a for both enzymes."""
    parameters = {"a": 100.0, "d": 1.0, "k": 1.0, "r": 1.0}
    problem = AlgebraicProblem(switch, ["W", "V", "E", "F", "X", "Y"], parameters)
    start = contin.solve(problem, [0.5, 0.4, 0.05, 0.05, 0.05, 0.05])
    for point in contin.trace(start, free=["k"], limits={"k": (0.5, 2)}):
        bound = 0.1 * point["V"] / ((1 + 1) / 100 + point["V"])
        busy = bound / point["k"]
        rest = (1 + point["k"]) / 100 * busy / (0.1 - busy)
        assert rest + point["V"] + busy + bound == pytest.approx(1.0, rel=1e-9)


NAMES = ["K", "KP", "M", "MP", "MPP", "E", "EP", "EPP"]


def cascade(u, p):
    """Kholodenko (2000): a MAP kinase cascade with negative feedback; three conserved totals."""

    def law(k, x, half, enzyme=1.0):
        return k * enzyme * x / (half + x)

    v1 = p.v * u.K / ((1 + u.EPP / 9) * (10 + u.K))
    v2, v3, v4 = law(0.25, u.KP, 8), law(0.025, u.M, 15, u.KP), law(0.025, u.MP, 15, u.KP)
    v5, v6 = law(0.75, u.MPP, 15), law(0.75, u.MP, 15)
    v7, v8 = law(0.025, u.E, 15, u.MPP), law(0.025, u.EP, 15, u.MPP)
    v9, v10 = law(0.5, u.EPP, 15), law(0.5, u.EP, 15)
    return v2 - v1, v1 - v2, v6 - v3, v3 + v5 - v4 - v6, v4 - v5, v10 - v7, v7 + v9 - v8 - v10, v8 - v9


@pytest.mark.full
def test_a_cascade_oscillates(tmp_path):
    """Its Hopf point, with the pair of all eight states beside three zeros, and cycles as a time integration has them."""
    problem = AlgebraicProblem(cascade, NAMES, {"v": 0.05})
    start = [90.0, 10, 280, 10, 10, 280, 10, 10]
    (hopf,) = contin.trace(contin.solve(problem, start), free=["v"], limits={"v": (0.01, 4)}).labelled("HB")
    whole = contin.lowlevel.Algebraic(problem, [], {"v": hopf["v"]}).jacobian(np.array([hopf[name] for name in NAMES]))
    values = np.linalg.eigvals(whole)
    assert np.sort(np.abs(values))[:3].max() < 1e-12
    pair = values[values.imag > 1e-6]
    assert pair == pytest.approx([1j * hopf.details["frequency"]], rel=1e-8)

    cycles = contin.trace(hopf, branch=1, limits={"v": (0.01, 2.5)})
    settled = contin.cycle(contin.CycleProblem(cascade, NAMES, {"v": 2.5}), start, settle=30000)
    late = integrated(cascade, NAMES, {"v": 2.5}, start, 40000, t_eval=np.linspace(30000, 40000, 20001)).y
    for orbit in (cycles[-1], settled):
        assert len(orbit.floquet().multipliers) == 5 and orbit["total_K"] == 100
        # half a second between the samples costs the square of half of it, times the second rate
        assert orbit["max_EPP"] == pytest.approx(late[7].max(), rel=1e-5)
        assert orbit["min_KP"] == pytest.approx(late[1].min(), rel=1e-5)
        assert orbit["max_M"] == pytest.approx(late[2].max(), rel=1e-5)  # of states that follow, too
        assert orbit["min_E"] == pytest.approx(late[5].min(), rel=1e-4)  # absolute 2e-5
    axes = settled.plot("series", states=["KP", "M"], axes=Figure().subplots())
    assert [line.get_label() for line in axes.lines] == ["KP", "M"]
    assert cycles[-1]["period"] == pytest.approx(settled["period"], rel=1e-8)
    contin.save(cycles, tmp_path / "cycles.npz")
    read = contin.load(contin.CycleProblem(cascade, NAMES, {"v": 2.5}), tmp_path / "cycles.npz")
    assert read[-1]["max_EPP"] == cycles[-1]["max_EPP"]


def exact_rank(rows):
    """The rank of a matrix of fractions."""
    rows, rank = [list(row) for row in rows], 0
    for column in range(len(rows[0])):
        pivot = next((i for i in range(rank, len(rows)) if rows[i][column]), None)
        if pivot is None:
            continue
        rows[rank], rows[pivot] = rows[pivot], rows[rank]
        for i in range(rank + 1, len(rows)):
            factor = rows[i][column] / rows[rank][column]
            rows[i] = [a - factor * b for a, b in zip(rows[i], rows[rank])]
        rank += 1
    return rank


@pytest.mark.sample(8)
@pytest.mark.parametrize("seed", range(40))
def test_random_networks(seed):
    """As many totals as states less the rank of the rates, which is exact, with constants between 1e-3 and 1e3.

    Reactions of the same substances count together: A -> B and A -> C conserve a combination of B and C.
    """
    random = np.random.default_rng(seed)
    n, count = int(random.integers(3, 10)), int(random.integers(2, 14))
    taken, made = (np.zeros((count, n), dtype=int) for _ in range(2))
    for side in (taken, made):
        for r in range(count):
            np.add.at(side[r], random.integers(n, size=random.integers(1, 3)), 1)
    constants = (10.0 ** random.uniform(-3, 3, count)).tolist()

    def rates(u, p):
        speeds = [p.s * k * math.prod(u[i] for i in range(n) for _ in range(row[i])) for k, row in zip(constants, taken)]
        change = made - taken
        return [sum((int(change[r, i]) * speeds[r] for r in range(count) if change[r, i]), 0.0 * u[0]) for i in range(n)]

    kinds = sorted({tuple(row) for row in taken})
    exact = [[int(change) * Fraction(k) for change in row] for k, row in zip(constants, made - taken)]
    alike = [[row for row, substances in zip(exact, taken) if tuple(substances) == kind] for kind in kinds]
    terms = [[sum((row[i] for row in rows), Fraction()) for rows in alike] for i in range(n)]
    expected = n - exact_rank(terms)
    reduced = AlgebraicProblem(rates, n, {"s": 1.0}).reduced
    if expected == n:
        assert reduced is None  # nothing moves
        return
    assert (0 if reduced is None else len(reduced.totals)) == expected
    if reduced is not None:
        matrix = np.array(terms, dtype=float)
        assert np.all(np.abs(reduced.totals @ matrix) <= 1e-9 * (np.abs(reduced.totals) @ np.abs(matrix)))


def test_it_is_stored_and_pickled(tmp_path):
    problem = AlgebraicProblem(enzyme, ["E", "S", "C", "P"], RATES, functionals={"bound": lambda u, p: u.C / (u.E + u.C)})
    branch = contin.trace(contin.solve(problem, [1, 10, 0, 0]), free=["k1"], limits={"k1": (0.5, 2)})
    contin.save(branch, tmp_path / "b.npz")
    for again in (contin.load(problem, tmp_path / "b.npz"), pickle.loads(pickle.dumps(branch))):
        assert again[-1]["E"] == branch[-1]["E"] and again[-1]["bound"] == branch[-1]["bound"]
        assert again[-1].system.problem == branch[-1].system.problem


@pytest.mark.parametrize("kind", ["arrays", "fills", "jacobian", "sparse"])
def test_ways_to_state_rates(kind):
    """u0 <-> u1 <-> ... with the rate 1 to the right, k to the left: u_i is proportional to k^-i."""
    n, options = 5, {}
    matrix = np.diag(np.full(n - 1, 1.0), -1) + np.diag(np.full(n - 1, 2.0), 1)
    matrix -= np.diag(matrix.sum(axis=0))

    def rates(u, p):
        u = np.array(u)
        flow = u[:-1] - p.k * u[1:]
        return np.concatenate([-flow[:1], flow[:-1] - flow[1:], flow[-1:]])

    def fill(u, p, out):
        flow = u[:-1] - p[0] * u[1:]
        out[0], out[-1] = -flow[0], flow[-1]
        out[1:-1] = flow[:-1] - flow[1:]

    if kind in ("jacobian", "sparse"):
        options["jacobian"] = lambda u, p: matrix if kind == "jacobian" else scipy.sparse.csr_array(matrix)
    problem = AlgebraicProblem(fill if kind == "fills" else rates, n, {"k": 2.0}, **options)
    point = contin.solve(problem, [1, 0, 0, 0, 0])
    shares = 0.5 ** np.arange(n)
    states = [point[f"u{i}"] for i in range(n)]
    assert states == pytest.approx(shares / shares.sum(), rel=1e-12)


def test_totals_have_few_negative_factors():
    """Whichever state comes first; the name of a total is one that is not taken."""

    def turned(u, p):
        e, s, c, made = enzyme(u, p)
        return c, e, s, made

    problem = AlgebraicProblem(turned, ["C", "E", "S", "P"], {**RATES, "total_E": 1.0})
    found = contin.solve(problem, [0.5, 0.5, 3.0, 0.1])
    assert found.system.problem.conserved.startswith("C + S + P, C + E are conserved: the parameters total_S, total_E_ ")
    assert found["total_E_"] == 1 and found["total_S"] == 0.5 + 3.0 + 0.1


def test_what_is_not_conserved_everywhere():
    """Behind a threshold, with other values of parameters, and without a value."""

    def leaks(u, p):
        flow = p.k * u.A - u.B
        return -flow - max(u.A - 200, 0) - p.out * u.A, flow

    problem = AlgebraicProblem(leaks, ["A", "B"], {"k": 2.0, "out": 0.1})
    assert problem.reduced is None
    problem = AlgebraicProblem(lambda u, p: leaks(u, p._replace(out=0.0)), ["A", "B"], {"k": 2.0, "out": 0.0})
    assert contin.solve(problem, [3, 0])["A"] == pytest.approx(1.0, abs=1e-14)
    with pytest.raises(ProblemError, match="A [+] B is conserved elsewhere, and not at the solution"):
        contin.solve(problem, [3000, 300])
    with pytest.raises(ProblemError, match="guess: must be given, or the totals among the parameters, since A [+] B is conse"):
        contin.solve(problem)
    assert contin.solve(problem, None, {"total_A": 6.0})["B"] == pytest.approx(4.0, abs=1e-13)


def test_forced_fields_say_so():
    def forced(t, u, p):
        flow = (1.5 + math.cos(t)) * u.A - u.B
        return -flow, flow

    problem = contin.CycleProblem(forced, ["A", "B"], {"k": 1.0}, period=2 * math.pi)
    with pytest.raises(ProblemError, match="A [+] B is conserved; state a forced field without A, with the total as a param"):
        contin.solve(problem, [1.0, 0.5])
