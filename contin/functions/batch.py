"""From a user's plain Python function to a compiled batch evaluation with its exact Jacobian.

A function of a point, ``f(t, u, p)``, is wrapped in a loop over many points that also differentiates it by the
complex step: with h = 2^-300 the imaginary part of ``f(u + i h e_j)`` divided by h is the derivative to round-off.
The wrapper is written as a small module into a cache directory named after a fingerprint of the user's code
(bytecode, constants, closures, everything it calls), so a second process compiles nothing and an edit of a helper in
another file is never missed.
"""

from __future__ import annotations

import functools
import importlib.util
import sys
import types
from collections.abc import Callable, Sequence
from typing import Any

import numba
import numpy as np
from numba.core.dispatcher import Dispatcher

from contin.arrays import Array, Function, Indices, Pattern
from contin.errors import ProblemError
from contin.functions.cache import cache_directory, write_source
from contin.functions.colouring import Seeds, seeds
from contin.functions.rewriting import Prepared
from contin.functions.signature import argument_count
from contin.functions.sparsity import dependencies

#: Part of every fingerprint: changes when functions are compiled by other rules (the template has its own part).
_RULES = 5

_TEMPLATE = '''"""Generated; safe to delete."""
from collections import namedtuple
import numpy as np
from contin.functions.compiler import njit

U = namedtuple("U", {states})
V = namedtuple("V", {states})
P = namedtuple("P", {parameters})
STEP = 2.0 ** -300


@njit("void(f8[::1], f8[:,::1], f8[:,::1], f8[::1], i8[::1], i8[::1], i8[:,::1], f8[:,::1], f8[:,:,::1])",
      cache=True, error_model="numpy", nogil=True)
def evaluate(t, u, v, p, slots, starts, owner, out, jac):
    for i in range(u.shape[0]):
{real}
    if jac.size == 0:
        return
    seed = np.zeros({n} + {nv} + {k})
    for i in range(u.shape[0]):
        for column in range(starts.size - 1):
            for s in range(starts[column], starts[column + 1]):
                seed[slots[s]] = STEP
{complex}
            for s in range(starts[column], starts[column + 1]):
                seed[slots[s]] = 0.0
'''


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
        Whether the functions take t; ``f(u, p)`` without.
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
    ) -> None:
        self.states, self.parameters, self.ends, self.times = tuple(states), tuple(parameters), ends, times and not ends
        self.count = sum(max(count, 1) for count in counts)
        self._functions, self._counts = tuple(functions), tuple(counts)
        self._seeds: dict[tuple[int, ...], Seeds] = {}
        expected = 2 + self.ends + self.times
        fills = [argument_count(function) == expected + 1 for function in functions]
        prepared = Prepared()
        prepared.note(_RULES, numba.__version__, np.__version__, sys.version)
        dispatchers = {f"function{i}": prepared.function(function) for i, function in enumerate(functions)}
        source = self._source(counts, fills)
        prepared.note(source)
        names = " and ".join(function.__name__ for function in functions)
        self._evaluate = _module(prepared.fingerprint(), dispatchers, names, source).evaluate

    def _source(self, counts: Sequence[int], fills: Sequence[bool]) -> str:
        n, k = len(self.states), len(self.parameters)
        nv = n if self.ends else 0

        def calls(indent: int, dtype: str, number: Callable[[str, int], str], result: Callable[[int, str], str]) -> str:
            """Lines that call every function at point i and store the results."""
            u, v, p = (
                "".join(number(f"{letter}{j}]", slot + j) + ", " for j in range(size))
                for letter, size, slot in (("u[i, ", n, 0), ("v[i, ", nv, n), ("p[", k, n + nv))
            )
            lines, row = [], 0
            for index, (count, fill) in enumerate(zip(counts, fills)):
                wrap: Callable[[str, str], str]
                wrap = (lambda name, text: f"np.array([{text}])") if fill else (lambda name, text: f"{name}({text})")
                first = ("t[i], " if self.times else "") + wrap("U", u) + (f", {wrap('V', v)}" if self.ends else "")
                if fill:
                    lines.append(f"r = np.zeros({count}, np.{dtype})")
                    lines.append(f"function{index}({first}, {wrap('P', p)}, r)")
                else:
                    lines.append(f"r = function{index}({first}, {wrap('P', p)})")
                for j in range(max(count, 1)):
                    lines.append(result(row, f"r[{j}]" if count else "r"))
                    row += 1
            return "".join(" " * indent + line + "\n" for line in lines)

        real = calls(8, "float64", lambda text, slot: text, lambda row, r: f"out[i, {row}] = {r}")
        step = calls(
            12, "complex128", lambda text, slot: f"complex({text}, seed[{slot}])",
            lambda row, r: f"if owner[column, {row}] >= 0: jac[i, {row}, owner[column, {row}]] = complex({r}).imag / STEP",
        )  # fmt: skip
        return _TEMPLATE.format(states=self.states, parameters=self.parameters, n=n, nv=nv, k=k, real=real, complex=step)

    def values(self, t: Array, u: Array, v: Array, p: Array) -> Array:
        """Values, shape (points, count), at ``t`` (points,), ``u`` (points, n), ``v`` likewise or (0, n), ``p``."""
        out = np.empty((len(u), self.count))
        self._evaluate(t, u, v, p, _NOTHING, _NOTHING, _NO_OWNER, out, _NO_JACOBIAN)
        return out

    def jacobian(self, t: Array, u: Array, v: Array, p: Array, seeds: Seeds) -> tuple[Array, Array]:
        """Values and derivatives, shape (points, count, seeds.width), in the columns that ``seeds`` are for."""
        out, jac = np.empty((len(u), self.count)), np.zeros((len(u), self.count, seeds.width))
        self._evaluate(t, u, v, p, seeds.slots, seeds.starts, seeds.owner, out, jac)
        return out, jac

    def seeds(self, free: Sequence[int] | Indices, order: Sequence[int] | Indices | None = None) -> Seeds:
        """Seeds for derivatives by u, in this ``order``, by v (with ``ends``), and by the ``free`` ones of the parameters."""
        inputs = len(self.states) * (2 if self.ends else 1)
        columns = (*(range(inputs) if order is None else map(int, order)), *(inputs + int(slot) for slot in free))
        if columns not in self._seeds:
            self._seeds[columns] = seeds(self.depends, columns)
        return self._seeds[columns]

    @functools.cached_property
    def depends(self) -> Pattern:
        """Which values depend on which of u, v (with ``ends``), p, as far as can be told: shape (count, inputs)."""
        return dependencies(self._functions, self._counts, self.states, self.parameters, self.ends, self.times)


