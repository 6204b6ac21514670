"""Newton's method, then chord steps, on F(x) = 0 together with a linear condition on x.

One iteration: linearize at x where a new Jacobian is due, else take the residual only; solve for the update; apply it;
estimate the error that is left; stop when that is below the tolerance or round-off, give up when updates grow.
"""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from contin import draws
from contin import errors as checks
from contin.arrays import Array, Mask
from contin.collocation import newton as one_call
from contin.core.protocol import Equations
from contin.errors import ConvergenceError, Within
from contin.levels import CORRECTED, LOCATED, MOST_STEPS, MOST_UPDATES, ROUGH
from contin.linalg.blocks import Factors
from contin.linalg.condensation import Factorization
from contin.linalg.convergence import CHORD, CHORDS, CONVERGED, DIVERGES, FAR, FRESH, STAGNATES, judge_update, subtract
from contin.text import Shown

#: Part of an update that must change the next one by half of that part at least. Ten times larger, strongly nonlinear equations
#: count as noise; a thousand times smaller, what is left of an update above the tolerance would.
_PART = 1e-3
#: Updates below this multiple of what one unit in the last place of x makes are round-off. Ten times smaller would not suffice
#: on meshes of many intervals.
UNITS = 30
#: Nor is one larger than this on the way: stiff meshes of strips leave 1e-8. Ten times larger, a step could end elsewhere.
STAGNANT = 1e-6
#: Returns the size of each unknown at x.
Sizes = Callable[[Array], Array]


@dataclass(frozen=True)
class Newton(checks.Named):
    """How to correct: stop when the estimated error of every component is below ``tolerance`` (1 + |x|).

    ``tolerance`` may be as small as round-off; iterations that stagnate there count as converged.

    Examples
    --------
    >>> Newton(tolerance=1e-10)
    Newton(tolerance=1e-10, max_iterations=10)
    """

    tolerance: float = 1e-12
    max_iterations: Annotated[int, Within(1, 10_000)] = 10

    def __post_init__(self) -> None:
        checks.number("newton tolerance", self.tolerance, 0, 1)
        checks.fields(self)


@dataclass(frozen=True, eq=False, repr=False)
class Corrected(Shown):
    """A corrected point.

    - ``x`` (ndarray, shape (size,))
    - ``factors`` (Factors): The last factorization, taken at an iterate before x.
    - ``iterations`` (int)
    - ``error`` (float): Estimated error left, the largest component relative to 1 + |x|.
    - ``tangent`` (ndarray, shape (size,), or None): The unit tangent right at x where it was asked for; so are the factors.
    - ``singular`` (bool): F_x is singular at x, up to its error.
    """

    x: Array
    factors: Factors
    iterations: int
    error: float
    tangent: Array | None = None
    singular: bool = False


