"""Defining systems: a discretized problem with further equations g = 0, for which its special points are solutions.

With y the unknowns of the underlying system, which has one free parameter more than a curve of its solutions needs, and z those
that the curve adds, the equations and the matrix of a step are

                                          y      z
        F(y) + psi z = 0               [ F_y    psi ]   N equations of the underlying system
        g(y, z)      = 0               [ g_y    g_z ]   k equations of the curve
                                       [  row       ]   along the curve

Folds, branch points, critical eigenvalues and multipliers, extrema, and zeros of any event differ in g alone. What that is made
of is computed once at each point. They follow the protocol of the system that they extend: the same loop continues them.
"""

from __future__ import annotations

import dataclasses
import math
import operator
from abc import abstractmethod
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple, TypeVar, cast

import numpy as np

from contin.arrays import Array, Function
from contin.collocation.mesh import MeshControl
from contin.core.labels import Label
from contin.core.protocol import Carrier, Discretization
from contin.core.system import System
from contin.core.trial import Event, Trial
from contin.errors import ProblemError
from contin.linalg.blocks import Factors
from contin.linalg.border import ReplacedRows
from contin.problems.rewriting import found_elsewhere
from contin.problems.statement import Statement, multipliers_of, phases_of

#: A curve of cycles ends where they are smaller than this part of a power of two above its largest reference, which does not
#: change with its steps; parameters differ from those of the equilibrium by the square of the size. With 1e-3 of the largest
#: Newton's method fails: the equations are nearly singular.
_SHRUNK = 2e-3

T = TypeVar("T")


class Known(NamedTuple):
    """A residual F, factors of [F_x, columns^T; rows] with any columns and rows, and the solutions for units of all rows."""

    residual: Array
    factors: Factors
    solutions: Array


def _of_the_base(name: str) -> Any:
    """Return the method of this name of the system along which a curve runs, at the unknowns that it knows."""

    def method(self: Defining, x: Array, *more: Any) -> Any:
        return getattr(self.base, name)(self.inside(x), *more)

    return method


def _with_factors(name: str) -> Any:
    """Return such a method that takes factors, too; the error of the singular vectors is not in what it estimates."""

    def method(self: Defining, x: Array, factors: Factors, *more: Any) -> Any:
        return getattr(self.base, name)(self.inside(x), _Inside(factors, self), *more)

    return method


