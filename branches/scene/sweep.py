"""Scenes of many branches: lists in place of single values; every combination is a scene of its own."""

from __future__ import annotations

import copy
import itertools
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, ClassVar

from branches.scene.fields import Scene


@dataclass(frozen=True)
class Sweep:
    """A scene with lists in place of single values, or with ``pairs`` of (m, n).

    Attributes
    ----------
    title : str
    values : dict
        The fields of the scene as given.
    scenes : dict of str to Scene
        The scene of every combination, by the name of its result file; without those that are no branch of their own.
    numbers : dict of str to dict
        Names and values of what the combination is of, by the same name.
    absent : dict
        Combinations that cannot be run, by name, with the reason: no such bifurcation, or one outside the limits.
    """

    many: ClassVar[bool] = True
    title: str
    values: dict
    scenes: dict[str, Scene]
    numbers: dict[str, dict[str, Any]]
    absent: dict[str, str]

    def fields(self) -> dict:
        """Return the fields of the scene as they are written."""
        return next(iter(self.scenes.values())).as_written(self.values)


def combinations(values: dict, axes: list[tuple[tuple, list[tuple]]]) -> Iterator[tuple[dict[str, Any], dict]]:
    """Yield names and values of what varies, and the fields of the scene, of every combination."""
    for chosen in itertools.product(*(entries for _, entries in axes)):
        fields, numbers = copy.deepcopy(values), {}
        for (places, _), entries in zip(axes, chosen):
            for place, value in zip(places, entries):
                part = fields
                for key in place[:-1]:
                    part = part[key]
                part[place[-1]] = numbers[_name(place)] = value
        yield numbers, fields


def _name(place: tuple) -> str:
    """Return the name of a value: its own, with the stage or the part that it belongs to."""
    if place[0] == "stages":
        return f"stage {place[1] + 1} {place[-1]}"
    return "roller at" if place[0] == "roller" else place[-1]
