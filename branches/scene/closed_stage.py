"""The one stage of a closed strip: from a circle, or a primary branch, to a circle, a primary branch, or a limit."""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Mapping, Sequence

import numpy as np

from branches.scene.closed import ClosedScene
from branches.scene.columns import FOUND, NUMBER, Column, Columns, error_of
from branches.scene.fields import ConfigError, StepConfig
from branches.scene.labels import PRIMARY, START, TRIVIAL, label_of
from branches.scene.stage import Stage, errors_of, no_state
from contin import ContinError, ConvergenceError, MeshControl, Newton, Point, Reason, Settings
from contin.lowlevel import Collocation, Continuation, Label, State, Stop, exact_text, levels
from ribbon_model import law_end
from ribbon_model.domains import CELL, DOMAINS, HALF_LOOP
from ribbon_model.law_end import NEARLY_ENDED
from ribbon_model.laws import LAWS, TwoBendings
from ribbon_model.linear import covering, thresholds
from ribbon_model.seeds import force, half_loop_branch, primary_branch, secondary_branch

#: The first points of primary branches, by domain.
_SEEDS = {CELL.name: primary_branch, HALF_LOOP.name: half_loop_branch}
#: With less force than this, an extremum of kappa_n belongs to the pitchfork on the primary branch and is not a fold.
_BESIDE = 1e-2
#: Words of the columns, and those of axes with the unit that a number is over. The same name may mean another thing in open
#: strips: lengths are over L / 2 pi here, and the energy is a mean over the loop.
_WORDS = {
    "kappa_n": ("natural curvature kappa_n L / 2 pi (dimensionless)", "natural curvature κₙL/2π", "κₙ L/2π"),
    "kappa_star": ("conjugate curvature of equation (28), mean of dH/dkappa_n (dimensionless)", "conjugate curvature κ*", "κ*"),
    "energy": ("strain energy / (2 pi B / L), without the constant kappa_n^2 / 2", "energy, in units 2πB/L", "energy"),
    "nu": ("Poisson's ratio", "Poisson's ratio"),
    "Gamma": ("w^2 / (h L / 2 pi) of the law finite width, w the width and h the thickness", "Γ"),
    "M1": ("moment about d1 at S = 0, in units of B 2 pi / L", "moment M₁"),
    "M2": ("moment about d2 at S = 0; zero on a planar circle", "moment M₂"),
    "M3": ("moment about d3 at S = 0", "moment M₃"),
    "R1": ("force along d1 at S = 0, in units of B (2 pi / L)^2", "force R₁"),
    "R2": ("force along d2 at S = 0", "force R₂"),
    "R3": ("force along d3 at S = 0", "force R₃"),
    "length": ("length of the domain, in units of L / 2 pi", "length of the domain"),
    "axes": ("1: the ends of the half loop are two-fold axes along d2, not mirrors", ""),
    "turn": ("angle by which d2 turns about the moment over the cell", ""),
    "sense": ("sign of the moment on the circle", ""),
    "unfold": ("unfolding parameter of closure, zero", ""),
}  # fmt: skip


_ELASTIC = Column(
    "elastic", "strain energy / (2 pi B / L)", role=FOUND, axis="elastic energy (energy + κₙ²/2), in units 2πB/L",
    brief="elastic energy", derived=lambda points: points["energy"] + points["kappa_n"] ** 2 / 2,
)  # fmt: skip


