"""Strips of segments, on each of which the strains are constant; closed ones: energy, closure and their exact derivatives.

The loop is cut into N segments of length h. On each the frame turns about a fixed axis and the centreline is an arc of a helix,
both in closed form. Closure is six conditions: the frame and the centreline are periodic. So every closed strip of this kind
is a state of the continuous strip, and its energy, the mean of U(omega), exceeds the minimum over all by O(h**2). For the laws
with omega_2 = 0 the unknowns are omega_1 and omega_3.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TypeVar

import numpy as np

from contin.lowlevel import Shown, levels
from ribbon_model.equilibrium import LENGTH
from ribbon_model.law import Law
from ribbon_model.second_variation import Equilibrium, cross_matrix
from ribbon_model.shape import Shape

C = TypeVar("C")

#: A violation of the conditions of a chain from which no Newton step leads back.
_FAR = 1.0
# in powers of z = p**2: sin(p)/p, f = (1 - cos p)/p**2, 2 f', 4 f'', g = (p - sin p)/p**3, 2 g', 4 g''; exact for |p| < pi
_SERIES = np.array([[(-1) ** k / math.factorial(2 * k + i) for k in range(15)] for i in (1, 2, 3)])
_BY_Z = np.diag(np.arange(1.0, 15), -1)  # a row of coefficients times this gives those of the derivative
_SERIES = np.array(
    [row @ np.linalg.matrix_power(2 * _BY_Z, order) for row, orders in zip(_SERIES, (1, 3, 3)) for order in range(orders)]
).T
#: Cross matrices of the axes.
_GENERATORS = np.array([cross_matrix(axis) for axis in np.eye(3)])


# --- rotations ---------------------------------------------------------------------------------------------------------


def _turn(a):
    """Return, for rotation vectors (K, 3), the series (7, K), cross matrix, its square, rotation and its mean; (K, 3, 3)."""
    series = (np.vander(np.sum(a * a, axis=1), 15, increasing=True) @ _SERIES).T
    sine, f, _, _, g = series[:5, :, None, None]
    cross = np.einsum("kb,bij->kij", a, _GENERATORS)
    square = cross @ cross
    return series, cross, square, np.eye(3) + sine * cross + f * square, np.eye(3) + f * cross + g * square


# --- segments in a row --------------------------------------------------------------------------------------------------


class Chain:
    """Segments of constant strain, one after the other, from the origin: frames, centreline and their derivatives.

    Attributes
    ----------
    strains : ndarray, shape (N, 3)
        Components of omega on the directors, segment by segment.
    first : ndarray, shape (3, 3)
        The first frame; columns are directors.
    """

    strains: np.ndarray
    first: np.ndarray

    @property
    def segment(self) -> float:
        """Length of a segment."""
        raise NotImplementedError

    @property
    def asked(self) -> int:
        """The number of segments that was asked for."""
        return len(self.strains)

    @cached_property
    def _local(self):
        """a = h omega, and `_turn` of it."""
        a = self.segment * self.strains
        return a, *_turn(a)

    @cached_property
    def axes(self) -> np.ndarray:
        """Directors at the ends of the segments, shape (N + 1, 3, 3); columns are d1, d2, d3."""
        product = self._local[4]
        reach = 1
        while reach < len(product):  # products of 2, 4, 8 ... neighbours
            product = np.concatenate([product[:reach], product[:-reach] @ product[reach:]])
            reach *= 2
        return self.first @ np.concatenate([np.eye(3)[None], product])

    @cached_property
    def centreline(self) -> np.ndarray:
        """x at the ends of the segments, shape (N + 1, 3)."""
        steps = self.segment * np.einsum("kij,kj->ki", self.axes[:-1], self._local[5][:, :, 2])
        return np.concatenate([np.zeros((1, 3)), np.cumsum(steps, axis=0)])

    @cached_property
    def turning(self) -> np.ndarray:
        """Rotation vectors (N, 3, 3), component by column, by which a unit of each strain rotates all later segments."""
        return self.segment * self.axes[:-1] @ self._local[5]

    @cached_property
    def _slopes(self):
        """dV/da_b, shape (N, b, 3, 3), and d2(V e3)/da_a da_b, shape (N, a, b, 3)."""
        a, series, cross, square, _, _ = self._local
        f, f1, f2, g, g1, g2 = series[1:, :, None, None]
        both = _GENERATORS @ cross[:, None] + cross[:, None] @ _GENERATORS
        along = a[:, :, None, None]
        first = along * (f1 * cross + g1 * square)[:, None] + f[..., None] * _GENERATORS + g[..., None] * both
        outer = a[:, :, None] * a[:, None, :]
        scale = [(s1 * np.eye(3) + s2 * outer)[..., None] for s1, s2 in ((f1, f2), (g1, g2))]
        second = scale[0] * cross[:, None, None, :, 2] + scale[1] * square[:, None, None, :, 2]
        for slope, part in ((f1, np.broadcast_to(_GENERATORS[:, :, 2], (len(a), 3, 3))), (g1, both[..., 2])):
            term = slope[..., None] * a[:, :, None, None] * part[:, None]
            second = second + term + term.transpose(0, 2, 1, 3)
        pairs = (_GENERATORS[:, None] @ _GENERATORS + _GENERATORS @ _GENERATORS[:, None])[..., 2]
        return first, second + g[..., None] * pairs

    @cached_property
    def own(self) -> np.ndarray:
        """Change of a segment's own step by a unit of each strain, shape (N, 3, 3), component by column."""
        return self.segment**2 * np.einsum("kij,kbj->kib", self.axes[:-1], self._slopes[0][..., 2])

    def levers(self, rotation, forces) -> tuple[np.ndarray, ...]:
        """Return what forces (N, 3) at the ends of segments, and a moment at the last one, do to a segment and what follows.

        Returns
        -------
        lever : ndarray, shape (N, 3, 3)
            Component by column: its product with a rotation before the segment is a second derivative of the work.
        force, moment : ndarray, shape (N, 3)
            Sums of the forces at the segment's end and behind, and of their moments about its end.
        spread : ndarray, shape (N, 3, 3)
            The sums of arm force^T, less their traces.
        """
        x = self.centreline[1:]
        force = np.cumsum(forces[::-1], axis=0)[::-1]
        moment = np.cumsum(np.cross(x, forces)[::-1], axis=0)[::-1] - np.cross(x, force)
        spread = np.cumsum((x[:, :, None] * forces[:, None, :])[::-1], axis=0)[::-1] - x[:, :, None] * force[:, None, :]
        spread = spread - np.trace(spread, axis1=1, axis2=2)[:, None, None] * np.eye(3)
        lever = np.cross(self.own, force[:, :, None], axis=1) + spread @ self.turning
        return lever - cross_matrix(rotation) @ self.turning / 2, force, moment, spread

    def curvature(self, rotation, forces) -> np.ndarray:
        """Return the second derivatives by the strains, shape (N, 3, N, 3), of the sum of forces . x at the ends of segments.

        And of rotation . rotation vector, by which the last frame turns from where it is.
        """
        turning, count = self.turning, len(self.turning)
        lever, force, moment, spread = self.levers(rotation, forces)
        # a segment rotates all later ones: its rotation vector times the effect of a later one
        later = np.triu(np.ones((count, count)), 1)[:, None, :, None]
        result = np.einsum("kia,lib->kalb", turning, lever, optimize=True) * later
        result += result.transpose(2, 3, 0, 1)
        first, second = self._slopes
        turned = self.segment**2 * np.einsum("kij,kbja->kiab", self.axes[:-1], first)
        pair = np.cross(turning[:, :, :, None], turning[:, :, None, :], axis=1)  # v_a x v_b
        step = self.segment**3 * np.einsum("kij,kabj->kiab", self.axes[:-1], second)
        local = np.einsum("ki,kiab->kab", force, step) + np.einsum("ki,kiab->kab", moment, turned)
        local += np.einsum("kia,kij,kjb->kab", turning, spread, turning) + np.einsum("i,kiab->kab", rotation, turned + pair / 2)
        result[np.arange(count), :, np.arange(count)] += local
        return result


