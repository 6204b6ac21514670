"""A plain step on a mesh: what kernels make and compare of it.

It is made as `contin.continuation.run` makes it, by the same rules, and watched as by `contin.events.inspection`. Each of these
kernels is called once a step; `contin.continuation.lane` ends where one of them asks for a closer look.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from contin.arrays import Array
from contin.collocation import newton as one_call
from contin.collocation.newton import Mesh, Workspace
from contin.collocation.round import DRIFTED, KNOWN, Monodromy, fill_multipliers, nearest_to_one
from contin.continuation import rules
from contin.continuation.plain import Quotient, calm
from contin.continuation.rules import Attempt, Control, Frame, Path, Watched
from contin.core.newton import STAGNANT
from contin.core.small import ASKS, BELIEVED, FAILED
from contin.core.step import COLLAPSED
from contin.events.arc import LEAST_COSINE
from contin.events.crossings import TURN
from contin.events.dips import AS_FAR
from contin.events.spectra import (
    FIRST,
    LAST,
    Spectra,
    crosses,
    fill_cubic,
    fill_place,
    insert,
    keep_off_one,
    may_cross_between,
    passes_inside,
)
from contin.functions.interpreter import Points, run_loaded
from contin.kernels.kernel import kernel
from contin.kernels.kernel_parts import Matrix, Vector, helper
from contin.levels import APART
from contin.linalg.condensation import Factored
from contin.linalg.ends import Relations, divide_ends, relate_ends


@helper
def _product(row: Array, x: Array) -> float:
    total = 0.0
    for i in range(row.size):
        total += row[i] * x[i]
    return total


#: What multipliers say of a step: look closer; nothing; that a branch point or a fold may lie in it.
ASK, AWAY, MAY_BRANCH = range(3)
#: Where the multiplier that is 1 has drifted, logarithms of others are known to about as much: they are clear of the circle at
#: this many times that distance. Ten times smaller may be too near; ten times larger, more steps are looked at closely.
_CLEAR = 100.0
#: What condensed matrices say: nothing, as relations turn too much; that no singular value comes near zero; that one may.
TURNS, CALM, CHANGES = range(3)


class MeshRooms(NamedTuple):
    """Where steps on a mesh are made.

    ``amplitude`` (states,) takes a cycle to its size as a part of that of the reference; it is empty where solutions have none.
    """

    work: Workspace
    factored: Factored
    newton: one_call.Control
    report: Vector
    amplitude: Vector
    frame: Frame
    attempt: Attempt
    control: Control
    watch: Watched


@kernel(reorder=False, last=True)
def step_on_mesh(rooms: MeshRooms, path: Path, accepted: int, number: int) -> float:
    """Predict, correct and judge a step into row ``number`` of a path, halving it until it can be believed; accept it.

    Return its length, negative where the watch list asks; 0 where it is not decided here.
    """
    work, factored, newton, report, amplitude, frame, attempt, control, watch = rooms
    values, weights = work.values, frame.weights
    x, new, tangent, last = path.x[number - 1], path.x[number], path.tangents[number], values.rows.shape[0] - 1
    row, start, judged = values.rows[last], 0.0, attempt.judged
    for i in range(x.size):
        row[i] = weights[i] * path.tangents[number - 1, i]
        start += row[i] * x[i]
    step = rules.first_length(frame, control, path, number)
    low = COLLAPSED * abs(_product(amplitude, x))  # below it a cycle has become an equilibrium, as in `collapsed`
    while True:
        rules.fill_guess(attempt, path, number, step)
        values.targets[last] = start + step
        done, outcome = one_call.correct_on_mesh(work, factored, newton, new, weights, tangent, report), FAILED
        judged[rules.SIGN], judged[rules.UPDATES] = report[one_call.SIGN], report[one_call.ITERATIONS]
        judged[rules.ERROR] = report[one_call.ERROR]
        if done == one_call.STAGNATES:
            return 0.0
        if done == one_call.FAILED and report[one_call.UPDATES + int(report[one_call.ITERATIONS]) - 1] <= STAGNANT:
            return 0.0
        if done == one_call.CONVERGED and not (amplitude.size > 0 and abs(_product(amplitude, new)) < low):
            outcome = rules.judge(frame, attempt, control, path, number, step)
        if outcome == BELIEVED:
            break
        step /= 2
        if outcome == ASKS or step < control.shortest:
            return 0.0
    rules.accept(frame, attempt, control, path, number, step)
    if rules.asks(frame, attempt, control, watch, path, accepted, number, step):
        return -step
    if amplitude.size > 0 and not _product(amplitude, new) > 0:
        return -step
    return -step if control.primary >= 0 and path.numbers[number, rules.SENSE] == 0.0 else step


@kernel(reorder=False, last=True)
def rests(field: Matrix, n: int, still: float) -> int:
    """Return 1 where the least speed of a cycle, with these rates of n states, is not above this part of the largest."""
    least, largest = math.inf, 0.0
    for q in range(field.shape[0]):
        speed = 0.0
        for a in range(n):
            speed += field[q, a] * field[q, a]
        least, largest = min(least, speed), max(largest, speed)
    return 0 if math.sqrt(least) > still * math.sqrt(largest) else 1


@kernel(reorder=False, last=True)
def ends_are_calm(mesh: Mesh, factored: Factored, before: Relations, after: Relations, quotient: Quotient, begins: int) -> int:
    """Fill in what a matrix says of both ends of the mesh; return what follows for a step, as in `contin.events.crossings`.

    Where a step ``begins``, nothing is compared.
    """
    factors, _, first, last, carried, _ = factored
    relate_ends(mesh.layout.offsets, factors, carried, first, last, mesh.whole.starts, after)
    if begins or not divide_ends(before, after, quotient.quotient, quotient.work) < TURN:
        return TURNS
    return CALM if calm(quotient) else CHANGES


@helper
def _keeps(work: Workspace, room: Monodromy, spectra: Spectra, unknowns: Array, row: int) -> bool:
    """Keep the multipliers where it was linearized, but for the one that is 1, in a row; return whether all are clear."""
    codes, mesh, values = work
    n, at, jacobian = room.real.size, 0, values.jacobian
    for q in range(jacobian.shape[0]):
        for c in range(n):
            b = room.order[c]
            for a in range(n):
                room.jacobian[q, a, b] = jacobian[q, a, c]
    known = fill_multipliers(room, 0)
    if known == DRIFTED and room.starts[room.h.size] == room.h.size and not room.turn.shape[0]:
        for j in range(room.h.size):
            for a in range(n):
                room.ends[j, a] = unknowns[j * room.points.size * n + a]
        points = Points(mesh.times[: room.h.size], room.ends[: room.h.size], values.none)
        run_loaded(codes.field, values.p, points, room.flow[: room.h.size], values.nothing)
        known = fill_multipliers(room, 1)
    if known not in (KNOWN, DRIFTED):
        return False
    trivial, least = nearest_to_one(room) if room.autonomous else (-1, 0.0)
    clear = APART if known == KNOWN else _CLEAR * least
    for a in range(n):
        x, y = room.real[a], room.imaginary[a]
        if a == trivial:
            continue
        if not abs(x) >= clear or not math.hypot(x, y) > AS_FAR * least:
            return False
        insert(spectra.real[row], spectra.imaginary[row], at, x, y)
        at += 1
    return True


@kernel(reorder=False, last=True)
def multipliers_ask(
    work: Workspace, room: Monodromy, spectra: Spectra, attempt: Attempt, path: Path, number: int, step: float, longer: float
) -> int:
    """Return `ASK` where multipliers at a point that was linearized ask for a closer look at the step that ends there.

    `AWAY` where they do not, and none comes near 1. The end of the step before is its beginning, with a round that takes
    ``longer`` at its end by this factor; where that is 0, the step begins here and nothing is compared. Round-off on the circle
    asks, too. Where they may pass something between both ends, places inside are looked at, on the cubic.
    """
    codes, mesh, values = work
    before, x, new, clear = spectra.moved[0], path.x[number - 1], path.x[number], True
    if longer > 0.0:
        spectra.moved[0] = math.inf
    for a in range(spectra.real.shape[1]):
        spectra.real[FIRST, a], spectra.imaginary[FIRST, a] = spectra.real[LAST, a], spectra.imaginary[LAST, a]
    if not _keeps(work, room, spectra, new, LAST):
        return ASK
    if longer == 0.0:
        return AWAY
    if crosses(spectra):
        return ASK
    if may_cross_between(spectra, longer, before):
        rate = step / max(attempt.judged[rules.COSINE], LEAST_COSINE)
        fill_cubic(spectra, x, path.tangents[number - 1], new, path.tangents[number], step, rate)
        for place in range(FIRST + 1, LAST):
            if clear:
                fill_place(spectra, place)
                one_call.evaluate(codes, mesh, values, spectra.place, True)
                clear = _keeps(work, room, spectra, spectra.place, place)
        one_call.evaluate(codes, mesh, values, new, True)  # values are those at the end again
        for i in range(x.size):
            values.at[i] = new[i]
        if not clear or passes_inside(spectra, True, True):
            return ASK
    return AWAY if keep_off_one(spectra, longer) else MAY_BRANCH
