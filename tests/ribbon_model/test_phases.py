"""Phases of open strips: those that load the strip are said, and those that a message recommends do not."""

import ast
import functools
import math
import re

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq, fsolve
from scipy.special import jv

import contin
from contin import ProblemError
from ribbon_model.ends import FREE_END
from ribbon_model.open_strip import OpenStrip
from ribbon_model.section import section_of

CUT = section_of("rod", {"B1": 1.0, "B2": 1.0, "C": 0.8, "kappa_n": 2 * math.pi})
STRAIGHT = section_of("rod", {"B1": 1.0, "B2": 1.0, "C": 0.8})


@functools.cache
def shot(turn: float) -> float:
    """The energy of a naturally circular isotropic rod, cut open, the last end turned: Kirchhoff's equations by shooting.

    The columns of R are the directors on the axes of the first end; in the end R = exp(turn d3), where it began. The unknowns
    are the moment at the first end and the force.
    """
    stiffness, natural = np.array([1, 1, 0.8]), np.array([2 * math.pi, 0, 0])

    def rates(s, y, force):
        R, moment = y[:9].reshape(3, 3), y[12:15]
        strains = R.T @ moment / stiffness + natural
        (a, b, c), energy = strains, (strains - natural) @ (stiffness * (strains - natural)) / 2
        spin = np.array([[0, -c, b], [c, 0, -a], [-b, a, 0]])
        return np.concatenate([(R @ spin).ravel(), R[:, 2], np.cross(force, R[:, 2]), [energy]])

    def end(z):
        y = np.concatenate([np.eye(3).ravel(), np.zeros(3), z[:3], [0]])
        return solve_ivp(rates, (0, 1), y, "DOP853", rtol=1e-12, atol=1e-13, args=(z[3:],)).y[:, -1]

    def missed(z, turn):
        y, (c, s) = end(z), (math.cos(turn), math.sin(turn))
        relative = np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]) @ y[:9].reshape(3, 3)
        return [*y[9:12], relative[2, 1] - relative[1, 2], relative[0, 2] - relative[2, 0], relative[1, 0] - relative[0, 1]]

    z = np.zeros(6)
    for part in (0.5, 1.0):
        z = fsolve(missed, z, (part * turn,), xtol=1e-12)
    return end(z)[-1]


@pytest.mark.full
@pytest.mark.parametrize("phase", ["", "spin", "shift, right", "shift, left", "shift, two waves"])
def test_a_cut_ring_with_an_end_turned(phase):
    """No symmetry moves it: every phase would be a load along the branch, and is refused. Without one the energy is right."""
    strip = OpenStrip(CUT, phases=(phase,) if phase else ())
    if phase:
        name = "lam_phase_" + phase.replace(", ", "_").replace(" ", "_")
        with pytest.raises(ProblemError, match=f"phases: {name} grows along the branch at the start"):
            contin.trace(strip.first_point(), free=["turn"], limits={"turn": (0, 1)})
        return
    branch = contin.trace(strip.first_point(), free=["turn"], limits={"turn": (0, 1)})
    assert abs(branch[-1]["energy"] - shot(1.0)) < 1e-10 and not branch.notes


def greenhill(order: int) -> float:
    """The weight under which a clamped column buckles: J_-1/3((2/3) sqrt(weight)) = 0."""
    z = np.linspace(0.1, 12, 400)
    at = np.flatnonzero(np.diff(np.sign(jv(-1 / 3, z))))[order - 1]
    return (1.5 * brentq(lambda z: jv(-1 / 3, z), z[at], z[at + 1])) ** 2


@pytest.mark.sample(1)
@pytest.mark.parametrize("load", ["force_tangent", "weight"])
def test_branch_points_that_a_phase_makes(load):
    """An isotropic column buckles in both planes (Euler, Greenhill); in one the phase moves the loads: no label, a note."""
    numbers = {load: -1.0 if load == "force_tangent" else 1.0}
    strip = OpenStrip(STRAIGHT, finish=FREE_END, numbers=numbers, phases=("spin",), weight_direction=(0, 0, -1))
    sign = numbers[load]
    branch = contin.trace(strip.first_point(), free=[load], direction=sign, limits={load: tuple(sorted((0, 60 * sign)))})
    right = [math.pi**2 * (order - 0.5) ** 2 if sign < 0 else greenhill(order) for order in (1, 2)]
    np.testing.assert_allclose([sign * point[load] for point in branch.labelled("BP")], right, rtol=1e-9)
    made = [note for note in branch.notes if "makes this branch point, which gets no label" in note]
    assert all(note.startswith("phases: the index") for note in branch.notes if note not in made)
    assert f"{load} = {'-10.986' if sign < 0 else '49.900'}" in made[0]


@pytest.mark.parametrize(("numbers", "phases", "has"), [
    ({"B2": 4.0}, ["spin"], "none; leave phases out"), ({"B2": 1.0, "kappa_n": 1.0}, ["spin"], "none; leave phases out"),
    ({"B2": 1.0}, ["spin", "shift, right"], "a turn about the tangent only; leave one out"),
])  # fmt: skip
def test_phases_beyond_the_symmetries(numbers, phases, has):
    """A clamped column does not shift, and turns about its tangent if it bends alike in all planes: 1/B1 = 1/B2, straight."""
    column = OpenStrip(section_of("rod", {"B1": 1.0, "C": 0.8, **numbers}), finish=FREE_END, phases=tuple(phases))
    with pytest.raises(ProblemError) as error:
        column.first_point()
    assert str(error.value) == f"phases: {phases}: each holds a continuous symmetry, and the strip has {has}"


@pytest.mark.full
@pytest.mark.parametrize(("stiffness", "turn"), [(1.0, 14.5), (3.0, math.pi)], ids=["a ring that spins", "a band that shifts"])
def test_the_phases_that_a_message_recommends_are_no_loads(stiffness, turn):
    """All of them lead to states of one energy, on which none has a multiplier; nor on the branch of such states."""
    material, numbers = section_of("rod", {"B1": 1.0, "B2": stiffness, "C": 0.8}), {"distance": 0.0, "turn": turn}
    strip, energies = OpenStrip(material, numbers=numbers), []
    with pytest.raises(ProblemError) as error:
        strip.first_point(strip.twisted_circle(turn / math.pi))
    for text in re.findall(r"\[.*?\]", str(error.value)):
        band = OpenStrip(material, numbers=numbers, phases=tuple(ast.literal_eval(text)))
        branch = contin.trace(band.first_point(band.twisted_circle(turn / math.pi)), free=["C"], limits={"C": (0.8, 0.85)})
        assert not branch.notes and not branch[-1].phase_loads()
        energies.append(branch[0]["energy"])
    assert energies and np.ptp(energies) < 1e-8


@pytest.mark.full
def test_a_message_recommends_no_phase_where_none_fits():
    """The guess is far from any state, and a phase would only load the strip."""
    strip = OpenStrip(CUT, numbers={"turn": 1.0})
    with pytest.raises(ProblemError) as error:
        strip.first_point(strip.twisted(1.0))
    assert "no equilibrium" in str(error.value) and "phases" not in str(error.value)
