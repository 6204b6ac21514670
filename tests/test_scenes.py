"""Some scenes of scripts/scenes.py: random ones of every law, none of them wrong."""

import subprocess
import sys
from pathlib import Path

import pytest

SCRIPT = Path(__file__).parent.parent / "scripts" / "scenes.py"


def scenes(*words):
    return subprocess.run([sys.executable, SCRIPT, *words], capture_output=True, text=True, timeout=600)


@pytest.mark.parametrize("count, wide", [(3, 1), pytest.param(12, 2, marks=pytest.mark.full)])
def test_some_scenes(count, wide):
    done = scenes("--count", str(count), "--wide", str(wide), "--seed", "1")
    assert (done.returncode, done.stderr) == (0, ""), done.stdout
    assert done.stdout.startswith(f"{count} scenes: 0 wrong, 0 not finished, worst error ")


@pytest.mark.full
def test_bad_usage():
    assert scenes("--count", "0").returncode == 2
