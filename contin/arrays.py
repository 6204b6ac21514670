"""Types of arrays and functions that all rooms use."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
Indices = NDArray[np.int64]
#: One truth value an entry.
Mask = NDArray[np.bool_]
#: Sparsity pattern, shape (values, inputs): which values depend on which inputs.
Pattern = NDArray[np.bool_]
#: A user's function, which the engine compiles.
Function = Callable[..., Any]
#: Points of a mesh, as a user gives them.
Places = Sequence[float] | Array
