"""Curves of special points in two parameters, and those that leave from points of codimension two.

Homoclinic orbits beside a Bogdanov-Takens point: a first guess from the normal form.

On the centre manifold u = u0 + w q0 + z q1 + ... with the normal form (Kuznetsov, Elements of Applied Bifurcation Theory, 8.4)

    w' = z,    z' = b1 + b2 z + a w^2 + b w z.

With a size e, b1 = -4 e^4 / a, b2 = (10 / 7) (b / a) e^2 and s = e t its homoclinic orbit is, up to terms smaller by e,

    w = (e^2 / a) (2 - 6 / cosh(s)^2),    z = (12 e^3 / a) sinh(s) / cosh(s)^3.

A is the Jacobian at u0, A q0 = 0, A q1 = q0, and p1, p0 the same for its transpose. The equations for the rest, u0 + h1 b1 +
h2 b2 and the parameters k1 b1 + k2 b2 + k b2^2 / 2, are those of Al-Hdaibat, Govaerts, Kuznetsov and Meijer (2016): both
sides of u' = F(u, p) are expanded in w, z, b1 and b2; p1 times the terms with w b_i, p0 times them and p1 times those with
z b_i determine h_i and k_i, and p1 times those with b2^2 determines k.

Curves of folds and of Hopf points pass points of codimension two of equilibria: they begin right there. Curves of cycles
(folds at generalized Hopf points, torus bifurcations at zero-Hopf and double Hopf points) begin where the cycles have no size
and their equations are singular, and homoclinic orbits at Bogdanov-Takens points likewise. Their first point lies a little
beside: a first guess is corrected with its size held, and the curve goes on from there to larger ones.

A cycle of amplitude r beside a Hopf point is u = u0 + r Re(q exp(2 pi i t)), with parameters that differ by O(r^2). The cosine
of the angle of its multipliers, of which the defining system needs a first value, is taken from this guess as it is. At a
zero-Hopf point the angle is O(r), and it may be imaginary: then no torus bifurcations begin there.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from functools import partial
from typing import Annotated, Any, Unpack

import numpy as np

from contin import errors as checks
from contin.arrays import Array, ComplexArray
from contin.collocation.mesh import CYCLE_DEGREE
from contin.connections.equations import ConnectionCollocation
from contin.connections.statement import ConnectionProblem
from contin.continuation.progress import Progress, follow_until_interrupted
from contin.continuation.run import Continuation
from contin.core.labels import Label
from contin.core.newton import correct
from contin.core.protocol import Discretization
from contin.core.settings import Options, Settings, settings_with
from contin.core.system import System
from contin.core.trial import Event, Trial, linearization
from contin.cycles.curves import TorusCurve
from contin.defining.critical import HopfCurve
from contin.defining.special_points import BranchPointCurve, EventCurve, ExtremumCurve, FoldCurve
from contin.defining.system import Defining
from contin.equilibria.equations import HOMOCLINIC, Algebraic, critical_pair
from contin.errors import ConvergenceError, ProblemError, Within
from contin.levels import APART, ROUGH
from contin.problems.statement import TIME
from contin.results.branch import Branch
from contin.results.point import Point
from contin.search.trace import either_way, small_cycle

#: Intervals of the first mesh; it is adapted in any case.
INTERVALS = 60
#: Half of the time, in units of 1 / size: cut off there, the orbit ends at a distance of 2e-5 of its size from the saddle.
_HALF = 7.0


class Takens:
    """The normal form of a Bogdanov-Takens point in two parameters, in the user's units; ProblemError if degenerate."""

    def __init__(self, base: Algebraic, x: Array) -> None:
        self.base, self.x, self.n = base, x, base.state_size
        self.matrix = base.jacobian(x)
        self._vectors()
        self._coefficients()
        self._unfolding()

    def _vectors(self) -> None:
        """Find q0, q1, p0 and p1, with p0.q0 = p1.q1 = 1 and p0.q1 = p1.q0 = 0."""
        left, _, right = np.linalg.svd(self.matrix)
        q0, p1 = right[-1], left[:, -1]
        self._bordered = np.block([[self.matrix, p1[:, None]], [q0[None], np.zeros((1, 1))]])
        q1 = self._solved(q0)
        p0 = np.linalg.solve(self._bordered.T, np.append(p1, 0.0))[:-1]
        p0, p1 = p0 / (p1 @ q1), p1 / (p1 @ q1)
        self.q, self.p = (q0, q1), (p0 - (p0 @ q1) * p1, p1)

    def _solved(self, right_side: Array) -> Array:
        """Return the v with A v = r and q0.v = 0."""
        return np.linalg.solve(self._bordered, np.append(right_side, 0.0))[:-1]

    def _along(self, v: Array, w: Array) -> Array:
        """Return B(v, w), of directions of the states."""
        return self.base.along(self.x, [np.append(direction, np.zeros(2)) for direction in (v, w)])

    def _coefficients(self) -> None:
        """Find a, b, and the terms of second order of the centre manifold, of w^2, w z and z^2."""
        (q0, q1), (p0, p1) = self.q, self.p
        of_ww, of_wz, of_zz = self._along(q0, q0), self._along(q0, q1), self._along(q1, q1)
        self.a, self.b = float(p1 @ of_ww) / 2, float(p0 @ of_ww + p1 @ of_wz)
        if not self.a or not self.b:
            raise ProblemError("kind: no homoclinic orbits are known to leave from a degenerate Bogdanov-Takens point")
        ww = self._solved(2 * self.a * q1 - of_ww)
        wz = self._solved(self.b * q1 + ww - of_wz)
        self.second = ww, wz, self._solved(2 * wz - of_zz)

    def _unfolding(self) -> None:
        """Find the columns h_i and k_i, and k."""
        (p0, p1), n, base, x = self.p, self.n, self.base, self.x
        q0, q1 = (np.asarray(np.append(q, np.zeros(2)), dtype=float) for q in self.q)
        matrix = np.zeros((n + 2, n + 2))  # A and the columns of both parameters; p1.B(q0, .), and of w z
        matrix[:n] = np.column_stack([self.matrix, base.parameter_columns(x, base.free)])
        matrix[n] = base.bent(x, p1, q0)
        matrix[n + 1] = base.bent(x, p0, q0) + base.bent(x, p1, q1)
        _, wz, zz = self.second
        right_side = np.zeros((n + 2, 2))
        right_side[:, 0] = np.concatenate([self.q[1], [p1 @ wz, p0 @ wz + p1 @ zz]])
        right_side[-1, 1] = 1.0
        self.linear = np.linalg.solve(matrix, right_side)
        second = np.asarray(self.linear[:, 1], dtype=float)
        square = float(p1 @ base.along(x, [second, second]))
        normal = p1 @ matrix[:n, n:]
        self.bent = -square * normal / (normal @ normal)

    @property
    def rate(self) -> float:
        """A size at which what the first guess leaves out is no longer small: of a / b, and of the other eigenvalues."""
        return min(abs(self.a / self.b), float(np.linalg.norm(self.matrix, 2)))

    def orbit(self, size: float) -> tuple[Array, Array, Array]:
        """Return times from 0 to 1, the states of the homoclinic orbit there (K, n), and the two parameters."""
        s = np.linspace(-_HALF, _HALF, INTERVALS * CYCLE_DEGREE + 1)
        w = size**2 / self.a * (2 - 6 / np.cosh(s) ** 2)
        z = 12 * size**3 / self.a * np.sinh(s) / np.cosh(s) ** 3
        states = self._states(size, w, z)
        by_second = 10 / 7 * self.b / self.a * size**2
        return (s + _HALF) / (2 * _HALF), states, self._at(size)[self.n :] + self.bent * by_second**2 / 2

    def _at(self, size: float) -> Array:
        """Return the point w = z = 0 of the centre manifold: states and parameters."""
        unfolded = np.array([-4 * size**4, 10 / 7 * self.b * size**2]) / self.a
        return self.x + self.linear @ unfolded

    def _states(self, size: float, w: Array, z: Array) -> Array:
        """Return states on the centre manifold, shape (K, n)."""
        terms = zip((w, z, w * w / 2, w * z, z * z / 2), (*self.q, *self.second))
        return self._at(size)[: self.n] + sum(np.outer(factor, vector) for factor, vector in terms)

    def guess(self, size: float) -> tuple[ConnectionCollocation, Array, float]:
        """Return the system of homoclinic orbits, that of this size as unknowns, and its distance from the point."""
        times, states, values = self.orbit(size)
        names, free = self.base.problem.state_names, self.base.free
        known = dict(zip(self.base.problem.parameters, map(float, self.base.all_parameters(self.x))))
        eigenvalues = np.linalg.eigvals(self.matrix)
        hyperbolic = eigenvalues[np.argsort(np.abs(eigenvalues))[2:]]
        problem = ConnectionProblem(
            self.base.problem.residual, names, known, unstable=1 + int(np.count_nonzero(hyperbolic.real > 0))
        )
        saddle = self._states(size, np.array([2 * size**2 / self.a]), np.zeros(1))[0]
        parameters = {**known, **dict(zip(free, values)), TIME: 2 * _HALF / size, **dict(zip(problem.multipliers, saddle))}
        system = ConnectionCollocation(problem, times[::CYCLE_DEGREE], CYCLE_DEGREE, (*free, *problem.multipliers), parameters)
        evenly = np.stack([np.interp(system.nodes, times, column) for column in states.T], axis=1)
        x = system.pack(evenly, parameters)
        rest = {**parameters, **known, **dict(zip(problem.multipliers, self.x[: self.n]))}
        far = x - system.pack(np.tile(self.x[: self.n], (len(evenly), 1)), rest)
        return system.with_reference(x), x, float(np.sqrt(system.weights @ far**2))


