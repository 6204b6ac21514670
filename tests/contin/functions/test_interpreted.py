"""Functions that cannot be compiled: the same solutions, and one sentence that says so."""

import ctypes
import ctypes.util
import functools
import math
import warnings

import numpy as np
import pytest
from scipy import special
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq

from contin import AlgebraicProblem, BoundaryValueProblem, solve, trace
from contin.errors import InterpretedWarning
from contin.lowlevel import Batch

pytestmark = pytest.mark.filterwarnings("ignore::contin.errors.InterpretedWarning")
TABLE = np.linspace(0.0, 1.0, 11)
MATRIX = np.array([[2.0, 1.0], [0.0, 1.0]])
REAL_SINE = ctypes.CDLL(ctypes.util.find_library("m")).sin
REAL_SINE.restype, REAL_SINE.argtypes = ctypes.c_double, [ctypes.c_double]


class Model:
    """A problem as a class, with a number of its own."""

    stiffness = 2.0

    def forces(self, u, p):
        return (u.x * self.stiffness - p.a,)


def fill(u, p, out):
    out[:] = MATRIX @ u
    out[0] -= p[0]


CASES = {
    "scipy.special": (lambda u, p: (special.j0(u.x) - p.a,), brentq(lambda x: special.j0(x) - 0.5, 1, 2, xtol=1e-14), 1.0),
    "a table": (lambda u, p: (np.interp(u.x, TABLE, TABLE**2) - p.a,), 0.7066666667, 0.6),
    "a spline": (lambda u, p, spline=CubicSpline(TABLE, TABLE**2): (spline(u.x) - p.a,), math.sqrt(0.5), 0.6),
    "a method": (Model().forces, 0.25, 1.0),
    "partial": (functools.partial(lambda k, u, p: (k * u.x - p.a,), 4.0), 0.125, 1.0),
    "a function that calls itself": (lambda u, p: (_power(u.x, 3) - p.a,), 0.5 ** (1 / 3), 1.0),
}


def _power(x, n):
    return 1.0 if n == 0 else x * _power(x, n - 1)


@pytest.mark.parametrize("case", CASES)
def test_what_cannot_be_compiled_is_solved(case):
    function, root, guess = CASES[case]
    point = solve(AlgebraicProblem(function, ["x"], {"a": 0.5}), [guess])
    assert abs(point.x[0] - root) < 1e-9


def test_a_product_with_a_matrix():
    """Two states, with a return value and with an array that is filled."""
    returned = AlgebraicProblem(lambda u, p: MATRIX @ np.array(u) - np.array([p.a, 0.0]), ["x", "y"], {"a": 0.5})
    filled = AlgebraicProblem(fill, ["x", "y"], {"a": 0.5}, count=2)
    for problem in (returned, filled):
        assert np.abs(solve(problem, [0.3, 0.3]).x - [0.25, 0.0]).max() < 1e-15


def test_the_sentence_says_why_and_what_it_costs():
    with pytest.warns(InterpretedWarning, match="is evaluated in Python, 10 to 1000 times.*by differences"):
        solve(AlgebraicProblem(lambda u, p: np.fft.ifft(np.fft.fft(u)).real - p.a, ["x", "y"], {"a": 0.5}), [0.3, 0.3])
    with pytest.warns(InterpretedWarning, match=r"<lambda> is evaluated.*calls j0, which cannot be differentiated"):
        solve(AlgebraicProblem(lambda u, p: (special.j0(u.x) - p.a,), ["x"], {"a": 0.5}), [1.0])


def test_it_is_said_once():
    problem = AlgebraicProblem(lambda u, p: (special.j0(u.x) - p.a,), ["x"], {"a": 0.5})
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        trace(solve(problem, [1.0]), free=["a"], limits={"a": (0.2, 0.8)})
    assert sum(isinstance(each.message, InterpretedWarning) for each in said) == 1
    assert said[0].filename == __file__


