"""The discretization error of a corrected point, estimated on the mesh halved.

    z = the point on the finer mesh;  F(z), [F_x; row] there;  one Newton update: what the finer solution differs by

Its largest difference in what is observed (`System.observed`: states and their rates at the mesh points, free parameters,
integrals), relative to 1 + size, is the estimate. The error of the finer mesh is smaller by 2^(2 d), 16 to 65536. A second
update tells whether the first is one: where it is about as large, both are round-off.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from contin.arrays import Array
from contin.discretization.protocol import Discretization

#: A second update that is this part of the first or more: both are round-off of the equations, or far from convergence.
_REPEATED = 0.3
#: Largest estimate, relative to 1 + size, that may be round-off.
_ROUND_OFF = 1e-8


@dataclass(frozen=True)
class Accuracy:
    """The estimated discretization error of a point, relative to 1 + size; NaN where it is not known, 0 without a mesh.

    ``is_round_off``: a finer mesh would not make it smaller.
    """

    error: float
    is_round_off: bool = False


def accuracy_of(system: Discretization, x: Array, tangent: Array, wanted: float) -> Accuracy:
    """Return the estimated discretization error of a point of a curve, moved to a finer mesh across its tangent.

    Only where it is larger than ``wanted`` a second update tells whether it is round-off.
    """
    finer: Any = system.refined()
    if finer is None:
        return Accuracy(0.0)
    fine, carry = finer
    with np.errstate(all="ignore"):
        z, row = carry(x), fine.weights * carry(tangent)
        if not np.all(np.isfinite(row)):
            return Accuracy(np.nan)
        residual, factors = fine.linearize(z, (row,))
        better = z - factors.solve(np.append(residual, 0.0))
        error = _difference(system, x, fine, better)
        if not wanted < error < _ROUND_OFF:
            return Accuracy(error)
        again = factors.solve(np.append(fine.residual(better), 0.0))
        left = float(np.max(np.abs(again) / (1 + np.abs(better)), initial=0.0))
    return Accuracy(error, is_round_off=left > _REPEATED * error)


def _difference(system: Discretization, x: Array, fine: Discretization, better: Array) -> float:
    """Return the largest difference between what is observed on two meshes, relative to 1 + size."""
    values, other = system.observed(x), fine.observed(better, every=2)
    sizes = system.observed_sizes(x, values)
    known = np.isfinite(values) & np.isfinite(sizes)  # rates may have no value at the ends, as u / r at r = 0
    if not np.all(np.isfinite(other[known])):
        return np.nan
    return float(np.max(np.abs(other - values)[known] / sizes[known], initial=0.0))
