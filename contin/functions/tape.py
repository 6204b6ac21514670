"""The tape: what a function computes, recorded as a list of operations that can be differentiated, counted, printed and run.

A `Tape` holds operations in order; each refers to earlier ones by their numbers. Operations of constants are carried out at
once, and equal operations are stored once. A `Number` stands for the result of an operation: Python's operators on it append
operations. `contin.functions.primitives` lists the operations with their values and derivatives.

Example: recording (x + 1) * (x + 1) makes three operations, of which the sum is stored once::

    0  input (x)
    1  constant 1.0
    2  add 0 1
    3  mul 2 2
"""

from __future__ import annotations

import math
import numbers
import sys
from collections import Counter
from collections.abc import Callable, Hashable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from contin.arrays import Array
from contin.functions import primitives


class Unrecordable(BaseException):
    """A function needs what recorded numbers lack, such as a value; no ``Exception``: a user's function must not catch it."""


#: Files of code that is not the user's begin so, and the one that calls the user's.
LIBRARIES = (*(str(Path(file).parent) for file in (np.__file__, __file__)), "<__array_function__")
_CALLS = str(Path(__file__).with_name("recording.py"))


class Operation(NamedTuple):
    """One entry of a tape: the name of a primitive, the numbers of its operands, and what else it needs."""

    name: str
    operands: tuple[int, ...] = ()
    data: Any = None


