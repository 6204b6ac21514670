"""Columns of AUTO's files, computed from points of contin, and runs that several demos need."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence

import numpy as np

import contin
from contin import Branch, Point

#: Gauss points of an interval, exact for the square of a piecewise polynomial of degree 9.
GAUSS = np.polynomial.legendre.leggauss(10)


def single(value: float) -> float:
    """Return what AUTO's demos make of a constant written without an exponent D: a number of single precision."""
    return float(np.float32(value))


def norm(point: Point) -> float:
    """AUTO's L2-NORM: the root of the sum of squares of the states, of its mean for a function of t."""
    system = point.system
    if not hasattr(system, "evaluate"):
        states = np.asarray(system.states(point.x))
        return float(np.sqrt((states**2).sum()))
    nodes = np.asarray(system.nodes)[:: system.degree]
    places, weights = GAUSS
    halves = np.diff(nodes) / 2
    times = (nodes[:-1, None] + halves[:, None] * (1 + places)).ravel()
    squares = (system.evaluate(point.x, times) ** 2).sum(axis=1)
    return math.sqrt((squares * (halves[:, None] * weights).ravel()).sum())


def mean(number: int) -> Callable[[Point], float]:
    """Return a function that gives the mean of a state: AUTO's column INTEGRAL."""

    def column(point: Point) -> float:
        system = point.system
        nodes = np.asarray(system.nodes)[:: system.degree]
        places, weights = GAUSS
        halves = np.diff(nodes) / 2
        times = (nodes[:-1, None] + halves[:, None] * (1 + places)).ravel()
        return float((system.evaluate(point.x, times)[:, number] * (halves[:, None] * weights).ravel()).sum())

    return column


def equilibria(field, states: Sequence[str], parameters: Mapping, guess, free: str, limits: Mapping, **more) -> Branch:
    """Return the branch of equilibria through a guess."""
    problem = contin.AlgebraicProblem(field, states, parameters)
    return contin.trace(contin.solve(problem, guess), free=[free], limits=limits, **more)


def fixed_points(field, states: Sequence[str], parameters: Mapping, guess, free: str, limits: Mapping, **more) -> Branch:
    """Return the branch of fixed points of a map through a guess."""
    problem = contin.MapProblem(field, states, parameters)
    return contin.trace(contin.solve(problem, guess), free=[free], limits=limits, **more)


def both_ways(point: Point, limits: Mapping, **more) -> list[Branch]:
    """Return the two halves of the branch that leaves from a branch point."""
    return [contin.trace(point, branch=1, direction=way, limits=limits, **more) for way in (1, -1)]


def with_branches(first: Branch, limits: Mapping, depth: int = 1, **more) -> list[Branch]:
    """Return a branch, and those that leave from its branch points, both ways, and so on to a depth."""
    found, ends = [first], [point for point in first.points[1:] if point.label == "BP"]
    for _ in range(depth):
        leaving = [branch for point in ends for branch in both_ways(point, limits, **more)]
        found += leaving
        ends = [point for branch in leaving for point in branch.points[1:-1] if point.label == "BP"]
    return found
