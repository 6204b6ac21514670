"""A user's functions evaluated at many points in one call, with their exact Jacobian.

Functions of a point, ``f(t, u, p)``, are called in a compiled loop over the points, and differentiated there by the complex
step: with h = 2^-300 the imaginary part of ``f(u + i h e_j)`` divided by h is the derivative to round-off. The loop is a
generated kernel. Its key is a fingerprint of everything that the functions read, so a second process compiles nothing, and an
edit of a constant or of a helper in another file compiles anew.
"""

from __future__ import annotations

import contextlib
import functools
import time
from collections import namedtuple
from collections.abc import Sequence
from typing import Any

import numpy as np

from contin import threads
from contin.arrays import Array, Function, Indices, Pattern
from contin.errors import CompilationError, ProblemError
from contin.functions.cache import keep_text, kept_text
from contin.functions.colouring import Colouring, SparsePattern, colouring
from contin.functions.complex_step import ComplexStep
from contin.functions.interpreted import Interpreted
from contin.functions.kernel import Kernel
from contin.functions.kernel_parts import IndexMatrix, IndexVector, Matrix, Stack, Vector
from contin.functions.machine_code import Raised
from contin.functions.pointwise import Pointwise, parts, searches
from contin.functions.signature import Signature, named_values, takes_arrays
from contin.functions.sparsity import sparsity_pattern

#: The generated kernel. What it says is part of the fingerprint: an edit compiles every problem anew.
_TEMPLATE = """
def evaluate(
    t: Vector, u: Matrix, v: Matrix, p: Vector, inputs: IndexVector, owner: IndexMatrix, work: Vector, out: Matrix, jac: Stack
) -> None:
    for i in range(u.shape[0]):
{real}
"""
#: The rest of it, for derivatives.
_DERIVATIVES = """
{between}
        for colour in range(owner.shape[0]):
            for s in range(inputs[colour], inputs[colour + 1]):
                work[inputs[s]] = STEP
{complex}
            for row in range(owner.shape[1]):
                if owner[colour, row] >= 0:
                    jac[i, row, owner[colour, row]] = work[{inputs} + row] / STEP
            for s in range(inputs[colour], inputs[colour + 1]):
                work[inputs[s]] = 0.0
"""
#: Between values and derivatives: a loop for each, or one for both, with what was found for the values.
_OTHER_LOOP = "    if jac.size == 0:\n        return\n    for i in range(u.shape[0]):"
_SAME_LOOP = "        if jac.size == 0:\n            continue"
#: The complex step: no sum of it and a number of the problem is rounded to another number.
_STEP = 2.0**-300


