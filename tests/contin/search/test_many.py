"""One function of a problem at many sets of values: rows in order, failures among them, in processes and on clusters."""

import concurrent.futures
import math
import multiprocessing
import os
import re

import pytest

import contin
from contin import AlgebraicProblem, ProblemError, batch

ROOT = AlgebraicProblem(lambda u, p: (u.x**2 - p.a,), ["x"], {"a": 1.0, "b": 0.0})
VALUES = [{"a": float(k)} for k in range(1, 40)]


def root(problem, values):
    return contin.solve(problem, [1.0 + math.sqrt(abs(values["a"]))], values)["x"]


def place(problem, values):
    """The process, and the recording that it works with."""
    return os.getpid(), id(problem.batch("residual"))


def dies(problem, values):
    if values["a"] == 20.0:
        os._exit(3)
    return values["a"]


def unsendable(problem, values):
    return (lambda: 0) if values["a"] > 38 else 0


KINDS = [
    "here",
    "processes",
    "threads",
    *(pytest.param(kind, marks=pytest.mark.full) for kind in ("pool", "multiprocessing", "Dask")),
]


@pytest.fixture(scope="module", params=KINDS)
def workers(request):
    """Everything that `batch` takes for workers."""
    if request.param in ("here", "processes"):
        yield {"here": 1, "processes": 2}[request.param]
    elif request.param == "multiprocessing":
        with multiprocessing.get_context("spawn").Pool(2) as pool:
            yield pool
    elif request.param == "Dask":
        distributed = pytest.importorskip("distributed")
        with (
            distributed.LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None) as cluster,
            distributed.Client(cluster) as client,
        ):
            yield client
    else:
        kind = "ThreadPoolExecutor" if request.param == "threads" else "ProcessPoolExecutor"
        with getattr(concurrent.futures, kind)(2) as executor:
            yield executor


def test_rows_are_in_order_and_failures_are_among_them(workers):
    values = [*VALUES, {"a": -1.0}, {"a": 2.0}]
    rows = batch(root, ROOT, values, workers=workers)
    assert [row.values for row in rows] == values
    assert [row.result for row in rows if not row.failure] == pytest.approx([math.sqrt(a) for a in [*range(1, 40), 2]])
    (failed,) = (row for row in rows if row.failure)
    assert failed.values == {"a": -1.0} and failed.result is None and failed.failure.startswith("Newton did not converge")


def test_functions_are_recorded_once_in_each_process(workers):
    found = {row.result for row in batch(place, ROOT, VALUES, workers=workers)}
    assert len(found) == len({process for process, _ in found}) <= 3


def test_other_exceptions_are_failures_too():
    rows = batch(lambda problem, values: [][0] if values["a"] > 1 else problem, ROOT, [{"a": 1.0}, {"a": 2.0}])
    assert rows[0].result is ROOT
    assert re.fullmatch(r"IndexError: list index out of range \(in <lambda>, line \d+ of test_many.py\)", rows[1].failure)


def test_what_solve_says_of_a_value_is_a_failure():
    rows = batch(root, ROOT, [{"a": 1.0}, {"a": 1.0, "c": 1.0}])
    assert not rows[0].failure and rows[1].failure == "parameter 'c' is not one of a, b"


@pytest.mark.full
def test_branches_come_back_from_processes():
    def branch(problem, values):
        return contin.trace(contin.solve(problem, [1.0], values), free=["a"], direction=-1, limits={"a": (-1, 50)})

    rows = batch(branch, ROOT, VALUES[:12], workers=2)
    for row in rows:
        (fold,) = row.result.labelled("LP")
        assert abs(fold["a"]) < 1e-9
        assert contin.trace(fold, free=["a"], limits={"a": (-1, 1)}).stop.reason == "limit"  # another run starts there


def test_results_that_cannot_be_sent_and_processes_that_die():
    rows = batch(unsendable, ROOT, VALUES, workers=2)
    assert [bool(row.failure) for row in rows] == [False] * 38 + [True] and "cannot be sent" in rows[-1].failure
    rows = batch(dies, ROOT, VALUES, workers=2)
    assert [row.values for row in rows] == VALUES
    assert all(row.result == row.values["a"] or row.failure.startswith("the process") for row in rows)
    assert rows[0].result == 1.0 and rows[19].failure


def test_functions_that_name_the_package_can_be_sent():
    """lazy_loader 0.6 had made it an object that cloudpickle does not send."""
    cloudpickle = pytest.importorskip("cloudpickle")
    assert contin.lowlevel.correct and cloudpickle.loads(cloudpickle.dumps(lambda: contin))() is contin


def test_nothing_to_do():
    assert batch(root, ROOT, []) == batch(root, ROOT, [], workers=2) == []


@pytest.mark.parametrize("values, workers, said", [
    ([{"a": "1"}], 1, "values: a: '1' must be a number"),
    ([{"a": 1.0}], 0, "workers: 0 must be a whole number from 1 to 1024"),
    ([{"a": 1.0}], "all", "workers: 'all' must be a whole number, or have submit or map, as executors and pools have"),
    (3, 1, "values: 3 must be a list"),
])  # fmt: skip
def test_wrong_input(values, workers, said):
    with pytest.raises(ProblemError) as told:
        batch(root, ROOT, values, workers=workers)
    assert said in str(told.value)
