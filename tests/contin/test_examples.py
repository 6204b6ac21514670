"""The examples in docstrings of contin give what they say."""

import importlib
import inspect
import pkgutil
import types

import pytest
from printed import UpToRoundOff, check_examples

import contin

MODULES = sorted(module.name for module in pkgutil.walk_packages(contin.__path__, "contin."))


@pytest.mark.parametrize("name", ["contin", *MODULES])
def test_examples(name, tmp_path, monkeypatch):
    """Each with what its module holds, and numpy as np; files that it writes go to a folder of its own."""
    monkeypatch.chdir(tmp_path)
    check_examples(importlib.import_module(name))


@pytest.mark.parametrize(
    "want, got, same",
    [
        ("-3.0", "-2.9999999999999996", True),
        ("-3.0", "-2.999999999999", False),
        ("-3.0", "-3.0, 1", False),
        ("3", "4", False),
        ("2.5", "2.6", False),
        ("4.0823", "4.0824", True),
        ("4.0823", "4.0825", False),
        ("4.08230001", "4.0824", False),
        ("1.5e-09", "1.6e-09", True),
        ("1.5e-09", "1.7e-09", False),
    ],
)
def test_printed_numbers_may_differ_by_round_off(want, got, same):
    """One unit in the last place that both have, of numbers with four places and more."""
    assert UpToRoundOff().check_output(f"(2, [{want}])\n", f"(2, [{got}])\n", 0) is same


def without_an_example(owner, names):
    """Those names of a package or class whose docstrings have no example."""
    return [name for name in names if ">>>" not in (inspect.getdoc(getattr(owner, name)) or "")]


def test_every_public_name_has_an_example():
    assert without_an_example(contin, contin.__all__) == []


@pytest.mark.parametrize(
    "owner", [contin.Branch, contin.lowlevel.BranchPoint, contin.Diagram, contin.Point, contin.CycleProblem]
)
def test_every_method_that_users_call_has_an_example(owner):
    methods = [
        name for name, value in vars(owner).items() if name[0] != "_" and isinstance(value, (types.FunctionType, classmethod))
    ]
    assert without_an_example(owner, methods) == []
