"""Guesses from which Newton's method alone does not converge: each cause by two problems, with a closed form or the message."""

import itertools
import math

import numpy as np
import pytest

from contin import (
    AlgebraicProblem,
    BoundaryValueProblem,
    ConnectionProblem,
    ConvergenceError,
    CycleProblem,
    MapProblem,
    ProblemError,
    Segment,
    SegmentedProblem,
    solve,
    trace,
)  # fmt: skip
from contin.functions import round_off


def message(*given, error=ProblemError, **more):
    with pytest.raises(error) as caught:
        solve(*given, **more)
    return str(caught.value)


def at(point, t):
    return point.system.evaluate(point.x, np.array([t]))[0]


# --- the solution is a fold or a branch point ----------------------------------------------------------------------------


@pytest.mark.parametrize("guess", [0.0, 0.1])
def test_a_saddle_node_of_a_map(guess):
    """x -> x + c - x^2 at c = 0: two fixed points sqrt(c) and -sqrt(c) meet."""
    start = solve(MapProblem(lambda u, p: (u.x + p.c - u.x**2,), ["x"], {"c": 0.0}), [guess])
    assert start.label == "LP" and abs(start["x"]) <= max(start.newton_error, 1e-15)
    for way in (1, -1):
        end = trace(start, free=["c"], limits={"c": (-1, 1)}, direction=way)[-1]
        assert (end["c"], abs(end["x"])) == pytest.approx((1, 1), abs=1e-9)


def test_an_aircraft_at_trim():
    """Angle of attack a and rate of pitch q without elevator, where the centre of pressure passes the centre of mass:
    a pitchfork. Beyond it a^2 = k - 1.
    """

    def flight(u, p):
        return u.q - u.a, p.k * u.a - u.a**3 - u.q + p.elevator

    start = solve(AlgebraicProblem(flight, ["a", "q"], {"k": 1.0, "elevator": 0.0}), [0.0, 0.0])
    assert start.label == "BP" and [start["a"], start["q"]] == pytest.approx([0, 0], abs=start.newton_error + 1e-15)
    along = trace(start, free=["elevator"], limits={"elevator": (-1, 1)})
    assert along[-1]["a"] ** 3 == pytest.approx(along[-1]["elevator"], abs=1e-9)
    ends = [trace(start, free=["k"], branch=branch, limits={"k": (0, 2)})[-1] for branch in (0, 1)]
    assert sorted((end["k"], end["a"] ** 2) for end in ends) == [pytest.approx(pair, abs=1e-9) for pair in ((2, 0), (2, 1))]


def test_a_column_at_its_critical_load():
    """Euler's load: the straight column is a solution, and more than one."""
    column = BoundaryValueProblem(
        lambda t, u, p: (u.m, -p.load * np.sin(u.angle)), lambda a, b, p: (a.m, b.m), ["angle", "m"], {"load": math.pi**2}
    )
    start = solve(column, [0.0, 0.0])
    assert start.label == "BP" and not start.x.any()
    assert len(trace(start, free=["load"], limits={"load": (9, 12)}).labelled("BP")) <= 1


def test_a_double_root_is_as_good_as_round_off_lets_it_be():
    """sin(x) / x = 1: from .3, round-off of F ends the iteration 1e-8 beside 0."""
    point = solve(AlgebraicProblem(lambda u, p: (np.sin(u.x) / u.x - p.a,), ["x"], {"a": 1.0}), [0.3])
    assert point.label == "LP" and 0 < abs(point["x"]) <= point.newton_error < 1e-6


def test_terms_that_cancel_at_a_solution():
    """(1 - cos x) / x and (sin x - x + x^3 / 6) / x^4 are zero at 0 only, computed ones in its neighbourhood."""
    for law in (lambda x: (1 - np.cos(x)) / x, lambda x: (np.sin(x) - x + x**3 / 6) / x**4):
        point = solve(AlgebraicProblem(lambda u, p, law=law: (law(u.x + 1),), ["x"], {"a": 1.0}), [-0.9])
        assert 0 < abs(point["x"] + 1) <= point.newton_error


