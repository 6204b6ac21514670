"""Demos with equilibria and boundary value problems. The statements and the values by a third method are those of the bank."""

from __future__ import annotations

import functools
import importlib
from collections.abc import Callable, Sequence

from side_by_side.record import Demo, Part


def bank(name: str):
    """Return a module of the bank of reference problems, tests/contin/bank."""
    return importlib.import_module(f"bank.{name}")


def known(name: str, columns: dict) -> Callable[[], list]:
    """Return the values that the bank knows of all special points of a problem, by AUTO's columns."""
    found = []
    for case in bank(name).CASES:
        for special in case.specials:
            label = "UZ" if special.label == "EP" else special.label
            found.append((label, {theirs: special.values[c] for theirs, c in columns.items() if c in special.values}))
    return found


def part(name: str, runs: Sequence[int], columns: dict, branches: Callable | None = None, **more) -> Part:
    """Return a part whose branches are the runs of the bank's cases of that name, and whose values the bank knows."""
    if branches is None:
        branches = functools.partial(all_cases, name)
    return Part(runs, branches, columns, known=known(name, columns), **more)


def all_cases(name: str) -> list:
    """Return the branches of all cases of a problem."""
    return [case.run() for case in bank(name).CASES]


def demos() -> list[Demo]:
    """Return the demos."""
    return [
        Demo("exp", "Bratu's problem", [part("exp", [0], {"lambda": "lam", "INTEGRAL u": "mean"})]),
        Demo("int", "a boundary and an integral condition", [part("int", [0, 2], {"PAR(1)": "p1", "PAR(2)": "p2"})]),
        Demo("bvp", "a nonlinear eigenvalue problem", [part("bvp", range(11), {"PAR(1)": "lam", "PAR(2)": "mean"})]),
        Demo("lin", "a linear eigenvalue problem", [part("lin", [0, 1], {"PAR(1)": "lam", "PAR(3)": "p3"})]),
        Demo("non", "a problem that depends on t", [part("non", [0], {"PAR(1)": "p1"})]),
        Demo("ezp", "Bratu's problem for complex states", [part("ezp", [0, 1, 2], {"PAR(1)": "lam"})]),
        Demo("ext", "spurious solutions on a coarse mesh", [part("ext", [0, 1], {"PAR(1)": "lam"})]),
        Demo("kar", "von Karman's flow above a rotating disk", [part("kar", [0], {"PAR(1)": "gam", "PAR(2)": "inf"})]),
        Demo("cusp", "the cusp", [part("cusp", [0, 1, 2, 3], {"mu": "mu", "lambda": "lam", "x": "X"})]),
        Demo("enz", "two cells with an enzyme", [part("enz", [0], {"s0": "s0", "s1": "S1"})]),
    ]
