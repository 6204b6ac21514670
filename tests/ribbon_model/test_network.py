"""Networks of strips against closed forms, against the same structure in fewer pieces, and against open strips."""

import math

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation

from contin import ProblemError, solve, trace
from ribbon_model.ends import CLAMP, FREE_END, HINGED, End, Support, hinge, product
from ribbon_model.laws import FINITE_WIDTH, RIBBON, ROD
from ribbon_model.network import BALL, FINISH, HINGE, START, Joint, JointEnd, Load, Member, Network, straight
from ribbon_model.open_strip import OpenStrip
from ribbon_model.section import Section

AXIS = (1.0, 0.0, 0.0)


def _rod(B1=1.0, B2=1.0, C=1.0, **natural):
    return Section(ROD, {"B1": B1, "B2": B2, "C": C, **natural})


def _changes(branch, name):
    return [(point[name], point.index_change) for point in branch if point.label in ("BP", "LP")]


# --- closed forms ---------------------------------------------------------------------------------------------------------


@pytest.mark.full
@pytest.mark.parametrize("corners", [3, 6])
def test_a_polygon_of_rods_that_floats(corners):
    """Straight rods of side 1, rigid corners, natural curvature K about the width, in the plane of the polygon.

    With psi = 2 pi / N, k = K / sqrt(B2 C) and r = sqrt(B2 / C): cos(2 pi j / N) = cos psi cos k - (r + 1/r)/2 sin psi sin k,
    from the transfer matrix of a side (rotation about the normal, twist) and a corner; double for 2 <= j < N/2, simple for N/2.
    """
    B2, C, psi = 1.2, 0.8, 2 * math.pi / corners
    places = [(0.0, math.cos(psi * i), math.sin(psi * i)) for i in range(corners)]
    side = 2 * math.sin(psi / 2)
    places = [tuple(x / side for x in place) for place in places]
    members = {str(i): straight("strip", places[i], places[(i + 1) % corners], places[i]) for i in range(corners)}
    joints = {f"J{i}": Joint([JointEnd(str(i), FINISH), JointEnd(str((i + 1) % corners))]) for i in range(corners)}
    network = Network({"strip": _rod(1.0, B2, C)}, members, joints)
    first, how = network.first_point()
    assert how == "from the drawing"
    branch = trace(first, free=["kappa_n"], limits={"kappa_n": (0, 3.5)})

    def rest(k, j):
        r = (math.sqrt(B2 / C) + math.sqrt(C / B2)) / 2
        return math.cos(psi) * math.cos(k) - r * math.sin(psi) * math.sin(k) - math.cos(j * psi)

    known = []
    for j in range(2, corners // 2 + 1):
        grid = np.linspace(1e-6, 3.5 / math.sqrt(B2 * C), 200)
        roots = [brentq(rest, a, b, (j,), xtol=1e-15) for a, b in zip(grid, grid[1:]) if rest(a, j) * rest(b, j) < 0]
        known += [(root * math.sqrt(B2 * C), 1 if 2 * j == corners else 2) for root in roots]
    found = [(value, after - before) for value, (before, after) in _changes(branch, "kappa_n")]
    if corners == 6:  # a triangle has j = 0 and 1 only, whose reactions the formula leaves out
        assert [count for _, count in found] == [count for _, count in sorted(known)]
        np.testing.assert_allclose([value for value, _ in found], [value for value, _ in sorted(known)], atol=1e-10)
    forces = [np.abs(part).max() for part in network.reactions(branch[-1])["floating"]]
    assert max(forces) < 1e-8


def _bigon(kappa_n, hinged):
    """Two strips of length 1 from A to B, opened by 60 degrees in A: planar arcs."""
    alpha = math.pi / 6
    out = (math.cos(alpha / 2), -math.sin(alpha / 2), 0.0, 0.0)
    one = Member("strip", 1.0, frame=out, strains=(2 * alpha, 0.0, 0.0))
    other = Member("strip", 1.0, frame=product((0.0, 0.0, 0.0, 1.0), out), strains=one.strains)
    far = Joint([JointEnd("one", FINISH), JointEnd("other", FINISH)], *((HINGE, (0.0, 0.0, 1.0)) if hinged else ()))
    joints = {"A": Joint([JointEnd("one"), JointEnd("other")]), "B": far}
    return Network({"strip": _rod(C=0.75, kappa_n=kappa_n)}, {"one": one, "other": other}, joints)


@pytest.mark.full
def test_a_bigon():
    """Energy (2 alpha - kappa_n)^2; with B hinged about A-B the thresholds need the second derivative of the hinge."""
    rigid, _ = _bigon(0.5, False).first_point()
    assert rigid["energy"] == pytest.approx((math.pi / 3 - 0.5) ** 2, abs=1e-11)
    for direction, known in ((-1, -0.306378955595), (1, 2.403311530827)):
        first, _ = _bigon(1.0, True).first_point()
        branch = trace(first, free=["kappa_n"], limits={"kappa_n": (-1, 3)}, direction=direction)
        ((value, change),) = _changes(branch, "kappa_n")
        assert value == pytest.approx(known, abs=1e-11)
        assert change == (0, 1)


def _portal(section, foot):
    members = {
        "left": straight("strip", (0, 0, 0), (0, 1, 0), (0, 0, 1)), "beam": straight("strip", (0, 1, 0), (0, 1, 1), (0, 1, 0)),
        "right": straight("strip", (0, 0, 1), (0, 1, 1), (0, 0, 1)),
    }  # fmt: skip
    joints = {
        "A": Joint([JointEnd("left")]), "B": Joint([JointEnd("left", FINISH), JointEnd("beam")]),
        "C": Joint([JointEnd("beam", FINISH), JointEnd("right", FINISH)]), "D": Joint([JointEnd("right")]),
    }  # fmt: skip
    down, none = (0.0, -1.0, 0.0), (0.0, 0.0, 0.0)
    loads = {"P": Load([("B", down, none), ("C", down, none)])}
    return Network({"strip": section}, members, joints, {"A": foot, "D": foot}, loads, {"P": 0.5})


@pytest.mark.sample(1)
@pytest.mark.parametrize(
    "section, foot, known",
    [
        (_rod(1, 1.3, 0.8), CLAMP, (math.pi / 2) ** 2 * 1.3),  # out of its plane before it sways
        (_rod(1, 40.0, 40.0), CLAMP, 2.71645974768613**2),  # k l cot(k l) = -6
        (_rod(1, 40.0, 40.0), hinge(AXIS), 1.34955282371664**2),  # k l tan(k l) = 6
    ],
)
def test_a_portal_frame(section, foot, known):
    network = _portal(section, foot)
    first, _ = network.first_point()
    branch = trace(first, free=["P"], limits={"P": (0.5, 8)})
    value, change = _changes(branch, "P")[0]
    assert value == pytest.approx(known, abs=1e-10)
    assert change == (0, 1)
    for force, moment in network.reactions(branch[-1]).values():
        np.testing.assert_allclose(force, [0, branch[-1]["P"], 0], atol=1e-8)  # each foot bears the load of its column
        np.testing.assert_allclose(moment, 0, atol=1e-8)


@pytest.mark.full
@pytest.mark.parametrize("direction", [1, -1])
def test_a_right_angle_frame_under_end_moments(direction):
    """M = pi sqrt(B1 C) / L where the legs do not bend in their plane: 622.2080872197 N mm for the data of the literature."""
    E, nu, width, thickness, length = 71240.0, 0.31, 30.0, 0.6, 240.0
    EI, GJ = E * width * thickness**3 / 12, E / (2 * (1 + nu)) * width * thickness**3 / 3
    r = math.sqrt(0.5)
    members = {"a": straight("strip", (0, 0, 0), (0, r, r), AXIS), "b": straight("strip", (0, r, r), (0, 0, 2 * r), AXIS)}
    joints = {"A": Joint([JointEnd("a")]), "B": Joint([JointEnd("b", FINISH)])}
    joints["corner"] = Joint([JointEnd("a", FINISH), JointEnd("b")])
    held = {"A": hinge(AXIS), "B": End(HINGED, AXIS, held=(AXIS, (0.0, 1.0, 0.0)))}
    section = Section(ROD, {"B1": 1.0, "B2": math.inf, "C": GJ / EI})
    network = Network({"strip": section}, members, joints, held, {"M": Load(moments=[("A", 1.0), ("B", -1.0)])})
    first, _ = network.first_point()
    branch = trace(first, free=["M"], limits={"M": (-5, 5)}, direction=direction)
    value, change = _changes(branch, "M")[0]
    assert value * EI / length == pytest.approx(direction * 622.2080872197, abs=1e-8)
    assert change == (0, 1)
    for force, moment in network.reactions(branch[-1]).values():
        np.testing.assert_allclose(np.append(force, moment), 0, atol=1e-8)  # the loads balance each other


@pytest.mark.full
@pytest.mark.parametrize("covers", [1, 2])
def test_rings_that_are_covered_several_times(covers):
    """(m + B1 y / C)(m + B1 y / B2) = k^2 with y = kappa_n R - m: where rings buckle; k = m and k >= 1 double, k = 0 simple."""
    B2, C, m = 1.4, 0.7, covers
    half = Member("strip", math.pi * m, strains=(1.0, 0.0, 0.0))
    other = half.followed_by("strip", math.pi * m, half.strains)
    joints = {
        "P": Joint([JointEnd("a", FINISH), JointEnd("b")]), "Q": Joint([JointEnd("b", FINISH), JointEnd("a")])
    }  # fmt: skip
    network = Network({"strip": _rod(1.0, B2, C, kappa_n=1.0)}, {"a": half, "b": other}, joints)
    first, _ = network.first_point()
    branch = trace(first, free=["kappa_n"], limits={"kappa_n": (1.0, 3.2)})
    known = []
    for k in range(8):
        if k == m:
            continue
        a, b, c = 1 / (B2 * C), m / C + m / B2, m * m - k * k
        for y in np.roots([a, b, c]) if k else [-m * B2]:
            if abs(np.imag(y)) < 1e-12 and 1.0 < np.real(y) / m + 1 < 3.2:
                known.append((np.real(y) / m + 1, 2 if k else 1))
    found = [(value, abs(after - before)) for value, (before, after) in _changes(branch, "kappa_n")]
    np.testing.assert_allclose([value for value, _ in found], [value for value, _ in sorted(known)], atol=1e-9)
    assert [count for _, count in found] == [count for _, count in sorted(known)]


@pytest.mark.full
def test_a_ring_under_pressure_until_it_touches():
    """p R^3 / B = 3; opposite points touch at 5.24688696253148, with curvature -1 and no force there (closed forms).

    Half of the ring, whose ends stay in a plane of mirror symmetry.
    """
    quarter = Member("strip", math.pi / 2, strains=(1.0, 0.0, 0.0))
    members = {"a": quarter, "b": quarter.followed_by("strip", math.pi / 2, quarter.strains)}
    joints = {"A": Joint([JointEnd("a")]), "B": Joint([JointEnd("b", FINISH)])}
    joints["middle"] = Joint([JointEnd("a", FINISH), JointEnd("b")])
    held = {"A": CLAMP, "B": End(held=((0.0, 0.0, 1.0),))}
    section = _rod(1.0, 50.0, 50.0, kappa_n=1.0)
    ring = Network({"strip": section}, members, joints, held, numbers={"pressure": 2.9})
    first, _ = ring.first_point()
    circle = trace(first, free=["pressure"], limits={"pressure": (2.9, 3.1)})
    ((value, change),) = _changes(circle, "pressure")
    assert value == pytest.approx(3.0, abs=1e-10)
    assert change == (0, 1)  # of two modes, the mirror keeps one
    touching = 5.24688696253148
    for direction in (1, -1):
        last = trace(circle.labelled("BP")[0], branch=1, direction=direction, limits={"pressure": (2.9, touching)})[-1]
        assert last.index == 0
        shapes, strains = ring.shapes(last), ring.strains(last.system, last.x)
        gap = np.linalg.norm(shapes["b"].centreline[-1] - shapes["a"].centreline[0])
        if gap < 1:  # the ends touch; on the other branch the ring is turned by a right angle
            assert gap == pytest.approx(0, abs=1e-9)
            assert strains["a"][0, 0] == pytest.approx(-1, abs=1e-9)
            np.testing.assert_allclose(ring.reactions(last)["A"][0], 0, atol=1e-9)
            return
    pytest.fail("neither branch brings the ends together")


# --- open strips, drawn anywhere ---------------------------------------------------------------------------------------------

TURN, SHIFT = Rotation.from_rotvec([0.7, -0.4, 1.1]), (1.5, -4.0, 2.5)
STRIPS = {
    "a load at the tip": ({"finish": FREE_END}, "force_width", 6.0),
    "weight": ({"finish": FREE_END, "weight_direction": (-1, 0, 0)}, "weight", 20.0),
    "a moment": ({"finish": hinge(held=((1, 0, 0), (0, 1, 0)))}, "moment", 9.0),
    "a foundation": ({"start": hinge(), "finish": hinge(held=((1, 0, 0), (0, 1, 0)))}, "force_tangent", -45.0),
}


def _redrawn(strip):
    """The network of an open strip without stress, turned and moved."""

    def turned(vector):
        return tuple(TURN.apply(vector))

    x, y, z, w = TURN.as_quat()
    held = {
        name: End(end.rotation, turned(end.axis), end.director, tuple(map(turned, end.held)))
        for name, end in strip.held.items() if end.held or end.rotation != "free"
    }  # fmt: skip
    loads = {
        name: Load([(joint, turned(axis), arm) for joint, axis, arm in load.forces], load.moments)
        for name, load in strip.loads.items()
    }  # fmt: skip
    return Network(
        {"strip": strip.section}, {"strip": Member(place=SHIFT, frame=(w, x, y, z))}, strip.joints, held, loads, strip.numbers,
        turned(strip.weight_direction), foundation_direction=turned(strip.foundation_direction),
    )  # fmt: skip


@pytest.mark.sample(1)
@pytest.mark.parametrize("name", STRIPS)
def test_an_open_strip_is_that_network_wherever_it_is_drawn(name):
    """Bifurcations, their index, and reactions: the same equations on other axes."""
    ends, follow, to = STRIPS[name]
    numbers = {follow: 0.0} | ({"foundation": 90.0} if "foundation" in name else {})
    strip = OpenStrip(_rod(B2=9.0, C=0.8), **ends, numbers=numbers)
    other, sign = _redrawn(strip), int(math.copysign(1, to))
    options = {"free": [follow], "limits": {follow: (min(0.0, to), max(0.0, to))}, "direction": sign}
    here, there = trace(strip.first_point(), **options), trace(other.first_point()[0], **options)
    expected = [(pytest.approx(value, rel=1e-9), change) for value, change in _changes(here, follow)]
    assert _changes(there, follow) == expected != []
    found, carried = strip.reactions(here[-1]), other.reactions(there[-1])["first"]
    expected = [TURN.apply([found[f"start_{kind}_{axis}"] for axis in ("width", "normal", "tangent")]) for kind in "FM"]
    np.testing.assert_allclose(carried, expected, atol=1e-8)


# --- cuts -----------------------------------------------------------------------------------------------------------------

LAWS = {
    "rod": _rod(1.0, 1.3, 0.8, kappa_n=1.5), "ribbon": Section(RIBBON, {"nu": 0.3, "kappa_n": 2.5}),
    "finite width": Section(FINITE_WIDTH, {"nu": 0.3, "Gamma": 0.1, "kappa_n": 1.5}),
}  # fmt: skip


@pytest.mark.full
@pytest.mark.parametrize("name", LAWS)
@pytest.mark.parametrize("cuts", [(0.37,), (0.2, 0.65)])
def test_a_cut_by_rigid_joints_changes_nothing(name, cuts):
    """A cantilever that is curved by nature, under a dead load across: places, energy and index as of the open strip."""
    section = LAWS[name]
    strip = OpenStrip(section, finish=FREE_END, numbers={"force_normal": 0.0, "force_width": 0.02})
    whole = trace(strip.first_point(), free=["force_normal"], limits={"force_normal": (0, 3)})[-1]
    natural = (section.numbers["kappa_n"], 0.0, 0.0)
    places, members = [0.0, *cuts, 1.0], {}
    for number, (a, b) in enumerate(zip(places, places[1:])):
        members[str(number)] = last.followed_by("strip", b - a, natural) if number else Member("strip", b, strains=natural)  # noqa: F821
        last = members[str(number)]
    joints = {"A": Joint([JointEnd("0")]), "B": Joint([JointEnd(str(len(cuts)), FINISH)])}
    joints |= {f"cut {i}": Joint([JointEnd(str(i), FINISH), JointEnd(str(i + 1))]) for i in range(len(cuts))}
    none = (0.0, 0.0, 0.0)
    loads = {"F": Load([("B", (0.0, 1.0, 0.0), none)]), "side": Load([("B", AXIS, none)])}
    network = Network({"strip": section}, members, joints, {"A": CLAMP}, loads, {"side": 0.02})
    first, _ = network.first_point()
    pieces = trace(first, free=["F"], limits={"F": (0, 3)})[-1]
    assert pieces.index == whole.index
    assert pieces["energy"] == pytest.approx(whole["energy"], abs=1e-9)
    assert network.potential(pieces) == pytest.approx(strip.potential(whole), abs=1e-9)
    last = network.shapes(pieces)[str(len(cuts))].centreline[-1]
    np.testing.assert_allclose(last, strip.shape(whole).centreline[-1], atol=1e-9)
    force, moment = network.reactions(pieces)["A"]
    known = strip.reactions(whole)
    np.testing.assert_allclose(force, [known[f"start_F_{x}"] for x in ("width", "normal", "tangent")], atol=1e-8)
    np.testing.assert_allclose(moment, [known[f"start_M_{x}"] for x in ("width", "normal", "tangent")], atol=1e-8)


@pytest.mark.full
def test_joints_turned_and_with_gaps_are_closed_step_by_step():
    """An arc is bent to a loop by a joint that leaves a corner of 40 degrees between its ends."""
    strip = Member("strip", strains=(1.0, 0.0, 0.0))
    angle = math.radians(320) - 1
    joint = Joint([JointEnd("a", START), JointEnd("a", FINISH, angle=angle, axis=AXIS)])
    loop = Network({"strip": _rod(1.0, 3.0, 2.0)}, {"a": strip}, {"J": joint})
    point, how = loop.first_point()
    assert how == "from the drawing without stress, step by step"
    shape = loop.shapes(point)["a"]
    assert np.abs(shape.centreline[-1] - shape.centreline[0]).max() < 1e-10
    turned = math.acos(np.clip(shape.directors[0, 2] @ shape.directors[-1, 2], -1, 1))
    assert turned == pytest.approx(math.radians(40), abs=1e-9)


def test_an_arm_carries_the_load_aside():
    """A force P on an arm of 0.1 across a clamped column bends it as a tip moment P / 10 does, to first order in P."""
    column = straight("strip", (0, 0, 0), (0, 0, 1), (0, 1, 0))
    joints = {"A": Joint([JointEnd("a")]), "B": Joint([JointEnd("a", FINISH)])}
    load = {"P": Load([("B", (0.0, 0.0, 1.0), (0.0, 0.1, 0.0))])}
    network = Network({"strip": _rod()}, {"a": column}, joints, {"A": CLAMP}, load, {"P": 1e-4})
    point, _ = network.first_point()
    end = network.shapes(point)["a"].centreline[-1]
    assert end[1] == pytest.approx(-1e-5 / 2, rel=2e-4)  # M L^2 / 2 B
    force, moment = network.reactions(point)["A"]
    np.testing.assert_allclose(force, [0, 0, -1e-4], atol=1e-12)
    assert abs(moment[0]) == pytest.approx(1e-5, rel=1e-3)


def test_a_beam_on_a_foundation_of_two_pieces_away_from_the_origin():
    """Hinged, it buckles at n**2 pi**2 + k/(n pi)**2 (Hetenyi 1946), here n = 1."""
    beam = straight("strip", (1, 2, 3), (1, 2, 4), (0, 1, 0))
    pieces = dict(zip(("a", "b"), beam.cut([0.4])))
    joints = {
        "A": Joint([JointEnd("a")]),
        "K": Joint([JointEnd("a", FINISH), JointEnd("b")]),
        "B": Joint([JointEnd("b", FINISH)]),
    }
    held = {"A": hinge(), "B": Support(HINGED, held=((1, 0, 0), (0, 1, 0)), numbers=("x", "y", "", "turn", "bend", "swing"))}
    load = {"P": Load([("B", (0.0, 0.0, -1.0), (0.0, 0.0, 0.0))])}
    network = Network({"strip": _rod(B2=50.0)}, pieces, joints, held, load, {"P": 0.0, "foundation": 100.0})
    assert {"x", "y", "bend"} <= set(network.parameters) and "B_dx" not in network.known
    branch = trace(network.first_point()[0], free=["P"], limits={"P": (0, 30)})
    assert _changes(branch, "P") == [(pytest.approx(math.pi**2 + 100 / math.pi**2, rel=1e-9), (0, 1))]


# --- statements -----------------------------------------------------------------------------------------------------------


def _stated(**changes):
    given = {
        "sections": {"strip": _rod()}, "members": {"a": Member(), "b": Member(place=(0.0, 0.0, 1.0))},
        "joints": {"A": Joint([JointEnd("a")]), "K": Joint([JointEnd("a", FINISH), JointEnd("b")])}, "held": {"A": CLAMP},
    }  # fmt: skip
    return Network(**(given | changes))


RING = Member(length=1.0, strains=(2 * math.pi, 0.0, 0.0))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"held": {"A": hinge()}}, "held: the network can move as a rigid body"),
        ({"sections": {"strip": Section(RIBBON, {"nu": 0.3})}}, "strips: a: the law 'ribbon' has no value where"),
        pytest.param(
            {"members": {"a": RING}, "joints": {"A": Joint([JointEnd("a"), JointEnd("a", FINISH)])}},
            r"joints: a can move, or turn about itself, .*, or give phases: \['spin'\] or \['shift, right'\]",
            marks=pytest.mark.full,
        ),
    ],
)
def test_why_nothing_determines_a_first_state(changes, message):
    with pytest.raises(ProblemError, match=message):
        _stated(**changes).first_point()


