"""What the parts of the engine ask of each other: the interface of a discretized problem, of its factors, of its statement.

The continuation loop, the corrector and the locators know a problem by these alone; `contin.Collocation` and
`contin.Algebraic` are of this kind, and so are the extended systems of `contin.curve`.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Sequence
from typing import Any, Protocol

from contin.arrays import Array
from contin.discretization.mesh import MeshControl
from contin.linalg.factors import Factors
from contin.problems.statement import Statement

#: Takes vectors of unknowns from one discretization of a problem to another.
Carrier = Callable[[Array], Array]


class Equations(Protocol):
    """F(x) = 0, as Newton's method sees it."""

    def residual(self, x: Array) -> Array:
        """F(x), shape (equations,)."""

    def linearize(
        self, x: Array, rows: Sequence[Array] | Array = (), columns: Sequence[Array] | Array = ()
    ) -> tuple[Array, Factors]:
        """F(x), and the factored matrix [[F_x, columns^T], [rows]]."""


class Discretization(Equations, Protocol):
    """F(x) = 0 with free parameters at the end of x, as the continuation sees it.

    Attributes
    ----------
    problem : Statement
    free : tuple of str
        The free parameters.
    size, state_size, equations : int
        Unknowns; where the free parameters begin among them; equations.
    weights : ndarray, shape (size,)
        Of the inner product.
    intervals, degree : int
        Of the mesh; 0 without one.
    """

    problem: Statement
    free: tuple[str, ...]
    size: int
    state_size: int
    equations: int
    weights: Array
    intervals: int
    degree: int

    @property
    @abstractmethod
    def nodes(self) -> Array:
        """Where the states are given, shape (K,)."""

    @abstractmethod
    def states(self, x: Array) -> Array:
        """States at the nodes, shape (K, n)."""

    @abstractmethod
    def all_parameters(self, x: Array) -> Array:
        """Values of all parameters."""

    @abstractmethod
    def parameter(self, x: Array, name: str) -> float:
        """The value of one parameter."""

    @abstractmethod
    def parameter_index(self, name: str) -> int:
        """Where a free parameter stands in x."""

    @abstractmethod
    def functionals(self, x: Array) -> Array:
        """Values of the problem's functionals."""

    @abstractmethod
    def carrier(self, other: Any) -> Carrier:
        """The function that carries vectors of unknowns to another discretization of this problem."""

    @abstractmethod
    def refined(self) -> tuple[Discretization, Carrier] | None:
        """The same on every interval halved, and the carrier; None without a mesh."""

    @abstractmethod
    def adapted(self, x: Array, control: MeshControl) -> tuple[Discretization, Carrier] | None:
        """The same on a better mesh for x, and the carrier; None where there is no need."""


def inner(system: Discretization, a: Array, b: Array) -> float:
    """The weighted inner product of two vectors of unknowns."""
    return float((system.weights * a) @ b)
