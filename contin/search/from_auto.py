"""AUTO-07p's files: branches and labelled solutions (``b.NAME``, ``s.NAME``), and a point of contin from a solution."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from contin import errors as checks
from contin.arrays import Array
from contin.boundary.statement import BoundaryValueProblem
from contin.collocation.mesh import basis, interpolation
from contin.continuation.run import Continuation
from contin.core.labels import Label
from contin.core.settings import Settings
from contin.core.system import System
from contin.cycles.statement import CycleProblem
from contin.equilibria.equations import Algebraic
from contin.equilibria.statement import AlgebraicProblem
from contin.errors import ConvergenceError, ProblemError
from contin.problems.angles import windings
from contin.problems.statement import PERIOD, ROUNDS, with_multipliers
from contin.results.point import Point

#: AUTO's codes of labelled points. Of more than one digit they hold the kind of curve before the last digit.
_LABELS = {
    1: "BP", 2: "LP", 3: "HB", 4: "RG", 5: "LP", 6: "BP", 7: "PD", 8: "TR", 9: "EP", -1: "BT", -2: "CP", -3: "ZH", -4: "UZ",
    -5: "R1", -6: "R2", -7: "R3", -8: "R4", -9: "MX",
}  # fmt: skip
#: Generalized Hopf points, whose code is none of those above.
_GENERALIZED_HOPF = -32
#: Characters of a row before its values: branch, point, type and label.
_HEAD = 19
#: A number of Fortran: an exponent of three digits may have no letter.
_NUMBER = re.compile(r"([-+]?\d*\.\d+)(?:[EeDd]?([-+]\d+))?")


@dataclass(frozen=True, eq=False)
class AutoSolution:
    """A labelled solution of AUTO-07p.

    Attributes
    ----------
    label, number : str, int
        AUTO's two letters (RG for every NPR-th point), and its number, by which AUTO restarts.
    parameters : mapping of str to float
        By name, ``"PAR(1)"`` where AUTO and `read_auto` were given none. PAR(11) is the period of a cycle.
    t, states : ndarray, shapes (K,) and (K, n)
        The solution on 0 <= t <= 1; of an equilibrium K = 1. The pair is a guess for `contin.solve`.
    intervals, degree : int
        AUTO's mesh: NTST and NCOL; degree 0 of an equilibrium.

    Examples
    --------
    >>> rest = AutoSolution("EP", 1, {"PAR(1)": 0.5}, np.zeros(1), np.array([[0.0, 2.0]]), 1, 0)
    >>> rest
    AutoSolution(EP 1: PAR(1)=0.5)
    """

    label: str
    number: int
    parameters: Mapping[str, float]
    t: Array
    states: Array
    intervals: int
    degree: int

    def __repr__(self) -> str:
        values = ", ".join(f"{name}={value:.6g}" for name, value in self.parameters.items() if value)
        return f"AutoSolution({self.label} {self.number}: {values})"


@dataclass(frozen=True, eq=False)
class AutoBranch:
    """A branch of AUTO-07p: the columns of all its points, and the solutions at labels.

    Attributes
    ----------
    columns : dict of str to ndarray
        By AUTO's heading: the free parameters, ``"L2-NORM"``, maxima or values of the states.
    labels : list of str
        Of all points in order; "" for those without.
    solutions : list of AutoSolution

    Examples
    --------
    >>> branch = AutoBranch({"PAR(1)": np.array([0.0, 1.0])}, ["EP", "EP"])
    >>> branch
    AutoBranch(2 points: EP, EP; PAR(1))
    """

    columns: dict[str, Array]
    labels: list[str]
    solutions: list[AutoSolution] = field(default_factory=list)

    def __repr__(self) -> str:
        labels = checks.listed(filter(None, self.labels))
        return f"AutoBranch({len(self.labels)} points: {labels}; {checks.listed(self.columns)})"

    def __len__(self) -> int:
        return len(self.labels)

    def labelled(self, label: str) -> list[AutoSolution]:
        """Return the solutions that carry a label, in order.

        Examples
        --------
        >>> AutoBranch({}, []).labelled("HB")
        []
        """
        return [solution for solution in self.solutions if solution.label == label]


@dataclass
class _Block:
    """Rows of the file of branches that belong to one branch, and the headings above them."""

    headings: str
    names: dict[int, str]
    rows: list[str] = field(default_factory=list)

    @property
    def heads(self) -> list[tuple[int, int, int, int]]:
        """Branch, point, type and label of all rows."""
        return [tuple(map(int, row.split()[:4])) for row in self.rows]  # type: ignore[misc]

    def branch(self) -> AutoBranch:
        """Return the branch without its solutions."""
        values = np.array([_numbers(row[_HEAD:]) for row in self.rows])
        width = (len(self.rows[0].rstrip("\n")) - _HEAD) // values.shape[1]
        names = [self.headings[_HEAD + k * width : _HEAD + (k + 1) * width].strip() for k in range(values.shape[1])]
        auto = [re.fullmatch(r"PAR\((\d+)\)", name.replace("PERIOD", _PERIOD)) for name in names]
        names = [self.names.get(int(found[1]), name) if found else name for name, found in zip(names, auto)]
        return AutoBranch(dict(zip(names, values.T)), [_label(head[2]) if head[3] else "" for head in self.heads])


@checks.arguments
def read_auto(folder: str | Path, name: str | None = None, *, parameters: Mapping[int, str] | None = None) -> list[AutoBranch]:
    """Read the branches that AUTO-07p wrote: ``b.NAME`` and ``s.NAME``, or fort.7 and fort.8.

    `from_auto` makes a point of a solution, from which `trace` goes on.

    Parameters
    ----------
    folder : str or Path
    name : str, optional
        The name under which AUTO saved the run; fort.7 and fort.8 without.
    parameters : mapping of int to str, optional
        Names by AUTO's number: ``{1: "mu"}`` for PAR(1). Names that AUTO was given (``parnames``) are known.

    Returns
    -------
    list of AutoBranch
        In the order of the file.

    Raises
    ------
    OSError
        A file cannot be read.
    ProblemError
        A file is none of AUTO-07p.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     _ = (pathlib.Path(folder) / "fort.7").write_text(
    ...         "   0    PT  TY  LAB      PAR(1)            L2-NORM      \\n"
    ...         "   1     1   9    1  0.0000000000E+00   2.0000000000E+00\\n"
    ...     )
    ...     _ = (pathlib.Path(folder) / "fort.8").write_text("")
    ...     read_auto(folder, parameters={1: "mu"})
    [AutoBranch(1 points: EP; mu, L2-NORM)]
    """
    given = {} if parameters is None else parameters
    files = [Path(folder) / (f"fort.{unit}" if name is None else f"{letter}.{name}") for letter, unit in (("b", 7), ("s", 8))]
    texts = [file.read_text(encoding="utf-8", errors="replace") for file in files]
    try:
        blocks = list(_blocks(texts[0], given))
        branches = [block.branch() for block in blocks]
    except (ValueError, IndexError) as error:
        raise ProblemError(f"{str(files[0])!r} is no file of branches of AUTO-07p") from error
    try:
        _add_solutions(branches, blocks, texts[1])
    except (ValueError, IndexError) as error:
        raise ProblemError(f"{str(files[1])!r} is no file of solutions of AUTO-07p, or not that of the branches") from error
    return branches


def _label(code: int) -> str:
    """Return AUTO's two letters."""
    if code == _GENERALIZED_HOPF:
        return "GH"
    last = abs(code) % 10
    return _LABELS.get(last if code > 0 else -last, "")


