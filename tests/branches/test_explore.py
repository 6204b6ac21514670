"""The explorer page: what it holds (Python), and what it does (in headless Chromium, where there is one)."""

import base64
import csv
import json
import math
import shutil
from dataclasses import replace
from importlib import resources
from io import BytesIO
from xml.etree import ElementTree

import h5py
import numpy as np
import pytest
from browser import CHROMIUM, NODE, Browser, evaluated
from matplotlib.image import imread

import contin
from branches.explore import gather as gather_module
from branches.explore.__main__ import main
from branches.explore.gather import gather
from branches.explore.packing import TOLERANCE
from branches.explore.packing import column as packed_column
from branches.explore.strips import shapes, solutions
from branches.read import read_branch
from branches.run.display import Display
from branches.run.many import run_many
from branches.run.runner import run_scene
from branches.scene.closed import ClosedScene
from branches.scene.parse import load, parse
from branches.store.files import StoreError
from ribbon_model import exact, laws
from ribbon_model.descent import past
from ribbon_model.law import Law, Parameter

FIG_12 = "{title: Fig. 12a, law: ribbon, nu: 0.3, m: [1, 3, 5, 7], n: [1, 2, 3, 4, 5, 6, 7], stride: 10}"
SVG = "{http://www.w3.org/2000/svg}"
LAWS = "{law: [ribbon, flat rod, isotropic rod], nu: [0.1, 0.3], m: 1, n: 2, limits: {kappa_n: [-30, 30]}}"


@pytest.mark.skipif(not (NODE or CHROMIUM), reason="neither Node nor Chromium on the PATH (Debian: apt-get install nodejs)")
def test_one_exact_point_of_each_law_is_that_of_the_model(tmp_path):
    """Within 1e-10 of `ribbon_model.exact`, at equal amplitude; of finite width, whose model takes long, near the circle."""
    of_page = resources.files("branches.explore")
    scripts = [(of_page / name).read_text("utf-8") for name in ("shapes.js", "exact.js", "follow.js", "exact_width.js")]
    laws = {"ribbon": None, "flat rod": None, "isotropic rod": None, "finite width": 8.0}
    asked = [(law, 1, 2, 0.3, [-100, 100], Gamma) for law, Gamma in laws.items()]
    curves = evaluated(scripts, f"{json.dumps(asked)}.map((one) => exactCurve(...one).points)", tmp_path)
    for (law, Gamma), points in zip(laws.items(), curves):
        circle, _, near, *_ = exact.curve(1, 2, {"nu": 0.3, "Gamma": Gamma}, (-100, 3.565 if Gamma else 100), step=0.2, law=law)
        point = min(points, key=lambda point: math.dist(*[[at["kappa_n"], at["kappa_star"]] for at in (vars(near), point)]))
        there = exact.solve(1, 2, 0.3, near, amplitude=point["amplitude"], law=law)
        assert point["amplitude"] > 1e-3
        for one, other in ((point, there), (points[0], circle)):
            for name in ("kappa_n", "kappa_star", "energy"):
                assert one[name] == pytest.approx(getattr(other, name), rel=1e-10, abs=1e-10)


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    """Folder with m1_n2.h5, with the index."""
    folder = tmp_path_factory.mktemp("explore")
    scene = ClosedScene(title="</script> & <b>", m=1, n=2, stability=True)
    run_scene(scene, folder / "m1_n2.h5", Display(silent=True))
    return folder


@pytest.fixture(scope="module")
def unstable_folds(tmp_path_factory):
    """The page of (1, 3), whose folds have the index 2 or 3 on their sides."""
    folder = tmp_path_factory.mktemp("folds")
    run_scene(ClosedScene(m=1, n=3, stability=True), folder / "m1_n3.h5", Display(silent=True))
    assert main([str(folder / "m1_n3.h5"), "--out", str(folder / "page.html")]) == 0
    return folder / "page.html"


@pytest.fixture(scope="module")
def pages(results):
    assert main([str(results / "m1_n2.h5"), "--out", str(results / "m1_n2.html")]) == 0
    return results


@pytest.fixture(scope="module")
def diagrams(pages):
    """The same folder, with the diagrams fig12 and laws, and their pages."""
    for name, scene in (("fig12", FIG_12), ("laws", LAWS)):
        assert run_many(parse(scene, "scene"), pages / name, Display(silent=True)) == "complete"
        assert main([str(pages / name), "--out", str(pages / f"{name}.html")]) == 0
    return pages


@pytest.fixture(params=["m1_n2", *(pytest.param(name, marks=pytest.mark.full) for name in ("fig12", "laws"))])
def page(request):
    """Each page."""
    return request.getfixturevalue("pages" if request.param == "m1_n2" else "diagrams") / f"{request.param}.html"


def data_of(page):
    """Return the data of a page, as the browser reads it."""
    text = page.read_text(encoding="utf-8").partition('<script type="application/json" id="data">')[2]
    return json.loads(text.partition("</script>")[0])


def numbers(text, kind="<f8"):
    return np.frombuffer(base64.b64decode(text), kind)


def column(branch, name):
    """A column of the page, as the browser sees it."""
    text = branch["columns"][name]
    if not isinstance(text, str):
        return text
    return numbers(text[1:], {"d": "<f8", "b": "<i1", "h": "<i2", "i": "<i4"}[text[0]])


def decoded(branch):
    """The shapes that the page holds, as the browser sees them: (points, nodes, channels)."""
    about = branch["shapes"]
    size = numbers(about["size"]).reshape(-1, 1, about["channels"])
    functions, products, wide = about["functions"], about["products"], about["wide"]
    basis = numbers(about["basis"], "<i2").reshape(functions, -1) / 32767
    assert basis.shape[1] == about["nodes"]

    def rows(text):
        data = base64.b64decode(text)
        length = len(data) // (products + wide)
        parts = data[: 2 * wide * length], data[2 * wide * length :]
        return np.concatenate([np.frombuffer(part, kind).reshape(-1, length) for part, kind in zip(parts, ("<i2", "<i1"))])

    left, right = rows(about["left"]).astype(float), rows(about["right"]).reshape(products, functions, -1)
    return np.einsum("k,kp,kjc,ji->pic", numbers(about["scale"]), left, right, basis) * size


# --- what the page holds ------------------------------------------------------------------------------------------


def test_page_is_whole_and_small(page):
    text = page.read_text(encoding="utf-8")
    assert len(text.encode()) < 2e6
    assert "Permission is hereby granted, free of charge" in text  # the licence of plotly.js
    assert "{{" not in text.split('<script type="application/json"')[0]
    if page.stem == "m1_n2":
        assert "<h1>&lt;/script&gt; &amp; &lt;b&gt;</h1>" in text


def test_columns_are_those_of_the_file(pages):
    (family,) = data_of(pages / "m1_n2.html")["families"]
    (branch,) = family["branches"]
    with h5py.File(pages / "m1_n2.h5") as file:
        points = file["points"][:]
    for name in ("kappa_n", "kappa_star", "energy", "index"):
        assert np.array_equal(column(branch, name), points[name])
    assert ClosedScene.model_validate(parse(branch["config"], "config").model_dump()).m == 1
    assert [mark["kind"] for mark in branch["marks"]] == ["circle", "fold", "circle"]
    assert [circle["m"] for circle in family["circles"]] == [1, 3]