class Defining(Discretization):
    """A defining system: names and columns are those of the underlying system ``base``.

    Raises ProblemError where the problem has a column of such a name.

    - ``base`` (System): Or a defining system: it has what is used of a system here.
    - ``size`` (float): Of the unknowns that the curve adds, by which they are divided in x.

    - ``kind`` (str): The letters of the special points that the curve consists of.
    - ``own_equations``, ``own_unknowns`` (int): k and the number of unknowns z.
    - ``own_columns`` (tuple of str): Names of columns beyond those of ``base``.
    """

    kind = ""
    own_equations, own_unknowns = 1, 0
    own_columns: tuple[str, ...] = ()
    #: The column of extrema that the curve consists of.
    objective = ""

    def __repr__(self) -> str:
        return f"{type(self).__name__}({', '.join(self.free)}; along it {self.base!r})"

    @property
    def stationary(self) -> str:
        """The column that is stationary at the points of the curve, among all solutions beside them; "" where there is none."""
        return self.objective

    def __init__(self, base: System, size: float = 1.0) -> None:
        for name in self.own_columns:
            if name in base.problem.parameters or name in base.problem.functionals:
                raise ProblemError(f"start: its problem has a column {name!r}, which is one of the curve; give it another name")
        self.base, self.kappa_size = base, size
        self.problem, self.free = _Statement(base.problem, len(base.free), self.own_columns), base.free
        self.size, self.equations = base.size + self.own_unknowns, base.equations + self.own_equations
        self.weights, self.state_size = np.append(base.weights, np.ones(self.own_unknowns)), base.state_size
        self.intervals, self.degree = base.intervals, base.degree
        self.scales, self.free_scales = base.scales, base.free_scales
        #: What borders the singular matrix: about its null vectors. Made when first needed, renewed where they have turned.
        self.borders: Any = None
        #: The size of the largest reference of the run, where solutions have one.
        self.largest = float(cast(Any, base).reference_size) if base.size_of_solutions is not None else 0.0
        self._known: dict[str, dict[bytes, Any]] = {}

    def __getstate__(self) -> dict[str, Any]:
        """Return what is pickled: all but what is computed when it is first asked for."""
        return {**vars(self), "_known": {}}

    def on(self, base: System) -> Defining:
        """Return the defining system of another underlying one."""
        return type(self)(base, self.kappa_size)

    # --- what a kind of curve states -------------------------------------------------------------------------------------

    @abstractmethod
    def computed(self, x: Array) -> Any:
        """Return what the own equations are made of."""

    def borders_fit(self, x: Array) -> bool:
        """Return whether rows about a whole space are still close to it at x; single null vectors have theirs renewed there."""
        return True

    @abstractmethod
    def own_values(self, x: Array) -> Array:
        """Return g, shape (k,)."""

    @abstractmethod
    def own_gradients(self, x: Array) -> Array:
        """Return the derivatives of g by x, shape (k, size)."""

    def own_vectors(self, x: Array) -> Array:
        """Return psi, shape (own unknowns, equations of F)."""
        return np.zeros((self.own_unknowns, self.base.equations))

    def on_its_branch(self, x: Array) -> tuple[str, Any]:
        """Return the label and the details that a point of the curve has on the branch of solutions through it."""
        base: Any = self.base
        inner = base.on_curve and not self.kind
        return base.on_its_branch(self.inside(x)) if inner else (self.kind, None)

    def known(self, x: Array) -> Known | None:
        """Return the factored matrix that the own equations are made of; None where it has other rows for F."""
        return None

    # --- the equations ---------------------------------------------------------------------------------------------------

    def at(self, x: Array) -> Any:
        """Return what the own equations are made of at x, computed once."""
        return self.once(self.computed, x)

    def once(self, compute: Callable[[Array], T], x: Array) -> T:
        """Return what a method computes at x; it is kept for the last four: both ends of a step, and two iterates between."""
        key, kept = x.tobytes(), self._known.setdefault(compute.__name__, {})
        if key not in kept:
            if len(kept) > 3:
                del kept[next(iter(kept))]
            kept[key] = compute(x)
        return kept[key]

    def inside(self, x: Array) -> Array:
        """Return the unknowns of the underlying system."""
        return x[: self.base.size]

    def residual(self, x: Array) -> Array:
        """Return F + psi z, and g."""
        known = self.known(x)
        return self._residual(x, self.base.residual(self.inside(x)) if known is None else known.residual)

    def _residual(self, x: Array, inside: Array) -> Array:
        further = inside + x[self.base.size :] @ self.own_vectors(x) if self.own_unknowns else inside
        return np.concatenate([further, self.own_values(x)])

    def linearize(
        self, x: Array, rows: Sequence[Array] | Array = (), columns: Sequence[Array] | Array = ()
    ) -> tuple[Array, Factors]:
        """Return the residual, and the factored bordered matrix: the gradients of g come first among its rows."""
        wide, count, known = self.size + len(columns), self.own_equations, self.known(x)
        rows, gradients = np.array(rows, dtype=float).reshape(-1, wide), self.once(self.own_gradients, x)
        if known is not None and not len(columns):
            replaced = ReplacedRows(known.factors, known.solutions, np.concatenate([gradients, rows]))
            return self._residual(x, known.residual), replaced
        columns = np.array(columns, dtype=float).reshape(-1, self.equations)
        top = np.concatenate([gradients, columns[:, -count:].T], axis=1)
        beside = np.concatenate([self.own_vectors(x), columns[:, :-count]])
        residual, factors = self.base.linearize(self.inside(x), np.concatenate([top, rows]), beside)
        return self._residual(x, residual), factors

    def transposed_product(self, x: Array, w: Array) -> Array:
        """Return the product of w with all derivatives of F + psi z and g, shape (size,)."""
        count = self.base.equations
        inside = np.append(self.base.transposed_product(self.inside(x), w[:count]), self.own_vectors(x) @ w[:count])
        return inside + w[count:] @ self.once(self.own_gradients, x)

    def events(self) -> list[Event]:
        """Return that of the end of a curve where cycles shrink onto an equilibrium; beyond it is itself.

        At the equilibrium the equations of the curve are singular, so the run ends a little before. Other solutions do not
        shrink.
        """

        def amplitude(trial: Trial) -> float:
            system = trial.system
            return float(system.base.amplitude(system.inside(trial.x)) - _SHRUNK * 2.0 ** math.frexp(system.largest)[1])

        name = "the end, near a Hopf point where the cycles have no size"
        return [Event(Label.END, name, amplitude, terminal=True)] if self.base.size_of_solutions is not None else []

    @property
    def nodes(self) -> Array:
        """Nodes of the underlying system."""
        return self.base.nodes

    @property
    def named_states(self) -> tuple[str, ...]:
        """Names of the states that are columns of the underlying system."""
        return self.base.named_states

    def lifted(self, x: Array, reference: Array) -> Array:
        """Return x with the angles of the underlying system moved by whole rounds, nearest to those of a reference."""
        size = self.base.size
        return np.append(self.base.lifted(x[:size], reference[:size]), x[size:])

    states, evaluate, all_parameters, parameter, functionals, switching, check_jumps = map(
        _of_the_base, ("states", "evaluate", "all_parameters", "parameter", "functionals", "switching", "check_jumps")
    )
    lasting = _of_the_base("lasting")
    discretization_error, newton_error, cut_off_errors = map(
        _with_factors, ("discretization_error", "newton_error", "cut_off_errors")
    )

    def parameter_index(self, name: str) -> int:
        return self.base.parameter_index(name)

    def column_gradient(self, x: Array, name: str) -> Array | None:
        """Return the derivatives of a column of the underlying problem by x; None where they are not known."""
        inside = self.base.column_gradient(self.inside(x), name)
        return None if inside is None else np.append(inside, np.zeros(self.size - self.base.size))

    def with_free(self, free: Sequence[str], x: Array) -> tuple[Defining, Array]:
        """Return the defining system with other free parameters (values from x), and x for it."""
        base, inside = self.base.with_free(free, self.inside(x))
        return self.on(base), np.append(inside, x[self.base.size :])

    def carrier(self, other: Any) -> Carrier:
        """Return the carrier of the underlying system's unknowns; it leaves the others as they are."""
        inside, size = self.base.carrier(other.base), self.base.size
        return lambda x: np.concatenate([inside(x[:size]), x[size:]])

    def refined(self) -> tuple[Defining, Carrier] | None:
        """Return the defining system on every interval halved, and the carrier."""
        return self._moved(self.base.refined())

    def on_switches(self, x: Array, closely: bool = False) -> tuple[Defining, Carrier] | None:
        """Return the defining system on a mesh with those places among its points, and the carrier."""
        return self._moved(self.base.on_switches(self.inside(x), closely))

    def round_end(self, x: Array, error: Exception) -> tuple[Defining, Carrier] | None:
        """Return the defining system with a crossing that passes an end of the period, and the carrier."""
        return self._moved(self.base.round_end(self.inside(x), error))

    def adapted(self, x: Array, control: MeshControl) -> tuple[Defining, Carrier] | None:
        """Return the defining system on a better mesh, or with new borders where the old ones do not fit, and the carrier."""
        changed = self.base.adapted(self.inside(x), control)
        if changed is None and not self.borders_fit(x):
            changed = self.base, np.array
        return self._moved(changed)

    def _moved(self, changed: tuple[System, Carrier] | None) -> tuple[Defining, Carrier] | None:
        if changed is None:
            return None
        other = self._renewed(changed[0])
        return other, self.carrier(other)

    def _renewed(self, base: System) -> Defining:
        """Return the defining system of the same run on another mesh, or with another reference."""
        other = self.on(base)
        if type(self).borders_fit is Defining.borders_fit and base.size == self.base.size:  # single null vectors: they are near
            other.borders = self.borders
        other.largest = max(self.largest, other.largest)
        return other

    # --- what is known of the solutions themselves: the unknowns that the curve adds are their own -----------------------

    @property
    def solution(self) -> Discretization:
        """The problem whose solutions are followed."""
        return self.base.solution

    def referring_to(self, x: Array, tangent: Array) -> Defining:
        """Return the same with the solution itself as the reference."""
        size, base = self.base.size, self.base
        found: Any = base.referring_to(x[:size], tangent[:size])
        return self if found is base else self._renewed(found)

    def in_phase(self, x: Array, vectors: Sequence[Array], reference: Array) -> tuple[Array, list[Array]]:
        """Return the solution itself, and vectors, in phase."""
        size = self.base.size
        inside, others = self.base.in_phase(x[:size], [vector[:size] for vector in vectors], reference[:size])
        return np.append(inside, x[size:]), [np.append(other, vector[size:]) for other, vector in zip(others, vectors)]

    def collapsed(self, x: Array, z: Array) -> bool:
        """Return whether the solution itself has no size."""
        return self.base.collapsed(self.inside(x), z[: self.base.size])


