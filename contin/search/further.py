"""Disconnected solutions: deflated iterations at chosen values of a parameter, and images under symmetries.

At each value:

1. Collect the solutions that are known there, of all branches followed so far; those under symmetries count as known.
2. Start the deflated iteration (`contin.search.solving`) from one guess after the other, from each until it finds nothing:
   guesses that are given, states of branches at other values, known states with the sign reversed, their images under given
   maps, and with random perturbations. Where it does not converge, take damped Newton steps from the guess itself.
3. Correct what it finds, adapt the mesh, and compare it with all that is known. The caller follows each new one both ways; its
   branch is known from then on, and its states at this value are guesses, too. They are guesses at the values beside this one,
   which are searched again until nothing is new.
"""

from __future__ import annotations

import contextlib
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Annotated, Any

import numpy as np

from contin import errors as checks
from contin.arrays import Array
from contin.core.newton import correct
from contin.core.protocol import Discretization, inner
from contin.core.settings import Settings
from contin.core.system import System
from contin.errors import ConvergenceError, Positive, ProblemError, Within
from contin.functions.signature import argument_count
from contin.levels import APART, LOCATED
from contin.problems.statement import MOST_CONDITIONS, declared
from contin.results.point import Point
from contin.results.record import system_of
from contin.search.guess import first_guess, parsed, with_guessed_multipliers
from contin.search.solving import deflated, solved
from contin.text import exact_text

#: Maps times (K,) and states (K, n) of a solution to the states of another one.
Symmetry = Callable[[np.ndarray, np.ndarray], np.ndarray]
#: A system, and its unknowns.
Solution = tuple[Discretization, Array]


def check_maps(what: str, maps: Sequence[Symmetry]) -> None:
    """Require functions of two arguments."""
    for each in checks.sequence(what, maps, "functions"):
        if argument_count(checks.function(what, each)) != 2:
            raise ProblemError(f"{what}: {checks.shown(each)} must take 2 arguments, times (K,) and states (K, n)")


def image(system: Discretization, symmetry: Symmetry, x: Array) -> Array:
    """Return the image of unknowns; of a variational problem the states x have one, multipliers stay (see `seen`)."""
    states = system.states(x).copy()
    visible = states[:, : declared(system.problem, "dimension")]
    visible[:] = symmetry(system.nodes, visible.copy())
    return np.concatenate([(states / system.scales.states).ravel(), x[system.state_size :]])


def seen(system: Discretization, x: Array) -> Array:
    """Return unknowns without multipliers: these follow from the others, and change their sign under symmetries."""
    problem: Any = system.problem
    if declared(problem, "dimension") == len(problem.states):
        return x
    x = x.copy()
    x[: system.state_size].reshape(-1, len(problem.state_names))[:, problem.dimension :] = 0.0
    x[[system.parameter_index(name) for name in problem.multipliers]] = 0.0
    return x


def evenly(system: Any) -> Discretization:
    """Return a system of a problem, on a uniform mesh if it has one: maps that reverse t take nodes to nodes."""
    if not system.is_function_of_t:
        return system
    a, b = system.problem.domain
    return system.on_mesh(np.linspace(a, b, system.intervals + 1))[0]


def are_one(first: Solution, second: Solution, symmetries: Sequence[Symmetry], tolerance: float) -> bool:
    """Return whether a solution is another one, or an image of it, on a uniform mesh; both have the same free parameters."""
    system = evenly(first[0])
    there = seen(system, first[0].carrier(system)(first[1]))
    other = second[0].carrier(system)(second[1])
    largest = tolerance * (1 + np.sqrt(inner(system, there, there)))
    for symmetry in symmetries:
        here, _ = system.in_phase(seen(system, image(system, symmetry, other)), (), there)
        if np.sqrt(inner(system, here - there, here - there)) <= largest:
            return True
    return False


#: Longest step of a deflated iteration, relative to 1 + |x|. Of the eight solutions of Carrier's equation at 1/5, steps of .3
#: to 10 find all, with two seeds; steps of .1 find four with one of them.
_LONGEST = 1.0
#: Cosines of which a random perturbation of a function of t is the sum: 0 to 3 half waves over the domain.
_WAVES = 4
#: Usual sizes of perturbations. On seven problems with four seeds each they find all; .1 and 1 with four draws missed four.
_SIZES = (1.0, 3.0)
#: Usual draws of each size. With four, one of these 28 searches missed a solution.
_DRAWS = 8


