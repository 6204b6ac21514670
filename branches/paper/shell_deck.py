"""The unfolding strip as a three-dimensional body: input decks for CalculiX, and the evaluation of its output.

The strip is naturally an arc of radius R in the plane (x, y), wide along z; its ends are turned by pi xi / 2 each, its plane of
symmetry is x = 0. Two methods compute the same planar state:

- 'direct', as in section 5.4 of Audoly & Seffen (2015): the stress-free arc is meshed, its rigid end faces are turned step by
  step, and may approach each other along x.
- 'thermal', for thin strips, for which the direct method is slow or fails: the arc of radius R/(1 - xi) is meshed, both
  end faces are held, and expansion along the strip, linear through the thickness, gives it the natural curvature 1/R. The
  ends cannot approach each other, so in-plane vibrations have no meaning; only the others are computed. It is for 0 < xi < 1.

For each state the lowest vibrations about it are computed. omega**2 has its sign: it is negative if the state is
unstable. Lengths in mm, steel; results do not depend on either.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

RADIUS, YOUNG, DENSITY = 100.0, 210e3, 7.8e-9  # mm, MPa, t/mm^3
#: Spacing of the states that the direct method passes through.
STEP = 0.1
#: Number of vibrations computed for a state; for the direct method so many that stiff out-of-plane ones are among them.
_MODES = {"thermal": 4, "direct": 12}
#: Motion of the centre line in the plane over that of the edge, squared: near 1 for in-plane vibrations, 0 for the others.
#: If the two kinds have nearly the same frequency, they may mix in the direct method; then neither is taken.
_IN_PLANE = 0.02
#: If the centre line of a state moves by more than this part of the width, the state is not planar.
_OUT = 0.01
#: Twenty-node bricks: corners, then the middles of these edges.
_CORNERS = np.array([(0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0), (0, 0, 2), (2, 0, 2), (2, 2, 2), (0, 2, 2)])
_EDGES = [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)]
_BRICK = np.vstack([_CORNERS, [(_CORNERS[a] + _CORNERS[b]) // 2 for a, b in _EDGES]])
#: Newton's method on thin strips converges slowly: many iterations, and a force residual of half a per cent.
_PATIENCE = "*CONTROLS,PARAMETERS=TIME INCREMENTATION\n40,60,9,200,10,4,,5\n*CONTROLS,PARAMETERS=FIELD\n5e-3"


@dataclass(frozen=True)
class Strip:
    """A semicircular strip and its mesh.

    Attributes
    ----------
    nu : float
    slenderness : float
        R/w.
    thinness : float
        w/h.
    along, across : int
        Numbers of elements; one through the thickness. ``across`` is even, so that the centre of an end is a node.
    """

    nu: float
    slenderness: float
    thinness: float
    along: int = 60
    across: int = 6

    def __post_init__(self):
        if not (-1 < self.nu < 0.5 and self.slenderness > 0 and self.thinness > 0):
            raise ValueError(f"nu = {self.nu:g}, R/w = {self.slenderness:g}, w/h = {self.thinness:g}: no strip")
        if self.along < 2 or self.across < 2 or self.across % 2:
            raise ValueError(f"along = {self.along}, across = {self.across}: two elements at least, an even number across")

    @property
    def width(self) -> float:
        """w in mm."""
        return RADIUS / self.slenderness

    @property
    def thickness(self) -> float:
        """h in mm."""
        return self.width / self.thinness

    @property
    def number(self) -> float:
        """w**2/(R h), the parameter of the law 'finite width'."""
        return self.thinness / self.slenderness

    @property
    def unit(self) -> float:
        """D/(rho h R**4), the unit of omega**2, D the bending modulus of the plate."""
        return YOUNG * self.thickness**2 / (12 * (1 - self.nu**2) * DENSITY * RADIUS**4)


@dataclass(frozen=True)
class State:
    """The result at one xi: the lowest out-of-plane omega**2, in units of D/(rho h R**4), and whether the state is planar."""

    omega_squared: float
    planar: bool


# --- decks ------------------------------------------------------------------------------------------------------------


class _Mesh:
    """Return the nodes on a grid of half elements, i along (counterclockwise about z), j across, k through the thickness."""

    def __init__(self, strip: Strip, radius: float, angle: float):
        self.strip, self.nodes = strip, {}
        points = []
        for i in range(2 * strip.along + 1):
            phi = math.pi / 2 + angle * (i / (2 * strip.along) - 0.5)
            for j in range(2 * strip.across + 1):
                for k in range(3):
                    if i % 2 + j % 2 + k % 2 <= 1:  # corners and middles of edges
                        self.nodes[i, j, k] = len(points) + 1
                        r = radius + (k - 1) * strip.thickness / 2
                        points.append((r * math.cos(phi), r * math.sin(phi), strip.width * (j / (2 * strip.across) - 0.5)))
        self.points = np.array(points)

    def text(self) -> Iterator[str]:
        """Return nodes, elements and the sets for the results."""
        yield "*NODE,NSET=ALL"
        yield from (f"{number},{_real(x)},{_real(y)},{_real(z)}" for number, (x, y, z) in enumerate(self.points, 1))
        yield "*ELEMENT,TYPE=C3D20R,ELSET=STRIP"
        number = 0
        for i in range(0, 2 * self.strip.along, 2):
            for j in range(0, 2 * self.strip.across, 2):
                number += 1
                brick = [self.nodes[i + a, j + b, c] for a, b, c in _BRICK]
                yield f"{_list([number, *brick[:15]])},\n{_list(brick[15:])}"
        middle, last = self.strip.across, 2 * self.strip.across
        yield from _set("CENTRE", [node for (i, j, k), node in self.nodes.items() if (j, k) == (middle, 1)])
        yield from _set("EDGE", [node for (i, j, k), node in self.nodes.items() if (j, k) == (last, 1)])

    def end(self, i: int, k: int | None = None) -> list[int]:
        """Return the nodes of an end face, or of its layer k."""
        return [node for (a, _, c), node in self.nodes.items() if a == i and k in (None, c)]


def _real(value: float) -> str:
    """Return a number as text; CalculiX reads at most 20 characters of a field."""
    return f"{value:.12e}"


def _list(numbers: Iterable[int]) -> str:
    return ",".join(map(str, numbers))


def _set(name: str, nodes: Sequence[int]) -> Iterator[str]:
    yield f"*NSET,NSET={name}"
    yield from (_list(nodes[a : a + 10]) for a in range(0, len(nodes), 10))


def _material(strip: Strip) -> list[str]:
    return ["*MATERIAL,NAME=M", f"*ELASTIC\n{_real(YOUNG)},{_real(strip.nu)}", f"*DENSITY\n{_real(DENSITY)}"]


def _static() -> list[str]:
    return ["*STEP,NLGEOM,INC=1000", "*STATIC\n1,1", _PATIENCE]


_SHAPE = ["*NODE PRINT,NSET=CENTRE\nU", "*END STEP"]


def _vibrations(way: str, *conditions: str) -> list[str]:
    return ["*STEP,PERTURBATION", f"*FREQUENCY\n{_MODES[way]}", *conditions, "*NODE PRINT,NSET=EDGE\nU", *_SHAPE]


def thermal_deck(strip: Strip, xi: float) -> str:
    """Return the deck of one state, 0 < xi < 1, for the thermal method.

    By symmetry the centre line of the state does not move along z, and that of an out-of-plane vibration along z only. Both are
    prescribed: near the instability round-off would drive Newton's method out of the plane, and vibrations would mix.
    """
    if not 0 < xi < 1:
        raise ValueError(f"xi = {xi:g}: the thermal method is for 0 < xi < 1")
    mesh = _Mesh(strip, RADIUS / (1 - xi), math.pi * (1 - xi))
    lines = [*mesh.text(), *_set("ENDS", mesh.end(0) + mesh.end(2 * strip.along)), *_material(strip)]
    lines += ["*EXPANSION,TYPE=ORTHO\n0,1,0", "*ORIENTATION,NAME=O,SYSTEM=CYLINDRICAL\n0,0,0,0,0,1"]
    lines += ["*SOLID SECTION,ELSET=STRIP,MATERIAL=M,ORIENTATION=O", "*INITIAL CONDITIONS,TYPE=TEMPERATURE\nALL,0"]
    lines += ["*BOUNDARY\nENDS,1,3\nCENTRE,3,3", *_static(), "*TEMPERATURE"]
    outer = xi / RADIUS * strip.thickness / 2  # y (kappa_n - kappa) on the outer face
    lines += [f"{node},{_real((k - 1) * outer)}" for (_, _, k), node in mesh.nodes.items()]
    vibrations = _vibrations("thermal", "*BOUNDARY,OP=NEW\nENDS,1,3\nCENTRE,1,2")
    return "\n".join([*lines, *_SHAPE, *vibrations, ""])


def direct_deck(strip: Strip, xis: Sequence[float]) -> str:
    """Return the deck of several states, xi ascending, for the direct method, which also passes through multiples of `STEP`."""
    if not (xis and xis[0] > 0 and all(a < b for a, b in zip(xis, xis[1:]))):
        raise ValueError(f"xi = {', '.join(f'{xi:g}' for xi in xis)}: must be positive and ascending")
    mesh = _Mesh(strip, RADIUS, math.pi)
    lines = [*mesh.text(), *_material(strip), "*SOLID SECTION,ELSET=STRIP,MATERIAL=M"]
    inner = len(mesh.points) + 1
    outer = inner + 1  # these two carry u_x of two layers of the moving end, minus that of its centre
    lines.append(f"*NODE\n{inner},0,-10,0\n{outer},0,-20,0")
    right, left = 0, 2 * strip.along
    centre = mesh.nodes[right, strip.across, 1]
    lines.append("*EQUATION")
    for (i, _, k), node in mesh.nodes.items():
        if i == right and node != centre:
            carrier = {0: f",{inner},1,-1.", 1: "", 2: f",{outer},1,-1."}[k]
            lines.append(f"{2 if k == 1 else 3}\n{node},1,1.,{centre},1,-1.{carrier}")
    path = sorted({round(STEP * n, 9) for n in range(1, int(xis[-1] / STEP) + 1)} | set(xis))
    for xi in path:
        lines += [*_static(), "*BOUNDARY", *_turned(mesh, left, right, inner, outer, math.pi * xi / 2)]
        lines += [*_SHAPE, *_vibrations("direct")] if xi in xis else ["*END STEP"]
    return "\n".join([*lines, ""])


def _turned(mesh: _Mesh, left: int, right: int, inner: int, outer: int, angle: float) -> Iterator[str]:
    """Return the displacements of the two rigid end faces, each rotated by ``angle`` towards the flat strip."""
    fall, rise = math.cos(angle) - 1, math.sin(angle)
    for k in range(3):
        y = (k - 1) * mesh.strip.thickness / 2  # outwards, that is along -x on the left and along x on the right
        for node in mesh.end(left, k):
            yield f"{node},1,1,{_real(-y * fall)}\n{node},2,2,{_real(y * rise)}\n{node},3,3,0."
        for node in mesh.end(right, k):
            yield f"{node},2,2,{_real(y * rise)}\n{node},3,3,0."
    half = mesh.strip.thickness / 2
    yield f"{inner},1,1,{_real(-half * fall)}\n{inner},2,3,0.\n{outer},1,1,{_real(half * fall)}\n{outer},2,3,0."


# --- output -----------------------------------------------------------------------------------------------------------

_NUMBER = r"\s+([-+]?\d\.\d+E[-+]\d+)"
_DISPLACEMENT = re.compile(rf"\s*\d+{_NUMBER * 3}\s*$")
_EIGENVALUE = re.compile(rf"\s*\d+{_NUMBER * 4}\s*$")
_TABLE, _BLOCK = "E I G E N V A L U E   O U T P U T", re.compile(r"\s*displacements .* for set (\w+) and time")


def states(text: str, strip: Strip) -> list[State]:
    """Return the complete states of a ``.dat`` file, in the order of the deck; a failed run has fewer.

    Raises ValueError for a state without an out-of-plane vibration among those printed.
    """
    found, shape, values, modes = [], None, [], []
    for kind, content in _tables(text):
        if kind == "eigenvalues":
            values, modes = content, []
        elif len(modes) < 2 * len(values):
            modes.append(content)
            if len(modes) == 2 * len(values):
                found.append(_state(shape, values, modes, strip))
                values = []
        else:
            shape = content
    return found


def _tables(text: str) -> Iterator[tuple[str, np.ndarray]]:
    """Yield ('eigenvalues', (modes,)) and ('CENTRE' or 'EDGE', (nodes, 3)), in the order of the file."""
    kind, rows = "", []
    for line in text.splitlines():
        block = _BLOCK.match(line)
        if block or _TABLE in line or "P A R T I C I P A T I O N" in line:
            if rows:
                yield kind, np.array(rows)
            kind, rows = block[1] if block else "eigenvalues" if _TABLE in line else "", []
        elif kind:
            row = (_EIGENVALUE if kind == "eigenvalues" else _DISPLACEMENT).match(line)
            if row:
                rows.append(float(row[1]) if kind == "eigenvalues" else [float(value) for value in row.groups()])
    if rows:
        yield kind, np.array(rows)


def _state(shape, values, modes, strip: Strip) -> State:
    """Return the state. In out-of-plane vibrations the centre line moves along z only; in pure twist only the edge moves."""
    out = [
        value
        for value, edge, centre in zip(values, modes[::2], modes[1::2])
        if np.sum(centre[:, :2] ** 2) < _IN_PLANE * np.sum(edge**2)
    ]
    if not out:
        raise ValueError(f"none of the {len(values)} lowest vibrations is out of the plane")
    return State(float(min(out) / strip.unit), bool(np.abs(shape[:, 2]).max() < _OUT * strip.width))
