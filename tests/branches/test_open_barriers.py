"""Barriers in the report of a run of an open strip."""

import numpy as np
import pytest

from branches.read import read_branch
from branches.run import __main__ as run
from branches.run.barriers import places, report, states_at
from branches.run.display import Display
from branches.run.runner import run_scene
from branches.scene.parse import load, parse


@pytest.fixture(scope="module")
def twisted(tmp_path_factory, root):
    path = tmp_path_factory.mktemp("barriers") / "open_barriers.h5"
    assert run_scene(load(root / "configs" / "open_barriers.yaml"), path, Display(silent=True)) == "complete"
    return read_branch(path)


@pytest.mark.full
def test_barriers_are_differences_of_the_potential(twisted):
    """Of points that the run has located at this turn: two states beside a saddle at 5.5, one and its image at 3."""
    located = {}
    for event in twisted.events[twisted.events["label"] == b"UZ"]:
        located.setdefault((round(float(event["turn"]), 6), int(event["index"])), []).append(float(event["potential"]))
    both, one = places(twisted)
    assert [twisted.points["turn"][place.row] for place in (both, one)] == pytest.approx([5.5, 3.0])
    (saddle,) = located[5.5, 1]
    heights = sorted(way.height for way in both.ways.values())
    assert heights == pytest.approx(sorted(saddle - energy for energy in located[5.5, 0]), rel=1e-8)
    stable = {state.name for state in both.states if state.index == 0}
    assert {way.behind for way in both.ways.values()} == stable == set(both.ways)
    ((name, way),) = one.ways.items()
    assert (
        way.height == pytest.approx(located[3.0, 1][0] - located[3.0, 0][0], rel=1e-8) and way.behind == f"an image of {name}"
    )


@pytest.mark.full
def test_the_report_is_in_joules(twisted):
    """B/L of the plate times the energies."""
    lines, unit = report(twisted), 200e9 * 0.0005**3 * 0.01 / (12 * (1 - 0.3**2)) / 0.4
    assert lines[:2] == ["to leave stable states, energies in J:", "  turn = 5.5 rad of stage 2:"]
    stable = twisted.events[(twisted.events["label"] == b"UZ") & (twisted.events["index"] == 0)]
    energies = [f"energy {event['potential'] * unit:.6g}: push" for event in stable if abs(event["turn"] - 5.5) < 1e-9]
    assert len(energies) == 2 and all(any(energy in line for line in lines[2:4]) for energy in energies)


@pytest.mark.full
def test_all_states_at_the_numbers_of_a_point(twisted):
    """At 5.5 the file has one state of stage 2 and three of stage 3; they are at rest, and have this turn."""
    rows = twisted.events[(twisted.events["label"] == b"UZ") & (twisted.events["stage"] == 3)]["point"]
    row = int(next(row for row in rows if abs(twisted.points["turn"][row] - 5.5) < 1e-9))
    states = states_at(twisted, row)
    assert sorted(state.index for state in states) == [0, 0, 1, 2]
    for state in states:
        assert state.point["turn"] == pytest.approx(5.5) and np.abs(state.point.system.residual(state.point.x)).max() < 1e-9


@pytest.mark.full
def test_nothing_is_printed_without_a_saddle(call, tmp_path):
    """A tip load below the critical one: the straight strip alone is stable."""
    text = "material: {law: flat rod, nu: 0.3}\nfinish: free\nstages: [{follow: force_width, to: -2}]\n"
    (tmp_path / "tip.yaml").write_text(text)
    assert parse(text, "tip").stages[0].to == -2
    done = call(run.main, "tip.yaml")
    assert done.returncode == 0 and done.out.endswith("written to tip.h5\n")
