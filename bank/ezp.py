"""Bratu's problem for complex u = x + i y (AUTO demo ``ezp``): u'' + lam exp(u) = 0, u(0) = u(1) = 0, lam real.

A fold of the real problem is a branch point of the complex one: there a pair of conjugate branches leaves. Closed form as for
the real problem, with complex s; lam(s) = 5 and 6 solved by mpmath with 40 digits. At the branch point lam turns on the real
branch; AUTO prints it as a fold and, next to it, as a branch point: one event here.
"""

import functools
import math

from bank.case import Case, Special
from contin import BoundaryValueProblem, solve, trace


def rhs(t, u, p):
    e = p.lam * math.exp(u.x)
    return u.dx, u.dy, -e * math.cos(u.y), -e * math.sin(u.y)


def boundary(a, b, p):
    return a.x, b.x, a.y, b.y


@functools.cache
def problem():
    functionals = {"re": lambda t, u, p: u.x, "im": lambda t, u, p: u.y}
    return BoundaryValueProblem(rhs, boundary, ["x", "y", "dx", "dy"], {"lam": 0.0}, functionals=functionals)


@functools.cache
def real():
    start = solve(problem(), [0, 0, 0, 0])
    return trace(start, free=["lam"], limits={"lam": (-1, 6), "re": (-1, 3)}, zeros={"lam": [2.0]})


def conjugate(sign):
    """The branch with this sign of y."""
    point = real().labelled("BP")[0]
    slope = point.system.states(point.details.tangents[1])[0, 3]
    return trace(
        point, branch=1, direction=1 if slope * sign > 0 else -1, limits={"lam": (-1, 6), "re": (-1, 3)}, zeros={"lam": [5.0]}
    )


CASES = [
    Case("ezp", real, [
        Special("UZ", {"lam": 2.0, "re": 0.21693600634518605541, "im": 0.0}),
        Special("BP", {"lam": 3.5138307191251612062, "re": 0.76190100115600444845, "im": 0.0}),
        Special("UZ", {"lam": 2.0, "re": 1.7749691786067486809, "im": 0.0}),
        Special("EP", {"lam": 0.50689904544581875399, "re": 3.0}),
    ]),
    *(
        Case(f"ezp: complex {'+' if sign > 0 else '-'}", functools.partial(conjugate, sign), [
            Special("UZ", {"lam": 5.0, "re": 0.60874350628563741457, "im": sign * 0.6117873709247442012}),
            Special("EP", {"lam": 6.0, "re": 0.52732049666608477196, "im": sign * 0.75315386920367042879}),
        ])
        for sign in (1, -1)
    ),
]  # fmt: skip
