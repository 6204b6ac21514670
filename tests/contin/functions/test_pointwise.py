"""Functions with numbers that are found by iteration, once a point."""

from collections import namedtuple

import numpy as np
import pytest

import contin
from contin import Batch, BoundaryValueProblem, Pointwise, ProblemError

State, Eccentricity = namedtuple("State", "M"), namedtuple("Eccentricity", "e")


def kepler(t, u, p):
    """Return E of Kepler's equation E - e sin E = M, for the mean anomaly M = u.M and the eccentricity e = p.e."""
    E = u.M
    for _ in range(60):
        E = E - (E - p.e * np.sin(E) - u.M) / (1 - p.e * np.cos(E))
    return (E,)


def anomaly(t, u, p, w):
    E = w[0] - (w[0] - p.e * np.sin(w[0]) - u.M) / (1 - p.e * np.cos(w[0]))
    return E, E * E


def distance(t, u, p, w):
    return 1 - p.e * np.cos(anomaly(t, u, p, w)[0])


def test_values_and_derivatives_share_one_search():
    """dE/dM = 1 / (1 - e cos E), dE/de = sin E / (1 - e cos E): from differentiating Kepler's equation."""
    batch = Batch([Pointwise(anomaly, kepler), Pointwise(distance, kepler)], [2, 0], ["M"], ["e"])
    E, e = np.array([0.3, 1.0, 2.5]), 0.6
    M = (E - e * np.sin(E))[:, None]
    values, jacobian = batch.jacobian(np.zeros(3), M, M[:0], np.array([e]), batch.colouring([0]))
    slope = 1 / (1 - e * np.cos(E))
    assert np.abs(values - np.array([E, E * E, 1 / slope]).T).max() < 1e-14
    assert np.abs(jacobian[:, 0] - np.array([slope, slope * np.sin(E)]).T).max() < 1e-14
    assert np.abs(jacobian[:, 1] - 2 * E[:, None] * jacobian[:, 0]).max() < 1e-14


def rough(t, u, p):
    return (1.0 + 0.0 * u.x,)


def step(t, u, p, w):
    return (w[0] - (w[0] * w[0] - u.x) / (2 * w[0]),)


def test_derivatives_start_from_what_was_found_for_the_value():
    """One Newton step for the root of 1.44 from w = 1 gives 1.22, with the slope 1/(2w) = .5: not those of the root."""
    batch = Batch([Pointwise(step, rough)], [1], ["x"], [])
    u = np.array([[1.44]])
    values, jacobian = batch.jacobian(np.zeros(1), u, u[:0], np.empty(0), batch.colouring([]))
    assert values[0, 0] == pytest.approx(1.22, abs=1e-15)
    assert jacobian[0, 0, 0] == pytest.approx(0.5, abs=1e-15)


def test_a_right_hand_side_may_be_pointwise():
    """u' = E(u) with Kepler's equation: t = integral of dM/E from u(0) to u(1), in the variable E."""
    problem = BoundaryValueProblem(
        rhs=Pointwise(lambda t, u, p, w: anomaly(t, u, p, w)[:1], kepler), boundary=lambda a, b, p: (a.M - p.start,),
        states=["M"], parameters={"e": 0.6, "start": 0.5},
    )  # fmt: skip
    found = contin.solve(problem, [0.5])
    first, last = (kepler(0, State(value), Eccentricity(0.6))[0] for value in (0.5, found.system.states(found.x)[-1, 0]))
    nodes, weights = np.polynomial.legendre.leggauss(60)
    at = (last - first) / 2 * nodes + (first + last) / 2
    time = (last - first) / 2 * (weights * (1 - 0.6 * np.cos(at)) / at).sum()
    assert time == pytest.approx(1, abs=1e-9)


def test_parts_must_be_functions():
    with pytest.raises(ProblemError, match="^solve: None must be a function$"):
        Pointwise(anomaly, None)
