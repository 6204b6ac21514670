"""Conditions under integrals over an open strip: phases, and a roller. Each has a density and a multiplier."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from ribbon_model import ends
from ribbon_model.ends import LOOSE
from ribbon_model.equilibrium import directors

#: Conditions that fix what symmetry leaves open: the angle about the tangent (a homogeneous ring, an isotropic rod between ends
#: on one line), the place along a closed strip that is twisted to the right or to the left, and along a ring that buckles with
#: two waves. Each is an integral condition that holds by symmetry, so its multiplier vanishes. (Of combinations of x1 and
#: x2 sin(2 pi s), those with the factors -3 and 0 lose their slope on the way to a Moebius band of a flat strip; with +3 they
#: keep it.)
PHASES = {
    "spin": lambda t, x: x.x1,
    "shift, right": lambda t, x: x.x1 + 3 * x.x2 * math.sin(2 * math.pi * t),
    "shift, left": lambda t, x: x.x1 - 3 * x.x2 * math.sin(2 * math.pi * t),
    "shift, two waves": lambda t, x: x.x1 * math.sin(4 * math.pi * t),
}
#: Fewest intervals of the mesh of a strip with a roller, and the most that are added so that one ends there. It is not adapted.
_FEWEST, _MOST = 20, 100


@dataclass(unsafe_hash=True)  # the direction is normalised when it is made, and then left as it is
class Roller:
    """A support between the ends, which holds the place of one point of the strip along a direction.

    Attributes
    ----------
    at : float
        Arclength of this point, a multiple of 1/N for a whole number N up to 100.
    direction : tuple of float
        The strip's place there along it is the number ``roller``.

    Raises
    ------
    ValueError
        A field that does not fit; one sentence.

    Notes
    -----
    The place is x(at) = the integral of d3 up to there, so a roller is an integral condition whose density jumps at a mesh
    point. Its multiplier is the force of the roller on the strip, and the contact force before it is larger by this.
    """

    at: float
    direction: ends.Vector

    def __post_init__(self) -> None:
        self.direction = ends.unit("roller", self.direction)
        if not 0 < self.at < 1 or self.intervals() == 0:
            raise ValueError(f"roller: at: {self.at:g} must be a multiple of 1/N between 0 and 1, with N up to {_MOST}")

    def intervals(self, least: int = _FEWEST) -> int:
        """Return a number of equal intervals, not below ``least``, one of which ends at the roller; 0 if there is none."""
        counts = range(max(least, _FEWEST), max(least, _FEWEST) + _MOST)
        return next((count for count in counts if abs(self.at * count - round(self.at * count)) < LOOSE), 0)

    def density(self) -> Callable:
        """Return g(t, x, p), whose integral over the strip vanishes where the roller holds it."""
        at, (x, y, z) = self.at, self.direction

        def density(t, state, p):
            before = (1 - (t - at) / (abs(t - at) + 1e-300)) / 2
            d31, d32, d33 = directors(*state[:4])[6:]
            return before * (x * d31 + y * d32 + z * d33) - p.roller

        return density


def densities(phases: tuple[str, ...], roller: Roller | None) -> Callable:
    """Return the sum of all densities times their multipliers, as a function of (t, x, lam, p); the roller's is the last."""
    return _together((*(_of_phase(name) for name in phases), *([roller.density()] if roller else [])))


def _together(functions: tuple[Callable, ...]) -> Callable:
    """Return the sum of these densities times their multipliers."""
    if not functions:
        return lambda t, x, lam, p: 0
    rest, last, place = _together(functions[:-1]), functions[-1], len(functions) - 1
    return lambda t, x, lam, p: rest(t, x, lam, p) + lam[place] * last(t, x, p)


def _of_phase(name: str) -> Callable:
    """Return the density of a phase as that of a roller is given."""
    phase = PHASES[name]
    return lambda t, x, p: phase(t, x)
