"""Scenes of open strips against shooting, which shares no code with them: forces, moments, energies, and special points.

From the first clamp on, Kirchhoff's equations are integrated by DOP853 (relative tolerance 1e-12), in lab components:

    r' = d3,   d_i' = w x d_i,   n' = -weight,   m' = n x d3,   energy' = U(w) - weight.r,

with the strains w of a moment m written by hand for each law. Unknown are force n and moment m at the clamp. They are found by
Newton's method from the conditions F at the last end, starting beside the values of the file. Derivatives by them and by the
number that is followed are exact: a complex step, integrated together with the state.

A special point is where the matrix of these derivatives is singular. Bordered by vectors b and c, it gives a number g that is
zero there: [A b; c 0] [v; g] = [0; 1]. A fold is F = g = 0; a branch point is F + mu b = 0, g = 0, w.F_lambda = 0 with w from
the transposed matrix (Moore 1980; Govaerts 2000, ch. 8), which is regular where both branches cross.

Run as a program, this file prints the table of docs/open-strips-reference.md.
"""

import math
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from scipy.optimize import brentq

from branches.read import read_branch
from branches.run.display import Display
from branches.run.runner import run_scene
from branches.scene.parse import load

CONFIGS = Path(__file__).resolve().parents[2] / "configs"
#: The complex step: its square vanishes beside 1.
STEP = 1e-30
#: A slope of the conditions by the start values below this counts as this, where changes of these values are chosen.
LEAST_SLOPE = 1e-2
AXES = ("width", "normal", "tangent")


# --- laws: strains and energy density from the moment on the directors (3, K) ----------------------------------------------


def flat_rod(s, M, p, near):
    w = np.array([p["kappa_n"] + M[0], p["softness"] * M[1], p["tau_n"] + (1 + p["nu"]) / 2 * M[2]])
    return w, M[0] ** 2 / 2 + p["softness"] * M[1] ** 2 / 2 + (1 + p["nu"]) / 4 * M[2] ** 2


def rod(s, M, p, near):
    w = np.array([M[0] / p["B1"], M[1] / p["B2"], M[2] / p["C"]])
    return w, (M * w).sum(axis=0) / 2


def ribbon(s, M, p, near):
    """U = c**2/2 - k (w1 + nu w3**2/w1) + k**2/2 with c = w1 + w3**2/w1 (Audoly & Seffen 2015, equation 7)."""
    nu, k = p["nu"], p["kappa_n"] + p["variation"] * math.cos(4 * math.pi * s)

    def energy(a, b):
        c, slope, bend = a + b * b / a, (1 - (b / a) ** 2, 2 * b / a), (2 * b * b / a**3, -2 * b / a**2, 2 / a)
        U = c * c / 2 - k * (a + nu * b * b / a) + k * k / 2
        first = c * slope[0] - k * (1 - nu * (b / a) ** 2), c * slope[1] - k * nu * slope[1]
        squares = slope[0] ** 2, slope[0] * slope[1], slope[1] ** 2
        return U, first, [square + (c - k * nu) * second for square, second in zip(squares, bend)]

    return least(energy, M, near if near[0] > 0 else [float(np.real(np.max(k))), 0, 0])


#: Numerator and denominator of g(z) = (1 - G)/z, highest power first: from the series of cosh x - cos x and sinh x + sin x.
ABOVE = np.array([2 / math.factorial(4 * k + 1) * (1 - 2 / (4 * k + 2)) for k in range(12, 0, -1)])
BELOW = np.array([2 / math.factorial(4 * k + 1) for k in range(11, -1, -1)])
#: And their first and second derivatives.
SERIES = [[np.polyder(f, i) for i in range(3)] for f in (ABOVE, BELOW)]


def finite_width(s, M, p, near):
    """U = (1 - nu**2) w1**2/2 + (1 - nu) w3**2 + C g(C w1**2) Q**2/2, Q = w3**2 + nu w1**2 (Audoly & Neukirch 2021)."""
    nu, C = p["nu"], 3 * (1 - p["nu"] ** 2) * p["Gamma"] ** 2

    def energy(a, b):
        z, Q = C * a * a, b * b + nu * a * a
        assert np.abs(z).max() < 100  # then twelve terms of the series are enough
        (N, N1, N2), (D, D1, D2) = ([np.polyval(f, z) for f in group] for group in SERIES)
        g = N / D
        g1 = (N1 - g * D1) / D
        g2 = (N2 - 2 * g1 * D1 - g * D2) / D
        U = (1 - nu**2) * a * a / 2 + (1 - nu) * b * b + C * g * Q * Q / 2
        first = (1 - nu**2) * a + C * a * (C * g1 * Q * Q + 2 * nu * g * Q), 2 * (1 - nu) * b + 2 * C * b * g * Q
        mixed = C * a * b * (4 * C * g1 * Q + 4 * nu * g)
        bending = C * Q * Q * (g1 + 2 * z * g2) + 8 * nu * z * g1 * Q + 4 * nu**2 * a * a * g + 2 * nu * g * Q
        return U, first, (1 - nu**2 + C * bending, mixed, 2 * (1 - nu) + 2 * C * g * (Q + 2 * b * b))

    return least(energy, M, near)


