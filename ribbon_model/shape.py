"""The strip in space: centreline, directors and surface; images of a part of it under mirrors, axes and rotations."""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass

import numpy as np

from contin.lowlevel import Shown, basis, interpolation
from ribbon_model.equilibrium import directors


@dataclass(frozen=True, eq=False, repr=False)
class Shape(Shown):
    """A strip in space, or a part of it.

    Attributes
    ----------
    arclength : ndarray, shape (K,)
    centreline : ndarray, shape (K, 3)
    directors : ndarray, shape (K, 3, 3)
        Rows d1, d2, d3.
    eta : ndarray, shape (K,)
        omega_3 / omega_1.
    breadth, depth : float or ndarray, shape (K,)
        Width and thickness along the strip, over the ones that are asked for.
    """

    arclength: np.ndarray
    centreline: np.ndarray
    directors: np.ndarray
    eta: np.ndarray
    breadth: float | np.ndarray = 1.0
    depth: float | np.ndarray = 1.0

    def closure(self) -> float:
        """Return the largest difference between the two ends, in position and directors."""
        gap = np.abs(self.centreline[-1] - self.centreline[0]).max()
        return float(max(gap, np.abs(self.directors[-1] - self.directors[0]).max()))

    def surface(self, width: float, across: int = 2) -> np.ndarray:
        """Points of the strip, shape (K, across, 3), ruled along d1 + eta d3 (equation (6a)) up to half the width."""
        return self.centreline[:, None] + np.linspace(-0.5, 0.5, across)[:, None] * width * self.rulings()[:, None]

    def rulings(self) -> np.ndarray:
        """Return d1 + eta d3 times the breadth, shape (K, 3): the surface is ruled along it, from -1/2 to 1/2 of the width."""
        return np.reshape(self.breadth, (-1, 1)) * (self.directors[:, 0] + self.eta[:, None] * self.directors[:, 2])

    def upright(self) -> np.ndarray:
        """Return the rotation, shape (3, 3), from the lab axes to axes on which the strip stands upright and looks to one side.

        Its rows are the new axes on the lab axes. The third is that of the area that the centreline encloses: on branches from
        a circle it is the direction of the moment. The second is d3 at the beginning, as far as it is perpendicular to that.
        """
        up = np.cross(self.centreline - self.centreline.mean(axis=0), self.directors[:, 2]).sum(axis=0)
        up = up / np.linalg.norm(up) if np.linalg.norm(up) > 1e-9 else np.array([0.0, 0.0, 1.0])
        side = self.directors[0, 2] - self.directors[0, 2] @ up * up
        side /= np.linalg.norm(side)
        return np.array([np.cross(side, up), side, up])

    def placed(self, length: float) -> Shape:
        """Return the closed strip scaled to a length, upright, with the middle of its centreline at the origin."""
        axes, scale = self.upright(), length / (self.arclength[-1] - self.arclength[0])
        x = (self.centreline - self.centreline.mean(axis=0)) @ axes.T * scale
        return Shape(self.arclength * scale, x, self.directors @ axes.T, self.eta)

    def turned(self) -> Shape:
        """Return the part and its image under the two-fold axis along d2 at its end."""
        axis, centre = self.directors[-1, 1], self.centreline[-1]
        turn = 2 * np.outer(axis, axis) - np.eye(3)
        x = (self.centreline[-2::-1] - centre) @ turn + centre
        d = self.directors[-2::-1] @ turn * np.array([-1.0, 1.0, -1.0])[:, None]
        return self._joined(Shape(2 * self.arclength[-1] - self.arclength[-2::-1], x, d, self.eta[-2::-1]))

    def mirrored(self) -> Shape:
        """Return both sides of the mirror normal to d3 at S = 0, starting at the far end."""
        normal = self.directors[0, 2]
        mirror = np.eye(3) - 2 * np.outer(normal, normal)
        x = self.centreline[:0:-1] @ mirror
        d = self.directors[:0:-1] @ mirror * np.array([1.0, 1.0, -1.0])[:, None]
        whole = Shape(-self.arclength[:0:-1], x, d, -self.eta[:0:-1])._joined(self)
        return Shape(whole.arclength - whole.arclength[0], whole.centreline, whole.directors, whole.eta)

    def repeated(self, copies: int, axis, centre, angle: float) -> Shape:
        """Return copies one after the other, each rotated by ``angle`` about the unit vector ``axis`` (3,) at ``centre``."""
        cross = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
        result = self
        for copy in range(1, copies):
            a = copy * angle
            rotation = math.cos(a) * np.eye(3) + math.sin(a) * cross + (1 - math.cos(a)) * np.outer(axis, axis)
            x = (self.centreline - centre) @ rotation.T + centre
            s = self.arclength + copy * self.arclength[-1]
            result = result._joined(Shape(s[1:], x[1:], (self.directors @ rotation.T)[1:], self.eta[1:]))
        return result

    def _joined(self, other: Shape) -> Shape:
        pairs = ((getattr(self, name), getattr(other, name)) for name in ("arclength", "centreline", "directors", "eta"))
        return Shape(*map(np.concatenate, pairs))


