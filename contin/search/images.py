"""Images of solutions under symmetries, and whether two solutions are one."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from contin import checks
from contin.arrays import Array
from contin.core.protocol import Discretization, inner
from contin.errors import ProblemError
from contin.functions.signature import argument_count
from contin.problems.statement import declared

#: Maps times (K,) and states (K, n) of a solution to the states of another one.
Symmetry = Callable[[np.ndarray, np.ndarray], np.ndarray]
#: A system, and its unknowns.
Solution = tuple[Discretization, Array]


def check_maps(what: str, maps: Sequence[Symmetry]) -> None:
    """Require functions of two arguments."""
    for each in checks.sequence(what, maps, "functions"):
        if argument_count(checks.function(what, each)) != 2:
            raise ProblemError(f"{what}: {checks.shown(each)} must take 2 arguments, times (K,) and states (K, n)")


def image(system: Discretization, symmetry: Symmetry, x: Array) -> Array:
    """Return the image of unknowns; of a variational problem the states x have one, multipliers stay (see `seen`)."""
    states = system.states(x).copy()
    visible = states[:, : declared(system.problem, "dimension")]
    visible[:] = symmetry(system.nodes, visible.copy())
    return np.concatenate([(states / system.scales.states).ravel(), x[system.state_size :]])


def seen(system: Discretization, x: Array) -> Array:
    """Return unknowns without multipliers: these follow from the others, and change their sign under symmetries."""
    problem: Any = system.problem
    if declared(problem, "dimension") == len(problem.states):
        return x
    x = x.copy()
    x[: system.state_size].reshape(-1, len(problem.state_names))[:, problem.dimension :] = 0.0
    x[[system.parameter_index(name) for name in problem.multipliers]] = 0.0
    return x


def evenly(system: Any) -> Discretization:
    """Return a system of a problem, on a uniform mesh if it has one: maps that reverse t take nodes to nodes."""
    if not system.is_function_of_t:
        return system
    a, b = system.problem.domain
    return system.on_mesh(np.linspace(a, b, system.intervals + 1))[0]


def are_one(first: Solution, second: Solution, symmetries: Sequence[Symmetry], tolerance: float) -> bool:
    """Return whether a solution is another one, or its image under one of the symmetries, compared on a uniform mesh.

    Both have the same free parameters.
    """
    system = evenly(first[0])
    there = seen(system, first[0].carrier(system)(first[1]))
    other = second[0].carrier(system)(second[1])
    largest = tolerance * (1 + np.sqrt(inner(system, there, there)))
    for symmetry in symmetries:
        here, _ = system.in_phase(seen(system, image(system, symmetry, other)), (), there)
        if np.sqrt(inner(system, here - there, here - there)) <= largest:
            return True
    return False
