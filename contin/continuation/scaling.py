"""Sizes of states and parameters, found at the first point of a run and corrected on the way.

A size says from what change on the equations are no longer linear. Values that are known there are sizes; those of unknowns
that are zero, or nothing but errors, follow from the exact Taylor expansion of F along the branch:

1. The tangent t of the branch, and its derivatives with respect to the primary parameter p. The smallest change of p at which a
   term of higher order is as large as the linear one bounds the size of p.
2. The distance to the nearest singular point, where F_x is singular: 1 / |mu|, for the eigenvalue mu of largest modulus of
   -F_x^-1 F_xx[t, .], by power iteration. It bounds the size of p too: on a trivial branch, nothing else does. Far beyond the
   change of 1 it says nothing, as F_x no longer changes with the first power of p (a diode at -1 V).
3. The eigenvector v of mu leads to the branch that leaves there. The amplitude at which a nonlinear term along v is as large as
   the linear one is the size of the states that take part in v.

Where the branch is flat in p, as at the top of a circle, its bend alone bounds the size of p: a term of higher order that is as
large as a state whose small value is more than nothing, since F_x would be singular not much further than that away.

All of these are made with F_x^-1 and compared state by state, so that they do not depend on units. A limit is no size: it can
only make one smaller. Where nothing is found the size is one; a branch that outgrows a size gets a larger one. Only sizes far
from one count (`contin.core.system`): the expansion is not made where three values of F show that none is (`usual`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from contin import draws
from contin.arrays import Array, Pattern
from contin.core.newton import UNITS, Newton, rounded_off
from contin.core.protocol import Carrier, Discretization
from contin.core.settings import Settings
from contin.core.system import USUAL, System, usual
from contin.core.trial import Linearization, Trial
from contin.errors import ConvergenceError
from contin.events.folds import on_finer_mesh
from contin.levels import APART, CORRECTED, DOUBLED, LOCATED, ROUGH, ROUND_OFF
from contin.linalg.blocks import MANY
from contin.problems.statement import declared

#: Iterations of the power method, and largest Krylov space that parts close eigenvalues. Sizes are powers of two: the distance
#: to the nearest singular point needs no digits. Ten times more separate eigenvalues that differ by a tenth.
_ITERATIONS = 12
#: Fewest numbers that are compared.
_FEWEST = 4
#: Largest error of a state in an eigenvector, relative to that state. The power method leaves .03 of eigenvalues that are
#: close; at .5 what it leaves of others counts as their size.
_LASTS = 0.1
#: Round-off is told by what changes where everything is computed again, and once where that is below this part of what was
#: found. Of single numbers two that are nothing but round-off agree to a
#: thirtieth in one case of fifty: under one of OpenBLAS's kernels an arch had a multiplier of size 1e-16, and did not move.
_CLEAR = 1e4
#: Random vectors along which changes of F are looked at, at most: one may lead out of the domain of a connection, or move a
#: state by little by chance. Each takes five residuals, a search a hundred solutions.
_VECTORS = 2
#: A state in which F is linear up to this change has no size. At 1e9, one of 1e10 would not be searched for; numbers of 1e160
#: have no squares.
_LINEAR = 1e12
#: Highest order of the expansion where functions are recorded: a branch that leaves as x^5 has a size, as x^7 none.
_HIGHEST = 5


def scaled(
    system: Any, x: Array, row: Array, linear: Linearization, primary: str, settings: Settings
) -> tuple[Discretization, Array]:
    """Return the system with sizes of states and parameters taken from a first point, and x for it.

    ``linear`` is the linearization at x, bordered by ``row``. Unchanged where it has sizes already, or where all are of order
    one.
    """
    if system.on_curve or not system.scales.are_one:
        return system, x
    problem, states = system.problem, list(system.problem.states)
    names, stated = [*states, *system.free], settings.scales
    sizes, held = system.largest(x), dict(zip(problem.parameters, np.abs(system.parameters)))
    values = {**held, **dict(zip(names, sizes))}
    own = {name: max(size, values[name]) for name, size in declared(problem, "sizes").items()}
    stated = own | dict(stated)
    alike: Mapping[str, str] = getattr(problem, "alike", {})
    given = {name: values[other] for name, other in alike.items() if values[other] >= USUAL[0]} | stated
    unknown = [name for name, size in zip(names, sizes) if max(size, given.get(name, 0.0)) < USUAL[0]]
    if unknown or any(0 < size < USUAL[0] for size in held.values()):
        first = _FirstPoint(system, x, row, linear, primary, settings.newton)
        bounds = (*settings.limits.get(primary, ()), *settings.zeros.get(primary, ()))
        said = min((abs(float(number)) for number in bounds if number), default=np.inf)
        if said >= USUAL[0] and any(first.usual(np.array([name in unknown for name in names])) for _ in range(_VECTORS)):
            sizes = np.where(sizes < USUAL[0], 1.0, sizes)
        else:
            sizes = first.sizes(np.array([given.get(name, 0.0) for name in names]), said)
        small = [name for name, size in held.items() if 0 < size < USUAL[0]]
        counting = first.counting(small, held, sizes) if small else small
        held |= {name: 0.0 for name in small if name not in counting}
    known = dict(zip(names, sizes))
    sizes = np.array([stated.get(name, known[alike.get(name, name)]) for name in names])
    of_parameters = {**held, **stated, **dict(zip(system.free, sizes[len(states) :]))}
    by_name, both = {**of_parameters, **dict(zip(states, sizes))}, (states, list(problem.parameters))
    found = [usual(np.array([by_name[name] for name in names]), np.array([name in own for name in names])) for names in both]
    return (system, x) if all(np.all(each == 1) for each in found) else system.with_scales(x, *found)


@dataclass(frozen=True, eq=False, repr=False)
class _Mode:
    """A null vector at a singular point: an eigenvector of the change of F_x along the branch, of first or second order."""

    vector: Array
    rate: float
    order: int

    @property
    def distance(self) -> float:
        """Change of the primary parameter up to the singular point."""
        return float(self.rate ** (-1 / self.order))


class _FirstPoint:
    """A first point and the expansion of the branch there: x + s t + ..., with s the change of the primary parameter.

    Arrays by name have the shape (states + free parameters,): the largest value of each state, and each free parameter.
    """

    def __init__(self, system: System, x: Array, row: Array, linear: Linearization, primary: str, newton: Newton) -> None:
        self.system, self.x, self.row, self.linear, self._newton = system, x, row, linear, newton
        self._factors: Any = linear.factors
        self.place = system.parameter_index(primary)
        self.at = len(system.problem.states) + system.free.index(primary)
        rate = linear.tangent[self.place]
        self.tangent = np.zeros_like(x) if self._stands_still(rate) else linear.tangent / rate
        self._random, count, size = draws.generator("scaling"), len(system.problem.states), system.state_size
        self._names = np.concatenate([np.arange(size) % count, np.arange(count, count + x.size - size)])  # of each unknown
        self._others: list[tuple[Array, Any, float]] = []

    def _stands_still(self, rate: float) -> bool:
        """Return whether the primary parameter stands still while states go on: by itself, and relative to all values.

        At a fold it does so as far as the fold is located.
        """
        x, tangent = np.abs(self.x), np.abs(self.linear.tangent)
        value, moving = x[self.place], (x > 0) & (tangent > 0)
        slow = abs(rate) * x[moving] <= LOCATED * value * tangent[moving]  # no quotients: zeros may have become 1e-300
        return bool(abs(rate) <= LOCATED and (rate == 0 or (value > 0 and slow.any())))

    @np.errstate(all="ignore")
    def usual(self, unknown: Pattern) -> bool:
        """Return whether all sizes are of order one, as changes of F along a random vector show: they are not looked for then.

        For changes of 0.01 in all unknowns, F is nearly linear. For changes of 1, each ``unknown`` that does not change along
        the branch changes by terms that are not linear, or not at all: then no term of the expansion moves it. For a change of
        1000 of its own, most of that is not linear in it, or there are such terms for a change of 1 of its own alone, or it is
        linear in it up to 1e12: then it has no size.
        """
        largest, at_rest, along = self.system.largest, self.system.residual(self.x), self.system.largest(self.linear.tangent)
        still = unknown & (along < USUAL[0])
        moved = draws.signs(self._random, along) * self._random.uniform(0.5, 1, unknown.size)

        def missed(sizes: Array | float) -> Array:
            change = self._kept(np.ones_like(self.x), sizes * moved)
            try:
                values = self.system.residual(self.x + change) - at_rest
            except ConvergenceError:  # outside of the domain of a connection: that is not linear
                return np.full_like(self.x, np.inf)
            return np.asarray(self._factors.solve(np.append(values, self.row @ change)) - change)

        def bent(size: float) -> Array:
            far = missed(np.where(still, size, 1.0))
            return np.where(largest(far) < np.inf, largest(far - size * here) / (size * largest(here)), np.nan)

        here = missed(1.0)
        follows, idle = largest(here) >= USUAL[0], along + largest(here) < ROUND_OFF
        if not (follows.any() and np.all(largest(missed(USUAL[0])) <= USUAL[0]) and np.all(follows | idle | ~still)):
            return False
        clear = idle | ~still | (bent(USUAL[1]) >= 0.5)
        if not clear.all():
            clear |= largest(missed(np.where(still, 1.0, 0.0))) >= USUAL[0]
        return bool(clear.all() or np.all(clear | (bent(_LINEAR) < 0.5)))

    @np.errstate(over="ignore")  # what a term of 1e-316 bounds is far away
    def sizes(self, stated: Array, said: float) -> Array:
        """Return sizes; 0 where nothing is known. ``stated`` are those that are given, ``said`` bounds that of the primary."""
        error, error_of_tangent = self._errors()
        values = self.system.largest(self.x)
        known = np.where(stated > 0, stated, np.where(values > error, values, 0.0))
        self.tangent = self._kept(self.tangent, self.system.largest(self.tangent) > error_of_tangent)
        if not self.tangent.any():  # a fold: sizes that are small are known on the branch that led here
            return np.where((known > DOUBLED) | (stated > 0), known, 0.0)
        own = type(self.system).along is not Discretization.along  # a kind of system of others has differences
        if not own or any(batch.interpreted is not None for batch in self.system._evaluated):
            return known  # differences are taken over lengths of order one: they show no other sizes
        at = np.arange(known.size) == self.at
        terms = [self.system.largest(term) for term in self._terms()]
        far = _reach(terms) / ROUGH
        modes = [mode for mode in self._modes(known) if mode.distance <= far]
        reach = min([_reach(terms), *(mode.distance for mode in modes)])
        small = (known > 0) & (known < USUAL[0]) & ~at
        bends = np.where(at | (small & ~(known > DOUBLED * self._alone(small))), 0.0, known)
        reach = min(_held(reach, terms[0], np.where(at, 0.0, known)), _bent(terms, bends))
        natural = np.where(at, min(reach if np.isfinite(reach) else 1.0, said), 0.0)
        change = min(natural[self.at], known[self.at] if _counts(known, natural)[self.at] else np.inf)
        natural = _larger(natural, _sizes(terms, change), ~at, error)
        branches = [self._settled_branch(mode) for mode in modes if mode.vector.any()]
        branches = [(parts, size) for parts, size in branches if np.any(parts)]  # some are nothing but what changes
        held = [_held(size, parts[0], known) for parts, size in branches]
        for (parts, _), size in zip(branches, held):
            if np.isfinite(size):
                natural = _larger(natural, _sizes(parts, size), ~at, error)
        for (parts, _), size in zip(branches, held):
            if not np.isfinite(size):
                sizes = _sizes(parts, _balanced(parts, np.where(known > 0, known, natural)))
                natural = _larger(natural, sizes, natural == 0, error)
        found = np.where(_counts(known, natural) | (stated > 0), known, natural)
        small = (found > 0) & (found < USUAL[0]) & (stated == 0) & ~at
        alone = self._alone(small)  # infinite for states that enter linearly, which go as far as 1e12
        apart = np.where(np.isfinite(alone), np.minimum(alone, 1.0), 0.0)
        found = np.where(small & ~_counts(found, apart), apart, found)
        guessed = (known == 0) & (terms[0] == 0) & (stated == 0) & ~at
        nothing = found < CORRECTED * np.max(found[guessed], initial=0.0)
        return np.where(guessed & nothing, 0.0, found)

    def _beside(self, number: int) -> tuple[Array, Any, float]:
        """Return a point that differs by one unit in the last place, with factors there, and a factor between one and two.

        What is computed there, of everything that is longer by the factor, shows round-off: sums that cancel may leave the same
        where only their terms move.
        """
        while len(self._others) <= number:
            x = draws.rounded(self._random, self.x)
            self._others.append((x, self.system.linearize(x, (self.row,))[1], 1 + self._random.random()))
        return self._others[number]

    def _error(self, found: Array, again: Callable[[int], Array], times: int = draws.DRAWS) -> Array:
        """Return the round-off of what was found, by name, from computing it again; more often where it may be all there is."""
        size, error = self.system.largest(found), np.zeros(1)
        for number in range(times):
            with np.errstate(all="ignore"):
                error = np.fmax(error, UNITS * self.system.largest(found - again(number)))
            if not np.any((size > error) & ~((size > _CLEAR * error) & (error > 0))):
                break
        return error

    def counting(self, names: Sequence[str], values: Mapping[str, float], sizes: Array) -> set[str]:
        """Return the parameters whose small values are more than nothing: without them, a state would change."""
        with np.errstate(all="ignore"):
            columns = self.system.parameter_columns(self.x, names).T
            changes = self._factors.solve(np.hstack([columns, np.zeros((len(names), 1))]))
        return {name for name, change in zip(names, changes)
                if np.any(values[name] * self.system.largest(change) > DOUBLED * sizes)}  # fmt: skip

    # --- the expansion -------------------------------------------------------------------------------------------

    def _terms(self) -> Iterator[Array]:
        """Return the tangent and F_x^-1 of the derivatives of F of second and third order along it, over their factorials."""
        yield self.tangent
        for order in (2, 3):
            yield self._solved([self.tangent] * order) / math.factorial(order)

    def _solved(self, directions: Sequence[Array], times: int = draws.DRAWS) -> Array:
        """Return F_x^-1 of the derivative of F along directions, zero in states where that is nothing but round-off."""

        def again(number: int) -> Array:
            x, factors, longer = self._beside(number)
            rounded = {id(direction): draws.rounded(self._random, longer * direction) for direction in directions}
            right = self.system.along(x, [rounded[id(direction)] for direction in directions])
            return factors.solve(draws.rounded(self._random, np.append(right, 0.0))) / longer ** len(directions)

        with np.errstate(all="ignore"):
            found = self._factors.solve(np.append(self.system.along(self.x, directions), 0.0))
        if not np.isfinite(found).all():
            return np.zeros_like(found)
        return self._kept(found, self.system.largest(found) > self._error(found, again, times))

    def _modes(self, known: Array) -> Iterator[_Mode]:
        """Return singular points along the branch: the nearest one, then those of states that take no part in it."""
        left = np.arange(known.size) != self.at  # the primary parameter is held: it takes part in no null vector
        while np.any(left & (known < USUAL[0])):
            mode = self._nearest(self.tangent, left)
            if mode is None:
                return
            yield mode
            part = self.system.largest(mode.vector) > 0
            if not np.any(part & left):
                return
            left = left & ~part

    def _alone(self, which: Pattern) -> Array:
        """Return how far states can change by themselves before F_x is singular; infinity where that never happens."""
        found = np.full(which.size, np.inf)
        for number in np.flatnonzero(which) if np.count_nonzero(which) <= MANY else ():
            alone = self._kept(np.ones_like(self.x), np.arange(which.size) == number)
            mode = self._nearest(alone, np.ones_like(which))
            found[number] = np.inf if mode is None else mode.distance
        return found

    def _nearest(self, direction: Array, kept: Pattern) -> _Mode | None:
        """Return the nearest singular point in a direction and the null vector there, of some states; None where there is none.

        The change of F_x is that of first or second order.
        """
        found: _Mode | None = None
        for order in (1, 2):
            v, growth = self._kept(self._random.standard_normal(self.x.size), kept), []
            for _ in range(_ITERATIONS):
                image = self._changed(v, direction, order)
                growth.append(float(np.linalg.norm(image) / np.linalg.norm(v)))
                if not growth[-1] > 0:
                    break
                v = image / np.linalg.norm(image)
                if _has_settled(growth):
                    break
            if growth[-1] > 0:
                rate = float(np.exp(np.mean(np.log(growth[-4:]))))
                nearer = found is None or rate ** (-1 / order) < found.distance
                if rate > APART * max(growth[2:]) and nearer:
                    found = self._mode(v, direction, rate, order)
        return found

    def _changed(self, v: Array, direction: Array, order: int) -> Array:
        """Return F_x^-1 of the change of F_x v in a direction, of first or second order: one of many iterations."""
        return self._solved([*[direction] * order, v], times=1) / math.factorial(order)

    def _mode(self, v: Array, direction: Array, rate: float, order: int) -> _Mode:
        """Return the part of v that belongs to the eigenvalue ``rate`` or its negative; zeros for complex ones.

        Both occur, where the parameter couples two states only; v is then in turn of one state and of the other. Where other
        eigenvalues are close, the power method has left of theirs too: then Arnoldi's method parts them.
        """
        image = self._changed(v, direction, order) / rate
        mode, sign = max(((v + image, 1.0), (v - image, -1.0)), key=lambda pair: float(np.linalg.norm(pair[0])))
        missed = self._changed(mode, direction, order) / rate - sign * mode
        if np.any(self.system.largest(missed) > _LASTS**2 * self.system.largest(mode)):
            parted = self._parted(v, direction, order)
            if parted is not None:
                mode, value = parted
                v, rate, image = mode, abs(value), self._changed(mode, direction, order) / abs(value)
                missed = image - math.copysign(1.0, value) * mode
        noise = self._changed(draws.rounded(self._random, v), direction, order) / rate - image
        errors = np.maximum(self.system.largest(missed) / _LASTS, UNITS * self.system.largest(noise))
        found = self._kept(mode, self.system.largest(mode) > errors)
        alone, left_out = (self.system.largest(each) for each in (found, self._changed(found, direction, order)))
        return _Mode(np.zeros_like(v) if np.any((alone == 0) & (left_out > 0)) else found, rate, order)

    def _parted(self, v: Array, direction: Array, order: int) -> tuple[Array, float] | None:
        """Return the eigenvector of the largest eigenvalue in the Krylov space of v, and that; None where it is complex."""
        basis, matrix = [v / np.linalg.norm(v)], np.zeros((_ITERATIONS + 1, _ITERATIONS))
        for place in range(_ITERATIONS):
            image = self._changed(basis[-1], direction, order)
            size = np.linalg.norm(image)
            for _ in range(2):
                shares = np.array([known @ image for known in basis])
                image = image - shares @ np.array(basis)
                matrix[: len(basis), place] += shares
            matrix[place + 1, place] = np.linalg.norm(image)
            if not matrix[place + 1, place] > DOUBLED * size:
                break
            basis.append(image / matrix[place + 1, place])
        count = place + 1
        values, vectors = np.linalg.eig(matrix[:count, :count])
        largest = int(np.abs(values).argmax())
        if values[largest].imag != 0 or values[largest] == 0:
            return None
        return vectors[:, largest].real @ np.array(basis[:count]), float(values[largest].real)

    def _settled_branch(self, mode: _Mode) -> tuple[list[Array], float]:
        """Return what `_branch` does, without states that change with the next iterations of the null vector.

        They belong to what the power method has left of other eigenvectors, where symmetry makes them zero.
        """
        again = mode.vector
        for _ in range(2):  # the sign is that of the first again
            again = self._changed(again, self.tangent, mode.order) / mode.rate
        parts, size = self._branch(mode)
        pairs = zip(parts, (largest for largest, _ in self._terms_along(replace(mode, vector=again))))
        return [np.where(np.abs(part - other) < _LASTS * part, part, 0.0) for part, other in pairs], size

    def _branch(self, mode: _Mode) -> tuple[list[Array], float]:
        """Return the terms of the branch that leaves along a null vector v, and the size of a, both described below.

        At this size a term of higher order in a, there or at the singular point, is as large along v as the change of F_x v
        from here to the singular point. It is infinity where F is linear along v.
        """
        size, parts = np.inf, []
        for order, (largest, terms) in enumerate(self._terms_along(mode), 1):
            size = min([size, *(self._equal(term, mode) ** (1 / (order - 1)) for term in terms)])
            parts.append(largest)
            if order >= 3 and np.isfinite(size):
                break
        return parts, size

    def _terms_along(self, mode: _Mode) -> Iterator[tuple[Array, tuple[Array, ...]]]:
        """Yield the terms of the branch that leaves along a null vector v, x + a v + a^2 ..., by order, the largest by name.

        Behind the first, with the terms here and at the singular point.
        """
        v, second = mode.vector, np.zeros_like(mode.vector)
        yield self.system.largest(v), ()
        for order in range(2, _HIGHEST + 1):
            here = self._solved([v] * order) / math.factorial(order)
            there = np.zeros_like(v)
            if order < _HIGHEST:
                there = mode.distance * self._solved([self.tangent, *[v] * order]) / math.factorial(order)
            if order == 2:
                second = here + there
            if order == 3:
                here = here - self._solved([v, second])
            yield np.maximum(self.system.largest(here), self.system.largest(there)), (here, there)

    def _equal(self, term: Array, mode: _Mode) -> float:
        """Return how much longer a null vector is than a term along it: what the power method leaves of the term.

        Infinity where that is nothing but round-off. Only states that take part in the null vector count: others may have
        larger eigenvalues.
        """
        mine = self.system.largest(mode.vector) > 0
        left = term = self._kept(term, mine)
        sizes = [float(np.linalg.norm(term))]
        while sizes[-1] > 0 and len(sizes) <= _ITERATIONS and not _has_settled(sizes):
            left = self._kept(self._changed(left, self.tangent, mode.order) / mode.rate, mine)
            sizes.append(float(np.linalg.norm(left)))
        size = sizes[-1]
        return float(np.linalg.norm(mode.vector)) / size if size > DOUBLED * np.linalg.norm(term) else np.inf

    # --- errors --------------------------------------------------------------------------------------------------

    def _errors(self) -> tuple[Array, Array]:
        """Return errors of the values at the first point and of the tangent: of the mesh, and of round-off."""
        system, x, at = self.system, self.x, self.place
        row = system.weights * self.linear.tangent
        error = UNITS * system.largest(rounded_off(system, x, (row,)))

        def again(number: int) -> Array:
            _, factors, longer = self._beside(number)
            other: Array = factors.solve(longer * unit)
            return other / (other[at] or 1.0)

        unit = np.append(np.zeros(system.size - 1), 1.0)
        error_of_tangent = self._error(self.tangent, again)
        finer = None if system.refined() is None else on_finer_mesh(Trial(system, x, self.linear), self._newton)
        if finer is not None:
            on: Any = finer.system
            primary = on.parameter_index(system.free[at - system.state_size])
            carry, rate = system.carrier(on), finer.tangent[primary] or 1.0
            error = np.maximum(error, 2 * on.largest(finer.x - carry(x)))
            turned = finer.tangent / rate - carry(self.tangent)
            error_of_tangent = np.maximum(error_of_tangent, 2 * on.largest(turned))
        for move in system.cut_off_errors(x, self._factors):
            turned = system.linearize(x + move, (self.row,))[1].solve(unit)
            turned /= turned[at] or 1.0
            error = np.fmax(error, system.largest(move))
            error_of_tangent = np.fmax(error_of_tangent, system.largest(turned - self.tangent))
        return error, error_of_tangent

    def _kept(self, v: Array, kept: Pattern | Array) -> Array:
        """Return a vector with zeros in all states and parameters that are not kept."""
        return v * kept[self._names]


def _has_settled(numbers: Sequence[float]) -> bool:
    """Return whether the last numbers of an iteration differ by less than a size needs: from one, and from two before.

    Of two eigenvalues of opposite sign the numbers alternate.
    """
    if len(numbers) < _FEWEST:
        return False
    one, other = numbers[-1] * numbers[-2], numbers[-3] * numbers[-4]
    return abs(one - other) < ROUGH * one


def _reach(terms: Sequence[Array]) -> float:
    """Return the factor with which a term of higher order is as large as the linear one, in a state that has both."""
    found = [np.inf]
    for power, term in enumerate(terms[1:], 1):
        both = (terms[0] > 0) & (term > 0)
        if both.any():
            found.append(float(np.min(terms[0][both] / term[both]) ** (1 / power)))
    return min(found)


def _held(reach: float, direction: Array, known: Array) -> float:
    """Return a factor, made smaller where it changes a known state by more than its size."""
    natural = np.where(direction > 0, direction * reach, 0.0) if np.isfinite(reach) else np.zeros_like(direction)
    moved = (direction > 0) & (known > 0) & _counts(known, natural)
    return float(min([reach, *(known[moved] / direction[moved])]))


def _bent(terms: Sequence[Array], known: Array) -> float:
    """Return the smallest change of an expansion's variable at which a term of higher order is as large as a known state."""
    found = [np.inf]
    for power, term in enumerate(terms[1:], 2):
        moved = (term > 0) & (known > 0)
        found += list((known[moved] / term[moved]) ** (1 / power))
    return float(min(found))