@dataclass(frozen=True)
class Search(checks.Named):
    """Where and how `diagram` looks for solutions that no branch has reached.

    Attributes
    ----------
    values : sequence of float
        Of the primary parameter, inside its limits. All branches of the diagram have a point there: UZ, or EP where they begin.
        What is found at one value is a guess at those beside it, whatever their order. Not of `contin.lowlevel.further`.
    sizes : sequence of float
        Sizes of random perturbations of known states, relative to 1 + the size of each state.
    draws : int
        Perturbations of each size, for every known state. Those of a function of t are sums of four cosines.
    guesses : sequence
        Further guesses, as `solve` takes them for the problem of the start, at every value.
    maps : sequence of callable
        Maps ``m(t, states) -> states`` of known states to guesses: symmetries that the problem has but for an imperfection. The
        sign of known states is reversed in any case.
    most : int
        The search at a value ends after so many further solutions.
    seed : int
        Of the random perturbations: the same seed finds the same solutions.

    Raises
    ------
    ProblemError

    Examples
    --------
    A circle beside a line; the circle is found from the line:

    >>> from contin import AlgebraicProblem, diagram, solve
    >>> apart = AlgebraicProblem(lambda u, p: ((u.x - p.a) * ((u.x - 4)**2 + (p.a - 1)**2 - 0.25),), ["x"], {"a": 0.0})
    >>> found = diagram(solve(apart, [0.0]), free=["a"], limits={"a": (0, 2)}, search=Search([1.0]))
    >>> sorted(round(point["a"], 9) for point in found.branches[-1].labelled("LP")), found.branches[-1].stop.reason
    ([0.5, 1.5], 'closed')
    """

    values: Sequence[Annotated[float, Within()]] = ()
    sizes: Sequence[Positive] = _SIZES
    draws: Annotated[int, Within(0, MOST_CONDITIONS)] = _DRAWS
    guesses: Sequence[Any] = ()
    maps: Sequence[Symmetry] = ()
    most: Annotated[int, Within(1, MOST_CONDITIONS)] = 20
    seed: Annotated[int, Within(0, MOST_CONDITIONS)] = 0

    def __post_init__(self) -> None:
        checks.fields(self)
        check_maps("maps", self.maps)


@dataclass
class Searched:
    """The account of a search at one value of the primary parameter: what was tried, and what came of it.

    Attributes
    ----------
    name, value : str, float
        The parameter and its value.
    known : int
        Solutions there before the search, without images under symmetries.
    guesses : mapping of str to int
        Guesses by kind: "given", "other values", "reversed", "mapped", "random".
    found : list of Point
        Further solutions.
    branches : list of int
        Numbers of the branches that begin there.
    outside : int
        Solutions among ``found`` that lie outside the limits: they are not followed.
    not_followed : list of str
        Why branches of the others could not be followed.
    known_again, lost : int
        Iterations that led to known solutions, and those that did not converge.
    stop : str
        Why the search ended.

    Examples
    --------
    >>> from contin import AlgebraicProblem, diagram, solve
    >>> apart = AlgebraicProblem(lambda u, p: ((u.x - p.a) * ((u.x - 4)**2 + (p.a - 1)**2 - 0.25),), ["x"], {"a": 0.0})
    >>> found = diagram(solve(apart, [0.0]), free=["a"], limits={"a": (0, 2)}, search=Search([1.0]))
    >>> (tried,) = found.searches
    >>> tried.known, dict(tried.guesses), len(tried.found), tried.stop
    (1, {'reversed': 3, 'random': 48}, 1, 'all guesses tried')
    """

    name: str
    value: float
    known: int = 0
    guesses: Counter[str] = field(default_factory=Counter)
    found: list[Point] = field(default_factory=list)
    branches: list[int] = field(default_factory=list)
    outside: int = 0
    not_followed: list[str] = field(default_factory=list)
    known_again: int = 0
    lost: int = 0
    stop: str = ""

    def __repr__(self) -> str:
        kinds = ", ".join(f"{count} {kind}" for kind, count in self.guesses.items())
        where = f" (branch {', '.join(map(str, self.branches))})" if self.branches else ""
        outside = f", {self.outside} of them outside the limits" if self.outside else ""
        failed = f"; not followed: {'; '.join(self.not_followed)}" if self.not_followed else ""
        tried = f"{self.known} known, {len(self.found)} more found{where}{outside} from {self.guesses.total()} guesses"
        others = f"{self.known_again} led to known ones, {self.lost} did not converge; {self.stop}{failed}"
        return f"search at {self.name} = {exact_text(self.value)}: {tried} ({kinds or 'none'}); {others}"


