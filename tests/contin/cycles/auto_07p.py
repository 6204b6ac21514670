"""Reference values of cycles by AUTO-07p: ``python auto_07p.py [NAME ...]`` writes ``auto_07p.json`` beside it.

AUTO-07p as distributed (``apt-get install auto-07p gfortran``), at tight tolerances. Each study states a vector field in
Fortran, its first point, and its runs; those after the first begin at a labelled point of an earlier one. A forcing is an
oscillator of two further states, as in AUTO's demo ``frc``. Noted of each labelled point: its label, the primary parameter,
the period (0 at equilibria), and the mean square of the states without those of the oscillator.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from dataclasses import dataclass, field
from pathlib import Path

LIBRARY = Path(os.environ.get("AUTO_DIR", "/usr/lib/auto-07p")) / "lib"
NOTES = Path(__file__).with_suffix(".json")

PROGRAM = """
      SUBROUTINE FUNC(NDIM,U,ICP,PAR,IJAC,F,DFDU,DFDP)
      IMPLICIT NONE
      INTEGER, INTENT(IN) :: NDIM, ICP(*), IJAC
      DOUBLE PRECISION, INTENT(IN) :: U(NDIM), PAR(*)
      DOUBLE PRECISION, INTENT(OUT) :: F(NDIM)
      DOUBLE PRECISION, INTENT(INOUT) :: DFDU(NDIM,NDIM), DFDP(NDIM,*)
      DOUBLE PRECISION S
      {field}
      END SUBROUTINE FUNC
      SUBROUTINE STPNT(NDIM,U,PAR,T)
      IMPLICIT NONE
      INTEGER, INTENT(IN) :: NDIM
      DOUBLE PRECISION, INTENT(INOUT) :: U(NDIM), PAR(*)
      DOUBLE PRECISION, INTENT(IN) :: T
      DOUBLE PRECISION TPI
      TPI = 8*ATAN(1.0D0)
      {start}
      END SUBROUTINE STPNT
      SUBROUTINE ADVANCE(NDIM,U,PAR,T)
      IMPLICIT NONE
      INTEGER, INTENT(IN) :: NDIM
      DOUBLE PRECISION, INTENT(INOUT) :: U(NDIM), PAR(*)
      DOUBLE PRECISION, INTENT(IN) :: T
      DOUBLE PRECISION K1(NDIM), K2(NDIM), K3(NDIM), K4(NDIM), H, D(1)
      INTEGER I, N, ICP(1)
      N = 1 + INT(2000*T)
      H = T*PAR(11)/N
      DO I = 1, N
        CALL FUNC(NDIM,U,ICP,PAR,0,K1,D,D)
        CALL FUNC(NDIM,U+H/2*K1,ICP,PAR,0,K2,D,D)
        CALL FUNC(NDIM,U+H/2*K2,ICP,PAR,0,K3,D,D)
        CALL FUNC(NDIM,U+H*K3,ICP,PAR,0,K4,D,D)
        U = U + H/6*(K1 + 2*K2 + 2*K3 + K4)
      END DO
      END SUBROUTINE ADVANCE
      SUBROUTINE BCND
      END SUBROUTINE BCND
      SUBROUTINE ICND
      END SUBROUTINE ICND
      SUBROUTINE FOPT
      END SUBROUTINE FOPT
      SUBROUTINE PVLS
      END SUBROUTINE PVLS