def _sizes(terms: Sequence[Array], change: float) -> Array:
    """Return the largest term of an expansion, by state, at a change of its variable."""
    return np.max([term * change**power for power, term in enumerate(terms, 1)], axis=0)


def _balanced(terms: Sequence[Array], sizes: Array) -> float:
    """Return the change at which the terms of an expansion are as near to known sizes, or else to one, as they can be."""
    pairs = [(power, np.log(term[i] / (sizes[i] or 1.0)), sizes[i]) for power, term in enumerate(terms, 1)
             for i in np.flatnonzero(term)]  # fmt: skip
    powers, gaps, _ = np.array([pair for pair in pairs if pair[2]] or pairs).T
    return float(np.exp(-(powers @ gaps) / (powers @ powers)))


def _larger(sizes: Array, others: Array, where: Pattern, error: Array) -> Array:
    """Return sizes, the larger ones of both in some places, where they are more than errors."""
    return np.where(where & (others > error), np.maximum(sizes, others), sizes)


def _counts(values: Array, natural: Array) -> Pattern:
    """Return which values are more than nothing, compared with the sizes that the expansion gives."""
    return (values >= USUAL[0]) | (values > DOUBLED * natural)


def renewed(system: Any, x: Array) -> tuple[Discretization, Carrier]:
    """Return the system with the sizes that values have where a branch begins, and the carrier: smaller ones are past.

    A trivial branch that begins at a small load leaves its size to the branches that turn off at loads of order one.
    """
    if system.on_curve or system.scales.are_one:
        return system, np.array
    names, count, scales = list(system.problem.parameters), len(system.problem.states), system.scales
    largest = system.largest(x)
    sizes = np.concatenate([scales.states, system.free_scales])
    sizes = np.where(largest > 1, np.maximum(sizes, usual(largest * sizes)), sizes)
    parameters = scales.parameters.copy()
    parameters[[names.index(name) for name in system.free]] = sizes[count:]
    other, _ = system.with_scales(x, sizes[:count], parameters)
    return (system, np.array) if other is system else (other, system.carrier(other))


def outgrown(
    system: Any, x: Array, adapted: tuple[Discretization, Carrier] | None = None
) -> tuple[Discretization, Carrier] | None:
    """Return the system, or one adapted to x, with larger sizes where unknowns have outgrown theirs, and the carrier.

    What was adapted, which may be nothing, where there is no need.
    """
    if system.on_curve or not np.abs(x).max() > USUAL[1]:
        return adapted  # most steps
    names, count = list(system.problem.parameters), len(system.problem.states)
    states, parameters = system.scales.states, system.scales.parameters.copy()
    found = usual(system.largest(x))
    size, size_of_free = found[:count], found[count:]
    if max(size.max(), size_of_free.max(initial=0.0)) <= 1:
        return adapted
    parameters[[names.index(name) for name in system.free]] *= np.maximum(1.0, size_of_free)
    base: Any
    base, carry = adapted or (system, np.array)
    other, _ = base.with_scales(carry(x), states * np.maximum(1.0, size), parameters)
    if other is base:
        return adapted
    rescale = base.carrier(other)
    return other, lambda v: rescale(carry(v))