class Batch:
    """Functions of a point, compiled together: values and exact Jacobian at many points in one call.

    Parameters
    ----------
    functions : sequence of callable
        Each ``f(t, u, p)`` of a time and two named tuples, or with ``ends=True`` ``f(u, v, p)`` of the states at both
        ends. It returns a number or a tuple of numbers; with one argument more it fills that array instead, and
        gets arrays in place of named tuples.
    counts : sequence of int
        Number of values of each function; 0 stands for one number that is no tuple.
    states, parameters : tuple of str
        Names, in order.
    times : bool
        The functions take t; ``f(u, p)`` without.
    derivatives : bool
        There is a Jacobian. Without, half as much is compiled.
    pattern : SparsePattern, optional
        Which values depend on which inputs, where that is known; traced by default.
    reads : sequence of str, optional
        The parameters that the functions read, if it is known: the compiled code then serves problems with others, too.

    Warns
    -----
    InterpretedWarning
        A function that cannot be compiled, when derivatives are first asked for; the message says which and why.

    Raises
    ------
    ProblemError
        No functions, or not a count for each.

    Examples
    --------
    >>> batch = Batch([lambda u, p: (u.x * u.y, p.a * u.x)], [2], ["x", "y"], ["a"], times=False)
    >>> none = np.empty((0, 2))
    >>> batch.values(np.zeros(1), np.array([[2.0, 3.0]]), none, np.array([5.0]))
    array([[ 6., 10.]])
    >>> batch.jacobian(np.zeros(1), np.array([[2.0, 3.0]]), none, np.array([5.0]), batch.colouring([0]))[1]
    array([[[3., 2., 0.],
            [5., 0., 2.]]])
    """

    def __init__(
        self,
        functions: Sequence[Function],
        counts: Sequence[int],
        states: Sequence[str],
        parameters: Sequence[str],
        *,
        ends: bool = False,
        times: bool = True,
        derivatives: bool = True,
        reads: Sequence[str] | None = None,
        pattern: SparsePattern | None = None,
    ) -> None:
        read = parameters if reads is None else sorted(set(reads) & set(parameters))
        self.signature = Signature(tuple(states), tuple(read), times and not ends, ends)
        self._reads: Indices = np.array([list(parameters).index(name) for name in read], dtype=np.int64)
        self._parameters, self._derivatives = len(parameters), derivatives
        self.count = sum(max(count, 1) for count in counts)
        self._functions = tuple(_filling(function, count, self.signature) for function, count in zip(functions, counts))
        self._counts = tuple(counts)
        if not self._functions or len(functions) != len(counts):
            raise ProblemError("functions: there must be at least one, with a count for each")
        self._pattern = pattern
        self._colourings: dict[tuple[int, ...], Colouring] = {}
        self._seconds: dict[int, float] = {}  # a place takes, by the number of colours
        try:
            self._evaluate: Any = self._compiled(derivatives)
        except CompilationError as error:
            self._evaluate = Interpreted(self._functions, self._counts, self.signature, str(error))

    def _compiled(self, derivatives: bool) -> Any:
        """Return the generated kernel.

        Raises
        ------
        CompilationError
        """
        source = _source(self.signature, self._functions, self._counts, derivatives)
        self._key = self._fingerprint(source)
        return _evaluate(self._key, source, self.signature, self._functions)

    def is_current(self) -> bool:
        """Return whether all constants that the functions read still have the values that were compiled."""
        if isinstance(self._evaluate, Interpreted):
            return True  # it reads them at each call
        source = _source(self.signature, self._functions, self._counts, self._derivatives)
        try:
            return self._fingerprint(source) == self._key
        except CompilationError:
            return False

    def _fingerprint(self, source: str) -> str:
        """Return the fingerprint of the functions, and of everything that they read.

        Raises
        ------
        CompilationError
        """
        rewriter = ComplexStep()
        for function in self._functions:
            rewriter.function(parts(function)[0])
        for solve in searches(self._functions):
            rewriter.function(solve)
        rewriter.note(source, self.signature.states, self.signature.parameters)
        return rewriter.fingerprint()

    def values(self, t: Array, u: Array, v: Array, p: Array) -> Array:
        """Return the values, shape (points, count), at ``t`` (points,), ``u`` (points, n), ``v`` likewise or (0, n), ``p``."""
        out, p = np.empty((len(u), self.count)), p[self._reads]
        try:
            if len(u) < _MANY:
                self._evaluate(t, u, v, p, _NO_INPUTS, _NO_OWNER, _NO_WORK, out, _NO_JACOBIAN)
            else:
                self._evaluate_many((t, u, v, p, _NO_INPUTS, _NO_OWNER, _NO_WORK, out, _NO_JACOBIAN))
        except Raised as error:
            raise error.exception() from None
        return out

    def jacobian(self, t: Array, u: Array, v: Array, p: Array, colours: Colouring) -> tuple[Array, Array]:
        """Return values and derivatives, shape (points, count, colours.width), in the columns that ``colours`` is for."""
        out, new = np.empty((len(u), self.count)), np.zeros if len(u) < _MANY else np.empty
        jac, p = new((len(u), self.count, colours.width)), p[self._reads]
        work = np.zeros(self.signature.inputs + self.count)
        try:
            if len(u) < _MANY:
                self._evaluate(t, u, v, p, colours.inputs, colours.owner, work, out, jac)
            else:
                self._evaluate_many((t, u, v, p, colours.inputs, colours.owner, work, out, jac))
        except Raised as error:
            exception = error.exception()
            if not isinstance(exception, ZeroDivisionError):
                raise exception from None
            out.fill(np.nan)  # the quotient of real numbers is infinite there, that of complex ones an error
            jac.fill(np.nan)
        return out, jac

    def entries(self, t: Array, u: Array, v: Array, p: Array, colours: Colouring) -> tuple[Array, Array]:
        """Return the values at one place, shape (count,), and entries of the Jacobian in the order of `Colouring.entries`."""
        values, compressed = self.jacobian(t, u, v, p, colours.compressed())
        rows, _, colour = colours.entries
        return values[0], compressed[0, rows, colour]

    def _evaluate_many(self, given: _Arguments) -> None:
        """Call the kernel for many places, in several threads where one took long before.

        Raises
        ------
        Raised
            What one call for all places raises: the same for any number of threads.
        """
        count, kind = len(given[1]), len(given[5])
        long = count * self._seconds.get(kind, 0.0) > _LONG and not isinstance(self._evaluate, Interpreted)
        if long and threads.count() > 1:
            with contextlib.suppress(Raised):  # parts are not in the order of one call
                threads.each(self._evaluate_part, _divided(given))
                return
        began = time.perf_counter()
        self._evaluate_part(given)
        self._seconds[kind] = (time.perf_counter() - began) / count

    def _evaluate_part(self, given: _Arguments) -> None:
        """Call the kernel, which leaves zeros of the Jacobian as they are."""
        given[-1].fill(0.0)
        self._evaluate(*given)

    def colouring(self, free: Sequence[int] | Indices, order: Sequence[int] | Indices | None = None) -> Colouring:
        """Return the colouring for derivatives by u, in this ``order``, by v (with ``ends``), and by ``free`` parameters.

        Raises
        ------
        ProblemError
            A batch without derivatives.
        """
        if not self._derivatives:
            raise ProblemError("derivatives: this batch was made without them")
        inputs = len(self.signature.states) * (1 + self.signature.ends)
        columns = (*(range(inputs) if order is None else map(int, order)), *(inputs + int(slot) for slot in free))
        if columns not in self._colourings:
            found = colouring(self.depends if self._pattern is None else self._pattern, columns)
            starts, places = len(found.owner) + 1, {int(slot): place for place, slot in enumerate(self._inputs)}
            perturbed = [places[slot] for slot in found.inputs[starts:].tolist()]  # as the compiled code numbers them
            self._colourings[columns] = found._replace(inputs=np.array([*found.inputs[:starts], *perturbed], dtype=np.int64))
        return self._colourings[columns]

    @property
    def _inputs(self) -> Indices:
        """The numbers, among u, v and all of p, of the inputs that the compiled code has."""
        before = self.signature.inputs - len(self._reads)
        return np.concatenate([np.arange(before), before + self._reads])

    @functools.cached_property
    def depends(self) -> Pattern:
        """Sparsity pattern: which values depend on which of u, v (with ``ends``), p; shape (count, inputs)."""
        pattern = np.zeros((self.count, self.signature.inputs - len(self._reads) + self._parameters), dtype=bool)
        pattern[:, self._inputs] = sparsity_pattern(self._functions, self._counts, self.signature)
        return pattern