class Tape:
    """Recorded operations.

    - ``operations`` (list of Operation)
    - ``arrays`` (optional): NumPy for recorded numbers, `contin.functions.recorded_arrays.NUMPY`: ``arrays.universal(...)``,
      ``arrays.function(...)``.
    - ``decide`` (callable, optional): ``decide(condition)`` returns the outcome that the present recording assumes where a
      function asks for the truth of a number. Without it such a question raises `Unrecordable`.
    - ``written`` (dict): Code, instruction and line of the user that make an operation of a recorded function, by its place.

    Examples
    --------
    >>> tape = Tape()
    >>> x = tape.input(0)
    >>> y = (x + 1) * (1 + x)
    >>> [operation.name for operation in tape.operations]
    ['input', 'constant', 'add', 'mul']
    """

    def __init__(self, arrays: Any = None) -> None:
        self.operations: list[Operation] = []
        self.arrays = arrays
        self.decide: Callable[[int], bool] | None = None
        self.searches = 0  # in the present recording: names their unknowns
        self.written: dict[int, tuple[Any, int, int]] = {}
        self._known: dict[Hashable, int] = {}
        self._results: dict[Hashable, Any] = {}

    def __getstate__(self) -> list[Operation]:
        """Return the operations."""
        return self.operations

    def __setstate__(self, operations: list[Operation]) -> None:
        self.__init__()  # type: ignore[misc]
        for operation in operations:
            self._append(operation)

    def kept(self, key: Hashable, make: Callable[[], Any]) -> Any:
        """Return what was made for a key before, or make it."""
        if key not in self._results:
            self._results[key] = make()
        return self._results[key]

    def input(self, slot: Hashable) -> Number:
        """Return the number of this input; whole slots are those of u, v and p in order."""
        return Number(self, self._append(Operation("input", (), slot)))

    def constant(self, value: float) -> int:
        """Return the place of a constant."""
        return self._append(Operation("constant", (), float(value)))

    def value(self, place: int) -> float | None:
        """Return the value of a constant, None of another operation."""
        operation = self.operations[place]
        return operation.data if operation.name == "constant" else None

    def number(self, value: object) -> Number:
        """Return a Number for one of this tape or a real number; raise Unrecordable where it is neither."""
        if isinstance(value, Number):
            if value.tape is not self:
                raise Unrecordable("it uses a number of another recording")
            return value
        if isinstance(value, (float, int, numbers.Real, np.bool_)):
            return Number(self, self.constant(float(value)))
        if isinstance(value, np.ndarray) and value.ndim == 0:
            return self.number(value.item())
        raise Unrecordable(f"it computes with {type(value).__name__}, not with numbers")

    def apply(self, name: str, *operands: object, data: object = None) -> Number:
        """Append an operation, unless it can be carried out or simplified, or is there already."""
        return Number(self, self.at(name, tuple(self.number(operand).place for operand in operands), data))

    def at(self, name: str, places: tuple[int, ...], data: object = None) -> int:
        """Do the same with the places of the operands; return the place of the result."""
        primitive = primitives.TABLE[name]
        if places and primitive.constant is not None and self.operations[places[-1]].name == "constant":
            known = [self.value(place) for place in places]
            if None not in known:
                with np.errstate(all="ignore"):
                    return self.constant(primitive.constant(data, *known))
        if primitive.simplify is not None:
            simpler = primitive.simplify(self, places)
            if simpler is not None:
                return simpler
        if primitive.commutes and places[0] > places[1]:
            places = places[::-1]
        return self._append(Operation(name, places, data))

    def _append(self, operation: Operation) -> int:
        key = operation.data.hex() if operation.name == "constant" else operation  # 0 and -0 are two, nan is one
        known = self._known.get(key)
        if known is None:
            known = self._known[key] = len(self.operations)
            self.operations.append(operation)
            if self.decide is not None:
                frame: Any = sys._getframe(1)
                while (file := frame.f_code.co_filename).startswith(LIBRARIES) and file != _CALLS:
                    frame = frame.f_back
                if file != _CALLS:
                    self.written[known] = frame.f_code, frame.f_lasti, frame.f_lineno
        return known

    def reading(self, places: Iterable[int], sources: Iterable[int]) -> list[bool]:
        """Return for every operation up to the last of ``places`` whether it depends on one of ``sources``."""
        last, operations = max(places, default=-1), self.operations
        depends = [False] * (last + 1)
        for source in sources:
            if source <= last:
                depends[source] = True
        for place in range(last + 1):
            for operand in operations[place][1]:
                if depends[operand]:
                    depends[place] = True
                    break
        return depends

    def needed(self, places: Iterable[int]) -> list[int]:
        """Return all operations that the ``places`` are computed from, and these, in order."""
        found, stack = set(places), list(places)
        while stack:
            for operand in self.operations[stack.pop()].operands:
                if operand not in found:
                    found.add(operand)
                    stack.append(operand)
        return sorted(found)

    def substitute(self, places: Sequence[int], values: dict[int, int]) -> list[int]:
        """Return the ``places`` as they are with other operations in the place of some (both by their places)."""
        moved = dict(values)
        reads = self.reading(places, values)
        for place in self.needed(places):
            if place in moved or not reads[place]:
                moved.setdefault(place, place)
                continue
            operation = self.operations[place]
            moved[place] = self.at(operation.name, tuple(moved[operand] for operand in operation.operands), operation.data)
        return [moved[place] for place in places]

    def replay(self, other: Tape, places: Sequence[int], values: Mapping[int, Any]) -> list[Number]:
        """Return operations of another tape, carried out on this one with ``values`` of its inputs by place."""
        moved: dict[Any, Any] = {place: self.number(value).place for place, value in values.items()}
        self._replay(other, places, moved)
        return [Number(self, moved[place]) for place in places]

    def _replay(self, other: Tape, places: Sequence[int], moved: dict[Any, Any]) -> None:
        """Put operations of another tape on this one: ``moved`` are their places here, and searches as they are here."""
        for place in other.needed(places):
            if place in moved:
                continue
            name, operands, data = other.operations[place]
            if name == "constant":
                moved[place] = self.constant(data)
                continue
            if name in ("root", "least"):
                data = (self.moved_search(other, data[0], moved), *data[1:])
            moved[place] = self.at(name, tuple(moved[operand] for operand in operands), data)

    def moved_search(self, other: Tape, search: Any, moved: dict[Any, Any]) -> Any:
        """Return a search of another tape with places on this one."""
        if search not in moved:
            inner = dict(moved)
            for number, unknown in enumerate(search.unknowns):
                inner[unknown] = self.input(("unknown", self.searches, number)).place
            self.searches += 1
            self._replay(other, [*search.results, *search.starts], inner)
            moved[search] = search.moved(inner)
        return moved[search]

    def evaluate(self, places: Sequence[int], values: Mapping[Any, float]) -> list[float]:
        """Return the values of operations in Python, for ``values`` of the inputs by slot."""
        found: dict[int, Any] = {}
        with np.errstate(all="ignore"):
            for place in self.needed(places):
                name, operands, data = self.operations[place]
                if name in ("input", "constant"):
                    found[place] = data if name == "constant" else values[data]
                elif name == "root":
                    found[place] = data[0].newton(self, values)[data[1]]
                else:
                    found[place] = primitives.TABLE[name].evaluate(data, *(found[operand] for operand in operands))
        return [float(found[place]) for place in places]

    def lines(self, places: Sequence[int], labels: Mapping[int, str]) -> list[str]:
        """Return operations as lines of text, with ``labels`` of inputs by place; what is used once stands where it is used."""
        return _lines(self, places, labels)


