"""Print which kernel OpenBLAS uses here; with ``--other N``, the N-th of those that round differently, empty if there is none.

The names are values of OPENBLAS_CORETYPE.
"""

import ctypes
import pathlib
import sys

import numpy as np

#: OpenBLAS's kernels that round differently, with what a processor must have for them.
NEEDS = {"SkylakeX": "avx512vl", "Zen": "avx2", "Haswell": "avx2", "Sandybridge": "avx", "Prescott": "pni"}


def kernel() -> str:
    """Return the name of the kernel of numpy's OpenBLAS; empty where numpy has another library."""
    root = pathlib.Path(np.__file__).parents[1]
    for path in (*root.glob("numpy.libs/*openblas*"), *root.glob("numpy/.dylibs/*openblas*")):
        library = ctypes.CDLL(str(path))
        for name in ("scipy_openblas_get_corename64_", "scipy_openblas_get_corename", "openblas_get_corename"):
            function = getattr(library, name, None)
            if function is not None:
                function.restype = ctypes.c_char_p
                return function().decode()
    return ""


def others(used: str) -> list[str]:
    """Return the other kernels that this processor runs, as far as the system tells."""
    flags = pathlib.Path("/proc/cpuinfo")
    known = set(flags.read_text().split()) if used and flags.exists() else set()
    return [name for name, flag in NEEDS.items() if flag in known and name != used]


if __name__ == "__main__":
    used = kernel()
    if "--other" in sys.argv:
        names = others(used)
        print(names[int(sys.argv[-1]) % len(names)] if names else "")
    else:
        print(f"OpenBLAS uses its kernel {used or '(not known)'}")
