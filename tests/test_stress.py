"""Some problems of scripts/stress.py: random equilibria of known spectra; no branch point is missed, invented or wrong."""

import subprocess
import sys
from pathlib import Path

SCRIPT = Path(__file__).parent.parent / "scripts" / "stress.py"


def stress(*words):
    return subprocess.run([sys.executable, SCRIPT, *words], capture_output=True, text=True, timeout=600)


def test_some_problems(request):
    count, most = ("60", "30") if request.config.getoption("--full") else ("12", "6")
    done = stress("--count", count, "--first", "96", "--most", most)
    assert (done.returncode, done.stderr) == (0, ""), done.stdout
    assert f"{count} problems, " in done.stdout and "0 problems with faults" in done.stdout


def test_bad_usage():
    assert stress("--count", "0").returncode == 2
