"""One solution near a guess: corrected, its mesh adapted, and solutions other than the known ones, by deflation.

Deflation (Farrell, Birkisson & Funke 2015): Newton's method is applied to F multiplied by prod (1 + 1 / |x - r|^2) over the
known solutions r. Its step is that of F, stretched: known solutions repel it.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from contin import errors as checks
from contin.arrays import Array
from contin.boundary.statement import BoundaryValueProblem
from contin.collocation.mesh import Degree, Intervals, MeshControl
from contin.continuation.first import ROUNDS_OF_MESHES
from contin.core.newton import Corrected, Newton, correct
from contin.core.protocol import Discretization, inner
from contin.core.step import ROUNDS
from contin.core.system import System, usual
from contin.draws import ASIDE
from contin.equilibria.statement import AlgebraicProblem
from contin.errors import ConvergenceError, ProblemError
from contin.levels import APART, MOST_STEPS, MOST_UPDATES, ROUGH
from contin.linalg.orientation import first_least
from contin.problems.angles import winding_names
from contin.problems.statement import declared, forget_changed, with_multipliers
from contin.results.point import Point, point_of
from contin.results.record import system_of
from contin.search.failure import dependence, doubtful, label_of, looked_at, not_finite_near, of_family, recovered
from contin.search.guess import Guess, first_guess, restated
from contin.text import exact_text

#: Where a deflated iteration starts, as multiples of the guess's distance from the nearest known solution, and its longest
#: step. It wanders before it converges, and may not come back; then it is the turn of the next.
_STARTS = [(m, longest) for longest in (3.0, 1.0, 0.3) for m in (1.0, -1.0, 5.0, -5.0, 20.0, -20.0, 50.0, -50.0)]


def correct_away(system: Discretization, x: Array, others: Sequence[Point], newton: Newton) -> Corrected:
    """Return a solution near x that is none of the ``others``; raise ConvergenceError where none was found."""
    known = [point.system.carrier(system)(point.x)[: system.state_size] for point in others]
    known = [system.lifted(np.append(states, x[system.state_size :]), x) for states in known]
    nearest = known[first_least([inner(system, x - root, x - root) for root in known])]
    away = x - nearest
    if np.max(np.abs(away)) < APART:  # the known solution itself for a guess
        away = np.where(np.arange(x.size) < system.state_size, ASIDE * (1 + np.abs(x)), 0.0)
    for multiple, longest in _STARTS:
        with np.errstate(all="ignore"):
            found = deflated(system, nearest + multiple * away, known, longest)
        if found is not None:
            done = correct(system, found, newton=newton)
            if all(np.max(np.abs(done.x - system.lifted(root, done.x))) > APART for root in known):
                return done
    raise ConvergenceError("no further solution was found from this guess; another guess may lead to one")


def deflated(system: Discretization, x: Array, known: list[Array], longest: float) -> Array | None:
    """Return where the deflated iteration from x converges, or None; ``longest`` bounds its steps, relative to 1 + |x|."""
    for _ in range(MOST_STEPS):
        residual, factors = system.linearize(x)
        step = -factors.solve(residual)
        stretch = 0.0  # the derivative of log(prod (1 + 1 / |x - r|^2)) along the step
        for root in known:
            away = x - system.lifted(root, x)
            distance = inner(system, away, away) or np.finfo(float).tiny  # at the known solution itself
            stretch -= 2 * inner(system, away, step) / (distance * (1 + distance))
        step = step / (1 - stretch)
        size = np.max(np.abs(step) / (1 + np.abs(x)))
        if not np.isfinite(size):
            return None
        x = x + step * min(1.0, longest / size)
        if size < APART:
            return x
    return None


@checks.arguments
def solve(
    problem: BoundaryValueProblem | AlgebraicProblem, guess: Guess = None, parameters: Mapping[str, float] | None = None, *,
    free: Sequence[str] = (), intervals: Intervals = 20, degree: Degree | None = None, mesh: MeshControl | None = None,
    newton: Newton = Newton(), others: Sequence[Point] = (),
) -> Point:  # fmt: skip
    """Return one solution near a guess, on a mesh adapted to it.

    Parameters
    ----------
    problem : BoundaryValueProblem or AlgebraicProblem
    guess : callable, pair of arrays, sequence of numbers, Point, or None
        ``guess(t)`` returns the states at t; a pair is t (K,) and states (K, n); n numbers are constant states; a point is a
        solution of a problem with the same states; None stands for zeros.
    parameters : mapping of str to float
        Values that differ from the defaults (of the problem, or of the guess if it is a point).
    free : sequence of str
        Parameters to be found along with the states, for problems with more conditions than states. Of an autonomous
        `CycleProblem`, a parameter to be found in place of the period, which is held: in a family of a conservative system
        the period does not follow from the parameters.
    intervals : int
        Of the first mesh, which is uniform unless the guess has one.
    degree : int, optional
        Of the collocation, 2 to 8. By default that of the guess, if it has one; otherwise it follows from the number of states
        and the tolerance of the mesh: 7 for up to 5 states, down to 4 for more states and larger tolerances; 4 for cycles.
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

    Examples
    --------
    >>> equation = AlgebraicProblem(lambda u, p: (u.x**2 - p.a,), ["x"], {"a": 4.0})
    >>> root = solve(equation, [1.0])
    >>> round(float(root.x[0]), 12), round(float(solve(equation, root, others=[root]).x[0]), 12)
    (2.0, -2.0)
    """
    control = MeshControl() if mesh is None else mesh
    forget_changed(problem)
    problem, start, parameters = restated(problem, guess, _checked(parameters))
    if any(system_of(other, "others").problem.states != problem.states for other in others):
        raise ProblemError("others: must be solutions of this problem")
    free = with_multipliers(problem, free)
    if start.point is not None:
        read = winding_names(problem.angles)  # off the guess, as of all others
        parameters = {name: value for name, value in start.point.parameters.items() if name not in read} | parameters
    held = _check_count(problem, free)
    degree = degree or _degree_of(problem, start.point, control)
    system, x = first_guess(problem, start, parameters, free, intervals, degree)
    if not np.isfinite(x).all():
        raise ProblemError("guess: its values must be finite numbers")
    return solved(*_sized(system, x), control, newton, others, held, explains=True)


def _degree_of(problem: BoundaryValueProblem | AlgebraicProblem, point: Point | None, control: MeshControl) -> int:
    """Return the degree of a guess that is a solution, or else the usual one."""
    given: Any = point and point.system
    return int(given.degree if given and given.is_function_of_t else problem.usual_degree(control.tolerance))


def _sized(system: System, x: Array) -> tuple[System, Array]:
    """Return the system with the sizes that the problem states, and x for it."""
    problem = system.problem
    if not (stated := declared(problem, "sizes")):
        return system, x
    known = dict(zip((*problem.states, *system.free), system.largest(x)))
    sizes = {name: max(size, known.get(name, 0.0)) for name, size in stated.items()}
    both = ([sizes.get(name, 1.0) for name in names] for names in (problem.states, problem.parameters))
    return system.with_scales(x, *(usual(np.array(one), True) for one in both))


def solved(
    system: System, x: Array, control: MeshControl, newton: Newton, others: Sequence[Point] = (), held: str | None = None,
    explains: bool = False,
) -> Point:  # fmt: skip
    """Return the solution near a vector of unknowns, on a mesh adapted to it; one of the free parameters may be held.

    With ``explains``, time is taken for a solution at which F_x is singular, and to say why none is found. Raises
    ConvergenceError or ProblemError where none is.
    """

    def corrected(system: System, x: Array) -> Corrected:
        return _corrected(system, x, others, newton, explains) if held is None else _holding(system, x, held, newton)

    if explains and not others and held is None and (why := of_family(system, x)):
        raise ProblemError(why)
    for _ in range(ROUNDS_OF_MESHES):
        system, done = _crossed(system, x, corrected, held) if control.every else (system, corrected(system, x))
        adapted = system.adapted(done.x, control)
        if adapted is None:
            break
        system, carry = adapted
        x = carry(done.x)
    else:
        done = corrected(system, x)
    if why := system.undetermined(done.x):  # others are around it, of which round-off chose one
        raise ProblemError(why)
    system.check_solution(done.x)
    point = point_of(system, done.x, done.iterations, done.error)
    return dataclasses.replace(point, label=label_of(system, done.x)) if done.singular else point


def _crossed(
    system: System, x: Array, corrected: Callable[[System, Array], Corrected], held: str | None
) -> tuple[System, Corrected]:
    """Return the solution near x on a mesh with points where conditions on states switch, with outcomes frozen at jumps."""
    told = ""
    for _ in range(ROUNDS):
        system, x = _moved(*system.crossed(x), held)
        try:
            system, done = _on_switches(system, corrected(system, x), corrected)
        except ConvergenceError as error:
            if not (told := told or _jumps(system, x)):
                raise
            raise ConvergenceError(f"{error}; {told}") from None
        other, x = system.crossed(done.x)
        if other is system:
            found = system.switching(done.x)
            if not system.outcomes.size and (found.jumps & ~found.settled).any():
                break  # at an end, or where the solution only touches it
            return system, done
        system, told = other, _jumps(system, done.x)
    raise ConvergenceError(f"no sequence of jumps fits a solution; {told or _jumps(system, done.x)}")


def _jumps(system: Any, x: Array) -> str:
    """Return where the equations jump along x, and whether a solution would slide there; "" where they do not."""
    found = system.switching(x)
    places = checks.listed(f"{name} at t = {place:.6g}" for name, place in zip(found.names, found.places))
    slides = ", and the fields on both sides point there: a solution that slides is stated as a SegmentedProblem"
    there = slides if system.outcomes.size and any(each.rates[1] < 0 for each in system.crossings(x)) else ""
    return f"the equations jump along the guess (tried last: {places}){there}" if found.jumps.any() else ""


def _moved(system: Any, x: Array, held: str | None) -> tuple[Any, Array]:
    """Return a guess with its crossings where Newton's method takes them, up to what one correction on a mesh leaves."""
    step = np.full(MOST_UPDATES if system.outcomes.size else 0, np.inf)
    system = system.with_pieces(system._pieces, crosses=1) if step.size else system
    for _ in step:
        rows = [] if held is None else [np.eye(1, system.size, system.parameter_index(held))[0]]
        residual, factors = system.linearize(x, rows)
        step = -factors.solve(np.append(residual, np.zeros(len(rows))))
        if not ROUGH < np.abs(step / (1 + np.abs(x))).max() < np.inf:
            break
        system, x = system.stepped(x, step)
    return system.with_pieces(system._pieces) if system.outcomes.size else system, x


