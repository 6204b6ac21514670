"""Boundary value problems: what users state, on one or several segments.

Each of several segments has its own equations, states and length; it is mapped to [0, 1], and the states of all stand side by
side: u' = rhs(s, u, p) on a segment that begins at s = a and has the length l becomes du/dt = l rhs(a + l t, u, p). Segments do
not depend on each other but through the conditions at their ends, so elimination treats them one by one
(`contin.linalg.blocks`).
"""

from __future__ import annotations

import functools
import math
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple, cast

import numpy as np

from contin import errors as checks
from contin.arrays import Array, Function, Named, Places
from contin.boundary.system import Collocation
from contin.collocation.mesh import usual_degree
from contin.core.system import Scales
from contin.core.trial import Event
from contin.errors import ProblemError
from contin.events.arc import SpecialPoint
from contin.events.labelled import Stability
from contin.functions.batch import Batch
from contin.functions.recording import result_count
from contin.functions.signature import Arguments, Signature, argument_count, named_values
from contin.problems.statement import MOST_CONDITIONS, Restated, check_statement, portable
from contin.text import Shown, shown


@dataclass(frozen=True, eq=False, repr=False)
class BoundaryValueProblem(Restated):
    """u' = rhs(t, u, p) on ``domain``, with conditions at both ends and under the integral.

    Every function is plain Python; ``u`` and ``p`` come as named tuples (``u.x``, ``p.mu``, ``x, y = u``). They are
    recorded, and differentiated exactly (a comparison compares values; the derivative is that of the case that applies).
    A function with one argument more fills that array instead of returning a tuple, and gets arrays: the way for
    states too many to name. It then needs ``boundary_count`` or ``integral_count``.

    Parameters
    ----------
    rhs : callable
        ``rhs(t, u, p)`` returns the n derivatives.
    boundary : callable
        ``boundary(u0, u1, p)`` returns the n_bc quantities that vanish, from the states at both ends.
    states : sequence of str, or int
        Names of the n states; a number n stands for u0, u1, ...
    parameters : mapping of str to float
        Names and default values.
    integrals : callable, optional
        ``integrals(t, u, p)`` returns the n_int integrands whose integral over the domain vanishes.
    domain : pair of float
        Ends of the independent variable, finite and increasing.
    functionals : mapping of str to callable, optional
        ``f(t, u, p)``: integrands whose integrals over the domain are columns of every point.
    boundary_count, integral_count : int, optional
        Numbers of values of ``boundary`` and ``integrals`` where these fill an array.
    phases : sequence of str, optional
        Names of parameters, or of states, that are zero where phase conditions hold by symmetry: the unfolding numbers that
        make the equations as many as the unknowns. A run notes labelled points at which they are not zero.
    rates : mapping of str to callable, optional
        Of steady states of fields that move in time: ``rates={"v": f}`` says that the equation of the state v is v' = rhs +
        f(t, u, w, p), linear in the rates in time w of the states (``w.u`` is u_t). Points are then stable or not, Hopf points
        are looked for, and `Point.spectrum` returns eigenvalues. The first free parameter is held in time.

    Raises
    ------
    ProblemError
        A name, a domain or a function that cannot be used; the message says which and why.

    Notes
    -----
    A curve needs n_bc + n_int - n + 1 free parameters, an isolated solution one fewer.

    Examples
    --------
    Bratu's problem u'' + lam exp(u) = 0, u(0) = u(1) = 0:

    >>> import math
    >>> problem = BoundaryValueProblem(
    ...     rhs=lambda t, u, p: (u.v, -p.lam * math.exp(u.u)), boundary=lambda a, b, p: (a.u, b.u),
    ...     states=["u", "v"], parameters={"lam": 0.0},
    ... )
    >>> problem.free_size
    1
    """

    rhs: Function
    boundary: Function
    states: Sequence[str] | int
    parameters: Mapping[str, float]
    integrals: Function | None = None
    domain: tuple[float, float] = (0.0, 1.0)
    functionals: Mapping[str, Function] = field(default_factory=dict)
    boundary_count: int | None = None
    integral_count: int | None = None
    phases: Sequence[str] = ()
    rates: Mapping[str, Function] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self._keep(states=check_statement(self.states, self.parameters, self.functionals))
        ends = tuple(checks.sequence("domain", self.domain, "two finite numbers, the first the smaller"))
        numbers = len(ends) == 2 and all(checks.is_number(end) and math.isfinite(end) for end in ends)
        if not (numbers and ends[0] < ends[1]):
            raise ProblemError(f"domain: {checks.shown(self.domain)} must be two finite numbers, the first the smaller")
        if self._counts["rhs"] != len(self.state_names):
            given = ", ".join(self.state_names[:8])
            raise ProblemError(f"rhs returns {self._counts['rhs']} values for the {len(self.state_names)} states {given}")
        self._keep(phases=checks.chosen("phases", self.phases, (*self.parameters, *self.state_names)))
        for name, function in checks.mapping("rates", self.rates, "functions").items():
            checks.chosen("rates", [name], self.state_names)
            if argument_count(checks.function(f"rates: {name}", function)) != 4:
                raise ProblemError(f"rates: {name} must be a function of 4 arguments, (t, u, w, p)")
            if result_count(function, self._signatures()["rates"], f"rates: {name}"):
                raise ProblemError(f"rates: {name} must return one number")

    def discretized(
        self, free: Sequence[str], parameters: Mapping[str, float], scales: Scales | None = None, mesh: Places = (),
        degree: int = 0,
    ) -> Collocation:  # fmt: skip
        """Return F(x) = 0 with these free parameters and sizes, on a mesh."""
        if not self.rates:
            return Collocation(self, mesh, degree, free, parameters, scales)
        from contin.boundary.fields import Fields  # Hopf points and their curves, which solutions without rates have not

        return Fields(self, mesh, degree, free, parameters, scales)

    def whole_guess(self, guess: object, parameters: Mapping[str, float]) -> Any:
        """Return a guess of all states for one that a user gives."""
        return guess

    def usual_degree(self, tolerance: float) -> int:
        """Return the degree of a mesh where none is given."""
        return usual_degree(len(self.state_names), tolerance)

    def stability(self, point: SpecialPoint) -> Stability:
        """Return index, nullity and broken symmetries of a solution, of a statement with an energy."""
        raise NotImplementedError("there is no energy")

    def degenerate(self, system: Collocation, x: Array) -> str:
        """Return why Newton's method may have failed at a guess x; see `Discretization.degenerate`."""
        return ""

    def undetermined(self, system: Collocation, x: Array) -> str:
        """Return why a solution x comes with others around it; see `Discretization.undetermined`."""
        return ""

    def events(self) -> list[Event]:
        """Return the test functions that the statement brings."""
        return []

    @property
    def index(self) -> Event | None:
        """The test function whose value is the index of a solution; None without an energy."""
        return None

    @property
    def state_names(self) -> tuple[str, ...]:
        """Names of the states: ``states``, also where a number was given."""
        return cast(tuple[str, ...], self.states)

    @property
    def dynamics(self) -> bool:  # type: ignore[override]  # an attribute of the kinds that are of one kind only
        """The states move in time: solutions are steady."""
        return bool(self.rates)

    @property
    def rate_rows(self) -> list[int]:
        """Places of the states whose equations contain rates in time."""
        return [self.state_names.index(name) for name in self.rates]

    @property
    def boundary_size(self) -> int:
        """n_bc, the number of boundary conditions."""
        return self._counts["boundary"]

    @property
    def integral_size(self) -> int:
        """n_int, the number of integral conditions."""
        return self._counts["integrals"]

    @property
    def free_size(self) -> int:
        """Number of free parameters on a curve of solutions: n_bc + n_int - n + 1."""
        return self.boundary_size + self.integral_size - len(self.state_names) + 1

    def batch(self, name: str) -> Batch:
        """Return the compiled ``"field"`` (rhs and integrals), ``"boundary"``, ``"functionals"`` or ``"rates"``; made when
        first asked. The states of the last one are those of the problem and, behind them, their rates."""
        if name not in self._batches:
            self._batches[name] = self._compiled(name)
        return self._batches[name]

    def _groups(self) -> list[str]:
        return ["field", "boundary", *(name for name in ("functionals", "rates") if getattr(self, name))]

    def equations(self) -> str:
        """Return the equations and conditions as text, as they were recorded or derived.

        Raises
        ------
        ProblemError
            A function is evaluated in Python.

        Examples
        --------
        >>> import math, contin
        >>> elastica = contin.VariationalProblem(
        ...     lambda t, x, w, p: w.angle**2 / 2 + p.load * math.cos(x.angle), ["angle"], {"load": 1.0},
        ...     ends=lambda a, b, p: (a.angle,),
        ... )
        >>> print(elastica.equations())
        angle' = lam_angle
        lam_angle' = -load * sin(angle)
        0 = angle(0)
        0 = lam_angle(1)
        """
        u, p, (a, b) = self.state_names, tuple(self.parameters), self.domain
        inside = self.batch("field").text([*u, *p])
        ends = self.batch("boundary").text([*(f"{name}({a:g})" for name in u), *(f"{name}({b:g})" for name in u), *p])
        left = [*(f"{name}'" for name in u), *["0 = integral of"] * self.integral_size]
        shared, values = inside[: len(inside) - len(left)], inside[len(inside) - len(left) :]
        lines = [*shared, *(f"{name} {value}" if name[0] == "0" else f"{name} = {value}" for name, value in zip(left, values))]
        shared, rates = self._rates_in_words()
        lines = [*shared, *(line + rates.get(line.partition("'")[0], "") for line in lines)]
        count = len(ends) - self.boundary_size
        return "\n".join([*lines, *ends[:count], *(f"0 = {value}" for value in ends[count:])])

    def _rates_in_words(self) -> tuple[list[str], dict[str, str]]:
        """Return what the rates in time use several times, as lines, and what they add to the equations of states by name."""
        if not self.rates:
            return [], {}
        u, count = self.state_names, len(self.rates)
        text = self.batch("rates").text([*u, *(f"{name}_t" for name in u), *self.parameters])
        lines = [re.sub(r"\bz(\d+)\b", r"r\1", line) for line in text]  # z1, z2, ... are those of the right-hand side
        return lines[:-count], {name: f" + {rate}" for name, rate in zip(self.rates, lines[-count:])}

    def _signatures(self) -> Mapping[str, Arguments]:
        point, u = self._of_point.arguments, self.state_names
        ends, rates = self._of_ends.arguments, [None, u, u, tuple(self.parameters)]
        return {"rhs": point, "boundary": ends, "integrals": point, "functionals": point, "rates": rates}

    @property
    def _of_point(self) -> Signature:
        """Arguments of rhs, integrals and functionals."""
        return Signature(self.state_names, tuple(self.parameters))

    @property
    def _of_ends(self) -> Signature:
        """Arguments of boundary."""
        return Signature(self.state_names, tuple(self.parameters), times=False, ends=True)

    @functools.cached_property
    def _counts(self) -> dict[str, int]:
        """Numbers of values of the functions."""
        return {
            "rhs": _value_count("rhs", self.rhs, self._of_point, len(self.state_names)),
            "boundary": _value_count("boundary", self.boundary, self._of_ends, self.boundary_count),
            "integrals": _value_count("integrals", self.integrals, self._of_point, self.integral_count),
        }

    @functools.cached_property
    def _batches(self) -> dict[str, Batch]:
        return {}

    def _compiled(self, name: str) -> Batch:
        u, p = self.state_names, tuple(self.parameters)
        if name == "boundary":
            return Batch([self.boundary], [_shape(self.boundary, self._of_ends, self.boundary_size)], u, p, ends=True)
        if name == "functionals":
            functions = list(self.functionals.values())
            if any(argument_count(f) != 3 or result_count(f, self._of_point.arguments, "a functional") for f in functions):
                raise ProblemError("functionals: each must be f(t, u, p) and return one number")
            return Batch(functions, [0] * len(functions), u, p)
        if name == "rates":
            taken = [_of_both(function, u) for function in self.rates.values()]
            return Batch(taken, [0] * len(taken), [f"{kind}{i}" for kind in "uw" for i in range(len(u))], p)
        functions = [f for f in (self.rhs, self.integrals) if f is not None]
        sizes = (len(u), self.integral_size)
        shapes = [_shape(f, self._of_point, size) for f, size in zip(functions, sizes)]
        return Batch(functions, shapes, u, p)


