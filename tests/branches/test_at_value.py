"""States of a diagram at a natural curvature: solved with an error, or the digits that hold; against the exact quadrature."""

import json
import math
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

import branches
from branches.graph import __main__ as graph
from branches.graph import at_value
from branches.graph.at_value import EXACT, INTERPOLATED, SOLVED, holding, states_at
from branches.graph.closed import preview
from branches.graph.stored import read
from branches.run.display import Display
from branches.run.many import run_many
from branches.scene.parse import parse
from ribbon_model import exact

SCENE = "{law: ribbon, pairs: [[1, 2], [3, 5], [1, 3]], nu: 0.3, limits: {kappa_n: [-60, 100]}, stride: 10}"
#: Random natural curvatures, and some beside the fold of (1, 2) at 4.0756675.
PLACES = [*np.random.default_rng(3).uniform(-8, 8, 12).round(3).tolist(), 4.0, 4.07, 4.0756]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """The folder of a small diagram in which every tenth solution is kept."""
    path = tmp_path_factory.mktemp("at_value") / "diagram"
    run_many(parse(SCENE, "scene"), path, Display(silent=True))
    return path


def truth(mode, kappa_n):
    """kappa* and energy of all states of a branch at a natural curvature: quadratures solved from a fine curve."""
    points = exact.curve(*mode, 0.3, (-60, 100), 0.02)
    found = []
    for a, b in zip(points, points[1:]):
        if (a.kappa_n > kappa_n) != (b.kappa_n > kappa_n):
            solved = [exact.solve(*mode, 0.3, guess, kappa_n=kappa_n) for guess in (a, b)]
            best = min(solved, key=lambda point: abs(point.kappa_star - (a.kappa_star + b.kappa_star) / 2))
            found.append((best.kappa_star, best.energy))
    return sorted(found)


def on_branch(states, mode):
    return sorted(
        (state for state in states if state.about.get("branch") == mode), key=lambda state: state.values["kappa_star"]
    )


@pytest.mark.sample(1)
@pytest.mark.parametrize("kappa_n", PLACES)
def test_a_state_is_solved_to_its_error(folder, kappa_n):
    """Interpolated, kappa* was off by 7e-5 and the energy by 4e-4 at kappa_n = 3, with eight digits after the point."""
    states = states_at(read(folder), kappa_n, folder)
    for mode in ((1, 2), (3, 5), (1, 3)):
        found, expected = on_branch(states, mode), truth(mode, kappa_n)
        assert len(found) == len(expected)
        for state, (kappa_star, energy) in zip(found, expected):
            assert state.source == SOLVED
            for name, value in (("kappa_star", kappa_star), ("energy", energy)):
                assert state.errors[name] < 1e-8
                assert abs(state.values[name] - value) <= state.errors[name] + 3e-11 * (1 + abs(value))  # the quadrature's own


@pytest.mark.sample(1)
@pytest.mark.parametrize("kappa_n", PLACES)
def test_without_the_files_the_digits_hold_and_the_word_is_there(folder, kappa_n):
    states = states_at(read(folder), kappa_n)
    for mode in ((1, 2), (3, 5), (1, 3)):
        for state, values in zip(on_branch(states, mode), truth(mode, kappa_n)):
            assert state.source == INTERPOLATED
            for name, value in zip(("kappa_star", "energy"), values):
                words = state.words(name)
                assert words.endswith("(interpolated)")
                digits = words.removesuffix(" (interpolated)")
                assert abs(float(digits) - value) < 10.0 ** -len(digits.partition(".")[2])


@pytest.mark.sample(2)
@pytest.mark.parametrize("law", ["ribbon", "flat rod", "isotropic rod", "finite width"])
def test_the_preview_is_exact_where_it_says_so(law):
    """The answers of the preview come from a coarse curve; those of a curve five times finer are the same to 1e-9."""
    more = (
        "[[1, 2]], Gamma: 30, limits: {kappa_n: [-4, 6]}"
        if law == "finite width"
        else "[[1, 2], [3, 4]], limits: {kappa_n: [-10, 20]}"
    )
    scene = parse(f"{{law: {law}, nu: 0.3, pairs: {more}}}", "scene")
    coarse, fine = (states_at(preview(scene, step), 3.0) for step in (0.2, 0.04))
    assert len(coarse) == len(fine) >= 3
    for one, other in zip(coarse, fine):
        assert one.source == other.source == EXACT
        assert [one.values[name] for name in one.values] == pytest.approx([other.values[name] for name in one.values], abs=1e-9)


def test_a_file_that_cannot_be_read_gives_the_interpolated_digits(folder, tmp_path):
    shutil.copytree(folder, tmp_path / "broken")
    for path in (tmp_path / "broken").glob("*_m1_n2.h5"):
        path.write_bytes(b"")
    states = states_at(read(tmp_path / "broken"), 3.0, tmp_path / "broken")
    assert {state.source for state in on_branch(states, (1, 2))} == {INTERPOLATED}
    assert {state.source for state in on_branch(states, (3, 5))} == {SOLVED}


@pytest.mark.full
def test_another_state_is_not_taken_for_the_one_that_was_interpolated(folder, monkeypatch):
    """Newton's method may arrive at another branch; here it is made to."""
    monkeypatch.setattr(at_value, "solved", lambda *_: ({"kappa_star": 2.9, "energy": -4.0}, {"kappa_star": 0, "energy": 0}))
    states = states_at(read(folder), 3.0, folder)
    assert all(state.source == INTERPOLATED for state in states if "branch" in state.about)


def test_the_command_shows_errors(folder, call):
    done = call(graph.main, folder, "--at", 3)
    (line,) = (line for line in done.out.splitlines() if "branch (3, 5)" in line)
    assert "kappa* = 5.7492462128 ± " in line and "energy = 5.5593961810 ± " in line
    alone = call(graph.main, folder / "diagram.json", "--at", 3)
    assert alone.out == done.out  # the files beside it are found


def test_digits_that_hold():
    assert holding(-2.17298, 0.09) == "-2.2"
    assert holding(396.48381, 3e-5) == "396.4838"
    assert holding(1.5, math.nan) == "about 2"


def test_the_page_estimates_the_error_of_what_it_interpolates():
    """Cubics through unevenly spaced points of a cosine, near the ends and inside, in node."""
    node = shutil.which("node")
    if node is None:
        pytest.skip("needs node")
    source = Path(branches.__file__).parent / "explore" / "branch.js"
    s = np.cumsum([0, 0.3, 0.2, 0.35, 0.3, 0.15, 0.3, 0.4, 0.3]).tolist()
    program = f"""{source.read_text(encoding="utf-8").replace('"use strict";', "")}
    const branch = Object.create(Branch.prototype, {{ columns: {{ value: {{ a: {s}, f: {np.cos(s).tolist()} }} }} }});
    Object.defineProperty(branch, "abscissa", {{ value: {s} }});
    branch.parameter = "a";
    const out = [];
    for (let s = 0; s <= 8; s += 0.125) out.push([s, branch.value("a", s), branch.value("f", s), branch.uncertainty("f", s)]);
    console.log(JSON.stringify(out));"""
    out = subprocess.run([node, "-e", program], capture_output=True, text=True, check=True).stdout
    for place, a, f, error in json.loads(out):
        computed = place == round(place)
        assert (error == 0) == computed
        assert computed or abs(f - math.cos(a)) < error < 1e-2
