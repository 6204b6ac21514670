"""One solution from a guess, and another one by deflation, against the closed form of Bratu's problem."""

import functools
import math

import numpy as np
import pytest

from bank.closed_forms import bratu, bratu_middles
from contin import AlgebraicProblem, BoundaryValueProblem, ConvergenceError, ProblemError, solve, trace


def middle(point):
    return point.system.evaluate(point.x, np.array([0.5]))[0, 0]


@functools.cache
def lower(lam=1.0, degree=8):
    return solve(bratu(), [0, 0], {"lam": lam}, degree=degree)


T = np.linspace(0, 1, 9)
GUESSES = {
    "numbers": (lambda: [0, 0], 0),
    "a function": (lambda: lambda t: (16 * t * (1 - t), 16 - 32 * t), 1),
    "arrays": (lambda: (T, np.stack([16 * T * (1 - T), 16 - 32 * T], axis=1)), 1),
    "a point": (lambda: lower(1.01), 0),
}


@pytest.mark.parametrize("guess", GUESSES)
def test_first_solutions(guess):
    """Guesses of every kind, near the lower solution at lam = 1 or near the upper one."""
    made, which = GUESSES[guess]
    point = solve(bratu(), made(), {"lam": 1.0}, degree=6)
    assert middle(point) == pytest.approx(bratu_middles(1.0)[which], abs=1e-10)


def test_a_point_as_a_guess_brings_its_parameters():
    again = solve(bratu(), lower(1.01), degree=6)
    assert again["lam"] == 1.01 and middle(again) == pytest.approx(bratu_middles(1.01)[0], abs=1e-10)


def test_eigenvalue_as_a_free_parameter():
    """u'' + w u = 0, u(0) = u(1) = 0, u'(0) = 1: w = pi^2, found along with u."""
    problem = BoundaryValueProblem(
        lambda t, u, p: (u.v, -p.w * u.u), lambda a, b, p: (a.u, b.u, a.v - 1), ["u", "v"], {"w": 8.0}
    )  # fmt: skip
    point = solve(problem, lambda t: (math.sin(3 * t) / 3, math.cos(3 * t)), free=["w"], degree=7)
    assert point["w"] == pytest.approx(math.pi**2, abs=1e-11)


@pytest.mark.parametrize(
    ("guess", "options", "said"),
    [
        ([0, 0, 0], {}, "must be the 2 states"),
        (None, {}, "needs one"),
        ((np.array([0.0, 0.5]), np.zeros((2, 2))), {}, "cover the domain"),
        ([0, math.nan], {}, "must be finite"),
        ([0, 0], {"free": ["lam"]}, "needs 0"),
        ([0, 0], {"parameters": {"mu": 1}}, "'mu' is not one of lam"),
        ([0, 0], {"degree": 9}, "degree: 9 must be a whole number from 2 to 8"),
        ([0, 0], {"others": [3]}, "others: 3 must be a Point"),
    ],
)
def test_bad_first_guesses(guess, options, said):
    with pytest.raises(ProblemError, match=said):
        solve(bratu(), guess, **options)


@pytest.mark.full
def test_where_newton_fails_the_sentence_says_what_helps():
    """Bratu's problem has no solution above lam = 3.5138; the advice works where it has one."""
    with pytest.raises(ConvergenceError, match="give a guess closer to a solution; if there may be none at lam = 5, solve at"):
        solve(bratu(), [0, 0], {"lam": 5.0})
    known = solve(bratu(), [0, 0], {"lam": 1.0})
    followed = trace(known, free=["lam"], zeros={"lam": [3.0]}, limits={"lam": (0, 4)}).labelled("UZ")
    assert [middle(point) for point in followed] == pytest.approx(bratu_middles(3.0), abs=1e-9)


# --- deflation ------------------------------------------------------------------------------------------------------


@pytest.mark.sample(4)
@pytest.mark.parametrize("lam", [1.0, 2.0, 3.0])
@pytest.mark.parametrize("guess", ([0, 0.1], [1, 0], [0.3, 0.1], None))
def test_deflation_from_many_guesses(lam, guess):
    """Also from the known solution itself (None); the value from the closed form, at a place between mesh points."""
    second = solve(bratu(), lower(lam) if guess is None else guess, {"lam": lam}, degree=8, others=[lower(lam)])
    assert middle(second) == pytest.approx(bratu_middles(lam)[1], abs=1e-8)


