"""Demos with equilibria of vector fields and the cycles that leave their Hopf points."""

from __future__ import annotations

import functools
import math

import contin
from side_by_side.columns import equilibria, norm, single, with_branches
from side_by_side.record import Demo, Part


def columns(parameter: str, name: str = "PAR(1)", period: bool = True) -> dict:
    """Return the columns of a run in one parameter."""
    found = {name: parameter, "L2-NORM": norm}
    return found | {"PERIOD": "period"} if period else found


def leave(branch, number: int, limits, **more):
    """Return the cycles that leave a Hopf point of a branch."""
    return contin.trace(branch.labelled("HB")[number], branch=1, limits=limits, **more)


# --- ab, abc: reactors ------------------------------------------------------------------------------------------------


def ab(u, p):
    """Reaction A -> B in a stirred tank."""
    rate = p.p1 * (1 - u.x) * math.exp(u.y)
    return -u.x + rate, -u.y + p.p2 * rate - p.p3 * u.y


@functools.cache
def ab_rest(p2: float):
    """Equilibria at one value of p2."""
    return equilibria(ab, ["x", "y"], {"p1": 0.0, "p2": p2, "p3": 3.0}, [0.0, 0.0], "p1", {"p1": (-1, 0.25)})


def ab_cycles():
    """Cycles from all Hopf points, to p1 = .25 or the period 1000."""
    rests = [ab_rest(p2) for p2 in (14.0, 15.0, 16.0, 17.0, 18.0)]
    limits = {"p1": (0, 0.25), "period": (0, 1000)}
    return [leave(rest, number, limits) for rest in rests for number in range(len(rest.labelled("HB")))]


def abc(u, p):
    """Reaction A -> B -> C in a stirred tank."""
    rate = p.d * math.exp(u.z)
    return (
        -u.x + rate * (1 - u.x), -u.y + rate * (1 - u.x - p.s * u.y),
        -u.z - p.beta * u.z + p.b * rate * (1 - u.x + p.alpha * p.s * u.y),
    )  # fmt: skip


@functools.cache
def abc_rest():
    """Equilibria."""
    values = {"d": 0.0, "alpha": 1.0, "beta": single(1.55), "b": 8.0, "s": single(0.04)}
    return equilibria(abc, ["x", "y", "z"], values, [0.0, 0.0, 0.0], "d", {"d": (-0.1, 0.4)})


def abc_cycles():
    """Cycles from the four Hopf points, to d = .25."""
    starts = [(0, (0.1, 0.25)), (1, (0.1, 0.25)), (2, (0.25, 0.4)), (3, (0.25, 0.4))]
    return [leave(abc_rest(), number, {"d": limits, "period": (0, 30)}) for number, limits in starts]


# --- lrz: Lorenz ------------------------------------------------------------------------------------------------------


def lorenz(u, p):
    """Lorenz's equations."""
    return p.sigma * (u.y - u.x), p.rho * u.x - u.y - u.x * u.z, u.x * u.y - p.beta * u.z


@functools.cache
def lrz_rest():
    """The origin, and the two branches that leave it."""
    values, limits = {"rho": 0.0, "beta": 8 / 3, "sigma": 10.0}, {"rho": (-1, 30)}
    return with_branches(equilibria(lorenz, ["x", "y", "z"], values, [0.0, 0.0, 0.0], "rho", limits), limits)


@functools.cache
def lor_first():
    """The cycle of the demo's data file at rho = 280, to rho = 200."""
    problem = contin.CycleProblem(lorenz, ["x", "y", "z"], {"rho": 280.0, "beta": 8 / 3, "sigma": 10.0})
    orbit = contin.cycle(problem, [-4.0674614, -24.183805, 219.00338])
    return contin.trace(orbit, free=["rho"], direction=-1, limits={"rho": (200, 300)})


@functools.cache
def lor_doubled():
    """Cycles of twice the period."""
    return contin.trace(lor_first().labelled("PD")[0], branch=1, limits={"rho": (200, 300)})


def lor_fourfold():
    """Cycles of four times the period."""
    return contin.trace(lor_doubled().labelled("PD")[0], branch=1, limits={"rho": (200, 300)})


# --- predators and prey -----------------------------------------------------------------------------------------------


