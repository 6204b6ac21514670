"""Snapping: an unstable closed strip follows its energy downhill until it rests; the state at rest is identified.

The strip is one of segments (`ribbon_model.segments`). A gradient flow in a metric G is G d(omega)/dt = -gradient, on closed
strips; the implicit steps of `descend` follow it with the exact Hessian and end as Newton's method. The end may depend on
the metric, that is on the damping of the strip:

- ``strain``: G is the mean of the squared rate of the strains;
- ``velocity``: G is the mean of the squared velocity of the material points, the rigid motion taken out (a drag), and of the
  spin times a radius of gyration `GYRATION`, without which a pure twist would meet no resistance.

There is no inertia: a strip that overshoots may reach another state. It may pass through itself, as in all of this package. No
path of closed strips changes the parity of the covering index: over the loop the frame's quaternion returns to itself or to its
negative (1, 3, 5 ... coverings are one class).
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import LinAlgError, cho_factor, cho_solve, eigh

from contin.lowlevel import correct, eigenbasis, levels
from ribbon_model import exact, second_variation
from ribbon_model.domains import LOOP
from ribbon_model.equilibrium import LENGTH
from ribbon_model.linear import thresholds
from ribbon_model.segments import Strip
from ribbon_model.shape import quaternions
from ribbon_model.solution import Solution
from ribbon_model.stability import Stability, index

#: Radius of gyration of a section in the metric 'velocity', in units of L / 2 pi.
GYRATION = 0.05
#: Distance past its limit at which a state is let go, relative to 1 + |limit|. Segments shift limits by O(N^-2): at a tenth of
#: the distance a strip may stay where it is.
PAST = 0.01
#: Root mean square in the strains of the kick that it is given. A tenth only takes longer.
KICK = 0.02
#: Largest root mean square change of the strains in a step downhill. Ten times more may step over a minimum.
LONGEST = 0.1
#: Segments of such a strip. Twice as many take four times as long.
SEGMENTS = 96

_FASTEST = 1e8  # largest time step: Newton's method
_PAIRED = 2  # further modes computed: the last one asked for may be one of a pair, or of three
_COVERINGS = range(1, 10, 2)  # of the primary branches on which an equilibrium is searched


# --- downhill -----------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Descent:
    """Result of `descend`.

    Attributes
    ----------
    strips : list of Strip
        Start, every step, end.
    times : list of float
        Of each, in the units of the flow.
    gradient : float
        At the end: root mean square of the moment that closure does not balance.
    rests : bool
        Whether that is below the tolerance.
    """

    strips: list[Strip]
    times: list[float]
    gradient: float
    rests: bool

    @property
    def end(self) -> Strip:
        """The last state."""
        return self.strips[-1]

    @property
    def energies(self) -> np.ndarray:
        """Energy of each state; it decreases at every step."""
        return np.array([strip.energy for strip in self.strips])

    @property
    def slack(self) -> int:
        """The most segments at any time on which the energy was not strictly convex."""
        return max(strip.slack for strip in self.strips)

    def frames(self, count: int) -> list[Strip]:
        """Return states at equal distances in the strains along the way, the first and the last among them."""
        strains = np.array([strip.strains for strip in self.strips])
        steps = np.sqrt(np.mean(np.sum(np.diff(strains, axis=0) ** 2, axis=2), axis=1))
        way = np.concatenate([[0], np.cumsum(steps)])
        return [self.strips[int(np.argmin(np.abs(way - place)))] for place in np.linspace(0, way[-1], count)]


def _velocity_metric(strip: Strip) -> np.ndarray:
    """Return the squares of velocity and spin at the ends of the segments, less those of the rigid motion nearest to it."""
    count, x = len(strip.strains), strip.centreline[1:]
    turning = strip.turning[:, :, strip.free]
    shift = strip.own[:, :, strip.free] - np.cross(turning, x[:, :, None], axis=1)
    turning, shift = (part.transpose(1, 0, 2).reshape(3, -1) for part in (turning, shift))
    before = np.repeat(np.tri(count), len(strip.free), axis=1)  # which strains move the end of a segment
    velocity = before * (shift[:, None] + np.cross(turning[:, None], x.T[:, :, None], axis=0))
    rates = np.concatenate([velocity, GYRATION * before * turning[:, None]]).reshape(6 * count, -1)
    motions = np.zeros((6, count, 6))
    for i, axis in enumerate(np.eye(3)):
        motions[i, :, i] = 1.0
        motions[:3, :, 3 + i] = np.cross(axis, x).T
        motions[3 + i, :, 3 + i] = GYRATION
    along = np.linalg.qr(motions.reshape(6 * count, 6))[0].T @ rates
    return rates.T @ rates - along.T @ along


#: Metrics: function(strip) -> matrix (n, n), a multiple of the squared rate per segment.
METRICS: dict[str, Callable[[Strip], np.ndarray]] = {"strain": lambda strip: np.eye(strip.size), "velocity": _velocity_metric}


class _Tangent:
    """Gradient and Hessian (n, n) of the energy on the closed strips at one of them, times N."""

    def __init__(self, strip: Strip):
        gradient, slopes, hessian, _ = strip.linearized()
        self._across = np.linalg.qr(slopes.T)[0]
        self.gradient = gradient - self._across @ (self._across.T @ gradient)
        self.hessian = self.projected(hessian)
        self.size = float(np.linalg.norm(self.gradient) / math.sqrt(len(strip.strains)))

    def projected(self, matrix) -> np.ndarray:
        """Return a form (n, n) on the closed strips; across them, its largest diagonal element."""
        image = matrix @ self._across
        inner = self._across.T @ image + np.abs(np.diag(matrix)).max() * np.eye(len(image.T))
        half = (image - self._across @ (inner / 2)) @ self._across.T
        return matrix - half - half.T


def descend(
    strip: Strip, metric: str = "strain", longest: float = LONGEST, tolerance: float = 1e-9, steps: int = 500
) -> Descent:
    """Follow the gradient flow of the energy from a closed strip to a state at rest.

    Linearly implicit steps, (G/dt + Hessian) change = -gradient. A step is shortened until G/(2 dt) + Hessian is positive, so
    that no unstable direction is missed or reversed, until the strains change by ``longest`` at most, and until the
    energy decreases as the quadratic model predicts, within a factor of two.

    Parameters
    ----------
    metric : str
        One of `METRICS`.
    longest : float
        Root mean square change of the strains in a step.
    tolerance : float
        Of the gradient, at which the strip is at rest.
    steps : int
        At most.

    Raises
    ------
    ValueError
        An unknown metric, or an energy that is not finite at the start.
    """
    if metric not in METRICS:
        raise ValueError(f"metric {metric!r} must be one of {', '.join(map(repr, METRICS))}")
    if not math.isfinite(strip.energy):
        raise ValueError(f"{strip.material}: the energy is not finite; omega_1 must be positive")
    strips, times, dt = [strip], [0.0], 1.0
    tangent = _Tangent(strip)
    while tangent.size >= tolerance and len(strips) <= steps:
        found = _step(strips[-1], tangent, METRICS[metric](strips[-1]), dt, longest)
        if found is None:
            break
        ahead, dt = found
        strips.append(ahead)
        times.append(times[-1] + dt)
        tangent, dt = _Tangent(ahead), min(2 * dt, _FASTEST)
    return Descent(strips, times, tangent.size, tangent.size < tolerance)


def _step(strip: Strip, tangent: _Tangent, metric, dt: float, longest: float) -> tuple[Strip, float] | None:
    """Return the next state and the time to it; None where no step lowers the energy."""
    resistance, count = tangent.projected(metric), len(strip.strains)
    for _ in range(60):
        if not _positive(tangent.hessian + resistance / (2 * dt)):
            dt /= 2
            continue
        change = cho_solve(cho_factor(tangent.hessian + resistance / dt), -tangent.gradient)
        size = np.linalg.norm(change) / math.sqrt(count)
        if size > longest:
            dt *= min(0.7, longest / size)
            continue
        expected = -(tangent.gradient @ change + change @ tangent.hessian @ change / 2) / count
        try:
            ahead = strip.moved(change)
            fall = strip.energy - ahead.energy
        except ValueError:
            fall = -math.inf
        noise = levels.ROUND_OFF * (1 + abs(strip.energy))
        if expected < noise and fall > -noise or 0.5 < fall / expected < 2:
            return ahead, dt
        dt /= 4
    return None


def _positive(matrix) -> bool:
    try:
        cho_factor(matrix)
    except LinAlgError:
        return False
    return True


def modes(strip: Strip, number: int = 8) -> tuple[np.ndarray, np.ndarray]:
    """Return the lowest eigenvalues of the Hessian of the energy on the closed strips, over the mean squared change of strain.

    A negative one is a direction in which an equilibrium is unstable; a shift of phase has one near zero. The signs of the
    vectors, and the bases of equal eigenvalues (modes of a circle come in pairs), are those of `contin.lowlevel.eigenbasis`.

    Returns
    -------
    values : ndarray, shape (number,)
    vectors : ndarray, shape (n, number)
        With root mean square 1 over the segments.
    """
    hessian = _Tangent(strip).hessian
    last = min(number + _PAIRED, len(hessian)) - 1
    values, vectors = eigh(hessian, subset_by_index=(0, last))
    return values[:number], eigenbasis(values, vectors.T)[:number].T * math.sqrt(len(strip.strains))


def perturbed(strip: Strip, amplitude: float) -> Strip:
    """Return the strip perturbed along its lowest mode, with root mean square ``amplitude`` (of either sign) of the strains.

    A tenth of it is added along a fixed mixture of waves without symmetry.
    """
    phase = LENGTH * (np.arange(len(strip.strains)) + 0.5) / len(strip.strains)
    random, free = np.random.default_rng(0), len(strip.free)
    waves = np.stack([[np.cos(k * phase), np.sin(k * phase)] for k in range(1, 9)]).reshape(-1, len(phase))
    mixture = (random.standard_normal((free, len(waves))) @ waves).T.ravel()
    mixture *= 0.1 * amplitude * math.sqrt(len(phase)) / np.linalg.norm(mixture)
    return strip.moved(amplitude * modes(strip, 1)[1][:, 0] + mixture)


# --- the state at rest ----------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Rest:
    """Result of `identify`: an equilibrium of the continuous strip.

    Attributes
    ----------
    kind : str
        'circle', 'primary branch', or 'unknown' (none of these).
    m, n : int
        Covering index, negative if curled against the natural sense, and wavenumber (0 on a circle).
    energy, kappa_star : float
        Mean of U, and (28).
    error : float
        Largest change of the two when the collocation's mesh was halved; 0 on a circle, which is known in closed form.
    difference : float
        From the independent quadrature of the branch (`ribbon_model.exact`), the larger of the two; 0 on a circle.
    stability : Stability
        Of this equilibrium: `ribbon_model.stability.index`.
    """

    kind: str
    m: int
    n: int
    energy: float
    kappa_star: float
    error: float
    difference: float
    stability: Stability

    def __str__(self) -> str:
        if self.kind == "circle":
            turned = ", turned inside out" if self.m < 0 else ""
            return f"{abs(self.m)}-covered circle{turned}"
        return f"({self.m}, {self.n})" if self.kind == "primary branch" else "an equilibrium on no primary branch"


def identify(strip: Strip) -> Rest:
    """Return the equilibrium that a strip at rest approximates, with its index by the second variation of the continuous strip.

    Raises
    ------
    ConvergenceError
        No equilibrium of the continuous strip close to it.
    ValueError
        The energy is not convex in the strains at that equilibrium, so there is no index.
    """
    law, parameters, kappa_n, strains = strip.law, strip.parameters, strip.kappa_n, strip.strains
    if np.abs(strains - [strains[:, 0].mean(), 0, 0]).max() < levels.APART:
        m = round(strains[:, 0].mean())
        # a strip that is turned inside out is, seen from the other side, one with the opposite natural curvature
        sense = math.copysign(1, m)
        stability = index(second_variation.circle(law, parameters, abs(m), sense * kappa_n))
        values = law.circle(abs(m), sense * kappa_n, parameters)
        return Rest("circle", m, 0, values["energy"], sense * values["kappa_star"], 0.0, 0.0, stability)
    solutions = [polished(strip, intervals) for intervals in (24, 48)]
    values = np.array([system.functionals(x) for system, x in solutions])[:, ::-1]  # energy, kappa*
    error = float(np.abs(values[1] - values[0]).max())
    system, x = solutions[1]
    stability = Solution.at(system, x).index()
    n = int(np.argmax(np.abs(np.fft.rfft(strains[:, 2]))))
    for m, point in _on_primary_branches(strip, n):
        difference = float(np.abs(values[1] - [point.energy, point.kappa_star]).max())
        if difference < levels.APART:
            return Rest("primary branch", m, n, *map(float, values[1]), error, difference, stability)
    return Rest("unknown", 0, n, *map(float, values[1]), error, math.nan, stability)


def past(limit: float, side: int) -> float:
    """Return kappa_n a little past a limit of stability, on the side +1 or -1, where `let_go` lets the strip go."""
    return limit + side * PAST * (1 + abs(limit))


def let_go(strip: Strip, metric: str = "strain", sign: int = 1) -> tuple[Descent, Rest]:
    """Return the way down of a strip that is let go past its limit, and its end: a minimum of the energy.

    The strip is perturbed along its lowest mode, with one ``sign`` or the other. See `descend` for ``metric``.

    Raises
    ------
    ArithmeticError
        The strip does not come to rest at a minimum of the energy of the continuous strip.
    """
    descent = descend(perturbed(strip, sign * KICK), metric)
    rest = identify(descent.end)
    if not (descent.rests and rest.stability.decided and rest.stability.index == 0):
        raise ArithmeticError(
            f"let go at kappa_n = {strip.kappa_n:g}: no minimum, gradient {descent.gradient:.1e}, index {rest.stability.index}"
        )
    return descent, rest


def polished(strip: Strip, intervals: int = 24, degree: int = 7):
    """Return the equilibrium next to a strip at rest, by collocation on the whole loop (`domains.LOOP`) at the same kappa_n.

    Returns
    -------
    system : Collocation
    x : ndarray, shape (system.size,)

    Raises
    ------
    ConvergenceError
        There is none nearby. (A circle cannot be corrected: it has no phase to fix.)
    """
    twist = strip.density[1][:, 2]
    start = int(np.argmax(np.abs(twist - np.roll(twist, 1))))  # M3 at S = 0 fixes the phase
    strip = replace(strip, strains=np.roll(strip.strains, -start, axis=0))
    loads = -strip.segment * strip.linearized()[3]
    values = dict(zip(("M1", "M2", "M3", "R1", "R2", "R3"), loads)) | {"kappa_n": strip.kappa_n, "unfold": 0.0}
    values |= strip.law.values(strip.parameters)
    system = LOOP.discretize(strip.law, intervals, degree, values)
    axes, x = strip.along(LENGTH * system.nodes)
    guess = system.pack(np.hstack([quaternions(axes.transpose(0, 2, 1)), x]), values)
    row = np.zeros(system.size)
    row[system.parameter_index("kappa_n")] = 1.0
    return system, correct(system, guess, row, strip.kappa_n).x


def _on_primary_branches(strip: Strip, n: int):
    """Yield (m, point) for every point on a primary branch of wavenumber n with the strip's kappa_n, by quadrature."""
    law, parameters, kappa_n = strip.law, strip.parameters, strip.kappa_n
    for m in (m for m in _COVERINGS if n and m != n and m % (2 * n)):
        try:
            first = thresholds(law, m, n, parameters)[0]
            points = exact.curve(m, n, parameters, (min(first, kappa_n) - 1, max(first, kappa_n) + 1), law=law)
        except (ValueError, RuntimeError):  # no such branch, or none with a regular start on its circle
            continue
        for one, other in itertools.pairwise(points):
            if (one.kappa_n - kappa_n) * (other.kappa_n - kappa_n) <= 0:
                near = min((one, other), key=lambda point: abs(point.kappa_n - kappa_n))
                yield m, exact.solve(m, n, parameters, near, kappa_n=kappa_n, law=law)
