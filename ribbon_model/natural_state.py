"""The natural state of a strip, without loads, and where its last end is."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np

from ribbon_model import ends
from ribbon_model.ends import ANGLES, LOOSE, PLACE
from ribbon_model.equilibrium import directors, spin
from ribbon_model.section import NATURAL, Section


def states_at(section: Section, t) -> np.ndarray:
    """Return quaternion and centreline (K, 7) of the natural state at places t (K,) in [0, 1], from the first frame."""
    data = [section.datum(name) for name in NATURAL]
    p, t = SimpleNamespace(**section.parameters), np.atleast_1d(np.asarray(t, dtype=float))
    if not set(NATURAL) & set(section.along):
        return helix(np.array([datum(0.0, p) for datum in data]), t)
    from scipy.integrate import solve_ivp  # takes .5 s, and is needed where natural strains vary only

    def rates(s, x):
        return [*spin(*x[:4], *(datum(s, p) for datum in data), 1), *directors(*x[:4])[6:]]

    order = np.argsort(t)
    found = solve_ivp(rates, (0, 1), [1.0, 0, 0, 0, 0, 0, 0], "DOP853", t[order], rtol=1e-12, atol=1e-12).y.T
    states = np.empty_like(found)
    states[order] = found
    return states


def end_numbers(section: Section) -> dict[str, float]:
    """Return place and angles of the last end in the natural state."""
    if all(section.parameters.get(name, 0) == 0 and name not in section.along for name in NATURAL):
        return {**dict.fromkeys(PLACE + ANGLES, 0.0), "distance": 1.0}
    state = states_at(section, [1.0])[0]
    planar = abs(directors(*state[:4])[0] - 1) < LOOSE
    angles = (0.0, _winding(section), 0.0) if planar else ends.angles_of(state[:4])  # in the plane, the whole angle
    return dict(zip(PLACE + ANGLES, (*map(float, state[4:]), *angles)))


def helix(strains: np.ndarray, t: np.ndarray) -> np.ndarray:
    """Return quaternion and centreline (K, 7) at places t (K,) of a strip whose strains are constant."""
    size = float(np.linalg.norm(strains))
    axis, tangent = strains / (size or 1.0), np.array([0.0, 0.0, 1.0])
    half, angle = size * t[:, None] / 2, size * t[:, None]
    sine = np.sin(angle) / size if size else t[:, None]
    cosine = 2 * np.sin(half) ** 2 / (size or 1.0)  # (1 - cos)/size without cancellation
    place = axis * axis[2] * (t[:, None] - sine) + tangent * sine + np.cross(axis, tangent) * cosine
    return np.hstack([np.cos(half), np.sin(half) * axis, place])


def _winding(section: Section) -> float:
    """Return the whole angle by which the natural state turns about the width: the integral of kappa_n."""
    datum, p = section.datum("kappa_n"), SimpleNamespace(**section.parameters)
    s, weights = np.polynomial.legendre.leggauss(60)
    return float(sum(w / 2 * datum((x + 1) / 2, p) for x, w in zip(s, weights)))
