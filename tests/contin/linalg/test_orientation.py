"""Orders, signs and bases do not depend on round-off: problems restated with a few units in the last place, and other kernels.

Reference: the same problem without noise. What is compared (signs, orders, labels) is exact; positions agree to 1e-6.
"""

import json
import os
import pathlib
import subprocess
import sys

import numpy as np
import pytest

import contin
from contin import AlgebraicProblem
from contin.equilibria.equations import critical_pair
from contin.linalg.orientation import canonical_basis, eigenbasis, first_least, ordered, oriented, oriented_along, pivot

SEEDS = range(12)
EPS = np.finfo(float).eps
#: Stated: coefficients that vanish but for round-off would give sizes to states that are zero at the first point.
SIZES = {"x": 1.0, "y": 1.0}


def rotated(seed):
    """Coordinates X = (x + y) / sqrt(2), Y = (x - y) / sqrt(2), and x, y of equations, with random units in the last place."""
    units = np.zeros(8) if seed is None else np.random.default_rng(seed).integers(-3, 4, 8)
    return tuple(map(float, np.sqrt(0.5) * (1 + EPS * units)))


def arms_of(seed, both):
    """A pitchfork of X (components equal but for round-off); with ``both``, of Y at the same place."""
    names = [f"c{i}" for i in range(8)]

    def residual(u, p):
        X, Y = p.c0 * u.x + p.c1 * u.y, p.c2 * u.x - p.c3 * u.y
        f, g = X * (p.a - X**2), Y * ((p.a if both else -1.0) - Y**2)
        return p.c4 * f + p.c5 * g, p.c6 * f - p.c7 * g

    problem = AlgebraicProblem(residual, ["x", "y"], {"a": -1.0, **dict(zip(names, rotated(seed)))})
    found = contin.diagram(contin.solve(problem, [0.0, 0.0]), free=["a"], depth=1, limits={"a": (-1, 1)}, scales=SIZES)
    junction = found.junctions[0].point
    ends = [branch.points[-1] for branch in found.branches]
    return found, np.array(junction.details.tangents), np.array(junction.details.kernel), np.array([end.x for end in ends])


@pytest.mark.full
@pytest.mark.parametrize("both", [False, True])
def test_arms_in_the_same_order(both):
    """A simple pitchfork, and a double one with four lines of arms (x, y and the diagonals)."""
    found, tangents, kernel, ends = arms_of(None, both)
    assert len(tangents) == (5 if both else 2) and tangents[1][0] > 0
    for seed in SEEDS:
        again = arms_of(seed, both)
        np.testing.assert_allclose(again[1], tangents, atol=1e-4)  # of a double point from a fit, with an error of 1e-5
        np.testing.assert_allclose(again[3], ends, atol=1e-6)
        if both:
            np.testing.assert_allclose(again[2], kernel, atol=1e-6)
        assert [str(branch.stop) for branch in again[0].branches] == [str(branch.stop) for branch in found.branches]


@pytest.mark.parametrize("unit", [1.0, 1e9])
def test_direction_at_a_fold(unit):
    """At a located fold the parameter stands still: the run leaves it to larger x, which is the rule; beside it, to larger a.

    The second unit makes the rate of ``a`` tiny everywhere, which is not standing still.
    """
    problem = AlgebraicProblem(lambda u, p: (p.a / p.unit - 1.0 + u.x**2,), ["x"], {"a": 0.0, "unit": unit})
    limits = {"a": (-unit, 2 * unit)}
    branch = contin.trace(contin.solve(problem, [-1.0]), free=["a"], limits=limits, scales={"x": 1.0})
    (fold,) = branch.labelled("LP")
    for direction in (1, -1):
        ahead = contin.trace(fold, free=["a"], limits=limits, direction=direction)
        assert direction * ahead.points[-1].x[0] > 0
    assert branch.points[-1].x[0] > 0 and branch.points[0].x[0] == pytest.approx(-1.0)


def test_from_a_branch_point_without_a_branch():
    """The matrix is singular there: the run takes the branch on which the point was found, to larger parameters."""
    problem = AlgebraicProblem(lambda u, p: (u.x * (p.a - u.x**2) / 3, -u.y / 7), ["x", "y"], {"a": -1.0})
    branch = contin.trace(contin.solve(problem, [0.0, 0.0]), free=["a"], direction=-1, limits={"a": (-2, 2)}, scales=SIZES)
    back = contin.trace(branch.points[-1], limits={"a": (-2, 2)})
    for direction in (1, -1):
        ahead = contin.trace(back.labelled("BP")[0], limits={"a": (-2, 2)}, direction=direction)
        assert ahead.points[-1]["a"] == pytest.approx(2 * direction) and abs(ahead.points[-1].x[0]) < 1e-9


def test_solutions_away_from_a_symmetric_guess():
    """Known solutions -1 and 1 are equally far from the guess 0: the search starts from the one given first."""
    problem = AlgebraicProblem(lambda u, p: (u.x - u.x**3 + 0.001 * u.x**5,), ["x"], {"a": 0.0})
    known = [contin.solve(problem, [side]) for side in (1.0, -1.0)]
    found = contin.solve(problem, [0.0], others=known)
    assert found.x[0] == pytest.approx(0.0, abs=1e-6)


def test_phase_of_a_critical_pair():
    """A rotation in symmetric coordinates: both components of the eigenvector are equally large."""
    random, phases = np.random.default_rng(1), []
    for _ in SEEDS:
        noise = EPS * random.integers(-3, 4, (2, 2))
        phases.append(critical_pair(np.array([[0.0, -1.0], [1.0, 0.0]]) * (1 + noise) + noise, 1.0).right)
    np.testing.assert_allclose(phases, np.tile(np.array([1, -1j]) / np.sqrt(2), (len(phases), 1)), atol=1e-12)


