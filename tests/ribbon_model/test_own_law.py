"""A law that is stated here and named nowhere else: quartic in the bending, with a length of its own.

Everything about it follows from its energy. Each number is compared with a closed form of it, or with a quadrature.
"""

import math

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq
from scipy.special import jv

import contin
from branches.run.display import Display
from branches.run.runner import run_scene
from branches.scene.parse import parse
from branches.store.read import read_branch
from contin.lowlevel import point_of
from ribbon_model import exact, laws, stability
from ribbon_model.descent import descend, identify, perturbed
from ribbon_model.dispersion import squared_frequencies
from ribbon_model.domains import HALF_LOOP
from ribbon_model.ends import DIRECTIONS, FREE_END, HINGED, End
from ribbon_model.law import Law, Parameter
from ribbon_model.linear import circle, convex_limits, covering, energy_interval, index, stability_interval, thresholds
from ribbon_model.network_segments import cut
from ribbon_model.open_strip import OpenStrip
from ribbon_model.second_variation import circle as equilibrium_of_circle
from ribbon_model.section import Section
from ribbon_model.seeds import half_loop_branch, primary_branch
from ribbon_model.segments import discretized
from ribbon_model.solution import Solution
from ribbon_model.unfolding import factors, first_root, shooting_determinant


def energy(w1, w2, w3, kappa_n, twist, core):
    bent = w1 - kappa_n
    return bent**2 / 2 + core**2 * bent**4 / 4 + twist * w3**2 / 2 - kappa_n**2 / 2


LAW = Law.of_energy("quartic", energy, {"twist": Parameter(), "core": Parameter(1)})
NUMBERS = {"twist": 1.5, "core": 0.4}
TWIST, CORE = NUMBERS.values()


def bending(M, core=CORE):
    """omega_1 - kappa_n of a moment: the root of y + core**2 y**3 = M, by Cardano's formula."""
    p = 1 / (3 * core**2)
    q = abs(M) / (2 * core**2)
    root = np.cbrt(q + np.sqrt(q * q + p**3))
    return np.sign(M) * (root - p / root)


def threshold(m, n, twist=TWIST, core=CORE):
    """M r0 = t (1 - k**2) with k = n/m, r0 = 1/m."""
    return m - bending(m * twist * (1 - (n / m) ** 2), core)


# --- the law ------------------------------------------------------------------------------------------------------------


def test_what_follows_from_the_energy():
    y = bending(0.9)
    H, w1, w2, w3, star = LAW.response(0.9, 5.0, -0.6, 0.7, *NUMBERS.values())
    assert (w1, w2, w3) == pytest.approx((0.7 + y, 0.0, -0.6 / TWIST), rel=1e-14)
    assert star == pytest.approx(0.9 + 0.7, rel=1e-14)  # dH/dkappa_n at a fixed moment
    assert pytest.approx(0.9 * w1 - 0.6 * w3 - energy(w1, 0, w3, 0.7, TWIST, CORE), rel=1e-14) == H
    moduli = LAW.linearized(np.array([[0.9, 0, -0.6]]), 0.7, *NUMBERS.values())[1][0]
    assert moduli == pytest.approx(np.diag([1 / (1 + 3 * CORE**2 * y**2), 0, 1 / TWIST]), rel=1e-13, abs=1e-15)
    with pytest.raises(ValueError, match="core: is missing; the law 'quartic' needs twist, core"):
        thresholds(LAW, 1, 2, {"twist": 1.5})
    with pytest.raises(ValueError, match="nu: is not a number of the law 'quartic'"):
        thresholds(LAW, 1, 2, {**NUMBERS, "nu": 0.3})


def test_circles():
    for m, kappa_n in ((1, -0.5), (3, 5.0)):
        y, found = m - kappa_n, circle(LAW, m, kappa_n, NUMBERS)
        moment = y + CORE**2 * y**3
        expected = (moment, moment + kappa_n, y**2 / 2 + CORE**2 * y**4 / 4 - kappa_n**2 / 2)
        assert tuple(found.values()) == pytest.approx(expected, rel=1e-14)
        assert covering(LAW, NUMBERS, kappa_n, found["kappa_star"], found["energy"]) == m
    assert convex_limits(LAW, 3, NUMBERS) == (-math.inf, math.inf)


