"""Pictures: stable parts solid, unstable ones dashed, colours by wavenumber, marks that say what they are."""

import itertools
import math
import re
from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest
from crossings import crossings
from matplotlib.colors import same_color, to_rgb
from matplotlib.figure import Figure
from matplotlib.text import Text
from scipy.interpolate import CubicSpline

from branches import plot
from branches.draw import strip as draw_strip
from branches.draw.picture import figure, panel
from branches.draw.solid import widest
from branches.draw.style import colour_of
from branches.export import __main__ as export
from branches.export.film import drawn as frames
from branches.export.film import evenly
from branches.graph.closed import preview
from branches.graph.picture import WINDOW, circles, conjugate, heights, legend, lines
from branches.graph.picture import figure as diagram_figure
from branches.paper.diagram import FIG12
from branches.read import read_branch
from branches.run.display import Display
from branches.run.many import run_many
from branches.run.runner import run_scene
from branches.scene.parse import load, parse
from branches.store.files import write_picture
from contin.lowlevel import Colour
from ribbon_model import exact


def branch_of(folder, scene):
    """The branch of a scene, given as text or read already."""
    config = parse(scene, "scene") if isinstance(scene, str) else scene
    run_scene(config, folder / "x.h5", Display(silent=True), overwrite=True)
    return read_branch(folder / "x.h5")


def drawn(folder, scene):
    """The axes of a branch, without strips."""
    axes = Figure().subplots()
    branch = branch_of(folder, scene)
    panel(axes, branch, branch.panels[0], [])
    axes.set_title(branch.caption)
    return axes


def test_stable_is_solid_and_unstable_is_dashed(tmp_path):
    axes = drawn(tmp_path, "{m: 1, n: 2, stability: true}")
    stable, unstable = (line for line in axes.lines if len(line.get_xdata()))
    assert stable.get_linestyle() == "-" and unstable.get_linestyle() == "--"
    assert stable.get_ydata()[-1] == pytest.approx(unstable.get_ydata()[0], abs=0.05)  # both reach the fold
    words = [text.get_text() for text in axes.get_legend().get_texts()]
    assert words == ["stable", "unstable, with the index", "bifurcation of a circle", "fold"]
    assert same_color(stable.get_color(), colour_of(2))


def test_a_limit_is_said_to_be_the_scenes(tmp_path):
    axes = drawn(tmp_path, "{law: flat rod, m: 3, n: 1, limits: {kappa_n: [-100, 20]}}")
    words = [text.get_text() for text in axes.get_legend().get_texts()]
    assert words == ["stability not computed", "bifurcation of a circle", "limit of the scene"]
    assert axes.get_title().startswith("flat rod,") and same_color(axes.lines[0].get_color(), colour_of(1))


@pytest.mark.full
def test_the_script_says_which_family_it_draws(tmp_path, call):
    scene = parse("{m: 1, n: 2, nu: [0.3, 0.31], limits: {kappa_n: [0, 20]}, stride: 50}", "scene")
    run_many(scene, tmp_path / "two", Display(silent=True))
    main = plot.main
    done = call(main, tmp_path / "two", "--out", "x.png", "--plain")
    assert done.out.startswith("drawn: ribbon, nu = 0.3; the diagram also has ribbon, nu = 0.31 (--law, --nu)\n")
    assert call(main, tmp_path / "two", "--out", "x.png", "--plain", "--nu", "0.31").out == "written to x.png\n"


def test_colours_of_the_palette_are_in_one_place(root):
    """And no picture takes matplotlib's own, among which red and green lines look alike to many."""
    files = [path for folder in ("contin", "ribbon_model", "branches", "scripts") for path in (root / folder).rglob("*.py")]
    texts = {path.relative_to(root).as_posix(): path.read_text(encoding="utf-8") for path in files}
    where = {name for name, text in texts.items() if any(f'"{colour}"' in text for colour in Colour if colour != "#000000")}
    assert where == {"contin/results/marks.py"}
    own = re.compile(r"""["'](tab:\w+|red|green|C\d|r|g)["']""")
    assert not [name for name, text in texts.items() if re.search(r"color=" + own.pattern, text)]


# --- open strips ------------------------------------------------------------------------------------------------------

