"""Hopf points of equilibria whose eigenvalues are known as functions of the parameter."""

import numpy as np
import pytest

from contin import AlgebraicProblem, solve, trace


def test_hopf_of_the_normal_form():
    """x' = mu x - 2 y - ..., y' = 2 x + mu y - ...: eigenvalues mu -+ 2 i."""
    problem = AlgebraicProblem(
        lambda u, p: (p.mu * u.x - 2 * u.y - u.x * (u.x**2 + u.y**2), 2 * u.x + p.mu * u.y - u.y * (u.x**2 + u.y**2)),
        ["x", "y"], {"mu": -1.0},
    )  # fmt: skip
    branch = trace(solve(problem, [0.0, 0.0]), free=["mu"], limits={"mu": (-2, 2)})
    (hopf,) = branch.labelled("HB")
    assert abs(hopf["mu"]) < 1e-10
    assert hopf.details["frequency"] == pytest.approx(2, abs=1e-9)
    assert [p.label for p in branch if p.label] == ["EP", "HB", "EP"]
    assert sorted(hopf.system.eigenvalues(hopf.x).imag) == pytest.approx([-2, 2])


def test_neutral_saddles_are_no_hopf_points():
    """Eigenvalues 1 and mu - 1: their sum passes zero at mu = 0, both real."""
    problem = AlgebraicProblem(lambda u, p: (u.x, (p.mu - 1) * u.y), ["x", "y"], {"mu": -0.5})
    branch = trace(solve(problem, [0.0, 0.0]), free=["mu"], limits={"mu": (-0.9, 0.9)})
    assert not branch.labelled("HB")


def oscillators(*rates):
    """Independent pairs of eigenvalues rate(mu) -+ i (1 + k), rates of degree two: Hopf points where one vanishes."""
    n = 2 * len(rates)

    def residual(u, p, out):
        for k in range(n // 2):
            rate = table[k, 0] + table[k, 1] * p[0] + table[k, 2] * p[0] ** 2
            out[2 * k] = rate * u[2 * k] - (1 + k) * u[2 * k + 1]
            out[2 * k + 1] = (1 + k) * u[2 * k] + rate * u[2 * k + 1]

    table = np.array(rates, dtype=float)
    return AlgebraicProblem(residual, n, {"mu": -1.0})


@pytest.mark.parametrize(
    ("rates", "places"),
    [
        ([(0.0, 1.0, 0.0), (-0.1, 1.0, 0.0)], [0.0, 0.1]),  # two pairs, one after the other
        ([(0.0, 1.0, 0.0), (0.6, -1.0, 0.0)], [0.0, 0.6]),  # one comes, another goes
        ([(0.0, 1.0, 0.0), (-0.1, 1.0, 0.0), (-0.2, 1.0, 0.0)], [0.0, 0.1, 0.2]),
        ([(0.16, 0.0, -1.0)], [-0.4, 0.4]),  # the same pair, out and back
    ],
)
def test_several_hopf_points_in_one_step(rates, places):
    start = solve(oscillators(*rates))
    branch = trace(start, free=["mu"], limits={"mu": (-2, 1)}, step=1.7, change=1.4)
    assert len(branch) <= 4 + len(places)  # really one or two steps
    assert [point["mu"] for point in branch.labelled("HB")] == pytest.approx(places, abs=1e-10)
