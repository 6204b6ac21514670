"""An open strip (or a closed, twisted one) between two ends, under loads: a network of one member in the words of strips.

The length is 1, and so is B (`ribbon_model.section`); the first end is the origin, and its frame the axes. Conditions at the
ends: `ribbon_model.ends`. The reactions are the force and the moment that the supports and dead loads exert on the strip.
"""

from __future__ import annotations

import functools
import math
import warnings
from collections.abc import Callable, Mapping, Sequence
from types import SimpleNamespace
from typing import ClassVar

import numpy as np
from scipy.optimize import brentq  # type: ignore[import-untyped]

from contin import ContinError, ConvergenceError, Point, ProblemError, solve
from contin.lowlevel import Collocation, Undetermined, shown
from ribbon_model import ends, loads
from ribbon_model.ends import ANGLES, CLAMP, CLAMPED, DIRECTIONS, FREE, HINGED, JOINT, LOOSE, PLACE, End, Roller, Support
from ribbon_model.loads import FORCES, LOADS, STROKE
from ribbon_model.members import FINISH, Joint, JointEnd, Load, Member
from ribbon_model.network import Network
from ribbon_model.phases import PHASES, Phase
from ribbon_model.section import Section, natural_end, natural_states
from ribbon_model.shape import Shape

#: Why a state is not determined.
RIGID = "ends: the strip can move as a rigid body without resistance; hold more of its place or rotation"
UNHELD = (
    "ends: the strip can move, turn about itself or change its shape without a change of energy, so nothing determines its "
    "state; hold more"
)
#: Why reactions are not determined.
UNDETERMINED = (
    "ends: what is held there repeats itself in this state, so the reactions are not determined (a straight strip is held at "
    "its full length, or does not bend in its plane and is held sideways at both ends); begin with an arch, a twist or a "
    "softness, or hold less"
)
#: Columns of the reactions.
REACTIONS = tuple(
    f"{end}{what}_{direction}" for end in ("", "start_") for what in ("F", "M") for direction in DIRECTIONS
)  # fmt: skip
#: What a person feels or sees where a number is followed.
_CONJUGATE = {
    "distance": "F_tangent", "rise": "F_normal", "shear": "F_width", "turn": "M_tangent", "bend": "M_width",
    "swing": "M_normal", "force_tangent": "distance", "force_normal": "rise", "force_width": "shear",
    "weight": "rise", "roller": "F_roller", "stroke": "F_stroke",
}  # fmt: skip
#: A first guess: a function of the arclength that returns quaternion and centreline, seven numbers.
Guess = Callable[[float], list[float]]
#: Largest angle of an arch that is a first guess: beyond it the strip passes through itself.
_STEEPEST = 2.4