STROKE = """
material: {}
dimensions: {width: 12 mm, thickness: 0.2 mm, length: 300 mm, poisson_ratio: 0.3, youngs_modulus: 200 GPa}
numbers: {distance: 0.28}
begin: arch
directions: {stroke: [0, 1, 0]}
stages: [{follow: distance, to: 0.25}, {follow: stroke, to: 0.1}]
"""
HEAVY = """
material: {law: flat rod, nu: 0.3}
finish: free
directions: {weight: [0, -1, 0]}
stages: [{follow: weight, to: 3}]
"""


@pytest.fixture(scope="module")
def stroke(tmp_path_factory):
    return branch_of(tmp_path_factory.mktemp("stroke"), STROKE)


@pytest.mark.full
def test_a_horizontal_strip_is_horizontal_and_its_clamp_stays_where_it_is(tmp_path):
    """The cantilever begins along the horizontal and sinks; at weight 0 it is a horizontal line from end to end."""
    branch = branch_of(tmp_path, HEAVY)
    strips = branch.posed(branch.kept().tolist())
    seen = [strip.centreline @ branch.view.axes[:2].T for strip in strips.values()]
    assert np.ptp(seen[0][:, 1]) < 1e-12 and np.ptp(seen[0][:, 0]) == pytest.approx(1)
    assert np.ptp([places[0] for places in seen], axis=0).max() < 1e-12
    assert np.diff([places[-1, 1] for places in seen]).max() < 0
    picture = figure(branch, 3)
    (arrow,) = [text for text in picture.findobj(Text) if text.get_text() == "weight"]
    assert arrow.axes is picture.subfigs[0].axes[0]
    axes = picture.subfigs[1].axes[0]
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("weight per length in B/L³", "displacement along the normal in L")


def test_a_scale_is_a_round_length(stroke):
    made = figure(stroke, 2).subfigs[0]
    first = made.axes[0]
    (bar,) = first.lines
    (words,) = [text.get_text() for text in first.texts]
    assert words == "0.1 m" and np.ptp(bar.get_xdata()) == pytest.approx(0.1 / 0.3)  # the strip has length 1 there
    assert not any(axes.lines for axes in made.axes[1:])
    seen = figure(stroke, 1, view=(-90.0, 90.0)).subfigs[0].axes[0].images[0].get_array()
    assert np.count_nonzero(seen[..., 3].any(axis=1)) < 30  # from above, an arch is a line


def test_the_force_of_a_stroke_is_the_rate_of_the_energy(stroke):
    """In N, J and m; by the spline through the points of the stage."""
    table = stroke.to_pandas(units=True)
    table = table[table["stage"] == 2].drop_duplicates("stroke [m]")
    rate = CubicSpline(table["stroke [m]"], table["energy [J]"])(table["stroke [m]"], 1)
    assert np.abs(rate - table["F_stroke [N]"]).max() < 2e-3 * table["F_stroke [N]"].abs().max()
    assert [panel for panel, *_ in stroke.panels] == ["distance", "stroke"] and stroke.panels[1][1] == "F_stroke"
    assert stroke.axis("F_stroke")[1] == "force along the stroke in N"


@pytest.mark.full
def test_a_notebook_has_the_units_of_the_scene(stroke):
    root = ElementTree.fromstring(stroke._repr_html_())
    head = [cell.text for cell in root.iterfind("table/thead/tr/th")]
    assert head == ["point", "label", "name", "stage", "distance [m]", "stroke [m]", "energy [J]", "index"]
    last = [cell.text for cell in root.findall("table/tbody/tr")[-1]]
    assert last[1] == "EP" and float(last[5]) == pytest.approx(0.1) and float(last[6]) == pytest.approx(0.0230552, rel=1e-5)


@pytest.mark.parametrize(
    ("result", "words", "said"),
    [
        ("d", ("--x", "energy"), "--x: is for a branch, and 'd' is a diagram"),
        ("d", ("--shapes", 0), "--shapes: is for a branch, and 'd' is a diagram"),
        ("b.h5", ("--plain",), "--plain: is for a diagram, and 'b.h5' is a branch"),
        ("b.h5", ("--nu", 0), "--nu: is for a diagram, and 'b.h5' is a branch"),
    ],
)
def test_an_option_for_the_other_kind_of_result_is_refused(call, tmp_path, result, words, said):
    (tmp_path / "d").mkdir()
    done = call(plot.main, result, *words)
    assert done.returncode == 2 and done.err == f"error: {said}\n"


@pytest.mark.parametrize("angles", [(0, 91), (361, 0), (math.nan, 0)])
def test_views_that_there_are_not(call, stroke, tmp_path, angles):
    for command, words in ((plot.main, ("--out", "x.png")), (export.main, ("--movie", "x.gif"))):
        done = call(command, "x.h5", *words, "--view", *angles)
        assert done.returncode == 2 and "the elevation between -90 and 90" in done.err
    assert not [*tmp_path.iterdir()]