#: Amplitudes of first cycles, relative to 1 + the largest state, in the order in which they are tried.
_AMPLITUDES = (1e-2, 1e-3, 1e-1)
#: Sizes of first homoclinic orbits as parts of `Takens.rate`, in the order in which they are tried.
_SIZES = (0.1, 0.2, 0.05, 0.4)
#: Part of the size of a first guess by which it may be corrected: what it leaves out is of second order.
_OFF = 0.5

#: A system, a first point, and the tangent there; without a tangent the curve passes the point, and goes both ways.
First = tuple[Discretization, Array, Array | None]


def leaving(start: Point, kind: str, branch: int) -> First:
    """Return where a curve begins at a point of codimension two; raise ProblemError for no such curve, or ConvergenceError."""
    if kind not in start.curves:
        known = f"labelled {start.label!r}: {', '.join(start.curves) or 'none'}"
        raise ProblemError(f"kind: {kind!r} must be one of the curves that leave from the start, {known}")
    curve: Any = start.system
    base, x = curve.base.without_scales(start.x[: curve.base.size])  # the equilibrium, in the user's units
    frequencies = _frequencies(start, base, x)
    if kind == HOMOCLINIC:
        return _homoclinic(base, x)
    if kind == Label.HOPF:
        return _hopf_points(base, x, frequencies[-1] if frequencies else 0.0)
    if start.label == Label.GENERALIZED_HOPF:
        return _corrected_cycle(base, x, frequencies[0], None)
    if kind != Label.TORUS:
        return FoldCurve(base), x, None
    if not 0 <= branch < len(frequencies):
        raise ProblemError(f"branch: {branch} must lie between 0 and {len(frequencies) - 1}")
    return _corrected_cycle(base, x, frequencies[branch], frequencies[1 - branch] if len(frequencies) > 1 else 0.0)


