"""Scenes of open strips against shooting: Kirchhoff's equations for directors, written here anew, integrated by DOP853.

States: start values of force and moment are solved for, so that the conditions at the last end hold; they agree with the
reactions of the file. Special points: there the derivative of these conditions by the start values is singular.
"""

import math
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from scipy.optimize import brentq, root

from branches.config import load
from branches.display import Display
from branches.open_job import run_stages
from branches.read import read_branch

CONFIGS = Path(__file__).resolve().parents[2] / "configs"


def strains_of_rod(compliances, natural):
    return lambda s, M, p: natural(s, p) + compliances(p) * M


FLAT_ROD = strains_of_rod(
    lambda p: np.array([1.0, p["softness"], (1 + p["nu"]) / 2]), lambda s, p: np.array([p["kappa_n"], 0.0, p["tau_n"]])
)
GENERAL_ROD = strains_of_rod(lambda p: np.array([1 / p["B1"], 1 / p["B2"], 1 / p["C"]]), lambda s, p: np.zeros(3))


def ribbon(s, M, p):
    """M1 = dU/dw1, M3 = dU/dw3 for U = c**2/2 - kappa_n w1 (1 + nu eta**2), c = w1 (1 + eta**2), solved for eta."""
    k = p["kappa_n"] + p["variation"] * math.cos(4 * math.pi * s)
    # M3 = 2 eta a, M1 = (1 - eta**2) a - (1 - nu) k, a = c - nu k: eta from their ratio
    m1, m3 = M[0] + (1 - p["nu"]) * k, M[2]
    eta = math.tan(math.atan2(m3, m1) / 2)
    a = m1 * math.cos(math.atan2(m3, m1)) + m3 * math.sin(math.atan2(m3, m1))
    a = a / (1 + eta * eta) if abs(eta) < 1e-9 else m3 / (2 * eta)
    w1 = (a + p["nu"] * k) / (1 + eta * eta)
    return np.array([w1, 0.0, eta * w1])


def finite_width(s, M, p):
    """The minimum of U(w) - M.w by Newton's method, with the energy of Audoly & Neukirch (2021) written out."""
    nu, width = p["nu"], p["Gamma"]
    C = 3 * (1 - nu**2) * width**2

    def g(w1):  # (1 - G)/z by the power series of cosh x - cos x and sinh x + sin x, whose terms are positive
        z = C * w1 * w1
        assert abs(z) < 100  # then eleven terms are enough
        above = sum(z ** (k - 1) * 2 / math.factorial(4 * k + 1) * (1 - 2 / (4 * k + 2)) for k in range(1, 12))
        return above / sum(z**k * 2 / math.factorial(4 * k + 1) for k in range(12))

    def energy(w1, w3):
        Q = w3**2 + nu * w1**2
        return (1 - nu**2) * w1**2 / 2 + (1 - nu) * w3**2 + C * g(w1) * Q**2 / 2

    def slopes(w):
        return np.array([energy(w[0] + 1e-30j, w[1]).imag, energy(w[0], w[1] + 1e-30j).imag]) / 1e-30 - M[[0, 2]]

    w = np.array([M[0] / (1 - nu**2), M[2] / (2 * (1 - nu))])
    for _ in range(30):
        value = slopes(w)
        step = 1e-6
        matrix = np.array([(slopes(w + d) - slopes(w - d)) / (2 * step) for d in step * np.eye(2)]).T
        change = np.linalg.solve(matrix, -value)
        w = w + change
        if np.abs(change).max() < 1e-13:
            break
    return np.array([w[0], 0.0, w[1]])


def shot(law, p, start, weight):
    """The last place, directors (3, 3), force and moment, from force and moment at the start; directors begin as the axes."""

    def rates(s, y):
        d, n, M = y[3:12].reshape(3, 3), y[12:15], y[15:18]
        w = law(s, d @ M, p) @ d
        return np.concatenate([d[2], np.cross(w, d).ravel(), -weight, -np.cross(d[2], n)])

    y0 = np.concatenate([np.zeros(3), np.eye(3).ravel(), start])
    y = solve_ivp(rates, (0, 1), y0, "DOP853", rtol=1e-12, atol=1e-12).y[:, -1]
    return y[:3], y[3:12].reshape(3, 3), y[12:15], y[15:18]


def prescribed_frame(p):
    """Directors as rows: turned about tangent, width and normal of the first end, the last one first."""

    def turn(axis, angle):
        a, b = [(1, 2), (2, 0), (0, 1)][axis]
        matrix = np.eye(3)
        matrix[a, a] = matrix[b, b] = math.cos(angle)
        matrix[a, b], matrix[b, a] = -math.sin(angle), math.sin(angle)
        return matrix

    return (turn(2, p["turn"]) @ turn(0, p["bend"]) @ turn(1, p["swing"])).T


