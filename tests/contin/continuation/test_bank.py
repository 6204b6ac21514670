"""Problems with known special points, Hopf points among them: every one found, in order, to 1e-9, and no other."""

import pytest
from bank.case import bank, check

BOUNDARY_VALUE_PROBLEMS = "exp", "int", "bvp", "lin", "non", "ezp", "ext", "spb", "kar", "bru", "pd2"
ALGEBRAIC_PROBLEMS = "cusp", "ab", "abc", "enz", "dd2", "lrz", "pp2", "opt"


@pytest.mark.parametrize("case", bank(*BOUNDARY_VALUE_PROBLEMS, *ALGEBRAIC_PROBLEMS))
def test_special_points(case):
    check(case)
