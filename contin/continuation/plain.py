"""Plain steps of small problems without a mesh: one call of a kernel makes many, up to the first that asks for a closer look.

Each is made as `contin.continuation.run` makes it, by the same rules, and watched as by `contin.detection.watch`. Where an
entry of the watch list asks, or round-off would have to decide, the call ends before the step, and the run makes it.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from contin.detection.crossings import CALM, NEAR_ONE
from contin.detection.folds import dips, ends_low
from contin.detection.inspection import FEWEST, REACH
from contin.detection.segment import LEAST_COSINE
from contin.detection.significance import STANDS
from contin.detection.spectra import FIRST, LAST, Spectra, fill_cubic, fill_spectrum, may_double_or_twist, may_pass_axis
from contin.discretization.scales import USUAL
from contin.functions.kernel import kernel
from contin.functions.kernel_parts import IndexVector, Matrix, Stack, Vector, helper
from contin.linalg.ends import is_near_one
from contin.linalg.small import solve_small
from contin.linalg.spectrum import fill_eigenvalues
from contin.stepping.small import (
    ASKS,
    BELIEVED,
    ERROR,
    FAILED,
    SIGN,
    UPDATES,
    Equations,
    Linear,
    correct_point,
    evaluate_slopes,
    fill_matrix,
)
from contin.stepping.step import ASTRAY, CLEAR, fill_sums_of, following_step, is_astray, longest_step, turned, up_to

#: Round-off of Newton's method above the tolerance is noted from this error on: ten times smaller, runs in small units that
#: soon change would be.
NOISY = 1e-9
#: Numbers of a row of `Path`: the step made and the next one; the determinant's sign, the arclength, Newton's updates and the
#: error that they left; the sense of the primary parameter, and the row where it was told, 0 where that is none of these.
STEP, NEXT, SIGN_OF, ARCLENGTH, ITERATIONS, ERROR_LEFT, SENSE, SENSED, NUMBERS = range(9)


class Control(NamedTuple):
    """Settings; ``primary`` is the place of the primary parameter, or -1 where folds are not looked for."""

    tolerance: float
    most: int
    accuracy: float
    angle: float
    change: float
    shortest: float
    longest: float
    primary: int


class Attempt(NamedTuple):
    """The guess of a step, and numbers of it: ``sums`` that `contin.stepping.step.fill_sums` fills, ``judged`` from these."""

    guess: Vector
    sums: Vector
    judged: Vector


#: Places in ``Attempt.judged``, as in `contin.stepping.step.Judgement`.
MISSED, TURN, LENGTH = range(3)


class Watch(NamedTuple):
    """What both ends of a step are compared in.

    ``branch_points``, ``eigenvalues`` are 1 where these are watched, and ``noisy`` where round-off of Newton's method was
    noted. ``places``, ``values``: unknowns that take these values at special points; ``sides`` is 0, or the side of a value
    that is a limit. ``low`` and ``high`` are the limits of the free parameters; ``home`` is the first point of the run, and
    ``closing`` the weights by which the distance to it is measured.
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


class Quotient(NamedTuple):
    """The matrix [F_x; row] at the beginning of a step, its quotient with that at the end, and room for eigenvalues."""

    before: Matrix
    quotient: Matrix
    work: Matrix
    copy: Stack
    real: Matrix
    imaginary: Matrix


class Path(NamedTuple):
    """Points one by one: row 1 is where a call begins, row 0 has the tangent before. ``numbers`` are described above."""

    x: Matrix
    tangents: Matrix
    numbers: Matrix


class Rooms(NamedTuple):
    """All that the kernel works with and in, but for the path."""

    equations: Equations
    linear: Linear
    attempt: Attempt
    control: Control
    watch: Watch
    quotient: Quotient
    spectra: Spectra


