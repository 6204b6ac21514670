"""Curves of folds, branch points, extreme values and other special points in two parameters, by their defining systems.

Folds: with z all unknowns but the two parameters, the matrix

                                   z     g
                                [ F_z    b ]  [ v ]   [ 0 ]
                                [  c     0 ]  [ g ] = [ 1 ]

is regular along the curve, and g = 0 exactly where F_z is singular (`contin.linalg.border`). The gradient of g is -w.F_zy v,
with w from the transposed matrix.

The defining system of a curve of branch points in two parameters: F + beta psi = 0 and g = 0, with beta unknown.

                                     x     mu    beta
                                  [ F_x   F_mu   psi ]
                                  [    dg_1       0  ]     dg_i = -w.F_xy v_i
                                  [    dg_2       0  ]

The two numbers g are those of `contin.events.branch_point`. It is the curve of points where two branches cross on the unfolded
problem; beta stays zero where the bifurcation is perfect (a symmetry, a trivial branch).

The defining system of a curve of extrema: successive continuation, as in AUTO's demos ``opt``, ``ops`` and ``obv``.

An extremum of a column G along a branch in one parameter is followed in two, an extremum along that curve in three, and so on.
With j parameters beyond those that fix a solution, and one parameter more, which is held, the solutions of F = 0 are a manifold
of dimension j. The system is F = 0, g = 0 with the j derivatives g of G on it (`contin.events.usual`).

The defining system of a curve along which a function of the solution keeps the value zero: F = 0 and e = 0.

The function may be a column less a value, or any test function: of a user, or of a curve in two parameters. Where its gradient
is not known, it is taken on the solutions of F = 0 only. With k rows Phi that make the matrix regular, k the unknowns of F = 0
beyond its equations,

                              [ F_x ]                        [ F ]
                          M = [     ],    M V = [0; I],   M y = [   ],
                              [ Phi ]                        [ 0 ]

e is evaluated at x - y, which is on F = 0 up to the square of F. Its gradient there is the sum of the derivatives along the
columns of V, each times its row of Phi: k derivatives by differences, for any number of unknowns.
"""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple, cast

import numpy as np

from contin.arrays import Array
from contin.core.differences import derivative
from contin.core.labels import Label
from contin.core.system import System
from contin.core.trial import Event, Trial
from contin.defining.system import Defining, Known
from contin.draws import generator
from contin.events.arc import Arc, SpecialPoint
from contin.events.branch_point import BorderedMatrix, borders_at
from contin.events.interpolated import meeting
from contin.events.usual import Stationarity, curvatures
from contin.levels import ROUGH
from contin.linalg.border import Bordered, null_vectors, orthonormal, rows_fit

#: w.F_mu is interpolated to the zero of w.F_lambda only where its first estimate there is below this part of its values at the
#: ends of the step; the location decides. Ten times smaller, long steps miss the zero.
_SMALL = 0.3


