"""Branches in files: one ``.npz`` without pickles, from which every point can start another run."""

from __future__ import annotations

import io
import json
import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from contin import checks
from contin.arrays import Array
from contin.boundary.statement import BoundaryValueProblem
from contin.boundary.system import Collocation
from contin.core.protocol import Discretization
from contin.core.scales import Scales
from contin.core.state import Stop
from contin.defining.branch_point_curve import BranchPointCurve
from contin.defining.fold_curve import FoldCurve
from contin.equilibria.statement import AlgebraicProblem
from contin.equilibria.system import Algebraic
from contin.errors import ProblemError
from contin.events.branch_point import BranchPoint
from contin.events.labelled import finding_of
from contin.events.multiple_point import MultiplePoint
from contin.files import write_whole
from contin.problems.statement import declared
from contin.results.branch import Branch
from contin.results.point import Point

Result = TypeVar("Result")

#: First entry of every file, and of a curve in two parameters: another number where an older version could not read it.
_FORMAT, _OF_CURVE = "contin branch 1", "contin branch 2"
#: Arrays of a branch point that are stored besides its tangents.
_OF_BRANCH_POINT = ("kernel", "left", "hessian")


def save(branch: Branch, path: str | Path) -> None:
    """Write a branch, or a curve in two parameters, to a file: all its points, with their solutions.

    The problem is code and is not stored: `load` takes it again. Details of special points are kept where they are those of a
    branch point or a dictionary of numbers.

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
    checks.instance("branch", branch, Branch, "a Branch")
    if not branch.points:
        raise ProblemError("branch: has no points")
    systems: list[Any] = []
    rows: list[dict[str, Any]] = []
    arrays: dict[str, Any] = {}
    for number, point in enumerate(branch.points):
        at = next((i for i, system in enumerate(systems) if system is point.system), len(systems))
        if at == len(systems):
            systems.append(point.system)
            arrays |= _arrays_of(point.system, at)
        arrays[f"x{number}"], arrays[f"tangent{number}"] = point.x, point.tangent
        arrays |= {f"{name}{number}": array for name, array in finding_of(point.details).arrays.items()}
        rows.append(_row(point, at))
    first: Any = branch.points[0].system
    curves = [[system.kind, system.kappa_size] for system in systems if system.on_curve]
    further = first.size - first.base.size if first.on_curve else 0  # unknowns that a curve adds
    stop = branch.stop and [str(branch.stop.reason), branch.stop.message, branch.stop.advice]
    head = {
        "format": _OF_CURVE if curves else _FORMAT, "points": rows, "stop": stop, "free": first.free,
        "degrees": [s.degree for s in systems], "states": first.problem.states, "names": list(first.problem.parameters),
        "symmetry": _symmetry(first.solution.problem), "notes": list(branch.notes),
    }  # fmt: skip
    if curves:
        head |= {"curves": curves, "further": further, "symmetric": head["symmetry"] is not None}
    image = io.BytesIO()
    np.savez_compressed(image, head=np.frombuffer(json.dumps(head).encode(), dtype=np.uint8), **arrays)
    write_whole(path, image.getvalue())


def _symmetry(problem: Any) -> list[list[float]] | None:
    """Return the matrix of the symmetry of cycles; None where none is declared."""
    return problem.symmetry.tolist() if declared(problem, "order") > 1 else None


def _row(point: Point, at: int) -> dict[str, Any]:
    """Return what is stored of a point besides arrays; ``at`` is the number of its system."""
    return {
        "label": point.label, "name": point.name, "system": at, "functionals": dict(point.functionals),
        "arclength": point.arclength, "iterations": point.iterations, "newton_error": point.newton_error,
        "discretization_error": point.discretization_error,
        "errors": dict(point.errors), "imperfection": None, "dimension": None, "continuum": False, "spread": 0.0,
        **finding_of(point.details).numbers,
        "index": point.index, "nullity": point.nullity, "index_change": point.index_change, "breaks": point.breaks,
        "details": _numbers(point.details), "column": point.column, "value": point.value,
    }  # fmt: skip


def _arrays_of(system: Any, number: int) -> dict[str, Array]:
    """Return what is stored of a discretized problem.

    Raises
    ------
    ProblemError
        It is of a kind that is not stored.
    """
    base = system.base if system.on_curve else system
    if system.on_curve and system.kind not in _curves(base):
        raise ProblemError("branch: points of this kind of curve are not stored; keep their columns")
    arrays: dict[str, Array] | None = base.stored
    if arrays is None:
        raise ProblemError(f"branch: points of a {type(base).__name__} are not stored; keep their columns")
    return {f"{name}{number}": array for name, array in arrays.items()}


def _curves(base: Discretization) -> dict[str, Any]:
    """Return the extended systems of curves of solutions of a problem that are stored, by the label of their points."""
    return {**{kind.kind: kind for kind in (FoldCurve, BranchPointCurve)}, **base.curves}


def _numbers(details: Any) -> dict[str, float] | None:
    """Return details that are a dictionary of numbers, None for others: a user's test function may describe anything."""
    if not isinstance(details, dict) or not all(map(checks.is_number, details.values())):
        return None
    return {str(name): value if isinstance(value, int) else float(value) for name, value in details.items()}


