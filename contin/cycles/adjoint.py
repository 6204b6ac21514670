"""The adjoint of a cycle: how much earlier the motion arrives, for good, after a small perturbation of each state.

On the unit interval, the part of the cycle that is computed (one n-th of it, with a symmetry), y' = G(y, T) with y the states
divided by their sizes. With M the matrix of the discrete equations, the period T being the only free parameter, the steps are

    1. M^T w = e_T: a source g in the equations at the Gauss points changes the period by the sum of h w_q.g_q;
    2. Z = -w / (n b) at the Gauss points, b their weights: being early by Z.g for each source makes the period shorter;
    3. Z at the first node, from the column of M of that node in the first interval;
    4. Z at all nodes, interval by interval: the polynomial of degree d with Z' = -G_y^T Z at the Gauss points.

Step 3 and the rows of M^T w = e_T say that the end of each polynomial is the beginning of the next one, and that Z is periodic.
Z.F = 1 in the mean at the Gauss points, as the row of the period in M^T w = e_T says.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from contin.arrays import Array
from contin.problems.own_names import PERIOD


def adjoint(system: Any, x: Array) -> Array:
    """Return Z with Z' = -F_u^T Z and Z.F = 1 at the nodes of an autonomous cycle, in the user's units, shape (K, n)."""
    system, x = system.with_free([PERIOD], x)
    n, d, count = system.states_count, system.degree, system.intervals
    unit = np.zeros(system.size)
    unit[system.parameter_index(PERIOD)] = 1.0
    with np.errstate(all="ignore"):
        sources = system.linearize(x)[1].solve_transposed(unit)[: count * d * n].reshape(count, d, n)
    to_period = system.free_scales[0] / system.order
    z = -to_period * sources / system.basis.weights[:, None]
    turned = np.einsum("jqab,jqa->jqb", system.rates_by_states(x, system.at_gauss_points(x)).reshape(count, d, n, n), z)
    turned *= np.diff(system.mesh)[:, None, None]
    basis = system.basis
    weighted = basis.weights[:, None]
    found = np.empty((count * d + 1, n))
    found[0] = basis.value[:, 0] @ (weighted * turned[0]) - basis.slope[:, 0] @ (weighted * z[0])
    inverse = np.linalg.inv(basis.slope[:, 1:])
    for j in range(count):
        found[j * d + 1 : (j + 1) * d + 1] = inverse @ (-turned[j] - np.outer(basis.slope[:, 0], found[j * d]))
    return found / system.scales.states
