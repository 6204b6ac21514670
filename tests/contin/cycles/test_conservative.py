"""Conservative systems: pairs stay on the axis or the circle, a second multiplier is 1, normal forms vanish or are infinite."""

import math

import numpy as np
import pytest
from scipy.optimize import brentq

import contin
from contin import AlgebraicProblem, CycleProblem, MapProblem

MASS = 0.01215  # of the moon, as a part of both


def restricted(u, p):
    """The restricted three-body problem, with a damping that stays zero."""
    near, far = ((u.x - 1 + MASS) ** 2 + u.y**2 + u.z**2) ** -1.5, ((u.x + MASS) ** 2 + u.y**2 + u.z**2) ** -1.5
    pull = (1 - MASS) * far + MASS * near
    return (
        u.vx, u.vy, u.vz, 2 * u.vy + u.x - (1 - MASS) * (u.x + MASS) * far - MASS * (u.x - 1 + MASS) * near + p.l * u.vx,
        -2 * u.vx + u.y - pull * u.y + p.l * u.vy, -pull * u.z + p.l * u.vz,
    )  # fmt: skip


STATES = ["x", "y", "z", "vx", "vy", "vz"]


def axis_of(x):
    return x - (1 - MASS) / (x + MASS) ** 2 + MASS / (x - 1 + MASS) ** 2


@pytest.fixture(scope="module")
def lyapunov_family():
    """The planar family that leaves the libration point L1, in the period."""
    rest = brentq(axis_of, 0.5, 0.98)
    point = contin.solve(AlgebraicProblem(restricted, STATES, {"l": 0.0}), [rest, 0, 0, 0, 0, 0])
    values, vectors = np.linalg.eig(point.system.jacobian(point.x)[:, :6])
    planar = [k for k in range(6) if values[k].imag > 0 and abs(vectors[2, k]) < 1e-8][0]
    direction = 0.02 * vectors[:, planar] / np.abs(vectors[:, planar]).max()
    start = contin.solve(
        CycleProblem(restricted, STATES, {"l": 0.0}),
        lambda t: np.array([rest, 0, 0, 0, 0, 0]) + (direction * np.exp(2j * math.pi * t)).real,
        {"period": 2 * math.pi / values[planar].imag * 1.0005}, free=["l"], degree=7,
    )  # fmt: skip
    return contin.trace(start, free=["l", "period"], primary="period", limits={"period": (2.6, 6)})


@pytest.mark.full
def test_the_labels_of_a_family_of_three_bodies(lyapunov_family):
    """Branch points where the vertical pair is 1: halo orbits, and the axial family; and a period doubling where it is -1.

    No torus: the pair stays on the circle between the second branch point and the doubling.
    """
    assert [point.label for point in lyapunov_family if point.label] == ["EP", "BP", "BP", "PD", "EP"]
    assert not lyapunov_family.notes
    halo, axial, doubling = (point for point in lyapunov_family if point.label in ("BP", "PD"))
    for point, multiplier in ((halo, 1), (axial, 1), (doubling, -1)):
        assert vertical_trace(point) == pytest.approx(2 * multiplier, abs=1e-7)
    assert lyapunov_family.column("l") == pytest.approx(0, abs=1e-11)


def vertical_trace(point):
    """The trace of the map of z and z' over one round, by integration: 2 and -2 where a pair is 1 and -1."""
    from scipy.integrate import solve_ivp

    def rates(t, v):
        near, far = ((v[0] - 1 + MASS) ** 2 + v[1] ** 2) ** -1.5, ((v[0] + MASS) ** 2 + v[1] ** 2) ** -1.5
        pull = (1 - MASS) * far + MASS * near
        of_x = 2 * v[3] + v[0] - (1 - MASS) * (v[0] + MASS) * far - MASS * (v[0] - 1 + MASS) * near
        return [v[2], v[3], of_x, -2 * v[2] + v[1] - pull * v[1], v[5], -pull * v[4], v[7], -pull * v[6]]

    first = point.system.states(point.x)[0]
    start = [*first[[0, 1, 3, 4]], 1, 0, 0, 1]
    end = solve_ivp(rates, (0, point["period"]), start, rtol=1e-12, atol=1e-13, method="DOP853").y[:, -1]
    return end[4] + end[7]


@pytest.mark.full
def test_unstable_multipliers_of_the_family(lyapunov_family):
    """One of the planar pair is outside, and one of the vertical pair where that is real; never the second 1."""
    first, second, third = (point["period"] for point in lyapunov_family if point.label in ("BP", "PD"))
    for point in lyapunov_family:
        if not point.label:
            real = first < point["period"] < second or point["period"] > third
            assert point.floquet().unstable == 1 + real


