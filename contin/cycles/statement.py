"""Cycles and maps: what users state, and symmetries."""

from __future__ import annotations

import functools
import math
import weakref
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from contin import errors as checks
from contin.arrays import Array, Function, Named, Places
from contin.boundary.statement import BoundaryValueProblem
from contin.collocation.mesh import CYCLE_DEGREE
from contin.core.system import Scales
from contin.cycles.equations import CycleCollocation, ForcedCollocation, PeriodicCollocation
from contin.cycles.map_equations import MapSystem
from contin.draws import PLACES, generator
from contin.equilibria.statement import AlgebraicProblem, ReducedProblem
from contin.errors import ProblemError
from contin.functions.batch import Batch
from contin.functions.signature import Arguments, Signature, named_values
from contin.levels import LOCATED
from contin.problems.angles import WINDING, Angles, angle_periods, check_periodic, whole_rounds, winding_names
from contin.problems.rewriting import Mass, check_field, found_elsewhere, of_parameters, returning, scaled
from contin.problems.statement import PERIOD, ROUNDS, check_statement

#: The largest order of a symmetry: rings of more oscillators are rare, and one n-th of a cycle should be worth a mesh.
_MOST = 60


def symmetry_matrix(symmetry: object, count: int) -> Array:
    """Return the matrix of a symmetry that is given as a matrix or as its diagonal.

    Raises ProblemError where it is neither, the identity, or of no order up to 60.
    """
    try:
        given = np.array(symmetry, dtype=float)
    except (TypeError, ValueError, OverflowError):
        given = np.empty(0)
    if given.shape not in ((count,), (count, count)) or not np.isfinite(given).all():
        raise ProblemError(f"symmetry: {checks.shown(symmetry)} must be {count} signs, or a matrix of {count} rows and columns")
    matrix = np.diag(given) if given.ndim == 1 else given
    if order_of(matrix) == 1:
        raise ProblemError("symmetry: the identity is none; leave it out")
    return matrix


def order_of(matrix: Array) -> int:
    """Return the smallest n with S^n = 1; raise ProblemError where there is none up to 60."""
    one, power = np.eye(len(matrix)), matrix
    for order in range(1, _MOST + 1):
        if np.abs(power - one).max(initial=0.0) <= LOCATED:
            return order
        power = power @ matrix
    raise ProblemError(f"symmetry: no power of the matrix up to {_MOST} is the identity")


def check_equivariance(field: Function, matrix: Array, names: Sequence[str], parameters: Mapping[str, float]) -> None:
    """Check F(S u) = S F(u) at some places, with the default parameters; where the field has no value nothing is checked.

    Raises ProblemError otherwise.
    """
    if order_of(matrix) == 1:
        return
    of_state, of_parameters = named_values(tuple(names)), named_values(tuple(parameters))
    p = of_parameters(**parameters)
    for u in generator("symmetry").uniform(-1, 1, (PLACES, len(names))):
        try:
            first, turned = (np.array(field(of_state(*map(float, v)), p), dtype=float) for v in (u, matrix @ u))
        except (ArithmeticError, ValueError):
            continue  # a root or logarithm of a negative number
        gap = np.abs(turned - matrix @ first)
        if np.any(gap > LOCATED * (1 + np.abs(first).max())):
            raise ProblemError(
                f"symmetry: the field does not have it; the rate of {names[int(gap.argmax())]} at S u differs by "
                f"{gap.max():.3g} from that of S F(u) for u = {', '.join(f'{value:.3g}' for value in u)}"
            )


def check_lattice(matrix: Array, names: Sequence[str], angles: Mapping[str, float]) -> None:
    """Check that S changes states by whole rounds of angles where an angle goes round once; raise ProblemError otherwise."""
    periods = np.array([angles.get(name, 0.0) for name in names])
    for name, period in angles.items():
        moved = period * matrix[:, names.index(name)]
        if np.any(np.abs(moved - whole_rounds(moved, periods)) > LOCATED):
            raise ProblemError(f"symmetry: where {name} goes round once, S u must change by whole rounds of angles")


