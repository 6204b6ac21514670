"""The estimated discretization error of every point against closed forms, and that no stored point is much worse than asked."""

import math

import numpy as np
import pytest
from bank.closed_forms import bratu
from scipy.optimize import brentq

import contin

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


@pytest.mark.parametrize(("degree", "tolerance"), [(4, 1e-7), (4, 1e-10), (6, 1e-10), (7, 1e-12)])
def test_a_layer_that_leaves_its_mesh_behind(degree, tolerance):
    """The mesh is looked at every 40 steps only, while the layer moves: each point is good enough in itself.

    A point may have an error of 100 tolerances, by an estimate that is right to a factor of three. Without the check, the
    errors were 200 to 200,000 times larger: 5.6e-3, 9.8e-5, 3.1e-4 and 3.3e-5.
    """
    control = contin.MeshControl(tolerance=tolerance, every=40)
    start = contin.solve(LAYER, [0.0], degree=degree, mesh=control)
    branch = contin.trace(start, free=["c"], limits={"c": (0.1, 0.8)}, step=0.5, mesh=control)
    assert branch.stop.reason == "limit" and not branch.notes
    for point in branch:
        assert layer_error(point) < 300 * tolerance
        assert layer_error(point) < 10 * point.discretization_error + 1e-13


def test_the_estimate_on_a_mesh_that_is_kept():
    """Without adaptation the errors are large, and stated. The estimate includes the rates, whose errors are larger."""
    control = contin.MeshControl(every=0)
    start = contin.solve(LAYER, [0.0], degree=4, intervals=40, mesh=control)
    branch = contin.trace(start, free=["c"], limits={"c": (0.1, 0.8)}, step=0.5, mesh=control)
    for point in branch:
        assert point.discretization_error / 100 < layer_error(point) < point.discretization_error * 10
    assert max(point.discretization_error for point in branch) > 3e-5


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
        assert error < 100 * tolerance and error < 10 * point.discretization_error + 1e-13


def test_the_column_is_shown_and_kept(tmp_path):
    start = contin.solve(LAYER, [0.0], degree=3, intervals=12, mesh=contin.MeshControl(every=0))
    options = {"limits": {"c": (0.1, 0.8)}, "mesh": contin.MeshControl(every=0)}
    branch = contin.trace(start, free=["c"], **options)
    errors = [point.discretization_error for point in branch]
    assert max(errors) > 1e-3
    contin.save(branch, tmp_path / "b.npz")
    assert contin.read_columns(tmp_path / "b.npz").columns["discretization_error"].tolist() == errors
    assert [point.discretization_error for point in contin.load(LAYER, tmp_path / "b.npz")] == errors
    assert branch.to_pandas()["discretization_error"].tolist() == errors
    axes = branch.plot()
    assert "discretization error above 0.001" in axes.get_legend_handles_labels()[1]
    assert branch.plot("c", "discretization_error").lines
    without = contin.trace(start, free=["c"], errors=False, **options)
    assert all(math.isnan(point.discretization_error) for point in without)


def test_points_without_a_mesh_have_no_such_error():
    problem = contin.AlgebraicProblem(lambda u, p: (p.a - u.x**2,), ["x"], {"a": 1.0})
    assert {
        point.discretization_error for point in contin.trace(contin.solve(problem, [1.0]), free=["a"], limits={"a": (0.5, 2)})
    } == {0.0}
