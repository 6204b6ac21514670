"""Curves of folds and of branch points in two parameters: extended systems that are continued by the same loop.

Fold: F = 0 and g = 0, where the bordered matrix [[F_z, b], [c, 0]] [v; g] = [0; 1] (z: all unknowns but the two parameters)
has g = 0 exactly where F_z is singular (Griewank & Reddien 1984). The gradient of g is -w.F_zy v, with w from the transposed
matrix: one difference of transposed products, since w.F_yz v is the change of F_y^T w along v.

Branch point: F + beta psi = 0 and g = 0, the two numbers of `contin.switching`, beta unknown: the curve of points where
two branches cross on the unfolded problem; beta stays zero where the bifurcation is perfect (a symmetry, a trivial branch).
"""

from __future__ import annotations

import dataclasses
from abc import abstractmethod
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from contin import checks
from contin.arrays import Array, Function
from contin.continuation.run import follow
from contin.detection.branch_point import BranchPoint, _Bordered, locate_branch_point
from contin.detection.test_functions import kind_monitors
from contin.discretization.mesh import MeshControl
from contin.discretization.protocol import Carrier, Discretization
from contin.discretization.system import System
from contin.errors import ProblemError
from contin.functions.batch import Batch
from contin.linalg.factors import Factors
from contin.problems.statement import Statement
from contin.results.branch import Branch
from contin.results.point import Point, system_of
from contin.stepping.settings import Settings, settings_with
from contin.stepping.trial import Monitor

#: Cosine between a border and the null vector that it stands for, below which it is renewed.
_FITS = 0.7


def _cosine(a: Array, b: Array) -> float:
    return float(abs(a @ b) / np.sqrt((a @ a) * (b @ b)))


class _Extended(Discretization):
    """What extended systems share: unknowns, names and columns are those of the underlying system."""

    _held: list[int]

    def __init__(self, base: System, borders: tuple[Array, Array] | None) -> None:
        self.base = base
        self.borders: Any = borders
        self.problem, self.free = _Statement(base.problem, len(base.free)), base.free
        self.weights, self.size, self.state_size = base.weights, base.size, base.state_size
        self.intervals, self.degree = base.intervals, base.degree

    @property
    def nodes(self) -> Array:
        """Nodes of the underlying system."""
        return self.base.nodes

    def states(self, x: Array) -> Array:
        """States of the underlying system."""
        return self.base.states(x[: self.base.size])

    def all_parameters(self, x: Array) -> Array:
        """Values of all parameters."""
        return self.base.all_parameters(x[: self.base.size])

    def parameter(self, x: Array, name: str) -> float:
        """The value of one parameter by name."""
        return self.base.parameter(x[: self.base.size], name)

    def parameter_index(self, name: str) -> int:
        """Where the free parameter ``name`` stands in x."""
        return self.base.parameter_index(name)

    def functionals(self, x: Array) -> Array:
        """Functionals of the underlying problem."""
        return self.base.functionals(x[: self.base.size])

    def carrier(self, other: Any) -> Carrier:
        """Carries the unknowns of the underlying system, and what follows them."""
        inside, size = self.base.carrier(other.base), self.base.size
        return lambda x: np.concatenate([inside(x[:size]), x[size:]])

    @abstractmethod
    def _stale(self, x: Array) -> bool:
        """Whether the borders no longer fit."""

    def refined(self) -> tuple[_Extended, Carrier] | None:
        """The extended system on every interval halved."""
        return self._on(self.base.refined())

    def adapted(self, x: Array, control: MeshControl) -> tuple[_Extended, Carrier] | None:
        """The extended system on a better mesh, or with new borders where the old ones no longer fit; its carrier."""
        changed = self.base.adapted(x[: self.base.size], control)
        if changed is None and self._stale(x):
            changed = self.base, np.array
        return self._on(changed, x)

    def _on(self, changed: tuple[System, Carrier] | None, x: Array | None = None) -> tuple[_Extended, Carrier] | None:
        if changed is None:
            return None
        other = type(self)(changed[0], None)
        return other, self.carrier(other)


@dataclasses.dataclass(frozen=True)
class _Statement:
    """The statement behind an extended system, as the loop asks for it."""

    problem: Statement
    free_size: int

    @property
    def states(self) -> Any:
        """Names of the states."""
        return self.problem.states

    @property
    def parameters(self) -> Mapping[str, float]:
        """Those of the problem."""
        return self.problem.parameters

    @property
    def functionals(self) -> Mapping[str, Function]:
        """Those of the problem."""
        return self.problem.functionals

    def batch(self, name: str) -> Batch:
        """Those of the problem."""
        return self.problem.batch(name)


