"""The mesh: nodes and interpolation on an interval, its degree, and adaptation to a solution."""

from __future__ import annotations

import functools
import sys
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from contin import errors as checks
from contin.arrays import Array
from contin.errors import ProblemError, Within
from contin.kernels.kernel import kernel
from contin.kernels.kernel_parts import ReadOnlyMatrix, Vector
from contin.levels import CORRECTED
from contin.text import Shown

DEGREES = range(2, 9)
Degree = Annotated[int, Within(DEGREES[0], DEGREES[-1])]


@dataclass(frozen=True, eq=False, repr=False)
class Basis(Shown):
    """Tables of one degree d on the unit interval.

    ``nodes`` (d + 1,) Lobatto points and ``node_weights`` their quadrature; ``points`` (d,) Gauss points and
    ``weights`` theirs; ``value`` and ``slope`` (d, d + 1) take nodal values to the Gauss points; ``highest`` (d + 1,)
    gives the d-th derivative; ``barycentric`` (d + 1,) for interpolation; ``constant`` is max |prod (x - node)| / (d + 1)!.
    """

    degree: int
    nodes: Array
    node_weights: Array
    points: Array
    weights: Array
    value: Array
    slope: Array
    highest: Array
    barycentric: Array
    constant: float

    @functools.cached_property
    def round_off(self) -> float:
        """What round-off of values up to 1 makes of a difference of d-th derivatives."""
        return float(2 * sys.float_info.epsilon * np.abs(self.highest).sum())

    @functools.cached_property
    def runge_kutta(self) -> Array:
        """The matrix of the Gauss method."""
        return self.integrals(self.points)

    def integrals(self, ends: Array) -> Array:
        """Return the matrix (len(ends), d) that integrates values at the Gauss points from 0 to each of the ends."""
        lagrange = 1 / np.prod(self.points[:, None] - self.points + np.eye(self.degree), axis=1)
        return np.array([end * self.weights @ interpolation(self.points, lagrange, end * self.points) for end in ends])


@functools.cache
def basis(degree: int) -> Basis:
    """Return the tables of a degree from 2 to 8.

    Raises
    ------
    ProblemError

    Examples
    --------
    >>> basis(2).nodes.tolist()
    [0.0, 0.5, 1.0]
    """
    if degree not in DEGREES:
        raise ProblemError(f"degree: {degree!r} must be a whole number from 2 to 8")
    legendre = np.polynomial.legendre
    points, weights = legendre.leggauss(degree)
    top = np.zeros(degree + 1)
    top[-1] = 1.0
    nodes = np.concatenate([[-1.0], np.sort(legendre.legroots(legendre.legder(top)).real), [1.0]])
    node_weights = 2 / (degree * (degree + 1) * legendre.legval(nodes, top) ** 2)
    nodes, points = (nodes + 1) / 2, (points + 1) / 2
    differences = nodes[:, None] - nodes + np.eye(degree + 1)
    barycentric = 1 / differences.prod(axis=1)
    value = interpolation(nodes, barycentric, points)
    nodal_slope = barycentric / barycentric[:, None] / differences
    np.fill_diagonal(nodal_slope, 0.0)
    np.fill_diagonal(nodal_slope, -nodal_slope.sum(axis=1))
    factorial = np.prod(np.arange(1.0, degree + 1))
    fine = np.linspace(0, 1, 2001)
    constant = np.abs((fine[:, None] - nodes).prod(axis=1)).max() / (factorial * (degree + 1))
    tables = (nodes, node_weights / 2, points, weights / 2, value, value @ nodal_slope, factorial * barycentric, barycentric)
    return Basis(degree, *tables, constant)


def interpolation(nodes: Array, barycentric: Array, at: Array) -> Array:
    """Return the matrix (len(at), len(nodes)) that evaluates the polynomial through the nodes at points (barycentric form).

    Examples
    --------
    >>> table = basis(2)
    >>> interpolation(table.nodes, table.barycentric, np.array([0.25])) @ table.nodes**2  # exact for polynomials of degree 2
    array([0.0625])
    """
    distance = at[:, None] - nodes
    exact = distance == 0
    terms = barycentric / np.where(exact, 1.0, distance)
    matrix = terms / terms.sum(axis=1, keepdims=True)
    return np.where(exact.any(axis=1, keepdims=True), exact, matrix)


#: More intervals than any machine has room for: a bound for what users give.
MOST_INTERVALS = 1_000_000
Intervals = Annotated[int, Within(1, MOST_INTERVALS)]

