"""Point: one solution on a branch."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from contin import errors as checks
from contin.arrays import Array
from contin.core.labels import Label
from contin.core.protocol import Discretization
from contin.core.trial import Trial
from contin.errors import ProblemError
from contin.events.error import error
from contin.events.phase_loads import phase_loads
from contin.problems.statement import PERIOD
from contin.results.marks import Axes, point_to_html
from contin.results.record import Profile, Record
from contin.text import COLUMNS, meant

if TYPE_CHECKING:
    from contin.boundary.second_variation import SecondVariation
    from contin.cycles.floquet import Floquet
    from contin.results.phase_response import PhaseResponse
    from contin.results.spectrum import Spectrum


def underlying(point: Point) -> Point:
    """Return the solution of a point of a curve in two parameters, labelled by what it consists of; others as they are."""
    curve: Any = point.system
    if not curve.on_curve:
        return point
    base, (label, details) = curve.solution, curve.on_its_branch(point.x)
    x, nowhere = point.x[: base.size], np.full(base.size, np.nan)
    return dataclasses.replace(point, label=label, name="", x=x, tangent=nowhere, system=base, details=details)


@dataclass(frozen=True, eq=False, repr=False)
class Point(Record):
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
    column : str
        The parameter or functional that turns there (LP), has an extremum (EX) or takes a given value (UZ, EP at a limit); ""
        at other points.
    value : float, optional
        That value, as it was given.
    discretization_error : float
        Estimated error of the solution that is due to the mesh: of states, their rates, free parameters and integrals, at mesh
        points, relative to 1 + size. 0 without a mesh; NaN where errors were not asked for.

    Examples
    --------
    >>> from contin import AlgebraicProblem, solve, trace
    >>> parabola = AlgebraicProblem(lambda u, p: (p.a - u.x**2,), ["x"], {"a": 1.0})
    >>> branch = trace(solve(parabola, [1.0]), free=["a"], direction=-1, limits={"a": (-1, 4)})
    >>> fold = branch.labelled("LP")[0]
    >>> abs(fold["a"]) < 1e-12, list(fold.errors)
    (True, ['a'])
    """

    def __getitem__(self, name: str) -> float:
        """Return a parameter, a functional, or a state of an equilibrium, by name.

        Raises
        ------
        KeyError
            There is none of this name; the message lists those there are.
        """
        if name in self.parameters:
            return self.parameters[name]
        if name in self.functionals:
            return self.functionals[name]
        states = self.system.named_states
        if name in states:
            return float(self.system.states(self.x)[0, states.index(name)])
        if not states and name in self.system.problem.states:
            raise KeyError(f"{name!r} is a function of t: take point.system.evaluate(point.x, t), or state a functional of it")
        known = (*self.parameters, *self.functionals, *states)
        raise KeyError(f"{name!r} is none of {checks.listed(known)}{meant(name, known)}")

    def __repr__(self) -> str:
        columns = {**self.parameters, **self.functionals}
        values = ", ".join(f"{name}={value:.6g}" for name, value in list(columns.items())[:COLUMNS])
        more = ", ..." if len(columns) > COLUMNS else ""
        return f"Point({' '.join(filter(None, (self.label, self.name)))}{': ' * bool(self.label)}{values}{more})"

    def _repr_html_(self) -> str:
        return point_to_html(self)

    @property
    def contacts(self) -> tuple[str, ...]:
        """Names of the contacts (``pushes`` of a variational problem) that hold."""
        return tuple(self.system.problem.touching(self.system, self.x)) if hasattr(self.system.problem, "touching") else ()

    @property
    def normal_form(self) -> float | None:
        """The coefficient of the normal form; negative where the bifurcation is supercritical. None where there is none.

        It is computed when it, the point's name or its details are first asked for.

        There is none at a Hopf point whose field is not smooth, as with v |v|: its name says so.

        At a Hopf point of equilibria it is the first Lyapunov coefficient, with a critical eigenvector of unit length; at a
        period doubling c and at a torus bifurcation Re d of `contin.events.normal_forms`; at a fold of cycles |b|, zero
        at a cusp. The c of period doublings of maps is positive where they are supercritical. Its estimated error is
        ``details["normal_form_error"]``; where errors are not wanted it is there only if it could change the sign.
        """
        return self.details.get("normal_form") if isinstance(self.details, Mapping) else None

    @property
    def curves(self) -> tuple[str, ...]:
        """Kinds of curves that leave from a point of codimension two of equilibria, for ``contin.curve(point, kind=...)``.

        ``"LP"`` (of equilibria, at a generalized Hopf point of cycles), ``"HB"`` (at a double Hopf point of the other pair),
        ``"TR"`` (of cycles) and ``"homoclinic"``; the one on which the point was found is not among them.
        """
        curve: Any = self.system
        if not curve.on_curve or not curve.base.leaving:
            return ()
        own = curve.kind if self.label != Label.DOUBLE_HOPF else ""
        return tuple(kind for kind in curve.base.leaving.get(self.label, ()) if kind != own)

    @checks.arguments
    def plot(self, what: str | None = None, states: Sequence[str] | None = None, axes: Axes | Array | None = None) -> Any:
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

        Examples
        --------
        >>> from contin import BoundaryValueProblem, solve
        >>> heat = BoundaryValueProblem(lambda t, u, p: (u.v, -p.q), lambda a, b, p: (a.u, b.u), ["u", "v"], {"q": 8.0})
        >>> axes = solve(heat, [0, 0]).plot("series")
        >>> len(axes.lines)
        2
        """
        from contin.results import portrait  # as `floquet`

        return portrait.plot(underlying(self), what, states, axes)

    @checks.arguments
    def sensitivities(
        self, by: Sequence[str] | None = None, held: str | Callable[[Trial], float] | None = None
    ) -> dict[str, dict[str, float]]:
        """Return the derivatives of the free parameters at a special point with respect to every other parameter.

        At a fold only that of its primary parameter is given, -(w.F_mu) / (w.F_lambda), w the left null vector (one
        back-solve). At a branch point those of all free parameters are, the point staying one (of the two branches that cross
        on F + beta psi = 0 where the bifurcation is imperfect). At any other point ``held`` keeps its value.

        Parameters
        ----------
        by : sequence of str, optional
            The other parameters; all that are not free by default.
        held : str or callable, optional
            For points that are neither, the quantity that stays fixed: a parameter, a functional, a state of an equilibrium, or
            ``held(trial)``. By default it is the column that the point is about, the real part of the critical pair at a Hopf
            point of an equilibrium, and at points of no special kind the first free parameter. At other special points it must
            be given.

        Returns
        -------
        dict
            ``result[mu][lambda]`` is dlambda/dmu.

        Raises
        ------
        ProblemError
            A name that is not a parameter that is held fixed on the branch; ``held`` is no column, or missing.

        Examples
        --------
        >>> from contin import AlgebraicProblem, solve, trace
        >>> cubic = AlgebraicProblem(lambda u, p: (p.a - p.b * u.x + u.x**3,), ["x"], {"a": 0.0, "b": 3.0})
        >>> fold = trace(solve(cubic, [0.0]), free=["a"], limits={"a": (-3, 3)}).labelled("LP")[0]  # a = 2, x = 1
        >>> {name: round(value["a"], 6) for name, value in fold.sensitivities().items()}
        {'b': 1.0}
        """
        from contin.results.sensitivity import sensitivities  # as `floquet`

        checks.instance("point", self, Point, "a Point")  # of `contin.sensitivities`, as it was called in version 0.2
        return sensitivities(self, by, held)

    @checks.arguments
    def segment(self, index: int) -> Profile:
        """Return the solution on one segment of a `SegmentedProblem`, over its own coordinate; segments count from 0.

        Raises
        ------
        ProblemError
            The problem has no segments, or fewer.

        Examples
        --------
        Heat flows through two walls of thickness 1; the second one conducts three times as well:

        >>> from contin import Segment, SegmentedProblem, solve
        >>> walls = [Segment(lambda s, u, p: (-u.flux / p.k, 0.0), ["heat", "flux"]),
        ...          Segment(lambda s, u, p: (-u.flux / 3, 0.0), ["heat", "flux"])]
        >>> problem = SegmentedProblem(walls, lambda a, b, p: (
        ...     a[0].heat - 1, b[0].heat - a[1].heat, b[0].flux - a[1].flux, b[1].heat), {"k": 1.0})
        >>> point = solve(problem, [0, 0, 0, 0])
        >>> round(float(point.segment(1)(1.0)[0, 0]), 9)
        0.25
        """
        return Profile(underlying(self), index)

    @checks.arguments
    def error(self, functional: str | Callable[[Trial], float]) -> float:
        """Return the estimated error of a column, or of a function of the solution: all of it.

        That is what halving the mesh changes, what Newton's method and round-off left, and at special points what the column
        changes over the distance that their place is known to.

        Parameters
        ----------
        functional : str or callable
            A parameter, a functional, a state of an equilibrium, or ``functional(trial)``.

        Returns
        -------
        float
            NaN where the point is not found again.

        Raises
        ------
        ProblemError
            There is no such column.

        Examples
        --------
        >>> import math, contin
        >>> bratu = contin.BoundaryValueProblem(
        ...     lambda t, u, p: (u.v, -p.lam * math.exp(u.u)), lambda a, b, p: (a.u, b.u), ["u", "v"], {"lam": 1.0},
        ...     functionals={"mean": lambda t, u, p: u.u},
        ... )
        >>> point = contin.solve(bratu, [0, 0], intervals=4, degree=3)
        >>> exact = contin.solve(bratu, [0, 0], intervals=40)
        >>> abs(point["mean"] - exact["mean"]) < point.error("mean") < 1e-6
        True
        """
        if callable(functional):
            return float(error(self, functional))
        known = (*self.parameters, *self.functionals, *self.system.named_states)
        if functional not in known:
            raise ProblemError(f"functional: {checks.shown(functional)} is no column; there are {checks.listed(known)}")
        return float(error(self, lambda trial: trial[functional]))

    def floquet(self) -> Floquet:
        """Return the Floquet multipliers of a cycle, or of one of a map, with estimates of their errors.

        On curves in two parameters they are those of the cycle at this point of the curve.

        Raises
        ------
        ProblemError
            The point is no cycle.

        Examples
        --------
        >>> import math, contin
        >>> def field(u, p):
        ...     square = u.x**2 + u.y**2
        ...     return p.mu * u.x - u.y - u.x * square, u.x + p.mu * u.y - u.y * square
        >>> def guess(t):
        ...     return 0.6 * math.cos(2 * math.pi * t), 0.6 * math.sin(2 * math.pi * t)
        >>> problem = contin.CycleProblem(field, ["x", "y"], {"mu": 0.25})
        >>> orbit = contin.solve(problem, guess, {"period": 6})
        >>> np.abs(orbit.floquet().multipliers).round(8).tolist()  # 1 and exp(-2 mu period), the period is 2 pi
        [1.0, 0.04321392]
        """
        if not self.system.solution.is_cycle:
            raise ProblemError("floquet: the point is no cycle; state the problem as a CycleProblem or MapProblem")
        from contin.cycles.floquet import floquet  # 25 ms, which points of other problems do not need

        fold = self.label == Label.FOLD and self.column != PERIOD and not self.system.on_curve
        return floquet(self.system, self.x, self.tangent, self.errors, fold)

    def spectrum(self) -> Spectrum:
        """Return the eigenvalues that decide on the stability of a steady state in time, with estimates of their errors.

        That is one of an `AlgebraicProblem`, or of a `BoundaryValueProblem` with ``rates``. On curves in two parameters they
        are those of the solution at this point of the curve.

        Raises
        ------
        ProblemError
            The states do not move in time.

        Examples
        --------
        >>> import contin
        >>> pendulum = contin.AlgebraicProblem(lambda u, p: (u.v, -u.x - p.drag * u.v), ["x", "v"], {"drag": 2.5})
        >>> spectrum = contin.solve(pendulum, [0.1, 0.0]).spectrum()
        >>> spectrum.values.real.round(9).tolist(), spectrum.stable
        ([-0.5, -2.0], True)
        """
        from contin.results.spectrum import Spectrum  # as `floquet`

        return Spectrum(self)

    def phase_response(self) -> PhaseResponse:
        """Return the phase response of a cycle: its adjoint Z, with Z.F = 1, by one solve with a transposed matrix.

        After a small change v of the states at time t the motion is early by Z(t).v, for good. On curves in two parameters it
        is that of the cycle at this point of the curve. It takes another solution, on the mesh halved.

        Raises
        ------
        ProblemError
            The point is no cycle of an autonomous field, or a second multiplier is 1.

        Examples
        --------
        >>> import contin
        >>> def van_der_pol(u, p):
        ...     return u.v, p.mu * (1 - u.x**2) * u.v - u.x
        >>> orbit = contin.cycle(contin.CycleProblem(van_der_pol, ["x", "v"], {"mu": 1.0}), [1.0, 0.0])
        >>> response = orbit.phase_response()
        >>> bool(max(response.errors.values()) < 1e-6)
        True
        """
        from contin.results.phase_response import PhaseResponse  # as `floquet`

        solution = self.system.solution
        return PhaseResponse(solution, self.x[: solution.size])

    def phase_loads(self) -> dict[str, float]:
        """Return the multipliers, by name, of phase conditions that load the solution: no symmetry moves it along these.

        Examples
        --------
        A loaded string is held by a condition on its mean height, though no symmetry moves it up and down:

        >>> import contin
        >>> string = contin.VariationalProblem(
        ...     energy=lambda t, x, w, p: w.y**2 / 2 + p.load * x.y, states=["y"], parameters={"load": 1.0},
        ...     ends=lambda a, b, p: (a.y, b.y), integrals={"place": lambda t, x, w, p: x.y}, phases=["place"],
        ... )
        >>> {name: round(load, 9) for name, load in contin.solve(string, [0.0]).phase_loads().items()}
        {'mu_place': -1.0}
        """
        left = self.newton_error + float(np.nan_to_num(self.discretization_error))
        return {name: load for name, load, _ in phase_loads(self.system, self.x, (), left)}

    def second_variation(self) -> SecondVariation:
        """Return the second variation of the energy there: its eigenvalues, and its modes as functions.

        Raises
        ------
        ProblemError
            The problem is no `VariationalProblem`, or Legendre's condition fails.

        Examples
        --------
        >>> import math, contin
        >>> strip = contin.VariationalProblem(
        ...     energy=lambda t, x, w, p: w.angle**2 / 2 + p.load * math.cos(x.angle),
        ...     states=["angle"], parameters={"load": 30.0}, ends=lambda a, b, p: (a.angle, b.angle),
        ...     integrals={"offset": lambda t, x, w, p: math.sin(x.angle)},
        ... )
        >>> straight = contin.solve(strip, [0.0], {"load": 45.0})  # beyond the first buckling load, 4 pi^2
        >>> straight.second_variation().index()
        1
        """
        if self.system.index is None:
            loaded = getattr(self.system.problem, "variation", None) is not None
            why = "its loads have no energy, so there is no index" if loaded else "it has no energy; state a VariationalProblem"
            raise ProblemError(f"second_variation: the problem cannot have one: {why}")
        from contin.boundary.second_variation import second_variation  # as `floquet`

        found = second_variation(self.system, self.x)  # type: ignore[arg-type]
        if found is None:
            raise ProblemError("second_variation: the energy is not convex in the controls there (Legendre's condition)")
        return dataclasses.replace(found, known=self.newton_error)


def point_of(system: Discretization, x: Array, iterations: int = 0, error: float = 0.0) -> Point:
    """Return the Point of any solution x of a system.

    Examples
    --------
    >>> from contin import AlgebraicProblem
    >>> from contin.lowlevel import Algebraic
    >>> parabola = AlgebraicProblem(lambda u, p: (p.a - u.x**2,), ["x"], {"a": 1.0})
    >>> point_of(Algebraic(parabola, ["a"]), np.array([2.0, 4.0]))
    Point(a=4)
    """
    trial = Trial.without_tangent(system, x)
    parameters = dict(zip(system.problem.parameters, map(float, system.all_parameters(x))))
    return Point("", "", parameters, trial.functionals, x, trial.tangent, system, 0.0, iterations, error)
