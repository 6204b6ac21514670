"""Where the law of an open strip ends, so that a run ends there and says why."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from types import SimpleNamespace

import numpy as np

from contin import Collocation, TestFunction, Trial
from ribbon_model.equilibrium import moment_on_directors
from ribbon_model.laws import FINITE_WIDTH, RIBBON
from ribbon_model.material import Material

Strains = Callable[[Collocation, np.ndarray], np.ndarray]

#: Why a run ends where its law does.
_REASONS = {
    RIBBON.name: "the end of the law 'ribbon', which has no value where the bending vanishes (omega_1 -> 0); the law "
    "'finite width' goes on",
    FINITE_WIDTH.name: "the end of the law 'finite width', whose energy is not convex at larger twist; the law 'flat rod' "
    "goes on",
}
#: A run that fails with a smaller margin of its law has met the end of it. The margin falls like a square root there.
_NEARLY_ENDED = 0.1
#: The margin is relative to the largest moment, or to this where there is none.
_LEAST = 1e-9


def tests(material: Material, strains: Strains) -> list[TestFunction]:
    """Return the test function that ends a run where the law ends; none for a law that is regular everywhere.

    Parameters
    ----------
    material : Material
    strains : callable
        The strains (K, 3) at the nodes, from a discretized problem and its unknowns.
    """
    law = material.of_paper
    if law is None or law.name not in _REASONS:
        return []
    margin = {
        RIBBON.name: functools.partial(_ribbon_margin, material),
        FINITE_WIDTH.name: functools.partial(_convexity, material, strains),
    }[law.name]
    return [TestFunction("EP", _REASONS[law.name], margin, terminal=True)]


def explained(material: Material, strains: Strains, run) -> str:
    """Return why a run failed: the end of the law where its state is near it, else the run's own reason."""
    for test in tests(material, strains):
        state = run.state
        if test.function(Trial.without_tangent(state.system, state.x)) < _NEARLY_ENDED:
            return test.name
    return str(run.stop)


def _ribbon_margin(material: Material, trial: Trial) -> float:
    """Return the least M1 + (1 + nu) kappa_n at the nodes, over the largest: the law holds where it is positive.

    For an orthotropic plate see `Material.other_side`.

    With p and a of `ribbon_hamiltonian`, the two roots a belong to omega_1 of either sign, and their H differ by
    sqrt(p**2 + M3**2) (p + 2 nu kappa_n)/2. Where that is negative, bending to the other side lowers the energy at this
    moment: strips with an inflection of this kind need the width.
    """
    system, x = trial.system, trial.x
    states, p = system.states(x), _numbers(trial)
    natural, n = material.datum("kappa_n"), states.shape[1] // 2
    kappa_n = np.array([natural(t, p) for t in system.nodes])
    moments = moment_on_directors(states.T[:4], states.T[n : n + 4])[0]
    values = moments + material.other_side(p) * kappa_n
    return float(values.min() / max(abs(values).max(), _LEAST))


def _convexity(material: Material, strains: Strains, trial: Trial) -> float:
    """Return the least det D2U/(U_11 U_33) at the nodes and halfway between: positive where U is convex."""
    system, x = trial.system, trial.x
    p, omega = _numbers(trial), strains(system, x)
    if not np.all(np.isfinite(omega)):
        return -1.0
    places = np.concatenate([omega, (omega[1:] + omega[:-1]) / 2])
    t = np.concatenate([system.nodes, (system.nodes[1:] + system.nodes[:-1]) / 2])
    U11, U13, U33 = material.curvatures(t, places, p)
    return float(np.where((U11 > 0) & (U33 > 0), (U11 * U33 - U13**2) / (U11 * U33), -1.0).min())


def _numbers(trial: Trial) -> SimpleNamespace:
    return SimpleNamespace(**dict(zip(trial.system.problem.parameters, trial.system.all_parameters(trial.x))))
