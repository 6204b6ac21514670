"""What is held at an end of an open strip or between its ends, and the conditions that follow.

At the first end the clamp is given: its frame is the lab axes, its place the origin. Directions are named after the strip
there: ``width`` (d1), ``normal`` (d2), ``tangent`` (d3). At the last end the prescribed frame q1 comes from the first one by
``swing`` about the normal, then ``bend`` about the width, then ``turn`` about the tangent, all axes fixed in space; the
prescribed place is (``shear``, ``rise``, ``distance``) along width, normal and tangent.

A frame is held by conditions on v = vec(conj(q1) q), which vanishes for q = q1 and q = -q1. The length of q is kept by the
equations: a clamp has three conditions, at the first end four numbers are fixed instead. What is not held is free, and its
moment or force vanishes there.

| rotation                 | conditions |
| clamped                  | v = 0 |
| hinged about an axis a   | the two components of v perpendicular to a vanish |
| joint of axes a and b    | director b stays perpendicular to a, fixed in space |
| free                     | none |
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

from contin.lowlevel import levels, meant
from ribbon_model.equilibrium import directors

#: Directions by name, as unit vectors on the lab axes.
DIRECTIONS = {"width": (1.0, 0.0, 0.0), "normal": (0.0, 1.0, 0.0), "tangent": (0.0, 0.0, 1.0)}
#: The numbers that prescribe the place of the last end, in the order of `DIRECTIONS`, and its frame.
PLACE, ANGLES = ("shear", "rise", "distance"), ("turn", "bend", "swing")
#: Rotations of an end.
CLAMPED, HINGED, JOINT, FREE = "clamped", "hinged", "joint", "free"
#: A part of a unit vector below this is zero.
LOOSE = 1e-9

Vector = tuple[float, float, float]


def unit(what: str, vector) -> Vector:
    """Return a vector of length one; raise ValueError where it is no vector of three numbers, or zero."""
    values = tuple(float(value) for value in vector)
    length = math.sqrt(sum(value * value for value in values))
    if len(values) != 3 or not levels.LOCATED < length < math.inf:
        raise ValueError(f"{what}: {list(vector)} must be three numbers, not all zero")
    if abs(length - 1) < levels.LAST_PLACES:
        return values  # type: ignore[return-value]
    return tuple(value / length for value in values)  # type: ignore[return-value]


@dataclass(unsafe_hash=True)  # the fields are normalised when it is made, and then left as they are
class End:
    """What is held at an end.

    Attributes
    ----------
    rotation : str
        'clamped', 'hinged', 'joint' or 'free'.
    axis : tuple of float
        Of a hinge, on the prescribed frame; of a joint, the axis that is fixed in space.
    director : int or tuple of float
        Of a joint: the number (0, 1, 2) of the director that stays perpendicular to the axis; or its parts on them.
    held : tuple of vectors
        Directions along which the place is prescribed.
    pushes : bool
        The support pushes along the only one of these, and cannot pull.

    Raises
    ------
    ValueError
        One sentence: directions that repeat each other, an unknown word.
    """

    rotation: str = CLAMPED
    axis: Vector = DIRECTIONS["width"]
    director: int | Vector = 0
    held: tuple[Vector, ...] = tuple(DIRECTIONS.values())
    pushes: bool = False

    def __post_init__(self) -> None:
        import numpy as np

        if self.rotation not in (CLAMPED, HINGED, JOINT, FREE):
            raise ValueError(f"rotation: {self.rotation!r} must be clamped, hinged, joint or free")
        self.axis = unit("axis", self.axis)
        self.held = tuple(unit("held", vector) for vector in self.held)
        if len(self.held) and np.linalg.matrix_rank(np.array(self.held), tol=1e-6) < len(self.held):
            raise ValueError(f"held: the {len(self.held)} directions repeat each other; give independent ones, at most three")
        self.director = tuple(DIRECTIONS.values())[self.director] if isinstance(self.director, int) else self.director
        if self.rotation == JOINT and abs(along(self.axis, self.director)) > 1 - 1e-6:
            raise ValueError("joint: the director must not lie along the axis, to which it stays perpendicular")

    @property
    def words(self) -> str:
        """What is held, in words, for titles and messages."""
        place = {3: "", 2: ", slides along a line", 1: ", slides in a plane", 0: ""}[len(self.held)]
        place = ", pushed along a line" if self.pushes else place
        if not self.held:
            return "free" if self.rotation == FREE else f"{self.rotation}, free to move"
        return ("ball joint" if self.rotation == FREE else self.rotation) + place


@dataclass(unsafe_hash=True)
class Support(End):
    """An end whose place and rotation are prescribed by numbers of other names than those of its joint.

    Attributes
    ----------
    numbers : tuple of str
        Names of the numbers for the place along the axes and for turn, bend and swing, as far as they are held; without any,
        nothing moves this end.
    origin : tuple of float, optional
        The place from which they count, the drawn one by default.
    strokes : tuple of (name, direction)
        Further displacements.
    """

    numbers: tuple[str, ...] = ()
    origin: Vector | None = None
    strokes: tuple[tuple[str, Vector], ...] = ()


#: Ends by name.
CLAMP = End()
FREE_END = End(FREE, held=())
BALL = End(FREE)


def hinge(axis: str | Vector = "width", held=None) -> End:
    """Return a hinge about an axis."""
    vector = DIRECTIONS[axis] if isinstance(axis, str) else axis
    return End(HINGED, vector, held=CLAMP.held if held is None else held)


def perpendicular(axis: Vector) -> tuple[Vector, Vector]:
    """Return two directions perpendicular to an axis and to each other; coordinate axes for coordinate axes."""
    smallest = min(range(3), key=lambda i: abs(axis[i]))
    first = unit("axis", [float(i == smallest) - axis[smallest] * axis[i] for i in range(3)])
    return first, unit("axis", cross(axis, first))


def cross(a: Vector, b: Vector) -> Vector:
    """Return the cross product of two vectors."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def product(a, b):
    """Return the product of two quaternions."""
    a0, a1, a2, a3 = a
    b0, b1, b2, b3 = b
    return (
        a0 * b0 - a1 * b1 - a2 * b2 - a3 * b3, a0 * b1 + a1 * b0 + a2 * b3 - a3 * b2,
        a0 * b2 - a1 * b3 + a2 * b0 + a3 * b1, a0 * b3 + a1 * b2 - a2 * b1 + a3 * b0,
    )  # fmt: skip


