"""States of networks, read: strains, shapes, places and reactions, and where laws end."""

from __future__ import annotations

import functools
import itertools
import re
from collections import namedtuple
from collections.abc import Sequence
from types import SimpleNamespace

import numpy as np

import contin
from contin import Point
from contin.lowlevel import Collocation, Continuation
from ribbon_model import law_end
from ribbon_model.ends import Vector
from ribbon_model.equilibrium import CENTRELINE, FRAME, directors, moment_on_directors, strains_of
from ribbon_model.members import START, JointEnd, numbers_of
from ribbon_model.section import KINDS, NATURAL, Section
from ribbon_model.shape import Shape, shape_of
from ribbon_model.statement import AXES, MOVES, Statement, at_arm, axes_of, joint_frame

#: Kinds of the numbers that prescribe a joint.
_PRESCRIBED = (*["length"] * 3, *["angle"] * 3)


class States(Statement):
    """A network as its states are read."""

    def lever(self, point: Point, name: str) -> np.ndarray:
        """Return the sum of f x^T (3, 3) over the forces f of a load, for a number of 1, at their places x in a state.

        Of a field, along which directors are turned, the integral over these.
        """
        if name in self.loads:
            at = [(where, np.array(f), self.joints[where].members[0], arm) for where, f, arm in self.loads[name].forces]
            return sum(np.outer(f, self.place(point, where) + self._arm(point, one, arm)) for where, f, one, arm in at)
        lengths = [member.length for member in self.members.values()]
        states = point.system.evaluate(point.x, np.linspace(0, 1, 101))
        axes = [np.mean([axes_of(row[at])[self.magnetized] for row in states], axis=0) for at in self.places]
        return np.outer(self.field_direction, np.average(axes, axis=0, weights=lengths) * sum(lengths))

    def _ends(self) -> list[tuple[Section, list[contin.Event]]]:
        """Return the section of each member, with the test function that ends a run where its law ends."""
        found = []
        for (name, member), places in zip(self.members.items(), self.places):
            section = self.sections[member.section]
            names = {number: self.full_name(member.section, number) for number in section.parameters}
            place = law_end.Place(functools.partial(self._strains_of, name), tuple(places), names, member.part)
            found.append((section, law_end.tests(section, place)))
        return found

    def _strains_of(self, name: str, system: Collocation, x: np.ndarray) -> np.ndarray:
        return self.strains_at(system.nodes, system.states(x), system.all_parameters(x))[name]

    def domain_tests(self) -> list[contin.Event]:
        """Return the test functions that end a run where a law ends; none for laws that are regular everywhere."""
        return [test for _, tests in self._ends() for test in tests]

    def explained(self, run: Continuation) -> str | None:
        """Return that a run met the end of a law, or failed near it; None for a run that stopped elsewhere."""
        return next((told for section, tests in self._ends() if (told := law_end.explained(section, tests, run))), None)

    def strains(self, system: Collocation, x: np.ndarray) -> dict[str, np.ndarray]:
        """Return the strains (K, 3) of each member at the nodes of a discretized state."""
        return self.strains_at(system.nodes, system.states(x), system.all_parameters(x))

    def strains_at(self, t: np.ndarray, states: np.ndarray, p: np.ndarray) -> dict[str, np.ndarray]:
        """Return the same at parts t (K,) of the lengths, from states (K, n) and the values of all parameters."""
        rates, found = self.problem.batch("field").values(t, states, states[:0], p), {}
        for (name, member), places in zip(self.members.items(), self.places):
            at = places[:4]
            found[name] = strains_of(states[:, at], rates[:, at]) / member.length
        return found

    def shapes(self, point: Point) -> dict[str, Shape]:
        """Return each member in space."""
        system = point.system
        return self.shapes_at(system.nodes, system.states(point.x), system.all_parameters(point.x))

    def shapes_at(self, t: np.ndarray, states: np.ndarray, p: np.ndarray) -> dict[str, Shape]:
        """Return the same from states (K, n) at parts t (K,) of the lengths and the values of all parameters."""
        strains, members = self.strains_at(t, states, p), zip(self.members.items(), self.places)
        return {name: shape_of(one.length * t, states[:, places], strains[name]) for (name, one), places in members}

    def reactions(self, point: Point) -> dict[str, tuple[np.ndarray, np.ndarray]]:
        """Return force and moment (3,) on the network at each joint that is held, on the axes of the drawing.

        The moment is about the place of the joint. Of a network that floats, ``floating`` are those at the first end of the
        first member: zero up to errors.
        """
        if not self.floats:
            return {name: self._reaction(point, self.joints[name].members, name) for name in self.held}
        first = JointEnd(next(iter(self.members)))
        name = self.joint_at(first)
        return {"floating": self._reaction(point, self.joints[name].members if name else [first], name)}

    @property
    def found_names(self) -> tuple[str, ...]:
        """Names of what `found` gives."""
        return (*self._found_kinds, *(["floating"] if self.floats else []))

    @property
    def _found_kinds(self) -> dict[str, str]:
        places = {f"{column(joint)}_{axis}": "length" for joint in self.joints for axis in AXES}
        kinds = itertools.product(self.held, ("force", "moment"), AXES)
        return places | {f"{kind[0].upper()}_{joint}_{axis}": kind for joint, kind, axis in kinds}

    @property
    def kinds(self) -> dict[str, str]:
        """Kinds of numbers and of what is found, from which units follow: length, angle, force, ...; ratios are left out."""
        angles = [each.angle for joint in self.joints.values() for each in joint.members if isinstance(each.angle, str)]
        held = {name: kind for joint in self.held for name, kind in zip(self.numbers_at(joint), _PRESCRIBED) if name}
        loads = {name: "moment" if load.moments else "force" for name, load in self.loads.items()}
        own = {self.full_name(section, name): KINDS[name] for section in self.sections for name in NATURAL}
        return KINDS | own | dict.fromkeys(angles, "angle") | held | loads | self._found_kinds

    def found(self, point: Point) -> dict[str, float]:
        """Return places of joints and reactions by name; of a network that floats, the largest part of its reactions."""
        places = [self.place(point, joint) for joint in self.joints]
        reactions = [part for parts in self.reactions(point).values() for part in parts]
        last = [np.abs(reactions).max()] if self.floats else np.ravel(reactions)
        return dict(zip(self.found_names, map(float, (*np.ravel(places), *last))))

    def conjugate(self, name: str) -> str:
        """Return the name of what is conjugate to a number, up to a sign and a factor: the energy for many."""
        if forces := [*self.loads[name].forces, *self.loads[name].followers] if name in self.loads else ():
            joint, direction, _ = forces[0]
            return f"{column(joint)}_{AXES[int(np.argmax(np.abs(direction)))]}"
        joint, _, move = name.rpartition("_")
        return f"F_{joint}_{move[1]}" if move in MOVES and joint in self.held else "energy"

    def sizes(self, system: Collocation, x: np.ndarray) -> dict[str, float]:
        """Return the sizes of states and numbers for `contin.Settings.scales`, at a state: the problem has its own."""
        return {}

    def _reaction(self, point: Point, those: Sequence[JointEnd], name: str) -> tuple[np.ndarray, np.ndarray]:
        """Return force and moment on ends that meet, about their place, less the loads at the joint of this name."""
        force, moment, first, numbers = np.zeros(3), np.zeros(3), those[0], SimpleNamespace(**point.parameters)
        origin = at_arm(self._state(point, first)[:7], first.arm)
        for each in those:
            pull, couple, place = self._at_end(point, each)
            force, moment = force + pull, moment + couple + np.cross(place - origin, pull)
        for number, load in self.loads.items():
            turned = [(where, self._arm(point, first, along), arm) for where, along, arm in load.followers]
            for where, direction, arm in (*load.forces, *turned):
                if where == name:
                    pull = self._part(numbers) * point[number] * np.array(direction)
                    force, moment = force - pull, moment - np.cross(self._arm(point, first, arm), pull)
            for where, factor in load.moments:
                if where == name:
                    frame = self.prescriptions[name][0](numbers)
                    moment -= self._part(numbers) * point[number] * factor * (np.array(self.held[name].axis) @ axes_of(frame))
        return force, moment

    def _at_end(self, point: Point, each: JointEnd) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return force and moment on a member at an end, and the place of that end.

        The multiplier of the centreline is the force without p (r - c) x N / 2, as the area under a pressure p is that of a fan
        from c; where members are joined, this part balances.
        """
        row = self._state(point, each)
        sign = -1.0 if each.end == START else 1.0
        side, centre = self._outline[0].get(each.member, (0, row[4:7]))
        pressure = point.parameters.get("pressure", 0.0) * self._part(SimpleNamespace(**point.parameters))
        fan = side * pressure * np.cross(row[4:7] - centre, self.pressure_normal)
        moment = moment_on_directors(row[:4], row[7:11]) @ np.array(directors(*row[:4])).reshape(3, 3)
        return sign * (row[11:14] + fan / 2), sign * moment, row[4:7]

    def place(self, point: Point, joint: str) -> np.ndarray:
        """Return the place (3,) of a joint."""
        first = self.joints[joint].members[0]
        return at_arm(self._state(point, first)[:7], first.arm)

    def displacement(self, point: Point, joint: str) -> np.ndarray:
        """Return the displacement (3,) of a joint that its numbers prescribe, as far as it is held."""
        origin, strokes = self._from(joint)
        moved = sum((point.parameters.get(number, 0.0) * np.array(direction) for number, direction in strokes), np.zeros(3))
        return self.place(point, joint) - origin - moved

    def frame(self, point: Point, joint: str) -> tuple:
        """Return the quaternion of the joint frame, the identity in the drawing."""
        first = self.joints[joint].members[0]
        q, drawn = (numbers_of(state[:4]) for state in (self._state(point, first), self.drawn(first)))
        numbers = SimpleNamespace(**point.parameters)
        return joint_frame(q, drawn, first, numbers, self._part(numbers))

    def _state(self, point: Point, each: JointEnd) -> np.ndarray:
        """Return quaternion, place, and their multipliers (14,) at an end."""
        number = list(self.members).index(each.member)
        return point.system.states(point.x)[0 if each.end == START else -1, self.places[number]]

    def _arm(self, point: Point, each: JointEnd, arm: Vector) -> np.ndarray:
        """Return an arm on the axes of the drawing, fixed on an end, as it has turned."""
        return (self.drawn_axes(each) @ np.array(arm, dtype=float)) @ axes_of(self._state(point, each))

    def potential(self, point: Point) -> float:
        """Return the energy with the potential of all loads: that of which the index is."""
        if self._end_energy is None:
            return point["energy"]
        states, rows = point.system.states(point.x), namedtuple("State", (*FRAME, *CENTRELINE))
        first, last = ([rows(*states[end, places[:7]]) for places in self.places] for end in (0, -1))
        return point["energy"] + float(self._end_energy(first, last, SimpleNamespace(**point.parameters)))


def column(joint: str) -> str:
    """Return the name of a joint in columns: that of 'beam at 0.5' is beam_at_0_5."""
    return re.sub(r"\W+", "_", joint)
