"""Protocol of a factored square matrix."""

from __future__ import annotations

from typing import Protocol

from contin.arrays import Array


class Factors(Protocol):
    """A factored square matrix J: solves with it and with its transpose, for one right-hand side or for several as rows."""

    @property
    def sign(self) -> float:
        """Sign of the determinant."""

    def solve(self, b: Array) -> Array:
        """Return the x with J x = b."""

    def solve_transposed(self, c: Array) -> Array:
        """Return the y with J^T y = c."""
