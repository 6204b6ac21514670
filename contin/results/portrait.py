"""Pictures of one point, drawn by matplotlib: its phase portrait, its states over time, its Floquet multipliers."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, cast

import numpy as np

from contin import errors as checks
from contin.arrays import Array
from contin.boundary.system import Collocation
from contin.cycles.floquet import floquet
from contin.errors import ProblemError
from contin.problems.angles import periods_of, whole_rounds
from contin.problems.statement import declared
from contin.results.marks import PALETTE, Axes, new_axes
from contin.results.record import Profile, Record, over_t

#: Places at which a solution is drawn, for each interval of its mesh: a polynomial of degree 8 looks smooth.
_PER_INTERVAL = 8
#: Fewest places at which a solution is drawn: the width of a small picture in points.
_FEWEST = 400
#: States in a picture over time: more cannot be told apart.
_MOST_STATES = len(PALETTE)
#: Powers of ten of the circles that are drawn beyond the unit circle, at most.
_MOST_RINGS = 6
#: What is said of a point of which there are no such pictures.
_OVER_T = "plot: the point must be a solution over t, of a BoundaryValueProblem or CycleProblem"


def plot(point: Record, what: str | None, states: Sequence[str] | None, axes: Axes | Array | None) -> Any:
    """Draw one point; see `contin.Point.plot`."""
    system = over_t(point, _OVER_T)
    drawings = _drawings(system)
    if what is not None and what not in drawings:
        raise ProblemError(f"what: {checks.shown(what)} must be one of {', '.join(drawings)}")
    names = _chosen(system, states)
    if what is not None:
        axes = new_axes() if axes is None else axes
        drawings[what](point, names, cast(Axes, axes))
        return axes
    if axes is None:
        axes = new_axes(len(drawings))
    given = list(np.ravel(np.asarray(axes, dtype=object)))
    if len(given) != len(drawings):
        raise ProblemError(f"axes: {len(given)} given, must be {len(drawings)}, or one with what = {', '.join(drawings)}")
    for draw, panel in zip(drawings.values(), given):
        draw(point, names, panel)
    return axes


def _drawings(system: Collocation) -> dict[str, Callable[[Record, tuple[str, ...], Axes], None]]:
    """Return the pictures that there are of a point, by name."""
    found: dict[str, Callable[[Record, tuple[str, ...], Axes], None]] = {}
    if len(_known(system)) > 1:
        found["portrait"] = _portrait
    found["series"] = _series
    if system.is_cycle:
        found["multipliers"] = _multipliers
    return found


def _chosen(system: Collocation, states: Sequence[str] | None) -> tuple[str, ...]:
    known = _known(system)
    if states is None:
        return known
    names = checks.names("states", states)
    for name in names:
        if name not in known:
            raise ProblemError(f"states: {checks.shown(name)} is no state; there are {', '.join(known)}")
    if len(names) < 2:
        raise ProblemError("states: there must be two at least")
    return names


def _known(system: Collocation) -> tuple[str, ...]:
    """Return the names of the states; of segments each name once, in order."""
    problem = system.problem
    if not declared(problem, "pieces"):
        return (*problem.state_names, *(declared(problem, "following") if system.is_cycle else ()))
    return tuple(dict.fromkeys(name for piece in problem.pieces for name in piece.names))


def _courses(point: Record, names: Sequence[str]) -> list[tuple[Array, Array]]:
    """Return times in the user's units (K,) and states (K, n) of each segment; a state that it does not have is NaN."""
    system = over_t(point, _OVER_T)
    problem = system.problem
    if not declared(problem, "pieces"):
        return [_course(point, names)]
    found = []
    for index in range(len(problem.pieces)):
        profile = Profile(point, index)
        s = profile.begin + (profile.end - profile.begin) * np.linspace(0, 1, max(_FEWEST, _PER_INTERVAL * system.intervals))
        states = profile(s)
        columns = [states[:, profile.names.index(name)] if name in profile.names else np.full(len(s), np.nan) for name in names]
        found.append((s, np.stack(columns, axis=1)))
    return found


def _course(point: Record, names: Sequence[str]) -> tuple[Array, Array]:
    """Return times in the user's units (K,), and states (K, n)."""
    system: Any = point.system
    a, b = system.problem.domain
    cycle = system.is_cycle
    once = np.unique(np.concatenate([np.linspace(a, b, max(_FEWEST, _PER_INTERVAL * system.intervals)), system.mesh]))
    t = np.unique(np.arange(system.order)[:, None] + once) if cycle else once
    which = [_known(system).index(name) for name in names]
    states = system.evaluate(point.x, t)
    if not cycle:
        return t, states[:, which]
    rotating = periods_of(system.problem) * (system.gains[-1] != 0)
    if declared(system.problem, "following"):
        following = system.following(point.x, t)
        states, rotating = np.hstack([states, following]), np.append(rotating, np.zeros(following.shape[1]))
    t, states, periods = t * system.unit_time(point.x), states[:, which], rotating[which]
    states = states - whole_rounds(states, periods)  # angles between minus and plus half of their period ...
    jumps = np.abs(np.diff(states, axis=0)) > np.where(periods > 0, periods / 2, np.inf)
    after = np.flatnonzero(jumps.any(axis=1))
    gaps = np.where(jumps[after], np.nan, states[after])  # ... with NaN where they jump back
    return np.insert(t, after + 1, t[after]), np.insert(states, after + 1, gaps, axis=0)


