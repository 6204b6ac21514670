"""Small matrices in kernels: LU factors, solutions with them, and eigenvalues.

For its eigenvalues a matrix is balanced, brought to Hessenberg form, and handed to the shifted QR method: EISPACK's balanc,
elmhes and hqr (Smith et al., Matrix Eigensystem Routines, 1976). LAPACK's methods are meant for large matrices: of a few rows,
a call of NumPy takes ten times as long as all arithmetic.
"""

from __future__ import annotations

import math

import numpy as np

from contin.arrays import Array, Indices
from contin.kernels.kernel import kernel
from contin.kernels.kernel_parts import IndexVector, Matrix, ReadOnlyMatrix, Stack, helper
from contin.levels import MOST_STEPS


@helper
def factor_small(matrix: Array, lu: Array, exchanges: Indices) -> float:
    """Fill in the factors of a matrix, with partial pivoting; return the sign of its determinant, 0 where it is singular."""
    size, sign = matrix.shape[0], 1.0
    for i in range(size):
        for j in range(size):
            lu[i, j] = matrix[i, j]
    for column in range(size):
        place = column
        for i in range(column + 1, size):
            if abs(lu[i, column]) > abs(lu[place, column]):
                place = i
        exchanges[column] = place
        if place != column:
            sign = -sign
            for j in range(size):
                lu[column, j], lu[place, j] = lu[place, j], lu[column, j]
        pivot = lu[column, column]
        if not abs(pivot) > 0.0:  # NaN, too
            return 0.0
        if pivot < 0.0:
            sign = -sign
        for i in range(column + 1, size):
            factor = lu[i, column] / pivot
            lu[i, column] = factor
            if factor != 0.0:
                for j in range(column + 1, size):
                    lu[i, j] -= factor * lu[column, j]
    return sign


@helper
def solve_small(lu: Array, exchanges: Indices, right: Array) -> None:
    """Solve with the factors, in place."""
    size = right.size
    for i in range(size):
        place = exchanges[i]
        if place != i:
            right[i], right[place] = right[place], right[i]
    for i in range(1, size):
        total = right[i]
        for j in range(i):
            total -= lu[i, j] * right[j]
        right[i] = total
    for i in range(size - 1, -1, -1):
        total = right[i]
        for j in range(i + 1, size):
            total -= lu[i, j] * right[j]
        right[i] = total / lu[i, i]


@helper
def solve_small_transposed(lu: Array, exchanges: Indices, right: Array) -> None:
    """Solve with the transposed matrix, in place."""
    size = right.size
    for i in range(size):
        right[i] /= lu[i, i]
        for j in range(i + 1, size):
            right[j] -= lu[i, j] * right[i]
    for i in range(size - 1, 0, -1):
        for j in range(i):
            right[j] -= lu[i, j] * right[i]
    for i in range(size - 1, -1, -1):
        place = exchanges[i]
        if place != i:
            right[i], right[place] = right[place], right[i]


@kernel(reorder=False, last=True)
def factor_matrix(matrix: ReadOnlyMatrix, lu: Matrix, exchanges: IndexVector) -> float:
    """Fill in the factors of a matrix; return the sign of its determinant: 0 if it is singular, NaN if it is not finite."""
    for i in range(matrix.shape[0]):
        for j in range(matrix.shape[1]):
            if not abs(matrix[i, j]) < math.inf:
                return math.nan
    return factor_small(matrix, lu, exchanges)


@kernel(reorder=False, last=True)
def solve_rows(lu: Matrix, exchanges: IndexVector, rows: Matrix, transposed: int) -> None:
    """Solve with the factors, or with those of the transposed matrix, for each of some rows, in place."""
    for number in range(rows.shape[0]):
        if transposed:
            solve_small_transposed(lu, exchanges, rows[number])
        else:
            solve_small(lu, exchanges, rows[number])


#: Rows and columns are multiplied by powers of this, so that nothing is rounded, ...
_RADIX = 2.0
#: ... where that makes them smaller than this part of what they were.
_GAINS = 0.95
#: An entry below the diagonal is zero where it is below this part of its neighbours.
_ROUND_OFF = float(np.finfo(float).eps)
#: QR steps for one eigenvalue after which the shift is an exceptional one.
_EXCEPTIONAL = 10


