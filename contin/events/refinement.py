"""Error estimates of special points: each is located again on finer meshes, until it no longer moves."""

from __future__ import annotations

import contextlib
import dataclasses
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from contin.arrays import Array
from contin.core.labels import Label
from contin.core.newton import Newton
from contin.core.protocol import Carrier, Discretization, inner
from contin.core.settings import Settings
from contin.core.step import ROUNDS, corrected, located, standing_at
from contin.core.trial import Event, Trial, linearization
from contin.errors import ConvergenceError
from contin.events.arc import SpecialPoint, Value, find_zero
from contin.events.branch_point import BranchPoint, locate_branch_point
from contin.events.labelled import Elsewhere, finding_of
from contin.levels import CERTAIN, CORRECTED, LAST_PLACES, LOCATED, MOST_UPDATES, ROUGH
from contin.linalg.blocks import Factors

#: A special point on a finer mesh whose parameters moved by more than this, relative to 1 + their size, is another one.
_FAR = 0.05
#: On a mesh of half the width the error is 2^-(2 d) of what it was: a point that moves by more than this part of the move
#: before does so by round-off.
_CLOSER = 0.25
#: The move to a mesh made for the tolerance tells of what is left by the order and the errors of both meshes, which know it
#: within less than this factor.
_SAFE = 8.0
#: Meshes are halved at most so often: each halving divides the error by 2^(2 d), 16 to 65536.
_HALVINGS = 4
#: A value that is not below this part of the nearest to zero came no nearer. Ten times smaller, secants that still come nearer
#: count as round-off; ten times larger, round-off that is smaller by chance does not.
_NEARER = 0.1
#: A value above this part of that at the distance `ROUGH` is not near zero: secants over such a distance may take a function
#: that bends for round-off. Ten times smaller, each point that moves by 1e-6 takes some more corrections.
_FAR_OFF = 1e-2
#: So many of these in a row are round-off: one may be due to the curvature between the first two places.
_BLURRED = 2
#: Where it fails, the place is known as far as the function grows on both sides, with different signs: distances at which it
#: is looked at grow by the first factor, its values at least by the second. Round-off does not grow, and a square root does by
#: 3.2. The ± is too large by the square of the first at most.
_WIDER, _GROWS = 10.0, 3.0
#: Distance over which slopes are taken, of an unknown or along the tangent: the cube root of round-off. In a canard explosion
#: multipliers change by a tenth of their value where it is a thousand times longer.
ASIDE = 1e-5
#: A step of it that leads further than this from the point of the coarser mesh, in units of the arclength, ends it, too.
_AWAY = 1.0


@dataclass(frozen=True, eq=False)
class Refined:
    """A special point on the finest mesh that it was located on.

    - ``trial`` (Trial)
    - ``errors`` (dict): By how much its free parameters differ from those on the mesh before; NaN where it could not be located
      again.
    - ``details`` (object)
    - ``is_lost`` (bool): It was looked for, and is not there. Where Newton's method fails, nothing is known: the point is not
      lost.
    """

    trial: Trial
    errors: dict[str, float]
    details: Any
    is_lost: bool = False


class _Found(NamedTuple):
    """A special point on a mesh.

    ``left`` is how far its place may be off along the branch or, after `_on_switches`, by how much its free parameters may be,
    ``slope`` the derivative of its test function along the branch; NaN where it is not known.
    """

    trial: Trial
    details: Any
    left: Any = 0.0
    slope: float = np.nan


