"""Algebraic problems as discretized ones: equations, derivatives, and Jacobians that users give; branches of equilibria.

The characteristic matrix A - lambda of an equilibrium, and its forms: the first Lyapunov coefficient is Re d / omega. With A
the Jacobian of the field, perturbations are v exp(lambda t), and B and C the derivatives of second and third order, with
|q| = 1 of the critical eigenvector (`contin.events.normal_forms`; Kuznetsov, section 5.4).
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from contin.arrays import Array, ComplexArray, Numbers
from contin.collocation.mesh import MeshControl
from contin.core.differences import derivative, of_function
from contin.core.labels import Label
from contin.core.protocol import Carrier, Discretization
from contin.core.spectral import Eigenvalues, Spectral, may_be_on_axis, off_axis
from contin.core.system import Composed, Inputs, Scales, System, Term
from contin.core.trial import Event, Trial
from contin.defining.critical import HopfCurve, other_pairs
from contin.draws import ASIDE, generator, signs
from contin.equilibria.dependence import dependence
from contin.errors import ProblemError
from contin.events.arc import SpecialPoint
from contin.events.error import Solution
from contin.events.hopf import hopf
from contin.events.labelled import frequency_of
from contin.events.normal_forms import NOT_SMOOTH, Coefficient, DenseForm, at_special_point, fold
from contin.functions.batch import Batch
from contin.levels import CERTAIN, CORRECTED, LOCATED, MOST_UPDATES, ROUGH
from contin.linalg.blocks import MANY, Factors
from contin.linalg.matrices import DenseFactors, SparseFactors, eigenvalues, nearest, rightmost
from contin.problems.angles import whole_rounds
from contin.problems.statement import Statement


def check_given(problem: Any, u: Array, p: Array) -> None:
    """Compare a given Jacobian with differences of the residual along a random direction, the first time.

    Raises ProblemError where an entry is wrong; the message names it.
    """
    if problem.jacobian is None or problem.compared:
        return
    problem.compared.append(True)
    batch, none = problem.batch("residual"), np.empty((0, u.size))
    random, size = generator("given"), 1 + np.abs(u)
    place = u + ASIDE * size * random.uniform(-1, 1, u.size)
    direction = size * random.uniform(0.5, 1.0, u.size) * signs(random, u)

    def slope(along: Array) -> tuple[Any, float]:
        return derivative(lambda s: batch.values(np.zeros(1), (place + s * along)[None], none, p)[0])

    for place in (place, u):  # noqa: B020  `slope` is taken there
        with np.errstate(all="ignore"):
            matrix = problem.jacobian_at(place, p)
            wanted, error = slope(direction)
        terms = abs(matrix) @ np.abs(direction)
        if np.isfinite(wanted).all() and np.isfinite(terms).all():
            break
    else:
        return  # nothing to compare with: Newton's method will say that there are no values
    excess = np.abs(matrix @ direction - wanted) - CERTAIN * error - LOCATED * (terms + np.abs(wanted))
    if np.any(excess > 0):
        row = int(np.argmax(excess))
        given = matrix[[row]].toarray()[0] if hasattr(matrix, "toarray") else matrix[row]
        known = np.array([slope(along)[0][row] for along in np.diag(size)]) / size
        column = int(np.argmax(np.abs(known - given) * size))
        what = f"the derivative of equation {row} by {problem.state_names[column]}"
        numbers = f"{given[column]:.6g}, must be {known[column]:.6g}"
        raise ProblemError(f"jacobian: {what} is {numbers} (by differences of the residual)")


class EquilibriumForm(DenseForm):
    """That of an equilibrium, in unknowns divided by their sizes; the Jacobian (n, n) is in the user's units."""

    def __init__(self, jacobian: Array, sizes: Array, along: Callable[[Any], Array]) -> None:
        super().__init__(jacobian * sizes / sizes[:, None], len(jacobian), along, np.ones(len(jacobian)))
        self._sizes = sizes

    def length(self, right: Numbers) -> float:
        """Return the length of v in the user's units."""
        return float(np.linalg.norm(right * self._sizes))

    def pair(self, frequency: float | None) -> CriticalPair:
        """Return the pair of eigenvalues that is nearest to -+ i ``frequency``.

        Without a frequency, it is the complex pair nearest to the imaginary axis.
        """
        if frequency is None:
            values = np.linalg.eigvals(self._open)
            frequency = float(values[np.argmin(np.where(values.imag > 0, np.abs(values.real), np.inf))].imag)
        with np.errstate(all="ignore"):
            left, (right, _) = self.critical(1j * frequency)
            missed: Any = self._open @ right - 1j * frequency * right
            off = float(np.divide(self.length(missed), abs(frequency)))
            return CriticalPair(frequency, np.asarray(right, complex), np.asarray(left, complex), off)


