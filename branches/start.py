"""The start of the branch of a scene, and the settings of its run."""

from __future__ import annotations

import dataclasses

from branches.config import Config, ConfigError
from contin import ContinError, ConvergenceError, MeshControl, Newton, Settings
from contin.lowlevel import Continuation, Stop
from ribbon_model.domains import CELL, DOMAINS, HALF_LOOP
from ribbon_model.laws import LAWS, TwoBendings
from ribbon_model.secondary import force, secondary_branch
from ribbon_model.seeds import half_loop_branch, primary_branch
from ribbon_model.solution import Solution

#: The first points of primary branches, by domain.
_SEEDS = {CELL.name: primary_branch, HALF_LOOP.name: half_loop_branch}
#: A smaller force counts as zero: on branches that leave a primary branch |R| is of order one.
_NO_FORCE = 1e-7
#: With less force than this, an extremum of kappa_n belongs to the pitchfork on the primary branch and is not a fold.
_BESIDE = 1e-2
#: Two points with the same kappa_n are equal if kappa* differs by less than this, relative to 1 + its size.
_SAME_PLACE = 1e-6


def settings_of(config: Config, events=()) -> Settings:
    """Return the engine's settings for a scene, with further test functions."""
    mesh, steps = config.mesh, config.steps
    # near a bifurcation that the branch leaves slowly, round-off moves solutions by this much along the kernel
    newton = Newton(1e-8) if config.origin else Newton()
    return Settings(
        primary="kappa_n", step=steps.first_step, min_step=steps.smallest, max_step=steps.largest,
        max_points=steps.max_points, angle=steps.angle, limits=config.limits, zeros=config.zeros, errors=True,
        trivial=None if config.origin else "M2", events=events, newton=newton,
        mesh=MeshControl(mesh.tolerance, min(8, mesh.max_intervals), mesh.max_intervals, mesh.adapt_every),
    )  # fmt: skip


def seed(config: Config):
    """Return system, first point and tangent of a scene's branch.

    Raises
    ------
    ConfigError
        The first mesh is too coarse to resolve the mode, or resolves another one; or the origin is invalid.
    """
    if config.origin:
        return _leave_primary(config)
    coarse = ConfigError(
        f"mesh: {config.mesh.intervals} intervals of degree {config.mesh.degree} do not resolve the mode "
        f"(m, n) = ({config.m}, {config.n}) on the {config.domain}; take more intervals"
    )
    try:
        system, x, tangent = _SEEDS[config.domain](
            LAWS[config.law], config.m, config.n, config.parameters, config.mesh.intervals, config.mesh.degree
        )
    except TwoBendings as error:
        raise ConfigError(f"n: {error}") from error
    except (ConvergenceError, ValueError) as error:
        raise coarse from error
    expected = config.at_bifurcation()["kappa_n"]
    if abs(x[system.parameter_index("kappa_n")] - expected) > 1e-4 * (1 + abs(expected)):
        raise coarse
    return system, x, tangent


# --- secondary branches ---------------------------------------------------------------------------------------------


class UntilPrimary(Continuation):
    """A run along a secondary branch that ends where it meets a primary branch: at a branch point with R = 0.

    Beyond it the branch would be its own image.
    """

    def __iter__(self):
        for point in super().__iter__():
            if point.label == "LP" and force(point) < _BESIDE:
                continue
            if point.name != "start" and point.is_simple_branch_point and force(point) < _NO_FORCE:
                self.stop = Stop("primary branch", "reached a primary branch, where R = 0")
                point = dataclasses.replace(point, label="EP", name="primary branch")
            yield point
            if self.stop is not None:
                return


def _leave_primary(config: Config):
    """Return system, first point and tangent of a secondary branch; the primary branch is followed to the origin.

    Raises
    ------
    ConfigError
        The primary branch does not pass through the origin, or no branch leaves it there.
    """
    solution = Solution.of(_at_origin(config))
    try:
        return secondary_branch(solution, DOMAINS[config.domain])
    except (ContinError, ValueError) as error:
        raise ConfigError(f"origin: {error}") from error


def _at_origin(config: Config):
    """Return the point of the primary branch."""
    origin = config.origin
    primary = Config(law=config.law, nu=config.nu, Gamma=config.Gamma, m=config.m, n=config.n, mesh=config.mesh)
    reach = 10 * (1 + max(abs(origin.kappa_n), abs(primary.at_bifurcation()["kappa_n"])))
    primary = primary.model_copy(update={"limits": {"kappa_n": (-reach, reach)}, "zeros": {"kappa_n": [origin.kappa_n]}})
    system, x, tangent = seed(primary)
    for point in Continuation(system, x, settings_of(primary), tangent):
        same = abs(point["kappa_star"] - origin.kappa_star) < _SAME_PLACE * (1 + abs(origin.kappa_star))
        if point.label == "UZ" and same:
            return point
    raise ConfigError(
        f"origin: kappa_n = {origin.kappa_n:.10g}, kappa_star = {origin.kappa_star:.10g} is not on the branch "
        f"(m, n) = ({config.m}, {config.n})"
    )
