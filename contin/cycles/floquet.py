"""Special points of cycles that their Floquet multipliers show: period doublings and torus bifurcations.

Each kind has a function of its own. Period doublings are zeros of det(M + I), M the monodromy matrix: a sign decides, also
where two multipliers meet at -1. Two of them in one step leave the sign as it was and show as a dip of the function, which is
followed to its lowest place. At a torus bifurcation a complex pair passes the unit circle (`contin.events.hopf`); one that
stays on it, as in a conservative system, passes nothing.
"""

from __future__ import annotations

import cmath
import dataclasses
import functools
import itertools
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from contin.arrays import Array, ComplexArray
from contin.core.labels import Label
from contin.core.newton import Newton, correct
from contin.core.protocol import Discretization
from contin.core.spectral import changes_of_multipliers
from contin.core.step import Reason, Stop
from contin.core.trial import Event, Trial, sign_changed
from contin.cycles.ends import is_still
from contin.errors import ConvergenceError
from contin.events.arc import Arc, Place, SpecialPoint
from contin.events.dips import AS_FAR, CIRCLE, LOOKS, MINUS_ONE, ONE, comes_near, separated
from contin.events.error import Solution
from contin.events.folds import on_finer_mesh
from contin.events.hopf import hopf, hopf_points, passes
from contin.events.labelled import finding_of, frequency_of
from contin.events.normal_forms import flip, pair
from contin.events.refinement import ASIDE
from contin.levels import DOUBLED, LOCATED

if TYPE_CHECKING:
    from contin.cycles.equations import PeriodicCollocation
    from contin.cycles.map_equations import MapSystem

#: A logarithm below this may be that of a double multiplier 1: it is up to 6e-6 in the restricted three-body problem. Ten times
#: larger, period doublings beside folds lose their coefficients.
_ONE = 1e-5
#: Where the multiplier 1 is off by more, other multipliers near the unit circle may lie on the other side of it. In the tail of
#: AUTO's demo ``tor`` the doublings to the period 49 are certain, those from 54 on are not.
_MEANINGLESS = 1e-2


@dataclass(frozen=True, eq=False)
class Floquet:
    """The Floquet multipliers of a cycle, which may be larger or smaller than numbers can be.

    - ``logarithms`` (ndarray of complex, shape (n,)): Natural logarithms of the multipliers, the largest first; a multiplier
      with a positive real part is unstable.
    - ``errors`` (ndarray, shape (n,)): Estimated errors of the logarithms: their change on a mesh halved and, for the
      multiplier of an autonomous system that is 1, its own. NaN where the cycle is not found on that mesh. Of maps, round-off.
    - ``unstable`` (int): Number of unstable multipliers, without the one that is 1.
    """

    logarithms: ComplexArray
    errors: Array
    unstable: int

    def __repr__(self) -> str:
        return f"Floquet({len(self.logarithms)} multipliers, {self.unstable} unstable; the largest {self.multipliers[0]:.6g})"

    @property
    def multipliers(self) -> ComplexArray:
        """The multipliers, shape (n,): infinite or zero where no number holds them."""
        with np.errstate(over="ignore", under="ignore", invalid="ignore"):
            found: ComplexArray = np.exp(self.logarithms.real) * np.exp(1j * self.logarithms.imag)
        return found


