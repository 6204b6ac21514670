"""Structures and lattices: algebraic problems with folds and branch points, two of them double, and no Hopf points."""

import functools

import numpy as np

from bank.case import Case, Special
from bank.known import ERROR, equilibria, zeros
from contin import AlgebraicProblem, curve, solve, trace

# --- the two-bar truss (von Mises 1923), height 3, half span 1, both displacements of the apex -------------------------
# With x = 0 and L the length of the bars: folds at L^3 = L0, branch points at L^3 - L0 L^2 + L0 = 0.

LENGTH = 10**0.5


def truss_residual(u, p):
    left = 1 - LENGTH / np.sqrt((1 + u.x) ** 2 + u.y**2)
    right = 1 - LENGTH / np.sqrt((1 - u.x) ** 2 + u.y**2)
    return left * (1 + u.x) - right * (1 - u.x), (left + right) * u.y + p.load


TRUSS = AlgebraicProblem(truss_residual, ["x", "y"], {"load": 0.0}, functionals={"y": lambda u, p: u.y})


def snap():
    return trace(solve(TRUSS, [0.0, 3.0]), free=["load"], limits={"load": (-10, 4)})


def upright(y):
    return (0 * y, y), 2 * y * (LENGTH / np.sqrt(1 + y**2) - 1)


# --- Augusti's column (1964) with springs 1 and 0.8: on the branch psi = 0, load = phi / sin(phi), a secondary one -------

AUGUSTI = AlgebraicProblem(
    lambda u, p: (u.phi - p.load * np.sin(u.phi) * np.cos(u.psi), p.k * u.psi - p.load * np.cos(u.phi) * np.sin(u.psi)),
    ["phi", "psi"],
    {"load": 0.0, "k": 0.8},
    functionals={"phi": lambda u, p: u.phi},
)


@functools.cache
def column():
    return trace(solve(AUGUSTI, [0.0, 0.0]), free=["load"], limits={"load": (-1, 2)})


def leaning():
    point = column().labelled("BP")[1]
    direction = 1 if point.details.tangents[1][0] > 0 else -1
    return trace(point, branch=1, direction=direction, free=["load"], limits={"load": (0, 2)})


def phi_branch(phi):
    return (phi, 0 * phi), phi / np.sin(phi)


# --- imperfection (Koiter 1945): (1 - load) x - 3/2 x^2 = load eps has its fold at (1 - load)^2 = 6 load eps ------------

KOITER = AlgebraicProblem(lambda u, p: ((1 - p.load) * u.x - 1.5 * u.x**2 - p.load * p.eps,), ["x"], {"load": 0.0, "eps": 0.01})


@functools.cache
def imperfect():
    return trace(solve(KOITER, [0.0]), free=["load"], limits={"load": (-1, 2)})


def buckling_load(eps):
    return 1 + 3 * eps - (6 * eps + 9 * eps**2) ** 0.5


def knock_down():
    return curve(imperfect().labelled("LP")[0], "eps", limits={"eps": (0.001, 0.2)}, zeros={"eps": [0.05]})


# --- the plates of a switch (Nathanson 1967): pull-in at 4 / 27 ---------------------------------------------------------

PLATES = AlgebraicProblem(
    lambda u, p: (u.x - p.lam / (1 - u.x) ** 2,), ["x"], {"lam": 0.0}, functionals={"x": lambda u, p: u.x}
)


def pull_in():
    return trace(solve(PLATES, [0.0]), free=["lam"], limits={"lam": (-0.01, 1), "x": (-0.1, 0.9)})


# --- outbreaks of the budworm (Ludwig, Jones & Holling 1978): folds r = 2 x^3 / (1 + x^2)^2, q = 2 x^3 / (x^2 - 1) -------

BUDWORM = AlgebraicProblem(
    lambda u, p: (p.r * (1 - u.x / p.q) - u.x / (1 + u.x**2),),
    ["x"],
    {"r": 0.0, "q": 10.0},
    functionals={"x": lambda u, p: u.x},
)


