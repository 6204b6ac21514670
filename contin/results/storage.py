"""Branches and diagrams in files: one ``.npz`` without pickles, from which every point can start another run."""

from __future__ import annotations

import io
import json
import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from contin import errors as checks
from contin.arrays import Array
from contin.boundary.grazing import Extremum, Touch
from contin.boundary.statement import BoundaryValueProblem
from contin.collocation.mesh import basis
from contin.core.protocol import Discretization
from contin.core.step import Stop
from contin.core.system import Scales, System
from contin.cycles.statement import CycleProblem
from contin.defining.special_points import BranchPointCurve, FoldCurve
from contin.equilibria.statement import AlgebraicProblem
from contin.errors import ProblemError
from contin.events.branch_point import BranchPoint
from contin.events.corner import Corner
from contin.events.labelled import finding_of
from contin.events.multiple_point import MultiplePoint
from contin.files import write_whole
from contin.problems.statement import declared
from contin.results.branch import Branch, Diagram, Junction
from contin.results.plot import unstable
from contin.results.point import Point

Result = TypeVar("Result")

#: Of several segments or of one, a problem with these states and names is the same.
_SEVERAL = "Segmented"
#: First entry of every file.
_FORMAT = "contin branch 3"
#: First entry of files of diagrams: each branch is a file in the file.
_OF_DIAGRAMS = "contin diagram 1"
#: First entry of files of version 0.2.
_OF_VERSION_2 = "contin branch 1"
#: Fields of a point that are stored as they are.
_FIELDS = (
    "label", "name", "arclength", "iterations", "newton_error", "discretization_error", "errors", "functionals", "index",
    "nullity", "index_change", "breaks", "column", "value",
)  # fmt: skip
#: Modules of the kinds of problems begin with this.
_PACKAGE = __name__.partition(".")[0] + "."
#: Arrays of a branch point that are stored besides its tangents.
_OF_BRANCH_POINT = ("kernel", "left", "hessian")


@checks.arguments
def save(branch: Branch | Diagram, path: str | Path) -> None:
    """Write a branch, a curve in two parameters, or a whole diagram to a file: all points, with their solutions.

    The problem is code and is not stored: `load` takes it again. Details of special points are kept where they are those of a
    branch point or a dictionary of numbers; of a diagram its ``searches`` are not.

    Raises
    ------
    OSError
        The file cannot be written; the one that was there is left as it was.
    ProblemError
        It has no points, or points of a kind that is not stored.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> from contin import AlgebraicProblem, solve, trace
    >>> parabola = AlgebraicProblem(lambda u, p: (p.a - u.x**2,), ["x"], {"a": 1.0})
    >>> branch = trace(solve(parabola, [1.0]), free=["a"], direction=-1, limits={"a": (-1, 4)})
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     save(branch, pathlib.Path(folder) / "b.npz")
    ...     [file.name for file in pathlib.Path(folder).iterdir()]
    ['b.npz']
    """
    if isinstance(branch, Branch):
        write_whole(path, _image(branch))
        return
    at = {id(point): (i, k) for i, each in enumerate(branch.branches) for k, point in enumerate(each.points)}
    junctions = [
        {"point": at[id(one.point)], "depth": one.depth, "taken": [list(taken.items()) for taken in one.taken],
         "failed": one.failed, "also": [at[id(point)] for point in one.also]}
        for one in branch.junctions
    ]  # fmt: skip
    images = {f"branch{i}": np.frombuffer(_image(each), dtype=np.uint8) for i, each in enumerate(branch.branches)}
    write_whole(path, _archive({"format": _OF_DIAGRAMS, "branches": len(images), "junctions": junctions}, images))


def _archive(head: dict[str, Any], arrays: dict[str, Any]) -> bytes:
    """Return a file with a head, as JSON, and arrays."""
    image = io.BytesIO()
    np.savez_compressed(image, head=np.frombuffer(json.dumps(head).encode(), dtype=np.uint8), **arrays)
    return image.getvalue()


