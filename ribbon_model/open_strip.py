"""An open strip (or a closed, twisted one) between two ends, under loads: a variational problem from what a person says of it.

The state is the quaternion of the frame and the centreline; the length is 1, and so is B (`ribbon_model.material`). The
Hamiltonian is that of the section, H(M), plus n.d3 for the growth of the centreline, minus the potential of distributed
loads: the multipliers of the quaternion carry the moment, 2 M_i = lambda_q . (q e_i), those of the centreline are the force n.
Conditions at the ends: `ribbon_model.ends`. The reactions are the force and the moment that the supports exert on the strip.
"""

from __future__ import annotations

import functools
import math
from collections import namedtuple
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np

from contin import Collocation, ContinError, Point, ProblemError, TestFunction, Trial, VariationalProblem, solve
from ribbon_model import ends
from ribbon_model.ends import ANGLES, CLAMP, CLAMPED, DIRECTIONS, FREE, HINGED, JOINT, PLACE, End
from ribbon_model.equilibrium import CENTRELINE, FRAME, directors, spin
from ribbon_model.laws import FINITE_WIDTH, RIBBON
from ribbon_model.material import Material
from ribbon_model.shape import Shape, frames

#: Numbers of loads: dead force at the last end along the three directions, dead moment about its hinge, weight per length
#: (along ``weight_direction``), stiffness per length of a foundation.
FORCES = ("force_width", "force_normal", "force_tangent")
LOADS = (*FORCES, "moment", "weight", "foundation")
#: A further displacement of the last end, along ``stroke_direction``.
STROKE = "stroke"
#: Conditions that fix what symmetry leaves open: the angle about the tangent (a homogeneous ring, an isotropic rod between ends
#: on one line), the place along a closed strip that is twisted to the right or to the left, and along a ring that buckles with
#: two waves. Each is an integral condition that holds by symmetry, so its multiplier vanishes. (Of combinations of x1 and
#: x2 sin(2 pi s), those with the factors -3 and 0 lose their slope on the way to a Moebius band of a flat strip; with +3 they
#: keep it.)
PHASES = {
    "spin": lambda t, x: x.x1,
    "shift, right": lambda t, x: x.x1 + 3 * x.x2 * math.sin(2 * math.pi * t),
    "shift, left": lambda t, x: x.x1 - 3 * x.x2 * math.sin(2 * math.pi * t),
    "shift, two waves": lambda t, x: x.x1 * math.sin(4 * math.pi * t),
}
#: Columns of the reactions.
REACTIONS = tuple(
    f"{end}{what}_{direction}" for end in ("", "start_") for what in ("F", "M") for direction in DIRECTIONS
)  # fmt: skip
#: Largest angle of an arch that is a first guess: beyond it the strip passes through itself.
_STEEPEST = 2.4
#: Halvings of the interval in which its amplitude is looked for: to round-off. Ten times more change nothing.
_HALVINGS = 50
#: An eigenvalue of the second variation below this part of the largest is zero: a motion that costs no energy. Round-off
#: leaves 1e-14, and slow branches near their birth have eigenvalues above 1e-8.
_ZERO = 1e-10
#: A rigid motion that moves what is held by less than this, relative to its size, is not held.
_LOOSE = 1e-9


#: Fewest intervals of the mesh of a strip with a roller, and the most that are added so that one ends there. It is not adapted.
_FEWEST, _MOST = 20, 100


