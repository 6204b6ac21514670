"""Descents: the discrete strip against closed forms and differences, and its end against what is found without it."""

import functools
import itertools
from dataclasses import replace

import numpy as np
import pytest

from contin import Settings, trace
from contin.lowlevel import point_of
from ribbon_model import exact, second_variation
from ribbon_model.descent import METRICS, descend, identify, modes, perturbed
from ribbon_model.laws import FINITE_WIDTH, FLAT_ROD, ISOTROPIC_ROD, PAPER_LAWS, RIBBON
from ribbon_model.linear import index
from ribbon_model.seeds import primary_branch
from ribbon_model.segments import Strip, discretized
from ribbon_model.shape import quaternions
from ribbon_model.solution import Solution

NU = 0.3
LAWS = pytest.mark.parametrize("law", PAPER_LAWS.values(), ids=list(PAPER_LAWS))


def circle(law, m, kappa_n, segments=48):
    return discretized(second_variation.circle(law, NU, m, kappa_n), segments)


def irregular(law, segments=24, kappa_n=2.0):
    """A closed strip without any symmetry, and the random numbers that made it."""
    random = np.random.default_rng(1)
    strip = Strip(law, NU, kappa_n, np.tile([3.0, 0.0, 0.0], (segments, 1)))
    return strip.moved(0.3 * random.standard_normal(segments * len(strip.free))), random


def shifted(strip, change):
    """The strip with its free strains changed and not closed again."""
    strains = strip.strains.copy()
    strains[:, strip.free] += change.reshape(len(strains), -1)
    return replace(strip, strains=strains)


@functools.cache
def buckled(law, m, n, label="UZ", kappa_n=None):
    """A point of a primary branch by collocation: at kappa_n, or its first fold."""
    system, x, tangent = primary_branch(law, m, n, NU, 8, 7)
    zeros = {} if kappa_n is None else {"kappa_n": [kappa_n]}
    branch = trace(point_of(system, x), Settings(trivial="M2", limits={"kappa_n": (-20, 20)}, zeros=zeros), tangent=tangent)
    point = branch.labelled(label)[0]
    return Solution.of(point).equilibrium()


# --- energy and closure, and their derivatives ------------------------------------------------------------------------


@LAWS
def test_energy_is_the_legendre_transform_of_the_law(law):
    """At random moments: H of `laws` gives the strains, U at these must give M . omega - H, M, and the inverse of D2H."""
    random = np.random.default_rng(0)
    moment = random.uniform(-0.5, 0.5, (50, 3)) + [1.5, 0, 0]
    kappa_n = 0.7
    strain, compliance = law.linearized(moment, kappa_n, NU)
    H = np.array([law.response(*M, kappa_n, NU)[0] for M in moment])
    energy, back, stiffness = law.strain_energy(strain, kappa_n, NU)
    free = [0, 2] if law.constrained else [0, 1, 2]
    assert energy == pytest.approx(np.sum(moment[:, free] * strain[:, free], axis=1) - H, abs=1e-13)
    assert back[:, free] == pytest.approx(moment[:, free], abs=1e-13)
    product = stiffness[:, free][:, :, free] @ compliance[:, free][:, :, free]
    assert product == pytest.approx(np.broadcast_to(np.eye(len(free)), product.shape), abs=1e-12)


@LAWS
def test_gradient_of_the_energy_by_differences(law):
    """Central differences of sixth order along a random direction, of U and of its moment."""
    strip, random = irregular(law)
    step, weights = 1e-3, (45 / 60, -9 / 60, 1 / 60)
    direction = random.standard_normal(strip.strains.shape)
    direction[:, [i for i in range(3) if i not in strip.free]] = 0
    rates = []
    for k, weight in enumerate(weights, start=1):
        ends = [law.strain_energy(strip.strains + sign * k * step * direction, strip.kappa_n, NU)[:2] for sign in (1, -1)]
        rates.append([weight * (there - here) / step for there, here in zip(*ends)])
    rate, moment_rate = (sum(parts) for parts in zip(*rates))
    _, exactly, stiffness = strip.density
    assert rate == pytest.approx(np.sum(exactly * direction, axis=1), abs=1e-11)
    assert moment_rate == pytest.approx(np.einsum("kij,kj->ki", stiffness, direction), abs=1e-11)


@LAWS
def test_kappa_star_by_differences(law):
    """-dE/dkappa_n at fixed strains; U is quadratic in kappa_n where it is smooth, so the central difference is exact."""
    strip, _ = irregular(law)
    ends = [np.mean(law.strain_energy(strip.strains, strip.kappa_n + change, NU)[0]) for change in (1e-4, -1e-4)]
    assert strip.kappa_star == pytest.approx((ends[1] - ends[0]) / 2e-4, abs=1e-10)


