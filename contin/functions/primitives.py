"""The operations of a tape: value, derivative, kernel code and names of each, side by side.

`TABLE` has a `Primitive` for every name; where Python's ``math`` has the function, it is that name. A rule of derivatives gets
the operands and the result as recorded numbers and returns the derivative by each operand, recorded as well, so that
derivatives have derivatives.

Functions with an ``external`` name are those of the C library in the kernel. The others are written out in
`contin.functions.interpreter`.
"""

from __future__ import annotations

import functools
import math
import operator
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from contin.kernels.kernel_parts import helper
from contin.levels import TINY

#: Places of operands on a tape, and recorded operands.
Places = tuple[int, ...]
Operands = Sequence[Any]


class Recorder(Protocol):
    """What rules need of a `contin.functions.tape.Tape`."""

    operations: list[Any]
    decide: Callable[[int], bool] | None

    def value(self, place: int) -> float | None: ...
    def constant(self, value: float) -> int: ...
    def at(self, name: str, places: Places, data: object = None) -> int: ...
    def apply(self, name: str, *operands: object, data: object = None) -> Any: ...


@dataclass(frozen=True)
class Primitive:
    """An operation.

    - ``evaluate`` (callable): ``evaluate(data, *operands)`` returns the value for plain numbers; never an exception, but nan or
      inf.
    - ``partials`` (callable): ``partials(tape, data, operands, result)`` returns the derivative by each operand: a recorded
      number, a number, or None where it is zero everywhere.
    - ``external`` (str): The C library's function.
    - ``ufunc`` (str): Name of the universal function of NumPy or SciPy that records the operation.
    - ``pair`` (callable, optional): ``pair(apply, x, y)`` returns the real and the imaginary part of the function of x + i y;
      ``apply`` is that of the tape.
    - ``constant`` (callable, optional): ``evaluate`` where an operation of constants is carried out when it is recorded.
    - ``simplify`` (callable, optional): ``simplify(tape, places)`` returns the place of an equal operation that is simpler, or
      None.
    - ``commutes`` (bool): The two operands may be exchanged.
    - ``selects`` (bool): A derivative is zero where the operand is not chosen, and the value there may be nan.
    """

    evaluate: Callable[..., float]
    partials: Callable[..., Any]
    external: str = ""
    ufunc: str = ""
    pair: Callable[..., tuple[Any, Any]] | None = None
    constant: Callable[..., float] | None = None
    simplify: Callable[..., int | None] | None = None
    commutes: bool = False
    selects: bool = False


def _quiet(function: Callable[..., Any]) -> Callable[..., float]:
    """Return a NumPy function of numbers after ``data``. It warns; callers silence it, once for all operations."""
    if function in (np.add, np.subtract, np.multiply):
        plain = getattr(operator, function.__name__[:3])  # a tenth of the time for the same number
        return lambda data, one, other: plain(one, other)
    return lambda data, *operands: float(function(*map(np.float64, operands)))


# --- simplifications: the value is the same; zero times a number only where it is finite, so not of what a user wrote
# -------------------------------------------------------------


def _negated(tape: Recorder, place: int) -> int | None:
    """Return what an operation is the negative of."""
    name, operands, _ = tape.operations[place]
    return operands[0] if name == "neg" else None


def _simple_add(tape: Recorder, places: Places) -> int | None:
    for one, other in (places, places[::-1]):
        name, operands, data = tape.operations[one]
        if name == "constant" and data == 0:
            return other
        if name == "neg":
            return tape.at("sub", (other, operands[0]))
    return None


def _simple_sub(tape: Recorder, places: Places) -> int | None:
    a, b = places
    if tape.value(b) == 0:
        return a
    if tape.value(a) == 0:
        return tape.at("neg", (b,))
    if a == b and tape.decide is None:
        return tape.constant(0.0)
    negated = _negated(tape, b)
    return None if negated is None else tape.at("add", (a, negated))


def _simple_times(tape: Recorder, places: Places, name: str = "mul") -> int | None:
    for one, other in (places, places[::-1]):
        kind, operands, value = tape.operations[one]
        if kind == "neg":
            return tape.at("neg", (tape.at(name, (operands[0], other)),))
        if kind != "constant":
            continue
        if value == 0 and tape.decide is None:
            return tape.constant(0.0)
        if value == 1:
            return other
        if value == -1:
            return tape.at("neg", (other,))
    return None


