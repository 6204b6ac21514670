"""Ends of branches that were once wrong. Every number is from the exact quadrature; ends are the linear theory's, too."""

import pytest

from contin import MeshControl, Settings, trace
from contin.lowlevel import point_of
from ribbon_model import exact
from ribbon_model.laws import LAWS
from ribbon_model.linear import thresholds
from ribbon_model.seeds import primary_branch

SETTINGS = {"trivial": "M2", "limits": {"kappa_n": (-100, 100)}, "max_step": 10.0, "mesh": MeshControl(1e-12, 8, 2000, 3)}


def branch(law, m, n, nu, **options):
    system, x, tangent = primary_branch(LAWS[law], m, n, nu, 8, 7)
    return trace(point_of(system, x), Settings(**SETTINGS, **options), tangent=tangent)


@pytest.mark.full
@pytest.mark.parametrize(
    ("m", "n", "nu", "kappa_n"),
    [
        (7, 2, -0.9, 28.4080515158756),
        (5, 2, -0.9635629915204633, 30.092641962769815),
        (5, 2, -0.95825855657028, 26.564392012258836),
        (9, 3, -0.9693450601893002, 97.86350971574171),
        (8, 3, -0.9154444474934175, 25.78157586504),
        (9, 2, -0.9351949211296371, 72.9999751152),
    ],
)
def test_an_isotropic_rod_stays_off_the_circle_until_its_end(m, n, nu, kappa_n):
    """The end is steep: Newton's method went over to the circle, where M2 is round-off, and its sign a matter of chance."""
    covering, known = exact.end(m, n, nu, "isotropic rod")
    assert known == pytest.approx(kappa_n, rel=1e-11)
    found = branch("isotropic rod", m, n, nu)
    assert found.stop.reason == "trivial branch" and not found.labelled("LP")
    last = found.points[-1]
    assert last["kappa_n"] == pytest.approx(known, abs=10 * last.errors["kappa_n"] + 1e-11)
    assert last["kappa_star"] == pytest.approx(covering, abs=1e-8)
    if covering != n:
        values = thresholds(LAWS["isotropic rod"], covering, n, nu)
        assert min(abs(last["kappa_n"] - value) for value in values) < 1e-9


@pytest.mark.full
def test_a_ribbon_goes_on_past_a_homoclinic_orbit():
    """(9, 1), nu = -.5: M2 falls to round-off from kappa_n = -30 on; the branch runs on to the limit."""
    found = branch("ribbon", 9, 1, -0.5)
    end = exact.curve(9, 1, -0.5)[-1]
    assert found.stop.reason == "limit" and end.label == "EP"
    assert found.points[-1]["kappa_star"] == pytest.approx(end.kappa_star, abs=1e-8)
    assert [point.label for point in found.points if point.label] == ["BP", "EP"]


@pytest.mark.parametrize("search", [True, False])
@pytest.mark.parametrize("nu", [-0.0033, -0.033])
def test_no_fold_beside_a_flat_pitchfork(nu, search):
    """(9, 8): along the whole branch kappa_n changes by 4e-4 of itself, so tangents near its end are round-off there."""
    found = branch("isotropic rod", 9, 8, nu, branch_points=search)
    assert [point.label for point in found.points if point.label] == ["BP", "EP"]
    assert found.points[-1]["kappa_n"] == pytest.approx(exact.end(9, 8, nu, "isotropic rod")[1], abs=1e-11)


@pytest.mark.sample(1)
@pytest.mark.parametrize(("n", "nu"), [(38, 0.37), (60, 0.3)])
def test_a_circle_is_left_where_the_law_bends_on_a_small_scale(n, nu):
    """kappa_n lies just below m / nu: the ribbon's a = c - nu kappa_n is 6e-4 on the circle of (1, 38)."""
    system, x, tangent = primary_branch(LAWS["ribbon"], 1, n, nu, 8, 7)
    assert abs(tangent[system.parameter_index("kappa_n")]) < 1e-6  # a pitchfork
    found = trace(point_of(system, x), Settings(**SETTINGS), tangent=tangent)
    end = exact.curve(1, n, nu)[-1]
    assert found.stop.reason == "limit" and found.points[-1]["kappa_star"] == pytest.approx(end.kappa_star, abs=1e-8)
