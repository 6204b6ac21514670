"""Labelled points of cycles as AUTO-07p found them (``auto_07p.json``, by ``auto_07p.py``), and checks of a branch."""

import json
from pathlib import Path

import numpy as np

NOTES = json.loads((Path(__file__).parent / "auto_07p.json").read_text())
#: AUTO-07p writes eleven digits; wanted agreement, relative to max(1, |value|).
TOLERANCE = 1e-8


#: By how much the number of unstable multipliers changes at a special point.
CHANGES = {"LP": 1, "BP": 1, "PD": 1, "TR": 2}


def compare(branch, study, run, columns, beyond=(), shrinks=False):
    """Assert that a branch has the labelled points that AUTO-07p found, in order, with the same values.

    ``columns`` names those of primary parameter, period and mean square, None where they are not compared; ``beyond`` holds the
    places, among the labelled points of the branch, of those that AUTO-07p passes in silence. A branch that ``shrinks`` ends at
    a Hopf point, which AUTO-07p misplaces.
    """
    known = NOTES[study][run]
    found = [point for point in branch.points[1:] if point.label]
    found = [point for place, point in enumerate(found) if place not in beyond]
    labels = [row["label"] for row in known[:-1]] + ["HB" if shrinks else "EP"]
    assert [point.label for point in found] == labels, branch.stop
    assert not [point.name for point in found if "possible" in point.name]
    for point, row in list(zip(found, known))[: len(found) - shrinks]:
        for name, key in zip(columns, ("parameter", "period", "square")):
            if name is not None:
                off = abs(point[name] - row[key]) / max(1.0, abs(row[key]))
                assert off <= TOLERANCE, (point.label, name, point[name], row[key])


def check_unstable(branch):
    """Assert that the number of unstable multipliers changes at special points only, and there by what their kind says."""
    counts = [
        point.floquet().unstable if not point.label or point.label in ("EP", "UZ") else None for point in branch.points[1:]
    ]
    last, allowed = None, 0
    for point, count in zip(branch.points[1:], counts):
        if count is None:
            allowed += CHANGES.get(point.label, 0)
            continue
        if last is not None:
            assert abs(count - last) <= allowed and (count - last - allowed) % 2 == 0, (point.parameters, last, count)
        last, allowed = count, 0


def worst_trivial(branch):
    """The largest distance of the multiplier 1 from 1 over the points where no other is near: with another, it is a root."""
    worst = 0.0
    for point in branch.points[1:]:
        first, *others = np.sort(np.abs(point.system.eigenvalues(point.x)))
        if others[0] > 1e-2:
            worst = max(worst, first)
    return worst
