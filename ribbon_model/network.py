"""Networks: strips that meet at joints, under loads, as one variational problem.

Members are drawn first: each begins at a place with a frame, and has constant strains (none: it is straight). The state of a
member is the quaternion q of its frame and its centreline r, as that of an open strip (`ribbon_model.open_strip`). With the
drawn frame q0 of an end, its joint frame is

    J = q conj(q0),

the identity as it is drawn. A rigid joint keeps the joint frames and the places of its ends together, a hinge about an axis e
keeps J e together, a ball joint the places only. An end may be turned by an angle about an axis before it is joined, and
joined at an arm, fixed on its directors. What several members share balances there (`contin.SegmentedVariationalProblem`), and
the index is that of the whole network.

A network that is held nowhere floats: those rigid motions are held that leave all loads as they are. The reactions to that are
zero, which is a check (`Network.reactions`).
"""

from __future__ import annotations

import functools
import itertools
import math
import re
from collections import Counter, namedtuple
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import SimpleNamespace
from typing import Any, ClassVar

import numpy as np

import contin
from contin import ContinError, ConvergenceError, Point, ProblemError, solve, trace
from contin.lowlevel import Collocation, Continuation, Label, Undetermined, levels, locate_branch_point, point_of
from ribbon_model import ends, law_end, loads
from ribbon_model.ends import ANGLES, FREE, HINGED, JOINT, LOOSE, End, Roller, Support, Vector, product
from ribbon_model.equilibrium import CENTRELINE, FRAME, directors, moment_of, moment_on_axes, strains_of
from ribbon_model.members import BALL, FINISH, HINGE, RIGID, START, Joint, JointEnd, Load, Member, numbers_of, straight
from ribbon_model.outlines import fans
from ribbon_model.phases import PHASES, Phase, phase_along
from ribbon_model.section import NATURAL, Section
from ribbon_model.shape import Shape, shape_of

__all__ = ["BALL", "FINISH", "HINGE", "RIGID", "START", "Joint", "JointEnd", "Load", "Member", "Network", "straight"]
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
#: Why a state is not determined; before it, what moves.
MECHANISM = (
    "can move, or turn about itself, without a change of energy, so nothing determines the state; hold more, or join rigidly"
)
#: The same of a network that is held too little.
LOOSELY_HELD = "held: the network can move as a rigid body without resistance; hold more places or rotations"
#: A frame that is not turned.
_UNTURNED = (1.0, 0.0, 0.0, 0.0)
#: Why forces are not determined.
UNDETERMINED = (
    "joints: what is joined and held repeats itself in this state, so the forces are not determined (straight strips between "
    "places that are held cannot lengthen); draw a strip with a bend, or hold less"
)
#: Most phases: a strip can shift and turn about itself.
_MOST_PHASES = 2
#: The mesh of first states: a coarse one has solutions that are none.
_MESH = contin.MeshControl(1e-9, max_intervals=200)
#: Most points of the way from the drawing without stress. Where a gap cannot close, forces grow without end: 60 points of a
#: portal took 9 s, 200 more than two minutes.
_MOST = 60
#: Strips move in a mode if they move by more than this part of its largest displacement.
_MOVES = 1e-3
#: A state that Newton's method finds is that of the drawing if it is nearer than this; others may be anywhere.
_NEAR = 0.3


class OutOfReach(ProblemError):
    """A drawing from which no state was found, though one may be there; ``nearest`` is how near it was brought to one."""

    nearest: Point


