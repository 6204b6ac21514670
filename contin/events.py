"""Monitors: named functions of a point that make events; and locating where they vanish."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from contin.errors import ConvergenceError
from contin.interface import Array, ComplexArray, Discretization, Factors, Indices


@dataclass(frozen=True, eq=False)
class Monitor:
    """A function of a trial point whose sign changes are events.

    Attributes
    ----------
    label : str
        AUTO's two letters for the event.
    name : str
        What the event is about.
    function : callable
        ``function(trial) -> float``; a `Trial` looks up parameters and functionals by name.
    terminal : bool
        Whether the run stops there.
    confirm : callable, optional
        ``confirm(trial) -> bool`` at the located point: False drops the event (a sign change of another cause).
    describe : callable, optional
        ``describe(trial)`` at the located point gives the ``details`` of the event.
    limit : bool
        Whether the run must not go where the function is positive: a start on the limit, too, is left inwards only.
    several : callable, optional
        ``several(before, after) -> bool`` of two neighbouring trials: whether more than one event must lie between them. Such
        steps are cut, and the function's sign is also looked at inside every step.
    """

    label: str
    name: str
    function: Callable[[Trial], float]
    terminal: bool = False
    confirm: Callable[[Trial], bool] | None = None
    describe: Callable[[Trial], object] | None = None
    limit: bool = False
    several: Callable[[Trial, Trial], bool] | None = None

    def passed(self, before: float, after: float) -> bool:
        """Whether there is an event between two neighbouring points where the function has these values."""
        return after >= 0 if self.limit else sign_changed(before, after)


class Trial:
    """A corrected point as monitors see it: ``trial["mu"]``, ``trial.tangent``, ``trial.sign`` (of the determinant).

    ``factors`` is the factorization that the tangent came from, ``exact`` says that it was taken right at x and not at the
    iterate before; ``passed`` is the number of branch points since the last point, ``crossing`` the one that was located on
    the way here.
    """

    def __init__(
        self,
        system: Discretization,
        x: Array,
        tangent: Array,
        sign: float,
        iterations: int = 0,
        newton_error: float = 0.0,
        factors: Factors | None = None,
        exact: bool = False,
    ) -> None:
        self.factors: Any = factors
        self.exact, self.passed = exact, 0
        self.crossing: Any = None
        self.system, self.x, self.tangent, self.sign = system, x, tangent, sign
        self.iterations, self.newton_error = iterations, newton_error
        self._functionals: dict[str, float] | None = None
        self._values: dict[Monitor, float] = {}

    def value(self, monitor: Monitor) -> float:
        """The monitor's value here, computed once: a point that two steps share has one value for both."""
        if monitor not in self._values:
            self._values[monitor] = float(monitor.function(self))
        return self._values[monitor]

    @property
    def functionals(self) -> dict[str, float]:
        """The problem's functionals, computed when first asked."""
        if self._functionals is None:
            values = self.system.functionals(self.x)
            self._functionals = dict(zip(self.system.problem.functionals, map(float, values)))
        return self._functionals

    def __getitem__(self, name: str) -> float:
        if name in self.system.free:
            return float(self.x[self.system.parameter_index(name)])
        if name in self.system.problem.functionals:
            return self.functionals[name]
        return self.system.parameter(self.x, name)


def user_zero(name: str, value: float) -> Monitor:
    """The event that a parameter or functional takes a value."""
    return Monitor("UZ", f"{name} = {value:g}", lambda trial: trial[name] - value)


def limit(name: str, value: float, side: int) -> Monitor:
    """The end of a run where a parameter or functional rises (``side`` +1) or falls (-1) to a value."""
    return Monitor("EP", f"{name} = {value:g}", lambda trial: side * (trial[name] - value), terminal=True, limit=True)


def fold(name: str) -> Monitor:
    """The event that a free parameter turns round (AUTO's limit point)."""
    return Monitor("LP", name, lambda trial: trial.tangent[trial.system.parameter_index(name)])


