"""Reference values without a closed form, in extended precision: ``python -m bank.refine`` (15 s).

Equations and null vectors are stated here once more; points of the engine serve as first guesses only. Every value is computed
on the mesh of the guess with two and with four times as many intervals, must agree between them, and is looked up in the bank.
"""

from __future__ import annotations

import math

import numpy as np

from bank import bru, ext, kar, non, pd2, spb
from bank.longdouble import LD, Problem
from bank.references import confirm


def halved(mesh):
    return np.sort(np.append(mesh, (mesh[1:] + mesh[:-1]) / 2))


def polish(point, rhs, boundary, p, integrals=None, states=None):
    """The unknown parameters of the problem near ``point``; ``states(t)`` is the guess, the point's own states by default."""
    mesh, results = point.system.mesh, []
    for _ in range(2):
        mesh = halved(mesh)
        problem = Problem(rhs, boundary, mesh, 8, integrals)
        t = problem.nodes.astype(float)
        guess = point.system.evaluate(point.x, t).T if states is None else states(t)
        results.append(problem.solve(guess, p)[1])
    assert np.all(np.abs(results[1] - results[0]) <= 1e-15 * np.maximum(1, np.abs(results[0]))), results
    return results[1]


def mean_of(point, rhs, boundary, places, guesses):
    """Means of some states of an isolated solution."""
    return polish(point, rhs, boundary, guesses, lambda t, u, p: [u[i] - p[k] for k, i in enumerate(places)])


def with_null(point, scale):
    """States of a point and of its tangent, this divided by ``scale(tangent at t = 0)``."""

    def states(t):
        tangent = point.system.evaluate(point.tangent, t).T
        return np.vstack([point.system.evaluate(point.x, t).T, tangent / scale(tangent[:, 0])])

    return states


def of_non():
    def ends(a, b):
        return a[0], b[0]

    for point in non.run().points:
        if point.label == "UZ":
            p1 = LD(round(point["p1"]))
            (mean,) = mean_of(
                point,
                lambda t, u, p, p1=p1: (u[1], -p1 * np.exp(t**3 * u[0])),
                lambda a, b, p: ends(a, b),
                [0],
                [point["mean"]],
            )
            confirm("non", p1=float(p1), mean=float(mean))
        if point.label == "EP" and point["p1"] > 0:
            (p1,) = polish(
                point, lambda t, u, p: (u[1], -p[0] * np.exp(t**3 * u[0])), lambda a, b, p: ends(a, b), [point["p1"]],
                lambda t, u, p: [u[0] - 5],
            )  # fmt: skip
            confirm("non", p1=float(p1), mean=5.0)
        if point.label == "LP":

            def rhs(t, u, p):
                e = p[0] * np.exp(t**3 * u[0])
                return u[1], -e, u[3], -e * t**3 * u[2]

            p1, mean = polish(
                point, rhs, lambda a, b, p: (*ends(a, b), *ends(a[2:], b[2:]), a[3] - 1), [point["p1"], point["mean"]],
                lambda t, u, p: [u[0] - p[1]], with_null(point, lambda v: v[1]),
            )  # fmt: skip
            confirm("non", p1=float(p1), mean=float(mean))


def of_ext():
    square = (LD("4.6") * LD("3.14159265358979323846264338327950288")) ** 2
    for which in (1, 2, 3):
        for sign in (1, -1):
            end = ext.half_branch(which, sign).points[-1]
            (mean,) = mean_of(
                end, lambda t, u, p: (u[1], -square * np.sin(u[0] + u[0] ** 2 + u[0] ** 3)), lambda a, b, p: (a[0], b[0]),
                [0], [end["mean"]],
            )  # fmt: skip
            confirm("ext", lam=4.6, mean=float(mean))


