"""The former place of the runner; it goes with version 0.4."""

import warnings

from branches.run.runner import compute_scene as compute_branch
from branches.run.runner import run_scene as run_branch

__all__ = ["compute_branch", "run_branch"]

warnings.warn(
    "branches.job is branches.run.runner from version 0.3 on: run_scene, compute_scene", DeprecationWarning, stacklevel=2
)
