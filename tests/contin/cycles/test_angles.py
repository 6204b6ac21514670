"""Angles: cycles that close up to whole rounds, against closed forms, elliptic integrals and shooting with SciPy's DOP853."""

import functools
import math
import re

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq, fsolve
from scipy.special import ellipk

import contin

TWO_PI = 2 * math.pi


def junction(u, p):
    """A Josephson junction: beta phi" + phi' + sin phi = current."""
    return u.v, (p.current - u.v - math.sin(u.phi)) / p.beta


def josephson(**options):
    return contin.CycleProblem(junction, ["phi", "v"], {"current": 1.5, "beta": 2.0}, angles=["phi"], **options)


@functools.cache
def running():
    """The running solution of the junction, and its branch down to the homoclinic orbit."""
    start = contin.cycle(josephson(), [0.0, 3.0])
    return start, contin.trace(start, free=["current"], direction=-1, limits={"current": (0, 5)})


def of_junction(current, beta):
    return lambda t, u: [u[1], (current - u[1] - math.sin(u[0])) / beta]


def one_round(field, v, **options):
    """Return the time and the rate at which a motion from the angle 0 has gone round once."""
    return until(field, v, TWO_PI, **options)


def until(field, v, angle, **options):
    """Return the time and the rate at which a motion from the angle 0 reaches an angle."""

    def round_(t, u):
        return u[0] - angle

    round_.terminal, round_.direction = True, 1
    done = solve_ivp(field, (0, 1e3), [0.0, v], method="DOP853", rtol=1e-13, atol=1e-13, events=round_, **options)
    return done.t_events[0][0], done.y_events[0][0][1]


def test_running_solution_of_a_junction():
    start, _ = running()
    field = of_junction(1.5, 2.0)
    v = brentq(lambda v: one_round(field, v)[1] - v, 1.0, 2.0, xtol=1e-14)
    assert start["winding_phi"] == 1
    assert abs(start["period"] - one_round(field, v)[0]) < 1e-9
    angle, rate = start.system.states(start.x)[0]  # at a mesh point, where collocation is most exact
    assert abs(rate - until(field, v, angle % TWO_PI)[1]) < 1e-11
    assert (start["max_phi"], start["min_phi"]) == (math.pi, -math.pi)
    logarithms = start.floquet().logarithms  # Liouville: the divergence is -1 / beta
    assert abs(logarithms.real.sum() + start["period"] / 2) < 1e-9


def apart_of_manifolds(current, beta):
    """Return how far the stable and the unstable manifold of the saddle are apart at half a round, in v."""
    place = math.pi - math.asin(current)

    def at_half(sign):
        """The unstable manifold, forwards, or the stable one of the saddle one round on, backwards."""
        eigenvalue = (-1 + sign * math.sqrt(1 - 4 * beta * math.cos(place))) / (2 * beta)

        def half(t, u):
            return u[0] - place - math.pi

        half.terminal = True
        small = 1e-7
        begin = [place + small, small * eigenvalue] if sign > 0 else [place + TWO_PI - small, -small * eigenvalue]
        field = of_junction(current, beta)
        span = (0, 200 * sign)
        done = solve_ivp(field, span, begin, method="DOP853", rtol=1e-13, atol=1e-13, events=half)
        return done.y_events[0][0][1]

    return at_half(1) - at_half(-1)


@pytest.mark.full
def test_running_solutions_end_at_an_orbit_that_is_homoclinic_on_the_circle():
    _, branch = running()
    last = branch.points[-1]
    assert "homoclinic orbit" in branch.stop.message
    limit = brentq(lambda current: apart_of_manifolds(current, 2.0), 0.77, 0.81, xtol=1e-13)
    assert abs(last["current"] - limit) < 1e-9
    orbit = contin.homoclinic(last, free=["current"])
    assert abs(orbit["current"] - limit) < 1e-9
    assert orbit["winding_phi"] == 1 and abs(math.remainder(orbit["from_phi"] - math.pi + math.asin(limit), TWO_PI)) < 1e-8
    ends = contin.trace(orbit, free=["current", "beta"], zeros={"beta": [3]}, limits={"beta": (1.9, 3.1)}, direction=-1)
    (there,) = ends.labelled("UZ")
    assert abs(there["current"] - brentq(lambda current: apart_of_manifolds(current, 3.0), 0.66, 0.69, xtol=1e-13)) < 1e-8


def test_the_homoclinic_orbit_is_found_from_a_guess():
    first = contin.homoclinic(running()[1].points[-1], free=["current"])
    problem = contin.ConnectionProblem(junction, ["phi", "v"], {"current": 0.9, "beta": 2.0}, unstable=1, angles=["phi"])
    again = contin.solve(problem, first, {"current": first["current"]}, free=["current"])
    assert again["winding_phi"] == 1 and abs(again["current"] - first["current"]) < 1e-10