def refined(point: SpecialPoint, settings: Settings) -> Refined:
    """Return a special point on the finest of some meshes, and by how much its free parameters may be off there.

    1. Locate it on a finer mesh (`_on_made_mesh`, then halved). Far from the coarse point, or with another kernel, it is lost.
    2. Tell from its move what is left: by `_part_left` or, of two moves or by own equations, `_part_by_order`.
    3. Repeat until that is within the mesh tolerance, or the point moves by round-off: hardly less than before, or hardly more
       than Newton's method leaves. If it moves further, it stays on the mesh before.
    """
    trial, details, before, last, seen, known = point.trial, point.details, np.zeros(1), np.inf, None, None
    errors = dict.fromkeys(trial.system.free, np.nan)
    holds = point.test is not None and point.test.holds_one_of(trial.system.free)
    if finding_of(details).is_lost or not trial.system.may_branch(trial.x):  # no cycle of no size is found again
        return Refined(trial, errors, details, is_lost=finding_of(details).is_lost)
    try:
        now = _on_switches(point, _Found(trial, details, slope=point.slope), settings.newton)
    except ConvergenceError:
        return Refined(trial, errors, details, is_lost=True)
    (trial, details, *_), is_lost = now, False
    for number in range(_HALVINGS):
        coarse = trial.system
        made = None if number else _on_made_mesh(point, now, settings)
        try:
            again = made or _again(point, now, coarse.refined() or (coarse, np.array), settings.newton)
            better, found, left, _ = now = _on_switches(point, again, settings.newton)
        except ConvergenceError as error:
            is_lost = last == np.inf and isinstance(error, Elsewhere)
            break
        system, size = better.system, 1 + np.abs(better.x[better.system.state_size :])
        least = LAST_PLACES * size.max()
        steps = moves = np.maximum(np.abs(better.x[system.state_size :] - trial.x[coarse.state_size :]), least)
        if made:
            steps = moves * _part_left(trial, better)
            if holds and not system.on_curve:
                steps = np.minimum(steps, _SAFE * better.discretization_error * size)  # no place adds to the error
        elif not seen and system.intervals and finding_of(found).has_equations:
            steps = moves * _part_by_order(1.0, 1.0, 0.0, system.degree)
        moved = float(np.max((steps := np.maximum(steps, least)) / size))
        if np.any(steps > _FAR * size):
            is_lost = last == np.inf
            break
        too_fine = system.intervals > settings.mesh.max_intervals and settings.mesh.every
        if seen and not too_fine:
            part = _part_by_order(*seen, moved, system.degree)
            steps, left = np.maximum(part * steps, np.minimum(steps, settings.newton.tolerance * size)), _SAFE * left
        noise = 0.0 if holds else max(trial.newton_error, better.newton_error)
        if noise > settings.newton.tolerance:  # round-off moves the point so far, about the way that it has moved
            steps, noise = steps * max(noise / float(np.max(steps / size)), 1.0), CERTAIN * noise
        settled = np.maximum(np.maximum(max(settings.mesh.tolerance, noise) * size, left), least) >= steps
        change = np.maximum(steps, before) if moved > _CLOSER * last else steps
        known = change + left + finding_of(found).split(system)  # a curve of branch points has one unknown more
        if moved > last or not system.intervals or too_fine:
            break  # such a mesh serves the estimate only
        trial, details, seen = better, found, (float(np.max(moves / size)), np.log2(system.intervals / coarse.intervals))
        if np.all(settled) or moved > _CLOSER * last:
            break
        before, last = steps, moved
    if known is not None:
        known = (known + finding_of(details).round_off(trial.system))[: len(errors)]
        errors = dict(zip(errors, map(float, known * trial.system.free_scales)))
    return Refined(trial, _with_cut_off(errors, trial, point.test, now.slope, settings.primary), details, is_lost)


