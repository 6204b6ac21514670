"""Time contin and other tools on your machine: pictures, a table of ratios, and every number as JSON.

    python scripts/bench.py [like-for-like] [fold] [cost] [startup] [many] [stress] [cores] [cycles] [small]
                            [threads] [defaults] [problems] [accuracy] [--quick] [--out DIR] [--before DIR]

Errors are measured against the exact quadrature of the branches (``ribbon_model.exact``), never against another run. A tool
that is not installed is left out, and the output names it. See docs/performance.md.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import time
from pathlib import Path

SCRIPTS = Path(__file__).resolve().parent
sys.path[:0] = [str(SCRIPTS), str(SCRIPTS.parent)]

from benchmarks.measure import ONE_THREAD  # noqa: E402  (it imports nothing that counts threads)

os.environ.update(ONE_THREAD)

PARTS = (
    "like-for-like",
    "fold",
    "cost",
    "startup",
    "many",
    "stress",
    "cores",
    "cycles",
    "small",
    "threads",
    "defaults",
    "problems",
    "accuracy",
)


def arguments(argv=None) -> argparse.Namespace:
    """Return the parsed command line."""
    parser = argparse.ArgumentParser(prog="python scripts/bench.py", description=__doc__.splitlines()[0], allow_abbrev=False)
    parser.add_argument("parts", nargs="*", metavar="PART", help=f"what to run: {', '.join(PARTS)} (default: all)")
    parser.add_argument("--quick", action="store_true", help="few repeats: under two minutes instead of ten")
    parser.add_argument(
        "--out", metavar="DIR", default="bench", help="folder for bench.json, bench.md and pictures (default: bench)"
    )
    parser.add_argument(
        "--page", metavar="FILE", help="put the tables into this Markdown file, the pictures into images/ beside it"
    )
    parser.add_argument(
        "--before", metavar="DIR", help="a checkout of an earlier version, which `problems` times in turns with this one"
    )
    parser.add_argument(
        "--before-python", metavar="PATH", default=sys.executable, help="a Python interpreter for it (default: this one)"
    )
    options = parser.parse_args(argv)
    for part in options.parts:
        if part not in PARTS:
            parser.error(f"PART {part!r}: must be one of {', '.join(PARTS)}")
    if options.before and not (Path(options.before) / "contin").is_dir():
        parser.error(f"--before {options.before!r}: must be a folder with contin in it")
    if options.page and not Path(options.page).is_file():
        parser.error(f"--page {options.page!r}: must be an existing file")
    if Path(options.out).exists() and not Path(options.out).is_dir():
        parser.error(f"--out {options.out!r}: must be a folder")
    return options


def measure(part: str, options: argparse.Namespace) -> dict:
    """Run one part."""
    from benchmarks import accuracy, cores, cost, cycles, defaults, fold, like_for_like, many, problems, small, startup, stress
    from benchmarks import threads as blas

    from ribbon_model import exact

    quick = options.quick
    if part == "problems":
        return problems.run(quick, options.before, options.before_python)
    plain = (cost, startup, many, stress, cycles, small, blas, defaults, accuracy)
    plain = {each.__name__.partition(".")[2]: each for each in plain}
    if part in plain:
        return plain[part].run(quick)
    exact_fold = exact.folds(1, 2)[0].kappa_n
    if part == "cores":
        return cores.run(quick, exact_fold)
    if part == "fold":
        return fold.run(quick, exact_fold, budget=30 if quick else 150)
    return like_for_like.run(quick, exact_fold)


def main(argv=None) -> int:
    """Run the requested parts, and write the results."""
    options = arguments(argv)
    from benchmarks import cores, cycles, defaults, like_for_like, report
    from benchmarks.measure import machine

    results, out = {"machine": machine()}, Path(options.out)
    out.mkdir(parents=True, exist_ok=True)
    for part in options.parts or PARTS:
        began = time.perf_counter()
        print(f"{part} ...", end=" ", flush=True)
        results[part] = measure(part, options)
        print(f"{time.perf_counter() - began:.0f} s\n\n{report.markdown(results)[part]}\n")
        (out / "bench.json").write_text(json.dumps(results, indent=1))
    (out / "bench.md").write_text(report.page(results), encoding="utf-8")
    paths = report.pictures(results, Path(options.page).parent / "images" if options.page else out)
    if options.page:
        report.update(Path(options.page), results)
    print("written:", ", ".join(map(str, [out / "bench.json", out / "bench.md", *paths])))
    if "like-for-like" in results:
        ratio = like_for_like.ratio(results["like-for-like"])
        print(f"ratio per point, AUTO-07p / contin: {'AUTO-07p is not installed' if ratio is None else f'{ratio:.2f}'}")
    if "cores" in results:
        print(f"ratio for the long branch, one thread / two: {cores.ratio(results['cores']):.2f}")
    if "cycles" in results:
        found = cycles.ratio(results["cycles"])
        print(f"ratio per orbit, AUTO-07p / contin: {'AUTO-07p is not installed' if found is None else f'{found:.2f}'}")
    if "defaults" in results:
        print(f"worst default / best: {defaults.worst(results['defaults']):.2f}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
