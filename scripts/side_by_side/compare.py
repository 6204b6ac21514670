"""Labelled points of AUTO and of contin in pairs, and which of two different values is right."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass

from contin import Branch, Point
from side_by_side.multipliers import distance
from side_by_side.record import Column, Part

#: Values that differ less, relative to max(1, |value|), are equal: below it AUTO's files have no digits (eleven are written).
EQUAL = 1e-9
#: Points of two branches of contin that differ less, relative to max(1, |value|), are one: both are good to about 1e-10.
SAME = 1e-7
#: A finer run of AUTO decides if it lies this many times closer to one of the values than to the other.
CLEARLY = 4.0


@dataclass
class Row:
    """One labelled point: values by AUTO, by AUTO on a finer mesh, by contin with its error, and by a third method."""

    label: str
    auto: list[float] | None = None
    fine: list[float] | None = None
    contin: list[float] | None = None
    error: float | None = None
    third: list[float] | None = None
    asked: bool = True
    check: float | None = None

    @property
    def shown(self) -> int:
        """Which column is shown: of those that are not given, and that a third method has, the one of largest difference."""
        values = self.contin or self.fine or self.auto
        found = [which for which, each in enumerate(values) if not math.isnan(each)]
        if self.label == "UZ":
            found = [which for which in found if not is_given(values[which])] or found
        found = [which for which in found if self.third and not math.isnan(self.third[which])] or found
        if self.auto is None or self.contin is None:
            return found[0]
        return max(found, key=lambda which: gap(self.auto[which : which + 1], self.contin[which : which + 1]))

    @property
    def is_known(self) -> bool:
        """Whether the third method has the column that is shown."""
        return self.third is not None and not math.isnan(self.third[self.shown])


def is_given(value: float) -> bool:
    """Return whether a value has few digits, as those have that a run is told to stop at."""
    return abs(value - float(f"{value:.4g}")) < 1e-7 * max(1.0, abs(value))


def gap(a: Sequence[float], b: Sequence[float]) -> float:
    """Return the largest difference of two points, relative to max(1, |value|). Unknown values (NaN) count as equal."""
    pairs = [(x, y) for x, y in zip(a, b) if not (math.isnan(x) or math.isnan(y))]
    return max((abs(x - y) / max(1.0, abs(y)) for x, y in pairs), default=0.0)


def value(point: Point, column: Column) -> float:
    """Return a column of a point of contin; NaN where it has none."""
    if callable(column):
        return float(column(point))
    return float(point.details["frequency"] if column == "frequency" else point[column])


def of_contin(branches: Sequence[Branch], part: Part, checked: bool) -> list[dict]:
    """Return contin's labelled points, the first of each branch left out; an end counts as a point with a given value.

    Where they are ``checked``, SciPy computes the multipliers of cycles, too: of poor ones its integration does not end.
    """
    found = []
    for branch in branches:
        for point in branch.points[1:]:
            last = point is branch.points[-1]
            label = "UZ" if point.label == "EP" and last else part.also.get(point.label, point.label)
            if not label:
                continue
            first = next(iter(part.columns.values()))
            error = point.errors.get(first) if isinstance(first, str) else None
            values = [value(point, column) for column in part.columns.values()]
            check = distance(point) if checked else None
            found.append({"label": label, "values": values, "error": error, "end": last, "check": check})
    return found


def of_auto(runs: Sequence[dict], part: Part) -> list[dict]:
    """Return AUTO's labelled points of the runs of a part."""
    found = []
    for number in part.runs:
        if number >= len(runs):
            continue
        for point in runs[number]["points"]:
            if point["label"] in part.labels:
                values = [point["values"].get(column, math.nan) for column in part.columns]
                found.append({"label": point["label"], "values": values})
    return found


def nearest(points: Sequence[dict], label: str, values: Sequence[float], near: float) -> dict | None:
    """Return the nearest point with a label, None if none is near."""
    ones = [point for point in points if point["label"] == label and gap(values, point["values"]) < near]
    return min(ones, key=lambda point: gap(values, point["values"]), default=None)


def was_asked(run: dict, label: str) -> bool:
    """Return whether the constants of a run made AUTO look for a label."""
    constants = run["constants"]
    # AUTO's defaults, which some demos leave out of their constants: ISP = 2, ILP = 1
    kinds, folds = int(constants["ISP"] or 2), int(constants["ILP"] or 1)
    if label == "LP":
        return folds > 0
    if label in ("PD", "TR"):
        return kinds > 0
    if label == "BP" and constants["IPS"] not in ("1", "0", "-1", "5", "17"):
        return kinds >= 2
    return kinds > 0


