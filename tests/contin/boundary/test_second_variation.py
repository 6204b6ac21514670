"""The index against a dense finite element Hessian, and what a branch says of it: modes, symmetries, files, meshes, scales."""

import math
from collections import namedtuple
from functools import partial

import numpy as np
import pytest
import scipy.linalg

import contin
from contin.boundary.second_variation import second_variation

# --- an independent computation ---------------------------------------------------------------------------------------
#
# Midpoint rule on uniform elements: x (nodes) and w (elements) are free, Delta x / h = f in the middle of each element.
# The Hessian of energy - lambda.f + mu.g, and of Phi + sigma.e, by central differences of the functions as the user wrote them,
# restricted to the null space of all linearized conditions (dense, QR). Truncation error h^2.

ELEMENTS = 40
STEP = 1e-3  # fourth-order differences: error 1e-10, round-off 1e-10


def hessian(function, at):
    """Second derivatives by differences of fourth order along all pairs of directions."""
    size = len(at)
    unit = np.eye(size) * STEP
    weights = {-2: -1 / 12, -1: 4 / 3, 0: -5 / 2, 1: 4 / 3, 2: -1 / 12}

    def along(direction):
        return sum(weight * function(at + i * direction) for i, weight in weights.items()) / STEP**2

    own = [along(unit[i]) for i in range(size)]
    result = np.diag(own)
    for i in range(size):
        for j in range(i):
            result[i, j] = result[j, i] = (along(unit[i] + unit[j]) - own[i] - own[j]) / 2
    return result


def gradient(function, at):
    unit = np.eye(len(at)) * STEP
    weights = {-2: 1 / 12, -1: -2 / 3, 1: 2 / 3, 2: -1 / 12}
    rows = [sum(w * np.asarray(function(at + i * e), dtype=float) for i, w in weights.items()) / STEP for e in unit]
    return np.array(rows).T


class Statement:
    """The functions of a variational problem, on arrays."""

    def __init__(self, point):
        problem = point.system.problem
        self.v, self.n, self.k = problem.variation, problem.dimension, len(problem.variation.controls)
        self.p = namedtuple("P", self.v.parameters)(*[point[name] for name in self.v.parameters])
        self.mu = [point[f"mu_{name}"] for name in self.v.integrals]
        self.sigma = [point[name] for name in problem.multipliers if name.startswith("sigma")]
        self.X, self.W = namedtuple("X", self.v.states), namedtuple("W", self.v.controls)

    def split(self, z):
        return self.X(*map(float, z[: self.n])), self.W(*map(float, z[self.n : self.n + self.k]))

    def rates(self, t, z):
        x, w = self.split(z)
        return np.array(w if self.v.kinematics is None else self.v.kinematics(t, x, w, self.p), dtype=float)

    def integrands(self, t, z):
        x, w = self.split(z)
        return np.array([g(t, x, w, self.p) for g in self.v.integrals.values()], dtype=float)

    def density(self, t, z, lam):
        x, w = self.split(z)
        return self.v.energy(t, x, w, self.p) - lam @ self.rates(t, z) + np.dot(self.mu, self.integrands(t, z))

    def ends(self, z):
        return np.array(
            [] if self.v.ends is None else self.v.ends(self.X(*z[: self.n]), self.X(*z[self.n :]), self.p), dtype=float
        )

    def end_potential(self, z, sigma):
        a, b = self.X(*z[: self.n]), self.X(*z[self.n :])
        phi = 0.0 if self.v.end_energy is None else self.v.end_energy(a, b, self.p)
        return phi + np.dot(sigma, self.ends(z)[self.with_multiplier])