def budworm(x):
    return (x,), x / (1 + x**2) / (1 - x / 10)


@functools.cache
def outbreak():
    return trace(solve(BUDWORM, [0.0]), free=["r"], limits={"r": (-0.1, 1)})


def refuge():
    """From the fold at q = 10 to the cusp at x = sqrt(3), q = 3 sqrt(3), and on to q = 10.5 with the other fold."""
    return curve(outbreak().labelled("LP")[0], "q", direction=-1, limits={"q": (1, 10.5)})


def other_fold(q):
    (x,) = zeros(lambda x: 2 * x**3 / (x**2 - 1) - q, 3**0.5 + 0.1, 20.0)
    return 2 * x**3 / (1 + x**2) ** 2


# --- a ring of four bistable cells: from zero, modes with 0, 1 (twice) and 2 waves at 0, 2 d, 4 d; d = 1/2 ---------------


def ring_residual(u, p):
    a, b, c, d = u
    return (
        p.lam * a - a**3 + 0.5 * (d - 2 * a + b),
        p.lam * b - b**3 + 0.5 * (a - 2 * b + c),
        p.lam * c - c**3 + 0.5 * (b - 2 * c + d),
        p.lam * d - d**3 + 0.5 * (c - 2 * d + a),
    )


RING = AlgebraicProblem(ring_residual, ["a", "b", "c", "d"], {"lam": -1.0})


def ring():
    return trace(solve(RING, [0.0] * 4), free=["lam"], limits={"lam": (-1.5, 3)})


# --- the resonance of Duffing's oscillator by harmonic balance (F = 0.4, damping 0.1) -----------------------------------

DUFFING = AlgebraicProblem(
    lambda u, p: (
        (1 - p.w**2) * u.a + 0.1 * p.w * u.b + 0.75 * u.a * (u.a**2 + u.b**2) - 0.4,
        (1 - p.w**2) * u.b - 0.1 * p.w * u.a + 0.75 * u.b * (u.a**2 + u.b**2),
    ),
    ["a", "b"],
    {"w": 0.0},
    functionals={"square": lambda u, p: u.a**2 + u.b**2},
    dynamics=False,
)


def resonance():
    return trace(solve(DUFFING, [0.35, 0.0]), free=["w"], limits={"w": (-0.1, 5)})


def resonance_folds():
    """With r the square and D = 1 - w^2 + 3 r / 4: r (D^2 + w^2 / 100) = F^2, and its derivative by r vanishes."""
    found = []
    for sign in (1, -1):

        def parts(r, sign=sign):
            half = (1.5 * r - 0.01) / 2
            d = -half + sign * np.sqrt(max(half**2 - 0.01 * (1 + 0.75 * r), 0.0))
            return d, 1 + 0.75 * r - d

        def excess(r, parts=parts):
            d, square = parts(r)
            return r * (d**2 + 0.01 * square) - 0.16

        found += [Special("LP", {"w": parts(r)[1] ** 0.5, "square": r}, ERROR) for r in zeros(excess, 0.15, 20.0, 4001)]
    return sorted(found, key=lambda special: -special.values["w"])


# --- Bratu's problem on a square grid of 3 x 3 points: one fold, and no branch point up to 8 in the middle ----------------


def grid_residual(u, p, out):
    for i in range(3):
        for j in range(3):
            around = 0.0
            if i > 0:
                around += u[3 * i - 3 + j]
            if i < 2:
                around += u[3 * i + 3 + j]
            if j > 0:
                around += u[3 * i + j - 1]
            if j < 2:
                around += u[3 * i + j + 1]
            out[3 * i + j] = around - 4 * u[3 * i + j] + p[0] / 16 * np.exp(u[3 * i + j])


GRID = AlgebraicProblem(grid_residual, 9, {"lam": 0.0}, functionals={"middle": lambda u, p: u.u4})