def _value_count(name: str, function: Function | None, signature: Signature, given: int | None) -> int:
    """Return how many values a function has; ``given`` is that number for one that fills an array.

    Raises ProblemError where it does not take these arguments, or fills an array of unknown size.
    """
    if function is None and name == "integrals":
        return 0
    function = checks.function(name, function)
    expected, found = len(signature.arguments), argument_count(function)
    if found not in (expected, expected + 1):
        raise ProblemError(f"{name} takes {found} arguments, must take {expected} (or {expected + 1}, to fill the last)")
    if found == expected:
        return max(result_count(function, signature.arguments, name), 1)
    if given is None:
        raise ProblemError(f"{name} fills an array: say how many values with {name.rstrip('s')}_count")
    checks.whole(f"{name.rstrip('s')}_count", given, 1, MOST_CONDITIONS)
    return given


def _of_both(function: Function, names: Sequence[str]) -> Function:
    """Return a function of t, states, rates and parameters as one of t, states with the rates behind them, and parameters."""
    states = named_values(tuple(names))

    def of_both(t: Any, both: Any, p: Any) -> Any:
        values = list(both)
        return function(t, states(*values[: len(names)]), states(*values[len(names) :]), p)

    of_both.__name__ = function.__name__
    return of_both


def _shape(function: Function, signature: Signature, size: int) -> int:
    """Return the number of values as a Batch wants it: 0 for a function that returns a bare number."""
    if size > 1 or signature.fills(function):
        return size
    return result_count(function, signature.arguments, function.__name__)


