"""An open strip (or a closed, twisted one) between two ends, under loads: a variational problem from what a person says of it.

The state is the quaternion of the frame and the centreline; the length is 1, and so is B (`ribbon_model.section`). The
Hamiltonian is that of the section, H(M), plus n.d3 for the growth of the centreline, minus the potential of distributed
loads: the multipliers of the quaternion carry the moment, 2 M_i = lambda_q . (q e_i), those of the centreline are the force n.
Conditions at the ends: `ribbon_model.ends`. The reactions are the force and the moment that the supports exert on the strip.
"""

from __future__ import annotations

import functools
import itertools
import math
import warnings
from collections import namedtuple
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import SimpleNamespace

import numpy as np
from scipy.optimize import brentq  # type: ignore[import-untyped]

from contin import ContinError, ConvergenceError, Event, Point, ProblemError, VariationalProblem, solve
from contin.lowlevel import Collocation, Continuation, Undetermined, shown
from ribbon_model import ends, law_end, loads
from ribbon_model.ends import CLAMP, CLAMPED, DIRECTIONS, FREE, HINGED, JOINT, LOOSE, PLACE, End, Roller
from ribbon_model.equilibrium import CENTRELINE, FRAME, directors, moment_of, moment_on_axes, strains_of
from ribbon_model.loads import FORCES, LOADS, STROKE
from ribbon_model.phases import PHASES
from ribbon_model.section import Section, natural_end, natural_states
from ribbon_model.shape import Shape, shape_of

#: Columns of the reactions.
REACTIONS = tuple(
    f"{end}{what}_{direction}" for end in ("", "start_") for what in ("F", "M") for direction in DIRECTIONS
)  # fmt: skip
#: Most phases of a strip: it can shift and turn about itself.
_MOST_PHASES = 2
#: A first guess: a function of the arclength that returns quaternion and centreline, seven numbers.
Guess = Callable[[float], list[float]]
#: Largest angle of an arch that is a first guess: beyond it the strip passes through itself.
_STEEPEST = 2.4


