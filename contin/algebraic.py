"""F(u, p) = 0 through the same loop: the statement, and the system that the continuation works on."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, cast

import numpy as np

from contin import _checks
from contin.compilation import Batch, argument_count, check_statement, outputs
from contin.errors import ProblemError
from contin.events import hopf
from contin.interface import Array, Carrier, ComplexArray, Discretization, Factors, Function
from contin.system import System

if TYPE_CHECKING:
    from contin.events import Monitor
    from contin.mesh import MeshControl


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
        _checks.truth("dynamics", self.dynamics)
        if self.count is not None:
            _checks.whole("count", self.count, 1, 100_000)
        _checks.function("residual", self.residual)
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


class Algebraic(System):
    """An algebraic problem with chosen free parameters, as the continuation sees it.

    Unknowns ``x`` are the states, then the free parameters. The interface is that of
    `contin.collocation.Collocation`; there is no mesh to adapt.

    Raises
    ------
    ProblemError
        An unknown parameter.
    """

    intervals = 0
    degree = 0
    problem: AlgebraicProblem

    def __init__(self, problem: AlgebraicProblem, free: Sequence[str], parameters: Mapping[str, float] | None = None) -> None:
        super().__init__(problem, free, parameters or {})
        self.state_size = len(problem.state_names)
        self.size = self.state_size + len(self.free)
        self.equations = problem.equation_size
        self.weights = np.ones(self.size)

    @property
    def nodes(self) -> Array:
        """One place, shape (1,)."""
        return _NO_TIME

    def states(self, x: Array) -> Array:
        """States, shape (1, n)."""
        return x[: self.state_size].reshape(1, -1)

    def residual(self, x: Array) -> Array:
        """F at x, shape (equations,)."""
        u, p = self.states(x), self.all_parameters(x)
        values: Array = self.problem.batch("residual").values(_NO_TIME, u, _none(self.state_size), p)[0]
        return values

    def _jacobian(self, x: Array) -> tuple[Array, Array]:
        u, p = self.states(x), self.all_parameters(x)
        batch = self.problem.batch("residual")
        values, jacobian = batch.jacobian(_NO_TIME, u, _none(self.state_size), p, batch.seeds(self._free))
        return values[0], jacobian[0]

    def linearize(
        self, x: Array, rows: Sequence[Array] | Array = (), columns: Sequence[Array] | Array = ()
    ) -> tuple[Array, Factors]:
        """Residual at x, and the factored matrix [[F_x, columns^T], [rows]]; see ``Collocation.linearize``."""
        residual, jacobian = self._jacobian(x)
        rows = np.array(rows, dtype=float).reshape(-1, self.size + len(columns))
        columns = np.array(columns, dtype=float).reshape(-1, self.equations)
        return residual, DenseFactors(np.vstack([np.hstack([jacobian, columns.T]), rows]))

    def parameter_columns(self, x: Array, names: Sequence[str]) -> Array:
        """Derivatives of F by any parameters, free or not, shape (equations, len(names))."""
        which = self._indices(names)
        u, p, n = self.states(x), self.all_parameters(x), self.state_size
        batch = self.problem.batch("residual")
        return batch.jacobian(_NO_TIME, u, _none(n), p, batch.seeds(which))[1][0, :, n:]

    def transposed_product(self, x: Array, w: Array) -> Array:
        """F_x^T w, shape (size,)."""
        product: Array = self._jacobian(x)[1].T @ w
        return product

    def eigenvalues(self, x: Array) -> ComplexArray:
        """Eigenvalues of F_u, shape (n,), complex: the stability of the equilibrium of u' = F."""
        return np.linalg.eigvals(self._jacobian(x)[1][:, : self.state_size]).astype(complex, copy=False)

    def monitors(self) -> list[Monitor]:
        """Events of this kind of problem: Hopf points where u' = F."""
        return [hopf()] if self.problem.dynamics else []

    def functionals(self, x: Array) -> Array:
        """Values of the problem's functionals, in their order."""
        if not self.problem.functionals:
            return np.empty(0)
        batch = self.problem.batch("functionals")
        values: Array = batch.values(_NO_TIME, self.states(x), _none(self.state_size), self.all_parameters(x))[0]
        return values

    def carrier(self, other: Discretization) -> Carrier:
        """The function that carries vectors of unknowns to another system of this problem: itself."""
        return np.array

    def refined(self) -> None:
        """None: there is no mesh."""

    def adapted(self, x: Array, control: MeshControl) -> None:
        """None: there is no mesh."""

    def with_parameters(self, values: Mapping[str, float]) -> Algebraic:
        """The same problem with other values of parameters that are not free."""
        return Algebraic(self.problem, self.free, dict(zip(self.problem.parameters, self.parameters)) | dict(values))

    def with_free(self, free: Sequence[str], x: Array) -> tuple[Algebraic, Array]:
        """The same problem with other free parameters (values from x), and x for it."""
        values = dict(zip(self.problem.parameters, self.all_parameters(x)))
        other = Algebraic(self.problem, free, values)
        return other, other.pack(x[: self.state_size], values)


class DenseFactors:
    """LU of a dense matrix with the interface of `contin.condensation.Factorization`."""

    def __init__(self, matrix: Array) -> None:
        if matrix.shape[0] != matrix.shape[1]:
            raise ValueError(f"a matrix of {matrix.shape[0]} rows and {matrix.shape[1]} columns is not square")
        self._matrix = matrix
        #: Sign of the determinant.
        self.sign = np.linalg.slogdet(matrix)[0] if np.all(np.isfinite(matrix)) else np.nan

    def _solve(self, matrix: Array, b: Array) -> Array:
        try:
            return np.ascontiguousarray(np.linalg.solve(matrix, np.asarray(b).T).T)
        except np.linalg.LinAlgError:
            return np.full(np.shape(b), np.nan)

    def solve(self, b: Array) -> Array:
        """The x with J x = b, or for rows of b the rows x; NaN where J is singular."""
        return self._solve(self._matrix, b)

    def solve_transposed(self, c: Array) -> Array:
        """The y with J^T y = c."""
        return self._solve(self._matrix.T, c)


_NO_TIME = np.zeros(1)


def _none(n: int) -> Array:
    return np.empty((0, n))
