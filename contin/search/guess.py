"""First guesses: the discretized problem and the vector of unknowns that a user's guess stands for."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeGuard

import numpy as np

from contin import errors as checks
from contin.arrays import Array
from contin.boundary.statement import BoundaryValueProblem
from contin.boundary.system import Collocation
from contin.core.system import System
from contin.equilibria.statement import AlgebraicProblem
from contin.errors import ProblemError
from contin.levels import LOCATED, MOST_HALVINGS, MOST_UPDATES, ROUGH, ROUND_OFF
from contin.problems.angles import WINDING, periods_of, whole_rounds, windings
from contin.problems.statement import multipliers_of
from contin.results.point import Point, underlying
from contin.results.record import over_t
from contin.text import exact_text

#: The most intervals on which multipliers are looked for: the equations are solved densely. Newton's method does the rest.
_MOST_INTERVALS = 20


def with_guessed_multipliers(system: Collocation, states: Array) -> Array:
    """Return a vector of unknowns from states (K, n) at the nodes: with the multipliers that fit them best.

    Raises
    ------
    ProblemError
        The energy has no finite value there.
    """
    if system.intervals > _MOST_INTERVALS:
        a, b = system.problem.domain
        coarse, _ = system.on_mesh(np.linspace(a, b, _MOST_INTERVALS + 1))
        sampled = np.stack([np.interp(coarse.nodes, system.nodes, column) for column in states.T], axis=1)
        fitted = _fitted(coarse, sampled)
        return _packed(
            system, states, coarse.evaluate(fitted, system.nodes)[:, states.shape[1] :], _multipliers(coarse, fitted)
        )
    return _fitted(system, states)


def _multipliers(system: Collocation, x: Array) -> Array:
    values = dict(zip(system.problem.parameters, system.all_parameters(x)))
    return np.array([values[name] for name in multipliers_of(system.problem)])


def _packed(system: Collocation, states: Array, lam: Array, multipliers: Array) -> Array:
    values = dict(zip(system.problem.parameters, system.parameters)) | dict(zip(multipliers_of(system.problem), multipliers))
    return system.pack(np.hstack([states, lam]), values)


def _fitted(system: Collocation, states: Array) -> Array:
    """Return the unknowns that fit the states: multipliers from the rates of the states first, then from all equations.

    The rates are linear in the multipliers where the energy is quadratic in the controls; all equations are not, and far from
    zero their least squares have other minima.
    """
    lam, multipliers = np.zeros_like(states), np.zeros(len(multipliers_of(system.problem)))
    for share in (0.0, 1.0):
        lam, multipliers = _settled(system, states, (lam, multipliers), share)
    return _packed(system, states, lam, multipliers)


def _settled(system: Collocation, states: Array, start: tuple[Array, Array], share: float) -> tuple[Array, Array]:
    """Return the multipliers after damped Gauss-Newton steps, all but the rates of the states weighted by ``share``."""
    lam, multipliers = start
    residual, gradient, normal = _equations(system, states, lam, multipliers, share)
    if not np.isfinite(residual).all():
        raise ProblemError("guess: the equations have no finite value there (look for what divides by zero, or at `starts`)")
    for _ in range(MOST_UPDATES):
        if not np.any(normal):
            break
        normal[np.diag_indices_from(normal)] += ROUND_OFF * np.trace(normal)
        step = _solved(normal, -gradient, lam.size, (system.degree + 1) * lam.shape[1])
        part = 1.0
        for _ in range(MOST_HALVINGS):
            new_lam = lam + part * step[: lam.size].reshape(lam.shape)
            new_multipliers = multipliers + part * step[lam.size :]
            new = _equations(system, states, new_lam, new_multipliers, share)
            if np.isfinite(new[2]).all() and np.linalg.norm(new[0]) <= np.linalg.norm(residual):
                break
            part /= 2
        else:
            break
        gained = np.linalg.norm(residual) - np.linalg.norm(new[0])
        lam, multipliers, (residual, gradient, normal) = new_lam, new_multipliers, new
        if gained <= ROUGH * np.linalg.norm(residual) or np.linalg.norm(residual) < ROUGH:
            break
    return lam, multipliers


def _solved(normal: Array, right: Array, count: int, width: int) -> Array:
    """Solve with a matrix that couples its first ``count`` unknowns, nodes in order, over less than ``width`` places only."""
    from scipy.linalg import solve_banded  # type: ignore[import-untyped]  # .1 s; only this needs it

    width = min(width, count)
    bands = np.zeros((2 * width - 1, count))
    for offset in range(1 - width, width):
        diagonal = np.diagonal(normal[:count, :count], offset)
        bands[width - 1 - offset, max(offset, 0) : max(offset, 0) + diagonal.size] = diagonal
    border = normal[:count, count:]
    inner = solve_banded((width - 1, width - 1), bands, np.column_stack([right[:count], border]))
    last = np.linalg.solve(normal[count:, count:] - border.T @ inner[:, 1:], right[count:] - border.T @ inner[:, 0])
    return np.append(inner[:, 0] - inner[:, 1:] @ last, last)


def _equations(system: Collocation, states: Array, lam: Array, multipliers: Array, share: float) -> tuple[Array, Array, Array]:
    """Return the residual r of all equations, J.T r and J.T J, with J the derivatives by lam (K, n), flattened, and
    multipliers.

    All but the rates of the states are multiplied by ``share``. J.T J is added up interval by interval, without J itself, which
    has few entries that are not zero.
    """
    problem: Any = system.problem
    n, d, count, basis = problem.dimension, system.degree, system.intervals, system.basis
    u = np.hstack([states, lam])
    p = system.parameters.copy()
    places = [list(problem.parameters).index(name) for name in problem.multipliers]
    p[places] = multipliers
    h = np.diff(system.mesh)
    local = u[d * np.arange(count)[:, None] + np.arange(d + 1)]
    points = np.einsum("ij,ejk->eik", basis.value, local)
    rates = np.einsum("ij,ejk->eik", basis.slope, local) / h[:, None, None]
    batch = problem.batch("field")
    field, by = batch.jacobian(system.gauss_times, points.reshape(-1, 2 * n), u[:0], p, batch.columns(places))
    field, by = field.reshape(count, d, -1), by.reshape(count, d, field.shape[-1], -1)
    weights = np.sqrt(h[:, None] * basis.weights)
    residual = (rates - field[:, :, : 2 * n]) * weights[:, :, None]
    residual[:, :, n:] *= share if np.isfinite(residual).all() else 1.0
    rows = -np.einsum("eirk,ij->eirjk", by[:, :, : 2 * n, n : 2 * n], basis.value)
    rows[:, :, n:] += np.einsum("rk,ij,e->eirjk", np.eye(n), basis.slope, 1 / h)
    rows = np.concatenate([rows.reshape(count, d, 2 * n, -1), -by[:, :, : 2 * n, 2 * n :]], axis=-1)
    rows *= weights[:, :, None, None]
    rows[:, :, n:] *= share
    ends = problem.batch("boundary")
    value, by_ends = ends.jacobian(np.zeros(1), u[:1], u[-1:], p, ends.columns(places))
    last = share * np.hstack([by_ends[0][:, n : 2 * n], by_ends[0][:, 3 * n :]])
    of_multipliers = lam.size + np.arange(len(places))
    parts = [(residual[e].ravel(), rows[e].reshape(2 * n * d, -1), n * d * e + np.arange(n * (d + 1))) for e in range(count)]
    parts.append((share * value[0], last, np.r_[0:n, lam.size - n : lam.size]))
    gradient, normal = np.zeros(lam.size + len(places)), np.zeros((lam.size + len(places),) * 2)
    with np.errstate(invalid="ignore"):  # the caller looks for values that are not finite
        for part, block, columns in parts:
            at = np.r_[columns, of_multipliers]
            gradient[at] += block.T @ part
            normal[np.ix_(at, at)] += block.T @ block
    return np.concatenate([part for part, _, _ in parts]), gradient, normal


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
    found = dict(zip(problem.ends, states.reshape(t.size, -1)[[0, -1]].ravel().tolist()))
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
    return system.with_rounds_of(system.pack(states, {**problem.parameters, **options.parameters}), options.parameters)


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
