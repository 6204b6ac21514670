"""What `branches.strip` prints of a closed strip: its law, states, stability and barriers, with cautions.

It also answers the inverse question, which dimensions give a stable loop of m turns with a given barrier, and draws a chart of
barriers.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np
from scipy.optimize import brentq

from branches.run.display import Progress
from branches.scene.units import STRIP_UNITS, unusual
from branches.store.files import write_picture
from branches.strip.states import State, at_natural_curvatures, buckled, by_hand, circle_name, circles, ways_out
from contin.lowlevel import Colour
from ribbon_model import linear, stability
from ribbon_model.barriers import Barrier, Folding
from ribbon_model.laws import FINITE_WIDTH, FLAT_ROD, RIBBON
from ribbon_model.strip import Strip

#: Largest difference of thresholds for which a limit law holds, and largest ratio that counts as small.
_AGREES, _SMALL = 0.01, 0.1


# --- the law ----------------------------------------------------------------------------------------------------------


def deviations(strip: Strip) -> dict[str, float]:
    """Return the largest difference between the thresholds n = m +- 1 of a limit law and the strip's, over |threshold| + m."""
    result = {}
    for law in (FLAT_ROD, RIBBON):
        worst = 0.0
        for m, n in ((1, 2), (3, 2), (3, 4), (5, 4), (5, 6)):
            try:
                own = linear.thresholds(FINITE_WIDTH, m, n, strip.parameters)[0]
                worst = max(worst, abs(linear.thresholds(law, m, n, strip.poisson_ratio)[0] - own) / (abs(own) + m))
            except ValueError:  # a bifurcation that one of them does not have
                worst = math.inf
        result[law.name] = worst
    return result


def _law(strip: Strip) -> str:
    off = deviations(strip)
    nearer = min(off, key=off.get)
    others = ", ".join(
        f"{name} {100 * value:.2g} %" if value < math.inf else f"{name}: not all exist" for name, value in off.items()
    )
    name = nearer if off[nearer] <= _AGREES else "finite width, between flat rod and ribbon"
    return f"{name} (thresholds against the law of finite width: {others})"


# --- the answer -------------------------------------------------------------------------------------------------------


def answer(strip: Strip, yield_strain: float | None = None, quiet: bool = True) -> str:
    """Return what the command prints, one screen; unless ``quiet``, a line of progress is shown meanwhile."""
    rings = circles(strip)
    others, folds, lost = buckled(strip, quiet)
    states = [*rings, *others]
    barriers = ways_out(states, quiet)
    foldings = by_hand(strip, states, barriers, quiet)
    lines = [
        f"Gamma = w^2/(h L/2pi) = {strip.Gamma:.4g}, natural curvature kappa_n L/2pi = {strip.kappa_n:.4g}",
        f"law: {_law(strip)}",
        *assumptions(strip, rings, yield_strain),
        "",
        f"{'circle  radius mm  stable for natural radii (mm)':57s}  {'here':14s}  moment N m   energy J  strain",
        *(f"{ring.m:6d}  {_radii(strip, ring.m)}  {_numbers(ring, yield_strain)}" for ring in rings),
        *(
            f"{name}, where its stable state ends: natural radius {1e3 * strip.radius(value):.4g} mm"
            for name, value in folds[:1]
        ),
        "",
        *_buckled_lines(others, yield_strain),
        *lost_lines(lost),
        *_fate(rings, [state for state in others if state.stable]),
        "",
        *_ways_out([state for state in states if state.stable], barriers),
        *_by_hand(strip, foldings),
    ]
    return "\n".join(lines) + "\n"


def assumptions(strip: Strip, rings: list[State], yield_strain: float | None = None) -> Iterator[str]:
    """Yield a caution for each assumption that fails, or whose error is not small, with its size."""
    yield from (f"caution: {one}" for one in unusual({name: getattr(strip, name) for name in STRIP_UNITS}))
    if strip.torsion_excess > _SMALL / 2:
        ratio, excess = strip.thickness / strip.width, 100 * strip.torsion_excess
        yield f"caution: h/w = {ratio:.3g} is not thin: a plate's torsional stiffness is too large by about {excess:.0f} %"
    wide = [ring for ring in rings if strip.width / strip.radius(ring.m) > _SMALL]
    if wide:
        ratio, more = strip.width / strip.radius(wide[0].m), " and more with more turns" if len(wide) > 1 else ""
        yield f"caution: not slender: w over the radius is {ratio:.2g} on the {wide[0].name}{more}; errors of that order"
    if yield_strain is not None:
        beyond = [ring.name for ring in rings if ring.strain > yield_strain]
        if beyond:
            yield f"caution: strains beyond the yield strain {yield_strain:g} (marked !): {', '.join(beyond)}"


