"""Open strips against closed forms. Each value has its source; errors are with the default mesh and tolerances."""

import math

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import ellipe, ellipk, jv

import contin
from ribbon_model.ends import CLAMP, DIRECTIONS, FREE_END, End, angles_of, hinge
from ribbon_model.equilibrium import directors
from ribbon_model.laws import LAWS
from ribbon_model.open_strip import OpenStrip
from ribbon_model.section import section_of

WIDTH, NORMAL, TANGENT = DIRECTIONS.values()
SIDEWAYS = (WIDTH, NORMAL)
ROD = section_of("rod", {"B1": 1.0, "B2": 4.0, "C": 0.8})
#: The first zero of tan x = x.
ZERO = brentq(lambda x: math.sin(x) - x * math.cos(x), 4, 4.7, xtol=1e-15)
#: Ends of columns under a dead load along the tangent, and their first critical loads (Euler; Love, sect. 264).
COLUMNS = {
    "clamped-clamped": (CLAMP, End(held=SIDEWAYS), [4 * math.pi**2, 4 * ZERO**2]),
    "pinned-pinned": (hinge(), hinge(held=SIDEWAYS), [math.pi**2, 4 * math.pi**2]),
    "clamped-free": (CLAMP, FREE_END, [math.pi**2 / 4]),  # the next is that of the stiff plane, B2 = 4
    "clamped-pinned": (CLAMP, hinge(held=SIDEWAYS), [ZERO**2]),
}


def follow(start, name, low, high, **options):
    return contin.trace(start, free=[name], limits={name: (low, high)}, **options)


def assert_bifurcations(branch, name, values, change=1):
    """These are the first branch points, with an index that goes up by ``change`` at each."""
    found = branch.labelled("BP")[: len(values)]
    np.testing.assert_allclose([point[name] for point in found], values, rtol=1e-8)
    assert [point.index_change for point in found] == [(change * i, change * (i + 1)) for i in range(len(values))]
    assert not branch.notes


@pytest.mark.parametrize(
    "ends", ["pinned-pinned", *(pytest.param(name, marks=pytest.mark.full) for name in COLUMNS if name != "pinned-pinned")]
)
def test_a_column_buckles_at_eulers_loads(ends):
    start, finish, loads = COLUMNS[ends]
    column = OpenStrip(ROD, start, finish, {"force_tangent": -1.0})
    branch = follow(column.first_point(), "force_tangent", -1.2 * loads[-1], 0, direction=-1)
    assert_bifurcations(branch, "force_tangent", [-load for load in loads])


@pytest.mark.full
def test_the_elastica_beyond_buckling():
    """Pinned: the end angle a, P = (2 K(k))**2 and distance 2 E/K - 1 with k = sin(a/2) (DLMF 19; Love, sect. 262).

    The ends meet where 2 E = K, at P = 2.1833790462 pi**2.
    """
    start, finish, _ = COLUMNS["pinned-pinned"]
    column = OpenStrip(ROD, start, finish, {"force_tangent": -9.0})
    straight = follow(column.first_point(), "force_tangent", -12, 0, direction=-1)
    arches = contin.trace(straight.labelled("BP")[0], branch=1, limits={"force_tangent": (-23, 0)}, zeros={"distance": [0.0]})
    (meet,) = arches.labelled("UZ")
    assert math.isclose(-meet["force_tangent"], 2.1833790462 * math.pi**2, rel_tol=1e-10)
    for point in arches.points[3::4]:
        angle = 2 * math.atan2(*np.abs(point.system.states(point.x)[0, [1, 0]]))
        m = math.sin(angle / 2) ** 2
        assert math.isclose(-point["force_tangent"], (2 * ellipk(m)) ** 2, rel_tol=1e-8)
        assert math.isclose(point["distance"], 2 * ellipe(m) / ellipk(m) - 1, abs_tol=1e-8)
        assert point.index == 0 or point is meet  # where the ends meet, the loop turns about them without a change of energy
    second = follow(column.first_point(), "force_tangent", -41, 0, direction=-1).labelled("BP")[1]
    assert contin.trace(second, branch=1, max_points=4).points[-1].index == 1  # Euler's mode j has index j - 1


@pytest.mark.full
def test_greenhill():
    """Twisted and clamped, the end slides: M L/2B = 4.4934..., two modes at once (Greenhill 1883; Love, sect. 272)."""
    rod = section_of("rod", {"B1": 1.0, "B2": 1.0, "C": 0.8})
    twisted = OpenStrip(rod, CLAMP, End(held=SIDEWAYS), {"turn": 10.0, "force_tangent": 0.0})
    branch = follow(twisted.first_point(lambda t: (math.cos(5 * t), 0, 0, math.sin(5 * t), 0, 0, t)), "turn", 10, 12)
    assert_bifurcations(branch, "turn", [2 * ZERO / 0.8], change=2)
    assert math.isclose(twisted.reactions(branch.points[-1])["M_tangent"], 0.8 * 12, rel_tol=1e-10)


