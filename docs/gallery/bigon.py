r"""# A bigon folds

Two strips are joined at both ends, at an angle. The bigon is flat at first. Its strips are curved by nature in the plane: with
more of that the flat state costs more and more, and at a critical natural curvature the bigon leaves the plane and folds.
Several strips are stated as a *network*: strips as they are drawn, and joints ([networks](../networks.md)).

Scenes also take hinges and ball joints, loads at joints and along strips, pressure, weight, and what is held.

**Check:** the flat bigon of opening $2\alpha$ has the energy $(2\alpha - \kappa_n)^2$: both strips are arcs of length 1.
With $C = 0.75$ and $2\alpha = 60°$ it buckles at $\kappa_n = 3.682897251$. There the determinant of a shooting code changes
its sign (`tests/ribbon_model/test_network_independent.py`).
"""

import math
from pathlib import Path

import matplotlib.pyplot as plt

from branches.read import read_branch
from branches.run.__main__ import main as compute

Path("bigon.yaml").write_text("""
title: bigon
material: {law: rod, B1: 1.0, B2: 1.0, C: 0.75, kappa_n: 0.0}
strips:
  upper: {begin: [0, 0, 0], along: [0, 0.5, 0.8660254037844386], normal: [0, 1, 0], length: 1.0, bend: 1.0471975511965976}
  lower: {begin: [0, 0, 0], along: [0, -0.5, 0.8660254037844386], normal: [0, -1, 0], length: 1.0, bend: 1.0471975511965976}
joints:
  A: [upper start, lower start]
  B: [upper finish, lower finish]
stages:
  - {follow: kappa_n, to: 5.0}
  - {follow: kappa_n, to: 8.0, start_at: BP 1}
""")
compute(["bigon.yaml", "--out", "bigon.h5", "--quiet"])
branch = read_branch("bigon.h5")
buckling = branch.events[branch.events["label"] == b"BP"][0]
print(f"it folds at kappa_n = {buckling['kappa_n']:.9f}, index {buckling['index_before']} -> {buckling['index_after']}")
assert abs(buckling["kappa_n"] - 3.682897251) < 1e-9
flat = branch.points[branch.points["stage"] == 1]
assert abs(flat["energy"] - (math.pi / 3 - flat["kappa_n"]) ** 2).max() < 1e-9

figure = plt.figure(figsize=(9, 4))
left, right = figure.add_axes((0.09, 0.14, 0.44, 0.8)), figure.add_axes((0.55, 0, 0.45, 1), projection="3d")
for piece, (curvature, energy) in branch.curves("kappa_n", "energy"):
    left.plot(curvature, energy, "-" if piece.stable else "--", color=f"C{piece.stage - 1}")
left.plot(buckling["kappa_n"], buckling["energy"], "ko")
left.annotate(
    "branch point", (buckling["kappa_n"], buckling["energy"]), xytext=(-10, 6), textcoords="offset points", ha="right"
)
left.set(xlabel="natural curvature", ylabel="energy")
folded = branch.points[branch.points["stage"] == 2]
for shift, number in enumerate((0, *folded["point"][[len(folded) // 4, len(folded) // 2]])):
    for part in branch.shape(int(number)).parts:
        across, up, along = part.surface(0.1).T
        right.plot_surface(along + 0.9 * shift, across, up, color="C1", alpha=0.8, lw=0)
right.axis("equal")
right.set_axis_off()
right.set_box_aspect(None, zoom=1.4)
plt.show()
