"""Demos with forced oscillators, reactions on a line, food chains, and curves of branch points of cycles."""

from __future__ import annotations

import functools
import math

import numpy as np

import contin
from side_by_side.columns import equilibria, norm, single
from side_by_side.cycles import abc_rest, columns
from side_by_side.record import Demo, Part


def rms(name: str):
    """Return a function that gives the root of a functional, for AUTO's norm of one state."""
    return lambda point: math.sqrt(point[name])


# --- forced oscillators -----------------------------------------------------------------------------------------------


def frc():
    """FitzHugh and Nagumo's equations: the forcing becomes stronger."""

    def field(t, u, p):
        return (
            (u.v * (u.v - p.a) * (1 - u.v) - u.w) / p.eps, u.v - p.d * u.w - (p.b + p.r * math.sin(p.beta * t))
        )  # fmt: skip

    values = {"a": 0.5, "b": 0.5, "r": 0.0, "eps": single(0.005), "beta": 100.0, "d": 1.0}
    problem = contin.CycleProblem(
        field, ["v", "w"], values, period=lambda p: 2 * math.pi / p.beta, functionals={"square": lambda t, u, p: u.v**2}
    )
    return [contin.trace(contin.solve(problem, [0.5, 0.0]), free=["r"], limits={"r": (0, 0.2)})]


@functools.cache
def ffn_problem():
    """FitzHugh's equations with a forcing of period 2 pi / 10."""

    def field(t, u, p):
        return p.c * (u.x - u.x**3 / 3 + u.y - p.amp * math.cos(10 * t)), -(u.x - p.a + p.b * u.y) / p.c

    values = {"a": 0.0, "b": single(0.8), "c": 3.0, "amp": 0.0}
    return contin.CycleProblem(
        field, ["x", "y"], values, period=2 * math.pi / 10, functionals={"square": lambda t, u, p: u.x**2}
    )


@functools.cache
def ffn_first():
    """The forcing grows to 0.1."""
    return contin.trace(contin.solve(ffn_problem(), [0.0, 0.0]), free=["amp"], limits={"amp": (0, 0.1)})


def ffn_in_a():
    """Then a grows to 1."""
    return [contin.trace(ffn_first().points[-1], free=["a"], limits={"a": (-0.1, 1)}, zeros={"a": [0.25, 0.5]})]


def ffn_in_amp():
    """Or the forcing grows to 10."""
    return [contin.trace(ffn_first().points[-1], free=["amp"], limits={"amp": (0, 10)})]


# --- reactions on a line ----------------------------------------------------------------------------------------------


def differences(count: int) -> np.ndarray:
    """Return second derivatives by compact differences of fourth order, for deviations that vanish at both ends."""
    beside = np.eye(count, k=1) + np.eye(count, k=-1)
    return np.linalg.solve(np.eye(count) * 10 / 12 + beside / 12, (beside - 2 * np.eye(count)) * (count + 1) ** 2)


def collocation(count: int) -> np.ndarray:
    """Return second derivatives of the polynomial through the ends and the zeros of a Chebyshev polynomial."""
    inner = (1 + np.cos((2 * np.arange(1, count + 1) - 1) * math.pi / (2 * count))) / 2
    nodes = np.concatenate([[0.0], inner, [1.0]])
    powers = np.vander(nodes, increasing=True)
    orders = np.arange(len(nodes))
    second = np.zeros_like(powers)
    second[:, 2:] = powers[:, :-2] * (orders * (orders - 1))[2:]
    return np.linalg.solve(powers.T, second.T).T[1:-1, 1:-1]


@functools.cache
def brusselator_rest(kind: str):
    """The uniform state of the Brusselator, in the length of the line."""
    count = 5 if kind == "brf" else 6
    matrix, (a, b) = (differences(count) if kind == "brf" else collocation(count)), (2.0, 5.45)

    def field(u, p):
        x, y = u[:count], u[count:]
        rate = x * x * y
        return np.concatenate([
            0.008 / p.length**2 * (matrix @ (x - a)) + rate - (b + 1) * x + a,
            0.004 / p.length**2 * (matrix @ (y - b / a)) - rate + b * x,
        ])  # fmt: skip

    start = np.append(np.full(count, a), np.full(count, b / a))
    problem = contin.AlgebraicProblem(field, 2 * count, {"length": single(0.4)})
    end = 2.05 if kind == "brf" else 2.0
    return contin.trace(contin.solve(problem, start), free=["length"], limits={"length": (0.4, end)})