def _image(branch: Branch) -> bytes:
    if not branch.points:
        raise ProblemError("branch: has no points")
    first: Any = branch.points[0].system
    moves = first.is_cycle or not first.is_function_of_t  # eigenvalues of a field in time take a second each
    systems: list[Any] = []
    rows: list[dict[str, Any]] = []
    arrays: dict[str, Any] = {}
    for number, point in enumerate(branch.points):
        at = next((i for i, system in enumerate(systems) if system is point.system), len(systems))
        if at == len(systems):
            systems.append(point.system)
            base = point.system.solution
            if point.system.on_curve and getattr(point.system, "kind", "") not in _curves(base):
                raise ProblemError("branch: points of this kind of curve are not stored; keep their columns")
            if base.stored is None:
                raise ProblemError(f"branch: points of a {type(base).__name__} are not stored; keep their columns")
            arrays |= {f"{name}{at}": array for name, array in base.stored.items()}
        arrays[f"x{number}"], arrays[f"tangent{number}"] = point.x, point.tangent
        arrays |= {f"{name}{number}": array for name, array in finding_of(point.details).arrays.items()}
        fields = {name: getattr(point, name) for name in _FIELDS}
        fields |= {"details": _numbers(point.details), "unstable": unstable(point) if moves else None}
        rows.append({"system": at, **fields, **finding_of(point.details).numbers})
    head = {
        "format": _FORMAT, "points": rows, "notes": list(branch.notes),
        "stop": branch.stop and [str(branch.stop.reason), branch.stop.message, branch.stop.advice],
        "free": first.free, "degrees": [system.degree for system in systems], **_statement(first.solution.problem),
        "curves": [[system.kind, system.kappa_size] for system in systems if system.on_curve],
        "further": first.size - first.base.size if first.on_curve else 0,  # unknowns that a curve adds
    }  # fmt: skip
    return _archive(head, arrays)


def _statement(problem: BoundaryValueProblem | AlgebraicProblem) -> dict[str, Any]:
    """Return by what a problem is known again: kind, names, and the matrix of a symmetry (None where none is declared)."""
    kinds = (kind.__name__ for kind in type(problem).__mro__ if kind.__module__.startswith(_PACKAGE))
    symmetry: Any = getattr(problem, "symmetry") if declared(problem, "order") > 1 else None  # noqa: B009
    return {
        "kind": next(kinds).removeprefix(_SEVERAL), "states": list(problem.state_names), "names": list(problem.parameters),
        "symmetry": symmetry if symmetry is None else symmetry.tolist(),
    }  # fmt: skip


def _said(statement: dict[str, Any]) -> str:
    """Return what `_statement` returns as problems are printed."""
    kind = "a problem " if statement["kind"] == _UNTOLD else statement["kind"]
    symmetry = "" if statement["symmetry"] in (None, _UNTOLD) else f"; symmetry {statement['symmetry']}"
    return f"{kind}(states {checks.listed(statement['states'])}; parameters {checks.listed(statement['names'])}{symmetry})"


def _curves(base: Discretization) -> dict[str, Any]:
    """Return the defining systems of curves of solutions of a problem that are stored, by the label of their points."""
    return {**{kind.kind: kind for kind in (FoldCurve, BranchPointCurve)}, **base.curves}


def _numbers(details: object) -> dict[str, float] | None:
    """Return details that are a dictionary of numbers, None for others: a user's test function may describe anything."""
    if not isinstance(details, dict) or not all(map(checks.is_number, details.values())):
        return None
    return {str(name): value if isinstance(value, int) else float(value) for name, value in details.items()}


