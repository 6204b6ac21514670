"""The parsing and choosing in scripts/benchmarks: what turns the peers' output into numbers. Nothing is timed here."""

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parent.parent / "scripts"))

from benchmarks import accuracy, cores, cost, cycles, defaults, fold, many, problems, report, startup  # noqa: E402
from benchmarks.statements import LARGE, NEWCOMERS, VARIATIONAL, Statement  # noqa: E402
from peers import auto_07p, scipy_bvp, scipy_small  # noqa: E402

BRANCH_FILE = """\
   0   PT  TY  LAB    kappa_n       L2-NORM        MAX M1
   2     1     9    2    2.3000000000E+00    2.1656407828E+00   -1.3000000000E+00
   2    -2     0    0    2.4060660172E+00    2.2309172553E+00   -1.4060660172E+00
   2     3     5    3    4.0756675354E+00    4.3569103380E+00   -1.9163912512E+00
   2     4     1    4   -5.0000000000E-01    3.6704494889E+00    3.5000000000E+00
"""
DIAGNOSTICS = """\
  BR    PT  IT         PAR           L2-NORM
   1     2   0        2.33536E+00   2.18705E+00
   1     2   1        2.33536E+00   2.18705E+00
   1     2   2       -2.33536E+00   2.18705E+00

   1     2         Fold Function    7.07107E-01
   1     2         Iterations   :   2
"""


def test_auto_output_is_parsed():
    parsed = auto_07p.parse(BRANCH_FILE, DIAGNOSTICS, "\n Total Time    0.509E+00\n")
    assert parsed["seconds"] == 0.509
    assert parsed["points"] == 4
    assert parsed["iterations"] == 2
    assert parsed["labels"] == [("EP", 2.3), ("LP", 4.0756675354), ("BP", -0.5)]


def test_auto_output_without_points_is_refused():
    with pytest.raises(ValueError, match="no points"):
        auto_07p.parse("", "", " Total Time    0.1E+00")


def test_best_is_the_fastest_that_is_exact_enough():
    rows = [
        {"tool": "a", "seconds": 1.0, "error": 1e-7},
        {"tool": "a", "seconds": 3.0, "error": 1e-11},
        {"tool": "a", "seconds": 2.0, "error": 1e-3},
    ]
    found = fold.best(rows)["a"]
    assert [found[key] and found[key]["seconds"] for key in ("1e-06", "1e-08", "1e-10", "1e-12")] == [1.0, 3.0, 3.0, None]


def test_import_times_are_summed_by_package():
    text = "import time: self [us] | cumulative | imported package\nimport time:       100 |        300 |   numpy\n"
    text += "import time:        50 |         50 |     numpy.linalg\nimport time:       200 |        500 | contin\n"
    assert startup.by_package(text) == [("contin", pytest.approx(2e-4)), ("numpy", pytest.approx(1.5e-4))]


def test_blocks_of_a_page_are_replaced(tmp_path):
    page = tmp_path / "page.md"
    page.write_text("before\n<!-- bench: machine -->\n<!-- end -->\nafter\n")
    results = {"machine": {"processor": "x", "load_at_start": 0.5}}
    for _ in range(2):  # into an empty place, and over what stands there
        report.update(page, results)
    assert page.read_text() == (
        "before\n<!-- bench: machine -->\nprocessor x; one thread; load when it began 0.5.\n<!-- end -->\nafter\n"
    )


def test_exponent_of_a_power_law():
    x = np.array([1, 2, 4, 8, 16, 32])
    assert cost.slope(x, 3.0 * x**2.5) == pytest.approx(2.5)


def test_errors_fall_with_the_intervals():
    """Degree 4 converges with the power 8; the truth is the exact quadrature."""
    rows = cost._errors(*cost.CASES[0], counts=(5, 10), degrees=(4,))["rows"]
    for coarse, fine in zip(rows[:2], rows[2:]):  # uniform, adapted
        assert fine["error"] < coarse["error"] / 30


def test_flops_of_one_interval_of_one_state():
    """degree 1, n = 1: nothing inside; one link of two rows and four columns, one elimination in one row and one border row."""
    assert cost.flops(1, 1, 1) == 2 * 2 * 3


def test_jacobian_given_to_solve_bvp_is_exact():
    """A peer with a wrong Jacobian would be slow for no fault of its own."""
    q, p = np.random.default_rng(1).standard_normal((4, 3)), np.array([2.0, -1.0, 0.5])
    by_state, by_parameters = scipy_bvp.rhs_jacobian(0, q, p)
    for j in range(4):
        e = np.zeros((4, 1))
        e[j] = 1e-6
        difference = (scipy_bvp.rhs(0, q + e, p) - scipy_bvp.rhs(0, q - e, p)) / 2e-6
        np.testing.assert_allclose(by_state[:, j], difference, atol=1e-8)
    for j in range(3):
        e = 1e-6 * np.eye(3)[j]
        difference = (scipy_bvp.rhs(0, q, p + e) - scipy_bvp.rhs(0, q, p - e)) / 2e-6
        np.testing.assert_allclose(by_parameters[:, j], difference, atol=1e-8)


def test_solve_bvp_is_driven_to_the_same_numbers():
    """Bratu's fold in closed form; r of a cycle of Lorenz's equations by shooting. Both to what its tolerance 1e-5 gives."""
    assert scipy_small.bratu(1e-5) == pytest.approx(accuracy._exact_fold(), rel=1e-6)
    assert scipy_small.lorenz(1e-5) == pytest.approx(accuracy._exact_cycle(), rel=1e-6)


