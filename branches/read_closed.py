"""A branch file of a closed strip in memory: tables, and the solution of a point as a shape."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from branches.config import Config, dump
from branches.draw_strip import flat_across
from branches.files import StoreError
from branches.store import meaning_of
from contin.lowlevel import exact_text
from ribbon_model.domains import DOMAINS, LOOP
from ribbon_model.laws import LAWS, label
from ribbon_model.shape import Shape
from ribbon_model.solution import Solution

#: So many labelled points are shown at a prompt, a line each: a screen has 24 lines.
_SHOWN = 20


@dataclass(frozen=True, repr=False)
class StoredBranch:
    """A branch file in memory: the scene, the tables of points and of labelled points (structured arrays), the kept solutions.

    ``stop`` is a sentence with the reason why the run ended, ``reason`` a key word ("trivial branch", "limit", ...). ``notes``
    are those of `contin.Branch`.
    """

    config: dict
    status: str
    stop: str
    reason: str
    points: np.ndarray
    events: np.ndarray
    index: np.ndarray
    t: np.ndarray
    states: np.ndarray
    notes: tuple[str, ...] = ()

    def __repr__(self) -> str:
        lines = [f"{type(self).__name__}({self.about}: {len(self.points)} points, {self.status}; {self.stop or 'not ended'})"]
        for row, event in enumerate(self.events[:_SHOWN]):
            label, name = event["label"].decode(), event["name"].decode()
            lines.append(f"  point {event['point']:5d}  {label}  {self.place(row)}{f': {name}' if name else ''}")
        more = len(self.events) - _SHOWN
        return "\n".join([*lines, *([f"  ... {more} more in events"] if more > 0 else [])])

    def kept(self) -> np.ndarray:
        """Return the numbers of the points whose full solution is kept."""
        return self.index["point"]

    def solution(self, point: int) -> Solution:
        """Return the solution of a kept point.

        Raises
        ------
        StoreError
            The solution of this point is not kept.
        """
        found = np.flatnonzero(self.index["point"] == point)
        if not found.size:
            raise StoreError(f"the solution of point {point} is not kept; a smaller stride keeps more")
        row = self.index[found[0]]
        here = slice(row["start"], row["start"] + row["count"])
        law, domain = LAWS[self.config["law"]], DOMAINS[self.config["domain"]]
        names = [name for name in domain.problem(law).parameters if name in self.points.dtype.names]
        parameters = {name: float(self.points[point][name]) for name in names}
        return Solution(law, domain, self.t[here], self.states[here], int(row["degree"]), parameters)

    @property
    def about(self) -> str:
        """The branch in words."""
        config = self.config
        mode, nu = f"(m, n) = ({config['m']}, {config['n']})", exact_text(config["nu"])
        return f"{label(config['law'], config['Gamma'])}, {mode}, nu = {nu}"

    @property
    def shown(self) -> tuple[str, ...]:
        """Columns of labelled points that a notebook shows."""
        return ("point", "label", "name", "kappa_n", "kappa_star", "energy")

    def scene_text(self) -> str:
        """Return the scene as YAML."""
        return dump(Config.model_validate(self.config))

    def place(self, row: int) -> str:
        """Return where a labelled point is, in words; ``row`` counts labelled points from 0."""
        return f"kappa_n = {self.events['kappa_n'][row]:.4f}"

    def shape(self, point: int) -> Shape:
        """Return the closed strip at a kept point; see `solution`."""
        return self.solution(point).shape()

    def placed(self, point: int, length: float, cells: int = 0) -> tuple[Shape, np.ndarray]:
        """Return the closed strip of a point, scaled and upright, and its strains (K, 3) in radians per unit of that length.

        ``cells`` is for open strips; the nodes of a closed one are always many.
        """
        solution = self.solution(point).on(LOOP)
        shape = flat_across(solution.shape(), solution.law).placed(length)
        return shape, solution.strains() * (2 * math.pi / length)

    @property
    def length(self) -> float:
        """The length of the scene's strip; 1 without one."""
        strip = self.config.get("strip")
        return strip["length"] if strip else 1.0

    def width_at(self, length: float, thickness: float | None) -> float | None:
        """Return the width of the scene's strip, or that from a thickness and Gamma = w^2/(h L/2 pi), or None."""
        strip, Gamma = self.config.get("strip"), self.config.get("Gamma")
        if strip:
            return strip["width"] / strip["length"] * length
        return math.sqrt(Gamma * thickness * length / (2 * math.pi)) if Gamma and thickness else None

    def to_pandas(self):
        """Return the table of points as a ``pandas.DataFrame``; ImportError says what to install if pandas is missing."""
        try:
            import pandas
        except ImportError as error:
            raise ImportError("to_pandas needs pandas, which is not installed: pip install pandas") from error
        return pandas.DataFrame(self.points).assign(label=[label.decode() for label in self.points["label"]])

    def to_xarray(self):
        """Return the table of points as an ``xarray.Dataset`` along ``point``, with the meaning of each column.

        Each variable has its meaning as ``long_name``; the attributes of the dataset are the scene as YAML, ``status`` and
        ``stop``. ImportError says what to install if xarray is missing.
        """
        try:
            import xarray
        except ImportError as error:
            raise ImportError("to_xarray needs xarray, which is not installed: pip install xarray") from error
        columns = {name: self.points[name] for name in self.points.dtype.names if name not in ("point", "label")}
        columns["label"] = np.array([label.decode() for label in self.points["label"]])
        variables = {name: ("point", values, {"long_name": meaning_of(name)}) for name, values in columns.items()}
        about = {"config": self.scene_text(), "status": self.status, "stop": self.stop}
        return xarray.Dataset(variables, {"point": self.points["point"]}, about)

    def plot(self, shapes: int = 6, width: float | None = None):
        """Return the branch as a matplotlib figure; see `branches.draw_branch.figure`."""
        from branches.draw_branch import figure

        return figure(self, shapes, width)

    def _repr_html_(self) -> str:
        from branches.notebook import to_html

        return to_html(self)
