"""Results in memory: `read_branch` returns the branch of a file, with its tables and shapes."""

from __future__ import annotations

from branches.store.branch import StoredBranch
from branches.store.read import read_branch

__all__ = ["StoredBranch", "read_branch"]
