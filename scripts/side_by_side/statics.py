"""Demos with equilibria and boundary value problems. The statements and the values by a third method are those of the bank."""

from __future__ import annotations

import functools
import importlib
import math
from collections.abc import Callable, Sequence

from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import contin
from contin import BoundaryValueProblem
from side_by_side.columns import equilibria, mean, norm, single
from side_by_side.record import Demo, Part


def bank(name: str):
    """Return a module of the bank of reference problems."""
    return importlib.import_module(f"bank.{name}")


def known(name: str, columns: dict) -> Callable[[], list]:
    """Return the values that the bank knows of all special points of a problem, by AUTO's columns."""
    found = []
    for case in bank(name).CASES:
        for special in case.specials:
            label = "UZ" if special.label == "EP" else special.label
            found.append((label, {theirs: special.values[c] for theirs, c in columns.items() if c in special.values}))
    return found


def part(name: str, runs: Sequence[int], columns: dict, branches: Callable | None = None, **more) -> Part:
    """Return a part whose branches are the runs of the bank's cases of that name, and whose values the bank knows."""
    if branches is None:
        branches = functools.partial(all_cases, name)
    return Part(runs, branches, columns, known=known(name, columns), **more)


def all_cases(name: str) -> list:
    """Return the branches of all cases of a problem."""
    return [case.run() for case in bank(name).CASES]


# --- runs with the given values of AUTO's demos -----------------------------------------------------------------------


def exp():
    """Bratu's problem, with the given values of the demo."""
    start = contin.solve(bank("exp").problem(), [0, 0])
    zeros = {"lam": [0.5, 1.0, 1.5, 2.0, 2.5, 3.0]}
    return [contin.trace(start, free=["lam"], limits={"lam": (-1, 4), "mean": (-1, 3.9)}, zeros=zeros)]


def ext():
    """The trivial branch."""
    return [contin.trace(contin.solve(bank("ext").problem(), [0, 0]), free=["lam"], limits={"lam": (0, 6)})]


@functools.cache
def int_branch():
    """One branch in p1."""
    start = contin.solve(bank("int").problem(), [0, 0], {"p1": 0.1})
    return contin.trace(start, free=["p1"], limits={"p1": (0, 20), "square": (-1, 100)}, zeros={"p1": [1.0, 3.0]})


def int_folds():
    """Its fold in p1 and p2."""
    limits = {"p1": (1.3697866, 20), "p2": (-0.5, 11)}
    return [contin.curve(int_branch().labelled("LP")[0], "p2", limits=limits, zeros={"p1": [3.0]})]


def non():
    """A problem that depends on t, with the given values of the demo."""
    start = contin.solve(bank("non").problem(), [0, 0])
    return [contin.trace(start, free=["p1"], limits={"p1": (0, 20), "mean": (-1, 20)}, zeros={"p1": [1.0, 3.0]})]


@functools.cache
def spb():
    """From the linear problem to the nonlinear one, and on to thin layers."""
    start = contin.solve(bank("spb").problem(), lambda t: (1.5 - 0.3 * t, -0.3), {"gam": single(1.2), "eps": single(0.1)})
    first = contin.trace(start, free=["lam"], limits={"lam": (-0.1, 1)})
    zeros, limits = {"eps": [0.01, 0.001, 0.0001]}, {"eps": (1e-5, 1)}
    return [first, contin.trace(first.points[-1], free=["eps"], direction=-1, limits=limits, zeros=zeros)]


def nep():
    """The trivial branch of a problem like Euler's column, and the branch that leaves it."""
    problem = BoundaryValueProblem(
        lambda t, u, p: (u.v, -p.load * u.u, -u.v**2 / 2 - p.load),
        lambda a, b, p: (a.u, b.u, a.w - p.end, b.w + p.end), ["u", "v", "w"], {"end": 0.0, "load": 0.0},
    )  # fmt: skip
    limits = {"end": (-1, 10)}
    first = contin.trace(
        contin.solve(problem, [0, 0, 0], free=["load"]),
        free=["end", "load"],
        limits=limits,
        zeros={"end": [2.0, 4.0, 6.0, 8.0]},
    )
    bent = contin.trace(first.labelled("BP")[0], branch=1, limits=limits, zeros={"end": [6.0, 8.0]})
    return [first, bent]


