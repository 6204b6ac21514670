"""The lane of plain steps: when it may be taken, and points and states of what its kernels make.

The kernels are those of `contin.continuation.plain`, without a mesh, and of `contin.continuation.plain_on_mesh`. What they do
not know (users' functions, functionals, the index, the trivial branch) is asked of the points that they have made: the lane
ends before the step that asks.
"""

from __future__ import annotations

import functools
import itertools
from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from contin.arrays import Array
from contin.collocation import newton as one_call
from contin.collocation.defect import estimate
from contin.collocation.round import larger
from contin.continuation import plain_on_mesh as on_mesh
from contin.continuation import rules
from contin.continuation.plain import Quotient, Rooms, plain_steps
from contin.continuation.steps import Made
from contin.core.protocol import Discretization
from contin.core.settings import Settings
from contin.core.small import BELIEVED, equations_of, linear_of
from contin.core.step import State
from contin.core.trial import Event, Linearization, Trial
from contin.errors import ConvergenceError
from contin.events.arc import SpecialPoint
from contin.events.crossings import changes_little
from contin.events.inspection import Start, crossed, free_of, jumped, returned
from contin.events.spectra import spectra_of
from contin.linalg.condensation import Factored, Factorization
from contin.linalg.ends import Relations
from contin.results.point import Point

#: Steps of the first call after a step that was looked at, and at most: each call makes twice as many as the one before.
FEWEST, MOST = 8, 128
#: The length of a step, its beginning, its end with the judgement, and whether it is plain but for the error of its mesh, and
#: for values that free parameters pass.
Handed = tuple[float, Trial, Made, bool]
#: Where steps on a mesh begin: factors, and their place in the lane.
_Begun = tuple[Factorization, int]
#: How many steps were made, and the index at their ends, if any.
_Made = tuple[int, list[int | None] | None]
#: Where the error of the mesh is above its tolerance already, as finer meshes do not lower it, steps whose errors grow by less
#: than this factor want none. Ten times larger, errors of the mesh would grow unseen up to where the mesh is adapted next.
_NO_WORSE = 2.0


def lane_of(
    system: Discretization, settings: Settings, start: Start, tests: Sequence[Event], own: Sequence[Event], noisy: bool,
) -> Lane | None:  # fmt: skip
    """Return the lane of a run; None where every step must be made one by one.

    - ``tests``, ``own`` (sequence of Event): All of the run, and those among them that the kind of problem brings.
    - ``noisy`` (bool): Round-off of Newton's method was noted.
    """
    known: Any = system
    kind = SmallLane if equations_of(system) is not None else MeshLane if _is_smooth(known) else None
    if kind is None:
        return None
    others = [test for test in tests if not (kind.knows(test) and test in own) and not test.holds_one_of(system.free)]
    if any(test.search or test.asks or test.looks for test in others):
        return None
    return kind(known, settings, start, tests, others, noisy)


def _is_smooth(system: Any) -> bool:
    """Return whether a kernel makes steps on a mesh: functions are recorded, and have no jumps that the mesh must know of."""
    return system.plain and system.intervals > 1 and system.defect.room is not None


def _quotient(size: int) -> Quotient:
    (before, quotient, work), (real, imaginary) = np.empty((3, size, size)), np.empty((2, 1, size))
    return Quotient(before, quotient, work, np.empty((1, size, size)), real, imaginary)


