"""Random problems with known branch points: every one on a trivial branch must be labelled, or noted.

    python scripts/stress.py [--count 500] [--seed 0] [--first 0] [--most 30] [--verbose]

A problem is F(u, lam) = lam v - A v + q v^2 - c v^3 with v = u - lam d: the branch u = lam d has branch points exactly at the
eigenvalues of A, of the dimension of their multiplicity. The eigenvalues are chosen, the eigenvectors are random, orthogonal or
not. Number and size of the states, gaps, first steps and limits differ from problem to problem. A branch point is

- right, if its parameter is the eigenvalue, its dimension the multiplicity, and its error within ten times its ±;
- noted, if it has no label, and a note of the branch names an interval around it, or if its ± is not known, which a note says;
- missed, invented or wrong otherwise.

A cluster of eigenvalues may be labelled as one point if the error of that covers it.

Every fourth problem is a column (Euler's elastica with three kinds of ends) in place of that, of a degree from 2 to 7 or the
default one. Its branches are known too: at one of its branch points it is turned from, either way, and must not return to the
straight column nor meet anything; where it ends, the load must be that of the largest angle. Unknowns have sizes from 1e-9 to
1e9.

The exit code is 1 if anything is missed,
invented or wrong. A problem that takes more than 4 GB in all fails.
"""

from __future__ import annotations

import argparse
import collections
import functools
import math
import re
import resource
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.special import ellipk

sys.path[:0] = [str(Path(__file__).resolve().parent.parent)]

import contin  # noqa: E402

#: Numbers of states: a dense matrix each; of the last, eigenvalues are looked for by iteration.
SIZES = (2, 3, 4, 6, 9, 14, 30)
#: Kinds of spectrum.
KINDS = ("simple", "double", "several double", "column", "triple", "clustered", "grid", "column")
#: Ends of columns: whether the angle is held at either, and the number of the loads (pi place)^2 that begins with so much.
ENDS = {"clamped and free": ((True, False), 0.5), "pinned": ((False, False), 1.0), "clamped": ((True, True), 1.0)}
#: Degrees of collocation of columns; None for the default.
DEGREES = (None, 2, 3, 4, 5, 6, 7)
#: The load at the end of a branch differs from that of the largest angle by this part at most; mesh and limits leave less.
_LOAD_ERROR = 1e-6
#: Largest size of the process in bytes: 500 problems of 30 states take 0.22 GB, of which 0.12 GB are compiled code and modules.
#: Ten times more would let a machine swap before anybody sees it.
MEMORY = 4 * 2**30
#: An error may be so many times its estimate, as in the bank of reference problems; and this is round-off of eigenvectors.
UNDERRATED, ROUND_OFF = 10.0, 1e-9


@dataclass(frozen=True)
class Column:
    """One random column: angle'' = -(lam / load) sin(angle / unit) unit, and how it is run."""

    number: int
    ends: str
    degree: int | None
    load: float
    unit: float
    last: int  # loads below the limit
    turned: int  # which of them is turned from
    direction: int
    kind: str = "column"

    @property
    def spectrum(self) -> np.ndarray:
        """The loads, those and the next."""
        return self.load * (np.pi * (ENDS[self.ends][1] + np.arange(self.last + 1))) ** 2

    @property
    def limit(self) -> float:
        """Between the last load and the next one."""
        return float(np.mean(self.spectrum[-2:]))

    def describe(self) -> str:
        """Return the problem in one line."""
        return (f"{self.number}: column, {self.ends}, degree {self.degree}, load {self.load:.3g}, unit {self.unit:.3g}, "
                f"{self.last} loads, from number {self.turned} in direction {self.direction}")  # fmt: skip

    def statement(self) -> contin.BoundaryValueProblem:
        """Return the problem: states angle and moment, the parameter lam, both in their units."""
        held, (load, unit) = ENDS[self.ends][0], (self.load, self.unit)

        def bent(t, u, p):
            return u.moment, -p.lam / load * unit * math.sin(u.angle / unit)

        def conditions(a, b, p):
            return tuple(end.angle if is_held else end.moment for end, is_held in zip((a, b), held))

        return contin.BoundaryValueProblem(bent, conditions, ["angle", "moment"], {"lam": 0.01 * load})


@dataclass(frozen=True)
class Random:
    """One random problem: its spectrum, and how it is run."""

    number: int
    kind: str
    spectrum: np.ndarray
    symmetric: bool
    dynamics: bool
    coefficients: tuple[float, float, float]  # q, c, size of d
    limit: float
    step: float

    @property
    def matrix(self) -> np.ndarray:
        """A, shape (n, n)."""
        random, n = np.random.default_rng([self.number, 1]), len(self.spectrum)
        if self.symmetric:
            basis = np.linalg.qr(random.standard_normal((n, n)))[0]
        else:
            basis = np.eye(n) + 0.3 * random.standard_normal((n, n)) / np.sqrt(n)
        return basis @ np.diag(self.spectrum) @ np.linalg.inv(basis)

    def describe(self) -> str:
        """Return the problem in one line."""
        shape = "symmetric" if self.symmetric else "not symmetric"
        return f"{self.number}: {self.kind}, {len(self.spectrum)} states, {shape}, limit {self.limit:.3g}, step {self.step:.3g}"


