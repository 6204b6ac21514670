"""Tables, plots and HTML of a branch in a notebook. The branch is that of Bratu's problem."""

import math
import subprocess
import sys
from xml.etree import ElementTree

import numpy as np
import pytest
from bank.closed_forms import bratu, bratu_fold, parabola

import contin


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
    states = point.system.states(point.x)
    assert branch.to_pandas().norm[3] == pytest.approx(math.sqrt((states[:, 0] ** 2 + states[:, 1] ** 2).mean()))


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
    assert len(solid.get_xdata()) + len(dashed.get_xdata()) == len(branch) + 1


def test_plot(branch):
    from matplotlib.figure import Figure

    axes = branch.plot(axes=Figure().subplots())
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("lam", "mean")
    assert np.array_equal(axes.lines[0].get_xdata(), branch.column("lam"))
    assert {text.get_text() for text in axes.get_legend().get_texts()} == {"EP", "UZ", "LP"}
    axes = branch.plot("arclength", "norm", axes=Figure().subplots())
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("arclength", "norm")


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


def test_a_problem_without_functionals_is_drawn_against_its_norm():
    axes = contin.trace(contin.solve(parabola(), [1.0]), free=["mu"], limits={"mu": (0.5, 2)}).plot()
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("mu", "norm")


def test_contin_alone_imports_neither_library():
    code = "import sys, contin; print([name for name in ('matplotlib', 'pandas') if name in sys.modules])"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True).stdout.strip() == "[]"