@pytest.mark.full
def test_shapes_are_the_kept_solutions(diagrams):
    """Every kept solution of Fig. 12, at the end of the domain (a node of both), within `TOLERANCE` of its channel."""
    (family,) = data_of(diagrams / "fig12.html")["families"]
    assert len(family["branches"]) == 18
    for about in family["branches"]:
        branch = read_branch(diagrams / "fig12" / about["file"])
        found = decoded(about)
        assert len(found) == len(branch.points)
        allowed = 1.5 * TOLERANCE * np.abs(found).max(axis=(0, 1))
        for point in branch.kept():
            shape, solution = branch.shape(point), branch.solution(point)
            last = np.argmin(np.abs(shape.arclength - 3 * solution.parameters["length"]))  # S = 0 lies in the middle of a wave
            end = [*solution.states[-1], shape.eta[last], *shape.centreline[last]]
            assert (np.abs(found[point, -1] - end) < allowed).all()


@pytest.mark.parametrize("m, n, nu", [(7, 1, -0.1), pytest.param(1, 3, 0.3, marks=pytest.mark.full)])
def test_shapes_between_kept_solutions_are_those_of_a_run_that_keeps_all(m, n, nu, tmp_path):
    """(7, 1) at nu = -.1, which cannot be integrated from S = 0, and (1, 3), with two folds: every point, and every tenth."""
    files = []
    for stride in (1, 10):
        files.append(tmp_path / f"{stride}.h5")
        run_scene(ClosedScene(m=m, n=n, nu=nu, stride=stride), files[-1], Display(silent=True))
    every, tenth = (shapes(read_branch(path)) for path in files)
    assert every.shape == tenth.shape
    assert (np.abs(every - tenth).max(axis=(0, 1)) < TOLERANCE * np.abs(every).max(axis=(0, 1))).all()
    assert None not in solutions(read_branch(files[1]))


def test_shapes_after_the_last_kept_solution(results):
    """An interrupted run keeps every tenth solution, and no last one: the others are found all the same."""
    branch = read_branch(results / "m1_n2.h5")
    few = replace(branch, index=branch.index[branch.index["point"] % 10 == 0])
    assert few.kept()[-1] < len(branch.points) - 3
    largest = np.abs(shapes(branch)).max(axis=(0, 1))
    assert (np.abs(shapes(few) - shapes(branch)).max(axis=(0, 1)) < TOLERANCE * (largest + 1e-9)).all()


def test_packing_error(pages):
    """At most `TOLERANCE` of the largest value of a channel, and half of that for the rounding of small parts."""
    branch = read_branch(pages / "m1_n2.h5")
    exact, (family,) = shapes(branch), data_of(pages / "m1_n2.html")["families"]
    error = np.abs(decoded(family["branches"][0]) - exact).max(axis=(0, 1))
    assert (error <= 1.5 * TOLERANCE * np.abs(exact).max(axis=(0, 1)) + 1e-300).all()


def test_columns_are_packed_without_loss():
    """Each kind of column: constant, numbers, whole numbers of one, two and four bytes, and numbers that are not finite."""
    for values, letter in (
        ([0.1, 0.2], "d"), ([np.nan, np.nan], "d"), ([3, -128], "d"), ([np.inf, np.inf], "d"),
    ):  # fmt: skip
        assert packed_column(np.array(values, float))[0] == letter
    for values, letter in (([1, -127], "b"), ([1, 128], "h"), ([1, 32768], "i")):
        text = packed_column(np.array(values, "<i4"))
        assert text[0] == letter and column({"columns": {"x": text}}, "x").tolist() == values
    assert packed_column(np.full(3, 0.3)) == 0.3 and packed_column(np.full(3, 7, "<i4")) == 7