def _portrait(point: Record, names: tuple[str, ...], axes: Axes) -> None:
    """Draw the second state against the first, with an arrow in the sense of time; segments in colours of their own."""
    courses = _courses(point, names[:2])
    for index, (_, states) in enumerate(courses):
        x, y = states.T
        colour = PALETTE[index % len(PALETTE)]
        axes.plot(x, y, lw=1.5, color=colour, label=f"segment {index}")
        at = len(x) // 8
        at -= 2 * bool(np.isnan(x[at : at + 2] + y[at : at + 2]).any())  # beside the gap of an angle
        axes.annotate(
            "", xy=(x[at + 1], y[at + 1]), xytext=(x[at], y[at]),
            arrowprops={"arrowstyle": "-|>", "color": colour, "mutation_scale": 18, "shrinkA": 0, "shrinkB": 0},
        )  # fmt: skip
    if len(courses) > 1:
        axes.legend(frameon=False, ncols=min(len(courses), 4), loc="lower center", bbox_to_anchor=(0.5, 1.0))
    axes.margins(0.08)
    axes.set(xlabel=names[0], ylabel=names[1])


def _series(point: Record, names: tuple[str, ...], axes: Axes) -> None:
    """Draw the states over time; where segments meet there is a line."""
    names = names[:_MOST_STATES]
    courses = _courses(point, names)
    for index, (t, states) in enumerate(courses):
        for name, column, colour in zip(names, states.T, PALETTE):
            axes.plot(t, column, lw=1.5, color=colour, label=name if index == 0 else None)
        if index:
            axes.axvline(t[0], lw=0.6, ls=":", color="#666666", zorder=1)
    axes.margins(x=0)
    axes.set(xlabel="t" if len(courses) == 1 else "s")
    if len(names) > 1:
        axes.legend(frameon=False, ncols=min(len(names), 4), loc="lower center", bbox_to_anchor=(0.5, 1.0))
    else:
        axes.set(ylabel=names[0])


def _multipliers(point: Record, names: tuple[str, ...], axes: Axes) -> None:
    """Draw the Floquet multipliers and the unit circle; outside of it distances from 0 are 1 + log10 |multiplier|."""
    found = floquet(point.system, point.x, point.tangent)
    size = found.logarithms.real
    radius = np.where(size > 0, 1 + size / np.log(10), np.exp(np.minimum(size, 0)))
    places = radius * np.exp(1j * found.logarithms.imag)
    outside = size > 0
    if found.unstable < np.count_nonzero(outside):  # the multiplier that is 1 counts on no side
        outside[np.abs(found.logarithms).argmin()] = False
    rings = int(min(np.ceil(max(radius.max() - 1, 0)), _MOST_RINGS))
    angle = np.linspace(0, 2 * np.pi, 400)
    for ring in range(rings + 1):
        style: dict[str, Any] = {"lw": 0.6, "color": "#BBBBBB", "ls": ":"} if ring else {"lw": 1.0, "color": "#000000"}
        axes.plot((1 + ring) * np.cos(angle), (1 + ring) * np.sin(angle), zorder=1, **style)
        if ring:
            axes.annotate(f"$10^{ring}$", (0, 1 + ring), ha="center", va="center", fontsize=8, color="#666666",
                          bbox={"fc": "white", "ec": "none", "pad": 0.5})  # fmt: skip
    for which, colour, name in ((~outside, PALETTE[0], "not outside"), (outside, PALETTE[1], "outside")):
        if np.any(which):
            here = places[which]
            axes.scatter(here.real, here.imag, s=40, color=colour, zorder=2, label=f"{len(here)} {name}")
    width = 1.25 * max(1.0, min(radius.max(), 1 + _MOST_RINGS))
    axes.set(xlim=(-width, width), ylim=(-width, width), aspect="equal", xlabel="real part", ylabel="imaginary part")
    if rings:
        axes.set(xticks=[], yticks=[], xlabel="real part (logarithmic outside)")
    axes.legend(frameon=False, ncols=2, loc="lower center", bbox_to_anchor=(0.5, 1.0))
