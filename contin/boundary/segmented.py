"""Boundary value problems on several intervals: each segment has its own equations, states and length.

Every segment is mapped to [0, 1], and the states of all stand side by side: u' = rhs(s, u, p) on a segment that begins at s = a
and has the length l becomes du/dt = l rhs(a + l t, u, p). Segments do not depend on each other but through the conditions at
their ends, so elimination treats them one by one (`contin.linalg.layout`).
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from contin import checks
from contin.arrays import Array, Function, Named
from contin.boundary.statement import BoundaryValueProblem
from contin.errors import ProblemError
from contin.functions.recording import result_count
from contin.functions.signature import Arguments, Signature, argument_count, named_values
from contin.problems.statement import check_statement, portable
from contin.problems.vector_field import of_parameters
from contin.shown import shown

#: A number, the name of a parameter, or a function of the parameters.
Quantity = float | str | Function


@dataclass(frozen=True, eq=False)
class Segment:
    """One interval of a `SegmentedProblem`, with its own equations.

    Parameters
    ----------
    rhs : callable
        ``rhs(s, u, p)`` returns the derivatives of the states by the coordinate s.
    states : sequence of str
        Names of the states, ``u.theta``; other segments may have the same.
    length : float, str or callable
        A positive number, the name of a parameter, or ``length(p)``.
    begin : float, str or callable, optional
        The coordinate s at which it begins, likewise; where the segment before ends by default, 0 for the first one.
    functionals : mapping of str to callable, optional
        ``f(s, u, p)``: integrands over s. A column is the sum over all segments that have one of its name.

    Examples
    --------
    Heat that flows through a wall, whose thickness is the parameter ``d``:

    >>> wall = Segment(lambda s, u, p: (-u.flux, 0.0), ["heat", "flux"], length="d")
    >>> wall.states
    ['heat', 'flux']
    """

    rhs: Function
    states: Sequence[str]
    length: Quantity = 1.0
    begin: Quantity | None = None
    functionals: Mapping[str, Function] = field(default_factory=dict)

    __repr__ = shown

    def portable(self, names: tuple[str, ...], parameters: tuple[str, ...]) -> Segment:
        """Return the segment with recordings in the place of functions that no other process finds by name."""
        inside: Arguments = [None, names, parameters]
        return Segment(
            portable(self.rhs, inside), self.states, portable(self.length, [parameters]), portable(self.begin, [parameters]),
            portable(self.functionals, inside),
        )  # fmt: skip


class Piece(NamedTuple):
    """A segment as the problem has it: names and places of its states, length and beginning as functions of p."""

    names: tuple[str, ...]
    at: tuple[int, ...]
    length: Function
    begin: Function

    def of(self, u: Any) -> Any:
        """Return its states as a named tuple, from all."""
        return named_values(self.names)(*(u[place] for place in self.at))

    def with_multipliers(self, count: int) -> Piece:
        """Return the piece with a multiplier for each state; those of all ``count`` states stand behind these."""
        names = (*self.names, *(f"lam_{name}" for name in self.names))
        return self._replace(names=names, at=(*self.at, *(count + place for place in self.at)))

    def extent(self, parameters: Mapping[str, float]) -> tuple[float, float]:
        """Return the coordinates of both ends."""
        values = named_values(tuple(parameters))(*parameters.values())
        begin = float(self.begin(values))
        return begin, begin + float(self.length(values))

    def __repr__(self) -> str:
        return shown(self)


class SegmentedProblem(BoundaryValueProblem):
    """A boundary value problem on several intervals, with conditions between their ends.

    Parameters
    ----------
    segments : sequence of Segment
    boundary : callable
        ``boundary(a, b, p)`` returns the quantities that vanish. ``a[i]`` holds the states at the beginning of segment i,
        ``b[i]`` those at its end: ``b[0].u - a[1].u`` where they join.
    parameters : mapping of str to float
        Names and default values; lengths may be among them.

    Raises
    ------
    ProblemError
        A segment, a name or a function that cannot be used; the message says which and why.

    Notes
    -----
    A curve needs conditions - states + 1 free parameters, states of all segments counted. Where a name occurs in several
    segments, the states of the whole problem have the number of the segment behind it, ``u_0``, ``u_1``. All segments share one
    mesh of [0, 1], which is adapted to all of them.

    Examples
    --------
    Heat flows through two layers with an interface at s = .25 and conductivities 1 and 3; the flux is continuous:

    >>> import contin
    >>> layers = contin.SegmentedProblem(
    ...     [contin.Segment(lambda s, u, p: (u.slope, 0.0), ["heat", "slope"], length=0.25),
    ...      contin.Segment(lambda s, u, p: (u.slope, 0.0), ["heat", "slope"], length=0.75)],
    ...     lambda a, b, p: (a[0].heat, b[0].heat - a[1].heat, b[0].slope - p.k * a[1].slope, b[1].heat - 1), {"k": 3.0},
    ... )
    >>> second = contin.solve(layers, [0, 0, 0, 0]).segment(1)
    >>> print(second.s[[0, -1]], second["heat"][[0, -1]])
    [0.25 1.  ] [0.5 1. ]
    """

    segments: tuple[Segment, ...]
    pieces: tuple[Piece, ...]

    def __init__(self, segments: Sequence[Segment], boundary: Function, parameters: Mapping[str, float]) -> None:
        given = tuple(checks.sequence("segments", segments, "Segment"))
        if not given:
            raise ProblemError("segments: there must be at least one")
        for number, segment in enumerate(given):
            checks.instance(f"segments: {number}", segment, Segment, "a Segment")
        pieces = _pieces(given, parameters)
        if argument_count(checks.function("boundary", boundary)) != 3:
            raise ProblemError("boundary must take 3 arguments, (a, b, p)")
        self._keep(segments=given, pieces=pieces)
        super().__init__(
            side_by_side([segment.rhs for segment in given], pieces), between(boundary, pieces),
            joint_names([piece.names for piece in pieces]), parameters,
            functionals=sums([segment.functionals for segment in given], pieces),
        )  # fmt: skip

    def _signatures(self) -> Mapping[str, Any]:
        """Return the arguments of the functions."""
        names, parameters = [piece.names for piece in self.pieces], tuple(self.parameters)
        found: dict[str, Any] = {"boundary": [names, names, parameters]}
        for number, piece in enumerate(self.pieces):
            found |= {
                f"rhs {number}": [None, piece.names, parameters],
                f"functionals {number}": [None, piece.names, parameters],
            }
            found |= {f"length {number}": [parameters], f"begin {number}": [parameters]}
        return found

    def _compared(self) -> dict[str, Any]:
        parts = ("rhs", "states", "length", "begin", "functionals")
        segments = {f"{part} {i}": getattr(segment, part) for i, segment in enumerate(self.segments) for part in parts}
        return {name: value for name, value in self._stated.items() if name != "segments"} | segments

    def __reduce__(self) -> Any:
        """Carry the functions of segments as recordings, too, where no other process finds them by name."""
        make, (kind, stated) = super().__reduce__()
        segments = [segment.portable(piece.names, tuple(self.parameters)) for segment, piece in zip(self.segments, self.pieces)]
        return make, (kind, {**stated, "segments": segments})

    def whole_guess(self, guess: object, parameters: Mapping[str, float]) -> Any:
        """Return a guess of all states, on [0, 1], of a list with one for each segment: constant, or a function of s.

        Raises
        ------
        ProblemError
            Another number of them.
        """
        return joined_guess(guess, self.pieces, [len(piece.names) for piece in self.pieces], parameters)


def joined_guess(guess: object, pieces: Sequence[Piece], counts: Sequence[int], parameters: Mapping[str, float]) -> Any:
    """Return a guess of all states, on [0, 1], of a list with one for each segment, of so many states; others as they are."""
    if not isinstance(guess, list) or not any(callable(each) or isinstance(each, (list, tuple, np.ndarray)) for each in guess):
        return guess
    if len(guess) != len(pieces):
        raise ProblemError(f"guess: {len(guess)} guesses, must be one for each of the {len(pieces)} segments")
    extents = [piece.extent(parameters) for piece in pieces]

    def states(t: float) -> Array:
        parts = [np.ravel(g(a + (b - a) * t) if callable(g) else g) for g, (a, b) in zip(guess, extents)]
        for index, (part, count) in enumerate(zip(parts, counts)):
            if part.size != count:
                raise ProblemError(f"guess: {part.size} numbers for segment {index}, must be its {count} states")
        return np.concatenate(parts)

    return states


def _pieces(segments: Sequence[Segment], parameters: Mapping[str, float]) -> tuple[Piece, ...]:
    """Return the segments, checked, with lengths and beginnings as functions."""
    pieces: list[Piece] = []
    for number, segment in enumerate(segments):
        what = f"segments: {number}: "
        names = check_statement(
            segment.states, parameters, checks.mapping(f"{what}functionals", segment.functionals, "functions")
        )
        _check_function(f"{what}rhs", segment.rhs, Signature(names, tuple(parameters)), len(names))
        for name, function in segment.functionals.items():
            _check_function(f"{what}functionals: {name}", function, Signature(names, tuple(parameters)), 0)
        length = of_parameters(f"{what}length", segment.length, parameters, positive=True)
        if segment.begin is not None:
            begin = of_parameters(f"{what}begin", segment.begin, parameters)
        elif pieces:
            begin = _behind(pieces[-1])
        else:
            begin = of_parameters(f"{what}begin", 0.0, parameters)
        first = sum(len(piece.names) for piece in pieces)
        pieces.append(Piece(names, tuple(range(first, first + len(names))), length, begin))
    return tuple(pieces)


def _behind(piece: Piece) -> Function:
    """Return the end of a segment as a function of p."""

    return lambda p: piece.begin(p) + piece.length(p)


def _check_function(what: str, function: Function, signature: Signature, count: int) -> None:
    if argument_count(checks.function(what, function)) != 3:
        raise ProblemError(f"{what} must take 3 arguments, (s, u, p)")
    found = result_count(function, signature.arguments, what)
    if found != count:
        allowed = f"{count} for the states {', '.join(signature.states)}" if count else "one number"
        raise ProblemError(f"{what} returns {found or 'one number'}{' values' if found else ''}, must return {allowed}")


def joint_names(names: Sequence[Sequence[str]]) -> tuple[str, ...]:
    """Return the names of the states of all segments: with the number of the segment where several have one."""
    count = Counter(name for own in names for name in own)
    return tuple(f"{name}_{i}" if count[name] > 1 else name for i, own in enumerate(names) for name in own)


# --- functions of all states ----------------------------------------------------------------------------------------------


def side_by_side(functions: Sequence[Function], pieces: Sequence[Piece]) -> Function:
    """Return the right-hand side of all states on [0, 1]."""

    def rhs(t: float, u: Named, p: Named) -> Any:
        values: dict[int, Any] = {}
        for function, piece in zip(functions, pieces):
            length = piece.length(p)
            rates = function(piece.begin(p) + length * t, piece.of(u), p)
            values.update((place, length * rate) for place, rate in zip(piece.at, rates))
        return [values[place] for place in range(len(values))]

    return rhs


def between(function: Function, pieces: Sequence[Piece]) -> Function:
    """Return ``function(a, b, p)`` of the states of the segments at both ends as a function of all states there."""

    return lambda a, b, p: function(tuple(piece.of(a) for piece in pieces), tuple(piece.of(b) for piece in pieces), p)


def sums(functionals: Sequence[Mapping[str, Function]], pieces: Sequence[Piece]) -> dict[str, Function]:
    """Return the functionals: sums over the segments that have them."""
    return {name: _sum(name, functionals, pieces) for name in dict.fromkeys(name for own in functionals for name in own)}


def _sum(name: str, functionals: Sequence[Mapping[str, Function]], pieces: Sequence[Piece]) -> Function:
    def functional(t: float, u: Named, p: Named) -> Any:
        total = 0.0
        for own, piece in zip(functionals, pieces):
            if name in own:
                length = piece.length(p)
                total = total + length * own[name](piece.begin(p) + length * t, piece.of(u), p)
        return total

    return functional
