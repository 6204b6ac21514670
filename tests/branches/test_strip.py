"""Strips in SI units: the numbers they resolve to, what the command says of them, and what is refused."""

import contextlib
import io
import math
import re
import shlex
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from branches.read import read_branch
from branches.run.__main__ import main as run_command
from branches.run.display import Display
from branches.run.runner import run_scene
from branches.scene.fields import ConfigError
from branches.scene.parse import dump, load, parse
from branches.scene.sweep import Sweep
from branches.scene.units import quantity
from branches.strip import report as strip_report
from branches.strip import states as strip_states
from branches.strip.__main__ import main, parser
from branches.strip.arch import push
from branches.strip.report import assumptions, barrier, barriers_at, chart, deviations, dimensions
from branches.strip.states import buckled, circles, ways_out
from ribbon_model.exact_finite_width import curve
from ribbon_model.laws import FINITE_WIDTH, RIBBON, TwoBendings
from ribbon_model.linear import energy_interval, thresholds
from ribbon_model.strip import Strip

BLADE = Strip(0.00565, 0.00065, 3.0, 0.143, 0.3, 210e9)
TAPE = Strip(0.016, 0.00012, 0.6, 0.03, 0.3, 200e9)
OPTIONS = [
    "--width",
    ".01",
    "--thickness",
    "1e-4",
    "--length",
    "1",
    "--natural-radius",
    "1",
    "--poisson-ratio",
    ".3",
    "--youngs-modulus",
    "1e9",
]
SCENE = (
    "m: 1\nn: 2\nstrip: {width: .016, thickness: .00012, length: .6, natural_radius: .03, poisson_ratio: .3, "
    "youngs_modulus: 200.0e9}\n"
)


@pytest.mark.parametrize(
    ("text", "metres"),
    [("5mm", 0.005), ("0.2m", 0.2), (" 30 mm ", 0.03), ("5.65 mm", 0.00565), ("3e1cm", 0.3), ("9um", 9e-6),
     ("1 \u00b5m", 1e-6), (".5in", 0.0127), ("0.0127", 0.0127), ("inf", math.inf)],
)  # fmt: skip
def test_lengths_with_units(text, metres):
    assert quantity(text, "m") == metres


@pytest.mark.parametrize("text", ["5 furlong", "mm", "", "5 m m", "1,5mm", "5Mm", "5 GPa"])
def test_lengths_that_are_none(text, capsys):
    with pytest.raises(SystemExit):
        main(["--width", text, *OPTIONS[2:]])
    message = "must be a number (in m), or one with a unit: m, cm, mm, um or in"
    assert f"error: argument --width: {text!r} {message}" in capsys.readouterr().err


def test_metres_with_the_numbers_of_millimetres_get_a_caution(tmp_path, call):
    (tmp_path / "x.yaml").write_text(
        SCENE.replace(".016", "16").replace(".6", "600").replace("2\n", "2\nsteps: {max_points: 2}\n")
    )
    (caution, *others) = call(run_command, "x.yaml", "--quiet").err.splitlines()
    assert caution == "caution: width = 16 m is unusual (1e-05 to 2 m); 16 millimetres are written 16mm"
    assert [line.split()[1] for line in others] == ["length"]
    (tmp_path / "y.yaml").write_text(SCENE.replace("2\n", "2\nsteps: {max_points: 2}\n"))
    assert call(run_command, "y.yaml", "--quiet").err == ""


def test_a_branch_of_a_strip_with_sizes_is_told_in_si_units(tmp_path):
    """The circle has kappa_n = 1/r_n where its natural radius is r_n; the units of M1 and energy are B 2 pi/L, B (2 pi)^2/L."""
    lines = io.StringIO()
    with contextlib.redirect_stdout(lines):
        run_scene(parse(SCENE + "steps: {max_points: 3}\n", "scene"), tmp_path / "x.h5", Display())
    branch, turn = read_branch(tmp_path / "x.h5"), 2 * math.pi / 0.6
    stiffness, table = 200e9 * 0.00012**3 / 12 / (1 - 0.3**2) * 0.016, branch.in_units()
    for name, size in {
        "kappa_n [1/m]": turn,
        "M1 [N m]": stiffness * turn,
        "energy [J]": stiffness * 2 * math.pi * turn,
    }.items():
        np.testing.assert_allclose(table[name], size * branch.points[name.partition(" ")[0]], rtol=1e-12)
    first = table["kappa_n [1/m]"][0]
    assert f"natural radius {1e3 / first:.6g} mm" in lines.getvalue() and f"{first:.8f}  " in lines.getvalue()
    assert branch.place(0) == f"kappa_n = {first:.4f} 1/m" and branch.axis("elastic")[1].endswith("κₙ²/2) in J")


