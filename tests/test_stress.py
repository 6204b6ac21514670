"""Some problems of scripts/stress.py: random problems of known branch points; none is missed, invented or wrong."""

import subprocess
import sys
from pathlib import Path

import pytest

SCRIPT = Path(__file__).parent.parent / "scripts" / "stress.py"


def stress(*words):
    return subprocess.run([sys.executable, SCRIPT, *words], capture_output=True, text=True, timeout=600)


@pytest.mark.parametrize("count, most", [(4, 4), pytest.param(60, 30, marks=pytest.mark.full)])
def test_some_problems(count, most):
    done = stress("--count", str(count), "--first", "96", "--most", str(most))
    assert (done.returncode, done.stderr) == (0, ""), done.stdout
    assert f"{count} problems, " in done.stdout and "0 problems with faults" in done.stdout


@pytest.mark.full
def test_two_branch_points_in_a_step_that_begins_beside_the_first():
    """Problem 53: one singular value is smaller than the others by far, and two pass zero one after the other."""
    done = stress("--count", "1", "--first", "53", "--verbose")
    assert (done.returncode, done.stderr) == (0, ""), done.stdout
    assert "4 right or noted" in done.stdout and "0 noted" in done.stdout


@pytest.mark.full
def test_bad_usage():
    assert stress("--count", "0").returncode == 2
