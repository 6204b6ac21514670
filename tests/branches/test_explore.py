"""The explorer page: what it holds (Python), and what it does (in headless Chromium, where there is one)."""

import base64
import csv
import json
import shutil
import subprocess
import time
import urllib.request

import h5py
import numpy as np
import pytest

from branches.config import Config, parse
from branches.diagram import run_diagram
from branches.display import Display
from branches.explore.__main__ import main
from branches.explore.gather import gather
from branches.explore.strips import CHANNELS, shapes
from branches.files import StoreError
from branches.job import run_branch
from branches.read import read_branch

FIG_12 = "{title: Fig. 12a, law: ribbon, nu: 0.3, m: [1, 3, 5, 7], n: [1, 2, 3, 4, 5, 6, 7], stride: 10}"
LAWS = "{law: [ribbon, flat rod, isotropic rod], nu: [0.1, 0.3], m: 1, n: 2, limits: {kappa_n: [-30, 30]}}"


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    """Folder with m1_n2.h5 (with the index), and the diagrams fig12 and laws."""
    folder = tmp_path_factory.mktemp("explore")
    silent = Display(silent=True)
    run_branch(Config(title="</script> & <b>", m=1, n=2, stability=True), folder / "m1_n2.h5", silent)
    for name, scene in (("fig12", FIG_12), ("laws", LAWS)):
        assert run_diagram(parse(scene, "scene"), folder / name, silent) == "complete"
    return folder


@pytest.fixture(scope="module")
def pages(results):
    for name in ("m1_n2.h5", "fig12", "laws"):
        assert main([str(results / name), "--out", str(results / f"{name.removesuffix('.h5')}.html")]) == 0
    return results


def data_of(page):
    """Return the data of a page, as the browser reads it."""
    text = page.read_text(encoding="utf-8").partition('<script type="application/json" id="data">')[2]
    return json.loads(text.partition("</script>")[0])


def numbers(text, kind="<f8"):
    return np.frombuffer(base64.b64decode(text), kind)


def decoded(branch):
    """The shapes that the page holds, as the browser sees them."""
    packed = numbers(branch["shapes"], "<i2").reshape(-1, branch["nodes"], len(CHANNELS))
    return packed * numbers(branch["scale"]).reshape(len(packed), 1, len(CHANNELS))


# --- what the page holds ------------------------------------------------------------------------------------------


def test_page_is_whole_and_small(pages):
    for name in ("m1_n2", "fig12", "laws"):
        text = (pages / f"{name}.html").read_text(encoding="utf-8")
        assert len(text) < 10e6
        assert "Permission is hereby granted, free of charge" in text  # the licence of plotly.js
        assert "{{" not in text.split('<script type="application/json"')[0]
    assert "<h1>&lt;/script&gt; &amp; &lt;b&gt;</h1>" in (pages / "m1_n2.html").read_text(encoding="utf-8")


def test_columns_are_those_of_the_file(pages):
    (family,) = data_of(pages / "m1_n2.html")["families"]
    (branch,) = family["branches"]
    with h5py.File(pages / "m1_n2.h5") as file:
        points = file["points"][:]
    for name in ("kappa_n", "kappa_star", "energy", "index"):
        assert np.array_equal(numbers(branch["columns"][name]), points[name])
    assert Config.model_validate(parse(branch["config"], "config").model_dump()).m == 1
    assert [mark["kind"] for mark in branch["marks"]] == ["circle", "fold", "circle"]
    assert [circle["m"] for circle in family["circles"]] == [1, 3]


def test_shapes_are_the_kept_solutions(pages):
    """Every kept solution of Fig. 12: integrated from S = 0, and packed, within 2e-5 of the collocation.

    At the end of the domain, a node of both; packing may cost half of a 32767th of the largest value of a channel.
    """
    (family,) = data_of(pages / "fig12.html")["families"]
    assert len(family["branches"]) == 18
    for about in family["branches"]:
        branch = read_branch(pages / "fig12" / about["file"])
        found = decoded(about)
        assert len(found) == len(branch.points)
        for point in branch.kept():
            shape, solution = branch.shape(point), branch.solution(point)
            states, parameters = solution.states, solution.parameters
            last = np.argmin(np.abs(shape.arclength - 3 * parameters["length"]))  # S = 0 lies in the middle of a wave
            assert np.abs(found[point, -1, :4] - states[-1]).max() < 2e-5
            assert abs(found[point, -1, 4] - shape.eta[last]) < 2e-5 * (1 + np.abs(found[point, :, 4]).max())
            assert np.abs(found[point, -1, 5:] - shape.centreline[last]).max() < 2e-5 * (1 + parameters["length"])


def test_packing_error(pages):
    """Half of a 32767th of the largest value of a channel."""
    branch = read_branch(pages / "m1_n2.h5")
    exact, (family,) = shapes(branch), data_of(pages / "m1_n2.html")["families"]
    error = np.abs(decoded(family["branches"][0]) - exact).max(axis=1)
    assert (error <= np.abs(exact).max(axis=1) / 65534 * (1 + 1e-9) + 1e-300).all()