def finite_element_eigenvalues(point):
    """Eigenvalues of the dense Hessian on the null space of the conditions, smallest first, of a unit mass matrix."""
    s, (a, b) = Statement(point), point.system.problem.domain
    fixed = [name for place in point.system.problem.canonical.fixed for name in place]
    nodes = np.linspace(a, b, ELEMENTS + 1)
    middles, h = (nodes[1:] + nodes[:-1]) / 2, (b - a) / ELEMENTS
    u = point.system.evaluate(point.x, middles)
    n, k = s.n, s.k
    size = n * (ELEMENTS + 1) + k * ELEMENTS
    big, rows = np.zeros((size, size)), np.zeros((n * ELEMENTS, size))
    held = np.zeros((len(s.mu), size))
    controls = _controls(point, middles)
    for e, t in enumerate(middles):
        z = np.concatenate([u[e, :n], controls[e]])
        S = h * hessian(partial(s.density, t, lam=u[e, n:]), z)
        take = np.zeros((n + k, size))
        left, right = n * e + np.arange(n), n * (e + 1) + np.arange(n)
        take[np.arange(n), left] = take[np.arange(n), right] = 0.5
        take[n + np.arange(k), n * (ELEMENTS + 1) + k * e + np.arange(k)] = 1.0
        used = np.flatnonzero(take.any(axis=0))
        big[np.ix_(used, used)] += take[:, used].T @ S @ take[:, used]
        rows[n * e : n * (e + 1)] = -gradient(partial(s.rates, t), z) @ take
        rows[n * e + np.arange(n), right] += 1 / h
        rows[n * e + np.arange(n), left] -= 1 / h
        if s.mu:
            held += h * gradient(partial(s.integrands, t), z) @ take
    both = np.concatenate([point.system.evaluate(point.x, np.array([t]))[0, :n] for t in (a, b)])
    at_ends = np.concatenate([np.arange(n), n * ELEMENTS + np.arange(n)])
    slopes = gradient(s.ends, both) if s.v.ends else np.zeros((0, 2 * n))
    s.with_multiplier = _with_multiplier(slopes, len(s.sigma))
    assert len(slopes) == len(fixed) + len(s.sigma)
    big[np.ix_(at_ends, at_ends)] += hessian(lambda z: s.end_potential(z, s.sigma), both)
    ends = np.zeros((len(slopes), size))
    ends[:, at_ends] = slopes
    constraints = np.vstack([rows, held, ends])
    free = scipy.linalg.qr(constraints.T)[0][:, len(constraints) :]
    mass = np.full(size, h)
    return scipy.linalg.eigh(free.T @ big @ free, free.T * mass @ free, eigvals_only=True)


def _with_multiplier(slopes, count):
    """Rows that do more than fix one state: they have a multiplier."""
    return [i for i, row in enumerate(slopes) if np.count_nonzero(np.abs(row) > 1e-8) > 1 or count == len(slopes)]


def _controls(point, t):
    """The controls at places t: rates of the states, or by Newton's method."""
    s, n = Statement(point), point.system.problem.dimension
    u = point.system.evaluate(point.x, t)
    if s.v.kinematics is None:
        step = 1e-5
        return (point.system.evaluate(point.x, t + step) - point.system.evaluate(point.x, t - step))[:, :n] / (2 * step)
    result = []
    for place, row in zip(t, u):
        w = np.zeros(s.k)
        for _ in range(30):  # d(L - lambda.f + mu.g)/dw = 0
            at = np.concatenate([row[:n], w])
            density = partial(s.density, place, lam=row[n:])
            slopes, second = gradient(lambda z: [density(z)], at)[0, n:], hessian(density, at)[n:, n:]  # noqa: B023
            w = w - np.linalg.solve(second, slopes)
            if np.abs(slopes).max() < 1e-8:
                break
        result.append(w)
    return np.array(result)


RATES = contin.VariationalProblem(
    lambda t, x, w, p: (
        w.a**2 / 2 + (1 + 0.4 * math.cos(t)) * w.b**2 / 2 + p.c * w.a * w.b + p.d * x.b * w.a + x.b**4 / 4 - p.f * x.a * t
        + p.load * (math.cos(x.a) + p.e * x.b**2 * (1 + t * x.a / 2))
    ),
    ["a", "b"], {"load": 5.0, "c": 0.2, "d": 0.3, "e": -0.4, "f": 0.5, "k": 0.5}, domain=(0.0, 1.5),
    integrals={"mean": lambda t, x, w, p: math.sin(x.a) - p.k * x.b},
    ends=lambda a, b, p: (a.a, b.a - p.k * a.b - b.a**2 / 4),
    end_energy=lambda a, b, p: p.d * b.b**2 * (1 + a.b) + p.e * a.b**2 / 2 - p.f * b.b,
)  # fmt: skip
CONTROLS = contin.VariationalProblem(
    lambda t, x, w, p: (
        math.cosh(w.u) + w.v**2 / 2 + p.c**2 * w.u**2 * w.v**2 / 2 - p.f * x.b + x.a**4
        - p.load * (x.a**2 + x.b * x.a - x.c**2 / 3)
    ),
    ["a", "b", "c"], {"load": 5.0, "c": 0.2, "d": 0.3, "f": 0.5, "k": 0.5}, controls=["u", "v"],
    kinematics=lambda t, x, w, p: (w.u + p.d * x.b, w.v - x.a, x.b * p.k + p.d * w.u + math.sin(x.c)),
    ends=lambda a, b, p: (a.a + a.b**2, a.c, b.a - p.k * b.b + b.a**2 / 2),
    end_energy=lambda a, b, p: p.d * b.b**2 * (1 + a.b) + b.c**2,
)  # fmt: skip


