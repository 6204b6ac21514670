"""The end of the ribbon's law on open strips, against quadratures and against a search for the strain of least energy."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq

import contin
from ribbon_model.ends import FREE_END
from ribbon_model.equilibrium import moment_on_directors
from ribbon_model.open_strip import OpenStrip
from ribbon_model.section import Section, section_of


def cantilever_end(nu: float, k: float) -> float:
    """Return the force at the free end at which the clamped end has omega_1 = k, for kappa_n = 1 and length 1.

    The planar elastica has omega_1**2 = k**2 + 2 F sin(theta), omega_1 = 1 at its free end, and the length is the integral of
    1/omega_1 over theta.
    """

    def length(F):
        last = math.asin((1 - k * k) / (2 * F))
        return quad(lambda theta: 1 / math.sqrt(k * k + 2 * F * math.sin(theta)), 0, last, epsabs=1e-13)[0] - 1

    return brentq(length, (1 - k * k) / 2 * (1 + 1e-9), 3, xtol=1e-14)


def pulled(material: Section, **options) -> contin.Branch:
    strip = OpenStrip(material, finish=FREE_END, numbers={"force_normal": 0.0})
    settings = {"limits": {"force_normal": (-1, 5)}, "events": strip.domain_tests()}
    return contin.trace(strip.first_point(**options), free=["force_normal"], **settings)


@pytest.mark.sample(1)
@pytest.mark.parametrize(
    ("nu", "curvature", "intervals"),
    [(0.3, 0.3, 3), (0.3, 0.3, 10), (0.15, 0.15, 3), (0.15, 0.15, 10), (-0.2, 0.2, 10)],
)  # t = 0 at omega_1 = nu kappa_n; nu < 0: bending to the other side has less energy below omega_1 = -nu kappa_n
def test_a_ribbon_ends_in_the_plane_where_its_law_does(nu, curvature, intervals):
    """Beyond, omega_1 jumps: there were 34 further points, some with a wrong index, and branch points with an error of nan."""
    branch = pulled(section_of("ribbon", {"nu": nu, "kappa_n": 1.0}), intervals=intervals)
    end = branch.points[-1]
    assert branch.stop.message.startswith("met the end of the law 'ribbon'")
    assert [point.label for point in branch if point.label] == ["EP", "EP"]
    error = abs(end["force_normal"] - cantilever_end(nu, curvature))
    assert error < 1e-9
    assert error < end.errors["force_normal"] + 1e-11


def test_the_end_between_clamps_is_where_the_least_bending_is_nu_kappa_n():
    """A clamped arc is opened by ``bend``; M1 is read from the polynomial, by a fine sample."""
    strip = OpenStrip(section_of("ribbon", {"nu": 0.3, "kappa_n": 1.0}))
    branch = contin.trace(
        strip.first_point(intervals=4),
        free=["bend"],
        direction=-1,
        limits={"bend": (-2, 1)},
        events=strip.domain_tests(),
    )
    end = branch.points[-1]
    assert branch.stop.message.startswith("met the end of the law 'ribbon'") and end.errors["bend"] < 1e-9
    t = np.linspace(0, 1, 2001)
    states = end.system.evaluate(end.x, t)
    bending = moment_on_directors(states.T[:4], states.T[7:11])[0] + 1.0
    assert bending.min() == pytest.approx(0.3, abs=1e-7)  # the sample misses the minimum by at most its spacing squared


# --- the law's side, by a search ----------------------------------------------------------------------------------------------


def best(M1, M3, kappa_n, D, side):
    """Return the largest M.omega - U of a developable strip with omega_1 of one sign, and its omega_1, by refined grids.

    U is the energy of the plate, in omega_1 and k2 = omega_3**2/omega_1, which has the sign of omega_1.
    """
    D11, D12, D22, D66 = D
    low, high = np.zeros(2), np.array([20.0, 20.0])
    for _ in range(12):
        w1, k2 = np.meshgrid(*(np.linspace(a, b, 41) for a, b in zip(low, high)), indexing="ij")
        twist = np.sqrt(w1 * k2)
        bend = side * w1 - kappa_n
        value = M1 * side * w1 + abs(M3) * twist
        value = value - (D11 * bend**2 + 2 * D12 * bend * side * k2 + D22 * k2**2 + 4 * D66 * twist**2) / 2
        at = np.unravel_index(value.argmax(), value.shape)
        centre, reach = np.array([w1[at], k2[at]]), (high - low) / 8
        low, high = np.maximum(centre - reach, 0), centre + reach
    return float(value.max()), float(centre[0])


def margin_of(section: Section, t: float, M1: float, M3: float) -> float:
    numbers = SimpleNamespace(**section.parameters)
    return section.margin(np.array([t]), np.array([[M1, 0.0, M3]]), np.empty((1, 3)), numbers)[0]


def isotropic(nu):
    return 1.0, nu, 1.0, (1 - nu) / 2


@pytest.mark.sample(8)
@pytest.mark.parametrize("seed", range(40))
def test_a_twisted_ribbon_is_within_its_law_where_the_strain_of_least_energy_is_on_its_side(seed):
    """|omega_3/omega_1| > 1 is within the law with kappa_n > 0, where M1 + (1 - nu) kappa_n < 0."""
    random = np.random.default_rng(seed)
    nu, kappa_n = random.uniform(-0.5, 0.5), random.uniform(-2, 2)
    M1, M3 = random.uniform(-3, 3), random.uniform(0.1, 3)
    sides = [best(M1, M3, kappa_n, isotropic(nu), side)[0] for side in (1, -1)]
    material = section_of("ribbon", {"nu": nu, "kappa_n": kappa_n})
    margin = margin_of(material, 0.5, M1, M3)
    assert (margin > 0) == (sides[0] > sides[1])


@pytest.mark.parametrize(
    "D", [(1.0, 0.3, 1.0, 0.35), (2.0, 0.3, 0.7, 0.25), (1.0, 0.4, 1.5, 0.6), (1.0, -0.2, 1.0, 0.5), (3.0, 0.2, 1.0, 0.9)]
)  # isotropic; D12 + 2 D66 below and above sqrt(D11 D22); auxetic; above
@pytest.mark.parametrize("kappa_n", [0.8, -0.8])
def test_a_planar_strip_of_any_plate_ends_where_its_twisting_modulus_or_its_side_does(D, kappa_n):
    """Along M1, the strain of least energy leaves the plane, or omega_1 > 0, where the margin vanishes."""
    plate = section_of("ribbon", {**dict(zip(("D11", "D12", "D22", "D66"), D)), "kappa_n": kappa_n})

    def margin(M1):
        return margin_of(plate, 0.5, M1, 0.0)

    end = brentq(margin, -10, 10)

    def planar(M1):
        """Return whether the strain of least energy is planar: omega_1 = kappa_n + M1/D11 > 0."""
        values = [best(M1, 0.0, kappa_n, D, side) for side in (1, -1)]
        value, w1 = max(values)
        return values[0][0] == value and w1 == pytest.approx(kappa_n + M1 / D[0], abs=1e-5)

    assert planar(end + 0.02)
    assert not planar(end - 0.02)


def test_a_section_with_another_thickness_has_its_own_moment():
    """The margin is that of the moment over w h**3: omega_1 of a planar strip is M1/(w h**3) + kappa_n."""
    tapered = section_of("ribbon", {"nu": 0.3, "kappa_n": 1.0}, {"thickness": "1 - s/2"})
    assert margin_of(tapered, 1.0, -0.7 * 0.5**3, 0.0) == pytest.approx(0, abs=1e-14)


@pytest.mark.full
def test_a_run_that_fails_beside_the_end_of_the_law_is_said_to_end_there():
    """The least margin is inside the strip here, and beyond it omega_1 jumps: no state is found there."""
    tapered = section_of("ribbon", {"nu": 0.3, "kappa_n": 1.0}, {"thickness": "1 - s/2"})
    strip = OpenStrip(tapered, finish=FREE_END, numbers={"force_normal": 0.0})
    system, x = strip.first_point().system.with_free(("force_normal",), strip.first_point().x)
    settings = contin.Settings(limits={"force_normal": (-1, 5)}, events=strip.domain_tests())
    run = contin.lowlevel.Continuation(system, x, settings)
    points = [point for point in run if not point.label]
    assert strip.explained(run).startswith("the end of the law 'ribbon'")
    states = points[-1].system.evaluate(points[-1].x, np.linspace(0, 1, 201))
    M1 = moment_on_directors(states.T[:4], states.T[7:11])[0]
    margin = M1 / (1 - np.linspace(0, 1, 201) / 2) ** 3 + 0.7
    assert 0 < margin.min() < 1e-4  # it came close to the end, and did not pass it


# --- first states ----------------------------------------------------------------------------------------------------------


@pytest.mark.sample(1)
@pytest.mark.parametrize("kappa_n", [0.0, 1.0, 4.0])
def test_a_first_state_at_which_the_law_has_no_value(kappa_n):
    """A clamped arch turns from one side to the other. The law that the sentence names finds it."""
    ends = {"numbers": {"distance": 0.95}}
    ribbon = OpenStrip(section_of("ribbon", {"nu": 0.3, "kappa_n": kappa_n}), **ends)
    sentence = "'ribbon' has no value where the bending vanishes .* take the law 'finite width'"
    with pytest.raises(contin.ProblemError, match=sentence):
        ribbon.first_point(ribbon.arch())
    if kappa_n == 0:
        with pytest.raises(contin.ProblemError, match=sentence):
            ribbon.first_point()
        wide = OpenStrip(section_of("finite width", {"nu": 0.3, "Gamma": 10.0}), **ends)
        assert wide.first_point(wide.arch())["distance"] == 0.95


@pytest.mark.full
def test_a_failure_that_is_not_of_the_law_keeps_its_sentence():
    """The natural arc bends to one side; its ends are far from the distance."""
    ribbon = OpenStrip(section_of("ribbon", {"nu": 0.3, "kappa_n": 3.0}), numbers={"distance": 0.99})
    with pytest.raises(contin.ProblemError, match="no equilibrium was found near the first guess"):
        ribbon.first_point()