class FoldCurve(_Extended):
    """F = 0 and F_z singular, in the free parameters of ``base``: the last one is the second parameter of the curve.

    ``base`` has one free parameter more than a curve of solutions needs; its ``free[primary]`` is the one of the folds.
    """

    def __init__(self, base: System, borders: tuple[Array, Array] | None = None, primary: int = 0) -> None:
        super().__init__(base, borders)
        self.equations = base.equations + 1
        self._held = [base.state_size + primary, base.size - 1]

    def _on(self, changed: tuple[System, Carrier] | None, x: Array | None = None) -> tuple[_Extended, Carrier] | None:
        found = super()._on(changed, x)
        if found is not None:
            found[0]._held = [found[0].base.state_size + self._held[0] - self.state_size, found[0].base.size - 1]
        return found

    def _null(self, x: Array) -> tuple[Array, Array, float]:
        """v (size,), w (equations of F,), g, from the bordered matrix; borders are made of v and w when there are none."""
        base = self.base
        held = np.zeros((2, base.size + 1))
        held[[0, 1], self._held] = 1.0
        random = np.random.default_rng(11)
        renew = self.borders is None
        b, c = (random.standard_normal(base.equations), random.standard_normal(base.size)) if renew else self.borders
        for _ in range(3 if renew else 1):
            _, factors = base.linearize(x, np.vstack([held, np.append(c, 0.0)]), b[None, :])
            zeros = np.zeros(base.size + 1)
            zeros[-1] = 1.0
            solution = factors.solve(zeros)
            w = factors.solve_transposed(zeros)[: base.equations]
            v, g = solution[:-1], solution[-1]
            if renew:
                b, c = w / np.linalg.norm(w), base.weights * v / np.sqrt((base.weights * v) @ v)
                self.borders = (b, c)
        return v, w, g

    def _stale(self, x: Array) -> bool:
        """Whether the null vectors have turned away from the borders."""
        v, w, _ = self._null(x)
        b, c = self.borders
        root = np.sqrt(self.base.weights)
        return min(_cosine(c / root, v * root), _cosine(b, w)) < _FITS

    def residual(self, x: Array) -> Array:
        """F and g."""
        return np.append(self.base.residual(x), self._null(x)[2])

    def _gradient(self, x: Array, v: Array, w: Array) -> Array:
        """dg/dx, shape (size,)."""
        h = 1e-5 / max(np.abs(v).max(), 1e-300)
        change = self.base.transposed_product(x + h * v, w) - self.base.transposed_product(x - h * v, w)
        gradient: Array = -change / (2 * h)
        return gradient

    def linearize(
        self, x: Array, rows: Sequence[Array] | Array = (), columns: Sequence[Array] | Array = ()
    ) -> tuple[Array, Factors]:
        """As the interface asks; the row of g comes first among the border rows."""
        v, w, g = self._null(x)
        extra = len(columns)
        rows = np.array(rows, dtype=float).reshape(-1, self.size + extra)
        columns = np.array(columns, dtype=float).reshape(-1, self.equations)
        row = np.concatenate([self._gradient(x, v, w), columns[:, -1]])
        residual, factors = self.base.linearize(x, np.vstack([row, rows]), columns[:, :-1])
        return np.append(residual, g), factors


@kind_monitors.register
def _of_fold_curve(system: FoldCurve) -> list[Monitor]:
    """Codimension two: cusps (w.F_zz v v = 0), and where the fold meets a branch point (w.F_lambda = 0)."""

    def cusp(trial: Any) -> float:
        v, w, _ = trial.system._null(trial.x)
        return float(trial.system._gradient(trial.x, v, w) @ v)

    def crossing(trial: Any) -> float:
        _, w, _ = trial.system._null(trial.x)
        return float(trial.system.base.transposed_product(trial.x, w)[trial.system._held[0]])

    return [Monitor("CP", "cusp", cusp), Monitor("BP", "fold meets a branch point", crossing)]


