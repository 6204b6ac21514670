"""Recorded functions: values, derivatives of several orders, decisions, arrays, unknowns found by iteration.

Known values come from mpmath with 40 digits, from closed forms, or from the same function called in Python.
"""

import functools
import math
import pickle
import random
import warnings

import mpmath
import numpy as np
import pytest
import scipy.sparse
from scipy import special
from scipy.interpolate import CubicSpline, PchipInterpolator

import contin
from contin import ProblemError
from contin.errors import InterpretedWarning
from contin.functions import recording
from contin.functions.derivatives import jacobian, tangents
from contin.functions.tape import Tape
from contin.lowlevel import Batch, gradient, minimum, root

NONE = np.empty((0, 1))


def of_one(function, x, parameters=()):
    """Return value, slope and second derivative of a function of (u, p) with one state, each shape (points,)."""
    batch = Batch([function], [0], ["x"], [f"p{i}" for i in range(len(parameters))], times=False)
    assert batch.interpreted is None, batch.describe()
    u, p = np.array(x, dtype=float)[:, None], np.array(parameters, dtype=float)
    given = np.zeros(len(u)), u, NONE, p
    values, slopes = batch.jacobian(*given, batch.columns([]))
    along = np.zeros((len(u), 1 + len(parameters)))
    along[:, 0] = 1
    second = batch.along(*given, [along, along])
    assert np.array_equal(batch.values(*given), values)
    assert np.allclose(batch.along(*given, [along]), slopes[:, :, 0], rtol=1e-13, equal_nan=True)
    return values[:, 0], slopes[:, 0, 0], second[:, 0]


ELEMENTARY = {
    "sqrt": (math.sqrt, mpmath.sqrt), "exp": (math.exp, mpmath.exp), "expm1": (math.expm1, mpmath.expm1),
    "log": (math.log, mpmath.log), "log1p": (math.log1p, lambda x: mpmath.log(1 + x)),
    "log2": (math.log2, lambda x: mpmath.log(x, 2)),
    "log10": (math.log10, mpmath.log10), "cbrt": (np.cbrt, mpmath.cbrt), "sin": (np.sin, mpmath.sin),
    "cos": (math.cos, mpmath.cos),
    "tan": (np.tan, mpmath.tan), "asin": (math.asin, mpmath.asin), "acos": (np.arccos, mpmath.acos),
    "atan": (np.arctan, mpmath.atan), "sinh": (math.sinh, mpmath.sinh), "cosh": (np.cosh, mpmath.cosh),
    "tanh": (math.tanh, mpmath.tanh), "asinh": (math.asinh, mpmath.asinh),
    "acosh": (lambda x: math.acosh(x + 1), lambda x: mpmath.acosh(x + 1)),
    "atanh": (np.arctanh, mpmath.atanh), "erf": (math.erf, mpmath.erf), "erfc": (special.erfc, mpmath.erfc),
    "gamma": (math.gamma, mpmath.gamma), "lgamma": (math.lgamma, mpmath.loggamma),
    "psi": (special.psi, mpmath.psi0 if hasattr(mpmath, "psi0") else mpmath.digamma),
    "power": (lambda x: x**2.7, lambda x: x ** mpmath.mpf(2.7)), "whole": (lambda x: x**-3, lambda x: x**-3),
    "base": (lambda x: 2.5**x, lambda x: mpmath.mpf(2.5) ** x), "self": (lambda x: x**x, lambda x: x**x),
    "atan2": (lambda x: math.atan2(x, 1 - x), lambda x: mpmath.atan2(x, 1 - x)),
    "hypot": (lambda x: math.hypot(x, 2.0), lambda x: mpmath.hypot(x, 2)),
    "expit": (special.expit, lambda x: 1 / (1 + mpmath.exp(-x))), "exp2": (np.exp2, lambda x: mpmath.mpf(2) ** x),
}  # fmt: skip


@pytest.mark.parametrize("name", ELEMENTARY)
def test_functions_and_their_derivatives(name):
    """Value, first and second derivative against mpmath, within a few units in the last place of their condition."""
    function, known = ELEMENTARY[name]
    places = [0.137, 0.31, 0.77]
    value, slope, second = of_one(lambda u, p: function(u.x), places)
    with mpmath.workdps(40):
        for i, x in enumerate(places):
            exact = [mpmath.diff(known, mpmath.mpf(x), order) for order in range(3)]
            size = max(abs(each) for each in exact)
            for found, right in zip((value[i], slope[i], second[i]), exact):
                assert abs(found - right) <= 2e-14 * size


