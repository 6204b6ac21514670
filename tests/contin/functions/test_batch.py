"""Compiled functions: values, exact derivatives, and a cache that notices every edit."""

import math
import os
import subprocess
import sys

import numpy as np
import pytest

from contin import BoundaryValueProblem, ProblemError
from contin.functions.batch import Batch
from contin.functions.gradient import gradient
from contin.functions.rewriting import Rewriter
from contin.functions.signature import result_count


def helper(x):
    return math.exp(x) / (1 + x**2)


def every_function(t, u, p):
    a, b = u
    return (
        helper(a) * p.k + t,
        np.sqrt(a) + math.log(b) + math.sin(a) * np.cos(b) + math.atan(a * b) + abs(a - 3 * b) + a**1.7,
        max(a, b) * math.tanh(p.k) + math.atan2(a, b) + (a if a.real > 0.5 else -a) + math.pow(a, 3),
    )


def test_jacobian_is_exact_to_round_off():
    """Against differences of fourth order with h = 1e-3 (error about 1e-11)."""
    batch = Batch([every_function], [3], ("a", "b"), ("k", "unused"))
    u, p, t = np.array([[0.7, 1.3]]), np.array([0.4, 9.0]), np.array([0.25])
    none = np.empty((0, 2))
    values, jacobian = batch.jacobian(t, u, none, p, batch.colouring([1, 0]))
    assert np.allclose(values, batch.values(t, u, none, p), rtol=1e-15)

    def at(du, dp):
        return batch.values(t, u + du, none, p + dp)[0]

    h = 1e-3
    for column, (du, dp) in enumerate([([1.0, 0], [0.0, 0]), ([0, 1.0], [0.0, 0]), ([0.0, 0], [0, 1.0]), ([0.0, 0], [1.0, 0])]):
        du, dp = h * np.array(du), h * np.array(dp)
        slope = (8 * (at(du, dp) - at(-du, -dp)) - (at(2 * du, 2 * dp) - at(-2 * du, -2 * dp))) / (12 * h)
        assert np.allclose(jacobian[0, :, column], slope, atol=2e-10)


def test_functions_of_both_ends_and_filled_arrays():
    def ends(u, v, p):
        return u.x - v.y * p.k, v.x**2

    def filled(t, u, p, out):
        for i in range(u.size):
            out[i] = p[0] * u[i] ** 2

    batch = Batch([ends], [2], ("x", "y"), ("k",), ends=True)
    _, jacobian = batch.jacobian(
        np.zeros(1), np.array([[1.0, 2.0]]), np.array([[3.0, 4.0]]), np.array([5.0]), batch.colouring([0])
    )
    assert np.allclose(jacobian[0], [[1, 0, 0, -5, -4], [0, 0, 6, 0, 0]])
    batch = Batch([filled], [3], ("a", "b", "c"), ("k",))
    u, p = np.array([[1.0, 2.0, 3.0]]), np.array([2.0])
    values, jacobian = batch.jacobian(np.zeros(1), u, np.empty((0, 3)), p, batch.colouring([0]))
    assert np.allclose(values, [[2, 8, 18]])
    assert np.allclose(jacobian[0], [[4, 0, 0, 1], [0, 8, 0, 4], [0, 0, 12, 9]])


def _fingerprint(function):
    rewriter = Rewriter()
    rewriter.function(function)
    return rewriter.fingerprint()


def test_fingerprint_follows_what_a_function_refers_to():
    def make(factor, inner):
        return lambda t, u, p: (factor * inner(u.x),)

    one = _fingerprint(make(2.0, lambda x: x * x))
    assert one == _fingerprint(make(2.0, lambda x: x * x))
    assert one != _fingerprint(make(2.5, lambda x: x * x))
    assert one != _fingerprint(make(2.0, lambda x: x + x))
    assert _fingerprint(make(2.0, math.sin)) != _fingerprint(make(2.0, math.cos))


def test_gradient_is_symbolic():
    def energy(x, y, k):
        return math.sqrt(x * x + k * y) + x**3 * y

    value, by_x, by_y = gradient(energy, ("x", "y"))(0.6, 0.8, 0.5)
    root = math.sqrt(0.36 + 0.4)
    assert math.isclose(value, root + 0.216 * 0.8, rel_tol=1e-15)
    assert math.isclose(by_x, 0.6 / root + 3 * 0.36 * 0.8, rel_tol=1e-15)
    assert math.isclose(by_y, 0.25 / root + 0.216, rel_tol=1e-15)


def rhs(t, u, p):
    return u.v, -u.u