def pp2(u, p):
    """Two species, one of them fished."""
    return (
        p.p2 * u.x * (1 - u.x) - u.x * u.y - p.p1 * (1 - math.exp(-p.p3 * u.x)),
        -u.y + p.p4 * u.x * u.y,
    )  # fmt: skip


@functools.cache
def pp2_rest():
    """Equilibria: none, prey alone, both."""
    values, limits = {"p1": 0.0, "p2": 3.0, "p3": 5.0, "p4": 3.0}, {"p1": (0, 1)}
    first = equilibria(pp2, ["x", "y"], values, [0.0, 0.0], "p1", limits | {"x": (-0.25, 3)})
    return with_branches(first, limits | {"x": (-0.25, 3)}, depth=2)


def pp2_cycles():
    """Cycles from the Hopf point, to the period 36."""
    (hopf,) = [point for branch in pp2_rest() for point in branch.labelled("HB")][:1]
    return [contin.trace(hopf, branch=1, limits={"p1": (0, 1), "period": (0, 36)})]


def three(u, p):
    """Three species."""
    return (
        u.x * (1 - u.x) - p.p4 * u.x * u.y,
        -p.p2 * u.y + p.p4 * u.x * u.y - p.p5 * u.y * u.z - p.p1 * (1 - math.exp(-p.p6 * u.y)),
        -p.p3 * u.z + p.p5 * u.y * u.z,
    )


@functools.cache
def pp3_rest():
    """Equilibria of three species with p4 = 4."""
    values, limits = {"p1": 0.0, "p2": 0.25, "p3": 0.5, "p4": 4.0, "p5": 3.0, "p6": 5.0}, {"p1": (0, 1), "x": (-1, 1.2)}
    first = equilibria(three, ["x", "y", "z"], values, [1.0, 0.0, 0.0], "p1", limits)
    return with_branches(first, limits, depth=2)


@functools.cache
def ppp_rest():
    """Equilibria of three species with p4 = 3."""
    values, limits = {"p1": 0.0, "p2": 0.25, "p3": 0.5, "p4": 3.0, "p5": 3.0, "p6": 5.0}, {"p1": (0, 0.6), "x": (-1, 1.9843939)}
    first = equilibria(three, ["x", "y", "z"], values, [1.0, 0.0, 0.0], "p1", limits)
    return with_branches(first, limits, depth=2)


def hopf_near(branches, parameter: str, value: float):
    """Return the Hopf point of some branches that is nearest to a value."""
    points = [point for branch in branches for point in branch.labelled("HB")]
    return min(points, key=lambda point: abs(point[parameter] - value))


def pp3_cycles():
    """Cycles from the four Hopf points, to p1 = .3."""
    limits = [(0.45960011, (0.3, 1)), (0.10641506, (0, 0.3)), (0.50383497, (0.3, 1)), (0.22935697, (0, 0.3))]
    zeros = {"p1": [0.15, 0.2, 0.25, 0.35, 0.4]}
    return [
        contin.trace(hopf_near(pp3_rest(), "p1", place), branch=1, limits={"p1": span}, zeros=zeros) for place, span in limits
    ]


# --- plp, pla, fhn, phs -----------------------------------------------------------------------------------------------


PLANT = {"al": single(0.2), "rk": single(0.1)}


def plant(u, p):
    """The enzyme model of demo ``plp``."""
    rate = p.rho * u.x * u.y / (1 + u.x + p.rk * u.x**2)
    return p.s0 - u.x - rate, p.al * (500 - u.y) - rate


@functools.cache
def plp_rest():
    """Equilibria at s0 = 110."""
    values = {"rho": 2.021628, "s0": 110.0, **PLANT}
    return equilibria(plant, ["x", "y"], values, [45.55974, 177.7987], "rho", {"rho": (2, 6)})


@functools.cache
def plp_cycles():
    """Cycles from both Hopf points."""
    return [leave(plp_rest(), 0, {"rho": (1, 6), "period": (0, 30)}, zeros={"rho": [4.0]})]


def plp_hopf():
    """The curve of Hopf points down to s0 = 109, both ways."""
    hopf = plp_rest().labelled("HB")[0]
    return [contin.curve(hopf, free=["rho", "s0"], direction=way, limits={"s0": (109, 200), "rho": (1, 10)}) for way in (1, -1)]


