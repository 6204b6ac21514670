"""The statement of a network: its names, its drawing, and the variational problem that follows from both."""

from __future__ import annotations

import functools
import math
from collections import Counter, namedtuple
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

import contin
from contin.lowlevel import one_of
from ribbon_model import ends, loads
from ribbon_model.ends import ANGLES, FREE, HINGED, JOINT, LOOSE, End, Roller, Support, Vector, product
from ribbon_model.equilibrium import CENTRELINE, FRAME, directors, moment_of
from ribbon_model.members import BALL, FINISH, RIGID, START, Joint, JointEnd, Load, Member, numbers_of
from ribbon_model.outlines import fans
from ribbon_model.phases import PHASES, Phase
from ribbon_model.section import NATURAL, Section

#: The number that leads from the drawing, which is free of stress at 0, to the network at 1: natural strains, loads, and gaps
#: and turns of joints are this part of theirs. A drawing that needs none of this has no such number.
ASSEMBLY = "assembly"
#: Axes of the drawing.
AXES = "xyz"
#: Displacements of a joint along the axes of the drawing, behind its name.
MOVES = ("dx", "dy", "dz")
#: Numbers of loads that act all along.
POTENTIALS = ("weight", "foundation", "pressure", "field")
#: The same of a load without an energy: a pressure that stays normal to strips.
FOLLOWER = "follower_pressure"
#: A frame that is not turned.
_UNTURNED = (1.0, 0.0, 0.0, 0.0)


