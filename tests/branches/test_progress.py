"""The line of progress: on a terminal only, overwritten in place, with an estimate that converges."""

import ast
import io
import time
from pathlib import Path

import pytest

import branches
import ribbon_model
from branches.graph.closed import _circle
from branches.graph.kinds import graph_kind
from branches.graph.stored import new_graph
from branches.paper import shell_run as shell
from branches.run.display import Display, Progress, StartingDisplay
from branches.run.executor import WAIT
from branches.run.many import _Plan
from branches.scene.parse import parse
from contin.lowlevel import exact_text

TAPE = "--width .016 --thickness .00012 --length .6 --natural-radius .03 --poisson-ratio .3 --youngs-modulus 200e9"


class Terminal(io.StringIO):
    """Standard error that claims to be a terminal."""

    def isatty(self):
        return True


def a_terminal(monkeypatch):
    """Put it in place of standard error: in the test itself, since pytest replaces that after the fixtures."""
    monkeypatch.setenv("COLUMNS", "200")
    stream = Terminal()
    monkeypatch.setattr("sys.stderr", stream)
    return stream


def lines(text):
    """What stood in the line, one after the other."""
    return [part for part in (line.rstrip() for line in text.split("\r")) if part]


def test_the_line_is_overwritten_and_goes_away(monkeypatch, capsys):
    terminal = a_terminal(monkeypatch)
    with Progress("branches", total=2) as progress:
        progress.part("(1, 2)")
        progress.part_done()
        progress.tell("a line\n")
        progress.part("(1, 3)")
        progress.part_done()
    shown = terminal.getvalue()
    assert "\n" not in shown and shown.endswith(" " * 199 + "\r")  # the terminal's width but one, blank
    assert "0 of 2 branches done, 0 s so far: (1, 2)" in lines(shown)
    assert lines(shown)[-1].startswith("2 of 2 branches done, 0 s so far, about 0 s to go")
    assert capsys.readouterr().out == "a line\n"


def test_a_line_inside_another_one_is_shown_in_its_place(monkeypatch):
    terminal = a_terminal(monkeypatch)
    with Progress("items", total=2) as outer:
        with Progress("cases", total=3) as inner:
            inner.part("thin")
            outer.part("fig7")
        outer.part_done()
    shown = list(dict.fromkeys(lines(terminal.getvalue())))  # each is written twice, for the cursor to end behind it
    assert [line.split()[3] for line in shown] == ["cases", "items"] and shown[1].startswith("1 of 2 items done")


def test_nothing_is_shown_if_quiet_or_elsewhere_than_on_a_terminal(monkeypatch, capsys):
    terminal = a_terminal(monkeypatch)
    with Progress("branches", total=1, quiet=True) as progress:
        progress.part("(1, 2)")
        progress.tell("a line\n")
    assert terminal.getvalue() == "" == capsys.readouterr().out
    plain = io.StringIO()
    monkeypatch.setattr("sys.stderr", plain)
    with Progress("branches", total=1) as progress:
        progress.part("(1, 2)")
    assert plain.getvalue() == ""


def test_the_line_moves_while_nothing_happens(monkeypatch):
    terminal = a_terminal(monkeypatch)
    with Progress("starting", period=0.01):
        time.sleep(0.3)
    assert len(lines(terminal.getvalue())) > 3


def test_the_estimate_converges(monkeypatch):
    """Ten parts of 7 s: exact from the first one on, also between the ends of two parts."""
    now = [0.0]
    monkeypatch.setattr(time, "monotonic", lambda: now[0])
    progress = Progress("branches", total=10)
    assert "to go" not in progress.text()
    for done in range(1, 11):
        progress.part("next")
        now[0] += 5
        if done > 1:
            assert f", about {exact_text(70 - now[0])} s to go" in progress.text()
        now[0] += 2
        progress.part_done()
        so_far, left = exact_text(now[0]), exact_text(70 - now[0])
        assert f"{done} of 10 branches done, {so_far} s so far, about {left} s to go" in progress.text()
    now[0] += 1000
    assert "18 min so far, about 0 s to go" in progress.text()  # never negative


