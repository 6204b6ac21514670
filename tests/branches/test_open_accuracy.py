"""Open strips: limits of stages, dimensions with other laws, and errors of forces, moments and energies."""

import dataclasses
import math

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq
from scipy.special import ellipk, ellipkinc

import contin
from branches.read import read_branch
from branches.run.display import Display
from branches.run.runner import run_scene
from branches.scene.fields import ConfigError
from branches.scene.open_stage import first_state
from branches.scene.parse import parse
from branches.scene.stage import errors_of
from ribbon_model.open_strip import REACTIONS

DIMENSIONS = "{width: 0.01, thickness: 0.0005, length: 0.4, poisson_ratio: 0.3, youngs_modulus: 200.0e9}"


def followed(text, tmp_path, settings=()):
    path = tmp_path / "scene.h5"
    outcome = run_scene(parse(text, "scene", list(settings)), path, Display(silent=True), overwrite=True)
    return outcome, read_branch(path)


# --- limits -------------------------------------------------------------------------------------------------------------------

ARCH = "material: {law: flat rod, nu: 0.3}\nnumbers: {distance: 0.95}\nbegin: arch\n"


@pytest.mark.sample(1)
@pytest.mark.parametrize(
    ("stages", "sentence"),
    [
        (
            "[{follow: distance, to: 0.9, limits: {distance: [0.5, 0.94]}}]",
            "stage 1: limits: distance = 0.95 at the start of the stage is outside its limits, 0.5 to 0.94; widen them",
        ),
        ("[{follow: distance, to: 0.9, limits: {energy: [5, 6]}}]", "is outside its limits, 5 to 6"),
        ("[{follow: turn, to: 1, limits: {rise: [0.1, 1]}}]", "stage 1: limits: rise = 0 at the start"),
    ],
)
def test_a_first_stage_that_starts_outside_its_limits_is_refused(stages, sentence, tmp_path):
    """It gave one point and the exit code 0."""
    with pytest.raises(ConfigError, match=".*") as caught:
        followed(f"{ARCH}stages: {stages}\n", tmp_path)
    assert sentence in str(caught.value)


@pytest.mark.full
def test_a_later_stage_that_starts_outside_its_limits_ends_the_run(tmp_path):
    scene = f"{ARCH}stages: [{{follow: distance, to: 0.9}}, {{follow: turn, to: 1, limits: {{distance: [0.92, 1]}}}}]\n"
    outcome, branch = followed(scene, tmp_path)
    assert outcome == "lost" and "stage 2: limits: distance = 0.9 at the start of the stage is outside" in branch.stop


def test_limits_are_told_in_the_scene_s_units(tmp_path):
    scene = f"material: {{}}\ndimensions: {DIMENSIONS}\nnumbers: {{distance: 0.39}}\nbegin: arch\n"
    with pytest.raises(ConfigError, match="distance = 0.39 m at the start of the stage is outside its limits, 0.1 to 0.2 m"):
        followed(f"{scene}stages: [{{follow: distance, to: 0.3, limits: {{distance: [0.1, 0.2]}}}}]\n", tmp_path)


@pytest.mark.full
def test_a_stage_starts_at_its_limit(tmp_path):
    """A stage that begins where another one has stopped is within limits that end there."""
    scene = f"{ARCH}stages: [{{follow: distance, to: 0.9}}, {{follow: distance, to: 0.93, limits: {{distance: [0.9, 1]}}}}]\n"
    outcome, branch = followed(scene, tmp_path)
    assert outcome == "complete" and len(branch.points[branch.points["stage"] == 2]) > 2


@pytest.mark.parametrize("limits", [{"a": (2, 3)}, {"h": (5.0, 9.0)}, {"a": (-3, 0.5)}])
def test_a_branch_that_starts_outside_its_limits_is_refused(limits):
    line = contin.AlgebraicProblem(
        lambda u, p: (u.x - p.a,), ["x"], {"a": 1.0, "b": 0.0}, functionals={"h": lambda u, p: u.x**2}
    )
    start = contin.solve(line, [1.0])
    with pytest.raises(contin.ProblemError, match="limits: [ah] = 1 at the start lies outside .*; widen them"):
        contin.trace(start, free=["a"], limits=limits)
    assert len(contin.trace(start, free=["a"], limits={"a": (1, 2)})) > 1  # at a limit is inside