def test_the_picture_of_errors_against_time():
    """Two panels, and a third where the fold of (1, 2) was measured too; a program that is missing leaves a gap."""
    rows = [{"tool": "contin", "setting": "", "seconds": 0.01 * n, "error": 10.0**-n} for n in range(3, 13)]
    results = {"problems": {name: {"rows": rows, "best": fold.best(rows), "exact": 1.0} for name in ("one", "other")}}
    assert "| one | contin | 60.0 ms | 80.0 ms | 100.0 ms | 120.0 ms |" in accuracy.table(results)
    of_fold = {"rows": [row | {"tool": fold.CELL} for row in rows], "exact_fold": 4.0}
    assert [len(report._accuracy(results, other).axes) for other in (None, of_fold)] == [2, 3]


def test_the_table_of_many_branches():
    """Rates are branches over seconds; a cluster that was not measured has no row."""
    results = {"branches": 100, "one": 8.0, "two": 5.0, "cpu": 6.0, "question": 0.5, "page": 9.0, "megabytes": 6.0}
    text = many.table(results)
    assert "| one process | 8.0 s | 12.5 |" in text and "| two processes | 5.0 s | 20.0 |" in text and "60 ms a branch" in text
    assert "Dask" not in text and "| Dask cluster of two workers | 4.0 s | 25.0 |" in many.table(results | {"cluster": 4.0})
    rates = {name: {"rate": 30.0, "cpu": 0.033} for name in ("loop", "one", "two")}
    assert "| `contin.batch`, two processes | 30 | 33 ms |" in many.table(results | {"batch": rates})


def test_ratios_of_cycles():
    """Twice the time for a branch of four times as many orbits is half the time for an orbit."""
    row = {"seconds": 0.1, "points": 10, "per_orbit": 0.01, "error": 1e-9}
    other = {"seconds": 0.2, "points": 40, "per_orbit": 0.005, "error": 1e-9}
    results = {"results": {"lorenz": {"contin": row, "AUTO-07p": other}, "alone": {"contin": row}}}
    assert cycles.ratio(results) == 0.5
    assert cycles.table(results).endswith("Ratio for a branch, AUTO-07p / contin: 2.00 (lorenz).")
    assert cycles.ratio({"results": {"alone": {"contin": row}}}) is None


def test_the_best_setting_is_the_fastest_that_is_accurate():
    runs = {
        (None, 1e-12): [{"seconds": 3.0, "error": 0.0}],
        (6, 1e-12): [{"seconds": 2.0, "error": 1e-15}],
        (7, 1e-8): [{"seconds": 1.0, "error": 1e-10}, {"seconds": 1.4, "error": 1e-10}],
        (5, 1e-8): [{"seconds": 0.1, "error": 1e-8}],
    }
    times, best, equal = defaults._best(runs)
    assert times[7, 1e-8] == 1.2 and best == (7, 1e-8) and equal == (6, 1e-12)


def test_every_run_of_a_program_has_a_name_of_its_own():
    """A version that keeps what it made for a function would otherwise be timed with what it kept."""
    assert [len(group) for group in (NEWCOMERS, VARIATIONAL, LARGE)] == [30, 10, 4]
    for statement in (*NEWCOMERS, *VARIATIONAL, *LARGE):
        one, other = (compile(problems.renamed(statement, end), "program", "exec") for end in ("_1", "_2"))
        assert one.co_consts != other.co_consts, statement.name


def test_a_new_name_stands_in_functions_only():
    text = 'f = lambda p: p["p"] + p.p + np.exp(p.a) * p[0]'
    assert problems.renamed(Statement("", text, ""), "_1") == 'f = lambda p_1: p_1["p"] + p_1.p + np.exp(p_1.a) * p_1[0]'
    assert problems.renamed(Statement("", '{"load": p.load}', "", word="load"), "_1") == '{"load_1": p.load_1}'


def test_a_program_that_finds_another_solution_is_not_timed():
    """x^2 = 4 from 1 has the solution 2."""
    text = "found = contin.solve(contin.AlgebraicProblem(lambda u, p: (u.x**2 - p.a,), ['x'], {'a': 4.0}), [1.0])"
    assert problems.time_of(Statement("right", text, "abs(found.x[0] - 2) < 1e-9"), 0) > 0
    with pytest.raises(AssertionError, match="wrong: not the known solution"):
        problems.time_of(Statement("wrong", text, "abs(found.x[0] + 2) < 1e-9"), 0)


def test_the_table_of_new_problems():
    """Medians over a group, ratios of two versions, and a program that the earlier version cannot run."""
    first = [{"name": s.name, "now": 0.004, "before": 1.2} for s in NEWCOMERS[:2]]
    first.append({"name": NEWCOMERS[2].name, "now": 0.01, "before": None})
    results = {"first": first, "ns": [{"name": "exp", "now": 48.0, "before": 96.0}], "versions": {"now": "1", "before": "2"}}
    text = problems.table(results)
    assert (
        "| docs/outside.md | now | 4 ms | 10 ms | 0 |" in text
        and "| docs/outside.md | before | 1200 ms | 1200 ms | 1 |" in text
    )
    assert "| 1 Troesch | 4 ms | 1200 ms | 300.0 |" in text and "| 3 Falkner-Skan | 10 ms | – | – |" in text
    assert "| exp | 48 ns | 96 ns | 2.0 |" in text and "now: 1, before: 2. Times are processor times." in text
    alone = problems.table({"first": first, "ns": results["ns"], "versions": {"now": "1"}})
    assert "before" not in alone and "| exp | 48 ns |" in alone


def test_stages_of_an_iteration_are_timed():
    system, x = cores.circle(4, 3)
    assert set(cores.stages(system, x)) == {"assembly", "factorization", "solve", "transposed", "bits"}
