"""A run from a point of a branch, and the first points of branches of cycles, fields in time and connections."""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Callable, Sequence
from typing import Annotated, Any, ParamSpec, Unpack

import numpy as np

from contin import errors as checks
from contin.arrays import Array
from contin.boundary.fields import Fields
from contin.boundary.oscillating import TIMES, oscillating, turned
from contin.collocation.mesh import CYCLE_DEGREE, MeshControl
from contin.connections.branches import crossing, ending
from contin.connections.equations import ConnectionCollocation
from contin.connections.statement import ConnectionProblem
from contin.continuation.progress import Progress, follow_until_interrupted
from contin.continuation.run import Continuation
from contin.core.labels import Label
from contin.core.newton import correct
from contin.core.protocol import Discretization
from contin.core.settings import Options, Settings, settings_with
from contin.core.step import Reason
from contin.core.system import usual
from contin.core.trial import Trial, linearization
from contin.cycles.equations import CycleCollocation, PeriodicCollocation
from contin.cycles.floquet import doubles
from contin.cycles.map_equations import MapSystem
from contin.cycles.statement import CycleProblem
from contin.equilibria.equations import Algebraic, CriticalPair, critical_pair
from contin.errors import ConvergenceError, ProblemError, Within, warn
from contin.events.branch_point import locate_branch_point
from contin.events.labelled import finding_of, frequency_of
from contin.levels import APART, BESIDE, ROUGH
from contin.linalg.orientation import oriented_along
from contin.problems.angles import winding_names, windings
from contin.problems.statement import PERIOD, ROUNDS, TIME, forget_changed
from contin.results.branch import Branch
from contin.results.point import Point, point_of, underlying

_Given = ParamSpec("_Given")
#: Intervals of the first mesh of a branch from a Hopf point, at least. A run that wants 40 would make its first step on 20 and,
#: again, on 40: that takes a tenth of a branch of Lorenz's cycles.
_INTERVALS = 20


def switches(point: Point) -> bool:
    """Return whether a branch of another kind begins at a point."""
    return point.system.starts_cycles and (point.label == Label.HOPF or doubles(point))


def switched(
    point: Point, fewest: int, free: Sequence[str] | None = None, way: float = 1
) -> tuple[PeriodicCollocation | MapSystem, Array, Array]:
    """Return the system of the cycles that begin at a point, the point in it, and the tangent there.

    Free parameters are those of the point, or others: the new branch leaves along the states alone, whichever are free. The
    first mesh from a Hopf point has the ``fewest`` intervals of a run, or more. ``way`` is +1 or -1, as ``direction``. Raises
    ProblemError where none begin there; ConvergenceError where the branch point of doubled orbits is not found.
    """
    found, x, along = doubled(point) if doubles(point) else from_hopf(point, max(fewest, _INTERVALS))
    if free is not None:
        cycles, (found, x) = found, found.with_free(checks.names("free", free), x)
        along = found.pack(cycles.states(along), dict.fromkeys(found.free, 0.0))
    system: Any = point.system
    if doubles(point) or system.is_smooth(point.x, frequency_of(point)):
        return found, x, way * along
    tangent = way * along  # terms like v |v| change the parameters; along the ellipse alone no step is believed, however short
    beside: Any = found
    size = ROUGH / np.abs(tangent).max()
    there, row = x + size * tangent, beside.weights * tangent
    rates = (correct(beside.with_reference(there), there, row, row @ there).x - x) / size
    return found, x, np.append(tangent[: found.state_size], rates[found.state_size :])


