"""Discretized problems of all kinds: names, values and places of parameters, and sizes by which unknowns are divided.

All tolerances, steps and norms of the engine are made for unknowns of order one. A system with scales works on x = (u / s_u, p
/ s_p), and on equations divided by sizes of their own, so that a problem in newtons and one in giganewtons are the same
problem. Scales are powers of two: multiplication by them is exact.
"""

from __future__ import annotations

import copy
import functools
from abc import abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, Self, TypeVar

import numpy as np

from contin import errors as checks
from contin.arrays import Array, Indices, Pattern
from contin.collocation.mesh import MeshControl
from contin.core.differences import derivative
from contin.core.protocol import Carrier, Discretization
from contin.draws import ASIDE
from contin.errors import ProblemError
from contin.functions.batch import Batch, Columns
from contin.functions.origin import condition
from contin.levels import LAST_PLACES
from contin.problems.angles import periods_of
from contin.problems.statement import Statement, with_multipliers
from contin.text import meant

#: Sizes between these bounds count as one: problems of everyday sizes are not scaled. Tolerances relative to 1 + |x| suit large
#: numbers, and small ones less.
USUAL = 1e-2, 1e3
#: Results at points, as sets of eigenvalues, that are kept: more than a search for Hopf points compares.
_KEPT = 128
_Result = TypeVar("_Result")


@dataclass(frozen=True, eq=False)
class Scales:
    """Sizes of the states (n,), of all parameters, and of the equations that have a number of their own.

    ``rows`` are those of boundary conditions and integral conditions, or of the residual of an algebraic problem.
    """

    states: Array
    parameters: Array
    rows: dict[str, Array]

    def arrays(self) -> dict[str, Array]:
        """Return all sizes by name, for a file."""
        return {"states": self.states, "parameters": self.parameters, **self.rows}

    @functools.cached_property
    def are_one(self) -> bool:
        """Whether nothing is scaled."""
        return all(np.all(sizes == 1) for sizes in self.arrays().values())

    @classmethod
    def of_arrays(cls, arrays: dict[str, Array]) -> Scales:
        """Return the scales that `arrays` gave."""
        rows = {name: sizes for name, sizes in arrays.items() if name not in ("states", "parameters")}
        return cls(arrays["states"], arrays["parameters"], rows)


@functools.cache  # systems with the same sizes have the same object
def nothing_scaled(states: int, parameters: int, rows: tuple[tuple[str, int], ...]) -> Scales:
    """Return sizes that are all one; ``rows`` are names and numbers of equations."""
    return Scales(np.ones(states), np.ones(parameters), {name: np.ones(count) for name, count in rows})


def largest_entries(entries: Callable[[Array], Array], x: Array) -> Array:
    """Return the larger of ``entries(x)`` and of those beside x, where these are finite."""
    here = entries(x)
    with np.errstate(all="ignore"):
        beside = entries(x + ASIDE * (1 + np.abs(x)))
    return np.maximum(here, np.where(np.isfinite(beside), beside, 0.0))


def usual(sizes: Array | float, stated: Pattern | bool = False) -> Array:
    """Return sizes as powers of two; 1 for those of everyday size that are not stated, and for zero, infinity and NaN."""
    sizes = np.abs(sizes)
    odd = np.isfinite(sizes) & (sizes > 0) & (stated | (sizes < USUAL[0]) | (sizes > USUAL[1]))
    return np.where(odd, np.exp2(np.round(np.log2(np.where(odd, sizes, 1.0)))), 1.0)


#: Times, states, states at the other end and parameters: what functions are called with.
Inputs = tuple[Array, Array, Array, Array]


