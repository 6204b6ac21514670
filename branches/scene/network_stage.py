"""A stage of a network: from a labelled point of an earlier one, by default its end, to a value of the followed number."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence

import numpy as np

from branches.scene.fields import ConfigError
from branches.scene.network import column
from branches.scene.open_stage import OpenStage, newton_of
from contin import ContinError, MeshControl, Point
from contin.lowlevel import Collocation, Continuation
from ribbon_model.changed_supports import held_at, with_supports
from ribbon_model.ends import ANGLES
from ribbon_model.network import ASSEMBLY, FOLLOWER, MOVES
from ribbon_model.network_first import first_state

#: Axes of the drawing.
_AXES = "xyz"
#: Words of columns, and those of axes.
_WORDS = {
    FOLLOWER: ("pressure that stays normal to the strips, per length", "pressure that follows"),
    ASSEMBLY: ("part of natural strains, loads, gaps and turns of joints that acts", "assembly"),
    "floating": ("largest reaction to what holds the network that floats: an error", "reaction of what floats"),
    "potential": ("energy and the potential of all loads: the one of which the index is", "potential"),
    "energy": ("elastic energy, zero in the natural state, and potential of weight, pressure and field", "energy"),
}


class NetworkStage(OpenStage):
    """A stage of a scene of a network."""

    supports = "held"

    def __init__(self, scene, number: int):
        super().__init__(scene, number)
        self.head = f"{self.follow:>14s}     energy      {self.conjugate:>9s}      index   N  it"
        self.units = "the units of the scene"
        self._how = ""

    # --- the run --------------------------------------------------------------------------------------------------------

    def first(self) -> Point:
        mesh = self.scene.mesh
        try:
            point, self._how = first_state(
                self.strip, mesh.intervals, mesh.degree, {self.follow: self.stage.to},
                mesh=self.mesh_control(), newton=newton_of(self.scene),
            )  # fmt: skip
        except (ContinError, ValueError) as error:
            raise ConfigError(f"strips: no first state was found from the drawing: {error}") from error
        return point

    def restated(self, origin: Point, numbers: Mapping[str, float]) -> tuple[Collocation, np.ndarray]:
        return with_supports(self.strip, origin, self.follow, self.scene.replacing(self.number), numbers)

    def _begun(self, origin: Point) -> Continuation:
        if self.stage.phase is not None and origin.system.problem is not self.problem:
            try:
                origin = self.strip.restated(origin)
            except ContinError as error:
                waves = self.stage.phase
                raise ConfigError(
                    f"phase: with {waves} waves held, no single branch leaves; try another number of waves"
                ) from error
        return super()._begun(origin)

    def sizes(self, system: Collocation, x: np.ndarray) -> Mapping[str, float]:
        return {}  # the problem has its own

    def mesh_control(self) -> MeshControl:
        mesh = self.scene.mesh
        return MeshControl(mesh.tolerance, min(8, mesh.max_intervals), mesh.max_intervals, mesh.adapt_every)

    def notes(self, run: Continuation) -> list[str]:
        notes = super().notes(run)
        if self.number == 1 and not self.problem.has_index:
            notes.insert(0, "loads that follow the strips have no energy: there is no index, and flutter is not looked for")
        notes[:0] = [f"stage {self.number}: {told}" for told in self.scene.told_axes(self.number)]
        if self._how:
            notes[:0] = [f"stage {self.number}: the first state was found {self._how}"] + [
                f"stage {self.number}: the drawing has a gap of {gap:.4g} at {name}, which was closed"
                for name, gap in self.strip.gaps.items()
            ]
        return notes

    # --- columns --------------------------------------------------------------------------------------------------------

    def found_names(self, numbers: Collection[str]) -> tuple[str, ...]:
        return self.scene.found_names

    def values(self, point: Point, names: Sequence[str]) -> Mapping[str, float]:
        """Loads and reactions that do not act are zero; displacements and rotations that are not prescribed are those found."""
        found = {**point.parameters, **point.functionals, **self.found(point)}
        absent = {name: 0.0 for name in names if name not in found}
        for joint in self.strip.joints:
            if any(f"{joint}_{move}" in absent for move in (*MOVES, *ANGLES)):
                absent |= held_at(self.strip, point, joint)
        return absent | found

    def found(self, point: Point) -> dict[str, float]:
        network = self.strip
        found = {"potential": network.potential(point)}
        for joint in network.joints:
            found |= zip((f"{column(joint)}_{axis}" for axis in _AXES), map(float, network.place(point, joint)))
        for joint, parts in network.reactions(point).items():
            if network.floats:
                found[joint] = float(max(np.abs(part).max() for part in parts))
                continue
            for kind, part in zip("FM", parts):
                found |= zip((f"{kind}_{joint}_{axis}" for axis in _AXES), map(float, part))
        return found

    # --- words ----------------------------------------------------------------------------------------------------------

    @property
    def stiffness(self) -> float:
        return min(section.stiffness for section in self.strip.sections.values())

    def felt(self, name: str) -> str:
        network = self.strip
        if forces := [*network.loads[name].forces, *network.loads[name].followers] if name in network.loads else ():
            joint, direction, _ = forces[0]
            return f"{column(joint)}_{_AXES[int(np.argmax(np.abs(direction)))]}"
        joint, _, move = name.rpartition("_")
        return f"F_{joint}_{move[1]}" if move in MOVES and joint in network.held else "energy"

    def told_values(self, point: Point) -> list[tuple[str, float]]:
        value = self.found(point).get(self.conjugate, point["energy"])
        return [(self.conjugate, value), ("energy", point["energy"])]

    def words(self, name: str) -> tuple[str, str]:
        network = self.strip
        joint, _, last = name.rpartition("_")
        replaced = None if name in self.scene.loads else re.fullmatch(r"(\w+)_(force_([xyz])|moment)", name)
        if replaced and replaced[1] in network.joints:
            place, _, axis = replaced.groups()
            what = f"dead force at {place} along {axis}" if axis else f"dead moment at the hinge {place}"
            return f"{what}, once its support has changed", what.removeprefix("dead ")
        if name in network.loads:
            return f"number of the load {name}", name
        if name in _WORDS:
            return _WORDS[name]
        if found := re.fullmatch(r"([FM])_(\w+)_([xyz])", name):
            kind = "force" if found[1] == "F" else "moment"
            return f"{kind} on the network at {found[2]}, along {found[3]}", f"{kind} at {found[2]} along {found[3]}"
        place = {column(one): one for one in network.joints}.get(joint)
        if place and last in _AXES:
            return f"place of {place} along {last}", f"{last} of {place}"
        if joint in network.joints and last in MOVES:
            return f"prescribed displacement of {joint} along {last[1]}", f"displacement of {joint} along {last[1]}"
        if joint in network.joints and last in ANGLES:
            return f"prescribed rotation of {joint}: {last}", f"{last} of {joint}"
        number, _, section = name.rpartition("_")
        if section in network.sections:
            words, axis = super().words(number)
            return f"{words}, of {section}", f"{axis}, {section}"
        return super().words(name)
