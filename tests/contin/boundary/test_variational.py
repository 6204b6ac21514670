"""Variational problems against closed forms, with the index on both sides of every special point; and what is refused."""

import math

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import ellipe, ellipk

import contin
from contin import VariationalProblem
from contin.boundary.second_variation import second_variation

#: First positive zero of tan x = x.
TANGENT = 4.493409457909064


def special(branch, name):
    """Label, value and index before and after, of all points that are not ends; the estimates of their errors are kept."""
    assert not branch.notes
    found = [point for point in branch if point.label not in ("", "EP")]
    assert all(abs(point.errors[name]) < 1e-10 * (1 + abs(point[name])) for point in found)
    return [(point.label, point[name], point.nullity, point.index_change) for point in found]


def assert_special(branch, name, expected):
    found = special(branch, name)
    assert [(label, nullity, change) for label, _, nullity, change in found] == [entry[:1] + entry[2:] for entry in expected]
    np.testing.assert_allclose([value for _, value, *_ in found], [value for _, value, *_ in expected], rtol=1e-10)


# --- Euler's elastica ---------------------------------------------------------------------------------------------------


def bending(t, x, w, p):
    return w.angle**2 / 2 + p.load * math.cos(x.angle)


def height(t, x, w, p):
    return math.sin(x.angle)


def planar(ends=None, offset=True):
    return VariationalProblem(
        bending, ["angle"], {"load": 1.0}, ends=ends, integrals={"offset": height} if offset else None,
        functionals={"chord": lambda t, x, w, p: math.cos(x.angle)},
        symmetries={"mirror": lambda t, x: -x, "reverse": lambda t, x: -x[::-1]},
    )  # fmt: skip


PINNED = planar()


@pytest.mark.sample(1)
@pytest.mark.parametrize(
    "problem, loads",
    [
        (planar(lambda a, b, p: (a.angle, b.angle)), [4 * math.pi**2, 4 * TANGENT**2, 16 * math.pi**2]),
        (PINNED, [(j * math.pi) ** 2 for j in (1, 2, 3)]),
        (planar(lambda a, b, p: (a.angle,), offset=False), [((j - 0.5) * math.pi) ** 2 for j in (1, 2, 3, 4)]),
        (planar(lambda a, b, p: (a.angle,)), [TANGENT**2, 7.725251836937707**2, 10.904121659428899**2]),
    ],
    ids=["clamped-clamped", "pinned-pinned", "clamped-free", "clamped-pinned"],
)
def test_buckling_of_a_straight_elastica(problem, loads):
    """Timoshenko & Gere, Theory of Elastic Stability, ch. 2; the index counts the loads that were passed."""
    straight = contin.trace(contin.solve(problem, [0.0]), free=["load"], limits={"load": (1.0, loads[-1] * 1.05)})
    assert_special(straight, "load", [("BP", load, 1, (j, j + 1)) for j, load in enumerate(loads)])
    assert (straight.points[0].index, straight.points[-1].index) == (0, len(loads))


@pytest.fixture(scope="module")
def pinned():
    return contin.trace(contin.solve(PINNED, [0.0]), free=["load"], limits={"load": (1, 42)})