class Site:
    """The solutions that are known at one value of the primary parameter, and the search for others there.

    ``symmetries`` have the identity among them. Solutions at a smaller relative distance than ``tolerance`` are one. Each value
    has random numbers of its own, by its ``number``.
    """

    def __init__(
        self, primary: str, value: float, settings: Settings, symmetries: Sequence[Symmetry], tolerance: float,
        search: Search, number: int = 0,
    ) -> None:  # fmt: skip
        self.primary, self.value, self.settings = primary, value, settings
        self.symmetries, self.tolerance = symmetries, tolerance
        self.known: list[Point] = []
        self._search, self._random = search, np.random.default_rng([search.seed, number])
        self.account = Searched(primary, value)
        self._elsewhere: list[Point] = []  # guesses that were tried
        self._bases: list[Point] = []  # solutions of which all guesses were tried, here or, where none is known, elsewhere

    def holds(self, point: Point) -> bool:
        """Return whether a point lies at the value."""
        return self.distance(point) <= LOCATED * (1 + abs(self.value))

    def distance(self, point: Point) -> float:
        """Return how far a point is from the value."""
        return abs(point[self.primary] - self.value)

    def knows(self, point: Point) -> bool:
        """Return whether a solution, or an image of it, is known."""
        held = self.held(point)
        return any(are_one(self.held(known), held, self.symmetries, self.tolerance) for known in self.known)

    def add_from(self, points: Sequence[Point]) -> None:
        """Take those points that lie at the value for known."""
        for point in points:
            if self.holds(point) and not self.knows(point):
                self.known.append(point)

    def search(self, elsewhere: Sequence[Point], follow: Callable[[Point, Searched], None]) -> int:
        """Search from all guesses that were not tried before, add to the account, and return how many solutions are found.

        ``elsewhere`` are solutions at other values; there is one at least, or one is known here. ``follow`` follows a new
        solution, and adds what becomes known by it.
        """
        account, before = self.account, len(self.account.found)
        account.known = account.known if account.stop else len(self.known)
        if before < self._search.most:
            account.stop = "all guesses tried"
            for kind, system, x in self._guesses(elsewhere):
                account.guesses[kind] += 1
                while (point := self._beside(system, x, account)) is not None:
                    account.found.append(point)
                    self.known.append(point)
                    follow(point, account)
                    if len(account.found) == self._search.most:
                        account.stop = f"ended at most = {self._search.most}"
                        return len(account.found) - before
        return len(account.found) - before

    def _guesses(self, elsewhere: Sequence[Point]) -> Iterator[tuple[str, System, Array]]:
        """Yield kinds of guesses and guesses, those of solutions that are found meanwhile, too."""
        search, first = self._search, self.held((*self.known, *elsewhere)[0])[0]
        for guess in () if self._bases else search.guesses:
            problem: Any = first.problem
            values = dict(zip(problem.parameters, map(float, first.parameters)))
            given = parsed(problem, guess, values)
            yield "given", *first_guess(problem, given, values, first.free, max(first.intervals, 1), first.degree)
        fresh = [point for point in elsewhere if not any(point is other for other in self._elsewhere)]
        self._elsewhere += fresh
        for point in fresh:
            yield "other values", *self.held(point)
        bases = list(elsewhere) if not self.known and not self._bases else []
        while waiting := [point for point in (*bases, *self.known) if not any(point is base for base in self._bases)]:
            self._bases.append(waiting[0])
            system, x = self.held(waiting[0])
            yield "reversed", system, np.where(np.arange(x.size) < system.state_size, -x, x)
            for each in search.maps:
                yield "mapped", system, _fitted(system, _mapped(system, each, x))
            for size in search.sizes:
                for _ in range(search.draws):
                    yield "random", system, _fitted(system, x + size * _perturbation(system, x, self._random))

    def held(self, point: Point) -> tuple[System, Array]:
        """Return the system of a point with the primary parameter held at the value, and the point for it."""
        system: Any = point.system
        held, x = system.with_free([name for name in system.free if name != self.primary], point.x)
        found: System = held.with_parameters({self.primary: self.value})
        return found, x

    def _beside(self, system: System, x: Array, account: Searched) -> Point | None:
        """Return a solution that is not known, from the deflated iteration or, where that finds none, damped steps from x."""
        roots = self._roots(system)
        with np.errstate(all="ignore"):
            for start in (deflated(system, x, roots, _LONGEST), x):
                if start is None:
                    continue
                with contextlib.suppress(ConvergenceError, ProblemError):
                    point = solved(system, start, self.settings.mesh, self.settings.newton)
                    if not self.knows(point):
                        return point
                    account.known_again += 1
                    return None
        account.lost += 1
        return None

    def _roots(self, system: System) -> list[Array]:
        """Return the known solutions and their images as solutions of a system, each once."""
        roots: list[Array] = []
        for point in self.known:
            own, x = self.held(point)
            for number, symmetry in enumerate(self.symmetries):
                root = own.carrier(system)(_mapped(own, symmetry, x) if number else x)
                with contextlib.suppress(ConvergenceError):
                    root = correct(system, root, newton=self.settings.newton).x
                if all(np.max(np.abs(root - system.lifted(other, root))) > APART for other in roots):
                    roots.append(root)
        return roots


