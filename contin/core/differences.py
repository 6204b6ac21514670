"""Derivatives along a line by differences, with an estimate of their error.

They serve what states no derivatives: discretizations and functions that others have written. Everything in `contin` itself
has exact ones.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from contin.arrays import Array

#: First length, by order of the derivative: the fifth, sixth and seventh root of round-off, where the errors of a fourth-order
#: difference and of round-off are equal for functions that bend on the scale of one. With a ten times larger one the first
#: estimate of exp is wrong by 1e-8, and the lengths below are tried.
_LENGTHS = {1: 1e-3, 2: 3e-3, 3: 6e-3}
#: Factor between lengths. With .01 the best of them is missed by more.
_SHORTER = 0.1
#: Number of lengths: the shortest is 1e-7, where round-off of first derivatives is 1e-9.
_TIMES = 5
#: Differences of second and of fourth order that agree to this part are taken at once: the better one is good to the square of
#: it. Ten times larger, tangents at branch points could be wrong by 1e-5.
_AGREE = 1e-4
#: Weights of the function at h and at 2 h, for fourth and for second order; odd derivatives take differences of the two sides,
#: even ones sums less twice the middle. The third derivative of fourth order also takes 3 h.
_WEIGHTS = {
    1: np.array([[8.0, -1.0, 0.0], [6.0, 0.0, 0.0]]) / 12,
    2: np.array([[16.0, -1.0, 0.0], [12.0, 0.0, 0.0]]) / 12,
    3: np.array([[-13.0, 8.0, -1.0], [-8.0, 4.0, 0.0]]) / 8,
}


def derivative(function: Callable[[float], Any], order: int = 1, size: float = 1.0) -> tuple[Any, float]:
    """Return the derivative at 0 of a function of one number, a number or an array, and an estimate of its error.

    Parameters
    ----------
    function : callable
    order : int
        1, 2 or 3.
    size : float
        The change of the argument that counts as one.

    Returns
    -------
    value, error : number or ndarray, float
        The error is that of the largest component.

    Examples
    --------
    >>> import math
    >>> value, error = derivative(lambda s: math.sin(s), 3)
    >>> abs(value + 1) < error < 1e-6
    True
    """
    middle = np.asarray(function(0.0), dtype=float)
    best, least = np.full(middle.shape, np.nan), np.inf
    length = _LENGTHS[order] * size
    for _ in range(_TIMES):
        fourth, second = _differences(function, middle, order, length)
        scale, apart = _largest(fourth), _largest(fourth - second)
        round_off = _EPSILON * _largest(middle) / length**order
        error = min(apart, _SAFE * apart * apart / scale if scale else 0.0) + round_off
        if error < least:  # not where values are not finite
            best, least = fourth, error
        if apart <= _AGREE * scale or round_off > least:
            break
        length *= _SHORTER
    return (best if best.shape else float(best)), least


#: Round-off of a function, relative to its value. Three times larger, derivatives of third order miss by 2e-5.
_EPSILON = 1e-15
#: The error of fourth order is estimated as this times the square of that of second order, relative: of sin(1 + x) it is 1.6
#: times that at most. Ten times larger, differences are taken over shorter lengths than needed.
_SAFE = 4.0


def _largest(values: Array) -> float:
    return float(np.abs(values).max(initial=0.0))


def _differences(function: Callable[[float], Any], middle: Array, order: int, h: float) -> Array:
    """Return differences of a length, of fourth order and of second."""
    weights = _WEIGHTS[order]
    count = int(np.count_nonzero(weights[0]))
    total = np.zeros((2, *middle.shape))
    for k in range(count):
        ahead, behind = (np.asarray(function(s * (k + 1) * h), dtype=float) for s in (1, -1))
        side = ahead - behind if order % 2 else ahead + behind - 2 * middle
        total += np.multiply.outer(weights[:, k], side)
    return total / h**order
