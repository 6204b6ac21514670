"""A result file of a network in memory: the strips at its points."""

from __future__ import annotations

import numpy as np

from branches.draw.shapes import flat_across
from branches.draw.strip import View
from branches.store.files import StoreError
from branches.store.open_branch import OpenBranch
from ribbon_model.shape import Structure

#: Networks are drawn flat, often, with strips across their plane: seen from ahead, those that stand upright would be lines.
_VIEW = View(-62.0, 25.0)


class NetworkBranch(OpenBranch):
    """The result file of a network; as `branches.read.StoredBranch`, with lengths in the unit of the scene."""

    def shape(self, point: int) -> Structure:
        """Return the strips at a kept point, in the order of the network's members, on the axes of the drawing."""
        t, states = self.states_at(point)
        network, values = self._strip(point), np.array([*self._numbers(point).values()])
        laws = [network.sections[member.section].form for member in network.members.values()]
        return Structure(tuple(map(flat_across, network.shapes_at(t, states, values).values(), laws)))

    def strains(self, point: int) -> np.ndarray:
        """Networks have strains for each strip; raise StoreError."""
        raise StoreError("strains are of one strip, and this result is of a network (shape(point).parts are its strips)")

    def placed(self, point: int, length: float, cells: int = 0):
        """Networks are not scaled to a length; raise StoreError."""
        raise StoreError("meshes and tables of states are of one strip, and this result is of a network; --movie shows it")

    def width_at(self, length: float, thickness: float | None) -> float | None:
        return None

    length_unit = ""

    @property
    def up(self) -> tuple[float, float, float]:
        strip = self.scene.strip()
        return tuple(-x for x in strip.weight_direction)

    @property
    def view(self) -> View:
        return _VIEW