class Lane(ABC):
    """Plain steps of one system, with what a kernel works in.

    - ``system`` (Discretization)
    - ``settings`` (Settings)
    - ``start`` (tuple (system, x, tangent)): The first point of the run.
    - ``tests``, ``others`` (sequence of Event): All, and those that the kernel does not know.
    - ``noisy`` (bool)
    """

    def __init__(
        self, system: Any, settings: Settings, start: Start, tests: Sequence[Event], others: Sequence[Event], noisy: bool,
    ) -> None:  # fmt: skip
        self.system, self.settings, self.noisy, self._start = system, settings, noisy, start
        self._handed: Handed | None = None
        self._others, self._index = others, system.index
        self._wants = bool(others) or system.index is not None or settings.trivial is not None
        self._frame, self._control = rules.frame_of(system), rules.control_of(system, settings)
        self._attempt = rules.attempt_of(system.size)
        held = [test for test in tests if test.holds_one_of(system.free)]
        sides = [(1.0 if test.value == settings.limits[test.column][1] else -1.0) if test.limit else 0.0 for test in held]
        self._watch = rules.Watched(
            int(settings.branch_points), int(any(self.knows(test) for test in tests)), int(noisy),
            np.array([system.parameter_index(test.column) for test in held], dtype=np.int64),
            np.array([test.value for test in held], dtype=float), np.array(sides),
            free_of(start[0], start[1], system), np.array(system.weights[system.state_size :]),
        )  # fmt: skip

    @staticmethod
    def knows(test: Event) -> bool:
        """Return whether the kernel watches for what a test function, one of the kind of problem, looks for."""
        return test.asks is not None

    def serves(self, system: Discretization, settings: Settings, noisy: bool) -> bool:
        """Return whether the lane is that of a system of the same run, with these settings."""
        return self.settings is settings and self.noisy == noisy and self.system is system

    @abstractmethod
    def _make(self, path: rules.Path, accepted: int, here: Trial) -> _Made:
        """Make plain steps from row 1 of a path, the state's point ``here``."""

    def steps(self, state: State, most: int, here: Trial) -> Block:
        """Make plain steps from a state, no more than ``most``; ``here`` is its point."""
        path = rules.path_from(state, most)
        self._handed = None
        return Block(self.system, state, path, self._make(path, state.accepted, here), self._handed)

    def _trial(self, path: rules.Path, number: int, factors: Factorization | None = None) -> Trial:
        """Return the point of a row of a path, with factors right there if these are at hand."""
        linear = Linearization(path.tangents[number], path.numbers[number, rules.SIGN_OF], factors)
        return Trial(self.system, path.x[number], linear)

    def _asks(self, before: Trial, trial: Trial, told: Array) -> bool:
        """Return whether a step asks for a closer look by what the kernel does not know, be it that this is not found."""
        try:
            closes = told[rules.CLOSES] and returned(self._start, before, trial, told[rules.STEP])
            return bool(closes) or self._passes(before, trial)
        except ConvergenceError:
            return True

    def _index_at(self, trial: Trial) -> int | None:
        return None if self._index is None else self.system.stability(SpecialPoint(0.0, "", "", trial)).index

    def _passes(self, before: Trial, trial: Trial) -> bool:
        """Return whether a step passes a zero of other test functions, a change of the index, or the trivial branch."""
        if any(test.passed(before.value(test), trial.value(test)) for test in self._others):
            return True
        if self._index is not None and abs(before.value(self._index) - trial.value(self._index)) > 0:
            return True
        name, newton = self.settings.trivial, self.settings.newton
        return name is not None and (jumped(before, trial, name, newton) or crossed(before, trial, name, newton))


class SmallLane(Lane):
    """That of a small problem without a mesh."""

    def __init__(self, system: Any, *given: Any) -> None:
        super().__init__(system, *given)
        equations = equations_of(system)
        assert equations is not None
        self._rooms = Rooms(
            equations, linear_of(system.size), self._frame, self._attempt, self._control, self._watch, _quotient(system.size),
            spectra_of(equations.states.shape[1], system.size, len(equations.states)),
        )  # fmt: skip

    def _make(self, path: rules.Path, accepted: int, here: Trial) -> _Made:
        made, indices = int(plain_steps(self._rooms, path, accepted)), list[int | None]()
        if not (self._wants or path.numbers[2 : made + 2, rules.CLOSES].any()):
            return made, None
        for before, end in itertools.pairwise(self._trial(path, number) for number in range(1, made + 2)):
            if self._asks(before, end, path.numbers[len(indices) + 2]):
                break
            indices.append(self._index_at(end))
        return len(indices), indices


