"""Why a scene's run found no further state, in the fields of the scene; an advice is tried before it is given."""

from __future__ import annotations

import contextlib
import dataclasses
from collections.abc import Callable, Iterator

from contin import ContinError, Point, Reason, Settings
from contin.lowlevel import Continuation, State, Stop, exact_text, levels

#: Points that a run must find with a changed field before that change is advised. With 1, changes were advised that help for
#: one step only; with 100, a failed run takes as long again as a stage.
_POINTS = 10
#: The smallest step is divided by this, then by its square; the tolerance of the mesh is divided by it once.
_SHORTER = 100.0


def no_state(run: Continuation, place: str) -> Stop:
    """Return why a run ended without convergence, and the first change of a field of the scene with which it goes on.

    Parameters
    ----------
    run : Continuation
        It has stopped with the reason "no convergence".
    place : str
        Where it stopped, as in "turn = 3.1".
    """
    step = exact_text(run.settings.min_step)
    if _goes_on(run.state, run.settings):
        assert run.stop is not None
        return run.stop  # steps succeed: it stopped for something that it met
    for field, state, settings in _changes(run):
        if _goes_on(state, settings):
            message = f"no state was found beyond {place} with steps down to {step}"
            return Stop(Reason.NO_CONVERGENCE, message, f"the run goes on with {field}")
    return Stop(
        Reason.NO_CONVERGENCE, f"no state was found beyond {place}: neither smaller steps nor a finer mesh go on from there",
        "its last state shows where the strip bends or twists most; another law may go on",
    )  # fmt: skip


def _changes(run: Continuation) -> Iterator[tuple[str, State, Settings]]:
    """Yield changed fields of the scene in words, with the state and the settings of a run that has them."""
    state, settings = run.state, run.settings
    for smallest in (settings.min_step / _SHORTER, settings.min_step / _SHORTER**2):
        if smallest > 0:  # the least number there is cannot be divided
            yield f"steps.smallest: {smallest:g}", state, dataclasses.replace(settings, min_step=smallest)
    if not state.system.intervals:
        return
    system, carry = state.system.refined()
    previous = None if state.previous_tangent is None else carry(state.previous_tangent)
    finer = dataclasses.replace(state, system=system, x=carry(state.x), tangent=carry(state.tangent), previous_tangent=previous)
    if system.intervals <= settings.mesh.max_intervals and settings.mesh.every:
        mesh = dataclasses.replace(settings.mesh, tolerance=settings.mesh.tolerance / _SHORTER)
        yield f"mesh.tolerance: {mesh.tolerance:g}", finer, dataclasses.replace(settings, mesh=mesh)
    mesh = dataclasses.replace(settings.mesh, every=0)
    fixed = f"mesh.intervals: {system.intervals} and mesh.adapt_every: 0"
    yield fixed, finer, dataclasses.replace(settings, mesh=mesh)


def _goes_on(state: State, settings: Settings) -> bool:
    """Return whether a run from a state finds further points, or comes to an end of another kind."""
    state = dataclasses.replace(state, step=min(settings.min_step * _SHORTER, settings.max_step))
    start = (state.system, state.x, state.tangent)
    with contextlib.suppress(ContinError):
        trial = dataclasses.replace(settings, max_points=state.accepted + _POINTS, errors=False)
        run = Continuation(state.system, state.x, trial, state=state, start=start)
        count = sum(not point.label for point in run)
        return run.stop is not None and run.stop.reason != Reason.NO_CONVERGENCE and count > 0
    return False


def reached(stop: Stop, last: Point, run: Continuation, shown: Callable[[str, float], str]) -> Stop:
    """Return the stop of a run at a limit, with the value in the words of ``shown(name, value)``; others as they are."""
    if stop.reason != Reason.LIMIT:
        return stop
    for name, ends in run.settings.limits.items():
        end = min(ends, key=lambda end: abs(end - last[name]))
        if abs(end - last[name]) <= levels.LOCATED * (ends[1] - ends[0] + abs(end)):
            return dataclasses.replace(stop, message=f"reached {shown(name, end)}")
    return stop
