"""Print which kernel OpenBLAS uses here; with ``--other``, the name of one that rounds differently, empty if there is none.

The names are values of OPENBLAS_CORETYPE.
"""

import ctypes
import pathlib
import sys

import numpy as np

#: OpenBLAS's kernels that need AVX-512.
WIDE = "SkylakeX", "Cooperlake", "SapphireRapids"


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


def has_avx512() -> bool:
    """Return whether the processor has AVX-512, as far as the system tells."""
    flags = pathlib.Path("/proc/cpuinfo")
    return flags.exists() and " avx512f" in flags.read_text()


def other(used: str) -> str:
    """Return a kernel that rounds differently from the one used: Haswell beside SkylakeX; Prescott without AVX-512."""
    cpuinfo = pathlib.Path("/proc/cpuinfo")
    if not used or not cpuinfo.exists() or " avx2" not in cpuinfo.read_text():
        return ""
    if used in WIDE:
        return "Haswell"
    return "SkylakeX" if has_avx512() else "Prescott"


if __name__ == "__main__":
    print(other(kernel()) if "--other" in sys.argv else f"OpenBLAS uses its kernel {kernel() or '(not known)'}")