class OpenStrip(Network):
    """A strip between two ends.

    Attributes
    ----------
    section : Section
    start, finish : End
        What is held. For a closed strip the last end is clamped to the first one, turned by ``turn``.
    numbers : mapping of str to float
        Values of what is prescribed (`ends.PLACE`, `ends.ANGLES`) and of loads (`LOADS`); a load that is not named is absent.
        Others that are not named have the values of the natural state, or zero.
    weight_direction, foundation_direction, stroke_direction : tuple of float
        Where the weight pulls to; the direction in which the foundation holds; that of a further displacement of the last end,
        whose number is ``stroke``.
    phases : tuple of str
        Names of `PHASES`, for strips that can shift along themselves or spin about their tangents.
    roller : Roller, optional
        A support between the ends. The place of the first end must be held.

    Raises
    ------
    ValueError
        One sentence.

    Examples
    --------
    A column, clamped at one end and free at the other, buckles under a dead load of (pi/2)**2.

    >>> import contin
    >>> from ribbon_model.ends import FREE_END
    >>> from ribbon_model.laws import ROD
    >>> rod = Section(ROD, {"B1": 1.0, "B2": 4.0, "C": 0.8})
    >>> column = OpenStrip(rod, finish=FREE_END, numbers={"force_tangent": -1.0})
    >>> branch = contin.trace(column.first_point(), free=["force_tangent"], direction=-1, limits={"force_tangent": (-5, 0)})
    >>> [(round(-point["force_tangent"] / (math.pi / 2) ** 2, 9), point.index_change) for point in branch.labelled("BP")]
    [(1.0, (0, 1))]
    """

    __repr__ = shown
    #: The strip is drawn straight, and its states begin with guesses.
    assembles = False

    def __init__(
        self, section: Section, start: End = CLAMP, finish: End = CLAMP, numbers: Mapping[str, float] | None = None,
        weight_direction: ends.Vector = (0.0, -1.0, 0.0), foundation_direction: ends.Vector = DIRECTIONS["normal"],
        stroke_direction: ends.Vector = DIRECTIONS["tangent"], phases: Sequence[str | Phase] = (), roller: Roller | None = None,
    ) -> None:  # fmt: skip
        numbers = dict(numbers or {})
        self.section, self.start, self.finish = section, start, finish
        self.stroke_direction = ends.unit("stroke_direction", stroke_direction)
        for name, value in numbers.items():
            if not math.isfinite(value):
                raise ValueError(f"numbers: {name} = {value:g} must be finite")
        if "moment" in numbers and finish.rotation not in (HINGED, JOINT):
            raise ValueError(
                "numbers: moment needs a hinge or a joint at the last end, about whose axis it acts: elsewhere a dead moment "
                "has no energy"
            )
        if roller is not None and len(start.held) < 3:
            raise ValueError("roller: the place of the first end must be held")
        if len(set(phases)) < len(phases):
            raise ValueError("phases: one of them is given twice")
        origin = (0.0, 0.0, 0.0)
        strokes = ((STROKE, self.stroke_direction),) if STROKE in numbers else ()
        loads = {name: Load([(LAST, axis, origin)]) for name, axis in zip(FORCES, DIRECTIONS.values()) if name in numbers}
        loads |= {"moment": Load(moments=[(LAST, 1.0)])} if "moment" in numbers else {}
        super().__init__(
            {"strip": section}, {"strip": Member()}, {FIRST: Joint([_START]), LAST: Joint([_FINISH])},
            {FIRST: _support(start), LAST: _support(finish, (*PLACE, *ANGLES), origin, strokes)}, loads, numbers,
            weight_direction, phases=phases, foundation_direction=foundation_direction, roller=roller,
            symmetries={"plane": _mirrored},
        )  # fmt: skip

    @property
    def material(self) -> Section:
        """The section, by its name of version 0.2, which works for one version."""
        warnings.warn("OpenStrip.material is OpenStrip.section now", DeprecationWarning, stacklevel=2)
        return self.section

    # --- names --------------------------------------------------------------------------------------------------------

    @property
    def known(self) -> tuple[str, ...]:
        """Names of the numbers that can be given here, besides those of the section."""
        forces = loads.forces_of(self.finish)
        along = np.array(self.finish.held).reshape(-1, 3) @ self.stroke_direction
        stroke = (STROKE,) if np.any(abs(along) > LOOSE) else ()
        roller = () if self.roller is None else ("roller",)
        others = (name for name in LOADS if name not in FORCES)
        return *filter(None, self.numbers_at(LAST)), *roller, *stroke, *forces, *others

    @functools.cached_property
    def _usual(self) -> dict[str, float]:
        """Place and frame of the last end, and place at a roller, of the natural state."""
        found = natural_end(self.section)
        if self.roller is None:
            return found
        return found | {"roller": float(natural_states(self.section, [self.roller.at])[0, 4:] @ self.roller.direction)}

    # --- the problem --------------------------------------------------------------------------------------------------

    @property
    def contacts(self) -> dict[int, str]:
        """As those of a network, the ends in the words of scenes."""
        return {number: {FIRST: "start", LAST: "finish"}.get(name, name) for number, name in super().contacts.items()}

    def _functionals(self) -> Mapping[str, Callable]:
        return {name: rate for name, rate in _PLACES.items() if name not in self.parameters}

    _sizes: ClassVar[dict[str, float]] = {}  # those of a stage are of its first state

    # --- first states -------------------------------------------------------------------------------------------------

    def arch(self, distance: float | None = None, side: float = 1.0) -> Guess:
        """Return a guess of a planar state whose ends are nearer than its length: an Euler mode of these ends.

        Parameters
        ----------
        distance : float, optional
            That of the ends; the number of this name by default, .9 where there is none.
        side : float
            +1 to the side of the normal, -1 to the other one.

        Raises
        ------
        ValueError
            The ends are too near or too far.
        """
        distance = self.parameters.get("distance", 0.9) if distance is None else distance
        mode = _euler_mode(self.start, self.finish)
        s = np.linspace(0, 1, 2001)
        mode_values = mode(s) / np.abs(mode(s)).max()
        least = float(np.mean(np.cos(_STEEPEST * mode_values)))
        if not least < distance <= 1:
            raise ValueError(f"distance = {distance:g} must be above {least:.3g}, and at most 1")
        amplitude = brentq(lambda a: np.mean(np.cos(a * mode_values)) - distance, 0.0, _STEEPEST)  # it falls
        angle = side * amplitude * mode_values
        steps = np.diff(s)[:, None] * (np.column_stack([np.sin(angle), np.cos(angle)])[1:] + 0)
        place = np.concatenate([np.zeros((1, 2)), np.cumsum(steps, axis=0)])

        def guess(t):
            a, y, z = (np.interp(t, s, column) for column in (angle, *place.T))
            return [math.cos(a / 2), -math.sin(a / 2), 0, 0, 0, y, z]

        return guess

    def twisted(self, turn: float) -> Guess:
        """Return a guess of a straight strip that is evenly twisted."""
        return lambda t: [math.cos(turn * t / 2), 0, 0, math.sin(turn * t / 2), 0, 0, t]

    def twisted_circle(self, half_twists: float = 0) -> Guess:
        """Return a guess of a closed strip: a circle that bends about d1 at the start, evenly twisted by half twists."""

        def guess(t):
            a, b, r = math.pi * t, math.pi * half_twists * t / 2, 1 / (2 * math.pi)
            q = ends.product((math.cos(a), math.sin(a), 0, 0), (math.cos(b), 0, 0, math.sin(b)))
            return [*q, 0, r * (math.cos(2 * a) - 1), r * math.sin(2 * a)]

        return guess

    def first_point(self, guess=None, values: Mapping[str, float] | None = None, intervals=10, degree=None, **options) -> Point:
        """Return the state near a guess (the natural state without one), as `contin.solve` does.

        The degree is 6 by default, or that of a guess that is a point.

        Raises
        ------
        ProblemError
            Nothing determines the state, in one sentence; or no state was found.
        """
        if guess is None:
            s = np.linspace(0, 1, 401)
            guess = s, natural_states(self.section, s)
        if degree is None and not isinstance(guess, Point):
            degree = 6
        options = {"intervals": intervals, "degree": degree, **options}
        values = {**(values or {})}
        self._check_phases(values)
        try:
            point = solve(self.problem, self.padded(guess), values, **options)
            self.check_determined(point)
            return point
        except ContinError as error:
            unloaded = values | dict.fromkeys(self.acting, 0.0)
            if self.acting and isinstance(error, ConvergenceError):
                self._check_unloaded(guess, unloaded, options)
            reason = self.reason(error)
            if reason == UNHELD and isinstance(guess, tuple) and self.moves_rigidly(guess[1], self.parameters | values):
                reason = RIGID  # round-off decides whether the solver or the index notices
            raise ProblemError(self.law_at(guess) or self.with_advice(reason, guess, values, options)) from error

    def _check_phases(self, values: Mapping[str, float]) -> None:
        """Raise ProblemError for more phases than symmetries of a strip whose first end is clamped.

        An isotropic section turns about the tangent without a change of H, and a closed uniform strip shifts along itself. Both
        may end with loads or by the last end: then the phases have multipliers.
        """
        if not self.phases or self.start.rotation != CLAMPED or len(self.start.held) < 3:
            return
        p, law = SimpleNamespace(**{**self.parameters, **values}), self.section.hamiltonian()
        turned = [law(0.5, 0.1 * math.cos(a), 0.1 * math.sin(a), 0.05, p) for a in (0.3, 1.2, 2.6, 4.4)]
        closed = all(abs(getattr(p, name, math.inf)) < LOOSE for name in PLACE)
        known = ["a turn about the tangent"] * bool(np.ptp(turned) <= LOOSE * np.abs(turned).max())
        known += ["a shift along the strip"] * (closed and self.section.homogeneous)
        if len(self.phases) > len(known):
            has = f"{known[0]} only; leave one" if known else "none; leave phases"
            given = [name for name, phase in PHASES.items() if phase in self.phases]
            raise ProblemError(f"phases: {given}: each holds a continuous symmetry, and the strip has {has} out")

    undetermined, neutral = UNDETERMINED, UNHELD
    near = ("the first guess", "the natural state", "another first state")

    def phased(self, phases: Sequence[str | Phase]) -> OpenStrip:
        """Return the strip with these phases."""
        return OpenStrip(
            self.section, self.start, self.finish, self.numbers, self.weight_direction, self.foundation_direction,
            self.stroke_direction, phases, self.roller,
        )  # fmt: skip

    def law_at(self, guess) -> str:
        """As `Network.law_at`, of the only strip."""
        return super().law_at(guess).removeprefix("strips: strip: ")

    def _check_unloaded(self, guess, values: Mapping[str, float], options: Mapping) -> None:
        """Raise ProblemError where the state without loads is not determined: then no search with them arrives."""
        try:
            self.check_determined(solve(self.problem, self.padded(guess), values, **options))
        except ContinError as error:
            raise ProblemError(self.reason(error)) from error

    def reason(self, error: Exception) -> str:
        """Return why no state was found, in the words of strips."""
        return UNHELD if Undetermined.MODE in str(error) else super().reason(error)

    @property
    def closed(self) -> bool:
        """Whether the last end is clamped where the first one is."""
        clamped = all(end.rotation == CLAMPED and len(end.held) == 3 for end in (self.start, self.finish))
        return clamped and all(self.parameters.get(name) == 0 for name in PLACE)

    def _mechanism(self, point: Point) -> str:
        """Return why a state is not determined."""
        return RIGID if self.moves_rigidly(point.system.states(point.x), point.parameters) else UNHELD

    def sizes(self, system: Collocation, x: np.ndarray) -> dict[str, float]:
        """Return the sizes of states and numbers for `contin.Settings.scales`, at a state.

        The length of the strip is one, and so are the sizes of places and angles. All forces and moments have one size, that of
        the smallest stiffness or of the largest among them: a component that is small here, or nothing but round-off, is not
        small by its nature.
        """
        known = {**self.parameters, **dict(zip((*system.problem.states, *system.free), system.largest(x)))}
        stiffness = min((known[name] for name in self.section.stiffnesses), default=1.0)
        forces = [name for name in known if name.startswith(("lam_", "sigma_")) or name in LOADS]
        force = max(stiffness, *(abs(known[name]) for name in forces))
        places = [name for name in known if name not in (*forces, *self.section.parameters)]
        return dict.fromkeys(places, 1.0) | dict.fromkeys(forces, force)

    # --- what a state is ----------------------------------------------------------------------------------------------

    def reactions(self, point: Point) -> dict[str, float]:
        """Return the force and the moment on the strip at the last end, then at the first one, on the lab axes.

        With a roller or a stroke, the force of the roller and the force at the last end along the stroke follow.
        """
        (last, turned, _), (first, bent, _) = (self._at_end(point, end) for end in (_FINISH, _START))
        found = {}
        if self.roller is not None:
            found["F_roller"] = float(point.system.states(point.x)[0, -1])
            first = first - found["F_roller"] * np.array(self.roller.direction)
        if STROKE in self.numbers:
            found["F_stroke"] = float(np.dot(last, self.stroke_direction))
        return dict(zip(REACTIONS, map(float, (*last, *turned, *first, *bent)))) | found

    @property
    def found_names(self) -> tuple[str, ...]:
        """Names of the reactions."""
        more = [("F_roller", self.roller is not None), ("F_stroke", STROKE in self.numbers)]
        return (*REACTIONS, *(name for name, has in more if has))

    found = reactions

    def conjugate(self, name: str) -> str:
        """Return the name of what is conjugate to a number, up to a sign: the energy for numbers of the section."""
        return _CONJUGATE.get(name, "energy")

    def strains(self, system: Collocation, x: np.ndarray) -> np.ndarray:
        """Return omega_1, omega_2 and omega_3 (K, 3) at the nodes of a discretized state."""
        return super().strains(system, x)["strip"]

    def shape(self, point: Point) -> Shape:
        """Return the strip in space, of length 1."""
        return self.shapes(point)["strip"]

    def unbalanced(self, point: Point) -> str:
        """Return that reactions of a state are replaced by nothing, if the ends are held otherwise."""
        carried = list(self.reactions(point).values())
        reactions = [", ".join(f"{value:.4g}" for value in carried[i : i + 3]) for i in range(0, 12, 3)]
        return (
            "they let go of what no load replaces; along width, normal and tangent the last end carries the force "
            f"({reactions[0]}) and the moment ({reactions[1]}), the first one ({reactions[2]}) and ({reactions[3]}); "
            "a dead force replaces that at the last end, a dead moment the one about the axis of its hinge: bring the others "
            "to zero first"
        )


