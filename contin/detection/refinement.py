"""Special points located again on finer meshes: their error estimates."""

from __future__ import annotations

from typing import Any

import numpy as np

from contin.arrays import Array
from contin.detection.branch_point import BranchPoint, MultiplePoint, along, locate_branch_point
from contin.discretization.protocol import Carrier, Discretization, inner
from contin.errors import ConvergenceError
from contin.stepping.settings import Settings
from contin.stepping.state import State
from contin.stepping.step import located
from contin.stepping.trial import Monitor, Trial

#: A special point on a finer mesh whose parameters moved by more than this, relative to 1 + their size, is another one.
_FAR = 0.05
#: Cosine between the kernels of a branch point on two meshes, below which they are two points.
_SAME_KERNEL = 0.9


# --- how well the mesh resolves a point -----------------------------------------------------------------------------


def refined(
    label: str, trial: Trial, details: Any, monitor: Monitor | None, settings: Settings
) -> tuple[Trial, dict[str, float], Any]:
    """The same special point on a mesh halved until its free parameters agree to the mesh tolerance.

    Without a mesh the point is found once more from where it is: what then changes is the error of its location. A point that
    is not the coarse one again (far from it, another kernel, or further off than the mesh before) is dropped.

    Returns
    -------
    trial, errors, details
        The last solution, by how much its free parameters differ from the one before (NaN where it could not be found again),
        and its details.
    """
    errors = dict.fromkeys(trial.system.free, np.nan)
    if isinstance(details, MultiplePoint):
        return trial, errors, details
    singular = isinstance(details, BranchPoint) or (label == "BP" and monitor is None)
    last = np.inf
    for _ in range(4):
        coarse = trial.system
        finer = coarse.refined()
        system, carry = finer or (coarse, np.array)
        try:
            if singular:
                better, found = _branch_point_again(system, carry, trial, details, settings)
            else:
                better, found = _again(system, carry(trial.x), carry(trial.tangent), monitor, settings), details
        except ConvergenceError:
            break
        steps = np.abs(better.x[system.state_size :] - trial.x[coarse.state_size :])
        size = 1 + np.abs(better.x[system.state_size :])
        steps = np.maximum(steps, 16 * np.finfo(float).eps * size.max())
        if np.any(steps > _FAR * size) or np.max(steps / size) > last:
            break
        errors, last = dict(zip(system.free, map(float, steps))), np.max(steps / size)
        if finer is None:
            break
        trial, details = better, found
        if np.all(steps <= settings.mesh.tolerance * size):
            break
    return trial, errors, details


def _branch_point_again(
    system: Discretization, carry: Carrier, trial: Trial, details: BranchPoint | None, settings: Settings
) -> tuple[Trial, BranchPoint]:
    """The branch point with the same kernel on another mesh, and its details; the nearest one where none are known."""
    if details is None:
        found = locate_branch_point(system, carry(trial.x), settings.newton)
        return Trial(system, found.x, carry(trial.tangent), np.nan), found
    kernel = np.array([carry(vector) for vector in details.kernel])
    found = locate_branch_point(system, carry(trial.x), settings.newton, kernel)
    overlap = found.kernel @ (system.weights * kernel[:, : system.size]).T
    if np.linalg.svd(overlap, compute_uv=False)[-1] < _SAME_KERNEL:
        raise ConvergenceError("another branch point was found on the finer mesh")
    if details.tangents:
        found = along(system, found, carry(details.tangents[0]))
    return Trial(system, found.x, carry(trial.tangent), np.nan), found


def _again(system: Discretization, x: Array, tangent: Array, monitor: Monitor | None, settings: Settings) -> Trial:
    """The zero of a monitor near x on another mesh, by the secant method along the tangent; without one, x corrected."""
    tangent = tangent / np.sqrt(inner(system, tangent, tangent))
    state = State(system, x, tangent, None, 1.0, 1.0, 1.0, 0.0, 0, False)

    def at(s: float) -> Trial:
        return located(state, x + s * tangent, s, settings.newton)

    trial = at(0.0)
    if monitor is None:
        return trial
    s, last, value = 1e-3, 0.0, monitor.function(trial)
    for _ in range(12):
        if value == 0:
            return trial
        trial, before = at(s), value
        value = monitor.function(trial)
        if abs(s - last) < 1e-9 or value == before:
            return trial
        s, last = s - value * (s - last) / (value - before), s
    raise ConvergenceError("the point was not found again on the finer mesh")
