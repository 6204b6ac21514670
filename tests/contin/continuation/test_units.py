"""Runs in other units: the bank with every state, parameter, functional and equation multiplied by 10^U(-9, 9)."""

import pytest

from bank import units

#: A boundary value problem that starts from rest, and equilibria with folds, Hopf points and branch switching: those that
#: compile in a second or two.
QUICK = "dd2", "lrz"
SEEDS = 3


def complaints(name, seed, stated=False):
    module = units.restated(name, seed, stated)
    found = {case.name: units.complaint(module, case) for case in module.CASES}
    return {case: what for case, what in found.items() if what}


@pytest.mark.sample(1)
@pytest.mark.parametrize("name", QUICK)
def test_some_in_other_units(name):
    assert complaints(name, 0) == {}


@pytest.mark.full
@pytest.mark.parametrize("seed", range(SEEDS))
@pytest.mark.parametrize("name", units.NAMES)
def test_sizes_stated(name, seed, request):
    """The whole bank."""
    if (name, seed) == ("bru", 2):
        request.applymarker(pytest.mark.xfail(reason="a known fault: two branch points in one step"))
    assert complaints(name, seed, stated=True) == {}