@helper
def _attempted(
    equations: Equations, linear: Linear, attempt: Attempt, control: Control, path: Path, number: int, bend: float, step: float
) -> int:
    """Make one step of a given length, as far as it can be believed by itself; ``bend`` is 0 at the first step."""
    x, tangent, earlier = path.x[number - 1], path.tangents[number - 1], path.tangents[number - 2]
    new, new_tangent, target = path.x[number], path.tangents[number], step
    for i in range(x.size):
        attempt.guess[i] = x[i] + step * tangent[i]
        if bend > 0:
            attempt.guess[i] += step * step * bend * (tangent[i] - earlier[i])
        target += linear.row[i] * x[i]
        new[i] = attempt.guess[i]
    outcome = correct_point(equations, linear, control.tolerance, control.most, new, target, new_tangent)
    if outcome != BELIEVED:
        return outcome
    sums, judged = attempt.sums, attempt.judged
    fill_sums_of(x, tangent, new, new_tangent, attempt.guess, equations.weights, equations.states.shape[1], sums)
    judged[MISSED], judged[LENGTH] = math.sqrt(sums[0]), math.sqrt(sums[5])
    judged[TURN] = turned(sums[1], sums[2], sums[3], sums[4])
    if not (judged[TURN] <= control.angle and judged[MISSED] <= ASTRAY * control.accuracy * step):
        return FAILED
    at = control.primary
    if at < 0:
        return BELIEVED
    change = max(abs(tangent[at]), abs(new_tangent[at]))
    if bend > 0:
        change = max(change, abs(earlier[at]))
    if not is_astray(abs(attempt.guess[at] - new[at]), step * change, linear.found[ERROR], new[at]):
        return BELIEVED
    return FAILED if abs(new_tangent[at]) >= CLEAR else ASKS


@helper
def _made(
    equations: Equations, linear: Linear, attempt: Attempt, control: Control, watch: Watch, path: Path, number: int, bend: float
) -> float:
    """Predict and correct, halving the step until its end can be believed; return its length, 0 where that is not decided."""
    x, tangent, earlier = path.x[number - 1], path.tangents[number - 1], path.tangents[number - 2]
    n, largest = equations.states.shape[1], 0.0
    for i in range(x.size):
        largest = max(largest, abs(x[i]))
    if not largest <= USUAL[1] and not equations.is_map:
        return 0.0  # sizes may grow
    step: float = path.numbers[number - 1, NEXT]
    for k in range(watch.low.size):
        size = equations.sizes[n + k]
        rate, value = tangent[n + k] * size, x[n + k] * size
        limit = watch.high[k] if rate > 0 else watch.low[k]
        if abs(limit) < math.inf:
            curved = bend * (rate - earlier[n + k] * size) if bend > 0 else 0.0
            step = up_to(step, rate, curved, limit - value)
    step = max(step, control.shortest)
    while True:
        outcome = _attempted(equations, linear, attempt, control, path, number, bend, step)
        if outcome == BELIEVED:
            return step
        step /= 2
        if outcome != FAILED or step < control.shortest:
            return 0.0


@helper
def _asks(rooms: Rooms, path: Path, accepted: int, number: int, step: float) -> bool:
    """Return whether an entry of the watch list asks for a closer look: all but those of eigenvalues."""
    equations, linear, attempt, control, watch, quotient, _ = rooms
    x, new, had, size = path.x[number - 1], path.x[number], path.numbers[number - 1], path.x.shape[1]
    if had[SIGN_OF] != linear.found[SIGN]:
        return True
    if linear.found[ERROR] > max(control.tolerance, NOISY) and not watch.noisy:
        return True
    for k in range(watch.places.size):
        at = watch.places[k]
        first, last = x[at] * equations.sizes[at] - watch.values[k], new[at] * equations.sizes[at] - watch.values[k]
        if not (first < 0 > last or first > 0 < last) or last * watch.sides[k] > 0:
            return True
    if accepted + number - 2 >= FEWEST:
        one, other = 0.0, 0.0
        for i in range(size):
            one += watch.closing[i] * (watch.home[i] - x[i]) ** 2
            other += watch.closing[i] * (watch.home[i] - new[i]) ** 2
        if not math.sqrt(one) + math.sqrt(other) > REACH * step:
            return True
    if control.primary >= 0 and _may_turn(attempt, control, path, number, step):
        return True
    return watch.branch_points != 0 and not _calm(linear, quotient)


@helper
def _may_turn(attempt: Attempt, control: Control, path: Path, number: int, step: float) -> bool:
    """Return whether the primary parameter may turn, as `contin.detection.folds.may_turn`."""
    at, x, new = control.primary, path.x[number - 1], path.x[number]
    first, last = path.tangents[number - 1, at], path.tangents[number, at]
    if not (min(abs(first), abs(last)) >= CLEAR and first * last > 0 and path.numbers[number - 1, SENSE] * last >= 0):
        return True
    sense = math.copysign(1.0, first)
    first, last, mean = sense * first, sense * last / attempt.sums[1], sense * (new[at] - x[at]) / step
    slope, square = 6 * mean - 4 * first - 2 * last, 3 * first + 3 * last - 6 * mean
    return dips(first, last, slope, square) or ends_low(first, last, slope, square)


