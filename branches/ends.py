"""Checks of the ends of a branch against the law and the linear theory, which the engine does not know."""

from __future__ import annotations

import dataclasses
import math

import numpy as np

from branches.advice import no_state
from branches.config import Config
from contin import Point, Reason
from contin.lowlevel import Continuation, Stop
from ribbon_model import convexity
from ribbon_model.laws import LAWS
from ribbon_model.linear import covering, thresholds
from ribbon_model.solution import Solution

#: An end on a circle differs from the linear theory by at most ten times its error estimate, or by this, relative
#: to 1 + its size: ends are known to 1e-11 and better, and other bifurcations of the circle are farther away.
_ESTIMATES, _SAME = 10, 1e-7
#: If the equations have no value a step further, a smaller margin of convexity means the end of the law: the response
#: is found down to about 1e-2. With 0.5 another failure could be taken for the end of the law.
_NEARLY_CONVEX = 0.1


def checked(point: Point, run: Continuation, config: Config) -> Point:
    """Return a point of a run; an end on a circle that is not in the linear theory is named "possible".

    The run's stop then says so. If the end of the law stopped the run, the stop gives that reason.
    """
    if point.label == "MX":
        run.stop = _explained(run, config)
    if point.name != "trivial branch" or config.origin is not None:
        return point
    index = covering(LAWS[config.law], config.parameters, point["kappa_n"], point["kappa_star"], point["energy"])
    if is_threshold(config, index, point["kappa_n"], point.errors.get("kappa_n", math.nan)):
        return point
    run.stop = Stop(
        Reason.NO_CONVERGENCE,
        f"M2 = 0 at kappa_n = {point['kappa_n']:.10g}, where the mode n = {config.n} has no bifurcation of the "
        f"{abs(index)}-covered circle",
        "smaller steps may help (steps.largest)",
    )
    return dataclasses.replace(point, label="MX", name="possible trivial branch")


def is_threshold(config: Config, index: int, kappa_n: float, error: float) -> bool:
    """Return whether the linear theory has a bifurcation of the scene's mode at kappa_n, within its error estimate.

    ``index`` is the covering index of the circle, negative if it is curled against its natural curvature.
    """
    try:
        known = thresholds(LAWS[config.law], index, config.n, config.parameters)
    except (ValueError, ZeroDivisionError):
        return False
    allowed = max(_SAME * (1 + abs(kappa_n)), 0.0 if math.isnan(error) else _ESTIMATES * error)
    return min(abs(value - kappa_n) for value in known) <= allowed


def _explained(run: Continuation, config: Config) -> Stop | None:
    """Return why a run failed: the end of the law, or that no state was found, with what to change."""
    margin, state, stop = convexity.margin(LAWS[config.law]), run.state, run.stop
    if stop is None or stop.reason != Reason.NO_CONVERGENCE:
        return stop
    value = Solution.at(state.system, state.x).parameters["kappa_n"]
    finite = np.all(np.isfinite(state.system.residual(run.predicted(run.settings.min_step))))
    left = math.inf if margin is None or finite else margin(state.system, state.x)
    if left > _NEARLY_CONVEX:
        return no_state(run, f"kappa_n = {value:.6g}")
    return Stop(
        Reason.NO_CONVERGENCE,
        f"the law has no response beyond kappa_n = {value:.6g}: its strain energy loses its convexity close by "
        f"(det D2U / (U_11 U_33) has fallen to {left:.2g})",
    )
