"""Layers whose place is known to exp(-1 / width) only: one singular value is tiny, and that is no branch point.

The right numbers are closed forms, and runs that do not look for branch points.
"""

import numpy as np
import pytest

import contin
from bank.case import UNDERRATED
from contin import BoundaryValueProblem

#: u'' = e^k (u u' - u), u(0) = -1, u(1) = 3/2, and u'' = e^k (u^3 - u), u(0) = -1, u(1) = 1, with the largest k. There
#: the last bit of the equations moves the second layer by e^k 2e-16 exp(sqrt(2) e^(k/2)), 1e-5; at k = 6 by 1e-1.
LAYERS = {
    "Lagerstrom and Cole": (lambda u, k: np.exp(k) * (u.u * u.v - u.u), 1.5, lambda t: (-1 + 2.5 * t, 2.5), 5.2),
    "Allen and Cahn": (lambda u, k: np.exp(k) * (u.u**3 - u.u), 1.0, lambda t: (-1 + 2 * t, 2), 5.2),
}


def layer(name, count=0):
    """A layer, and so many equations w'' + (pi^2 + k - 4.9) w = w^3, which bifurcate from w = 0 at k = 4.9."""
    law, right, guess, largest = LAYERS[name]
    others = [f"{letter}{number}" for number in range(count) for letter in "wz"]

    def rhs(t, u, p):
        rates = [u.v, law(u, p.k)]
        for w, z in zip(u[2::2], u[3::2]):
            rates += [z, w**3 - (np.pi**2 + p.k - 4.9) * w]
        return tuple(rates)

    def boundary(a, b, p):
        return (a.u + 1, b.u - right, *a[2::2], *b[2::2])

    problem = BoundaryValueProblem(rhs, boundary, ["u", "v", *others], {"k": 0.0})
    return contin.solve(problem, lambda t: (*guess(t), *(0.0,) * 2 * count)), {"k": (0, largest)}


@pytest.mark.parametrize("name", LAYERS)
def test_layers_are_no_branch_points(name):
    start, limits = layer(name)
    branch, plain = (contin.trace(start, free=["k"], limits=limits, branch_points=wanted) for wanted in (True, False))
    assert abs(len(branch) - len(plain)) <= 2 and len(branch) < 60  # 500 steps led to k = 5.196
    for each in (branch, plain):
        assert [point.label for point in each if point.label] == ["EP", "EP"]
        assert str(each.stop) == f"reached k = {limits['k'][1]:g}"
        assert all("round-off" in note for note in each.notes)  # that is near, with any solver


@pytest.mark.sample(1)
@pytest.mark.parametrize("name", LAYERS)
@pytest.mark.parametrize("count", [1, 2])
def test_branch_points_beside_layers(name, count):
    start, limits = layer(name, count)
    branch = contin.trace(start, free=["k"], limits=limits)
    (point,) = branch.labelled("BP")
    assert abs(point["k"] - 4.9) < UNDERRATED * point.errors["k"] < 1e-8  # round-off, which hangs on the mesh
    assert (count == 2) == ("dimension 2" in point.name)
    assert all("round-off" in note for note in branch.notes)
