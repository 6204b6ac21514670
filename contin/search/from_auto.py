"""A point of contin from a solution of AUTO-07p."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from contin import checks
from contin.arrays import Array
from contin.boundary.statement import BoundaryValueProblem
from contin.collocation.basis import basis, interpolation
from contin.continuation.run import Continuation
from contin.core.labels import Label
from contin.core.settings import Settings
from contin.core.system import System
from contin.cycles.statement import CycleProblem
from contin.equilibria.statement import AlgebraicProblem
from contin.equilibria.system import Algebraic
from contin.errors import ConvergenceError, ProblemError
from contin.problems.angles import windings
from contin.problems.own_names import PERIOD, ROUNDS
from contin.problems.statement import with_multipliers
from contin.results.auto_07p import AutoSolution
from contin.results.point import Point

#: Labels of points that contin locates, too.
_LOCATED = (Label.BRANCH_POINT, Label.FOLD, Label.HOPF, Label.PERIOD_DOUBLING, Label.TORUS)
#: First step of the runs back from AUTO's solution and across it, in units of arclength. Ten times larger, more than one point
#: of a kind can lie in it.
_STEP = 0.01
#: Most points of the run that looks for AUTO's point: steps grow from the first one, so that two or three lead there.
_LOOKS = 20
#: The point found is AUTO's if its parameter is as close as this: AUTO's tolerance of special points is 1e-4 by default. Ten
#: times larger, the next point of the same kind could be taken.
_CLOSE = 1e-2
#: AUTO's number of the period.
_PERIOD = "PAR(11)"


@checks.arguments
def from_auto(
    problem: BoundaryValueProblem | AlgebraicProblem, solution: AutoSolution, *, free: Sequence[str],
    parameters: Mapping[str, float] | None = None,
) -> Point:  # fmt: skip
    """Return the point of a problem that a solution of AUTO-07p states, corrected and, at BP, LP, HB, PD and TR, located.

    Parameters
    ----------
    problem : BoundaryValueProblem or AlgebraicProblem
        With the states in AUTO's order. Of cycles the period is AUTO's PAR(11).
    solution : AutoSolution
        Of `read_auto`.
    free : sequence of str
        The free parameters of the branch, the first is the primary one.
    parameters : mapping of str to float, optional
        Values of parameters that AUTO has under another name, or not at all.

    Raises
    ------
    ProblemError
        The solution lacks a parameter of the problem, or has another number of states.
    ConvergenceError
        No such point of the problem is near by: it states other equations than AUTO had.

    Examples
    --------
    >>> from contin import AlgebraicProblem, trace
    >>> from contin.auto07p import AutoSolution
    >>> parabola = AlgebraicProblem(lambda u, p: (p.a - u.x**2,), ["x"], {"a": 1.0})
    >>> found = AutoSolution("LP", 2, {"a": 1e-7}, np.zeros(1), np.array([[1e-4]]), 1, 0)
    >>> fold = from_auto(parabola, found, free=["a"])
    >>> fold.label, abs(fold["a"]) < 1e-12
    ('LP', True)
    """
    if solution.states.shape[1] != len(problem.state_names):
        raise ProblemError(
            f"solution: {solution.states.shape[1]} states must be {len(problem.state_names)}, as the problem has"
        )
    values = _values(problem, solution, parameters or {})
    system, x = _system(problem, solution, with_multipliers(problem, checks.names("free", free)), values)
    if solution.label not in _LOCATED:
        return next(iter(Continuation(system, x)))
    return _located(system, x, solution)


def _values(
    problem: BoundaryValueProblem | AlgebraicProblem, solution: AutoSolution, given: Mapping[str, float]
) -> dict[str, float]:
    """Return the values of all parameters of a problem.

    Raises
    ------
    ProblemError
        One is missing.
    """
    own = {}
    if isinstance(problem, CycleProblem):
        own = {ROUNDS: 1.0} if problem.period is not None else {PERIOD: solution.parameters.get(_PERIOD, 0.0)}
        gained = solution.states[-1] - problem.symmetry @ solution.states[0]
        own |= windings(problem.angles, problem.state_names, gained)
    known = {**own, **solution.parameters, **given}
    for name in problem.parameters:
        if name not in known:
            raise ProblemError(
                f"solution: has no parameter {name!r}; give its number to read_auto (parameters={{1: {name!r}}}), or its value"
            )
    return {name: known[name] for name in problem.parameters}


def _system(
    problem: BoundaryValueProblem | AlgebraicProblem, solution: AutoSolution, free: Sequence[str], values: Mapping[str, float]
) -> tuple[System, Array]:
    """Return the discretized problem on AUTO's mesh, and the solution as its unknowns."""
    if problem.domain is None:
        algebraic = Algebraic(problem, free, values)
        return algebraic, algebraic.pack(solution.states, values)
    degree, (a, b) = solution.degree, problem.domain
    if not degree:
        raise ProblemError("solution: is an equilibrium; state the problem as an AlgebraicProblem")
    mesh = a + (b - a) * solution.t[::degree]
    system = problem.discretized(free, values, None, mesh, degree)
    x = system.pack(_at_nodes(solution), values)
    return system.with_reference(x), x


def _at_nodes(solution: AutoSolution) -> Array:
    """Return the states at Lobatto nodes: AUTO's places divide each interval into equal parts."""
    degree = solution.degree
    places = np.linspace(0, 1, degree + 1)
    matrix = interpolation(places, 1 / (places[:, None] - places + np.eye(degree + 1)).prod(axis=1), basis(degree).nodes)
    starts = range(0, len(solution.t) - 1, degree)
    inner = [matrix[:-1] @ solution.states[start : start + degree + 1] for start in starts]
    return np.concatenate([*inner, solution.states[-1:]])


def _located(system: System, x: Array, solution: AutoSolution) -> Point:
    """Return the special point near x: the run goes some steps back, then forth across it.

    Raises
    ------
    ConvergenceError
        There is none of this label.
    """
    sizes = dict.fromkeys((*system.problem.states, *system.free), 1.0)  # at a special point, those of x may not be typical
    for scales in (sizes, {}):
        for point in _looked_for(system, x, scales):
            if point.label == solution.label:
                return point
    raise ConvergenceError(
        f"solution: no {solution.label} of the problem is near AUTO's label {solution.number}; compare the equations"
    )


def _looked_for(system: System, x: Array, scales: Mapping[str, float]) -> Iterator[Point]:
    """Yield the labelled points near x, from some steps back on, both ways."""
    primary = system.free[0]
    wanted = float(x[system.parameter_index(primary)])
    *_, back = Continuation(system, x, Settings(direction=-1, step=_STEP, max_points=2, errors=False, scales=scales))
    way = 1 if wanted >= back[primary] else -1
    for direction in (way, -way):
        settings = Settings(direction=direction, step=_STEP, max_points=_LOOKS, scales=scales)
        yield from (
            p for p in Continuation(back.system, back.x, settings) if abs(p[primary] - wanted) <= _CLOSE * (1 + abs(wanted))
        )
