"""A hook of mkdocs: docs/architecture.md gets tables of all modules, each with the first line of its docstring.

    python scripts/site/modules.py contin    # print the table of a package: contin, ribbon_model or branches

Rooms are in the order of the contracts in pyproject.toml, from the bottom to the top; their files are in alphabetical order.
"""

from __future__ import annotations

import ast
import re
import sys
import tomllib
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
#: The place of a table in the page, with the name of its package.
PLACE = re.compile(r"<!-- modules: (\w+) -->")
#: The name of the modules beside the rooms of a package.
BESIDE = "beside the rooms"


def rooms(package: str) -> list[str]:
    """Return the folders of a package, in the order of its contract from the bottom to the top; none for a package without."""
    contracts = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["importlinter"]["contracts"]
    rows = next((contract["layers"] for contract in contracts if contract.get("containers") == [package]), [])
    names = [name.strip() for row in reversed(rows) for name in re.split("[|:]", row)]
    return [name for name in names if (ROOT / package / name).is_dir()]


def purpose(file: Path) -> str:
    """Return the first line of a module's docstring, '' if it has none, with code as in Markdown."""
    said = ast.get_docstring(ast.parse(file.read_text(encoding="utf-8"))) or ""
    return said.partition("\n\n")[0].replace("\n", " ").replace("``", "`").replace("|", "\\|")


def table(package: str) -> str:
    """Return the modules of a package as a Markdown table."""
    folder, by_room = ROOT / package, dict[str, list[Path]]()
    for file in sorted(folder.rglob("*.py")):
        inside = file.relative_to(folder).parts
        by_room.setdefault(inside[0] if len(inside) > 1 else BESIDE, []).append(file)
    lines = [f"| `{package}` | Purpose |", "|---|---|"]
    order = [room for room in rooms(package) if room in by_room]
    for room in [*order, BESIDE] if package != "contin" else [BESIDE, *order]:
        lines += [f"| **{room}** | |"] if order else []
        lines += [f"| `{file.relative_to(folder).as_posix()}` | {said} |" for file in by_room[room] if (said := purpose(file))]
    return "\n".join(lines)


def on_page_markdown(markdown: str, **_: Any) -> str:
    """Put the tables in their places."""
    return PLACE.sub(lambda found: table(found[1]), markdown)


if __name__ == "__main__":
    print(table(sys.argv[1]))