@pytest.mark.sample(1)
@pytest.mark.parametrize("mode", [1, 2])
def test_pinned_elastica_beyond_buckling(pinned, mode):
    """Load (2 j K)^2 and chord 2E/K - 1, of modulus sin(alpha/2), alpha the angle of the ends (Love, Elasticity, sect. 263).

    The ends meet where 2E = K: load 2.1833790462 pi^2 j^2, at 130.70991 degrees. There the figure of eight turns about its
    crossing at no cost: a branch point.
    """
    start = pinned.labelled("BP")[mode - 1]
    buckled = contin.trace(start, branch=1, limits={"load": (1, 2.3 * (mode * math.pi) ** 2)})
    for point in buckled.points[1:]:
        m = math.sin(point.system.states(point.x)[0, 0] / 2) ** 2
        assert math.isclose(point["load"], (2 * mode * ellipk(m)) ** 2, rel_tol=1e-9)
        assert math.isclose(point["chord"], 2 * ellipe(m) / ellipk(m) - 1, abs_tol=1e-9)
    assert [point.index for point in buckled.points[1:4]] == [mode - 1] * 3
    m = brentq(lambda m: 2 * ellipe(m) - ellipk(m), 0.8, 0.85, xtol=1e-15)
    assert math.isclose((2 * ellipk(m) / math.pi) ** 2, 2.1833790462, rel_tol=1e-10)
    meeting = buckled.labelled("BP")[-1]
    assert math.isclose(meeting["load"], (2 * mode * ellipk(m)) ** 2, rel_tol=1e-10) and abs(meeting["chord"]) < 1e-10
    assert meeting.index_change == (mode - 1, mode)


def test_a_hamiltonian_instead_of_the_energy():
    """The same branch, with numbers equal to round-off."""
    cantilever = VariationalProblem(
        None, ["angle"], {"load": 1.0}, ends=lambda a, b, p: (a.angle,),
        hamiltonian=lambda t, x, lam, p: lam.angle**2 / 2 - p.load * math.cos(x.angle),
    )  # fmt: skip
    straight = contin.trace(contin.solve(cantilever, [0.0]), free=["load"], limits={"load": (1, 25)})
    assert_special(straight, "load", [("BP", ((j + 0.5) * math.pi) ** 2, 1, (j, j + 1)) for j in range(2)])
    bent = contin.trace(straight.labelled("BP")[0], branch=1, limits={"load": (1, 4)})
    stated = planar(lambda a, b, p: (a.angle,), offset=False)
    again = contin.solve(stated, bent.points[-1])
    assert math.isclose(again["energy"], bent.points[-1]["energy"], rel_tol=1e-12)
    assert {point.index for point in bent} == {0}


def stiffening(m):
    """The maximum of m w - (w**2 + w**4 / 4) / 2 over w, found by iteration."""
    (w,) = contin.lowlevel.minimum(lambda w: (w[0] ** 2 + w[0] ** 4 / 4) / 2 - m * w[0], [0.0])
    return m * w - (w**2 + w**4 / 4) / 2


@pytest.mark.full
def test_a_hamiltonian_found_by_iteration():
    """A strip that stiffens as it bends, by its energy and by its Hamiltonian, a Legendre transform at each point."""
    one, other = (
        VariationalProblem(energy, ["angle"], {"load": 2.0}, ends=lambda a, b, p: (a.angle,), hamiltonian=hamiltonian)
        for energy, hamiltonian in (
            (lambda t, x, w, p: (w.angle**2 + w.angle**4 / 4) / 2 + p.load * math.cos(x.angle), None),
            (None, lambda t, x, lam, p: stiffening(lam.angle) - p.load * math.cos(x.angle)),
        )
    )
    for problem in (one, other):
        straight = contin.trace(contin.solve(problem, [0.0]), free=["load"], limits={"load": (2, 25)})
        assert_special(straight, "load", [("BP", ((j + 0.5) * math.pi) ** 2, 1, (j, j + 1)) for j in range(2)])
    bent = contin.trace(straight.labelled("BP")[0], branch=1, limits={"load": (1, 4)}).points[-1]
    assert math.isclose(contin.solve(one, bent)["energy"], bent["energy"], rel_tol=1e-10)


def test_decisions_and_tables_in_an_energy():
    """A bar on springs that act on one side only, with a tabulated stiffness: y'' = y on y > 0, y'' = 0 below; y is known."""
    problem = stated(
        energy=lambda t, x, w, p: (w.y**2 * np.interp(t, [0, 1], [1, 1]) + (x.y**2 if x.y > 0 else 0.0)) / 2 + math.perm(3),
        ends=lambda a, b, p: (a.y - p.a, b.y),
    )
    above, below = (contin.solve(problem, lambda t, a=a: [a * (1 - t)], {"a": a}) for a in (1.0, -1.0))
    t = above.system.nodes
    assert np.abs(above.system.states(above.x)[:, 0] - np.sinh(1 - t) / math.sinh(1)).max() < 1e-10
    assert np.abs(below.system.states(below.x)[:, 0] + 1 - below.system.nodes).max() < 1e-13


