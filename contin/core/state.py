"""The state of a run between two steps, and the reason why a run stopped."""

from __future__ import annotations

import enum
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from contin.arrays import Array
from contin.core.protocol import Discretization


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
