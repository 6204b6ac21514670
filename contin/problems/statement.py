"""The statement of a problem: what every kind of problem has, and checks of names and values."""

from __future__ import annotations

import inspect
import keyword
import math
import pickle
from collections.abc import Callable, Collection, Mapping, Sequence
from typing import Any, Protocol

import numpy as np

from contin import errors as checks
from contin.arrays import Function
from contin.errors import ProblemError
from contin.functions.batch import Batch
from contin.functions.recording import function_of
from contin.functions.signature import Arguments
from contin.functions.stand_ins import RecordedFunction
from contin.functions.tape import Unrecordable

#: Bounds on numbers that a user gives, so that a slip of the keyboard is a sentence and not a full memory.
_MOST_STATES = 10_000
MOST_CONDITIONS = 100_000


class Statement(Protocol):
    """A problem as the user states it."""

    @property
    def states(self) -> Any:
        """Names of the states, a tuple."""

    @property
    def parameters(self) -> Mapping[str, float]:
        """Names and default values of the parameters."""

    @property
    def functionals(self) -> Mapping[str, Function]:
        """Names and functions of further columns."""

    @property
    def angles(self) -> Any:
        """Periods of the states that are angles, by name."""

    @property
    def symmetries(self) -> Any:
        """Symmetries that are declared, by name."""

    @property
    def free_size(self) -> int:
        """Number of free parameters on a curve of solutions."""

    def batch(self, name: str) -> Batch:
        """Return some of the functions, compiled."""


class Restated(checks.Named):
    """A statement that can be pickled and compared: it is data.

    Functions that other processes can import are pickled by name, all others as recordings. Two problems are equal if they are
    stated with equal values and functions, recorded.
    """

    _stated: dict[str, Any]

    #: Periods of the states that are angles, by name.
    angles: Any = {}
    #: Symmetries that are declared, by name.
    symmetries: Mapping[str, Any] = {}
    #: Sizes of states and parameters whose values are smaller where a run begins, as forces without a load.
    sizes: Mapping[str, float] = {}
    #: Into how many equal parts a symmetry divides solutions.
    order = 1
    #: The states move in time: solutions are equilibria.
    dynamics = False
    #: A parameter that may be free beyond those that a solution takes: it keeps the value of the guess.
    spare: str | None = None
    #: The parameter that is the length in time of an orbit, "" where that is given; None where solutions are no orbits.
    own_time: str | None = None
    #: Parameters that are the states where an orbit begins, then those where it ends.
    ends: tuple[str, ...] = ()
    #: Functionals that are states which follow from others: their largest and smallest values over a cycle are columns, too.
    following: tuple[str, ...] = ()
    #: A singular mass matrix.
    mass: Any = None
    #: The problem with conserved totals as parameters; None where nothing is conserved.
    reduced: Any = None
    #: Of problems that are put together from segments: their parts.
    pieces: tuple[Any, ...] = ()

    @property
    def conserved(self) -> str:
        """What is conserved, a sentence; "" where nothing is, or states that follow are still there."""
        return ""

    @property
    def on_totals(self) -> Any:
        """`reduced`, or the problem itself where nothing is conserved."""
        return self.reduced or self

    @property
    def dimension(self: Any) -> int:
        """Number of states that a user sees: without multipliers, which a kind may add."""
        return len(self.states)

    def usual_degree(self, tolerance: float) -> int:
        """Return the degree of a mesh where none is given; 0 where there is no mesh."""
        return 0

    def _keep(self, **values: object) -> None:
        """Set fields while a statement is made; from then on it is frozen."""
        for name, value in values.items():
            object.__setattr__(self, name, value)

    def __repr__(self: Any) -> str:
        states, parameters = checks.listed(self.states), checks.listed(self.parameters)
        return f"{type(self).__name__}(states {states}; parameters {parameters or 'none'})"

    def __new__(cls, *arguments: object, **options: object) -> Any:
        """Note the arguments."""
        made = super().__new__(cls, *arguments, **options)
        made._keep(_stated={**dict(zip([*inspect.signature(cls.__init__).parameters][1:], arguments)), **options})
        return made

    def _signatures(self) -> Mapping[str, Arguments]:
        """Return the arguments of the functions that the problem is stated with, by the name of the field."""
        return {}

    def describe(self: Any) -> str:
        """Return a line for each group of functions: how it is evaluated and why, and how many operations it has.

        Examples
        --------
        >>> import contin
        >>> cubic = contin.AlgebraicProblem(lambda u, p: (p.a - u.x**3,), ["x"], {"a": 8.0})
        >>> print(cubic.describe())
        residual: recorded, 3 operations, 6 with all first derivatives
        """
        return "\n".join(f"{name}: {self.batch(name).describe()}" for name in self._groups())

    def _groups(self: Any) -> list[str]:
        """Return the names of the groups of functions."""
        return ["residual"] + ["functionals"] * bool(self.functionals)

    def __reduce__(self) -> Any:
        signatures = self._signatures()
        stated = {name: portable(value, signatures.get(name)) for name, value in self._stated.items()}
        return _restated, (type(self), stated)

    def __eq__(self, other: object) -> bool:
        if self is other:
            return True
        if not isinstance(other, Restated) or type(self) is not type(other):
            return False
        ours, theirs, signatures = self._compared(), other._compared(), self._signatures()
        return ours.keys() == theirs.keys() and all(_equal(ours[name], theirs[name], signatures.get(name)) for name in ours)

    def __hash__(self) -> int:
        return hash((type(self), tuple(self._stated)))

    def _compared(self) -> dict[str, Any]:
        """Return what decides whether two problems are equal, by name."""
        return self._stated


