"""Solvers of users for sparse matrices: all solves are theirs, and what is found does not depend on them."""

import gc
import weakref

import numpy as np
import pytest
import scipy.sparse as sp
from scipy.sparse.linalg import splu

from contin import AlgebraicProblem, ProblemError, solve, trace
from contin.linalg.matrices import DenseFactors, SparseFactors

#: Unknowns on a line, and on each side of a square: from 200 on the matrix is kept sparse.
LINE, SIDE = 220, 16


class Plain:
    """Factors that solve, and say nothing of the determinant; what is asked of them is counted."""

    made, solves = 0, {"N": 0, "T": 0}

    def __init__(self, matrix):
        assert sp.issparse(matrix) and matrix.format == "csc"
        Plain.made += 1
        self._lu = splu(matrix)

    def solve(self, b, trans):
        self.solves[trans] += 1
        return self._lu.solve(b, trans)


class Signed(Plain):
    """The same with the sign of the determinant, from a dense factorization."""

    def __init__(self, matrix):
        super().__init__(matrix)
        self.sign = DenseFactors(matrix.toarray()).sign


def line(u, p, out):
    """u'' + lam (u - u^3) with the ends held: branch points at lam = (2 sin(k pi h / 2) / h)^2."""
    out[:] = -2 * u + p[0] * (u - u**3) / (len(u) + 1) ** 2
    out[1:] += u[:-1]
    out[:-1] += u[1:]


def square():
    """The same on a square: modes (j, k) and (k, j) together."""
    second = sp.diags_array([1.0, -2.0, 1.0], offsets=[-1, 0, 1], shape=(SIDE, SIDE)) * (SIDE + 1) ** 2
    laplacian = sp.csr_array(sp.kron(second, sp.eye_array(SIDE)) + sp.kron(sp.eye_array(SIDE), second))

    def residual(u, p, out):
        out[:] = laplacian @ u + p[0] * (u - u**3)

    return residual


def load(k, n):
    return (2 * (n + 1) * np.sin(k * np.pi / 2 / (n + 1))) ** 2


def flat(residual, count, solver, high):
    problem = AlgebraicProblem(residual, count, {"lam": 5.0}, count=count, dynamics=False, solver=solver)
    return trace(solve(problem, np.zeros(count)), free=["lam"], limits={"lam": (5, high)})


@pytest.mark.sample(1)
@pytest.mark.parametrize("solver", [Plain, Signed, lambda matrix: splu(matrix, permc_spec="MMD_AT_PLUS_A")])
def test_branch_points_are_those_of_closed_forms(solver):
    """Also where the solver says no sign: singular values that pass zero are counted by solves alone."""
    before = Plain.made, dict(Plain.solves)
    branch = flat(line, LINE, solver, 100)
    assert [point["lam"] for point in branch.labelled("BP")] == pytest.approx([load(k, LINE) for k in (1, 2, 3)], rel=1e-9)
    assert not branch.notes
    buckled = trace(branch.labelled("BP")[0], branch=1, limits={"lam": (5, 40)})
    assert buckled.stop.reason == "limit" and len(buckled) > 5
    if isinstance(solver, type):
        assert Plain.made > before[0] and all(Plain.solves[kind] > before[1][kind] for kind in "NT")


@pytest.mark.full
@pytest.mark.parametrize("solver", [None, Plain])
def test_points_where_two_modes_become_singular(solver):
    branch = flat(square(), SIDE**2, solver, 60)
    single, double = branch.labelled("BP")
    assert single["lam"] == pytest.approx(2 * load(1, SIDE), rel=1e-9)
    assert double["lam"] == pytest.approx(load(1, SIDE) + load(2, SIDE), rel=1e-9)
    assert double.name == "kernel of dimension 2" and not branch.notes


@pytest.mark.full
def test_folds_are_passed_by_bordered_matrices():
    """Bratu's problem by finite differences; the matrix itself is singular at the fold."""

    def bratu(u, p, out):
        out[:] = -2 * u + p[0] * np.exp(u) / (len(u) + 1) ** 2
        out[1:] += u[:-1]
        out[:-1] += u[1:]

    folds = []
    for solver in (None, Plain):
        problem = AlgebraicProblem(bratu, LINE, {"lam": 0.0}, count=LINE, dynamics=False, solver=solver)
        branch = trace(solve(problem, np.zeros(LINE)), free=["lam"], limits={"lam": (0, 4)}, max_points=12)
        folds += [point["lam"] for point in branch.labelled("LP")]
    assert folds == pytest.approx([3.513830719125161] * 2, abs=10 / LINE**2) and folds[0] == pytest.approx(folds[1], rel=1e-11)


@pytest.mark.full
def test_eigenvalues_are_found_with_it():
    """Hopf points of a plate of oscillators (x' = mu x - y ..., diffusion): the first at mu = 0, others from 0.08 on."""

    def second(count):
        matrix = sp.diags_array([1.0, -2.0, 1.0], offsets=[-1, 0, 1], shape=(count, count)).tolil()
        matrix[0, 0] = matrix[-1, -1] = -1.0  # ends without flux: a mode without diffusion
        return matrix

    n, sides = 110, (10, 11)
    laplacian = sp.csr_array(sp.kronsum(second(sides[0]), second(sides[1])))

    def plate(u, p, out):
        x, y = u[:n], u[n:]
        out[:n] = laplacian @ x + p[0] * x - y - x * (x**2 + y**2)
        out[n:] = laplacian @ y + x + p[0] * y - y * (x**2 + y**2)

    before = Plain.made
    problem = AlgebraicProblem(plate, 2 * n, {"mu": -0.1}, count=2 * n, solver=Plain)
    branch = trace(solve(problem, np.zeros(2 * n)), free=["mu"], limits={"mu": (-0.1, 0.05)}, branch_points=False)
    (hopf,) = branch.labelled("HB")
    assert abs(hopf["mu"]) < 1e-9 and hopf.details["frequency"] == pytest.approx(1.0, rel=1e-9)
    assert Plain.made > before


def test_singular_matrices():
    class Refuses:
        def __init__(self, matrix):
            raise RuntimeError("singular")

    factors = SparseFactors(sp.eye_array(3).tocsr(), solver=Refuses)
    assert factors.sign == 0 and np.isnan(factors.solve(np.ones(3))).all()


@pytest.mark.full
def test_factors_of_points_that_were_left_are_freed_at_once(monkeypatch):
    """Without collecting cycles of references: those of a large problem fill the memory."""
    made = weakref.WeakSet()
    monkeypatch.setattr(
        SparseFactors, "__init__", lambda self, *given, _init=SparseFactors.__init__: (_init(self, *given), made.add(self))[0]
    )
    most = []
    gc.collect()
    gc.disable()
    try:
        problem = AlgebraicProblem(line, LINE, {"lam": 1.0}, count=LINE, dynamics=False)
        for _point in trace_points(solve(problem, np.zeros(LINE))):
            most.append(len(made))
    finally:
        gc.enable()
    assert len(most) > 8 and max(most) <= 6


def trace_points(start):
    from contin import Settings
    from contin.lowlevel import Continuation

    system, x = start.system.with_free(["lam"], start.x)
    return Continuation(system, x, Settings(limits={"lam": (1, 9)}, max_step=0.5))


@pytest.mark.parametrize("solver", [3, "splu"])
def test_a_solver_must_be_a_function(solver):
    with pytest.raises(ProblemError, match="solver: .* must be a function"):
        AlgebraicProblem(line, LINE, {"lam": 1.0}, count=LINE, solver=solver)
