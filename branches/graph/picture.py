"""The bifurcation diagram (Fig. 12a of Audoly & Seffen 2015) as a picture: in (kappa_n, kappa*), and disentangled."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import groupby

import numpy as np

from branches.draw.picture import check_measured, draw_measured
from branches.draw.style import CONJUGATE, LINES, NATURAL, NU, OTHER, area, colour_of, in_words, narrowed, points, smooth
from branches.graph import disentangle as layered
from branches.graph.closed import families, pieces, secondaries
from branches.graph.names import name_lines
from branches.scene.closed import and_nu
from branches.scene.labels import END, MARKS
from contin.lowlevel import levels

STABLE, UNSTABLE = "#000000", "#8a8a8a"
#: The part of kappa_n that pictures of the diagram show at most, and the margin around special points, relative to their range.
WINDOW, _MARGIN = (-8.0, 14.0), 0.1
#: Letters of an entry of the legend beyond which there are three columns, not five.
_LONG = 30
#: Bifurcations of one circle closer than this part of the window are one blob; of so many there is an inset, with a margin
#: around them as a part of their range.
_BLOB, _MANY, _AROUND = 0.01, 3, 0.3
#: Heights below the lowest circle that make room for an inset.
_BELOW = 3.8
#: Sizes of an inset, the first for which there is room, as parts of the panel; the room for the numbers left of it and below;
#: and the step of the search for a place.
_INSETS, _NUMBERS, _SEARCH = ((0.5, 0.21), (0.36, 0.16), (0.3, 0.12)), (0.07, 0.06), 0.02
#: Colour of secondary branches, which have no wavenumber.
_NO_WAVE = "#000000"
#: Largest step in kappa_n of what is drawn, far less than the diagrams' 22.
_STEP = 0.05
#: Parts into which a step is cut at most, and a circle, whose kappa* is no straight line if the law is not linear.
_PARTS = 200
#: Widths of branches in a diagram, by whether they are stable; None: not known.
_WIDTHS = {True: 3.4, False: 1.4, None: 1.4}
#: How circles are drawn.
_CIRCLES: dict[str, dict] = {
    "unstable": {"color": UNSTABLE, "lw": 0.9, "ls": LINES[False][0]},
    "published": {"color": UNSTABLE, "lw": 2.6, "solid_capstyle": "butt"},
    "stable": {"color": STABLE, "lw": 2.6, "solid_capstyle": "butt"},
}


@dataclass(frozen=True)
class Mark:
    """A special point of a branch: where it is in (kappa_n, kappa*), its kind, why a branch ends there; its circle's index."""

    kappa_n: float
    kappa_star: float
    kind: str
    covering: int | None
    what: str = ""


@dataclass(frozen=True)
class Line:
    """A branch to draw; one between two circles begins at that of the lower covering index.

    Attributes
    ----------
    name : str
        "(m, n)"; empty for a secondary branch.
    n : int
        Wavenumber; 0 for a secondary branch.
    kappa_n, kappa_star : ndarray, shape (K,)
        From end to end.
    index : ndarray of int, shape (K,)
        -1 where it is not known.
    marks : list of Mark
        Its special points, from end to end.
    """

    name: str
    n: int
    kappa_n: np.ndarray
    kappa_star: np.ndarray
    index: np.ndarray
    marks: list[Mark]

    def place(self, mark: Mark) -> int:
        """The number of the point that is nearest to a mark."""
        return int(np.argmin((self.kappa_n - mark.kappa_n) ** 2 + (self.kappa_star - mark.kappa_star) ** 2))

    def parts(self):
        """Where it is stable, unstable and unknown: True, False or None, and the points, which neighbours share an end of."""
        known = [None if index < 0 else index == 0 for index in self.index.tolist()]
        first = 0
        for stable, run in groupby(known):
            last = first + len(list(run))
            yield stable, slice(first, last + 1)
            first = last


def figure(graph, law: str, nu: float, window=None, disentangle: bool = True, size: float | None = None, measured=None):
    """Return the diagram of one law and nu as a matplotlib figure.

    Parameters
    ----------
    graph : networkx.MultiGraph
        As of `branches.graph.closed`.
    window : (float, float), optional
        Of kappa_n; by default `WINDOW`, or the part of it in which the special points are.
    disentangle : bool
        Add the panel where the heights between the circles are free (`branches.graph.disentangle`).
    size : float, optional
        Width in inches; by default 13, or 7.5 of one panel.
    measured : mapping of str to ndarray, optional
        Measured points: ``kappa_n`` and ``kappa_star`` (`branches.draw.picture.draw_measured`).
    """
    usual, measured = 13 if disentangle else 7.5, check_measured(measured or {}, [("kappa_n", "kappa_star")])
    with narrowed((size or usual) / usual):
        return _figure(graph, law, nu, window or _window(graph, law, nu), disentangle, size or usual, measured)


