r"""# Bratu's problem: a fluid that heats itself

Heat is set free at a rate that grows exponentially with the temperature, and leaves through two walls:

$$u'' + \lambda e^u = 0, \qquad u(0) = u(1) = 0 .$$

Up to a critical rate there are two states, a cool one and a hot one. Beyond it the fluid explodes. `trace` follows the cool
state through the fold to the hot one. The problem is the derivative of an energy, so the index of every state is known too:
the cool one is a minimum.

**Check:** the fold lies at $\lambda = 8 z^2 / \cosh^2 z = 3.513830719125161$ with $z \tanh z = 1$ (Liouville 1853; Bratu
1914).
"""

import math

import matplotlib.pyplot as plt
import numpy as np

import contin

fluid = contin.VariationalProblem(
    energy=lambda t, x, w, p: w.u**2 / 2 - p.lam * math.exp(x.u),
    states=["u"],
    parameters={"lam": 0.0},
    ends=lambda a, b, p: (a.u, b.u),
    functionals={"mean": lambda t, x, w, p: x.u},
)
cool = contin.solve(fluid, [0.0])
branch = contin.trace(cool, free=["lam"], limits={"lam": (0, 4), "mean": (-1, 4)}, max_step=0.3)
(fold,) = branch.labelled("LP")
print(f"fold at lambda = {fold['lam']:.12f}, index {fold.index_change[0]} before it, {fold.index_change[1]} after it")
assert abs(fold["lam"] - 3.513830719125161) < 1e-10

_, (left, right) = plt.subplots(1, 2, figsize=(9, 4), layout="constrained")
branch.plot("lam", "mean", axes=left)
left.set(xlabel="rate λ", ylabel="mean temperature")
t = np.linspace(0, 1, 200)
for point in branch.points[::3]:
    right.plot(t, point.system.evaluate(point.x, t)[:, 0], color="C0" if point.index == 0 else "C1", lw=1)
right.set(xlabel="place between the walls", ylabel="temperature")
plt.show()