def grid():
    return trace(solve(GRID, [0.0] * 9), free=["lam"], limits={"lam": (-1, 10), "middle": (-1, 8)})


def grid_points():
    """Corner, edge and middle a, b, c: c gives lam, and every eigenvalue of the Jacobian is followed."""

    def states(c, lam):
        b = c - lam / 64 * np.exp(c)
        return (4 * b - c - lam / 16 * np.exp(b)) / 2, b

    def load(c):
        def rest(lam):
            a, b = states(c, lam)
            return 4 * a - 2 * b - lam / 16 * np.exp(a)

        return zeros(rest, 0.0, 64 * c * np.exp(-c), 100)[0]

    def eigenvalues(c):
        lam = load(c)
        a, b = states(c, lam)
        u = np.array([a, b, a, b, c, b, a, b, a])
        near = np.abs(np.subtract.outer(np.arange(9) // 3, np.arange(9) // 3))
        near = near + np.abs(np.subtract.outer(np.arange(9) % 3, np.arange(9) % 3))
        values, vectors = np.linalg.eigh((near == 1) - 4 * np.eye(9) + np.diag(lam / 16 * np.exp(u)))
        return values, vectors

    found = []
    for k in range(9):
        for c in zeros(lambda c, k=k: eigenvalues(c)[0][k], 0.05, 8.0, 160):
            vector = eigenvalues(c)[1][:, k]
            label = "LP" if abs(vector[[0, 1, 4]] @ [4, 4, 1]) > 1e-3 and abs(vector.sum()) > 1e-6 else "BP"
            found.append((c, Special(label, {"lam": load(c), "middle": c}, 1e-12)))
    return found, load


def coarse():
    found, load = grid_points()
    found.sort(key=lambda entry: entry[0])
    kept = [special for i, (c, special) in enumerate(found) if i == 0 or c - found[i - 1][0] > 1e-9]
    return [*kept, Special("EP", {"lam": load(8.0), "middle": 8.0}, 1e-12)]


CASES = [
    Case("two-bar truss", snap, equilibria(TRUSS, "load", upright, 3.0, zeros(lambda y: upright(y)[1] - 4, -3, -6)[0])),
    Case("Augusti's column", column, [
        Special("BP", {"load": 0.8}), Special("BP", {"load": 1.0}), Special("EP", {"load": 2.0}),
    ]),
    Case("Augusti's column, leaning", leaning,
         equilibria(AUGUSTI, "load", phi_branch, 1e-3, zeros(lambda s: phi_branch(s)[1] - 2, 0.1, 3)[0])),
    Case("Koiter", imperfect, [
        Special("LP", {"load": buckling_load(0.01)}, ERROR), Special("EP", {"load": -1.0}),
    ]),
    Case("Koiter: knock-down", knock_down, [
        Special("UZ", {"eps": 0.05, "load": buckling_load(0.05)}, ERROR),
        Special("EP", {"eps": 0.2, "load": buckling_load(0.2)}, ERROR),
    ]),
    Case("switch", pull_in, [
        Special("LP", {"lam": 4 / 27, "x": 1 / 3}), Special("EP", {"lam": 0.9 * 0.1**2, "x": 0.9}),
    ]),
    Case("budworm", outbreak, equilibria(BUDWORM, "r", budworm, 0.0, zeros(lambda x: budworm(x)[1] - 1, 0, 9.9)[-1])),
    Case("budworm: folds", refuge, [
        Special("CP", {"q": 27**0.5, "r": 27**0.5 / 8}, ERROR), Special("EP", {"q": 10.5, "r": other_fold(10.5)}, ERROR),
    ]),
    Case("ring of four", ring, [*(Special("BP", {"lam": x}) for x in (0.0, 1.0, 2.0)), Special("EP", {"lam": 3.0})]),
    Case("Duffing's resonance", resonance, [*resonance_folds(), Special("EP", {"w": 5.0})]),
    Case("grid of 3 x 3", grid, coarse),
]  # fmt: skip
