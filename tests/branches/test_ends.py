"""What the ends of a branch are called: by the linear theory, and by the law."""

import dataclasses

import pytest

from branches.scene.closed import ClosedScene
from branches.scene.stages import stages_of
from ribbon_model.laws import LAWS
from ribbon_model.linear import thresholds


def points_of(config):
    (stage,) = stages_of(config)
    run = stage.start()
    return [stage.judge(point, run) for point in run], run


def test_an_end_that_the_linear_theory_does_not_know_is_named_possible():
    """(1, 2), nu = .3 ends at -.5 on the 3-covered circle, by (27) of Audoly & Seffen (2015); not at -.49."""
    config = ClosedScene(m=1, n=2)
    points, run = points_of(config)
    end = points[-1]
    assert thresholds(LAWS["ribbon"], 3, 2, 0.3)[0] == pytest.approx(-0.5, abs=1e-14)
    assert end.name == "trivial branch" and run.stop.reason == "trivial branch"
    shifted = {**end.parameters, "kappa_n": -0.49}
    energy = {**end.functionals, "energy": 9 / 2 - 3 * shifted["kappa_n"]}  # of that circle
    other = stages_of(config)[0].judge(dataclasses.replace(end, parameters=shifted, functionals=energy), run)
    assert (other.label, other.name) == ("MX", "possible trivial branch")
    assert run.stop.reason == "no convergence" and "no bifurcation of the 3-covered circle" in run.stop.message


@pytest.mark.full
def test_the_law_of_finite_width_says_where_it_ends():
    """(3, 1), Gamma = 30.7, nu = .35: the quadrature is lost at kappa_n = -17.193 (`ribbon_model.exact_finite_width`)."""
    points, run = points_of(ClosedScene(law="finite width", m=3, n=1, nu=0.35, Gamma=30.7))
    assert points[-1]["kappa_n"] == pytest.approx(-17.19, abs=0.05)
    assert "convex" in str(run.stop) and "more intervals" not in str(run.stop)
