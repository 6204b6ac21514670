"""What people meet at a prompt: representations, names that are not there, Ctrl-C, points in another process."""

import concurrent.futures
import math
import multiprocessing
import pickle
import signal
import threading
import time

import pytest

from contin import AlgebraicProblem, BoundaryValueProblem, ConnectionProblem, CycleProblem, VariationalProblem, solve, trace
from contin.errors import ProblemError


def bratu(t, u, p):
    return u.v, -p.lam * math.exp(u.u)


def ends(a, b, p):
    return a.u, b.u


def field(u, p):
    return u.y, p.a - u.x


def bending(t, x, w, p):
    return w.angle**2 / 2 + p.load * math.cos(x.angle)


def clamped(a, b, p):
    return a.angle, b.angle


PROBLEM = BoundaryValueProblem(bratu, ends, ["u", "v"], {"lam": 0.0})


def further(point):
    """Return where a run from a point gets to; in another process."""
    return trace(point, free=["lam"], limits={"lam": (-1, 1)}).points[-1]["lam"]


def test_representations_are_short():
    branch = trace(solve(PROBLEM, [0, 0]), free=["lam"], limits={"lam": (0, 1)})
    assert repr(branch.points[0]) == "Point(EP start: lam=0)"
    assert repr(branch) == f"Branch({len(branch)} points on 8 to 16 intervals of degree 7: EP EP; reached lam = 1)"


def test_a_name_that_is_not_there_is_answered_with_those_that_are():
    branch = trace(solve(PROBLEM, [0, 0]), free=["lam"], limits={"lam": (0, 1)})
    for call in (lambda: branch.column("typo"), lambda: branch.points[0]["typo"]):
        with pytest.raises(KeyError, match="'typo' is none of lam"):
            call()
    with pytest.raises(ProblemError, match="no attribute 'typo'; the states and parameters are x, a"):
        solve(AlgebraicProblem(lambda u, p: (u.typo - p.a,), ["x"], {"a": 1.0}), [0.0])


def test_a_label_that_nothing_has_is_told():
    branch = trace(solve(PROBLEM, [0, 0]), free=["lam"], limits={"lam": (0, 1)})
    with pytest.warns(UserWarning, match=r"no point has the label 'LP1' \(did you mean 'LP'\?\)"):
        assert branch.labelled("LP1") == []
    assert branch.labelled("HB") == []  # it may have one: nothing to tell


def test_missing_conditions_are_counted():
    problem = BoundaryValueProblem(bratu, lambda a, b, p: (a.u,), ["u", "v"], {"lam": 0.0})
    with pytest.raises(ProblemError, match="1 boundary and integral conditions for 2 states; 1 more needed"):
        solve(problem, [0, 0])


def test_a_largest_step_below_the_first_one_just_works():
    branch = trace(solve(PROBLEM, [0, 0]), free=["lam"], max_step=1e-3, max_points=5)
    assert len(branch) > 3 and branch.points[-1].arclength <= 5.001e-3
    with pytest.raises(ProblemError, match="max_step"):
        trace(solve(PROBLEM, [0, 0]), free=["lam"], max_step=1e-3, step=0.1)


def test_the_first_interrupt_gives_the_branch_so_far(capsys):
    """Again after some seconds: Python drops an exception that a signal raises while it collects garbage."""
    start, ended = solve(PROBLEM, [0, 0]), threading.Event()

    def interrupt():
        wait = 0.5
        while not ended.wait(wait):
            signal.raise_signal(signal.SIGINT)
            wait = 5.0

    began = time.perf_counter()
    threading.Thread(target=interrupt, daemon=True).start()
    branch = trace(start, free=["lam"], max_step=1e-5, max_points=10**8)
    ended.set()
    assert time.perf_counter() - began < 60
    assert len(branch) > 1 and branch.stop.reason == "interrupted" and "trace from the last one goes on" in str(branch.stop)
    assert "interrupted after" in capsys.readouterr().err
    assert trace(branch.points[-1], free=["lam"], limits={"lam": (-1, 1)}).points[-1]["lam"] == pytest.approx(1)


@pytest.mark.full
@pytest.mark.parametrize("method", ["spawn", pytest.param("fork", marks=pytest.mark.forks("they are tested"))])
def test_a_point_survives_pickling_into_another_process(method):
    point = trace(solve(PROBLEM, [0, 0]), free=["lam"], limits={"lam": (0, 0.5)}).points[-1]
    context = multiprocessing.get_context(method)
    with concurrent.futures.ProcessPoolExecutor(1, mp_context=context) as pool:
        assert pool.submit(further, point).result() == pytest.approx(1, abs=1e-12)


def test_problems_of_all_kinds_survive_pickling():
    problems = [
        AlgebraicProblem(field, ["x", "y"], {"a": 1.0}),
        CycleProblem(field, ["x", "y"], {"a": 0.0}),
        ConnectionProblem(field, ["x", "y"], {"a": 0.0}, unstable=1),
        VariationalProblem(bending, ["angle"], {"load": 30.0}, ends=clamped),
    ]
    for problem in problems:
        again = pickle.loads(pickle.dumps(problem))
        assert type(again) is type(problem)
        assert again.state_names == problem.state_names and again.parameters == problem.parameters