# --- coupled pendula --------------------------------------------------------------------------------------------------

#: AUTO's columns of the pendula.
CURRENT = {"PAR(3)": "current", "PERIOD": "period"}
#: Shooting with SciPy's DOP853, tolerance 3e-14: the half of a round for cycles whose pendula are half a round apart, the
#: determinant of the linearized map plus one for the points where a multiplier is critical.
PENDULA = [
    ("PD", {"PAR(3)": 0.17916377821826, "PERIOD": 3.70527211859}),
    ("BP", {"PAR(3)": 0.33144524464473, "PERIOD": 9.72614401819}),
    ("BP", {"PAR(3)": 0.17551171694048, "PERIOD": 13.438887036994}),
    ("UZ", {"PAR(3)": 0.17314497411722, "PERIOD": 30.0}),
    ("UZ", {"PAR(3)": 0.1599533234434, "PERIOD": 30.0}),
    ("UZ", {"PAR(3)": 0.95729420624432, "PAR(2)": 0.98064095333096}),
]
#: AUTO ends its runs at the period 30.
TO_30 = {"limits": {"current": (0, 1), "period": (0, 30.001)}, "zeros": {"period": [30.0]}}


def pendula(u, p):
    """An angle, the other one less that, and their velocities."""
    pull = p.gamma * u.d
    return (
        u.v, u.w - u.v, -p.eps * u.v - math.sin(u.phi) + p.current + pull,
        -p.eps * u.w - math.sin(u.phi + u.d) + p.current - pull,
    )  # fmt: skip


@functools.cache
def pen_in_phase():
    """Both rotate as one."""
    values = {"gamma": single(0.175), "eps": single(0.1), "current": single(0.4)}
    problem = contin.CycleProblem(pendula, ["phi", "d", "v", "w"], values, angles=["phi"])
    start = contin.solve(problem, lambda t: (1.24 + 2 * math.pi * t, 0.0, 4.0, 4.0), {"period": 1.5738797205})
    return contin.trace(start, free=["current"], direction=-1, **TO_30)


@functools.cache
def pen_out_of_phase():
    """One is half a round ahead; the cycle goes round twice."""
    return contin.trace(pen_in_phase().labelled("PD")[0], branch=1, **TO_30)


def pen_further():
    """The branches that leave from these."""
    return [contin.trace(point, branch=1, **TO_30) for point in pen_out_of_phase().labelled("BP") if point.name != "start"]


def pen_doublings():
    """The period doublings in two parameters."""
    start = pen_in_phase().labelled("PD")[0]
    return [contin.curve(start, free=["current", "eps"], limits={"period": (0, 30.001)}, zeros={"period": [30.0]})]


# --- food chain, reactor, circles -------------------------------------------------------------------------------------


def chain(u, p):
    """A food chain of three, in logarithms of the first two."""
    x, y = math.exp(u.x), math.exp(u.y)
    return (
        1 - x - p.a1 * y / (1 + p.b1 * x),
        p.a1 * x / (1 + p.b1 * x) - p.d1 - p.a2 * u.z / (1 + p.b2 * y),
        u.z * (p.a2 * y / (1 + p.b2 * y) - p.d2),
    )


@functools.cache
def tfc_rest():
    """Equilibria without the top of the chain."""
    values = {"a1": 5.0, "b1": 3.0, "d1": single(1.1083), "a2": single(0.1), "b2": 2.0, "d2": single(0.01)}
    guess = [math.log(0.66163), math.log(0.20199), 0.0]
    return equilibria(chain, ["x", "y", "z"], values, guess, "d1", {"d1": (0.162442, 1.2)}, direction=-1)


@functools.cache
def tfc_cycles():
    """Cycles of the lower two."""
    limits = {"d1": (0.45513489, 1.2), "period": (0, 17.833471)}
    return contin.trace(tfc_rest().labelled("HB")[0], branch=1, limits=limits, zeros={"d1": [0.75]})


def tfc_in_d2():
    """The cycle at d1 = 0.75 in the death rate of the top, which is not there."""
    point = tfc_cycles().labelled("UZ")[0]
    return [contin.trace(point, free=["d2"], limits={"d2": (0.005, 0.4735)}, zeros={"d2": [0.013]})]