def of_spb():
    for branch in (spb.homotopy(), spb.thinner(), spb.across()):
        for point in branch.points[1:]:
            if point.label:
                eps, gam = (LD(repr(round(point[name], 6))) for name in ("eps", "gam"))
                (mean,) = mean_of(
                    point, lambda t, u, p, eps=eps: (u[1], (u[0] * (u[0] ** 2 - 1) * u[1] + u[0]) / eps),
                    lambda a, b, p, gam=gam: (a[0] - LD("1.5"), b[0] - gam), [0], [point["mean"]],
                )  # fmt: skip
                confirm("spb", mean=float(mean))


def of_pd2():
    def field(u, p1):
        return u[1], u[0] * u[2] - p1 * u[0] * (1 - u[0]), u[3], u[2] - u[0] * u[2]

    def boundary(a, b, p):
        return a[0], b[0], a[2] - 1, b[2] - 1

    def null(t, u, p):
        x, dx, y, dy = u[4:]
        return *field(u, p[0]), dx, x * u[2] + u[0] * y - p[0] * (1 - 2 * u[0]) * x, dy, y - x * u[2] - u[0] * y

    half = LD("0.5")
    for k, point in enumerate(pd2.without().labelled("BP"), 1):
        (p1,) = polish(
            point, lambda t, u, p: (u[1], (np.cosh(t - half) / np.cosh(half) - p[0]) * u[0]),
            lambda a, b, p: (a[0], b[0], a[1] - 1), [point["p1"]],
            states=lambda t, k=k: np.array([np.sin(k * np.pi * t) / (k * np.pi), np.cos(k * np.pi * t)]),
        )  # fmt: skip
        confirm("pd2", p1=float(p1), x_mean=0.0)
    for which, sign in ((1, 1), (2, 1), (2, -1), (3, 1), (3, -1)):
        for point in pd2.half_branch(which, sign).points[1:]:
            guesses = [point["x_mean"], point["y_mean"]]
            if point.label in ("UZ", "EP"):
                p1 = LD(round(point["p1"]))
                x, y = mean_of(point, lambda t, u, p, p1=p1: field(u, p1), boundary, [0, 2], guesses)
                confirm("pd2", p1=float(p1), x_mean=float(x), y_mean=float(y))
            if point.label == "LP":
                p1, x, y = polish(
                    point, null, lambda a, b, p: (*boundary(a, b, p), a[4], b[4], a[6], b[6], a[5] - 1),
                    [point["p1"], *guesses], lambda t, u, p: [u[0] - p[1], u[2] - p[2]], with_null(point, lambda v: v[1]),
                )  # fmt: skip
                confirm("pd2", p1=float(p1), x_mean=float(x), y_mean=float(y))


def of_bru():
    diffx, diffy, a0, b0 = LD("0.0016"), LD("0.008"), LD(2), LD("4.6")
    mirror = np.array([1, -1, 1, -1])[:, None]

    def field(u, v, length):
        """The equations for u, and linearized about it for v."""
        rate, change = u[0] ** 2 * u[2], 2 * u[0] * u[2] * v[0] + u[0] ** 2 * v[2]
        x, y = length**2 / diffx, length**2 / diffy
        first = u[1], -x * (rate - (b0 + 1) * u[0] + a0), u[3], -y * (b0 * u[0] - rate)
        return *first, v[1], -x * (change - (b0 + 1) * v[0]), v[3], -y * (b0 * v[0] - change)

    def means(t, u, p):
        return u[0] - p[1], u[2] - p[2]

    def whole(a, b, p):
        return a[0] - a0, b[0] - a0, a[2] - b0 / a0, b[2] - b0 / a0, a[4], b[4], a[6], b[6], a[5] - 1

    def half(a, b, p):
        return a[0] - a0, b[1], a[2] - b0 / a0, b[3], a[4], b[4], a[6], b[6], a[5] - 1

    for point in bru.half_branch(1, 1).points[1:]:
        guesses = [point["L"], point["x_mean"], point["y_mean"]]
        if point.label == "LP":
            states = with_null(point, lambda v: v[1])
            length, x, y = polish(point, lambda t, u, p: field(u[:4], u[4:], p[0]), whole, guesses, means, states)
        elif point.label == "BP" and abs(point["x_mean"] - 2) > 1e-3:

            def odd(vector, t, point=point):
                """The antisymmetric part of a vector of unknowns, at the half-domain's t."""
                here, there = (point.system.evaluate(vector, s).T for s in (t / 2, 1 - t / 2))
                return (here - there * mirror) / 2

            kernel = max(point.details.kernel, key=lambda vector: np.abs(odd(vector, np.linspace(0, 1, 99))).max())

            def states(t, point=point, kernel=kernel):
                v = odd(kernel, t)
                return np.vstack([point.system.evaluate(point.x, t / 2).T, v / v[1, 0]])

            length, x, y = polish(
                point, lambda t, u, p: [f / 2 for f in field(u[:4], u[4:], p[0])], half, guesses, means, states
            )
        else:
            continue
        confirm("bru", L=float(length), x_mean=float(x), y_mean=float(y))


