"""The same run twice in one process gives the same bits: nothing that an earlier run has left takes part in it."""

import ctypes
import ctypes.util
import dataclasses

import numpy as np
import pytest

import contin

_LIBRARY = ctypes.CDLL(ctypes.util.find_library("m") or "libm.so.6")
_LIBRARY.sin.restype, _LIBRARY.sin.argtypes = ctypes.c_double, [ctypes.c_double]


def sine(x):
    """The sine of a number, by a function that cannot be recorded, nor take complex numbers."""
    return _LIBRARY.sin(x)


def growing():
    """An equilibrium whose states grow to 1e8 along the branch, evaluated in Python."""
    field = lambda u, p: (p.a - u.x + sine(u.x) * u.y * 1e-6, u.y - u.x * u.x)  # noqa: E731
    start = contin.solve(contin.AlgebraicProblem(field, ["x", "y"], {"a": 1.0}), [1.0, 1.0])
    return start, {"free": ["a"], "limits": {"a": (0, 1e4)}, "max_points": 60}


def pendulum():
    """A boundary value problem evaluated in Python, with two branch points: second derivatives by nested differences."""
    field = lambda t, u, p: (u.v, -p.lam * sine(u.u))  # noqa: E731
    problem = contin.BoundaryValueProblem(field, lambda a, b, p: (a.v, b.v), ["u", "v"], {"lam": 1.0})
    return contin.solve(problem, [0.0, 0.0]), {"free": ["lam"], "limits": {"lam": (0.5, 45)}}


def turning():
    """A Hopf point of a field evaluated in Python: its normal form is computed with differences, whose error is stated."""
    field = lambda u, p: (  # noqa: E731
        p.m * u.x - u.y - u.x * (u.x**2 + u.y**2) + 0.1 * sine(u.x) * u.y, u.x + p.m * u.y - u.y * (u.x**2 + u.y**2)
    )  # fmt: skip
    start = contin.solve(contin.AlgebraicProblem(field, ["x", "y"], {"m": -1.0}), [0.0, 0.0])
    return start, {"free": ["m"], "limits": {"m": (-1, 1)}}


def sparse():
    """An equilibrium of 240 states, with a sparse Jacobian and eigenvalues by iteration."""

    def field(u, p, out):
        n = len(u)
        for i in range(n):
            out[i] = p[0] * u[i] - u[i] ** 3 - 2 * n * u[i] + 0.3
            if i > 0:
                out[i] += n * u[i - 1]
            if i < n - 1:
                out[i] += n * u[i + 1] + 0.5 * u[i + 1]

    start = contin.solve(contin.AlgebraicProblem(field, 240, {"a": 0.0}), [0.0] * 240)
    return start, {"free": ["a"], "limits": {"a": (-1, 2)}, "step": 0.05}


def bits(value):
    """Return all numbers of a value as text that tells every bit."""
    if isinstance(value, np.ndarray):
        return value.tobytes()
    if dataclasses.is_dataclass(value):
        return [bits(getattr(value, field.name)) for field in dataclasses.fields(value) if field.name != "system"]
    if isinstance(value, dict):
        return [(name, bits(item)) for name, item in value.items()]
    if isinstance(value, (list, tuple)):
        return [bits(item) for item in value]
    return value.hex() if isinstance(value, float) else repr(value)


@pytest.mark.full
@pytest.mark.parametrize("case", [growing, pendulum, turning, sparse])
@pytest.mark.filterwarnings("ignore::contin.errors.InterpretedWarning")
def test_the_same_run_twice(case):
    start, options = case()
    branches = [contin.trace(start, **options) for _ in range(3)]
    first = [bits(list(branches[0])), branches[0].notes, str(branches[0].stop)]
    for branch in branches[1:]:
        assert [bits(list(branch)), branch.notes, str(branch.stop)] == first


@pytest.mark.full
@pytest.mark.filterwarnings("ignore::contin.errors.InterpretedWarning")
def test_the_error_of_a_normal_form_does_not_depend_on_what_was_computed_before():
    """Differences elsewhere with a large error, as at a corner, have nothing to do with it."""
    start, options = turning()
    (before,) = contin.trace(start, **options).labelled("HB")
    start.system.problem.batch("residual").interpreted.error = 1e-3
    (after,) = contin.trace(start, **options).labelled("HB")
    assert before.details["normal_form_error"] == after.details["normal_form_error"]


@pytest.mark.full
@pytest.mark.filterwarnings("ignore::contin.errors.InterpretedWarning")
def test_branch_points_of_a_boundary_value_problem_in_python():
    """lam = (k pi)^2: nested differences take shorter lengths at some places, and not at others."""
    start, options = pendulum()
    found = [point["lam"] for point in contin.trace(start, **options).labelled("BP")]
    assert found == pytest.approx([np.pi**2, 4 * np.pi**2], abs=1e-6)
