"""The states of a diagram at a natural curvature: solved by Newton's method from the interpolant, with their errors."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from branches.graph import closed as diagram
from branches.graph.interpolation import uncertainty
from branches.scene.stage import errors_of
from branches.store.branch import StoredBranch
from branches.store.files import StoreError
from branches.store.read import read_branch
from contin import ContinError, ConvergenceError, Settings
from contin.lowlevel import Collocation, Continuation, Label, correct, point_of
from ribbon_model import exact

#: Columns of a state.
_COLUMNS = ("kappa_star", "energy")
#: Where the values of a state come from.
EXACT, SOLVED, INTERPOLATED = "exact", "solved", "interpolated"
#: Stored solutions from which a first guess is interpolated: a cubic. With two, Newton's method takes one more iteration.
_AROUND = 4
#: Largest difference between a solved state and the interpolated one, relative to 1 + the value. Over 45 questions on Fig.
#: 12 it was 6e-4. A state further off is another one. Ten times more: states of other branches are taken for this one.
_FAR = 0.01
#: The same, over the interpolation's estimated error where that is larger.
_ERRORS = 3.0
#: Points of a run from a stored solution to a place where Newton's method did not arrive from the interpolant. A run that gets
#: there takes about as many as lie between stored solutions, the stride of the scene.
_STEPS = 60
#: States of one question that are solved. One takes 0.03 s of processor time; a sweep over nu may have thousands.
_MOST = 300


@dataclass(frozen=True)
class State:
    """An equilibrium at a natural curvature.

    Attributes
    ----------
    about : dict
        law and nu; ``circle`` (its covering index), or ``branch`` (m, n) and for a secondary branch ``origin``.
    values, errors : dict
        kappa_star and energy; nan where the error is not known, 0 on circles.
    source : str
        ``exact`` (a circle, or the quadrature of a preview), ``solved`` or ``interpolated``.
    """

    about: dict
    values: dict[str, float]
    errors: dict[str, float]
    source: str

    def words(self, column: str) -> str:
        """Return a value with its error, or the digits that hold with the word 'interpolated'.

        Examples
        --------
        >>> State({}, {"energy": 1.23456789}, {"energy": 3e-4}, "interpolated").words("energy")
        '1.235 (interpolated)'
        >>> State({}, {"energy": 1.23456789}, {"energy": 3e-11}, "solved").words("energy")
        '1.2345678900 ± 3e-11'
        """
        value, error = self.values[column], self.errors[column]
        if self.source == EXACT:
            return f"{value:.10f}"
        return f"{value:.10f} ± {error:.0e}" if self.source == SOLVED else f"{holding(value, error)} ({INTERPOLATED})"


def holding(value: float, error: float) -> str:
    """Return the digits of a value that hold: the last one is wrong by less than one. Without an error there are none.

    Examples
    --------
    >>> holding(5.74931588, 7e-5), holding(5.74931588, 2.0), holding(5.74931588, math.nan)
    ('5.7493', '6', 'about 6')
    """
    if not error > 0:
        return f"about {value:.1g}" if math.isnan(error) else repr(value)
    return f"{value:.{min(10, max(0, math.floor(-math.log10(error))))}f}"


def states_at(graph, kappa_n: float, folder: Path | None = None) -> list[State]:
    """Return all equilibria of a diagram at a natural curvature, by energy.

    States of branches are solved where the folder holds their files, or by the quadrature of a preview. Elsewhere, and beyond
    the first `_MOST`, values between computed points come from a cubic spline over arclength, with an estimate of its error.
    """
    edges, files = [data for *_, data in graph.edges(data=True)], {}
    places, found = diagram.states_at(graph, kappa_n), []
    for place in places:
        about = {name: place[name] for name in ("law", "nu", "circle", "branch", "origin") if name in place}
        values = {name: float(place[name]) for name in _COLUMNS}
        if "circle" in place:
            found.append(State(about, values, dict.fromkeys(_COLUMNS, 0.0), EXACT))
            continue
        edge = edges[place["edge"]]
        near = State(about, values, uncertainty(edge, place["arclength"], "kappa_n", _COLUMNS), INTERPOLATED)
        others = [other for other in places if other is not place and all(other.get(key) == about[key] for key in about)]
        way = _by_quadrature if "exact" in edge else _by_newton
        solved_there = way(edge, place, near, (folder, files)) if len(found) < _MOST else ()
        found.append(next((state for state in solved_there if _same(state, near, others)), near))
    return sorted(found, key=lambda state: (state.about["law"], state.about["nu"], state.values["energy"]))


def _by_quadrature(edge: dict, place: dict, near: State, where) -> Iterator[State]:
    """Yield the exact states to which the ends of the interval lead, the nearer one first."""
    s, points = np.array(edge["arclength"]), edge["exact"]
    i = int(np.clip(np.searchsorted(s, place["arclength"], side="right") - 1, 0, len(s) - 2))
    for guess in sorted(points[i : i + 2], key=lambda point: abs(point.kappa_star - near.values["kappa_star"])):
        try:
            point = exact.solve(
                guess.m, guess.n, guess.parameters, guess, kappa_n=place["kappa_n"],
                law=guess.law, root=getattr(guess, "root", 0),
            )  # fmt: skip
        except (RuntimeError, ValueError, np.linalg.LinAlgError):
            continue
        values = {name: float(getattr(point, name)) for name in _COLUMNS}
        yield State(near.about, values, dict.fromkeys(_COLUMNS, 0.0), EXACT)


def _by_newton(edge: dict, place: dict, near: State, where) -> Iterator[State]:
    """Yield solved states: from the interpolant, then from the stored solutions beside it; nothing without a file."""
    folder, files = where
    name = edge.get("file")
    if folder is None or not name:
        return
    if name not in files:
        try:
            files[name] = read_branch(folder / name)
        except StoreError:
            files[name] = None
    branch = files[name]
    if branch is None:
        return
    with contextlib.suppress(ContinError):
        yield State(near.about, *solved(*_guess(branch, place["arclength"], place["kappa_n"])), SOLVED)
    for system, x in _followed(branch, place["arclength"], place["kappa_n"]):
        with contextlib.suppress(ContinError):
            yield State(near.about, *solved(system, x), SOLVED)


def _same(state: State, near: State, others: list[dict]) -> bool:
    """Return whether a solved state is the interpolated one: not far from it, and nearer to it than to others of the branch."""
    here = {name: abs(state.values[name] - near.values[name]) for name in _COLUMNS}
    if any(here[name] > max(_FAR * (1 + abs(near.values[name])), _ERRORS * near.errors[name]) for name in _COLUMNS):
        return False
    return all(here["kappa_star"] <= abs(state.values["kappa_star"] - other["kappa_star"]) for other in others)


def solved(system: Collocation, x: np.ndarray) -> tuple[dict[str, float], dict[str, float]]:
    """Return kappa_star and energy of the state near a guess, at the kappa_n of the system, and their errors.

    Raises ConvergenceError where there is no state, on this mesh or with every interval halved.
    """
    found = correct(system, x)
    point = point_of(system, found.x, found.iterations, found.error)
    errors = errors_of(point, lambda at: {name: at[name] for name in _COLUMNS})
    if any(map(math.isnan, errors.values())):
        raise ConvergenceError("the state was not found with every interval of the mesh halved")
    return {name: point[name] for name in _COLUMNS}, errors


def _guess(branch: StoredBranch, arclength: float, kappa_n: float) -> tuple[Collocation, np.ndarray]:
    """Return the system at fixed kappa_n on the mesh of the nearest stored solution, and an interpolated guess."""
    kept = np.unique(branch.kept())
    s = branch.points["arclength"][kept]
    kept = kept[np.argsort(abs(s - arclength), kind="stable")[:_AROUND]]
    s = branch.points["arclength"][kept]
    weights = [np.prod([(arclength - b) / (a - b) for b in s if b != a]) for a in s]
    found = [branch.discretized(int(point)) for point in kept]
    first = found[0][0]
    states = sum(w * one.evaluate(x, first.nodes) for w, (one, x) in zip(weights, found))
    values = sum(w * one.all_parameters(x) for w, (one, x) in zip(weights, found))
    numbers = {**dict(zip(first.problem.parameters, map(float, values))), "kappa_n": kappa_n}
    system = Collocation(first.problem, first.mesh, first.degree, first.free[1:], numbers)
    return system, system.pack(states, numbers)


def _followed(branch: StoredBranch, arclength: float, kappa_n: float) -> Iterator[tuple[Collocation, np.ndarray]]:
    """Yield systems at fixed kappa_n and states, by following the branch from the stored solutions on both sides."""
    s, kappas = branch.points["arclength"], branch.points["kappa_n"]
    kept = np.unique(branch.kept())
    for row, ahead in ((kept[s[kept] <= arclength][-1:], 1), (kept[s[kept] > arclength][:1], -1)):
        if not row.size or not 0 <= row[0] + ahead < len(s) or branch.points["label"][row[0]] == b"LP":
            continue
        direction = np.sign(kappas[row[0] + ahead] - kappas[row[0]])
        system, x = branch.discretized(int(row[0]))
        settings = Settings(direction=int(direction or 1), zeros={"kappa_n": [kappa_n]}, max_points=_STEPS, errors=False)
        with contextlib.suppress(ContinError):
            for point in Continuation(system, x, settings):
                if point.label == Label.USER_ZERO:
                    yield point.system.with_free(system.free[1:], point.x)
                    break