def _numbers(text: str) -> list[float]:
    return [float(f"{digits}e{exponent or 0}") for digits, exponent in _NUMBER.findall(text)]


def _blocks(text: str, given: Mapping[int, str]) -> Iterator[_Block]:
    """Yield the branches of a file, which begin with lines of branch 0, the last with headings; raise ValueError if none."""
    block: _Block | None = None
    names: dict[int, str] = {}
    for line in text.splitlines():
        number = int(line.split(maxsplit=1)[0])
        if number == 0:
            if block is not None and block.rows:
                yield block
                names = {}
            if found := re.match(r"\s*0\s+parnames\s*=\s*(\{.*\})", line):
                names = ast.literal_eval(found[1])
            block = _Block(line, {**names, **given})
            continue
        if block is None:
            raise ValueError("rows without headings")
        block.rows.append(line)
    if block is None or not block.rows:
        raise ValueError("no branch")
    yield block


def _add_solutions(branches: list[AutoBranch], blocks: list[_Block], text: str) -> None:
    """Read all solutions, and add each to the branch that lists it.

    A solution begins with a line of at least twelve whole numbers: branch, point, type, label, number of free parameters, ISW,
    number of places, numbers at a place (t and the states), number of lines that follow, NTST, NCOL, number of parameters.
    """
    lines = text.splitlines()
    at, first = 0, 0
    while at < len(lines):
        head = [int(word) for word in lines[at].split()]
        count, width, following = head[6:9]
        values = _numbers(" ".join(lines[at + 1 : at + 1 + following]))
        places = np.array(values[: count * width]).reshape(count, width)
        wanted = (abs(head[0]), abs(head[1]), head[3])
        first = next(i for i in [*range(first, len(blocks)), *range(first)] if wanted in _known(blocks[i]))
        names = blocks[first].names
        parameters = {names.get(i + 1, f"PAR({i + 1})"): value for i, value in enumerate(values[len(values) - head[11] :])}
        found = AutoSolution(_label(head[2]), head[3], parameters, places[:, 0], places[:, 1:], head[9], head[10])
        branches[first].solutions.append(found)
        at += 1 + following