@dataclass(frozen=True)
class Roller:
    """A support between the ends, which holds the place of one point of the strip along a direction.

    Attributes
    ----------
    at : float
        Arclength of this point, a multiple of 1/N for a whole number N up to 100.
    direction : tuple of float
        The strip's place there along it is the number ``roller``.

    Raises
    ------
    ValueError
        A field that does not fit; one sentence.

    Notes
    -----
    The place is x(at) = the integral of d3 up to there, so a roller is an integral condition whose density jumps at a mesh
    point. Its multiplier is the force of the roller on the strip, and the contact force before it is larger by this.
    """

    at: float
    direction: ends.Vector

    def __post_init__(self) -> None:
        object.__setattr__(self, "direction", ends.unit("roller", self.direction))
        if not 0 < self.at < 1 or self.intervals() == 0:
            raise ValueError(f"roller: at: {self.at:g} must be a multiple of 1/N between 0 and 1, with N up to {_MOST}")

    def intervals(self, least: int = _FEWEST) -> int:
        """Return a number of equal intervals, not below ``least``, one of which ends at the roller; 0 if there is none."""
        counts = range(max(least, _FEWEST), max(least, _FEWEST) + _MOST)
        return next((count for count in counts if abs(self.at * count - round(self.at * count)) < _LOOSE), 0)

    def density(self) -> Callable:
        """Return g(t, x, p), whose integral over the strip vanishes where the roller holds it."""
        at, (x, y, z) = self.at, self.direction

        def density(t, state, p):
            before = (1 - (t - at) / (abs(t - at) + 1e-300)) / 2
            d31, d32, d33 = directors(*state[:4])[6:]
            return before * (x * d31 + y * d32 + z * d33) - p.roller

        return density


