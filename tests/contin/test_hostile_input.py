"""Any input gives a result, or one sentence that names the field; no other exception, no hang."""

import dataclasses
import math

import numpy as np
import pytest

import contin

hypothesis = pytest.importorskip("hypothesis", reason="hypothesis is not installed")
from hypothesis import given, settings  # noqa: E402
from hypothesis import strategies as st  # noqa: E402

#: A part of what the profile has (tests/conftest.py): 5, and 25 with --full.
FEW = settings(max_examples=max(5, settings().max_examples // 12))

numbers = st.one_of(
    st.integers(), st.floats(), st.booleans(), st.sampled_from([10**400, -(10**400), np.float64(math.nan), np.int64(2), 1 + 2j])
)
scalars = st.one_of(numbers, st.none(), st.text(max_size=8), st.binary(max_size=3), st.just(object()), st.just(lambda *a: 1.0))
names = st.one_of(st.sampled_from(["lam", "u", "mean"]), st.text(max_size=4))
anything = st.recursive(
    scalars,
    lambda inner: st.one_of(
        st.lists(inner, max_size=3), st.tuples(inner, inner), st.dictionaries(st.one_of(names, scalars), inner, max_size=2)
    ),
    max_leaves=6,
) | st.sampled_from([np.ones(2), np.ones((2, 2)), np.array(["a"]), np.array([math.nan, 1.0])])


def rhs(t, u, p):
    return u.v, -p.lam * math.exp(u.u)


def boundary(a, b, p):
    return a.u, b.u


BVP = {
    "rhs": rhs,
    "boundary": boundary,
    "states": ["u", "v"],
    "parameters": {"lam": 0.0},
    "functionals": {"mean": lambda t, u, p: u.u},
}
ALGEBRAIC = {"residual": lambda u, p: (p.mu - u.x**2,), "states": ["x"], "parameters": {"mu": 1.0}}
STATEMENTS = {
    contin.Settings: {}, contin.MeshControl: {}, contin.Newton: {}, contin.BoundaryValueProblem: BVP,
    contin.AlgebraicProblem: ALGEBRAIC,
}  # fmt: skip
FIELDS = [(kind, entry.name) for kind in STATEMENTS for entry in dataclasses.fields(kind) if entry.init]


def _one_sentence(call):
    try:
        call()
    except contin.ContinError as error:
        assert "\n" not in str(error) and len(str(error)) < 600
        return str(error)
    return ""


@pytest.mark.filterwarnings("ignore:pattern= has no effect:DeprecationWarning")
@pytest.mark.parametrize(("kind", "field"), FIELDS)
def test_every_field_of_every_statement(kind, field):
    @FEW
    @given(anything)
    def check(value):
        said = _one_sentence(lambda: kind(**{**STATEMENTS[kind], field: value}))
        words = (
            field.rstrip("s"),
            field.replace("_", " "),
            "interval",
            "step",
            "function",
            "rhs",
            "boundary",
            "must be a plain",
            "cannot be called",
        )
        assert not said or any(word in said for word in words), said

    check()


@pytest.fixture(scope="module")
def start():
    return contin.solve(contin.BoundaryValueProblem(**BVP), [0, 0], intervals=4)


@pytest.mark.parametrize("argument", ["guess", "parameters", "free", "intervals", "degree", "mesh", "newton", "others"])
def test_every_argument_of_solve(argument, start):
    small = anything.filter(lambda value: not (isinstance(value, int) and value > 100))

    @FEW
    @given(small)
    def check(value):
        _one_sentence(lambda: contin.solve(start.system.problem, **{"guess": [0, 0], "intervals": 4, argument: value}))

    check()


@pytest.mark.parametrize("argument", ["start", "settings", "free", "branch", "limits", "zeros", "step", "primary", "trivial"])
def test_every_argument_of_trace(argument, start):
    @FEW
    @given(anything)
    def check(value):
        usual = {"start": start, "free": ["lam"], "limits": {"lam": (-0.1, 0.2)}, "max_points": 4, "max_step": 0.1}
        _one_sentence(lambda: contin.trace(**{**usual, argument: value}))

    check()


@FEW
@given(anything)
def test_the_others(start, value):
    for call in (
        lambda: contin.curve(start, value), lambda: contin.curve(value, "lam"), lambda: start.sensitivities(value),
        lambda: contin.Point.sensitivities(value), lambda: contin.solve(value, [0]), lambda: contin.trace(start, mesh=value),
        lambda: contin.diagram(start, free=value), lambda: contin.diagram(value),
        lambda: contin.diagram(start, depth=value, free=()), lambda: contin.diagram(start, symmetries=value),
    ):  # fmt: skip
        _one_sentence(call)


@settings(max_examples=settings().max_examples // 5)
@given(st.data())
def test_a_stored_branch_cut_or_garbled(tmp_path_factory, data):
    path = tmp_path_factory.getbasetemp() / "stored.npz"
    problem = contin.AlgebraicProblem(**ALGEBRAIC)
    if not path.exists():
        contin.save(contin.trace(contin.solve(problem, [1.0]), free=["mu"], limits={"mu": (0.5, 2)}), path)
    image = bytearray(path.read_bytes())
    at = data.draw(st.integers(0, len(image) - 1))
    if data.draw(st.booleans()):
        del image[at:]
    else:
        image[at : at + 4] = data.draw(st.binary(min_size=1, max_size=4))
    garbled = path.with_name("garbled.npz")
    garbled.write_bytes(image)
    _one_sentence(lambda: contin.load(problem, garbled))
