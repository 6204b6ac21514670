r"""# Mathieu's eigenvalues: the tongues of parametric resonance

A pendulum whose pivot shakes, an ion in a quadrupole trap: both obey Mathieu's equation

$$u'' + \left(a - 2 q \cos 2t\right) u = 0 .$$

For each $q$ there are eigenvalues $a$ with solutions of period $\pi$ or $2\pi$. They bound the tongues, in which the rest
position is unstable. By symmetry the interval from 0 to $\pi/2$ is enough. A condition on the norm, $\int u^2 dt = 1$, makes
each eigenvalue a regular unknown. It is followed from $q = 0$, where $a = n^2$ and $u$ is a sine or a cosine.

**Check:** $a_0(5) = -5.80004602$ (Abramowitz & Stegun, Table 20.1).
"""

import math

import matplotlib.pyplot as plt

import contin


def follow(n, kind):
    """Follow a_n (kind "cos") or b_n (kind "sin") up to q = 8."""
    even_start, even_end = kind == "cos", (n % 2 == 0) == (kind == "cos")  # even about the end: zero slope there
    mathieu = contin.BoundaryValueProblem(
        rhs=lambda t, u, p: (u.v, (2 * p.q * math.cos(2 * t) - p.a) * u.u),
        boundary=lambda left, right, p: (left.v if even_start else left.u, right.v if even_end else right.u),
        integrals=lambda t, u, p: (u.u**2 - 2 / math.pi,),
        states=["u", "v"],
        parameters={"q": 0.0, "a": float(n * n)},
        domain=(0, math.pi / 2),
    )
    size = math.sqrt((4 if n else 2) / math.pi)  # of the norm that the integral asks for
    wave, slope = (math.cos, lambda x: -math.sin(x)) if kind == "cos" else (math.sin, math.cos)
    first = contin.solve(mathieu, lambda t: (size * wave(n * t), n * size * slope(n * t)), free=["a"])
    return contin.trace(first, free=["q", "a"], limits={"q": (0, 8)}, zeros={"q": [5.0]}, max_step=0.5)


_, axes = plt.subplots(figsize=(9, 4), layout="constrained")
branches = {(kind, n): follow(n, kind) for kind, numbers in (("cos", range(4)), ("sin", range(1, 5))) for n in numbers}
for branch in branches.values():
    branch.plot("q", "a", axes=axes)
(point,) = branches["cos", 0].labelled("UZ")
print(f"a_0(5) = {point['a']:.8f}")
assert abs(point["a"] + 5.80004602) < 1e-8
for n in range(4):  # the rest position is stable between a_n and b_(n+1)
    low, high = branches["cos", n], branches["sin", n + 1]
    around = [[*low.column(name), *high.column(name)[::-1]] for name in ("q", "a")]
    axes.fill(*around, color="C2", alpha=0.2, lw=0, label=None if n else "stable")
    for name, branch in ((f"$a_{n}$", low), (f"$b_{n + 1}$", high)):
        axes.annotate(name, (8, branch.points[-1]["a"]), xytext=(6 + 16 * (name[1] == "b"), -4), textcoords="offset points")
axes.legend(loc="lower left")
axes.set(xlabel="strength q", ylabel="eigenvalue a")
plt.show()