def _on_made_mesh(point: SpecialPoint, coarse: _Found, settings: Settings) -> _Found | None:
    """Return a special point on a mesh that is made for the tolerance, of twice as many intervals at least; None if not found.

    Interpolation moves a point along the branch: there is none for those whose place no equation holds, and where the halved
    mesh serves as well.
    """
    test, control, trial = point.test, settings.mesh, coarse.trial
    system = trial.system
    if test is None or finding_of(coarse.details).has_equations or not (system.intervals and np.isfinite(trial.tangent).all()):
        return None
    if not (test.holds_one_of(system.free) or trial.value(test)) or not trial.discretization_error > control.tolerance:
        return None
    made = system.adapted(trial.x, dataclasses.replace(control, min_intervals=min(2 * system.intervals, control.max_intervals)))
    if made is not None and made[0].intervals >= 2 * system.intervals:
        with contextlib.suppress(ConvergenceError):  # the mesh is halved as if there were no better one
            there = _again(point, coarse, made, settings.newton)
            x = there.trial.x[made[0].state_size :]
            return there if np.all(np.abs(x - trial.x[system.state_size :]) <= _FAR * (1 + np.abs(x))) else None
    return None


def _part_left(coarse: Trial, better: Trial) -> float:
    """Return the part of a move to a better mesh that may be left there: _SAFE times what the order and both errors say.

    The order is half that of fine meshes, which multipliers of steep waves reach later than solutions do.
    """
    order = (coarse.system.intervals / better.system.intervals) ** coarse.system.degree
    return min(_SAFE * max(order, better.discretization_error / coarse.discretization_error), 1.0)


def _part_by_order(before: float, halvings: float, now: float, degree: int) -> float:
    """Return the part of a move to a halved mesh that may be left there: _SAFE times what the order of both moves says.

    The order counts up to 3/4 of that of fine meshes: one of both moves may be small by chance.
    """
    return min(_SAFE * max((now / before) ** (1 / halvings), 0.5 ** (1.5 * degree)), 1.0)


def _with_cut_off(errors: dict[str, float], trial: Trial, test: Any, slope: float, primary: str | None) -> dict[str, float]:
    """Return the errors of the free parameters, and what cutting off an infinite time adds to them.

    A special point moves along the branch, too, to where its test function vanishes again, a first point to where the primary
    parameter has its value; a fold stays where it is.
    """
    system, along = trial.system, trial.tangent
    moves = system.cut_off_errors(trial.x, trial.factors) if np.isfinite(along).all() else np.empty((0, system.size))
    if not len(moves) or not np.isfinite(moves).all():
        return errors
    test = test or Event(Label.END, "start", lambda trial: trial[primary or system.free[0]])
    if test.label != Label.FOLD:
        slope = _change(test, trial, along) if np.isnan(slope) else slope
        for move in moves:
            move -= along * (_change(test, trial, move) / slope if move.any() and slope else 0.0)
    added = np.abs(moves[:, system.state_size :]).sum(axis=0)[: len(system.free)] * system.free_scales
    return {name: error + float(more) for (name, error), more in zip(errors.items(), added)}


def _change(test: Event, trial: Trial, move: Array) -> float:
    """Return by how much a test function changes along a move, by its difference over a distance that suits."""
    part = ASIDE / float(np.abs(move).max())
    x, row = trial.x + part * move, trial.system.weights * trial.tangent
    return (test.function(Trial(trial.system, x, lambda: linearization(trial.system, x, row))) - trial.value(test)) / part


def _on_switches(point: SpecialPoint, found: _Found, newton: Newton) -> _Found:
    """Return a special point on a mesh with points where conditions that the solution decides switch.

    Its free parameters may be off by how much they changed when mesh points were moved there the last time, and what they
    change along the branch over the distance that its place is known to. Raises ConvergenceError where it was not found on such
    a mesh, or the places do not settle.
    """
    moves: Any = 0.0
    for _ in range(ROUNDS):
        trial = found.trial
        moved = trial.system.on_switches(trial.x, closely=True)
        if moved is None:
            break
        found = _again(point, found, moved, newton)
        moves = np.abs(found.trial.x[moved[0].state_size :] - trial.x[trial.system.state_size :])
    if found.left:
        moves = moves + found.left * np.abs(found.trial.tangent[found.trial.system.state_size :])
    return found._replace(left=moves)


