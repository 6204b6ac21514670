"""Newton's method and the tangent inside kernels, for small problems without a mesh whose functions are recorded.

The rules are those of `contin.stepping.newton` and `contin.stepping.step`. What would have to be told from round-off is left
to them: `attempt` returns `ASKS` then.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from contin.arrays import Array
from contin.discretization.algebraic import Algebraic
from contin.discretization.maps import MapSystem
from contin.functions.interpreter import LANES, Instructions, Points, Room, evaluate
from contin.functions.kernel_parts import IndexVector, Matrix, Stack, Vector, helper
from contin.functions.program import Program
from contin.linalg.small import factor_small, solve_small
from contin.stepping.newton import STAGNANT, diverges, estimated_rate, has_converged, stagnates, wants_jacobian
from contin.stepping.settings import Settings
from contin.stepping.step import ASTRAY, CLEAR, fill_sums_of, is_astray, turned

#: What came of an attempt: a step to be believed; one to be halved; one that is not decided here.
BELIEVED, HALVED, ASKS = range(3)


class Recorded(NamedTuple):
    """A program as `contin.functions.interpreter.evaluate` takes it; ``at``: where its parameters stand among the scalars."""

    instructions: Instructions
    first: int
    last: int
    room: Room
    at: int


class Equations(NamedTuple):
    """F(x) = 0, as `contin.discretization.algebraic` and `contin.discretization.maps` have it, and room to evaluate it in.

    ``sizes`` (size,) and ``rows`` (equations,) are scales; ``parameters`` are all of them, ``free`` the places of the free
    ones. Of a map, ``is_map`` is 1 and ``gain`` what angles gain: F is the function less u and ``gain``.
    """

    values: Recorded
    slopes: Recorded
    sizes: Vector
    rows: Vector
    weights: Vector
    gain: Vector
    is_map: int
    parameters: Vector
    free: IndexVector
    time: Vector
    states: Matrix
    none: Matrix
    found: Matrix
    slopes_found: Stack
    no_slopes: Stack


class Linear(NamedTuple):
    """The matrix [F_x; row], its factors, and vectors: an update, and the guess from which Newton's method began.

    ``sums`` is filled by `contin.stepping.step.fill_sums`, ``judged`` by `attempt`.
    """

    matrix: Matrix
    lu: Matrix
    exchanges: IndexVector
    row: Vector
    update: Vector
    guess: Vector
    sums: Vector
    judged: Vector


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


#: Places in ``Linear.judged``: sign of the determinant, updates, the error that they left, and what `Judgement` holds.
SIGN, UPDATES, ERROR, MISSED, TURN, LENGTH = range(6)


def recorded(program: Program) -> Recorded:
    """Return a program with registers of its own."""
    room = Room(np.empty(program.registers * LANES), np.empty((max(program.unknowns, 1), program.unknowns + 1)))
    instructions = Instructions(program.code, program.lists, program.scalars.copy(), program.tables)
    return Recorded(instructions, program.first, program.last, room, program.parameters)


def equations_of(system: Algebraic) -> Equations:
    """Return the equations of a problem whose functions are recorded, of a map with one round."""
    is_map, n, size = isinstance(system, MapSystem), system.state_size, system.size
    batch: Any = system.problem.batch("map" if is_map else "residual")
    columns = batch.columns(system._free)
    return Equations(
        recorded(batch._values_program()), recorded(batch._slopes(columns.key)[0]),
        system.unscaled_factors, np.ones(system.equations) if system.scales is None else system.scales.rows["residual"],
        system.weights,
        system.gain if isinstance(system, MapSystem) else np.zeros(system.equations), int(is_map),
        system.parameters.copy(), system._free, np.zeros(1), np.empty((1, n)), np.empty((0, n)),
        np.empty((1, system.equations)), np.zeros((1, system.equations, size)), np.empty((0, 0, 0)),
    )  # fmt: skip


def linear_of(size: int) -> Linear:
    """Return the room for a matrix of this size."""
    row, update, guess = np.empty((3, size))
    lu, exchanges = np.empty((size, size)), np.empty(size, dtype=np.int64)
    return Linear(np.empty((size, size)), lu, exchanges, row, update, guess, np.empty(6), np.empty(LENGTH + 1))


def control_of(settings: Settings, primary: int) -> Control:
    """Return the settings as kernels take them."""
    newton = settings.newton
    return Control(
        newton.tolerance, newton.max_iterations, settings.accuracy, settings.angle, settings.change, settings.min_step,
        settings.max_step, primary,
    )  # fmt: skip


@helper
def put(equations: Equations, x: Array) -> None:
    """Put states and free parameters of x, in the user's units, where functions find them."""
    n = equations.states.shape[1]
    for i in range(n):
        equations.states[0, i] = x[i] * equations.sizes[i]
    for k in range(equations.free.size):
        equations.parameters[equations.free[k]] = x[n + k] * equations.sizes[n + k]


@helper
def evaluate_values(equations: Equations, x: Array) -> None:
    """Evaluate the functions."""
    put(equations, x)
    code, points = equations.values, Points(equations.time, equations.states, equations.none)
    for i in range(equations.parameters.size):
        code.instructions.scalars[code.at + i] = equations.parameters[i]
    evaluate(code.instructions, code.first, code.last, points, code.room, equations.found, equations.no_slopes)


