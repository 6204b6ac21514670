"""The closed strip in space: centreline, directors and surface, from the solution on a domain.

The cell carries a mirror at S = 0 (plane through x(0), normal to d3) and a two-fold axis along d2 at its other end; the half
loop carries mirrors at both ends, or two-fold axes along d2. These symmetries unfold a solution to the whole loop; where
the plane and the axis (or the planes) meet, the copies turn about one line, so the centreline closes.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from contin import basis, interpolation
from ribbon_model.equilibrium import LENGTH, directors, on_directors
from ribbon_model.laws import Law


@dataclass(frozen=True)
class Shape:
    """A closed strip: arc length (K,), centreline (K, 3), directors (K, 3, 3) with rows d1, d2, d3, ratio eta (K,)."""

    arclength: np.ndarray
    centreline: np.ndarray
    directors: np.ndarray
    eta: np.ndarray

    def closure(self) -> float:
        """The largest difference between the two ends, in position and directors."""
        gap = np.abs(self.centreline[-1] - self.centreline[0]).max()
        return float(max(gap, np.abs(self.directors[-1] - self.directors[0]).max()))

    def surface(self, width: float, across: int = 2) -> np.ndarray:
        """Points of the strip, shape (K, across, 3), ruled along d1 + eta d3 (equation (6a)) up to half the width."""
        ruling = self.directors[:, 0] + self.eta[:, None] * self.directors[:, 2]
        return self.centreline[:, None] + np.linspace(-0.5, 0.5, across)[:, None] * width * ruling[:, None]


def frames(states) -> np.ndarray:
    """Directors (K, 3, 3), rows d1, d2, d3 on the lab axes, from states (K, >= 4) that begin with the quaternion."""
    q = np.asarray(states)[:, :4].T
    return np.array(directors(*q)).T.reshape(-1, 3, 3) / np.sum(q * q, axis=0)[:, None, None]


def quaternions(directors) -> np.ndarray:
    """Return unit quaternions (K, 4), continuous along the strip and first with q0 >= 0, of directors (K, 3, 3) with rows d_i.

    ``scipy.spatial.transform.Rotation`` gives the same quaternions except for rounding: 22 % of the 82,308 components of 65
    strips of the tests differ, by up to 2.2e-16, and its import takes 80 ms. Results are kept to the last bit, so this stays.
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


def quadrature_centreline(t, states, degree: int, length: float) -> np.ndarray:
    """x at the nodes, shape (K, 3), x(0) = 0: the integral of d3, by the Gauss points of each interval."""
    tables = basis(degree)
    h = np.diff(t[::degree])
    nodal = np.stack([states[i : i + (len(h) - 1) * degree + 1 : degree, :4] for i in range(degree + 1)], axis=1)
    at_gauss = np.einsum("ij,ejk->eik", tables.value, nodal)
    d3 = np.array(directors(*np.moveaxis(at_gauss, -1, 0))[6:]).transpose(1, 2, 0)
    lagrange = 1 / np.prod(tables.points[:, None] - tables.points + np.eye(degree), axis=1)
    partial = np.array([
        node * tables.weights @ interpolation(tables.points, lagrange, node * tables.points) for node in tables.nodes[1:]
    ])  # fmt: skip
    inside = length * h[:, None, None] * np.einsum("ij,ejk->eik", partial, d3)
    inside[1:] += np.cumsum(inside[:, -1], axis=0)[:-1, None]
    return np.concatenate([np.zeros((1, 3)), inside.reshape(-1, 3)])


def invariants(law: Law, t, states, degree: int, parameters: Mapping[str, float]) -> dict[str, np.ndarray]:
    """What equilibrium keeps constant, at the nodes: ``norm`` |q|^2 and ``hamiltonian`` H(M) + R3, shape (K,) each."""
    moment, force = _loads(states, parameters)
    material = parameters["kappa_n"], *(parameters[name] for name in law.parameters)
    values = [law.response(*m, *material)[0] for m in moment]
    return {"norm": np.sum(states[:, :4] ** 2, axis=1), "hamiltonian": np.array(values) + force[:, 2]}


