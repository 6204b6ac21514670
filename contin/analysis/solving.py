"""One solution near a guess: correct it, adapt the mesh to it, correct again."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from contin import checks
from contin.analysis.deflation import correct_away
from contin.analysis.guess import Guess, Options, first_guess
from contin.arrays import Array
from contin.detection.second_variation import degeneracy
from contin.discretization.basis import DEGREES
from contin.discretization.collocation import Collocation
from contin.discretization.mesh import MOST_INTERVALS, MeshControl
from contin.discretization.system import System
from contin.errors import ConvergenceError, ProblemError
from contin.problems.algebraic import AlgebraicProblem
from contin.problems.boundary_value import BoundaryValueProblem
from contin.problems.statement import with_multipliers
from contin.problems.variational import VariationalProblem
from contin.results.point import Point, point_of, system_of, underlying
from contin.stepping.newton import Corrected, Newton, correct

#: Rounds of correcting and adapting the mesh; each settles most of what is left.
_ROUNDS = 4


def solve(
    problem: BoundaryValueProblem | AlgebraicProblem, guess: Guess = None, parameters: Mapping[str, float] | None = None, *,
    free: Sequence[str] = (), intervals: int = 20, degree: int = 4, mesh: MeshControl | None = None, newton: Newton = Newton(),
    others: Sequence[Point] = (),
) -> Point:  # fmt: skip
    """Return one solution near a guess, on a mesh adapted to it.

    Parameters
    ----------
    problem : BoundaryValueProblem or AlgebraicProblem
    guess : callable, pair of arrays, sequence of numbers, Point, or None
        ``guess(t)`` returns the states at t; a pair is t (K,) and states (K, n); n numbers are constant states; a point is a
        solution of a problem with the same states; None stands for zeros.
    parameters : mapping of str to float
        Values that differ from the defaults (of the problem, or of the guess if it is a point).
    free : sequence of str
        Parameters to be found along with the states, for problems with more conditions than states.
    intervals, degree : int
        First mesh (uniform, unless the guess has one) and degree of the collocation.
    mesh : MeshControl, optional
        How the mesh adapts; ``MeshControl(every=0)`` keeps the first one.
    others : sequence of Point
        Known solutions to stay away from (deflation, Farrell, Birkisson & Funke 2015).

    Returns
    -------
    Point
        With ``free`` as given: pass it to `trace` with the free parameters of a curve.

    Raises
    ------
    ConvergenceError, ProblemError

    Examples
    --------
    >>> equation = AlgebraicProblem(lambda u, p: (u.x**2 - p.a,), ["x"], {"a": 4.0})
    >>> root = solve(equation, [1.0])
    >>> round(float(root.x[0]), 12), round(float(solve(equation, root, others=[root]).x[0]), 12)
    (2.0, -2.0)
    """
    control = MeshControl() if mesh is None else mesh
    _check_options(problem, intervals, degree, control, newton)
    _check_others(problem, others)
    parameters, free = _checked(parameters), with_multipliers(problem, free)
    if isinstance(guess, Point):
        guess = underlying(guess)
        parameters = {**guess.parameters, **parameters}
    needed = problem.free_size - 1
    if needed < 0:
        there = len(problem.state_names) + needed
        kind = "equations" if isinstance(problem, AlgebraicProblem) else "boundary and integral conditions"
        raise ProblemError(f"problem: {there} {kind} for {len(problem.state_names)} states; {-needed} more needed")
    if len(free) != needed:
        raise ProblemError(f"free: {len(free)} given, a solution of this problem needs {needed} (conditions - states)")
    system, x = first_guess(problem, guess, Options(parameters, free, intervals, degree))
    if not np.all(np.isfinite(x)):
        raise ProblemError("guess: its values must be finite numbers")
    return solved(system, x, control, newton, others)


def solved(system: System, x: Array, control: MeshControl, newton: Newton, others: Sequence[Point] = ()) -> Point:
    """Return the solution near a vector of unknowns, on a mesh adapted to it.

    Raises
    ------
    ConvergenceError, ProblemError
    """
    for _ in range(_ROUNDS):
        done = _corrected(system, x, others, newton)
        adapted = system.adapted(done.x, control)
        if adapted is None:
            break
        system, carry = adapted
        x = carry(done.x)
    return point_of(system, done.x, done.iterations, done.error)


def _corrected(system: System, x: Array, others: Sequence[Point], newton: Newton) -> Corrected:
    """Return the solution near x.

    Raises
    ------
    ProblemError
        Newton's method fails at a guess that makes a variational problem singular; the message says why.
    ConvergenceError
    """
    try:
        return correct_away(system, x, others, newton) if others else correct(system, x, newton=newton, unscaled=True)
    except ConvergenceError:
        if isinstance(system, Collocation) and isinstance(system.problem, VariationalProblem):
            reason = degeneracy(system, x)
            if reason:
                raise ProblemError(f"{reason}: no solution was found from this guess") from None
        raise


def _check_options(problem: object, intervals: object, degree: object, control: object, newton: object) -> None:
    checks.instance("problem", problem, (BoundaryValueProblem, AlgebraicProblem), "a BoundaryValueProblem or AlgebraicProblem")
    checks.whole("intervals", intervals, 1, MOST_INTERVALS)
    checks.whole("degree", degree, DEGREES[0], DEGREES[-1])
    checks.instance("mesh", control, MeshControl, "a MeshControl")
    checks.instance("newton", newton, Newton, "a Newton")


def _check_others(problem: BoundaryValueProblem | AlgebraicProblem, others: Sequence[Point]) -> None:
    for other in checks.sequence("others", others, "Point"):
        checks.instance("others", other, Point, "a Point")
        if system_of(other, "others").problem.states != problem.states:
            raise ProblemError("others: must be solutions of this problem")


def _checked(parameters: Mapping[str, float] | None) -> dict[str, float]:
    """Return the values of parameters that a user gives."""
    if parameters is None:
        return {}
    for name, value in checks.mapping("parameters", parameters, "numbers").items():
        checks.number(f"parameters: {checks.plain(name)}", value)
    return dict(parameters)
