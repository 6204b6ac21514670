"""The shell check: decks, answers of CalculiX, its failures, the search, and one real strip."""

import math
import os
import re
import shutil
import stat
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from branches.paper import shell_run as shell
from branches.paper.shell import fig7
from branches.paper.shell_deck import RADIUS, Strip, direct_deck, states, thermal_deck
from branches.paper.shell_run import Case, Unusable, compute, first_root, grid, read, run_ccx, solve
from branches.store.files import StoreError
from ribbon_model.laws import FINITE_WIDTH
from ribbon_model.unfolding import first_root as law_root

SMALL = Strip(0.3, 2.0, 20.0, 4, 2)
CASE = Case("thermal", 0.3, 2.0, 20.0, 4, 2, first=0.5, step=0.05)
#: What CalculiX 2.20 answers for SMALL at xi = .6 without conditions on the centre line: in-plane vibrations among the others.
ANSWER = Path(__file__).with_suffix(".dat").read_text()


# --- decks ------------------------------------------------------------------------------------------------------------


def blocks(deck) -> list[tuple[str, list[list[str]]]]:
    """(card, fields of its lines) in order."""
    found = []
    for line in deck.splitlines():
        if line.startswith("*"):
            found.append((line, []))
        else:
            found[-1][1].append(line.rstrip(",").split(","))
    return found


def nodes_of(deck) -> dict[int, np.ndarray]:
    return {int(row[0]): np.array(row[1:], float) for card, rows in blocks(deck) if card.startswith("*NODE,N") for row in rows}


@pytest.mark.parametrize(("deck", "angle"), [(thermal_deck(SMALL, 0.6), 0.4), (direct_deck(SMALL, [0.25]), 1.0)])
def test_decks_hold_the_strip(deck, angle):
    nodes = nodes_of(deck)
    along, across = SMALL.along, SMALL.across
    edges_of_a_face = along * (across + 1) + (along + 1) * across
    assert len(nodes) == 3 * (along + 1) * (across + 1) + 2 * edges_of_a_face
    ((_, rows),) = (block for block in blocks(deck) if block[0].startswith("*ELEMENT"))
    elements = np.array([int(number) for row in rows for number in row]).reshape(along * across, 21)[:, 1:]
    volume = 0.0
    for element in elements:
        corner = [nodes[number] for number in element]
        edges = np.array([corner[1] - corner[0], corner[3] - corner[0], corner[4] - corner[0]])
        assert np.linalg.det(edges) > 0
        volume += np.linalg.det(edges)
        for middle, (a, b) in enumerate([(0, 1), (1, 2), (2, 3), (3, 0)], 8):
            assert np.linalg.norm(corner[middle] - (corner[a] + corner[b]) / 2) < 0.1 * RADIUS
    half = math.pi * angle / (2 * along)  # chords, and faces that are not square to them
    volume *= half / (math.sin(half) * math.cos(half))
    assert volume == pytest.approx(math.pi * RADIUS * SMALL.width * SMALL.thickness, rel=0.03)
    assert all(len(field) <= 20 for card, rows in blocks(deck) for row in rows for field in row)  # CalculiX reads no more


def test_the_thermal_deck_has_the_natural_curvature():
    deck = dict(blocks(thermal_deck(SMALL, 0.6)))
    strains = sorted({float(row[1]) for row in deck["*TEMPERATURE"]})
    outer = 0.6 / RADIUS * SMALL.thickness / 2  # y (kappa_n - kappa)
    assert strains == pytest.approx([-outer, 0, outer])
    centre = [nodes_of(thermal_deck(SMALL, 0.6))[int(number)] for row in deck["*NSET,NSET=CENTRE"] for number in row]
    assert np.allclose([np.hypot(x, y) for x, y, _ in centre], RADIUS / 0.4) and np.allclose(np.array(centre)[:, 2], 0)


def test_the_direct_deck_turns_rigid_ends():
    """Displacements of an end are those of a rotation by pi xi / 2; the other end may slide along x only."""
    deck, nodes = direct_deck(SMALL, [0.05, 0.25]), nodes_of(direct_deck(SMALL, [0.25]))
    steps = [rows for card, rows in blocks(deck) if card == "*BOUNDARY"]
    assert len(steps) == 4  # through .1 and .2
    assert sum(card.startswith("*FREQUENCY") for card, _ in blocks(deck)) == 2
    moved = {}
    for number, first, _, value in steps[-1]:
        moved.setdefault(int(number), {})[int(first)] = float(value)
    left = {number: u for number, u in moved.items() if number in nodes and nodes[number][0] < 0}
    assert len(left) == 5 * SMALL.across + 3
    angle, centre = -math.pi * 0.25 / 2, np.array([-RADIUS, 0, 0])
    turn = np.array([[math.cos(angle), -math.sin(angle), 0], [math.sin(angle), math.cos(angle), 0], [0, 0, 1]])
    for number, u in left.items():
        assert [u[1], u[2], u[3]] == pytest.approx(list((turn - np.eye(3)) @ (nodes[number] - centre)), abs=1e-9)
    right = {number: u for number, u in moved.items() if number in nodes and nodes[number][0] > 0}
    assert len(right) == len(left) and all(1 not in u for u in right.values())


