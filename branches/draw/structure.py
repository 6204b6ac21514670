"""Strips in space as they stand in pictures and files, with their joints and supports: blocks, pins of hinges, balls."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from branches.draw.solid import Mesh, solid, surface, together
from contin.lowlevel import Shown
from ribbon_model.ends import DIRECTIONS, Vector, perpendicular
from ribbon_model.shape import Shape

#: Forms of joints, and of dead forces.
BLOCK, PIN, BALL, ARROW = "block", "pin", "ball", "arrow"
#: Number of sides, and profile: (height along the axis, radius), over the width of the strips. A block covers the corners of
#: strips that meet, a pin is a little longer than a strip is wide; the tip of an arrow is where its force acts.
_FORMS: dict[str, tuple[int, list[tuple[float, float]]]] = {
    BLOCK: (4, [(-0.56, 0.0), (-0.56, 0.26), (0.56, 0.26), (0.56, 0.0)]),
    PIN: (24, [(-0.68, 0.0), (-0.68, 0.2), (0.68, 0.2), (0.68, 0.0)]),
    ARROW: (24, [(-3.4, 0.0), (-3.4, 0.09), (-1.1, 0.09), (-1.1, 0.32), (0.0, 0.0)]),
    BALL: (24, [(-0.36 * np.cos(x), 0.36 * np.sin(x)) for x in np.linspace(0, np.pi, 14).tolist()]),
}
#: Supports are larger than joints by this factor, so that a joint at a support is seen.
_SUPPORT = 1.5
#: A direction with a larger component along the tangent is that of a strip that stands upright.
_UPRIGHT = 0.99


@dataclass(frozen=True)
class Fixture:
    """A joint or a support, fixed on an end of a strip; or a force that acts there.

    Attributes
    ----------
    part : int
        Number of the strip.
    last : bool
        At its last end.
    arm, axis : tuple of float
        From there, and of a pin or a block, on the directors of the end.
    form : str
        'block', 'pin', 'ball' or 'arrow'.
    held : bool
        Whether it is a support.
    number : str
        The name of a force.
    force : float
        Value of that number, of which the sign matters.
    in_space : bool
        Whether the axis is on the axes of the structure, as that of a dead force.
    """

    part: int
    last: bool
    arm: Vector
    axis: Vector
    form: str
    held: bool = False
    number: str = ""
    force: float = 1.0
    in_space: bool = False

    @property
    def turned(self) -> tuple[int, np.ndarray]:
        """The number of sides, and the profile from one end of the axis to the other: (height, radius), over the width."""
        sides, profile = _FORMS[self.form]
        return sides, np.array(profile) * (_SUPPORT if self.held else 1.0)

    @property
    def axes(self) -> np.ndarray:
        """The axis and two directions across it, on the directors of the end or, of dead forces, in space: rows (3, 3)."""
        return np.array([self.axis, *perpendicular(self.axis)])

    def solid(self, parts: tuple[Shape, ...], width: float) -> Mesh:
        """Return it as a closed solid at strips that are drawn with a width: its profile around the axis, flat at both ends."""
        (sides, rings), shape = self.turned, parts[self.part]
        row = -1 if self.last else 0
        place = shape.centreline[row] + np.array(self.arm) @ shape.directors[row]
        ahead, *across = np.sign(self.force) * self.axes @ (np.eye(3) if self.in_space else shape.directors[row])
        angles = 2 * np.pi * (np.arange(sides) + 0.5) / sides
        around = np.column_stack([np.cos(angles), np.sin(angles)]) @ np.array(across)
        points = place + width * (rings[:, :1, None] * ahead + rings[:, 1:, None] * around)
        numbers = np.arange(len(rings) * sides).reshape(-1, sides)
        numbers[[0, -1]] = numbers[[0, -1], :1]  # the rings at both ends are points
        beside = np.roll(numbers, -1, axis=1)
        quads = np.stack([numbers[:-1], beside[:-1], beside[1:], numbers[1:]], axis=-1).reshape(-1, 4)
        station = len(shape.arclength) - 1 if self.last else 0
        return Mesh(points.reshape(-1, 3), quads, np.full(len(rings) * sides, station))


@dataclass(frozen=True, repr=False)
class Structure(Shown):
    """Several strips in space, with their joints and supports."""

    parts: tuple[Shape, ...]
    fixtures: tuple[Fixture, ...] = ()

    @property
    def centreline(self) -> np.ndarray:
        """All centrelines, one after the other, shape (K, 3)."""
        return np.concatenate([part.centreline for part in self.parts])

    def solids(self, width: float) -> list[tuple[Fixture, Mesh]]:
        """Return the joints, the supports and the forces that are not zero, each with its solid."""
        return [(one, one.solid(self.parts, width)) for one in self.fixtures if one.force != 0]


def meshed(shape: Shape | Structure, width: float, thickness: float | None) -> Mesh:
    """Return the middle surfaces of strips as a mesh or, with a thickness, closed solids, with those of their joints.

    Solids that meet overlap: programs that slice them for a printer take them as one body.
    """
    parts = parts_of(shape)
    found = [surface(part, width) if thickness is None else solid(part, width, thickness) for part in parts]
    first = np.cumsum([0, *(len(part.arclength) for part in parts)])  # node of each strip among all
    beside = [] if thickness is None else [(mesh, first[one.part]) for one, mesh in solids_of(shape, width) if not one.number]
    return together([replace(mesh, stations=mesh.stations + start) for mesh, start in (*zip(found, first), *beside)])


def parts_of(shape: Shape | Structure) -> tuple[Shape, ...]:
    """Return the strips of a structure, or the strip."""
    return shape.parts if isinstance(shape, Structure) else (shape,)


def solids_of(shape: Shape | Structure, width: float) -> list[tuple[Fixture, Mesh]]:
    """Return the joints, supports and forces of a structure with their solids; a strip alone has none."""
    return shape.solids(width) if isinstance(shape, Structure) else []


def flat_across(shape, law):
    """The shape with its sections straight along d1 if the law has no generators."""
    return shape if law.has_rulings else replace(shape, eta=np.zeros_like(shape.eta))


def standing(shape: Shape | Structure, up: tuple[float, float, float] = DIRECTIONS["normal"]) -> Shape | Structure:
    """Return the shape on axes of which the last one is ``up``, and the first one the tangent of the first end if it may be."""
    z = np.array(up)
    ahead = DIRECTIONS["tangent"] if abs(z[2]) < _UPRIGHT else DIRECTIONS["normal"]
    x = np.array(ahead) - z * (z @ ahead)
    x /= np.linalg.norm(x)
    return moved(shape, np.array([x, np.cross(z, x), z]), np.zeros(3))


def moved(shape, axes: np.ndarray, by: np.ndarray, scale: float = 1.0):
    """Return a shape, or a structure, on new axes (rows), moved there, and then scaled."""
    if isinstance(shape, Structure):
        there = []
        for one in shape.fixtures:
            axis = tuple(axes @ one.axis) if one.in_space else one.axis
            there.append(replace(one, arm=tuple(scale * x for x in one.arm), axis=axis))
        return replace(shape, parts=tuple(moved(part, axes, by, scale) for part in shape.parts), fixtures=tuple(there))
    x = (shape.centreline @ axes.T + by) * scale
    return replace(shape, arclength=shape.arclength * scale, centreline=x, directors=shape.directors @ axes.T)