def test_the_ribbon_is_linear_where_it_is_not_convex():
    """The convex envelope: same value and slope at c = nu kappa_n, and the moment that minimizes H beyond."""
    kappa_n = 3.0
    strains = np.array([[0.9 - 1e-9, 0, 0], [0.9 + 1e-9, 0, 0], [0.3, 0, 0.2]])  # nu kappa_n = 0.9
    U, moment, stiffness = RIBBON.strain_energy(strains, kappa_n, NU)
    assert U[0] == pytest.approx(U[1], abs=1e-8) and moment[0] == pytest.approx(moment[1], abs=1e-8)
    assert U[2] == pytest.approx(-(1 - NU) * kappa_n * 0.3 - (NU * kappa_n) ** 2 / 2) and not stiffness[2].any()
    assert RIBBON.strain_energy(np.array([-1.0, 0, 0]), kappa_n, NU)[0] == np.inf


@LAWS
def test_closure_and_its_derivatives_by_differences(law):
    strip, random = irregular(law)
    assert np.abs(strip.closure).max() < 1e-12
    n = len(strip.strains) * len(strip.free)
    u, v, multipliers = random.standard_normal(n), random.standard_normal(n), random.standard_normal(6)
    slopes = strip.closure_slopes[:, :, strip.free].reshape(6, -1)
    h = 1e-5
    assert (shifted(strip, h * u).closure - shifted(strip, -h * u).closure) / (2 * h) == pytest.approx(slopes @ u, abs=1e-8)
    curvature = strip.closure_curvature(multipliers)[:, strip.free][:, :, :, strip.free].reshape(n, n)
    assert np.abs(curvature - curvature.T).max() < 1e-13
    h = 1e-3
    corners = {(a, b): multipliers @ shifted(strip, h * (a * u + b * v)).closure for a in (-1, 1) for b in (-1, 1)}
    second = sum(a * b * value for (a, b), value in corners.items()) / (4 * h * h)
    assert second == pytest.approx(u @ curvature @ v, rel=1e-4, abs=1e-5)


@LAWS
def test_energy_of_a_circle_is_exact(law):
    for m in (1, 3, 5):
        strip = circle(law, m, 0.7)
        assert strip.energy == pytest.approx(m * m / 2 - m * 0.7, abs=1e-13)
        assert strip.kappa_star == pytest.approx(m, abs=1e-13)


@pytest.mark.sample(1)
@pytest.mark.parametrize(("law", "m", "n", "kappa_n"), [(RIBBON, 1, 2, 3.5), (ISOTROPIC_ROD, 1, 2, 2.0)])
def test_energy_of_an_equilibrium_converges_to_the_quadrature(law, m, n, kappa_n):
    """At rest with N segments, from above, with the second power of 1/N; the quadrature shares nothing with it."""
    limits = min(kappa_n, exact.curve(m, n, NU, law=law.name)[0].kappa_n) - 0.1, kappa_n + 0.1
    points = exact.curve(m, n, NU, limits, law=law.name)
    near = min(points[:-1], key=lambda point: abs(point.kappa_n - kappa_n))
    known = exact.solve(m, n, NU, near, kappa_n=kappa_n, law=law.name).energy
    start = buckled(law, m, n, kappa_n=kappa_n)
    errors = [descend(discretized(start, N)).end.energy - known for N in (32, 64, 128)]
    assert all(error > 0 for error in errors)
    orders = np.log2(np.divide(errors[:-1], errors[1:]))
    assert orders == pytest.approx([2, 2], abs=0.1)


@LAWS
def test_modes_of_circles_count_as_the_linear_theory(law):
    for m, kappa_n in ((1, 2.2), (1, 2.7), (3, -1.3), (3, 2.2), (5, 1.0)):
        values, _ = modes(circle(law, m, kappa_n, 64), 24)
        assert np.sum(values < -1e-6) == index(law, m, kappa_n, NU)


# --- downhill ---------------------------------------------------------------------------------------------------------


@pytest.mark.full
@pytest.mark.parametrize("metric", METRICS)
def test_energy_falls_closed_and_in_its_class(metric):
    """Three loops to one: at every step less energy, closed, a quaternion that comes back to its negative."""
    descent = descend(perturbed(circle(RIBBON, 3, -0.55), 0.02), metric)
    assert descent.rests and descent.slack == 0
    assert all(later < before + 1e-13 for before, later in itertools.pairwise(descent.energies))
    assert descent.energies[0] - descent.energies[-1] > 5
    assert all(np.abs(strip.closure).max() < 1e-12 for strip in descent.strips)
    for strip in descent.strips[::8]:
        axes, x = strip.along(np.linspace(0, 2 * np.pi, 201))
        assert quaternions(axes.transpose(0, 2, 1))[-1] == pytest.approx([-1, 0, 0, 0], abs=1e-11)
        assert x[-1] == pytest.approx([0, 0, 0], abs=1e-12)


@LAWS
def test_a_stable_state_stays(law):
    kappa_n = {RIBBON: 2.0, FLAT_ROD: 3.0, ISOTROPIC_ROD: 1.5}[law]
    rest = identify(descend(perturbed(circle(law, 1, kappa_n), 0.05)).end)
    assert (rest.kind, rest.m, rest.stability.index) == ("circle", 1, 0)


