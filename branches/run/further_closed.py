"""Further states of closed strips: those at labelled values of kappa_n that no branch of a result, or of a diagram, reaches."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from branches.graph import closed
from branches.graph.at_value import states_at
from branches.graph.stored import new_graph, read_any
from branches.run.display import Progress
from branches.scene.closed import law_of
from branches.store.read import read_branch
from contin import Point
from contin.lowlevel import exact_text, levels
from ribbon_model.closed_search import further, waves
from ribbon_model.solution import Solution

#: Further states at one value that are told, the lowest in energy: closed strips have very many.
MOST = 10
#: Draws beside each circle for each number that `--search` gives: one draw takes 0.02 s, a guess of an open strip 0.2 s.
PER_DRAW = 4


@dataclass(frozen=True)
class Found:
    """A further state: its solution, kappa*, the energy, and the index."""

    solution: Solution
    kappa_star: float
    energy: float
    index: int

    def words(self) -> str:
        """Return the state in one line."""
        force, count = float(np.linalg.norm(self.solution.force)), waves(self.solution)
        parts = f"{count} equal waves" if count > 1 else "no equal parts"
        held = "no force" if force < levels.APART else f"force {force:.6g}"
        return f"energy {self.energy:.6g}, kappa* {self.kappa_star:.6g}, {held}, {parts}, index {self.index}"


@dataclass(frozen=True)
class Place:
    """A strip at a value of kappa_n: how many states are known there, and the further ones in the order of their energy.

    ``unusable`` is the number of solutions along which the energy of the law is not convex: the law does not hold for them.
    """

    law: str
    nu: float
    kappa_n: float
    known: int
    found: list[Found]
    unusable: int


def places(path: Path, values: Sequence[float], draws: int, quiet: bool = True) -> list[Place]:
    """Return the search at each value, for each strip of a result file or of the folder of a diagram.

    ``draws`` is the number of random loads beside each circle, over `PER_DRAW`.
    """
    graph, folder = _diagram(path), path if path.is_dir() else path.parent
    strips = sorted({(data["law"], data["nu"]) for *_, data in graph.edges(data=True)})
    found = []
    with Progress("values searched", len(strips) * len(values), quiet) as progress:
        for law, nu in strips:
            coverings = sorted({abs(data["covering"]) for _, data in graph.nodes(data=True) if data["kind"] == "circle"})
            for value in values:
                known = [
                    (state.values["kappa_star"], state.values["energy"])
                    for state in states_at(graph, value, folder) if (state.about["law"], state.about["nu"]) == (law, nu)
                ]  # fmt: skip
                progress.part(f"kappa_n = {value:g}")
                points = further(*law_of(law, nu), value, known, coverings, PER_DRAW * draws)
                found.append(Place(law, nu, value, len(known), *_judged(points)))
                progress.part_done()
    return found


def _judged(points: Iterable[Point]) -> tuple[list[Found], int]:
    """Return states with their index, by energy, and the number of those that have none."""
    found, unusable = [], 0
    for point in sorted(points, key=lambda point: point["energy"]):
        solution = Solution.of(point)
        try:
            found.append(Found(solution, point["kappa_star"], point["energy"], solution.index().index))
        except ValueError:  # the energy is not convex there
            unusable += 1
    return found, unusable


def _diagram(path: Path):
    """Return the diagram of a folder, or that of one result."""
    if path.is_dir():
        return read_any(path)
    graph = new_graph("", closed.FORMAT)
    closed.add_branch(graph, read_branch(path), path.name)
    return graph


def report(path: Path, values: Sequence[float], draws: int, quiet: bool = True) -> list[str]:
    """Return what a run prints of the search."""
    lines = ["further states of strips with a mirror or a two-fold axis, besides planar circles:"]
    for place in places(path, values, draws, quiet):
        told = f", the {MOST} lowest in energy:" if len(place.found) > MOST else ""
        where = f"{place.law}, nu = {place.nu:g}, kappa_n = {exact_text(place.kappa_n)}"
        lines.append(f"  {where}: {place.known} known, {len(place.found)} more{told}")
        lines += [f"    {state.words()}" for state in place.found[:MOST]]
        if place.unusable:
            lines.append(f"    {place.unusable} left out: the energy of the law is not convex along them")
    return [*lines, "  what no draw leads to is not found: there are more"]
