"""A branch: its points in order, and why its run ended; a diagram: branches, and the junctions where they meet."""

from __future__ import annotations

import html
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any, overload

from contin import errors as checks
from contin.arrays import Array
from contin.core.labels import Label
from contin.core.step import Stop
from contin.errors import ProblemError, warn
from contin.results import plot
from contin.results.marks import Axes, html_table
from contin.results.point import Point
from contin.text import ROWS, Shown, meant


@dataclass
class Branch:
    """The points of one branch in order, and why its run ended.

    ``notes`` tell what was seen and not understood, with the place: special points that were bracketed and not located, or not
    found again on a finer mesh; a change of the index that the labelled points do not explain. Empty on most branches.

    Examples of methods go on from this one:

    Examples
    --------
    >>> from contin import AlgebraicProblem, solve, trace
    >>> parabola = AlgebraicProblem(lambda u, p: (p.a - u.x**2,), ["x"], {"a": 1.0})
    >>> branch = trace(solve(parabola, [1.0]), free=["a"], direction=-1, limits={"a": (-1, 4)})
    >>> [point.label for point in branch if point.label], str(branch.stop)
    (['EP', 'LP', 'EP'], 'reached a = 4')
    >>> abs(branch.labelled("LP")[0]["a"]) < 1e-12
    True
    """

    points: list[Point] = field(default_factory=list)
    stop: Stop | None = None
    notes: list[str] = field(default_factory=list)

    def __repr__(self) -> str:
        found = [point.label for point in self.points if point.label]
        left_out = f" ... {found[-1]} ({len(found)} labels)" if len(found) > ROWS else ""
        labels = " ".join(found[:ROWS]) + left_out
        notes = f"; {len(self.notes)} note{'s' * (len(self.notes) != 1)}" if self.notes else ""
        return f"Branch({len(self.points)} points{meshes(self.points)}: {labels}; {self.stop or 'not ended'}{notes})"

    def __len__(self) -> int:
        return len(self.points)

    def __iter__(self) -> Iterator[Point]:
        return iter(self.points)

    @overload
    def __getitem__(self, which: int) -> Point: ...

    @overload
    def __getitem__(self, which: slice) -> list[Point]: ...

    @overload
    def __getitem__(self, which: str) -> Array: ...

    def __getitem__(self, which: int | slice | str) -> Any:
        """Return a point by its number, points by a slice, or a column by its name (`column`).

        Examples
        --------
        >>> branch[0].label, branch["a"][[0, -1]].round(10).tolist(), len(branch[1:3])
        ('EP', [1.0, 4.0], 2)
        """
        return self.column(which) if isinstance(which, str) else self.points[which]

    @checks.arguments
    def column(self, name: str) -> Array:
        """Return a parameter, a functional, or another column over all points.

        The others are ``"arclength"``, ``"discretization_error"``, ``"norm"``, and the states of equilibria. A state ``x`` of
        equilibria is ``max_x`` and ``min_x``, too, which cycles have: both go into one picture. The norm is the root of the
        mean of |u|^2 over t, for cycles the time; of equilibria it is |u|.

        Raises
        ------
        KeyError
            There is no such column.

        Examples
        --------
        >>> branch.column("a")[[0, -1]].round(10).tolist()
        [1.0, 4.0]
        """
        return plot.column(self.points, name)

    @checks.arguments
    def labelled(self, label: str) -> list[Point]:
        """Return the points that carry a label, in order, as a run found them.

        The start of a branch that was switched to (BP, HB) was found on another one and is not among them; it is ``points[0]``.

        Examples
        --------
        >>> len(branch.labelled("LP")), len(branch.labelled("HB"))
        (1, 0)
        """
        found = [point for point in self.points if point.label == label]
        if not found and label not in (known := [each.value for each in Label if each]):
            near = meant(label, known)
            warn(f"labelled: no point has the label {label!r}{near}; contin's are {', '.join(known)}", UserWarning)
        return found if label == Label.END else [point for point in found if point.arclength]

    def to_pandas(self) -> Any:
        """Return all points as a ``pandas.DataFrame``, a row a point, in order.

        Columns: ``label``, ``name``, ``arclength``, ``intervals``, ``degree``, ``iterations``, all parameters, all functionals,
        and ``norm``.

        Raises
        ------
        ImportError
            pandas is not installed.

        Examples
        --------
        >>> list(branch.to_pandas().columns)
        ['label', 'name', 'arclength', 'intervals', 'degree', 'iterations', 'discretization_error', 'a', 'norm']
        """
        try:
            import pandas
        except ImportError as error:
            raise ImportError("to_pandas needs pandas, which is not installed: pip install pandas") from error
        rows = [
            {
                "label": point.label, "name": point.name, "arclength": point.arclength, "intervals": point.system.intervals,
                "degree": point.system.degree, "iterations": point.iterations,
                "discretization_error": point.discretization_error,
                **({} if point.index is None else {"index": point.index}),
                **({} if point.normal_form is None else {"normal_form": point.normal_form}), **_values(point),
            }
            for point in self.points
        ]  # fmt: skip
        return pandas.DataFrame(rows).assign(norm=plot.column(self.points, "norm"))

    @checks.arguments
    def curve(self, *names: str) -> Array:
        """Return columns on a smooth curve through the points, to draw, shape (names, many).

        From each point to the next one it is the cubic that has the values and the tangents at both ends. A step with a tangent
        at one end only is a parabola, one with none a straight line.

        Parameters
        ----------
        *names : str
            As ``x`` and ``y`` of `plot`.

        Raises
        ------
        ProblemError
            A column that the branch does not have, or no points.

        Examples
        --------
        >>> a, x = branch.curve("a", "x")
        >>> len(a) > 10 * len(branch), bool(abs(a - x**2).max() < 1e-3)
        (True, True)
        """
        for name in names:
            plot.check_column(self.points, "names", name)
        return plot.curve(self.points, names)

    @checks.arguments
    def plot(
        self, x: str | None = None, y: str | None = None, axes: Axes | None = None, errors: bool = False,
        color: str | None = None,
    ) -> Any:  # fmt: skip
        """Draw one column against another as a smooth curve, with dots at the points and marks at labelled ones.

        The curve has the tangents of the branch (`curve`). In a window, or a notebook whose pictures are live (``%matplotlib
        widget``), a click on a point shows its label and its values.

        Of cycles and equilibria, and where the index is known (`VariationalProblem`), stable parts are solid and unstable ones
        dashed. The solutions of an `AlgebraicProblem` count as equilibria unless it is stated with ``dynamics=False``.

        Parameters
        ----------
        x, y : str, optional
            As of `column`. By default the first free parameter, and the first functional; where there is none, the first state
            of algebraic problems, and ``"norm"`` of others. Of cycles ``y`` may be a state: its largest and its smallest value
            are drawn; by default those of the first one.
        axes : matplotlib.axes.Axes, optional
            Where to draw; a figure of its own without.
        errors : bool
            Draw the estimated errors of both columns as bars. Most are shorter than a dot.
        color : str, optional
            Of the line and its dots, as matplotlib takes it; by default blue, and green of cycles.

        Returns
        -------
        matplotlib.axes.Axes

        Raises
        ------
        ProblemError
            A column that the branch does not have, or no points.
        ImportError
            matplotlib is not installed.

        Examples
        --------
        >>> branch.plot("a", "x").get_ylabel()
        'x'
        """
        return plot.plot(self.points, x, y, axes, errors, color)

    def _repr_html_(self) -> str:
        """Return a picture where it can be drawn, labelled points, notes, and why the run ended."""
        count, ended = len(self.points), f"; {html.escape(str(self.stop))}" if self.stop else ""
        parts = [f"<p><b>Branch</b> of {count} point{'s' * (count != 1)}{meshes(self.points)}{ended}</p>"]
        if self.points:
            parts += [plot.picture(lambda axes: self.plot(axes=axes)), _of_labelled(self.points)]
        return f"<div>{''.join(parts)}{_paragraphs(self.notes)}</div>"


