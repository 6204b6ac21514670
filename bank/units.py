"""The bank in other units: every state, parameter, functional and equation multiplied by a random power of ten.

``python -m bank.units --help`` runs the whole bank at several seeds and prints the cases that then fail.
A value X of the original problem is s X in the restated one. The factors s are further parameters, so that the restated
functions are compiled once for all seeds. Guesses, limits, zeros and the wanted values are restated alike.
"""

from __future__ import annotations

import argparse
import importlib.util
import sys
import time
from collections import namedtuple
from collections.abc import Mapping, Sequence
from types import ModuleType
from typing import Any

import numpy as np

import contin
from bank import case as cases
from bank.case import TOLERANCE, Case

NAMES = (
    "exp", "int", "bvp", "lin", "non", "ezp", "ext", "spb", "kar", "bru", "pd2",
    "cusp", "ab", "abc", "enz", "dd2", "lrz", "pp2", "opt",
)  # fmt: skip
#: The factors are 10^U(-DECADES, DECADES).
DECADES = 9.0
#: Names of the parameters that hold factors begin with this; no problem of the bank has such names.
_FACTOR = "factor_"


class Units:
    """A problem restated in other units.

    Parameters
    ----------
    problem : contin.BoundaryValueProblem or contin.AlgebraicProblem
    random : numpy.random.Generator
    decades : float
        The factors are 10^U(-decades, decades).

    Attributes
    ----------
    factors : dict of str to float
        Of states, parameters and functionals.
    problem
        The restated problem.
    """

    def __init__(self, problem: Any, random: np.random.Generator, decades: float = DECADES) -> None:
        self.states, self.parameters = problem.states, tuple(problem.parameters)
        names = (*self.states, *self.parameters, *problem.functionals)
        self.factors = {name: self._drawn(random, decades) for name in names}
        self._extra: dict[str, float] = {_FACTOR + name: self.factors[name] for name in names}
        self._random, self._decades = random, decades
        self.problem = self._algebraic(problem) if hasattr(problem, "residual") else self._boundary_value(problem)

    @staticmethod
    def _drawn(random: np.random.Generator, decades: float) -> float:
        return float(10.0 ** random.uniform(-decades, decades))

    def of(self, values: Mapping[str, float]) -> dict[str, Any]:
        """Return numbers, or sequences of them, by name in the other units."""
        return {name: np.multiply(value, self.factors[name]).tolist() for name, value in values.items()}

    def guess(self, guess: Any) -> Any:
        """Return a guess in the other units."""
        sizes = np.array([self.factors[name] for name in self.states])
        if guess is None or isinstance(guess, contin.Point):
            return guess
        return (lambda t: np.asarray(guess(t)) * sizes) if callable(guess) else list(np.asarray(guess, dtype=float) * sizes)

    def _defaults(self, problem: Any) -> dict[str, float]:
        return {**self.of(problem.parameters), **self._extra}

    def _rows(self, name: str, count: int) -> list[str]:
        """Return names of parameters that hold random factors of so many equations."""
        names = [f"{_FACTOR}{name}_{i}" for i in range(count)]
        self._extra.update({row: self._drawn(self._random, self._decades) for row in names})
        return names

    def _algebraic(self, problem: Any) -> contin.AlgebraicProblem:
        rows = [_FACTOR + name for name in self.states]
        if not problem.dynamics:
            rows = self._rows("residual", problem.equation_size)
        functionals = {name: self._function(f, ("u", "p"), [_FACTOR + name], 0) for name, f in problem.functionals.items()}
        residual = self._function(problem.residual, ("u", "p"), rows, len(rows))
        return contin.AlgebraicProblem(residual, self.states, self._defaults(problem), functionals, problem.dynamics)

    def _boundary_value(self, problem: Any) -> contin.BoundaryValueProblem:
        point, rates = ("t", "u", "p"), [_FACTOR + name for name in self.states]
        conditions = self._rows("boundary", problem.boundary_size)
        integrals = None
        if problem.integrals is not None:
            rows = self._rows("integral", problem.integral_size)
            integrals = self._function(problem.integrals, point, rows, len(rows))
        return contin.BoundaryValueProblem(
            self._function(problem.rhs, point, rates, len(rates)),
            self._function(problem.boundary, ("u", "v", "p"), conditions, len(conditions)),
            self.states, self._defaults(problem), integrals, problem.domain,
            {name: self._function(f, point, [_FACTOR + name], 0) for name, f in problem.functionals.items()},
        )  # fmt: skip

    def _function(self, function: Any, arguments: Sequence[str], rows: Sequence[str], count: int) -> Any:
        """Return a function of the new unknowns: the old one of the old unknowns, its values times their factors."""
        kinds = {"u": self.states, "v": self.states, "p": self.parameters}
        scope: dict[str, Any] = {"function": function}
        given = []
        for name in arguments:
            if name == "t":
                given.append("t")
                continue
            kind = "Old_" + "_".join(kinds[name])  # compiled code is kept by the name of the type
            scope[kind] = namedtuple(kind, kinds[name])  # noqa: PYI024
            given.append(f"{kind}({', '.join(f'{name}.{field} / p.{_FACTOR}{field}' for field in kinds[name])})")
        returned = f"p.{rows[0]} * values"
        if count:
            returned = "(" + "".join(f"p.{row} * values[{i}], " for i, row in enumerate(rows)) + ")"
        exec(f"def restated({', '.join(arguments)}):\n    values = function({', '.join(given)})\n    return {returned}", scope)
        return scope["restated"]