def _simple_div(tape: Recorder, places: Places) -> int | None:
    a, b = places
    if tape.value(b) == 1:
        return a
    if tape.value(a) == 0 and tape.decide is None:
        return tape.constant(0.0)
    negated = _negated(tape, a)
    return None if negated is None else tape.at("neg", (tape.at("div", (negated, b)),))


def _simple_select(tape: Recorder, places: Places) -> int | None:
    condition, a, b = places
    value = tape.value(condition)
    if value is not None:
        return a if value != 0 else b
    return a if a == b else None


# --- derivatives --------------------------------------------------------------------------------------------------------------


def _are_squares(tape: Recorder, place: int) -> bool:
    """Return whether a number is a sum of squares, by how it is computed."""
    name, operands, _ = tape.operations[place]
    if name in ("add", "sum"):
        return all(_are_squares(tape, each) for each in operands)
    half = len(operands) // 2
    return name in ("mul", "dot") and operands[:half] == operands[half:]


def _of_select(tape: Recorder, data: None, operands: Operands, result: object) -> tuple[Any, Any, Any]:
    condition = operands[0]
    return None, tape.apply("select", condition, 1.0, 0.0), tape.apply("select", condition, 0.0, 1.0)


def _one(function: Callable[..., Any]) -> Callable[..., Any]:
    """Return a rule for one operand from ``function(tape, x, result)``."""
    return lambda tape, data, operands, result: (function(tape, operands[0], result),)


def _none(tape: Recorder, data: object, operands: Operands, result: object) -> tuple[None, ...]:
    return (None,) * len(operands)


#: 2 / sqrt(pi), the slope of the error function at 0.
_OF_ERF = 2 / math.sqrt(math.pi)


#: Bernoulli numbers B_2, B_4, ...
BERNOULLI = (1 / 6, -1 / 30, 1 / 42, -1 / 30, 5 / 66, -691 / 2730, 7 / 6)


@helper
def polygamma(order: int, x: float) -> float:
    """Return the derivative of this order (0: itself) of the logarithmic derivative of the gamma function.

    Raised to 15 by recurrence, then the asymptotic series (DLMF 5.11.2, differentiated).
    """
    if (x <= 0 and x == math.floor(x)) or not math.isfinite(x):
        return math.nan
    sign = -1.0 if order % 2 == 0 else 1.0
    total, factorial = 0.0, 1.0
    for j in range(2, order + 1):
        factorial *= j
    while x < 15:
        total += sign * factorial / x ** (order + 1)
        x += 1
    tail, power = 0.0, 1.0
    for k in range(1, 8):
        power /= x * x
        rising = 1.0 / (2 * k) if order == 0 else 1.0
        for j in range(1, order):
            rising *= 2.0 * k + j
        tail += BERNOULLI[k - 1] * rising * power
    if order == 0:
        return total + math.log(x) - 0.5 / x - tail
    return total + sign * (factorial / order + factorial / (2 * x) + tail) / x**order


def _sum(data: None, *operands: float) -> float:
    return functools.reduce(operator.add, operands)


def _dot(data: None, *operands: float) -> float:
    half = len(operands) // 2
    return _sum(None, *map(operator.mul, operands[:half], operands[half:]))


def _linear(data: tuple[float, ...], *operands: float) -> float:
    return _dot(None, *data, *operands)


def _operation(function: Callable[..., Any], partials: Callable[..., Any], external: str = "", **more: Any) -> Primitive:
    """Return an operation of numbers, carried out where all of them are constants."""
    evaluate = _quiet(function)
    return Primitive(evaluate, partials, external, constant=evaluate, **more)


def _ufunc(function: Callable[..., Any], partials: Callable[..., Any], external: str = "", **more: object) -> Primitive:
    """Return the operation of a universal function of NumPy, or of one of SciPy's by `_special`."""
    return _operation(function, partials, external, ufunc=function.__name__, **more)


def _library(
    function: Callable[..., Any], name: str, derivative: Callable[..., Any], pair: Callable[..., tuple[Any, Any]] | None = None
) -> Primitive:
    """Return a function of one number that the C library has."""
    return _ufunc(function, _one(derivative), name, pair=pair)


def _special(name: str) -> Callable[..., Any]:
    def evaluate(x: float) -> Any:
        from scipy import special  # type: ignore[import-untyped]

        return getattr(special, name)(x)

    evaluate.__name__ = name
    return evaluate


def _root_of_pair(apply: Callable[..., Any], x: Any, y: Any) -> tuple[Any, Any]:
    """Return the root with the positive real part, written without cancellation on both sides of the imaginary axis."""
    part = apply("sqrt", (apply("hypot", x, y) + abs(x)) / 2)
    other, left = y / (2.0 * part), x < 0
    sign = apply("select", y < 0, -1.0, 1.0)
    return apply("select", left, abs(other), part), apply("select", left, sign * part, other)


