"""Threads: what they compute, what they raise, and how they end. The same bits for any number of them."""

import contextlib
import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

import contin
from contin import threads
from contin.functions.batch import Batch
from contin.linalg import blocks as segments

SOME = [1, 2, 3, 5]


@pytest.fixture
def use(monkeypatch):
    """A function that sets the number of threads; problems of any size use them."""
    monkeypatch.setattr(segments, "_LARGE", 0)
    monkeypatch.setattr("contin.functions.batch._MANY", 1)
    monkeypatch.setattr("contin.functions.batch._LONG", -1.0)
    return lambda count: monkeypatch.setenv("CONTIN_THREADS", str(count))


@pytest.mark.parametrize("count", SOME)
def test_results_are_in_the_order_of_the_jobs(count, use):
    use(count)
    assert threads.each(lambda job: job * job, range(40)) == [job * job for job in range(40)]
    assert threads.each(lambda job: job, []) == []


@pytest.mark.parametrize("count", SOME)
def test_the_exception_of_the_first_job_is_raised(count, use):
    use(count)

    def fail(job):
        if job == 3:
            time.sleep(0.05)  # another job fails before
            raise ZeroDivisionError(job)
        if job > 3:
            raise OverflowError(job)

    with pytest.raises(ZeroDivisionError, match="3"):
        threads.each(fail, range(40))


@pytest.mark.parametrize("given", ["0", "-1", "two", "1.5", "1025", "²"])
def test_a_wrong_number_of_threads_is_refused(given, monkeypatch):
    monkeypatch.setenv("CONTIN_THREADS", given)
    with pytest.raises(contin.ProblemError, match=f"CONTIN_THREADS: '{given}' must be a whole number from 1 to 1024"):
        threads.count()


def test_a_wrong_number_of_threads_is_refused_where_a_run_begins(monkeypatch):
    circle = contin.AlgebraicProblem(lambda u, p: (u.x**2 + p.a**2 - 1,), ["x"], {"a": 0.6})
    start = contin.solve(circle, [1.0])
    monkeypatch.setenv("CONTIN_THREADS", "two")
    with pytest.raises(contin.ProblemError, match="CONTIN_THREADS"):
        contin.trace(start, free=["a"])


def test_the_number_of_threads_is_that_of_usable_cores(monkeypatch):
    monkeypatch.delenv("CONTIN_THREADS", raising=False)
    monkeypatch.setattr(os, "sched_getaffinity", lambda process: {0, 4, 5}, raising=False)
    assert threads.count() == 3


# --- the same bits -----------------------------------------------------------------------------------------------------


def chain(n):
    """A ring of n coupled states with an integral condition, a parameter more and a boundary with both."""

    def rhs(t, u, p, out):
        for i in range(n):
            out[i] = p[0] * np.sin(u[(i + 1) % n]) - u[i] + 0.1 * u[i] * u[i - 1] + p[1] * t

    def boundary(u0, u1, p, out):
        for i in range(n):
            out[i] = u0[i] + 0.5 * u1[i] - 1

    def integrals(t, u, p):
        return (u[0] * u[0] - p[1],)

    return contin.BoundaryValueProblem(rhs, boundary, n, {"a": 1.0, "b": 0.5}, boundary_count=n, integrals=integrals)


@pytest.mark.parametrize(("n", "intervals", "degree"), [(2, 3, 4), (3, 17, 2), pytest.param(4, 40, 5, marks=pytest.mark.full)])
def test_a_linearization_has_the_same_bits(n, intervals, degree, use):
    """With parameters, an integral condition, extra rows and columns, and more right-hand sides than are solved together."""
    random, known = np.random.default_rng(1), None
    system = contin.lowlevel.Collocation(
        chain(n), np.sort([0, 1, *random.uniform(0, 1, intervals - 1)]), degree, ["a", "b"], {}
    )
    x = random.standard_normal(system.size)
    rows, columns = random.standard_normal((2, system.size + 1)), random.standard_normal((1, system.equations))
    b = random.standard_normal((6, system.size + 1))
    for count in SOME:
        use(count)
        for _ in range(2):  # the first evaluation of a function is timed, and takes one thread
            residual, factors = system.linearize(x, rows, columns)
        w = system.transposed_product(x, residual)
        found = [residual, w, system.residual(x), factors.solve(b), factors.solve_transposed(b), factors.sign]
        known = known or found
        assert [np.array_equal(one, other) for one, other in zip(found, known)] == [True] * len(known)