@pytest.mark.full
def test_a_film_shows_the_graph_of_the_stage(stroke):
    """The words below the axes: those of one stage for its points, other ones for those of the next stage."""
    points = [0, 4, len(stroke.points) - 1]
    assert stroke.stage_of[points].tolist() == [1, 1, 2]
    first, again, last = (frame[-20:] for frame in frames(stroke, stroke.posed(points), 0.04, 50, stroke.view))
    assert np.array_equal(first, again) and not np.array_equal(first, last)


@pytest.mark.full
def test_texts_hide_no_marks_and_no_other_texts(root, tmp_path):
    branch = branch_of(tmp_path, load(root / "configs" / "open_clamped.yaml"))
    picture = figure(branch)
    picture.draw_without_rendering()
    axes = picture.subfigs[1].axes[1]
    boxes = [text.get_window_extent() for text in axes.texts if text.get_text()]
    assert len(boxes) == 10  # five letters, two folds, the index of three unstable pieces
    assert not any(a.overlaps(b) for a, b in itertools.combinations(boxes, 2))
    frame = axes.get_window_extent()
    assert all(frame.x0 <= box.x0 and box.x1 <= frame.x1 for box in boxes)


# --- diagrams ---------------------------------------------------------------------------------------------------------


def test_dashes_of_a_diagram_mean_unstable_and_colours_mean_wavenumbers():
    graph = preview(parse("{pairs: [[1, 2], [3, 4]], limits: {kappa_n: [-20, 20]}}", "scene"))
    for *_, data in graph.edges(data=True):
        if data["n"] == 2:  # up to its fold (1, 2) is stable: the others stay without an index
            data["index"] = 0 if data["arclength"][0] == 0 else 1
    axes, other = Figure().subplots(1, 2)
    conjugate(axes, graph, "ribbon", 0.3, WINDOW)
    circles(other, graph, "ribbon", 0.3, WINDOW)
    branches = axes.lines[len(other.lines) :]
    styles = [(line.get_linestyle(), line.get_linewidth()) for line in branches]
    assert styles == [("-", 3.4), ("--", 1.4), ("-", 1.4)]
    assert [same_color(line.get_color(), colour_of(n)) for line, n in zip(branches, (2, 2, 4))] == [True] * 3
    words = [handle.get_label() for handle in legend(graph, "ribbon", 0.3)]
    assert words[4:7] == ["branch, stable", "branch, unstable", "branch, stability not known"]


@pytest.mark.parametrize(
    "law, tangled",
    [pytest.param(*case, marks=pytest.mark.full) for case in (("isotropic rod", 0), ("ribbon", 18), ("flat rod", 9))],
)
def test_no_branches_cross_in_the_disentangled_fig12(law, tangled):
    """None is the fewest there can be. The numbers in conjugate coordinates are counted by the same code."""
    found = lines(preview(parse(FIG12, "fig12", [f"law={law}"])), law, 0.3)

    def count(values):
        return crossings([np.column_stack([line.kappa_n, height]) for line, height in zip(found, values)], WINDOW)

    before, after = count([line.kappa_star for line in found]), count(heights(found, WINDOW))
    print(f"{law}: {before} crossings in conjugate coordinates, {after} disentangled")
    assert (before, after) == (tangled, 0)


@pytest.fixture(scope="module")
def previews():
    """Fig. 12 from the quadratures, by law."""
    return {law: preview(parse(FIG12, "fig12", [f"law={law}"])) for law in ("ribbon", "isotropic rod")}


@pytest.fixture(scope="module")
def pictures(previews):
    """Fig. 12 as it is drawn, by law. The tests only read from it."""
    return {law: diagram_figure(graph, law, 0.3) for law, graph in previews.items()}