#: The joints of a strip, and its ends there.
FIRST, LAST = "first", "last"
_START, _FINISH = JointEnd("strip"), JointEnd("strip", FINISH)
#: Place of the last end from the first one, as integrals over the strip.
_PLACES = dict(zip(PLACE, (lambda t, x, w, p: w.x1, lambda t, x, w, p: w.x2, lambda t, x, w, p: w.x3)))


def _mirrored(t, x):
    """Return the image of states under the mirror normal to the width at the start."""
    signs = np.ones(x.shape[1])
    signs[[2, 3, 4]] = -1.0
    return x * signs


def _support(end: End, *prescribed) -> Support:
    """Return an end as the support of a joint; ``prescribed`` are the further fields."""
    return Support(end.rotation, end.axis, end.director, end.held, end.pushes, *prescribed)


def _euler_mode(start: End, finish: End) -> Callable[[np.ndarray], np.ndarray]:
    """Return the angle along a column of these ends as it buckles, up to a factor."""
    tangent = 4.493409457909064  # the first zero of tan x = x
    turns_start, turns_finish = (  # about the width
        (end.rotation == HINGED and abs(end.axis[0]) > 1 - LOOSE) or end.rotation in (FREE, JOINT) for end in (start, finish)
    )
    if not finish.held and finish.rotation == FREE:
        return lambda s: 1 - np.cos(math.pi * s / 2)
    if turns_start and turns_finish:
        return lambda s: np.cos(math.pi * s)
    if turns_finish:
        return lambda s: tangent * np.cos(tangent * (1 - s)) - math.sin(tangent)
    if turns_start:
        return lambda s: tangent * np.cos(tangent * s) - math.sin(tangent)
    return lambda s: np.sin(2 * math.pi * s)