#: Error wanted between the mesh points where that at them is to be one, as a factor; below one for a margin. Ten times larger
#: moves no special point of the test bank by more than 1e-9.
_BETWEEN = 0.03
#: Part of its mean that the density is raised to: an interval grows to ten times the mean at most.
_LEAST_DENSITY = 0.1
#: Intervals between two breaks, on average: some are left for breaks that the solution meets on its way.
_A_PIECE = 2
#: A mesh stays with up to so many times the intervals that it needs, ...
_TOO_MANY = 1.6
#: ... and with an interval that has up to so many times its share of the error.
_TOO_LARGE = 1.5


@dataclass(frozen=True)
class MeshControl(checks.Named):
    """How the mesh adapts.

    Attributes
    ----------
    tolerance : float
        Wanted error at the mesh points. Collocation is superconvergent there, h^(2 d), while the density is about the error
        h^(d+1) between them: that one is kept below 0.03 tolerance^((d+1)/(2 d)).
    min_intervals, max_intervals : int
        Bounds on the number of intervals N.
    every : int
        Number of steps after which the mesh is looked at again; 0 keeps it as it is.

    Examples
    --------
    >>> MeshControl(tolerance=1e-8, min_intervals=20).max_intervals
    2000
    """

    tolerance: float = 1e-12
    min_intervals: Intervals = 8
    max_intervals: Intervals = 2000
    every: Annotated[int, Within(0, 1_000_000)] = 3

    def __post_init__(self) -> None:
        checks.number("mesh tolerance", self.tolerance, 0, 1)
        checks.fields(self)
        if self.min_intervals > self.max_intervals:
            raise ProblemError(f"intervals: {self.min_intervals} to {self.max_intervals} must be in order")


#: No breaks.
_NOWHERE = np.empty(0)


def density(basis: Basis, mesh: Array, states: Array, breaks: Array = _NOWHERE) -> Array:
    """Return the (d+1)-th root of the size of the (d+1)-th derivative, by interval, shape (N,).

    The derivative comes from differences of the d-th ones of neighbouring intervals (de Boor 1973, as in AUTO and COLSYS),
    each component scaled by max(1, max |u|). Where it is no more anywhere than what round-off of the values makes of it, as for
    a constant solution, it is the same everywhere: the mesh has equal intervals, and does not follow noise.

    - ``basis`` (Basis)
    - ``mesh`` (ndarray, shape (N + 1,))
    - ``states`` (ndarray, shape (N d + 1, n)): At the nodes.
    - ``breaks`` (ndarray, optional): Places where the equations have jumps or corners: differences across them are no errors.
    """
    return _density(basis, mesh, states, breaks, 0.0)


def _density(basis: Basis, mesh: Array, states: Array, breaks: Array, least: float) -> Array:
    """Return the density; with ``least`` above 0 it is smoothed, and raised to this part of its mean."""
    phi, jumps = np.ones(mesh.size - 1), np.zeros(mesh.size)
    if phi.size < 2:
        return phi
    fill_jumps(basis.highest, mesh, states, jumps)
    if len(breaks):  # a jump there is no larger than the next ones on both sides
        inside = near(mesh, breaks, mesh[-1] - mesh[0])
        inside[0] = inside[-1] = True
        beside = np.where(inside, -1.0, jumps)
        largest = np.maximum(beside[:-2], beside[2:])  # -1 where there is none
        jumps[1:-1] = np.where(np.logical_and(inside[1:-1], largest >= 0), np.minimum(jumps[1:-1], largest), jumps[1:-1])
    fill_density(basis.degree, mesh, jumps, basis.round_off, least, phi)
    return phi


@kernel(reorder=False)
def fill_jumps(highest: Vector, mesh: Vector, states: ReadOnlyMatrix, jumps: Vector) -> None:
    """Raise ``jumps`` (N + 1,) at inner mesh points to the largest difference quotients of d-th derivatives, scaled."""
    d = highest.size - 1
    for a in range(states.shape[1]):
        size, before = 1.0, 0.0
        for i in range(states.shape[0]):
            size = max(size, abs(states[i, a]))
        for j in range(mesh.size - 1):
            derivative = 0.0
            for node in range(d + 1):
                derivative += highest[node] * states[j * d + node, a]
            derivative /= (mesh[j + 1] - mesh[j]) ** d
            if j > 0:
                jumps[j] = max(jumps[j], 2 * abs(derivative - before) / (mesh[j + 1] - mesh[j - 1]) / size)
            before = derivative


