"""One careful step: predicted, corrected, believed or refused; and the state behind it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

from contin.arrays import Array
from contin.continuation.rules import JUMPS, Judgement, Single, aims, judged, judged_as, predicted, single_step
from contin.core.settings import Settings
from contin.core.small import ASKS, FAILED
from contin.core.step import State, corrected, settled
from contin.core.trial import Event, Trial
from contin.errors import ConvergenceError
from contin.events.arc import Arc, Place, SpecialPoint
from contin.events.folds import STANDS, free_values, sense
from contin.events.inspection import crossed, jumped

#: Beside a branch point, special points are looked for from this fraction of the first step on: closer, tangents are blurred.
#: The next one is taken where the equations are still too nearly singular for Newton's method.
_ASIDE = (0.01, 0.1, 0.5)


#: The end of a step that a kernel has made, and what it is judged by.
Made = tuple[Trial, Judgement]


class Step(NamedTuple):
    """A step that was made.

    - ``arc`` (Arc)
    - ``judgement`` (Judgement)
    - ``special`` (sequence of SpecialPoint): Inside it, in order.
    - ``turns`` (bool): The primary parameter turns inside it.
    - ``doubt`` (str): What is left of it where the step cannot be halved any more.
    """

    arc: Arc
    judgement: Judgement
    special: Sequence[SpecialPoint] = ()
    turns: bool = False
    doubt: str = ""

    @property
    def end(self) -> Trial:
        """The end of the arc on a mesh with points where conditions that the solution decides switch."""
        return self.arc.trial.settled


@dataclass(frozen=True)
class Steps:
    """How the steps of a run are made.

    - ``settings`` (Settings)
    - ``primary`` (str): The parameter whose folds are told.
    - ``fold`` (Event, optional): None where folds are not wanted.
    """

    settings: Settings
    primary: str
    fold: Event | None
    _rooms: dict[State, Single] = field(default_factory=dict, init=False, compare=False, repr=False)

    def room(self, state: State) -> Single:
        """Return the room of steps from a state, one for all lengths that are tried."""
        if state not in self._rooms:
            self._rooms.clear()
            self._rooms[state] = single_step(state, self.settings)
        return self._rooms[state]

    def attempt(
        self, state: State, here: Trial, step: float, made: Made | None = None, near: Array | None = None
    ) -> tuple[Arc, Judgement]:
        """Make one step of a given length from the state's point, as far as it can be believed by itself.

        ``made`` is its end, where a kernel has it; ``near`` is one that is nearer to it than the prediction. Raises
        ConvergenceError where there is none.
        """
        settings = self.settings
        trial, judgement = made or self._made(state, step, near)
        if judgement.outcome == FAILED:
            raise ConvergenceError(
                f"tangents turn by {judgement.turn:.2f} rad in one step, the prediction is off by "
                f"{judgement.missed / step:.2f} of it"
            )
        if judgement.outcome == JUMPS or (judgement.outcome == ASKS and self.sense(trial)):
            raise ConvergenceError(f"{self.primary} does not go where the tangents at both ends say")
        low, before = self._aside(state, step) if state.singular else (0.0, here)
        self._stay_off_trivial(state, before, trial)
        if settings.mesh.every:
            trial = settled(trial, state.tangent, settings.newton)
            trial.settled.system.check_jumps(trial.settled.x, state)
        return Arc(state, (low, before), trial, step, settings.newton, bool(settings.mesh.every)), judgement

    def _made(self, state: State, step: float, near: Array | None) -> Made:
        """Return the end of a step, and what it is judged by."""
        single = self.room(state)
        guess, reach = predicted(single, step)
        trial = corrected(state, guess if near is None else near, step, self.settings.newton, reach)
        if state.system.collapsed(state.x, trial.x):
            raise ConvergenceError("the cycle at the corrected point is an equilibrium")
        return trial, judged_as(single, trial, step)

    def accepted(self, arc: Arc, judgement: Judgement, turned: bool) -> State:
        """Return the state behind a step, on the mesh that its end has settled on.

        ``turned``: the step passes a fold. Behind it the parameter goes the other way, be it by less than round-off yet.
        """
        state, trial, step = arc.state, arc.trial, arc.step
        at = trial.system.parameter_index(self.primary)
        moved = abs(trial.x[at] - state.x[at]) > STANDS * (1 + abs(trial.x[at]))  # tangents are blurred at Hopf points
        way = self.sense(trial) if turned or moved else 0.0
        way = 0.0 if way * state.sense < 0 and not turned else way  # a fold that was not seen: the next step has it behind it
        sensed = free_values(trial) if way else state.sensed
        end, previous = trial.settled, state.tangent
        if end.system is not state.system:
            previous = state.system.carrier(end.system)(previous)
        return State(
            end.system, end.x, end.tangent, previous, step, judgement.following, end.sign, state.arclength + judgement.length,
            state.accepted + 1, False, way or state.sense, sensed, end.discretization_error,
        )  # fmt: skip

    def sense(self, trial: Trial) -> float:
        """Return the sense in which the primary parameter goes; zero where that cannot be told, or is not wanted."""
        return 0.0 if self.fold is None else sense(trial, self.fold, self.settings.newton)

    def reverses(self, one: Trial, other: Trial) -> bool:
        """Return whether the primary parameter goes in opposite senses at two points, as far as these can be told."""
        fold = self.fold
        return fold is not None and one.value(fold) * other.value(fold) < 0 and self.sense(one) * self.sense(other) < 0

    def _stay_off_trivial(self, state: State, before: Trial, trial: Trial) -> None:
        """Raise ConvergenceError where the corrected point lies on the trivial branch, or where the first step passes it."""
        name, newton = self.settings.trivial, self.settings.newton
        if name is None:
            return
        if jumped(before, trial, name, newton):
            raise ConvergenceError(f"the corrected point lies on the trivial branch, {name} = {trial[name]:.1e}")
        if state.singular and crossed(before, trial, name, newton):
            raise ConvergenceError(f"{name} changes its sign in the first step")

    def _aside(self, state: State, step: float) -> Place:
        """Return the nearest point beside a branch point that Newton's method finds, with a tangent along the branch.

        At a branch point tangent and determinant say nothing: this one stands in where a step's test functions start from.
        """
        problem = ConvergenceError("another branch was met right beside the branch point")
        for share in _ASIDE:
            try:
                guess = state.x + share * step * state.tangent
                aside = corrected(state, guess, share * step, self.settings.newton)
                if judged(state, guess, aside).turn <= aims(self.settings, state.system)[0]:
                    return share * step, aside
            except ConvergenceError as error:
                problem = error
        raise problem
