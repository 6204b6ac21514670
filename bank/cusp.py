"""The cusp (AUTO demo ``cusp``): mu + lam x - x^3 = 0, and its folds in both parameters.

At lam = 1 the folds are at mu = -+2 / sqrt(27), x = +-1 / sqrt(3); they meet at the origin: lam = 3 x^2, mu = -2 x^3.
"""

import functools
import math

from bank.case import Case, Special
from contin import AlgebraicProblem, curve, solve, trace


def residual(u, p):
    return (p.mu + p.lam * u.x - u.x**3,)


@functools.cache
def problem():
    return AlgebraicProblem(residual, ["x"], {"mu": 0.0, "lam": 1.0}, functionals={"X": lambda u, p: u.x})


@functools.cache
def branch(direction):
    return trace(solve(problem(), [0.0]), free=["mu"], direction=direction, limits={"mu": (-2, 2)})


def folds(direction):
    return curve(branch(1).labelled("LP")[0], "lam", direction=direction, limits={"mu": (-2, 2), "lam": (-1, 2)})


FOLD, ROOT, END = 2 / math.sqrt(27), 1.52137970680456757, 2 * (2 / 3) ** 1.5
CASES = [
    *(
        Case(f"cusp {'+' if sign > 0 else '-'}", functools.partial(branch, sign), [
            Special("LP", {"mu": sign * FOLD, "X": -sign / math.sqrt(3)}),
            Special("EP", {"mu": -sign * 2.0, "X": -sign * ROOT}),
        ])
        for sign in (1, -1)
    ),
    Case("cusp: folds up", functools.partial(folds, 1), [Special("EP", {"mu": END, "lam": 2.0, "X": -math.sqrt(2 / 3)})]),
    Case("cusp: folds down", functools.partial(folds, -1), [
        Special("CP", {"mu": 0.0, "lam": 0.0, "X": 0.0}), Special("EP", {"mu": -END, "lam": 2.0, "X": math.sqrt(2 / 3)}),
    ]),
]  # fmt: skip
