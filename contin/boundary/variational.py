"""Boundary value problems from an energy, on one or several segments.

The energy is the sum over the segments, as of strings, rods and strips that meet at their ends. Each has its own canonical
equations (`contin.boundary.canonical`), derived once for all that are stated alike; conditions between the ends of any number
of segments, and what balances there, are those of one problem with all states side by side (`contin.boundary.statement`).
"""

from __future__ import annotations

import functools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np

from contin import errors as checks
from contin.arrays import Array, Function
from contin.boundary import statement
from contin.boundary.canonical import Canonical, EndConditions, Variation, canonical
from contin.boundary.second_variation import INDEX, Symmetry, degeneracy, legendre, lies_flat, second_variation, stability_of
from contin.boundary.statement import BoundaryValueProblem, InSegments, Piece, Quantity, between, joint_names
from contin.boundary.system import Collocation
from contin.core.trial import Event, Trial
from contin.errors import ProblemError
from contin.events.arc import SpecialPoint
from contin.events.corner import with_outcomes
from contin.events.labelled import Stability
from contin.functions.batch import Batch
from contin.functions.signature import Arguments, argument_count
from contin.levels import LOCATED
from contin.problems.rewriting import of_parameters
from contin.problems.statement import check_statement, portable
from contin.text import Shown


