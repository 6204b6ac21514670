"""The estimated discretization error of every point against closed forms, and that no stored point is much worse than asked."""

import math

import numpy as np
import pytest
from scipy.optimize import brentq

import contin
from bank.closed_forms import bratu, bratu_fold, bratu_load, bratu_mean
from contin.core.newton import correct

#: A layer of this width at t = c.
WIDTH = 0.02
LAYER = contin.BoundaryValueProblem(
    lambda t, u, p: (1 / (p.w * math.cosh((t - p.c) / p.w) ** 2),), lambda a, b, p: (a.u - math.tanh(-p.c / p.w),), ["u"],
    {"c": 0.2, "w": WIDTH}, functionals={"mean": lambda t, u, p: u.u, "square": lambda t, u, p: u.u**2},
)  # fmt: skip


def layer_error(point):
    """Return the errors of states at mesh points, and of two integrals, of u = tanh((t - c) / w)."""
    mesh, c = point.system.mesh, point["c"]
    states = point.system.states(point.x)[:: point.system.degree, 0]
    mean = WIDTH * (math.log(math.cosh((1 - c) / WIDTH)) - math.log(math.cosh(c / WIDTH)))
    square = 1 - WIDTH * (math.tanh((1 - c) / WIDTH) + math.tanh(c / WIDTH))
    return max(np.abs(states - np.tanh((mesh - c) / WIDTH)).max(), abs(point["mean"] - mean), abs(point["square"] - square))


@pytest.mark.sample(1)
@pytest.mark.parametrize(("degree", "tolerance"), [(4, 1e-7), (4, 1e-10), (6, 1e-10), (7, 1e-12)])
def test_a_layer_that_leaves_its_mesh_behind(degree, tolerance):
    """The mesh is looked at every 40 steps only, while the layer moves: each point is good enough in itself.

    Without the check of each point, the errors were 5.6e-3, 9.8e-5, 3.1e-4 and 3.3e-5.
    """
    control = contin.MeshControl(tolerance=tolerance, every=40)
    start = contin.solve(LAYER, [0.0], degree=degree, mesh=control)
    branch = contin.trace(start, free=["c"], limits={"c": (0.1, 0.8)}, step=0.5, mesh=control)
    assert branch.stop.reason == "limit" and not branch.notes
    for point in branch:
        assert layer_error(point) < 3 * tolerance + 1e-13
        assert point.discretization_error < tolerance or point.label


def test_points_between_labelled_ones_may_be_less_exact():
    """A layer has fewer intervals then; a value that is asked for, and both ends, are as exact as ever: closed form."""
    start, asked = contin.solve(LAYER, [0.0], degree=4), {"c": [0.45]}
    both = [contin.trace(start, free=["c"], limits={"c": (0.1, 0.8)}, zeros=asked, step=0.1, path_tolerance=path)
            for path in (1e-8, None)]  # fmt: skip
    coarse, fine = ([point for point in branch if not point.label] for branch in both)
    assert max(map(layer_error, coarse)) < 3e-8 and max(point.discretization_error for point in coarse) < 1e-8
    assert 2 * np.mean([each.system.intervals for each in coarse]) < np.mean([each.system.intervals for each in fine])
    assert max(layer_error(point) for branch in both for point in branch if point.label) < 1e-11
    assert [point.label for point in both[0] if point.label] == ["EP", "UZ", "EP"]


@pytest.mark.parametrize("path", [1e-5, 1e-8])
def test_errors_of_labelled_points_on_a_path_that_is_less_exact(path):
    """The fold of Bratu's problem, and loads where its mean has values that are asked for, are within their ±: closed forms."""
    start, asked = contin.solve(bratu(), [0, 0], degree=4), [0.5, 2.0, 6.0, 12.0]
    limits = {"lam": (-1, 4), "mean": (-1, 14)}
    branch = contin.trace(start, free=["lam"], limits=limits, zeros={"mean": asked}, path_tolerance=path)
    exact = [bratu_fold(), *(bratu_load(brentq(lambda s, m=mean: bratu_mean(s) - m, 1e-3, 50, xtol=1e-15)) for mean in asked)]
    found = [*branch.labelled("LP"), *branch.labelled("UZ")]
    for point, load in zip(found, exact, strict=True):
        assert abs(point["lam"] - load) <= point.errors["lam"] + 1e-14 < 2e-12


