r"""# Carrier's equation: many solutions by deflation

A small parameter before the second derivative gives a boundary value problem many solutions, with more and more inner
layers:

$$\varepsilon^2 u'' + 2 (1 - t^2)\, u + u^2 = 1, \qquad u(\pm 1) = 0 .$$

`solve` with `others` finds a solution that differs from all known ones (deflation). Each guess is tried until nothing new
comes.

**Check:** at $\varepsilon = 0.2$ there are 8 solutions. Shooting from $t = -1$ with 3000 slopes, by SciPy, finds as many: a
test of this project counts them.
"""

import matplotlib.pyplot as plt
import numpy as np

import contin

carrier = contin.BoundaryValueProblem(
    rhs=lambda t, u, p: (u.v, (1 - u.u**2 - 2 * (1 - t**2) * u.u) / p.eps**2),
    boundary=lambda a, b, p: (a.u, b.u),
    states=["u", "v"],
    parameters={"eps": 0.2},
    domain=(-1, 1),
)
found = []
t = np.linspace(-1, 1, 301)
for k in np.pi / 2 * np.array([1, -1, 2, -2, 3, -3]):  # one to three half waves, of either sign
    guess = t, np.column_stack([np.sin(k * (t + 1)), k * np.cos(k * (t + 1))])
    while True:
        try:
            found.append(contin.solve(carrier, guess, others=found, intervals=40))
        except contin.ConvergenceError:
            break  # nothing new from here
print(len(found), "solutions")
assert len(found) == 8

figure, all_axes = plt.subplots(2, 4, sharex=True, sharey=True, figsize=(9, 4), layout="constrained")
profiles = sorted((point.system.evaluate(point.x, t)[:, 0] for point in found), key=lambda u: u.mean())
for axes, u in zip(all_axes.flat, profiles):
    mirrored = np.allclose(u, u[::-1], atol=1e-6)
    axes.plot(t, u, color="C0" if mirrored else "C1")
    axes.axhline(0, color="grey", lw=0.5)
figure.suptitle("eight solutions: symmetric (blue), or not (orange)")
plt.show()
