"""Programs that state a problem and find its first solution, as text: each run makes their functions anew.

The thirty problems are those of docs/outside.md, in the style of their authors, up to the first solution; where the known
answer there is a bifurcation, the check is of a state that is known in closed form or by SciPy. Ten are variational, and
four are large. Every text ends with its solution, ``found``.
"""

from __future__ import annotations

from typing import NamedTuple


class Statement(NamedTuple):
    """A program: ``setup`` is not timed, ``text`` is, ``check`` is an expression that is true for the right solution.

    In ``check``, ``u(t)`` is the states of the solution at t. ``word`` is a name in the text that is another one in each run.
    """

    name: str
    text: str
    check: str
    setup: str = ""
    word: str = "p"


NEWCOMERS = (
    Statement("1 Troesch", """
def rhs(t, y, p):
    return np.array([y[1], p.n * np.sinh(p.n * y[0])])
def bc(ya, yb, p):
    return np.array([ya[0], yb[0] - 1])
problem = contin.BoundaryValueProblem(rhs, bc, ["y", "dy"], {"n": 5.0})
found = contin.solve(problem, lambda t: (t**6, 6 * t**5))
""", "abs(u(0)[1] - 0.0457504614) < 1e-9"),
    Statement("2 Carrier", """
def rhs(x, y, p):
    return [y[1], (1 - 2 * (1 - x**2) * y[0] - y[0] ** 2) / p["eps"] ** 2]
problem = contin.BoundaryValueProblem(rhs, lambda a, b, p: [a[0], b[0]], ["y", "dy"], {"eps": 0.8}, domain=(-1, 1))
found = contin.solve(problem, [0, 0])
""", "abs(u(0)[0] - CARRIER) < 1e-5"),
    Statement("3 Falkner-Skan", """
def rhs(x, f, p):
    return np.hstack([np.stack([f[1], f[2]]), -f[0] * f[2] - p.beta * (1 - f[1] ** 2)])
def bc(a, b, p):
    return np.array([a[0], a[1], b[1] - 1])
problem = contin.BoundaryValueProblem(rhs, bc, ["f", "df", "ddf"], {"beta": 0.0}, domain=(0, 10))
found = contin.solve(problem, lambda x: (x - 1 + math.exp(-x), 1 - math.exp(-x), math.exp(-x)))
""", "abs(u(0)[2] - 0.46960) < 1e-5"),
    Statement("4 rotating disk", """
class Disk:
    spin = 1.0
    def rates(self, x, y, p):
        F, dF, G, dG, H = y
        return dF, F**2 - G**2 + H * dF, dG, 2 * F * G + H * dG, -2 * F
    def ends(self, a, b, p):
        return a[0], a[2] - self.spin, a[4], b[0] - p.outer, b[2]
disk = Disk()
problem = contin.BoundaryValueProblem(disk.rates, disk.ends, ["F", "dF", "G", "dG", "H"], {"outer": 0.0}, domain=(0, 16))
def guess(x):
    e = math.exp(-x)
    return x * e / 2, (1 - x) * e / 2, e, -e, 0.9 * e - 0.9
found = contin.solve(problem, guess)
""", "abs(u(0)[1] - 0.510233) < 1e-5 and abs(u(0)[3] + 0.615922) < 1e-5"),
    Statement("5 Jeffery-Hamel flow", """
def rhs(y, f, p):
    out = np.zeros(2)
    out[0] = f[1]
    out[1] = -2 * p.R * f[0] ** 2 - 4 * p.alpha**2 * f[0] - p.c
    return out
problem = contin.BoundaryValueProblem(rhs, lambda a, b, p: (a[0], b[0]), ["f", "df"], {"R": 0.0, "alpha": 0.1, "c": 2.0},
    integrals=lambda y, f, p: f[0] - 2 / 3, domain=(-1, 1))
found = contin.solve(problem, lambda y: (1 - y**2, -2 * y), free=["c"])
""", "abs(u(0)[0] - (1 - math.cos(0.2)) / (math.sin(0.2) / 0.2 - math.cos(0.2)) * 2 / 3) < 1e-9"),
    Statement("6 pull-in of a plate", """
EPS0, AREA, STIFFNESS, GAP = 8.854187812e-12, 1e-8, 5.0, 2e-6
def residual(u, p):
    return np.array([STIFFNESS * u[0] - EPS0 * AREA * p["V"] ** 2 / (2 * (GAP - u[0]) ** 2)])
volts = math.sqrt(2 * STIFFNESS * GAP / 6 * (GAP * 5 / 6) ** 2 / (EPS0 * AREA))
problem = contin.AlgebraicProblem(residual, ["x"], {"V": volts})
found = contin.solve(problem, [0.0])
""", "abs(found.x[0] / 2e-6 - 1 / 6) < 1e-5"),
    Statement("7 pull-in of a beam", """
beam = {"E": 169e9, "L": 300e-6, "b": 50e-6, "h": 2e-6, "gap": 1e-6, "eps0": 8.854187812e-12}
inertia = beam["b"] * beam["h"] ** 3 / 12
def rhs(x, w, p):
    load = beam["eps0"] * beam["b"] * p.V**2 / (2 * (beam["gap"] - w[0]) ** 2)
    return w[1], w[2], w[3], load / (beam["E"] * inertia)
problem = contin.BoundaryValueProblem(rhs, lambda a, b, p: (a[0], a[1], b[0], b[1]), ["w", "slope", "bend", "shear"],
    {"V": math.sqrt(35 * 2 * beam["E"] * inertia * beam["gap"] ** 3 / (beam["eps0"] * beam["b"] * beam["L"] ** 4))},
    domain=(0, beam["L"]))
found = contin.solve(problem, [0, 0, 0, 0])
""", "abs(u(150e-6)[0] / 1e-6 - BEAM) < 1e-5"),
    Statement("8 tunnel diode", """
C, L, R = 2e-12, 5e-6, 1.5e3
curve = 1e-3 * np.array([83.72, -226.31, 229.62, -103.79, 17.76, 0.0])
def residual(u, p):
    return (u[1] - np.polyval(curve, u[0])) / C, (p.E - R * u[1] - u[0]) / L
problem = contin.AlgebraicProblem(residual, ["v", "i"], {"E": 1.2})
found = contin.solve(problem, [0.06, 0.8e-3])
""", "abs(found.x[0] - 0.063) < 5e-4 and abs(found.x[1] - 0.758e-3) < 5e-7"),
    Statement("9 stirred tank reactor", """
class Reactor:
    def __init__(self):
        self.flow, self.k0, self.activation, self.heat, self.transfer = 1.0, 7.2e10, 8750.0, 209.205, 2.0920502
    def rate(self, T):
        return self.k0 * np.exp(-self.activation / T)
    def balances(self, u, p):
        r = self.rate(u.T) * u.C
        return [self.flow * (1 - u.C) - r, self.flow * (350 - u.T) + self.heat * r + self.transfer * (p.Tc - u.T)]
problem = contin.AlgebraicProblem(Reactor().balances, ["C", "T"], {"Tc": 300.0})
found = contin.solve(problem, [0.52, 348.0])
""", "abs(found.x[0] - 0.5) < 1e-3 and abs(found.x[1] - 350) < 0.1"),
    Statement("10 chemostat", """
feed, half, inhibition, gain = 10.0, 1.0, 5.0, 0.5
def growth(S):
    return S / (half + S + S**2 / inhibition)
def residual(u, p):
    mu = growth(u["S"])
    return p["D"] * (feed - u["S"]) - mu * u["X"] / gain, (mu - p["D"]) * u["X"]
problem = contin.AlgebraicProblem(residual, ["S", "X"], {"D": 0.2})
found = contin.solve(problem, [0.3, 4.8])
""", "abs(found.x[0] - (0.8 - math.sqrt(0.608)) / 0.08) < 1e-9"),
    Statement("11 enzyme with inhibition", """
k, S0, Vmax, Km, Ki = 0.1, 20e-6, 2e-6, 1e-6, 2e-6
def residual(u, p):
    return np.array([p.v - Vmax * u[0] / (Km + u[0] + u[0] ** 2 / Ki)])
problem = contin.AlgebraicProblem(residual, ["S"], {"v": Vmax * 0.5 / (1 + 0.5 + 0.125)})
found = contin.solve(problem, [0.4e-6])
""", "abs(found.x[0] - 0.5e-6) < 1e-12"),
    Statement("12 Hodgkin-Huxley", """
def alpha_n(v):
    return np.where(np.abs(v - 10) < 1e-9, 0.1, 0.01 * (10 - v) / (np.exp((10 - v) / 10) - 1))
def alpha_m(v):
    return np.where(np.abs(v - 25) < 1e-9, 1.0, 0.1 * (25 - v) / (np.exp((25 - v) / 10) - 1))
def residual(u, p):
    v, m, h, n = u
    current = 120 * m**3 * h * (v - 115) + 36 * n**4 * (v + 12) + 0.3 * (v - 10.5989)
    return (p.I - current, alpha_m(v) * (1 - m) - 4 * np.exp(-v / 18) * m,
        0.07 * np.exp(-v / 20) * (1 - h) - h / (np.exp((30 - v) / 10) + 1), alpha_n(v) * (1 - n) - 0.125 * np.exp(-v / 80) * n)
problem = contin.AlgebraicProblem(residual, ["v", "m", "h", "n"], {"I": 0.0})
found = contin.solve(problem, [0.0, 0.05, 0.6, 0.3])
""", "abs(found.x[0]) < 0.01 and abs(found.x[1] - 0.0529) < 1e-3"),
    Statement("13 ring of FitzHugh-Nagumo cells", """
n = 20
def residual(u, p):
    v, w = u[:n], u[n:]
    coupling = np.roll(v, 1) + np.roll(v, -1) - 2 * v
    return np.concatenate([v - v**3 / 3 - w + p.I + 0.2 * coupling, 0.08 * (v + 0.7 - 0.8 * w)])
problem = contin.AlgebraicProblem(residual, 2 * n, {"I": 0.0})
found = contin.solve(problem, [-1.2] * n + [-0.6] * n)
""", "np.allclose(found.x[:20], -1.19941, atol=1e-5)"),
    Statement("14 Kuramoto oscillators", """
omega = np.linspace(-1, 1, 50)
def residual(theta, p):
    c, s = np.mean(np.cos(theta)), np.mean(np.sin(theta))
    rates = omega + p["K"] * (s * np.cos(theta) - c * np.sin(theta))
    return np.concatenate([rates[:-1], [np.sum(theta)]])
problem = contin.AlgebraicProblem(residual, 50, {"K": 2.0}, dynamics=False)
found = contin.solve(problem, list(omega / 2))
""", "np.allclose(2 * np.mean(np.cos(found.x[:50])) * np.sin(found.x[:50]), np.linspace(-1, 1, 50), atol=1e-9)"),
    Statement("15 power flow", """
X = 0.25
def residual(u, p):
    bus = u["V"] * np.exp(1j * u["delta"])
    power = bus * np.conj((1 - bus) / (1j * X))
    return power.real - p["P"], power.imag
problem = contin.AlgebraicProblem(residual, ["V", "delta"], {"P": 1.0}, dynamics=False)
found = contin.solve(problem, [1.0, 0.0])
""", "abs(found.x[0] - math.sqrt((1 + math.sqrt(0.75)) / 2)) < 1e-9"),
    Statement("16 Stommel", """
def residual(u, p):
    flow = np.abs(u[0] - u[1])
    return 3.0 - u[0] * (1 + flow), p.eta2 - u[1] * (0.3 + flow)
problem = contin.AlgebraicProblem(residual, ["T", "S"], {"eta2": 0.0})
found = contin.solve(problem, [1.3, 0.0])
""", "abs(found.x[0] - (math.sqrt(13) - 1) / 2) < 1e-9"),
    Statement("17 Daisyworld", """
SOLAR, SIGMA, Q, DEATH = 917.0, 5.67e-8, 2.06e9, 0.3
def growth(T):
    return max(0.0, 1 - 0.003265 * (295.5 - T) ** 2)
def residual(u, p):
    bare = 1 - u.white - u.black
    albedo = 0.75 * u.white + 0.25 * u.black + 0.5 * bare
    planet = p.L * SOLAR * (1 - albedo) / SIGMA
    white, black = ((Q * (albedo - own) + planet) ** 0.25 for own in (0.75, 0.25))
    return u.white * (bare * growth(white) - DEATH), u.black * (bare * growth(black) - DEATH)
problem = contin.AlgebraicProblem(residual, ["white", "black"], {"L": 1.0})
found = contin.solve(problem, [0.4, 0.27])
""", "abs(found.x[0] + found.x[1] - 0.673471920921) < 1e-9"),
    Statement("18 energy balance of the climate", """
SIGMA, EMISSIVITY = 5.670374419e-8, 0.61
def albedo(T):
    return 0.5 - 0.2 * np.tanh((T - 265) / 10)
problem = contin.AlgebraicProblem(lambda u, p: p.Q * (1 - albedo(u.T)) - EMISSIVITY * SIGMA * u.T**4, ["T"],
    {"Q": EMISSIVITY * SIGMA * 288.0**4 / (1 - albedo(288.0))})
found = contin.solve(problem, [290.0])
""", "abs(found.x[0] - 288) < 1e-9"),
    Statement("19 von Mises truss", """
class Truss:
    E, area, span, height = 210e9, 1e-4, 1.0, 0.1
    def force(self, w):
        first, now = math.hypot(self.span, self.height), math.sqrt(self.span**2 + (self.height - w) ** 2)
        return 2 * self.E * self.area * (1 / now - 1 / first) * (self.height - w)
truss = Truss()
problem = contin.AlgebraicProblem(lambda u, p: (truss.force(u.w) - p.load,), ["w"], {"load": truss.force(0.01)})
found = contin.solve(problem, [0.0])
""", "abs(found.x[0] - 0.01) < 1e-10"),
    Statement("20 shallow arch", """
rise = 6.0
def residual(a, p):
    stretch = a[0] ** 2 + 4 * a[1] ** 2 - rise**2
    return np.array([1.0, 16.0]) * (a - np.array([rise, 0.0])) + np.array([1.0, 4.0]) * stretch * a + np.array([p.load, 0.0])
problem = contin.AlgebraicProblem(residual, ["a1", "a2"], {"load": 1 + 11 * 5})
found = contin.solve(problem, [5.5, 0.0])
""", "abs(found.x[0] - 5) < 1e-9"),
    Statement("21 cable of given length", """
weight, span, length = 12.5, 100.0, 103.0
def rhs(x, y, p):
    return y.slope, weight / p.H * math.sqrt(1 + y.slope**2)
problem = contin.BoundaryValueProblem(rhs, lambda a, b, p: (a.y - 20.0, b.y - 20.0), ["y", "slope"], {"H": 2000.0},
    integrals=lambda x, y, p: (math.sqrt(1 + y.slope**2) - length / span,), domain=(0, span))
found = contin.solve(problem, lambda x: (20 - 0.12 * x * (1 - x / span), 0.12 * (2 * x / span - 1)), free=["H"])
""", "abs(found['H'] - 1479.7226630443) < 1e-6"),
    Statement("22 Gelfand in a ball", """
def rhs(r, u, p):
    if r == 0:
        return u.v, -p.lam * math.exp(u.u) / 3
    return u.v, -p.lam * math.exp(u.u) - 2 * u.v / r
problem = contin.BoundaryValueProblem(rhs, lambda a, b, p: (a.v, b.u), ["u", "v"], {"lam": 1.0})
found = contin.solve(problem, [0, 0])
""", "abs(u(0)[0] - BALL) < 1e-5"),
    Statement("23 Allen-Cahn, 500 points", """
n = 500
h = 1 / (n + 1)
A = sparse.diags([1.0, -2.0, 1.0], [-1, 0, 1], shape=(n, n), format="csr") / h**2
def residual(u, p):
    return A @ u / p.lam + u - u**3
problem = contin.AlgebraicProblem(residual, n, {"lam": 40.0})
found = contin.solve(problem, list(0.9 * np.sin(np.pi * h * np.arange(1, n + 1))))
""", "np.abs(A @ found.x / 40 + found.x - found.x**3).max() < 1e-8 and 0.5 < found.x[249] < 1",
        "import scipy.sparse as sparse"),
    Statement("24 Swift-Hohenberg", """
def rhs(t, u, p):
    return u.b, u.c, u.d, (p.r - 1) * u.a - 2 * u.c + 1.6 * u.a**2 - u.a**3
def pulse(x):
    height = 2 * math.sqrt(0.08 / (38 * 1.6**2 / 9 - 3))
    wave = height / math.cosh(math.sqrt(0.04) / 2 * x)
    return wave * math.cos(x), -wave * math.sin(x), -wave * math.cos(x), wave * math.sin(x)
problem = contin.BoundaryValueProblem(rhs, lambda a, b, p: (a.b, a.d, b.b, b.d), ["a", "b", "c", "d"], {"r": -0.04},
    domain=(0.0, 60.0), functionals={"square": lambda t, u, p: u.a**2})
found = contin.solve(problem, pulse, intervals=60)
""", "0.1 < u(0)[0] < 0.6 and abs(u(60)[0]) < 0.01"),
    Statement("25 Cahn-Hilliard", """
mass = 0.3
problem = contin.BoundaryValueProblem(
    lambda x, u, p: [u[1], (u[0] ** 3 - u[0] - p.mu) / p.eps**2], lambda a, b, p: [a[1], b[1]], ["u", "du"],
    {"eps": 0.2, "mu": mass**3 - mass}, integrals=lambda x, u, p: u[0] - mass)
found = contin.solve(problem, [mass, 0], free=["mu"])
""", "abs(found['mu'] + 0.273) < 1e-9"),
    Statement("26 Brusselator, 400 unknowns", """
n = 200
h = 1 / (n + 1)
A = sparse.diags([1.0, -2.0, 1.0], [-1, 0, 1], shape=(n, n), format="csr") / h**2
edge = np.zeros(n)
edge[0] = edge[-1] = 1 / h**2
def residual(u, p):
    x, y = u[:n], u[n:]
    return np.concatenate([0.008 / p.L**2 * (A @ x + 2 * edge) + 2 - 6.45 * x + x**2 * y,
        0.004 / p.L**2 * (A @ y + 2.725 * edge) + 5.45 * x - x**2 * y])
problem = contin.AlgebraicProblem(residual, 2 * n, {"L": 0.3})
found = contin.solve(problem, [2.1] * n + [2.7] * n)
""", "np.allclose(found.x[:400], [2] * 200 + [2.725] * 200, atol=1e-8)", "import scipy.sparse as sparse"),
    Statement("27 Gross-Pitaevskii", """
hbar, m, omega = 1.054571817e-34, 1.443e-25, 2 * math.pi * 100
size = math.sqrt(hbar / (m * omega))
def rhs(x, u, p):
    return u.slope, 2 * m / hbar**2 * (m * omega**2 * x**2 / 2 + p.g * u.psi**2 - p.mu) * u.psi
def gauss(x):
    psi = math.exp(-((x / size) ** 2) / 2) / math.sqrt(size * math.sqrt(math.pi))
    return psi, -x / size**2 * psi
problem = contin.BoundaryValueProblem(rhs, lambda a, b, p: (a.psi, b.psi), ["psi", "slope"],
    {"mu": hbar * omega * 0.45, "g": 0.0}, integrals=lambda x, u, p: u.psi**2 - 1 / (14 * size), domain=(-7 * size, 7 * size))
found = contin.solve(problem, gauss, free=["mu"])
""", "abs(found['mu'] / (1.054571817e-34 * 2 * math.pi * 100) - 0.5) < 1e-9"),
    Statement("28 Orr-Sommerfeld", """
def rhs(y, u, p):
    phi, c = u[:4] + 1j * u[4:], p.cr + 1j * p.ci
    U = 1 - y**2
    fourth = 2 * phi[2] - phi[0] + 1j * p.R * ((U - c) * (phi[2] - phi[0]) + 2 * phi[0])
    rates = np.array([phi[1], phi[2], phi[3], fourth])
    return np.concatenate([rates.real, rates.imag])
def bc(a, b, p):
    return np.array([a[0] - 1, a[4], a[1], a[5], a[3], a[7], b[0], b[4], b[1], b[5]])
names = ["f0", "f1", "f2", "f3", "g0", "g1", "g2", "g3"]
problem = contin.BoundaryValueProblem(rhs, bc, names, {"R": 1e4, "cr": 0.2375, "ci": 0.0037})
found = contin.solve(problem, mode, free=["cr", "ci"], intervals=40)
""", "abs(found['cr'] - 0.23752649) < 1e-5 and abs(found['ci'] - 0.00373967) < 1e-5", """
import scipy.linalg
N = 80
x = np.cos(np.pi * np.arange(N + 1) / N)
w = np.r_[2.0, np.ones(N - 1), 2.0] * (-1.0) ** np.arange(N + 1)
D = np.outer(w, 1 / w) / (x[:, None] - x + np.eye(N + 1))
D -= np.diag(D.sum(axis=1))
D2, U = D @ D, np.diag(1 - x**2)
lap = D2 - np.eye(N + 1)
left = U @ lap + 2 * np.eye(N + 1) - lap @ lap / 1e4j
right = lap + 0j
for row, condition in ((0, np.eye(N + 1)[0]), (N, np.eye(N + 1)[N]), (1, D[0]), (N - 1, D[N])):
    left[row], right[row] = condition, 0
values, vectors = scipy.linalg.eig(left, right)
phi = vectors[:, np.argmin(np.abs(values - (0.2375 + 0.0037j)))]
phi = phi / phi[N // 2]
parts = np.array([phi, D @ phi, D2 @ phi, D2 @ (D @ phi)])[:, ::-1].T
places = np.linspace(0, 1, 401)
table = np.array([[np.interp(places, x[::-1], part) for part in side.T] for side in (parts.real, parts.imag)])
mode = (places, table.reshape(8, -1).T)
"""),
    Statement("29 forced Duffing oscillator", """
def forced(t, u, p):
    return u[1], p["F"] * np.cos(p["w"] * t) - 0.1 * u[1] - u[0] - u[0] ** 3
problem = contin.CycleProblem(forced, ["x", "v"], {"F": 0.1, "w": 0.5}, period=lambda p: 2 * np.pi / p.w)
found = contin.solve(problem, lambda t: (0.13 * math.cos(2 * math.pi * t), -0.065 * math.sin(2 * math.pi * t)))
""", "abs(found['max_x'] - DUFFING) < 1e-5"),
    Statement("30 AUTO's demo nep", """
def func(t, u, par):
    f = np.zeros(2)
    f[0] = u[1]
    f[1] = -par[0] * np.sin(u[0])
    return f
problem = contin.BoundaryValueProblem(func, lambda a, b, par: (a[1], b[1]), ["u", "v"], {"lam": 15.0})
found = contin.solve(problem, lambda t: (1.6 * math.cos(math.pi * t), -1.6 * math.pi * math.sin(math.pi * t)))
""", "abs(PENDULUM(u(0)[0]) / math.sqrt(15) - 1) < 1e-8", word="par"),
)  # fmt: skip

