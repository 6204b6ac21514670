"""Complex numbers of recorded parts: arithmetic. `contin.functions.primitives` has the functions of a complex number."""

from __future__ import annotations

import cmath
import numbers
from collections.abc import Callable
from typing import Any

import numpy as np

from contin.functions.primitives import TABLE
from contin.functions.tape import LARGEST_POWER, Number, Tape, Unrecordable, whole_power


def is_complex(value: object) -> bool:
    """Return whether a value is a complex number, recorded or not."""
    return isinstance(value, (ComplexNumber, complex, np.complexfloating))


def complex_number(tape: Tape, value: Any) -> ComplexNumber:
    """Return a number of any kind as a complex one."""
    if isinstance(value, ComplexNumber):
        return value
    if not isinstance(value, Number):
        value = complex(value)
    return ComplexNumber(tape, value.real, value.imag)


def part(value: Any, name: str) -> Any:
    """Return the ``real`` or ``imag`` part of a number, or its ``conjugate``."""
    if name == "conjugate":
        return value.conjugate() if is_complex(value) else value
    return getattr(value, name)


def function_of_complex(name: str, value: Any) -> Any:
    """Return a function of a complex number, recorded or not; raise Unrecordable where the operation has no rule for it."""
    pair = TABLE[name].pair
    if pair is None:
        raise Unrecordable(f"it calls {name} of a complex number")
    if not isinstance(value, ComplexNumber):
        return getattr(cmath, name)(value)
    return ComplexNumber(value.tape, *pair(value.tape.apply, value.real, value.imag))


def _binary(function: Callable[[ComplexNumber, ComplexNumber], Any], swapped: bool = False) -> Any:
    """Return a method of two numbers, the second one of any kind; ``swapped``: that is the first operand."""

    def method(self: ComplexNumber, other: object) -> Any:
        if not isinstance(other, (ComplexNumber, Number, numbers.Number, np.bool_)):
            return NotImplemented
        given = complex_number(self.tape, other)
        return function(given, self) if swapped else function(self, given)

    return method


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


def _power(a: ComplexNumber, b: ComplexNumber) -> Any:
    known = b.real.known
    if b.imag.known == 0 and known is not None and known == round(known) and abs(known) <= LARGEST_POWER:
        return whole_power(complex_number(a.tape, 1.0), a, int(known))
    return function_of_complex("exp", _product(b, function_of_complex("log", a)))


class ComplexNumber:
    """A complex number whose parts are numbers of one tape; Python's arithmetic on it gives others."""

    __slots__ = ("imag", "real", "tape")

    def __init__(self, tape: Tape, real: Number | float, imag: Number | float) -> None:
        self.tape, self.real, self.imag = tape, tape.number(real), tape.number(imag)

    def __repr__(self) -> str:
        return f"<recorded complex number {self.real!r}, {self.imag!r}>"

    def conjugate(self) -> ComplexNumber:
        """Return the number with the other sign of its imaginary part."""
        return ComplexNumber(self.tape, self.real, -self.imag)

    __add__ = __radd__ = _binary(_sum)
    __sub__, __rsub__ = _binary(_difference), _binary(_difference, swapped=True)
    __mul__ = __rmul__ = _binary(_product)
    __truediv__, __rtruediv__ = _binary(_quotient), _binary(_quotient, swapped=True)
    __pow__, __rpow__ = _binary(_power), _binary(_power, swapped=True)
    __eq__ = _binary(lambda a, b: (a.real == b.real) & (a.imag == b.imag))
    __ne__ = _binary(lambda a, b: 1.0 - (a == b))

    def __neg__(self) -> ComplexNumber:
        return ComplexNumber(self.tape, -self.real, -self.imag)

    def __pos__(self) -> ComplexNumber:
        return self

    def __abs__(self) -> Number:
        return self.tape.apply("hypot", self.real, self.imag)

    def _refuse(self, *_: object) -> Any:
        raise Unrecordable("it orders complex numbers, or needs the value of one")

    __lt__ = __le__ = __gt__ = __ge__ = __bool__ = __float__ = __int__ = __complex__ = __hash__ = _refuse

    def __array_ufunc__(self, ufunc: np.ufunc, method: str, *inputs: object, **options: object) -> Any:
        return self.tape.arrays.universal(ufunc, method, inputs, options)

    def __array_function__(self, function: Callable[..., Any], types: object, inputs: object, options: object) -> Any:
        return self.tape.arrays.function(function, inputs, options)
