"""Random numbers, and places to compare functions at: the same ones in every run."""

from __future__ import annotations

import functools
import os
from collections.abc import Callable
from typing import Any

import numpy as np

from contin.arrays import Array, Numbers

#: ``CONTIN_DRAWS=1`` (2, 3, ...) in the environment changes all seeds: labels must be the same, and values within their errors.
_SEED = int(os.environ.get("CONTIN_DRAWS") or 0)
#: Draws of round-off: numbers are computed again with random signs of a unit in the last place. The largest change of three is
#: seldom below half of what is usual, and at least half of that of ten.
DRAWS = 3
#: Places at which functions are compared. Functions that differ agree at none of them; with fewer than three, null vectors that
#: differ by a thousandth passed for the same.
PLACES = 5
#: Distance of a place beside a point, relative to 1 + |x|: far enough that what vanishes at the point does not there. Ten times
#: nearer, null vectors that turn slowly would count as fixed; ten times further, places are outside of the domain of equations.
ASIDE = 0.1


class _Seed(np.random.SeedSequence):
    """A seed whose bits are mixed once: that takes twenty times as long as all else of a generator."""

    generate_state: Any = functools.cache(np.random.SeedSequence.generate_state)


_seed = functools.cache(lambda word: _Seed([_SEED, *word.encode()]))


def generator(word: str) -> np.random.Generator:
    """Return a generator of random numbers whose seed is a word, so that runs repeat bit for bit."""
    return np.random.Generator(np.random.PCG64(_seed(word)))


def signs(random: np.random.Generator, like: Array) -> Array:
    """Return random signs, of the shape of an array."""
    return np.copysign(1.0, random.random(like.shape) - 0.5)


def rounded(random: np.random.Generator, x: Array) -> Array:
    """Return numbers moved up or down by one unit in the last place."""
    return x * (1 + np.finfo(float).eps * signs(random, x))


def spread(word: str, change: Callable[[np.random.Generator], Numbers | float]) -> Array:
    """Return the largest size of changes by round-off: ``change`` is called `DRAWS` times with random numbers of this word."""
    random = generator(word)
    return np.asarray(np.max([np.abs(change(random)) for _ in range(DRAWS)], axis=0))
