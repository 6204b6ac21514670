"""Steady states of two species with diffusion (AUTO demo ``pd2``): x'' + p1 x (1 - x) - x y = 0, y'' - y + x y = 0.

x = 0 and y = 1 at both ends. With x = 0, y = cosh(t - 1/2) / cosh(1/2): the branch points are the eigenvalues p1 of
x'' + (p1 - y) x = 0. These, and all other values, by collocation of degree 8 in extended precision (``bank.longdouble``);
meshes of N and 2 N intervals agree to 1e-17.
"""

import functools
import math

from bank.case import Case, Special
from contin import BoundaryValueProblem, solve, trace


def rhs(t, u, p):
    return u.dx, u.x * u.y - p.p1 * u.x * (1 - u.x), u.dy, u.y - u.x * u.y


def boundary(a, b, p):
    return a.x, b.x, a.y - 1, b.y - 1


@functools.cache
def problem():
    return BoundaryValueProblem(
        rhs, boundary, ["x", "dx", "y", "dy"], {"p1": 2.0},
        functionals={"x_mean": lambda t, u, p: u.x, "y_mean": lambda t, u, p: u.y},
    )  # fmt: skip


@functools.cache
def without():
    """The branch x = 0."""
    return trace(solve(problem(), [0, 0, 1, 0]), free=["p1"], limits={"p1": (0, 100)})


def half_branch(which, sign):
    """The half of the branch of this branch point that leaves with x'(0) of this sign."""
    point = without().labelled("BP")[which - 1]
    slope = point.system.states(point.details.tangents[1])[0, 1]
    return trace(point, branch=1, direction=1 if slope * sign > 0 else -1, limits={"p1": (0, 100)}, zeros={"p1": [12.0]})


def at(which, sign, *specials):
    return Case(f"pd2: branch {which}{'+' if sign > 0 else '-'}", functools.partial(half_branch, which, sign), specials)


ALONE = {"x_mean": 0.0, "y_mean": 2 * math.tanh(0.5)}
CASES = [
    Case("pd2", without, [
        Special("BP", {"p1": 10.77100223432082364, **ALONE}),
        Special("BP", {"p1": 40.396832442766681868, **ALONE}),
        Special("BP", {"p1": 89.74808069554560502, **ALONE}),
        Special("EP", {"p1": 100.0, **ALONE}),
    ]),
    at(1, 1, Special("UZ", {"p1": 12.0, "x_mean": 0.0764406333980165158, "y_mean": 0.9306326513277768977}),
       Special("EP", {"p1": 100.0, "x_mean": 0.7375919650732577422, "y_mean": 0.9880827494825976539})),
    *(at(2, sign, Special("EP", {"p1": 100.0, "x_mean": 0.3915583832587704304, "y_mean": 0.9621507181545996221}))
      for sign in (1, -1)),
    at(3, 1, Special("EP", {"p1": 100.0, "x_mean": 0.0716860638401138901, "y_mean": 0.9269824464941162206})),
    at(3, -1, Special("LP", {"p1": 87.574779026007322665, "x_mean": -0.0220905031221678472, "y_mean": 0.9248898960425581203}),
       Special("EP", {"p1": 100.0, "x_mean": 0.03997798687381802, "y_mean": 0.9352172074121239461})),
]  # fmt: skip
