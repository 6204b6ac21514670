"""Newton's method and the tangent in a kernel, for small problems without a mesh whose functions are recorded.

The rules are those of `contin.core.newton`. Where round-off would have to tell whether it has converged, that is asked.
"""

from __future__ import annotations

import functools
import math
import threading
from typing import Any, NamedTuple

import numpy as np

from contin.arrays import Array
from contin.core.newton import STAGNANT, Newton
from contin.functions.batch import Batch
from contin.functions.interpreter import Loaded, Points, run_loaded
from contin.kernels.kernel import kernel
from contin.kernels.kernel_parts import IndexVector, Matrix, Stack, Vector, helper
from contin.linalg import convergence
from contin.linalg.convergence import FAR, judge_update, subtract
from contin.linalg.small import factor_small, solve_small

#: What came of it: a point or step to be believed; none; one that is not decided here.
BELIEVED, FAILED, ASKS = range(3)
#: Largest number of unknowns of a small problem, whose eigenvalues take less time than a step: from some fifty on, LAPACK's
#: factors are faster than those of a kernel.
SMALL = 33


class Equations(NamedTuple):
    """F(x) = 0, as `contin.equilibria.equations` and `contin.cycles.map_equations` have it, and room to evaluate it in.

    ``parameters`` are all of them, ``free`` the places of the free ones. ``rates`` (equations,) takes values to rates of states
    divided by their sizes, of u' = F. Of a map, ``is_map`` is 1 and ``gain`` (n,) what angles gain: F is the function of each
    of the ``states`` (rounds, n) less the next one, the last time less the first one and ``gain``.
    """

    values: Loaded
    slopes: Loaded
    weights: Vector
    rates: Vector
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
    """The matrix [F_x; row], its factors, an update, and ``found``: sign of the determinant, updates, error left, last one."""

    matrix: Matrix
    lu: Matrix
    exchanges: IndexVector
    row: Vector
    update: Vector
    found: Vector


#: Places in ``Linear.found``.
SIGN, UPDATES, ERROR, SIZE = range(4)


def equations_of(system: Any) -> Equations | None:
    """Return the equations of a small problem whose functions are recorded, of a map with one round; None of others."""
    batch: Batch | None = system.small_equations
    if batch is None or batch.interpreted is not None or system.size > SMALL or system.size != system.equations + 1:
        return None
    count, size, gain = system.equations, system.size, system.gain
    rounds, n = system.states(np.zeros(size)).shape
    values = count // rounds
    rates = system.scales.rows["residual"] / system.scales.states if values == n else np.ones(values)
    return Equations(
        batch.load(), batch.load(batch.columns(system._free)), system.weights, rates,
        np.zeros(values) if gain is None else gain, int(gain is not None), system.scaled_parameters(np.zeros(size)),
        system._free, np.zeros(rounds), np.empty((rounds, n)), np.empty((0, n)), np.empty((rounds, values)),
        np.zeros((rounds, values, n + len(system.free))), np.empty((0, 0, 0)),
    )  # fmt: skip


def linear_of(size: int) -> Linear:
    """Return the room for a matrix of this size."""
    (matrix, lu), (row, update) = np.empty((2, size, size)), np.empty((2, size))
    return Linear(matrix, lu, np.empty(size, dtype=np.int64), row, update, np.empty(SIZE + 1))


@functools.lru_cache(maxsize=16)
def _rooms(system: Any, thread: int) -> tuple[Equations, Linear] | None:
    """Return where a thread corrects points of a system; None where kernels do not."""
    equations = equations_of(system)
    return None if equations is None else (equations, linear_of(system.size))


class Found(NamedTuple):
    """A corrected point: x, unit tangent, the matrix [F_x; row] right there and the sign of its determinant.

    With the iterations of Newton's method, and the error that they left.
    """

    x: Array
    tangent: Array
    matrix: Array
    sign: float
    iterations: int
    error: float


def corrected_small(system: Any, guess: Array, row: Array, target: float | Array, newton: Newton) -> Found | None:
    """Solve F(x) = 0 and row.x = target; None where the kernel does not, or does not decide whether it has."""
    rooms = _rooms(system, threading.get_ident())
    if rooms is None:
        return None
    x, tangent, linear = np.array(guess, dtype=float), np.empty(guess.size), rooms[1]
    linear.row[:] = row
    if correct_point(*rooms, newton.tolerance, newton.max_iterations, x, float(target), tangent) != BELIEVED:
        return None
    sign, iterations, error, _ = linear.found.tolist()
    return Found(x, tangent, linear.matrix.copy(), sign, int(iterations), error)


@helper
def put(equations: Equations, x: Array) -> None:
    """Put states and free parameters of x where functions find them."""
    rounds, n = equations.states.shape
    for j in range(rounds):
        for i in range(n):
            equations.states[j, i] = x[j * n + i]
    for k in range(equations.free.size):
        equations.parameters[equations.free[k]] = x[rounds * n + k]


