"""Snap load, travel and strain of an open strip between two ends, an arch that is pushed until it snaps through."""

from __future__ import annotations

import json
from typing import NamedTuple

import numpy as np

from branches.draw.style import smooth
from branches.scene.open_stage import OpenStage
from branches.scene.parse import parse
from contin.lowlevel import Label
from ribbon_model.strip import Strip

#: Least distance of the ends, over the length. An arch of hinged ends at half the length passes through itself.
_NEAREST = 0.6


class Push(NamedTuple):
    """Points of the stable path of an arch that is pushed: travel in m, force in N, largest strain; what happens at its end."""

    travel: np.ndarray
    force: np.ndarray
    strain: np.ndarray
    end: str


def push(strip: Strip, distance: float, ends: str = "clamped", at: float = 0.5) -> Push:
    """Return the way of an arch whose place ``at`` is pushed towards the line of its ends, as far as it is stable.

    Where a symmetric state becomes unstable, the way goes on along the branch that leaves there. Raises ConfigError or
    ContinError where there is no such arch, ValueError where the ends are too near or too far.
    """
    low = _NEAREST * strip.length
    if not low <= distance < strip.length:
        raise ValueError(f"--distance: {distance:g} m must be from {low:g} m to below the length, {strip.length:g} m")
    sizes: dict = {name: getattr(strip, name) for name in ("width", "thickness", "length", "poisson_ratio", "youngs_modulus")}
    limits, at_none = {"roller": [-strip.length / 2, strip.length / 2]}, {"F_roller": [0]}
    follow = {"follow": "roller", "to": -distance / 2, "limits": limits, "label": at_none}
    scene = parse(json.dumps({
        "material": {}, "dimensions": sizes, "start": ends, "finish": ends, "begin": "arch", "roller": {"at": at},
        "steps": {"angle": 0.1}, "numbers": {"distance": distance}, "stages": [follow, follow | {"start_at": "BP 1"}],
    }), "strip")  # fmt: skip
    pieces, end, pushes = [[]], "the way ends", False
    stage = OpenStage(scene, 1)
    run = iter(stage.start())
    while (point := next(run, None)) is not None:
        bent = stage.strip.strains(point.system, point.x) / (2 * np.pi)
        force = 0.0 if point.label == Label.USER_ZERO else stage.found(point)["F_roller"]
        pieces[-1].append([point.arclength, point["roller"], -force, strip.strain(bent[:, 0], bent[:, 2]).max()])
        if point.label == Label.BRANCH_POINT and stage.number == 1 and point.index_change == (0, 1):
            stage, pieces = OpenStage(scene, 2), [*pieces, []]
            run = iter(stage.start([[point]]))
        elif point.index or (pushes and force >= 0):
            end = "the strip becomes unstable" if point.index else "the strip leaves it"
            break
        pushes = pushes or force < 0
    _, roller, force, strains = np.hstack([smooth(s, s, *rest) for s, *rest in (np.transpose(one) for one in pieces if one)])
    pushing = force >= 0
    table = roller[pushing] * scene.factor("roller"), force[pushing] * scene.factor("F_roller"), strains[pushing]
    (a, b), (f, g) = table[0][:2], table[1][:2]
    touches = a - f * (b - a) / (g - f)  # the first guess has a small force
    return Push(touches - table[0], *table[1:], end)


def answer(strip: Strip, distance: float, ends: str | None, at: float | None, yield_strain: float | None = None) -> str:
    """Return what the command prints of an arch that is pushed."""
    ends, at = ends or "clamped", 0.5 if at is None else at
    way = push(strip, distance, ends, at)
    top = int(np.argmax(way.force))
    beyond = yield_strain is not None and way.strain.max() > yield_strain
    lines = [
        f"arch between {ends} ends {1e3 * distance:.4g} mm apart, pushed at {at:g} of its length; strain {way.strain[0]:.3%}",
        f"snap load     {way.force[top]:.4g} N after {1e3 * way.travel[top]:.3g} mm of travel: more weight snaps it through",
        f"screw         {1e3 * way.travel[-1]:.4g} mm of travel until {way.end}; it is stable at each place before",
        f"strain        {way.strain.max():.3%} at most on this way, {way.strain[top]:.3%} under the snap load",
        *([f"caution: strains beyond the yield strain {yield_strain:g}"] if beyond else []),
    ]
    return "\n".join(lines) + "\n"