def floquet(
    system: Discretization, x: Array, tangent: Array, errors: Mapping[str, float] | None = None, fold: bool = False
) -> Floquet:
    """Return the Floquet multipliers of a cycle, or of one on a curve in two parameters, with their errors.

    The tangent is NaN where it is not known. ``errors`` are those of the free parameters at a located point: how far it may lie
    from its place, and how much the multipliers change over that distance. At a ``fold`` one of them is 1 besides.
    """
    cycles: Any = system.solution
    x_of = slice(0, cycles.size)
    values, trivial = cycles.eigenvalues(x[x_of]), _trivial(cycles, x[x_of])
    if not cycles.intervals:  # of a map
        found = changes_of_multipliers(cycles.eigenvalues, x[x_of], values)
        return Floquet(values, found, unstable(cycles, x[x_of]))
    finer: Any
    finer, carry = system.refined()  # type: ignore[misc]  # there is a mesh
    try:
        along = carry(tangent)
        again = _corrected(finer, carry(x), along)
        if (moved := finer.on_switches(again, closely=True)) is not None:  # they depend on the places of corners themselves
            finer, carry = moved
            again = _corrected(finer, carry(again), carry(along))
        found = _apart(values, finer.solution.eigenvalues(again[: finer.solution.size]))
    except ConvergenceError:
        found = np.full(values.shape, np.nan)
    found += _by_place(system, x, tangent, errors or {}, fold)
    if trivial is not None:
        found[trivial] = abs(values[trivial])
        double = np.abs(values) < DOUBLED  # round-off of what is 1 twice may be alike on both meshes
        found[double] = np.maximum(found, np.abs(values))[double]
    return Floquet(cycles.whole_round(values), cycles.order * found, unstable(cycles, x[x_of]))


def _by_place(system: Any, x: Array, tangent: Array, errors: Mapping[str, float], fold: bool) -> Array | float:
    """Return by how much the multipliers change between a located point and where it may lie.

    That is as far as free parameters take to change by their errors and, of a fold, to where a multiplier is 1: in a canard
    explosion a fold is known to lie on a long piece of the branch only.
    """
    known = [(errors[name] / size, tangent[system.parameter_index(name)])
             for name, size in zip(system.free, system.free_scales) if errors.get(name, 0.0) > 0]  # fmt: skip
    if not known or not np.isfinite(known).all():
        return 0.0
    error, rate = np.linalg.norm(known, axis=0)
    cycles: Any = system.solution
    beside = x + ASIDE * tangent
    values, trivial = cycles.eigenvalues(x[: cycles.size]), _trivial(cycles, x[: cycles.size])
    changes: Array = _apart(values, cycles.eigenvalues(beside[: cycles.size])) / ASIDE
    distance = error / rate if rate > 0 else 0.0
    if fold:
        place = min((i for i in range(len(values)) if i != trivial), key=lambda i: abs(values[i]))
        distance = max(distance, abs(values[place]) / changes[place] if changes[place] > 0 else 0.0)
    return changes * distance


def _corrected(system: Discretization, x: Array, tangent: Array) -> Array:
    """Return a cycle corrected; as it is where F_x is singular there and no tangent is known."""
    if system.size == system.equations:
        return correct(system, x).x
    if not np.isfinite(tangent).all():
        return x
    row = system.weights * tangent
    return correct(system, x, row, row @ x).x


def _apart(values: ComplexArray, others: ComplexArray) -> Array:
    """Return how far each of some logarithms is from its counterpart: angles are alike up to full turns."""
    from scipy.optimize import linear_sum_assignment  # type: ignore[import-untyped]  # takes .1 s; only this needs it

    gaps = values[:, None] - others
    gaps = np.abs(gaps.real + 1j * ((gaps.imag + math.pi) % (2 * math.pi) - math.pi))
    return gaps[linear_sum_assignment(gaps)]


def _trivial(system: PeriodicCollocation | MapSystem, x: Array) -> int | None:
    """Return the place of the multiplier that is 1 along every autonomous cycle; None of a forced one."""
    return int(np.abs(system.eigenvalues(x)).argmin()) if system.autonomous else None


def unstable(system: PeriodicCollocation | MapSystem, x: Array) -> int:
    """Return the number of unstable multipliers, without the one that is 1 and those that are on the circle up to round-off.

    Multipliers whose logarithm is below 1e-9 are left out, too, and those as near to 1 as the one that is 1 by its error:
    in a conservative system the mesh parts a double one to both sides.
    """
    values, trivial = system.eigenvalues(x), _trivial(system, x)
    outside = (values.real > 0) & ~system.neutral(x) & (np.abs(values) >= LOCATED)
    if trivial is not None:
        outside &= np.abs(values) > AS_FAR * abs(values[trivial])
    return int(np.count_nonzero(outside))