def _radii(strip: Strip, m: int) -> str:
    """Return the radius of the m-fold circle, and the natural radii for which it is stable."""
    low, high = (m * end for end in linear.energy_interval(FINITE_WIDTH, m, strip.parameters))
    least = "0" if high == math.inf else f"{1e3 * strip.radius(high):.4g}"
    reverse = "" if low == -math.inf else f" over {-1e3 * strip.radius(low):.4g}"
    natural = f"over {least}, straight, reversed{reverse}" if low < 0 else f"over {least}, straight"
    if low > 0:
        natural = f"{least} ... {1e3 * strip.radius(low):.4g}"
    return f"{1e3 * strip.radius(m):9.1f}  {natural:38s}"


def _numbers(state: State, yield_strain) -> str:
    kind = "undecided" if math.isnan(state.index) else "stable" if state.stable else f"unstable, {state.index:g}"
    mark = " !" if yield_strain is not None and state.strain > yield_strain else ""
    return f"{kind:14s}  {state.moment:10.4g} {state.energy:10.4g}  {state.strain:7.3%}{mark}"


def _buckled_lines(others: list[State], yield_strain) -> Iterator[str]:
    rest = [state for state in others if state.index > 0]
    for state in others:
        if state not in rest:  # stable, or not decided
            yield f"{state.name:57s}  {_numbers(state, yield_strain)}"
    if rest:
        names = ", ".join(state.name.removeprefix("buckled ") for state in rest)
        yield f"{len(rest)} unstable buckled states here: {names}"


def lost_lines(modes: list[tuple[int, int]]) -> Iterator[str]:
    """Yield the branches that were not followed."""
    if modes:
        names = ", ".join(str(mode) for mode in modes)
        yield f"not followed, because the law has two bendings for the moment where they begin: {names}"


def _fate(rings: list[State], stable_others: list[State]) -> Iterator[str]:
    """Yield whether the single loop is stable, and the stable states of less energy; the ways there are not computed."""
    single = rings[0]
    below = [state for state in (*rings[1:], *stable_others) if state.stable and state.energy < single.energy]
    below.sort(key=lambda state: state.energy)
    ends = ", ".join(f"{state.name} ({single.energy - state.energy:.3g} J less)" for state in below) or "nothing found here"
    if below or not single.stable:
        yield f"the single loop is {'stable' if single.stable else 'unstable'}; stable states of less energy: {ends}"
    else:
        yield "the single loop is stable, and nothing stable has less energy"


def _ways_out(stable: list[State], barriers: Mapping[str, Barrier]) -> Iterator[str]:
    """Yield the energy that each stable state must be given before it leaves, and what it gives back on the way down."""
    energies = {state.name: state.energy for state in stable}
    yield f"{'to leave':18s}  {'push J':>10s}  over the saddle   falls into             released J"
    for state in stable:
        way = barriers.get(state.name)
        if way is None:
            yield f"{state.name:18s}  no saddle beside it was found on the primary branches"
            continue
        behind = "a state not listed here" if way.behind is None else way.behind
        released = "" if way.behind is None else f"{state.energy + way.height - energies[way.behind]:10.4g}"
        yield f"{state.name:18s}  {way.height:10.4g}  {way.saddle:16s}  {behind:23s}{released}".rstrip()


def _by_hand(strip: Strip, foldings: Mapping[str, Folding]) -> Iterator[str]:
    """Yield the couples that take circles to their saddles."""
    if foldings:
        yield ""
        yield "by hand, two opposite points turned against each other about the line between them:"
    for name, path in foldings.items():
        couple, angle, end = path.couples[path.peak] * strip.moment_unit, path.angles[path.peak], path.angles[-1]
        yield (
            f"{name:18s}  {couple:10.4g} N m at most, at {math.degrees(angle):.0f} degrees; "
            f"beyond {math.degrees(end):.0f} degrees it goes on by itself"
        )


#: Dimensions that are varied, one at a time, from a fifth of the given value to five times it, at so many places.
VARIED = ("natural_radius", "width", "thickness")
_RANGE, _PLACES = 5.0, 21
#: Relative error to which a dimension is determined.
_PRECISION = 1e-5
#: The chart: values of Gamma; parts of the stable interval of kappa_n, cut where it is longer, over m.
_GAMMAS, _PARTS = np.geomspace(0.05, 100.0, 13), np.linspace(0.002, 0.998, 22)
_LONGEST = (-1.0, 2.5)


def barriers_at(m: int, kappas: Sequence[float], parameters: Mapping[str, float]) -> np.ndarray:
    """Return the barrier of the m-fold circle at natural curvatures (K,), over 2 pi B 2 pi/L; nan where it is not stable.

    It is that of the lowest state of index 1 on the primary branches (m, m - 1) and (m, m + 1), which lead to the circles of
    m - 2 and m + 2 turns; nan where there is none, too.
    """
    lowest = np.full(len(kappas), np.nan)
    for n in (m - 1, m + 1):
        if n < 1:
            continue
        for point, equilibrium in at_natural_curvatures(m, n, kappas, parameters):
            at = int(np.argmin(np.abs(np.asarray(kappas) - point["kappa_n"])))
            if stability.index(equilibrium).index == 1:
                lowest[at] = np.fmin(lowest[at], point["energy"])
    for at, kappa_n in enumerate(kappas):
        stable = linear.index(FINITE_WIDTH, m, kappa_n, parameters) == 0
        lowest[at] -= linear.circle(FINITE_WIDTH, m, kappa_n, parameters)["energy"] if stable else math.nan
    return lowest


