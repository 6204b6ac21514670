"""Jumps and corners in time become mesh points: solutions are as exact as without them.

Known values: shooting piece by piece with DOP853 at 1e-13 (SciPy), and closed forms.
"""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import contin
from contin import BoundaryValueProblem, CycleProblem, VariationalProblem
from contin.collocation.corners import breaks_of
from contin.collocation.mesh import MeshControl, adapted_mesh, basis, with_breaks
from contin.errors import InterpretedWarning
from contin.lowlevel import Batch

CASES = {
    "jump": (lambda t: 3.0 if t < 0.4 else 1.0, [0.4]),
    "corner": (lambda t: 1 + abs(t - 0.3), [0.3]),
    "narrow": (lambda t: 1 + 50 * (abs(t - 0.377) < 0.01), [0.367, 0.377, 0.387]),
    "ramp": (lambda t: 1 + max(0, t - 1 / 3), [1 / 3]),
    "stairs": (lambda t: 1.0 + np.floor(5 * t), [0.2, 0.4, 0.6, 0.8]),
    "table": (lambda t: np.interp(t, [0, 0.2, 0.55, 1], [1, 4, 2, 3]), [0.2, 0.55]),
    "saw": (lambda t: 1 + (4 * t) % 1, [0.25, 0.5, 0.75]),
    "window": (lambda t: np.where((t > 0.25) & (t <= 0.7), 2.0, 1.0), [0.25, 0.7]),
}


def bratu(load):
    """u'' + q load(t) exp(u) = 0, u(0) = u(1) = 0."""
    return BoundaryValueProblem(
        lambda t, u, p: (u.v, -p.q * load(t) * np.exp(u.u)), lambda a, b, p: (a.u, b.u), ["u", "v"], {"q": 0.6}
    )


def slope(load, breaks, q=0.6):
    """The slope u'(0) of the lower solution, by shooting from break to break."""

    def end(first):
        y, ends = [0.0, first], [0.0, *breaks, 1.0]
        for a, b in zip(ends, ends[1:]):
            inside = (b - a) * 1e-12

            def rates(t, y, low=a + inside, high=b - inside):
                return y[1], -q * load(min(max(t, low), high)) * np.exp(y[0])

            y = solve_ivp(rates, (a, b), y, method="DOP853", rtol=1e-13, atol=1e-14).y[:, -1]
        return y[0]

    return brentq(end, 0, 1.2, xtol=1e-14)


@pytest.mark.sample(4)
@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("degree", [2, 4])
def test_a_coefficient_that_jumps(name, degree):
    load, breaks = CASES[name]
    point = contin.solve(bratu(load), [0, 0], degree=degree, intervals=40)
    assert point.system.breaks == pytest.approx(breaks, abs=1e-12)
    near = np.abs(point.system.mesh[:, None] - breaks).min(axis=0)
    assert near.max() < 1e-12
    assert point.system.evaluate(point.x, np.zeros(1))[0, 1] == pytest.approx(slope(load, breaks), abs=1e-10)


def test_a_fold_and_its_error():
    """A load of 3 up to t = .4: the fold of a degree and of one higher agree within the errors that they state."""
    folds = []
    for degree in (3, 6):
        start = contin.solve(bratu(CASES["jump"][0]), [0, 0], degree=degree)
        branch = contin.trace(start, free=["q"], limits={"q": (0.1, 5)})
        folds.append(branch.labelled("LP")[0])
        assert all(np.abs(point.system.mesh - 0.4).min() < 1e-12 for point in branch.points[1:])
    first, second = folds
    assert abs(first["q"] - second["q"]) <= first.errors["q"] + second.errors["q"] + 1e-13


def test_a_column_of_two_thicknesses():
    """Bending stiffness 4 up to t = .4, then 1; clamped, free end: tan(.2 s) tan(.6 s) = 2 with s^2 = P (closed form)."""
    column = VariationalProblem(
        energy=lambda t, u, w, p: (4.0 if t < 0.4 else 1.0) * w.k**2 / 2 + p.P * np.cos(u.th),
        kinematics=lambda t, u, w, p: (w.k,), states=["th"], controls=["k"], parameters={"P": 1.0},
        ends=lambda a, b, p: (a.th,),
    )  # fmt: skip
    branch = contin.trace(contin.solve(column, [0.0]), free=["P"], limits={"P": (0.1, 30)})
    known = brentq(lambda s: np.tan(0.2 * s) * np.tan(0.6 * s) - 2, 1, 2.6, xtol=1e-15) ** 2
    (point,) = branch.labelled("BP")
    assert abs(point["P"] - known) <= point.errors["P"] < 1e-12