_NOTHING = np.empty(0, np.int64)
_NO_OWNER = np.empty((0, 0), np.int64)
_NO_JACOBIAN = np.empty((0, 0, 0))


def _module(key: str, dispatchers: dict[str, Dispatcher], name: str, source: str) -> types.ModuleType:
    """The generated module of this key, loaded once (compiled machine code from the cache where it is there)."""
    path = cache_directory() / f"f{key[:32]}.py"
    known = sys.modules.get(f"contin_{path.stem}")
    if known is not None:
        return known
    if not path.exists() or path.read_text(encoding="utf-8") != source:
        path = write_source(path.name, source)
    spec: Any = importlib.util.spec_from_file_location(f"contin_{path.stem}", path)
    module = importlib.util.module_from_spec(spec)
    vars(module).update(dispatchers)
    sys.modules[spec.name] = module  # numba looks it up by name when it loads the compiled code
    try:
        spec.loader.exec_module(module)
    except BaseException as error:
        del sys.modules[spec.name]
        if isinstance(error, (numba.core.errors.NumbaError, AssertionError)):  # the latter are numba's own
            raise ProblemError(_explain(name, error)) from error
        raise
    return module


def _explain(name: str, error: Exception) -> str:
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    reason = next((line for line in lines if line.startswith(("No implementation", "Untyped", "Unknown", "Invalid"))), None)
    reason = reason or (lines[0] if lines else "numba fails (a list of whole and other numbers? write 0.0, not 0)")
    return (
        f"function {name!r} cannot be compiled for real and complex numbers: {reason} "
        "(use arithmetic, comparisons, and functions of numbers from math or numpy)"
    )
