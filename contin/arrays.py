"""Types of arrays and functions that all rooms use."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

#: Who depends on whom, shape (values, states or more).
Pattern = NDArray[np.bool_]

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
Indices = NDArray[np.int64]
#: A user's function, which the engine compiles.
Function = Callable[..., Any]