def _loads(states, p):
    """Body components of M and R at the nodes, shapes (K, 3)."""
    force = np.array([p.get(name, 0.0) for name in ("R1", "R2", "R3")])
    moment = np.array([p["M1"], p["M2"], p.get("M3", 0.0)])
    if states.shape[1] > 4:
        moment = moment - np.cross(states[:, 4:7], force)
    q = states[:, :4].T
    moment = np.broadcast_to(moment, (len(states), 3)).T
    return np.array(on_directors(*q, *moment)).T, np.array(on_directors(*q, *force)).T


def closed_strip(law: Law, t, states, degree: int, parameters: Mapping[str, float]) -> Shape:
    """The whole loop from the solution on the domain that it was computed on.

    Parameters
    ----------
    t : ndarray, shape (K,)
        Nodes on the unit interval.
    states : ndarray, shape (K, 4) or (K, 7)
        Quaternion, and centreline where it is a state.
    degree : int
        Degree of the collocation.
    parameters : mapping
        All parameters of the problem.
    """
    p = parameters
    length = p["length"]
    d = frames(states)
    x = states[:, 4:7] if states.shape[1] > 4 else quadrature_centreline(t, states, degree, length)
    moment, _ = _loads(states, p)
    material = p["kappa_n"], *(p[name] for name in law.parameters)
    omega = np.array([law.response(*m, *material)[1:4] for m in moment])
    eta = omega[:, 2] / omega[:, 0]
    s = length * np.asarray(t)
    part = Shape(s, x, d, eta)
    if math.isclose(length, LENGTH):
        return part
    if "axes" in p:  # half loop between two-fold axes, which are one line
        return _turned(part)
    if "turn" not in p:  # half loop: one mirror does it
        return _mirrored(part)
    periods = round(LENGTH / (4 * length))
    wave = _mirrored(_turned(part))
    axis = p["sense"] * np.array([p["M1"], p["M2"], 0.0])
    axis /= np.linalg.norm(axis)
    angle = 4 * p["turn"]
    centre = _centre(d[-1, 1], x[-1], axis, d[0, 2]) if abs(math.sin(angle / 2)) > 1e-9 else np.zeros(3)
    return _repeated(wave, periods, axis, centre, angle)


def _turned(part: Shape) -> Shape:
    """A part (a quarter wave, a half loop) and its image under the two-fold axis along d2 at its end."""
    axis, centre = part.directors[-1, 1], part.centreline[-1]
    turn = 2 * np.outer(axis, axis) - np.eye(3)
    x = (part.centreline[-2::-1] - centre) @ turn + centre
    d = part.directors[-2::-1] @ turn * np.array([-1.0, 1.0, -1.0])[:, None]
    s = 2 * part.arclength[-1] - part.arclength[-2::-1]
    return _joined(part, Shape(s, x, d, part.eta[-2::-1]))


def _mirrored(half: Shape) -> Shape:
    """Both sides of the mirror at S = 0, starting at the far end."""
    normal = half.directors[0, 2]
    mirror = np.eye(3) - 2 * np.outer(normal, normal)
    x = half.centreline[:0:-1] @ mirror
    d = half.directors[:0:-1] @ mirror * np.array([1.0, 1.0, -1.0])[:, None]
    whole = _joined(Shape(-half.arclength[:0:-1], x, d, -half.eta[:0:-1]), half)
    return Shape(whole.arclength - whole.arclength[0], whole.centreline, whole.directors, whole.eta)


def _joined(a: Shape, b: Shape) -> Shape:
    return Shape(*(np.concatenate([getattr(a, f), getattr(b, f)]) for f in ("arclength", "centreline", "directors", "eta")))


def _centre(d2, x, axis, d3_start):
    """Where the two-fold axis (through x along d2) meets the mirror plane (through the origin, normal to d3_start)."""
    return x - d2 * (x @ d3_start) / (d2 @ d3_start)


def _repeated(wave: Shape, periods: int, axis, centre, angle) -> Shape:
    """``periods`` copies of a wave, each turned by ``angle`` about the axis through ``centre``."""
    cross = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    result = wave
    for copy in range(1, periods):
        a = copy * angle
        rotation = math.cos(a) * np.eye(3) + math.sin(a) * cross + (1 - math.cos(a)) * np.outer(axis, axis)
        x = (wave.centreline - centre) @ rotation.T + centre
        s = wave.arclength + copy * wave.arclength[-1]
        turned = Shape(s, x, wave.directors @ rotation.T, wave.eta)
        result = _joined(result, Shape(*(getattr(turned, f)[1:] for f in ("arclength", "centreline", "directors", "eta"))))
    return result
