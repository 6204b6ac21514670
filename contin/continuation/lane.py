"""The lane of plain steps: when it may be taken, and points and states of what `contin.continuation.plain` makes."""

from __future__ import annotations

import functools
import itertools
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from contin.arrays import Array
from contin.continuation.plain import (
    ARCLENGTH,
    ERROR_LEFT,
    ITERATIONS,
    LENGTH,
    NUMBERS,
    SIGN_OF,
    STEP,
    Attempt,
    Control,
    Path,
    Quotient,
    Rooms,
    Watch,
    plain_steps,
)
from contin.detection.inspection import Start
from contin.detection.spectra import spectra_of
from contin.discretization.algebraic import Algebraic
from contin.discretization.protocol import Discretization
from contin.errors import ConvergenceError
from contin.results.point import Point
from contin.stepping.settings import Settings
from contin.stepping.small import Equations, equations_of, linear_of
from contin.stepping.state import State
from contin.stepping.step import aims
from contin.stepping.trial import Linearization, TestFunction, Trial

#: Steps of the first call after a step that was looked at, and at most: each call makes twice as many as the one before.
FEWEST, MOST = 8, 128


def lane_of(
    system: Discretization, settings: Settings, start: Start, tests: Sequence[TestFunction], own: Sequence[TestFunction],
    noisy: bool,
) -> Lane | None:  # fmt: skip
    """Return the lane of a run; None where every step must be made one by one.

    Parameters
    ----------
    tests, own : sequence of TestFunction
        All of the run, and those among them that the kind of problem brings.
    noisy : bool
        Round-off of Newton's method was noted.
    """
    equations = equations_of(system)
    if equations is None or settings.trivial is not None:
        return None
    known: Any = system
    others = [test for test in tests if test not in own and not test.holds_one_of(system.free)]
    if any(test.search or test.asks or test.looks for test in others):
        return None
    return Lane(known, equations, settings, start, tests, others, bool(own), noisy)


def _control(settings: Settings, system: Algebraic, primary: int) -> Control:
    """Return the settings as the kernel takes them."""
    newton, (angle, accuracy) = settings.newton, aims(settings, system)
    return Control(
        newton.tolerance, newton.max_iterations, accuracy, angle, settings.change, settings.min_step,
        settings.max_step, primary,
    )  # fmt: skip


class Lane:
    """Plain steps of one system, with what the kernel works in.

    Parameters
    ----------
    system : Algebraic
    equations : Equations
        Those of the system.
    settings : Settings
    start : tuple (system, x, tangent)
        The first point of the run.
    tests, others : sequence of TestFunction
        All, and those that the kernel does not know.
    eigenvalues : bool
        Eigenvalues are watched.
    noisy : bool
    """

    def __init__(
        self, system: Algebraic, equations: Equations, settings: Settings, start: Start, tests: Sequence[TestFunction],
        others: Sequence[TestFunction], eigenvalues: bool, noisy: bool,
    ) -> None:  # fmt: skip
        self.system, self.settings, self.noisy, self._others = system, settings, noisy, others
        size, n = system.size, system.state_size
        held = [test for test in tests if test.holds_one_of(system.free)]
        ends = np.array([settings.limits.get(name, (-np.inf, np.inf)) for name in system.free], dtype=float)
        sides = [(1.0 if test.value == settings.limits[test.column][1] else -1.0) if test.limit else 0.0 for test in held]
        home, x, _ = start
        closing = np.where(np.append(system.circles, np.zeros(size - n)) > 0, 0.0, system.weights)
        primary = system.parameter_index(settings.primary or system.free[0]) if settings.folds else -1
        (before, quotient, work), (real, imaginary) = np.empty((3, size, size)), np.empty((2, 1, size))
        self._rooms = Rooms(
            equations, linear_of(size), Attempt(np.empty(size), np.empty(6), np.empty(LENGTH + 1)),
            _control(settings, system, primary),
            Watch(
                int(settings.branch_points), int(eigenvalues), int(noisy),
                np.array([system.parameter_index(test.column) for test in held], dtype=np.int64),
                np.array([test.value for test in held], dtype=float), np.array(sides), ends[:, 0].copy(), ends[:, 1].copy(),
                home.carrier(system)(x), closing,
            ),
            Quotient(before, quotient, work, np.empty((1, size, size)), real, imaginary), spectra_of(n, size),
        )  # fmt: skip

    def steps(self, state: State, most: int) -> Block:
        """Make plain steps from a state, no more than ``most``."""
        size = state.x.size
        path = Path(np.empty((most + 2, size)), np.empty((most + 2, size)), np.empty((most + 2, NUMBERS)))
        bent = state.previous_tangent is not None
        path.x[1], path.tangents[1] = state.x, state.tangent
        path.tangents[0] = state.previous_tangent if bent else 0.0
        path.numbers[1] = state.previous_step, state.step, state.sign, state.arclength, 0, 0, state.sense, 0
        made = plain_steps(self._rooms, path, state.accepted, int(bent))
        trials = self._trials(path, made) if self._others or self.system.problem.functionals else []
        return Block(self.system, state, path, self._passed(trials, made), trials)

    def _trials(self, path: Path, made: int) -> list[Trial]:
        """Return the state's point, and the ends of the steps."""
        signs = path.numbers[1:, SIGN_OF].tolist()
        rows = zip(path.x[1 : made + 2], path.tangents[1:], signs)
        return [Trial(self.system, x, Linearization(tangent, sign)) for x, tangent, sign in rows]

    def _passed(self, trials: Sequence[Trial], made: int) -> int:
        """Return how many of the steps pass no zero of a test function that the kernel does not know."""
        for number, (before, trial) in enumerate(itertools.pairwise(trials)):
            try:
                if any(test.passed(before.value(test), trial.value(test)) for test in self._others):
                    return number
            except ConvergenceError:
                return number
        return made


