"""Index of equilibria: two methods with nothing but the quadratic form in common, the linear theory, and the energy itself.

Expected indices of branches come from a separate Fourier computation of the second variation (121 to 361 points), those of
circles from equation (25).
"""

import dataclasses
import functools

import numpy as np
import pytest
from conjugate_points import conjugate_index
from scipy.optimize import brentq

from contin import MeshControl, Settings, trace
from contin.lowlevel import correct, point_of
from ribbon_model import linear
from ribbon_model.domains import LOOP
from ribbon_model.equilibrium import LENGTH
from ribbon_model.laws import FINITE_WIDTH, FLAT_ROD, ISOTROPIC_ROD, PAPER_LAWS, RIBBON
from ribbon_model.second_variation import Symmetry, circle, coupling
from ribbon_model.seeds import half_loop_branch, primary_branch
from ribbon_model.solution import Solution
from ribbon_model.stability import index

NU = 0.3


def equilibrium(point):
    return Solution.of(point).equilibrium()


@functools.cache
def branch(m, n, law=RIBBON, lowest=-60.0):
    system, x, tangent = primary_branch(law, m, n, NU, 10, 7)
    return trace(point_of(system, x), Settings(trivial="M2", limits={"kappa_n": (lowest, 100)}, max_step=1.0), tangent=tangent)


@functools.cache
def secondary():
    """The branch with R != 0 that leaves (3, 1), on the half loop."""
    system, x, tangent = half_loop_branch(RIBBON, 3, 1, NU, 16, 6)
    primary = trace(point_of(system, x), Settings(trivial="M2", limits={"kappa_n": (-40, 100)}), tangent=tangent)
    leaves = primary.labelled("BP")[0]
    return leaves, trace(leaves, branch=1, limits={"kappa_n": (-60, 100)})


def between_ends(found):
    """The points that are neither bifurcations nor folds."""
    return [point for point in found.points if not point.label]


def test_circles_against_the_linear_theory():
    for law in PAPER_LAWS.values():
        for m in (1, 3, 5, 7):
            for kappa_n in (-3.7, -1.3, 0.2, 0.9, 2.2, 2.7, 3.3, 7.9, 15.3):
                if law is RIBBON and kappa_n >= m / NU:
                    continue
                found = index(circle(law, NU, m, kappa_n))
                assert found.decided
                assert found.index == linear.index(law, m, kappa_n, NU), (law.name, m, kappa_n)


@pytest.mark.full
@pytest.mark.parametrize("law", PAPER_LAWS.values(), ids=list(PAPER_LAWS))
def test_circles_by_conjugate_points(law):
    for m, kappa_n in ((1, 2.7), (1, 3.25), (3, -1.3), (3, 2.2), (3, -7.1)):
        found = conjugate_index(circle(law, NU, m, kappa_n))
        assert found.decided
        assert found.index == linear.index(law, m, kappa_n, NU), (m, kappa_n)


@pytest.mark.sample(3)
@pytest.mark.parametrize(
    ("m", "n", "expected"),
    [
        (1, 2, [0, 1]), (3, 4, [0, 1]), (5, 6, [1]), (7, 8, [1]), (3, 5, [2, 3]), (5, 7, [2, 3]), (1, 3, [2, 3, 2]),
        (3, 1, [2, 1]), (5, 1, [6, 5, 4, 5]), (5, 2, [4, 2]),
    ],
)  # fmt: skip
def test_the_index_along_branches(m, n, expected):
    """Every point but folds and ends is decided, and the index changes where, and as often as, it should."""
    found = [index(equilibrium(point)) for point in between_ends(branch(m, n))]
    assert all(result.decided for result in found)
    values = [result.index for result in found]
    assert [value for k, value in enumerate(values) if k == 0 or value != values[k - 1]] == expected


@pytest.mark.parametrize(("m", "n"), [(1, 2), (3, 4), (1, 3), (3, 5)])
def test_one_direction_changes_at_a_fold_and_keeps_the_symmetry(m, n):
    points = branch(m, n).points
    for at, fold in enumerate(points):
        if fold.label != "LP":
            continue
        found = index(equilibrium(fold))
        assert not found.decided and "cannot be distinguished from zero" in found.reason
        assert found.critical.name == (0, "even")
        assert abs(found.critical.eigenvalues[found.critical.nearest]) < 1e-9
        before, after = (index(equilibrium(points[k])) for k in (at - 1, at + 1))
        assert abs(before.index - after.index) == 1
        assert abs(before[0, "even"].negative - after[0, "even"].negative) == 1


