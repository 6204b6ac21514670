"""Problems with known special points, Hopf points among them: every one found, in order, to 1e-9, and no other.

The true errors of the same runs are compared with the error estimates.
"""

import pytest

from bank.case import bank, check
from bank.table import BANK, OUTSIDE


@pytest.mark.parametrize("case", bank(*BANK, *OUTSIDE))
def test_special_points_and_their_error_estimates(case):
    check(case)
