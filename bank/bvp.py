"""A nonlinear eigenvalue problem (AUTO demo ``bvp``): u'' + (lam pi)^2 u = u^2, u(0) = u(1) = 0, mean of u = ``mean``.

Branches leave the trivial one at lam = 1, 2, 3, ... On them u is made of m positive and n negative half-periods, |m - n| <= 1,
of the oscillator w'' = w^2 - w of energy E (u = (lam pi)^2 w, s = lam pi t): lam pi = m T+(E) + n T-(E), and the mean likewise
(complete elliptic integrals). Two branches turn: (m, n) = (1, 2) and (2, 3). Values by mpmath with 30 digits.
"""

import functools
import math

from bank.case import Case, Special
from contin import BoundaryValueProblem, solve, trace


def rhs(t, u, p):
    return u.v, u.u**2 - (p.lam * math.pi) ** 2 * u.u


def boundary(a, b, p):
    return a.u, b.u


def integrals(t, u, p):
    return (u.u - p.mean,)


@functools.cache
def problem():
    return BoundaryValueProblem(rhs, boundary, ["u", "v"], {"lam": 0.5, "mean": 0.0}, integrals=integrals)


@functools.cache
def trivial():
    start = solve(problem(), [0, 0], free=["mean"])
    return trace(start, free=["lam", "mean"], limits={"lam": (0, 5.5)})


def half_branch(which, sign):
    """The half of branch ``which`` that leaves with u'(0) of this sign."""
    point = trivial().labelled("BP")[which - 1]
    slope = point.system.states(point.details.tangents[1])[0, 1]
    return trace(
        point, branch=1, direction=1 if slope * sign > 0 else -1,
        limits={"lam": (0, 5.5), "mean": (-9, 9)}, zeros={"mean": [-6.0, -3.0, 3.0, 6.0]},
    )  # fmt: skip


def up(*lams):
    """Means of 3, 6, 9 at these values of lam."""
    return [Special("UZ" if mean < 9 else "EP", {"lam": lam, "mean": float(mean)}) for lam, mean in zip(lams, (3, 6, 9))]


def at(which, sign, *specials):
    return Case(f"bvp: branch {which}{'+' if sign > 0 else '-'}", functools.partial(half_branch, which, sign), specials)


CASES = [
    Case("bvp", trivial, [*(Special("BP", {"lam": float(k), "mean": 0.0}) for k in range(1, 6)), Special("EP", {"lam": 5.5})]),
    at(1, 1, *up(1.18420213934878521, 1.34134608461732657, 1.48027522890698679)),
    at(1, -1, Special("UZ", {"lam": 0.769102700734038466, "mean": -3.0}),
       Special("UZ", {"lam": 0.419633955893469674, "mean": -6.0}), Special("EP", {"lam": 0.0, "mean": -7.2551974569368714})),
    *(at(2, sign, *up(2.12177775588634234, 2.23497388575776205, 2.34099775622566366)) for sign in (1, -1)),
    at(3, 1, *up(3.06992006060219706, 3.14085551401237147, 3.21104704006399548)),
    at(3, -1, Special("LP", {"lam": 2.96313888340903638, "mean": -1.93212268378260943}),
       *up(3.13843266511645475, 3.22634728803214355, 3.30986833960985013)),
    *(at(4, sign, *up(4.0626853508806813, 4.12413314925357096, 4.18440441516422528)) for sign in (1, -1)),
    at(5, 1, *up(5.0424930228097147, 5.0865672709801656, 5.13104637981279476)),
    at(5, -1, Special("LP", {"lam": 4.978209977552065, "mean": -1.92422398388945565}),
       *up(5.08462621775202749, 5.13960760427097476, 5.19294024633590985)),
]  # fmt: skip
