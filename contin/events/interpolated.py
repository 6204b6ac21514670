"""A zero of test functions at a point where the equations are singular: interpolated from points of the curve around it.

A curve of folds that comes to a pitchfork goes on smoothly (as its mirror image), but its equations are singular there, and
Newton's method leaves an error of the square root of round-off or worse. Points beside it are as exact as any others. The curve
is a smooth function of the distance along a tangent, so a polynomial through points on both sides of the zero gives it:

1. Take points at Chebyshev nodes around the place where a straight line through the ends of the step has its zero.
2. Find the zero of the polynomial through the values of the test function, near the middle.
3. Evaluate the polynomial through the points there.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.polynomial import chebyshev

from contin.arrays import Array
from contin.collocation.mesh import interpolation
from contin.core.newton import Newton, rounded_off
from contin.core.protocol import Carrier, Discretization, inner
from contin.core.step import Reason, State, Stop, located, standing_at
from contin.core.trial import Event, Linearization, Trial
from contin.errors import ConvergenceError
from contin.events.arc import Arc, SpecialPoint, find_zero
from contin.events.labelled import Finding
from contin.levels import BESIDE, ROUGH

#: Numbers of nodes, even: none is right at the zero. The second number is for the error estimate: that of the coefficients of a
#: polynomial through the first, and that of the nodes on another mesh.
_NODES = 12, 10
#: Half the width of the interval of the nodes as parts of the step: narrow ones suffer from nodes that are close to the zero,
#: wide ones from bends of the curve. Narrower ones are tried as long as they lower an estimated error above the tolerance.
_WIDTHS = (2.0, 1.0, 0.5, 0.25)
#: Points that an extrapolation goes through, at most, and points without one, which lie close to the beginning of the step.
_BEHIND, _FEWEST = 6, 2

#: Functions of a trial point.
Functions = Sequence[Callable[[Trial], float]]


@dataclass(frozen=True, eq=False)
class Window:
    """The places of the nodes on the tangent of a state: an interval, by its middle and half its width, and their number."""

    state: State
    middle: float
    width: float
    count: int

    @property
    def places(self) -> Array:
        """Chebyshev nodes, as distances along the tangent."""
        return np.asarray(self.middle + self.width * np.sort(chebyshev.chebpts1(self.count)), dtype=float)


@dataclass(frozen=True, eq=False)
class InterpolatedZero(Finding):
    """A common zero of test functions, between points of a curve.

    - ``trial`` (Trial): The point, with the tangent of the polynomial.
    - ``at`` (float): Distance along the state's tangent.
    - ``window`` (Window)
    - ``points`` (ndarray, shape (count, size)): x at the nodes.
    - ``functions`` (sequence of callable): The first one has its zero there.
    - ``newton_error`` (float): Largest error that Newton's method has left of a point, relative to 1 + |x|: so near to a
      singular point, zeros on two meshes may agree better.
    """

    trial: Trial
    at: float
    window: Window
    points: Array
    functions: Functions
    newton_error: float
    has_equations: ClassVar[bool] = True

    def there(self, system: Discretization, tangent: Array) -> Trial:
        """Return the point, with the tangent of the polynomial."""
        return self.trial

    def split(self, system: Discretization) -> Array:
        """Return the error that Newton's method, or round-off, has left of the points around it."""
        left, own = self.newton_error * (1 + np.abs(self.trial.x[system.state_size :])), self.trial.system
        nearest = self.points[int(np.abs(self.window.places - self.at).argmin())]
        noise = rounded_off(own, nearest, (own.weights * self.window.state.tangent,))
        return np.maximum(left, noise[system.state_size :])

    def again(self, system: Discretization, carry: Carrier, x: Array, newton: Newton) -> InterpolatedZero:
        """Return the same zero on another mesh, with another number of nodes: the change is the error of both.

        Raises ConvergenceError where there is none.
        """
        old = self.window
        state = standing_at(system, carry(old.state.x), carry(old.state.tangent), old.state.step)
        window = Window(state, self.at, old.width, _NODES[old.count == _NODES[0]])
        through = _polynomial(old, self.points, old.count)
        points = [located(state, carry(through(place)), float(place), newton) for place in window.places]
        return _interpolated(window, points, self.functions, [window.count])[0]


