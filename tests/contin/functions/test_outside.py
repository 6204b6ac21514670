"""Functions as users of SciPy write them: the same solutions, compiled where numba can. Each was refused or wrong once."""

import dataclasses
import warnings

import numpy as np
import pytest
import scipy.sparse

from contin import AlgebraicProblem, BoundaryValueProblem, ProblemError, solve, trace
from contin.errors import InterpretedWarning
from contin.lowlevel import Batch

VALUES = {"k": 4.0, "more": {"half": 0.5}}
MATRIX = scipy.sparse.diags_array([np.ones(3), -2 * np.ones(4), np.ones(3)], offsets=[-1, 0, 1])


@dataclasses.dataclass
class Model:
    """Constants as attributes, a property, and methods that call each other; a dataclass cannot be hashed."""

    k: float = 4.0

    @property
    def half(self):
        return 0.5

    def force(self, x):
        return self.k * x

    def balance(self, u, p):
        return [self.force(u.x) - p.a + self.half - 0.5]


MODEL = Model()


def filled(u, p):
    out = np.zeros(1)
    out[0] = 4 * u[0] - p["a"]
    return out


def alike(u, p):
    out = np.zeros_like(u)
    out[0] = 4 * u["x"] - p.a
    return out


#: The zero of each is x = a / 4.
COMPILED = {
    "names in brackets": lambda u, p: np.array([4 * u["x"] - p["a"]]),
    "a dictionary": lambda u, p: (VALUES["k"] * u.x - 2 * VALUES["more"]["half"] * p.a,),
    "an array that is filled": filled,
    "an array like the states": alike,
    "a method": MODEL.balance,
    "an object": lambda u, p: (MODEL.force(u.x) - p.a,),
    "vstack of numbers": lambda u, p: np.vstack((4 * u[0] - p.a,)),
    "states as an array": lambda u, p: 2 * u + u * 2 - p.a,
    "concatenate of a list": lambda u, p: np.concatenate([2 * u + u * 2 - p.a]),
}


@pytest.mark.parametrize("case", COMPILED)
def test_it_is_compiled_with_exact_derivatives(case):
    batch = Batch([COMPILED[case]], [1], ["x"], ["a"], times=False)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        given = np.zeros(1), np.array([[3.0]]), np.empty((0, 1)), np.array([2.0])
        values, jacobian = batch.jacobian(*given, batch.columns([0]))
    assert np.allclose(values[0, 0], 10, rtol=1e-15) and np.allclose(jacobian[0, 0], [4, -1], rtol=1e-15)


def test_constants_that_change_between_runs_count():
    """x = a / k with the k of the moment."""
    problem = AlgebraicProblem(lambda u, p: (VALUES["k"] * u.x - p.a,), ["x"], {"a": 1.0})
    first = solve(problem, [0.0])
    VALUES["k"] = 8.0
    try:
        branch = trace(first, free=["a"], limits={"a": (0, 2)})
        assert (first["x"], solve(problem, [0.0])["x"], branch.points[0]["x"]) == (0.25, 0.125, 0.125)
    finally:
        VALUES["k"] = 4.0


@pytest.mark.filterwarnings("ignore::contin.errors.InterpretedWarning")
def test_complex_numbers_of_the_user_in_python():
    """|exp(i x)|^2 x = x, and Re((x + i y)^2) = x^2 - y^2, in Python, as ``try`` cannot be recorded."""

    def function(u, p):
        try:
            z = complex(u.x, u.y) ** 2
        except OverflowError:
            raise
        return abs(np.exp(1j * u.x)) ** 2 * u.x, z.real

    batch = Batch([function], [2], ["x", "y"], [], times=False)
    given = np.zeros(1), np.array([[3.0, 2.0]]), np.empty((0, 2)), np.empty(0)
    values, jacobian = batch.jacobian(*given, batch.columns([]))
    assert np.allclose(values, [[3, 5]], rtol=1e-14)
    assert np.allclose(jacobian[0], [[1, 0], [6, -4]], rtol=0, atol=1e-9)
    assert batch.depends.all()


@pytest.mark.filterwarnings("ignore::contin.errors.InterpretedWarning")
def test_a_sparse_matrix_has_its_pattern():
    """The second difference of four values: derivatives are the matrix."""
    batch = Batch([lambda u, p: MATRIX @ u + 0 * u**2], [4], list("abcd"), [], times=False)
    columns = batch.columns([])
    given = np.zeros(1), np.arange(4.0)[None], np.empty((0, 4)), np.empty(0)
    entries = batch.entries(*given, columns)[1][0]
    found = scipy.sparse.coo_array((entries, (columns.rows, columns.places)), shape=(4, 4))
    assert columns.rows.size == 10 and np.allclose(found.toarray(), MATRIX.toarray(), rtol=1e-15, atol=0)


def test_states_of_equilibria_are_columns():
    """x^2 = a: x = 1.5 at a = 2.25."""
    problem = AlgebraicProblem(lambda u, p: (u.x**2 - p.a,), ["x"], {"a": 1.0})
    branch = trace(solve(problem, [1.0]), free=["a"], limits={"x": (0.5, 2)}, zeros={"x": [1.5]})
    assert abs(branch.labelled("UZ")[0]["a"] - 2.25) < 1e-12 and str(branch.stop) == "reached x = 2"
    assert np.array_equal(branch.column("x"), [point.x[0] for point in branch])


def test_what_cannot_be_used_is_a_sentence():
    with pytest.raises(ProblemError, match="residual returns a dict, must return numbers in the order"):
        AlgebraicProblem(lambda u, p: {"x": u.x}, ["x"], {"a": 1.0})
    with pytest.raises(ProblemError, match="cannot be called: KeyError: 'b'; the states and parameters are x, a"):
        AlgebraicProblem(lambda u, p: (u.x - p["b"],), ["x"], {"a": 1.0})
    bratu = BoundaryValueProblem(
        lambda t, u, p: np.vstack((u[1], -p.lam * np.exp(u[0]))), lambda a, b, p: [a[0], b[0]], ["u", "v"], {"lam": 1.0}
    )
    with pytest.raises(KeyError, match="'u' is a function of t: take point.system.evaluate"):
        solve(bratu, [0, 0])["u"]


def test_a_tuple_is_never_taken_for_an_array():
    """2 * u repeats a tuple: with states as an array it is the double."""
    with warnings.catch_warnings():
        warnings.simplefilter("error", InterpretedWarning)
        point = solve(AlgebraicProblem(lambda u, p: 2 * u - np.array([p.a, 4.0]), ["x", "y"], {"a": 1.0}), [0, 0])
    assert (point["x"], point["y"]) == (0.5, 2.0)


def test_a_list_that_is_made_in_a_function_handles_no_exceptions():
    """From Python 3.12 on it has an entry in the function's table of exceptions; such functions were evaluated in Python."""

    def residual(u, p):
        return [p.a * each - each**3 for each in (u.x, u.y)]

    with warnings.catch_warnings():
        warnings.simplefilter("error")
        problem = AlgebraicProblem(residual, ["x", "y"], {"a": 4.0})
        assert solve(problem, [2.1, -2.1]).x == pytest.approx([2.0, -2.0], abs=1e-10)