def least(energy, M, near):
    """The strains at which U - M.w is least, by Newton's method from the strains at the place before, and U there."""
    w, settled = np.array([near[0] + 0 * M[0], near[2] + 0 * M[0]]), 0
    for _ in range(100):
        _, first, (H11, H13, H33) = energy(*w)
        G1, G3 = first[0] - M[0], first[1] - M[2]
        change = np.array([H33 * G1 - H13 * G3, H11 * G3 - H13 * G1]) / (H11 * H33 - H13**2)
        size, part = np.abs(w.real).max(), np.abs(change.real).max()
        w = w - change * min(1, 0.5 * (1 + size) / (part + 1e-300))
        settled += bool(part < 1e-9 * (1 + size))
        if settled == 2:  # one for the real part, one for the imaginary one
            return np.array([w[0], 0 * w[0], w[1]]), energy(*w)[0]
    raise ArithmeticError("no strains for this moment")


# --- what is held at the last end: what vanishes there, from place (3, K), directors (3, 3, K), force and moment (3, K) ------


def prescribed_frame(p):
    """Directors as rows: turned about tangent, width and normal of the first end, the last one first."""

    def turn(axis, angle):
        a, b = [(1, 2), (2, 0), (0, 1)][axis]
        matrix = [[float(i == j) + 0 * angle for j in range(3)] for i in range(3)]
        matrix[a][a] = matrix[b][b] = np.cos(angle)
        matrix[a][b], matrix[b][a] = -np.sin(angle), np.sin(angle)
        return np.array(np.broadcast_arrays(*sum(matrix, []))).reshape(3, 3, -1)

    def times(a, b):
        return np.einsum("ijk,jlk->ilk", *np.broadcast_arrays(a, b))

    angles = [np.atleast_1d(p[name]) for name in ("turn", "bend", "swing")]
    return times(turn(2, angles[0]), times(turn(0, angles[1]), turn(1, angles[2]))).swapaxes(0, 1)


def clamped(r, d, n, m, p):
    """Place, and three products of directors with prescribed ones."""
    frame = prescribed_frame(p)
    along = np.array([0, -0.5, -0.5]) * math.sqrt(2)  # of the stroke of open_arc
    place = [r[i] - p[name] - p.get("stroke", 0) * along[i] for i, name in enumerate(("shear", "rise", "distance"))]
    return [*place, *((d[i] * frame[j]).sum(axis=0) - (d[j] * frame[i]).sum(axis=0) for i, j in ((1, 2), (2, 0), (0, 1)))]


def sliding(r, d, n, m, p):
    conditions = clamped(r, d, n, m, {**p, "distance": 0.0})
    return [*conditions[:2], n[2] - p["force_tangent"], *conditions[3:]]


def free(r, d, n, m, p):
    return [n[0] - p.get("force_width", 0), n[1], n[2], *m]


#: Integrands of the conditions that fix the place along a closed strip, and the angle about its tangent.
PHASES = {
    "spin": lambda s, r: r[0], "shift, right": lambda s, r: r[0] + 3 * r[1] * math.sin(2 * math.pi * s),
    "shift, two waves": lambda s, r: r[0] * math.sin(4 * math.pi * s),
}  # fmt: skip
#: Law and conditions at the last end of each scene.
SCENES = {
    "open_clamped": (flat_rod, clamped), "open_shear": (flat_rod, clamped), "open_arc": (flat_rod, clamped),
    "open_weight": (finite_width, free), "open_tension": (finite_width, sliding), "open_tip": (flat_rod, free),
    "moebius": (flat_rod, clamped), "ring_twisted": (rod, clamped), "imperfect": (ribbon, clamped),
}  # fmt: skip


# --- shooting ----------------------------------------------------------------------------------------------------------------


