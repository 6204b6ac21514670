"""Round-off as a test: values of users' functions, moved by one unit in the last place.

With ``CONTIN_ROUND_OFF=1`` (or 2, 3, ...) in the environment every value and every derivative that a user's function returns is
moved by -1, 0 or +1 unit in its last place. A hash of the value's own bits and of this number decides which, so that a run
repeats bit for bit. Labels, orders, directions and notes must be the same with and without it, and values within their errors:
another processor or another library moves them as much. Tests of functions that compare bits run without it.
"""

from __future__ import annotations

import os

import numpy as np

from contin.arrays import Array

#: The number in the environment; 0 leaves values alone.
SEED = int(os.environ.get("CONTIN_ROUND_OFF") or 0)

#: Factors of the hash (splitmix64).
FACTORS = 0x9E3779B97F4A7C15, 0xBF58476D1CE4E5B9, 0x94D049BB133111EB


def move(values: Array, seed: int | None = None) -> None:
    """Move numbers of a contiguous array of float or complex numbers in place, by `SEED` or another; zero, inf and NaN stay.

    Examples
    --------
    >>> x = np.array([1.0, 3.0, 0.0])
    >>> move(x, seed=1)
    >>> bool(np.all(abs(x - [1.0, 3.0, 0.0]) <= [2.3e-16, 4.5e-16, 0.0]))
    True
    """
    seed = SEED if seed is None else seed
    bits = values.view(np.float64).reshape(-1).view(np.uint64)
    mixed = (bits ^ np.uint64(seed * FACTORS[0] % 2**64)) * np.uint64(FACTORS[1])
    mixed = (mixed ^ (mixed >> np.uint64(27))) * np.uint64(FACTORS[2])
    numbers = bits.view(np.float64)
    with np.errstate(invalid="ignore"):
        normal = np.isfinite(numbers) & (np.abs(numbers) >= np.finfo(float).tiny)
    bits += np.where(normal, (mixed >> np.uint64(33)) % np.uint64(3) - np.uint64(1), np.uint64(0))
