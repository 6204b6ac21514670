"""Connecting orbits as the user states them: orbits from one equilibrium of a vector field to another, or back to it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from contin import errors as checks
from contin.arrays import Function, Named, Places
from contin.boundary.statement import BoundaryValueProblem
from contin.connections.equations import ConnectionCollocation
from contin.core.system import Scales
from contin.errors import ProblemError
from contin.functions.batch import Batch
from contin.functions.signature import Arguments, Signature, named_values
from contin.problems.angles import Angles, angle_periods, check_periodic, winding_names
from contin.problems.rewriting import check_field, found_elsewhere, returning, scaled
from contin.problems.statement import TIME, check_statement


class ConnectionProblem(BoundaryValueProblem):
    """Orbits of u' = F(u, p) that connect equilibria, cut off to a time: u' = time F(u, p) on the unit interval.

    The orbit begins in the plane that is tangent to the unstable manifold of the first equilibrium, and ends in the one that
    is tangent to the stable manifold of the last one (projection conditions, Beyn 1990). A phase condition keeps it from
    sliding along itself. The equilibria are found along: their coordinates are the parameters ``from_`` + state and ``to_`` +
    state, which are free on every curve and need not be named. An orbit that returns to its equilibrium (homoclinic) has no
    ``to_``. Where it ends at the image of that equilibrium after whole rounds of an angle phi, their number is the parameter
    ``winding_phi``, which is read off the guess, unless it is given.

    The error of cutting off is about the square of the column ``gap``, the largest distance of an end from its equilibrium
    divided by the size of the orbit. A longer ``time`` makes it smaller.

    Parameters
    ----------
    field : callable
        ``field(u, p)`` returns the rates of the states; ``field(u, p, out)`` fills an array with them.
    states : sequence of str
    parameters : mapping of str to float
        Names and default values.
    unstable : int
        Dimension of the unstable manifold of the first equilibrium.
    stable : int, optional
        Dimension of the stable manifold of the last equilibrium; without it the orbit is homoclinic.
    angles : sequence of str, or mapping of str to float, optional
        Of homoclinic orbits, states in which the field is periodic, with the period 2 pi or, in a mapping, any other.
    saddle_node : bool
        The orbit is homoclinic to a saddle-node: one eigenvalue is zero, and neither counted in ``unstable`` nor stable. The
        orbit may leave and come back along its eigenvector.

    Raises
    ------
    ProblemError
        A name, function or dimension that cannot be used; a field that is not periodic in an angle.

    Notes
    -----
    A curve needs n - unstable - stable + 2 free parameters besides the equilibria: two for homoclinic orbits, also to
    saddle-nodes. Near a saddle-node an orbit is as slow as 1 / t: the error of cutting off falls like the square of 1 / time.

    Examples
    --------
    The travelling front of u_t = u_xx + u (1 - u) (u - a) has the speed (1 - 2 a) / sqrt(2):

    >>> import contin, math
    >>> def field(u, p):
    ...     return u.v, p.c * u.v - u.u * (1 - u.u) * (u.u - p.a)
    >>> problem = ConnectionProblem(field, ["u", "v"], {"a": 0.25, "c": 0.3}, unstable=1, stable=1)
    >>> def guess(t):
    ...     s = math.tanh(20 * (t - 0.5) / math.sqrt(8))
    ...     return (1 + s) / 2, (1 - s**2) / math.sqrt(32)
    >>> front = contin.solve(problem, guess, {"time": 40, "to_u": 1}, free=["c"])
    >>> print(abs(front["c"] - 0.5 / math.sqrt(2)) < 1e-8)
    True
    """

    field: Function
    unstable: int
    stable: int
    homoclinic: bool
    angles: Mapping[str, float]
    saddle_node: bool
    own_time = TIME

    def __init__(
        self, field: Function, states: Sequence[str], parameters: Mapping[str, float], *, unstable: int,
        stable: int | None = None, angles: Angles = (), saddle_node: bool = False,
    ) -> None:  # fmt: skip
        names = check_statement(states, parameters, {})
        homoclinic, count = stable is None, len(names)
        checks.instance("saddle_node", saddle_node, bool, "True or False")
        if saddle_node and not homoclinic:
            raise ProblemError("saddle_node: orbits to a saddle-node are homoclinic; leave out stable")
        checks.whole("unstable", unstable, 0 if saddle_node else 1, count - 1 if homoclinic else count)
        if stable is not None:
            checks.whole("stable", stable, 1, count)
        first, last = ([kind + name for name in names] for kind in ("from_", "to_"))
        periods = angle_periods(angles, names)
        if periods and not homoclinic:
            raise ProblemError("angles: must be left out where stable is given, as both equilibria are known then")
        own = [TIME, *first, *winding_names(periods)] if homoclinic else [TIME, *first, *last]
        for name in own:
            if name in parameters:
                raise ProblemError(f"parameters: {name} is a parameter of every connection by itself")
        signature = Signature(names, (*parameters, *own), times=False)
        field = returning(field, signature)
        check_field(field, signature, "must be a function of (u, p)")
        self._keep(field=field, homoclinic=homoclinic, angles=periods, unstable=unstable, saddle_node=saddle_node)
        self._keep(stable=count - unstable - saddle_node if stable is None else stable)
        rhs, boundary = scaled(field, TIME), _at_rest(field, names, homoclinic)
        super().__init__(rhs, boundary, names, {**parameters, TIME: 1.0, **dict.fromkeys(own[1:], 0.0)})
        self._keep(functionals={"gap": found_elsewhere})
        if periods:
            check_periodic("field", self.batch("vector field"), periods, self.parameters)

    def _signatures(self) -> Mapping[str, Arguments]:
        return {"field": Signature(self.state_names, tuple(self.parameters), times=False).arguments}

    def discretized(
        self, free: Sequence[str], parameters: Mapping[str, float], scales: Scales | None = None, mesh: Places = (),
        degree: int = 0,
    ) -> ConnectionCollocation:  # fmt: skip
        return ConnectionCollocation(self, mesh, degree, free, parameters, scales)

    def _groups(self) -> list[str]:
        return ["field", "boundary"]

    @property
    def multipliers(self) -> tuple[str, ...]:
        """Names of the parameters that are free on every curve: the coordinates of the equilibria."""
        return tuple(kind + name for kind in ("from_", "to_")[: 2 - self.homoclinic] for name in self.state_names)

    @property
    def ends(self) -> tuple[str, ...]:  # type: ignore[override]
        """Names of the same, of those where an orbit begins first."""
        return self.multipliers

    @property
    def alike(self) -> dict[str, str]:
        """The state that each coordinate of an equilibrium is a value of."""
        return dict(zip(self.multipliers, 2 * self.state_names))

    @property
    def conditions(self) -> tuple[int, int]:
        """Numbers of projection conditions at the first and at the last end."""
        count = len(self.state_names) - self.saddle_node
        return count - self.unstable, count - self.stable

    @property
    def free_size(self) -> int:
        """Number of free parameters on a curve: as many as conditions, less the states, and one."""
        return self.boundary_size + sum(self.conditions) + self.saddle_node + 1 - len(self.state_names) + 1

    def _compiled(self, name: str) -> Batch:
        if name == "vector field":
            return Batch([self.field], [len(self.state_names)], self.state_names, tuple(self.parameters), times=False)
        return super()._compiled(name)


def _at_rest(field: Function, names: Sequence[str], homoclinic: bool) -> Function:
    """Return the boundary conditions: the field vanishes at the equilibria."""
    state = named_values(tuple(names))
    kinds = ("from_",) if homoclinic else ("from_", "to_")

    def boundary(a: Named, b: Named, p: Named) -> Any:
        return [rate for kind in kinds for rate in field(state(*(getattr(p, kind + name) for name in names)), p)]

    return boundary
