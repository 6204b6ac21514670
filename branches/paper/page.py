"""One page, in Markdown and plain HTML without external resources, and what its pictures share."""

from __future__ import annotations

import html
import json
from dataclasses import asdict, dataclass, field
from pathlib import Path

from branches.store import interrupt
from branches.store.files import StoreError, write_bytes, write_picture
from contin.lowlevel import Colour

#: Colours of all pictures; they survive colour blindness and a grey printer.
STABLE, UNSTABLE, MODES, RIGID = Colour.BLUE, Colour.VERMILION, "#8a6d3b", Colour.BLACK
UNSTABLE_FILL = "#F3B48B"
#: Stable states that are buckled, beside stable circles.
BUCKLED = Colour.SKY


@dataclass(frozen=True)
class Row:
    """A published number beside ours.

    Attributes
    ----------
    what : str
    published : str
        As printed, '2.50'; text where the paper gives no number, '' where it gives nothing.
    ours : float or str
    remark : str
    measured : bool
        The published value is a measurement: no verdict on digits.
    """

    what: str
    published: str
    ours: float | str
    remark: str = ""
    measured: bool = False

    @property
    def difference(self) -> float | None:
        """Ours minus the published number, or None where one of them is not a number."""
        try:
            return float(self.ours) - float(self.published)
        except ValueError:
            return None

    @property
    def verdict(self) -> str:
        """'yes' if ours rounds to the printed digits (half a unit of the last one), 'no', or ''."""
        if self.difference is None or self.measured:
            return ""
        decimals = len(self.published.partition(".")[2])
        return "yes" if abs(self.difference) <= 0.5 * 10.0**-decimals * (1 + 1e-9) else "no"

    def cells(self) -> list[str]:
        """The texts of a line of the table."""
        ours = self.ours if isinstance(self.ours, str) else f"{self.ours:.6g}"
        difference = "" if self.difference is None else f"{self.difference:+.1e}"
        return [self.what, self.published, ours, difference, self.verdict, self.remark]


HEADER = ("quantity", "published", "ours", "difference", "to the printed digits", "remark")


@dataclass(frozen=True)
class Section:
    """What an item of `branches.paper` gives: a title, rows, names of pictures (without suffix, in the folder), remarks."""

    title: str
    rows: list[Row] = field(default_factory=list)
    pictures: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)


TITLE = "Audoly & Seffen (2015), number by number"
LEAD = (
    "Buckling of naturally curved elastic strips: the ribbon model makes a difference. J. Elasticity 119 (2015). "
    "The difference is ours minus the published number."
)


#: The sections of the page by item, for calls that add others.
STORED = "index.json"


def read(folder: Path) -> dict[str, Section]:
    """The sections that earlier calls put on the page of a folder, by item; raise StoreError where they cannot be read."""
    path = folder / STORED
    if not path.exists():
        return {}
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
        return {name: Section(**{**one, "rows": [Row(**row) for row in one["rows"]]}) for name, one in found.items()}
    except OSError as error:
        raise StoreError(f"cannot read {str(path)!r}: {error.strerror}") from error
    except (ValueError, TypeError, KeyError, AttributeError) as error:
        raise StoreError(f"cannot read {str(path)!r}: it was not written by this program; remove it") from error


def write(folder: Path, sections: dict[str, Section]) -> None:
    """Write index.md, index.html and what `read` reads. Raises StoreError if they cannot be written."""
    stored = {name: asdict(section) for name, section in sections.items()}
    with interrupt.held():  # all or none
        write_bytes(folder / STORED, json.dumps(stored, indent=1, default=float).encode())
        write_bytes(folder / "index.md", markdown([*sections.values()]).encode())
        write_bytes(folder / "index.html", page([*sections.values()]).encode())


def markdown(sections: list[Section]) -> str:
    """The page as Markdown."""
    lines = [f"# {TITLE}", "", LEAD, ""]
    for section in sections:
        lines += [f"## {section.title}", ""]
        if section.rows:
            lines += [_line(HEADER), _line(["---"] * len(HEADER)), *(_line(row.cells()) for row in section.rows), ""]
        for name in section.pictures:
            lines += [f"![{section.title}]({name}.png)", ""]
        lines += [f"- {note}" for note in section.notes] + [""] * bool(section.notes)
    return "\n".join(lines)


def _line(cells) -> str:
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


STYLE = (
    "body{font-family:sans-serif;max-width:70em;margin:2em auto;padding:0 1em;color:#111}"
    "table{border-collapse:collapse;margin:1em 0}td,th{border-bottom:1px solid #bbb;padding:.25em .8em;text-align:left}"
    "td:nth-child(2),td:nth-child(3),td:nth-child(4){text-align:right;font-variant-numeric:tabular-nums}img{max-width:100%}"
)


def page(sections: list[Section]) -> str:
    """The page as HTML: one file, and the pictures beside it."""
    text = html.escape
    body = [f"<h1>{text(TITLE)}</h1>", f"<p>{text(LEAD)}</p>"]
    for section in sections:
        body.append(f"<h2>{text(section.title)}</h2>")
        if section.rows:
            head = "".join(f"<th>{text(cell)}</th>" for cell in HEADER)
            lines = ["".join(f"<td>{text(cell)}</td>" for cell in row.cells()) for row in section.rows]
            body += ["<table>", f"<tr>{head}</tr>", *(f"<tr>{line}</tr>" for line in lines), "</table>"]
        for name in section.pictures:
            source = text(name, quote=True)
            body.append(f'<p><a href="{source}.svg"><img src="{source}.png" alt="{text(section.title, quote=True)}"></a></p>')
        if section.notes:
            body += ["<ul>", *(f"<li>{text(note)}</li>" for note in section.notes), "</ul>"]
    head = f'<meta charset="utf-8"><title>{text(TITLE)}</title><style>{STYLE}</style>'
    return f'<!DOCTYPE html>\n<html lang="en"><head>{head}</head><body>\n' + "\n".join(body) + "\n</body></html>\n"


def new_figure(wide: float, high: float):
    """Return an empty figure of no display, its size in inches."""
    from matplotlib.figure import Figure

    return Figure(figsize=(wide, high), layout="constrained")


def keep(figure, folder: Path, name: str) -> str:
    """Write a figure of no display as name.png and name.svg; the name. Raises `branches.store.files.StoreError`."""
    for suffix in (".png", ".svg"):
        write_picture(figure, folder / f"{name}{suffix}")
    return name