def wave(u, p):
    """Reaction waves in a membrane, u(x - c t): AUTO's demo ``wav``."""
    rate = u.y / (3.4 + u.y) * u.x / (1 + u.x + 0.023 * u.x**2)
    f1, f2 = -3 * (210 * rate - (145 - u.x)), -3 * (210 * rate - 0.2 * (p.s - u.y))
    return u.v, u.w, -(0.05 * u.v + f1), -(0.05 * u.w + f2) / 5


def test_errors_of_multipliers_of_steep_waves():
    """A doubling where s stands still within 1e-4, on about half the intervals, lies within its ± of that on a fine path.

    Taken from the order h^(2 d), which these multipliers have not reached there, its ± was 45 times too small.
    """
    problem = contin.AlgebraicProblem(wave, ["x", "y", "v", "w"], {"s": 640.0})
    rest = contin.trace(contin.solve(problem, [62.8, 88.8, 0.0, 0.0]), free=["s"], limits={"s": (500, 800)}, direction="both")
    start, limits = rest.labelled("HB")[0], {"s": (600, 700), "period": (0, 36)}
    last = [contin.trace(start, branch=1, limits=limits, path_tolerance=path).labelled("PD")[-1] for path in (1e-6, None)]
    assert 35 < last[0]["period"] < 36 and 1.5 * last[0].system.intervals < last[1].system.intervals
    for name in ("s", "period"):
        assert abs(last[0][name] - last[1][name]) < last[0].errors[name] + last[1].errors[name]


@pytest.mark.sample(2)
@pytest.mark.parametrize(("degree", "intervals"), [(2, 100), (3, 60), (4, 40), (4, 100), (5, 40), (7, 30)])
def test_the_estimate_on_a_mesh_that_is_kept(degree, intervals):
    """Without adaptation the errors are large, and stated: neither too small, nor too large by much.

    The estimate includes the rates, whose errors are larger by up to 50 at some places of the layer between mesh points.
    """
    control = contin.MeshControl(every=0)
    start = contin.solve(LAYER, [0.0], degree=degree, intervals=intervals, mesh=control)
    branch = contin.trace(start, free=["c"], limits={"c": (0.1, 0.8)}, step=0.5, mesh=control)
    errors = np.array([(point.discretization_error, layer_error(point)) for point in branch])
    ratios = errors[:, 0] / errors[:, 1]
    ratios = ratios[errors[:, 1] > 1e-12]  # others are round-off
    assert ratios.min() > 0.3 and np.median(ratios) < 3 and ratios.max() < 150


@pytest.mark.parametrize("degree", [2, 3, 4, 6])
def test_the_estimate_of_a_linear_equation_with_constant_coefficients(degree):
    """Of u'' = -k u the defect at the Gauss points of one degree more vanishes but for one Legendre polynomial.

    The estimate is within 2 % of the error of states and rates at the mesh points where that is small and no round-off.
    """
    swing = contin.BoundaryValueProblem(
        lambda t, u, p: (u.v, -p.k * u.u), lambda a, b, p: (a.u, a.v - 1), ["u", "v"], {"k": 9.0}
    )
    control = contin.MeshControl(every=0)
    start = contin.solve(swing, [0.0, 1.0], degree=degree, intervals=10, mesh=control)
    ratios = []
    for point in contin.trace(start, free=["k"], limits={"k": (9, 400)}, mesh=control):
        w, t, u = math.sqrt(point["k"]), point.system.mesh, point.system.states(point.x)[::degree]
        states = np.column_stack([np.sin(w * t) / w, np.cos(w * t)])
        rates, found = np.column_stack([states[:, 1], -w * w * states[:, 0]]), np.column_stack([u[:, 1], -w * w * u[:, 0]])
        error = max(
            (np.abs(u - states) / (1 + np.abs(states))).max(),
            (np.abs(found - rates).max(axis=0) / (1 + np.abs(rates).max(axis=0))).max(),
        )
        if 1e-11 < error < 1e-3:
            ratios.append(point.discretization_error / error)
    assert len(ratios) > 5 and min(ratios) > 0.95 and max(ratios) < 1.05