def test_units_change_nothing():
    """A steel strip 0.4 m long, bending stiffness 0.02 N m^2, the load in kilonewtons."""
    strip = VariationalProblem(
        lambda t, x, w, p: 0.02 * w.angle**2 / 2 + 1e3 * p.load * math.cos(x.angle), ["angle"], {"load": 1e-4},
        ends=lambda a, b, p: (a.angle,), domain=(0.0, 0.4),
    )  # fmt: skip
    critical = math.pi**2 / 4 * 0.02 / 0.4**2 / 1e3
    straight = contin.trace(contin.solve(strip, [0.0]), free=["load"], limits={"load": (1e-4, 11 * critical)})
    assert_special(straight, "load", [("BP", (2 * j + 1) ** 2 * critical, 1, (j, j + 1)) for j in range(2)])


# --- rods in space: the frame as a quaternion ---------------------------------------------------------------------------

QUATERNION = ["q0", "q1", "q2", "q3"]


def rotation(t, x, w, p):
    return (
        -0.5 * (x.q1 * w.k1 + x.q2 * w.k2 + x.q3 * w.k3), 0.5 * (x.q0 * w.k1 + x.q2 * w.k3 - x.q3 * w.k2),
        0.5 * (x.q0 * w.k2 + x.q3 * w.k1 - x.q1 * w.k3), 0.5 * (x.q0 * w.k3 + x.q1 * w.k2 - x.q2 * w.k1),
    )  # fmt: skip


def clamped(a, b, p):
    """The frame is given at both ends; the last one is turned by phi. The length of q is kept by the kinematics."""
    c, s = math.cos(p.phi / 2), math.sin(p.phi / 2)
    return a.q0 - 1, a.q1, a.q2, a.q3, c * b.q1 + s * b.q2, c * b.q2 - s * b.q1, c * b.q3 - s * b.q0


def rod(p, w):
    return (w.k1**2 + w.k2**2 + p.C * w.k3**2) / 2


def along(x):
    return x.q0**2 - x.q1**2 - x.q2**2 + x.q3**2


SIDEWAYS = {
    "x": lambda t, x, w, p: 2 * (x.q1 * x.q3 + x.q0 * x.q2), "y": lambda t, x, w, p: 2 * (x.q2 * x.q3 - x.q0 * x.q1),
}  # fmt: skip


def straight_rod(phi):
    return lambda t: [math.cos(phi * t / 2), 0, 0, math.sin(phi * t / 2)]


CLAMPED_ROD = VariationalProblem(
    lambda t, x, w, p: rod(p, w) - p.tension * along(x), QUATERNION, {"phi": 1.0, "C": 0.8, "tension": 0.0},
    kinematics=rotation, controls=["k1", "k2", "k3"], ends=clamped, integrals=SIDEWAYS,
)  # fmt: skip


@pytest.mark.full
def test_twisted_clamped_rod():
    """Greenhill 1883: M L/2B = 4.4934..., M = C phi; two modes at once, as the rod is isotropic (Love, sect. 272)."""
    start = contin.solve(CLAMPED_ROD, straight_rod(10), {"phi": 10.0})
    twisted = contin.trace(start, free=["phi"], limits={"phi": (10, 12)})
    assert_special(twisted, "phi", [("BP", 2 * TANGENT / 0.8, 2, (0, 2))])


