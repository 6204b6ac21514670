"""Equilibria of F = (lam - A) v + ..., v = u - lam d, with a matrix A of known real eigenvalues: branch points of u = lam d.

Eigenvalues are stated, eigenvectors are random; a multiple eigenvalue is a multiple point.
"""

import functools

import numpy as np
import pytest

import contin
from contin.events.branch_point import locate_branch_point
from contin.events.crossings import crossings, quotients
from contin.linalg.matrices import DenseFactors, nearest


def residual(u, p, out):
    """Parameters are lam, quadratic and cubic coefficients, d and A."""
    n = len(u)
    for i in range(n):
        v = u[i] - p[3 + i] * p[0]
        out[i] = p[0] * v + p[1] * v * v - p[2] * v**3
        for k in range(n):
            out[i] -= p[3 + n + i * n + k] * (u[k] - p[3 + k] * p[0])


@functools.cache
def problem(n):
    names = ["lam", "square", "cube", *(f"d{i}" for i in range(n)), *(f"a{i}_{j}" for i in range(n) for j in range(n))]
    return contin.AlgebraicProblem(residual, n, dict.fromkeys(names, 0.0), dynamics=False)


def values(spectrum, seed, symmetric, square=0.0, cube=1.0, drift=0.0):
    """Return the parameters of a problem with these eigenvalues."""
    n, random = len(spectrum), np.random.default_rng(seed)
    turn = np.linalg.qr(random.standard_normal((n, n)))[0]
    basis = turn if symmetric else np.eye(n) + 0.3 * random.standard_normal((n, n))
    matrix = basis @ np.diag(spectrum) @ np.linalg.inv(basis)
    drifts = drift * random.standard_normal(n)
    named = {f"d{i}": drifts[i] for i in range(n)} | {f"a{i}_{j}": matrix[i, j] for i in range(n) for j in range(n)}
    return {"lam": 0.0, "square": square, "cube": cube, **named}


def trivial_branch(spectrum, seed, symmetric, limits=None, nonlinear=(0.0, 1.0, 0.0), **options):
    n = len(spectrum)
    start = contin.solve(problem(n), [0.0] * n, values(spectrum, seed, symmetric, *nonlinear))
    return contin.trace(start, free=["lam"], limits={"lam": limits or (0, 1.5 * max(spectrum))}, **options)


@pytest.mark.sample(3)
@pytest.mark.parametrize("nonlinear", [(0.0, 1.0, 0.0), (1.0, 0.0, 0.0), (0.5, 1.0, 1.0)])
@pytest.mark.parametrize("symmetric", [True, False])
@pytest.mark.parametrize("seed", range(4))
def test_a_double_eigenvalue_is_a_double_point(seed, symmetric, nonlinear):
    """Also where the guess of its place is exact, and the matrix is singular right there."""
    branch = trivial_branch([12.0, 14.0, 14.0], seed, symmetric, nonlinear=nonlinear)
    simple, double = branch.labelled("BP")
    assert simple["lam"] == pytest.approx(12, abs=1e-8) and double["lam"] == pytest.approx(14, abs=1e-8)
    assert double.details.dimension == 2 and not branch.notes


@pytest.mark.parametrize("seed", range(10))
def test_no_simple_branch_point_is_found_at_a_double_one(seed):
    """Borders for a kernel of two dimensions leave the matrix singular where it has three."""
    named = values([12.0, 14.0, 14.0], seed, symmetric=seed % 2 == 0, square=0.5)
    system = contin.lowlevel.Algebraic(problem(3), ["lam"], named)
    with pytest.raises(contin.ConvergenceError):
        locate_branch_point(system, np.array([0.0, 0.0, 0.0, 14.0]))


@pytest.mark.parametrize("gap", [1e-2, 1e-4, 1e-6])
def test_simple_branch_points_close_by_are_found_as_such(gap):
    named = values([12.0, 14.0, 14.0 + gap], 1, symmetric=True, square=0.5)
    found = locate_branch_point(contin.lowlevel.Algebraic(problem(3), ["lam"], named), np.array([0.0, 0.0, 0.0, 14.0]))
    assert found.x[-1] == pytest.approx(14.0, abs=1e-9) and len(found.tangents) == 2


def spread(u, p, out):
    """u_i' = (a - i / 2) u_i - u_i^3, but every 30th state turns with its neighbour, with the rate a - i / 2."""
    for i in range(len(u)):
        out[i] = (p[0] - i / 2) * u[i] - u[i] ** 3
        if i % 30 == 0:
            out[i] = (p[0] - i / 2) * u[i] - 3 * u[i + 1]
        elif i % 30 == 1:
            out[i] = (p[0] - (i - 1) / 2) * u[i] + 3 * u[i - 1]


@pytest.mark.full
def test_hopf_points_of_a_large_problem_where_the_number_of_known_eigenvalues_differs():
    """Of sparse matrices only eigenvalues beside the axis and right of it are computed; pairs cross at a = 0, 15, 30, 45."""
    start = contin.solve(contin.AlgebraicProblem(spread, 240, {"a": -1.0}), [0.0] * 240)
    branch = contin.trace(start, free=["a"], limits={"a": (-1, 20)}, branch_points=False, errors=False)
    assert start.system.is_sparse or branch.points[0].system.is_sparse
    assert [point["a"] for point in branch.labelled("HB")] == pytest.approx([0, 15], abs=1e-7)


def test_the_eigenvalue_nearest_to_a_value():
    matrix = np.diag(np.arange(40.0)) + np.diag(np.ones(39), 1)
    matrix[:2, :2] = [[1.0, 5.0], [-5.0, 1.0]]
    import scipy.sparse

    for value in (1 + 4j, 1 - 4j, 7.2, 7.0):
        expected = np.linalg.eigvals(matrix)
        found = nearest(scipy.sparse.csc_array(matrix), value)
        assert abs(found - expected[np.argmin(np.abs(expected - value))]) < 1e-8