# --- 0 / 0 ---------------------------------------------------------------------------------------------------------------


def central(u, p):
    r = np.sqrt(u.x**2 + u.y**2)
    return np.tanh(r) * u.x / r - p.a * u.y, np.tanh(r) * u.y / r + p.a * u.x


def series(u, p):
    """The same, as the message says."""
    q = u.x**2 + u.y**2
    quotient = np.where(q > 1e-6, np.tanh(np.sqrt(q)) / np.sqrt(q), 1 - q / 3)
    return quotient * u.x - p.a * u.y, quotient * u.y + p.a * u.x


@pytest.mark.skipif(round_off.SEED, reason="the solution is 1e-48, not 0, where values are moved")
@pytest.mark.parametrize("guess", [[0.3, 0.2], [0.0, 0.0]])
def test_a_central_force(guess):
    """It holds a body at its centre, where x / r is 0 / 0."""
    error = ProblemError if guess[0] else ConvergenceError
    text = message(AlgebraicProblem(central, ["x", "y"], {"a": 1.0}), guess, error=error)
    assert ("solution" if guess[0] else "guess") in text
    assert (": 0 / 0 is not finite at x = 0, y = 0, a = 1 (np.tanh(r) * u.x / r, line ") in text
    assert "test_failure.py" in text and "write its limit, as np.where(" in text
    assert solve(AlgebraicProblem(series, ["x", "y"], {"a": 1.0}), guess).x == pytest.approx([0, 0], abs=1e-12)


def test_the_root_of_a_square():
    """|x + 1| as a root has no derivative at the solution."""
    equation = AlgebraicProblem(lambda u, p: (np.sqrt(u.x**2 + 2 * u.x + 1) + 2 * (u.x + 1) * p.a,), ["x"], {"a": 1.0})
    text = message(equation, [-0.9], error=ConvergenceError)
    assert "sqrt(0) has no finite derivative at x = -1" in text and "as abs(z) for sqrt(z**2)" in text


# --- conditions that follow from others ----------------------------------------------------------------------------------


def no_flux(f, fixed=False, both=False):
    """u'' = f cos(pi t) - g with u' = 0 at both ends, or with u = 0 at the first."""

    def ends(a, b, p):
        return (a.flux, b.flux, a.u) if both else (a.flux, a.u if fixed else b.flux)

    return BoundaryValueProblem(
        lambda t, u, p: (u.flux, p.f * np.cos(math.pi * t) - p.g), ends, ["u", "flux"], {"f": f, "g": 0.0}
    )


def test_a_sum_that_no_flux_leaves_open():
    """A constant may be added: as the message says, u is held. With a source, free it."""
    text = message(no_flux(1.0), [0.0, 0.0])
    assert "boundary condition 2 follows from the others and the equations, and u is not determined" in text
    assert "put a condition on u at the first end in its place" in text
    held = solve(no_flux(1.0, fixed=True), [0.0, 0.0])
    assert at(held, 1.0)[0] == pytest.approx(2 / math.pi**2, abs=1e-12)
    text = message(no_flux(1.0), [0.0, 0.0], {"g": 0.5})
    assert "contradicts the others and the equations, so there is no solution" in text and "or add it and free g" in text
    assert solve(no_flux(1.0, both=True), [0.0, 0.0], {"g": 0.5}, free=["g"])["g"] == pytest.approx(0, abs=1e-12)


