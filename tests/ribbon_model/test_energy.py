"""The half loop derived from the energy alone, against the hand-reduced equations and the index of `ribbon_model.stability`."""

import numpy as np
import pytest
from half_loop_energy import variational_problem

import contin
from ribbon_model import exact
from ribbon_model.domains import CELL, HALF_LOOP, HALF_LOOP_BETWEEN_AXES
from ribbon_model.equilibrium import LENGTH
from ribbon_model.laws import FINITE_WIDTH, PAPER_LAWS, RIBBON
from ribbon_model.linear import thresholds
from ribbon_model.seeds import primary_branch
from ribbon_model.solution import Solution

NU = 0.3


def on_cells(law, m, n, limits, every):
    """Solutions on a primary branch, by the cell."""
    system, x, tangent = primary_branch(law, m, n, NU, 10, 7)
    points = contin.trace(
        contin.lowlevel.point_of(system, x), contin.Settings(trivial="M2", limits={"kappa_n": limits}), tangent=tangent
    ).points[1:-1]
    return [Solution.of(point) for point in points if not point.label][::every]


def spun(q, moment):
    """q (0, M), row by row."""
    (q0, q1, q2, q3), (m1, m2, m3) = q.T, moment.T
    return np.array([
        -q1 * m1 - q2 * m2 - q3 * m3, q0 * m1 + q2 * m3 - q3 * m2, q0 * m2 + q3 * m1 - q1 * m3, q0 * m3 + q1 * m2 - q2 * m1,
    ]).T  # fmt: skip


@pytest.mark.full
@pytest.mark.parametrize("law", PAPER_LAWS.values(), ids=list(PAPER_LAWS))
@pytest.mark.parametrize("domain", [HALF_LOOP, HALF_LOOP_BETWEEN_AXES], ids=str)
def test_the_energy_alone_gives_states_and_index(law, domain):
    """From a solution of the reduced equations Newton's method does not move; the index is that of the class that keeps all."""
    problem = variational_problem(law, domain)
    solutions = [*on_cells(law, 3, 1, (-40.0, 20.0), 6), *on_cells(law, 1, 2, (-5.0, 20.0), 9)]
    assert len(solutions) > 4
    for solution in solutions:
        half = solution.on(domain)
        values = {"kappa_n": half.parameters["kappa_n"], "nu": NU}
        mesh = half.t[:: half.degree] * LENGTH / 2
        mesh[-1] = problem.domain[1]
        system = contin.lowlevel.Collocation(problem, mesh, half.degree, problem.multipliers, values)
        momenta = spun(half.states[:, :4], half.loads()[0])
        guess = system.pack(
            np.hstack([half.states, 2 * momenta, 0 * half.states[:, 4:]]), dict.fromkeys(problem.multipliers, 0.0)
        )
        x = contin.lowlevel.correct(system, guess).x
        assert np.abs(system.states(x)[:, :7] - half.states).max() < 1e-7
        (kept,) = [entry for entry in half.index().classes if entry.name == (0, "even")]
        assert contin.lowlevel.point_of(system, x).second_variation().index() == kept.negative


@pytest.mark.full
def test_the_fold_of_the_paper_from_the_energy():
    """(1, 2): the circle's first bifurcation is that of the linear theory, the fold that of the quadrature."""
    problem = variational_problem(RIBBON, HALF_LOOP)

    def guess(t):
        return np.cos(t / 2), np.sin(t / 2), 0, 0, 0, np.cos(t) - 1, np.sin(t)

    circles = contin.trace(contin.solve(problem, guess, {"kappa_n": 2.4}), free=["kappa_n"], limits={"kappa_n": (2.4, 2.6)})
    (first,) = circles.labelled("BP")
    assert first["kappa_n"] == pytest.approx(2.5, abs=1e-10) and first.index_change == (0, 1)
    (fold,) = contin.trace(first, branch=1, limits={"kappa_n": (2, 5)}, max_points=24).labelled("LP")
    (known,) = exact.folds(1, 2, NU)
    assert fold["kappa_n"] == pytest.approx(known.kappa_n, abs=1e-10) and fold.index_change == (0, 1)


def test_what_has_no_such_statement():
    with pytest.raises(ValueError, match="domain 'cell'"):
        variational_problem(RIBBON, CELL)


@pytest.mark.full
def test_a_law_that_states_its_gradient():
    """Finite width: the circle's bifurcation is that of the linear theory ."""
    problem, Gamma = variational_problem(FINITE_WIDTH, HALF_LOOP), 10.0
    (threshold,) = thresholds(FINITE_WIDTH, 1, 2, {"nu": NU, "Gamma": Gamma})
    start = contin.solve(
        problem, lambda t: (np.cos(t / 2), np.sin(t / 2), 0, 0, 0, np.cos(t) - 1, np.sin(t)), {"kappa_n": 3.2, "Gamma": Gamma}
    )
    (first,) = contin.trace(start, free=["kappa_n"], limits={"kappa_n": (3.2, 3.5)}).labelled("BP")
    assert first["kappa_n"] == pytest.approx(threshold, abs=1e-10) and first.index_change == (0, 1)
