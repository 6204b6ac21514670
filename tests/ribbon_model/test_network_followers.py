"""Loads on networks that follow strips: closed forms, and states by shooting."""

import math

import numpy as np
import pytest

from contin import ProblemError, trace
from ribbon_model.ends import CLAMP
from ribbon_model.laws import ROD
from ribbon_model.network import FINISH, Joint, JointEnd, Load, Member, Network, straight
from ribbon_model.section import Section
from tests.ribbon_model.test_network_independent import Shooting

NONE = (0.0, 0.0, 0.0)


def _rod(**numbers) -> dict[str, Section]:
    return {"strip": Section(ROD, {"B1": 1.0, "B2": 1.7, "C": 0.8, **numbers})}


@pytest.mark.full
def test_a_ring_in_space_under_a_pressure_that_follows_it():
    """p R^3 / B = n^2 - 1 in its plane, as of the pressure on the area, which has an energy; out of it the ring is stiff."""
    half = Member("strip", math.pi, strains=(1.0, 0.0, 0.0))
    members = {"a": half, "b": half.followed_by("strip", math.pi, half.strains)}
    joints = {"P": Joint([JointEnd("a", FINISH), JointEnd("b")]), "Q": Joint([JointEnd("b", FINISH), JointEnd("a")])}
    ring = Network(_rod(B2=50.0, C=50.0, kappa_n=1.0), members, joints, numbers={"follower_pressure": 0.0})
    circle, _ = ring.first_point()
    branch = trace(circle, free=["follower_pressure"], limits={"follower_pressure": (0, 9)}, progress=False)
    points = branch.labelled("BP")
    assert [point["follower_pressure"] for point in points] == pytest.approx([3, 8], abs=1e-10)
    assert [point.details.dimension for point in points] == [2, 2]
    assert [point.index_change for point in points] == [None, None]
    assert max(np.abs(part).max() for part in ring.reactions(branch[-1])["floating"]) < 1e-10
    with pytest.raises(ProblemError, match="its loads have no energy"):
        circle.second_variation()


@pytest.mark.sample(1)
@pytest.mark.parametrize("part", [0.3, 1.0])
def test_a_column_whose_load_follows_in_part(part):
    """cos k = -a / (1 - a) in both planes, with k^2 = P / B; a load that follows altogether (Beck) has no other state."""
    column = {"a": straight("strip", NONE, (0.0, 0.0, 1.0), (0.0, 1.0, 0.0))}
    joints = {"A": Joint([JointEnd("a")]), "B": Joint([JointEnd("a", FINISH)])}
    down = (0.0, 0.0, -1.0)
    load = Load([("B", tuple((1 - part) * x for x in down), NONE)], followers=[("B", tuple(part * x for x in down), NONE)])
    first, _ = Network(_rod(), column, joints, {"A": CLAMP}, {"P": load}).first_point()
    branch = trace(first, free=["P"], limits={"P": (0, 7)}, progress=False)
    wave = math.acos(-part / (1 - part)) if part < 0.5 else math.inf
    known = [B * wave**2 for B in (1.0, 1.7) if B * wave**2 < 7]
    assert [point["P"] for point in branch.labelled("BP")] == pytest.approx(known, abs=1e-10)


def test_a_frame_by_shooting():
    """Forces that follow at an inner joint and at the tip, at arms, and a pressure on both strips."""
    members = {
        "a": straight("strip", NONE, (0, 0, 1), (0, 1, 0)), "b": straight("strip", (0, 0, 1), (0.3, 0.8, 1.2), (0, 0, 1)),
    }  # fmt: skip
    joints = {
        "A": Joint([JointEnd("a")]), "K": Joint([JointEnd("a", FINISH), JointEnd("b")]), "B": Joint([JointEnd("b", FINISH)])
    }  # fmt: skip
    load = Load(followers=[("B", (0.3, -0.2, 1.0), (0.1, 0.05, 0.0)), ("K", (1.0, 0.0, 0.0), (0.0, 0.0, 0.1))])
    network = Network(_rod(kappa_n=0.3), members, joints, {"A": CLAMP}, {"P": load}, {"follower_pressure": 0.5})
    first, _ = network.first_point()
    last = trace(first, free=["P"], limits={"P": (0, 3)}, progress=False)[-1]
    assert last["P"] == pytest.approx(3)
    assert last.index is None
    states = last.system.states(last.x)
    both, moved = Shooting(network, last.parameters).solved([states[0, places] for places in network.places])
    assert moved < 1e-9
    assert sum(energy for *_, energy in both) == pytest.approx(last["energy"], abs=1e-10)
    force, moment = network.reactions(last)["A"]
    assert both[0][0].force == pytest.approx(force, abs=1e-9)
    assert both[0][0].moment == pytest.approx(moment, abs=1e-9)


def test_a_force_that_follows_needs_a_support():
    with pytest.raises(ValueError, match="P: nothing is held, so nothing bears forces that follow"):
        Network(
            _rod(), {"a": Member()}, {"A": Joint([JointEnd("a")])}, {}, {"P": Load(followers=[("A", (1.0, 0.0, 0.0), NONE)])}
        )
