"""A sharp front on the way from one equation to another (AUTO demo ``stw``).

At p = 1 the front stands still: c = 0.
"""

import functools
import math

from contin import ConnectionProblem, solve


def field(u, p):
    fa, fb, fc = 2 * u.u + p.p * u.u**2, 2 * (1 - p.p) + p.p * u.u, u.u - u.u**2
    return fa * u.v, -p.c * u.v - fb * u.v**2 - fc


def guess(t):
    e = math.exp(40 * (t - 0.5))
    return 1 / (1 + e), -0.5 * e / (1 + e)


@functools.cache
def front():
    """The front at p = 0, where c = 1."""
    problem = ConnectionProblem(field, ["u", "v"], {"p": 0.0, "c": 1.0}, unstable=1, stable=1)
    return solve(problem, guess, {"time": 40, "from_u": 1.0, "from_v": 0.0, "to_u": 0.0, "to_v": -0.5}, free=["c"])
