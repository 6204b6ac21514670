"""``python -m branches.run CONFIG``: follow a branch to its end, show its points, and write it to an HDF5 file."""

from __future__ import annotations

from branches.store import interrupt

if __name__ == "__main__":  # before the imports below
    interrupt.begin()

import contextlib
import os
import sys

from branches.store.command import Parser, answered, complain, write_output

# Nothing heavy is imported here: `--help` and invalid command lines are answered at once.

EXIT_STOPPED_SHORT = 1


def parser() -> Parser:
    """Return the command line."""
    parser = Parser(
        "run",
        "Follow one branch of buckled equilibria of a closed elastic strip, or the stages of an open one, and write it to an "
        "HDF5 file.",
        "Exit code: 0 done, 1 the run failed on the way (the file holds the points before), 2 bad input, 130 interrupted.",
    )
    parser.add_argument("config", metavar="CONFIG", help="the scene: a YAML file, or a name that `ribbon scenes` lists")
    parser.add_argument(
        "-o", "--out", metavar="PATH", help="result file or folder (default: the name of the config with .h5, in this folder)"
    )
    parser.add_argument(
        "--set", metavar="KEY=VALUE", action="append", default=[], help="change a field, as in --set nu=0.2 --set mesh.degree=5"
    )
    parser.add_argument(
        "--workers", type=int, metavar="N", help="number of processes for a scene of many branches (default: number of cores)"
    )
    parser.add_argument(
        "--time-limit", type=float, default=3600.0, metavar="S",
        help="largest time in seconds for each branch of a scene of many branches",
    )  # fmt: skip
    parser.add_argument("--scheduler", metavar="ADDRESS", help="run a scene of many branches on a Dask cluster instead")
    parser.add_argument(
        "--search", type=int, nargs="?", const=8, metavar="N",
        help="look for further states at labelled values, and where stages of an open strip end, from N random guesses beside "
        "each known state (default: 8)",
    )  # fmt: skip
    parser.add_argument("--quiet", action="store_true", help="print the summary only")
    existing = parser.add_mutually_exclusive_group()
    existing.add_argument("--resume", action="store_true", help="continue an unfinished result file; start if there is none")
    existing.add_argument("--overwrite", action="store_true", help="replace a result file of another scene")
    return parser


@answered()
def main(argv=None) -> int:
    """Run the command; return the exit code."""
    try:
        return _run(parser().parse_args(argv))
    finally:
        write_output()


def _run(options) -> int:
    from branches.scene.fields import ConfigError
    from branches.scene.parse import found, load

    options.config = found(options.config)
    if options.workers is not None and options.workers < 1:
        raise ConfigError(f"--workers {options.workers}: must be at least 1")
    if not options.time_limit > 0:
        raise ConfigError(f"--time-limit {options.time_limit:g}: must be above 0")
    if options.search is not None and not 1 <= options.search <= 1000:
        raise ConfigError(f"--search {options.search}: must be from 1 to 1000")
    scene = load(options.config, options.set)
    for caution in next(iter(scene.scenes.values())).cautions:
        complain(f"caution: {caution}")
    if options.search is not None:
        _check_search(scene)
    if scene.many:
        return _run_many(scene, options)
    path = output_path(options)
    scene = _with_stability(scene, path)
    interrupt.change(f"nothing new is in {path}; the same command starts again")
    from branches.run.display import StartingDisplay

    display = StartingDisplay(options.quiet)  # before the imports below, which compile the first time
    from branches.run.runner import run_scene

    try:
        outcome = run_scene(scene, path, display, resume=options.resume, overwrite=options.overwrite)
    finally:
        display.clear()
    from branches.scene.stages import stages_of

    interrupt.change(f"{path} is {outcome}")
    if outcome == "complete" and stages_of(scene)[0].has_barriers:
        _tell_barriers(path, display, options.quiet)
    if outcome == "complete" and options.search is not None:
        _tell_further(scene, path, display, options)
    return {"complete": 0, "interrupted": interrupt.EXIT_INTERRUPTED}.get(outcome, EXIT_STOPPED_SHORT)


