"""Settings of a run: what to follow, how carefully, and where to stop."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Annotated, Any, Literal, TypedDict

from contin import errors as checks
from contin import threads
from contin.collocation.mesh import MeshControl
from contin.core.newton import Newton
from contin.core.protocol import Discretization
from contin.core.trial import Event
from contin.errors import Positive, ProblemError, Within, warn
from contin.text import exact_text, meant

Angle = Annotated[float, Within(0, 1.5)]
Count = Annotated[int, Within(1, 10**9)]
Tolerance = Annotated[float, Within(1e-14, 1e-2)]

#: Tolerance of Newton's method between labelled points, as a part of that of the mesh: it adds little to that error. Ten
#: times larger, the longest demos take as long (1.5 % more), and one curve that breaks off ends 1e-6 off.
_LEFT = 0.1


@dataclass(frozen=True)
class Settings(checks.Named):
    """What to follow, how carefully, and where to stop. Frozen, checked when made.

    Attributes
    ----------
    primary : str, optional
        The parameter of folds and of the printed columns; the first free one by default.
    direction : int
        +1 or -1: the way to go from the first point, by the sign of the primary parameter's change.
    step, min_step, max_step : float
        First, smallest and largest step of arclength. Steps below the default ``min_step`` are taken, and noted, where a run
        goes on with them only.
    max_points : int
        Regular points after which the run ends.
    limits : mapping of str to pair of float
        The run ends where a parameter or functional leaves its interval.
    zeros : mapping of str to sequence of float
        Points where a parameter or functional reaches one of these values are labelled (UZ). A value that is given twice counts
        once.
    extrema : sequence of str
        Parameters and functionals whose extrema along the branch are labelled (EX).
    trivial : str, optional
        A parameter or functional that vanishes on a known trivial branch only: the run ends where it changes sign.
    events : sequence of Event
        Further functions of a point whose zeros are labelled. ``test_functions`` and ``monitors`` are its first names, which
        warn and will go.
    folds, branch_points : bool
        Look for folds, for branch points.
    corners : bool
        Label corners at the knots of tables, too (BC): hundreds may be passed in silence. A fold there is always labelled.
    errors : bool
        Solve labelled points again on finer meshes, until their errors, which follow from the last changes, are below the mesh
        tolerance.
    angle : float, optional
        Largest angle between the tangents of consecutive points, radians. By default 0.35, and 0.7 for cycles.
    change : float
        Largest change of any free parameter p in one step, as a fraction of 1 + |p|.
    accuracy : float, optional
        Distance between predicted and corrected point that the step aims at, as a fraction of the step. By default 0.02, and
        0.05 for cycles.
    path_tolerance : float, optional
        Error, relative to 1 + size, of the points between labelled ones, where the mesh adapts: 1e-8 is more than a picture
        shows, and long cycles take half the time. Labelled points are found again to the tolerances of ``newton`` and ``mesh``,
        which are smaller, on a mesh made for them, if ``errors`` are wanted. By default all points are as exact as these.
    scales : mapping of str to float
        Sizes of states and parameters, where those that the first point shows are not typical. Only those far from one matter.
    newton, mesh :
        See `Newton`, `MeshControl`.

    Raises
    ------
    ProblemError
        A value that is not allowed; the message names the field, the value and what is allowed.

    Examples
    --------
    >>> Settings(limits={"lam": (0, 4)}, zeros={"lam": [1.0]}).step
    0.05
    """

    primary: str | None = None
    direction: float = 1
    step: Positive = 0.05
    min_step: Positive = 1e-6
    max_step: float = 1e6
    max_points: Count = 2000
    limits: Mapping[str, Sequence[float]] = field(default_factory=dict)
    zeros: Mapping[str, Sequence[float]] = field(default_factory=dict)
    trivial: str | None = None
    monitors: Sequence[Event] = ()
    folds: bool = True
    branch_points: bool = True
    corners: bool = False
    errors: bool = True
    angle: Angle | None = None
    change: Angle = 0.4
    accuracy: Angle | None = None
    newton: Newton = field(default_factory=Newton)
    mesh: MeshControl = field(default_factory=MeshControl)
    test_functions: Sequence[Event] = ()
    scales: Mapping[str, float] = field(default_factory=dict)
    extrema: Sequence[str] = ()
    events: Sequence[Event] = ()
    path_tolerance: Tolerance | None = None

    def __post_init__(self) -> None:
        given = {name: getattr(self, name) for name in (*_FIRST_NAMES, "events")}
        for name, value in {**dict.fromkeys(_FIRST_NAMES, ()), **_by_new_name(given)}.items():
            object.__setattr__(self, name, value)
        self._check_columns()
        if not checks.is_number(self.direction) or self.direction not in (1, -1):
            raise ProblemError(f"direction: {checks.shown(self.direction)} must be +1 or -1 ('both' for trace and curve)")
        checks.fields(self)
        if not self.min_step <= self.step <= self.max_step:
            bounds = f"min_step = {exact_text(self.min_step)} and max_step = {checks.shown(self.max_step)}"
            raise ProblemError(f"step: {exact_text(self.step)} must lie between {bounds}")

    def on_path(self, system: Discretization) -> Settings:
        """Return the settings of steps between labelled points: there points are as exact as ``path_tolerance``."""
        newton, mesh, path = self.newton, self.mesh, self.path_tolerance or 0.0
        if not (system.intervals and mesh.every and self.errors and path > mesh.tolerance):
            return self
        newton = dataclasses.replace(newton, tolerance=max(newton.tolerance, _LEFT * path))
        return dataclasses.replace(self, newton=newton, mesh=dataclasses.replace(mesh, tolerance=path))

    def _check_columns(self) -> None:
        for name, size in checks.mapping("scales", self.scales, "positive numbers").items():
            checks.number(f"scales: {checks.plain(name)}", size, 0)
        for name, ends in checks.mapping("limits", self.limits, "pairs of numbers").items():
            what, allowed = f"limits: {checks.plain(name)}", "two numbers, the first the smaller"
            pair = tuple(checks.sequence(what, ends, allowed))
            if len(pair) != 2 or not all(map(checks.is_number, pair)) or not pair[0] < pair[1]:
                raise ProblemError(f"{what}: {checks.shown(ends)} must be {allowed}")
        for name, values in checks.mapping("zeros", self.zeros, "lists of numbers").items():
            for value in checks.sequence(f"zeros: {checks.plain(name)}", values, "numbers"):
                checks.number(f"zeros: {checks.plain(name)}", value)


def check(system: Discretization, settings: Settings) -> None:
    """Refuse settings that name what a problem does not have, and a system with too many or too few free parameters.

    Raises ProblemError otherwise.
    """
    threads.count()  # refuses a wrong number, also where the problem is too small to use it
    if len(system.free) != system.problem.free_size:
        raise ProblemError(
            f"free parameters: {len(system.free)} given ({', '.join(system.free)}), a curve of this problem needs "
            f"{system.problem.free_size} (conditions - states + 1)"
        )
    if settings.primary is not None and settings.primary not in system.free:
        raise ProblemError(f"primary: {settings.primary!r} is not one of the free parameters {', '.join(system.free)}")
    known = (*system.problem.parameters, *system.problem.functionals, *system.named_states)
    trivial = () if settings.trivial is None else (settings.trivial,)
    for name in (*settings.limits, *settings.zeros, *settings.extrema, *trivial):
        if name not in known:
            raise ProblemError(f"{name!r} is no column of this problem ({checks.listed(known)}){meant(name, known)}")
    checks.chosen("scales", list(settings.scales), [*dict.fromkeys((*known, *system.problem.states))])


class Options(TypedDict, total=False):
    """The fields of `Settings` by name, as `trace`, `curve` and `diagram` take them: a type checker knows what is misspelt."""

    primary: str | None
    direction: float | Literal["both"]
    step: Positive
    min_step: Positive
    max_step: float
    max_points: Count
    limits: Mapping[str, Sequence[float]]
    zeros: Mapping[str, Sequence[float]]
    trivial: str | None
    monitors: Sequence[Event]
    folds: bool
    branch_points: bool
    corners: bool
    errors: bool
    angle: Angle | None
    change: Angle
    accuracy: Angle | None
    newton: Newton
    mesh: MeshControl
    test_functions: Sequence[Event]
    scales: Mapping[str, float]
    extrema: Sequence[str]
    events: Sequence[Event]
    path_tolerance: Tolerance | None


def settings_with(settings: Settings | None, options: Mapping[str, Any]) -> Settings:
    """Return the settings with some fields changed; raise ProblemError for an unknown field, or a value that it cannot have."""
    checks.instance("settings", settings, (Settings, type(None)), "a Settings")
    options, known = _by_new_name(options), settings or Settings  # the class has the usual values
    if "step" not in options and checks.is_number(options.get("max_step")):  # the first step is no longer than the largest
        options = {**options, "step": min(known.step, max(options["max_step"], known.min_step))}
    return Settings(**options) if settings is None else dataclasses.replace(settings, **options)


#: First names of the field ``events``, which stay for one version.
_FIRST_NAMES = ("monitors", "test_functions")


def _by_new_name(options: Mapping[str, Any]) -> dict[str, Any]:
    """Return fields with the events that were given by their first names, and warn where the caller gave these."""
    found = dict(options)
    for name in _FIRST_NAMES:
        given = checks.sequence(name, found.pop(name, ()), "Event")
        for event in given:
            checks.instance(name, event, Event, "an Event")
        if given:
            warn(f"{name}= is called events= now", DeprecationWarning)
            found["events"] = (*given, *checks.sequence("events", found.get("events", ()), "Event"))
    return found
