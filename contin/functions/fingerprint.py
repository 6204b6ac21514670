"""Fingerprints: keys under which compiled and derived code is kept.

A fingerprint covers everything that can change what a function computes: its bytecode and constants, the values of the
globals, defaults and closure variables that it reads, and all of this for the functions that it calls. The walk through
them is in `contin.functions.rewriting`. Two different values never have the same encoding. An object of an unknown type may
get another one in every process, which costs a compilation and nothing else.
"""

from __future__ import annotations

import functools
import hashlib
import pickle
import types
from pathlib import Path
from typing import Any

import numpy as np

#: Types whose ``repr`` says all there is to say.
_PLAIN = (bool, int, float, complex, str, bytes, type(None), type(...), range, slice)


class Fingerprint:
    """A hash of values, in the order in which they are noted."""

    def __init__(self) -> None:
        self._hash = hashlib.sha256()

    def note(self, *values: object) -> None:
        """Add values."""
        for value in values:
            self._hash.update(_encoded(value))

    def note_code(self, code: types.CodeType) -> None:
        """Add a code object, without the functions defined in it."""
        self.note(code.co_code, code.co_names, code.co_varnames, code.co_freevars, code.co_cellvars, code.co_flags)
        self.note(code.co_argcount, code.co_kwonlyargcount, code.co_posonlyargcount, code.co_exceptiontable)
        self.note(*(constant for constant in code.co_consts if not isinstance(constant, types.CodeType)))

    def text(self) -> str:
        """Return the fingerprint, 64 hexadecimal digits."""
        return self._hash.hexdigest()


@functools.cache
def contents(*files: Path) -> str:
    """Return a fingerprint of what files hold."""
    return hashlib.sha256(b"\0".join(file.read_bytes() for file in files)).hexdigest()


def _encoded(value: Any) -> bytes:
    """Return bytes that no other value has: type and length first, so that neighbours cannot run into each other."""
    kind, data = _parts(value)
    name = f"{kind}:{len(data)}:".encode()
    return name + data


def _parts(value: Any) -> tuple[str, bytes]:
    """Return the kind of a value, and what tells it from others of that kind."""
    if type(value) in _PLAIN:
        return type(value).__name__, repr(value).encode()
    if isinstance(value, np.ndarray) and not value.dtype.hasobject:
        return "array", _encoded((value.dtype.descr, value.shape)) + value.tobytes()
    if isinstance(value, np.generic) and not value.dtype.hasobject:
        return "number", _encoded(value.dtype.descr) + value.tobytes()
    if isinstance(value, (tuple, list)):
        items = b"".join(map(_encoded, (*getattr(value, "_fields", ()), *value)))
        return f"{type(value).__module__}.{type(value).__qualname__}", items
    if isinstance(value, dict):
        return "dict", b"".join(map(_encoded, (part for item in value.items() for part in item)))
    if isinstance(value, (set, frozenset)):
        return "set", b"".join(sorted(map(_encoded, value)))
    if isinstance(value, (type, types.BuiltinFunctionType, np.ufunc)):
        name = f"{getattr(value, '__module__', '')}.{getattr(value, '__qualname__', value.__name__)}"
        return "name", name.encode() + _encoded(getattr(value, "_fields", ()))  # named tuples of one name may differ in these
    try:
        return "object", pickle.dumps(value)
    except Exception:  # an object may refuse in any way; its repr has its address, or whatever its author thought right
        return "unknown", repr(value).encode()
