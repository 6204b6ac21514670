"""Every public name refuses arguments of wrong types with one sentence; no other exception comes out."""

import inspect
import math

import numpy as np
import pytest

import contin
from contin import auto07p, lowlevel

WRONG = [
    3, None, -1.5, math.nan, "text", b"bytes", [], [None], {}, {1: 2}, {"x": None}, object(), 1j, lambda: 1, np.ones((2, 2)),
    True,
]  # fmt: skip
#: What runs give back, and errors: nobody calls these.
GIVEN_BACK = {"Branch", "Diagram", "Point", "Reason", "ContinError", "ConvergenceError", "ProblemError"}


def field(u, p):
    square = u.x**2 + u.y**2
    return p.mu * u.x - u.y - u.x * square, u.x + p.mu * u.y - u.y * square


def rhs(t, u, p):
    return u.v, -p.q


PARABOLA = contin.AlgebraicProblem(lambda u, p: (p.a - u.x**2,), ["x"], {"a": 1.0, "b": 0.0})
CIRCLES = contin.CycleProblem(field, ["x", "y"], {"mu": 1.0})
FEW = contin.Settings(max_points=3)
PLANE = {"states": ["x", "y"], "parameters": {"mu": 1.0}}


@pytest.fixture(scope="module")
def calls(tmp_path_factory):
    """Public names with arguments that are right, as far as calls end soon; methods by the name of their class."""
    folder = tmp_path_factory.mktemp("files")
    start = contin.solve(PARABOLA, [1.0])
    branch = contin.trace(start, free=["a"], direction=-1, limits={"a": (-1, 2)}, max_points=20)
    (fold,) = branch.labelled("LP")
    orbit = contin.solve(
        CIRCLES, lambda t: (math.cos(2 * math.pi * t), math.sin(2 * math.pi * t)), {"period": 6.0}, intervals=4
    )
    contin.save(branch, folder / "b.npz")
    (folder / "fort.7").write_text(
        "   0    PT  TY  LAB      PAR(1)            L2-NORM      \n   1     1   9    1  0.0000000000E+00   2.0000000000E+00\n"
    )
    (folder / "fort.8").write_text("")
    solution = auto07p.AutoSolution("EP", 1, {"a": 1.0, "b": 0.0}, np.zeros(1), np.array([[1.0]]), 1, 0)
    found = contin.diagram(start, FEW, free=["a"], depth=0)
    mesh, newton = contin.MeshControl(), contin.Newton()
    return {
        "solve": (contin.solve, {"problem": PARABOLA, "guess": [1.0], "intervals": 4, "mesh": mesh, "newton": newton}),
        "trace": (contin.trace, {"start": start, "settings": FEW, "free": ["a"]}),
        "curve": (contin.curve, {"start": fold, "second": "b", "settings": FEW}),
        "diagram": (contin.diagram, {"start": start, "settings": FEW, "free": ["a"], "depth": 0}),
        "batch": (contin.batch, {"function": abs, "problem": PARABOLA, "values": [{"a": 1.0}]}),
        "cycle": (contin.cycle, {"problem": CIRCLES, "start": [1.0, 0.1], "settle": 5.0, "intervals": 5}),
        "homoclinic": (contin.homoclinic, {"start": orbit, "free": ["mu"], "mesh": mesh, "newton": newton}),
        "save": (contin.save, {"branch": branch, "path": folder / "c.npz"}),
        "load": (contin.load, {"problem": PARABOLA, "path": folder / "b.npz"}),
        "read_columns": (lowlevel.read_columns, {"path": folder / "b.npz"}),
        "read_auto": (auto07p.read_auto, {"folder": folder}),
        "from_auto": (auto07p.from_auto, {"problem": PARABOLA, "solution": solution, "free": ["a"]}),
        "Event": (contin.Event, {"label": "UZ", "name": "one", "function": lambda trial: 1.0}),
        "AlgebraicProblem": (contin.AlgebraicProblem, {"residual": field, **PLANE, "mass": [1.0, 2.0]}),
        "CycleProblem": (contin.CycleProblem, {"field": field, **PLANE, "mass": [1.0, 2.0]}),
        "MapProblem": (contin.MapProblem, {"map": field, **PLANE}),
        "ConnectionProblem": (contin.ConnectionProblem, {"field": field, **PLANE, "unstable": 1}),
        "BoundaryValueProblem": (contin.BoundaryValueProblem, {
            "rhs": rhs, "boundary": lambda a, b, p: (a.u, b.u), "states": ["u", "v"], "parameters": {"q": 1.0},
        }),
        "Segment": (contin.Segment, {"rhs": rhs, "states": ["u", "v"]}),
        "SegmentedProblem": (contin.SegmentedProblem, {
            "segments": [contin.Segment(rhs, ["u", "v"])], "boundary": lambda a, b, p: (a[0].u, b[0].u),
            "parameters": {"q": 1.0},
        }),
        "VariationalProblem": (contin.VariationalProblem, {
            "energy": lambda t, x, w, p: w.y**2, "states": ["y"], "parameters": {"q": 1.0}, "ends": lambda a, b, p: (a.y, b.y),
        }),
        "VariationalSegment": (contin.VariationalSegment, {"energy": lambda s, x, w, p: w.y**2, "states": ["y"]}),
        "SegmentedVariationalProblem": (contin.SegmentedVariationalProblem, {
            "segments": [contin.VariationalSegment(lambda s, x, w, p: w.y**2, ["y"])], "parameters": {"q": 1.0},
            "ends": lambda a, b, p: (a[0].y, b[0].y),
        }),
        "Search": (contin.Search, {"values": [1.0]}),
        "Settings": (contin.Settings, {}), "MeshControl": (contin.MeshControl, {}), "Newton": (contin.Newton, {}),
        "further": (lowlevel.further, {"known": [start], "name": "a", "settings": FEW}),
        "gradient": (lowlevel.gradient, {"function": lambda x: x**2, "by": ["x"]}),
        "minimum": (lowlevel.minimum, {"potential": lambda w: w[0] ** 2, "start": [1.0]}),
        "root": (lowlevel.root, {"residual": lambda w: (w[0],), "start": [1.0]}),
        "least": (lowlevel.least, {"potential": lambda w: w[0] ** 2, "start": [1.0]}),
        "Point.plot": (orbit.plot, {"what": "series"}), "Point.segment": (orbit.segment, {"index": 0}),
        "Point.sensitivities": (fold.sensitivities, {}), "Branch.plot": (branch.plot, {}),
        "Branch.labelled": (branch.labelled, {"label": "LP"}), "Branch.column": (branch.column, {"name": "a"}),
        "Diagram.plot": (found.plot, {}), "PhaseResponse.plot": (orbit.phase_response().plot, {"states": ["x"]}),
    }  # fmt: skip