def _frequencies(start: Point, base: Algebraic, x: Array) -> list[float]:
    """Return the frequencies of the critical pairs: that of the curve first; none at a Bogdanov-Takens point."""
    if start.label == Label.BOGDANOV_TAKENS:
        return []
    values = base.eigenvalues(x)
    upper = values[values.imag > 0]
    count = 2 if start.label == Label.DOUBLE_HOPF else 1
    found = sorted(float(value.imag) for value in upper[np.argsort(np.abs(upper.real))[:count]])
    own = start.functionals.get("frequency", found[0])
    return sorted(found, key=lambda frequency: abs(frequency - own))


def _hopf_points(base: Algebraic, x: Array, frequency: float) -> First:
    """Return the curve of Hopf points: from a Bogdanov-Takens point (without a frequency) it goes one way."""
    if frequency:
        return HopfCurve(base.as_field(), size=frequency**2), np.append(x, 1.0), None
    curve = HopfCurve(base.as_field(), size=float(np.linalg.norm(base.jacobian(x), 2)) ** 2)
    x = np.append(x, 0.0)
    row = np.zeros(curve.size)
    row[-1] = 1.0  # the square of the frequency grows
    return curve, x, linearization(curve, x, row).tangent


def _corrected_cycle(base: Algebraic, x: Array, frequency: float, other: float | None) -> First:
    """Return a small cycle on the curve of torus bifurcations at which another pair is critical; of folds without one."""
    pair = critical_pair(base.jacobian(x), frequency)
    for amplitude in _AMPLITUDES:
        size = amplitude * (1 + float(np.abs(base.states(x)).max()))
        cycles, y, tangent = small_cycle(base, x, pair, size)
        curve: Defining = FoldCurve(cycles)
        if other is not None:
            angle = _angle(cycles.eigenvalues(y), 2 * math.pi * other / frequency)
            curve, y, tangent = TorusCurve(cycles), np.append(y, math.cos(angle)), np.append(tangent, 0.0)
        found = _corrected(curve, y, tangent, size)
        if found is not None:
            return found
    raise ConvergenceError("no curve of cycles was found beside the point of codimension two")


