"""contin: continuation of solutions of boundary value problems, with folds, branch points and branch switching.

    import contin

    problem = contin.BoundaryValueProblem(
        rhs=lambda t, u, p: (u.v, -p.lam * math.exp(u.u)), boundary=lambda a, b, p: (a.u, b.u),
        states=["u", "v"], parameters={"lam": 0.0},
    )
    branch = contin.trace(contin.solve(problem, [0, 0]), free=["lam"], limits={"lam": (0, 4)})

The tutorial is docs/contin.md; docs/architecture.md says which folder does what.
"""

import importlib
import warnings
from typing import Any

import lazy_loader

#: Of both distributions that hold this package, see CONTRIBUTING.md.
__version__ = "0.2.0"

_public, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
#: Modules to which names have moved that were here in version 0.2, and new names of classes; the old ones stay here for one
#: version, with a warning.
_MOVED, _RENAMED = ("lowlevel", "auto07p"), {"Monitor": "Event", "TestFunction": "Event"}


def __getattr__(name: str) -> Any:
    """Return a public name, imported when it is first used."""
    if name in _RENAMED:
        warnings.warn(f"contin.{name} is contin.{_RENAMED[name]} now", DeprecationWarning, stacklevel=2)
        return _public(_RENAMED[name])
    try:
        return _public(name)
    except AttributeError:
        for module in _MOVED:
            place = importlib.import_module(f"contin.{module}")
            if name in place.__all__:
                warnings.warn(f"contin.{name} is contin.{module}.{name} now", DeprecationWarning, stacklevel=2)
                return getattr(place, name)
        raise
