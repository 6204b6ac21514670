"""Types of arrays and functions that all rooms use."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
#: Real or complex ones.
Numbers = NDArray[np.float64] | NDArray[np.complex128]
Indices = NDArray[np.int64]
#: One truth value an entry.
Mask = NDArray[np.bool_]
#: Sparsity pattern, shape (values, inputs): which values depend on which inputs.
Pattern = NDArray[np.bool_]
#: A user's function, which the engine compiles.
Function = Callable[..., Any]


class Named(Protocol):
    """States or parameters as users' functions get them: ``u.x``, ``u[0]``, ``x, y = u``; numbers, or recorded ones."""

    def __getattr__(self, name: str) -> Any:
        """Return one by its name."""

    def __getitem__(self, place: int) -> Any:
        """Return one by its place."""

    def __iter__(self) -> Iterator[Any]:
        """Iterate over all."""


#: Points of a mesh, as a user gives them.
Places = Sequence[float] | Array
