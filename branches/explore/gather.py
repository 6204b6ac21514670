"""Everything the page shows, gathered from result files: branch files of strips, or branches that contin stored."""

from __future__ import annotations

import math
from functools import partial
from pathlib import Path

from branches.explore import profiles, strips
from branches.graph.stored import DIAGRAM, read_any
from branches.run.display import Progress
from branches.run.executor import executor, run_jobs
from branches.store.files import StoreError
from branches.store.layout import CLOSED
from branches.store.measured import read_points
from branches.store.read import read_branch

#: Ending of the files that `contin.save` writes.
STORED = ".npz"
#: Files that are read without starting processes, which takes as long as reading so many.
_ALONE = 8
#: Pages of at most so many files hold what takes seconds: four ways down from a fold take two, an exact solution up to seven.
_SLOW = 100
#: Largest size of the texts of columns and shapes on a page. With the library that draws (4.9 MB) and names it makes 30 MB.
_MOST_BYTES = 22_500_000


def gather(results: list[str], quiet: bool = True) -> dict:
    """Return everything the page needs, ready for JSON; unless ``quiet``, a line of progress is shown.

    Results are branch files, folders of diagrams, files of `contin.save`, or folders of those. Raises StoreError where one of
    them cannot be read, holds no branch, or is of the other kind.

    Returns
    -------
    dict
        ``title``; ``kind``: 'strips', 'open' or 'branches'; ``axes``: columns of the map (name, title, short name), of which
        ``shown`` are drawn first; ``families``: dicts with ``name``, ``parameter``, ``branches`` and ``circles``.
    """
    files: dict[Path, Path] = {}
    titles = []
    for result in results:
        found, title = _files_of(Path(result))
        files |= {path.resolve(): path for path in found if path.resolve() not in files}
        titles.append(title)
    stored = [path for path in files.values() if path.suffix == STORED]
    if not stored:
        with Progress("branches", len(files), quiet) as progress:
            return _of_strips(list(files.values()), titles, progress, slow=len(files) <= _SLOW)
    if other := next((path for path in files.values() if path.suffix != STORED), None):
        raise StoreError(f"{str(other)!r} is of a strip, {str(stored[0])!r} is not; a page shows one kind of result")
    return profiles.gathered(stored)


def measured(path: str, axes: list) -> dict[str, list]:
    """Return the measured points of a file by columns of a map, whose ``axes`` are (name, title, brief).

    Raises StoreError as `branches.store.measured.read_points` does, and where two columns are missing.
    """
    units = {name: brief.partition(" [")[2].rstrip("]") if brief.startswith(name) else "" for name, _, brief, *_ in axes}
    found = read_points(path, units)
    if len([name for name in found if name in units]) < 2:
        raise StoreError(f"--points {path!r}: must hold two columns of the map, of {', '.join(units)}")
    return {name: [None if math.isnan(value) else value for value in values] for name, values in found.items()}


def left_out(data: dict) -> list[dict]:
    """Return the branches of a page whose shapes are not on it; ``path`` is the file of each."""
    return [branch for family in data["families"] for branch in family["branches"] if not branch["shapes"]]


def _of_strips(files: list[Path], titles: list[str], progress: Progress, slow: bool) -> dict:
    """Return the data of a page of strips, of the kind of the first one."""
    if read_branch(files[0]).scene.KIND != CLOSED:
        return strips.stages_gathered(files, next(filter(None, titles), ""), slow)
    branches = _read(files, progress)
    title = next((title or branch["title"] for title, branch in zip(titles, branches)), "")
    families: dict[tuple, list[dict]] = {}
    for branch, path in zip(branches, files):
        families.setdefault(branch["family"], []).append(branch | {"path": str(path)})
    _leave_out(families)
    axes = [axis for axis in branches[0]["axes"] if all(axis in branch["axes"] for branch in branches)]  # of all versions
    return {
        "title": title, "kind": "strips", "axes": axes, "shown": ["kappa_n", "kappa_star"],
        "families": [strips.family_of(families[material]) for material in sorted(families)],
    }  # fmt: skip


def _read(files: list[Path], progress: Progress) -> list[dict]:
    """Return what the page holds of the files, in their order; many files are read by several processes."""
    found: dict[Path, dict] = {}
    read = partial(strips.branch_of, slow=len(files) <= _SLOW)
    few = files[:1] if len(files) > _ALONE else files  # the first one loads compiled code, before processes are forked
    for path in few:
        found[path] = read(path)
        progress.part_done()
    if len(few) < len(files):
        rest = iter(files[1:])
        with executor() as (submit, wait, count):
            for path, branch in run_jobs(lambda running: next(rest, None), read, submit, count, wait):
                if isinstance(branch, BaseException):
                    raise branch
                found[path] = branch
                progress.part_done()
    return [found[path] for path in files]


def _leave_out(families: dict[tuple, list[dict]]) -> None:
    """Remove the shapes of some families if all together would make the page too large; those that stay are spread evenly."""
    branches = [branch for one in families.values() for branch in one]
    texts = ([text for one in branches for text in one[name].values() if type(text) is str] for name in ("columns", "shapes"))
    columns, shapes = (sum(map(len, each)) for each in texts)
    part = min(1.0, max(_MOST_BYTES - columns, 0) / shapes)
    for number, material in enumerate(sorted(families)):
        if math.ceil((number + 1) * part) == math.ceil(number * part):
            for branch in families[material]:
                branch["shapes"] = None


def _files_of(path: Path) -> tuple[list[Path], str]:
    """The branch files that a result stands for, and its title."""
    if not path.is_dir():
        return [path], ""
    if not (path / DIAGRAM).exists() and (found := sorted(path.glob(f"*{STORED}"))):
        return found, ""
    graph = read_any(path)
    names = dict.fromkeys(data["file"] for _, _, data in graph.edges(data=True))
    if not names:
        raise StoreError(f"the diagram in {str(path)!r} holds no branch")
    return [path / name for name in names], graph.graph.get("title", "")
