"""Some trials of scripts/torture.py: every kind of fault on a branch, and some on a diagram; each ends in the same bits."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("fcntl", reason="needs POSIX")
SCRIPT = Path(__file__).parent.parent / "scripts" / "torture.py"


@pytest.mark.full
@pytest.mark.parametrize(("scene", "faults"), [("branch", 14), ("diagram", 4)])
def test_faults_of_every_kind(scene, faults, tmp_path):
    words = [sys.executable, SCRIPT, "--scenes", scene, "--trials", str(faults), "--seed", "3", "--keep", tmp_path]
    done = subprocess.run(words, capture_output=True, text=True, timeout=600)
    assert (done.returncode, done.stderr) == (0, ""), done.stdout
    trials = re.findall(rf"{scene} 1(?![.\d])", done.stdout)  # not the seconds of a reference run
    assert done.stdout.endswith(f"{faults} trials, 0 failed\n") and len(trials) == faults