def from_hopf(point: Point, intervals: int) -> tuple[CycleCollocation, Array, Array]:
    """Return the system of the cycles that leave a Hopf point, the point as an orbit of no size, and the tangent there.

    The tangent is the ellipse of the critical eigenvector v, Re(v exp(2 pi i t)), with the period 2 pi over the frequency.
    Raises ProblemError where it is no Hopf point of equilibria.
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
    return (cycles, x) if all(np.all(found == 1) for found in sizes) else cycles.with_scales(x, *sizes)


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
    and, if n is even, about the same period. Raises ProblemError where it is no period-doubling point; ConvergenceError where
    the branch point is not found.
    """
    system: Any = point.system
    if not doubles(point):
        raise ProblemError(f"start: a point with the label {point.label!r} is no period doubling")
    if not system.intervals:
        twice, x = system.doubled(point.x)  # the new branch leaves along a tangent that is none of that of single cycles
        found = locate_branch_point(twice, x)
        apart = [float(np.abs(np.subtract(*np.split(twice.states(tangent), 2))).max()) for tangent in found.tangents]
        return twice, found.x, found.tangents[int(np.argmax(apart))]
    adapted = system.adapted(point.x, MeshControl())  # the point is located on a mesh finer than the run needs
    system, x = (system, point.x) if adapted is None else (adapted[0], adapted[1](point.x))
    mesh = np.concatenate([system.mesh, 1 + system.mesh[1:]]) / 2
    longer, factor = PERIOD if system.problem.period is None else ROUNDS, 2 if system.order % 2 else 1
    problem, turn, gained = system.problem, system.problem.symmetry, system.gains[1]
    further = windings(problem.angles, problem.state_names, gained + turn @ gained)
    parameters = {**point.parameters, longer: factor * point.parameters[longer], **further}
    twice = problem.doubled().discretized(system.free, parameters, system.scales, mesh, system.degree)
    states = system.states(x)
    x = twice.pack(np.concatenate([states, states[1:] @ turn.T + gained]), parameters)
    found = locate_branch_point(twice.with_reference(x), x)
    half = twice.nodes.size // 2  # the tangent that changes most from one round to the next; all of the other may be round-off
    rounds = [(states[: half + 1] @ turn.T, states[half:]) for states in map(twice.states, found.tangents)]
    tangent = found.tangents[int(np.argmax([np.abs(first - second).max() for first, second in rounds]))]
    return twice.with_reference(found.x), found.x, tangent


def from_non_central(point: Point) -> tuple[ConnectionCollocation, Array, Array]:
    """Return the system of the other curve that meets a non-central orbit, the orbit in it, and the tangent there.

    From a curve of orbits to a saddle it is that of central orbits to the saddle-node, and the other way round. The orbit
    solves the equations of both: its component along the eigenvector is zero at one end. The tangent leads to central orbits,
    or to those of a saddle. Raises ProblemError where the curve has other than two free parameters.
    """
    system: Any = point.system
    old = system.problem
    if len(system.free) != old.free_size:
        raise ProblemError("start: must be a point of a curve of homoclinic orbits in two parameters")
    to_saddle, side = crossing(point)
    unstable = old.unstable - side if to_saddle else old.unstable + side
    values, own = dict(point.parameters), (*old.multipliers, TIME, *winding_names(old.angles))
    given = {name: value for name, value in values.items() if name not in own}
    problem = ConnectionProblem(old.field, old.state_names, given, unstable=unstable, angles=old.angles, saddle_node=to_saddle)
    other = ConnectionCollocation(problem, system.mesh, system.degree, system.free, values, system.scales)
    other = other.with_reference(point.x)
    row = np.zeros(other.size)
    row[other.parameter_index(system.free[0])] = 1.0
    tangent = linearization(other, point.x, row).tangent
    inside = ending(other, side).function
    beside = [inside(Trial.without_tangent(other, point.x + way * BESIDE * tangent)) for way in (1, -1)]
    return other, point.x, tangent if beside[0] > beside[1] else -tangent


#: Degree of the polynomials that stand for the critical vector in the phase condition. They need not be right: any weights do
#: that move with the oscillation. A spline through the nodes is not smooth, and the mesh was refined to 224 intervals for it.
_SMOOTH = 12
#: Most times of one period.
_MOST = 201


def begins_oscillations(point: Point) -> bool:
    """Return whether time-periodic states of a field begin at a point."""
    return point.label == Label.HOPF and isinstance(point.system, Fields)