def pvl():
    """Bratu's problem with its slope at the end as a further parameter, so that it may be given."""
    problem = BoundaryValueProblem(
        lambda t, u, p: (u.v, -p.lam * math.exp(u.u)), lambda a, b, p: (a.u, b.u, a.v - p.slope), ["u", "v"],
        {"lam": 0.0, "slope": 0.0}, functionals={"square": lambda t, u, p: u.u**2},
    )  # fmt: skip
    start = contin.solve(problem, [0, 0], free=["slope"])
    limits, zeros = {"lam": (0, 4), "square": (-1, 80)}, {"lam": [2.0], "slope": [5.0], "square": [9.0]}
    return [contin.trace(start, free=["lam", "slope"], limits=limits, zeros=zeros)]


def obv_problem():
    """The optimization of demo obv: its constants 0.1 are of single precision."""
    return BoundaryValueProblem(
        lambda t, u, p: (u.v, -p.l1 * math.exp(u.u + p.l2 * u.u**2 + p.l3 * u.u**4)), lambda a, b, p: (a.u, b.u), ["u", "v"],
        {"l1": 0.0, "l2": 0.0, "l3": 0.0, "weight": single(0.1)},
        functionals={"objective": lambda t, u, p: (u.u - 1) ** 2 + p.weight * (p.l1**2 + p.l2**2 + p.l3**2)},
    )  # fmt: skip


@functools.cache
def obv_first():
    """Extrema of the objective in one parameter. AUTO follows the equations of an extremum, with a branch point at each."""
    start = contin.solve(obv_problem(), [0, 0])
    limits = {"l1": (-1, 5), "objective": (0, 10)}
    return contin.trace(start, free=["l1"], limits=limits, extrema=["objective"])


@functools.cache
def obv_second():
    """Extrema in two parameters."""
    return contin.curve(obv_first().labelled("EX")[0], "l2", limits={"l2": (-1, 5), "objective": (0, 10)})


def obv_third():
    """Extrema in three."""
    return [contin.curve(obv_second().labelled("EX")[-1], "l3", limits={"l3": (-1, 3), "objective": (0, 10)})]


@functools.cache
def opt(count: int):
    """Extrema of the sum of the coordinates of a point on the unit sphere, as ``count`` of them become free."""
    if count > 2:
        start = opt(count - 1).labelled("EX")[0]
        return contin.curve(start, f"x{count}", limits={f"x{count}": (-0.9, 0.9)})
    problem = contin.AlgebraicProblem(
        lambda u, p: (u.x1**2 + p.x2**2 + p.x3**2 + p.x4**2 + p.x5**2 - 1,), ["x1"],
        {"x2": 0.0, "x3": 0.0, "x4": 0.0, "x5": 0.0},
        {"sum": lambda u, p: u.x1 + p.x2 + p.x3 + p.x4 + p.x5},
    )  # fmt: skip
    return contin.trace(contin.solve(problem, [1.0]), free=["x2"], limits={"x2": (-0.1, 0.95)}, extrema=["sum"])


def sspg():
    """The trivial branch of a linearized problem."""
    problem = BoundaryValueProblem(
        lambda t, u, p: (-u.v, -u.u * u.v - p.m * u.v), lambda a, b, p: (b.u, p.s * a.u - a.v), ["u", "v"], {"m": 1.0, "s": 4.0}
    )
    return [contin.trace(contin.solve(problem, [0, 0]), free=["m"], limits={"m": (0.5, 5.6206906)})]


def apbp():
    """Two lines that cross."""
    values = {"p1": 1.0, "p2": 2.0, "p3": 0.0}
    return [equilibria(lambda u, p: ((u.x - p.p1) * (u.x - p.p2) + p.p3,), ["x"], values, [1.0], "p1", {"p1": (0, 4.2)})]


