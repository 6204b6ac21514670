"""Statement of an algebraic problem F(u, p) = 0."""

from __future__ import annotations

import contextlib
import functools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar, cast

import numpy as np

from contin import errors as checks
from contin.arrays import Array, Function, Places
from contin.collocation.mesh import MOST_INTERVALS
from contin.core.system import Scales
from contin.equilibria.dependence import conservation_laws, written
from contin.equilibria.equations import Algebraic
from contin.errors import ProblemError, warn
from contin.functions import round_off
from contin.functions.batch import Batch
from contin.functions.recording import result_count
from contin.functions.signature import Arguments, Signature, argument_count, named_values
from contin.levels import LOCATED
from contin.problems.angles import angle_periods, check_periodic
from contin.problems.rewriting import Mass, combined, returning
from contin.problems.statement import MOST_CONDITIONS, Restated, check_statement, unused


@dataclass(frozen=True, eq=False, repr=False)
class AlgebraicProblem(Restated):
    """F(u, p) = 0, or the equilibria of u' = F(u, p).

    Where u' = F(u, p) conserves totals of the states, `solve` makes each a parameter, ``total_`` + the name of a state that
    follows from it, and is a column then. Its value is that of the guess, or is given among the parameters.

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
        Whether u' = F(u, p): Hopf points are then looked for, and conserved totals become parameters. Needs as many
        equations as states. For 200 states or more with a
        sparse Jacobian, only the eigenvalues near the imaginary axis and right of it are computed.
    count : int, optional
        Number of equations of a residual that fills an array; as many as states by default.
    jacobian : callable, optional
        ``jacobian(u, p)``, with the arguments of the residual, returns the derivatives by the states: an array (equations,
        states) or a sparse matrix of SciPy. It is called in Python, and compared with differences of the residual once, near
        the first solution. Derivatives by parameters are still found.
    angles : sequence of str, or mapping of str to float, optional
        States in which the residual is periodic, with the period 2 pi or, in a mapping, any other. Solutions that differ by
        whole rounds are the same: a branch that comes back one round on is closed.
    mass : matrix, or sequence of float, optional
        The constant matrix M of M u' = F(u, p), or its diagonal. A state whose column is zero has no rate: it is a column,
        found from the equations without rates, which must determine it (an index of one), from the value of the guess on. Where
        columns depend on each other, combinations of states have rates: these are states such as ``mass_x``.
    solver : callable, optional
        ``solver(matrix)`` factors a square sparse matrix of SciPy (CSC) and returns an object with ``solve(b, trans)``: b of
        the shape (n,) or (n, k), trans "N" or "T" (transposed). It raises RuntimeError where the matrix is singular. By
        default ``scipy.sparse.linalg.splu``. It is used for all solves where the matrix is kept sparse (from 200 states on),
        with border rows and columns in the matrix; complex shifts of eigenvalues stay with SuperLU. An attribute ``sign`` is
        the sign of the determinant; without it, and without factors like those of SuperLU, branch points are counted by solves
        alone.

    Raises
    ------
    ProblemError

    Examples
    --------
    >>> from contin import solve
    >>> cubic = AlgebraicProblem(lambda u, p: (p.a - u.x**3,), ["x"], {"a": 8.0}, functionals={"square": lambda u, p: u.x**2})
    >>> round(solve(cubic, [1.0])["square"], 10)
    4.0
    """

    residual: Function
    states: Sequence[str] | int
    parameters: Mapping[str, float]
    functionals: Mapping[str, Function] = field(default_factory=dict)
    dynamics: bool = True
    count: int | None = None
    jacobian: Function | None = None
    pattern: Any = None
    angles: Any = ()
    mass: Any = None
    solver: Function | None = None
    #: There is no t.
    domain: ClassVar[None] = None

    def __post_init__(self) -> None:
        self._keep(states=check_statement(self.states, self.parameters, self.functionals, MOST_INTERVALS))
        checks.truth("dynamics", self.dynamics)
        if self.count is not None:
            checks.whole("count", self.count, 1, MOST_CONDITIONS)
        checks.function("residual", self.residual)
        arguments = argument_count(self.residual)
        if arguments not in (2, 3):
            raise ProblemError(f"residual takes {arguments} arguments, must take 2 (or 3, to fill the last)")
        if self.jacobian is not None and argument_count(checks.function("jacobian", self.jacobian)) != 2:
            raise ProblemError("jacobian must take 2 arguments, (u, p)")
        if self.solver is not None:
            checks.function("solver", self.solver)
        if self.pattern is not None:
            what = "pattern= has no effect any more, and will go: entries are found by recording, or give jacobian="
            warn(what, DeprecationWarning)
        if self.dynamics and self.equation_size != len(self.state_names):
            self._keep(dynamics=False)
        if self.mass is not None:
            self._take_mass()
        self._keep(angles=angle_periods(self.angles, self.state_names))
        self._check_angles()

    def _take_mass(self) -> None:
        """Analyse the mass matrix; a regular one is inverted."""
        if not self.dynamics:
            raise ProblemError("mass: is for as many equations as states, and with dynamics; leave it out")
        mass = Mass.of(self.mass, self.state_names)
        field = returning(self.residual, self._signature)
        if mass.is_regular:
            jacobian = self.jacobian and mass.jacobian_of(self.jacobian, self._signature.fills(self.residual))
            self._keep(residual=mass.rates_of(field, 2), jacobian=jacobian, count=None, mass=None)
        else:
            self._keep(residual=field, jacobian=None, count=None, mass=mass)

    def _check_angles(self) -> None:
        if self.angles:
            check_periodic("residual", self.batch("residual"), self.angles, self.parameters)

    def discretized(
        self, free: Sequence[str], parameters: Mapping[str, float], scales: Scales | None = None, mesh: Places = (),
        degree: int = 0,
    ) -> Algebraic:  # fmt: skip
        """Return F(x) = 0 with these free parameters and sizes; there is no mesh."""
        return Algebraic(self, free, parameters, scales)

    @property
    def state_names(self) -> tuple[str, ...]:
        """Names of the states: ``states``, also where a number was given."""
        return cast(tuple[str, ...], self.states)

    def _signatures(self) -> Mapping[str, Arguments]:
        return {"residual": self._signature.arguments, "functionals": self._signature.arguments}

    @property
    def _signature(self) -> Signature:
        return Signature(self.state_names, tuple(self.parameters), times=False)

    @functools.cached_property
    def _shape(self) -> int:
        """Number of values of the residual; 0 for a bare number."""
        if self._signature.fills(self.residual):
            return self.count or len(self.state_names)
        return result_count(self.residual, self._signature.arguments, "residual")

    @functools.cached_property
    def _batches(self) -> dict[str, Batch]:
        return {}

    @property
    def equation_size(self) -> int:
        """Number of equations."""
        return max(self._shape, 1)

    @functools.cached_property
    def reduced(self) -> ReducedProblem | None:
        """The same with conserved totals as parameters, without the states that follow; None where nothing is conserved."""
        totals = conservation_laws(self)
        return ReducedProblem(self, totals) if len(totals) else None

    def without_found(self, start: Sequence[float]) -> AlgebraicProblem:
        """Return the same equilibria without states that have no rates, which are found from a start."""
        return KeptProblem(self, start)

    def check_index(self, states: Array, parameters: Mapping[str, float]) -> None:
        """Check that the equations without rates determine the states that have none, at a place."""
        with np.errstate(all="ignore"):
            self.mass.check_index(self.discretized((), parameters).jacobian(states), self.state_names)

    def check_totals(self, u: Array, p: Array) -> None:
        """Check that what was found to be conserved stays at states and parameters; here nothing was."""

    @property
    def free_size(self) -> int:
        """Number of free parameters on a curve: equations - states + 1."""
        return self.equation_size - len(self.state_names) + 1

    def batch(self, name: str) -> Batch:
        """Return the compiled ``"residual"`` or ``"functionals"``; made when first asked."""
        if name not in self._batches:
            self._batches[name] = self._compiled(name)
        return self._batches[name]

    def _compiled(self, name: str) -> Batch:
        u, p = self.state_names, tuple(self.parameters)
        if name == "residual":
            return Batch([self.residual], [self._shape], u, p, times=False)
        functions = list(self.functionals.values())
        if any(result_count(f, self._signature.arguments, "a functional") for f in functions):
            raise ProblemError("functionals: each must be f(u, p) and return one number")
        return Batch(functions, [0] * len(functions), u, p, times=False)

    @functools.cached_property
    def compared(self) -> list[bool]:
        """Holds an entry when the given Jacobian has been compared with differences."""
        return []

    @functools.cached_property
    def gives_sparse_matrix(self) -> bool:
        """The given Jacobian is a sparse matrix."""
        for number in (0.5, 1.5, -0.5, 0.0):  # in the domain of most functions
            with contextlib.suppress(ArithmeticError, ValueError), np.errstate(all="ignore"):
                found = self.jacobian_at(np.full(len(self.state_names), number), np.full(len(self.parameters), number))
                return not isinstance(found, np.ndarray)
        return False

    def jacobian_at(self, u: Array, p: Array) -> Any:
        """Return the given Jacobian at states (n,) and parameters: an array (equations, n), or a sparse array in rows.

        Raises
        ------
        ProblemError
            It is no matrix of that shape.
        """
        assert self.jacobian is not None
        arguments: Any = (u, p)
        if not self._signature.fills(self.residual):
            kinds = [named_values(names) for names in (self.state_names, tuple(self.parameters))]
            arguments = [kind(*values.tolist()) for kind, values in zip(kinds, (u, p))]
        found = self.jacobian(*arguments)
        shape = (self.equation_size, len(self.state_names))
        if hasattr(found, "tocsr"):
            matrix = found.tocsr()
        else:
            try:
                matrix = np.asarray(found, dtype=float)
            except (TypeError, ValueError, OverflowError):
                raise ProblemError(f"jacobian: {checks.shown(found)} must be a matrix of numbers") from None
        if matrix.shape != shape:
            raise ProblemError(f"jacobian: its shape {matrix.shape} must be {shape}, equations by states")
        if round_off.SEED:
            matrix = matrix.copy()
            round_off.move(matrix if isinstance(matrix, np.ndarray) else matrix.data)
        return matrix


