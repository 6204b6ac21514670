"""Segments: parts of a long mesh that are assembled, eliminated and solved for independently, by several threads.

Their number depends on the size of the matrix only, and so does the order of the arithmetic: results have the same bits for
any number of threads. A matrix that is not large is one segment, or as many as its problem wants.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from contin import threads
from contin.arrays import Indices
from contin.functions.kernel_parts import IndexVector
from contin.threads import PARTS

#: Numbers in the blocks of all intervals from which on there are segments. There a Newton iteration takes .7 times as long with
#: two threads as with one (300 intervals, 13 states, degree 4); with four times fewer numbers it takes as long.
_LARGE = 2**20


class Share(NamedTuple):
    """What one call of a kernel does: stage ``stage`` for the segments ``first`` to ``last``, without ``last``; or all of it.

    ``starts`` (S + 1,) are the first intervals of the segments, and N. ``stage`` is `ALL` for all stages.
    """

    starts: IndexVector
    first: int
    last: int
    stage: int


#: All stages, one after the other.
ALL = -1


def is_large(numbers: int) -> bool:
    """Return whether so many numbers in the blocks of all intervals are worth several threads."""
    return numbers >= _LARGE


def share(intervals: int, numbers: int, least: int = 1) -> Share:
    """Return the whole of a matrix with this many intervals and ``numbers`` in their blocks: ``least`` segments or more."""
    return _share(intervals, max(1, min(PARTS if is_large(numbers) else least, intervals // 2)))


@functools.lru_cache(maxsize=32)  # each matrix of a mesh asks for it
def _share(intervals: int, segments: int) -> Share:
    starts: Indices = np.arange(segments + 1) * intervals // segments
    return Share(starts, 0, segments, ALL)


def run(kernel: Callable[..., Any], given: Sequence[Any], whole: Share, stages: Sequence[bool]) -> list[Any]:
    """Return the results of ``kernel(*given, share)``: one call for a matrix that is one segment, or else stage by stage.

    ``stages`` says for each stage whether segments are independent in it; then they are calls of their own, in several threads.
    """
    if whole.last == 1 or threads.count() == 1:
        return [kernel(*given, whole)]
    results: list[Any] = []
    for stage, independent in enumerate(stages):
        if independent:
            shares = [whole._replace(first=s, last=s + 1, stage=stage) for s in range(whole.last)]
            results += threads.each(lambda part: kernel(*given, part), shares)
        else:
            results.append(kernel(*given, whole._replace(stage=stage)))
    return results
