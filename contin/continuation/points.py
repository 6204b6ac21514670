"""What becomes of the special points that a step has found, and notes of what was seen and not understood."""

from __future__ import annotations

import dataclasses
import functools
import itertools
import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from contin.core.labels import CONFIRMED, Label
from contin.core.settings import Settings
from contin.core.trial import Event, Trial
from contin.errors import ProblemError
from contin.events.arc import Arc, SpecialPoint
from contin.events.branch_point import BranchPoint
from contin.events.corner import zeros
from contin.events.labelled import Stability, contradiction, finding_of, located_details, nullity_of
from contin.events.phase_loads import phase_loads
from contin.events.refinement import refined
from contin.events.usual import with_normal_form
from contin.results.point import Point


class Notes:
    """The sentences about a run.

    - ``texts`` (list of str)
    - ``primary`` (str): Places are told by this parameter.
    - ``tolerance`` (float): Of the mesh.
    - ``moves`` (bool): Mesh points follow corners.
    - ``is_noisy`` (bool): Some point is not known to the tolerance of Newton's method.
    """

    def __init__(self, primary: str, tolerance: float, moves: bool) -> None:
        self.texts: list[str] = []
        self.primary, self.tolerance, self.moves, self.is_noisy = primary, tolerance, moves, False
        self._said = False

    def place(self, trial: Trial) -> str:
        """Return where a point lies."""
        return f"{self.primary} = {trial[self.primary]:.10g}"

    def add(self, text: str) -> None:
        self.texts.append(text)

    def inside(self, text: str, arc: Arc) -> None:
        """Note what was seen inside a step and not understood."""
        ends = (trial[self.primary] for trial in (arc.before, arc.trial))
        self.add(f"{text} (between {self.primary} = {' and '.join(f'{end:.10g}' for end in ends)})")

    def doubts(self, index: Event | None, arc: Arc, found: list[SpecialPoint], doubt: str) -> None:
        """Note what the labelled points of a step do not explain: a change of the index or, without one, a doubt."""
        contradicts = contradiction(index, arc, found)
        if contradicts and not found:  # beside points, changes of the index are noted
            self.inside(f"{contradicts}, and the labelled points do not explain it", arc)
        elif doubt and not contradicts:
            self.inside(doubt, arc)

    def contacts(self, trial: Trial) -> None:
        """Note which contacts hold where a run begins, of a problem that has some."""
        if known := getattr(trial.system.problem, "contacts", None):
            held = trial.system.problem.touching(trial.system, trial.x)
            states = [f"{name} {'holds' if name in held else 'is open'}" for name in known.values()]
            states += [f"{trial.system.written(k, 1.0)} without force" for k in zeros(trial.system, trial.x)]
            self.add(f"contacts at {self.place(trial)}: {', '.join(states)}")

    def corners(self, trial: Trial) -> None:
        """Note once that mesh points do not follow corners and jumps."""
        note = unsettled(trial, self.tolerance if self.moves else math.inf, self.primary)
        if note and not self._said:
            self._said = True
            self.add(note)

    def phases(self, found: SpecialPoint, error: float) -> bool:
        """Note the phase conditions that load a labelled point, known to ``error``; return whether they make a branch point.

        They do where the kernel is the tangent of the branch, which is not loaded, and one mode, which is.
        """
        trial, modes = found.trial, list(getattr(found.details, "kernel", ()))
        known = trial.newton_error + (self.tolerance if math.isnan(error) else error)
        loads = list(phase_loads(trial.system, trial.x, modes, known))
        is_made = found.label == Label.BRANCH_POINT and len(modes) == 2 and {is_mode for *_, is_mode in loads} == {True}
        for name, load, is_mode in loads:
            place = f"at {found.label} ({self.place(trial)})"
            what = f"has {load:.3g} of the largest number of a mode {place}" if is_mode else f"= {load:.6g} {place}"
            does = "makes this branch point, which gets no label" if is_made else "loads the structure; leave it out"
            self.add(f"phases: {name} {what} and not zero, so the phase condition {does}")
        free = getattr(trial.system.problem, "index_without_phases", lambda _: None)(trial)
        if found.label == Label.END and free is not None and free != (index := trial.system.stability(found).index):
            self.add(f"phases: the index {index} at EP ({self.place(trial)}) leaves out what they hold: {free} without them")
        return is_made

    def check_phases(self, trial: Trial) -> None:
        """Raise ProblemError for a phase condition that loads the solution at which a branch starts, or its tangent there."""
        for name, load, is_mode in phase_loads(trial.system, trial.x, [trial.tangent], trial.newton_error + self.tolerance):
            here = f"at the start ({self.place(trial)})"
            what = f"grows along the branch {here}" if is_mode else f"= {load:.6g} {here} and not zero"
            raise ProblemError(f"phases: {name} {what}: no symmetry of the problem implies this phase; leave it out")

    def noise(self, arc: Arc, allowed: float) -> None:
        """Note once that a point is known worse than ``allowed``."""
        if arc.trial.newton_error > allowed and not self.is_noisy:
            self.is_noisy = True
            what = "the updates of Newton's method are round-off above its tolerance: see newton_error"
            self.inside(f"from here on {what}", arc)


def unsettled(trial: Trial, tolerance: float, primary: str) -> str:
    """Return a note if conditions switch inside intervals of the mesh, and that matters; "" otherwise."""
    found = trial.system.switching(trial.x)
    if not (found.places.size and (found.costs > tolerance).any()):
        return ""
    at = int(np.argmax(found.costs))
    where = f"{found.names[at]} changes its sign (t = {found.places[at]:.6g} at {primary} = {trial[primary]:.10g})"
    return f"no mesh has a point where {where}: from there on the points are as exact as discretization_error says"


