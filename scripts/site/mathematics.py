"""A hook of mkdocs: mathematics between dollars becomes MathML when the site is built, and the site gets a font for it.

The browser typesets MathML itself: a page needs no script, and loads nothing from elsewhere.
"""

from __future__ import annotations

import html
import importlib.util
import re
from pathlib import Path
from typing import Any

from math_core import LatexError, LatexToMathML
from mkdocs.exceptions import PluginError
from mkdocs.structure.files import File

#: The package that brings the font STIX Two Math (Open Font License), and the file in it.
FONT = "ziamath", "fonts/STIXTwoMath-Regular.ttf"
#: What pymdownx.arithmatex makes of $…$ and $$…$$.
#: It takes punctuation along, so that no line begins with it.
FORMULA = re.compile(r'<(span|div) class="arithmatex">\\([(\[])(.*?)\\[)\]]</\1>([.,;:)]*)', re.S)

#: A prime beside a letter: fonts raise it already, so that a superscript would be raised twice, and too small.
PRIME = re.compile(r"<msup>(<mi>[^<]*</mi>)<mo>([′″])</mo></msup>")
CONVERTER = LatexToMathML()


def on_files(files: Any, config: Any) -> Any:
    """Add the font to the files of the site."""
    package, name = FONT
    found = importlib.util.find_spec(package)
    assert found is not None and found.origin is not None, f"{package} is in the extra docs"
    font = Path(found.origin).parent / name
    files.append(File.generated(config, "assets/mathematics.ttf", content=font.read_bytes()))
    return files


def on_page_content(page_html: str, page: Any, **_: Any) -> str:
    """Replace every formula of a page."""
    try:
        return FORMULA.sub(_mathml, page_html)
    except LatexError as error:
        raise PluginError(f"{page.file.src_uri}: a formula cannot be typeset: {error}") from error


def _mathml(found: re.Match[str]) -> str:
    """Return the MathML of one formula; a formula of its own line goes into a box that scrolls where it is too wide."""
    alone = found[2] == "["
    mathml = CONVERTER.convert_with_local_state(html.unescape(found[3]).strip(), displaystyle=alone)
    mathml = PRIME.sub(r'<mrow>\1<mo lspace="0" rspace="0">\2</mo></mrow>', mathml)
    if alone:
        return f'<div class="formula">{mathml}</div>'
    return f'<span class="nobreak">{mathml}{found[4]}</span>' if found[4] else mathml
