"""Draws the rooms of contin and the imports between them, into docs/images/rooms.svg.

    python scripts/draw_rooms.py [OUT.svg]

The order of the rooms comes from the contract in pyproject.toml. The arrows come from all import statements, those inside
functions and those for types included. An import that goes upwards is an error (exit code 1).
"""

from __future__ import annotations

import ast
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parent.parent
OUT = ROOT / "docs" / "images" / "rooms.svg"
#: The modules beside the rooms: drawn as one box.
FOUNDATION = "errors · arrays · checks · files"
PURPOSE = {
    "search": "first solutions, runs from points, curves, diagrams",
    "continuation": "the loop: predict, correct, watch, locate, accept",
    "results": "points, branches, files, tables, plots",
    "connections": "homoclinic and heteroclinic orbits",
    "cycles": "cycles of vector fields and maps: multipliers, doublings, tori",
    "equilibria": "F(u, p) = 0: Hopf points, dependent equations",
    "boundary": "boundary value problems; energies and their index",
    "defining": "defining systems of special points in two parameters",
    "events": "folds, branch points, test functions, error estimates",
    "core": "the protocol of all systems; Newton's method, one step, settings",
    "collocation": "nodes, mesh, assembly, error of a solution: arrays and kernels",
    "problems": "what all statements share",
    "linalg": "factorization by condensation, dense LU, singular vectors",
    "functions": "users' functions recorded: exact derivatives, interpreter",
    "kernels": "Python functions as machine code",
    FOUNDATION: "what every room uses (arrows left out)",
}
#: Packages that are named in the box of a room that imports them.
SHOWN_PACKAGES = ("numba", "llvmlite", "networkx", "matplotlib", "pandas")

#: Fills of rooms and of the foundation; the text on them is dark, so that it can be read on light and on dark pages.
FILLS = ("#cfe3f5", "#dcebd9")
LINE, TEXT, FAINT = "#7a8794", "#16202a", "#45525f"
ARROW = {
    "arrowstyle": "-|>,head_length=.5,head_width=.26", "mutation_scale": 12, "color": LINE, "lw": 1.1,
    "shrinkA": 0, "shrinkB": 0,
}  # fmt: skip
#: Shift of each box against the one above it, its size, and the margin, in inches: text of 8.4 points is then legible.
ACROSS, DOWN, WIDTH, HEIGHT, MARGIN = 0.5, 0.66, 4.9, 0.52, 0.05

Imports = dict[str, set[str]]
Place = tuple[float, float]


def layers(pyproject: Path = ROOT / "pyproject.toml") -> list[str]:
    """Return the rooms from top to bottom, as the contract on their order lists them; the foundation last."""
    contracts = tomllib.loads(pyproject.read_text(encoding="utf-8"))["tool"]["importlinter"]["contracts"]
    (rows,) = (contract["layers"] for contract in contracts if contract.get("containers") == ["contin"])
    return [room.strip() for row in rows if ":" not in row for room in row.split("|")] + [FOUNDATION]


def room_of(module: str, rooms: list[str]) -> str:
    """Return the room that a module of contin lies in."""
    name = module.split(".")[1]
    return name if name in rooms else FOUNDATION


