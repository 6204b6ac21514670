r"""# A snake: patterns of any length

The equation of Swift and Hohenberg (1977) with a quadratic and a cubic term is a model of patterns,

$$u_t = r u - (1 + \partial_x^2)^2 u + b\, u^2 - u^3 , \qquad b = 1.8 .$$

For some $r < 0$ both the flat state and waves are stable, and so are patches of waves of any length. Their branch winds up
in a snake: on the way from one fold to the next but one the patch grows by a wave at each end. It is the derivative of an
energy, so the index says which patches are stable. Half of a symmetric patch is computed; perturbations that break the
symmetry are not seen.

**Check:** the folds settle at $r = -0.3390$ and $-0.2593$ (Burke & Knobloch, Chaos 2007).
"""

import math

import matplotlib.pyplot as plt
import numpy as np

import contin

pattern = contin.VariationalProblem(
    energy=lambda t, x, w, p: ((x.u + w.k) ** 2 - p.r * x.u**2) / 2 - 0.6 * x.u**3 + x.u**4 / 4,
    states=["u", "slope"],
    parameters={"r": -0.06},
    kinematics=lambda t, x, w, p: (x.slope, w.k),
    controls=["k"],
    ends=lambda a, b, p: (a.slope, b.slope),
    functionals={"square": lambda t, x, w, p: x.u**2},
    domain=(0, 12 * math.pi),
)
size, width = 2 * math.sqrt(0.06 / 10.68), 2 / math.sqrt(0.06)  # of small patches, by the theory of weak nonlinearity


def small(t):
    height = size / math.cosh(t / width)
    return height * math.cos(t), -height * (math.sin(t) + math.cos(t) * math.tanh(t / width) / width)


patch = contin.solve(pattern, small, intervals=40, degree=5)
branch = contin.trace(
    patch, free=["r"], direction=-1, limits={"r": (-0.5, 0), "square": (0, 14)}, mesh=contin.MeshControl(tolerance=1e-6)
)
folds = [point["r"] for point in branch.labelled("LP")]
print("folds at r =", [round(r, 4) for r in folds])
assert abs(folds[4] + 0.3390) < 1e-4 and abs(folds[3] + 0.2593) < 1e-4

_, (left, right) = plt.subplots(1, 2, figsize=(9, 4), layout="constrained")
branch.plot("r", "square", axes=left)
left.set(xlabel="r", ylabel="∫u² over half of the patch")
t = np.linspace(0, 12 * math.pi, 600)
for place, point in enumerate(branch.labelled("LP")[1::2]):
    u = point.system.evaluate(point.x, t)[:, 0]
    right.plot([*-t[::-1], *t], [*u[::-1] + 3 * place, *u + 3 * place], color="C0")
right.set(xlabel="x", yticks=[], title="patches at the folds on the right")
plt.show()
