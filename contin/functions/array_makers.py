"""Arrays that compiled functions make: stand-ins of ``np.zeros``, ``np.vstack`` and alike for real and for complex numbers.

Numba makes arrays of real numbers where numpy does, and an array of real numbers takes no complex ones. It stacks arrays only;
users of SciPy stack numbers, too: ``np.vstack((y[1], -y[0]))``.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import types
from numba.extending import overload

#: Kinds of numbers: values are computed with the first, derivatives with the second.
REAL, COMPLEX = "real", "complex"
_KINDS: dict[str, Any] = {REAL: np.float64, COMPLEX: np.complex128}


def _written(name, arguments, value, **scope):
    """Return the function of this name; numba tells implementations apart by their names (`contin.functions.analytic`)."""
    scope |= {"__name__": __name__, "np": np}
    exec(f"def {name}({arguments}):\n    return {value}", scope)
    return scope[name]


def _stays(dtype):
    """Return whether a type that a user named must stay: whole numbers and truth values are no quantities."""
    return any(word in str(dtype).lower() for word in ("int", "bool"))


def _maker(maker, kind):
    """Return the stand-in of ``np.zeros``, ``np.empty`` or ``np.ones``."""
    name = f"{maker.__name__}_{kind}"
    make = _written(name, "shape, dtype=None", "None")
    replaced = _written(f"{name}_of_kind", "shape, dtype=None", "maker(shape, number)", maker=maker, number=_KINDS[kind])
    kept = _written(f"{name}_as_given", "shape, dtype=None", "maker(shape, dtype)", maker=maker)

    def choose(shape, dtype=None):
        return kept if _stays(dtype) else replaced

    overload(make)(choose)
    return make


def _maker_like(maker, kind):
    """Return the stand-in of ``np.zeros_like``, ``np.empty_like`` or ``np.ones_like``; the states may be a tuple."""
    name, scope = f"{maker.__name__}_like_{kind}", {"maker": maker, "number": _KINDS[kind]}
    make = _written(name, "like", "None")
    of_array = _written(f"{name}_of_array", "like", "maker(like.shape, number)", **scope)
    of_tuple = _written(f"{name}_of_tuple", "like", "maker(len(like), number)", **scope)

    def choose(like):
        return of_array if isinstance(like, types.Array) else of_tuple

    overload(make)(choose)
    return make


def _full(kind):
    """Return the stand-in of ``np.full``."""
    make = _written(f"full_{kind}", "shape, value", "None")
    filled = _written(f"full_{kind}_of_kind", "shape, value", "np.full(shape, value, number)", number=_KINDS[kind])
    overload(make)(lambda shape, value: filled)
    return make


def _stacker(stack, kind):
    """Return the stand-in of ``np.stack``, ``np.vstack`` or ``np.hstack``: numbers become an array of one dimension."""
    name = f"{stack.__name__}_{kind}"
    make = _written(name, "values", "None")
    of_arrays = _written(f"{name}_of_arrays", "values", "stack(values)", stack=stack)

    def choose(values):
        kinds: Any = values if isinstance(values, types.BaseTuple) else ()  # a type of a tuple holds those of its items
        if not (kinds and all(isinstance(each, types.Number) for each in kinds)):
            return of_arrays
        items = ", ".join(f"values[{i}]" for i in range(len(values)))
        return _written(f"{name}_of_numbers", "values", f"np.array([{items}])")

    overload(make)(choose)
    return make


#: Functions of numpy that make arrays, and what replaces them, by the kind of numbers.
ARRAYS: dict[str, dict[Any, Any]] = {
    kind: {
        **{maker: _maker(maker, kind) for maker in (np.zeros, np.empty, np.ones)},
        np.zeros_like: _maker_like(np.zeros, kind),
        np.empty_like: _maker_like(np.empty, kind),
        np.ones_like: _maker_like(np.ones, kind),
        np.full: _full(kind),
        **{stack: _stacker(stack, kind) for stack in (np.stack, np.vstack, np.hstack)},
    }
    for kind in _KINDS
}
