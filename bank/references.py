"""The reference values once more, from closed forms and quadratures: ``python -m bank.references`` (40 s).

Everything is computed by mpmath with 30 digits, from scratch, and looked up among the special points of the bank: a value that
is not there to 2e-15 (relative to max(1, |value|)) is an error. Values of problems without such a form: ``bank.refine``.
"""

from __future__ import annotations

import functools
import importlib

import mpmath as mp
import numpy as np


def confirm(module: str, tolerance=2e-15, **values):
    """Raise unless a special point of this module has all these values."""
    for case in importlib.import_module(f"bank.{module}").CASES:
        for special in case.specials:
            if all(
                name in special.values and abs(special.values[name] - v) <= tolerance * max(1, abs(v))
                for name, v in values.items()
            ):
                print(
                    f"{case.name:24} {special.label}", ", ".join(f"{n} = {mp.nstr(mp.mpf(v), 18)}" for n, v in values.items())
                )
                return
    raise AssertionError(f"{module}: no special point has {values}")


def logcosh(x):
    return mp.log(mp.cosh(x))


def slope(function):
    return lambda x: mp.diff(function, x)


# --- Bratu's problem and its relatives --------------------------------------------------------------------------------


def bratu(s):
    return 8 * s**2 / mp.cosh(s) ** 2


def bratu_mean(s):
    return 2 * logcosh(s) - 2 * mp.quad(lambda y: logcosh(s * y), [0, 1])


def exp():
    fold = mp.findroot(lambda s: s * mp.tanh(s) - 1, 1.2)
    confirm("exp", lam=bratu(fold), mean=bratu_mean(fold))
    confirm("ezp", lam=bratu(fold), re=bratu_mean(fold))
    for near in (0.4, 2.5):
        confirm("exp", lam=1, mean=bratu_mean(mp.findroot(lambda s: bratu(s) - 1, near)))
    confirm("exp", lam=bratu(mp.findroot(lambda s: bratu_mean(s) - 6, 5)), mean=6)
    for near in (0.3, 2.0):
        confirm("ezp", lam=2, re=bratu_mean(mp.findroot(lambda s: bratu(s) - 2, near)))
    for lam in (5, 6):
        mean = bratu_mean(mp.findroot(lambda s, lam=lam: bratu(s) - lam, mp.mpc(1.2, 0.6)))
        confirm("ezp", lam=lam, re=mean.real, im=mean.imag)


def integral():
    def p1(s):
        return bratu(s) * mp.exp(bratu_mean(s))

    def square(s):
        return 4 * mp.quad(lambda y: (logcosh(s) - logcosh(s * y)) ** 2, [0, 1]) - bratu_mean(s) ** 2

    fold = mp.findroot(slope(lambda s: mp.log(p1(s))), 2)
    confirm("int", p1=p1(fold), square=square(fold))
    for value, near in ((1, 0.3), (3, 0.6), (3, 4.0)):
        confirm("int", p1=value, square=square(mp.findroot(lambda s, value=value: mp.log(p1(s) / value), near)))
    confirm("int", p1=p1(mp.findroot(lambda s: square(s) - 10, 4.0)), square=10)

    def mean(s, d):
        return -mp.quad(lambda x: logcosh(s * x + d), [-1, 0, 1])

    def log_p1(s, d):
        return mp.log(8 * s**2) + mean(s, d)

    def p2(s, d):
        return 2 * logcosh(d + s) - 2 * logcosh(d - s)

    def singular(s, d):
        (a, b), (c, e) = ([mp.diff(f, (s, d), n) for n in ((1, 0), (0, 1))] for f in (log_p1, p2))
        return a * e - b * c

    for value in (1, 2, 4):
        s, d = mp.findroot(lambda s, d, value=value: (singular(s, d), p2(s, d) - value), (2.2, 0.1 + 0.2 * value), tol=1e-20)
        middle = mean(s, d)
        second = mp.quad(lambda x, s=s, d=d, middle=middle: (2 * logcosh(s * x + d) + middle) ** 2, [-1, 0, 1]) / 2
        confirm("int", p1=mp.exp(log_p1(s, d)), p2=value, square=second)


