"""``python -m branches.strip --width ...``: the states of a closed strip of given dimensions, in SI units."""

from __future__ import annotations

from branches.store import interrupt

if __name__ == "__main__":  # before the imports below, which take a second
    interrupt.begin(interrupt.NO_FILES)

import math
import sys
from collections.abc import Sequence
from pathlib import Path

from branches.scene.units import STRIP_UNITS
from branches.store.command import Parser, Quantity, answered, write_output
from branches.store.files import check_picture
from branches.strip.states import MOST_COVERINGS
from ribbon_model.strip import Strip

_HELP = {"": "Poisson's ratio", "Pa": "Pa, or with a unit as in 210GPa", "m": "m, or with a unit as in 5mm"}


def parser() -> Parser:
    """Return the command line."""
    parser = Parser(
        "strip",
        "A strip whose ends are joined: which circles are stable, what else there is, moments, energies, strains. Numbers are "
        "in SI units, or have a unit.",
    )
    for name, unit in STRIP_UNITS.items():
        closed = name == "natural_radius"
        parser.add_argument(
            f"--{name.replace('_', '-')}", type=Quantity(unit), required=not closed, metavar="X",
            help=f"{_HELP[unit]}{'; inf for a straight strip; of closed strips only' if closed else ''}",
        )  # fmt: skip
    parser.add_argument(
        "--distance", type=Quantity("m"), metavar="X", help="of the ends of an open strip: an arch, pushed until it snaps"
    )
    parser.add_argument("--ends", choices=("clamped", "hinged"), help="how they are held (default: clamped)")
    parser.add_argument("--push-at", type=float, metavar="PART", help="where it is pushed, over its length (default: 0.5)")
    parser.add_argument("--yield-strain", type=Quantity(""), metavar="X", help="mark states with a larger strain, as in 0.2%%")
    parser.add_argument(
        "--want", type=Quantity("J"), metavar="J", help="which dimensions give a stable loop with a barrier of J, or 5mJ"
    )
    parser.add_argument("--chart", metavar="FILE", help="draw the barrier over width and natural curvature (.png, .pdf, .svg)")
    parser.add_argument("--turns", type=int, metavar="M", help="turns of the loop of --want and --chart, odd (default 3)")
    parser.add_argument("--quiet", action="store_true", help="show no line of progress")
    return parser


@answered(ValueError)
def main(argv: Sequence[str] | None = None) -> int:
    """Print the answer; return the exit code: 0, or 2 for an invalid strip."""
    options = vars(parser().parse_args(argv))
    names = ("yield_strain", "want", "chart", "turns", "quiet", "distance", "ends", "push_at")
    asked = {name: options.pop(name) for name in names}
    try:
        _check(asked, options["natural_radius"])
        strip = Strip(**(options if asked["distance"] is None else options | {"natural_radius": math.inf}))
    except ValueError as error:
        name, _, what = str(error).partition(":")
        raise ValueError(f"--{name.replace('_', '-')}:{what}") from error
    _answer(strip, asked)
    return 0


def _check(asked: dict, natural_radius: float | None) -> None:
    """Raise for an option that cannot be used."""
    closed = asked["distance"] is None
    for name in ("ends", "push_at") if closed else ("want", "chart", "turns"):
        if asked[name] is not None:
            raise ValueError(f"{name}: is of {'open' if closed else 'closed'} strips; a strip with a distance is open")
    if closed == (natural_radius is None):
        raise ValueError("natural_radius: a closed strip needs it (inf if it is straight), one with a distance has none")
    for name in ("yield_strain", "want"):
        if asked[name] is not None and not 0 < asked[name] < math.inf:
            raise ValueError(f"{name}: {asked[name]:g} must be positive and finite")
    if asked["push_at"] is not None and not 0 < asked["push_at"] < 1:
        raise ValueError(f"push_at: {asked['push_at']:g} must be above 0 and below 1")
    turns = asked["turns"]
    if turns is not None and not (turns % 2 and 1 <= turns <= MOST_COVERINGS):
        raise ValueError(f"turns: {turns} must be odd, from 1 to {MOST_COVERINGS}: a loop cannot be folded into others")
    if turns is not None and asked["want"] is None and asked["chart"] is None:
        raise ValueError("turns: it belongs to --want or --chart, and neither is given")
    if asked["chart"] is not None:
        check_picture(Path(asked["chart"]), "--chart")


def _answer(strip: Strip, asked: dict) -> None:
    from branches.run.blas import one_thread
    from branches.strip import report  # .5 s: not for a mistake in the dimensions

    turns, quiet = asked["turns"] or 3, asked["quiet"]
    with one_thread():
        if asked["distance"] is not None:
            from branches.strip.arch import answer

            write_output(answer(strip, asked["distance"], asked["ends"], asked["push_at"], asked["yield_strain"]))
        elif asked["want"] is None and asked["chart"] is None:
            write_output(report.answer(strip, asked["yield_strain"], quiet))
        if asked["want"] is not None:
            write_output(report.dimensions(strip, turns, asked["want"], quiet))
        if asked["chart"] is not None:
            report.chart(strip, turns, Path(asked["chart"]), quiet)
            write_output(f"written to {asked['chart']}\n")


if __name__ == "__main__":
    sys.exit(interrupt.run(main))
