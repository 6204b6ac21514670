"""``python scripts/plot_branch.py FILE``: kappa* against kappa_n with folds and ends, and the strip along the branch."""

from __future__ import annotations

import argparse
import io
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

# Okabe-Ito colours: told apart by the colour-blind, and in print
CURVE, FOLD, END, SHAPE, BACK = "#0072B2", "#D55E00", "#000000", "#E8A33D", "#7A5195"
MARKS = {
    "LP": ("*", FOLD, 170, "fold"), "EP": ("o", END, 45, "end"), "BP": ("o", END, 45, "branch point"),
    "UZ": ("D", "#009E73", 40, "user value"),
}  # fmt: skip


def main(argv=None) -> int:
    """Draw; the exit code."""
    parser = argparse.ArgumentParser(description="Draw a branch file: the curve, and the strip along it.")
    parser.add_argument("file", help="an HDF5 file written by branches.run")
    parser.add_argument("--out", help="picture to write, .pdf, .svg or .png (default: beside the file, .pdf)")
    parser.add_argument("--shapes", type=int, default=6, help="number of strips drawn (default 6)")
    parser.add_argument("--width", type=float, default=0.3, help="width of the drawn strip, in units of L / 2 pi")
    options = parser.parse_args(argv)
    from branches.read import read_branch
    from branches.store import StoreError, prepare, write_bytes

    out = Path(options.out) if options.out else Path(options.file).with_suffix(".pdf")
    try:
        check(options, out)
        branch = read_branch(options.file)
        prepare(out)
        picture = io.BytesIO()
        draw(branch, options.shapes, options.width).savefig(picture, format=out.suffix[1:].lower(), dpi=160)
        write_bytes(out, picture.getvalue())
    except (StoreError, ValueError) as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    print(f"written to {out}")
    return 0


def check(options, out: Path) -> None:
    """Raise ValueError on an option that makes no picture."""
    if out.suffix.lower() not in (".pdf", ".svg", ".png"):
        raise ValueError(f"--out {str(out)!r}: must end in .pdf, .svg or .png")
    if out.exists() and not out.is_file():
        raise ValueError(f"--out {str(out)!r}: must be a file")
    if not 0 <= options.shapes <= 12:
        raise ValueError(f"--shapes {options.shapes}: must lie between 0 and 12")
    if not 0 < options.width <= 2:
        raise ValueError(f"--width {options.width:g}: must lie between 0 and 2")


def draw(branch, shapes: int = 6, width: float = 0.3):
    """The figure of a branch.

    Parameters
    ----------
    branch : branches.read.StoredBranch
    shapes : int
        Number of strips, at equal distances along the branch; labelled points are among them where they fit.
    width : float
        Width of the drawn strip, in units of L / 2 pi.
    """
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    chosen = choose(branch, shapes)
    columns = max(len(chosen), 1)
    figure = plt.figure(figsize=(9, 6.2 if chosen else 4.2), layout="constrained")
    grid = figure.add_gridspec(2 if chosen else 1, columns, height_ratios=[1, 2.2] if chosen else [1])
    for column, point in enumerate(chosen):
        axes = figure.add_subplot(grid[0, column], projection="3d")
        draw_strip(axes, branch.shape(point), width)
        axes.set_title(chr(ord("a") + column), fontsize=10, y=0.98)
    curve(figure.add_subplot(grid[-1, :]), branch, chosen)
    return figure


def choose(branch, count: int) -> list[int]:
    """Numbers of the points whose strip is drawn: nearest to equal distances along the branch, labelled ones preferred."""
    import numpy as np

    kept = branch.kept()
    if not count or not len(kept):
        return []
    s = branch.points["arclength"][kept]
    labelled = branch.points["label"][kept] != b""
    spacing = (s[-1] - s[0]) / max(count - 1, 1) or 1.0
    chosen = []
    for target in np.linspace(s[0], s[-1], count):
        distance = np.abs(s - target) - 0.45 * spacing * labelled
        best = int(kept[np.argmin(distance)])
        if best not in chosen:
            chosen.append(best)
    return sorted(chosen)


