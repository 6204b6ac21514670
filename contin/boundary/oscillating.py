"""Time-periodic states of fields, as boundary value problems: the states at equidistant times of one period stand side by side.

Between M times, M odd, a state is the trigonometric polynomial through its values, so that its rate at the time j is a sum
over all times, w_j = (2 pi / period) sum_l D_jl u_l, with D_jl = (-1)^(j - l) / (2 sin(pi (j - l) / M)):

    u_j' = rhs(t, u_j, p) + f(t, u_j, w_j, p),      boundary(a_j, b_j, p) = 0      for j = 0 ... M - 1,
    the integral over t of sum_j Re(i v exp(2 pi i j / M)) . u_j is zero:  the phase, v the critical vector of the Hopf point

The error of the M times falls exponentially with M. No estimate contains it: more times show it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from contin.arrays import Array, ComplexArray, Function, Named
from contin.boundary.statement import BoundaryValueProblem
from contin.errors import ProblemError
from contin.functions.signature import Signature, argument_count, named_values
from contin.problems.rewriting import combined, returning
from contin.problems.statement import PERIOD

#: Times of one period: five harmonics. The period of an oscillation of the Brusselator, 4 % beyond its Hopf point, has an error
#: of 1e-4 then, of 1e-2 with 7 times and of 1e-5 with 15; the time grows as the square to the cube of their number.
TIMES = 11


@dataclass(frozen=True, eq=False, repr=False)
class OscillatingField(BoundaryValueProblem):
    """The time-periodic states of ``field`` at a number of ``times``.

    Its states are those of the field at one time after the other, ``x_0``, ``y_0``, ``x_1``, ...; its parameters those of the
    field and ``period``. Columns are the means in time of the field's functionals, and ``swing_x``: the integral over the
    domain of the mean square in time of x less its mean, for each state whose rate occurs.
    """

    field: BoundaryValueProblem | None = None
    times: int = TIMES


def oscillating(field: BoundaryValueProblem, phase: Mapping[int, tuple[Any, Any]], times: int = TIMES) -> OscillatingField:
    """Return the problem of the time-periodic states of a field.

    Raises ProblemError where the field has integral conditions, or boundary conditions that fill an array.

    - ``field`` (BoundaryValueProblem): With ``rates``.
    - ``phase`` (mapping of int to (callable, callable)): The real and imaginary part of the critical vector over the domain, of
      each state whose rate occurs.
    - ``times`` (int): Odd.
    """
    if field.integrals is not None or argument_count(field.boundary) != 3:
        raise ProblemError(
            "start: time-periodic states are followed of fields without integral conditions whose boundary conditions are "
            "returned; state the values at nodes as an AlgebraicProblem: its Hopf points start cycles"
        )
    names, own = field.state_names, tuple(field.parameters)
    state, values, count = named_values(names), named_values(own), len(names)
    rhs_of, rates = returning(field.rhs, Signature(names, own, times=True)), dict(field.rates)
    places = {name: names.index(name) for name in rates}
    slopes = _differentiation(times).tolist()
    number, boundary_of = len(own), field.boundary

    def at(u: Named, j: int) -> Any:
        return state(*list(u)[j * count : (j + 1) * count])

    def rhs(t: float, u: Named, p: Named) -> Any:
        known, factor = values(*list(p)[:number]), 2 * math.pi / p.period
        states, found = [at(u, j) for j in range(times)], []
        moved = [combined(slopes, [each[k] for each in states]) for k in range(count)]
        for j in range(times):
            slope = list(rhs_of(t, states[j], known))
            w = state(*[factor * moved[k][j] for k in range(count)])
            for name, function in rates.items():
                slope[places[name]] = slope[places[name]] + function(t, states[j], w, known)
            found += slope
        return found

    def boundary(a: Named, b: Named, p: Named) -> Any:
        known = values(*list(p)[:number])
        return [each for j in range(times) for each in boundary_of(at(a, j), at(b, j), known)]

    stated = [f"{name}_{j}" for j in range(times) for name in names]
    return OscillatingField(
        rhs, boundary, stated, {**field.parameters, PERIOD: 1.0}, _phase_condition(phase, count, times), field.domain,
        _columns(field, list(phase), times), field=field, times=times,
    )  # fmt: skip


def _phase_condition(phase: Mapping[int, tuple[Any, Any]], count: int, times: int) -> Function:
    waves = [(math.cos(2 * math.pi * j / times), math.sin(2 * math.pi * j / times)) for j in range(times)]

    def integrals(t: float, u: Named, p: Named) -> Any:
        total = 0.0
        for k, (real, imaginary) in phase.items():
            through = [list(u)[j * count + k] for j in range(times)]
            cosine, sine = combined([[wave[part] for wave in waves] for part in (0, 1)], through)
            total = total - real(t) * sine - imaginary(t) * cosine
        return (total,)

    return integrals


def _columns(field: BoundaryValueProblem, moving: Sequence[int], times: int) -> dict[str, Function]:
    """Return the functionals of an `OscillatingField`."""
    names, own = field.state_names, tuple(field.parameters)
    state, values, count, number = named_values(names), named_values(own), len(names), len(own)

    def mean_of(function: Function) -> Function:
        def functional(t: float, u: Named, p: Named) -> Any:
            known = values(*list(p)[:number])
            return sum(function(t, state(*list(u)[j * count : (j + 1) * count]), known) for j in range(times)) / times

        return functional

    def swing_of(k: int) -> Function:
        def functional(t: float, u: Named, p: Named) -> Any:
            through = [list(u)[j * count + k] for j in range(times)]
            mean = sum(through) / times
            return sum((each - mean) * (each - mean) for each in through) / times

        return functional

    found = {name: mean_of(function) for name, function in field.functionals.items()}
    return found | {f"swing_{names[k]}": swing_of(k) for k in moving}


def _differentiation(times: int) -> Array:
    """Return the matrix of the derivative of the trigonometric polynomial through values at equidistant places of 2 pi."""
    apart = np.subtract.outer(np.arange(times), np.arange(times))
    with np.errstate(divide="ignore", invalid="ignore"):
        found = (-1.0) ** apart / (2 * np.sin(np.pi * apart / times))
    return np.where(apart == 0, 0.0, found)


def turned(vector: ComplexArray, times: int) -> Array:
    """Return Re(v exp(2 pi i j / M)) for j = 0 ... M - 1, side by side: shape (K, M n) for v of shape (K, n)."""
    wave = np.exp(2j * np.pi * np.arange(times) / times)
    return (vector[:, None, :] * wave[:, None]).real.reshape(len(vector), -1)