def test_hopf_points_beside_the_end_of_a_domain():
    """sqrt(a - 0.3): the search looks ahead of the step, where the field has no value, and takes it for no eigenvalue."""
    field = lambda u, p: (np.sqrt(p.a - 0.3) * u.x - u.y, u.x + (p.a - 1) * u.y)  # noqa: E731
    start = contin.solve(contin.AlgebraicProblem(field, ["x", "y"], {"a": 2.0}), [0.0, 0.0])
    branch = contin.trace(start, free=["a"], direction=-1, limits={"a": (-1, 3)})
    # the trace of the matrix vanishes where sqrt(a - .3) = 1 - a: a = (3 - sqrt(9 - 5.2)) / 2
    assert [point["a"] for point in branch.labelled("HB")] == pytest.approx([(3 - 3.8**0.5) / 2], abs=1e-9)
    assert branch.stop.reason == "no convergence"


def test_a_cluster_that_is_labelled_as_one_point_says_how_wide_it_is():
    """Two eigenvalues 2e-7 apart lie within the error of the double point."""
    branch = trivial_branch([12.0, 14.0, 14.0 + 2e-7], 3, symmetric=True)
    (point,) = branch.labelled("BP")[1:]
    assert point.details.dimension == 2 and point.details.spread == pytest.approx(1e-7, rel=1e-3)
    assert abs(point["lam"] - 14) <= point.errors["lam"] < 2e-7


def grid(u, p, out):
    """Allen-Cahn on m x m places of the unit square: a u - u^3 + the five-point Laplacian, zero at the boundary."""
    m = int(round(len(u) ** 0.5))
    for i in range(m):
        for j in range(m):
            here = u[i * m + j]
            out[i * m + j] = p[0] * here - here**3 - 4 * (m + 1) ** 2 * here
            if i > 0:
                out[i * m + j] += (m + 1) ** 2 * u[(i - 1) * m + j]
            if i < m - 1:
                out[i * m + j] += (m + 1) ** 2 * u[(i + 1) * m + j]
            if j > 0:
                out[i * m + j] += (m + 1) ** 2 * u[i * m + j - 1]
            if j < m - 1:
                out[i * m + j] += (m + 1) ** 2 * u[i * m + j + 1]


def laplacian(m, low, high):
    """Return the eigenvalues in an interval with their multiplicities."""
    one = 4 * (m + 1) ** 2 * np.sin(np.arange(1, m + 1) * np.pi / (2 * m + 2)) ** 2
    found, counts = np.unique((one[:, None] + one).ravel().round(6), return_counts=True)
    inside = (found > low) & (found < high)
    return list(zip(found[inside], counts[inside]))


def found_on(branch):
    return [(round(point["a"], 6), getattr(point.details, "dimension", 1)) for point in branch.labelled("BP")]


@pytest.mark.full
@pytest.mark.parametrize("dynamics", [True, False])
@pytest.mark.parametrize("step", [34.0, 100.0])
def test_double_points_of_a_grid_in_long_steps(step, dynamics):
    """The step from 116 to 150 passes the double eigenvalue 129.5121; that to 216 ten of them."""
    start = contin.solve(contin.AlgebraicProblem(grid, 36, {"a": 116.0}, dynamics=dynamics), [0.0] * 36)
    branch = contin.trace(start, free=["a"], limits={"a": (0, 300)}, step=step, change=1.4, accuracy=0.1, errors=False)
    assert found_on(branch) == laplacian(6, 116, 300) and not branch.notes


@pytest.mark.full
def test_double_points_of_a_large_grid():
    start = contin.solve(contin.AlgebraicProblem(grid, 225, {"a": 1.0}), [0.0] * 225)
    branch = contin.trace(start, free=["a"], limits={"a": (0, 300)}, errors=False)
    assert branch.points[0].system.is_sparse and found_on(branch) == laplacian(15, 0, 300)


def steps_of(spectrum, low, high, symmetric, seed):
    """Return the factors of [F_x; row] of lam - A at two values of lam."""
    random, n = np.random.default_rng(seed), len(spectrum)
    turn = np.linalg.qr(random.standard_normal((n, n)))[0]
    basis = turn if symmetric else np.eye(n) + 0.6 * random.standard_normal((n, n)) / np.sqrt(n)
    matrix = basis @ np.diag(spectrum) @ np.linalg.inv(basis)
    row = np.append(random.standard_normal(n) / np.sqrt(n), 1.0)
    return [DenseFactors(np.vstack([np.eye(n, n + 1) * lam - np.pad(matrix, ((0, 0), (0, 1))), row])) for lam in (low, high)]


@pytest.mark.sample(20)
@pytest.mark.parametrize("seed", range(60))
def test_a_count_that_is_clear_is_right(seed):
    """Of random spectra with double eigenvalues, small and large, over steps that pass up to some 30 of them."""
    random = np.random.default_rng(seed)
    n = int(random.choice([10, 40, 150]))
    spectrum = np.repeat(np.cumsum(random.exponential(1.0, n // 2)) ** random.choice([1.0, 2.0]), 2)
    low = random.uniform(0, 1) * np.quantile(spectrum, 0.5)
    high = low * (1 + random.uniform(0.05, 0.5)) + 0.1
    before, after = steps_of(spectrum, low, high, bool(seed % 2), seed)
    count, clear = crossings(quotients(before, after, n + 1))
    if clear:
        assert count == np.count_nonzero((spectrum > low) & (spectrum < high))