def test_the_integral_of_a_function_that_changes_faster_than_the_solution():
    """u = a exactly on every mesh; the mean of sin(40 a t) is not."""
    problem = contin.BoundaryValueProblem(
        lambda t, u, p: (0 * u.u,), lambda a, b, p: (a.u - p.a,), ["u"], {"a": 1.0},
        functionals={"mean": lambda t, u, p: math.sin(40 * u.u * t)},
    )  # fmt: skip
    control = contin.MeshControl(every=0)
    start = contin.solve(problem, [1.0], degree=4, intervals=10, mesh=control)
    for point in contin.trace(start, free=["a"], limits={"a": (0.5, 2)}, mesh=control):
        error = abs(point["mean"] - (1 - math.cos(40 * point["a"])) / (40 * point["a"]))
        assert error < 2 * point.discretization_error + 1e-13
    control = contin.MeshControl(tolerance=1e-10)
    start = contin.solve(problem, [1.0], degree=4, mesh=control)
    for point in contin.trace(start, free=["a"], limits={"a": (0.5, 2)}, mesh=control):
        assert abs(point["mean"] - (1 - math.cos(40 * point["a"])) / (40 * point["a"])) < 1e-9


def test_jumps_that_are_mesh_points():
    """u' = a, and 3 a from t = 0.4 on, has no error at all: one side's rate at the jump says nothing of the other side."""
    jump = contin.BoundaryValueProblem(
        lambda t, u, p: (p.a * (1.0 if t < 0.4 else 3.0),), lambda a, b, p: (a.u,), ["u"], {"a": 1.0}
    )
    branch = contin.trace(contin.solve(jump, [0.0]), free=["a"], limits={"a": (1, 2)})
    assert all(point.discretization_error < 1e-14 for point in branch)
    bent = contin.BoundaryValueProblem(
        lambda t, u, p: (p.a * u.u * (1.0 if t < 0.4 else 3.0),), lambda a, b, p: (a.u - 1,), ["u"], {"a": 1.0}
    )
    control = contin.MeshControl(every=0)
    start = contin.solve(bent, [1.0], degree=3, intervals=10, mesh=control)
    branch = contin.trace(start, free=["a"], limits={"a": (1, 2)}, mesh=control, errors=False)
    for point in branch.points[1:]:
        exact = math.exp(2.2 * point["a"])
        error = abs(point.system.states(point.x)[-1, 0] - exact) / (1 + exact)
        # the estimate is of the point beside the exact branch, the error that of the solution of the same a: 2.2 da more
        assert error < 10 * point.discretization_error < 100 * error


def test_a_corner_inside_an_interval_does_not_make_meshes_grow_without_end():
    """u' = a up to u = 0.4, and a (1 + 2 (u - 0.4)) above: u(1) = 0.4 + (exp(2 a - 0.8) - 1) / 2.

    The error falls slowly where meshes get finer. One that does not help is given up, and the error is stated:
    up to 30 times too small, because it rests on how fast the error of smooth solutions falls.
    """
    corner = contin.BoundaryValueProblem(
        lambda t, u, p: (p.a * (1 + 2 * max(u.u - 0.4, 0.0)),), lambda a, b, p: (a.u,), ["u"], {"a": 1.0}
    )
    control = contin.MeshControl(tolerance=1e-8, max_intervals=400)
    branch = contin.trace(
        contin.solve(corner, [0.0], mesh=control), free=["a"], limits={"a": (1, 2)}, mesh=control, errors=False
    )
    assert branch.stop.reason == "limit" and len(branch) < 50
    for point in branch:
        error = abs(point.system.states(point.x)[-1, 0] - 0.4 - (math.exp(2 * point["a"] - 0.8) - 1) / 2)
        assert error < 50 * point.discretization_error + 1e-9


