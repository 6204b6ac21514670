"""contin: continuation of solutions of boundary value problems, with folds, branch points and branch switching.

    import contin

    problem = contin.BoundaryValueProblem(
        rhs=lambda t, u, p: (u.v, -p.lam * math.exp(u.u)), boundary=lambda a, b, p: (a.u, b.u),
        states=["u", "v"], parameters={"lam": 0.0},
    )
    branch = contin.trace(contin.solve(problem, [0, 0]), free=["lam"], limits={"lam": (0, 4)})

The tutorial is docs/contin.md; docs/architecture.md says which folder does what.
"""

import importlib.util
import operator
import sys
from typing import Any

import lazy_loader

from contin.errors import warn

#: Of both distributions that hold this package, see CONTRIBUTING.md.
__version__ = "0.3.0"

_public, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
#: Modules to which names have moved that were here in version 0.2, and new names of others; the old ones stay for one version,
#: with a warning.
_MOVED = ("lowlevel", "auto07p")
_RENAMED = {"Monitor": "Event", "TestFunction": "Event", "sensitivities": "Point.sensitivities"}


def __getattr__(name: str) -> Any:
    """Return a public name, imported when it is first used."""
    try:
        return _public(name)
    except AttributeError:
        if importlib.util.find_spec(f"{__name__}.{name}"):
            raise  # an import of this module asks before it loads it
        moved = (f"{module}.{name}" for module in _MOVED if name in importlib.import_module(f"contin.{module}").__all__)
        place = _RENAMED.get(name) or next(moved, None)
        if place is None:
            from contin.text import meant  # `contin.lowlevel` takes its own names out of this module

            raise AttributeError(f"contin has no {name!r}{meant(name, __all__)}") from None
    warn(f"contin.{name} is contin.{place} now", DeprecationWarning)
    return operator.attrgetter(place)(sys.modules[__name__])
