"""The canonical equations of a variational problem, derived on a tape.

With the Hamiltonian H = lambda.f - L - mu.g at the controls w that maximize it,

    x' = dH/dlambda,   lambda' = -dH/dx,   0 = dH/dw,

and at the ends lambda(t0) = d(Phi + sigma.e)/dx(t0), lambda(t1) = -d(Phi + sigma.e)/dx(t1). Contacts, which push, have
min(e, -sigma) = 0 in the place of e = 0. Where H is quadratic in w, the controls are eliminated on the tape; else they are
found at each point as the minimum of -H, with exact derivatives (`contin.functions.iteration`).

Loads without an energy, as they are at the states x, do the work W(x; y) on states y. With Q the derivative of W by y at y = x,
lambda' is less by Q, lambda(t0) less by Q0, and lambda(t1) more by Q1.
"""

from __future__ import annotations

import dataclasses
import math
from collections import namedtuple
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from contin import errors as checks
from contin.arrays import Function
from contin.errors import ProblemError
from contin.functions import derivatives
from contin.functions.iteration import operands_of, search_of, solved
from contin.functions.recorded_arrays import NUMPY
from contin.functions.recording import recorded_paths
from contin.functions.stand_ins import RecordedFunction
from contin.functions.tape import Number, Tape, Unrecordable
from contin.text import Shown


@dataclass(frozen=True, repr=False)
class Variation(Shown):
    """What a variational problem is made of; as in `contin.VariationalProblem`.

    ``hamiltonian`` stands instead of ``energy`` and ``kinematics``, or is None.
    """

    energy: Function | None
    kinematics: Function | None
    ends: Function | None
    end_energy: Function | None
    hamiltonian: Function | None
    integrals: Mapping[str, Function]
    functionals: Mapping[str, Function]
    states: tuple[str, ...]
    controls: tuple[str, ...]
    parameters: tuple[str, ...]
    starts: tuple[float, ...]
    work: Function | None = None
    end_work: Function | None = None
    pushes: Mapping[int, str] = dataclasses.field(default_factory=dict)


@dataclass(frozen=True, repr=False)
class Canonical(Shown):
    """The derived functions, and how many multipliers of end conditions there are.

    ``rhs(t, u, p)``, ``boundary(u0, u1, p)``, ``integrals(t, u, p)`` or None, and ``functionals[name](t, u, p)`` take u = (x,
    lambda) and p = (parameters, mu, sigma). ``legendre(t, u, p)`` are the pivots of -d2H/dw2 (None where H is given).
    ``fixed`` are the states that end conditions fix, at the first and at the last end.
    """

    rhs: Function
    boundary: RecordedFunction
    integrals: Function | None
    functionals: Mapping[str, Function]
    legendre: Function | None
    sigmas: int
    fixed: tuple[tuple[int, ...], tuple[int, ...]]


def canonical(variation: Variation) -> Canonical:
    """Return the canonical equations of a variational problem.

    Raises ProblemError for a function that cannot be differentiated, an energy that does not depend on a control, or end
    conditions that repeat each other.
    """
    ends = EndConditions(variation)
    inside = _Inside(variation, ends.sigmas)
    functionals = {name: inside.function(f"functional {name}", [value], True) for name, value in inside.columns().items()}
    return Canonical(
        inside.function("rhs", [*inside.rates, *inside.forces]), ends.function(),
        inside.function("integrals", inside.load, len(inside.load) == 1) if inside.load else None, functionals,
        inside.function("legendre", inside.pivots) if inside.pivots else None, ends.sigmas, ends.fixed,
    )  # fmt: skip


def _named(names: Sequence[str], values: Sequence[Any]) -> Any:
    kind: Any = namedtuple("Values", list(names))  # type: ignore[misc]  # noqa: PYI024
    return kind(*values)