class Term(NamedTuple):
    """Functions f of K points, combined linearly into equations or columns: a part of F(x), x = (u, p),

        R f(P u, p),     with the derivatives  R [ f_u P   f_p ],

    P and R linear. ``inputs(x)`` are t, P u, states at the other end and parameters. ``rows`` takes values (K, count) to R f,
    ``weights`` is R^T. ``by_x`` is P^T, with sums over the points for the free parameters: it takes derivatives by the inputs
    (K, columns) to those by x. ``moved`` takes a direction of x to P u and so on, where P depends on x.
    """

    system: System
    batch: Batch
    inputs: Callable[[Array], Inputs]
    rows: Callable[[Array], Array]
    weights: Callable[[Array], Array]
    by_x: Callable[[Array], Array]
    moved: Callable[[Array], Inputs] | None = None

    def values(self, x: Array) -> Array:
        """Return R f."""
        return self.rows(self.batch.values(*self.inputs(x)))

    def slopes(self, x: Array, columns: Columns) -> Array:
        """Return derivatives of f, shape (K, count, columns)."""
        return self.batch.jacobian(*self.inputs(x), columns)[1]

    def along(self, x: Array, directions: Sequence[Array]) -> Array:
        """Return the derivative of R f along several directions."""
        if not self.batch.bends(self.columns):
            return np.zeros(self.system.equations)
        return self.rows(self.batch.along(*self.inputs(x), [self._direction(v) for v in directions]))

    def bent(self, x: Array, w: Array, v: Array) -> Array:
        """Return the gradient by x of the derivative of w.R f along v."""
        columns = self.columns
        if not self.batch.bends(columns):
            return np.zeros(self.system.size)
        return self.by_x(self.batch.bent(*self.inputs(x), self.weights(w), self._direction(v), columns))

    def transposed(self, x: Array, w: Array) -> Array:
        """Return the gradient by x of w.R f."""
        columns, weights = self.columns, self.weights(w)
        entries, slopes = self.batch.entries(*self.inputs(x), columns)[1], np.zeros((columns.width, len(weights)))
        np.add.at(slopes, columns.places, (weights[:, columns.rows] * entries).T)
        return self.by_x(slopes.T)

    @property
    def columns(self) -> Columns:
        """Columns of the derivatives by states and free parameters."""
        return self.batch.columns(self.system._free)

    def _direction(self, v: Array) -> Array:
        """Return a direction of x as one of all inputs."""
        _, states, other, _ = (self.moved or self.inputs)(v)
        return self.system._wide(v, np.concatenate([states, other], axis=1) if len(other) else states)