def _restated(kind: type, stated: dict[str, Any]) -> Any:
    return kind(**stated)


def portable(value: object, arguments: Arguments | None) -> Any:
    """Return a value with recordings in the place of functions that no other process finds by their names."""
    return _carried(value, arguments, is_importable)


def is_importable(function: object) -> bool:
    """Return whether another process finds a function by its name."""
    try:
        pickle.dumps(function)
    except Exception:  # whatever pickling it raises
        return False
    return True


def _carried(value: object, arguments: Arguments | None, keep: Callable[[Any], bool]) -> Any:
    """Return a value with recordings in place of functions, except those to keep and those that cannot be recorded."""
    if isinstance(value, Mapping):
        return {name: _carried(each, arguments, keep) for name, each in value.items()}
    if arguments is None or not callable(value) or keep(value):
        return value
    try:
        return function_of(value, arguments)
    except (Unrecordable, ProblemError):
        return value


def _equal(a: object, b: object, arguments: Arguments | None) -> bool:
    """Return whether two values that a problem is stated with are equal, functions by what they compute."""
    if a is b:
        return True
    if isinstance(a, Mapping) and isinstance(b, Mapping):
        return list(a) == list(b) and all(_equal(a[name], b[name], arguments) for name in a)
    if callable(a) and callable(b) and arguments is not None:
        a, b = (_carried(each, arguments, lambda function: isinstance(function, RecordedFunction)) for each in (a, b))
        return bool(a == b)
    try:
        return bool(np.array_equal(np.asarray(a), np.asarray(b)))
    except Exception:  # things of any kind may be compared here
        return False


def forget_changed(problem: object) -> bool:
    """Forget compiled functions that read constants which have changed since; return whether there were any.

    A program may assign a global constant, an attribute of an object or an entry of a dictionary between two runs.
    """
    batches: dict[str, Batch] = getattr(problem, "_batches", {})
    changed = [name for name, batch in batches.items() if not batch.is_current()]
    for name in changed:
        del batches[name]
    return bool(changed)


def declared(problem: object, name: str) -> Any:
    """Return what a statement says of itself or, where it says nothing, what `Restated` says for all: it need not be one."""
    if name == "dimension":
        return getattr(problem, name, len(getattr(problem, "states")))  # noqa: B009
    return getattr(problem, name, getattr(Restated, name))


def with_multipliers(problem: Statement, free: Sequence[str]) -> tuple[str, ...]:
    """Return the free parameters with those that a problem adds by itself: its ``multipliers``, if it has any."""
    names = checks.names("free", free)
    return (*names, *(name for name in multipliers_of(problem) if name not in names))


def multipliers_of(problem: Statement) -> tuple[str, ...]:
    """Return the parameters that are free on every curve of a problem, and need not be named."""
    return getattr(problem, "multipliers", ())


def phases_of(problem: Statement) -> tuple[str, ...]:
    """Return the parameters and states of a problem that are zero where its phase conditions hold by symmetry."""
    return getattr(problem, "phases", ())


def check_statement(
    states: Sequence[str] | int, parameters: Mapping[str, float], functionals: Mapping[str, Function], most: int = _MOST_STATES
) -> tuple[str, ...]:
    """Check names and values of a problem, and return the names of its states (u0, u1, ... for a number of states, ``most``).

    Raises ProblemError otherwise.
    """
    if isinstance(states, (int, np.integer)):
        checks.whole("states", states, 1, most)
        states = [f"u{i}" for i in range(states)]
    names = _usable("states", states)
    if not 1 <= len(names) <= most:
        raise ProblemError(f"states: there must be at least one, and at most {most}")
    _usable("parameters", tuple(checks.mapping("parameters", parameters, "numbers")))
    _usable("functionals", [*checks.mapping("functionals", functionals, "functions"), *parameters])
    for name, value in parameters.items():
        if not checks.is_number(value) or not math.isfinite(value):
            raise ProblemError(f"parameters: {name} = {checks.shown(value)} must be a finite number")
    for name, function in functionals.items():
        checks.function(f"functionals: {name}", function)
    return names


def _usable(kind: str, names: Sequence[str]) -> tuple[str, ...]:
    """Return names as a tuple; raise ProblemError where one cannot be a field of a named tuple, or stands twice."""
    names = tuple(checks.sequence(kind, names, "names"))
    for name in names:
        if not isinstance(name, str) or not name.isidentifier() or keyword.iskeyword(name) or name.startswith("_"):
            raise ProblemError(
                f"{kind}: {checks.shown(name)} is not usable as a name (a Python identifier, no keyword, no leading _)"
            )
        if names.count(name) > 1:
            raise ProblemError(f"{kind}: the name {name!r} stands twice")
    return names


#: The period of a cycle: of an autonomous field a parameter, of a forced one a column.
PERIOD = "period"
#: Of a forced field, the parameter that says after how many periods of the forcing the cycle closes; of a map, after how many
#: rounds.
ROUNDS = "rounds"
#: The time that the computed part of a connecting orbit takes.
TIME = "time"


def rounds_of(free: Sequence[str], parameters: Mapping[str, float]) -> int:
    """Return after how many rounds a cycle of a forced system or a map closes; raise ProblemError if not whole, or free."""
    rounds = parameters[ROUNDS]
    if ROUNDS in free:
        raise ProblemError(f"free: {ROUNDS} must not be free, as it is a whole number")
    if not (rounds >= 1 and rounds == int(rounds)):
        raise ProblemError(f"parameters: {ROUNDS} = {checks.shown(rounds)} must be a whole number from 1")
    return int(rounds)


def unused(name: str, taken: Collection[str]) -> str:
    """Return a name that is not taken."""
    while name in taken:
        name += "_"
    return name
