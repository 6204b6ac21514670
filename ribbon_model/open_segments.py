"""An open strip of segments, on each of which the strains are constant: its potential under what is held, and the derivatives.

The conditions at the last end are those of `ribbon_model.ends`, as rotation vector and displacement from what is prescribed; a
hinge turns with the strip, so that it is held about two axes only. At the first end the place is held, and the frame is
clamped, hinged or free: its rotation then is an unknown beside the strains, a segment without length in front of the others.
Loads are those of `ribbon_model.open_strip`; distributed ones act at the ends of the segments.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from types import SimpleNamespace

import numpy as np
from scipy.spatial.transform import Rotation

from contin.lowlevel import Collocation, shown
from ribbon_model import ends
from ribbon_model.ends import ANGLES, CLAMPED, HINGED, JOINT, PLACE
from ribbon_model.loads import FORCES, STROKE
from ribbon_model.open_strip import OpenStrip
from ribbon_model.second_variation import cross_matrix
from ribbon_model.segments import Chain, moved
from ribbon_model.shape import frames


@dataclass(frozen=True, eq=False)
class OpenChain(Chain):
    """An open strip of N segments; length 1.

    Attributes
    ----------
    strip : OpenStrip
    numbers : mapping of str to float
        Values of its parameters.
    strains : ndarray, shape (N, 3)
    first : ndarray, shape (3, 3)
        The first frame; columns are directors.
    """

    strip: OpenStrip
    numbers: Mapping[str, float]
    strains: np.ndarray
    first: np.ndarray

    __repr__ = shown

    @property
    def segment(self) -> float:
        """Length of a segment."""
        return 1 / len(self.strains)

    @property
    def material(self) -> str:
        """The name of the law."""
        return self.strip.section.law.name

    @property
    def free(self) -> list[int]:
        """The components of the strains that may change."""
        rigid = self.strip.section.constrained and not self.numbers.get("softness", 0.0) > 0
        return [0, 2] if rigid else [0, 1, 2]

    @cached_property
    def _turns(self) -> np.ndarray:
        """Axes (3, k) about which the first frame can turn."""
        start = self.strip.start
        if start.rotation == CLAMPED:
            return np.zeros((3, 0))
        return np.array(start.axis)[:, None] if start.rotation == HINGED else np.eye(3)

    @property
    def size(self) -> int:
        """n, the number of unknowns: rotations of the first frame, and strains."""
        return self._turns.shape[1] + len(self.strains) * len(self.free)

    # --- energy -------------------------------------------------------------------------------------------------------

    @cached_property
    def density(self):
        """U, moment and stiffness on the segments; see `Section.strain_energy`."""
        t = (np.arange(len(self.strains)) + 0.5) * self.segment
        return self.strip.section.strain_energy(t, self.strains, SimpleNamespace(**self.numbers))

    @cached_property
    def energy(self) -> float:
        """The potential: of the strains, and of all loads."""
        value = float(np.mean(self.density[0]))
        x, share = self.centreline[1:], self._shares
        value -= self.numbers.get("weight", 0.0) * float(share @ x @ self.strip.weight_direction)
        value += self.numbers.get("foundation", 0.0) / 2 * float(share @ (x @ self.strip.foundation_direction) ** 2)
        value -= float(self._dead_force @ x[-1])
        return value - self.numbers.get("moment", 0.0) * self._reference[1]

    @property
    def _dead_force(self) -> np.ndarray:
        return np.array([self.numbers.get(name, 0.0) for name in FORCES])

    @property
    def _shares(self) -> np.ndarray:
        """Length that belongs to the end of each segment."""
        share = np.full(len(self.strains), self.segment)
        share[-1] /= 2
        return share

    @cached_property
    def _loads(self) -> tuple[np.ndarray, np.ndarray]:
        """Derivatives of the potential of the loads by the last rotation (3,), and by the ends of the segments (N, 3)."""
        across = np.array(self.strip.foundation_direction)
        offset = self._shares * (self.centreline[1:] @ across)
        forces = self.numbers.get("foundation", 0.0) * offset[:, None] * across
        forces = forces - self.numbers.get("weight", 0.0) * self._shares[:, None] * np.array(self.strip.weight_direction)
        forces[-1] -= self._dead_force
        return -self.numbers.get("moment", 0.0) * self._axis, forces

    # --- what is held -------------------------------------------------------------------------------------------------

    @cached_property
    def _prescribed(self) -> tuple[np.ndarray, np.ndarray]:
        """The prescribed frame (columns are directors) and place of the last end."""
        q = ends.prescribed(*(self.numbers.get(name, 0.0) for name in ANGLES))
        place = np.array([self.numbers.get(name, 0.0) for name in PLACE])
        return _matrix(q), place + self.numbers.get(STROKE, 0.0) * np.array(self.strip.stroke_direction)

    @property
    def _axis(self) -> np.ndarray:
        """The axis of a hinge at the last end, on the lab axes."""
        return self._prescribed[0] @ np.array(self.strip.finish.axis)

    @cached_property
    def _reference(self) -> tuple[np.ndarray, float]:
        """The frame from which the last one turns (that of a hinge, turned with it), and the angle of the hinge."""
        frame, angle = self._prescribed[0], 0.0
        if self.strip.finish.rotation == HINGED:
            *vector, scalar = Rotation.from_matrix(frame.T @ self.axes[-1]).as_quat()
            angle = 2 * float(np.arctan2(np.dot(vector, self.strip.finish.axis), scalar))
            frame = Rotation.from_rotvec(angle * self._axis).as_matrix() @ frame
        return frame, angle

    @cached_property
    def _rows(self) -> tuple[np.ndarray, np.ndarray]:
        """Directions in which the last rotation is held, and in which the last place is: rows, on the lab axes."""
        finish = self.strip.finish
        turned = np.eye(3) if finish.rotation == CLAMPED else np.zeros((0, 3))
        if finish.rotation == HINGED:
            turned = np.array(ends.perpendicular(finish.axis)) @ self._prescribed[0].T
        return turned, np.array(finish.held).reshape(-1, 3)

    @cached_property
    def closure(self) -> np.ndarray:
        """What the conditions at the last end are violated by."""
        turned, held = self._rows
        rotation = Rotation.from_matrix(self.axes[-1] @ self._reference[0].T).as_rotvec()
        return np.concatenate([turned @ rotation, held @ (self.centreline[-1] - self._prescribed[1])])

    # --- derivatives --------------------------------------------------------------------------------------------------

    def _by_all(self, of_first, of_strains) -> np.ndarray:
        """Return (..., n) from what belongs to rotations of the first frame (..., 3) and to all strains (..., N, 3)."""
        strains = of_strains[..., self.free]
        return np.concatenate([of_first @ self._turns, strains.reshape(*strains.shape[:-2], -1)], axis=-1)

    def _moves(self, node: int) -> np.ndarray:
        """Return the derivatives (3, n) of the end of a segment."""
        x = self.centreline
        moves = self.own + np.cross(self.turning, (x[node + 1] - x[1:])[:, :, None], axis=1)
        moves[node + 1 :] = 0.0
        return self._by_all(-cross_matrix(x[node + 1]), moves.transpose(1, 0, 2))

    @property
    def held_slopes(self) -> np.ndarray:
        """Derivatives (c, n) of the conditions at the last end, where they are met."""
        turned, held = self._rows
        rotation = self._by_all(np.eye(3), self.turning.transpose(1, 0, 2))
        return np.concatenate([turned @ rotation, held @ self._moves(len(self.strains) - 1)])

    def linearized(self):
        """Return gradient (n,), slopes of the conditions (c, n), Hessian of the Lagrangian (n, n), and multipliers, times N.

        The multipliers minimize the gradient.
        """
        count, (moment, forces) = len(self.strains), self._loads
        _, of_strains, stiffness = self.density
        _, force, torque, _ = self.levers(moment, forces)
        work = np.einsum("ki,kib->kb", force, self.own) + np.einsum("ki,kib->kb", torque + moment, self.turning)
        gradient = self._by_all(count * (np.cross(self.centreline[1:], forces).sum(axis=0) + moment), of_strains + count * work)
        (turned, held), slopes = self._rows, self.held_slopes
        multipliers = -np.linalg.lstsq(slopes.T, gradient, rcond=None)[0] if len(slopes) else np.zeros(0)
        rotation, pulls = count * moment + multipliers[: len(turned)] @ turned, count * forces
        pulls[-1] += multipliers[len(turned) :] @ held
        hessian = self._hessian(rotation, pulls, stiffness)
        stiff = self.numbers.get("foundation", 0.0)
        if stiff:
            across = np.array([self.strip.foundation_direction @ self._moves(node) for node in range(count)])
            hessian += count * stiff * (self._shares[:, None] * across).T @ across
        return gradient, slopes, hessian, multipliers

    def _hessian(self, rotation, pulls, stiffness) -> np.ndarray:
        """Return the second derivatives (n, n) of the energy of the strains (times N) and of the work of these forces."""
        count = len(self.strains)
        whole = self.curvature(rotation, pulls)
        whole[np.arange(count), :, np.arange(count)] += stiffness
        lever, *_ = self.levers(rotation, pulls)
        spread = self.centreline[1:].T @ pulls
        first = (spread + spread.T) / 2 - np.trace(spread) * np.eye(3)
        both = self._by_all(first, lever.transpose(1, 0, 2))  # rows: rotations of the first frame
        turns, free = self._turns, self.free
        inner = whole[:, free][:, :, :, free].reshape(count * len(free), -1)
        cross = (turns.T @ both)[:, turns.shape[1] :]
        return np.block([[turns.T @ first @ turns, cross], [cross.T, inner]])

    # --- other states -------------------------------------------------------------------------------------------------

    def moved(self, change) -> OpenChain:
        """Return the strip with its unknowns changed by (n,), and held again by the smallest further change.

        Raises
        ------
        ValueError
            The conditions cannot be met nearby.
        """
        failed = "the conditions at the end cannot be met by a small change of the strains"
        return moved(self, change, lambda chain: chain.closure, lambda chain: chain.held_slopes, failed)

    def _changed(self, change) -> OpenChain:
        turns, strains = self._turns.shape[1], self.strains.copy()
        strains[:, self.free] += np.reshape(change[turns:], (len(strains), -1))
        first = Rotation.from_rotvec(self._turns @ change[:turns]).as_matrix() @ self.first if turns else self.first
        return replace(self, strains=strains, first=first)


def unsupported(strip: OpenStrip) -> str:
    """Return why there are no chains of segments of a strip, '' if there are."""
    if strip.phases:
        return "a strip with phases"
    if strip.roller is not None:
        return "a strip with a roller"
    if JOINT in (strip.start.rotation, strip.finish.rotation):
        return "a strip with a universal joint"
    return "a strip whose first end can move" if len(strip.start.held) < 3 else ""


def cut(strip: OpenStrip, system: Collocation, x: np.ndarray, segments: int) -> OpenChain:
    """Return the strip of segments that has the strains of a state in the middle of each, held at its ends.

    Raises
    ------
    ValueError
        It cannot be held there: too few segments, or unsupported ends.
    """
    if reason := unsupported(strip):
        raise ValueError(f"{reason} is not cut into segments")
    middle = (np.arange(segments) + 0.5) / segments
    states, p = system.evaluate(x, middle), system.all_parameters(x)
    numbers = dict(zip(strip.problem.parameters, p.tolist()))
    first = np.array(frames(system.states(x)[:1]))[0].T
    chain = OpenChain(strip, numbers, strip.strains_at(middle, states, p), first)
    return chain.moved(np.zeros(chain.size))


def _matrix(q) -> np.ndarray:
    """Return the frame of a quaternion (scalar first); columns are directors."""
    return np.array(ends.directors(*q)).reshape(3, 3).T