def _with_stability(scene, path):
    """Return the scene of one branch with stability, unless it says otherwise or the file that is there has none."""
    from branches.store.files import StoreError
    from branches.store.layout import CLOSED

    if scene.KIND != CLOSED or "stability" in scene.model_fields_set:
        return scene
    if path.exists():
        from branches.store.read import read_branch

        with contextlib.suppress(StoreError):  # the run says what is wrong with it
            return scene.model_copy(update={"stability": read_branch(path).scene.stability})
    return scene.model_copy(update={"stability": True})


def _tell_barriers(path, display, quiet: bool) -> None:
    from branches.run.barriers import report
    from branches.run.blas import one_thread
    from branches.store.read import read_branch

    with one_thread():
        lines = report(read_branch(path), quiet)
    if lines:
        display.note("\n".join(lines))


def _check_search(scene) -> None:
    """Raise ConfigError on a search that is not made."""
    from branches.scene.fields import ConfigError

    first = next(iter(scene.scenes.values()))
    if first.KIND == "network" or (scene.many and first.KIND != "closed strip"):
        raise ConfigError("--search: is for a scene of one open strip, or of closed strips")
    if first.KIND == "closed strip" and not first.zeros.get("kappa_n"):
        raise ConfigError(
            "--search: closed strips are searched at labelled values of kappa_n; the scene has none: "
            "add some, as with --set 'zeros={kappa_n: [-20, 2]}'"
        )


def _tell_further(scene, path, display, options) -> None:
    """Print the states of strips that no stage or branch reaches."""
    from branches.run import further, further_closed
    from branches.store.read import read_branch

    first = next(iter(scene.scenes.values()))
    if first.KIND == "closed strip":
        lines = further_closed.report(path, first.zeros["kappa_n"], options.search, options.quiet)
    else:
        lines = further.report(read_branch(path), options.search, options.quiet)
    display.note("\n".join(lines))


def _run_many(sweep, options) -> int:
    """Run a scene of many branches; its folder gets one file per branch."""
    interrupt.change(interrupt.BRANCHES_KEPT)
    from pathlib import Path

    from branches.scene.fields import ConfigError
    from branches.store.files import check_folder_name

    if options.resume:
        raise ConfigError(
            "--resume: is not for scenes of many branches; run the scene again, it computes the branches that are missing"
        )
    folder = Path(options.out or Path(options.config).stem)
    check_folder_name(folder)
    from branches.run.display import StartingDisplay

    display = StartingDisplay(options.quiet)  # before the imports below, which compile the first time
    from branches.run.many import run_many

    try:
        outcome = run_many(
            sweep, folder, display, scheduler=options.scheduler, workers=options.workers, time_limit=options.time_limit,
            overwrite=options.overwrite,
        )  # fmt: skip
    finally:
        display.clear()
    if outcome == "complete" and options.search is not None:
        _tell_further(sweep, folder, display, options)
    return 0 if outcome == "complete" else EXIT_STOPPED_SHORT


def output_path(options):
    """Return the result file of the command line.

    Raises ConfigError or StoreError for a name that is not that of a branch, or a file or folder in its place that no result
    may replace.
    """
    from pathlib import Path

    from branches.scene.fields import ConfigError
    from branches.store.files import BRANCHES, check_name

    if options.out == "":
        raise ConfigError("--out '': must name a file or a folder")
    name = Path(options.config).stem + ".h5"
    path = Path(options.out or name)
    try:
        if (options.out or "").endswith(("/", os.sep)) or path.is_dir() and path.suffix not in BRANCHES:
            path = path / name
        if path.is_dir():
            raise ConfigError(f"--out {str(path)!r}: is a folder; name a file, or another folder")
        if path.exists() and not path.is_file():
            raise ConfigError(f"--out {str(path)!r}: is neither a file nor a folder")
        if path.exists() and path.samefile(options.config):
            raise ConfigError(f"--out {str(path)!r}: is the config itself; name another file")
        check_name(path, BRANCHES, instead=f", or be a folder, as in {path.stem + '/'!r}")
    except OSError as error:
        raise ConfigError(f"--out {str(path)!r}: cannot be accessed: {error.strerror}") from error
    return path


if __name__ == "__main__":
    sys.exit(interrupt.run(main))
