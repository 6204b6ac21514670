"""Assembly of residual and Jacobian of the collocation equations."""

from __future__ import annotations

from typing import NamedTuple

from contin.kernels.kernel import kernel
from contin.kernels.kernel_parts import Matrix, ReadOnlyMatrix, ReadOnlyVector, Stack, Vector, helper
from contin.linalg.blocks import Blocks, Layout, Share
from contin.linalg.elimination import Range
from contin.linalg.vector import Rows, address, combine, spread
from contin.text import shown


@kernel
def at_points(value: Matrix, x: ReadOnlyVector, points: Matrix) -> None:
    """Fill ``points`` (N d, n) with the states at the Gauss points, from the nodal values in x."""
    d = value.shape[0]
    count, n = points.shape
    for j in range(count // d):
        for i in range(d):
            row = address(points, 8 * (j * d + i) * n)
            combine(row, address(value, 8 * i * (d + 1)), Rows(address(x, 8 * j * d * n), 8 * n), n, d + 1)


@kernel
def to_nodes(value: Matrix, slopes: ReadOnlyMatrix, by_x: Vector) -> None:
    """Fill ``by_x`` with derivatives by nodal values and parameters from those at the Gauss points, (N d, n + k)."""
    d = value.shape[0]
    count, width = slopes.shape
    n, last = (by_x.size - width) // count, by_x.size - width
    for k in range(by_x.size):
        by_x[k] = 0.0
    for j in range(count // d):
        for i in range(d):
            row = slopes[j * d + i]
            for node in range(d + 1):
                factor, start = value[i, node], (j * d + node) * n
                for a in range(n):
                    by_x[start + a] += factor * row[a]
            for a in range(n, width):
                by_x[last + a] += row[a]


@kernel(reorder=False)
def interpolate(
    nodes: Vector, barycentric: Vector, mesh: Vector, times: ReadOnlyVector, x: ReadOnlyVector, values: Matrix
) -> None:
    """Fill ``values`` (m, n) with those of the piecewise polynomial at ``times`` (m,), from the nodal values in x.

    Outside the mesh it is that of the interval beside it.
    """
    d, n, last = nodes.size - 1, values.shape[1], mesh.size - 2
    j = 0
    for q in range(times.size):
        while j < last and times[q] >= mesh[j + 1]:
            j += 1
        while j > 0 and times[q] < mesh[j]:
            j -= 1
        place, total, exact = (times[q] - mesh[j]) / (mesh[j + 1] - mesh[j]), 0.0, -1
        for a in range(n):
            values[q, a] = 0.0
        for node in range(d + 1):
            if place == nodes[node]:
                exact = node
                break
            factor, first = barycentric[node] / (place - nodes[node]), (j * d + node) * n
            total += factor
            for a in range(n):
                values[q, a] += factor * x[first + a]
        for a in range(n):
            values[q, a] = values[q, a] / total if exact < 0 else x[(j * d + exact) * n + a]


@kernel
def collocate(
    n: int, slope: Matrix, weights: Vector, h: Vector, x: ReadOnlyVector, field: Matrix, boundary: Matrix, residual: Vector
) -> None:
    """Fill the ``residual`` from values of rhs and integrands at the Gauss points (N d, n + n_int) and boundary (1, n_bc)."""
    d, conditions, integrals = weights.size, boundary.shape[1], field.shape[1] - n
    last = residual[residual.size - integrals :]
    for q in range(integrals):
        last[q] = 0.0
    for j in range(h.size):
        for i in range(d):
            values, start = field[j * d + i], (j * d + i) * n
            nodes = Rows(address(x, 8 * j * d * n), 8 * n)
            combine(address(residual, 8 * start), address(slope, 8 * i * (d + 1)), nodes, n, d + 1)
            for a in range(n):
                residual[start + a] -= h[j] * values[a]
            for q in range(integrals):
                last[q] += weights[i] * h[j] * values[n + q]
    for q in range(conditions):
        residual[field.shape[0] * n + q] = boundary[0, q]


class Tables(NamedTuple):
    """The tables of a `Basis` that an assembly takes."""

    value: Matrix
    slope: Matrix
    weights: Vector

    def __repr__(self) -> str:
        return shown(self)


@kernel(last=True)
def fill_phase_row(n: int, tables: Tables, h: Vector, v: ReadOnlyVector, row: Vector) -> float:
    """Add to the ``row`` that of the integral of u . v', v the values at the nodes; return the integral of v' . v'."""
    value, slope, weights = tables
    d, total = weights.size, 0.0
    for j in range(h.size):
        for i in range(d):
            for a in range(n):
                rate = 0.0  # h v'
                for node in range(d + 1):
                    rate += slope[i, node] * v[(j * d + node) * n + a]
                total += weights[i] * rate * rate / h[j]
                for node in range(d + 1):
                    row[(j * d + node) * n + a] += weights[i] * value[i, node] * rate
    return total


class Bordering(NamedTuple):
    """What stands around the derivatives: ``columns`` (c, equations) and ``rows`` (r, unknowns + c)."""

    columns: Matrix
    rows: Matrix


@helper(inline=True)
def _fill_collocation(
    layout: Layout, tables: Tables, h: Vector, part: Range, jacobian: Stack, columns: Matrix, local: Stack
) -> None:
    """Fill the collocation rows of some intervals."""
    offsets, follows, starts, value, slope = layout.offsets, layout.follows, layout.starts, tables.value, tables.slope
    d, n, groups, c = tables.weights.size, layout.order.size, layout.offsets.size - 1, columns.shape[0]
    inner, rest, k = n * (d - 1), n * (d + 1), jacobian.shape[2] - n
    for j in range(part.first, part.last):
        for g in range(groups):
            first, last = offsets[g], offsets[g + 1]
            for i in range(d):
                start, factors = d * first + i * (last - first), address(value, 8 * i * (d + 1))
                for own in range(last - first):
                    row, a = local[j, start + own], layout.order[first + own]
                    point = jacobian[j * d + i, a]
                    target, source = address(row, 0), address(point, 0)
                    if i == d - 1:  # the row remains, and all of its ends are read
                        for b in range(inner, rest):
                            row[b] = 0.0
                    for f in range(g + 1):
                        low, number = offsets[f], offsets[f + 1] - offsets[f]
                        if follows[f * groups + g] == 1:
                            spread(target, address(starts, 8 * f * (d + 1)), factors, -h[j], source + 8 * low, number, d + 1)
                        else:
                            for node in range(0, d + 1, 1 if f == g else d):
                                for b in range(number):
                                    row[starts[f, node] + b] = 0.0
                    for node in range(d + 1):
                        row[starts[g, node] + own] += slope[i, node]
                    for b in range(k):
                        row[rest + b] = -h[j] * point[n + b]
                    for b in range(c):
                        row[rest + k + b] = columns[b, (j * d + i) * n + a]


@helper(inline=True)
def _fill_corner(boundary_end: int, columns: Matrix, rows: Matrix, corner: Matrix) -> None:
    """Fill the corner: no parameters yet and the extra columns in rows of integrals, then the extra rows."""
    integrals, c = corner.shape[0] - rows.shape[0], columns.shape[0]
    k, unknowns = corner.shape[1] - c, rows.shape[1]
    for q in range(integrals):
        for b in range(k):
            corner[q, b] = 0.0
        for b in range(c):
            corner[q, k + b] = columns[b, boundary_end + q]
    for q in range(rows.shape[0]):
        for b in range(k + c):
            corner[integrals + q, b] = rows[q, unknowns - k - c + b]


@helper(inline=True)
def _fill_integrals(layout: Layout, tables: Tables, h: Vector, part: Range, jacobian: Stack, border: Stack) -> None:
    """Fill the share of some intervals in the integral conditions."""
    offsets, groups, value, weights = layout.offsets, layout.offsets.size - 1, tables.value, tables.weights
    n, d, starts = layout.order.size, weights.size, layout.starts
    for j in range(part.first, part.last):
        for q in range(jacobian.shape[1] - n):
            for b in range(border.shape[2]):
                border[j, q, b] = 0.0
            for i in range(d):
                point, share = jacobian[j * d + i, n + q], weights[i] * h[j]
                for node in range(d + 1):
                    for g in range(groups):
                        first = starts[g, node]
                        for b in range(offsets[g + 1] - offsets[g]):
                            border[j, q, first + b] += share * value[i, node] * point[offsets[g] + b]


@helper(inline=True)
def _add_integrals(n: int, weights: Vector, h: Vector, jacobian: Stack, corner: Matrix) -> None:
    """Add up the derivatives of the integral conditions by the parameters."""
    d = weights.size
    for j in range(h.size):
        for q in range(jacobian.shape[1] - n):
            for i in range(d):
                for b in range(jacobian.shape[2] - n):
                    corner[q, b] += weights[i] * h[j] * jacobian[j * d + i, n + q, n + b]


@helper(inline=True)
def _fill_rows(layout: Layout, rows: Matrix, part: Range, border: Stack) -> None:
    """Fill the share of some intervals in the extra rows: nodes without the right end, which only the last interval has."""
    n, inner, intervals = layout.order.size, layout.inside.size, border.shape[0]
    d, integrals = inner // n + 1, border.shape[1] - rows.shape[0]
    for j in range(part.first, part.last):
        for q in range(rows.shape[0]):
            target, source = border[j, integrals + q], rows[q, j * d * n :]
            for b in range(inner):
                target[b] = source[layout.inside[b]]
            for b in range(2 * n):
                at_end = layout.ends[b] >= n * d
                target[inner + b] = source[layout.ends[b]] if not at_end or j == intervals - 1 else 0.0
            for b in range(inner + 2 * n, target.size):
                target[b] = 0.0


@helper(inline=True)
def _fill_boundary(boundary_start: int, derivatives: Matrix, columns: Matrix, first: Matrix, last: Matrix) -> None:
    """Fill the coefficients of the boundary conditions."""
    conditions, n = first.shape
    c, k = columns.shape[0], derivatives.shape[1] - 2 * n
    for q in range(conditions):
        for b in range(n):
            first[q, b], last[q, b] = derivatives[q, b], derivatives[q, n + b]
        for b in range(k):
            last[q, n + b] = derivatives[q, 2 * n + b]
        for b in range(c):
            last[q, n + k + b] = columns[b, boundary_start + q]


@kernel(reorder=False)
def assemble(
    layout: Layout, tables: Tables, h: Vector, jacobian: Stack, at_ends: Stack, around: Bordering, blocks: Blocks, share: Share
) -> None:
    """Fill the blocks of the matrix [[F_x, columns^T], [rows]], with the differential equations scaled by h.

    Parameters of the `Blocks` are the k free ones and the multipliers of the columns; border rows are the integral conditions
    and then the rows. For example, an interval's block of degree 2, with two groups of states of which the second depends on
    the first::

                            interior       both ends             parameters   multipliers
        Gauss               1      2       2         1
        point 1, group 1 [  S-A    .       .    .    S-A  S-A    -h J_p       columns^T   ]
        point 2, group 1 [  S-A    .       0    0    S-A  S-A    -h J_p       columns^T   ]   a row that remains
        point 1, group 2 [  -A     S-A     S-A  S-A  -A   -A     -h J_p       columns^T   ]
        point 2, group 2 [  -A     S-A     S-A  S-A  -A   -A     -h J_p       columns^T   ]   a row that remains
        integrals        [   Q      Q       Q    Q    Q    Q      0            0          ]
        rows             [              as they are               0            0          ]

    For node m and a Gauss point with weight w, A is ``h * value[m] * J``, S is ``slope[m]`` on the diagonal, and Q is the sum
    over the Gauss points of ``w * h * value[m] * J``. Places with a dot are left as they are: elimination does not read them.

    - ``layout`` (Layout)
    - ``tables`` (Tables)
    - ``h`` (ndarray, shape (N,))
    - ``jacobian`` (ndarray, shape (N d, n + n_int, n + k)): Derivatives of rhs and integrands at the Gauss points, by the
      states in the layout's order and the free parameters.
    - ``at_ends`` (ndarray, shape (1, n_bc, 2 n + k)): Derivatives of the boundary conditions by the states, in their own order,
      at both ends and the free parameters.
    - ``around`` (Bordering)
    - ``blocks`` (Blocks): Filled.
    - ``share`` (Share): The first stage fills the rows of intervals, the second one all other parts.
    """
    collocation, columns = h.size * layout.rows.size, around.columns
    if share.stage != 1:
        part = Range(share.starts[share.first], share.starts[share.last])
        _fill_collocation(layout, tables, h, part, jacobian, columns, blocks.local)
        _fill_integrals(layout, tables, h, part, jacobian, blocks.border)
        _fill_rows(layout, around.rows, part, blocks.border)
    if share.stage != 0:
        _fill_corner(collocation + blocks.first.shape[0], columns, around.rows, blocks.corner)
        _add_integrals(layout.order.size, tables.weights, h, jacobian, blocks.corner)
        _fill_boundary(collocation, at_ends[0], columns, blocks.first, blocks.last)
