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

    Subclasses override `finished`, `finished_method` and `stand_in`. Attributes of objects and entries of dictionaries count as
    globals do: they are read when the function is rewritten.
    """

    #: Tells copies apart that differ in their stand-ins.
    flavour = ""

    def __init__(self) -> None:
        self._done: dict[object, tuple[Any, str]] = {}
        self._open: set[object] = set()
        self._fingerprints = [Fingerprint()]  # of the whole, then of each function that is being rewritten

    def finished(self, copy: types.FunctionType) -> Any:
        """Return what a rewritten function becomes."""
        return copy

    def finished_method(self, copy: types.FunctionType, owner: types.ModuleType) -> Any:
        """Return what a rewritten method becomes; ``owner`` holds what the method reads of its object."""
        return types.MethodType(copy, owner)

    def finished_dictionary(self, copy: dict[str, Any]) -> Any:
        """Return what a dictionary becomes whose entries are rewritten."""
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
        plain, owner = getattr(function, "__func__", function), getattr(function, "__self__", None)
        if not isinstance(plain, types.FunctionType):
            raise CompilationError(f"{checks.shown(function)} is no plain Python function (def or lambda)")
        key = plain, None if owner is None else id(owner)
        if key in self._open:
            raise CompilationError(f"function {plain.__name__!r} calls itself; write a loop instead")
        if key not in self._done:
            self._open.add(key)
            self._fingerprints.append(Fingerprint())
            self.note(self.flavour)
            copy = self._copy(plain)
            stand_in = None if owner is None else self._object(owner, _attributes(plain.__code__))
            digest = self._fingerprints.pop().text()
            copy.__name__ = copy.__qualname__ = f"user_{digest[:32]}"
            self._done[key] = self.finished(copy) if stand_in is None else self.finished_method(copy, stand_in), digest
            self._open.discard(key)
        kept, digest = self._done[key]
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
        if isinstance(getattr(value, "py_func", value), (types.FunctionType, types.MethodType)):
            return self.function(value)
        if isinstance(value, types.ModuleType):
            return self._module(value, attributes)
        if isinstance(value, dict) and value and all(isinstance(key, str) and key.isidentifier() for key in value):
            self.note(*value)
            return self.finished_dictionary({key: self._value(entry, attributes) for key, entry in value.items()})
        if _is_object(value):
            return self._object(value, attributes)
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

    def _object(self, owner: Any, attributes: set[str]) -> types.ModuleType:
        """Return a module that holds those ``attributes`` that an object has, rewritten: compiled code knows modules.

        Raises
        ------
        CompilationError
            The object refers to itself.
        """
        if id(owner) in self._open:
            raise CompilationError(f"an object of the class {type(owner).__name__} refers to itself")
        self._open.add(id(owner))
        copy = types.ModuleType(type(owner).__name__)
        for name in sorted(attributes):
            found = getattr(owner, name, None)
            self.note(name, found is None)
            own = isinstance(found, types.MethodType) and found.__self__ is owner
            if found is not None:
                setattr(copy, name, self._own_method(found, owner) if own else self._value(found, attributes))
        self._open.discard(id(owner))
        return copy

    def _own_method(self, method: types.MethodType, owner: Any) -> Any:
        """Return another method of an object whose attributes are being rewritten."""
        self._open.discard(id(owner))
        found = self.function(method)
        self._open.add(id(owner))
        return found

    def _attribute(self, module: types.ModuleType, value: Any, attributes: set[str]) -> object:
        """Return what stands for a module's attribute; of numpy and math nothing is rewritten but what has a stand-in."""
        if module.__name__ in ("numpy", "math"):
            return value if (replaced := self.stand_in(value)) is None else replaced
        return self._value(value, attributes)


def _attributes(code: types.CodeType) -> set[str]:
    """Return the names of all attributes and globals in a code object, and in those inside it."""
    inner = [_attributes(constant) for constant in code.co_consts if isinstance(constant, types.CodeType)]
    return set(code.co_names).union(*inner)


def _is_object(value: Any) -> bool:
    """Return whether a value is an object of a user's class, whose attributes may be constants of a problem."""
    if type(value).__module__.partition(".")[0] in ("numpy", "scipy"):
        return False
    if isinstance(value, (tuple, list, dict, type)) or callable(value):
        return False
    return isinstance(value, types.SimpleNamespace) or bool(type(value).__flags__ & _HEAP_TYPE)


#: The flag of classes that a class statement made (CPython: Py_TPFLAGS_HEAPTYPE).
_HEAP_TYPE = 1 << 9