def test_a_curve_in_two_parameters_that_starts_outside_its_limits_is_refused():
    cusp = contin.AlgebraicProblem(lambda u, p: (p.b + p.a * u.x - u.x**3,), ["x"], {"a": 1.0, "b": 0.0})
    fold = contin.trace(contin.solve(cusp, [1.0]), free=["b"], direction=-1, limits={"b": (-2, 2)}).labelled("LP")[0]
    with pytest.raises(contin.ProblemError, match="limits: a = 1 at the start lies outside"):
        contin.curve(fold, "a", limits={"a": (2, 3)})


# --- dimensions ---------------------------------------------------------------------------------------------------------------


@pytest.mark.sample(1)
@pytest.mark.parametrize(
    ("law", "modulus"),
    [("flat rod", 200e9 * 0.01 * 0.0005**3 / 12), ("ribbon", 200e9 * 0.01 * 0.0005**3 / 12 / (1 - 0.09)), ("", None)],
)
def test_dimensions_go_with_the_laws_of_flat_strips(law, modulus, tmp_path):
    """Buckling of a cantilever at -(pi/2)^2 B/L^2: B of a narrow strip is E w h^3/12; of a developable one, over 1 - nu^2."""
    material = f"{{law: {law}, kappa_n: 0.001}}" if law == "ribbon" else f"{{law: {law}}}" if law else "{}"
    scene = f"material: {material}\ndimensions: {DIMENSIONS}\nfinish: free\n"
    if law == "ribbon":
        scene = scene.replace("kappa_n: 0.001", "kappa_n: 5")
        config = parse(f"{scene}stages: [{{follow: force_tangent, to: -0.1}}]\n", "s")
        assert config.modulus == pytest.approx(modulus, rel=1e-14)
        assert config.strip().section.numbers["nu"] == 0.3 and config.strip().section.numbers["kappa_n"] == pytest.approx(2)
        return
    _, branch = followed(f"{scene}stages: [{{follow: force_tangent, to: -0.5}}]\n", tmp_path)
    loads = [event["force_tangent"] for event in branch.events if event["label"] == b"BP"]
    if modulus is None:
        modulus = 200e9 * 0.01 * 0.0005**3 / 12  # finite width: a flat strip is free to bend across to first order
    assert loads[0] * branch.scene.factor("force_tangent") == pytest.approx(-(math.pi**2) / 4 * modulus / 0.4**2, rel=1e-9)


def test_a_law_that_has_no_dimensions_is_named():
    with pytest.raises(ConfigError, match="law: 'isotropic rod' must be one of finite width, flat rod, ribbon together"):
        parse(f"material: {{law: isotropic rod}}\ndimensions: {DIMENSIONS}\nstages: [{{follow: turn, to: 1}}]\n", "s")


# --- errors -------------------------------------------------------------------------------------------------------------------


def elastica(F):
    """Return tip displacement along the tangent, moment at the clamp and energy of a column, compressed by F at its free end.

    theta' = sqrt(2 F) sqrt(cos(theta) - cos(alpha)); alpha by the length, ellipk(sin(alpha/2)^2) = sqrt(F).
    """
    m = brentq(lambda m: ellipk(m) - math.sqrt(F), 1e-9, 1 - 1e-9, xtol=1e-15)
    assert ellipkinc(math.pi / 2, m) == pytest.approx(math.sqrt(F))
    energy = quad(lambda phi: 2 * math.sqrt(F) * m * math.cos(phi) ** 2 / math.sqrt(1 - m * math.sin(phi) ** 2), 0, math.pi / 2)
    return 2 * math.sqrt(F * m), energy[0]


@pytest.mark.full
def test_energy_and_moment_of_the_elastica_within_their_errors(tmp_path):
    """A cantilever under a dead load, after buckling; every labelled point, on meshes of any coarseness."""
    scene = (
        "material: {law: rod, B1: 1, B2: 100, C: 1}\nfinish: free\n"
        "stages: [{follow: force_tangent, to: -4}, {follow: force_tangent, to: -8, start_at: BP 1,"
        " label: {force_tangent: [-3, -4, -5, -7], energy: [1.5]}}]\n"
    )
    checked = 0
    for settings in ((), ("mesh.degree=3", "mesh.tolerance=1e-4"), ("mesh.degree=4", "mesh.tolerance=1e-6")):
        _, branch = followed(scene, tmp_path, settings)
        for event in branch.events[branch.events["stage"] == 2]:
            if event["label"] == b"BP":
                continue
            moment, energy = elastica(-event["force_tangent"])
            slack = 2e-12  # of the quadrature
            assert abs(abs(event["start_M_width"]) - moment) <= event["error_start_M_width"] + slack
            assert abs(event["energy"] - energy) <= event["error_energy"] + slack
            assert event["error_energy"] < 1e-3
            checked += 1
    assert checked >= 12


