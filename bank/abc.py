"""The reaction A -> B -> C in a stirred tank (AUTO demo ``abc``; Doedel & Heinemann 1983): up to four Hopf points.

x' = -x + d (1 - x) e^z, y' = -y + d e^z (1 - x - s y), z' = -(1 + beta) z + d b e^z (1 - x + alpha s y); alpha = 1, b = 8,
s = 0.04. With w = d e^z all states are functions of w alone; Hopf points where Hurwitz's a1 a2 - a3 vanishes, with frequency
sqrt(a2). Values by mpmath with 30 digits.
"""

import functools
import math

from bank.case import Case, Special
from contin import AlgebraicProblem, solve, trace


def residual(u, p):
    w = p.d * math.exp(u.z)
    return (
        -u.x + w * (1 - u.x),
        -u.y + w * (1 - u.x - p.s * u.y),
        -(1 + p.beta) * u.z + p.b * w * (1 - u.x + p.alpha * p.s * u.y),
    )


@functools.cache
def problem():
    parameters = {"d": 0.0, "alpha": 1.0, "beta": 1.55, "b": 8.0, "s": 0.04}
    functionals = {"X": lambda u, p: u.x, "Z": lambda u, p: u.z}
    return AlgebraicProblem(residual, ["x", "y", "z"], parameters, functionals=functionals)


def run(beta):
    return trace(solve(problem(), [0.0, 0.0, 0.0], {"beta": beta}), free=["d"], limits={"d": (-0.1, 0.4)})


def at(label, d, x, z, frequency=None):
    return Special(label, {"d": d, "X": x, "Z": z, **({} if frequency is None else {"frequency": frequency})})


CASES = [
    Case("abc: beta = 1.21", functools.partial(run, 1.21), [
        at("LP", 0.152681684649247824, 0.48771545070834554, 1.83025192928969968),
        at("LP", 0.133030441186343469, 0.973309399847170164, 5.61356786372367982),
        at("HB", 0.155935458216614783, 0.989758430428009458, 6.4293191040275319, 2.01250980814414285),
        at("EP", 0.4, 0.997804928059863472, 7.03563370567466347),
    ]),
    Case("abc: beta = 1.55", functools.partial(run, 1.55), [
        at("HB", 0.204184535700613639, 0.587753399497803202, 1.94341686338248701, 0.797303176040136983),
        at("HB", 0.229839037648466764, 0.799155859391484926, 2.85140285877966152, 1.163437431256638),
        at("HB", 0.259957854244516685, 0.926118602170632247, 3.87577699128851308, 0.673288846579219255),
        at("HB", 0.346208521607389166, 0.98817718579843764, 5.48654496961133227, 2.15939123095308323),
        at("EP", 0.4, 0.991444541763321629, 5.66888427507768905),
    ]),
    Case("abc: beta = 1.57", functools.partial(run, 1.57), [
        at("HB", 0.207826037030501759, 0.593292457689136992, 1.94864701247816275, 0.830393069645648112),
        at("HB", 0.2341740805024428, 0.795018370837472322, 2.80713536751236724, 1.19443971807912784),
        at("HB", 0.268576664784669929, 0.928369665789958965, 3.87653022968992083, 0.6990229830626556),
        at("HB", 0.359922757220505217, 0.988060967992847762, 5.43779720491890648, 2.16439099313618055),
        at("EP", 0.4, 0.990639769936219389, 5.57817182889227627),
    ]),
]  # fmt: skip