@checks.arguments
def load(problem: BoundaryValueProblem | AlgebraicProblem, path: str | Path) -> Any:
    """Read a `Branch` or a `Diagram` from a file, as points of ``problem``; cycles are those of its equations.

    Raises
    ------
    OSError
        The file cannot be read.
    ProblemError
        It is no branch, or one of a problem with other states or parameters.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> from contin import AlgebraicProblem, solve, trace
    >>> parabola = AlgebraicProblem(lambda u, p: (p.a - u.x**2,), ["x"], {"a": 1.0})
    >>> branch = trace(solve(parabola, [1.0]), free=["a"], direction=-1, limits={"a": (-1, 4)})
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     save(branch, pathlib.Path(folder) / "b.npz")
    ...     again = load(parabola, pathlib.Path(folder) / "b.npz")
    >>> str(trace(again.points[-1], limits={"a": (-1, 9)}).stop)
    'reached a = 9'
    """

    def branch(head: dict[str, Any], arrays: dict[str, Array]) -> Branch:
        stated: Any = problem
        if head["states"] != list(problem.state_names):  # without states that follow from others
            if problem.mass is not None:
                columns = head["points"][0]["functionals"]
                stated = stated.without_found([columns.get(problem.state_names[i], 0.0) for i in problem.mass.found])
            stated = stated.on_totals
        if head["kind"] == CycleProblem.__name__ and isinstance(stated, AlgebraicProblem):
            stated = CycleProblem.of(stated)
        own, head["kind"] = _statement(stated), str(head["kind"]).removeprefix(_SEVERAL)
        if any(head[name] not in (own[name], _UNTOLD) for name in own):
            raise ProblemError(f"{str(path)!r} is of another problem: {_said(head)}, not {_said(own)}")
        systems = [_system(stated, head, arrays, i) for i in range(len(head["degrees"]))]
        points = [_point(row, systems[row["system"]], arrays, number) for number, row in enumerate(head["points"])]
        return Branch(points, Stop(*head["stop"]) if head["stop"] else None, head["notes"])

    branches, junctions = _contents(path, branch)
    if junctions is None:
        return branches[0]

    def point(at: tuple[int, int]) -> Point:
        return branches[at[0]].points[at[1]]

    return Diagram(branches, [
        Junction(point(row["point"]), row["depth"], [dict(taken) for taken in row["taken"]],
                 [tuple(failed) for failed in row["failed"]], [point(at) for at in row["also"]])
        for row in junctions
    ])  # fmt: skip


def _contents(
    path: str | Path, make: Callable[[dict[str, Any], dict[str, Array]], Result]
) -> tuple[list[Result], list[dict[str, Any]] | None]:
    """Return ``make(head, arrays)`` of each branch in a file of `save`, and the junctions of a diagram.

    Raises OSError where the file cannot be read; ProblemError where it is no branch, or ``make`` fails.
    """
    with open(path, "rb"):
        pass  # a file that cannot be read is an OSError; whatever goes wrong below is in what it holds
    try:
        with np.load(path, allow_pickle=False) as file:
            head, arrays = json.loads(file["head"].tobytes()), {name: file[name] for name in file.files}
        if head["format"] != _OF_DIAGRAMS:
            return [make(_head(head), arrays)], None
        found = []
        for i in range(head["branches"]):
            with np.load(io.BytesIO(arrays[f"branch{i}"].tobytes()), allow_pickle=False) as file:
                found.append(make(_head(json.loads(file["head"].tobytes())), {name: file[name] for name in file.files}))
        return found, head["junctions"]
    except ProblemError:
        raise
    except Exception as error:  # zip, zlib, json, numpy, and memory have many ways to say that a file is damaged
        raise ProblemError(f"{str(path)!r} is no branch stored by contin, or damaged") from error


#: What a file does not tell.
_UNTOLD = "untold"


def _head(stored: dict[str, Any]) -> dict[str, Any]:
    """Return the head of a file as it is written today.

    Version 0.2 told the column that a point is about by its name, and of values the first digits only, which are left out.
    """
    if stored["format"] == _FORMAT:
        return stored
    if stored["format"] != _OF_VERSION_2:
        raise KeyError("format")
    rows = [{"value": None, "discretization_error": math.nan, "column": "", **row} for row in stored["points"]]
    for row in rows:
        if row["name"] in (*stored["names"], *row["functionals"]):
            row["column"] = row["name"]
    return {"notes": [], "curves": [], "further": 0, "kind": _UNTOLD, "symmetry": _UNTOLD, **stored, "points": rows}


