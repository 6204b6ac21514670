"""``python -m branches.plot RESULT``: a branch with the strip along it, a diagram, or any column against any other."""

from __future__ import annotations

from branches.store import interrupt

if __name__ == "__main__":  # before the imports below, which take a second
    interrupt.begin("no picture was written")

import math
import sys
from pathlib import Path

from branches.store.command import Parser, answered, check_view, write_output
from branches.store.files import StoreError, check_picture, write_picture


def parser() -> Parser:
    """Return the command line."""
    parser = Parser("plot", "Draw a branch with the strip along it, or the bifurcation diagram of a folder or a scene.")
    parser.add_argument(
        "result", metavar="RESULT",
        help="a branch file; the folder of a diagram; or a scene (.yaml) of closed strips, for an instant preview from the "
        "exact quadrature, with nothing computed by continuation",
    )  # fmt: skip
    parser.add_argument("-o", "--out", help="picture to write, .pdf, .svg or .png (default: beside the result, .pdf)")
    parser.add_argument("--size", metavar="WIDTH", help="width of the picture, as in 90mm, 18cm or 7in; texts fit a narrow one")
    parser.add_argument("--style", metavar="NAME", help="style of matplotlib: its name, or a file (.mplstyle)")
    parser.add_argument(
        "--points", metavar="CSV", help="measured points to draw too: columns with the names of those drawn in the first line"
    )
    of_branch = parser.add_argument_group("a branch")
    of_branch.add_argument("--x", metavar="COLUMN", help="column across (default: the number that is followed)")
    of_branch.add_argument("--y", metavar="COLUMN", help="column upwards (default: what is conjugate to it)")
    of_branch.add_argument("--shapes", type=int, help="number of strips drawn (default 6)")
    of_branch.add_argument(
        "--width", type=float,
        help="width of the drawn strip, in units of L / 2 pi (default: that of the scene's strip if it has one, or 0.3); "
        "narrower where its generators would cross",
    )  # fmt: skip
    of_branch.add_argument(
        "--view", nargs=2, type=float, metavar=("AZIMUTH", "ELEVATION"),
        help="the side from which strips are seen, in degrees (default: open strips from the side, -90 20, a horizontal strip "
        "is horizontal; closed ones at an angle, -45 32)",
    )  # fmt: skip
    diagram = parser.add_argument_group("a diagram")
    diagram.add_argument(
        "--window", nargs=2, type=float, metavar=("LOW", "HIGH"),
        help="of kappa_n (default: the part of -8 to 14 in which special points are)")  # fmt: skip
    diagram.add_argument("--law", help="which law, where the diagram has several")
    diagram.add_argument("--nu", type=float, help="which nu, where the diagram has several")
    diagram.add_argument("--plain", action="store_true", help="only in conjugate coordinates, not disentangled beside")
    return parser


@answered(ValueError)
def main(argv=None) -> int:
    """Draw; return the exit code."""
    options = parser().parse_args(argv)
    path = Path(options.result)
    is_diagram = path.is_dir() or path.suffix in (".yaml", ".yml", ".json")
    _check(options, is_diagram)
    figure, out, more = (_diagram if is_diagram else _branch)(options, path)
    check_picture(out)
    from matplotlib import style

    name = options.style
    if name is not None and name not in style.available and not Path(name).is_file():
        raise ValueError(f"--style {name}: is no file, nor one of matplotlib's styles: {', '.join(style.available)}")
    with style.context([] if name is None else name):
        write_picture(figure(), out)
    write_output(f"{more}written to {out}\n")
    return 0


#: Options that are for a branch only, and for a diagram only.
_OF_BRANCH, _OF_DIAGRAM = ("x", "y", "shapes", "width", "view"), ("window", "law", "nu", "plain")


#: Units of --size in inches, and the widths that it may have: from less than a column to a poster.
_INCHES, _SIZES = {"mm": 1 / 25.4, "cm": 1 / 2.54, "in": 1.0}, (1.5, 50.0)


def _inches(size: str | None) -> float | None:
    """Return the width of a picture in inches."""
    if size is None:
        return None
    number, unit = size[:-2], size[-2:]
    try:
        wide = float(number) * _INCHES[unit]
    except (KeyError, ValueError):
        wide = math.nan
    if not _SIZES[0] <= wide <= _SIZES[1]:
        raise ValueError(f"--size {size}: must be a number with mm, cm or in, from 1.5in to 50in, as in 90mm")
    return wide


def _check(options, is_diagram: bool) -> None:
    """Raise ValueError on an option that makes no picture, or is for results of the other kind."""
    for name in _OF_BRANCH if is_diagram else _OF_DIAGRAM:
        if getattr(options, name) is not None and getattr(options, name) is not False:
            kinds = ("a branch", "a diagram") if is_diagram else ("a diagram", "a branch")
            raise ValueError(f"--{name}: is for {kinds[0]}, and {options.result!r} is {kinds[1]}")
    check_view(options.view)
    if options.shapes is not None and not 0 <= options.shapes <= 12:
        raise ValueError(f"--shapes {options.shapes}: must lie between 0 and 12")
    if options.width is not None and not 0 < options.width <= 2:
        raise ValueError(f"--width {options.width:g}: must lie between 0 and 2")
    if options.window and not options.window[0] < options.window[1]:
        raise ValueError(f"--window {options.window[0]:g} {options.window[1]:g}: the first number must be the smaller")


def _branch(options, path: Path):
    """Return a function that draws, the picture to write, and a line about what is drawn."""
    from branches.store.read import read_branch

    out, size = Path(options.out) if options.out else path.with_suffix(".pdf"), _inches(options.size)

    def figure():
        given = {name: getattr(options, name) for name in _OF_BRANCH} | {"size": size, "points": options.points}
        return read_branch(path).plot(**{name: value for name, value in given.items() if value is not None})

    return figure, out, ""


def _diagram(options, path: Path):
    from branches.graph import read
    from branches.graph.picture import figure
    from branches.graph.stored import read as read_closed
    from branches.store.measured import read_points

    out = Path(options.out) if options.out else path / "diagram.pdf" if path.is_dir() else Path(f"{path.stem}.pdf")
    graph = read_closed(path) if path.is_dir() else read(path)
    law, nu, more = choose(graph, options.law, options.nu)
    size = _inches(options.size)
    measured = options.points and read_points(options.points, {"kappa_n": "", "kappa_star": ""})
    return (lambda: figure(graph, law, nu, options.window, not options.plain, size, measured)), out, more


def choose(graph, law, nu):
    """Return the law and nu to draw: those asked for, or the first that the diagram has; and a line that says so."""
    from branches.graph.closed import families
    from branches.scene.closed import and_nu

    have = sorted({family[:2] for family in families(graph)}, key=lambda pair: (pair[0] != "ribbon", pair))
    found = [pair for pair in have if law in (None, pair[0]) and nu in (None, pair[1])]
    if not found:
        known = "; ".join(f"{name}{and_nu(name, value)}" for name, value in have)
        asked = [f"--{name} {value}" for name, value in (("law", law), ("nu", nu)) if value is not None]
        raise StoreError(f"{' '.join(asked)}: the diagram has {known}")
    law, nu = found[0]
    others = "; ".join(f"{name}{and_nu(name, value)}" for name, value in found[1:])
    more = f"drawn: {law}{and_nu(law, nu)}; the diagram also has {others} (--law, --nu)\n" if others else ""
    return law, nu, more


if __name__ == "__main__":
    sys.exit(interrupt.run(main))
