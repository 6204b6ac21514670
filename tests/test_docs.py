"""The code in docs/ runs as written, block after block (that of file-format.md in tests/branches/test_store.py)."""

import re
from pathlib import Path

import pytest

DOCS = sorted((Path(__file__).resolve().parent.parent / "docs").glob("*.md"))


@pytest.mark.parametrize(
    "page",
    [page for page in DOCS if "```python" in page.read_text() and page.stem != "file-format"],
    ids=lambda page: page.stem,
)
def test_blocks_run(page, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    scope = {}
    for block in re.findall(r"^```python\n(.*?)^```", page.read_text(), re.M | re.S):
        exec(compile(block, str(page), "exec"), scope)