def test_dimensions_of_scenes_with_units():
    units = {".016": "16 mm", ".00012": "0.12mm", ".6": "60 cm", ".03": "30mm", "200.0e9": "200 GPa"}
    with_units = re.sub(r"[.\d]+(e9)?(?=[,}])", lambda found: units.get(found[0], found[0]), SCENE)
    assert with_units.count("mm") == 3 and parse(with_units, "x") == parse(SCENE, "x")
    with pytest.raises(ConfigError, match="x: strip: width: '16 mmm' must be a number"):
        parse(with_units.replace("16 mm", "16 mmm"), "x")
    scene = (
        "dimensions: {width: 20 mm, thickness: .5mm, length: 300 mm, poisson_ratio: 0.3, youngs_modulus: 200 GPa}\n"
        "material: {}\nnumbers: {distance: .29}\nbegin: arch\nstages: [{follow: distance, to: .2}]\n"
    )
    with_units = scene.replace(".29", "29cm").replace(
        "to: .2}", "to: 200 mm, label: {turn: [90deg]}, limits: {distance: [10cm, .3]}}"
    )
    plain = scene.replace("to: .2}", f"to: .2, label: {{turn: [{math.pi / 2!r}]}}, limits: {{distance: [.1, .3]}}}}")
    assert parse(with_units, "x") == parse(plain, "x") == parse(dump(parse(with_units, "x")), "x")
    assert set(parse(scene.replace(".29", "[29cm, 28cm]"), "x").scenes) == {"distance0.29.h5", "distance0.28.h5"}
    with pytest.raises(ConfigError, match="x: stage distance: to: '2 inch' must be a number .in m., or one with a unit: m, cm"):
        parse(scene.replace("to: .2", "to: 2 inch"), "x")
    with pytest.raises(ConfigError, match="numbers.distance: must be a number, not '29cm'"):
        parse("material: {law: flat rod, nu: .3}\n" + with_units[with_units.index("numbers") :], "x")
    assert parse(scene, "x").dimensions.model_dump() == {
        "width": 0.02, "thickness": 0.0005, "length": 0.3, "poisson_ratio": 0.3, "youngs_modulus": 200e9
    }  # fmt: skip
    with pytest.raises(ConfigError, match="dimensions.length: '300 apples' must be a number"):
        parse(scene.replace("300 mm", "300 apples"), "x")


def test_branches_that_are_not_followed_are_named(monkeypatch):
    """Where the law has another bending for the moment of their circles; the others are there."""

    def at(m, n, *_):
        if n > 4:
            raise TwoBendings("another")
        yield from ()

    monkeypatch.setattr(strip_states, "at_natural_curvatures", at)
    monkeypatch.setattr(strip_states, "coverings", lambda strip: range(1, 6, 2))
    states, folds, lost = buckled(TAPE)
    assert not states and lost == [(1, 5), (1, 6), (3, 5), (3, 6), (5, 6)]
    (line,) = strip_report.lost_lines(lost)
    assert line.endswith("for the moment where they begin: (1, 5), (1, 6), (3, 5), (3, 6), (5, 6)")
    assert not list(strip_report.lost_lines([]))


def test_energies_and_moments_of_a_narrow_strip_are_those_of_a_beam():
    """Gamma = .1: E I (1/r - 1/R_n) and its square over 2 E I, times L, but for terms of order (nu Gamma)**2."""
    inertia = BLADE.width * BLADE.thickness**3 / 12
    for ring in circles(BLADE):
        change = 2 * math.pi * ring.m / BLADE.length - 1 / BLADE.natural_radius
        assert ring.moment == pytest.approx(210e9 * inertia * abs(change), rel=3e-3)
        assert ring.energy == pytest.approx(210e9 * inertia * change**2 / 2 * BLADE.length, rel=3e-3)
        assert ring.strain == pytest.approx(BLADE.thickness / 2 * abs(change), rel=1e-12)