@helper
def _calm(linear: Linear, quotient: Quotient) -> bool:
    """Return whether no singular value comes near zero, as `contin.detection.crossings.calm`."""
    size = linear.row.size
    for i in range(size):
        column = quotient.quotient[i]
        for j in range(size):
            column[j] = quotient.before[j, i]
        solve_small(linear.lu, linear.exchanges, column)
    if is_near_one(quotient.quotient, NEAR_ONE, CALM, quotient.work):
        return True
    for i in range(size):
        for j in range(size):
            quotient.copy[0, i, j] = quotient.quotient[i, j]
    fill_eigenvalues(quotient.copy, quotient.real, quotient.imaginary)
    for i in range(size):
        distance = math.hypot(quotient.real[0, i], quotient.imaginary[0, i])
        if not (quotient.real[0, i] > 0 and 1 / CALM < distance < CALM):
            return False
    return True


@helper
def _eigenvalues_ask(equations: Equations, attempt: Attempt, spectra: Spectra, path: Path, number: int, step: float) -> bool:
    """Return whether eigenvalues, or multipliers of a map, ask for a closer look."""
    if fill_spectrum(equations, spectra, LAST):
        return True
    rate = step / max(attempt.sums[1], LEAST_COSINE)
    x, tangent, new, new_tangent = path.x[number - 1], path.tangents[number - 1], path.x[number], path.tangents[number]
    fill_cubic(spectra, x, tangent, new, new_tangent, step, rate)
    return may_double_or_twist(equations, spectra) if equations.is_map else may_pass_axis(equations, spectra)


@helper
def _accept(
    equations: Equations, linear: Linear, attempt: Attempt, control: Control, path: Path, number: int, step: float, bend: float
) -> None:
    """Fill in the numbers of a step, with the next one, as `contin.continuation.run.Continuation` does."""
    judged, found, had, now = attempt.judged, linear.found, path.numbers[number - 1], path.numbers[number]
    x, new, tangent, longest = path.x[number - 1], path.x[number], path.tangents[number], control.longest
    for k in range(equations.states.shape[1], new.size):
        longest = longest_step(longest, control.change, new[k], tangent[k])
    now[STEP], now[SIGN_OF], now[ARCLENGTH] = step, found[SIGN], had[ARCLENGTH] + judged[LENGTH]
    now[NEXT] = following_step(
        step, judged[MISSED], judged[TURN], 3 if bend > 0 else 2, control.accuracy, control.angle, control.shortest, longest
    )
    now[ITERATIONS], now[ERROR_LEFT], now[SENSE], now[SENSED] = found[UPDATES], found[ERROR], had[SENSE], had[SENSED]
    at = control.primary
    if at >= 0 and abs(new[at] - x[at]) > STANDS * (1 + abs(new[at])):
        now[SENSE], now[SENSED] = math.copysign(1.0, tangent[at]), number


@kernel(reorder=False, last=True)
def plain_steps(rooms: Rooms, path: Path, accepted: int, bent: int) -> int:
    """Make plain steps from row 1 of the path, up to its end or the first step that asks; return how many.

    ``accepted`` is the number of regular points up to row 1, ``bent`` 1 where row 0 has a tangent.
    """
    equations, linear, attempt, control, watch, quotient, spectra = rooms
    evaluate_slopes(equations, path.x[1])
    fill_matrix(equations, path.tangents[1], linear.matrix)
    if watch.eigenvalues and fill_spectrum(equations, spectra, LAST):
        return 0
    rows: int = path.x.shape[0]
    for number in range(2, rows):
        x, tangent, had, now = path.x[number - 1], path.tangents[number - 1], path.numbers[number - 1], path.numbers[number]
        size = x.size
        for i in range(size):
            linear.row[i] = equations.weights[i] * tangent[i]
        for i in range(size):
            for j in range(size):
                quotient.before[i, j] = linear.matrix[i, j] if i < size - 1 else linear.row[j]
        for i in range(spectra.real.shape[1]):
            spectra.real[FIRST, i], spectra.imaginary[FIRST, i] = spectra.real[LAST, i], spectra.imaginary[LAST, i]
        bend = 0.5 / had[STEP] if number > 2 or bent else 0.0
        step = _made(equations, linear, attempt, control, watch, path, number, bend)
        if step == 0.0 or _asks(rooms, path, accepted, number, step):
            return number - 2
        if watch.eigenvalues and _eigenvalues_ask(equations, attempt, spectra, path, number, step):
            return number - 2
        _accept(equations, linear, attempt, control, path, number, step, bend)
        if control.primary >= 0 and now[SENSE] == 0.0:
            return number - 2
    return rows - 2
