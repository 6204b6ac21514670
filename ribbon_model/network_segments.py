"""A network of segments: strips on whose segments the strains are constant, and that meet at joints, for descents.

Each strip is a chain of segments (`ribbon_model.segments`) with its own first frame and place. The unknowns are a rotation of
the first frame, a displacement of the first place and the strains, strip by strip. Joints and supports are conditions on the
frames and places at the ends. With rotation vectors a, b of two ends, what a joint keeps together changes by

    b - a - a x b/2 + ...

on axes that are fixed on the first end, and a point at an arm o of an end by a x o + a x (a x o)/2: these second derivatives,
times the multipliers, belong to the Hessian, as those of the chains.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from types import SimpleNamespace

import numpy as np
from scipy.spatial.transform import Rotation

from contin.lowlevel import Collocation, Shown
from ribbon_model import ends
from ribbon_model.ends import CLAMPED, FREE, HINGED, JOINT
from ribbon_model.members import BALL, HINGE, RIGID, START, JointEnd
from ribbon_model.network import Network
from ribbon_model.second_variation import cross_matrix
from ribbon_model.segments import Chain, moved
from ribbon_model.shape import frames

#: Fewest segments of a strip.
_FEWEST = 12


@dataclass(frozen=True, eq=False, repr=False)
class Piece(Chain, Shown):
    """A strip of segments, which begins with a frame at a place.

    Attributes
    ----------
    length : float
    strains : ndarray, shape (N, 3)
    first : ndarray, shape (3, 3)
        The first frame; columns are directors.
    place : ndarray, shape (3,)
    free : tuple of int
        The components of the strains that may change.
    """

    length: float
    strains: np.ndarray
    first: np.ndarray
    place: np.ndarray
    free: tuple[int, ...]

    @property
    def segment(self) -> float:
        return self.length / len(self.strains)

    @property
    def size(self) -> int:
        """Number of unknowns: rotation, displacement, strains."""
        return 6 + len(self.strains) * len(self.free)

    def of_strains(self, values: np.ndarray) -> np.ndarray:
        """Return what belongs to the strains (..., N, 3) for all unknowns (..., size), zero for the rigid motion."""
        chosen = values[..., list(self.free)]
        flat = chosen.reshape(*chosen.shape[:-2], -1)
        return np.concatenate([np.zeros((*flat.shape[:-1], 6)), flat], axis=-1)

    @cached_property
    def turns(self) -> tuple[np.ndarray, np.ndarray]:
        """Derivatives (3, size) of the rotation vectors of both ends."""
        rigid = np.eye(3, self.size)
        return rigid, rigid + self.of_strains(self.turning.transpose(1, 0, 2))

    @cached_property
    def moves(self) -> tuple[np.ndarray, np.ndarray]:
        """Derivatives (3, size) of the places of both ends."""
        x = self.centreline
        rigid = np.eye(3, self.size, 3)
        own = self.own + np.cross(self.turning, (x[-1] - x[1:])[:, :, None], axis=1)
        last = rigid + self.of_strains(own.transpose(1, 0, 2))
        last[:, :3] = -cross_matrix(x[-1])
        return rigid, last

    @cached_property
    def shares(self) -> np.ndarray:
        """Length (N + 1,) that belongs to the beginning and to the end of each segment."""
        return np.diff(np.clip(np.arange(-0.5, len(self.strains) + 1), 0, len(self.strains))) * self.segment

    def moves_along(self, axis: np.ndarray) -> np.ndarray:
        """Return the derivatives (N + 1, size) of the places of these along an axis."""
        x, count = self.centreline, len(self.strains)
        turned = np.einsum("jib,nji->njb", self.turning, np.cross(x[:, None] - x[1:], axis))
        rows = (axis @ self.own + turned) * (np.arange(count) < np.arange(count + 1)[:, None])[:, :, None]
        found = self.of_strains(rows)
        found[:, :3], found[:, 3:6] = np.cross(x, axis), axis
        return found

    def work(self, forces: np.ndarray) -> np.ndarray:
        """Return the derivative (size,) of the sum of forces (N, 3) . x at the ends of the segments."""
        _, force, torque, _ = self.levers(np.zeros(3), forces)
        found = self.of_strains(np.einsum("ki,kib->kb", force, self.own) + np.einsum("ki,kib->kb", torque, self.turning))
        found[:6] = [*np.cross(self.centreline[1:], forces).sum(axis=0), *forces.sum(axis=0)]
        return found

    def second(self, rotation: np.ndarray, forces: np.ndarray) -> np.ndarray:
        """Return the second derivatives (size, size) of that sum, and of rotation . the rotation vector of the last end."""
        inner = self.curvature(rotation, forces)
        lever, *_ = self.levers(rotation, forces)
        spread = self.centreline[1:].T @ forces
        found = np.zeros((self.size, self.size))
        found[:3] = self.of_strains(lever.transpose(1, 0, 2))
        found[:, :3] = found[:3].T
        found[:3, :3] = (spread + spread.T) / 2 - np.trace(spread) * np.eye(3)
        chosen = inner[:, self.free][:, :, :, self.free]
        found[6:, 6:] = chosen.reshape(self.size - 6, -1)
        return found


@dataclass(frozen=True)
class _End:
    """An end of a piece, and an arm from there on the lab axes."""

    piece: int
    last: bool
    arm: np.ndarray


@dataclass(frozen=True)
class _Condition:
    """What vanishes: ``rows`` (k, 3) times the rotation (else the place at the arm) of an end, less that of another one."""

    turns: bool
    rows: np.ndarray
    missed: np.ndarray
    end: _End
    other: _End | None = None


@dataclass(frozen=True, eq=False, repr=False)
class NetworkChain(Shown):
    """A network of segments.

    Attributes
    ----------
    network : Network
    numbers : mapping of str to float
        Values of its parameters.
    pieces : tuple of Piece
        Its members.
    asked : int
        The number of segments that was asked for.
    """

    network: Network
    numbers: Mapping[str, float]
    pieces: tuple[Piece, ...]
    asked: int

    @property
    def strains(self) -> np.ndarray:
        """The strains of all members, one after the other, shape (N, 3)."""
        return np.concatenate([piece.strains for piece in self.pieces])

    @property
    def material(self) -> str:
        """The names of the laws."""
        return ", ".join(dict.fromkeys(section.law.name for section in self.network.sections.values()))

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return len(self._kept)

    @cached_property
    def _fixed(self) -> dict[str, int]:
        """Joints at which a member begins that nothing moves there, and its number."""
        held = self.network.held
        begins = self.network.begins.items()
        return {name: one for name, one in begins if held[name].rotation == CLAMPED and len(held[name].held) == 3}

    @cached_property
    def _kept(self) -> np.ndarray:
        """Places of the unknowns among those of all members, without rigid motions of members whose beginning is fixed."""
        fixed = [np.arange(6) + self._starts[number] for number in self._fixed.values()]
        return np.delete(np.arange(self._starts[-1]), np.array(fixed, dtype=int).ravel())

    @cached_property
    def _starts(self) -> list[int]:
        return [0, *np.cumsum([piece.size for piece in self.pieces]).tolist()]

    def _own(self, number: int) -> slice:
        """Return the places of a member's unknowns among all."""
        return slice(self._starts[number], self._starts[number + 1])

    # --- energy ---------------------------------------------------------------------------------------------------------

    @cached_property
    def _densities(self) -> list[tuple[np.ndarray, np.ndarray, np.ndarray]]:
        """U, moment and stiffness on the segments of each member."""
        found = []
        for member, piece in zip(self.network.members.values(), self.pieces):
            section = self.network.sections[member.section]
            t = member.part((np.arange(len(piece.strains)) + 0.5) / len(piece.strains))
            numbers = SimpleNamespace(**self.network.numbers_of(member.section, self.numbers))
            found.append(section.strain_energy(t, piece.strains, numbers))
        return found

    @cached_property
    def energy(self) -> float:
        """The potential: of the strains, and of all loads."""
        value = sum(piece.segment * float(U.sum()) for piece, (U, *_) in zip(self.pieces, self._densities))
        weight, stiffness, down, _ = self._distributed
        for piece, offset in zip(self.pieces, self._offsets):
            value -= weight * float(piece.shares @ (piece.place + piece.centreline) @ down)
            value += stiffness / 2 * float(piece.shares @ offset**2)
        for end, force in self._forces:
            value -= float(force @ self._place(end))
        for name, _, size in self._moments:
            value -= size * self._hinge(name)[1]
        return value

    @property
    def _distributed(self) -> tuple[float, float, np.ndarray, np.ndarray]:
        """Weight and stiffness of the foundation per length, and their directions."""
        down, across = self.network.weight_direction, self.network.foundation_direction
        return self.numbers.get("weight", 0.0), self.numbers.get("foundation", 0.0), np.array(down), np.array(across)

    @cached_property
    def _offsets(self) -> list[np.ndarray]:
        """Displacements (N + 1,) of each member against the foundation, at the beginning and at the end of each segment."""
        across, ground = self._distributed[3], self.network.ground
        return [(piece.place + piece.centreline) @ across - ground for piece in self.pieces]

    @cached_property
    def _pulls(self) -> list[np.ndarray]:
        """The forces (N + 1, 3) of weight and foundation there."""
        weight, stiffness, down, across = self._distributed
        return [
            piece.shares[:, None] * (weight * down - stiffness * offset[:, None] * across)
            for piece, offset in zip(self.pieces, self._offsets)
        ]

    @cached_property
    def _forces(self) -> list[tuple[_End, np.ndarray]]:
        """Dead forces: where they act, and the force."""
        found = []
        for number, load in self.network.loads.items():
            for joint, direction, arm in load.forces:
                first = self.network.joints[joint].members[0]
                end = self._end(first)
                turned = self._frame_of_end(end) @ self.network.drawn_axes(first) @ np.array(arm)
                found.append((replace(end, arm=end.arm + turned), self.numbers[number] * np.array(direction)))
        return found

    @cached_property
    def _moments(self) -> list[tuple[str, _End, float]]:
        """Dead moments about the axes of hinges that hold joints."""
        return [
            (joint, self._end(self.network.joints[joint].members[0]), self.numbers[number] * factor)
            for number, load in self.network.loads.items()
            for joint, factor in load.moments
        ]

    # --- ends -------------------------------------------------------------------------------------------------------------

    def _end(self, each: JointEnd) -> _End:
        end = _End(list(self.network.members).index(each.member), each.end != START, np.zeros(3))
        return replace(end, arm=self._frame_of_end(end) @ np.array(each.arm))

    def _frame_of_end(self, end: _End) -> np.ndarray:
        """Return the directors of an end; columns."""
        piece = self.pieces[end.piece]
        return piece.axes[-1] if end.last else piece.first

    def _place(self, end: _End) -> np.ndarray:
        piece = self.pieces[end.piece]
        return piece.place + end.arm + (piece.centreline[-1] if end.last else 0.0)

    def _joint_frame(self, each: JointEnd) -> np.ndarray:
        """Return the rotation (3, 3) of an end from the drawing, before which it is turned by its angle."""
        angle = self.numbers[each.angle] if isinstance(each.angle, str) else each.angle
        frame = self._frame_of_end(self._end(each)) @ self.network.drawn_axes(each)
        return frame @ Rotation.from_rotvec(-angle * np.array(each.axis)).as_matrix() if angle else frame

    def _hinge(self, name: str) -> tuple[np.ndarray, float, np.ndarray]:
        """Return the frame of a support, turned with its hinge, that angle, and the axis of the hinge."""
        end = self.network.held[name]
        frame = np.reshape(ends.directors(*self.network.prescriptions[name][0](self._values)), (3, 3)).T
        if end.rotation != HINGED:
            return frame, 0.0, np.zeros(3)
        turned, angle = _turned(frame, self._joint_frame(self.network.joints[name].members[0]), np.array(end.axis))
        return turned, angle, frame @ np.array(end.axis)

    @cached_property
    def _values(self) -> SimpleNamespace:
        return SimpleNamespace(**self.numbers)

    # --- conditions -------------------------------------------------------------------------------------------------------

    @cached_property
    def _conditions(self) -> list[_Condition]:
        return [*self._of_joints(), *self._of_supports()]

    def _of_joints(self) -> Iterator[_Condition]:
        for joint in self.network.joints.values():
            first, before = joint.members[0], joint.members[0]
            for each in joint.members[1:]:
                here, there = self._end(each), self._end(first)
                yield _Condition(False, np.eye(3), self._place(here) - self._place(there), here, there)
                kind, base = (RIGID, before) if each.goes_on else (joint.kind, first)
                if kind != BALL:
                    frame, now, rows = self._joint_frame(base), self._joint_frame(each), np.eye(3)
                    if kind == HINGE:
                        axis = ends.unit("axis", joint.axis)
                        frame, _ = _turned(frame, now, np.array(axis))
                        rows = np.array(ends.perpendicular(axis))
                    yield _Condition(True, rows @ frame.T, rows @ _vector(frame.T @ now), here, self._end(base))
                before = each

    def _of_supports(self) -> Iterator[_Condition]:
        for name, end in self.network.held.items():
            if name in self._fixed:
                continue
            each = self.network.joints[name].members[0]
            here, to = self._end(each), self.network.prescriptions[name][1](self._values)
            if end.held:
                held = np.array(end.held)
                yield _Condition(False, held, held @ (self._place(here) - to), here)
            if end.rotation != FREE:
                frame, *_ = self._hinge(name)
                rows = np.eye(3) if end.rotation == CLAMPED else np.array(ends.perpendicular(end.axis))
                yield _Condition(True, rows @ frame.T, rows @ _vector(frame.T @ self._joint_frame(each)), here)
        if self.network.floats:
            each = JointEnd(next(iter(self.network.members)))
            here = self._end(each)
            yield _Condition(False, np.eye(3), self._place(here) - self.network.drawn(each)[4:], here)
            yield _Condition(True, np.eye(3), _vector(self._joint_frame(each)), here)

    @property
    def _missed(self) -> np.ndarray:
        return np.concatenate([np.zeros(0), *(one.missed for one in self._conditions)])

    def _by_end(self, end: _End, turns: bool) -> np.ndarray:
        """Return the derivative (3, n) of the rotation vector, or of the place at the arm, of an end."""
        piece, found = self.pieces[end.piece], np.zeros((3, self._starts[-1]))
        own = piece.turns[end.last] if turns else piece.moves[end.last] - cross_matrix(end.arm) @ piece.turns[end.last]
        found[:, self._own(end.piece)] = own
        return found

    @property
    def _slopes(self) -> np.ndarray:
        """Derivatives (c, n) of the conditions, where they are met."""
        found = [np.zeros((0, self._starts[-1]))]
        for one in self._conditions:
            change = self._by_end(one.end, one.turns)
            found.append(one.rows @ (change if one.other is None else change - self._by_end(one.other, one.turns)))
        return np.concatenate(found)[:, self._kept]

    # --- derivatives ------------------------------------------------------------------------------------------------------

    def linearized(self):
        """Return gradient (n,), slopes of the conditions (c, n), Hessian of the Lagrangian (n, n), and multipliers.

        All but the slopes are times the number of segments; the multipliers minimize the gradient.
        """
        count, slopes = sum(len(piece.strains) for piece in self.pieces), self._slopes
        gradient = np.zeros(self._starts[-1])
        for number, (piece, (_, moment, _), pulls) in enumerate(zip(self.pieces, self._densities, self._pulls)):
            own = piece.of_strains(piece.segment * moment) - piece.work(pulls[1:])
            own[3:6] -= pulls[0]
            gradient[self._own(number)] = own
        acting = _Acting(self)
        for end, force in self._forces:
            acting.pull(end, -force)
            gradient -= force @ self._by_end(end, False)
        for name, end, size in self._moments:
            couple = size * self._hinge(name)[2]
            acting.turn(end, -couple)
            gradient -= couple @ self._by_end(end, True)
        gradient = gradient[self._kept]
        multipliers = -np.linalg.lstsq(slopes.T, gradient, rcond=None)[0] if len(slopes) else np.zeros(0)
        first = 0
        for one in self._conditions:
            push = multipliers[first : first + len(one.rows)] @ one.rows
            first += len(one.rows)
            (acting.turn if one.turns else acting.pull)(one.end, push)
            if one.other is not None:
                (acting.turn if one.turns else acting.pull)(one.other, -push)
                if one.turns:
                    acting.pairs.append((one.other, one.end, push))
        return count * gradient, slopes, count * self._hessian(acting), count * multipliers

    def _hessian(self, acting: _Acting) -> np.ndarray:
        """Return the second derivatives (n, n) of the energy and of the conditions times their multipliers."""
        found = np.zeros((self._starts[-1], self._starts[-1]))
        _, springs, _, across = self._distributed
        for number, (piece, (_, _, stiffness), pulls) in enumerate(zip(self.pieces, self._densities, self._pulls)):
            forces = -pulls[1:]
            forces[-1] += acting.forces[number, 1]
            block = piece.second(acting.moments[number, 1], forces)
            free, inner = list(piece.free), np.arange(len(piece.strains))
            strains = block[6:, 6:].reshape(len(inner), len(free), len(inner), len(free))
            strains[inner, :, inner] += piece.segment * stiffness[:, free][:, :, free]
            if springs:
                moves = piece.moves_along(across)
                block += springs * (piece.shares[:, None] * moves).T @ moves
            for last, turns in enumerate(piece.turns):
                block += turns.T @ acting.arms[number, last] @ turns
            found[self._own(number), self._own(number)] = block
        for first, other, push in acting.pairs:
            cross = self._by_end(other, True).T @ cross_matrix(push) @ self._by_end(first, True) / 2
            found -= cross + cross.T
        return found[np.ix_(self._kept, self._kept)]

    # --- other states -----------------------------------------------------------------------------------------------------

    def moved(self, change) -> NetworkChain:
        """Return the network with its unknowns changed by (n,), and joined and held again by the smallest further change.

        Raises ValueError where the conditions cannot be met nearby.
        """
        failed = "the conditions at joints and supports cannot be met by a small change of the strains"
        return moved(self, change, lambda chain: chain._missed, lambda chain: chain._slopes, failed)

    def _changed(self, change) -> NetworkChain:
        pieces, whole = [], np.zeros(self._starts[-1])
        whole[self._kept] = change
        for number, piece in enumerate(self.pieces):
            own, strains = whole[self._own(number)], piece.strains.copy()
            strains[:, list(piece.free)] += own[6:].reshape(len(strains), -1)
            first = Rotation.from_rotvec(own[:3]).as_matrix() @ piece.first if own[:3].any() else piece.first
            pieces.append(replace(piece, strains=strains, first=first, place=piece.place + own[3:6]))
        return replace(self, pieces=tuple(pieces))


