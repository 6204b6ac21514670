"""The states of a closed strip of given dimensions, in SI units, and the ways out of the stable ones."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from operator import attrgetter

import numpy as np

from branches.run.display import Progress
from contin import Settings, trace
from contin.lowlevel import Label, levels, point_of
from ribbon_model import law_end, linear, stability
from ribbon_model.barriers import Barrier, Folding, barriers, covering_index, folding, is_at, sides
from ribbon_model.equilibrium import LENGTH
from ribbon_model.laws import FINITE_WIDTH, NoThreshold, TwoBendings
from ribbon_model.second_variation import Equilibrium
from ribbon_model.seeds import primary_branch
from ribbon_model.segments import Strip as Segments
from ribbon_model.solution import Solution
from ribbon_model.strip import Strip

#: Covering indices considered: odd ones, as a loop can be folded into these; up to the second beyond the natural curvature.
_COVERINGS, MOST_COVERINGS = 7, 15
#: Branches are followed to this distance from the natural curvature, over 2 pi/L.
_REACH = 40.0


@dataclass(frozen=True)
class State:
    """An equilibrium at the strip's natural curvature.

    Attributes
    ----------
    name : str
    m : int
        Covering index of a circle; 0 for a buckled state.
    index : int or float
        Number of negative directions of the energy, 0 if stable; nan if undecided.
    moment, energy, strain : float
        Magnitude of the internal moment in N m, energy above the natural state in J, largest strain at the surface.
    equilibrium : Equilibrium, optional
        Of a buckled state.
    """

    name: str
    m: int
    index: float
    moment: float
    energy: float
    strain: float
    equilibrium: Equilibrium | None = None

    @property
    def stable(self) -> bool:
        """Return whether the state is a minimum of the energy."""
        return self.index == 0


def coverings(strip: Strip) -> range:
    """Return the covering indices of the circles that are considered."""
    return range(1, max(_COVERINGS, min(MOST_COVERINGS, 2 * int(strip.kappa_n / 2) + 5)) + 1, 2)


def circles(strip: Strip) -> list[State]:
    """Return the planar circles."""
    found = []
    for m in coverings(strip):
        values = linear.circle(FINITE_WIDTH, m, strip.kappa_n, strip.parameters)
        negative = linear.index(FINITE_WIDTH, m, strip.kappa_n, strip.parameters)
        moment, strain = abs(values["M1"]) * strip.moment_unit, float(strip.strain(m - strip.kappa_n))
        found.append(State(circle_name(m), m, negative, moment, _energy(strip, values["energy"]), strain))
    return found


def circle_name(m: int) -> str:
    """Return the name of a circle of m turns."""
    return f"{m}-fold circle" if m > 1 else "single loop"


def _energy(strip: Strip, energy: float) -> float:
    """Return an energy above that of the natural state, in J; the energies of ribbon_model leave kappa_n**2/2 out."""
    return (energy + strip.kappa_n**2 / 2) * strip.energy_unit


def buckled(strip: Strip, quiet: bool = True) -> tuple[list[State], list[tuple[str, float]], list[tuple[int, int]]]:
    """Return the states on the primary branches at the strip's natural curvature, and the folds on the branch (1, 2).

    A fold is a pair (name, kappa_n). Third are the modes (m, n) whose branches begin where the law has two bendings for one
    moment; they are not followed. Unless ``quiet``, a line of progress is shown.
    """
    states, folds, lost, seen = [], [], [], []
    modes = [(m, n) for m in coverings(strip) for n in range(1, coverings(strip)[-1] + 2) if n != m]
    with Progress("branches", len(modes), quiet) as progress:
        for m, n in progress.each(modes, str):
            known = folds if (m, n) == (1, 2) else []
            try:
                found = list(at_natural_curvatures(m, n, [strip.kappa_n], strip.parameters, known))
            except TwoBendings:
                found, lost = [], [*lost, (m, n)]
            for point, equilibrium in found:
                place = point["energy"], point["kappa_star"]
                near = {"rtol": levels.APART, "atol": levels.APART}
                if not any(n == other and np.allclose(place, there, **near) for other, there in seen):
                    seen.append((n, place))
                    states.append(_state(strip, f"buckled ({m}, {n})", point, equilibrium))
    return states, folds, lost


def at_natural_curvatures(
    m: int, n: int, kappas: Sequence[float], parameters: Mapping[str, float], folds: list | None = None
) -> Iterator[tuple]:
    """Yield the points of a branch at values of kappa_n, with their equilibria; its folds are added to ``folds``.

    Raises TwoBendings (see `ribbon_model.seeds.primary_branch`).
    """
    try:
        start = linear.thresholds(FINITE_WIDTH, m, n, parameters)[0]
    except NoThreshold:
        return
    limits = {"kappa_n": (min(start, *kappas) - _REACH, max(start, *kappas) + _REACH)}
    system, x, tangent = primary_branch(FINITE_WIDTH, m, n, parameters, 8, 7)
    ends = law_end.closed_tests(FINITE_WIDTH)
    settings = Settings(trivial="M2", limits=limits, zeros={"kappa_n": list(kappas)}, events=ends, errors=False)
    for point in trace(point_of(system, x), settings, tangent=tangent, progress=False):
        if point.label == Label.FOLD and folds is not None:
            folds.append((f"fold of ({m}, {n})", point["kappa_n"]))
        if point.label == Label.USER_ZERO:
            yield point, Solution.of(point).equilibrium()


def _state(strip: Strip, name: str, point, equilibrium: Equilibrium) -> State:
    found = stability.index(equilibrium)
    directors = equilibrium.directors(np.linspace(0, LENGTH, 400, endpoint=False))
    strains, _ = equilibrium.response(directors @ equilibrium.moment)
    strain = float(strip.strain(strains[:, 0] - strip.kappa_n, strains[:, 2]).max())
    moment = float(np.linalg.norm(equilibrium.moment)) * strip.moment_unit
    index = found.index if found.decided else math.nan
    return State(name, 0, index, moment, _energy(strip, point["energy"]), strain, equilibrium)


# --- ways out ---------------------------------------------------------------------------------------------------------


def ways_out(states: Sequence[State], quiet: bool = True) -> dict[str, Barrier]:
    """Return the barrier in J of each stable state by name, over given states of index 1; ``quiet``: no line of progress."""
    stable, saddles = [state for state in states if state.stable], [state for state in states if state.index == 1]
    found = []
    with Progress("ways out", len(saddles), quiet) as progress:
        for saddle in progress.each(saddles, attrgetter("name")):
            ends = None if saddle.equilibrium is None else sides(saddle.equilibrium)
            if ends is not None:
                found.append((saddle.name, saddle.energy, *(_name(end, stable) for end in ends)))
    return barriers([(state.name, state.energy) for state in stable], found)


def by_hand(strip: Strip, states: Sequence[State], ways: Mapping[str, Barrier], quiet: bool = True) -> dict[str, Folding]:
    """Return, by name, the paths on which couples at two opposite points take stable circles to their lowest saddles."""
    energies, found = {state.name: state.energy for state in states}, {}
    rings = [state for state in states if state.m and state.name in ways]
    with Progress("foldings", len(rings), quiet) as progress:
        for ring in progress.each(rings, attrgetter("name")):
            path = folding(FINITE_WIDTH, ring.m, strip.kappa_n, strip.parameters)
            end = math.nan if path is None else _energy(strip, path.energies[-1])
            if path is not None and abs(end - energies[ways[ring.name].saddle]) < levels.APART * strip.energy_unit:
                found[ring.name] = path
    return found


def _name(end: Segments, stable: Sequence[State]) -> str | None:
    """Return the name of the stable state in which a strip of segments rests, None for another one."""
    m = covering_index(end)
    for state in stable:
        if state.m == m if m else state.equilibrium is not None and is_at(end, state.equilibrium):
            return state.name
    return None