@dataclass(frozen=True)
class OpenStrip:
    """A strip between two ends.

    Attributes
    ----------
    material : Material
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
    >>> rod = Material("rod", {"B1": 1.0, "B2": 4.0, "C": 0.8})
    >>> column = OpenStrip(rod, finish=FREE_END, numbers={"force_tangent": -1.0})
    >>> branch = contin.trace(column.first_point(), free=["force_tangent"], direction=-1, limits={"force_tangent": (-5, 0)})
    >>> [(round(-point["force_tangent"] / (math.pi / 2) ** 2, 9), point.index_change) for point in branch.labelled("BP")]
    [(1.0, (0, 1))]
    """

    material: Material
    start: End = CLAMP
    finish: End = CLAMP
    numbers: Mapping[str, float] = field(default_factory=dict)
    weight_direction: ends.Vector = (0.0, -1.0, 0.0)
    foundation_direction: ends.Vector = DIRECTIONS["normal"]
    stroke_direction: ends.Vector = DIRECTIONS["tangent"]
    phases: tuple[str, ...] = ()
    roller: Roller | None = None

    def __post_init__(self) -> None:
        for name in ("weight_direction", "foundation_direction", "stroke_direction"):
            object.__setattr__(self, name, ends.unit(name, getattr(self, name)))
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

    # --- names --------------------------------------------------------------------------------------------------------

    @property
    def known(self) -> tuple[str, ...]:
        """Names of the numbers that can be given here, besides those of the material."""
        forces = forces_of(self.finish)
        along = np.array(self.finish.held).reshape(-1, 3) @ self.stroke_direction
        stroke = (STROKE,) if np.any(abs(along) > _LOOSE) else ()
        roller = () if self.roller is None else ("roller",)
        return (*ends.numbers_of(self.finish), *roller, *stroke, *forces, *(name for name in LOADS if name not in FORCES))

    @functools.cached_property
    def parameters(self) -> dict[str, float]:
        """Names and values of all numbers that can be followed."""
        names = ends.numbers_of(self.finish)
        natural = {} if set(names) <= set(self.numbers) else self._natural_numbers()
        prescribed = {name: self.numbers[name] if name in self.numbers else natural[name] for name in names}
        if self.roller is not None:
            place = self.natural_states([self.roller.at])[0, 4:] @ self.roller.direction
            prescribed["roller"] = self.numbers.get("roller", float(place))
        loads = {name: self.numbers[name] for name in (STROKE, *LOADS) if name in self.numbers}
        return {**prescribed, **loads, **self.material.parameters}

    # --- the problem --------------------------------------------------------------------------------------------------

    @functools.cached_property
    def problem(self) -> VariationalProblem:
        """The variational problem.

        Raises
        ------
        ProblemError
            Conditions that repeat or contradict each other.
        """
        states = (*FRAME, *CENTRELINE, *(f"phase{i}" for i in range(self.conditions_inside)))
        return VariationalProblem(
            None, states, self.parameters, hamiltonian=self._hamiltonian(), ends=self._conditions(),
            end_energy=self._end_energy(), symmetries={"plane": _mirrored},
            functionals={name: rate for name, rate in _PLACES.items() if name not in self.parameters},
        )  # fmt: skip

    @property
    def conditions_inside(self) -> int:
        """Number of integral conditions: phases, and the roller, which is the last."""
        return len(self.phases) + (self.roller is not None)

    def _hamiltonian(self) -> Callable:
        section, potential = self.material.hamiltonian(), self._potential()
        phases = _together((*(_of_phase(name) for name in self.phases), *([self.roller.density()] if self.roller else [])))

        def hamiltonian(t, x, lam, p):
            q, l0, l1, l2, l3, n1, n2, n3 = x[:4], *lam[:7]
            rates = spin(*q, 1, 0, 0, 1), spin(*q, 0, 1, 0, 1), spin(*q, 0, 0, 1, 1)  # q e_i / 2
            M1, M2, M3 = [l0 * r0 + l1 * r1 + l2 * r2 + l3 * r3 for r0, r1, r2, r3 in rates]
            d11, d12, d13, d21, d22, d23, d31, d32, d33 = directors(*q)
            return section(t, M1, M2, M3, p) + n1 * d31 + n2 * d32 + n3 * d33 - potential(x, p) + phases(t, x, lam[7:], p)

        return hamiltonian

    def _potential(self) -> Callable:
        """Return the potential of distributed loads per length, as a function of (x, p)."""
        weight = self.weight_direction if "weight" in self.numbers else None
        foundation = self.foundation_direction if "foundation" in self.numbers else None

        def potential(x, p):
            value = 0.0
            if weight is not None:
                value = value - p.weight * (weight[0] * x.x1 + weight[1] * x.x2 + weight[2] * x.x3)
            if foundation is not None:
                offset = foundation[0] * x.x1 + foundation[1] * x.x2 + foundation[2] * x.x3
                value = value + p.foundation * offset * offset / 2
            return value

        return potential

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
        """Return the potential of the loads at the last end."""
        along = [name in self.numbers for name in FORCES]
        moment, angle = "moment" in self.numbers, ends.angle_of(self.finish)
        frame, prescribed = ends.prescribed, self._prescribed()
        if not any(along) and not moment:
            return None
        width, normal, tangent = along

        def potential(a, b, p):
            value = 0.0
            if width:
                value = value - p.force_width * b.x1
            if normal:
                value = value - p.force_normal * b.x2
            if tangent:
                value = value - p.force_tangent * b.x3
            if moment:
                value = value - p.moment * angle(b[:4], frame(*prescribed(p)[:3]))
            return value

        return potential

    # --- first states -------------------------------------------------------------------------------------------------

    def natural_states(self, t) -> np.ndarray:
        """Return quaternion and centreline (K, 7) of the natural state at places t (K,) in [0, 1], from the first frame."""
        data = [self.material.datum(name) for name in _STRAINS]
        p, t = _Numbers(self.material.parameters), np.atleast_1d(np.asarray(t, dtype=float))
        if not set(_STRAINS) & set(self.material.along):
            return _helix(np.array([datum(0.0, p) for datum in data]), t)
        from scipy.integrate import solve_ivp  # takes .5 s, and is needed where natural strains vary only

        def rates(s, x):
            return [*spin(*x[:4], *(datum(s, p) for datum in data), 1), *directors(*x[:4])[6:]]

        order = np.argsort(t)
        found = solve_ivp(rates, (0, 1), [1.0, 0, 0, 0, 0, 0, 0], "DOP853", t[order], rtol=1e-12, atol=1e-12).y.T
        states = np.empty_like(found)
        states[order] = found
        return states

    def _natural_numbers(self) -> dict[str, float]:
        """Return place and angles of the last end in the natural state."""
        if all(self.material.parameters.get(name, 0) == 0 and name not in self.material.along for name in _STRAINS):
            return {**dict.fromkeys(PLACE + ANGLES, 0.0), "distance": 1.0}
        state = self.natural_states([1.0])[0]
        planar = abs(directors(*state[:4])[0] - 1) < _LOOSE
        angles = (0.0, _winding(self.material), 0.0) if planar else ends.angles_of(state[:4])  # in the plane, the whole angle
        return dict(zip(PLACE + ANGLES, (*map(float, state[4:]), *angles)))

    def arch(self, distance: float | None = None, side: float = 1.0) -> Callable[[float], list[float]]:
        """Return a guess of a planar state whose ends are nearer than its length: an Euler mode of these ends.

        Parameters
        ----------
        distance : float, optional
            That of the ends; the number of this name by default, .9 where there is none.
        side : float
            +1 to the side of the normal, -1 to the other one.
        """
        distance = self.parameters.get("distance", 0.9) if distance is None else distance
        mode = _euler_mode(self.start, self.finish)
        s = np.linspace(0, 1, 2001)
        mode_values = mode(s) / np.abs(mode(s)).max()
        least = float(np.mean(np.cos(_STEEPEST * mode_values)))
        if not least < distance <= 1:
            raise ValueError(f"distance = {distance:g} must be above {least:.3g}, and at most 1")
        amplitude, change = 0.0, _STEEPEST
        for _ in range(_HALVINGS):  # the distance falls with the amplitude
            change /= 2
            amplitude += change if np.mean(np.cos((amplitude + change) * mode_values)) > distance else 0.0
        angle = side * amplitude * mode_values
        steps = np.diff(s)[:, None] * (np.column_stack([np.sin(angle), np.cos(angle)])[1:] + 0)
        place = np.concatenate([np.zeros((1, 2)), np.cumsum(steps, axis=0)])

        def guess(t):
            a, y, z = (np.interp(t, s, column) for column in (angle, *place.T))
            return [math.cos(a / 2), -math.sin(a / 2), 0, 0, 0, y, z, *[0] * self.conditions_inside]

        return guess

    def twisted(self, turn: float) -> Callable[[float], list[float]]:
        """Return a guess of a straight strip that is evenly twisted."""
        return lambda t: [math.cos(turn * t / 2), 0, 0, math.sin(turn * t / 2), 0, 0, t, *[0] * self.conditions_inside]

    def twisted_circle(self, half_twists: float = 0) -> Callable[[float], list[float]]:
        """Return a guess of a closed strip: a circle that bends about d1 at the start, evenly twisted by half twists."""

        def guess(t):
            a, b, r = math.pi * t, math.pi * half_twists * t / 2, 1 / (2 * math.pi)
            q = ends.product((math.cos(a), math.sin(a), 0, 0), (math.cos(b), 0, 0, math.sin(b)))
            return [*q, 0, r * (math.cos(2 * a) - 1), r * math.sin(2 * a), *[0] * self.conditions_inside]

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
            guess = self._natural_guess()
        if degree is None and not isinstance(guess, Point):
            degree = 6
        options = {"intervals": intervals, "degree": degree, **options}
        try:
            point = solve(self.problem, guess, values, **options)
        except ContinError as error:
            loads = {name: 0.0 for name in LOADS if name in self.numbers}
            if loads and str(error).startswith(_NO_CONVERGENCE):
                self._check_unloaded(guess, {**(values or {}), **loads}, options)
            raise ProblemError(self._reason(error)) from error
        self.check_determined(point)
        return point

    def _natural_guess(self):
        s = np.linspace(0, 1, 401)
        return s, np.hstack([self.natural_states(s), np.zeros((len(s), self.conditions_inside))])

    def _check_unloaded(self, guess, values: Mapping[str, float], options: Mapping) -> None:
        """Raise ProblemError where the state without loads is not determined: then no search with them arrives."""
        try:
            self.check_determined(solve(self.problem, guess, values, **options))
        except ContinError as error:
            raise ProblemError(self._reason(error)) from error

    def _reason(self, error: Exception) -> str:
        text = str(error)
        if text.startswith(_NO_CONVERGENCE):
            return NOT_FOUND
        if "repeat or contradict" in text:
            return UNDETERMINED
        if "vanishes along a mode" in text:
            return UNHELD
        return text

    def check_determined(self, point: Point) -> None:
        """Raise ProblemError where something can move without a change of energy, or reactions are not determined."""
        try:
            found = point.second_variation()
        except ProblemError as error:
            raise ProblemError(self._reason(error)) from error
        sizes = np.abs(found.eigenvalues)
        if not sizes.size or sizes.min() > _ZERO * sizes.max():
            return
        if self._rigid_freedom(point):
            raise ProblemError(
                "ends: the strip can move as a rigid body without resistance; hold more of its place or rotation"
            )
        raise ProblemError(UNHELD)

    def _rigid_freedom(self, point: Point) -> bool:
        """Return whether a rigid motion violates no condition at the ends."""
        problem, states = self.problem, point.system.states(point.x)
        n, batch = problem.dimension, problem.batch("boundary")
        jacobian = batch.jacobian(
            np.zeros(1), states[:1], states[-1:], point.system.all_parameters(point.x), batch.colouring([])
        )[1][0]
        count = len(problem.canonical.fixed[0]) + len(problem.canonical.fixed[1]) + problem.canonical.sigmas
        by_ends = np.concatenate([jacobian[:count, :n], jacobian[:count, 2 * n : 3 * n]], axis=1)
        motions = np.array([np.concatenate([_moved(states[i, :7], k, n) for i in (0, -1)]) for k in range(6)])
        return int(np.linalg.matrix_rank(by_ends @ motions.T, tol=_LOOSE)) < 6

    # --- where the law ends -------------------------------------------------------------------------------------------

    def domain_tests(self) -> list[TestFunction]:
        """Return the test function that ends a run where the law ends; none for a law that is regular everywhere."""
        law = self.material.of_paper
        margin = {RIBBON.name: self._ribbon_margin, FINITE_WIDTH.name: self._convexity}.get(law.name) if law else None
        return [TestFunction("EP", LAW_ENDS[law.name], margin, terminal=True)] if margin else []

    def explained(self, run) -> str:
        """Return why a run failed: the end of the law where its state is near it, else the run's own reason."""
        for test in self.domain_tests():
            state = run.state
            if test.function(Trial.without_tangent(state.system, state.x)) < _NEARLY_ENDED:
                return test.name
        return str(run.stop)

    def _ribbon_margin(self, trial: Trial) -> float:
        """Return the least M1 + (1 + nu) kappa_n at the nodes, over the largest: the law holds where it is positive.

        For an orthotropic plate see `Material.other_side`.

        With p and a of `ribbon_hamiltonian`, the two roots a belong to omega_1 of either sign, and their H differ by
        sqrt(p**2 + M3**2) (p + 2 nu kappa_n)/2. Where that is negative, bending to the other side lowers the energy at this
        moment: strips with an inflection of this kind need the width.
        """
        system, x = trial.system, trial.x
        states, p = system.states(x), _Numbers(dict(zip(system.problem.parameters, system.all_parameters(x))))
        natural, n = self.material.datum("kappa_n"), self.problem.dimension
        kappa_n = np.array([natural(t, p) for t in system.nodes])
        moments = _components(states.T[:4], states.T[n : n + 4])[0]
        values = moments + self.material.other_side(p) * kappa_n
        return float(values.min() / max(abs(values).max(), _LOOSE))

    def _convexity(self, trial: Trial) -> float:
        """Return the least det D2U/(U_11 U_33) at the nodes and halfway between: positive where U is convex."""
        system, x = trial.system, trial.x
        p = _Numbers(dict(zip(system.problem.parameters, system.all_parameters(x))))
        omega = self.strains(system, x)
        if not np.all(np.isfinite(omega)):
            return -1.0
        places = np.concatenate([omega, (omega[1:] + omega[:-1]) / 2])
        t = np.concatenate([system.nodes, (system.nodes[1:] + system.nodes[:-1]) / 2])
        least = math.inf
        for s, (w1, _, w3) in zip(t, places):
            U11, U13, U33 = self.material.curvatures(s, w1, w3, p)
            least = min(least, (U11 * U33 - U13**2) / (U11 * U33) if U11 > 0 and U33 > 0 else -1.0)
        return least

    # --- what a state is ----------------------------------------------------------------------------------------------

    def reactions(self, point: Point) -> dict[str, float]:
        """Return the force and the moment on the strip at the last end, then at the first one, on the lab axes."""
        return self.reactions_of(point.system.states(point.x))

    def reactions_of(self, states: np.ndarray) -> dict[str, float]:
        """Return the same from the states (K, 2n) at the nodes."""
        n = self.problem.dimension
        values = []
        roller = 0.0 if self.roller is None else float(states[0, -1])
        before = np.zeros(3) if self.roller is None else roller * np.array(self.roller.direction)
        for row, sign, more in ((states[-1], 1.0, 0.0), (states[0], -1.0, before)):
            q, lam = row[:4], row[n : n + 7]
            values += [*(sign * (lam[4:7] + more)), *(sign * _moment(q, lam[:4]))]
        found = dict(zip(REACTIONS, map(float, values)))
        return found if self.roller is None else {**found, "F_roller": roller}

    def potential(self, point: Point) -> float:
        """Return the energy with the potential of the dead loads at the last end: that of which the index is."""
        loads = self._end_energy()
        if loads is None:
            return point["energy"]
        last = point.system.states(point.x)[-1]
        return point["energy"] + float(loads(None, _LastEnd(*last[:7]), _Numbers(point.parameters)))

    def strains(self, system: Collocation, x: np.ndarray) -> np.ndarray:
        """Return omega_1, omega_2 and omega_3 (K, 3) at the nodes of a discretized state."""
        return self.strains_at(system.nodes, system.states(x), system.all_parameters(x))

    def strains_at(self, t: np.ndarray, states: np.ndarray, p: np.ndarray) -> np.ndarray:
        """Return the same at places t (K,) with states (K, 2n) and the values of all parameters."""
        return strains_of(states[:, :4], self.problem.batch("field").values(t, states, states[:0], p))

    def shape(self, point: Point) -> Shape:
        """Return the strip in space, of length 1."""
        return shape_of(point.system.nodes, point.system.states(point.x), self.strains(point.system, point.x))