def _called(tape: Tape, what: str, function: Function, arguments: Sequence[Any], count: int | None = None) -> list[Number]:
    """Return the values of a user's function; ``count`` many of them."""

    def call(copy: Any) -> Sequence[Any]:
        result = copy(*arguments)
        values = list(result) if isinstance(result, (tuple, list, np.ndarray)) else [result]
        for value in values:
            if isinstance(value, (str, bool, np.bool_, complex)) or value is None:
                raise ProblemError(f"{what} returns {checks.shown(value)}, must return numbers")
        return values

    try:
        found = [Number(tape, place) for place in recorded_paths(tape, function, call)]
    except Unrecordable as reason:
        raise ProblemError(f"{what} cannot be differentiated: {reason}") from None
    if count is not None and len(found) != count:
        raise ProblemError(f"{what} returns {len(found)} values, must return {count}")
    for value in found:
        known = [tape.value(place) for place in tape.needed([value.place])]
        if any(number is not None and math.isnan(number) for number in known):
            raise ProblemError(f"{what} has no finite real value: it contains nan")
        if value.known is not None and math.isinf(value.known):
            raise ProblemError(f"{what} has no finite real value: {value.known}")
    return found


def _derivatives(tape: Tape, values: Sequence[Number], by: Sequence[Number]) -> list[list[Number]]:
    """Return the derivatives of values (rows) by inputs."""
    places = derivatives.jacobian(tape, [value.place for value in values], [each.place for each in by])
    zero = tape.constant(0.0)
    return [[Number(tape, places.get((i, j), zero)) for j in range(len(by))] for i in range(len(values))]


def _pulls(
    tape: Tape,
    what: str,
    work: Function,
    before: list[Any],
    states: Sequence[tuple[tuple[str, ...], list[Number]]],
    rest: list[Any],
) -> list[Number]:
    """Return the derivatives by y, at y = x, of the work that loads at states x do on states y."""
    moved = [[tape.input((what, number, i)) for i in range(len(x))] for number, (_, x) in enumerate(states)]
    at, on = ([_named(names, values) for (names, _), values in zip(states, both)] for both in ([x for _, x in states], moved))
    values = _called(tape, what, work, [*before, *at, *on, *rest], 1)
    x, y = ([value for group in both for value in group] for both in ([x for _, x in states], moved))
    (slopes,) = _derivatives(tape, values, y)
    places = tape.substitute([slope.place for slope in slopes], {old.place: new.place for old, new in zip(y, x)})
    return [Number(tape, place) for place in places]


