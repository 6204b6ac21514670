"""Corners and jumps that states decide become mesh points that move with the solution.

Known values: integration from switch to switch with DOP853 at 1e-13 (SciPy), and closed forms.
"""

import math

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp
from scipy.optimize import brentq, fsolve, minimize_scalar

import contin
from contin import BoundaryValueProblem, CycleProblem
from contin.collocation import corners as switching
from contin.collocation.corners import selections
from contin.collocation.defect import split
from contin.collocation.mesh import MeshControl, basis, moved_to_breaks
from contin.errors import InterpretedWarning


def flow(field, jacobian, level, y, end):
    """The state at the end, and its derivative by the first one; ``field(t, y, above)`` is smooth with ``above`` as given.

    The field is continuous, so that the derivative has no jump where y[0] passes the level.
    """
    t, n, above = 0.0, len(y), y[0] > level
    both = np.append(y, np.eye(n).ravel())
    for _ in range(60):

        def rates(t, both, above=above):
            return np.append(field(t, both[:n], above), (jacobian(above) @ both[n:].reshape(n, n)).ravel())

        def passes(t, both):
            return both[0] - level

        passes.terminal, passes.direction = True, -1 if above else 1
        found = solve_ivp(rates, (t, end), both, method="DOP853", rtol=1e-13, atol=1e-14, events=passes)
        t, both, above = found.t[-1], found.y[:, -1], not above
        if found.status == 0:
            break
    return both[:n], both[n:].reshape(n, n)


# --- one solution: conditions of all kinds -----------------------------------------------------------------------------------

LAWS = {
    "abs": (lambda u: 1 + 3 * abs(u - 0.1), [0.1]),
    "clip": (lambda u: 1 + 4 * np.clip(u, 0.1, 0.4), [0.1, 0.4]),
    "smoother": (lambda u: 1 + np.where(u > 0.2, 20 * (u - 0.2) ** 2, 0.0), [0.2]),
    "table": (lambda u: np.interp(u, [0, 0.1, 0.2, 0.9], [1, 1.5, 1.2, 2]), [0.1, 0.2]),
    "pieces": (lambda u: 1.0 if u < 0.1 else (1 + 5 * (u - 0.1) if u < 0.25 else 1.75), [0.1, 0.25]),
    "maximum": (lambda u: 2 + max(0, u - 0.2) - min(0.35, u), [0.2, 0.35]),
}


def loaded(law):
    """u'' + q law(u) = 0, u(0) = u(1) = 0."""
    return BoundaryValueProblem(lambda t, u, p: (u.v, -p.q * law(u.u)), lambda a, b, p: (a.u, b.u), ["u", "v"], {"q": 2.0})


def slope_at_start(law, levels, near, q=2.0):
    """u'(0) close to a value: u goes up from level to level, and is largest at t = 1/2."""

    def late(first):
        t, y = 0.0, np.array([0.0, first])
        for level in [*levels, np.inf]:
            stops = [lambda t, y: y[1], lambda t, y, level=min(level, 1e9): y[0] - level]
            for stop in stops:
                stop.terminal = True

            def rates(t, y, level=level):  # the law on this side of the level
                return y[1], -q * float(law(min(y[0], np.nextafter(level, 0))))

            found = solve_ivp(rates, (t, 5.0), y, method="DOP853", rtol=1e-13, atol=1e-15, events=stops)
            t, y = found.t[-1], found.y[:, -1]
            if found.t_events[0].size:
                break
        return t - 0.5

    return brentq(late, near - 0.02, near + 0.02, xtol=1e-14)


@pytest.mark.sample(2)
@pytest.mark.parametrize("name", LAWS)
@pytest.mark.parametrize("degree", [3, 7])
def test_conditions_on_a_state(name, degree):
    law, levels = LAWS[name]
    point = contin.solve(loaded(law), lambda t: (2 * t * (1 - t), 2 - 4 * t), degree=degree)
    found = point.system.switching(point.x)
    near = np.abs(point.system.mesh[:, None] - found.places).min(axis=0)
    assert near.size and near.max() < 1e-6
    assert not found.jumps.any()
    first = point.system.states(point.x)[0, 1]
    assert first == pytest.approx(slope_at_start(law, levels, first), abs=5e-12)


# --- branches ----------------------------------------------------------------------------------------------------------------


def corner(max_of=max):
    """u'' + q (exp(u) + 8 max(0, u - 1/2)) = 0, u(0) = u(1) = 0: the fold comes right after u reaches 1/2."""
    return BoundaryValueProblem(
        lambda t, u, p: (u.v, -p.q * (np.exp(u.u) + 8 * max_of(0, u.u - 0.5))),
        lambda a, b, p: (a.u, b.u),
        ["u", "v"],
        {"q": 0.3},
    )