def plp_folds():
    """The curve of folds of cycles from s0 = 109 to 109."""
    fold = plp_cycles()[0].labelled("LP")[0]
    limits = {"s0": (109, 200), "rho": (1, 10)}
    return [contin.curve(fold, free=["rho", "s0"], direction=way, limits=limits, zeros={"s0": [111.0]}) for way in (1, -1)]


@functools.cache
def plp_isola():
    """The closed branch at s0 = 111."""
    problem = contin.CycleProblem(plant, ["x", "y"], {"rho": 4.0, "s0": 111.0, **PLANT})
    orbit = contin.cycle(problem, [5.0, 50.0], settle=300)
    return [contin.trace(orbit, free=["rho"], limits={"rho": (1, 8)}, zeros={"rho": [4.0]})]


def fitzhugh(u, p):
    """FitzHugh's equations."""
    return p.c * (u.x - u.x**3 / 3 + u.y), -(u.x - p.a + p.b * u.y) / p.c


@functools.cache
def fhn_rest():
    """Equilibria to a = 1."""
    return equilibria(fitzhugh, ["x", "y"], {"a": 0.0, "b": single(0.8), "c": 3.0}, [0.0, 0.0], "a", {"a": (-0.1, 1)})


def fhn_cycles():
    """Cycles back to a = 0."""
    return [leave(fhn_rest(), 0, {"a": (0, 1), "period": (0, 50)})]


def fhn_hopf():
    """The curve of Hopf points in c."""
    hopf = fhn_rest().labelled("HB")[0]
    return [contin.curve(hopf, free=["a", "c"], direction=way, limits={"a": (0, 1), "c": (0, 10)}) for way in (1, -1)]


def vertical(u, p):
    """A vertical family of cycles."""
    return -p.lam * u.x - u.y, u.x * (1 - u.x)


def upright(u, p):
    """The same with another sign."""
    return p.lam * u.x - u.y, u.x * (1 - u.x)


@functools.cache
def vertical_rest(field):
    """The origin, from lam = -1."""
    return equilibria(field, ["x", "y"], {"lam": -1.0}, [0.0, 0.0], "lam", {"lam": (-1, 1)})


# --- tor, wav, ops ----------------------------------------------------------------------------------------------------


def tor(u, p):
    """An electronic circuit."""
    apart = u.y - u.x
    return (
        (-(p.be + p.rn) * u.x + p.be * u.y - p.a3 * u.x**3 + p.b3 * apart**3) / p.r,
        p.be * u.x - (p.be + p.ga) * u.y - u.z - p.b3 * apart**3,
        u.y,
    )


@functools.cache
def tor_rest():
    """Equilibria: the origin, and the two branches that leave it."""
    limits = {"rn": (-0.91, -0.4)}
    values = {
        "rn": -0.9, "be": 0.5, "ga": single(-0.6), "r": single(0.6), "a3": single(0.328578), "b3": single(0.933578)
    }  # fmt: skip
    first = equilibria(tor, ["x", "y", "z"], values, [0.0, 0.0, 0.0], "rn", limits)
    return with_branches(first, {"rn": (-0.9, -0.4)})


@functools.cache
def tor_cycles():
    """Symmetric cycles, as far as AUTO's run."""
    return contin.trace(tor_rest()[0].labelled("HB")[0], branch=1, limits={"rn": (-0.91, -0.4), "period": (0, 42.664943)})


def tor_beside():
    """Cycles where the symmetry is broken."""
    return [contin.trace(tor_cycles().labelled("BP")[0], branch=1, limits={"rn": (-0.91, -0.4), "period": (0, 43.600853)})]


MEMBRANE = {"k": single(3.4), "i": single(0.023), "b": single(0.2)}


def wave(u, p):
    """Reaction in a membrane: demo ``wav``."""
    rate = u.y / (p.k + u.y) * u.x / (1 + u.x + p.i * u.x**2)
    return -p.a * (210 * rate - (145 - u.x)), -p.a * (210 * rate - p.b * (p.s - u.y))


def wav_rest():
    """Equilibria."""
    return [equilibria(wave, ["x", "y"], {"a": 3.0, "s": 500.0, **MEMBRANE}, [62.7662, 88.8308], "s", {"s": (500, 800)})]