def tfc_of_given_period():
    """The same cycle in d1 and a1, with its period held, to smaller cycles and to larger ones."""
    (point,) = tfc_in_d2()[0].labelled("UZ")
    options = {"hold": "period", "branch_points": True, "limits": {"d1": (0.7, 1.0277792)}}
    return [contin.curve(point, free=["d1", "a1"], direction=way, **options) for way in (-1, 1)]


def abcb_cycles():
    """Cycles of the reactor of demo abc from its first Hopf point."""
    return [contin.trace(abc_rest().labelled("HB")[0], branch=1, limits={"d": (0.1, 1), "period": (0, 30)})]


@functools.cache
def abcb_folds():
    """The curve of their first fold in alpha and d, to its turn, which is a branch point of cycles in d."""
    fold = abcb_cycles()[0].labelled("LP")[0]
    limits = {"alpha": (0.97, 1.3), "d": (0.19, 0.25)}
    return [
        contin.curve(fold, free=["alpha", "d"], primary="alpha", direction=way, limits=limits, max_points=60) for way in (1, -1)
    ]  # fmt: skip


def lcbp():
    """Two circles that cross."""

    def field(u, p):
        r = math.sqrt(u.x**2 + u.y**2)
        growth = r * r - (p.p1 + p.p2) * r + p.p1 * p.p2 + p.p3
        return -u.x * growth - 2 * math.pi * u.y, -u.y * growth + 2 * math.pi * u.x

    problem = contin.CycleProblem(field, ["x", "y"], {"p1": 1.0, "p2": 2.0, "p3": 0.0})
    circle = contin.solve(problem, lambda t: (math.cos(2 * math.pi * t), math.sin(2 * math.pi * t)), {"period": 1.0})
    return [contin.trace(circle, free=["p1"], limits={"p1": (0.5, 4.2)})]


# --- pla: a bursting cell ---------------------------------------------------------------------------------------------


def cell(u, p):
    """Plant's equations of a bursting nerve cell."""
    a = 127 / 105
    b = (115 * -75 + 12 * 30) / 105
    vs = a * u.v - b
    am, ah = 0.1 * (50 - vs) / (math.exp((50 - vs) / 10) - 1), single(0.07) * math.exp((25 - vs) / 20)
    an = single(0.01) * (55 - vs) / (math.exp((55 - vs) / 10) - 1)
    bm, bh, bn = 4 * math.exp((25 - vs) / 18), 1 / (math.exp((55 - vs) / 10) + 1), 0.125 * math.exp((45 - vs) / 80)
    am = single(0.1) / 0.1 * am
    s = am / (am + bm)
    return (
        (p.gi * s**3 * u.yi + p.gt * u.xt) * (30 - u.v) + (single(0.3) * u.xk**4 + p.gp * u.c / (0.5 + u.c)) * (-75 - u.v)
        + single(0.003) * (-40 - u.v),
        (1 / (math.exp(single(0.15) * (-50 - u.v)) + 1) - u.xt) / 235,
        (an / (an + bn) - u.xk) / (12.5 / (an + bn)),
        (ah / (ah + bh) - u.yi) / (12.5 / (ah + bh)),
        single(0.0003) * (single(0.0085) * u.xt * (140 - u.v) - u.c),
    )  # fmt: skip


@functools.cache
def pla_rest():
    """Equilibria."""
    values = {"gi": 50.0, "gp": single(0.03), "gt": single(0.01)}
    guess = [-2.329601, 0.9992162, 0.7373314, 0.006135948, 1.208853]
    return equilibria(cell, ["v", "xt", "xk", "yi", "c"], values, guess, "gi", {"gi": (-120, 60)}, direction=-1)


