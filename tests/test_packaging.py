"""The two distributions: what they declare is what the packages import, and one version stands in one place."""

import ast
import doctest
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
import yaml

import contin

ROOT = Path(__file__).resolve().parent.parent
BOTH, ALONE = (tomllib.loads((ROOT / path / "pyproject.toml").read_text(encoding="utf-8")) for path in ("", "packages/contin"))
#: Distributions whose modules have another name.
MODULES = {"lazy-loader": "lazy_loader", "PyYAML": "yaml"}
#: llvmlite comes with numba, which allows one version of it, and PIL with matplotlib; films say that they need ffmpeg.
NOT_DECLARED = {"llvmlite", "PIL", "imageio_ffmpeg"}


def names(requirements):
    """The bounds of requirements, by the module that they bring."""
    pairs = (re.match(r"([\w-]+)(?:\[\w+\])?(.*)", requirement).groups() for requirement in requirements)
    return {MODULES.get(name, name): bounds for name, bounds in pairs}


def imported(*packages):
    """The libraries that packages import anywhere, inside functions too."""
    found = set()
    for file in (file for package in packages for file in (ROOT / package).rglob("*.py")):
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                found |= {alias.name.partition(".")[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom) and not node.level:
                found.add(node.module.partition(".")[0])
    return found - set(sys.stdlib_module_names) - {"contin", "ribbon_model", "branches"} - NOT_DECLARED


@pytest.mark.full
def test_contin_declares_what_it_imports_and_nothing_else():
    extras = [requirement for extra in ALONE["project"]["optional-dependencies"].values() for requirement in extra]
    assert imported("contin") == {*names(ALONE["project"]["dependencies"]), *names(extras)}


@pytest.mark.full
def test_the_main_distribution_declares_what_it_imports():
    project = BOTH["project"]
    optional = names(sum(project["optional-dependencies"].values(), []))
    assert not imported("contin", "ribbon_model", "branches") - {*names(project["dependencies"]), *optional}
    assert not set(names(project["dependencies"])) - imported("contin", "ribbon_model", "branches")


def test_both_have_the_same_bounds():
    both = names([*BOTH["project"]["dependencies"], *BOTH["project"]["optional-dependencies"]["test"]])
    extras = sum(ALONE["project"]["optional-dependencies"].values(), [])
    alone = names([*ALONE["project"]["dependencies"], *extras])
    assert alone == {name: both[name] for name in alone}
    for field in ("requires-python", "license", "dynamic"):
        assert BOTH["project"][field] == ALONE["project"][field]
    assert BOTH["tool"]["setuptools"]["dynamic"] == ALONE["tool"]["setuptools"]["dynamic"]


def test_the_conda_recipe_has_the_same_bounds():
    recipe = yaml.safe_load((ROOT / "packaging/conda/recipe.yaml").read_text(encoding="utf-8"))
    assert recipe["context"]["version"] == contin.__version__
    pairs = {"contin": ALONE, "ribbon-continuation": BOTH}
    for output in recipe["outputs"]:
        bounds = dict(line.lower().split() for line in output["requirements"]["run"] if not line.startswith("python "))
        bounds = {name.removesuffix("-base"): bound for name, bound in bounds.items()}
        project = pairs[output["package"]["name"]]["project"]
        assert bounds == dict(re.match(r"([\w-]+)(.*)", line.lower()).groups() for line in project["dependencies"])


@pytest.mark.full
def test_the_example_of_the_distribution_contin_runs():
    assert doctest.testfile(str(ROOT / "packages/contin/README.md"), module_relative=False).failed == 0


def test_both_list_all_folders_of_code():
    folders = {
        p.parent.relative_to(ROOT) for name in ("contin", "ribbon_model", "branches") for p in (ROOT / name).rglob("*.py")
    }
    found = {".".join(folder.parts) for folder in folders}
    assert found | {"branches.configs"} == set(BOTH["tool"]["setuptools"]["packages"])  # the scenes, a folder without code
    assert {name for name in found if name.startswith("contin")} == set(ALONE["tool"]["setuptools"]["packages"])


def test_the_version_stands_in_one_place():
    assert re.fullmatch(r"\d+\.\d+\.\d+", contin.__version__)
    assert BOTH["tool"]["setuptools"]["dynamic"]["version"] == {"attr": "contin.__version__"}
    assert f"version = {{{contin.__version__}}}" in (ROOT / "README.md").read_text(encoding="utf-8")
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    changes = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    newest = re.search(r"^## \[([\d.]+)\] - (\S+)$", changes, re.M).groups()
    assert (citation["version"], citation["date-released"]) == newest and newest[0] == contin.__version__


MISSING = {
    "matplotlib": "branch.plot()",
    "pandas": "branch.to_pandas()",
    "networkx": "contin.Diagram([branch], []).graph()",
}


@pytest.mark.sample(1)
@pytest.mark.parametrize(("library", "call"), MISSING.items())
def test_a_missing_library_is_named_with_what_to_do(library, call, monkeypatch):
    line = contin.AlgebraicProblem(lambda u, p: (u.x - p.p,), ["x"], {"p": 1.0})
    branch = contin.trace(contin.solve(line, [1.0]), free=["p"], limits={"p": (0, 2)})
    monkeypatch.setitem(sys.modules, library, None)
    with pytest.raises(ImportError, match=rf"needs {library}, which is not installed: pip install {library}$"):
        eval(call, {"contin": contin, "branch": branch})
    assert "<table>" in branch._repr_html_()  # without a picture where matplotlib is missing


@pytest.mark.full
def test_import_loads_nothing_that_is_optional():
    code = "import sys, contin; contin.trace; print(sorted({'matplotlib', 'pandas', 'networkx'} & set(sys.modules)))"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT).stdout == "[]\n"