@pytest.mark.parametrize("x", [-2.3, -0.4, 0.2, 1.0, 7.5, 40.0])
def test_polygamma_functions(x):
    """Derivatives of log gamma up to the fourth against mpmath."""
    batch = Batch([lambda u, p: special.gammaln(u.x) if x > 0 else special.psi(u.x)], [0], ["x"], [], times=False)
    given, one = (np.zeros(1), np.array([[x]]), NONE, np.empty(0)), np.ones((1, 1))
    first = 0 if x > 0 else 1
    with mpmath.workdps(40):
        for order in range(1, 5):
            found = batch.along(*given, [one] * order)[0, 0]
            exact = mpmath.psi(order - 1 + first, mpmath.mpf(x))
            assert abs(found - exact) <= 3e-14 * max(abs(exact), 1)


# --- decisions
# ------------------------------------------------------------------------------------------------------------------


def test_decisions_are_joined():
    """All four paths of two decisions, and the derivative on each; the path not taken may have no value."""

    def function(u, p):
        x = u.x
        if x > 0:
            y = math.log(x)
        else:
            y = -(x**2)
        return y * (3.0 if y < -1 else math.sqrt(y + 1))

    x = [-2.0, -0.5, 0.1, 2.0]
    value, slope, _ = of_one(function, x)
    assert np.allclose(
        value, [-12, -0.25 * math.sqrt(0.75), 3 * math.log(0.1), math.log(2) * math.sqrt(1 + math.log(2))], rtol=1e-15
    )
    root_of = math.sqrt(0.75)
    left = (0.5 * 2 * 0.5) * 0 + (-2 * -0.5) * (root_of + -0.25 / (2 * root_of))
    right = math.sqrt(1 + math.log(2))
    assert np.allclose(slope, [12, left, 30, (right + math.log(2) / (2 * right)) / 2], rtol=1e-14)


def test_a_side_that_is_not_taken_may_be_nan():
    """The derivative of sqrt is infinite at 0 and nan below; a selection hides it, in all orders."""
    value, slope, second = of_one(lambda u, p: u.x * (math.sqrt(u.x) if u.x > 0 else 0.0) ** 2, [-1.0, 0.0, 4.0])
    assert np.allclose(value, [0, 0, 16], rtol=1e-15, atol=0)
    assert np.allclose(slope, [0, 0, 8]) and np.allclose(second, [0, 0, 2])
    value, slope, _ = of_one(lambda u, p: np.where(u.x > 0, np.log(u.x), u.x * 3), [-1.0, 2.0])
    assert np.allclose(value, [-3, math.log(2)]) and np.allclose(slope, [3, 0.5])


def test_selections_without_decisions():
    cases = {
        lambda u, p: abs(u.x - 1): ([-1, 1], [2, 1], [-1, 1]),
        lambda u, p: max(u.x, 0.5, p[0] * 0.25): (None, None, None),
    }
    (absolute, _), (largest, _) = cases.items()
    value, slope, _ = of_one(absolute, [-1.0, 2.0])
    assert np.allclose(value, [2, 1], rtol=1e-15) and np.allclose(slope, [-1, 1], rtol=1e-15)
    value, slope, _ = of_one(largest, [0.0, 0.6, 3.0], [3.0])
    assert np.allclose(value, [0.75, 0.75, 3], rtol=1e-15) and np.allclose(slope, [0, 0, 1], rtol=1e-15, atol=0)
    value, slope, _ = of_one(lambda u, p: np.clip(u.x, -1, 1) + np.sign(u.x) + math.floor(u.x) + u.x % 3, [-2.5, 0.5, 5.5])
    assert np.allclose(value, [-1 - 1 - 3 + 0.5, 0.5 + 1 + 0 + 0.5, 1 + 1 + 5 + 2.5]) and np.allclose(slope, [1, 2, 1])
    value, slope, _ = of_one(lambda u, p: np.select([u.x < 0, u.x < 1], [u.x, 2 * u.x], 3 * u.x - 1), [-2.5, 0.5, 5.5])
    assert np.allclose(value, [-2.5, 1, 15.5], rtol=1e-15) and np.allclose(slope, [1, 2, 3], rtol=1e-15)


