"""The disentangled diagram: natural curvature across as it is, heights free between the circles, with few crossings.

The picture is a layered graph: the layers are the circles, each at the height of its covering index, and the edges are the
branches between them. A branch may climb wherever it likes, but never turns back on its way up or down. So the picture is
known from the order of the branches above each *column*, an abscissa where a branch begins, turns or leaves the window:

1. Cut the branches at the columns (`_course`). Between two columns nothing begins or ends, and two branches cross there if
   and only if their order differs at both.
2. For one branch, with all others fixed, the heights with the fewest crossings are a shortest path over (column, level)
   (`_shortest`): exact for this branch.
3. Place all branches so, one after the other; then take out some, one of them crossed, and place them anew; keep what is no
   worse. Stop where no branches cross (`_search`).
4. Draw the branches as straight as the order above the columns allows (`_straighten`).

Nothing but the order of the columns and the ends of the branches enters, so a computed diagram and its preview look alike.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

#: Levels between neighbouring circles; half as many beyond the first and the last circle. More of them cost time as their
#: square.
_LEVELS = 8
#: How often branches are placed anew while any cross, and how many at a time. The laws of Fig. 12 need 42, 15 and 0.
_TRIALS, _AGAIN = 100, 4
#: Costs beside that of a crossing, 1: of two branches at one level of a column, and at neighbouring levels or of climbing.
_TOUCHING, _NEAR = 0.3, 0.02
#: Rounds of straightening, and by how much each exceeds the way to a straight line.
_STRAIGHTENED, _BEYOND_STRAIGHT = 80, 1.5
#: The distance that branches and ends of branches keep above a column, relative to that of circles; less where many share the
#: room. They keep half of it from circles. With half of it branches seem to touch ends of others; with twice as much they go
#: far out of their way.
_APART = 0.13
#: Steps in kappa_n smaller than this are rounding errors of the splines, and columns that are closer are one.
_SAME = 1e-4
_OUTSIDE, _NOBODY = -1, np.zeros((0, 2))


@dataclass
class Course:
    """A branch cut at the columns.

    Attributes
    ----------
    column : ndarray of int, shape (T,)
        Along the branch; -1 for an end outside the window.
    at : ndarray, shape (T,)
        The same places in points of the branch.
    ends : (float, float or None)
        Heights of both ends; None where the branch leaves and may be anywhere.
    sense : int
        1 for a branch that rises, -1 for one that falls, 0 for one that comes back to its circle.
    height : ndarray, shape (T,)
    """

    column: np.ndarray
    at: np.ndarray
    ends: tuple[float, float | None]
    sense: int
    height: np.ndarray = field(default_factory=lambda: np.zeros(0))

    @cached_property
    def seen(self) -> np.ndarray:
        """Which steps lie between neighbouring columns, shape (T - 1,)."""
        return (np.abs(np.diff(self.column)) == 1) & (self.column[1:] != _OUTSIDE) & (self.column[:-1] != _OUTSIDE)

    @cached_property
    def interval(self) -> np.ndarray:
        """The left column of each step that is seen, shape (S,)."""
        return np.minimum(self.column[:-1], self.column[1:])[self.seen]

    def strands(self) -> np.ndarray:
        """Heights at the left and at the right column of each step that is seen, shape (S, 2)."""
        pairs = np.column_stack([self.height[:-1], self.height[1:]])[self.seen]
        return np.where((np.diff(self.column)[self.seen] > 0)[:, None], pairs, pairs[:, ::-1])


def heights(curves, ends, window) -> list[np.ndarray]:
    """Return the heights of branches in the disentangled picture, shape (K,) each.

    Parameters
    ----------
    curves : list of ndarray, shape (K,)
        kappa_n along each branch.
    ends : list of (float, float or None, int)
        Heights of both ends of each, None where it is free; and whether such a branch rises (1) or falls (-1).
    window : (float, float)
        Of kappa_n.
    """
    from threadpoolctl import threadpool_limits

    special = np.unique(np.concatenate([curve[_turns(curve)] for curve in curves]))  # where a branch begins, turns or ends
    special = special[(special > window[0]) & (special < window[1])]
    columns = np.concatenate([[window[0]], special[np.diff(special, prepend=window[0]) > _SAME], [window[1]]])
    courses = [_course(curve, columns, *end) for curve, end in zip(curves, ends)]
    circles = np.array(sorted({height for end in ends for height in end[:2] if height is not None}))
    step = np.diff(circles).min(initial=2.0) / (_LEVELS + 1)
    between = [np.linspace(low, high, _LEVELS + 2)[1:-1] for low, high in zip(circles[:-1], circles[1:])]
    beyond = step * np.arange(1, _LEVELS // 2 + 1)
    levels = np.sort(np.concatenate([circles, *between, circles[0] - beyond, circles[-1] + beyond]))
    with threadpool_limits(1, "blas"):  # the matrices are small
        _search(courses, levels, np.isin(levels, circles))
    _straighten(courses, columns, circles)
    return [_along(course, curve) for course, curve in zip(courses, curves)]


# --- branches and columns ---------------------------------------------------------------------------------------------


def _turns(curve) -> np.ndarray:
    """Numbers of the points where a branch begins, turns and ends."""
    step = np.diff(curve)
    moves = np.flatnonzero(np.abs(step) > _SAME)
    turns = moves[1:][np.sign(step[moves[1:]]) != np.sign(step[moves[:-1]])]
    return np.unique(np.concatenate([[0], turns, [len(curve) - 1]]))


def _course(curve, columns, start, end, sense) -> Course:
    """The branch cut at the columns; a branch between two circles rises (see `branches.graph.picture`)."""
    column, at, turns = [], [], _turns(curve)
    for first, last in zip(turns[:-1], turns[1:]):
        x, place = curve[first : last + 1], np.arange(first, last + 1.0)
        low, high = sorted((x[0], x[-1]))
        here = np.flatnonzero((columns > low - _SAME) & (columns < high + _SAME))
        way = 1 if x[-1] > x[0] else -1
        column += here[::way].tolist()
        at += np.interp(columns[here], x[::way], place[::way])[::way].tolist()
    outside = [not columns[0] <= curve[end] <= columns[-1] for end in (0, -1)]
    column = np.array([_OUTSIDE] * outside[0] + column + [_OUTSIDE] * outside[1])
    at = np.array([0.0] * outside[0] + at + [len(curve) - 1.0] * outside[1])
    side = (column[1:] == 0) | (column[1:] == len(columns) - 1)
    new = np.append(True, (np.diff(column) != 0) | (side & (np.diff(at) > 1)))  # a turn ends one part and begins the next
    if end is not None:
        sense = int(np.sign(end - start))
    return Course(column[new], at[new], (start, end), sense)


# --- fewest crossings -------------------------------------------------------------------------------------------------


def _search(courses, levels, circles) -> None:
    """Place all branches one after the other, then a crossed one and `_AGAIN` - 1 random others anew as long as any cross."""
    choose, everyone = np.random.default_rng(0), sorted(range(len(courses)), key=lambda i: len(courses[i].column))
    _place(courses, everyone, levels, circles)
    crossed = _crossed_each(courses)
    for _ in range(_TRIALS):
        if not crossed.any():
            return
        before = [course.height for course in courses]
        first = int(choose.choice(np.flatnonzero(crossed)))
        again = [first, *(i for i in choose.permutation(len(courses)).tolist() if i != first)][:_AGAIN]
        _place(courses, choose.permutation(again).tolist(), levels, circles)
        now = _crossed_each(courses)
        if now.sum() > crossed.sum():
            for course, height in zip(courses, before):
                course.height = height
        else:
            crossed = now


def _place(courses, order, levels, circles) -> None:
    """Place these branches anew among the others, twice: at first those that come later are not there."""
    for i in order:
        courses[i].height = np.zeros(0)
    for i in (*order, *order):
        _shortest(courses, i, levels, circles)


def _crossed_each(courses) -> np.ndarray:
    """How often each branch crosses others; one that touches another above a column and goes back crosses it half twice."""
    interval = np.concatenate([course.interval for course in courses])
    owner = np.repeat(np.arange(len(courses)), [len(course.interval) for course in courses])
    strands, found = np.concatenate([course.strands() for course in courses]), np.zeros(len(courses))
    for here in map(np.flatnonzero, interval == np.unique(interval)[:, None]):
        left, right = np.sign(strands[here, None] - strands[here]).transpose(2, 0, 1)
        other = owner[here, None] != owner[here]
        np.add.at(found, owner[here], np.sum((1 - left * right) / 2 * other, axis=1))
    return found


def _grouped(keys, values) -> dict:
    order = np.argsort(keys, kind="stable")
    known, first = np.unique(keys[order], return_index=True)
    return dict(zip(known.tolist(), np.split(values[order], first[1:])))


def _others(courses, mine: int) -> tuple[dict, dict]:
    """Heights of all other branches above each column (S,), and at both ends of each interval, by its left column (S, 2)."""
    others = [course for i, course in enumerate(courses) if i != mine and len(course.height)]
    if not others:
        return {}, {}
    above = _grouped(np.concatenate([course.column for course in others]), np.concatenate([course.height for course in others]))
    strands = np.concatenate([course.strands() for course in others])
    return above, _grouped(np.concatenate([course.interval for course in others]), strands)


def _shortest(courses, mine: int, levels, circles) -> None:
    """Give a branch the heights of least cost among the other branches as they are."""
    course = courses[mine]
    above, between = _others(courses, mine)
    spacing, last = np.diff(levels).min(), len(course.column) - 1
    climb = _NEAR * ((levels[:, None] - levels) / (levels[-1] - levels[0])) ** 2 * len(levels)
    wrong = course.sense * (levels[None, :] - levels[:, None]) < 0
    cost, came = np.full(len(levels), np.inf), []
    cost[np.argmin(np.abs(levels - course.ends[0]))] = 0.0
    for t in range(last):
        step = np.where(wrong, np.inf, 0.0)
        if course.seen[t]:
            here, beyond = course.column[t : t + 2]
            pairs = between.get(min(here, beyond), _NOBODY)
            left, right = np.sign(levels[:, None, None] - pairs).transpose(2, 0, 1)
            crossed = (left.shape[1] - left @ right.T) / 2  # by a step from a level (row) to another; half where it touches
            step = step + climb + (crossed if here < beyond else crossed.T)
        total = np.round(cost[:, None] + step, 6)
        came.append(np.argmin(total, axis=0))
        cost = total.min(axis=0)
        if t + 1 < last or course.ends[1] is None:
            cost = cost + np.where(circles, np.inf, 0.0)
            if course.column[t + 1] != _OUTSIDE:
                distance = np.abs(levels[:, None] - above.get(course.column[t + 1], _NOBODY[:, 0])) / spacing
                cost = cost + _TOUCHING * (distance < 0.5).sum(axis=1) + _NEAR * (distance < 1.5).sum(axis=1)
    level = int(np.argmin(cost)) if course.ends[1] is None else int(np.argmin(np.abs(levels - course.ends[1])))
    way = [level]
    for back in reversed(came):
        way.append(int(back[way[-1]]))
    course.height = levels[way[::-1]]


# --- straight lines ---------------------------------------------------------------------------------------------------


def _straighten(courses, columns, circles) -> None:
    """Move every height towards the straight line between its neighbours, as far as the order above its column allows.

    At the sides of the window, where a branch may end, the circles count as branches: none leaves on top of a circle.
    """
    spacing, sides = np.diff(circles).min(initial=2.0), (0, len(columns) - 1)
    square = np.ptp(columns) / (np.ptp(circles) + spacing)
    above = {column: circles.tolist() if column in sides else [] for column in range(len(columns))}
    slots = []
    for course in courses:
        slots.append([])
        for column, height in zip(course.column, course.height):
            slots[-1].append(len(above.setdefault(column, [])))
            above[column].append(height)
    above = {column: np.array(found) for column, found in above.items()}
    for _ in range(_STRAIGHTENED):
        for course, own in zip(courses, slots):
            for t in range(1, len(course.column) - (course.ends[1] is not None)):
                column = course.column[t]
                if column != _OUTSIDE:
                    goal = _straighter(course, t, columns, above[column], _APART * spacing, square)
                    course.height[t] = above[column][own[t]] = _beside(goal, course.height[t], circles, _APART / 2 * spacing)


def _straighter(course: Course, t: int, columns, beside, apart: float, square: float) -> float:
    """A height nearer to the straight line between the places before and after it that are seen, apart from those beside it.

    ``square`` is the height of the picture over its width, in its units: where the branch is steep, others have to be farther
    above or below it to be as far from it.
    """
    height, column, here = course.height, course.column, course.height[t]
    linked = [k for k in (t - 1, t + 1) if k < len(height) and course.seen[min(k, t)]]
    if not linked:
        return here
    steps = [columns[column[k]] - columns[column[t]] for k in linked]
    near = [1 / abs(step) for step in steps]
    straight = sum(weight * height[k] for weight, k in zip(near, linked)) / sum(near)
    apart *= math.hypot(1, square * min(abs((height[k] - here) / step) for k, step in zip(linked, steps)))
    goal = here + _BEYOND_STRAIGHT * (straight - here)
    low, high = beside[beside < here].max(initial=-np.inf), beside[beside > here].min(initial=np.inf)
    goal = (low + high) / 2 if high - low < 2 * apart else min(max(goal, low + apart), high - apart)
    if course.sense:
        ends = sorted((height[t - 1], height[t + 1] if t + 1 < len(height) else course.sense * np.inf))
        goal = min(max(goal, ends[0]), ends[1])
    return goal if low < goal < high else here


def _beside(goal: float, here: float, circles, clear: float) -> float:
    """The height ``goal``, beside a circle on which it would lie; on the side on which the branch is ``here``."""
    circle = circles[np.argmin(np.abs(circles - goal))]
    return circle + math.copysign(clear, here - circle) if abs(goal - circle) < clear and here != circle else goal


def _along(course: Course, curve) -> np.ndarray:
    """The heights at all points of the branch, shape (K,).

    Between columns they are linear in kappa_n, so that branches cross only where their order changes; up to a turn, they are
    as steep as the branch is.
    """
    number, turning = np.arange(len(curve)), np.zeros(len(course.column), bool)
    turning[1:-1] = (np.diff(course.column[1:]) * np.diff(course.column[:-1]) < 0) & course.seen[1:] & course.seen[:-1]
    last = course.height[-1] if course.ends[1] is None else course.ends[1]
    result = np.interp(number, np.concatenate([[0], course.at, [number[-1]]]), [course.ends[0], *course.height, last])
    for t in np.flatnonzero(course.seen):
        here = slice(math.ceil(course.at[t]), math.floor(course.at[t + 1]) + 1)
        x0, x1 = np.interp(course.at[t : t + 2], number, curve)
        part = np.clip((curve[here] - x0) / (x1 - x0), 0, 1)
        if turning[t]:
            part = np.sqrt(part)
        if turning[t + 1]:
            part = 1 - np.sqrt(1 - part)
        result[here] = course.height[t] + part * (course.height[t + 1] - course.height[t])
    return result