def image(matrix: Sequence[Sequence[float]], u: Sequence[Any]) -> list[Any]:
    """Return the product of a matrix, as a list of rows, and a vector; zeros and ones are not multiplied."""
    terms = [[value if factor == 1 else factor * value for factor, value in zip(row, u) if factor] for row in matrix]
    return [sum(each[1:], each[0]) for each in terms]


def averaged(function: Function, matrix: Array, names: Sequence[str], order: int) -> Function:
    """Return the mean of a functional over u, S u, ..., S^(n-1) u, as a function of (t, u, p)."""
    state = named_values(tuple(names))
    powers = [np.linalg.matrix_power(matrix, k).tolist() for k in range(order)]

    def mean(t: Any, u: Any, p: Any) -> Any:
        values = [function(state(*image(power, u)), p) for power in powers]
        return sum(values[1:], values[0]) / order

    return mean


#: What is said of a field with other arguments.
_FORCED = "must be a function of (t, u, p), as a period is given"
_AUTONOMOUS = "must be a function of (u, p); one of (t, u, p) needs a period"

#: Name of the time among the parameters of a forced field at rest: no user's parameter has it.
_TIME = "time_of_the_forcing"

#: The period of a forcing: a number, the name of a parameter, or a function of the parameters.
Period = float | str | Callable[[Any], Any]


