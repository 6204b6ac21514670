"""The structured factorization against numpy's dense one."""

import numpy as np
import pytest

from contin.linalg import blocks as segments
from contin.linalg.blocks import Blocks, layout
from contin.linalg.condensation import Factorization


def random_blocks(n, degree, intervals, k, r, seed=0, depends=None):
    """Layout and blocks of a random matrix, and the same matrix dense with equations and unknowns in the documented order.

    Where ``depends`` says that equations do not contain states, zeros stand there, or nothing at all (NaN).
    """
    random = np.random.default_rng(seed)
    places = layout(np.ones((n, n), bool) if depends is None else depends, degree)
    rows, width = n * degree, n * (degree + 1) + k
    inner = n * (degree - 1)
    local = random.standard_normal((intervals, rows, width))
    known = local.copy()
    if depends is not None:
        equation, unknown = places.rows % n, np.concatenate([places.inside, places.ends]) % n
        coupled = depends[equation][:, unknown] | (equation[:, None] == unknown)
        known[:, :, : inner + 2 * n] *= coupled
        local = known.copy()
        group = np.empty(n, int)
        for g, (a, b) in enumerate(zip(places.offsets, places.offsets[1:])):
            group[places.order[a:b]] = g
        follows = places.follows.reshape(group.max() + 1, -1).astype(bool) | np.eye(group.max() + 1, dtype=bool)
        unread = ~follows[group[unknown[:inner]][None, :], group[equation][:, None]]
        local[:, :, :inner][:, unread] = np.nan
    border = random.standard_normal((intervals, r, width))
    corner = random.standard_normal((r, k))
    boundary_count = n + k - r
    first = random.standard_normal((boundary_count, n))
    last = random.standard_normal((boundary_count, n + k))
    size = (intervals * degree + 1) * n + k
    dense = np.zeros((size, size))
    for j in range(intervals):
        start = j * rows
        columns = np.concatenate([start + places.inside, start + places.ends, np.arange(size - k, size)])
        dense[np.ix_(start + places.rows, columns)] = known[j]
        dense[size - r :, columns[: inner + 2 * n]] += border[j, :, : inner + 2 * n]
    at = intervals * rows
    dense[at : at + boundary_count, :n] = first
    dense[at : at + boundary_count, size - k - n :] = last
    dense[size - r :, size - k :] = corner
    return places, Blocks(local, border, corner, first, last), dense


@pytest.mark.parametrize(
    ("n", "degree", "intervals", "k", "r"),
    [(1, 2, 1, 1, 1), (2, 4, 7, 1, 1), (3, 3, 5, 4, 2), (4, 7, 12, 3, 1), (5, 8, 2, 2, 2), (13, 4, 6, 4, 1), (2, 2, 30, 0, 1)],
)
def test_solves_agree_with_dense(n, degree, intervals, k, r):
    places, blocks, dense = random_blocks(n, degree, intervals, k, r)
    factors = Factorization(places, blocks)
    b = np.random.default_rng(1).standard_normal(len(dense))
    tolerance = 1e-14 * np.linalg.cond(dense)
    assert np.allclose(factors.solve(b), np.linalg.solve(dense, b), atol=tolerance, rtol=tolerance)
    assert np.allclose(factors.solve_transposed(b), np.linalg.solve(dense.T, b), atol=tolerance, rtol=tolerance)


@pytest.mark.parametrize("count", range(10))
def test_right_hand_sides_do_not_depend_on_their_number(count):
    places, blocks, dense = random_blocks(3, 4, 5, 2, 1)
    factors = Factorization(places, blocks)
    b = np.random.default_rng(2).standard_normal((count, len(dense)))
    for solve in (factors.solve, factors.solve_transposed):
        assert np.array_equal(solve(b), np.reshape([solve(row) for row in b], b.shape))


def test_the_length_of_a_right_hand_side_is_checked():
    places, blocks, dense = random_blocks(2, 3, 4, 2, 1)
    factors = Factorization(places, blocks)
    with pytest.raises(ValueError, match="reshape"):
        factors.solve(np.ones(len(dense) + 1))


def test_a_singular_matrix_gives_no_finite_solution():
    places, blocks, dense = random_blocks(2, 3, 4, 2, 1)
    blocks.local[1, :, :2] = 0.0
    factors = Factorization(places, blocks)
    assert np.isnan(factors.sign) or factors.sign == 0 or not np.all(np.isfinite(factors.solve(np.ones(len(dense)))))