@dataclass  # the directions are normalised when it is made, and then left as they are
class OpenStrip:
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

    section: Section
    start: End = CLAMP
    finish: End = CLAMP
    numbers: Mapping[str, float] = field(default_factory=dict)
    weight_direction: ends.Vector = (0.0, -1.0, 0.0)
    foundation_direction: ends.Vector = DIRECTIONS["normal"]
    stroke_direction: ends.Vector = DIRECTIONS["tangent"]
    phases: tuple[str, ...] = ()
    roller: Roller | None = None

    __repr__ = shown

    def __post_init__(self) -> None:
        self.weight_direction = ends.unit("weight_direction", self.weight_direction)
        self.foundation_direction = ends.unit("foundation_direction", self.foundation_direction)
        self.stroke_direction = ends.unit("stroke_direction", self.stroke_direction)
        ends.check_known(self.numbers, self.known)
        for name, value in self.numbers.items():
            if not math.isfinite(value):
                raise ValueError(f"numbers: {name} = {value:g} must be finite")
        if self.numbers.get("foundation", 0) < 0:
            raise ValueError(f"numbers: foundation = {self.numbers['foundation']:g} must not be negative")
        if "moment" in self.numbers and self.finish.rotation not in (HINGED, JOINT):
            raise ValueError(
                "numbers: moment needs a hinge or a joint at the last end, about whose axis it acts: elsewhere a dead moment "
                "has no energy"
            )
        if self.roller is not None and len(self.start.held) < 3:
            raise ValueError("roller: the place of the first end must be held")
        if len(set(self.phases)) < len(self.phases):
            raise ValueError("phases: one of them is given twice")
        for name in self.phases:
            if name not in PHASES:
                raise ValueError(f"phases: {name!r} must be one of {', '.join(PHASES)}")

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
        return (*ends.numbers_of(self.finish), *roller, *stroke, *forces, *(name for name in LOADS if name not in FORCES))

    @functools.cached_property
    def parameters(self) -> dict[str, float]:
        """Names and values of all numbers that can be followed."""
        names = ends.numbers_of(self.finish)
        natural = {} if set(names) <= set(self.numbers) else natural_end(self.section)
        prescribed = {name: self.numbers[name] if name in self.numbers else natural[name] for name in names}
        if self.roller is not None:
            place = natural_states(self.section, [self.roller.at])[0, 4:] @ self.roller.direction
            prescribed["roller"] = self.numbers.get("roller", float(place))
        loaded = {name: self.numbers[name] for name in (STROKE, *LOADS) if name in self.numbers}
        return {**prescribed, **loaded, **self.section.parameters}

    # --- the problem --------------------------------------------------------------------------------------------------

    @functools.cached_property
    def problem(self) -> VariationalProblem:
        """The variational problem.

        Raises
        ------
        ProblemError
            Conditions that repeat or contradict each other.
        """
        phases = [f"phase_{name.replace(', ', '_').replace(' ', '_')}" for name in self.phases]
        states = (*FRAME, *CENTRELINE, *phases, *(["support"] if self.roller else []))
        return VariationalProblem(
            None, states, self.parameters, hamiltonian=self._hamiltonian(), ends=self._conditions(),
            end_energy=self._end_energy(), symmetries={"plane": _mirrored},
            functionals={name: rate for name, rate in _PLACES.items() if name not in self.parameters},
            phases=phases,
        )  # fmt: skip

    @property
    def conditions_inside(self) -> int:
        """Number of integral conditions: phases, and the roller, which is the last."""
        return len(self.phases) + (self.roller is not None)

    def _hamiltonian(self) -> Callable:
        complementary = self.section.hamiltonian()
        integrals = [*(PHASES[name] for name in self.phases), *([self.roller] if self.roller else [])]
        potential = loads.distributed(
            self.weight_direction if "weight" in self.numbers else None,
            self.foundation_direction if "foundation" in self.numbers else None,
        )

        def hamiltonian(t, x, lam, p):
            q, n1, n2, n3 = x[:4], *lam[4:7]
            M1, M2, M3 = moment_of(q, lam[:4])
            d11, d12, d13, d21, d22, d23, d31, d32, d33 = directors(*q)
            value = complementary(t, M1, M2, M3, p) + n1 * d31 + n2 * d32 + n3 * d33 - potential(x, p)
            for integral, multiplier in zip(integrals, lam[7:]):
                value = value + multiplier * integral.density(0, t, x, p, 1)
            return value

        return hamiltonian

    def _conditions(self) -> Callable:
        clamped = self.start.rotation == CLAMPED
        first, last = ends.rotation_conditions(self.start), ends.rotation_conditions(self.finish)
        place, far = ends.place_conditions(self.start), ends.place_conditions(self.finish)
        frame, count, prescribed = ends.prescribed, self.conditions_inside, self._prescribed()

        def conditions(a, b, p):
            turned, there = frame(*prescribed(p)[:3]), prescribed(p)[3:]
            unit = a.q0 * a.q0 + a.q1 * a.q1 + a.q2 * a.q2 + a.q3 * a.q3 - 1
            begin = (a.q0 - 1, a.q1, a.q2, a.q3) if clamped else (*first(a[:4], (1, 0, 0, 0)), unit)
            held = (*begin, *place(a[4:7], (0, 0, 0)), *last(b[:4], turned), *far(b[4:7], there))
            return (*held, *a[7 : 7 + count], *b[7 : 7 + count])

        return conditions

    def _prescribed(self) -> Callable:
        """Return ``prescribed(p)``: turn, bend, swing, shear, rise and distance of the last end; zero where nothing is held."""
        turned, placed = self.finish.rotation != FREE, ends.numbers_of(self.finish)
        shear, rise, distance = (name in placed for name in PLACE)
        moved, (x, y, z) = STROKE in self.numbers, self.stroke_direction

        def prescribed(p):
            stroke = p.stroke if moved else 0
            return (
                p.turn if turned else 0, p.bend if turned else 0, p.swing if turned else 0,
                (p.shear if shear else 0) + stroke * x, (p.rise if rise else 0) + stroke * y,
                (p.distance if distance else 0) + stroke * z,
            )  # fmt: skip

        return prescribed

    def _end_energy(self) -> Callable | None:
        return loads.at_the_end(self.numbers, self.finish, self._prescribed())

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

        return self._with_multipliers(guess)

    def twisted(self, turn: float) -> Guess:
        """Return a guess of a straight strip that is evenly twisted."""
        return self._with_multipliers(lambda t: [math.cos(turn * t / 2), 0, 0, math.sin(turn * t / 2), 0, 0, t])

    def twisted_circle(self, half_twists: float = 0) -> Guess:
        """Return a guess of a closed strip: a circle that bends about d1 at the start, evenly twisted by half twists."""

        def guess(t):
            a, b, r = math.pi * t, math.pi * half_twists * t / 2, 1 / (2 * math.pi)
            q = ends.product((math.cos(a), math.sin(a), 0, 0), (math.cos(b), 0, 0, math.sin(b)))
            return [*q, 0, r * (math.cos(2 * a) - 1), r * math.sin(2 * a)]

        return self._with_multipliers(guess)

    def _with_multipliers(self, guess: Guess) -> Guess:
        return lambda t: [*guess(t), *[0] * self.conditions_inside]

    def first_point(self, guess=None, values: Mapping[str, float] | None = None, intervals=10, degree=None, **options) -> Point:
        """Return the state near a guess (the natural state without one), as `contin.solve` does.

        The degree is 6 by default, or that of a guess that is a point.

        Raises
        ------
        ProblemError
            Nothing determines the state, in one sentence; or no state was found.
        """
        if guess is None:
            guess = self._natural_guess()
        if degree is None and not isinstance(guess, Point):
            degree = 6
        options = {"intervals": intervals, "degree": degree, **options}
        self._check_phases(values or {})
        try:
            point = solve(self.problem, guess, values, **options)
        except ContinError as error:
            unloaded = {name: 0.0 for name in LOADS if name in self.numbers}
            if unloaded and isinstance(error, ConvergenceError):
                self._check_unloaded(guess, {**(values or {}), **unloaded}, options)
            reason = self._reason(error)
            if (
                reason == UNHELD
                and isinstance(guess, tuple)
                and self._rigid_freedom(guess[1], self.parameters | (values or {}))
            ):
                reason = RIGID  # round-off decides whether the solver or the index notices
            raise ProblemError(self._law_at(guess) or self._with_phases(reason, guess, values, options)) from error
        try:
            self.check_determined(point)
        except ProblemError as error:
            raise ProblemError(self._law_at(guess) or self._with_phases(str(error), guess, values, options)) from error
        return point

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
            raise ProblemError(f"phases: {[*self.phases]}: each holds a continuous symmetry, and the strip has {has} out")

    def _with_phases(self, reason: str, guess, values: Mapping[str, float] | None, options: Mapping) -> str:
        """Return the reason why nothing determines the state, with the phases that do, as few as possible: all are tried."""
        if reason not in (UNHELD, self._not_found()):
            return reason
        others = [name for name in PHASES if name not in self.phases]
        for count in range(1, _MOST_PHASES - len(self.phases) + 1):
            fits = [names for names in itertools.combinations(others, count) if self._fits(names, guess, values, options)]
            if fits:
                more = "further phases" if self.phases else "phases"
                return f"{reason}, or give {more}: {' or '.join(str([*names]) for names in fits)}"
        return reason

    def _fits(self, names: Sequence[str], guess, values: Mapping[str, float] | None, options: Mapping) -> bool:
        """Return whether phases determine the state near a guess, and hold by symmetry: their multipliers vanish."""
        strip = replace(self, phases=(*self.phases, *names))
        count = len(FRAME) + len(CENTRELINE)
        if isinstance(guess, Point):
            guess = guess.system.nodes, guess.system.states(guess.x)
        if callable(guess):
            begin = strip._with_multipliers(lambda t: guess(t)[:count])
        else:
            begin = guess[0], np.hstack([guess[1][:, :count], np.zeros((len(guess[0]), strip.conditions_inside))])
        try:
            point = solve(strip.problem, begin, values, **options)
            strip.check_determined(point)
        except ContinError:
            return False
        return not point.phase_loads()

    def _law_at(self, guess) -> str | None:
        """Return that the law has no value at a guess, in a sentence; None where it has, or where the guess is a point."""
        if isinstance(guess, Point):
            return None
        if not callable(guess):
            return law_end.at_guess(self.section, guess[0], guess[1][:, :4])
        times = np.linspace(0, 1, 401)
        return law_end.at_guess(self.section, times, np.array([guess(t)[:4] for t in times]))

    def _natural_guess(self):
        s = np.linspace(0, 1, 401)
        return s, np.hstack([natural_states(self.section, s), np.zeros((len(s), self.conditions_inside))])

    def _check_unloaded(self, guess, values: Mapping[str, float], options: Mapping) -> None:
        """Raise ProblemError where the state without loads is not determined: then no search with them arrives."""
        try:
            self.check_determined(solve(self.problem, guess, values, **options))
        except ContinError as error:
            raise ProblemError(self._reason(error)) from error

    def _reason(self, error: Exception) -> str:
        """Return why no state was found, in the words of strips."""
        if isinstance(error, ConvergenceError):
            return self._not_found()
        text = str(error)
        return UNDETERMINED if Undetermined.CONDITIONS in text else UNHELD if Undetermined.MODE in text else text

    def _not_found(self) -> str:
        """Return that no first state was found, and which numbers may be nearer to where one is known."""
        natural = natural_end(self.section)
        far = [name for name, value in natural.items() if abs(self.parameters.get(name, value) - value) > LOOSE]
        loads = [name for name in LOADS if self.parameters.get(name, 0.0) != 0]
        nearer = [f"smaller loads ({', '.join(loads)})"] if loads else []
        nearer += [f"{', '.join(far)} nearer to the natural state"] if far else []
        if self._closed:  # its place and turn are what makes it closed
            stiff = "a softness (1, say)" if self.section.constrained else "B2 nearer to B1"
            nearer = [*nearer[: len(loads) > 0], stiff]
        first = f"begin with {' and '.join(nearer)}, and follow them in a stage; or " if nearer else ""
        return f"no equilibrium was found near the first guess; {first}begin with another first state"

    @property
    def _closed(self) -> bool:
        """Whether the last end is clamped where the first one is."""
        return all(end.rotation == CLAMPED and len(end.held) == 3 for end in (self.start, self.finish)) and all(
            self.parameters.get(name) == 0 for name in PLACE
        )

    def check_determined(self, point: Point) -> None:
        """Raise ProblemError where something can move without a change of energy, or reactions are not determined."""
        try:
            if point.second_variation().is_determined:
                return
        except ProblemError as error:
            reason = self._reason(error)
            if reason != UNHELD:
                raise ProblemError(reason) from error
        raise ProblemError(RIGID if self._rigid_freedom(point.system.states(point.x), point.parameters) else UNHELD)

    def _rigid_freedom(self, known: np.ndarray, values: Mapping[str, float]) -> bool:
        """Return whether a rigid motion violates no condition at the ends of states (K, ...), in the problem's order."""
        problem = self.problem
        n, batch = problem.dimension, problem.batch("boundary")
        states = np.zeros((2, len(batch.signature.states)))
        states[:, : known.shape[1]] = known[[0, -1]]
        p = np.array([float(values.get(name, value)) for name, value in problem.parameters.items()])
        jacobian = batch.jacobian(np.zeros(1), states[:1], states[1:], p, batch.columns([]))[1][0]
        count = len(problem.canonical.fixed[0]) + len(problem.canonical.fixed[1]) + problem.canonical.sigmas
        by_ends = np.concatenate([jacobian[:count, :n], jacobian[:count, 2 * n : 3 * n]], axis=1)
        motions = np.array([np.concatenate([_moved(states[i, :7], k, n) for i in (0, -1)]) for k in range(6)])
        return int(np.linalg.matrix_rank(by_ends @ motions.T, tol=LOOSE)) < 6

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

    # --- where the law ends -------------------------------------------------------------------------------------------

    def domain_tests(self) -> list[Event]:
        """Return the test function that ends a run where the law ends; none for a law that is regular everywhere."""
        return law_end.tests(self.section, law_end.Place(self.strains))

    def explained(self, run: Continuation) -> str | None:
        """Return that a run met the end of the law, or failed near it; None for a run that stopped elsewhere."""
        return law_end.explained(self.section, self.domain_tests(), run)

    # --- what a state is ----------------------------------------------------------------------------------------------

    def reactions(self, point: Point) -> dict[str, float]:
        """Return the force and the moment on the strip at the last end, then at the first one, on the lab axes.

        With a roller or a stroke, the force of the roller and the force at the last end along the stroke follow.
        """
        return self.reactions_of(point.system.states(point.x))

    def reactions_of(self, states: np.ndarray) -> dict[str, float]:
        """Return the same from the states (K, 2n) at the nodes."""
        n = self.problem.dimension
        values = []
        roller = 0.0 if self.roller is None else float(states[0, -1])
        before = np.zeros(3) if self.roller is None else roller * np.array(self.roller.direction)
        for row, sign, more in ((states[-1], 1.0, 0.0), (states[0], -1.0, before)):
            q, lam = row[:4], row[n : n + 7]
            values += [*(sign * (lam[4:7] + more)), *(sign * moment_on_axes(q, lam[:4]))]
        found = dict(zip(REACTIONS, map(float, values)))
        if self.roller is not None:
            found["F_roller"] = roller
        if STROKE in self.numbers:
            found["F_stroke"] = float(np.dot(values[:3], self.stroke_direction))
        return found

    def potential(self, point: Point) -> float:
        """Return the energy with the potential of the dead loads at the last end: that of which the index is."""
        loaded = self._end_energy()
        if loaded is None:
            return point["energy"]
        last = _LastEnd(*point.system.states(point.x)[-1, :7])
        return point["energy"] + float(loaded(None, last, SimpleNamespace(**point.parameters)))

    def strains(self, system: Collocation, x: np.ndarray) -> np.ndarray:
        """Return omega_1, omega_2 and omega_3 (K, 3) at the nodes of a discretized state."""
        return self.strains_at(system.nodes, system.states(x), system.all_parameters(x))

    def strains_at(self, t: np.ndarray, states: np.ndarray, p: np.ndarray) -> np.ndarray:
        """Return the same at places t (K,) with states (K, 2n) and the values of all parameters."""
        return strains_of(states[:, :4], self.problem.batch("field").values(t, states, states[:0], p))

    def shape(self, point: Point) -> Shape:
        """Return the strip in space, of length 1."""
        return shape_of(point.system.nodes, point.system.states(point.x), self.strains(point.system, point.x))


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
#: States of the last end, as the potential of its loads takes them.
_LastEnd = namedtuple("_LastEnd", (*FRAME, *CENTRELINE))
#: Place of the last end from the first one, as integrals over the strip.
_PLACES = dict(zip(PLACE, (lambda t, x, w, p: w.x1, lambda t, x, w, p: w.x2, lambda t, x, w, p: w.x3)))


