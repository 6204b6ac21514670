"""The inverse question: which dimensions give a stable loop of m turns with a given barrier; and a chart of barriers."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np
from scipy.optimize import brentq

from branches.run.display import Progress
from branches.store.files import write_picture
from branches.strip.states import at_natural_curvatures, circle_name
from contin.lowlevel import Colour
from ribbon_model import linear, stability
from ribbon_model.laws import FINITE_WIDTH
from ribbon_model.strip import Strip

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


def answer(strip: Strip, m: int, wanted: float, quiet: bool = True) -> str:
    """Return, for each dimension, its values for which the loop of m turns has the ``wanted`` barrier (J), as text."""
    lines = [f"for a stable {circle_name(m)} with a barrier of {wanted:g} J, change one dimension:"]
    with Progress("dimensions", len(VARIED), quiet) as progress:
        for name in VARIED:
            progress.part(name.replace("_", " "))
            lines.append(_line(strip, name, m, wanted))
            progress.part_done()
    return "\n".join(lines) + "\n"


def _line(strip: Strip, name: str, m: int, wanted: float) -> str:
    places, values = _scan(strip, name, m)
    found = list(_solutions(strip, name, m, wanted, places, values))
    title = f"  {name.replace('_', ' '):15s}"
    if found:
        return title + " or ".join(f"{1e3 * value:.4g} mm" for value in found)
    if np.all(np.isnan(values)):
        return title + f"none between {1e3 * places[0]:.4g} and {1e3 * places[-1]:.4g} mm: it is not stable there"
    best = int(np.nanargmax(values))
    return title + (
        f"none between {1e3 * places[0]:.4g} and {1e3 * places[-1]:.4g} mm; at the places tried the barrier lies between "
        f"{np.nanmin(values):.3g} and {values[best]:.3g} J (at {1e3 * places[best]:.4g} mm)"
    )


def _scan(strip: Strip, name: str, m: int) -> tuple[np.ndarray, np.ndarray]:
    """Return places of one dimension around its value, and the barriers there (nan: not stable, or no such strip)."""
    middle = getattr(strip, name)
    if not math.isfinite(middle):  # a straight strip: radii from that of the loop on
        middle = strip.radius(1.0) * _RANGE
    places = middle * np.geomspace(1 / _RANGE, _RANGE, _PLACES)
    return places, np.array([_changed(strip, name, float(place), m) for place in places])


def _changed(strip: Strip, name: str, value: float, m: int) -> float:
    try:
        return barrier(dataclasses.replace(strip, **{name: value}), m)
    except ValueError:  # wider than long, or thicker than wide
        return math.nan


def _solutions(strip: Strip, name: str, m: int, wanted: float, places, values) -> Iterator[float]:
    for (a, b), (low, high) in zip(zip(places, places[1:]), zip(values, values[1:])):
        if (low - wanted) * (high - wanted) <= 0:
            yield brentq(lambda value: _changed(strip, name, value, m) - wanted, a, b, rtol=_PRECISION)


# --- the chart --------------------------------------------------------------------------------------------------------


def chart(strip: Strip, m: int, out: Path, quiet: bool = True, Gammas=_GAMMAS, parts=_PARTS) -> None:
    """Draw the barrier of the m-fold circle over Gamma and parts of the stable interval, with the strip as a point in it.

    Raises
    ------
    StoreError
        The picture cannot be written.
    """
    kappas, table = [], []
    with Progress("widths", len(Gammas), quiet) as progress:
        for Gamma in Gammas:
            progress.part(f"Gamma = {Gamma:.3g}")
            parameters = strip.parameters | {"Gamma": float(Gamma)}
            low, high = np.clip(linear.energy_interval(FINITE_WIDTH, m, parameters), *_LONGEST)
            kappas.append(m * (low + (high - low) * parts))
            table.append(barriers_at(m, kappas[-1], parameters))
            progress.part_done()
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
