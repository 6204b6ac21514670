# The names of `contin.lowlevel`, and where they come from.
from . import levels
from .boundary.second_variation import Undetermined
from .boundary.system import Collocation
from .collocation.mesh import basis, interpolation
from .continuation.run import Continuation
from .core.labels import Label
from .core.newton import correct
from .core.step import State, Stop
from .core.trial import Trial
from .equilibria.equations import Algebraic
from .events.branch_point import BranchPoint, locate_branch_point
from .events.error import error
from .events.multiple_point import MultiplePoint
from .files import temporary_name, write_whole
from .functions.batch import Batch
from .functions.iteration import gradient, least, minimum, root
from .kernels.machine_code import cache_directory
from .linalg.forms import condense_forms
from .linalg.orientation import eigenbasis
from .results.marks import PALETTE, Colour
from .results.phase_response import PhaseResponse
from .results.plot import hermite, through
from .results.point import point_of
from .results.spectrum import Spectrum
from .results.storage import StoredColumns, read_branches, read_columns
from .search.further import Searched, further
from .search.trace import follow, oscillation
from .text import Shown, exact_text, meant, one_of, shown

__all__ = [
    "Algebraic", "Batch", "BranchPoint", "Collocation", "Colour", "Continuation", "Label", "MultiplePoint", "PALETTE",
    "PhaseResponse", "Searched", "Shown", "Spectrum", "State", "Stop", "StoredColumns", "Trial", "Undetermined", "basis",
    "cache_directory", "condense_forms", "correct", "eigenbasis", "error", "exact_text", "follow", "further", "gradient",
    "hermite", "interpolation", "least", "levels", "locate_branch_point", "meant", "minimum", "one_of", "oscillation",
    "point_of", "read_branches", "read_columns", "root", "shown", "temporary_name", "through", "write_whole",
]  # fmt: skip
