"""Maps u -> f(u, p) as the user states them: their fixed points, and cycles of several points."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from contin.arrays import Function, Places
from contin.core.scales import Scales
from contin.cycles.maps import MapSystem
from contin.equilibria.statement import AlgebraicProblem
from contin.errors import ProblemError
from contin.functions.batch import Batch
from contin.functions.signature import Arguments
from contin.problems.angles import Angles, angle_periods, check_periodic, winding_names
from contin.problems.own_names import ROUNDS
from contin.problems.statement import check_statement


class MapProblem(AlgebraicProblem):
    """Fixed points u = f(u, p) of a map, and its cycles: fixed points of f applied ``rounds`` times.

    ``rounds`` is a parameter of every map by itself, a whole number that cannot be free. A guess is one point of the cycle, or
    all of them one after the other; columns are those of the first. Multipliers are the eigenvalues of the derivative over all
    rounds: special points are folds (LP), branch points (BP), period doublings (PD) and torus bifurcations (TR).

    Angles may gain whole rounds along a cycle: ``winding_x``, a parameter by itself, is the number of those of the angle x. It
    is read off the guess, unless it is given; over ``rounds`` it is the rotation number.

    Parameters
    ----------
    map : callable
        ``f(u, p)`` returns the next states.
    states : sequence of str, or int
    parameters : mapping of str to float
        Names and default values.
    functionals : mapping of str to callable, optional
        ``g(u, p)``: columns of every point.
    angles : sequence of str, or mapping of str to float, optional
        States that are the same after a period, which is 2 pi or, in a mapping, any other: where one of them goes round once,
        the next states change by whole rounds of angles.

    Raises
    ------
    ProblemError
        A name, or a map with another number of values than states.

    Examples
    --------
    The logistic map doubles its period at r = 3:

    >>> import contin
    >>> logistic = MapProblem(lambda u, p: (p.r * u.x * (1 - u.x),), ["x"], {"r": 2.0})
    >>> branch = contin.trace(contin.solve(logistic, [0.5]), free=["r"], limits={"r": (2, 4)})
    >>> print([(point.label, round(point["r"], 10)) for point in branch.labelled("PD")])
    [('PD', 3.0)]

    The circle map, locked to half a round an iteration:

    >>> import math
    >>> def circle(u, p):
    ...     return (u.x + p.w - p.k / (2 * math.pi) * math.sin(2 * math.pi * u.x),)
    >>> locked = contin.solve(MapProblem(circle, ["x"], {"w": 0.5, "k": 0.9}, angles={"x": 1}), [0.3], {"rounds": 2})
    >>> print(locked["winding_x"], round(locked["x"], 10))
    1.0 0.3156183315
    """

    def __init__(
        self, map: Function, states: Sequence[str] | int, parameters: Mapping[str, float],
        functionals: Mapping[str, Function] | None = None, angles: Angles = (),
    ) -> None:  # fmt: skip
        names = check_statement(states, parameters, {})
        own = {ROUNDS: 1.0, **dict.fromkeys(winding_names(angle_periods(angles, names)), 0.0)}
        for name in own:
            if name in parameters:
                raise ProblemError(f"parameters: {name} is a parameter of every map by itself")
        parameters = {**parameters, **own}
        super().__init__(map, states, parameters, {} if functionals is None else functionals, dynamics=False, angles=angles)
        if self.equation_size != len(self.state_names):
            raise ProblemError(f"map returns {self.equation_size} values for the {len(names)} states {', '.join(names)}")

    def discretized(
        self, free: Sequence[str], parameters: Mapping[str, float], scales: Scales | None = None, mesh: Places = (),
        degree: int = 0,
    ) -> MapSystem:  # fmt: skip
        """Return F(x) = 0 with these free parameters and sizes; there is no mesh."""
        return MapSystem(self, free, parameters, scales)

    def _check_angles(self) -> None:
        if self.angles and self.equation_size == len(self.state_names):
            check_periodic("map", self.batch("map"), self.angles, self.parameters, lifts=True)

    def _signatures(self) -> Mapping[str, Arguments]:
        """Return the arguments of the functions."""
        return {"map": self._signature.arguments, "functionals": self._signature.arguments}

    def _compiled(self, name: str) -> Batch:
        return super()._compiled("residual" if name == "map" else name)