@pytest.mark.full
@pytest.mark.parametrize("law", ["ribbon", "isotropic rod"])
def test_every_line_of_fig12_has_its_name(law, previews, pictures):
    """In one panel at least; a name stands on no other line, mark or name."""
    made = pictures[law]
    found = [line for line in lines(previews[law], law, 0.3) if np.any(np.abs(line.kappa_n - 3) < 11)]
    names = {text.get_text() for axes in every_axes(made) for text in axes.texts}
    assert {line.name for line in found} <= names
    for axes in every_axes(made):
        drawn = [pixels(axes, line) for line in axes.lines if line.get_zorder() == 2]  # branches, no circles
        boxes = [text.get_window_extent() for text in axes.texts]
        assert not any(one.overlaps(other) for i, one in enumerate(boxes) for other in boxes[:i])
        for box in boxes:
            centre = np.mean(box.get_points(), axis=0)
            crossing = sum(inside(line, box) for line in drawn)
            own = min(np.linalg.norm(line - centre, axis=1).min() for line in drawn)
            assert crossing == (own < 1)  # its own line, or none if a thin line leads to it


def every_axes(made):
    return [axes for panel in made.axes for axes in (panel, *panel.child_axes)]


def pixels(axes, line):
    """Pixels of a drawn line, two apart at most."""
    found = axes.transData.transform(line.get_xydata())
    found = found[np.abs(found).max(axis=1) < 1e4]
    way = np.diff(found, axis=0)
    count = 1 + (np.hypot(*way.T) / 2).astype(int)
    part = (np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)) / np.repeat(count, count)
    return np.vstack([np.repeat(found[:-1], count, axis=0) + part[:, None] * np.repeat(way, count, axis=0), found[-1:]])


def inside(line, box):
    low, high = box.get_points()
    return bool(((line > low + 1) & (line < high - 1)).all(axis=1).any())


@pytest.mark.full
def test_the_inset_shows_the_five_bifurcations_that_are_one_blob(pictures):
    (inset,) = pictures["ribbon"].axes[0].child_axes
    low, high = inset.get_xlim()
    places = [exact.bifurcation(1, n, 0.3) for n in (3, 4, 5, 6, 7)]
    assert low < min(places) and max(places) < high < 3.5
    pixel = [inset.transData.transform((place, 1.0))[0] for place in places]
    assert min(np.diff(pixel)) > 15  # in the panel they are 1 to 5 pixels apart


@pytest.mark.full
def test_lines_do_not_touch_what_they_do_not_meet(previews):
    """At the ends of (3, 4) and (5, 6), (1.79, 5) and (7.44, 5), and beside the circle of (1, 7): by 0.1."""
    found = lines(previews["ribbon"], "ribbon", 0.3)
    drawn = dict(zip((line.name for line in found), zip(found, heights(found, WINDOW))))
    for kappa_n, level, own in ((1.7857, 5, "(3, 4)"), (7.4367, 5, "(5, 6)"), (6.0, 1, "")):
        for name, (line, height) in drawn.items():
            near = np.flatnonzero(np.diff(np.sign(line.kappa_n - kappa_n)))
            assert name == own or all(abs(height[near] - level) > 0.1)


def test_a_line_says_why_it_ends():
    graph = preview(parse("{m: 1, n: 2, limits: {kappa_n: [-20, 20]}}", "scene"))
    node = next(data for _, data in graph.nodes(data=True) if data["kind"] == "circle" and data["covering"] == 3)
    node |= {"kind": "end", "what": "the end of the convex strain energy"}
    del node["covering"]
    words = [handle.get_label() for handle in legend(graph, "ribbon", 0.3)]
    assert words[-1] == "a line ends: the end of the convex strain energy"


@pytest.mark.full
def test_the_legend_of_the_isotropic_rod_says_which_circle_is_stable_and_why(previews):
    words = [handle.get_label() for handle in legend(previews["isotropic rod"], "isotropic rod", 0.3)]
    assert "circle, stable (a minimum of the energy)" in words and "circle, stable to waves, but it turns inside out" in words


def test_a_stage_that_was_not_reached_is_not_in_the_legend(stroke):
    first = {name: (rows := getattr(stroke, name))[rows["stage"] == 1] for name in ("points", "events")}
    kept = stroke.index[stroke.index["point"] < len(first["points"])]
    for branch, told in ((stroke, {"stage 1", "stage 2"}), (replace(stroke, **first, index=kept), {"stage 1"})):
        texts = {text.get_text() for text in figure(branch, 0, x="F_tangent", y="energy").findobj(Text)}
        assert {text for text in texts if text.startswith("stage ")} == told