"""

CONSTANTS = {
    "ISW": 1, "NBC": 0, "NINT": 0, "JAC": 0, "NTST": 200, "NCOL": 5, "IAD": 1, "ILP": 1, "ISP": 2, "NMX": 1500, "NPR": 0,
    "MXBF": 0, "IID": 2, "IPLT": 0, "ITMX": 20, "ITNW": 9, "NWTN": 3, "EPSL": 1e-11, "EPSU": 1e-11, "EPSS": 1e-9,
    "DS": 0.01, "DSMIN": 1e-8, "DSMAX": 0.5, "IADS": 1, "NPAR": 36, "THL": {11: 0.0},
}  # fmt: skip
LABELS = {1: "BP", 2: "LP", 3: "HB", 4: "UZ", 5: "LP", 6: "BP", 7: "PD", 8: "TR", 9: "EP", -4: "UZ", -9: "MX"}


@dataclass(frozen=True)
class Run:
    """One run: its constants, and the point it begins at: the name of a run, a label and its number there."""

    constants: dict
    start: tuple[str, str, int] | None = None


@dataclass(frozen=True)
class Study:
    """A vector field, its first point, and its runs by name. ``oscillator`` says that the last two states are a forcing."""

    dimension: int
    field: str
    start: str
    runs: dict[str, Run] = field(default_factory=dict)
    oscillator: bool = False


def lines(text: str) -> str:
    """Return statements that are parted by semicolons, one a line."""
    return "\n      ".join(part.strip() for part in text.split(";"))


def run(study: Study) -> dict[str, list]:
    """Return the labelled points of all runs of a study."""
    found: dict[str, list] = {}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "study.f90").write_text(PROGRAM.format(field=lines(study.field), start=lines(study.start)))
        objects = [str(path) for path in sorted(LIBRARY.glob("*.o"))]
        command = ["gfortran", "-O2", "-fopenmp", "study.f90", *objects, "-o", "study"]
        subprocess.run(command, cwd=folder, check=True, capture_output=True)
        for name, each in study.runs.items():
            constants = {**CONSTANTS, "NDIM": study.dimension, "IRS": 0, **each.constants}
            if each.start is not None:
                origin, label, number = each.start
                at = [row for row in found[origin] if row["label"] == label][number - 1]
                constants["IRS"] = at["number"]
                (folder / "fort.3").write_text((folder / f"{origin}.8").read_text())
            (folder / "fort.2").write_text(", ".join(f"{key}={value}" for key, value in constants.items()) + "\n")
            subprocess.run(["./study"], cwd=folder, check=True, capture_output=True, env=os.environ | {"OMP_NUM_THREADS": "1"})
            (folder / "fort.8").replace(folder / f"{name}.8")
            found[name] = labelled((folder / "fort.7").read_text(), constants, study)
    return {name: [{k: v for k, v in row.items() if k != "number"} for row in rows] for name, rows in found.items()}


def labelled(text: str, constants: dict, study: Study) -> list[dict]:
    """Return the labelled points of AUTO's file of a branch."""
    table = [line.replace("MAX U", "MAX_U").split() for line in text.splitlines()]
    rows = [line for line in table if line[0] != "0"]
    names = next(line for line in table if "TY" in line)
    periodic = constants["IPS"] == 2
    found = []
    for row in rows:
        if row[3] != "0" and abs(int(row[1])) > 1:  # the first point is not corrected
            square = float(row[5]) ** 2 - (1.0 if study.oscillator else 0.0)
            second = {"second": float(row[names.index("PAR(1)")])} if constants["IPS"] == 9 and "PAR(1)" in names[5:] else {}
            found.append({
                "label": LABELS[int(row[2]) if int(row[2]) < 0 else int(row[2]) % 10], "parameter": float(row[4]),
                "period": float(row[-1]) if periodic else 0.0, "square": square, **second,
                "number": int(row[3]),
            })  # fmt: skip
    return found


def ends(*values: float, period: float | None = None) -> str:
    """Return UZSTOP: values of the primary parameter, which is PAR(1), and of the period."""
    parts = [f"1: [{', '.join(map(str, values))}]"] + ([] if period is None else [f"11: {period}"])
    return "{" + ", ".join(parts) + "}"