def test_bases_do_not_depend_on_their_rows():
    """Random rotations of a basis, and its signs: one canonical basis, of the space that a projector defines."""
    random = np.random.default_rng(2)
    weights = random.uniform(0.5, 2.0, 7)
    rows = random.standard_normal((3, 7))
    first = canonical_basis(rows, weights)
    np.testing.assert_allclose((first * weights) @ first.T, np.eye(3), atol=1e-13)
    np.testing.assert_allclose(np.linalg.lstsq(rows.T, first.T)[0].T @ rows, first, atol=1e-12)
    for _ in SEEDS:
        turn = np.linalg.qr(random.standard_normal((3, 3)))[0]
        np.testing.assert_allclose(canonical_basis(turn @ rows, weights), first, atol=1e-12)


def test_eigenvectors_of_a_ring():
    """The circulant matrix 2 cos: eigenvalues in pairs, whose vectors LAPACK turns by round-off."""
    n = 12
    ring = 2 * np.eye(n) - np.roll(np.eye(n), 1, axis=0) - np.roll(np.eye(n), -1, axis=0)
    first = None
    for seed in SEEDS:
        noise = EPS * np.random.default_rng(seed).integers(-3, 4, (n, n))
        values, vectors = np.linalg.eigh(ring + noise + noise.T)
        basis = eigenbasis(values, vectors.T)
        first = basis if first is None else first
        np.testing.assert_allclose(basis, first, atol=1e-12)
        np.testing.assert_allclose(ring @ basis.T, basis.T * values, atol=1e-13)


def test_the_rules():
    vector = np.array([0.0, 1.0, -1.0, 0.5])
    for noise in (1e-16, -1e-16, 1e-3, -1e-3):
        near = vector + np.array([0.0, 0.0, noise, 0.0])
        assert pivot(near) == 1 and oriented(-near)[1] > 0
        assert oriented_along(near, noise * 1e-5)[1] > 0
    assert oriented_along(vector, -0.5)[1] < 0  # a direction that is clear counts
    assert oriented(np.zeros(2)).tolist() == [0.0, 0.0]
    assert ordered([vector, -vector], [0.3, -0.9]) == [1, 0] and ordered([-vector, vector], [1e-9, 0.0]) == [1, 0]
    assert first_least([3.0, 1.0 + 1e-9, 1.0]) == 1


#: What a run of three problems finds, on one kernel: labels, values and tangents, without the digits that are round-off.
PROGRAM = """
import json, math, sys
import contin
from contin import AlgebraicProblem, BoundaryValueProblem
sys.path.insert(0, sys.argv[1])
from bank import units

def short(value):
    return round(float(value), 5) + 0.0

def told(branch, names):
    return [[point.label, point.name.split(",")[0], *(short(point[name]) for name in names)] for point in branch if point.label]

rod = BoundaryValueProblem(
    rhs=lambda t, u, p: (u.v, -p.load * math.sin(u.u)), boundary=lambda a, b, p: (a.v, b.v), states=["u", "v"],
    parameters={"load": 35.0}, functionals={"first": lambda t, u, p: u.u * math.cos(2 * math.pi * t)},
)
fork = contin.diagram(contin.solve(rod, [0, 0]), free=["load"], depth=1, limits={"load": (30, 45)})
found = {"fork": [told(branch, ["load", "first"]) for branch in fork.branches]}
found["arms"] = [
    [[short(number) for number in (tangent[0], tangent[-1])] for tangent in junction.point.details.tangents]
    for junction in fork.junctions
]
lorenz = units.restated("lrz", 0)
pitchfork = lorenz.origin().labelled("BP")[0]
arms = [lorenz.trace(pitchfork, branch=1, direction=way, limits={"rho": (-1, 30)}) for way in (1, -1)]
sizes = lorenz.units.factors
found["lorenz"] = [
    [[point.label, *(short(point[name] / sizes[name]) for name in ("rho", "X"))] for point in arm if point.label]
    for arm in arms
]
cusp = AlgebraicProblem(lambda u, p: (p.b + p.a * u.x - u.x**3,), ["x"], {"a": -1.0, "b": 0.0}, {"X": lambda u, p: u.x})
parts = contin.diagram(contin.solve(cusp, [0.0]), free=["a"], depth=1, limits={"a": (-1, 1)})
start = contin.solve(cusp, parts.branches[-1].points[-1])
fold = contin.trace(start, free=["b"], limits={"b": (-2, 2)}).labelled("LP")[0]
found["curve"] = [told(contin.curve(fold, "a", direction=way, limits={"a": (-1, 2)}), ["a", "b", "X"]) for way in (1, -1)]
print(json.dumps(found))
"""


def on_kernel(name):
    tests = pathlib.Path(__file__).parents[1]
    environment = {**os.environ, "OPENBLAS_CORETYPE": name}
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, str(tests)], env=environment, capture_output=True, text=True, check=False, timeout=300
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout.splitlines()[-1])


@pytest.mark.full
def test_two_kernels():
    """A pitchfork diagram with functions (buckling of a rod in its second mode), Lorenz's arms, a curve through a cusp."""
    flags = pathlib.Path("/proc/cpuinfo")
    if not (flags.exists() and " avx512f" in flags.read_text()):
        pytest.skip("the processor has no AVX-512: OpenBLAS's kernel SkylakeX does not run")
    one, other = (on_kernel(name) for name in ("SkylakeX", "Haswell"))
    assert one == other
    assert [arm[0][0] for arm in one["lorenz"]] == ["BP", "BP"] and one["lorenz"][0][-1][2] > 0
    assert one["fork"][2][-1][3] < 0 < one["fork"][3][-1][3]  # the slope is the largest: first the arm where it begins positive
