"""Variational problems on several segments that meet at their ends: structures of strings, rods and strips.

The energy is the sum over the segments. Each has its own canonical equations (`contin.boundary.canonical`), derived once for
all that are stated alike; conditions between the ends of any number of segments, and what balances there, are those of one
problem with all states side by side (`contin.boundary.segmented`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from typing import Any

from contin import checks
from contin.arrays import Function
from contin.boundary.canonical import Canonical, EndConditions, Variation
from contin.boundary.second_variation import Symmetry
from contin.boundary.segmented import Piece, Quantity, between, joined_guess, joint_names, side_by_side, sums
from contin.boundary.variational import VariationalProblem
from contin.errors import ProblemError
from contin.functions.signature import Arguments, argument_count
from contin.problems.statement import check_statement, portable
from contin.problems.vector_field import of_parameters
from contin.shown import shown


@dataclass(frozen=True, eq=False)
class VariationalSegment:
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

    __repr__ = shown

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


class SegmentedVariationalProblem(VariationalProblem):
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

    segments: tuple[VariationalSegment, ...]
    pieces: tuple[Piece, ...]

    @checks.arguments
    def __init__(
        self, segments: Sequence[VariationalSegment], parameters: Mapping[str, float], *, ends: Function | None = None,
        end_energy: Function | None = None, symmetries: Mapping[str, Symmetry] | None = None, phases: Sequence[str] = (),
        sizes: Mapping[str, float] | None = None, end_work: Function | None = None,
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
        )  # fmt: skip
        at_ends = EndConditions(variation)
        with_multipliers = [each.with_multipliers(len(names)) for each in pieces]
        columns = [{name: _of(f, count) for name, f in each.canonical.functionals.items()} for each in own]
        derived = Canonical(
            side_by_side([_of(each.canonical.rhs, count) for each in own], with_multipliers), at_ends.function(), None,
            sums(columns, with_multipliers), _pivots([each.canonical.legendre for each in own], with_multipliers, count),
            at_ends.sigmas, at_ends.fixed,
        )  # fmt: skip
        self._keep(segments=given, pieces=with_multipliers)
        phases = [f"lam_{name}" for name in checks.chosen("phases", phases, names)]
        self._derive(variation, derived, parameters, symmetries, phases)
        self._keep(sizes=self._sized(sizes or {}))

    def _signatures(self) -> Mapping[str, Any]:
        """Return the arguments of the functions."""
        states, parameters = [tuple(segment.states) for segment in self.segments], self.variation.parameters
        found: dict[str, Any] = dict.fromkeys(("ends", "end_energy"), [states, states, parameters])
        found["end_work"] = [*[states] * 4, parameters]
        for i, segment in enumerate(self.segments):
            found |= {f"{name} {i}": arguments for name, arguments in segment.signatures(parameters).items()}
        return found

    def _compared(self) -> dict[str, Any]:
        segments = {f"{name} {i}": value for i, each in enumerate(self.segments) for name, value in vars(each).items()}
        return {name: value for name, value in self._stated.items() if name != "segments"} | segments

    def __reduce__(self) -> Any:
        """Carry the functions of segments as recordings, too, where no other process finds them by name."""
        make, (kind, stated) = super().__reduce__()
        known: dict[Any, Any] = {}
        segments = [segment.portable(self.variation.parameters, known) for segment in self.segments]
        return make, (kind, {**stated, "segments": segments})

    def whole_guess(self, guess: object, parameters: Mapping[str, float]) -> Any:
        """Return a guess of all states, on [0, 1], of a list with one for each segment: constant, or a function of s.

        Raises
        ------
        ProblemError
            Another number of them.
        """
        return joined_guess(guess, self.pieces, [len(segment.states) for segment in self.segments], parameters)


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
