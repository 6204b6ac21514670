"""The degree where none is given: its law, what it costs on runs, and that a degree that is given is obeyed."""

import math
import re
from pathlib import Path

import numpy as np
import pytest

from bank import spb
from bank.closed_forms import bratu, bratu_fold
from contin import BoundaryValueProblem, MeshControl, solve, trace
from contin.collocation import mesh as degree
from contin.collocation.mesh import share, usual_degree
from contin.lowlevel import Collocation, basis

PAGE = Path(__file__).parents[3] / "docs" / "collocation.md"


def newton_time(states, d, intervals):
    """The law of the documentation: a + N (b + c (n d)^2), over a."""
    return 1 + intervals * (degree._INTERVAL + degree._ENTRY * (states * d) ** 2)


def test_table_of_the_documentation():
    section = PAGE.read_text(encoding="utf-8").split("## The degree")[1].split("\n## ")[0]
    table = [[cell.strip() for cell in line.strip("|").split("|")] for line in section.splitlines() if line.startswith("|")]
    tolerances = [float(re.sub("tolerance ", "", cell)) for cell in table[0][1:]]
    for states, *degrees in table[2:]:
        count = int(states.removeprefix("up to "))
        for n in range(1 if "up to" in states else count, count + 1):
            assert [usual_degree(n, tolerance) for tolerance in tolerances] == list(map(int, degrees)), n


@pytest.mark.sample(10)
@pytest.mark.parametrize("states", [1, 2, 4, 7, 13, 19, 30, 60, 500])
@pytest.mark.parametrize("tolerance", [1e-4, 1e-6, 1e-8, 1e-10, 1e-12])
def test_it_is_never_far_from_the_cheapest(states, tolerance):
    """By the law, for solutions that need few intervals and for those that need many: below 2, below 1.6 for n < 20."""
    chosen = usual_degree(states, tolerance)
    for density in np.geomspace(1e-3, 1e4, 500):
        time = {d: newton_time(states, d, max(16, density / share(basis(d), tolerance))) for d in range(4, 9)}
        assert time[chosen] < (1.6 if states < 20 else 2.0) * min(time.values()), density


def ring(n, steepness):
    """n / 2 pendula on a ring, driven and coupled: easy, or with waves that take many intervals."""
    count = n // 2

    def rhs(t, u, p, out):
        for i in range(count):
            coupling = 0.3 * (u[2 * ((i + 1) % count)] - 2 * u[2 * i] + u[2 * i - 2])
            out[2 * i] = steepness * u[2 * i + 1]
            out[2 * i + 1] = steepness * (coupling - p[0] * math.sin(u[2 * i]) + 0.2 * math.cos(3 * t + i))

    def boundary(a, b, p, out):
        for i in range(count):
            out[2 * i], out[2 * i + 1] = a[2 * i], b[2 * i] - 0.1

    return BoundaryValueProblem(rhs, boundary, n, {"lam": 0.0}, boundary_count=n)


def follow_layer(d, mesh):
    """A layer that becomes thin (the problem of ``bank.spb``)."""
    start = solve(spb.problem(), lambda t: (1.5 - 0.3 * t, -0.3), {"lam": 0.3}, degree=d, mesh=mesh)
    return trace(start, free=["eps"], direction=-1, limits={"eps": (0.005, 1)}, mesh=mesh)


def follow_ring(n, steepness, d, mesh):
    start = solve(ring(n, steepness), [0.0] * n, degree=d, mesh=mesh)
    return trace(start, free=["lam"], limits={"lam": (-0.1, 0.2)}, mesh=mesh)


#: A run, the tolerance, and the degree that it shall have.
RUNS = {
    "two states, a layer": (follow_layer, 1e-12, 7),
    "two states, a layer, coarse": (follow_layer, 1e-6, 7),
    "twenty states, smooth": (lambda d, mesh: follow_ring(20, 1.0, d, mesh), 1e-12, 6),
    "twenty states, smooth, coarse": (lambda d, mesh: follow_ring(20, 1.0, d, mesh), 1e-6, 5),
    "twenty states, waves": (lambda d, mesh: follow_ring(20, 8.0, d, mesh), 1e-12, 6),
}


@pytest.mark.sample(1)
@pytest.mark.parametrize("name", [pytest.param(name, marks=pytest.mark.full) if "twenty" in name else name for name in RUNS])
def test_runs_at_the_default_take_less_than_twice_the_best(name, monkeypatch):
    """Time by the law: two factorizations a point, which kernels make, and those of what Python looks at.

    Times on a machine are measured by scripts/bench.py.
    """
    run, tolerance, expected = RUNS[name]
    spent, linearize = [], Collocation.linearize

    def counted(self, *arguments):
        spent.append(newton_time(len(self.problem.states), self.degree, self.intervals))
        return linearize(self, *arguments)

    monkeypatch.setattr(Collocation, "linearize", counted)
    times = {}
    for d in (None, 4, 5, 6, 7, 8):
        spent.clear()
        branch = run(d, MeshControl(tolerance=tolerance))
        assert {point.system.degree for point in branch} == {d or expected}
        times[d] = sum(spent) + 2 * sum(
            newton_time(2 if "two" in name else 20, p.system.degree, p.system.intervals) for p in branch
        )
    assert times[None] < 2 * min(times.values()), times


@pytest.mark.parametrize("tolerance", [1e-6, 1e-9, 1e-12])
def test_errors_obey_the_tolerance(tolerance):
    """Bratu's fold, known from its closed form, on a run without error estimates: the mesh of the run alone decides."""
    mesh = MeshControl(tolerance=tolerance)
    start = solve(bratu(), [0, 0], mesh=mesh)
    fold = trace(start, free=["lam"], mesh=mesh, errors=False, max_points=20).labelled("LP")[0]
    assert fold.system.degree == 7 and abs(fold["lam"] - bratu_fold()) < tolerance


def test_a_degree_that_is_given_is_obeyed():
    at_four = solve(bratu(), [0, 0], {"lam": 1.0}, degree=4)
    assert at_four.system.degree == 4
    assert solve(bratu(), at_four).system.degree == 4  # that of the guess
    again = solve(bratu(), at_four, degree=6)
    assert again.system.degree == 6
    mean = at_four.system.states(at_four.x)[:, 0].max(), again.system.states(again.x)[:, 0].max()
    assert mean[0] == pytest.approx(mean[1], abs=1e-3)  # the largest value at nodes that are not the same ones
    assert trace(again, free=["lam"], max_points=4).points[-1].system.degree == 6
