"""Labelled points of cycles as AUTO-07p found them: ``auto_07p.json``, which ``auto_07p.py`` writes."""

import json
from pathlib import Path

NOTES = json.loads((Path(__file__).parent / "auto_07p.json").read_text())
#: AUTO-07p writes eleven digits; wanted agreement, relative to max(1, |value|).
TOLERANCE = 1e-8


def compare(branch, study, run, columns, beyond=()):
    """Assert that a branch has the labelled points that AUTO-07p found, in order, with the same values.

    ``columns`` names those of primary parameter, period (None: not compared) and mean square; ``beyond`` holds the places,
    among the labelled points of the branch, of those that AUTO-07p passes in silence.
    """
    known = NOTES[study][run]
    found = [point for point in branch.points[1:] if point.label]
    found = [point for place, point in enumerate(found) if place not in beyond]
    ends = {"UZ": "EP"}  # AUTO-07p labels the end of a run UZ where the user has set it
    labels = [row["label"] for row in known]
    assert [point.label for point in found] == [*labels[:-1], ends.get(labels[-1], labels[-1])], branch.stop
    assert not [point.name for point in found if "possible" in point.name]
    for point, row in zip(found, known):
        for name, key in zip(columns, ("parameter", "period", "square")):
            if name is not None:
                off = abs(point[name] - row[key]) / max(1.0, abs(row[key]))
                assert off <= TOLERANCE, (point.label, name, point[name], row[key])
