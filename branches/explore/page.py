"""One self-contained page: the template, the library that draws, and the data, in one text."""

from __future__ import annotations

import base64
import html
import json
from importlib import resources

#: The library that draws: plotly.js 4.1.1, the part that its publisher builds for lines and for surfaces in space (from the npm
#: package plotly.js-gl3d-dist-min, packed by ``gzip -9n``). All of plotly.js is three times as large.
_LIBRARY = "plotly-gl3d.min.js.gz"
#: Its licence, which goes with it.
_LICENCE = "plotly-LICENSE.txt"

#: The page's own programs, in the order in which they build on each other.
SCRIPTS = (
    "shapes.js", "surface.js", "branch.js", "state.js", "lines.js", "exact.js", "follow.js", "exact_width.js", "diagram.js",
    "overlay.js", "strip.js", "profile.js", "snap.js", "readout.js", "export.js", "link.js", "page.js",
)  # fmt: skip
#: Words that depend on the kind of result.
WORDS = {
    "strips": {
        "hue": "wavenumber",
        "state": "The strip in space; drag it or use the arrow keys to turn it, scroll or press plus to zoom",
    },
    "branches": {"hue": "branch", "state": "The states at the chosen point"},
}
WORDS["open"] = {"hue": "stage", "state": WORDS["strips"]["state"]}
#: Width of closed strips in percent of their length, at first; of open strips, the page's data has it.
_WIDTH = 3.0
#: Classes of the page, by which parts of it are hidden.
CLASSES = {"strips": "strips", "branches": "branches", "open": "branches of-open"}


def assemble(data: dict) -> str:
    """The page that shows ``data``, as of `gather.gather`."""
    folder = resources.files(__package__)
    template, style, *scripts = ((folder / name).read_text(encoding="utf-8") for name in ("page.html", "page.css", *SCRIPTS))
    licence = (folder / _LICENCE).read_text(encoding="utf-8")
    laws = ", ".join(dict.fromkeys(family.get("law", "") for family in data["families"]))
    parts = {
        "title": html.escape(data["title"] or f"Equilibria of a closed strip: {laws}"), "style": style,
        "library": base64.b64encode((folder / _LIBRARY).read_bytes()).decode(),
        "licence": html.escape(licence).replace("--", "- -"), "program": "\n".join(scripts),
        "data": json.dumps(data, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c"),
    }  # fmt: skip
    parts |= {"kind": CLASSES[data["kind"]], "width": f"{data.get('width', _WIDTH):g}"} | WORDS[data["kind"]]
    pieces = template.split("{{")
    filled = [pieces[0]]
    for piece in pieces[1:]:
        name, rest = piece.split("}}", 1)
        filled += [parts[name], rest]
    return "".join(filled)