class _Acting:
    """What acts on the ends of all members: forces, moments (J, 2, 3), forms of arms (J, 2, 3, 3), and moments of pairs."""

    def __init__(self, chain: NetworkChain) -> None:
        count = len(chain.pieces)
        self.forces, self.moments, self.arms = np.zeros((count, 2, 3)), np.zeros((count, 2, 3)), np.zeros((count, 2, 3, 3))
        self.pairs: list[tuple[_End, _End, np.ndarray]] = []

    def pull(self, end: _End, force: np.ndarray) -> None:
        """Add a force at the arm of an end."""
        at = end.piece, int(end.last)
        self.forces[at] += force
        self.moments[at] += np.cross(end.arm, force)
        outer = np.outer(end.arm, force)
        self.arms[at] += (outer + outer.T) / 2 - np.trace(outer) * np.eye(3)

    def turn(self, end: _End, moment: np.ndarray) -> None:
        """Add a moment at an end."""
        self.moments[end.piece, int(end.last)] += moment


def _vector(rotation: np.ndarray) -> np.ndarray:
    return Rotation.from_matrix(rotation).as_rotvec()


def _turned(frame: np.ndarray, now: np.ndarray, axis: np.ndarray) -> tuple[np.ndarray, float]:
    """Return a frame turned about an axis that is fixed on it, as far as another one has turned, and that angle."""
    *vector, scalar = Rotation.from_matrix(frame.T @ now).as_quat()
    angle = 2 * float(np.arctan2(np.dot(vector, axis), scalar))
    return frame @ Rotation.from_rotvec(angle * axis).as_matrix(), angle


