"""Periodic orbits as the user states them: an autonomous vector field."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from contin import checks
from contin.arrays import Function
from contin.errors import ProblemError
from contin.functions.batch import Batch
from contin.functions.signature import Signature, argument_count, result_count
from contin.problems.algebraic import AlgebraicProblem
from contin.problems.boundary_value import BoundaryValueProblem
from contin.problems.statement import check_statement

#: The name of the period among the parameters.
PERIOD = "period"


class CycleProblem(BoundaryValueProblem):
    """Periodic orbits of u' = F(u, p), on the unit interval: u' = T F(u, p), u(0) = u(1), with a phase condition.

    The phase condition, the integral of u . v' = 0 with an earlier orbit v of the run, keeps the orbit from sliding along
    itself. The period T is the parameter ``period``; it is free on every curve and need not be named.

    Parameters
    ----------
    field : callable
        ``field(u, p)`` returns the rates of the states, as for an `AlgebraicProblem` whose equilibria are looked for.
    states : sequence of str
    parameters : mapping of str to float
        Names and default values.
    functionals : mapping of str to callable, optional
        ``f(u, p)``: means over the period, columns of every point. The largest and the smallest value of each state are
        columns by themselves: ``max_`` and ``min_`` + name.

    Raises
    ------
    ProblemError
        A name or function that cannot be used.

    Examples
    --------
    A circle of radius sqrt(mu), traversed in the time 2 pi:

    >>> import math, contin
    >>> def field(u, p):
    ...     square = u.x**2 + u.y**2
    ...     return p.mu * u.x - u.y - u.x * square, u.x + p.mu * u.y - u.y * square
    >>> problem = CycleProblem(field, ["x", "y"], {"mu": 0.25})
    >>> def guess(t):
    ...     return 0.6 * math.cos(2 * math.pi * t), 0.6 * math.sin(2 * math.pi * t)
    >>> orbit = contin.solve(problem, guess, {"period": 6})
    >>> print(round(orbit["period"] / math.pi, 10), round(orbit["max_x"], 10))
    2.0 0.5
    """

    field: Function
    means: Mapping[str, Function]

    def __init__(
        self, field: Function, states: Sequence[str], parameters: Mapping[str, float], *,
        functionals: Mapping[str, Function] | None = None,
    ) -> None:  # fmt: skip
        means = dict(checks.mapping("functionals", functionals or {}, "functions"))
        names = check_statement(states, parameters, means)
        extremes = [f"{kind}_{name}" for name in names for kind in ("max", "min")]
        for name in (PERIOD, *extremes):
            if name in parameters or name in means:
                raise ProblemError(f"parameters: {name} is a column of every cycle by itself")
        signature = Signature(names, tuple(parameters), times=False)
        if argument_count(checks.function("field", field)) != 2:
            raise ProblemError("field: must be a function of (u, p)")
        count = result_count(field, signature.arguments, "field")
        if count != len(names):
            raise ProblemError(f"field returns {count} values for the {len(names)} states {', '.join(names)}")
        object.__setattr__(self, "field", field)
        object.__setattr__(self, "means", means)
        super().__init__(_scaled_by_period(field, count), _periodic(count), names, {**parameters, PERIOD: 1.0})
        object.__setattr__(self, "functionals", {**dict.fromkeys(extremes, _found_elsewhere), **means})

    @classmethod
    def of(cls, problem: AlgebraicProblem) -> CycleProblem:
        """Return the cycles of the vector field whose equilibria a problem states."""
        return cls(problem.residual, problem.state_names, problem.parameters, functionals=problem.functionals)

    @property
    def multipliers(self) -> tuple[str, ...]:
        """Names of the parameters that are free on every curve."""
        return (PERIOD,)

    @property
    def free_size(self) -> int:
        """Number of free parameters on a curve: one, and the period, for which there is the phase condition."""
        return 2

    def _compiled(self, name: str) -> Batch:
        if name != "functionals":
            return super()._compiled(name)
        functions = [_of_time(f) for f in self.means.values()]
        return Batch(functions, [0] * len(functions), self.state_names, tuple(self.parameters))


def _found_elsewhere(u: Any, p: Any) -> Any:
    """Stand for a column that is not an integral."""
    raise NotImplementedError


def _scaled_by_period(field: Function, count: int) -> Function:
    """Return the field times the period; the text is generated because compiled code has tuples of fixed sizes."""
    scope: dict[str, Any] = {"field": field, "__name__": __name__}
    values = "".join(f"p.period * r[{i}], " for i in range(count))
    exec(f"def rhs(t, u, p):\n    r = field(u, p)\n    return ({values})", scope)
    found: Function = scope["rhs"]
    return found


def _periodic(count: int) -> Function:
    scope: dict[str, Any] = {"__name__": __name__}
    values = "".join(f"a[{i}] - b[{i}], " for i in range(count))
    exec(f"def boundary(a, b, p):\n    return ({values})", scope)
    found: Function = scope["boundary"]
    return found


def _of_time(function: Function) -> Function:
    def mean(t: Any, u: Any, p: Any) -> Any:
        return function(u, p)

    return mean
