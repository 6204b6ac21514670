"""Eigenvalues of a product of matrices that is never formed: Floquet multipliers of any size, each to relative accuracy.

The product P = F_N ... F_1 of transition matrices may have eigenvalues of 1e8 and 1e-16, or far beyond what numbers hold. With
orthogonal Q_j and upper triangular R_j, F_j Q_{j-1} = Q_j R_j, so

    Q_0^T P Q_0 = (Q_0^T Q_N) (R_N ... R_1).

Repeated with Q_N as the next Q_0 (orthogonal iteration; Lust 2001 begins in the same way), Q_0^T Q_N becomes block diagonal,
with a block for each group of eigenvalues of similar size. The product of the triangular matrices is taken block by block, its
size kept as a logarithm, so that groups of very different size do not meet.
"""

from __future__ import annotations

import math

import numpy as np

from contin.arrays import Array, ComplexArray
from contin.functions.kernel import kernel
from contin.functions.kernel_parts import Matrix, Stack, Vector

#: Groups whose sizes differ by less than this factor are one: iteration would take long to separate them, and the
#: eigenvalues of a block with such a spread are accurate.
_APART = 1e4
#: Matrices of a smaller condition number are multiplied with each other as they are.
_WELL = 30.0
#: Below this the coupling of two groups is round-off; at most so many rounds.
_COUPLED, _ROUNDS = 1e-14, 60


def log_eigenvalues(factors: Array) -> ComplexArray:
    """Return the logarithms of the eigenvalues of F_N ... F_1, shape (n,), largest first; ``factors`` is (N, n, n), F_1 first.

    The imaginary part is in (-pi, pi]; a zero eigenvalue gives -inf.

    Examples
    --------
    >>> print(log_eigenvalues(np.array([np.diag([1e200, 1e-200]), np.diag([1e200, -1e-200])])).round(3))
    [ 921.034+0.j    -921.034+3.142j]
    """
    n, factors = factors.shape[-1], _joined(factors)
    start = np.linalg.qr(np.random.default_rng(1).standard_normal((n, n)))[0]
    for _ in range(_ROUNDS):
        end, triangles = _round(factors, start)
        sizes = np.log(np.maximum(np.abs(triangles[:, range(n), range(n)]), np.finfo(float).tiny)).sum(axis=0)
        coupling = start.T @ end
        apart = [i for i in range(1, n) if sizes[i - 1] - sizes[i] > np.log(_APART)]
        if all(np.abs(coupling[i:, :i]).max() < _COUPLED for i in apart):
            break
        start = end
    found = [_of_block(coupling[a:b, a:b], triangles[:, a:b, a:b]) for a, b in zip([0, *apart], [*apart, n])]
    values = np.concatenate(found)
    return values[np.argsort(-values.real, kind="stable")]


def log_eigenvalues_along(factors: Array, vectors: Array) -> ComplexArray:
    """Return the logarithms of the eigenvalues where each factor takes one known vector to the next, shape (n,), largest first.

    With v_j of unit length and an orthonormal basis Q_j of what is normal to it,

        F_j [v_j-1  Q_j-1] = [v_j  Q_j] [ a_j   *  ]
                                        [  0   B_j ]

    and the eigenvalues are the product of the numbers a_j, which must be positive, and those of the product of the B_j. What
    the factors leave of the zeros is round-off and dropped: it would grow with the product.

    Parameters
    ----------
    factors : ndarray, shape (N, n, n)
    vectors : ndarray, shape (N + 1, n)
        v_0 ... v_N, of any length; the last is a positive multiple of the first.

    Examples
    --------
    >>> shear = np.array([[1.0, 0.5], [0.0, 4.0]])
    >>> print(np.exp(log_eigenvalues_along(np.array([shear, shear]), np.array([[1, 0], [1, 0], [1, 0]]))).real.round(9))
    [16.  1.]
    """
    n = factors.shape[-1]
    units = vectors / np.linalg.norm(vectors, axis=1)[:, None]
    mirrors = units + np.where(units[:, :1] < 0, -1.0, 1.0) * np.eye(n)[0]
    reflections = np.eye(n) - 2 * mirrors[:, :, None] * mirrors[:, None] / np.sum(mirrors**2, axis=1)[:, None, None]
    normal = reflections[:, :, 1:]
    along = np.einsum("ja,jab,jb->j", units[1:], factors, units[:-1])
    with np.errstate(divide="ignore"):
        one = np.log(np.abs(along)).sum(keepdims=True)
    rest = np.einsum("jab,jac,jcd->jbd", normal[1:], factors, normal[:-1])
    values = np.concatenate([one, log_eigenvalues(rest)])
    return values[np.argsort(-values.real, kind="stable")]