class MeshLane(Lane):
    """That of a problem on a mesh, up to where the mesh changes."""

    def __init__(self, system: Any, *given: Any) -> None:
        super().__init__(system, *given)
        settings, newton, n = self.settings, self.settings.newton, system.states_count
        autonomous = system.size_of_solutions is not None
        self._work, first = system.workspace, system.unfilled_factors()
        self._factors: list[Factorization | None] = [first, None]
        rooms = on_mesh.MeshRooms(
            self._work, first.room, one_call.Control(newton.tolerance, newton.max_iterations, 0, 1),
            np.empty(one_call.UPDATES + newton.max_iterations), np.empty(system.state_size if autonomous else 0),
            self._frame, self._attempt, self._control, self._watch,
        )  # fmt: skip
        self._rooms = [rooms, rooms]
        self._still = max((test.still for test in given[2]), default=0.0)
        may_grow = settings.mesh.every and system.intervals < settings.mesh.max_intervals
        self._poor = settings.mesh.tolerance if may_grow else np.inf  # an error above it wants a finer mesh
        self._monodromy = system.monodromy
        k, segments = len(system.free), self._work.mesh.whole.last
        self._relations = [Relations.unfilled(system.intervals, n, k, segments) for _ in range(2)]
        self._quotient, self._watched = _quotient((segments + 1) * n + k), settings.branch_points
        self.spectra, self._estimate = spectra_of(n - autonomous, system.size), system.defect.room
        self._left: tuple[Array, _Begun] | None = None

    def serves(self, system: Any, settings: Settings, noisy: bool) -> bool:
        if not (self.settings is settings and self.noisy == noisy and getattr(system, "workspace", None) is self._work):
            return False
        if system is not self.system:  # it has another reference
            self.system, self._left = system, None
        return True

    @staticmethod
    def knows(test: Event) -> bool:
        return test.asks is not None or test.still > 0

    def _make(self, path: rules.Path, accepted: int, here: Trial) -> _Made:
        values, begun, indices = self._work.values, self._begun(path, here), list[int | None]()
        if begun is None:
            return 0, None
        before, now = begun
        time = 1.0 if self._monodromy is None else self.system.unit_time(path.x[1])
        error = path.numbers[1, rules.MESH_ERROR]
        poor = _NO_WORSE * error if error > self._poor else self._poor
        for number in range(2, len(path.x)):
            now, after = 1 - now, self._spare(1 - now)
            step = on_mesh.step_on_mesh(self._rooms[now], path, accepted, number)
            asks = step <= 0 or (self._still and on_mesh.rests(values.field, values.points.shape[1], self._still))
            if not asks:
                found, clear = on_mesh.MAY_BRANCH, self._compared(after.room, 0)
                if self._monodromy is not None:
                    earlier, time = time, self.system.unit_time(path.x[number])
                    found = self._multipliers_ask(path, number, step, time / earlier)
                asks = found == on_mesh.ASK or not (found == on_mesh.AWAY or self._stays_regular(clear, before, after))
            if not asks:
                error = estimate(self._work, after.room, self._estimate, path.x[number])
                path.numbers[number, rules.MESH_ERROR] = error
            if not asks and (self._wants or path.numbers[number, rules.CLOSES]):
                begin = here if self._wants else self._trial(path, number - 1, before)
                here = self._trial(path, number, after)
                asks = self._asks(begin, here, path.numbers[number])
            if asks or path.numbers[number, rules.PASSES] or not error <= poor:
                if step <= 0:
                    self.spectra.moved[0] = np.inf
                if step:
                    self._hand_over(path, number, abs(step), (before, after), not asks)
                return number - 2, indices or None
            if self._wants:
                indices.append(self._index_at(here))
            before = after
        self._left = path.x[-1], (before, now)
        return len(path.x) - 2, indices or None

    def _begun(self, path: rules.Path, here: Trial) -> _Begun | None:
        """Prepare steps from row 1 of a path, the point ``here``; return what is known there, None where that is not found.

        It is what the steps of the call before have left, where they end there.
        """
        _, _, newton, report, amplitude, frame, *_ = self._rooms[0]
        values, (left, self._left) = self._work.values, (self._left, None)
        self.system.fill_conditions(values)
        values.rows[-1] = frame.weights * path.tangents[1]
        if amplitude.size:
            amplitude[:] = self.system.amplitude_row
        if left is not None and np.array_equal(left[0], here.x):
            return left[1]
        factors = here.factors
        known = isinstance(factors, Factorization) and (self._monodromy is None or np.array_equal(values.at, here.x))
        if not known:
            factors = self._spare(0)
            given = newton._replace(most=0), path.x[1], frame.weights, np.empty(path.x.shape[1]), report
            if one_call.correct_on_mesh(self._work, factors.room, *given) != one_call.CONVERGED:
                return None
        self._compared(factors.room, 1)
        room = self._monodromy
        asks = room is not None and self._multipliers_ask(path, 1, 0.0, 0.0) == on_mesh.ASK
        if asks and room.starts[-1] + len(room.turn) > len(room.matrices):
            self._monodromy = larger(self.system, room)
            asks = self._multipliers_ask(path, 1, 0.0, 0.0) == on_mesh.ASK
        return None if asks else (factors, 0)

    def _multipliers_ask(self, path: rules.Path, number: int, step: float, longer: float) -> int:
        """Return what multipliers say of the step that ends at a row of a path."""
        given = self._monodromy, self.spectra, self._attempt, path, number, step, longer
        return int(on_mesh.multipliers_ask(self._work, *given))

    def _compared(self, factored: Factored, begins: int) -> int:
        """Return what condensed matrices say of a step that ends at a matrix."""
        if not self._watched:
            return on_mesh.CALM
        before, after = self._relations[::-1]
        self._relations = [before, after]
        return int(on_mesh.ends_are_calm(self._work.mesh, factored, before, after, self._quotient, begins))

    def _stays_regular(self, clear: int, before: Factorization, after: Factorization) -> bool:
        """Return whether no singular value comes near zero in a step, by all of them where condensed matrices do not decide."""
        return changes_little(before, after, self.system.size) if clear == on_mesh.TURNS else clear == on_mesh.CALM

    def _hand_over(self, path: rules.Path, number: int, step: float, both: Sequence[Factorization], plain: bool) -> None:
        """Keep a step that was made and asks for a closer look, with the factors at both ends, which the lane gives away."""
        sign, iterations, error = self._attempt.judged[[rules.SIGN, rules.UPDATES, rules.ERROR]].tolist()
        both[0].sign, both[1].sign = float(path.numbers[number - 1, rules.SIGN_OF]), sign
        ends = zip(path.tangents[number - 1 : number + 1], both)
        first, last = (Linearization(tangent.copy(), factors.sign, factors) for tangent, factors in ends)
        begin = Trial(self.system, path.x[number - 1].copy(), first)
        end = Trial(self.system, path.x[number].copy(), last, int(iterations), error)
        end._discretization_error = float(path.numbers[number, rules.MESH_ERROR]) or None  # 0 where it is not known yet
        self._handed = step, begin, (end, rules.judgement_of(self._attempt, path, number, BELIEVED)), plain
        self._factors = [None if each in both else each for each in self._factors]

    def _spare(self, place: int) -> Factorization:
        """Return the factors of a place, new ones where the last ones were handed over: often the mesh changes before."""
        factors = self._factors[place]
        if factors is None:
            factors = self._factors[place] = self.system.unfilled_factors()
            self._rooms[place] = self._rooms[place]._replace(factored=factors.room)
        return factors