def test_a_wide_strip_has_the_ribbons_threshold_in_millimetres():
    """Equation (27): the single loop is stable for kappa_n L/2pi below 2.5, here at w**2/(h L/2pi) = 1e8."""
    length = 2 * math.pi
    wide = Strip(1.0, 1e-8, length, 1 / 2.4, 0.3, 1e9)
    assert thresholds(RIBBON, 1, 2, 0.3) == (2.5,)
    assert circles(wide)[0].stable and not circles(Strip(1.0, 1e-8, length, 1 / 2.6, 0.3, 1e9))[0].stable


@pytest.mark.full
def test_buckled_states_are_those_of_the_quadrature():
    """The stable state of the tape on (1, 2), by the exact quadrature up to its own kappa_n."""
    states, folds, lost = buckled(TAPE)
    (stable,) = (state for state in states if state.stable)
    assert stable.name == "buckled (1, 2)"
    points = curve(1, 2, TAPE.parameters, kappa_limits=(-100.0, TAPE.kappa_n))
    assert points[-1].label == "EP"
    energy = (points[-1].energy + TAPE.kappa_n**2 / 2) * TAPE.energy_unit
    assert stable.energy == pytest.approx(energy, rel=1e-8)
    (fold,) = (point for point in curve(1, 2, TAPE.parameters) if point.label == "LP")
    assert folds[0][1] == pytest.approx(fold.kappa_n, abs=1e-9)
    assert TAPE.kappa_n > thresholds(FINITE_WIDTH, 1, 2, TAPE.parameters)[0]


def test_the_strain_is_the_largest_principal_one():
    half = TAPE.thickness / 2 * 2 * math.pi / TAPE.length
    assert TAPE.strain(-2.0) == pytest.approx(2 * half) and TAPE.strain(0.0, 3.0) == pytest.approx(3 * half)
    assert TAPE.strain(3.0, 2.0) == pytest.approx(4 * half)  # eigenvalues of [[3, 2], [2, 0]]: 4 and -1


def saddle_energy(strip, m, n):
    """Return the energy in J of the state at kappa_n on a primary branch that starts above it, by its quadrature."""
    end = curve(m, n, strip.parameters, kappa_limits=(strip.kappa_n, 100.0))[-1]
    assert end.label == "EP"
    return (end.energy + strip.kappa_n**2 / 2) * strip.energy_unit


@pytest.mark.full
def test_barriers_are_those_of_the_quadrature():
    """The blade: its saddles lie on (1, 2), between one turn and three, and on (3, 4), between three and five."""
    rings, (others, _, _) = circles(BLADE), buckled(BLADE)
    ways = ways_out([*rings, *others])
    assert {name: (way.saddle, way.behind) for name, way in ways.items()} == {
        "single loop": ("buckled (1, 2)", "3-fold circle"),
        "3-fold circle": ("buckled (3, 4)", "5-fold circle"),
        "5-fold circle": ("buckled (3, 4)", "3-fold circle"),
    }
    for state in rings[:3]:
        over = (1, 2) if state.m == 1 else (3, 4)
        assert ways[state.name].height == pytest.approx(saddle_energy(BLADE, *over) - state.energy, rel=1e-8)
        assert barrier(BLADE, state.m) == pytest.approx(ways[state.name].height, rel=1e-10)


@pytest.mark.full
def test_a_barrier_vanishes_where_stability_ends():
    """Of the 3-fold circle at both ends of its stable interval, where its way out, (1, 2) or (3, 4), bifurcates."""
    narrow = {"nu": 0.3, "Gamma": 0.1}
    ends = [3 * end for end in energy_interval(FINITE_WIDTH, 3, narrow)]
    inside, outside = [ends[0] + 0.05, ends[1] - 0.05], [ends[0] - 0.05, ends[1] + 0.05]
    near, further = barriers_at(3, inside, narrow), barriers_at(3, [ends[0] + 0.1, ends[1] - 0.1], narrow)
    assert (near > 0).all() and (further > 3 * near).all()  # quadratic: a subcritical pitchfork
    assert all(map(math.isnan, barriers_at(3, outside, narrow)))


@pytest.mark.full
def test_dimensions_for_a_barrier():
    printed = dimensions(BLADE, 3, 0.3)
    radii, widths, thicknesses = (re.findall(r"([\d.]+) mm", line) for line in printed.splitlines()[1:])
    assert (len(radii), len(widths), len(thicknesses)) == (2, 1, 1)
    for name, found in (("natural_radius", radii), ("width", widths), ("thickness", thicknesses)):
        for value in found:
            assert barrier(replace(BLADE, **{name: float(value) / 1e3}), 3) == pytest.approx(0.3, rel=1e-2)  # 4 digits printed
    assert "none between 28.6 and 715 mm" in dimensions(BLADE, 3, 5.0)


