"""Von Karman's flow above a rotating disk (AUTO demo ``kar``; Lentini & Keller 1980), on a domain of length 500.

h' = f, f'' = f^2 - g^2 - 2 gam g - 2 h f', g'' = 2 gam f + 2 f g - 2 h g'; at the disk h = f = 0, g = 1 - gam; far away
h = inf, and f, g decay as the linearized equations say. Six conditions for five states: gam and inf are both free. The
branch winds through many folds. Values by collocation of degree 8 in extended precision (``bank.longdouble``), folds as
boundary value problems with the null vector among the states; meshes of N and 2 N intervals agree to 1e-18.
"""

import functools
import math

from bank.case import Case, Special, run_until
from contin import BoundaryValueProblem, MeshControl, solve


def rhs(t, u, p):
    h, f, df, g, dg = u
    return (
        p.length * f,
        p.length * df,
        p.length * (f**2 - g**2 - 2 * p.gam * g - 2 * h * df),
        p.length * dg,
        p.length * (2 * p.gam * f + 2 * f * g - 2 * h * dg),
    )


def boundary(a, b, p):
    decay = math.sqrt((math.sqrt(p.inf**4 + 4 * p.gam**2) + p.inf**2) / 2)
    return (
        a.h, a.f, a.g - 1 + p.gam, b.h - p.inf,
        (p.inf + decay) * b.f + b.df - p.gam / decay * b.g,
        p.gam / decay * b.f + (p.inf + decay) * b.g + b.dg,
    )  # fmt: skip


@functools.cache
def problem():
    return BoundaryValueProblem(rhs, boundary, ["h", "f", "df", "g", "dg"], {"gam": 1.0, "inf": 0.0, "length": 500.0})


def run():
    start = solve(problem(), [0] * 5, free=["inf"], intervals=40)
    return run_until(
        start, ["gam", "inf"], 8, direction=-1, limits={"gam": (-2, 2)}, zeros={"gam": [0.0]}, mesh=MeshControl(tolerance=1e-10)
    )


CASES = [
    Case("kar", run, [
        Special("UZ", {"gam": 0.0, "inf": 0.442237055104801212}),
        Special("LP", {"gam": -0.1605387612807513584, "inf": -0.1371803731261785795}),
        Special("UZ", {"gam": 0.0, "inf": 0.223861666964771705}),
        Special("LP", {"gam": 0.0745256302696040677, "inf": -0.22506999708154968}),
        Special("UZ", {"gam": 0.0, "inf": 0.1936873206322102193}),
        Special("LP", {"gam": -0.0574122370287055497, "inf": -0.217073468938980441}),
        Special("UZ", {"gam": 0.0, "inf": 0.1870987587683658085}),
        Special("LP", {"gam": 0.0507638743764611991, "inf": -0.211978617507530008}),
    ]),
]  # fmt: skip