def curve(axes, branch, chosen) -> None:
    """kappa* against kappa_n, with marks at labelled points and letters at the strips drawn."""
    points, config = branch.points, branch.config
    axes.plot(*smooth(points), color=CURVE, lw=1.6, zorder=1)
    seen = set()
    for event in branch.events:
        marker, colour, size, name = MARKS.get(event["label"].decode(), ("x", END, 40, "lost"))
        label = None if name in seen or name == "branch point" else name
        seen.add(name)
        axes.scatter(event["kappa_n"], event["kappa_star"], marker=marker, color=colour, s=size, zorder=3, label=label)
        if event["label"] == b"LP":
            place = (event["kappa_n"], event["kappa_star"])
            axes.annotate(f"{event['kappa_n']:.4f}", place, (9, -3), textcoords="offset points", fontsize=9)
    for column, number in enumerate(chosen):
        point = points[number]
        if point["label"] == b"":
            axes.scatter(point["kappa_n"], point["kappa_star"], s=14, color=CURVE, zorder=2)
        letter, place = chr(ord("a") + column), (point["kappa_n"], point["kappa_star"])
        axes.annotate(letter, place, (-9, 7), textcoords="offset points", ha="right", fontsize=10)
    axes.set_xlabel(r"natural curvature $\kappa_n L/2\pi$")
    axes.set_ylabel(r"conjugate curvature $\bar\kappa^*$")
    axes.set_title(f"{config['law']}, (m, n) = ({config['m']}, {config['n']}), $\\nu$ = {config['nu']:g}", fontsize=11)
    axes.grid(alpha=0.25)
    axes.margins(0.1)
    axes.legend(frameon=False)


def smooth(points):
    """The curve between the computed points: a cubic spline over the arclength of the continuation."""
    import numpy as np
    from scipy.interpolate import CubicSpline

    s, keep = np.unique(points["arclength"], return_index=True)
    if len(s) < 4:
        return points["kappa_n"], points["kappa_star"]
    fine = np.interp(np.arange(0, len(s) - 0.9, 0.1), np.arange(len(s)), s)
    return (CubicSpline(s, points[name][keep])(fine) for name in ("kappa_n", "kappa_star"))


def draw_strip(axes, shape, width: float) -> None:
    """A closed strip as a lit surface, one colour a side, seen from above at an angle, at equal scale."""
    import numpy as np
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection

    step = max(1, len(shape.arclength) // 400)
    keep = np.unique(np.append(np.arange(0, len(shape.arclength), step), len(shape.arclength) - 1))
    surface = shape.surface(width)[keep] - shape.centreline.mean(axis=0)
    # the axis of the moment points up, and the strip is looked at from the same side at every point
    up = np.cross(shape.centreline - shape.centreline.mean(axis=0), shape.directors[:, 2]).sum(axis=0)
    up = up / np.linalg.norm(up) if np.linalg.norm(up) > 1e-9 else np.array([0.0, 0.0, 1.0])
    side = shape.directors[0, 2] - shape.directors[0, 2] @ up * up
    side /= np.linalg.norm(side)
    surface = surface @ np.array([np.cross(side, up), side, up]).T
    a, b = surface[:, 0], surface[:, -1]
    quads = np.stack([a[:-1], a[1:], b[1:], b[:-1]], axis=1)
    normals = np.cross(a[1:] - a[:-1], b[:-1] - a[:-1])
    normals /= np.linalg.norm(normals, axis=1)[:, None] + 1e-300
    light, eye = np.array([0.3, -0.4, 0.85]), np.array([0.55, -0.55, 0.63])
    light /= np.linalg.norm(light)
    from matplotlib.colors import to_rgb

    front = (normals @ eye > 0)[:, None]
    shade = (0.45 + 0.55 * np.abs(normals @ light))[:, None]
    colours = np.where(front, to_rgb(SHAPE), to_rgb(BACK)) * shade
    axes.add_collection3d(Poly3DCollection(quads, facecolors=colours, edgecolors=colours, linewidths=0.2))
    reach = 0.8  # the same for all: the m-covered circle has radius 1 / m
    axes.set(xlim=(-reach, reach), ylim=(-reach, reach), zlim=(-reach, reach))
    axes.set_box_aspect((1, 1, 1), zoom=1.25)
    axes.view_init(elev=32, azim=-45)
    axes.set_axis_off()


if __name__ == "__main__":
    sys.exit(main())