@pytest.mark.parametrize("core", [0.0, 0.1, 0.4, 3.0])
def test_linear_theory(core):
    """Thresholds, the interval of stability, the index of circles; without a core it is a flat rod."""
    numbers = {"twist": TWIST, "core": core}
    for m, n in ((1, 2), (1, 7), (3, 1), (3, 4), (5, 6)):
        expected = threshold(m, n, core=core) if core else m - m * TWIST * (1 - (n / m) ** 2)
        assert thresholds(LAW, m, n, numbers) == pytest.approx((expected,), rel=1e-13)
        if not core:
            assert expected == pytest.approx(thresholds(laws.FLAT_ROD, m, n, 2 / TWIST - 1)[0], rel=1e-13)
    first = thresholds(LAW, 1, 2, numbers)[0]
    assert stability_interval(LAW, 1, numbers) == energy_interval(LAW, 1, numbers) == (-math.inf, first)
    ends = thresholds(LAW, 3, 2, numbers)[0] / 3, thresholds(LAW, 3, 4, numbers)[0] / 3
    assert stability_interval(LAW, 3, numbers) == ends
    assert [index(LAW, 1, first + side, numbers) for side in (-0.01, 0.01)] == [0, 2]
    for kappa_n in (first - 0.01, first + 0.01):  # of the second variation on a mesh
        assert stability.index(equilibrium_of_circle(LAW, numbers, 1, kappa_n)).index == index(LAW, 1, kappa_n, numbers)


def test_vibrations():
    """In the plane the tangent bending modulus takes the place of B; out of it a threshold has the frequency zero."""
    kappa_n = threshold(1, 3)
    found = LAW.on_circle(1.0, kappa_n, *NUMBERS.values())
    inside, outside = squared_frequencies(found.moment, found.contrast, found.twisting, 3.0, found.bending)
    assert inside == pytest.approx((1 + 3 * CORE**2 * (1 - kappa_n) ** 2) * 9 * 64 / 10, rel=1e-12)
    assert outside == pytest.approx(0, abs=1e-10)


def test_with_a_modulus_about_the_normal():
    """M**2/g - (1 + t/g) M + t (1 - k**2) = 0 at both thresholds; a ring turns about its centreline where M = g."""
    g, numbers = 2.0, {**NUMBERS, "side": 2.0}
    law = Law.of_energy(
        "quartic with a side", lambda w1, w2, w3, kappa_n, twist, core, side: (
            energy(w1, w2, w3, kappa_n, twist, core) + side * w2**2 / 2
        ), {**LAW.parameters, "side": Parameter()}, constrained=False,
    )  # fmt: skip
    moments = np.roots([1 / g, -(1 + TWIST / g), TWIST * (1 - 2**2)])
    expected = sorted((1 - bending(moment) for moment in moments), key=lambda kappa_n: abs(kappa_n - 1))
    assert thresholds(law, 1, 2, numbers) == pytest.approx(expected, rel=1e-13)
    assert energy_interval(law, 1, numbers) == pytest.approx((1 - bending(g), expected[0]), rel=1e-13)
    for kappa_n in (expected[0] - 0.01, expected[0] + 0.01):
        assert stability.index(equilibrium_of_circle(law, numbers, 1, kappa_n)).index == index(law, 1, kappa_n, numbers)
    system, x, _ = primary_branch(law, 1, 2, numbers)
    assert x[system.parameter_index("kappa_n")] == pytest.approx(expected[0], abs=1e-9)


def test_another_unit_of_length():
    """A strip of half the length, in its own units: curvatures are doubled, and the core is halved."""
    assert LAW.scaled(NUMBERS, 2.0) == {"twist": TWIST, "core": CORE / 2}
    U = LAW.strain_energy(np.array([1.3, 0, 0.4]), 0.5, *NUMBERS.values())[0]
    other = LAW.strain_energy(2 * np.array([1.3, 0, 0.4]), 1.0, *LAW.scaled(NUMBERS, 2.0).values())[0]
    assert other == pytest.approx(4 * U, rel=1e-14)


# --- closed strips ------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def branch():
    """The branch (1, 2) on the cell."""
    system, x, tangent = primary_branch(LAW, 1, 2, NUMBERS, 10, 7)
    settings = contin.Settings(trivial="M2", limits={"kappa_n": (-20, 20)}, zeros={"kappa_n": [1.6, 2.8]})
    return contin.trace(point_of(system, x), settings, tangent=tangent)


