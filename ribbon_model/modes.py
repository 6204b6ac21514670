"""Critical modes of a primary branch (m, n): the symmetry that they break, and the one that a new branch keeps.

The symmetries of a primary branch are the rotary reflection that takes S to S + L/2n, and reversals of S: n mirrors, about
S = 0, L/2n, L/n ..., and n two-fold axes along d2, half-way between. A mode of the class of wavenumber j (`stability`) turns
under the rotary reflection by the angle 2 pi j / 2n, so it comes back after ``2n / gcd(j, 2n)`` of them; if that number is 2 or
larger, it can be chosen to keep one reversal:

- j = n: one mode, even (keeps the mirrors) or odd (keeps the axes);
- 0 < j < n: a plane of modes, of which some keep a mirror, others an axis. Where the number above is odd, these are the same.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

#: Names of the reversals.
REVERSALS = {"mirror": "mirror", "axis": "two-fold axis"}


@dataclass(frozen=True)
class Mode:
    """A mode of the class of ``wavenumber`` and ``parity`` ('even', 'odd', '' for a pair).

    ``n`` is the wavenumber of the primary branch whose symmetry it breaks.

    Examples
    --------
    >>> mode = Mode(2, 1, "")
    >>> str(mode), mode.dimension, mode.keeps, mode.kept("axis")
    ('wavenumber 1 pair', 2, ('mirror', 'axis'), 'one two-fold axis')
    """

    n: int
    wavenumber: int
    parity: str

    def __str__(self) -> str:
        return f"wavenumber {self.wavenumber} {self.parity or 'pair'}"

    @classmethod
    def parse(cls, n: int, text: str) -> Mode:
        """Return the mode that a scene or a file names, as `str` does.

        Raises
        ------
        ValueError
            It is not a mode of a branch of wavenumber n.
        """
        known = [cls(n, j, parity) for j in (0, n) for parity in ("even", "odd")][1:]  # (0, even) keeps all symmetry
        known += [cls(n, j, "") for j in range(1, n)]
        for mode in known:
            if str(mode) == text:
                return mode
        words = [str(mode) for mode in known]
        raise ValueError(f"mode: {text!r} must be {', '.join(words[:-1])} or {words[-1]} for n = {n}")

    @property
    def dimension(self) -> int:
        """Dimension of the kernel."""
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
        """True if the two directions along a mode are images of each other (a pitchfork)."""
        return self._order % 2 == 0 or self.wavenumber == 0

    def kept(self, reversal: str) -> str:
        """Return the symmetry of an emanating branch, in words."""
        mirrors, axes = self._reversals(reversal)
        words = [_counted(mirrors, "mirror", "mirrors"), _counted(axes, "two-fold axis", "two-fold axes")]
        if self.repeats > 1:
            words.append(f"{self.repeats}-fold {'rotation' if self._order % 2 == 0 else 'rotary reflection'}")
        return ", ".join(filter(None, words))

    def broken(self, reversal: str) -> str:
        """Return the symmetries of the primary branch that an emanating branch breaks, in words."""
        mirrors, axes = (self.n - number for number in self._reversals(reversal))
        words = [_counted(mirrors, "mirror", "mirrors"), _counted(axes, "two-fold axis", "two-fold axes")]
        return ", ".join([*filter(None, words), f"{2 * self.n}-fold rotary reflection"])

    def _reversals(self, reversal: str) -> tuple[int, int]:
        """Return the numbers of mirrors and of two-fold axes that are kept."""
        if self._order % 2:
            return self.repeats // 2, self.repeats // 2
        return (self.repeats, 0) if reversal == "mirror" else (0, self.repeats)


def _counted(number: int, one: str, several: str) -> str:
    return f"one {one}" if number == 1 else f"{number} {several}" if number else ""
