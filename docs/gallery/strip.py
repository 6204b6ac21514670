r"""# A strip on edge: lateral buckling

A ruler is clamped at one end, on edge, and carries a load at its tip. It cannot bend in its plane, so at first nothing is
seen. At a critical load it twists and bends away sideways. Open strips are stated as a *scene*: what the strip is made of,
how its ends are held, and which numbers are followed ([open strips](../open-strips.md)).

Scenes also take clamps, hinges, rollers, weight, half twists, and dimensions in metres.

**Check:** the load is $4.0126 \sqrt{B C}/L^2$ (Michell 1899; Prandtl 1899). The factor is the first zero of
$J_{-1/4}(z/2)$; a flat rod has $C = 2B/(1 + \nu)$.
"""

import math
from pathlib import Path

import matplotlib.pyplot as plt

from branches.read import read_branch
from branches.run.__main__ import main as compute

Path("strip.yaml").write_text("""
title: strip on edge with a load at its tip
material: {law: flat rod, nu: 0.3}
finish: free
stages:
  - {follow: force_width, to: -8}
  - {follow: force_width, to: -14, start_at: BP 1}
""")
compute(["strip.yaml", "--out", "strip.h5", "--quiet"])
branch = read_branch("strip.h5")
buckling = branch.events[branch.events["label"] == b"BP"][0]
print(f"critical load {-buckling['force_width']:.9f}, index {buckling['index_before']} -> {buckling['index_after']}")
assert abs(-buckling["force_width"] - 4.0125993 * math.sqrt(2 / 1.3)) < 1e-6

figure = plt.figure(figsize=(9, 4))
left, right = figure.add_axes((0.09, 0.14, 0.44, 0.8)), figure.add_axes((0.55, 0, 0.45, 1), projection="3d")
for piece, (force, rise) in branch.curves("force_width", "rise"):
    label = {(1, False): "unstable", (2, True): "stable"}.get((piece.stage, piece.stable))
    left.plot(-force, abs(rise), "-" if piece.stable else "--", color="C0", label=label)
left.plot(-buckling["force_width"], 0, "ko")
left.annotate("branch point", (-buckling["force_width"], 0), xytext=(-10, 12), textcoords="offset points", ha="right")
left.legend()
left.set(xlabel="load P L²/B", ylabel="sideways displacement of the tip / L")
bent = branch.points[branch.points["stage"] == 2]
for number in (0, *bent["point"][[1, len(bent) // 2, -1]]):
    width, normal, along = branch.shape(int(number)).surface(0.1).T
    right.plot_surface(along, normal, width, color="C1", alpha=0.7, lw=0)
right.axis("equal")
right.set_axis_off()
right.set_box_aspect(None, zoom=1.3)
plt.show()
