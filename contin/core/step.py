"""The state before a step, its corrector, points on a mesh with switches, and why a run stops.

With the tangent t of the last point x the corrector solves F(z) = 0 together with t.(z - x) = step, in the weighted inner
product. The bordered matrix [F_x; row], row.v = t.v, is regular along the curve, folds included, and gives the next tangent.

Where a condition that the solution decides switches inside an interval, the discrete equations have errors of their own that
jump from place to place. So each point of a curve is corrected again on a mesh with points there. As mesh points move with the
solution, two points of a step are on two meshes; what is searched between them sees each as carried back to the mesh of the
step.
"""

from __future__ import annotations

import dataclasses
import enum
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from contin.arrays import Array
from contin.core.newton import Corrected, Newton, correct
from contin.core.protocol import Carrier, Discretization, inner
from contin.core.small import corrected_small
from contin.core.trial import Linearization, Trial, linearization, linearization_of
from contin.errors import ConvergenceError
from contin.linalg.blocks import Factors
from contin.linalg.matrices import DenseFactors


@dataclass(frozen=True, eq=False)
class State:
    """Everything that the next step depends on; with it a run continues as if never interrupted.

    Attributes
    ----------
    system : Discretization
    x, tangent : ndarray, shape (size,)
        The last point and its unit tangent.
    previous_tangent : ndarray, shape (size,), or None
        That of the point before, on the same system.
    previous_step, step : float
        The last step and the next one to try.
    sign : float
        Sign of the determinant of [F_x; row] at x.
    arclength : float
        Distance from the first point of the branch.
    accepted : int
        Number of regular points.
    singular : bool
        x is a branch point.
    sense : float
        The sign in which the primary parameter went where that could be told last; zero where it never could.
    sensed : ndarray, or None
        The free parameters there, in the user's units.
    discretization_error : float
        Estimated error of the point that is due to the mesh; NaN where it is not known.

    Examples
    --------
    >>> from contin import AlgebraicProblem, Settings
    >>> from contin.lowlevel import Algebraic, Continuation
    >>> parabola = AlgebraicProblem(lambda u, p: (p.a - u.x**2,), ["x"], {"a": 1.0})
    >>> system, settings = Algebraic(parabola, ["a"]), Settings(direction=-1, limits={"a": (-1, 4)})
    >>> run = Continuation(system, np.array([1.0, 1.0]), settings)
    >>> for point in run:
    ...     if run.state.accepted == 3:
    ...         break
    >>> rest = Continuation(system, np.array([1.0, 1.0]), settings, state=run.state)  # goes on where the other one is
    >>> rest.state.accepted == run.state.accepted
    True
    """

    system: Discretization
    x: Array
    tangent: Array
    previous_tangent: Array | None
    previous_step: float
    step: float
    sign: float
    arclength: float
    accepted: int
    singular: bool
    sense: float = 0.0
    sensed: Array | None = None
    discretization_error: float = np.nan

    def __repr__(self) -> str:
        return f"State({self.system!r}, {self.accepted} points, arclength {self.arclength:.6g}, step {self.step:.3g})"

    @property
    def row(self) -> Array:
        """The row that borders F_x: its product with a vector is the inner product with the tangent."""
        return self.system.weights * self.tangent

    def carried(self, system: Discretization, carry: Carrier) -> State:
        """Return the state on another system, not corrected there."""
        tangent, before = carry(self.tangent), None if self.previous_tangent is None else carry(self.previous_tangent)
        return dataclasses.replace(self, system=system, x=carry(self.x), tangent=tangent, previous_tangent=before)


def standing_at(system: Discretization, x: Array, tangent: Array, step: float) -> State:
    """Return the state of a run that stands at x and has not made a step yet."""
    return State(system, x, tangent, None, 1.0, step, np.nan, 0.0, 0, False)


class Reason(enum.StrEnum):
    """Why a run ended, in short; each is a string, too. Whoever steers runs may have others.

    Examples
    --------
    >>> from contin import AlgebraicProblem, solve, trace
    >>> circle = AlgebraicProblem(lambda u, p: (u.x**2 + p.a**2 - 1,), ["x"], {"a": 0.0})
    >>> trace(solve(circle, [1.0]), free=["a"]).stop.reason == Reason.CLOSED
    True
    """

    LIMIT = "limit"
    EVENT = "event"
    CLOSED = "closed"
    MAX_POINTS = "max points"
    INFINITY = "infinity"
    NO_CONVERGENCE = "no convergence"
    STANDSTILL = "standstill"
    TRIVIAL_BRANCH = "trivial branch"
    KNOWN_BRANCH = "known branch"
    PITCHFORK = "pitchfork"
    PERIOD_DOUBLING = "period doubling"
    HOPF = "Hopf"
    INTERRUPTED = "interrupted"

    __repr__ = str.__repr__


