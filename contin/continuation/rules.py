"""The rules of a plain step inside kernels: predicted, judged, watched, accepted, whatever the equations are.

They are those of `contin.continuation.steps` and `contin.events.inspection`. Points stand one by one in a `Path`.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from contin.core.small import ASKS, BELIEVED, FAILED
from contin.core.step import ASTRAY, CLEAR, fill_sums_of, following_step, is_astray, longest_step, missed_of, turned, up_to
from contin.events.folds import STANDS, dips, ends_low
from contin.events.inspection import FEWEST, REACH, misses
from contin.functions.kernel_parts import IndexVector, Matrix, Vector, helper

#: Round-off of Newton's method above the tolerance is noted from this error on: ten times smaller, runs in small units that
#: soon change would be.
NOISY = 1e-9
#: Numbers of a row of `Path`: the step made and the next one; the determinant's sign, the arclength, Newton's updates and the
#: error that they left; the sense of the primary parameter, and the row where it was told, 0 where that is none of these; the
#: error of the mesh; and 1 where the first point may be near, as far as kernels tell.
STEP, NEXT, SIGN_OF, ARCLENGTH, ITERATIONS, ERROR_LEFT, SENSE, SENSED, MESH_ERROR, CLOSES, NUMBERS = range(11)
#: Places in ``Attempt.judged``: as in `contin.core.step.Judgement`, then the determinant's sign, Newton's updates and the
#: error that they left, and the error of the mesh.
MISSED, TURN, LENGTH, SIGN, UPDATES, ERROR, OF_MESH, JUDGED = range(8)


class Frame(NamedTuple):
    """The unknowns: their ``weights`` (size,), the number of those that are states, the ``sizes`` (k,) of the others."""

    weights: Vector
    states: int
    sizes: Vector


class Control(NamedTuple):
    """Settings; ``primary`` is the place of the primary parameter, or -1 where folds are not looked for.

    At a rate up to ``still`` it stands still.
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


class Attempt(NamedTuple):
    """The guess of a step, and numbers of it: ``sums`` that `contin.core.step.fill_sums` fills, ``judged`` from these."""

    guess: Vector
    sums: Vector
    judged: Vector


class Watch(NamedTuple):
    """What both ends of a step are compared in.

    ``branch_points``, ``eigenvalues`` are 1 where these are watched, and ``noisy`` where round-off of Newton's method was
    noted. ``places``, ``values``: free parameters that take these values at special points; ``sides`` is 0, or the side of a
    value that is a limit. ``low`` and ``high`` are the limits of the free parameters; ``home`` is the first point of the run,
    and ``closing`` the weights by which the distance to it is measured, of its last unknowns.
    """

    branch_points: int
    eigenvalues: int
    noisy: int
    places: IndexVector
    values: Vector
    sides: Vector
    low: Vector
    high: Vector
    home: Vector
    closing: Vector


class Path(NamedTuple):
    """Points one by one: row 1 is where a call begins, row 0 has the tangent before. ``numbers`` are described above."""

    x: Matrix
    tangents: Matrix
    numbers: Matrix


@helper
def predict(attempt: Attempt, path: Path, number: int, bend: float, step: float) -> None:
    """Fill in the guess of a step, as `contin.core.step.predict`; ``bend`` is 0 at the first step."""
    x, tangent, earlier, new = path.x[number - 1], path.tangents[number - 1], path.tangents[number - 2], path.x[number]
    for i in range(x.size):
        attempt.guess[i] = x[i] + step * tangent[i]
        if bend > 0:
            attempt.guess[i] += step * step * bend * (tangent[i] - earlier[i])
        new[i] = attempt.guess[i]


