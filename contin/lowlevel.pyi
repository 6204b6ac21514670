# The names of `contin.lowlevel`, and where they come from.
from .boundary.system import Collocation
from .collocation.basis import basis, interpolation
from .continuation.progress import follow
from .continuation.run import Continuation
from .core.newton import correct
from .core.state import State
from .core.trial import Trial
from .equilibria.system import Algebraic
from .events.branch_point import BranchPoint, locate_branch_point
from .events.multiple_point import MultiplePoint
from .files import temporary_name, write_whole
from .functions.batch import Batch
from .functions.cache import cache_directory
from .linalg.orientation import eigenbasis
from .names import exact_text
from .results.columns import StoredColumns, read_columns
from .results.point import point_of

__all__ = [
    "Algebraic", "Batch", "BranchPoint", "Collocation", "Continuation", "MultiplePoint", "State", "StoredColumns",
    "Trial", "basis", "cache_directory", "correct", "eigenbasis", "exact_text", "follow", "interpolation",
    "locate_branch_point", "point_of", "read_columns", "temporary_name", "write_whole",
]  # fmt: skip
