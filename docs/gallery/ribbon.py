r"""# A closed ribbon: from one loop to three

A strip of paper or steel with the natural curvature $\kappa_n$ is closed to a ring. Its branch has a fold, and ends
on the circle of three turns: this is the frame of a car's sunshade as it folds. The ribbon of Audoly & Seffen (2015) has
the energy

$$U = \tfrac12 \left(\omega_1 + \frac{\omega_3^2}{\omega_1}\right)^2
- \kappa_n \left(\omega_1 + \nu\,\frac{\omega_3^2}{\omega_1}\right)$$

with the curvature $\omega_1$ and the twist $\omega_3$. Half a loop lies between two mirrors. The frame is a unit
quaternion.

**Check:** the circle buckles at $\kappa_n = 2.5$, the fold lies at 4.0757 (the paper: 4.08), and the branch ends at $-0.5$.
"""

import math

import matplotlib.pyplot as plt
import numpy as np

import contin


def half_loop(t, x, w, p):
    k1, k3 = w.k1, w.k3
    turning = -x.q1 * k1 - x.q3 * k3, x.q0 * k1 + x.q2 * k3, x.q3 * k1 - x.q1 * k3, x.q0 * k3 - x.q2 * k1
    tangent = 2 * (x.q1 * x.q3 + x.q0 * x.q2), 2 * (x.q2 * x.q3 - x.q0 * x.q1), x.q0**2 - x.q1**2 - x.q2**2 + x.q3**2
    return (*[rate / 2 for rate in turning], *tangent)


def mirrors(a, b, p):  # the tangent is normal to the same plane at both ends
    tangent = 2 * (b.q1 * b.q3 + b.q0 * b.q2), 2 * (b.q2 * b.q3 - b.q0 * b.q1)
    return (a.q0 - 1, a.q1, a.q2, a.q3, a.x1, a.x2, a.x3, *tangent, b.x3)


ribbon = contin.VariationalProblem(
    energy=lambda t, x, w, p: (w.k1 + w.k3**2 / w.k1) ** 2 / 2 - p.kappa_n * (w.k1 + p.nu * w.k3**2 / w.k1),
    states=["q0", "q1", "q2", "q3", "x1", "x2", "x3"],
    parameters={"kappa_n": 2.3, "nu": 0.3},
    kinematics=half_loop,
    controls=["k1", "k3"],
    ends=mirrors,
    starts={"k1": 1.0},
    functionals={"conjugate": lambda t, x, w, p: (w.k1 + p.nu * w.k3**2 / w.k1) / math.pi},
    domain=(0, math.pi),
)
circle = contin.solve(ribbon, lambda t: (math.cos(t / 2), math.sin(t / 2), 0, 0, 0, math.cos(t) - 1, math.sin(t)))
circles = contin.trace(circle, free=["kappa_n"], limits={"kappa_n": (1, 2.8)})
(buckling,) = circles.labelled("BP")
folded = contin.trace(buckling, branch=1, limits={"kappa_n": (-0.49, 5)})
(fold,) = folded.labelled("LP")
print(f"buckling at {buckling['kappa_n']:.10f}, fold at {fold['kappa_n']:.10f}, index there {fold.index_change}")
assert abs(buckling["kappa_n"] - 2.5) < 1e-9 and abs(fold["kappa_n"] - 4.07566753526546) < 1e-9

figure = plt.figure(figsize=(9, 4))
left = figure.add_axes((0.09, 0.14, 0.44, 0.8))
for branch in (circles, folded):
    branch.plot("kappa_n", "conjugate", axes=left)
left.set(xlabel="natural curvature κₙL/2π", ylabel="conjugate curvature κ*")
t = np.linspace(0, math.pi, 120)
for place, point in enumerate((buckling, fold, folded.points[-len(folded) // 4], folded.points[-1])):
    axes = figure.add_axes((0.56 + 0.22 * (place % 2), 0.47 - 0.47 * (place // 2), 0.21, 0.44), projection="3d")
    q0, q1, q2, q3, *x = point.system.evaluate(point.x, t)[:, :7].T
    across = np.array([q0**2 + q1**2 - q2**2 - q3**2, 2 * (q1 * q2 + q0 * q3), 2 * (q1 * q3 - q0 * q2)])
    colour = "C1" if point.index else "C0"
    for side in (1, -1):  # the other half is the mirror image
        half = [np.array([x[i] - 0.1 * across[i], x[i] + 0.1 * across[i]]) for i in range(3)]
        axes.plot_surface(half[0], half[1], side * half[2], color=colour, lw=0, rcount=2, ccount=120)
    axes.set_title(f"κₙ = {point['kappa_n']:.2f}")
    axes.axis("equal")
    axes.set_axis_off()
    axes.set_box_aspect(None, zoom=1.3)
plt.show()