@pytest.mark.full
def test_the_estimate_of_many_branches_is_steady(monkeypatch, capsys):
    """600 branches on two processes; a branch (m, n) takes m n seconds, twice of that with a width, and 180 are merged.

    The time so far and the time left add up to the whole within 10 % from the twentieth part of the branches on. In the order
    of m n they add up to 37 % of the whole there, and later to 142 %.
    """
    now = [0.0]
    monkeypatch.setattr(time, "monotonic", lambda: now[0])
    terminal = a_terminal(monkeypatch)
    display = Display()
    nus = [k / 100 for k in range(20)]
    fields = "law: [ribbon, flat rod, finite width], Gamma: 1, m: [1, 3, 5], n: [1, 2, 3, 4], limits: {kappa_n: [-1e6, 1e6]}"
    config, graph = parse(f"{{nu: {nus}, {fields}}}", "scene"), new_graph()
    plan, busy, totals = _Plan(config, list(config.scenes), lambda scene: graph_kind(scene).holds(graph, scene)), [], []
    display.begin_many("diagram", len(config.scenes), 0)
    for done in range(1, len(config.scenes) + 1):
        while len(busy) < 2 and (one := plan.next([job for _, job in busy])) not in (None, WAIT):
            scene = config.scenes[one[0]]
            busy.append((now[0] + scene.m * scene.n * (2 if scene.Gamma else 1), one))
        if not busy:
            break
        now[0], one = min(busy, key=lambda job: job[0])
        busy.remove((now[0], one))
        one = config.scenes[one[0]]
        graph.add_node(_circle({"law": one.material, "nu": one.nu, "n": one.n}, 2 * one.n - one.m))
        display.branch_done([], "", done + len(plan.left_out))
        if done + len(plan.left_out) > len(config.scenes) / 20:
            totals.append(now[0] + _seconds(lines(terminal.getvalue()[-400:])[-1]))
    assert (len(config.scenes), len(plan.left_out)) == (600, 180)
    assert _seconds(lines(terminal.getvalue())[-1]) == 0
    assert 0.9 * now[0] < min(totals) <= max(totals) < 1.1 * now[0]


def _seconds(line):
    """The time left in the line of a diagram."""
    number, unit = line.partition(", about ")[2].split()[:2]
    return float(number) * {"s": 1, "min": 60}[unit]


def test_a_part_that_takes_longer_than_the_others_raises_the_estimate(monkeypatch):
    """Two parts in 100 s so far: 50 s for each of the three that are left, less 50 s of the current one."""
    now = [0.0]
    monkeypatch.setattr(time, "monotonic", lambda: now[0])
    progress = Progress("items", total=4)
    now[0] += 2
    progress.part_done()
    progress.part("long")
    now[0] += 98
    assert progress.text() == "1 of 4 items done, 100 s so far, about 100 s to go: long"


def shown_on_a_terminal(command, *arguments, program, **more):
    """What a command writes on a pseudo-terminal."""
    shown = command.on_terminal(*arguments, program=program, env={"COLUMNS": "200", **more})
    return lines(shown.decode())


@pytest.mark.full
def test_no_call_of_contin_shows_a_line_of_its_own():
    """A command has one line of progress, and none if it is quiet: calls within it say so (or pass on what they are given)."""
    packages = [Path(package.__file__).parent for package in (branches, ribbon_model)]
    shown = []
    for path in (path for package in packages for path in package.rglob("*.py")):
        tree = ast.parse(path.read_text(encoding="utf-8"))
        imports = [node for node in ast.walk(tree) if isinstance(node, ast.ImportFrom) and node.module == "contin"]
        names = {name.asname or name.name for node in imports for name in node.names} & {"trace", "curve", "diagram"}
        for call in (node for node in ast.walk(tree) if isinstance(node, ast.Call)):
            if getattr(call.func, "id", "") in names and not {key.arg for key in call.keywords} & {"progress", None}:
                shown.append(f"{path}:{call.lineno}")
    assert not shown


@pytest.mark.full
def test_a_strip_on_a_terminal(command):
    shown = shown_on_a_terminal(command, *TAPE.split(), program=("-m", "branches.strip"))
    assert any("branches done" in line and "to go: (1, 3)" in line for line in shown)
    assert shown_on_a_terminal(command, *TAPE.split(), "--quiet", program=("-m", "branches.strip")) == []


@pytest.mark.full
def test_secondary_branches_on_a_terminal(command):
    (command.folder / "pair.yaml").write_text("{m: 5, n: 2, stability: true, limits: {kappa_n: [-21, 100]}, stride: 20}")
    assert command("pair.yaml", "--quiet").returncode == 0
    shown = shown_on_a_terminal(command, "pair.h5", program=("-m", "branches.secondary"))
    assert any("secondary bifurcations done" in line and "keeps" in line for line in shown)


def test_the_start_of_a_run_is_shown_until_its_first_output(monkeypatch, capsys):
    """A first run compiles for half a minute before it has anything to say."""
    terminal = a_terminal(monkeypatch)
    display = StartingDisplay(period=0.01)
    time.sleep(0.1)
    display.note("the run")
    shown = terminal.getvalue()
    assert lines(shown)[-1] == "starting (the first run compiles machine code, which takes half a minute): 0 s so far"
    time.sleep(0.1)
    assert terminal.getvalue() == shown and capsys.readouterr().out == "the run\n"


def test_a_case_of_finite_elements_is_counted(tmp_path, monkeypatch):
    terminal = a_terminal(monkeypatch)
    monkeypatch.setattr(shell, "version", lambda: "2.20")
    monkeypatch.setattr(shell, "solve", lambda case, stopped: shell.Outcome(case, 0.7, (), "", 1.0, "2.20"))
    shell.compute(shell.DEFAULT[:2], tmp_path / "x.h5")
    assert lines(terminal.getvalue())[-1].startswith("2 of 2 cases done")


@pytest.mark.full
def test_the_items_of_the_paper_on_a_terminal(command):
    shown = shown_on_a_terminal(command, "--out", "x", "table3", "table1", program=("-m", "branches.paper"))
    assert any("1 of 2 items done" in line and "to go: table1" in line for line in shown)