@pytest.mark.full
def test_the_homoclinic_orbit_is_grown_from_its_saddle():
    """The orbit comes back to the saddle one round further on; shooting along its manifolds as above."""
    rest = contin.AlgebraicProblem(junction, ["phi", "v"], {"current": 0.6, "beta": 2.0}, angles=["phi"])
    saddle = contin.solve(rest, [np.pi - 0.6, 0.0])
    orbit = contin.homoclinic(saddle, free=["current"], limits={"current": (0.5, 0.95)})
    assert orbit["winding_phi"] == 1
    longer = contin.trace(orbit, free=["time", "current"], limits={"time": (0, 40)}).points[-1]
    known = brentq(lambda current: apart_of_manifolds(current, 2.0), 0.77, 0.81, xtol=1e-13)
    assert longer["current"] == pytest.approx(known, abs=1e-9)


def pendulum(u, p):
    return u.v, -math.sin(u.phi) - p.damping * u.v


def test_rotations_of_a_pendulum():
    """E = v^2 / 2 - cos phi; the period of a rotation is 2 k K(k^2) with k^2 = 2 / (1 + E)."""
    energy = {"energy": lambda u, p: u.v**2 / 2 - math.cos(u.phi)}
    problem = contin.CycleProblem(pendulum, ["phi", "v"], {"damping": 0.0}, functionals=energy, angles=["phi"])
    start = contin.solve(problem, lambda t: (TWO_PI * t, 2.5), {"period": 2.5}, free=["damping"])
    family = contin.trace(start, free=["damping", "period"], primary="period", limits={"period": (1, 12)})
    assert family.points[-1]["period"] == pytest.approx(12, rel=1e-15) and len(family.points) > 5
    for point in family.points:
        square = 2 / (1 + point["energy"])
        assert abs(point["period"] - 2 * math.sqrt(square) * ellipk(square)) < 1e-9 * point["period"] ** 3
        assert abs(point["damping"]) < 1e-12


def forced(t, u, p):
    return u.v, -math.sin(u.phi) - p.c * u.v + p.a * math.cos(p.w * t)


def forced_pendulum():
    parameters = {"c": 0.5, "a": 1.4, "w": 2 / 3}
    return contin.CycleProblem(forced, ["phi", "v"], parameters, period=lambda p: TWO_PI / p.w, angles=["phi"])


@functools.cache
def locked():
    """Rotations that are locked to the forcing, of all amplitudes: a constant guess and the number of rounds."""
    start = contin.solve(forced_pendulum(), [0.0, 2 / 3], {"winding_phi": 1})
    return start, contin.trace(start, free=["a"], limits={"a": (0.5, 3)})


def after(u, a, periods=1):
    field = forced_field(a)
    return solve_ivp(field, (0, periods * TWO_PI * 1.5), u, method="DOP853", rtol=1e-13, atol=1e-13).y[:, -1]


def forced_field(a):
    return lambda t, u: [u[1], -math.sin(u[0]) - 0.5 * u[1] + a * math.cos(2 / 3 * t)]


@pytest.mark.full
def test_rotations_of_a_forced_pendulum():
    start, branch = locked()
    first = start.system.states(start.x)[0]
    shot = fsolve(lambda u: after(u, 1.4) - u - [TWO_PI, 0], first, xtol=1e-13)
    assert np.abs(shot - first).max() < 1e-9
    assert branch.stop.reason == "closed"  # one round on, at another time of the forcing
    moved = branch.points[-1].system.states(branch.points[-1].x)[0] - branch.points[0].system.states(branch.points[0].x)[0]
    assert abs(moved[0] / TWO_PI - round(moved[0] / TWO_PI)) < 1e-6 and abs(moved[1]) < 1e-6
    assert [point.label for point in branch.points if point.label] == ["EP", "LP", "PD", "PD", "PD", "PD", "LP", "EP"]


def test_period_doublings_of_rotations():
    """Cycles of two periods go round twice; at the doubling a multiplier is -1, by differences of the integrated motion."""
    doubling = locked()[1].labelled("PD")[0]
    a, first = doubling["a"], doubling.system.states(doubling.x)[0]
    steps = 1e-5 * np.eye(2)
    slope = np.stack([(after(first + s, a) - after(first - s, a)) / 2e-5 for s in steps], axis=1)
    assert np.abs(np.linalg.eigvals(slope) + 1).min() < 1e-6
    twice = contin.trace(doubling, branch=1, max_points=4, errors=False).points[-1]
    assert (twice["rounds"], twice["winding_phi"]) == (2, 2)
    start = twice.system.states(twice.x)[0]
    shot = fsolve(lambda u: after(u, twice["a"], 2) - u - [2 * TWO_PI, 0], start, xtol=1e-13)
    assert np.abs(shot - start).max() < 1e-8