def test_a_loop_of_known_length_and_a_search():
    """Newton's square root in a loop of fixed length; a loop that ends by a comparison is no recording."""

    def fixed(u, p):
        y = u.x
        for _ in range(30):
            y = (y + u.x / y) / 2
        return y

    value, slope, _ = of_one(fixed, [2.0, 9.0])
    assert np.allclose(value, np.sqrt([2, 9]), rtol=1e-15) and np.allclose(slope, 0.5 / np.sqrt([2, 9]), rtol=1e-14)

    def until(u, p):
        y = u.x
        while abs(y * y - u.x) > 1e-12:
            y = (y + u.x / y) / 2
        return y

    batch = Batch([until], [0], ["x"], [], times=False)
    assert batch.interpreted is not None and "loop that ends by a comparison" in batch.describe()


# --- what functions may do
# --------------------------------------------------------------------------------------------------------


MATRIX = np.array([[1.0, 2.0, 0.0], [0.5, -1.0, 3.0], [0.0, 4.0, 1.0]])
SPARSE = scipy.sparse.csr_matrix(MATRIX)
SPLINE = CubicSpline([0, 1, 2, 4], [1.0, 3.0, -1.0, 2.0])
MONOTONE = PchipInterpolator([0, 1, 2, 4], [1.0, 3.0, 3.5, 7.0])


class Law:
    """A law with parameters of its own."""

    stiffness = 3.0

    def force(self, x):
        return self.stiffness * self._bend(x)

    def _bend(self, x):
        return math.sin(x)


LAW = Law()
ARRAYS = {
    "mean": lambda u, p: np.mean(u**2), "norm": lambda u, p: np.linalg.norm(u), "product": lambda u, p: u @ u,
    "sum": lambda u, p: np.sum(np.exp(u) * [1, 2, 3]), "matrix": lambda u, p: np.sum(np.sin(MATRIX @ u)),
    "sparse": lambda u, p: u @ (SPARSE @ u) + (SPARSE.T @ u)[0], "dot": lambda u, p: np.dot(u, MATRIX).sum(),
    "roll": lambda u, p: np.sum((np.roll(u, 1) - 2 * u + np.roll(u, -1)) ** 2), "max": lambda u, p: np.max(u) - u.min(),
    "concatenate": lambda u, p: np.sum(np.cumsum(np.concatenate([[p.a], u])) ** 2),
    "diff": lambda u, p: np.sum(np.diff(u) ** 3),
    "where": lambda u, p: np.where(u > 0.5, u, u**2).sum(), "spline": lambda u, p: np.sum(SPLINE(u)) * MONOTONE(u[1]),
    "interp": lambda u, p: np.interp(u, [0, 1, 3], [0, 2, 1]).sum() * np.interp(p.a, [0, 1], [1, 3]),
    "stack": lambda u, p: np.prod(np.stack([u, 2 * u]).sum(axis=0)), "einsum": lambda u, p: np.trapezoid(u**2, dx=0.1),
    "object": lambda u, p: LAW.force(u[0]) + LAW.stiffness * u[1], "zeros": lambda u, p: _filled(u).sum(),
    "partial": functools.partial(lambda k, u, p: k * u[0] * u[2], 2.5), "outer": lambda u, p: np.outer(u, u).sum(),
    "complex": lambda u, p: u.real[0] * u[1], "polynomial": lambda u, p: np.polyval([1, -2, 3], u).sum(),
    "cross": lambda u, p: np.cross(u, [1.0, 2.0, 3.0]) @ u + np.cross(u, u**2)[0],
    "vectorized": lambda u, p: sum(map(math.cos, u)),
    "cached": lambda u, p: _cached(u[0]),
    "float": lambda u, p: float(u[0]) * np.float64(2.0) * (1.0 if isinstance(u[1], float) else 2.0),
}  # fmt: skip


@functools.cache
def _cached(x):
    return x**3 if isinstance(x, float) else 8.0 * x**3


def _filled(u):
    result = np.zeros(3)
    for i in range(3):
        result[i] = u[i] * u[i - 1]
    result[1:] += u[:-1]
    return result