#: The index on both sides of a special point; None where it is not defined.
IndexChange = tuple[int | None, int | None]


def begun_at(origin: Point | None, first: SpecialPoint) -> SpecialPoint:
    """Return the first point of a run with what is known of the simple branch point that it is: its details and errors."""
    trial, known = first.trial, finding_of(origin and located_details(origin))
    if origin is None or not isinstance(known, BranchPoint) or origin.system is not trial.system or (origin.x != trial.x).any():
        return first
    return dataclasses.replace(first, details=known.along(trial.system, trial.tangent), errors=origin.errors or None)


def located_again(found: SpecialPoint, settings: Settings) -> SpecialPoint:
    """Return a special point located again on finer meshes, with its errors, if these are wanted."""
    if not found.label or not (found.is_located or found.stop is not None):
        return found  # a regular point, or one that gets no label
    before = found
    if found.errors is None and settings.errors and found.label != Label.FAILED and not found.closes:
        again = refined(found.same_as or found, settings)
        details = found.details if found.same_as else again.details
        found = dataclasses.replace(found, trial=again.trial, details=details, errors=again.errors, is_lost=again.is_lost)
        found = again.trial.system.judged(found) if found.at else found  # between mesh points, cycles are known better there
    return found if found.test is None or found.test.normal_form is None else dataclasses.replace(found, coarse=before)


def is_confirmed(point: SpecialPoint, arc: Arc, notes: Notes) -> bool:
    """Return whether a special point was located and, where that was asked for, not missed on a finer mesh.

    Others are noted: they get no label. The end of a run keeps its own. So does a point whose errors are not known because
    Newton's method fails on the finer mesh; that is noted.
    """
    what = f"{point.label} {point.name}".strip()
    unknown = point.label in CONFIRMED and any(np.isnan(error) for error in (point.errors or {}).values())
    if point.stop is not None or (point.is_located and not (unknown and point.is_lost)):
        if point.stop is None and unknown:
            notes.add(f"{what} at {notes.place(point.trial)}: its ± is nan, since Newton's method failed at the second look")
        return True
    why = "was not found again on a finer mesh" if point.is_located else "was bracketed, and not located"
    notes.inside(f"a possible {what} {why}", arc)
    return False


def index_changes(index: Event | None, arc: Arc, special: Sequence[SpecialPoint], notes: Notes) -> list[IndexChange | None]:
    """Return the index before and after each special point of a step, and note what contradicts itself."""
    if index is None or not special:
        return [None] * len(special)
    groups = [list(group) for _, group in itertools.groupby(special, lambda point: (point.same_as or point).at)]
    middles = (arc.near((a[-1].at + b[0].at) / 2) for a, b in itertools.pairwise(groups))
    last = special[-1]  # behind a limit the step does not belong to the branch
    ends_there = last.stop is not None and last.test is not None and last.same_as is None
    values = [trial.value(index) for trial in (arc.before, *middles, last.trial if ends_there else arc.trial)]
    whole = [None if np.isnan(value) else int(value) for value in values]
    changes: list[IndexChange | None] = []
    for group, (before, after), pair in zip(groups, itertools.pairwise(values), itertools.pairwise(whole)):
        changes += [pair if nullity_of(point) else None for point in group]
        if abs(after - before) > sum(map(nullity_of, group)) or (group[0].label == Label.FOLD and after == before):
            name = f"{group[0].label} {group[0].full_name}".strip()
            notes.add(f"the index goes from {before:g} to {after:g} at {name} ({notes.place(group[0].trial)})")
    return changes


def told(found: SpecialPoint, arclength: float, index: Event | None, change: IndexChange | None, mesh_error: float) -> Point:
    """Return what is told of a special point, or of a regular one: the point of a branch."""
    trial, system = found.trial, found.trial.system
    parameters = dict(zip(system.problem.parameters, map(float, system.all_parameters(trial.x))))
    stability = Stability() if index is None else system.stability(found)
    functionals = trial.functionals if system.on_curve or system.thawed is not system else {}
    point = Point(
        str(found.label), found.full_name, parameters, functionals, trial.x, trial.tangent, system.thawed, arclength,
        trial.iterations, trial.newton_error, found.errors or {}, found.details,
        stability.index, stability.nullity, change, stability.breaks,
        *(("", None) if found.test is None else (found.test.column, found.test.value)), mesh_error,
    )  # fmt: skip
    if not functionals:  # they are computed when they are first asked for
        del vars(point)["functionals"]
    if found.coarse is not None:
        del vars(point)["name"], vars(point)["details"]
        later = functools.partial(_with_normal_form, _kept(found), _kept(found.coarse))
        vars(point)["_told"] = (found.details, later)  # what is known of it, and what computes name and details when first read
    return point


def _kept(found: SpecialPoint) -> SpecialPoint:
    """Return a special point without what takes much memory."""
    return dataclasses.replace(found, trial=Trial.without_tangent(found.trial.system, found.trial.x), same_as=None, coarse=None)


def _with_normal_form(found: SpecialPoint, coarse: SpecialPoint) -> tuple[str, Any]:
    """Return name and details of a special point, with its normal form if it has one: that takes longer than to locate it."""
    first = coarse.trial.system.coefficient(dataclasses.replace(coarse, label=found.label))
    if first is not None:
        better = first if found.trial.x is coarse.trial.x else found.trial.system.coefficient(found)
        found = with_normal_form(found, better or first, first)
    return found.full_name, found.details
