"""contin: continuation of solutions of boundary value problems, with folds, branch points and branch switching.

    import contin

    problem = contin.BoundaryValueProblem(
        rhs=lambda t, u, p: (u.v, -p.lam * math.exp(u.u)), boundary=lambda a, b, p: (a.u, b.u),
        states=["u", "v"], parameters={"lam": 0.0},
    )
    branch = contin.trace(contin.solve(problem, [0, 0]), free=["lam"], limits={"lam": (0, 4)})

The tutorial is docs/contin.md; docs/architecture.md says which folder does what.
"""

from contin.analysis.diagram import Diagram, diagram
from contin.analysis.sensitivity import sensitivities
from contin.analysis.solving import solve
from contin.analysis.two_parameter import curve
from contin.continuation.run import Continuation, follow
from contin.continuation.trace import trace
from contin.detection.branch_point import BranchPoint, MultiplePoint, locate_branch_point
from contin.discretization.algebraic import Algebraic
from contin.discretization.basis import basis, interpolation
from contin.discretization.collocation import Collocation
from contin.discretization.mesh import MeshControl
from contin.errors import ContinError, ConvergenceError, ProblemError
from contin.functions.batch import Batch
from contin.functions.cache import cache_directory
from contin.functions.gradient import gradient
from contin.problems.algebraic import AlgebraicProblem
from contin.problems.boundary_value import BoundaryValueProblem
from contin.results.branch import Branch
from contin.results.point import Point, point_of
from contin.results.storage import load, save
from contin.stepping.newton import Newton, correct
from contin.stepping.settings import Settings
from contin.stepping.state import State, Stop
from contin.stepping.trial import TestFunction, Trial

Monitor = TestFunction  # the first name of the class

__all__ = [
    "Algebraic", "AlgebraicProblem", "Batch", "BoundaryValueProblem", "Branch", "BranchPoint", "Collocation", "ContinError",
    "Continuation", "ConvergenceError", "Diagram", "MeshControl", "Monitor", "MultiplePoint", "Newton", "Point",
    "ProblemError", "Settings", "State", "Stop", "TestFunction", "Trial", "basis", "cache_directory", "correct", "curve",
    "diagram", "follow", "gradient", "interpolation", "load", "locate_branch_point", "point_of", "save", "sensitivities",
    "solve", "trace",
]  # fmt: skip
