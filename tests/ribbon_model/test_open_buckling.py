"""Thresholds and post-buckling of open strips against linear and weakly nonlinear theory, derived here or cited."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from scipy.optimize import brentq

import contin
from ribbon_model.ends import CLAMP, DIRECTIONS, FREE_END, JOINT, End
from ribbon_model.laws import LAWS
from ribbon_model.open_strip import OpenStrip
from ribbon_model.section import section_of
from ribbon_model.unfolding import first_root

WIDTH, NORMAL, TANGENT = DIRECTIONS.values()
SIDEWAYS = (WIDTH, NORMAL)


def first_branch_point(start, name, low, high):
    """The first branch point of the branch along a number, whose index goes from 0 to 1."""
    branch = contin.trace(start, free=[name], limits={name: (low, high)}, direction=1 if high > start[name] else -1)
    point = branch.labelled("BP")[0]
    assert point.index_change == (0, 1)
    assert not branch.notes
    return point


# --- an arc whose ends are turned -------------------------------------------------------------------------------------


@pytest.mark.full
@pytest.mark.parametrize("law, first", [("ribbon", 0.0), ("isotropic rod", 0.0), ("flat rod", 2.0)])
def test_an_unfolded_semicircle_leaves_its_plane(law, first):
    """Ends turned by xi pi, free to move in the plane: the first root of equations (20) (Audoly & Seffen 2015, section 5).

    At nu = .3: .6959 (ribbon), 1.72 (isotropic rod), 4.05 (flat rod, which is indeterminate where it is straight: from xi = 2).
    """
    strip = OpenStrip(
        section_of(law, {"nu": 0.3, "kappa_n": math.pi}), finish=End(held=(WIDTH,)), numbers={"bend": math.pi * (1 - first)}
    )
    size = math.pi * (1 - first)
    arc = strip.first_point(
        lambda t: [
            math.cos(size * t / 2),
            math.sin(size * t / 2),
            0,
            0,
            0,
            (math.cos(size * t) - 1) / size,
            math.sin(size * t) / size,
        ]
    )
    expected = first_root(LAWS[law], 0.3)
    found = first_branch_point(arc, "bend", math.pi * (1 - expected) - 0.01, size)
    assert math.isclose(1 - found["bend"] / math.pi, expected, rel_tol=1e-8)


# --- a rod between universal joints, under tension, twisted -----------------------------------------------------------


def jointed(moment: float, tension: float, turn: float) -> float:
    """A determinant that vanishes where a straight rod (B = 1) between universal joints, with this moment about it, buckles.

    With u = x1 + i x2 and a lateral force N: m = M0 u' + i u'', m' = i T u' - i N. A joint lets the end turn about an axis a
    that is fixed in space and about d1, perpendicular to it: m.a = 0 and m.d1 = 0, that is u1'' = -M0 u2' and u2'' = 0 along
    axes that at the last end are turned with it.
    """
    turned, none, unit = np.array([[0.0, -1.0], [1.0, 0.0]]), np.zeros((2, 2)), np.eye(2)
    matrix = np.block([  # u, u', u'', N: two real components each
        [none, unit, none, none], [none, none, unit, none], [none, tension * unit, moment * turned, -unit],
        [none, none, none, none],
    ])  # fmt: skip
    transfer = expm(matrix)

    def conditions(angle):
        c, s = math.cos(angle), math.sin(angle)
        to_end = np.kron(np.eye(4), np.array([[c, s], [-s, c]]))
        rows = np.zeros((4, 8))
        rows[0, 0] = rows[1, 1] = rows[2, 4] = rows[3, 5] = 1
        rows[2, 3] = moment
        return rows @ to_end

    return float(np.linalg.det(np.vstack([conditions(0.0), conditions(turn) @ transfer])))


@pytest.mark.full
@pytest.mark.parametrize("tension", [0.0, 5.0])
def test_a_twisted_rod_between_universal_joints(tension):
    """The pinned counterpart of Greenhill's clamped rod that has an energy.

    Greenhill's own, (M/2B)**2 - T/B = (pi/L)**2, has end moments whose direction is fixed in space. No support with an energy
    provides them (Ziegler 1977), so no scene can state it.
    """
    joint, C = {"axis": NORMAL, "director": 0}, 0.8
    rod = section_of("rod", {"B1": 1.0, "B2": 1.0, "C": C})
    strip = OpenStrip(rod, End(JOINT, **joint), End(JOINT, **joint, held=SIDEWAYS), {"turn": 1.0, "force_tangent": tension})
    start = strip.first_point(lambda t: (math.cos(t / 2), 0, 0, math.sin(t / 2), 0, 0, t))
    turns = np.linspace(1, 12, 400)
    values = [jointed(C * turn, tension, turn) for turn in turns]
    i = next(i for i in range(len(turns) - 1) if values[i] * values[i + 1] < 0)
    expected = brentq(lambda turn: jointed(C * turn, tension, turn), turns[i], turns[i + 1], xtol=1e-13)
    found = first_branch_point(start, "turn", 0.9, expected + 0.1)
    assert math.isclose(found["turn"], expected, rel_tol=1e-8)


# --- a strip under tension whose end is turned ------------------------------------------------------------------------


def twisted(nu: float, tension: float, low: float, high: float) -> float:
    """The least turn between two at which a flat rod under tension buckles: eight linear equations, constant coefficients.

    On the directors a' = w m2 + n2, m2' = (M3 - w) a - n1, n1' = w n2, n2' = T a - w n1 with M3 = 2 w/(1 + nu). For rotation
    and place psi1' = w psi2 + a, psi2' = -w psi1, x1' = w x2 + psi2, x2' = -w x1 - psi1, which vanish at both ends.
    """

    def determinant(w):
        matrix = np.zeros((8, 8))
        matrix[0, [1, 3]], matrix[1, [0, 2]] = (w, 1), (2 * w / (1 + nu) - w, -1)
        matrix[2, 3], matrix[3, [0, 2]] = w, (tension, -w)
        matrix[4, [0, 5]], matrix[5, 4] = (1, w), -w
        matrix[6, [5, 7]], matrix[7, [4, 6]] = (1, w), (-1, -w)
        return np.linalg.det(expm(matrix)[4:, :4])

    grid = np.linspace(low, high, 3000)  # for nu > 1/3 the first two lie close together
    values = [determinant(w) for w in grid]
    i = next(i for i in range(len(grid) - 1) if values[i] * values[i + 1] < 0)
    return brentq(determinant, grid[i], grid[i + 1], xtol=1e-13)


def endless(nu: float) -> float:
    """Twist/sqrt(T/B) at which an infinite strip buckles, B of the plate: 1/(1 - nu) for nu < 1/3 (Audoly & Neukirch 2021).

    Perturbations exp(i k s) of the equations of `twisted` obey U X**2 - (w M3 + T) X + 2 T w**2 = 0 with X = w**2 - k**2 and,
    where the plate's B = 1, U = 1 - nu**2 and M3 = 2 (1 - nu) w. There are real k first at k = 0 for nu < 1/3, where
    T = w (M3 - w U) = (1 - nu)**2 w**2, else where the discriminant vanishes.
    """
    if nu < 1 / 3:
        return 1 / (1 - nu)
    return 1 / math.sqrt(brentq(lambda T: (2 * (1 - nu) + T) ** 2 - 8 * T * (1 - nu**2), (1 - nu) ** 2, 1 - nu))


@pytest.mark.full
@pytest.mark.parametrize("nu", [0.0, 0.2, 0.4])
def test_the_twist_threshold_of_a_long_strip(nu):
    """At T and 2 T, that is sqrt(2) times the length: each against the determinant, and nearer and nearer to `endless`.

    At T = 400 it is 1.6 % above (nu = 0), .6 % (.2), .2 % (.4). From 800 on the determinant loses its digits.
    """
    plate = 1 - nu**2  # B of the beam over that of the plate
    above = []
    for tension in (100.0, 200.0, 400.0):
        limit = endless(nu) * math.sqrt(tension * plate)
        expected = twisted(nu, tension, 0.95 * limit, 1.3 * limit)
        strip = OpenStrip(
            section_of("flat rod", {"nu": nu}), CLAMP, End(held=SIDEWAYS), {"turn": 0.95 * limit, "force_tangent": tension}
        )
        found = first_branch_point(strip.first_point(strip.twisted(0.95 * limit)), "turn", 0.9 * limit, 1.01 * expected)
        assert math.isclose(found["turn"], expected, rel_tol=1e-8)
        above.append(expected / limit - 1)
    assert all(0 < after < 0.7 * before for before, after in zip(above, above[1:]))
    assert above[-1] < 0.016


# --- a strip that buckles under its weight, beyond the threshold ------------------------------------------------------

#: Powers of the amplitude that are kept, with 1.
ORDERS = 4


def times(a, b):
    """The product of power series, truncated."""
    return np.convolve(a, b)[:ORDERS]


def cross(a, b):
    """The cross product of vectors of power series, shape (3, ORDERS)."""
    return np.array([times(a[i], b[j]) - times(a[j], b[i]) for i, j in ((1, 2), (2, 0), (0, 1))])


def amplitude_law(nu: float, stretch: float, plate: float) -> tuple[float, float]:
    """Return w0 and w2 of weight = w0 + w2 a**2 + O(a**4) where a is how far the tip of a cantilever on edge has gone sideways.

    All quantities are power series in a, with r2(1) = a. Strains to third order from U = plate (w1**2/2 + w3**2/(1 + nu))
    + stretch (w3**2 + nu w1**2)**2/2: a flat rod has (stretch, plate) = (0, 1), a strip of finite width (C/180, 1 - nu**2).
    """
    twist = 2 / (1 + nu) * plate

    def strains(M):
        first = M[0] / plate, M[2] / twist
        Q = times(first[1], first[1]) + nu * times(first[0], first[0])
        w1 = (M[0] - 2 * nu * stretch * times(first[0], Q)) / plate
        return np.array([w1, np.zeros(ORDERS), (M[2] - 2 * stretch * times(first[1], Q)) / twist])

    def end(unknown):
        """Moment at the tip and its place sideways, as power series."""
        weight = np.array([*unknown[12:], 0.0])

        def rates(s, y):
            y = y.reshape(15, ORDERS)
            d, m, none = y[3:12].reshape(3, 3, ORDERS), y[12:15], np.zeros(ORDERS)
            w = strains(np.array([sum(times(d[i, j], m[j]) for j in range(3)) for i in range(3)]))
            spin = np.array([sum(times(w[i], d[i, j]) for i in range(3)) for j in range(3)])
            force = np.array([-weight * (1 - s), none, none])  # of the part beyond s, along -width
            return np.concatenate([d[2], *(cross(spin, director) for director in d), cross(force, d[2])]).ravel()

        y0 = np.zeros((15, ORDERS))
        y0[[3, 7, 11], 0], y0[12:15] = 1.0, unknown[:12].reshape(3, ORDERS)
        y = solve_ivp(rates, (0, 1), y0.ravel(), "DOP853", rtol=1e-11, atol=1e-11).y[:, -1].reshape(15, ORDERS)
        return np.append(y[12:15].ravel(), y[1, 1:] - [1, 0, 0])

    # the straight strip with the moment -w/2 about the normal, and a guess of its first mode; then Newton's method
    unknown, critical = np.zeros(15), 18.178 / math.sqrt(2) * math.sqrt(plate * twist)
    unknown[[4, 12]], unknown[[1, 9]] = (-critical / 2, critical), (-2.0, 1.0)
    for _ in range(8):
        F = end(unknown)
        slopes = np.array([end(unknown + d) - F for d in 1e-6 * np.eye(15)]).T / 1e-6
        change = np.linalg.lstsq(slopes, F, rcond=1e-9)[0]  # the moment about the normal to third order changes nothing else
        unknown = unknown - change
        if np.abs(change).max() < 1e-9:
            return unknown[12], unknown[14]
    raise ArithmeticError("the expansion was not found")


MATERIALS = {
    "flat rod": (section_of("flat rod", {"nu": 0.3}), (0.3, 0.0, 1.0)),
    "finite width": (section_of("finite width", {"nu": 0.3, "Gamma": 2.0}), (0.3, 3 * 0.91 * 4 / 180, 0.91)),
}  # fmt: skip


@pytest.mark.full
@pytest.mark.parametrize("law", MATERIALS)
def test_the_amplitude_beyond_the_critical_weight(law):
    """weight = w0 + w2 a**2: w2 from two small amplitudes a of the branch, whose a**4 terms cancel."""
    material, numbers = MATERIALS[law]
    critical, slope = amplitude_law(*numbers)
    strip = OpenStrip(material, finish=FREE_END, numbers={"weight": 0.0}, weight_direction=(-1, 0, 0))
    found = first_branch_point(strip.first_point(), "weight", -1, 25)
    assert math.isclose(found["weight"], critical, rel_tol=1e-8)
    amplitudes = 0.02, 0.04
    sideways = contin.trace(found, branch=1, limits={"rise": (-0.05, 0.05)}, zeros={"rise": [*amplitudes, -0.02, -0.04]})
    weights = [point["weight"] for point in sideways.labelled("UZ")]
    slopes = [(weight - critical) / amplitude**2 for weight, amplitude in zip(weights, amplitudes)]
    assert math.isclose((4 * slopes[0] - slopes[1]) / 3, slope, rel_tol=1e-5)
    assert all(point.index == 0 for point in sideways.labelled("UZ"))