class FoldCurve(Defining):
    """F = 0 and F_z singular, in the free parameters of ``base``: the last one is the second parameter of the curve.

    - ``base`` (System): With one free parameter more than a curve of solutions needs: the first is the one of the folds.
    """

    kind = Label.FOLD

    @functools.cached_property
    def _held(self) -> list[int]:
        """Places of both parameters, the second one last, and of those that fix the solution besides."""
        return [self.base.state_size, *range(self.base.equations + 1, self.base.size)]

    def computed(self, x: Array) -> tuple[Bordered, Array, Array]:
        """Return the bordered matrix, with the parameters held where they are, the residual of F, and the row c."""
        base, places = self.base, self._held
        rows = np.zeros((len(places) + 1, base.size + 1))
        rows[np.arange(len(places)), places] = 1.0
        shape, residual = (base.equations, base.size), np.empty(0)

        def bordered(b: Array, c: Array) -> Bordered:
            nonlocal residual
            rows[-1, :-1] = c
            residual, factors = base.linearize(x, rows, b[None])
            return Bordered(factors, shape, held=len(places))

        found, self.borders = null_vectors(bordered, shape, self.borders, base.weights)
        return found, residual, self.borders[1]

    def known(self, x: Array) -> Known:
        """Return the bordered matrix."""
        found, residual, _ = self.at(x)
        return Known(residual, found.factors, found.solutions)

    def null_vectors(self, x: Array) -> tuple[Array, Array]:
        """Return v (size,) and w (equations of F,)."""
        found: Bordered = self.at(x)[0]
        return found.right[0], found.left[0]

    def by_parameters(self, x: Array) -> tuple[float, float]:
        """Return the products of w with the derivatives of F by the parameter of the folds and by the second parameter.

        The rows of the parameters that are held, and c, take up what w F_x leaves there. Its sign does not hang on b: w turns.
        """
        found, _, row = self.at(x)
        *held, rest = found.transposed[0, self.base.equations :]
        products = -self._sign(x) * (np.array(held) + rest * row[self._held])
        return float(products[0]), float(products[-1])

    def own_values(self, x: Array) -> Array:
        """Return g, with the sign of the determinant of F_z.

        An iterate of Newton's method far away may leave borders with which the determinant of the bordered matrix has the other
        sign here: that of g itself depends on them.
        """
        return self._sign(x) * self.at(x)[0].g[0]

    def own_gradients(self, x: Array) -> Array:
        """Return its derivatives by x."""
        v, w = self.null_vectors(x)
        return -self._sign(x) * self.base.bent(x, w, v)[None]

    def _sign(self, x: Array) -> float:
        """Return the sign of the determinant of the bordered matrix; 1 where its factors do not say it."""
        return math.copysign(1.0, self.at(x)[0].factors.sign)

    @property
    def stationary(self) -> str:
        """The parameter of the folds."""
        return "" if self.base.on_curve else self.free[0]

    def events(self) -> list[Event]:
        """Return those of cusps (w.F_zz v v = 0), of folds that meet a branch point (w.F_lambda = 0), and of the kind."""
        return [_CUSP, _MEETS, *super().events(), *self.base.events_on_folds()]


def _bend(trial: Trial) -> float:
    """Return w.F_zz v v."""
    curve = cast(FoldCurve, trial.system)
    return -float(curve.once(curve.own_gradients, trial.x)[0] @ curve.null_vectors(trial.x)[0])


def _stands_still(trial: Trial) -> bool:
    """Return whether the parameters stand still, as they do at a cusp, where the tangent is known.

    w.F_zz v v vanishes, too, where solutions have v as a symmetry, as the phase of a forced cycle whose forcing vanishes: there
    the parameters go on.
    """
    return not np.abs(trial.tangent[[trial.system.state_size, -1]]).max() >= ROUGH


def _by_first(trial: Trial) -> float:
    """Return w.F_lambda of the parameter of the folds."""
    return cast(FoldCurve, trial.system).by_parameters(trial.x)[0]


def _by_last(trial: Trial) -> float:
    """Return w.F_mu of the second parameter."""
    return cast(FoldCurve, trial.system).by_parameters(trial.x)[1]


@functools.lru_cache(maxsize=1)
def _singular_point(arc: Arc) -> list[SpecialPoint] | None:
    """Return the point inside a step where both w.F_lambda and w.F_mu vanish, in a list; None where there is none.

    The defining system is singular there. At a pitchfork the curve turns back as its mirror image, so that the run ends; at a
    transcritical bifurcation it goes on.
    """
    largest = max(abs(_by_last(trial)) for trial in (arc.before, arc.trial))
    stop = "the folds end on a pitchfork: beyond it the curve is its own mirror image"
    return meeting(arc, _MEETS, (_by_first, _by_last), _SMALL * largest, stop)