def manifold(rest: str, size: float):
    """Return orbits on an unstable manifold, from a small circle to a given radius; then with eps made smaller.

    ``rest`` is the demo's name: um2 in the plane, um3 in space.
    """
    space = rest == "um3"

    def field(t, u, p):
        if space:
            return (
                p.T * (p.eps * u.x - u.y**3 + u.z**3), p.T * (u.y + u.x**3), p.T * (-u.z + u.x**2)
            )  # fmt: skip
        return p.T * (p.eps * u.x - u.y**3), p.T * (u.y + u.x**3)

    def ends(a, b, p):
        first = a.x - p.r0 * math.cos(2 * math.pi * p.theta), a.y - p.r0 * math.sin(2 * math.pi * p.theta)
        if space:
            return (*first, a.z, math.sqrt(b.x**2 + b.y**2 + b.z**2) - p.r1)
        return (*first, math.sqrt(b.x**2 + b.y**2) - p.r1)

    r0 = 0.03 if space else 0.1
    values = {"theta": 0.25, "eps": 0.5, "r0": r0, "r1": r0, "T": 1e-4}
    problem = BoundaryValueProblem(field, ends, ["x", "y", "z"] if space else ["x", "y"], values)
    start = contin.solve(problem, [0.0, r0, 0.0] if space else [0.0, r0], free=["r1"])
    longer = contin.trace(start, free=["T", "r1"], limits={"r1": (0, size), "T": (0, 100)})
    smaller = contin.trace(
        longer.points[-1], free=["eps", "T"], direction=-1, limits={"eps": (0.01 if space else 0.1, 1), "T": (0, 100)}
    )
    return [longer], [smaller]


def arrival(space: bool, size: float, eps: float) -> float:
    """Return the time after which the orbit of um2 or um3 has the given radius, by SciPy's DOP853."""

    def field(t, u):
        x, y, z = (*u, 0.0)[:3]
        return [eps * x - y**3 + z**3, y + x**3, -z + x**2][: len(u)]

    def reached(t, u):
        return math.hypot(*u) - size

    reached.terminal = True
    start = [0.0, 0.03, 0.0] if space else [0.0, 0.1]
    found = solve_ivp(field, (0, 100), start, method="DOP853", rtol=1e-13, atol=1e-15, events=reached)
    return float(found.t_events[0][0])