def has_double_one(system: PeriodicCollocation, x: Array) -> bool:
    """Return whether a multiplier is 1 beside the one that always is, as far as can be told: that of a Jordan block may be off.

    In a conservative system it is along the whole family.
    """
    values, trivial = np.abs(system.eigenvalues(x)), _trivial(system, x)
    if trivial is not None:
        values[trivial] = np.inf
    return bool(values.min() < _ONE)


@functools.cache  # one for all steps: a point that two steps share has its value once
def doubling(order: int = 1) -> Event:
    """Return the test function of period doublings: det(M + I), each factor divided by 1 + |multiplier|.

    With a symmetry of even order n, M being the map over one n-th of the period, the multiplier over the whole period is
    (-1)^n = 1 there: cycles of the same period branch off that have lost the symmetry.
    """
    label, name = (Label.PERIOD_DOUBLING, "period doubling") if order % 2 else (Label.BRANCH_POINT, "symmetry breaking")
    return Event(label, name, _antiperiodic, search=_doublings, asks=_may_double, normal_form=flip,
                 describe=lambda trial: {"frequency": math.pi, "pairs": 1})  # fmt: skip


def _antiperiodic(trial: Trial) -> float:
    found = 1.0 + 0.0j
    for value in trial.settled.system.computed_eigenvalues(trial.settled.x).tolist():
        size, ahead = math.exp(-abs(value.real)), cmath.rect(1.0, value.imag)
        found *= (size + ahead if value.real > 0 else 1 + size * ahead) / (1 + size)
    return found.real


def doubles(point: Solution) -> bool:
    """Return whether `doubled` orbits leave a point: a period doubling, or a branch point at which a symmetry breaks."""
    return point.label == Label.PERIOD_DOUBLING or (point.label == Label.BRANCH_POINT and isinstance(point.details, dict))


def doubled(system: PeriodicCollocation | MapSystem, point: SpecialPoint) -> SpecialPoint:
    """Return a special point, as the end of the branch where a cycle comes to go twice round one of half its period.

    Beyond it the branch is itself, half a period on.
    """
    found = point.label == Label.BRANCH_POINT and finding_of(point.details).is_branch_point
    if not found or not system.is_doubled(point.trial.x):
        return point
    stop = Stop(Reason.PERIOD_DOUBLING, "the cycles come to go twice round cycles of half the period, at a period doubling")
    return dataclasses.replace(point, label=Label.PERIOD_DOUBLING, name="period doubling", stop=stop)


def _may_double(arc: Arc) -> bool:
    """Return whether there may be period doublings inside a step."""
    test = doubling(arc.trial.system.order)
    return not arc.before.value(test) * arc.trial.value(test) > 0 or _comes_near(arc, MINUS_ONE)


def _doublings(arc: Arc, knots: list[Place]) -> list[SpecialPoint]:
    """Return the period doublings between places of a step, in order."""
    if is_still(arc.trial):
        return []
    test = doubling(arc.trial.system.order)
    known = [trial.value(test) for _, trial in knots]
    if np.all(np.sign(known) == np.sign(known[0])) and not _comes_near(arc, MINUS_ONE):
        return []
    if _mean_little(arc.before) and _mean_little(arc.trial):  # what is found is round-off, and takes long
        lost = SpecialPoint(arc.step, test.label, test.name, arc.trial, test=test, is_located=False)
        return [lost] if sign_changed(known[0], known[-1]) else []
    knots = separated(arc, test, knots, LOOKS)
    pieces = [(left, right) for left, right in itertools.pairwise(knots)
              if sign_changed(left[1].value(test), right[1].value(test))
              and _changes_on_finer_mesh(left[1], right[1], test, arc.newton)]  # fmt: skip
    return [_doubtful(arc.locate(test, left, right)) for left, right in pieces]


