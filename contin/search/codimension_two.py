"""Curves that leave from points of codimension two of equilibria.

Curves of folds and of Hopf points pass there: they begin right at the point. Curves of cycles (folds at generalized Hopf
points, torus bifurcations at zero-Hopf and double Hopf points) begin where the cycles have no size and their equations are
singular, and homoclinic orbits at Bogdanov-Takens points likewise. Their first point lies a little beside: a first guess is
corrected with its size held, and the curve goes on from there to larger ones.

A cycle of amplitude r beside a Hopf point is u = u0 + r Re(q exp(2 pi i t)), with parameters that differ by O(r^2). The cosine
of the angle of its multipliers, of which the defining system needs a first value, is taken from this guess as it is. At a
zero-Hopf point the angle is O(r), and it may be imaginary: then no torus bifurcations begin there.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from contin.arrays import Array, ComplexArray
from contin.core.labels import Label
from contin.core.newton import correct
from contin.core.protocol import Discretization
from contin.core.trial import linearization
from contin.cycles.curves import TorusCurve
from contin.defining.fold_curve import FoldCurve
from contin.defining.hopf_curve import HopfCurve
from contin.defining.system import Defining
from contin.equilibria.folds import HOMOCLINIC
from contin.equilibria.lyapunov import critical_pair
from contin.equilibria.system import Algebraic
from contin.errors import ConvergenceError, ProblemError
from contin.levels import ROUGH
from contin.results.point import Point
from contin.search.cycle_starts import small_cycle
from contin.search.takens import Takens

#: Amplitudes of first cycles, relative to 1 + the largest state, in the order in which they are tried.
_AMPLITUDES = (1e-2, 1e-3, 1e-1)
#: Sizes of first homoclinic orbits as parts of `Takens.rate`, in the order in which they are tried.
_SIZES = (0.1, 0.2, 0.05, 0.4)
#: Part of the size of a first guess by which it may be corrected: what it leaves out is of second order.
_OFF = 0.5

#: A system, a first point, and the tangent there; without a tangent the curve passes the point, and goes both ways.
First = tuple[Discretization, Array, Array | None]


def leaving(start: Point, kind: str, branch: int) -> First:
    """Return where a curve begins that leaves from a point of codimension two.

    Raises
    ------
    ProblemError
        No such curve leaves there.
    ConvergenceError
        It is not found.
    """
    if kind not in start.curves:
        known = f"labelled {start.label!r}: {', '.join(start.curves) or 'none'}"
        raise ProblemError(f"kind: {kind!r} must be one of the curves that leave from the start, {known}")
    base, x = _equilibrium(start)
    frequencies = _frequencies(start, base, x)
    if kind == HOMOCLINIC:
        return _homoclinic(base, x)
    if kind == Label.HOPF:
        return _hopf_points(base, x, frequencies[-1] if frequencies else 0.0)
    if start.label == Label.GENERALIZED_HOPF:
        return _corrected_cycle(base, x, frequencies[0], None)
    if kind == Label.TORUS:
        return _tori(base, x, frequencies, branch)
    return FoldCurve(base), x, None


def _equilibrium(start: Point) -> tuple[Algebraic, Array]:
    """Return the equilibrium at a point of a curve, in the user's units."""
    curve: Any = start.system
    return curve.base.without_scales(start.x[: curve.base.size])


def _frequencies(start: Point, base: Algebraic, x: Array) -> list[float]:
    """Return the frequencies of the critical pairs: that of the curve first; none at a Bogdanov-Takens point."""
    if start.label == Label.BOGDANOV_TAKENS:
        return []
    values = base.eigenvalues(x)
    upper = values[values.imag > 0]
    count = 2 if start.label == Label.DOUBLE_HOPF else 1
    found = sorted(float(value.imag) for value in upper[np.argsort(np.abs(upper.real))[:count]])
    own = start.functionals.get("frequency", found[0])
    return sorted(found, key=lambda frequency: abs(frequency - own))


def _hopf_points(base: Algebraic, x: Array, frequency: float) -> First:
    """Return the curve of Hopf points: from a Bogdanov-Takens point (without a frequency) it goes one way."""
    if frequency:
        return HopfCurve(base.as_field(), size=frequency**2), np.append(x, 1.0), None
    curve = HopfCurve(base.as_field(), size=float(np.linalg.norm(base.jacobian(x), 2)) ** 2)
    x = np.append(x, 0.0)
    row = np.zeros(curve.size)
    row[-1] = 1.0  # the square of the frequency grows
    return curve, x, linearization(curve, x, row).tangent


def _tori(base: Algebraic, x: Array, frequencies: list[float], branch: int) -> First:
    """Return the curve of torus bifurcations of the cycles of one pair."""
    if not 0 <= branch < len(frequencies):
        raise ProblemError(f"branch: {branch} must lie between 0 and {len(frequencies) - 1}")
    other = frequencies[1 - branch] if len(frequencies) > 1 else 0.0
    return _corrected_cycle(base, x, frequencies[branch], other)


def _corrected_cycle(base: Algebraic, x: Array, frequency: float, other: float | None) -> First:
    """Return a small cycle on the curve of torus bifurcations at which another pair is critical; of folds without one."""
    pair = critical_pair(base.jacobian(x), frequency)
    for amplitude in _AMPLITUDES:
        size = amplitude * (1 + float(np.abs(base.states(x)).max()))
        cycles, y, tangent = small_cycle(base, x, pair, size)
        curve: Defining = FoldCurve(cycles)
        if other is not None:
            angle = _angle(cycles.eigenvalues(y), 2 * math.pi * other / frequency)
            curve, y, tangent = TorusCurve(cycles), np.append(y, math.cos(angle)), np.append(tangent, 0.0)
        found = _corrected(curve, y, tangent, size)
        if found is not None:
            return found
    raise ConvergenceError("no curve of cycles was found beside the point of codimension two")


def _angle(exponents: ComplexArray, expected: float) -> float:
    """Return the angle of the complex pair of multipliers that is nearest to an expected one on the unit circle.

    Raises
    ------
    ProblemError
        There is none: two real multipliers have the product one.
    """
    pairs = exponents[(exponents.imag > 0) & (exponents.imag < math.pi)]
    if not pairs.size:
        raise ProblemError("kind: no torus bifurcations leave from this point: the multipliers of the cycles there are real")
    distances = np.abs(np.exp(1j * pairs.imag) - np.exp(1j * math.acos(math.cos(expected))))
    return float(pairs[np.argmin(distances)].imag)


def _corrected(system: Discretization, x: Array, tangent: Array, size: float) -> First | None:
    """Return a first guess corrected with its size held, and the tangent to larger ones; None where that fails."""
    row = system.weights * tangent
    try:
        found = correct(system, x, row, row @ x).x
    except ConvergenceError:
        return None
    off = system.weights @ (found - x) ** 2
    if not off < (_OFF * size) ** 2:
        return None
    return system, found, linearization(system, found, row).tangent


def _homoclinic(base: Algebraic, x: Array) -> First:
    """Return a small homoclinic orbit at a Bogdanov-Takens point."""
    takens = Takens(base, x)
    for share in _SIZES:
        size = share * takens.rate
        system, y, distance = takens.guess(size)
        larger, smaller = (takens.guess(size * factor)[1] for factor in (1 + ROUGH, 1 - ROUGH))
        change = larger - smaller
        found = _corrected(system, y, change / float(np.sqrt(system.weights @ change**2)), distance)
        if found is not None:
            return found
    raise ConvergenceError("no homoclinic orbit was found beside the Bogdanov-Takens point")
