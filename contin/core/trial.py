"""A corrected point of a curve, and test functions of it."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from contin import errors as checks
from contin.arrays import Array, Numbers
from contin.core.newton import linearized
from contin.core.protocol import Discretization, inner
from contin.linalg.blocks import Factors
from contin.text import Shown


@dataclass(frozen=True, eq=False, repr=False)
class Linearization(Shown):
    """The tangent of a curve at a point, and the factored matrix [F_x; row] right there that it came from.

    - ``tangent`` (ndarray, shape (size,)): Unit tangent.
    - ``sign`` (float): Sign of the determinant of [F_x; row].
    - ``factors`` (Factors or None)
    """

    tangent: Array
    sign: float
    factors: Factors | None = None


def linearization(system: Discretization, x: Array, row: Array) -> Linearization:
    """Return the linearization at x, its tangent with row.tangent > 0."""
    known = linearized(system, x, row)
    if known is not None and known.tangent is not None:
        return Linearization(known.tangent, known.factors.sign, known.factors)
    return linearization_of(system, system.linearize(x, (row,))[1])


def linearization_of(system: Discretization, factors: Factors) -> Linearization:
    """Return the linearization that factors of [F_x; row] give, its tangent with row.tangent > 0."""
    tangent = factors.solve(np.append(np.zeros(system.equations), 1.0))
    return Linearization(tangent / np.sqrt(inner(system, tangent, tangent)), factors.sign, factors)


class Trial:
    """A corrected point as test functions see it: ``trial["mu"]``, ``trial.x``, ``trial.tangent``, ``trial.functionals``.

    Parameters
    ----------
    system : Discretization
    x : ndarray, shape (size,)
    linear : Linearization, or a function that returns it
        A function is called when tangent, sign or factors are first asked for.
    iterations, newton_error : int, float
        Newton iterations taken, and the estimated error that they left.

    Examples
    --------
    >>> from contin import AlgebraicProblem, Event, solve, trace
    >>> parabola = AlgebraicProblem(lambda u, p: (p.a - u.x**2,), ["x"], {"a": 1.0})
    >>> half = Event("UZ", "x = 0.5", lambda trial: trial.x[0] - 0.5)
    >>> branch = trace(solve(parabola, [1.0]), free=["a"], direction=-1, limits={"a": (-1, 4)}, events=[half])
    >>> round(branch.labelled("UZ")[0]["a"], 10)
    0.25
    """

    def __init__(
        self, system: Discretization, x: Array, linear: Linearization | Callable[[], Linearization],
        iterations: int = 0, newton_error: float = 0.0,
    ) -> None:  # fmt: skip
        self.system: Any = system  # tests of a kind of problem ask what systems of that kind know
        self.x = x
        self._settled: Trial | None = None  # not itself: a cycle of references would keep its factors until they are collected
        self.iterations, self.newton_error = iterations, newton_error
        self._linear: Linearization | None = None if callable(linear) else linear
        self._linearize = linear if callable(linear) else None
        self._functionals: dict[str, float] | None = None
        self._discretization_error: float | None = None
        self._values: dict[Event, float] = {}

    def __repr__(self) -> str:
        values = [f"{name}={self[name]:.6g}" for name in self.system.free]
        return f"Trial({', '.join([*values, f'of {self.system!r}'])})"

    @property
    def settled(self) -> Trial:
        """The same point on a mesh with points where conditions on states switch (`contin.core.step`)."""
        return self._settled or self

    @settled.setter
    def settled(self, trial: Trial) -> None:
        self._settled = trial if trial is not self else None

    @classmethod
    def without_tangent(cls, system: Discretization, x: Array) -> Trial:
        """Return the trial of a point whose tangent is not known or, at a branch point, not unique: it is NaN."""
        return cls(system, x, Linearization(np.full_like(x, np.nan), np.nan))

    @property
    def linear(self) -> Linearization:
        """Tangent, sign of the determinant, and factors."""
        if self._linear is None:
            assert self._linearize is not None
            self._linear = self._linearize()
        return self._linear

    @property
    def is_linearized(self) -> bool:
        """The linearization is at hand."""
        return self._linear is not None

    @property
    def tangent(self) -> Array:
        """Unit tangent, shape (size,)."""
        return (self._linear or self.linear).tangent

    @property
    def sign(self) -> float:
        """Sign of the determinant of [F_x; row]."""
        return (self._linear or self.linear).sign

    @property
    def factors(self) -> Any:
        """Factors of [F_x; row]; None where they were not kept."""
        return (self._linear or self.linear).factors

    def refactor(self, row: Array) -> None:
        """Take the factors anew, bordered by ``row``; tangent and sign stay."""
        self._linear = dataclasses.replace(self.linear, factors=self.system.linearize(self.x, (row,))[1])

    def value(self, test: Event) -> float:
        """Return the value of a test function, computed once: a point that two steps share has one value for both."""
        try:
            return self._values[test]
        except KeyError:
            found = self._values[test] = float(test.function(self))
            return found

    @property
    def functionals(self) -> dict[str, float]:
        """The problem's functionals, computed when first asked for."""
        if self._functionals is None:
            self._functionals = dict(zip(self.system.problem.functionals, map(float, self.system.functionals(self.x))))
        return self._functionals

    @property
    def discretization_error(self) -> float:
        """Estimated error that is due to the mesh, relative to 1 + size; computed with Newton's factors when asked for."""
        if not self.system.intervals:
            return 0.0
        if self._discretization_error is None:
            if self.factors is None:
                self.refactor(self.system.weights * self.tangent)
            self._discretization_error = self.system.discretization_error(self.x, self.factors, self)
        return self._discretization_error

    def __getitem__(self, name: str) -> float:
        """Return a parameter, a functional, or a state of an equilibrium, by name."""
        if name in self.system.free:
            at = self.system.parameter_index(name)
            return float(self.x[at] * self.system.free_scales[at - self.system.state_size])
        if name in self.system.problem.functionals:
            return self.functionals[name]
        if name in self.system.named_states and name not in self.system.problem.parameters:
            return float(self.system.states(self.x)[0, self.system.named_states.index(name)])
        return self.system.parameter(self.x, name)