def prescribed(turn, bend, swing):
    """Return the quaternion of the prescribed frame of the last end."""
    first = (math.cos(swing / 2), 0, math.sin(swing / 2), 0)
    second = product((math.cos(bend / 2), math.sin(bend / 2), 0, 0), first)
    return product((math.cos(turn / 2), 0, 0, math.sin(turn / 2)), second)


def angles_of(q) -> tuple[float, float, float]:
    """Return turn, bend and swing (the inverse of `prescribed`, turn and swing from -pi to pi) of a quaternion."""
    d = directors(*q)
    return math.atan2(-d[3], d[4]), math.asin(min(max(d[5], -1.0), 1.0)), math.atan2(-d[2], d[8])


def relative(q, q1):
    """Return conj(q1) q: the rotation from the prescribed frame to the frame, on the prescribed frame."""
    return product((q1[0], -q1[1], -q1[2], -q1[3]), q)


def rotation_conditions(end: End) -> Callable[..., tuple]:
    """Return ``conditions(q, q1)``, what vanishes for the frame q of an end whose prescribed frame is q1."""
    if end.rotation == FREE:
        return lambda q, q1: ()
    if end.rotation == CLAMPED:
        return lambda q, q1: relative(q, q1)[1:]
    if end.rotation == HINGED:
        pair = perpendicular(end.axis)
        return lambda q, q1: tuple(along(vector, relative(q, q1)[1:]) for vector in pair)
    return lambda q, q1: (along(end.axis, _turned(end.director, relative(q, q1))),)


def angle_of(end: End) -> Callable[..., float] | None:
    """Return ``angle(q, q1)``: by how much an end has turned about the axis of its hinge or joint; None without one."""
    axis = end.axis
    if end.rotation == HINGED:

        def hinged(q, q1):
            scalar, *vector = relative(q, q1)
            return 2 * math.atan2(along(axis, vector), scalar)

        return hinged
    if end.rotation != JOINT:
        return None
    zero = unit("axis", [x - along(axis, end.director) * a for x, a in zip(end.director, axis)])
    side = cross(axis, zero)

    def joint(q, q1):
        director = _turned(end.director, relative(q, q1))
        return math.atan2(along(side, director), along(zero, director))

    return joint


def _turned(vector: Vector, q) -> list:
    """Return a vector that is fixed on the directors of a quaternion."""
    d = directors(*q)
    return [along(vector, d[i::3]) for i in range(3)]


def along(vector: Vector, components):
    """Return a component of a vector, without terms that are zero: a condition that fixes one state stays one."""
    return sum(a * x for a, x in zip(vector, components) if a != 0)


def check_known(numbers: Iterable[str], known: Sequence[str], where: str = "numbers: ") -> None:
    """Raise ValueError for a number that nothing uses."""
    for name in numbers:
        if name not in known:
            there = ", ".join(dict.fromkeys(known)) or "none"
            raise ValueError(f"{where}{name}{meant(name, known)} is used by nothing here; there are {there}")


# --- a roller: a condition under an integral, as a phase ------------------------------------------------------------------


#: Fewest intervals of the mesh of a strip with a roller, and the most that are added so that one ends there. It is not adapted.
_FEWEST, _MOST = 20, 100


@dataclass(unsafe_hash=True)  # the direction is normalised when it is made, and then left as it is
class Roller:
    """A support between the ends, which holds the place of one point of the strip along a direction.

    Attributes
    ----------
    at : float
        Arclength of this point, a multiple of 1/N for a whole number N up to 100.
    direction : tuple of float
        The strip's place there along it is the number ``roller``.
    pushes : int
        1 or -1: it pushes that way along the direction, and cannot pull; 0 holds to both sides.

    Raises
    ------
    ValueError
        A field that does not fit; one sentence.

    Notes
    -----
    The place is x(at) = the integral of d3 up to there, so a roller is an integral condition whose density jumps at a mesh
    point. Its multiplier is the force of the roller on the strip, and the contact force before it is larger by this.
    """

    at: float
    direction: Vector
    pushes: int = 0

    def __post_init__(self) -> None:
        self.direction = unit("roller", self.direction)
        if not 0 < self.at < 1 or self.intervals() == 0:
            raise ValueError(f"roller: at: {self.at:g} must be a multiple of 1/N between 0 and 1, with N up to {_MOST}")

    def intervals(self, least: int = _FEWEST) -> int:
        """Return a number of equal intervals, not below ``least``, one of which ends at the roller; 0 if there is none."""
        counts = range(max(least, _FEWEST), max(least, _FEWEST) + _MOST)
        return next((count for count in counts if abs(self.at * count - round(self.at * count)) < LOOSE), 0)

    holds, name = True, "support"

    def density(self, member: int, t, x, p, count: int):
        """Return what is integrated over the strip, and vanishes where it is held; as `ribbon_model.phases.Phase.density`."""
        before = (1 - (t - self.at) / (abs(t - self.at) + 1e-300)) / 2
        return before * along(self.direction, directors(*x[:4])[6:]) - p.roller
