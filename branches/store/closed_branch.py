"""A result file of a closed strip in memory."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import ClassVar

import numpy as np

from branches.draw.solid import widest
from branches.draw.strip import ROOM, WIDTH, steady
from branches.draw.structure import flat_across
from branches.draw.style import NU, colour_of, in_words
from branches.scene.closed import and_nu
from branches.scene.labels import kind_of, label_of
from branches.store.branch import Mark, StoredBranch
from contin.lowlevel import Collocation
from ribbon_model.domains import DOMAINS, LOOP
from ribbon_model.laws import LAWS
from ribbon_model.shape import Shape
from ribbon_model.solution import Solution
from ribbon_model.strip import Strip

#: Strips that are compared to see from which side to look; a tenth of them may miss how a strip turns over.
_BETWEEN = 60
#: Ends of words of axes, which say what a curvature is multiplied by, and what an energy is over.
_OVER, _IN_UNITS = "L/2π", ", in units 2πB/L"
#: Kinds of `branches.scene.labels` that a legend says in other words, or not at all.
_WORDS = {"leaves": "limit of the scene", "circle": "bifurcation of a circle", "branch point": None}


class ClosedBranch(StoredBranch):
    """The result file of a closed strip; lengths of shapes are in units of L / 2 pi."""

    shape_length: ClassVar[float] = 2 * math.pi

    @property
    def shown(self) -> tuple[str, ...]:
        return ("point", "label", "name", "kappa_n", "kappa_star", "energy")

    def place(self, row: int) -> str:
        return f"kappa_n = {self.events['kappa_n'][row] * self.scene.factor('kappa_n'):.4f} {self._unit('kappa_n')}".rstrip()

    def solution(self, point: int) -> Solution:
        t, states = self.states_at(point)
        law, domain = LAWS[self.scene.law], DOMAINS[self.scene.domain]
        names = [name for name in domain.problem(law).parameters if name in self.points.dtype.names]
        parameters = {name: float(self.points[point][name]) for name in names}
        return Solution(law, domain, t, states, self.degree(point), parameters)

    def discretized(self, point: int) -> tuple[Collocation, np.ndarray]:
        return self.solution(point).discretized()

    def shape(self, point: int) -> Shape:
        return self.solution(point).shape()

    def placed(self, point: int, length: float, cells: int = 0) -> tuple[Shape, np.ndarray]:
        """As `StoredBranch.placed`; the nodes of a closed strip are always many."""
        solution = self.solution(point).on(LOOP)
        shape = flat_across(solution.shape(), solution.law).placed(length)
        return shape, solution.strains() * (2 * math.pi / length)

    @property
    def length(self) -> float:
        return self.scene.strip["length"] if self.scene.strip else 1.0

    def width_at(self, length: float, thickness: float | None) -> float | None:
        """As `StoredBranch.width_at`; Gamma = w^2/(h L/2 pi)."""
        strip, Gamma = self.scene.strip, self.scene.Gamma
        if strip:
            return strip["width"] / strip["length"] * length
        return math.sqrt(Gamma * thickness * length / (2 * math.pi)) if Gamma and thickness else None

    # --- pictures -------------------------------------------------------------------------------------------------------

    @property
    def caption(self) -> str:
        scene, what = self.scene, self.scene.material.replace("Gamma", "Γ")
        if scene.strip:
            sizes = " × ".join(f"{1e3 * scene.strip[name]:.4g}" for name in ("width", "thickness", "length"))
            what = f"strip of {sizes} mm"
        secondary = "secondary branch of " if scene.origin else ""
        return f"{what}, {secondary}(m, n) = ({scene.m}, {scene.n}){in_words(and_nu(scene.law, scene.nu, NU))}"

    def axis_words(self, name: str) -> str:
        words = super().axis_words(name)
        return words.removesuffix(_OVER).removesuffix(_IN_UNITS) if self.scene.unit(name) else words

    def marks(self) -> Iterator[Mark]:
        for event in self.events:
            letters = event["label"].decode()
            kind = kind_of(letters, name := event["name"].decode(), self.reason, bool(self.scene.origin))
            word = _WORDS.get(kind, f"end: {name}" if kind == "end" and name else kind)
            strip = self.scene.strip if kind == "user value" else None
            if strip and math.isclose(event["kappa_n"], Strip(**strip).kappa_n):
                word = "natural curvature of the strip"
            yield Mark(int(event["point"]), label_of(letters), kind == "leaves", word)

    def colour(self, stage: int) -> str:
        return colour_of(self.scene.n)

    def posed(self, points: list[int]) -> dict[int, Shape]:
        """As `StoredBranch.posed`: each strip is turned onto the one before, along points between them."""
        kept = self.kept().tolist()
        between = sorted({*kept[:: max(1, len(kept) // _BETWEEN)], *points})
        turned = steady({point: self.placed(point, 2 * math.pi)[0] for point in between})
        return {point: turned[point] for point in points}

    def drawn_width(self, strips: list[Shape], asked: float | None) -> float:
        if asked is None:
            asked = self.width_at(2 * math.pi, None)
        return min([WIDTH if asked is None else asked, *(ROOM * widest(strip) for strip in strips)])
