"""Folds against a second number."""

import numpy as np
import pytest

from branches.curve import main
from branches.run.display import Display
from branches.run.runner import run_scene
from branches.scene.parse import parse
from ribbon_model import exact


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("curve")
    run_scene(parse("{m: 1, n: 2, stride: 1000}", "scene"), folder / "x.h5", Display(silent=True))
    return folder


def test_folds_against_nu_are_those_of_the_quadrature(folder, call):
    done = call(main, folder / "x.h5", "--against", "nu", "--between", 0.1, 0.4, "-o", folder / "folds.csv")
    assert done.returncode == 0 and ", nu from 0.1 to 0.4\n" in done.out
    table = np.genfromtxt(folder / "folds.csv", delimiter=",", names=True, usecols=(0, 1))
    assert table["nu"].min() == pytest.approx(0.1) and table["nu"].max() == pytest.approx(0.4) and len(table) > 4
    for nu, kappa_n in table[:: len(table) // 3].tolist():
        assert kappa_n == pytest.approx(exact.folds(1, 2, nu)[0].kappa_n, abs=1e-8)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--against", "nnu", "--between", "0", "1"], "--against: 'nnu' (did you mean 'nu'?) must be one of nu"),
        (["--against", "nu", "--between", "0.4", "0.5"], "--between: must hold the value of the result, nu = 0.3"),
        (["--against", "nu", "--between", "0", "0.5", "--point", "1"], "--point: must be a fold (LP)"),
        (["--against", "nu", "--between", "0", "0.5", "-o", "x.txt"], "must end in .csv, .pdf, .svg or .png"),
    ],
)
def test_what_is_no_curve_is_refused(words, said, folder, call):
    done = call(main, folder / "x.h5", *words)
    assert done.returncode == 2 and said in done.err and done.err.count("\n") == 1
