"""Piecewise polynomials with fixed knots: tables of measured data and splines, as operations of a tape."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from contin.arrays import Array


@dataclass(frozen=True)
class Table:
    """A piecewise polynomial of one number.

    Attributes
    ----------
    breaks : tuple of float
        m places, increasing. Piece j holds from break j - 1 (included) to break j.
    origins : tuple of float
        Of the m + 1 pieces: powers are of x - origin.
    coefficients : tuple of tuple of float
        Of each piece, the highest power first.
    """

    breaks: tuple[float, ...]
    origins: tuple[float, ...]
    coefficients: tuple[tuple[float, ...], ...]

    @classmethod
    def linear(cls, x: object, y: object, left: float | None = None, right: float | None = None) -> Table:
        """Return the interpolation of `numpy.interp`: constant outside."""
        x, y = np.asarray(x, dtype=float), np.asarray(y, dtype=float)
        slopes = np.diff(y) / np.diff(x)
        first, last = (y[0] if left is None else left), (y[-1] if right is None else right)
        rows = [(0.0, first), *zip(slopes, y[:-1]), (0.0, last)]
        return cls(tuple(x.tolist()), (x[0].item(), *x.tolist()), tuple((float(a), float(b)) for a, b in rows))

    @classmethod
    def piecewise(cls, knots: object, coefficients: object) -> Table:
        """Return a polynomial of SciPy's kind (``PPoly``): coefficients (order, pieces), the first and last piece continued."""
        knots = np.asarray(knots, dtype=float)
        rows = np.asarray(coefficients, dtype=float).T
        return cls(tuple(knots[1:-1].tolist()), tuple(knots[:-1].tolist()), tuple(map(tuple, rows.tolist())))

    def derivative(self) -> Table:
        """Return the derivative; at a kink the one on the right."""
        powers = range(len(self.coefficients[0]) - 1, 0, -1)
        rows = tuple(tuple(c * k for c, k in zip(row, powers)) or (0.0,) for row in self.coefficients)
        return Table(self.breaks, self.origins, rows)

    def evaluate(self, x: float) -> float:
        """Return the value at a number."""
        piece = int(np.searchsorted(self.breaks, x, side="right"))
        return float(np.polyval(self.coefficients[piece], x - self.origins[piece]))

    def numbers(self) -> Array:
        """Return the table as the interpreter reads it."""
        head = [len(self.breaks), len(self.coefficients[0])]
        return np.array([*head, *self.breaks, *self.origins, *(c for row in self.coefficients for c in row)], dtype=float)
