"""Algebraic problems with known special points, Hopf points among them: every one found, in order, to 1e-9, and no other."""

import pytest
from bank.case import bank, check


@pytest.mark.parametrize("case", bank("cusp", "ab", "abc", "enz", "dd2", "lrz", "pp2", "opt"))
def test_special_points(case):
    check(case)
