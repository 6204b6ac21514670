"""What is known of one demo of AUTO-07p: which of its runs contin states, and why it states no others."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

from contin import Branch, Point

#: Labels that are compared. EP and MX are ends of runs, RG are points that AUTO prints at regular distances.
LABELS = "LP", "BP", "HB", "PD", "TR", "CP", "BT", "ZH", "GH", "R1", "R2", "R3", "R4", "LPD", "UZ"

#: Distance of paired points, relative to max(1, |value|). AUTO's points at its own tolerances lie within 1e-3 of finer ones
#: in all but one demo; a hundred times less leaves them unpaired, ten times more joins neighbours of ``tor``.
NEAR = 2e-3

Column = str | Callable[[Point], float]


@dataclass(frozen=True)
class Part:
    """Runs of a demo beside branches of contin.

    Attributes
    ----------
    runs : sequence of int
        Numbers of AUTO's runs in the order of the demo's script, from 0.
    branches : callable
        ``branches()`` computes contin's branches.
    columns : mapping
        AUTO's columns that are compared, and contin's. The first tells where a point is; of a point with a given value (UZ)
        the second is shown.
    labels : sequence of str
        Labels that are compared.
    known : sequence
        Values by a third method: labels, and values by AUTO's columns.
    also : mapping
        contin's label to AUTO's, where one event has two names.
    near : float
        Points of one label that differ less, relative to max(1, |value|), in all columns are the same point.
    """

    runs: Sequence[int]
    branches: Callable[[], Sequence[Branch]]
    columns: Mapping[str, Column]
    labels: Sequence[str] = LABELS
    known: Sequence[tuple[str, Mapping[str, float]]] = ()
    also: Mapping[str, str] = field(default_factory=dict)
    near: float = NEAR


@dataclass(frozen=True)
class Demo:
    """A demo of AUTO-07p.

    Attributes
    ----------
    name, title : str
        The folder in AUTO's distribution, and what it is about.
    parts : sequence of Part
        Empty if contin does not state the demo.
    script : str
        The demo's script, if it is not named as the folder.
    note : str
        What is compared otherwise than stated, and what is behind differences; or the reason why nothing is compared.
    slow : bool
        Too slow to be repeated.
    """

    name: str
    title: str
    parts: Sequence[Part] = ()
    script: str = ""
    note: str = ""
    slow: bool = False

    @property
    def file(self) -> str:
        """AUTO's script of the demo."""
        return self.script or f"{self.name}.auto"
