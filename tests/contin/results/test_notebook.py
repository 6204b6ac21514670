"""Tables, plots and HTML of a branch in a notebook. The branch is that of Bratu's problem."""

import dataclasses
import math
import subprocess
import sys
from xml.etree import ElementTree

import numpy as np
import pytest
from scipy.optimize import brentq

import contin
from bank.closed_forms import bratu, bratu_fold, bratu_load, bratu_mean, parabola


@pytest.fixture(scope="module")
def branch():
    start = contin.solve(bratu(), [0, 0])
    return contin.trace(start, free=["lam"], limits={"lam": (0, 4), "mean": (-1, 3)}, zeros={"lam": [2.0]})


def test_table_has_every_point(branch):
    table = branch.to_pandas()
    assert len(table) == len(branch)
    columns = ["label", "name", "arclength", "intervals", "degree", "iterations", "discretization_error", "lam", "mean", "norm"]
    assert list(table) == columns
    assert np.array_equal(table["lam"], branch.column("lam"))
    assert table[table.label == "LP"].lam.iloc[0] == pytest.approx(bratu_fold(), abs=1e-11)
    assert contin.Branch().to_pandas().empty


def test_norm_is_the_root_mean_square_of_the_states(branch):
    point = branch.points[3]
    t = np.linspace(0, 1, 2001)
    states = point.system.evaluate(point.x, t)
    assert branch.to_pandas().norm[3] == pytest.approx(math.sqrt(np.trapezoid((states**2).sum(axis=1), t)), rel=1e-6)


@pytest.mark.full
def test_stable_parts_are_solid_and_unstable_ones_dashed():
    """A soap film between two rings: a minimum of the area up to the fold, not one beyond it."""
    from matplotlib.figure import Figure

    film = contin.VariationalProblem(
        energy=lambda t, x, w, p: x.r * (p.gap**2 + w.r**2) ** 0.5,
        states=["r"],
        parameters={"gap": 0.4},
        ends=lambda a, b, p: (a.r - 1, b.r - 1),
    )
    branch = contin.trace(contin.solve(film, [1.0]), free=["gap"], limits={"gap": (0.4, 1.5)}, errors=False)
    axes = branch.plot(axes=Figure().subplots())
    solid, dashed = axes.lines
    assert (solid.get_label(), dashed.get_label()) == ("stable", "unstable")
    assert solid.get_linestyle() == "-" and dashed.get_linestyle() == "--"
    (fold,) = branch.labelled("LP")
    assert solid.get_xdata()[-1] == dashed.get_xdata()[0] == fold["gap"]


def test_plot(branch):
    from matplotlib.figure import Figure

    axes = branch.plot(axes=Figure().subplots())
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("lam", "mean")
    dots = axes.collections[0].get_offsets()
    assert np.array_equal(dots, np.column_stack([branch.column("lam"), branch.column("mean")]))
    words = {text.get_text() for text in axes.get_legend().get_texts()}
    assert words == {"end (EP)", "given value (UZ)", "fold (LP)"}
    axes = branch.plot("arclength", "norm", axes=Figure().subplots())
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("arclength of the branch", "norm (root mean square over t)")


