"""What a stable state snaps to past its limit, beside what the experiments of Audoly & Seffen (2015), section 2, saw."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

from branches.paper.page import Row, Section, keep, new_figure
from branches.run.blas import one_thread
from ribbon_model.descent import KICK, METRICS, PAST, SEGMENTS, Rest, let_go, past
from ribbon_model.laws import FLAT_ROD, ISOTROPIC_ROD, RIBBON, Law
from ribbon_model.linear import energy_interval
from ribbon_model.second_variation import circle
from ribbon_model.segments import Strip, discretized
from ribbon_model.solution import Solution

NU = 0.3
#: (law, covering index, +1 for the upper end of its stable interval) -> what the experiments saw: Table 1 and section 2.
SEEN = {
    ("ribbon", 3, -1): "single loop (below κₙr₀ = 0.28)",
    ("ribbon", 5, -1): "three loops (below κₙr₀ = 0.42)",
    ("ribbon", 7, -1): "five loops (not measured)",
    ("ribbon", 3, 1): "not reached; 'into five loops' surmised",
}
#: Ends of stable pieces of branches: (m, n), label, which of the points with that label, side, what the experiments saw.
BUCKLED = {
    RIBBON: ((1, 2, "LP", 0, 1, "three loops (above κₙr₀ = 3.50)"), (3, 4, "LP", 0, 1)),
    ISOTROPIC_ROD: ((3, 1, "SB", -2, 1), (3, 1, "SB", -1, -1)),  # the last two: a stable piece lies between them
}


@dataclass(frozen=True)
class Start:
    """A state at the end of its stability, let go at ``kappa_n`` past the limit.

    ``m`` is the covering index of the circle, or of the one that the ``buckled`` state comes from.
    """

    what: str
    m: int
    limit: float
    kappa_n: float
    strip: Strip
    published: str
    buckled: bool


def snaps(folder: Path) -> Section:
    """The table 'from, at kappa_n, snaps to', and the shapes on the way of three of them."""
    rows, films = [], []
    with one_thread():
        for start in _starts():
            signs = (1, -1) if start.buckled else (1,)  # on a circle one is a shift of the other
            runs = [(metric, sign, *let_go(start.strip, metric, sign)) for metric in METRICS for sign in signs]
            rows.append(_row(start, runs))
            if "κₙr₀" in start.published:  # an experiment gave a number
                films.append((start, runs[0][2]))
    notes = [
        f"Each state is taken {PAST:.0%} of (1 + |limit|) past its limit. Its lowest mode is excited by {KICK} (root mean "
        "square of the strains; with both signs for a buckled state, on a circle the other sign is the same up to a shift), "
        "and waves without any symmetry by a tenth of that. Then it follows its energy downhill, closed all the way.",
        f"In two metrics, {' and '.join(METRICS)} (friction in the strains; drag on the moving strip). Where all ends are one, "
        "the table has one. There is no inertia here: a strip that overshoots may come to rest elsewhere.",
        f"{SEGMENTS} segments on the way down; the end is solved anew by collocation on the whole loop and compared with the "
        "exact quadrature of the primary branches. Its index is 0 in every line.",
        "No contact, no friction: strips pass through themselves, as everywhere here. The experiments had them, and gravity.",
    ]
    return Section("What it snaps to past the limits of stability, ν = .3", rows, [_draw(films, folder)], notes)


# --- where they start -------------------------------------------------------------------------------------------------


def _starts() -> Iterator[Start]:
    for law in (RIBBON, FLAT_ROD, ISOTROPIC_ROD):
        for m in (1, 3, 5, 7):
            for side, limit in zip((-1, 1), energy_interval(law, m, NU)):
                if math.isfinite(limit) and (m, side) != (7, 1):  # that leads beyond what the paper draws
                    at = past(m * limit, side)
                    strip = discretized(circle(law, NU, m, at), SEGMENTS)
                    seen = SEEN.get((law.name, m, side), "")
                    yield Start(f"{law.name}: {m}-covered circle", m, m * limit, at, strip, seen, False)
        yield from (_buckled(law, *where) for where in BUCKLED.get(law, ()))


def _buckled(law: Law, m: int, n: int, label: str, at: int, side: int, seen: str = "") -> Start:
    """The state at a labelled point of a primary branch, with kappa_n moved on."""
    from branches.scene.index import SymmetryWatch
    from contin import Settings, trace
    from contin.lowlevel import point_of
    from ribbon_model.seeds import primary_branch

    system, x, tangent = primary_branch(law, m, n, NU, 8, 7)
    monitors = SymmetryWatch(law, system, x).monitors if label == "SB" else ()
    settings = Settings(trivial="M2", limits={"kappa_n": (-60, 60)}, events=monitors)
    point = trace(point_of(system, x), settings, tangent=tangent, progress=False).labelled(label)[at]
    strip = discretized(Solution.of(point).equilibrium(), SEGMENTS)
    kappa_n = past(point["kappa_n"], side)
    strip = replace(strip, kappa_n=kappa_n)
    return Start(f"{law.name}: buckled ({m}, {n})", m, point["kappa_n"], kappa_n, strip, seen, True)


# --- where they end ---------------------------------------------------------------------------------------------------


def _row(start: Start, runs) -> Row:
    """The end if it is one; every end with its metric and sign otherwise."""
    ends = {f"{metric}, {'+' if sign > 0 else '-'}": (descent, rest) for metric, sign, descent, rest in runs}
    names = {way: _named(start, rest) for way, (_, rest) in ends.items()}
    one = len(set(names.values())) == 1
    descent, rest = next(iter(ends.values()))
    ours = next(iter(names.values())) if one else "; ".join(f"{name} ({way})" for way, name in names.items())
    fall = descent.energies[0] - rest.energy
    remark = f"κ̄* {descent.strips[0].kappa_star:.3f} → {rest.kappa_star:.6f}, energy falls by {fall:.4f}"
    if rest.n:
        remark += f"; from the quadrature by {max(found.difference for _, found in ends.values()):.0e}"
    slack = max(found.slack for found, _ in ends.values())
    if slack:
        remark += f"; on up to {slack} segments the energy was not strictly convex on the way"
    ratio = f"κₙr₀ = {start.limit / start.m:.3f}"
    what = f"{start.what}, limit κₙL/2π = {start.limit:.4f} ({ratio}), let go at {start.kappa_n:.4f}"
    return Row(what, start.published, ours, remark)


def _named(start: Start, rest: Rest) -> str:
    """A branch that begins at the very circle that was let go is entered continuously; everything else is a snap."""
    continuous = rest.n and not start.buckled and start.m in (rest.m, 2 * rest.n - rest.m)
    return f"{'goes over into' if continuous else 'snaps to'} {'the ' if not rest.n else ''}{rest}"


# --- the picture ------------------------------------------------------------------------------------------------------


def _draw(films, folder: Path, frames: int = 6) -> str:
    """The strips on their way, at equal distances in the strains; the experiments' single loop first."""
    from branches.draw.solid import widest
    from branches.draw.strip import ROOM, draw_strip, reach_of
    from branches.draw.style import in_words

    films = sorted(films, key=lambda film: film[0].m)
    figure = new_figure(2 * frames, 2.3 * len(films))
    for line, (start, descent) in zip(figure.subfigures(len(films), 1, squeeze=False)[:, 0], films):
        line.suptitle(f"{start.what}, let go at $\\kappa_n L/2\\pi$ = {in_words(f'{start.kappa_n:.3f}')}", fontsize=12)
        shown = descent.frames(frames)
        shapes = [strip.shape(241).placed(2 * math.pi) for strip in shown]
        width = min(0.25 / start.m, *(ROOM * widest(shape) for shape in shapes))  # a circle of m turns has the radius 1/m
        reach = reach_of(shapes, width)
        for axes, strip, shape in zip(line.subplots(1, frames), shown, shapes):
            draw_strip(axes, shape, width, reach)
            axes.set_title(in_words(f"energy {strip.energy:.3f}"), fontsize=10, y=0.95)
    return keep(figure, folder, "snaps")
