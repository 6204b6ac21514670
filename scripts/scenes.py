"""Compute random scenes as `branches.run` does, and compare them with the exact solution.

    python scripts/scenes.py [--count 5000] [--seed 0] [--wide 300] [--workers 1] [--law LAW] [--nu LOW HIGH]

A scene is a law (ribbon, flat rod, isotropic rod), nu uniform in (-.99, .5), m and n up to 14, or up to 40 in ``--wide`` of the
scenes; invalid ones are drawn again. Scene number i depends on the seed and i only. Compared are, in order:

1. no label "possible", and no branch point on the way (the cell keeps the symmetry of one wavenumber);
2. the folds of kappa_n: their number, order and values;
3. the end: the circle of the linear theory (`ribbon_model.linear`) or the limit where the quadrature
   (`ribbon_model.exact`) ends the branch.

Each wrong scene is printed with the first difference. The last line says how many scenes were wrong, how many were not finished
(stopped between two points of the exact branch, with a reason that names no end), and the largest error of a fold or an end.

Exit code: 0 no scene is wrong, 1 some are, 2 bad usage.
"""

from __future__ import annotations

import argparse
import dataclasses
import math
import sys
import time
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from pydantic import ValidationError  # noqa: E402

from branches.scene.closed import ClosedScene  # noqa: E402
from branches.scene.closed_stage import is_threshold  # noqa: E402
from branches.scene.fields import ConfigError
from branches.scene.stages import stages_of
from contin import ConvergenceError, Point  # noqa: E402
from contin.lowlevel import Stop  # noqa: E402
from ribbon_model import exact  # noqa: E402
from ribbon_model.laws import PAPER_LAWS  # noqa: E402

NAMES = tuple(PAPER_LAWS)
#: A value further off than ten times its error estimate is wrong, if the difference is above round-off of the quadrature: this,
#: relative to 1 + its size (the quadrature's fold is stationary, its relative error some 1e-13).
ESTIMATES, ROUND_OFF = 10, 1e-11
#: Largest arclength between points of the exact branch, and the one with which it is walked again where a scene differs: the
#: exact folds are bracketed, and two of them could lie between two points.
STEP, FINE_STEP = 0.05, 0.005
#: Largest m and n of a scene, and of a wide one.
NARROW, WIDE = 14, 40


@dataclasses.dataclass(frozen=True)
class Result:
    """The result of a scene.

    Attributes
    ----------
    scene : str
    fault : str
        The first difference from the exact solution; empty if there is none.
    unfinished : str
        The reason why the run stopped too early; empty if it did not.
    error, estimate : float
        The largest error of a value, relative to 1 + its size, and the run's estimate of it, relative alike.
    seconds : float
    """

    scene: str
    fault: str
    unfinished: str
    error: float
    estimate: float
    seconds: float


# --- drawing --------------------------------------------------------------------------------------------------------


def draw(seed: int, number: int, largest: int, laws=NAMES, interval=(-0.99, 0.5)) -> ClosedScene:
    """Return the valid scene of this number, m and n up to ``largest``."""
    random = np.random.default_rng([seed, number])
    while True:
        law, nu = laws[random.integers(len(laws))], float(random.uniform(*interval))
        m, n = (int(value) for value in random.integers(1, largest + 1, 2))
        try:
            return ClosedScene(law=law, nu=nu, m=m, n=n)
        except ValidationError:
            continue


def is_wide(number: int, count: int, wide: int) -> bool:
    """Return whether the scene of this number is one of the ``wide``, evenly spread, among ``count``."""
    if wide == 0:
        return False
    return math.floor(math.ceil(number * wide / count) * count / wide) == number


# --- comparing ------------------------------------------------------------------------------------------------------


def compare(config: ClosedScene) -> Result:
    """Compute a scene and compare it with the exact solution."""
    began = time.perf_counter()
    name = f"{config.law} ({config.m}, {config.n}), nu = {config.nu!r}"
    limits = config.limits["kappa_n"]
    try:
        (stage,) = stages_of(config)
        run = stage.start()
        points = [stage.judge(point, run) for point in run if point.label]
    except (ConfigError, ConvergenceError) as error:
        return Result(name, "", str(error), 0.0, 0.0, time.perf_counter() - began)
    assert run.stop is not None
    fault, values = "", []
    for step in (STEP, FINE_STEP):
        try:
            expected = exact.curve(config.m, config.n, config.nu, limits, step, config.law)
        except RuntimeError as error:
            fault = f"no exact solution: {error}"
            continue
        fault, unfinished, values = differences(points, run.stop, expected, config)
        if not fault:
            break
    else:
        unfinished = ""
    error, estimate = max(values, default=(0.0, 0.0))
    return Result(name, fault, unfinished, error, estimate, time.perf_counter() - began)