@pytest.mark.parametrize("tolerance", [1e-8, 1e-12])
def test_every_point_of_bratus_branch(tolerance):
    """lam = 8 q^2 / cosh(q)^2 and u'(0) = 4 q tanh q."""
    control = contin.MeshControl(tolerance=tolerance)
    branch = contin.trace(
        contin.solve(bratu(), [0, 0], mesh=control), free=["lam"], limits={"lam": (-1, 4), "mean": (-1, 14)}, mesh=control
    )
    for point in branch:
        slope = point.system.states(point.x)[0, 1]
        q = brentq(lambda q, slope=slope: 4 * q * math.tanh(q) - slope, 0, 100, xtol=1e-14) if slope > 1e-9 else 0.0
        error = abs(point["lam"] - 8 * q**2 / math.cosh(q) ** 2) / (1 + point["lam"])
        assert error < 10 * tolerance and error < 10 * point.discretization_error + 1e-13


def test_points_of_a_fold_curve():
    """Against the same points on the mesh halved. The error of the singular vectors is not in the estimate: a factor of 10."""
    gelfand = contin.BoundaryValueProblem(
        lambda t, u, p: (u.v, -p.lam * math.exp(u.u / (1 + p.eps * u.u))), lambda a, b, p: (a.u, b.u), ["u", "v"],
        {"lam": 0.0, "eps": 0.2}, functionals={"mean": lambda t, u, p: u.u},
    )  # fmt: skip
    control = contin.MeshControl(every=0)
    start = contin.solve(gelfand, [0, 0], intervals=8, degree=3, mesh=control)
    options = {"mesh": control, "errors": False}
    fold = contin.trace(start, free=["lam"], limits={"lam": (0, 6), "mean": (-1, 30)}, **options).labelled("LP")[0]
    checked = 0
    for point in contin.curve(fold, "eps", limits={"eps": (0.15, 0.22)}, **options):
        if point.label:
            continue
        fine, carry = point.system.refined()
        row = fine.weights * carry(point.tangent)
        found = correct(fine, carry(point.x), row, row @ carry(point.x)).x
        error = max(abs(fine.parameter(found, name) - point[name]) / (1 + abs(point[name])) for name in ("lam", "eps"))
        assert error < 10 * point.discretization_error
        checked += 1
    assert checked > 2


@pytest.mark.full
def test_the_column_is_shown_and_kept(tmp_path):
    start = contin.solve(LAYER, [0.0], degree=3, intervals=12, mesh=contin.MeshControl(every=0))
    options = {"limits": {"c": (0.1, 0.8)}, "mesh": contin.MeshControl(every=0)}
    branch = contin.trace(start, free=["c"], **options)
    errors = [point.discretization_error for point in branch]
    assert max(errors) > 1e-3
    contin.save(branch, tmp_path / "b.npz")
    assert contin.lowlevel.read_columns(tmp_path / "b.npz").columns["discretization_error"].tolist() == errors
    assert [point.discretization_error for point in contin.load(LAYER, tmp_path / "b.npz")] == errors
    assert branch.to_pandas()["discretization_error"].tolist() == errors
    axes = branch.plot()
    assert "discretization error above 0.001" in axes.get_legend_handles_labels()[1]
    assert branch.plot("c", "discretization_error").lines


def test_points_without_a_mesh_have_no_such_error():
    problem = contin.AlgebraicProblem(lambda u, p: (p.a - u.x**2,), ["x"], {"a": 1.0})
    assert {
        point.discretization_error for point in contin.trace(contin.solve(problem, [1.0]), free=["a"], limits={"a": (0.5, 2)})
    } == {0.0}
