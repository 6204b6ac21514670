"""Some scenes of scripts/scenes.py: random ones of every law, none of them wrong."""

import subprocess
import sys
from pathlib import Path

SCRIPT = Path(__file__).parent.parent / "scripts" / "scenes.py"


def scenes(*words):
    return subprocess.run([sys.executable, SCRIPT, *words], capture_output=True, text=True, timeout=600)


def test_some_scenes():
    done = scenes("--count", "12", "--wide", "2", "--seed", "1")
    assert (done.returncode, done.stderr) == (0, ""), done.stdout
    assert done.stdout.startswith("12 scenes: 0 wrong, 0 not finished, worst error ")


def test_bad_usage():
    assert scenes("--count", "0").returncode == 2
