"""The gallery: every script runs, draws, and finds the number that its page states. And the code that builds the site."""

import importlib.util
import json
from pathlib import Path
from types import SimpleNamespace

import matplotlib
import numpy as np
import pytest
import yaml
from matplotlib import pyplot
from scipy.integrate import solve_ivp

PROJECT = Path(__file__).resolve().parent.parent
#: The one that runs by default; the others run with --full.
SHORT = {"bratu"}


def module(name):
    """A module of scripts/site, which is no package."""
    spec = importlib.util.spec_from_file_location(name, PROJECT / "scripts" / "site" / f"{name}.py")
    loaded = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(loaded)
    return loaded


gallery, links = module("gallery"), module("links")
NAMES = sorted(path.stem for path in gallery.SCRIPTS.glob("*.py"))


@pytest.mark.parametrize("name", [pytest.param(name, marks=[] if name in SHORT else [pytest.mark.full]) for name in NAMES])
def test_a_script_finds_its_number(name, tmp_path, monkeypatch):
    """The script asserts it; its page says where the number comes from."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(pyplot, "show", pyplot.show)  # to be put back
    with matplotlib.rc_context():
        gallery.run(gallery.SCRIPTS / f"{name}.py", tmp_path)
        pyplot.close("all")
    assert json.loads((tmp_path / "result.json").read_text())["output"]
    assert (tmp_path / "picture.png").stat().st_size > 10_000


def test_every_script_is_in_the_navigation_of_the_site():
    groups = gallery.fields(yaml.safe_load((PROJECT / "mkdocs.yml").read_text())["nav"])
    assert sorted(name for group in groups.values() for name in group) == NAMES
    assert len(NAMES) == 17 and len(groups) == 5


@pytest.mark.parametrize("name", NAMES)
def test_a_page_states_and_checks_a_number(name):
    title, text, code = gallery.parts(name)
    assert title and "\n**Check:** " in text
    assert "assert " in code and len(code.splitlines()) <= 65


@pytest.mark.full
def test_carrier_by_shooting():
    """docs/gallery/carrier.py: as many zeros of the end value as a function of the first slope as deflation finds solutions.

    Two of them differ by 3e-4, so the slopes lie closer there. Values that grow beyond all solutions are held.
    """
    slopes = np.concatenate([np.linspace(-7.95, -7.85, 1001), np.linspace(-7.85, 9.2, 2000)])

    def rhs(t, y):
        u, v = np.clip(y.reshape(2, -1), [[-9], [-1e3]], [[9], [1e3]])
        return np.concatenate([v, (1 - u**2 - 2 * (1 - t**2) * u) / 0.2**2])

    first = np.concatenate([np.zeros_like(slopes), slopes])
    ends = solve_ivp(rhs, (-1, 1), first, method="DOP853", rtol=1e-7, atol=1e-9).y[: len(slopes), -1]
    assert np.count_nonzero(np.diff(np.sign(ends))) == 8


def test_links_that_lead_nowhere_are_found(tmp_path):
    (tmp_path / "a.html").write_text('<h1 id="top"></h1><a href="b.html#there"></a><a href="#top"></a><img src="no.png">')
    (tmp_path / "b.html").write_text(
        '<p id="here"></p><a href="https://example.org"></a><script src="https://example.org/x.js"></script>'
    )
    assert links.faults(tmp_path) == [
        "a.html: b.html#there has no such anchor",
        "a.html: no.png does not exist",
        "b.html: loads https://example.org/x.js from elsewhere",
    ]


def test_formulas_become_mathml():
    pytest.importorskip("math_core")
    mathematics = module("mathematics")
    page = '<p><span class="arithmatex">\\(u\'\' = a_1 &lt; 2\\)</span>.</p><div class="arithmatex">\\[\\frac{1}{x}\\]</div>'
    made = mathematics.on_page_content(page, page=None)
    assert '<mrow><mi>u</mi><mo lspace="0" rspace="0">″</mo></mrow>' in made and "arithmatex" not in made
    assert "</math>.</span>" in made and '<div class="formula"><math display="block"><mfrac>' in made


def test_a_formula_that_cannot_be_typeset_stops_the_build():
    pytest.importorskip("math_core")
    with pytest.raises(Exception, match="cycles.md: a formula cannot be typeset"):
        page = SimpleNamespace(file=SimpleNamespace(src_uri="cycles.md"))
        module("mathematics").on_page_content('<span class="arithmatex">\\(\\nosuch\\)</span>', page=page)