#: w.F_zz v v = 0.
_CUSP: Event = Event(
    Label.CUSP, "cusp", _bend, confirm=_stands_still, search=lambda arc, _: None if _singular_point(arc) is None else [],
    asks=lambda arc: arc.passes(_CUSP),
)  # fmt: skip
#: Where the fold meets a branch point: w.F_lambda = 0.
_MEETS: Event = Event(
    Label.BRANCH_POINT, "fold meets a branch point", _by_first, search=lambda arc, _: _singular_point(arc),
    asks=lambda arc: arc.passes(_MEETS),
)  # fmt: skip


class BranchPointCurve(Defining):
    """F + beta psi = 0 with both g zero; unknowns [those of ``base`` | beta].

    - ``base`` (System): With one free parameter more than a curve of solutions needs: the last one is the second parameter.
    """

    kind = Label.BRANCH_POINT
    own_equations, own_unknowns = 2, 1

    def computed(self, x: Array) -> BorderedMatrix:
        """Return the bordered matrix, with the second parameter held."""
        system, inside = self.base.with_free(self.base.free[:-1], self.inside(x))
        if self.borders is None:
            self.borders = borders_at(system, inside)
        return BorderedMatrix(system, inside, *self.borders)

    def borders_fit(self, x: Array) -> bool:
        """Return whether the kernel and its multipliers have not turned away from the borders."""
        return self.at(x).fits

    def own_values(self, x: Array) -> Array:
        """Return g."""
        return self.at(x).g

    def own_gradients(self, x: Array) -> Array:
        """Return dg/dx; the second parameter does not move along the kernel."""
        found: BorderedMatrix = self.at(x)
        y, w = self.inside(x), found.multipliers()
        return np.array([np.append(-self.base.bent(y, w, np.append(v, 0.0)), 0.0) for v in found.kernel])

    def own_vectors(self, x: Array) -> Array:
        """Return psi."""
        return self.at(x).borders[1][None]


class ExtremumCurve(Defining):
    """F = 0 and g = 0; the last free parameter of ``base`` is the one that is held in the extrema.

    - ``base`` (System)
    - ``objective`` (str): The column G.
    """

    def __init__(self, base: System, objective: str) -> None:
        self.objective, self.own_equations = objective, base.size - base.equations - 1
        super().__init__(base)

    def on(self, base: System) -> ExtremumCurve:
        return ExtremumCurve(base, self.objective)

    def computed(self, x: Array) -> Stationarity:
        """Return the derivatives of G."""
        held = [self.base.size - 1]
        if self.borders is None:
            self.borders = Stationarity(self.base, x, self.objective, held).orthonormal() * self.base.weights
        return Stationarity(self.base, x, self.objective, held, self.borders)

    def known(self, x: Array) -> Known:
        """Return the matrix M."""
        found: Stationarity = self.at(x)
        return Known(found.residual, found.factors, found.solutions)

    def borders_fit(self, x: Array) -> bool:
        """Return whether the tangents have not turned away from the rows Phi."""
        return self.at(x).fits

    def own_values(self, x: Array) -> Array:
        """Return g."""
        return self.at(x).g

    def own_gradients(self, x: Array) -> Array:
        """Return dg/dx."""
        return self.at(x).gradients()

    def events(self) -> list[Event]:
        """Return those of extrema in one parameter more: the derivative by the held parameter vanishes, too.

        That along the curve vanishes where the curve turns, as well.
        """

        def slope(trial: Trial) -> float:
            return float(cast(ExtremumCurve, trial.system).at(trial.x).by_held[0])

        name = self.objective
        return [
            Event(Label.EXTREMUM, name, slope, describe=lambda trial: curvatures(trial, name), column=name), *super().events()
        ]  # fmt: skip


class _Solutions(NamedTuple):
    """x - y, V as rows (k, size), Phi, and what they come from."""

    x: Array
    tangents: Array
    rows: Array
    known: Known