@pytest.mark.parametrize("case", ARRAYS)
def test_arrays_and_objects(case):
    """Against the same function in Python, and its differences of fourth order."""
    function = ARRAYS[case]
    filling = functools.wraps(function)(lambda u, p: function(np.array(u), p)) if case == "vectorized" else function
    batch = Batch([filling], [0], ["x", "y", "z"], ["a"], times=False)
    assert batch.interpreted is None, batch.describe()
    u, p = np.array([0.7, 0.3, 1.4]), np.array([0.4])
    named = contin.AlgebraicProblem(lambda u, p: (u.x,), ["x"], {"a": 0.4}).parameters

    class P:
        a = named["a"]

    values, slopes = batch.jacobian(np.zeros(1), u[None], np.empty((0, 3)), p, batch.columns([]))
    with np.errstate(all="ignore"):
        assert values[0, 0] == pytest.approx(function(u, P), rel=1e-14)
        h = 1e-3
        for i, e in enumerate(np.eye(3)):
            sides = [function(u + k * h * e, P) - function(u - k * h * e, P) for k in (1, 2)]
            assert slopes[0, 0, i] == pytest.approx((8 * sides[0] - sides[1]) / (12 * h), rel=1e-8, abs=1e-9)


def _guard(x):
    if abs(x) > 1e-6:
        return x / (1 - math.exp(-x))
    return 1 + x / 2


def _nested_guards(u, p):
    values = []
    for k in range(20):
        x = u[k] - k
        if x > 1e-6:
            rate = x / (1 - math.exp(-x))
        elif x < -1e-6:
            rate = x * math.exp(x) / (math.exp(x) - 1)
        else:
            rate = 1 + x / 2
        values.append(rate * (1 - u[k]) - u[(k + 1) % 20] * rate)
    return values


GUARDED = {
    "nested": _nested_guards, "product": lambda u, p: math.prod(_guard(x) for x in u) * u,
    "sum": lambda u, p: sum(_guard(u[k] - k) * u[k] for k in range(20)) * u + [_guard(x) for x in u],
}  # fmt: skip


@pytest.mark.sample(1)
@pytest.mark.parametrize("name", GUARDED)
def test_independent_guards_are_joined_one_by_one(name):
    """Twenty of them have a million paths or more; values and derivatives are those of Python on any of them."""
    batch = Batch([GUARDED[name]], [20], [f"x{k}" for k in range(20)], [], times=False)
    assert batch.interpreted is None, batch.describe()
    u = np.random.default_rng(0).normal(0, 3, (40, 20))
    u[0], u[1], u[2, :10] = np.arange(20), 1e-8, np.arange(10)
    given = np.zeros(40), u, np.empty((0, 20)), np.empty(0)
    expected = np.array([GUARDED[name](each, ()) for each in u])
    assert np.abs(batch.values(*given) - expected).max() <= 1e-14 * np.abs(expected).max()
    step = 1e-5 * np.eye(20)[3]
    slope = np.array([np.subtract(GUARDED[name](each + step, ()), GUARDED[name](each - step, ())) for each in u[3:]]) / 2e-5
    found = batch.jacobian(*given, batch.columns([]))[1][3:, :, 3]
    assert np.abs(found - slope).max() <= 1e-8 * np.abs(slope).max()


def test_a_hundred_independent_decisions():
    batch = Batch([lambda u, p: [_guard(x) for x in u]], [100], [f"x{k}" for k in range(100)], [], times=False)
    u = np.where(np.arange(100) % 3, np.arange(100) / 7, 0.0)
    assert batch.values(np.zeros(1), u[None], np.empty((0, 100)), np.empty(0))[0] == pytest.approx([*map(_guard, u)], 1e-14)
    assert batch.interpreted is None


def _counted(u, p):
    count = 0
    for x in u:
        if x > 0:
            count += 1
    return [x if count == 2 else 2 * x for x in u]


def test_decisions_that_depend_on_each_other_are_not_joined():
    """No path of one or of random outcomes shows that two of twenty make a difference; the count does."""
    batch = Batch([_counted], [20], [f"x{k}" for k in range(20)], [], times=False)
    assert "write those of values as np.where(condition, a, b)" in batch.describe()


