"""Problems with known special points, Hopf points among them: every one found, in order, to 1e-9, and no other.

The true errors of the same runs are compared with the error estimates.
"""

import pytest
from bank.case import SELDOM, bank, check
from bank.table import BANK, OUTSIDE

#: Fewer estimates say nothing about how many are far too large (another worker has the others, or one test was chosen).
ENOUGH = 100


@pytest.fixture(scope="module")
def estimates():
    """The error estimates of all cases that this process has run."""
    return []


@pytest.mark.parametrize("case", bank(*BANK, *OUTSIDE))
def test_special_points_and_their_error_estimates(case, estimates):
    estimates += check(case)


def test_error_estimates_are_seldom_far_too_large(estimates):
    if len(estimates) < ENOUGH:
        pytest.skip(f"only {len(estimates)} estimates in this process")
    assert sum(estimate.is_overrated for estimate in estimates) <= SELDOM * len(estimates)