class VariationalProblem(BoundaryValueProblem):
    """Stationary points of E = integral of L(t, x, w, p) dt + Phi(x(t0), x(t1), p), over controls w(t) with x' = f(t, x, w, p).

    Held are end conditions e(x(t0), x(t1), p) = 0 and integral conditions, the integral of g(t, x, w, p) being zero. The
    equations of the states and their multipliers, and the conditions at free ends, are derived (`contin.boundary.canonical`):
    nothing need be counted. Functions are plain Python with arithmetic and functions of ``math``; x, w and p come as named
    tuples.

    Parameters
    ----------
    energy : callable
        ``energy(t, x, w, p)`` returns the density L, convex in w.
    states : sequence of str
        Names of the n states x.
    parameters : mapping of str to float
        Names and default values.
    kinematics : callable, optional
        ``kinematics(t, x, w, p)`` returns x'. Left out, the controls are the rates: ``w.y`` is y'.
    controls : sequence of str, optional
        Names of the controls, with ``kinematics``.
    ends : callable, optional
        ``ends(x0, x1, p)`` returns what vanishes at the ends. What is not held there is free.
    integrals : mapping of str to callable, optional
        ``g(t, x, w, p)``, whose integral vanishes. Its multiplier is the free parameter ``mu_`` + name.
    end_energy : callable, optional
        ``end_energy(x0, x1, p)`` returns Phi.
    functionals : mapping of str to callable, optional
        ``f(t, x, w, p)``: integrals that are columns of every point. ``energy`` (the integral of L) is one without being named.
    hamiltonian : callable, optional
        ``hamiltonian(t, x, lam, p)``, H = max over w of lam.f - L, where it is known in closed form; instead of ``energy``
        (pass None), ``kinematics`` and ``integrals``.
    symmetries : mapping of str to callable, optional
        Maps of states that leave the energy unchanged, by name: ``map(t, x)`` with t (K,) and x (K, n) at symmetric places t
        returns the image of x, as for `contin.diagram`. Special points say which of them they break.
    phases : sequence of str, optional
        Names of those ``integrals`` that hold by a continuous symmetry and pick one of the solutions that it moves into each
        other; with ``hamiltonian``, of states that accumulate such an integral. Their multipliers are zero then. A run that
        begins where they are not is refused (`ProblemError`), and labelled points at which they are not are noted.
    domain : pair of float
    starts : mapping of str to float, optional
        Where the search for the controls starts at each point (0): in the domain of the energy.
    sizes : mapping of str to float, optional
        Sizes of states, multipliers and parameters whose values may be smaller, or round-off, where a run begins: forces
        without a load. ``sigma`` stands for all multipliers of end conditions.
    work : callable, optional
        ``work(t, x, y, p)``: of loads without an energy, the work per t that they do on the states y, as they are at the states
        x: ``-p.pressure * (y.y * cos(x.angle) - y.x * sin(x.angle))`` for a pressure that follows a curve. States with
        such loads have no index.
    end_work : callable, optional
        ``end_work(x0, x1, y0, y1, p)``: the same at the ends.
    pushes : sequence of int, or mapping of int to str, optional
        Contacts: numbers, from 0, of those ``ends`` that are gaps e >= 0, and names for them. Each has a multiplier ``sigma``
        and the force -sigma >= 0, and one of gap and force is zero. Points BC say which contact touches or lifts off; the index
        counts what is free to move with those that hold. Where a strip touches along its direction, as the middle of a column
        touches a wall, a run ends where it lies flat at the wall: lines of contact are not followed.
    points : sequence of int, optional
        Those contacts that are points, as rollers are, which a strip may bend around.

    Raises
    ------
    ProblemError
        A name or function that cannot be used, an energy that does not determine the controls, end conditions that repeat
        each other; the message says which and why.

    Notes
    -----
    The states of the boundary value problem are x and the multipliers ``lam_`` + name. Besides one parameter to follow, the
    multipliers of integral conditions (``mu_...``) and of end conditions that do more than fix one state (``sigma_1``, ...) are
    free parameters; they are added by themselves. Points of a branch have an ``index``: the number of independent ways to lower
    the energy (`contin.boundary.second_variation`).

    Examples
    --------
    The elastica, clamped at both ends and compressed: y is its angle, the ends lie on one line.

    >>> import math, contin
    >>> strip = VariationalProblem(
    ...     energy=lambda t, x, w, p: w.angle**2 / 2 + p.load * math.cos(x.angle),
    ...     states=["angle"], parameters={"load": 30.0}, ends=lambda a, b, p: (a.angle, b.angle),
    ...     integrals={"offset": lambda t, x, w, p: math.sin(x.angle)},
    ... )
    >>> straight = contin.trace(contin.solve(strip, [0.0]), free=["load"], limits={"load": (30, 60)})
    >>> [(point.label, round(point["load"] / math.pi**2, 6), point.index) for point in straight if point.label]
    [('EP', 3.039636, 0), ('BP', 4.0, 0), ('EP', 6.079271, 1)]
    """

    variation: Variation
    canonical: Canonical
    points: tuple[int, ...] = ()
    symmetries: Mapping[str, Symmetry]

    @checks.arguments
    def __init__(
        self, energy: Function | None, states: Sequence[str], parameters: Mapping[str, float], *,
        kinematics: Function | None = None, controls: Sequence[str] | None = None, ends: Function | None = None,
        integrals: Mapping[str, Function] | None = None, end_energy: Function | None = None,
        functionals: Mapping[str, Function] | None = None, hamiltonian: Function | None = None,
        symmetries: Mapping[str, Symmetry] | None = None, domain: tuple[float, float] = (0.0, 1.0),
        starts: Mapping[str, float] | None = None, phases: Sequence[str] = (), sizes: Mapping[str, float] | None = None,
        work: Function | None = None, end_work: Function | None = None, pushes: Sequence[int] | Mapping[int, str] = (),
        points: Sequence[int] = (),
    ) -> None:  # fmt: skip
        integrals, functionals, starts = integrals or {}, functionals or {}, starts or {}
        names = check_statement(states, parameters, functionals)
        if hamiltonian is not None and (energy is not None or kinematics is not None or integrals):
            raise ProblemError("hamiltonian: stands instead of energy, kinematics and integrals, not beside them")
        if hamiltonian is None and energy is None:
            raise ProblemError("energy: None must be a function of (t, x, w, p), or hamiltonian given")
        if (kinematics is None) != (controls is None):
            raise ProblemError(
                "controls: their names belong to kinematics; without it the controls are the rates of the states"
            )
        control_names = names if controls is None else check_statement(controls, {}, {})
        _check_names(parameters, integrals, functionals)
        for name, value in starts.items():
            if name not in control_names or hamiltonian is not None:
                raise ProblemError(f"starts: {checks.shown(name)} is not one of the controls of an energy")
            checks.number(f"starts: {name}", value)
        held = checks.chosen("phases", phases, names if hamiltonian is not None else tuple(integrals))
        taken = [("energy", energy, 4), ("kinematics", kinematics, 4), ("ends", ends, 3), ("end_energy", end_energy, 3)]
        taken += [("hamiltonian", hamiltonian, 4), ("work", work, 4), ("end_work", end_work, 5)]
        taken += [*((f"integrals: {name}", g, 4) for name, g in integrals.items())]
        for what, function, count in [*taken, *((f"functionals: {name}", f, 4) for name, f in functionals.items())]:
            if function is not None and argument_count(function) != count:
                raise ProblemError(f"{what} must take {count} arguments")
        variation = Variation(
            energy, kinematics, ends, end_energy, hamiltonian, dict(integrals), dict(functionals), names, control_names,
            tuple(parameters), tuple(float(starts.get(name, 0.0)) for name in control_names), work, end_work,
            _contacts(pushes, points),
        )  # fmt: skip
        self._keep(points=tuple(points))
        phases = [f"lam_{name}" if hamiltonian is not None else f"mu_{name}" for name in held]
        self._derive(variation, canonical(variation), parameters, symmetries, phases, domain)
        self._keep(sizes=self._sized(sizes or {}))

    def _derive(
        self, variation: Variation, derived: Canonical, parameters: Mapping[str, float],
        symmetries: Mapping[str, Symmetry] | None, phases: Sequence[str], domain: tuple[float, float] = (0.0, 1.0),
    ) -> None:  # fmt: skip
        """Become the boundary value problem of the derived equations."""
        self._keep(variation=variation, canonical=derived, symmetries=dict(symmetries or {}))
        for name in self.multipliers:
            if name in parameters:
                raise ProblemError(f"parameters: {name} is the name of a multiplier, which is a parameter by itself")
        names = variation.states
        super().__init__(
            derived.rhs, derived.boundary, (*names, *(f"lam_{name}" for name in names)),
            {**parameters, **dict.fromkeys(self.multipliers, 0.0)}, derived.integrals, domain, derived.functionals,
            phases=phases,
        )  # fmt: skip

    def _sized(self, sizes: Mapping[str, float]) -> dict[str, float]:
        found: dict[str, float] = {}
        for name, size in checks.mapping("sizes", sizes, "positive numbers").items():
            checks.chosen("sizes", [name], (*self.state_names, *self.parameters, "sigma"))
            checks.number(f"sizes: {name}", size, 0)
            of_ends = self.multipliers[len(self.variation.integrals) :]
            found |= dict.fromkeys(of_ends if name == "sigma" else [name], size)
        return found

    def _signatures(self) -> Mapping[str, Arguments]:
        v = self.variation
        inside: Arguments = [None, v.states, v.controls, v.parameters]
        ends: Arguments = [v.states, v.states, v.parameters]
        return {
            **dict.fromkeys(("energy", "kinematics", "integrals", "functionals"), inside), "ends": ends, "end_energy": ends,
            "hamiltonian": [None, v.states, v.states, v.parameters], "work": [None, v.states, v.states, v.parameters],
            "end_work": [*[v.states] * 4, v.parameters],
        }  # fmt: skip

    def events(self) -> list[Event]:
        """Return that of Legendre's condition, where the energy ceases to be convex in the controls, and those of contacts."""
        names = dict(zip(self.variation.pushes, self.contacts.values()))
        walls = (lies_flat(number, name) for number, name in names.items() if number not in self.points)
        return [legendre(), *walls]

    @functools.cached_property
    def contacts(self) -> dict[int, str]:
        """Names of contacts, by the place of what decides whether they hold among the recorded conditions."""
        if not self.variation.pushes:
            return {}
        recorded: Any = self.batch("boundary").recorded
        recording, found = recorded.recording, {}
        labels = [*(f"{end}.{state}" for end in "ab" for state in self.state_names), *self.parameters]
        for number, name in self.variation.pushes.items():
            decides, _, gap = recording.tape.operations[recording.results[number]].operands
            found[decides] = name or recording.tape.lines([gap], dict(zip(recording.inputs, labels)))[-1]
        return found

    def touching(self, system: Collocation, x: Array) -> tuple[str, ...]:
        """Return the names of the contacts that hold at a solution x."""
        known = system if system.sides.size or not self.contacts else with_outcomes(system, x)
        origins = self.batch("boundary").conditions(known._free)
        sides = known.sides[known.sides.size - len(origins) :]
        return tuple(self.contacts[origin] for origin, side in zip(origins, sides) if origin in self.contacts and side > 0)

    def stability(self, point: SpecialPoint) -> Stability:
        """Return what the second variation says of a solution."""
        return stability_of(point)

    def degenerate(self, system: Collocation, x: Array) -> str:
        """Return what makes the equations singular at a guess x."""
        reason = degeneracy(system, x) if self.has_index else ""
        return reason and f"{reason}: no solution was found from this guess"

    def undetermined(self, system: Collocation, x: Array) -> str:
        """Return that conditions repeat or contradict each other at a solution x."""
        return degeneracy(system, x, solved=True) if self.has_index else ""

    def index_without_phases(self, trial: Trial) -> int | None:
        """Return the index of a solution where phases are not held, without the modes that symmetries make; None of none."""
        found = second_variation(trial.system, trial.x, phases=False) if self.phases and self.has_index else None
        return None if found is None else int(np.count_nonzero(found.eigenvalues < -LOCATED * np.abs(found.eigenvalues).max()))

    @property
    def has_index(self) -> bool:
        """All loads have an energy."""
        return self.variation.work is None and self.variation.end_work is None

    @property
    def index(self) -> Event | None:
        """The number of independent ways to lower the energy; None with loads that have none."""
        return INDEX if self.has_index else None

    @property
    def multipliers(self) -> tuple[str, ...]:
        """Names of the multipliers that are free on every curve."""
        ends = (f"sigma_{i + 1}" for i in range(self.canonical.sigmas))
        return (*(f"mu_{name}" for name in self.variation.integrals), *ends)

    @property
    def dimension(self) -> int:
        """n, the number of states x."""
        return len(self.variation.states)

    @functools.cached_property
    def legendre(self) -> Batch | None:
        """The pivots of -d2H/dw2, compiled; None where the Hamiltonian is given."""
        if self.canonical.legendre is None:
            return None
        return Batch([self.canonical.legendre], [len(self.variation.controls)], self.state_names, tuple(self.parameters))

    def margin(self, t: Array, u: Array, p: Array) -> float:
        """Return the least pivot of -d2H/dw2 at places t (K,) with u (K, 2n): positive where Legendre's condition holds."""
        if self.legendre is None:
            return math.inf
        values: Any = self.legendre.values(t, u, u[:0], p)
        return float(values.min())