@pytest.mark.full
def test_a_primary_branch_against_its_quadrature(branch):
    """It leaves the single loop at the threshold and ends on the triple one; energy and kappa* between these."""
    assert branch.points[0]["kappa_n"] == pytest.approx(threshold(1, 2), abs=1e-10)
    assert branch.points[-1]["kappa_n"] == pytest.approx(threshold(3, 2), abs=1e-9)
    for point in branch.labelled("UZ"):
        *_, one = exact.curve(1, 2, NUMBERS, (point["kappa_n"], 10.0), step=0.3, law=LAW)
        assert one.label == "EP"
        assert (point["energy"], point["kappa_star"]) == pytest.approx((one.energy, one.kappa_star), abs=1e-8)


@pytest.mark.full
def test_the_half_loop_bifurcates_at_the_thresholds():
    system = HALF_LOOP.discretize(LAW, 12, 6, NUMBERS)
    start = HALF_LOOP.circle(system, 1, 1.0)
    expected = [threshold(1, n) for n in (2, 3)]
    found = contin.trace(point_of(system, start), limits={"kappa_n": (0, expected[1] + 0.5)}).labelled("BP")
    assert [point["kappa_n"] for point in found] == pytest.approx(expected, abs=1e-9)
    system, x, _ = half_loop_branch(LAW, 1, 2, NUMBERS)
    assert x[system.parameter_index("kappa_n")] == pytest.approx(expected[0], abs=1e-9)


@pytest.mark.full
def test_index_and_descent(branch):
    """The index of the branch is that of two meshes; an unstable circle comes to rest where the energy says."""
    solutions = [Solution.of(point) for point in branch.points[2:-1:6] if not point.label]
    for solution in solutions:
        found = solution.index()
        assert found.decided and found.index == solution.on(HALF_LOOP).index().index
        constant = solution.invariants()["hamiltonian"]
        assert np.ptp(constant) < 1e-9 * (1 + abs(constant[0]))
    kappa_n = threshold(1, 2) + 0.1
    end = descend(perturbed(discretized(equilibrium_of_circle(LAW, NUMBERS, 1, kappa_n), 96), 0.02))
    rest = identify(end.end)
    assert end.rests and rest.stability.index == 0 and rest.kind != "unknown"
    assert rest.energy < circle(LAW, 1, kappa_n, NUMBERS)["energy"]


# --- open strips --------------------------------------------------------------------------------------------------------


@pytest.mark.full
def test_a_strip_bent_by_a_moment():
    """Between a clamped end and a hinge with a dead moment it is an arc, omega_1 = kappa_n + y, for every moment."""
    section = Section(LAW, {**NUMBERS, "kappa_n": 0.5})
    strip = OpenStrip(section, finish=End(HINGED, held=()), numbers={"moment": 0.0})
    bent = contin.trace(strip.first_point(), free=["moment"], limits={"moment": (-1, 4)})[-1]
    strains = strip.strains(bent.system, bent.x)
    assert strains == pytest.approx(np.array([[0.5 + bending(4.0), 0, 0]] * len(strains)), abs=1e-9)
    y = bending(4.0)
    assert bent["energy"] == pytest.approx(y**2 / 2 + CORE**2 * y**4 / 4, rel=1e-10)


def test_the_planar_elastica():
    """A cantilever with a dead force across: theta' = y(M), and H(M) - F sin(theta) is constant along it."""
    strip = OpenStrip(Section(LAW, NUMBERS), finish=FREE_END, numbers={"force_normal": 0.0})
    branch = contin.trace(strip.first_point(), free=["force_normal"], limits={"force_normal": (-1, 6)}, max_step=0.3)
    point, F = branch[-1], 6.0
    angle = strip.shape(point).directors[-1, 2]
    last = math.atan2(abs(angle[1]), angle[2])

    def complementary(y):
        return y**2 / 2 + 3 * CORE**2 * y**4 / 4  # M y - U with M = y + core**2 y**3

    def rate(theta):
        level = F * (math.sin(last) - math.sin(theta))
        return math.sqrt(2 * level / (1 / 2 + math.sqrt(1 / 4 + 3 * CORE**2 * level))) if level > 0 else 0.0

    for theta in (0.1, 0.5):
        assert complementary(rate(theta)) == pytest.approx(F * (math.sin(last) - math.sin(theta)), rel=1e-12)
    length = quad(lambda u: 2 * u / rate(last - u * u), 0, math.sqrt(last), epsabs=1e-13, epsrel=1e-12)[0]
    assert length == pytest.approx(1, abs=1e-8)


