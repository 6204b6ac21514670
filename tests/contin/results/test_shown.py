"""What results show when they are printed, and how a branch is read: by number, by slice, by name."""

import dataclasses
import math
import subprocess
import sys
import typing

import numpy as np
import pytest

import contin
from contin.core.settings import Options

LIMITS = {"P": (5.0, 45.0)}


@pytest.fixture(scope="module")
def column():
    """Euler's column: branch points at 9.87 and 39.48."""
    problem = contin.BoundaryValueProblem(
        lambda t, u, p: (u.v, -p.P * math.sin(u.u)), lambda a, b, p: (a.v, b.v), ["u", "v"], {"P": 5.0}
    )
    return contin.trace(contin.solve(problem, (0.0, 0.0)), free=["P"], limits=LIMITS)


@pytest.fixture(scope="module")
def diagram():
    """x (a - x^2) = 0, thirty times: more branches than a screen has lines."""
    problem = contin.AlgebraicProblem(lambda u, p: (u.x * (p.a - u.x**2),), ["x"], {"a": -1.0})
    found = contin.diagram(contin.solve(problem, [0.0]), free=["a"], limits={"a": (-1, 1)})
    return contin.Diagram(found.branches * 30, found.junctions)


def test_a_branch_is_a_sequence(column):
    assert column[0] is column.points[0] and column[-1] is column.points[-1]
    assert column[1:3] == column.points[1:3] and len(column[::2]) == math.ceil(len(column) / 2)
    assert np.array_equal(column["P"], column.column("P"))
    with pytest.raises(IndexError):
        column[len(column)]
    with pytest.raises(KeyError, match="load"):
        column["load"]


def test_what_is_printed_fits_on_a_screen(column, diagram):
    first, *_ = column.labelled("BP")
    state = contin.lowlevel.Continuation(first.system, column[0].x).state
    long = contin.Branch(column.points * 50, column.stop)
    for found in (column, long, first, first.details, first.system, state, diagram, diagram.branches[0], column.stop):
        lines = repr(found).splitlines()
        assert len(lines) <= 24 and max(map(len, lines)) <= 250, lines
    assert "(200 labels)" in repr(long) and "60 more" not in repr(diagram)
    assert repr(diagram).startswith("Diagram of 120 branches and 1 junction\n") and "... 100 more" in repr(diagram)


def test_problems_and_runs_are_printed_by_names(column):
    """By those of states and parameters, without functions; a run by where it is."""
    problem = column[0].system.problem
    assert repr(problem) == "BoundaryValueProblem(states u, v; parameters P)"
    many = contin.AlgebraicProblem(lambda u, p: u, [f"u{i}" for i in range(500)], {})
    assert repr(many).endswith("u19 and 480 more; parameters none)")
    run = contin.lowlevel.Continuation(column[0].system, column[0].x)
    assert repr(run).startswith("Continuation(State(") and repr(run).endswith("not ended)")
    cycle = contin.CycleProblem(lambda u, p: (u.y, -u.x), ["x", "y"], {})
    assert repr(cycle) == "CycleProblem(states x, y; parameters period)"


def test_a_stored_table_is_printed_on_a_line(column, tmp_path):
    contin.save(column, tmp_path / "column.npz")
    text = repr(contin.lowlevel.read_columns(tmp_path / "column.npz"))
    assert text.startswith(f"StoredColumns({len(column)} points, columns ") and "EP, BP, BP, EP; reached P = 45)" in text


def test_a_point_with_a_large_kernel_is_printed():
    pair = contin.AlgebraicProblem(lambda u, p: (u.x * (p.a - u.x**2), u.y * (p.a - u.y**2)), ["x", "y"], {"a": -1.0})
    (point,) = contin.trace(contin.solve(pair, [0.0, 0.0]), free=["a"], limits={"a": (-1, 1)}).labelled("BP")
    assert repr(point.details) == "MultiplePoint(kernel of dimension 2, 5 branches)"


def test_options_are_the_fields_of_settings():
    fields = {field.name: field.type for field in dataclasses.fields(contin.Settings)}
    assert Options.__annotations__.keys() == fields.keys()
    fields["direction"] += " | Literal['both']"  # of trace and curve
    assert {name: hint.__forward_arg__ for name, hint in Options.__annotations__.items()} == fields


@pytest.mark.parametrize("function", [contin.trace, contin.curve, contin.diagram])
def test_functions_with_options_say_so(function):
    assert typing.get_type_hints(function)["options"] == typing.Unpack[Options]


@pytest.mark.full
def test_a_type_checker_finds_a_misspelt_option(tmp_path):
    program = tmp_path / "program.py"
    lines = ["import contin", "def run(point: contin.Point) -> None:"]
    lines += ['    contin.trace(point, free=["a"], max_step=0.1)', '    contin.trace(point, fre=["a"])']
    program.write_text("\n".join(lines) + "\n")
    command = [sys.executable, "-m", "mypy", "--cache-dir", str(tmp_path / "cache"), str(program)]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 1 and 'program.py:4: error: Unexpected keyword argument "fre"' in done.stdout, done.stdout
    assert done.stdout.count("error") == 2  # that one, and the summary