class _Inside:
    """Equations between the ends: operations on one tape, whose inputs are t, x, lambda and all parameters."""

    def __init__(self, variation: Variation, sigmas: int) -> None:
        self.variation, self.tape = variation, Tape(NUMPY)
        v, tape = variation, self.tape
        n = len(v.states)
        self.t = tape.input("t")
        self.u = [tape.input(slot) for slot in range(2 * n)]
        self.x, self.lam = self.u[:n], self.u[n:]
        multipliers = [f"mu_{name}" for name in v.integrals] + [f"sigma_{i + 1}" for i in range(sigmas)]
        self.parameters = (*v.parameters, *multipliers)
        self.p = [tape.input(2 * n + slot) for slot in range(len(self.parameters))]
        self.mu = self.p[len(v.parameters) : len(v.parameters) + len(v.integrals)]
        self.w = [tape.input(("control", i)) for i in range(len(v.controls))]
        self.pivots: list[Number] = []
        self.load: list[Number] = []
        self.forces: list[Number] = []
        self._from_hamiltonian() if v.hamiltonian is not None else self._from_energy()
        if v.work is not None:
            given = [_named(v.parameters, self.p[: len(v.parameters)])]
            pulls = _pulls(tape, "work", v.work, [self.t], [(v.states, self.x)], given)
            self.forces = [force - pull for force, pull in zip(self.forces, pulls)]

    # --- H and the controls --------------------------------------------------------------------------------------

    def _at(self, what: str, function: Function, count: int = 1) -> list[Number]:
        """Return the values of a function of (t, x, w, p)."""
        v = self.variation
        given = [_named(v.states, self.x), _named(v.controls, self.w), _named(v.parameters, self.p[: len(v.parameters)])]
        return _called(self.tape, what, function, [self.t, *given], count)

    def _slopes(self, value: Number, by: Sequence[Number]) -> list[Number]:
        return _derivatives(self.tape, [value], by)[0]

    def _from_hamiltonian(self) -> None:
        v = self.variation
        assert v.hamiltonian is not None
        named = [_named(v.states, self.x), _named(v.states, self.lam), _named(v.parameters, self.p[: len(v.parameters)])]
        (H,) = _called(self.tape, "hamiltonian", v.hamiltonian, [self.t, *named], 1)
        self.rates = self._slopes(H, self.lam)
        self.forces = [-slope for slope in self._slopes(H, self.x)]
        self.density = sum((momentum * rate for momentum, rate in zip(self.lam, self.rates)), self.tape.number(0.0)) - H
        self._known = {w.place: rate.place for w, rate in zip(self.w, self.rates)}  # the controls are the rates of the states

    def _from_energy(self) -> None:
        v, tape = self.variation, self.tape
        assert v.energy is not None
        (self.density,) = self._at("energy", v.energy)
        self.rates = self.w if v.kinematics is None else self._at("kinematics", v.kinematics, len(v.states))
        if not any(self._reads(rate, self.w) for rate in self.rates):
            raise ProblemError("kinematics: no rate depends on a control, so nothing can vary")
        self.load = [self._at(f"integrals: {name}", g)[0] for name, g in v.integrals.items()]
        for name, value in zip(v.integrals, self.load):
            if not self._reads(value, [*self.x, *self.w]):
                raise ProblemError(f"integrals: {name} depends on no state and no control, so nothing makes its integral zero")
        convex = self.density
        for momentum, rate in zip(self.lam, self.rates):
            convex = convex - momentum * rate
        for mu, value in zip(self.mu, self.load):
            convex = convex + mu * value
        self.forces = self._slopes(convex, self.x)
        slopes = self._slopes(convex, self.w)
        second = _derivatives(tape, slopes, self.w)
        self._check(second)
        if any(self._reads(entry, self.w) for row in second for entry in row):
            controls = self._searched(convex)
        else:
            zero = self.tape.constant(0.0)
            at_zero = tape.substitute([slope.place for slope in slopes], {w.place: zero for w in self.w})
            controls = solved(second, [-Number(tape, place) for place in at_zero], True)
        self._known = {w.place: tape.number(found).place for w, found in zip(self.w, controls)}
        self.pivots = self._controlled(_pivots(second))
        self.rates, self.forces = self._controlled(self.rates), self._controlled(self.forces)
        self.load, self.density = self._controlled(self.load), self._controlled([self.density])[0]

    def _reads(self, value: Number, sources: Sequence[Number]) -> bool:
        return self.tape.reading([value.place], [each.place for each in sources])[value.place]

    def _controlled(self, values: Sequence[Number]) -> list[Number]:
        return [Number(self.tape, place) for place in self.tape.substitute([each.place for each in values], self._known)]

    def _check(self, second: Sequence[Sequence[Number]]) -> None:
        """Raise ProblemError for an energy that is not convex in the controls at any place, or does not determine them."""
        v = self.variation
        for name, row in zip(v.controls, second):
            if all(entry.known == 0 for entry in row):
                raise ProblemError(f"energy: its second derivative by the control {name} is zero, it must be convex in it")
        constant = all(entry.known is not None for row in second for entry in row)
        found = self._probed([entry for row in second for entry in row])
        matrices = [np.reshape(values, (len(v.controls),) * 2) for values in found]
        if not matrices:
            return
        if constant and np.linalg.matrix_rank(matrices[0]) < len(v.controls):
            names = ", ".join(v.controls)
            raise ProblemError(f"energy: it does not determine the controls {names}: its second derivative is singular")
        concave = [name for i, name in enumerate(v.controls) if all(matrix[i, i] <= 0 for matrix in matrices)]
        if (concave and constant) or (constant and np.linalg.eigvalsh(matrices[0]).min() <= 0):
            raise ProblemError(f"energy: it is not convex in the controls {', '.join(concave or v.controls)}")

    def _probed(self, values: Sequence[Number]) -> list[list[float]]:
        """Return values at a few places of all inputs where they are finite."""
        places = [value.place for value in values]
        inputs = [place for place in self.tape.needed(places) if self.tape.operations[place].name == "input"]
        found = []
        for number in _PROBES:
            given = {self.tape.operations[place].data: number + 0.01 * i for i, place in enumerate(inputs)}
            at = self.tape.evaluate(places, given)
            if np.isfinite(at).all():
                found.append(at)
        return found

    def _searched(self, convex: Number) -> list[Number]:
        """Return the controls as the minimum of -H.

        Raises ProblemError where the energy has no value where the search starts.
        """
        tape, v = self.tape, self.variation
        search = search_of(tape, [w.place for w in self.w], [convex.place], v.starts, True)
        search = dataclasses.replace(search, saddles=True)  # a run says where the energy is not convex
        start = {w.place: tape.constant(value) for w, value in zip(self.w, v.starts)}
        at_start = [Number(tape, place) for place in tape.substitute([search.potential, *search.slopes], start)]
        if not self._probed(at_start):
            places = ", ".join(f"{name} = {value:g}" for name, value in zip(v.controls, v.starts))
            raise ProblemError(f"starts: the energy has no value at the controls {places}")
        operands = operands_of(tape, search)
        return [tape.apply("root", *operands, data=(search, i)) for i in range(len(self.w))]

    # --- functions -----------------------------------------------------------------------------------------------

    def columns(self) -> dict[str, Number]:
        """Return the functionals: the energy first, unless the user states one of that name."""
        own = {name: self._at(f"functionals: {name}", f)[0] for name, f in self.variation.functionals.items()}
        return {**({} if "energy" in own else {"energy": self.density}), **dict(zip(own, self._controlled(list(own.values()))))}

    def function(self, name: str, values: Sequence[Number], single: bool = False) -> RecordedFunction:
        """Return a function of (t, u, p)."""
        v = self.variation
        states = (*v.states, *(f"lam_{state}" for state in v.states))
        inputs = [each.place for each in (self.t, *self.u, *self.p)]
        arguments = [None, states, self.parameters]
        return RecordedFunction(name, "tup", arguments, self.tape, inputs, [each.place for each in values], single)