def moving(u, p):
    """Waves u(x - c t): u' = v / D, v' = -(c u' + f) with D = 1 and 5."""
    rate = u.y / (p.k + u.y) * u.x / (1 + u.x + p.i * u.x**2)
    f1, f2 = -3 * (210 * rate - (145 - u.x)), -3 * (210 * rate - p.b * (p.s - u.y))
    return u.v, u.w, -(p.c * u.v + f1), -(p.c * u.w + f2) / 5


@functools.cache
def wav_waves():
    """Uniform states as equilibria of the equations of waves."""
    values = {"s": 500.0, "c": single(0.05), **MEMBRANE}
    return equilibria(moving, ["x", "y", "v", "w"], values, [62.7662, 88.8308, 0.0, 0.0], "s", {"s": (500, 800)})


def wav_periodic():
    """Periodic waves, to the wave length 500."""
    zeros = {"s": [610.0, 638.0]}
    return [leave(wav_waves(), 0, {"s": (500, 700), "period": (0, 500)}, zeros=zeros)]


def ops(u, p):
    """Demo ``ops``."""
    return (-p.p4 * (u.x**3 / 3 - u.x) + (u.z - u.x) / p.p2 - u.y) / p.p1, u.x - p.p3, -(u.z - u.x) / p.p2


@functools.cache
def ops_rest():
    """Equilibria."""
    values = {"p1": 0.5, "p2": 4.0, "p3": 0.9, "p4": 2.0}
    return equilibria(ops, ["x", "y", "z"], values, [0.9, -2 * (0.9**3 / 3 - 0.9), 0.9], "p3", {"p3": (0.8, 0.95)})


@functools.cache
def ops_cycles():
    """Cycles, their folds are extrema of p3."""
    limits = {"p3": (0.8992, 1), "period": (0, 12)}
    return leave(ops_rest(), 0, limits, free=["p3"], zeros={"p3": [0.92, 0.93]}, extrema=["p3"])


def ops_extrema():
    """Extrema of p3 in p2, to the one with respect to p2."""
    return [
        contin.curve(start, "p2", direction=way, limits={"p2": (0.5, 6)}, zeros={"p3": [0.92, 0.93]})
        for start in ops_cycles().labelled("EX")[:2] for way in (1, -1)
    ]  # fmt: skip


def chua(u, p):
    """Chua's circuit with a smooth resistor."""

    def smooth(x):
        return 2 * x * math.atan(10 * x) / math.pi

    h = p.a1 * u.x + 0.5 * (p.a0 - p.a1) * (smooth(u.x + 1) - smooth(u.x - 1))
    return p.alpha * (u.y - h), u.x - u.y + u.z, -p.beta * u.y


@functools.cache
def chu_rest():
    """Equilibria beside the origin."""
    values = {"alpha": 5.0, "beta": single(14.3), "a0": single(-1 / 7), "a1": single(2 / 7)}
    return equilibria(chua, ["x", "y", "z"], values, [1.4994022, 0.0, -1.4994022], "alpha", {"alpha": (4, 9.5)})


def chu_cycles():
    """Cycles, through their first doubling."""
    return [leave(chu_rest(), 0, {"alpha": (6, 11.085), "period": (0, 19.342)})]


