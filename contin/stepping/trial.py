"""A corrected point, and test functions of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from contin.arrays import Array
from contin.discretization.protocol import Discretization
from contin.linalg.factors import Factors


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


def sign_changed(before: float, after: float) -> bool:
    """Whether a monitor's value passed zero; a point exactly on zero counts with the step that leaves it not."""
    return bool(np.isfinite(before) and np.isfinite(after) and before != 0 and before * after <= 0)
