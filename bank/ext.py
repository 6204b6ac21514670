"""A problem with spurious solutions on a coarse fixed mesh (AUTO demo ``ext``): u'' + (lam pi)^2 sin(u + u^2 + u^3) = 0.

u(0) = u(1) = 0. The branches that leave the trivial one at lam = k are made of m positive and n negative half-periods of the
oscillator w'' = -sin(w + w^2 + w^3): lam pi = m T+ + n T-, functions of the amplitude (quadratures by Gauss's rule with mpmath,
30 digits); the folds are where that turns. There are no branch points on them. Means at lam = 4.6 by collocation in extended
precision (``bank.longdouble``), good to 1e-17.
"""

import functools
import math

from bank.case import Case, Special
from contin import BoundaryValueProblem, solve, trace


def rhs(t, u, p):
    return u.v, -((p.lam * math.pi) ** 2) * math.sin(u.u + u.u**2 + u.u**3)


def boundary(a, b, p):
    return a.u, b.u


@functools.cache
def problem():
    return BoundaryValueProblem(rhs, boundary, ["u", "v"], {"lam": 0.5}, functionals={"mean": lambda t, u, p: u.u})


@functools.cache
def trivial():
    return trace(solve(problem(), [0, 0]), free=["lam"], limits={"lam": (0, 4.6)})


def half_branch(which, sign):
    """The half of branch ``which`` that leaves with u'(0) of this sign."""
    point = trivial().labelled("BP")[which - 1]
    slope = point.system.states(point.details.tangents[1])[0, 1]
    return trace(point, branch=1, direction=1 if slope * sign > 0 else -1, limits={"lam": (0, 4.6)})


def at(which, sign, *points):
    """The last of the points (lam, mean) is the end, the others are folds."""
    specials = [Special("EP" if lam == 4.6 else "LP", {"lam": lam, "mean": mean}) for lam, mean in points]
    name = f"ext: branch {which}{'+' if sign > 0 else '-'}"
    return Case(name, functools.partial(half_branch, which, sign), specials)


TWO = (2.01087101931915575, -0.0499492325685838114), (1.94570654463751874, -0.160666493921973424), (4.6, 0.5101147035805007479)
CASES = [
    Case("ext", trivial, [*(Special("BP", {"lam": float(k), "mean": 0.0}) for k in range(1, 5)), Special("EP", {"lam": 4.6})]),
    at(1, 1, (0.814237743989860714, 0.387766103340554514), (4.6, 0.936941079978372276)),
    at(1, -1, (1.16162468554394204, -0.393030329216958734), (1.100453273371239, -0.738841286538528767),
       (4.6, -1.434372257988985708)),
    *(at(2, sign, *TWO) for sign in (1, -1)),
    at(3, 1, (2.7646951672783799, 0.0133646520537956093), (4.6, 0.4238201642446645063)),
    at(3, -1, (3.16187826757309742, -0.177461229908135964), (3.06427151342421766, -0.333862450452552532),
       (4.6, 0.0832884628220526372)),
]  # fmt: skip
