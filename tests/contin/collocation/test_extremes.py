"""Largest and smallest values of the states of a cycle."""

import numpy as np
import pytest

from contin.collocation.mesh import basis
from contin.collocation.round import extremes


@pytest.mark.parametrize("shift", [0.0, 0.013, 0.3, 0.9999])
def test_a_wave_reaches_its_amplitude_anywhere(shift):
    """2 cos and sin of 2 pi (t - shift), on intervals of different lengths; the error of the polynomials is h^5."""
    mesh = np.linspace(0, 1, 41) + 0.003 * np.sin(2 * np.pi * np.linspace(0, 1, 41))
    times = np.append((mesh[:-1, None] + np.diff(mesh)[:, None] * basis(4).nodes[:-1]).ravel(), 1.0)
    states = np.stack([2 * np.cos(2 * np.pi * (times - shift)), np.sin(2 * np.pi * (times - shift))], axis=1)
    found = extremes(4, mesh, np.append(states.ravel(), 7.0), 2)  # a parameter follows the states
    assert found == pytest.approx(np.array([[2, -2], [1, -1]]), abs=1e-6)


def test_a_polynomial_is_exact():
    """16 t^2 (1 - t)^2 lies between 0 and 1."""
    mesh = np.array([0, 0.4, 1.0])
    times = np.append((mesh[:-1, None] + np.diff(mesh)[:, None] * basis(4).nodes[:-1]).ravel(), 1.0)
    assert extremes(4, mesh, 16 * times**2 * (1 - times) ** 2, 1) == pytest.approx(np.array([[1, 0]]), abs=1e-9)
