"""``python -m branches.paper``: every published number within its printed digits, and nothing done that was not asked for."""

import pytest

from branches.paper import shell_run as shell
from branches.paper.__main__ import ITEMS, main, section_of
from branches.paper.page import Row
from ribbon_model import exact

#: Rows with a verdict of each item: all numbers that the paper prints.
NUMBERS = {
    "table1": 1,
    "table2": 8,
    "table3": 24,
    "fig6": 1,
    "fig9": 2,
    "fig10": 8,
    "fig11": 3,
    "fig12": 9,
    "fig12b": 0,
    "curves": 0,
    "fig7": 0,
    "finite-width": 0,
    "snaps": 0,
}


@pytest.fixture(scope="module")
def computed(tmp_path_factory):
    """Sections by name, each computed once, and the folder that they wrote to."""
    folder, sections = tmp_path_factory.mktemp("paper"), {}

    def section(name):
        if name not in sections:
            sections[name] = section_of(name, folder)
        return sections[name], folder

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(shell, "PROGRAM", "no-such-program")  # minutes of finite elements: test_shell has some that are short
        yield section


#: Items that take ten seconds or more each.
LONG = {"curves", "fig6", "fig7", "fig9", "fig10", "fig11", "fig12", "fig12b", "snaps", "finite-width"}


@pytest.mark.parametrize("name", [pytest.param(name, marks=pytest.mark.full) if name in LONG else name for name in ITEMS])
def test_every_published_number_within_its_printed_digits(name, computed):
    section, tmp_path = computed(name)
    verdicts = [row.verdict for row in section.rows]
    assert "no" not in verdicts
    assert verdicts.count("yes") == NUMBERS[name]
    for picture in section.pictures:
        assert all((tmp_path / f"{picture}{suffix}").stat().st_size > 10_000 for suffix in (".png", ".svg"))


@pytest.mark.full
def test_where_stable_buckled_states_exist(computed):
    """Ribbon: from the thresholds of (27) to the folds of the quadrature, and no others; one rod breaks the paper's rule."""
    rows = {row.what: row for row in computed("fig12b")[0].rows if "branch" in row.what}
    for m, n in ((1, 2), (3, 4)):
        ends = exact.bifurcation(m, n, 0.3), exact.folds(m, n, 0.3)[0].kappa_n
        assert rows[f"ribbon: branch ({m}, {n}) stable for κₙL/2π in"].ours == f"({ends[0]:.4f}, {ends[1]:.4f})"
    assert sum(what.startswith("ribbon") for what in rows) == 2
    assert [what for what, row in rows.items() if row.remark != "agrees"] == [
        "isotropic rod: branch (3, 1) stable for κₙL/2π in"
    ]


@pytest.mark.full
def test_where_folds_are_born(computed):
    """Two routes: the quadrature's slope at the circle, and the collocation's curve of folds, extrapolated."""
    rows = computed("curves")[0].rows
    births = [(float(row.ours), float(rows[i + 1].ours)) for i, row in enumerate(rows) if "exists for" in row.what]
    assert len(births) == 2
    assert all(by_quadrature == pytest.approx(by_collocation, abs=1e-6) for by_quadrature, by_collocation in births)
    at_03 = [row.ours for row in rows if row.what == "secondary bifurcation of (3, 1) at ν = 0.3: κₙL/2π ="]
    assert float(at_03[0]) == pytest.approx(-21.62681748742, abs=1e-8)  # the half loop's branch point


@pytest.mark.full
def test_where_the_fold_of_finite_width_is_born(computed):
    """4.45212, where the quadrature's slope dkappa_n/dA at the circle vanishes (extrapolated from A = .0004 and .0016)."""
    rows = {row.what: row.ours for row in computed("finite-width")[0].rows}
    assert float(rows["fold of (1, 2) exists for Γ above"]) == pytest.approx(4.45212, abs=2e-4)
    assert float(rows["fold of (1, 2) at Γ = 10: κₙL/2π ="]) == pytest.approx(3.97953925582077, abs=1e-9)


def test_verdicts_are_those_of_the_printed_digits():
    assert Row("", "4.08", 4.0751).verdict == "yes" and Row("", "4.08", 4.0749).verdict == "no"
    assert Row("", "10.", 10.4).verdict == "yes" and Row("", "10.", 10.6).verdict == "no"
    assert Row("", "3.50", 2.5, measured=True).verdict == "" and Row("", "none", 2.5).verdict == ""


@pytest.mark.full
def test_an_item_alone_loads_and_writes_what_it_needs(command):
    code = "import sys; from branches.paper.__main__ import main; assert main(['--out', 'x', 'table3']) == 0; "
    done = command(program=("-c", code + "assert not {'numba', 'matplotlib', 'h5py'} & set(sys.modules), sorted(sys.modules)"))
    assert done.returncode == 0, done.err
    assert sorted(path.name for path in (command.folder / "x").iterdir()) == ["index.html", "index.json", "index.md"]
    page = (command.folder / "x" / "index.md").read_text(encoding="utf-8")
    assert "| m = 1, n = 2 | 2.50 | 2.5 |" in page and "Fig." not in page


def test_another_item_keeps_those_that_are_there(tmp_path, capsys):
    assert main(["--out", str(tmp_path), "table3"]) == main(["--out", str(tmp_path), "table1"]) == 0
    page = (tmp_path / "index.md").read_text(encoding="utf-8")
    assert page.count("## ") == 2 and page.index("Table 1") < page.index("Table 3")
    assert "| m = 1, n = 2 | 2.50 | 2.5 |" in page and (tmp_path / "index.html").read_text().count("<h2>") == 2
    (tmp_path / "index.json").write_text("[]")
    assert main(["--out", str(tmp_path), "table1"]) == 2
    assert "was not written by this program; remove it" in capsys.readouterr().err


def test_what_is_refused(tmp_path, capsys):
    assert main(["--out", str(tmp_path), "fig13"]) == 2
    assert "there is no item 'fig13' (did you mean 'fig12'?); known are table1" in capsys.readouterr().err
    (tmp_path / "file").write_text("")
    assert main(["--out", str(tmp_path / "file"), "table3"]) == 2
    assert "must be a folder, and is a file" in capsys.readouterr().err
    assert main(["--out", str(tmp_path / "page.html"), "table3"]) == 2
    assert "must be a folder, as in 'page'" in capsys.readouterr().err
    assert (tmp_path / "file").read_text() == ""