def _contacts(given: Sequence[int] | Mapping[int, str], points: Sequence[int]) -> dict[int, str]:
    """Return the numbers of contacts, some of them ``points``, and their names; "" without one."""
    names = dict(given) if isinstance(given, Mapping) else dict.fromkeys(given, "")
    for number in points:
        if number not in names:
            raise ProblemError(
                f"points: {number} must be one of the pushes: {checks.listed(map(str, names)) or 'there are none'}"
            )
    return names


def _check_names(
    parameters: Mapping[str, float], integrals: Mapping[str, Function], functionals: Mapping[str, Function]
) -> None:
    """Raise ProblemError for names of integrals that cannot be used, and for a parameter that has the name of a column."""
    for name in integrals:
        if not name.isidentifier():
            raise ProblemError(f"integrals: {checks.shown(name)} is not usable as a name (a Python identifier)")
        if f"mu_{name}" in functionals:
            raise ProblemError(f"functionals: mu_{name} is the multiplier of the integral {name}")
    if "energy" in parameters and "energy" not in functionals:
        raise ProblemError("parameters: 'energy' is the name of the energy's own column")


@dataclass(frozen=True, eq=False, repr=False)
class VariationalSegment(checks.Named, Shown):
    """One interval of a `SegmentedVariationalProblem`: what varies there, and its energy.

    Parameters
    ----------
    energy : callable or None
        ``energy(s, x, w, p)``, the density over the coordinate s; None with a Hamiltonian.
    states : sequence of str
        Names of the states, ``x.y``; other segments may have the same.
    length : float, str or callable
        A positive number, the name of a parameter, or ``length(p)``.
    begin : float, str or callable, optional
        The coordinate s at which it begins, likewise.
    kinematics, controls, functionals, hamiltonian, starts, work : optional
        As in `contin.VariationalProblem`.

    Examples
    --------
    A string of tension 1 under a load:

    >>> string = VariationalSegment(lambda s, x, w, p: w.y**2 / 2 + p.load * x.y, ["y"], length=2.0)
    >>> string.states
    ['y']
    """

    energy: Function | None
    states: Sequence[str]
    length: Quantity = 1.0
    begin: Quantity = 0.0
    kinematics: Function | None = None
    controls: Sequence[str] | None = None
    functionals: Mapping[str, Function] = field(default_factory=dict)
    hamiltonian: Function | None = None
    starts: Mapping[str, float] = field(default_factory=dict)
    work: Function | None = None

    @property
    def stated(self) -> dict[str, Any]:
        """What its equations follow from, as arguments of `VariationalProblem`."""
        names = ("energy", "states", "kinematics", "controls", "functionals", "hamiltonian", "starts", "work")
        return {name: getattr(self, name) for name in names}

    @property
    def key(self) -> Any:
        """The same as something to compare: functions are equal if they are one object."""
        values = [tuple(value.items()) if isinstance(value, Mapping) else value for value in self.stated.values()]
        return tuple(tuple(value) if isinstance(value, list) else value for value in values)

    def signatures(self, parameters: tuple[str, ...]) -> dict[str, Arguments]:
        """Return the arguments of its functions."""
        states = tuple(self.states)
        inside: Arguments = [None, states, states if self.controls is None else tuple(self.controls), parameters]
        return {
            "energy": inside, "kinematics": inside, "functionals": inside, "length": [parameters], "begin": [parameters],
            "hamiltonian": [None, states, states, parameters], "work": [None, states, states, parameters],
        }  # fmt: skip

    def portable(self, parameters: tuple[str, ...], known: dict[Any, Any]) -> VariationalSegment:
        """Return the segment with recordings in the place of functions that no other process finds by name.

        ``known`` are those of segments before, by the functions that were recorded.
        """
        signatures = self.signatures(parameters)

        def carried(name: str, value: object) -> Any:
            if isinstance(value, Mapping):
                return {each: carried(name, own) for each, own in value.items()}
            if not callable(value):
                return value
            return known.setdefault((name, value), portable(value, signatures.get(name)))

        return VariationalSegment(**{each.name: carried(each.name, getattr(self, each.name)) for each in fields(self)})


