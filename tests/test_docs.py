"""The code in docs/ runs as written, block after block: Python, and commands of this project (file-format.md: in test_store).

Left out: commands of other programs (a browser, apt), finite elements, which take many minutes, and what test_strip runs.
"""

import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

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


def _run(arguments):
    environment = {**os.environ, "PYTHONPATH": str(PROJECT)}
    done = subprocess.run([sys.executable, *arguments], capture_output=True, text=True, timeout=300, env=environment)
    assert done.returncode == 0, f"{shlex.join(arguments)}: {done.stderr}"
