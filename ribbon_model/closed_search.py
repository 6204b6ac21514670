"""Further equilibria of closed strips: shooting from many random loads, each result solved again by collocation.

An equilibrium with a mirror, or with a two-fold axis along d2, is one on half of the loop (`ribbon_model.domains`). There it is
determined by three or four numbers, the loads at S = 0: the frame and the centreline follow from them by an initial value
problem, and must meet the conditions at the other end. From random loads, Levenberg and Marquardt's damped Newton steps lower
what these conditions miss, of all draws at once. Strips that close are solved again as boundary value problems, with adapted
meshes. States that have no mirror and no such axis are not found in this way.
"""

from __future__ import annotations

import dataclasses
import math
import operator
from collections import namedtuple
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from contin import ContinError, MeshControl, Point, solve
from contin.lowlevel import levels
from ribbon_model.domains import HALF_LOOPS, Domain
from ribbon_model.equilibrium import CENTRELINE, FRAME, directors, spin
from ribbon_model.law import Law
from ribbon_model.linear import circle, covering
from ribbon_model.shape import quaternions
from ribbon_model.solution import Solution

#: Steps of the initial value problem (Runge and Kutta's method of fourth order) over half a loop. With 60, strips with more
#: than six waves do not converge when they are solved again; 240 find no more.
_STEPS = 120
#: Damped Newton steps from each draw. Of those that close after 60, four of five have closed after 30.
_ITERATIONS = 30
#: First damping, relative to the diagonal of the normal equations; its change after a success and a failure.
_DAMPING, _LESS, _MORE = 1e-2, 0.1, 5.0
#: Longest step, relative to 1 + the largest load.
_LONGEST = 0.5
#: Mesh on which a strip is solved again, before it is adapted.
_INTERVALS, _DEGREE = 24, 5
#: How far that mesh is adapted: strips with more waves than these intervals resolve are left out.
_MESH = MeshControl(1e-9, 8, 200)
#: Places of a half loop at which omega_1 is looked at to count waves.
_PLACES = 256
#: Moment and force at S = 0.
_LOADS = ("M1", "M2", "M3", "R1", "R2", "R3")

Named = namedtuple("Named", (*FRAME, *CENTRELINE))  # noqa: PYI024


def further(
    law: Law, parameters: Mapping[str, float], kappa_n: float, known: Sequence[tuple[float, float]],
    coverings: Sequence[int], draws: int, seed: int = 0,
) -> Iterator[Point]:  # fmt: skip
    """Yield equilibria of a closed strip that are none of the known ones, and no planar circles.

    They are of the class of the circles with the given covering indices, odd or even: no motion takes one class to the other.

    Parameters
    ----------
    law : Law
    parameters : mapping of str to float
        Of the law.
    kappa_n : float
    known : sequence of (float, float)
        kappa* and energy of the known states: rigid motions and symmetries do not change them.
    coverings : sequence of int
        Circles with these covering indices are where draws begin.
    draws : int
        Random loads beside each circle, on each of both half loops: normal, of the size 1 + covering index.
    seed : int
        Of the random numbers.

    Yields
    ------
    Point
        On a half loop, solved by collocation; `Solution.of` takes it.

    Examples
    --------
    A state of the branch (1, 2) of a ribbon, which `ribbon run m1_n2` follows:

    >>> from ribbon_model.laws import RIBBON
    >>> found = list(further(RIBBON, {"nu": 0.3}, 3.0, [], [1], 4))
    >>> any(abs(point["energy"] + 2.523973058) < 1e-8 for point in found)
    True
    """
    random, seen = np.random.default_rng(seed), list(known)
    for domain in HALF_LOOPS.values():
        names = domain.free[1:]
        options = {"free": names, "intervals": _INTERVALS, "degree": _DEGREE, "mesh": _MESH}
        loads = np.concatenate([
            (1 + m) * random.standard_normal((draws, len(names)))
            + [law.circle(m, kappa_n, parameters)["M1"] if name == "M1" else 0.0 for name in names]
            for m in coverings
        ])  # fmt: skip
        for values, states in _Shooting(law, parameters, kappa_n, domain).closed(loads):
            given = {"kappa_n": kappa_n, **parameters, **dict(zip(names, map(float, values)))}
            try:
                point = solve(domain.problem(law), (np.linspace(0, 1, len(states)), states), given, **options)
            except ContinError:
                continue
            place = point["kappa_star"], point["energy"]
            same_class = is_odd(Solution.of(point)) in {m % 2 == 1 for m in coverings}
            planar = circle(law, covering(law, parameters, kappa_n, *place), kappa_n, parameters)
            if same_class and not is_known(place, [*seen, (planar["kappa_star"], planar["energy"])]):
                seen.append(place)
                yield point


def is_known(place: tuple[float, float], known: Sequence[tuple[float, float]]) -> bool:
    """Return whether kappa* and energy are those of a known state."""
    return any(all(abs(a - b) <= levels.APART * (1 + abs(b)) for a, b in zip(place, other)) for other in known)


def is_odd(solution: Solution) -> bool:
    """Return whether the frame of a strip turns like that of an odd circle: no motion takes such strips to the others."""
    q = quaternions(solution.shape().directors)
    return bool(q[0] @ q[-1] < 0)