#: A number, the name of a parameter, or a function of the parameters.
Quantity = float | str | Function


@dataclass(frozen=True, eq=False, repr=False)
class Segment(checks.Named, Shown):
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


class InSegments:
    """What problems of several segments share: their equality, and guesses with one part for each segment."""

    segments: tuple[Any, ...]
    pieces: tuple[Piece, ...]
    _stated: dict[str, Any]

    def _compared(self) -> dict[str, Any]:
        segments = {f"{name} {i}": value for i, each in enumerate(self.segments) for name, value in vars(each).items()}
        return {name: value for name, value in self._stated.items() if name != "segments"} | segments

    def whole_guess(self, guess: object, parameters: Mapping[str, float]) -> Any:
        """Return a guess of all states, on [0, 1], of a list with one for each segment: constant, or a function of s.

        Others are returned as they are. Raises ProblemError for another number of them.
        """
        if not isinstance(guess, list) or not any(callable(g) or isinstance(g, (list, tuple, np.ndarray)) for g in guess):
            return guess
        if len(guess) != len(self.pieces):
            raise ProblemError(f"guess: {len(guess)} guesses, must be one for each of the {len(self.pieces)} segments")
        extents = [piece.extent(parameters) for piece in self.pieces]

        def states(t: float) -> Array:
            parts = [np.ravel(g(a + (b - a) * t) if callable(g) else g) for g, (a, b) in zip(guess, extents)]
            for index, (part, segment) in enumerate(zip(parts, self.segments)):
                if part.size != (count := len(segment.states)):
                    raise ProblemError(f"guess: {part.size} numbers for segment {index}, must be its {count} states")
            return np.concatenate(parts)

        return states


class SegmentedProblem(InSegments, BoundaryValueProblem):
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
        names, parameters = [piece.names for piece in self.pieces], tuple(self.parameters)
        found: dict[str, Any] = {"boundary": [names, names, parameters]}
        for number, piece in enumerate(self.pieces):
            found |= {
                f"rhs {number}": [None, piece.names, parameters],
                f"functionals {number}": [None, piece.names, parameters],
            }
            found |= {f"length {number}": [parameters], f"begin {number}": [parameters]}
        return found

    def __reduce__(self) -> Any:
        """Carry the functions of segments as recordings, too, where no other process finds them by name."""
        make, (kind, stated) = super().__reduce__()
        segments = [segment.portable(piece.names, tuple(self.parameters)) for segment, piece in zip(self.segments, self.pieces)]
        return make, (kind, {**stated, "segments": segments})


def _pieces(segments: Sequence[Segment], parameters: Mapping[str, float]) -> tuple[Piece, ...]:
    """Return the segments, checked, with lengths and beginnings as functions."""
    from contin.problems.rewriting import of_parameters  # problems without segments do not need it

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
