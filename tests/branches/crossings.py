"""How often polylines cross: the yardstick of disentangled diagrams."""

import numpy as np


def crossings(polylines, window):
    """How often polylines (K, 2) cross each other inside a window of the first coordinate."""
    inside = [_clipped(line, window) for line in polylines]
    return sum(_pair(a, b) for i, a in enumerate(inside) for b in inside[:i])


def _clipped(line, window):
    """The segments (S, 2, 2) of a polyline inside the window, cut at its sides."""
    a, b = line[:-1], line[1:]
    dx = np.where(b[:, 0] == a[:, 0], 1e-300, b[:, 0] - a[:, 0])
    t = np.sort((np.array(window)[:, None] - a[:, 0]) / dx, axis=0).clip(0, 1)
    kept = t[1] > t[0]
    return np.stack([a + part[:, None] * (b - a) for part in t], axis=1)[kept]


def _pair(first, second):
    """How many segments (S, 2, 2) cross segments (R, 2, 2)."""

    def side(segments, points):
        a, b = segments[:, None, None, 0], segments[:, None, None, 1]
        u, v = b - a, points[None] - a
        return np.sign(u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0])

    one, two = side(first, second), side(second, first)
    return int(np.sum((one.prod(axis=2) < 0) & (two.prod(axis=2) < 0).T))
