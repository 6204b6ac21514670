"""Cycles by AUTO-07p: from an equilibrium to its Hopf point, and from there along the cycles. See `peers.auto_07p`."""

from __future__ import annotations

import functools
import subprocess
import tempfile
from pathlib import Path

from peers import auto_07p

PROGRAM = """\
      SUBROUTINE FUNC(NDIM,U,ICP,PAR,IJAC,F,A,B)
      IMPLICIT NONE
      INTEGER, INTENT(IN) :: NDIM, ICP(*), IJAC
      DOUBLE PRECISION, INTENT(IN) :: U(NDIM), PAR(*)
      DOUBLE PRECISION, INTENT(OUT) :: F(NDIM)
      DOUBLE PRECISION, INTENT(INOUT) :: A(NDIM,NDIM), B(NDIM,*)
{field}
      IF (IJAC == 0) RETURN
      A = 0
{jacobian}
      IF (IJAC == 1) RETURN
      B(:,1) = 0
{by_parameter}
      END SUBROUTINE FUNC
      SUBROUTINE STPNT(NDIM,U,PAR,T)
      IMPLICIT NONE
      INTEGER, INTENT(IN) :: NDIM
      DOUBLE PRECISION, INTENT(INOUT) :: U(NDIM), PAR(*)
      DOUBLE PRECISION, INTENT(IN) :: T
{start}
      END SUBROUTINE STPNT
      SUBROUTINE BCND
      END SUBROUTINE BCND
      SUBROUTINE ICND
      END SUBROUTINE ICND
      SUBROUTINE FOPT
      END SUBROUTINE FOPT
      SUBROUTINE PVLS(NDIM,U,PAR)
      IMPLICIT NONE
      INTEGER, INTENT(IN) :: NDIM
      DOUBLE PRECISION, INTENT(IN) :: U(NDIM)
      DOUBLE PRECISION, INTENT(INOUT) :: PAR(*)
      WRITE(97,'(ES25.16)') PAR(1)
      END SUBROUTINE PVLS
"""
#: The statements of each vector field, parted by semicolons, and the number of states; U(3) is z, PAR(1) the parameter.
FIELDS = {
    "predator": {
        "states": "2",
        "field": "F(1) = 3*U(1)*(1 - U(1)) - U(1)*U(2) - PAR(1)*(1 - EXP(-5*U(1))); F(2) = 3*U(1)*U(2) - U(2)",
        "jacobian": "A(1,1) = 3 - 6*U(1) - U(2) - 5*PAR(1)*EXP(-5*U(1)); A(1,2) = -U(1); A(2,1) = 3*U(2); A(2,2) = 3*U(1) - 1",
        "by_parameter": "B(1,1) = EXP(-5*U(1)) - 1",
        "start": "PAR(1) = 0.5D0; U(1) = 1D0/3; U(2) = 2 - 1.5D0*(1 - EXP(-5D0/3))",
    },
    "lorenz": {
        "states": "3",
        "field": "F(1) = 10*(U(2) - U(1)); F(2) = PAR(1)*U(1) - U(2) - U(1)*U(3); F(3) = U(1)*U(2) - 8D0/3*U(3)",
        "jacobian": "A(1,1) = -10; A(1,2) = 10; A(2,1) = PAR(1) - U(3); A(2,2) = -1; A(2,3) = -U(1);"
        "A(3,1) = U(2); A(3,2) = U(1); A(3,3) = -8D0/3",
        "by_parameter": "B(2,1) = U(1)",
        "start": "PAR(1) = 20; U(1) = SQRT(8D0/3*19); U(2) = U(1); U(3) = 19",
    },
}
CONSTANTS = """\
NDIM={states}, IPS={kind}, IRS={restart}, ISW=1, ICP=[{free}], NBC=0, NINT=0, JAC=1
NTST={intervals}, NCOL={degree}, IAD=3, ILP=1, ISP=2, NMX=1000, NPR=0, MXBF=0, IID=0, IPLT=0
ITMX=9, ITNW=7, NWTN=3, EPSL={tolerance}, EPSU={tolerance}, EPSS={event_tolerance}
DS={step}, DSMIN=1e-8, DSMAX={longest_step}, IADS=1, {stop}
"""


@functools.cache
def build(name: str) -> Path:
    """Return the executable of one vector field."""
    folder = tempfile.TemporaryDirectory(prefix="bench-auto-")
    auto_07p._FOLDERS.append(folder)
    source = Path(folder.name) / "field.f90"
    source.write_text(PROGRAM.format(**{key: _lines(text) for key, text in FIELDS[name].items()}))
    objects = [str(path) for path in sorted(auto_07p.LIBRARY.glob("*.o"))]
    command = ["gfortran", "-O3", "-march=native", "-fopenmp", str(source), *objects, "-o", str(source.with_suffix(""))]
    subprocess.run(command, check=True, capture_output=True)
    return source.with_suffix("")


def _lines(text: str) -> str:
    return "\n".join("      " + part.strip() for part in text.split(";"))


def study(name: str, last: float, step: float, *, intervals: int, degree: int, tolerance: float) -> dict:
    """Follow the equilibrium to its Hopf point, and the cycles to the period ``last``; return what is known of these.

    ``parameter`` is that at the last cycle in full precision (AUTO's own files keep eleven digits).
    """
    values = {"states": FIELDS[name]["states"], "intervals": intervals, "degree": degree}
    values |= {"tolerance": tolerance, "event_tolerance": 10 * tolerance}
    with tempfile.TemporaryDirectory(prefix="bench-auto-") as place:
        folder = Path(place)
        first = {"kind": 1, "restart": 0, "free": "1", "step": step, "longest_step": 0.5, "stop": "SP=['HB1']"}
        auto_07p._run(build(name), folder, CONSTANTS.format(**values, **first))
        (folder / "fort.8").replace(folder / "fort.3")
        second = {"kind": 2, "restart": 2, "free": "1, 11", "step": 0.1, "longest_step": 0.5}
        stop = f"UZSTOP={{11: {last}}}"
        found = auto_07p._run(build(name), folder, CONSTANTS.format(**values, **second, stop=stop))
    return found | {"parameter": auto_07p.in_full(found, found["labels"][-1][1])}
