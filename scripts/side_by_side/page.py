"""The tables of docs/auto.md."""

from __future__ import annotations

import math
import statistics
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from side_by_side.compare import Row, gap, nearest, rows, verdict
from side_by_side.record import Demo

#: What is generated stands between these two lines of the page.
BEGIN, END = "<!-- scripts/demos.py writes from here -->", "<!-- to here -->"


def compared(demo: Demo, auto: dict | None, ours: dict) -> list[list[Row]]:
    """Return the rows of each part of a demo; none if contin failed or AUTO's runs are not known."""
    if auto is None or "failed" in ours:
        return []
    return [
        rows(auto["runs"], auto["fine"], points, part) for part, points in zip(demo.parts, ours["points"])
    ]  # fmt: skip


def line(demo: Demo, auto: dict | None, ours: dict) -> str:
    """Return the result of one demo in a line, for the terminal."""
    if "failed" in ours:
        return f"{demo.name}: contin failed: {ours['failed']}"
    counts = Counter(verdict(row) for part in compared(demo, auto, ours) for row in part)
    again = f"contin {ours['again']:.2f} s, with AUTO's tolerances {as_auto_of(ours)}"
    seconds = f"{again}, first {ours['first']:.1f} s, AUTO {seconds_of(demo, auto):.2f} s"
    return f"{demo.name}: {', '.join(f'{count} {words}' for words, count in counts.items())}; {seconds}"


def seconds_of(demo: Demo, auto: dict | None) -> float:
    """Return the processor seconds of AUTO's runs up to the last one that is compared."""
    if auto is None:
        return math.nan
    last = max(number for part in demo.parts for number in part.runs)
    return sum(run["seconds"] for run in auto["runs"][: last + 1])


def as_auto_of(ours: dict) -> str:
    """Return the processor seconds of contin with AUTO's tolerances, as text."""
    found = ours["as_auto"]
    return "failed" if "failed" in found else f"{found['again']:.2f}"


def off(demo: Demo, auto: dict | None, ours: dict) -> list[tuple[float, float]]:
    """Return how far AUTO's points and those of contin with AUTO's tolerances are off, relative to max(1, |value|).

    They are compared with contin's at its own tolerances, where both programs have the point and a third method is on the side
    of contin, or all are equal. Infinity is a point that contin has no more.
    """
    found = []
    for part, pairs, coarse in zip(demo.parts, compared(demo, auto, ours), ours["as_auto"].get("points", ())):
        for row in pairs:
            if row.auto and row.contin and group(verdict(row)) in ("equal", "contin"):
                again = nearest(coarse, row.label, row.contin, part.near)
                found.append((gap(row.auto, row.contin), gap(again["values"], row.contin) if again else math.inf))
    return found


def number(values: Sequence[float] | None, which: int, digits: int = 10) -> str:
    """Return a number as text, a dash for none."""
    if values is None or math.isnan(values[which]):
        return "–"
    text = f"{values[which]:.{digits}g}"
    return "0" if float(text) == 0 else text


def table(demo: Demo, parts: Sequence[Sequence[Row]]) -> list[str]:
    """Return the table of a demo."""
    lines = ["| | column | AUTO | AUTO, finer | contin | ± | third | right |", "|---|---|---|---|---|---|---|---|"]
    for part, found in zip(demo.parts, parts):
        names = list(part.columns)
        for row in found:
            which = row.shown
            error = "" if row.error is None or which else f"{row.error:.0e}"
            cells = [
                row.label, names[which], number(row.auto, which), number(row.fine, which), number(row.contin, which, 12), error,
                number(row.third, which, 12) if row.is_known else "", verdict(row),
            ]  # fmt: skip
            lines.append("| " + " | ".join(cells) + " |")
    return lines