@pytest.mark.parametrize("seed", range(12))
def test_solves_with_states_that_do_not_depend_on_each_other(seed):
    """What does not couple is not looked at: NaN stands there."""
    random = np.random.default_rng(seed)
    n, degree = int(random.integers(1, 10)), int(random.integers(2, 9))
    depends = random.random((n, n)) < 0.25
    places, blocks, dense = random_blocks(n, degree, 4, 2, 1, seed, depends)
    factors = Factorization(places, blocks)
    b = random.standard_normal((6, len(dense)))
    tolerance = 1e-14 * np.linalg.cond(dense)
    assert np.allclose(factors.solve(b), np.linalg.solve(dense, b.T).T, atol=tolerance, rtol=tolerance)
    assert np.allclose(factors.solve_transposed(b), np.linalg.solve(dense.T, b.T).T, atol=tolerance, rtol=tolerance)
    assert np.array_equal(factors.solve(b[2]), factors.solve(b)[2])


def test_determinant_changes_sign_with_the_dense_one():
    """Up to one factor for the shape: products of signs over random matrices agree."""
    signs = []
    for seed in range(20):
        places, blocks, dense = random_blocks(2, 3, 4, 2, 1, seed)
        signs.append(Factorization(places, blocks).sign * np.sign(np.linalg.det(dense)))
    assert len(set(signs)) == 1


def test_the_count_must_be_square():
    places, blocks, _ = random_blocks(2, 3, 4, 2, 1)
    with pytest.raises(ValueError, match="2 states and 2 parameters"):
        Factorization(places, blocks._replace(first=blocks.first[:-1], last=blocks.last[:-1]))


# --- segments: large matrices, here any size ---------------------------------------------------------------------------

#: Numbers of intervals: two of them are one segment, 40 are 16 of two or three.
SIZES = [(1, 2, 2, 1, 1), (2, 4, 7, 1, 1), (3, 3, 33, 4, 2), (4, 7, 12, 0, 0), (5, 2, 40, 2, 2), (13, 4, 21, 4, 1)]


def in_segments(places, blocks):
    """Factors of a matrix that is divided as a large one is."""
    return Factorization(places, blocks, segments.share(len(blocks.local), 2**20))


@pytest.mark.sample(4)
@pytest.mark.parametrize("sparse", [False, True])
@pytest.mark.parametrize("sizes", SIZES)
def test_segments_agree_with_dense_and_have_the_same_bits_for_all_threads(sizes, sparse, monkeypatch):
    n = sizes[0]
    depends = np.random.default_rng(n).random((n, n)) < 0.3 if sparse else None
    known = None
    for count in (1, 2, 3, 5):
        monkeypatch.setenv("CONTIN_THREADS", str(count))
        places, blocks, dense = random_blocks(*sizes, seed=7, depends=depends)
        factors = in_segments(places, blocks)
        b = np.random.default_rng(1).standard_normal((6, len(dense)))
        found = factors.solve(b), factors.solve_transposed(b), factors.sign
        known = found if known is None else known
        assert [np.array_equal(one, other) for one, other in zip(found, known)] == [True] * 3
        assert np.array_equal(factors.solve(b[4]), found[0][4])
    tolerance = 1e-14 * np.linalg.cond(dense)
    assert np.allclose(known[0], np.linalg.solve(dense, b.T).T, atol=tolerance, rtol=tolerance)
    assert np.allclose(known[1], np.linalg.solve(dense.T, b.T).T, atol=tolerance, rtol=tolerance)


def test_the_determinant_of_segments_changes_sign_with_the_dense_one(monkeypatch):
    monkeypatch.setenv("CONTIN_THREADS", "2")
    signs = []
    for seed in range(20):
        places, blocks, dense = random_blocks(2, 3, 9, 2, 1, seed)
        signs.append(in_segments(places, blocks).sign * np.sign(np.linalg.det(dense)))
    assert len(set(signs)) == 1


@pytest.mark.parametrize("count", [1, 2])
def test_a_singular_matrix_of_segments_gives_no_finite_solution(count, monkeypatch):
    monkeypatch.setenv("CONTIN_THREADS", str(count))
    places, blocks, dense = random_blocks(2, 3, 20, 2, 1)
    blocks.local[7, :, :2] = 0.0
    factors = in_segments(places, blocks)
    assert np.isnan(factors.sign) or factors.sign == 0 or not np.all(np.isfinite(factors.solve(np.ones(len(dense)))))


def test_the_segments_depend_on_the_size_only(monkeypatch):
    for count in ("1", "5"):
        monkeypatch.setenv("CONTIN_THREADS", count)
        assert segments.share(1000, 2**20 - 1).last == 1
        assert segments.share(1000, 2**20).starts.tolist() == [1000 * s // 16 for s in range(17)]
        assert segments.share(5, 2**20).starts.tolist() == [0, 2, 5]
        assert segments.share(1, 2**20).last == 1