def _binary(name: str) -> Any:
    """Return the method of Python's arithmetic that appends an operation."""
    return lambda self, other: self._with(name, self, other)


def _swapped(name: str) -> Any:
    """Return that of the other operand's side."""
    return lambda self, other: self._with(name, other, self)


class Number:
    """The result of an operation on a tape; see `Tape`.

    It has Python's arithmetic. Its value is not known while a function is recorded: ``float(x)`` raises `Unrecordable`, and the
    truth of a comparison is assumed by the recording.
    """

    __slots__ = ("place", "tape")

    def __init__(self, tape: Tape, place: int) -> None:
        self.tape, self.place = tape, place

    def __repr__(self) -> str:
        value = self.known
        return f"<recorded number {self.place}>" if value is None else f"<recorded constant {value!r}>"

    @property
    def known(self) -> float | None:
        """The value of a constant; None of other numbers."""
        return self.tape.value(self.place)

    @property
    def real(self) -> Number:
        """The number itself."""
        return self

    @property
    def imag(self) -> float:
        """Zero: recorded numbers are real."""
        return 0.0

    def conjugate(self) -> Number:
        """Return the number itself."""
        return self

    def _with(self, name: str, *operands: object) -> Any:
        if all(isinstance(operand, _SCALARS) or _is_scalar(operand) for operand in operands):
            return self.tape.apply(name, *operands)
        if any(isinstance(operand, (complex, np.complexfloating)) for operand in operands):
            return self._arrays.complex_operation(name, *operands)
        return NotImplemented

    __add__, __radd__ = _binary("add"), _swapped("add")
    __sub__, __rsub__ = _binary("sub"), _swapped("sub")
    __mul__, __rmul__ = _binary("mul"), _swapped("mul")
    __truediv__, __rtruediv__ = _binary("div"), _swapped("div")
    __mod__, __rmod__ = _binary("mod"), _swapped("mod")
    __lt__, __gt__ = _binary("lt"), _swapped("lt")
    __le__, __ge__ = _binary("le"), _swapped("le")
    __eq__ = _binary("eq")

    def __ne__(self, other: object) -> Any:
        equal = self._with("eq", self, other)
        return equal if equal is NotImplemented else 1.0 - equal

    def __floordiv__(self, other: object) -> Any:
        return _floor_of(self._with("div", self, other))

    def __rfloordiv__(self, other: object) -> Any:
        return _floor_of(self._with("div", other, self))

    def __pow__(self, other: object) -> Any:
        return power(self, other) if _is_scalar(other) else self._with("pow", self, other)

    def __rpow__(self, other: object) -> Any:
        return power(self.tape.number(other), self) if _is_scalar(other) else self._with("pow", other, self)

    def __neg__(self) -> Number:
        return self.tape.apply("neg", self)

    def __pos__(self) -> Number:
        return self

    def __abs__(self) -> Number:
        return self.tape.apply("abs", self)

    def __invert__(self) -> Any:
        return self.tape.apply("eq", self, 0.0)

    def __and__(self, other: object) -> Any:
        return self.tape.apply("select", self, _truth(self.tape, other), 0.0)

    def __or__(self, other: object) -> Any:
        return self.tape.apply("select", self, 1.0, _truth(self.tape, other))

    __rand__, __ror__ = __and__, __or__

    def __bool__(self) -> bool:
        value = self.known
        if value is not None:
            return value != 0
        if self.tape.decide is None:
            raise Unrecordable("it decides by a comparison (if, while)")
        return self.tape.decide(self.place)

    def _refuse(self, *_: object) -> Any:
        raise Unrecordable("it needs the value of a number (float, int, an index, or foreign compiled code)")

    __float__ = __int__ = __index__ = __complex__ = __round__ = __hash__ = _refuse
    __trunc__ = _refuse

    def __floor__(self) -> Any:
        return self.tape.apply("floor", self)

    def __ceil__(self) -> Any:
        return self.tape.apply("ceil", self)

    def __array_ufunc__(self, ufunc: np.ufunc, method: str, *inputs: object, **options: object) -> Any:
        return self._arrays.universal(ufunc, method, inputs, options)

    def __array_function__(self, function: Callable[..., Any], types: object, inputs: object, options: object) -> Any:
        return self._arrays.function(function, inputs, options)

    @property
    def _arrays(self) -> Any:
        if self.tape.arrays is None:
            raise Unrecordable("it calls NumPy where only arithmetic is recorded")
        return self.tape.arrays