#: Places on a small cycle at which a field is compared with its polynomial of third degree.
_WAVES = 8
#: Factor by which the difference falls on a cycle half as large, at least: 16, and 8 or 4 where terms of third or second degree
#: are not smooth.
_DROPS = 11.0


class CriticalPair(NamedTuple):
    """A pair of eigenvalues -+ i omega: its frequency, and the right and left eigenvector, |q| = 1 and w.q = 1.

    ``off`` is |A q - i omega q|, relative to omega.
    """

    frequency: float
    right: ComplexArray
    left: ComplexArray
    off: float

    @property
    def is_critical(self) -> bool:
        """The pair belongs to the matrix: not so at Hopf points of a kind whose stability is not that of its Jacobian."""
        return self.off < _CRITICAL


#: Largest distance of a critical eigenvalue from i omega, relative to omega: Hopf points are located to 1e-9. Where it is ten
#: times larger, a kind of problem with another stability is taken for a field if an eigenvalue lies so near by chance.
_CRITICAL = 1e-4


def critical_pair(jacobian: Array, frequency: float | None = None) -> CriticalPair:
    """Return that of `EquilibriumForm.pair`, in the user's units."""
    return EquilibriumForm(jacobian, np.ones(len(jacobian)), lambda _: jacobian).pair(frequency)


#: The kind of curves of homoclinic orbits, which leave from the first.
HOMOCLINIC = "homoclinic"


