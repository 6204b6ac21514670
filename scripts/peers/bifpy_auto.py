"""bifpy (pip; needs gfortran, make): AUTO-07p driven from Python, functions transpiled to Fortran and compiled in every run.

    python bifpy_auto.py half|cell BP|LP INTERVALS DEGREE TOLERANCE LONGEST_STEP

prints one line of JSON. Run by an interpreter that has bifpy; nothing else is needed. The statements are those of ``auto/``, in
Python; Jacobians are bifpy's own (symbolic). Values come with the eleven digits of AUTO's files.
"""

from __future__ import annotations

import json
import math
import sys
import time

NU = 0.3


def strains(M1, M3, kappa):
    """Return w1, w3 of the law (9)."""
    p = M1 + (1 - NU) * kappa
    r = (p * p + M3 * M3) ** 0.5
    a = (p + r) / 2
    c = NU * kappa + a
    return c * a / r, c * M3 / (2 * r)


def spin(q0, q1, q2, q3, w1, w3, length):
    """Return dq/dt for w2 = 0."""
    h = length / 2
    return [h * (-q1 * w1 - q3 * w3), h * (q0 * w1 + q2 * w3), h * (q3 * w1 - q1 * w3), h * (-q2 * w1 + q0 * w3)]


def second(q0, q1, q2, q3):
    """Return the lab components of d2."""
    return 2 * (q1 * q2 - q0 * q3), q0**2 - q1**2 + q2**2 - q3**2, 2 * (q2 * q3 + q0 * q1)


def half_rates(u, p):
    """Return the thirteen components, over [0, L/2]."""
    M1, M2, M3, R1, R2, R3, q0, q1, q2, q3 = (u[i] for i in range(10))
    w1, w3 = strains(M1, M3, p[0])
    rates = [M2 * w3 + R2, M3 * w1 - M1 * w3 - R1, -M2 * w1, R2 * w3, R3 * w1 - R1 * w3, -R2 * w1]
    third = [2 * (q1 * q3 + q0 * q2), 2 * (q2 * q3 - q0 * q1), q0**2 - q1**2 - q2**2 + q3**2]
    turning = spin(q0, q1, q2, q3, w1, w3, math.pi)
    return [math.pi * rate for rate in rates] + turning + [math.pi * rate for rate in third]


def half_conditions(a, b, p):
    """Return the conditions of mirrors at both ends."""
    q0, q1, q2, q3 = (b[i] for i in range(6, 10))
    return [
        a[2], a[3], a[4], a[6] - 1, a[7], a[8], a[9], a[10], a[11], a[12],
        2 * (q1 * q3 + q0 * q2), 2 * (q2 * q3 - q0 * q1), b[12],
    ]  # fmt: skip


def half_start(u, p, t):
    """The planar circle at kappa_n = 2.3."""
    import numpy as np

    p[0] = 2.3
    for i in range(13):
        u[i] = 0.0
    u[0], u[6], u[7] = -1.3, np.cos(math.pi * t / 2), np.sin(math.pi * t / 2)
    u[11], u[12] = np.cos(math.pi * t) - 1, np.sin(math.pi * t)


def cell_rates(u, p):
    """Return the quarter wave of (1, 2); p = kappa_n, M1, M2."""
    q0, q1, q2, q3 = (u[i] for i in range(4))
    M1 = (q0**2 + q1**2 - q2**2 - q3**2) * p[1] + 2 * (q1 * q2 + q0 * q3) * p[2]
    M3 = 2 * (q1 * q3 + q0 * q2) * p[1] + 2 * (q2 * q3 - q0 * q1) * p[2]
    return spin(q0, q1, q2, q3, *strains(M1, M3, p[0]), math.pi / 4)


def cell_conditions(a, b, p):
    """Return the conditions: the frame at S = 0; d2 normal to the moment at the other end, turned about it by pi/4."""
    x, y, z = second(b[0], b[1], b[2], b[3])
    c = math.sqrt(0.5)
    moment = -((p[1] * p[1] + p[2] * p[2]) ** 0.5)
    return [a[0] - 1, a[1], a[2], a[3], x * p[1] + y * p[2], c * z * moment - c * (y * p[1] - x * p[2])]


def cell_start(u, p, t):
    """The planar circle at kappa_n = 2.3."""
    import numpy as np

    p[0], p[1], p[2] = 2.3, -1.3, 0.0
    u[0], u[1], u[2], u[3] = np.cos(math.pi * t / 8), np.sin(math.pi * t / 8), 0.0, 0.0


STATEMENTS = {
    "half": (half_rates, half_start, half_conditions, 13, 13, [1]),
    "cell": (cell_rates, cell_start, cell_conditions, 4, 6, [1, 2, 3]),
}


def study(statement, stop, intervals, degree, tolerance, longest_step):
    """As `peers.auto_07p.study`; ``seconds`` is all that the two calls of bifpy took, compiling included."""
    began = time.perf_counter()
    from bifpy import auto

    imported = time.perf_counter()
    rates, start, conditions, ndim, nbc, icu = STATEMENTS[statement]
    settings = {
        "ips": auto.IPS_GENERAL_BVP, "ndim": ndim, "npar": len(icu), "nbc": nbc, "nint": 0, "nmx": 2000, "ntst": intervals,
        "ncol": degree, "iad": 3, "ilp": 0, "isp": 1, "mxbf": 0, "iads": 1, "itmx": 9, "itnw": 7, "nwtn": 3, "jac": 1,
        "ds": 0.05, "dsmin": 1e-6, "dsmax": longest_step, "rl0": -1e300, "rl1": 1e300, "a0": -1e300, "a1": 1e300,
        "epsl": tolerance, "epsu": tolerance, "epss": 10 * tolerance, "iid": 0, "iplt": 0,
    }  # fmt: skip
    options = {"icu": icu, "bcnd": conditions, "transpile": True, "jac": auto.AUTO_JACOBIAN, "bcnd_jac": auto.AUTO_JACOBIAN}
    circle = auto.run(rates, start, settings, sp=["BP1"], **options).branches[0]
    point = next(point for point in circle.points if point.point_type == auto.PointType.BRANCH_POINT)
    branch = auto.restart(rates, settings | {"ilp": 1}, restart_point=point, isw=-1, sp=[f"{stop}1"], **options).branches[0]
    labels = {auto.PointType.FOLD: [], auto.PointType.BRANCH_POINT: []}
    for point in branch.points:
        if point.point_type in labels:
            labels[point.point_type].append(float(point.parameters[0]))
    folds, ends = labels.values()
    return {
        "seconds": time.perf_counter() - imported, "import_seconds": imported - began, "points": len(branch.points),
        "fold": folds[0] if folds else None, "end": ends[-1] if ends else None,
    }  # fmt: skip


if __name__ == "__main__":
    which, last, *numbers = sys.argv[1:]
    print(json.dumps(study(which, last, int(numbers[0]), int(numbers[1]), float(numbers[2]), float(numbers[3]))))