def _filling(function: Function, count: int, signature: Signature) -> Function:
    """Return a function that takes states as arrays only as one that fills an array; any other one as it is."""
    if isinstance(function, Pointwise) or signature.fills(function) or not takes_arrays(function, signature.arguments):
        return function
    before = ["t"] * signature.times + ["u", "v"][: 1 + signature.ends]
    named = f"P({''.join(f'p[{i}], ' for i in range(len(signature.parameters)))})"
    lines = [f"def filling({', '.join([*before, 'p', 'out'])}):", f"    r = function({', '.join([*before, named])})"]
    if count <= _WRITTEN_OUT:
        lines += [f"    out[{i}] = r[{i}]" for i in range(count)] or ["    out[0] = r"]
    else:
        lines += [f"    for i in range({count}):", "        out[i] = r[i]"]
    scope: dict[str, Any] = {"function": function, "P": named_values(signature.parameters), "__name__": __name__}
    exec("\n".join(lines), scope)
    scope["filling"].__name__ = getattr(function, "__name__", "function")
    found: Function = scope["filling"]
    return found


#: So many values are written one by one, as a tuple of different types needs it.
_WRITTEN_OUT = 16
#: Stand for a colouring and a Jacobian that are not asked for.
_NO_INPUTS, _NO_OWNER, _NO_WORK = np.empty(0, np.int64), np.empty((0, 0), np.int64), np.empty(0)
_NO_JACOBIAN = np.empty((0, 0, 0))
#: Fewer places are evaluated by one thread, and not timed. Ten times fewer would hardly ever take long.
_MANY = 256
#: So are those that take fewer seconds. Ten times fewer would be the time that it takes to wake another thread.
_LONG = 0.5e-3
#: Parts that several threads share: more than cores usually, so that a core that is busy with something else gets fewer.
_PARTS = 16
#: The arguments of the generated kernel.
_Arguments = tuple[Array, Array, Array, Array, Indices, Indices, Array, Array, Array]


