"""contin: continuation of solutions of boundary value problems, with folds, branch points and branch switching.

    import contin

    problem = contin.BoundaryValueProblem(
        rhs=lambda t, u, p: (u.v, -p.lam * math.exp(u.u)), boundary=lambda a, b, p: (a.u, b.u),
        states=["u", "v"], parameters={"lam": 0.0},
    )
    branch = contin.trace(contin.solve(problem, [0, 0]), free=["lam"], limits={"lam": (0, 4)})

The tutorial is docs/contin.md.
"""

from contin._cache import cache_directory  # the first of all: it tells numba where to keep compiled code
from contin.algebraic import Algebraic, AlgebraicProblem
from contin.arclength import Continuation, follow
from contin.branch import Branch, Point, Stop
from contin.collocation import Collocation
from contin.corrector import Newton, correct
from contin.curves import curve
from contin.diagram import Diagram, diagram
from contin.errors import ContinError, ConvergenceError, ProblemError
from contin.events import Monitor
from contin.mesh import MeshControl
from contin.problem import BoundaryValueProblem
from contin.sensitivity import sensitivities
from contin.settings import Settings
from contin.solving import point_of, solve, trace
from contin.steps import State
from contin.storage import load, save
from contin.switching import BranchPoint, MultiplePoint, locate_branch_point

__all__ = [
    "Algebraic", "AlgebraicProblem", "BoundaryValueProblem", "Branch", "BranchPoint", "Collocation", "ContinError",
    "Continuation", "ConvergenceError", "Diagram", "MeshControl", "Monitor", "MultiplePoint", "Newton", "Point",
    "ProblemError", "Settings", "State", "Stop", "cache_directory", "correct", "curve", "diagram", "follow", "load",
    "locate_branch_point", "point_of", "save", "sensitivities", "solve", "trace",
]  # fmt: skip
