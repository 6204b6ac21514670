"""Networks of segments against the states that they approximate, and their derivatives against differences."""

from pathlib import Path

import numpy as np
import pytest

from branches.scene.parse import load, parse
from ribbon_model.barriers import at_rest
from ribbon_model.descent import descend, modes
from ribbon_model.network_segments import cut, unsupported

ROOT = Path(__file__).parents[2]
#: Supports of three kinds, joints of three kinds, an angle, arms, a dead force at an arm, a moment at a hinge, weight,
#: a foundation.
EVERYTHING = """
material: {law: rod, B1: 1.0, B2: 2.0, C: 0.75, kappa_n: 0.3}
strips:
  a: {begin: [0, 0, 0], along: [0, 0.3, 1], normal: [0, 1, 0], length: 1.0, bend: 0.5}
  b: {after: a, length: 0.7, bend: -0.4, twist: 0.6}
  c: {begin: [0, 0, 0.9], end: [0.4, 0.9, 0.6], normal: [0, 0, 1]}
  d: {begin: [0.4, 0.9, 0.6], end: [0.5, 1.2, 1.4], normal: [1, 0, 0]}
joints:
  A: [a start]
  pin: {strips: [a finish, b start, c start], hinge: [1, 0, 0.2], angle: {c start: 0.2}, about: [1, 0, 0.2]}
  ball: {strips: [c finish, d start], ball: true, arm: {c finish: [0.05, 0.02, 0.1]}}
  B: [b finish]
  D: [d finish]
held:
  A: {rotation: hinged, about: [1, 0.1, 0]}
  B: {rotation: clamped, slides_along: [0, 1, 1]}
  D: clamped
loads:
  P: {pin: {force: [0.3, -1, 0.2], arm: [0.1, 0.2, 0.0]}, d at 0.4: [0.4, 0, 1]}
  M: {A: {moment: 1.0}}
numbers: {P: 1.5, M: 0.7, weight: 2.0, foundation: 1.0, B_bend: 0.2}
directions: {foundation: [0.2, 1, -0.4]}
stages: [{follow: P, to: 2.0}]
"""


@pytest.fixture(scope="module")
def everything():
    network = parse(EVERYTHING, "scene").strip()
    point, _ = network.first_point()
    return network, point


@pytest.mark.full
def test_derivatives_are_those_of_the_energy(everything):
    """Along random changes that keep all conditions: slopes at any state, curvatures at a state of equilibrium."""
    network, point = everything
    rest = descend(cut(network, point.system, point.x, 60))
    random = np.random.default_rng(0)
    assert rest.rests
    for chain, curved in ((rest.end.moved(0.05 * random.standard_normal(rest.end.size)), False), (rest.end, True)):
        gradient, slopes, hessian, _ = chain.linearized()
        count, across = len(chain.strains), np.linalg.qr(slopes.T)[0]
        for _ in range(3):
            change = random.standard_normal(chain.size)
            change -= across @ (across.T @ change)
            change *= 2e-3 / np.abs(change).max()
            far, near, here, ahead, beyond = (chain.moved(part * change).energy for part in (-2, -1, 0, 1, 2))
            slope = count * (far - 8 * near + 8 * ahead - beyond) / 12
            assert slope == pytest.approx(gradient @ change, abs=1e-8)
            if curved:
                curvature = count * (-far + 16 * near - 30 * here + 16 * ahead - beyond) / 12
                assert curvature == pytest.approx(change @ hessian @ change, rel=1e-5)


@pytest.mark.full
def test_energies_tend_to_those_of_the_continuous_network(everything):
    """As the square of the length of segments."""
    network, point = everything
    energies = [descend(cut(network, point.system, point.x, count)).end.energy for count in (120, 240, 480)]
    errors = np.abs(np.array(energies) - network.potential(point))
    assert errors[2] < 5e-5
    assert errors[:2] / errors[1:] == pytest.approx([4, 4], rel=0.1)


#: Scenes, and a value of the number that the first stage follows: hinges, floating rings, moments, weight.
STATES = {
    "network_portal": (5.0, 8.5, 11.0), "network_arches": (20.0, 36.5, 43.0), "network_hexagon": (0.5, 1.5, 2.0, 2.5),
    "network_right_angle": (1.0, 3.0), "network_weight": (100.0,), "network_bigon": (1.0, 4.5, 5.8),
}  # fmt: skip


@pytest.mark.full
@pytest.mark.parametrize("name", STATES)
def test_the_index_is_that_of_the_continuous_network(name):
    """The number of negative eigenvalues of the segments' Hessian: another way to the index of the whole network."""
    scene = load(ROOT / "configs" / f"{name}.yaml")
    network, follow = scene.strip(), scene.stages[0].follow
    start, _ = network.first_point()
    for value in STATES[name]:
        point = network.first_point(start, {follow: value})[0]
        lowest, _ = modes(cut(network, point.system, point.x, 96), 8)
        assert np.count_nonzero(lowest < 0) == point.second_variation().index()


@pytest.mark.full
def test_a_saddle_is_left():
    """A portal frame beyond its load falls to a side, stays joined and held, and is stable there."""
    network = load(ROOT / "configs" / "network_portal.yaml").strip()
    point = network.first_point(values={"P": 8.0})[0]
    chain = cut(network, point.system, point.x, 48)
    rest = at_rest(chain, 0.1)
    assert rest.energy < chain.energy - 0.01
    assert modes(rest, 1)[0][0] > 0
    left, beam, right = rest.pieces
    ends_of = [piece.place + piece.centreline[-1] for piece in rest.pieces]
    assert ends_of[0] == pytest.approx(beam.place, abs=1e-10)
    assert ends_of[1] == pytest.approx(ends_of[2], abs=1e-10)
    assert left.place == pytest.approx([0, 0, 0], abs=1e-12)
    assert right.place == pytest.approx([0, 0, 1], abs=1e-12)


def test_what_is_not_cut_is_told():
    network = load(ROOT / "configs" / "network_ring_pressure.yaml").strip()
    assert unsupported(network) == "a network with pressure"
    with pytest.raises(ValueError, match="a network with pressure is not cut into segments"):
        cut(network, None, None, 48)