#: Why a run ends where its law does.
LAW_ENDS = {
    RIBBON.name: "the end of the law 'ribbon', which has no value where the bending vanishes (omega_1 -> 0); the law "
    "'finite width' goes on",
    FINITE_WIDTH.name: "the end of the law 'finite width', whose energy is not convex at larger twist; the law 'flat rod' "
    "goes on",
}
#: A run that fails with a smaller margin of its law has met the end of it. The margin falls like a square root there.
_NEARLY_ENDED = 0.1
#: Why a state is not determined.
UNHELD = (
    "ends: the strip can move, turn about itself or change its shape without a change of energy, so nothing determines its "
    "state; hold more, or give one of the phases " + ", ".join(map(repr, PHASES))
)
#: Why reactions are not determined.
UNDETERMINED = (
    "ends: what is held there repeats itself in this state, so the reactions are not determined (a straight strip is held at "
    "its full length, or does not bend in its plane and is held sideways at both ends); begin with an arch, a twist or a "
    "softness, or hold less"
)
#: How `contin.solve` begins to say that no state was found, and what that means here.
_NO_CONVERGENCE = "Newton did not converge"
NOT_FOUND = (
    "no equilibrium was found near the first guess; begin with smaller loads, or nearer to the natural state, and follow these "
    "numbers in a stage, or begin with another first state"
)
#: Place of the last end from the first one, as integrals over the strip.
_PLACES = dict(zip(PLACE, (lambda t, x, w, p: w.x1, lambda t, x, w, p: w.x2, lambda t, x, w, p: w.x3)))
_STRAINS = ("kappa_n", "kappa_2", "tau_n")