@helper
def evaluate(equations: Equations, x: Array, functions: Loaded, slopes: Stack) -> None:
    """Evaluate the functions, and their derivatives by the unknowns where ``functions`` have them."""
    put(equations, x)
    points = Points(equations.time, equations.states, equations.none)
    run_loaded(functions, equations.parameters, points, equations.found, slopes)


@helper
def fill_residual(equations: Equations, right: Array) -> None:
    """Fill in F from what was evaluated."""
    rounds, values = equations.found.shape
    for j in range(rounds):
        for i in range(values):
            right[j * values + i] = equations.found[j, i]
            if equations.is_map:
                right[j * values + i] -= equations.states[(j + 1) % rounds, i] + (equations.gain[i] if j == rounds - 1 else 0.0)


@helper
def fill_matrix(equations: Equations, row: Array, matrix: Array) -> None:
    """Fill in [F_x; row] from what was evaluated."""
    size, slopes = row.size, equations.slopes_found
    (_, values, count), n = slopes.shape, equations.states.shape[1]
    for at in range(size - 1):
        j, i = at // values, at % values
        for k in range(size):
            matrix[at, k] = 0.0
        for k in range(count):
            matrix[at, j * n + k if k < n else size - count + k] = slopes[j, i, k]
        if equations.is_map:
            matrix[at, (at + n) % (size - 1)] -= 1.0
    for k in range(size):
        matrix[size - 1, k] = row[k]


@helper
def linearize(equations: Equations, linear: Linear, x: Array) -> float:
    """Factor [F_x; row] at x; return the sign of its determinant."""
    evaluate(equations, x, equations.slopes, equations.slopes_found)
    fill_matrix(equations, linear.row, linear.matrix)
    return factor_small(linear.matrix, linear.lu, linear.exchanges)


@helper
def _fill_update(equations: Equations, linear: Linear, x: Array, target: float) -> None:
    """Fill in the update at x, where the functions have been evaluated."""
    fill_residual(equations, linear.update)
    missing = -target
    for i in range(x.size):
        missing += linear.row[i] * x[i]
    linear.update[x.size - 1] = missing
    solve_small(linear.lu, linear.exchanges, linear.update)


@helper
def _correct(equations: Equations, linear: Linear, tolerance: float, most: int, x: Array, target: float) -> int:
    """Solve F(x) = 0 and row.x = target by Newton's method and chord steps, in place."""
    fresh, moved, before, now = True, 1.0, math.inf, math.inf
    for number in range(1, most + 1):
        now = math.inf
        if not fresh:
            evaluate(equations, x, equations.values, equations.no_slopes)
        elif linearize(equations, linear, x) == 0.0:
            break
        _fill_update(equations, linear, x, target)
        now = subtract(x, linear.update)
        said, error, moved = judge_update(now, before, moved, number, fresh, tolerance)
        if said == convergence.CONVERGED:
            linear.found[UPDATES], linear.found[ERROR], linear.found[SIZE] = number, error, now
            return BELIEVED
        if said == convergence.STAGNATES:
            return ASKS
        if said == convergence.DIVERGES:
            break
        fresh, before = said == convergence.FRESH, now
    return ASKS if now <= STAGNANT else FAILED


@helper
def _fill_tangent(equations: Equations, linear: Linear, tangent: Array) -> None:
    size = tangent.size
    for i in range(size):
        tangent[i] = 1.0 if i == size - 1 else 0.0
    solve_small(linear.lu, linear.exchanges, tangent)
    square = 0.0
    for i in range(size):
        square += equations.weights[i] * tangent[i] * tangent[i]
    length = math.sqrt(square)
    for i in range(size):
        tangent[i] /= length


@kernel(reorder=False, last=True)
def correct_point(
    equations: Equations, linear: Linear, tolerance: float, most: int, x: Vector, target: float, tangent: Vector
) -> int:
    """Correct x, in place, so that F(x) = 0 and row.x = target; fill in the tangent right there. ``linear.row`` is given."""
    outcome = _correct(equations, linear, tolerance, most, x, target)
    if outcome != BELIEVED:
        return outcome
    sign = linearize(equations, linear, x)
    _fill_update(equations, linear, x, target)
    following = 0.0
    for i in range(x.size):
        following += abs(linear.update[i]) / (1 + abs(x[i]))
    if sign == 0.0 or not following < math.inf:
        return FAILED
    if following > tolerance and following > FAR * linear.found[SIZE]:
        return ASKS  # updates do not shrink, whatever those before have said
    linear.found[SIGN] = sign
    _fill_tangent(equations, linear, tangent)
    return BELIEVED