def oscillation(point: Point, times: int = TIMES) -> tuple[Point, Array]:
    """Return the first of the time-periodic states that begin at a Hopf point of a field, of no size, and the tangent there.

    Parameters
    ----------
    point : Point
        A Hopf point of a `BoundaryValueProblem` with ``rates``.
    times : int
        Odd number of times of one period at which the states are unknowns, at least 5. `trace` takes 11.

    Raises
    ------
    ProblemError
        It is no such point, or the field has integral conditions.

    Examples
    --------
    >>> import contin, math
    >>> field = contin.BoundaryValueProblem(
    ...     lambda t, u, p: (u.da, p.w * u.b - u.a * (p.r - u.a**2 - u.b**2), u.db, -p.w * u.a - u.b * (p.r - u.a**2 - u.b**2)),
    ...     lambda a, b, p: (a.da, b.da, a.db, b.db), ["a", "da", "b", "db"], {"r": -0.1, "w": 2.0},
    ...     rates={"da": lambda t, u, w, p: w.a, "db": lambda t, u, w, p: w.b})
    >>> (hopf,) = contin.trace(contin.solve(field, [0.0] * 4), free=["r"], limits={"r": (-0.1, 0.1)}).labelled("HB")
    >>> first, tangent = oscillation(hopf, 5)
    >>> waves = contin.trace(first, tangent=tangent, limits={"r": (-1, 1)})
    >>> print(round(waves[-1]["r"], 9), round(waves[-1]["period"] / math.pi, 9), round(waves[-1]["swing_a"], 9))
    1.0 1.0 0.5
    """
    frequency = frequency_of(point)
    if not begins_oscillations(point) or frequency is None:
        raise ProblemError(f"point: one with the label {point.label!r} is no Hopf point of a field")
    checks.whole("times", times, 5, _MOST)
    if times % 2 == 0:
        raise ProblemError(f"times: {times} must be odd")
    given: Any = point.system
    system, x = given.without_scales(point.x)
    count = len(system.problem.states)
    _, critical = system.form(x).critical(1j * frequency)
    vector = np.asarray(critical.states)[: system.state_size].reshape(-1, count)
    phase = {
        int(k): (_smooth(system.nodes, vector[:, k].real), _smooth(system.nodes, vector[:, k].imag))
        for k in np.flatnonzero(system.moving_states)
    }
    problem = oscillating(system.problem, phase, times)
    values = {**dict(zip(system.problem.parameters, map(float, system.all_parameters(x)))), PERIOD: 2 * math.pi / frequency}
    degree = problem.usual_degree(MeshControl().tolerance)  # less than that of the field: there are more states
    found: Any = problem.discretized([system.free[0], PERIOD], values, None, system.mesh, degree)

    def carried(states: Array) -> Array:
        return system.evaluate(system.pack(states, dict.fromkeys(system.free, 0.0)), found.nodes)

    first = found.pack(np.tile(carried(system.states(x)), (1, times)), values)
    tangent = found.pack(turned(carried(vector.real) + 1j * carried(vector.imag), times), dict.fromkeys(found.free, 0.0))
    return point_of(found, first), tangent / np.abs(tangent).max()


def _smooth(nodes: Array, values: Array) -> Callable[[Any], Any]:
    """Return a polynomial that fits values at the nodes."""
    fit = np.polynomial.Polynomial.fit(nodes, values, min(_SMOOTH, len(nodes) - 1))
    (low, high), coefficients = fit.domain.tolist(), fit.coef.tolist()

    def polynomial(t: Any) -> Any:
        z, found = (2 * t - low - high) / (high - low), 0.0
        for coefficient in coefficients[::-1]:
            found = found * z + coefficient
        return found

    return polynomial


def either_way(function: Callable[_Given, Branch]) -> Callable[_Given, Branch]:
    """Return a function that follows a branch, and takes ``direction="both"``, too."""

    @functools.wraps(function)
    def followed(*given: _Given.args, **named: _Given.kwargs) -> Branch:
        if named.get("direction") != "both":
            return function(*given, **named)
        run: Any = function
        ahead = run(*given, **{**named, "direction": 1})
        start: Any = named.get("start", given[0] if given else None)  # cycles that begin there are the same both ways
        both_are_one = named.get("branch") == 1 and switches(start)
        if both_are_one or ahead.stop is None or ahead.stop.reason in (Reason.CLOSED, Reason.INTERRUPTED):
            return ahead
        back, first = run(*given, **{**named, "direction": -1}), ahead.points[0]
        if first.label == Label.END:  # it is none any more
            first = dataclasses.replace(first, label=Label.REGULAR, name="")
        stop = dataclasses.replace(ahead.stop, message=f"{ahead.stop.message}; backwards: {back.stop}")
        return Branch([*map(_backwards, back.points[:0:-1]), first, *ahead.points[1:]], stop, [*back.notes, *ahead.notes])

    return followed


def _backwards(point: Point) -> Point:
    """Return a point of a branch that is passed the other way."""
    change = point.index_change and point.index_change[::-1]
    return dataclasses.replace(point, arclength=-point.arclength, tangent=-point.tangent, index_change=change)