def test_a_branch_has_the_same_bits(use):
    """The buckled states of a beam, with their folds and branch points: singular values decide where those are."""
    problem = contin.BoundaryValueProblem(
        lambda t, u, p: (u.v, -p.load * np.sin(u.angle)), lambda a, b, p: (a.v, b.v), ["angle", "v"], {"load": 5.0}
    )
    known = None
    for count in SOME:
        use(count)
        start = contin.solve(problem, lambda t: (0.0, 0.0), intervals=20)
        branch = contin.trace(start, free=["load"], limits={"load": (5.0, 45.0)})
        found = [(point.label, point.x.tobytes(), point["load"]) for point in branch.points]
        known = known or found
        assert found == known
    loads = [load for label, _, load in known if label == "BP"]
    assert loads == pytest.approx([np.pi**2, 4 * np.pi**2], rel=1e-9)  # Euler


# --- users' functions --------------------------------------------------------------------------------------------------


def raises(t, u, p):
    """Python's errors of arithmetic beyond 20 and 40: there is no value there."""
    if u.x > 40:
        raise ZeroDivisionError("too large")
    if u.x > 20:
        raise OverflowError("large")
    return (u.x * p.a,)


def quotient(t, u, p):
    return (p.a / (u.x - 30.0),)


@pytest.mark.parametrize("function", [raises, quotient])
def test_where_functions_have_no_value_is_the_same(function, use):
    u, none, p = np.arange(500.0)[:, None].copy(), np.empty((0, 1)), np.array([2.0])
    known = None
    for count in SOME:
        use(count)
        batch = Batch([function], [1], ["x"], ["a"])
        for _ in range(2):  # the first time it is timed
            found = [outcome(evaluate, batch, u, none, p) for evaluate in (values, jacobian)]
            known = known or found
            assert found == known
    assert function is quotient or known[0][20:22] == [pytest.approx([40.0], rel=1e-15), [-1.0]]


def outcome(evaluate, *given):
    """What is returned or raised, so that it can be compared."""
    try:
        return np.nan_to_num(evaluate(*given), nan=-1.0).tolist()
    except Exception as error:
        return type(error), error.args


def values(batch, u, none, p):
    return batch.values(u[:, 0], u, none, p)


def jacobian(batch, u, none, p):
    return np.concatenate([array.ravel() for array in batch.jacobian(u[:, 0], u, none, p, batch.columns([0]))])


# --- how threads end ---------------------------------------------------------------------------------------------------


@pytest.mark.forks("they are tested")
def test_a_forked_process_has_threads_of_its_own(use):
    use(3)
    problem = chain(3)
    system = contin.lowlevel.Collocation(problem, np.linspace(0, 1, 31), 4, ["a", "b"], {})
    x, b = np.full(system.size, 0.5), np.ones(system.equations + 1)
    row = np.ones(system.size)
    known = system.linearize(x, (row,))[1].solve(b)
    for _ in range(3):
        child = os.fork()
        if child == 0:
            found = system.linearize(x, (row,))[1].solve(b)
            os._exit(0 if np.array_equal(found, known) and len(threads._POOLS) == 1 else 1)
        assert np.array_equal(system.linearize(x, (row,))[1].solve(b), known)
        assert os.waitpid(child, 0)[1] == 0


PROGRAM = """
import numpy as np, time
import contin
from contin.linalg import blocks as segments
segments._LARGE = 0
problem = contin.BoundaryValueProblem(lambda t, u, p: (u.v, -p.a * u.u), lambda a, b, p: (a.u, b.u - 1), ["u", "v"], {"a": 1.0})
system = contin.lowlevel.Collocation(problem, np.linspace(0, 1, 2001), 4, [], {})
x = np.zeros(system.size)
system.linearize(x)[1].solve(x)
print("begins", flush=True)
while True:
    system.linearize(x)[1].solve(x)
"""


@pytest.mark.posix("Windows sends Ctrl-C in another way")
def test_an_interrupt_ends_a_computation():
    environment = {**os.environ, "CONTIN_THREADS": "3", "PYTHONPATH": os.pathsep.join(sys.path)}
    process = subprocess.Popen(
        [sys.executable, "-c", PROGRAM], env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    assert process.stdout.readline() == "begins\n"
    for _ in range(20):  # Python ignores a KeyboardInterrupt that is raised while it collects garbage
        time.sleep(0.2)
        process.send_signal(signal.SIGINT)
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.wait(timeout=3)
            break
    process.kill()  # where it has not ended: it would compute for ever
    said = process.communicate(timeout=30)[1]
    assert process.returncode == -signal.SIGINT and said.rstrip().endswith("KeyboardInterrupt")