@pytest.mark.full
def test_no_normal_form_at_a_doubling_in_a_family(lyapunov_family):
    """Its equations are singular, as a second multiplier is 1: a number was printed, 8e12, that is nothing but error."""
    (doubling,) = lyapunov_family.labelled("PD")
    assert doubling.name == "period doubling" and doubling.normal_form is None


def test_orbits_of_conservative_maps_have_no_tori():
    """Henon's map that keeps areas: the trace of its derivative is -2 a x, -2 at a = 3."""
    henon = MapProblem(lambda u, p: (1 + u.y - p.a * u.x**2, -u.x), ["x", "y"], {"a": 0.1})
    branch = contin.trace(contin.solve(henon, [0.5, -0.5]), free=["a"], limits={"a": (-0.5, 4)})
    assert [point.label for point in branch if point.label] == ["EP", "PD", "EP"] and not branch.notes
    assert branch.labelled("PD")[0]["a"] == pytest.approx(3, abs=1e-12)


def test_coupled_conservative_maps():
    """Multipliers are -1 where the matrix of second derivatives of the potential has the eigenvalue -4."""

    def standard(u, p):
        both = 0.3 * math.sin(u.x1 + u.x2)
        y1, y2 = u.y1 + p.k * math.sin(u.x1) + both, u.y2 + 0.5 * p.k * math.sin(u.x2) + both
        return u.x1 + y1, y1, u.x2 + y2, y2

    problem = MapProblem(standard, ["x1", "y1", "x2", "y2"], {"k": -0.95})
    branch = contin.trace(contin.solve(problem, [0.0] * 4), free=["k"], direction=-1, limits={"k": (-6, -0.9001)})
    assert [point.label for point in branch if point.label] == ["EP", "PD", "EP"] and not branch.notes
    k = brentq(lambda k: np.linalg.eigvalsh([[k + 0.3, 0.3], [0.3, 0.5 * k + 0.3]]).min() + 4, -6, -1)
    assert branch.labelled("PD")[0]["k"] == pytest.approx(k, abs=1e-11)


def test_a_chain_of_masses_has_no_hopf_points():
    """Six masses on springs that a force bends: all eigenvalues stay on the axis, and round-off moves them by 1e-15."""

    def chain(u, p):
        ends = [0.0, *u[:6], 0.0]
        pulls = [(b - a) + 0.3 * (b - a) ** 2 + (b - a) ** 3 for a, b in zip(ends, ends[1:])]
        return (*u[6:], *(pulls[i + 1] - pulls[i] - 0.5 * math.sin(u[i]) + p.f for i in range(6)))

    names = [f"{kind}{i}" for kind in "qv" for i in range(6)]
    branch = contin.trace(
        contin.solve(AlgebraicProblem(chain, names, {"f": 0.01}), [0.0] * 12), free=["f"], limits={"f": (0, 3)}
    )
    assert [point.label for point in branch if point.label] == ["EP", "EP"] and not branch.notes


CENTRES = {
    "pendulum": (lambda u, p: (u.v, -math.sin(u.x) - p.d * u.v), [0, 0]),
    "predators": (lambda u, p: (u.x * (1 - u.v) - p.d * u.x**2, u.v * (u.x - 1)), [1, 1.5]),
    "well": (lambda u, p: (u.v, u.x - u.x**3 - p.d * u.v), [1, 0]),
    "lattice": (lambda u, p: (u.v, 1 - math.exp(u.x) - p.d * u.v), [0, 0]),
    "van der Pol, scaled": (lambda u, p: (u.v, p.d * (1 - 1e-12 * u.x**2) * u.v - u.x), [0, 0]),
}


@pytest.mark.parametrize("name", CENTRES)
def test_centres_are_neither_super_nor_subcritical(name):
    """At d = 0 there is a centre: the first Lyapunov coefficient is zero, and so it is within its error."""
    field, guess = CENTRES[name]
    branch = contin.trace(
        contin.solve(AlgebraicProblem(field, ["x", "v"], {"d": -0.5}), guess), free=["d"], limits={"d": (-0.5, 0.5)}
    )
    (hopf,) = branch.labelled("HB")
    assert hopf.name == "Hopf" and abs(hopf.normal_form or 0.0) <= hopf.details.get("normal_form_error", 0.0) < 1e-12
