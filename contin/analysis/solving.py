"""First solutions: from a function, arrays, numbers or a stored point; and others beside the known ones (deflation)."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeGuard

import numpy as np

from contin import checks
from contin.analysis.deflation import _correct_away
from contin.arrays import Array
from contin.discretization.algebraic import Algebraic
from contin.discretization.basis import DEGREES
from contin.discretization.collocation import Collocation
from contin.discretization.mesh import MOST_INTERVALS, MeshControl
from contin.discretization.system import System
from contin.errors import ProblemError
from contin.problems.algebraic import AlgebraicProblem
from contin.problems.boundary_value import BoundaryValueProblem
from contin.results.point import Point, point_of, system_of
from contin.stepping.newton import Newton, correct

Guess = Callable[[float], Any] | Point | Sequence[float] | tuple[Sequence[float] | Array, Any] | None


def solve(
    problem: BoundaryValueProblem | AlgebraicProblem, guess: Guess = None, parameters: Mapping[str, float] | None = None, *,
    free: Sequence[str] = (), intervals: int = 20, degree: int = 4, mesh: MeshControl | None = None, newton: Newton = Newton(),
    others: Sequence[Point] = (),
) -> Point:  # fmt: skip
    """One solution near a guess, on a mesh adapted to it.

    Parameters
    ----------
    problem : BoundaryValueProblem or AlgebraicProblem
    guess : callable, pair of arrays, sequence of numbers, Point, or None
        ``guess(t)`` returns the states at t; a pair is t (K,) and states (K, n); n numbers are constant states; a point is a
        solution of a problem with the same states; None stands for zeros.
    parameters : mapping of str to float
        Values that differ from the defaults (of the problem, or of the guess if it is a point).
    free : sequence of str
        Parameters to be found along with the states, for problems with more conditions than states.
    intervals, degree : int
        First mesh (uniform, unless the guess has one) and degree of the collocation.
    mesh : MeshControl, optional
        How the mesh adapts; ``MeshControl(every=0)`` keeps the first one.
    others : sequence of Point
        Known solutions to stay away from (deflation, Farrell, Birkisson & Funke 2015).

    Returns
    -------
    Point
        With ``free`` as given: pass it to `trace` with the free parameters of a curve.

    Raises
    ------
    ConvergenceError, ProblemError
    """
    checks.instance("problem", problem, (BoundaryValueProblem, AlgebraicProblem), "a BoundaryValueProblem or AlgebraicProblem")
    parameters, control = _parameters(parameters), MeshControl() if mesh is None else mesh
    free = checks.names("free", free)
    checks.whole("intervals", intervals, 1, MOST_INTERVALS)
    checks.whole("degree", degree, DEGREES[0], DEGREES[-1])
    checks.instance("mesh", control, MeshControl, "a MeshControl")
    checks.instance("newton", newton, Newton, "a Newton")
    for other in checks.sequence("others", others, "Point"):
        checks.instance("others", other, Point, "a Point")
        if system_of(other, "others").problem.states != problem.states:
            raise ProblemError("others: must be solutions of this problem")
    if isinstance(guess, Point):
        parameters = {**guess.parameters, **parameters}
    needed = problem.free_size - 1
    if len(free) != needed:
        raise ProblemError(f"free: {len(free)} given, a solution of this problem needs {max(needed, 0)} (conditions - states)")
    system, x = _first(problem, guess, parameters, free, intervals, degree)
    if not np.all(np.isfinite(x)):
        raise ProblemError("guess: its values must be finite numbers")
    for _ in range(4):
        done = _correct_away(system, x, others, newton) if others else correct(system, x, newton=newton)
        adapted = system.adapted(done.x, control)
        if adapted is None:
            break
        system, carry = adapted
        x = carry(done.x)
    return point_of(system, done.x, done.iterations, done.error)


def _parameters(values: Mapping[str, float] | None) -> dict[str, float]:
    """Values of parameters as a user gives them."""
    if values is None:
        return {}
    for name, value in checks.mapping("parameters", values, "numbers").items():
        checks.number(f"parameters: {checks.plain(name)}", value)
    return dict(values)


def _numbers(values: Any, count: int | None = None) -> Array:
    """A guess as an array of numbers, shape (count,) where that is given."""
    try:
        array = np.asarray(values, dtype=float)
    except (TypeError, ValueError, OverflowError):
        raise ProblemError(f"guess: {checks.shown(values)} must be numbers") from None
    if count is not None and array.size != count:
        raise ProblemError(f"guess: {array.size} numbers, must be the {count} states")
    return array if count is None else array.ravel()


def _first(
    problem: BoundaryValueProblem | AlgebraicProblem,
    guess: Guess,
    parameters: Mapping[str, float],
    free: Sequence[str],
    intervals: int,
    degree: int,
) -> tuple[System, Array]:
    """System and first guess."""
    if isinstance(problem, AlgebraicProblem):
        equilibrium = Algebraic(problem, free, parameters)
        given: Any = guess.x[: guess.system.state_size] if isinstance(guess, Point) else guess
        start = np.zeros(equilibrium.state_size) if given is None else _numbers(given, equilibrium.state_size)
        return equilibrium, equilibrium.pack(start, {**problem.parameters, **parameters})
    a, b = problem.domain
    points = np.linspace(a, b, intervals + 1)
    if isinstance(guess, Point):
        points, degree = _meshed(guess).mesh, guess.system.degree
    elif _is_pair(guess):
        given = _numbers(guess[0])
        if not given.size or not np.all(np.diff(given) > 0) or not given[0] <= a or not given[-1] >= b:
            raise ProblemError(f"guess: its t must increase and cover the domain {a:g} ... {b:g}")
    system = Collocation(problem, points, degree, free, parameters)
    states = _sampled(guess, system.nodes, len(problem.state_names))
    return system, system.pack(states, {**problem.parameters, **parameters})


def _meshed(guess: Point) -> Collocation:
    """The system of a guess that is a solution of a boundary value problem."""
    if not isinstance(guess.system, Collocation):
        raise ProblemError("guess: a Point must be a solution of a boundary value problem")
    return guess.system


def _is_pair(guess: Guess) -> TypeGuard[tuple[Any, Any]]:
    """Whether a guess is (t, states)."""
    return isinstance(guess, tuple) and len(guess) == 2 and isinstance(guess[0], (list, tuple, np.ndarray))


def _sampled(guess: Guess, nodes: Array, count: int) -> Array:
    """The states (K, count) of a guess at the nodes."""
    if isinstance(guess, Point):
        states = _meshed(guess).evaluate(guess.x, nodes)
        if states.shape[1] != count:
            raise ProblemError(f"guess: a Point of {states.shape[1]} states for a problem of {count}")
        return states
    if callable(guess):
        try:
            values = [guess(t) for t in nodes]
        except Exception as error:
            raise ProblemError(f"guess cannot be called: {type(error).__name__}: {error}") from error
        return np.array([_numbers(value, count) for value in values])
    if _is_pair(guess):
        t, columns = _numbers(guess[0]), _numbers(guess[1])
        if columns.size != len(t) * count:
            raise ProblemError(f"guess: {columns.size} numbers for {len(t)} places t and {count} states")
        return np.stack([np.interp(nodes, t, column) for column in columns.reshape(len(t), count).T], axis=1)
    if guess is None:
        raise ProblemError("guess: a boundary value problem needs one (a function of t, arrays, or numbers)")
    return np.tile(_numbers(guess, count), (len(nodes), 1))
