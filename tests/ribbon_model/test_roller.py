"""A roller between the ends, against closed forms of columns and against the work of its force."""

import math

import numpy as np
import pytest
from scipy.optimize import brentq

import contin
from ribbon_model.ends import CLAMP, DIRECTIONS, FREE_END, End, Roller, hinge
from ribbon_model.open_strip import OpenStrip
from ribbon_model.section import section_of

WIDTH, NORMAL, TANGENT = DIRECTIONS.values()
#: Stiff against bending in its plane, so that the columns buckle along the normal first.
ROD = section_of("rod", {"B1": 1.0, "B2": 40.0, "C": 30.0})
SLIDES = (WIDTH, NORMAL)
MESH = {"intervals": 20, "mesh": contin.MeshControl(every=0)}


def column(start, finish, at=0.5):
    return OpenStrip(ROD, start, finish, {"force_tangent": -1.0}, roller=Roller(at, NORMAL))


def critical_loads(strip, lowest):
    branch = contin.trace(
        strip.first_point(**MESH), free=["force_tangent"], limits={"force_tangent": (lowest, 0)}, direction=-1,
        mesh=MESH["mesh"],
    )  # fmt: skip
    assert not branch.notes
    return [(-point["force_tangent"], point.index_change) for point in branch.labelled("BP")]


def clamped_and_propped(at):
    """The first load of a column clamped at one end, pinned at the other, with a roller in between: u = a + b s + c cos k s +
    d sin k s on both sides; u = 0 at the roller, u' and u'' agree there.
    """

    def determinant(k):
        def row(s, order):
            waves = [(math.cos(k * s), math.sin(k * s)), (-k * math.sin(k * s), k * math.cos(k * s))]
            waves.append((-k * k * waves[0][0], -k * k * waves[0][1]))
            return [*[(1, s), (0, 1), (0, 0)][order], *waves[order]]

        none = [0.0] * 4
        rows = [row(0, 0) + none, row(0, 1) + none, none + row(1, 0), none + row(1, 2), row(at, 0) + none, none + row(at, 0)]
        rows += [row(at, order) + [-value for value in row(at, order)] for order in (1, 2)]
        return np.linalg.det(np.array(rows))

    grid = np.linspace(4.6, 12, 400)
    values = [determinant(k) for k in grid]
    place = next(i for i in range(len(grid) - 1) if values[i] * values[i + 1] < 0)
    return brentq(determinant, grid[place], grid[place + 1], xtol=1e-14) ** 2


@pytest.mark.full
def test_a_pinned_column_with_a_roller_in_the_middle():
    """It buckles in its second mode at 4 pi**2; the next is symmetric, each half clamped at the roller: 4 x**2, tan x = x."""
    zero = brentq(lambda x: math.sin(x) - x * math.cos(x), 4, 4.7, xtol=1e-15)
    found = critical_loads(column(hinge(), hinge(held=SLIDES)), -85)
    assert [load for load, _ in found] == pytest.approx([4 * math.pi**2, 4 * zero**2], rel=1e-9)
    assert [change for _, change in found] == [(0, 1), (1, 2)]


@pytest.mark.full
def test_a_clamped_column_with_a_roller_in_the_middle():
    """Second mode of the clamped column, 4 x**2 = 8.183 pi**2; then both halves as clamped columns, 16 pi**2."""
    zero = brentq(lambda x: math.sin(x) - x * math.cos(x), 4, 4.7, xtol=1e-15)
    found = critical_loads(column(CLAMP, End(held=SLIDES)), -165)
    assert [load for load, _ in found] == pytest.approx([4 * zero**2, 16 * math.pi**2], rel=1e-9)
    assert [change for _, change in found] == [(0, 1), (1, 2)]


@pytest.mark.full
@pytest.mark.parametrize("at", [0.3, 0.75])
def test_a_roller_elsewhere(at):
    ((load, change), *_) = critical_loads(column(CLAMP, hinge(held=SLIDES), at), -1.1 * clamped_and_propped(at))
    assert load == pytest.approx(clamped_and_propped(at), rel=1e-9) and change == (0, 1)


@pytest.mark.full
def test_an_arch_that_is_pressed_at_the_middle():
    """dE/d(place) is the force of the roller; all forces on the strip sum to zero; the strip is where the roller holds it."""
    rod = section_of("rod", {"B1": 1.0, "B2": 4.0, "C": 0.8})
    strip = OpenStrip(rod, numbers={"distance": 0.9}, roller=Roller(0.5, NORMAL))
    guess = strip.arch()
    point = strip.first_point(guess, {"roller": guess(0.5)[5]}, **MESH)
    options = {"free": ["roller"], "limits": {"roller": (-0.1, 0.5)}, "direction": -1, "mesh": MESH["mesh"]}
    branch = contin.trace(point, **options)
    places, energies = branch.column("roller"), branch.column("energy")
    forces = np.array([strip.reactions(point)["F_roller"] for point in branch])
    steps = np.diff(places)
    work = (forces[1:] + forces[:-1]) / 2 * steps
    short = abs(steps) < 0.01  # so that the trapezoidal rule is good to a hundredth; measured .6 %
    np.testing.assert_allclose(np.diff(energies)[short], work[short], rtol=1e-2)
    for point in branch.points[2::5]:
        found = strip.reactions(point)
        total = np.array([found[f"F_{name}"] + found[f"start_F_{name}"] for name in DIRECTIONS])
        np.testing.assert_allclose(total, -found["F_roller"] * np.array(NORMAL), atol=1e-9)
        assert point.system.evaluate(point.x, np.array([0.5]))[0, 5] == pytest.approx(point["roller"], abs=1e-9)


def test_mistakes_are_told_in_one_sentence():
    with pytest.raises(ValueError, match="roller: at: 0.123457 must be a multiple of 1/N"):
        Roller(0.123456789, NORMAL)
    with pytest.raises(ValueError, match="roller: the place of the first end must be held"):
        OpenStrip(ROD, FREE_END, CLAMP, roller=Roller(0.5, NORMAL))


def test_a_roller_that_pushes_lifts_off_where_one_that_holds_would_pull():
    """Its force is that of the other one while it pushes; a strip under it lies where nothing holds it behind that."""
    rod = section_of("rod", {"B1": 1.0, "B2": 4.0, "C": 0.8})
    holds, strip = (OpenStrip(rod, numbers={"distance": 0.9}, roller=Roller(0.5, NORMAL, pushes)) for pushes in (0, -1))
    first, held = (each.first_point(each.arch(), {"roller": 0.193}, **MESH) for each in (strip, holds))
    force = strip.reactions(first)["F_roller"]
    assert force == pytest.approx(holds.reactions(held)["F_roller"], rel=1e-9) and force < 0
    branch = contin.trace(first, free=["roller"], limits={"roller": (0.15, 0.25)}, mesh=MESH["mesh"])
    (left,) = branch.labelled("BC")
    assert left.name == "roller lifts off: goes on" and left.index_change == (0, 0) and branch[-1].contacts == ()
    free = OpenStrip(rod, numbers={"distance": 0.9})
    arch = free.first_point(free.arch(), **MESH)
    assert left["roller"] == pytest.approx(float(arch.system.evaluate(arch.x, np.array([0.5]))[0, 5]), abs=1e-9)