class KeptProblem(AlgebraicProblem):
    """The equilibria of M u' = F with a singular M: states without rates are found, from their ``start``, and are columns."""

    def __init__(self, whole: AlgebraicProblem, start: Sequence[float]) -> None:
        mass, names = whole.mass, whole.state_names

        def of_kept(function: Function) -> Function:
            return mass.of_kept(function, whole.residual, names, start, 2)

        functionals = {name: of_kept(function) for name, function in whole.functionals.items()}
        functionals |= {names[i]: of_kept(_state(names[i])) for i in mass.columns}
        kept = mass.kept_names(names)
        angles = {name: period for name, period in whole.angles.items() if name in kept}
        rates = of_kept(mass.rates_of(whole.residual, 2))
        self._keep(following=tuple(names[i] for i in mass.columns))
        super().__init__(rates, kept, whole.parameters, functionals, angles=angles)


class ReducedProblem(AlgebraicProblem):
    """The equilibria of a vector field without the states that follow from conserved totals, which are parameters.

    - ``whole`` (AlgebraicProblem)
    - ``totals`` (ndarray, shape (m, n)): The factors of the states in each total, in reduced echelon form: the first state that
      no other total contains, with the factor 1, follows from it and the states that are kept.

    - ``kept`` (list of int): Places of the states that are kept.
    - ``total_names``, ``following`` (tuple of str): Names of the parameters, and of the states that follow from them, in the
      same order; then of others that follow.
    """

    whole: AlgebraicProblem
    totals: Array
    kept: list[int]
    total_names: tuple[str, ...]
    following: tuple[str, ...]
    _follow: Array

    def __init__(self, whole: AlgebraicProblem, totals: object) -> None:
        names, totals = whole.state_names, np.asarray(totals, dtype=float)
        own = (totals != 0) & (np.count_nonzero(totals, axis=0) == 1) & (totals == 1)
        pivots = [int(row.argmax()) for row in own]
        kept = [i for i in range(len(names)) if i not in pivots]
        taken = {*names, *whole.parameters, *whole.functionals}
        total_names = tuple(unused(f"total_{names[i]}", taken) for i in pivots)
        follow = np.zeros((len(names), len(names)))  # the states, of those that are kept and the totals
        follow[kept, np.arange(len(kept))] = 1.0
        follow[pivots, : len(kept)], follow[pivots, len(kept) :] = -totals[:, kept], np.eye(len(totals))
        following = (*(names[i] for i in pivots), *whole.following)
        self._keep(whole=whole, totals=totals, kept=kept, total_names=total_names, following=following, _follow=follow)
        of_whole = functools.partial(_of_whole, names, follow.tolist(), total_names)
        functionals = {name: of_whole(function) for name, function in whole.functionals.items()}
        functionals |= {names[i]: of_whole(_state(names[i])) for i in pivots}
        rates, parameters = returning(whole.residual, whole._signature), dict.fromkeys(total_names, 0.0)
        super().__init__(
            of_whole(rates, kept), [names[i] for i in kept], {**whole.parameters, **parameters}, functionals,
            jacobian=None if whole.jacobian is None else self._reduced_jacobian, angles=whole.angles,
        )  # fmt: skip

    def _reduced_jacobian(self, u: Any, p: Any) -> Any:
        values = np.array(list(p))
        known = len(self.whole.parameters)
        matrix = self.whole.jacobian_at(self._states(np.array(list(u)), values[known:]), values[:known])
        return matrix[self.kept] @ self._follow[:, : len(self.kept)]

    def without_totals(self, states: Array) -> tuple[Array, dict[str, float]]:
        """Return those of states (..., n) that are kept, and the totals, of several states in the mean."""
        means = (states @ self.totals.T).reshape(-1, len(self.totals)).mean(axis=0)
        return states[..., self.kept], dict(zip(self.total_names, map(float, means)))

    def check_totals(self, u: Array, p: Array) -> None:
        """Check that the states that follow are at rest, too: elsewhere a condition may have switched.

        Raises ProblemError where one is not: its total is not conserved there.
        """
        states = self._states(u, p[len(self.whole.parameters) :])
        system = self.whole.discretized((), dict(zip(self.whole.parameters, map(float, p))))
        rates, matrix = system.residual(states), system.jacobian(states)
        noise = LOCATED * np.abs(matrix) @ (1 + np.abs(states))
        for total, state in zip(self.totals, self.following):  # first those of the totals
            place = self.whole.state_names.index(state)
            if not abs(rates[place]) <= noise[place]:
                what = f"{written(total, self.whole.state_names)} is conserved elsewhere, and not at the solution"
                raise ProblemError(f"residual: {what}, where the rate of {state} is {rates[place]:.6g}; give another guess")

    def _states(self, u: Array, totals: Array) -> Array:
        return self._follow @ np.append(u, totals)

    @property
    def conserved(self) -> str:
        """What is conserved: a sentence."""
        texts = checks.listed(written(total, self.whole.state_names) for total in self.totals)
        names, states = checks.listed(self.total_names), checks.listed(self.following[: len(self.totals)])
        if len(self.totals) == 1:
            return f"{texts} is conserved: the parameter {names} is its value, and {states} follows from the other states"
        return f"{texts} are conserved: the parameters {names} are their values, and {states} follow from the other states"


def _state(name: str) -> Function:
    return lambda u, p: getattr(u, name)


def _of_whole(
    names: Sequence[str], follow: Sequence[Sequence[float]], totals: Sequence[str], function: Function,
    kept: Sequence[int] | None = None,
) -> Function:  # fmt: skip
    """Return a function of all states as one of the states that are kept and the totals; of several values those to keep."""
    state = named_values(tuple(names))

    def reduced(u: Any, p: Any) -> Any:
        values = function(state(*combined(follow, [*u, *(getattr(p, name) for name in totals)])), p)
        return values if kept is None else [values[i] for i in kept]

    return reduced
