"""The rules of one step: predicted, judged, watched, accepted, whatever the equations are.

They are one text. Kernels call them, where points stand one by one in a `Path`; a step that Python makes is row 2 of a path of
its own, whose row 1 is the state (`length_of_step`, `predict`, `judged`).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from contin.arrays import Array
from contin.core.protocol import Discretization
from contin.core.settings import Settings
from contin.core.small import ASKS, BELIEVED, FAILED
from contin.core.step import CLEAR, State
from contin.core.trial import Trial
from contin.events.folds import STANDS, STILL, dips, ends_low
from contin.events.inspection import FEWEST, REACH, misses
from contin.kernels.kernel import kernel
from contin.kernels.kernel_parts import IndexVector, Matrix, Vector, helper
from contin.levels import APART, CORRECTED, TINY

#: Share of the states in a unit tangent below which their direction is not compared: the states hardly take part in the step.
_RESTS = 0.01
#: A step ends at this many times the distance to a limit, along the tangent, at most: beyond it, and not much. Ten times
#: larger, a parameter that the equations divide by went through zero, and three branch points before it were lost.
_BEYOND = 1.25
#: A corrected point this many times further from its prediction than aimed at is not believed: it may lie on another branch.
_ASTRAY = 2.5
#: Bounds on the factor from one step to the next, and the part of the largest angle that a step aims at.
_SHORTER, _LONGER, _AIM = 0.3, 2.0, 0.8
#: Part of its change in a step by which the primary parameter may miss its prediction. From a fold, where nothing is known of
#: the curvature, it is one half.
_MISSED = 0.75
#: Part of their own change by which states alone may miss their prediction, over that of the whole step. Where a large
#: parameter makes the norm they could miss it by all of their size: of 600 runs of a reactor whose residence time goes to 500,
#: 152 jumped over a fold to another branch, 11 with this; 17 with 5, with 4 % fewer points.
_LOOSE = 4.0
#: Round-off of Newton's method above the tolerance is noted from this error on: ten times smaller, runs in small units that
#: soon change would be.
NOISY = 1e-9
#: Numbers of a row of `Path`: the step made and the next one; the determinant's sign, the arclength, Newton's updates and the
#: error that they left; the sense of the primary parameter, and the row where it was told, 0 where that is none of these; the
#: error of the mesh; and 1 where the first point may be near, as far as kernels tell, or a free parameter passes a value.
STEP, NEXT, SIGN_OF, ARCLENGTH, ITERATIONS, ERROR_LEFT, SENSE, SENSED, MESH_ERROR, CLOSES, PASSES, NUMBERS = range(12)
#: Places in ``Attempt.judged``: as in `Judgement`, then the determinant's sign, Newton's updates and the error that they left,
#: and the error of the mesh.
MISSED, TURN, LENGTH, COSINE, SIGN, UPDATES, ERROR, OF_MESH, JUDGED = range(9)
#: What a step comes to besides `BELIEVED`, `FAILED` and `ASKS`: the primary parameter does not go where the tangents say.
JUMPS = 3


class Frame(NamedTuple):
    """The unknowns: their ``weights`` (size,), the number of those that are states, the ``sizes`` (k,) of the others."""

    weights: Vector
    states: int
    sizes: Vector


class Control(NamedTuple):
    """Settings; ``primary`` is the place of the primary parameter, or -1 where folds are not looked for.

    At a rate up to ``still`` it stands still. ``low`` and ``high`` are the limits of the free parameters.
    """

    tolerance: float
    most: int
    accuracy: float
    angle: float
    change: float
    shortest: float
    longest: float
    primary: int
    still: float
    low: Vector
    high: Vector


class Attempt(NamedTuple):
    """The guess of a step, and the numbers by which it is ``judged``."""

    guess: Vector
    judged: Vector


class Watched(NamedTuple):
    """What both ends of a step are compared in.

    ``branch_points``, ``eigenvalues`` are 1 where these are watched, and ``noisy`` where round-off of Newton's method was
    noted. ``places``, ``values``: free parameters that take these values at special points; ``sides`` is 0, or the side of a
    value that is a limit. ``home`` are the unknowns of the first point of the run that are no states, and ``closing`` the
    weights by which the distance to them is measured.
    """

    branch_points: int
    eigenvalues: int
    noisy: int
    places: IndexVector
    values: Vector
    sides: Vector
    home: Vector
    closing: Vector


class Path(NamedTuple):
    """Points one by one: row 1 is where a call begins, row 0 has the tangent before. ``numbers`` are described above.

    Where there is no tangent before, the step made is infinite.
    """

    x: Matrix
    tangents: Matrix
    numbers: Matrix


class Judgement(NamedTuple):
    """What a step is judged by.

    - ``missed`` (float): Distance from the prediction to the corrected point; that of the states alone where larger. States
      that go slowly beside a parameter are compared with their own rate, at the end of the step where it is larger.
    - ``turn`` (float): Angle between the tangents at both ends: the larger of the whole one and half that of the states alone.
      Where parameters are large they dominate the norm, and tangents of different branches can look parallel.
    - ``length`` (float): Distance between both ends.
    - ``following`` (float): The length of the next step.
    - ``outcome`` (int): What the step comes to by itself.
    """

    missed: float
    turn: float
    length: float
    following: float
    outcome: int


def aims(settings: Settings, system: Discretization) -> tuple[float, float]:
    """Return the largest angle between tangents, and the part of a step by which it aims to miss its prediction."""
    angle, accuracy = system.aims
    return settings.angle or angle, settings.accuracy or accuracy


def frame_of(system: Discretization) -> Frame:
    """Return the unknowns of a system."""
    return Frame(system.weights, system.state_size, system.free_scales)


def control_of(system: Discretization, settings: Settings) -> Control:
    """Return the settings of a run."""
    primary = system.parameter_index(settings.primary or system.free[0]) if settings.folds else -1
    angle, accuracy = aims(settings, system)
    low, high = np.array([settings.limits.get(name, (-np.inf, np.inf)) for name in system.free], dtype=float).reshape(-1, 2).T
    return Control(
        settings.newton.tolerance, settings.newton.max_iterations, accuracy, angle, settings.change, settings.min_step,
        settings.max_step, primary, STILL if system.intervals else -1.0, low.copy(), high.copy(),
    )  # fmt: skip


def attempt_of(size: int) -> Attempt:
    """Return the room for the numbers of a step."""
    return Attempt(np.empty(size), np.zeros(JUDGED))


def path_from(state: State, most: int) -> Path:
    """Return the path of so many steps from a state."""
    shape, before = (most + 2, state.x.size), state.previous_tangent
    path = Path(np.empty(shape), np.empty(shape), np.zeros((most + 2, NUMBERS)))
    path.x[1], path.tangents[1], path.tangents[0] = state.x, state.tangent, 0.0 if before is None else before
    path.numbers[1, : MESH_ERROR + 1] = (
        np.inf if before is None else state.previous_step, state.step, state.sign, state.arclength, 0, 0, state.sense, 0,
        state.discretization_error,
    )  # fmt: skip
    return path


class Single(NamedTuple):
    """One step from a state, by itself."""

    frame: Frame
    attempt: Attempt
    control: Control
    path: Path


def single_step(state: State, settings: Settings) -> Single:
    """Return the room of a step from a state."""
    system = state.system
    return Single(frame_of(system), attempt_of(system.size), control_of(system, settings), path_from(state, 1))


def predict(state: State, step: float, settings: Settings = Settings()) -> Array:
    """Return the guess at a distance ``step``: along the tangent, with the curvature known from the last step."""
    return predicted(single_step(state, settings), step)[0]


def predicted(single: Single, step: float) -> tuple[Array, float]:
    """Return the same of a step whose room is at hand, and how far from it the end of the step is believed."""
    predict_step(single, step)
    return single.attempt.guess, _ASTRAY * single.control.accuracy * step


def judged(state: State, guess: Array, trial: Trial, step: float = math.inf, settings: Settings = Settings()) -> Judgement:
    """Return what the step from a state to a corrected point is judged by, with the length of the next one."""
    single = single_step(state, settings)
    single.attempt.guess[:] = guess
    return judged_as(single, trial, step)


def judged_as(single: Single, trial: Trial, step: float) -> Judgement:
    """Return the same of a step from whose room the guess came."""
    single.path.x[2], single.path.tangents[2], single.attempt.judged[ERROR] = trial.x, trial.tangent, trial.newton_error
    outcome = judge_step(single, step)
    return judgement_of(single.attempt, single.path, 2, outcome)


def judgement_of(attempt: Attempt, path: Path, number: int, outcome: int) -> Judgement:
    """Return what a kernel has judged of the step into a row of a path."""
    missed, turn, length = attempt.judged[: LENGTH + 1].tolist()
    return Judgement(missed, turn, length, float(path.numbers[number, NEXT]), outcome)


@helper
def bend_of(path: Path, number: int) -> float:
    """Return by what the change of tangents is multiplied for the curvature: 0 at the first step."""
    return 0.5 / path.numbers[number - 1, STEP]


@helper
def fill_guess(attempt: Attempt, path: Path, number: int, step: float) -> None:
    """Fill in the guess of a step, as `predict`."""
    x, tangent, earlier, new = path.x[number - 1], path.tangents[number - 1], path.tangents[number - 2], path.x[number]
    bend = bend_of(path, number)
    for i in range(x.size):
        attempt.guess[i] = x[i] + step * tangent[i]
        if bend > 0:
            attempt.guess[i] += step * step * bend * (tangent[i] - earlier[i])
        new[i] = attempt.guess[i]


@helper
def judge(frame: Frame, attempt: Attempt, control: Control, path: Path, number: int, step: float) -> int:
    """Return whether a corrected point can be believed by itself; fill in what it is judged by."""
    _compare(frame, attempt, path, number)
    judged, tangent, new, new_tangent = attempt.judged, path.tangents[number - 1], path.x[number], path.tangents[number]
    strays: float = _off(frame, attempt, path, number, step / 2)
    if strays > _ASTRAY * control.accuracy * step:
        judged[MISSED] = max(judged[MISSED], strays)
    if not (judged[TURN] <= control.angle and judged[MISSED] <= _ASTRAY * control.accuracy * step):
        return FAILED
    at = control.primary
    if at < 0:
        return BELIEVED
    change = max(abs(tangent[at]), abs(new_tangent[at]))
    if bend_of(path, number) > 0:
        change = max(change, abs(path.tangents[number - 2, at]))
    missed, round_off = abs(attempt.guess[at] - new[at]), (CORRECTED + 2 * judged[ERROR]) * (1 + abs(new[at]))
    if not (missed > _MISSED * step * change and missed > round_off) or abs(new_tangent[at]) <= control.still:
        return BELIEVED
    return JUMPS if abs(new_tangent[at]) >= CLEAR else ASKS


@helper
def _compare(frame: Frame, attempt: Attempt, path: Path, number: int) -> None:
    """Fill in what both ends of a step say of it, with the cosine between their tangents."""
    x, tangent, last, last_tangent = path.x[number - 1], path.tangents[number - 1], path.x[number], path.tangents[number]
    judged, whole, chord = attempt.judged, 0.0, 0.0
    for i in range(x.size):
        whole += frame.weights[i] * tangent[i] * last_tangent[i]
        chord += frame.weights[i] * (last[i] - x[i]) ** 2
    part, first_size, last_size = 0.0, 0.0, 0.0
    for i in range(frame.states):
        weight, one, other = frame.weights[i], tangent[i], last_tangent[i]
        part += weight * one * other
        first_size += weight * one * one
        last_size += weight * other * other
    sizes = math.sqrt(first_size), math.sqrt(last_size)
    cosine = part / (sizes[0] * sizes[1]) if min(sizes[0], sizes[1]) > _RESTS else 1.0
    judged[LENGTH], judged[COSINE], judged[TURN] = math.sqrt(chord), whole, max(_angle(whole), _angle(cosine) / 2)
    judged[MISSED] = _off(frame, attempt, path, number, 0.0)


@helper
def _off(frame: Frame, attempt: Attempt, path: Path, number: int, half: float) -> float:
    """Return how far a step ends from its prediction or, with ``half`` a step, from where the tangents at both ends lead.

    That is the trapezoidal rule: of a smooth branch it misses less than the prediction. Where Newton's method falls onto a
    branch that crosses this one nearby, only the tangent may tell. In the first step states alone are compared by this rule
    only: a prediction without curvature misses half of the way of states that begin at rest, however short the step is.
    """
    x, tangent, last, last_tangent = path.x[number - 1], path.tangents[number - 1], path.x[number], path.tangents[number]
    missed, of_states, first_size, last_size, cosine = 0.0, 0.0, 0.0, 0.0, attempt.judged[COSINE]
    for i in range(x.size):
        aim = attempt.guess[i] if half == 0 else x[i] + half * (tangent[i] + last_tangent[i] / cosine)
        missed += frame.weights[i] * (aim - last[i]) ** 2
        if i < frame.states:
            of_states = missed
            first_size += frame.weights[i] * tangent[i] ** 2
            last_size += frame.weights[i] * last_tangent[i] ** 2
    if of_states > APART * APART and (half != 0 or bend_of(path, number) > 0):
        missed = max(missed, of_states / (_LOOSE * _LOOSE * max(first_size, last_size) + TINY))
    return math.sqrt(missed)


@helper
def _angle(cosine: float) -> float:
    return math.acos(min(1.0, max(-1.0, cosine))) if cosine == cosine else math.nan  # noqa: PLR0124


@helper
def first_length(frame: Frame, control: Control, path: Path, number: int) -> float:
    """Return the length of a step, shortened where it leads far beyond the limit of a free parameter.

    The equations may have no meaning there, and what lies between the limit and the end of the step is not looked for. The
    parameter is extrapolated as in `predict`: a fold may come before the limit, and then no step is shortened.
    """
    x, tangent, earlier = path.x[number - 1], path.tangents[number - 1], path.tangents[number - 2]
    step: float = path.numbers[number - 1, NEXT]
    for k in range(control.low.size):
        at, size = frame.states + k, frame.sizes[k]
        rate, value = tangent[at] * size, x[at] * size
        limit = control.high[k] if rate > 0 else control.low[k]
        if abs(limit) < math.inf:
            bend, room = bend_of(path, number) * (rate - earlier[at] * size), limit - value
            square = rate * rate + 4 * bend * room
            if rate * room > 0 and square >= 0:
                step = min(step, _BEYOND * 2 * room / (rate + math.copysign(math.sqrt(square), rate)))
    return max(step, control.shortest)


@helper
def asks(
    frame: Frame, attempt: Attempt, control: Control, watch: Watched, path: Path, accepted: int, number: int, step: float
) -> bool:
    """Return whether an entry of the watch list asks for a closer look: all but those of values, branch points and eigenvalues.

    Whether a free parameter passes a value, and whether the first point may be near, is put into the numbers.
    """
    x, new, had, now, size = path.x[number - 1], path.x[number], path.numbers[number - 1], path.numbers[number], path.x.shape[1]
    if had[SIGN_OF] != attempt.judged[SIGN]:
        return True
    if attempt.judged[ERROR] > max(control.tolerance, NOISY) and not watch.noisy:
        return True
    for k in range(watch.places.size):
        at = watch.places[k]
        scale = frame.sizes[at - frame.states]
        first, last = x[at] * scale - watch.values[k], new[at] * scale - watch.values[k]
        if not (first < 0 > last or first > 0 < last) or last * watch.sides[k] > 0:
            now[PASSES] = 1.0
    now[CLOSES] = 0.0
    if accepted + number - 2 >= FEWEST:
        one, other, begin = 0.0, 0.0, frame.states
        for i in range(begin, size):
            one += watch.closing[i - begin] * (watch.home[i - begin] - x[i]) ** 2
            other += watch.closing[i - begin] * (watch.home[i - begin] - new[i]) ** 2
        now[CLOSES] = 0.0 if math.sqrt(one) + math.sqrt(other) > REACH * step else 1.0
        rates, new_rates = path.tangents[number - 1], path.tangents[number]
        for i in range(begin, size):
            if misses(watch.home[i - begin], x[i], rates[i], new[i], new_rates[i], step):
                now[CLOSES] = 0.0
    return control.primary >= 0 and _may_turn(attempt, control, path, number, step)


@helper
def _may_turn(attempt: Attempt, control: Control, path: Path, number: int, step: float) -> bool:
    """Return whether the primary parameter may turn, as `contin.events.folds.may_turn`."""
    at, x, new = control.primary, path.x[number - 1], path.x[number]
    first, last = path.tangents[number - 1, at], path.tangents[number, at]
    if abs(last) <= control.still:
        return False
    if not (min(abs(first), abs(last)) >= CLEAR and first * last > 0 and path.numbers[number - 1, SENSE] * last >= 0):
        return True
    sense = math.copysign(1.0, first)
    first, last, mean = sense * first, sense * last / attempt.judged[COSINE], sense * (new[at] - x[at]) / step
    slope, square = 6 * mean - 4 * first - 2 * last, 3 * first + 3 * last - 6 * mean
    return dips(first, last, slope, square) or ends_low(first, last, slope, square)


@helper
def accept(frame: Frame, attempt: Attempt, control: Control, path: Path, number: int, step: float) -> None:
    """Fill in the numbers of a step, with the next one: its prediction, with an error of its order, misses ``accuracy`` of it.

    It is no longer than that a parameter changes by ``change`` of 1 + its size.
    """
    judged, had, now = attempt.judged, path.numbers[number - 1], path.numbers[number]
    x, new, tangent, longest = path.x[number - 1], path.x[number], path.tangents[number], control.longest
    for k in range(frame.states, new.size):
        longest = min(longest, control.change * (1 + abs(new[k])) / (abs(tangent[k]) + TINY))
    order, factor = 3 if bend_of(path, number) > 0 else 2, _LONGER
    if judged[MISSED] != 0:
        factor = (control.accuracy * step / judged[MISSED]) ** (1 / order)
    factor = min(factor, _AIM * control.angle / max(judged[TURN], CORRECTED))
    length = max(step * min(max(factor, _SHORTER), _LONGER), control.shortest)
    now[NEXT] = min(length, max(longest, control.shortest))
    now[STEP], now[SIGN_OF], now[ARCLENGTH] = step, judged[SIGN], had[ARCLENGTH] + judged[LENGTH]
    now[ITERATIONS], now[ERROR_LEFT], now[SENSE], now[SENSED] = judged[UPDATES], judged[ERROR], had[SENSE], had[SENSED]
    now[MESH_ERROR] = judged[OF_MESH]
    at = control.primary
    if at >= 0 and abs(new[at] - x[at]) > STANDS * (1 + abs(new[at])) and abs(tangent[at]) > control.still:
        now[SENSE], now[SENSED] = math.copysign(1.0, tangent[at]), number


@kernel(reorder=False)
def length_of_step(single: Single) -> float:
    return first_length(single.frame, single.control, single.path, 2)


@kernel(reorder=False)
def predict_step(single: Single, step: float) -> None:
    fill_guess(single.attempt, single.path, 2, step)


@kernel(reorder=False)
def judge_step(single: Single, step: float) -> int:
    outcome: int = judge(single.frame, single.attempt, single.control, single.path, 2, step)
    accept(single.frame, single.attempt, single.control, single.path, 2, step)
    return outcome