@pytest.mark.full
@pytest.mark.parametrize("problem, count, largest", [(RATES, 8, 80), (CONTROLS, 2, 5)], ids=["rates", "controls"])
def test_index_against_finite_elements(problem, count, largest):
    """Random states: integral conditions, coupled and nonlinear end conditions, end energies, fewer controls than states."""
    random = np.random.default_rng(7)
    indices = []
    while len(indices) < count:
        values = {name: float(random.uniform(-0.6, 0.6)) for name in problem.variation.parameters}
        values["load"] = float(random.uniform(0, largest))
        size = random.uniform(0, 1)
        try:
            point = contin.solve(problem, partial(_wave, size, problem.dimension), values)
        except contin.ContinError:
            continue
        eigenvalues = finite_element_eigenvalues(point)
        if np.abs(eigenvalues).min() > 0.05:  # else truncation may decide
            indices.append(second_variation(point.system, point.x).index())
            assert indices[-1] == np.count_nonzero(eigenvalues < 0)
    assert problem is CONTROLS or len(set(indices)) > 3


def _wave(size, count, t):
    return [size * math.sin(3 * t)] * count


# --- what a branch says -----------------------------------------------------------------------------------------------

PINNED = contin.VariationalProblem(
    lambda t, x, w, p: w.angle**2 / 2 + p.load * math.cos(x.angle), ["angle"], {"load": 5.0},
    integrals={"offset": lambda t, x, w, p: math.sin(x.angle)},
    symmetries={"mirror": lambda t, x: -x, "reverse": lambda t, x: -x[::-1]},
)  # fmt: skip


@pytest.fixture(scope="module")
def straight():
    return contin.trace(contin.solve(PINNED, [0.0]), free=["load"], limits={"load": (5, 42)})


@pytest.mark.parametrize("intervals", [4, 7, 11, 100, 333])
def test_modes_are_eigenfunctions_on_every_mesh(intervals):
    """At load 9 pi^2: cos 3 pi t, the third mode, vanishes; two others are negative."""
    system = contin.lowlevel.Collocation(
        PINNED, np.linspace(0, 1, intervals + 1), 4, ["load", "mu_offset"], {"load": 9 * math.pi**2}
    )
    x = system.pack(np.zeros((len(system.nodes), 2)), {"load": 9 * math.pi**2, "mu_offset": 0.0})
    found = second_variation(system, x)
    t = np.linspace(0, 1, 41)
    mode = found.modes(1, t)[0, :, 0]
    assert found.index(1) == 2
    np.testing.assert_allclose(mode * np.sign(mode[0]), np.cos(3 * math.pi * t), atol=3 * intervals**-5.0 + 1e-8)


def test_the_index_is_undecided_where_the_energy_has_no_value():
    """LAPACK raises an error for some matrices with NaN in them, on some machines."""
    rod = contin.VariationalProblem(
        lambda t, x, w, p: (w.curve**2 * x.angle**0.5 + p.load * x.angle) / 2, ["angle"], {"load": 1.0},
        ends=lambda a, b, p: (a.angle - 1, b.angle - 1), controls=["curve"], kinematics=lambda t, x, w, p: (w.curve,),
    )  # fmt: skip
    found = contin.solve(rod, lambda t: (1.0,))
    outside = found.system.pack(-np.ones((len(found.system.nodes), 2)), found.parameters)
    assert second_variation(found.system, found.x).index() == 0 and second_variation(found.system, outside) is None


def test_files_keep_what_a_point_says(straight, tmp_path):
    contin.save(straight, tmp_path / "branch.npz")
    again = contin.load(PINNED, tmp_path / "branch.npz")
    told = [[(p.index, p.nullity, p.index_change, p.breaks) for p in branch] for branch in (straight, again)]
    assert told[0] == told[1] and (1, 1, (1, 2), ("mirror", "reverse")) in told[1]


def test_broken_symmetries(straight):
    """Mode j is cos(j pi t): the half turn keeps odd ones, the mirror none."""
    assert [point.breaks for point in straight.labelled("BP")] == [("mirror",), ("mirror", "reverse")]