VARIATIONAL = (
    Statement("elastica, clamped", """
problem = contin.VariationalProblem(
    energy=lambda t, x, w, p: w.angle**2 / 2 + p.load * math.cos(x.angle), states=["angle"], parameters={"load": 50.0},
    ends=lambda a, b, p: (a.angle, b.angle), integrals={"offset": lambda t, x, w, p: math.sin(x.angle)})
found = contin.solve(problem, lambda t: [1.3 * math.sin(2 * math.pi * t)])
""", "abs(2 * PENDULUM(u(0.25)[0]) / math.sqrt(50) - 1) < 1e-8", word="load"),
    Statement("elastica, pinned", """
problem = contin.VariationalProblem(
    energy=lambda t, x, w, p: w.angle**2 / 2 + p.load * math.cos(x.angle), states=["angle"], parameters={"load": 15.0})
found = contin.solve(problem, lambda t: [1.6 * math.cos(math.pi * t)])
""", "abs(PENDULUM(u(0)[0]) / math.sqrt(15) - 1) < 1e-8", word="load"),
    Statement("rod in space, three controls", """
def turning(t, x, w, p):
    return (-0.5 * (x.q1 * w.k1 + x.q2 * w.k2 + x.q3 * w.k3), 0.5 * (x.q0 * w.k1 + x.q2 * w.k3 - x.q3 * w.k2),
        0.5 * (x.q0 * w.k2 + x.q3 * w.k1 - x.q1 * w.k3), 0.5 * (x.q0 * w.k3 + x.q1 * w.k2 - x.q2 * w.k1))
def clamps(a, b, p):
    c, s = math.cos(p.turn / 2), math.sin(p.turn / 2)
    return a.q0 - 1, a.q1, a.q2, a.q3, c * b.q1 + s * b.q2, c * b.q2 - s * b.q1, c * b.q3 - s * b.q0
problem = contin.VariationalProblem(
    energy=lambda t, x, w, p: (w.k1**2 + w.k2**2 + p.C * w.k3**2) / 2, states=["q0", "q1", "q2", "q3"],
    parameters={"turn": 10.0, "C": 0.8}, kinematics=turning, controls=["k1", "k2", "k3"], ends=clamps,
    integrals={"sideways": lambda t, x, w, p: 2 * (x.q1 * x.q3 + x.q0 * x.q2),
        "across": lambda t, x, w, p: 2 * (x.q2 * x.q3 - x.q0 * x.q1)})
found = contin.solve(problem, lambda t: (math.cos(5 * t), 0, 0, math.sin(5 * t)))
""", "abs(found['energy'] - 40) < 1e-8", word="turn"),
    Statement("catenoid", """
problem = contin.VariationalProblem(
    energy=lambda t, x, w, p: x.r * math.sqrt(p.gap**2 + w.r**2), states=["r"], parameters={"gap": 0.8},
    ends=lambda a, b, p: (a.r - 1, b.r - 1))
found = contin.solve(problem, [1.0])
""", "abs(u(0.5)[0] * math.cosh(0.4 / u(0.5)[0]) - 1) < 1e-9", word="gap"),
    Statement("catenary of given length", """
def stretch(w, p):
    return math.sqrt(p.span**2 + w.y**2)
problem = contin.VariationalProblem(
    energy=lambda t, x, w, p: (x.y + p.height) * stretch(w, p), states=["y"],
    parameters={"span": 1.0, "length": 1.2, "height": 2.0}, ends=lambda a, b, p: (a.y, b.y),
    integrals={"length": lambda t, x, w, p: stretch(w, p) - p.length})
found = contin.solve(problem, lambda t: [-1.0 * t * (1 - t)])
""", "abs(u(0.5)[0] - CATENARY) < 1e-7", word="span"),
    Statement("geodesic on a hill", """
def height(x, p):
    return p.h * math.exp(-(x.x**2) - x.y**2)
def pace(t, x, w, p):
    climb = -2 * height(x, p) * (x.x * w.vx + x.y * w.vy)
    return (w.vx**2 + w.vy**2 + climb**2) / 2
problem = contin.VariationalProblem(
    energy=pace, states=["x", "y"], parameters={"h": 0.5}, kinematics=lambda t, x, w, p: (w.vx, w.vy), controls=["vx", "vy"],
    ends=lambda a, b, p: (a.x + 2, a.y - 0.5, b.x - 2, b.y - 0.5))
found = contin.solve(problem, lambda t: (4 * t - 2, 0.5 + 0.5 * math.sin(math.pi * t)))
""", "8 < found['energy'] < 8.6 and u(0.5)[1] > 0.5 and abs(u(0.5)[0]) < 1e-9", word="h"),
    Statement("Dido: area against length", """
problem = contin.VariationalProblem(
    energy=lambda t, x, w, p: math.sqrt(1 + w.y**2) * p.tension - x.y, states=["y"], parameters={"tension": 1.0},
    ends=lambda a, b, p: (a.y, b.y))
found = contin.solve(problem, lambda t: [0.5 * t * (1 - t)])
""", "abs(u(0.5)[0] - (1 - math.sqrt(0.75))) < 1e-9", word="tension"),
    Statement("bar with energy at its end", """
problem = contin.VariationalProblem(
    energy=lambda t, x, w, p: w.y**2 / 2 - p.weight * x.y, states=["y"], parameters={"weight": 1.0, "k": 2.0},
    ends=lambda a, b, p: (a.y,), end_energy=lambda a, b, p: p.k * b.y**2 / 2 + b.y**4 / 4)
found = contin.solve(problem, [0.1])
""", "abs(3 * u(1)[0] + u(1)[0] ** 3 - 0.5) < 1e-9", word="weight"),
    Statement("quartic energy, found by iteration", """
problem = contin.VariationalProblem(
    energy=lambda t, x, w, p: w.y**2 / 2 + w.y**4 / 4 - p.f * x.y, states=["y"], parameters={"f": 2.0},
    ends=lambda a, b, p: (a.y, b.y))
found = contin.solve(problem, lambda t: [t * (1 - t)])
""", "abs(u(0.5)[0] - QUARTIC) < 1e-8", word="f"),
    Statement("strip, two controls by iteration", """
def bending(t, x, w, p):
    return (w.k**2 + w.tau**2) / 2 + (w.k * w.tau) ** 2 / 4 + w.tau**4 / 4 - p.moment * x.angle - p.torque * x.twist
problem = contin.VariationalProblem(
    energy=bending, states=["angle", "twist"], parameters={"moment": 0.5, "torque": 0.2},
    kinematics=lambda t, x, w, p: (w.k, w.tau), controls=["k", "tau"],
    ends=lambda a, b, p: (a.angle, a.twist, b.angle - 1, b.twist))
found = contin.solve(problem, lambda t: (t, 0))
""", "abs(u(1)[0] - 1) < 1e-9 and u(0.5)[1] > 0 and u(0.5)[0] > 0.5", word="moment"),
)  # fmt: skip