def interpolated_zero(arc: Arc, functions: Functions, near: float) -> InterpolatedZero | None:
    """Return the common zero of test functions inside a step; None where there is none, or no points around it are found."""
    best, least = None, np.inf
    for share in _WIDTHS:
        try:
            window = Window(arc.state, near, share * arc.step, _NODES[0])
            points = _around(arc, window)
            found, other = _interpolated(window, points, functions, _NODES)
        except ConvergenceError:
            continue
        change = float(np.abs(found.trial.x - other.trial.x).max())
        if change < least:
            best, least = found, change
        if not arc.newton.tolerance < change <= least:
            break
    return best


def meeting(arc: Arc, test: Event, functions: Functions, small: float, stops: str) -> list[SpecialPoint] | None:
    """Return the point inside a step where two functions vanish together, in a list; None where there is none.

    The first one changes its sign there; the other's first estimate there is not larger than ``small``. Where the parameters
    stand still there, the curve goes back as its mirror image: the run ends, and ``stops`` says why.
    """
    a, b = functions[0](arc.before), functions[0](arc.trial)
    if not a * b < 0:
        return None
    near = arc.low + (arc.step - arc.low) * a / (a - b)
    if abs(functions[1](arc.guessed(near))) > small:
        return None
    found = interpolated_zero(arc, functions, near)
    if found is None:
        return None
    turns_back = np.abs(found.trial.tangent[arc.state.system.state_size :]).max() < BESIDE
    stop = Stop(Reason.PITCHFORK, stops) if turns_back else None
    return [SpecialPoint(found.at, test.label, test.name, found.trial, stop, found, test)]


def _around(arc: Arc, window: Window) -> list[Trial]:
    """Return the points at the nodes, found one after the other, each from an extrapolation of those before.

    The end of the step may be so near to the zero that neither its tangent nor its factors are of use.
    """
    state, points = arc.state, list[Trial]()
    places = window.places
    for number, place in enumerate(places):
        known = slice(max(0, number - _BEHIND), number)  # those right behind
        if number < _FEWEST:
            guess = state.x + place * state.tangent
        else:
            weights = 1 / np.prod(places[known, None] - places[known] + np.eye(len(places[known])), axis=1)
            along = interpolation(places[known], weights, np.array([place]))[0]
            guess = along @ np.array([point.x for point in points[known]])
        points.append(located(state, guess, float(place), arc.newton))
    return points


def _interpolated(
    window: Window, points: Sequence[Trial], functions: Functions, counts: Sequence[int]
) -> list[InterpolatedZero]:
    """Return the zeros from the points at the nodes, by polynomials of so many coefficients.

    Raises ConvergenceError where the functions have no common zero in the middle half of the window.
    """
    values = np.array([[function(point) for function in functions] for point in points])
    return [_zero(window, points, functions, values, count) for count in counts]


def _zero(window: Window, points: Sequence[Trial], functions: Functions, values: Array, count: int) -> InterpolatedZero:
    """Return the zero by polynomials of so many coefficients, from the values of the functions (nodes, functions)."""
    test = _polynomial(window, values, count)
    left, right = (
        (place, float(test(place)[0])) for place in (window.middle - window.width / 2, window.middle + window.width / 2)
    )
    if not left[1] * right[1] < 0:
        raise ConvergenceError("no zero in the middle half of the window")
    at = find_zero(lambda place: float(test(place)[0]), left, right, np.finfo(float).eps * window.width)
    if np.any(np.abs(test(at)) > ROUGH * np.abs(values).max(axis=0)):
        raise ConvergenceError("the test functions have no common zero")
    unknowns = np.array([point.x for point in points])
    through = _polynomial(window, unknowns, count)
    along, system = through(at, 1), window.state.system
    tangent = np.asarray(along, dtype=float) / float(np.sqrt(inner(system, along, along)))
    trial = Trial(system, through(at), Linearization(tangent, np.nan))
    return InterpolatedZero(trial, at, window, unknowns, functions, max(point.newton_error for point in points))


def _polynomial(window: Window, rows: Array, count: int) -> Callable[..., Array]:
    """Return the polynomial of so many coefficients that is nearest to rows (nodes, m) at the nodes.

    It is a function of the place, and of the order of a derivative.
    """
    scaled = (window.places - window.middle) / window.width
    first = rows.mean(axis=0)  # what is common to all would bring its round-off
    weights = chebyshev.chebfit(scaled, rows - first, count - 1)

    def value(place: float, order: int = 0) -> Array:
        derived = chebyshev.chebder(weights, order)
        found: Array = np.asarray(chebyshev.chebval((place - window.middle) / window.width, derived))
        return found + first if order == 0 else found

    return value
