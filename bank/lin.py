"""A linear eigenvalue problem (AUTO demo ``lin``): u'' + (lam pi)^2 u = 0, u(0) = p2, u(1) = 0, mean of u^2 = p3.

Branch points at lam = 1, 2, 3, ...; the branches of eigenfunctions stand upright, lam does not change on them. With p3
= 1 held, u = A sin(lam pi (1 - t)) gives p2 = A sin(lam pi), A^2 (1/2 - sin(2 lam pi) / (4 lam pi)) = 1: p2 turns where
that function of lam does. Values by mpmath with 40 digits.
"""

import functools
import math

from bank.case import Case, Special
from contin import BoundaryValueProblem, solve, trace


def rhs(t, u, p):
    return u.v, -((p.lam * math.pi) ** 2) * u.u


def boundary(a, b, p):
    return a.u - p.p2, b.u


def integrals(t, u, p):
    return (u.u**2 - p.p3,)


@functools.cache
def problem():
    return BoundaryValueProblem(rhs, boundary, ["u", "v"], {"lam": 0.5, "p2": 0.0, "p3": 0.0}, integrals=integrals)


@functools.cache
def trivial():
    start = solve(problem(), [0, 0], free=["p3"])
    return trace(start, free=["lam", "p3"], limits={"lam": (0, 5.5)})


@functools.cache
def upright(primary="p3"):
    """The first eigenfunction, up to p3 = 4."""
    first = trivial().labelled("BP")[0]
    return trace(first, branch=1, primary=primary, limits={"lam": (0, 5.5), "p3": (-1, 4)}, zeros={"p3": [1.0]})


def along_lam():
    return trace(upright().labelled("UZ")[0], free=["lam", "p2"], limits={"lam": (0.5, 3.5)}, zeros={"p2": [-1.0, 1.0]})


def along_p2():
    """With p2 as the primary parameter; started so that lam grows."""
    start = upright().labelled("UZ")[0]
    direction = 1 if start.system.states(start.x)[0, 1] < 0 else -1
    return trace(start, free=["p2", "lam"], direction=direction, limits={"lam": (0.5, 3.5)}, zeros={"p2": [-1.0, 1.0]})


def magnitudes(branch):
    """The branch with p2 turned positive where it is negative: the eigenfunction's sign is arbitrary."""
    for point in branch:
        point.parameters["p2"] = abs(point.parameters["p2"])
    return branch


AT_ONE = (1.22951201647838069, 1.73544486217350989, 2.23870429171625774, 2.74076832530359809, 3.24219356319317111)
ONE = [Special("UZ", {"lam": lam, "p2": 1.0}) for lam in AT_ONE]
END = Special("EP", {"lam": 3.5, "p2": math.sqrt(2)})
CASES = [
    Case("lin", trivial, [*(Special("BP", {"lam": float(k), "p3": 0.0}) for k in range(1, 6)), Special("EP", {"lam": 5.5})]),
    Case("lin: upright", upright, [Special("UZ", {"lam": 1.0, "p3": 1.0}), Special("EP", {"lam": 1.0, "p3": 4.0})]),
    Case("lin: upright, lam primary", functools.partial(upright, "lam"),
         [Special("UZ", {"lam": 1.0, "p3": 1.0}), Special("EP", {"lam": 1.0, "p3": 4.0})]),
    Case("lin: lam against p2", lambda: magnitudes(along_lam()), [*ONE, END]),
    Case("lin: p2 against lam", lambda: magnitudes(along_p2()),
         [ONE[0], Special("LP", {"lam": 1.464732108631284184, "p2": 1.4226318837195795853}),
          *ONE[1:3], Special("LP", {"lam": 2.4794272531577141645, "p2": 1.4171359467223524593}),
          *ONE[3:], Special("LP", {"lam": 3.485414449916292457, "p2": 1.4156902499872401791}), END]),
]  # fmt: skip