def _figure(graph, law: str, nu: float, window, disentangle: bool, wide: float, measured):
    from matplotlib.figure import Figure

    found = lines(graph, law, nu)
    result = Figure(figsize=(wide, points(7.4)), layout="constrained")
    panels = result.subplots(1, 2 if disentangle else 1, sharex=True, squeeze=False)[0]
    conjugate(panels[0], graph, law, nu, window)
    panels[0].set_ylabel(CONJUGATE, fontsize=points(13))
    drawn = [[line.kappa_star for line in found]]
    if disentangle:
        panels[0].set_title("in conjugate coordinates", fontsize=points(13))
        drawn.append(schematic(panels[1], graph, law, nu, window))
        panels[1].set_ylabel("covering index of the circles (heights between: free)", fontsize=points(13))
        panels[1].set_title("disentangled", fontsize=points(13))
    for axes in panels:
        axes.set_xlabel(NATURAL, fontsize=points(13))
        axes.tick_params(labelsize=points(12))
    draw_measured(panels[0], measured, "kappa_n", "kappa_star")
    handles = [*legend(graph, law, nu, window), *panels[0].get_legend_handles_labels()[0]]
    columns = 3 if max(len(handle.get_label()) for handle in handles) > _LONG else 5
    style = {"ncols": columns if disentangle else 2, "frameon": False, "fontsize": points(12)}
    result.legend(handles=handles, loc="outside lower center", **style)
    title = f"Equilibria of a closed strip: {law}{in_words(and_nu(law, nu, NU))}{note(graph)}"
    result.suptitle(title, fontsize=points(15), wrap=True)
    blob = _blob(found, window)
    if blob:  # below the lowest circle there is room
        panels[0].set_ylim(bottom=panels[0].get_ylim()[0] - _BELOW)
    result.draw_without_rendering()  # pixels of lines are known from here on
    result.set_layout_engine("none")
    taken = [_inset(panels[0], graph, law, nu, found, blob)] if blob else []
    for axes, heights in zip(panels, drawn):
        _name(axes, found, heights, _coverings(graph, law, nu), [box for box in taken if box is not None and axes is panels[0]])
    return result


def _window(graph, law: str, nu: float) -> tuple[float, float]:
    """The part of `WINDOW` in which the special points are, and where a circle is stable by the published theory alone."""
    there = [data["kappa_n"] for _, data in graph.nodes(data=True)
             if (data["law"], data["nu"]) == (law, nu) and data["kind"] in MARKS]  # fmt: skip
    there += [end for m in _coverings(graph, law, nu) if m > 0 for end in _published_only(law, nu, m)]
    there = [kappa_n for kappa_n in there if WINDOW[0] < kappa_n < WINDOW[1]] or list(WINDOW)
    margin = _MARGIN * (max(there) - min(there)) or 1.0
    return max(WINDOW[0], min(there) - margin), min(WINDOW[1], max(there) + margin)


def _name(axes, found: list[Line], heights, coverings, taken) -> list[str]:
    """Write the names of the primary lines, on each part of them that is seen; return those for which there is no room."""
    named, obstacles = [], [(np.array(axes.get_xlim()), np.array([m, m])) for m in coverings]
    for line, height in zip(found, heights):
        seen = _within(line.kappa_n, axes.get_xlim()) & _within(height, axes.get_ylim())
        changes = np.flatnonzero(np.diff(np.concatenate([[False], seen, [False]]).astype(int)))
        for part in map(slice, changes[::2], changes[1::2]):
            (named if line.name else obstacles).append((line.name, line.kappa_n[part], height[part])[0 if line.name else 1 :])
        marks = [line.place(mark) for mark in line.marks if mark.kind in MARKS]
        obstacles += [(line.kappa_n[[place]], height[[place]]) for place in marks if seen[place]]
    return name_lines(axes, named, obstacles, taken)


def _within(values, ends):
    return (values >= ends[0]) & (values <= ends[1])


# --- an inset ---------------------------------------------------------------------------------------------------------