def test_forced_cycles_of_several_rounds_are_brought_in_phase():
    twice = contin.trace(locked()[1].labelled("PD")[0], branch=1, max_points=3, errors=False).points[-1]
    system, x = twice.system, twice.x
    later = system.moved(x, 0.5)
    later[: system.state_size : 2] += 3 * TWO_PI
    found, _ = system.in_phase(later, (), x)
    assert np.abs(found - x).max() < 1e-8


def test_forced_motions_settle_on_cycles_that_go_round():
    point = contin.cycle(forced_pendulum(), [0.1, 0.2], {"a": 1.45}, settle=400)
    assert (point["rounds"], point["winding_phi"]) == (2, -2)
    assert -math.pi <= point.system.states(point.x)[0, 0] <= math.pi


def oscillator(**options):
    """Adler's equation."""
    return contin.CycleProblem(lambda u, p: (p.w - p.a * math.sin(u.x),), ["x"], {"w": 2.0, "a": 1.0}, angles=["x"], **options)


def test_periods_near_a_saddle_node_on_a_circle():
    """2 pi / sqrt(w^2 - a^2), without bound at w = a."""
    start = contin.solve(oscillator(), lambda t: (TWO_PI * t,), {"period": 4.0})
    branch = contin.trace(start, free=["w"], direction=-1, limits={"w": (0, 5), "period": (0, 500)})
    assert branch.points[-1]["period"] == pytest.approx(500, abs=1e-9)
    for point in branch.points:
        assert abs(point["period"] * math.sqrt(point["w"] ** 2 - 1) - TWO_PI) < 1e-9 * point["period"]
        assert point["winding_x"] == 1


def test_branches_end_at_a_saddle_node_on_a_circle():
    """Where round-off no longer tells the parameter from that of the saddle-node: at w = a, x = pi / 2, up to its root."""
    start = contin.solve(oscillator(), lambda t: (TWO_PI * t,), {"period": 4.0})
    branch = contin.trace(start, free=["w"], direction=-1, limits={"w": (0, 5)})
    assert "homoclinic orbit" in branch.stop.message
    (near,) = re.findall(r"near the equilibrium x = ([0-9.]+), at a fold of equilibria", branch.stop.message)
    assert abs(float(near) - math.pi / 2) < 1e-5
    assert abs(branch.points[-1]["w"] - 1) < 1e-7 and "limit_w" not in branch.stop.details


def test_rotation_backwards():
    back = contin.solve(oscillator(), lambda t: (-TWO_PI * t,), {"period": 4.0, "w": -2.0})
    assert back["winding_x"] == -1 and abs(back["period"] - TWO_PI / math.sqrt(3)) < 1e-10


def pair(u, p):
    middle = p.w
    return middle + p.d / 2 + p.k * math.sin(u.y - u.x), middle - p.d / 2 + p.k * math.sin(u.x - u.y)


def test_two_oscillators_are_locked_up_to_a_fold():
    """|d| < 2 k; beyond in phase and out of phase meet, and the branch closes where the difference has gone round."""
    problem = contin.CycleProblem(pair, ["x", "y"], {"w": 1.0, "d": 0.3, "k": 0.5}, angles=["x", "y"])
    start = contin.cycle(problem, [0.1, 0.2])
    assert (start["winding_x"], start["winding_y"]) == (1, 1) and abs(start["period"] - TWO_PI) < 1e-12
    branch = contin.trace(start, free=["d"], limits={"d": (-2, 2)})
    folds = branch.labelled("LP")
    assert branch.stop.reason == "closed" and np.abs([abs(fold["d"]) - 1 for fold in folds]).max() < 1e-12
    locus = contin.curve(folds[0], "k", limits={"k": (0.4, 2)})
    assert max(abs(abs(point["d"]) - 2 * point["k"]) for point in locus.points) < 1e-10


def ring(u, p):
    return (
        p.w + p.k * math.sin(u.b - u.a),
        p.w + p.k * math.sin(u.c - u.b),
        p.w + p.k * math.sin(u.a - u.c),
    )


@pytest.mark.parametrize("symmetric", [False, True])
def test_splay_state_of_a_ring(symmetric):
    """Each of three is a third of a period behind the next: the frequency is w + k sin(2 pi / 3)."""
    swap = {"symmetry": [[0, 1, 0], [0, 0, 1], [1, 0, 0]]} if symmetric else {}
    problem = contin.CycleProblem(ring, ["a", "b", "c"], {"w": 1.0, "k": 0.2}, angles=["a", "b", "c"], **swap)
    found = contin.solve(problem, lambda t: tuple(TWO_PI * (t + j / 3) for j in range(3)), {"period": 6.0})
    assert abs(found["period"] - TWO_PI / (1 + 0.2 * math.sin(TWO_PI / 3))) < 1e-10
    windings = [found["winding_" + name] for name in "abc"]
    assert sum(windings) == (1 if symmetric else 3)
    assert all(found["max_" + name] == math.pi for name in "abc")
    system = found.system
    shift = 0.4 * system.order
    later = system.moved(found.x, shift)
    moved, _ = system.in_phase(later, (), found.x)
    assert np.abs(moved - found.x).max() < 1e-6
    whole = system.evaluate(found.x, np.array([0.0, float(system.order)]))
    assert np.abs(whole[1] - whole[0] - TWO_PI).max() < 1e-9