@pytest.mark.full
def test_a_page_that_would_be_too_large_leaves_out_shapes_and_says_so(diagrams, monkeypatch, capsys, tmp_path):
    """Of six materials four keep their shapes, if the limit is two thirds of the size of all; the first is among them."""
    whole = gather_module.gather([str(diagrams / "laws")])
    assert gather_module.left_out(whole) == []
    branches = [branch for family in whole["families"] for branch in family["branches"]]
    sizes = [sum(len(text) for branch in branches for text in branch[name].values() if isinstance(text, str))
             for name in ("columns", "shapes")]  # fmt: skip
    monkeypatch.setattr(gather_module, "_MOST_BYTES", sizes[0] + 2 * sizes[1] // 3)
    assert main([str(diagrams / "laws"), "--out", str(tmp_path / "page.html")]) == 0
    data = data_of(tmp_path / "page.html")
    missing = gather_module.left_out(data)
    assert len(missing) == 2 and all((diagrams / "laws" / branch["path"]).exists() for branch in missing)
    assert data["families"][0]["branches"][0]["shapes"] is not None
    assert "the shapes of 2 branches" in capsys.readouterr().out
    if not CHROMIUM:
        return
    browser = Browser(tmp_path)
    try:
        browser.open(tmp_path / "page.html")
        number = next(i for i, family in enumerate(data["families"]) if family["branches"][0]["shapes"] is None)
        browser.js(f"document.getElementById('family').onchange({{ target: {{ value: {number} }} }})")
        browser.until("document.getElementById('left-out').offsetParent !== null")
        shown = browser.js("document.getElementById('left-out-command').textContent")
        assert shown == f'python -m branches.explore "{missing[0]["path"]}"'
        browser.js("document.getElementById('family').onchange({ target: { value: 0 } })")
        browser.until("document.getElementById('left-out').offsetParent === null")
        assert browser.colours("#ribbon") > 200 and browser.errors == []
    finally:
        browser.close()


@pytest.mark.full
def test_only_folds_of_stable_strips_have_a_way_down(diagrams, unstable_folds, monkeypatch):
    """That of (1, 2) ends on the triple loop; those of (1, 3), and pages without the index or of very many files, have none."""

    def ways(data):
        return [
            mark["way"] for family in data["families"] for one in family["branches"] for mark in one["marks"] if "way" in mark
        ]

    (way,) = ways(data_of(diagrams / "m1_n2.html"))
    assert [end["name"] for end in way["ends"]] == ["3-covered circle"]
    assert way["kappa_n"] == pytest.approx(past(4.0756675353, 1), abs=1e-9)
    energies = column(way, "energy")
    assert (np.diff(energies) < 0).all() and energies[-1] == pytest.approx(way["ends"][0]["energy"], abs=1e-2)
    assert ways(data_of(unstable_folds)) == ways(data_of(diagrams / "fig12.html")) == []
    monkeypatch.setattr(gather_module, "_SLOW", 0)
    assert ways(gather_module.gather([str(diagrams / "m1_n2.h5")])) == []


@pytest.mark.full
def test_families_by_law_and_nu(diagrams):
    data = gather([str(diagrams / "laws"), str(diagrams / "m1_n2.h5")])
    found = [(family["law"], family["nu"], len(family["branches"])) for family in data["families"]]
    assert found[:2] == [("ribbon", 0.1, 1), ("ribbon", 0.3, 2)]
    assert found[2:] == [(law, nu, 1) for law in ("flat rod", "isotropic rod") for nu in (0.1, 0.3)]


@pytest.mark.parametrize(
    "what", ["missing", "foreign", "scene", "empty", pytest.param("damaged", marks=pytest.mark.full), "page", "folder"]
)
def test_bad_input_is_one_sentence(what, results, tmp_path, capsys, request):
    given, out = tmp_path / f"{what}.h5", tmp_path / "page.html"
    if what == "foreign":
        given.write_text("not HDF5")
    elif what == "scene":
        given = tmp_path / "scene.yaml"
    elif what == "empty":
        given.mkdir()
    elif what == "damaged":
        shutil.copytree(request.getfixturevalue("diagrams") / "laws", given)
        next(given.glob("*.h5")).unlink()
    elif what in ("page", "folder"):
        given = results / "m1_n2.h5"
        out = tmp_path / ("page.pdf" if what == "page" else "folder.html")
        if what == "folder":
            out.mkdir()
    capsys.readouterr()  # what computing the results has printed
    assert main([str(given), "--out", str(out)]) == 2
    printed = capsys.readouterr()
    assert printed.out == "" and printed.err.startswith("error: ") and printed.err.count("\n") == 1
    assert not out.is_file()


# --- what the page does -------------------------------------------------------------------------------------------

WITHOUT_WEBGL = """const ask = HTMLCanvasElement.prototype.getContext;
    HTMLCanvasElement.prototype.getContext = function (kind, ...more) {
        return kind.startsWith("webgl") ? null : ask.call(this, kind, ...more);
    };"""
needs_chromium = pytest.mark.skipif(CHROMIUM is None, reason="no Chromium on the PATH (Debian: apt-get install chromium)")


@pytest.fixture(scope="module")
def browser(tmp_path_factory):
    pytest.importorskip("websocket", reason="the package websocket-client drives the browser")
    browser = Browser(tmp_path_factory.mktemp("chromium"))
    yield browser
    browser.close()


@needs_chromium
def test_page_draws_without_errors(page, browser):
    browser.open(page)
    assert browser.colours("#diagram") > 20
    assert browser.colours("#ribbon") > 200  # a lit surface
    assert browser.errors == []
    assert {url.partition(":")[0] for url in browser.requests} <= {"file", "data", "blob"}  # nothing from a network
    before = browser.js("[document.getElementById('slider').focus(), explore.now.s][1]")
    browser.key("ArrowRight")  # the slider was dragged: the keys do what the page says
    assert browser.js("explore.now.s") == pytest.approx(math.floor(before) + 1)
    browser.call("Emulation.setEmulatedMedia", media="print")
    browser.js("window.dispatchEvent(new Event('beforeprint'))")
    seen = "[...document.querySelectorAll('{}')].some((e) => e.checkVisibility())"
    assert browser.js(seen.format("#printed path")) and not browser.js(seen.format("button, select, input, #ribbon"))
    browser.call("Emulation.setEmulatedMedia", media="")
    browser.js("window.dispatchEvent(new Event('afterprint'))")
    browser.until("document.querySelector('#diagram .main-svg').clientWidth === document.getElementById('diagram').clientWidth")
    assert browser.errors == []
    if page.stem != "fig12":
        return  # the longest legend is in Fig. 12
    browser.open(page, width=380, height=800)
    assert browser.js("document.documentElement.scrollWidth") <= 380  # nothing sticks out of a narrow screen


@pytest.mark.full
@needs_chromium
def test_page_opens_at_a_computed_point_and_stays_where_it_is(pages, browser):
    """No column is offered against itself, and what is below the strip does not move when another point is chosen."""
    browser.open(pages / "m1_n2.html")
    assert browser.js("Number.isInteger(explore.now.s)")
    assert "kappa_n" not in browser.js("[...document.getElementById('y').options].map(({value}) => value)")
    places = "['readout', 'states', 'save'].map((id) => document.getElementById(id).getBoundingClientRect().top + scrollY)"
    browser.until("document.getElementById('states').children.length > 0")
    before = browser.js(places)
    for point in (0, 7.5, 19, 30, 34):
        browser.js(f"explore.go(explore.now.branch, {point})")
        assert browser.js(places) == pytest.approx(before, abs=2)


@pytest.mark.full
@needs_chromium
@pytest.mark.parametrize("theme", ["light", "dark"])
def test_words_can_be_read(theme, pages, browser):
    """Text has a contrast of 4.5 to what is behind it (WCAG 1.4.3), at 390 pixels and in the help, too."""
    browser.call("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": theme}])
    try:
        browser.open(pages / "m1_n2.html", width=390, height=844)
        browser.js("document.querySelector('details').open = true")
        browser.until("document.getElementById('states').children.length > 0")
        found = browser.js("""(() => {
            const parts = (text) => text.match(/[\\d.]+/g).map(Number);
            const light = (text) => parts(text).slice(0, 3).map((c) => c / 255)
                .map((c) => (c <= 0.03928 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4))
                .reduce((sum, c, i) => sum + c * [0.2126, 0.7152, 0.0722][i], 0);
            const ground = (e) => {
                for (; e; e = e.parentElement) {
                    const colour = getComputedStyle(e).backgroundColor, alpha = parts(colour)[3];
                    if (alpha === undefined || alpha === 1) return colour;
                }
            };
            const words = [...document.querySelectorAll('body *')].filter((e) => e.offsetParent
                && [...e.childNodes].some((one) => one.nodeType === 3 && one.textContent.trim()));
            return words.map((e) => {
                const [a, b] = [light(getComputedStyle(e).color), light(ground(e))].sort((a, b) => b - a);
                return [e.textContent.slice(0, 30), (a + 0.05) / (b + 0.05)];
            }); })()""")
    finally:
        browser.call("Emulation.setEmulatedMedia", features=[])
    assert len(found) > 60 and [(words, ratio) for words, ratio in found if ratio < 4.5] == []


@pytest.mark.full
@needs_chromium
def test_page_draws_without_webgl(pages, browser):
    blind = browser.call("Page.addScriptToEvaluateOnNewDocument", source=WITHOUT_WEBGL)["identifier"]
    try:
        browser.open(pages / "m1_n2.html")
    finally:
        browser.call("Page.removeScriptToEvaluateOnNewDocument", identifier=blind)
    assert browser.js("document.querySelector('#ribbon > canvas.flat') !== null")
    assert browser.colours("#ribbon") > 200
    assert browser.errors == []