def differences(points: list[Point], stop: Stop, expected: list, config: ClosedScene) -> tuple[str, str, list]:
    """Return the first difference, why the run is unfinished, and (error, estimate) of all values compared."""
    unfinished = "" if stop.reason in ("trivial branch", "limit") else str(stop)
    if unfinished and expected[-1].label == "MX":  # a homoclinic orbit, where no method can follow the branch
        unfinished = ""
    values: list[tuple[float, float]] = []
    possible = [point for point in points if point.name.startswith("possible")]
    if possible:
        return f"{possible[0].label} {possible[0].name!r} at {possible[0]['kappa_n']:.9g}", "", values
    others = [point for point in points[1:] if point.label == "BP"]
    if others:
        return f"a branch point at {others[0]['kappa_n']:.9g}", "", values
    folds = [point for point in points if point.label == "LP"]
    exact_folds = [point for point in expected if point.label == "LP"]
    if len(folds) > len(exact_folds) or (len(folds) < len(exact_folds) and not unfinished):
        found, known = ([f"{value:.10g}" for value in each] for each in (_kappas(folds), [p.kappa_n for p in exact_folds]))
        return f"folds at {', '.join(found) or 'no place'}; exact: {', '.join(known) or 'none'}", "", values
    pairs = [(point, value.kappa_n) for point, value in zip(folds, exact_folds)]
    if not unfinished:
        difference = _wrong_end(points[-1], stop, expected[-1], config)
        if difference:
            return difference, "", values
        if expected[-1].label != "MX":
            pairs.append((points[-1], expected[-1].kappa_n))
    for point, known in pairs:
        size, estimate = 1 + abs(known), point.errors.get("kappa_n", math.nan)
        error = abs(point["kappa_n"] - known)
        values.append((error / size, estimate / size))
        if not error <= ESTIMATES * estimate + ROUND_OFF * size:
            return f"{point.label} at {point['kappa_n']:.13g} ± {estimate:.1g}; exact: {known:.13g}", unfinished, values
    return "", unfinished, values


def _kappas(points: list[Point]) -> list[float]:
    return [point["kappa_n"] for point in points]


def _wrong_end(last: Point, stop: Stop, expected, config: ClosedScene) -> str:
    """Return how the end differs in kind from the exact one; empty if it does not."""
    if expected.label == "MX":
        return f"{stop}; exact: towards a homoclinic orbit at {expected.kappa_n:.9g}" if stop.reason == "trivial branch" else ""
    circle = expected.label == "BP"
    exact_end = f"{'the circle' if circle else 'the limit'} at kappa_n = {expected.kappa_n:.12g}, {expected.kappa_star:.9g}"
    ends = f"ends at kappa_n = {last['kappa_n']:.12g}, kappa_star = {last['kappa_star']:.9g} ({stop}); exact: {exact_end}"
    if circle != (stop.reason == "trivial branch"):
        return ends
    if abs(last["kappa_star"] - expected.kappa_star) > 1e-6 * (1 + abs(expected.kappa_star)):
        return ends
    if circle and not is_threshold(config, round(expected.kappa_star), expected.kappa_n, 0.0):
        return f"the quadrature's end {expected.kappa_n:.12g} is none of the linear theory"
    return ""


# --- all of them ----------------------------------------------------------------------------------------------------


def results(configs: Iterator[ClosedScene], workers: int) -> Iterator[Result]:
    """Yield the result of every scene, in order."""
    if workers == 1:
        yield from map(compare, configs)
        return
    with ProcessPoolExecutor(workers) as pool:
        yield from pool.map(compare, configs, chunksize=4)


def main(arguments: list[str] | None = None) -> int:
    """Run the command; return its exit code."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--count", type=int, default=5000, help="scenes (5000)")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--wide", type=int, default=300, help="number of scenes with m and n up to 40 (300)")
    parser.add_argument("--workers", type=int, default=1, help="processes")
    parser.add_argument("--first", type=int, default=0, help="number of the first scene")
    parser.add_argument("--law", action="append", choices=NAMES, help="only this law; may be repeated")
    parser.add_argument("--nu", type=float, nargs=2, default=(-0.99, 0.5), metavar=("LOW", "HIGH"))
    options = parser.parse_args(arguments)
    if min(options.count, options.workers) < 1 or min(options.wide, options.first) < 0:
        parser.error("count and workers must be at least 1, wide and first at least 0")
    laws = tuple(options.law or NAMES)
    numbers = range(options.first, options.first + options.count)
    sizes = (WIDE if is_wide(i, options.count, options.wide) else NARROW for i in numbers)
    configs = (draw(options.seed, i, size, laws, tuple(options.nu)) for i, size in zip(numbers, sizes))
    wrong = unfinished = 0
    worst, began = (0.0, 0.0), time.monotonic()
    moving = sys.stderr.isatty()
    for count, result in enumerate(results(configs, options.workers), 1):
        wrong, unfinished = wrong + bool(result.fault), unfinished + bool(result.unfinished and not result.fault)
        if result.fault:
            print(f"WRONG {result.scene}: {result.fault}", flush=True)
        else:
            worst = max(worst, (result.error, result.estimate))
        if result.unfinished and not result.fault:
            print(f"not finished {result.scene}: {result.unfinished}", flush=True)
        if moving or count % 500 == 0:
            line = f"{count} of {options.count}, {wrong} wrong, {unfinished} not finished, {time.monotonic() - began:.0f} s"
            print(f"\r{line}", end="" if moving else "\n", file=sys.stderr, flush=True)
    if moving:
        print(file=sys.stderr)
    print(
        f"{options.count} scenes: {wrong} wrong, {unfinished} not finished, "
        f"worst error {worst[0]:.1e} (its ± {worst[1]:.1e}), relative to 1 + the value's size"
    )
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