@checks.arguments
def further(
    known: Sequence[Point], name: str, search: Search | None = None, settings: Settings | None = None, *,
    symmetries: Sequence[Symmetry] = (), tolerance: Positive = 1e-5,
) -> Searched:  # fmt: skip
    """Search for further solutions at the parameters of known ones, without following any.

    Parameters
    ----------
    known : sequence of Point
        At least one; all have the same parameters.
    name : str
        A parameter that is held: the account names it with its value.
    search : Search, optional
    settings : Settings, optional
        Of Newton's method and the mesh.
    symmetries, tolerance :
        As of `contin.diagram`; the symmetries that the problem declares count, too.

    Raises
    ------
    ProblemError
        No known solution, or a name that is no parameter.

    Examples
    --------
    >>> from contin import AlgebraicProblem, solve
    >>> cubic = AlgebraicProblem(lambda u, p: (u.x**3 - p.a * u.x,), ["x"], {"a": 4.0})
    >>> account = further([solve(cubic, [0.0])], "a")
    >>> sorted(round(point["x"], 9) for point in account.found)
    [-2.0, 2.0]
    """
    if not known:
        raise ProblemError("known: must be at least one solution")
    problem = system_of(known[0], "known").problem
    checks.chosen("name", [name], tuple(problem.parameters))
    check_maps("symmetries", symmetries)
    maps: list[Symmetry] = [lambda t, u: u, *symmetries, *declared(problem, "symmetries").values()]
    site = Site(name, known[0][name], settings or Settings(), maps, tolerance, search or Search())
    site.add_from(known)
    site.search((), lambda point, account: None)
    return site.account


def _mapped(system: System, each: Symmetry, x: Array) -> Array:
    """Return the image of a solution under a map, which is applied on a uniform mesh."""
    even = evenly(system)
    return even.carrier(system)(image(even, each, system.carrier(even)(x)))


def _fitted(system: Any, x: Array) -> Array:
    """Return a guess with the multipliers that fit its states best, of a variational problem."""
    problem = system.problem
    if problem.dimension == len(problem.state_names):
        return x
    with contextlib.suppress(ProblemError):  # the energy has no finite value there
        return with_guessed_multipliers(system, system.states(x)[:, : problem.dimension])
    return x


def _perturbation(system: System, x: Array, random: np.random.Generator) -> Array:
    """Return a random vector of the size of 1 + the states: of each number, or of each function of t a sum of cosines."""
    n = system.scales.states.size
    states = x[: system.state_size].reshape(-1, n)
    if not system.is_function_of_t:
        drawn = random.standard_normal(states.shape) * (1 + np.abs(states))
    else:
        nodes = system.nodes
        part = (nodes - nodes[0]) / (nodes[-1] - nodes[0])
        waves = np.cos(np.pi * np.outer(part, np.arange(_WAVES)))
        drawn = waves @ random.standard_normal((_WAVES, n)) / np.sqrt(_WAVES) * (1 + np.abs(states).max(axis=0))
    return np.append(drawn.ravel(), np.zeros(x.size - system.state_size))