class ClosedStage(Stage):
    """The branch of a closed scene."""

    number, follow, conjugate, units = 1, "kappa_n", "kappa_star", "bending modulus B = 1, length L = 2 pi"
    head = "       kappa_n      kappa_star          energy      step   N  it"

    def __init__(self, scene: ClosedScene):
        self.scene, self.law, domain = scene, LAWS[scene.law], DOMAINS[scene.domain]
        self.problem, self.free, self.watch = domain.problem(self.law), domain.free, None
        self.title = "kappa_n in 1/m, energy in J\n" if scene.strip else ""

    # --- the run --------------------------------------------------------------------------------------------------------

    def start(self, earlier: Sequence[Sequence[Point]] = ()) -> Continuation:
        system, x, tangent = seed(self.scene)
        return Continuation(system, x, self._settings(system, x), tangent)

    def resume(self, state: State, first: tuple[Collocation, np.ndarray, np.ndarray], earlier) -> Continuation:
        return Continuation(state.system, state.x, self._settings(*first[:2]), state=state, start=first)

    def _settings(self, system: Collocation, x: np.ndarray) -> Settings:
        """Return the settings of a run with this first point, which decides the symmetry that the index watches."""
        events = law_end.closed_tests(self.law)
        if self.scene.stability:
            from branches.scene.index import SymmetryWatch  # eigenvalues, which nobody asked for otherwise

            self.watch = SymmetryWatch(self.law, system, x, from_circle=self.scene.origin is None)
            events = [*self.watch.monitors, *events]
        return settings_of(self.scene, events)

    def outside(self, last: Mapping[str, float]) -> str:
        for name, (low, high) in self.scene.limits.items():
            if not low < last[name] < high:
                ends = f"{exact_text(low)}, {exact_text(high)}"
                return f"limits: {name}: {ends} must contain the last point of the file, {name} = {last[name]:.10g}"
        return ""

    def judge(self, point: Point, run: Continuation) -> Point | None:
        """A secondary branch ends where it meets a primary one: beyond it it would be its own image.

        The fold of kappa_n beside that point belongs to the pitchfork. An end on a circle that is not in the linear theory is
        named "possible".
        """
        if point.label == Label.FAILED:
            run.stop = self._explained(run)
        if self.scene.origin is not None:
            if point.label == Label.FOLD and force(point) < _BESIDE:
                return None
            if point.name == START or not point.is_simple_branch_point or force(point) >= levels.APART:
                return point
            run.stop = Stop(PRIMARY, "reached a primary branch, where R = 0")
            return dataclasses.replace(point, label=Label.END, name=PRIMARY)
        if point.name != TRIVIAL:
            return point
        index = covering(self.law, self.scene.law_parameters, point["kappa_n"], point["kappa_star"], point["energy"])
        if is_threshold(self.scene, index, point["kappa_n"], point.errors.get("kappa_n", math.nan)):
            return point
        run.stop = Stop(
            Reason.NO_CONVERGENCE,
            f"M2 = 0 at kappa_n = {point['kappa_n']:.10g}, where the mode n = {self.scene.n} has no bifurcation of the "
            f"{abs(index)}-covered circle",
            "smaller steps may help (steps.largest)",
        )
        return dataclasses.replace(point, label=Label.FAILED, name="possible trivial branch")

    def told(self, run: Continuation, last: Point) -> Stop:
        return run.stop

    def ending(self, stop: Stop, outcome: str) -> Stop | None:
        """A limit is one that the scene sets, not one of the strip."""
        if stop.reason == Reason.TRIVIAL_BRANCH:
            return None
        if stop.reason == Reason.LIMIT:
            return dataclasses.replace(stop, message=f"{stop.message}, the scene's own limit")
        return stop

    def _explained(self, run: Continuation) -> Stop:
        """Return why a run failed: the end of the law, or that no state was found, with what to change."""
        margin, state, stop = law_end.margin(self.law), run.state, run.stop
        if stop.reason != Reason.NO_CONVERGENCE:
            return stop
        value = state.system.parameter(state.x, "kappa_n")
        finite = np.all(np.isfinite(state.system.residual(run.predicted(run.settings.min_step))))
        left = math.inf if margin is None or finite else margin(state.system, state.x)
        if left > NEARLY_ENDED:
            return no_state(run, f"kappa_n = {value:.6g}")
        return Stop(
            Reason.NO_CONVERGENCE,
            f"the law has no response beyond kappa_n = {value:.6g}: its strain energy loses its convexity close by "
            f"(det D2U / (U_11 U_33) has fallen to {left:.2g})",
        )

    # --- columns --------------------------------------------------------------------------------------------------------

    @functools.cache  # noqa: B019 - a stage lives as long as its run
    def columns(self) -> Columns:
        found = [_column(name, NUMBER, error_of(name) if name in self.free else None) for name in self.problem.parameters]
        found += [_column(name, FOUND, error_of(name)) for name in self.problem.functionals]
        return Columns((*found, _ELASTIC), self.scene.stability)

    def values(self, point: Point, names: Sequence[str]) -> Mapping[str, float]:
        return {**point.parameters, **point.functionals}

    def errors(self, point: Point) -> Mapping[str, float]:
        return {**errors_of(point, lambda at: at.functionals), **point.errors}

    # --- words ----------------------------------------------------------------------------------------------------------

    def row(self, point: Point, step: float) -> str:
        values = (f"{point[name] * self.scene.factor(name):14.8f}" for name in ("kappa_n", "kappa_star", "energy"))
        return f"{'  '.join(values)}  {step:8.1e} {point.system.intervals:3d} {point.iterations:3d}"

    def describe(self, event: np.void, largest: float) -> str:
        scene = self.scene
        label, name = event["label"], event["name"].decode()
        place = f"kappa_n L/2pi = {event['kappa_n']:.10f}"
        found = name in (TRIVIAL, PRIMARY)
        held = label == b"UZ" or (label == b"EP" and not found)  # kappa_n was given, not found
        error = event["error_kappa_n"]
        certain = "" if held or math.isnan(error) else f" (± {error:.0e})"
        if scene.strip:
            certain += f", natural radius {1e3 / (event['kappa_n'] * scene.factor('kappa_n') or math.inf):.6g} mm"
        if name == START and scene.origin:
            return f"leaves the branch ({scene.m}, {scene.n}) at {place}{certain}, {scene.origin.mode}"
        if name == START:
            return f"leaves the {scene.m}-covered circle at {place}{certain}"
        if name == TRIVIAL:
            columns = (float(event[name]) for name in ("kappa_n", "kappa_star", "energy"))
            index = covering(self.law, scene.law_parameters, *columns)
            inside_out = ", curled against its natural curvature" if index < 0 else ""
            return f"ends on the {abs(index)}-covered circle{inside_out} at {place}{certain}"
        what = f" ({name})" if name and label != b"LP" else ""
        return f"{label_of(label.decode()).word}{what} at {place}{certain}, kappa* = {event['kappa_star']:.10f}"


