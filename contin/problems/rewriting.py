"""Functions made from those of users: vector fields of orbits, and mass matrices.

M u' = F with a constant mass matrix M becomes u' = f. A regular M is inverted. Of a singular one, the columns of the states z
depend on those of other states k: M = M_k [1 E] for u = (k, z). The rates of y = k + E z are known, those of z are not. E = 0
where columns are zero. With L1 M_k = 1, and rows L2 that span what M maps nothing to,

    y' = L1 F(y - E z, z),        0 = L2 F(y - E z, z),

where z is found for given y by Newton's method, as an operation of the tape (`contin.functions.iteration`). That takes an index
of one: the derivative of L2 F by z is regular.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from contin import errors as checks
from contin.arrays import Array, Function, Named
from contin.errors import ProblemError
from contin.functions.iteration import MOST, root
from contin.functions.recording import result_count
from contin.functions.signature import Signature, argument_count, named_values, takes_arrays
from contin.levels import CORRECTED
from contin.problems.statement import unused


def returning(field: Function, signature: Signature) -> Function:
    """Return a field that fills an array, or takes states as arrays only, as one of named values that returns the rates."""
    counted, wanted = argument_count(checks.function("field", field)), len(signature.arguments)
    if counted == wanted + 1:
        known, count = len(signature.parameters), len(signature.states)

        def rates(times: tuple[float, ...], u: Named, p: Named) -> Any:
            out = np.zeros(count)
            field(*times, np.array(list(u)), np.array(list(p)[:known]), out)
            return [out[i] for i in range(count)]

    elif counted == wanted and takes_arrays(field, signature.arguments):

        def rates(times: tuple[float, ...], u: Named, p: Named) -> Any:
            return field(*times, np.array(list(u)), p)

    elif counted == wanted and _unpacks(field, signature):
        own, known = named_values(signature.parameters), len(signature.parameters)

        def rates(times: tuple[float, ...], u: Named, p: Named) -> Any:
            return field(*times, u, own(*list(p)[:known]))

    else:
        return field
    returned: Function = (lambda t, u, p: rates((t,), u, p)) if signature.times else (lambda u, p: rates((), u, p))
    try:
        result_count(returned, signature.arguments, "field")
    except ProblemError:
        return field  # one of (t, u, p) in place of (u, p, out): `check_field` says so
    return returned


def _unpacks(field: Function, signature: Signature) -> bool:
    """Return whether a field takes its own parameters only, as `a, b = p` does, and not those that a kind of problem adds."""
    more = Signature(signature.states, (*signature.parameters, "one_more_"), times=signature.times)
    try:
        result_count(field, signature.arguments, "field")
    except ProblemError:
        return False
    try:
        result_count(field, more.arguments, "field")
    except ProblemError:
        return True
    return False


def check_field(field: Function, signature: Signature, wrong: str) -> None:
    """Check that a field takes these arguments and returns a value for each state; ``wrong`` is said of other arguments.

    Raises ProblemError otherwise.
    """
    if argument_count(checks.function("field", field)) != len(signature.arguments):
        raise ProblemError(f"field: {wrong}")
    names, count = signature.states, result_count(field, signature.arguments, "field")
    if count != len(names):
        raise ProblemError(f"field returns {count} values for the {len(names)} states {', '.join(names)}")


def of_parameters(
    what: str, value: float | str | Function, parameters: Mapping[str, float], positive: bool = False
) -> Function:
    """Return a number, parameter or function of the parameters as a function of these; ``what`` names it in messages.

    Raises ProblemError where it is none of these, or a number that is not positive where it must be.
    """
    if isinstance(value, str):
        if value not in parameters:
            raise ProblemError(f"{what}: {checks.shown(value)} is no parameter; there are {', '.join(parameters) or 'none'}")
        return lambda p: getattr(p, value)
    if callable(value):
        if argument_count(value) != 1:
            raise ProblemError(f"{what}: must be a function of p alone")
        return value
    checks.number(what, value, *([0] if positive else []))
    number = float(value)
    return lambda p: number


def scaled(field: Function, by: str, parts: int = 1) -> Function:
    """Return the right-hand side that is the field times a parameter, divided by a number of parts."""

    def rhs(t: float, u: Named, p: Named) -> Any:
        factor = getattr(p, by) / parts if parts > 1 else getattr(p, by)
        return [factor * rate for rate in field(u, p)]

    return rhs


def found_elsewhere(u: Named, p: Named) -> float:
    """Stand for a column that the discretized problem computes: it is no integral, and never called."""
    raise NotImplementedError


def combined(rows: Sequence[Sequence[float]], values: Sequence[Any]) -> list[Any]:
    """Return the products of rows and values; zeros and ones are not multiplied."""
    results = []
    for row in rows:
        terms = [value if factor == 1 else factor * value for factor, value in zip(row, values) if factor]
        results.append(sum(terms[1:], terms[0]))
    return results


@dataclasses.dataclass(frozen=True)
class Mass:
    """A mass matrix, analysed.

    Attributes
    ----------
    matrix : ndarray, shape (n, n)
    kept, found : list of int
        Places of the states k and z.
    others : list of list of float
        E, a row for each of k.
    rates, algebraic : list of list of float
        Rows L1 and L2.
    """

    matrix: Array
    kept: list[int]
    found: list[int]
    others: list[list[float]]
    rates: list[list[float]]
    algebraic: list[list[float]]

    @classmethod
    def of(cls, mass: Any, names: Sequence[str]) -> Mass:
        """Return a matrix or diagonal, analysed; raise ProblemError where it is neither, or too many states have no rates."""
        n = len(names)
        given = mass.toarray() if hasattr(mass, "toarray") else mass
        try:
            diagonal = np.ndim(given) == 1
        except ValueError:
            diagonal = False
        matrix = checks.array("mass", given, (n,) if diagonal else (n, n))
        matrix = np.diag(matrix) if diagonal else matrix
        kept = _independent(matrix)
        found = [i for i in range(n) if i not in kept]
        if not kept:
            raise ProblemError("mass: it is zero; leave it out and state dynamics=False")
        left, sizes, right = np.linalg.svd(matrix[:, kept])
        if len(found) > MOST:
            raise ProblemError(f"mass: {len(found)} states have no rates, at most {MOST} can be found")
        rates = right.T @ (left[:, : len(kept)] / sizes).T
        others = _cleaned(rates @ matrix)[:, found] if matrix[:, found].any() else np.zeros((len(kept), len(found)))
        zero_rows = np.flatnonzero(~matrix.any(axis=1))
        algebraic = np.eye(n)[zero_rows] if len(zero_rows) == len(found) else left[:, len(kept) :].T
        return cls(matrix, kept, found, others.tolist(), _cleaned(rates).tolist(), algebraic.tolist())

    @property
    def is_regular(self) -> bool:
        """All states have rates."""
        return not self.found

    def kept_names(self, names: Sequence[str]) -> list[str]:
        """Return the names of y: those of k or, where E is not zero, such as ``mass_x``."""
        return [unused(f"mass_{names[i]}", names) if any(row) else names[i] for i, row in zip(self.kept, self.others)]

    @property
    def columns(self) -> list[int]:
        """Places of the states that follow from y: z, and those of k that y is not."""
        return sorted([*self.found, *(i for i, row in zip(self.kept, self.others) if any(row))])

    def of_states(self, states: Array) -> Array:
        """Return y of states (..., n)."""
        return states[..., self.kept] + states[..., self.found] @ np.reshape(self.others, (len(self.kept), -1)).T

    def rates_of(self, field: Function, arguments: int) -> Function:
        """Return the rates of the states that have some, as a function of ``arguments`` arguments: (u, p) or (t, u, p)."""
        rows = self.rates
        return _of(lambda *given: combined(rows, field(*given)), arguments)

    def jacobian_of(self, jacobian: Function, arrays: bool) -> Function:
        """Return the derivatives of `rates_of` a field with these, which may take arrays."""
        rows = np.array(self.rates)

        def of_rates(u: Any, p: Any) -> Any:
            found = jacobian(np.array(list(u)), np.array(list(p))) if arrays else jacobian(u, p)
            return (type(found)(rows) if hasattr(found, "tocsr") else rows) @ found

        return of_rates

    def of_kept(
        self, function: Function, field: Function, names: Sequence[str], start: Sequence[float], arguments: int
    ) -> Function:
        """Return a function of all states as one of y: z is found from a start such that L2 F = 0, with the field F."""
        state = named_values(tuple(names))
        kept, found, others, algebraic = self.kept, self.found, self.others, self.algebraic
        starts = [float(value) for value in start]

        def of_kept(*given: Any) -> Any:
            *times, u, p = given

            def whole(z: Sequence[Any]) -> Any:
                known = dict(zip(found, z))
                for i, value, row in zip(kept, u, others):
                    known[i] = value - combined([row], z)[0] if any(row) else value
                return state(*(known[i] for i in range(len(names))))

            z = root(lambda w: combined(algebraic, field(*times, whole(w), p)), starts)
            return function(*times, whole(z), p)

        return _of(of_kept, arguments)

    def check_index(self, jacobian: Array, names: Sequence[str]) -> None:
        """Check that F_u (n, n) determines z at a place; raise ProblemError where the derivative of L2 F by z is singular."""
        by_found = jacobian[:, self.found] - jacobian[:, self.kept] @ np.reshape(self.others, (len(self.kept), -1))
        by_found = np.array(self.algebraic) @ by_found
        if not np.isfinite(by_found).all():
            return
        sizes = np.abs(by_found).max(axis=1, keepdims=True)
        by_found = by_found / np.where(sizes > 0, sizes, 1.0)
        values = np.linalg.svd(by_found, compute_uv=False)
        if not values[-1] > CORRECTED * values[0]:
            states = checks.listed(names[i] for i in self.found)
            raise ProblemError(
                f"mass: the equations without rates do not determine {states} at the guess, as their derivatives by these are "
                "singular: the index is larger than one; differentiate them by the time until they do, or take another guess"
            )


def _independent(matrix: Array) -> list[int]:
    """Return the first columns on which all others depend, whatever their units are."""
    sizes = np.abs(matrix).max(axis=0)
    kept = [int(i) for i in np.flatnonzero(sizes)]

    def rank(columns: list[int]) -> int:
        return int(np.linalg.matrix_rank(matrix[:, columns] / sizes[columns], rtol=CORRECTED))

    if not kept or rank(kept) == len(kept):
        return kept
    found: list[int] = []
    for i in kept:
        found += [i] if rank([*found, i]) > len(found) else []
    return found


def _cleaned(matrix: Array) -> Array:
    """Return a matrix without round-off in the place of zeros."""
    return np.where(np.abs(matrix) > CORRECTED * np.abs(matrix).max(axis=1, keepdims=True), matrix, 0.0)


def _of(function: Callable[..., Any], count: int) -> Function:
    """Return a function of any arguments as one of two, (u, p), or of three, (t, u, p)."""
    if count == 2:
        return lambda u, p: function(u, p)
    return lambda t, u, p: function(t, u, p)