def test_the_phase_that_the_message_gives_determines_the_ring():
    """A straight isotropic rod bent to a ring of length 1: E = 2 pi**2 B."""
    ring = _stated(members={"a": RING}, joints={"A": Joint([JointEnd("a"), JointEnd("a", FINISH)])}, phases=("spin",))
    point, _ = ring.first_point()
    assert point["energy"] == pytest.approx(2 * math.pi**2, rel=1e-9) and not point.phase_loads()


def test_what_is_drawn_without_stress_is_not_assembled():
    assert "assembly" not in _stated().parameters
    turned = {"K": Joint([JointEnd("a", FINISH), JointEnd("b", angle="turned")])}
    for changes in (
        {"numbers": {"weight": 1.0}}, {"sections": {"strip": _rod(kappa_n=0.5)}}, {"members": {"a": Member(), "b": Member()}},
        {"joints": _stated().joints | turned, "numbers": {"turned": 0.1}},
    ):  # fmt: skip
        assert "assembly" in _stated(**changes).parameters


@pytest.mark.parametrize(
    "changes, message",
    [
        ({"members": {"a": Member("beam")}}, "members: a: section: 'beam' must be one of strip"),
        ({"members": {"a": Member(length=0.0)}}, "members: a: length = 0 must be positive"),
        ({"joints": {"K": Joint([JointEnd("c")])}}, "joints: K: member: 'c' must be one of a, b"),
        ({"joints": {"K": Joint([JointEnd("a"), JointEnd("a")])}}, "joints: K: 'a start' is joined twice"),
        ({"held": {"Z": CLAMP}}, "held: 'Z' must be one of A, K"),
        ({"loads": {"P": Load([("Z", AXIS, AXIS)])}}, "loads: P: joint: 'Z' must be one of A, K"),
        ({"loads": {"P": Load(moments=[("A", 1.0)])}}, "loads: P: moments: A must be held by a hinge"),
        ({"held": {}, "numbers": {"weight": 1.0}}, "weight: nothing is held, so nothing bears it"),
        (
            {"held": {}, "loads": {"P": Load([("K", AXIS, AXIS)])}},
            "loads: P: nothing is held, so its forces must add up to zero",
        ),
        ({"numbers": {"wieght": 1.0}}, "numbers: wieght (did you mean 'weight'?) is used by nothing here"),
    ],
)
def test_what_cannot_be_is_one_sentence(changes, message):
    with pytest.raises(ValueError, match=r".") as raised:
        _stated(**changes)
    assert message in str(raised.value)