#: Numbers at which derivatives are looked at, in the domain of most functions.
_PROBES = (0.5, 1.5, -0.5, 0.1)


def _pivots(second: Sequence[Sequence[Number]]) -> list[Number]:
    a, pivots = [list(row) for row in second], []
    for i in range(len(a)):
        pivots.append(a[i][i])
        for j in range(i + 1, len(a)):
            factor = a[j][i] / a[i][i]
            a[j] = [y - factor * x for x, y in zip(a[i], a[j])]
    return pivots


class EndConditions:
    """Conditions at the ends: operations on one tape, whose inputs are x and lambda at both ends, and all parameters.

    - ``sigmas`` (int): Number of conditions that do more than fix one state.
    - ``fixed`` (tuple): As in `Canonical`.
    """

    def __init__(self, variation: Variation) -> None:
        self.variation, self.tape = variation, Tape(NUMPY)
        v, tape = variation, self.tape
        n = len(v.states)
        self.a, self.b = ([tape.input(slot + 2 * n * end) for slot in range(2 * n)] for end in range(2))
        self.parameters = (*v.parameters, *(f"mu_{name}" for name in v.integrals))
        self.p = [tape.input(4 * n + slot) for slot in range(len(self.parameters))]
        given = [_named(v.states, self.a[:n]), _named(v.states, self.b[:n]), _named(v.parameters, self.p[: len(v.parameters)])]
        self.conditions = [] if v.ends is None else _called(tape, "ends", v.ends, given)
        energy = [] if v.end_energy is None else _called(tape, "end_energy", v.end_energy, given, 1)
        self.places = [*self.a[:n], *self.b[:n]]
        self.slopes = _derivatives(tape, self.conditions, self.places)
        self._check()
        fixed: tuple[list[int], list[int]] = ([], [])
        free: dict[int, Number] = {}
        for number in v.pushes:
            if not 0 <= number < len(self.conditions):
                raise ProblemError(f"pushes: {number} is not the number of an end condition, 0 to {len(self.conditions) - 1}")
        for number, condition in enumerate(self.conditions):
            place = None if number in v.pushes else self._fixes(number)
            if place is None:
                free[number] = condition
            elif place[1] in fixed[place[0]]:
                end, state = ("first", "last")[place[0]], v.states[place[1]]
                raise ProblemError(f"ends: condition {number + 1} fixes {state} at the {end} end, which another one does")
            else:
                fixed[place[0]].append(place[1])
        self.fixed, self.sigmas = (tuple(fixed[0]), tuple(fixed[1])), len(free)
        self.parameters += tuple(f"sigma_{i + 1}" for i in range(len(free)))
        sigma = [tape.input(4 * n + len(self.p) + i) for i in range(len(free))]
        self.p += sigma
        own = energy[0] if energy else tape.number(0.0)
        potential = sum((s * condition for s, condition in zip(sigma, free.values())), own)
        (by,) = _derivatives(tape, [potential], self.places)
        if v.end_work is not None:
            pulls = _pulls(tape, "end_work", v.end_work, [], [(v.states, self.a[:n]), (v.states, self.b[:n])], given[2:])
            by = [slope - pull for slope, pull in zip(by, pulls)]
        starting, ending = self.a[n:], self.b[n:]
        self.values = [*self.conditions]
        for number in v.pushes:
            gap, force = self.conditions[number], -dict(zip(free, sigma))[number]
            self.values[number] = tape.apply("select", force - gap < 0, force, gap)  # what touches without force is held
        self.values += [starting[i] - by[i] for i in range(n) if i not in fixed[0]]
        self.values += [ending[i] + by[n + i] for i in range(n) if i not in fixed[1]]

    def _check(self) -> None:
        """Raise ProblemError for end conditions without a state, and for those linear ones that depend on others."""
        held = len(self.conditions) - len(self.variation.pushes)
        if held > len(self.places):
            raise ProblemError(f"ends returns {held} conditions, {len(self.places)} fix all states at both ends")
        independent: list[list[float]] = []
        for number, row in enumerate(self.slopes):
            known = [slope.known for slope in row]
            if not any(value is None or value for value in known):
                raise ProblemError(f"ends: condition {number + 1} depends on no state")
            if None not in known and number not in self.variation.pushes:
                independent.append([float(value or 0.0) for value in known])
                if np.linalg.matrix_rank(np.array(independent)) < len(independent):
                    raise ProblemError(f"ends: condition {number + 1} repeats or contradicts those before it")

    def _fixes(self, number: int) -> tuple[int, int] | None:
        """Return the end and the state that a condition fixes: it has a constant slope in that one, and none in the others."""
        own = [place for place, slope in enumerate(self.slopes[number]) if slope.known != 0]
        if len(own) != 1 or self.slopes[number][own[0]].known is None:
            return None
        end, state = divmod(own[0], len(self.variation.states))
        return end, state

    def function(self) -> RecordedFunction:
        """Return the function of (a, b, p)."""
        v = self.variation
        states = (*v.states, *(f"lam_{state}" for state in v.states))
        inputs = [each.place for each in (*self.a, *self.b, *self.p)]
        places = [value.place for value in self.values]
        return RecordedFunction("boundary", "abp", [states, states, self.parameters], self.tape, inputs, places)