def problems(count: int, seed: int, first: int = 0, most: int = SIZES[-1]) -> list[Random | Column]:
    """Return random problems of at most so many states; each depends on its number, that and the seed alone."""
    return [_problem(number, seed, most) for number in range(first, first + count)]


def _problem(number: int, seed: int, most: int) -> Random | Column:
    random = np.random.default_rng([seed, number])
    if KINDS[number % len(KINDS)] == "column":
        last = int(random.integers(1, 5))
        return Column(
            number, str(random.choice(list(ENDS))), DEGREES[random.integers(len(DEGREES))], *10 ** random.uniform(-9, 9, 2),
            last, int(random.integers(last)), int(random.choice([-1, 1])),
        )  # fmt: skip
    kind, n = KINDS[number % len(KINDS)], int(random.choice([size for size in SIZES if size <= most]))
    if kind == "triple":
        n = max(n, 3)
    size, state = 10 ** random.uniform(-9, 9, 2)
    spectrum = np.sort(size * random.uniform(0.1, 1, n))
    if kind == "double":
        at = random.integers(n - 1)
        spectrum[at + 1] = spectrum[at]
    elif kind == "several double":
        spectrum[1::2] = spectrum[: n - n % 2 : 2]
    elif kind == "triple":
        at = random.integers(n - 2)
        spectrum[at : at + 3] = spectrum[at]
    elif kind == "clustered":
        spectrum[1::2] = spectrum[: n - n % 2 : 2] * (1 + 10 ** random.uniform(-6, -1, n // 2))
        spectrum = np.sort(spectrum)
    elif kind == "grid":  # of m x m places, with its double eigenvalues
        m = max(2, int(np.sqrt(n)))
        one = np.sin(np.arange(1, m + 1) * np.pi / (2 * m + 2)) ** 2
        spectrum = np.sort(size * (one[:, None] + one).ravel())
    coefficients = (random.choice([0.0, 1.0]) * size / state, size / state**2, random.choice([0.0, 0.5]) * state)
    limit = float(spectrum.max() * random.choice([0.7, 1.2, 3.0, 30.0]))
    step = float(random.choice([0.05, 0.5, np.clip(0.1 * spectrum.max(), 1e-5, 1e5)]))
    return Random(number, kind, spectrum, bool(random.integers(2)), bool(random.integers(2)), coefficients, limit, step)


def _residual(u, p, out):
    n = len(u)
    for i in range(n):
        v = u[i] - p[3 + i] * p[0]
        out[i] = p[0] * v + p[1] * v * v - p[2] * v**3
        for k in range(n):
            out[i] -= p[3 + n + i * n + k] * (u[k] - p[3 + k] * p[0])


@functools.cache
def statement(n: int, dynamics: bool) -> contin.AlgebraicProblem:
    """Return the problem of n states; parameters are lam, q, c, d and A."""
    names = ["lam", "q", "c", *(f"d{i}" for i in range(n)), *(f"a{i}_{j}" for i in range(n) for j in range(n))]
    return contin.AlgebraicProblem(_residual, n, dict.fromkeys(names, 0.0), dynamics=dynamics)


def branch_of(problem: Random | Column) -> contin.Branch:
    """Follow the trivial branch from lam = 0 to its limit."""
    if isinstance(problem, Column):
        start = contin.solve(problem.statement(), [0.0, 0.0], degree=problem.degree)
        return contin.trace(start, free=["lam"], limits={"lam": (0, problem.limit)}, progress=False)
    n, matrix = len(problem.spectrum), problem.matrix
    q, c, drift = problem.coefficients
    d = drift * np.random.default_rng([problem.number, 2]).standard_normal(n) / problem.spectrum.max()
    values = {"lam": 0.0, "q": q, "c": c} | {f"d{i}": d[i] for i in range(n)}
    values |= {f"a{i}_{j}": matrix[i, j] for i in range(n) for j in range(n)}
    start = contin.solve(statement(n, problem.dynamics), [0.0] * n, values)
    return contin.trace(start, free=["lam"], limits={"lam": (-1, problem.limit)}, step=problem.step, progress=False)


def _noted(branch: contin.Branch) -> list[tuple[float, float]]:
    """Return the intervals that the notes name."""
    found = re.findall(r"between lam = (\S+) and ([^\s)]+)", " ".join(branch.notes))
    return [(min(map(float, pair)), max(map(float, pair))) for pair in found]


def turned(problem: Column, branch: contin.Branch) -> list[tuple[str, str]]:
    """Return what is wrong with the branch that is turned from."""
    point = min(branch.labelled("BP"), key=lambda point: abs(point["lam"] - problem.spectrum[problem.turned]))
    bent = contin.trace(
        point, branch=1, direction=problem.direction, limits={"lam": (0, 1.5 * point["lam"])}, progress=False
    )  # fmt: skip
    result = [
        ("invented", f"{each.label} at {each['lam']:.9g} where it is bent")
        for each in bent.points[1:]
        if each.label not in ("", "EP")
    ]
    end = bent.points[-1]
    angle, moment = end.system.states(end.x)[0] / problem.unit
    height = moment**2 / (2 * end["lam"] / problem.load) + 1 - math.cos(angle)  # the same all along: 1 - cos(largest angle)
    load = problem.spectrum[problem.turned] * (2 / math.pi * float(ellipk(height / 2))) ** 2  # Euler 1744
    if abs(load / end["lam"] - 1) > _LOAD_ERROR:
        result.append(("wrong", f"1 - cos(largest angle) = {height:.6g} at the end of the bent branch, {end['lam']:.9g}"))
    return result if str(bent.stop).startswith("reached") else [*result, ("unfinished", f"bent: {bent.stop}")]


def outcomes(problem: Random | Column, branch: contin.Branch) -> list[tuple[str, str]]:
    """Return what became of every branch point, and of every label: a word and where; words are those of the module's head."""
    result, left = [], problem.spectrum[problem.spectrum < problem.limit]
    for point in branch.labelled("BP"):
        dimension, error = getattr(point.details, "dimension", 1), point.errors["lam"]
        mine = np.abs(left - point["lam"]) <= UNDERRATED * np.nan_to_num(error) + ROUND_OFF * problem.spectrum.max()
        counted = "right" if np.count_nonzero(mine) == dimension else "wrong" if np.any(mine) else "invented"
        word = "noted" if np.isnan(error) and counted == "right" else counted
        result.append((word, f"{dimension} of {np.count_nonzero(mine)} at {point['lam']:.10g} ± {error:.1e}"))
        left = left[~mine]
    for value in left:
        near = ROUND_OFF * problem.spectrum.max()
        noted = any(low - near <= value <= high + near for low, high in _noted(branch))
        result.append(("noted" if noted else "missed", f"{value:.10g}"))
    others = [point for point in branch if point.label not in ("", "EP", "BP")]
    result += [("invented", f"{point.label} {point.name} at {point['lam']:.9g}") for point in others]
    if branch.stop is None or branch.stop.reason != "limit":
        result.append(("unfinished", str(branch.stop)))
    if isinstance(problem, Column) and branch.labelled("BP"):
        result += turned(problem, branch)
    return result


def main(words: list[str] | None = None) -> int:
    """Run random problems, print what became of their branch points, and return the exit code."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--count", type=int, default=500, help="number of problems (500)")
    parser.add_argument("--seed", type=int, default=0, help="another seed, other problems (0)")
    parser.add_argument("--first", type=int, default=0, help="number of the first problem (0)")
    parser.add_argument("--most", type=int, default=SIZES[-1], help=f"largest number of states ({SIZES[-1]})")
    parser.add_argument("--verbose", action="store_true", help="a line for each problem")
    options = parser.parse_args(words)
    if options.count < 1 or options.first < 0 or options.seed < 0 or options.most < SIZES[1]:
        parser.error(f"--count must be 1 or more, --most {SIZES[1]} or more; --first and --seed must not be negative")
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, resource.getrlimit(resource.RLIMIT_AS)[1]))
    began, bad = time.process_time(), 0
    table: dict[str, collections.Counter[str]] = {kind: collections.Counter() for kind in KINDS}
    for problem in problems(options.count, options.seed, options.first, options.most):
        try:
            found = outcomes(problem, branch_of(problem))
        except Exception as error:  # whatever it is, it is counted
            found = [("failed", f"{type(error).__name__}: {error}")]
        table[problem.kind].update(word for word, _ in found)
        faults = [f"{word}: {what}" for word, what in found if word not in ("right", "noted")]
        bad += bool(faults)
        if faults or options.verbose:
            print(problem.describe(), *(faults or [f"{len(found)} right or noted"]), sep="\n    ", flush=True)
    for kind, counts in table.items():
        print(f"{kind}: " + ", ".join(f"{number} {word}" for word, number in counts.most_common()))
    total = sum(table.values(), collections.Counter())
    seconds, peak = time.process_time() - began, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
    print(f"{options.count} problems, {sum(total.values())} branch points: {total['right']} right, {total['noted']} noted, "
          f"{bad} problems with faults; {seconds:.0f} s, {peak:.2f} GB")  # fmt: skip
    return int(bad > 0)


if __name__ == "__main__":
    sys.exit(main())