def _angle(exponents: ComplexArray, expected: float) -> float:
    """Return the angle of the complex pair of multipliers that is nearest to an expected one on the unit circle."""
    pairs = exponents[(exponents.imag > 0) & (exponents.imag < math.pi)]
    if not pairs.size:
        raise ProblemError("kind: no torus bifurcations leave from this point: the multipliers of the cycles there are real")
    distances = np.abs(np.exp(1j * pairs.imag) - np.exp(1j * math.acos(math.cos(expected))))
    return float(pairs[np.argmin(distances)].imag)


def _corrected(system: Discretization, x: Array, tangent: Array, size: float) -> First | None:
    """Return a first guess corrected with its size held, and the tangent to larger ones; None where that fails."""
    row = system.weights * tangent
    try:
        found = correct(system, x, row, row @ x).x
    except ConvergenceError:
        return None
    off = system.weights @ (found - x) ** 2
    return (system, found, linearization(system, found, row).tangent) if off < (_OFF * size) ** 2 else None


def _homoclinic(base: Algebraic, x: Array) -> First:
    """Return a small homoclinic orbit at a Bogdanov-Takens point."""
    takens = Takens(base, x)
    for share in _SIZES:
        size = share * takens.rate
        system, y, distance = takens.guess(size)
        larger, smaller = (takens.guess(size * factor)[1] for factor in (1 + ROUGH, 1 - ROUGH))
        change = larger - smaller
        found = _corrected(system, y, change / float(np.sqrt(system.weights @ change**2)), distance)
        if found is not None:
            return found
    raise ConvergenceError("no homoclinic orbit was found beside the Bogdanov-Takens point")