class SegmentedVariationalProblem(InSegments, VariationalProblem):
    """Stationary points of the energy of several segments, with conditions between their ends.

    E = sum over the segments of the integral of L_i(s, x_i, w_i, p) ds, plus an energy of the ends. What is not held at an end
    is free, and what several ends share is in balance there: nothing need be counted.

    Parameters
    ----------
    segments : sequence of VariationalSegment
        Those that are stated with the same functions have the same equations, which are derived once.
    parameters : mapping of str to float
        Names and default values; lengths may be among them.
    ends : callable, optional
        ``ends(a, b, p)`` returns what vanishes: ``a[i]`` holds the states at the beginning of segment i, ``b[i]`` those at its
        end. ``a[1].y - b[0].y`` joins two of them.
    end_energy : callable, optional
        ``end_energy(a, b, p)``.
    symmetries : mapping of str to callable, optional
        Maps of all states, side by side, that leave the energy unchanged; see `VariationalProblem`.
    phases : sequence of str, optional
        Names of states whose multipliers vanish by symmetry; see `VariationalProblem`.
    end_work : callable, optional
        ``end_work(a, b, y_a, y_b, p)``: of loads without an energy, the work that they do on other states; see
        `VariationalProblem`.
    sizes : mapping of str to float, optional
        Of all states and multipliers, and of parameters; see `VariationalProblem`.
    pushes, points : optional
        Contacts, numbers of conditions of ``ends``; see `VariationalProblem`.

    Raises
    ------
    ProblemError
        A segment, a name or a function that cannot be used; the message says which and why.

    Notes
    -----
    Where a name occurs in several segments, the states of the whole problem have the number of the segment behind it, ``y_0``,
    ``y_1``; multipliers are ``lam_y_0``. A guess is a list with one guess of the states for each segment: constant, or a
    function of s. The work grows as the number of segments.

    Examples
    --------
    Three strings of tension 1 and length 1 meet in a point, which carries a weight; their other ends are held at height 0:

    >>> import contin
    >>> string = VariationalSegment(lambda s, x, w, p: w.y**2 / 2, ["y"])
    >>> star = SegmentedVariationalProblem(
    ...     [string] * 3, {"weight": 0.6}, end_energy=lambda a, b, p: p.weight * b[0].y,
    ...     ends=lambda a, b, p: (a[0].y, a[1].y, a[2].y, b[0].y - b[1].y, b[0].y - b[2].y),
    ... )
    >>> point = contin.solve(star, [[0], [0], [0]])
    >>> round(float(point.segment(2)["y"][-1]), 12)
    -0.2
    """

    @checks.arguments
    def __init__(
        self, segments: Sequence[VariationalSegment], parameters: Mapping[str, float], *, ends: Function | None = None,
        end_energy: Function | None = None, symmetries: Mapping[str, Symmetry] | None = None, phases: Sequence[str] = (),
        sizes: Mapping[str, float] | None = None, end_work: Function | None = None,
        pushes: Sequence[int] | Mapping[int, str] = (), points: Sequence[int] = (),
    ) -> None:  # fmt: skip
        given = tuple(checks.sequence("segments", segments, "VariationalSegment"))
        if not given:
            raise ProblemError("segments: there must be at least one")
        own = _statements(given, parameters)
        names = joint_names([each.states for each in given])
        check_statement(names, parameters, {})
        pieces, count = _pieces(given, parameters), len(parameters)
        for what, function, arguments in (("ends", ends, 3), ("end_energy", end_energy, 3), ("end_work", end_work, 5)):
            if function is not None and argument_count(checks.function(what, function)) != arguments:
                raise ProblemError(f"{what} must take {arguments} arguments, (a, b, {'y_a, y_b, ' * (arguments == 5)}p)")
        variation = Variation(
            None, None, ends and between(ends, pieces), end_energy and between(end_energy, pieces), None, {}, {}, names,
            joint_names([each.variation.controls for each in own]), tuple(parameters), (),
            next((each.work for each in given if each.work), None), end_work and _between_both(end_work, pieces),
            _contacts(pushes, points),
        )  # fmt: skip
        at_ends = EndConditions(variation)
        with_multipliers = [each.with_multipliers(len(names)) for each in pieces]
        columns = [{name: _of(f, count) for name, f in each.canonical.functionals.items()} for each in own]
        derived = Canonical(
            statement.side_by_side([_of(each.canonical.rhs, count) for each in own], with_multipliers),
            at_ends.function(), None, statement.sums(columns, with_multipliers),
            _pivots([each.canonical.legendre for each in own], with_multipliers, count), at_ends.sigmas, at_ends.fixed,
        )  # fmt: skip
        self._keep(segments=given, pieces=with_multipliers, points=tuple(points))
        phases = [f"lam_{name}" for name in checks.chosen("phases", phases, names)]
        self._derive(variation, derived, parameters, symmetries, phases)
        self._keep(sizes=self._sized(sizes or {}))

    def _signatures(self) -> Mapping[str, Any]:
        states, parameters = [tuple(segment.states) for segment in self.segments], self.variation.parameters
        found: dict[str, Any] = dict.fromkeys(("ends", "end_energy"), [states, states, parameters])
        found["end_work"] = [*[states] * 4, parameters]
        for i, segment in enumerate(self.segments):
            found |= {f"{name} {i}": arguments for name, arguments in segment.signatures(parameters).items()}
        return found

    def __reduce__(self) -> Any:
        """Carry the functions of segments as recordings, too, where no other process finds them by name."""
        make, (kind, stated) = super().__reduce__()
        known: dict[Any, Any] = {}
        segments = [segment.portable(self.variation.parameters, known) for segment in self.segments]
        return make, (kind, {**stated, "segments": segments})