def test_breaks_that_a_parameter_moves_are_no_breaks():
    """t < a with a free: the mesh cannot follow a while a is an unknown. With a held, it is a break."""
    problem = BoundaryValueProblem(
        lambda t, u, p: (u.v, -p.q * (3.0 if t < p.a else 1.0)), lambda a, b, p: (a.u, b.u), ["u", "v"], {"q": 1.0, "a": 0.35}
    )
    point = contin.solve(problem, [0, 0])
    assert point.system.breaks == pytest.approx([0.35], abs=1e-14)
    assert point.system.with_free(["a"], point.x)[0].breaks.size == 0
    assert point.system.with_parameters({"a": 0.6}).breaks == pytest.approx([0.6], abs=1e-14)


def test_functionals_count_and_states_do_not():
    problem = BoundaryValueProblem(
        lambda t, u, p: (u.v, -p.q * (2.0 if u.u > 0.01 else 1.0)), lambda a, b, p: (a.u, b.u), ["u", "v"], {"q": 1.0},
        functionals={"left": lambda t, u, p: u.u if t < 0.123 else 0.0},
    )  # fmt: skip
    assert contin.solve(problem, [0, 0]).system.breaks == pytest.approx([0.123], abs=1e-14)
    linear = BoundaryValueProblem(
        lambda t, u, p: (u.v, -p.q), lambda a, b, p: (a.u, b.u), ["u", "v"], {"q": 2.0},
        functionals={"left": lambda t, u, p: u.u if t < 0.123 else 0.0},
    )  # fmt: skip
    known = 0.123**2 / 2 - 0.123**3 / 3  # u = t (1 - t)
    assert contin.solve(linear, [0, 0])["left"] == pytest.approx(known, abs=1e-15)


def test_square_waves():
    """x' = -x + sign(sin(w t)): the cycle goes up to tanh(T / 4). The break, half a period, stands still in scaled time."""
    problem = CycleProblem(
        lambda t, u, p: (-u.x + np.sign(np.sin(p.w * t)),), ["x"], {"w": 2.0}, period=lambda p: 2 * np.pi / p.w
    )
    point = contin.solve(problem, lambda t: (0.1 * np.sin(2 * np.pi * t),))
    assert point["max_x"] == pytest.approx(np.tanh(np.pi / 4), abs=1e-13)
    last = contin.trace(point, free=["w"], limits={"w": (1, 6)}).points[-1]
    assert last["max_x"] == pytest.approx(np.tanh(np.pi / 12), abs=1e-12)
    assert last.system.breaks == pytest.approx([0.5], abs=1e-12)


def test_meshes_with_breaks():
    mesh = np.linspace(0, 1, 6)
    assert with_breaks(mesh, np.array([0.41, 0.47])) == pytest.approx([0, 0.2, 0.41, 0.47, 0.8, 1])
    assert with_breaks(np.array([0.0, 1.0]), np.array([0.3])) == pytest.approx([0, 1])
    # a solution with a jump of its slope at a break: a polynomial on both sides, so that nothing needs refining
    rule, mesh = basis(4), with_breaks(np.linspace(0, 1, 9), np.array([0.4]))
    nodes = np.append((mesh[:-1, None] + np.diff(mesh)[:, None] * rule.nodes[:-1]).ravel(), 1)
    states = np.where(nodes < 0.4, nodes, 0.4 + 3 * (nodes - 0.4) ** 2 + 5 * (nodes - 0.4))[:, None]
    assert adapted_mesh(rule, mesh, states, MeshControl(min_intervals=8), np.array([0.4])) is None
    found = adapted_mesh(rule, np.linspace(0, 1, 9), states, MeshControl(min_intervals=8), np.array([0.4]))
    assert np.abs(found - 0.4).min() == 0


def test_a_function_in_python_has_no_switches():
    with pytest.warns(InterpretedWarning):
        batch = Batch([lambda t, u, p: float(str(u.x)) * (t < 0.5)], [0], ["x"], [])
        batch.jacobian(np.zeros(1), np.ones((1, 1)), np.empty((0, 1)), np.empty(0), batch.columns([]))
    assert breaks_of(batch, (0, 1), np.empty(0)).size == 0