@either_way
@checks.arguments
def trace(start: Point, settings: Settings | None = None, *, free: Sequence[str] | None = None,
          branch: Annotated[int, Within(0, 10)] | None = None,
          tangent: Array | None = None, progress: bool | None = None, **options: Unpack[Options]) -> Branch:  # fmt: skip
    """Follow the branch through a point, or away from a branch point, to its end.

    Ctrl-C ends the run: the branch so far is returned. With ``direction="both"`` it is the branch both ways from the point,
    where its arclength is 0: from the end of the way of ``direction=-1`` to that of ``direction=1``. Cycles that begin at HB
    or PD are the same both ways.

    Parameters
    ----------
    start : Point
        Of `solve`, of another branch, or read back.
    settings : Settings, optional
        Or any of its fields by name.
    free : sequence of str, optional
        Free parameters, if they shall differ from those of ``start``; the first is the primary one. From a point of a curve in
        two parameters they lead to the branch of solutions through it (where folds meet a branch point, to those that cross
        there). With ``branch=1`` at HB and PD, those of the new branch: by default that in which the point was found, of a
        point of a curve the first of the curve.
    branch : int, optional
        Which branch to take from a branch point: 0 the one that ``start`` was found on, 1 the other one. ``direction=-1`` takes
        the opposite way. Every point of a curve of HB, PD or BP is such a point (of BP either may be 0). 0 is the only one
        where no other begins. At NCH, 1 is the curve of homoclinic orbits to the saddle-node or, from there, to the saddle. By
        default the one that it was found on, with ``direction`` that of the primary parameter.
    tangent : ndarray, shape (size,), optional
        Where branches cross and ``start`` does not know their tangents, as a solution that is known in closed form does
        (`contin.lowlevel.point_of`): the one to leave along, in the unknowns of ``start.system``.
    progress : bool, optional
        Show one line on standard error while the run is under way: by default where standard error is a terminal.

    Raises
    ------
    ProblemError, ConvergenceError

    Examples
    --------
    >>> from contin import AlgebraicProblem, solve
    >>> pitchfork = AlgebraicProblem(lambda u, p: (u.x * (p.a - u.x**2),), ["x"], {"a": -1.0})
    >>> trivial = trace(solve(pitchfork, [0.0]), free=["a"], limits={"a": (-1, 1)})
    >>> forked = trace(trivial.labelled("BP")[0], branch=1, limits={"a": (-1, 1)})
    >>> print(round(abs(forked.points[-1].x[0]), 9))
    1.0
    """
    settings, shown = settings_with(settings, options), Progress(progress)
    system, x, along, singular = _first(start, settings, free, branch, tangent)
    return follow_until_interrupted(Continuation(system, x, settings, along, singular=singular, origin=start), shown)


def _first(
    start: Point, settings: Settings, free: Sequence[str] | None, branch: int | None, tangent: Array | None
) -> tuple[Discretization, Array, Array | None, bool]:
    """Return system and first x of a run, the tangent where Newton's method shall not find it, and whether branches cross."""
    if start.system.on_curve and (free is not None or branch is not None and not finding_of(start.details).is_branch_point):
        start, free = _solution(start, free)
    system: Any = start.system
    x, way = start.x, settings.direction
    if not system.on_curve and forget_changed(system.problem):
        system = system.with_parameters({})
    if tangent is not None:
        if branch is not None or free is not None:
            raise ProblemError("tangent: must be left out where branch or free is given")
        return system, x, way * checks.array("tangent", tangent, (system.size,)), True
    if branch == 1 and switches(start):
        return *switched(start, settings.mesh.min_intervals, free, way), True
    if branch == 1 and begins_oscillations(start):
        first, along = oscillation(start)
        oscillations: Any = first.system
        if free is not None and checks.names("free", free) != oscillations.free:
            raise ProblemError(f"free: must be left out, or {', '.join(oscillations.free)}, with which oscillations begin")
        return oscillations, first.x, way * along, True
    if branch == 1 and start.label == Label.NON_CENTRAL and not start.system.on_curve:  # two curves meet at such an orbit
        if free is not None:
            raise ProblemError("free: the curve that leaves at NCH has the parameters of the one it was found on; leave it out")
        orbits, x, along = from_non_central(start)
        return orbits, x, way * along, False
    if free is not None and checks.names("free", free) != system.free:
        system, x = system.with_free(free, x)
    if start.label == Label.BRANCH_POINT and start.details is None:  # of `solve`
        start = _as_branch_point(dataclasses.replace(start, system=system, x=x))
        x = start.x
    if branch is None or (branch == 0 and not finding_of(start.details).is_branch_point):
        return system, x, _own_tangent(start, system, settings), True
    return system, x, way * _tangent(start, system, branch), True