@pytest.mark.parametrize(
    "wrong",
    [
        lambda: Strip(0.3, 4.0, 300.0, 60, 5),
        lambda: Strip(0.7, 4.0, 300.0),
        lambda: thermal_deck(SMALL, 1.0),
        lambda: direct_deck(SMALL, [0.2, 0.1]),
        lambda: Case("thermal", 0.3, 4.0, 300.0, last=1.2),
        lambda: Case("magic", 0.3, 4.0, 300.0),
    ],
)
def test_what_is_refused(wrong):
    with pytest.raises(ValueError):
        wrong()


# --- answers ----------------------------------------------------------------------------------------------------------


def test_a_real_answer_is_read():
    (state,) = states(ANSWER, SMALL)
    assert state.planar
    assert state.omega_squared == pytest.approx(
        0.4928418e8 / SMALL.unit, rel=1e-6
    )  # mode 3 there: the first two lie in the plane


def test_half_an_answer_has_no_state():
    assert states(ANSWER[: len(ANSWER) // 2], SMALL) == [] == states("", SMALL) == states("\x00 nonsense 1 2 3", SMALL)
    assert len(states(ANSWER + ANSWER[: len(ANSWER) // 2], SMALL)) == 1


def test_a_state_that_left_the_plane_is_seen():
    (state,) = states(ANSWER.replace("4.678060E-14", "4.678060E+00", 1), SMALL)
    assert not state.planar


# --- failures ---------------------------------------------------------------------------------------------------------


@pytest.fixture
def fake(tmp_path, monkeypatch):
    """Puts a shell script in the place of ccx."""
    if os.name != "posix":
        pytest.skip("needs POSIX: a shell script in the place of a program")

    def put(script):
        program = tmp_path / "fake-ccx"
        program.write_text(f'#!/bin/sh\n[ "$1" = -v ] && echo "This is Version 0.0" && exit 0\n{script}\n')
        program.chmod(program.stat().st_mode | stat.S_IXUSR)
        monkeypatch.setattr(shell, "PROGRAM", str(program))

    return put


@pytest.mark.parametrize(
    ("script", "words"),
    [
        ("echo ' *ERROR in e_c3d: nonpositive jacobian'; exit 1", r"exit code 1 \(in e_c3d: nonpositive jacobian\)"),
        ("exec sleep 60", "not finished within 0.3 s"),
        ("head -c 3000 /dev/urandom > strip.dat", "lacks this state"),
        ("true", "lacks this state"),
        ("kill -9 $$", "exit code -9"),
    ],
)
def test_a_ccx_that_fails_is_that_cases_failure(fake, monkeypatch, script, words):
    fake(script)
    monkeypatch.setitem(shell.TIME_LIMITS, "thermal", 0.3)
    outcome = solve(CASE)
    assert outcome.root is None and outcome.samples == () and outcome.version == "0.0"
    assert re.search(words, outcome.problem)


def test_an_interrupt_ends_ccx(fake):
    fake("exec sleep 60")
    assert run_ccx("", 60.0, lambda: True)[1].endswith("exit code -9")


def test_the_others_go_on_and_a_rerun_computes_what_is_missing(fake, tmp_path, monkeypatch):
    """The fake answers with the same stable state always, and fails for one strip."""
    (tmp_path / "answer").write_text(ANSWER)
    count = tmp_path / "count"
    fake(f"echo x >> {count}; grep -q '^[*]ELASTIC' strip.inp && grep -q '1.000000000000e-01' strip.inp && exit 3\n"
         f"cp {tmp_path}/answer strip.dat")  # fmt: skip
    cases, path, seen = [replace(CASE, last=0.6), replace(CASE, nu=0.1)], tmp_path / "kept.h5", []
    compute(cases, path, lambda outcome, left: seen.append((outcome.case.nu, left)))
    assert sorted(left for _, left in seen) == [0, 1]
    kept = {outcome.case: outcome for outcome in read(path)}
    assert kept[cases[0]].problem == "" and [xi for xi, _ in kept[cases[0]].samples] == [0.5, 0.55, 0.6]
    assert "exit code 3" in kept[cases[1]].problem
    runs = count.read_text().count("x")
    compute(cases, path)
    assert count.read_text().count("x") == runs + 1  # the failed one, once more
    assert {outcome.case: outcome.samples for outcome in read(path)} == {case: o.samples for case, o in kept.items()}
    (tmp_path / "other.h5").write_text("no results")
    with pytest.raises(StoreError, match="not a file of shell results"):
        compute(cases, tmp_path / "other.h5")


@pytest.mark.full
def test_without_ccx_one_sentence_and_the_laws_are_drawn(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(shell, "PROGRAM", "no-such-program")
    section = fig7(tmp_path)
    assert section.notes[0].startswith("No finite elements were computed: CalculiX (the program ccx) is not installed; on")
    assert (tmp_path / "fig7.png").stat().st_size > 10_000
    assert shell.main(["--out", str(tmp_path / "x.h5")]) == 2
    assert capsys.readouterr().err.count("\n") == 1


# --- the search -------------------------------------------------------------------------------------------------------


def counted(function, hidden=lambda xi: False):
    def value(xi):
        value.calls += 1
        if hidden(xi):
            raise Unusable("no convergence")
        return function(xi)

    value.calls = 0
    return value


@pytest.mark.parametrize("root", [0.512, 0.7461, 0.9321])
@pytest.mark.parametrize(
    "hidden", [lambda xi, root: False, lambda xi, root: xi > root + 0.004, lambda xi, root: 0.003 < xi - root < 0.02]
)
def test_the_first_zero_is_found(root, hidden):
    """Two modes that cross, steep beyond the zero; also where nothing converges soon after it."""
    function = counted(lambda xi: min(100 * (root - xi) * (1 + 5 * xi), 40 - 30 * xi), lambda xi: hidden(xi, root))
    assert first_root(function, 0.5, 0.95, 0.05) == pytest.approx(root, abs=2e-4)
    assert function.calls < 30


def test_a_search_that_finds_no_zero():
    assert first_root(lambda xi: 1.0, 0.5, 0.95, 0.1) is None
    assert grid(0.5, 0.95, 0.1) == pytest.approx([0.5, 0.6, 0.7, 0.8, 0.9, 0.95])
    with pytest.raises(Unusable, match=r"stable up to xi = 0.7\d*, unknown beyond: no convergence"):
        first_root(counted(lambda xi: 1.0, lambda xi: xi > 0.7), 0.5, 0.95, 0.1)
    with pytest.raises(Unusable, match="unstable already"):
        first_root(lambda xi: -1.0, 0.5, 0.95, 0.1)


# --- mechanics --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("nu", "number"), [(0.3, 75.0), (0.3, 200.0), (0.1, 250.0)])
def test_the_laws_root_by_a_third_way(nu, number):
    """The root that the finite elements are compared with, from the energy alone.

    With the rotation psi about d2 and phi about d3, omega_2 = 0 gives phi = psi'/kappa, the twist is w = psi''/kappa +
    kappa psi, and the second variation of U about omega = (kappa, 0, 0) is int U_33 w**2 - U_1 psi w dS; psi = psi' = 0 at both
    ends, int psi dS = 0 because they do not move along z. Ritz's method; the first direction of negative energy.
    """
    from scipy.optimize import brentq

    s, weights = np.polynomial.legendre.leggauss(80)
    polynomials = [
        np.poly1d([1, 0, -2, 0, 1]) * np.poly1d(np.polynomial.legendre.leg2poly([0] * k + [1])[::-1]) for k in range(24)
    ]
    half = math.pi / 2
    psi, curved = (np.array([np.polyder(p, d)(s) / half**d for p in polynomials]) for d in (0, 2))
    complement = np.linalg.svd((psi @ weights)[None])[2][1:]  # the mean vanishes

    def lowest(xi):
        kappa = 1 - xi
        circle = FINITE_WIDTH.on_circle(kappa, 1.0, nu, number)
        U1, U33 = circle.moment, circle.twisting
        twist = curved / kappa + kappa * psi
        form = (twist * weights) @ (U33 * twist - U1 * psi).T
        form, norm = (complement @ (matrix + matrix.T) @ complement.T for matrix in (form, (twist * weights) @ twist.T))
        factor = np.linalg.inv(np.linalg.cholesky(norm))
        return np.linalg.eigvalsh(factor @ form @ factor.T)[0]

    root = law_root(FINITE_WIDTH, {"nu": nu, "Gamma": number}, largest=0.99)
    assert brentq(lowest, root - 0.02, root + 0.004, xtol=1e-11) == pytest.approx(root, abs=1e-8)


needs_ccx = pytest.mark.skipif(shutil.which("ccx") is None, reason="CalculiX (ccx) is not installed")


@needs_ccx
@pytest.mark.full
def test_a_strip_of_solid_elements_loses_stability_where_the_law_says():
    """R/w = 4, w**2/(R h) = 75, on a coarse mesh: within 2 % of the law of finite width, whose own error is of order w/R."""
    outcome = solve(Case("thermal", 0.3, 4.0, 300.0, 30, 4, first=0.74, last=0.84, step=0.05))
    assert outcome.problem == ""
    assert outcome.root == pytest.approx(law_root(FINITE_WIDTH, {"nu": 0.3, "Gamma": 75.0}, largest=0.99), rel=0.02)


@pytest.mark.full
@needs_ccx
def test_both_ways_give_the_same_vibration():
    """The natural curvature bent away, and put in by expansion: a strip of w**2/(R h) = .25."""
    strip = Strip(0.3, 20.0, 5.0, 24, 2)
    answers = [run_ccx(deck, 60.0) for deck in (direct_deck(strip, [0.2]), thermal_deck(strip, 0.2))]
    assert [problem for _, problem in answers] == ["", ""]
    direct, thermal = (states(text, strip)[0] for text, _ in answers)
    assert direct.planar and thermal.planar
    assert direct.omega_squared == pytest.approx(thermal.omega_squared, rel=2e-3)
