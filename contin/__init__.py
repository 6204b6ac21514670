"""contin: continuation of solutions of boundary value problems, with folds, branch points and branch switching."""

from contin.arclength import Continuation, Settings, State, follow
from contin.branch import Branch, Point, Stop
from contin.collocation import Collocation
from contin.corrector import Newton, correct
from contin.errors import ContinError, ConvergenceError, ProblemError
from contin.events import Monitor
from contin.mesh import MeshControl
from contin.problem import BoundaryValueProblem
from contin.switching import BranchPoint, locate_branch_point

__all__ = [
    "BoundaryValueProblem", "Branch", "BranchPoint", "Collocation", "ContinError", "Continuation", "ConvergenceError",
    "MeshControl", "Monitor", "Newton", "Point", "ProblemError", "Settings", "State", "Stop", "correct", "follow",
    "locate_branch_point",
]  # fmt: skip
