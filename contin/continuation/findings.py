"""What becomes of the special points that a step has found: located again, confirmed, with the index on both sides."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Sequence

import numpy as np

from contin.continuation.notes import Notes, why_lost
from contin.core.labels import BY_VALUES, CONFIRMED, Label
from contin.core.settings import Settings
from contin.core.trial import Event
from contin.events.arc import Arc, SpecialPoint
from contin.events.index import Stability, nullity_of
from contin.events.refinement import refined
from contin.events.usual import with_normal_form
from contin.results.point import Point

#: The index on both sides of a special point; None where it is not defined.
IndexChange = tuple[int | None, int | None]


def located_again(found: SpecialPoint, settings: Settings) -> SpecialPoint:
    """Return a special point located again on finer meshes, with its errors, if these are wanted; and its normal form."""
    if not found.label or not (found.is_located or found.stop is not None):
        return found  # a regular point, or one that gets no label
    labelled = found.label != Label.FAILED and not found.closes
    first, coarse = found.trial, found.trial.system.coefficient(found)
    if found.errors is None and labelled and settings.errors:
        again = refined(found.same_as or found, settings)
        details, errors, is_lost = found.details if found.same_as else again.details, again.errors, again.is_lost
        if found.label not in BY_VALUES and again.trial.system.switching(again.trial.x).jumps.any():
            errors, is_lost = dict.fromkeys(errors, np.nan), True
        found = dataclasses.replace(found, trial=again.trial, details=details, errors=errors, is_lost=is_lost)
    if coarse is not None:
        better = coarse if found.trial is first else found.trial.system.coefficient(found)
        found = with_normal_form(found, better or coarse, coarse, settings.errors)
    return found


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
    notes.inside(f"a possible {what} {why_lost(point.trial, point.is_located)}", arc)
    return False


def index_changes(index: Event | None, arc: Arc, special: Sequence[SpecialPoint], notes: Notes) -> list[IndexChange | None]:
    """Return the index before and after each special point of a step, and note what contradicts itself."""
    if index is None or not special:
        return [None] * len(special)
    groups = [list(group) for _, group in itertools.groupby(special, lambda point: (point.same_as or point).at)]
    middles = [(a[-1].at + b[0].at) / 2 for a, b in itertools.pairwise(groups)]
    last = special[-1]  # behind a limit the step does not belong to the branch
    ends_there = last.stop is not None and last.test is not None and last.same_as is None
    between = [arc.before, *(arc.near(s) for s in middles), last.trial if ends_there else arc.trial]
    values = [trial.value(index) for trial in between]
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
    return Point(
        str(found.label), found.full_name, parameters, trial.functionals, trial.x, trial.tangent, system, arclength,
        trial.iterations, trial.newton_error, found.errors or {}, found.details,
        stability.index, stability.nullity, change, stability.breaks,
        *(("", None) if found.test is None else (found.test.column, found.test.value)), mesh_error,
    )  # fmt: skip