def lin():
    def p2(lam):
        return mp.sin(mp.pi * lam) / mp.sqrt(mp.mpf(1) / 2 - mp.sin(2 * mp.pi * lam) / (4 * mp.pi * lam))

    for near in (1.46, 2.48, 3.485):
        lam = mp.findroot(slope(p2), near)
        confirm("lin", lam=lam, p2=abs(p2(lam)))
    for near in (1.2, 1.75, 2.2, 2.75, 3.25):
        confirm("lin", lam=mp.findroot(lambda lam: abs(p2(lam)) - 1, near), p2=1)


# --- oscillators: m positive and n negative half-periods ------------------------------------------------------------


def quadratic(energy, sign):
    """Time and integral of w over one half-period of w'' = w^2 - w, on the positive or negative side."""
    if energy < mp.mpf(1) / 6:
        a = mp.acos(1 - 12 * energy) / 3
        low, high, top = sorted(mp.cos(a + 2 * mp.pi * i / 3) + mp.mpf(1) / 2 for i in range(3))
    else:
        low = mp.findroot(lambda w: 2 * energy - w**2 + 2 * w**3 / 3, -mp.sqrt(2 * energy) / (1 + mp.sqrt(energy)))
    if sign > 0:
        end = high
        rest = lambda w: mp.mpf(2) / 3 * (w - low) * (top - w)  # noqa: E731
    else:
        end, b = low, low - mp.mpf(3) / 2
        rest = lambda w: mp.mpf(2) / 3 * (w**2 + b * w + low * b)  # noqa: E731
    rate = lambda x: 4 * mp.sqrt(abs(end)) / mp.sqrt(rest(end * (1 - x**2)))  # noqa: E731
    return mp.quad(rate, [0, 1]), mp.quad(lambda x: rate(x) * end * (1 - x**2), [0, 1])


def bvp():
    def branch(m, n, energy):
        parts = [(m, quadratic(energy, 1))] if m else []
        parts += [(n, quadratic(energy, -1))] if n else []
        lam = sum(count * time for count, (time, _) in parts) / mp.pi
        return lam, lam * mp.pi * sum(count * integral for count, (_, integral) in parts)

    def bounded(y):
        return 1 / (6 * (1 + mp.exp(-y)))

    for m, n in ((1, 0), (1, 1), (2, 1), (1, 2), (2, 2), (3, 2), (2, 3)):
        means = [(mp.mpf(y) / 2, branch(m, n, bounded(mp.mpf(y) / 2))[1]) for y in range(-12, 48)]
        for mean in (3, 6, 9):
            ends = next((a, b) for (a, u), (b, v) in zip(means, means[1:]) if u < mean < v)
            y = mp.findroot(
                lambda y, m=m, n=n, mean=mean: branch(m, n, bounded(y))[1] - mean, ends, solver="anderson", tol=1e-24
            )
            confirm("bvp", lam=branch(m, n, bounded(y))[0], mean=mean)
    for m, n in ((1, 2), (2, 3)):
        lam, mean = branch(m, n, bounded(mp.findroot(slope(lambda y, m=m, n=n: branch(m, n, bounded(y))[0]), 0.0)))
        confirm("bvp", lam=lam, mean=mean)
    for mean, ends in ((-3, (-1, 0)), (-6, (1, 4))):
        y = mp.findroot(lambda y, mean=mean: branch(0, 1, mp.exp(y))[1] - mean, ends, solver="secant")
        confirm("bvp", lam=branch(0, 1, mp.exp(y))[0], mean=mean)
    cubic = lambda y: 2 / mp.sqrt(1 + (1 - y**2) + (1 - y**2) ** 2)  # noqa: E731
    time, integral_ = mp.quad(cubic, [0, 1]), mp.quad(lambda y: (1 - y**2) * cubic(y), [0, 1])
    confirm("bvp", lam=0, mean=-6 * time * integral_)