@helper
def evaluate_slopes(equations: Equations, x: Array) -> None:
    """Evaluate the functions and their derivatives by the unknowns."""
    put(equations, x)
    code, points = equations.slopes, Points(equations.time, equations.states, equations.none)
    for i in range(equations.parameters.size):
        code.instructions.scalars[code.at + i] = equations.parameters[i]
    evaluate(code.instructions, code.first, code.last, points, code.room, equations.found, equations.slopes_found)


@helper
def fill_residual(equations: Equations, right: Array) -> None:
    """Fill in F from what was evaluated."""
    for i in range(equations.rows.size):
        value = equations.found[0, i]
        if equations.is_map:
            value -= equations.states[0, i] + equations.gain[i]
        right[i] = value / equations.rows[i]


@helper
def fill_matrix(equations: Equations, row: Array, matrix: Array) -> None:
    """Fill in [F_x; row] from what was evaluated."""
    size = row.size
    for i in range(size - 1):
        for j in range(size):
            matrix[i, j] = equations.slopes_found[0, i, j] * equations.sizes[j] / equations.rows[i]
        if equations.is_map:
            matrix[i, i] -= 1.0
    for j in range(size):
        matrix[size - 1, j] = row[j]


@helper
def linearize(equations: Equations, linear: Linear, x: Array) -> float:
    """Factor [F_x; row] at x; return the sign of its determinant."""
    evaluate_slopes(equations, x)
    fill_matrix(equations, linear.row, linear.matrix)
    return factor_small(linear.matrix, linear.lu, linear.exchanges)


@helper
def correct_small(equations: Equations, linear: Linear, control: Control, x: Array, target: float) -> int:
    """Solve F(x) = 0 and row.x = target by Newton's method and chord steps, in place."""
    size, fresh, moved, before, now = x.size, True, 1.0, math.inf, math.inf
    for number in range(1, control.most + 1):
        if fresh:
            if linearize(equations, linear, x) == 0.0:
                now = math.inf
                break
        else:
            evaluate_values(equations, x)
        fill_residual(equations, linear.update)
        missing = -target
        for i in range(size):
            missing += linear.row[i] * x[i]
        linear.update[size - 1] = missing
        solve_small(linear.lu, linear.exchanges, linear.update)
        now = 0.0
        for i in range(size):
            part = abs(linear.update[i]) / (1 + abs(x[i]))
            if not part <= now:
                now = part
            x[i] -= linear.update[i]
            if not now < math.inf:
                break
        if not now < math.inf:
            break
        moved = now if fresh else moved + now
        rate = estimated_rate(now, before, moved, fresh)
        if has_converged(now, rate, number, control.tolerance):
            linear.judged[UPDATES], linear.judged[ERROR] = number, now * rate
            return BELIEVED
        if stagnates(now, rate, number):
            return ASKS
        if number > 2 and diverges(now, before):
            break
        fresh, before = wants_jacobian(now, rate, control.tolerance), now
    return ASKS if now <= STAGNANT else HALVED


@helper
def attempt(
    equations: Equations, linear: Linear, control: Control, x: Array, tangent: Array, earlier: Array, bend: float, step: float,
    new: Array, new_tangent: Array,
) -> int:  # fmt: skip
    """Make one step from x, as far as it can be believed by itself; fill in its end, with the tangent right there.

    ``bend`` is 1 / (2 times the step before), or 0 without one; ``earlier`` the tangent before that. ``linear.row`` belongs to
    the tangent.
    """
    size, target = x.size, step
    for i in range(size):
        linear.guess[i] = x[i] + step * tangent[i]
        if bend > 0:
            linear.guess[i] += step * step * bend * (tangent[i] - earlier[i])
        target += linear.row[i] * x[i]
        new[i] = linear.guess[i]
    outcome = correct_small(equations, linear, control, new, target)
    if outcome != BELIEVED:
        return outcome
    sign = linearize(equations, linear, new)
    fill_residual(equations, linear.update)
    total = 0.0
    for i in range(size - 1):
        total += abs(linear.update[i])
    if sign == 0.0 or not total < math.inf:
        return HALVED
    along(equations, linear, new_tangent)
    fill_sums_of(x, tangent, new, new_tangent, linear.guess, equations.weights, equations.states.shape[1], linear.sums)
    missed, turn = math.sqrt(linear.sums[0]), turned(linear.sums[1], linear.sums[2], linear.sums[3], linear.sums[4])
    if not (turn <= control.angle and missed <= ASTRAY * control.accuracy * step):
        return HALVED
    linear.judged[SIGN], linear.judged[MISSED], linear.judged[TURN] = sign, missed, turn
    linear.judged[LENGTH] = math.sqrt(linear.sums[5])
    at = control.primary
    if at >= 0:
        change = max(abs(tangent[at]), abs(new_tangent[at]))
        if bend > 0:
            change = max(change, abs(earlier[at]))
        if is_astray(abs(linear.guess[at] - new[at]), step * change, linear.judged[ERROR], new[at]):
            return HALVED if abs(new_tangent[at]) >= CLEAR else ASKS
    return BELIEVED


@helper
def along(equations: Equations, linear: Linear, tangent: Array) -> None:
    """Fill in the unit tangent from the factors."""
    size = tangent.size
    for i in range(size - 1):
        tangent[i] = 0.0
    tangent[size - 1] = 1.0
    solve_small(linear.lu, linear.exchanges, tangent)
    square = 0.0
    for i in range(size):
        square += equations.weights[i] * tangent[i] * tangent[i]
    length = math.sqrt(square)
    for i in range(size):
        tangent[i] /= length