@pytest.mark.full
def test_buckling_of_straight_strips():
    """Where it is straight, its tangent moduli are 1 and the twist: Euler's load, and Michell's (1899)."""
    section = Section(LAW, NUMBERS)
    column = OpenStrip(section, finish=FREE_END, numbers={"force_tangent": 0.0})
    found = contin.trace(column.first_point(), free=["force_tangent"], direction=-1, limits={"force_tangent": (-4, 1)})
    (point,) = found.labelled("BP")
    assert point["force_tangent"] == pytest.approx(-((math.pi / 2) ** 2), rel=1e-9) and point.index_change == (0, 1)
    beam = OpenStrip(section, finish=FREE_END, numbers={"force_width": 0.0})
    critical = 2 * brentq(lambda z: jv(-0.25, z), 1.5, 2.5, xtol=1e-15) * math.sqrt(TWIST)
    found = contin.trace(beam.first_point(), free=["force_width"], limits={"force_width": (-1, 1.2 * critical)})
    assert found.labelled("BP")[0]["force_width"] == pytest.approx(critical, rel=1e-8)


@pytest.mark.full
def test_an_unfolded_arc_leaves_its_plane():
    """The linear theory of section 5 in two ways, and the variational problem of the open strip."""
    xi = np.array([0.3, 0.8, 1.6])
    even, odd = factors(LAW, NUMBERS, xi)
    determinant = shooting_determinant(LAW, NUMBERS, xi)
    assert determinant == pytest.approx(-8 * (1 - xi) ** 4 * even * odd / TWIST, rel=1e-9)
    expected = first_root(LAW, NUMBERS)
    assert expected == pytest.approx(first_root(LAW, NUMBERS, method="shooting"), abs=1e-10)
    assert 1 < expected < 3.9  # the arc has passed its flat state
    section = Section(LAW, {**LAW.scaled(NUMBERS, math.pi), "kappa_n": math.pi})  # in units of the length, not the radius
    strip = OpenStrip(section, finish=End(held=(DIRECTIONS["width"],)), numbers={"bend": math.pi * (1 - 1.2)})
    size = math.pi * (1 - 1.2)

    def arc(t):
        angle = size * t
        return math.cos(angle / 2), math.sin(angle / 2), 0, 0, 0, (math.cos(angle) - 1) / size, math.sin(angle) / size

    limits = {"bend": (math.pi * (1 - expected) - 0.05, size)}
    found = contin.trace(strip.first_point(arc), free=["bend"], direction=-1, limits=limits).labelled("BP")
    assert 1 - found[0]["bend"] / math.pi == pytest.approx(expected, rel=1e-8) and found[0].index_change == (0, 1)


def test_segments_have_the_energy_of_the_strip():
    strip = OpenStrip(Section(LAW, {**NUMBERS, "kappa_n": 1.0}), numbers={"distance": 0.8})
    point = strip.first_point(strip.arch(0.8))
    found = [cut(strip, point.system, point.x, count).energy - point["energy"] for count in (40, 80)]
    assert 0 < found[1] < found[0] / 3.5


def test_what_it_does_not_state_is_refused():
    for along in ({"width": "1 + s"}, {"thickness": "1 + s"}):
        with pytest.raises(ValueError, match="width, thickness: are for flat strips, not for the law 'quartic'"):
            Section(LAW, NUMBERS, along)
    with pytest.raises(ValueError, match="tau_n: is not a number of the law 'quartic'"):
        Section(LAW, {**NUMBERS, "tau_n": 1.0})
    with pytest.raises(ValueError, match="'quartic' is none of 'ribbon', 'flat rod', 'isotropic rod'"):
        exact.initial_slope(1, 2, NUMBERS, law=LAW)


# --- scenes -------------------------------------------------------------------------------------------------------------


@pytest.mark.full
def test_a_sweep_of_open_scenes(monkeypatch, tmp_path):
    """Found by its name, it is the law of scenes: its length takes three values, and each moment bends as it must."""
    monkeypatch.setitem(laws.OPEN_LAWS, LAW.name, LAW)
    text = (
        "material: {law: quartic, twist: 1.5, core: [0.1, 0.4, 2.0], kappa_n: 0.5}\n"
        "finish: {rotation: hinged, about: width, place: free}\n"
        "stages: [{follow: moment, to: 4}]\n"
    )
    sweep = parse(text, "scene")
    for name, config in sweep.scenes.items():
        assert run_scene(config, tmp_path / name, Display(silent=True)) == "complete"
        found = read_branch(tmp_path / name)
        energy, y = found.points["energy"][-1], bending(4.0, config.material["core"])
        assert energy == pytest.approx(y**2 / 2 + config.material["core"] ** 2 * y**4 / 4, rel=1e-9)