def _divided(given: _Arguments) -> list[_Arguments]:
    """Return the kernel's arguments for all places in `_PARTS` parts, each with work space of its own."""
    t, u, v, p, inputs, owner, work, out, jac = given
    ends = [len(u) * i // _PARTS for i in range(_PARTS + 1)]
    return [(t[a:b], u[a:b], v[a:b], p, inputs, owner, work.copy(), out[a:b], jac[a:b]) for a, b in zip(ends, ends[1:])]


def _source(signature: Signature, functions: Sequence[Function], counts: Sequence[int], derivatives: bool) -> str:
    """Return the generated kernel: every function called at point i, with real and with complex numbers."""
    solves = searches(functions)
    once = [f"w{k} = solve{k}({', '.join(_arguments(signature, 'float64'))})" for k in range(len(solves))]
    real: list[str] = []
    step: list[str] = []
    row = 0
    for index, (function, count) in enumerate(zip(functions, counts)):
        solve = parts(function)[1]
        found = [] if solve is None else [f"w{solves.index(solve)}"]
        size = max(count, 1)
        if signature.fills(function):
            real += _filled(signature, index, count, found, "float64")
            step += _filled(signature, index, count, found, "complex128")
            real.append(f"out[i, {row} : {row + size}] = r")
            step += [f"for j in range({size}):", f"    work[{signature.inputs + row} + j] = r[j].imag"]
        else:
            for lines, name, kind in ((real, "function", "float64"), (step, "step", "complex128")):
                lines.append(f"r = {name}{index}({', '.join(_arguments(signature, kind) + found)})")
            values = [f"r[{j}]" for j in range(count)] or ["r"]
            real += [f"out[i, {row + j}] = {value}" for j, value in enumerate(values)]
            step += [f"work[{signature.inputs + row + j}] = complex({value}).imag" for j, value in enumerate(values)]
        row += size
    template = _TEMPLATE + _DERIVATIVES if derivatives else _TEMPLATE
    return template.format(
        real="\n".join(" " * 8 + line for line in [*once, *real]), complex="\n".join(" " * 12 + line for line in step),
        inputs=signature.inputs, between=_SAME_LOOP if once else _OTHER_LOOP,
    )  # fmt: skip


def _groups(signature: Signature) -> list[tuple[str, str, int]]:
    """Return the groups of inputs: the name of its named tuple, where it stands, and its size."""
    count = len(signature.states)
    ends = [("V", "v[i]", count)] if signature.ends else []
    return [("U", "u[i]", count), *ends, ("P", "p", len(signature.parameters))]


def _arguments(signature: Signature, kind: str) -> list[str]:
    """Return the arguments of functions at point i: t, and named tuples."""
    arguments, slot = ["t[i]"] if signature.times else [], 0
    for name, place, size in _groups(signature):
        numbers = [f"{place}[{j}]" for j in range(size)]
        if kind == "complex128":
            numbers = [f"complex({number}, work[{slot + j}])" for j, number in enumerate(numbers)]
        slot += size
        arguments.append(f"{name}({''.join(number + ', ' for number in numbers)})")
    return arguments


def _filled(signature: Signature, index: int, count: int, found: list[str], kind: str) -> list[str]:
    """Return the lines that call a function with arrays, and let it fill r; they do not grow with the number of states."""
    lines, arguments, slot = [], ["t[i]"] if signature.times else [], 0
    for name, place, size in _groups(signature):
        given = f"{name.lower()}{index}"
        lines += [f"{given} = np.empty({size}, np.{kind})", f"for j in range({size}):"]
        number = f"{place}[j]" if kind == "float64" else f"complex({place}[j], work[{slot} + j])"
        lines.append(f"    {given}[j] = {number}")
        slot += size
        arguments.append(given)
    called = "step" if kind == "complex128" else "function"
    return [*lines, f"r = np.zeros({count}, np.{kind})", f"{called}{index}({', '.join([*arguments, *found, 'r'])})"]


#: Compiled kernels of this process, by their keys.
_KNOWN: dict[str, Any] = {}


def _evaluate(key: str, source: str, signature: Signature, functions: Sequence[Function]) -> Any:
    """Return the generated kernel of this key (machine code comes from the cache where it is there).

    Raises
    ------
    CompilationError
    """
    if key in _KNOWN:
        return _KNOWN[key]
    named = {"U": signature.states, "V": signature.states, "P": signature.parameters}
    scope: dict[str, Any] = {name: namedtuple(name, fields) for name, fields in named.items()}
    scope |= {"np": np, "STEP": _STEP, "__name__": __name__, "__builtins__": __builtins__}
    scope |= {"Vector": Vector, "Matrix": Matrix, "Stack": Stack, "IndexVector": IndexVector, "IndexMatrix": IndexMatrix}
    exec(compile(source, f"<contin {key[:32]}>", "exec"), scope)
    kernel = Kernel(scope["evaluate"], reorder=False, key=key)
    found = kernel.stored()
    if found is None:
        refusal = f"u{kernel.key}.txt"
        reason = kept_text(refusal)
        if reason:  # it could not be compiled before
            raise CompilationError(reason)
        from contin.functions.analytic import compile_batch  # numba takes .3 s, and is needed the first time only

        try:
            found = compile_batch(kernel, functions)
        except CompilationError as error:
            keep_text(refusal, str(error))
            raise
    _KNOWN[key] = found
    return found