def _blob(found: list[Line], window) -> list[Mark]:
    """The most bifurcations of one circle inside the window that marks make one blob of; none if they are few."""
    near = _BLOB * (window[1] - window[0])
    blobs: list[list[Mark]] = [[]]
    marks = [mark for line in found for mark in line.marks if mark.kind == "circle" and _within(mark.kappa_n, window)]
    for mark in sorted(marks, key=lambda mark: (mark.covering, mark.kappa_n)):
        last = blobs[-1][-1] if blobs[-1] else mark
        if mark.covering != last.covering or mark.kappa_n - last.kappa_n > near:
            blobs.append([])
        blobs[-1].append(mark)
    most = max(blobs, key=len)
    return most if len(most) >= _MANY else []


def _inset(axes, graph, law: str, nu: float, found: list[Line], blob: list[Mark]):
    """Draw the blob enlarged where the panel is empty, with names; return the pixels that it takes, None without room."""
    place = _empty(axes, found, blob)
    if place is None:
        return None
    inset = axes.inset_axes(place, zorder=3)
    ends = [mark.kappa_n for mark in blob]
    around, here = _AROUND * np.ptp(ends), [line for line in found if any(mark in blob for mark in line.marks)]
    window = min(ends) - around, max(ends) + around
    circles(inset, graph, law, nu, window)
    for line in here:
        _draw(inset, line, line.kappa_star)
    heights = [_first_rise(line, next(mark for mark in line.marks if mark in blob), window) for line in here]
    low, high = (np.median([extreme(height) for height in heights]) for extreme in (np.min, np.max))  # the steepest leave it
    inset.set(xlim=window, ylim=(low - 0.12 * (high - low), high))
    inset.tick_params(labelsize=points(9))
    inset.locator_params(nbins=4)
    axes.indicate_inset_zoom(inset, edgecolor=OTHER, alpha=0.6)
    _name(inset, here, [line.kappa_star for line in here], {blob[0].covering}, [])
    return inset.get_tightbbox()


def _first_rise(line: Line, mark: Mark, window) -> np.ndarray:
    """kappa* of a line from a mark on, as long as it stays in the window of kappa_n."""
    place = line.place(mark)
    away = slice(place, None) if place < len(line.kappa_n) / 2 else slice(place, None, -1)
    inside = _within(line.kappa_n[away], window)
    return line.kappa_star[away][: int(np.argmin(inside)) or None]


def _empty(axes, found: list[Line], blob: list[Mark]) -> tuple[float, float, float, float] | None:
    """The place of an inset, as parts of the panel: of the largest size for which there is one, the nearest to the blob."""
    to_panel = axes.transData + axes.transAxes.inverted()
    points = np.concatenate([np.column_stack([line.kappa_n, line.kappa_star]) for line in found])
    solid = [line.get_xydata() for line in axes.lines if line.get_linestyle() == "-"]  # stable circles are in the way, too
    points = to_panel.transform(np.concatenate([points, *solid]))
    here = to_panel.transform([(blob[0].kappa_n, blob[0].kappa_star)])[0]
    for width, height in _INSETS:
        corners = np.stack(np.meshgrid(np.arange(_NUMBERS[0], 0.98 - width, _SEARCH),
                                       np.arange(_NUMBERS[1], 0.98 - height, _SEARCH)), axis=-1).reshape(-1, 2)  # fmt: skip
        low, high = corners - _NUMBERS, corners + (width, height)
        free = ~((points[:, None] > low) & (points[:, None] < high)).all(axis=2).any(axis=0)
        if free.any():
            x, y = min(corners[free].tolist(), key=lambda corner: np.hypot(*(corner + np.array([width, height]) / 2 - here)))
            return x, y, width, height
    return None


# --- panels -----------------------------------------------------------------------------------------------------------


def note(graph) -> str:
    """What a title must say of where the diagram comes from; nothing if it is the computed one."""
    source = graph.graph.get("source", "")
    return f" ({source})" if source else ""


def conjugate(axes, graph, law: str, nu: float, window) -> None:
    """Draw the branches in (kappa_n, kappa*)."""
    circles(axes, graph, law, nu, window)
    for line in lines(graph, law, nu):
        _draw(axes, line, line.kappa_star)
    _frame(axes, graph, law, nu, window)