class EventCurve(Defining):
    """F = 0 and e = 0, in the free parameters of ``base``.

    - ``base`` (System or Defining): With one free parameter more than its curves need.
    - ``event`` (Event): Whose function keeps the value zero. Where its ``confirm`` says that a zero is none, the curve ends.
    - ``gradient`` (callable, optional): ``gradient(system, x)`` returns the derivatives by x, shape (size,).
    """

    def __init__(self, base: Any, event: Event, gradient: Callable[[Any, Array], Array] | None = None) -> None:
        super().__init__(base)
        self.event, self._gradient = event, gradient

    def on(self, base: System) -> EventCurve:
        return EventCurve(base, self.event, self._gradient)

    def computed(self, x: Array) -> _Solutions:
        """Return the solutions of F = 0 around x; rows Phi are those that are kept, as long as they fit."""
        rows = generator("event curve").standard_normal((self.size - self.base.equations, self.size))
        found = self._solved(x, rows if self.borders is None else self.borders)
        if self.borders is None or not rows_fit(found.tangents, self.weights):
            self.borders = orthonormal(found.tangents, self.weights) * self.weights
            found = self._solved(x, self.borders)
        return found

    def _solved(self, x: Array, rows: Array) -> _Solutions:
        residual, factors = self.base.linearize(x, rows)
        right_sides = np.eye(len(rows) + 1, self.size, self.size - len(rows) - 1)
        right_sides[0] = np.append(residual, np.zeros(len(rows)))
        solutions = factors.solve(right_sides)
        return _Solutions(x - solutions[0], solutions[1:], rows, Known(residual, factors, solutions[1:]))

    def known(self, x: Array) -> Known | None:
        """Return the matrix M, where the gradient is taken on the solutions."""
        return self.at(x).known if self._gradient is None else None

    def value(self, x: Array) -> float:
        """Return e at x."""
        return float(self.event.function(Trial.without_tangent(self.base, x)))

    def is_confirmed(self, x: Array) -> bool:
        """Return whether a zero of e at x is what the event looks for."""
        return self.event.confirm is None or bool(self.event.confirm(Trial.without_tangent(self.base, x)))

    def own_values(self, x: Array) -> Array:
        """Return e."""
        return np.array([self.value(x if self._gradient is not None else self.at(x).x)])

    def own_gradients(self, x: Array) -> Array:
        """Return the derivatives of e by x."""
        if self._gradient is not None:
            return self._gradient(self.base, x)[None]
        there, tangents, rows, _ = self.at(x)
        slopes = [derivative(lambda s: self.value(there + s * v), 1, 1 / np.abs(v).max())[0] for v in tangents]  # noqa: B023
        gradient: Array = np.array(slopes) @ rows
        return gradient[None]

    def events(self) -> list[Event]:
        """Return those of ends, and those of solutions that are special in another way, too.

        The curve ends where cycles shrink, and where zeros are not confirmed any more.
        """
        others = [test for test in self.base.events_on_curves() if test.label != self.event.label]
        inside = [
            dataclasses.replace(
                test, function=partial(_inside, test.function), confirm=test.confirm and partial(_inside, test.confirm)
            )
            for test in others
        ]
        name = f"the end of {self.event.name!r}, whose confirm returns False"
        end = Event(Label.END, name, lambda trial: 1.0 if trial.system.is_confirmed(trial.x) else -1.0, terminal=True)
        ends = [end] if self.event.confirm else []
        return [*super().events(), *ends, *inside]

    def judged(self, point: SpecialPoint) -> SpecialPoint:
        """Return a special point, by the label and name that the kind knows it by."""
        return self.base.judged_on_curve(point, _solution(point.trial))


def _inside(function: Callable[[Trial], Any], trial: Trial) -> Any:
    """Return a function of the underlying solution of a point of a curve."""
    return function(_solution(trial))


def _solution(trial: Trial) -> Trial:
    return Trial.without_tangent(trial.system.base, trial.system.inside(trial.x))
