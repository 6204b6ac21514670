"""paper.md has what the Journal of Open Source Software asks for: sections, length, references, figures."""

import re
import runpy
from pathlib import Path

import yaml

PROJECT = Path(__file__).parent.parent
_, HEAD, TEXT = (PROJECT / "paper.md").read_text(encoding="utf-8").split("---\n", 2)
ENTRIES = (PROJECT / "paper.bib").read_text(encoding="utf-8")
FIGURES = re.findall(r"\]\((docs/images/[\w.-]+)\)", TEXT)


def test_sections_and_length():
    sections = re.findall(r"^# (.*)$", TEXT, re.M)
    assert sections[0] == "Summary" and sections[-1] == "References"
    wanted = {"Statement of need", "State of the field", "Software design", "Research impact statement", "AI usage disclosure"}
    assert wanted <= set(sections)
    assert 750 <= len(re.sub(r"!\[.*?\]\(.*?\)", "", TEXT).split()) <= 1750
    head = yaml.safe_load(HEAD)
    assert {"title", "tags", "authors", "affiliations", "date", "bibliography"} <= set(head) and "`" not in head["title"]


def test_every_reference_is_cited_and_every_citation_listed():
    keys = re.findall(r"^@\w+\{(\w+),", ENTRIES, re.M)
    assert len(keys) == len(set(keys)) and set(keys) == set(re.findall(r"@(\w+)", TEXT))
    assert ENTRIES.count("doi ") == len(re.findall(r"doi +?= \{10\.\d{4,}/[^{}\s]+\}", ENTRIES))


def test_figures_exist_and_one_command_makes_them():
    assert FIGURES and all((PROJECT / figure).is_file() for figure in FIGURES)
    commands = runpy.run_path(str(PROJECT / "scripts" / "paper_figures.py"))["commands"](Path("scratch"), Path("out"))
    drawers = (PROJECT / "scripts" / "benchmarks" / "report.py").read_text(encoding="utf-8")
    for figure in FIGURES:
        name = Path(figure).name
        assert any(name in word for words in commands for word in words) or name in drawers, name


def test_comparison_with_auto_is_that_of_the_page():
    """The row of sums in docs/auto.md: points, equal, contin closer, AUTO closer."""
    page = (PROJECT / "docs" / "auto.md").read_text(encoding="utf-8")
    points, equal, ours, theirs = re.search(r"^\|  \| all \| (\d+) \| (\d+) \| (\d+) \| (\d+) \|", page, re.M).groups()
    demos = len(re.findall(r"^\| \[\w+\]\(#\w+\) \|", page, re.M))
    text = " ".join(TEXT.split())
    assert f"On {demos} of AUTO's demonstrations, with {points} special points" in text
    assert f"agree to 1e-9 on {equal};" in text and f"for {ours} and of AUTO for {theirs}" in text
