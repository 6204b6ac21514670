r"""# A shallow arch: snapping through on one side

An arch on pins, $y_0 = e \sin t$, carries a load that is distributed like a sine. It shortens, and its thrust $P$ grows.
In suitable units (after Fung & Kaplan 1952) the energy and the thrust are

$$E = \int_0^\pi \tfrac12 (y'' - y_0'')^2 + \tfrac18 P^2 + q\, y \sin t \; dt, \qquad
P = \frac2\pi \int_0^\pi (y_0'^2 - y'^2)\, dt .$$

A high arch does not wait for its limit load: it leans to one side first, at a branch point, and goes through that way.

**Check:** $y = a_1 \sin t + a_2 \sin 2t$ solves the equations exactly. So the branch point is at $q = e + 3\sqrt{e^2 - 4}$,
where $P = 4$, and the limit load is $q = e + 2 ((e^2 - 1)/3)^{3/2}$; here $e = 3$.
"""

import math

import matplotlib.pyplot as plt
import numpy as np

import contin

arch = contin.VariationalProblem(
    energy=lambda t, x, w, p: (w.bend + p.e * math.sin(t)) ** 2 / 2 + x.P**2 / 8 + p.q * x.y * math.sin(t),
    states=["y", "slope", "P"],
    parameters={"e": 3.0, "q": 0.0},
    kinematics=lambda t, x, w, p: (x.slope, w.bend, 0),
    controls=["bend"],
    ends=lambda a, b, p: (a.y, b.y),
    integrals={"thrust": lambda t, x, w, p: (p.e * math.cos(t)) ** 2 - x.slope**2 - x.P / 2},
    functionals={"height": lambda t, x, w, p: x.y * math.sin(t) * 2 / math.pi},
    domain=(0, math.pi),
)
at_rest = contin.solve(arch, lambda t: (3 * math.sin(t), 3 * math.cos(t), 0))
limits = {"q": (-7, 14), "height": (-4, 4)}
symmetric = contin.trace(at_rest, free=["q"], limits=limits, max_step=0.5)
leaning = contin.trace(symmetric.labelled("BP")[0], branch=1, limits={"height": (-2.2, 4)}, max_step=0.5)
for point in symmetric.points[1:-1]:
    if point.label:
        print(f"{point.label} at q = {point['q']:.9f}, index {point.index_change[0]} -> {point.index_change[1]}")
assert abs(symmetric.labelled("BP")[0]["q"] - (3 + 3 * 5**0.5)) < 1e-9
assert abs(symmetric.labelled("LP")[0]["q"] - (3 + 2 * (8 / 3) ** 1.5)) < 1e-9

_, (left, right) = plt.subplots(1, 2, figsize=(9, 4), layout="constrained")
symmetric.plot("height", "q", axes=left)
leaning.plot("height", "q", axes=left)
left.set(xlabel="height of the middle", ylabel="load q", xlim=(3.6, -3.6))
left.legend(loc="upper center", bbox_to_anchor=(0.66, 1.02))
t = np.linspace(0, math.pi, 200)
level = min(leaning, key=lambda point: abs(point["height"]))
for point, style in ((at_rest, "-"), (leaning.points[0], "-"), (level, "--"), (symmetric.labelled("BP")[1], "-")):
    right.plot(t, point.system.evaluate(point.x, t)[:, 0], style, label=f"q = {point['q']:.1f}")
right.legend(loc="lower center", ncols=2)
right.set(xlabel="along the span", ylabel="height", ylim=(-4, 3.2))
plt.show()