#: What most operands are, asked first: to ask whether something is a real number of any kind takes ten times as long.
_SCALARS = (Number, float, int)


def _is_scalar(value: object) -> bool:
    return isinstance(value, (*_SCALARS, numbers.Real, np.bool_)) or (isinstance(value, np.ndarray) and value.ndim == 0)


def _floor_of(value: Any) -> Any:
    return value if value is NotImplemented else value.tape.apply("floor", value)


def _truth(tape: Tape, value: object) -> Number:
    return tape.apply("sub", 1.0, tape.apply("eq", value, 0.0))


#: Largest whole power that is written as products. Larger ones use the library's function.
LARGEST_POWER = 64


def power(base: Number, exponent: Any) -> Number:
    """Return base ** exponent: whole powers as products, as NumPy's and Python's squares; others by the library's function."""
    tape = base.tape
    known = exponent.known if isinstance(exponent, Number) else float(exponent)
    if known is None or base.known is not None:
        return tape.apply("pow", base, exponent)
    if known == 0.5:
        return tape.apply("sqrt", base)
    if known == math.floor(known) and abs(known) <= LARGEST_POWER:
        return whole_power(tape.number(1.0), base, int(known))
    return tape.apply("pow", base, known)


def whole_power(one: Any, base: Any, exponent: int) -> Any:
    """Return a power as a product of squares, of numbers with this ``one``."""
    result, square, left = one, base, abs(exponent)
    while left:
        if left & 1:
            result = result * square
        left >>= 1
        if left:
            square = square * square
    return result if exponent >= 0 else one / result


#: Operations that are written with a sign between their operands, and how tightly it binds.
_SIGNS = {"add": ("+", 1), "sub": ("-", 1), "mul": ("*", 2), "div": ("/", 2), "lt": ("<", 0), "le": ("<=", 0), "eq": ("==", 0)}
#: The binding of names.
_NAME = 9
#: A text, and how tightly it binds.
_Text = tuple[str, int]


def _lines(tape: Tape, places: Sequence[int], labels: Mapping[int, str]) -> list[str]:
    """Return a line for what is used several times, and for each result; see `Tape.lines`."""
    needed, found = tape.needed(places), list[str]()
    uses = Counter(operand for place in needed for operand in tape.operations[place].operands)
    texts: dict[int, _Text] = {place: (label, _NAME) for place, label in labels.items()}
    for place in needed:
        if place in texts:
            continue
        operation = tape.operations[place]
        texts[place] = _text(operation, [texts[operand] for operand in operation.operands])
        if uses[place] > 1 and operation.name != "constant":
            found.append(f"z{len(found) + 1} = {texts[place][0]}")
            texts[place] = f"z{len(found)}", _NAME
    return found + [texts[place][0] for place in places]