@dataclass(frozen=True)
class Stop:
    """Why a run ended: a short ``reason``, a sentence, what could be changed, and numbers for the details of the last point.

    ``event`` is the name of what was met, if the reason is an event.

    Examples
    --------
    >>> from contin import AlgebraicProblem, solve, trace
    >>> parabola = AlgebraicProblem(lambda u, p: (p.a - u.x**2,), ["x"], {"a": 1.0})
    >>> branch = trace(solve(parabola, [1.0]), free=["a"], direction=-1, limits={"a": (-1, 4)})
    >>> branch.stop.reason, str(branch.stop)
    ('limit', 'reached a = 4')
    """

    reason: Reason | str
    message: str
    advice: str = ""
    details: Mapping[str, float] = field(default_factory=dict)
    event: str = ""

    def __str__(self) -> str:
        return f"{self.message}; {self.advice}" if self.advice else self.message


#: Smallest size of a cycle as a part of that before the step. A branch that ends at a Hopf point is this near to it at the end
#: of a step by chance only, and the step is halved then; Newton's method that falls onto an equilibrium is nearer by far.
COLLAPSED = 1e-3
#: Rates of the primary parameter above this are significant without a closer look (`contin.events.folds`). Ten times
#: larger, more steps on a mesh take twice as long.
CLEAR = 1e-6


def corrected(state: State, guess: Array, step: float, newton: Newton, reach: float = np.inf) -> Trial:
    """Return the point of the curve at ``step`` along the state's tangent, linearized right there.

    Raises ConvergenceError where it is not found within ``reach`` of the guess, or the equations are not finite there.
    """
    row, system = state.row, state.system
    small = corrected_small(system, guess, row, row @ state.x + step, newton)
    if small is not None:
        linear = Linearization(small.tangent, small.sign, DenseFactors(small.matrix))
        return Trial(system, small.x, linear, small.iterations, small.error)
    return trial_of(system, correct(system, guess, row, row @ state.x + step, newton, within=reach), row)


def trial_of(system: Discretization, done: Corrected, row: Array) -> Trial:
    """Return the trial of a corrected point, linearized right there: Newton's last factors are those of an iterate before.

    Raises ConvergenceError where the equations are not finite there.
    """
    if done.tangent is not None:
        return Trial(system, done.x, Linearization(done.tangent, done.factors.sign, done.factors), done.iterations, done.error)
    residual, factors = system.linearize(done.x, (row,))
    if not np.isfinite(residual).all():
        raise ConvergenceError("the equations are not finite at the corrected point")
    return Trial(system, done.x, linearization_of(system, factors), done.iterations, done.error)


def located(state: State, guess: Array, step: float, newton: Newton, factors: Factors | None = None) -> Trial:
    """Return the point of the curve at ``step``, linearized right there: when that is first asked for, if it takes long.

    ``factors`` from near by save Newton's method its own. Raises ConvergenceError where there is none.
    """
    row = state.row
    small = corrected_small(state.system, guess, row, row @ state.x + step, newton)
    if small is not None:
        return Trial(state.system, small.x, Linearization(small.tangent, small.sign), small.iterations, small.error)
    system = state.system
    done = correct(system, guess, row, row @ state.x + step, newton, factors)
    return Trial(system, done.x, lambda: linearization(system, done.x, row), done.iterations, done.error)


#: Times that mesh points are moved to where conditions switch, at one point. At a corner the distance left is squared each
#: time, 1e-2, 1e-4, 1e-8 of the domain, so that three do. At a jump it falls by a factor of 10 to 30: twelve reach round-off.
ROUNDS = 12


def settled(trial: Trial, along: Array, newton: Newton) -> Trial:
    """Return a point as corrected on a mesh with points where conditions switch, and carried back to its own mesh.

    The same trial is returned where there is no need, and the last one that is found where Newton's method fails. A point keeps
    its place in the direction ``along``, shape (size,): a tangent of the curve on the trial's mesh.
    """
    found = trial
    for _ in range(ROUNDS):
        moved = found.system.on_switches(found.x)
        if moved is None or moved[0].intervals != trial.system.intervals:  # more places than the mesh has points
            break
        system, carry = moved
        x, tangent = carry(found.x), trial.system.carrier(system)(along)
        row = system.weights * tangent / np.sqrt(inner(system, tangent, tangent))
        try:
            done = correct(system, x, row, row @ x, newton)
            found = trial_of(system, dataclasses.replace(done, iterations=trial.iterations, error=trial.newton_error), row)
        except ConvergenceError:
            break
    if found is trial:
        return trial
    system = trial.system
    carry = found.system.carrier(system)
    tangent = carry(found.tangent)
    tangent /= np.sqrt(inner(system, tangent, tangent))
    linear = Linearization(tangent, found.sign, found.factors)
    result = Trial(system, carry(found.x), linear, trial.iterations, trial.newton_error)
    result.settled = found
    return result