def test_random_expressions():
    """Sixty random formulas of three inputs: value bit for bit as Python, gradient and Hessian against tangents of
    tangents."""
    source = random.Random(5)

    def formula(depth):
        if depth == 0:
            return source.choice(["x", "y", "k", "0.7", "-1.3"])
        kind = source.choice(["+", "-", "*", "/", "sin", "exp", "atan", "if", "max"])
        a, b = formula(depth - 1), formula(depth - 1)
        if kind in "+-*":
            return f"({a} {kind} {b})"
        if kind == "/":
            return f"({a} / (2 + {b} * {b}))"
        if kind == "if":
            return f"({a} if {b} > 0.1 else {b})"
        return f"max({a}, {b})" if kind == "max" else f"math.{kind}(0.3 * {a})"

    u, p = np.random.default_rng(3).uniform(-2, 2, (7, 2)), np.array([0.4])
    for _ in range(60):
        text = formula(source.randint(1, 4))
        function = eval(f"lambda u, p: (lambda x, y, k: {text})(u[0], u[1], p[0])", {"math": math})
        batch = Batch([function], [0], ["x", "y"], ["k"], times=False)
        assert batch.interpreted is None, (text, batch.describe())
        given = np.zeros(7), u, np.empty((0, 2)), p
        columns = batch.columns([0])
        values, slopes = batch.jacobian(*given, columns)
        assert np.allclose(values[:, 0], [function(row.tolist(), [0.4]) for row in u], rtol=1e-13, atol=1e-13), text
        directions = np.random.default_rng(4).standard_normal((2, 7, 3))
        once = batch.along(*given, [directions[0]])
        assert np.allclose(once, np.einsum("kaj,kj->ka", slopes, directions[0]), rtol=1e-11, atol=1e-11), text
        twice = batch.along(*given, directions)
        bent = batch.bent(*given, np.ones((7, 1)), directions[0], columns)
        turned = batch.jacobian_along(*given, columns, [directions[0]])[:, 0]
        assert np.allclose(bent, turned, rtol=1e-10, atol=1e-10), text
        assert np.allclose(np.einsum("kj,kj->k", bent, directions[1]), twice[:, 0], rtol=1e-10, atol=1e-10), text


def test_hidden_state_is_found():
    """A function that is not the same when it is called again is evaluated in Python."""
    calls = []

    def counting(u, p):
        calls.append(1)
        return u.x * len(calls)

    generator = np.random.default_rng(1)
    for function in (counting, lambda u, p: u.x + generator.random()):
        assert "not the same when it is called again" in Batch([function], [0], ["x"], [], times=False).describe()


def test_a_changed_constant_is_seen():
    law = Law()
    batch = Batch([lambda u, p: law.force(u.x)], [0], ["x"], [], times=False)
    assert batch.is_current()
    law.stiffness = 4.0
    assert not batch.is_current()


def imports(u, p):
    from contin.levels import ROUGH

    return ROUGH * u.x


def test_constants_that_cannot_change_in_place_are_compared_without_a_recording(monkeypatch):
    """Numbers that a function and what it calls read are compared by identity; with lists, it is recorded anew."""
    stiffness, other = 2.0, [1.0]

    def force(x):
        return stiffness * math.sin(x)

    plain = Batch([lambda u, p: force(u.x)], [0], ["x"], [], times=False)
    listed = Batch([lambda u, p: other[0] * u.x], [0], ["x"], [], times=False)
    importing = Batch([imports], [0], ["x"], [], times=False)
    monkeypatch.setattr(recording, "record", lambda *given: pytest.fail("recorded"))
    assert plain.is_current()
    for batch in (listed, importing):  # what is imported inside may be any module
        with pytest.raises(BaseException, match="recorded"):
            batch.is_current()
    monkeypatch.undo()
    assert listed.is_current()
    other[0] = 3.0
    stiffness = 3.0
    assert not plain.is_current() and not listed.is_current()


def test_what_cannot_be_recorded_is_said_once_with_the_reason():
    def catching(u, p):
        try:
            return (math.sqrt(u.x) - p.a,)
        except ValueError:
            return (-p.a,)

    problem = contin.AlgebraicProblem(catching, ["x"], {"a": 2.0})
    with pytest.warns(InterpretedWarning, match="catching is evaluated in Python.*catches exceptions"):
        assert contin.solve(problem, [3.0])["x" if False else "a"] == 2.0
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        contin.solve(problem, [3.0])


def load(path):
    try:
        return open(path)
    except OSError:
        return None


def test_a_parameter_may_be_named_like_a_function_beside_it():
    """The function above is not called: ``p.load`` is an attribute."""
    batch = Batch([lambda u, p: (p.load * u.x,)], [1], ["x"], ["load"], times=False)
    assert batch.interpreted is None
    assert batch.values(np.zeros(1), np.array([[2.0]]), np.empty((0, 1)), np.array([3.0]))[0, 0] == pytest.approx(6)


