"""Columns of a branch at its points, and on smooth curves between them, by cubics with its tangents.

They are drawn against each other by matplotlib, which is imported when it is asked for.
"""

from __future__ import annotations

import io
from collections.abc import Callable, Iterator, Sequence
from itertools import groupby, pairwise
from typing import Any

import numpy as np

from contin import errors as checks
from contin.arrays import Array
from contin.core.differences import derivative
from contin.core.labels import Label
from contin.core.trial import Trial
from contin.errors import ProblemError
from contin.events.labelled import finding_of
from contin.results.marks import Axes, Colour, heading, mark_of, new_axes
from contin.results.point import Point
from contin.text import COLUMNS, meant

#: Straight pieces in which a cubic is drawn. Tangents turn by about 20 degrees in a step at most, so the corners of the polygon
#: turn by one or two; with a quarter as many, corners are seen.
PARTS = 16


def hermite(first: Array, slope: Array, last_slope: Array, last: Array, u: Array) -> Array:
    """Return cubics at places u of the unit interval, from values and slopes at both ends.

    Examples
    --------
    >>> one = np.ones(1)
    >>> hermite(0 * one, 0 * one, 3 * one, one, np.array([0.5])).tolist()  # u**3
    [0.125]
    """
    chord = last - first
    return first + u * (slope + u * (3 * chord - 2 * slope - last_slope + u * (slope + last_slope - 2 * chord)))


def through(s: Array, values: Array, rates: Array, parts: int = PARTS) -> Array:
    """Return columns on cubics from each point to the next one, shape (c, (K - 1) parts + 1).

    A step with a tangent at one end only is a parabola, one with none a straight line: nothing is made up.

    Parameters
    ----------
    s : ndarray, shape (K,)
        Arclengths.
    values, rates : ndarray, shape (c, K)
        Columns, and their derivatives by the arclength; NaN where a derivative is not known.
    parts : int
        Pieces of a step.

    Examples
    --------
    >>> through(np.array([0.0, 1.0]), np.array([[0.0, 1.0]]), np.array([[0.0, np.nan]]), 2).tolist()  # s**2
    [[0.0, 0.25, 1.0]]
    """
    step, chord = np.diff(s), np.diff(values)
    first, last = rates[:, :-1] * step, rates[:, 1:] * step
    first = np.where(np.isnan(first), 2 * chord - last, first)
    last = np.where(np.isnan(last), 2 * chord - first, last)
    first, last = (np.where(np.isnan(slope), chord, slope)[..., None] for slope in (first, last))
    inside = hermite(values[:, :-1, None], first, last, values[:, 1:, None], np.arange(parts) / parts)
    return np.concatenate([inside.reshape(len(values), -1), values[:, -1:]], axis=1)


#: Labels of points at which a branch of cycles begins or ends with cycles that have shrunk onto others.
_SHRUNK = (Label.HOPF, Label.PERIOD_DOUBLING)


#: Columns that every branch has.
_OF_ALL = ("arclength", "norm", "discretization_error")


def column(points: Sequence[Point], name: str) -> Array:
    """Return a column of `contin.Branch.column` over all points."""
    if name in ("arclength", "discretization_error"):
        return np.array([getattr(point, name) for point in points])
    return np.array([value(point, name) for point in points])


def value(point: Point | Trial, name: str) -> float:
    """Return a parameter, functional, state of equilibria, its largest or smallest value, or the norm; or raise KeyError."""
    system = point.system
    states, extreme = system.named_states, name[:3]
    if name in (*system.problem.parameters, *system.problem.functionals, *states) or name not in ("norm", *_extremes(states)):
        return point[name]
    found = system.states(point.x)
    if name != "norm":
        return float(getattr(np, extreme)(found[:, states.index(name[4:])]))
    return float(np.sqrt(system.weights[: found.size] @ np.square(found).ravel()))


def _extremes(states: Sequence[str]) -> list[str]:
    """Return the columns of the largest and smallest values of states."""
    return [f"{extreme}_{state}" for state in states for extreme in ("max", "min")]


