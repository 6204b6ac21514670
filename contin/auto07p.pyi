# The names of `contin.auto07p`, and where they come from.
from .results.auto_07p import AutoBranch, AutoSolution, read_auto
from .search.from_auto import from_auto

__all__ = [
    "AutoBranch", "AutoSolution", "from_auto", "read_auto",
]  # fmt: skip
