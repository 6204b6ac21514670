"""Connected branches: follow one, leave it at every branch point, and so on to a given depth."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Iterator, Sequence
from typing import Annotated, Any, Unpack

import numpy as np

from contin import errors as checks
from contin.arrays import Array
from contin.continuation.progress import Progress
from contin.continuation.run import Continuation
from contin.core.labels import Label
from contin.core.protocol import Discretization, inner
from contin.core.settings import Options, Settings, settings_with
from contin.core.step import Reason, Stop
from contin.cycles.statement import CycleProblem
from contin.errors import ConvergenceError, Positive, ProblemError, Within
from contin.events.labelled import finding_of
from contin.problems.angles import whole_rounds, winding_names
from contin.problems.statement import PERIOD, ROUNDS, declared
from contin.results.branch import Branch, Diagram, Junction
from contin.results.point import Point
from contin.results.record import system_of
from contin.search.further import Search, Searched, Site, Symmetry, are_one, check_maps, image, seen
from contin.search.trace import switched, switches
from contin.text import meant


def _is_end(point: Point) -> bool:
    """Return whether a Hopf point or period doubling is where a branch of cycles ends that begins there."""
    system: Any = point.system
    if point.label == Label.HOPF or not system.is_cycle:
        return bool(system.is_cycle)
    return bool(system.is_doubled(point.x))


def _is_like(point: Point, start: Point) -> bool:
    """Return whether a point is a solution of the kind that a diagram starts with: no cycle, where that is an equilibrium."""
    return point.system.free == start.system.free and type(point.system) is type(start.system)


def _tangents(point: Point) -> Sequence[Array]:
    """Return the tangents of the branches through a junction; of a corner of its half-branches, first of that which came."""
    return (-point.tangent, *point.details.ways) if point.label == Label.CORNER else point.details.tangents


class _Explorer:
    """The search of `diagram`: branches and junctions so far."""

    def __init__(self, settings: Settings, symmetries: Sequence[Symmetry], tolerance: float, progress: Progress) -> None:
        self.settings, self.tolerance, self.progress = settings, tolerance, progress
        self.symmetries = [lambda t, u: u, *symmetries]
        self.result = Diagram()
        self._done = 0  # junctions that were left
        self._sites: list[Site] = []  # where disconnected solutions are looked for

    def run(self, system: Discretization, x: Array, depth: int) -> Diagram:
        """Follow both ways from the start, unless the branch is closed, then leave every junction of less than ``depth``."""
        for direction in (1, -1):
            self._follow(self._run(system, x, dataclasses.replace(self.settings, direction=direction)), 0)
            stop = self.result.branches[-1].stop
            if stop is not None and stop.reason == Reason.CLOSED:
                break
        while self._done < len(self.result.junctions):
            junction = self.result.junctions[self._done]
            self._done += 1
            if junction.depth >= depth:
                continue
            if switches(junction.point):
                self._switch(junction)
                continue
            for which, tangent in enumerate(_tangents(junction.point)):
                for way in (1, -1):
                    if way not in junction.taken[which]:
                        self._leave(junction, which, way, tangent)
        return self.result

    def search(self, search: Search, start: Point, depth: int) -> None:
        """Look for solutions that no branch has reached, and follow them to the same depth."""
        primary = self.settings.primary or start.system.free[0]
        kept = self.settings, self.symmetries, self.tolerance
        self._sites = [
            Site(primary, float(value), *kept, search, number) for number, value in enumerate(sorted(set(search.values)))
        ]
        while sum(self._search_at(number, start, depth) for number in range(len(self._sites))):
            pass
        self.result.searches = [site.account for site in self._sites]

    def _search_at(self, number: int, start: Point, depth: int) -> int:
        """Search at one value, with the solutions at those beside it as guesses; return how many are found."""
        site = self._sites[number]
        reached = [points for branch in self.result.branches if (points := [p for p in branch if _is_like(p, start)])]
        for points in reached:
            site.add_from(points)
        beside = [other for other in self._sites[max(number - 1, 0) : number + 2] if other is not site]
        elsewhere = [point for points in reached for point in points if any(other.holds(point) for other in beside)]
        if not elsewhere and not site.known:
            elsewhere = [min(points, key=site.distance) for points in reached]
        return site.search(elsewhere, functools.partial(self._follow_found, site, start, depth))

    def _follow_found(self, site: Site, start: Point, depth: int, point: Point, account: Searched) -> None:
        """Follow a solution that a search has found both ways, and what leaves there."""
        system: Any = point.system
        first = len(self.result.branches)
        try:
            system, x = system.with_free(start.system.free, point.x)
            self.run(system, x, depth)
        except ConvergenceError as error:
            account.not_followed.append(str(error))
        fresh = self.result.branches[first:]
        if fresh and all(len(branch) == 1 and branch.stop and branch.stop.reason == Reason.LIMIT for branch in fresh):
            del self.result.branches[first:]
            account.outside += 1
        elif fresh:
            account.branches.append(first)
        for branch in fresh:
            site.add_from([each for each in branch if _is_like(each, start)])

    def _is_passed(self, point: Point, number: int) -> bool:
        """Return whether a search knows a point of a run, from another branch."""
        return any(
            are_one((other.system, other.x), (point.system, point.x), self.symmetries, self.tolerance)
            for site in self._sites if site.holds(point)
            for branch in self.result.branches[:number]
            for other in branch if _is_like(other, point) and site.holds(other)
        )  # fmt: skip

    def _leave(self, junction: Junction, which: int, way: int, tangent: Array) -> None:
        point, number = junction.point, len(self.result.branches)
        for place, side in ((which, way), *self._images(point, way * tangent)):
            junction.taken[place].setdefault(side, number)
        try:
            self._follow(self._run(point.system, point.x, self.settings, way * tangent), junction.depth + 1, junction)
        except ConvergenceError as error:
            junction.failed.append((which, way, str(error)))

    def _switch(self, junction: Junction) -> None:
        """Follow the cycles that begin at a Hopf point or period doubling."""
        if junction.taken[1]:
            return
        junction.taken[1][1] = len(self.result.branches)
        try:
            system, x, tangent = switched(junction.point, self.settings.mesh.min_intervals)
            self._follow(self._run(system, x, self.settings, tangent), junction.depth + 1, junction)
        except ConvergenceError as error:
            junction.failed.append((1, 1, str(error)))

    def _run(self, system: Discretization, x: Array, settings: Settings, tangent: Array | None = None) -> Continuation:
        """Return a run; settings that name columns of the other kind of branch (equilibria, cycles) do not count."""
        known = (*system.problem.parameters, *system.problem.functionals, *system.named_states)
        own = {"limits": known, "zeros": known, "scales": (*known, *system.problem.states)}
        given: dict[str, Any] = {
            field: {name: one for name, one in getattr(settings, field).items() if name in own[field]} for field in own
        }
        return Continuation(system, x, dataclasses.replace(settings, **given), tangent)

    def _follow(self, run: Continuation, depth: int, origin: Junction | None = None) -> None:
        """Follow one run to its end, or to a known branch. Half-branches that it passes at junctions count as taken."""
        number, branch = len(self.result.branches), Branch()
        self.result.branches.append(branch)
        for place, point in enumerate(self.progress.watch(run, f"branch {number + 1}, depth {depth}: ")):
            branch.points.append(point)
            if place == 0 and origin is not None:
                origin.also.append(point)
            elif (self._is_known(point, number, depth) or (place and self._is_passed(point, number))) and run.stop is None:
                branch.stop = Stop(Reason.KNOWN_BRANCH, "came to a branch that was followed before")
                break
        branch.stop, branch.notes = branch.stop or run.stop, run.notes

    def _is_known(self, point: Point, number: int, depth: int) -> bool:
        """Note a point that a run passes, if it is one to leave a branch at; return True if the way ahead was followed."""
        begins = switches(point)
        known = finding_of(point.details)
        if known.is_branch_point and not begins:
            return bool(known.leaving) and self._arrived(point, number, depth)
        return begins and self._met(point, number, depth)

    def _met(self, point: Point, number: int, depth: int) -> bool:
        """Note a Hopf point or period doubling on a run; return True if it is known already."""
        for junction in self.result.junctions:
            if junction.point.label == point.label and self._same(junction.point, point):
                junction.also.append(point)
                if point.system.size != junction.point.system.size or type(point.system) is not type(junction.point.system):
                    junction.taken[1].setdefault(1, number)
                return True
        if _is_end(point):
            return False
        self.result.junctions.append(Junction(point, depth, [{1: number, -1: number}, {}]))
        return False

    def _same(self, known: Point, point: Point) -> bool:
        """Return whether two points with one label are one: in all columns or, at the end of the branch begun there, in some.

        A cycle that has shrunk has the coordinates of the Hopf point, one that goes twice round the columns of the period
        doubling, but for the period.
        """
        ours, theirs = ({**each.parameters, **each.functionals} for each in (known, point))
        if known.system.named_states and point.system.size_of_solutions is not None:
            states = known.system.states(known.x).ravel()
            ours |= {f"max_{name}": value for name, value in zip(known.system.problem.states, states)}
        angles = declared(known.system.problem, "angles")
        names = [name for name in ours if name in theirs and name != ROUNDS and name not in winding_names(angles)]
        factor = 2.0 if _is_end(point) and point.label == Label.PERIOD_DOUBLING else 1.0
        for name in names:
            mine = ours[name] * (factor if name == PERIOD else 1.0)
            apart = np.array([theirs[name] - mine])
            apart = apart - whole_rounds(apart, np.array([angles.get(name.removeprefix("max_").removeprefix("min_"), 0.0)]))
            if abs(float(apart[0])) > self.tolerance * (1 + abs(mine)):
                return False
        return True

    def _arrived(self, point: Point, number: int, depth: int) -> bool:
        """Note a branch point that a run passes; return True if the way ahead was followed before."""
        for junction in self.result.junctions:
            matched = self._match(junction.point, point) if junction.point.label == point.label else None
            if matched is None:
                continue
            which, way = matched
            junction.also.append(point)
            junction.taken[which].setdefault(-way, number)
            if point.label == Label.CORNER:
                came = point.system.carrier(junction.point.system)(-point.tangent)
                junction.taken[self._images(junction.point, came)[0][0]].setdefault(1, number)
            if way in junction.taken[which]:
                return True
            junction.taken[which][way] = number
            return False
        known = [{1: number, -1: number}, *({} for _ in _tangents(point)[1:])]
        if point.label == Label.CORNER:  # half-branches leave along their tangents only
            known = [{1: number, -1: number}] * 2 + [{-1: number} for _ in known[2:]]
        self.result.junctions.append(Junction(point, depth, known))
        return False

    def _match(self, known: Point, point: Point) -> tuple[int, int] | None:
        """Return (tangent, way) of a known junction along which the branch of ``point`` goes, if they are images."""
        a, b = known.system, point.system
        carry, there = b.carrier(a), seen(a, known.x)
        here, ahead = seen(a, carry(point.x)), seen(a, carry(finding_of(point.details).leaving[0]))
        if here.size != there.size:  # cycles of a map, of different lengths
            return None
        parameters = slice(a.state_size, None)
        if np.any(np.abs(there[parameters] - here[parameters]) > self.tolerance * (1 + np.abs(here[parameters]))):
            return None
        return next(self._carried_onto(known, here, ahead), None)

    def _images(self, point: Point, direction: Array) -> list[tuple[int, int]]:
        """Return (tangent, way) of the half-branches at ``point`` that are images of the one along ``direction``."""
        system = point.system
        return list(self._carried_onto(point, seen(system, point.x), seen(system, direction)))

    def _carried_onto(self, known: Point, x: Array, direction: Array) -> Iterator[tuple[int, int]]:
        """Yield (tangent, way) of a junction for each symmetry that carries x onto it, and ``direction`` along that tangent."""
        system = known.system
        there = seen(system, known.x)
        for symmetry in self.symmetries:
            here, (turned,) = system.in_phase(image(system, symmetry, x), (image(system, symmetry, direction),), there)
            gap = here - there
            if np.sqrt(inner(system, gap, gap)) > self.tolerance * (1 + np.sqrt(inner(system, there, there))):
                continue
            cosines = np.array([inner(system, turned, tangent) for tangent in _tangents(known)])
            if known.label == Label.CORNER:
                yield int(np.argmax(cosines)), 1
                continue
            which = int(np.argmax(np.abs(cosines)))
            yield which, int(np.sign(cosines[which]) or 1)


@checks.arguments
def diagram(
    start: Point, settings: Settings | None = None, *, free: Sequence[str] | None = None,
    depth: Annotated[int, Within(0, 1000)] = 2, symmetries: Sequence[Symmetry] = (), tolerance: Positive = 1e-5,
    search: Search | None = None, progress: bool | None = None, **options: Unpack[Options],
) -> Diagram:  # fmt: skip
    """Follow every branch that can be reached from a solution, to a given depth.

    Branches are left at branch points, and at Hopf points and period doublings, where cycles begin.

    Parameters
    ----------
    start : Point
    settings : Settings, optional
        Or any of its fields by name. Give limits: they end branches that go off. From equilibria, ``limits`` and ``zeros`` may
        name columns of cycles, too.
    free : sequence of str, optional
        Free parameters, if they shall differ from those of ``start``.
    depth : int
        Largest number of those points between ``start``'s branch and the others: 0 follows that branch alone.
    symmetries : sequence of callable
        Maps ``s(t, states) -> states`` of solutions to solutions (nodes t, states (K, n), same parameters), for states whose
        parameters they leave alone: images of a branch count as that branch. Of autonomous cycles, shifts in time need no map.
        Those of a `VariationalProblem` map the states x, without multipliers; the ones that it declares count, too.
    tolerance : float
        Relative distance below which two branch points are one, and two solutions that a search finds.
    search : Search, optional
        Look for solutions that no branch reaches, at values of the primary parameter, and follow them, too; not of cycles.
    progress : bool, optional
        As in `trace`.

    Returns
    -------
    Diagram
        Failed switches are recorded at their junction, searches in ``searches``: a search that finds nothing is no proof.

    Examples
    --------
    >>> from contin import AlgebraicProblem, solve
    >>> pitchfork = AlgebraicProblem(lambda u, p: (u.x * (p.a - u.x**2),), ["x"], {"a": 0.0})
    >>> found = diagram(solve(pitchfork, [0.0], {"a": -1.0}), free=["a"], limits={"a": (-1, 1)})
    >>> [str(branch.stop) for branch in found.branches]
    ['reached a = 1', 'reached a = -1', 'reached a = 1', 'reached a = 1']
    """
    check_maps("symmetries", symmetries)
    settings = settings_with(settings, options)
    symmetries = [*symmetries, *declared(system_of(start, "start").problem, "symmetries").values()]
    system, x = (
        (start.system, start.x) if free is None else system_of(start, "start").with_free(checks.names("free", free), start.x)
    )
    _check_columns(system, settings)
    if search is not None:
        settings = _with_values(settings, system, search)
    explorer = _Explorer(settings, symmetries, tolerance, Progress(progress))
    found = explorer.run(system, x, depth)
    if search is not None:
        explorer.search(search, found.branches[0][0], depth)
    return found


def _with_values(settings: Settings, system: Discretization, search: Search) -> Settings:
    """Return settings that label the values of a search; raise ProblemError on one outside the limits, and on cycles."""
    primary = settings.primary or system.free[0]
    low, high = settings.limits.get(primary, (-np.inf, np.inf))
    if system.is_cycle:
        raise ProblemError("search: not of cycles; look for further ones from other starts (cycle)")
    for value in search.values:
        if not low <= value <= high:
            raise ProblemError(f"search: value {value:g} must lie within the limits of {primary}, {low:g} to {high:g}")
    return dataclasses.replace(settings, zeros={**settings.zeros, primary: [*settings.zeros.get(primary, ()), *search.values]})


def _check_columns(system: Discretization, settings: Settings) -> None:
    """Require that limits and zeros name columns of the problem or, of equilibria, of the cycles that begin there."""
    problem: Any = system.problem
    known = [*problem.parameters, *problem.functionals]
    known += [name for name in system.named_states if name not in known]
    if system.starts_cycles and not system.is_cycle:
        cycles = CycleProblem.of(problem)
        known += [name for name in (*cycles.parameters, *cycles.functionals) if name not in known]
    checks.chosen("scales", list(settings.scales), [*dict.fromkeys((*known, *problem.states))])
    for name in (*settings.limits, *settings.zeros):
        if name not in known:
            raise ProblemError(f"{name!r} is no column of this problem ({checks.listed(known)}){meant(name, known)}")