def unsupported(network: Network) -> str:
    """Return why there are no chains of segments of a network, '' if there are."""
    if network.phases:
        return "a network with phases"
    if network.roller is not None:
        return "a strip with a roller"
    for name in ("pressure", "field"):
        if name in network.numbers:
            return f"a network with {name}"
    if any(end.rotation == JOINT for end in network.held.values()):
        return "a network with a universal joint"
    if not network.problem.has_index:
        return "a network with loads that follow"
    return "a network with loads that nothing holds" if network.floats and network.loads else ""


def cut(network: Network, system: Collocation, x: np.ndarray, segments: int) -> NetworkChain:
    """Return the network of segments that has the strains of a state in the middle of each, joined and held.

    Raises ValueError where it cannot be joined and held there: too few segments; or something is unsupported.
    """
    if reason := unsupported(network):
        raise ValueError(f"{reason} is not cut into segments")
    p = system.all_parameters(x)
    numbers, first = dict(zip(network.problem.parameters, p.tolist())), system.states(x)[0]
    whole, pieces = sum(member.length for member in network.members.values()), []
    for (name, member), places in zip(network.members.items(), network.places):
        count = max(_FEWEST, round(segments * member.length / whole))
        middle = (np.arange(count) + 0.5) / count
        strains = network.strains_at(middle, system.evaluate(x, middle), p)[name]
        section, own = network.sections[member.section], first[places[:7]]
        rigid = section.constrained and not network.numbers_of(member.section, numbers).get("softness", 0.0) > 0
        pieces.append(Piece(member.length, strains, frames(own[None])[0].T, own[4:], (0, 2) if rigid else (0, 1, 2)))
    chain = NetworkChain(network, numbers, tuple(pieces), segments)
    return chain.moved(np.zeros(chain.size))