@pytest.mark.full
def test_a_chart_is_drawn(tmp_path, monkeypatch, capsys):
    few = {"Gammas": np.array([0.1, 1.0]), "parts": np.linspace(0.1, 0.9, 3)}
    monkeypatch.setattr("branches.strip.report.chart", partial(chart, **few))
    assert main([*OPTIONS, "--chart", str(tmp_path / "chart.png"), "--turns", "3"]) == 0
    assert capsys.readouterr().out == f"written to {tmp_path / 'chart.png'}\n"
    assert (tmp_path / "chart.png").stat().st_size > 10_000


def test_numbers_in_other_units_are_doubted():
    in_millimetres = Strip(5.65, 0.65, 3000.0, 143.0, 0.3, 210.0)
    names = [line.split()[1] for line in assumptions(in_millimetres, circles(in_millimetres)) if "unusual" in line]
    assert names == ["width", "thickness", "length", "youngs_modulus"]


def test_a_strain_may_be_in_percent(capsys):
    assert parser().parse_args([*OPTIONS, "--yield-strain", "0.2%"]).yield_strain == 0.002
    with pytest.raises(SystemExit):
        parser().parse_args([*OPTIONS, "--yield-strain", "0.2mm"])
    assert "'0.2mm' must be a number" in capsys.readouterr().err


def test_cautions():
    torsion, strain = assumptions(BLADE, circles(BLADE), 0.002)
    assert torsion == "caution: h/w = 0.115 is not thin: a plate's torsional stiffness is too large by about 7 %"
    assert strain == "caution: strains beyond the yield strain 0.002 (marked !): 7-fold circle"
    (slender,) = assumptions(TAPE, circles(TAPE))
    assert "0.17 on the single loop and more" in slender
    slim = Strip(0.003, 0.0001, 3.0, 0.5, 0.3, 1e9)
    assert not list(assumptions(slim, circles(slim), 0.02))


def test_the_snap_load_of_a_shallow_arch_between_hinges(excess=4e-4):
    """At P = (2 pi/l)^2 EI the second mode buckles, with the deflection F/(2 P k) (sin k x + k x), excess 3 l (F/2P)^2/4.

    The initial one is a sine of height 2 l sqrt(e)/pi. Terms of order e are left out; nu = 0: the bending of the section, too.
    """
    strip = replace(BLADE, length=0.4, width=0.01, thickness=0.0005, poisson_ratio=0.0, natural_radius=math.inf)
    way, bending = push(strip, 0.4 * (1 - excess), "hinged"), strip.youngs_modulus * 0.0005**3 * 0.01 / 12
    top = np.argmax(way.force)
    load, travel = 16 * math.pi**2 * bending / 0.4**2 * math.sqrt(excess / 3), 0.4 * math.sqrt(excess) * (2 / math.pi - 3**-0.5)
    assert way.force[top] == pytest.approx(load, rel=3 * excess) and way.travel[top] == pytest.approx(travel, rel=20 * excess)
    height = 0.4 * math.sqrt(excess) * 2 / math.pi
    assert way.end == "the strip leaves it" and way.travel[-1] == pytest.approx(height, rel=3e-2)  # half-way through


def test_options_of_closed_strips_are_not_of_open_ones(call):
    given = ["--width", "1cm", "--thickness", ".5mm", "--length", ".4", "--poisson-ratio", ".3", "--youngs-modulus", "200GPa"]
    for more, said in (
        ([], "--natural-radius: a closed strip needs it"),
        (["--distance", ".39", "--natural-radius", "1"], "one with a distance has none"),
        (["--ends", "hinged", "--natural-radius", "1"], "--ends: is of open strips"),
        (["--distance", ".39", "--turns", "3"], "--turns: is of closed strips"),
        (["--distance", ".5"], "--distance: 0.5 m must be from 0.24 m to below the length, 0.4 m"),
        (["--distance", ".39", "--push-at", "1.5"], "--push-at: 1.5 must be above 0 and below 1"),
    ):
        done = call(main, *given, *more)
        assert done.returncode == 2 and said in done.err and done.err.count("\n") == 1


