"""Types of arrays and functions that all rooms use."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any, Protocol

import numpy as np

# Not NDArray, which from numpy 2.5 on is an alias that shows its type only when asked: arguments are compared with these.
Array = np.ndarray[tuple[Any, ...], np.dtype[np.float64]]
ComplexArray = np.ndarray[tuple[Any, ...], np.dtype[np.complex128]]
#: Real or complex ones.
Numbers = Array | ComplexArray
Indices = np.ndarray[tuple[Any, ...], np.dtype[np.int64]]
#: One truth value an entry.
Mask = np.ndarray[tuple[Any, ...], np.dtype[np.bool_]]
#: Sparsity pattern, shape (values, inputs): which values depend on which inputs.
Pattern = Mask
#: A user's function, which the engine compiles.
Function = Callable[..., Any]


class Named(Protocol):
    """States or parameters as users' functions get them: ``u.x``, ``u[0]``, ``x, y = u``; numbers, or recorded ones."""

    def __getattr__(self, name: str) -> Any: ...
    def __getitem__(self, place: int) -> Any: ...
    def __iter__(self) -> Iterator[Any]: ...


#: Points of a mesh, as a user gives them.
Places = Sequence[float] | Array
