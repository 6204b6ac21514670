"""``python scripts/plot_branch.py FILE``: a branch as a picture, and the strip along it.

Closed strips: kappa* against kappa_n. Open ones: what a person feels against what is followed, a diagram for each number.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))


def main(argv=None) -> int:
    """Draw; the exit code."""
    parser = argparse.ArgumentParser(description="Draw a branch file: the curve, and the strip along it.")
    parser.add_argument("file", help="an HDF5 file written by branches.run")
    parser.add_argument("--out", help="picture to write, .pdf, .svg or .png (default: beside the file, .pdf)")
    parser.add_argument("--shapes", type=int, default=6, help="number of strips drawn (default 6)")
    parser.add_argument(
        "--width", type=float,
        help="width of the drawn strip, in units of L / 2 pi (default: that of the scene's strip if it has one, or 0.3); "
        "narrower where its generators would cross",
    )  # fmt: skip
    options = parser.parse_args(argv)
    from branches.files import StoreError, check_picture, write_picture
    from branches.read import read_branch

    out = Path(options.out) if options.out else Path(options.file).with_suffix(".pdf")
    try:
        check(options)
        check_picture(out)
        write_picture(read_branch(options.file).plot(options.shapes, options.width), out)
    except (StoreError, ValueError) as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    print(f"written to {out}")
    return 0


def check(options) -> None:
    """Raise ValueError on an option that makes no picture."""
    if not 0 <= options.shapes <= 12:
        raise ValueError(f"--shapes {options.shapes}: must lie between 0 and 12")
    if options.width is not None and not 0 < options.width <= 2:
        raise ValueError(f"--width {options.width:g}: must lie between 0 and 2")


if __name__ == "__main__":
    sys.exit(main())
