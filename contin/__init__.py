"""contin: continuation of solutions of boundary value problems, with folds, branch points and branch switching.

    import contin

    problem = contin.BoundaryValueProblem(
        rhs=lambda t, u, p: (u.v, -p.lam * math.exp(u.u)), boundary=lambda a, b, p: (a.u, b.u),
        states=["u", "v"], parameters={"lam": 0.0},
    )
    branch = contin.trace(contin.solve(problem, [0, 0]), free=["lam"], limits={"lam": (0, 4)})

The tutorial is docs/contin.md; docs/architecture.md says which folder does what.
"""

import lazy_loader

#: Of both distributions that hold this package, see CONTRIBUTING.md.
__version__ = "0.2.0"

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
