"""Quadratic forms on the pieces of a domain, in a kernel: what does not matter outside a piece is eliminated."""

from __future__ import annotations

import math

from contin.kernels.kernel import kernel
from contin.kernels.kernel_parts import IndexVector, Matrix, Stack, helper


@kernel(reorder=False, last=True)
def condense_forms(
    forms: Stack, increments: Stack, vectors: Matrix, coupling: Matrix, least: float, sizes: IndexVector, work: Stack
) -> int:
    """Eliminate from forms on N pieces, and join neighbours, as long as pivots of what is eliminated exceed ``least``.

    Then the inertia of the whole is that of what is left, and as many positive directions (Haynsworth 1968). Unknowns y of a
    piece matter outside it by their increment D = W y, (r,): the form of neighbours is the sum of theirs and of D_1 . N D_2.

    Parameters
    ----------
    forms, increments, vectors : ndarray, shapes (N, m, m), (N, r, m), (N, m)
        The forms, W, and a vector of y. Of each ``sizes[0]`` unknowns are in use, there must be room for 2 r. Overwritten.
    coupling : ndarray, shape (r, r)
        N, antisymmetric.
    least : float
        Of forms that are the identity where nothing couples.
    sizes : ndarray, shape (N,)
        Filled: unknowns of what is left, r or as many as before, in coordinates that are orthonormal in y.
    work : ndarray, shape (2, m, m)

    Returns
    -------
    int
        Pieces that are left, at the front of the arrays.
    """
    size, r, count = sizes[0], increments.shape[1], 0
    form, increment = work[0], work[1]
    for e in range(forms.shape[0]):
        own = size
        for i in range(size):
            for j in range(size):
                form[i, j] = forms[e, i, j]
            for j in range(r):
                increment[j, i] = increments[e, j, i]
            increment[r, i] = vectors[e, i]
        if size > r and _condensed(form, increment, size, r, least):
            own = r
            _put(form, increment, forms[e], increments[e], vectors[e])
        last = count - 1
        if own == r and count > 0 and sizes[last] == r:
            for i in range(r):
                for j in range(r):
                    form[i, j], form[r + i, r + j] = forms[last, i, j], forms[e, i, j]
                    increment[i, j], increment[i, r + j] = increments[last, i, j], increments[e, i, j]
                increment[r, i], increment[r, r + i] = vectors[last, i], vectors[e, i]
            for i in range(r):
                for j in range(r):
                    total = 0.0
                    for a in range(r):
                        for b in range(r):
                            total += increments[last, a, i] * coupling[a, b] * increments[e, b, j]
                    form[i, r + j] = form[r + j, i] = total / 2
            if _condensed(form, increment, 2 * r, r, least):
                _put(form, increment, forms[last], increments[last], vectors[last])
                continue
        for i in range(own):
            for j in range(own):
                forms[count, i, j] = forms[e, i, j]
            for j in range(r):
                increments[count, j, i] = increments[e, j, i]
            vectors[count, i] = vectors[e, i]
        sizes[count] = own
        count += 1
    return count


@helper
def _put(form, increment, to_form, to_increment, to_vector):
    """Store what is left of a form."""
    r = to_increment.shape[0]
    for i in range(r):
        for j in range(r):
            to_form[i, j], to_increment[i, j] = form[i, j], increment[i, j]
        to_vector[i] = increment[r, i]


@helper
def _reflect(rows, v, half):
    """Reflect rows along v, with v.v / 2."""
    for row in range(rows.shape[0]):
        product = 0.0
        for i in range(v.size):
            product += rows[row, i] * v[i]
        for i in range(v.size):
            rows[row, i] -= product / half * v[i]


@helper
def _condensed(form, increment, size, r, least):
    """Turn coordinates until the first r give all increments, and eliminate the others; return 0 where a pivot is too small.

    Row r of ``increment`` is the vector.
    """
    for k in range(r):
        total = 0.0
        for i in range(k, size):
            total += increment[k, i] * increment[k, i]
        if total == 0.0:
            continue
        # Householder's reflection along v, v_i = row_i for i > k, takes the row to its first entry
        head = increment[k, k]
        first = head + math.copysign(math.sqrt(total), head)
        half = (total - head * head + first * first) / 2
        increment[k, k] = first
        mirror = increment[k, k:size]
        _reflect(increment[k + 1 : r + 1, k:size], mirror, half)
        _reflect(form[:size, k:size], mirror, half)
        _reflect(form[k:size, :size].T, mirror, half)
        increment[k, k] = -math.copysign(math.sqrt(total), head)
        for i in range(k + 1, size):
            increment[k, i] = 0.0
    for k in range(size - 1, r - 1, -1):
        if not form[k, k] > least:
            return 0
        for i in range(k):
            factor = form[i, k] / form[k, k]
            for j in range(k):
                form[i, j] -= factor * form[k, j]
    return 1
