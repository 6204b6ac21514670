"""First guesses: the discretized problem and the vector of unknowns that a user's guess stands for."""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from contin import errors as checks
from contin.arrays import Array
from contin.boundary.statement import BoundaryValueProblem
from contin.boundary.system import Collocation
from contin.collocation.mesh import with_breaks
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

    Raises ProblemError where the energy has no finite value there.
    """
    if system.intervals > _MOST_INTERVALS:
        a, b = system.problem.domain
        coarse, _ = system.on_mesh(np.linspace(a, b, _MOST_INTERVALS + 1))
        sampled = np.stack([np.interp(coarse.nodes, system.nodes, column) for column in states.T], axis=1)
        fitted = _fitted(coarse, sampled)
        values = dict(zip(coarse.problem.parameters, coarse.all_parameters(fitted)))
        multipliers = np.array([values[name] for name in multipliers_of(coarse.problem)])
        return _packed(system, states, coarse.evaluate(fitted, system.nodes)[:, states.shape[1] :], multipliers)
    return _fitted(system, states)


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
    if not (np.isfinite(residual).all() and np.isfinite(normal).all()):
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


class Parsed(NamedTuple):
    """A guess of any form, as states over t.

    Attributes
    ----------
    at : callable
        Returns states (K, n) at places t (K,); of numbers, which depend on no t, in one row.
    places : ndarray
        Where arrays are given; the beginning of the domain for the other forms.
    point : Point, optional
        The guess itself where it is a solution with the states of the problem.
    told : dict
        Parameters that an orbit tells: its time, and the equilibria at its ends.
    """

    at: Callable[[Array], Array]
    places: Array
    point: Point | None = None
    told: Mapping[str, float] = {}

    def states(self, t: Array, count: int) -> Array:
        """Return ``count`` states at places t (K,), shape (K, count)."""
        found = self.at(t)
        if found.shape[1] != count and self.point is not None:
            raise ProblemError(f"guess: a Point of {found.shape[1]} states for a problem of {count}")
        if found.shape[1] != count:
            raise ProblemError(f"guess: {found.shape[1]} numbers, must be the {count} states")
        return np.array(np.broadcast_to(found, (len(t), count)), order="C")

    def mapped(self, function: Callable[[Array], Array], count: int) -> Parsed:
        """Return the guess for a problem whose states are a function of these."""
        return Parsed(lambda t: function(self.states(t, count)), self.places)


def parsed(problem: Any, guess: Guess, parameters: Mapping[str, float]) -> Parsed:
    """Return a guess of any form as states over t; without one those of a problem without t are zeros.

    Raises ProblemError where there is none, it is not numbers, or arrays have another size or domain.
    """
    begin = np.array(problem.domain or (0.0,))[:1]
    if isinstance(guess, Point):
        guess = underlying(guess)
        system: Any = guess.system
        x = guess.x
        if problem.domain is None or not system.is_function_of_t:
            return Parsed(lambda t: system.states(x)[:1], begin, guess)
        return Parsed(lambda t: system.evaluate(x, t * system.order), begin, guess)
    if problem.domain is not None:
        if guess is None:
            raise ProblemError("guess: a boundary value problem needs one (a function of t, arrays, or numbers)")
        guess = problem.whole_guess(guess, {**problem.parameters, **parameters})
        if callable(guess):
            return Parsed(functools.partial(_called, guess, problem), begin)
        if isinstance(guess, tuple) and len(guess) == 2 and isinstance(guess[0], (list, tuple, np.ndarray)):
            return _of_arrays(problem, _numbers(guess[0]), _numbers(guess[1]))
    numbers = _numbers(np.zeros(problem.dimension) if guess is None else guess).reshape(1, -1)
    return Parsed(lambda t: numbers, begin)


def _called(guess: Callable[[float], Any], problem: Any, t: Array) -> Array:
    """Return the values of a user's function at places (K,), shape (K, n)."""
    try:
        values = [guess(place) for place in t]
    except Exception as error:  # a user's function may raise anything
        raise ProblemError(f"guess cannot be called: {type(error).__name__}: {error}") from error
    return _continuous(np.array([_numbers(value, problem.dimension) for value in values]), periods_of(problem))


def _of_arrays(problem: Any, t: Array, states: Array) -> Parsed:
    """Return arrays (t, states); an orbit that has its own time over [0, 1]."""
    told: dict[str, float] = {}
    if states.size != t.size * problem.dimension:
        raise ProblemError(f"guess: {states.size} numbers for {t.size} places t and {problem.dimension} states")
    states, (a, b) = states.reshape(t.size, -1), problem.domain
    if problem.own_time is not None and t.size > 1:
        told = dict(zip(problem.ends, states[[0, -1]].ravel().tolist()))
        time = t[-1] - t[0]
        if abs(t[0]) > LOCATED or abs(time - 1) > LOCATED:
            told |= {problem.own_time: float(time)} if problem.own_time else {}
            t = (t - t[0]) / (time or 1.0)
    slack = LOCATED * (b - a)
    if not t.size or not np.all(np.diff(t) > 0) or not t[0] <= a + slack or not t[-1] >= b - slack:
        raise ProblemError(f"guess: its t must increase and cover the domain {exact_text(a)} ... {exact_text(b)}")
    known = _continuous(states, periods_of(problem))
    return Parsed(lambda at: np.stack([np.interp(at, t, column) for column in known.T], axis=1), t, None, told)


