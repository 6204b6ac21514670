"""Complex numbers of recorded parts: arithmetic, and the elementary functions by their real and imaginary parts."""

from __future__ import annotations

import cmath
import numbers
from collections.abc import Callable
from typing import Any

import numpy as np

from contin.functions.tape import Number, Tape, Unrecordable


class ComplexNumber:
    """A complex number whose parts are numbers of one tape; Python's arithmetic on it gives others.

    Attributes
    ----------
    real, imag : Number
    """

    __slots__ = ("imag", "real", "tape")

    def __init__(self, tape: Tape, real: Any, imag: Any) -> None:
        self.tape, self.real, self.imag = tape, tape.number(real), tape.number(imag)

    def __repr__(self) -> str:
        return f"<recorded complex number {self.real!r}, {self.imag!r}>"

    def conjugate(self) -> ComplexNumber:
        """Return the number with the other sign of its imaginary part."""
        return ComplexNumber(self.tape, self.real, -self.imag)

    def _with(self, function: Callable[[ComplexNumber, ComplexNumber], Any], other: Any, swapped: bool = False) -> Any:
        if not isinstance(other, (ComplexNumber, Number, numbers.Number, np.bool_)):
            return NotImplemented
        other = complex_number(self.tape, other)
        return function(other, self) if swapped else function(self, other)

    def __add__(self, other: Any) -> Any:
        return self._with(_sum, other)

    __radd__ = __add__

    def __sub__(self, other: Any) -> Any:
        return self._with(_difference, other)

    def __rsub__(self, other: Any) -> Any:
        return self._with(_difference, other, swapped=True)

    def __mul__(self, other: Any) -> Any:
        return self._with(_product, other)

    __rmul__ = __mul__

    def __truediv__(self, other: Any) -> Any:
        return self._with(_quotient, other)

    def __rtruediv__(self, other: Any) -> Any:
        return self._with(_quotient, other, swapped=True)

    def __pow__(self, other: Any) -> Any:
        if isinstance(other, numbers.Integral) and abs(int(other)) <= _LARGEST_POWER:
            return _whole_power(self, int(other))
        return self._with(_power, other)

    def __rpow__(self, other: Any) -> Any:
        return self._with(_power, other, swapped=True)

    def __neg__(self) -> ComplexNumber:
        return ComplexNumber(self.tape, -self.real, -self.imag)

    def __pos__(self) -> ComplexNumber:
        return self

    def __abs__(self) -> Number:
        return self.tape.apply("hypot", self.real, self.imag)

    def __eq__(self, other: Any) -> Any:
        return self._with(lambda a, b: (a.real == b.real) & (a.imag == b.imag), other)

    def __ne__(self, other: Any) -> Any:
        equal = self.__eq__(other)
        return equal if equal is NotImplemented else 1.0 - equal

    def _refuse(self, *_: object) -> Any:
        raise Unrecordable("it orders complex numbers, or needs the value of one")

    __lt__ = __le__ = __gt__ = __ge__ = __bool__ = __float__ = __int__ = __complex__ = __hash__ = _refuse

    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Any, **options: Any) -> Any:
        return self.tape.arrays.universal(ufunc, method, inputs, options)

    def __array_function__(self, function: Any, types: Any, inputs: Any, options: Any) -> Any:
        return self.tape.arrays.function(function, inputs, options)


#: Largest whole power that is written as products, as for real numbers.
_LARGEST_POWER = 64


def complex_number(tape: Tape, value: Any) -> ComplexNumber:
    """Return a number of any kind as a complex one."""
    if isinstance(value, ComplexNumber):
        return value
    if isinstance(value, Number):
        return ComplexNumber(tape, value, 0.0)
    value = complex(value)
    return ComplexNumber(tape, value.real, value.imag)


def is_complex(value: Any) -> bool:
    """Return whether a value is a complex number, recorded or not."""
    return isinstance(value, (ComplexNumber, complex, np.complexfloating))


def part(value: Any, name: str) -> Any:
    """Return the ``real`` or ``imag`` part of a number, or its ``conjugate``."""
    if name == "conjugate":
        return value.conjugate() if is_complex(value) else value
    return getattr(value, name)


# --- arithmetic ---------------------------------------------------------------------------------------------------------


def _sum(a: ComplexNumber, b: ComplexNumber) -> ComplexNumber:
    return ComplexNumber(a.tape, a.real + b.real, a.imag + b.imag)


def _difference(a: ComplexNumber, b: ComplexNumber) -> ComplexNumber:
    return ComplexNumber(a.tape, a.real - b.real, a.imag - b.imag)


