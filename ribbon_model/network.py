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
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import Any, ClassVar

import numpy as np

import contin
from contin import ContinError, ConvergenceError, Point, ProblemError, solve, trace
from contin.lowlevel import Label, Undetermined, levels, locate_branch_point, point_of
from ribbon_model import law_end
from ribbon_model.ends import LOOSE, product
from ribbon_model.equilibrium import CENTRELINE, FRAME, directors
from ribbon_model.members import BALL, FINISH, HINGE, RIGID, START, Joint, JointEnd, Load, Member, straight
from ribbon_model.network_states import States, column
from ribbon_model.phases import PHASES, Phase, phase_along
from ribbon_model.statement import ASSEMBLY, AXES, FOLLOWER, MOVES, POTENTIALS

__all__ = [
    "ASSEMBLY", "AXES", "BALL", "FINISH", "FOLLOWER", "HINGE", "MOVES", "POTENTIALS", "RIGID", "START", "Joint", "JointEnd",
    "Load", "Member", "Network", "column", "straight",
]  # fmt: skip
#: Why a state is not determined; before it, what moves.
MECHANISM = (
    "can move, or turn about itself, without a change of energy, so nothing determines the state; hold more, or join rigidly"
)
#: The same of a network that is held too little.
LOOSELY_HELD = "held: the network can move as a rigid body without resistance; hold more places or rotations"
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


class Network(States):
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
    >>> from ribbon_model.section import Section
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

    def guess(self) -> list[Callable]:
        """Return the drawing as a guess, one function of s for each member."""
        return [lambda s, member=member: member.drawn([s])[0] for member in self.members.values()]

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
        held = [name for name, end in self.held.items() if not end.pushes]  # what pushes only need not be reached
        for first in held:
            reach = {first: 0.0}
            for _ in self.joints:  # shortest ways along strips
                for a, b, length in pairs:
                    for one, other in ((a, b), (b, a)):
                        if one in reach:
                            reach[other] = min(reach.get(other, math.inf), reach[one] + length)
            for name in held:
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

    # --- why there is none ----------------------------------------------------------------------------------------------

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

    # --- loads, phases, supports ----------------------------------------------------------------------------------------

    @property
    def turning(self) -> list[str]:
        """The numbers of loads that turn a network that floats."""
        return [name for name in (*self.loads, "field") if name in self.numbers or name in self.loads]

    @property
    def is_idle(self) -> bool:
        """Whether a network floats, and all that turns it is zero."""
        return self.floats and bool(self.turning) and not any(self.parameters[name] for name in self.turning)

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

    def unbalanced(self, point: Point) -> str:
        """Return that reactions of a state are replaced by nothing, if other supports hold the network."""
        return (
            "the supports let go of what no load replaces: a dead force replaces that of a joint which is let go, a dead "
            "moment the one about the axis of its new hinge; bring other reactions to zero first"
        )


def _carried(state: np.ndarray, k: int) -> np.ndarray:
    """Return the change of quaternion and place (7,) by a rigid translation (k < 3) or rotation about the origin."""
    axis = np.eye(3)[k % 3]
    if k < 3:
        return np.append(np.zeros(4), axis)
    return np.append(product((0, *axis / 2), state[:4]), np.cross(axis, state[4:7]))
