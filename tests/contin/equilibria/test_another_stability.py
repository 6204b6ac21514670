"""A kind of problem that is made of equilibria and has another notion of stability: an equation with a delay."""

import math

import numpy as np
import pytest
from scipy.special import lambertw

import contin
from contin.core.spectral import Eigenvalues
from contin.equilibria.equations import Algebraic
from contin.events.hopf import hopf


class Delayed(Algebraic):
    """Equilibria of u'(t) = -k u(t - 1), whose characteristic values are those of L = -k exp(-L)."""

    def spectra(self, places):
        return [Eigenvalues(lambertw(-self.parameter(x, "k"), np.arange(-3, 3))) for x in places]

    def events(self):
        return [hopf()]


class DelayProblem(contin.AlgebraicProblem):
    def discretized(self, free, parameters, scales=None, mesh=(), degree=0):
        return Delayed(self, free, parameters, scales)


def test_stability_follows_from_one_method():
    """The pair is i pi/2 at k = pi/2. What is known of vector fields alone is not claimed."""
    problem = DelayProblem(lambda u, p: (-p.k * u.x,), ["x"], {"k": 1.0, "b": 0.0})
    branch = contin.trace(contin.solve(problem, [0.0]), free=["k"], limits={"k": (1.0, 3.0)})
    (point,) = branch.labelled("HB")
    assert point["k"] == pytest.approx(math.pi / 2, abs=1e-9) and point.details["frequency"] == pytest.approx(math.pi / 2)
    assert [each.system.unstable(each.x) for each in (branch[0], branch[-1])] == [0, 2]
    assert point.normal_form is None
    with pytest.raises(contin.ProblemError, match="no pair on the imaginary axis"):
        contin.trace(point, branch=1)
    with pytest.raises(contin.ProblemError, match="must be one of"):
        contin.curve(point, "b")