class Algebraic(Spectral, Composed):
    """An algebraic problem with chosen free parameters, as the continuation sees it.

    Unknowns ``x`` are the states, then the free parameters. The interface is that of
    `contin.lowlevel.Collocation`; there is no mesh to adapt.

    Raises
    ------
    ProblemError
        An unknown parameter.

    Examples
    --------
    >>> from contin import AlgebraicProblem
    >>> system = Algebraic(AlgebraicProblem(lambda u, p: (p.a - u.x**2,), ["x"], {"a": 1.0}), ["a"])
    >>> system.size, system.residual(np.array([2.0, 1.0])).tolist()  # x = 2, a = 1
    (2, [-3.0])
    """

    intervals = 0
    degree = 0
    problem: Any
    #: What angles of a map gain over a cycle.
    gain: Array | None = None

    def __init__(
        self, problem: Statement, free: Sequence[str], parameters: Mapping[str, float] | None = None,
        scales: Scales | None = None,
    ) -> None:  # fmt: skip
        super().__init__(problem, free, parameters or {}, scales)
        self.state_size = len(self.problem.state_names)
        self.size = self.state_size + len(self.free)
        self.equations = self.problem.equation_size
        self.weights = np.ones(self.size)
        self._none = np.empty((0, self.state_size))  # the absent second state of functions of one point
        self._complete()

    @property
    def _rows(self) -> tuple[tuple[str, int], ...]:
        return (("residual", self.problem.equation_size),)

    @property
    def nodes(self) -> Array:
        """One place, shape (1,)."""
        return np.zeros(1)

    @property
    def named_states(self) -> tuple[str, ...]:
        """Names of the states."""
        return self.problem.state_names

    def states(self, x: Array) -> Array:
        """Return the states, shape (1, n)."""
        return self._scaled_states(x) * self.scales.states

    def lifted(self, x: Array, reference: Array) -> Array:
        """Return x with angles moved by whole rounds, so that they are nearest to those of a reference."""
        if not self.circles.any():
            return x
        apart = (reference - x)[: self.state_size].reshape(-1, self.circles.size)
        moved = x.copy()
        moved[: self.state_size] += whole_rounds(apart, self.circles).ravel()
        return moved

    def residual(self, x: Array) -> Array:
        return self._terms[0].values(x)

    _functions = ("residual",)
    #: Points at which the functions are evaluated.
    rounds: int = 1

    @functools.cached_property
    def _terms(self) -> tuple[Term]:
        return (self._of_points(self._residual),)

    @property
    def _column_term(self) -> Term:
        return self._of_points(self._functionals, 1)

    def _of_points(self, batch: Batch, count: int | None = None) -> Term:
        """Return functions of the first points, or of all."""

        def inputs(x: Array) -> Inputs:
            u = np.ascontiguousarray(self._scaled_states(x)[:count])
            return np.zeros(len(u)), u, self._none, self.scaled_parameters(x)

        return Term(self, batch, inputs, np.ravel, lambda w: w.reshape(-1, batch.count), self._by_x)

    def _by_x(self, slopes: Array) -> Array:
        """Return derivatives by x, shape (size,), from those by states and free parameters at the first points, (K, n + k)."""
        return slopes[0]

    @functools.cached_property
    def _residual(self) -> Batch:
        return self._frozen("residual", self._batch("residual", ("residual",)))

    @functools.cached_property
    def _decided(self) -> list[tuple[str, int]]:
        """None with a given Jacobian."""
        return super()._decided if type(self) is Algebraic and self.problem.jacobian is None else []

    def slopes(self, x: Array) -> Array:
        """Return F_x, shape (equations, size)."""
        jacobian = self._jacobian(x)[1]
        return np.asarray(jacobian.toarray() if self.is_sparse else jacobian)

    @functools.cached_property
    def is_sparse(self) -> bool:
        """The matrix is kept sparse: it is large, and few of its entries may differ from zero, or it is given as such."""
        if self.problem.jacobian is not None:
            return self.state_size >= MANY and self.problem.gives_sparse_matrix
        return self.state_size >= MANY and self._terms[0].columns.rows.size <= _FEW * self.size * self.equations

    def _jacobian(self, x: Array) -> tuple[Array, Any]:
        """Return the residual and F_x, shape (equations, size), a sparse array where `is_sparse`."""
        given = self._terms[0].inputs(x)
        if self.problem.jacobian is not None:
            check_given(self.problem, self.states(x)[0], self.all_parameters(x))
            return self._given_jacobian(x, given)
        columns = self._terms[0].columns
        if not self.is_sparse:
            values, jacobian = self._residual.jacobian(*given, columns)
            return values[0], jacobian[0]
        from scipy.sparse import csr_array  # type: ignore[import-untyped]  # .1 s; only large problems need it

        residual, entries = self._residual.entries(*given, columns)
        return residual[0], csr_array((entries[0], (columns.rows, columns.places)), shape=(self.equations, self.size))

    def _given_jacobian(self, x: Array, given: Inputs) -> tuple[Array, Any]:
        """Return the same with the derivatives by states from the user's function."""
        values, by_parameters = self._residual.jacobian(*given, self._residual.columns(self._free, ()))
        matrix: Any = self.problem.jacobian_at(self.states(x)[0], self.all_parameters(x))
        rows, columns = 1 / self.scales.rows["residual"][:, None], self.scales.states
        if not self.is_sparse:
            return values[0], np.hstack([_dense(matrix) * columns * rows, by_parameters[0]])
        from scipy.sparse import csr_array, hstack

        return values[0], hstack([csr_array(matrix.multiply(columns).multiply(rows)), csr_array(by_parameters[0])]).tocsr()

    def linearize(
        self, x: Array, rows: Sequence[Array] | Array = (), columns: Sequence[Array] | Array = ()
    ) -> tuple[Array, Factors]:
        """Return the residual at x, and the factored matrix [[F_x, columns^T], [rows]]; see ``Collocation.linearize``."""
        residual, jacobian = self._jacobian(x)
        rows = np.array(rows, dtype=float).reshape(-1, self.size + len(columns))
        columns = np.array(columns, dtype=float).reshape(-1, self.equations)
        if not self.is_sparse:
            matrix = np.zeros((self.equations + len(rows), self.size + len(columns)))
            matrix[: self.equations, : self.size], matrix[: self.equations, self.size :] = jacobian, columns.T
            matrix[self.equations :] = rows
            return residual, DenseFactors(matrix)
        from scipy.sparse import csr_array, hstack, vstack

        beside = hstack([jacobian, csr_array(columns.T)]) if len(columns) else jacobian
        return residual, SparseFactors(
            vstack([beside, csr_array(rows)]) if len(rows) else beside, len(rows), self.problem.solver
        )

    def transposed_product(self, x: Array, w: Array) -> Array:
        return self._jacobian(x)[1].T @ w

    def along(self, x: Array, directions: Sequence[Array]) -> Array:
        return self.stack_along(x, [v[None] for v in directions])[0]

    def stack_along(self, x: Array, directions: Sequence[Array]) -> Array:
        """Return it along several stacks of directions, shape (K, size) each or, of states alone, (K, n); (K, equations)."""
        size, count, (term,) = self.state_size, len(directions[0]), self._terms
        if self.problem.jacobian is not None and term.batch.interpreted is not None:
            return np.array([self._along_given(x, [stack[k] for stack in directions]) for k in range(count)])
        _, u, v, p = term.inputs(x)
        wide = [self._wide(stack.repeat(len(u), 0) if len(u) > 1 else stack, stack[:, :size].reshape(-1, u.shape[1]))
                for stack in directions]  # fmt: skip
        return term.batch.along(np.zeros(len(wide[0])), np.concatenate([u] * count), v, p, wide).reshape(count, -1)

    def _along_given(self, x: Array, directions: Sequence[Array]) -> Array:
        """Return the derivative of F along directions by differences of the user's Jacobian, in place of the residual's.

        One difference fewer: of a residual that is evaluated in Python those of second order have the round-off of its sums.
        """
        *others, last = (np.append(v, np.zeros(x.size - v.size)) for v in directions)

        def product(at: Array) -> Array:
            return self._jacobian(at)[1] @ last

        return of_function(product, x, others) if others else product(x)

    def bent(self, x: Array, w: Array, v: Array) -> Array:
        """Return the gradient of w.(F_x v), shape (size,)."""
        if self._residual.interpreted is not None:
            return System.bent(self, x, w, v)  # two Jacobians instead of one value for each entry
        return self._terms[0].bent(x, w, v)

    def jacobian(self, x: Array) -> Array:
        """Return F_u in the user's units, shape (equations, n)."""
        return self.jacobians(x, self.states(x))[0]

    def jacobians(self, x: Array, states: Array) -> Array:
        """Return F_u in the user's units at other states (K, n), with the parameters of x; shape (K, equations, n)."""
        p = self.all_parameters(x)
        if self.problem.jacobian is not None:
            return np.array([_dense(self.problem.jacobian_at(u, p)) for u in states])
        return self.unscaled.jacobian(np.zeros(len(states)), states, self._none, p, self.unscaled.columns([]))[1]

    def field_jacobian(self, x: Array) -> Array:
        """Return F_u as the unknowns have it: with `as_field`, a matrix with the eigenvalues of F_u."""
        return self._jacobian(x)[1][:, : self.state_size]

    def as_field(self) -> Algebraic:
        """Return the same problem with the residual divided by the sizes of the states, as their rates; x stays the same."""
        if self.scales.are_one:
            return self
        return self._with(scales=Scales(self.scales.states, self.scales.parameters, {"residual": self.scales.states}))

    def spectra(self, places: Sequence[Array]) -> list[Eigenvalues]:
        if self.is_sparse:
            return [Eigenvalues(rightmost(self.as_field().field_jacobian(x), self.problem.solver)) for x in places]
        matrices = np.array([self.jacobian(x) for x in places])
        found = eigenvalues(matrices) if np.isfinite(matrices).all() else np.array([*map(eigenvalues, matrices)])
        near: Any = may_be_on_axis(found).any(axis=-1)
        settled = [functools.partial(off_axis, eigenvalues, *both) for both in zip(matrices, found)]
        return [Eigenvalues(values, again if doubtful else None) for values, again, doubtful in zip(found, settled, near)]

    def is_symmetric(self, x: Array) -> bool:
        """Return whether F_u is a large symmetric matrix, up to round-off: its eigenvalues are real."""
        if not self.is_sparse:
            return False
        matrix: Any = self.as_field().field_jacobian(x)
        return bool(abs(matrix - matrix.T).max() <= CORRECTED * abs(matrix).max())

    def eigenvalue_near(self, x: Array, value: complex) -> complex:
        """Return the eigenvalue of F_u that is nearest to a value; NaN where none is found."""
        if self.is_sparse:
            return nearest(self.as_field().field_jacobian(x), value)
        values = self.eigenvalues(x)
        return complex(values[np.argmin(np.abs(values - value))])

    def _row_sizes(self, x: Array) -> dict[str, Array]:
        """Return the largest entries of each row."""
        found = abs(self._jacobian(x)[1])
        return {"residual": found.max(axis=1).toarray().ravel() if self.is_sparse else found.max(axis=1, initial=0.0)}

    def carrier(self, other: Discretization) -> Carrier:
        """Return the function that carries vectors of unknowns to another system of this problem."""
        return self._between_scales(np.array, other)

    def refined(self) -> None:
        """Return None: there is no mesh."""

    def adapted(self, x: Array, control: MeshControl) -> None:
        """Return None: there is no mesh."""

    # --- what is known of its branches --------------------------------------------------------------------------

    #: Kinds of curves in two parameters that begin at, or pass, points of codimension two.
    leaving = {
        Label.BOGDANOV_TAKENS: (Label.FOLD, Label.HOPF, HOMOCLINIC),
        Label.GENERALIZED_HOPF: (Label.FOLD,),
        Label.ZERO_HOPF: (Label.FOLD, Label.HOPF, Label.TORUS),
        Label.DOUBLE_HOPF: (Label.HOPF, Label.TORUS),
    }

    def events(self) -> list[Event]:
        """Return the test function of Hopf points, where the states move in time."""
        return [hopf()] if self.problem.dynamics and self.state_size > 1 else []

    @property
    def small_equations(self) -> Batch | None:
        """The residual; None of kinds that are made of this one, whose equations may be others, and with a given Jacobian."""
        return self._residual if type(self) is Algebraic and self.problem.jacobian is None else None

    @property
    def starts_cycles(self) -> bool:
        """Where the states move in time."""
        return bool(self.problem.dynamics)

    @property
    def stored(self) -> dict[str, Array]:
        """Parameters and sizes."""
        return self._own_arrays

    def unstable(self, x: Array) -> int | None:
        """Return the number of unstable eigenvalues; None of large problems, and where nothing moves in time."""
        return None if self.is_sparse or not self.problem.dynamics else int(np.count_nonzero(self.eigenvalues(x).real > 0))

    def undetermined(self, x: Array) -> str:
        """Return which equations are dependent."""
        return dependence(self, x)

    def check_solution(self, x: Array) -> None:
        """Check that totals which were found to be conserved are so at a solution, too."""
        self.problem.check_totals(self.states(x)[0], self.all_parameters(x))

    @property
    def curves(self) -> Mapping[str, type]:
        """That of Hopf points."""
        return {HopfCurve.kind: HopfCurve}

    def defining(self, point: Solution, x: Array) -> tuple[HopfCurve, Array] | None:
        """Return that of Hopf points."""
        if point.label != HopfCurve.kind:
            return None
        pair = critical_pair(self.jacobian(x), frequency_of(point))
        return (HopfCurve(self.as_field(), size=pair.frequency**2), np.append(x, 1.0)) if pair.is_critical else None

    def events_on_folds(self) -> list[Event]:
        """Return those of a second eigenvalue zero (Bogdanov-Takens), and of a pair on the imaginary axis (zero-Hopf)."""
        if not self.problem.dynamics:
            return []

        def double_zero(trial: Trial) -> float:
            system = trial.system
            v, w = system.null_vectors(trial.x)
            base, scales = system.base, system.base.scales
            v, w = v[: base.state_size] * scales.states, w / scales.rows["residual"]
            return float(w @ v) / float(np.linalg.norm(v) * np.linalg.norm(w))

        def others(trial: Trial) -> tuple[float, bool]:
            values = trial.system.base.eigenvalues(trial.x)
            return other_pairs(np.delete(values, np.argmin(np.abs(values))))

        return [
            Event(Label.BOGDANOV_TAKENS, "Bogdanov-Takens", double_zero),
            Event(Label.ZERO_HOPF, "zero-Hopf", lambda trial: others(trial)[0], confirm=lambda trial: others(trial)[1]),
        ][: self.state_size - 1]  # a second eigenvalue takes two states, a pair three

    def form(self, x: Array) -> Any:
        """Return the characteristic matrix and the forms at an equilibrium."""
        field = self.as_field()
        return EquilibriumForm(self.jacobian(x), self.scales.states, lambda stacks: field.stack_along(x, stacks))

    def coefficient(self, point: SpecialPoint) -> Coefficient | None:
        """Return the first Lyapunov coefficient at a Hopf point; of folds, which take .3 ms, nothing."""
        if point.test is None or point.test.normal_form is fold:
            return None
        frequency, x = frequency_of(point), point.trial.x
        if frequency is None or not point.is_simple:
            return None
        form = self.form(x)
        if not form.pair(frequency).is_critical:
            return None
        return at_special_point(self, point, form) if self.is_smooth(x, frequency, form) else NOT_SMOOTH

    def is_smooth(self, x: Array, frequency: float | None, form: EquilibriumForm | None = None) -> bool:
        """Return whether the field at a Hopf point is a polynomial of third degree but for terms of fourth, along small cycles.

        Where its operations do not tell, smaller and smaller ones are tried, until what is left is round-off. ``form`` is that
        at x, if it is at hand.
        """
        field, last, ratio = self.thawed.as_field(), np.nan, np.nan
        (term,) = field._terms
        if term.batch.recorded is not None and term.batch.recorded.is_analytic:
            return True
        pair = (form or self.form(x)).pair(frequency)
        turning = np.exp(2j * np.pi * np.arange(_WAVES) / _WAVES)[:, None] * pair.right / np.abs(pair.right).max()
        waves, along = turning.real, (1j * pair.frequency * turning).real
        _, u, none, p = term.inputs(x)

        def left_over(h: float) -> Array:
            there = term.batch.values(np.zeros(_WAVES), u + h * waves, none, p)
            return there - here - np.tensordot(h ** np.arange(1, 4), terms, 1)

        with np.errstate(all="ignore"):
            terms, error = field.with_derivative_error(
                lambda: np.array([along, field.stack_along(x, [waves] * 2) / 2, field.stack_along(x, [waves] * 3) / 6])
            )
            if not np.isfinite(terms).all():
                return False
            here = term.batch.values(np.zeros(_WAVES), u.repeat(_WAVES, 0), none, p)
            for h in ASIDE * 0.5 ** np.arange(MOST_UPDATES):
                less, left, more = (left_over(h * (1 + part)) for part in (-ROUGH, 0, ROUGH))
                noise = np.abs(more - 2 * left + less).max() + h * (error + pair.off) * np.abs(along).max()
                if np.abs(left).max() <= CERTAIN * noise:
                    break
                ratio, last = last / np.abs(left).max(), np.abs(left).max()
        return not ratio < _DROPS


#: Largest part of its entries that may differ from zero.
_FEW = 0.1


def _dense(matrix: Any) -> Array:
    """Return a matrix that a user gives, which may be sparse, as an array."""
    return matrix if isinstance(matrix, np.ndarray) else np.asarray(matrix.toarray())
