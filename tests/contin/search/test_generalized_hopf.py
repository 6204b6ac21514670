"""A generalized Hopf point of functions that are no polynomials, against 30 digits of the definition."""

import itertools

import mpmath
import numpy as np
import pytest

import contin
from contin import AlgebraicProblem


def morris_lecar(u, p, library=np):
    """Morris & Lecar (1981), the constants of Rinzel & Ermentrout (1989)."""
    m = (1 + library.tanh((u[0] + p.v1) / 18)) / 2
    w = (1 + library.tanh((u[0] - 2) / 30)) / 2
    rate = p.rate * library.cosh((u[0] - 2) / 60)
    return (p.current - p.g * m * (u[0] - 120) - 8 * u[1] * (u[0] + 84) - 2 * (u[0] + 60)) / 20, rate * (w - u[1])


class Values:
    v1, rate, g = mpmath.mpf("1.2"), mpmath.mpf("0.04"), mpmath.mpf("4.4")


def trace_and_coefficient(v, rate):
    """Return the trace of the Jacobian, and the first Lyapunov coefficient, at the equilibrium with this v."""
    p = Values()
    p.rate, p.current = rate, mpmath.mpf(0)
    w = (1 + mpmath.tanh((v - 2) / 30)) / 2
    p.current = -20 * morris_lecar((v, w), p, mpmath)[0]

    def part(row, *order):
        return mpmath.diff(lambda a, b: morris_lecar((a, b), p, mpmath)[row], (v, w), order)

    orders = [order for order in itertools.product(range(4), repeat=2) if 0 < sum(order) < 4]
    tables = {order: [part(row, *order) for row in (0, 1)] for order in orders}

    def form(*vectors):
        return mpmath.matrix([
            sum(
                mpmath.fprod(vector[at] for vector, at in zip(vectors, places)) * tables[places.count(0), places.count(1)][row]
                for places in itertools.product((0, 1), repeat=len(vectors))
            )
            for row in (0, 1)
        ])  # fmt: skip

    A = mpmath.matrix([[tables[1, 0][row], tables[0, 1][row]] for row in (0, 1)])
    omega = mpmath.sqrt(A[0, 0] * A[1, 1] - A[0, 1] * A[1, 0])
    q = mpmath.matrix([A[0, 1], 1j * omega - A[0, 0]])
    q = q / mpmath.norm(q)
    left = mpmath.matrix([A[1, 0], 1j * omega - A[0, 0]])
    left = left / (left.T * q)[0]
    bar = mpmath.matrix([mpmath.conj(each) for each in q])
    constant = mpmath.lu_solve(A, form(q, bar))
    twice = mpmath.lu_solve(2j * omega * mpmath.eye(2) - A, form(q, q))
    total = form(q, q, bar) - 2 * form(q, constant) + form(bar, twice)
    return A[0, 0] + A[1, 1], mpmath.re((left.T * total)[0]) / (2 * omega)


@pytest.mark.full
def test_generalized_hopf_point_of_morris_lecar():
    problem = AlgebraicProblem(morris_lecar, ["v", "w"], {"current": 0.0, "rate": 0.04, "g": 4.4, "v1": 1.2})
    branch = contin.trace(contin.solve(problem, [-60.0, 0.0]), free=["current"], limits={"current": (-10, 300)})
    (_, hopf) = branch.labelled("HB")
    found = contin.curve(hopf, "rate", limits={"rate": (0.005, 0.4), "current": (0, 300)})
    assert len(found.labelled("GH")) == 2
    for point in found.labelled("GH"):
        with mpmath.workdps(30):
            v, rate = mpmath.findroot(trace_and_coefficient, (point.x[0], point["rate"]))
        assert point["rate"] == pytest.approx(float(rate), abs=1e-12)
        assert point.x[0] == pytest.approx(float(v), abs=2e-11)
    with mpmath.workdps(30):
        coefficient = trace_and_coefficient(mpmath.mpf(hopf.x[0]), mpmath.mpf("0.04"))[1]
    assert hopf.normal_form == pytest.approx(float(coefficient), rel=1e-12)
