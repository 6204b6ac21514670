"""Extended systems: a discretized problem with one more condition, that its solution is singular.

They follow the same protocol as the system that they extend, so the same loop continues them in two parameters.
"""

from __future__ import annotations

import dataclasses
from abc import abstractmethod
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from contin.arrays import Array, Function
from contin.collocation.mesh import MeshControl
from contin.collocation.switching import Switching
from contin.core.protocol import Carrier, Discretization
from contin.core.system import System
from contin.errors import ProblemError
from contin.functions.batch import Batch
from contin.linalg.factors import Factors
from contin.problems.statement import Statement, multipliers_of, phases_of
from contin.problems.vector_field import found_elsewhere

#: Cosine between a border and the null vector that it stands for, below which it is renewed: the bordered matrix is then still
#: far from singular (with a cosine of zero it is).
FITS = 0.7

#: The vectors that border the singular matrix: about its null vectors.
Borders = tuple[Array, Array]


class Extended(Discretization):
    """An extended system: unknowns, names and columns are those of the underlying system ``base``.

    Parameters
    ----------
    base : System
        Or an extended system: it has what is used of a system here.
    borders : pair of ndarray, optional
        Made when they are first needed where they are not given.
    columns : sequence of str
        Names of columns beyond those of ``base``.

    Raises
    ------
    ProblemError
        The problem has a column of such a name.
    """

    #: The label of the special points that the curve consists of.
    kind = ""
    #: Size of a further unknown, by which it is divided in x.
    kappa_size = 1.0
    #: The column of extrema that the curve consists of.
    objective = ""

    @property
    def stationary(self) -> str:
        """The column that is stationary at the points of the curve, among all solutions beside them; "" where there is none."""
        return self.objective

    def __init__(self, base: System, borders: Borders | None, columns: Sequence[str] = ()) -> None:
        for name in columns:
            if name in base.problem.parameters or name in base.problem.functionals:
                raise ProblemError(f"start: its problem has a column {name!r}, which is one of the curve; give it another name")
        self.base = base
        self.borders: Any = borders
        self.problem, self.free = _ExtendedStatement(base.problem, len(base.free), tuple(columns)), base.free
        self.weights, self.size, self.state_size = base.weights, base.size, base.state_size
        self.intervals, self.degree = base.intervals, base.degree
        self.scales, self.free_scales = base.scales, base.free_scales

    @classmethod
    def of_size(cls, base: System, size: float) -> Extended:
        """Return the extended system with a given `kappa_size`."""
        return cls(base, None)

    @abstractmethod
    def borders_fit(self, x: Array) -> bool:
        """Return whether the borders are still close to the null vectors at x."""

    @abstractmethod
    def on(self, base: System) -> Extended:
        """Return the extended system of another underlying one, with borders of its own."""

    def with_own_rows(
        self, x: Array, own: tuple[Array, Array], rows: Sequence[Array] | Array, columns: Sequence[Array] | Array
    ) -> tuple[Array, Factors]:
        """Return F and the curve's own values, and the factored bordered matrix: their gradients come first among its rows.

        ``own`` holds the gradients (k, size) and the values (k,), x the unknowns of ``base``.
        """
        gradients, values = own
        rows, columns = self.shaped(rows, columns)
        count = len(gradients)
        top = np.hstack([gradients, columns[:, -count:].T])
        residual, factors = self.base.linearize(x, np.vstack([top, rows]), columns[:, :-count])
        return np.append(residual, values), factors

    def shaped(self, rows: Sequence[Array] | Array, columns: Sequence[Array] | Array) -> tuple[Array, Array]:
        """Return the rows (k, size + m) and columns (m, equations) of a border as arrays, of which there may be none."""
        wide = self.size + len(columns)
        return np.array(rows, dtype=float).reshape(-1, wide), np.array(columns, dtype=float).reshape(-1, self.equations)

    @property
    def nodes(self) -> Array:
        """Nodes of the underlying system."""
        return self.base.nodes

    @property
    def named_states(self) -> tuple[str, ...]:
        """Names of the states that are columns of the underlying system."""
        return self.base.named_states

    def discretization_error(self, x: Array, factors: Factors, columns: Mapping[str, float]) -> float:
        """Return the estimated error of the solution and the parameters; that of the singular vectors is not in it."""
        inside: Any = _Inside(factors, self)
        return self.base.discretization_error(x[: self.base.size], inside, columns)

    def newton_error(self, x: Array, factors: Factors) -> float:
        """Return that of the underlying system."""
        inside: Any = _Inside(factors, self)
        return self.base.newton_error(x[: self.base.size], inside)

    def lifted(self, x: Array, reference: Array) -> Array:
        """Return x with the angles of the underlying system moved by whole rounds, nearest to those of a reference."""
        size = self.base.size
        return np.append(self.base.lifted(x[:size], reference[:size]), x[size:])

    def cut_off_errors(self, x: Array, factors: Factors) -> Array:
        """Return those of the underlying system, along the curve's own equations."""
        inside: Any = _Inside(factors, self)
        return self.base.cut_off_errors(x[: self.base.size], inside)

    def states(self, x: Array) -> Array:
        """Return the states of the underlying system."""
        return self.base.states(x[: self.base.size])

    def evaluate(self, x: Array, times: Array) -> Array:
        """Return the states of the underlying boundary value problem at ``times`` (m,), shape (m, n)."""
        base: Any = self.base
        states: Array = base.evaluate(x[: base.size], times)
        return states

    def all_parameters(self, x: Array) -> Array:
        """Return the values of all parameters."""
        return self.base.all_parameters(x[: self.base.size])

    def parameter(self, x: Array, name: str) -> float:
        """Return the value of one parameter."""
        return self.base.parameter(x[: self.base.size], name)

    def parameter_index(self, name: str) -> int:
        """Return the place of the free parameter ``name`` in x."""
        return self.base.parameter_index(name)

    def functionals(self, x: Array) -> Array:
        """Return the functionals of the underlying problem."""
        return self.base.functionals(x[: self.base.size])

    def column_gradient(self, x: Array, name: str) -> Array | None:
        """Return the derivatives of a column of the underlying problem by x; None where they are not known."""
        inside = self.base.column_gradient(x[: self.base.size], name)
        return None if inside is None else np.append(inside, np.zeros(self.size - self.base.size))

    def with_free(self, free: Sequence[str], x: Array) -> tuple[Extended, Array]:
        """Return the extended system with other free parameters (values from x), and x for it."""
        base, inside = self.base.with_free(free, x[: self.base.size])
        return self.on(base), np.append(inside, x[self.base.size :])

    def carrier(self, other: Any) -> Carrier:
        """Return the carrier of the underlying system's unknowns; it leaves the others as they are."""
        inside, size = self.base.carrier(other.base), self.base.size
        return lambda x: np.concatenate([inside(x[:size]), x[size:]])

    def refined(self) -> tuple[Extended, Carrier] | None:
        """Return the extended system on every interval halved, and the carrier."""
        return self._moved(self.base.refined())

    def switching(self, x: Array) -> Switching:
        """Return where conditions switch along the solution of the underlying system."""
        return self.base.switching(x[: self.base.size])

    def on_switches(self, x: Array, closely: bool = False) -> tuple[Extended, Carrier] | None:
        """Return the extended system on a mesh with those places among its points, and the carrier."""
        return self._moved(self.base.on_switches(x[: self.base.size], closely))

    def adapted(self, x: Array, control: MeshControl) -> tuple[Extended, Carrier] | None:
        """Return the extended system on a better mesh, or with new borders where the old ones do not fit; its carrier."""
        changed = self.base.adapted(x[: self.base.size], control)
        if changed is None and not self.borders_fit(x):
            changed = self.base, np.array
        return self._moved(changed)

    def _moved(self, changed: tuple[System, Carrier] | None) -> tuple[Extended, Carrier] | None:
        if changed is None:
            return None
        other = self.on(changed[0])
        return other, self.carrier(other)

    # --- what is known of the solutions themselves: the unknowns that the curve adds are their own -----------------------

    @property
    def solution(self) -> Discretization:
        """The problem whose solutions are followed."""
        return self.base.solution

    def referring_to(self, x: Array, tangent: Array) -> Extended:
        """Return the same with the solution itself as the reference."""
        size, base = self.base.size, self.base
        found: Any = base.referring_to(x[:size], tangent[:size])
        return self if found is base else self.on(found)

    def in_phase(self, x: Array, vectors: Sequence[Array], reference: Array) -> tuple[Array, list[Array]]:
        """Return the solution itself, and vectors, in phase."""
        size = self.base.size
        inside, others = self.base.in_phase(x[:size], [vector[:size] for vector in vectors], reference[:size])
        return np.append(inside, x[size:]), [np.append(other, vector[size:]) for other, vector in zip(others, vectors)]

    def collapsed(self, x: Array, z: Array) -> bool:
        """Return whether the solution itself has no size."""
        return self.base.collapsed(x[: self.base.size], z[: self.base.size])