def group(words: str) -> str:
    """Return the column of the summary in which a verdict counts."""
    if words == "equal":
        return "equal"
    if words.startswith("AUTO only"):
        return "AUTO only"
    if words in ("contin only", "not asked for in AUTO's run"):
        return "contin only"
    return "contin" if words.startswith("contin") else "AUTO" if words.startswith("AUTO") else "open"


HEADINGS = (
    "demo", "", "points", "equal", "contin closer", "AUTO closer", "not decided", "only AUTO", "only contin", "AUTO, s",
    "contin, s", "as AUTO, s", "first, s", "AUTO off", "contin as AUTO off",
)  # fmt: skip
GROUPS = "equal", "contin", "AUTO", "open", "AUTO only", "contin only"


def medians(pairs: Sequence[tuple[float, float]]) -> list[str]:
    """Return the medians of the first and of the second numbers of pairs, as text."""
    return [f"{statistics.median(side):.0e}" for side in zip(*pairs)] or ["", ""]


def summary(demos: Sequence[Demo], auto: dict, ours: dict) -> list[str]:
    """Return the table of all demos that are compared."""
    lines = [
        f"| {' | '.join(HEADINGS)} |",
        "|---" * len(HEADINGS) + "|",
    ]
    total: Counter = Counter()
    sums, apart = np.zeros(3), []
    for demo in demos:
        if not demo.parts or demo.name not in ours:
            continue
        found = ours[demo.name]
        if "failed" in found:
            lines.append(f"| {demo.name} | {demo.title} | contin failed: {found['failed']} |" + " |" * (len(HEADINGS) - 3))
            continue
        words = [verdict(row) for part in compared(demo, auto.get(demo.name), found) for row in part]
        counts = Counter(map(group, words))
        total.update(counts)
        cells = [f"[{demo.name}](#{demo.name})", demo.title, str(len(words)), *(str(counts[name] or "") for name in GROUPS)]
        auto_seconds = seconds_of(demo, auto.get(demo.name))
        distances = off(demo, auto.get(demo.name), found)
        apart += distances
        times = [f"{auto_seconds:.2f}", f"{found['again']:.2f}", as_auto_of(found), f"{found['first']:.1f}"]
        sums += auto_seconds, found["again"], found["as_auto"].get("again", math.nan)
        lines.append("| " + " | ".join(cells + times + medians(distances)) + " |")
    cells = ["", "all", str(sum(total.values())), *(str(total[name] or "") for name in GROUPS)]
    cells += [*(f"{seconds:.1f}" for seconds in sums), "", *medians(apart)]
    return [*lines, "| " + " | ".join(cells) + " |"]


def sections(demos: Sequence[Demo], auto: dict, ours: dict) -> list[str]:
    """Return a section for every demo that is compared."""
    lines = []
    for demo in demos:
        if demo.parts and demo.name in ours:
            lines += [f"### {demo.name}", "", f"{demo.title[0].upper()}{demo.title[1:]}. {demo.note}".strip(), ""]
            found = compared(demo, auto.get(demo.name), ours[demo.name])
            lines += [*table(demo, found), ""] if any(found) else []
    return lines


def others(demos: Sequence[Demo]) -> list[str]:
    """Return the table of the demos that are not compared, with the reason."""
    lines = ["| demo | | why it is not compared |", "|---|---|---|"]
    return lines + [f"| {demo.name} | {demo.title} | {demo.note} |" for demo in demos if not demo.parts]


def write(path: Path, demos: Sequence[Demo], auto: dict, ours: dict) -> None:
    """Put all tables between the markers of a page."""
    text = path.read_text(encoding="utf-8")
    before, after = text.split(BEGIN)[0], text.split(END)[1]
    body = [
        "## All in one table", "", *summary(demos, auto, ours), "", "## Not compared", "", *others(demos), "",
        "## Label by label", "", *sections(demos, auto, ours),
    ]  # fmt: skip
    path.write_text(before + BEGIN + "\n\n" + "\n".join(body) + "\n" + END + after, encoding="utf-8")
