"""Special points on curves of folds of equilibria."""

from __future__ import annotations

from typing import Any

import numpy as np

from contin.core.labels import Label
from contin.core.trial import Event, Trial
from contin.defining.critical_curve import other_pairs

#: The kind of curves of homoclinic orbits, which leave from the first.
HOMOCLINIC = "homoclinic"


def events_on_folds() -> list[Event]:
    """Return those of a second eigenvalue zero (Bogdanov-Takens), and of a pair on the imaginary axis (zero-Hopf)."""

    def double_zero(trial: Trial) -> float:
        system: Any = trial.system
        v, w = system.null_vectors(trial.x)
        base, scales = system.base, system.base.scales
        v, w = v[: base.state_size] * scales.states, w / scales.rows["residual"]
        return float(w @ v) / float(np.linalg.norm(v) * np.linalg.norm(w))

    def others(trial: Trial) -> tuple[float, bool]:
        system: Any = trial.system
        values = system.base.eigenvalues(trial.x)
        return other_pairs(np.delete(values, np.argmin(np.abs(values))))

    return [
        Event(Label.BOGDANOV_TAKENS, "Bogdanov-Takens", double_zero),
        Event(Label.ZERO_HOPF, "zero-Hopf", lambda trial: others(trial)[0], confirm=lambda trial: others(trial)[1]),
    ]
