"""Angles of equilibria and of maps: whole rounds make no difference."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq, minimize_scalar

import contin

TWO_PI = 2 * math.pi


def pendulum():
    return contin.AlgebraicProblem(
        lambda u, p: (u.v, p.torque - math.sin(u.phi) - u.v), ["phi", "v"], {"torque": 0.0}, angles=["phi"]
    )


def test_a_branch_of_equilibria_closes_one_round_on():
    branch = contin.trace(contin.solve(pendulum(), [0.0, 0.0]), free=["torque"], limits={"torque": (-3, 3)})
    assert branch.stop.reason == "closed"
    assert [round(point["phi"] / math.pi, 9) for point in branch.points if point.label] == [0, 0.5, 1.5, 2]
    folds = contin.diagram(branch.points[0], limits={"torque": (-3, 3)})
    assert all(each.stop.reason == "closed" for each in folds.branches)


def test_solutions_one_round_on_are_known():
    problem = pendulum()
    down = contin.solve(problem, [0.0, 0.0])
    up = contin.solve(problem, [0.3, 0.0], others=[down])
    assert abs(math.cos(up["phi"]) + 1) < 1e-12
    with pytest.raises(contin.ConvergenceError, match="no further solution"):
        contin.solve(problem, [0.3, 0.0], others=[down, up])


@pytest.mark.full
def test_librations_know_the_angle():
    """From a Hopf point to the orbits that connect the saddle at -pi with itself, at pi, and back: two passes in a period."""

    def field(u, p):
        return u.v, -math.sin(u.phi) + u.v * (p.a - 1 + math.cos(u.phi))

    problem = contin.AlgebraicProblem(field, ["phi", "v"], {"a": -0.1}, angles=["phi"])
    (hopf,) = contin.trace(contin.solve(problem, [0.0, 0.0]), free=["a"], limits={"a": (-0.1, 0.1)}).labelled("HB")
    cycles = contin.trace(hopf, branch=1, limits={"a": (-1, 2), "period": (0, 30)}, errors=False)
    last = cycles.points[-1]
    assert last["winding_phi"] == 0 and 3 < last["max_phi"] < math.pi

    def apart(a):
        """How far the manifolds of both saddles are apart at phi = 0, by SciPy."""

        def at_rest(sign):
            def middle(t, u):
                return u[0]

            middle.terminal = True
            eigenvalue = (a - 2 + sign * math.sqrt((a - 2) ** 2 + 4)) / 2
            begin = [-sign * (math.pi - 1e-7), sign * 1e-7 * eigenvalue]
            options = {"method": "DOP853", "rtol": 1e-13, "atol": 1e-13, "events": middle}
            done = solve_ivp(
                lambda t, u: [u[1], -math.sin(u[0]) + u[1] * (a - 1 + math.cos(u[0]))], (0, 99 * sign), begin, **options
            )
            return done.y_events[0][0][1]

        return at_rest(1) - at_rest(-1)

    limit = brentq(apart, 0.6, 0.75, xtol=1e-12)
    assert abs(last.details["limit_a"] - limit) < last.details["limit_a_error"] < 1e-5
    whole = contin.trace(hopf, branch=1, limits={"a": (-1, 2)}, errors=False)
    assert abs(whole.points[-1]["a"] - limit) < 1e-9


def circle(u, p):
    return (u.x + p.w - p.k / TWO_PI * math.sin(TWO_PI * u.x),)


def circle_map():
    return contin.MapProblem(circle, ["x"], {"w": 0.5, "k": 0.9}, angles={"x": 1.0})


def edge(k):
    """The largest w with a cycle of two points that goes round once: w of each first point by SciPy, and its maximum."""

    def missed(w, x):
        for _ in range(2):
            x = x + w - k / TWO_PI * math.sin(TWO_PI * x)
        return x

    def shift(x):
        return brentq(lambda w: missed(w, x) - x - 1, 0.3, 0.7, xtol=1e-15)

    grid = np.linspace(0, 1, 41)
    best = grid[np.argmax([shift(x) for x in grid])]
    return -minimize_scalar(lambda x: -shift(x), bracket=(best - 0.025, best, best + 0.025), tol=1e-12).fun


def test_arnold_tongue_of_rotation_number_one_half():
    start = contin.solve(circle_map(), [0.3], {"rounds": 2})
    assert (start["rounds"], start["winding_x"]) == (2, 1)
    branch = contin.trace(start, free=["w"], limits={"w": (0, 1)})
    folds = branch.labelled("LP")
    assert branch.stop.reason == "closed" and len(folds) == 2
    assert abs(sum(fold["w"] for fold in folds) - 1) < 1e-12  # x -> -x
    upper = max(folds, key=lambda fold: fold["w"])
    assert abs(upper["w"] - edge(0.9)) < 1e-12
    tongue = contin.curve(upper, "k", limits={"k": (0.05, 0.9)}, zeros={"k": [0.2, 0.5]}, direction=-1)
    for point in tongue.labelled("UZ"):
        assert abs(point["w"] - edge(point["k"])) < 1e-12
    last = tongue.points[-1]
    assert abs((last["w"] - 0.5) / last["k"] ** 2 - math.pi / 8 / math.pi**2) < 1e-4  # w - 1/2 is about k^2 / (8 pi)


def test_points_of_a_cycle_may_be_given_on_the_circle():
    problem = circle_map()
    first = brentq(lambda x: 0.5 - 2 * x + 0.9 / TWO_PI * math.sin(TWO_PI * x), 0.2, 0.45, xtol=1e-15)  # f(x) = 1 - x
    for guess in ([0.3, 0.7], [0.3, 0.7 - 1], [5.3], [0.3, 0.7 + 3]):
        found = contin.solve(problem, guess, {"rounds": 2})
        assert found["winding_x"] == 1 and abs(found["x"] % 1 - first) < 1e-12


def test_doubled_cycles_go_round_twice():
    """The accelerator mode of the standard map: y gains a round in each iteration, where k sin(2 pi x) = 2 pi.

    Its multipliers become -1 at k cos(2 pi x) = -4. From y = 0, x gains one round first, and two more in the second iteration.
    """

    def standard(u, p):
        y = u.y + p.k / TWO_PI * math.sin(TWO_PI * u.x)
        return u.x + y, y

    problem = contin.MapProblem(standard, ["x", "y"], {"k": 7.0}, angles={"x": 1.0, "y": 1.0})
    start = contin.solve(problem, [0.5 - math.asin(TWO_PI / 7) / TWO_PI, 0.0])
    assert (start["winding_x"], start["winding_y"]) == (1, 1)
    branch = contin.trace(start, free=["k"], limits={"k": (6, 8)})
    (doubling,) = branch.labelled("PD")
    assert abs(doubling["k"] - math.sqrt(TWO_PI**2 + 16)) < 1e-12
    twice = contin.trace(doubling, branch=1, max_points=3).points[-1]
    assert (twice["rounds"], twice["winding_x"], twice["winding_y"]) == (2, 3, 2)


def test_what_is_no_angle_of_a_map():
    with pytest.raises(
        contin.ProblemError, match="angles: the map is not periodic in x; of its values, that of x changes by 0.5"
    ):
        contin.MapProblem(lambda u, p: (0.5 * u.x,), ["x"], {}, angles={"x": 1.0})
    with pytest.raises(contin.ProblemError, match="angles: the residual is not periodic in x"):
        contin.AlgebraicProblem(lambda u, p: (u.x,), ["x"], {}, angles=["x"])
    with pytest.raises(contin.ProblemError, match="winding_x is a parameter of every map by itself"):
        contin.MapProblem(circle, ["x"], {"w": 0.5, "k": 0.9, "winding_x": 1.0}, angles={"x": 1.0})