def waves(solution: Solution) -> int:
    """Return the number of equal waves of omega_1 around a strip that was solved on a half loop."""
    t = np.linspace(0, 1, _PLACES + 1)
    strains = dataclasses.replace(solution, t=t, states=solution.sampled(t)[:, : solution.states.shape[1]]).strains()
    cosines = np.abs(np.fft.rfft(np.append(strains[:, 0], strains[-2:0:-1, 0])).real)  # omega_1 is even about both ends
    found = math.gcd(*(int(j) for j in np.flatnonzero(cosines > levels.APART * cosines.max()) if j))
    return found or 1


class _Shooting:
    """Initial value problems from loads at S = 0, shape (P, loads), of many strips at once."""

    def __init__(self, law: Law, parameters: Mapping[str, float], kappa_n: float, domain: Domain):
        self.law, self.material = law, (kappa_n, *(parameters[name] for name in law.parameters))
        self.places = [_LOADS.index(name) for name in domain.free[1:]]
        self.length, self.boundary = domain.parameters["length"], domain.boundary
        self.names = domain.problem(law).states

    def closed(self, loads: np.ndarray) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        """Yield loads of strips that close, and their states (`_STEPS` + 1, 7)."""
        with np.errstate(all="ignore"):
            loads = self._improved(loads)
            path = self.integrated(loads)
            sizes = np.abs(self._missed(path[-1])).max(axis=1)
        for number in np.argsort(sizes, kind="stable"):
            if sizes[number] <= levels.APART:
                yield loads[number], path[:, number]

    def integrated(self, loads: np.ndarray) -> np.ndarray:
        """Return states at the ends of all steps, shape (`_STEPS` + 1, P, 7)."""
        held = np.zeros((len(loads), len(_LOADS)))
        held[:, self.places] = loads
        u = np.zeros((len(loads), len(self.names)))
        u[:, 0] = 1.0
        path, h = [u], self.length / _STEPS
        for _ in range(_STEPS):
            first = self._rates(u, held)
            second = self._rates(u + h / 2 * first, held)
            third = self._rates(u + h / 2 * second, held)
            u = u + h / 6 * (first + 2 * second + 2 * third + self._rates(u + h * third, held))
            path.append(u)
        return np.array(path)

    def _rates(self, u: np.ndarray, held: np.ndarray) -> np.ndarray:
        q, (x1, x2, x3), (m1, m2, m3, r1, r2, r3) = u.T[:4], u.T[4:], held.T
        lab = m1 - (x2 * r3 - x3 * r2), m2 - (x3 * r1 - x1 * r3), m3 - (x1 * r2 - x2 * r1)
        frame = directors(*q)
        moment = np.array([sum(map(operator.mul, frame[at : at + 3], lab)) for at in (0, 3, 6)])
        return np.array([*spin(*q, *self.law.linearized(moment.T, *self.material)[0].T, 1.0), *frame[6:]]).T

    def _missed(self, last: np.ndarray) -> np.ndarray:
        """Return what the conditions at the other end miss, shape (P, loads): those at S = 0 hold."""
        return np.array(self.boundary(Named(1.0, *np.zeros(6)), Named(*last.T), None)[len(self.names) :]).T

    def _improved(self, loads: np.ndarray) -> np.ndarray:
        """Return loads after damped Newton steps; a step that does not lower what is missed is made again with more damping."""
        count = loads.shape[1]
        damping, (missed, slopes) = np.full(len(loads), _DAMPING), self._sloped(loads)
        for _ in range(_ITERATIONS):
            normal = slopes @ slopes.transpose(0, 2, 1)
            normal = normal + np.eye(count) * (damping[:, None] * np.diagonal(normal, axis1=1, axis2=2))[:, None]
            fine = np.isfinite(normal).all(axis=(1, 2)) & (np.abs(np.linalg.det(normal)) > 0)
            normal[~fine] = np.eye(count)
            step = -np.linalg.solve(normal, slopes @ missed[:, :, None])[:, :, 0]
            allowed = _LONGEST * (1 + np.abs(loads).max(axis=1)) / np.abs(step).max(axis=1)
            trial = loads + np.minimum(1.0, allowed)[:, None] * step
            now, beside = self._sloped(trial)
            better = fine & ((now**2).sum(axis=1) < (missed**2).sum(axis=1))
            loads, missed = (np.where(better[:, None], *pair) for pair in ((trial, loads), (now, missed)))
            slopes = np.where(better[:, None, None], beside, slopes)
            damping = damping * np.where(better, _LESS, _MORE)
        return loads

    def _sloped(self, loads: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return what is missed, and its slopes [strip, load, condition] by differences, in one integration."""
        count = loads.shape[1]
        change = levels.APART * (1 + np.abs(loads))
        beside = loads[:, None] + change[:, :, None] * np.eye(count)
        every = self._missed(self.integrated(np.concatenate([loads[:, None], beside], axis=1).reshape(-1, count))[-1])
        every = every.reshape(-1, 1 + count, count)
        return every[:, 0], (every[:, 1:] - every[:, :1]) / change[:, :, None]
