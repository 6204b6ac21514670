"""Which system discretizes which kind of problem."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from contin.arrays import Array
from contin.boundary.statement import BoundaryValueProblem
from contin.boundary.system import Collocation
from contin.connections.statement import ConnectionProblem
from contin.connections.system import ConnectionCollocation
from contin.core.scales import Scales
from contin.cycles.map_statement import MapProblem
from contin.cycles.maps import MapSystem
from contin.cycles.statement import CycleProblem
from contin.cycles.system import CycleCollocation, ForcedCollocation
from contin.equilibria.statement import AlgebraicProblem
from contin.equilibria.system import Algebraic


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