def curve(points: Sequence[Point], names: Sequence[str], parts: int = PARTS) -> Array:
    """Return columns of a branch on a smooth curve through its points, shape (c, (K - 1) parts + 1)."""
    s, values = column(points, "arclength"), np.array([column(points, name) for name in names])
    if len(points) < 2:
        return values
    rates = np.array([_rates(point, names) for point in points]).T
    for end in (0, -1):  # extremes of cycles have a corner where these shrink: their size is the distance, not negative behind
        if points[end].label in _SHRUNK and points[end].system.is_cycle:
            rates[:, end] = np.nan
    return through(s, values, rates, parts)


def _rates(point: Point, names: Sequence[str]) -> Array:
    """Return the derivatives of columns by the arclength of the branch at a point, NaN where they are not known."""
    tangent = next(iter(finding_of(point.details).leaving), point.tangent) if np.isnan(point.tangent).any() else point.tangent
    found = np.full(len(names), np.nan)
    if np.isnan(tangent).any():
        return found
    moving = [i for i, name in enumerate(names) if name not in ("arclength", "discretization_error")]

    def values(distance: float) -> Array:
        trial = Trial.without_tangent(point.system, point.x + distance * tangent)
        return np.array([value(trial, names[i]) for i in moving])

    if moving:
        found[moving] = derivative(values)[0]
    found[[i for i, name in enumerate(names) if name == "arclength"]] = 1.0
    return found


#: Labels of points where a multiplier of a cycle lies on the unit circle: what is next to them says which side is stable.
_CRITICAL = (Label.FOLD, Label.BRANCH_POINT, Label.PERIOD_DOUBLING, Label.TORUS, Label.HOPF)
#: Dashes and legend of pieces, by whether they are stable; None: not known, beside others of which it is known.
_LINES: dict[bool | None, tuple[Any, str]] = {
    True: ("-", "stable"),
    False: ((0, (3, 2)), "unstable"),
    None: ((0, (6, 2, 1, 2)), "stability not known"),
}
#: Words of axes for columns that every branch has.
_WORDS = {
    "norm": "norm (root mean square over t)", "arclength": "arclength of the branch",
    "discretization_error": "discretization error, relative to 1 + size",
}  # fmt: skip
#: A point with a larger estimated discretization error, relative to 1 + size, is crossed out: it would be seen in the picture.
_VISIBLE = 1e-3
#: Areas of the marks in points squared: a star needs a larger one to look as large.
_AREA = {"*": 90, "": 30}
#: Area of the dots at all points; those of unstable parts are open, as many dots in a row hide the dashes.
_DOT = 9
#: A click within this distance of a point, in points of the screen, is on it: as near as a hand aims.
_NEAR = 5


def plot(
    points: Sequence[Point], x: str | None = None, y: str | None = None, axes: Axes | None = None, errors: bool = False,
    color: str | None = None,
) -> Any:  # fmt: skip
    """Draw one column against another, with marks at labelled points; see `contin.Branch.plot`."""
    x, columns, name = _columns(points, x, y)
    axes = new_axes() if axes is None else axes
    from matplotlib.colors import is_color_like

    if color is not None and not is_color_like(color):
        raise ProblemError(f"color: {checks.shown(color)} must be one of matplotlib's, such as 'red' or '#0072B2'")
    pieces = list(_pieces(points))
    named: set[str | None] = set(axes.get_legend_handles_labels()[1])
    color = color or (Colour.GREEN if points[0].system.is_cycle else Colour.BLUE)
    for column_name in columns:
        named |= _draw(points, (x, column_name), pieces, named, (axes, color))
        if errors:
            across, up = (column(points, name) for name in (x, column_name))
            bars = [[error_bar(point, name) for point in points] for name in (x, column_name)]
            axes.errorbar(across, up, xerr=bars[0], yerr=bars[1], fmt="none", ecolor=Colour.GREY, capsize=2, zorder=1.2)
    across, up = axes.dataLim.intervalx, axes.dataLim.intervaly
    for shown, (low, high), limit in (([x], across, axes.set_xlim), (columns, up, axes.set_ylim)):
        size, error = max(abs(low), abs(high)), np.nanmax([0.0, *(error_bar(point, one) for point in points for one in shown)])
        if high - low <= 10 * error:  # what differs by its error only is a straight line
            half = size / 2 if size > 10 * error else 0.5
            limit((low + high) / 2 - half, (low + high) / 2 + half, auto=True)
    axes.set(xlabel=_WORDS.get(x, x), ylabel=_WORDS.get(name, name))
    if any(point.label for point in points) or named - {None}:
        axes.legend(frameon=False)
    return axes


