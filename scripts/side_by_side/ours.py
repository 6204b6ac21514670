"""contin's side of one demo: its labelled points, and processor times of a first run and of further ones."""

from __future__ import annotations

import functools
import statistics
import sys
import time
from collections.abc import Callable

from contin import MeshControl, Newton, Settings
from side_by_side.all_demos import DEMOS
from side_by_side.compare import of_contin
from side_by_side.record import Demo

#: Modules whose results are kept between runs: those of the bank and of this package.
KEEPERS = "bank", "side_by_side", "cycles"


#: Seconds after which a demo is not repeated. The longest demo takes two minutes; ten times more makes the page take an hour.
PATIENCE = 3.0


def forget() -> None:
    """Drop all results that are kept, so that a second run computes everything again, recordings included."""
    for name, module in list(sys.modules.items()):
        if name.split(".")[0] in KEEPERS:
            for member in list(vars(module).values()):
                clear = getattr(member, "cache_clear", None)
                if clear is not None:
                    clear()


def take_autos_tolerances() -> None:
    """Let this process run all demos with tolerances as those of AUTO's, and compute no errors of labelled points.

    EPSL and EPSU are 1e-6 to 1e-8 there. AUTO's meshes have fixed numbers of intervals: its points are off by 1e-7 (median) to
    1e-5, and so this tolerance of meshes is no stricter than what the demos are run with.
    """
    for kind, name, value in ((Newton, "tolerance", 1e-7), (MeshControl, "tolerance", 1e-5), (Settings, "errors", False)):
        kind.__init__ = _made_with(kind.__init__, name, value)


def take_path_tolerance() -> None:
    """Let this process run all demos with points between labelled ones, which are not compared, about as exact as AUTO's."""
    Settings.__init__ = _made_with(Settings.__init__, "path_tolerance", 1e-6)


def _made_with(init: Callable[..., None], name: str, value: object) -> Callable[..., None]:
    """Return what makes settings with one of their values, whatever a demo states of it."""

    @functools.wraps(init)  # one function, not a new one each time: what contin knows of its arguments is kept
    def made(settings: object, *given: object, **named: object) -> None:
        init(settings, *given, **named)
        object.__setattr__(settings, name, value)

    return made


def branches(demo: Demo) -> list:
    """Return what contin computes for each part of a demo."""
    return [part.branches() for part in demo.parts]


def run(name: str, repeats: int, checked: bool) -> dict:
    """Return the points of a demo, and processor seconds of what contin computes; the comparison is not in them.

    ``first`` are those of this process up to the end of its first run, ``again`` those of a further run: the median of at most
    ``repeats``, and of the first run itself where it takes long, or for 0.
    """
    (demo,) = [demo for demo in DEMOS if demo.name == name]
    forget()
    loaded = time.process_time()
    found = branches(demo)
    first = time.process_time()
    further = [] if repeats and first < PATIENCE else [first - loaded]
    while len(further) < repeats and sum(further) < PATIENCE:
        forget()
        began = time.process_time()
        branches(demo)
        further.append(time.process_time() - began)
    points = [of_contin(each, part, checked) for each, part in zip(found, demo.parts)]
    return {"points": points, "first": first, "again": statistics.median(further)}