def _between_both(function: Function, pieces: Sequence[Piece]) -> Function:
    """Return ``function(a, b, y_a, y_b, p)`` of the states of the segments as a function of all states."""
    return lambda *given: function(*(tuple(piece.of(states) for piece in pieces) for states in given[:4]), given[4])


def _statements(segments: Sequence[VariationalSegment], parameters: Mapping[str, float]) -> list[VariationalProblem]:
    """Return each segment as a problem with free ends; one for all that are stated alike."""
    known: dict[Any, VariationalProblem] = {}
    for number, segment in enumerate(segments):
        if segment.key not in known:
            try:
                known[segment.key] = VariationalProblem(parameters=parameters, **segment.stated)
            except ProblemError as error:
                raise ProblemError(f"segments: {number}: {error}") from None
    if len({each.variation.hamiltonian is None for each in known.values()}) > 1:
        raise ProblemError("segments: all must have an energy, or all a hamiltonian")
    return [known[segment.key] for segment in segments]


def _pieces(segments: Sequence[VariationalSegment], parameters: Mapping[str, float]) -> list[Piece]:
    """Return the names and places of the states of segments, with lengths and beginnings as functions."""
    pieces: list[Piece] = []
    for number, segment in enumerate(segments):
        length = of_parameters(f"segments: {number}: length", segment.length, parameters, positive=True)
        begin = of_parameters(f"segments: {number}: begin", segment.begin, parameters)
        first = sum(len(piece.names) for piece in pieces)
        names = tuple(segment.states)
        pieces.append(Piece(names, tuple(range(first, first + len(names))), length, begin))
    return pieces


def _of(function: Function, count: int) -> Function:
    """Return a derived function of a segment as one that takes further parameters, behind its own ``count``."""
    return lambda s, u, p: function(s, u, p[:count])


def _pivots(functions: Sequence[Function | None], pieces: Sequence[Piece], count: int) -> Function | None:
    """Return the pivots of -d2H/dw2 of all segments; None where Hamiltonians are given."""
    given = [function for function in functions if function is not None]
    if not given:
        return None

    def legendre(t: float, u: Any, p: Any) -> Any:
        places = [(piece.begin(p) + piece.length(p) * t, piece.of(u), p[:count]) for piece in pieces]
        return [value for function, at in zip(given, places) for value in function(*at)]

    return legendre
