"""A result file of a network in memory: the strips at its points."""

from __future__ import annotations

import numpy as np

from branches.draw.shapes import flat_across
from branches.draw.strip import View
from branches.store.files import StoreError
from branches.store.open_branch import OpenBranch
from ribbon_model.shape import Structure, shape_of

#: Networks are drawn flat, often, with strips across their plane: seen from ahead, those that stand upright would be lines.
_VIEW = View(-62.0, 25.0)
#: Width of drawn strips over the longest length, without dimensions.
_WIDTH = 0.06


class NetworkBranch(OpenBranch):
    """The result file of a network; as `branches.read.StoredBranch`, with lengths in the unit of the scene."""

    def shape(self, point: int) -> Structure:
        """Return the strips at a kept point, in the order of the network's members, on the axes of the drawing."""
        t, states = self.states_at(point)
        network, values = self._strip(point), [*self._numbers(point).values()]
        strains = network.strains_at(t, states, np.array(values))
        parts = []
        for (name, member), piece in zip(network.members.items(), network.problem.pieces):
            law = network.sections[member.section].form
            parts.append(flat_across(shape_of(member.length * t, states[:, list(piece.at)], strains[name]), law))
        return Structure(tuple(parts))

    def strains(self, point: int) -> np.ndarray:
        """Networks have strains for each strip; raise StoreError."""
        raise StoreError("strains are of one strip, and this result is of a network (shape(point).parts are its strips)")

    def placed(self, point: int, length: float, cells: int = 0):
        """Networks are not scaled to a length; raise StoreError."""
        raise StoreError("meshes and tables of states are of one strip, and this result is of a network; --movie shows it")

    def width_at(self, length: float, thickness: float | None) -> float | None:
        return None

    length_unit = ""

    def drawn_width(self, strips: list, asked: float | None) -> float:
        longest = max(part.arclength[-1] for strip in strips for part in strip.parts)
        return super().drawn_width(strips, _WIDTH * longest if asked is None else asked)

    @property
    def up(self) -> tuple[float, float, float]:
        strip = self.scene.strip()
        return tuple(-x for x in strip.weight_direction)

    @property
    def view(self) -> View:
        return _VIEW
