"""Secondary branches: what leaves a primary branch, in the smallest domain that holds it, against the whole loop."""

import dataclasses
import functools

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from contin import ConvergenceError, MeshControl, Newton, Settings, trace
from contin.lowlevel import correct, point_of
from ribbon_model.domains import HALF_LOOPS, LOOP
from ribbon_model.equilibrium import directors, on_directors
from ribbon_model.laws import FLAT_ROD, RIBBON
from ribbon_model.modes import Mode
from ribbon_model.second_variation import Symmetry
from ribbon_model.seeds import force, primary_branch, secondary_branch
from ribbon_model.solution import Solution
from ribbon_model.stability import index

NU = 0.3


@functools.cache
def at(law, m, n, kappa_n):
    """The solution on the cell of the branch (m, n) at kappa_n, where it has one only."""
    system, x, tangent = primary_branch(law, m, n, NU, 10, 7)
    ends = sorted([kappa_n, x[system.parameter_index("kappa_n")]])
    settings = Settings(trivial="M2", limits={"kappa_n": (ends[0] - 1, ends[1] + 1)}, zeros={"kappa_n": [kappa_n]})
    (point,) = trace(point_of(system, x), settings, tangent=tangent).labelled("UZ")
    return point


@functools.cache
def leave(law, m, n, kappa_n, reversal, sense=1, zeros=()):
    """The first points of a secondary branch."""
    system, x, tangent = secondary_branch(Solution.of(at(law, m, n, kappa_n)), HALF_LOOPS[reversal])
    newton = Newton(1e-8)  # beside the bifurcation round-off is that large along its kernel
    settings = Settings(max_points=12, mesh=MeshControl(1e-11), newton=newton, zeros={"kappa_n": zeros})
    return trace(point_of(system, x), settings, tangent=sense * tangent)


#: Where, from the index along the primary branch (an eigenvalue in Fourier coefficients passes zero), which knows nothing of
#: the half loops.
PLACES = [
    (RIBBON, 3, 1, -21.6268175, "mirror"), (RIBBON, 3, 1, -114.3093551, "mirror"), (RIBBON, 5, 1, -23.6345784, "mirror"),
    (RIBBON, 5, 1, -24.4451886, "axis"), (RIBBON, 5, 1, -29.4587214, "axis"), (RIBBON, 5, 2, -20.0441574, "mirror"),
    (RIBBON, 5, 2, -20.0441574, "axis"),
]  # fmt: skip


@pytest.mark.sample(3)
@pytest.mark.parametrize(("law", "m", "n", "kappa_n", "reversal"), PLACES)
def test_a_bifurcation_is_simple_on_the_half_loop_with_its_symmetry(law, m, n, kappa_n, reversal):
    primary = at(law, m, n, kappa_n)
    system, x = Solution.of(primary).on(HALF_LOOPS[reversal]).discretized()
    assert np.abs(system.residual(x)).max() < 1e-9
    system, x, tangent = secondary_branch(Solution.of(primary), HALF_LOOPS[reversal])
    assert x[system.parameter_index("kappa_n")] == pytest.approx(kappa_n, abs=3e-7)
    values = dict(zip(system.problem.functionals, system.functionals(x)))
    assert values["energy"] == pytest.approx(primary["energy"], abs=1e-5)
    assert abs(tangent[system.parameter_index("kappa_n")]) < 1e-4  # a pitchfork


@pytest.mark.parametrize(("m", "kappa_n", "other"), [(3, -21.6268175, "axis"), (5, -24.4451886, "mirror")])
def test_a_simple_mode_does_not_leave_the_other_half_loop(m, kappa_n, other):
    with pytest.raises((ValueError, ConvergenceError)):
        secondary_branch(Solution.of(at(RIBBON, m, 1, kappa_n)), HALF_LOOPS[other])


@pytest.mark.sample(1)
@pytest.mark.parametrize(("m", "n", "kappa_n", "reversal"), [(5, 1, -24.4451886, "axis"), (5, 2, -20.0441574, "mirror")])
def test_the_loop_closes_and_is_in_equilibrium(m, n, kappa_n, reversal):
    """The half loop unfolded satisfies the equations of the whole loop, and an integration by DOP853 comes back."""
    point = leave(RIBBON, m, n, kappa_n, reversal).points[-1]
    assert force(point) > 0.5
    assert Solution.of(point).shape().closure() < 1e-9
    system, guess = Solution.of(point).on(LOOP).discretized()
    assert np.abs(system.residual(guess)).max() < 1e-8
    assert system.functionals(guess) == pytest.approx([point["kappa_star"], point["energy"]], abs=1e-8)
    p = point.parameters
    M, R = (np.array([p[f"{name}{i}"] for i in (1, 2, 3)]) for name in "MR")

    def rate(s, y):
        _, w1, w2, w3, _ = RIBBON.response(*on_directors(*y[:4], *(M - np.cross(y[4:], R))), p["kappa_n"], NU)
        turn = np.array([[0, -w1, -w2, -w3], [w1, 0, w3, -w2], [w2, -w3, 0, w1], [w3, w2, -w1, 0]])
        return np.concatenate([turn @ y[:4] / 2, directors(*y[:4])[6:]])

    end = solve_ivp(rate, (0, 2 * np.pi), [1.0, *np.zeros(6)], method="DOP853", rtol=1e-12, atol=1e-13).y[:, -1]
    assert np.abs(end[1:]).max() < 1e-8