class _Inside:
    """Factors of an extended system for right-hand sides of the underlying one: its own equations hold."""

    def __init__(self, factors: Factors, system: Extended) -> None:
        self._factors, self._system = factors, system

    def solve(self, b: Array) -> Array:
        """Return the unknowns of the underlying system."""
        base = self._system.base
        wide = np.zeros((*b.shape[:-1], self._system.equations + 1))
        wide[..., : base.equations], wide[..., -1] = b[..., :-1], b[..., -1]
        found: Array = self._factors.solve(wide)[..., : base.size]
        return found


def cosine(a: Array, b: Any) -> float:
    """Return the absolute cosine between a real vector and a real or complex one."""
    return float(abs(a @ b) / np.sqrt((a @ a) * float(np.vdot(b, b).real)))


@dataclasses.dataclass(frozen=True)
class _ExtendedStatement:
    """The statement behind an extended system: that of the problem, but for the number of free parameters."""

    problem: Statement
    free_size: int
    columns: tuple[str, ...] = ()

    @property
    def states(self) -> Any:
        """Names of the states."""
        return self.problem.states

    @property
    def parameters(self) -> Mapping[str, float]:
        """Parameters of the problem."""
        return self.problem.parameters

    @property
    def functionals(self) -> Mapping[str, Function]:
        """Functionals of the problem, and columns of the curve."""
        return {**self.problem.functionals, **dict.fromkeys(self.columns, found_elsewhere)}

    @property
    def multipliers(self) -> tuple[str, ...]:
        """Those of the problem."""
        return multipliers_of(self.problem)

    @property
    def angles(self) -> Mapping[str, float]:
        """Those of the problem."""
        found: Mapping[str, float] = self.problem.angles
        return found

    @property
    def symmetries(self) -> Mapping[str, Any]:
        """None: images are of solutions."""
        return {}

    @property
    def phases(self) -> tuple[str, ...]:
        """Those of the problem."""
        return phases_of(self.problem)

    def batch(self, name: str) -> Batch:
        """Return functions of the problem, compiled."""
        return self.problem.batch(name)
