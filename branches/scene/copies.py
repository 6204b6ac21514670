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
    joints = values.get("joints")
    if isinstance(joints, dict):  # a joint of copies is copied, too
        turns |= {name: own for name, joint in joints.items() if (own := _turns_of(joint, turns))}
    parts = ("strips", "joints", "held", "loads", "stages")
    return values | {part: _copy(values[part], turns) for part in parts if part in values}


def _turns_of(value: Any, turns: dict) -> tuple[int, int] | None:
    """Return the number and the axis of the copies that places or a joint name, None if they name none."""
    if isinstance(value, str):
        return turns.get(value.removeprefix("next ").split(" ")[0])
    places = value.get("strips", ()) if isinstance(value, dict) else value
    return next((own for place in places if isinstance(place, str) and (own := _turns_of(place, turns))), None)


def _at(place: str, k: int, turns: dict) -> str:
    """Return the name of a copy in a place."""
    name, _, rest = place.removeprefix("next ").partition(" ")
    number = (k + place.startswith("next ")) % turns[name][0] + 1
    return f"{name}_{number} {rest}".rstrip()


def _copy(value: Any, turns: dict, k: int | None = None, own: tuple[int, int] = (1, 2), key: str = "") -> Any:
    """Return fields with copies in place of what is copied; of copy k, whose vectors are turned, if one is given."""
    if k is not None and key in ("along", "normal") and isinstance(value, str) and value in _WORDS:
        value = _WORDS[value]
    if isinstance(value, str):
        return value if k is None or key == "section" or not _turns_of(value, turns) else _at(value, k, turns)
    found: Any = {} if isinstance(value, dict) else []
    for name, one in value.items() if isinstance(value, dict) else ():
        each = _turns_of(name, turns) if isinstance(name, str) else None
        if each and k is None:
            found |= {_at(name, j, turns): _copy(one, turns, j, each) for j in range(each[0])}
        elif each:  # an angle, or an arm on the directors of its end, which turns with it
            found[_at(name, k, turns)] = one
        elif name != "copies":
            found[name] = _copy(one, turns, k, own, name)
    if not isinstance(value, list):
        return found if isinstance(value, dict) else value
    if k and len(value) == 3 and all(type(x) in (int, float) for x in value):
        a, (count, axis) = np.array(value, float), own
        c, s = math.cos(2 * math.pi * k / count), math.sin(2 * math.pi * k / count)
        a[[axis - 2, axis - 1]] = c * a[axis - 2] - s * a[axis - 1], s * a[axis - 2] + c * a[axis - 1]
        return (np.round(a, 15) + 0.0).tolist()
    for one in value:
        every = one.removeprefix("every ") if isinstance(one, str) and one.startswith("every ") else ""
        count, _ = _turns_of(every, turns) or (0, 0)
        found += [_at(every, j, turns) for j in range(count)] or [_copy(one, turns, k, own)]
    return found
