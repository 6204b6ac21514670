"""A stored branch without its problem: the table of its points and their states, for tools that draw."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from contin import errors as checks
from contin.arrays import Array
from contin.collocation.mesh import basis
from contin.results.storage import contents


@dataclass(frozen=True, eq=False)
class StoredColumns:
    """The table of a stored branch.

    Attributes
    ----------
    columns : dict of str to ndarray
        By name, one value a point: all parameters, all functionals, ``arclength``, ``discretization_error`` (of files that hold
        it), and ``index`` where it is known (-1 where it is not).
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

    Examples
    --------
    >>> import pathlib, tempfile
    >>> from contin import AlgebraicProblem, save, solve, trace
    >>> parabola = AlgebraicProblem(lambda u, p: (p.a - u.x**2,), ["x"], {"a": 1.0})
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = pathlib.Path(folder) / "b.npz"
    ...     save(trace(solve(parabola, [1.0]), free=["a"], direction=-1, limits={"a": (-1, 4)}), path)
    ...     stored = read_columns(path)
    >>> list(filter(None, stored.labels)), stored.stop
    (['EP', 'LP', 'EP'], 'reached a = 4')
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
    """Read what a file of `contin.save` holds without the problem, which is code: columns, labels and states.

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
    (['arclength', 'discretization_error', 'a'], ('a',), ('x',))
    """
    return contents(path, _columns)


def _columns(head: dict[str, Any], arrays: dict[str, Array]) -> StoredColumns:
    rows, places = head["points"], [head["names"].index(name) for name in head["free"]]
    values = np.array([_parameters(head, row, arrays, number, places) for number, row in enumerate(rows)])
    columns = {"arclength": np.array([row["arclength"] for row in rows])}
    errors = np.array([row["discretization_error"] for row in rows])
    if not np.isnan(errors).all():
        columns["discretization_error"] = errors
    columns |= dict(zip(head["names"], values.T))
    columns |= {name: np.array([row["functionals"][name] for row in rows]) for name in rows[0]["functionals"]}
    if any(row["index"] is not None for row in rows):
        columns["index"] = np.array([-1 if row["index"] is None else row["index"] for row in rows], dtype=float)
    return StoredColumns(
        columns, [row["label"] for row in rows], [row["name"] for row in rows], tuple(head["free"]),
        " ".join(filter(None, (head["stop"] or ())[1:])), tuple(head["states"]),
        [_profile(head, row, arrays, number) for number, row in enumerate(rows)],
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


def _profile(head: dict[str, Any], row: dict[str, Any], arrays: dict[str, Array], number: int) -> tuple[Array, Array]:
    """Return the nodes and the states of a point."""
    at, count = row["system"], len(head["states"])
    x = _solution(head, arrays, number)
    states = x[: len(x) - len(head["free"])].reshape(-1, count)
    if f"scale_states{at}" in arrays:
        states = states * arrays[f"scale_states{at}"]
    if f"mesh{at}" not in arrays:
        return np.zeros(1), states
    mesh = arrays[f"mesh{at}"]
    inner = mesh[:-1, None] + np.diff(mesh)[:, None] * basis(head["degrees"][at]).nodes[:-1]
    return np.append(inner.ravel(), mesh[-1]), states
