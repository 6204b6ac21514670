"""Scenes of many open strips: lists in place of numbers; every combination is a scene of its own."""

from __future__ import annotations

import copy
import itertools
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from branches.open_config import OpenConfig
from contin.lowlevel import exact_text

#: Parts of a scene in which every number may be a list.
_PARTS = ("material", "dimensions", "numbers", "closed")


@dataclass(frozen=True)
class OpenSweep:
    """A scene of many open strips.

    Attributes
    ----------
    title : str
    values : dict
        The fields of the scene as given.
    branches : dict of str to OpenConfig
        The scene of every combination, by the name of its result file.
    numbers : dict of str to dict
        Names and values of what the combination is of, by the same name.
    absent : dict
        Combinations that cannot be run, by name, with the reason.
    """

    title: str
    values: dict
    branches: dict[str, OpenConfig]
    numbers: dict[str, dict[str, Any]]
    absent: dict[str, str]


def lists_in(values: dict) -> dict[tuple, list]:
    """Return the lists that stand in place of numbers, by where they are in a scene."""
    return {place: value for place, value in _places(values) if isinstance(value, list)}


def _places(values: dict) -> Iterator[tuple[tuple, Any]]:
    for part in _PARTS:
        if isinstance(values.get(part), dict):
            yield from (((part, name), value) for name, value in values[part].items())
    if isinstance(values.get("roller"), dict):  # its direction is a list in any case
        yield ("roller", "at"), values["roller"].get("at")
    stages = values["stages"] if isinstance(values["stages"], list) else []
    for number, stage in enumerate(stages):
        if isinstance(stage, dict):
            yield ("stages", number, "to"), stage.get("to")
            numbers = stage.get("numbers")
            yield from (
                (("stages", number, "numbers", name), value)
                for name, value in (numbers.items() if isinstance(numbers, dict) else ())
            )


def combinations(values: dict, lists: dict[tuple, list]) -> Iterator[tuple[str, dict[str, Any], dict]]:
    """Yield name, names and values of the lists' entries, and the fields of the scene, of every combination."""
    names = [_name(place) for place in lists]
    for chosen in itertools.product(*lists.values()):
        fields = copy.deepcopy(values)
        for place, value in zip(lists, chosen):
            part = fields
            for key in place[:-1]:
                part = part[key]
            part[place[-1]] = value
        numbers = dict(zip(names, chosen))
        yield ", ".join(f"{name} = {_text(value)}" for name, value in numbers.items()), numbers, fields


def _name(place: tuple) -> str:
    """Return the name of a number: its own, with the stage that it belongs to."""
    if place[0] == "stages":
        return f"stage {place[1] + 1} {place[-1]}"
    return "roller at" if place[0] == "roller" else place[-1]


def _text(value: Any) -> str:
    return exact_text(value) if type(value) in (int, float) else str(value)


def file_of(numbers: dict[str, Any]) -> str:
    """Return the name of the result file of a combination."""
    return "_".join(f"{name}{_text(value)}".replace(" ", "_") for name, value in numbers.items()) + ".h5"