def load_of(largest):
    """q of the solution with this largest value, by the time that it takes from there to 0 with q = 1."""
    t, y = 0.0, np.array([largest, 0.0])
    for level, slope in ((0.5, 8.0), (0.0, 0.0)):

        def passes(t, y, level=level):
            return y[0] - level

        passes.terminal = True
        found = solve_ivp(
            lambda t, y, slope=slope: (y[1], -np.exp(y[0]) - slope * (y[0] - 0.5)), (t, 3.0), y, method="DOP853", rtol=1e-13,
            atol=1e-14, events=passes,
        )  # fmt: skip
        t, y = found.t[-1], found.y[:, -1]
    return (2 * t) ** 2


@pytest.mark.full
@pytest.mark.parametrize("degree", [3, 6])
def test_a_fold_close_behind_the_first_contact(degree):
    known = -minimize_scalar(lambda m: -load_of(m), bounds=(0.501, 0.53), method="bounded", options={"xatol": 1e-9}).fun
    branch = contin.trace(contin.solve(corner(), [0, 0], degree=degree), free=["q"], limits={"q": (0.1, 5)})
    (fold,) = branch.labelled("LP")
    assert abs(fold["q"] - known) <= fold.errors["q"] + 5e-14 < 1e-12
    assert max(point.discretization_error for point in branch.points) < 1e-12
    assert not branch.notes
    assert branch.points[-1].system.intervals < 500  # 2000, the most there may be, before


def oscillator(t, y, above, w):
    return np.array([y[1], -0.1 * y[1] - y[0] - 5 * above * (y[0] - 1) + np.cos(w * t)])


@pytest.mark.full
def test_folds_of_an_oscillator_with_a_spring_at_a_distance():
    """x'' + x' / 10 + x + 5 max(0, x - 1) = cos(w t): both folds are zeros of the period map less 1 and of det(Dmap - 1)."""

    def conditions(z):
        end, matrix = flow(
            lambda t, y, above: oscillator(t, y, above, z[2]), lambda above: np.array([[0, 1], [-1 - 5 * above, -0.1]]), 1.0,
            z[:2], 2 * np.pi / z[2],
        )  # fmt: skip
        return np.append(end - z[:2], np.linalg.det(matrix - np.eye(2)))

    problem = CycleProblem(
        lambda t, u, p: (u.v, -u.v / 10 - u.x - 5 * max(0, u.x - 1) + np.cos(p.w * t)), ["x", "v"], {"w": 2.2},
        period=lambda p: 2 * np.pi / p.w,
    )  # fmt: skip
    start = contin.solve(problem, lambda t: (-0.26 * np.cos(2 * np.pi * t), 0.57 * np.sin(2 * np.pi * t)))
    branch = contin.trace(start, free=["w"], limits={"w": (0.7, 2.3)}, direction=-1)
    folds = branch.labelled("LP")
    assert len(folds) == 2
    for fold in folds:
        known = fsolve(conditions, [*fold.system.states(fold.x)[0], fold["w"]], xtol=1e-12)
        assert abs(fold["w"] - known[2]) <= fold.errors["w"] + 2e-12
    assert max(point.discretization_error for point in branch.points) < 5e-12  # the tolerance, or round-off beside folds


@pytest.mark.full
def test_period_doubling_of_chuas_circuit():
    """Chua's diode is piecewise linear: the doubled cycle is a zero of the period map less 1 and of det(Dmap + 1)."""
    outer, inner = -5 / 7, -8 / 7

    def field(y, alpha, above):
        diode = outer * y[0] + (inner - outer) if above else inner * y[0]
        return np.array([alpha * (y[1] - y[0] - diode), y[0] - y[1] + y[2], -15 * y[1]])

    def conditions(z):
        y, period, alpha = np.array([z[0], first[1], z[1]]), z[2], z[3]

        def jacobian(above):
            return np.array([[-alpha * (1 + (outer if above else inner)), alpha, 0], [1, -1, 1], [0, -15, 0]])

        end, matrix = flow(lambda t, y, above: field(y, alpha, above), jacobian, 1.0, y, period)
        return np.append(end - y, np.linalg.det(matrix + np.eye(3)))

    def rhs(u, p):
        diode = outer * u.x + (inner - outer) / 2 * (abs(u.x + 1) - abs(u.x - 1))
        return p.alpha * (u.y - u.x - diode), u.x - u.y + u.z, -15 * u.y

    long = solve_ivp(
        lambda t, y: field(y, 8.0, y[0] > 1), (0, 400), [1.6, 0.1, -1.4], rtol=1e-10, atol=1e-10, dense_output=True
    ).sol  # it stays on the positive side
    times = 397 - 2.1419 * np.linspace(1, 0, 201)
    states = long(times).T
    states[-1] = states[0]
    problem = CycleProblem(rhs, ["x", "y", "z"], {"alpha": 8.0})
    start = contin.solve(problem, (np.linspace(0, 1, 201), states), {"period": 2.1419})
    branch = contin.trace(start, free=["alpha"], limits={"alpha": (7.9, 8.8)})
    (doubling,) = branch.labelled("PD")
    first = doubling.system.states(doubling.x)[0]
    known = fsolve(conditions, [first[0], first[2], doubling["period"], doubling["alpha"]], xtol=1e-12)
    assert abs(doubling["alpha"] - known[3]) <= doubling.errors["alpha"] + 1e-11
    assert doubling.errors["alpha"] < 1e-11