@dataclass
class Shooting:
    """The conditions F of a scene as a function of z = (force and moment at the clamp, a multiplier for each phase).

    Multipliers enter with fixed random columns: they make the equations square, and vanish on a solution.
    """

    name: str
    numbers: dict
    followed: str
    weight: np.ndarray
    phases: tuple

    def __post_init__(self):
        self.law, self.ends = SCENES[self.name]
        self.near = np.zeros(3)
        self.columns = np.random.default_rng(1).standard_normal((6, len(self.phases)))

    @property
    def size(self):
        return 6 + len(self.phases)

    def at(self, z, value):
        """F, its derivatives by z and by the number, and the energy."""
        start = np.repeat(np.append(z[:6], value)[:, None], 8, axis=1) + 1j * STEP * np.eye(7, 8)  # the last is left as it is
        p = {**self.numbers, self.followed: start[6]}
        weight, count = np.multiply.outer(self.weight, p.get("weight", 0.0) * np.ones(8)), 19 + len(self.phases)

        def rates(s, y):
            y = joined(y)
            r, d, n, m = y[:3], y[3:12].reshape(3, 3, 8), y[12:15], y[15:18]
            w, U = self.law(s, np.einsum("ijk,jk->ik", d, m), p, self.near)
            self.near = w[:, 7].real
            spin = np.einsum("ik,ijk->jk", w, d)
            turning = [cross(spin, director) for director in d]
            density = U - (weight * r).sum(axis=0)
            along = [PHASES[name](s, r) for name in self.phases]
            return apart(np.concatenate([d[2], *turning, -weight, cross(n, d[2]), [density, *along]]))

        y0 = np.zeros((count, 8), dtype=complex)
        y0[[3, 7, 11]], y0[12:18] = 1.0, start[:6]
        y = joined(solve_ivp(rates, (0, 1), apart(y0), "DOP853", rtol=1e-12, atol=1e-12).y[:, -1])
        ends = self.ends(y[:3], y[3:12].reshape(3, 3, 8), y[12:15], y[15:18], p)
        F = np.array([row + np.zeros(8) for row in [*ends, *y[19:]]])
        values, slopes = F[:, 7].real.copy(), F.imag / STEP
        values[:6] += self.columns @ z[6:]
        matrix = np.zeros((self.size, self.size))
        matrix[:, :6], matrix[:6, 6:] = slopes[:, :6], self.columns
        return values, matrix, slopes[:, 6], float(y[18, 7].real)

    def state(self, z, value):
        """The solution and its energy, by Newton's method from beside z, where F is about 1e-3."""
        z = z + self.scaled(z, value)[0] @ beside(self.size, 1e-3)
        for _ in range(30):
            F, matrix, _, energy = self.at(z, value)
            change = np.linalg.solve(matrix, F)
            z = z - change
            if np.abs(change).max() < 1e-10 * (1 + np.abs(z).max()):
                return z, self.at(z, value)[3]
        raise ArithmeticError(f"{self.name}: shooting does not converge")

    def scaled(self, z, value):
        """A matrix whose columns are changes of z that change F by about 1, and the vectors b and c."""
        left, singular, right = np.linalg.svd(self.at(z, value)[1])
        return right.T / np.maximum(singular, LEAST_SLOPE), left[:, -1], right[-1]

    def special(self, z, value, label):
        """The special point, searched beside (z, value): the number there."""
        scale, b, c = self.scaled(z, value)

        def equations(unknown):
            F, matrix, slope, _ = self.at(z + scale @ unknown[: self.size], value + unknown[self.size])
            bordered = np.block([[matrix, b[:, None]], [c, 0]])
            one = np.append(np.zeros(self.size), 1)
            g = np.linalg.solve(bordered, one)[-1]
            if label == "LP":
                return np.append(F, g)
            w = np.linalg.solve(bordered.T, one)[:-1]
            return np.concatenate([F + unknown[-1] * b, [g, w @ slope]])

        unknown = np.append(beside(self.size, 1e-4), [1e-4] if label == "LP" else [1e-4, 0.0])
        F = equations(unknown)
        slopes = np.array([equations(unknown + d) - F for d in 1e-5 * np.eye(len(unknown))]).T / 1e-5
        for _ in range(20):  # with the slopes of the start: a step leaves about 1e-3 of the distance
            change = np.linalg.solve(slopes, F)
            unknown = unknown - change
            F = equations(unknown)
            if np.abs(change).max() < 1e-9:
                return value + unknown[self.size]
        raise ArithmeticError(f"{self.name}: shooting finds no {label} at {self.followed} = {value}")


def beside(size, distance):
    """Random numbers up to this size, the same in every run."""
    return distance * np.random.default_rng(2).uniform(-1, 1, size)


def apart(y):
    """Values and derivatives as one vector of real numbers, so that the integrator controls the errors of both."""
    return np.array([y.real, y.imag / STEP]).ravel()