def clamped(p, stroke=np.zeros(3)):
    """Conditions of a clamp: place, and three products of directors with prescribed ones."""
    place, frame = np.array([p["shear"], p["rise"], p["distance"]]) + p.get("stroke", 0) * stroke, prescribed_frame(p)

    def conditions(x, d, n, M):
        c = d @ frame.T
        return np.concatenate([x - place, [c[1, 2] - c[2, 1], c[2, 0] - c[0, 2], c[0, 1] - c[1, 0]]])

    return conditions


def sliding(p):
    conditions = clamped({**p, "distance": 0.0, "shear": p["shear"], "rise": p["rise"]})
    return lambda x, d, n, M: np.append(np.delete(conditions(x, d, n, M), 2), n[2] - p["force_tangent"])


def free(p):
    force = np.array([p.get("force_width", 0.0), 0.0, 0.0])
    return lambda x, d, n, M: np.concatenate([n - force, M])


OPEN = np.array([0, -0.5, -0.5]) * math.sqrt(2)
#: Law, conditions at the last end, and the special points that are checked.
SCENES = {
    "open_clamped": (FLAT_ROD, clamped), "open_shear": (FLAT_ROD, clamped), "open_arc": (FLAT_ROD, lambda p: clamped(p, OPEN)),
    "open_weight": (finite_width, free), "open_tension": (finite_width, sliding), "open_tip": (FLAT_ROD, free),
    "moebius": (FLAT_ROD, clamped), "ring_twisted": (GENERAL_ROD, clamped), "imperfect": (ribbon, clamped),
}  # fmt: skip


@pytest.fixture(scope="module", params=SCENES)
def scene(request, tmp_path_factory):
    path = tmp_path_factory.mktemp("scene") / f"{request.param}.h5"
    config = load(CONFIGS / f"{request.param}.yaml")
    assert run_stages(config, path, Display(silent=True)) == "complete"
    return request.param, read_branch(path)


def numbers(branch, row):
    return {name: float(branch.points[row][name]) for name in branch.points.dtype.names if branch.points.dtype[name] == "f8"}


def weight_of(branch, p):
    return p.get("weight", 0.0) * np.array(branch.scene.strip().weight_direction)


def start_of(p):
    """Force and moment inside the strip at its start: the reactions there, with the other sign."""
    return -np.array([p[f"start_{what}_{axis}"] for what in "FM" for axis in ("width", "normal", "tangent")])


def residual(name, branch, p):
    law, ends = SCENES[name]
    return lambda start: ends(p)(*shot(law, p, start, weight_of(branch, p)))


def slopes(function, start):
    """The derivative by central differences."""
    step = 1e-6 * (1 + np.abs(start).max())
    return np.array([(function(start + d) - function(start - d)) / (2 * step) for d in step * np.eye(len(start))]).T


@pytest.mark.full
def test_states_against_shooting(scene):
    """The conditions hold to 1e-8 for the file's own start values, at the last point of each stage: measured 1e-9 at most."""
    name, branch = scene
    for stage in np.unique(branch.points["stage"]):
        row = int(np.flatnonzero(branch.points["stage"] == stage)[-1])
        p = numbers(branch, row)
        start = start_of(p)
        function = residual(name, branch, p)
        assert np.abs(function(start)).max() < 1e-8 * (1 + np.abs(start).max())


#: Special points that are checked: number followed, stage, which one. A fold takes a minute by shooting.
POINTS = {
    "open_clamped": ("turn", 2, 0), "open_shear": ("shear", 2, 0), "open_arc": ("bend", 4, 0), "open_weight": ("weight", 1, 0),
    "open_tip": ("force_width", 1, 0),
}  # fmt: skip
#: Half the distance at which the determinant is evaluated, relative to 1 + the value: the secant's error is about its square.
BESIDE = 1e-4


def special_point(branch, column, stage, number):
    found = [e for e in branch.events if e["label"] in (b"LP", b"BP") and e["stage"] == stage and e["name"] != b"start"]
    return found[number], numbers(branch, int(found[number]["point"]))