@dataclass
class Statement:
    """What a network is, as `ribbon_model.network.Network` describes its attributes, and its problem."""

    sections: Mapping[str, Section]
    members: Mapping[str, Member]
    joints: Mapping[str, Joint] = field(default_factory=dict)
    held: Mapping[str, End] = field(default_factory=dict)
    loads: Mapping[str, Load] = field(default_factory=dict)
    numbers: Mapping[str, float] = field(default_factory=dict)
    weight_direction: Vector = (0.0, -1.0, 0.0)
    pressure_normal: Vector = (1.0, 0.0, 0.0)
    field_direction: Vector = (0.0, 1.0, 0.0)
    magnetized: int = 2
    phases: Sequence[Phase] = ()
    foundation_direction: Vector = (0.0, 1.0, 0.0)
    roller: Roller | None = None
    symmetries: Mapping[str, Callable] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name in ("weight_direction", "foundation_direction", "pressure_normal", "field_direction"):
            setattr(self, name, ends.unit(name, getattr(self, name)))
        for name in self.phases:
            if isinstance(name, str) and (name not in PHASES or len(self.members) > 1):
                what = (
                    f"{name!r} is for one strip, and here are {len(self.members)}" if name in PHASES else one_of(name, PHASES)
                )
                raise ValueError(f"phases: {what}")
        self.phases = tuple(PHASES[one] if isinstance(one, str) else one for one in self.phases)
        self._check()
        ends.check_known(self.numbers, self.known)
        for name, times in Counter([*self.known, *self._of_sections, ASSEMBLY, *self._named((*FRAME, *CENTRELINE))]).items():
            if times > 1:
                what = f"loads: {name}" if name in self.loads else name
                raise ValueError(f"{what}: is the name of another number of this network; give another name")
        #: How members bear a pressure, and the ends that slide under it.
        self._outline = fans(self) if "pressure" in self.numbers else ({}, [])

    def _check(self) -> None:
        """Raise ValueError for names of nothing, ends that are joined twice, and loads that a floating network cannot bear."""
        for name, member in self.members.items():
            _known(f"members: {name}: section", member.section, self.sections)
            if not 0 < member.length < math.inf:
                raise ValueError(f"members: {name}: length = {member.length:g} must be positive")
        taken: set[tuple[str, str]] = set()
        for name, joint in self.joints.items():
            for each in joint.members:
                _known(f"joints: {name}: member", each.member, self.members)
                if (each.member, each.end) in taken:
                    raise ValueError(f"joints: {name}: {self.said(each)!r} is joined twice; name it in one joint only")
                taken.add((each.member, each.end))
        for name in self.held:
            _known("held", name, self.joints)
        for number, load in self.loads.items():
            for joint_name, *_ in (*load.forces, *load.followers):
                _known(f"loads: {number}: joint", joint_name, self.joints)
            for joint_name, _ in load.moments:
                if joint_name not in self.held or self.held[joint_name].rotation not in (HINGED, JOINT):
                    raise ValueError(
                        f"loads: {number}: moments: {joint_name} must be held by a hinge; elsewhere a dead moment has no energy"
                    )
        if self.numbers.get("foundation", 0.0) < 0:
            raise ValueError(f"numbers: foundation = {self.numbers['foundation']:g} must not be negative")
        if self.roller and len(self.members) > 1:
            raise ValueError("roller: is for a single strip; hold a joint along it")
        if self.floats:
            for name in ("weight", "foundation"):
                if name in self.numbers:
                    raise ValueError(f"{name}: nothing is held, so nothing bears it; hold a joint")
            for number, load in self.loads.items():
                if load.followers:
                    raise ValueError(f"loads: {number}: nothing is held, so nothing bears forces that follow; hold a joint")
                total = np.sum([direction for _, direction, _ in load.forces], axis=0)
                if np.linalg.norm(total) > LOOSE:
                    raise ValueError(f"loads: {number}: nothing is held, so its forces must add up to zero; hold a joint")

    # --- names ----------------------------------------------------------------------------------------------------------

    @property
    def floats(self) -> bool:
        """Whether nothing is held."""
        return not self.held

    @property
    def known(self) -> tuple[str, ...]:
        """Names of the numbers that can be given here, besides those of the sections."""
        return (*self._always, *POTENTIALS, FOLLOWER)

    @property
    def _always(self) -> tuple[str, ...]:
        """Names of the numbers that are there without being given."""
        angles = [each.angle for joint in self.joints.values() for each in joint.members if isinstance(each.angle, str)]
        strokes = [name for end in self.held.values() if isinstance(end, Support) for name, _ in end.strokes]
        return (*self._prescribed, *(["roller"] if self.roller else []), *strokes, *self.loads, *dict.fromkeys(angles))

    @property
    def _prescribed(self) -> tuple[str, ...]:
        """Names of the numbers that prescribe held joints."""
        return tuple(name for joint in self.held for name in self.numbers_at(joint) if name)

    def names_at(self, joint: str) -> tuple[str, ...]:
        """Return the names of the numbers for the place of a joint along the axes, then turn, bend and swing, were all held.

        They are '' where nothing moves its support.
        """
        end = self.held.get(joint)
        return (end.numbers or ("",) * 6) if isinstance(end, Support) else tuple(f"{joint}_{x}" for x in (*MOVES, *ANGLES))

    def numbers_at(self, joint: str) -> tuple[str, ...]:
        """Return the same for a joint that is held; '' where it is not."""
        end = self.held[joint]
        held = [*(any(parts) for parts in zip((0,) * 3, *end.held)), *[end.rotation != FREE] * 3]
        return tuple(name if has else "" for name, has in zip(self.names_at(joint), held))

    @functools.cached_property
    def parameters(self) -> dict[str, float]:
        """Names and values of all numbers that can be followed."""
        names = (*self._always, *(name for name in (*POTENTIALS, FOLLOWER) if name in self.numbers))
        values = {name: float(self.numbers.get(name, self._usual.get(name, 0.0))) for name in names}
        own = {
            self.full_name(name, number): value
            for name, section in self.sections.items() for number, value in section.parameters.items()
        }  # fmt: skip
        return values | own | dict.fromkeys(self._unstressed, 1.0)

    @property
    def _usual(self) -> Mapping[str, float]:
        """Values of numbers that are not given, where they are not zero."""
        return {}

    @property
    def _unstressed(self) -> dict[str, float]:
        """The numbers of the drawing without stress."""
        return {ASSEMBLY: 0.0} if self.assembles else {}

    @functools.cached_property
    def assembles(self) -> bool:
        """Whether the drawing is under stress, has gaps, turned ends or loads, so that `ASSEMBLY` leads from it to a state."""
        angles = [each.angle for joint in self.joints.values() for each in joint.members]
        acting = any(self.numbers.get(name) for name in (*self.loads, *POTENTIALS, FOLLOWER, *angles))
        drawn = [(self.sections[one.section], *each) for one in self.members.values() for each in zip(NATURAL, one.strains)]
        bent = any(name in one.along or abs(one.parameters.get(name, x) - x) > LOOSE for one, name, x in drawn)
        return acting or bent or bool(self._gaps) or any(angle and not isinstance(angle, str) for angle in angles)

    @property
    def _part(self) -> Callable:
        """Return the part of natural strains, loads and turns that acts, as a function of the numbers."""
        return _assembled if self.assembles else _whole

    def full_name(self, section: str, number: str) -> str:
        """Return the name of a number of a section among all."""
        return number if len(self.sections) == 1 else f"{number}_{section}"

    def numbers_of(self, section: str, values: Mapping[str, float]) -> dict[str, float]:
        """Return the numbers of a section by their own names, from the values of all."""
        return {name: values[self.full_name(section, name)] for name in self.sections[section].parameters}

    def said(self, each: JointEnd) -> str:
        """Return an end in the words of a scene: 'beam start', and 'beam at 0.5' for one of the pieces 'beam 1', 'beam 2'."""
        name, _, number = each.member.partition(" ")
        lengths = [member.length for other, member in self.members.items() if other.partition(" ")[0] == name]
        before = int(number or 1) - (each.end == START)
        part = sum(lengths[:before]) / sum(lengths)
        return f"{name} at {part:.6g}" if 0 < before < len(lengths) else f"{name} {each.end}"

    def joint_at(self, each: JointEnd) -> str:
        """Return the name of the joint of an end, '' for one that is free."""
        of = ((name, one) for name, joint in self.joints.items() for one in joint.members)
        return next((name for name, one in of if (one.member, one.end) == (each.member, each.end)), "")

    # --- geometry of the drawing ----------------------------------------------------------------------------------------

    def drawn(self, each: JointEnd) -> np.ndarray:
        """Return quaternion and place (7,) of an end as it is drawn."""
        return self._drawn_ends[each.member, each.end]

    @functools.cached_property
    def _drawn_ends(self) -> dict[tuple[str, str], np.ndarray]:
        both = ((name, one, end) for name, one in self.members.items() for end in (START, FINISH))
        return {(name, end): one.drawn([0.0 if end == START else one.length])[0] for name, one, end in both}

    def drawn_axes(self, each: JointEnd) -> np.ndarray:
        """Return the directors of an end as it is drawn, as rows (3, 3)."""
        return axes_of(self.drawn(each))

    def drawn_place(self, joint: str) -> np.ndarray:
        """Return the place (3,) of a joint as it is drawn."""
        first = self.joints[joint].members[0]
        return at_arm(self.drawn(first), first.arm)

    @functools.cached_property
    def _gaps(self) -> dict[tuple[str, int], Vector]:
        """Gaps of the drawing: from the first end of a joint to each of the others, where there are any."""
        found = {}
        for name, joint in self.joints.items():
            places = [at_arm(self.drawn(each), each.arm) for each in joint.members]
            for number, place in enumerate(places):
                if np.linalg.norm(place - places[0]) > LOOSE:
                    found[name, number] = tuple(map(float, place - places[0]))
        return found

    # --- the problem ----------------------------------------------------------------------------------------------------

    @functools.cached_property
    def problem(self) -> contin.SegmentedVariationalProblem:
        """The variational problem, each member a segment; ProblemError for conditions that repeat or contradict others."""
        densities: dict[tuple, Callable] = {}
        segments, work, part = [], None, self._part

        def following(s, x, y, p):
            """Return the work of a pressure against the normal d2 of a strip at x, on another state."""
            return -part(p) * p.follower_pressure * sum(d * r for d, r in zip(directors(*x[:4])[3:6], y[4:7]))

        if FOLLOWER in self.numbers:
            work = following
        for place, (name, member) in enumerate(self.members.items()):
            homogeneous = self.sections[member.section].homogeneous
            differs = place if self.phases else None
            inside = None if homogeneous else (member.length, member.span)
            key = member.section, member.strains, inside, differs, self._outline[0].get(name)
            if key not in densities:
                densities[key] = self._hamiltonian(member, place)
            states, own = (*FRAME, *CENTRELINE, *self.integrals), {"hamiltonian": densities[key], "work": work}
            segments.append(contin.VariationalSegment(None, states, member.length, **own, functionals=self._functionals()))
        phases = list(self.integrals)[: len(self.phases)]
        return contin.SegmentedVariationalProblem(
            segments, self.parameters, ends=self._conditions(), end_energy=self._end_energy, sizes=self._sizes,
            phases=self._named(phases), end_work=self._end_work(), symmetries=self.symmetries, pushes=self.contacts,
            points=[*self.contacts],
        )  # fmt: skip

    @property
    def contacts(self) -> dict[int, str]:
        """Names of the supports that push and cannot pull, by the numbers of their conditions, which come first."""
        names = [name for name, end in self.held.items() if end.pushes]
        return dict(enumerate([*names, *(["roller"] if self.roller and self.roller.pushes else [])]))

    def _functionals(self) -> Mapping[str, Callable]:
        """Return integrals over each member that are columns of points."""
        return {}

    @property
    def integrals(self) -> dict[str, Phase | Roller]:
        """Conditions under integrals by the names of the states that accumulate them."""
        found = {f"phase_{phase.name or number}": phase for number, phase in enumerate(self.phases)}
        return found | ({"support": self.roller} if self.roller else {})

    def _named(self, states: Sequence[str]) -> list[str]:
        """Return the names of states of all members among all states."""
        count = len(self.members)
        return [f"{name}_{number}" if count > 1 else name for number in range(count) for name in states]

    @functools.cached_property
    def places(self) -> list[list[int]]:
        """Places of quaternion, centreline, and their multipliers (14) of each member among all states."""
        own = range(len(FRAME) + len(CENTRELINE))
        shift = len(own) + len(self.integrals)
        return [[*(piece.at[i] for i in own), *(piece.at[shift + i] for i in own)] for piece in self.problem.pieces]

    def _hamiltonian(self, member: Member, place: int) -> Callable:
        section, length, name = self.sections[member.section], member.length, member.section
        complementary, own = section.hamiltonian(), tuple(section.parameters)
        numbers, full = namedtuple("Numbers", own), [self.full_name(name, number) for number in own]
        homogeneous, potential = section.homogeneous, self._distributed(list(self.members)[place])
        integrals, count, part_of = list(self.integrals.values()), len(self.members), self._part
        drawn = {own.index(each): x for each, x in zip(NATURAL, member.strains) if each in own and each not in section.along}
        drawn = drawn if self.assembles else {}

        def hamiltonian(s, x, lam, p):
            q, n1, n2, n3 = x[:4], *lam[4:7]
            M1, M2, M3 = moment_of(q, lam[:4])
            d = directors(*q)
            values = [getattr(p, each) for each in full]
            part = part_of(p)
            for number, strain in drawn.items():
                values[number] = part * values[number] + (1 - part) * strain
            value = complementary(0.0 if homogeneous else member.part(s / length), M1, M2, M3, numbers(*values))
            value = value + n1 * d[6] + n2 * d[7] + n3 * d[8] - part * potential(x, d, p)
            for integral, multiplier in zip(integrals, lam[7:]):
                value = value + multiplier * integral.density(place, s / length, x, p, count) / length
            return value

        return hamiltonian

    def _distributed(self, member: str) -> Callable:
        """Return the potential per length of weight, pressure and field, as a function of (x, directors, p)."""
        fan, couple = self._outline[0].get(member), "field" in self.numbers
        weight = loads.distributed(
            self.weight_direction if "weight" in self.numbers else None,
            self.foundation_direction if "foundation" in self.numbers else None, self.ground,
        )  # fmt: skip
        normal, along, first = self.pressure_normal, self.field_direction, 3 * self.magnetized

        def potential(x, d, p):
            value = weight(x, p)
            if fan is not None:
                arm = [place - centre for place, centre in zip((x.x1, x.x2, x.x3), fan[1])]
                value = value + fan[0] * p.pressure * ends.along(normal, ends.cross(arm, d[6:9])) / 2
            if couple:
                value = value - p.field * ends.along(along, d[first : first + 3])
            return value

        return potential

    @property
    def ground(self) -> float:
        """Where the plane of the foundation is along its direction."""
        return float(np.dot(self.foundation_direction, self.drawn_place(next(iter(self.held))))) if self.held else 0.0

    def _conditions(self) -> Callable:
        """Return what vanishes at the ends."""
        joints = list(self.joints.items())
        held = [(name, *self._prescribing(name, end)) for name, end in self.held.items()]
        floating = self._floating() if self.floats else None
        holding, begins = [each.holds for each in self.integrals.values()], self.begins
        pushing, side = [name for name, end in self.held.items() if end.pushes], self.roller.pushes if self.roller else 0
        gaps, readers = self._gaps, {name: self._reader(joint) for name, joint in self.joints.items()}

        def conditions(a, b, p):
            found, pushed = [_unit(x) for number, x in enumerate(a) if number not in begins.values()], []
            for name, joint in joints:
                (first, origin), *others = readers[name](a, b, p)
                before = first
                for number, (frame, place) in enumerate(others, 1):
                    gap = gaps.get((name, number))
                    apart = [x - y for x, y in zip(place, origin)]
                    found += apart if gap is None else [x - (1 - p.assembly) * y for x, y in zip(apart, gap)]
                    goes_on = joint.members[number].goes_on
                    found += _together(RIGID if goes_on else joint.kind, joint.axis, before if goes_on else first, frame)
                    before = frame
            for name, frame_of, place_of, rotation, position in held:
                frame, place = readers[name](a, b, p)[0]
                if name in begins:  # a frame that does not move is fixed by four numbers
                    fixed = rotation(frame, _UNTURNED)
                    found += [frame[0] - 1, *frame[1:]] if len(fixed) == 3 else [*fixed, _unit(a[begins[name]])]
                else:
                    found += rotation(frame, frame_of(p))
                (pushed if name in pushing else found).extend(position(place, place_of(p)))
            found += [x[number] for number, _ in enumerate(holding, 7) for x in a]
            sums = [sum(x[number] for x in b) for number, holds in enumerate(holding, 7) if holds]
            if side:
                pushed.append(side * sums.pop())
            return [*pushed, *found, *sums, *(floating(a) if floating else [])]

        return conditions

    @property
    def begins(self) -> dict[str, int]:
        """Supports without numbers at the beginning of a member that is drawn on the axes, and the number of that member."""
        order, found = list(self.members), {}
        for name, end in self.held.items():
            first = self.joints[name].members[0]
            plain = first.end == START and first.angle == 0 and numbers_of(self.drawn(first)[:4]) == _UNTURNED
            if plain and isinstance(end, Support) and not end.numbers:
                found[name] = order.index(first.member)
        return found

    def _reader(self, joint: Joint) -> Callable:
        """Return ``read(a, b, p)``: joint frame and place of each end of a joint."""
        order = list(self.members)
        known = [(order.index(each.member), each, numbers_of(self.drawn(each)[:4])) for each in joint.members]
        part = self._part

        def read(a, b, p):
            found = []
            for number, each, drawn in known:
                x = (a if each.end == START else b)[number]
                found.append((joint_frame(x[:4], drawn, each, p, part(p)), _moved(x, each.arm)))
            return found

        return read

    def _prescribing(self, name: str, end: End) -> tuple[Callable, Callable, Callable, Callable]:
        """Return prescribed frame and place of a joint as functions of p, and the conditions for both."""
        names, (drawn, strokes) = self.numbers_at(name), self._from(name)

        def frame_of(p):
            return ends.prescribed(*(getattr(p, angle) for angle in names[3:])) if names[5] else _UNTURNED

        def place_of(p):
            place = [float(x) + (getattr(p, each) if each else 0) for x, each in zip(drawn, names)]
            for number, direction in strokes:
                place = [x + getattr(p, number) * part for x, part in zip(place, direction)]
            return place

        def place_conditions(r, r1):
            return tuple(ends.along(vector, [a - b for a, b in zip(r, r1)]) for vector in end.held)

        return frame_of, place_of, ends.rotation_conditions(end), place_conditions

    def _from(self, joint: str) -> tuple[Sequence[float], Sequence[tuple[str, Vector]]]:
        """Return the place from which displacements of a joint count, and the strokes that add to them."""
        end = self.held.get(joint)
        origin, strokes = (end.origin, end.strokes) if isinstance(end, Support) else (None, ())
        return self.drawn_place(joint) if origin is None else origin, strokes

    @functools.cached_property
    def prescriptions(self) -> dict[str, tuple[Callable, Callable]]:
        """Prescribed frame and place of each joint that is held, as functions of the numbers."""
        return {name: self._prescribing(name, end)[:2] for name, end in self.held.items()}

    def _floating(self) -> Callable:
        """Return the conditions that hold the rigid motions of a network that floats, at the first end of the first member."""
        drawn, axes = numbers_of(next(iter(self.members.values())).drawn([0.0])[0]), self._free_turns

        def conditions(a):
            turned = _from_drawing(a[0][:4], drawn[:4])[1:]
            return [x - y for x, y in zip(a[0][4:7], drawn[4:])] + [ends.along(axis, turned) for axis in axes]

        return conditions

    @property
    def _free_turns(self) -> list[Vector]:
        """Axes about which the network can turn with the same loads: all, one, or none. A pressure holds its plane."""
        fixed = [direction for load in self.loads.values() for _, direction, _ in load.forces]
        fixed += [self.field_direction] if "field" in self.numbers else []
        if not fixed:
            return [(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)]
        first = ends.unit("direction", fixed[0])
        parallel = all(np.linalg.norm(np.cross(first, ends.unit("direction", other))) < LOOSE for other in fixed)
        return [first] if parallel else []

    @functools.cached_property
    def _end_energy(self) -> Callable | None:
        """Return the potential of dead loads at joints and of a pressure at ends that slide, of (a, b, p); None without one."""
        if not self.loads and not self._outline[1]:
            return None
        slides = [
            (fan, self._reader(Joint([each])), self.prescriptions[name][1])
            for each, name, fan in self._outline[1]
        ]  # fmt: skip
        forces = []
        for number, load in self.loads.items():
            for name, direction, arm in load.forces:
                first = self.joints[name].members[0]
                on_directors = numbers_of(np.array(first.arm) + self.drawn_axes(first) @ np.array(arm, dtype=float))
                there = replace(self.joints[name], members=[replace(first, arm=on_directors)])
                forces.append((number, self._reader(there), direction))
        turns = [
            (number, factor, self._reader(self.joints[name]), ends.angle_of(end), self.prescriptions[name][0])
            for number, load in self.loads.items() for name, factor in load.moments for end in (self.held[name],)
        ]  # fmt: skip
        part_of = self._part

        def potential(a, b, p):
            value, part = 0.0, part_of(p)
            for number, read, direction in forces:
                place = read(a, b, p)[0][1]
                value = value - part * getattr(p, number) * ends.along(direction, place)
            for number, factor, read, angle, frame_of in turns:
                value = value - part * getattr(p, number) * factor * angle(read(a, b, p)[0][0], frame_of(p))
            for (sign, centre), read, place_of in slides:
                to, place = ([x - c for x, c in zip(r, centre)] for r in (place_of(p), read(a, b, p)[0][1]))
                value = value - sign * part * p.pressure * ends.along(self.pressure_normal, ends.cross(to, place)) / 2
            return value

        return potential

    def _end_work(self) -> Callable | None:
        """Return the work of forces that follow, on other states; None without one."""
        loaded = [(number, *one) for number, load in self.loads.items() for one in load.followers]
        if not loaded:
            return None
        found = []
        for number, name, direction, arm in loaded:
            first = self.joints[name].members[0]
            own = tuple(numbers_of(self.drawn_axes(first) @ v) for v in (direction, arm))
            place, end = list(self.members).index(first.member), 0 if first.end == START else 1
            found.append((number, place, end, own[0], tuple(x + y for x, y in zip(first.arm, own[1]))))
        part_of = self._part

        def work(a, b, y_a, y_b, p):
            value, part = 0.0, part_of(p)
            for number, place, end, along, arm in found:
                here, moved = ((states[end][place]) for states in ((a, b), (y_a, y_b)))
                force = [x - y for x, y in zip(_moved(here, along), here[4:7])]
                value = value + part * getattr(p, number) * sum(x * y for x, y in zip(force, _moved(moved, arm)))
            return value

        return work

    # --- sizes ----------------------------------------------------------------------------------------------------------

    @property
    def force(self) -> float:
        """The size of forces: the smallest stiffness over the square of the length of the longest strip."""
        return self._sizes["lam_x1" if len(self.members) == 1 else "lam_x1_0"]

    @property
    def longest(self) -> float:
        """The length of the longest strip, with all of its pieces."""
        lengths: Counter[str] = Counter()
        for name, member in self.members.items():
            lengths[name.partition(" ")[0]] += member.length
        return max(lengths.values())

    @property
    def gaps(self) -> dict[str, float]:
        """The largest gap of the drawing at each joint that has one."""
        found: dict[str, float] = {}
        for (name, _), gap in self._gaps.items():
            found[name] = max(found.get(name, 0.0), math.hypot(*gap))
        return found

    @property
    def _sizes(self) -> dict[str, float]:
        """Sizes of states and numbers: what is small in a first state, or round-off, is not small by its nature.

        Places have the size of the longest strip L, forces and moments B/L^2 and B/L with the smallest stiffness B.
        """
        stiffness = [
            self.parameters[self.full_name(name, number)]
            for name, section in self.sections.items() for number in section.stiffnesses
        ]  # fmt: skip
        length = self.longest
        moment = min(stiffness, default=1.0) / length
        force = moment / length
        own = set(self._of_sections)
        found = {name: 1.0 for name in self.parameters if name not in own} | {"sigma": max(force, moment)}
        found |= dict.fromkeys([name for joint in self.held for name in self.numbers_at(joint)[:3] if name], length)
        found |= dict.fromkeys(self.loads, force)
        found |= dict.fromkeys([name for name in (*POTENTIALS, FOLLOWER) if name in found], force / length)
        if "foundation" in found:
            found["foundation"] = force / length**2
        for number in range(len(self.members)):
            behind = f"_{number}" if len(self.members) > 1 else ""
            for names, size, push in ((FRAME, 1.0, moment), (CENTRELINE, length, force), (self.integrals, 1.0, force)):
                found |= {f"{name}{behind}": size for name in names} | {f"lam_{name}{behind}": push for name in names}
        return found

    @property
    def _of_sections(self) -> list[str]:
        """Names of all numbers of the sections."""
        return [self.full_name(name, number) for name, section in self.sections.items() for number in section.parameters]


