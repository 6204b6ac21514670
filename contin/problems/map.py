"""Maps u -> f(u, p) as the user states them: their fixed points, and cycles of several points."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from contin.arrays import Function
from contin.errors import ProblemError
from contin.functions.batch import Batch
from contin.functions.signature import Arguments
from contin.problems.algebraic import AlgebraicProblem
from contin.problems.cycle import ROUNDS


class MapProblem(AlgebraicProblem):
    """Fixed points u = f(u, p) of a map, and its cycles: fixed points of f applied ``rounds`` times.

    ``rounds`` is a parameter of every map by itself, a whole number that cannot be free. A guess is one point of the cycle, or
    all of them one after the other; columns are those of the first. Multipliers are the eigenvalues of the derivative over all
    rounds: special points are folds (LP), branch points (BP), period doublings (PD) and torus bifurcations (TR).

    Parameters
    ----------
    map : callable
        ``f(u, p)`` returns the next states.
    states : sequence of str, or int
    parameters : mapping of str to float
        Names and default values.
    functionals : mapping of str to callable, optional
        ``g(u, p)``: columns of every point.

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
    """

    def __init__(
        self, map: Function, states: Sequence[str] | int, parameters: Mapping[str, float],
        functionals: Mapping[str, Function] | None = None,
    ) -> None:  # fmt: skip
        if isinstance(parameters, Mapping):
            if ROUNDS in parameters:
                raise ProblemError(f"parameters: {ROUNDS} is a parameter of every map by itself")
            parameters = {**parameters, ROUNDS: 1.0}
        super().__init__(map, states, parameters, {} if functionals is None else functionals, dynamics=False)
        if self.equation_size != len(self.state_names):
            names = ", ".join(self.state_names)
            raise ProblemError(f"map returns {self.equation_size} values for the {len(self.state_names)} states {names}")

    def _signatures(self) -> Mapping[str, Arguments]:
        """Return the arguments of the functions."""
        return {"map": self._signature.arguments, "functionals": self._signature.arguments}

    def _compiled(self, name: str) -> Batch:
        return super()._compiled("residual" if name == "map" else name)
