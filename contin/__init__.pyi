# The public names, and where they come from. `import contin` loads none of them: each is imported when it is first used.
from .analysis.auto_07p import from_auto
from .analysis.connections import homoclinic
from .analysis.cycles import cycle
from .analysis.diagram import Diagram, diagram
from .analysis.sensitivity import sensitivities
from .analysis.solving import solve
from .analysis.two_parameter import curve
from .continuation.run import Continuation, follow
from .continuation.trace import trace
from .detection.branch_point import BranchPoint, locate_branch_point
from .detection.multiple_point import MultiplePoint
from .discretization.algebraic import Algebraic
from .discretization.basis import basis, interpolation
from .discretization.collocation import Collocation
from .discretization.mesh import MeshControl
from .errors import ContinError, ConvergenceError, ProblemError
from .files import temporary_name, write_whole
from .functions.batch import Batch
from .functions.cache import cache_directory
from .functions.gradient import gradient
from .functions.iteration import least, minimum, root
from .linalg.orientation import eigenbasis
from .names import exact_text
from .problems.algebraic import AlgebraicProblem
from .problems.boundary_value import BoundaryValueProblem
from .problems.connection import ConnectionProblem
from .problems.cycle import CycleProblem
from .problems.map import MapProblem
from .problems.segmented import Segment, SegmentedProblem
from .problems.variational import VariationalProblem
from .results.auto_07p import AutoBranch, AutoSolution, read_auto
from .results.branch import Branch
from .results.columns import StoredColumns, read_columns
from .results.point import Point, point_of
from .results.storage import load, save
from .stepping.newton import Newton, correct
from .stepping.settings import Settings
from .stepping.state import Reason, State, Stop
from .stepping.trial import Monitor, TestFunction, Trial

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
