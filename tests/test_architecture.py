"""Pages and docstrings name what there is, and count it; the picture of the rooms shows the imports that there are."""

import html
import importlib
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


@pytest.mark.full
@pytest.mark.parametrize("package", ["contin", "ribbon_model", "branches"])
def test_every_module_is_in_a_table_with_its_purpose(package):
    modules = runpy.run_path(str(PROJECT / "scripts" / "site" / "modules.py"))
    assert f"<!-- modules: {package} -->" in PAGE
    table = modules["on_page_markdown"](f"<!-- modules: {package} -->")
    listed = re.findall(r"^\| `([\w/]+\.py)` \| \S", table, re.M)
    files = [file.relative_to(PROJECT / package).as_posix() for file in (PROJECT / package).rglob("*.py")]
    assert sorted(set(listed)) == sorted(listed)
    assert {file for file in files if not file.endswith("__init__.py")} <= set(listed) <= set(files)


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


@pytest.mark.full
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


def said() -> dict[str, str]:
    """Return the text of each page and of each module, by file."""
    files = [file for package in ("contin", "ribbon_model", "branches") for file in sorted((PROJECT / package).rglob("*.py"))]
    files += [*sorted(DOCS.glob("*.md")), *(PROJECT / name for name in ("README.md", "CONTRIBUTING.md", ".github/review.md"))]
    return {str(file.relative_to(PROJECT)): file.read_text(encoding="utf-8") for file in files}


def exists(name: str) -> bool:
    """Return whether a dotted name is a module, or what is in one."""
    found, *parts = name.split(".")
    try:
        thing = importlib.import_module(found)
        for part in parts:
            found += f".{part}"
            if hasattr(thing, part):
                thing = getattr(thing, part)
            elif part not in getattr(thing, "__annotations__", ()):  # a field without a value
                thing = importlib.import_module(found)
    except ImportError:
        return False
    return True


@pytest.mark.filterwarnings("ignore::DeprecationWarning")  # former names
def test_every_dotted_name_exists():
    """In pages, docstrings and comments; the page on version 0.3 names what there was."""
    dotted = re.compile(r"(?<![\w/.])((?:contin|ribbon_model|branches)(?:\.(?!md\b|h5\b|COMMAND)\w+)+)")
    names = {name: file for file, text in said().items() if file != "docs/upgrade.md" for name in dotted.findall(text)}
    assert {name: file for name, file in names.items() if not exists(name)} == {}


def rows(page: str) -> int:
    """Return the number of numbered rows of the tables of a page."""
    return len(re.findall(r"^\| \d+ \|", (DOCS / page).read_text(encoding="utf-8"), re.M))


#: Numbers in words on pages: the text, with the number as {}, and what it counts.
COUNTS = [
    ("index.md", "{} problems from five fields", len(list((DOCS / "gallery").glob("*.py")))),
    ("gallery/index.md", "{} problems, one page each", len(list((DOCS / "gallery").glob("*.py")))),
    ("../.github/review.md", "{} problems; [real strips]", len(list((DOCS / "gallery").glob("*.py")))),
    ("outside.md", "# {} problems of newcomers", rows("outside.md")),
    ("outside.md", "# {} demos of other tools", rows("outside.md") - 30),
    ("contin.md", "[{} problems as newcomers wrote them](outside.md)", rows("outside.md")),
    ("../.github/review.md", "[{} problems](../docs/outside.md)", rows("outside.md")),
    ("reference.md", "has the {} names that people need", len(ribbon_model.__all__)),
    (
        "networks.md",
        "all {} scenes of rods",
        sum("law: rod" in file.read_text() for file in PROJECT.glob("configs/network_*.yaml")),
    ),
]
WORDS = {11: "eleven", 17: "seventeen", 20: "twenty", 21: "twenty-one", 30: "thirty", 50: "fifty"}


@pytest.mark.parametrize(("page", "text", "count"), COUNTS)
def test_a_number_in_words_is_what_it_counts(page, text, count):
    assert text.format(WORDS.get(count, count)).lower() in (DOCS / page).read_text(encoding="utf-8").lower().replace("\n", " ")