def test_a_beam_on_a_foundation_that_does_not_pull():
    """w^(4) + P w'' + 500 max(0, w) = 100 sin(3 pi t), hinged ends, by integration from contact to contact."""
    beam = BoundaryValueProblem(
        lambda t, u, p: (u.a, u.m, u.s, -p.P * u.m - 500 * np.maximum(0, u.w) + 100 * np.sin(3 * np.pi * t)),
        lambda a, b, p: (a.w, a.m, b.w, b.m), ["w", "a", "m", "s"], {"P": 0.0},
    )  # fmt: skip
    branch = contin.trace(contin.solve(beam, [0, 0, 0, 0]), free=["P"], limits={"P": (0, 6)})
    last = branch.points[-1]

    def field(t, y, above):
        return np.array([y[1], y[2], y[3], -6 * y[2] - 500 * above * y[0] + 100 * np.sin(3 * np.pi * t)])

    def jacobian(above):
        return np.array([[0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1], [-500 * above, 0, -6, 0]])

    def ends(z):
        return flow(field, jacobian, 0.0, np.array([1e-300, z[0], 0, z[1]]), 1.0)[0][[0, 2]]

    first = last.system.states(last.x)[0]
    known = fsolve(ends, first[[1, 3]], xtol=1e-12)
    assert len(last.system.switching(last.x).places) == 2
    assert first[[1, 3]] == pytest.approx(known, abs=1e-11)
    assert max(point.discretization_error for point in branch.points) < 1e-12


# --- what mesh points do not help --------------------------------------------------------------------------------------------


@pytest.mark.full
def test_dry_friction():
    """x'' + x + .3 sign(x') = cos(w t): the largest x by Den Hartog (1930)."""
    problem = CycleProblem(
        lambda t, u, p: (u.v, -u.x - 0.3 * np.sign(u.v) + np.cos(p.w * t)), ["x", "v"], {"w": 1.3},
        period=lambda p: 2 * np.pi / p.w,
    )  # fmt: skip
    start = contin.solve(problem, lambda t: (-1.2 * np.cos(2 * np.pi * t), 1.6 * np.sin(2 * np.pi * t)))
    branch = contin.trace(start, free=["w"], limits={"w": (1.1, 1.35)}, direction=-1)
    for point in branch.points:
        w = point["w"]
        friction = 0.3 * np.sin(np.pi / w) / (w * (1 + np.cos(np.pi / w)))
        known = np.sqrt(1 / (1 - w**2) ** 2 - friction**2)
        assert abs(point["max_x"] - known) <= 1e-10 * known
    assert not branch.notes


def test_a_fold_on_a_jump():
    """u'' + q exp(u) (1 or .97), by quadrature: the half length 1 / 2 is the time from 0 to the largest u, M, with u'(M) = 0.

    Where M comes down to the threshold .5 there are no more jumps.
    """
    problem = BoundaryValueProblem(
        lambda t, u, p: (u.v, -p.q * np.exp(u.u) * (0.97 if u.u > 0.5 else 1.0)),
        lambda a, b, p: (a.u, b.u),
        ["u", "v"],
        {"q": 0.3},
    )
    start = contin.solve(problem, lambda t: (12 * t * (1 - t), 12 - 24 * t), {"q": 2.5})
    branch = contin.trace(start, free=["q"], limits={"q": (0.5, 5)}, max_points=40)
    (fold,) = branch.labelled("LP")

    def q_of(m):
        def above(s):
            return 2 / math.sqrt(1.94 * math.exp(m) * (-math.expm1(-s * s) / s**2 if s else 1))

        energy = 1.94 * (math.exp(m) - math.exp(0.5))
        below = quad(lambda u: 1 / math.sqrt(energy + 2 * (math.exp(0.5) - math.exp(u))), 0, 0.5, epsabs=1e-13)[0]
        return 4 * (quad(above, 0, math.sqrt(m - 0.5), epsabs=1e-13)[0] + below) ** 2

    largest = fold.system.evaluate(fold.x, np.array([0.5]))[0, 0]
    assert abs(q_of(largest) - fold["q"]) < 1e-11
    assert q_of(largest + 1e-3) < fold["q"] and q_of(largest - 1e-3) < fold["q"]
    (touch,) = branch.labelled("GR")
    assert abs(touch["q"] - q_of(0.5)) < 1e-11 and branch[-1]["q"] == 0.5 and not branch.notes


