"""Outputs on docs/from-auto.md and docs/from-xppaut.md: contin's, and those of AUTO-07p and XPPAUT where they are installed."""

import contextlib
import io
import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from printed import same

DOCS = Path(__file__).parent.parent / "docs"
BLOCK = re.compile(r'^```(\w+)(?: title="(.*?)")?\n(.*?)^```', re.M | re.S)
#: Outputs of contin have ten digits and more; columns such as largest values, which are not what is located, hold to 1e-9.
CONTIN = 1e-9
#: AUTO prints six digits, at its tolerances of 1e-7 and 1e-5.
AUTO = 1e-5


def blocks(page):
    """Return the blocks of a page: language, title and text."""
    return BLOCK.findall((DOCS / page).read_text(encoding="utf-8"))


def run(code, scope):
    said = io.StringIO()
    with contextlib.redirect_stdout(said):
        exec(compile(code, "page", "exec"), scope)
    return said.getvalue()


@pytest.mark.full
@pytest.mark.parametrize("page", ["from-auto.md", "from-xppaut.md"])
def test_contin_prints_what_the_page_shows(page):
    found, scope = blocks(page), {}
    pairs = [(code, shown) for (language, _, code), (_, _, shown) in zip(found, found[1:]) if language == "python"]
    assert pairs
    for code, shown in pairs:
        said = run(code, scope)
        assert same(said, shown, CONTIN), said


@pytest.mark.full
@pytest.mark.skipif(
    not shutil.which("auto-07p") or not shutil.which("gfortran"), reason="needs AUTO-07p: apt-get install auto-07p gfortran"
)
def test_auto_prints_what_the_page_shows(tmp_path, monkeypatch):
    """The numbers of points and labels may differ with another compiler: they are left out. Its files are read as shown."""
    found = blocks("from-auto.md")
    texts = {title: text for _, title, text in found if title}
    for name in ("ab.f90", "c.ab", "ab.auto"):
        (tmp_path / name).write_text(texts[name])
    done = subprocess.run(["auto-07p", "ab.auto"], cwd=tmp_path, capture_output=True, text=True, timeout=300)

    def rows(text):
        return "\n".join(
            re.sub(r"^ +\d+ +\d+ +([A-Z]{2}) +\d+", r"\1", line)
            for line in text.splitlines()
            if re.match(r" +\d+ +\d+ +[A-Z]{2}", line)
        )

    assert same(rows(done.stdout), rows(texts["AUTO's output"]), AUTO), done.stdout
    scope = {}
    run(next(code for language, _, code in found if language == "python"), scope)
    monkeypatch.chdir(tmp_path)
    said = run(texts["in AUTO's folder"], scope)
    assert same(said, next(text for _, title, text in found if title == "its output"), AUTO), said


@pytest.mark.skipif(not shutil.which("xppaut"), reason="needs XPPAUT: apt-get install xppaut")
def test_xppaut_computes_what_the_page_says(tmp_path):
    """Its steps of 0.05 ms with a method of fourth order, and linear interpolation between them: 1e-4 ms."""
    (text,) = (text for _, title, text in blocks("from-xppaut.md") if title == "membrane.ode")
    (tmp_path / "membrane.ode").write_text(text)
    subprocess.run(["xppaut", "membrane.ode", "-silent"], cwd=tmp_path, capture_output=True, timeout=60, check=True)
    t, v = np.loadtxt(tmp_path / "output.dat", usecols=(0, 1)).T
    up = np.flatnonzero((v[:-1] < 0) & (v[1:] >= 0))
    crossings = t[up] - v[up] * (t[up + 1] - t[up]) / (v[up + 1] - v[up])
    assert np.abs(np.diff(crossings)[5:] - 91.177961328).max() < 2e-4
    assert abs(v[t > 1000].max() - 32.522541) < 1e-6 and abs(v[t > 1000].min() + 51.135803) < 1e-6
