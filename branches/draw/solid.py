"""The strip as a mesh of quadrilaterals: its middle surface, or a closed solid of given thickness."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ribbon_model.shape import Shape

#: Cells across the width. A developable surface is exact with one, but viewers shade cells badly that are fifty times longer
#: than wide. On a twisted one the area is too large by (twist * width/8)**2/12: 2e-4 at 7 rad and 6 % of the length. Ten times
#: more: a hundredth of that, and files ten times larger.
_ACROSS = 8
#: The ends of a strip are joined if the corners of their sections differ by less than this, over the length of the last cell.
#: Closed strips close to 1e-9 of their length, a millionth of a cell. Joining bends the last cell by up to this part of it.
_JOINED = 1e-2


@dataclass(frozen=True)
class Mesh:
    """A mesh of quadrilaterals in space.

    Attributes
    ----------
    vertices : ndarray, shape (V, 3)
    quads : ndarray of int, shape (Q, 4)
        Counterclockwise, seen from the side of d2 (surface) or from outside (solid).
    stations : ndarray of int, shape (V,)
        The node of the centreline for each vertex.
    """

    vertices: np.ndarray
    quads: np.ndarray
    stations: np.ndarray

    @property
    def triangles(self) -> np.ndarray:
        """Return the mesh as triangles: two for each quadrilateral, one for those of which two corners are one."""
        found = np.concatenate([self.quads[:, [0, 1, 2]], self.quads[:, [0, 2, 3]]])
        return found[(found != np.roll(found, 1, axis=1)).all(axis=1)]


def widest(shape: Shape) -> float:
    """Return the width (at breadth 1) at which neighbouring generators of the surface begin to cross; inf if they never do.

    At a distance v along d1 from the centreline, the surface is 1 + v (eta' - omega_2 (1 + eta^2)) times as long as there; it
    vanishes first at half the width. omega_2 is zero for strips that do not bend in their own plane.
    """
    step, d1, d3 = np.diff(shape.arclength), shape.directors[:, 0], shape.directors[:, 2]
    sideways = np.vecdot(np.diff(d1, axis=0), (d3[1:] + d3[:-1]) / 2) / step  # -omega_2
    eta = (shape.eta[1:] + shape.eta[:-1]) / 2
    slope = (_between(shape.breadth) * np.abs(np.diff(shape.eta) / step + sideways * (1 + eta**2))).max()
    return float(2 / slope) if slope > 1e-12 else np.inf


def thickest(shape: Shape, width: float) -> float:
    """Return the thickness (at depth 1) at which the inner side becomes a point where the surface is bent most strongly.

    It is 2 over the largest curvature of the surface. Across a generator that is omega_1 (1 + eta^2)/(1 + v eta') at a distance
    v along d1 from the centreline; between nodes, omega_1 is the angle between neighbouring d2.
    """
    step = np.diff(shape.arclength)
    bend = 2 * np.arcsin(np.clip(np.linalg.norm(np.diff(shape.directors[:, 1], axis=0), axis=1) / 2, 0, 1)) / step
    eta = (shape.eta[1:] + shape.eta[:-1]) / 2
    room = 1 - width / 2 * _between(shape.breadth) * np.abs(np.diff(shape.eta) / step)
    curvature = (_between(shape.depth) * bend * np.sqrt(1 + eta**2) / room).max()  # |d d2/ds| is omega_1 sqrt(1 + eta^2)
    return float(2 / curvature) if curvature > 0 else np.inf


def _between(values):
    """Return values at the nodes, or one for all, between neighbouring nodes."""
    return values if np.ndim(values) == 0 else (values[1:] + values[:-1]) / 2


def surface(shape: Shape, width: float) -> Mesh:
    """Return the middle surface of a strip. Ends that meet are joined, also after a half twist."""
    points, order = shape.surface(width, _ACROSS + 1), np.arange(_ACROSS + 1)
    joint = _joint(points, (order, order[::-1]))
    here, beyond = _cells(points, joint)
    quads = np.stack([here[:, :-1], beyond[:, :-1], beyond[:, 1:], here[:, 1:]], axis=-1)
    return _mesh(points, joint, quads.reshape(-1, 4))


def solid(shape: Shape, width: float, thickness: float) -> Mesh:
    """Return a strip as a closed solid; its volume is length * width * thickness, except for the discretization.

    d2 is the normal of the surface along a whole generator, so both faces are the middle surface moved along d2::

            top       <--------------        d2
                     |              ^        ^
            bottom   v------------->         d3 --> d1      (d3 towards the reader; the order of a section's vertices)

    Ends that meet are joined: after an even number of half twists vertex by vertex, after an odd number top to bottom. Other
    ends are closed by their sections.
    """
    middle = shape.surface(width, _ACROSS + 1)
    half = thickness / 2 * np.reshape(shape.depth, (-1, 1, 1)) * shape.directors[:, None, 1]
    points = np.concatenate([middle - half, (middle + half)[:, ::-1]], axis=1)
    order = np.arange(points.shape[1])
    joint = _joint(points, (order, np.roll(order, _ACROSS + 1)))
    here, beyond = _cells(points, joint)
    following = [np.roll(section, -1, axis=1) for section in (here, beyond)]
    sides = np.stack([here, following[0], following[1], beyond], axis=-1)
    sides[:, _ACROSS + 1 :] = np.roll(sides[:, _ACROSS + 1 :], -1, axis=-1)  # opposite faces have the same diagonals
    quads = [sides.reshape(-1, 4)]
    if joint is None:
        quads += [_lid(here[0])[:, ::-1], _lid(beyond[-1])]
    return _mesh(points, joint, np.concatenate(quads))


def together(meshes: Sequence[Mesh]) -> Mesh:
    """Return several meshes as one, in which they keep their own vertices."""
    before = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes[:-1])])
    quads = np.concatenate([mesh.quads + first for mesh, first in zip(meshes, before)])
    return Mesh(np.concatenate([mesh.vertices for mesh in meshes]), quads, np.concatenate([mesh.stations for mesh in meshes]))


def _lid(section: np.ndarray) -> np.ndarray:
    """Return the quadrilaterals (_ACROSS, 4) that fill a section of a solid, counterclockwise seen from the side of d3."""
    bottom, top = section[: _ACROSS + 1], section[:_ACROSS:-1]
    return np.stack([bottom[:-1], bottom[1:], top[1:], top[:-1]], axis=-1)


def _joint(points: np.ndarray, orders: Sequence[np.ndarray]) -> np.ndarray | None:
    """Return the order in which the first section's vertices are those of the last one; None for ends that do not meet."""
    cell = np.linalg.norm(points[-1] - points[-2], axis=1).max()
    for order in orders:
        if np.abs(points[-1] - points[0, order]).max() < _JOINED * cell:
            return order
    return None


def _cells(points: np.ndarray, joint: np.ndarray | None) -> tuple[np.ndarray, np.ndarray]:
    """Return the numbers of the vertices at the beginning and at the end of each cell along the strip."""
    numbers = np.arange(points.shape[0] * points.shape[1]).reshape(points.shape[:2])
    if joint is None:
        return numbers[:-1], numbers[1:]
    return numbers[:-1], np.concatenate([numbers[1:-1], numbers[:1, joint]])


def _mesh(points: np.ndarray, joint: np.ndarray | None, quads: np.ndarray) -> Mesh:
    """Return the mesh of sections (K, size, 3), without the last one where it is joined to the first one."""
    kept = points if joint is None else points[:-1]
    return Mesh(kept.reshape(-1, 3), quads, np.repeat(np.arange(len(kept)), kept.shape[1]))
