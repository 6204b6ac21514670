"""The examples in docstrings of contin give what they say."""

import doctest
import importlib
import inspect
import pkgutil
import types

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


def without_an_example(owner, names):
    """Those names of a package or class whose docstrings have no example."""
    return [name for name in names if ">>>" not in (inspect.getdoc(getattr(owner, name)) or "")]


def test_every_public_name_has_an_example():
    assert without_an_example(contin, contin.__all__) == []


@pytest.mark.parametrize("owner", [contin.Branch, contin.BranchPoint, contin.Diagram, contin.Point, contin.CycleProblem])
def test_every_method_that_users_call_has_an_example(owner):
    methods = [
        name for name, value in vars(owner).items() if name[0] != "_" and isinstance(value, (types.FunctionType, classmethod))
    ]
    assert without_an_example(owner, methods) == []
