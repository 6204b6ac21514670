"""Functions of a point, recorded: values and exact derivatives."""

import math

import mpmath
import numpy as np
import pytest

from contin import BoundaryValueProblem, ProblemError
from contin.functions.batch import Batch


def helper(x):
    return math.exp(x) / (1 + x**2)


def every_function(t, u, p):
    a, b = u
    return (
        helper(a) * p.k + t,
        np.sqrt(a) + math.log(b) + math.sin(a) * np.cos(b) + math.atan(a * b) + abs(a - 3 * b) + a**1.7,
        max(a, b) * math.tanh(p.k) + math.atan2(a, b) + (a if a.real > 0.5 else -a) + math.pow(a, 3),
    )


def in_many_digits(t, a, b, k):
    """The same formulas for mpmath."""
    m = mpmath
    return (
        m.exp(a) / (1 + a**2) * k + t,
        m.sqrt(a) + m.log(b) + m.sin(a) * m.cos(b) + m.atan(a * b) + abs(a - 3 * b) + a ** m.mpf(1.7),
        max(a, b) * m.tanh(k) + m.atan2(a, b) + (a if a > 0.5 else -a) + a**3,
    )


def test_values_and_jacobian_are_exact_to_round_off():
    """Against derivatives by mpmath with 40 digits."""
    batch = Batch([every_function], [3], ("a", "b"), ("k", "unused"))
    u, p, t = np.array([[0.7, 1.3]]), np.array([0.4, 9.0]), np.array([0.25])
    none = np.empty((0, 2))
    values, jacobian = batch.jacobian(t, u, none, p, batch.columns([1, 0]))
    assert np.array_equal(jacobian[0, :, 2], np.zeros(3))  # nothing depends on the unused parameter
    with mpmath.workdps(40):
        at = [mpmath.mpf(value) for value in (t[0], *u[0], p[0])]
        for row in range(3):
            known = in_many_digits(*at)[row]
            assert values[0, row] == pytest.approx(float(known), rel=4e-16)
            assert batch.values(t, u, none, p)[0, row] == pytest.approx(float(known), rel=4e-16)
            for column, argument in ((0, 1), (1, 2), (3, 3)):
                orders = tuple(int(i == argument) for i in range(4))
                slope = mpmath.diff(lambda *x, row=row: in_many_digits(*x)[row], at, orders)
                assert jacobian[0, row, column] == pytest.approx(float(slope), rel=2e-15, abs=1e-16)


def test_functions_of_both_ends_and_filled_arrays():
    def ends(u, v, p):
        return u.x - v.y * p.k, v.x**2

    def filled(t, u, p, out):
        for i in range(u.size):
            out[i] = p[0] * u[i] ** 2

    batch = Batch([ends], [2], ("x", "y"), ("k",), ends=True)
    _, jacobian = batch.jacobian(
        np.zeros(1), np.array([[1.0, 2.0]]), np.array([[3.0, 4.0]]), np.array([5.0]), batch.columns([0])
    )
    assert np.allclose(jacobian[0], [[1, 0, 0, -5, -4], [0, 0, 6, 0, 0]])
    batch = Batch([filled], [3], ("a", "b", "c"), ("k",))
    u, p = np.array([[1.0, 2.0, 3.0]]), np.array([2.0])
    values, jacobian = batch.jacobian(np.zeros(1), u, np.empty((0, 3)), p, batch.columns([0]))
    assert np.allclose(values, [[2, 8, 18]])
    assert np.allclose(jacobian[0], [[4, 0, 0, 1], [0, 8, 0, 4], [0, 0, 12, 9]])


def test_powers_of_negative_numbers_and_comparisons():
    """Derivatives of x^3, x^2, x^-2, x^5, x^(whole float) at x < 0, and of a function with a case distinction."""

    def powers(t, u, p):
        x = u.x
        return x**3, x**2, x**-2, x**5, x**p.whole, (x * x if x > 0 else -3 * x), (1 - x) ** 0.5, x**0

    batch = Batch([powers], [8], ("x",), ("whole",))
    values, jacobian = batch.jacobian(np.zeros(1), np.array([[-1.5]]), np.empty((0, 1)), np.array([3.0]), batch.columns([]))
    x = -1.5
    assert np.allclose(values[0], [x**3, x**2, x**-2, x**5, x**3, -3 * x, (1 - x) ** 0.5, 1], rtol=1e-15)
    expected = [3 * x**2, 2 * x, -2 * x**-3, 5 * x**4, 3 * x**2, -3, -0.5 * (1 - x) ** -0.5, 0]
    assert np.allclose(jacobian[0, :, 0], expected, rtol=1e-14)