def _known(block: _Block) -> set[tuple[int, int, int]]:
    """Return branch, point and label of all rows with a label."""
    return {(abs(branch), abs(point), label) for branch, point, _, label in block.heads if label}


#: Labels of points that contin locates, too.
_LOCATED = (Label.BRANCH_POINT, Label.FOLD, Label.HOPF, Label.PERIOD_DOUBLING, Label.TORUS)
#: First step of the runs back from AUTO's solution and across it, in units of arclength. Ten times larger, more than one point
#: of a kind can lie in it.
_STEP = 0.01
#: Most points of the run that looks for AUTO's point: steps grow from the first one, so that two or three lead there.
_LOOKS = 20
#: The point found is AUTO's if its parameter is as close as this: AUTO's tolerance of special points is 1e-4 by default. Ten
#: times larger, the next point of the same kind could be taken.
_CLOSE = 1e-2
#: AUTO's number of the period.
_PERIOD = "PAR(11)"


@checks.arguments
def from_auto(
    problem: BoundaryValueProblem | AlgebraicProblem, solution: AutoSolution, *, free: Sequence[str],
    parameters: Mapping[str, float] | None = None,
) -> Point:  # fmt: skip
    """Return the point of a problem that a solution of AUTO-07p states, corrected and, at BP, LP, HB, PD and TR, located.

    Parameters
    ----------
    problem : BoundaryValueProblem or AlgebraicProblem
        With the states in AUTO's order. Of cycles the period is AUTO's PAR(11).
    solution : AutoSolution
        Of `read_auto`.
    free : sequence of str
        The free parameters of the branch, the first is the primary one.
    parameters : mapping of str to float, optional
        Values of parameters that AUTO has under another name, or not at all.

    Raises
    ------
    ProblemError
        The solution lacks a parameter of the problem, or has another number of states.
    ConvergenceError
        No such point of the problem is near by: it states other equations than AUTO had.

    Examples
    --------
    >>> from contin import AlgebraicProblem, trace
    >>> from contin.auto07p import AutoSolution
    >>> parabola = AlgebraicProblem(lambda u, p: (p.a - u.x**2,), ["x"], {"a": 1.0})
    >>> found = AutoSolution("LP", 2, {"a": 1e-7}, np.zeros(1), np.array([[1e-4]]), 1, 0)
    >>> fold = from_auto(parabola, found, free=["a"])
    >>> fold.label, abs(fold["a"]) < 1e-12
    ('LP', True)
    """
    if solution.states.shape[1] != len(problem.state_names):
        count = len(problem.state_names)
        raise ProblemError(f"solution: {solution.states.shape[1]} states must be {count}, as the problem has")
    values = _values(problem, solution, parameters or {})
    system, x = _system(problem, solution, with_multipliers(problem, checks.names("free", free)), values)
    if solution.label not in _LOCATED:
        return next(iter(Continuation(system, x)))
    return _located(system, x, solution)


