r"""# A flame: cells, and where they begin to oscillate

The equation of Kuramoto and Sivashinsky is a model of the front of a flame, and of a film that runs down a wall,

$$u_t = -4 u_{xxxx} - \alpha\, (u_{xx} + u\, u_x) , \qquad u(x) = -u(-x) = u(x + 2 \pi) .$$

Steady states with one, two and three cells replace each other as $\alpha$ grows. They are boundary value problems. The last of
the four equations contains the rate $u_t$: with `rates`, points are stable or not, and Hopf points are found. Only odd
perturbations are seen. There are two states of two cells, half a cell apart: what is odd about one is even about the other, so
the pattern is stable where both are.

**Check:** two cells take over at $\alpha = 16.1399$; the pattern is stable from 22.556 on, and begins to oscillate at 30.345
(Kevrekidis, Nicolaenko & Scovel, SIAM J. Appl. Math. 1990).
"""

import math

import matplotlib.pyplot as plt
import numpy as np

import contin

flame = contin.BoundaryValueProblem(
    lambda t, u, p: (u.a, u.b, u.c, -p.alpha / 4 * (u.b + u.u * u.a)),
    lambda first, last, p: (first.u, first.b, last.u, last.b),
    states=["u", "a", "b", "c"],
    parameters={"alpha": 1.0},
    domain=(0.0, math.pi),
    functionals={"energy": lambda t, u, p: u.u**2, "moment": lambda t, u, p: t * u.u},
    rates={"c": lambda t, u, w, p: -w.u / 4},
)
diagram = contin.diagram(contin.solve(flame, [0] * 4), free=["alpha"], limits={"alpha": (1, 45)})
points = [point for branch in diagram.branches for point in branch.points]
hopf = min((point for point in points if point.label == "HB"), key=lambda point: abs(point["alpha"] - 30))
print("Hopf point at alpha =", hopf["alpha"], "+-", hopf.errors["alpha"], "frequency", hopf.details["frequency"])
assert abs(hopf["alpha"] - 30.345) < 5e-4
for known in (16.1399, 22.556):
    assert any(point.label == "BP" and abs(point["alpha"] - known) < 1e-4 for point in points)

_, (left, right) = plt.subplots(1, 2, figsize=(9, 4.5), width_ratios=(3, 2), layout="constrained")
diagram.plot("alpha", "moment", axes=left)
left.set(xlabel="α", ylabel="∫x u over half of the period", ylim=(-11, 24))
left.legend(*left.get_legend_handles_labels(), loc="upper left", ncols=2, frameon=False)
t = np.linspace(0, math.pi, 300)
stable = [point for point in points if point["energy"] > 1 and not point.system.unstable(point.x)]
for place, alpha in enumerate((10, 28, 40)):
    near = min(stable, key=lambda point: abs(point["alpha"] - alpha))
    u = near.system.evaluate(near.x, t)[:, 0]
    right.plot([*-t[::-1], *t], [*-u[::-1] + 24 * place, *u + 24 * place], color="C0")
    right.annotate(f"α = {near['alpha']:.1f}", (math.pi, 24 * place + 2))
right.set(xlabel="x", yticks=[], xlim=(-3.2, 5.2), title="stable against odd perturbations")
plt.show()