def _column(name: str, role: str, error) -> Column:
    words, axis, *brief = _WORDS.get(name, (name, ""))
    return Column(name, words, error=error, role=role, axis=axis or name, brief=brief[0] if brief else name)


def is_threshold(scene: ClosedScene, index: int, kappa_n: float, error: float) -> bool:
    """Return whether the linear theory has a bifurcation of the scene's mode at kappa_n, within its error estimate.

    ``index`` is the covering index of the circle, negative if it is curled against its natural curvature.
    """
    try:
        known = thresholds(LAWS[scene.law], index, scene.n, scene.law_parameters)
    except (ValueError, ZeroDivisionError):
        return False
    allowed = max(levels.APART * (1 + abs(kappa_n)), 0.0 if math.isnan(error) else levels.CERTAIN * error)
    return min(abs(value - kappa_n) for value in known) <= allowed


# --- the first point --------------------------------------------------------------------------------------------------


def settings_of(scene: ClosedScene, events=()) -> Settings:
    """Return the engine's settings for a scene, with further test functions."""
    mesh, steps = scene.mesh, scene.steps
    # near a bifurcation that the branch leaves slowly, round-off moves solutions by this much along the kernel
    newton = Newton(steps.newton_tolerance or (1e-8 if scene.origin else Newton.tolerance))
    return Settings(
        primary="kappa_n", step=steps.first_step, min_step=steps.smallest, max_step=steps.largest,
        max_points=steps.max_points, angle=steps.angle, limits=scene.limits, zeros=scene.zeros, errors=True,
        trivial=None if scene.origin else "M2", events=events, newton=newton,
        mesh=MeshControl(mesh.tolerance, min(8, mesh.max_intervals), mesh.max_intervals, mesh.adapt_every),
    )  # fmt: skip


def seed(scene: ClosedScene):
    """Return system, first point and tangent of a scene's branch.

    Raises ConfigError where the first mesh is too coarse to resolve the mode, or resolves another one; or the origin is
    invalid.
    """
    if scene.origin:
        from ribbon_model.solution import Solution  # 10 ms, which other branches do not need

        try:
            return secondary_branch(Solution.of(_at_origin(scene)), DOMAINS[scene.domain])
        except (ContinError, ValueError) as error:
            raise ConfigError(f"origin: {error}") from error
    coarse = ConfigError(
        f"mesh: {scene.mesh.intervals} intervals of degree {scene.mesh.degree} do not resolve the mode "
        f"(m, n) = ({scene.m}, {scene.n}) on the {scene.domain}; take more intervals"
    )
    try:
        system, x, tangent = _SEEDS[scene.domain](
            LAWS[scene.law], scene.m, scene.n, scene.law_parameters, scene.mesh.intervals, scene.mesh.degree
        )
    except TwoBendings as error:
        raise ConfigError(f"n: {error}") from error
    except (ConvergenceError, ValueError) as error:
        raise coarse from error
    expected = scene.at_bifurcation()["kappa_n"]
    if abs(x[system.parameter_index("kappa_n")] - expected) > 1e-4 * (1 + abs(expected)):
        raise coarse
    return system, x, tangent


# --- secondary branches ---------------------------------------------------------------------------------------------


def _at_origin(scene: ClosedScene):
    """Return the point of the primary branch."""
    origin = scene.origin
    primary = scene.model_copy(update={"origin": None, "domain": CELL.name, "steps": StepConfig()})
    reach = 10 * (1 + max(abs(origin.kappa_n), abs(primary.at_bifurcation()["kappa_n"])))
    primary = primary.model_copy(update={"limits": {"kappa_n": (-reach, reach)}, "zeros": {"kappa_n": [origin.kappa_n]}})
    system, x, tangent = seed(primary)
    for point in Continuation(system, x, settings_of(primary), tangent):
        same = abs(point["kappa_star"] - origin.kappa_star) < levels.APART * (1 + abs(origin.kappa_star))
        if point.label == Label.USER_ZERO and same:
            return point
    raise ConfigError(
        f"origin: kappa_n = {origin.kappa_n:.10g}, kappa_star = {origin.kappa_star:.10g} is not on the branch "
        f"(m, n) = ({scene.m}, {scene.n})"
    )
