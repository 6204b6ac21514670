"""`import ribbon_model` has few names, and loads none of them; that the reference lists them is in test_architecture.py."""

import subprocess
import sys
from pathlib import Path

import ribbon_model

ROOT = Path(__file__).parents[2]


def test_there_are_few_names():
    assert len(ribbon_model.__all__) == len(set(ribbon_model.__all__)) == 21
    for name in ribbon_model.__all__:
        assert getattr(ribbon_model, name).__doc__, name


def test_none_is_loaded_with_the_package():
    code = "import sys, ribbon_model; print(sorted(name for name in sys.modules if name.startswith('ribbon_model.')))"
    found = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    assert found.stdout.strip() == "[]"