@pytest.mark.parametrize(
    "make, message",
    [
        (lambda: JointEnd("a", "middle"), "end: 'middle' must be start or finish"),
        (lambda: Joint([JointEnd("a")], "welded"), "kind: 'welded' must be rigid, hinge or ball"),
        (lambda: Joint([]), "there must be one at least"),
        (lambda: straight("strip", (0, 0, 0), (0, 0, 0), AXIS), "has no direction"),
        (lambda: straight("strip", (0, 0, 0), (2, 0, 0), AXIS), "lies along the member"),
    ],
)
def test_parts_that_cannot_be_are_one_sentence(make, message):
    with pytest.raises(ValueError, match=message):
        make()


def test_a_ball_joint_and_two_sections():
    """A soft column under a stiff one, whose other end is guided: both sway as cantilevers under P = B_i k_i^2.

    At the ball joint their lateral stiffnesses P k / (tan k - k) add up to zero. Numbers of the sections have their names.
    """
    members = {
        "low": straight("soft", (0, 0, 0), (0, 0, 1), (0, 1, 0)), "high": straight("stiff", (0, 0, 1), (0, 0, 2), (0, 1, 0)),
    }  # fmt: skip
    joints = {
        "A": Joint([JointEnd("low")]), "K": Joint([JointEnd("low", FINISH), JointEnd("high")], BALL),
        "B": Joint([JointEnd("high", FINISH)]),
    }  # fmt: skip
    slides = End(held=((1.0, 0.0, 0.0), (0.0, 1.0, 0.0)))
    loads = {"P": Load([("B", (0.0, 0.0, -1.0), (0.0, 0.0, 0.0))])}
    network = Network({"soft": _rod(), "stiff": _rod(5.0, 5.0, 5.0)}, members, joints, {"A": CLAMP, "B": slides}, loads)
    assert {"B1_soft", "B1_stiff", "P"} <= set(network.parameters)
    first = solve(network.problem, network.guess(), intervals=10, degree=6)
    ((value, change),) = _changes(trace(first, free=["P"], limits={"P": (0, 10)}), "P")
    waves = [math.sqrt(value / B) for B in (1.0, 5.0)]
    assert sum(k / (math.tan(k) - k) for k in waves) == pytest.approx(0, abs=1e-9)
    assert change == (0, 2)


def test_nothing_holds_a_network_that_floats_under_loads_at_its_first_joint():
    """A beam that two opposite forces stretch: what acts there is no reaction."""
    forces = Load([("A", (0.0, 0.0, -1.0), (0.0, 0.0, 0.0)), ("B", (0.0, 0.0, 1.0), (0.0, 0.0, 0.0))])
    joints = {"A": Joint([JointEnd("beam")]), "B": Joint([JointEnd("beam", FINISH)])}
    network = Network({"strip": _rod()}, {"beam": Member()}, joints, loads={"P": forces}, numbers={"P": 0.5})
    reaction = network.reactions(network.first_point()[0])["floating"]
    assert max(np.abs(part).max() for part in reaction) < 1e-12
