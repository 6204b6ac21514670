"""Sizes of states and parameters, taken from the first point of a run.

The size of a parameter is that of its first value; where that is zero, of its smallest limit or labelled value. The size of a
state is its largest value. For what is zero at the first point the tangent says whether it is small: a parameter, by the change
that moves some state by its size; a state, by its response to such a change. States that do not respond get sizes from the
derivatives of the functions, with which the terms of an equation are alike. A parameter that is zero there and stands for a
state (the coordinates of equilibria, of connecting orbits) has the size of that state. Only sizes far from one count
(`contin.discretization.scales`).
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from contin.arrays import Array
from contin.discretization.protocol import Carrier, Discretization
from contin.discretization.scales import usual
from contin.discretization.system import System
from contin.stepping.settings import Settings
from contin.stepping.trial import Linearization

#: A value counts as zero below so many times its own round-off: the last update that Newton's method would make. At 10
#: round-off of a state that vanishes by symmetry could become its size.
_NOISE = 1e4
#: A first value smaller than this part of the limits is zero.
_NOTHING = 1e-10
#: A state smaller than this part of the largest may vanish but for the error of the discretization: its size counts as one.
_FAINT = 1e-6
#: A term that the balance leaves smaller than this, relative to the others, is what cancellation has left of zero: the balance
#: is made again without it, in so many passes.
_CANCELLED, _PASSES = 1e-5, 3
#: A derivative smaller than this part of the largest of its row is a product of round-off, where states vanish: sizes of 1e180
#: came from such. Units differ by less.
_NEGLIGIBLE = 1e-60
#: States without any known size are looked for within so many powers of ten around one.
_DECADES = 12
#: A parameter that is zero and changes less than this while states change by their size stands still: that is round-off. Ten
#: times larger, a parameter of that unit that begins at zero must have its size stated.
_STILL = 1e-12
#: A smaller value counts as zero in any case: the size of such a state or parameter must be stated.
_TINY = 1e-14


def scaled(
    system: Discretization, x: Array, linear: Linearization, primary: str, settings: Settings
) -> tuple[Discretization, Array]:
    """Return the system with sizes of states and parameters taken from a first point, and x for it.

    Unchanged where it has sizes already, or where all are of order one.
    """
    if not isinstance(system, System) or system.scales is not None:
        return system, x
    names, states, count = list(system.problem.parameters), system.problem.states, len(system.problem.states)
    known = {name: abs(value) for name, value in settings.scales.items()}
    factors: Any = linear.factors
    update = _NOISE * np.abs(factors.solve(np.append(system.residual(x), 0.0))) + _TINY
    noise, noise_of_free = update[: system.state_size].reshape(-1, count).max(axis=0), update[system.state_size :]
    size = np.abs(system.states(x)).max(axis=0)
    size = np.where(size > noise, size, 0.0)
    values = np.where(np.abs(x[system.state_size :]) > noise_of_free, x[system.state_size :], 0.0)
    given = zip(system.free, values)
    free = np.array([known.get(name) or _given(float(value), name, settings) for name, value in given])
    # what is zero at the first point: by the tangent
    at, rate = system.free.index(primary), np.abs(linear.tangent)
    rates, rate_of_free = rate[: system.state_size].reshape(-1, count).max(axis=0), rate[system.state_size :]
    if not free[at]:
        moves = rates > 0
        stated = np.array([known.get(name, found) for name, found in zip(states, size)])
        needed = usual(np.where(stated > 0, stated, 1.0))[moves] * rate_of_free[at] / rates[moves]
        least = needed.min(initial=1.0)
        free[at] = min(1.0, least) if least > _STILL else 1.0
    change = usual(free[at]) / rate_of_free[at] if rate_of_free[at] else 0.0
    response = np.minimum(1.0, rates * change)
    size = np.maximum(size, np.where(response > noise, response, 0.0))
    alike = getattr(system.problem, "alike", {})
    free = np.array([found or size[states.index(alike[name])] if name in alike else found
                     for name, found in zip(system.free, free)])  # fmt: skip
    size, free = _with_faint(system, x, size, free)
    size = np.array([known.get(name, found) for name, found in zip(states, size)])
    parameters = np.array([known.get(name, value) for name, value in zip(names, system.parameters)])
    parameters[[names.index(name) for name in system.free]] = np.where(free > 0, free, 1.0)
    sizes = usual(size), usual(parameters)
    if all(np.all(found == 1) for found in sizes):
        return system, x
    return system.with_scales(x, *sizes)


def _with_faint(system: System, x: Array, size: Array, free: Array) -> tuple[Array, Array]:
    """Return sizes of the states and free parameters, those of vanishing ones found from the others by the derivatives.

    ``size`` (n,) and ``free`` (number of free parameters,) are 0 where nothing is known.
    """
    faint = size <= _FAINT * size.max()
    if not faint.any() and free.all():
        return size, free
    states, values = x[: system.state_size].reshape(-1, len(size)) * ~faint, x[system.state_size :]
    known = np.concatenate([np.where(faint, 0.0, size), free])
    at_rest = not np.any(known[: len(size)])
    if at_rest:
        values = np.where(values == 0, free, values)  # a load that enters as its square shows nothing where it is zero
    z = np.concatenate([states.ravel(), values])
    found = _balanced(system, z, known)
    balanced = found[: len(size)]
    if at_rest:
        balanced = balanced * _amplitude(system, z, found)
    return np.where(faint & (size <= _FAINT * balanced), balanced, size), found[len(size) :]


def _balanced(system: System, x: Array, sizes: Array) -> Array:
    """Return sizes of states and free parameters with which the terms of every linearized equation are alike.

    Alike in the mean of logarithms. Unknowns of the least squares are the logarithms of the sizes that are 0, and of those of
    the equations that are no rates of states. Of unknowns that are coupled to nothing known only the ratios are determined:
    their sizes are as near to one as they can be.
    """
    entries, owners = system.couplings(x)
    unknown = np.flatnonzero(sizes == 0)
    place = {int(j): i for i, j in enumerate(unknown)}
    rows, values = [], []
    for i, (row, owner) in enumerate(zip(entries, owners)):
        least = _NEGLIGIBLE * row[np.isfinite(row)].max(initial=0.0)
        for j in np.flatnonzero((row > least) & np.isfinite(row)):
            term, value = np.zeros(len(unknown) + len(entries)), -np.log(row[j])
            for sign, which in ((1.0, int(j)), (-1.0, int(owner))):
                if which < 0:
                    term[len(unknown) + i] = sign
                elif which in place:
                    term[place[which]] += sign
                else:
                    value -= sign * np.log(sizes[which])
            rows.append(term)
            values.append(value)
    found = sizes.copy()
    matrix, wanted = np.array(rows), np.array(values)
    for _ in range(_PASSES if rows else 0):
        logarithms = np.linalg.lstsq(matrix, wanted)[0]
        kept = matrix @ logarithms - wanted > np.log(_CANCELLED)
        matrix, wanted = matrix[kept], wanted[kept]
        found[unknown] = np.exp(logarithms[: len(unknown)])
    return np.where(found > 0, found, 1.0)


def _amplitude(system: System, x: Array, sizes: Array) -> float:
    """Return the power of ten by which states of these sizes must be multiplied to change the derivatives by about themselves.

    One where the functions are linear. ``sizes`` are those of states and free parameters.
    """
    entries = system.couplings(x)[0]
    if not entries.size:  # large sparse problems have none
        return 1.0
    count, entries = len(sizes) - len(system.free), entries * sizes
    largest = entries.max(axis=1)
    powers = 10.0 ** np.arange(-_DECADES, _DECADES + 1)
    for factor in powers:
        states = x[: system.state_size].reshape(-1, count) + factor * sizes[:count]
        with np.errstate(all="ignore"):
            there = system.couplings(np.concatenate([states.ravel(), x[system.state_size :]]))[0] * sizes
            change = np.abs(there - entries).max(axis=1)
        if not np.all(change[largest > 0] <= largest[largest > 0]):
            return float(factor)
    return 1.0


def outgrown(system: Discretization, x: Array) -> tuple[Discretization, Carrier] | None:
    """Return the system with larger sizes where unknowns have outgrown theirs, and the carrier; None where there is no need."""
    if not isinstance(system, System):
        return None
    names, count = list(system.problem.parameters), len(system.problem.states)
    states, parameters = np.ones(count), np.ones(len(names))
    if system.scales is not None:
        states, parameters = system.scales.states, system.scales.parameters.copy()
    size = usual(np.abs(x[: system.state_size]).reshape(-1, count).max(axis=0, initial=0.0))
    size_of_free = usual(x[system.state_size :])
    if max(size.max(), size_of_free.max(initial=0.0)) <= 1:
        return None
    parameters[[names.index(name) for name in system.free]] *= np.maximum(1.0, size_of_free)
    other, _ = system.with_scales(x, states * np.maximum(1.0, size), parameters)
    return None if other is system else (other, system.carrier(other))


def _given(value: float, name: str, settings: Settings) -> float:
    """Return the size of a parameter from what is said of it; 0 where nothing is."""
    said: Iterable[float] = (*settings.limits.get(name, ()), *settings.zeros.get(name, ()))
    smallest = min((abs(float(number)) for number in said if number and np.isfinite(number)), default=0.0)
    return abs(value) if abs(value) > _NOTHING * smallest else smallest
