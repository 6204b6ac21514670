"""``python scripts/plot_diagram.py DIR``: the bifurcation diagram (Fig. 12a), in (kappa_n, kappa*) and disentangled."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

STABLE, UNSTABLE, FOLD, DOT = "#000000", "#9a9a9a", "#D55E00", "#000000"
#: Okabe-Ito colours and a line style for each wavenumber: told apart without colour too.
STYLES = {
    1: ("#CC79A7", (0, (1, 1))), 2: ("#0072B2", "-"), 3: ("#009E73", "-"), 4: ("#D55E00", (0, (6, 1.5))),
    5: ("#56B4E9", (0, (6, 1.5))), 6: ("#E69F00", (0, (4, 1, 1, 1))), 7: ("#882255", (0, (4, 1, 1, 1))),
}  # fmt: skip


def main(argv=None) -> int:
    """Draw; the exit code."""
    parser = argparse.ArgumentParser(description="Draw the diagram of a diagram scene.")
    parser.add_argument("folder", help="folder written by branches.run for a scene with several branches")
    parser.add_argument("--out", help="picture to write, .pdf, .svg or .png (default: diagram.pdf in the folder)")
    parser.add_argument("--window", nargs=2, type=float, default=(-8.0, 14.0), metavar=("LOW", "HIGH"), help="of kappa_n")
    parser.add_argument("--law", help="which law, where the diagram has several")
    parser.add_argument("--nu", type=float, help="which nu, where the diagram has several")
    options = parser.parse_args(argv)
    from branches.graph import read
    from branches.store import StoreError

    try:
        if not options.window[0] < options.window[1]:
            raise StoreError(f"--window {options.window[0]:g} {options.window[1]:g}: the first number must be the smaller")
        graph = read(options.folder)
        law, nu = choose(graph, options.law, options.nu)
        folder = Path(options.folder)
        out = Path(options.out) if options.out else (folder if folder.is_dir() else folder.parent) / "diagram.pdf"
        draw(graph, law, nu, options.window).savefig(out, dpi=150)
    except (StoreError, OSError, ValueError) as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    print(f"written to {out}")
    return 0


def choose(graph, law, nu):
    """The law and nu to draw: those asked for, or the first that the diagram has."""
    from branches.graph import families
    from branches.store import StoreError

    have = sorted({family[:2] for family in families(graph)}, key=lambda pair: (pair[0] != "ribbon", pair))
    found = [pair for pair in have if law in (None, pair[0]) and nu in (None, pair[1])]
    if not found:
        known = ", ".join(f"{name} nu = {value:g}" for name, value in have)
        raise StoreError(f"--law {law} --nu {nu}: the diagram has {known}")
    return found[0]


def draw(graph, law: str, nu: float, window=(-8.0, 14.0)):
    """The figure: left (kappa_n, kappa*), right the same branches disentangled."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    from matplotlib.lines import Line2D

    figure, panels = plt.subplots(1, 2, figsize=(13, 7), layout="constrained", sharex=True)
    edges = [data for _, _, data in graph.edges(data=True) if (data["law"], data["nu"]) == (law, nu)]
    nodes = [data for _, data in graph.nodes(data=True) if (data["law"], data["nu"]) == (law, nu)]
    for axes, height in zip(panels, (conjugate(edges), disentangled(edges, nodes))):
        planar(axes, nodes, law, nu, window)
        for data in edges:
            colour, dashes = STYLES.get(data["n"], ("#444444", ":"))
            axes.plot(
                *smooth(data["arclength"], data["kappa_n"], height(data)), color=colour, linestyle=dashes, lw=1.3, zorder=2
            )
        for node in nodes:
            mark(axes, node, height)
        axes.set(xlim=window, xlabel=r"natural curvature $\kappa_n L/2\pi$")
        axes.grid(alpha=0.2)
    bottom = min((node["kappa_star"] for node in nodes if node["kind"] == "circle"), default=1)
    top = max((node["kappa_star"] for node in nodes if node["kind"] == "circle"), default=1)
    panels[0].set(
        ylim=(bottom - 0.5, top + 0.7), ylabel=r"conjugate curvature $\bar\kappa^*$", title="in conjugate coordinates"
    )
    panels[1].set(
        ylim=(bottom - 0.7, top + 0.9),
        ylabel="covering index of the circles (branches between: schematic)",
        title="disentangled",
    )
    panels[1].set_yticks(sorted({node["covering"] for node in nodes if node["kind"] == "circle"}))
    waves = sorted({data["n"] for data in edges})
    legend = [
        Line2D([], [], color=STYLES.get(n, ("#444444", ":"))[0], ls=STYLES.get(n, ("", ":"))[1], label=f"n = {n}")
        for n in waves
    ]
    legend += [
        Line2D([], [], color=STABLE, lw=2.5, label="circle, stable"),
        Line2D([], [], color=UNSTABLE, lw=1, label="circle, unstable"),
        Line2D([], [], marker="*", color=FOLD, ls="", ms=11, label="fold"),
        Line2D([], [], marker="o", color=DOT, ls="", ms=5, label="bifurcation of a circle"),
    ]
    figure.legend(handles=legend, loc="outside lower center", ncols=6, frameon=False)
    figure.suptitle(f"Equilibria of a closed strip: {law}, $\\nu$ = {nu:g}", fontsize=13)
    return figure


