r"""# The catenoid: a soap film between two rings

A soap film between two rings of radius 1 takes the shape of least area. Let the distance of the rings be the gap $g$; the
area is

$$A = 2\pi \int_0^1 r \sqrt{g^2 + r'^2}\, dt .$$

The energy is all that the program is told. It derives the equations, and from the second variation the index: the wide neck
is a minimum, the narrow one is not. Pulled beyond the fold, the film breaks.

**Check:** the largest half distance is $1/\sinh a = 0.6627434193$ radii, with $a \tanh a = 1$ (Goldschmidt 1831).
"""

import math

import matplotlib.pyplot as plt
import numpy as np

import contin

film = contin.VariationalProblem(
    energy=lambda t, x, w, p: x.r * math.sqrt(p.gap**2 + w.r**2),
    states=["r"],
    parameters={"gap": 0.4},
    ends=lambda a, b, p: (a.r - 1, b.r - 1),
)
branch = contin.trace(contin.solve(film, [1.0]), free=["gap"], limits={"gap": (0.4, 1.5)}, max_step=0.05)
(fold,) = branch.labelled("LP")
print(f"largest half distance {fold['gap'] / 2:.10f}, index {fold.index_change[0]} before it, {fold.index_change[1]} after it")
assert abs(fold["gap"] / 2 - 0.6627434193) < 1e-10

_, (left, right) = plt.subplots(1, 2, figsize=(9, 4), layout="constrained")
branch.plot("gap", "energy", axes=left)
left.set(xlabel="gap of the rings / radius", ylabel="area / 2π")
t = np.linspace(0, 1, 200)
for point, colour, name in ((branch.points[0], "C0", "stable"), (fold, "black", "fold"), (branch.points[-1], "C1", "unstable")):
    r = point.system.evaluate(point.x, t)[:, 0]
    z = (t - 0.5) * point["gap"]
    right.plot(z, r, color=colour, ls="--" if name == "unstable" else "-", label=name)
    right.plot(z, -r, color=colour, ls="--" if name == "unstable" else "-")
    right.plot([z[0]] * 2, [-1, 1], [z[-1]] * 2, [-1, 1], color="grey", lw=3)  # the rings
right.legend(loc="upper left", bbox_to_anchor=(1, 1))
right.set(xlabel="along the axis", ylabel="radius", aspect="equal")
plt.show()
