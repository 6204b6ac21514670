"""Lobatto nodes, Gauss points and interpolation on the unit interval."""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np

from contin.arrays import Array
from contin.errors import ProblemError
from contin.shown import shown

DEGREES = range(2, 9)


@dataclass(frozen=True)
class Basis:
    """Tables of one degree d on the unit interval.

    ``nodes`` (d + 1,) Lobatto points and ``node_weights`` their quadrature; ``points`` (d,) Gauss points and
    ``weights`` theirs; ``value`` and ``slope`` (d, d + 1) take nodal values to the Gauss points; ``highest`` (d + 1,)
    gives the d-th derivative; ``barycentric`` (d + 1,) for interpolation; ``constant`` is max |prod (x - node)| / (d + 1)!.
    """

    degree: int
    nodes: Array
    node_weights: Array
    points: Array
    weights: Array
    value: Array
    slope: Array
    highest: Array
    barycentric: Array
    constant: float

    __repr__ = shown

    @functools.cached_property
    def runge_kutta(self) -> Array:
        """The matrix of the Gauss method."""
        return self.integrals(self.points)

    def integrals(self, ends: Array) -> Array:
        """Return the matrix (len(ends), d) that integrates values at the Gauss points from 0 to each of the ends."""
        lagrange = 1 / np.prod(self.points[:, None] - self.points + np.eye(self.degree), axis=1)
        return np.array([end * self.weights @ interpolation(self.points, lagrange, end * self.points) for end in ends])


@functools.cache
def basis(degree: int) -> Basis:
    """Return the tables of a degree from 2 to 8.

    Raises
    ------
    ProblemError

    Examples
    --------
    >>> basis(2).nodes.tolist()
    [0.0, 0.5, 1.0]
    """
    if degree not in DEGREES:
        raise ProblemError(f"degree: {degree!r} must be a whole number from 2 to 8")
    legendre = np.polynomial.legendre
    points, weights = legendre.leggauss(degree)
    top = np.zeros(degree + 1)
    top[-1] = 1.0
    nodes = np.concatenate([[-1.0], np.sort(legendre.legroots(legendre.legder(top)).real), [1.0]])
    node_weights = 2 / (degree * (degree + 1) * legendre.legval(nodes, top) ** 2)
    nodes, points = (nodes + 1) / 2, (points + 1) / 2
    differences = nodes[:, None] - nodes + np.eye(degree + 1)
    barycentric = 1 / differences.prod(axis=1)
    value = interpolation(nodes, barycentric, points)
    nodal_slope = barycentric / barycentric[:, None] / differences
    np.fill_diagonal(nodal_slope, 0.0)
    np.fill_diagonal(nodal_slope, -nodal_slope.sum(axis=1))
    factorial = np.prod(np.arange(1.0, degree + 1))
    fine = np.linspace(0, 1, 2001)
    constant = np.abs((fine[:, None] - nodes).prod(axis=1)).max() / (factorial * (degree + 1))
    tables = (nodes, node_weights / 2, points, weights / 2, value, value @ nodal_slope, factorial * barycentric, barycentric)
    return Basis(degree, *tables, constant)


def interpolation(nodes: Array, barycentric: Array, at: Array) -> Array:
    """Return the matrix (len(at), len(nodes)) that evaluates the polynomial through the nodes at points (barycentric form).

    Examples
    --------
    >>> table = basis(2)
    >>> interpolation(table.nodes, table.barycentric, np.array([0.25])) @ table.nodes**2  # exact for polynomials of degree 2
    array([0.0625])
    """
    distance = at[:, None] - nodes
    exact = distance == 0
    terms = barycentric / np.where(exact, 1.0, distance)
    matrix = terms / terms.sum(axis=1, keepdims=True)
    return np.where(exact.any(axis=1, keepdims=True), exact, matrix)
