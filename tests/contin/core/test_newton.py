"""The corrector on equations whose iterates are known in closed form: its order, its economy, and when it stops.

The equations count what is asked of them, and their matrices are solved by numpy: nothing of the engine but the corrector runs.
"""

import math

import numpy as np
import pytest

from contin import AlgebraicProblem, ConvergenceError, Newton
from contin.lowlevel import Algebraic, correct


class Matrix:
    """A square matrix as factors: solved by numpy."""

    def __init__(self, matrix):
        self.matrix, self.sign = matrix, np.linalg.slogdet(np.nan_to_num(matrix))[0]

    def solve(self, b):
        return np.ascontiguousarray(np.linalg.solve(self.matrix, np.asarray(b).T).T)

    def solve_transposed(self, c):
        return np.ascontiguousarray(np.linalg.solve(self.matrix.T, np.asarray(c).T).T)


class Equations:
    """F(x) = 0 with its derivative; ``jacobians`` and ``residuals`` hold every x at which one was asked for."""

    def __init__(self, function, derivative):
        self.function, self.derivative = function, derivative
        self.jacobians, self.residuals = [], []

    def residual(self, x):
        self.residuals.append(x.copy())
        return np.atleast_1d(self.function(*x))

    def linearize(self, x, rows=(), columns=()):
        self.jacobians.append(x.copy())
        return np.atleast_1d(self.function(*x)), Matrix(np.vstack([np.atleast_2d(self.derivative(*x)), *rows]))


def square_root():
    return Equations(lambda x: x * x - 2, lambda x: 2 * x)


def circle():
    return Equations(lambda x, y: x * x + y * y - 1, lambda x, y: [2 * x, 2 * y])


ROOT = math.sqrt(2)


@pytest.mark.parametrize("start", [0.3, 3.0, 40.0])
def test_quadratic_convergence(start):
    """From far away every step takes a new Jacobian, and the error goes as Heron's rule says: e' = e^2 / (2 x)."""
    equations = square_root()
    done = correct(equations, [start], newton=Newton(max_iterations=20))
    errors = [float(x[0] - ROOT) for x in equations.jacobians]
    assert len(errors) >= 3 and errors[0] == start - ROOT
    for (x,), error, following in zip(equations.jacobians, errors, errors[1:]):
        assert following == pytest.approx(error**2 / (2 * x), rel=1e-9, abs=1e-14)
    assert done.x[0] == pytest.approx(ROOT, rel=1e-15)
    assert done.iterations == len(equations.jacobians) + len(equations.residuals)


def test_chord_steps_where_they_do():
    """Close to the root the Jacobian is kept: from x_0 on the error shrinks as e' = e (1 - (x + sqrt 2) / (2 x_0))."""
    equations = square_root()
    done = correct(equations, [1.41])
    ((first,),), chords = equations.jacobians, [float(x[0]) for x in equations.residuals]
    assert len(chords) >= 2
    for x, following in zip(chords, [*chords[1:], float(done.x[0])]):
        assert following - ROOT == pytest.approx((x - ROOT) * (1 - (x + ROOT) / (2 * first)), rel=1e-6, abs=1e-15)
    assert done.x[0] == pytest.approx(ROOT, abs=1e-12)


def test_linear_equations_take_one_jacobian():
    matrix, b = np.array([[3.0, 1.0], [-1.0, 2.0]]), np.array([5.0, -4.0])
    equations = Equations(lambda x, y: matrix @ [x, y] - b, lambda x, y: matrix)
    done = correct(equations, [7.0, -30.0])
    assert done.x == pytest.approx(np.linalg.solve(matrix, b), rel=1e-15)
    assert len(equations.jacobians) <= 2 and done.iterations <= 3


@pytest.mark.parametrize("start", [1.41, 1.5, 2.0, 9.0])
@pytest.mark.parametrize("tolerance", [1e-4, 1e-8, 1e-12])
def test_the_error_given_is_the_error(start, tolerance):
    """Relative to 1 + |x|, to a factor of two."""
    done = correct(square_root(), [start], newton=Newton(tolerance, 20))
    assert done.error <= tolerance
    assert 0.5 < abs(done.x[0] - ROOT) / (1 + ROOT) / done.error < 2


def test_a_looser_tolerance_takes_fewer_iterations():
    counts = [correct(square_root(), [9.0], newton=Newton(tolerance, 20)).iterations for tolerance in (1e-2, 1e-5, 1e-12)]
    assert counts == sorted(counts) and counts[0] < counts[-1]


# --- a linear condition ---------------------------------------------------------------------------------------------


def test_a_row_picks_one_point_of_a_curve():
    """On the unit circle with 3 x - 4 y = 0: (0.8, 0.6)."""
    row = np.array([3.0, -4.0])
    done = correct(circle(), [0.9, 0.5], row, 0.0)
    assert done.x == pytest.approx([0.8, 0.6], abs=1e-12)
    assert done.factors.matrix[1].tolist() == row.tolist()


def test_a_target_of_the_row():
    done = correct(circle(), [0.5, 0.9], np.array([1.0, 0.0]), 0.28)
    assert done.x == pytest.approx([0.28, 0.96], abs=1e-12)


