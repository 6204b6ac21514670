"""Where the law of an open strip ends, so that a run ends there and says why."""

from __future__ import annotations

import functools
from collections.abc import Callable
from types import SimpleNamespace

import numpy as np

from contin import Event
from contin.lowlevel import Collocation, Continuation, Trial
from ribbon_model.equilibrium import moment_on_directors, strains_of
from ribbon_model.laws import FINITE_WIDTH, RIBBON
from ribbon_model.material import Material

Strains = Callable[[Collocation, np.ndarray], np.ndarray]

#: Why a run ends where its law does.
_REASONS = {
    RIBBON.name: "which has no value where the bending or the twisting modulus vanishes; the law 'finite width' goes on",
    FINITE_WIDTH.name: "whose energy is not convex at larger twist; the law 'flat rod' goes on",
}
#: A run that fails with a smaller margin of its law has met the end of it. The margin falls like a square root there.
_NEARLY_ENDED = 0.1
#: The margin is relative to the largest moment, or to this where there is none.
_LEAST = 1e-9
#: Rounds in which the least margin of a ribbon is sought between nodes. Each divides the distance of places by 8, so the error
#: of a smooth minimum falls by 64: from h**2 at the nodes to h**2/2.6e5. One less: 64 times that.
_ROUNDS = 3
#: Places of a round, from one neighbour of the lowest place to the other.
_PLACES = 17


def tests(material: Material, strains: Strains) -> list[Event]:
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
    return [Event("EP", f"the end of the law {law.name!r}", margin, terminal=True)]


def explained(material: Material, strains: Strains, run: Continuation) -> str | None:
    """Return that a run met the end of the law, or failed near it, in a sentence; None for a run that stopped elsewhere."""
    for test in tests(material, strains):
        state, met = run.state, run.stop is not None and run.stop.event == test.name
        if met or test.function(Trial.without_tangent(state.system, state.x)) < _NEARLY_ENDED:
            return f"{test.name}, {_REASONS[material.law]}"
    return None


def at_guess(material: Material, times: np.ndarray, frames: np.ndarray) -> str | None:
    """Return that the law of a ribbon has no value at a first guess, in a sentence; None where it has, and of other laws.

    Parameters
    ----------
    times : ndarray, shape (K,)
    frames : ndarray, shape (K, 4)
        Quaternions of the guess.
    """
    if material.law != RIBBON.name:
        return None
    bending = strains_of((frames[1:] + frames[:-1]) / 2, np.diff(frames, axis=0) / np.diff(times)[:, None])[:, 0]
    if bending.min() > _LEAST * abs(bending).max():
        return None
    return (
        f"the law {RIBBON.name!r} has no value where the bending vanishes or is negative, as in this first state; take the law "
        f"{FINITE_WIDTH.name!r}, which has a Gamma, or a first state that bends to the side of the normal all along"
    )


def _ribbon_margin(material: Material, trial: Trial) -> float:
    """Return the least `Material.ribbon_margin` along the strip, over the largest at a node.

    The least value is sought between the nodes: a stop at the lowest node would come late by the square of their distance.
    """
    system, x, p = trial.system, trial.x, _numbers(trial)
    n = system.problem.dimension

    def margins(times: np.ndarray) -> np.ndarray:
        states = system.evaluate(x, times)
        M1, _, M3 = moment_on_directors(states.T[:4], states.T[n : n + 4])
        return np.array([material.ribbon_margin(*at, p) for at in zip(times, M1, M3)])

    times = system.nodes
    values = margins(times)
    size, least = max(abs(values).max(), _LEAST), values.min()
    for _ in range(_ROUNDS):
        lowest = int(values.argmin())
        times = np.linspace(times[max(lowest - 1, 0)], times[min(lowest + 1, len(times) - 1)], _PLACES)
        values = margins(times)
        least = min(least, values.min())
    return float(least / size)


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
