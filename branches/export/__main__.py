"""``python -m branches.export FILE --point LABEL --out strip.stl``: write a strip for other programs, or a branch as a film."""

from __future__ import annotations

from branches.store import interrupt

if __name__ == "__main__":  # before the imports below
    interrupt.begin()

import math
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from branches.export import LIBRARIES
from branches.store.command import Parser, Quantity, answered, check_view, write_output

if TYPE_CHECKING:  # nothing heavy is imported here: `--help` and invalid command lines are answered at once
    from numpy import ndarray

    from branches.store.branch import StoredBranch
    from ribbon_model.shape import Shape

#: Allowed endings of --out and --movie.
SURFACES, MOVIES = tuple(LIBRARIES), (".gif", ".mp4")
#: Least and largest number of frames: fewer than 2 show no motion; more than 2000 take minutes and hundreds of megabytes.
_FRAMES = (2, 2000)
#: Least number of cells along an open strip. Flat cells lose (angle of a cell)**2/12 of the volume: 1e-6 of a strip that
#: turns by 2 pi. Ten times more: 1e-8, and files ten times larger. (Closed strips have 900 cells and more.)
_CELLS = 1800


def parser() -> Parser:
    """Return the command line."""
    parser = Parser(
        "export",
        "Write the strip at a labelled point of a result for other programs (3D printing, Blender, ParaView, "
        "spreadsheets), or the whole branch as a film.",
        "Exit code: 0 done, 2 bad input, 130 interrupted. Surfaces need trimesh or meshio: "
        'pip install "ribbon-continuation[export]".',
    )
    parser.add_argument("result", metavar="FILE", help="file of a branch, such as m1_n2.h5")
    parser.add_argument("--point", metavar="LABEL", help="number of a labelled point (its LAB), or its label, such as LP")
    parser.add_argument(
        "-o", "--out", metavar="NAME", action="append", default=[],
        help=f"file to write; may be repeated; the ending chooses the format: {', '.join((*SURFACES, '.csv'))}",
    )  # fmt: skip
    parser.add_argument(
        "--table", metavar="NAME",
        help="table of all points of the branch in its units (SI where the scene has dimensions), .csv",
    )  # fmt: skip
    parser.add_argument("--movie", metavar="NAME", help="film of the folding, .gif or (with ffmpeg) .mp4")
    parser.add_argument(
        "--view", nargs=2, type=float, metavar=("AZIMUTH", "ELEVATION"),
        help="the side from which the film shows the strip, in degrees (default: as 'ribbon plot')",
    )  # fmt: skip
    parser.add_argument(
        "--length", type=Quantity("m"), metavar="X",
        help="length of the strip in the files (of a network, of its longest one): a number, or one with a unit as in 20cm, "
        "which becomes 0.2 (default: that of the scene in m, or 1)",
    )  # fmt: skip
    parser.add_argument(
        "--width", type=Quantity("m"), metavar="X",
        help="width, in the unit of --length (default: that of the scene, in proportion to the length, if it has one); the "
        "scene's width along the strip is relative to it",
    )  # fmt: skip
    parser.add_argument(
        "--thickness", type=Quantity("m"), metavar="X", help="thickness, in the unit of --length; makes a closed solid"
    )
    parser.add_argument(
        "--frames", type=int, default=60, metavar="N", help="largest number of frames from end to end (default: 60)"
    )
    return parser


@answered()
def main(argv=None) -> int:
    """Run the command; return the exit code."""
    with interrupt.unwinding():  # unfinished files are removed
        return _export(parser().parse_args(argv))


def _export(options) -> int:
    from branches.store.files import prepare, write_bytes
    from branches.store.read import read_branch

    check(options)
    branch = read_branch(options.result)
    files = _strip_files(branch, options) if options.out else {}
    if options.table:
        files[Path(options.table)] = _csv(branch.in_units())
    for path in (*files, *([Path(options.movie)] if options.movie else [])):
        prepare(path)
    if options.movie:
        from branches.export.film import film

        width = options.width / (options.length or branch.length) * branch.shape_length if options.width else None
        files[Path(options.movie)] = film(branch, Path(options.movie).suffix.lower(), options.frames, width, options.view)
    for path, data in files.items():
        write_bytes(path, data)
    for path, data in files.items():
        write_output(f"written to {path} ({max(len(data) // 1000, 1)} kB)\n")
    return 0


def check(options) -> None:
    """Check the options that can be checked without the result.

    Raises ConfigError or StoreError for an invalid option; the message names it, its value and what is allowed.
    """
    from branches.scene.fields import ConfigError
    from branches.store.files import check_name

    check_view(options.view)
    if not (options.out or options.movie or options.table):
        raise ConfigError(
            "--out: is needed, as in --point LP --out strip.stl; or --movie, as in --movie fold.gif; or --table, as in "
            "--table points.csv"
        )
    if options.out and not options.point:
        raise ConfigError("--point: is needed with --out, as in --point LP")
    for name in ("length", "width", "thickness"):
        value = getattr(options, name)
        if value is not None and not 1e-6 <= value <= 1e6:
            raise ConfigError(f"--{name} {value:g}: must be from 1e-6 to 1e6")
    if options.width is not None and options.length is not None and options.width > options.length:
        raise ConfigError(f"--width {options.width:g}: must not exceed the length, {options.length:g}")
    if not _FRAMES[0] <= options.frames <= _FRAMES[1]:
        raise ConfigError(f"--frames {options.frames}: must be from {_FRAMES[0]} to {_FRAMES[1]}")
    names = [("--out", name, (*SURFACES, ".csv")) for name in options.out]
    names += [("--movie", options.movie, MOVIES)] if options.movie is not None else []
    names += [("--table", options.table, (".csv",))] if options.table is not None else []
    seen = {Path(options.result).resolve(): "is the result itself"}
    for option, name, endings in names:
        path = Path(name)
        check_name(path, endings, option)
        if path.resolve() in seen:
            raise ConfigError(f"{option} {name!r}: {seen[path.resolve()]}; name another file")
        seen[path.resolve()] = "is named twice"