def _together(functions: tuple[Callable, ...]) -> Callable:
    """Return the sum of these densities times their multipliers."""
    if not functions:
        return lambda t, x, lam, p: 0
    rest, last, place = _together(functions[:-1]), functions[-1], len(functions) - 1
    return lambda t, x, lam, p: rest(t, x, lam, p) + lam[place] * last(t, x, p)


def _of_phase(name: str) -> Callable:
    """Return the density of a phase as that of a roller is given."""
    phase = PHASES[name]
    return lambda t, x, p: phase(t, x)


#: States of the last end, as the potential of its loads takes them.
_LastEnd = namedtuple("_LastEnd", (*FRAME, *CENTRELINE))


class _Numbers:
    """Numbers by name as attributes, as users' functions read parameters."""

    def __init__(self, values: Mapping[str, float]):
        self.__dict__.update(values)


def strains_of(q: np.ndarray, rates: np.ndarray) -> np.ndarray:
    """Return strains (K, 3) from quaternions (K, 4) and their rates: the inverse of `equilibrium.spin`."""
    q0, q1, q2, q3 = q.T
    r0, r1, r2, r3 = rates[:, :4].T
    return 2 * np.array([
        q0 * r1 - q1 * r0 - q2 * r3 + q3 * r2, q0 * r2 - q2 * r0 - q3 * r1 + q1 * r3, q0 * r3 - q3 * r0 - q1 * r2 + q2 * r1
    ]).T  # fmt: skip