def schematic(axes, graph, law: str, nu: float, window) -> list[np.ndarray]:
    """Draw the branches with free heights, chosen so that few cross, and the circles at their covering indices; the heights."""
    circles(axes, graph, law, nu, window, level=True)
    found = lines(graph, law, nu)
    drawn = heights(found, window)
    for line, height in zip(found, drawn):
        _draw(axes, line, height)
    _frame(axes, graph, law, nu, window)
    axes.set_yticks(_coverings(graph, law, nu))
    return drawn


def heights(found: list[Line], window) -> list[np.ndarray]:
    """Heights of all lines in the disentangled picture, of shape (K,) each.

    A secondary branch goes straight from the height of the point where it leaves to that of the one where it arrives.
    """
    primary = [line for line in found if line.n]
    ends = []
    for line in primary:
        rises = 1 if line.kappa_star[-1] >= line.kappa_star[0] else -1
        ends.append((line.marks[0].covering, line.marks[-1].covering, rises))
    result = layered.heights([line.kappa_n for line in primary], ends, window)
    for line in found[len(primary) :]:
        a, b = (_height_at(mark, zip(primary, result)) for mark in (line.marks[0], line.marks[-1]))
        climbed = line.kappa_star - line.kappa_star[0]
        if b is not None:
            climbed = climbed + (b - a - climbed[-1]) * np.linspace(0, 1, len(climbed))
        result.append(a + climbed)
    return result


def _height_at(mark: Mark, placed) -> float | None:
    """The height of a mark on one of the lines that have theirs; that of a mark that no line has is kappa*, or free."""
    for line, height in placed:
        number = line.place(mark)
        if np.hypot(line.kappa_n[number] - mark.kappa_n, line.kappa_star[number] - mark.kappa_star) < levels.ROUGH:
            return float(height[number])
    return None if mark.kind == "leaves" else mark.kappa_star


def _draw(axes, line: Line, height) -> None:
    colour = colour_of(line.n) if line.n else _NO_WAVE
    for stable, part in line.parts():
        style = {"ls": LINES[stable][0], "lw": points(_WIDTHS[stable]), "solid_capstyle": "butt"}
        axes.plot(line.kappa_n[part], height[part], color=colour, zorder=2, **style)
    for mark in line.marks:
        if mark.kind in MARKS:
            marker, colour, size, _ = MARKS[mark.kind]
            edge = {} if marker == "x" else {"edgecolors": END, "linewidths": 0.7}
            style = {"marker": marker, "color": colour, "s": area(size), "zorder": 3, **edge}
            axes.scatter(mark.kappa_n, height[line.place(mark)], **style)


def _frame(axes, graph, law, nu, window):
    there = _coverings(graph, law, nu) or [1]
    axes.set(xlim=window, ylim=(there[0] - 0.6, there[-1] + 0.8))
    axes.yaxis.get_major_locator().set_params(integer=True)
    axes.grid(alpha=0.2)


def _coverings(graph, law, nu):
    nodes = (data for _, data in graph.nodes(data=True) if (data["law"], data["nu"]) == (law, nu))
    return sorted({data["covering"] for data in nodes if data["kind"] == "circle"})


def circles(axes, graph, law: str, nu: float, window, level: bool = False) -> None:
    """The planar circles, all level if asked for.

    They are thick and solid where their energy is a minimum, and dashed elsewhere; thin and solid where the published linear
    theory alone has them stable.
    """
    from branches.scene.closed import law_of
    from ribbon_model.linear import circle, energy_interval

    material, parameters = law_of(law, nu)

    def plot(m, ends, **style):
        along = np.linspace(*np.clip(ends, *window), _PARTS)
        height = [m if level else circle(material, m, kappa_n, parameters)["kappa_star"] for kappa_n in along]
        axes.plot(along, height, zorder=1, **style)

    for m in _coverings(graph, law, nu):
        plot(m, window, **_CIRCLES["unstable"])
        if m >= 1:  # of those curled against their natural curvature the linear theory does not speak
            plot(m, m * np.array(energy_interval(material, m, parameters)), **_CIRCLES["stable"])
            if published := _published_only(law, nu, m):
                plot(m, published, **_CIRCLES["published"])


def _published_only(law: str, nu: float, m: int) -> tuple[float, ...]:
    """The ends of the kappa_n at which the published theory has a circle stable, but its energy is no minimum; or nothing."""
    from branches.scene.closed import law_of
    from ribbon_model.linear import energy_interval, stability_interval

    material, parameters = law_of(law, nu)
    published, energy = (interval(material, m, parameters)[0] for interval in (stability_interval, energy_interval))
    return (m * published, m * energy) if published < energy else ()


