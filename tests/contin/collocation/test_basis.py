"""Tables of a degree: exact for polynomials of that degree."""

import math

import numpy as np
import pytest

from contin import ProblemError
from contin.lowlevel import basis, interpolation

each_degree = pytest.mark.parametrize("degree", range(2, 9))


@each_degree
def test_values_and_derivatives_at_the_gauss_points(degree):
    """t^degree, its slope and its derivative of the highest order."""
    tables = basis(degree)
    power = tables.nodes**degree
    assert np.allclose(tables.value @ power, tables.points**degree, atol=1e-14)
    assert np.allclose(tables.slope @ power, degree * tables.points ** (degree - 1), atol=1e-12)
    assert math.isclose(tables.highest @ power, math.factorial(degree), rel_tol=1e-9)


@each_degree
def test_both_quadratures_are_of_their_order(degree):
    """Gauss: exact to degree 2 d - 1; Lobatto with d + 1 nodes: too; the next power has an error."""
    tables = basis(degree)
    for places, weights in ((tables.points, tables.weights), (tables.nodes, tables.node_weights)):
        for power in range(2 * degree):
            assert weights @ places**power == pytest.approx(1 / (power + 1), rel=1e-13)
        assert abs(weights @ places ** (2 * degree) - 1 / (2 * degree + 1)) > 1e-12


@each_degree
def test_interpolation_of_a_polynomial_and_its_error(degree):
    """Exact for t^degree, at a node too; for t^(degree + 1) the largest error is ``constant`` times the factorial."""
    tables, fine = basis(degree), np.linspace(0, 1, 2001)
    at = np.append(fine, tables.nodes)
    matrix = interpolation(tables.nodes, tables.barycentric, at)
    assert matrix @ tables.nodes**degree == pytest.approx(at**degree, abs=1e-13)
    error = np.abs(matrix @ tables.nodes ** (degree + 1) - at ** (degree + 1)).max()
    assert error == pytest.approx(tables.constant * math.factorial(degree + 1), rel=1e-6, abs=1e-13)


@pytest.mark.parametrize("degree", [1, 9])
def test_degrees_that_there_are_not(degree):
    with pytest.raises(ProblemError, match=f"degree: {degree} must be a whole number from 2 to 8"):
        basis(degree)
