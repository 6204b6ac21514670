"""Files of AUTO-07p: branches and solutions that it has written, as points from which contin goes on.

Examples
--------
>>> from contin import auto07p
>>> sorted(auto07p.__all__)
['AutoBranch', 'AutoSolution', 'from_auto', 'read_auto']
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub("contin", __file__)