def of_kar():
    T, zero = LD(500), LD(0)

    def field(u, gam):
        h, f, df, g, dg = u
        return T * f, T * df, T * (f**2 - g**2 - 2 * gam * g - 2 * h * df), T * dg, T * (2 * gam * f + 2 * f * g - 2 * h * dg)

    def linear(u, v, gam):
        h, f, df, g, dg = u
        H, F, dF, G, dG = v
        bend = 2 * (f * F - g * G - gam * G - H * df - h * dF)
        return T * F, T * dF, T * bend, T * dG, T * 2 * (gam * F + F * g + f * G - H * dg - h * dG)

    def conditions(a, b, gam, inf):
        decay = np.sqrt((np.sqrt(inf**4 + 4 * gam**2) + inf**2) / 2)
        far = (inf + decay) * b[1] + b[2] - gam / decay * b[3], gam / decay * b[1] + (inf + decay) * b[3] + b[4]
        return a[0], a[1], a[3] - 1 + gam, b[0] - inf, *far

    def changes(va, vb, b, gam, inf):
        """The conditions linearized, for a change of inf by 1."""
        root = np.sqrt(inf**4 + 4 * gam**2)
        decay = np.sqrt((root + inf**2) / 2)
        rate = (2 * inf**3 / root + 2 * inf) / (4 * decay)
        first = (inf + decay) * vb[1] + vb[2] - gam / decay * vb[3] + (1 + rate) * b[1] + gam / decay**2 * rate * b[3]
        second = gam / decay * vb[1] + (inf + decay) * vb[3] + vb[4] - gam / decay**2 * rate * b[1] + (1 + rate) * b[3]
        return va[0], va[1], va[3], vb[0] - 1, first, second

    for point in kar.run().points[1:]:
        if point.label == "UZ":
            (inf,) = polish(point, lambda t, u, p: field(u, zero), lambda a, b, p: conditions(a, b, zero, p[0]), [point["inf"]])
            confirm("kar", gam=0.0, inf=float(inf))
        elif point.label == "LP":
            scale = point.tangent[point.system.parameter_index("inf")]
            gam, inf = polish(
                point, lambda t, u, p: (*field(u[:5], p[0]), *linear(u[:5], u[5:], p[0])),
                lambda a, b, p: (*conditions(a[:5], b[:5], p[0], p[1]), *changes(a[5:], b[5:], b, p[0], p[1])),
                [point["gam"], point["inf"]], states=with_null(point, lambda v, scale=scale: scale),
            )  # fmt: skip
            confirm("kar", gam=float(gam), inf=float(inf))


if __name__ == "__main__":
    assert math.log2(np.finfo(LD).eps) < -60, "numpy.longdouble is no more than double precision here"
    for problem in (of_non, of_ext, of_spb, of_pd2, of_bru, of_kar):
        problem()