@pytest.mark.full
@pytest.mark.parametrize(
    ("m", "n", "law"),
    [
        (1, 2, RIBBON),
        (3, 1, RIBBON),
        pytest.param(3, 5, RIBBON, marks=pytest.mark.full),
        pytest.param(5, 2, RIBBON, marks=pytest.mark.full),
    ]
    + [pytest.param(3, 1, law, marks=pytest.mark.full) for law in (FLAT_ROD, ISOTROPIC_ROD)],
    ids=lambda value: getattr(value, "name", value),
)
def test_both_methods_agree(m, n, law):
    points = between_ends(branch(m, n, law))
    for point in points[:: max(1, len(points) // 4)]:
        one, other = index(equilibrium(point)), conjugate_index(equilibrium(point))
        assert one.decided and other.decided
        assert one.index == other.index


@pytest.mark.full
def test_a_hard_state():
    """(1, 4) with max(eta^2) near 10, where the strip is curved on a small part of its length only."""
    found = [equilibrium(point) for point in between_ends(branch(1, 4))]
    strains = [at.response(at.directors(np.linspace(0, LENGTH, 401)) @ at.moment)[0] for at in found]
    steepest = [np.max((strain[:, 2] / strain[:, 0]) ** 2) for strain in strains]
    hardest = found[int(np.argmax(steepest))]
    assert max(steepest) > 9
    one, other = index(hardest), conjugate_index(hardest)
    assert one.decided and other.decided
    assert one.index == other.index == 5


@pytest.mark.full
def test_thresholds_of_circles_are_zeros():
    """Where (25b) of the paper has b = 0 the index of the circle changes, in the class of the wavenumber, to 1e-10."""
    cases = [(law, m, n, None) for law in PAPER_LAWS.values() for m in (1, 3, 5) for n in range(1, 9) if n != m]
    for law, m, n, Gamma in [*cases, (FINITE_WIDTH, 3, 2, 3.0), (FINITE_WIDTH, 3, 4, 3.0), (FINITE_WIDTH, 1, 2, 1.0)]:
        numbers = {"nu": NU, "Gamma": Gamma}
        for threshold in linear.thresholds(law, m, n, numbers):
            size = 1e-10 * (1 + abs(threshold))
            below, above = (index(circle(law, numbers, m, threshold + side * size)) for side in (-1, 1))
            changed = {entry.name for entry in below.classes if entry.negative != above[entry.name].negative}
            j = min(n % m, -n % m)
            assert changed == ({(j, "")} if 2 * j % m else {(j, "even"), (j, "odd")}), (law.name, m, n)


def crossing(law, m, n, name, low, high, intervals, degree):
    """kappa_n where the index of one class changes between two values, on a uniform mesh of the cell."""
    system, x, tangent = primary_branch(law, m, n, NU, intervals, degree)
    row = np.zeros(system.size)
    row[system.parameter_index("kappa_n")] = 1.0
    settings = Settings(trivial="M2", limits={"kappa_n": (low - 1, 100)}, zeros={"kappa_n": [high]}, mesh=MeshControl(every=0))
    (last,) = trace(point_of(system, x), dataclasses.replace(settings, errors=False), tangent=tangent).labelled("UZ")

    def determinant(kappa_n):
        x = correct(system, last.x, row, kappa_n).x
        return Solution.at(system, x).index()[name].determinant

    return brentq(determinant, low, high, xtol=1e-13)


def test_the_error_falls_with_the_mesh():
    """Like h^(2 d), as at the mesh points of the state: by 2^6 with halved intervals of degree 3. (3, 1) at -21.6268174874."""
    finest = crossing(RIBBON, 3, 1, (1, "even"), -21.8, -21.5, 20, 8)
    errors = [abs(crossing(RIBBON, 3, 1, (1, "even"), -21.8, -21.5, count, 3) - finest) for count in (20, 40, 80)]
    assert errors[-1] < 1e-8
    assert all(before / after == pytest.approx(2**6, rel=0.1) for before, after in zip(errors, errors[1:]))


def whole(at):
    """The same equilibrium, with its mesh on the whole loop and no symmetry known."""
    part = np.concatenate([at.mesh, 2 * at.mesh[-1] - at.mesh[-2::-1]])
    mesh = np.concatenate([part[:-1] + k * part[-1] for k in range(at.symmetry.order)] + [[LENGTH]])
    return dataclasses.replace(at, symmetry=Symmetry(), mesh=mesh, inside=None)


LONGER = pytest.param(3, 4, ISOTROPIC_ROD, marks=pytest.mark.full)


@pytest.mark.sample(1)
@pytest.mark.parametrize(("m", "n", "law"), [(1, 3, RIBBON), (5, 2, RIBBON), (7, 3, FLAT_ROD), LONGER])
def test_symmetry_classes_add_up_to_the_whole_loop(m, n, law):
    """The quarter wave in classes, and the whole loop as one piece, of which no symmetry is known."""
    for point in between_ends(branch(m, n, law))[2::9]:
        at = equilibrium(point)
        ours, theirs = index(at), index(whole(at))
        assert ours.decided and theirs.decided and ours.index == theirs.index


def test_circles_without_their_symmetry():
    for law in PAPER_LAWS.values():
        for m, kappa_n in ((1, 2.7), (3, -1.3), (5, 2.2)):
            assert index(whole(circle(law, NU, m, kappa_n))).index == linear.index(law, m, kappa_n, NU)


def test_the_shift_of_phase_is_a_null_vector():
    """Q of it is the error of eigenvalues: as small as the state's mesh allows, 1e-12, and smaller on a finer one."""
    points = between_ends(branch(1, 2))
    assert len(points) > 20
    for point in points[5::9]:
        coarse = index(equilibrium(point)).residual
        system, carry = point.system.refined()
        tangent = carry(point.tangent)
        x = correct(system, carry(point.x), tangent, tangent @ carry(point.x)).x
        fine = Solution.at(system, x).index().residual
        assert coarse < 1e-7 and fine < max(coarse / 100, 1e-11)


def test_a_change_of_index_is_located():
    """(3, 1) loses one negative direction where the half loop has a branch point, of the class that keeps its mirror."""
    points = between_ends(branch(3, 1))
    below, above = (next(p for p in points if p["kappa_n"] < limit) for limit in (-22, -15))
    system = above.system
    row = np.zeros(system.size)
    row[system.parameter_index("kappa_n")] = 1.0

    def state(kappa_n):
        share = (kappa_n - above["kappa_n"]) / (below["kappa_n"] - above["kappa_n"])
        x = correct(system, above.x + share * (below.x - above.x), row, kappa_n).x
        return Solution.at(system, x).equilibrium()

    (name,) = [c.name for c in index(equilibrium(above)).classes if c.negative != index(equilibrium(below))[c.name].negative]
    assert name == (1, "even")
    place = brentq(lambda kappa_n: index(state(kappa_n))[name].determinant, below["kappa_n"], above["kappa_n"], xtol=1e-12)
    leaves, _ = secondary()
    assert place == pytest.approx(leaves["kappa_n"], abs=1e-9)


@pytest.mark.full
def test_two_directions_change_at_once():
    """On (5, 2) they are a pair: a class that comes twice."""
    results = [index(equilibrium(point)) for point in between_ends(branch(5, 2))]
    before, after = next(pair for pair in zip(results, results[1:]) if pair[0].index != pair[1].index)
    (changed,) = [entry for entry in before.classes if entry.negative != after[entry.name].negative]
    assert changed.multiplicity == 2 and changed.negative - after[changed.name].negative == 1


@pytest.mark.full
def test_with_a_force():
    """The secondary branch: index 2 on both sides of its start, where (3, 1) has 2 and 1; both methods."""
    _, found = secondary()
    points = between_ends(found)
    forces = [np.linalg.norm([point[name] for name in ("R1", "R2", "R3")]) for point in points]
    assert max(forces) > 1
    for point in points[:: max(1, len(points) // 5)]:
        one, other = index(equilibrium(point)), conjugate_index(equilibrium(point))
        assert one.decided and other.decided
        assert one.index == other.index == 2


def test_domains_agree():
    """The same state as a cell, and as a whole loop of which no symmetry is known."""
    point = between_ends(branch(1, 2))[15]
    part = index(equilibrium(point))
    system, x = Solution.of(point).on(LOOP).discretized()
    loop = Solution.at(system, x).index()
    assert loop.decided and loop.index == part.index


def rotated(directors, vector):
    """Directors (K, 3, 3), rows d_i, turned by the rotation vectors (K, 3)."""
    angle = np.linalg.norm(vector, axis=1)[:, None, None]
    axis = vector[:, None] / np.maximum(angle, 1e-300)
    along = np.sum(axis * directors, axis=2, keepdims=True) * axis
    return np.cos(angle) * directors + np.sin(angle) * np.cross(axis, directors) + (1 - np.cos(angle)) * along


def test_the_form_is_the_second_derivative_of_the_energy():
    """int U(omega) + M_2 omega_2 - R . d3 along an admissible rotation, by differences, where R != 0.

    U as printed in (7); M_2 and R are the multipliers of omega_2 = 0 and of closure.
    """
    point = between_ends(secondary()[1])[8]
    at = equilibrium(point)
    count = 512
    S = LENGTH / count * np.arange(count)
    wave = np.fft.fftfreq(count, 1 / count)

    def slope(f):
        return np.fft.ifft(1j * wave.reshape(-1, *[1] * (f.ndim - 1)) * np.fft.fft(f, axis=0), axis=0).real

    def primitive(f):
        series = np.fft.fft(f, axis=0)
        series[0] = 0
        return np.fft.ifft(series / np.where(wave == 0, 1, 1j * wave).reshape(-1, *[1] * (f.ndim - 1)), axis=0).real

    d = at.directors(S)
    x = primitive(d[:, 2])
    momentum = at.moment + np.cross(x[0], at.force)
    moment = np.einsum("kij,kj->ki", d, momentum - np.cross(x, at.force))
    _, compliance = at.response(moment)
    factor = np.linalg.cholesky(compliance[:, [0, 2]][:, :, [0, 2]])
    waves = np.concatenate([[np.ones(count)], *[[np.cos(k * S), np.sin(k * S)] for k in range(1, 6)]])
    trials = np.concatenate([np.stack([waves, 0 * waves], -1), np.stack([0 * waves, waves], -1)])  # v, shape (22, count, 2)
    u = np.einsum("kai,kab,tkb->tki", d[:, [0, 2]], factor, trials)
    rate = np.concatenate([u, np.cross(u, x)], axis=2)
    admissible = np.linalg.svd(rate.mean(axis=1).T)[2][6:]  # means of u and of u x x vanish

    def energy(directors):
        turned = slope(directors)
        w1, w2, w3 = (np.sum(turned[:, i] * directors[:, j], axis=1) for i, j in ((1, 2), (2, 0), (0, 1)))
        eta = w3 / w1
        density = (w1**2 * (1 + eta**2) ** 2 - 2 * at.kappa_n * w1 * (1 + at.parameters["nu"] * eta**2)) / 2
        return np.mean(density + moment[:, 1] * w2 - directors[:, 2] @ at.force) * LENGTH

    random = np.random.default_rng(3)
    for _ in range(3):
        v = random.standard_normal(len(admissible)) @ admissible
        E_rate = np.einsum("t,tki->ki", v, rate)
        E = primitive(E_rate)
        form = np.einsum("t,tkb->kb", v, trials)
        form = LENGTH * np.mean(np.sum(form**2, axis=1) + np.sum(E @ coupling(momentum, at.force) * E_rate, axis=1))
        h = 3e-3 / np.abs(E[:, :3]).max()
        values = [energy(rotated(d, k * h * E[:, :3])) for k in (-2, -1, 0, 1, 2)]
        assert abs(values[0] - 8 * values[1] + 8 * values[3] - values[4]) / (12 * h) < 1e-6 * abs(form)  # an equilibrium
        second = np.dot([-1, 16, -30, 16, -1], values) / (12 * h * h)
        assert form == pytest.approx(second, rel=1e-5)


def test_what_has_no_index():
    with pytest.raises(ValueError, match="no 1-covered circle"):
        circle(RIBBON, NU, 1, 5.9)
    point = between_ends(branch(1, 2))[10]
    solution = Solution.of(point)
    shorter = dataclasses.replace(solution, parameters={**solution.parameters, "length": 0.9 * solution.parameters["length"]})
    with pytest.raises(ValueError, match="does not close"):
        shorter.equilibrium()
    bifurcation = index(circle(RIBBON, NU, 1, 2.5))
    assert not bifurcation.decided and "class 0" in bifurcation.reason
