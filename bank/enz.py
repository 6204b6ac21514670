"""Two cells with an enzyme (AUTO demo ``enz``; Kernevez 1980): s0 - 2 s1 + s2 = 100 r(s1), s0 - 2 s2 + s1 = 100 r(s2).

r(s) = s / (1 + s + s^2). With s1 = s2 = s, s0 = s + 100 r(s): folds where 100 r' = -1, and where 100 r' = -3 the branch of
unequal cells leaves, a closed one with four folds. Values by mpmath with 30 digits.
"""

import functools

from bank.case import Case, Special
from contin import AlgebraicProblem, solve, trace


def uptake(s, kappa):
    return s / (1 + s + kappa * s**2)


def residual(u, p):
    return (
        p.s0 - 2 * u.s1 + u.s2 - p.rho * uptake(u.s1, p.kappa),
        p.s0 + p.mu - 2 * u.s2 + u.s1 - p.rho * uptake(u.s2, p.kappa),
    )


@functools.cache
def problem():
    parameters = {"s0": 0.0, "mu": 0.0, "rho": 100.0, "kappa": 1.0}
    functionals = {"S1": lambda u, p: u.s1, "S2": lambda u, p: u.s2}
    return AlgebraicProblem(residual, ["s1", "s2"], parameters, functionals=functionals)


@functools.cache
def equal():
    return trace(solve(problem(), [0.0, 0.0]), free=["s0"], limits={"s0": (-1, 36)})


def unequal(sign):
    """The closed branch, left so that s1 - s2 first has this sign."""
    point = equal().labelled("BP")[0]
    s1, s2, _ = point.details.tangents[1]
    return trace(point, branch=1, direction=1 if (s1 - s2) * sign > 0 else -1, limits={"s0": (-1, 36)})


def same(label, s0, s):
    return Special(label, {"s0": s0, "S1": s, "S2": s})


LEFT, RIGHT = same("BP", 34.2228865441901888, 1.17417371912802743), same("BP", 22.1816379261242317, 4.39447275198252498)
FIRST = 25.372714838124003, 0.57173850606929085, 5.8840799822237787
SECOND = 26.6220717700449204, 1.04795507827801, 8.7828067168653113


def fold(values, sign):
    s0, low, high = values
    return Special("LP", {"s0": s0, "S1": low if sign < 0 else high, "S2": high if sign < 0 else low})


CASES = [
    Case("enz", equal, [
        same("LP", 34.3569249985261966, 1.04836197418223969), LEFT, RIGHT,
        same("LP", 18.8870676579242599, 8.82220033343325188), same("EP", 36.0, 33.0672313237318863),
    ]),
    *(
        Case(f"enz: unequal {'+' if sign > 0 else '-'}", functools.partial(unequal, sign), [
            fold(FIRST, sign), fold(SECOND, sign), RIGHT, fold(SECOND, -sign), fold(FIRST, -sign),
            Special("EP", {"s0": 34.2228865441901888}),
        ])
        for sign in (1, -1)
    ),
]  # fmt: skip