def _on_switches(system: System, done: Corrected, corrected: Callable[[System, Array], Corrected]) -> tuple[System, Corrected]:
    """Return a solution on a mesh with points where conditions on states switch; the last one that Newton's method finds."""
    for _ in range(ROUNDS):
        moved = system.on_switches(done.x)
        if moved is None:
            break
        other, carry = moved
        try:
            done = corrected(other, carry(done.x))
        except ConvergenceError:
            break
        system = other
    return system, done


def _holding(system: System, x: Array, name: str, newton: Newton) -> Corrected:
    """Return the solution near x with the value of a free parameter that x has."""
    row = np.zeros(system.size)
    row[system.parameter_index(name)] = 1.0
    return correct(system, x, row, row @ x, newton, sizes=system.magnitudes)


def _corrected(system: System, x: Array, others: Sequence[Point], newton: Newton, explains: bool) -> Corrected:
    """Return the solution near x; raise ConvergenceError where Newton's method fails.

    Raises ProblemError, which says why, where the equations are singular at the guess, or everywhere.
    """
    try:
        if others:
            return correct_away(system, x, others, newton)
        done = correct(system, x, newton=newton, sizes=system.magnitudes)
        system.check_solution(done.x)
        if not explains:
            return done
        if doubt := doubtful(system, done):
            raise ProblemError(doubt)
        return looked_at(system, done)
    except ConvergenceError as error:
        if not others and (found := recovered(system, x, newton, explains)):
            return found
        if why := system.degenerate(x) or (explains and not others and dependence(system, x)):
            raise ProblemError(why) from None
        if others:
            raise
        raise ConvergenceError(f"{error}: {(explains and not_finite_near(system, x)) or _advice(system)}") from None


