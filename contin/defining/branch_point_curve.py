"""The extended system of a curve of branch points in two parameters: F + beta psi = 0 and g = 0, with beta unknown.

The two numbers g are those of `contin.events.bordered`. It is the curve of points where two branches cross on the unfolded
problem; beta stays zero where the bifurcation is perfect (a symmetry, a trivial branch).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from contin.arrays import Array
from contin.core.system import System
from contin.core.trial import Event
from contin.defining.extended import FITS, Borders, Extended, cosine
from contin.defining.fold_curve import shrinking
from contin.events.bordered import BorderedMatrix
from contin.events.branch_point import locate_branch_point
from contin.linalg.factors import Factors


class BranchPointCurve(Extended):
    """F + beta psi = 0 with both g zero; unknowns [those of ``base`` | beta].

    Parameters
    ----------
    base : System
        With one free parameter more than a curve of solutions needs: the last one is the second parameter.
    """

    kind = "BP"

    def __init__(self, base: System, borders: Borders | None = None) -> None:
        super().__init__(base, borders)
        self.size = base.size + 1
        self.equations = base.equations + 2
        self.weights = np.append(base.weights, 1.0)

    def on(self, base: System) -> BranchPointCurve:
        """Return the extended system of another underlying one, with borders of its own."""
        return BranchPointCurve(base)

    def _bordered(self, x: Array) -> tuple[System, Array, BorderedMatrix]:
        """Return the system with the second parameter held, its x, and the bordered matrix."""
        system, inside = self.base.with_free(self.base.free[:-1], x[: self.base.size])
        if self.borders is None:
            found = locate_branch_point(system, inside)
            self.borders = (found.kernel, found.left)
        return system, inside, BorderedMatrix(system, inside, *self.borders)

    def borders_fit(self, x: Array) -> bool:
        """Return whether kernel and left null vector have not turned away from the borders."""
        system, _, matrix = self._bordered(x)
        longest = max(np.sqrt((system.weights * v) @ v) for v in matrix.kernel)  # 1 where the kernel lies along its border
        return not min(1 / longest, cosine(self.borders[1], matrix.multipliers())) < FITS

    def residual(self, x: Array) -> Array:
        """Return F + beta psi, and g."""
        system, inside, matrix = self._bordered(x)
        return np.concatenate([system.residual(inside) + x[-1] * self.borders[1], matrix.g])

    def linearize(
        self, x: Array, rows: Sequence[Array] | Array = (), columns: Sequence[Array] | Array = ()
    ) -> tuple[Array, Factors]:
        """Return the residual and the factored bordered matrix, with the gradients of g, -w.F_xy v."""
        base, y = self.base, x[: self.base.size]
        _, _, matrix = self._bordered(x)
        w = matrix.multipliers()
        gradients = []
        for v in matrix.kernel:
            wide = np.append(v, 0.0)  # the second parameter does not move along the kernel
            gradients.append(np.append(-base.bent(y, w, wide), 0.0))
        rows, columns = self.shaped(rows, columns)
        top = np.hstack([np.array(gradients), columns[:, -2:].T])
        psi = self.borders[1]
        residual, factors = base.linearize(y, np.vstack([top, rows]), np.vstack([psi, columns[:, :-2]]))
        return np.concatenate([residual + x[-1] * psi, matrix.g]), factors

    def events(self) -> list[Event]:
        """Return that of the end where cycles shrink onto an equilibrium."""
        return shrinking(self.base)