@dataclass
class Network:
    """Strips that meet at joints.

    Attributes
    ----------
    sections : mapping of str to Section
        With several of them, the numbers of each have its name behind theirs: ``kappa_n_beam``. Unit of length is any; the unit
        of stiffness is a bending modulus, as in `ribbon_model.section`.
    members : mapping of str to Member
    joints : mapping of str to Joint
        Ends that belong to no joint are free.
    held : mapping of str to End
        What is held at joints, on the axes of the drawing. The displacement of joint ``A`` is prescribed by the numbers
        ``A_dx``, ``A_dy``, ``A_dz``, its rotation by ``A_turn``, ``A_bend``, ``A_swing``, as far as they are held; a `Support`
        gives them other names.
    loads : mapping of str to Load
        By the name of the number.
    numbers : mapping of str to float
        Values of loads and prescribed numbers, and of angles that joints name; zero where nothing is given. ``weight``: per
        length; ``foundation``: stiffness per length against displacements from a plane through the first joint that is held;
        ``pressure``: per length of a strip that bends in a plane; ``field``: couple per length.
    weight_direction, foundation_direction, pressure_normal, field_direction : tuple of float
        Where the weight pulls to; the normal of the plane from which the foundation holds; that of the plane in which members
        go around an area, counterclockwise, on which the pressure acts from outside; the direction of a uniform field.
        ``follower_pressure``: per length, against the normal of each strip, wherever it points to; without an energy.
    magnetized : int
        The number (0, 1, 2) of the director along which strips are magnetized.
    phases : sequence of Phase or str
        Of a network that can shift along itself (`with_phases`, `with_waves`); of one strip, also names of `phases.PHASES`.
    roller : Roller, optional
        A support along the only strip, which begins at the origin; its number is ``roller``.
    symmetries : mapping of str to callable
        As in `contin.SegmentedVariationalProblem`.

    Raises
    ------
    ValueError
        One sentence.

    Examples
    --------
    Two half circles, rigidly joined to a ring, buckle under a pressure of n**2 - 1 = 3 in their plane:

    >>> import contin
    >>> from ribbon_model.laws import ROD
    >>> rod = Section(ROD, {"B1": 1.0, "B2": 50.0, "C": 50.0, "kappa_n": 1.0})
    >>> half = Member("strip", math.pi, strains=(1.0, 0.0, 0.0))
    >>> other = half.followed_by("strip", math.pi, half.strains)
    >>> joints = {"P": Joint([JointEnd("a", FINISH), JointEnd("b")]), "Q": Joint([JointEnd("b", FINISH), JointEnd("a")])}
    >>> ring = Network({"strip": rod}, {"a": half, "b": other}, joints, numbers={"pressure": 0.0})
    >>> circle, how = ring.first_point()
    >>> branch = trace(circle, free=["pressure"], limits={"pressure": (0, 4)})
    >>> [(round(point["pressure"], 9), point.index_change) for point in branch.labelled("BP")]
    [(3.0, (0, 2))]
    """

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
                raise ValueError(f"phases: {name!r} must be one of {', '.join(PHASES)}, for one strip")
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

    # --- names --------------------------------------------------------------------------------------------------------

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

    # --- geometry of the drawing --------------------------------------------------------------------------------------

    def drawn(self, each: JointEnd) -> np.ndarray:
        """Return quaternion and place (7,) of an end as it is drawn."""
        return self._drawn_ends[each.member, each.end]

    @functools.cached_property
    def _drawn_ends(self) -> dict[tuple[str, str], np.ndarray]:
        both = ((name, one, end) for name, one in self.members.items() for end in (START, FINISH))
        return {(name, end): one.drawn([0.0 if end == START else one.length])[0] for name, one, end in both}

    def drawn_axes(self, each: JointEnd) -> np.ndarray:
        """Return the directors of an end as it is drawn, as rows (3, 3)."""
        return _axes(self.drawn(each))

    def drawn_place(self, joint: str) -> np.ndarray:
        """Return the place (3,) of a joint as it is drawn."""
        first = self.joints[joint].members[0]
        return _at_arm(self.drawn(first), first.arm)

    @functools.cached_property
    def _gaps(self) -> dict[tuple[str, int], Vector]:
        """Gaps of the drawing: from the first end of a joint to each of the others, where there are any."""
        found = {}
        for name, joint in self.joints.items():
            places = [_at_arm(self.drawn(each), each.arm) for each in joint.members]
            for number, place in enumerate(places):
                if np.linalg.norm(place - places[0]) > LOOSE:
                    found[name, number] = tuple(map(float, place - places[0]))
        return found

    # --- the problem --------------------------------------------------------------------------------------------------

    @functools.cached_property
    def problem(self) -> contin.SegmentedVariationalProblem:
        """The variational problem; its segments are the members, in their order.

        Raises
        ------
        ProblemError
            Conditions that repeat or contradict each other.
        """
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
            key = member.section, member.strains, None if homogeneous else member.length, differs, self._outline[0].get(name)
            if key not in densities:
                densities[key] = self._hamiltonian(member, place)
            segments.append(
                contin.VariationalSegment(
                    None, (*FRAME, *CENTRELINE, *self.integrals), member.length, hamiltonian=densities[key], work=work,
                    functionals=self._functionals(),
                )
            )  # fmt: skip
        phases = list(self.integrals)[: len(self.phases)]
        return contin.SegmentedVariationalProblem(
            segments, self.parameters, ends=self._conditions(), end_energy=self._end_energy, sizes=self._sizes,
            phases=self._named(phases), end_work=self._end_work(), symmetries=self.symmetries,
        )  # fmt: skip

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
            value = complementary(0.0 if homogeneous else s / length, M1, M2, M3, numbers(*values))
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
        holding, begins = [each.holds for each in self.integrals.values()], self._begins
        gaps, readers = self._gaps, {name: self._reader(joint) for name, joint in self.joints.items()}

        def conditions(a, b, p):
            found = [_unit(x) for number, x in enumerate(a) if number not in begins.values()]
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
                found += position(place, place_of(p))
            found += [x[number] for number, _ in enumerate(holding, 7) for x in a]
            found += [sum(x[number] for x in b) for number, holds in enumerate(holding, 7) if holds]
            return found + (floating(a) if floating else [])

        return conditions

    @property
    def _begins(self) -> dict[str, int]:
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
                found.append((_joint_frame(x[:4], drawn, each, p, part(p)), _moved(x, each.arm)))
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

        return frame_of, place_of, ends.rotation_conditions(end), ends.place_conditions(end)

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
        """Axes about which the whole network can turn without a change of the loads: all, one, or none.

        A pressure belongs to the plane, in which the network stays: its tilt is held.
        """
        fixed = [direction for load in self.loads.values() for _, direction, _ in load.forces]
        fixed += [self.field_direction] if "field" in self.numbers else []
        if not fixed:
            return [(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)]
        first = ends.unit("direction", fixed[0])
        parallel = all(np.linalg.norm(np.cross(first, ends.unit("direction", other))) < LOOSE for other in fixed)
        return [first] if parallel else []

    @functools.cached_property
    def _end_energy(self) -> Callable | None:
        """Return the potential of dead forces and moments at joints, as a function of (a, b, p); None without one.

        And that of a pressure at ends that slide.
        """
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
                forces.append(
                    (number, self._reader(replace(self.joints[name], members=[replace(first, arm=on_directors)])), direction)
                )
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

    # --- first states -------------------------------------------------------------------------------------------------

    def guess(self) -> list[Callable]:
        """Return the drawing as a guess, one function of s for each member."""
        return [functools.partial(_drawn_at, member) for member in self.members.values()]

    def padded(self, guess: Any) -> Any:
        """Return a guess of quaternion and centreline, in a form of `contin.solve`, with zeros for integral conditions."""
        count, more = len(FRAME) + len(CENTRELINE), np.zeros(len(self.integrals))
        if isinstance(guess, Point):
            return guess
        if callable(guess):
            return lambda s: np.append(guess(s)[:count], more)
        if isinstance(guess, list):
            return [self.padded(begun) if callable(begun) else np.append(begun[:count], more) for begun in guess]
        return guess[0], np.hstack([guess[1][:, :count], np.tile(more, (len(guess[0]), 1))])

    def first_point(
        self, guess=None, values: Mapping[str, float] | None = None, intervals=10, degree=6, **options
    ) -> tuple[Point, str]:
        """Return a first state, and how it was found, in words.

        Newton's method begins with the drawing, or with a guess. Where that fails, it begins with the drawing as a natural
        state without loads; then natural strains, loads, gaps and turns follow step by step.

        Raises
        ------
        OutOfReach
            No state was found; `ribbon_model.network_first` has a further way.
        ProblemError
            Nothing determines the state.
        """
        self._check_reach()
        options = {"intervals": intervals, "degree": degree, **options}
        is_drawn = guess is None
        guess = self.guess() if is_drawn else guess
        first: ContinError | None = None
        try:
            point = self.state_near(guess, values, **options)
            if not self.assembles or self._moved_by(point, guess) < _NEAR:
                return point, "from the drawing"
        except ContinError as error:
            first = error
        if is_drawn and (told := self._undetermined()):
            raise ProblemError(self.with_advice(told, guess, values or {}, options)) from first
        try:
            drawn = self.state_near(guess, {**(values or {}), **self._unstressed}, **options)
        except ContinError as error:
            reason = self.law_at(guess) or self.with_advice(self.reason(error), guess, values or {}, options)
            raise ProblemError(reason) from first
        way = trace(drawn, free=[ASSEMBLY], limits={ASSEMBLY: (0, 1)}, branch_points=False, progress=False, max_points=_MOST)
        if abs(way[-1][ASSEMBLY] - 1) > LOOSE:
            nearest = max(way, key=lambda point: point[ASSEMBLY])
            left = [f"{(1 - nearest[ASSEMBLY]) * size:.3g} at {name}" for name, size in self.gaps.items()]
            reason = OutOfReach(
                f"joints: from the drawing without stress, natural strains, loads and gaps could be followed to "
                f"{nearest[ASSEMBLY]:.3g} of the way; draw the network nearer to a state"
                + (f" (gaps are left of {', '.join(left)})" if left else "")
            )
            reason.nearest = nearest
            raise reason
        try:
            point = solve(self.problem, way[-1])
            self.check_determined(point)
            return point, "from the drawing without stress, step by step"
        except ContinError as error:  # the way has come there: what fails is the matrix
            raise ProblemError(self.with_advice(self._mechanism(way[-1]), guess, values or {}, options)) from error

    def _check_reach(self) -> None:
        """Raise ProblemError for joints that are held farther apart than the strips between them are long."""
        numbers = SimpleNamespace(**self.parameters)
        places = {name: np.array(place_of(numbers)) for name, (_, place_of) in self.prescriptions.items()}
        ends_of = [(name, each) for name, joint in self.joints.items() for each in joint.members]
        arms = {(each.member, each.end): (name, float(np.linalg.norm(each.arm))) for name, each in ends_of}
        both = [(arms.get((name, START)), arms.get((name, FINISH)), one.length) for name, one in self.members.items()]
        pairs = [(a[0], b[0], a[1] + length + b[1]) for a, b, length in both if a and b]
        for first in self.held:
            reach = {first: 0.0}
            for _ in self.joints:  # shortest ways along strips
                for a, b, length in pairs:
                    for one, other in ((a, b), (b, a)):
                        if one in reach:
                            reach[other] = min(reach.get(other, math.inf), reach[one] + length)
            for name in self.held:
                fixed = [np.array(self.held[joint].held).reshape(-1, 3) for joint in (first, name)]
                free = np.hstack([np.eye(3) - np.linalg.pinv(rows) @ rows for rows in fixed])  # where they slide to
                away = places[name] - places[first]
                apart = float(np.linalg.norm(away - free @ np.linalg.lstsq(free, away, rcond=None)[0]))
                if apart > reach.get(name, math.inf) * (1 + LOOSE):
                    raise ProblemError(
                        f"held: {first} and {name} are {apart:.4g} apart, and the strips between them {reach[name]:.4g} long; "
                        "draw longer strips, or hold less"
                    )

    def _undetermined(self) -> str:
        """Return what nothing determines in the drawing without stress, or which law has no value there; '' if all is well."""
        other, problem = self, self.problem
        if told := self.law_at(self.guess()):
            return told
        if not problem.has_index:
            loads = {name: replace(load, followers=()) for name, load in self.loads.items()}
            other = replace(self, loads=loads, numbers={name: x for name, x in self.numbers.items() if name != FOLLOWER})
            problem = other.problem
        values = {**problem.parameters, **other.parameters, **other._unstressed}
        system = problem.discretized(problem.multipliers, values, None, np.linspace(0, 1, 11), 4)
        states = np.zeros((len(system.nodes), len(problem.state_names)))
        for member, places in zip(self.members.values(), other.places):
            states[:, places[:7]] = member.drawn(member.length * system.nodes)
        drawing = point_of(system, system.pack(states, values))
        try:
            return "" if drawing.second_variation().is_determined else other._mechanism(drawing)
        except ProblemError as error:
            return self.undetermined if Undetermined.CONDITIONS in str(error) else ""

    #: Why forces or states are not determined, and what a first state is near to, in words.
    undetermined: ClassVar[str] = UNDETERMINED
    neutral: ClassVar[str] = MECHANISM
    near: ClassVar[tuple[str, str, str]] = ("the drawing", "the drawing", "another drawing")

    def law_at(self, guess: Any) -> str:
        """Return that a law has no value at a guess, in a sentence; '' where it has, or where the guess is a point."""
        t = np.linspace(0, 1, 401)
        if isinstance(guess, Point):
            return ""
        if isinstance(guess, tuple):
            t, frames = guess[0], [guess[1]]
        else:
            begun = zip(guess if isinstance(guess, list) else [guess], self.members.values())
            frames = [np.array([one(member.length * s) if callable(one) else one for s in t]) for one, member in begun]
        for (name, member), states in zip(self.members.items(), frames):
            if told := law_end.at_guess(self.sections[member.section], t, states[:, :4]):
                return f"strips: {name.partition(' ')[0]}: {told}"
        return ""

    def reason(self, error: Exception) -> str:
        """Return why no state was found, in the words of networks."""
        if isinstance(error, ConvergenceError):
            return self._not_found()
        return self.undetermined if Undetermined.CONDITIONS in str(error) else str(error)

    def _not_found(self) -> str:
        """Return that no first state was found, and which numbers may be nearer to where one is known."""
        guess, known, another = self.near
        far = [name for name in self._prescribed if abs(self.parameters[name] - self._usual.get(name, 0.0)) > LOOSE]
        acting = [name for name in self.acting if self.parameters[name] != 0]
        nearer = [f"smaller loads ({', '.join(acting)})"] if acting else []
        nearer += [f"{', '.join(far)} nearer to {known}"] if far else []
        if self.closed:  # its place and turn are what makes it closed
            stiff = "a softness (1, say)" if any(one.constrained for one in self.sections.values()) else "B2 nearer to B1"
            nearer = [*nearer[: len(acting) > 0], stiff]
        first = f"begin with {' and '.join(nearer)}, and follow them in a stage; or " if nearer else ""
        return f"no equilibrium was found near {guess}; {first}begin with {another}"

    @property
    def acting(self) -> list[str]:
        """Names of the loads."""
        return [*self.loads, *(name for name in (*POTENTIALS, FOLLOWER) if name in self.numbers)]

    @property
    def closed(self) -> bool:
        """Whether there is a single strip, whose ends are joined."""
        both = [self.joint_at(JointEnd(name, end)) for name in self.members for end in (START, FINISH)]
        return len(both) == 2 and both[0] == both[1] != ""

    def with_advice(self, reason: str, guess: Any, values: Mapping[str, float], options: Mapping[str, Any]) -> str:
        """Return the reason why nothing determines the state of one strip, with the fewest phases that do: all are tried."""
        others = [name for name, phase in PHASES.items() if phase not in self.phases]
        apt = len(self.members) == 1 and (reason.endswith(self.neutral) or reason == self._not_found())
        for count in range(1, _MOST_PHASES - len(self.phases) + 1) if apt else ():
            fits = [names for names in itertools.combinations(others, count) if self._fits(names, guess, values, options)]
            if fits:
                more = "further phases" if self.phases else "phases"
                return f"{reason}, or give {more}: {' or '.join(str([*names]) for names in fits)}"
        return reason

    def _fits(self, names: Sequence[str], guess: Any, values: Mapping[str, float], options: Mapping[str, Any]) -> bool:
        """Return whether phases determine the state near a guess, and hold by symmetry: their multipliers vanish."""
        other = self.phased((*self.phases, *names))
        if isinstance(guess, Point):
            guess = guess.system.nodes, guess.system.states(guess.x)
        try:
            point = solve(other.problem, other.padded(guess), values, **options)
            other.check_determined(point)
        except ContinError:
            return False
        return not point.phase_loads()

    def phased(self, phases: Sequence[str | Phase]) -> Network:
        """Return the network with these phases."""
        return replace(self, phases=phases)

    def check_determined(self, point: Point) -> None:
        """Raise ProblemError where something can move without a change of energy, if there is one, or forces are not known."""
        if not self.problem.has_index:
            return
        try:
            if point.second_variation().is_determined:
                return
        except ProblemError as error:
            if Undetermined.MODE not in str(error):
                raise ProblemError(self.reason(error)) from error
        raise ProblemError(self._mechanism(point))

    def _mechanism(self, point: Point) -> str:
        """Return which strips move without a change of energy in a state."""
        if not self.floats and self.moves_rigidly(point.system.states(point.x), point.parameters):
            return LOOSELY_HELD
        if not self.problem.has_index:
            return f"joints: the network {MECHANISM}"
        variation = point.second_variation()
        sizes = np.abs(variation.eigenvalues)
        count = max(1, int(np.count_nonzero(sizes < levels.LOCATED * sizes.max())))
        if self.is_idle and count == 3 - len(self._free_turns):
            return (
                f"loads: a network that floats is turned by its loads, and {' = '.join(self.turning)} = 0 does not determine "
                f"how; begin with another value, as in numbers: {{{self.turning[0]}: {self.force / 1000:.1g}}}"
            )
        modes = variation.modes(count, np.linspace(0, 1, 21))[:, :, [places[:7] for places in self.places]]
        moved = np.abs(modes / ([1.0] * 4 + [self.longest] * 3)).max(axis=(0, 1, 3))
        names = dict.fromkeys(name.partition(" ")[0] for name, x in zip(self.members, moved) if x > _MOVES * moved.max())
        return f"joints: {', '.join(names)} {MECHANISM}"

    def moves_rigidly(self, known: np.ndarray, values: Mapping[str, float]) -> bool:
        """Return whether a rigid motion violates no condition at the ends of states (K, ...), in the problem's order."""
        problem = self.problem
        n, batch = problem.dimension, problem.batch("boundary")
        states = np.zeros((2, len(batch.signature.states)))
        states[:, : known.shape[1]] = known[[0, -1]]
        p = np.array([float(values.get(name, value)) for name, value in problem.parameters.items()])
        jacobian = batch.jacobian(np.zeros(1), states[:1], states[1:], p, batch.columns([]))[1][0]
        count = len(problem.canonical.fixed[0]) + len(problem.canonical.fixed[1]) + problem.canonical.sigmas
        by_ends = np.concatenate([jacobian[:count, :n], jacobian[:count, 2 * n : 3 * n]], axis=1)
        motions = np.zeros((6, 2, n))
        for end, at in itertools.product((0, 1), (places[:7] for places in self.places)):
            motions[:, end, at] = [_carried(states[end, at], k) for k in range(6)]
        return int(np.linalg.matrix_rank(by_ends @ motions.reshape(6, -1).T, tol=LOOSE)) < 6

    @property
    def turning(self) -> list[str]:
        """The numbers of loads that turn a network that floats."""
        return [name for name in (*self.loads, "field") if name in self.numbers or name in self.loads]

    @property
    def is_idle(self) -> bool:
        """Whether a network floats, and all that turns it is zero."""
        return self.floats and bool(self.turning) and not any(self.parameters[name] for name in self.turning)

    def lever(self, point: Point, name: str) -> np.ndarray:
        """Return the sum of f x^T (3, 3) over the forces f of a load, for a number of 1, at their places x in a state.

        Of a field, along which directors are turned, the integral over these.
        """
        if name in self.loads:
            at = [(where, np.array(f), self.joints[where].members[0], arm) for where, f, arm in self.loads[name].forces]
            return sum(np.outer(f, self.place(point, where) + self._arm(point, one, arm)) for where, f, one, arm in at)
        lengths = [member.length for member in self.members.values()]
        states = point.system.evaluate(point.x, np.linspace(0, 1, 101))
        axes = [np.mean([_axes(row[at])[self.magnetized] for row in states], axis=0) for at in self.places]
        return np.outer(self.field_direction, np.average(axes, axis=0, weights=lengths) * sum(lengths))

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

    def state_near(self, guess: object, values: Mapping[str, float] | None = None, **options: Any) -> Point:
        """Return the state that Newton's method finds from a guess.

        Raises
        ------
        ContinError
            There is none, or nothing determines it.
        """
        point = solve(self.problem, self.padded(guess), values, **{"mesh": _MESH, **options})
        self.check_determined(point)
        return point

    def with_phases(self, point: Point, nullity: int = 2, free: int = 1) -> tuple[Network, Point]:
        """Return the network with phases that hold neutral modes of a state, and the state as one of it.

        Parameters
        ----------
        point : Point
            A state of this network.
        nullity : int
            Number of its modes that cost no energy. Where a family of branches leaves, there are two.
        free : int
            Number of modes that are not held: with one of two, one branch of the family leaves.
        """
        variation, system = point.second_variation(), point.system
        at = np.array([places[:7] for places in self.places])

        def phase(number: int) -> Phase:
            states = functools.partial(system.evaluate, point.x)
            return phase_along(lambda t: variation.modes(nullity, t)[number][:, at], lambda t: states(t)[:, at])

        other = replace(self, phases=(*self.phases, *map(phase, range(free, nullity))))
        return other, other.restated(point)

    def with_waves(self, waves: int) -> Network:
        """Return the network with a phase of so many sine waves along all members, in their order, across the drawing."""
        ends = np.cumsum([0.0, *(member.length for member in self.members.values())])

        def drawn(t: np.ndarray) -> np.ndarray:
            return np.stack([member.drawn(member.length * t) for member in self.members.values()], axis=1)

        def mode(t: np.ndarray) -> np.ndarray:
            found = np.zeros((len(t), len(self.members), 7))
            q = drawn(t)[:, :, :4]
            across = np.array(directors(*np.moveaxis(q, 2, 0)))[:6].reshape(2, 3, *q.shape[:2]).sum(axis=0)
            angle = 2 * math.pi * waves * (ends[:-1] + np.multiply.outer(t, np.diff(ends))) / ends[-1]
            found[:, :, 4:] = np.moveaxis(across, 0, 2) * np.sin(angle)[:, :, None]
            return found

        return replace(self, phases=(*self.phases, phase_along(mode, drawn)))

    def restated(self, point: Point) -> Point:
        """Return a state of the same network with other phases as one of this; a branch point is located again.

        Raises
        ------
        ConvergenceError
            There is no branch point of this network.
        """
        old, multipliers = point.system, self.problem.multipliers
        states, names = old.states(point.x), old.problem.state_names
        found = [states[:, names.index(name)] if name in names else 0 * states[:, 0] for name in self.problem.state_names]
        values = {name: point.parameters.get(name, 0.0) for name in self.problem.parameters}
        free = [*(name for name in old.free if name not in old.problem.multipliers), *multipliers]
        system = self.problem.discretized(free, values, None, old.mesh, old.degree)
        x = system.pack(np.array(found).T, values)
        if point.label != Label.BRANCH_POINT:
            return point_of(system, x)
        branch_point = locate_branch_point(system, x)
        return replace(point_of(system, branch_point.x), label=Label.BRANCH_POINT, details=branch_point)

    def _moved_by(self, point: Point, guess: object) -> float:
        """Return by how much a state is away from a guess: quaternions, and places over the longest length."""
        if not isinstance(guess, list):
            return 0.0
        states, t, away = point.system.states(point.x), point.system.nodes, 0.0
        for member, places, begun in zip(self.members.values(), self.places, guess):
            drawn = np.array([np.asarray(begun(member.length * s) if callable(begun) else begun)[:7] for s in t])
            change = np.abs(states[:, places[:7]] - drawn) / np.repeat([1.0, self.longest], [4, 3])
            away = max(away, float(change.max()))
        return away

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
        found |= dict.fromkeys(self.loads, force) | dict.fromkeys(
            [name for name in (*POTENTIALS, FOLLOWER) if name in found], force / length
        )
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

    # --- where laws end -----------------------------------------------------------------------------------------------

    def _ends(self) -> list[tuple[Section, list[contin.Event]]]:
        """Return the section of each member, with the test function that ends a run where its law ends."""
        found = []
        for (name, member), places in zip(self.members.items(), self.places):
            section = self.sections[member.section]
            names = {number: self.full_name(member.section, number) for number in section.parameters}
            place = law_end.Place(functools.partial(self._strains_of, name), tuple(places), names)
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

    # --- what a state is ----------------------------------------------------------------------------------------------

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
        places = [f"{column(joint)}_{axis}" for joint in self.joints for axis in AXES]
        reactions = [f"{kind}_{joint}_{axis}" for joint in self.held for kind in "FM" for axis in AXES]
        return (*places, *reactions, *(["floating"] if self.floats else []))

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
        origin = _at_arm(self._state(point, first)[:7], first.arm)
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
                    moment -= self._part(numbers) * point[number] * factor * (np.array(self.held[name].axis) @ _axes(frame))
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
        return sign * (row[11:14] + fan / 2), sign * moment_on_axes(row[:4], row[7:11]), row[4:7]

    def place(self, point: Point, joint: str) -> np.ndarray:
        """Return the place (3,) of a joint."""
        first = self.joints[joint].members[0]
        return _at_arm(self._state(point, first)[:7], first.arm)

    def displacement(self, point: Point, joint: str) -> np.ndarray:
        """Return the displacement (3,) of a joint that its numbers prescribe, as far as it is held."""
        origin, strokes = self._from(joint)
        moved = sum((point.parameters.get(number, 0.0) * np.array(direction) for number, direction in strokes), np.zeros(3))
        return self.place(point, joint) - origin - moved

    def unbalanced(self, point: Point) -> str:
        """Return that reactions of a state are replaced by nothing, if other supports hold the network."""
        return (
            "the supports let go of what no load replaces: a dead force replaces that of a joint which is let go, a dead "
            "moment the one about the axis of its new hinge; bring other reactions to zero first"
        )

    def frame(self, point: Point, joint: str) -> tuple:
        """Return the quaternion of the joint frame, the identity in the drawing."""
        first = self.joints[joint].members[0]
        q, drawn = (numbers_of(state[:4]) for state in (self._state(point, first), self.drawn(first)))
        numbers = SimpleNamespace(**point.parameters)
        return _joint_frame(q, drawn, first, numbers, self._part(numbers))

    def _state(self, point: Point, each: JointEnd) -> np.ndarray:
        """Return quaternion, place, and their multipliers (14,) at an end."""
        number = list(self.members).index(each.member)
        return point.system.states(point.x)[0 if each.end == START else -1, self.places[number]]

    def _arm(self, point: Point, each: JointEnd, arm: Vector) -> np.ndarray:
        """Return an arm on the axes of the drawing, fixed on an end, as it has turned."""
        return (self.drawn_axes(each) @ np.array(arm, dtype=float)) @ _axes(self._state(point, each))

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
        raise ValueError(f"{what}: {name!r} must be one of {', '.join(names) or 'none: there are none'}")


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
    if drawn == _UNTURNED:
        return tuple(q)
    return product(q, (drawn[0], *(-x for x in drawn[1:])))


