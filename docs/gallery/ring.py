r"""# A twisted ring: when a rod leaves the plane

A straight rod is bent to a ring, and one end is turned before it is joined to the other one. The ring stays flat up to a
certain twist, and then jumps out of its plane: the states that begin there exist at smaller twists, and are unstable. It is
a *scene* of [open strips](../open-strips.md) whose ends are joined.

At the critical twist two modes become unstable at once, since the buckle can sit anywhere along the ring. The `phases` hold
it in its place; the index does not count the mode that is held.

**Check:** the twist is $2\pi\sqrt3\, B/C$ (Michell 1889; Zajac 1962); here $C = 0.8\, B$.
"""

import math
from pathlib import Path

import matplotlib.pyplot as plt

from branches.read import read_branch
from branches.run.__main__ import main as compute

Path("ring.yaml").write_text("""
title: twisted ring
material: {law: rod, B1: 1, B2: 1, C: 0.8}
closed: {half_twists: 0}
numbers: {turn: 8}
begin: circle
phases: [spin, "shift, two waves"]
stages:
  - {follow: turn, to: 15}
  - {follow: turn, to: 8, start_at: BP 1}
""")
compute(["ring.yaml", "--out", "ring.h5", "--quiet"])
branch = read_branch("ring.h5")
buckling = branch.events[branch.events["label"] == b"BP"][0]
print(f"critical twist {buckling['turn']:.9f}")
assert abs(buckling["turn"] - 2 * math.pi * math.sqrt(3) / 0.8) < 1e-8

figure = plt.figure(figsize=(9, 4))
left = figure.add_axes((0.09, 0.14, 0.44, 0.8))
for piece, (turn, energy) in branch.curves("turn", "energy"):
    label = {(1, True): "stable", (2, False): "unstable"}.get((piece.stage, piece.stable))
    left.plot(turn, energy, "-" if piece.stable else "--", color="C0", label=label)
left.plot(buckling["turn"], buckling["energy"], "ko", label="branch point")
left.legend()
left.set(xlabel="turn before closing / rad", ylabel="energy L/B")
flat, bent = (branch.points[branch.points["stage"] == stage] for stage in (1, 2))
for place, row in enumerate((flat[0], *bent[[len(bent) // 4, len(bent) // 2, -1]])):
    axes = figure.add_axes((0.56 + 0.22 * (place % 2), 0.47 - 0.47 * (place // 2), 0.21, 0.44), projection="3d")
    axes.plot(*branch.shape(int(row["point"])).centreline.T, color="C1" if row["index"] else "C0", lw=4)
    axes.set_title(f"turn = {row['turn']:.1f}")
    axes.axis("equal")
    axes.set_axis_off()
    axes.set_box_aspect(None, zoom=1.3)
plt.show()
