"""Special points on curves of homoclinic orbits, against exact orbits and AUTO-07p's demo ``kpr``.

Exact: the Cartesian leaf x^2 (1 - x) = y^2 is a homoclinic orbit of Sandstede's equations (1997) with nu = 0; the
eigenvalues are a + 1 and a - 1.
"""

import functools
import math

import numpy as np
import pytest
from cycles.noted import NOTES

import contin
from contin import AlgebraicProblem, ConnectionProblem, ProblemError
from contin.connections import branches as homoclinic_points
from contin.connections import equations as connections

#: Where AUTO-07p locates the flips it does so at the tolerance 1e-7 of the demo; at tighter ones it gives up.
AUTO = 2e-6


def leaf(time):
    """The leaf with a = 0 and b = 1, x = 1 / cosh^2(s), y = x', as a function of t from 0 to 1; s = time (t - 1/2) / 2."""

    def orbit(t):
        s = time * (t - 0.5) / 2
        x = 1 / math.cosh(s) ** 2
        return x, -x * math.tanh(s)

    return orbit


def sandstede(u, p):
    """The plane of the leaf: nu breaks it."""
    x, y = u.x, u.y
    return p.a * x + y - p.a * x**2 + p.nu * x * (2 - 3 * x), x + p.a * y - 1.5 * x**2 - 1.5 * p.a * x * y - 2 * p.nu * y


def test_a_neutral_saddle():
    """The eigenvalues a + 1 and a - 1 have the sum 2 a."""
    problem = ConnectionProblem(sandstede, ["x", "y"], {"a": 0.0, "nu": 0.0}, unstable=1)
    orbit = contin.solve(problem, leaf(40), {"time": 40}, free=["nu"], intervals=40)
    start = contin.trace(orbit, free=["a", "nu"], direction=-1, limits={"a": (-0.3, 1)}).points[-1]
    branch = contin.trace(start, free=["a", "nu"], limits={"a": (-0.4, 0.3)})
    assert [point.label for point in branch if point.label] == ["EP", "NSS", "EP"]
    assert branch.labelled("NSS")[0]["a"] == pytest.approx(0, abs=1e-9)


def beside(u, p):
    """With z and w beside the leaf: eigenvalues -r -+ sqrt(-d)."""
    x, y = sandstede(u, p)
    return x, y, -p.r * u.z - u.w * p.d, u.z - p.r * u.w


@functools.cache
def four_dimensional():
    """The leaf with a = -0.2 (eigenvalues .8 and -1.2), r = .3 and d = 1."""
    problem = ConnectionProblem(beside, ["x", "y", "z", "w"], {"a": 0.0, "nu": 0.0, "r": 0.3, "d": 1.0}, unstable=1)
    orbit = contin.solve(problem, lambda t: (*leaf(40)(t), 0.0, 0.0), {"time": 40}, free=["nu"], intervals=40)
    return contin.trace(orbit, free=["a", "nu"], direction=-1, limits={"a": (-0.2, 1)}).points[-1]


@pytest.mark.full
def test_a_saddle_focus():
    """The pair -r -+ i leads: 2 r = .8 is neutrally divergent, r = .8 neutral."""
    branch = contin.trace(four_dimensional(), free=["r", "nu"], limits={"r": (0.1, 1)})
    assert [point.label for point in branch if point.label] == ["EP", "NDS", "NSF", "EP"]
    assert branch.labelled("NDS")[0]["r"] == pytest.approx(0.4, abs=1e-9)
    assert branch.labelled("NSF")[0]["r"] == pytest.approx(0.8, abs=1e-9)


@pytest.mark.full
def test_a_complex_pair_becomes_real():
    """At d = 0 the pair is a double eigenvalue; at d = -.09 = -r^2 one of them is zero."""
    branch = contin.trace(four_dimensional(), free=["d", "nu"], direction=-1, limits={"d": (-0.2, 2)})
    found = [point for point in branch if point.label in ("DRS", "NCH")]
    assert [point.label for point in found] == ["DRS", "NCH"]
    assert [point["d"] for point in found] == pytest.approx([0, -0.09], abs=1e-8)
    assert branch.stop.message == "met non-central homoclinic orbit to a saddle-node"


@pytest.mark.full
def test_a_pair_crosses_the_axis():
    """At r = 0 the pair is imaginary."""
    branch = contin.trace(four_dimensional(), free=["r", "nu"], direction=-1, limits={"r": (-1, 1)})
    assert [point.label for point in branch if point.label] == ["EP", "SH"]
    assert branch.points[-1]["r"] == pytest.approx(0, abs=1e-8)


