"""Secondary branches: what leaves a primary branch (m, n) where its index changes, and which symmetry is left.

The symmetries of a primary branch are the rotary reflection that takes S to S + L/2n, and reversals of S: n mirrors, about
S = 0, L/2n, L/n ..., and n two-fold axes along d2, half-way between. A mode of the class of wavenumber j (`stability`) turns
under the rotary reflection by the angle 2 pi j / 2n, so it comes back after ``2n / gcd(j, 2n)`` of them; if that number is 2 or
larger, it can be chosen to keep one reversal:

- j = n: one mode, even (keeps the mirrors) or odd (keeps the axes);
- 0 < j < n: a plane of modes, of which some keep a mirror, others an axis. Where the number above is odd, these are the same.

A reversal fixes two places half a loop apart. So the branch is an ordinary one on the half loop between mirrors or between
axes, where its kernel is simple. Modes of j = 0 that are odd keep no reversal, and need the whole loop.

Where R = 0 the equations are integrable and every wave has all symmetries of a primary branch. So the force tells a secondary
branch from a primary one: it vanishes where they meet, and nowhere else for the laws with omega_2 = 0.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from contin import Collocation, locate_branch_point
from ribbon_model.equilibrium import LENGTH, half_loop, half_loop_between_axes
from ribbon_model.laws import Law
from ribbon_model.shape import closed_strip, quaternions

#: The bifurcation on the half loop lies this near to where it is looked for, relative to 1 + |kappa_n|.
_NEAR = 1e-4
#: What a branch may keep, and the domain on which it is followed then.
DOMAINS = {"mirror": half_loop, "axis": half_loop_between_axes}


@dataclass(frozen=True)
class Breaking:
    """How a mode of the class of ``wavenumber`` and ``parity`` breaks the symmetry of a primary branch of wavenumber ``n``."""

    n: int
    wavenumber: int
    parity: str

    @property
    def dimension(self) -> int:
        """Of the kernel."""
        return 2 if 0 < self.wavenumber < self.n else 1

    @property
    def repeats(self) -> int:
        """Number of equal parts into which rotations and rotary reflections that are kept divide the loop."""
        return math.gcd(self.wavenumber, 2 * self.n)

    @property
    def keeps(self) -> tuple[str, ...]:
        """The reversal that an emanating branch keeps, 'mirror' or 'axis'; two kinds of branches for a pair of modes."""
        if self.wavenumber == 0:
            return ()
        if self.dimension == 1:
            return ("mirror",) if self.parity == "even" else ("axis",)
        return ("mirror", "axis") if self._order % 2 == 0 else ("mirror",)

    @property
    def _order(self) -> int:
        """Rotary reflections after which the mode comes back."""
        return 2 * self.n // self.repeats

    @property
    def symmetric(self) -> bool:
        """Whether the two ways to leave along a mode are images of each other (a pitchfork)."""
        return self._order % 2 == 0 or self.wavenumber == 0

    def kept(self, reversal: str) -> str:
        """The symmetry of an emanating branch, in words."""
        mirrors, axes = self._reversals(reversal)
        words = [_counted(mirrors, "mirror", "mirrors"), _counted(axes, "two-fold axis", "two-fold axes")]
        if self.repeats > 1:
            words.append(f"{self.repeats}-fold {'rotation' if self._order % 2 == 0 else 'rotary reflection'}")
        return ", ".join(filter(None, words))

    def broken(self, reversal: str) -> str:
        """What an emanating branch has lost of the symmetry of the primary one, in words."""
        mirrors, axes = (self.n - number for number in self._reversals(reversal))
        words = [_counted(mirrors, "mirror", "mirrors"), _counted(axes, "two-fold axis", "two-fold axes")]
        return ", ".join([*filter(None, words), f"{2 * self.n}-fold rotary reflection"])

    def _reversals(self, reversal: str) -> tuple[int, int]:
        """Numbers of mirrors and of two-fold axes that are kept."""
        if self._order % 2:
            return self.repeats // 2, self.repeats // 2
        return (self.repeats, 0) if reversal == "mirror" else (0, self.repeats)


def _counted(number: int, one: str, several: str) -> str:
    return f"one {one}" if number == 1 else f"{number} {several}" if number else ""


def breaking(n: int, name: str) -> Breaking:
    """From the name of an event, as in 'wavenumber 1 pair' (`branches.stability`).

    Raises
    ------
    ValueError
        It is no such name.
    """
    known = [f"wavenumber {j} {parity}" for j in (0, n) for parity in ("even", "odd")][1:]
    known += [f"wavenumber {j} pair" for j in range(1, n)]
    if name not in known:
        raise ValueError(f"mode: {name!r} must be {', '.join(known[:-1])} or {known[-1]} for n = {n}")
    _, wavenumber, parity = name.split()
    return Breaking(n, int(wavenumber), "" if parity == "pair" else parity)


def unfolded(law: Law, t, states, degree: int, parameters: Mapping[str, float], reversal: str):
    """A solution on the cell of a primary branch as one on the half loop that starts at a mirror or at a two-fold axis.

    Returns
    -------
    system : Collocation
        On the unfolded mesh, kappa_n free.
    x : ndarray, shape (system.size,)
        The solution.
    """
    p, shape = parameters, closed_strip(law, t, states, degree, parameters)
    quarter, n = len(t) - 1, round(LENGTH / (4 * parameters["length"]))
    # the closed strip starts at a mirror, two quarter waves before S = 0
    start = quarter * (3 if reversal == "axis" else 2)
    here = start + np.arange(2 * n * quarter + 1)
    turn, here = np.divmod(here, 4 * n * quarter)
    s = shape.arclength[here] + LENGTH * turn - shape.arclength[start]
    axes = shape.directors[start]
    centreline = (shape.centreline[here] - shape.centreline[start]) @ axes.T
    moment = axes @ [p["M1"], p["M2"], 0.0]
    domain = DOMAINS[reversal](law)
    values = dict(zip(("M1", "M2", "M3"), moment)) | {name: p[name] for name in ("kappa_n", *law.parameters)}
    mesh = np.append(s[:-1:degree] / s[-1], 1.0)
    system = Collocation(domain.problem, mesh, degree, domain.free, values)
    values = dict.fromkeys(domain.free, 0.0) | values
    return system, system.pack(np.hstack([quaternions(shape.directors[here] @ axes.T), centreline]), values)


def force(point) -> float:
    """|R| of a point (or alike) of a branch: zero on a primary branch and on a circle."""
    return math.hypot(*(point[name] for name in ("R1", "R2", "R3")))


def secondary_branch(law: Law, t, states, degree: int, parameters: Mapping[str, float], reversal: str):
    """Where a secondary branch leaves a primary one, near a solution on the cell.

    Returns
    -------
    system : Collocation
    x : ndarray, shape (system.size,)
        The bifurcation, as the discrete equations of the half loop have it.
    tangent : ndarray, shape (system.size,)
        Along the branch that leaves.

    Raises
    ------
    ConvergenceError, ValueError
        Nothing that keeps this reversal leaves near there.
    """
    system, x = unfolded(law, t, states, degree, parameters, reversal)
    found = locate_branch_point(system, x)
    at = system.parameter_index("kappa_n")
    near = abs(found.x[at] - parameters["kappa_n"]) < _NEAR * (1 + abs(parameters["kappa_n"]))
    if not (near and found.tangents):
        raise ValueError(f"nothing leaves the half loop with the {reversal} at kappa_n = {parameters['kappa_n']:.6g}")
    forces = [system.parameter_index(name) for name in system.free if name.startswith("R")]
    tangent = max(found.tangents, key=lambda vector: np.abs(vector[forces]).max())
    return system, found.x, tangent
