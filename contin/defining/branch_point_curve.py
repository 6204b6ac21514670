"""The defining system of a curve of branch points in two parameters: F + beta psi = 0 and g = 0, with beta unknown.

                                     x     mu    beta
                                  [ F_x   F_mu   psi ]
                                  [    dg_1       0  ]     dg_i = -w.F_xy v_i
                                  [    dg_2       0  ]

The two numbers g are those of `contin.events.bordered`. It is the curve of points where two branches cross on the unfolded
problem; beta stays zero where the bifurcation is perfect (a symmetry, a trivial branch).
"""

from __future__ import annotations

import numpy as np

from contin.arrays import Array
from contin.core.labels import Label
from contin.defining.system import Defining
from contin.events.bordered import BorderedMatrix, borders_at


class BranchPointCurve(Defining):
    """F + beta psi = 0 with both g zero; unknowns [those of ``base`` | beta].

    Parameters
    ----------
    base : System
        With one free parameter more than a curve of solutions needs: the last one is the second parameter.
    """

    kind = Label.BRANCH_POINT
    own_equations, own_unknowns = 2, 1

    def computed(self, x: Array) -> BorderedMatrix:
        """Return the bordered matrix, with the second parameter held."""
        system, inside = self.base.with_free(self.base.free[:-1], self.inside(x))
        if self.borders is None:
            self.borders = borders_at(system, inside)
        return BorderedMatrix(system, inside, *self.borders)

    def borders_fit(self, x: Array) -> bool:
        """Return whether the kernel and its multipliers have not turned away from the borders."""
        found: BorderedMatrix = self.at(x)
        return found.fits

    def own_values(self, x: Array) -> Array:
        """Return g."""
        found: BorderedMatrix = self.at(x)
        return found.g

    def own_gradients(self, x: Array) -> Array:
        """Return dg/dx; the second parameter does not move along the kernel."""
        found: BorderedMatrix = self.at(x)
        y, w = self.inside(x), found.multipliers()
        return np.array([np.append(-self.base.bent(y, w, np.append(v, 0.0)), 0.0) for v in found.kernel])

    def own_vectors(self, x: Array) -> Array:
        """Return psi."""
        found: BorderedMatrix = self.at(x)
        return found.borders[1][None]
