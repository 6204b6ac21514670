"""``python -m branches.run CONFIG``: follow a branch to its end, show it being computed, keep it in an HDF5 file."""

from __future__ import annotations

import argparse
import sys

# Nothing heavy is imported here: `--help` and mistakes in the command line answer at once.

EXIT_BAD_INPUT, EXIT_STOPPED_SHORT, EXIT_INTERRUPTED = 2, 1, 130


def arguments(argv=None) -> argparse.Namespace:
    """The command line, parsed."""
    parser = argparse.ArgumentParser(
        prog="python -m branches.run",
        description="Follow one branch of buckled equilibria of a closed elastic strip and write it to an HDF5 file.",
        epilog="Exit code: 0 done, 1 the branch was lost on the way (the file holds what there is), 2 bad input, "
        "130 interrupted.",
    )
    parser.add_argument("config", metavar="CONFIG", help="the scene, a YAML file such as configs/m1_n2.yaml")
    parser.add_argument("--out", metavar="PATH", help="result file or folder (default: the config's name with .h5, here)")
    parser.add_argument(
        "--set", metavar="KEY=VALUE", action="append", default=[], help="change a field, as in --set nu=0.2 --set mesh.degree=5"
    )
    parser.add_argument("--quiet", action="store_true", help="print the summary only")
    parser.add_argument("--resume", action="store_true", help="go on with an unfinished result file")
    parser.add_argument("--overwrite", action="store_true", help="replace a result file of another scene")
    return parser.parse_args(argv)


def main(argv=None) -> int:
    """Run the command; the exit code."""
    options = arguments(argv)
    from branches.config import ConfigError, load

    try:
        config = load(options.config, options.set)
        path = output_path(options)
        from branches.job import run_branch
        from branches.store import StoreError
    except ConfigError as error:
        print(f"error: {error}", file=sys.stderr)
        return EXIT_BAD_INPUT
    from branches.display import Display
    from contin.errors import ContinError

    display = Display(quiet=options.quiet)
    try:
        outcome = run_branch(config, path, display, resume=options.resume, overwrite=options.overwrite)
    except (ConfigError, StoreError, ContinError) as error:
        display.clear()
        print(f"error: {error}", file=sys.stderr)
        return EXIT_BAD_INPUT
    if outcome == "interrupted":
        return EXIT_INTERRUPTED
    return 0 if outcome == "complete" else EXIT_STOPPED_SHORT


def output_path(options):
    """The result file; its folder is made if need be.

    Raises
    ------
    ConfigError
        It cannot be written to.
    """
    import os
    from pathlib import Path

    from branches.config import ConfigError

    name = Path(options.config).stem + ".h5"
    path = Path(options.out) if options.out else Path(name)
    if path.is_dir() or (options.out and options.out.endswith(("/", os.sep))):
        path = path / name
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ConfigError(f"--out {str(path)!r}: cannot make the folder: {error.strerror}") from error
    if not os.access(path.parent, os.W_OK):
        raise ConfigError(f"--out {str(path)!r}: the folder cannot be written to")
    if path.is_dir():
        raise ConfigError(f"--out {str(path)!r}: is a folder")
    return path


if __name__ == "__main__":
    sys.exit(main())
