"""Canard explosions: a parameter stays within 1e-10 or less while the cycle grows, and multipliers span 1e100 and more."""

from types import SimpleNamespace

import numpy as np
import pytest

import contin
from contin import AlgebraicProblem
from contin.collocation.round import _split_flow
from contin.linalg.periodic import log_eigenvalues, product_of


def van_der_pol(u, p):
    return u.y - u.x**3 / 3 + u.x, p.e * (p.a - u.x + p.k * u.y)


def cycles(e, k, **settings):
    problem = AlgebraicProblem(van_der_pol, ["x", "y"], {"a": 1.5, "e": e, "k": k})
    line = contin.trace(contin.solve(problem, [1.2, -0.6]), free=["a"], direction=-1, limits={"a": (0, 1.6)})
    (hopf,) = line.labelled("HB")
    return hopf, contin.trace(hopf, branch=1, limits={"a": (0.5, 1.6)}, **settings)


def check_monotone(e):
    """The cycles of van der Pol's equation with a constant force are stable throughout (Krupa & Szmolyan 2001): no labels."""
    hopf, branch = cycles(e, 0.0)
    assert hopf.name == "Hopf, supercritical" and hopf["a"] == pytest.approx(1.0, abs=1e-9)
    assert [point.label for point in branch if point.label] == ["HB", "EP"]
    assert branch.points[-1]["a"] == pytest.approx(0.5, abs=1e-9)
    assert branch.points[-1].floquet().unstable == 0
    return branch


def test_no_fold_in_a_mild_explosion():
    check_monotone(0.1)


@pytest.mark.full
@pytest.mark.parametrize("e", [0.02, 0.01])
def test_no_fold_where_the_parameter_stands_still(e):
    """The explosion lies near a = 1 - e/8 - 3 e^2/32 - 173 e^3/1024 - 0.01 (Zvonkin & Shubin 1984)."""
    branch = check_monotone(e)
    standing = [point["a"] for point in branch if 1.6 < point["max_x"] < 1.9]
    assert np.ptp(standing) < 1e-7
    assert np.median(standing) == pytest.approx(1 - e / 8 - 3 * e**2 / 32 - 173 * e**3 / 1024, abs=3e-7)


@pytest.mark.full
def test_a_fold_in_an_explosion():
    """A subcritical Hopf point, stable relaxation oscillations behind: one fold, the parameter known to 1e-9, the period not.

    With other roundings the fold is found at 76 or at 96: the parameter stands still from 60 on, to 1e-12.

    The multiplier in the explosion is larger than 1e5: cycles that leave the Hopf point are unstable up to the fold.
    """
    hopf, branch = cycles(0.05, -0.6)
    assert hopf.name == "Hopf, subcritical"
    (fold,) = branch.labelled("LP")
    assert [point.label for point in branch if point.label] == ["HB", "LP", "EP"]
    assert fold.errors["a"] < 1e-8 and 1 < fold.errors["period"] < 60
    before = [point for point in branch if point.arclength < fold.arclength and not point.label and point["period"] < 50]
    assert {point.floquet().unstable for point in before} == {1}
    assert branch.points[-1].floquet().unstable == 0


def test_eigenvalues_with_a_known_vector_split_off():
    """Random factors: the eigenvalues of their product by numpy, whichever of its real eigenvectors is split off."""
    factors = np.random.default_rng(0).standard_normal((6, 4, 4))
    product = np.linalg.multi_dot(factors[::-1])
    values, vectors = np.linalg.eig(product)
    positive = np.flatnonzero((values.imag == 0) & (values.real > 0))
    assert positive.size
    for i in positive:
        along = [vectors[:, i].real]
        for factor in factors:
            along.append(factor @ along[-1])
        real, imaginary, others = np.empty(4), np.empty(4), product_of(6, 3)
        given = {"flow": np.array(along), "ends": np.empty((6, 4)), "matrices": factors.copy(), "normal": np.empty((6, 3, 3))}
        _split_flow(SimpleNamespace(real=real, imaginary=imaginary, others=others, **given), 6)
        found = real + 1j * imaginary
        assert np.all(np.diff(real) <= 0)
        assert np.sort_complex(np.exp(found)) == pytest.approx(np.sort_complex(values), rel=1e-9)
        assert np.exp(found) == pytest.approx(np.exp(log_eigenvalues(factors)), rel=1e-9)


def fitzhugh_nagumo(u, p):
    return u.v - u.v**3 / 3 - u.w + p.load, p.eps * (u.v + 0.7 - 0.8 * u.w)


#: Canards at both ends; the field is the same with the load 1.75 - load and the states reflected.
EPS = [
    0.08095134978416786,  # a fold on which the load changes by less than round-off over a whole step
    pytest.param(0.06, marks=pytest.mark.full),
    pytest.param(0.04369, marks=pytest.mark.full),
    pytest.param(0.03209, marks=pytest.mark.full),
    pytest.param(0.02, marks=pytest.mark.full),  # two minutes: the steps in the explosions are short
]