def _comes_near(arc: Arc, what: int) -> bool:
    """Return whether multipliers can have passed something inside a step, and back, by their logarithms at both ends."""
    system = arc.trial.system
    longer = system.unit_time(arc.trial.x) / system.unit_time(arc.before.x) if system.intervals else 1.0
    ends = np.array([_without_trivial(arc.before), _without_trivial(arc.trial)])
    real, imaginary = np.ascontiguousarray(ends.real), np.ascontiguousarray(ends.imag)
    return bool(comes_near(real, imaginary, what, int(not system.intervals), longer))


@functools.lru_cache(maxsize=4)
def _without_trivial(trial: Trial) -> ComplexArray:
    """Return the logarithms of the multipliers of a cycle, with their round-off, but for the one that is 1."""
    values: ComplexArray = trial.system.computed_eigenvalues(trial.x)
    return np.delete(values, np.abs(values).argmin()) if trial.system.autonomous else values


def keep_off_one(arc: Arc) -> bool:
    """Return whether no multiplier but the one that is 1 comes near 1, where cycles branch, by those at both ends of a step."""
    return not _comes_near(arc, ONE)


def _changes_on_finer_mesh(left: Trial, right: Trial, test: Event, newton: Newton) -> bool:
    """Return whether a test function changes its sign on the mesh halved, too; looked at where multipliers are in doubt."""
    if not any(left.system.is_drifted(trial.x) for trial in (left, right)):
        return True
    finer = [on_finer_mesh(trial, newton) for trial in (left, right)]
    values = [trial.value(test) for trial in finer if trial is not None]
    return len(values) == 2 and sign_changed(*values)


def critical_angle(system: PeriodicCollocation | MapSystem, point: object, x: Array) -> float:
    """Return the angle of the pair on the circle at a torus bifurcation x: that of the point or, if unknown, of the nearest."""
    known = frequency_of(point)
    if known is not None:
        return known
    values = system.eigenvalues(x)
    return float(abs(values[np.argmin(np.where(values.imag > 0, np.abs(values.real), np.inf))].imag))


def torus() -> Event:
    """Return the test function of torus bifurcations: the largest real part of the logarithm of a complex multiplier."""
    return Event(Label.TORUS, "torus", hopf().function, search=_tori, asks=_may_twist, normal_form=pair)


def _may_twist(arc: Arc) -> bool:
    """Return whether there may be torus bifurcations inside a step, where a pair passes the circle, no single one."""
    before, behind = (int(np.count_nonzero(_without_trivial(trial).real > 0)) for trial in (arc.before, arc.trial))
    return abs(before - behind) > 1 or _comes_near(arc, CIRCLE)


def _tori(arc: Arc, knots: list[Place]) -> list[SpecialPoint]:
    """Return the torus bifurcations between places of a step, in order."""
    if is_still(arc.trial) or not _may_twist(arc):
        return []
    found = hopf_points(arc, knots)  # the pair must lie inside the circle on one side, and outside on the other
    return [_doubtful(each) for each in found if not each.is_located or passes(arc, each.at, each.details["frequency"])]


def _doubtful(point: SpecialPoint) -> SpecialPoint:
    """Return a special point, as not located where multipliers mean little."""
    return dataclasses.replace(point, is_located=point.is_located and not _mean_little(point.trial.settled))


def _mean_little(trial: Trial) -> bool:
    """Return whether the multiplier that is 1 has such an error that others mean little."""
    trivial = _trivial(trial.system, trial.x)
    return trivial is not None and not abs(np.expm1(trial.system.eigenvalues(trial.x)[trivial])) <= _MEANINGLESS