def test_a_picture_for_a_column_of_a_journal(stroke):
    """Texts of 11 points have 7 at least, and all other sizes are as many parts of the usual ones."""
    usual, narrow = figure(stroke, 0), figure(stroke, 0, size=90 / 25.4)
    assert narrow.get_size_inches()[0] == pytest.approx(90 / 25.4)
    small, large = ({text.get_fontsize() for text in one.findobj(Text) if text.get_text()} for one in (narrow, usual))
    assert sorted(small) == pytest.approx(sorted(0.65 * size for size in large)) and min(small) > 5.8
    assert usual.get_size_inches()[0] == 9
    narrow.draw_without_rendering()
    for axes in every_axes(narrow):  # words of axes are no longer than these, and inside the picture
        box, whole = axes.get_tightbbox(), narrow.bbox.padded(2)
        assert whole.x0 < box.x0 and box.x1 < whole.x1 and whole.y0 < box.y0 and box.y1 < whole.y1
        assert axes.yaxis.label.get_window_extent().height < 1.2 * axes.bbox.height


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--size", "90"], "--size 90: must be a number with mm, cm or in, from 1.5in to 50in, as in 90mm"),
        (["--size", "2mm"], "--size 2mm: must be"),
        (["--style", "none"], "--style none: is no file, nor one of matplotlib's styles: "),
    ],
)
def test_a_size_or_style_that_is_none(arguments, said, call):
    assert call(plot.main, "x.h5", *arguments).err.startswith(f"error: {said}")


def test_measured_points_are_drawn_over_a_branch_and_a_diagram(tmp_path, call, root, stroke):
    """A table of a spreadsheet: semicolons, decimal commas, empty places and units; drawn where they are."""
    from branches.store.measured import read_points

    table = tmp_path / "measured.csv"
    table.write_text("\ufeffstroke [m];F_stroke [N];error_F_stroke\n0,001;-0,5;0,1\n\n0,002;;0,1\n", encoding="utf-8")
    units = {"stroke": "m", "F_stroke": "N"}
    found = read_points(table, units)
    assert found["stroke"].tolist() == [0.001, 0.002] and np.array_equal(found["F_stroke"], [-0.5, np.nan], equal_nan=True)
    for measured, drawn in ((found, 1), ({}, 0)):
        axes = figure(stroke, 0, x="stroke", y="F_stroke", measured=measured).axes[0]
        assert len(axes.containers) == drawn
        assert sum(np.array_equal(line.get_xdata(), found["stroke"]) for line in axes.lines) == drawn
    table.write_text('# of a spreadsheet\n"stroke [mm]","F_stroke [mN]"\n"1","-500"\n')
    found = read_points(table, units)
    assert (*found["stroke"], *found["F_stroke"]) == pytest.approx((0.001, -0.5))
    table.write_text("kappa_n,kappa_star\n2.6,1.04\n")
    assert call(plot.main, root / "configs" / "m1_n2.yaml", "--points", table, "-o", tmp_path / "x.png").returncode == 0


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("kappa_n,kapa_star\n1,2\n", "'kapa_star' (did you mean 'kappa_star'?) must be one of the columns kappa_n, kappa_star"),
        ("kappa_n [1/m],kappa_star\n1,2\n", "kappa_n: is given in '1/m', and must be in no unit"),
        ("kappa_n,kappa_star\n1\n", "line 2 has 1 values, and the first line names 2 columns"),
        ("kappa_n,kappa_star\n1,x\n", "line 2: kappa_star: 'x' must be a number"),
        ("kappa_n,kappa_star\n1,1e400\n", "line 2: kappa_star: 1e400 must be a finite number"),
        ("kappa_n,kappa_star,error_kappa_star\n1,2,-1\n", "line 2: error_kappa_star: -1 must be at least 0"),
        ("kappa_n,kappa_n\n1,1\n", "the column 'kappa_n' is named twice"),
        ("kappa_n\n1\n", "must hold both columns of a picture, kappa_n and kappa_star, and holds kappa_n"),
        ("kappa_n,kappa_star\n", "must hold a line of names of columns and lines of numbers; it has 1 lines"),
    ],
)
def test_measured_points_of_something_else_are_refused(text, said, tmp_path, call, root):
    (tmp_path / "x.csv").write_text(text)
    done = call(plot.main, root / "configs" / "m1_n2.yaml", "--points", tmp_path / "x.csv", "-o", tmp_path / "x.png")
    assert done.returncode == 2 and said in done.err and done.err.count("\n") == 1 and not (tmp_path / "x.png").exists()


def test_the_title_is_that_of_the_data(tmp_path):
    axes = drawn(tmp_path, "{title: 'Fig. 12a, ribbon', law: flat rod, m: 3, n: 1, limits: {kappa_n: [-100, 20]}}")
    assert axes.get_title() == "flat rod, (m, n) = (3, 1), $\\nu$ = 0.3"