def f(t, u, p):
    return u.f * p.helper, helper(u.math) + math.exp(p.np)


def test_states_and_parameters_may_have_the_names_of_globals():
    """A state named like the function itself, parameters named like a function and a module that it uses."""
    problem = BoundaryValueProblem(
        f, lambda a, b, p: (a.f - 1, a.math), ["f", "math"], {"helper": 2.0, "np": 0.0}, functionals={"g": lambda t, u, p: u.f}
    )
    values = problem.batch("field").values(np.zeros(1), np.array([[3.0, 0.0]]), np.empty((0, 2)), np.array([2.0, 0.0]))
    assert np.allclose(values[0], [6.0, 2.0], rtol=1e-15)


def test_a_matrix_made_inside():
    """A list of lists of whole and other numbers."""

    def rhs(t, u, p, out):
        matrix = np.array([[1.0, 2], [0, 1]])
        out[0] = matrix[0, 1] * u[1]
        out[1] = u[0]

    batch = Batch([rhs], [2], ["a", "b"], ["k"])
    jacobian = batch.jacobian(np.zeros(1), np.zeros((1, 2)), np.empty((0, 2)), np.zeros(1), batch.columns([]))[1]
    assert np.allclose(jacobian, [[[0.0, 2.0], [1.0, 0.0]]], rtol=1e-15, atol=0)


@pytest.mark.parametrize("counts", [[], [1]])
def test_no_functions_is_a_sentence(counts):
    with pytest.raises(ProblemError, match="functions: there must be at least one"):
        Batch([], counts, ["a"], ["k"])


def test_one_function_of_other_states_is_another_batch():
    """The names of states say what ``u.y`` is."""
    for states, y in ((["x", "y"], 2.0), (["x", "z", "y"], 3.0), (["y", "x"], 1.0)):
        batch = Batch([lambda t, u, p: u.y], [0], states, ["a"])
        values = np.arange(1.0, 1 + len(states))[None]
        assert batch.values(np.zeros(1), values, np.empty((0, len(states))), np.ones(1)) == pytest.approx(y, rel=1e-15)
    for parameters, b in ((["a", "b"], 2.0), (["b", "a"], 1.0)):
        batch = Batch([lambda t, u, p: p.b], [0], ["x"], parameters)
        values = batch.values(np.zeros(1), np.zeros((1, 1)), np.empty((0, 1)), np.array([1.0, 2.0]))
        assert values == pytest.approx(b, rel=1e-15)


@pytest.mark.filterwarnings("ignore::contin.errors.InterpretedWarning")
def test_what_is_recorded_and_what_python_evaluates_answer_the_same():
    """Every method of a batch, of a function and of the same function in Python, as ``try`` cannot be recorded."""

    def recorded(u, p):
        return u.x**2 * p.a + math.sin(u.y), u.x * u.y

    def in_python(u, p):
        try:
            return recorded(u, p)
        finally:
            pass

    batches = [Batch([function], [2], ["x", "y"], ["a"], times=False) for function in (recorded, in_python)]
    assert (
        [batch.recorded is None for batch in batches] == [batch.interpreted is not None for batch in batches] == [False, True]
    )
    given = np.zeros(3), np.array([[0.4, 1.2], [0.9, -0.3], [1.5, 0.8]]), np.empty((0, 2)), np.array([1.7])
    one = (given[0][:1], given[1][:1], *given[2:])
    random = np.random.default_rng(1)
    directions, weights = random.standard_normal((2, 3, 3)), random.standard_normal((3, 2))
    answers = []
    for batch in batches:
        columns = batch.columns([0], [1, 0])
        values, entries = batch.entries(*one, columns)
        jacobian = np.zeros((2, columns.width))
        jacobian[columns.rows, columns.places] = entries
        answers.append(
            [
                batch.values(*given), *batch.jacobian(*given, columns), values, jacobian, batch.along(*given, directions),
                batch.jacobian_along(*given, columns, directions[:1]), batch.bent(*given, weights, directions[0], columns),
            ]
        )  # fmt: skip
    for own, other in zip(*answers):
        assert own.shape == other.shape and own == pytest.approx(other, abs=1e-7)
    with pytest.raises(ProblemError, match="there is no text: evaluated in Python, because in_python catches exceptions"):
        batches[1].text(["x", "y", "a"])
