"""Names on the lines of a picture: each on its own line, where no other line, mark or name is near."""

from __future__ import annotations

import functools

import numpy as np
from scipy.spatial import KDTree

from branches.draw.style import points

#: How names are written.
_STYLE = {
    "ha": "center", "va": "center", "zorder": 2.5,
    "bbox": {"boxstyle": "square,pad=0.05", "facecolor": "white", "edgecolor": "none"},
}  # fmt: skip
#: Colour of the thin line from a name to its line.
_LEADER = "#777777"
#: Room that a name keeps around itself, in pixels, and distance of points along a line; and the distance, in sizes of the name,
#: beyond which more is no better.
_ROOM, _FAR = 1.5, 2.5
#: Points of a line at which a thin line may end; the distance to other lines there, in pixels, if it has to cross others.
_ENDS, _ALONE = 60, 4.0
#: Longest of these lines, in pixels: a name farther away belongs to another line for the eye.
_LONGEST = 80.0


def name_lines(axes, named, obstacles, taken=()) -> list[str]:
    """Write names on lines, and return those for which there is no place; the layout of the figure has to be done.

    A line on which there is no room for its name has it beside, at the end of a thin line.

    Parameters
    ----------
    named : list of (str, ndarray, ndarray)
        Name of each line, and its x and y.
    obstacles : list of (ndarray, ndarray)
        Other lines, and marks, by their x and y.
    taken : list of matplotlib.transforms.Bbox
        Parts of the picture, in pixels, where no name may stand.
    """
    own = [_resampled(axes, x, y) for _, x, y in named]
    others = [_resampled(axes, x, y) for x, y in obstacles] + [_grid(box) for box in taken]
    frame, to_data, missing = axes.bbox.get_points(), axes.transData.inverted().transform, []
    for place_for in (_on, _beside, functools.partial(_beside, alone=_ALONE)):
        left, missing = sorted(range(len(named)), key=lambda i: len(own[i])) if place_for is _on else missing, []
        for number in left:
            text = axes.text(0, 0, named[number][0], fontsize=points(9), **_STYLE)
            half = np.array(text.get_window_extent().size) / 2 + _ROOM
            there = np.concatenate([line for i, line in enumerate(own) if i != number] + others)
            line = own[number][((own[number] > frame[0]) & (own[number] < frame[1])).all(axis=1)]
            found = place_for(line, there, half, frame)
            if found is None:
                text.remove()
                missing.append(number)
                continue
            place, end = map(to_data, found)
            text.set_position(place)
            if place_for is not _on:
                axes.plot(*zip(place, end), color=_LEADER, lw=0.7, zorder=2.4)
            others.append(_grid(text.get_window_extent()))
    return [named[number][0] for number in missing]


def _on(line, there, half, frame):
    """The pixel of a line that is farthest from others, those in the middle preferred, twice; None without room for a name."""
    line = line[((line > frame[0] + half) & (line < frame[1] - half)).all(axis=1)]
    if not len(line):
        return None
    distance = _distances(line, there, half)
    if distance.max() < 1:
        return None
    best = line[np.argmax(distance - 0.2 * np.abs(np.linspace(-1, 1, len(line))))]
    return best, best


def _beside(line, there, half, frame, alone=0.0):
    """The nearest pixel at which a name has room, and that of its line, with no other line between unless ``alone``."""
    ends = line[_distances(line, there, np.full(2, alone or _ROOM)) >= 1]
    if not len(ends):
        return None
    corners = [np.arange(low + size, high - size, 2 * _ROOM) for low, high, size in zip(*frame, half)]
    places = np.stack(np.meshgrid(*corners), axis=-1).reshape(-1, 2)
    places = places[_distances(places, np.concatenate([there, line]), half) >= 1]
    others, ends = KDTree(there), ends[:: max(1, len(ends) // _ENDS)]
    away = np.linalg.norm(places[:, None] - ends, axis=2)
    for number in np.argsort(away.min(axis=1, initial=_LONGEST)):
        nearest = np.argmin(away[number])
        if away[number, nearest] >= _LONGEST:
            return None
        way = np.linspace(places[number], ends[nearest], 2 + int(away[number, nearest] / _ROOM))
        if alone or others.query(way, p=np.inf)[0].min() >= _ROOM:
            return places[number], ends[nearest]
    return None


def _distances(places, there, half) -> np.ndarray:
    """Distance of each place from the nearest of others, in sizes of a name, at most `_FAR`."""
    return KDTree(there / half).query(places / half, p=np.inf)[0].clip(max=_FAR)


def _resampled(axes, x, y) -> np.ndarray:
    """Pixels at equal distances along a line, or that of a mark."""
    pixels = axes.transData.transform(np.column_stack(np.atleast_1d(x, y)))
    way = np.append(0, np.cumsum(np.hypot(*np.diff(pixels, axis=0).T)))
    at = np.arange(0, way[-1] + _ROOM, _ROOM)
    return np.column_stack([np.interp(at, way, column) for column in pixels.T])


def _grid(box) -> np.ndarray:
    x, y = (np.linspace(low, high, max(2, int((high - low) / _ROOM))) for low, high in box.get_points().T)
    return np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