class CycleProblem(BoundaryValueProblem):
    """Periodic orbits of u' = F(u, p), or of u' = F(t, u, p) where F has a known period in t.

    On the unit interval: u' = T F(u, p), u(0) = u(1). Of an autonomous field, the period T is the parameter ``period``; it is
    free on every curve and need not be named. The phase condition, the integral of u . v' = 0 with an earlier orbit v of the
    run, keeps the orbit from sliding along itself.

    Of a forced field there is no phase condition, and the period is a column: that of the forcing times the parameter
    ``rounds``, the number of periods of the forcing after which the cycle closes.

    States that are angles may gain whole rounds: u(1) = u(0) + 2 pi k. The winding number k of the angle phi is the parameter
    ``winding_phi``, which is read off the guess, unless it is given, and cannot be free. A constant guess goes round uniformly
    as often as is given. The largest and smallest value of an angle that rotates are half a period and minus that.

    Parameters
    ----------
    field : callable
        ``field(u, p)`` returns the rates of the states, as for an `AlgebraicProblem` whose equilibria are looked for;
        ``field(t, u, p)`` with ``period``. With one argument more, an array, it fills that with the rates.
    states : sequence of str
    parameters : mapping of str to float
        Names and default values.
    functionals : mapping of str to callable, optional
        ``f(u, p)``, of a forced field ``f(t, u, p)``: means over the period, columns of every point. The largest and the
        smallest value of each state are columns by themselves: ``max_`` and ``min_`` + name.
    period : float, str or callable, optional
        The period of a forced field: a number, the name of a parameter, or a function ``period(p)``.
    symmetry : sequence of float or array, optional
        Of an autonomous field, a matrix S, or its diagonal, with F(S u) = S F(u) and S^n = 1: cycles with u(t + T/n) = S u(t)
        are looked for, n the smallest such number. One n-th of the cycle is computed, with u(1) = S u(0) on the unit interval
        and the time T/n. Guesses, the period and all columns are those of the whole cycle; winding numbers are those of the
        part: u(1) = S u(0) + 2 pi k.
    angles : sequence of str, or mapping of str to float, optional
        States in which the field is periodic, with the period 2 pi or, in a mapping, any other. Functionals should be periodic
        in them, too: the mean of another one depends on where the round begins.
    mass : matrix, or sequence of float, optional
        As for an `AlgebraicProblem`, of M u' = F. Of states without rates the mean is a column, too.

    Raises
    ------
    ProblemError
        A name, a period, a symmetry or a function that cannot be used; a field that is not periodic in an angle.

    Examples
    --------
    A circle of radius sqrt(mu), traversed in the time 2 pi:

    >>> import math, contin
    >>> def field(u, p):
    ...     square = u.x**2 + u.y**2
    ...     return p.mu * u.x - u.y - u.x * square, u.x + p.mu * u.y - u.y * square
    >>> problem = CycleProblem(field, ["x", "y"], {"mu": 0.25})
    >>> def guess(t):
    ...     return 0.6 * math.cos(2 * math.pi * t), 0.6 * math.sin(2 * math.pi * t)
    >>> orbit = contin.solve(problem, guess, {"period": 6})
    >>> print(round(orbit["period"] / math.pi, 10), round(orbit["max_x"], 10))
    2.0 0.5

    A forced linear oscillator, x" + x = a cos(w t) with x = a cos(w t) / (1 - w^2):

    >>> def forced(t, u, p):
    ...     return u.v, -u.x + p.a * math.cos(p.w * t)
    >>> problem = CycleProblem(forced, ["x", "v"], {"a": 3.0, "w": 2.0}, period=lambda p: 2 * math.pi / p.w)
    >>> print(round(contin.solve(problem, [0.0, 0.0], degree=7)["max_x"], 10))
    1.0

    A pendulum with friction, driven by a constant torque: where it rotates, the torque balances the friction in the mean:

    >>> pendulum = CycleProblem(lambda u, p: (u.v, p.torque - u.v - math.sin(u.phi)), ["phi", "v"], {"torque": 3.0},
    ...                         functionals={"mean": lambda u, p: u.v}, angles=["phi"])
    >>> rotation = contin.solve(pendulum, lambda t: (2 * math.pi * t, 3.0), {"period": 2.1})
    >>> print(rotation["winding_phi"], round(rotation["mean"] * rotation["period"] / math.pi, 8))
    1.0 2.0
    """

    field: Function
    means: Mapping[str, Function]
    period: Function | None
    symmetry: Array
    #: A period that is free where nothing else needs to be.
    spare = PERIOD

    def __init__(
        self, field: Function, states: Sequence[str], parameters: Mapping[str, float], *,
        functionals: Mapping[str, Function] | None = None, period: Period | None = None, symmetry: object = None,
        angles: Angles = (), mass: object = None,
    ) -> None:  # fmt: skip
        means = dict(checks.mapping("functionals", {} if functionals is None else functionals, "functions"))
        names = check_statement(states, parameters, means)
        forced = period is not None
        periods = angle_periods(angles, names)
        windings = dict.fromkeys(winding_names(periods), 0.0)
        extremes = [f"{kind}_{name}" for name in names for kind in ("max", "min")]
        for name in (PERIOD, *extremes, *([ROUNDS] if forced else []), *windings):
            if name in parameters or name in means:
                raise ProblemError(f"parameters: {name} is a column of every cycle by itself")
        signature = Signature(names, tuple(parameters), times=forced)
        field = returning(field, signature)
        check_field(field, signature, _FORCED if forced else _AUTONOMOUS)
        kept_mass = None if mass is None else Mass.of(mass, names)
        if kept_mass is not None and kept_mass.is_regular:
            field, kept_mass = kept_mass.rates_of(field, 2 + forced), None
        if forced and symmetry is not None:
            raise ProblemError("symmetry: must be left out where a period is given; only autonomous fields may have one")
        turn = np.eye(len(names)) if symmetry is None else symmetry_matrix(symmetry, len(names))
        check_equivariance(field, turn, names, parameters)
        check_lattice(turn, names, periods)
        found = None if period is None else of_parameters("period", period, parameters, positive=True)
        rhs = scaled(field, PERIOD, order_of(turn)) if found is None else _scaled_by_forcing(field, found)
        if kept_mass is not None and symmetry is not None:
            raise ProblemError("symmetry: must be left out where states have no rates (mass)")
        self._keep(field=field, means=means, period=found, symmetry=turn, order=order_of(turn), angles=periods, mass=kept_mass)
        own = {**({ROUNDS: 1.0} if forced else {PERIOD: 1.0}), **windings}
        super().__init__(rhs, _periodic(turn, names, periods), names, {**parameters, **own})
        self._keep(functionals={**dict.fromkeys([*extremes, PERIOD] if forced else extremes, found_elsewhere), **means})
        if periods:
            check_periodic("field", self.batch("field"), periods, self.parameters)

    @property
    def own_time(self) -> str:  # type: ignore[override]
        """The period, of an autonomous field."""
        return PERIOD if self.period is None else ""

    @property
    def _given(self) -> dict[str, float]:
        """The parameters that the user has stated."""
        own = (PERIOD if self.period is None else ROUNDS, *winding_names(self.angles))
        return {name: value for name, value in self.parameters.items() if name not in own}

    def _signatures(self) -> Mapping[str, Arguments]:
        stated, every = tuple(self._given), tuple(self.parameters)
        of_field, of_means = (Signature(self.state_names, p, times=self.period is not None).arguments for p in (stated, every))
        return {"field": of_field, "functionals": of_means, "period": [stated]}

    def discretized(
        self, free: Sequence[str], parameters: Mapping[str, float], scales: Scales | None = None, mesh: Places = (),
        degree: int = 0,
    ) -> PeriodicCollocation:  # fmt: skip
        """Return F(x) = 0 with these free parameters and sizes, on a mesh.

        Examples
        --------
        >>> problem = CycleProblem(lambda u, p: (u.v, -p.k * u.x), ["x", "v"], {"k": 4.0})
        >>> problem.discretized(["k", "period"], {"period": 3.0}, mesh=[0, 0.5, 1], degree=4)
        CycleCollocation(2 intervals of degree 4, states x, v; free k, period)
        """
        kind = CycleCollocation if self.period is None else ForcedCollocation
        return kind(self, mesh, degree, free, parameters, scales)

    def _groups(self) -> list[str]:
        return ["field", "boundary", *(["functionals"] if self.means else [])]

    def usual_degree(self, tolerance: float) -> int:
        """Return the degree of a mesh where none is given.

        Examples
        --------
        >>> CycleProblem(lambda u, p: (u.v, -p.k * u.x), ["x", "v"], {"k": 4.0}).usual_degree(1e-12)
        6
        """
        return CYCLE_DEGREE

    @classmethod
    def of(cls, problem: AlgebraicProblem) -> CycleProblem:
        """Return the cycles of the vector field whose equilibria a problem states, one statement for each.

        Examples
        --------
        >>> from contin import AlgebraicProblem
        >>> equilibria = AlgebraicProblem(lambda u, p: (u.v, -p.k * u.x), ["x", "v"], {"k": 4.0})
        >>> list(CycleProblem.of(equilibria).parameters)
        ['k', 'period']
        """
        found = _STATED.get(problem)
        if found is None:
            given = problem.residual, problem.state_names, problem.parameters, problem.functionals
            if problem.following:
                found = FollowedProblem(*given, problem.following, angles=problem.angles)
            else:
                found = cls(*given[:3], functionals=problem.functionals, angles=problem.angles)
            _STATED[problem] = found
        return found

    @functools.cached_property
    def _at_rest(self) -> AlgebraicProblem:
        """The equilibria of the field; of a forced one with the time as a parameter."""
        parameters, field = self._given, self.field
        if self.period is None:
            return AlgebraicProblem(field, self.state_names, parameters, self.means, angles=self.angles)
        known = named_values(tuple(parameters))

        def at_time(u: Any, p: Any) -> Any:
            return field(getattr(p, _TIME), u, known(*(getattr(p, name) for name in parameters)))

        return AlgebraicProblem(at_time, self.state_names, {**parameters, _TIME: 0.0}, {}, angles=self.angles)

    def without_found(self, start: Sequence[float]) -> CycleProblem:
        """Return the same cycles without states that have no rates, which are found from a start.

        Examples
        --------
        >>> def oscillator(u, p):
        ...     return u.v, -p.k * u.x - u.drag, u.drag + u.drag**3 - u.v
        >>> CycleProblem(oscillator, ["x", "v", "drag"], {"k": 4.0}, mass=[1, 1, 0]).without_found([0.0])
        FollowedProblem(states x, v; parameters k, period)
        """
        arguments, names, mass = 2 if self.period is None else 3, self.state_names, self.mass

        def of_kept(function: Function) -> Function:
            return mass.of_kept(function, self.field, names, start, arguments)

        def state(place: int) -> Function:
            return lambda *given: given[-2][place]

        means = {name: of_kept(function) for name, function in self.means.items()}
        means |= {names[i]: of_kept(state(i)) for i in mass.columns}
        kept = mass.kept_names(names)
        angles = {name: period for name, period in self.angles.items() if name in kept}
        rates = of_kept(mass.rates_of(self.field, arguments))
        following = [names[i] for i in mass.columns]
        return FollowedProblem(rates, kept, self._given, means, following, period=self.period, angles=angles)

    def check_index(self, states: Array, parameters: Mapping[str, float]) -> None:
        """Check that the equations without rates determine the states that have none, at a place.

        Raises
        ------
        ProblemError

        Examples
        --------
        A rod of the length 1, with the force that holds it: a pendulum in Cartesian coordinates has the index 3.

        >>> def pendulum(u, p):
        ...     return u.vx, u.vy, -u.force * u.x, -u.force * u.y - p.g, u.x**2 + u.y**2 - 1
        >>> problem = CycleProblem(pendulum, ["x", "y", "vx", "vy", "force"], {"g": 1.0}, mass=[1, 1, 1, 1, 0])
        >>> try:
        ...     problem.check_index(np.array([0.6, -0.8, 0.0, 0.0, 0.8]), {"g": 1.0})
        ... except ProblemError as error:
        ...     print(str(error).partition(",")[0])
        mass: the equations without rates do not determine force at the guess
        """
        known = {name: value for name, value in parameters.items() if name in self._at_rest.parameters}
        with np.errstate(all="ignore"):
            jacobian = self._at_rest.discretized((), known).jacobian(states)
        self.mass.check_index(jacobian, self.state_names)

    @functools.cached_property
    def reduced(self) -> ReducedProblem | None:
        """The equilibria of the field with conserved totals as parameters; None where nothing is conserved.

        Raises
        ------
        ProblemError
            A total is conserved by a forced field, or by one whose symmetry is stated.
        """
        found = self._at_rest.reduced
        if found is not None and (self.period is not None or self.order > 1):
            what, totals = "a forced field" if self.period is not None else "a field with a symmetry", found.conserved
            states = checks.listed(found.following)
            raise ProblemError(
                f"field: {totals.partition(':')[0]}; state {what} without {states}, with the total as a parameter in its place"
            )
        return found

    @property
    def on_totals(self) -> CycleProblem:
        """The same cycles with conserved totals as parameters, or the problem itself where nothing is conserved."""
        return self if self.reduced is None else CycleProblem.of(self.reduced)

    def doubled(self) -> CycleProblem:
        """Return the problem of cycles that close after twice the part computed here: with the symmetry S^2.

        Of cycles without a symmetry, and with one of odd order, those are cycles of twice the period.

        Examples
        --------
        >>> oscillator = CycleProblem(lambda u, p: (u.v, -(u.x**3)), ["x", "v"], {}, symmetry=[-1, -1])
        >>> oscillator.order, oscillator.doubled().order
        (2, 1)
        """
        if self.order == 1:
            return self
        given: Any = {"functionals": self.means, "angles": self.angles}
        symmetry = self.symmetry @ self.symmetry if self.order > 2 else None
        return CycleProblem(self.field, self.state_names, self._given, symmetry=symmetry, **given)

    @property
    def multipliers(self) -> tuple[str, ...]:
        """Names of the parameters that are free on every curve."""
        return (PERIOD,) if self.period is None else ()

    @property
    def free_size(self) -> int:
        """Number of free parameters on a curve: one and, of an autonomous field, the period with the phase condition."""
        return 2 if self.period is None else 1

    def duration(self, parameters: Mapping[str, float]) -> float:
        """Return the period of a cycle with these parameters.

        Raises
        ------
        ProblemError
            The period of a forced field is no positive number there.

        Examples
        --------
        >>> import math
        >>> def forced(t, u, p):
        ...     return u.v, -u.x + math.cos(p.w * t)
        >>> problem = CycleProblem(forced, ["x", "v"], {"w": 2.0}, period=lambda p: 2 * math.pi / p.w)
        >>> round(problem.duration(problem.parameters) / math.pi, 10)
        1.0
        """
        if self.period is None:
            return parameters[PERIOD]
        value = self.period(named_values(tuple(parameters))(**parameters))
        if not checks.is_number(value) or not 0 < value < math.inf:
            raise ProblemError(f"period: {checks.shown(value)} must be a positive number")
        return float(value * parameters[ROUNDS])

    def _compiled(self, name: str) -> Batch:
        if name != "functionals":
            return super()._compiled(name)
        functions = [self._mean(function) for function in self.means.values()]
        return Batch(functions, [0] * len(functions), self.state_names, tuple(self.parameters))

    def _mean(self, function: Function) -> Function:
        """Return a functional as a function of (t, u, p) whose mean over the part computed is that over the period."""
        if (period := self.period) is not None:
            return lambda t, u, p: function(p.rounds * period(p) * t, u, p)
        if self.order == 1:
            return lambda t, u, p: function(u, p)
        return averaged(function, self.symmetry, self.state_names, self.order)