@pytest.mark.parametrize("factors", list(itertools.product([1e-9, 1e9], repeat=4)))
def test_units_decide_nothing(factors):
    """The same with u, the flux and both conditions multiplied by anything: an open sum is found, a held u never doubted."""
    u_unit, flux_unit, *of_conditions = factors

    def stated(held):
        def ends(a, b, p):
            return of_conditions[0] * a.flux / flux_unit, of_conditions[1] * (a.u / u_unit if held else b.flux / flux_unit)

        return BoundaryValueProblem(
            lambda t, u, p: (u_unit * u.flux / flux_unit, flux_unit * math.cos(math.pi * t)), ends, ["u", "flux"], {"f": 1.0}
        )

    assert at(solve(stated(True), [0.0, 0.0]), 1.0)[0] / u_unit == pytest.approx(2 / math.pi**2, abs=1e-12)
    assert "follows from the others and the equations, and u is not determined" in message(stated(False), [0.0, 0.0])


def test_a_free_beam():
    """A beam under a load that is in balance moves and turns as a whole; under another one there is no state of rest."""

    def beam(fixed):
        return BoundaryValueProblem(
            lambda t, u, p: (u.slope, u.moment, u.shear, p.q * np.cos(4 * math.pi * t)),
            lambda a, b, p: (a.moment, a.shear, *((a.w, a.slope) if fixed else (b.moment, b.shear))),
            ["w", "slope", "moment", "shear"], {"q": 1.0},
        )  # fmt: skip

    text = message(beam(False), [0.0] * 4)
    assert "boundary condition 3, boundary condition 4 follow from" in text and "w, slope are not determined" in text
    assert "put conditions on w at the first end, slope at the first end in their place" in text
    k = 4 * math.pi  # w'''' = cos(k t), w = w' = w'' = w''' = 0 at t = 0: w = (cos(k t) - 1 + (k t)^2 / 2) / k^4
    assert at(solve(beam(True), [0.0] * 4), 1.0)[0] == pytest.approx(1 / (2 * k**2), abs=1e-12)


def test_a_total_that_reaction_and_diffusion_conserve():
    def rhs(t, u, p):
        reaction = u.a - u.b**2
        return u.ja, reaction, u.jb, -reaction

    closed = BoundaryValueProblem(rhs, lambda a, b, p: (a.ja, b.ja, a.jb, b.jb), ["a", "ja", "b", "jb"], {"f": 1.0})
    text = message(closed, lambda t: (1 + 0.2 * np.cos(3 * t), 0.0, 1.0, 0.0))
    assert "boundary condition 4 follows" in text and "a, b are not determined" in text


def test_a_cycle_as_a_boundary_value_problem():
    oscillator = BoundaryValueProblem(
        lambda t, u, p: (p.T * u.y, p.T * ((1 - u.x**2) * u.y - u.x)), lambda a, b, p: (a.x - b.x, a.y - b.y), ["x", "y"],
        {"T": 6.663286859},
    )  # fmt: skip
    text = message(oscillator, lambda t: (2 * math.cos(2 * math.pi * t), -2 * math.sin(2 * math.pi * t)))
    assert "may be shifted along t" in text and "CycleProblem" in text


# --- jumps that a costate decides ----------------------------------------------------------------------------------------


def bang_off_bang(t, u, p):
    control = np.where(u.l2 > 1, -1.0, np.where(u.l2 < -1, 1.0, 0.0))
    return u.v, control, 0 * u.l1, -u.l1


def smooth(t, u, p):
    """The same, as the message says."""
    control = -(np.tanh((u.l2 - 1) / p.eps) + np.tanh((u.l2 + 1) / p.eps)) / 2
    return u.v, control, 0 * u.l1, -u.l1


def moved(rhs):
    """From rest at 0 to rest at 1 in a time of 2.5, with the least fuel: full thrust up to s = 1 / 2, s (2.5 - s) = 1."""
    states = ["x", "v", "l1", "l2"]
    return BoundaryValueProblem(rhs, lambda a, b, p: (a.x, a.v, b.x - 1, b.v), states, {"eps": 1.0}, domain=(0, 2.5))


