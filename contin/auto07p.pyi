# The names of `contin.auto07p`, and where they come from.
from .search.from_auto import AutoBranch, AutoSolution, from_auto, read_auto

__all__ = [
    "AutoBranch", "AutoSolution", "from_auto", "read_auto",
]  # fmt: skip