def test_families_by_law_and_nu(results):
    data = gather([str(results / "laws"), str(results / "m1_n2.h5")])
    found = [(family["law"], family["nu"], len(family["branches"])) for family in data["families"]]
    assert found[:2] == [("ribbon", 0.1, 1), ("ribbon", 0.3, 2)]
    assert found[2:] == [(law, nu, 1) for law in ("flat rod", "isotropic rod") for nu in (0.1, 0.3)]


@pytest.mark.parametrize("what", ["missing", "foreign", "scene", "empty", "damaged", "page", "folder"])
def test_bad_input_is_one_sentence(what, results, tmp_path, capsys):
    given, out = tmp_path / f"{what}.h5", tmp_path / "page.html"
    if what == "foreign":
        given.write_text("not HDF5")
    elif what == "scene":
        given = tmp_path / "scene.yaml"
    elif what == "empty":
        given.mkdir()
    elif what == "damaged":
        shutil.copytree(results / "laws", given)
        next(given.glob("*.h5")).unlink()
    elif what in ("page", "folder"):
        given = results / "m1_n2.h5"
        out = tmp_path / ("page.pdf" if what == "page" else "folder.html")
        if what == "folder":
            out.mkdir()
    assert main([str(given), "--out", str(out)]) == 2
    printed = capsys.readouterr()
    assert printed.out == "" and printed.err.startswith("error: ") and printed.err.count("\n") == 1
    assert not out.is_file()


# --- what the page does -------------------------------------------------------------------------------------------

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome", "chrome"))), None)
needs_chromium = pytest.mark.skipif(CHROMIUM is None, reason="no Chromium on the PATH (Debian: apt-get install chromium)")
_FLAGS = (
    "--headless=new", "--no-sandbox", "--disable-gpu", "--enable-unsafe-swiftshader", "--disable-quic", "--no-first-run",
    "--disable-background-networking", "--disable-component-update", "--disable-sync", "--remote-debugging-port=0",
)  # fmt: skip