@kernel(reorder=False, last=True)
def fill_eigenvalues(matrices: Stack, n: int, real: Matrix, imaginary: Matrix) -> None:
    """Fill in the eigenvalues of matrices, which are overwritten: a row for each, NaN where a matrix is not finite.

    A matrix has ``n`` rows; there may be room for more. The two of a complex pair stand side by side, the one above the real
    axis first.
    """
    for number in range(matrices.shape[0]):
        _fill(matrices[number], n, real[number], imaginary[number])


@helper
def _fill(a, n, real, imaginary):
    """Fill in the eigenvalues of a matrix with n rows."""
    total = 0.0
    for i in range(n):
        for j in range(n):
            total += abs(a[i, j])
    if not total < math.inf:
        for i in range(n):
            real[i] = imaginary[i] = math.nan
        return
    first, end = _isolate(a, n)
    for i in range(n):
        if not first <= i < end:
            real[i], imaginary[i] = a[i, i], 0.0
    _balance(a, first, end)
    _reduce(a, n, first, end)
    _iterate(a, first, end, real, imaginary)


@helper
def _isolate(a, n):
    """Exchange rows and columns so that the matrix is triangular but for a part of it; return where that begins and ends."""
    first, end = 0, n
    found = True
    while found:
        found = False
        for i in range(end - 1, first - 1, -1):
            if _alone(a, i, first, end, True):
                end, found = end - 1, True
                _exchange(a, n, i, end)
                break
            if _alone(a, i, first, end, False):
                _exchange(a, n, i, first)
                first, found = first + 1, True
                break
    return first, end


@helper
def _alone(a, i, first, end, row):
    """Return whether a row, or a column, of a part of a matrix has zeros only beside the diagonal."""
    total = 0.0
    for j in range(first, end):
        if j != i:
            total += abs(a[i, j] if row else a[j, i])
    return total == 0.0


@helper
def _exchange(a, n, i, k):
    """Exchange two rows and the same columns."""
    for j in range(n):
        a[i, j], a[k, j] = a[k, j], a[i, j]
    for j in range(n):
        a[j, i], a[j, k] = a[j, k], a[j, i]


@helper
def _balance(a, first, end):
    """Make rows and columns of a part of a matrix alike in size: their round-off is that of the eigenvalues."""
    changed = True
    while changed:
        changed = False
        for i in range(first, end):
            column, row = 0.0, 0.0
            for j in range(first, end):
                if j != i:
                    column += abs(a[j, i])
                    row += abs(a[i, j])
            if column == 0.0 or row == 0.0:
                continue
            factor, total = 1.0, column + row
            while column < row / _RADIX:
                factor *= _RADIX
                column *= _RADIX * _RADIX
            while column >= row * _RADIX:
                factor /= _RADIX
                column /= _RADIX * _RADIX
            if (column + row) / factor < _GAINS * total:
                changed = True
                for j in range(first, end):
                    a[i, j] /= factor
                for j in range(first, end):
                    a[j, i] *= factor


@helper
def _reduce(a, n, first, end):
    """Bring a part of a matrix to Hessenberg form, by elimination with exchanges."""
    for m in range(first + 1, end - 1):
        place = m
        for i in range(m + 1, end):
            if abs(a[i, m - 1]) > abs(a[place, m - 1]):
                place = i
        if place != m:
            _exchange(a, n, place, m)
        pivot = a[m, m - 1]
        if pivot == 0.0:
            continue
        for i in range(m + 1, end):
            factor = a[i, m - 1] / pivot
            a[i, m - 1] = 0.0
            if factor != 0.0:
                for j in range(m, end):
                    a[i, j] -= factor * a[m, j]
                for j in range(first, end):
                    a[j, m] += factor * a[j, i]


