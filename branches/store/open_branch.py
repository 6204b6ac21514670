"""A result file of an open strip or a network in memory: stages with their pieces, shapes, and what snaps release."""

from __future__ import annotations

import functools
import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np

from branches.draw.solid import widest
from branches.draw.strip import ROOM, SIDE, View
from branches.draw.structure import Structure, flat_across, moved, parts_of, standing
from branches.scene.labels import without_round_off
from branches.store.branch import Piece, Snap, StoredBranch
from branches.store.files import StoreError
from branches.store.fixtures import fixtures
from branches.store.layout import OPEN
from contin.lowlevel import PALETTE, Collocation, levels
from ribbon_model.changed_supports import fitted
from ribbon_model.ends import DIRECTIONS
from ribbon_model.network import Network
from ribbon_model.shape import Shape, interpolated

#: Networks are drawn flat, often, with strips across their plane: seen from ahead, those that stand upright would be lines.
_VIEW = View(-70.0, 20.0)
#: Width of drawn strips of unknown dimensions, over the length of the longest.
OPEN_WIDTH = 0.06


class OpenBranch(StoredBranch):
    """The result file of an open strip or a network; as `branches.read.StoredBranch`.

    Lengths are over that of the strip, or in the unit of the network. Strains and tables have the strips one after the
    other, in the order of the network's members.
    """

    def strains(self, point: int) -> np.ndarray:
        """Return omega_1, omega_2, omega_3 (K, 3) at a kept point, over 1/L."""
        return self.shape_at(point, *self.states_at(point))[1]

    def _strip(self, point: int) -> Network:
        return self.scene.strip(int(self.points["stage"][point]))

    def _numbers(self, point: int) -> dict[str, float]:
        row, names = self.points[point], self.points.dtype.names
        return {name: float(row[name]) if name in names else 0.0 for name in self._strip(point).problem.parameters}

    def shape(self, point: int) -> Shape:
        """Return the strips at a kept point, on the axes of the drawing or, of an open strip, of its first end."""
        return self.shape_at(point, *self.states_at(point))[0]

    def discretized(self, point: int) -> tuple[Collocation, np.ndarray]:
        """As `StoredBranch.discretized`; the multipliers of conditions, which are not in the file, are those that fit best."""
        t, states = self.states_at(point)
        strip, degree = self._strip(point), self.degree(point)
        numbers, _ = fitted(strip, states, self._numbers(point), strip.problem.multipliers)
        free = (self.followed(int(self.points["stage"][point])), *strip.problem.multipliers)
        system = Collocation(strip.problem, t[::degree], degree, free, numbers)
        return system, system.pack(states, numbers)

    def shape_at(self, point: int, t: np.ndarray, states: np.ndarray) -> tuple[Shape | Structure, np.ndarray]:
        """Return shape and strains (strips K, 3) of states (K, n) at parts t (K,) of the lengths."""
        network, values, shapes = self._strip(point), np.array([*self._numbers(point).values()]), []
        for shape, (name, member) in zip(network.shapes_at(t, states, values).values(), network.members.items()):
            section = network.sections[member.section]
            numbers = SimpleNamespace(**network.numbers_of(member.section, dict(zip(network.problem.parameters, values))))
            along = {
                field: np.array([float(section.datum(name)(s, numbers)) for s in member.part(t)])
                for field, name in (("breadth", "width"), ("depth", "thickness")) if name in section.along
            }  # fmt: skip
            shapes.append(replace(flat_across(shape, section.form), **along))
        strains = np.concatenate([*network.strains_at(t, states, values).values()])
        if self.scene.KIND == OPEN:
            return shapes[0], strains
        found = [replace(one, force=self.force(one.number)[point]) if one.number else one for one in fixtures(network)]
        return Structure(tuple(shapes), tuple(found)), strains

    def force(self, number: str) -> np.ndarray:
        """Return a dead force at all points, 0 where it is round-off of the largest one in the file."""
        values = self.points[number]
        return np.where(np.abs(values) > levels.LOCATED * self._largest, values, 0.0)

    @functools.cached_property
    def _largest(self) -> float:
        """The largest dead force in the file."""
        names = {one.number for stage in self.stages for one in fixtures(stage.strip) if one.number}
        return max((float(np.abs(self.points[name]).max()) for name in names), default=0.0)

    def solution(self, point: int):
        """Open strips have no `ribbon_model.solution.Solution`; raise StoreError."""
        raise StoreError("loops are of closed strips, and this result is of an open one (shape and strains give its states)")

    def placed(self, point: int, length: float, cells: int = 0) -> tuple[Shape, np.ndarray]:
        """Return the strip, or the longest one, of this length, the middle at the origin, and strains in radians per length.

        The axes are tangent, width and normal of its first end, or the weight points downwards. Between the nodes of the
        solution, its polynomials are evaluated at further places until there are at least as many ``cells``.
        """
        nodes, cells = self.states_at(point)[0], -(-cells // len(self._strip(point).members))
        parts = np.arange(pieces := max(1, -(-cells // (len(nodes) - 1)))) / pieces
        t = np.append((nodes[:-1, None] + np.diff(nodes)[:, None] * parts).ravel(), nodes[-1])
        shape, strains = self.shape_at(point, t, interpolated(*self.states_at(point), self.degree(point), t))
        shape, scale = standing(shape, self.up), length / self.shape_length
        return moved(shape, np.eye(3), -shape.centreline.mean(axis=0), scale), strains / scale

    @property
    def length(self) -> float:
        """The length of the scene's dimensions; without them 1, or that of the longest strip."""
        return self.scene.size("length") * self.scene.longest

    @property
    def shape_length(self) -> float:
        """The length of the longest strip of `shape`."""
        return self.scene.longest

    @property
    def length_unit(self) -> str:
        """As `StoredBranch.length_unit`, '' for the unit of a network."""
        return "m" if self.scene.dimensions else "L" if self.scene.KIND == OPEN else ""

    def width_at(self, length: float, thickness: float | None) -> float | None:
        """Return the width of the scene's dimensions, or that from a thickness and Gamma = w^2/(h L), or None.

        It is that of the place where the width along the strip is 1.
        """
        if self.scene.dimensions:
            return self.scene.dimensions.width / self.length * length
        Gamma = self.scene.material.get("Gamma") if self.scene.KIND == OPEN else None
        return math.sqrt(Gamma * thickness * length) if Gamma and thickness else None

    @property
    def up(self) -> tuple[float, float, float]:
        """The direction that is up in pictures: against the weight; without one, the normal of the first end of a strip.

        Of a network without weight it is z, if dead forces together pull along -z most, otherwise y.
        """
        network = self.scene.strip()
        if not self.is_heavy:
            if self.scene.KIND == OPEN:
                return DIRECTIONS["normal"]
            forces = [direction for load in network.loads.values() for _, direction, _ in load.forces]
            if forces and (pull := np.sum(forces, axis=0))[2] < -max(abs(pull[0]), abs(pull[1])):
                return 0.0, 0.0, 1.0
        return tuple(-x for x in network.weight_direction)

    @property
    def shown(self) -> tuple[str, ...]:
        followed = dict.fromkeys(stage.follow for stage in self.scene.stages)
        return ("point", "label", "name", "stage", *followed, "energy", "index")

    # --- pictures -------------------------------------------------------------------------------------------------------

    def colour(self, stage: int) -> str:
        return PALETTE[(stage - 1) % len(PALETTE)]

    def posed(self, points: list[int]) -> dict[int, Shape]:
        """As `StoredBranch.posed`: the direction `up` is up, and the first end, which does not move, is in one place in all."""
        return dict(zip(points, self.stood([self.shape(point) for point in points])))

    def stood(self, shapes: list[Shape]) -> list[Shape]:
        """Return shapes with the direction `up` upwards, all moved alike: the middle of the box around them is the origin."""
        found = [standing(shape, self.up) for shape in shapes]
        all_points = np.concatenate([shape.centreline for shape in found] or [np.zeros((1, 3))])
        middle = (all_points.max(axis=0) + all_points.min(axis=0)) / 2
        return [moved(shape, np.eye(3), -middle) for shape in found]

    @property
    def view(self) -> View:
        return SIDE if self.scene.KIND == OPEN else _VIEW

    @property
    def is_heavy(self) -> bool:
        return "weight" in self.scene.strip().parameters

    def drawn_width(self, strips: list[Shape], asked: float | None) -> float:
        parts = [part for strip in strips for part in parts_of(strip)]
        if asked is None:
            asked = self.width_at(self.shape_length, None) or OPEN_WIDTH * self.shape_length
        return min([asked, *(ROOM * widest(part) for part in parts)])

    # --- places ---------------------------------------------------------------------------------------------------------

    def place(self, row: int) -> str:
        event = self.events[row]
        name = self.followed(int(event["stage"]))
        value = without_round_off(event[name], abs(self.points[name][self.points["stage"] == event["stage"]]).max())
        told = f"{name} = {value * self.scene.factor(name):.4f} {self.scene.unit(name)}".rstrip()
        return f"{told} of stage {event['stage']}"

    def origin(self, stage: int) -> int:
        """Return the point of an earlier stage from which a stage starts."""
        one = self.scene.stages[stage - 1]
        events = self.events[self.events["stage"] == (one.stage or stage - 1)]
        place = one.place_among([(event["label"].decode(), event["name"].decode()) for event in events])
        return int(events["point"][place])

    def snaps(self) -> list[Snap]:
        pieces, found = self.pieces(), []
        for event in self.events:
            if event["label"] != b"LP" or 0 not in (event["index_before"], event["index_after"]):
                continue
            row, name = int(event["point"]), self.followed(int(event["stage"]))
            energy, value = self.points["potential"], float(event[name])
            for piece in pieces:
                state = self._below(piece, row, name, value) if piece.stable else None
                if state is not None and energy[row] - state["potential"] > levels.APART * (1 + abs(energy[row])):
                    found.append(Snap(row, name, value, state, float(energy[row] - state["potential"])))
        best: dict[int, Snap] = {}
        for snap in found:
            if snap.row not in best or snap.released > best[snap.row].released:
                best[snap.row] = snap
        return list(best.values())

    def _below(self, piece: Piece, row: int, name: str, value: float) -> dict[str, float] | None:
        """Return the columns of a stable piece where the followed number has a value, None if it does not get there."""
        if self.followed(piece.stage) != name or not self.same_strip(piece.rows[0], row, name):
            return None
        x, conjugate = self.points[name][piece.rows], self.conjugate(name)
        for i in range(len(x) - 1):
            if (x[i] - value) * (x[i + 1] - value) <= 0 and x[i] != x[i + 1] and row not in piece.rows[i : i + 2]:
                columns = {conjugate: self.points[conjugate], "potential": self.points["potential"]}
                return {column: self._between(piece.rows, i, name, value, values) for column, values in columns.items()}
        return None

    def _between(self, rows: np.ndarray, i: int, name: str, value: float, column: np.ndarray) -> float:
        """Return a column where a number has a value between points i and i + 1 of a piece, from the points around."""
        from scipy.interpolate import BarycentricInterpolator  # type: ignore[import-untyped]  # .2 s; only values between points need it

        near = rows[max(i - 1, 0) : i + 3]
        return float(BarycentricInterpolator(self.points[name][near], column[near])(value))

    def same_strip(self, first: int, second: int, name: str = "") -> bool:
        """Return whether two points agree in what is held, and in all prescribed numbers but the named one."""
        strip, same = (self.scene.strip(int(self.points["stage"][row])) for row in (first, second))
        if strip is not same:
            return False
        for other in strip.parameters:
            a, b = (float(self.points[other][row]) for row in (first, second))
            if other != name and abs(a - b) > levels.APART * (1 + abs(a)):
                return False
        return True