def demos() -> list[Demo]:
    """Return the demos."""
    return [
        Demo("ab", "a reaction A → B in a stirred tank", [
            Part([1], lambda: [ab_rest(8.0)], columns("p1", period=False)),
            *(Part([n], functools.partial(lambda p2: [ab_rest(p2)], p2), columns("p1", period=False))
              for n, p2 in ((2, 14.0), (3, 15.0), (4, 16.0), (5, 17.0), (6, 18.0))),
            Part(range(7, 14), ab_cycles, columns("p1")),
        ], note="At p2 = 16 both folds lie at the same place: there x (1 - x) = 1/4, which is the hysteresis point; "
             "p1 = exp(-2)."),
        Demo("abc", "reactions A → B → C in a stirred tank", [
            Part([0], lambda: [abc_rest()], columns("d", period=False)),
            Part([1, 2, 3, 4], abc_cycles, columns("d")),
        ]),
        Demo("lrz", "Lorenz's equations", [Part([0], lrz_rest, columns("rho", "rho", False))]),
        Demo("lor", "doublings of Lorenz's cycles", [
            Part([0], lambda: [lor_first()], {"PAR(1)": "rho", "PERIOD": "period"}),
            Part([1], lambda: [lor_doubled()], {"PAR(1)": "rho", "PERIOD": "period"}),
            Part([2], lambda: [lor_fourfold()], {"PAR(1)": "rho", "PERIOD": "period"}),
        ]),
        Demo("pp2", "two species, one of them fished", [
            Part([0], pp2_rest, {"quota": "p1", "fish": "x", "sharks": "y"}),
            Part([1], pp2_cycles, {"quota": "p1", "L2-NORM": norm, "PERIOD": "period"}),
        ]),
        Demo("pp3", "three species", [
            Part([0], pp3_rest, {"PAR(1)": "p1", "U(1)": "x", "U(2)": "y", "U(3)": "z"}, labels=("BP", "LP", "HB")),
            Part([1, 2, 3, 4], pp3_cycles, columns("p1")),
        ]),
        Demo("ppp", "three species", [Part([0], ppp_rest, {"PAR(1)": "p1", "U(1)": "x", "U(2)": "y", "U(3)": "z"})]),
        Demo("plp", "folds of cycles, and an isola", [
            Part([0], lambda: [plp_rest()], columns("rho", "PAR(4)", False)),
            Part([1, 2], plp_cycles, columns("rho", "PAR(4)")),
            Part([3, 4], plp_hopf, {"PAR(4)": "rho", "PAR(1)": "s0"}),
            Part([5, 6, 7], plp_folds, {"PAR(4)": "rho", "PERIOD": "period", "PAR(1)": "s0"}),
            Part([8, 9], plp_isola, columns("rho", "PAR(4)")),
        ]),
        Demo("fhn", "FitzHugh's equations", [
            Part([0], lambda: [fhn_rest()], columns("a", period=False)),
            Part([1], fhn_cycles, columns("a")),
            Part([2, 3], fhn_hopf, {"PAR(1)": "a", "PAR(3)": "c"}),
        ]),
        Demo("tor", "an electronic circuit with tori", [
            Part([0], tor_rest, columns("rn", period=False)),
            Part([1], lambda: [tor_cycles()], {"PAR(1)": "rn", "PERIOD": "period"}),
            Part([2], tor_beside, {"PAR(1)": "rn", "PERIOD": "period"}),
        ], note="Without the curves of tori. AUTO's folds are off in the period, also with finer constants: at its fold of the "
                "period 13.91221 SciPy gives a second multiplier of 1.03, at contin's 13.91191 it is 1 within 1.4e-7."),
        Demo("wav", "waves of a reaction and diffusion", [
            Part([0], wav_rest, columns("s", "PAR(3)", False)),
            Part([1], lambda: [wav_waves()], {"PAR(3)": "s", "U(1)": "x", "U(2)": "y"}),
            Part([2], wav_periodic, {"PAR(3)": "s", "PERIOD": "period"}),
        ]),
        Demo("ops", "cycles with an extremum in further parameters", [
            Part([0], lambda: [ops_rest()], columns("p3", "PAR(3)", False)),
            Part([1], lambda: [ops_cycles()], columns("p3", "PAR(3)")),
            Part([4], ops_extrema, {"PAR(3)": "p3", "PAR(2)": "p2", "PERIOD": "period"}, also={"EX": "UZ"}),
        ]),
        Demo("chu", "Chua's circuit", [Part([1], chu_cycles, columns("alpha"))],
             note="Cycles only: the demo's first run follows the line of equilibria α = 0, too."),
        *(
            Demo(name, "a vertical family of cycles", [
                Part([0], functools.partial(lambda field: [vertical_rest(field)], field), {"PAR(1)": "lam"},
                     known=[("HB", {"PAR(1)": 0.0})]),
            ], note="The family at λ = 0 has no labelled point but its ends; contin follows it with "
                    "`trace(hopf, branch=1, primary=\"period\")`.")
            for name, field in (("phs", vertical), ("vhb", upright))
        ),
    ]  # fmt: skip