def imported(tree: ast.AST) -> Iterator[str]:
    """Yield the names of all modules that a file imports, wherever it does."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            # `from contin import checks` imports a module, too
            yield from (f"contin.{alias.name}" for alias in node.names) if node.module == "contin" else (node.module,)


def imports(package: Path = ROOT / "contin") -> tuple[Imports, Imports]:
    """Return which rooms, and which other packages, each room imports."""
    rooms = layers()
    inside: Imports = {room: set() for room in rooms}
    outside: Imports = {room: set() for room in rooms}
    for file in sorted(package.rglob("*.py")):
        parts = file.relative_to(package.parent).with_suffix("").parts
        if parts[-1] == "__init__":
            continue
        room = room_of(".".join(parts), rooms)
        for module in imported(ast.parse(file.read_text(encoding="utf-8"))):
            if module.startswith("contin."):
                inside[room].add(room_of(module, rooms))
            else:
                outside[room].add(module.split(".")[0])
    for room in rooms:
        inside[room].discard(room)
    return inside, outside


def edges(inside: Imports) -> list[str]:
    """Return the imports as lines, "events -> core"; ValueError where one goes upwards."""
    rooms = layers()
    for room, others in inside.items():
        for other in others:
            if rooms.index(other) < rooms.index(room):
                raise ValueError(f"{room} imports {other}, which lies above it")
    return [f"{room} -> {other}" for room in rooms for other in rooms if other in inside[room]]


def draw(path: Path) -> None:
    """Draw the rooms as a staircase: a line goes down from each room, and right into every room that it imports."""
    import matplotlib

    matplotlib.use("svg")
    from matplotlib import pyplot

    inside, outside = imports()
    lines, rooms = edges(inside), list(inside)
    corners = {room: (i * ACROSS, -i * DOWN) for i, room in enumerate(rooms)}
    right, bottom = corners[rooms[-1]]
    figure = pyplot.figure(figsize=(right + WIDTH + 2 * MARGIN, HEIGHT - bottom + 2 * MARGIN))
    axes = figure.add_axes((0, 0, 1, 1))
    axes.set(xlim=(-MARGIN, right + WIDTH + MARGIN), ylim=(bottom - MARGIN, HEIGHT + MARGIN))
    axes.axis("off")
    for room in rooms:
        others = [other for other in rooms if other in inside[room] - {FOUNDATION}]
        importers = [other for other in rooms if room in inside[other] and room != FOUNDATION]
        _draw_lines(axes, corners[room], [corners[other] for other in others], [corners[other] for other in importers])
        _draw_box(axes, corners[room], room, [name for name in SHOWN_PACKAGES if name in outside[room]])
    with matplotlib.rc_context({"svg.hashsalt": "contin"}):  # the same imports give the same file
        figure.savefig(path, transparent=True, metadata={"Date": None, "Creator": None, "Description": "; ".join(lines)})


def _draw_lines(axes: Any, corner: Place, others: list[Place], importers: list[Place]) -> None:
    """Draw the line from a room down to the last one that it imports, and the arrow into it with a dot for each importer."""
    if others:
        start = corner[0] + ACROSS / 2
        axes.plot([start, start], [corner[1], others[-1][1] + HEIGHT / 2], color=LINE, lw=1.1)
    if importers:
        dots, middle = [left + ACROSS / 2 for left, _ in importers], corner[1] + HEIGHT / 2
        axes.annotate("", (corner[0], middle), (dots[0], middle), arrowprops=ARROW)
        axes.plot(dots, [middle] * len(dots), "o", ms=4.2, color=LINE)


def _draw_box(axes: Any, corner: Place, room: str, packages: list[str]) -> None:
    """Draw a room: its name, what it is for, and the packages that it imports."""
    from matplotlib.patches import FancyBboxPatch

    (x, y), style = corner, {"va": "center", "zorder": 4}
    fill = FILLS[room == FOUNDATION]
    axes.add_patch(FancyBboxPatch((x, y), WIDTH, HEIGHT, "round,pad=0,rounding_size=.07", fc=fill, ec=LINE, zorder=3))
    axes.text(x + 0.12, y + 0.335, room, size=11, weight="bold", color=TEXT, **style)
    axes.text(x + 0.12, y + 0.135, PURPOSE.get(room, ""), size=8.4, color=FAINT, **style)
    if packages:
        text = f"imports {', '.join(packages)}"
        axes.text(x + WIDTH - 0.12, y + 0.335, text, size=8.4, color=FAINT, ha="right", fontstyle="italic", **style)


def main(argv: list[str]) -> int:
    """Run the command; the exit code."""
    try:
        draw(Path(argv[0]) if argv else OUT)
    except ValueError as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