def test_bang_off_bang():
    """Without a jump along the guess, its line is named, and the advice leads near: the speed between the thrusts is 1 / 2."""
    assert at(solve(moved(bang_off_bang), lambda t: (0, 0, -2, -2 + 2 * t)), 1.25)[1] == pytest.approx(0.5, abs=1e-12)
    text = message(moved(bang_off_bang), lambda t: (0, 0, -0.1, -0.1 + 0.1 * t))
    assert text.startswith("rhs: l1, l2 act by a jump only (u.l2 > 1, line ")
    start = solve(moved(smooth), lambda t: (0.4 * t, 0.4, -2, -2 + 2 * t))
    end = trace(start, free=["eps"], limits={"eps": (0.05, 1.0)}, direction=-1)[-1]
    assert end["eps"] == 0.05 and at(end, 1.25)[1] == pytest.approx(0.5, abs=0.01)


def test_a_time_that_is_least():
    def rhs(t, u, p):
        return p.T * u.v, -p.T * np.sign(u.l2), 0 * u.l1, -p.T * u.l1

    def ends(a, b, p):
        return a.x, a.v, b.x - 1, b.v, a.l1 + 1

    fastest = BoundaryValueProblem(rhs, ends, ["x", "v", "l1", "l2"], {"T": 1.5})
    assert solve(fastest, lambda t: (t, 0, -1, -0.8 + 1.6 * t), free=["T"])["T"] == pytest.approx(2, abs=1e-12)
    text = message(fastest, lambda t: (t, 0, -1, -2.0), free=["T"])
    assert "l2 acts by a jump only (np.sign(u.l2)" in text and "tanh(z / eps) for sign(z)" in text


def test_segments_have_the_same_causes():
    """Two layers without a flux at the ends; with heat made in one, u = s^2 / 2 from 0 to s = 1 / 4. A jump in one of two."""

    def layers(source, first, last):
        def rhs(s, u, p):
            return u.slope, source

        parts = [Segment(rhs, ["heat", "slope"], length=0.25), Segment(lambda s, u, p: (u.slope, 0.0), ["heat", "slope"])]
        joint = lambda a, b, p: (first(a), b[0].heat - a[1].heat, b[0].slope - a[1].slope, last(a, b))  # noqa: E731
        return SegmentedProblem(parts, joint, {})

    text = message(layers(0.0, lambda a: a[0].slope, lambda a, b: b[1].slope), [0.0] * 4)
    assert "boundary condition 4 follows from the others" in text and "put a condition on heat_0 at the first end" in text
    text = message(layers(0.0, lambda a: a[0].slope, lambda a, b: b[0].heat - a[1].heat), [0.0] * 4)
    assert "boundary condition 4 follows from the others" in text
    found = solve(layers(1.0, lambda a: a[0].slope, lambda a, b: a[0].heat), [0.0] * 4)
    assert found.segment(1)["heat"][-1] == pytest.approx(0.25**2 / 2 + 0.25, abs=1e-12)

    jumps = Segment(lambda s, u, p: (u.v, -1.0 if u.l > 0 else 1.0, 0.0), ["x", "v", "l"])
    rests = Segment(lambda s, u, p: (u.v, 0.0), ["x", "v"])
    problem = SegmentedProblem(
        [jumps, rests], lambda a, b, p: (a[0].x, a[0].v, b[0].x - a[1].x, b[0].v - a[1].v, b[1].x - 0.2), {}
    )
    assert "l acts by a jump only (u.l > 0, line " in message(problem, [0, 0, 0.1, 0, 0])


