"""Prints which files and functions of the project one job goes through: how much of the house a newcomer has to know.

    python scripts/walk.py [SCENE] [--functions]

The scene is run twice, and the second run is counted: what is done only once (kernels, recordings kept in memory) is not.
``--functions`` lists the functions of each file with the number of their calls.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import sys
import tempfile
from collections import Counter
from pathlib import Path
from types import CodeType, FrameType

ROOT = Path(__file__).resolve().parent.parent
PACKAGES = ("contin", "ribbon_model", "branches")


def calls(scene: Path, folder: Path) -> Counter[CodeType]:
    """Return how often each function of the project was called in a run of a scene."""
    from branches.run.__main__ import main

    found: Counter[CodeType] = Counter()
    rooms = tuple(f"{ROOT / package}/" for package in PACKAGES)

    def count(frame: FrameType, event: str, _: object) -> None:
        if event == "call" and frame.f_code.co_filename.startswith(rooms):
            found[frame.f_code] += 1

    for number in range(2):
        found.clear()
        with contextlib.redirect_stdout(io.StringIO()):
            sys.setprofile(count)
            try:
                code = main([str(scene), "--out", str(folder / f"{number}.h5")])
            finally:
                sys.setprofile(None)
        if code:
            raise SystemExit(code)
    return found


def main(arguments: list[str] | None = None) -> int:
    """Run the command; return its exit code."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("scene", nargs="?", type=Path, default=ROOT / "configs" / "m1_n2.yaml", metavar="SCENE")
    parser.add_argument("--functions", action="store_true", help="list the functions of each file")
    options = parser.parse_args(arguments)
    with tempfile.TemporaryDirectory() as folder:
        found = calls(options.scene, Path(folder))
    named = {code: number for code, number in found.items() if code.co_name[0] != "<"}  # no comprehensions
    files = Counter[str]()
    for code, number in named.items():
        files[code.co_filename] += number
    for file, number in sorted(files.items()):
        print(f"{number:7d}  {Path(file).relative_to(ROOT)}")
        for code, times in sorted(named.items(), key=lambda each: each[0].co_firstlineno) if options.functions else ():
            if code.co_filename == file:
                print(f"{times:15d}  {code.co_qualname if sys.version_info >= (3, 11) else code.co_name}")
    print(f"{len(files)} files, {len(named)} functions, {sum(named.values())} calls")
    return 0


if __name__ == "__main__":
    sys.exit(main())
