"""Signs, bases and orders of null vectors that round-off cannot turn.

A null vector is known up to its sign, a basis of a null space up to a rotation, and the arms of a symmetric bifurcation have no
order. Libraries choose each by round-off, which differs between processors. Here all are decided by large components in scaled
units: of the components almost as large as the largest, the one of lowest index. Mirror images have equal components, which
round-off and the mesh make different by a little; therefore "almost".
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from typing import Any

import numpy as np

from contin.arrays import Array
from contin.levels import APART

#: Part of the largest component from which another one counts as equal. On a mesh of ten intervals the humps of sin(8 pi t), of
#: equal height, differ by 5 % at the nodes. 0.9, 0.87 and 0.71 are ratios of symmetric problems: it must be none of them.
_EQUAL = 0.89
#: Cosine below which two directions count as orthogonal. Of the branch points of eight problems of the bank, along the last
#: step: 1e-15 to 1e-14 where a symmetry makes them so, 1e-7 to 1e-5 from errors of steps, 4e-4 and more elsewhere. Ten times
#: larger, the latter are oriented by their components, not by the branch that they leave.
_ORTHOGONAL = 1e-4


def pivot(vector: Any) -> int:
    """Return the lowest index of a component almost as large as the largest one.

    Examples
    --------
    >>> pivot(np.array([0.1, -1.0, 1.0 + 1e-15]))
    1
    """
    sizes = np.abs(vector)
    return int(np.argmax(sizes >= _EQUAL * sizes.max()))


def oriented(vector: Any) -> Any:
    """Return a vector times the number of modulus one that makes its component at `pivot` real and positive.

    Examples
    --------
    >>> oriented(np.array([0.1, -1.0, 1.0 + 1e-15])).tolist()[:2]
    [-0.1, 1.0]
    """
    component = vector[pivot(vector)]
    return vector if not component else vector * (np.conj(component) / abs(component))


def oriented_along(vector: Array, cosine: float) -> Array:
    """Return a unit vector with the sign of its cosine with a direction; `oriented` where it is orthogonal to that.

    Examples
    --------
    >>> oriented_along(np.array([0.0, -1.0]), -1e-16).tolist(), oriented_along(np.array([0.6, -0.8]), 0.6).tolist()
    ([-0.0, 1.0], [0.6, -0.8])
    """
    return vector * np.sign(cosine) if abs(cosine) > _ORTHOGONAL else oriented(vector)


def canonical_basis(vectors: Array, weights: Array | float = 1.0) -> Array:
    """Return the orthonormal basis of the space that rows span that does not depend on these rows.

    It consists of the projections of unit vectors onto the space, each made orthogonal to those before it: first the one with
    the largest projection (`pivot`), then the one of which most is left, and so on.

    - ``vectors`` (ndarray, shape (count, size)): Linearly independent.
    - ``weights`` (ndarray, shape (size,), or float): Of the inner product.

    Examples
    --------
    >>> abs(canonical_basis(np.array([[1.0, 1.0, 0.0], [-1.0, 1.0, 0.0]]))).round(9).tolist()
    [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]
    """
    root = np.sqrt(weights)
    basis = np.linalg.qr((vectors * root).T)[0]  # (size, count)
    result: list[Array] = []
    for _ in range(len(vectors)):
        lengths = np.linalg.norm(basis, axis=1) / root  # largest component at each index that a unit vector of the space has
        chosen = basis[pivot(lengths)]
        direction = basis @ chosen
        result.append(direction / np.linalg.norm(direction))
        basis = basis - np.outer(basis @ chosen, chosen) / (chosen @ chosen)  # what is left: orthogonal to the direction
    return np.array(result) / root


def eigenbasis(values: Array, vectors: Array) -> Array:
    """Return eigenvectors of a symmetric matrix (rows), with their signs and, of equal eigenvalues, their rotation stated.

    Each is `oriented`; those of equal eigenvalues, which must be neighbours, become the `canonical_basis` of their space.

    Parameters
    ----------
    values : ndarray, shape (count,)
    vectors : ndarray, shape (count, size)

    Examples
    --------
    >>> eigenbasis(np.array([1.0, 2.0, 2.0]), np.array([[0.0, 0, -1], [0.6, 0.8, 0], [0.8, -0.6, 0]])).round(9).tolist()
    [[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]
    """
    apart = np.abs(np.diff(values)) > APART * np.abs(values).max(initial=0.0)
    groups = np.split(np.arange(len(values)), np.flatnonzero(apart) + 1)
    rows = [canonical_basis(vectors[group]) if len(group) > 1 else [oriented(vectors[i]) for i in group] for group in groups]
    return np.concatenate(rows).reshape(vectors.shape) + 0.0


def ordered(vectors: Sequence[Array], cosines: Sequence[float]) -> list[int]:
    """Return the order of oriented unit vectors: by their angles with a direction, either way along it, the smallest first.

    Of those with equal angles the one comes first that is larger at the first index where they differ much. Cosines would not
    tell vectors near the direction apart: where branches cross at 0.01 rad, those of both are 1 to four digits.

    Examples
    --------
    >>> arms = [np.array([0.0, 1.0]), np.array([0.6, -0.8]), np.array([0.6, 0.8])]
    >>> ordered(arms, [1e-16, 0.0, -1e-17])
    [2, 1, 0]
    """

    angles = np.arccos(np.minimum(np.abs(cosines), 1.0))

    def compare(i: int, j: int) -> int:
        nearer = angles[j] - angles[i]
        if abs(nearer) > _ORTHOGONAL:
            return -1 if nearer > 0 else 1
        apart = vectors[i] - vectors[j]
        much = np.abs(apart) > (1 - _EQUAL) * max(np.abs(vectors[i]).max(), np.abs(vectors[j]).max())
        return (-1 if apart[np.argmax(much)] > 0 else 1) if much.any() else 0

    return sorted(range(len(vectors)), key=functools.cmp_to_key(compare))


def first_least(values: Sequence[float] | Array) -> int:
    """Return the lowest index of a value equal to the smallest of some positive ones, but for round-off.

    Examples
    --------
    >>> first_least([2.0, 1.0 + 1e-12, 1.0])
    1
    """
    sizes = np.asarray(values)
    return int(np.argmax(sizes <= (1 + APART) * sizes.min()))