#: What takes the products q_i q_j (16,) to the nine components of the directors: quadratic forms of q, by polarization.
_SUMS, _OTHERS = (directors(*(np.repeat(np.eye(4), 4, axis=1) + sign * np.tile(np.eye(4), 4))) for sign in (1, -1))
_DIRECTORS = np.subtract(_SUMS, _OTHERS).T / 4


def frames(states) -> np.ndarray:
    """Return the directors (K, 3, 3), rows d1, d2, d3 on the lab axes, from states (K, >= 4) that begin with the quaternion.

    Examples
    --------
    >>> frames(np.array([[1.0, 0.0, 0.0, 0.0]]))[0].tolist()
    [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
    """
    q = np.asarray(states)[:, :4]
    products = (q[:, :, None] * q[:, None]).reshape(-1, 16)
    return (products @ _DIRECTORS).reshape(-1, 3, 3) / products[:, ::5].sum(axis=1)[:, None, None]


def quaternions(directors) -> np.ndarray:
    """Return unit quaternions (K, 4), continuous along the strip and first with q0 >= 0, of directors (K, 3, 3) with rows d_i.

    ``scipy.spatial.transform.Rotation`` gives the same quaternions except for rounding: 22 % of the 82,308 components of 65
    strips of the tests differ, by up to 2.2e-16, and its import takes 80 ms. Results are kept to the last bit, so this stays.

    Examples
    --------
    >>> quaternions(frames(np.array([[0.6, 0.8, 0.0, 0.0]]))).round(12).tolist()
    [[0.6, 0.8, 0.0, 0.0]]
    """
    d = np.asarray(directors)
    trace, diagonal = np.trace(d, axis1=1, axis2=2)[:, None], np.diagonal(d, axis1=1, axis2=2)
    squares = np.hstack([1 + trace, 1 + 2 * diagonal - trace])
    outer = np.empty((len(d), 4, 4))  # 4 q q^T: each row is a multiple of q
    outer[:, 0, 1:] = outer[:, 1:, 0] = d[:, [1, 2, 0], [2, 0, 1]] - d[:, [2, 0, 1], [1, 2, 0]]
    outer[:, 1:, 1:] = d + d.transpose(0, 2, 1)
    outer[:, range(4), range(4)] = squares
    q = outer[np.arange(len(d)), np.argmax(squares, axis=1)]  # the largest square of a component is never below 1/4
    q /= np.sqrt(np.vecdot(q, q))[:, None]
    flipped = np.append(q[0, 0] < 0, np.vecdot(q[1:], q[:-1]) < 0)
    return q * np.cumprod(np.where(flipped, -1.0, 1.0))[:, None]


@functools.cache  # it takes as long as the rest of `quadrature_centreline`
def _integrals(degree: int) -> np.ndarray:
    """Return the matrix that integrates values at the Gauss points from 0 to each further node."""
    tables = basis(degree)
    return tables.integrals(tables.nodes[1:])


def quadrature_centreline(t, states, degree: int, length: float) -> np.ndarray:
    """Return x at the nodes, shape (K, 3), x(0) = 0: the integral of d3, by the Gauss points of each interval."""
    tables = basis(degree)
    h = np.diff(t[::degree])
    nodal = np.stack([states[i : i + (len(h) - 1) * degree + 1 : degree, :4] for i in range(degree + 1)], axis=1)
    at_gauss = np.einsum("ij,ejk->eik", tables.value, nodal)
    d3 = np.array(directors(*np.moveaxis(at_gauss, -1, 0))[6:]).transpose(1, 2, 0)
    inside = length * h[:, None, None] * np.einsum("ij,ejk->eik", _integrals(degree), d3)
    inside[1:] += np.cumsum(inside[:, -1], axis=0)[:-1, None]
    return np.concatenate([np.zeros((1, 3)), inside.reshape(-1, 3)])


def interpolated(nodes: np.ndarray, values: np.ndarray, degree: int, t: np.ndarray) -> np.ndarray:
    """Return the values (L, n) at places t (L,) of the piecewise polynomials with values (K, n) at the nodes (K,)."""
    tables, mesh = basis(degree), nodes[::degree]
    j = np.clip(np.searchsorted(mesh, t, side="right") - 1, 0, len(mesh) - 2)
    matrix = interpolation(tables.nodes, tables.barycentric, (t - mesh[j]) / (mesh[j + 1] - mesh[j]))
    return np.einsum("ij,ijk->ik", matrix, values[degree * j[:, None] + np.arange(degree + 1)])


def shape_of(t: np.ndarray, states: np.ndarray, omega: np.ndarray) -> Shape:
    """Return the shape of states (K, >= 7) with strains (K, 3) at places t (K,)."""
    eta = np.divide(omega[:, 2], omega[:, 0], out=np.zeros(len(t)), where=omega[:, 0] != 0)
    return Shape(np.asarray(t), states[:, 4:7], frames(states), eta)