def test_all_public_names_are_called(calls):
    names = {name for name in contin.__all__ if not inspect.ismodule(getattr(contin, name))}
    assert not names - GIVEN_BACK - set(calls)


@pytest.mark.filterwarnings("ignore::DeprecationWarning", "ignore::contin.errors.InterpretedWarning")
@pytest.mark.filterwarnings("ignore:More than 20 figures")  # they stay open until the test ends
@pytest.mark.sample(4)
@pytest.mark.parametrize("value", WRONG, ids=lambda value: type(value).__name__)
def test_wrong_types(value, calls, tmp_path, monkeypatch):
    """Files that are not there are an OSError, and columns that are not there a KeyError, as documented."""
    monkeypatch.chdir(tmp_path)  # "text" is a file
    said = []
    for name, (call, right) in calls.items():
        arguments = [name for name, each in inspect.signature(call).parameters.items() if each.kind != each.VAR_KEYWORD]
        for argument in set(arguments) - {"axes"}:
            try:
                call(**{**right, argument: value})
            except contin.ContinError as error:
                assert "\n" not in str(error)
            except Exception as error:
                if not (isinstance(error, (OSError, KeyError)) and isinstance(value, str)):
                    said.append(f"{name}({argument}={value!r}): {error!r}")
    assert not said, "\n".join(["", *said])


