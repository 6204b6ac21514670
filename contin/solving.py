"""First solutions: from a function, arrays, numbers or a stored point; and others beside the known ones (deflation)."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, TypeGuard

import numpy as np

from contin import _checks
from contin.algebraic import Algebraic, AlgebraicProblem
from contin.arclength import follow
from contin.branch import Branch, Point
from contin.collocation import DEGREES, Collocation
from contin.corrector import Newton, correct
from contin.errors import ConvergenceError, ProblemError
from contin.events import Trial
from contin.interface import Array, Discretization
from contin.mesh import MOST_INTERVALS, MeshControl
from contin.problem import BoundaryValueProblem
from contin.settings import Settings, settings_with
from contin.switching import BranchPoint, inner
from contin.system import system_of

if TYPE_CHECKING:
    from contin.corrector import Corrected
    from contin.system import System

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
    _checks.instance("problem", problem, (BoundaryValueProblem, AlgebraicProblem), "a BoundaryValueProblem or AlgebraicProblem")
    parameters, control = _parameters(parameters), MeshControl() if mesh is None else mesh
    free = _checks.names("free", free)
    _checks.whole("intervals", intervals, 1, MOST_INTERVALS)
    _checks.whole("degree", degree, DEGREES[0], DEGREES[-1])
    _checks.instance("mesh", control, MeshControl, "a MeshControl")
    _checks.instance("newton", newton, Newton, "a Newton")
    for other in _checks.sequence("others", others, "Point"):
        _checks.instance("others", other, Point, "a Point")
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
    for name, value in _checks.mapping("parameters", values, "numbers").items():
        _checks.number(f"parameters: {_checks.plain(name)}", value)
    return dict(values)


def _numbers(values: Any, count: int | None = None) -> Array:
    """A guess as an array of numbers, shape (count,) where that is given."""
    try:
        array = np.asarray(values, dtype=float)
    except (TypeError, ValueError, OverflowError):
        raise ProblemError(f"guess: {_checks.shown(values)} must be numbers") from None
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


def point_of(system: Discretization, x: Array, iterations: int = 0, error: float = 0.0) -> Point:
    """A Point of any solution x of a system."""
    trial = Trial(system, x, np.full_like(x, np.nan), np.nan)
    parameters = dict(zip(system.problem.parameters, map(float, system.all_parameters(x))))
    return Point("", "", parameters, trial.functionals, x, trial.tangent, system, 0.0, iterations, error)


#: Solutions no further apart than this are one.
_SAME = 1e-6
#: Where a deflated Newton iteration starts, as multiples of the guess's distance from the nearest known solution, and its
#: longest step. It wanders before it converges, and may not come back; then it is the turn of the next.
_STARTS = [(m, longest) for longest in (3.0, 1.0, 0.3) for m in (1.0, -1.0, 5.0, -5.0, 20.0, -20.0, 50.0, -50.0)]


def _correct_away(system: Discretization, x: Array, others: Sequence[Point], newton: Newton) -> Corrected:
    """Newton on the deflated residual: a Newton step stretched so that known solutions repel."""
    known = [point.system.carrier(system)(point.x)[: system.state_size] for point in others]
    known = [np.append(states, x[system.state_size :]) for states in known]
    nearest = min(known, key=lambda root: inner(system, x - root, x - root))
    away = x - nearest
    if np.max(np.abs(away)) < _SAME:  # the known solution itself for a guess
        away = np.where(np.arange(x.size) < system.state_size, 0.1 * (1 + np.abs(x)), 0.0)
    for multiple, longest in _STARTS:
        with np.errstate(all="ignore"):
            found = _wander(system, nearest + multiple * away, known, longest)
        if found is not None:
            done = correct(system, found, newton=newton)
            if all(np.max(np.abs(done.x - root)) > _SAME for root in known):
                return done
    raise ConvergenceError("no further solution was found from this guess; another guess may lead to one")


def _wander(system: Discretization, x: Array, known: list[Array], longest: float, max_iterations: int = 100) -> Array | None:
    """Where the deflated iteration from x converges, or None."""
    for _ in range(max_iterations):
        residual, factors = system.linearize(x)
        step = -factors.solve(residual)
        stretch = 0.0  # the derivative of log(prod (1 + 1 / |x - r|^2)) along the step
        for root in known:
            away = x - root
            distance = max(inner(system, away, away), 1e-300)
            stretch -= 2 * inner(system, away, step) / (distance * (1 + distance))
        step = step / (1 - stretch)
        size = np.max(np.abs(step) / (1 + np.abs(x)))
        if not np.isfinite(size):
            return None
        x = x + step * min(1.0, longest / size)
        if size < 1e-6:
            return x
    return None


def trace(start: Point, settings: Settings | None = None, *, free: Sequence[str] | None = None, branch: int | None = None,
          **options: Any) -> Branch:  # fmt: skip
    """Follow the branch through a point, or away from a branch point, to its end.

    Parameters
    ----------
    start : Point
        Of `solve`, of another branch, or read back.
    settings : Settings, optional
        Or any of its fields by name.
    free : sequence of str, optional
        Free parameters, if they shall differ from those of ``start``; the first is the primary one.
    branch : int, optional
        Which branch to take from a branch point: 0 the one that ``start`` was found on, 1 the other one. ``direction=-1`` takes
        the opposite way.

    Raises
    ------
    ProblemError, ConvergenceError
    """
    _checks.instance("start", start, Point, "a Point")
    settings = settings_with(settings, options)
    system, x = start.system, start.x
    if free is not None and _checks.names("free", free) != system.free:
        system, x = system_of(start, "start").with_free(free, x)
    if branch is None:
        return follow(system, x, settings)
    _checks.whole("branch", branch, 0, 10)
    if not isinstance(start.details, BranchPoint):
        raise ProblemError("branch: the start is not a branch point")
    if not 0 <= branch < len(start.details.tangents):
        raise ProblemError(f"branch: {branch} must lie between 0 and {len(start.details.tangents) - 1}")
    return follow(system, x, settings, settings.direction * start.details.tangents[branch])