EQUILIBRIA = {"IPS": 1, "ICP": [1]}
CYCLES = {"IPS": 2, "ICP": [1, 11]}
HOMOCLINIC = {"IPS": 9, "ILP": 0, "ISP": 0, "NPAR": 40, "ISTART": 1, "THL": {}}
#: Tolerances at which special points are found that AUTO-07p gives up at tighter ones, in silence.
LOOSE = {"EPSL": 1e-10, "EPSU": 1e-10, "EPSS": 1e-7, "DS": 0.001, "DSMAX": 0.02}
#: Those of the demo ``kpr`` itself, for runs on the way to a first homoclinic orbit.
LOOSEST = {"EPSL": 1e-7, "EPSU": 1e-7, "EPSS": 1e-5, "DS": 0.1, "DSMIN": 0.001, "DSMAX": 2.0, "NTST": 60}
#: A branch that shrinks onto a Hopf point passes it, labelled BP (in ``ppp`` LP) and misplaced, and comes back: it is stopped.
SHRINKING = {**CYCLES, "SP": "['BP1']"}

LORENZ = "F(1) = 10*(U(2) - U(1)); F(2) = PAR(1)*U(1) - U(2) - U(1)*U(3); F(3) = U(1)*U(2) - 8D0/3*U(3)"

