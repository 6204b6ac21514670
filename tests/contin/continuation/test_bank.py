"""Boundary value problems with known special points: every one found, in order, to 1e-9, and no other."""

import pytest
from bank.case import bank, check


@pytest.mark.parametrize("case", bank("exp", "int", "bvp", "lin", "non", "ezp", "ext", "spb", "kar", "bru", "pd2"))
def test_special_points(case):
    check(case)