@either_way
@checks.arguments
def curve(start: Point, second: str | None = None, settings: Settings | None = None, *, free: Sequence[str] | None = None,
          event: Event | None = None, hold: str | None = None, kind: str | None = None, progress: bool | None = None,
          branch: Annotated[int, Within(0, 1)] = 0, **options: Unpack[Options]) -> Branch:  # fmt: skip
    """Follow the curve of special points of one kind through one of them, in two parameters or more.

    From a point of such a curve, without a further parameter, it goes on; ``kind`` takes another one that leaves there.
    ``direction="both"`` is as in `trace`.

    Parameters
    ----------
    start : Point
        A labelled point of a branch: LP, BP, HB (of equilibria), PD, TR, an extremum (EX), or where a column has a value (UZ,
        EP); of homoclinic orbits IFS, OFS, NCH, ..., too. Or one of a curve, followed with one parameter more: an extremum of
        its own column, the fold of a curve of folds with respect to its first parameter, a user zero, or of codimension two.
    second : str, optional
        The parameter that is free beside those of the branch.
    settings : Settings, optional
        Or any of its fields by name. Defaults: ``primary``, of which folds are labelled, is ``second``; no ``branch_points``.
    free : pair of str, optional
        Both parameters, in place of ``second``; the first one replaces that in which the start was found.
    event : Event, optional
        The one of yours (``events``) that labelled the start.
    hold : str, optional
        A column that keeps the value of any start, such as ``"period"``; ``branch_points=True`` labels where curves cross.
    kind : str, optional
        From BT, GH, ZH, HH: ``"LP"``, ``"HB"``, ``"TR"`` or ``"homoclinic"``, as in `Point.curves`; some begin a little beside.
    branch : int
        With ``kind="TR"`` at a double Hopf point: 0 for the cycles of the pair on whose curve it was found, 1 for the other.
    progress : bool, optional
        As in `trace`.

    Returns
    -------
    Branch
        Labels: LP (the curve turns); CP, BP, BT, GH, ZH and HH of equilibria; CP, GPD, CH, R1 to R4, LPPD and LPTR of cycles;
        EX, an extremum in one parameter more. Columns: ``frequency`` and ``lyapunov`` of Hopf points, ``normal_form`` of period
        doublings and torus bifurcations, ``angle`` of the latter. The last entry of x on curves of BP is their imperfection.

    Raises
    ------
    ProblemError
        The start is none of these, or a name is no parameter.

    Examples
    --------
    >>> from contin import AlgebraicProblem, solve, trace
    >>> cusp = AlgebraicProblem(lambda u, p: (u.x**3 - p.b * u.x + p.a,), ["x"], {"a": 2.0, "b": 1.0})
    >>> fold = trace(solve(cusp, [-1.5]), free=["a"], direction=-1, limits={"a": (-2, 3)}).labelled("LP")[0]
    >>> folds = curve(fold, "b", direction=-1, limits={"b": (-1, 2)})
    >>> [(point.label, abs(point["b"]) < 1e-9) for point in folds.labelled("CP")]
    [('CP', True)]
    """
    shown, new = Progress(progress), any(each is not None for each in (second, free, event, hold))
    goes_on = start.system.on_curve and not new
    _check(event, hold, kind, goes_on)
    names = start.system.free if goes_on else _free_parameters(start, second, free)
    settings = settings_with(settings, {"branch_points": False, "primary": names[-1], **options})
    if goes_on:
        return _from_curve(start, kind, branch, settings, shown)
    return follow_until_interrupted(Continuation(*_first_of_curve(start, names, event, hold), settings), shown)


def _check(event: Event | None, hold: str | None, kind: str | None, goes_on: bool) -> None:
    if kind is not None and not goes_on:
        raise ProblemError("kind: is for points of codimension two of a curve, without a further parameter or event")
    if hold is not None and event is not None:
        raise ProblemError("hold: must be left out where event is given")


def _from_curve(start: Point, kind: str | None, branch: int, settings: Settings, shown: Progress) -> Branch:
    """Follow the curve of a point further, or another one that leaves there. The first point has the label of the start."""
    if kind is None:
        return follow_until_interrupted(Continuation(start.system, start.x, settings), shown)
    system, x, tangent = leaving(start, kind, branch)
    beside = tangent is not None and kind != Label.HOPF
    found = follow_until_interrupted(Continuation(system, x, settings, tangent, singular=False), shown)
    if not beside:
        found.points[0] = dataclasses.replace(found.points[0], label=start.label, name=start.name)
    return found


def _free_parameters(start: Point, second: str | None, free: Sequence[str] | None) -> tuple[str, ...]:
    """Return the free parameters of a curve: that in which the start was found first, the second parameter last."""
    system: Any = start.system
    if len(system.free) != system.problem.free_size:
        raise ProblemError("start: must be a point of a branch, with the free parameters of a curve")
    known = tuple(system.problem.parameters)
    branch = not system.on_curve
    found_in = start.column if start.label == Label.FOLD and start.column and branch else system.free[0]
    if (second is None) == (free is None):
        raise ProblemError("curve: give the second parameter, or free=[first, second]")
    if free is None:
        assert second is not None
        if second in system.free or second not in known:
            raise ProblemError(f"second: {second!r} must be a parameter that is not free ({', '.join(known)})")
        pair: tuple[str, ...] = (found_in, second)
    else:
        pair = tuple(checks.names("free", free))
    others = [name for name in system.free if name != found_in]
    allowed = [name for name in known if name not in others] if branch else list(known)
    if len(pair) != 2 or len({*pair} & {*allowed}) != 2:
        raise ProblemError(f"free: {', '.join(pair)} must be two of the parameters {', '.join(allowed)}")
    return (pair[0], *others, pair[1])


