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

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub("contin", __file__)