def demos() -> list[Demo]:
    """Return the demos."""
    line = {"PAR(5)": "length", "L2-NORM": norm}
    return [
        Demo("frc", "a periodically forced system", [
            Part([0], frc, {"PAR(3)": "r", "L2-NORM U(1)": rms("square")}),
        ], note="The second run asks for periods of 1 and more, which it does not reach in its 20 steps. AUTO adds an "
                "oscillator of two states; contin's field depends on t."),
        Demo("ffn", "FitzHugh's equations with a forcing", [
            Part([0], lambda: [ffn_first()], {"amp": "amp", "L2-NORM x": rms("square")}),
            Part([1], ffn_in_a, {"a": "a", "L2-NORM x": rms("square")}),
            Part([2], ffn_in_amp, {"amp": "amp", "L2-NORM x": rms("square")}),
        ]),
        *(
            Demo(name, f"the Brusselator on a line, by {words}", [
                Part([0], functools.partial(lambda n: [brusselator_rest(n)], name), line),
            ], note="Equilibria only. The cycles have torus bifurcations, whose normal forms are slow in contin with many "
                    "states: the process of `brc` was stopped after 160 s of the processor, with up to 1.7 GB, "
                    "and had printed nothing.")
            for name, words in (("brf", "differences"), ("brc", "collocation"))
        ),
        Demo("tfc", "branch points of cycles in a food chain", [
            Part([0], lambda: [tfc_rest()], {"PAR(3)": "d1", "U(1)": "x", "U(2)": "y"}),
            Part([1], lambda: [tfc_cycles()], {"PAR(3)": "d1", "PERIOD": "period"}),
            Part([2], tfc_in_d2, {"PAR(6)": "d2", "PERIOD": "period"}),
            Part([7], tfc_of_given_period, {"PAR(3)": "d1", "PAR(1)": "a1"}, known=[
                # the top's mean rate of growth is zero: shooting, SciPy's DOP853
                ("BP", {"PAR(3)": 0.7706897642415, "PAR(1)": 5.661087883765}),
            ]),
        ], note="Beside the Hopf point at a1 = 4.4165, where contin's cycles of given period end, AUTO labels a BP, elsewhere "
                "when finer. The curve of branch points labels only its turn at the Hopf point d1 = 0.83333, where contin's "
                "ends. "
                "Curves of branch points of a given period are not in contin."),
        Demo("pen", "rotations of coupled pendula", [
            Part([0], lambda: [pen_in_phase()], CURRENT, labels=("PD", "UZ"), known=PENDULA[:1]),
            Part([1], lambda: [pen_out_of_phase()], CURRENT, labels=("BP", "UZ"), known=PENDULA[1:4]),
            Part([2, 3], pen_further, CURRENT, labels=("UZ",), known=PENDULA[4:5]),
            Part([5], pen_doublings, {"PAR(3)": "current", "PAR(2)": "eps"}, labels=("UZ",), known=PENDULA[5:]),
        ], note="The state phi is an angle of contin; the other one is stated as the difference of both, in which the field is "
                "not periodic. AUTO does not look for folds, and in runs 3 and 4 for nothing but the period 30. Third method: "
                "shooting with SciPy's DOP853."),
        Demo("abcb", "branch points of cycles in a reactor", [
            Part([0], lambda: [abc_rest()], columns("d", period=False)),
            Part([1], abcb_cycles, {"PAR(1)": "d", "PERIOD": "period"}, known=[
                # the linearized map less one, bordered by the field, is singular: shooting, SciPy's DOP853
                ("LP", {"PAR(1)": 0.2136973572729, "PERIOD": 7.611039746732}),
                ("LP", {"PAR(1)": 0.2119032667268, "PERIOD": 8.289204906161}),
            ]),
            Part([3, 4], abcb_folds, {"PAR(2)": "alpha", "PAR(1)": "d", "PERIOD": "period"}, also={"CP": "LP"}),
        ], note="AUTO passes the Hopf point at d = 0.3462, which it calls a fold, and comes back; contin's cycles end there. "
                "The turn of the curve of folds at alpha = 1.2687 is a cusp. The curve of branch points in three parameters "
                "labels regular points only. Third method: shooting with SciPy's DOP853."),
        Demo("lcbp", "a curve of branch points of cycles", [
            Part([0], lcbp, {"PAR(1)": "p1", "PERIOD": "period"}, known=[("BP", {"PAR(1)": 2.0, "PERIOD": 1.0})]),
        ], note="The curves of branch points label regular points, and one in which the circles shrink to nothing."),
        Demo("pla", "bursting of a nerve cell", [
            Part([0], lambda: [pla_rest()], columns("gi", period=False)),
        ], note="The two runs of cycles, to the periods 10000 and 50000, are not compared: AUTO's script was cut off after its "
                "first run, as the others take it half a minute."),
    ]  # fmt: skip
