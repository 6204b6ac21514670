"""Copies of strips by turns about an axis, which are written out before a scene of a network is read.

``side: {begin: ..., copies: 6 about z}`` stands for strips ``side_1`` to ``side_6``, each turned by a sixth of a turn from the
last one. What names ``side`` is copied and turned, too: joint ``foot: [side finish]`` is ``foot_1`` to ``foot_6``, and what is
held or acts at ``foot`` is held or acts at each. ``next side`` is the copy after, ``every side`` stands for all in one joint.
"""

from __future__ import annotations

import math
import re
from typing import Any

import numpy as np

#: Fields that hold vectors of the drawing in words.
_WORDS = {"x": [1, 0, 0], "y": [0, 1, 0], "z": [0, 0, 1]}


def copied(values: dict) -> dict:
    """Return the fields of a network with copies written out; raise ValueError for copies that are none."""
    strips, turns = values.get("strips"), {}
    for name, strip in strips.items() if isinstance(strips, dict) else ():
        if isinstance(strip, dict) and "copies" in strip:
            found = re.fullmatch(r"([2-9]|[1-9]\d) about ([xyz])", str(strip["copies"]))
            if not found:
                what = f"{strip['copies']!r} must be a number from 2 to 99 and an axis, as in 6 about z"
                raise ValueError(f"strips: {name}: copies: {what}")
            turns[name] = int(found[1]), "xyz".index(found[2])
    if not turns:
        return values
    found = dict(values)
    for part in ("strips", "joints", "held", "loads", "stages"):
        if part == "joints" and isinstance(values.get(part), dict):  # a joint of copies is copied, too
            turns |= {name: own for name, joint in values[part].items() if (own := _turns_of(joint, turns))}
        if part in values:
            found[part] = _written(values[part], turns)
    return found


def _turns_of(value: Any, turns: dict) -> tuple[int, int] | None:
    """Return the number and the axis of the copies that places or a joint name, None if they name none."""
    if isinstance(value, str):
        return turns.get(value.removeprefix("next ").split(" ")[0])
    places = value.get("strips", ()) if isinstance(value, dict) else value
    return next((own for place in places if isinstance(place, str) and (own := _turns_of(place, turns))), None)


def _written(value: Any, turns: dict) -> Any:
    """Return fields with names of copies in place of the names of what is copied."""
    if isinstance(value, list):
        return [_written(one, turns) for one in value]
    if not isinstance(value, dict):
        return value
    found: dict = {}
    for name, one in value.items():
        if own := _turns_of(name, turns) if isinstance(name, str) else None:
            found |= {_at(name, k, turns): _turned(one, k, own, turns) for k in range(own[0])}
        else:
            found[name] = _turned(one, 0, (1, 2), turns) if isinstance(one, list) else _written(one, turns)
    return found


def _at(place: str, k: int, turns: dict) -> str:
    """Return the name of a copy in a place."""
    name, _, rest = place.removeprefix("next ").partition(" ")
    number = (k + place.startswith("next ")) % turns[name][0] + 1
    return f"{name}_{number} {rest}".rstrip()


def _turned(value: Any, k: int, own: tuple[int, int], turns: dict, key: str = "") -> Any:
    """Return the fields of a copy: vectors are turned, and names are those of copies."""
    if isinstance(value, str) and key != "section" and _turns_of(value, turns):
        return _at(value, k, turns)
    if isinstance(value, str):
        return _turned(_WORDS[value], k, own, turns) if key in ("along", "normal") and value in _WORDS else value
    if isinstance(value, dict):
        fixed = key == "arm"  # of a joint: on the directors of the strips
        return {
            _at(name, k, turns) if _turns_of(name, turns) else name: one if fixed else _turned(one, k, own, turns, name)
            for name, one in value.items()
            if name != "copies"
        }
    if not isinstance(value, list):
        return value
    if k and len(value) == 3 and all(type(x) in (int, float) for x in value):
        a, (count, axis) = np.array(value, float), own
        c, s = math.cos(2 * math.pi * k / count), math.sin(2 * math.pi * k / count)
        a[[axis - 2, axis - 1]] = c * a[axis - 2] - s * a[axis - 1], s * a[axis - 2] + c * a[axis - 1]
        return (np.round(a, 15) + 0.0).tolist()
    found: list = []
    for one in value:
        every = one.removeprefix("every ") if isinstance(one, str) and one.startswith("every ") else ""
        all_of = _turns_of(every, turns) or (0, 0)
        found += [_at(every, j, turns) for j in range(all_of[0])] or [_turned(one, k, own, turns)]
    return found
