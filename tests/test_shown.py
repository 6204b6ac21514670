"""What people print, and all that they reach from there by public names, fits on a screen and shows no addresses."""

import dataclasses
import inspect
import math
from pathlib import Path
from xml.etree import ElementTree

import pytest

import contin
import ribbon_model
from branches.read import read_branch
from branches.run.display import Display
from branches.run.runner import run_scene
from branches.scene.parse import load
from contin import auto07p, lowlevel

CONFIGS = Path(__file__).parent.parent / "configs"
PACKAGES = ("contin", "ribbon_model", "branches")
#: Lines and columns of a screen.
LINES, COLUMNS = 24, 120
#: Elements of a sequence that are looked at.
FIRST = 30


def is_ours(thing):
    return type(thing).__module__.partition(".")[0] in PACKAGES


def parts(thing):
    """What a person reaches from an object: its elements, or its fields with public names."""
    if isinstance(thing, dict):
        return [*thing.values()]
    if isinstance(thing, (list, tuple)) and not hasattr(thing, "_fields"):
        return thing[:FIRST]
    if not is_ours(thing):
        return []
    names = {*getattr(thing, "_fields", ()), *getattr(thing, "__dict__", ()), *getattr(type(thing), "model_fields", ())}
    names |= {field.name for field in dataclasses.fields(thing)} if dataclasses.is_dataclass(thing) else set()
    return [getattr(thing, name, None) for name in sorted(names) if not name.startswith("_")]


def reached(things):
    """Return all objects of our packages that are reached from some."""
    seen, todo = {}, [*things]
    while todo:
        thing = todo.pop()
        if id(thing) not in seen:
            seen[id(thing)] = thing  # kept, so that no other object takes its id
            todo += parts(thing)
    return [thing for thing in seen.values() if is_ours(thing)]


def faults(thing):
    """Return what is wrong with the texts of an object."""
    found = set()
    for text in (repr(thing), str(thing)):
        rows = sum(max(1, math.ceil(len(line) / COLUMNS)) for line in text.splitlines())
        found |= {f"{rows} rows"} if rows > LINES else set()
        found |= {"an address"} if " at 0x" in text else set()
    return found


def of_contin():
    """Problems of every kind, with branches, a diagram, a curve in two parameters, and parts for builders."""
    cusp = contin.AlgebraicProblem(lambda u, p: (p.a + p.b * u.x - u.x**3,), ["x"], {"a": 0.0, "b": 1.0})
    branch = contin.trace(contin.solve(cusp, [0.0]), free=["a"], limits={"a": (-2, 2)}, progress=False)
    fold = branch.labelled("LP")[0]
    pair = contin.AlgebraicProblem(lambda u, p: (u.x * (p.a - u.x**2), u.y * (p.a - u.y**2)), ["x", "y"], {"a": -1.0})
    double = contin.trace(contin.solve(pair, [0.0, 0.0]), free=["a"], limits={"a": (-1, 1)}, progress=False)
    column = contin.BoundaryValueProblem(
        lambda t, u, p: (u.v, -p.P * math.sin(u.u)), lambda a, b, p: (a.v, b.v), ["u", "v"], {"P": 5.0}
    )
    buckled = contin.diagram(contin.solve(column, (0.0, 0.0)), free=["P"], limits={"P": (5, 12)}, depth=1, progress=False)
    wall = contin.Segment(lambda s, u, p: (-u.flux / p.k, 0.0), ["heat", "flux"])
    walls = contin.SegmentedProblem([wall], lambda a, b, p: (a[0].heat - 1, b[0].heat), {"k": 1.0})
    film = contin.VariationalProblem(
        energy=lambda t, x, w, p: x.r * (p.gap**2 + w.r**2) ** 0.5, states=["r"], parameters={"gap": 0.4},
        ends=lambda a, b, p: (a.r - 1, b.r - 1),
    )  # fmt: skip
    catenoid = contin.solve(film, [1.0])
    string = contin.VariationalSegment(lambda s, x, w, p: w.y**2 / 2 - p.load * x.y, ["y"])
    strings = contin.SegmentedVariationalProblem(
        [string] * 2, {"load": 1.0}, ends=lambda a, b, p: (a[0].y, a[1].y, b[0].y - b[1].y)
    )

    def circle(t):
        return 0.6 * math.cos(2 * math.pi * t), 0.6 * math.sin(2 * math.pi * t)

    def field(u, p):
        growth = p.mu - u.x**2 - u.y**2
        return growth * u.x - u.y, u.x + growth * u.y

    orbit = contin.solve(contin.CycleProblem(field, ["x", "y"], {"mu": 0.25}), circle, {"period": 6})
    front = contin.ConnectionProblem(field, ["x", "y"], {"mu": 0.25}, unstable=1, stable=1)
    run = lowlevel.Continuation(fold.system, fold.x)
    functions = lowlevel.Batch([lambda u, p: (u.x * p.a,)], [1], ["x"], ["a"], times=False)
    return [
        branch, fold, double, buckled, contin.curve(fold, free=["a", "b"], limits={"b": (-1, 2)}, progress=False),
        contin.solve(walls, [0, 0]), string, contin.solve(strings, [[0], [0]]),
        catenoid, catenoid.second_variation(), orbit, orbit.floquet(), front, functions,
        contin.MapProblem(lambda u, p: (p.r * u.x * (1 - u.x),), ["x"], {"r": 2.0}), run, run.state,
        lowlevel.Trial.without_tangent(fold.system, fold.x), contin.Event("UZ", "x", lambda trial: trial["a"]),
        contin.Settings(),
        contin.Search([1.0]), lowlevel.further([branch[0]], "a"), orbit.phase_response(),
        branch[0].spectrum(), lowlevel.Undetermined.MODE,
        lowlevel.basis(4), contin.ProblemError("a sentence"), contin.ConvergenceError("a sentence"),
        lowlevel.correct(lowlevel.Algebraic(cusp, []), [1.0]), contin.Reason.LIMIT, lowlevel.Colour.BLUE, lowlevel.Label.FOLD,
    ]  # fmt: skip