@helper
def judge(frame: Frame, attempt: Attempt, control: Control, path: Path, number: int, bend: float, step: float) -> int:
    """Return whether a corrected point can be believed by itself, as in `contin.continuation.steps`."""
    x, tangent, earlier = path.x[number - 1], path.tangents[number - 1], path.tangents[number - 2]
    new, new_tangent, sums, judged = path.x[number], path.tangents[number], attempt.sums, attempt.judged
    fill_sums_of(x, tangent, new, new_tangent, attempt.guess, frame.weights, frame.states, sums)
    judged[MISSED], judged[LENGTH] = missed_of(sums[0], sums[6], sums[3], sums[4]), math.sqrt(sums[5])
    judged[TURN] = turned(sums[1], sums[2], sums[3], sums[4])
    if not (judged[TURN] <= control.angle and judged[MISSED] <= ASTRAY * control.accuracy * step):
        return FAILED
    at = control.primary
    if at < 0:
        return BELIEVED
    change = max(abs(tangent[at]), abs(new_tangent[at]))
    if bend > 0:
        change = max(change, abs(earlier[at]))
    astray = is_astray(abs(attempt.guess[at] - new[at]), step * change, judged[ERROR], new[at])
    if not astray or abs(new_tangent[at]) <= control.still:
        return BELIEVED
    return FAILED if abs(new_tangent[at]) >= CLEAR else ASKS


@helper
def first_length(frame: Frame, control: Control, watch: Watch, path: Path, number: int, bend: float) -> float:
    """Return the length of a step, not far beyond limits, as `contin.core.step.up_to_limits`."""
    x, tangent, earlier = path.x[number - 1], path.tangents[number - 1], path.tangents[number - 2]
    step: float = path.numbers[number - 1, NEXT]
    for k in range(watch.low.size):
        at, size = frame.states + k, frame.sizes[k]
        rate, value = tangent[at] * size, x[at] * size
        limit = watch.high[k] if rate > 0 else watch.low[k]
        if abs(limit) < math.inf:
            curved = bend * (rate - earlier[at] * size) if bend > 0 else 0.0
            step = up_to(step, rate, curved, limit - value)
    return max(step, control.shortest)


@helper
def asks(
    frame: Frame, attempt: Attempt, control: Control, watch: Watch, path: Path, accepted: int, number: int, step: float
) -> bool:
    """Return whether an entry of the watch list asks for a closer look: all but those of branch points and eigenvalues.

    Whether the first point may be near is put into the numbers.
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
            return True
    now[CLOSES] = 0.0
    if accepted + number - 2 >= FEWEST:
        one, other, begin = 0.0, 0.0, size - watch.home.size
        for i in range(watch.home.size):
            one += watch.closing[i] * (watch.home[i] - x[begin + i]) ** 2
            other += watch.closing[i] * (watch.home[i] - new[begin + i]) ** 2
        now[CLOSES] = 0.0 if math.sqrt(one) + math.sqrt(other) > REACH * step else 1.0
        rates, new_rates = path.tangents[number - 1], path.tangents[number]
        for i in range(frame.states, size):
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
    first, last, mean = sense * first, sense * last / attempt.sums[1], sense * (new[at] - x[at]) / step
    slope, square = 6 * mean - 4 * first - 2 * last, 3 * first + 3 * last - 6 * mean
    return dips(first, last, slope, square) or ends_low(first, last, slope, square)


@helper
def accept(frame: Frame, attempt: Attempt, control: Control, path: Path, number: int, step: float, bend: float) -> None:
    """Fill in the numbers of a step, with the next one, as `contin.continuation.steps`."""
    judged, had, now = attempt.judged, path.numbers[number - 1], path.numbers[number]
    x, new, tangent, longest = path.x[number - 1], path.x[number], path.tangents[number], control.longest
    for k in range(frame.states, new.size):
        longest = longest_step(longest, control.change, new[k], tangent[k])
    now[STEP], now[SIGN_OF], now[ARCLENGTH] = step, judged[SIGN], had[ARCLENGTH] + judged[LENGTH]
    now[NEXT] = following_step(
        step, judged[MISSED], judged[TURN], 3 if bend > 0 else 2, control.accuracy, control.angle, control.shortest, longest
    )
    now[ITERATIONS], now[ERROR_LEFT], now[SENSE], now[SENSED] = judged[UPDATES], judged[ERROR], had[SENSE], had[SENSED]
    now[MESH_ERROR] = judged[OF_MESH]
    at = control.primary
    if at >= 0 and abs(new[at] - x[at]) > STANDS * (1 + abs(new[at])) and abs(tangent[at]) > control.still:
        now[SENSE], now[SENSED] = math.copysign(1.0, tangent[at]), number