def shape_of(t: np.ndarray, states: np.ndarray, omega: np.ndarray) -> Shape:
    """Return the shape of states (K, >= 7) with strains (K, 3) at places t (K,)."""
    eta = np.divide(omega[:, 2], omega[:, 0], out=np.zeros(len(t)), where=omega[:, 0] != 0)
    return Shape(np.asarray(t), states[:, 4:7], frames(states), eta)


def _components(q, lam) -> np.ndarray:
    """Return the moment on the directors, shape (3, ...), from quaternions (4, ...) and their multipliers (4, ...)."""
    rates = spin(*q, 1, 0, 0, 1), spin(*q, 0, 1, 0, 1), spin(*q, 0, 0, 1, 1)
    return np.array([sum(a * b for a, b in zip(lam, rate)) for rate in rates])


def _moment(q, lam) -> np.ndarray:
    """Return the moment on the lab axes from the multipliers of the quaternion."""
    result: np.ndarray = _components(q, lam) @ np.array(directors(*q)).reshape(3, 3)
    return result


def _helix(strains: np.ndarray, t: np.ndarray) -> np.ndarray:
    """Return quaternion and centreline (K, 7) at places t (K,) of a strip whose strains are constant."""
    size = float(np.linalg.norm(strains))
    axis, tangent = strains / (size or 1.0), np.array([0.0, 0.0, 1.0])
    half, angle = size * t[:, None] / 2, size * t[:, None]
    sine = np.sin(angle) / size if size else t[:, None]
    cosine = 2 * np.sin(half) ** 2 / (size or 1.0)  # (1 - cos)/size without cancellation
    place = axis * axis[2] * (t[:, None] - sine) + tangent * sine + np.cross(axis, tangent) * cosine
    return np.hstack([np.cos(half), np.sin(half) * axis, place])


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


