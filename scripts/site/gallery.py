"""A hook of mkdocs: every script of docs/gallery becomes a page with its text, its picture, its code, its output and its time.

    python scripts/site/gallery.py SCRIPT FOLDER    # run one script as the build of the site does

The docstring of a script is its text: a title, and a paragraph that begins with **Check:** and says where the number comes
from that the code asserts. The navigation in mkdocs.yml says to which field it belongs. Pictures are kept in .cache/gallery,
under a name that depends on the script and on the packages; the rest is made again.
"""

from __future__ import annotations

import ast
import contextlib
import hashlib
import io
import json
import logging
import os
import runpy
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

from contin.lowlevel import PALETTE

ROOT = Path(__file__).resolve().parents[2]
SCRIPTS, KEPT = ROOT / "docs" / "gallery", ROOT / ".cache" / "gallery"
STYLE = {
    "savefig.dpi": 150, "font.size": 10.5,
    "axes.prop_cycle": f"cycler('color', {[*map(str, PALETTE)]})", "axes.spines.top": False, "axes.spines.right": False,
    "axes.titlesize": 10.5, "lines.linewidth": 1.6, "legend.frameon": False,
}  # fmt: skip
#: What mkdocs shows while it builds.
LOG = logging.getLogger("mkdocs.hooks.gallery")
#: What stands in the overview where the thumbnails go.
PLACE = "<!-- thumbnails -->"


def run(script: Path, folder: Path) -> None:
    """Run a script, and write its picture, its output and its processor time, in seconds, into a folder."""
    import matplotlib

    matplotlib.use("Agg")
    matplotlib.rcParams.update(STYLE)
    from matplotlib import pyplot

    pyplot.show = lambda: None
    output = io.StringIO()
    with contextlib.redirect_stdout(output):
        runpy.run_path(str(script))
    pyplot.savefig(folder / "picture.png", metadata={"Software": None})
    (folder / "result.json").write_text(json.dumps({"output": output.getvalue(), "seconds": sum(os.times()[:4])}))


def result(name: str) -> Path:
    """Return the folder with what a script gave, which is made if the script or the packages have changed."""
    sources = [p for package in ("contin", "ribbon_model", "branches") for p in sorted((ROOT / package).rglob("*.py"))]
    script = SCRIPTS / f"{name}.py"
    key = hashlib.sha256(b"".join(path.read_bytes() for path in [Path(__file__), script, *sources])).hexdigest()[:16]
    folder = KEPT / f"{name}-{key}"
    if not (folder / "result.json").exists():
        folder.mkdir(parents=True, exist_ok=True)
        environment = {**os.environ, "PYTHONPATH": str(ROOT)}
        with tempfile.TemporaryDirectory() as elsewhere:  # where a script may write
            words = [sys.executable, __file__, str(script), str(folder)]
            done = subprocess.run(words, cwd=elsewhere, env=environment, capture_output=True, text=True)
        if done.returncode:
            from mkdocs.exceptions import PluginError

            raise PluginError(f"{script.relative_to(ROOT)} failed: {done.stderr.strip()}")
        LOG.info("ran %s", script.relative_to(ROOT))
    return folder


def fields(nav: list[Any]) -> dict[str, list[str]]:
    """Return the names of the scripts in each field of science, from the navigation of the site."""
    (gallery,) = [part["Gallery"] for part in nav if "Gallery" in part]
    return {field: [Path(page).stem for page in pages] for part in gallery[1:] for field, pages in part.items()}


def on_files(files: Any, config: Any) -> Any:
    """Add a page and a picture for every script, and the thumbnails to the overview."""
    from mkdocs.structure.files import File

    groups = fields(config.nav)
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        names = [name for group in groups.values() for name in group]
        LOG.info("gallery: scripts that have changed are run, %d in all", len(names))
        folders = dict(zip(names, pool.map(result, names)))
    for name, folder in folders.items():
        files.append(File.generated(config, f"gallery/{name}.md", content=page(name, folder)))
        files.append(File.generated(config, f"gallery/{name}.png", content=(folder / "picture.png").read_bytes()))
    overview = files.get_file_from_path("gallery/index.md")
    files.remove(overview)
    text = overview.content_string.replace(PLACE, "\n".join(f"## {field}\n\n{thumbnails(g)}\n" for field, g in groups.items()))
    files.append(File.generated(config, "gallery/index.md", content=text))
    return files


def parts(name: str) -> tuple[str, str, str]:
    """Return the title of a script, its text and its code."""
    source = (SCRIPTS / f"{name}.py").read_text(encoding="utf-8")
    tree = ast.parse(source)
    title, _, text = (ast.get_docstring(tree) or "").partition("\n")
    code = "\n".join(source.splitlines()[tree.body[0].end_lineno or 0 :]).strip()
    return title.removeprefix("# "), text.strip(), code


def page(name: str, folder: Path) -> str:
    """Return the page of a script, in Markdown."""
    title, text, code = parts(name)
    found = json.loads((folder / "result.json").read_text())
    return (
        f"# {title}\n\n{text}\n\n![{title}]({name}.png)\n\n```python\n{code}\n```\n\n"
        f"It prints\n\n```text\n{found['output'].strip()}\n```\n\n"
        f"When this page was built, the script took {found['seconds']:.1f} s of processor time, with the start of Python and "
        f"the compilation of kernels that had not been compiled before. [The script as a file]({name}.py)\n"
    )


def thumbnails(names: list[str]) -> str:
    """Return links with pictures, in HTML."""
    links = []
    for name in names:
        title, _, subtitle = parts(name)[0].partition(": ")
        links.append(f'<a href="{name}.html"><img src="{name}.png" alt=""><strong>{title}</strong><span>{subtitle}</span></a>')
    return f'<div class="thumbnails">{"".join(links)}</div>'


if __name__ == "__main__":
    run(Path(sys.argv[1]), Path(sys.argv[2]))
