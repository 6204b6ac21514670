"""The public surface as a user's type-checked program sees it: ``mypy`` looks at this, nothing runs it."""

import math

import numpy as np

import contin

problem = contin.BoundaryValueProblem(
    rhs=lambda t, u, p: (u.v, -p.lam * math.exp(u.u)), boundary=lambda a, b, p: (a.u, b.u),
    states=["u", "v"], parameters={"lam": 0.0, "k": 1.0},
)  # fmt: skip
first = contin.solve(problem, [0, 0], mesh=contin.MeshControl(every=2), newton=contin.Newton(1e-10))
branch = contin.trace(first, free=["lam"], limits={"lam": (0, 4)})
column: np.ndarray = branch.column("lam")
for point in branch:
    value: float = point["lam"] + point.errors.get("lam", 0.0) + point.x.max() + point.system.nodes[-1]
    if isinstance(point.details, contin.lowlevel.BranchPoint):
        contin.trace(point, branch=1, direction=-1)
why: str = branch.stop.advice if branch.stop else ""
contin.trace(branch.points[3], contin.Settings(zeros={"lam": [1.0]}, events=[contin.Event("UZ", "one", lambda t: t["lam"])]))
slopes: dict[str, dict[str, float]] = branch.labelled("LP")[0].sensitivities(by=["k"])
folds: contin.Branch = contin.curve(branch.labelled("LP")[0], "k", max_points=10)
contin.save(branch, "branch.npz")
again: contin.Branch = contin.load(problem, "branch.npz")
from_function = contin.solve(problem, lambda t: (t, 1 - t), {"lam": 1.0})
from_arrays = contin.solve(problem, (np.linspace(0, 1, 5), np.zeros((5, 2))), others=[from_function])
run = contin.lowlevel.Continuation(from_arrays.system, from_arrays.x)
points = [point.label for point in run]

equilibria = contin.AlgebraicProblem(lambda u, p: (p.mu - u.x**2,), states=1, parameters={"mu": 1.0})
found = contin.diagram(contin.solve(equilibria, [1.0]), free=["mu"], depth=1, symmetries=[lambda t, u: -u])
graph = found.graph()
system = contin.lowlevel.Collocation(problem, [0.0, 0.5, 1.0], 4, ["lam"], {})
corrected = contin.lowlevel.correct(system, np.zeros(system.size), row=np.eye(system.size)[-1], target=0.5)
