"""A table of how the problems from outside come out: ``python -m bank.table`` (a minute).

``--all`` adds those of the other modules of the bank. For each run: how many special points there are (its end and the values
asked for included), how many were found, missed and invented; the largest error relative to max(1, |value|); and the largest
quotient of an error, less the uncertainty of its reference or round-off, and its estimate.
"""

from __future__ import annotations

import argparse
import importlib
import sys

from bank.case import Case, deviations, estimates, labelled
from contin import ContinError

OUTSIDE = "equilibria", "statics", "rods", "fields"
BANK = (
    "exp", "int", "bvp", "lin", "non", "ezp", "ext", "spb", "kar", "bru", "pd2",
    "cusp", "ab", "abc", "enz", "dd2", "lrz", "pp2", "opt",
)  # fmt: skip
#: A point this close to a known one, relative to max(1, |value|), is that point, if a bad value of it.
NEAR = 1e-4


def pairs(case: Case) -> tuple[list, int, int]:
    """Run a case; return its pairs of points and known special points, and how many were missed and invented."""
    try:
        found = labelled(case.run())
    except ContinError as error:
        print(f"{case.name}: {type(error).__name__}: {error}", file=sys.stderr)
        found = []
    matched = []
    for special in case.specials:
        point = next(
            (p for p in found if p.label == special.label and max(deviations(p, special).values(), default=0) < NEAR), None
        )
        if point is not None:
            found.remove(point)
            matched.append((point, special))
    return matched, len(case.specials) - len(matched), len(found)


def row(case: Case) -> tuple:
    """Return name, known, found, missed, invented, largest error, largest quotient of error and estimate."""
    matched, missed, invented = pairs(case)
    errors = [deviation for pair in matched for deviation in deviations(*pair).values()]
    quotients = [max(0.0, e.error - e.least) / e.estimate for pair in matched for e in estimates(*pair).values()]
    known = len(case.specials)
    return case.name, known, len(matched), missed, invented, max(errors, default=0.0), max(quotients, default=0.0)


def main(arguments=None):
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--all", action="store_true", help="the whole bank")
    names = (*OUTSIDE, *BANK) if parser.parse_args(arguments).all else OUTSIDE
    print(
        "| problem | special points | found | missed | invented | largest error | error / ± |", "|---|" + "---|" * 6, sep="\n"
    )
    rows = []
    for name in names:
        for case in importlib.import_module(f"bank.{name}").CASES:
            rows.append(row(case))
            print("| {} | {} | {} | {} | {} | {:.0e} | {:.1f} |".format(*rows[-1]), flush=True)
    sums = [sum(column) for column in list(zip(*rows))[1:5]]
    worst = [max(column) for column in list(zip(*rows))[5:]]
    print("| {} runs | {} | {} | {} | {} | {:.0e} | {:.1f} |".format(len(rows), *sums, *worst))
    return 1 if sums[2] or sums[3] else 0


if __name__ == "__main__":
    sys.exit(main())