@pytest.mark.parametrize("call, sentence", [
    (lambda: contin.Event(None, "one", abs), "label: None must be a name"),
    (lambda: contin.Event("UZ", "one", 3), "function: 3 must be a function"),
    (lambda: contin.cycle(None, [1.0]), "problem: None must be a CycleProblem"),
    (lambda: contin.save(None, "b.npz"), "branch: None must be a Branch"),
    (lambda: contin.load(None, "b.npz"), "problem: None must be a BoundaryValueProblem or an AlgebraicProblem"),
    (lambda: contin.load(PARABOLA, 1), "path: 1 must be a name or a path"),
    (lambda: auto07p.read_auto(None), "folder: None must be a name or a path"),
    (lambda: auto07p.read_auto(".", parameters={"mu": 1}), "must be a dict from whole numbers to names"),
    (lambda: lowlevel.read_columns(3), "path: 3 must be a name or a path"),
    (lambda: lowlevel.minimum(None, [0.0]), "function: None must be a function"),
    (lambda: lowlevel.root(lambda w: w, [None]), "start: None must be a number"),
    (lambda: contin.trace(None), "start: None must be a Point"),
    (lambda: contin.solve(PARABOLA, [1.0], free="a"), "free: 'a' must be a list of names"),
    (lambda: contin.Point.sensitivities(3), "point: 3 must be a Point"),
])  # fmt: skip
def test_the_sentence_names_the_argument(call, sentence):
    with pytest.raises(contin.ProblemError) as told:
        call()
    assert sentence in str(told.value)


@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_a_keyword_that_there_is_not_is_named_with_the_one_that_was_meant(calls):
    for call, right in (one for name, one in calls.items() if name in contin.__all__ or "." in name):
        known = list(inspect.signature(call).parameters)
        with pytest.raises(contin.ProblemError, match="there is no argument 'wrong_one'; known are "):
            call(**right, wrong_one=1)
        with pytest.raises(contin.ProblemError, match=f"did you mean '{known[0]}'"):
            call(**right, **{f"{known[0]}_": 1})


@pytest.mark.parametrize("call, sentence", [
    (lambda start: contin.trace(start, limt={"a": (0, 1)}), "no argument 'limt' (did you mean 'limits'?)"),
    (lambda start: contin.trace(start, freee=["a"]), "no argument 'freee' (did you mean 'free'?)"),
    (lambda start: contin.trace(start, direction="booth"), "direction: 'booth' must be +1 or -1 ('both' for trace"),
    (lambda start: contin.trace(start, free=["a"], scales={"X": 1}), "scales: 'X' must be one of a, b, x (did you mean 'x'?)"),
    (lambda start: contin.diagram(start, free=["a"], scales={"X": 1}), "scales: 'X' must be one of a, b, x"),
    (lambda start: contin.Search([1.0], sizes="x"), "sizes: 'x' must be a list of numbers"),
    (lambda start: contin.solve(PARABOLA, [1.0], {"aa": 1.0}), "parameter 'aa' is not one of a, b (did you mean 'a'?)"),
])  # fmt: skip
def test_the_sentence_names_what_was_meant(call, sentence):
    with pytest.raises(contin.ProblemError) as told:
        call(contin.solve(PARABOLA, [1.0]))
    assert sentence in str(told.value)


def test_a_public_name_that_there_is_not_is_named_with_the_one_that_was_meant():
    assert lowlevel.meant("trase", ["trace"])  # `contin` does not have this name from here on
    with pytest.raises(AttributeError, match=r"contin has no 'trase' \(did you mean 'trace'\?\)"):
        contin.trase  # noqa: B018


def test_none_is_taken_where_it_is_the_default():
    """Also where the annotation has bounds."""
    assert contin.solve(PARABOLA, [1.0], degree=None, mesh=None)["x"] == pytest.approx(1.0)
    assert contin.Settings(angle=None, accuracy=None) == contin.Settings()