def load(problem: BoundaryValueProblem | AlgebraicProblem, path: str | Path) -> Branch:
    """Read a branch from a file, as points of ``problem``.

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
    checks.instance("problem", problem, (BoundaryValueProblem, AlgebraicProblem), "a BoundaryValueProblem or AlgebraicProblem")

    def branch(head: dict[str, Any], arrays: dict[str, Array]) -> Branch:
        if tuple(head["states"]) != problem.state_names or head["names"] != list(problem.parameters):
            raise ProblemError(f"{str(path)!r} is of a problem with states {head['states']} and parameters {head['names']}")
        told = "symmetric" in head or not head.get("curves")  # version 0.2 did not tell it of curves
        if told and head.get("symmetry") != _symmetry(problem):
            raise ProblemError(f"{str(path)!r} is of a problem with the symmetry {head.get('symmetry')}")
        systems = [_system(problem, head, arrays, i) for i in range(len(head["degrees"]))]
        points = [_point(row, systems[row["system"]], arrays, number) for number, row in enumerate(head["points"])]
        return Branch(points, Stop(*head["stop"]) if head["stop"] else None, list(head.get("notes", [])))

    return contents(path, branch)


def contents(path: str | Path, make: Callable[[dict[str, Any], dict[str, Array]], Result]) -> Result:
    """Return ``make(head, arrays)`` of what a file of `save` holds.

    Raises
    ------
    OSError
        The file cannot be read.
    ProblemError
        It is no branch, or ``make`` fails.
    """
    with open(path, "rb"):
        pass  # a file that cannot be read is an OSError; whatever goes wrong below is in what it holds
    try:
        with np.load(path, allow_pickle=False) as file:
            head = json.loads(file["head"].tobytes())
            if head["format"] not in (_FORMAT, _OF_CURVE):
                raise KeyError("format")
            return make(head, {name: file[name] for name in file.files})
    except ProblemError:
        raise
    except Exception as error:  # zip, zlib, json, numpy, and memory have many ways to say that a file is damaged
        raise ProblemError(f"{str(path)!r} is no branch stored by contin, or damaged") from error


def _system(
    problem: BoundaryValueProblem | AlgebraicProblem, head: dict[str, Any], arrays: dict[str, Array], i: int
) -> Discretization:
    base = _base(problem, head, arrays, i)
    if not head.get("curves"):
        return base
    kind, size = head["curves"][i]
    found: Discretization = _curves(base)[kind].of_size(base, size)
    return found


def _base(
    problem: BoundaryValueProblem | AlgebraicProblem, head: dict[str, Any], arrays: dict[str, Array], i: int
) -> Collocation | Algebraic:
    values = dict(zip(head["names"], arrays[f"parameters{i}"]))
    sizes = {name.removeprefix("scale_").removesuffix(str(i)): array for name, array in arrays.items()
             if name.startswith("scale_") and name.rstrip("0123456789") + str(i) == name}  # fmt: skip
    scales = Scales.of_arrays(sizes) if sizes else None
    return problem.discretized(head["free"], values, scales, arrays.get(f"mesh{i}", ()), head["degrees"][i])


def _column_of(row: dict[str, Any], parameters: Mapping[str, float]) -> tuple[str, float | None]:
    """Return the column that a point is about, and its value.

    Files of earlier versions have them in the name only, the value to a few digits: that of the point is better, where it
    agrees. Another name is a user's.
    """
    if "column" in row:
        return row["column"], row["value"]
    column, _, text = row["name"].removeprefix("possible ").partition(" = ")
    values = {**parameters, **row["functionals"]}
    if column not in values or (text and not _is_number(text, values[column])):
        return "", None
    return column, values[column] if text and not row["name"].startswith("possible ") else None


def _is_number(text: str, value: float) -> bool:
    """Return whether a text is a value to the six digits that names have."""
    try:
        return math.isclose(float(text), value, rel_tol=1e-5, abs_tol=1e-9)
    except ValueError:
        return False


def _point(row: dict[str, Any], system: Discretization, arrays: dict[str, Array], number: int) -> Point:
    x = arrays[f"x{number}"]
    if len(x) != system.size:
        raise ProblemError("the file is of an earlier version, which kept one point of a map's cycle only: follow it again")
    system = system.referring_to(x, arrays[f"tangent{number}"])
    details: BranchPoint | MultiplePoint | dict[str, float] | None = row.get("details")
    if row["imperfection"] is not None:
        kept = {name: arrays[f"{name}{number}"] for name in _OF_BRANCH_POINT}
        details = BranchPoint(x, tuple(arrays[f"tangents{number}"]), imperfection=row["imperfection"], **kept)
    elif row.get("dimension") is not None:
        tangents = tuple(arrays[f"tangents{number}"])
        details = MultiplePoint(
            row["dimension"], arrays[f"kernel{number}"], x, tangents, row["continuum"], row.get("spread", 0.0)
        )
    parameters = dict(zip(system.problem.parameters, map(float, system.all_parameters(x))))
    return Point(
        row["label"], row["name"], parameters, row["functionals"], x, arrays[f"tangent{number}"], system, row["arclength"],
        row["iterations"], row["newton_error"], row["errors"], details, row.get("index"), row.get("nullity", 0),
        None if row.get("index_change") is None else tuple(row["index_change"]), tuple(row.get("breaks", ())),
        *_column_of(row, parameters),
        row.get("discretization_error", np.nan),
    )  # fmt: skip