def _joined(factors: Array) -> Array:
    """Return fewer matrices with the same product: neighbours are multiplied while no digits are lost."""
    while len(factors) > 1 and np.linalg.cond(factors).max() < _WELL:
        pairs = factors[1::2] @ factors[: len(factors) // 2 * 2 : 2]
        factors = np.concatenate([pairs, factors[-1:]]) if len(factors) % 2 else pairs
    return factors


def _round(factors: Array, start: Array) -> tuple[Array, Array]:
    """Return Q_N and all R_j (N, n, n)."""
    q, triangles = start.copy(), np.zeros(factors.shape)
    triangularize(np.ascontiguousarray(factors), q, triangles, np.empty(q.shape))
    return q, triangles


@kernel(reorder=False)
def triangularize(factors: Stack, q: Matrix, triangles: Stack, work: Matrix) -> None:
    """Overwrite Q_0 by Q_N, and fill all R_j, by Gram and Schmidt's method, each vector orthogonalized twice."""
    n = q.shape[0]
    for j in range(factors.shape[0]):
        for a in range(n):
            for b in range(n):
                work[a, b] = 0.0
                for c in range(n):
                    work[a, b] += factors[j, a, c] * q[c, b]
        for b in range(n):
            for _ in range(2):
                for c in range(b):
                    part = 0.0
                    for a in range(n):
                        part += q[a, c] * work[a, b]
                    triangles[j, c, b] += part
                    for a in range(n):
                        work[a, b] -= part * q[a, c]
            largest = 0.0  # the sum of squares may overflow
            for a in range(n):
                largest = max(largest, abs(work[a, b]))
            length = 0.0
            for a in range(n):
                length += (work[a, b] / largest) ** 2 if largest > 0 else 0.0
            length = largest * math.sqrt(length)
            triangles[j, b, b] = length
            for a in range(n):
                q[a, b] = work[a, b] / length if length > 0 else 0.0


def _of_block(coupling: Array, triangles: Array) -> ComplexArray:
    """Return the logarithms of the eigenvalues of a block of ``coupling`` times the product of ``triangles``."""
    product, size = np.eye(len(coupling)), np.zeros(1)
    multiply(np.ascontiguousarray(triangles), product, size)
    if not np.isfinite(size[0]):
        return np.full(len(coupling), -np.inf + 0j)
    with np.errstate(divide="ignore"):
        logs: ComplexArray = np.log(np.linalg.eigvals(coupling @ product).astype(complex)) + size[0]
    return logs


@kernel(reorder=False)
def multiply(triangles: Stack, product: Matrix, size: Vector) -> None:
    """Multiply ``product`` by all upper triangular matrices, from the left; its size is kept as a logarithm in ``size``."""
    n = product.shape[0]
    for j in range(triangles.shape[0]):
        largest = 0.0
        for b in range(n):
            for a in range(n):  # row a needs the rows below it as they were
                value = 0.0
                for c in range(a, n):
                    value += triangles[j, a, c] * product[c, b]
                product[a, b] = value
                largest = max(largest, abs(value))
        if largest == 0:
            size[0] = -math.inf
            return
        for a in range(n):
            for b in range(n):
                product[a, b] /= largest
        size[0] += math.log(largest)