def smooth(s, x, y):
    """A smooth curve through computed points: a cubic spline over the arclength of the continuation."""
    import numpy as np
    from scipy.interpolate import CubicSpline

    s, keep = np.unique(s, return_index=True)
    x, y = np.asarray(x)[keep], np.asarray(y)[keep]
    if len(s) < 4:
        return x, y
    fine = np.interp(np.arange(0, len(s) - 0.9, 0.1), np.arange(len(s)), s)
    return CubicSpline(s, x)(fine), CubicSpline(s, y)(fine)


def conjugate(edges):
    """Heights for the left panel: kappa* itself."""
    return lambda data: data["kappa_star"]


def disentangled(edges, nodes):
    """Heights for the right panel: along every branch from circle to circle, ordered by wavenumber in between.

    The projection on the horizontal axis is untouched. A branch rises monotonically from one circle to the other (or fades
    away from its only one), each wavenumber on a path of its own, so that branches cross as little as they can.
    """
    import numpy as np

    total = {}
    for data in edges:
        key = (data["m"], data["n"])
        first, last = total.get(key, (np.inf, -np.inf))
        total[key] = min(first, data["arclength"][0]), max(last, data["arclength"][-1])
    ends = {}
    for data in edges:
        key = (data["m"], data["n"])
        start, end = data["kappa_star"][0], data["kappa_star"][-1]
        low, high = ends.get(key, (start, end))
        ends[key] = (
            start if data["arclength"][0] == total[key][0] else low,
            end if data["arclength"][-1] == total[key][1] else high,
        )

    def height(data):
        key = (data["m"], data["n"])
        if "arclength" not in data:  # a node
            return data["kappa_star"]
        first, last = total[key]
        sigma = (np.asarray(data["arclength"]) - first) / (last - first)
        start, end = ends[key]
        reaches = abs(end - round(end)) < 1e-6 and round(end) != data["m"]
        goal = round(end) if reaches else start + 0.7 * np.sign(end - start)  # one that leaves fades away from its circle
        bend = 0.22 * (data["n"] - data["m"]) / max(data["n"], data["m"])
        return start + (goal - start) * sigma**1.5 + bend * np.sin(np.pi * sigma) * (1 if reaches else 0)

    by_place = {}
    for data in edges:
        values = height(data)
        for at in (0, -1):
            by_place[round(data["kappa_n"][at], 9), round(data["kappa_star"][at], 6)] = float(values[at])

    def of_node_or_edge(data):
        if "arclength" in data:
            return height(data)
        return by_place.get((round(data["kappa_n"], 9), round(data["kappa_star"], 6)), data["kappa_star"])

    return of_node_or_edge


def planar(axes, nodes, law, nu, window):
    """The circles: thick where the published linear theory has them stable, thin elsewhere."""
    from ribbon_model.laws import LAWS
    from ribbon_model.linear import stability_interval

    for m in sorted({node["covering"] for node in nodes if node["kind"] == "circle"}):
        axes.plot(window, [m, m], color=UNSTABLE, lw=0.8, zorder=1)
        if m < 1:  # curled against its natural curvature: the published intervals do not speak of these
            continue
        low, high = stability_interval(LAWS[law], m, nu)
        axes.plot(
            [max(window[0], m * low), min(window[1], m * high)], [m, m], color=STABLE, lw=2.6, zorder=1, solid_capstyle="butt"
        )


def mark(axes, node, height):
    """A star at a fold, a dot at a bifurcation of a circle, a diamond at a branch point."""
    marker, colour, size = {"fold": ("*", FOLD, 90), "circle": ("o", DOT, 16), "branch point": ("D", "#CC79A7", 30)}.get(
        node["kind"], (None, None, 0)
    )
    if marker:
        axes.scatter(node["kappa_n"], height(node), marker=marker, color=colour, s=size, zorder=3, clip_on=True, linewidths=0)


if __name__ == "__main__":
    sys.exit(main())
