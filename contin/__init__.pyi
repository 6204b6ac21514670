# The public names, and where they come from. `import contin` loads none of them: each is imported when it is first used.
from . import auto07p, lowlevel
from .boundary.statement import BoundaryValueProblem, Segment, SegmentedProblem
from .boundary.variational import SegmentedVariationalProblem, VariationalProblem, VariationalSegment
from .collocation.mesh import MeshControl
from .connections.statement import ConnectionProblem
from .core.newton import Newton
from .core.settings import Settings
from .core.step import Reason
from .core.trial import Event
from .cycles.statement import CycleProblem, MapProblem
from .equilibria.statement import AlgebraicProblem
from .errors import ContinError, ConvergenceError, ProblemError
from .results.branch import Branch, Diagram
from .results.point import Point
from .results.storage import load, save
from .search.diagram import diagram
from .search.further import Search
from .search.many import batch
from .search.orbits import cycle, homoclinic
from .search.solving import solve
from .search.trace import trace
from .search.two_parameter import curve

__version__: str

__all__ = [
    "auto07p", "lowlevel",
    "AlgebraicProblem", "BoundaryValueProblem", "Branch", "ConnectionProblem", "ContinError", "ConvergenceError",
    "CycleProblem", "Diagram", "Event", "MapProblem", "MeshControl", "Newton", "Point", "ProblemError", "Reason", "Search",
    "Segment", "SegmentedProblem", "SegmentedVariationalProblem", "Settings", "VariationalProblem", "VariationalSegment",
    "batch", "curve", "cycle", "diagram", "homoclinic", "load", "save", "solve", "trace",
]  # fmt: skip
