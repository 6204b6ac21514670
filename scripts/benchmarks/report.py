"""Pictures of the results, and the Markdown that goes with them."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from benchmarks import accuracy, cores, cost, cycles, defaults, fold, like_for_like, many, problems, small, startup, stress
from benchmarks import threads as blas
from contin.lowlevel import PALETTE

TITLES = {
    "like-for-like": "Like for like",
    "fold": "Tool for tool: the fold of (1, 2)",
    "cost": "Cost laws",
    "startup": "Start-up",
    "many": "Many branches",
    "stress": "Numerical stability",
    "cores": "Two cores",
    "cycles": "Cycles",
    "small": "Small problems",
    "threads": "Threads of BLAS",
    "defaults": "Default degree",
    "problems": "New problems",
    "accuracy": "Error against time",
}
TABLES = {
    "like-for-like": like_for_like.table,
    "fold": fold.table,
    "cost": cost.table,
    "startup": startup.table,
    "many": many.table,
    "stress": stress.table,
    "cores": cores.table,
    "cycles": cycles.table,
    "small": small.table,
    "threads": blas.table,
    "defaults": defaults.table,
    "problems": problems.table,
    "accuracy": accuracy.table,
}


def markdown(results: dict) -> dict[str, str]:
    """Return a block of Markdown for the machine and for every part that was run."""
    machine = dict(results["machine"])
    load = machine.pop("load_at_start")
    text = ", ".join(f"{name} {value}" for name, value in machine.items())
    blocks = {"machine": f"{text}; one thread; load when it began {load:.1f}." if load is not None else f"{text}; one thread."}
    for part, table in TABLES.items():
        if part in results:
            blocks[part] = table(results[part])
            skipped = results[part].get("skipped", {})
            if skipped:
                blocks[part] += "\n\nNot run: " + "; ".join(f"{name} ({reason})" for name, reason in skipped.items()) + "."
    if blocks.get("like-for-like") and (ratio := like_for_like.ratio(results["like-for-like"])) is not None:
        blocks["like-for-like"] += f"\n\nRatio per point, AUTO-07p / contin: {ratio:.2f}."
    return blocks


def page(results: dict) -> str:
    """Return the whole as one Markdown document."""
    blocks = markdown(results)
    parts = [f"## {TITLES[part]}\n\n{text}\n" for part, text in blocks.items() if part != "machine"]
    return "\n".join([f"# Benchmark\n\n{blocks['machine']}\n", *parts])


def update(path: Path, results: dict) -> None:
    """Put the blocks into a document, between ``<!-- bench: PART -->`` and ``<!-- end -->``.

    Raises
    ------
    ValueError
        The document has no place for a block.
    """
    text = path.read_text(encoding="utf-8")
    for part, block in markdown(results).items():
        pattern = re.compile(rf"(<!-- bench: {part} -->\n).*?(<!-- end -->)", re.DOTALL)
        if not pattern.search(text):
            raise ValueError(f"{path}: has no place for {part} (<!-- bench: {part} --> ... <!-- end -->)")
        text = pattern.sub(lambda match, block=block: match[1] + block + "\n" + match[2], text)
    path.write_text(text, encoding="utf-8")


#: Symbols of tools: colours alone do not tell them apart on a grey printer.
_MARKERS = ("o", "s", "^", "D", "v", "P", "X")
#: The lightest shade of degrees, of viridis: lighter lines are hard to see on white paper.
_LIGHTEST = 0.9


def pictures(results: dict, folder: Path) -> list[Path]:
    """Draw the results; return the files."""
    import matplotlib
    from cycler import cycler

    matplotlib.use("Agg")
    matplotlib.rcParams["axes.prop_cycle"] = cycler(color=[*PALETTE])
    folder.mkdir(parents=True, exist_ok=True)
    drawers = {"fold": ("bench-fold.png", _fold), "cost": ("bench-cost.png", _cost)}
    paths = []
    for part, (name, draw) in drawers.items():
        if part in results:
            paths.append(_saved(draw(results[part]), folder / name))
    if "accuracy" in results:
        paths.append(_saved(_accuracy(results["accuracy"], results.get("fold")), folder / "bench-accuracy.png"))
    if "cost" in results:
        paths.append(_saved(_errors(results["cost"]["errors"]), folder / "bench-errors.png"))
    return paths


def _saved(figure, path: Path) -> Path:
    figure.savefig(path, dpi=130, bbox_inches="tight")
    return path


def _plain(axis, values):
    """Set the ticks of a logarithmic axis at these values, written as numbers."""
    axis.set_ticks(values, [f"{value:g}" for value in values])
    axis.set_ticks([], minor=True)


def _fold(results):
    from matplotlib.figure import Figure

    figure = Figure(figsize=(13, 4.5), layout="constrained")
    tools = list(dict.fromkeys(row["tool"] for row in results["rows"]))
    for axes, key, title in zip(
        figure.subplots(1, 2, sharey=True), ("seconds", "process_seconds"), ("in the process, warm", "whole processes")
    ):
        for number, tool in enumerate(tools):
            _front(axes, [(row[key], max(row["error"], 1e-16)) for row in results["rows"] if row["tool"] == tool], number, tool)
        axes.set(xlabel=f"seconds, {title}", title=title)
        axes.grid(alpha=0.3)
    figure.axes[0].set_ylabel("error of $\\kappa_n$ at the fold of (1, 2)")
    figure.legend(*figure.axes[0].get_legend_handles_labels(), loc="outside right upper", fontsize=8)
    return figure


def _accuracy(results, of_fold):
    """The problems of `benchmarks.accuracy`, and the fold of (1, 2) where that part was run, too."""
    from matplotlib.figure import Figure

    panels = {problem: found["rows"] for problem, found in results["problems"].items()}
    if of_fold is not None:
        tools = {fold.CELL: accuracy.CONTIN, fold.AUTO_CELL: accuracy.AUTO, fold.SCIPY: accuracy.SCIPY}
        rows = [row for row in of_fold["rows"] if row["tool"] in tools]
        panels["the fold of a ribbon"] = [
            row | {"tool": tools[row["tool"]], "error": max(row["error"] / of_fold["exact_fold"], 1e-15)} for row in rows
        ]
    figure = Figure(figsize=(1 + 3.6 * len(panels), 3.8), layout="constrained")
    for axes, (problem, rows) in zip(figure.subplots(1, len(panels), sharey=True), panels.items()):
        for number, tool in enumerate((accuracy.CONTIN, accuracy.AUTO, accuracy.SCIPY)):
            _front(axes, [(1e3 * row["seconds"], row["error"]) for row in rows if row["tool"] == tool], number, tool)
        (low, high), ticks = axes.get_xlim(), (digit * decade for decade in (0.1, 1, 10, 100, 1000) for digit in (1, 2, 5))
        _plain(axes.xaxis, [tick for tick in ticks if low < tick < high])
        axes.set(xlabel="time, ms", title=problem)
        axes.grid(alpha=0.3)
    figure.axes[0].set_ylabel("relative error of the parameter")
    figure.legend(*figure.axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=3, fontsize=8)
    return figure


def _front(axes, places, number, tool):
    """Draw all settings of a tool, and a line through those that no faster one beats."""
    places = sorted(places)
    colour, marker = PALETTE[number % len(PALETTE)], _MARKERS[number % len(_MARKERS)]
    best = [place for at, place in enumerate(places) if place[1] < min((e for _, e in places[:at]), default=np.inf)]
    axes.set(xscale="log", yscale="log")
    for some, style, strength in ((places, marker, 0.3), (best, f"{marker}-", 1.0)):
        if some:
            axes.plot(*zip(*some), style, color=colour, alpha=strength, markersize=4, label=tool if some is best else None)


def _cost(results):
    from matplotlib.figure import Figure

    figure = Figure(figsize=(13, 3.8), layout="constrained")
    time, size, degree, rate = figure.subplots(1, 4)
    for axes, rows, key, power, label in (
        (time, results["intervals"], "intervals", 1, "intervals (n = 7, degree 4)"),
        (size, results["components"], "n", 3, "components n (20 intervals, degree 4)"),
        (degree, results["degree"], "degree", 3, "degree (40 intervals, n = 7)"),
    ):
        x = [row[key] for row in rows]
        axes.loglog(x, [1e3 * row["linearize"] for row in rows], "o-", label="linearize")
        axes.loglog(x, [1e3 * row["solve"] for row in rows], "s-", label="solve")
        axes.loglog(x, [row["bytes_held"] / 1e6 for row in rows], "^:", label="memory, MB", color="gray")
        guide = [1e3 * rows[-1]["linearize"] * (value / x[-1]) ** power for value in x]
        axes.loglog(x, guide, "k--", linewidth=0.8, label=f"power {power}")
        axes.set(xlabel=label)
        _plain(axes.xaxis, x)
        axes.legend(fontsize=7)
    time.set_ylabel("ms")
    rows = results["components"]
    rate.loglog(
        [row["n"] * row["degree"] for row in rows], [row["gflops"] for row in rows], "o-", label="contin, one linearization"
    )
    for name in ("dgetrf", "dgemm"):
        rate.loglog(
            [row["size"] for row in results["blas"]],
            [row[f"{name}_gflops"] for row in results["blas"]],
            "--",
            label=f"LAPACK {name}",
        )
    _plain(rate.xaxis, [row["size"] for row in results["blas"]])
    rate.set(xlabel="size of a block, n × degree", ylabel="GFlop/s")
    rate.legend(fontsize=7)
    return figure


def _errors(cases):
    from matplotlib import colormaps
    from matplotlib.figure import Figure

    figure = Figure(figsize=(13, 3.8), layout="constrained")
    shades = colormaps["viridis"](np.linspace(0, _LIGHTEST, 7))
    for axes, case in zip(figure.subplots(1, len(cases), sharey=True), cases):
        for shade, degree in zip(shades, range(2, 9)):
            for adapted, style in ((False, ":"), (True, "-")):
                rows = [row for row in case["rows"] if row["degree"] == degree and row["adapted"] == adapted]
                label = f"degree {degree}" if adapted else None
                axes.loglog(
                    [row["intervals"] for row in rows],
                    [max(row["error"], 1e-16) for row in rows],
                    style,
                    color=shade,
                    label=label,
                )
        axes.set(xlabel="intervals", title=case["name"])
        _plain(axes.xaxis, [5, 10, 20, 40, 80, 160])
        axes.grid(alpha=0.3)
    figure.axes[0].set_ylabel("error of $\\kappa^*$ (dotted: uniform mesh)")
    figure.axes[0].legend(fontsize=7)
    return figure