def _again(point: SpecialPoint, coarse: _Found, finer: tuple[Discretization, Carrier], newton: Newton) -> _Found:
    """Return the special point and its details on another mesh, or located again, unless its `round_off` shows as much.

    Raises ConvergenceError where it was not found, or another one was.
    """
    (system, carry), (trial, details, _, slope) = finer, coarse
    if system is trial.system and isinstance(details, BranchPoint):
        return coarse
    if details is None and point.label == Label.BRANCH_POINT and point.test is None:  # a first point: its kernel is not known
        found: Any = locate_branch_point(system, carry(trial.x), newton)
        return _Found(found.there(system, carry(trial.tangent)), found)
    if finding_of(details).has_equations:
        found = finding_of(details).again(system, carry, trial.x, newton)
        return _Found(found.there(system, carry(trial.tangent)), found)
    zero, apart, slope = zero_again(system, carry(trial.x), carry(trial.tangent), point.test, newton, slope)
    return _Found(zero, details, apart, slope)


def zero_again(
    system: Discretization, x: Array, tangent: Array, test: Event | None, newton: Newton, slope: float = np.nan
) -> tuple[Trial, float, float]:
    """Return the zero of a test function near x, by secants along the tangent; without one, x corrected.

    Where the function is the value of a free parameter, that is held. Returned, too, are how far off the zero may lie, and the
    slope of the function there, as far as it is known; ``slope`` is about that. Raises ConvergenceError where Newton's method
    fails, or there is no zero.
    """
    holds = test is not None and test.holds_one_of(system.free)
    tangent, distance = _towards(system, x, tangent, test) if holds else (tangent, 0.0)
    state = standing_at(system, x, tangent / np.sqrt(inner(system, tangent, tangent)), 1.0)
    factors: Factors | None = None

    def at(s: float, near: tuple[float, Trial] | None = None) -> Trial:
        if near is not None and abs(s - near[0]) < max(LOCATED, near[1].newton_error):  # up to the square
            place, trial = near
            shifted = trial.x + (s - place) * trial.tangent
            return Trial(trial.system, shifted, trial.linear, trial.iterations, trial.newton_error)
        guess = x + s * state.tangent
        trial = corrected(state, guess, s, newton) if factors is None else located(state, guess, s, newton, factors)
        for _ in range(ROUNDS):
            moved = trial.system.on_switches(trial.x, closely=True)
            if moved is None:
                break
            base, along = map(system.carrier(moved[0]), (x, state.tangent))
            moving = standing_at(moved[0], base, along / np.sqrt(inner(moved[0], along, along)), 1.0)
            trial = located(moving, moved[1](trial.x), s, newton)
        return trial

    here = at(distance)
    if test is None or holds:
        return here, 0.0, np.nan
    factors = here.factors if here.system is system else None
    return _by_secants(at, here, test, slope)


def _towards(system: Discretization, x: Array, tangent: Array, test: Any) -> tuple[Array, float]:
    """Return the direction in which a free parameter alone changes, along the tangent, and how far its value lies from x."""
    place = system.parameter_index(test.column)
    length = float(np.copysign(np.sqrt(system.weights[place]), tangent[place]))
    gap = test.value / system.free_scales[place - system.state_size] - x[place]
    along = np.zeros(system.size)
    along[place] = 1 / length
    return along, float(gap * length)