def _times(a: Number, b: Number) -> Number:
    """Return a product; 0 where a factor is the constant 0, as an imaginary part that a real number does not have."""
    return a.tape.number(0.0) if a.known == 0 or b.known == 0 else a * b


def _product(a: ComplexNumber, b: ComplexNumber) -> ComplexNumber:
    real = _times(a.real, b.real) - _times(a.imag, b.imag)
    return ComplexNumber(a.tape, real, _times(a.real, b.imag) + _times(a.imag, b.real))


def _quotient(a: ComplexNumber, b: ComplexNumber) -> ComplexNumber:
    if b.imag.known == 0:
        return ComplexNumber(a.tape, a.real / b.real, a.imag / b.real)
    square, over = b.real * b.real + b.imag * b.imag, _product(a, b.conjugate())
    return ComplexNumber(a.tape, over.real / square, over.imag / square)


def _whole_power(base: ComplexNumber, exponent: int) -> ComplexNumber:
    result, square, left = complex_number(base.tape, 1.0), base, abs(exponent)
    while left:
        if left & 1:
            result = _product(result, square)
        left >>= 1
        if left:
            square = _product(square, square)
    return result if exponent >= 0 else _quotient(complex_number(base.tape, 1.0), result)


def _power(a: ComplexNumber, b: ComplexNumber) -> ComplexNumber:
    known = b.real.known
    if b.imag.known == 0 and known is not None and known == round(known) and abs(known) <= _LARGEST_POWER:
        return _whole_power(a, int(known))
    return _exp(_product(b, _log(a)))


# --- elementary functions -------------------------------------------------------------------------------------------------


def _real(name: str, *values: Any) -> Number:
    tape: Tape = next(value.tape for value in values if isinstance(value, Number))
    return tape.apply(name, *values)


def _exp(z: ComplexNumber) -> ComplexNumber:
    size = _real("exp", z.real)
    return ComplexNumber(z.tape, size * _real("cos", z.imag), size * _real("sin", z.imag))


def _log(z: ComplexNumber) -> ComplexNumber:
    return ComplexNumber(z.tape, _real("log", abs(z)), _real("atan2", z.imag, z.real))


def _sqrt(z: ComplexNumber) -> ComplexNumber:
    """Return the root with the positive real part, written without cancellation on both sides of the imaginary axis."""
    part = _real("sqrt", (abs(z) + abs(z.real)) / 2)
    other, left = z.imag / (2.0 * part), z.real < 0
    sign = z.tape.apply("select", z.imag < 0, -1.0, 1.0)
    return ComplexNumber(
        z.tape, z.tape.apply("select", left, abs(other), part), z.tape.apply("select", left, sign * part, other)
    )


def _sin(z: ComplexNumber) -> ComplexNumber:
    x, y = z.real, z.imag
    return ComplexNumber(z.tape, _real("sin", x) * _real("cosh", y), _real("cos", x) * _real("sinh", y))


def _cos(z: ComplexNumber) -> ComplexNumber:
    x, y = z.real, z.imag
    return ComplexNumber(z.tape, _real("cos", x) * _real("cosh", y), -_real("sin", x) * _real("sinh", y))


def _sinh(z: ComplexNumber) -> ComplexNumber:
    x, y = z.real, z.imag
    return ComplexNumber(z.tape, _real("sinh", x) * _real("cos", y), _real("cosh", x) * _real("sin", y))


def _cosh(z: ComplexNumber) -> ComplexNumber:
    x, y = z.real, z.imag
    return ComplexNumber(z.tape, _real("cosh", x) * _real("cos", y), _real("sinh", x) * _real("sin", y))


#: Functions of one complex number, by the names of the operations for real ones.
FUNCTIONS: dict[str, Callable[[ComplexNumber], Any]] = {
    "exp": _exp, "log": _log, "sqrt": _sqrt, "sin": _sin, "cos": _cos, "sinh": _sinh, "cosh": _cosh,
    "tan": lambda z: _sin(z) / _cos(z), "tanh": lambda z: _sinh(z) / _cosh(z), "abs": abs,
}  # fmt: skip


def function_of_complex(name: str, value: Any) -> Any:
    """Return a function of a complex number, recorded or not.

    Raises
    ------
    Unrecordable
        It is none of `FUNCTIONS`.
    """
    function = FUNCTIONS.get(name)
    if function is None:
        raise Unrecordable(f"it calls {name} of a complex number")
    if isinstance(value, ComplexNumber):
        return function(value)
    return abs(value) if name == "abs" else getattr(cmath, name)(value)