#: A defining system, and its first vector of unknowns.
_First = tuple[Defining, Array]


def _first_of_curve(start: Point, names: Sequence[str], event: Event | None, hold: str | None) -> _First:
    """Return the defining system of the kind of a point; raise ProblemError if none can be followed."""
    system: Any = start.system
    base, x = system.with_free(names, start.x)
    base, x = base.crossed(x, corners=True)
    if event is not None:
        return _event(start, base, x, event)
    if hold is not None:
        known = (*start.parameters, *start.functionals, *system.named_states)
        if hold not in known:
            raise ProblemError(f"hold: {checks.shown(hold)} is no column; there are {checks.listed(known)}")
        return _value(dataclasses.replace(start, column=hold, value=start[hold]), base, x)
    found = (_on_curve if start.system.on_curve else _on_branch)(start, base, x)
    if found is None and _is_at_a_value(start):
        found = _value(start, base, x)
    if found is None:
        raise ProblemError(f"start: a point labelled {start.label or 'nothing'!r} must be {_STARTS}")
    return found


def _on_branch(start: Point, base: System, x: Array) -> _First | None:
    """Return the defining system of special points of a branch, and its first x."""
    if start.is_simple_branch_point:
        return BranchPointCurve(base), np.append(x, 0.0)
    if start.label == Label.FOLD and start.column:
        return FoldCurve(base), x
    if start.label == Label.EXTREMUM and start.column:
        return ExtremumCurve(base, start.column), x
    return base.defining(start, x)


def _on_curve(start: Point, base: Any, x: Array) -> _First | None:
    """Return that of special points of a curve: extrema of its own column, and points of codimension two.

    A fold with respect to the parameter of a curve of folds is an extremum, too.
    """
    objective = base.stationary
    if objective and start.label in (Label.EXTREMUM, Label.FOLD) and start.column == objective:
        return ExtremumCurve(base.base, objective), x[: base.base.size]
    if _is_at_a_value(start):
        return None
    tests = (test for test in start.system.events() if (test.label, test.name) == (start.label, start.name))
    return next(((EventCurve(base, test), x) for test in tests), None)


def _is_at_a_value(start: Point) -> bool:
    """Return whether a column has the value that the point was located for."""
    return start.value is not None and abs(start[start.column] - start.value) <= APART * (1 + abs(start.value))


def _value(start: Point, base: System, x: Array) -> _First:
    column, value = start.column, start.value
    assert value is not None
    known = base.column_gradient(x, column) is not None
    event = Event(start.label, column, partial(_off, column, value))
    return EventCurve(base, event, partial(_slope, column) if known else None), x


def _off(column: str, value: float, trial: Trial) -> float:
    """Return by how much a column is off a value."""
    return trial[column] - value


def _slope(column: str, system: System, x: Array) -> Array:
    found = system.column_gradient(x, column)
    assert found is not None
    return found


def _event(start: Point, base: System, x: Array, event: Event) -> _First:
    """Return a zero of a user's test function; raise ProblemError where it is none."""
    found = EventCurve(base, event)
    here, slope = found.value(x), found.own_gradients(x)[0]
    if not abs(here) <= APART * (1 + float(np.abs(slope) @ (1 + np.abs(x)))):
        raise ProblemError(f"event: {event.name!r} is {here:.6g} at the start; it must be the function that labelled it")
    if not found.is_confirmed(x):
        raise ProblemError(f"event: confirm of {event.name!r} returns False at the start; it must be the one that labelled it")
    return found, x


#: What a start may be, in words.
_STARTS = (
    "one of LP, BP, HB (of equilibria), PD, TR, EX, a special point of homoclinic orbits, or one where a column has a value "
    "(UZ, EP); "
    "for one of your own events, give it as event"
)
