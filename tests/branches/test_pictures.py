"""Pictures: stable parts solid, unstable ones dashed, colours by wavenumber, marks that say what they are."""

import runpy

import pytest
from matplotlib.colors import same_color
from matplotlib.figure import Figure

from branches.config import parse
from branches.diagram import run_diagram
from branches.display import Display
from branches.draw_branch import curve
from branches.draw_diagram import colour_of
from branches.job import run_branch
from branches.read import read_branch


def drawn(folder, text):
    """The axes of a branch, without strips."""
    run_branch(parse(text, "scene"), folder / "x.h5", Display(silent=True))
    axes = Figure().subplots()
    curve(axes, read_branch(folder / "x.h5"), [])
    return axes


def test_stable_is_solid_and_unstable_is_dashed(tmp_path):
    axes = drawn(tmp_path, "{m: 1, n: 2, stability: true}")
    stable, unstable = axes.lines
    assert stable.get_linestyle() == "-" and unstable.get_linestyle() == "--"
    assert stable.get_ydata()[-1] == pytest.approx(unstable.get_ydata()[0], abs=0.05)  # both reach the fold
    words = [text.get_text() for text in axes.get_legend().get_texts()]
    assert words == ["stable", "unstable", "bifurcation of a circle", "fold"]
    assert same_color(stable.get_color(), colour_of(2))


def test_a_limit_is_said_to_be_the_scenes(tmp_path):
    axes = drawn(tmp_path, "{law: flat rod, m: 3, n: 1, limits: {kappa_n: [-100, 20]}}")
    words = [text.get_text() for text in axes.get_legend().get_texts()]
    assert words == ["bifurcation of a circle", "limit of the scene"] and axes.get_title().startswith("flat rod,")
    assert len(axes.lines) == 1 and same_color(axes.lines[0].get_color(), colour_of(1))


def test_the_script_says_which_family_it_draws(tmp_path, call, root):
    scene = parse("{m: 1, n: 2, nu: [0.3, 0.31], limits: {kappa_n: [0, 20]}, stride: 50}", "scene")
    run_diagram(scene, tmp_path / "two", Display(silent=True))
    main = runpy.run_path(str(root / "scripts" / "plot_diagram.py"))["main"]
    done = call(main, tmp_path / "two", "--out", "x.png", "--plain")
    assert done.out.startswith("drawn: ribbon, nu = 0.3; the diagram also has ribbon nu = 0.31 (--law, --nu)\n")
    assert call(main, tmp_path / "two", "--out", "x.png", "--plain", "--nu", "0.31").out == "written to x.png\n"