def _joint_frame(q, drawn: tuple, each: JointEnd, p, part) -> tuple:
    """Return J, the same less that part of the angle by which the end is turned before it is joined."""
    frame = _from_drawing(q, drawn)
    if each.angle == 0:
        return frame
    half = part * (getattr(p, each.angle) if isinstance(each.angle, str) else each.angle) / 2
    return product(frame, (math.cos(half), *(-math.sin(half) * part for part in each.axis)))


def _carried(state: np.ndarray, k: int) -> np.ndarray:
    """Return the change of quaternion and place (7,) by a rigid translation (k < 3) or rotation about the origin."""
    axis = np.eye(3)[k % 3]
    if k < 3:
        return np.append(np.zeros(4), axis)
    return np.append(product((0, *axis / 2), state[:4]), np.cross(axis, state[4:7]))


def _axes(state: np.ndarray) -> np.ndarray:
    """Return the directors of a state that begins with the quaternion, as rows (3, 3)."""
    return np.array(directors(*state[:4])).reshape(3, 3)


def _moved(x, arm: Vector) -> list:
    """Return the place at the end of an arm that is fixed on the directors."""
    d = directors(*x[:4]) if any(arm) else ()
    return [x[4 + i] + sum(arm[j] * d[3 * j + i] for j in range(3) if arm[j] != 0) for i in range(3)]


def _at_arm(state: np.ndarray, arm: Vector) -> np.ndarray:
    return np.array(_moved(list(map(float, state)), arm))


def _drawn_at(member: Member, s: float) -> np.ndarray:
    return member.drawn([s])[0]