class FollowedProblem(CycleProblem):
    """Cycles with functionals that are states which follow from others; their extremes are columns, as those of states.

    - ``field``, ``states``, ``parameters``, ``functionals``, ``period``, ``angles``: As of a `CycleProblem`.
    - ``following`` (sequence of str): Names of these functionals.
    """

    def __init__(
        self, field: Function, states: Sequence[str], parameters: Mapping[str, float], functionals: Mapping[str, Function],
        following: Sequence[str], *, period: Period | None = None, angles: Angles = (),
    ) -> None:  # fmt: skip
        super().__init__(field, states, parameters, functionals=functionals, period=period, angles=angles)
        extremes = [f"{kind}_{name}" for name in following for kind in ("max", "min")]
        count, columns = 2 * len(states), list(self.functionals)
        columns[count:count] = extremes
        functions = {**self.functionals, **dict.fromkeys(extremes, found_elsewhere)}
        self._keep(following=tuple(following), functionals={name: functions[name] for name in columns})


#: The cycles of vector fields that are still used: to state them anew would make their functions ready again.
_STATED: weakref.WeakKeyDictionary[AlgebraicProblem, CycleProblem] = weakref.WeakKeyDictionary()


def _scaled_by_forcing(field: Function, period: Function) -> Function:
    """Return a forced field times the period, at the time from 0 to 1."""

    def rhs(t: float, u: Named, p: Named) -> Sequence[float]:
        duration = p.rounds * period(p)
        return [duration * rate for rate in field(duration * t, u, p)]

    return rhs