def _values(
    problem: BoundaryValueProblem | AlgebraicProblem, solution: AutoSolution, given: Mapping[str, float]
) -> dict[str, float]:
    """Return the values of all parameters of a problem; raise ProblemError where one is missing."""
    own = {}
    if isinstance(problem, CycleProblem):
        own = {ROUNDS: 1.0} if problem.period is not None else {PERIOD: solution.parameters.get(_PERIOD, 0.0)}
        own |= windings(problem.angles, problem.state_names, solution.states[-1] - problem.symmetry @ solution.states[0])
    known = {**own, **solution.parameters, **given}
    for name in problem.parameters:
        if name not in known:
            raise ProblemError(
                f"solution: has no parameter {name!r}; give its number to read_auto (parameters={{1: {name!r}}}), or its value"
            )
    return {name: known[name] for name in problem.parameters}


def _system(
    problem: BoundaryValueProblem | AlgebraicProblem, solution: AutoSolution, free: Sequence[str], values: Mapping[str, float]
) -> tuple[System, Array]:
    """Return the discretized problem on AUTO's mesh, and the solution as its unknowns."""
    if problem.domain is None:
        algebraic = Algebraic(problem, free, values)
        return algebraic, algebraic.pack(solution.states, values)
    degree, (a, b) = solution.degree, problem.domain
    if not degree:
        raise ProblemError("solution: is an equilibrium; state the problem as an AlgebraicProblem")
    system = problem.discretized(free, values, None, a + (b - a) * solution.t[::degree], degree)
    places = np.linspace(0, 1, degree + 1)  # AUTO's divide each interval into equal parts; states are wanted at Lobatto nodes
    matrix = interpolation(places, 1 / (places[:, None] - places + np.eye(degree + 1)).prod(axis=1), basis(degree).nodes)
    starts = range(0, len(solution.t) - 1, degree)
    inner = [matrix[:-1] @ solution.states[start : start + degree + 1] for start in starts]
    x = system.pack(np.concatenate([*inner, solution.states[-1:]]), values)
    return system.with_reference(x), x


def _located(system: System, x: Array, solution: AutoSolution) -> Point:
    """Return the special point near x; raise ConvergenceError where there is none of this label.

    The run goes some steps back, then forth across it, or the other way.
    """
    primary = system.free[0]
    wanted = float(x[system.parameter_index(primary)])
    sizes = dict.fromkeys((*system.problem.states, *system.free), 1.0)  # at a special point, those of x may not be typical
    for scales in (sizes, {}):
        *_, back = Continuation(system, x, Settings(direction=-1, step=_STEP, max_points=2, errors=False, scales=scales))
        way = 1 if wanted >= back[primary] else -1
        for direction in (way, -way):
            settings = Settings(direction=direction, step=_STEP, max_points=_LOOKS, scales=scales)
            for point in Continuation(back.system, back.x, settings):
                if point.label == solution.label and abs(point[primary] - wanted) <= _CLOSE * (1 + abs(wanted)):
                    return point
    raise ConvergenceError(
        f"solution: no {solution.label} of the problem is near AUTO's label {solution.number}; compare the equations"
    )
