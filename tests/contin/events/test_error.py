"""The whole error of any number at a point, against closed forms."""

import dataclasses
import functools
import math

import numpy as np
import pytest
from scipy.optimize import brentq

import contin
from bank import closed_forms
from contin import ProblemError
from contin.lowlevel import levels


@functools.cache
def branch(degree):
    start = contin.solve(closed_forms.bratu(), [0, 0], intervals=4, degree=degree, mesh=contin.MeshControl(every=0))
    return contin.trace(
        start, free=["lam"], zeros={"lam": [1.0, 2.0]}, limits={"mean": (-1, 3)}, mesh=contin.MeshControl(every=0), errors=False
    )


def middle(trial):
    return float(trial.system.evaluate(trial.x, np.array([0.5]))[0, 0])


@pytest.mark.parametrize("degree", [2, 3, 4])
def test_user_zeros(degree):
    """The error is an upper bound, and no more than some 30 times what it is."""
    for point in branch(degree).labelled("UZ"):
        ends = (0.01, 1.19) if point["mean"] < 1 else (1.2, 20)
        s = brentq(lambda s, load=point["lam"]: closed_forms.bratu_load(s) - load, *ends)
        found = {"mean": (point["mean"], closed_forms.bratu_mean(s)), middle: (middle(point), 2 * math.log(math.cosh(s)))}
        for functional, (value, exact) in found.items():
            assert abs(value - exact) < point.error(functional) < 30 * abs(value - exact) + 1e-11


@pytest.mark.parametrize("degree", [2, 3, 4])
def test_folds(degree):
    (fold,) = branch(degree).labelled("LP")
    s = brentq(lambda s: s * math.tanh(s) - 1, 1, 2, xtol=1e-15)
    for name, exact in (("lam", closed_forms.bratu_fold()), ("mean", closed_forms.bratu_mean(s))):
        assert abs(fold[name] - exact) < fold.error(name) < 30 * abs(fold[name] - exact) + 1e-11


def test_a_located_place_counts():
    """x = a^2: where a is known to 1e-3, x is known to 2 a 1e-3."""
    problem = contin.AlgebraicProblem(lambda u, p: (u.x - p.a**2,), ["x"], {"a": 1.0})
    (point,) = contin.trace(contin.solve(problem, [1.0]), free=["a"], limits={"a": (0, 3)}, zeros={"a": [2.0]}).labelled("UZ")
    assert point.error("x") < 1e-10
    rough = dataclasses.replace(point, errors={"a": 1e-3})
    assert rough.error("x") == pytest.approx(4e-3, rel=1e-4)


def test_what_newtons_method_left_counts_once():
    """Relative to 1 + |x|; a point at which nothing is left is known to the last places. The true error is below them."""
    point = contin.solve(contin.AlgebraicProblem(lambda u, p: (u.x - p.a**2,), ["x"], {"a": 2.0}), [4.1])
    for left in (0.0, 1e-6):
        error = dataclasses.replace(point, newton_error=left).error("x")
        assert error == pytest.approx((left + levels.LAST_PLACES) * (1 + 4), rel=1e-12)


def test_a_branch_point():
    elastica = contin.trace(
        contin.solve(closed_forms.elastica(), [0, 0], intervals=3, degree=3),
        free=["lam"],
        limits={"lam": (5, 12)},
        errors=False,
    )
    (point,) = elastica.labelled("BP")
    assert abs(point["lam"] - math.pi**2) < point.error("lam") < 1e-3
    with pytest.raises(ProblemError, match="functional: 'nothing' is no column; there are lam, k, mode"):
        point.error("nothing")