def _unit(x):
    """Return what vanishes for a unit quaternion."""
    return x.q0 * x.q0 + x.q1 * x.q1 + x.q2 * x.q2 + x.q3 * x.q3 - 1


def _assembled(p):
    return p.assembly


def _whole(p):
    return 1


def _known(what: str, name: str, names: Mapping) -> None:
    """Raise ValueError for a name of nothing."""
    if name not in names:
        raise ValueError(f"{what}: {one_of(name, names)}")


def _together(kind: str, axis: Vector, first, frame) -> list:
    """Return what vanishes where two joint frames are together."""
    if kind == BALL:
        return []
    turned = ends.relative(frame, first)[1:]
    if kind == RIGID:
        return list(turned)
    return [ends.along(vector, turned) for vector in ends.perpendicular(ends.unit("axis", axis))]


def _from_drawing(q, drawn: tuple) -> tuple:
    """Return q conj(q0) of an end that is drawn with the quaternion q0."""
    return tuple(q) if drawn == _UNTURNED else product(q, (drawn[0], *(-x for x in drawn[1:])))


def joint_frame(q, drawn: tuple, each: JointEnd, p, part) -> tuple:
    """Return J, the same less that part of the angle by which the end is turned before it is joined."""
    frame = _from_drawing(q, drawn)
    if each.angle == 0:
        return frame
    half = part * (getattr(p, each.angle) if isinstance(each.angle, str) else each.angle) / 2
    return product(frame, (math.cos(half), *(-math.sin(half) * part for part in each.axis)))


def axes_of(state: np.ndarray) -> np.ndarray:
    """Return the directors of a state that begins with the quaternion, as rows (3, 3)."""
    return np.array(directors(*state[:4])).reshape(3, 3)


def _moved(x, arm: Vector) -> list:
    """Return the place at the end of an arm that is fixed on the directors."""
    d = directors(*x[:4]) if any(arm) else ()
    return [x[4 + i] + sum(arm[j] * d[3 * j + i] for j in range(3) if arm[j] != 0) for i in range(3)]


def at_arm(state: np.ndarray, arm: Vector) -> np.ndarray:
    return np.array(_moved(list(map(float, state)), arm))