def correct(
    system: Equations, guess: Sequence[float] | Array, row: Array | None = None, target: float | Array = 0.0,
    newton: Newton = Newton(), factors: Factors | None = None, sizes: Sizes | None = None, within: float = 0.0,
) -> Corrected:  # fmt: skip
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
    sizes : callable, optional
        ``sizes(x)`` returns the size of each unknown. Where it is given, the last update is also small relative to these, or as
        small as round-off of x allows: for unknowns that are not known to be of order one.
    within : float
        The tangent right at the solution is wanted, if it costs no further call, and no solution that is farther from the
        guess. The first update tells its distance, in the weights of the system.

    Raises
    ------
    ConvergenceError
        Not converged, or not finite; the message holds the last updates.

    Examples
    --------
    >>> from contin import AlgebraicProblem
    >>> from contin.lowlevel import Algebraic
    >>> circle = AlgebraicProblem(lambda u, p: (u.x**2 + p.a**2 - 1,), ["x"], {"a": 0.6})
    >>> print(round(correct(Algebraic(circle, []), [1.0]).x[0], 12))
    0.8
    """
    work, guess = getattr(system, "workspace", None) if sizes is None else None, np.asarray(guess, dtype=float)
    if factors is not None:
        with contextlib.suppress(ConvergenceError):
            if work is not None and isinstance(factors, Factorization) and factors.unknowns == len(guess):
                done = _in_one_call(system, work, guess, row, target, newton, near=factors)
            else:
                done = _chords(system, guess, row, target, newton, factors)
            if done is not None:
                return done
    done = None if work is None else _in_one_call(system, work, guess, row, target, newton, within > 0)
    return _newton(system, guess, row, target, newton, sizes, within) if done is None else done


def linearized(system: Any, x: Array, row: Array) -> Corrected | None:
    """Return x with the factors of [F_x; row] right there and the unit tangent, by a kernel; None where it does not serve."""
    work = getattr(system, "workspace", None)
    return None if work is None else _in_one_call(system, work, x, row, 0.0, None, linearize=True)


def _in_one_call(
    system: Any, work: one_call.Workspace, guess: Array, row: Array | None, target: float | Array, newton: Newton | None,
    linearize: bool = False, near: Factorization | None = None,
) -> Corrected | None:  # fmt: skip
    """Return what a kernel comes to, by chord steps with factors from ``near`` by if these are given; the guess without newton.

    None where Python must decide whether updates are round-off. Raises ConvergenceError where they do not converge.
    """
    values = work.values
    if system.size - system.equations != (row is not None):
        return None
    own = system.fill_conditions(values)
    if row is not None:
        values.rows[own], values.targets[own] = row, target
    tolerance, most = (0.0, 0) if newton is None else (newton.tolerance, newton.max_iterations)
    x, report = guess.copy(), np.zeros(one_call.UPDATES + max(most, CHORDS))
    factors = system.unfilled_factors() if near is None else near
    tangent, control = np.empty(x.size), one_call.Control(tolerance, most, near is not None, linearize)
    done = one_call.correct_on_mesh(work, factors.room, control, x, system.weights, tangent, report)
    iterations, error = int(report[one_call.ITERATIONS]), float(report[one_call.ERROR])
    if near is None:
        factors.sign = float(report[one_call.SIGN])
    if done == one_call.CONVERGED:
        return Corrected(x, factors, iterations, error, tangent if linearize else None)
    if done == one_call.NOT_FINITE:
        raise ConvergenceError("the equations are not finite at the corrected point")
    updates = report[one_call.UPDATES : one_call.UPDATES + iterations].tolist()
    if done == one_call.STAGNATES or (near is None and updates[-1] <= STAGNANT):
        return None
    raise _failure(updates)


def _newton(
    system: Any, guess: Array, row: Array | None, target: float | Array, newton: Newton, sizes: Sizes | None, within: float
) -> Corrected:
    """Newton's method with a new Jacobian where chord steps are not expected to do.

    It stays where the last update, below the tolerance, was taken: what defining systems are made of is known there.
    """
    rows, stays = () if row is None else (row,), within > 0 and getattr(system, "on_curve", False)
    x, updates, before, moved = guess.copy(), list[float](), math.inf, 1.0
    factors: Factors | None = None
    with np.errstate(all="ignore"):
        for number in range(1, newton.max_iterations + 1):
            fresh = factors is None
            if factors is None:
                residual, factors = system.linearize(x, rows)
            else:
                residual = system.residual(x)
            update = factors.solve(residual if row is None else np.append(residual, row @ x - target))
            last, x = x, x.copy()
            size = subtract(x, update)
            said, error, moved = judge_update(size, before, moved, number, fresh, newton.tolerance)
            updates += [size] if math.isfinite(size) else []
            if said == DIVERGES:
                break
            if number == 1 and 0 < within < math.inf and system.weights @ update**2 > within**2:
                raise ConvergenceError(f"the prediction is off by more than {within:.2g} (updates {size:.1e})")
            if said == CONVERGED and fresh and size > newton.tolerance:  # as far as the updates before have said
                update = _update(system, x, factors, row, target)
                if not subtract(x.copy(), update) <= max(newton.tolerance, FAR * size):
                    _, now = system.linearize(x, rows)
                    update = _update(system, x, now, row, target)
                    said = CONVERGED if _strays(system, x, now, row, target, update).any() else FRESH
            if said == CONVERGED or (said == STAGNATES and _is_noise(system, x, update, rows, LOCATED)):
                if stays and size <= newton.tolerance:
                    return Corrected(last, factors, number, size)
                relative = 0.0 if sizes is None else _relative(update, sizes(x))
                if sizes is None or relative * max(error / (size or 1.0), min(1.0, relative)) <= newton.tolerance:
                    return Corrected(x, factors, number, error)
                return _settled(system, x, row, target, newton, sizes, updates)
            if said != CHORD:
                factors = None
            before = size
        coarse = ROUGH if sizes is not None else STAGNANT
        if size <= coarse and _is_noise(system, x, update, rows, coarse):
            return Corrected(x, system.linearize(x, rows)[1], len(updates), max(updates[-2:]))
    raise _failure(updates)


def _settled(
    system: Equations, x: Array, row: Array | None, target: float | Array, newton: Newton, sizes: Sizes, updates: list[float]
) -> Corrected:
    """Go on until the update is small relative to the size of each unknown, or round-off, or leads to zero.

    An unknown that is zero has no size: its updates vanish much faster than they become small. What is left of it is round-off
    of the iterate before. An update that is round-off is not made: where the matrix is nearly singular, it leads away. It is
    so, too, where a small part of it does not change the next one by that part: of a map, f(u) - u is known to the round-off of
    the largest state. Raises ConvergenceError where it does not become so; the message holds the last updates, relative to
    these sizes.
    """
    rows, relative, before, noise = () if row is None else (row,), [], np.zeros_like(x), np.zeros_like(x)
    for _ in range(newton.max_iterations):
        residual, factors = system.linearize(x, rows)
        update = factors.solve(residual if row is None else np.append(residual, row @ x - target))
        relative.append(_relative(update, sizes(x)))
        if not np.isfinite(update).all():
            break
        least, count = newton.tolerance * np.maximum(sizes(x), before), len(updates) + len(relative)
        if np.all(np.abs(update) <= least):
            return Corrected(x, factors, count, subtract(x, update))
        strays = _strays(system, x, factors, row, target, update) & (np.abs(update) <= sizes(x))
        now = np.maximum(rounded_off(system, x, rows), np.where(strays, np.abs(update), 0.0))
        if np.all(np.abs(update) <= np.maximum(least, UNITS * np.maximum(noise, now))):
            return Corrected(x, factors, count, float(np.max(np.abs(update) / (1 + np.abs(x)))))
        noise, before = now, sizes(update)
        subtract(x, update)
    raise _failure(relative)


def _update(system: Equations, x: Array, factors: Factors, row: Array | None, target: float | Array) -> Array:
    """Return the update at x with factors that are known."""
    residual = system.residual(x)
    return factors.solve(residual if row is None else np.append(residual, row @ x - target))


def _strays(system: Equations, x: Array, factors: Factors, row: Array | None, target: float | Array, update: Array) -> Mask:
    """Return in which unknowns a small part of an update does not change the next one by that part: it is round-off."""
    left = _update(system, x - _PART * update, factors, row, target) - (1 - _PART) * update
    return 2 * np.abs(left) > _PART * np.abs(update)


def _relative(update: Array, sizes: Array) -> float:
    """Return the largest component of an update relative to the size of its unknown; infinity if a zero changes."""
    moving = update != 0
    return float(np.max(np.abs(update[moving]) / sizes[moving], initial=0.0))


def nearest_zero(linearized: Callable[[Array], tuple[Array, Array]], x: Array) -> Array | None:
    """Return the zero of a few equations that Newton's method finds near x, to round-off; None where it finds none.

    ``linearized(x)`` returns the values and their matrix of derivatives. Of more unknowns than equations, updates are the
    smallest.

    Examples
    --------
    >>> root = nearest_zero(lambda x: (x * x - 2, 2 * x[:, None]), np.array([1.0]))
    >>> print(round(float(root[0]), 12))
    1.414213562373
    """
    for _ in range(MOST_UPDATES):
        values, matrix = linearized(x)
        if not (np.isfinite(values).all() and np.isfinite(matrix).all()):
            return None
        update = np.linalg.lstsq(matrix, -values)[0]
        x = x + update
        if np.abs(update).max() <= CORRECTED * (1 + np.abs(x).max()):
            return x
    return None


def approached(system: Equations, guess: Sequence[float] | Array) -> Iterator[Array]:
    """Return points from which Newton's method may converge, reached from a guess by damped steps, each nearer than the last.

    The damping is that of the natural monotonicity test (Deuflhard, Newton Methods for Nonlinear Problems, 2004, section 3.3):
    the next correction, with the same Jacobian, must be smaller. It does not depend on units of the equations. How near is near
    enough depends on the size of the solution: corrections that have become ten times smaller give the next point.
    """
    for enough in _ENOUGH:
        x, near = np.array(guess, dtype=float), _NEAR
        with np.errstate(all="ignore"):
            for _ in range(MOST_STEPS):
                residual, factors = system.linearize(x)
                update = factors.solve(residual)
                size = float(np.max(np.abs(update) / (1 + np.abs(x)), initial=0.0))
                if size < near:
                    yield x
                    near = min(near, size) / 10
                part = _part_taken(system, x, update, factors, enough)
                if part < _LEAST_PART:
                    break
                x = x - part * update


def _part_taken(system: Equations, x: Array, update: Array, factors: Factors, enough: float) -> float:
    """Return the part of a correction that makes the next one smaller; 0 where there is none."""
    part, size = 1.0, np.linalg.norm(update)
    while part >= _LEAST_PART and np.isfinite(size):
        if np.linalg.norm(factors.solve(system.residual(x - part * update))) <= (1 - enough * part) * size:
            return part
        part /= 2
    return 0.0


#: A step must make the next correction smaller by this part, times the part of the correction that it takes: first as theory
#: suggests, then about as SciPy's solve_bvp asks. A hanging cable needs the first, a localized pattern the second.
_ENOUGH = (0.5, 0.2)
#: Damped steps end where corrections, relative to 1 + |x|, are so small: Newton's method takes over. They end, too, with so
#: small a part of the correction.
_NEAR, _LEAST_PART = 1e-2, 1e-4


def _is_noise(system: Equations, x: Array, update: Array, rows: tuple[Array, ...], coarse: float) -> bool:
    """Return whether an update is no larger than round-off of x makes it.

    With unknowns of very different sizes, round-off of the large ones reaches the small ones.
    """
    noise = rounded_off(system, x, rows)
    if not (np.isfinite(noise).all() and np.isfinite(update).all()):
        return False
    return bool(np.max(np.abs(update) / (1 + np.abs(x))) <= min(UNITS * np.max(noise / (1 + np.abs(x))), coarse))


def rounded_off(system: Equations, x: Array, rows: tuple[Array, ...] = ()) -> Array:
    """Return by how much each unknown of a solution x changes where x changes by one unit in the last place."""
    (residual, factors), zero = system.linearize(x, rows), np.zeros(len(rows))
    return draws.spread("newton", lambda rng: factors.solve(np.append(system.residual(draws.rounded(rng, x)) - residual, zero)))


def _chords(
    system: Equations, guess: Array, row: Array | None, target: float | Array, newton: Newton, factors: Factors
) -> Corrected:
    """Chord steps with factors from elsewhere, for a guess that is close; raise ConvergenceError where they converge slowly."""
    x, sizes = guess.copy(), list[float]()
    with np.errstate(all="ignore"):
        while len(sizes) < CHORDS:
            sizes.append(subtract(x, _update(system, x, factors, row, target)))
            if sizes[-1] <= one_call.EXACT:
                return Corrected(x, factors, len(sizes), sizes[-1])
            if not sizes[-1] < one_call.CLOSE * (sizes[-2] if len(sizes) > 1 else 1.0):
                break
            if len(sizes) > 1:
                ratio = sizes[-1] / sizes[-2]
                if sizes[-1] * ratio / (1 - ratio) <= newton.tolerance:
                    return Corrected(x, factors, len(sizes), sizes[-1] * ratio / (1 - ratio))
    raise _failure(sizes)


def _failure(sizes: list[float]) -> ConvergenceError:
    updates = ", ".join(f"{size:.1e}" for size in sizes) or "not finite"
    return ConvergenceError(f"Newton did not converge (updates {updates})")