def flipping(u, p):
    """z' = -z / 2 + mu x: with mu = 0 the leaf comes in along the strong direction."""
    x, y = sandstede(u, p)
    return x + 0.3 * u.z * u.x, y, -u.z / 2 + p.mu * u.x


@pytest.mark.full
def test_an_orbit_flip():
    problem = ConnectionProblem(flipping, ["x", "y", "z"], {"a": 0.0, "nu": 0.0, "mu": 0.0}, unstable=1)
    orbit = contin.solve(problem, lambda t: (*leaf(40)(t), 0.0), {"time": 40}, free=["nu"], intervals=40)
    start = contin.trace(orbit, free=["mu", "nu"], direction=-1, limits={"mu": (-0.1, 1)}).points[-1]
    branch = contin.trace(start, free=["mu", "nu"], limits={"mu": (-0.2, 0.1)})
    assert [point.label for point in branch if point.label and point.label != "NSS"] == ["EP", "OFS", "EP"]
    assert branch.labelled("OFS")[0]["mu"] == pytest.approx(0, abs=1e-9)


def koper(u, p):
    return p.e * (p.k * u.y - u.x**3 + 3 * u.x - p.l), u.x - 2 * u.y + u.z, u.y - u.z


@pytest.mark.full
def test_the_demo_kpr_against_auto():
    """Two inclination flips, and the end: with x = y = z = s, l = k s + 3 s - s^3 has a fold at k = 3 s^2 - 3."""
    problem = AlgebraicProblem(koper, ["x", "y", "z"], {"l": -2.3, "k": -0.15, "e": 10.0})
    line = contin.trace(contin.solve(problem, [2, 2, 2]), free=["l"], limits={"l": (-6, 6)})
    cycles = contin.trace(line.labelled("HB")[1], branch=1, limits={"l": (-6, 6), "period": (0, 92)})
    orbit = contin.homoclinic(cycles.points[-1], free=["l"])
    branch = contin.trace(orbit, free=["l", "k"], primary="k", direction=-1, limits={"k": (-3, 3)}, zeros={"k": [-0.6]})
    known = NOTES["kpr"]["flips"]
    found = [point for point in branch.points[1:] if point.label in ("IFS", "UZ")]
    assert [point.label for point in found] == ["IFS", "IFS", "UZ"]
    for point, row in zip(found, known):
        assert (point["k"], point["l"]) == pytest.approx((row["parameter"], row["second"]), abs=AUTO)
    end = branch.points[-1]
    assert end.label == "NCH"
    s = end["from_x"]
    assert (end["k"], end["l"]) == pytest.approx((3 * s * s - 3, 2 * s**3), abs=1e-8)


def test_a_short_orbit_ends_the_run():
    problem = ConnectionProblem(sandstede, ["x", "y"], {"a": 0.0, "nu": 0.0}, unstable=1)
    orbit = contin.solve(problem, leaf(3), {"time": 3}, free=["nu"], intervals=40)
    branch = contin.trace(orbit, free=["a", "nu"], limits={"a": (-1, 1)})
    assert len(branch) == 1 and "it needs a longer time" in branch.stop.message


def test_an_orbit_in_one_parameter_has_none():
    """With ``time`` free the curve is one orbit, cut off elsewhere."""
    problem = ConnectionProblem(sandstede, ["x", "y"], {"a": 0.0, "nu": 0.0}, unstable=1)
    orbit = contin.solve(problem, leaf(20), {"time": 20}, free=["nu"], intervals=40)
    branch = contin.trace(orbit, free=["nu", "time"], primary="time", limits={"time": (10, 30)})
    assert [point.label for point in branch if point.label] == ["EP", "EP"]
    with pytest.raises(ProblemError, match="must be"):
        contin.curve(orbit, "a")


def test_a_component_that_is_round_off_has_no_sign():
    """z and w do not act on x and y: the orbit's components along them are 0 everywhere, and no flip is found."""
    vector = np.array([0.6, 0.8, 1e-30, -1e-55])
    assert homoclinic_points._component(np.array([0, 0, 0.6, 0.8]), vector) == 0
    assert homoclinic_points._component(np.array([1.0, 0, 0, 0]), vector) == 0.6


def test_a_sum_of_eigenvalues_that_is_round_off_has_no_sign():
    """The saddle of a reversible or conservative system is neutral everywhere."""
    assert homoclinic_points._total(-1.3, 1.3 + 1e-12) == homoclinic_points._total(1.3, -1.3) == 0
    assert homoclinic_points._total(-1.3, 1.3 + 1e-6) == pytest.approx(1e-6, rel=1e-6)


