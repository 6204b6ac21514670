"""Point: one solution on a branch."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from contin.arrays import Array
from contin.detection.floquet import Floquet, floquet
from contin.detection.second_variation import SecondVariation, index_of, second_variation
from contin.discretization.cycles import PeriodicCollocation
from contin.discretization.protocol import Discretization
from contin.discretization.system import System
from contin.errors import ProblemError
from contin.results import portrait
from contin.results.profile import Profile
from contin.stepping.trial import Trial

#: So many columns stand in the representation of a point.
_SHOWN = 8


def system_of(point: Point, what: str) -> System:
    """Return the system of a point, where other parameters of its problem may become free.

    Raises
    ------
    ProblemError
        A point of a curve in two parameters; ``what`` names the argument.
    """
    if not isinstance(point.system, System):
        raise ProblemError(f"{what}: must not be a point of a curve in two parameters")
    return point.system


@dataclass(frozen=True, eq=False)
class Point:
    """One solution on a branch.

    Attributes
    ----------
    label : str
        AUTO's two letters: EP end, LP fold (limit point), BP branch point, HB Hopf point, PD period doubling, TR torus
        bifurcation, UZ user zero, MX failed; "" for a regular point. EX, an extremum of a column, has none in AUTO. Those of
        `contin.curve` are listed there.
    name : str
        The test function's name, "" for a regular point.
    parameters, functionals : mapping of str to float
        All parameters; the problem's functionals.
    x, tangent : ndarray, shape (size,)
        Unknowns of ``system``, and the unit tangent (``nan`` at a branch point, which has several).
    system : Discretization
        The discretized problem.
    arclength : float
        Distance travelled from the branch's first point, in the weighted norm.
    iterations, newton_error : int, float
        Newton iterations taken, and the estimated error that they left (the largest, relative to 1 + |x|).
    errors : mapping of str to float
        Estimated error of the free parameters, where it was asked for: of the discretization or, without a mesh, of the
        location alone. NaN where the point was not found again, and at points of higher codimension.
    details : object
        What the location found besides: the `BranchPoint` of a BP; a dictionary with frequency and normal form of an HB, with
        least and largest curvature of an EX.
    index : int or None
        Of a state of a `VariationalProblem`: the number of independent ways to lower its energy; 0 is a minimum. None for other
        problems, and where Legendre's condition fails.
    nullity : int
        At a fold or branch point, the number of ways along which the second variation vanishes; they do not count in the index.
    index_change : pair of (int or None), optional
        At a special point, the index before and after it, in the direction of travel.
    breaks : tuple of str
        At a branch point, the declared symmetries that its modes break.
    """

    label: str
    name: str
    parameters: Mapping[str, float]
    functionals: Mapping[str, float]
    x: Array
    tangent: Array
    system: Discretization
    arclength: float
    iterations: int
    newton_error: float
    errors: Mapping[str, float] = field(default_factory=dict)
    details: Any = None
    index: int | None = None
    nullity: int = 0
    index_change: tuple[int | None, int | None] | None = None
    breaks: tuple[str, ...] = ()

    def __getitem__(self, name: str) -> float:
        """Return a parameter or functional by name.

        Raises
        ------
        KeyError
            There is none of this name; the message lists those there are.
        """
        if name in self.parameters:
            return self.parameters[name]
        if name in self.functionals:
            return self.functionals[name]
        raise KeyError(f"{name!r} is none of {', '.join((*self.parameters, *self.functionals))}")

    def __repr__(self) -> str:
        columns = {**self.parameters, **self.functionals}
        values = ", ".join(f"{name}={value:.6g}" for name, value in list(columns.items())[:_SHOWN])
        more = ", ..." if len(columns) > _SHOWN else ""
        return f"Point({' '.join(filter(None, (self.label, self.name)))}{': ' * bool(self.label)}{values}{more})"

    @property
    def normal_form(self) -> float | None:
        """The coefficient of the normal form; negative where the bifurcation is supercritical. None where there is none.

        At a Hopf point of equilibria it is the first Lyapunov coefficient, with a critical eigenvector of unit length; at a
        period doubling c and at a torus bifurcation Re d of `contin.detection.cycle_normal_forms`; at a fold of cycles |b|,
        which is zero at a cusp. Its estimated error is ``details["normal_form_error"]``.
        """
        return self.details.get("normal_form") if isinstance(self.details, Mapping) else None

    def plot(self, what: str | None = None, states: Sequence[str] | None = None, axes: Any = None) -> Any:
        """Draw the solution: its phase portrait, its states over time and, of a cycle, its Floquet multipliers.

        Parameters
        ----------
        what : str, optional
            ``"portrait"`` (the second state against the first), ``"series"`` (over time; a cycle over one period) or
            ``"multipliers"`` (with the unit circle; outside of it distances from 0 are 1 + log10 of the absolute value). All of
            them, side by side, without.
        states : sequence of str, optional
            Names of the states to draw, in order: the first two of them in the portrait.
        axes : matplotlib.axes.Axes, optional
            Where to draw, an array of axes without ``what``; a figure of its own without.

        Returns
        -------
        matplotlib.axes.Axes, or an array of them

        Raises
        ------
        ProblemError
            The point is no solution over t, or there is no such picture or state.
        ImportError
            matplotlib is not installed.
        """
        return portrait.plot(self, what, states, axes)

    def segment(self, index: int) -> Profile:
        """Return the solution on one segment of a `SegmentedProblem`, over its own coordinate; segments count from 0.

        Raises
        ------
        ProblemError
            The problem has no segments, or fewer.
        """
        return Profile(self, index)

    def floquet(self) -> Floquet:
        """Return the Floquet multipliers of a cycle, with estimates of their errors.

        Raises
        ------
        ProblemError
            The point is no cycle.
        """
        if not isinstance(self.system, PeriodicCollocation):
            raise ProblemError("floquet: the point is no cycle; state the problem as a CycleProblem")
        return floquet(self.system, self.x, self.tangent)

    def second_variation(self) -> SecondVariation:
        """Return the second variation of the energy there: its eigenvalues, and its modes as functions.

        Raises
        ------
        ProblemError
            The problem is no `VariationalProblem`, or Legendre's condition fails.
        """
        if index_of(self.system) is None:
            raise ProblemError("second_variation: the problem has no energy; state it as a VariationalProblem")
        found = second_variation(self.system, self.x)  # type: ignore[arg-type]
        if found is None:
            raise ProblemError("second_variation: the energy is not convex in the controls there (Legendre's condition)")
        return found


def point_of(system: Discretization, x: Array, iterations: int = 0, error: float = 0.0) -> Point:
    """Return the Point of any solution x of a system."""
    trial = Trial.without_tangent(system, x)
    parameters = dict(zip(system.problem.parameters, map(float, system.all_parameters(x))))
    return Point("", "", parameters, trial.functionals, x, trial.tangent, system, 0.0, iterations, error)