def test_a_mesh_that_is_kept():
    """With every=0 the corner stays inside an interval; the estimated error is that of the slope u'(0) within a factor of 3."""
    law, levels = LAWS["abs"]
    control = MeshControl(every=0)
    start = contin.solve(loaded(law), lambda t: (2 * t * (1 - t), 2 - 4 * t), degree=4, intervals=11, mesh=control)
    branch = contin.trace(start, free=["q"], limits={"q": (1.5, 2.5)}, mesh=control)
    for point in branch.points[1:-1:3]:
        first = point.system.states(point.x)[0, 1]
        error = abs(first - slope_at_start(law, levels, first, point["q"])) / (1 + first)
        assert error <= 3 * point.discretization_error + 1e-12
        assert point.discretization_error < 1e-2
    assert max(point.discretization_error for point in branch.points[1:]) > 1e-7


def test_smooth_selections_are_no_corners():
    """A series near 0 that is joined to a closed form."""

    def ratio(x):
        return 1 - x**2 / 6 + x**4 / 120 - x**6 / 5040 if abs(x) < 0.02 else np.sin(x) / x

    problem = BoundaryValueProblem(
        lambda t, u, p: (u.v, -p.q * ratio(u.u - 0.1)), lambda a, b, p: (a.u, b.u), ["u", "v"], {"q": 2.0}
    )
    point = contin.solve(problem, lambda t: (t * (1 - t), 1 - 2 * t))
    found = point.system.switching(point.x)
    assert selections(point.system.problem.batch("field")) is not None
    assert not len(found.places) or found.settled.all()  # mesh points at most
    assert not found.jumps.any()


def test_the_place_of_a_smooth_selection_is_not_sought(monkeypatch):
    """That takes most of the time of a point of a branch. The places of a corner are sought."""
    sought, narrowed = [], switching.narrowed

    def counted(sides, a, b, which):
        sought.append(a.size)
        return narrowed(sides, a, b, which)

    def sine(x):  # the next term of the series is 1e-32 where they are joined
        return x - x**3 / 6 + x**5 / 120 - x**7 / 5040 + x**9 / 362880 - x**11 / 39916800 if x < 0.02 else math.sin(x)

    monkeypatch.setattr(switching, "narrowed", counted)
    for law, passes in ((sine, []), (lambda x: sine(x) + max(0, x - 0.1), [2])):
        problem = BoundaryValueProblem(
            lambda t, u, p, law=law: (u.v, -p.q - law(u.u)), lambda a, b, p: (a.u, b.u), ["u", "v"], {"q": 1.0}
        )
        solution = contin.solve(problem, lambda t: (t * (1 - t) / 2, 0.5 - t))
        sought.clear()
        assert len(solution.system.switching(solution.x * (1 + 1e-9)).places) == sum(passes)
        assert sought == passes


def test_a_point_is_looked_at_once():
    """A run asks for the places of a point several times; other points and other meshes are looked at anew."""
    law, levels = LAWS["maximum"]
    point = contin.solve(loaded(law), lambda t: (t * (1 - t), 1 - 2 * t))
    system, x = point.system, point.x
    first = system.switching(x)
    assert system.switching(x.copy()) is first
    moved = system.switching(x * 1.01)
    assert moved is not first and not np.array_equal(moved.places, first.places)
    assert system.switching(x) is first
    finer, carry = system.refined()
    assert finer.switching(carry(x)).places == pytest.approx(first.places, abs=1e-6)


@pytest.mark.full
def test_a_corner_in_python():
    """A function that cannot be recorded has corners that nobody sees: where it is named, that is said."""
    problem = BoundaryValueProblem(
        lambda t, u, p: (u.v, -p.q * (np.exp(u.u) - max(0.0, float(str(u.u - 0.3))) / 2)), lambda a, b, p: (a.u, b.u),
        ["u", "v"], {"q": 0.3},
    )  # fmt: skip
    with pytest.warns(InterpretedWarning, match="corners and jumps in it are not seen, and errors beside them are larger"):
        point = contin.solve(problem, [0, 0], degree=3)
    assert not len(point.system.switching(point.x).places)


def test_parts():
    assert moved_to_breaks(np.linspace(0, 1, 5), np.array([0.4])) == pytest.approx([0, 0.2, 0.4, 0.7, 1])
    points, projection = split(3, np.array([0.0, 0.3, 1.0]))
    values = np.where(points < 0.3, points**2, 2 * points - points**2)
    exact = 0.3**3 / 3 + (1 - 1 / 3) - (0.3**2 - 0.3**3 / 3)
    assert basis(3).weights @ (projection @ values) == pytest.approx(exact, abs=1e-15)
