"""``python -m branches.curve RESULT --against NAME``: the folds of a result against a second number of its scene."""

from __future__ import annotations

from branches.store import interrupt

if __name__ == "__main__":  # before the imports below, which take a second
    interrupt.begin("no curve was written")

import dataclasses
import sys
from pathlib import Path

import numpy as np

from branches.draw.style import NU, smooth
from branches.export.__main__ import labelled_point
from branches.scene.fields import ConfigError
from branches.store.branch import StoredBranch
from branches.store.command import Parser, complain, write_output
from branches.store.files import StoreError, check_name, prepare, write_bytes, write_picture
from branches.store.read import read_branch
from contin import Branch, ContinError, curve
from contin.lowlevel import Label, one_of, point_of


def parser() -> Parser:
    """Return the command line."""
    parser = Parser("curve", "Follow a fold in two numbers: that of the branch, and another one, such as nu, Gamma or a load.")
    parser.add_argument("result", metavar="RESULT", help="a branch file")
    parser.add_argument("--against", metavar="NAME", required=True, help="the second number")
    parser.add_argument("--between", nargs=2, type=float, metavar=("LOW", "HIGH"), required=True, help="ends of the curve")
    parser.add_argument("--point", default="LP", help="the fold: its number among labelled points (default: the only one)")
    parser.add_argument("-o", "--out", metavar="FILE", help="table (.csv) or picture (.pdf, .png, .svg) to write")
    return parser


def follow(branch: StoredBranch, point: int, second: str, between) -> Branch:
    """Return the curve of folds through a kept point; raise ConfigError for no fold, or a number that cannot be followed."""
    system, x = branch.discretized(point)
    if branch.points["label"][point].decode() != Label.FOLD:
        raise ConfigError("--point: must be a fold (LP); its number is in the column LAB of the run")
    numbers = getattr(branch.scene, "law_parameters", system.problem.parameters)  # not the length of a closed strip, which is 1
    known = [name for name in branch.columns.shown() if name in numbers and name not in system.free]
    if second not in known:
        raise ConfigError(f"--against: {one_of(second, known)}")
    (low, high), here = sorted(end / branch.scene.factor(second) for end in between), system.parameter(x, second)
    if not low <= here <= high or low == high:
        raise ConfigError(f"--between: must hold the value of the result, {second} = {here * branch.scene.factor(second):g}")
    start = dataclasses.replace(point_of(system, x), label=Label.FOLD, column=system.free[0])
    return curve(start, second, direction="both", limits={second: (low, high)}, progress=False)


def main(argv=None) -> int:
    """Follow; return the exit code."""
    options = parser().parse_args(argv)
    try:
        out = Path(options.out or "folds.csv")
        check_name(out, (".csv", ".pdf", ".svg", ".png"))
        prepare(out)
        branch = read_branch(options.result)
        if Label.FOLD not in (labels := [label.decode() for label in branch.events["label"]]):
            raise ConfigError(f"{options.result!r} has no fold (LP) to follow; its labelled points are {', '.join(labels)}")
        point = labelled_point(branch, options.point)
        found = follow(branch, point, options.against, options.between)
        names = options.against, branch.followed(branch.stage_of[point])
        s = np.array([one.arclength for one in found])
        values = [np.array([one[name] for one in found]) * branch.scene.factor(name) for name in names]
        lines = [f"{x:.10g},{y:.10g},{one.label}\n" for x, y, one in zip(*values, found)]
        table = f"{','.join(map(branch.titled, names))},label\n{''.join(lines)}"
        if out.name.endswith(".csv"):
            write_bytes(out, table.encode()) if options.out else write_output(table)
        else:
            from matplotlib.figure import Figure

            axes = (figure := Figure(figsize=(6, 4.2), layout="constrained")).subplots()
            axes.plot(*smooth(s, s, *values)[1:], color="black")
            across, up = (branch.axis(name)[1] for name in names)
            axes.set(xlabel=across, ylabel=up, title=f"folds of {branch.caption.partition(f', {NU}')[0]}")
            write_picture(figure, out)
    except (ConfigError, StoreError, ContinError) as error:
        complain(f"error: {error}")
        return 2
    ends = values[0].min(), values[0].max()
    why = "" if np.allclose(ends, sorted(options.between)) else f" ({found.stop})"
    told = f"{len(found)} folds, {branch.titled(names[0])} from {ends[0]:.6g} to {ends[1]:.6g}{why}\nwritten to {out}\n"
    write_output(told if options.out else "")
    return 0


if __name__ == "__main__":
    sys.exit(interrupt.run(main))
