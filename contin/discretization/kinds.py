"""Which system discretizes which kind of problem."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from contin.arrays import Array
from contin.discretization.algebraic import Algebraic
from contin.discretization.collocation import Collocation
from contin.discretization.connections import ConnectionCollocation
from contin.discretization.cycles import CycleCollocation, ForcedCollocation
from contin.discretization.maps import MapSystem
from contin.discretization.scales import Scales
from contin.problems.algebraic import AlgebraicProblem
from contin.problems.boundary_value import BoundaryValueProblem
from contin.problems.connection import ConnectionProblem
from contin.problems.cycle import CycleProblem
from contin.problems.map import MapProblem


def discretized(
    problem: BoundaryValueProblem, mesh: Sequence[float] | Array, degree: int, free: Sequence[str],
    parameters: Mapping[str, float], scales: Scales | None = None,
) -> Collocation:  # fmt: skip
    """Return a boundary value problem on a mesh: the system of its kind."""
    if isinstance(problem, CycleProblem):
        kind = CycleCollocation if problem.period is None else ForcedCollocation
        return kind(problem, mesh, degree, free, parameters, scales)
    if isinstance(problem, ConnectionProblem):
        return ConnectionCollocation(problem, mesh, degree, free, parameters, scales)
    return Collocation(problem, mesh, degree, free, parameters, scales)


def algebraic(
    problem: AlgebraicProblem, free: Sequence[str], parameters: Mapping[str, float], scales: Scales | None = None
) -> Algebraic:
    """Return the system of an algebraic problem or of a map."""
    return (MapSystem if isinstance(problem, MapProblem) else Algebraic)(problem, free, parameters, scales)  # type: ignore[arg-type]