def _mirrored(t, x):
    """Return the image of states under the mirror normal to the width at the start."""
    signs = np.ones(x.shape[1])
    signs[[2, 3, 4]] = -1.0
    return x * signs


def _moved(state, k: int, n: int) -> np.ndarray:
    """Return the change of a state by a rigid translation (k < 3) or rotation about the origin, padded to n."""
    change, axis = np.zeros(n), np.eye(3)[k % 3]
    if k < 3:
        change[4:7] = axis
    else:
        change[:4] = ends.product((0, *axis / 2), state[:4])
        change[4:7] = np.cross(axis, state[4:7])
    return change


def _euler_mode(start: End, finish: End) -> Callable[[np.ndarray], np.ndarray]:
    """Return the angle along a column of these ends as it buckles, up to a factor."""
    tangent = 4.493409457909064  # the first zero of tan x = x
    turns_start, turns_finish = (_turns_about_width(end) for end in (start, finish))
    if not finish.held and finish.rotation == FREE:
        return lambda s: 1 - np.cos(math.pi * s / 2)
    if turns_start and turns_finish:
        return lambda s: np.cos(math.pi * s)
    if turns_finish:
        return lambda s: tangent * np.cos(tangent * (1 - s)) - math.sin(tangent)
    if turns_start:
        return lambda s: tangent * np.cos(tangent * s) - math.sin(tangent)
    return lambda s: np.sin(2 * math.pi * s)


def _turns_about_width(end: End) -> bool:
    """Return whether an end can turn about the width."""
    return (end.rotation == HINGED and abs(end.axis[0]) > 1 - LOOSE) or end.rotation in (FREE, JOINT)
