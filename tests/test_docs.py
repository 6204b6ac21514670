"""The code in docs/ runs as written, block after block: Python, and commands of this project.

Left out: commands of other programs (a browser, apt), and what test_strip,
test_store (file-format.md) and test_other_programs (from-auto.md, from-xppaut.md) run.
"""

import importlib
import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import contin

PROJECT = Path(__file__).resolve().parent.parent
#: Pages that other tests run.
RUN_ELSEWHERE = {"file-format", "from-auto", "from-xppaut", "from-sbml", "large"}
PAGES = [
    page for page in sorted((PROJECT / "docs").glob("*.md")) if "```" in page.read_text() and page.stem not in RUN_ELSEWHERE
]
PROGRAM = ".venv/bin/python "
RIBBON = ".venv/bin/ribbon "
ELSEWHERE = re.compile(r"-m branches\.(shell|strip|paper .*fig7)")
#: Programs that have run as a process of their own, as users start them; from then on they are called.
started = set()


@pytest.fixture
def project(tmp_path, monkeypatch):
    """An empty folder that looks like the project's to commands."""
    if os.name != "posix":
        pytest.skip("needs POSIX: a folder of links; on Windows only some users may make them")
    for name in ("configs", "scripts", "docs"):
        (tmp_path / name).symlink_to(PROJECT / name)
    monkeypatch.chdir(tmp_path)


#: Pages that take ten seconds or more each, most of it compiling their problems.
LONG = {
    "architecture",
    "contin",
    "cycles",
    "equations",
    "explore",
    "finite-width",
    "how-to",
    "open-strips",
    "strips",
    "tutorial",
    "variational",
    "secondary",
}


@pytest.mark.parametrize(
    "page", [pytest.param(page, id=page.stem, marks=[pytest.mark.full] if page.stem in LONG else []) for page in PAGES]
)
def test_blocks_run(page, project):
    """Each page in a folder of its own, so none leans on what another one computes."""
    scope = {}
    for language, block in re.findall(r"^```(python|console)\n(.*?)^```", page.read_text(), re.M | re.S):
        if language == "python":
            exec(compile(block, str(page), "exec"), scope)
            continue
        for line in block.replace("\\\n", " ").replace(RIBBON, f"{PROGRAM}-m branches.").splitlines():
            if line.startswith(PROGRAM) and not ELSEWHERE.search(line):  # the others are what it prints
                _run(shlex.split(line.removeprefix(PROGRAM), comments=True))


@pytest.mark.filterwarnings("ignore::contin.errors.InterpretedWarning")
@pytest.mark.full
@pytest.mark.parametrize("finer", [False, True])
def test_the_page_of_finite_elements_runs(finer):
    """Its folds, beside a series for the cap; ``finer`` is one refinement more."""
    pytest.importorskip("skfem", reason="scikit-fem is not installed (pip install scikit-fem)")
    scope = python_of("large.md")
    assert 14 < (error_of_the_fold(scope, 8) / (scope["fold"]["lam"] - FOLD)) < 18
    coarse, series = np.array(scope["folds"])[:, 0], folds_by_ritz(5, scope["nu"])
    assert np.abs(coarse / series - 1).max() < 0.09
    if finer:
        fine = folds_of_a_cap(scope, 4)
        assert np.abs(fine / series - 1).max() < 0.04 and np.all(np.abs(fine - series) < 0.55 * np.abs(coarse - series))


def folds_of_a_cap(scope, refinements):
    problem, _ = scope["cap"](5, refinements)
    flat = contin.solve(problem, np.zeros(len(problem.states)))
    branch = contin.trace(flat, free=["load"], limits={"load": (0, 1)}, max_points=60, errors=False)
    return np.array([fold["load"] for fold in branch.labelled("LP")])