@pytest.mark.full
def test_where_all_solutions_are_known_there_is_no_further_one():
    first = lower(1.0, 6)
    second = solve(bratu(), [0, 0.1], {"lam": 1.0}, degree=6, others=[first])
    with pytest.raises(ConvergenceError, match="no further solution"):
        solve(bratu(), [0, 0.1], {"lam": 1.0}, degree=6, others=[first, second])


# --- solutions of any size -------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("a", "b", "k"), [(1e-9, 1e-9, 1e-9), (1e-9, 2e-9, 3e-9), (1e-6, 2e-9, 1e-12), (1e-9, 1e-9, 1e-15), (1e-12, 3e-12, 1e-10)]
)
def test_binding_equilibria_in_moles_per_litre(a, b, k):
    """c = 2 A B / (A + B + K + sqrt((A + B + K)^2 - 4 A B)), from several guesses and in two forms."""
    total = a + b + k
    c = 2 * a * b / (total + math.sqrt(total**2 - 4 * a * b))
    values = {"A": a, "B": b, "K": k}
    one = AlgebraicProblem(lambda u, p: ((p.A - u.c) * (p.B - u.c) - p.K * u.c,), ["c"], values)
    for guess in (0.0, min(a, b) / 2):
        assert solve(one, [guess])["c"] == pytest.approx(c, rel=1e-10, abs=0)
    three = AlgebraicProblem(lambda u, p: (u.a + u.c - p.A, u.b + u.c - p.B, u.a * u.b - p.K * u.c), ["a", "b", "c"], values)
    for guess in ([a, b, 0.0], [a / 2, b / 2, min(a, b) / 2]):
        assert solve(three, guess)["c"] == pytest.approx(c, rel=1e-10, abs=0)


@pytest.mark.parametrize("a", [1e-60, 1e-20, 1e-14, 1e-8, 1.0, 1e6])
@pytest.mark.parametrize("guess", [1.0, 1e-8])
def test_square_roots_of_any_size(a, guess):
    """x^2 = a is solved, or the call says that it is not."""
    problem = AlgebraicProblem(lambda u, p: (u.x**2 - p.a,), ["x"], {"a": a})
    try:
        assert solve(problem, [guess])["x"] == pytest.approx(math.sqrt(a), rel=1e-10, abs=0)
    except ConvergenceError:
        assert a > 1 or guess < math.sqrt(a)


@pytest.mark.sample(1)
@pytest.mark.parametrize("a", [-1e-60, -1e-30])
def test_what_has_no_root_is_not_solved(a):
    problem = AlgebraicProblem(lambda u, p: (u.x**2 - p.a,), ["x"], {"a": a})
    for guess in (1.0, 1e-8, 1e-30):
        with pytest.raises(ConvergenceError):
            solve(problem, [guess])


def test_the_fold_of_a_small_root():
    """x^2 = a from a = 1e-60: the branch turns at a = 0."""
    problem = AlgebraicProblem(lambda u, p: (u.x**2 - p.a,), ["x"], {"a": 1e-60})
    branch = trace(solve(problem, [1e-30]), free=["a"], direction=-1, limits={"a": (-1e-60, 2e-60)})
    assert [point.label for point in branch if point.label] == ["EP", "LP", "EP"]
    assert abs(branch.labelled("LP")[0]["a"]) < 1e-72 and branch.points[-1]["x"] == pytest.approx(-math.sqrt(2e-60), rel=1e-10)


def test_a_small_reaction_and_diffusion():
    """u'' = u^2 / s - q between zeros, with u and q of size 1e-9: s times the solution for s = q = 1."""
    problem = BoundaryValueProblem(
        lambda t, u, p: (u.v, u.u**2 / p.s - p.q), lambda a, b, p: (a.u, b.u), ["u", "v"], {"q": 1.0, "s": 1.0}
    )
    usual, small = solve(problem, [0, 0]), solve(problem, [0, 0], {"q": 1e-9, "s": 1e-9})
    times = np.linspace(0, 1, 11)
    expected = usual.system.evaluate(usual.x, times)
    assert small.system.evaluate(small.x, times) / 1e-9 == pytest.approx(expected, rel=1e-7, abs=1e-9)


def test_a_state_that_is_zero_has_no_size():
    """From a guess beside it, too: y = 0, z = x - 1 = 0."""
    problem = AlgebraicProblem(lambda u, p: (u.x**3 - p.a, u.y + u.y**2, u.z - u.x + 1), ["x", "y", "z"], {"a": 1.0})
    found = solve(problem, [1.2, 0.1, 0.3])
    assert abs(found["y"]) < 1e-20 and abs(found["z"]) < 1e-15