@functools.cache
def gauss(n):
    """Nodes and weights of Gauss's rule on (0, 1)."""
    x = [mp.mpf(float(v)) for v in np.polynomial.legendre.leggauss(n)[0]]
    for _ in range(3):
        x = [v - mp.legendre(n, v) * (v**2 - 1) / (n * (v * mp.legendre(n, v) - mp.legendre(n - 1, v))) for v in x]
    return [((v + 1) / 2, (1 - v**2) / (n * mp.legendre(n - 1, v)) ** 2) for v in x]


def ext():
    def force(u):
        return mp.sin(u + u**2 + u**3)

    def mean_force(w, a):
        return mp.fsum(k * force(a - (a - w) * y) for y, k in gauss(48))

    def half(a):
        time = integral_ = mp.mpf(0)
        for x, k in gauss(48):
            w = a * (1 - x**2)
            rate = 4 * k * mp.sqrt(abs(a)) / mp.sqrt(2 * mp.sign(a) * mean_force(w, a))
            time, integral_ = time + rate, integral_ + rate * w
        return time, integral_

    def branch(m, n, a):
        """lam and mean for amplitude a, of the negative side where m = 0."""
        parts = [(m, half(a))] if m else []
        if m and n:
            energy = a * mean_force(mp.mpf(0), a)
            a = -mp.findroot(lambda b: b * mean_force(mp.mpf(0), b) - energy, (-1.2 * a, -1.1 * a), tol=1e-27)
        parts += [(n, half(-a))] if n else []
        time = sum(count * t for count, (t, _) in parts)
        return time / mp.pi, sum(count * i for count, (_, i) in parts) / time

    for m, n, near in (
        (0, 1, 0.5),
        (0, 1, 1.2),
        (1, 0, 0.61),
        (1, 1, 0.3),
        (1, 1, 0.699),
        (1, 2, 0.404),
        (1, 2, 0.741),
        (2, 1, 0.663),
    ):
        a = mp.findroot(slope(lambda z, m=m, n=n: branch(m, n, z)[0]), near, tol=1e-20)
        lam, mean = branch(m, n, a)
        confirm("ext", lam=lam, mean=mean)


# --- algebraic problems -----------------------------------------------------------------------------------------------


def ab():
    for p2 in (8, 14, 20):
        k = mp.mpf(p2) / 3

        def p1(x, k=k):
            return x / (1 - x) * mp.exp(-k * x)

        if p2 > 12:
            for sign in (-1, 1):
                x = (1 + sign * mp.sqrt(1 - 4 / k)) / 2
                confirm("ab", p1=p1(x), X=x, Y=k * x)
            x = (p2 + 3 + mp.sqrt((p2 + 3) ** 2 - 16 * p2)) / (2 * p2)
            confirm("ab", p1=p1(x), X=x, Y=k * x)
        end = mp.findroot(lambda x, p1=p1: mp.log(p1(x) / mp.mpf("0.35")), {8: 0.685, 14: 0.97, 20: 0.99629}[p2]).real
        confirm("ab", p1=mp.mpf("0.35"), X=end, Y=k * end)