def rows(runs: Sequence[dict], fine: Sequence[dict], ours: Sequence[dict], part: Part) -> list[Row]:
    """Return all points that AUTO or contin labelled, in pairs. Points of contin outside of AUTO's runs are left out."""
    theirs, finer, left = of_auto(runs, part), of_auto(fine, part), [dict(point) for point in ours]
    known = [{"label": label, "values": [values.get(c, math.nan) for c in part.columns]} for label, values in part.known]
    found = []
    for point in theirs:
        pair = nearest(left, point["label"], point["values"], part.near)
        if pair is None:  # a point that two of AUTO's runs meet
            pair = nearest(ours, point["label"], point["values"], part.near)
            if pair is not None:
                continue
        else:
            left = [other for other in left if other is not pair]
        best = pair["values"] if pair else point["values"]
        other = nearest(finer, point["label"], best, part.near)
        third = nearest(known, point["label"], best, part.near)
        found.append(Row(
            point["label"], point["values"], other and other["values"], pair and pair["values"],
            pair and pair["error"], third and third["values"], True, pair and pair.get("check"),
        ))  # fmt: skip
    for point in left:
        if any(row.contin and row.label == point["label"] and gap(row.contin, point["values"]) < SAME for row in found):
            continue  # two of contin's branches meet it
        inside = [run for number in part.runs if number < len(runs) for run in [runs[number]] if covers(run, point, part)]
        if point["end"] or point["label"] not in part.labels or point["label"] == "UZ" or not inside:
            continue
        other, third = (nearest(ones, point["label"], point["values"], part.near) for ones in (finer, known))
        found.append(Row(
            point["label"], None, other and other["values"], point["values"], point["error"], third and third["values"],
            any(was_asked(run, point["label"]) for run in inside), point.get("check"),
        ))  # fmt: skip
    return found


def covers(run: dict, point: dict, part: Part) -> bool:
    """Return whether a point lies between the labelled points of a run, in every column of theirs."""
    for column, value_ in zip(part.columns, point["values"]):
        values = [each["values"].get(column, math.nan) for each in run["points"]]
        values = [each for each in values if not math.isnan(each)]
        if values and not min(values) - part.near <= value_ <= max(values) + part.near:
            return False
    return True


#: A multiplier this close to its critical value, by SciPy at a point of contin, confirms that point. On the cycles of ``tor``
#: the distances were 1e-11 at the period 8, 2e-6 at 29 and 5e-5 at 39; ten times less leaves the last open.
CRITICAL = 1e-4

#: A multiplier this close to its critical value decides for contin where AUTO's point differs by more, relative to
#: max(1, |value|). At the fold of ``tor`` of period 13.9119 the distance is 1e-7 at contin's point, and 0.03 at AUTO's.
EXACT = 1e-6


def verdict(row: Row) -> str:
    """Return which value of a point is right, in a few words."""
    if row.contin is None:
        if row.fine is None:
            return "AUTO only; not on its finer mesh"
        return "AUTO only"
    if row.auto is None:
        if not row.asked:
            return "not asked for in AUTO's run"
        if row.is_known:
            return "contin: known"
        if row.fine is not None:
            return "contin: so AUTO, finer"
        return "contin only" if row.check is None or row.check > CRITICAL else "contin: multipliers by SciPy"
    if gap(row.auto, row.contin) <= EQUAL:
        return "equal"
    if row.is_known:
        ours, theirs = gap(row.contin, row.third), gap(row.auto, row.third)
        return "equal" if ours == theirs else "contin: known" if ours < theirs else "AUTO: known"
    if row.check is not None and row.check < EXACT < gap(row.auto, row.contin):
        return "contin: multipliers by SciPy"
    if row.fine is not None and gap(row.auto, row.fine) > 0:
        ours, theirs = gap(row.contin, row.fine), gap(row.auto, row.fine)
        if CLEARLY * ours < theirs:
            return "contin: so AUTO, finer"
        if CLEARLY * theirs < ours:
            return "AUTO: so AUTO, finer"
    return "not decided"


def as_json(row: Row) -> dict:
    """Return a row as plain values."""
    return asdict(row)
