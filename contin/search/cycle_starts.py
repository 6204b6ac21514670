"""Where branches of cycles begin: at Hopf points of equilibria, at period doublings of cycles, and where a symmetry breaks."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from contin import checks
from contin.arrays import Array
from contin.collocation.degree import CYCLE_DEGREE
from contin.collocation.mesh import MeshControl
from contin.core.labels import Label
from contin.core.scales import usual
from contin.cycles.floquet import doubles
from contin.cycles.maps import MapSystem
from contin.cycles.statement import CycleProblem
from contin.cycles.system import CycleCollocation, PeriodicCollocation
from contin.equilibria.lyapunov import CriticalPair, critical_pair
from contin.equilibria.system import Algebraic
from contin.errors import ProblemError
from contin.events.branch_point import BranchPoint, locate_branch_point
from contin.events.labelled import frequency_of
from contin.levels import APART
from contin.problems.angles import windings
from contin.problems.own_names import PERIOD, ROUNDS
from contin.results.point import Point

#: Intervals of the first mesh of a branch from a Hopf point, at least. A run that wants 40 would make its first step on 20 and,
#: again, on 40: that takes a tenth of a branch of Lorenz's cycles.
_INTERVALS = 20


def switches(point: Point) -> bool:
    """Return whether a branch of another kind begins at a point."""
    return point.system.starts_cycles and (point.label == Label.HOPF or doubles(point))


def switched(
    point: Point, fewest: int, free: Sequence[str] | None = None
) -> tuple[PeriodicCollocation | MapSystem, Array, Array]:
    """Return the system of the cycles that begin at a point, the point in it, and the tangent there.

    Free parameters are those of the point, or others: the new branch leaves along the states alone, whichever are free. The
    first mesh from a Hopf point has the ``fewest`` intervals of a run, or more.

    Raises
    ------
    ProblemError
        None begin there.
    ConvergenceError
        The branch point of doubled orbits is not found.
    """
    cycles, x, tangent = doubled(point) if doubles(point) else from_hopf(point, max(fewest, _INTERVALS))
    if free is None:
        return cycles, x, tangent
    found, x = cycles.with_free(checks.names("free", free), x)
    along: Any = found.pack(cycles.states(tangent), dict.fromkeys(found.free, 0.0))
    return found, x, along  # type: ignore[return-value]  # with_free keeps the kind


def from_hopf(point: Point, intervals: int) -> tuple[CycleCollocation, Array, Array]:
    """Return the system of the cycles that leave a Hopf point, the point as an orbit of no size, and the tangent there.

    The tangent is the ellipse of the critical eigenvector v, Re(v exp(2 pi i t)), with the period 2 pi over the frequency.

    Raises
    ------
    ProblemError
        It is no Hopf point of equilibria.
    """
    system: Any = point.system
    if point.label != Label.HOPF or system.is_cycle or not system.starts_cycles:
        raise ProblemError(f"start: a point with the label {point.label!r} is no Hopf point of equilibria")
    pair = critical_pair(system.jacobian(point.x), frequency_of(point))
    if not pair.is_critical:
        raise ProblemError("start: the Jacobian of the field has no pair on the imaginary axis there, of which cycles begin")
    cycles, x, tangent = small_cycle(system, point.x, pair, 0.0, intervals)
    scaled, x = _in_sizes_of_the_equilibrium(cycles, x)
    if scaled is not cycles:
        tangent = cycles.carrier(scaled)(tangent)
    return scaled.with_reference(x + tangent / np.abs(tangent).max()), x, tangent


def _in_sizes_of_the_equilibrium(cycles: CycleCollocation, x: Array) -> tuple[CycleCollocation, Array]:
    """Return the system of cycles with the sizes of the states and the period of a Hopf point, and x for it.

    Where nothing is far from one it is the same. Sizes that the cycles outgrow are renewed on the way.
    """
    states, names = np.abs(cycles.states(x)).max(axis=0), list(cycles.problem.parameters)
    states = np.where(states > APART * states.max(), states, 0.0)
    parameters = np.ones(len(names))
    parameters[[names.index(name) for name in cycles.free]] = np.abs([cycles.parameter(x, name) for name in cycles.free])
    sizes = usual(np.where(states > APART, states, 0.0)), usual(np.where(parameters > APART, parameters, 0.0))
    if all(np.all(found == 1) for found in sizes):
        return cycles, x
    scaled, x = cycles.with_scales(x, *sizes)
    return scaled, x


def small_cycle(
    system: Algebraic, x: Array, pair: CriticalPair, size: float, intervals: int = _INTERVALS
) -> tuple[CycleCollocation, Array, Array]:
    """Return the system of cycles beside a Hopf point x, the ellipse of this size as one, and the direction in which it grows.

    The free parameters are those of ``system`` and, after the first, the period.
    """
    first, *others = system.free
    parameters = dict(zip(system.problem.parameters, map(float, system.all_parameters(x))))
    parameters[PERIOD] = 2 * math.pi / pair.frequency
    mesh = np.linspace(0, 1, intervals + 1)
    cycles = CycleCollocation(CycleProblem.of(system.problem), mesh, CYCLE_DEGREE, (first, PERIOD, *others), parameters)
    wave = np.exp(2j * math.pi * cycles.nodes)[:, None]
    rest = cycles.pack(np.tile(system.states(x), (cycles.nodes.size, 1)), parameters)
    tangent = cycles.pack((wave * pair.right).real, dict.fromkeys(cycles.free, 0.0))
    return (cycles.with_reference(rest + size * tangent) if size else cycles), rest + size * tangent, tangent


def doubled(point: Point) -> tuple[PeriodicCollocation | MapSystem, Array, Array]:
    """Return the system of orbits of twice the period, a period-doubling point as such an orbit, and the tangent there.

    The orbit, traversed twice, is a branch point of that system; the new branch leaves along perturbations that change their
    sign from one round to the next. With a symmetry S a round is one n-th of the period, the new orbits have the symmetry S^2
    and, if n is even, about the same period.

    Raises
    ------
    ProblemError
        It is no period-doubling point.
    ConvergenceError
        The branch point is not found.
    """
    system: Any = point.system
    if not doubles(point):
        raise ProblemError(f"start: a point with the label {point.label!r} is no period doubling")
    if not system.intervals:
        return _doubled_map(system, point.x)
    adapted = system.adapted(point.x, MeshControl())  # the point is located on a mesh finer than the run needs
    system, x = (system, point.x) if adapted is None else (adapted[0], adapted[1](point.x))
    mesh = np.concatenate([system.mesh, 1 + system.mesh[1:]]) / 2
    longer, factor = PERIOD if system.problem.period is None else ROUNDS, 2 if system.order % 2 else 1
    problem, turn, gained = system.problem, system.problem.symmetry, system.gains[1]
    further = windings(problem.angles, problem.state_names, gained + turn @ gained)
    parameters = {**point.parameters, longer: factor * point.parameters[longer], **further}
    twice: Any = problem.doubled().discretized(system.free, parameters, system.scales, mesh, system.degree)
    states = system.states(x)
    x = twice.pack(np.concatenate([states, states[1:] @ turn.T + gained]), parameters)
    found = locate_branch_point(twice.with_reference(x), x)
    return twice.with_reference(found.x), found.x, _alternating(twice, found, turn)


def _doubled_map(system: MapSystem, x: Array) -> tuple[MapSystem, Array, Array]:
    """Return the same of a map: the new branch leaves along a tangent that is none of the branch of single cycles."""
    twice, x = system.doubled(x)
    found = locate_branch_point(twice, x)

    def change(tangent: Array) -> float:
        first, second = np.split(twice.states(tangent), 2)
        return float(np.abs(second - first).max())

    return twice, found.x, max(found.tangents, key=change)


def _alternating(twice: PeriodicCollocation, found: BranchPoint, turn: Array) -> Array:
    """Return the unit tangent that changes most from one round to the next, turned by the symmetry.

    The states of the other one may be round-off, as where the cycles do not depend on the parameter: no share of them tells.
    """
    half = twice.nodes.size // 2

    def change(tangent: Array) -> float:
        states = twice.states(tangent)
        return float(np.abs(states[: half + 1] @ turn.T - states[half:]).max())

    return max(found.tangents, key=change)
