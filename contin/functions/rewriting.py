"""Users' functions rewritten: copies of a function and of all plain Python functions that it refers to, with stand-ins.

One walk through globals, defaults, closures and modules serves every purpose: compiling for the complex step, tracing a
sparsity pattern, symbolic differentiation. Each is a `Rewriter` that says which values have a stand-in and what becomes of a
copy. The walk takes a fingerprint of everything that it meets.
"""

from __future__ import annotations

import builtins
import dis
import types
from typing import Any

from contin import checks
from contin.arrays import Function
from contin.errors import CompilationError
from contin.functions.fingerprint import Fingerprint


class Rewriter:
    """Rewrite functions and what they call, and take a fingerprint of them all.

    Subclasses override `finished` and `stand_in`.
    """

    def __init__(self) -> None:
        self._done: dict[object, tuple[Any, str]] = {}
        self._open: set[object] = set()
        self._fingerprints = [Fingerprint()]  # of the whole, then of each function that is being rewritten

    def finished(self, copy: types.FunctionType) -> Any:
        """Return what a rewritten function becomes."""
        return copy

    def stand_in(self, value: Any) -> Any:
        """Return what takes the place of a global value, None where the value stays."""
        return None

    def fingerprint(self) -> str:
        """Return the fingerprint of everything so far."""
        return self._fingerprints[0].text()

    def note(self, *values: object) -> None:
        """Let values count in the fingerprint."""
        self._fingerprints[-1].note(*values)

    def function(self, function: Function) -> Any:
        """Rewrite ``function`` and all plain Python functions that it refers to.

        The copy is named after its own fingerprint: numba tells machine code apart by names, and two functions that share a
        name, cached by two processes, would be taken for one another in a third.

        Raises
        ------
        CompilationError
            It is no plain Python function, or it calls itself.
        """
        function = getattr(function, "py_func", function)
        if not isinstance(function, types.FunctionType):
            raise CompilationError(f"{checks.shown(function)} is no plain Python function (def or lambda)")
        if function in self._open:
            raise CompilationError(f"function {function.__name__!r} calls itself; write a loop instead")
        if function not in self._done:
            self._open.add(function)
            self._fingerprints.append(Fingerprint())
            copy = self._copy(function)
            digest = self._fingerprints.pop().text()
            copy.__name__ = copy.__qualname__ = f"user_{digest[:32]}"
            self._done[function] = self.finished(copy), digest
            self._open.discard(function)
        kept, digest = self._done[function]
        self.note(digest)
        return kept

    def _copy(self, function: types.FunctionType) -> types.FunctionType:
        """Return the function with everything that it refers to rewritten."""
        attributes, loaded = self._names(function.__code__)
        self.note(function.__defaults__, function.__kwdefaults__)
        globals_ = {"__name__": __name__, "__builtins__": __builtins__}  # numba imports the module of that name
        for name in sorted(loaded):
            self.note(name, name in function.__globals__)
            if name in function.__globals__:
                globals_[name] = self._value(function.__globals__[name], attributes)
            elif name in ("abs", "max", "min"):
                globals_[name] = self._value(getattr(builtins, name), attributes)
        cells = [types.CellType(self._value(cell.cell_contents, attributes)) for cell in function.__closure__ or ()]
        copy = types.FunctionType(function.__code__, globals_, function.__name__, function.__defaults__, tuple(cells) or None)
        copy.__kwdefaults__ = function.__kwdefaults__
        return copy

    def _names(self, code: types.CodeType) -> tuple[set[str], set[str]]:
        """Return the attributes and the globals that a code object, and those inside it, use; note their code.

        A state may have the name of a global (``u.f`` in a function ``f``): the instructions tell the two apart. Attributes of
        local variables are states and parameters and do not count.
        """
        self._fingerprints[-1].note_code(code)
        attributes, loaded, before = set(), set(), ""
        for step in dis.get_instructions(code):
            if step.opname in ("LOAD_GLOBAL", "LOAD_NAME"):
                loaded.add(step.argval)
            elif step.opname in ("LOAD_ATTR", "LOAD_METHOD") and not before.startswith("LOAD_FAST"):
                attributes.add(step.argval)
            before = step.opname
        for constant in code.co_consts:
            if isinstance(constant, types.CodeType):
                inner_attributes, inner_loaded = self._names(constant)
                attributes, loaded = attributes | inner_attributes, loaded | inner_loaded
        return attributes, loaded

    def _value(self, value: Any, attributes: set[str]) -> object:
        """Return what stands for a global or closure value inside the rewritten code."""
        replaced = self.stand_in(value)
        if replaced is not None:
            self.note(value)
            return replaced
        if isinstance(getattr(value, "py_func", value), types.FunctionType):
            return self.function(value)
        if isinstance(value, types.ModuleType):
            return self._module(value, attributes)
        self.note(value)
        return value

    def _module(self, module: types.ModuleType, attributes: set[str]) -> types.ModuleType:
        """Return a copy of a module that holds just the ``attributes`` used, rewritten."""
        copy = types.ModuleType(module.__name__)
        self.note(module.__name__)
        for name in sorted(attributes & set(dir(module))):
            self.note(name)
            setattr(copy, name, self._attribute(module, getattr(module, name), attributes))
        return copy

    def _attribute(self, module: types.ModuleType, value: Any, attributes: set[str]) -> object:
        """Return what stands for a module's attribute; of numpy and math nothing is rewritten but what has a stand-in."""
        if module.__name__ in ("numpy", "math"):
            return value if (replaced := self.stand_in(value)) is None else replaced
        return self._value(value, attributes)