@dataclass(repr=False)
class Junction(Shown):
    """A branch point, Hopf point or period doubling of a diagram: the point, its depth, and which half-branches were followed.

    At Hopf points and period doublings the second branch has one half: the other one is the same cycles, half a period later.
    ``taken[i]`` maps +1 and -1 to the number of the branch that runs along tangent i that way. ``failed`` lists the switches
    that did not work, as (tangent, way, reason); ``also`` the points of other branches at the same place.
    """

    point: Point
    depth: int
    taken: list[dict[int, int]]
    failed: list[tuple[int, int, str]] = field(default_factory=list)
    also: list[Point] = field(default_factory=list)


@dataclass
class Diagram:
    """Branches, and the junctions where they meet; ``searches`` tell where disconnected solutions were looked for (`Search`).

    Examples
    --------
    >>> from contin import AlgebraicProblem, diagram, solve
    >>> pitchfork = AlgebraicProblem(lambda u, p: (u.x * (p.a - u.x**2),), ["x"], {"a": 0.0})
    >>> found = diagram(solve(pitchfork, [0.0], {"a": -1.0}), free=["a"], limits={"a": (-1, 1)})
    >>> [len(found.branches), *(junction.point.label for junction in found.junctions)]
    [4, 'BP']
    """

    branches: list[Branch] = field(default_factory=list)
    junctions: list[Junction] = field(default_factory=list)
    searches: list[Any] = field(default_factory=list)

    def __repr__(self) -> str:
        count, junctions = len(self.branches), len(self.junctions)
        lines = [f"  {number}: {branch!r}" for number, branch in enumerate(self.branches[:ROWS])]
        if count > ROWS:
            lines.append(f"  ... {count - ROWS} more")
        head = f"Diagram of {count} branch{'es' * (count != 1)} and {junctions} junction{'s' * (junctions != 1)}"
        return "\n".join([head, *lines, *self._told()])

    def _told(self) -> list[str]:
        """Return what the searches say, as lines of text."""
        more = [f"  ... {len(self.searches) - ROWS} more searches"] * (len(self.searches) > ROWS)
        caution = ["  What no guess leads to is not found: there may be further solutions."] * bool(self.searches)
        return [*(f"  {each!r}" for each in self.searches[:ROWS]), *more, *caution]

    @checks.arguments
    def plot(
        self, x: str | None = None, y: str | None = None, axes: Axes | None = None, errors: bool = False,
        color: str | Sequence[str] | None = None,
    ) -> Any:  # fmt: skip
        """Draw all branches into one figure: equilibria and cycles with their stability, marks at labelled points.

        Parameters
        ----------
        x, y : str, optional
            As in `contin.Branch.plot`. Where cycles are among the branches, ``y`` is a state, the first one by default.
        axes : matplotlib.axes.Axes, optional
            Where to draw; a figure of its own without.
        errors : bool
            As in `contin.Branch.plot`.
        color : str or sequence of str, optional
            As in `contin.Branch.plot`, of all branches, or one for each.

        Returns
        -------
        matplotlib.axes.Axes

        Examples
        --------
        >>> found.plot("a", "x").get_xlabel()
        'a'
        """
        colors = [color] * len(self.branches) if color is None or isinstance(color, str) else list(color)
        if len(colors) != len(self.branches):
            raise ProblemError(f"color: {len(colors)} given, must be one for each of the {len(self.branches)} branches")
        drawn = [(branch.points, each) for branch, each in zip(self.branches, colors) if branch.points]
        cycles = [points[0].system for points, _ in drawn if points[0].system.is_cycle and points[0].system.intervals]
        if cycles and y is None:
            y = cycles[0].problem.states[0]
        for points, each in drawn:
            axes = plot.plot(points, x, y, axes, errors, each)
        return axes

    def _repr_html_(self) -> str:
        """Return a picture where it can be drawn, a row a branch (points, why it ends), and what the searches say."""
        count, junctions = len(self.branches), len(self.junctions)
        head = f"<p><b>Diagram</b> of {count} branch{'es' * (count != 1)} and {junctions} junction{'s' * (junctions != 1)}</p>"
        rows = [
            (f"{i}", f"{len(branch)}", _labels(branch.points), str(branch.stop or "not ended"))
            for i, branch in enumerate(self.branches)
        ]
        drawn = plot.picture(lambda axes: self.plot(axes=axes)) if any(len(branch) for branch in self.branches) else ""
        return f"<div>{head}{drawn}{html_table(('branch', 'points', 'labels', 'end'), rows)}{_paragraphs(self._told())}</div>"

    def graph(self) -> Any:
        """Return the diagram as a ``networkx.MultiGraph``.

        Nodes are special points (attributes: label, name, parameters and functionals), shared where branches meet; edges are
        the pieces of branches between them (attributes: branch, points, parameter and functional columns).

        Raises
        ------
        ImportError
            networkx is not installed.

        Examples
        --------
        >>> graph = found.graph()
        >>> sorted(label for _, label in graph.nodes(data="label"))
        ['BP', 'EP', 'EP', 'EP', 'EP', 'EP', 'EP']
        """
        try:
            import networkx
        except ImportError as error:
            raise ImportError("graph needs networkx, which is not installed: pip install networkx") from error

        graph = networkx.MultiGraph()
        for number, junction in enumerate(self.junctions):
            graph.add_node(_name(junction, number), label=junction.point.label, depth=junction.depth, **_values(junction.point))
        for number, branch in enumerate(self.branches):
            last, since = None, []
            for place, point in enumerate(branch.points):
                since.append(place)
                if not point.label and place + 1 < len(branch.points):
                    continue
                node = self._node(point) or f"branch{number}.{place}"
                if node not in graph:
                    graph.add_node(node, label=point.label, name=point.name, **_values(point))
                if last is not None:
                    columns = {name: branch.column(name)[since] for name in _values(point)}
                    graph.add_edge(last, node, branch=number, points=len(since), **columns)
                last, since = node, [place]
        return graph

    def _node(self, point: Point) -> str | None:
        for number, junction in enumerate(self.junctions):
            if any(point is other for other in (junction.point, *junction.also)):
                return _name(junction, number)
        return None