class _Inside:
    """Factors of a defining system for right-hand sides of the underlying one: its own equations hold."""

    def __init__(self, factors: Factors, system: Defining) -> None:
        self._factors, self._system = factors, system

    def solve(self, b: Array) -> Array:
        """Return the unknowns of the underlying system."""
        base = self._system.base
        wide = np.zeros((*b.shape[:-1], self._system.equations + 1))
        wide[..., : base.equations], wide[..., -1] = b[..., :-1], b[..., -1]
        return self._factors.solve(wide)[..., : base.size]


@dataclasses.dataclass(frozen=True)
class _Statement:
    """The statement behind a defining system: that of the problem, but for the number of free parameters."""

    problem: Statement
    free_size: int
    columns: tuple[str, ...] = ()

    states, parameters, angles, batch = (  # those of the problem
        property(operator.attrgetter(f"problem.{name}")) for name in ("states", "parameters", "angles", "batch")
    )

    @property
    def functionals(self) -> Mapping[str, Function]:
        """Functionals of the problem, and columns of the curve."""
        return {**self.problem.functionals, **dict.fromkeys(self.columns, found_elsewhere)}

    @property
    def multipliers(self) -> tuple[str, ...]:
        """Those of the problem."""
        return multipliers_of(self.problem)

    @property
    def symmetries(self) -> Mapping[str, Any]:
        """None: images are of solutions."""
        return {}

    @property
    def phases(self) -> tuple[str, ...]:
        """Those of the problem."""
        return phases_of(self.problem)
