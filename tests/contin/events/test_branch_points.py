"""Where branch points are expected in a step."""

import numpy as np

from contin.events.crossings import shares


def test_quotients_of_any_size():
    """A singular value that was zero at the start, or is at the end, has passed there: quotients 0 and infinity, no warning."""
    assert shares(np.array([0, -1, -np.inf], dtype=complex)).tolist() == [0, 0.5, 1]
