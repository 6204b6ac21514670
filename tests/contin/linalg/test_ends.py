"""What condensation leaves between both ends of a mesh: Euler's column u'' + P u = 0, whose solutions are sines and cosines."""

import math

import numpy as np
import pytest

from contin import BoundaryValueProblem
from contin.boundary.system import Collocation
from contin.linalg.blocks import share
from contin.linalg.ends import compared, is_near_one

COLUMN = BoundaryValueProblem(lambda t, u, p: (u.v, -p.P * u.u), lambda a, b, p: (a.u, b.u), ["u", "v"], {"P": 1.0})


def ends(load, intervals=12, problem=COLUMN, segments=1):
    """Return what is left of the matrix of a straight column, bordered by the tangent of its branch."""
    system = Collocation(problem, np.linspace(0, 1, intervals + 1) ** 1.2, 7, ["P"], {})
    system._segments = lambda numbers: share(intervals, numbers, segments)
    x = np.zeros(system.size)
    tangent = np.zeros(system.size)
    x[-1], tangent[-1] = load, 1.0
    return system.mesh, system.linearize(x, (tangent,))[1].ends


def wells(*places):
    """Return eps^2 u'' = (1 - P sech^2 s) u with a well at each place, s = (t - place) / eps, eps = .02; u(0) = u(1) = 0.

    In closed form each holds a mode where P = 2 for eps -> 0 (Poeschl and Teller), exp(-1 / eps) away from the ends.
    """

    def column(t, u, p):
        depth = sum(np.cosh((t - place) / 0.02) ** -2 for place in places)
        return u.v / 0.02, (1 - p.P * depth) * u.u / 0.02

    return BoundaryValueProblem(column, lambda a, b, p: (a.u, b.u), ["u", "v"], {"P": 1.0})


@pytest.mark.parametrize("segments", [1, 2, 4])
@pytest.mark.parametrize("load", [0.0, 3.0, 40.0])
def test_relations_hold_for_every_solution(load, segments):
    """Closed form: cos(w t) and sin(w t) / w, from the first point of a segment on; no load acts on the straight column."""
    mesh, found = ends(load, segments=segments)
    w, each = math.sqrt(load) or 1e-8, 12 // segments
    places = [(mesh[s * each], mesh[s * each + j]) for s in range(segments) for j in range(2, each + 1)]
    assert len(places) == len(found.relations)
    for (start, end), rows in zip(places, found.relations):
        t = end - start
        for u, v, u_0, v_0 in ((math.cos(w * t), -w * math.sin(w * t), 1, 0), (math.sin(w * t) / w, math.cos(w * t), 0, 1)):
            assert rows @ [u_0, v_0, u, v, 0] == pytest.approx([0, 0], abs=1e-12)
        assert rows @ rows.T == pytest.approx(np.eye(2), abs=1e-14)


@pytest.mark.parametrize("segments", [1, 2, 3, 6])
@pytest.mark.parametrize(("load", "other", "passed"), [(5, 9, 0), (8, 11, 1), (12, 14, 0), (39, 40, 1), (86, 88, 0)])
def test_a_buckling_load_turns_one_eigenvalue_negative(load, other, passed, segments):
    """Buckling loads are (k pi)^2: 9.87, 39.48, 88.83."""
    before, after = ends(load, segments=segments)[1], ends(other, segments=segments)[1]
    quotient, turn = compared(before, after)
    values = np.linalg.eigvals(quotient)
    assert (np.count_nonzero((np.abs(values.imag) < 1e-9) & (values.real < 0)), turn < 0.5) == (passed, True)


def test_half_waves_between_two_loads_show_as_a_turn_inside():
    """From 5 to 500 the column gains six half-waves: the relation of both ends has turned often, and cannot tell how often."""
    before, after = ends(5.0, 40)[1], ends(500.0, 40)[1]
    assert compared(before, after)[1] > 0.9


@pytest.mark.parametrize("places", [(0.5,), (0.3, 0.7)])
@pytest.mark.parametrize(("load", "other"), [(1.9, 2.1), (1.9, 1.95), (2.05, 2.1)])
def test_a_mode_that_no_end_feels_is_seen_inside(places, load, other):
    """Two wells hold two modes that become singular together: the sign of the determinant and both ends are as they were."""
    problem = wells(*places)
    before, after = (ends(value, 80, problem)[1] for value in (load, other))
    quotient, turn = compared(before, after)
    assert quotient == pytest.approx(np.eye(5), abs=0.2)
    assert (turn == math.inf) == (load < 2 < other) and (turn == math.inf or turn < 0.5)


def test_a_single_interval_has_no_inside():
    assert ends(1.0, 1)[1] is None


@pytest.mark.sample(20)
@pytest.mark.parametrize("seed", range(200))
def test_near_one_means_eigenvalues_near_one(seed):
    """Random matrices that are near to the identity, or nearly normal, or neither: against all eigenvalues, by LAPACK."""
    random = np.random.default_rng(seed)
    n = int(random.integers(1, 12))
    matrix = np.eye(n) * 10 ** random.uniform(-1.2, 1.2) + 10 ** random.uniform(-2, 1) * random.standard_normal((n, n))
    values = np.linalg.eigvals(matrix)
    near = np.all((values.real > 0) & (np.abs(values) < 10) & (np.abs(values) > 0.1))
    assert near or not is_near_one(matrix, 0.9, 10.0, np.empty((n, n)))


def test_what_is_near_one_is_seen():
    """1.5 on the diagonal and a rotation in all planes: the symmetric part is 1.5, the distance from one more than .9."""
    turned = 1.5 * np.eye(6) + np.kron(np.eye(3), [[0.0, 1.0], [-1.0, 0.0]])
    assert is_near_one(turned, 0.9, 10.0, np.empty((6, 6))) and is_near_one(np.eye(6) * 1.2, 0.9, 10.0, np.empty((6, 6)))
    assert not is_near_one(np.diag([1.0, 0.05]), 0.9, 10.0, np.empty((2, 2)))
    assert not is_near_one(np.diag([1.0, math.nan]), 0.9, 10.0, np.empty((2, 2)))