@pytest.mark.full
def test_a_twisted_column_under_thrust():
    """Clamped and twisted, M = C turn: u'''' - i M u''' - T u'' = 0, u = u' = 0 at the ends (Love, sect. 272)."""
    rod, moment = section_of("rod", {"B1": 1.0, "B2": 1.0, "C": 0.8}), 0.8

    def determinant(tension):
        root = np.emath.sqrt(moment**2 / 4 - tension)
        r = 1j * (moment / 2 + root), 1j * (moment / 2 - root)
        rows = [[1, 0, 1, 1], [0, 1, *r], [1, 1, *np.exp(r)], [0, 1, *(r * np.exp(r))]]
        return (np.linalg.det(np.array(rows)) * np.exp(-0.5j * moment) / root).imag

    column = OpenStrip(rod, CLAMP, End(held=SIDEWAYS), {"turn": 1.0, "force_tangent": -38.0})
    start = column.first_point(lambda t: (math.cos(t / 2), 0, 0, math.sin(t / 2), 0, 0, t))
    critical = brentq(determinant, -38.5, -39.5, xtol=1e-13)
    assert_bifurcations(follow(start, "force_tangent", -40, 0, direction=-1), "force_tangent", [critical], change=2)


@pytest.mark.full
def test_michell_and_zajac():
    """A ring of a straight isotropic rod buckles at a twist of 2 pi sqrt(3) B/C (Michell 1889, Zajac 1962)."""
    rod = section_of("rod", {"B1": 1.0, "B2": 1.0, "C": 0.8})
    ring = OpenStrip(rod, numbers={"distance": 0.0, "turn": 13.0}, phases=("spin",))
    start = ring.first_point(ring.twisted_circle(13 / math.pi))
    assert_bifurcations(follow(start, "turn", 12, 14.5), "turn", [2 * math.pi * math.sqrt(3) / 0.8], change=2)


LATERAL = {
    "flat rod": (section_of("flat rod", {"nu": 0.3}), 1.0, 2 / 1.3),
    "finite width": (section_of("finite width", {"nu": 0.3, "Gamma": 1.0}), 1 - 0.09, 1.4),
    "rod": (section_of("rod", {"B1": 1.0, "B2": math.inf, "C": 0.7}), 1.0, 0.7),
}  # fmt: skip


@pytest.mark.sample(4)
@pytest.mark.parametrize("load, place, stiffness", [("force_width", "shear", 4.0), ("force_normal", "rise", 1.0)])
@pytest.mark.parametrize("tension", [0.0, 2.0, -1.0])
def test_the_tip_of_a_cantilever_goes_where_a_small_force_pulls(load, place, stiffness, tension):
    """P/3 B (L = 1); with a tension T = B k**2 also P (1 - tanh(k)/k)/T, for thrust with tan (Timoshenko & Gere, ch. 1).

    Terms of higher order are P**2 = 1e-10 times as large.
    """
    k = math.sqrt(abs(tension) / stiffness)
    expected = 1e-5 * ((1 - (math.tanh if tension > 0 else math.tan)(k) / k) / tension if tension else 1 / (3 * stiffness))
    tip = OpenStrip(ROD, CLAMP, FREE_END, {load: 1e-5, "force_tangent": tension}).first_point()
    assert math.isclose(tip[place], expected, rel_tol=1e-8)


@pytest.mark.parametrize("load, size", [("weight", 1 / 8), ("moment", -1 / 2)])
def test_the_tip_of_a_cantilever_goes_where_weight_and_moment_bend_it(load, size):
    """w/8 B to where the weight pulls, M/2 B where a right-handed turn about d1 takes d3: to -d2 (Timoshenko & Gere, ch. 1)."""
    strip = OpenStrip(ROD, CLAMP, hinge(held=()), {load: 1e-5}, weight_direction=NORMAL)
    assert math.isclose(strip.first_point()["rise"], size * 1e-5, rel_tol=1e-8)


@pytest.mark.full
@pytest.mark.parametrize("law", LATERAL)
def test_a_cantilever_buckles_sideways(law):
    """A dead load at the tip in the stiff plane, P L**2 = 4.0126 sqrt(B1 C): with z = P s**2/2 sqrt(1/B1 C), the twist is
    sqrt(s) J_(1/4)(z), free at the tip s = 0 and zero at the clamp: the first zero of J_(-1/4) (Prandtl 1899, Michell 1899).
    """
    material, bending, twisting = LATERAL[law]
    zero = 2 * brentq(lambda z: jv(-0.25, z), 1.5, 2.5, xtol=1e-15)
    assert math.isclose(zero, 4.012599, abs_tol=1e-6)
    strip = OpenStrip(material, finish=FREE_END, numbers={"force_width": 0.0})
    critical = zero * math.sqrt(bending * twisting)
    assert_bifurcations(follow(strip.first_point(), "force_width", -1, 1.2 * critical), "force_width", [critical])


def own_weight() -> float:
    """The critical weight of a cantilever in its stiff plane, B1 = C = 1: B1 C t'' = -(m s**2/2)**2 t, t(1) = 0 = t'(0)."""
    return 6 * brentq(lambda z: jv(-1 / 6, z), 1.5, 3, xtol=1e-15)