def restated(problem: Any, guess: Guess, parameters: dict[str, float]) -> tuple[Any, Parsed, dict[str, float]]:
    """Return a problem without states that follow from others, the guess for it, and the parameters.

    These are states without rates, and those that follow from conserved totals, which are then among the parameters. Raises
    ProblemError for a guess that does not fit, or does not determine states without rates, or gives no totals.
    """
    given, mass, names = parsed(problem, guess, parameters), problem.mass, problem.state_names
    parameters, point = {**given.told, **parameters}, given.point
    if mass is not None and point is not None and {*point.system.problem.states} <= {*mass.kept_names(names)}:
        problem = problem.without_found([point[names[i]] for i in mass.found])
    elif mass is not None:
        first = given.states(given.places, len(names))[0]
        problem.check_index(first, {**problem.parameters, **parameters})
        problem, given = problem.without_found(first[mass.found]), given.mapped(mass.of_states, len(names))
    if (reduced := problem.reduced) is None:
        return problem, given, parameters
    found, names, point = problem.on_totals, problem.state_names, given.point
    told = all(name in parameters for name in reduced.total_names)
    if guess is None and not told:
        raise ProblemError(f"guess: must be given, or the totals among the parameters, since {reduced.conserved}")
    if point is not None:
        fits = tuple(point.system.problem.states) == found.state_names
    else:
        fits = told and given.at(given.places).shape[1] == len(found.state_names)
    if not fits:
        parameters = {**reduced.without_totals(given.states(given.places, len(names)))[1], **parameters}
        given = given.mapped(lambda states: reduced.without_totals(states)[0], len(names))
    return found, given, parameters


def first_guess(
    problem: BoundaryValueProblem | AlgebraicProblem, guess: Parsed, parameters: Mapping[str, float], free: Sequence[str],
    intervals: int, degree: int,
) -> tuple[System, Array]:  # fmt: skip
    """Return the discretized problem and a vector of unknowns for a guess; raise ProblemError for a guess that does not fit."""
    values, count, point = {**problem.parameters, **parameters}, len(problem.state_names), guess.point
    if isinstance(problem, AlgebraicProblem):
        algebraic = problem.discretized(free, parameters)
        states = guess.at(guess.places).ravel() if point is None else point.x[: point.system.state_size]
        if states.size not in (count, algebraic.state_size):  # a map takes one point of a cycle, too
            raise ProblemError(f"guess: {states.size} numbers, must be the {algebraic.state_size} states")
        return algebraic.with_rounds_of(algebraic.pack(states, values), parameters)
    mesh = np.linspace(*problem.domain, intervals + 1)
    if point is not None:
        mesh = _mesh_of(over_t(point, "guess: a Point must be a solution of a boundary value problem"), problem.order)
    system = problem.discretized(free, parameters, None, mesh, degree)
    if point is None:
        system = system.on_mesh(with_breaks(mesh, system.breaks))[0] if len(system.breaks) else system
        if problem.dimension < count:
            return system, with_guessed_multipliers(system, guess.states(system.nodes, problem.dimension))
    states = guess.states(system.nodes / problem.order, count)
    if periods_of(problem).any():
        system, states = _with_rounds(system, states, parameters)
    x = system.pack(states, values)
    return system.with_reference(x), x


def _continuous(states: Array, periods: Array) -> Array:
    """Return states (K, n) whose angles do not jump by whole rounds from one to the next, as values between -pi and pi do."""
    if not periods.any():
        return states
    jumps = whole_rounds(np.diff(states, axis=0), periods)
    return states - np.concatenate([np.zeros((1, states.shape[1])), np.cumsum(jumps, axis=0)])


def _with_rounds(system: Collocation, states: Array, parameters: Mapping[str, float]) -> tuple[Collocation, Array]:
    """Return an orbit with the winding numbers of a guess, unless they are given, and its states.

    Of angles that are given to rotate, and do not, those rounds are added, uniformly.
    """
    problem: Any = system.problem
    periods, symmetry = periods_of(problem), getattr(problem, "symmetry", np.eye(len(problem.states)))
    read = windings(problem.angles, problem.state_names, states[-1] - symmetry @ states[0])
    given = {name: value for name, value in parameters.items() if name in read}
    for name, value in given.items():
        if not read[name]:
            place = problem.state_names.index(name.removeprefix(WINDING))
            states[:, place] += system.nodes * value * periods[place]
    found: Collocation = system.with_parameters({**read, **given})
    return found, states


def _numbers(values: object, count: int | None = None) -> Array:
    """Return a guess as an array of numbers, shape (count,) where that is given."""
    try:
        array = np.asarray(values, dtype=float)
    except (TypeError, ValueError, OverflowError):
        raise ProblemError(f"guess: {checks.shown(values)} must be numbers") from None
    if count is not None and array.size != count:
        raise ProblemError(f"guess: {array.size} numbers, must be the {count} states")
    return array if count is None else array.ravel()


def _mesh_of(system: Collocation, order: int) -> Array:
    """Return the mesh of a guess for a problem with a symmetry of this order, on the part that is computed."""
    if system.order == order:
        return system.mesh
    whole = np.unique(np.arange(system.order)[:, None] + system.mesh) * order / system.order
    return np.append(whole[whole < 1 - ROUGH], 1.0)
