"""A strip or a structure of them as a picture: its lit surface with hidden parts hidden, pixel by pixel, at its width."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from branches.draw.structure import parts_of, solids_of

FRONT, BACK, EDGE, JOINT, SUPPORT, FORCE = "#E8A33D", "#7A5195", "#2B1D0E", "#8FA3B5", "#4F5D6B", "#C8372D"
#: Paints of points by number: the side of a strip that looks to the eye, the other one, a line along an edge, a joint, a
#: support, a force.
_PAINTS = (FRONT, BACK, EDGE, JOINT, SUPPORT, FORCE)
_SIDE, _BEHIND, _EDGE, _JOINT, _SUPPORT, _FORCE = range(6)
#: Width of a strip of unknown dimensions, in units of L/2 pi. Ten times more covers the loop's own radius.
WIDTH = 0.3
#: Part of the largest possible width that a width of our own choice stays below: where generators nearly cross, cells
#: degenerate. At .99 the narrowest cells of the branch (1, 2) are a hundredth of the others.
ROOM = 0.8
#: Pixels of a picture along one side, each the mean of _FINE x _FINE; ten times more take a hundred times longer.
PIXELS, _FINE = 480, 2
#: Samples of the surface per fine pixel, in both directions: above sqrt(2), no pixel of the surface is without a sample.
_DENSE = 1.45
#: Width of the line along an edge, in pixels and at most as a part of the strip.
_LINE, _LINE_PART = 1.3, 0.12
#: The way to the lamp: to the right, up, and towards the eye. It stands to the left of the eye and a little above.
_LAMP = np.array([-0.25499, 0.24183, 0.93623])
#: Stations along a strip at which two strips are compared: the turn between them is a mean over all.
_STATIONS = 200
#: Light from everywhere; the rest is the lamp's.
_AMBIENT = 0.45


@dataclass(frozen=True)
class View:
    """The side from which strips are seen: azimuth and elevation of the eye, in degrees.

    They are counted from the first axis around the vertical one, and above the horizontal plane. At azimuth -90 the first axis
    points to the right.
    """

    azimuth: float
    elevation: float

    @property
    def axes(self) -> np.ndarray:
        """The directions in space that point right and up in the picture, and to the eye: the rows of a matrix (3, 3)."""
        around, above = math.radians(self.azimuth), math.radians(self.elevation)
        right = np.array([-math.sin(around), math.cos(around), 0.0])
        eye = np.array([math.cos(above) * math.cos(around), math.cos(above) * math.sin(around), math.sin(above)])
        return np.array([right, np.cross(eye, right), eye])


#: Closed strips have no horizontal: they are seen at an angle. Open ones begin along the first axis, which is horizontal in the
#: picture, and their width is seen from above.
OBLIQUE, SIDE = View(-45.0, 32.0), View(-90.0, 20.0)


def steady(strips: dict) -> dict:
    """The strips, each turned so that it moves as little as possible from the one before (Kabsch's rotation)."""
    result: dict = {}
    before = None
    for point, strip in strips.items():
        if before is not None:
            u, _, v = np.linalg.svd(places(strip).T @ before)
            turn = (u * [1, 1, np.sign(np.linalg.det(u @ v))]) @ v
            strip = replace(strip, centreline=strip.centreline @ turn, directors=strip.directors @ turn)
        result[point], before = strip, places(strip)
    return result


def places(strip) -> np.ndarray:
    """Points of the centreline at equal distances, _STATIONS of each strip, shape (K, 3)."""
    found = []
    for part in parts_of(strip):
        stations = np.linspace(0, part.arclength[-1], _STATIONS)
        found.append(np.column_stack([np.interp(stations, part.arclength, x) for x in part.centreline.T]))
    return np.concatenate(found)


def reach_of(shapes, width: float, view: View = OBLIQUE) -> float:
    """Half the side of the square in which all these strips have room."""
    there = [part.surface(width).reshape(-1, 3) for shape in shapes for part in parts_of(shape)]
    there += [solid.vertices for shape in shapes for _, solid in solids_of(shape, width)]
    return 1.03 * float(np.abs(np.concatenate(there) @ view.axes[:2].T).max())


def draw_strip(axes, shape, width: float, reach: float, view: View = OBLIQUE, pixels: int = PIXELS) -> None:
    """Draw a strip, seen from a side, as far as ``reach`` from the origin."""
    picture = rendered(shape, width, reach, pixels, view)
    axes.imshow(picture, extent=(-reach, reach, -reach, reach), interpolation="antialiased")
    axes.set_axis_off()


def rendered(shape, width: float, reach: float, pixels: int, view: View = OBLIQUE) -> np.ndarray:
    """The picture of a strip, shape (pixels, pixels, 4), between 0 and 1; alpha is the part of a pixel that is covered.

    The surface is sampled more densely than the pixels, and of the samples in a pixel the one nearest to the eye is seen: no
    polygons, thus no seams, and parts that pass through each other are cut where they meet.
    """
    fine = pixels * _FINE
    scale = fine / (2 * reach)
    line = min(_LINE * _FINE / scale, _LINE_PART * width)
    samples = [_samples(part, width, scale, line) for part in parts_of(shape)]
    for one, solid in solids_of(shape, width):
        samples.append(_flat_samples(solid, _FORCE if one.number else _SUPPORT if one.held else _JOINT, scale))
    points, normals, paint = (np.concatenate(column) for column in zip(*samples))
    screen = points @ view.axes.T
    pixel = ((screen[:, :2] * [1, -1] + reach) * (fine / (2 * reach))).astype(np.intp)
    inside = (np.abs(screen[:, :2]) < reach).all(axis=1)
    place = np.where(inside, pixel[:, 1] * fine + pixel[:, 0], -1)
    nearness = screen[:, 2].astype(np.float32)
    seen = np.argsort(nearness)  # of several numbers put into one pixel, the last stays: the nearest to the eye
    seen = seen[place[seen] >= 0]
    nearest = np.full(fine * fine, -1)
    nearest[place[seen]] = seen
    covered = np.flatnonzero(nearest >= 0)
    canvas = np.zeros((fine * fine, 4), np.float32)
    canvas[covered] = _colours(normals[nearest[covered]] @ view.axes.T, paint[nearest[covered]])
    canvas = canvas.reshape(pixels, _FINE, pixels, _FINE, 4).mean(axis=(1, 3))
    canvas[..., :3] /= np.maximum(canvas[..., 3:], 1e-6)
    return canvas.clip(0, 1)


def _samples(shape, width: float, scale: float, line: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points of the surface of a strip (K, 3), its unit normals there (K, 3), and their paint: lines along edges are dark."""
    from scipy.interpolate import CubicHermiteSpline, CubicSpline

    s, keep = np.unique(shape.arclength, return_index=True)
    edges = np.linalg.norm(np.diff(shape.surface(width), axis=0), axis=2).sum(axis=0).max()
    fine = np.linspace(s[0], s[-1], math.ceil(1.05 * edges * scale * _DENSE) + 2)
    ruling = shape.rulings()
    middle = CubicHermiteSpline(s, shape.centreline[keep], shape.directors[keep, 2])(fine)  # the tangent is d3
    ruling, normal = CubicSpline(s, np.stack([ruling, shape.directors[:, 1]], axis=1)[keep])(fine).transpose(1, 0, 2)
    count = math.ceil(width * np.linalg.norm(ruling, axis=1).max() * scale * _DENSE) + 2
    across = np.linspace(-width / 2, width / 2, count)
    points = middle[:, None] + across[:, None] * ruling[:, None]
    normals = np.repeat(normal / np.linalg.norm(normal, axis=1)[:, None], count, axis=0)
    return points.reshape(-1, 3), normals, np.tile(np.where(width / 2 - np.abs(across) < line, _EDGE, _SIDE), len(fine))


def _flat_samples(mesh, paint: int, scale: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points (K, 3) of the flat quadrilaterals of a mesh, their unit normals (K, 3), and one paint for all."""
    corners = mesh.vertices[mesh.quads]
    sides = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)
    upright = sides[:, 1::2].max(axis=1) > sides[:, ::2].max(axis=1)  # long sides come first: thin ones take few samples
    corners[upright], sides[upright] = np.roll(corners[upright], 1, axis=1), np.roll(sides[upright], 1, axis=1)
    a, b = (np.linspace(0, 1, math.ceil(sides[:, k::2].max() * scale * _DENSE) + 2) for k in (0, 1))
    weights = np.stack([np.outer(1 - a, 1 - b), np.outer(a, 1 - b), np.outer(a, b), np.outer(1 - a, b)], axis=-1)
    normals = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    points = np.einsum("abi,qij->qabj", weights, corners)
    return points.reshape(-1, 3), np.repeat(normals, a.size * b.size, axis=0), np.full(len(corners) * a.size * b.size, paint)


def _colours(normals, paint) -> np.ndarray:
    """Lit colours (K, 4) of the side that is seen, from normals on the axes of a view and the paint of each point."""
    from matplotlib.colors import to_rgb

    light = _AMBIENT + (1 - _AMBIENT) * np.abs(normals @ _LAMP)
    light[paint == _EDGE] = 1.0
    paint = np.where((paint == _SIDE) & (normals[:, 2] <= 0), _BEHIND, paint)
    colours = np.ones((len(normals), 4), np.float32)
    colours[:, :3] = np.array([to_rgb(colour) for colour in _PAINTS])[paint] * light[:, None]
    return colours
