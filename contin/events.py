"""Monitors: named functions of a point that make events; and locating where they vanish."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from contin.errors import ConvergenceError


@dataclass(frozen=True)
class Monitor:
    """A function of a trial point whose sign changes are events.

    Attributes
    ----------
    label : str
        AUTO's two letters for the event.
    name : str
        What the event is about.
    function : callable
        ``function(trial) -> float``; a :class:`Trial` looks up parameters and functionals by name.
    terminal : bool
        Whether the run stops there.
    """

    label: str
    name: str
    function: Callable[[Trial], float]
    terminal: bool = False


class Trial:
    """A corrected point as monitors see it: ``trial["mu"]``, ``trial.tangent``, ``trial.sign`` (of the determinant)."""

    def __init__(self, system, x, tangent, sign, iterations=0, newton_error=0.0):
        self.system, self.x, self.tangent, self.sign = system, x, tangent, sign
        self.iterations, self.newton_error = iterations, newton_error
        self._functionals = None

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


def limit(name: str, value: float) -> Monitor:
    """The end of a run where a parameter or functional reaches a value."""
    return Monitor("EP", f"{name} = {value:g}", lambda trial: trial[name] - value, terminal=True)


def fold(name: str) -> Monitor:
    """The event that a free parameter turns round (AUTO's limit point)."""
    return Monitor("LP", name, lambda trial: trial.tangent[trial.system.parameter_index(name)])


def find_zero(function: Callable[[float], float], a, fa, b, fb, tolerance) -> float:
    """A zero of ``function`` between a and b, where its values fa and fb differ in sign.

    The secant method, kept inside the bracket by the Anderson-Björck rule; ends when the step is below ``tolerance``.

    Raises
    ------
    ConvergenceError
        If 60 evaluations do not do (a jump, not a zero).
    """
    if fb == 0:
        return b
    last = b
    for _ in range(60):
        c = b - fb * (b - a) / (fb - fa)
        if not min(a, b) < c < max(a, b):
            c = (a + b) / 2
        fc = function(c)
        if fc == 0 or abs(c - last) <= tolerance:
            return c
        last = c
        if fc * fb < 0:
            a, fa = b, fb
        else:
            shrink = 1 - fc / fb
            fa *= shrink if shrink > 0 else 0.5
        b, fb = c, fc
    raise ConvergenceError(f"no zero between the two ends (last value {fc:.1e})")


def sign_changed(before: float, after: float) -> bool:
    """Whether a monitor's value passed zero; a point exactly on zero counts with the step that leaves it not."""
    return bool(np.isfinite(before) and np.isfinite(after) and before != 0 and before * after <= 0)