def test_the_fold_of_bratu_is_the_same():
    """Its exponential from a table that no compiler knows: 3.513830719125161 (variational closed form of the fold)."""

    class Exponential:
        def __call__(self, x):
            return np.exp(x)

    exponential = Exponential()
    problem = BoundaryValueProblem(
        lambda t, u, p: (u.v, -p.lam * exponential(u.u)), lambda a, b, p: (a.u, b.u), ["u", "v"], {"lam": 0.0}
    )
    branch = trace(solve(problem, [0.0, 0.0]), free=["lam"], limits={"lam": (0, 4)}, max_points=15)
    assert abs(branch.labelled("LP")[0]["lam"] - 3.513830719125161) < 1e-11


def test_functions_for_real_numbers_are_not_taken_with_complex_ones():
    """u |u| has the slope 2 |u|; numpy's absolute value of a complex number would give |u|."""

    def odd(u, p, absolute=np.vectorize(abs)):
        return (u.x * absolute(u.x) - p.a,)

    batch = Batch([odd], [1], ["x"], ["a"], times=False)
    for x in (0.0, 1.0, -2.0):
        jacobian = batch.jacobian(np.zeros(1), np.array([[x]]), np.empty((0, 1)), np.zeros(1), batch.columns([]))[1]
        assert abs(jacobian[0, 0, 0] - 2 * abs(x)) < 1e-7  # at 0 it has no third derivative


def test_values_that_are_not_defined_are_nan():
    batch = Batch([lambda u, p, log=np.vectorize(math.log): (log(u.x),)], [1], ["x"], ["a"], times=False)
    u = np.array([[1.0], [-1.0]])
    assert np.isnan(batch.values(np.zeros(2), u, np.empty((0, 1)), np.zeros(1))[1, 0])


def _many(u, p):
    x = u.x
    return (
        x % 0.7, x // 0.7, math.hypot(x, 2.0), math.erf(x), math.erfc(x), math.gamma(x), math.lgamma(x), x - math.floor(x),
        math.ceil(x) * x, np.hypot(x, x), math.gamma(-x), math.lgamma(-x),
    )  # fmt: skip


def test_functions_of_real_numbers_compile():
    """Derivatives in closed form, with SciPy's digamma."""
    x = 2.3
    batch = Batch([_many], [12], ["x"], ["a"], times=False)
    none, p = np.empty((0, 1)), np.zeros(1)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        values, jacobian = batch.jacobian(np.zeros(1), np.array([[x]]), none, p, batch.columns([]))
    slope, psi = 2 / math.sqrt(math.pi) * math.exp(-x * x), special.digamma
    expected = [
        1, 0, x / math.hypot(x, 2), slope, -slope, special.gamma(x) * psi(x), psi(x), 1, 3, math.sqrt(2),
        -special.gamma(-x) * psi(-x), -psi(-x),
    ]  # fmt: skip
    assert np.allclose(jacobian[0, :, 0], expected, rtol=1e-14, atol=1e-14)


def test_what_needs_finite_numbers_is_called_with_them():
    """Neither function would come to an end, or have a value, for NaN."""

    def search(u, p):
        f = u.x
        while not abs(f) < 1e-12:
            f = f / 2
        return (u.x - p.a,)

    assert solve(AlgebraicProblem(search, ["x"], {"a": 0.5}), [2.0]).x[0] == 0.5
    assert solve(AlgebraicProblem(lambda u, p: (u.x - math.floor(u.x) - p.a,), ["x"], {"a": 0.5}), [2.3]).x[0] == 2.5


def real_sine(x):
    """The sine of a real number, by a function that cannot be recorded."""
    return REAL_SINE(x)


def test_the_normal_form_of_a_hopf_point_at_zero():
    """Third derivatives where all states are zero: sizes of states tell nothing. l1 = -2 by hand: the sine adds no term."""

    def field(u, p):
        square = u.x**2 + u.y**2
        return p.m * u.x - u.y - u.x * square + 0.1 * real_sine(u.x) * u.y, u.x + p.m * u.y - u.y * square

    problem = AlgebraicProblem(field, ["x", "y"], {"m": -1.0})
    (hopf,) = trace(solve(problem, [0.0, 0.0]), free=["m"], limits={"m": (-1, 1)}).labelled("HB")
    assert abs(hopf.normal_form + 2) < hopf.details["normal_form_error"] < 1e-4
    assert abs(hopf.normal_form + 2) < 1e-8
