"""Everything the page shows, gathered from result files: branch files of strips, or branches that contin stored."""

from __future__ import annotations

from pathlib import Path

from branches import diagram_graph as diagram
from branches.explore import open_strips, profiles, strips
from branches.files import StoreError
from branches.names import DIAGRAM
from branches.read import read_branch

#: Ending of the files that `contin.save` writes.
STORED = ".npz"


def gather(results: list[str]) -> dict:
    """Everything the page needs, ready for JSON.

    Parameters
    ----------
    results : list of str
        Branch files, folders of diagrams, files of `contin.save`, or folders of those.

    Returns
    -------
    dict
        ``title``; ``kind``: 'strips', 'open' or 'branches'; ``axes``: columns of the map (name, title, short name), of which
        ``shown`` are drawn first; ``families``: dicts with ``name``, ``parameter``, ``branches`` and ``circles``.

    Raises
    ------
    StoreError
        One of them cannot be read, holds no branch, or is of the other kind.
    """
    files: dict[Path, None] = {}
    titles = []
    for result in results:
        found, title = _files_of(Path(result))
        files |= dict.fromkeys(path.resolve() for path in found)
        titles.append(title)
    stored = [path for path in files if path.suffix == STORED]
    if not stored:
        return _of_strips(list(files), titles)
    if other := next((path for path in files if path.suffix != STORED), None):
        raise StoreError(f"{str(other)!r} is of a strip, {str(stored[0])!r} is not; a page shows one kind of result")
    return profiles.gathered(stored)


def _of_strips(files: list[Path], titles: list[str]) -> dict:
    branches = [(path, read_branch(path)) for path in files]
    title = next((title or branch.config["title"] for title, (_, branch) in zip(titles, branches)), "")
    opened = [(path, branch) for path, branch in branches if "stages" in branch.config]
    if opened and len(opened) < len(branches):
        other = next(path for path, branch in branches if "stages" not in branch.config)
        raise StoreError(f"{str(other)!r} is of a closed strip, {str(opened[0][0])!r} is not; a page shows one kind of result")
    if opened:
        return open_strips.gathered(opened, title)
    families: dict[tuple, list] = {}
    for path, branch in branches:
        families.setdefault(strips.material(branch), []).append((path, branch))
    return {
        "title": title, "kind": "strips", "axes": strips.AXES, "shown": ["kappa_n", "kappa_star"],
        "families": [strips.family(families[material]) for material in sorted(families)],
    }  # fmt: skip


def _files_of(path: Path) -> tuple[list[Path], str]:
    """The branch files that a result stands for, and its title."""
    if path.suffix in (".yaml", ".yml"):
        raise StoreError(f"{str(path)!r} is a scene, not a result; compute it first: python -m branches.run {path}")
    if not path.is_dir():
        return [path], ""
    if not (path / DIAGRAM).exists() and (found := sorted(path.glob(f"*{STORED}"))):
        return found, ""
    graph = diagram.read(path)
    names = dict.fromkeys(data["file"] for _, _, data in graph.edges(data=True))
    if not names:
        raise StoreError(f"the diagram in {str(path)!r} holds no branch")
    return [path / name for name in names], graph.graph.get("title", "")