def restated(name: str, seed: int, stated: bool = False, decades: float = DECADES) -> ModuleType:
    """Return a module of the bank, loaded afresh, whose runs are in other units; its attribute ``units`` says which.

    With ``stated`` the runs are told the sizes of states and parameters (`Settings.scales`).
    """
    spec = importlib.util.find_spec(f"bank.{name}")
    assert spec is not None and spec.loader is not None
    module: Any = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    random = np.random.default_rng([seed, NAMES.index(name)])
    units = module.units = Units(module.problem(), random, decades)
    sizes = {key: units.factors[key] for key in (*units.states, *units.parameters)} if stated else {}
    module.problem = lambda: units.problem

    def solve(problem, guess=None, parameters=None, **options):
        return contin.solve(problem, units.guess(guess), units.of(parameters or {}), **options)

    def following(function):
        def call(*args, **options):
            for key in ("limits", "zeros"):
                if key in options:
                    options[key] = units.of(options[key])
            return function(*args, **options, **({"scales": sizes} if sizes else {}))

        return call

    module.solve = solve
    for place in (contin, cases):
        for what in ("trace", "curve", "run_until"):
            if what in vars(module) and hasattr(place, what):
                setattr(module, what, following(getattr(place, what)))
    return module


def complaint(module: Any, case: Case) -> str:
    """Return how the run of a restated case differs from what is known, in the original units; empty if it does not."""
    try:
        branch = case.run()
    except (contin.ContinError, IndexError) as error:  # a case takes its start from another run by its place
        return f"{type(error).__name__}: {error}"
    found, wanted = cases.labelled(branch), case.specials
    if [point.label for point in found] != [special.label for special in wanted]:
        return f"{[(point.label, point.name) for point in found]}; {branch.stop}; {len(branch.points)} points"
    for point, special in zip(found, wanted):
        if "possible" in point.name:
            return f"{point.label} {point.name!r}"
        values = {key: cases.value(point, key) / module.units.factors.get(key, 1.0) for key in special.values}
        for key, known in special.values.items():
            off = abs(values[key] - known) / max(1.0, abs(known))
            if not off <= max(TOLERANCE, special.error):
                return f"{point.label}: {key} = {values[key]!r}, not {known!r}; {len(branch.points)} points"
    return ""


def main() -> int:
    """Run the command; return how many cases fail."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--first", type=int, default=0, help="the first seed")
    parser.add_argument("--stated", action="store_true", help="tell the runs the sizes")
    parser.add_argument("--decades", type=float, default=DECADES)
    parser.add_argument("names", nargs="*", default=NAMES)
    options = parser.parse_args()
    runs = failed = 0
    for seed in range(options.first, options.first + options.seeds):
        for name in options.names or NAMES:
            module: Any = restated(name, seed, options.stated, options.decades)
            for case in module.CASES:
                start = time.time()
                what = complaint(module, case)
                runs, failed = runs + 1, failed + bool(what)
                if what:
                    print(f"{seed} {case.name} ({time.time() - start:.1f} s): {what[:300]}", flush=True)
    print(f"{runs} runs, {failed} differ")
    return failed


if __name__ == "__main__":
    sys.exit(main() > 0)