def forces_of(finish: End) -> tuple[str, ...]:
    """Return the names of the dead forces that can act on the last end: along directions in which its place is not held."""
    return tuple(name for name, axis in zip(FORCES, DIRECTIONS.values()) if not _spanned(axis, finish.held))


def replacing_loads(finish: End) -> tuple[str, ...]:
    """Return the names of the dead loads that can replace reactions of the last end: forces, and the moment of a hinge."""
    return (*forces_of(finish), *(("moment",) if finish.rotation in (HINGED, JOINT) else ()))


def _spanned(axis, held) -> bool:
    """Return whether a direction lies in the span of those that are held: a force along it would do nothing."""
    if not held:
        return False
    rest = np.array(axis) - np.linalg.pinv(np.array(held)) @ np.array(held) @ np.array(axis)
    return bool(np.linalg.norm(rest) < _LOOSE)


def _winding(material: Material) -> float:
    """Return the whole angle by which the natural state turns about the width: the integral of kappa_n."""
    datum, p = material.datum("kappa_n"), _Numbers(material.parameters)
    s, weights = np.polynomial.legendre.leggauss(60)
    return float(sum(w / 2 * datum((x + 1) / 2, p) for x, w in zip(s, weights)))


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
    about = end.rotation == HINGED and abs(end.axis[0]) > 1 - _LOOSE
    return about or end.rotation in (FREE, JOINT)