def _tan_of_pair(apply: Callable[..., Any], x: object, y: object) -> tuple[Any, Any]:
    """Return the tangent, and with exchanged parts the hyperbolic one; nothing cancels near a pole."""
    sin, cos, sinh, cosh = apply("sin", x), apply("cos", x), apply("sinh", y), apply("cosh", y)
    square = cos * cos + sinh * sinh
    return sin * cos / square, sinh * cosh / square


def _of_angle(y: Any, x: Any) -> tuple[Any, Any]:
    square = x * x + y * y
    return x / square, -y / square


TABLE: dict[str, Primitive] = {
    "input": Primitive(lambda data: math.nan, _none),
    "constant": Primitive(lambda data: data, _none),
    # arithmetic
    "add": _ufunc(np.add, lambda *_: (1.0, 1.0), simplify=_simple_add, commutes=True),
    "sub": _ufunc(np.subtract, lambda *_: (1.0, -1.0), simplify=_simple_sub),
    "mul": _ufunc(np.multiply, lambda tape, data, xs, r: (xs[1], xs[0]), simplify=_simple_times, commutes=True),
    "div": _ufunc(np.divide, lambda tape, data, xs, r: (1.0 / xs[1], -r / xs[1]), simplify=_simple_div),
    "neg": _ufunc(np.negative, lambda *_: (-1.0,), simplify=lambda tape, places: _negated(tape, places[0])),
    # n operands: their sum; a scalar product of two halves; a sum with constant factors
    "sum": Primitive(_sum, lambda tape, data, xs, r: (1.0,) * len(xs), constant=_sum),
    "dot": Primitive(_dot, lambda tape, data, xs, r: (*xs[len(xs) // 2 :], *xs[: len(xs) // 2]), constant=_dot),
    "linear": Primitive(_linear, lambda tape, data, xs, r: data, constant=_linear),
    # decisions
    "lt": _ufunc(np.less, _none),
    "le": _ufunc(np.less_equal, _none),
    "eq": _ufunc(np.equal, _none, commutes=True),
    "select": _operation(lambda c, a, b: a if c != 0 else b, _of_select, simplify=_simple_select, selects=True),
    # a product that is 0 where one of its factors is, also if the other one is nan or inf
    "product": _operation(
        lambda x, y: 0.0 if x == 0 or y == 0 else x * y, lambda tape, data, xs, r: (xs[1], xs[0]),
        simplify=lambda tape, places: _simple_times(tape, places, "product"), commutes=True, selects=True,
    ),
    "abs": _ufunc(np.absolute, lambda tape, data, xs, r: (tape.apply("select", xs[0] < 0, -1.0, 1.0),)),
    "sign": _ufunc(np.sign, _none),
    "floor": _ufunc(np.floor, _none),
    "ceil": _ufunc(np.ceil, _none),
    "trunc": _ufunc(np.trunc, _none),
    "rint": _ufunc(np.rint, _none),
    # functions; those with a last entry are known of complex numbers too
    "sqrt": _library(  # the derivative of the root of a sum of squares is finite, and counts as 0 where it is 0
        np.sqrt, "", lambda tape, x, r: 0.5 / (r + TINY / r if _are_squares(tape, x.place) else r), _root_of_pair
    ),
    "exp": _library(
        np.exp, "exp", lambda tape, x, r: r,
        lambda f, x, y: (f("exp", x) * f("cos", y), f("exp", x) * f("sin", y)),
    ),
    "exp2": _library(np.exp2, "exp2", lambda tape, x, r: r * math.log(2)),
    "expm1": _library(np.expm1, "expm1", lambda tape, x, r: tape.apply("exp", x)),
    "log": _library(
        np.log, "log", lambda tape, x, r: 1.0 / x,
        lambda f, x, y: (f("log", f("hypot", x, y)), f("atan2", y, x)),
    ),
    "log1p": _library(np.log1p, "log1p", lambda tape, x, r: 1.0 / (1.0 + x)),
    "log2": _library(np.log2, "log2", lambda tape, x, r: (1 / math.log(2)) / x),
    "log10": _library(np.log10, "log10", lambda tape, x, r: (1 / math.log(10)) / x),
    "cbrt": _library(np.cbrt, "cbrt", lambda tape, x, r: 1.0 / (3.0 * r * r)),
    "sin": _library(
        np.sin, "sin", lambda tape, x, r: tape.apply("cos", x),
        lambda f, x, y: (f("sin", x) * f("cosh", y), f("cos", x) * f("sinh", y)),
    ),
    "cos": _library(
        np.cos, "cos", lambda tape, x, r: -tape.apply("sin", x),
        lambda f, x, y: (f("cos", x) * f("cosh", y), -f("sin", x) * f("sinh", y)),
    ),
    "tan": _library(np.tan, "tan", lambda tape, x, r: 1.0 + r * r, _tan_of_pair),
    "asin": _library(np.arcsin, "asin", lambda tape, x, r: 1.0 / tape.apply("sqrt", 1.0 - x * x)),
    "acos": _library(np.arccos, "acos", lambda tape, x, r: -1.0 / tape.apply("sqrt", 1.0 - x * x)),
    "atan": _library(np.arctan, "atan", lambda tape, x, r: 1.0 / (1.0 + x * x)),
    "sinh": _library(
        np.sinh, "sinh", lambda tape, x, r: tape.apply("cosh", x),
        lambda f, x, y: (f("sinh", x) * f("cos", y), f("cosh", x) * f("sin", y)),
    ),
    "cosh": _library(
        np.cosh, "cosh", lambda tape, x, r: tape.apply("sinh", x),
        lambda f, x, y: (f("cosh", x) * f("cos", y), f("sinh", x) * f("sin", y)),
    ),
    "tanh": _library(np.tanh, "tanh", lambda tape, x, r: 1.0 - r * r, lambda f, x, y: _tan_of_pair(f, y, x)[::-1]),
    "asinh": _library(np.arcsinh, "asinh", lambda tape, x, r: 1.0 / tape.apply("sqrt", x * x + 1.0)),
    "acosh": _library(np.arccosh, "acosh", lambda tape, x, r: 1.0 / tape.apply("sqrt", x * x - 1.0)),
    "atanh": _library(np.arctanh, "atanh", lambda tape, x, r: 1.0 / (1.0 - x * x)),
    "erf": _library(_special("erf"), "erf", lambda tape, x, r: _OF_ERF * tape.apply("exp", -(x * x))),
    "erfc": _library(_special("erfc"), "erfc", lambda tape, x, r: -_OF_ERF * tape.apply("exp", -(x * x))),
    "gamma": _library(_special("gamma"), "tgamma", lambda tape, x, r: r * tape.apply("polygamma", x, data=0)),
    "lgamma": _library(_special("gammaln"), "lgamma", lambda tape, x, r: tape.apply("polygamma", x, data=0)),
    "polygamma": Primitive(
        lambda data, x: polygamma(data, x),
        lambda tape, data, xs, r: (tape.apply("polygamma", xs[0], data=data + 1),),
    ),
    "pow": _ufunc(np.power, lambda tape, data, xs, r: (
        xs[1] * xs[0] ** (xs[1] - 1.0), tape.apply("product", r, tape.apply("log", xs[0]))), "pow"),
    "atan2": _ufunc(np.arctan2, lambda tape, data, xs, r: _of_angle(*xs), "atan2"),
    "hypot": _ufunc(np.hypot, lambda tape, data, xs, r: (xs[0] / (r + TINY), xs[1] / (r + TINY)), "hypot"),
    "mod": _ufunc(np.mod, lambda tape, data, xs, r: (1.0, -tape.apply("floor", xs[0] / xs[1])), "fmod"),
    # a piecewise polynomial; an unknown that is found by iteration; the first operand, as a minimum over such unknowns
    "table": Primitive(
        lambda data, x: data.evaluate(x), lambda tape, data, xs, r: (tape.apply("table", xs[0], data=data.derivative()),),
        constant=lambda data, x: data.evaluate(x),
    ),
    "root": Primitive(
        lambda data, *operands: math.nan,  # `Tape.evaluate` finds it
        lambda tape, data, xs, r: data[0].partials(tape, data[1], xs),
    ),
    "least": Primitive(
        lambda data, value, *operands: value,
        lambda tape, data, xs, r: [None, *data[0].slopes_of_least(tape, xs[1:])],
    ),
}  # fmt: skip
#: Those that are analytic wherever they are finite: roots, logarithms and powers are not at 0.
ANALYTIC = {
    "input", "constant", "add", "sub", "mul", "div", "neg", "sum", "dot", "linear", "product",
    "exp", "exp2", "expm1", "sin", "cos", "tan", "sinh", "cosh", "tanh", "atan",
}  # fmt: skip
#: Functions of the C library of two numbers.
OF_TWO = ("pow", "atan2", "hypot", "mod")