def hopf() -> Monitor:
    """The event that a pair of complex eigenvalues of F_u crosses the imaginary axis (AUTO's HB), for u' = F.

    The product of all sums of two eigenvalues changes sign there, and where two real ones are opposite (a neutral saddle, which
    is not confirmed). The number of unstable eigenvalues tells more than a sign: a pair changes it by two, a real eigenvalue
    that passes zero by one. Details are the frequency of the pair.
    """

    def sums(trial: Trial) -> tuple[ComplexArray, ComplexArray, Indices]:
        system: Any = trial.system  # one with eigenvalues
        values = system.eigenvalues(trial.x)
        i, j = np.triu_indices(len(values), 1)
        return values, values[i] + values[j], i

    def function(trial: Trial) -> float:
        values, pairs, _ = sums(trial)
        if not pairs.size:
            return 1.0
        negative = np.count_nonzero((pairs.imag == 0) & (pairs.real < 0))
        return float((-1.0) ** negative * np.abs(pairs).min())

    def frequency(trial: Trial) -> float:
        values, pairs, i = sums(trial)
        return float(abs(values[i[np.argmin(np.abs(pairs))]].imag))

    def complex_pair(trial: Trial) -> bool:
        return frequency(trial) > 1e-8

    def unstable(trial: Trial) -> int:
        return int(np.count_nonzero(sums(trial)[0].real > 0))

    def several(before: Trial, after: Trial) -> bool:
        change = abs(unstable(after) - unstable(before))
        return change > 3 or (change > 1 and function(before) * function(after) > 0)

    def describe(trial: Trial) -> dict[str, float]:
        return {"frequency": frequency(trial)}

    return Monitor("HB", "Hopf", function, confirm=complex_pair, describe=describe, several=several)


#: Steps up to so many tolerances may be round-off.
_IDLE = 1e3


def find_zero(
    function: Callable[[float], float], a: float, fa: float, b: float, fb: float, tolerance: float, guess: float | None = None
) -> float:
    """A zero of ``function`` between a and b, where its values fa and fb differ in sign; a place where it was evaluated.

    Inverse quadratic interpolation through the last three places, the secant method with the Anderson-Björck rule where that
    leaves the bracket or the ``guess`` is missing. Ends when the next step would be below ``tolerance``, or when close to that
    the values no longer fall: they are round-off.

    Raises
    ------
    ConvergenceError
        If 60 evaluations do not do (a jump, not a zero).
    """
    if fb == 0:
        return b
    known = [(a, fa), (b, fb)]
    best, idle, c = (np.inf, b), 0, guess
    for _ in range(60):
        if c is None or not min(a, b) < c < max(a, b):
            c = b - fb * (b - a) / (fb - fa)
            if not min(a, b) < c < max(a, b):
                c = (a + b) / 2
        fc = function(c)
        if fc == 0:
            return c
        if fc * fb < 0:
            a, fa = b, fb
        else:
            shrink = 1 - fc / fb
            fa *= shrink if shrink > 0 else 0.5
        b, fb = c, fc
        known = [*known[-2:], (c, fc)]
        following = _interpolated(known)
        if following is None:
            following = b - fb * (b - a) / (fb - fa)
        move = abs(following - c)
        if move <= tolerance:
            return c
        idle = idle + 1 if move < _IDLE * tolerance and abs(fc) > best[0] / 2 else 0
        best = min(best, (abs(fc), c))
        if idle == 2:
            return best[1]
        c = following
    raise ConvergenceError(f"no zero between the two ends (last value {fc:.1e})")


def _interpolated(known: list[tuple[float, float]]) -> float | None:
    """Where the parabola through three places, as a function of the value, has value zero; None where there is none."""
    (x, fx), (y, fy), (z, fz) = known
    if fx == fy or fy == fz or fz == fx:
        return None
    return x * fy * fz / ((fx - fy) * (fx - fz)) + y * fx * fz / ((fy - fx) * (fy - fz)) + z * fx * fy / ((fz - fx) * (fz - fy))


def sign_changed(before: float, after: float) -> bool:
    """Whether a monitor's value passed zero; a point exactly on zero counts with the step that leaves it not."""
    return bool(np.isfinite(before) and np.isfinite(after) and before != 0 and before * after <= 0)
