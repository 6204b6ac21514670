"""The examples in docstrings of ribbon_model give what they say."""

import importlib
import pkgutil

import pytest
from printed import check_examples

import ribbon_model

#: Modules whose examples compile their problems, which takes ten seconds and more.
LONG = {"closed_search", "barriers", "open_strip", "seeds", "solution"}
MODULES = sorted(module.name for module in pkgutil.iter_modules(ribbon_model.__path__))


@pytest.mark.parametrize("name", [pytest.param(name, marks=[pytest.mark.full] * (name in LONG)) for name in MODULES])
def test_examples(name):
    check_examples(importlib.import_module(f"ribbon_model.{name}"))
