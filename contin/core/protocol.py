"""The protocol of a discretized problem: what corrector, detection and the continuation loop ask of it.

`contin.lowlevel.Collocation` and `contin.lowlevel.Algebraic` follow it, and so do the defining systems of `contin.curve`.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Protocol

import numpy as np

from contin.arrays import Array
from contin.collocation.corners import NOWHERE, Switching
from contin.collocation.mesh import MeshControl
from contin.core.differences import derivative, of_function
from contin.linalg.blocks import Factors
from contin.problems.statement import Statement

#: Takes vectors of unknowns from one discretization of a problem to another.
Carrier = Callable[[Array], Array]


class Equations(Protocol):
    """F(x) = 0, as Newton's method sees it."""

    def residual(self, x: Array) -> Array:
        """Return F(x), shape (equations,)."""

    def linearize(
        self, x: Array, rows: Sequence[Array] | Array = (), columns: Sequence[Array] | Array = ()
    ) -> tuple[Array, Factors]:
        """Return F(x), and the factored matrix [[F_x, columns^T], [rows]]."""


class Discretization(Equations, Protocol):
    """F(x) = 0 with free parameters at the end of x, as the continuation sees it.

    - ``problem`` (Statement)
    - ``free`` (tuple of str): The free parameters.
    - ``size`` (int): Number of unknowns.
    - ``state_size`` (int): Place of the first free parameter among them.
    - ``equations`` (int): Number of equations.
    - ``weights`` (ndarray, shape (size,)): Weights of the inner product.
    - ``aims`` (tuple of float): The usual `Settings.angle` and `Settings.accuracy`.
    - ``intervals``, ``degree`` (int): Of the mesh; 0 without one.
    - ``scales`` (object): Sizes of states and parameters, by which they are divided in x; None where these are as they are.
    - ``free_scales`` (ndarray): Those of the free parameters.
    - ``order`` (int): Into how many equal parts a symmetry divides a cycle; x holds one of them.
    - ``plain`` (bool): Kernels may make the plain steps on its mesh.
    - ``leaving`` (mapping of str to tuple of str): Kinds of curves in two parameters that begin at, or pass, points of
      codimension two, by their label.
    """

    problem: Statement
    free: tuple[str, ...]
    size: int
    state_size: int
    equations: int
    weights: Array
    aims: tuple[float, float] = (0.35, 0.02)
    intervals: int
    degree: int
    scales: Any
    free_scales: Array
    order: int = 1
    plain: bool = False
    leaving: Mapping[str, tuple[str, ...]] = {}

    @property
    @abstractmethod
    def nodes(self) -> Array:
        """Values of t at the nodes, where the states are given; shape (K,)."""

    def discretization_error(self, x: Array, factors: Factors, columns: Any) -> float:
        """Return the estimated error of a solution x that is due to the mesh, relative to 1 + size: 0 without a mesh.

        ``factors`` are those of [F_x; row] at x or close to it, ``columns[name]`` a functional of x. Kinds with a mesh
        that say nothing return NaN.
        """
        return float("nan") if self.intervals else 0.0

    def newton_error(self, x: Array, factors: Factors) -> float:
        """Return what Newton's method or round-off has left, measured in the same way."""
        return 0.0

    def lifted(self, x: Array, reference: Array) -> Array:
        """Return the same solution with its angles moved by whole rounds, so that they are nearest to those of a reference."""
        return x

    def evaluations(self, x: Array) -> list[tuple[Any, Array, Array, Array, Array]]:
        """Return the users' functions that F is made of, a `Batch` each, with the t, u, v and p that it is called with at x."""
        return []

    def cut_off_errors(self, x: Array, factors: Factors) -> Array:
        """Return by how much x is off because an infinite interval is cut off, a row for each condition there, (k, size).

        All may have either sign. Most systems have none.
        """
        return np.empty((0, self.size))

    @property
    def named_states(self) -> tuple[str, ...]:
        """Names of the states that are columns: those that are numbers, no functions of t."""
        return ()

    @abstractmethod
    def states(self, x: Array) -> Array:
        """Return the states at the nodes, shape (K, n)."""

    @abstractmethod
    def all_parameters(self, x: Array) -> Array:
        """Return the values of all parameters."""

    @abstractmethod
    def parameter(self, x: Array, name: str) -> float:
        """Return the value of one parameter."""

    @abstractmethod
    def parameter_index(self, name: str) -> int:
        """Return the place of a free parameter in x."""

    @abstractmethod
    def functionals(self, x: Array) -> Array:
        """Return the values of the problem's functionals."""

    def along(self, x: Array, directions: Sequence[Array]) -> Array:
        """Return the derivative of F along two or three directions, F_xx[v1, v2] or F_xxx[v1, v2, v3], shape (equations,).

        Kinds of system that state no derivatives of F of higher order have differences of the residual, along lines.
        """
        return of_function(self.residual, x, directions)

    @abstractmethod
    def transposed_product(self, x: Array, w: Array) -> Array:
        """Return F_x^T w, shape (size,)."""

    def bent(self, x: Array, w: Array, v: Array) -> Array:
        """Return the gradient of w.(F_x v) by x, the derivative of F_x^T w along v, shape (size,).

        ``w`` has the shape (equations,), ``v`` (size,). Kinds of system that state no derivatives of F of higher order have
        differences of `transposed_product`.
        """
        longest = np.abs(v).max(initial=0.0)
        if not longest:
            return np.zeros(self.size)
        return derivative(lambda s: self.transposed_product(x + s * v, w), 1, 1 / longest)[0]

    def magnitudes(self, x: Array) -> Array:
        """Return the sizes of the unknowns relative to which x must be known, shape (size,).

        Kinds of system that do not say are made of unknowns of order one.
        """
        return 1 + np.abs(x)

    @abstractmethod
    def carrier(self, other: Any) -> Carrier:
        """Return the function that carries vectors of unknowns to another discretization of this problem."""

    @abstractmethod
    def refined(self) -> tuple[Discretization, Carrier] | None:
        """Return the same on every interval halved, and the carrier; None without a mesh."""

    def holds(self, x: Array, tolerance: float) -> bool:
        """Return whether a solution with another reference is one with this one; False where that is not known."""
        return False

    @abstractmethod
    def adapted(self, x: Array, control: MeshControl) -> tuple[Discretization, Carrier] | None:
        """Return the same on a better mesh for x, and the carrier; None where there is no need."""

    def switching(self, x: Array) -> Switching:
        """Return where conditions that the solution decides switch, and the equations are not smooth."""
        return NOWHERE

    def on_switches(self, x: Array, closely: bool = False) -> tuple[Discretization, Carrier] | None:
        """Return the same on a mesh with those places among its points, and the carrier; None where there is no need."""
        return None

    # --- what a kind of problem knows of its branches; the answers here are those of a kind that knows nothing -----------
    #
    # Records that are made of systems cannot be named here: an ``arc`` is a `contin.events.arc.Arc`, a ``point`` the
    # `SpecialPoint` of that file (of `defining` also a `contin.Point`), a ``trial`` a `contin.core.trial.Trial`; events are
    # `contin.Event`.

    @property
    def solution(self) -> Discretization:
        """The problem whose solutions are followed: of a curve in two parameters the one that it is made of, else itself."""
        return self

    @property
    def stored(self) -> dict[str, Array] | None:
        """What is stored of the system besides its problem and free parameters, by name; None where it is not stored."""
        return None

    def referring_to(self, x: Array, tangent: Array) -> Discretization:
        """Return the same with a point as the reference that further conditions are relative to; ``tangent`` may be NaN."""
        return self

    @property
    def on_curve(self) -> bool:
        """Whether x is a point of a curve in two parameters, and holds more than a solution or less equations."""
        return self.solution is not self

    @property
    def is_function_of_t(self) -> bool:
        """Whether a solution is a function of t that `evaluate` gives: it can be drawn, and be a guess of another one."""
        return False

    @property
    def starts_cycles(self) -> bool:
        """Whether cycles of `CycleProblem` or `MapProblem` begin where a pair, or a multiplier, becomes critical."""
        return False

    @property
    def is_cycle(self) -> bool:
        """Whether solutions are periodic orbits, of vector fields or maps."""
        return False

    def unstable(self, x: Array) -> int | None:
        """Return the number of unstable eigenvalues, or multipliers of a cycle; None where it is not known."""
        return None

    def check_solution(self, x: Array) -> None:
        """Check that a solution is one of the kind that was asked for; raise ProblemError otherwise."""
        return

    def degenerate(self, x: Array) -> str:
        """Return why Newton's method may have failed at a guess x, as a sentence; "" where nothing is known."""
        return self.undetermined(x)

    def undetermined(self, x: Array) -> str:
        """Return why a solution x comes with others around it, of which round-off chose one, as a sentence; "" if not."""
        return ""

    #: Number of conditions that unknowns decide (`contin.events.corner`), and their frozen outcomes, 1 or -1 each.
    conditions: int = 0
    sides: Array = np.empty(0)
    knots: Sequence[int] = ()
    #: Outcomes of the conditions along a solution on the intervals, where the equations jump; empty where they are not frozen.
    outcomes: Array = np.empty((0, 0))

    @property
    def thawed(self) -> Any:
        """The same without frozen outcomes."""
        return self

    @property
    def curves(self) -> Mapping[str, type]:
        """The defining systems of `defining`, by the label of their points."""
        return {}

    def defining(self, point: Any, x: Array) -> tuple[Any, Array] | None:
        """Return the defining system of special points like a labelled one, and its first x; None where there is none.

        ``x`` is the point in this system, which has one free parameter more than a curve of solutions needs. Folds, branch
        points, extrema and values of columns are no business of the kind.
        """
        return None

    def events(self) -> list[Any]:
        """Return the events that the kind brings, beyond folds and branch points.

        Their signs may differ between meshes. They ask ``trial.system``: the mesh changes along a branch.
        """
        return []

    @property
    def index(self) -> Any:
        """The event whose value is the index of a point, of a problem with an energy; None for others."""
        return None

    def stability(self, point: Any) -> Any:
        """Return the `Stability` of a point of a kind with an index; at a special one, what vanishes there does not count."""
        return None

    def crossed(self, x: Array, corners: bool = False) -> tuple[Any, Array]:
        """Return the same with frozen outcomes where the solution x crosses jumps of the equations, or ``corners``; and x."""
        return self, x

    def check_jumps(self, x: Array, state: Any, settled: bool = True) -> None:
        """Raise Grazing where x, the end of a step from a state, crosses more or fewer jumps of the equations."""
        return

    @property
    def size_of_solutions(self) -> Any:
        """The event of the size of a solution, with a sign, where solutions can shrink onto others; else None."""
        return None

    @property
    def small_equations(self) -> Any:
        """The `Batch` of a problem without a mesh whose steps kernels may make; ``gain`` is what angles of a map gain."""
        return None

    def round_end(self, x: Array, error: Exception) -> Any:
        """Return the system for a step in which a jump passes an end of the period, and the carrier, or None."""
        return None

    def home_ahead(self, state: Any, step: float) -> Any:
        """Return where the branch ends or bends sharply within a step that failed, if that is known."""
        return None

    def home(self, arc: Any) -> Any:
        """Return the end of the branch inside a step, where solutions become those of another kind, or None."""
        return None

    def collapsed(self, x: Array, z: Array) -> bool:
        """Return whether a step from x to z has left its branch for solutions of no size."""
        return False

    def cannot_branch(self, arc: Any) -> bool:
        """Return whether both ends of a step of a branch say that no other branch crosses it there."""
        return False

    def may_branch(self, x: Array) -> bool:
        """Return whether other branches are looked for at a multiple point."""
        return True

    def judged(self, point: Any) -> Any:
        """Return a special point, with the label and name, or as the end of the branch, that the kind knows it by."""
        return point

    def coefficient(self, point: Any) -> Any:
        """Return the `Coefficient` of the normal form at a special point; None where there is none."""
        return None

    def form(self, x: Array) -> Any:
        """Return the `contin.events.normal_forms.Form` at x, of equilibria and cycles; None of others."""
        return None

    def events_on_folds(self) -> list[Any]:
        """Return the events of a curve of folds, beyond cusps and branch points."""
        return []

    def events_on_curves(self) -> list[Any]:
        """Return the events of a curve along which one of `events` stays zero."""
        return []

    def judged_on_curve(self, point: Any, solution: Any) -> Any:
        """Return a special point of such a curve, with ``solution`` there, by the label and name that the kind knows it by."""
        return point

    def standstill(self, trial: Any, primary: str) -> Any:
        """Return the `contin.Stop` of a run whose primary parameter has not moved; None to go on."""
        return None

    def explained(self, stop: Any, trial: Any) -> Any:
        """Return the `contin.Stop` of a run, with what the kind knows of its last point."""
        return stop

    def lasting(self, x: Array) -> Array:
        """Return quantities that no shift in time changes; two solutions are as far from each other as theirs, at least."""
        return x[self.state_size :]

    def in_phase(self, x: Array, vectors: Sequence[Array], reference: Array) -> tuple[Array, list[Array]]:
        """Return a solution, and vectors at it, shifted in time to lie closest to another one; angles, by whole rounds."""
        return self.lifted(x, reference), list(vectors)


def inner(system: Discretization, a: Array, b: Array) -> float:
    """Return the weighted inner product of two vectors of unknowns."""
    return float((system.weights * a) @ b)