def test_newton_on_the_whole_loop_stays():
    """Between mirrors only: on a two-fold axis M3, which fixes the phase of the loop, is stationary."""
    point = leave(RIBBON, 5, 2, -20.0441574, "mirror").points[-1]
    system, guess = Solution.of(point).on(LOOP).discretized()
    row = np.zeros(system.size)
    row[system.parameter_index("kappa_n")] = 1.0
    done = correct(system, guess, row, point["kappa_n"], Newton(1e-8))
    assert np.abs(done.x - guess).max() < 1e-6


@pytest.mark.parametrize("reversal", ["mirror", "axis"])
def test_the_index_by_symmetry_is_that_of_the_loop_without(reversal):
    point = leave(RIBBON, 5, 2, -20.0441574, reversal).points[-1]
    equilibrium = Solution.of(point).equilibrium()
    assert equilibrium.symmetry == Symmetry(mirror=reversal == "mirror", axis=reversal == "axis")
    mesh = np.concatenate([equilibrium.mesh, 2 * equilibrium.mesh[-1] - equilibrium.mesh[-2::-1]])
    ours, theirs = index(equilibrium), index(dataclasses.replace(equilibrium, symmetry=Symmetry(), mesh=mesh, inside=None))
    assert ours.decided and theirs.decided and ours.index == theirs.index


@pytest.mark.sample(2)
@pytest.mark.parametrize(
    ("law", "m", "n", "kappa_n", "reversal", "more"),
    [(RIBBON, 3, 1, -21.6268175, "mirror", 1), (RIBBON, 5, 1, -24.4451886, "axis", 1),
     (RIBBON, 5, 2, -20.0441574, "mirror", 2), (RIBBON, 5, 2, -20.0441574, "axis", 1)],
)  # fmt: skip
def test_stability_is_exchanged(law, m, n, kappa_n, reversal, more):
    """A pitchfork to the side where the primary branch has fewer negative directions has one more of them, the way it goes.

    Of the two kinds of branches that leave by a pair of modes, one has another, from the mode that is not its own.
    """
    before, after = (Solution.of(at(law, m, n, kappa_n + d)).index().index for d in (0.2, -0.2))
    assert before - after == (1 if n == 1 else 2)
    point = leave(law, m, n, kappa_n, reversal).points[-1]
    found = Solution.of(point).index()
    assert found.decided
    assert found.index == (after + more if point["kappa_n"] < kappa_n else before - more)


def test_both_ways_along_the_kernel_are_images():
    """The rotary reflection changes the sign of the mode, so the two half-branches are one up to symmetry."""
    pair = [leave(RIBBON, 5, 1, -24.4451886, "axis", sense, (-24.5,)).labelled("UZ")[0] for sense in (1, -1)]
    assert np.abs(pair[0]["R1"] - pair[1]["R1"]) > 0.1
    for name in ("kappa_star", "energy"):
        assert pair[0][name] == pytest.approx(pair[1][name], abs=1e-8)
    assert force(pair[0]) == pytest.approx(force(pair[1]), abs=1e-7)


def test_what_modes_keep():
    assert Mode.parse(1, "wavenumber 1 even") == Mode(1, 1, "even")
    one = Mode.parse(2, "wavenumber 1 pair")
    assert (one.dimension, one.keeps, one.symmetric) == (2, ("mirror", "axis"), True)
    assert one.kept("axis") == "one two-fold axis"
    assert one.broken("axis") == "2 mirrors, one two-fold axis, 4-fold rotary reflection"
    assert Mode.parse(3, "wavenumber 3 odd").kept("axis") == "3 two-fold axes, 3-fold rotation"
    assert Mode.parse(1, "wavenumber 0 odd").keeps == ()
    third = Mode.parse(3, "wavenumber 2 pair")  # comes back after three rotary reflections, which exchange mirrors and axes
    assert (third.keeps, third.symmetric) == (("mirror",), False)
    assert third.kept("mirror") == "one mirror, one two-fold axis, 2-fold rotary reflection"


def test_a_mode_that_is_none_is_named():
    with pytest.raises(ValueError, match="must be .*wavenumber 1 pair"):
        Mode.parse(2, "wavenumber 1 even")


def test_a_rod_loses_its_symmetry_too():
    """The flat rod's (3, 1) changes its index by one, and there the half loop between mirrors has a branch point."""
    kappa_n = 1.0104548
    counts = [Solution.of(at(FLAT_ROD, 3, 1, kappa_n + d)).index().index for d in (0.01, -0.01)]
    assert abs(counts[0] - counts[1]) == 1
    system, x, _ = secondary_branch(Solution.of(at(FLAT_ROD, 3, 1, kappa_n)), HALF_LOOPS["mirror"])
    assert x[system.parameter_index("kappa_n")] == pytest.approx(kappa_n, abs=1e-6)
