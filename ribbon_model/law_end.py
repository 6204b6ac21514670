"""Where a law ends, so that a run ends there and says why.

The law of a strip that is given by its strain energy U ends where U is not convex at a strain along the strip. Beyond that,
H = max(M.omega - U) has several values or none. A branch reaches the end smoothly, with strains that grow like a square root,
or through a jump: two neighbouring places of the strip take different minima of U - M.omega.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import TYPE_CHECKING

import numpy as np

from contin import Event
from contin.lowlevel import Collocation, Continuation, Label, Trial, levels
from ribbon_model.equilibrium import moment_on_directors, strains_of
from ribbon_model.law import Law

if TYPE_CHECKING:  # closed strips need no sections
    from ribbon_model.section import Section

Strains = Callable[[Collocation, np.ndarray], np.ndarray]

#: A run that fails with a smaller margin of its law has met the end of it. The margin falls like a square root there.
NEARLY_ENDED = 0.1
#: Rounds in which the least margin of a ribbon is sought between nodes. Each divides the distance of places by 8, so the error
#: of a smooth minimum falls by 64: from h**2 at the nodes to h**2/2.6e5. One less: 64 times that.
_ROUNDS = 3


#: Parts of a line between strains at neighbouring nodes. U is concave on a tenth of a jump at least (measured on (3, 1)).
_PARTS = 16
#: The name of the end of a law on branches of closed strips.
NAME = "the end of the convex strain energy"


def _least_on_lines(margin: Callable[[np.ndarray, np.ndarray], np.ndarray], t: np.ndarray, strains: np.ndarray) -> float:
    """Return the least ``margin(t, strains)`` on lines between nodes (at a jump U is concave there); -1 without a response."""
    both = np.column_stack([t, strains])
    lines = np.concatenate([both[:-1] + part * np.diff(both, axis=0) for part in np.arange(_PARTS) / _PARTS] + [both[-1:]])
    return float(margin(lines[:, 0], lines[:, 1:]).min()) if np.all(np.isfinite(lines)) else -1.0


# --- closed strips ------------------------------------------------------------------------------------------------------------


def margin(law: Law) -> Callable[[Collocation, np.ndarray], float] | None:
    """Return ``margin(system, x)``, the least `Law.margin` along a closed strip: 1 on planar circles, -1 without a response.

    None for a law whose H is a closed expression, because its domain is known.
    """
    if not law.ends_with_convexity:
        return None
    from ribbon_model.solution import Solution  # 10 ms, which open strips do not need

    def least(system: Collocation, x: np.ndarray) -> float:
        solution = Solution.at(system, x)
        return _least_on_lines(lambda _, w: law.margin(w, w, *solution.material), solution.t, solution.strains())

    return least


def closed_tests(law: Law) -> list[Event]:
    """Return the test function that ends a run of a closed strip where the law ends; none if H is a closed expression."""
    least = margin(law)
    return [Event(Label.END, NAME, lambda trial: least(trial.system, trial.x), terminal=True)] if least else []


# --- open strips --------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Place:
    """Where a strip stands in a problem.

    Attributes
    ----------
    strains : callable
        The strains (K, 3) at the nodes, from a discretized problem and its unknowns.
    states : sequence of int, optional
        Columns of quaternion, centreline, and their multipliers; by default those of a strip alone.
    names : mapping of str to str
        Names of the section's numbers in the problem, where they are others.
    part : callable
        The part of the strip at a part of the problem's domain.
    """

    strains: Strains
    states: Sequence[int] | None = None
    names: Mapping[str, str] = field(default_factory=dict)
    part: Callable[[np.ndarray], np.ndarray] = np.asarray

    def numbers(self, trial: Trial) -> SimpleNamespace:
        """Return the numbers of the section."""
        values = dict(zip(trial.system.problem.parameters, trial.system.all_parameters(trial.x)))
        return SimpleNamespace(**values | {own: values[name] for own, name in self.names.items()})


def tests(section: Section, place: Place) -> list[Event]:
    """Return the test function that ends a run where the law of a strip ends; none for a law that is regular everywhere."""
    law = section.form
    if not law.ends:
        return []
    margin = functools.partial(_convexity if law.ends_with_convexity else _least_margin, section, place)
    return [Event(Label.END, f"the end of the law {law.name!r}", margin, terminal=True)]


def explained(section: Section, tests: Sequence[Event], run: Continuation) -> str | None:
    """Return that a run met the end of the law, or failed near it, in a sentence; None for a run that stopped elsewhere."""
    for test in tests:
        state, met = run.state, run.stop is not None and run.stop.event == test.name
        if met or test.function(Trial.without_tangent(state.system, state.x)) < NEARLY_ENDED:
            return f"{test.name}, {section.form.ends}"
    return None


def at_guess(section: Section, times: np.ndarray, frames: np.ndarray) -> str | None:
    """Return that the law has no value at a first guess, in a sentence; None where it has.

    Parameters
    ----------
    times : ndarray, shape (K,)
    frames : ndarray, shape (K, 4)
        Quaternions of the guess.
    """
    if not section.form.has_rulings:
        return None
    bending = strains_of((frames[1:] + frames[:-1]) / 2, np.diff(frames, axis=0) / np.diff(times)[:, None])[:, 0]
    if bending.min() > levels.LOCATED * abs(bending).max():
        return None
    return (
        f"the law {section.law.name!r} has no value where the bending vanishes or is negative, as in this first state; take "
        "the law 'finite width', which has a Gamma, or a first state that bends to the side of the normal all along"
    )


def _least_margin(section: Section, place: Place, trial: Trial) -> float:
    """Return the least `Section.margin` along the strip, over the largest at a node.

    The least value is sought between the nodes: a stop at the lowest node would come late by the square of their distance.
    """
    system, x, p = trial.system, trial.x, place.numbers(trial)
    n, at = system.problem.dimension, place.states
    frame, moment = (slice(4), slice(n, n + 4)) if at is None else (list(at[:4]), list(at[7:11]))

    def margins(times: np.ndarray) -> np.ndarray:
        states = system.evaluate(x, times).T
        moments = moment_on_directors(states[frame], states[moment]).T
        return section.margin(place.part(times), moments, np.empty((len(times), 0)), p)

    times = system.nodes
    values = margins(times)
    size, least = max(abs(values).max(), levels.LOCATED), values.min()
    for _ in range(_ROUNDS):
        lowest = int(values.argmin())
        times = np.linspace(times[max(lowest - 1, 0)], times[min(lowest + 1, len(times) - 1)], _PARTS + 1)
        values = margins(times)
        least = min(least, values.min())
    return float(least / size)


def _convexity(section: Section, place: Place, trial: Trial) -> float:
    """Return the least `Section.margin` at the strains of the nodes and on lines between these."""
    p, omega = place.numbers(trial), place.strains(trial.system, trial.x)
    return _least_on_lines(lambda t, w: section.margin(place.part(t), w, w, p), trial.system.nodes, omega)