@kernel(reorder=False)
def fill_density(d: int, mesh: Vector, jumps: Vector, round_off: float, least: float, phi: Vector) -> None:
    """Fill the density ``phi`` (N,) from the jumps at inner mesh points; smoothed and raised, if ``least`` is above 0."""
    last, most, total, before = phi.size - 1, 0.0, 0.0, 0.0
    jumps[0], jumps[last + 1] = jumps[1], jumps[last]
    for j in range(last + 1):
        largest = max(jumps[j], jumps[j + 1])
        most = max(most, largest * (mesh[j + 1] - mesh[j]) ** (d + 1))
        phi[j] = largest ** (1 / (d + 1))
    for j in range(last + 1 if most <= round_off else 0):
        phi[j] = round_off ** (1 / (d + 1)) * (last + 1) / (mesh[last + 1] - mesh[0])
    for j in range(last + 1 if least > 0 else 0):
        now = phi[j]
        phi[j] = max(now, ((before if j > 0 else now) + 2 * now + phi[min(j + 1, last)]) / 4)
        total += phi[j] * (mesh[j + 1] - mesh[j])
        before = now
    for j in range(last + 1):
        phi[j] = max(phi[j], least * total / (mesh[last + 1] - mesh[0]))


def halved(mesh: Array) -> Array:
    """Return places in order, and the middles between them."""
    return np.sort(np.concatenate([mesh, (mesh[1:] + mesh[:-1]) / 2]))


def near(places: Array, breaks: Array, length: float) -> Array:
    """Return which places lie on a break."""
    if not len(breaks):
        return np.zeros(len(places), dtype=bool)
    return np.asarray((np.abs(places[:, None] - breaks) <= CORRECTED * length).any(axis=1))


def with_breaks(mesh: Array, breaks: Array) -> Array:
    """Return a mesh of as many intervals whose points hold the breaks, as far as there are points for them."""
    mesh, length = mesh.copy(), mesh[-1] - mesh[0]
    taken = np.zeros(mesh.size, dtype=bool)
    taken[[0, -1]] = True
    for place in breaks:
        at = int(np.searchsorted(mesh, place))
        for j in sorted((at - 1, at), key=lambda j: abs(mesh[j] - place)):
            if not taken[j]:
                mesh[j], taken[j] = place, True
                break
            if abs(mesh[j] - place) <= CORRECTED * length:
                break
    return mesh


def moved_to_breaks(mesh: Array, breaks: Array) -> Array:
    """Return a mesh with the breaks among its points whose intervals are those of a mesh, stretched between the breaks.

    Examples
    --------
    >>> moved_to_breaks(np.array([0.0, 0.25, 0.5, 0.75, 1.0]), np.array([0.6])).round(3).tolist()
    [0.0, 0.3, 0.6, 0.8, 1.0]
    """
    return _equidistributed(mesh, 1 / np.diff(mesh), max(mesh.size - 1, len(breaks) + 1), breaks)


def adapted_mesh(basis: Basis, mesh: Array, states: Array, control: MeshControl, breaks: Array = _NOWHERE) -> Array | None:
    """Return a better mesh for a solution, given by its states at the nodes, or None where the present one is good enough.

    It equidistributes the density (smoothed, and raised to at least a tenth of its mean so that no interval grows without
    bound) over as many intervals as ``control.tolerance`` takes.
    """
    h = mesh[1:] - mesh[:-1]
    phi = _density(basis, mesh, states, breaks, _LEAST_DENSITY)
    total, allowed = float(phi @ h), share(basis, control.tolerance)
    fewest = max(control.min_intervals, _A_PIECE * (len(breaks) + 1) if len(breaks) else 0)
    wanted = int(min(max(np.ceil(total / allowed), fewest), control.max_intervals))
    enough = wanted <= h.size <= max(_TOO_MANY * wanted, control.min_intervals)
    enough = enough and (not len(breaks) or bool(near(breaks, mesh, mesh[-1] - mesh[0]).all()))
    if enough and (phi * h).max() <= _TOO_LARGE * max(total / h.size, allowed * wanted / h.size):
        return None
    return _equidistributed(mesh, phi, max(h.size if enough else wanted, len(breaks) + 1), breaks)


def share(basis: Basis, tolerance: float) -> float:
    """Return the density times length that an interval may have for a tolerance, by the interpolation error of degree d."""
    d = basis.degree
    return float((_BETWEEN * tolerance ** ((d + 1) / (2 * d)) / basis.constant) ** (1 / (d + 1)))


