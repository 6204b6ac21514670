"""Some trials of scripts/torture.py: kinds of fault on a branch and on a diagram; each ends in the same bits.

Takes longer than other tests: every trial computes its scene in two to four processes. Every kind of fault with --full.
"""

import re
import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("fcntl", reason="needs POSIX")
SCRIPT = Path(__file__).parent.parent / "scripts" / "torture.py"


DIAGRAM = pytest.param("diagram", 4, 4, marks=pytest.mark.full)


@pytest.mark.parametrize(("scene", "some", "all_kinds"), [("branch", 4, 14), DIAGRAM])
def test_faults_of_every_kind(scene, some, all_kinds, tmp_path, request):
    faults = all_kinds if request.config.getoption("--full") else some
    words = [sys.executable, SCRIPT, "--scenes", scene, "--trials", str(faults), "--seed", "3", "--keep", tmp_path]
    done = subprocess.run(words, capture_output=True, text=True, timeout=600)
    assert (done.returncode, done.stderr) == (0, ""), done.stdout
    trials = re.findall(rf"{scene} 1(?![.\d])", done.stdout)  # not the seconds of a reference run
    assert done.stdout.endswith(f"{faults} trials, 0 failed\n") and len(trials) == faults