def barrier(strip: Strip, m: int) -> float:
    """Return the barrier in J of the loop of m turns; nan where it is not stable, or no saddle was found."""
    return float(barriers_at(m, [strip.kappa_n], strip.parameters)[0]) * strip.energy_unit


# --- dimensions for a barrier -----------------------------------------------------------------------------------------


def dimensions(strip: Strip, m: int, wanted: float, quiet: bool = True) -> str:
    """Return, for each dimension, its values for which the loop of m turns has the ``wanted`` barrier (J), as text."""
    lines = [f"for a stable {circle_name(m)} with a barrier of {wanted:g} J, change one dimension:"]
    with Progress("dimensions", len(VARIED), quiet) as progress:
        for name in progress.each(VARIED, lambda name: name.replace("_", " ")):
            lines.append(_line(strip, name, m, wanted))
    return "\n".join(lines) + "\n"


def _line(strip: Strip, name: str, m: int, wanted: float) -> str:
    middle = getattr(strip, name)
    if not math.isfinite(middle):  # a straight strip: radii from that of the loop on
        middle = strip.radius(1.0) * _RANGE
    places = middle * np.geomspace(1 / _RANGE, _RANGE, _PLACES)
    values = np.array([_changed(strip, name, float(place), m) for place in places])  # nan: not stable, or no such strip
    found = [
        brentq(lambda value: _changed(strip, name, value, m) - wanted, a, b, rtol=_PRECISION)
        for a, b, low, high in zip(places, places[1:], values, values[1:]) if (low - wanted) * (high - wanted) <= 0
    ]  # fmt: skip
    title = f"  {name.replace('_', ' '):15s}"
    if found:
        return title + " or ".join(f"{1e3 * value:.4g} mm" for value in found)
    none = f"{title}none between {1e3 * places[0]:.4g} and {1e3 * places[-1]:.4g} mm"
    if np.all(np.isnan(values)):
        return f"{none}: it is not stable there"
    best = int(np.nanargmax(values))
    largest = f"{values[best]:.3g} J (at {1e3 * places[best]:.4g} mm)"
    return f"{none}; at the places tried the barrier lies between {np.nanmin(values):.3g} and {largest}"


def _changed(strip: Strip, name: str, value: float, m: int) -> float:
    try:
        return barrier(dataclasses.replace(strip, **{name: value}), m)
    except ValueError:  # wider than long, or thicker than wide
        return math.nan


# --- the chart --------------------------------------------------------------------------------------------------------


def chart(strip: Strip, m: int, out: Path, quiet: bool = True, Gammas=_GAMMAS, parts=_PARTS) -> None:
    """Draw the barrier of the m-fold circle over Gamma and parts of the stable interval, with the strip as a point in it.

    Raises StoreError where the picture cannot be written.
    """
    kappas, table = [], []
    with Progress("widths", len(Gammas), quiet) as progress:
        for Gamma in progress.each(Gammas, "Gamma = {:.3g}".format):
            parameters = strip.parameters | {"Gamma": float(Gamma)}
            low, high = np.clip(linear.energy_interval(FINITE_WIDTH, m, parameters), *_LONGEST)
            kappas.append(m * (low + (high - low) * parts))
            table.append(barriers_at(m, kappas[-1], parameters))
    write_picture(_figure(strip, m, Gammas, np.array(kappas), np.array(table)), out)


def _figure(strip: Strip, m: int, Gammas: np.ndarray, kappas: np.ndarray, table: np.ndarray):
    """Return the chart from kappa_n and barriers, shape (Gamma, part of the stable interval)."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.2, 5.0), layout="constrained")
    axes = figure.subplots()
    widths = np.repeat(Gammas[:, None], kappas.shape[1], axis=1)
    filled = axes.contourf(widths, kappas, table, levels=12, cmap="viridis")
    axes.contour(widths, kappas, table, levels=filled.levels, colors="white", linewidths=0.4)
    bar = figure.colorbar(filled, ax=axes)
    bar.set_label(f"barrier, in units of $4\\pi^2 B/L$, here {strip.energy_unit:.3g} J")
    for edge, style in ((-1, "--"), (0, "-")):
        axes.plot(Gammas, kappas[:, edge], style, color="black", label=("lower", "upper")[edge] + " end of stability")
    mark = {"marker": "o", "markersize": 8, "color": Colour.VERMILION, "markeredgecolor": "white", "linestyle": "none"}
    axes.plot(strip.Gamma, strip.kappa_n, label="this strip", **mark)
    axes.set_xscale("log")
    axes.margins(0.02, 0.08)
    axes.set_xlabel(r"$\Gamma = w^2/(h\,L/2\pi)$")
    axes.set_ylabel(r"natural curvature $\kappa_n L/2\pi$")
    axes.set_title(f"Energy that takes the {circle_name(m)} out of its stable state ($\\nu$ = {strip.poisson_ratio:g})")
    axes.legend(loc="upper right", fontsize=9)
    return figure