class BranchPointCurve(_Extended):
    """F + beta psi = 0 with both g zero; unknowns [those of ``base`` | beta].

    ``base`` has one free parameter more than a curve of solutions needs; that last one is the second parameter.
    """

    def __init__(self, base: System, borders: tuple[Array, Array] | None = None) -> None:
        super().__init__(base, borders)
        self.size = base.size + 1
        self.equations = base.equations + 2
        self.weights = np.append(base.weights, 1.0)

    def _narrow(self, x: Array) -> tuple[System, Array]:
        """The system with the second parameter held, and its x."""
        return self.base.with_free(self.base.free[:-1], x[: self.base.size])

    def _matrix(self, x: Array) -> tuple[System, Array, _Bordered]:
        system, inside = self._narrow(x)
        if self.borders is None:
            found = locate_branch_point(system, inside)
            self.borders = (found.kernel, found.left)
        return system, inside, _Bordered(system, inside, *self.borders)

    def _stale(self, x: Array) -> bool:
        """Whether kernel and left null vector have turned away from the borders."""
        system, _, matrix = self._matrix(x)
        longest = max(np.sqrt((system.weights * v) @ v) for v in matrix.kernel)  # 1 where the kernel lies along its border
        return bool(min(1 / longest, _cosine(self.borders[1], _left(matrix, self.base.equations))) < _FITS)

    def residual(self, x: Array) -> Array:
        """F + beta psi, and g."""
        system, inside, matrix = self._matrix(x)
        return np.concatenate([system.residual(inside) + x[-1] * self.borders[1], matrix.g])

    def linearize(
        self, x: Array, rows: Sequence[Array] | Array = (), columns: Sequence[Array] | Array = ()
    ) -> tuple[Array, Factors]:
        """As the interface asks; the gradients of g by differences of transposed products."""
        base, inside_size = self.base, self.base.size
        _, _, matrix = self._matrix(x)
        w = _left(matrix, base.equations)
        gradients = []
        for v in matrix.kernel:
            wide = np.append(v, 0.0)  # the second parameter does not move along the kernel
            h = 1e-5 / np.abs(v).max()
            y = x[:inside_size]
            change = base.transposed_product(y + h * wide, w) - base.transposed_product(y - h * wide, w)
            gradients.append(np.append(-change / (2 * h), 0.0))
        extra = len(columns)
        rows = np.array(rows, dtype=float).reshape(-1, self.size + extra)
        columns = np.array(columns, dtype=float).reshape(-1, self.equations)
        top = np.hstack([np.array(gradients), columns[:, -2:].T])
        psi = self.borders[1]
        residual, factors = base.linearize(x[:inside_size], np.vstack([top, rows]), np.vstack([psi, columns[:, :-2]]))
        return np.concatenate([residual + x[-1] * psi, matrix.g]), factors


def _left(matrix: _Bordered, equations: int) -> Array:
    """The w of the transposed bordered matrix, scaled so that dg = -w.F_xy v."""
    unit = np.zeros(matrix.rows.shape[1])
    unit[-1] = 1.0
    return matrix.factors.solve_transposed(unit)[:equations]


def curve(start: Point, second: str, settings: Settings | None = None, **options: Any) -> Branch:
    """The curve of folds, or of branch points, through one, in its primary parameter and a second one.

    Parameters
    ----------
    start : Point
        A fold (LP) or branch point (BP) found on a branch.
    second : str
        The further parameter.
    settings : Settings, optional
        Or any of its fields by name. Folds of the curve are with respect to ``primary`` (``second`` by default).

    Returns
    -------
    Branch
        Points with labels LP (the curve turns), CP (cusp of folds), BP (fold meets a branch point). Points of a curve of branch
        points carry their imperfection beta as the last entry of x.

    Raises
    ------
    ProblemError
        The start is neither, or the name is no further parameter.
    """
    checks.instance("start", start, Point, "a Point")
    checks.instance("second", second, str, "a name")
    system = system_of(start, "start")
    if second in system.free or second not in system.problem.parameters:
        raise ProblemError(f"second: {second!r} must be a parameter that is not free ({', '.join(system.problem.parameters)})")
    options.setdefault("primary", second)
    options.setdefault("branch_points", False)
    settings = settings_with(settings, options)
    base, x = system.with_free((*system.free, second), start.x)
    if isinstance(start.details, BranchPoint):
        extended: _Extended = BranchPointCurve(base)
        x = np.append(x, 0.0)
    elif start.label == "LP":
        extended = FoldCurve(base, primary=system.free.index(start.name))
    else:
        raise ProblemError(f"start: a point labelled {start.label or 'nothing'!r} is neither a fold nor a branch point")
    return follow(extended, x, settings)