def _draw(
    points: Sequence[Point], names: tuple[str, str], pieces: Sequence[tuple[bool | None, slice]], known: set[str | None],
    drawing: tuple[Axes, Any],
) -> set[str | None]:  # fmt: skip
    """Draw one column over another, and return the names for the legend; those that are ``known`` are not given again."""
    (across, up), (x, y) = (column(points, name) for name in names), curve(points, names)
    named: set[str | None] = set()
    axes, color = drawing
    kind = " cycles" * points[0].system.is_cycle

    def once(word: str | None) -> str | None:
        label = None if word in known | named else word or None
        named.add(word)
        return label

    filled = [True] * len(points)
    for stable, piece in pieces:
        filled[piece] = [stable is not False] * len(points[piece])
        dashes, word = _LINES[stable] if len(pieces) > 1 or stable is not None else ("-", "")
        fine = slice(piece.start * PARTS, (piece.stop - 1) * PARTS + 1)
        axes.plot(x[fine], y[fine], lw=1.5, color=color, ls=dashes, label=once(word and word + kind), zorder=1)
    style: dict[str, Any] = {"s": _DOT, "edgecolors": color, "linewidths": 0.8, "zorder": 0.9}
    fill = [color if full else "white" for full in filled]
    _tell(axes, axes.scatter(across, up, c=fill, picker=True, pickradius=_NEAR, **style), points)
    labels = [point.label for point in points]
    for label in dict.fromkeys(filter(None, labels)):
        here = [i for i, other in enumerate(labels) if other == label]
        marker, colour, word = mark_of(label)
        area = _AREA.get(marker, _AREA[""])
        word = f"{word} ({label})" if word else label
        axes.scatter(across[here], up[here], s=area, marker=marker, color=colour, label=once(word), zorder=2)
    doubtful = [i for i, point in enumerate(points) if point.discretization_error > _VISIBLE]
    if doubtful:
        meaning = f"discretization error above {_VISIBLE:g}"
        axes.scatter(across[doubtful], up[doubtful], s=30, marker="x", color=Colour.GREY, label=once(meaning), zorder=3)
    return named


def error_bar(point: Point, name: str) -> float:
    """Return the estimated error of a column: that of a labelled point, elsewhere the error of the whole solution.

    The latter is the sum of the errors of the mesh and of Newton's method, relative to 1 + size, for the size of the column.
    NaN where it is not known, or the column is none of the solution.
    """
    if name in point.errors:
        return point.errors[name]
    if name in ("arclength", "discretization_error"):
        return np.nan
    return (point.discretization_error + point.newton_error) * (1 + abs(float(column([point], name)[0])))


def _tell(axes: Axes, dots: Any, points: Sequence[Point]) -> None:
    """Show the label and the values of a point when it is clicked on, in a window or a notebook with a live picture."""
    box = axes.annotate(
        "", (0, 0), (12, 12), textcoords="offset points", fontsize="small", visible=False, zorder=5,
        bbox={"boxstyle": "round", "fc": "white", "ec": Colour.GREY}, arrowprops={"arrowstyle": "-", "color": Colour.GREY},
    )  # fmt: skip

    def show(event: Any) -> None:
        box.set_visible(event.artist is dots)
        if event.artist is dots:
            places = dots.get_offsets()
            away = axes.transData.transform(places[event.ind]) - (event.mouseevent.x, event.mouseevent.y)
            near = sorted(zip(np.hypot(*away.T).tolist(), event.ind.tolist()))
            number = min(near, key=lambda pair: not points[pair[1]].label)[1]  # of several the nearest, a labelled one first
            box.xy = tuple(places[number])
            box.set_text(said(points[number], number))
        axes.figure.canvas.draw_idle()

    axes.figure.canvas.mpl_connect("pick_event", show)