@pytest.mark.full
def test_guesses_with_jumps():
    """Values between -pi and pi, as of data, and a guess whose lift is somewhere else."""
    start, _ = running()
    t = np.linspace(0, 1, 400)
    states = start.system.evaluate(start.x, t)
    states[:, 0] = (states[:, 0] + 40 + math.pi) % TWO_PI - math.pi
    again = contin.solve(josephson(), (t, states), {"period": 4.3})
    assert again["winding_phi"] == 1 and abs(again["period"] - start["period"]) < 1e-10


def test_stored_branches_go_on(tmp_path):
    start, branch = running()
    contin.save(branch, tmp_path / "rotations.npz")
    again = contin.load(josephson(), tmp_path / "rotations.npz")
    assert again.points[3]["winding_phi"] == 1
    further = [contin.trace(each.points[3], limits={"current": (1.2, 5)}, errors=False) for each in (branch, again)]
    ends = [each.points[-1] for each in further]
    assert ends[0].label == ends[1].label == "EP" and abs(ends[0]["period"] - ends[1]["period"]) < 1e-11
    with pytest.raises(contin.ProblemError, match="parameters"):
        contin.load(contin.CycleProblem(junction, ["phi", "v"], {"current": 1.5, "beta": 2.0}), tmp_path / "rotations.npz")


def test_known_rotations_are_the_same_one_round_on():
    start, _ = running()
    moved = start.x.copy()
    moved[: start.system.state_size : 2] += 3 * TWO_PI
    assert np.abs(start.system.lifted(moved, start.x) - start.x).max() < 1e-12


def test_portraits_stay_on_the_circle():
    start, _ = running()
    portrait, series, _ = start.plot()
    x, y = portrait.lines[0].get_data()
    assert np.nanmax(np.abs(x)) <= math.pi + 1e-12
    assert np.count_nonzero(np.isnan(x)) == 1 and not np.isnan(y).any()
    assert np.nanmax(np.abs(np.diff(x))) < 0.1
    assert len(series.lines) == 2


def test_equal_problems_and_processes():
    import pickle

    problem = josephson()
    again = pickle.loads(pickle.dumps(problem))
    assert again == problem == josephson()
    assert again.angles == {"phi": TWO_PI} and josephson().doubled().angles == problem.angles


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"angles": ["psi"]}, "angles: 'psi' is no state; there are phi, v"),
        ({"angles": {"phi": 0.0}}, "angles: the period 0.0 of phi must be a positive number"),
        ({"angles": ["v"]}, "angles: the field is not periodic in v; of its values, that of phi changes by"),
        ({"angles": {"phi": 1.0}}, "angles: the field is not periodic in phi"),
        ({"angles": "phi"}, "angles: 'phi' must be a list of names"),
    ],
)
def test_what_is_wrong_with_angles(change, sentence):
    with pytest.raises(contin.ProblemError) as error:
        contin.CycleProblem(junction, ["phi", "v"], {"current": 1.5, "beta": 2.0}, **change)
    assert str(error.value).startswith(sentence)


def test_winding_numbers_are_whole_and_fixed():
    start, _ = running()
    with pytest.raises(contin.ProblemError, match="free: winding_phi must not be free, as it is a whole number"):
        contin.trace(start, free=["current", "winding_phi"])
    with pytest.raises(contin.ProblemError, match="parameters: winding_phi = 0.5 must be a whole number"):
        contin.solve(josephson(), [0.0, 1.0], {"winding_phi": 0.5})
    with pytest.raises(contin.ProblemError, match="winding_phi is a column of every cycle by itself"):
        contin.CycleProblem(junction, ["phi", "v"], {"current": 1.0, "beta": 2.0, "winding_phi": 1.0}, angles=["phi"])
    with pytest.raises(contin.ProblemError, match="symmetry: where x goes round once, S u must change by whole rounds"):
        contin.CycleProblem(lambda u, p: (1.0, 0.125 + 0 * u.z), ["x", "z"], {}, symmetry=[[1, 0], [0.25, -1]], angles=["x"])
    with pytest.raises(contin.ProblemError, match="angles: must be left out where stable is given"):
        contin.ConnectionProblem(junction, ["phi", "v"], {"current": 0.5, "beta": 2.0}, unstable=1, stable=1, angles=["phi"])
