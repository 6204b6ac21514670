"""``python -m branches.explore RESULT... --out PAGE.html``: results as one page to look at in a browser."""

from __future__ import annotations

from branches.store import interrupt

if __name__ == "__main__":  # before the imports below
    interrupt.begin("no page was written")

import shlex
import sys
from pathlib import Path

from branches.store.command import Parser, answered, typed, write_output


def parser() -> Parser:
    """Return the command line."""
    parser = Parser(
        "explore", "Write one self-contained HTML page that shows results: the diagram, and the state at every point."
    )
    parser.add_argument(
        "results", metavar="RESULT", nargs="+",
        help="a branch file (.h5), the folder of a diagram, a file of contin.save (.npz), or a folder of those",
    )  # fmt: skip
    parser.add_argument("-o", "--out", metavar="PAGE", default="explore.html", help="the page (default: explore.html)")
    parser.add_argument(
        "--points", metavar="CSV", help="measured points to show on the map: columns of the map by name in the first line"
    )
    parser.add_argument("--quiet", action="store_true", help="show no line of progress")
    return parser


@answered()
def main(argv=None) -> int:
    """Run the command; the exit code."""
    options = parser().parse_args(argv)
    from branches.explore.gather import gather, left_out, measured
    from branches.explore.page import assemble
    from branches.store.files import check_name, prepare, write_bytes

    path = Path(options.out)
    check_name(path, (".html", ".htm"))
    prepare(path)
    data = gather(options.results, options.quiet)
    if options.points:
        data["measured"] = measured(options.points, data["axes"])
    page = assemble(data).encode()
    with interrupt.held():
        write_bytes(path, page)
        interrupt.change("the page is complete")
    write_output(f"written to {path} ({len(page) / 1e6:.1f} MB); open it in a browser\n")
    if missing := left_out(data):
        write_output(
            f"left out to keep the page small: the shapes of {len(missing)} branches, which the page names; a page of fewer "
            f"results has them, as in: {typed('explore')} {shlex.quote(missing[0]['path'])}\n"
        )
    return 0


if __name__ == "__main__":
    sys.exit(interrupt.run(main))