def follow(
    system: Discretization, x: Array, settings: Settings = Settings(), tangent: Array | None = None, singular: bool = True
) -> Branch:
    """Return `contin.trace` of a first point, under the name and with the arguments of version 0.2.

    Examples
    --------
    >>> from contin import AlgebraicProblem
    >>> from contin.lowlevel import Algebraic, point_of
    >>> parabola = Algebraic(AlgebraicProblem(lambda u, p: (p.a - u.x**2,), ["x"], {"a": 1.0}), ["a"])
    >>> branch = trace(point_of(parabola, np.array([1.0, 1.0])), direction=-1, limits={"a": (-1, 4)})  # in place of it
    >>> [point.label for point in branch if point.label]
    ['EP', 'LP', 'EP']
    """
    warn(
        "contin.lowlevel.follow(system, x, ...) is contin.trace(contin.lowlevel.point_of(system, x), ...) now",
        DeprecationWarning,
    )
    run = Continuation(system, x, settings, tangent, singular=singular)
    return Branch(list(run), run.stop, run.notes)


def _solution(start: Point, free: Sequence[str] | None) -> tuple[Point, tuple[str, ...]]:
    """Return the solution itself of a point of a curve, as a point of its branch, and the free parameters of that branch.

    These are the first ones of the curve where none are given. Branch points, and points where folds meet one, are located.
    """
    found, curve = underlying(start), start.system
    solution: Any = curve.solution
    names = checks.names("free", curve.free[: solution.problem.free_size] if free is None else free)
    if found.label == Label.HOPF:  # of equilibria: the parameters are those of cycles
        return found, names
    system, x = found.system.with_free(names, found.x)  # type: ignore[attr-defined]
    found = dataclasses.replace(found, x=x, tangent=np.full(x.size, np.nan), system=system)
    return (_as_branch_point(found) if Label.BRANCH_POINT in (start.label, found.label) else found), names


def _as_branch_point(found: Point) -> Point:
    """Return a solution as the branch point that it is, with the branches that leave; itself where it is none."""
    try:
        point = locate_branch_point(found.system, found.x)
    except ConvergenceError:
        return found
    if not np.abs(point.x - found.x).max() < APART * (1 + np.abs(found.x).max()):
        return found  # as at a fold in the other parameter
    return dataclasses.replace(found, label=Label.BRANCH_POINT, x=point.x, details=point)


def _own_tangent(start: Point, system: Discretization, settings: Settings) -> Array | None:
    """Return the tangent of the branch that a branch point was found on, oriented; None at other points."""
    known = finding_of(start.details)
    if not known.leaving or system is not start.system:
        return None  # elsewhere the equations tell it
    tangent: Array = known.leaving[0]
    return settings.direction * oriented_along(tangent, tangent[system.parameter_index(settings.primary or system.free[0])])


def _tangent(start: Point, system: Discretization, branch: int) -> Array:
    """Return a tangent of a branch point, in the free parameters of a system: those of the point, in any order."""
    known = finding_of(start.details)
    if not known.is_branch_point:
        first = "0 or 1" if switches(start) else "0"
        labelled = f"a point labelled {start.label or 'nothing'!r}"
        raise ProblemError(f"branch: {branch} must be {first} at {labelled}; other branches begin at BP, HB and PD")
    if set(system.free) != set(start.system.free):
        own = ", ".join(start.system.free)
        raise ProblemError(f"free: {', '.join(system.free)} must be {own}, with which the branch point was found")
    if not 0 <= branch < len(known.leaving):
        raise ProblemError(f"branch: {branch} must lie between 0 and {len(known.leaving) - 1}")
    tangent: Array = known.leaving[branch]
    if not start.system.on_curve:
        at = [start.system.parameter_index(name) for name in system.free]
        tangent = np.concatenate([tangent[: system.state_size], tangent[at]])
    return tangent