@needs_chromium
def test_click_shows_what_the_file_holds(pages, browser):
    """A click on the fold in the diagram: read-out and shape are those of the file."""
    branch = read_branch(pages / "m1_n2.h5")
    fold = next(event for event in branch.events if event["label"] == b"LP")
    browser.open(pages / "m1_n2.html")
    place = browser.js(
        "(() => { const g = document.getElementById('diagram'), r = g.getBoundingClientRect(), f = g._fullLayout;"
        f"return [r.x + f.xaxis._offset + f.xaxis.d2p({fold['kappa_n']}),"
        f"r.y + f.yaxis._offset + f.yaxis.d2p({fold['kappa_star']})]; }})()"
    )
    before = browser.js("Array.from(document.getElementById('ribbon').data[0].x)")
    browser.click(*place)
    browser.until(f"explore.now.s === {fold['point']}")
    shown = [
        browser.js(f"document.querySelector('[data-value={name}]').textContent") for name in ("kappa_n", "kappa_star", "energy")
    ]
    assert shown == [f"{fold[name]:.8f}".replace("-", "−") for name in ("kappa_n", "kappa_star", "energy")]
    browser.until(
        f"JSON.stringify(Array.from(document.getElementById('ribbon').data[0].x)) !== {json.dumps(json.dumps(before))}"
    )
    strip = np.array(browser.js(f"Array.from(explore.now.branch.strip({fold['point']}))")).reshape(-1, 13)
    assert distances(strip) == pytest.approx(distances_of(branch.shape(int(fold["point"])), len(strip)), abs=2e-4)


