"""A homoclinic orbit from a cycle of long period."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from contin import checks
from contin.analysis.solving import solved
from contin.arrays import Array
from contin.detection.homoclinic import equilibrium_beside
from contin.discretization.connections import ConnectionCollocation
from contin.discretization.cycles import CycleCollocation
from contin.discretization.mesh import MeshControl
from contin.errors import ProblemError
from contin.linalg.orientation import first_least
from contin.problems.angles import periods_of, whole_rounds, winding_names
from contin.problems.connection import TIME, ConnectionProblem
from contin.problems.cycle import PERIOD
from contin.results.point import Point
from contin.stepping.newton import Newton


def homoclinic(cycle: Point, free: Sequence[str], *, mesh: MeshControl | None = None, newton: Newton = Newton()) -> Point:
    """Return the homoclinic orbit near a cycle that spends most of its period beside a saddle.

    The cycle is cut where it comes closest to the saddle, and corrected as a `ConnectionProblem`. Its time is the period of
    the cycle. Follow the result with two free parameters, or with ``time`` and one to make the column ``gap`` smaller.

    Parameters
    ----------
    cycle : Point
        Of a `CycleProblem`.
    free : sequence of str
        The parameter to be found.
    mesh, newton : optional
        As in `solve`.

    Raises
    ------
    ProblemError
        It is no cycle, or the equilibrium next to it is no saddle.
    ConvergenceError
        No homoclinic orbit is found near the cycle.

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
    """
    checks.instance("cycle", cycle, Point, "a Point")
    system: Any = cycle.system
    if not isinstance(system, CycleCollocation):
        raise ProblemError("cycle: must be a point of a CycleProblem")
    if system.order > 1:
        raise ProblemError("cycle: must be one without a symmetry; solve takes this one as a guess of such a CycleProblem")
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
    windings = {name: cycle.parameters[name] for name in winding_names(angles)}
    values = {**parameters, **windings, TIME: cycle.parameters[PERIOD], **dict(zip(problem.multipliers, rest))}
    started = ConnectionCollocation(problem, mesh_points, degree, tuple(free), values)
    x = started.pack(turned, values)
    return solved(started.with_reference(x), x, MeshControl() if mesh is None else mesh, newton)


def _saddle(system: CycleCollocation, x: Array) -> tuple[Array, int]:
    """Return the equilibrium beside a cycle, shape (n,), and the number of its unstable eigenvalues.

    Raises
    ------
    ProblemError
        None is found from where the motion is slowest, or it is no saddle.
    """
    found = equilibrium_beside(system, x)
    if found is None:
        raise ProblemError("cycle: no equilibrium is found from where it is slowest; take a cycle of longer period")
    states, eigenvalues = found
    unstable = int(np.count_nonzero(eigenvalues.real > 0))
    if unstable in (0, len(eigenvalues)):
        kind = "stable" if unstable == 0 else "a source"
        raise ProblemError(f"cycle: the equilibrium where it is slowest is {kind}, no saddle; take a cycle of longer period")
    return states if system.scales is None else states * system.scales.states, unstable
