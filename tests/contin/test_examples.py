"""The examples in docstrings of contin give what they say."""

import doctest
import importlib
import inspect
import pkgutil
import re
import types

import numpy as np
import pytest

import contin

MODULES = sorted(module.name for module in pkgutil.walk_packages(contin.__path__, "contin."))
NUMBER = re.compile(r"(-?\d+\.\d*(?:e[+-]?\d+)?)")


class UpToRoundOff(doctest.OutputChecker):
    """Takes numbers as equal that differ by round-off: -2.9999999999999996 and -3.0."""

    def check_output(self, want, got, optionflags):
        if super().check_output(want, got, optionflags):
            return True
        one, other = NUMBER.split(want), NUMBER.split(got)
        known = [float(number) for number in one[1::2]]
        return one[::2] == other[::2] and known == pytest.approx(
            [float(number) for number in other[1::2]], rel=1e-13, abs=1e-13
        )


@pytest.mark.parametrize("name", ["contin", *MODULES])
def test_examples(name, tmp_path, monkeypatch):
    """Each with what its module holds, and numpy as np; files that it writes go to a folder of its own."""
    monkeypatch.chdir(tmp_path)
    module = importlib.import_module(name)
    runner = doctest.DocTestRunner(UpToRoundOff())
    for example in doctest.DocTestFinder(exclude_empty=True).find(module, extraglobs={"np": np}):
        runner.run(example)
    assert runner.failures == 0


@pytest.mark.parametrize("got, same", [("-2.9999999999999996", True), ("-2.999999999999", False), ("-3.0, 1", False)])
def test_examples_may_differ_by_round_off(got, same):
    assert UpToRoundOff().check_output("(2, [-3.0])\n", f"(2, [{got}])\n", 0) is same


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
