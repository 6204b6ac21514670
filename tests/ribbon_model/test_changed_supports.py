"""A state with other ends: an equilibrium at once, with the reactions as loads; and the index that follows from the old one."""

import math

import numpy as np
import pytest

import contin
from ribbon_model.changed_supports import angles_near, with_supports
from ribbon_model.ends import BALL, CLAMP, DIRECTIONS, End, hinge, prescribed
from ribbon_model.loads import REPLACING, replacing_loads
from ribbon_model.open_strip import OpenStrip
from ribbon_model.section import section_of

WIDTH, NORMAL, TANGENT = DIRECTIONS.values()
ROD = section_of("rod", {"B1": 1.0, "B2": 4.0, "C": 0.8})


def released(before, finish):
    return OpenStrip(before.section, before.start, finish, dict.fromkeys(replacing_loads(finish), 0.0))


def with_ends(strip, point, follow):
    return with_supports(strip, point, follow, [name for name in REPLACING if name in strip.numbers])


def continued(strip, point, follow):
    """The state with these ends, corrected; nothing is left to correct."""
    system, x = with_ends(strip, point, follow)
    assert np.abs(system.residual(x)).max() < 1e-8
    return contin.lowlevel.point_of(system, contin.lowlevel.correct(system, x, *_held(system, x, follow)).x)


def _held(system, x, follow):
    row = np.zeros(system.size)
    row[system.parameter_index(follow)] = 1.0
    return row, row @ x


@pytest.mark.full
def test_a_fold_in_the_moment_is_where_the_index_under_it_changes():
    """An arch whose end is bent back: with the moment prescribed instead of the angle, the index has one more where the moment
    falls with the angle (Maddocks 1987), and the two are equilibria of the same force, moment and energy.
    """
    arch = OpenStrip(ROD, CLAMP, CLAMP, {"distance": 0.9, "bend": 0.0})
    branch = contin.trace(
        arch.first_point(arch.arch()), free=["bend"], limits={"bend": (-1, 0.3)}, direction=-1, max_points=28
    )  # fmt: skip
    assert [point.index_change for point in branch.labelled("LP")] == [(0, 1)]
    strip = released(arch, hinge("width"))
    points = [point for point in branch if not point.label]
    moments = [arch.reactions(point)["M_width"] for point in points]
    found = set()
    for place in range(2, len(points) - 2, 3):
        rise = [values[place + 1] - values[place - 1] for values in (moments, [point["bend"] for point in points])]
        other = continued(strip, points[place], "moment")
        if min(map(abs, rise)) > 1e-2:  # elsewhere the difference of neighbours does not tell its sign
            falls = rise[0] * rise[1] < 0
            assert other.second_variation().index() == points[place].index + falls
            found.add((points[place].index, falls))
        assert math.isclose(other["moment"], moments[place], rel_tol=1e-8)
        assert math.isclose(strip.potential(other), points[place]["energy"], rel_tol=1e-8)  # it has not turned about its hinge
    assert found == {(0, False), (0, True), (1, False)}
    dead = contin.trace(continued(strip, points[2], "moment"), free=["moment"], limits={"moment": (-5, 0)}, direction=-1)
    (fold, *_) = dead.labelled("LP")
    assert fold.index_change == (0, 1) and abs(fold["moment"] - min(moments)) < 1e-2


@pytest.mark.full
@pytest.mark.parametrize("finish", [End(held=(WIDTH, NORMAL)), End(held=(NORMAL,)), hinge("tangent"), End(held=())])
def test_every_change_of_the_last_end_is_an_equilibrium_at_once(finish):
    """A strip out of its plane: what is let go becomes a load of the size of the reaction, and back again."""
    strip = OpenStrip(ROD, CLAMP, CLAMP, {"distance": 0.8, "turn": 0.7, "shear": 0.1})
    guess = OpenStrip(ROD, CLAMP, CLAMP, {"distance": 0.8}).arch()
    point = strip.first_point(guess)
    loads = released(strip, finish)
    follow = "moment" if finish.rotation == "hinged" else next(name for name in loads.numbers if "force" in name)
    let_go = continued(loads, point, follow)
    reactions = strip.reactions(point)
    for name in loads.numbers:
        if name != "moment":
            assert math.isclose(let_go[name], reactions[name.replace("force", "F")], rel_tol=1e-6, abs_tol=1e-8)
    again = continued(strip, let_go, "turn")
    for name in ("distance", "turn", "shear", "energy"):
        assert math.isclose(again[name], point[name], rel_tol=1e-8, abs_tol=1e-8)


@pytest.mark.full
def test_what_no_load_replaces_is_said():
    arch = OpenStrip(ROD, CLAMP, CLAMP, {"distance": 0.9})
    point = arch.first_point(arch.arch())
    with pytest.raises(ValueError, match="let go of what no load replaces; .* the last end carries the force"):
        with_ends(released(arch, BALL), point, "distance")
    with pytest.raises(ValueError, match="let go of what no load replaces"):
        with_ends(OpenStrip(ROD, hinge(), CLAMP), point, "distance")
    turned = OpenStrip(ROD, hinge(), hinge(), {"distance": 0.9})
    with pytest.raises(ValueError, match="that the state does not have"):
        with_ends(OpenStrip(ROD), turned.first_point(turned.arch()), "distance")


@pytest.mark.parametrize("angles", [(0.3, -0.4, 0.5), (6.5, 0.2, 0.1), (-0.2, 2.5, 0.1), (3.0, 1.0, -9.0)])
def test_angles_are_those_next_to_the_ones_before(angles):
    np.testing.assert_allclose(angles_near(prescribed(*angles), np.array(angles) + 0.05), angles, atol=1e-12)
