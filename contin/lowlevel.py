"""Parts of contin for those who build on it: discretized problems, single corrections, the loop as an iterator.

What people need who compute solutions and branches is in `contin` itself.

Examples
--------
>>> import contin
>>> from contin.lowlevel import Algebraic, correct
>>> root = Algebraic(contin.AlgebraicProblem(lambda u, p: (p.a - u.x**2,), ["x"], {"a": 4.0}), [])
>>> round(float(correct(root, [1.0]).x[0]), 12)
2.0
"""

import sys
from collections.abc import Callable
from types import ModuleType
from typing import Any

import lazy_loader


def names_of(module: str, file: str) -> tuple[Callable[[str], Any], Callable[[], list[str]], list[str]]:
    """Return ``__getattr__``, ``__dir__`` and ``__all__`` of a module of names, which its stub lists.

    lazy_loader keeps what it has found in the package; here it is kept in the module. Version 0.6 also changes the class of the
    package, and functions that name it could not be sent to other processes any more.
    """
    find, listed, names = lazy_loader.attach_stub("contin", file)
    sys.modules["contin"].__class__ = ModuleType

    def found(name: str) -> Any:
        value = find(name)
        vars(sys.modules["contin"]).pop(name, None)
        setattr(sys.modules[module], name, value)
        return value

    return found, listed, names


__getattr__, __dir__, __all__ = names_of(__name__, __file__)