def _periodic(turn: Array, names: Sequence[str], angles: Mapping[str, float]) -> Function:
    """Return the boundary conditions S u(0) - u(1) = 0; angles gain whole rounds."""
    rows, rounds = turn.tolist(), [(names.index(name), WINDING + name, period) for name, period in angles.items()]

    def boundary(a: Sequence[float], b: Sequence[float], p: Named) -> Sequence[float]:
        gaps = [turned - end for turned, end in zip(image(rows, a), b)]
        for place, winding, period in rounds:
            gaps[place] = gaps[place] + period * getattr(p, winding)
        return gaps

    return boundary


class MapProblem(AlgebraicProblem):
    """Fixed points u = f(u, p) of a map, and its cycles: fixed points of f applied ``rounds`` times.

    ``rounds`` is a parameter of every map by itself, a whole number that cannot be free. A guess is one point of the cycle, or
    all of them one after the other; columns are those of the first. Multipliers are the eigenvalues of the derivative over all
    rounds: special points are folds (LP), branch points (BP), period doublings (PD) and torus bifurcations (TR).

    Angles may gain whole rounds along a cycle: ``winding_x``, a parameter by itself, is the number of those of the angle x. It
    is read off the guess, unless it is given; over ``rounds`` it is the rotation number.

    Parameters
    ----------
    map : callable
        ``f(u, p)`` returns the next states.
    states : sequence of str, or int
    parameters : mapping of str to float
        Names and default values.
    functionals : mapping of str to callable, optional
        ``g(u, p)``: columns of every point.
    angles : sequence of str, or mapping of str to float, optional
        States that are the same after a period, which is 2 pi or, in a mapping, any other: where one of them goes round once,
        the next states change by whole rounds of angles.

    Raises
    ------
    ProblemError
        A name, or a map with another number of values than states.

    Examples
    --------
    The logistic map doubles its period at r = 3:

    >>> import contin
    >>> logistic = MapProblem(lambda u, p: (p.r * u.x * (1 - u.x),), ["x"], {"r": 2.0})
    >>> branch = contin.trace(contin.solve(logistic, [0.5]), free=["r"], limits={"r": (2, 4)})
    >>> print([(point.label, round(point["r"], 10)) for point in branch.labelled("PD")])
    [('PD', 3.0)]

    The circle map, locked to half a round an iteration:

    >>> import math
    >>> def circle(u, p):
    ...     return (u.x + p.w - p.k / (2 * math.pi) * math.sin(2 * math.pi * u.x),)
    >>> locked = contin.solve(MapProblem(circle, ["x"], {"w": 0.5, "k": 0.9}, angles={"x": 1}), [0.3], {"rounds": 2})
    >>> print(locked["winding_x"], round(locked["x"], 10))
    1.0 0.3156183315
    """

    def __init__(
        self, map: Function, states: Sequence[str] | int, parameters: Mapping[str, float],
        functionals: Mapping[str, Function] | None = None, angles: Angles = (),
    ) -> None:  # fmt: skip
        names = check_statement(states, parameters, {})
        own = {ROUNDS: 1.0, **dict.fromkeys(winding_names(angle_periods(angles, names)), 0.0)}
        for name in own:
            if name in parameters:
                raise ProblemError(f"parameters: {name} is a parameter of every map by itself")
        parameters = {**parameters, **own}
        super().__init__(map, states, parameters, {} if functionals is None else functionals, dynamics=False, angles=angles)
        if self.equation_size != len(self.state_names):
            raise ProblemError(f"map returns {self.equation_size} values for the {len(names)} states {', '.join(names)}")

    def discretized(
        self, free: Sequence[str], parameters: Mapping[str, float], scales: Scales | None = None, mesh: Places = (),
        degree: int = 0,
    ) -> MapSystem:  # fmt: skip
        return MapSystem(self, free, parameters, scales)

    def _check_angles(self) -> None:
        if self.angles and self.equation_size == len(self.state_names):
            check_periodic("map", self.batch("map"), self.angles, self.parameters, lifts=True)

    def _signatures(self) -> Mapping[str, Arguments]:
        return {"map": self._signature.arguments, "functionals": self._signature.arguments}

    def _compiled(self, name: str) -> Batch:
        return super()._compiled("residual" if name == "map" else name)