@pytest.mark.full
def test_twisted_clamped_rod_under_thrust():
    """Beam equation u'''' - i M u''' - T u'' = 0, u = u' = 0 at the ends: zero of its determinant (Love, sect. 272)."""
    moment = 0.8 * 1.0

    def determinant(tension):
        root = np.emath.sqrt(moment**2 / 4 - tension)
        r = 1j * (moment / 2 + root), 1j * (moment / 2 - root)
        rows = [[1, 0, 1, 1], [0, 1, *r], [1, 1, *np.exp(r)], [0, 1, *(r * np.exp(r))]]
        return (np.linalg.det(np.array(rows)) * np.exp(-0.5j * moment) / root).imag

    thrust = contin.trace(
        contin.solve(CLAMPED_ROD, straight_rod(1.0), {"tension": -38.0}), free=["tension"], direction=-1,
        limits={"tension": (-40, -38)},
    )  # fmt: skip
    assert_special(thrust, "tension", [("BP", brentq(determinant, -38.5, -39.5, xtol=1e-13), 2, (0, 2))])


@pytest.mark.full
def test_twisted_pinned_rod():
    """Greenhill 1883: (M/2B)^2 - T/B = (pi/L)^2, from B u'' - i M u' - T u = 0, u = 0 at the ends."""
    pinned = VariationalProblem(
        lambda t, x, w, p: (w.a**2 + w.b**2) / 2 + p.M / 2 * (x.a * w.b - x.b * w.a) + p.T * (x.a**2 + x.b**2) / 2,
        ["a", "b"], {"M": 5.0, "T": 0.0}, ends=lambda a, b, p: (a.a, a.b, b.a, b.b),
    )  # fmt: skip
    twisted = contin.trace(contin.solve(pinned, [0, 0], {"T": 10.0}), free=["M"], limits={"M": (5, 10)})
    assert_special(twisted, "M", [("BP", 2 * math.sqrt(math.pi**2 + 10), 2, (0, 2))])


@pytest.mark.full
def test_closed_twisted_rod():
    """Michell 1889, Zajac 1962: a ring of a straight rod buckles at a twist of 2 pi sqrt(3) B/C.

    The frame is fixed at one place; the ring could still turn about its tangent there: one condition more, on its height.
    """
    closure = {
        **SIDEWAYS, "z": lambda t, x, w, p: along(x), "phase": lambda t, x, w, p: t * 2 * (x.q2 * x.q3 - x.q0 * x.q1)
    }  # fmt: skip
    ring = VariationalProblem(
        lambda t, x, w, p: rod(p, w), QUATERNION, {"phi": 13.0, "C": 0.8}, kinematics=rotation, controls=["k1", "k2", "k3"],
        ends=clamped, integrals=closure,
    )  # fmt: skip

    def circle(t):
        (c, s), (d, z) = [(math.cos(angle), math.sin(angle)) for angle in (math.pi * t, 6.5 * t)]
        return c * d, s * z, s * d, c * z

    twisted = contin.trace(contin.solve(ring, circle), free=["phi"], limits={"phi": (13, 14.5)})
    assert_special(twisted, "phi", [("BP", 2 * math.pi * math.sqrt(3) / 0.8, 2, (0, 2))])
    assert abs(twisted.points[0]["mu_phase"]) < 1e-9


