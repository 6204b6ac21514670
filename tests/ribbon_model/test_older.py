"""Calls and names of version 0.2 work, and warn."""

import pytest

from ribbon_model import exact
from ribbon_model.laws import FINITE_WIDTH, RIBBON
from ribbon_model.linear import circle, index, thresholds
from ribbon_model.material import Material
from ribbon_model.section import section_of
from ribbon_model.seeds import primary_branch
from ribbon_model.unfolding import first_root

WIDE = {"nu": 0.3, "Gamma": 10.0}


@pytest.mark.parametrize(
    ("old", "new"),
    [
        (lambda: thresholds(FINITE_WIDTH, 1, 2, 0.3, 10.0), lambda: thresholds(FINITE_WIDTH, 1, 2, WIDE)),
        (lambda: thresholds(RIBBON, 1, 2, 0.3, None), lambda: thresholds(RIBBON, 1, 2, 0.3)),
        (lambda: thresholds(RIBBON, 1, 2, nu=0.3), lambda: thresholds(RIBBON, 1, 2, 0.3)),
        (lambda: circle(FINITE_WIDTH, 1, 0.5, 0.3, Gamma=10.0), lambda: circle(FINITE_WIDTH, 1, 0.5, WIDE)),
        (lambda: index(FINITE_WIDTH, 1, 4.0, nu=0.3, Gamma=10.0), lambda: index(FINITE_WIDTH, 1, 4.0, WIDE)),
        (lambda: FINITE_WIDTH.values(0.3, 10.0), lambda: WIDE),
        (lambda: first_root(FINITE_WIDTH, 0.3, width=75.0), lambda: first_root(FINITE_WIDTH, {"nu": 0.3, "Gamma": 75.0})),
        (lambda: mesh(RIBBON, 1, 2, nu=0.3, intervals=8, degree=7), lambda: (9, 7)),
        (lambda: mesh(FINITE_WIDTH, 1, 2, 0.3, 8, 7, Gamma=10.0), lambda: (9, 7)),
        (lambda: exact.folds(1, 2, nu=0.3)[0].kappa_n, lambda: exact.folds(1, 2, 0.3)[0].kappa_n),
        (lambda: Material("flat rod", {"nu": 0.3}), lambda: section_of("flat rod", {"nu": 0.3})),
    ],
)
def test_an_old_call_warns(old, new):
    with pytest.warns(DeprecationWarning):
        assert old() == new()


def mesh(*given, **options):
    system, x, tangent = primary_branch(*given, **options)
    return len(system.mesh), system.degree