def test_differences_beside_a_narrow_feature():
    """A step of width 1e-4 evaluated in Python: the derivative is right beside it, and its estimated error says how well."""

    class Foreign:
        def __call__(self, x):
            return np.tanh(np.asarray(x, dtype=float) / 1e-4) if not isinstance(x, complex) else math.tanh(x)

    def steep(u, p, foreign=np.vectorize(lambda x: math.tanh(float(x) / 1e-4))):
        return foreign(u.x) + u.x

    batch = Batch([steep], [0], ["x"], [], times=False)
    assert batch.interpreted is not None
    for x in (0.0, 5e-5, 3e-4, 0.1):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            slope = batch.jacobian(np.zeros(1), np.array([[x]]), NONE, np.empty(0), batch.columns([]))[1].item()
        assert slope == pytest.approx(1 + 1e4 * (1 - math.tanh(x / 1e-4) ** 2), rel=1e-6)


# --- unknowns found by iteration ----------------------------------------------------------------------------------------------


def test_a_root_and_its_derivatives():
    """w + w^3 = a x: w' = a/(1 + 3 w^2), w'' = -6 a^2 w/(1 + 3 w^2)^3."""
    x = np.linspace(-4, 5, 40)
    w, slope, second = of_one(lambda u, p: root(lambda w: (w[0] + w[0] ** 3 - p.p0 * u.x,), [0.0])[0], x, [2.0])
    assert np.abs(w + w**3 - 2 * x).max() < 1e-14
    assert np.abs(slope - 2 / (1 + 3 * w**2)).max() < 1e-15
    assert np.abs(second + 24 * w / (1 + 3 * w**2) ** 3).max() < 1e-14


def test_a_minimum_of_two_unknowns():
    """The least of (a - x)^2 + cosh(b) - x b + a b: its gradient vanishes, and derivatives agree with those of the
    equations."""

    def found(u, p):
        a, b = minimum(lambda w: (w[0] - u.x) ** 2 + math.cosh(w[1]) - u.x * w[1] + 0.5 * w[0] * w[1], [0.0, 0.0])
        return a, b

    batch = Batch([found], [2], ["x"], [], times=False)
    x = np.linspace(-3, 3, 33)
    given = np.zeros(33), x[:, None], NONE, np.empty(0)
    (values, slopes), one = batch.jacobian(*given, batch.columns([])), np.ones((33, 1))
    a, b = values.T
    assert np.abs(2 * (a - x) + 0.5 * b).max() < 1e-13 and np.abs(np.sinh(b) - x + 0.5 * a).max() < 1e-13
    matrix = np.array([[np.full(33, 2.0), np.full(33, 0.5)], [np.full(33, 0.5), np.cosh(b)]]).transpose(2, 0, 1)
    exact = np.linalg.solve(matrix, np.tile([[2.0], [1.0]], (33, 1, 1)))[:, :, 0]
    assert np.abs(slopes[:, :, 0] - exact).max() < 1e-13
    second = np.linalg.solve(matrix, np.stack([np.zeros(33), -np.sinh(b) * exact[:, 1] ** 2], axis=1)[:, :, None])[:, :, 0]
    assert np.abs(batch.along(*given, [one, one]) - second).max() < 1e-12


def test_where_there_is_no_minimum_the_value_is_nan():
    batch = Batch([lambda u, p: minimum(lambda w: u.x * w[0] + math.exp(w[0]), [0.0])[0]], [0], ["x"], [], times=False)
    values = batch.values(np.zeros(2), np.array([[1.0], [-math.e]]), NONE, np.empty(0))[:, 0]
    assert np.isnan(values[0]) and values[1] == pytest.approx(1, rel=1e-15)


def test_searches_in_plain_python_and_their_refusals():
    assert root(lambda w: (w[0] ** 2 - 2,), [1.0])[0] == pytest.approx(math.sqrt(2), rel=1e-15)
    assert minimum(lambda w: math.cosh(w[0] - 1), [0.0])[0] == pytest.approx(1, abs=1e-12)
    with pytest.raises(ProblemError, match="start: 0 unknowns, must be 1 to 16"):
        root(lambda w: (), [])
    with pytest.raises(ProblemError, match="residual returns 2 values, must return 1"):
        root(lambda w: (w[0], w[0]), [0.0])