# --- the discrete strip -------------------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False, repr=False)
class Strip(Chain, Shown):
    """A strip of segments of constant strain; B = 1, L = 2 pi. The directors at S = 0 are the lab axes, x(0) is the origin.

    Attributes
    ----------
    law : Law
    parameters : mapping of str to float, or float
        The law's, by name; a number is the first one.
    kappa_n : float
    strains : ndarray, shape (N, 3)
        Components of omega on the directors, segment by segment.
    """

    law: Law
    parameters: float | Mapping[str, float]
    kappa_n: float
    strains: np.ndarray

    @property
    def first(self) -> np.ndarray:
        """The first frame: the lab axes."""
        return np.eye(3)

    @property
    def segment(self) -> float:
        return LENGTH / len(self.strains)

    @property
    def free(self) -> list[int]:
        """The components of the strains that may change."""
        return self.law.free

    @property
    def size(self) -> int:
        """n, the number of strains that may change."""
        return len(self.strains) * len(self.free)

    @property
    def material(self) -> str:
        """The name of the law."""
        return self.law.name

    @cached_property
    def density(self):
        """U, moment and stiffness on the segments: `Law.strain_energy`."""
        return self.law.strain_energy(self.strains, *self._material)

    @property
    def _material(self) -> tuple[float, ...]:
        """kappa_n and the law's parameters."""
        return self.kappa_n, *self.law.values(self.parameters).values()

    @cached_property
    def energy(self) -> float:
        """Mean of U, without the constant kappa_n**2/2."""
        return float(np.mean(self.density[0]))

    @cached_property
    def kappa_star(self) -> float:
        """-dE/dkappa_n, the conjugate curvature (28), with U as in `Law.strain_energy`."""
        return float(np.mean(self.law.conjugate(self.strains, *self._material)))

    @property
    def slack(self) -> int:
        """Segments on which U is not strictly convex (ribbon: c <= nu kappa_n)."""
        return int(np.sum(np.any(np.diagonal(self.density[2], axis1=1, axis2=2)[:, self.free] == 0, axis=1)))

    @cached_property
    def closure(self) -> np.ndarray:
        """Rotation vector of the last frame, and the last x: shape (6,), zero on a closed strip."""
        last = self.axes[-1]
        vector = np.array([last[2, 1] - last[1, 2], last[0, 2] - last[2, 0], last[1, 0] - last[0, 1]]) / 2
        sine = np.linalg.norm(vector)
        angle = math.atan2(sine, (np.trace(last) - 1) / 2)
        return np.concatenate([vector * (angle / sine if sine > 0 else 1.0), self.centreline[-1]])

    @cached_property
    def closure_slopes(self) -> np.ndarray:
        """Derivatives of `closure` by the strains, shape (6, N, 3); those of the rotation are exact on closed strips."""
        turning = self.turning
        arm = self.centreline[-1] - self.centreline[1:]
        shift = self.own + np.cross(turning, arm[:, :, None], axis=1)
        return np.concatenate([turning, shift], axis=1).transpose(1, 0, 2)

    def closure_curvature(self, multipliers) -> np.ndarray:
        """Return the second derivatives of multipliers . closure by the strains on a closed strip, shape (N, 3, N, 3)."""
        rotation, position = np.split(np.asarray(multipliers), 2)
        forces = np.zeros((len(self.strains), 3))
        forces[-1] = position
        return self.curvature(rotation, forces)

    def linearized(self):
        """Return moments (n,), slopes of closure (6, n) and Hessian of the Lagrangian (n, n) by the free strains, times N.

        The multipliers minimize the gradient.
        """
        free, count = self.free, len(self.strains)
        _, moment, stiffness = self.density
        gradient = moment[:, free].ravel()
        slopes = self.closure_slopes[:, :, free].reshape(6, -1)
        multipliers = -np.linalg.lstsq(slopes.T, gradient, rcond=None)[0]
        hessian = self.closure_curvature(multipliers)[:, free][:, :, :, free]
        hessian[np.arange(count), :, np.arange(count)] += stiffness[:, free][:, :, free]
        return gradient, slopes, hessian.reshape(len(gradient), -1), multipliers

    def moved(self, change) -> Strip:
        """Return the strip with the free strains changed by (n,), closed again by the smallest further change.

        Raises
        ------
        ValueError
            It cannot be closed.
        """

        def slopes(strip: Strip) -> np.ndarray:
            return strip.closure_slopes[:, :, strip.free].reshape(6, -1)

        failed = "the strip cannot be closed by a small change of its strains"
        return moved(self, change, lambda strip: strip.closure, slopes, failed)

    def along(self, stations) -> tuple[np.ndarray, np.ndarray]:
        """Return the directors (K, 3, 3), as columns, and centreline (K, 3) at places S in [0, L]."""
        number = np.minimum((np.asarray(stations) / self.segment).astype(int), len(self.strains) - 1)
        part = np.asarray(stations) - number * self.segment
        first, (*_, turn, mean) = self.axes[number], _turn(part[:, None] * self.strains[number])
        x = self.centreline[number] + part[:, None] * np.einsum("kij,kj->ki", first, mean[:, :, 2])
        return first @ turn, x

    def shape(self, places: int = 401) -> Shape:
        """Return the strip in space at ``places`` equally spaced S, with eta (0 for rods) interpolated between segments."""
        stations = np.linspace(0, LENGTH, places)
        axes, x = self.along(stations)
        eta = np.zeros(places)
        if self.law.has_rulings:
            middle = (np.arange(len(self.strains)) + 0.5) * self.segment
            eta = np.interp(stations, middle, self.strains[:, 2] / self.strains[:, 0], period=LENGTH)
        return Shape(stations, x, axes.transpose(0, 2, 1), eta)

    def _changed(self, change) -> Strip:
        strains = self.strains.copy()
        strains[:, self.free] += np.reshape(change, (len(strains), -1))
        return replace(self, strains=strains)