LARGE = (
    Statement("ring of 40 states", """
def rhs(t, u, p, out):
    for i in range(20):
        coupling = 0.3 * (u[2 * ((i + 1) % 20)] - 2 * u[2 * i] + u[2 * i - 2])
        out[2 * i] = u[2 * i + 1]
        out[2 * i + 1] = coupling - p[0] * math.sin(u[2 * i]) + 0.2 * math.cos(3 * t + i)
def boundary(a, b, p, out):
    for i in range(20):
        out[2 * i], out[2 * i + 1] = a[2 * i], b[2 * i] - 0.1
problem = contin.BoundaryValueProblem(rhs, boundary, 40, {"lam": 0.5}, boundary_count=40)
found = contin.solve(problem, [0.0] * 40)
""", "np.allclose(u(1)[::2], 0.1, atol=1e-9)"),
    Statement("1,000 states as arrays", """
def residual(u, p):
    return 100 * (np.roll(u, 1) + np.roll(u, -1) - 2 * u) + p.lam - u**3
problem = contin.AlgebraicProblem(residual, 1000, {"lam": 8.0})
found = contin.solve(problem, list(2 + 0.1 * np.sin(np.arange(1000))))
""", "np.allclose(found.x[:1000], 2, atol=1e-9)"),
    Statement("eight segments", """
def rhs(number):
    return lambda s, u, p: (u.v, -p.lam * math.exp(u.u) * (1 + 0.1 * number))
def joints(a, b, p):
    inner = [c for i in range(7) for c in (b[i].u - a[i + 1].u, b[i].v - a[i + 1].v)]
    return (a[0].u, *inner, b[7].u)
problem = contin.SegmentedProblem([contin.Segment(rhs(i), ["u", "v"], length=0.125) for i in range(8)], joints, {"lam": 0.5})
found = contin.solve(problem, [0.0] * 16)
""", "abs(found.segment(3)['u'][-1] - SEGMENTS) < 1e-4"),
    Statement("functional of 225 states", """
side = 15
def residual(u, p, out):
    for i in range(side):
        for j in range(side):
            total = -4 * u[side * i + j]
            if i > 0:
                total += u[side * (i - 1) + j]
            if i < side - 1:
                total += u[side * (i + 1) + j]
            if j > 0:
                total += u[side * i + j - 1]
            if j < side - 1:
                total += u[side * i + j + 1]
            out[side * i + j] = 256 * total + p[0] * math.exp(u[side * i + j])
def mean(u, p):
    total = 0.0
    for x in u:
        total += x
    return total / 225
problem = contin.AlgebraicProblem(residual, 225, {"lam": 1.0}, functionals={"mean": mean})
found = contin.solve(problem, [0.0] * 225)
found["mean"]
""", "abs(found['mean'] - np.mean(found.x[:225])) < 1e-12 and 0.03 < found['mean'] < 0.06"),
)  # fmt: skip