class System(Discretization):
    """A problem with chosen free parameters; ``x`` holds the states, flattened, then the free parameters.

    Raises ProblemError for an unknown parameter.

    - ``problem`` (Statement)
    - ``free`` (tuple of str): The free parameters.
    - ``parameters`` (ndarray): Values of all parameters; those of the free ones are not used.
    - ``state_size`` (int): Where the free parameters begin in x; set by the kinds of system.
    """

    parameters: Array

    def __init__(
        self, problem: Statement, free: Sequence[str], parameters: Mapping[str, float], scales: Scales | None = None
    ) -> None:
        self.problem, self.free = problem, with_multipliers(problem, free)
        names = tuple(problem.parameters)
        for name in (*self.free, *parameters):
            if name not in names:
                raise ProblemError(f"parameter {name!r} is not one of {', '.join(names)}{meant(name, names)}")
        self.parameters = np.array([float(parameters.get(name, problem.parameters[name])) for name in names])
        self._free = self._indices(self.free)
        self.scales = scales or nothing_scaled(len(problem.states), len(names), self._rows)
        self._fixed = self.parameters / self.scales.parameters
        #: Sizes of the free parameters.
        self.free_scales: Array = self.scales.parameters[self._free]

    def _complete(self) -> None:
        """Set what a kind of problem adds; called when the rest is set."""

    @property
    def _values(self) -> dict[str, float]:
        """Values of all parameters by name; those of the free ones are not used."""
        return dict(zip(self.problem.parameters, map(float, self.parameters)))

    @property
    def _rows(self) -> tuple[tuple[str, int], ...]:
        """Names and numbers of the equations that have sizes of their own."""
        return ()

    def __repr__(self) -> str:
        mesh = f"{self.intervals} interval{'s' * (self.intervals != 1)} of degree {self.degree}, " * bool(self.intervals)
        return (
            f"{type(self).__name__}({mesh}states {checks.listed(self.problem.states)}; free {', '.join(self.free) or 'none'})"
        )

    def __getstate__(self) -> dict[str, Any]:
        """Return what is pickled: all but what is computed when it is first asked for, such as compiled functions."""
        kinds = {name: getattr(type(self), name, None) for name in vars(self)}
        return {name: value for name, value in vars(self).items() if not isinstance(kinds[name], functools.cached_property)}

    @functools.cached_property
    def _known(self) -> dict[tuple[str, bytes], Any]:
        """What `_once` has made."""
        return {}

    def _once(self, what: str, at: Array, make: Callable[[], _Result]) -> _Result:
        """Return what is made of a vector, made once for the last few of them."""
        key = what, at.tobytes()
        if key not in self._known:
            if len(self._known) >= _KEPT:
                del self._known[next(iter(self._known))]
            self._known[key] = make()
        return self._known[key]

    def _indices(self, names: Sequence[str]) -> Indices:
        """Return the places of parameters among all of them."""
        return np.array([list(self.problem.parameters).index(name) for name in names], dtype=np.int64)

    def pack(self, states: object, values: Mapping[str, float]) -> Array:
        """Return a vector of unknowns from states and the mapping of free parameters."""
        scaled = np.asarray(states, dtype=float).reshape(-1, self.scales.states.size) / self.scales.states
        return np.concatenate([scaled.ravel(), np.array([float(values[name]) for name in self.free]) / self.free_scales])

    def all_parameters(self, x: Array) -> Array:
        """Return the values of all parameters, shape (number of names,), the free ones from x."""
        p = self.parameters.copy()
        p[self._free] = x[self.state_size :] * self.free_scales
        return p

    def scaled_parameters(self, x: Array) -> Array:
        """Return all parameters divided by their sizes."""
        p = self._fixed.copy()
        p[self._free] = x[self.state_size :]
        return p

    @property
    def _own_arrays(self) -> dict[str, Array]:
        """Parameters and sizes, by the names under which they are stored."""
        sizes = {} if self.scales.are_one else {f"scale_{name}": array for name, array in self.scales.arrays().items()}
        return {"parameters": self.parameters, **sizes}

    def _batch(self, name: str, rows: Sequence[str] = ()) -> Batch:
        """Return some of the functions, compiled, of scaled inputs; ``rows`` name the sizes of its values."""
        batch: Batch = self.problem.batch(name)
        if self.scales.are_one:
            return batch
        sizes, states = {"states": self.scales.states, **self.scales.rows}, self.scales.states
        values = np.concatenate([sizes[row] for row in rows]) if rows else np.ones(batch.count)
        ends = [states] if batch.signature.ends else []
        return batch.sized(np.concatenate([states, *ends, self.scales.parameters]), values)

    def _between_scales(self, carry: Carrier, other: Any) -> Carrier:
        """Return a carrier of unknowns as they are, made one to a system that may have other scales."""
        if other.scales is self.scales or (self.scales.are_one and other.scales.are_one):
            return carry
        ours, theirs = self.unscaled_factors, other.unscaled_factors
        return lambda x: carry(x * ours) / theirs

    @property
    def unscaled_factors(self) -> Array:
        """Sizes of all unknowns, shape (size,)."""
        return np.concatenate([np.tile(self.scales.states, self.state_size // self.scales.states.size), self.free_scales])

    @functools.cached_property
    def circles(self) -> Array:
        """Periods of the states that are angles, divided by their sizes, and zero for the others, shape (n,)."""
        return periods_of(self.problem) / self.scales.states

    def magnitudes(self, x: Array) -> Array:
        """Return the largest value of each state, and each free parameter, in the places of the unknowns, shape (size,)."""
        count, largest = len(self.problem.states), self.largest(x)
        return np.append(np.tile(largest[:count], self.state_size // count), largest[count:])

    def largest(self, v: Array) -> Array:
        """Return the largest absolute value of each state, and that of each free parameter, of a vector like x."""
        sizes, count = np.abs(v), self.state_size
        return np.concatenate([sizes[:count].reshape(-1, len(self.problem.states)).max(axis=0, initial=0.0), sizes[count:]])

    def with_rounds_of(self, x: Array, given: Mapping[str, float]) -> tuple[Self, Array]:
        """Return the same with the rounds that angles make in x, unless they are given, and a continuous x."""
        return self, x

    def with_scales(self, x: Array, states: Array, parameters: Array) -> tuple[Self, Array]:
        """Return the same problem with these sizes of states and parameters, sizes of rows found at x, and x for it.

        Kinds of system that have no scales return themselves.
        """
        return self, x

    def without_scales(self, x: Array) -> tuple[Self, Array]:
        """Return the same problem in the user's units, and x for it."""
        return self, x

    def parameter(self, x: Array, name: str) -> float:
        return float(self.all_parameters(x)[list(self.problem.parameters).index(name)])

    def parameter_index(self, name: str) -> int:
        return self.state_size + self.free.index(name)

    def column_gradient(self, x: Array, name: str) -> Array | None:
        """Return the derivatives of a column (a parameter or functional) by x, shape (size,); None where they are not known."""
        if name in self.free:
            at = self.parameter_index(name)
            unit = np.zeros(self.size)
            unit[at] = self.free_scales[at - self.state_size]
            return unit
        return np.zeros(self.size) if name in self.problem.parameters else None

    @abstractmethod
    def parameter_columns(self, x: Array, names: Sequence[str]) -> Array:
        """Return the derivatives of F by any parameters, free or not, shape (equations, len(names))."""

    def column_bent(self, x: Array, name: str, v: Array) -> Array:
        """Return the derivative of `column_gradient` along v, shape (size,), of a column where that is known."""
        longest = np.abs(v).max(initial=0.0)
        if name in self.problem.parameters or not longest:
            return np.zeros(self.size)
        return derivative(lambda s: self.column_gradient(x + s * v, name), 1, 1 / longest)[0]

    def with_derivative_error(self, function: Callable[[], Any]) -> tuple[Any, float]:
        """Return what a function returns, and the estimated relative error of the derivatives that it took.

        That is round-off, or the error of differences: of these alone, whatever was computed before.
        """
        batches = [batch.interpreted for batch in self._evaluated if batch.interpreted is not None]
        before = [batch.error for batch in batches]
        for batch in batches:
            batch.error = 0.0
        found = function()
        error = max([LAST_PLACES, *(batch.error for batch in batches)])
        for batch, known in zip(batches, before):
            batch.error = max(batch.error, known)
        return found, error

    @property
    def _evaluated(self) -> Sequence[Batch]:
        """The functions that the equations are made of."""
        return ()

    def _wide(self, v: Array, states: Array) -> Array:
        """Return directions in the space of all inputs of functions: of states (K, n), and of the free parameters in v.

        v has the shape (size,) or (K, size), or no free parameters.
        """
        wide = np.zeros((len(states), states.shape[1] + len(self.parameters)))
        wide[:, : states.shape[1]] = states
        if v.shape[-1] > self.state_size:
            wide[:, states.shape[1] + self._free[: v.shape[-1] - self.state_size]] = v[..., self.state_size :]
        return wide

    def _scaled_states(self, x: Array) -> Array:
        """Return the states divided by their sizes, a view of x, shape (K, n)."""
        return x[: self.state_size].reshape(-1, self.scales.states.size)

    @abstractmethod
    def refined(self) -> tuple[System, Carrier] | None:
        """Return the same problem with every interval halved, and the carrier; None without a mesh."""

    @abstractmethod
    def adapted(self, x: Array, control: MeshControl) -> tuple[System, Carrier] | None:
        """Return the same problem on a better mesh for x, and the carrier; None where there is no need."""

    def on_switches(self, x: Array, closely: bool = False) -> tuple[System, Carrier] | None:
        """Return the same problem on a mesh with the places of `switching` among its points; None where there is no need."""
        return None

    @abstractmethod
    def with_parameters(self, values: Mapping[str, float]) -> System:
        """Return the same problem with other values of parameters that are not free."""

    @abstractmethod
    def with_free(self, free: Sequence[str], x: Array) -> tuple[System, Array]:
        """Return the same problem with other free parameters (values from x), and x for it."""


class Composed(System):
    """A system whose equations are made of terms: it has their derivatives, and scales."""

    #: Names of the functions of the terms.
    _functions: tuple[str, ...] = ()

    @property
    @abstractmethod
    def _terms(self) -> Sequence[Term]:
        """F, but for what is linear and for conditions beyond those of the problem."""

    @property
    @abstractmethod
    def _column_term(self) -> Term:
        """The functionals that `integrated` names."""

    @property
    def integrated(self) -> tuple[str, ...]:
        """Names of the functionals that are functions, or integrals of them, in the order of the compiled functions."""
        return tuple(self.problem.functionals)

    @functools.cached_property
    def _functionals(self) -> Batch:
        """The functionals, of scaled inputs."""
        return self._batch("functionals")

    def functionals(self, x: Array) -> Array:
        """Return the values of the problem's functionals, in their order."""
        return self._column_term.values(x) if self.integrated else np.empty(0)

    @property
    def _evaluated(self) -> Sequence[Batch]:
        """The functions that the equations are made of; in the user's units, too."""
        return [*(term.batch for term in self._terms), *map(self.problem.batch, self._functions)]

    def evaluations(self, x: Array) -> list[tuple[Batch, Array, Array, Array, Array]]:
        """Return the functions that F is made of in the user's units, with the t, u, v and p that they are called with at x."""
        sizes, p, given = self.scales.states, self.all_parameters(x), [term.inputs(x) for term in self._terms]
        return [(self.problem.batch(name), t, u * sizes, v * sizes, p) for name, (t, u, v, _) in zip(self._functions, given)]

    def along(self, x: Array, directions: Sequence[Array]) -> Array:
        """Return the derivative of F along several directions, shape (equations,)."""
        return functools.reduce(np.add, [term.along(x, directions) for term in self._terms])

    def bent(self, x: Array, w: Array, v: Array) -> Array:
        """Return the gradient of w.(F_x v) by x, the derivative of F_x^T w along v, shape (size,), for w (equations,)."""
        return functools.reduce(np.add, [term.bent(x, w, v) for term in self._terms])

    def parameter_columns(self, x: Array, names: Sequence[str]) -> Array:
        found, which = np.zeros((self.equations, len(names))), self._indices(names)
        for term in self._terms:
            slopes = term.slopes(x, term.batch.columns(which, ()))
            for k in range(len(names)):
                found[:, k] += term.rows(slopes[:, :, k])
        return found

    def column_gradient(self, x: Array, name: str) -> Array | None:
        if name not in self.integrated:
            return super().column_gradient(x, name)
        term, at = self._column_term, self.integrated.index(name)
        return term.by_x(term.weights(self._unit(name))[:, at, None] * term.slopes(x, term.columns)[:, at])

    def column_bent(self, x: Array, name: str, v: Array) -> Array:
        return self._column_term.bent(x, self._unit(name), v) if name in self.integrated else super().column_bent(x, name, v)

    def _unit(self, name: str) -> Array:
        """Return the weights of the functionals in one of them."""
        return np.array([float(other == name) for other in self.integrated])

    # --- conditions that unknowns decide ---------------------------------------------------------------------------

    @functools.cached_property
    def _decided(self) -> list[tuple[str, int]]:
        """Functions, and places of conditions on their tapes; along t, those on parameters alone."""
        batches = ((name, self.problem.batch(name)) for name in self._functions)
        return [(name, at) for name, batch in batches for at in batch.conditions(self._free, name == "field")]

    @property
    def conditions(self) -> int:  # type: ignore[override]
        """Their number."""
        return len(self._decided)

    @property
    def knots(self) -> list[int]:  # type: ignore[override]
        """Those that are knots of tables."""
        kept: list[Any] = [self.problem.batch(name).recorded for name, _ in self._decided]
        return [k for k, (_, at) in enumerate(self._decided) if kept[k].recording.tape.operations[at].name == "table"]

    def written(self, k: int, side: float) -> str:
        """Return what the user has written for a condition or, where that is not known, the number that decides it.

        Of a contact, whether it touches or lifts off at this side.
        """
        name, at = self._decided[k]
        batch, states = self.problem.batch(name), self.problem.states
        own = [number for number, (other, _) in enumerate(self._decided) if other == name]
        if contact := getattr(self.problem, "contacts", {}).get(at) if batch.signature.ends else None:
            return f"{contact} {'touches' if side > 0 else 'lifts off'}"
        if known := condition(batch, at, [self._decided[number][1] for number in own]):
            return known
        labels = [f"{end}.{state}" for end in "ab" for state in states] if batch.signature.ends else states
        numbers = batch.frozen(self._free, np.ones(len(own)), name == "field")[1]
        return numbers.text([*labels, *self.problem.parameters])[own.index(k) - len(own)]

    def with_sides(self, sides: Array) -> Self:
        """Return the same with frozen outcomes; with none, the equations as they are."""
        other = copy.copy(self)  # without what was computed
        other.sides = sides
        return other

    @property
    def thawed(self) -> Any:
        """The equations as they are."""
        return self._thawed if self.sides.size else self

    @functools.cached_property
    def _thawed(self) -> Any:
        return self.with_sides(np.empty(0))

    def _frozen(self, name: str, batch: Batch, which: int = 0) -> Any:
        """Return one of the functions with these outcomes or, with 1, the numbers that decide."""
        sides = self.sides[[other == name for other, _ in self._decided]] if self.sides.size else self.sides
        return batch.frozen(self._free, sides, name == "field")[which] if sides.size else batch

    @functools.cached_property
    def unscaled(self) -> Batch:
        """The last of the functions, in the user's units."""
        name = self._functions[-1]
        return self._frozen(name, self.problem.batch(name))

    @functools.cached_property
    def _deciding(self) -> list[tuple[int, Any]]:
        """The numbers that decide: places of functions, and theirs."""
        names = [name for name, _ in dict.fromkeys(self._decided)]
        return [(self._functions.index(name), self._frozen(name, self._batch(name), 1)) for name in dict.fromkeys(names)]

    def numbers(self, x: Array) -> tuple[Array, Array]:
        """Return the numbers whose signs decide, shape (K,), and their derivatives by x, (K, size), with these outcomes."""
        terms, found, rows = self._terms, list[Array](), list[Array]()
        for at, batch in self._deciding:
            values, slopes = batch.jacobian(*terms[at].inputs(x), batch.columns(self._free))
            found.append(values[0])
            each = [terms[at].by_x(slopes[:, k]) / len(values) for k in range(batch.count)] if self.intervals else slopes[0]
            rows.append(np.array(each))  # along t they are all alike
        return np.concatenate(found), np.concatenate(rows)

    # --- the same with other parameters and sizes -----------------------------------------------------------------

    #: Mesh and degree, of kinds that have them.
    _grid: tuple[Any, ...] = ()

    def _with(self, **changes: object) -> Self:
        """Return the same with other free parameters, parameters or scales; with frozen outcomes if these are the same."""
        given: dict[str, Any] = {"free": self.free, "parameters": self._values, "scales": self.scales, **changes}
        other = type(self)(self.problem, *self._grid, **given)
        other.sides = self.sides if (other.free, other.size) == (self.free, self.size) else other.sides
        return other

    def with_parameters(self, values: Mapping[str, float]) -> Self:
        return self._with(parameters=self._values | dict(values))

    def with_free(self, free: Sequence[str], x: Array) -> tuple[Self, Array]:
        values = dict(zip(self.problem.parameters, self.all_parameters(x)))
        other = self._with(free=free, parameters=values)
        return other, other.pack(self.states(x), values)

    def with_scales(self, x: Array, states: Array, parameters: Array) -> tuple[Self, Array]:
        rows = {name: np.ones(count) for name, count in self._rows}
        scaled = self._with(scales=Scales(states, parameters, rows))
        z = self.carrier(scaled)(x)
        found = {name: usual(largest_entries(lambda at: scaled._row_sizes(at)[name], z)) for name in rows}  # noqa: B023
        return self._with(scales=Scales(states, parameters, found)), z

    def without_scales(self, x: Array) -> tuple[Self, Array]:
        other = self._with(scales=None)
        return other, self.carrier(other)(x)

    @abstractmethod
    def _row_sizes(self, x: Array) -> dict[str, Array]:
        """Return the largest entries of F_x in the rows that have sizes of their own."""
