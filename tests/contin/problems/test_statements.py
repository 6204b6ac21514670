"""Statements of problems: what is refused, in one sentence, when they are made."""

import math

import pytest

from contin import AlgebraicProblem, BoundaryValueProblem, ProblemError, solve


def rhs(t, u, p):
    return u.v, -u.u


def boundary(a, b, p):
    return a.u, b.u - p.k


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"states": ["u", "lambda"]}, "'lambda'"),
        ({"states": ["u", "u"]}, "twice"),
        ({"parameters": {"k": math.nan}}, "k = nan must be a finite number"),
        ({"parameters": {"k": "1"}}, "k = '1' must be a finite number"),
        ({"domain": (1.0, 0.0)}, "domain"),
        ({"states": ["u", "v", "w"]}, "rhs returns 2 values for the 3 states"),
        ({"rhs": lambda t, u: (u.v, u.u)}, "rhs takes 2 arguments, must take 3"),
        ({"rhs": lambda t, u, p: (u.v, p.absent)}, "rhs cannot be called: AttributeError"),
        ({"functionals": {"k": lambda t, u, p: u.u}}, "'k' stands twice"),
    ],
)
def test_a_bad_statement_is_refused_in_one_sentence(changes, said):
    statement = {"rhs": rhs, "boundary": boundary, "states": ["u", "v"], "parameters": {"k": 1.0}} | changes
    with pytest.raises(ProblemError, match=said) as error:
        BoundaryValueProblem(**statement)
    assert "\n" not in str(error.value)


def test_one_number_is_a_count_of_states():
    """A chain of n states, u_i = mu + i: written for arrays; the states are named u0, u1, ..."""

    def residual(u, p, out):
        for i in range(u.size):
            out[i] = u[i] - p[0] - i

    problem = AlgebraicProblem(residual, 5, {"mu": 0.0}, functionals={"sum": lambda u, p: u.u0 + u.u4})
    point = solve(problem, parameters={"mu": 2.0})
    assert point.x == pytest.approx([2, 3, 4, 5, 6], abs=1e-13)
    assert point["sum"] == pytest.approx(8)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"residual": lambda u: (u.x,)}, "residual takes 1 arguments, must take 2"),
        ({"residual": 3}, "residual: 3 must be a function"),
        ({"states": 0}, "states: 0 must be a whole number from 1"),
        ({"states": ["_x"]}, "states: '_x' is not usable as a name"),
        ({"dynamics": 1}, "dynamics: 1 must be True or False"),
        ({"functionals": {"f": 1.0}}, "functionals: f: 1.0 must be a function"),
    ],
)
def test_a_bad_algebraic_statement_is_refused_in_one_sentence(changes, said):
    statement = {"residual": lambda u, p: (u.x - p.k,), "states": ["x"], "parameters": {"k": 1.0}} | changes
    with pytest.raises(ProblemError, match=said) as error:
        AlgebraicProblem(**statement)
    assert "\n" not in str(error.value)


def test_a_functional_of_two_numbers_is_refused_when_it_is_compiled():
    algebraic = AlgebraicProblem(lambda u, p: (u.x - p.k,), ["x"], {"k": 1.0}, {"f": lambda u, p: (u.x, u.x)})
    with pytest.raises(ProblemError, match=r"functionals: each must be f\(u, p\) and return one number"):
        algebraic.batch("functionals")
    boundary_value = BoundaryValueProblem(rhs, boundary, ["u", "v"], {"k": 1.0}, functionals={"f": lambda t, u, p: (u.u, u.v)})
    with pytest.raises(ProblemError, match=r"functionals: each must be f\(t, u, p\) and return one number"):
        boundary_value.batch("functionals")