@pytest.mark.full
@pytest.mark.parametrize("nu", [0.0, 0.3, 0.5])
def test_a_strip_buckles_under_its_weight(nu):
    """18.178/sqrt(1 + nu), the same for the flat rod and for finite width (Audoly & Neukirch 2021, sect. 3)."""
    strip = OpenStrip(section_of("flat rod", {"nu": nu}), finish=FREE_END, numbers={"weight": 0.0}, weight_direction=(-1, 0, 0))
    critical = own_weight() * math.sqrt(2 / (1 + nu))
    assert math.isclose(critical, 18.178 / math.sqrt(1 + nu), rel_tol=5e-6)
    assert_bifurcations(follow(strip.first_point(), "weight", -1, 25), "weight", [critical])


@pytest.mark.full
def test_a_strip_of_finite_width_buckles_under_its_weight():
    """The same weight, where B is the plate's: 1 - nu**2 times the value with that of the beam."""
    material = section_of("finite width", {"nu": 0.3, "Gamma": 0.5})
    strip = OpenStrip(material, finish=FREE_END, numbers={"weight": 0.0}, weight_direction=(-1, 0, 0))
    critical = own_weight() * math.sqrt((1 - 0.3**2) * 2 * (1 - 0.3))
    assert math.isclose(critical, (1 - 0.3**2) * 18.178 / math.sqrt(1.3), rel_tol=5e-6)
    assert_bifurcations(follow(strip.first_point(), "weight", -1, 25), "weight", [critical])


@pytest.mark.full
def test_pure_bending_in_the_stiff_plane():
    """Ends held against twist, moment M: M L = pi sqrt(B1 C) (Prandtl 1899; Timoshenko & Gere, sect. 6.2)."""
    strip = OpenStrip(LATERAL["rod"][0], hinge("width"), End("joint", axis=NORMAL, director=0, held=(NORMAL,)), {"moment": 0.0})
    branch = follow(strip.first_point(), "moment", -1, 6)
    assert_bifurcations(branch, "moment", [j * math.pi * math.sqrt(0.7) for j in (1, 2)])


HELICES = {
    "ribbon": (0.9, 0.0, 0.5), "flat rod": (0.9, 0.0, 0.5), "finite width": (0.9, 0.0, 0.5), "isotropic rod": (0.9, 0.2, 0.5),
}  # fmt: skip


@pytest.mark.full
@pytest.mark.parametrize("law", HELICES)
def test_a_helix_under_a_wrench(law):
    """Constant strains w: M = dU/dw; M' = 0 on the directors gives w x M + d3 x n = 0 (Love, sect. 271), n along the axis w."""
    w, numbers = np.array(HELICES[law]), {"nu": 0.3} | ({"Gamma": 2.0} if law == "finite width" else {})
    kappa_n = 0.4 if LAWS[law].constrained else 0.0  # w1 M2 = w2 M1 where the strip bends both ways
    U, M, _ = LAWS[law].strain_energy(w, kappa_n, *numbers.values())
    size = np.linalg.norm(w)
    q = np.array([math.cos(size / 2), *(math.sin(size / 2) * w / size)])
    s, c = math.sin(size) / size, (1 - math.cos(size)) / size
    axis, d3 = w / size, np.array([0.0, 0.0, 1.0])
    place = axis * axis[2] * (1 - s) + d3 * s + np.cross(axis, d3) * c
    turn, bend, swing = angles_of(q)
    prescribed = dict(zip(("shear", "rise", "distance"), place)) | {"turn": turn, "bend": bend, "swing": swing}
    strip = OpenStrip(section_of(law, {**numbers, "kappa_n": kappa_n}), numbers=prescribed)

    def guess(t):
        a, b = math.sin(size * t) / size, (1 - math.cos(size * t)) / size
        r = axis * axis[2] * (t - a) + d3 * a + np.cross(axis, d3) * b
        return [math.cos(size * t / 2), *(math.sin(size * t / 2) * w / size), *r]

    point = strip.first_point(guess)
    np.testing.assert_allclose(strip.strains(point.system, point.x), np.tile(w, (len(point.system.nodes), 1)), atol=1e-8)
    force = np.array([strip.reactions(point)[name] for name in ("F_width", "F_normal", "F_tangent")])
    moment = np.array([strip.reactions(point)[name] for name in ("M_width", "M_normal", "M_tangent")])
    on_directors = np.array(directors(*q)).reshape(3, 3)
    if LAWS[law].constrained:  # the moment about the normal is a reaction; n is along the axis
        M[1] = (on_directors @ moment)[1]
    np.testing.assert_allclose(on_directors @ moment, M, atol=1e-8)
    np.testing.assert_allclose(np.cross(w, M) + np.cross(d3, on_directors @ force), 0, atol=1e-8)
    np.testing.assert_allclose(np.cross(force, axis), 0, atol=1e-8)
    assert math.isclose(point["energy"], U + kappa_n**2 / 2, rel_tol=1e-8)