def _system(problem: BoundaryValueProblem | AlgebraicProblem, head: dict[str, Any], arrays: dict[str, Array], i: int) -> System:
    values = dict(zip(head["names"], arrays[f"parameters{i}"]))
    sizes = {name.removeprefix("scale_").removesuffix(str(i)): array for name, array in arrays.items()
             if name.startswith("scale_") and name.rstrip("0123456789") + str(i) == name}  # fmt: skip
    scales = Scales.of_arrays(sizes) if sizes else None
    base: Any = problem.discretized(head["free"], values, scales, arrays.get(f"mesh{i}", ()), head["degrees"][i])
    if f"jumps{i}" in arrays:
        base = base.with_pieces((arrays[f"jumps{i}"], arrays[f"outcomes{i}"]))
    if not head["curves"]:
        return base
    kind, size = head["curves"][i]
    return _curves(base)[kind](base, size)


def _point(row: dict[str, Any], system: Discretization, arrays: dict[str, Array], number: int) -> Point:
    x, tangent = arrays[f"x{number}"], arrays[f"tangent{number}"]
    if len(x) != system.size:
        raise ProblemError("the file is of version 0.2, which kept one point of a map's cycle only: follow it again")
    system = system.referring_to(x, tangent)
    details: BranchPoint | MultiplePoint | Corner | Touch | dict[str, float] | None = row["details"]
    if row.get("imperfection") is not None:
        kept = {name: arrays[f"{name}{number}"] for name in _OF_BRANCH_POINT}
        details = BranchPoint(x, tuple(arrays[f"tangents{number}"]), imperfection=row["imperfection"], **kept)
    elif row.get("dimension") is not None:
        kernel, tangents = arrays[f"kernel{number}"], tuple(arrays[f"tangents{number}"])
        left = tangents, row["continuum"]
        details = MultiplePoint(row["dimension"], kernel, x, lambda: left, row.get("spread", 0.0))
    elif row.get("corner") is not None:
        details = Corner(row["corner"], tuple(arrays[f"tangents{number}"]), tuple(row["unstable"]))
    elif row.get("touch") is not None:
        names, extrema, folds = row["touch"]
        details = Touch(tuple(names), tuple(Extremum(*each) for each in extrema), x, folds)
    fields: dict[str, Any] = {name: tuple(value) if isinstance(value := row[name], list) else value for name in _FIELDS}
    parameters = dict(zip(system.problem.parameters, map(float, system.all_parameters(x))))
    return Point(parameters=parameters, x=x, tangent=tangent, system=system, details=details, **fields)


# --- a stored branch without its problem, for tools that draw -----------------------------------------------------


@dataclass(frozen=True, eq=False)
class StoredColumns:
    """The table of a stored branch.

    Attributes
    ----------
    columns : dict of str to ndarray
        By name, one value a point: all parameters, all functionals, ``arclength``, ``discretization_error`` (of files that hold
        it), ``norm``, the states of equilibria, with ``max_`` and ``min_`` before their names, too; ``index`` where it is known
        (-1 where it is not), of equilibria and cycles the number of unstable eigenvalues or multipliers.
    labels, names : list of str
        Of the points; "" for regular ones.
    free : tuple of str
        The free parameters.
    stop : str
        Why the run ended.
    states : tuple of str
        Names of the states.
    profiles : list of (ndarray (nodes,), ndarray (nodes, states))
        The nodes and the states of each point; the states of an algebraic problem have one node, 0.
    """

    columns: dict[str, Array]
    labels: list[str]
    names: list[str]
    free: tuple[str, ...]
    stop: str
    states: tuple[str, ...]
    profiles: list[tuple[Array, Array]]

    def __repr__(self) -> str:
        labels = checks.listed(filter(None, self.labels))
        return f"StoredColumns({len(self.labels)} points, columns {checks.listed(self.columns)}: {labels}; {self.stop})"


@checks.arguments
def read_columns(path: str | Path) -> StoredColumns:
    """Read what a file of `contin.save` holds of its branch without the problem, which is code: columns, labels and states.

    Of a diagram it is the first branch; see `read_branches`.

    Raises
    ------
    OSError
        The file cannot be read.
    ProblemError
        It is no branch.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> from contin import AlgebraicProblem, save, solve, trace
    >>> from contin.lowlevel import read_columns
    >>> parabola = AlgebraicProblem(lambda u, p: (p.a - u.x**2,), ["x"], {"a": 1.0})
    >>> branch = trace(solve(parabola, [1.0]), free=["a"], direction=-1, limits={"a": (-1, 4)})
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     save(branch, pathlib.Path(folder) / "b.npz")
    ...     stored = read_columns(pathlib.Path(folder) / "b.npz")
    >>> list(stored.columns), stored.free, stored.states
    (['arclength', 'discretization_error', 'a', 'norm', 'x', 'max_x', 'min_x', 'index'], ('a',), ('x',))
    """
    return read_branches(path)[0]


