"""``python scripts/plot_diagram.py DIR``: the bifurcation diagram (Fig. 12a), in (kappa_n, kappa*) and disentangled."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))


def main(argv=None) -> int:
    """Draw; the exit code."""
    parser = argparse.ArgumentParser(description="Draw the diagram of a diagram scene.")
    parser.add_argument(
        "diagram", help="folder written by branches.run for a scene with several branches; or a scene (.yaml), for an instant "
        "preview from the exact quadrature, with nothing computed by continuation"
    )  # fmt: skip
    parser.add_argument("--out", help="picture to write, .pdf, .svg or .png (default: diagram.pdf in the folder)")
    parser.add_argument("--window", nargs=2, type=float, default=(-8.0, 14.0), metavar=("LOW", "HIGH"), help="of kappa_n")
    parser.add_argument("--law", help="which law, where the diagram has several")
    parser.add_argument("--nu", type=float, help="which nu, where the diagram has several")
    parser.add_argument("--plain", action="store_true", help="only in conjugate coordinates, not disentangled beside")
    options = parser.parse_args(argv)
    from branches import diagram_graph
    from branches.draw_diagram import figure
    from branches.files import StoreError, check_picture, write_picture
    from branches.graph import read

    try:
        out = picture_path(options)
        graph = diagram_graph.read(options.diagram) if Path(options.diagram).is_dir() else read(options.diagram)
        law, nu, more = choose(graph, options.law, options.nu)
        check_picture(out)
        write_picture(figure(graph, law, nu, tuple(options.window), not options.plain), out)
    except StoreError as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    print(f"{more}written to {out}")
    return 0


def picture_path(options) -> Path:
    """Where the picture goes; StoreError on an option that makes no picture."""
    from branches.files import StoreError

    if not options.window[0] < options.window[1]:
        raise StoreError(f"--window {options.window[0]:g} {options.window[1]:g}: the first number must be the smaller")
    source = Path(options.diagram)
    beside = source / "diagram.pdf" if source.is_dir() else Path(f"{source.stem}.pdf")
    return Path(options.out) if options.out else beside


def choose(graph, law, nu):
    """The law and nu to draw: those asked for, or the first that the diagram has; and a line that says so."""
    from branches.diagram_graph import families
    from branches.files import StoreError
    from contin.lowlevel import exact_text

    have = sorted({family[:2] for family in families(graph)}, key=lambda pair: (pair[0] != "ribbon", pair))
    found = [pair for pair in have if law in (None, pair[0]) and nu in (None, pair[1])]
    if not found:
        known = ", ".join(f"{name} nu = {exact_text(value)}" for name, value in have)
        raise StoreError(f"--law {law} --nu {nu}: the diagram has {known}")
    law, nu = found[0]
    others = ", ".join(f"{name} nu = {exact_text(value)}" for name, value in found[1:])
    more = f"drawn: {law}, nu = {exact_text(nu)}; the diagram also has {others} (--law, --nu)\n" if others else ""
    return law, nu, more


if __name__ == "__main__":
    sys.exit(main())
