"""The domains on which an equilibrium is computed: parts of the loop, with end conditions from its symmetry.

- `CELL`: a quarter wave [0, L/4n] of a primary branch, between a mirror at S = 0 (normal to d3) and a two-fold axis along
  d2 at the other end; R = 0. This is the smallest domain, and the default.
- `HALF_LOOP`: [0, L/2] between two mirrors. It has all wavenumbers, each as a simple bifurcation.
- `HALF_LOOP_BETWEEN_AXES`: [0, L/2] between two-fold axes along d2, for branches that break the mirrors and keep an axis.
- `LOOP`: [0, L] closed, gauge and phase fixed, the redundancy of closure unfolded by a parameter that stays zero.

A domain states its boundary value problem for a law, and unfolds a solution on it to the whole strip by its symmetries. The
problem knows its law and its domain, so a point of a branch is all that a `ribbon_model.solution.Solution` needs.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from contin import BoundaryValueProblem
from contin.lowlevel import Collocation, levels
from ribbon_model.equilibrium import LENGTH, directors, with_force, without_force
from ribbon_model.law import Law
from ribbon_model.shape import Shape


@dataclass(frozen=True, eq=False, repr=False)
class StripProblem(BoundaryValueProblem):
    """The boundary value problem of a ``law`` ``on`` a domain."""

    law: Law | None = None
    on: Domain | None = None


@dataclass(frozen=True, eq=False, repr=False)
class Domain:
    """A part of the closed strip with conditions at its ends.

    Attributes
    ----------
    name : str
        The name in scenes and files.
    free : tuple of str
        The free parameters on a branch, kappa_n first.
    boundary : callable
        ``boundary(u0, u1, p)``: the conditions at the ends.
    parameters : mapping of str to float
        The parameters of the domain, ``length`` first, with their values.
    unfold : callable
        ``unfold(part)`` is the closed strip from the part of it that was computed, a `Shape`.
    reversal : str
        The symmetry at both ends of a half loop, 'mirror' or 'axis'; '' on other domains.
    quarters : int
        The place on the closed strip where the domain begins, in quarter waves of the cell.
    equations : callable
        ``equations(law)``, see `ribbon_model.equilibrium`.
    """

    name: str
    free: tuple[str, ...]
    boundary: Callable
    parameters: Mapping[str, float]
    unfold: Callable[[Shape], Shape] = lambda part: part
    reversal: str = ""
    quarters: int = 0
    equations: Callable = with_force

    @functools.cache  # noqa: B019 - the domains are constants of this module; what is compiled for a problem is found again
    def problem(self, law: Law) -> StripProblem:
        """Return the problem of a law: one object for each law."""
        rhs, states, loads, functionals = self.equations(law)
        values = {"kappa_n": 0.0, **law.defaults, **loads, **self.parameters}
        return StripProblem(rhs, self.boundary, states, values, functionals=functionals, law=law, on=self)

    def parts(self, n: int) -> int:
        """Return the number of such parts in the loop of a wave of wavenumber n."""
        return round(LENGTH / self.parameters["length"])

    def wavenumber(self, parameters: Mapping[str, float]) -> int:
        """Return n of the primary branch of a solution; 0 if the domain does not determine it."""
        return 0

    def whole(self, part: Shape, parameters: Mapping[str, float]) -> Shape:
        """Return the closed strip from the part of it that was computed, and the parameters of the solution."""
        return self.unfold(part)

    def stretch(self, period: int, quarter: int) -> tuple[int, int]:
        """Return the first and last node of this domain on the closed strip, 0 to ``period``; a cell has 0 to ``quarter``."""
        first = self.quarters * quarter
        return first, first + period // self.parts(1)

    def discretize(self, law: Law, intervals: int, degree: int, parameters: Mapping[str, float]) -> Collocation:
        """Return the collocation system on a uniform mesh."""
        return Collocation(self.problem(law), np.linspace(0, 1, intervals + 1), degree, self.free, parameters)

    def circle(self, system: Collocation, m: int, kappa_n: float) -> np.ndarray:
        """Return the unknowns of the planar m-covered circle of the law, shape (system.size,)."""
        known, law = dict(zip(system.problem.parameters, system.parameters)), system.problem.law
        half_angle = m * known["length"] * system.nodes / 2
        zero = np.zeros_like(half_angle)
        states = [np.cos(half_angle), np.sin(half_angle), zero, zero]
        if "x1" in system.problem.states:
            states += [zero, (np.cos(2 * half_angle) - 1) / m, np.sin(2 * half_angle) / m]
        moment = law.circle(m, kappa_n, {name: float(known[name]) for name in law.parameters})["M1"]
        return system.pack(np.array(states).T, dict.fromkeys(system.free, 0.0) | {"kappa_n": kappa_n, "M1": moment})

    def __repr__(self) -> str:
        return f"<{self.name}>"


class Cell(Domain):
    """Quarter wave with R = 0; parameters ``turn`` (2 pi m / 4n) and ``sense`` (the sign of the moment on the circle).

    Where the plane of the mirror and the two-fold axis meet, the waves turn about one line, so the centreline closes.
    """

    def parts(self, n: int) -> int:
        return 4 * n

    def wave(self, m: int, n: int, kappa_n: float) -> dict[str, float]:
        """Return the parameters of the cell for the branch of the mode n, which leaves the m-covered circle at kappa_n."""
        return {"length": LENGTH / (4 * n), "turn": math.pi * m / (2 * n), "sense": math.copysign(1.0, m - kappa_n)}

    def wavenumber(self, parameters: Mapping[str, float]) -> int:
        return round(LENGTH / (4 * parameters["length"]))

    def whole(self, part: Shape, parameters: Mapping[str, float]) -> Shape:
        p = parameters
        axis = p["sense"] * np.array([p["M1"], p["M2"], 0.0])
        axis /= np.linalg.norm(axis)
        angle, centre = 4 * p["turn"], np.zeros(3)
        if abs(math.sin(angle / 2)) > levels.LOCATED:
            # where the two-fold axis (through x along d2) meets the plane of the mirror
            d2, x, normal = part.directors[-1, 1], part.centreline[-1], part.directors[0, 2]
            centre = x - d2 * (x @ normal) / (d2 @ normal)
        return self.unfold(part).repeated(self.wavenumber(p), axis, centre, angle)


def _ends_of_cell(u0, u1, p):
    """Return the boundary conditions of the cell: a mirror at S = 0, a two-fold axis along d2 at the other end."""
    d11, d12, d13, d21, d22, d23, d31, d32, d33 = directors(u1.q0, u1.q1, u1.q2, u1.q3)
    moment = p.sense * math.sqrt(p.M1 * p.M1 + p.M2 * p.M2)
    return (
        u0.q0 - 1, u0.q1, u0.q2, u0.q3, d21 * p.M1 + d22 * p.M2,
        math.cos(p.turn) * d23 * moment - math.sin(p.turn) * (d22 * p.M1 - d21 * p.M2),
    )  # fmt: skip


def _mirrors(u0, u1, p):
    """Return the conditions of mirrors normal to d3: d3 is parallel at both ends, which implies M3 = R1 = R2 = 0."""
    d11, d12, d13, d21, d22, d23, d31, d32, d33 = directors(u1.q0, u1.q1, u1.q2, u1.q3)
    return u0.q0 - 1, u0.q1, u0.q2, u0.q3, u0.x1, u0.x2, u0.x3, d31, d32, u1.x3


def _axes(u0, u1, p):
    """Return the conditions of two-fold axes along d2: both axes are one line, which implies M2 = R2 = 0 at both ends."""
    d11, d12, d13, d21, d22, d23, d31, d32, d33 = directors(u1.q0, u1.q1, u1.q2, u1.q3)
    return u0.q0 - 1, u0.q1, u0.q2, u0.q3, u0.x1, u0.x2, u0.x3, d21, d23, u1.x1, u1.x3


def _closed(u0, u1, p):
    """Return the boundary conditions of the loop: the frame and the centreline are periodic.

    H(M) + R3 is constant along the strip, so one of the six conditions of closure follows from the others; a dissipative term
    ``unfold`` (M × omega + R × e3), which would change that constant, makes the count regular.
    """
    return u0.q0 - 1, u0.q1, u0.q2, u0.q3, u0.x1, u0.x2, u0.x3, u1.q1, u1.q2, u1.q3, u1.x1, u1.x2, u1.x3


CELL = Cell(
    "cell", ("kappa_n", "M1", "M2"), _ends_of_cell, {"length": 1.0, "turn": 1.0, "sense": 1.0},
    unfold=lambda part: part.turned().mirrored(), equations=without_force,
)  # fmt: skip
HALF_LOOP = Domain(
    "half loop", ("kappa_n", "M1", "M2", "R3"), _mirrors, {"length": LENGTH / 2}, Shape.mirrored, "mirror", quarters=2
)  # the closed strip of a cell starts at a mirror, two quarter waves before S = 0
HALF_LOOP_BETWEEN_AXES = Domain(  # the equations do not use ``axes``: it marks the columns of such a solution in files
    "half loop between axes", ("kappa_n", "M1", "M3", "R1", "R3"), _axes, {"length": LENGTH / 2, "axes": 1.0},
    Shape.turned, "axis", quarters=3,
)  # fmt: skip
#: M3 at S = 0, a parameter, fixes the phase; ``unfold`` is zero on every closed solution.
LOOP = Domain("loop", ("kappa_n", "M1", "M2", "R1", "R2", "R3", "unfold"), _closed, {"length": LENGTH})
#: All domains by name.
DOMAINS: dict[str, Domain] = {domain.name: domain for domain in (CELL, HALF_LOOP, HALF_LOOP_BETWEEN_AXES, LOOP)}
#: The half loops by the reversal of S that they keep.
HALF_LOOPS: dict[str, Domain] = {domain.reversal: domain for domain in (HALF_LOOP, HALF_LOOP_BETWEEN_AXES)}
