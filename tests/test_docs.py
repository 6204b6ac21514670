"""The code in docs/ runs as written, block after block: Python, and commands of this project (file-format.md: in test_store).

Left out: commands of other programs (a browser, apt), finite elements, which take many minutes, and what test_strip runs.
"""

import html
import importlib.util
import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

import contin

PROJECT = Path(__file__).resolve().parent.parent
PAGES = [page for page in sorted((PROJECT / "docs").glob("*.md")) if "```" in page.read_text() and page.stem != "file-format"]
PROGRAM = ".venv/bin/python "
ELSEWHERE = re.compile(r"-m branches\.(shell|strip|paper .*fig7)")


@pytest.fixture
def project(tmp_path, monkeypatch):
    """An empty folder that looks like the project's to commands."""
    for name in ("configs", "scripts", "docs"):
        (tmp_path / name).symlink_to(PROJECT / name)
    monkeypatch.chdir(tmp_path)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_blocks_run(page, project):
    scope = {}
    for language, block in re.findall(r"^```(python|console)\n(.*?)^```", page.read_text(), re.M | re.S):
        if language == "python":
            exec(compile(block, str(page), "exec"), scope)
            continue
        for line in block.replace("\\\n", " ").splitlines():
            if line.startswith(PROGRAM) and not ELSEWHERE.search(line):  # the others are what it prints
                _run(shlex.split(line.removeprefix(PROGRAM), comments=True))


def test_architecture_names_what_there_is():
    page, package = (PROJECT / "docs" / "architecture.md").read_text(), PROJECT / "contin"
    named = set(re.findall(r"[\w/]+\.pyi?\b", page))
    assert not [name for name in named if not (PROJECT / name).exists() and not (package / name).exists()]
    files = {str(file.relative_to(package)) for file in package.rglob("*.py")}
    assert not [name for name in files - named if not name.endswith("__init__.py")], "missing in the table"
    steps = re.findall(r" ([\w/]+\.py): ([\w.]+)$", page, re.M)
    assert len(steps) > 20
    for file, name in steps:
        for part in name.split("."):
            assert re.search(rf"^ *(def|class) {part}\b", (package / file).read_text(), re.M), (file, name)


def test_reference_lists_all_public_names():
    listed = re.findall(r"^::: contin\.(\w+)$", (PROJECT / "docs" / "reference.md").read_text(), re.M)
    assert sorted([*listed, "Monitor"]) == sorted(contin.__all__)  # the first name of TestFunction: mkdocstrings shows none


def test_picture_of_the_rooms_is_true():
    spec = importlib.util.spec_from_file_location("draw_rooms", PROJECT / "scripts" / "draw_rooms.py")
    rooms = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(rooms)
    picture = (PROJECT / "docs" / "images" / "rooms.svg").read_text()
    drawn = html.unescape(re.search("<dc:description>(.*)</dc:description>", picture)[1]).split("; ")
    assert drawn == rooms.edges(rooms.imports()[0]), "run: python scripts/draw_rooms.py"


def _run(arguments):
    environment = {**os.environ, "PYTHONPATH": str(PROJECT)}
    done = subprocess.run([sys.executable, *arguments], capture_output=True, text=True, timeout=300, env=environment)
    assert done.returncode == 0, f"{shlex.join(arguments)}: {done.stderr}"