class Browser:
    """A headless Chromium with one tab, driven through the DevTools protocol."""

    def __init__(self, folder):
        from websocket import create_connection

        self.downloads, profile = folder / "downloads", folder / "profile"
        command = [CHROMIUM, *_FLAGS, f"--user-data-dir={profile}", "about:blank"]
        self._process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        port = self._wait(lambda: (profile / "DevToolsActivePort").read_text().split()[0], (OSError, IndexError))
        with urllib.request.urlopen(f"http://127.0.0.1:{port}/json") as answer:
            tab = next(tab for tab in json.load(answer) if tab["type"] == "page")
        self._socket = create_connection(tab["webSocketDebuggerUrl"], timeout=60, suppress_origin=True)
        self._number, self.errors = 0, []
        self.requests = []
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.call(f"{domain}.enable")
        self.call("Browser.setDownloadBehavior", behavior="allow", downloadPath=str(self.downloads))

    @staticmethod
    def _wait(ready, errors=()):
        for _ in range(600):
            try:
                if found := ready():
                    return found
            except errors:
                pass
            time.sleep(0.05)
        raise TimeoutError("Chromium did not do it within 30 s")

    def call(self, method, **parameters):
        self._number += 1
        self._socket.send(json.dumps({"id": self._number, "method": method, "params": parameters}))
        while True:
            message = json.loads(self._socket.recv())
            if message.get("id") == self._number:
                assert "error" not in message, message["error"]
                return message["result"]
            self._note(message)

    def _note(self, message):
        values = message["params"]
        if message["method"] == "Network.requestWillBeSent":
            self.requests.append(values["request"]["url"])
        elif message["method"] == "Runtime.exceptionThrown":
            self.errors.append(values["exceptionDetails"])
        elif message["method"] == "Runtime.consoleAPICalled" and values["type"] in ("error", "assert"):
            self.errors.append(values["args"])
        elif message["method"] == "Log.entryAdded" and values["entry"]["level"] == "error":
            self.errors.append(values["entry"])

    def js(self, expression):
        """The value of an expression, or of the promise that it is."""
        answer = self.call("Runtime.evaluate", expression=expression, awaitPromise=True, returnByValue=True)
        assert "exceptionDetails" not in answer, answer["exceptionDetails"]
        return answer["result"].get("value")

    def open(self, path, width=1300, height=900):
        self.errors.clear()
        self.call("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=False)
        self.call("Page.navigate", url=path.as_uri())
        self._wait(lambda: self.js("Boolean(window.explore)"))
        self.js("explore.ready")

    def until(self, expression):
        self._wait(lambda: self.js(expression))

    def click(self, x, y):
        for kind in ("mouseMoved", "mousePressed", "mouseReleased"):
            time.sleep(0.15)  # hover first, as a hand does: plotly finds what is under the pointer then
            self.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", clickCount=1)

    def key(self, name):
        for kind in ("keyDown", "keyUp"):
            self.call("Input.dispatchKeyEvent", type=kind, key=name, code=name)

    def colours(self, selector):
        """Return the number of different colours in a part of the page."""
        from io import BytesIO

        from matplotlib.image import imread

        place = self.js(f"(() => {{ const r = document.querySelector({selector!r}).getBoundingClientRect();"
                        "return {x: r.x, y: r.y, width: r.width, height: r.height, scale: 1}; })()")  # fmt: skip
        picture = self.call("Page.captureScreenshot", format="png", clip=place)["data"]
        pixels = (imread(BytesIO(base64.b64decode(picture)))[..., :3] * 255).round().astype(int)
        return len(np.unique(pixels @ [1, 256, 65536]))

    def downloaded(self, name):
        path = self.downloads / name
        self._wait(lambda: path.exists() and path.stat().st_size)
        return path.read_bytes()

    def close(self):
        self._socket.close()
        self._process.terminate()
        self._process.wait(20)


@pytest.fixture(scope="module")
def browser(tmp_path_factory):
    pytest.importorskip("websocket", reason="the package websocket-client drives the browser")
    browser = Browser(tmp_path_factory.mktemp("chromium"))
    yield browser
    browser.close()


@needs_chromium
@pytest.mark.parametrize("name", ["m1_n2", "fig12", "laws"])
def test_page_draws_without_errors(name, pages, browser):
    browser.open(pages / f"{name}.html")
    assert browser.colours("#diagram") > 20
    assert browser.colours("#ribbon") > 200  # a lit surface
    assert browser.errors == []
    assert {url.partition(":")[0] for url in browser.requests} <= {"file", "data", "blob"}  # nothing from a network
    browser.open(pages / f"{name}.html", width=380, height=800)
    assert browser.js("document.documentElement.scrollWidth") <= 380  # nothing sticks out of a narrow screen


@needs_chromium
def test_page_draws_without_webgl(pages, browser):
    source = """const ask = HTMLCanvasElement.prototype.getContext;
        HTMLCanvasElement.prototype.getContext = function (kind, ...more) {
            return kind.startsWith("webgl") ? null : ask.call(this, kind, ...more);
        };"""
    blind = browser.call("Page.addScriptToEvaluateOnNewDocument", source=source)["identifier"]
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


@needs_chromium
@pytest.mark.parametrize("name", ["m1_n2", "fig12", "laws"])
def test_unfolded_strips_close_and_have_the_length(name, pages, browser):
    """At points and between: the last station is as far from the first as any other from the next, L / stations."""
    browser.open(pages / f"{name}.html")
    gaps = browser.js("""explore.families.flatMap(({branches}) => branches.flatMap((branch) => [0, 0.3, 0.77, 1].map((part) => {
        const strip = branch.strip(part * (branch.size - 1)), n = strip.length / 13, lengths = [];
        for (let k = 0; k < n; k++) {
            const a = 13 * k, b = 13 * ((k + 1) % n);
            lengths.push(Math.hypot(strip[a] - strip[b], strip[a + 1] - strip[b + 1], strip[a + 2] - strip[b + 2]));
        }
        return Math.max(...lengths) * n / (2 * Math.PI) - 1;
    })))""")
    assert max(map(abs, gaps)) < 0.02  # chords are shorter than arcs, and between points states are interpolated


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
def test_material_can_be_switched(pages, browser):
    browser.open(pages / "laws.html")
    names = browser.js("[...document.getElementById('family').options].map((option) => option.text)")
    assert names[0] == "ribbon, ν = 0.1" and len(names) == 6
    browser.js(
        "(() => { const f = document.getElementById('family'); f.value = '3'; f.dispatchEvent(new Event('change')); })()"
    )
    browser.until("explore.now.family.law === 'flat rod' && explore.now.family.nu === 0.3")
    assert browser.js("explore.now.branch.value('kappa_n', 0)") == pytest.approx(1 + 3 * 2 / 1.3)  # (26): K of the flat rod
    assert browser.errors == []


@needs_chromium
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


# --- a stored branch in a notebook --------------------------------------------------------------------------------


def test_stored_branch_in_a_notebook(results):
    from xml.etree import ElementTree

    branch = read_branch(results / "m1_n2.h5")
    table = branch.to_pandas()
    assert np.array_equal(table["kappa_n"], branch.points["kappa_n"]) and "LP" in set(table["label"])
    assert len(branch.plot(shapes=2).axes) == 3
    root = ElementTree.fromstring(branch._repr_html_())
    assert root.find("{http://www.w3.org/2000/svg}svg") is not None
    assert [row[1].text for row in root.iterfind("table/tbody/tr")] == ["BP", "LP", "EP"]


@pytest.mark.parametrize("column, value", [("kappa_n", np.nan), ("M1", 1e200), ("M2", 0.3), ("length", 0.0)])
def test_columns_that_are_no_solution_are_refused(column, value, results):
    branch = read_branch(results / "m1_n2.h5")
    branch.points[column][3] = value
    with pytest.raises(StoreError, match=r"branch \(1, 2\), point 3: its columns are not those of a closed strip"):
        shapes(branch)
