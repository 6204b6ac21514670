# The public names, and where they come from. `import ribbon_model` loads none of them: each is imported when it is first used.
from . import exact, linear, network
from .descent import descend
from .domains import CELL, HALF_LOOP
from .ends import End, Roller
from .law import Law, Parameter
from .laws import FINITE_WIDTH, FLAT_ROD, ISOTROPIC_ROD, RIBBON, ROD
from .open_strip import OpenStrip
from .section import Section
from .seeds import primary_branch, secondary_branch
from .solution import Solution
from .strip import Strip

__all__ = [
    "CELL", "End", "FINITE_WIDTH", "FLAT_ROD", "HALF_LOOP", "ISOTROPIC_ROD", "Law", "OpenStrip", "Parameter", "RIBBON", "ROD",
    "Roller", "Section", "Solution", "Strip", "descend", "exact", "linear", "network", "primary_branch", "secondary_branch",
]  # fmt: skip