def abc():
    s, b = mp.mpf("0.04"), 8
    hopf = {"1.21": [97.0], "1.55": [1.43, 3.98, 12.5, 84.0], "1.57": [1.46, 3.88, 12.96, 83.0]}
    for beta, ends in (("1.21", 400.0), ("1.55", 116.0), ("1.57", 106.0)):

        def point(w, beta=mp.mpf(beta)):
            x = w / (1 + w)
            y = x / (1 + w * s)
            z = b * w * (1 - x + s * y) / (1 + beta)
            return x, y, z, w * mp.exp(-z)

        def minors(w, point=point, beta=mp.mpf(beta)):
            """The coefficients of the characteristic polynomial."""
            x, y, _, _ = point(w)
            rows = [[-1 - w, 0, w * (1 - x)], [-w, -1 - w * s, w * (1 - x - s * y)]]
            matrix = mp.matrix([*rows, [-b * w, b * w * s, -1 - beta + b * w * (1 - x + s * y)]])
            pairs = ((0, 1), (0, 2), (1, 2))
            second = sum(matrix[i, i] * matrix[j, j] - matrix[i, j] * matrix[j, i] for i, j in pairs)
            return -sum(matrix[i, i] for i in range(3)), second, -mp.det(matrix)

        def hurwitz(w, minors=minors):
            a1, a2, a3 = minors(w)
            return a1 * a2 - a3

        for near in hopf[beta]:
            w = mp.findroot(hurwitz, near)
            x, _, z, d = point(w)
            confirm("abc", d=d, X=x, Z=z, frequency=mp.sqrt(minors(w)[1]))
        for near in (1.0, 36.0) if beta == "1.21" else ():
            x, _, z, d = point(mp.findroot(slope(lambda w, point=point: mp.log(point(w)[3])), near))
            confirm("abc", d=d, X=x, Z=z)
        x, _, z, d = point(mp.findroot(lambda w, point=point: mp.log(point(w)[3] / mp.mpf("0.4")), ends))
        confirm("abc", d=d, X=x, Z=z)


def enz():
    def uptake(s):
        return 100 * s / (1 + s + s**2)

    def rate(s):
        return 100 * (1 - s**2) / (1 + s + s**2) ** 2

    for held, near in ((1, 1.05), (1, 8.8), (3, 1.17), (3, 4.39)):
        s = mp.findroot(lambda s, held=held: held + rate(s), near)
        confirm("enz", s0=s + uptake(s), S1=s, S2=s)
    s = mp.findroot(lambda s: s + uptake(s) - 36, 33.0)
    confirm("enz", s0=36, S1=s, S2=s)
    for near in ((25.37, 0.5717, 5.884), (26.62, 1.048, 8.783)):
        equations = lambda s0, a, c: (  # noqa: E731
            s0 - 2 * a + c - uptake(a), s0 - 2 * c + a - uptake(c), (2 + rate(a)) * (2 + rate(c)) - 1
        )  # fmt: skip
        s0, a, c = mp.findroot(equations, near)
        confirm("enz", s0=s0, S1=a, S2=c)
        confirm("enz", s0=s0, S1=c, S2=a)


def pp2():
    def p1(x):
        return 3 * x * (1 - x) / (1 - mp.exp(-5 * x))

    third = mp.mpf(1) / 3
    decay = mp.exp(-5 * third)

    def predators(p):
        return 2 - 3 * p * (1 - decay)

    fold = mp.findroot(slope(p1), 0.411)
    confirm("pp2", p1=p1(fold), X=fold, Y=0)
    confirm("pp2", p1=p1(third), X=third, Y=0)
    p = mp.findroot(lambda p: 1 - predators(p) - 5 * p * decay, 0.67)
    confirm("pp2", p1=p, X=third, Y=predators(p), frequency=mp.sqrt(predators(p)))
    for p in (mp.mpf(1), mp.mpf("-0.1")):
        confirm("pp2", p1=p, X=third, Y=predators(p))
    confirm("pp2", p1=mp.mpf("-0.1"), X=mp.findroot(lambda x: p1(x) + mp.mpf("0.1"), 1.03), Y=0)
    confirm("pp2", p1=p1(mp.mpf(-2)), X=-2, Y=0)
    confirm("cusp", X=mp.findroot(lambda x: -2 + x - x**3, -1.5), mu=-2)


if __name__ == "__main__":
    mp.mp.dps = 30
    for problem in (exp, integral, lin, bvp, ext, ab, abc, enz, pp2):
        problem()