@helper
def _iterate(a, first, end, real, imaginary):
    """Find the eigenvalues of a part of a Hessenberg matrix from the last on, one or two at a time."""
    norm, shift = 0.0, 0.0
    for i in range(first, end):
        for j in range(max(i - 1, first), end):
            norm += abs(a[i, j])
    last, steps = end - 1, 0
    while last >= first:
        low = _split(a, first, last, norm)
        if low >= last - 1:
            last, steps = _settle(a, low, last, shift, real, imaginary), 0
        elif steps == MOST_STEPS:
            for i in range(first, last + 1):
                real[i] = imaginary[i] = math.nan
            return
        else:
            steps += 1
            x, y, w = a[last, last], a[last - 1, last - 1], a[last, last - 1] * a[last - 1, last]
            if steps % _EXCEPTIONAL == 0:
                shift += x
                for i in range(first, last + 1):
                    a[i, i] -= x
                size = abs(a[last, last - 1]) + abs(a[last - 1, last - 2])
                x = y = 0.75 * size
                w = -0.4375 * size * size
            _step(a, low, last, x, y, w)


@helper
def _split(a, first, last, norm):
    """Return where the block that ends with row ``last`` begins: the entry beside it is round-off, and made zero."""
    for low in range(last, first, -1):
        size = abs(a[low - 1, low - 1]) + abs(a[low, low])
        if abs(a[low, low - 1]) <= _ROUND_OFF * (size if size != 0.0 else norm):
            a[low, low - 1] = 0.0
            return low
    return first


@helper
def _settle(a, low, last, shift, real, imaginary):
    """Fill in the eigenvalues of the last block, of one or two rows; return the row before it."""
    x = a[last, last]
    if low == last:
        real[last], imaginary[last] = x + shift, 0.0
        return last - 1
    y, w = a[last - 1, last - 1], a[last, last - 1] * a[last - 1, last]
    p = 0.5 * (y - x)
    q = p * p + w
    root = math.sqrt(abs(q))
    if q >= 0.0:
        z = p + math.copysign(root, p)
        real[last - 1] = real[last] = x + shift + z
        if z != 0.0:
            real[last] = x + shift - w / z
        imaginary[last - 1] = imaginary[last] = 0.0
    else:
        real[last - 1] = real[last] = x + shift + p
        imaginary[last - 1], imaginary[last] = root, -root
    return last - 2


@helper
def _step(a, low, last, x, y, w):
    """Make a double QR step on rows ``low`` to ``last``, with the shifts whose sum is x + y and whose product is x y - w."""
    p, q, r = 0.0, 0.0, 0.0
    m = last - 2
    while True:  # it begins below the last two entries under the diagonal that are both small
        z = a[m, m]
        p = ((x - z) * (y - z) - w) / a[m + 1, m] + a[m, m + 1]
        q = a[m + 1, m + 1] - z - (x - z) - (y - z)
        r = a[m + 2, m + 1]
        size = abs(p) + abs(q) + abs(r)
        p, q, r = p / size, q / size, r / size
        if m == low:
            break
        beside = abs(p) * (abs(a[m - 1, m - 1]) + abs(z) + abs(a[m + 1, m + 1]))
        if abs(a[m, m - 1]) * (abs(q) + abs(r)) <= _ROUND_OFF * beside:
            break
        m -= 1
    for i in range(m + 2, last + 1):
        a[i, i - 2] = 0.0
        if i != m + 2:
            a[i, i - 3] = 0.0
    size = 0.0
    for k in range(m, last):
        more = k != last - 1
        if k != m:
            p, q, r = a[k, k - 1], a[k + 1, k - 1], (a[k + 2, k - 1] if more else 0.0)
            size = abs(p) + abs(q) + abs(r)
            if size != 0.0:
                p, q, r = p / size, q / size, r / size
        s = math.copysign(math.sqrt(p * p + q * q + r * r), p)
        if s == 0.0:
            continue
        if k != m:
            a[k, k - 1] = -s * size
        elif low != m:
            a[k, k - 1] = -a[k, k - 1]
        p += s
        one, two, three = p / s, q / s, r / s
        q, r = q / p, r / p
        for j in range(k, last + 1):
            part = a[k, j] + q * a[k + 1, j]
            if more:
                part += r * a[k + 2, j]
                a[k + 2, j] -= part * three
            a[k + 1, j] -= part * two
            a[k, j] -= part * one
        for i in range(low, min(last, k + 3) + 1):
            part = one * a[i, k] + two * a[i, k + 1]
            if more:
                part += three * a[i, k + 2]
                a[i, k + 2] -= part * r
            a[i, k + 1] -= part * q
            a[i, k] -= part