def test_which_law_holds():
    """Thresholds of the tape's Gamma, in docs/finite-width.md between those of the rod and the ribbon."""
    blade, tape = deviations(BLADE), deviations(TAPE)
    assert blade["flat rod"] < 1e-3 < 0.1 < blade["ribbon"]
    assert min(tape.values()) > 0.1
    assert deviations(Strip(1.0, 1e-8, 6.0, 1.0, 0.3, 1e9))["ribbon"] < 1e-3


@pytest.mark.full
def test_the_pages_numbers_are_the_commands(root, capsys):
    page = (root / "docs" / "strips.md").read_text(encoding="utf-8")
    examples = re.findall(r"```console\n\.venv/bin/ribbon strip (.*?)\n(.*?)```", page.replace("\\\n", ""), re.S)
    assert len(examples) == 5
    for arguments, printed in examples:
        assert main(shlex.split(arguments)) == 0
        assert capsys.readouterr().out.split() == printed.split()


def test_a_scene_with_a_strip_is_one_with_its_numbers():
    config = parse(SCENE, "x")
    assert (config.law, config.nu) == ("finite width", 0.3)
    assert config.Gamma == pytest.approx(0.016**2 / (0.00012 * 0.6 / (2 * math.pi)), rel=1e-14)
    assert config.zeros == {"kappa_n": [pytest.approx(0.6 / (2 * math.pi * 0.03), rel=1e-14)]}
    assert parse(dump(config), "y") == config
    straight = parse(SCENE, "x", ["strip.natural_radius=.inf", "zeros={kappa_n: [1.0], M2: [2.0]}"])
    assert straight.zeros == {"kappa_n": [1.0, 0.0], "M2": [2.0]}


def test_the_scenes_that_come_with_it(root):
    assert load(root / "configs" / "strip_bandsaw.yaml").Gamma == pytest.approx(BLADE.Gamma)
    diagram = load(root / "configs" / "strip_tape.yaml")
    assert isinstance(diagram, Sweep) and {scene.Gamma for scene in diagram.scenes.values()} == {TAPE.Gamma}


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        (["strip.width=-1"], "strip: width: -1 must be positive and finite"),
        (["strip.width=wide"], "strip: width: 'wide' must be a number (in m), or one with a unit"),
        (["strip.width=true"], "strip: width: must be a number, not True"),
        (["strip.length=.inf"], "strip: length: inf must be positive and finite"),
        (["strip.poisson_ratio=.7"], "poisson_ratio: 0.7 must be greater than -1 and at most 0.5"),
        (["strip.thickness=.02"], "thickness: 0.02 m must not exceed the width, 0.016 m"),
        (["strip.width=1.0"], "width: 1 m must not exceed the length, 0.6 m"),
        (["strip.natural_radius=0"], "natural_radius: 0 must be positive, .inf for a straight strip"),
        (["strip.colour=1"], "unknown field 'strip.colour'; the fields are width, thickness"),
        (
            ["strip={width: 1}"],
            "the fields 'strip.thickness', 'strip.length', 'strip.natural_radius', 'strip.poisson_ratio' and",
        ),
        (["strip=3"], "strip: must hold the fields width"),
        (["nu=.3"], "nu: must not be given together with strip"),
        (["zeros=3"], "zeros: must hold"),
        (["strip.thickness=1e-300", "strip.youngs_modulus=1e-300"], "overflow"),
    ],
)
def test_scenes_that_are_refused(settings, words):
    with pytest.raises(ConfigError, match=re.escape(words)):
        parse(SCENE, "x", settings)


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"--width": "0"}, "--width: 0 must be positive and finite"),
        ({"--width": "x"}, "argument --width: 'x' must be a number (in m), or one with a unit"),
        ({"--natural-radius": "nan"}, "--natural-radius: nan must be positive"),
        ({"--yield-strain": "-1"}, "--yield-strain: -1 must be positive and finite"),
        ({"--want": "0"}, "--want: 0 must be positive and finite"),
        ({"--want": "1", "--turns": "2"}, "--turns: 2 must be odd, from 1 to 15"),
        ({"--turns": "3"}, "--turns: it belongs to --want or --chart"),
        ({"--chart": "chart.xyz"}, "--chart 'chart.xyz': must end in .pdf"),
    ],
)
def test_strips_that_are_refused(changed, words, capsys):
    options = dict(zip(OPTIONS[::2], OPTIONS[1::2])) | changed
    try:
        code = main([word for option in options.items() for word in option])
    except SystemExit as left:
        code = left.code
    captured = capsys.readouterr()
    assert code == 2 and words in captured.err and captured.err.count("\n") == 1 and captured.out == ""