STUDIES = {
    # x" + .1 x' + x + x^3 = .5 cos(w t): PAR(1) is w; (u3, u4) = (sin, cos) on the circle
    "duffing": Study(
        4,
        "S = U(3)**2 + U(4)**2; F(1) = U(2); F(2) = -0.1D0*U(2) - U(1) - U(1)**3 + 0.5D0*U(4);"
        "F(3) = U(3) + PAR(1)*U(4) - U(3)*S; F(4) = -PAR(1)*U(3) + U(4) - U(4)*S",
        "PAR(1) = 4.0D0; PAR(11) = TPI/PAR(1); U(1) = -0.5D0*COS(TPI*T)/15; U(2) = 2.0D0*SIN(TPI*T)/15;"
        "U(3) = SIN(TPI*T); U(4) = COS(TPI*T)",
        {"down": Run({**CYCLES, "DS": -0.01, "UZSTOP": ends(0.3)})},
        oscillator=True,
    ),
    # the same with 3 cos(w t)
    "duffing strong": Study(
        4,
        "S = U(3)**2 + U(4)**2; F(1) = U(2); F(2) = -0.1D0*U(2) - U(1) - U(1)**3 + 3*U(4);"
        "F(3) = U(3) + PAR(1)*U(4) - U(3)*S; F(4) = -PAR(1)*U(3) + U(4) - U(4)*S",
        "PAR(1) = 4.0D0; PAR(11) = TPI/PAR(1); U(1) = -3*COS(TPI*T)/15; U(2) = 12*SIN(TPI*T)/15;"
        "U(3) = SIN(TPI*T); U(4) = COS(TPI*T)",
        {"down": Run({**CYCLES, "DS": -0.01, "UZSTOP": ends(0.3)})},
        oscillator=True,
    ),
    # x" - .2 (1 - x^2) x' + x = cos(w t)
    "forced van der pol": Study(
        4,
        "S = U(3)**2 + U(4)**2; F(1) = U(2); F(2) = 0.2D0*(1 - U(1)**2)*U(2) - U(1) + U(4);"
        "F(3) = U(3) + PAR(1)*U(4) - U(3)*S; F(4) = -PAR(1)*U(3) + U(4) - U(4)*S",
        "PAR(1) = 3.0D0; PAR(11) = TPI/PAR(1); U(1) = -COS(TPI*T)/8; U(2) = 3*SIN(TPI*T)/8;"
        "U(3) = SIN(TPI*T); U(4) = COS(TPI*T)",
        {"down": Run({**CYCLES, "DS": -0.01, "UZSTOP": ends(0.3)})},
        oscillator=True,
    ),
    # demo frc: PAR(1) is the frequency, PAR(2) the amplitude of the forcing; (u3, u4) = (sin, cos)
    "frc": Study(
        4,
        "S = U(3)**2 + U(4)**2; F(1) = (U(1)*(U(1) - 0.5D0)*(1 - U(1)) - U(2))/0.005D0;"
        "F(2) = U(1) - U(2) - (0.5D0 + PAR(2)*U(3)); F(3) = U(3) + PAR(1)*U(4) - U(3)*S; F(4) = -PAR(1)*U(3) + U(4) - U(4)*S",
        "PAR(1) = 100; PAR(2) = 0; PAR(11) = TPI/PAR(1); U(1) = 0.5D0; U(2) = 0; U(3) = SIN(TPI*T); U(4) = COS(TPI*T)",
        {
            "stronger": Run({**CYCLES, "ICP": [2, 11], "UZSTOP": "{2: 0.2}"}),
            "slower": Run(
                {**CYCLES, "DS": -0.5, "DSMAX": 1.0, "UZR": "{11: [1, 2, 3, 4]}", "UZSTOP": "{11: 5}"},
                ("stronger", "UZ", 1),
            ),
        },
        oscillator=True,
    ),
    # demo ab: PAR(1) is p1, PAR(2) p2, and p3 = 3
    **{
        f"ab {p2}": Study(
            2,
            "S = EXP(U(2)); F(1) = -U(1) + PAR(1)*(1 - U(1))*S; F(2) = -U(2) + PAR(1)*PAR(2)*(1 - U(1))*S - 3*U(2)",
            f"PAR(1) = 0; PAR(2) = {p2}; U = 0",
            {
                "rest": Run({**EQUILIBRIA, "UZSTOP": ends(0.35)}),
                "cycles": Run({**SHRINKING, "UZSTOP": ends(0.01, 0.35, period=30)}, ("rest", "HB", 1)),
            },
        )
        for p2 in (14, 18)
    },
    # demo abc: PAR(1) is d; beta = 1.55, B = 8, sigma = .04
    "abc": Study(
        3,
        "S = EXP(U(3)); F(1) = -U(1) + PAR(1)*(1 - U(1))*S; F(2) = -U(2) + PAR(1)*S*(1 - U(1) - 0.04D0*U(2));"
        "F(3) = -U(3) - 1.55D0*U(3) + PAR(1)*8*S*(1 - U(1) + 0.04D0*U(2))",
        "PAR(1) = 0; U = 0",
        {
            "rest": Run({**EQUILIBRIA, "UZSTOP": ends(0.4)}),
            **{f"cycles {n}": Run({**SHRINKING, "UZSTOP": ends(0.1, 0.4, period=30)}, ("rest", "HB", n)) for n in (1, 2, 3, 4)},
        },
    ),
    # demos lor and lrz: PAR(1) is rho; sigma = 10, beta = 8/3
    "lor": Study(
        3,
        LORENZ,
        "PAR(1) = 280; PAR(11) = 0.43325D0; U = (/ -4.0674614D0, -24.183805D0, 219.00338D0 /); CALL ADVANCE(NDIM,U,PAR,T)",
        {
            "first": Run({**CYCLES, "DS": -0.5, "DSMAX": 5.0, "UZSTOP": ends(200, 400)}),
            "double": Run({**CYCLES, "DS": -0.1, "DSMAX": 2.0, "ISW": -1, "UZSTOP": ends(200, 400)}, ("first", "PD", 1)),
        },
    ),
    "lrz": Study(
        3,
        LORENZ,
        "PAR(1) = 20; U = (/ SQRT(8D0/3*19), SQRT(8D0/3*19), 19D0 /)",
        {
            "rest": Run({**EQUILIBRIA, "UZSTOP": ends(15, 30)}),
            "cycles": Run({**CYCLES, "DSMAX": 0.5, "UZSTOP": ends(10, 30, period=4)}, ("rest", "HB", 1)),
        },
    ),
    # demo pp2: PAR(1) is p1; p2 = p4 = 3, p3 = 5
    "pp2": Study(
        2,
        "S = EXP(-5*U(1)); F(1) = 3*U(1)*(1 - U(1)) - U(1)*U(2) - PAR(1)*(1 - S); F(2) = -U(2) + 3*U(1)*U(2)",
        "PAR(1) = 0.5D0; U(1) = 1D0/3; U(2) = 2 - 1.5D0*(1 - EXP(-5D0/3))",
        {
            "rest": Run({**EQUILIBRIA, "UZSTOP": ends(0.1, 0.8)}),
            "cycles": Run({**CYCLES, "UZSTOP": ends(0.1, 0.9, period=36)}, ("rest", "HB", 1)),
        },
    ),
    # demos pp3 (p4 = 4) and ppp (p4 = 3): PAR(1) is p1; p2 = 1/4, p3 = 1/2, p5 = 3, p6 = 5
    **{
        name: Study(
            3,
            f"F(1) = U(1)*(1 - U(1)) - {p4}*U(1)*U(2); F(2) = -0.25D0*U(2) + {p4}*U(1)*U(2) - 3*U(2)*U(3)"
            "- PAR(1)*(1 - EXP(-5*U(2))); F(3) = -0.5D0*U(3) + 3*U(2)*U(3)",
            f"PAR(1) = 0; U(2) = 1D0/6; U(1) = 1 - {p4}*U(2); U(3) = ({p4}*U(1) - 0.25D0)/3",
            {
                "rest": Run({**EQUILIBRIA, "UZSTOP": ends(-0.1, 1.0)}),
                "cycles": Run({**CYCLES, "SP": "['BP2']", "UZSTOP": ends(-0.1, 1.0, period=60)}, ("rest", "HB", 1)),
            },
        )
        for name, p4 in (("pp3", 4),)
    },
    # demo plp at S0 = 111: the cycles are an isola, from the one at rho = 4 each way to its fold
    "plp isola": Study(
        2,
        "S = PAR(1)*U(1)*U(2)/(1 + U(1) + 0.1D0*U(1)**2); F(1) = 111 - U(1) - S; F(2) = 0.2D0*(500 - U(2)) - S",
        "PAR(1) = 4; PAR(11) = 6.90214397D0; U = (/ 42.692845D0, 91.853585D0 /); CALL ADVANCE(NDIM,U,PAR,T)",
        {
            "up": Run({**CYCLES, **LOOSE, "DS": 0.1, "DSMAX": 2, "SP": "['LP1']"}),
            "down": Run({**CYCLES, **LOOSE, "DS": -0.1, "DSMAX": 2, "SP": "['LP1']"}),
        },
    ),
    # demo ppp: as pp3 with p4 = 3, from the equilibrium without U(3)
    "ppp": Study(
        3,
        "F(1) = U(1)*(1 - U(1)) - 3*U(1)*U(2); F(2) = -0.25D0*U(2) + 3*U(1)*U(2) - 3*U(2)*U(3)"
        "- PAR(1)*(1 - EXP(-5*U(2))); F(3) = -0.5D0*U(3) + 3*U(2)*U(3)",
        "PAR(1) = 0; U(1) = 1D0/12; U(2) = 11D0/36; U(3) = 0",
        {
            "rest": Run({**EQUILIBRIA, "UZSTOP": ends(0.36)}),
            "cycles": Run(
                {**CYCLES, **LOOSE, "DSMAX": 0.1, "SP": "['LP1']", "UZSTOP": ends(-0.1, 0.6, period=60)}, ("rest", "HB", 1)
            ),
        },
    ),
    # Roessler's equations, a = b = .2: PAR(1) is c; each run doubles the period
    "roessler": Study(
        3,
        "F(1) = -U(2) - U(3); F(2) = U(1) + 0.2D0*U(2); F(3) = 0.2D0 + U(3)*(U(1) - PAR(1))",
        "PAR(1) = 2; PAR(11) = 5.7098559D0; U = (/ -3.0860105D0, 0.0187698D0, 0.0452997D0 /); CALL ADVANCE(NDIM,U,PAR,T)",
        {
            "1": Run({**CYCLES, **LOOSE, "UZSTOP": ends(1, 4.3)}),
            **{
                str(2 * n): Run(
                    {**CYCLES, **LOOSE, "NTST": 400 if n > 2 else 200, "ISW": -1, "UZSTOP": ends(1, 4.3)}, (str(n), "PD", 1)
                )
                for n in (1, 2, 4, 8)
            },
        },
    ),
    # demo tor: PAR(1) is rn
    "tor": Study(
        3,
        "S = U(2) - U(1); F(1) = (-(0.5D0 + PAR(1))*U(1) + 0.5D0*U(2) - 0.328578D0*U(1)**3 + 0.933578D0*S**3)/0.6D0;"
        "F(2) = 0.5D0*U(1) + 0.1D0*U(2) - U(3) - 0.933578D0*S**3; F(3) = U(2)",
        "PAR(1) = -0.9D0; U = 0",
        {
            "rest": Run({**EQUILIBRIA, "UZSTOP": ends(-0.91, -0.4)}),
            "cycles": Run({**CYCLES, **LOOSE, "UZSTOP": ends(-0.91, -0.4, period=30)}, ("rest", "HB", 1)),
            "beside": Run({**CYCLES, **LOOSE, "ISW": -1, "UZSTOP": ends(-0.91, -0.4, period=30)}, ("cycles", "BP", 1)),
        },
    ),
    # demo kpr: PAR(1) is lambda, PAR(2) kappa, 1 / epsilon = 10; a homoclinic orbit by homotopy (PAR(15) is the distance from
    # the saddle at which it begins), made longer, then inclination flips (PAR(33)) and a zero eigenvalue (PAR(29), PAR(30))
    "kpr": Study(
        3,
        "F(1) = 10*(PAR(2)*U(2) - U(1)**3 + 3*U(1) - PAR(1)); F(2) = U(1) - 2*U(2) + U(3); F(3) = U(2) - U(3)",
        "PAR(1) = -1.851185124D0; PAR(2) = -0.15D0; PAR(11) = 0.1D0; PAR(12:14) = -0.9591016D0; PAR(15) = -0.00001D0",
        {
            "homotopy": Run(
                {**HOMOCLINIC, **LOOSEST, "ICP": [11, 17], "ISTART": 3, "NMX": 400, "SP": "['UZ1']", "UZR": "{17: 0}"}
            ),
            "longer": Run(
                {**HOMOCLINIC, **LOOSEST, "ICP": [11, 1], "ISTART": 3, "NMX": 400, "UZSTOP": "{11: 70}"}, ("homotopy", "UZ", 1)
            ),
            "adjoint": Run({**HOMOCLINIC, **LOOSEST, "ICP": [11, 1], "ITWIST": 1, "NMX": 2}, ("longer", "UZ", 1)),
            "flips": Run(
                {
                    **HOMOCLINIC,
                    **LOOSEST,
                    "ICP": [2, 1, 10, 29, 30, 33],
                    "ITWIST": 1,
                    "NMX": 400,
                    "DS": -0.01,
                    "DSMAX": 0.05,
                    "IPSI": [9, 10, 13],
                    "UZR": "{33: 0}",
                    "UZSTOP": "{2: -0.6}",
                },
                ("adjoint", "EP", 1),
            ),
        },
    ),
    # demo plp: PAR(1) is rho; S0 = 110, A0 = 500, alpha = .2, K = .1
    "plp": Study(
        2,
        "S = PAR(1)*U(1)*U(2)/(1 + U(1) + 0.1D0*U(1)**2); F(1) = 110 - U(1) - S; F(2) = 0.2D0*(500 - U(2)) - S",
        "PAR(1) = 2.021628D0; U(1) = 45.55974D0; U(2) = 177.7987D0",
        {
            "rest": Run({**EQUILIBRIA, "DSMAX": 3.0, "UZSTOP": ends(6.0)}),
            **{
                f"cycles {n}": Run(
                    {**CYCLES, **LOOSE, "DS": 0.1, "DSMAX": 3, "SP": "['BP1']", "UZSTOP": ends(1, 6, period=30)},
                    ("rest", "HB", n),
                )
                for n in (1, 2)
            },
        },
    ),
}


def main(names: list[str]) -> None:
    notes = json.loads(NOTES.read_text()) if NOTES.exists() else {}
    for name in names or STUDIES:
        notes[name] = run(STUDIES[name])
        for each, rows in notes[name].items():
            print(name, each, *(f"{row['label']} {row['parameter']:.11g} {row['period']:.11g}" for row in rows[:20]), sep="; ")
    NOTES.write_text(json.dumps(notes, indent=1) + "\n")


if __name__ == "__main__":
    main(sys.argv[1:])
