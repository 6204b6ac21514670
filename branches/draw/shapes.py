"""Shapes of strips as they stand in pictures and files."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from branches.draw.structure import Structure
from ribbon_model.ends import DIRECTIONS
from ribbon_model.shape import Shape

#: A direction with a larger component along the tangent is that of a strip that stands upright.
_UPRIGHT = 0.99


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
