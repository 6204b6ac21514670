"""The reaction A -> B in a stirred tank (AUTO demo ``ab``; Uppal, Ray & Poore 1974).

x' = -x + p1 (1 - x) e^y, y' = -y + p1 p2 (1 - x) e^y - p3 y, p3 = 2. Equilibria have y = p2 x / (1 + p3) and p1 = x
e^-y / (1 - x). Folds where x (1 - x) = (1 + p3) / p2, Hopf points where the trace p2 x - 1 / (1 - x) - 1 - p3 vanishes
and the determinant is positive (the other zero of the trace is a neutral saddle). Values by mpmath with 30 digits.
"""

import functools
import math

from bank.case import Case, Special
from contin import AlgebraicProblem, solve, trace


def residual(u, p):
    rate = p.p1 * (1 - u.x) * math.exp(u.y)
    return -u.x + rate, -u.y + p.p2 * rate - p.p3 * u.y


@functools.cache
def problem():
    functionals = {"X": lambda u, p: u.x, "Y": lambda u, p: u.y}
    return AlgebraicProblem(residual, ["x", "y"], {"p1": 0.0, "p2": 14.0, "p3": 2.0}, functionals=functionals)


def run(p2):
    return trace(solve(problem(), [0.0, 0.0], {"p2": p2}), free=["p1"], limits={"p1": (-1, 0.35)})


def at(label, p1, x, y):
    return Special(label, {"p1": p1, "X": x, "Y": y})


CASES = [
    Case("ab: p2 = 8", functools.partial(run, 8.0), [at("EP", 0.35, 0.684999157800892605, 1.82666442080238028)]),
    Case("ab: p2 = 14", functools.partial(run, 14.0), [
        at("LP", 0.105738978271650651, 0.311017763495386386, 1.45141622964513647),
        at("LP", 0.0889318461857728026, 0.688982236504613614, 3.2152504370215302),
        at("HB", 0.130900044820043325, 0.895080633867805345, 4.17704295804975828),
        at("EP", 0.35, 0.97002510312340117, 4.52678381457587213),
    ]),
    Case("ab: p2 = 20", functools.partial(run, 20.0), [
        at("LP", 0.0661292224312571555, 0.183772233983162067, 1.22514822655441378),
        at("LP", 0.0192446509205932425, 0.816227766016837933, 5.44151844011225289),
        at("HB", 0.0286378307018662222, 0.936420807370024008, 6.24280538246682672),
        at("EP", 0.35, 0.996286605590981353, 6.64191070393987569),
    ]),
]  # fmt: skip
