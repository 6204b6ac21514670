"""What the user states: a boundary value problem in plain functions and names; no numerics here."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import cast

from contin import checks
from contin.arrays import Function, Indices
from contin.errors import ProblemError
from contin.functions.batch import Batch
from contin.functions.colouring import Seeds
from contin.functions.signature import argument_count, outputs
from contin.problems.statement import check_statement

#: Names of the arguments of a function that are named tuples; None for one that is a number.
_Arguments = Sequence[tuple[str, ...] | None]
_MOST_CONDITIONS = 100_000


@dataclass(frozen=True, eq=False)
class BoundaryValueProblem:
    """u' = rhs(t, u, p) on ``domain``, with conditions at both ends and under the integral.

    Every function is plain Python; ``u`` and ``p`` come as named tuples (``u.x``, ``p.mu``, ``x, y = u``). They are
    compiled, and differentiated to round-off by the complex step (comparisons then decide on real parts).
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

    Raises
    ------
    ProblemError
        A name, a domain or a function that cannot be used; the message says which and why.

    Notes
    -----
    A curve needs n_bc + n_int - n + 1 free parameters, an isolated solution one fewer.
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
    _counts: dict[str, int] = field(init=False, repr=False)
    _batches: dict[str, Batch] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "states", check_statement(self.states, self.parameters, self.functionals))
        ends = tuple(checks.sequence("domain", self.domain, "two finite numbers, the first the smaller"))
        numbers = len(ends) == 2 and all(checks.is_number(end) and math.isfinite(end) for end in ends)
        if not (numbers and ends[0] < ends[1]):
            raise ProblemError(f"domain: {checks.shown(self.domain)} must be two finite numbers, the first the smaller")
        p, u = tuple(self.parameters), self.state_names
        counts = {
            "rhs": self._count("rhs", self.rhs, (None, u, p), len(u)),
            "boundary": self._count("boundary", self.boundary, (u, u, p), self.boundary_count),
            "integrals": self._count("integrals", self.integrals, (None, u, p), self.integral_count),
        }
        if counts["rhs"] != len(u):
            raise ProblemError(f"rhs returns {counts['rhs']} values for the {len(u)} states {', '.join(u[:8])}")
        object.__setattr__(self, "_counts", counts)
        object.__setattr__(self, "_batches", {})

    @staticmethod
    def _count(name: str, function: Function | None, arguments: _Arguments, given: int | None) -> int:
        if function is None and name == "integrals":
            return 0
        function = checks.function(name, function)
        expected = len(arguments)
        if (found := argument_count(function)) not in (expected, expected + 1):
            raise ProblemError(f"{name} takes {found} arguments, must take {expected} (or {expected + 1}, to fill the last)")
        if found == expected + 1:
            if given is None:
                raise ProblemError(f"{name} fills an array: say how many values with {name.rstrip('s')}_count")
            checks.whole(f"{name.rstrip('s')}_count", given, 1, _MOST_CONDITIONS)
            return given
        return max(outputs(function, arguments, name), 1)

    @property
    def state_names(self) -> tuple[str, ...]:
        """Names of the states: ``states``, also where a number was given."""
        return cast(tuple[str, ...], self.states)

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
        """The compiled ``"field"`` (rhs and integrals), ``"boundary"`` or ``"functionals"``; made when first asked."""
        if name not in self._batches:
            self._batches[name] = self._compile(name)
        return self._batches[name]

    def seeds(self, free: Indices, order: Indices) -> tuple[Seeds, Seeds]:
        """What to perturb for the Jacobians of field, by states in this ``order``, and boundary; by ``free`` parameters too."""
        return self.batch("field").seeds(free, order), self.batch("boundary").seeds(free)

    def _compile(self, name: str) -> Batch:
        p, u = tuple(self.parameters), self.state_names
        if name == "boundary":
            return Batch([self.boundary], [self._shape(self.boundary, (u, u, p), self.boundary_size)], u, p, ends=True)
        if name == "functionals":
            functions = list(self.functionals.values())
            if any(argument_count(f) != 3 or outputs(f, (None, u, p), "a functional") for f in functions):
                raise ProblemError("functionals: each must be f(t, u, p) and return one number")
            return Batch(functions, [0] * len(functions), u, p)
        functions = [f for f in (self.rhs, self.integrals) if f is not None]
        sizes = (len(u), self.integral_size)
        return Batch(functions, [self._shape(f, (None, u, p), size) for f, size in zip(functions, sizes)], u, p)

    @staticmethod
    def _shape(function: Function, arguments: _Arguments, size: int) -> int:
        """The size as a Batch wants it: 0 for a function that returns a bare number."""
        if size > 1 or argument_count(function) == len(arguments) + 1:
            return size
        return outputs(function, arguments, function.__name__)