def folds_by_ritz(number, nu, count=10):
    """Loads at the folds of a clamped shallow cap in axial symmetry, from polynomials in the radius, without finite elements.

    The deflection at the centre is prescribed; the displacement along the radius is eliminated.
    """
    root = np.sqrt(3 * (1 - nu**2))
    rise = number**2 / (4 * root)
    x, weights = np.polynomial.legendre.leggauss(60)
    r = (x + 1) / 2
    weights = weights / 2 * r
    powers = [np.polynomial.Polynomial.basis(2 * i) for i in range(count)]
    rim = np.polynomial.Polynomial([1, 0, -1])
    w = [rim**2 * power for power in powers]
    u = [rim * power * np.polynomial.Polynomial([0, 1]) for power in powers]
    slope, bend = (np.array([one.deriv(order)(r) for one in w]) for order in (1, 2))
    hoop, radial = np.array([one(r) / r for one in u]), np.array([one.deriv()(r) for one in u])

    def form(one, other):
        mixed = (one * weights) @ other.T
        return (one * weights) @ one.T + (other * weights) @ other.T + nu * (mixed + mixed.T)

    bending, stretching, along = form(bend, slope / r) / 12, form(radial, hoop), radial + nu * hoop
    load = 8 * rise**2 * (1 - nu**2) / root * (np.array([one(r) for one in w]) @ weights)

    def balance(a):
        tilt = a @ slope
        strain, change = tilt**2 / 2 + 2 * rise * r * tilt, (tilt + 2 * rise * r) * slope
        b = -np.linalg.solve(stretching, along @ (weights * strain))
        force = strain + b @ along
        beside = (along * weights) @ change.T
        matrix = bending + (slope * weights * force) @ slope.T + (change * weights) @ change.T
        return bending @ a + change @ (weights * force), matrix - beside.T @ np.linalg.solve(stretching, beside)

    def load_at(centre, a, p):
        for _ in range(30):
            values, matrix = balance(a)
            unit = np.eye(count)[0]
            system = np.block([[matrix, -load[:, None]], [unit[None], np.zeros((1, 1))]])
            step = np.linalg.solve(system, -np.append(values - p * load, a[0] - centre))
            a, p = a + step[:-1], p + step[-1]
        return a, p

    places, a, p, found = np.arange(0.05, 2.2 * rise, 0.05), np.zeros(count), 0.0, []
    for place in places:
        a, p = load_at(place, a, p)
        found.append(p)
    found = np.array(found)
    turns = np.flatnonzero(np.diff(found)[1:] * np.diff(found)[:-1] < 0) + 1
    fits = [np.polynomial.Polynomial.fit(places[i - 3 : i + 4], found[i - 3 : i + 4], 6) for i in turns]
    centres = [min(fit.deriv().roots(), key=lambda root, i=i: abs(root - places[i])).real for fit, i in zip(fits, turns)]
    return np.array([fit(centre) for fit, centre in zip(fits, centres)])


def test_the_page_of_sbml_runs():
    pytest.importorskip("libsbml", reason="libSBML is not installed (pip install python-libsbml)")
    assert "evaluated in Python" not in python_of("from-sbml.md")["problem"].describe()


def python_of(page):
    """Run the Python of a page, and return its names."""
    scope = {}
    for block in re.findall(r"^```python\n(.*?)^```", (PROJECT / "docs" / page).read_text(encoding="utf-8"), re.M | re.S):
        exec(compile(block, page, "exec"), scope)
    return scope


#: Of Bratu's problem on a square.
FOLD = 6.80812442259


def error_of_the_fold(scope, side):
    """Error of the fold on a mesh of 2 side^2 triangles, of fourth order."""
    problem = scope["bratu"](side)
    start = contin.solve(problem, np.zeros(len(problem.states)))
    branch = contin.trace(start, free=["lam"], limits={"lam": (0, 7)}, max_points=14)
    return branch.labelled("LP")[0]["lam"] - FOLD


def _run(words):
    """Run a program: a script or a module's first run as a process, later runs of a module within this one."""
    count = 2 if words[0] == "-m" else 1  # words that name the program
    program, arguments = " ".join(words[:count]), words[count:]
    if program in started and count == 2:
        code, said = _main(words[1])(arguments), "see what it printed"
    else:
        started.add(program)
        environment = {**os.environ, "PYTHONPATH": str(PROJECT)}
        done = subprocess.run([sys.executable, *words], capture_output=True, text=True, timeout=300, env=environment)
        code, said = done.returncode, done.stderr
    assert code == 0, f"{shlex.join(words)}: {said}"


def _main(name):
    """The function behind ``-m package.module`` or ``-m package``."""
    module = importlib.import_module(name)
    return importlib.import_module(f"{name}.__main__").main if hasattr(module, "__path__") else module.main


def test_the_python_of_the_readme_runs(capsys):
    """Euler: the buckling loads of a hinged rod are n**2 pi**2."""
    (block,) = re.findall(r"^```python\n(.*?)^```", (PROJECT / "README.md").read_text(encoding="utf-8"), re.M | re.S)
    scope = {}
    exec(compile(block, "README.md", "exec"), scope)
    loads = [point["load"] / np.pi**2 for point in scope["straight"].labelled("BP")]
    assert loads == pytest.approx([1, 4], rel=1e-12) and scope["bent"].stop.reason == "limit"
    assert "EP" in capsys.readouterr().out


@pytest.mark.skipif(not (PROJECT / ".git").exists() or shutil.which("git") is None, reason="not a working copy")
def test_git_ignores_what_the_commands_of_the_pages_write():
    texts = [page.read_text(encoding="utf-8") for page in (PROJECT / "README.md", *PAGES)]
    names = {name for text in texts for name in re.findall(r"--(?:out|movie) ([\w./-]+)", text) if not name.isupper()}
    folders = {f"{name}/" for name in names if "." not in name}
    written = sorted(folders | {name for name in names if "." in name} | {"m1_n2.pdf", "site/"})
    done = subprocess.run(["git", "check-ignore", *written], cwd=PROJECT, capture_output=True, text=True)
    assert done.stdout.split() == written