@pytest.mark.full
def test_helix_under_a_wrench():
    """Constant strains k: from m' = 0 = k x m + d3 x n, the force along the axis is (C - B) k3 |k| (Love, sect. 271)."""
    k, C = np.array([0.3, 1.1, 0.7]), 0.6
    size = math.sqrt(k @ k)

    def helix(t):
        return [math.cos(size * t / 2), *(math.sin(size * t / 2) * k / size)]

    e = [float(value) for value in helix(1.0)]
    s, c = math.sin(size) / size, (1 - math.cos(size)) / size  # integrals of cos and sin of |k| t
    axis, d3 = k / size, np.array([0.0, 0.0, 1.0])
    reach = [float(value) for value in axis * axis[2] * (1 - s) + d3 * s + np.cross(axis, d3) * c]
    held = VariationalProblem(
        lambda t, x, w, p: rod(p, w), QUATERNION, {"C": C, "e0": e[0], "e1": e[1], "e2": e[2], "e3": e[3]}, kinematics=rotation,
        controls=["k1", "k2", "k3"], integrals={
            "x": lambda t, x, w, p: 2 * (x.q1 * x.q3 + x.q0 * x.q2) - reach[0],
            "y": lambda t, x, w, p: 2 * (x.q2 * x.q3 - x.q0 * x.q1) - reach[1], "z": lambda t, x, w, p: along(x) - reach[2],
        },
        ends=lambda a, b, p: (
            a.q0 - 1, a.q1, a.q2, a.q3, p.e0 * b.q1 - p.e1 * b.q0 - p.e2 * b.q3 + p.e3 * b.q2,
            p.e0 * b.q2 - p.e2 * b.q0 - p.e3 * b.q1 + p.e1 * b.q3, p.e0 * b.q3 - p.e3 * b.q0 - p.e1 * b.q2 + p.e2 * b.q1,
        ),
    )  # fmt: skip
    point = contin.solve(held, helix)
    force = [point["mu_x"], point["mu_y"], point["mu_z"]]
    np.testing.assert_allclose(np.abs(force), np.abs((C - 1) * k[2] * k), rtol=1e-9)
    assert math.isclose(point["energy"], (k[0] ** 2 + k[1] ** 2 + C * k[2] ** 2) / 2, rel_tol=1e-10)
    assert second_variation(point.system, point.x).index() == 0


# --- no rods ------------------------------------------------------------------------------------------------------------


def test_catenoid():
    """Two rings of radius 1: cosh(a)/a is least where a tanh a = 1, gap 2a/cosh a = 1.3254868 there (Goldschmidt 1831)."""
    film = VariationalProblem(
        lambda t, x, w, p: x.r * math.sqrt(p.gap**2 + w.r**2), ["r"], {"gap": 1.0}, ends=lambda a, b, p: (a.r - 1, b.r - 1)
    )
    branch = contin.trace(contin.solve(film, [1.0]), free=["gap"], limits={"gap": (0.9, 1.5)})
    a = brentq(lambda a: a * math.tanh(a) - 1, 1, 1.5, xtol=1e-15)
    assert_special(branch, "gap", [("LP", 2 * a / math.cosh(a), 1, (0, 1))])
    for point in branch:
        half = np.arccosh(1 / float(point.system.evaluate(point.x, np.array([0.5]))[0, 0]))  # r = cosh(a (2t - 1)) / cosh a
        assert math.isclose(point["energy"], (half + math.sinh(2 * half) / 2) / math.cosh(half) ** 2, abs_tol=1e-6)


def test_bratu():
    """u'' + lam e^u = 0: lam = 8 (z / cosh z)^2 is largest where z tanh z = 1 (Bratu 1914)."""
    bratu = VariationalProblem(
        lambda t, x, w, p: w.u**2 / 2 - p.lam * math.exp(x.u), ["u"], {"lam": 1.0}, ends=lambda a, b, p: (a.u, b.u),
        functionals={"mean": lambda t, x, w, p: x.u},
    )  # fmt: skip
    branch = contin.trace(contin.solve(bratu, [0.0]), free=["lam"], limits={"lam": (1, 4), "mean": (0, 2)})
    z = brentq(lambda z: z * math.tanh(z) - 1, 1, 1.5, xtol=1e-15)
    assert_special(branch, "lam", [("LP", 8 * (z / math.cosh(z)) ** 2, 1, (0, 1))])


# --- what is refused ----------------------------------------------------------------------------------------------------


def stated(**changed):
    given = {
        "energy": lambda t, x, w, p: w.y**2 / 2, "states": ["y"], "parameters": {"a": 1.0},
        "ends": lambda a, b, p: (a.y, b.y),
    }  # fmt: skip
    return VariationalProblem(**{**given, **changed})


