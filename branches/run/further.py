"""Further states of open strips: those with the ends and numbers of a result that none of its branches reaches (deflation).

They are looked for where a stage ends, and at the values that the scene labels. All states of the result there count as known.
"""

from __future__ import annotations

from dataclasses import dataclass

from branches.run.barriers import State, chosen_rows, states_at, where
from branches.run.display import Progress
from branches.store.open_branch import OpenBranch
from contin import ContinError, MeshControl, Search, Settings
from contin.lowlevel import Searched, further, levels

#: Size of random perturbations: half waves and constants of about one in all states. Of the strip of open_clamped.yaml at 75 %,
#: eight of them beside each state find eight further states, of size .3 one, of size 2 one.
SIZES = (1.0,)
#: Further states at one place after which the search there ends: some strips have very many.
MOST = 10


@dataclass(frozen=True)
class Place:
    """A point of a result, the states that it knows there, further ones in the order of their potential, and the account."""

    row: int
    known: list[State]
    found: list[State]
    account: Searched


def places(branch: OpenBranch, draws: int, quiet: bool = True) -> list[Place]:
    """Return the search at each place; ``draws`` is the number of perturbations of each size, for every known state."""
    found = []
    rows = list(chosen_rows(branch))
    with Progress("places searched", len(rows), quiet) as progress:
        for row in progress.each(rows, lambda row: branch.stage_at(row).follow):
            if known := states_at(branch, row):
                found.append(_searched(branch, row, known, draws))
    return found


def _searched(branch: OpenBranch, row: int, known: list[State], draws: int) -> Place:
    mechanics, mesh = known[0].stage, branch.scene.mesh
    control = MeshControl(mesh.tolerance, min(8, mesh.max_intervals), mesh.max_intervals)
    search = Search(sizes=SIZES, draws=draws, most=MOST)
    account = further([state.point for state in known], branch.stage_at(row).follow, search, Settings(mesh=control))
    found = []
    for point in account.found:
        try:
            index = point.second_variation().index()
        except ContinError:
            index = -1
        found.append(State("", mechanics, point, index, mechanics.strip.potential(point)))
    return Place(row, known, sorted(found, key=lambda state: state.potential), account)


def report(branch: OpenBranch, draws: int, quiet: bool = True) -> list[str]:
    """Return what a run prints of the search."""
    factor, unit = branch.scene.factor("potential"), branch.scene.unit("potential")
    lines = [f"further states{f', energies in {unit}' if unit else ''}:"]
    for place in places(branch, draws, quiet):
        tried = f"{place.account.guesses.total()} guesses; {place.account.stop}"
        lines.append(f"  {where(branch, place.row)}: {len(place.known)} known, {len(place.found)} more ({tried})")
        energies = [state.potential for state in place.known]
        for state in place.found:
            index = "unknown" if state.index < 0 else state.index
            lines.append(f"    energy {state.potential * factor:.6g}{_image(state.potential, energies)}, index {index}")
    return [*lines, "  what no guess leads to is not found: there may be more"]


def _image(energy: float, known: list[float]) -> str:
    """Return words for a state with the energy of a known one."""
    return " (that of a known state)" if any(abs(energy - one) <= levels.APART * (1 + abs(one)) for one in known) else ""