@pytest.mark.full
@pytest.mark.parametrize("eps", EPS)
def test_canards_of_fitzhugh_and_nagumo(eps):
    """Cycles leave a Hopf point backwards, turn in the explosion, and do so again at the other end: HB LP LP HB, both ways.

    Hopf points in closed form: v = -+sqrt(1 - 0.8 eps), frequency sqrt(eps - 0.64 eps^2); folds are each other's images.
    """
    problem = AlgebraicProblem(fitzhugh_nagumo, ["v", "w"], {"load": 0.0, "eps": eps})
    rest = contin.trace(contin.solve(problem, [-1.2, -0.6]), free=["load"], limits={"load": (0, 2)})
    v = np.array([-1, 1]) * np.sqrt(1 - 0.8 * eps)
    known = (v + 0.7) / 0.8 - v + v**3 / 3
    assert [hopf["load"] for hopf in rest.labelled("HB")] == pytest.approx(known.tolist(), abs=1e-11)
    folds = []
    for number, hopf in enumerate(rest.labelled("HB")):
        branch = contin.trace(hopf, branch=1, limits={"load": (0, 2)})
        assert [point.label for point in branch if point.label] == ["HB", "LP", "LP", "HB"]
        end = branch.points[-1]
        assert end["load"] == pytest.approx(known[1 - number], abs=1e-12)
        assert end["period"] == pytest.approx(2 * np.pi / np.sqrt(eps - 0.64 * eps**2), rel=1e-10)
        assert end.details["frequency"] == pytest.approx(np.sqrt(eps - 0.64 * eps**2), rel=1e-10)
        assert max(end.errors.values()) < 1e-10
        assert str(branch.stop) == "the cycles shrink onto an equilibrium, a Hopf point"
        first, last = branch.labelled("LP")
        for fold in (first, last):  # a multiplier is 1 there, but where on the plateau is not known
            multipliers = fold.floquet()
            assert (np.abs(multipliers.logarithms) <= multipliers.errors * 1.001).all()
        folds += [first["load"], last["load"]]
        assert first["load"] + last["load"] == pytest.approx(1.75, abs=1e-8)  # not all errors can be told on a plateau
    assert folds[:2] == pytest.approx(folds[:1:-1], abs=1e-8)


def oregonator(u, p):
    return (u.x * (1 - u.x) + p.f * (p.q - u.x) / (p.q + u.x) * u.z) / p.eps, u.x - u.z


@pytest.mark.full
@pytest.mark.parametrize("eps", [0.1, 0.05])
def test_canards_of_the_oregonator(eps):
    """Two variables, Tyson & Fife 1980: x spans three powers of ten. Both ways give one fold, and the other Hopf point."""
    problem = AlgebraicProblem(oregonator, ["x", "z"], {"f": 0.3, "q": 0.004 if eps == 0.1 else 0.01, "eps": eps})
    rest = contin.trace(contin.solve(problem, [0.7, 0.7]), free=["f"], limits={"f": (0.2, 3.5)})
    hopfs = rest.labelled("HB")
    runs = [contin.trace(hopf, branch=1, limits={"f": (0.2, 3.5)}) for hopf in hopfs]
    for branch, other in zip(runs, hopfs[::-1]):
        assert [point.label for point in branch if point.label] == ["HB", "LP", "HB"]
        assert branch.points[-1]["f"] == pytest.approx(other["f"], abs=1e-10)
        assert branch.points[-1]["period"] == pytest.approx(2 * np.pi / other.details["frequency"], rel=1e-9)
    assert runs[0].labelled("LP")[0]["f"] == pytest.approx(runs[1].labelled("LP")[0]["f"], abs=1e-7)


@pytest.mark.full
def test_a_branch_that_bends_within_a_shorter_way_than_the_smallest_step():
    """Where canards get their head, the branch turns within 1e-8 of arclength: the run goes on, and says so."""
    problem = AlgebraicProblem(oregonator, ["x", "z"], {"f": 0.3, "eps": 0.04, "q": 8e-4})
    rest = contin.trace(contin.solve(problem, [0.7, 0.7]), free=["f"], limits={"f": (0.2, 1)})
    (hopf,) = rest.labelled("HB")
    steps = {"angle": 0.35, "accuracy": 0.02}  # with longer ones the canards are passed at once
    branch = contin.trace(hopf, branch=1, limits={"f": (0.2, 1)}, max_points=65, **steps)
    assert branch.stop.reason == "max points"
    (note,) = branch.notes
    assert note.startswith("from f = 0.5125426") and "steps below 1e-06 are taken" in note
    periods, highest = branch.column("period"), branch.column("max_x")[1:]
    assert 0 < periods.argmax() < len(periods) - 1 and np.all(np.diff(highest) > -1e-11 * highest[1:])  # within Newton's error
    held = contin.trace(hopf, branch=1, limits={"f": (0.2, 1)}, max_points=90, min_step=1e-5, **steps)
    assert held.stop.reason == "no convergence" and not held.notes  # one that was set is kept
