"""A pressure in a plane: the same wherever and however the strips are drawn; refused where it has no potential."""

import math
from dataclasses import replace

import numpy as np
import pytest

from contin import solve, trace
from ribbon_model import ends
from ribbon_model.ends import CLAMP, CLAMPED, FREE, End
from ribbon_model.laws import ROD
from ribbon_model.network import FINISH, START, Joint, JointEnd, Member, Network, straight
from ribbon_model.section import Section


def _rod(kappa_n: float) -> Section:
    return Section(ROD, {"B1": 1.0, "B2": 50.0, "C": 50.0, "kappa_n": kappa_n})


def _reversed(member: Member) -> Member:
    """The same strip drawn from its other end: its width stays, its normal and tangent are opposite."""
    state = member.drawn([member.length])[0]
    bend, swing, twist = member.strains
    return replace(
        member, section="other", place=tuple(map(float, state[4:])),
        frame=tuple(map(float, ends.product(state[:4], (0.0, 1.0, 0.0, 0.0)))), strains=(-bend, swing, twist),
    )  # fmt: skip


def _row(members, against, held, numbers, kappa_n=0.0):
    """Strips from A to B, of which some are drawn the other way."""
    names = [f"s{number}" for number in range(len(members))]
    drawn = {name: _reversed(one) if name in against else one for name, one in zip(names, members)}
    at = [[] for _ in range(len(names) + 1)]
    for number, name in enumerate(names):
        order = (FINISH, START) if name in against else (START, FINISH)
        at[number].append(JointEnd(name, order[0]))
        at[number + 1].append(JointEnd(name, order[1]))
    joints = {"A": Joint(at[0]), **{f"J{i}": Joint(there) for i, there in enumerate(at[1:-1])}, "B": Joint(at[-1])}
    sections = {"strip": _rod(kappa_n), "other": _rod(-kappa_n)}
    return Network(sections, drawn, joints, held, numbers=numbers)


def _arc(begin, parts=2) -> list[Member]:
    """Half a circle of radius 1 that begins along z, in parts."""
    found = [Member("strip", math.pi / parts, begin, strains=(1.0, 0.0, 0.0))]
    for _ in range(parts - 1):
        found.append(found[-1].followed_by("strip", math.pi / parts, (1.0, 0.0, 0.0)))
    return found


@pytest.mark.sample(1)
@pytest.mark.parametrize("against", [("s1",), ("s0", "s1"), ()])
@pytest.mark.parametrize("begin", [(0.0, 2.0, 3.0), (1.0, -4.0, 2.0), (0.0, 0.0, 0.0)])
def test_half_a_ring_buckles_at_3_wherever_and_however_it_is_drawn(begin, against):
    """n**2 - 1 = 3 for n = 2 with the radius and B = 1; a force of p R at each end holds the circle."""
    held = {"A": CLAMP, "B": End(CLAMPED, held=((0.0, 0.0, 1.0),))}
    network = _row(_arc(begin), against, held, {"pressure": 2.5}, 1.0)
    branch = trace(network.first_point()[0], free=["pressure"], limits={"pressure": (2, 4)}, progress=False)
    (point,) = branch.labelled("BP")
    assert (point["pressure"], point.index_change) == (pytest.approx(3.0, abs=1e-10), (0, 1))
    last = branch[-1]
    assert last["energy"] == pytest.approx(last["pressure"] * math.pi / 2, abs=1e-9)  # p times the area
    for force, moment in network.reactions(last).values():
        assert force == pytest.approx((0, 0, last["pressure"]), abs=1e-9) and moment == pytest.approx((0, 0, 0), abs=1e-9)


@pytest.mark.sample(1)
@pytest.mark.parametrize("slide", [None, (0.0, 0.0, 1.0), (0.0, 0.8, 0.6)])
@pytest.mark.parametrize("against", [("s0",), ()])
def test_it_is_a_pressure_against_the_normals_of_strips(slide, against):
    """An arch off the origin, one end of which slides along a line that has been moved: as under loads without an energy."""
    held = {"A": CLAMP, "B": End(FREE) if slide is None else End(FREE, held=ends.perpendicular(slide))}
    moved = {"B_dy": 0.05} if slide != (0.0, 0.8, 0.6) else {"B_dz": 0.05}
    found = []
    for name, value, drawn in (("pressure", 1.5, against), ("follower_pressure", 1.5, ())):  # its normals point outwards
        network = _row(_arc((0.3, 2.0, -1.0)), drawn, held, {name: value, **moved}, 1.0)
        found.append((network, network.first_point()[0]))
    forces, places = zip(*((net.reactions(point), net.place(point, "B")) for net, point in found))
    assert places[0] == pytest.approx(places[1], abs=1e-9)
    for name in ("A", "B"):
        assert np.concatenate(forces[0][name]) == pytest.approx(np.concatenate(forces[1][name]), abs=1e-8)
    assert np.linalg.norm(places[0] - found[0][0].drawn_place("B")) > 0.04


@pytest.mark.full
def test_a_portal_is_in_balance_however_its_columns_are_drawn():
    corners = [(0.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 1.0, 1.0), (0.0, 0.0, 1.0)]
    members = [straight("strip", a, b, (0.0, b[2] - a[2], a[1] - b[1])) for a, b in zip(corners, corners[1:])]
    found = []
    for against in ((), ("s0", "s1")):
        network = _row(members, against, {"A": CLAMP, "B": CLAMP}, {"pressure": 0.5})
        forces = network.reactions(solve(network.problem, network.first_point()[0]))
        assert forces["A"][0] + forces["B"][0] == pytest.approx((0, 0.5, 0), abs=1e-9)  # p times the span
        found.append(forces["A"][0])
    assert found[1] == pytest.approx(found[0], abs=1e-9)


def test_a_pressure_without_a_potential_is_refused():
    one = straight("strip", (0.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, 1.0, 0.0))
    with pytest.raises(ValueError, match=r"pressure: 's0 finish' can move freely in the plane, so .* follow follower_pressure"):
        _row([one], (), {"A": CLAMP}, {"pressure": 0.0})
    branching = Joint([JointEnd("a", FINISH), JointEnd("b"), JointEnd("c")])
    three = {"a": one, "b": one.followed_by("strip", 1.0), "c": one.followed_by("strip", 1.0)}
    with pytest.raises(ValueError, match=r"pressure: 3 strips meet at 'a finish', so .* follow follower_pressure"):
        Network(
            {"strip": _rod(0.0)}, three, {"A": Joint([JointEnd("a")]), "J": branching}, {"A": CLAMP}, numbers={"pressure": 0.0}
        )
    advised = _row([one], (), {"A": CLAMP}, {"follower_pressure": 1e-3})
    tip = advised.place(advised.first_point()[0], "B")
    assert tip[1] == pytest.approx(-1e-3 / 8, rel=1e-3)  # p L**4 / (8 B) for small loads
