"""The whole bank under other settings: ``python -m bank.stress`` (ten minutes). Prints what then differs.

Special points are properties of the problem: no step, angle or degree within reason may lose or invent one. A run that ends for
want of points is no error.
"""

from __future__ import annotations

import importlib
import sys
import time

import contin
from bank import case as cases
from bank.table import BANK, OUTSIDE

VARIANTS = (
    {"step": 0.01}, {"step": 0.5}, {"step": 2.0}, {"angle": 0.15}, {"angle": 0.7}, {"accuracy": 0.1}, {"accuracy": 0.005},
    {"max_step": 0.3}, {"degree": 3}, {"degree": 4}, {"degree": 8}, {"mesh": contin.MeshControl(tolerance=1e-9)},
    {"newton": contin.Newton(tolerance=1e-10)}, {"angle": 0.1, "step": 2.0}, {"accuracy": 0.1, "angle": 0.7, "step": 0.01},
    {"accuracy": 0.1, "angle": 0.2, "step": 0.3}, {"accuracy": 0.005, "step": 0.5}, {"angle": 0.5, "step": 5.0},
)  # fmt: skip


def changed(function, extra):
    """A function with options added."""

    def call(*args, **options):
        return function(*args, **{**options, **extra})

    return call


def modules(variant):
    """The bank's modules, loaded afresh, with these options in every run."""
    options = {name: value for name, value in variant.items() if name != "degree"}
    degree = {name: value for name, value in variant.items() if name == "degree"}
    for name in (*BANK, *OUTSIDE):
        sys.modules.pop(f"bank.{name}", None)
        module = importlib.import_module(f"bank.{name}")
        for place in (contin, cases):
            for what in ("trace", "curve", "run_until"):
                if what in vars(module) and what in vars(place):
                    setattr(module, what, changed(getattr(place, what), options))
        if degree and "solve" in vars(module):
            module.solve = changed(contin.solve, degree)
        yield module


def complaint(case) -> str:
    """Return one line that says how a run differs from its reference; empty if it does not."""
    try:
        branch = case.run()
    except (contin.ContinError, LookupError) as error:  # a point to start from is missing, too
        return f"{type(error).__name__}: {error}"
    found, wanted = cases.labelled(branch), case.specials
    if branch.stop.reason == "max points":
        found, wanted = found[:-1], wanted[: len(found) - 1]
    if [point.label for point in found] != [special.label for special in wanted]:
        return f"{[(point.label, point.name) for point in found]}; {branch.stop}"
    worst = max(max(cases.deviations(*pair).values(), default=0) for pair in zip(found, wanted))
    return f"off by {worst:.1e}" if worst > 1e-8 else ""


def main():
    for variant in VARIANTS:
        start, said = time.time(), []
        for module in modules(variant):
            said += [f"    {case.name}: {what[:200]}" for case in module.CASES if (what := complaint(case))]
        print(variant, f"{time.time() - start:.0f} s,", f"{len(said)} differ", *said, sep="\n" if said else " ", flush=True)


if __name__ == "__main__":
    main()