class Block:
    """Plain steps that one call has made.

    Attributes
    ----------
    made : int
        How many.
    """

    def __init__(self, system: Algebraic, base: State, path: Path, made: int, trials: Sequence[Trial]) -> None:
        self._system, self._base, self._path, self.made, self._trials = system, base, path, made, trials

    def state(self, row: int) -> State:
        """Return the state behind a step, by its row of the path."""
        base, (x, tangents, numbers) = self._base, self._path
        step, following, sign, arclength, _, _, sense, told = numbers[row].tolist()
        sensed = self._free(x[int(told)]) if told else base.sensed
        return State(
            base.system, x[row], tangents[row], tangents[row - 1], step, following, sign, arclength, base.accepted + row - 1,
            False, sense, sensed, 0.0,
        )  # fmt: skip

    def _functionals(self, row: int) -> dict[str, float]:
        return self._trials[row - 1].functionals if self._trials else {}

    def _free(self, x: Array) -> Array:
        """Return the free parameters in the user's units."""
        found: Array = x[..., self._system.state_size :] * self._system.free_scales
        return found

    def points(self) -> Iterator[tuple[Any, Point]]:
        """Yield what returns the state behind each step, and the point there."""
        system, (x, tangents, numbers) = self._system, self._path
        names, rows = tuple(system.problem.parameters), range(2, self.made + 2)
        values = np.tile(system.parameters, (self.made, 1))
        values[:, system._free] = self._free(x[2 : self.made + 2])
        arclengths = (numbers[1 : self.made + 1, ARCLENGTH] + numbers[2 : self.made + 2, STEP]).tolist()
        told = numbers[2 : self.made + 2, (ITERATIONS, ERROR_LEFT)].tolist()
        for row, given, arclength, (iterations, error) in zip(rows, values.tolist(), arclengths, told):
            point = object.__new__(Point)  # its own __init__ would take half of the time of a step
            vars(point).update(_REGULAR, parameters=dict(zip(names, given)), functionals=self._functionals(row))
            vars(point).update(x=x[row], tangent=tangents[row], system=system, arclength=arclength, errors={})
            vars(point).update(iterations=int(iterations), newton_error=error)
            yield functools.partial(self.state, row), point


#: What all points of plain steps have.
_REGULAR = vars(Point("", "", {}, {}, np.empty(0), np.empty(0), None, 0.0, 0, 0.0, discretization_error=0.0))  # type: ignore
