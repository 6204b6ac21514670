"""Problems in any units: with states and parameters multiplied by 1e-9 ... 1e9 the same special points come out, to 1e-9."""

import math

import numpy as np
import pytest

import contin

SIZES = [(float(10**a), float(10**b)) for a, b in np.random.default_rng(8).uniform(-9, 9, (6, 2)).round(1)]
FOLD = 3.513830719125161  # Bratu's, from its closed form


def bratu(size, unit):
    return contin.BoundaryValueProblem(
        lambda t, u, p: (u.v, -size * p.q / unit * math.exp(u.u / size)), lambda a, b, p: (a.u, b.u), ["u", "v"], {"q": 0.0},
        functionals={"mean": lambda t, u, p: u.u},
    )  # fmt: skip


@pytest.mark.sample(2)
@pytest.mark.parametrize(("size", "unit"), SIZES)
def test_fold_of_bratu(size, unit):
    start = contin.solve(bratu(size, unit), [0, 0])
    branch = contin.trace(start, free=["q"], limits={"q": (0, 4 * unit), "mean": (-size, 5 * size)})
    assert [point.label for point in branch if point.label] == ["EP", "LP", "EP"] and len(branch) < 60
    (fold,) = branch.labelled("LP")
    assert abs(fold["q"] / unit - FOLD) < max(10 * fold.errors["q"] / unit, 1e-13) < 1e-9


@pytest.mark.sample(2)
@pytest.mark.parametrize(("size", "unit"), SIZES)
def test_buckling_and_what_follows(size, unit):
    """u'' = -P sin u, u(0) = u(1) = 0: P = pi^2, 4 pi^2. Nothing shows how large u will be: it is said."""
    problem = contin.BoundaryValueProblem(
        lambda t, u, p: (u.v, -size * p.P / unit * math.sin(u.u / size)),
        lambda a, b, p: (a.u, b.u),
        ["u", "v"],
        {"P": 5.0 * unit},
    )
    scales = {"u": size, "v": size}
    trivial = contin.trace(contin.solve(problem, [0, 0]), free=["P"], limits={"P": (0, 50 * unit)}, scales=scales)
    found = [point["P"] / unit for point in trivial.labelled("BP")]
    assert found == pytest.approx([math.pi**2, 4 * math.pi**2], rel=1e-11)
    buckled = contin.trace(trivial.labelled("BP")[0], branch=1, limits={"P": (0, 50 * unit)})
    assert buckled.stop.reason == "limit" and buckled.points[-1]["P"] == pytest.approx(50 * unit)


def test_a_fold_in_a_parameter_of_size_1e_9():
    """The tangent's component of such a parameter is below all round-off of the others."""
    problem = bratu(1.0, 1e-9)
    branch = contin.trace(contin.solve(problem, [0, 0]), free=["q"], limits={"q": (0, 4e-9), "mean": (-1, 5)})
    (fold,) = branch.labelled("LP")
    assert fold["q"] == pytest.approx(FOLD * 1e-9, rel=1e-12) and fold.errors["q"] < 1e-18


def test_points_are_in_the_users_units(tmp_path):
    problem = bratu(1e6, 1e7)
    branch = contin.trace(contin.solve(problem, [0, 0]), free=["q"], limits={"q": (0, 4e7), "mean": (-1e6, 5e6)})
    (fold,) = branch.labelled("LP")
    middle = fold.system.evaluate(fold.x, np.array([0.5]))[0, 0]
    assert middle == pytest.approx(1.1868421685 * 1e6, rel=1e-9)  # of the closed form
    contin.save(branch, tmp_path / "bratu.npz")
    again = contin.load(problem, tmp_path / "bratu.npz").labelled("LP")[0]
    assert again["q"] == fold["q"] and again.system.evaluate(again.x, np.array([0.5]))[0, 0] == middle
    ahead = contin.trace(again, limits={"mean": (-1e6, 5e6)})
    assert ahead.stop.reason == "limit"


def test_sensitivity_and_fold_curve_in_odd_units():
    """The fold of u'' + q f exp(u) = 0 lies at q f = const: dq/df = -q / f."""
    problem = contin.BoundaryValueProblem(
        lambda t, u, p: (u.v, -p.q * p.f * math.exp(u.u)), lambda a, b, p: (a.u, b.u), ["u", "v"], {"q": 0.0, "f": 1e9},
        functionals={"mean": lambda t, u, p: u.u},
    )  # fmt: skip
    branch = contin.trace(contin.solve(problem, [0, 0]), free=["q"], limits={"q": (0, 4e-9), "mean": (-1, 5)})
    (fold,) = branch.labelled("LP")
    assert fold.sensitivities()["f"]["q"] == pytest.approx(-fold["q"] / 1e9, rel=1e-9)
    folds = contin.curve(fold, "f", limits={"f": (1e8, 1e10)})
    assert folds.stop.reason == "limit" and len(folds) < 60
    assert folds.column("q") * folds.column("f") == pytest.approx(np.full(len(folds), FOLD), rel=1e-11)


@pytest.mark.sample(3)
@pytest.mark.parametrize("offset", [0.0, 3.0])
@pytest.mark.parametrize("height", [1.0, 1e-3, 1e-6, 1e-9, 1e-11])
def test_folds_of_a_parameter_that_hardly_changes(height, offset):
    """lam = offset + height sin x turns at x = pi/2, 3 pi/2, ..."""
    problem = contin.AlgebraicProblem(
        lambda u, p: (p.lam - offset - height * math.sin(u.x),), ["x"], {"lam": offset}, functionals={"x": lambda u, p: u.x},
        dynamics=False,
    )  # fmt: skip
    branch = contin.trace(contin.solve(problem, [0.0]), free=["lam"], limits={"x": (-1, 20)})
    assert [point["x"] for point in branch.labelled("LP")] == pytest.approx([math.pi * (k + 0.5) for k in range(6)], abs=1e-5)


@pytest.mark.parametrize("power", [3, 5])
@pytest.mark.parametrize("start", [-1.0, -0.77])
def test_an_inflection_is_no_fold(power, start):
    problem = contin.AlgebraicProblem(lambda u, p: (p.lam - u.x**power,), ["x"], {"lam": -1.0}, dynamics=False)
    branch = contin.trace(contin.solve(problem, [start]), free=["lam"], limits={"lam": (-1, 1)})
    assert [point.label for point in branch if point.label] == ["EP", "EP"]


def test_a_branch_on_which_the_parameter_stays_has_no_folds():
    """u'' = -l u between zero ends: at l = pi^2 a line of eigenfunctions."""
    problem = contin.BoundaryValueProblem(
        lambda t, u, p: (u.v, -p.l * u.u),
        lambda a, b, p: (a.u, b.u),
        ["u", "v"],
        {"l": 9.0},
        functionals={"mean": lambda t, u, p: u.u},
    )
    trivial = contin.trace(contin.solve(problem, [0, 0]), free=["l"], limits={"l": (0, 30)})
    upright = contin.trace(trivial.labelled("BP")[0], branch=1, limits={"mean": (-50, 50)})
    assert [point.label for point in upright if point.label] == ["BP", "EP"]
    assert upright.column("l") == pytest.approx(np.full(len(upright), math.pi**2), rel=1e-11)