@pytest.mark.full
def test_errors_at_folds_and_branch_points_cover_the_difference_to_a_finer_run(tmp_path):
    """A clamped strip that is turned: two branch points and two folds; the finer run has degree 8 and a tolerance of 1e-12."""
    scene = (
        "material: {law: flat rod, nu: 0.3}\nnumbers: {distance: 0.98}\nbegin: arch\nstages:\n"
        "  - {follow: distance, to: 0.75}\n  - {follow: turn, to: 6.283185307179586}\n"
        "  - {follow: turn, to: 6.283185307179586, stage: 2, start_at: BP 1, limits: {turn: [-0.5, 6.3]}}\n"
    )
    _, fine = followed(scene, tmp_path, ("mesh.degree=8", "mesh.tolerance=1e-11"))
    _, coarse = followed(scene, tmp_path, ("mesh.degree=5", "mesh.tolerance=1e-7"))
    pairs = [list(branch.events[np.isin(branch.events["label"], [b"LP", b"BP"])]) for branch in (coarse, fine)]
    assert [event["label"] for event in pairs[0]] == [event["label"] for event in pairs[1]]
    for one, best in zip(*pairs):
        for name in ("energy", "potential", *REACTIONS):
            error, difference = one[f"error_{name}"], abs(one[name]) - abs(best[name])  # the mirror image has other signs
            assert abs(difference) <= 2 * error + best[f"error_{name}"] + 1e-10
    errors = [event["error_energy"] for event in pairs[0]]
    assert len(errors) >= 4 and np.isfinite(errors).all()


def test_a_point_without_an_error_of_its_place_has_none_of_its_forces():
    """Forces at a place that is not known have no error either."""
    config = parse("material: {law: flat rod, nu: 0.3}\nfinish: free\nstages: [{follow: force_width, to: 1}]\n", "s")
    point, strip = first_state(config), config.strip()
    system, x = point.system.with_free(("force_width", *strip.problem.multipliers), point.x)
    lost = dataclasses.replace(contin.lowlevel.point_of(system, x), label="LP", errors={"force_width": math.nan})
    assert all(math.isnan(error) for error in errors_of(lost, strip.reactions).values())


def test_what_newtons_method_left_counts_by_size():
    """A straight strip under tension, 2: relative to 1 + |value|, and once more to the largest force or moment."""
    stages = "stages: [{follow: force_width, to: 1}]\n"
    config = parse(f"material: {{law: flat rod, nu: 0.3}}\nfinish: free\nnumbers: {{force_tangent: 2}}\n{stages}", "s")
    first, strip = first_state(config), config.strip()
    point = contin.lowlevel.point_of(*first.system.with_free(("force_width", *strip.problem.multipliers), first.x))
    for left in (0.0, 1e-6):
        errors = errors_of(dataclasses.replace(point, newton_error=left, errors={"force_width": 0.0}), strip.reactions)
        for name, forces in {"start_F_width": 2, "start_F_tangent": 2 + 2, "start_M_width": 0, "start_M_tangent": 0}.items():
            assert errors[name] == pytest.approx(left * (1 + forces), abs=1e-12)


@pytest.mark.full
def test_the_summary_shows_the_errors(tmp_path, capsys):
    scene = f"material: {{}}\ndimensions: {DIMENSIONS}\nnumbers: {{distance: 0.39}}\nbegin: arch\n"
    text = f"{scene}stages: [{{follow: distance, to: 0.3}}]\n"
    run_scene(parse(text, "s"), tmp_path / "s.h5", Display(quiet=True))
    line = next(line for line in capsys.readouterr().out.splitlines() if "distance = 0.3" in line)
    assert "energy = " in line and " J (± " in line and "F_tangent = -" in line and " N (± " in line
