"""Oscillators of three straight pieces: period and multipliers by matrix exponentials."""

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.optimize import fsolve

import contin


def field(u, p):
    """A relaxation oscillator whose spring is bent at x = 1 and -1, with a further state that follows it."""
    spring = p.a * u.x + (p.b - p.a) / 2 * (abs(u.x + 1) - abs(u.x - 1))
    return u.y - spring, -p.w * u.x + p.q * u.z, u.x - p.k * u.z


def half_round(p, guess):
    """Return half the period and the half-round map, from x = 1 by x = -1 and back to there, by the exponentials of two pieces.

    It solves for the times in both pieces and for the states at x = 1: after half a period they are the opposite.
    """

    def piece(slope, kink):
        return np.array([[-slope, 1, 0, -kink], [-p["w"], 0, p["q"], 0], [1, 0, -p["k"], 0], [0, 0, 0, 0]])

    inside, outside = piece(p["b"], 0.0), piece(p["a"], p["a"] - p["b"])  # at x < -1 the spring is a x - (b - a)

    def gaps(z):
        first, second, y, w = z
        start = np.array([1.0, y, w, 1.0])
        middle = expm(inside * first) @ start
        return [middle[0] + 1, *(expm(outside * second) @ middle + start)[:3]]

    first, second, *_ = fsolve(gaps, guess, xtol=1e-12)
    assert first > 0 and second > 0 and np.abs(gaps([first, second, *_])).max() < 1e-11
    return first + second, -(expm(outside * second) @ expm(inside * first))[:3, :3]


PROBLEM = contin.CycleProblem(field, ["x", "y", "z"], dict.fromkeys("abwqk", 1.0))
#: Within these ranges there is no rest but x = 0.
RANGES = {"a": (0.4, 2), "b": (-2, -0.4), "w": (0.5, 1.5), "q": (-0.3, 0.2), "k": (0.5, 1.5)}


@pytest.mark.sample(8)
@pytest.mark.parametrize("seed", range(30))
def test_random_oscillators(seed):
    random = np.random.default_rng(seed)
    p = {name: float(random.uniform(*ends)) for name, ends in RANGES.items()}
    cycle = contin.cycle(PROBLEM, [0.5, 0.5, 0.0], p)
    u = cycle.system.evaluate(cycle.x, np.linspace(0, 1, 4001))
    start = next(i for i in range(4000) if u[i, 0] >= 1 > u[i + 1, 0])
    back = (np.flatnonzero((u[:-1, 0] + 1) * (u[1:, 0] + 1) <= 0) - start) % 4000  # x = -1 twice a round
    lengths = cycle["period"] / 4000 * np.array([back.min(), back.max() - back.min()])
    period, half = half_round(p, [*lengths, *u[start, 1:]])
    assert abs(cycle["period"] / (2 * period) - 1) < 1e-10
    known = cycle.floquet()  # the errors are those of logarithms
    for value in np.linalg.eigvals(half @ half):
        at = np.abs(known.multipliers - value).argmin()
        assert abs(known.multipliers[at] / value - 1) < 2 * known.errors[at] + 1e-10 and known.errors[at] < 1e-5
