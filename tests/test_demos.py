"""scripts/demos.py: every demo of AUTO-07p has its line on the page, and small demos give AUTO's recorded values."""

import json
import sys
from pathlib import Path

import pytest

PROJECT = Path(__file__).parent.parent
sys.path.insert(0, str(PROJECT / "scripts"))

import demos as command  # noqa: E402
from side_by_side import auto_07p, compare, page  # noqa: E402
from side_by_side.all_demos import DEMOS  # noqa: E402

#: The folders of AUTO-07p's ``demos`` (commit 44cc1c42 of its repository, June 2025).
FOLDERS = [
    "ab", "abc", "abcb", "apbp", "brc", "brf", "bru", "bvp", "c2c", "chu", "cir", "cusp", "dd2", "enz", "exp", "ext",
    "ezp", "ffn", "fhh", "fhn", "fnb", "fnc", "frc", "fsh", "hen", "int", "ivp", "kar", "kdv", "kpr", "lcbp", "lin",
    "log", "lor", "lrz", "man", "mtn", "nag", "nep", "non", "obv", "ops", "opt", "p2c", "pcl", "pd1", "pd2", "pen",
    "ph1", "phs", "pla", "plp", "pp2", "pp3", "ppp", "pvl", "python", "r3b", "rev", "san", "she", "sib", "snh", "spb",
    "sspg", "stw", "tfc", "tim", "tor", "um2", "um3", "vhb", "wav",
]  # fmt: skip


def test_every_demo_has_its_line():
    assert sorted(demo.name for demo in DEMOS) == FOLDERS
    text = (PROJECT / "docs" / "auto.md").read_text(encoding="utf-8")
    for demo in DEMOS:
        assert (f"### {demo.name}\n" if demo.parts else f"| {demo.name} |") in text
        assert demo.parts or demo.note, f"{demo.name} is not compared, and no reason is given"


@pytest.mark.parametrize("name", ["apbp", "nep", "exp"])
def test_small_demos_give_autos_values(name):
    """AUTO's finer runs, of tolerances of 1e-11, have ten digits; each label of AUTO has its partner."""
    recorded = json.loads(command.RECORDED.read_text())[name]
    (demo,) = [demo for demo in DEMOS if demo.name == name]
    for part in demo.parts:
        rows = compare.rows(recorded["runs"], recorded["fine"], compare.of_contin(part.branches(), part, checked=True), part)
        assert rows
        for row in rows:
            assert row.auto and row.contin and row.fine, row
            assert compare.gap(row.contin, row.fine) < 2e-8, row
            assert compare.verdict(row) != "not decided", row


def test_what_is_right():
    def row(label="LP", **values):
        return compare.Row(label, **{name: [value] for name, value in values.items()})

    assert compare.verdict(row(auto=1.0, fine=1.0, contin=1.0 + 1e-12)) == "equal"
    assert compare.verdict(row(auto=1.0, fine=1.1, contin=1.1001)) == "contin: so AUTO, finer"
    assert compare.verdict(row(auto=1.0, fine=1.0001, contin=1.1)) == "AUTO: so AUTO, finer"
    assert compare.verdict(row(auto=1.0, fine=1.05, contin=1.1)) == "not decided"
    assert compare.verdict(row(auto=1.0, fine=1.0, contin=1.1)) == "not decided"  # AUTO ran the same twice
    assert compare.verdict(row(auto=1.0, contin=1.1, third=1.1)) == "contin: known"
    assert compare.verdict(row(auto=1.0, contin=1.1, third=1.01)) == "AUTO: known"
    assert compare.verdict(row(auto=1.0, fine=1.0)) == "AUTO only"
    assert compare.verdict(row(contin=1.0)) == "contin only"


def test_constants_and_branches_of_auto():
    constants = "NTST=  50, NCOL=   4, EPSL= 1e-07\nEPSU = 1e-07, EPSS = 1e-05\n"
    finer = auto_07p.finer(constants, 0)
    assert [auto_07p.constant(finer, key) for key in ("NTST", "EPSL", "EPSS", "ITMX")] == ["200", "1e-11", "1e-09", "20"]
    text = (
        "   0    PT  TY  LAB      lambda           MAX u\n"
        "   1     5   5    2   3.5138307190E+00   1.1868000000E+00\n"
        "   1     6   0    0   3.5000000000E+00   1.2000000000-100\n"
        "   1     7  -4    3   3.0000000000E+00   1.2000000000-100\n"
    )
    columns, points = auto_07p.parse(text)
    assert columns[:2] == ["lambda", "MAX u"]
    assert [(point["label"], point["values"]["lambda"], point["values"]["MAX u"]) for point in points] == [
        ("LP", 3.513830719, 1.1868), ("UZ", 3.0, 1.2e-100),
    ]  # fmt: skip


def test_a_page_is_written_between_its_marks(tmp_path):
    file = tmp_path / "page.md"
    file.write_text(f"before\n{page.BEGIN}\nstale numbers\n{page.END}\nafter\n")
    page.write(file, DEMOS, {}, {})
    text = file.read_text()
    assert text.startswith("before\n") and text.endswith("\nafter\n") and "stale numbers" not in text and "| ivp |" in text