def _text(operation: Operation, operands: list[_Text]) -> _Text:
    name, data = operation.name, operation.data
    plain = [text for text, _ in operands]
    if name == "constant":
        texts = (f"{data:.15g}", f"{data:.16g}", f"{data:.17g}")  # as few digits as tell it from others
        return next(text for text in texts if float(text) == data or text[-1] == "n"), _NAME if data >= 0 else 1
    if name in _SIGNS:
        sign, binds = _SIGNS[name]
        return f"{_within(operands[0], binds)} {sign} {_within(operands[1], binds + (name in ('sub', 'div')))}", binds
    if name == "neg":
        return f"-{_within(operands[0], 2)}", 1
    if name == "select":
        return f"({plain[1]} if {plain[0]} else {plain[2]})", _NAME
    if name in ("sum", "dot", "linear"):
        half = len(operands) // 2
        factors = {"sum": [], "dot": operands[:half], "linear": [(f"{factor:.17g}", _NAME) for factor in data or ()]}[name]
        terms = zip(factors, operands[half:] if name == "dot" else operands) if factors else zip(operands)
        return " + ".join(" * ".join(_within(each, 2) for each in term) for term in terms), 1
    if name == "root":
        search, index = data
        return f"{'argmin' if search.minimum else 'root'}{min(search.unknowns)}[{index}]", _NAME
    return f"{name}({', '.join(plain)})", _NAME


def _within(text: _Text, binds: int) -> str:
    """Return a text, in brackets where it binds less tightly."""
    return text[0] if text[1] >= binds else f"({text[0]})"


@dataclass(frozen=True)
class Table:
    """A piecewise polynomial of one number.

    - ``breaks`` (tuple of float): m places, increasing. Piece j holds from break j - 1 (included) to break j.
    - ``origins`` (tuple of float): Of the m + 1 pieces: powers are of x - origin.
    - ``coefficients`` (tuple of tuple of float): Of each piece, the highest power first.
    """

    breaks: tuple[float, ...]
    origins: tuple[float, ...]
    coefficients: tuple[tuple[float, ...], ...]

    @classmethod
    def linear(cls, x: object, y: object, left: float | None = None, right: float | None = None) -> Table:
        """Return the interpolation of `numpy.interp`: constant outside."""
        x, y = np.asarray(x, dtype=float), np.asarray(y, dtype=float)
        slopes = np.diff(y) / np.diff(x)
        first, last = (y[0] if left is None else left), (y[-1] if right is None else right)
        rows = [(0.0, first), *zip(slopes, y[:-1]), (0.0, last)]
        return cls(tuple(x.tolist()), (x[0].item(), *x.tolist()), tuple((float(a), float(b)) for a, b in rows))

    @classmethod
    def piecewise(cls, knots: object, coefficients: object) -> Table:
        """Return a polynomial of SciPy's kind (``PPoly``): coefficients (order, pieces), the first and last piece continued."""
        knots = np.asarray(knots, dtype=float)
        rows = np.asarray(coefficients, dtype=float).T
        return cls(tuple(knots[1:-1].tolist()), tuple(knots[:-1].tolist()), tuple(map(tuple, rows.tolist())))

    def derivative(self) -> Table:
        """Return the derivative; at a kink the one on the right."""
        powers = range(len(self.coefficients[0]) - 1, 0, -1)
        rows = tuple(tuple(c * k for c, k in zip(row, powers)) or (0.0,) for row in self.coefficients)
        return Table(self.breaks, self.origins, rows)

    def evaluate(self, x: float) -> float:
        """Return the value at a number."""
        piece = int(np.searchsorted(self.breaks, x, side="right"))
        return float(np.polyval(self.coefficients[piece], x - self.origins[piece]))

    def numbers(self) -> Array:
        """Return the table as the interpreter reads it."""
        head = [len(self.breaks), len(self.coefficients[0])]
        return np.array([*head, *self.breaks, *self.origins, *(c for row in self.coefficients for c in row)], dtype=float)