def legend(graph, law: str, nu: float, window=WINDOW) -> list:
    """Handles for the wavenumbers, the stability and the marks that the diagram has inside the window."""
    from matplotlib.lines import Line2D

    found = [line for line in lines(graph, law, nu) if np.any(_within(line.kappa_n, window))]
    handles = [Line2D([], [], color=colour_of(n), lw=2, label=f"n = {n}") for n in sorted({line.n for line in found} - {0})]
    published = any(_published_only(law, nu, m) for m in _coverings(graph, law, nu) if m >= 1)
    minimum = " (a minimum of the energy)" if published else ""
    words = {"stable": f"circle, stable{minimum}", "unstable": "circle, unstable"}
    words |= {"published": "circle, stable to waves, but it turns inside out"} if published else {}
    handles += [Line2D([], [], **_CIRCLES[kind], label=text) for kind, text in words.items()]
    known = {stable for line in found for stable, part in line.parts() if np.any(_within(line.kappa_n[part], window))}
    words = {True: "branch, stable", False: "branch, unstable", None: "branch, stability not known"}
    handles += [
        Line2D([], [], color=OTHER, ls=LINES[stable][0], lw=points(_WIDTHS[stable]), label=text)
        for stable, text in words.items()
        if stable in known
    ]
    if any(not line.n for line in found):
        handles.append(Line2D([], [], color=_NO_WAVE, lw=2, label="secondary branch"))
    seen = {(mark.kind, mark.what) for line in found for mark in line.marks if _within(mark.kappa_n, window)}
    for kind, (marker, colour, size, text) in MARKS.items():
        for what in sorted(what for one, what in seen if one == kind):
            edge = {} if marker == "x" else {"markeredgecolor": END, "markeredgewidth": 0.7}
            label = text.format(what)
            handles.append(Line2D([], [], marker=marker, color=colour, ls="", ms=points(size**0.5), label=label, **edge))
    return handles


# --- from the graph to lines --------------------------------------------------------------------------------------


def lines(graph, law: str, nu: float) -> list[Line]:
    """The branches of one law and nu, smooth from end to end: the primary ones by wavenumber, then the secondary ones."""
    primary = [_line(graph, *family[2:4], pieces(graph, family)) for family in families(graph) if family[:2] == (law, nu)]
    secondary = [_line(graph, 0, 0, branch["edges"]) for branch in secondaries(graph, law, nu)]
    return sorted(primary, key=lambda line: (line.n, line.marks[0].covering, line.marks[0].kappa_n)) + secondary


def _line(graph, m: int, n: int, edges) -> Line:
    """The branch that these edges make up, end to end."""
    name = f"({m}, {n})" if n else ""
    s, *columns = (np.concatenate([data[name] for _, _, data in edges]) for name in ("arclength", "kappa_n", "kappa_star"))
    s, kappa_n, kappa_star = smooth(s, s, *columns)
    piece = np.searchsorted([data["arclength"][-1] for _, _, data in edges[:-1]], s)
    index = np.array([data.get("index", -1) for _, _, data in edges])[piece]
    # more points: steps in kappa_n are at most `_STEP`, so that heights can change between them
    parts = np.clip(np.ceil(np.abs(np.diff(kappa_n)) / _STEP), 1, _PARTS).astype(int)
    number = np.arange(len(kappa_n))
    within = np.arange(parts.sum()) - np.repeat(np.cumsum(parts) - parts, parts)
    fine = np.append(np.repeat(number[:-1], parts) + within / np.repeat(parts, parts), number[-1])
    fine = np.repeat(fine, 2) if len(fine) == 1 else fine  # a branch that ends where it begins
    kappa_n, kappa_star = np.interp(fine, number, kappa_n), np.interp(fine, number, kappa_star)
    index = index[np.ceil(fine).astype(int)]
    marks = []
    for node in (graph.nodes[name] for name in dict.fromkeys(node for a, b, _ in edges for node in (a, b))):
        what = node["what"] if node["kind"] == "end" else ""
        marks.append(Mark(node["kappa_n"], node["kappa_star"], node["kind"], node.get("covering"), what))
    line = Line(name, n, kappa_n, kappa_star, index, marks)
    line.marks.sort(key=line.place)
    first, last = line.marks[0].covering, line.marks[-1].covering
    if first is None or (last is not None and last < first):
        return Line(name, n, kappa_n[::-1], kappa_star[::-1], index[::-1], marks[::-1])
    return line
