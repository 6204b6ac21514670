"""Make the figures of paper.md anew: the bifurcation diagram of the closed ribbon, and the error of its fold against time.

    python scripts/paper_figures.py [--out DIR]

Each figure is made by the command that the documentation names for it (docs/tutorial.md, docs/performance.md). Times are
those of this machine; a tool that is not installed is left out.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
from pathlib import Path

SCRIPTS = Path(__file__).resolve().parent


def commands(scratch: Path, folder: Path) -> list[list[str]]:
    """Return the commands that write fig12.png and bench-fold.png into a folder."""
    scene = str(SCRIPTS.parent / "configs" / "fig12.yaml")
    return [
        ["-m", "branches.run", scene, "--out", str(scratch / "fig12")],
        [str(SCRIPTS / "plot_diagram.py"), str(scratch / "fig12"), "--out", str(folder / "fig12.png")],
        [str(SCRIPTS / "bench.py"), "fold", "--out", str(folder)],
    ]


def main(argv=None) -> int:
    """Run the command; return the exit code."""
    parser = argparse.ArgumentParser(prog="python scripts/paper_figures.py", description=__doc__.splitlines()[0])
    parser.add_argument("--out", metavar="DIR", default="paper-figures", help="a folder (default: paper-figures)")
    folder = Path(parser.parse_args(argv).out)
    if folder.exists() and not folder.is_dir():
        parser.error(f"--out {str(folder)!r}: must be a folder")
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as scratch:
        for words in commands(Path(scratch), folder):
            if code := subprocess.run([sys.executable, *words]).returncode:
                return code
    return 0


if __name__ == "__main__":
    sys.exit(main())
