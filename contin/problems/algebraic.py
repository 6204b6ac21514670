"""Statement of an algebraic problem F(u, p) = 0."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import cast

from contin import checks
from contin.arrays import Function
from contin.errors import ProblemError
from contin.functions.batch import Batch
from contin.functions.signature import argument_count, outputs
from contin.problems.statement import check_statement


@dataclass(frozen=True, eq=False)
class AlgebraicProblem:
    """F(u, p) = 0, or the equilibria of u' = F(u, p).

    Parameters
    ----------
    residual : callable
        ``F(u, p)`` of two named tuples returns a tuple; compiled and differentiated like a right-hand side.
        With a third argument it fills that array, gets arrays, and ``count`` says how many values.
    states : sequence of str, or int
    parameters : mapping of str to float
        Names and default values.
    functionals : mapping of str to callable
        ``f(u, p)``: columns of every point.
    dynamics : bool
        Whether u' = F(u, p): Hopf points are then looked for. Needs as many equations as states.
    count : int, optional
        Number of equations of a residual that fills an array; as many as states by default.

    Raises
    ------
    ProblemError
    """

    residual: Function
    states: Sequence[str] | int
    parameters: Mapping[str, float]
    functionals: Mapping[str, Function] = field(default_factory=dict)
    dynamics: bool = True
    count: int | None = None
    _shape: int = field(init=False, repr=False)
    _batches: dict[str, Batch] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "states", check_statement(self.states, self.parameters, self.functionals))
        checks.truth("dynamics", self.dynamics)
        if self.count is not None:
            checks.whole("count", self.count, 1, 100_000)
        checks.function("residual", self.residual)
        arguments = argument_count(self.residual)
        if arguments not in (2, 3):
            raise ProblemError(f"residual takes {arguments} arguments, must take 2 (or 3, to fill the last)")
        shape = (self.count or len(self.state_names)) if arguments == 3 else outputs(self.residual, self._arguments, "residual")
        object.__setattr__(self, "_shape", shape)
        if self.dynamics and self.equation_size != len(self.state_names):
            object.__setattr__(self, "dynamics", False)
        object.__setattr__(self, "_batches", {})

    @property
    def state_names(self) -> tuple[str, ...]:
        """Names of the states: ``states``, also where a number was given."""
        return cast(tuple[str, ...], self.states)

    @property
    def _arguments(self) -> tuple[tuple[str, ...], tuple[str, ...]]:
        return (self.state_names, tuple(self.parameters))

    @property
    def equation_size(self) -> int:
        """Number of equations."""
        return max(self._shape, 1)

    @property
    def free_size(self) -> int:
        """Number of free parameters on a curve: equations - states + 1."""
        return self.equation_size - len(self.state_names) + 1

    def batch(self, name: str) -> Batch:
        """The compiled ``"residual"`` or ``"functionals"``; made when first asked."""
        if name not in self._batches:
            functions = [self.residual] if name == "residual" else list(self.functionals.values())
            if name != "residual" and any(outputs(f, self._arguments, "a functional") for f in functions):
                raise ProblemError("functionals: each must be f(u, p) and return one number")
            counts = [self._shape] if name == "residual" else [0] * len(functions)
            self._batches[name] = Batch(functions, counts, *self._arguments, times=False)
        return self._batches[name]