def test_no_orbit_flip_where_the_orbit_ends_too_near_to_the_saddle():
    """After a time of 60 the leaf is 1e-12 away from the saddle: the direction there is Newton's error."""
    problem = ConnectionProblem(flipping, ["x", "y", "z"], {"a": 0.0, "nu": 0.0, "mu": 0.3}, unstable=1)
    orbit = contin.solve(problem, lambda t: (*leaf(60)(t), 0.0), {"time": 60}, free=["nu"], intervals=60)
    branch = contin.trace(orbit, free=["a", "nu"], direction=-1, limits={"a": (-0.1, 1)})
    assert not branch.labelled("OFS")


def test_a_space_that_turned_by_a_right_angle_is_an_error_of_the_step():
    with pytest.raises(contin.ConvergenceError, match="turned by 90 degrees"):
        connections._normalized(np.array([[0.0, 0, 0.6, 0.8]]), np.array([[1.0, 0, 0, 0]]))


def shifting(u, p):
    """The orbit flip of `flipping` at mu = 1 - c^2; with a, the eigenvalues a + 1 and a - 1."""
    x, y = sandstede(u, p)
    return x + 0.3 * u.z * u.x, y, -u.z / 2 + (p.mu + p.c**2 - 1) * u.x


@pytest.mark.full
def test_orbit_flips_in_three_parameters():
    """Closed form: z = 0 where mu = 1 - c^2, and the orbit comes in along the strong direction."""
    problem = ConnectionProblem(shifting, ["x", "y", "z"], {"a": 0.0, "nu": 0.0, "mu": 0.0, "c": 1.0}, unstable=1)
    orbit = contin.solve(problem, lambda t: (*leaf(40)(t), 0.0), {"time": 40}, free=["nu"], intervals=40)
    start = contin.trace(orbit, free=["mu", "nu"], direction=-1, limits={"mu": (-0.1, 1)}).points[-1]
    (flip,) = contin.trace(start, free=["mu", "nu"], limits={"mu": (-0.2, 0.1)}).labelled("OFS")
    flips = contin.curve(flip, "c", limits={"c": (0.5, 2)})
    assert str(flips.stop) == "reached c = 2"
    assert np.abs(flips.column("mu") - 1 + flips.column("c") ** 2).max() < 1e-9
    assert np.abs(flips.column("nu")).max() < 1e-9


#: AUTO-07p's demo ``kpr``, runs 10 and 11, with NTST=200 and EPSL=EPSU=1e-8: l and k of inclination flips at 1/e = 5.
AUTO_FLIPS = [(-1.6118809855, -0.39574479296), (-1.1867433258, -0.84447251569)]


@pytest.mark.full
def test_flips_and_saddle_nodes_of_koper_in_three_parameters():
    """AUTO's curves of inclination flips; the second parameter of an end, l and k of a saddle-node, in closed form.

    The orbit of AUTO takes a time of 60: its inclination flips are known to 3e-7. A minute: each value of the function of a
    flip takes two factored matrices.
    """
    problem = AlgebraicProblem(koper, ["x", "y", "z"], {"l": -1.85, "k": -0.15, "e": 10.0})
    saddle = contin.solve(problem, [-0.95, -0.95, -0.95])
    orbit = contin.homoclinic(saddle, free=["l"], limits={"l": (-1.852, -1.85)}, direction=-1)
    assert orbit["l"] == pytest.approx(NOTES["kpr"]["adjoint"][0]["second"], abs=2e-10)
    orbit = contin.trace(orbit, free=["l", "time"], primary="time", limits={"time": (0, 60)}).points[-1]
    branch = contin.trace(orbit, free=["l", "k"], primary="k", direction=-1, limits={"k": (-3, 3)})
    for flip, known in zip(branch.labelled("IFS"), AUTO_FLIPS, strict=True):
        (point,) = contin.curve(flip, "e", direction=-1, limits={"e": (4.9, 12)}, zeros={"e": [5.0]}).labelled("UZ")
        assert (point["l"], point["k"]) == pytest.approx(known, abs=3e-7)
    ends = contin.curve(branch.points[-1], "e", direction=-1, limits={"e": (4.0, 12)})
    assert str(ends.stop) == "reached e = 4"
    s = ends.column("from_x")
    assert np.abs(ends.column("k") - 3 * s * s + 3).max() < 1e-10
    assert np.abs(ends.column("l") - 2 * s**3).max() < 1e-10