@dataclass(frozen=True, eq=False, repr=False)
class Event(checks.Named, Shown):
    """A function of a trial point whose zeros are special points.

    Attributes
    ----------
    label : str
        AUTO's two letters for the special point.
    name : str
        What the special point is about.
    function : callable
        ``function(trial) -> float``; a `Trial` looks up parameters and functionals by name.
    terminal : bool
        The run stops there.
    confirm : callable, optional
        ``confirm(trial) -> bool`` at the located point: False drops it (a sign change of another cause).
    describe : callable, optional
        ``describe(trial)`` at the located point gives its ``details``.
    limit : bool
        The run must not go where the function is positive: a start on the limit, too, is left inwards only.
    search : callable, optional
        ``search(arc, places)`` returns the special points between places of a step (`contin.events.arc`), where a
        sign does not tell them all; None where it does.
    asks : callable, optional
        ``asks(arc) -> bool``: whether ``search`` may find something in a step; without it, it is called for every step.
    looks : int
        Number of places inside a step where the sign is looked at, too: two zeros in one step leave it as it was at the ends.
    unless : str
        A column; where the user has given a limit for it, the function is not used.
    column : str
        The parameter or functional whose value, fold or extremum is looked for; "" where it is about no column.
    value : float, optional
        The value of the column at the zero.
    normal_form : callable, optional
        The formula of the coefficient that is given there (`contin.events.normal_forms`).
    still : float
        Part of the largest speed of a cycle at which the function is zero, where it is about the least one; kernels watch it.

    Examples
    --------
    A label where the middle of the solution reaches 2:

    >>> import numpy as np
    >>> hot = Event("UZ", "hot", lambda trial: trial.system.evaluate(trial.x, np.array([0.5]))[0, 0] - 2.0)
    """

    __test__ = False  # for pytest: not a class of tests

    label: str
    name: str
    function: Callable[[Trial], float]
    terminal: bool = False
    confirm: Callable[[Trial], bool] | None = None
    describe: Callable[[Trial], object] | None = None
    limit: bool = False
    search: Callable[..., Any] | None = None
    asks: Callable[..., bool] | None = None
    looks: int = 0
    unless: str = ""
    column: str = ""
    value: float | None = None
    normal_form: Callable[..., Numbers] | None = None
    still: float = 0.0

    def __post_init__(self) -> None:
        checks.fields(self)

    def holds_one_of(self, free: Sequence[str]) -> bool:
        """Return whether it vanishes where a free parameter has a value."""
        return self.value is not None and self.column in free

    def passed(self, before: float, after: float) -> bool:
        """Return whether there is a zero between two neighbouring points where the function has these values.

        Examples
        --------
        >>> Event("UZ", "a", lambda trial: trial["a"]).passed(-1.0, 2.0)
        True
        """
        return after >= 0 if self.limit else sign_changed(before, after)


def same_sign(before: float, after: float) -> bool:
    """Return whether two signs of determinants are equal, or nothing is known of both: a solver may not say them."""
    return before == after or (math.isnan(before) and math.isnan(after))


def sign_changed(before: float, after: float) -> bool:
    """Return whether a value passed zero. A zero at the start of a step is not counted again."""
    return before != 0 and (after == 0 or (before < 0) != (after < 0)) and math.isfinite(before) and math.isfinite(after)