# --- which point ------------------------------------------------------------------------------------------------------


def labelled_point(branch: StoredBranch, text: str) -> int:
    """Return the row of a labelled point in the table of points, from its LAB (from 1) or its label.

    Raises ConfigError where there is none, or there are several; the message lists the labelled points.
    """
    from branches.scene.fields import ConfigError

    labels = [label.decode() for label in branch.events["label"]]
    if text.isdecimal():
        found = [int(text) - 1] if 1 <= int(text) <= len(labels) else []
    else:
        found = [row for row, label in enumerate(labels) if label == text.upper()]
    if len(found) == 1:
        return int(branch.events["point"][found[0]])
    listed = ", ".join(f"{row + 1} ({labels[row]} at {branch.place(row)})" for row in found or range(len(labels)))
    problem = f"{len(found)} points have this label; name one by its number" if found else "there is no such labelled point"
    raise ConfigError(f"--point {text!r}: {problem}: {listed or 'the result has none'}")


# --- the strip --------------------------------------------------------------------------------------------------------


def _strip_files(branch: StoredBranch, options) -> dict[Path, bytes]:
    """Return the content of all files of --out."""
    from branches.export.mesh_files import encode, library

    endings = {name: Path(name).suffix.lower() for name in options.out}
    for ending in endings.values():
        if ending in SURFACES:
            library(ending)
    point, length = labelled_point(branch, options.point), options.length or branch.length
    if ".csv" in endings.values():
        (shape, strains), columns = branch.placed(point, length), {}
        for name, values in _fields(shape, strains).items():
            columns |= {name: values} if values.ndim == 1 else {f"{name}_{axis}": values[:, i] for i, axis in enumerate("xyz")}
            columns |= dict(zip("xyz", shape.centreline.T)) if name == "s" else {}
        table = _csv(columns)
    if any(ending in SURFACES for ending in endings.values()):
        shape, strains = branch.placed(point, length, _CELLS)
        mesh, fields = _mesh(branch, shape, length, options), _fields(shape, strains)
    return {Path(name): table if end == ".csv" else encode(mesh, end, fields) for name, end in endings.items()}


def _fields(shape: Shape, strains) -> dict[str, ndarray]:
    """Return the values at the nodes of the centreline that VTK files hold."""
    import numpy as np

    from branches.draw.structure import parts_of

    parts = parts_of(shape)
    directors = np.concatenate([part.directors for part in parts])
    strips = np.repeat(np.arange(1, len(parts) + 1), [len(part.arclength) for part in parts])
    fields = {"strip": strips} if len(parts) > 1 else {}
    fields |= {"s": np.concatenate([part.arclength for part in parts])}
    fields |= {f"d{i + 1}": directors[:, i] for i in range(3)}
    return fields | {f"omega_{i + 1}": strains[:, i] for i in range(3)}


def _csv(columns: dict[str, ndarray]) -> bytes:
    """Return columns as comma-separated values with a line of names, numbers with all their digits."""
    rows = zip(*(column.tolist() for column in columns.values()))
    return ("\n".join([",".join(columns), *(",".join(map(str, row)) for row in rows)]) + "\n").encode()


def _mesh(branch: StoredBranch, shape: Shape, length: float, options):
    from branches.draw.solid import thickest, widest
    from branches.draw.strip import ROOM, WIDTH
    from branches.draw.structure import meshed, parts_of
    from branches.scene.fields import ConfigError

    width, most = options.width, min(map(widest, parts_of(shape)))
    if width is None:
        width = branch.width_at(length, options.thickness)
        whose = "the scene's" if width is not None else "the default"
        width = min(WIDTH / (2 * math.pi) * length, ROOM * most) if width is None else width
        write_output(f"width {width:.6g}: {whose}; change it with --width\n")
    if width > length:
        raise ConfigError(f"--width {width:g}: must not exceed the length, {length:g}")
    if width >= most:
        raise ConfigError(f"--width {width:g}: must be below {most:.6g}, where generators of the surface begin to cross")
    most = min(width, *(thickest(part, width) for part in parts_of(shape)))
    if options.thickness is not None and options.thickness >= most:
        raise ConfigError(
            f"--thickness {options.thickness:g}: must be below {most:.6g}, the width or twice the smallest radius of curvature"
        )
    return meshed(shape, width, options.thickness)


if __name__ == "__main__":
    sys.exit(interrupt.run(main))
