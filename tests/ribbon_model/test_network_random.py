"""Random networks: trees, rings and frames, with random joints, supports and loads. Each has a state or a sentence that helps.

States are solved again by shooting (`test_network_independent`).
"""

import dataclasses

import numpy as np
import pytest
from numpy.random import default_rng

from contin import ContinError, trace
from ribbon_model.ends import BALL as BALL_END
from ribbon_model.ends import CLAMP, hinge
from ribbon_model.laws import ROD
from ribbon_model.network import BALL, FINISH, HINGE, RIGID, Joint, JointEnd, Load, Network, OutOfReach, straight
from ribbon_model.network_first import first_state
from ribbon_model.section import Section
from tests.ribbon_model.test_network_independent import Shooting

#: Sentences that may end an attempt: each says what to change.
HELPFUL = ("hold more", "hold less")


def _random(seed: int) -> Network:
    """A network of up to five members; the first joint is held, or nothing is."""
    rng = default_rng(seed)
    B1, B2, C = rng.uniform(0.5, 3, 3)
    sections = {"strip": Section(ROD, {"B1": B1, "B2": B2, "C": C, "kappa_n": float(rng.uniform(-1, 1))})}
    kind = ("tree", "ring", "frame")[seed % 3]
    count = int(rng.integers(2, 6))
    if kind == "ring":
        corners = max(count, 3)
        places = [
            (0.0, *(rng.uniform(0.8, 1.2) * np.array([np.cos(a), np.sin(a)]))) for a in 2 * np.pi * np.arange(corners) / corners
        ]
        pairs = [(i, (i + 1) % corners) for i in range(corners)]
    elif kind == "frame":
        places = [(0.0, 0.0, 0.0), (0.0, 1.0, 0.1), (0.2, 1.1, 1.0), (0.0, 0.0, 1.2)]
        pairs = [(0, 1), (1, 2), (3, 2)]
    else:
        places = [tuple(rng.uniform(-1, 1, 3))]
        pairs = []
        for i in range(count):
            places.append(tuple(np.array(places[int(rng.integers(len(places)))]) + rng.uniform(-1, 1, 3)))
            pairs.append((min(range(len(places) - 1), key=lambda j: abs(hash((seed, i, j)) % 97)), len(places) - 1))
    members = {}
    for number, (a, b) in enumerate(pairs):
        outward = np.add(places[a], places[b])
        normal = tuple(outward) if kind == "ring" else tuple(rng.standard_normal(3))
        members[f"s{number}"] = straight("strip", places[a], places[b], normal)
    at: dict[int, list[JointEnd]] = {}
    for number, (a, b) in enumerate(pairs):
        at.setdefault(a, []).append(JointEnd(f"s{number}"))
        at.setdefault(b, []).append(JointEnd(f"s{number}", FINISH))
    joints = {}
    for place, ends in at.items():
        which = rng.choice([RIGID, RIGID, RIGID, HINGE, BALL]) if len(ends) > 1 else RIGID
        arms = [JointEnd(each.member, each.end) for each in ends]
        joints[f"J{place}"] = Joint(arms, str(which), tuple(rng.standard_normal(3)))
    floats = kind == "ring" and seed % 2 == 0
    names = list(joints)
    supports = {"tree": [names[0]], "ring": [] if floats else [names[0]], "frame": ["J0", "J3"]}[kind]
    held = {name: rng.choice(np.array([CLAMP, CLAMP, hinge((1.0, 0.0, 0.0)), BALL_END], dtype=object)) for name in supports}
    arm = tuple(0.1 * rng.standard_normal(3)) if seed % 4 == 0 else (0.0, 0.0, 0.0)
    loads = {} if floats else {"P": Load([(names[-1], tuple(rng.standard_normal(3)), arm)])}
    return Network(sections, members, joints, held, loads)


@pytest.mark.full
@pytest.mark.parametrize("seed", [34, 167])
def test_round_off_where_a_network_can_move_is_no_state(seed):
    """A ring of magnets along it, whose field does not turn it; two strips that turn about the line between their far ends."""
    with pytest.raises(ContinError, match="hold more"):
        (_random(seed) if seed == 167 else dataclasses.replace(_random(seed), numbers={"field": 2.0})).first_point()


@pytest.mark.full
def test_a_state_beyond_a_fold_is_found_by_descent(monkeypatch):
    """The way from the drawing turns back at 68 %; a hinge whose axis is not of unit length."""
    network, said = _random(82), []

    def first_point(*given, _usual=network.first_point, **options):
        try:
            return _usual(*given, **options)
        except OutOfReach as error:
            said.append(str(error))
            raise

    monkeypatch.setattr(network, "first_point", first_point)
    point, how = first_state(network)
    assert len(said) == 1 and "followed to 0.681 of the way" in said[0]
    assert how == "from the drawing, by descent of its energy"
    assert point.second_variation().index() == 0
    states = point.system.states(point.x)
    assert Shooting(network, point.parameters).solved([states[0, places] for places in network.places])[1] < 1e-9


@pytest.mark.full
def test_an_unloaded_network_has_sizes():
    """Without them the first step of a load was 1e-48."""
    network = _random(147)
    assert trace(network.first_point()[0], free=["P"], max_points=6, progress=False)[-1]["P"] > 0.01


@pytest.mark.sample(1)
@pytest.mark.parametrize("seed", range(200))
def test_a_random_network_has_a_state_or_a_sentence(seed):
    network = _random(seed)
    try:
        first, _ = first_state(network)
        number = "kappa_n" if network.floats else "P"
        branch = trace(first, free=[number], max_points=6, progress=False)
    except ContinError as error:
        assert "\n" not in str(error)
        assert any(words in str(error) for words in HELPFUL), str(error)
        return
    last = branch[-1]
    states = last.system.states(last.x)
    shooting = Shooting(network, last.parameters)
    both, moved = shooting.solved([states[0, list(piece.at)] for piece in network.problem.pieces])
    size = 1 + max(np.abs(states[:, list(piece.at[11:14])]).max() for piece in network.problem.pieces)
    assert moved < 1e-7 * size
    assert sum(energy for *_, energy in both) == pytest.approx(last["energy"], abs=1e-8 * size)
    if network.floats:
        assert max(np.abs(part).max() for part in network.reactions(last)["floating"]) < 1e-7 * size
