"""The sides of a saddle, and the lowest way out."""

from ribbon_model.barriers import Barrier, barriers, covering_index, sides
from ribbon_model.descent import descend
from ribbon_model.laws import FLAT_ROD
from ribbon_model.second_variation import circle
from ribbon_model.seeds import primary_branch
from ribbon_model.segments import discretized
from ribbon_model.solution import Solution


def test_a_saddle_lies_between_its_two_circles():
    """(1, 2) of the flat rod goes from one turn to three and is subcritical: its states separate the two."""
    from contin import Settings, trace
    from contin.lowlevel import point_of

    system, x, tangent = primary_branch(FLAT_ROD, 1, 2, 0.3, 8, 7)
    settings = Settings(trivial="M2", limits={"kappa_n": (-10, 10)}, zeros={"kappa_n": [3.0]}, errors=False)
    (point,) = trace(point_of(system, x), settings, tangent=tangent).labelled("UZ")
    saddle = Solution.of(point)
    assert saddle.index().index == 1
    first, last = sides(saddle.equilibrium())
    assert {covering_index(first), covering_index(last)} == {1, 3}


def test_a_circle_is_told_by_its_turns():
    strip = discretized(circle(FLAT_ROD, 0.3, 3, 3.0), 48)
    assert covering_index(strip) == 3 and covering_index(descend(strip).end) == 3


def test_the_lowest_saddle_counts_and_one_that_leads_back_does_not():
    saddles = [("back", 0.1, "a", "a"), ("high", 3.0, "a", "b"), ("low", 2.0, "b", "a"), ("out", 2.5, "c", None)]
    found = barriers([("a", 0.0), ("b", 1.0), ("c", 1.0), ("d", 1.0)], saddles)
    assert found == {"a": Barrier(2.0, "low", "b"), "b": Barrier(1.0, "low", "a"), "c": Barrier(1.5, "out", None)}
