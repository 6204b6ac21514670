"""docs/architecture.md and docs/reference.md name what there is; the picture of the rooms shows the imports that there are."""

import html
import re
import runpy
import types
from pathlib import Path

import pytest

import contin
import ribbon_model

PROJECT = Path(__file__).resolve().parent.parent
DOCS, PACKAGE = PROJECT / "docs", PROJECT / "contin"
PAGE = (DOCS / "architecture.md").read_text()
NAMED = set(re.findall(r"(?:\.ci/)?[\w/]+\.pyi?\b", PAGE))
#: Steps of the run: a file and what is defined in it.
STEPS = re.findall(r" ([\w/]+\.py): ([\w.]+)$", PAGE, re.M)


def test_every_file_that_the_page_names_exists():
    assert not [name for name in NAMED if not (PROJECT / name).exists() and not (PACKAGE / name).exists()]


def test_every_file_of_the_engine_is_in_the_table():
    listed = {
        name
        for row in re.findall(r"^\| (`[\w/]+\.py`(?:, `[\w/]+\.py`)*) \|", PAGE, re.M)
        for name in re.findall(r"[\w/]+\.py", row)
    }
    files = {file.relative_to(PACKAGE).as_posix() for file in PACKAGE.rglob("*.py") if file.name != "__init__.py"}
    assert files == listed


def test_every_kernel_is_in_the_table():
    listed = sorted(re.findall(r"^\| `(\w+)` \| `([\w/]+\.py)` \|", PAGE, re.M))
    files = [file for file in PACKAGE.rglob("*.py") if file.name != "kernel.py"]  # its docstring has an example
    kernels = [
        (name, file.relative_to(PACKAGE).as_posix())
        for file in files
        for name in re.findall(r"^@kernel(?:\(.*\))?\ndef (\w+)", file.read_text(), re.M)
    ]
    assert sorted(kernels) == listed


@pytest.mark.parametrize("file, name", STEPS)
def test_every_step_is_where_the_page_says(file, name):
    text = (PACKAGE / file).read_text()
    for part in name.split("."):
        assert re.search(rf"^ *(def|class) {part}\b", text, re.M)


def test_there_are_steps():
    assert len(STEPS) > 20


def test_the_picture_is_true():
    rooms = runpy.run_path(str(PROJECT / "scripts" / "draw_rooms.py"))
    picture = (DOCS / "images" / "rooms.svg").read_text()
    drawn = html.unescape(re.search("<dc:description>(.*)</dc:description>", picture)[1]).split("; ")
    assert drawn == rooms["edges"](rooms["imports"]()[0]), "run: python scripts/draw_rooms.py"


def test_the_reference_lists_all_public_names():
    listed = re.findall(r"^::: contin\.([\w.]+)$", (DOCS / "reference.md").read_text(), re.M)
    modules = [name for name in contin.__all__ if isinstance(getattr(contin, name), types.ModuleType)]
    inside = [f"{module}.{name}" for module in modules for name in getattr(contin, module).__all__]
    assert sorted(listed) == sorted([*(set(contin.__all__) - set(modules)), *inside])


def test_the_reference_lists_all_names_of_the_mechanics():
    """Modules, classes and functions by their page, or that of their module; constants, which have no docstring, in a table."""
    text = (DOCS / "reference.md").read_text()
    pages = set(re.findall(r"^::: (ribbon_model\.[\w.]+)$", text, re.M))
    for name in ribbon_model.__all__:
        found = getattr(ribbon_model, name)
        if isinstance(found, types.ModuleType):
            assert found.__name__ in pages, name
        elif isinstance(found, type | types.FunctionType):
            assert {found.__module__, f"{found.__module__}.{name}"} & pages, name
        else:
            assert f"| `{name}` | " in text, name