def _by_secants(at: Callable[..., Trial], here: Trial, test: Event, slope: float = np.nan) -> tuple[Trial, float, float]:
    """Return the zero of a test function near ``here``, which is ``at(0)``, how far off it may lie, and the slope there.

    The first secant leads to where the zero is by a ``slope`` that is known about, if the value there is much smaller, or over
    the distance `ROUGH`. Each of the next goes through the place nearest to zero and the one looked at last. Where some in a
    row come no nearer, values are round-off, and the slope of the first secant says how far that reaches; where it does not, it
    is looked for. Raises ConvergenceError where Newton's method fails, or there is no zero.
    """

    def place(s: float) -> tuple[float, float, Trial]:
        trial = at(s)
        return s, test.function(trial), trial

    value = test.function(here)
    if value == 0:
        return here, 0.0, slope
    if not np.isfinite(value):
        raise Elsewhere("the test function is not defined on the finer mesh")
    best, s = (0.0, value, here), -value / (slope or np.nan)
    if abs(s) < max(CORRECTED, here.newton_error):
        return at(s, (0.0, here)), max(abs(s), here.newton_error), slope
    near = other = place(s) if abs(s) < ROUGH else best
    if not abs(near[1]) <= _NEARER * abs(value):
        other = place(ROUGH)
        if test.label == Label.FOLD and max(abs(value), abs(other[1])) < CORRECTED:
            return here, _stands_still_to(lambda s: test.function(at(s))), np.nan  # its value there is that of the fold
        slope = (other[1] - value) / ROUGH
        if near is not best and (noise := max(abs(value), abs(near[1]))) < LOCATED * abs(slope):
            s, value, trial = min(best, near, key=lambda place: abs(place[1]))
            return at(s - value / slope, (s, trial)), noise / abs(slope), slope
        inside = abs(value) > _FAR_OFF * abs(other[1]) and _bracketed(lambda s: test.function(at(s)), best[:2], other[:2])
        best = place(inside) if inside else best
    first, blurred = abs(slope), [0.0]
    for _ in range(MOST_UPDATES):
        best, other = sorted((best, other), key=lambda place: abs(place[1]))
        if best[1] == 0:
            return best[2], 0.0, slope
        if len(blurred) > _BLURRED or best[1] == other[1]:
            break  # the function is round-off, or does not depend on the place and is not zero
        if abs(best[0] - other[0]) > LOCATED:  # nearer by, slopes are round-off
            slope = (best[1] - other[1]) / (best[0] - other[0])
        s = best[0] - best[1] * (best[0] - other[0]) / (best[1] - other[1])
        if not abs(s) <= _AWAY:
            break  # such a zero is another one, or the function is round-off
        if len(blurred) == 1 and abs(s - best[0]) * abs(s - other[0]) < LAST_PLACES:
            return at(s, (best[0], best[2])), abs(s - best[0]), slope
        other = place(s)
        blurred = [*blurred, abs(other[1])] if abs(other[1]) > _NEARER * abs(best[1]) else [0.0]
    if len(blurred) > _BLURRED and max(blurred) < first * ROUGH:
        return best[2], max(blurred) / first, np.nan
    return here, _known_to(lambda s: test.function(at(s))), np.nan


def _bracketed(function: Callable[[float], float], here: Value, beside: Value) -> float | None:
    """Return a zero of a function between a place and one beside it on either side; None where it keeps its sign."""
    if here[1] * beside[1] > 0:
        beside = -beside[0], function(-beside[0])
    try:
        return find_zero(function, here, beside, LOCATED) if here[1] * beside[1] < 0 else None
    except ConvergenceError:
        return None


def _stands_still_to(function: Callable[[float], float]) -> float:
    """Return the distance beyond `ROUGH` at which a parameter no longer stands still on either side, or as far as is looked."""
    apart = _WIDER * ROUGH
    while apart < _AWAY and min(abs(function(-apart)), abs(function(apart))) < CORRECTED:
        apart *= _WIDER
    return apart


def _known_to(function: Callable[[float], float]) -> float:
    """Return the distance from which on a function grows on both sides of zero, with different signs.

    Raises ConvergenceError where there is none: the function has no zero there, or is round-off.
    """
    apart, values = LOCATED, np.zeros(2)
    while apart <= _AWAY:
        before, values = values, np.array([function(-apart), function(apart)])
        if before[0] * before[1] < 0 and np.all(values / before > _GROWS):
            return apart
        apart *= _WIDER
    raise Elsewhere("the point was not found again on the finer mesh")