@pytest.mark.full
def test_branch_points_against_shooting(scene):
    """The determinant of the slopes of the conditions vanishes there: to 1e-7, measured 1e-8 at most."""
    name, branch = scene
    if name not in POINTS:
        pytest.skip("a kernel of dimension 2, a fold, or no special point")
    column, stage, number = POINTS[name]
    _, p = special_point(branch, column, stage, number)
    at = p[column]
    rows = np.flatnonzero(branch.points["stage"] == stage)
    rows = rows[np.argsort(branch.points[column][rows])]
    starts = np.array([start_of(numbers(branch, row)) for row in rows])

    def determinant(value):
        function = residual(name, branch, {**p, column: value})
        near = np.array([np.interp(value, branch.points[column][rows], component) for component in starts.T])
        state = near if np.abs(function(near)).max() < 1e-11 else root(function, near, tol=1e-13).x
        return np.linalg.det(slopes(function, state))

    half = BESIDE * (1 + abs(at))
    low, high = determinant(at - half), determinant(at + half)
    zero = at - half + 2 * half * low / (low - high)
    assert low * high < 0
    assert math.isclose(zero, at, abs_tol=1e-7 * (1 + abs(at)))


@pytest.mark.full
def test_the_twist_threshold_under_tension(scene):
    """A straight strip with twist w under tension T, perturbed: eight linear equations with constant coefficients.

    On the directors, with U_11 and M3 = U_3 of the energy at (0, w): U_11 a' = w m2 + n2, m2' = (M3 - w U_11) a - n1,
    n1' = w n2, n2' = T a - w n1, and for rotation and place psi1' = w psi2 + a, psi2' = -w psi1, x1' = w x2 + psi2,
    x2' = -w x1 - psi1; psi and x vanish at both ends.
    """
    name, branch = scene
    if name != "open_tension":
        pytest.skip("another scene")
    p = numbers(branch, 0)
    nu, C = p["nu"], 3 * (1 - p["nu"] ** 2) * p["Gamma"] ** 2

    def determinant(w):
        U11 = 1 - nu**2 + 2 * nu * C * w**2 / 180 - C**2 * w**4 / 22680  # g(z) = 1/180 - z/22680 + ...
        M3 = 2 * (1 - nu) * w + 2 * C * w**3 / 180
        matrix = np.zeros((8, 8))
        matrix[0, [1, 3]], matrix[1, [0, 2]] = (w / U11, 1 / U11), (M3 - w * U11, -1)
        matrix[2, 3], matrix[3, [0, 2]] = w, (p["force_tangent"], -w)
        matrix[4, [0, 5]], matrix[5, 4] = (1, w), -w
        matrix[6, [5, 7]], matrix[7, [4, 6]] = (1, w), (-1, -w)
        return np.linalg.det(expm(matrix)[4:, :4])

    for event in branch.events[branch.events["label"] == b"BP"][:3]:
        at = float(event["turn"])
        assert math.isclose(brentq(determinant, at - 0.01, at + 0.01, xtol=1e-13), at, abs_tol=1e-8)


@pytest.mark.full
def test_the_snap_of_the_clamped_strip(scene):
    """At the fold the stable branch ends; it snaps to the one that was left, whose energy at this turn is interpolated."""
    name, branch = scene
    if name != "open_clamped":
        pytest.skip("another scene")
    (snap,) = branch.snaps()
    fold, _ = special_point(branch, "turn", 3, 0)
    assert snap.row == fold["point"] and fold["index_before"] == 0 and fold["index_after"] == 1
    before = branch.points[branch.points["stage"] == 2]
    nearest = before[np.argmin(abs(before["turn"] - fold["turn"]))]
    # dE/dturn is the moment, so the nearest point gives the energy up to the square of the distance
    below = nearest["energy"] + nearest["M_tangent"] * (fold["turn"] - nearest["turn"])
    assert snap.released == pytest.approx(fold["energy"] - below, rel=1e-3)
    assert snap.to["M_tangent"] == pytest.approx(nearest["M_tangent"], abs=0.3)


@pytest.mark.full
def test_the_fold_of_the_imperfect_loop_against_shooting(scene):
    """The state and the determinant of the slopes vanish together: to 1e-7."""
    name, branch = scene
    if name != "imperfect":
        pytest.skip("another scene")
    _, p = special_point(branch, "kappa_n", 1, 0)

    def fold(unknown):
        function = residual(name, branch, {**p, "kappa_n": unknown[-1]})
        return np.append(function(unknown[:-1]), 1e-3 * np.linalg.det(slopes(function, unknown[:-1])))

    found = root(fold, np.append(start_of(p), p["kappa_n"] + 1e-5), tol=1e-12).x[-1]
    assert math.isclose(found, p["kappa_n"], abs_tol=1e-7 * (1 + p["kappa_n"]))