@checks.arguments
def read_branches(path: str | Path) -> list[StoredColumns]:
    """Read what `read_columns` does, with the same errors, of each branch in a file: of a diagram, or of one."""
    return _contents(path, _columns)[0]


def _columns(head: dict[str, Any], arrays: dict[str, Array]) -> StoredColumns:
    rows, places = head["points"], [head["names"].index(name) for name in head["free"]]
    values = np.array([_parameters(head, row, arrays, number, places) for number, row in enumerate(rows)])
    columns = {"arclength": np.array([row["arclength"] for row in rows])}
    errors = np.array([row["discretization_error"] for row in rows])
    if not np.isnan(errors).all():
        columns["discretization_error"] = errors
    columns |= dict(zip(head["names"], values.T))
    columns |= {name: np.array([row["functionals"][name] for row in rows]) for name in rows[0]["functionals"]}
    profiles = [_profile(head, row, arrays, number) for number, row in enumerate(rows)]
    found = {"norm": np.array([np.sqrt(weights @ np.sum(states**2, axis=1)) for _, states, weights in profiles])}
    if all(len(times) == 1 for times, *_ in profiles):
        for i, name in enumerate(head["states"]):
            of_state = [states[:, i] for _, states, _ in profiles]
            found |= {name: np.array([one[0] for one in of_state])}
            found |= {f"{word}_{name}": np.array([getattr(np, word)(one) for one in of_state]) for word in ("max", "min")}
    columns |= {name: one for name, one in found.items() if name not in columns}
    index = [row.get("unstable") if row["index"] is None else row["index"] for row in rows]
    if any(count is not None for count in index):
        columns["index"] = np.array([-1 if count is None else count for count in index], dtype=float)
    return StoredColumns(
        columns, [row["label"] for row in rows], [row["name"] for row in rows], tuple(head["free"]),
        " ".join(filter(None, (head["stop"] or ())[1:])), tuple(head["states"]),
        [(times, states) for times, states, _ in profiles],
    )  # fmt: skip


def _solution(head: dict[str, Any], arrays: dict[str, Array], number: int) -> Array:
    """Return the unknowns of a point without those that a curve in two parameters adds."""
    x: Array = arrays[f"x{number}"]
    return x[: len(x) - head["further"]]


def _parameters(head: dict[str, Any], row: dict[str, Any], arrays: dict[str, Array], number: int, places: list[int]) -> Array:
    """Return all parameters of a point, the free ones from the end of x."""
    at, count = row["system"], len(places)
    values = np.array(arrays[f"parameters{at}"], dtype=float)
    if count:
        sizes = arrays.get(f"scale_parameters{at}")
        values[places] = _solution(head, arrays, number)[-count:] * (1 if sizes is None else sizes[places])
    return values


def _profile(head: dict[str, Any], row: dict[str, Any], arrays: dict[str, Array], number: int) -> tuple[Array, Array, Array]:
    """Return the nodes and the states of a point, and the weights of the mean over the nodes."""
    at, count = row["system"], len(head["states"])
    x = _solution(head, arrays, number)
    states = x[: len(x) - len(head["free"])].reshape(-1, count)
    if f"scale_states{at}" in arrays:
        states = states * arrays[f"scale_states{at}"]
    if f"mesh{at}" not in arrays:
        return np.zeros(1), states, np.full(len(states), 1 / len(states))
    mesh = arrays[f"mesh{at}"]
    degree, h = head["degrees"][at], np.diff(mesh)[:, None]
    weights = np.zeros(len(states))
    np.add.at(weights, degree * np.arange(len(h))[:, None] + np.arange(degree + 1), h * basis(degree).node_weights / h.sum())
    return np.append((mesh[:-1, None] + h * basis(degree).nodes[:-1]).ravel(), mesh[-1]), states, weights
