"""Phases of networks: conditions that hold what a continuous symmetry leaves open.

A loop of a uniform strip can shift along itself. On a circle this is a rotation; on other states it is a mode v of the second
variation with the eigenvalue zero, and a state x0 is one of a family. A phase picks one of the family,

    sum over members of int v.(x - x0) dt = 0,

with v as a short Fourier sum. It does no work, so its multiplier vanishes, which is a check (`contin.Point.phase_loads`).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

#: Largest wavenumber of the sum, on one member. A mode with more waves would lose its phase; twice as many take twice the time
#: to find it.
_WAVES = 24
#: Terms below this part of the largest are left out: the rest agrees with the mode to some percent, and the state that is
#: picked does not matter. A tenth of it leaves twice as many operations for each evaluation.
_LEAST = 0.05


@dataclass(frozen=True)
class Phase:
    """A condition along a mode.

    Attributes
    ----------
    terms : tuple of (member, state, wave, factor)
        The mode: factor times cos(2 pi wave t), or sin(2 pi wave t) with a wave below zero, of a state: 0 to 3 of the
        quaternion, 4 to 6 of the centreline, for 0 <= t <= 1 on a member.
    level : float
        The integral of mode times state at the state that is picked.
    holds : bool
        Without this, the integral is there, and nothing is held.
    name : str
        Of its state, behind ``phase_``; by default its number.

    Examples
    --------
    >>> Phase(((0, 4, 1, 2.0),)).density(0, 0.5, [0, 0, 0, 0, 3.0, 0, 0], None, 1)
    -6.0
    """

    terms: tuple[tuple[int, int, int, float], ...]
    level: float = 0.0
    holds: bool = True
    name: str = ""

    def density(self, member: int, t, x, p, count: int):
        """Return what is integrated over one of ``count`` members, from t and its states x."""
        own = [term for term in self.terms if term[0] == member]
        shapes = {wave: _wave(math, wave, t) for _, _, wave, _ in own}
        value = -self.level / count
        for _, state, wave, factor in own:
            value = value + factor * shapes[wave] * x[state]
        return value


#: Phases of one strip by name: they fix the angle about the tangent (a homogeneous ring, an isotropic rod between ends on one
#: line), the place along a closed strip that is twisted to the right or to the left, and along a ring that buckles with two
#: waves. (Of combinations of x1 and x2 sin(2 pi s), those with the factors -3 and 0 lose their slope on the way to a Moebius
#: band of a flat strip; with +3 they keep it.)
PHASES = {
    name: Phase(terms, name=name.replace(", ", "_").replace(" ", "_"))
    for name, terms in {
        "spin": ((0, 4, 0, 1.0),), "shift, right": ((0, 4, 0, 1.0), (0, 5, -1, 3.0)),
        "shift, left": ((0, 4, 0, 1.0), (0, 5, -1, -3.0)), "shift, two waves": ((0, 4, -2, 1.0),),
    }.items()
}  # fmt: skip


def _wave(functions, wave: int, t):
    return functions.sin(-2 * math.pi * wave * t) if wave < 0 else functions.cos(2 * math.pi * wave * t) if wave else 1.0


def phase_along(mode: Callable, state: Callable) -> Phase:
    """Return the phase of a mode at a state, functions of t (K,) with values (K, members, 7)."""
    t, weights = np.polynomial.legendre.leggauss(8 * _WAVES)
    t, weights = (1 + t) / 2, weights / 2
    waves = np.arange(-_WAVES, _WAVES + 1)
    shapes = np.array([_wave(np, int(wave), t) * weights for wave in waves])
    factors = np.einsum("kt,tmi->mik", shapes, mode(t)) * np.where(waves == 0, 1, 2)
    factors[np.abs(factors) < _LEAST * np.abs(factors).max()] = 0
    level = np.einsum("mik,kt,tmi->", factors, shapes, state(t))
    terms = ((int(m), int(i), int(waves[k]), float(factors[m, i, k])) for m, i, k in np.argwhere(factors))
    return Phase(tuple(terms), float(level))
