"""Files of AUTO-07p: branches and solutions that it has written, as points from which contin goes on.

Examples
--------
>>> from contin import auto07p
>>> sorted(auto07p.__all__)
['AutoBranch', 'AutoSolution', 'from_auto', 'read_auto']
"""

from contin.lowlevel import names_of

__getattr__, __dir__, __all__ = names_of(__name__, __file__)