# --- one branch -------------------------------------------------------------------------------------------------------


@pytest.mark.full
def test_negative_numbers_have_minus_signs_and_fonts_can_be_edited(tmp_path):
    branch = branch_of(tmp_path, "{m: 1, n: 3}")
    made = figure(branch, shapes=0)
    assert "\u22124.3020" in [text.get_text() for text in made.axes[0].texts]  # the second fold of (1, 3)
    write_picture(made, tmp_path / "x.pdf")
    content = (tmp_path / "x.pdf").read_bytes()
    assert b"CIDFontType2" in content and b"/Type3" not in content
    for name in ("a.svg", "b.svg"):
        write_picture(figure(branch, shapes=0), tmp_path / name)
    assert (tmp_path / "a.svg").read_bytes() == (tmp_path / "b.svg").read_bytes()


@pytest.mark.full
def test_a_strip_with_dimensions_is_drawn_in_si_units_and_at_its_width(tmp_path, root):
    scene = load(root / "configs" / "strip_bandsaw.yaml")
    branch = branch_of(tmp_path, scene)
    axes = Figure().subplots()
    panel(axes, branch, branch.panels[0], [])
    axes.set_title(branch.caption)
    assert axes.get_xlabel().endswith("in 1/m") and "5.65 × 0.65 × 3000 mm" in axes.get_title()
    assert axes.lines[0].get_xdata()[0] == pytest.approx(branch.points["kappa_n"][0] * 2 * math.pi / 3.0)
    assert "natural curvature of the strip" in [text.get_text() for text in axes.get_legend().get_texts()]
    strips = [branch.placed(point, 2 * math.pi)[0] for point in branch.kept()[:2]]
    assert branch.drawn_width(strips, None) == pytest.approx(2 * math.pi * 0.00565 / 3.0)


def test_generators_never_cross_in_a_picture(tmp_path):
    branch = branch_of(tmp_path, "{m: 1, n: 3}")  # bends sharply: at the usual width its generators cross
    strips = [branch.placed(point, 2 * math.pi)[0] for point in branch.kept()]
    least = min(map(widest, strips))
    assert draw_strip.ROOM * least < draw_strip.WIDTH
    assert branch.drawn_width(strips, 0.3) == pytest.approx(draw_strip.ROOM * least)
    rod = branch_of(tmp_path, "{law: flat rod, m: 3, n: 1, limits: {kappa_n: [-100, 20]}}")
    shapes = [rod.placed(point, 2 * math.pi)[0] for point in rod.kept()]
    assert not any(shape.eta.any() for shape in shapes)  # a rod has no generators
    assert rod.drawn_width(shapes, None) == draw_strip.WIDTH


def test_the_picture_of_a_circle_has_no_seams_and_its_near_side_in_front(tmp_path):
    circle = branch_of(tmp_path, "{m: 1, n: 2, limits: {kappa_n: [0, 20]}}").placed(0, 2 * math.pi)[0]
    picture = draw_strip.rendered(circle, 0.3, 1.05, 120)
    alpha = picture[..., 3]
    beside = np.min([alpha[1:-1, :-2], alpha[1:-1, 2:], alpha[:-2, 1:-1], alpha[2:, 1:-1]], axis=0)
    assert not np.any((alpha[1:-1, 1:-1] < 1) & (beside == 1))
    covered = np.flatnonzero(alpha[:, 60] == 1)

    def shade(row):
        return picture[row, 60, :3] / picture[row, 60, :3].max()

    far, near = (np.array(to_rgb(colour)) / max(to_rgb(colour)) for colour in (draw_strip.BACK, draw_strip.FRONT))
    assert shade(covered[4]) == pytest.approx(far, abs=1e-3) and shade(covered[-5]) == pytest.approx(near, abs=1e-3)


@pytest.mark.full
def test_frames_of_a_film_are_as_far_apart_as_the_points_allow(tmp_path):
    branch = branch_of(tmp_path, "{m: 1, n: 2, steps: {largest: 0.05}}")
    strips = draw_strip.steady({point: branch.placed(point, 2 * math.pi)[0] for point in branch.kept().tolist()})
    places = [draw_strip.places(strips[point]) for point in evenly(strips, 12)]
    moved = np.array([np.sqrt(np.mean(np.sum((b - a) ** 2, axis=1))) for a, b in zip(places, places[1:])])
    assert len(moved) == 11 and np.ptp(moved) < 0.25 * moved.mean()
