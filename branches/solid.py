"""The strip as a mesh of quadrilaterals: its middle surface, or a closed solid of given thickness."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ribbon_model.shape import Shape

#: Cells across the width. The surface is ruled, so more cells do not improve it; ten times more make files ten times
#: larger. A single one gives cells that are fifty times longer than wide, which viewers shade badly.
_ACROSS = 8


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
        """Return the mesh as triangles, two for each quadrilateral, shape (2 Q, 3)."""
        return np.concatenate([self.quads[:, [0, 1, 2]], self.quads[:, [0, 2, 3]]])


def widest(shape: Shape) -> float:
    """Return the width at which neighbouring generators of the surface begin to cross; inf if they never do.

    At a distance v along d1 from the centreline, the surface is 1 + v (eta' - omega_2 (1 + eta^2)) times as long as there; it
    vanishes first at half the width. omega_2 is zero for strips that do not bend in their own plane.
    """
    step, d1, d3 = np.diff(shape.arclength), shape.directors[:, 0], shape.directors[:, 2]
    sideways = np.vecdot(np.diff(d1, axis=0), (d3[1:] + d3[:-1]) / 2) / step  # -omega_2
    eta = (shape.eta[1:] + shape.eta[:-1]) / 2
    slope = np.abs(np.diff(shape.eta) / step + sideways * (1 + eta**2)).max()
    return float(2 / slope) if slope > 1e-12 else np.inf


def thickest(shape: Shape, width: float) -> float:
    """Return the thickness at which the inner side becomes a point where the surface is bent most strongly.

    It is 2 over the largest curvature of the surface. Across a generator that is omega_1 (1 + eta^2)/(1 + v eta') at a distance
    v along d1 from the centreline; between nodes, omega_1 is the angle between neighbouring d2.
    """
    step = np.diff(shape.arclength)
    bend = 2 * np.arcsin(np.clip(np.linalg.norm(np.diff(shape.directors[:, 1], axis=0), axis=1) / 2, 0, 1)) / step
    eta = (shape.eta[1:] + shape.eta[:-1]) / 2
    room = 1 - width / 2 * np.abs(np.diff(shape.eta) / step)
    curvature = (bend * np.sqrt(1 + eta**2) / room).max()  # |d d2/ds| is omega_1 sqrt(1 + eta^2)
    return float(2 / curvature) if curvature > 0 else np.inf


def surface(shape: Shape, width: float) -> Mesh:
    """Return the middle surface of a closed strip."""
    points = shape.surface(width, _ACROSS + 1)[:-1]
    here, beyond = _rings(*points.shape[:2])
    quads = np.stack([here[:, :-1], beyond[:, :-1], beyond[:, 1:], here[:, 1:]], axis=-1)
    return Mesh(points.reshape(-1, 3), quads.reshape(-1, 4), np.repeat(np.arange(len(points)), _ACROSS + 1))


def solid(shape: Shape, width: float, thickness: float) -> Mesh:
    """Return a closed strip as a closed solid; its volume is length * width * thickness, except for the discretization.

    d2 is the normal of the surface along a whole generator, so both faces are the middle surface moved along d2::

            top       <--------------        d2
                     |              ^        ^
            bottom   v------------->         d3 --> d1      (d3 towards the reader; the order of a ring's vertices)
    """
    middle, normal = shape.surface(width, _ACROSS + 1)[:-1], shape.directors[:-1, None, 1]
    points = np.concatenate([middle - thickness / 2 * normal, (middle + thickness / 2 * normal)[:, ::-1]], axis=1)
    here, beyond = _rings(*points.shape[:2])
    following = [np.roll(ring, -1, axis=1) for ring in (here, beyond)]
    quads = np.stack([here, following[0], following[1], beyond], axis=-1)
    return Mesh(points.reshape(-1, 3), quads.reshape(-1, 4), np.repeat(np.arange(len(points)), points.shape[1]))


def _rings(count: int, size: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the numbers of the vertices at each node and at the next one (cyclic). Shapes (count, size)."""
    here = np.arange(count * size).reshape(count, size)
    return here, np.roll(here, -1, axis=0)