def said(point: Point, number: int) -> str:
    """Return the label and the columns of a point, with the errors that are known, a line each."""
    head = heading(point)
    lines = [f"point {number}{': ' * bool(head)}{head}"]
    columns = {**point.parameters, **point.functionals}
    for name, value in list(columns.items())[:COLUMNS]:
        error = point.errors.get(name, np.nan)
        lines.append(f"{name} = {value:.10g}" + (f" ± {error:.0e}" if np.isfinite(error) else ""))
    lines += ["..."] * (len(columns) > COLUMNS)
    return "\n".join(lines + [f"index {point.index}"] * (point.index is not None))


def _pieces(points: Sequence[Point]) -> Iterator[tuple[bool | None, slice]]:
    """Cut a branch where its stability changes; without any index, there is one piece.

    Yields whether the energy has a minimum on the piece (None where no point has an index, or the ends of a step disagree), and
    the points of the piece; its ends belong to the pieces beside it too.
    """
    moving = bool(points) and points[0].system.unstable(points[0].x) is not None
    if len(points) < 2 or (not moving and all(point.index is None for point in points)):
        yield None, slice(0, len(points))
        return
    first = 0
    for stable, steps in groupby(_of_motions(points) if moving else map(_stable, *zip(*pairwise(points)))):
        last = first + len(list(steps))
        yield stable, slice(first, last + 1)
        first = last


def _of_motions(points: Sequence[Point]) -> list[bool | None]:
    """Return whether the cycles, or the equilibria, between two points are stable, for each step.

    The regular point at one end decides; between two special points, the step before.
    """
    counts = [unstable(point) for point in points]
    found: list[bool | None] = []
    for a, b in pairwise(counts):
        count = b if a is None else a
        found.append((found[-1] if found else None) if count is None else count == 0)
    return found


def unstable(point: Point) -> int | None:
    """Return the number of unstable eigenvalues of an equilibrium, or multipliers of a cycle; None where it is not known."""
    return None if point.label in _CRITICAL else point.system.unstable(point.x)


def _stable(a: Point, b: Point) -> bool | None:
    """Return whether the states between two points are stable; at special points, the index beside them counts."""
    beside = [point.index for point in (a, b) if not point.nullity]
    beside += [a.index_change[1]] if a.nullity and a.index_change else []
    beside += [b.index_change[0]] if b.nullity and b.index_change else []
    found = {index == 0 for index in beside if index is not None}
    return found.pop() if len(found) == 1 else None


def picture(draw: Callable[[Axes], Any]) -> str:
    """Return what a function draws into axes as SVG, or nothing where matplotlib is not installed."""
    try:
        from matplotlib import rc_context
        from matplotlib.figure import Figure
    except ImportError:
        return ""
    text = io.StringIO()
    with rc_context({"svg.hashsalt": "contin"}):  # the same picture gives the same file
        figure = Figure(figsize=(4.5, 2.8), layout="constrained")
        axes = figure.subplots()
        draw(axes)
        axes.locator_params(axis="x", nbins=6)  # numbers of more ticks touch each other in so small a picture
        figure.savefig(text, format="svg", metadata={"Date": None})
    return text.getvalue()[text.getvalue().index("<svg") :]


def _columns(points: Sequence[Point], x: str | None, y: str | None) -> tuple[str, list[str], str]:
    """Return the names of the columns to draw and of the second axis, with the defaults of `plot`."""
    if not points:
        raise ProblemError("the branch has no points to draw")
    first = points[0]
    x = first.system.free[0] if x is None else x
    states = first.system.problem.states if first.system.is_cycle and first.system.intervals else ()
    y = next(iter((*states, *first.functionals, *first.system.named_states, "norm"))) if y is None else y
    check_column(points, "x", x, states)
    if y in states:
        return x, [f"max_{y}", f"min_{y}"], f"{y}, largest and smallest"
    check_column(points, "y", y, states)
    return x, [y], y


def check_column(points: Sequence[Point], argument: str, name: str, further: Sequence[str] = ()) -> None:
    """Check that a name is that of a column; ``further`` are listed with the columns where it is not.

    Raises ProblemError where there are no points, or there is no such column.
    """
    if not points:
        raise ProblemError("the branch has no points to draw")
    first = points[0]
    known = [*first.parameters, *first.functionals, *_OF_ALL, *first.system.named_states]
    if name not in (*known, *_extremes(first.system.named_states)):
        raise ProblemError(
            f"{argument}: {checks.shown(name)} is no column{meant(name, known)}; there are {', '.join((*known, *further))}"
        )
