"""First guesses: the discretized problem and the vector of unknowns that a user's guess stands for."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeGuard

import numpy as np

from contin import checks
from contin.arrays import Array
from contin.boundary.statement import BoundaryValueProblem
from contin.boundary.system import Collocation
from contin.core.system import System
from contin.equilibria.statement import AlgebraicProblem
from contin.errors import ProblemError
from contin.levels import LOCATED, ROUGH
from contin.names import exact_text
from contin.problems.angles import WINDING, periods_of, whole_rounds, windings
from contin.results.point import Point, underlying
from contin.results.record import over_t
from contin.search.lagrange import with_guessed_multipliers

#: A function of t, a point, numbers, (t, states), or one of these for each segment.
Guess = Callable[[float], Any] | Point | float | Sequence[Any] | Array | None


@dataclass(frozen=True)
class Options:
    """Parameters and first mesh of a solution; as in `contin.solve`."""

    parameters: Mapping[str, float]
    free: Sequence[str]
    intervals: int
    degree: int


def restated(problem: object, guess: Guess, parameters: dict[str, float]) -> tuple[Any, Guess, dict[str, float]]:
    """Return a problem without states that follow from others, the guess for it, and the parameters.

    These are states without rates, and those that follow from conserved totals.
    """
    guess, parameters = _over_own_time(problem, guess, parameters)
    return _on_totals(*_with_rates(problem, guess, parameters))


def _over_own_time(problem: Any, guess: Guess, parameters: dict[str, float]) -> tuple[Guess, dict[str, float]]:
    """Return arrays (t, states) of an orbit over [0, 1], with what they say of its time and of the equilibria at its ends."""
    if problem.own_time is None or not _is_pair(guess):
        return guess, parameters
    t, states = _numbers(guess[0]), _numbers(guess[1])
    if t.size < 2 or states.size != t.size * len(problem.state_names):
        return guess, parameters  # said of the guess as it is
    begin, time = t[0], t[-1] - t[0]
    ends = states.reshape(t.size, -1)[[0, -1]].ravel().tolist()
    found = dict(zip(problem.ends, ends))
    if abs(begin) <= LOCATED and abs(time - 1) <= LOCATED:
        return guess, {**found, **parameters}
    if problem.own_time:
        found[problem.own_time] = float(time)
    return ((t - begin) / (time or 1.0), states), {**found, **parameters}


def _with_rates(problem: Any, guess: Guess, parameters: dict[str, float]) -> tuple[Any, Guess, dict[str, float]]:
    """Return a problem without states that have no rates, and the guess for it.

    Raises
    ------
    ProblemError
        The states that have none are not determined at the guess.
    """
    mass, names = problem.mass, problem.state_names
    if mass is None:
        return problem, guess, parameters
    if isinstance(guess, Point) and not {*guess.system.problem.states} - {*mass.kept_names(names)}:
        known = underlying(guess)
        return problem.without_found([known[names[i]] for i in mass.found]), guess, parameters
    guess, first = _taken(problem, guess, lambda states: (mass.of_states(states), states.reshape(-1, len(names))[0]))
    first = np.zeros(len(names)) if first is None else first
    problem.check_index(first, {**problem.parameters, **parameters})
    found = problem.without_found(first[mass.found])
    return found, np.zeros(len(mass.kept)) if guess is None else guess, parameters


def _on_totals(problem: Any, guess: Guess, parameters: dict[str, float]) -> tuple[Any, Guess, dict[str, float]]:
    """Return a problem without the states that follow from conserved totals, the guess, and the parameters with totals of it.

    Raises
    ------
    ProblemError
        The totals are neither in the guess nor among the parameters.
    """
    reduced = problem.reduced
    if reduced is None:
        return problem, guess, parameters
    found = problem.on_totals
    if isinstance(guess, Point) and tuple(guess.system.problem.states) == found.state_names:
        return found, guess, parameters
    given = all(name in parameters for name in reduced.total_names)
    if guess is None and not given:
        raise ProblemError(f"guess: must be given, or the totals among the parameters, since {reduced.conserved}")
    is_numbers = not (callable(guess) or isinstance(guess, Point) or _is_pair(guess))
    if given and is_numbers and (guess is None or np.size(_numbers(guess)) == len(found.state_names)):
        return found, guess, parameters
    guess, totals = _taken(problem, guess, reduced.without_totals)
    return found, guess, {**totals, **parameters}


def _taken(problem: Any, guess: Guess, taken: Callable[[Array], tuple[Array, Any]]) -> tuple[Guess, Any]:
    """Return a guess with ``taken(states)[0]`` of its states (..., n), and the other value, at its first place or of all.

    Without a guess both are None.
    """
    count = len(problem.state_names)
    if guess is None:
        return None, None
    if isinstance(guess, Point):
        guess = _of_point(guess)
    if callable(guess):
        whole = guess
        first = taken(_sampled(whole, np.array(problem.domain[:1]), count))[1]
        return (lambda t: taken(_sampled(whole, np.array([t]), count)[0])[0]), first
    if _is_pair(guess):
        states, value = taken(_sampled(guess, _numbers(guess[0]), count))
        return (guess[0], states), value
    return taken(_numbers(guess, count))


def _of_point(point: Point) -> Guess:
    """Return the states of a point, as a function of t where they are one."""
    system: Any = point.system
    if not system.is_function_of_t:
        return system.states(point.x)[0]
    return lambda t: system.evaluate(point.x, np.array([t * system.order]))[0]


def first_guess(problem: BoundaryValueProblem | AlgebraicProblem, guess: Guess, options: Options) -> tuple[System, Array]:
    """Return the discretized problem and a vector of unknowns for a guess.

    Raises
    ------
    ProblemError
        A guess that does not fit.
    """
    if isinstance(problem, AlgebraicProblem):
        return _without_mesh(problem, guess, options)
    return _on_mesh(problem, guess, options)


def _without_mesh(problem: AlgebraicProblem, guess: Guess, options: Options) -> tuple[System, Array]:
    system = problem.discretized(options.free, options.parameters)
    given: Any = guess.x[: guess.system.state_size] if isinstance(guess, Point) else guess
    count = len(problem.state_names)  # a map takes one point of a cycle, too
    states = np.zeros(count) if given is None else _numbers(given)
    if states.size != count:
        states = _numbers(given, system.state_size)
    x = system.pack(states, {**problem.parameters, **options.parameters})
    return system.with_rounds_of(x, options.parameters)


def _on_mesh(problem: BoundaryValueProblem, guess: Guess, options: Options) -> tuple[System, Array]:
    guess = problem.whole_guess(guess, {**problem.parameters, **options.parameters})
    a, b = problem.domain
    mesh = np.linspace(a, b, options.intervals + 1)
    order = problem.order
    if isinstance(guess, Point):
        mesh = _mesh_of(_meshed(guess), order)
    elif _is_pair(guess):
        given, slack = _numbers(guess[0]), LOCATED * (b - a)
        if not given.size or not np.all(np.diff(given) > 0) or not given[0] <= a + slack or not given[-1] >= b - slack:
            raise ProblemError(f"guess: its t must increase and cover the domain {exact_text(a)} ... {exact_text(b)}")
    system = problem.discretized(options.free, options.parameters, None, mesh, options.degree)
    if not isinstance(guess, Point):
        system = system.on_breaks()
    if problem.dimension < len(problem.state_names) and not isinstance(guess, Point):
        return system, with_guessed_multipliers(system, _sampled(guess, system.nodes, problem.dimension))
    periods = periods_of(problem)
    states = _sampled(guess, system.nodes / order, len(problem.state_names), periods)
    if periods.any():
        system, states = _with_rounds(system, states, options)
    x = system.pack(states, {**problem.parameters, **options.parameters})
    return system.with_reference(x), x


def _continuous(states: Array, periods: Array | None) -> Array:
    """Return states (K, n) whose angles do not jump by whole rounds from one to the next, as values between -pi and pi do."""
    if periods is None or not periods.any():
        return states
    jumps = whole_rounds(np.diff(states, axis=0), periods)
    return states - np.concatenate([np.zeros((1, states.shape[1])), np.cumsum(jumps, axis=0)])


def _with_rounds(system: Collocation, states: Array, options: Options) -> tuple[Collocation, Array]:
    """Return an orbit with the winding numbers of a guess, unless they are given, and its states.

    Of angles that are given to rotate, and do not, those rounds are added, uniformly.
    """
    problem: Any = system.problem
    periods, symmetry = periods_of(problem), getattr(problem, "symmetry", np.eye(len(problem.states)))
    read = windings(problem.angles, problem.state_names, states[-1] - symmetry @ states[0])
    given = {name: value for name, value in options.parameters.items() if name in read}
    for name, value in given.items():
        if not read[name]:
            place = problem.state_names.index(name.removeprefix(WINDING))
            states[:, place] += system.nodes * value * periods[place]
    found: Collocation = system.with_parameters({**read, **given})
    return found, states


def _sampled(guess: Guess, nodes: Array, count: int, periods: Array | None = None) -> Array:
    """Return the states of a guess at the nodes, shape (K, count); angles, of these periods, are made continuous."""
    if isinstance(guess, Point):
        states = _meshed(guess).evaluate(guess.x, nodes * guess.system.order)
        if states.shape[1] != count:
            raise ProblemError(f"guess: a Point of {states.shape[1]} states for a problem of {count}")
        return states
    if callable(guess):
        try:
            values = [guess(t) for t in nodes]
        except Exception as error:  # a user's function may raise anything
            raise ProblemError(f"guess cannot be called: {type(error).__name__}: {error}") from error
        return _continuous(np.array([_numbers(value, count) for value in values]), periods)
    if _is_pair(guess):
        t, columns = _numbers(guess[0]), _numbers(guess[1])
        if columns.size != len(t) * count:
            raise ProblemError(f"guess: {columns.size} numbers for {len(t)} places t and {count} states")
        known = _continuous(columns.reshape(len(t), count), periods)
        return np.stack([np.interp(nodes, t, column) for column in known.T], axis=1)
    if guess is None:
        raise ProblemError("guess: a boundary value problem needs one (a function of t, arrays, or numbers)")
    return np.tile(_numbers(guess, count), (len(nodes), 1))


def _numbers(values: object, count: int | None = None) -> Array:
    """Return a guess as an array of numbers, shape (count,) where that is given."""
    try:
        array = np.asarray(values, dtype=float)
    except (TypeError, ValueError, OverflowError):
        raise ProblemError(f"guess: {checks.shown(values)} must be numbers") from None
    if count is not None and array.size != count:
        raise ProblemError(f"guess: {array.size} numbers, must be the {count} states")
    return array if count is None else array.ravel()


def _meshed(guess: Point) -> Collocation:
    """Return the system of a guess that is a solution of a boundary value problem."""
    return over_t(guess, "guess: a Point must be a solution of a boundary value problem")


def _mesh_of(system: Collocation, order: int) -> Array:
    """Return the mesh of a guess for a problem with a symmetry of this order, on the part that is computed."""
    parts = system.order
    if parts == order:
        return system.mesh
    whole = np.unique(np.arange(parts)[:, None] + system.mesh) * order / parts
    return np.append(whole[whole < 1 - ROUGH], 1.0)


def _is_pair(guess: Guess) -> TypeGuard[tuple[Any, Any]]:
    """Return whether a guess is (t, states)."""
    return isinstance(guess, tuple) and len(guess) == 2 and isinstance(guess[0], (list, tuple, np.ndarray))