def joined(y):
    """The inverse of `apart`: complex numbers (components, 8)."""
    real, derivative = y.reshape(2, -1, 8)
    return real + 1j * STEP * derivative


def cross(a, b):
    return np.array([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


def twisted(p):
    """The turn near p at which a straight strip under tension buckles, from eight linear equations with constant coefficients.

    On the directors, with U_11 and M3 = U_3 of the energy at (0, w): U_11 a' = w m2 + n2, m2' = (M3 - w U_11) a - n1,
    n1' = w n2, n2' = T a - w n1, and for rotation and place psi1' = w psi2 + a, psi2' = -w psi1, x1' = w x2 + psi2,
    x2' = -w x1 - psi1; psi and x vanish at both ends. (Shooting would lose seven digits: perturbations grow like exp(20 s).)
    """
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

    return brentq(determinant, p["turn"] - 0.1, p["turn"] + 0.1, xtol=1e-13)


# --- a scene and its comparison -------------------------------------------------------------------------------------------


class Scene:
    """The result of a scene, and what shooting says of it."""

    def __init__(self, name, folder):
        self.name, self.config, path = name, load(CONFIGS / f"{name}.yaml"), Path(folder) / f"{name}.h5"
        assert run_scene(self.config, path, Display(silent=True)) == "complete"
        self.branch = read_branch(path)

    def shooting(self, row, stage):
        """The equations with the numbers of a row of the table of points, and the start values z there."""
        points = self.branch.points
        numbers = {name: float(points[row][name]) for name in points.dtype.names if points.dtype[name] == "f8"}
        inside = [-numbers[f"start_{what}_{axis}"] for what in "FM" for axis in AXES]  # the clamp's reactions, reversed
        phases, direction = tuple(self.config.phases), np.array(self.config.directions.weight)
        shot = Shooting(self.name, numbers, self.config.stages[stage - 1].follow, direction, phases)
        return shot, np.array([*inside, *np.zeros(len(phases))]), numbers

    def states(self):
        """Differences of force, moment and energy at the end of each stage, relative to 1 + the largest component."""
        differences = []
        for stage in np.unique(self.branch.points["stage"]):
            row = int(np.flatnonzero(self.branch.points["stage"] == stage)[-1])
            shot, z, numbers = self.shooting(row, int(stage))
            found, energy = shot.state(z, numbers[shot.followed])
            off = np.abs(found - z)
            sizes = 1 + np.abs(z[:3]).max(), 1 + np.abs(z[3:6]).max(), 1 + abs(energy)
            differences.append(np.array([off[:3].max(), off[3:6].max(), abs(energy - numbers["energy"])]) / sizes)
            assert np.all(off[6:] < 1e-8)
        return np.array(differences)

    def specials(self):
        """Differences of the number that is followed, relative to 1 + its size, at all folds and branch points."""
        found = []
        for event in self.branch.events:
            label = event["label"].decode()
            if label not in ("LP", "BP") or event["name"] == b"start":
                continue
            shot, z, numbers = self.shooting(int(event["point"]), int(event["stage"]))
            value = numbers[shot.followed]
            near = twisted(numbers) if self.name == "open_tension" else shot.special(z, value, label)
            found.append(abs(near - value) / (1 + abs(value)))
        return found


#: The scene that the default tests take.
QUICK = "open_tip"


LONG = [pytest.param(name, marks=[pytest.mark.full, pytest.mark.hours]) for name in SCENES if name != QUICK]


@pytest.fixture(scope="module", params=[QUICK, *LONG])
def scene(request, tmp_path_factory):
    return Scene(request.param, tmp_path_factory.mktemp("scene"))


def test_states_against_shooting(scene):
    """Force, moment and energy at the end of each stage: measured 1e-10 at most."""
    assert scene.states().max() < 1e-9


def test_special_points_against_shooting(scene):
    """Every fold and branch point of the scene: measured 5e-10 at most, where the mesh has a tolerance of 1e-9."""
    assert max(scene.specials(), default=0.0) < 2e-9


def main():
    print("| scene | stages | force | moment | energy | folds and branch points | number followed |")
    print("|---|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        for name in sys.argv[1:] or SCENES:
            scene = Scene(name, folder)
            states, special = scene.states(), scene.specials()
            worst = f"{max(special):.0e}" if special else "–"
            numbers = " | ".join(f"{value:.0e}" for value in states.max(axis=0))
            print(f"| `{name}` | {len(states)} | {numbers} | {len(special)} | {worst} |", flush=True)


if __name__ == "__main__":
    main()