def equidistributed(basis: Basis, mesh: Array, states: Array, intervals: int) -> Array:
    """Return a mesh of so many intervals for a solution that is given on another mesh."""
    return _equidistributed(mesh, _density(basis, mesh, states, _NOWHERE, _LEAST_DENSITY), intervals)


def _equidistributed(mesh: Array, phi: Array, intervals: int, breaks: Array = _NOWHERE) -> Array:
    """Return a mesh whose intervals have equal shares of the density; between breaks, which are mesh points, about equal."""
    h, share = mesh[1:] - mesh[:-1], np.zeros(mesh.size)
    share[1:] = np.cumsum(phi * h) / (phi @ h)
    places = np.arange(intervals + 1) * (1 / intervals)
    if len(breaks):
        ends = np.concatenate([[0.0], np.interp(breaks, mesh, share), [1.0]])
        counts = _shared_out(np.diff(ends), max(intervals, len(breaks) + 1))
        pieces = [np.linspace(a, b, count, endpoint=False) for a, b, count in zip(ends, ends[1:], counts)]
        places = np.append(np.concatenate(pieces), 1.0)
    new: Array = np.interp(places, share, mesh)
    if len(breaks):
        new[np.cumsum(counts)[:-1]] = breaks
    new[0], new[-1] = mesh[0], mesh[-1]
    return new


def _shared_out(parts: Array, total: int) -> Any:
    """Return whole numbers, one at least for each part, that sum up to a total and are near the parts of it.

    Examples
    --------
    >>> _shared_out(np.array([0.01, 0.44, 0.55]), 5).tolist()
    [1, 2, 2]
    """
    wanted = parts / parts.sum() * total
    counts = np.maximum(np.floor(wanted).astype(int), 1)
    while counts.sum() != total:
        missing = np.where(counts > 1, wanted - counts, np.inf) if counts.sum() > total else wanted - counts
        if counts.sum() > total:
            counts[np.argmin(missing)] -= 1
        else:
            counts[np.argmax(missing)] += 1
    return counts


#: Degrees among which is chosen, and those that they are compared with. Meshes of degree 8 are made from the eighth derivative,
#: whose round-off often gives them as many intervals as degree 7 has. Degrees below 4 need many intervals wherever they are not
#: the cheapest.
_CHOSEN, _COMPARED = range(4, 8), range(4, 9)
#: That of cycles. At degree 7 the mesh has fewer intervals, which suit the cycle but not its multipliers: in AUTO's demos their
#: errors are 1e-8 to 1e-6 in place of 1e-9. At degree 4 it has 3.5 times as many, and the demos of cycles take twice as long.
CYCLE_DEGREE = 6
#: Solutions are considered from one for which every degree has the fewest intervals to one that needs so many times as many.
#: Ten times more changes no degree.
_HARDEST = 1e4
#: Time that a Newton iteration takes for an interval, over that for its Python code (1 ms; docs/performance.md, cost laws). Ten
#: times less, the degree at 1e-12 would be 7 for more than 30 states instead of up to 12.
_INTERVAL = 3e-3
#: The same for each of the (n d)^2 entries of an interval's block. Ten times more, the degree would be 7 for up to 3 states.
_ENTRY = 7.5e-6


@functools.cache
def usual_degree(states: int, tolerance: float) -> int:
    """Return the degree for n states and a tolerance that is never far from the cheapest one, whatever the solution is.

    A Newton iteration on N intervals of degree d takes the time a + N (b + c (n d)^2). A solution whose density has the
    integral K needs N = K / share(d) intervals, but no fewer than some number. Many states and easy solutions (small K) want a
    low degree, few states and difficult solutions a high one. K is not known before the solution is. The result is the degree
    whose time, divided by that of the cheapest degree, is smallest at the K that is worst for it. That quotient is below 2 for
    tolerances from 1e-12 and any number of states, and below 1.6 for fewer than 20 states.
    """
    shares = {d: share(basis(d), tolerance) for d in _COMPARED}
    fewest = 2 * MeshControl.min_intervals  # of special points
    easiest = fewest * min(shares.values())
    integrals = np.geomspace(easiest, _HARDEST * easiest)
    times = {d: 1 + (_INTERVAL + _ENTRY * (states * d) ** 2) * np.maximum(fewest, integrals / shares[d]) for d in _COMPARED}
    cheapest = np.min(list(times.values()), axis=0)
    return min(_CHOSEN, key=lambda d: float((times[d] / cheapest).max()))
