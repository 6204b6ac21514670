"""A solution: law, domain, states and parameters in one object, and the quantities that follow from them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from contin import Point
from contin.lowlevel import Collocation, Shown
from ribbon_model import stability
from ribbon_model.domains import CELL, LOOP, Domain
from ribbon_model.equilibrium import LENGTH, on_directors
from ribbon_model.law import Law
from ribbon_model.second_variation import Equilibrium, from_solution
from ribbon_model.shape import Shape, frames, interpolated, quadrature_centreline, quaternions
from ribbon_model.stability import Stability


@dataclass(frozen=True, eq=False, repr=False)
class Solution(Shown):
    """An equilibrium of a closed strip, on the domain that it was computed on; B = 1, L = 2 pi.

    Attributes
    ----------
    law : Law
    domain : Domain
    t : ndarray, shape (K,)
        Nodes on the unit interval, every degree-th of them a mesh point.
    states : ndarray, shape (K, 4) or (K, 7)
        Quaternion, and centreline where it is a state.
    degree : int
        Degree of the collocation.
    parameters : mapping of str to float
        All parameters of the problem.

    Examples
    --------
    >>> import contin
    >>> from ribbon_model.laws import RIBBON
    >>> from ribbon_model.seeds import primary_branch
    >>> system, x, tangent = primary_branch(RIBBON, 1, 2, 0.3, intervals=10, degree=7)
    >>> point = contin.trace(contin.lowlevel.point_of(system, x), contin.Settings(max_points=4), tangent=tangent).points[-1]
    >>> solution = Solution.of(point)
    >>> solution.domain, solution.shape().closure() < 1e-9, solution.index().index
    (<cell>, True, 0)
    """

    law: Law
    domain: Domain
    t: np.ndarray
    states: np.ndarray
    degree: int
    parameters: Mapping[str, float]

    @classmethod
    def of(cls, point: Point) -> Solution:
        """Return the solution at a point of a branch (or alike: anything with ``system`` and ``x``)."""
        return cls.at(point.system, point.x)

    @classmethod
    def at(cls, system: Collocation, x: np.ndarray) -> Solution:
        """Return the solution that unknowns x (system.size,) of a discretized `domains.StripProblem` stand for."""
        problem = system.problem
        parameters = dict(zip(problem.parameters, map(float, system.all_parameters(x))))
        return cls(problem.law, problem.on, system.nodes, system.states(x), system.degree, parameters)

    @property
    def moment(self) -> np.ndarray:
        """M at S = 0 on the lab axes, shape (3,)."""
        return np.array([self.parameters.get(name, 0.0) for name in ("M1", "M2", "M3")])

    @property
    def force(self) -> np.ndarray:
        """R at S = 0 on the lab axes, shape (3,)."""
        return np.array([self.parameters.get(name, 0.0) for name in ("R1", "R2", "R3")])

    @property
    def material(self) -> tuple[float, ...]:
        """kappa_n and the law's parameters, as `Law.response` takes them."""
        return self.parameters["kappa_n"], *(self.parameters[name] for name in self.law.parameters)

    def loads(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the components of M and R on the directors at the nodes, shape (K, 3) each."""
        force, moment = self.force, self.moment
        if self.states.shape[1] > 4:
            moment = moment - np.cross(self.states[:, 4:7], force)
        q = self.states[:, :4].T
        moment = np.broadcast_to(moment, (len(self.states), 3)).T
        return np.array(on_directors(*q, *moment)).T, np.array(on_directors(*q, *force)).T

    def strains(self) -> np.ndarray:
        """omega_1, omega_2 and omega_3 at the nodes, shape (K, 3): curvatures and twist, over 2 pi/L."""
        return self.law.linearized(self.loads()[0], *self.material)[0]

    def invariants(self) -> dict[str, np.ndarray]:
        """Return the constants of motion at the nodes: ``norm`` |q|^2 and ``hamiltonian`` H(M) + R3, shape (K,) each."""
        moment, force = self.loads()
        values = self.law.complementary(moment, *self.material)
        return {"norm": np.sum(self.states[:, :4] ** 2, axis=1), "hamiltonian": values + force[:, 2]}

    def shape(self) -> Shape:
        """Return the closed strip in space, unfolded by the symmetries of the domain."""
        length, states = self.parameters["length"], self.states
        x = states[:, 4:7] if states.shape[1] > 4 else quadrature_centreline(self.t, states, self.degree, length)
        omega = self.strains()
        part = Shape(length * np.asarray(self.t), x, frames(states), omega[:, 2] / omega[:, 0])
        return self.domain.whole(part, self.parameters)

    def sampled(self, t: np.ndarray) -> np.ndarray:
        """Return quaternion and centreline at places t (K,) of the unit interval, shape (K, 7)."""
        if self.states.shape[1] > 4:
            return interpolated(self.t, self.states, self.degree, t)
        x = quadrature_centreline(self.t, self.states, self.degree, self.parameters["length"])
        return interpolated(self.t, np.hstack([self.states, x]), self.degree, t)

    def equilibrium(self) -> Equilibrium:
        """Return the equilibrium along the whole loop, for its second variation; raises as `from_solution`."""
        return from_solution(self.law, self.domain, self.t, self.states, self.degree, self.parameters)

    def index(self) -> Stability:
        """Return the number of negative directions of the energy; see `ribbon_model.stability.index`."""
        return stability.index(self.equilibrium())

    def functionals(self) -> dict[str, float]:
        """kappa_star (28) and energy (mean of U, without kappa_n**2/2), by the Gauss points of the collocation."""
        system, x = self.discretized()
        return dict(zip(system.problem.functionals, map(float, system.functionals(x))))

    def on(self, domain: Domain) -> Solution:
        """Return the same strip on another domain: a solution on the cell on a half loop, or any on the whole loop.

        Raises
        ------
        ValueError
            A solution on this domain cannot be transferred to the other one.
        """
        if self.domain is domain:
            return self
        if domain is not LOOP and self.domain is not CELL:
            raise ValueError(f"a solution on the {self.domain.name} cannot be transferred to the {domain.name}")
        shape = self.shape()
        period = len(shape.arclength) - 1
        first, last = domain.stretch(period, len(self.t) - 1)
        here = np.arange(first, last + 1)
        turns, here = (0, here) if last - first == period else np.divmod(here, period)  # a whole loop has both of its ends
        s = shape.arclength[here] + LENGTH * turns - shape.arclength[first]
        axes, origin = shape.directors[first], shape.centreline[first]
        moment = axes @ (self.moment - np.cross(origin, self.force))
        force = axes @ self.force + 0.0  # no negative zeros
        values = dict(zip(("M1", "M2", "M3", "R1", "R2", "R3"), map(float, (*moment, *force))))
        values |= {name: self.parameters[name] for name in ("kappa_n", *self.law.parameters)}
        states = np.hstack([quaternions(shape.directors[here] @ axes.T), (shape.centreline[here] - origin) @ axes.T])
        return Solution(self.law, domain, s / s[-1], states, self.degree, {**domain.problem(self.law).parameters, **values})

    def discretized(self) -> tuple[Collocation, np.ndarray]:
        """Return the system on the mesh of the solution, with the domain's free parameters, and its unknowns (system.size,)."""
        mesh = np.append(self.t[: -1 : self.degree], 1.0)
        system = Collocation(self.domain.problem(self.law), mesh, self.degree, self.domain.free, self.parameters)
        return system, system.pack(self.states, self.parameters)
