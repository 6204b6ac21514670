# The public names, and where they come from. `import contin` loads none of them: each is imported when it is first used.
from .boundary.segmented import Segment, SegmentedProblem
from .boundary.statement import BoundaryValueProblem
from .boundary.system import Collocation
from .boundary.variational import VariationalProblem
from .collocation.basis import basis, interpolation
from .collocation.mesh import MeshControl
from .connections.statement import ConnectionProblem
from .continuation.progress import follow
from .continuation.run import Continuation
from .core.newton import Newton, correct
from .core.settings import Settings
from .core.state import Reason, State, Stop
from .core.trial import Monitor, TestFunction, Trial
from .cycles.map_statement import MapProblem
from .cycles.statement import CycleProblem
from .equilibria.statement import AlgebraicProblem
from .equilibria.system import Algebraic
from .errors import ContinError, ConvergenceError, ProblemError
from .events.branch_point import BranchPoint, locate_branch_point
from .events.multiple_point import MultiplePoint
from .files import temporary_name, write_whole
from .functions.batch import Batch
from .functions.cache import cache_directory
from .functions.gradient import gradient
from .functions.iteration import least, minimum, root
from .linalg.orientation import eigenbasis
from .names import exact_text
from .results.auto_07p import AutoBranch, AutoSolution, read_auto
from .results.branch import Branch
from .results.columns import StoredColumns, read_columns
from .results.point import Point, point_of
from .results.storage import load, save
from .search.cycle import cycle
from .search.diagram import Diagram, diagram
from .search.from_auto import from_auto
from .search.homoclinic import homoclinic
from .search.sensitivity import sensitivities
from .search.solving import solve
from .search.trace import trace
from .search.two_parameter import curve

__version__: str

__all__ = [
    "Algebraic", "AlgebraicProblem", "AutoBranch", "AutoSolution", "Batch", "BoundaryValueProblem", "Branch", "BranchPoint",
    "Collocation", "ConnectionProblem", "ContinError", "Continuation", "ConvergenceError", "CycleProblem", "Diagram",
    "MapProblem", "MeshControl", "Monitor", "MultiplePoint", "Newton", "Point", "ProblemError", "Segment",
    "Reason", "SegmentedProblem", "Settings", "State", "Stop", "StoredColumns", "TestFunction", "Trial", "VariationalProblem",
    "basis", "cache_directory", "correct", "curve", "cycle", "diagram", "eigenbasis", "exact_text", "follow", "from_auto",
    "gradient", "homoclinic", "interpolation", "least", "load", "locate_branch_point", "minimum", "point_of", "read_auto",
    "read_columns",
    "root", "save",
    "sensitivities", "solve", "temporary_name", "trace", "write_whole",
]  # fmt: skip