@pytest.mark.parametrize(
    "changed, message",
    [
        ({"energy": lambda t, x, w, p: -(w.y**2)}, "energy: it is not convex in the controls y"),
        ({"energy": lambda t, x, w, p: x.y**2}, "energy: its second derivative by the control y is zero"),
        ({"energy": lambda t, x, w, p: (w.y + w.z) ** 2, "states": ["y", "z"]}, "energy: it does not determine the controls"),
        ({"energy": lambda t, x, w, p: w.y * w.z, "states": ["y", "z"]}, "energy: it is not convex in the controls y, z"),
        ({"energy": lambda t, x, w, p: w.y**2 * float(str(x.y))}, "energy cannot be differentiated"),
        ({"energy": lambda t, x, w, p: w.y**2 + np.fft.fft([x.y]).real[0]}, "energy cannot be differentiated"),
        ({"energy": lambda t, x, w, p: None}, "energy returns None, must return numbers"),
        ({"energy": lambda t, x, w, p: w.y**2 + x.y * math.nan}, "energy has no finite real value"),
        ({"energy": lambda t, x, w, p: (w.y**2, 1)}, "energy returns 2 values, must return 1"),
        ({"energy": lambda t, x, w, p: w.z**2}, "energy cannot be differentiated: 'Values' object has no attribute 'z'"),
        ({"energy": lambda t, x, w: 1.0}, "energy must take 4 arguments"),
        ({"energy": None}, "energy: None must be a function"),
        ({"energy": lambda t, x, w, p: w.y**2 - math.log(w.y)}, r"starts: the energy has no value at the controls y = 0"),
        ({"starts": {"z": 1.0}}, "starts: 'z' is not one of the controls"),
        ({"sizes": {"z": 1.0}}, "sizes: 'z' must be one of"),
        ({"sizes": {"y": 0.0}}, "sizes: y: 0.0 must be a number between 0 and inf"),
        ({"starts": {"y": math.inf}}, "starts: y: inf must be a finite number"),
        ({"ends": lambda a, b, p: (a.y, a.y)}, "ends: condition 2 repeats or contradicts"),
        ({"ends": lambda a, b, p: (a.y + b.y, a.y + b.y - 1)}, "ends: condition 2 repeats or contradicts"),
        ({"ends": lambda a, b, p: (a.y, b.y, a.y + b.y)}, "ends returns 3 conditions, 2 fix all states"),
        ({"ends": lambda a, b, p: (p.a - 1, b.y)}, "ends: condition 1 depends on no state"),
        ({"ends": lambda a, b, p: None}, "ends returns None"),
        ({"end_energy": lambda a, b, p: (1, 2)}, "end_energy returns 2 values"),
        ({"integrals": {"g": lambda t, x, w, p: p.a}}, "integrals: g depends on no state and no control"),
        ({"integrals": {"g h": lambda t, x, w, p: x.y}}, "integrals: 'g h' is not usable"),
        ({"integrals": {"g": lambda t, x, w, p: x.y}, "parameters": {"mu_g": 1.0}}, "parameters: mu_g is the name of a mult"),
        ({"functionals": {"g": lambda t, x, w, p: (x.y, 1)}}, "functionals: g returns 2 values"),
        ({"parameters": {"energy": 1.0}}, "parameters: 'energy' is the name"),
        ({"kinematics": lambda t, x, w, p: (w.y,)}, "controls: their names belong to kinematics"),
        ({"kinematics": lambda t, x, w, p: (x.y,), "controls": ["y"]}, "kinematics: no rate depends on a control"),
        ({"symmetries": {"mirror": 1}}, "symmetries: mirror: 1 must be a function"),
        ({"hamiltonian": lambda t, x, lam, p: lam.y**2}, "hamiltonian: stands instead of energy"),
    ],
)  # fmt: skip
def test_statements_that_cannot_work(changed, message):
    with pytest.raises(contin.ProblemError, match=message):
        stated(**changed)