# --- the machinery
# ---------------------------------------------------------------------------------------------------------------


def test_equal_operations_are_stored_once():
    tape = Tape()
    x = tape.input(0)
    assert ((x + 1) * 2).place == (2 * (1 + x)).place and (x * 1).place == x.place and (x - x).known == 0


def test_vertex_elimination_against_forward_mode():
    """A chain with many users: rows of the Jacobian are the tangents along unit vectors."""
    tape = Tape()
    x = [tape.input(i) for i in range(4)]
    y = [x[0] * x[1], x[1] / x[2]]
    for _ in range(6):
        y = [y[0] * y[1] + x[3], y[1] - x[0] * y[0]]
    values = {0: 0.3, 1: -0.8, 2: 1.7, 3: 0.2}
    found = jacobian(tape, [each.place for each in y], [each.place for each in x])
    dense = dict(zip(found, tape.evaluate(list(found.values()), values)))
    for j in range(4):
        along = {each.place: tape.constant(float(i == j)) for i, each in enumerate(x)}
        forward = tape.evaluate(tangents(tape, [each.place for each in y], along), values)
        assert np.allclose(forward, [dense.get((i, j), 0.0) for i in range(2)], rtol=1e-13)


def test_the_same_bits_alone_in_blocks_and_in_threads(monkeypatch):
    """A point has the same bits in a block of any length, and the mesh may be divided among threads."""

    def field(t, u, p):
        return u.y * math.exp(-u.x) + t, math.sin(u.x * p.k) / (1 + u.y**2) + root(lambda w: (w[0] ** 3 + w[0] - u.x,), [0.0])[
            0
        ]

    batch = Batch([field], [2], ["x", "y"], ["k"])
    u, t, p, none = (
        np.random.default_rng(2).standard_normal((999, 2)),
        np.linspace(0, 1, 999),
        np.array([1.3]),
        np.empty((0, 2)),
    )
    columns = batch.columns([0])
    whole = batch.jacobian(t, u, none, p, columns)
    for a, b in ((0, 1), (5, 6), (100, 131), (900, 999)):
        part = batch.jacobian(t[a:b], u[a:b], none, p, columns)
        assert all(np.array_equal(x[a:b], y) for x, y in zip(whole, part))
    monkeypatch.setattr("contin.functions.batch._LONG", 0.0)
    monkeypatch.setattr("contin.threads.count", lambda: 3)
    again = batch.jacobian(t, u, none, p, columns)
    assert all(np.array_equal(x, y) for x, y in zip(whole, again))


def test_a_gradient_inside_a_recorded_function():
    """sigma = dW/dstrain of W = cosh(e) + k e^2, with k from the parameters; its slope is d2W."""
    stress = gradient(lambda e, k: math.cosh(e) + k * e**2, ["e"])
    value, slope, _ = of_one(lambda u, p: stress(u.x, p.p0)[1], [0.3, -1.0], [2.0])
    assert np.allclose(value, np.sinh([0.3, -1]) + 4 * np.array([0.3, -1]), rtol=1e-15)
    assert np.allclose(slope, np.cosh([0.3, -1]) + 4, rtol=1e-15)


def test_problems_travel_and_compare_by_value():
    def stated(k):
        return contin.BoundaryValueProblem(
            lambda t, u, p: (u.v, -k * p.lam * math.exp(u.u)), lambda a, b, p: (a.u, b.u), ["u", "v"], {"lam": 1.0}
        )

    one, same, other = stated(1.0), stated(1.0), stated(2.0)
    assert one == same and hash(one) == hash(same) and one != other
    carried = pickle.loads(pickle.dumps(one))
    assert carried == one
    assert np.array_equal(contin.solve(carried, [0, 0]).x, contin.solve(one, [0, 0]).x)


def test_a_search_reads_the_time():
    """The root of w + w^3 = cos t is recorded with its time, also where Python evaluates the recording to compare both."""

    def field(t, u, p):
        (w,) = root(lambda w: (w[0] + w[0] ** 3 - math.cos(t),), [0.0])
        return (w,)

    batch = Batch([field], [1], ["x"], [])
    assert batch.interpreted is None
    times = np.linspace(0, 3, 7)
    found = batch.values(times, np.zeros((7, 1)), np.empty((0, 1)), np.empty(0))[:, 0]
    assert np.abs(found + found**3 - np.cos(times)).max() < 1e-14