def moved(chain: C, change, missed: Callable[[C], np.ndarray], slopes: Callable[[C], np.ndarray], failed: str) -> C:
    """Return a chain with its unknowns changed by (n,), and then by the least that meets conditions again.

    ``missed`` are the values (c,) of the conditions, which vanish where they are met, ``slopes`` their derivatives (c, n).
    Raises ValueError where they cannot be met nearby: ``failed``.
    """
    chain = chain._changed(change)
    for _ in range(levels.MOST_UPDATES):
        violation = np.abs(missed(chain)).max(initial=0.0)
        if violation < levels.CORRECTED:
            return chain
        if not violation < _FAR:
            break
        chain = chain._changed(-np.linalg.lstsq(slopes(chain), missed(chain), rcond=None)[0])
    raise ValueError(failed)


def discretized(equilibrium: Equilibrium, segments: int) -> Strip:
    """Return the closed strip with the strains of an equilibrium amid its segments; raise ValueError if these are too few."""
    directors = equilibrium.directors((np.arange(segments) + 0.5) * (LENGTH / segments))
    edges = np.cumsum(directors[:, 2], axis=0) * (LENGTH / segments)
    moment = equilibrium.moment - np.cross(edges - directors[:, 2] * (LENGTH / segments / 2), equilibrium.force)
    strains = equilibrium.response(np.einsum("kij,kj->ki", directors, moment))[0]
    strip = Strip(equilibrium.law, equilibrium.parameters, equilibrium.kappa_n, strains)
    return strip.moved(np.zeros(segments * len(strip.free)))
