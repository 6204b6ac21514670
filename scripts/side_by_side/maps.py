"""Demos of maps."""

from __future__ import annotations

import functools

import contin
from side_by_side.columns import fixed_points, single, with_branches
from side_by_side.record import Demo, Part


def logistic(u, p):
    """The logistic map."""
    return (p.mu * u.x * (1 - u.x),)


@functools.cache
def log_single():
    """Fixed points: zero, and the one that leaves it."""
    first = fixed_points(logistic, ["x"], {"mu": 0.0}, [0.0], "mu", {"mu": (0, 3.6)})
    return [first, contin.trace(first.labelled("BP")[0], branch=1, direction=1, limits={"mu": (0, 3.6)})]


@functools.cache
def log_doubled(times: int):
    """Cycles of 2, 4, 8, ... points."""
    before = log_single()[1] if times == 1 else log_doubled(times - 1)
    return contin.trace(before.labelled("PD")[0], branch=1, limits={"mu": (0, 3.6)})


def predators(u, p):
    """A discrete system of predators and prey."""
    return p.p1 * u.x * (1 - u.x) - p.p2 * u.x * u.y, (1 - p.p3) * u.y + p.p2 * u.x * u.y


@functools.cache
def dd2_single():
    """Fixed points: none, prey alone, both."""
    values, limits = {"p1": 0.0, "p2": single(0.2), "p3": single(0.1)}, {"p1": (0, 5)}
    first = fixed_points(predators, ["x", "y"], values, [0.0, 0.0], "p1", limits)
    return with_branches(first, {"p1": (0, 5), "x": (-5.0434912, 5), "y": (-4.9965421, 4.9965421)}, depth=2)


@functools.cache
def dd2_doubled(times: int):
    """Cycles of 2 and of 4 points."""
    if times == 1:
        point = [point for branch in dd2_single() for point in branch.labelled("PD")][0]
    else:
        point = dd2_doubled(times - 1).labelled("PD")[0]
    return contin.trace(point, branch=1, limits={"p1": (0, 5)})


def henon(u, p):
    """Hénon's map."""
    return u.y, p.alpha - p.beta * u.x - u.y**2


@functools.cache
def hen_beta():
    """Fixed points in beta."""
    return fixed_points(henon, ["x", "y"], {"alpha": 2.0, "beta": 0.0}, [1.0, 1.0], "beta", {"beta": (0, 1.05)})


@functools.cache
def hen_alpha():
    """Fixed points in alpha, past their fold."""
    values, limits = {"alpha": 2.0, "beta": 0.0}, {"alpha": (-2, 4)}
    return fixed_points(henon, ["x", "y"], values, [1.0, 1.0], "alpha", limits, direction=-1)


def hen_folds():
    """The curve of folds."""
    fold = hen_alpha().labelled("LP")[0]
    limits = {"alpha": (-2, 4), "beta": (-3, 3)}
    return [contin.curve(fold, free=["alpha", "beta"], direction=way, limits=limits) for way in (1, -1)]


def demos() -> list[Demo]:
    """Return the demos."""
    columns = {"mu": "mu", "x": "x"}
    return [
        Demo("log", "doublings of the logistic map", [
            Part([0], log_single, columns, known=[("PD", {"mu": 3.0, "x": 2 / 3}), ("BP", {"mu": 1.0, "x": 0.0})]),
            *(Part([n], functools.partial(lambda n: [log_doubled(n)], n), {"mu": "mu"}, labels=("PD",),
                   known=[("PD", {"mu": 1 + 6**0.5})] if n == 1 else []) for n in range(1, 6)),
        ], note="AUTO's x of a cycle is any one of its points, and is not compared."),
        Demo("dd2", "a discrete system of predators and prey", [
            Part([0], dd2_single, {"p1": "p1", "u1": "x", "u2": "y"}),
            *(Part([n + 1], functools.partial(lambda n: [dd2_doubled(n)], n), {"p1": "p1"}, labels=("PD",)) for n in (1, 2)),
        ], note="The curve of period doublings (AUTO's second run) has no labelled point but its end; contin has no such "
                "curves of maps."),
        Demo("hen", "Hénon's map", [
            Part([0], lambda: [hen_beta()], {"beta": "beta", "x": "x"},
                 known=[("PD", {"beta": 2 * (2 / 3) ** 0.5 - 1}), ("TR", {"beta": 1.0, "x": 3**0.5 - 1})]),
            Part([5], lambda: [hen_alpha()], {"alpha": "alpha", "x": "x"},
                 known=[("PD", {"alpha": 0.75, "x": 0.5}), ("LP", {"alpha": -0.25, "x": -0.5})]),
            Part([6, 7], hen_folds, {"alpha": "alpha", "beta": "beta", "x": "x"},
                 known=[("R1", {"alpha": -1.0, "beta": 1.0, "x": -1.0}), ("LPD", {"alpha": 0.0, "beta": -1.0, "x": 0.0})]),
        ], note="The curves of period doublings and of torus bifurcations (runs 2 to 5) are not compared: contin has no such "
                "curves of maps."),
    ]  # fmt: skip