# --- factors from elsewhere -----------------------------------------------------------------------------------------


def test_factors_from_near_by_save_the_jacobian():
    """Those at 1.4143 for a guess of 1.4141: no Jacobian is taken, and the answer is as good."""
    equations, factors = square_root(), Matrix(np.array([[2 * 1.4143]]))
    done = correct(equations, [1.4141], factors=factors)
    assert equations.jacobians == [] and done.factors is factors
    assert done.x[0] == pytest.approx(ROOT, abs=1e-12)
    assert done.iterations == len(equations.residuals) <= 4


@pytest.mark.parametrize("slope", [20.0, -2.0, 1e-9, math.nan])
def test_factors_that_are_of_no_use_are_dropped(slope):
    """Newton's method starts again from the guess, and converges."""
    equations = square_root()
    done = correct(equations, [1.5], factors=Matrix(np.array([[slope]])))
    assert equations.jacobians[0].tolist() == [1.5]
    assert done.x[0] == pytest.approx(ROOT, abs=1e-12)


def test_chord_steps_converge_to_round_off():
    """A guess that is the root to a unit in the last place, and factors of another point: one step, and it counts."""
    equations = square_root()
    done = correct(equations, [ROOT], factors=Matrix(np.array([[3.0]])))
    assert done.iterations == 1 and done.error < 1e-15
    assert done.x[0] == pytest.approx(ROOT, rel=1e-15)


# --- where it ends --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("noise", [1e-12, 1e-14])
def test_stagnation_at_round_off_counts_as_converged(noise):
    """Residuals with noise: no update is ever below the tolerance of 1e-18. The error that is left is the noise."""
    random = np.random.default_rng(0)
    equations = Equations(lambda x: x * x - 2 + noise * random.uniform(-1, 1), lambda x: 2 * x)
    done = correct(equations, [1.5], newton=Newton(1e-18, 30))
    assert abs(done.x[0] - ROOT) < noise
    assert done.iterations < 12


def updates_of_arctan(x, count):
    """Sizes of Newton's updates for arctan(x) = 0, relative to 1 + |x|: x' = x - (1 + x^2) arctan(x)."""
    sizes = []
    for _ in range(count):
        step = (1 + x * x) * math.atan(x)
        sizes.append(abs(step) / (1 + abs(x)))
        x -= step
    return sizes


def test_divergence_is_noticed_and_told():
    """Newton's method for arctan(x) = 0 diverges from |x| > 1.392. It ends when an update doubles; the message tells all."""
    equations = Equations(math.atan, lambda x: 1 / (1 + x * x))
    with pytest.raises(ConvergenceError) as caught:
        correct(equations, [1.6], newton=Newton(max_iterations=50))
    count = len(equations.jacobians)
    expected = updates_of_arctan(1.6, count)
    assert str(caught.value) == f"Newton did not converge (updates {', '.join(f'{size:.1e}' for size in expected)})"
    assert expected[-1] > 2 * expected[-2] and count < 10
    assert all(later <= 2 * before for before, later in zip(expected[1:-2], expected[2:-1]))


def test_a_first_update_that_goes_too_far_ends_it():
    """Of x^2 = 2 the first update from 9 is 79 / 18 = 4.39; the one Jacobian of it is all that it takes."""
    equations = square_root()
    equations.weights = np.ones(1)
    with pytest.raises(ConvergenceError, match=r"the prediction is off by more than 4.3 \(updates 4.4e-01\)"):
        correct(equations, [9.0], within=4.3)
    assert len(equations.jacobians) == 1
    assert correct(equations, [9.0], within=4.4).x == pytest.approx([ROOT], rel=1e-12)


def test_iterations_are_limited():
    """The cube root: every step takes x to -2 x, so the relative updates stay below 3."""
    equations = Equations(np.cbrt, lambda x: np.cbrt(x) / (3 * x))
    with pytest.raises(ConvergenceError, match=r"\(updates ([\d.]+e[+-]\d+, ){6}[\d.]+e[+-]\d+\)"):
        correct(equations, [1.0], newton=Newton(max_iterations=7))
    assert [float(x[0]) for x in equations.jacobians] == pytest.approx([(-2.0) ** k for k in range(7)])


@pytest.mark.parametrize("value", [math.nan, math.inf])
def test_equations_that_are_not_finite(value):
    with pytest.raises(ConvergenceError, match=r"Newton did not converge \(updates not finite\)"):
        correct(Equations(lambda x: x * value, lambda x: 1.0), [1.0])


def test_the_guess_is_left_as_it_was():
    guess = np.array([9.0])
    correct(square_root(), guess)
    assert guess.tolist() == [9.0]


@pytest.mark.parametrize("square", [1e-18, 1e-20])
@pytest.mark.parametrize("guess", [1e-8, 1e-9])
def test_small_updates_that_solve_nothing_are_no_round_off(square, guess):
    """x^2 + square = 0 has no real solution: updates stay at the size of its root, below 1e-9."""
    nothing = Algebraic(AlgebraicProblem(lambda u, p: (u.x**2 + square,), ["x"], {"a": 0.0}), [])
    with pytest.raises(ConvergenceError):
        correct(nothing, [guess])