class Lanes:
    """The lane of a run, made anew where what it depends on has changed.

    - ``start``, ``tests``, ``own``: As in `lane_of`.
    """

    def __init__(self, start: Start, tests: Sequence[Event], own: Sequence[Event]) -> None:
        self._run = start, tests, own
        self._for: object = None
        self._known: Lane | None = None

    def of(self, system: Discretization, settings: Settings, noisy: bool) -> Lane | None:
        """Return the lane of a system with these settings; None where there is none."""
        if self._for != (system, settings, noisy):
            self._for = system, settings, noisy
            known = self._known
            if known is None or not known.serves(system, settings, noisy):
                self._known = lane_of(system, settings, *self._run, noisy)
                if isinstance(known, MeshLane) and isinstance(self._known, MeshLane):
                    self._known.spectra.moved[:] = known.spectra.moved
        return self._known


class Block:
    """Plain steps that one call has made.

    - ``made`` (int): How many.
    - ``handed`` (tuple (float, Trial, (Trial, Judgement)) or None): The step behind them, where a kernel has made it and it
      asks for a closer look: its length, its beginning, and its end with the judgement.
    """

    def __init__(self, system: Any, base: State, path: rules.Path, made: _Made, handed: Handed | None) -> None:
        self._system, self._base, self._path, self.handed = system, base, path, handed
        self.made, self._indices = made

    def state(self, row: int) -> State:
        """Return the state behind a step, by its row of the path."""
        base, (x, tangents, numbers) = self._base, self._path
        step, following, sign, arclength, _, _, sense, told, error, *_ = numbers[row].tolist()
        sensed = self._free(x[int(told)]) if told else base.sensed
        # copies begin where all arrays do: some of OpenBLAS's kernels add up in an order that hangs on that
        there = x[row].copy(), tangents[row].copy(), tangents[row - 1].copy()
        return State(
            base.system, *there, step, following, sign, arclength, base.accepted + row - 1, False, sense, sensed, error,
        )  # fmt: skip

    def _free(self, x: Array) -> Array:
        return x[..., self._system.state_size :] * self._system.free_scales

    def points(self) -> Iterator[tuple[Any, Point]]:
        """Yield what returns the state behind each step, and the point there."""
        system, (x, tangents, numbers) = self._system, self._path
        names, rows = tuple(system.problem.parameters), range(2, self.made + 2)
        values = np.empty((self.made, len(names)))
        values[:] = system.parameters
        values[:, system._free] = self._free(x[2 : self.made + 2])
        arclengths = (numbers[1 : self.made + 1, rules.ARCLENGTH] + numbers[2 : self.made + 2, rules.STEP]).tolist()
        told = numbers[2 : self.made + 2, (rules.ITERATIONS, rules.ERROR_LEFT, rules.MESH_ERROR)].tolist()
        indices = [None] * self.made if self._indices is None else self._indices
        every = zip(rows, values.tolist(), arclengths, told, indices)
        for row, given, arclength, (iterations, error, mesh_error), index in every:
            point = object.__new__(Point)  # its own __init__ would take half of the time of a step
            vars(point).update(_REGULAR, parameters=dict(zip(names, given)))
            vars(point).update(x=x[row], tangent=tangents[row], system=system, arclength=arclength, errors={})
            vars(point).update(iterations=int(iterations), newton_error=error, discretization_error=mesh_error, index=index)
            yield functools.partial(self.state, row), point


#: What all points of plain steps have. Functionals are computed when they are first asked for.
_REGULAR = vars(Point("", "", {}, {}, np.empty(0), np.empty(0), None, 0.0, 0, 0.0, discretization_error=0.0))  # type: ignore
del _REGULAR["functionals"]
