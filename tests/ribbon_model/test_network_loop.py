"""Closed strips as networks of one strip whose ends are joined, with no symmetry imposed, against cells and half loops."""

import math

import numpy as np
import pytest

from contin import trace
from ribbon_model import exact
from ribbon_model.laws import RIBBON, ROD
from ribbon_model.linear import thresholds
from ribbon_model.network import FINISH, Joint, JointEnd, Member, Network
from ribbon_model.section import Section
from tests.ribbon_model.test_network_independent import Shooting

NU, TURN = 0.3, 2 * math.pi


def _loop(covers: int, kappa_n: float, angle: float | str = 0.0) -> Network:
    """A circle of length 1 that is covered several times; curvatures are in units of one cover."""
    section = Section(RIBBON, {"nu": NU, "kappa_n": kappa_n * TURN})
    joint = Joint([JointEnd("loop", FINISH), JointEnd("loop", angle=angle)])
    return Network({"strip": section}, {"loop": Member("strip", 1.0, strains=(covers * TURN, 0.0, 0.0))}, {"J": joint})


def _left(m: int, n: int, limits: tuple[float, float], side: float):
    """The network with a phase, and the branch (m, n) from the m-covered circle, which is looked at from a side of it."""
    (birth,) = thresholds(RIBBON, m, n, NU)
    loop = _loop(m, birth + side)
    first, _ = loop.first_point()
    ends = {"kappa_n": (birth * TURN - 0.4 * TURN, birth * TURN + 0.4 * TURN)}
    circle = trace(first, free=["kappa_n"], direction=int(-math.copysign(1, side)), limits=ends, progress=False)
    (point,) = (p for p in circle.labelled("BP") if p["kappa_n"] == pytest.approx(birth * TURN, rel=1e-10))
    assert point.nullity == 2
    held, start = loop.with_phases(point)
    ends = {"kappa_n": (limits[0] * TURN, limits[1] * TURN)}
    return held, trace(start, branch=1, limits=ends, progress=False)


def _places(branch, label):
    return [(point["kappa_n"] / TURN, point.index_change) for point in branch.labelled(label)]


@pytest.mark.full
def test_the_branch_from_the_circle_to_the_triple_one_and_back():
    """(1, 2): its fold is known by quadrature; it meets the 3-covered circle at -1/2 and comes back as its own mirror image."""
    held, branch = _left(1, 2, (-1, 4.5), -0.3)
    (fold,) = exact.folds(1, 2, NU)
    (first, change), (last, back) = _places(branch, "LP")
    assert (first, last) == pytest.approx((fold.kappa_n, fold.kappa_n), abs=1e-10)
    assert (change, back) == ((0, 1), (1, 0))
    ((end, _),) = _places(branch, "BP")
    assert end == pytest.approx(-0.5, abs=1e-10)
    assert branch.labelled("LP")[0].phase_loads() == {}
    assert max(np.abs(part).max() for point in branch for part in held.reactions(point)["floating"]) < 1e-7
    place = branch.labelled("LP")[0]
    strains = held.strains(place.system, place.x)["loop"]
    twist = np.abs(strains[:, 2] / strains[:, 0]).max()
    assert twist**2 == pytest.approx(fold.eta_max_squared, rel=1e-4)  # at nodes


@pytest.mark.full  # secondary branches of 80 points, with their index
def test_a_secondary_branch():
    """(3, 1): what leaves it at -21.62681748 comes back to it at -114.30935506, as on the half loop between mirrors."""
    held, branch = _left(3, 1, (-25, 20), 0.3)
    ((place, change),) = _places(branch, "BP")
    assert place == pytest.approx(-21.62681748, abs=1e-8)
    assert change == (2, 1)
    secondary = trace(branch.labelled("BP")[0], branch=1, limits={"kappa_n": (-125 * TURN, 0)}, progress=False)
    ((end, _),) = _places(secondary, "BP")
    assert end == pytest.approx(-114.30935506, abs=1e-8)
    force = [np.linalg.norm(point.system.states(point.x)[0, held.places[0][11:14]]) for point in secondary]
    assert min(force[0], force[-1]) < 1e-5 < 1 < max(force)


def test_a_corner_needs_no_phase():
    """A rod whose ends meet at an angle, which is followed from the circle: there is no shift. Places are found by shooting."""
    joint = Joint([JointEnd("loop", FINISH), JointEnd("loop", angle="corner", axis=(0.6, 0.0, 0.8))])
    section = Section(ROD, {"B1": 1.0, "B2": 1.7, "C": 0.8, "kappa_n": 4.0})
    loop = Network({"strip": section}, {"loop": Member("strip", 1.0, strains=(TURN, 0.0, 0.0))}, {"J": joint})
    first, _ = loop.first_point()
    last = trace(first, free=["corner"], limits={"corner": (0, 1)}, progress=False)[-1]
    assert last["corner"] == pytest.approx(1, abs=1e-12)
    states = last.system.states(last.x)
    _, moved = Shooting(loop, last.parameters).solved([states[0, loop.places[0]]])
    assert moved < 1e-8 * np.abs(states[:, loop.places[0][11:14]]).max()
    assert np.linalg.norm(states[0, loop.places[0][11:14]]) > 1  # the force R
    assert last.index == 0