def distances(strip):
    """Return invariants of rigid motions and of the first station: distances between stations, and their largest twist."""
    x, n = strip[:, :3], len(strip)
    return [np.linalg.norm(x - np.roll(x, n // k, axis=0), axis=1).max() for k in (2, 3, 5)] + [np.abs(strip[:, 12]).max()]


def distances_of(shape, n):
    S = np.linspace(0, 2 * np.pi, n, endpoint=False)
    x = np.array([np.interp(S, shape.arclength, column) for column in shape.centreline.T]).T
    return distances(np.column_stack([x, np.zeros((n, 9)), np.interp(S, shape.arclength, shape.eta)]))


@pytest.mark.full
@needs_chromium
def test_unfolded_strips_close_and_have_the_length(page, browser):
    """At points and between: the last station is as far from the first as any other from the next, L / stations.

    Within 5 % of that distance, 8e-4 L / 2 pi: mirrors and copies multiply the error of the frame at the end, 5e-5, by ten.
    """
    browser.open(page)
    gaps = browser.js("""explore.families.flatMap(({branches}) => branches.flatMap((branch) => [0, 0.3, 0.77, 1].map((part) => {
        const strip = branch.strip(part * (branch.size - 1)), n = strip.length / 13, lengths = [];
        for (let k = 0; k < n; k++) {
            const a = 13 * k, b = 13 * ((k + 1) % n);
            lengths.push(Math.hypot(strip[a] - strip[b], strip[a + 1] - strip[b + 1], strip[a + 2] - strip[b + 2]));
        }
        return Math.max(...lengths) * n / (2 * Math.PI) - 1;
    })))""")
    assert max(map(abs, gaps)) < 0.05  # chords are shorter than arcs, and between points states are interpolated


@pytest.mark.full
@needs_chromium
def test_play_keys_and_coexisting_states(pages, browser):
    branch = read_branch(pages / "m1_n2.h5")
    browser.open(pages / "m1_n2.html")
    browser.js("explore.go(explore.now.branch, 0)")
    browser.js("document.getElementById('play').click()")
    browser.until("explore.now.frames > 3 && explore.now.s > 0.5")
    browser.js("document.getElementById('play').click()")
    assert browser.js("explore.now.playing") is False
    browser.js("document.activeElement.blur()")
    for name, place in (("Home", 0), ("ArrowRight", 1), ("End", len(branch.points) - 1), ("ArrowLeft", len(branch.points) - 2)):
        browser.key(name)
        assert browser.js("explore.now.s") == place
    browser.js("document.getElementById('ribbon').focus()")
    eye = browser.js("document.getElementById('ribbon').layout.scene.camera.eye.x")
    browser.key("ArrowRight")  # turns the strip, which has the focus now
    browser.until(f"document.getElementById('ribbon').layout.scene.camera.eye.x !== {eye}")
    assert browser.js("explore.now.s") == place
    # at kappa_n = 3: the single and the triple loop, and (1, 2) before and after its fold, energies from the file
    browser.js("explore.go(explore.now.branch, explore.now.branch.places(3)[0])")
    found = browser.js("explore.coexisting().map(({branch, s, energy}) => [branch.circle ? branch.m : 0, energy])")
    rows = branch.points
    there = np.flatnonzero(np.diff(np.sign(rows["kappa_n"] - 3)))
    energies = [np.interp(3, *zip(*sorted(zip(rows["kappa_n"][i : i + 2], rows["energy"][i : i + 2])))) for i in there]
    assert sorted(circle for circle, _ in found) == [0, 0, 1, 3]
    assert sorted(energy for circle, energy in found if not circle) == pytest.approx(sorted(energies), abs=1e-2)
    assert [energy for circle, energy in found if circle] == pytest.approx([9 / 2 - 9, 1 / 2 - 3])
    assert browser.errors == []


@needs_chromium
@pytest.mark.full
def test_material_can_be_switched(diagrams, browser):
    browser.open(diagrams / "laws.html")
    names = browser.js("[...document.getElementById('family').options].map((option) => option.text)")
    assert names[0] == "ribbon, ν = 0.1" and len(names) == 6
    browser.js(
        "(() => { const f = document.getElementById('family'); f.value = '3'; f.dispatchEvent(new Event('change')); })()"
    )
    browser.until("explore.now.family.law === 'flat rod' && explore.now.family.nu === 0.3")
    assert browser.js("explore.now.branch.value('kappa_n', 0)") == pytest.approx(1 + 3 * 2 / 1.3)  # (26): K of the flat rod
    assert browser.errors == []


@needs_chromium
@pytest.mark.full
def test_export(pages, browser):
    browser.open(pages / "m1_n2.html")
    for button in ("csv", "yaml", "diagram.svg", "diagram.png", "strip.svg", "strip.png"):
        browser.js(f"document.querySelector('[data-save=\"{button}\"]').click()")
    points = read_branch(pages / "m1_n2.h5").points
    rows = list(csv.DictReader(browser.downloaded("m1_n2.csv").decode().splitlines()))
    assert [float(row["kappa_n"]) for row in rows] == points["kappa_n"].tolist()  # to the last digit
    assert [row["label"] for row in rows] == [label.decode() for label in points["label"]]
    scene = parse(browser.downloaded("m1_n2.yaml").decode(), "exported")
    assert (scene.m, scene.n, scene.stability) == (1, 2, True)
    for name in ("m1_n2_diagram.png", "m1_n2_strip.png"):
        assert browser.downloaded(name).startswith(b"\x89PNG")
    for name, least in (("m1_n2_diagram.svg", 5), ("m1_n2_strip.svg", 300)):
        text = browser.downloaded(name).decode()
        assert text.startswith("<svg") and text.count("<path") > least
    assert browser.errors == []


@needs_chromium
@pytest.mark.full
def test_exported_pictures_have_the_chosen_ground_and_a_legend(pages, browser):
    """Dark, white and transparent; the legend names what is inside the axes; curves have FINE = 8 pieces between points."""
    browser.call("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": "dark"}])
    try:
        browser.open(pages / "m1_n2.html")
        for ground, corner in (("screen", [0x18, 0x1E, 0x28, 255]), ("white", [255, 255, 255, 255]), ("clear", [0, 0, 0, 0])):
            browser.js(f"document.getElementById('ground').value = '{ground}'")
            for button in ("diagram", "strip") if ground == "screen" else ("diagram",):
                browser.js(f"document.querySelector('[data-save=\"{button}.png\"]').click()")
                picture = imread(BytesIO(browser.downloaded(f"m1_n2_{button}.png")))
                pixel = (picture[0, 0] * 255).round().tolist()
                assert (pixel if len(pixel) == 4 else [*pixel, 255]) == corner  # the card of the dark theme, in page.css
        browser.js("document.getElementById('ground').value = 'white'")
        browser.js("document.querySelector('[data-save=\"diagram.svg\"]').click()")
    finally:
        browser.call("Emulation.setEmulatedMedia", features=[])
    picture = ElementTree.fromstring(browser.downloaded("m1_n2_diagram.svg").decode())
    legends = [group for name in ("legend", "legend2") for group in picture.iterfind(f".//{SVG}g[@class='{name}']")]
    texts = [text.text for legend in legends for text in legend.iter(f"{SVG}text")]
    assert texts == ["flat rings", "n = 2", "stable", "unstable", "meets a flat ring", "fold", "chosen: (1, 2)"]
    branch = read_branch(pages / "m1_n2.h5")
    curves = [path.get("d") for path in picture.iterfind(f".//{SVG}path[@class='js-line']")]
    assert sum(path.count("L") for path in curves) > 8 * (len(branch.points) - 1)
    assert browser.errors == []


@needs_chromium
@pytest.mark.full
def test_stable_is_solid_and_unstable_dashed(pages, browser):
    """The index of (1, 2) is 0 up to its fold and 1 beyond, in the file; the colour is that of n = 2."""
    browser.open(pages / "m1_n2.html")
    found = browser.js("""Object.fromEntries(document.getElementById('diagram').data
        .filter(({name}) => (name || '').startsWith('n = 2'))
        .map(({name, x, line}) => [name, [x.filter((x) => x !== null).length, line.dash, line.color]]))""")
    index = read_branch(pages / "m1_n2.h5").points["index"]
    assert set(found) == {"n = 2|stable", "n = 2|unstable"} and set(index) == {-1, 0, 1}
    assert (found["n = 2|stable"][1], found["n = 2|unstable"][1]) == ("solid", "5px,3px")
    assert found["n = 2|stable"][2] == found["n = 2|unstable"][2]
    fold = np.flatnonzero(index == 0).max() + 1
    assert found["n = 2|stable"][0] == 8 * fold + 1  # 8 pieces between points


@needs_chromium
@pytest.mark.full
def test_a_link_shows_what_was_shown(diagrams, browser):
    """The address holds the place and the controls; back and forward move between branches; a wrong address does no harm."""
    browser.open(diagrams / "fig12.html")
    browser.js("""(() => {
        const set = (id, value, event) => { const e = document.getElementById(id); e.value = value; e[event](); };
        set('y', 'energy', 'onchange'); set('width', '6.5', 'oninput'); set('compare', 'exact ribbon', 'onchange');
        set('nu', '0.25', 'oninput');
        explore.go(explore.families[0].branches.find(({m, n}) => m === 3 && n === 4), 7.25); })()""")
    browser.until("location.hash.includes('point=7.25')")
    browser.until("location.hash.includes('nu=0.25')")
    link = browser.js("location.hash")
    browser.js("navigator.clipboard.writeText = async (text) => { window.copied = text; }")
    browser.js("document.getElementById('copy').click()")
    browser.until("window.copied === location.href && document.getElementById('copy').textContent === 'Copied'")
    controls = "...['width', 'compare', 'nu'].map((id) => document.getElementById(id).value)"
    shown = f"[explore.now.branch.id, explore.now.s, explore.now.y, {controls}]"
    expected = ["ribbon_nu0.3_m3_n4", 7.25, "energy", "6.5", "exact ribbon", "0.25"]
    browser.js("history.back()")
    browser.until("explore.now.branch.id === 'ribbon_nu0.3_m1_n2'")
    browser.js("history.forward()")
    browser.until("explore.now.branch.id === 'ribbon_nu0.3_m3_n4'")
    browser.open(diagrams / "fig12.html", address=link)
    assert browser.js(shown) == expected
    browser.js("location.hash = '#branch=absent&point=many&width=x&material=9&map=1,2&compare=nobody'")
    browser.until("explore.now.branch.id === 'ribbon_nu0.3_m1_n2'")
    assert browser.js(shown)[2:5] == ["kappa_star", "3", ""]
    told = "document.getElementById('told').textContent"
    assert browser.js(told) == "The link names the branch “absent”, which is not on this page. Shown instead: (1, 2)."
    browser.js("document.getElementById('told').click()")
    assert browser.js("document.getElementById('told').hidden")
    browser.js("location.hash = '#branch=ribbon_nu0.3_m3_n4'")
    browser.until(f"{told} === ''")
    assert browser.errors == []


EXACT = [(law, nu, None) for law in ("ribbon", "flat rod", "isotropic rod") for nu in (-0.3, 0.0, 0.3)]
EXACT += [("finite width", 0.3, 8.0)]


@pytest.mark.full
def test_shapes_of_open_strips_between_those_that_a_file_keeps(tmp_path, root):
    """Each sixth point is kept; beside the fold at shear = 0.2131 two states have one shear, and the right one is found."""
    found = []
    for stride in (1, 6):
        path = tmp_path / f"{stride}.h5"
        run_scene(load(root / "configs" / "open_shear.yaml", [f"stride={stride}"]), path, Display(silent=True))
        (family,) = gather([str(path)])["families"]
        found.append(np.concatenate([decoded(branch) for branch in family["branches"]]))
    assert len(read_branch(path).kept()) < len(read_branch(path).points) / 3
    assert np.abs(found[0] - found[1]).max() < 3 * TOLERANCE * np.abs(found[0]).max()


def test_shapes_of_open_strips_are_those_of_their_polynomials(tmp_path):
    """Centrelines within the error of the compression, on the coarsest mesh that resolves the arc; its length is 2 pi."""
    text = "material: {law: flat rod, nu: 0.3, kappa_n: 2}\nfinish: free\nstages: [{follow: kappa_n, to: 3}]\n"
    scene = parse(text + "mesh: {intervals: 2, max_intervals: 2, tolerance: 1.0e-4}\n", "scene")
    run_scene(scene, tmp_path / "arc.h5", Display(silent=True))
    (family,) = gather([str(tmp_path / "arc.h5")])["families"]
    places, s = decoded(family["branches"][0])[-1, :, -3:], np.linspace(0, 1, 97)
    arc = 2 * np.pi * np.column_stack([np.sin(3 * s), 0 * s, np.cos(3 * s) - 1]) / 3  # bends about the width, in a plane y
    assert np.abs(np.abs(places - places[0]) - np.abs(arc)).max() < 2 * TOLERANCE * np.abs(arc).max()


@pytest.mark.full
@needs_chromium
def test_page_of_a_network(tmp_path, root, browser):
    """Its strips and joints are drawn, its axes chosen, its stages played; a link to a state opens; also without WebGL."""
    path, page = tmp_path / "frame.h5", tmp_path / "frame.html"
    run_scene(load(root / "configs" / "network_portal.yaml"), path, Display(silent=True))
    (tmp_path / "measured.csv").write_text("P,C_z,error_C_z\n1,0.5,0.1\n2,,\n")
    assert main([str(path), "--out", str(page), "--points", str(tmp_path / "measured.csv")]) == 0
    branch = read_branch(path)
    browser.open(page, address="#branch=frame_2&point=15&y=C_z")
    squares = "document.getElementById('diagram').data.filter(({marker}) => marker?.symbol === 'square-open').map(({y}) => y)"
    assert browser.js(squares) == [[0.5, None]] and "measured" in browser.js("document.getElementById('legend').textContent")
    row = branch.points[branch.stage_of == 2][15]
    assert browser.js("[explore.now.branch.id, explore.now.s, explore.now.x, explore.now.y]") == ["frame_2", 15, "P", "C_z"]
    value = float(browser.js("document.querySelector('[data-value=C_z]').textContent").replace("\u2212", "-"))
    assert value == pytest.approx(row["C_z"], abs=1e-8)
    assert "index 1" in browser.js("document.getElementById('readout').textContent")
    assert browser.js("document.getElementById('ribbon').data.map(({type}) => type)") == ["mesh3d", "mesh3d"]  # strips, joints
    meshes = browser.js("document.getElementById('ribbon').data.map(({x, i}) => [x.length, i.length])")
    quads = 4 * 3 * 4 + 2 * 4 * 24  # four blocks of four sides, two arrows, with three and four parts along their axes
    assert meshes == [[4 * 3 * 2 * 97, 4 * 3 * 2 * 97], [4 * quads, 2 * quads]]
    tips = "[...document.getElementById('diagram').data.flatMap(({text}) => text || [])]"
    assert {"BP 1", "BP 2", "<b>1</b>", "<b>2</b>"} <= {text.strip("\u2002") for text in browser.js(tips)}
    assert browser.colours("#ribbon") > 200
    browser.key("Home")
    assert browser.js("explore.now.s") == 0
    browser.js("document.getElementById('triads').click()")
    browser.until("document.getElementById('ribbon').data.length === 5")
    assert browser.errors == []
    browser.open(page, width=380, height=800)
    assert browser.js("document.documentElement.scrollWidth") <= 380
    blind = browser.call("Page.addScriptToEvaluateOnNewDocument", source=WITHOUT_WEBGL)["identifier"]
    try:
        browser.open(page)
    finally:
        browser.call("Page.removeScriptToEvaluateOnNewDocument", identifier=blind)
    assert browser.colours("#ribbon") > 100
    assert browser.errors == []


@needs_chromium
@pytest.mark.full
def test_exact_solution_of_the_page_is_that_of_the_model(pages, browser):
    """Within 1e-10 of `ribbon_model.exact`, tested there with 30 digits; at equal amplitudes, and folds."""
    browser.open(pages / "m1_n2.html")
    for law, nu, Gamma in EXACT:
        for m, n in ((1, 2), (3, 4)) if Gamma is None else ((1, 2),):  # the model takes seconds for a branch of finite width
            curve = exact.curve(m, n, {"nu": nu, "Gamma": Gamma}, step=0.2, law=law)
            found = browser.js(f"explore.exactCurve({law!r}, {m}, {n}, {nu}, [-100, 100], {json.dumps(Gamma)})")
            for point in found["points"][2:-1:25]:
                near = min(curve, key=lambda one: math.dist(*[[at["kappa_n"], at["kappa_star"]] for at in (vars(one), point)]))
                there = exact.solve(m, n, nu, near, amplitude=point["amplitude"], law=law)
                for name in ("kappa_n", "kappa_star", "energy"):
                    assert point[name] == pytest.approx(getattr(there, name), rel=1e-10, abs=1e-10)
            folds = [point.kappa_n for point in curve if point.label == "LP"]
            assert [fold["kappa_n"] for fold in found["folds"]] == pytest.approx(folds, rel=1e-10)
            last = found["points"][-1 if curve[-1].label == "BP" else 0]
            assert last["kappa_n"] == pytest.approx(curve[-1 if curve[-1].label == "BP" else 0].kappa_n, rel=1e-10)


@pytest.mark.full
@needs_chromium
def test_compare_with_another_material(diagrams, browser):
    """The exact solution at the nu of the slider, and the branches of another material on the page, as thin lines."""
    browser.open(diagrams / "laws.html")
    choose = "(() => {{ const e = document.getElementById('{}'); e.value = '{}'; e.{}(); }})()"
    browser.js(choose.format("compare", "exact flat rod", "onchange"))
    browser.js(choose.format("nu", "0.1", "oninput"))
    lines = "document.getElementById('diagram').data.find(({name}) => name === 'overlay').x.filter((x) => x !== null)"
    start = 1 + 3 / (1.1 / 2)  # (26) of the flat rod: 1 + ((n/m)^2 - 1)/((1 + nu)/2)
    browser.until(f"Math.abs({lines}[0] - {start}) < 1e-9")
    legend = "document.getElementById('legend').textContent"
    assert "exact solution, computed in this page: flat rod, ν = 0.1" in browser.js(legend)
    other = browser.js("explore.families.findIndex(({law, nu}) => law === 'flat rod' && nu === 0.3)")
    browser.js(choose.format("compare", f"family {other}", "onchange"))
    browser.until(f"{lines}[0] === explore.families[{other}].branches[0].columns.kappa_n[0]")
    assert "computed: flat rod, ν = 0.3" in browser.js(legend)
    browser.call("Emulation.setDeviceMetricsOverride", width=380, height=800, deviceScaleFactor=1, mobile=False)
    browser.js(choose.format("compare", "exact finite width", "onchange"))
    browser.until(f"{legend}.includes('finite width')")
    assert browser.js("document.documentElement.scrollWidth") <= 380  # the longest entry of a legend
    assert browser.errors == []


@pytest.mark.full
@needs_chromium
def test_the_exact_solution_of_a_law_of_one_s_own_comes_with_the_page(tmp_path, browser, monkeypatch):
    """Its fold is that of the branch; a law with an omega_2 has no quadrature, and the page says so."""

    def energy(w1, w2, w3, kappa_n, twist, side):
        return (w1 - kappa_n) ** 2 / 2 + (w1 - kappa_n) ** 4 / 25 + side * w2**2 / 2 + twist * w3**2 / 2 - kappa_n**2 / 2

    for constrained, name in ((True, "stiffening"), (False, "with a side")):
        law = Law.of_energy(name, energy, {"twist": Parameter(), "side": Parameter()}, constrained)
        monkeypatch.setitem(laws.LAWS, name, law)
        scene = parse(f"{{law: {name}, parameters: {{twist: 1.5, side: 2}}, m: 1, n: 2}}", "scene")
        run_scene(scene, tmp_path / f"{name}.h5", Display(silent=True))
        assert main([str(tmp_path / f"{name}.h5"), "--out", str(tmp_path / f"{name}.html")]) == 0
    browser.open(tmp_path / "stiffening.html")
    assert (
        browser.js("document.getElementById('compare').options[5].text") == "exact solution: stiffening, twist = 1.5, side = 2"
    )
    browser.js("(() => { const e = document.getElementById('compare'); e.value = 'given'; e.onchange(); })()")
    folds = "document.getElementById('diagram').data.find(({name}) => name === 'overlay folds').x"
    browser.until(f"{folds}.length === 1")
    (fold,) = (event["kappa_n"] for event in read_branch(tmp_path / "stiffening.h5").events if event["label"] == b"LP")
    assert browser.js(f"{folds}[0]") == pytest.approx(fold, abs=1e-8)
    assert browser.js("document.getElementById('nu-label').hidden")
    assert "ν" not in browser.js("document.getElementById('legend').textContent")
    browser.open(tmp_path / "with a side.html")
    text, disabled = browser.js("(({text, disabled}) => [text, disabled])(document.getElementById('compare').options[5])")
    assert disabled and text == "no exact solution: the law 'with a side' has an omega_2: there is no such quadrature"
    assert browser.errors == []


@needs_chromium
@pytest.mark.full
def test_energy_upwards(pages, browser):
    """The elastic energy of the m-fold loop is (m - kappa_n)^2 / 2."""
    browser.open(pages / "m1_n2.html")
    browser.js("(() => { const e = document.getElementById('y'); e.value = 'elastic'; e.onchange(); })()")
    rings = browser.js("""explore.families[0].branches.filter(({circle}) => circle)
        .map(({m, columns}) => [m, [...columns.kappa_n], [...columns.elastic]])""")
    for m, kappa_n, elastic in rings:
        assert np.array(elastic) == pytest.approx((m - np.array(kappa_n)) ** 2 / 2, abs=1e-9)


GO_TO_FOLD = "explore.go(explore.now.branch, explore.now.branch.marks.find(({kind}) => kind === 'fold').point)"
FOLD_SHOWN = "[document.getElementById('story').textContent, document.getElementById('snap').hidden]"


@pytest.mark.full
@needs_chromium
def test_let_it_snap_shows_the_descent(pages, browser):
    """From the fold of (1, 2) the strip comes down to the triple loop, as in the paper's experiments.

    On all of the way it has its length (the chords of 192 stations are 1e-4 shorter); it begins as the strip at the fold, with
    distances of 10 % where the kick and 1 % more natural curvature move it, and ends as the ring.
    """
    browser.open(pages / "m1_n2.html")
    assert browser.js("document.getElementById('snap').hidden")
    browser.js(GO_TO_FOLD)
    story, hidden = browser.js(FOLD_SHOWN)
    assert "a strip that is pushed on snaps" in story and not hidden
    way, ends = browser.js("""(() => { const {branch, s} = explore.now, way = explore.wayHere(),
            rest = explore.restOf(way.ends[0], way.kappa_n), ends = [branch.strip(s), rest.branch.strip(rest.s)],
            at = explore.descent(way, ...ends);
        return [[0, 0.3, 0.6, 1].map(at), ends].map((strips) => strips.map((strip) => Array.from(strip))); })()""")
    way, ends = ([np.reshape(strip, (-1, 13)) for strip in strips] for strips in (way, ends))
    for strip in way:
        steps = np.linalg.norm(strip[:, :3] - np.roll(strip[:, :3], 1, axis=0), axis=1)
        assert steps.sum() == pytest.approx(2 * np.pi, rel=5e-3)
    assert distances(way[0]) == pytest.approx(distances(ends[0]), rel=0.1)
    assert distances(way[-1]) == pytest.approx(distances(ends[1]), abs=2e-2)
    browser.js("document.getElementById('snap').click()")
    browser.until("document.getElementById('story').textContent.includes('comes to rest as the triple loop')")
    browser.until("explore.now.branch.id === 'circle_3'")
    assert browser.js("explore.now.branch.value('kappa_n', explore.now.s)") == pytest.approx(past(4.0756675353, 1), abs=1e-9)
    assert browser.errors == []


@pytest.mark.full
@needs_chromium
def test_folds_say_no_more_than_was_computed(diagrams, unstable_folds, browser):
    """Without the index nothing is said of snapping; between two unstable sides nothing snaps, and nothing is offered."""
    browser.open(diagrams / "fig12.html")
    browser.js(GO_TO_FOLD)
    story, hidden = browser.js(FOLD_SHOWN)
    assert story.endswith("At this fold the branch turns back.") and hidden
    browser.open(unstable_folds)
    browser.js(GO_TO_FOLD)
    story, hidden = browser.js(FOLD_SHOWN)
    assert "It is unstable on both sides (index 2 and 3)" in story and "snap" not in story and hidden
    assert browser.errors == []


@pytest.mark.full
@needs_chromium
def test_strip_as_a_solid(pages, browser):
    """Watertight, of volume length * width * thickness: 200 mm, 3 % of it, and 0.8 mm, the first values of the page."""
    trimesh = pytest.importorskip("trimesh")
    browser.open(pages / "m1_n2.html")
    browser.js("document.querySelector('[data-save=stl]').click()")
    mesh = trimesh.load(BytesIO(browser.downloaded("m1_n2.stl")), file_type="stl")
    assert mesh.is_watertight
    assert mesh.volume == pytest.approx(200 * 6 * 0.8, rel=1e-3)


@pytest.mark.full
@needs_chromium
def test_keyboard_touch_and_names(pages, browser):
    """The map takes the focus and shows it; at 390 px controls are 44 px high; every control has a name."""
    browser.open(pages / "m1_n2.html", width=390, height=844)
    touched = "button, select, summary, label:has(input), input:not([type=checkbox])"
    small = browser.js(f"""[...document.querySelectorAll('{touched}')]
        .filter((e) => e.offsetParent && e.getBoundingClientRect().height < 44).map((e) => e.id || e.textContent)""")
    assert small == []
    unnamed = browser.js("""[...document.querySelectorAll('button, select, input, [tabindex]')].filter((e) =>
        !(e.ariaLabel || e.textContent.trim() && e.tagName === 'BUTTON' || e.labels && e.labels.length)).map((e) => e.id)""")
    assert unnamed == []
    browser.js("explore.go(explore.now.branch, 3)")
    browser.js("document.getElementById('family').focus()")
    for _ in range(12):
        browser.key("Tab")
        if browser.js("document.activeElement.id") == "diagram":
            break
    assert browser.js("document.activeElement.id") == "diagram"
    assert browser.js("getComputedStyle(document.activeElement).outlineStyle") == "solid"
    browser.key("ArrowRight")
    assert browser.js("explore.now.s") == 4


def test_the_player_covers_nothing_and_arrow_keys_move_after_a_slider_was_dragged(pages, browser):
    browser.open(pages / "m1_n2.html", width=1440, height=780)  # a window of 1440 x 900, less the bars of the browser
    assert browser.js("getComputedStyle(document.getElementById('control')).position") == "static"
    browser.js("explore.go(explore.now.branch, 3)")
    x, y = browser.js("(({x, y, width, height}) => [x + 0.8 * width, y + height / 2])("
                      "document.getElementById('width').getBoundingClientRect())")  # fmt: skip
    browser.click(x, y)
    width = browser.js("document.getElementById('width').value")
    browser.key("ArrowRight")
    assert (
        float(width) > 8 and browser.js("document.getElementById('width').value") == width and browser.js("explore.now.s") == 4
    )


# --- branches of other problems -----------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def stored(tmp_path_factory):
    """A folder of two branches of one algebraic problem, and a branch of a boundary value problem."""
    folder = tmp_path_factory.mktemp("stored")
    (folder / "parabola").mkdir()
    parabola = contin.AlgebraicProblem(lambda u, p: (p.a - u.x**2,), ["x"], {"a": 1.0})
    first = contin.solve(parabola, [1.0])
    contin.save(contin.trace(first, free=["a"], direction=-1, limits={"a": (-1, 4)}), folder / "parabola" / "down.npz")
    contin.save(contin.trace(first, free=["a"], limits={"a": (-1, 4)}), folder / "parabola" / "up.npz")
    bratu = contin.BoundaryValueProblem(
        lambda t, u, p: (u.v, -p.lam * math.exp(u.u)), lambda a, b, p: (a.u, b.u), states=["u", "v"],
        parameters={"lam": 0.1}, functionals={"mean": lambda t, u, p: u.u},
    )  # fmt: skip
    branch = contin.trace(contin.solve(bratu, [0, 0]), free=["lam"], limits={"mean": (-1, 5)})
    contin.save(branch, folder / "bratu.npz")
    for name in ("bratu.npz", "parabola"):
        assert main([str(folder / name), "--out", str(folder / f"{name.removesuffix('.npz')}.html")]) == 0
    return folder, branch


def test_page_of_a_stored_branch_holds_its_columns_and_states(stored):
    """Columns to the last digit; the states are those at the nodes, within `TOLERANCE` of the largest."""
    folder, branch = stored
    data = data_of(folder / "bratu.html")
    ((about,),) = [family["branches"] for family in data["families"]]
    assert (data["kind"], data["shown"], [axis[0] for axis in data["axes"]]) == (
        "branches", ["lam", "mean"], ["arclength", "discretization_error", "lam", "mean", "norm"],
    )  # fmt: skip
    for name in ("lam", "mean"):
        assert np.array_equal(column(about, name), branch.column(name))
    assert [mark["kind"] for mark in about["marks"]] == ["end", "fold", "end"]
    shown = decoded(about)
    assert len(shown) == len(branch)
    for found, point in zip(shown, branch):
        states = point.system.evaluate(point.x, found[:, 0])
        assert np.abs(found[:, 1:] - states).max() < 1e-2 * np.abs(states).max()  # between nodes the page draws chords
        assert np.abs(found[-1, 1:] - states[-1]).max() < 1.5 * TOLERANCE * np.abs(states).max()


@needs_chromium
@pytest.mark.full
def test_page_of_stored_branches(stored, browser):
    folder, branch = stored
    browser.open(folder / "bratu.html")
    fold = next(i for i, point in enumerate(branch) if point.label == "LP")
    browser.js(f"explore.go(explore.now.branch, {fold})")
    assert browser.js("document.querySelector('[data-value=lam]').textContent") == f"{branch.points[fold]['lam']:.8f}"
    browser.until("document.getElementById('story').textContent.startsWith('Special point: LP')")
    assert browser.js("document.getElementById('ribbon').data.map(({name}) => name)") == ["u", "v"]
    browser.js("(() => { const e = document.getElementById('x'); e.value = 'norm'; e.onchange(); })()")
    assert browser.js("document.getElementById('diagram').layout.xaxis.title.text") == "norm"
    assert browser.js("[...document.getElementById('y').options].find(({value}) => value === 'norm').disabled")
    browser.js("document.querySelector('[data-save=\"state.svg\"]').click()")
    assert browser.downloaded("bratu_state.svg").startswith(b"<svg")
    assert browser.js("[...document.querySelectorAll('.strips')].every((e) => !e.offsetParent)")
    assert browser.errors == []
    browser.open(folder / "parabola.html")  # states of an algebraic problem are columns, and bars
    assert browser.js("explore.now.y") == "x"
    value, bar = browser.js("[explore.now.branch.value('x', explore.now.s), document.getElementById('ribbon').data[0].y]")
    assert bar == [0, pytest.approx(value, abs=1.5 * TOLERANCE * 2)]  # x is 2 at most
    assert browser.js("document.getElementById('branch').options.length") == 2
    assert browser.errors == []


def test_page_of_a_diagram_of_a_map(tmp_path):
    """Fixed points and their doubled cycles by the columns that both have; from r = 3 on the fixed points are unstable."""
    logistic = contin.MapProblem(lambda u, p: (p.r * u.x * (1 - u.x),), ["x"], {"r": 2.0})
    found = contin.diagram(contin.solve(logistic, [0.5]), free=["r"], depth=1, limits={"r": (2, 3.3)}, errors=False)
    contin.save(found, tmp_path / "map.npz")
    assert main([str(tmp_path / "map.npz"), "--out", str(tmp_path / "map.html")]) == 0
    data = data_of(tmp_path / "map.html")
    branches = data["families"][0]["branches"]
    assert [about["name"] for about in branches] == [f"map {number}" for number in range(len(found.branches))]
    assert np.array_equal(column(branches[-1], "min_x"), found.branches[-1]["min_x"]) and data["shown"] == ["r", "x"]
    r, index = column(branches[0], "r"), column(branches[0], "index")
    assert set(index[r < 3 - 1e-9]) == {0} and set(index[r > 3 + 1e-9]) == {1}


def test_kinds_of_results_are_not_mixed(results, stored, tmp_path, capsys):
    folder, _ = stored
    assert main([str(results / "m1_n2.h5"), str(folder / "bratu.npz"), "--out", str(tmp_path / "page.html")]) == 2
    assert "a page shows one kind of result" in capsys.readouterr().err
    assert main([str(folder / "parabola"), str(folder / "bratu.npz"), "--out", str(tmp_path / "page.html")]) == 2
    assert "the branches have no free parameter in common" in capsys.readouterr().err
    (tmp_path / "bad.npz").write_bytes(b"junk")
    assert main([str(tmp_path / "bad.npz"), "--out", str(tmp_path / "page.html")]) == 2
    assert "is no branch stored by contin, or damaged" in capsys.readouterr().err


# --- a stored branch in a notebook --------------------------------------------------------------------------------


@pytest.mark.full
def test_stored_branch_in_a_notebook(results):
    branch = read_branch(results / "m1_n2.h5")
    table = branch.to_pandas()
    assert np.array_equal(table["kappa_n"], branch.points["kappa_n"]) and "LP" in set(table["label"])
    assert len(branch.plot(shapes=2).axes) == 3
    root = ElementTree.fromstring(branch._repr_html_())
    assert root.find(f"{SVG}svg") is not None
    assert [row[1].text for row in root.iterfind("table/tbody/tr")] == ["BP", "LP", "EP"]


@pytest.mark.parametrize("column, value", [("kappa_n", np.nan), ("M1", 1e200), ("M2", 0.3), ("length", 0.0)])
def test_columns_that_are_no_solution_are_refused(column, value, results):
    branch = read_branch(results / "m1_n2.h5")
    branch.points[column][3] = value
    with pytest.raises(
        StoreError, match=r"ribbon, \(m, n\) = \(1, 2\), nu = 0.3: point 3: its columns are not those of its solution"
    ):
        shapes(branch)
