"""Groups of states that depend on each other, and the order of rows and columns that follows from them."""

import numpy as np
import pytest

from contin.linalg.blocks import coupled_groups, layout


def test_groups_come_after_those_that_they_depend_on():
    depends = np.zeros((5, 5), bool)
    for row, column in ((0, 1), (1, 0), (2, 2), (0, 2), (3, 0), (4, 4), (4, 3)):
        depends[row, column] = True
    assert coupled_groups(depends) == [[2], [0, 1], [3], [4]]
    assert coupled_groups(np.ones((3, 3), bool)) == [[0, 1, 2]]


def test_many_states_are_one_group():
    assert coupled_groups(np.eye(501, dtype=bool)) == [list(range(501))]


@pytest.mark.sample(20)
@pytest.mark.parametrize("seed", range(100))
def test_groups_against_powers_of_the_pattern(seed):
    """Of random patterns of up to 15 states: mutual reachability, and the number of states that are reached as the order."""
    random = np.random.default_rng(seed)
    n = int(random.integers(1, 16))
    depends = random.random((n, n)) < random.random() * random.choice([0.1, 0.3, 1.0])
    reach = np.linalg.matrix_power(np.eye(n, dtype=int) + depends, n) > 0
    groups = {tuple(np.flatnonzero(row).tolist()) for row in reach & reach.T}
    known = sorted(groups, key=lambda group: (np.count_nonzero(reach[group[0]]), group))
    assert coupled_groups(depends) == [list(group) for group in known]


@pytest.mark.parametrize(("n", "degree"), [(1, 2), (4, 3), (9, 8)])
def test_every_place_of_a_block_is_used_once(n, degree):
    places = layout(np.random.default_rng(n).random((n, n)) < 0.3, degree)
    assert sorted(places.order) == list(range(n))
    assert sorted(places.rows) == list(range(n * degree))
    assert sorted([*places.inside, *places.ends]) == list(range(n * (degree + 1)))


@pytest.mark.parametrize("seed", range(10))
def test_places_of_each_group_stand_together(seed):
    random = np.random.default_rng(seed)
    n, d = int(random.integers(1, 10)), int(random.integers(2, 9))
    depends = random.random((n, n)) < 0.25
    places = layout(depends, d)
    groups = coupled_groups(depends)
    follows = places.follows.reshape(len(groups), len(groups))
    ends = []
    for g, group in enumerate(groups):
        first, last = places.offsets[g], places.offsets[g + 1]
        assert places.order[first:last].tolist() == group
        assert places.rows[d * first : d * last].tolist() == [i * n + a for i in range(d) for a in group]
        assert places.inside[(d - 1) * first : (d - 1) * last].tolist() == [i * n + a for i in range(1, d) for a in group]
        ends = [*group, *(n * d + a for a in group), *ends]
        assert follows[g].tolist() == [int(depends[np.ix_(other, group)].any()) for other in groups]
    assert places.ends.tolist() == ends