def test_curves_have_the_tangents_of_the_branch(branch):
    """Of the closed form (`bratu_load`, `bratu_mean`) they are off by far less than straight lines between the points."""
    load, mean = branch.curve("lam", "mean")
    assert set(branch.column("lam")) <= set(load)

    def off(load, mean):
        s = np.array([brentq(lambda s, m=m: bratu_mean(s) - m, 0, 8) for m in mean])
        return max(abs(a - bratu_load(b)) for a, b in zip(load, s))

    parts = (len(load) - 1) // (len(branch) - 1)
    middles = slice(parts // 2, None, parts)
    straight = off(*(branch.column(name)[:-1] / 2 + branch.column(name)[1:] / 2 for name in ("lam", "mean")))
    assert off(load[middles], mean[middles]) < straight / 20 and straight > 0.01


def test_curves_where_tangents_are_missing(branch):
    """A step with one tangent is a parabola, one with none a straight line: neither overshoots."""
    point = branch.points[4]
    nowhere = [dataclasses.replace(point, tangent=np.full_like(point.tangent, np.nan)) for point in branch.points]
    straight = contin.Branch(nowhere).curve("lam", "mean")
    middle = (branch.column("lam")[4] + branch.column("lam")[5]) / 2
    assert np.isclose(straight[0], middle, rtol=1e-12).any()
    one = contin.Branch([point, nowhere[5]]).curve("lam", "mean")
    bend = np.diff(one, n=3, axis=1)
    assert np.abs(bend).max() < 1e-12 < np.abs(np.diff(one, n=2, axis=1)).max()


def test_the_branch_of_a_pitchfork_bends_into_its_branch_point():
    """x = +-sqrt(a): the cubic in the arclength is off by less than a hundredth of the first step's height."""
    pitchfork = contin.AlgebraicProblem(lambda u, p: (u.x * (p.a - u.x**2),), ["x"], {"a": 0.0})
    found = contin.diagram(contin.solve(pitchfork, [0.0], {"a": -1.0}), free=["a"], limits={"a": (-1, 1)})
    bent = [branch.curve("a", "x") for branch in found.branches if branch.points[-1]["x"] != 0]
    assert len(bent) == 2
    for a, x in bent:
        assert np.abs(a - x**2).max() < 1e-3


def test_errors_are_drawn_where_they_are_asked_for():
    from matplotlib.figure import Figure

    coarse = contin.solve(bratu(), [0, 0], intervals=2, degree=2)
    control = contin.MeshControl(0.9, 2, 2, 0)
    branch = contin.trace(coarse, free=["lam"], limits={"mean": (-1, 2)}, mesh=control, progress=False)
    plain, barred = (branch.plot(axes=Figure().subplots(), errors=errors) for errors in (False, True))
    assert not plain.containers and len(barred.containers) == 1
    across = barred.containers[0][2][0].get_segments()
    point = branch.points[-1]
    here = (point.discretization_error + point.newton_error) * (1 + point["lam"])
    assert np.ptp(across[-1][:, 0]) == pytest.approx(2 * point.errors.get("lam", here))


def test_a_click_on_a_point_shows_its_label_and_its_values(branch):
    from matplotlib.backend_bases import MouseEvent
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure()
    canvas = FigureCanvasAgg(figure)
    axes = branch.plot(axes=figure.subplots())
    canvas.draw()
    (box,) = [text for text in axes.texts if text.get_bbox_patch()]
    assert not box.get_visible()
    fold = branch.labelled("LP")[0]
    at = axes.transData.transform((fold["lam"], fold["mean"]))
    canvas.callbacks.process("button_press_event", MouseEvent("button_press_event", canvas, *at, 1))
    assert box.get_visible()
    lines = box.get_text().splitlines()
    assert lines[0].startswith("point ") and lines[0].endswith(": LP (fold) lam")
    assert lines[1].startswith("lam = 3.51383071") and "±" in lines[1]
    assert lines[2] == f"mean = {fold['mean']:.10g}"


def test_columns_that_are_not_there(branch):
    with pytest.raises(contin.ProblemError, match="y: 'energy' is no column; there are lam, mean, arclength, norm"):
        branch.plot(y="energy")
    with pytest.raises(contin.ProblemError, match="no points"):
        contin.Branch().plot()


def test_html_is_well_formed_and_lists_labelled_points(branch):
    root = ElementTree.fromstring(branch._repr_html_())
    assert root.find("{http://www.w3.org/2000/svg}svg") is not None
    rows = [["".join(cell.itertext()) for cell in row] for row in root.iterfind("table/tbody/tr")]
    assert [row[1] for row in rows] == [point.label for point in branch if point.label]
    assert f"{branch.labelled('LP')[0]['lam']:.8g}" in [row[3] for row in rows]
    assert str(branch.stop).split(";")[0] in "".join(root.find("p").itertext())
    assert contin.Branch()._repr_html_() == "<div><p><b>Branch</b> of 0 points</p></div>"


@pytest.mark.full
def test_points_and_diagrams_have_tables_in_notebooks(branch):
    fold = branch.labelled("LP")[0]
    root = ElementTree.fromstring(fold._repr_html_())
    assert "".join(root.find("p").itertext()) == "Point: LP (fold) lam"
    rows = [[cell.text for cell in row] for row in root.iterfind("table/tbody/tr")]
    assert [row[0] for row in rows] == ["lam", "mean"] and rows[0][1] == f"{fold['lam']:.10g}"
    assert float(rows[0][2]) == pytest.approx(fold.errors["lam"], rel=0.5)
    root = ElementTree.fromstring(contin.Diagram([branch] * 30)._repr_html_())
    assert root.find("{http://www.w3.org/2000/svg}svg") is not None
    rows = [[cell.text for cell in row] for row in root.iterfind("table/tbody/tr")]
    assert len(rows) == 20 and rows[0] == ["0", str(len(branch)), "2 EP, 2 UZ, 1 LP", str(branch.stop)]
    assert root.findall("p")[-1].text == "and 10 more rows"


def test_a_problem_without_functionals_is_drawn_by_its_first_state_or_its_norm():
    """The norm of an equilibrium would hide its sign, and with it one of the arms of a pitchfork."""
    branch = contin.trace(contin.solve(parabola(), [1.0]), free=["mu"], limits={"mu": (0.5, 2)})
    axes = branch.plot()
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("mu", branch[0].system.named_states[0])
    plain = contin.BoundaryValueProblem(lambda t, u, p: (u.v, -p.q), lambda a, b, p: (a.u, b.u), ["u", "v"], {"q": 8.0})
    axes = contin.trace(contin.solve(plain, [0, 0]), free=["q"], limits={"q": (8, 9)}, progress=False).plot()
    assert axes.get_ylabel() == "norm (root mean square over t)"


def test_what_differs_by_its_error_only_is_a_straight_line():
    """x = 1 for every b, and y = b / 10, in one picture after the other."""
    from matplotlib.figure import Figure

    flat = contin.AlgebraicProblem(lambda u, p: ((u.x - 1) * (3 + math.sin(7 * p.b)), u.y - p.b / 10), ["x", "y"], {"b": 1.0})
    branch = contin.trace(contin.solve(flat, [1.1, 0.0]), free=["b"], limits={"b": (1, 3)})
    axes = branch.plot("b", "x", axes=Figure().subplots())
    assert axes.get_ylim() == pytest.approx((0.5, 1.5), abs=1e-9)
    low, high = branch.plot("b", "y", axes=axes).get_ylim()
    assert low < 0.1 and 1 < high < 1.2


def test_contin_alone_imports_neither_library():
    code = "import sys, contin; print([name for name in ('matplotlib', 'pandas') if name in sys.modules])"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True).stdout.strip() == "[]"