def demos() -> list[Demo]:
    """Return the demos."""
    lam = {"lambda": "lam", "INTEGRAL u": "mean"}
    half = math.pi**2 / 2
    critical = brentq(lambda m: 4 * (1 - math.exp(-m)) - m, 3, 5, xtol=1e-15)
    return [
        Demo("exp", "Bratu's problem", [part("exp", [0], lam, exp)]),
        Demo("int", "a boundary and an integral condition", [
            part("int", [0], {"PAR(1)": "p1", "L2-NORM": norm}, lambda: [int_branch()]),
            Part([2], int_folds, {"PAR(1)": "p1", "PAR(2)": "p2"}),
        ]),
        Demo("bvp", "a nonlinear eigenvalue problem", [part("bvp", range(11), {"PAR(1)": "lam", "PAR(2)": "mean"})]),
        Demo("lin", "a linear eigenvalue problem", [part("lin", [0, 1], {"PAR(1)": "lam", "PAR(3)": "p3"})],
             note="AUTO's run ends at λ = 5 (UZ), which is a branch point."),
        Demo("non", "a problem that depends on t", [part("non", [0], {"PAR(1)": "p1"}, non)],
             note="AUTO's norm contains the time, which is a state there, and is not compared."),
        Demo("ezp", "Bratu's problem for complex states", [part("ezp", [0, 1, 2], {"PAR(1)": "lam", "L2-NORM": norm})]),
        Demo("ext", "spurious solutions on a coarse mesh", [
            Part([0], ext, {"PAR(1)": "lam"}, known=[("BP", {"PAR(1)": float(k)}) for k in range(1, 7)], near=0.02),
        ],
             note="AUTO's mesh is coarse on purpose, to show spurious solutions; contin's is adapted, and has none."),
        Demo("kar", "von Kármán's flow above a rotating disk", [
            Part([0], functools.partial(all_cases, "kar"), {"PAR(1)": "gam", "PAR(2)": lambda point: -point["inf"]},
                 known=[(label, {"PAR(1)": values["gam"], "PAR(2)": -values["inf"]}) for label, values in
                        known("kar", {"gam": "gam", "inf": "inf"})]),
        ], note="The demo asks for a tolerance of 1e-3 in given values: its γ = 0 is found at γ = -0.0084."),
        Demo("cusp", "the cusp", [part("cusp", [0, 1, 2, 3], {"mu": "mu", "lambda": "lam", "x": "X"}, labels=("LP", "CP"))]),
        Demo("enz", "two cells with an enzyme", [part("enz", [0], {"s0": "s0", "s1": "S1"})],
             note="AUTO's last fold is the branch point through which the branch of unequal cells passes."),
        Demo("spb", "a singularly perturbed problem", [
            Part([0], lambda: spb()[:1], {"PAR(3)": "lam", "L2-NORM": norm}),
            Part([1], lambda: spb()[1:], {"PAR(2)": "eps", "L2-NORM": norm}),
        ], slow=True, note="contin takes most of its time for ε from 1e-4 to 1e-5. The runs in γ label regular points only."),
        Demo("pd2", "steady states of two species with diffusion", [
            part("pd2", [1], {"PAR(1)": "p1", "INTEGRAL U(1)": mean(0)}, lambda: [bank("pd2").without()]),
        ], note="Steady states only (AUTO's second run): contin does not integrate partial differential equations in time."),
        Demo("nep", "a column", [
            Part([0, 1], nep, {"PAR(1)": "end", "PAR(2)": "load"},
                 known=[("BP", {"PAR(1)": half, "PAR(2)": 2 * half}),
                        *(("UZ", {"PAR(1)": end, "PAR(2)": 2 * half}) for end in (6.0, 8.0, 10.0))]),
        ]),
        Demo("pvl", "columns that are computed from a solution", [part("exp", [0], {
            "PAR(1)": "lam", "L2-NORM": norm, "PAR(4)": "slope"}, pvl)],
             note="The slope at an end is a further parameter with a condition here; the root of a mean of squares is given as "
                  "its square."),
        Demo("obv", "optimization of a boundary value problem", [
            Part([0], lambda: [obv_first()], {"PAR(10)": "objective", "PAR(1)": "l1"}, labels=("BP",), also={"EX": "BP"}),
            Part([2], lambda: [obv_second()], {"PAR(10)": "objective", "PAR(1)": "l1", "PAR(2)": "l2"}, also={"EX": "UZ"}),
            Part([3], obv_third, {"PAR(10)": "objective", "PAR(1)": "l1", "PAR(2)": "l2", "PAR(3)": "l3"}, also={"EX": "UZ"}),
        ], note="AUTO states the equations of the extremum itself; contin labels extrema (EX) and follows them."),
        Demo("opt", "a constrained maximum", [
            Part([count - 2], functools.partial(lambda n: [opt(n)], count), {"FOPT": "sum"}, also={"EX": "LP", "LP": ""},
                 known=[("LP", {"FOPT": count**0.5})]) for count in (2, 3, 4, 5)
        ], note="AUTO's LP is an extremum of the sum (EX in contin)."),
        Demo("sspg", "a curve of branch points of a boundary value problem", [
            Part([0], sspg, {"PAR(1)": "m"}, known=[("BP", {"PAR(1)": critical})]),
        ], note="The curves of branch points label regular points only."),
        Demo("apbp", "a curve of branch points of an algebraic problem", [
            Part([0], apbp, {"PAR(1)": "p1", "U(1)": "x"}, known=[("BP", {"PAR(1)": 2.0, "U(1)": 2.0})]),
        ], note="The curves of branch points label regular points only."),
        *(
            Demo(name, f"an unstable manifold in {'space' if name == 'um3' else 'the plane'}", [
                Part([0], functools.partial(lambda n, s: manifold(n, s)[0], name, size), {"r1": "r1", "Period": "T"},
                     known=[("UZ", {"r1": size, "Period": arrival(name == "um3", size, 0.5)})]),
                Part([1], functools.partial(lambda n, s: manifold(n, s)[1], name, size), {"eps": "eps", "Period": "T"},
                     known=[("UZ", {"eps": eps, "Period": arrival(name == "um3", size, eps)})]),
            ], note="The run round the circle labels regular points only. Third method: SciPy's DOP853.")
            for name, size, eps in (("um2", 0.6, 0.1), ("um3", 1.0, 0.01))
        ),
    ]  # fmt: skip
