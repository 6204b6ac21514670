"""Draws the diagrams of docs/variational.md into docs/images/variational.png: solid lines are stable, dashed ones are not.

python scripts/plot_variational.py [OUT.png]
"""

from __future__ import annotations

import itertools
import math
import sys
from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

import contin
from contin.lowlevel import Colour

OUT = Path(__file__).resolve().parent.parent / "docs" / "images" / "variational.png"
COLOURS = {0: Colour.BLUE, 1: Colour.ORANGE, 2: Colour.PURPLE, 3: Colour.GREY}


def draw(axes: Any, branch: contin.Branch, x: str, y: str, unit: float = 1.0) -> None:
    """Draw a branch in pieces of equal index."""
    points = list(branch)
    ends = [0, *(i for i, point in enumerate(points) if point.label in ("BP", "LP") and i), len(points) - 1]
    for first, last in itertools.pairwise(ends):
        piece = points[first : last + 1]
        index = min(piece[len(piece) // 2].index or 0, 3)
        style = "-" if index == 0 else (0, (3, 2))
        across, up = contin.Branch(piece).curve(x, y)
        axes.plot(across, up / unit, ls=style, color=COLOURS[index], lw=1.8)
    for point in points:
        if point.label in ("BP", "LP"):
            axes.plot(point[x], point[y] / unit, "o", ms=5, color="black", zorder=3)


def elastica(axes: Any) -> None:
    """Draw the clamped strip: load against the distance of the ends."""
    strip = contin.VariationalProblem(
        energy=lambda t, x, w, p: w.angle**2 / 2 + p.load * math.cos(x.angle),
        states=["angle"],
        parameters={"load": 30.0},
        ends=lambda a, b, p: (a.angle, b.angle),
        integrals={"offset": lambda t, x, w, p: math.sin(x.angle)},
        functionals={"chord": lambda t, x, w, p: math.cos(x.angle)},
    )
    settings = contin.Settings(limits={"load": (20, 170), "chord": (0.0, 1.5)}, errors=False)
    straight = contin.trace(contin.solve(strip, [0.0], {"load": 20.0}), settings, free=["load"])
    draw(axes, straight, "chord", "load", math.pi**2)
    for point in straight.labelled("BP"):
        draw(axes, contin.trace(point, settings, branch=1), "chord", "load", math.pi**2)
    axes.set(xlabel="distance of the ends", ylabel="load / π²", title="Elastica, clamped", xlim=(1.03, -0.05))


def catenoid(axes: Any) -> None:
    """Draw the soap film: area against the gap of the rings."""
    film = contin.VariationalProblem(
        energy=lambda t, x, w, p: x.r * math.sqrt(p.gap**2 + w.r**2),
        states=["r"],
        parameters={"gap": 0.4},
        ends=lambda a, b, p: (a.r - 1, b.r - 1),
    )
    settings = contin.Settings(limits={"gap": (0.4, 1.5)}, errors=False)
    draw(axes, contin.trace(contin.solve(film, [1.0]), settings, free=["gap"]), "gap", "energy")
    axes.set(xlabel="gap of the rings / radius", ylabel="area / 2π", title="Soap film between two rings")


def main() -> None:
    """Draw both."""
    figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.8), layout="constrained")
    elastica(left)
    catenoid(right)
    for index, name in ((0, "index 0: stable"), (1, "index 1"), (2, "index 2"), (3, "index 3 or more")):
        left.plot([], [], ls="-" if index == 0 else (0, (3, 2)), color=COLOURS[index], lw=1.8, label=name)
    left.plot([], [], "o", ms=5, color="black", label="fold or branch point")
    left.legend(frameon=False, fontsize=8, loc="upper right")
    for axes in (left, right):
        axes.spines[["top", "right"]].set_visible(False)
    figure.savefig(sys.argv[1] if len(sys.argv) > 1 else OUT, dpi=150)


if __name__ == "__main__":
    main()