def _advice(system: System) -> str:
    """Return what helps where no solution is found."""
    values = dict(zip(system.problem.parameters, system.parameters))
    held = [f"{name} = {exact_text(value)}" for name, value in values.items() if name not in system.free]
    if not held:
        return "give a guess closer to a solution"
    return (
        f"give a guess closer to a solution; if there may be none at {checks.listed(held)}, solve at other values and follow "
        "the solution from there (trace)"
    )


def _check_count(problem: BoundaryValueProblem | AlgebraicProblem, free: Sequence[str]) -> str | None:
    """Return the free parameter that is held because another one is found in its place; raise ProblemError on their number."""
    needed = problem.free_size - 1
    if needed < 0:
        there = len(problem.state_names) + needed
        kind = "equations" if problem.domain is None else "boundary and integral conditions"
        raise ProblemError(f"problem: {there} {kind} for {len(problem.state_names)} states; {-needed} more needed")
    if problem.spare in free and len(free) == needed + 1:
        return problem.spare
    if len(free) != needed:
        raise ProblemError(f"free: {len(free)} given, a solution of this problem needs {needed} (conditions - states)")
    return None


def _checked(parameters: Mapping[str, float] | None) -> dict[str, float]:
    """Return the values of parameters that a user gives."""
    if parameters is None:
        return {}
    for name, value in checks.mapping("parameters", parameters, "numbers").items():
        checks.number(f"parameters: {checks.plain(name)}", value)
    return dict(parameters)