def of_strips(folder):
    """Results of scenes of both kinds, with what is made of them, and the public objects of `ribbon_model`."""
    found = [value for name in ribbon_model.__all__ if not inspect.ismodule(value := getattr(ribbon_model, name))]
    for name in ("m1_n2", "open_roller"):
        scene = load(CONFIGS / f"{name}.yaml")
        run_scene(scene, folder / f"{name}.h5", Display(silent=True))
        branch = read_branch(folder / f"{name}.h5")
        found += [
            branch,
            scene,
            branch.shape(0),
            branch.pieces(),
            branch.stages,
            branch.columns,
            branch.snaps(),
            [*branch.marks()],
        ]
    closed = read_branch(folder / "m1_n2.h5").solution(0)
    strip = ribbon_model.Strip(5.65e-3, 0.65e-3, 3.0, 0.4, 0.3, 200e9)
    return [*found, closed, closed.equilibrium(), branch.scene.strip(), strip]


@pytest.fixture(scope="module")
def objects(tmp_path_factory):
    folder = tmp_path_factory.mktemp("shown")
    stored = folder / "branch.npz"
    made = of_contin()
    contin.save(made[0], stored)
    autos = auto07p.read_auto(CONFIGS.parent / "tests" / "contin" / "search" / "auto_07p", "bratu")
    return reached([*made, *of_strips(folder), lowlevel.read_columns(stored), *autos])


@pytest.mark.full
def test_everything_is_printed_on_a_screen_and_without_addresses(objects):
    kinds = {type(thing) for thing in objects}
    wrong = {f"{kind.__module__}.{kind.__qualname__}": set() for kind in kinds}
    for thing in objects:
        wrong[f"{type(thing).__module__}.{type(thing).__qualname__}"] |= faults(thing)
    assert not {name: what for name, what in wrong.items() if what}
    assert len(kinds) > 70


@pytest.mark.full
def test_every_public_class_is_among_them(objects):
    public = [getattr(module, name) for module in (contin, lowlevel, auto07p, ribbon_model) for name in module.__all__]
    kinds = {type(thing) for thing in objects}
    missing = {cls.__name__ for cls in public if inspect.isclass(cls) and not any(issubclass(kind, cls) for kind in kinds)}
    assert not missing


@pytest.mark.full
def test_html_is_well_formed(objects):
    shown = [thing for thing in objects if hasattr(thing, "_repr_html_")]
    assert {type(thing).__name__ for thing in shown} >= {"Branch", "Diagram", "Point", "ClosedBranch", "OpenBranch"}
    for kind in {type(thing) for thing in shown}:
        text = next(thing for thing in shown if type(thing) is kind)._repr_html_()
        rows = ElementTree.fromstring(text).findall(".//tbody/tr")
        assert 0 < len(rows) <= LINES and " at 0x" not in text


def test_long_objects_are_cut():
    names = [f"field{i}" for i in range(300)]
    text = repr(dataclasses.make_dataclass("Wide", names, namespace={"__repr__": lowlevel.shown})(*range(300)))
    assert len(text) < LINES * COLUMNS and text.endswith(" more)")
