"""``python -m branches.paper --out DIR [ITEM ...]``: the published tables and figures, computed, each number beside ours."""

from __future__ import annotations

from branches.store import interrupt

if __name__ == "__main__":  # before the imports below, which take a second
    interrupt.begin("finished items are on the page")

import importlib
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from branches.run.display import Progress
from branches.store.command import Parser, answered, write_output

if TYPE_CHECKING:  # --help needs neither numpy nor matplotlib
    from branches.paper.page import Section


#: What can be asked for, and the module whose function of this name computes it.
ITEMS = {
    "table1": "circles", "table2": "circles", "table3": "circles", "fig6": "unfolding", "fig9": "circles", "fig10": "circles",
    "fig11": "diagram", "fig12": "diagram", "fig12b": "diagram", "curves": "curves", "snaps": "snaps", "finite-width": "curves",
    "fig7": "shell",  # last: minutes of CalculiX
}  # fmt: skip


def section_of(name: str, folder: Path) -> Section:
    """Return an item; it may write pictures into the folder."""
    return getattr(importlib.import_module(f"branches.paper.{ITEMS[name]}"), name.replace("-", "_"))(folder)


def parser() -> Parser:
    """Return the command line."""
    parser = Parser(
        "paper",
        "The tables and figures of Audoly & Seffen (2015): pictures, and a page (index.md, index.html) where each "
        "published number stands beside ours. Items that earlier calls put on the page stay there.",
    )
    parser.add_argument("-o", "--out", required=True, metavar="DIR", help="folder to write to, made if it is not there")
    parser.add_argument("items", nargs="*", metavar="ITEM", help=f"any of {', '.join(ITEMS)} (default: all)")
    parser.add_argument("--quiet", action="store_true", help="print only the last line")
    return parser


@answered()
def main(argv: Sequence[str] | None = None) -> int:
    """Compute what is asked for and write the page; the exit code: 0, or 2 for a request that cannot be met."""
    options = parser().parse_args(argv)
    from branches.scene.fields import ConfigError
    from branches.store.files import check_folder_name, prepare
    from contin.lowlevel import meant

    if unknown := [name for name in options.items if name not in ITEMS]:
        near = [f"{name!r}{meant(name, ITEMS)}" for name in unknown]
        raise ConfigError(f"there is no item {', '.join(near)}; known are {', '.join(ITEMS)}")
    folder = Path(options.out)
    try:
        check_folder_name(folder)
        prepare(folder / "index.md")  # before the work, not after it
        _compute(folder, list(dict.fromkeys(options.items)) or list(ITEMS), options.quiet)
    except OSError as error:
        raise ConfigError(f"cannot write to {folder}: {error.strerror or error}") from error
    return 0


def _compute(folder: Path, names: list[str], quiet: bool) -> None:
    """Compute items, with a line of progress, and write the page after each of them."""
    from branches.paper.page import read, write

    sections = read(folder)
    with Progress("items", len(names), quiet) as progress:
        for name in progress.each(names, str):
            began = time.monotonic()
            sections[name] = section_of(name, folder)
            # after each item: an interrupted call leaves a page of the finished items
            write(folder, {one: sections[one] for one in ITEMS if one in sections})
            progress.tell(f"{name}: {sections[name].title} ({time.monotonic() - began:.1f} s)\n")
    write_output(f"written to {folder / 'index.html'}\n")


if __name__ == "__main__":
    sys.exit(interrupt.run(main))
