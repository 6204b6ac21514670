"""ribbon_model: the mechanics of elastic strips, closed and open, on `contin`.

    from ribbon_model import RIBBON, Solution, primary_branch

    system, x, tangent = primary_branch(RIBBON, 1, 2, 0.3)

The names here are what people need; docs/architecture.md says which module does what, and how a law is added.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