def _name(junction: Junction, number: int) -> str:
    return f"{junction.point.label}{number}"


def _values(point: Point) -> dict[str, float]:
    return {**point.parameters, **point.functionals}


# --- as text and tables ---------------------------------------------------------------------------------------------


def meshes(points: Sequence[Point]) -> str:
    """Return the numbers of intervals of a branch and their degree, as text; nothing where there is no mesh."""
    counts = [point.system.intervals for point in points]
    if not any(counts):
        return ""
    fewest, most = min(counts), max(counts)
    between = f"{most}" if fewest == most else f"{fewest} to {most}"
    return f" on {between} interval{'s' * (most != 1)} of degree {points[0].system.degree}"


def _paragraphs(notes: Sequence[str]) -> str:
    return "".join(f"<p>{html.escape(note)}</p>" for note in notes)


def _labels(points: Sequence[Point]) -> str:
    """Return how many labelled points of each kind there are, as text."""
    return ", ".join(f"{count} {label}" for label, count in Counter(each.label for each in points if each.label).items())


def _of_labelled(points: Sequence[Point]) -> str:
    first = points[0]
    columns = list(dict.fromkeys([*first.system.free, *first.functionals]))
    special = [(number, point) for number, point in enumerate(points) if point.label]
    rows = [(f"{i}", point.label, point.name, *(f"{point[name]:.8g}" for name in columns)) for i, point in special]
    return html_table(("point", "label", "name", *columns), rows, "labelled points")