def test_a_family_of_cycles():
    """A pendulum: the advice leads to a cycle. One of no size is none."""
    swing = lambda u, p: (u.v, -math.sin(u.x) - p.damping * u.v)  # noqa: E731
    problem = CycleProblem(swing, ["x", "v"], {"damping": 0.0})
    guess = lambda t: (math.cos(2 * math.pi * t), -math.sin(2 * math.pi * t))  # noqa: E731
    text = message(problem, guess, {"period": 6.7})
    assert "one of a family at the same parameters" in text and 'free "damping", which breaks it, in place of period' in text
    found = solve(problem, guess, {"period": 6.7}, free=["damping"])
    assert abs(found["damping"]) < 1e-12 and found["period"] == 6.7 and found["max_x"] > 0.9
    assert "one of a family" in message(problem, guess, {"period": 6.3})  # where Newton's method leads to an equilibrium

    def spiral(u, p):
        return p.m * u.x - u.y - u.x * (u.x**2 + u.y**2), u.x + p.m * u.y - u.y * (u.x**2 + u.y**2)

    decaying = CycleProblem(spiral, ["x", "y"], {"m": -0.1})
    circle = lambda t: (0.1 * math.cos(2 * math.pi * t), 0.1 * math.sin(2 * math.pi * t))  # noqa: E731
    text = message(decaying, circle, {"period": 6.3}, error=ConvergenceError)
    assert "the guess leads to the equilibrium x = " in text and "a larger one" in text


def test_a_front_whose_speed_does_not_enter():
    """The free parameter is named; where the field is not finite at the equilibrium, the operation and its line are."""

    def front(field):
        return ConnectionProblem(field, ["u", "v"], {"a": 0.25, "c": 0.3}, unstable=1, stable=1)

    def guess(t):
        s = math.tanh(20 * (t - 0.5) / math.sqrt(8))
        return (1 + s) / 2, (1 - s**2) / math.sqrt(32)

    def force(u, p):
        return u.u * (1 - u.u) * (u.u - p.a)

    given = guess, {"time": 40, "to_u": 1}
    assert "free: c changes nothing" in message(front(lambda u, p: (u.v, 0.3 * u.v - force(u, p))), *given, free=["c"])
    rough = front(lambda u, p: (u.v, p.c * u.v - force(u, p) * np.sqrt(u.u)))
    text = message(rough, *given, free=["c"], error=ConvergenceError)
    assert "sqrt(0) has no finite derivative at u = 0" in text and "(np.sqrt(u.u), line " in text


# --- outside of the domain -----------------------------------------------------------------------------------------------


def test_the_steps_stay_in_the_domain():
    """Full steps lead to logarithms and roots of negative numbers."""
    logarithm = AlgebraicProblem(lambda u, p: (np.log(u.x) + p.a,), ["x"], {"a": 3.0})
    for guess in (5.0, 0.0):
        assert solve(logarithm, [guess])["x"] == pytest.approx(math.exp(-3), rel=1e-12)
    tanks = AlgebraicProblem(lambda u, p: (p.q - np.sqrt(u.a - u.b), np.sqrt(u.a - u.b) - np.sqrt(u.b)), ["a", "b"], {"q": 0.3})
    assert solve(tanks, [5.0, 4.9]).x == pytest.approx([0.18, 0.09], abs=1e-12)


def test_a_table_that_raises_outside_of_its_range():
    """It is called where it has values; where no solution is found, the message says what it raised, and where."""

    def table(x):
        if not 2 <= x <= 9:
            raise ValueError("no entry below 2 or above 9")
        return x * x

    for count in (1, 2):
        problem = AlgebraicProblem(lambda u, p, n=count: (table(u.x) - p.a, u[-1] - u.x)[:n], ["x", "y"][:count], {"a": 9.0})
        assert solve(problem, [4.0] * count)["x"] == pytest.approx(3, abs=1e-12)
        text = message(problem, [40.0] * count, error=ConvergenceError)
        assert "raises 'no entry below 2 or above 9' at x = 40" in text
    with pytest.raises(ProblemError, match="residual cannot be called: KeyError: 'b'"):
        solve(AlgebraicProblem(lambda u, p: (u.x - {"a": 1.0}["b"],), ["x"], {"a": 9.0}), [4.0])
