"""Values between the computed points of many pieces of branches: cubic splines over arclength, all in one linear system.

The splines are those of `scipy.interpolate.CubicSpline` (not-a-knot). One at a time they took three seconds for a question on
a sweep of 2801 branches, together they take 0.07 s.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np

from contin.lowlevel import hermite, levels

#: A spline takes so many points; fewer are joined by straight lines.
_FEWEST = 4


def places(pieces: Sequence[dict], column: str, value: float, wanted: Sequence[str]) -> list[tuple[int, dict[str, float]]]:
    """Return the places at which a column of some pieces has a value, in order.

    Each is the number of the piece, and the wanted columns there. Pieces hold columns as lists: ``arclength``, ``column`` and
    those ``wanted``.
    """
    lengths = np.array([len(piece[column]) for piece in pieces], dtype=int)
    above = np.fromiter(itertools.chain.from_iterable(piece[column] for piece in pieces), float, lengths.sum()) > value
    changes = np.append(above[1:] != above[:-1], [False]) if len(above) else above
    changes[np.cumsum(lengths) - 1] = False  # from one piece to the next
    met = np.unique(np.repeat(np.arange(len(pieces)), lengths)[changes])
    if not len(met):
        return []
    names = (column, *wanted)
    s, values, owner = _joined([pieces[i] for i in met], names)
    left, right = _slopes(s, values, owner)
    inside = np.flatnonzero((owner[1:] == owner[:-1]) & ((values[1:, 0] > value) != (values[:-1, 0] > value)))
    h, y0, y1 = np.diff(s)[inside, None], values[inside], values[inside + 1]
    cubic = (y0, h * left[inside], h * right[inside], y1)
    low, high = np.zeros(len(inside)), np.ones(len(inside))
    for _ in range(levels.MOST_HALVINGS):
        middle = (low + high) / 2
        before = (hermite(*cubic, middle[:, None])[:, 0] > value) == (y0[:, 0] > value)
        low, high = np.where(before, middle, low), np.where(before, high, middle)
    found = hermite(*cubic, (low + high)[:, None] / 2)
    return [(int(met[owner[i]]), dict(zip(wanted, row[1:].tolist()))) for i, row in zip(inside, found)]


def uncertainty(piece: dict, s: float, column: str, wanted: Sequence[str]) -> dict[str, float]:
    """Return estimated errors of wanted columns at the place s where a column is interpolated to have a value.

    By the largest third difference of neighbouring points around s, as if parabolas had been used. The error of a cubic is
    smaller, by a factor of about ten where the points are close enough to interpolate at all. In the intervals beside special
    points it is the error of straight lines: their arclength is off by some percent of the interval, so a cubic gains nothing.
    nan with fewer than four points.
    """
    arclength, keep = np.unique(piece["arclength"], return_index=True)
    if len(arclength) < _FEWEST:
        return dict.fromkeys(wanted, float("nan"))
    i = int(np.clip(np.searchsorted(arclength, s, side="right") - 1, 0, len(arclength) - 2))
    firsts = np.unique(np.clip([i - 2, i - 1, i], 0, len(arclength) - _FEWEST))
    cubics, errors = {}, {}
    for name in (column, *wanted):
        rows, found = np.asarray(piece[name])[keep], []
        for first in firsts:
            at = arclength[first : first + _FEWEST] - s
            cubic = np.linalg.solve(np.vander(at, increasing=True), rows[first : first + _FEWEST])
            found.append((abs(cubic[3]) * (at[-1] - at[0]), cubic))
        errors[name], cubics[name] = max(found, key=lambda pair: pair[0])
        if i in (0, len(arclength) - 2):
            errors[name] = max(errors[name], abs(cubics[name][2]))
        errors[name] *= abs((arclength[i] - s) * (arclength[i + 1] - s))
    _, slope, curvature, _ = abs(cubics[column])
    room = np.sqrt(max(slope**2 - 4 * errors[column] * curvature, 0.0))  # beside a fold of the column the place moves further
    moved = 2 * errors[column] / (slope + room) if slope + room else np.inf
    return {name: float(errors[name] + moved * (abs(cubics[name][1]) + moved * abs(cubics[name][2]))) for name in wanted}


def _joined(pieces: Sequence[dict], names: Sequence[str]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the arclengths (K,) and columns (K, names) of pieces one after the other, and the number of each point's piece."""
    parts = []
    for piece in pieces:
        s, keep = np.unique(piece["arclength"], return_index=True)
        parts.append(np.column_stack([s, *(np.asarray(piece[name])[keep] for name in names)]))
    owner = np.repeat(np.arange(len(parts)), [len(part) for part in parts])
    table = np.concatenate(parts)
    return table[:, 0], table[:, 1:], owner


def _slopes(s: np.ndarray, values: np.ndarray, owner: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the slopes at both ends of every interval, shape (K - 1, columns); those between two pieces have no meaning.

    The slopes d of a piece with points 0 ... N, intervals h and secants m solve

        | h1  s2-s0                      | |d0|   | ((h0 + 2 (s2-s0)) h1 m0 + h0^2 m1) / (s2-s0) |
        | h1  2(h0+h1)  h0               | |d1| = | 3 (h1 m0 + h0 m1)                            |
        |     ...                        | |..|   | ...                                          |
        |           sN-sN-2    hN-2      | |dN|   | as the first row, from the other end         |
    """
    from scipy.linalg import solve_banded

    h = np.where(owner[1:] != owner[:-1], 1.0, np.diff(s))
    secants = np.diff(values, axis=0) / h[:, None]
    counts = np.bincount(owner)
    first, last = np.cumsum(counts) - counts, np.cumsum(counts) - 1
    long = counts >= _FEWEST
    bands, right = np.zeros((3, len(s))), np.zeros_like(values)  # above, on and below the diagonal
    bands[1] = 1.0
    inner = np.flatnonzero(long[owner] & ~np.isin(np.arange(len(s)), [*first, *last]))
    bands[0, inner + 1], bands[1, inner], bands[2, inner - 1] = h[inner - 1], 2 * (h[inner - 1] + h[inner]), h[inner]
    right[inner] = 3 * (h[inner, None] * secants[inner - 1] + h[inner - 1, None] * secants[inner])
    for at, step, near, far in ((first[long], 1, 0, 1), (last[long], -1, -1, -2)):
        h0, h1, m0, m1 = h[at + near], h[at + far], secants[at + near], secants[at + far]
        both = h0 + h1
        bands[1, at], bands[1 - step, at + step] = h1, both
        right[at] = (((h0 + 2 * both) * h1)[:, None] * m0 + (h0**2)[:, None] * m1) / both[:, None]
    d = solve_banded((1, 1), bands, right)
    straight = ~long[owner[:-1], None]
    return np.where(straight, secants, d[:-1]), np.where(straight, secants, d[1:])
