"""The examples in docstrings of contin give what they say."""

import doctest
import importlib
import pkgutil

import numpy as np
import pytest

import contin

MODULES = sorted(module.name for module in pkgutil.walk_packages(contin.__path__, "contin."))


@pytest.mark.parametrize("name", ["contin", *MODULES])
def test_examples(name, tmp_path, monkeypatch):
    """Each with what its module holds, and numpy as np; files that it writes go to a folder of its own."""
    monkeypatch.chdir(tmp_path)
    module = importlib.import_module(name)
    failed, _ = doctest.testmod(module, extraglobs={"np": np}, report=True)
    assert failed == 0


def test_there_are_examples_to_run():
    finder = doctest.DocTestFinder()
    tests = [test for name in MODULES for test in finder.find(importlib.import_module(name)) if test.examples]
    assert len(tests) > 10
