"""A homoclinic orbit from a cycle of long period, or from its saddle."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from contin import checks
from contin.arrays import Array
from contin.collocation.degree import usual_degree
from contin.collocation.mesh import MeshControl
from contin.connections.statement import ConnectionProblem
from contin.connections.system import ConnectionCollocation
from contin.core.newton import Newton
from contin.cycles.homoclinic import equilibrium_beside
from contin.cycles.system import CycleCollocation
from contin.errors import ProblemError
from contin.linalg.orientation import first_least
from contin.problems.angles import periods_of, whole_rounds, winding_names, windings
from contin.problems.own_names import PERIOD, TIME
from contin.problems.statement import declared
from contin.results.point import Point
from contin.search.grown_orbit import grown_orbit
from contin.search.solving import solved
from contin.search.takens import INTERVALS


@checks.arguments
def homoclinic(
    start: Point, free: Sequence[str], *, limits: Mapping[str, tuple[float, float]] | None = None, direction: int = 1,
    mesh: MeshControl | None = None, newton: Newton = Newton(),
) -> Point:  # fmt: skip
    """Return the homoclinic orbit near a cycle that spends most of its period beside a saddle, or one of a saddle itself.

    The cycle is cut where it comes closest to the saddle, and corrected as a `ConnectionProblem`. Its time is the period of
    the cycle. Follow the result with two free parameters, or with ``time`` and one to make the column ``gap`` smaller.

    From a saddle with a single unstable (or stable) eigenvalue, orbits that leave (or enter) along its eigenvector are followed
    to where they come back, for values of the parameter from the present one on.

    Parameters
    ----------
    start : Point
        Of a `CycleProblem`; or an equilibrium, of an `AlgebraicProblem`.
    free : sequence of str
        The parameter to be found.
    limits : mapping of str to pair of float
        From an equilibrium: the least and the largest value of that parameter.
    direction : int
        From an equilibrium: the orbit leaves along the eigenvector whose largest component is positive (1) or negative (-1).
    mesh, newton : optional
        As in `solve`.

    Raises
    ------
    ProblemError
        The start is no cycle and no saddle, or a saddle with several unstable and several stable eigenvalues.
    ConvergenceError
        No homoclinic orbit is found near the cycle, or within the limits.

    Examples
    --------
    >>> import contin
    >>> def field(u, p):
    ...     return u.y, u.x - u.x**2 + u.y * (p.mu + u.x) / 2
    >>> rest = contin.solve(contin.AlgebraicProblem(field, ["x", "y"], {"mu": -1.1}), [1.0, 0.0])
    >>> (hopf,) = contin.trace(rest, free=["mu"], limits={"mu": (-1.1, -0.9)}).labelled("HB")
    >>> cycles = contin.trace(hopf, branch=1, limits={"period": (0, 20)}, errors=False)
    >>> orbit = homoclinic(cycles.points[-1], free=["mu"])
    >>> abs(orbit["mu"] - cycles.points[-1]["mu"]) < 1e-4 and orbit["gap"] < 1e-3
    True

    The same from the saddle at the origin:

    >>> saddle = contin.solve(contin.AlgebraicProblem(field, ["x", "y"], {"mu": -0.9}), [0.0, 0.0])
    >>> grown = homoclinic(saddle, free=["mu"], limits={"mu": (-1, -0.8)})
    >>> abs(grown["mu"] - orbit["mu"]) < 1e-6
    True
    """
    control = MeshControl() if mesh is None else mesh
    system: Any = start.system
    if not system.on_curve and not system.intervals and declared(system.problem, "dynamics"):
        return _from_saddle(start, free, limits, direction, (control, newton))
    if limits is not None and system.size_of_solutions is not None:
        raise ProblemError("limits: are for a start at an equilibrium; the orbit is looked for near the cycle")
    return _from_cycle(start, free, (control, newton))


def _from_saddle(
    start: Point, free: Sequence[str], limits: Mapping[str, tuple[float, float]] | None, direction: int,
    options: tuple[MeshControl, Newton],
) -> Point:  # fmt: skip
    """Return the homoclinic orbit that an orbit grown from a saddle leads to."""
    system: Any = start.system
    names = checks.names("free", free)
    if len(names) != 1 or names[0] not in system.problem.parameters:
        raise ProblemError(f"free: {', '.join(names)} must be one of the parameters {', '.join(system.problem.parameters)}")
    (name,) = names
    known = checks.mapping("limits", limits or {}, "pairs of numbers")
    if set(known) != {name}:
        raise ProblemError(f"limits: must hold the least and the largest value of {name}, as in limits={{{name!r}: (0, 1)}}")
    ends = tuple(checks.sequence(f"limits: {name}", known[name], "two numbers, the first the smaller"))
    if len(ends) != 2 or not all(checks.is_number(end) for end in ends):
        raise ProblemError(f"limits: {name}: {checks.shown(ends)} must be two numbers, the first the smaller")
    low, high = ends
    if not low <= start[name] <= high:
        raise ProblemError(f"limits: {name} = {start[name]:.6g} at the start must lie between {low:.6g} and {high:.6g}")
    if direction not in (1, -1):
        raise ProblemError(f"direction: {checks.shown(direction)} must be 1 or -1")
    orbit, unstable = grown_orbit(start, name, (low, high), direction)
    states, angles = system.problem.state_names, system.problem.angles
    problem = ConnectionProblem(system.problem.residual, states, start.parameters, unstable=unstable, angles=angles)
    rounds = windings(angles, states, orbit.states[-1] - orbit.states[0])
    rest = orbit.rest + whole_rounds(orbit.states[0] - orbit.rest, periods_of(system.problem))
    values = {**start.parameters, name: orbit.value, TIME: float(orbit.times[-1]), **rounds}
    values |= dict(zip(problem.multipliers, rest))
    times = orbit.times / orbit.times[-1]
    degree = usual_degree(len(states), options[0].tolerance)
    every = max(1, len(times) // INTERVALS)
    points = np.append(times[:-1:every], 1.0)
    started = ConnectionCollocation(problem, points, degree, names, values)
    x = started.pack(np.stack([np.interp(started.nodes, times, column) for column in orbit.states.T], axis=1), values)
    return solved(started.with_reference(x), x, *options)


def _from_cycle(cycle: Point, free: Sequence[str], options: tuple[MeshControl, Newton]) -> Point:
    """Return the homoclinic orbit near a cycle."""
    system: Any = cycle.system
    names = checks.names("free", free)
    if len(names) != 1 or names[0] not in system.problem.parameters or names[0] == PERIOD:
        raise ProblemError(f"free: {', '.join(names) or 'none'} must be one parameter, in which the orbit is looked for")
    if system.size_of_solutions is None:
        raise ProblemError("start: must be a point of a CycleProblem, or an equilibrium of an AlgebraicProblem")
    if system.order > 1:
        raise ProblemError("start: must be a cycle without a symmetry; solve takes it as a guess of such a CycleProblem")
    states, names = system.states(cycle.x), system.problem.state_names
    rest, unstable = _saddle(system, cycle.x)
    angles, periods = system.problem.angles, periods_of(system.problem)
    own = (PERIOD, *winding_names(angles))
    parameters = {name: value for name, value in cycle.parameters.items() if name not in own}
    problem = ConnectionProblem(system.problem.field, names, parameters, unstable=unstable, angles=angles)
    degree = system.degree
    apart = states[::degree] - rest
    cut = first_least(np.abs(apart - whole_rounds(apart, periods)).max(axis=1)[:-1])  # at a mesh point
    rest = rest + whole_rounds(apart[cut], periods)
    mesh_points = np.concatenate([system.mesh[cut:], 1 + system.mesh[1 : cut + 1]]) - system.mesh[cut]
    mesh_points[-1] = 1.0
    turned = np.concatenate([states[cut * degree :], states[1 : cut * degree + 1] + system.gains[-1]])
    rounds = {name: cycle.parameters[name] for name in winding_names(angles)}
    values = {**parameters, **rounds, TIME: cycle.parameters[PERIOD], **dict(zip(problem.multipliers, rest))}
    started = ConnectionCollocation(problem, mesh_points, degree, tuple(free), values)
    x = started.pack(turned, values)
    return solved(started.with_reference(x), x, *options)


def _saddle(system: CycleCollocation, x: Array) -> tuple[Array, int]:
    """Return the equilibrium beside a cycle, shape (n,), and the number of its unstable eigenvalues.

    Raises
    ------
    ProblemError
        None is found from where the motion is slowest, or it is no saddle.
    """
    found = equilibrium_beside(system, x)
    if found is None:
        raise ProblemError("start: no equilibrium is found from where it is slowest; take a cycle of longer period")
    states, eigenvalues = found
    unstable = int(np.count_nonzero(eigenvalues.real > 0))
    if unstable in (0, len(eigenvalues)):
        kind = "stable" if unstable == 0 else "a source"
        raise ProblemError(f"start: the equilibrium where it is slowest is {kind}, no saddle; take a cycle of longer period")
    return states * system.scales.states, unstable