def boundary(a, b, p):
    return a.u, b.u - p.k


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"states": ["u", "lambda"]}, "'lambda'"),
        ({"states": ["u", "u"]}, "twice"),
        ({"parameters": {"k": math.nan}}, "k = nan must be a finite number"),
        ({"parameters": {"k": "1"}}, "k = '1' must be a finite number"),
        ({"domain": (1.0, 0.0)}, "domain"),
        ({"states": ["u", "v", "w"]}, "rhs returns 2 values for the 3 states"),
        ({"rhs": lambda t, u: (u.v, u.u)}, "rhs takes 2 arguments, must take 3"),
        ({"rhs": lambda t, u, p: (u.v, p.absent)}, "rhs cannot be called: AttributeError"),
        ({"functionals": {"k": lambda t, u, p: u.u}}, "'k' stands twice"),
    ],
)
def test_a_bad_statement_is_refused_in_one_sentence(changes, said):
    statement = {"rhs": rhs, "boundary": boundary, "states": ["u", "v"], "parameters": {"k": 1.0}} | changes
    with pytest.raises(ProblemError, match=said) as error:
        BoundaryValueProblem(**statement)
    assert "\n" not in str(error.value)


def test_powers_of_negative_numbers_and_comparisons():
    """Derivatives of x^3, x^2, x^-2, x^5, x^(whole float) at x < 0, and of a function with a case distinction."""

    def powers(t, u, p):
        x = u.x
        return x**3, x**2, x**-2, x**5, x**p.whole, (x * x if x > 0 else -3 * x), (1 - x) ** 0.5, x**0

    batch = Batch([powers], [8], ("x",), ("whole",))
    values, jacobian = batch.jacobian(np.zeros(1), np.array([[-1.5]]), np.empty((0, 1)), np.array([3.0]), batch.colouring([]))
    x = -1.5
    assert np.allclose(values[0], [x**3, x**2, x**-2, x**5, x**3, -3 * x, (1 - x) ** 0.5, 1], rtol=1e-15)
    expected = [3 * x**2, 2 * x, -2 * x**-3, 5 * x**4, 3 * x**2, -3, -0.5 * (1 - x) ** -0.5, 0]
    assert np.allclose(jacobian[0, :, 0], expected, rtol=1e-14)


def test_what_cannot_be_compiled_says_so():
    problem = BoundaryValueProblem(lambda t, u, p: (u.v, eval("1.0")), boundary, ["u", "v"], {"k": 1.0})
    with pytest.raises(ProblemError, match="cannot be compiled"):
        problem.batch("field")


def test_result_count_is_found_without_compiling():
    assert result_count(lambda t, u, p: (u.a, u.b, 1), (None, ("a", "b"), ()), "f") == 3
    assert result_count(lambda t, u, p: u.a, (None, ("a", "b"), ()), "f") == 0


SAME_NAMES = """
import sys
from contin import BoundaryValueProblem, Collocation

def problem(helper):
    def rhs(t, u, p):
        return (helper(u.x),)
    return BoundaryValueProblem(rhs, lambda a, b, p: (a.x - 1,), ["x"], {"k": 1.0})

def one():
    def helper(x):
        return 10 * x
    return problem(helper)

def two():
    def helper(x):
        return x + 20
    return problem(helper)

for name in sys.argv[1:]:
    system = Collocation(globals()[name](), [0, 1], 2, ["k"], {})
    print(system.residual(system.pack([[3.0]] * 3, {"k": 1.0}))[0])
"""


def test_functions_of_one_name_compiled_by_two_processes_stay_apart(tmp_path):
    """Each compiled by a process of its own, both loaded by a third: -h f(3) is -30 and -23."""
    script = tmp_path / "same_names.py"
    script.write_text(SAME_NAMES)
    environment = {**os.environ, "CONTIN_CACHE_DIR": str(tmp_path / "cache"), "PYTHONPATH": os.pathsep.join(sys.path)}

    def run(*names):
        done = subprocess.run([sys.executable, script, *names], env=environment, capture_output=True, text=True, check=True)
        return [float(line) for line in done.stdout.split()]

    assert run("one") == pytest.approx([-30])
    assert run("two") == pytest.approx([-23])
    assert run("one", "two") == pytest.approx([-30, -23])


def test_a_function_that_calls_itself_is_refused():
    def rhs(t, u, p):
        return rhs(t, u, p) if False else (u.v, u.u)

    with pytest.raises(ProblemError, match="calls itself"):
        BoundaryValueProblem(rhs, boundary, ["u", "v"], {"k": 1.0}).batch("field")


def f(t, u, p):
    return u.f * p.helper, helper(u.math) + math.exp(p.np)


def test_states_and_parameters_may_have_the_names_of_globals():
    """A state named like the function itself, parameters named like a function and a module that it uses."""
    problem = BoundaryValueProblem(
        f, lambda a, b, p: (a.f - 1, a.math), ["f", "math"], {"helper": 2.0, "np": 0.0}, functionals={"g": lambda t, u, p: u.f}
    )
    values = problem.batch("field").values(np.zeros(1), np.array([[3.0, 0.0]]), np.empty((0, 2)), np.array([2.0, 0.0]))
    assert values[0].tolist() == [6.0, 2.0]


def test_what_numba_itself_does_not_expect_is_a_sentence():
    """numba asserts that a nested list has numbers of one kind."""

    def rhs(t, u, p, out):
        matrix = np.array([[1.0, 2], [0, 1]])
        out[0] = matrix[0, 1] * u[1]
        out[1] = u[0]

    with pytest.raises(ProblemError, match="'rhs' cannot be compiled.*0.0, not 0"):
        Batch([rhs], [2], ["a", "b"], ["k"])
