"""Plain steps of small problems without a mesh: one call of a kernel makes many, up to the first that asks for a closer look.

Each is made as `contin.continuation.run` makes it, by the same rules, and watched as by `contin.events.inspection`. Where an
entry of the watch list asks, or round-off would have to decide, the call ends before the step, and the run makes it.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from contin.continuation import rules
from contin.continuation.rules import Attempt, Control, Frame, Path, Watched
from contin.core import small
from contin.core.small import Equations, Linear
from contin.core.system import USUAL
from contin.events.arc import LEAST_COSINE
from contin.events.crossings import CALM, NEAR_ONE
from contin.events.spectra import FIRST, LAST, Spectra, fill_cubic, fill_spectrum, may_double_or_twist, may_pass_axis
from contin.kernels.kernel import kernel
from contin.kernels.kernel_parts import Matrix, Stack, helper
from contin.linalg.ends import is_near_one
from contin.linalg.small import fill_eigenvalues, solve_small


class Quotient(NamedTuple):
    """The matrix at the beginning of a step, its quotient with that at the end, and room for eigenvalues."""

    before: Matrix
    quotient: Matrix
    work: Matrix
    copy: Stack
    real: Matrix
    imaginary: Matrix


class Rooms(NamedTuple):
    """All that the kernel works with and in, but for the path."""

    equations: Equations
    linear: Linear
    frame: Frame
    attempt: Attempt
    control: Control
    watch: Watched
    quotient: Quotient
    spectra: Spectra


@helper
def _attempted(rooms: Rooms, path: Path, number: int, step: float) -> int:
    """Make one step of a given length, as far as it can be believed by itself."""
    equations, linear, frame, attempt, control, _, _, _ = rooms
    x, new, target = path.x[number - 1], path.x[number], step
    rules.fill_guess(attempt, path, number, step)
    for i in range(x.size):
        target += linear.row[i] * x[i]
    outcome: int = small.correct_point(equations, linear, control.tolerance, control.most, new, target, path.tangents[number])
    if outcome != small.BELIEVED:
        return outcome
    judged, found = attempt.judged, linear.found
    judged[rules.SIGN], judged[rules.UPDATES], judged[rules.ERROR] = found[small.SIGN], found[small.UPDATES], found[small.ERROR]
    return rules.judge(frame, attempt, control, path, number, step)


@helper
def _made(rooms: Rooms, path: Path, number: int) -> float:
    """Predict and correct, halving the step until its end can be believed; return its length, 0 where that is not decided."""
    x, largest = path.x[number - 1], 0.0
    for i in range(x.size):
        largest = max(largest, abs(x[i]))
    if not largest <= USUAL[1] and not rooms.equations.is_map:
        return 0.0  # sizes may grow
    step = rules.first_length(rooms.frame, rooms.control, path, number)
    while True:
        outcome = _attempted(rooms, path, number, step)
        if outcome == small.BELIEVED:
            return step
        step /= 2
        if outcome == small.ASKS or step < rooms.control.shortest:
            return 0.0


@helper
def calm(quotient: Quotient) -> bool:
    """Return whether no singular value comes near zero, by the quotient, as `contin.events.crossings.changes_little`."""
    if is_near_one(quotient.quotient, NEAR_ONE, CALM, quotient.work):
        return True
    size = quotient.quotient.shape[0]
    for i in range(size):
        for j in range(size):
            quotient.copy[0, i, j] = quotient.quotient[i, j]
    fill_eigenvalues(quotient.copy, quotient.copy.shape[1], quotient.real, quotient.imaginary)
    for i in range(size):
        distance = math.hypot(quotient.real[0, i], quotient.imaginary[0, i])
        if not (quotient.real[0, i] > 0 and 1 / CALM < distance < CALM):
            return False
    return True


@helper
def _calm(linear: Linear, quotient: Quotient) -> bool:
    """Return whether no singular value of [F_x; row] comes near zero."""
    size = linear.row.size
    for i in range(size):
        column = quotient.quotient[i]
        for j in range(size):
            column[j] = quotient.before[j, i]
        solve_small(linear.lu, linear.exchanges, column)
    return calm(quotient)


@helper
def _eigenvalues_ask(equations: Equations, attempt: Attempt, spectra: Spectra, path: Path, number: int, step: float) -> bool:
    """Return whether eigenvalues, or multipliers of a map, ask for a closer look."""
    if fill_spectrum(equations, spectra, LAST):
        return True
    rate = step / max(attempt.judged[rules.COSINE], LEAST_COSINE)
    x, tangent, new, new_tangent = path.x[number - 1], path.tangents[number - 1], path.x[number], path.tangents[number]
    fill_cubic(spectra, x, tangent, new, new_tangent, step, rate)
    return may_double_or_twist(equations, spectra) if equations.is_map else may_pass_axis(equations, spectra)


@kernel(reorder=False, last=True)
def plain_steps(rooms: Rooms, path: Path, accepted: int) -> int:
    """Make plain steps from row 1 of the path, up to its end or the first step that asks; return how many.

    ``accepted`` is the number of regular points up to row 1.
    """
    equations, linear, frame, attempt, control, watch, quotient, spectra = rooms
    small.evaluate(equations, path.x[1], equations.slopes, equations.slopes_found)
    small.fill_matrix(equations, path.tangents[1], linear.matrix)
    if watch.eigenvalues and fill_spectrum(equations, spectra, LAST):
        return 0
    rows: int = path.x.shape[0]
    for number in range(2, rows):
        tangent, now, size = path.tangents[number - 1], path.numbers[number], path.x.shape[1]
        for i in range(size):
            linear.row[i] = frame.weights[i] * tangent[i]
        for i in range(size):
            for j in range(size):
                quotient.before[i, j] = linear.matrix[i, j] if i < size - 1 else linear.row[j]
        for i in range(spectra.real.shape[1]):
            spectra.real[FIRST, i], spectra.imaginary[FIRST, i] = spectra.real[LAST, i], spectra.imaginary[LAST, i]
        step = _made(rooms, path, number)
        if step == 0.0 or rules.asks(frame, attempt, control, watch, path, accepted, number, step) or now[rules.PASSES] == 1.0:
            return number - 2
        if watch.branch_points and not _calm(linear, quotient):
            return number - 2
        if watch.eigenvalues and _eigenvalues_ask(equations, attempt, spectra, path, number, step):
            return number - 2
        rules.accept(frame, attempt, control, path, number, step)
        if control.primary >= 0 and now[rules.SENSE] == 0.0:
            return number - 2
    return rows - 2