@pytest.mark.parametrize(
    "changed, message",
    [
        ({"ends": None}, "its second variation vanishes along a mode"),
        ({"integrals": {"g": lambda t, x, w, p: x.y**2}}, "repeat or contradict each other, or have no slope"),
        ({"integrals": {"g": lambda t, x, w, p: x.y, "h": lambda t, x, w, p: 2 * x.y}}, "repeat or contradict each other"),
        ({"energy": lambda t, x, w, p: w.y**2 + math.log(x.y)}, "guess: the equations have no finite value there"),
        ({"energy": lambda t, x, w, p: w.y**2 / (p.a - 1)}, "energy: it has no finite value there"),
    ],
)
def test_guesses_that_determine_nothing(changed, message):
    with pytest.raises(contin.ProblemError, match=message):
        contin.solve(stated(**changed), [0.0])


@pytest.mark.full
def test_the_run_ends_where_convexity_is_lost():
    """L = w^2/2 - w^4/12 is convex for |w| < 1, and w = b.y = a on this branch."""
    problem = stated(energy=lambda t, x, w, p: w.y**2 / 2 - w.y**4 / 12, ends=lambda a, b, p: (a.y, b.y - p.a))
    branch = contin.trace(contin.solve(problem, lambda t: [0.2 * t], {"a": 0.2}), free=["a"], limits={"a": (0, 2)})
    assert "loss of convexity in the controls" in str(branch.stop)
    assert abs(branch.points[-1]["a"] - 1) < 1e-3 and branch.points[-2].index == 0


def test_a_first_point_where_the_energy_is_not_convex():
    problem = stated(energy=lambda t, x, w, p: (w.y**2 - 1) ** 2 / 4)
    branch = contin.trace(contin.solve(problem, [0.0]), free=["a"], limits={"a": (0, 2)})
    assert len(branch) == 1 and "loss of convexity" in str(branch.stop) and branch.points[0].index is None


def test_a_kink_beside_the_states():
    """|y - 3| has the slope -1 below 3: y'' = -1, y = t (1 - t) / 2."""
    point = contin.solve(stated(energy=lambda t, x, w, p: w.y**2 / 2 + abs(x.y - 3)), [0.0])
    middle = point.system.evaluate(point.x, np.array([0.5]))[0, 0]
    assert math.isclose(middle, 1 / 8, rel_tol=1e-12)


def test_division_by_zero_at_the_guess_is_said():
    problem = stated(energy=lambda t, x, w, p: (p.a - 1) * w.y**2 / 2)
    with pytest.raises(contin.ProblemError, match="guess: the equations have no finite value there"):
        contin.solve(problem, [0.0])


@pytest.mark.sample(1)
@pytest.mark.parametrize("before", [1e-1, 1e-4, 1e-8])
def test_changes_of_the_index_behind_a_limit(before):
    """A run that ends right before the first buckling load, 4 pi^2, has index 0 throughout: what its last step passes behind
    the limit is not noted.
    """
    strip = contin.VariationalProblem(
        energy=lambda t, x, w, p: w.angle**2 / 2 + p.load * math.cos(x.angle), states=["angle"], parameters={"load": 30.0},
        ends=lambda a, b, p: (a.angle, b.angle), integrals={"offset": lambda t, x, w, p: math.sin(x.angle)},
    )  # fmt: skip
    last = 4 * math.pi**2 - before
    branch = contin.trace(contin.solve(strip, [0.0]), free=["load"], limits={"load": (30, last)})
    assert branch.stop.reason == "limit" and {point.index for point in branch} == {0} and not branch.notes
    beyond = contin.trace(contin.solve(strip, [0.0]), free=["load"], limits={"load": (30, 4 * math.pi**2 + before)})
    assert [point.index_change for point in beyond.labelled("BP")] == [(0, 1)] and beyond[-1].index == 1 and not beyond.notes
