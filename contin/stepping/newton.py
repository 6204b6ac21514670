"""Newton's method, then chord steps, on F(x) = 0 together with linear conditions on x."""

from __future__ import annotations

import contextlib
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from contin import checks
from contin.arrays import Array
from contin.discretization.protocol import Equations
from contin.errors import ConvergenceError
from contin.functions.compiler import Vector, kernel
from contin.linalg.factors import Factors


@dataclass(frozen=True)
class Newton:
    """How to correct: stop when the estimated error of every component is below ``tolerance`` (1 + |x|).

    ``tolerance`` may be as small as round-off; iterations that stagnate there count as converged.
    """

    tolerance: float = 1e-12
    max_iterations: int = 10

    def __post_init__(self) -> None:
        checks.number("newton tolerance", self.tolerance, 0, 1)
        checks.whole("max_iterations", self.max_iterations, 1, 10_000)


@dataclass(frozen=True)
class Corrected:
    """A corrected x, the last factorization (taken at an iterate before x), and the estimated error left.

    ``along`` is what this factorization gives for the vector t with F_x t = 0 and row.t = 1; None where it is not at hand.
    """

    x: Array
    factors: Factors
    iterations: int
    error: float
    along: Array | None = None


#: After a larger update the next iteration takes the Jacobian anew.
_FAR = 0.1
#: Chord steps with an old factorization that are worth a new one.
_CHORDS = 4
#: Updates that small and no longer shrinking are round-off.
_ROUND_OFF = 1e-9
#: With factors from elsewhere the first update is below this, and each of the next below this part of the one before.
_CLOSE = 0.03
#: An update that is nothing.
_EXACT = 1e-15


def correct(
    system: Equations,
    guess: Sequence[float] | Array,
    row: Array | None = None,
    target: Any = 0.0,
    newton: Newton = Newton(),
    factors: Factors | None = None,
) -> Corrected:
    """Solve F(x) = 0 and row.x = target, starting from ``guess``.

    Parameters
    ----------
    system : Collocation or alike
        Has ``residual(x)`` and ``linearize(x, rows)``.
    guess : ndarray, shape (size,)
    row : ndarray, shape (size,), optional
        The linear condition; without it F = 0 must be square.
    factors : optional
        A factorization from near by: tried first, for as long as it converges fast.

    Raises
    ------
    ConvergenceError
        Not converged, or not finite; the message holds the last updates.
    """
    if factors is not None:
        with contextlib.suppress(ConvergenceError):
            return _chords(system, guess, row, target, newton, factors)
    rows = () if row is None else (row,)
    x, history, moved = np.array(guess, dtype=float), [], 1.0
    factors, along = None, None
    with np.errstate(all="ignore"):
        for _ in range(newton.max_iterations):
            if factors is None:
                residual, factors = system.linearize(x, rows)
                fresh = True
            else:
                residual, fresh = system.residual(x), False
            if row is None:
                update = factors.solve(residual)
            elif not fresh:
                update = factors.solve(np.append(residual, row @ x - target))
            else:  # the direction along the curve comes with it, at next to no cost
                both = np.zeros((2, residual.size + 1))
                both[0, :-1], both[0, -1], both[1, -1] = residual, row @ x - target, 1.0
                update, along = factors.solve(both)
            size = _move(x, update)
            if not np.isfinite(size):
                break
            history.append(size)
            moved = size if fresh else moved + size
            rate = _rate(history, fresh, moved)
            confirmed = len(history) > 1 or size <= newton.tolerance
            if (confirmed and size * rate <= newton.tolerance) or (size < _ROUND_OFF and len(history) > 1 and rate >= 0.5):
                return Corrected(x, factors, len(history), size * rate, along)
            if len(history) > 2 and size > 2 * history[-2] > _ROUND_OFF:
                break
            if size > _FAR or not rate < 0.5 or np.log(newton.tolerance / size) < _CHORDS * np.log(rate):
                factors = None
    raise _failure(history)


def _chords(
    system: Equations, guess: Sequence[float] | Array, row: Array | None, target: Any, newton: Newton, factors: Factors
) -> Corrected:
    """The same with factors from elsewhere only, for a guess that is close; fails where they converge slowly."""
    x = np.array(guess, dtype=float)
    history: list[float] = []
    with np.errstate(all="ignore"):
        while len(history) < _CHORDS:
            residual = system.residual(x)
            update = factors.solve(residual if row is None else np.append(residual, row @ x - target))
            history.append(_move(x, update))
            if history[-1] <= _EXACT:
                return Corrected(x, factors, len(history), history[-1])
            if not history[-1] < _CLOSE * (history[-2] if len(history) > 1 else 1.0):
                break
            if len(history) > 1:
                ratio = history[-1] / history[-2]
                if history[-1] * ratio / (1 - ratio) <= newton.tolerance:
                    return Corrected(x, factors, len(history), history[-1] * ratio / (1 - ratio))
    raise _failure(history)


@kernel(reorder=False)
def _move(x: Vector, update: Vector) -> float:
    """x -= update, in place; the largest component of the update relative to 1 + |x|, NaN if one is."""
    largest = 0.0
    for i in range(x.size):
        size = abs(update[i]) / (1 + abs(x[i]))
        if size > largest or size != size:  # noqa: PLR0124
            largest = size
        x[i] -= update[i]
    return largest


def _failure(history: list[float]) -> ConvergenceError:
    updates = ", ".join(f"{size:.1e}" for size in history) or "not finite"
    return ConvergenceError(f"Newton did not converge (updates {updates})")


def _rate(history: list[float], fresh: bool, moved: float) -> float:
    """Estimated ratio of the error after the last update to its size; ``moved``: distance from where the Jacobian was taken."""
    if len(history) < 2:  # nothing is known of how nonlinear the equations are
        return min(moved, _FAR) if fresh else 1.0
    ratio = history[-1] / history[-2]
    if fresh:  # quadratic: with a fresh Jacobian the next update is about the square of this one
        return min(1.0, max(history[-1], ratio * min(1.0, ratio)))
    return max(min(moved, 1.0), ratio / (1 - ratio)) if ratio < 0.5 else 1.0
