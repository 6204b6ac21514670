"""Files of AUTO-07p for the tests of ``read_auto``: ``python write.py [FOLDER]``, by default beside this file.

AUTO-07p as distributed (``apt-get install auto-07p gfortran``). Equilibria and cycles of its demo ``ab``, and Bratu's problem.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).parent
LIBRARY = Path(os.environ.get("AUTO_DIR", "/usr/lib/auto-07p")) / "lib"
CONSTANTS = {
    "NDIM": 2, "IRS": 0, "ISW": 1, "NBC": 0, "NINT": 0, "JAC": 0, "NTST": 20, "NCOL": 4, "IAD": 3, "ILP": 1, "ISP": 2,
    "NMX": 60, "NPR": 0, "MXBF": 0, "IID": 2, "IPLT": 0, "ITMX": 20, "ITNW": 9, "NWTN": 3, "EPSL": 1e-8, "EPSU": 1e-8,
    "EPSS": 1e-6, "DS": 0.01, "DSMIN": 1e-8, "DSMAX": 0.2, "IADS": 1, "NPAR": 11, "THL": {11: 0.0},
}  # fmt: skip
#: By name: the program, its constants, and the run and label where it begins.
RUNS = {
    "rest": ("ab", {"IPS": 1, "ICP": [1], "UZSTOP": "{1: 0.35}"}, None),
    "cycles": ("ab", {"IPS": 2, "ICP": [1, 11], "UZSTOP": "{11: 7.1}", "IRS": 2, "DSMAX": 0.5}, "rest"),
    "bratu": (
        "bratu",
        {"IPS": 4, "ICP": [1], "NBC": 2, "NMX": 40, "UZR": "{1: 2.0}", "parnames": "{1: 'lam'}", "DSMAX": 0.5},
        None,
    ),
}


def missing() -> str | None:
    """Return the reason why AUTO-07p cannot be run, or None."""
    if shutil.which("gfortran") is None:
        return "gfortran is not on the path"
    return None if (LIBRARY / "main.o").exists() else f"there is no AUTO-07p in {LIBRARY}"


def write(target: Path) -> None:
    """Write the files of all runs."""
    objects = [str(path) for path in sorted(LIBRARY.glob("*.o"))]
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for program in {program for program, _, _ in RUNS.values()}:
            command = ["gfortran", "-fopenmp", str(HERE / f"{program}.f90"), *objects, "-o", program]
            subprocess.run(command, cwd=folder, check=True, capture_output=True)
        for run, (program, own, start) in RUNS.items():
            constants = {**CONSTANTS, **own}
            (folder / "fort.2").write_text(", ".join(f"{key}={value}" for key, value in constants.items()) + "\n")
            if start is not None:
                shutil.copy(target / f"s.{start}", folder / "fort.3")
            environment = os.environ | {"OMP_NUM_THREADS": "1"}
            subprocess.run([folder / program], cwd=folder, check=True, capture_output=True, env=environment)
            for letter, unit in (("b", 7), ("s", 8)):
                shutil.copy(folder / f"fort.{unit}", target / f"{letter}.{run}")


if __name__ == "__main__":
    write(Path(sys.argv[1]) if len(sys.argv) > 1 else HERE)