@pytest.mark.sample(1)
@pytest.mark.parametrize("metric", METRICS)
def test_a_single_loop_just_above_its_threshold_buckles(metric):
    """Into (1, 2), which the quadrature knows: energies agree to O(h^2) on the way down, to round-off once solved anew."""
    descents = [descend(perturbed(circle(RIBBON, 1, 2.6, segments), 0.02), metric) for segments in (48, 96)]
    rests = [identify(descent.end) for descent in descents]
    for rest in rests:
        assert (rest.kind, rest.m, rest.n, rest.stability.index) == ("primary branch", 1, 2, 0)
        assert rest.error < 1e-12 and rest.difference < 1e-11
    coarse, fine = (descent.end.energy - rest.energy for descent, rest in zip(descents, rests))
    assert 0 < fine < 2e-5 and coarse / fine == pytest.approx(4, abs=0.3)


@pytest.mark.sample(1)
@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("longest", [0.1, 0.05])
def test_beyond_the_fold_a_buckled_loop_snaps_to_three(sign, longest):
    """Kicked either way, and with steps half as long."""
    strip = replace(discretized(buckled(RIBBON, 1, 2, "LP"), 48), kappa_n=4.15)
    rest = identify(descend(perturbed(strip, sign * 0.02), longest=longest).end)
    assert (str(rest), rest.stability.index) == ("3-covered circle", 0)


@pytest.mark.full
@pytest.mark.parametrize(
    ("law", "m", "kappa_n", "expected"),
    [
        (RIBBON, 3, -0.55, "1-covered circle"),  # experiments: three loops open into one, five into three, seven into five
        (RIBBON, 5, 1.72, "3-covered circle"),
        (RIBBON, 7, 3.8, "5-covered circle"),
        (RIBBON, 3, 5.29, "(3, 4)"),
        (RIBBON, 3, 8.0, "7-covered circle"),  # far beyond its limit
        (FLAT_ROD, 1, 5.682, "3-covered circle"),
        (FLAT_ROD, 3, 0.4, "1-covered circle"),
        (ISOTROPIC_ROD, 1, -0.01, "1-covered circle, turned inside out"),
        (ISOTROPIC_ROD, 3, 2.103, "(1, 2)"),
    ],
)
def test_what_circles_become_past_their_limits(law, m, kappa_n, expected):
    """In both metrics the same. Where a branch begins at the circle the quadrature has it; the circles are stable by theory."""
    start = perturbed(circle(law, m, kappa_n, 96), 0.02)
    for metric in METRICS:
        descent = descend(start, metric)
        rest = identify(descent.end)
        assert descent.rests and (str(rest), rest.stability.index) == (expected, 0)


@pytest.mark.sample(1)
@LAWS
def test_the_same_end_wherever_the_kick_begins(law):
    """Equal up to a shift along the strip: the start of the segments has no say."""
    kappa_n = {RIBBON: 2.6, FLAT_ROD: 5.7, ISOTROPIC_ROD: 1.95}[law]
    start = perturbed(circle(law, 1, kappa_n), 0.02)
    rolled = replace(start, strains=np.roll(start.strains, 7, axis=0))
    ends = [descend(strip).end for strip in (start, rolled)]
    assert ends[0].energy == pytest.approx(ends[1].energy, abs=1e-11)


def test_what_is_refused():
    strip = circle(RIBBON, 1, 1.0)
    with pytest.raises(ValueError, match="metric 'mass' must be one of 'strain', 'velocity'"):
        descend(strip, "mass")
    with pytest.raises(ValueError, match="omega_1 must be positive"):
        descend(replace(strip, strains=-strip.strains))
    with pytest.raises(ValueError, match="Gamma: is missing"):
        replace(strip, law=FINITE_WIDTH).energy  # noqa: B018
    with pytest.raises(ValueError, match="cannot be closed"):
        replace(strip, strains=1.3 * strip.strains).moved(np.zeros(96))


@pytest.mark.full
@pytest.mark.parametrize(
    ("m", "kappa_n", "where"), [(3, -1.0, "1-covered circle"), pytest.param(1, 3.3, "(1, 2)", marks=pytest.mark.full)]
)
def test_a_strip_of_finite_width_comes_to_rest(m, kappa_n, where):
    """On a circle its energy is a closed form; on a primary branch the quadrature knows it."""
    start = discretized(second_variation.circle(FINITE_WIDTH, {"nu": NU, "Gamma": 30.0}, m, kappa_n), 96)
    descent = descend(perturbed(start, 0.02))
    rest = identify(descent.end)
    assert descent.rests and str(rest) == where and rest.stability.index == 0
    assert rest.energy <= descent.end.energy + 1e-9 and rest.difference < 1e-8
    if rest.kind == "circle":
        assert rest.energy == pytest.approx(descent.end.energy, abs=1e-11)
