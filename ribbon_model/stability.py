"""The index of an equilibrium: negative directions of its energy on closed perturbations, by symmetry class.

The second variation (`ribbon_model.second_variation`), Q = int |v|^2 + E . N E' dS with E' = G v, is discretized as the
equilibrium is: by collocation at the d Gauss points of each interval of the same mesh. The values of v at the Gauss points are
free, E is the continuous piecewise polynomial of degree d with E' = G v there, and the integral is the sum over Gauss points.
There is no cutoff, and the places of zero eigenvalues have the error O(h^(2 d)), like the equilibrium at its mesh points.

`contin` has a second variation as well, of problems stated by their energy (`tests/ribbon_model/half_loop_energy.py`). It knows
no classes: each would need a domain with end conditions of its own. Processor time, measured at one state of each of the
branches (1, 2), (3, 1), (5, 2) and (7, 5): all classes here, on the cell, 1.5 to 2.0 ms; one class there, on the half loop, 3.2
to 12 ms.

Steps:

1. `_of_mesh`: Q on the functions v of one interval of the mesh, (k d, k d) for k functions v.
2. `condense_forms`: 6 combinations y of their values give the increment of E over the interval. The others couple to nothing
   outside it, and are eliminated (Schur complement). Then two neighbours are one interval with 12 unknowns, of which 6 are
   eliminated, and so on, as long as what is eliminated is positive definite: then no negative direction is lost (Haynsworth).
3. `_Form`: the piece of the loop that the symmetry repeats. With S_e (6, 6) of an interval, its increment W_e y_e (6,), and E
   at the left end of an interval the sum of the increments before, the matrix of Q is

       S_1         W_1^T N W_2 / 2   W_1^T N W_3 / 2   ...
       (sym.)      S_2               W_2^T N W_3 / 2   ...
                                     S_3               ...

4. `_Form.classes`: for each symmetry class the matrix with the image of the piece under its reversal, and with E at S = 0. That
   follows from the increment over a part of the loop: E(part) = rho T E(0), T the motion from a part to the next.
5. Conditions of closure, where rho T has the eigenvalue 1, and the shift of phase, whose vector C^T M' is known, are projected
   out. So no eigenvalue is zero but at a bifurcation.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from contin.lowlevel import basis, condense_forms, levels
from ribbon_model.second_variation import Equilibrium, Symmetry, coupling, cross_matrix

#: The form that is eliminated is the identity plus O(h^2). Where a pivot of it is below this, nothing is. Ten times smaller,
#: Schur complements could be large, and lose digits.
_DEFINITE = 0.2
#: Rigid motions, and components of E.
_RIGID = 6
#: Matrices (3, 3), as rows of 9, of the products with the axes: a x for a = sum of a_i e_i is their sum.
_CROSS = np.array([cross_matrix(axis).ravel() for axis in np.eye(3)])


class SymmetryClass(NamedTuple):
    """Perturbations of one kind under the symmetry of the loop.

    Attributes
    ----------
    wavenumber : int
        j: from one part of the loop to the next the perturbation is multiplied by exp(2 pi i j / order), after the motion
        that takes one part to the next. j = 0 keeps the symmetry.
    parity : str
        'even' or 'odd' under the mirror (or two-fold axis) at S = 0; '' where that takes j to another class, or there is none.
    multiplicity : int
        2 if the class -j, which has the same eigenvalues, is another one: then modes come in pairs.
    eigenvalues : ndarray
        Of the discrete Q after elimination, over |y|^2, ascending: pure numbers. Their signs, and which of them are zero, are
        those of Q; their sizes depend on the mesh. Directions that are projected out have the eigenvalue 1.
    """

    wavenumber: int
    parity: str
    multiplicity: int
    eigenvalues: np.ndarray

    @property
    def name(self) -> tuple[int, str]:
        """The name of the class: wavenumber and parity."""
        return self.wavenumber, self.parity

    @property
    def negative(self) -> int:
        """Number of negative eigenvalues, not multiplied."""
        return int(np.sum(self.eigenvalues < 0))

    @property
    def determinant(self) -> float:
        """The product of the eigenvalues: smooth along a branch on one mesh, also where eigenvalues cross each other.

        It jumps, without a change of sign, where more or fewer intervals can be condensed.
        """
        return float(np.prod(self.eigenvalues))

    @property
    def nearest(self) -> int:
        """The number of the eigenvalue nearest to zero."""
        return int(np.argmin(np.abs(self.eigenvalues)))


@dataclass(frozen=True, eq=False)
class Stability:
    """Result of `index`.

    Attributes
    ----------
    index : int
        Number of negative directions. 0 is a local minimum of the energy.
    decided : bool
        False where an eigenvalue is zero as far as the state is known, or the loop is not closed.
    reason : str
        The reason if it is not decided.
    residual : float
        |Q| of the shift of phase over |v|^2. It would be zero without discretization: this is the error of eigenvalues.
    gap : float
        Gap of the loop; zero if it is closed.
    classes : tuple of SymmetryClass
    """

    index: int
    decided: bool
    reason: str
    residual: float
    gap: float
    classes: tuple[SymmetryClass, ...]

    def __getitem__(self, name: tuple[int, str]) -> SymmetryClass:
        """Return a class by its ``name``."""
        return next(entry for entry in self.classes if entry.name == tuple(name))

    @property
    def critical(self) -> SymmetryClass:
        """The class with the eigenvalue nearest to zero."""
        return min(self.classes, key=lambda entry: abs(entry.eigenvalues[entry.nearest]))


def index(equilibrium: Equilibrium) -> Stability:
    """Return the number of negative directions of the energy of a closed equilibrium, on the mesh of the equilibrium.

    Raises
    ------
    ValueError
        The energy is not convex in the strains at that state: high wavenumbers lower it without end, and there is no index.
    """
    points = _at_gauss_points(equilibrium)
    form = _Form(equilibrium, points)
    classes = form.classes()
    floor = max(levels.LOCATED, form.residual)
    reasons = [f"the loop is not closed: a gap of {points.gap:.1e}"] if points.gap > levels.APART else []
    for entry in (classes[number] for number in np.flatnonzero(np.abs(form.eigenvalues).min(axis=1) <= floor)):
        label, nearest = f"class {entry.wavenumber} {entry.parity}".strip(), entry.eigenvalues[entry.nearest]
        reasons.append(f"{label}: an eigenvalue {nearest:.1e} cannot be distinguished from zero")
    total = int((_kinds(equilibrium.symmetry)[2] * (form.eigenvalues < 0)).sum())
    return Stability(total, not reasons, "; ".join(reasons), form.residual, points.gap, classes)


# --- fields at the Gauss points -----------------------------------------------------------------------------------------


class _Points(NamedTuple):
    """Fields at the Gauss points of the piece, shapes (N, d, ...), lengths (N,) of the intervals, and the gap of the loop.

    ``generator`` (N, d, 6, k) is G, ``motion`` (N, d, k) is C^T M', the shift of phase; ``momentum`` (3,) is mu.
    """

    lengths: np.ndarray
    generator: np.ndarray
    motion: np.ndarray
    momentum: np.ndarray
    gap: float


def _at_gauss_points(equilibrium: Equilibrium) -> _Points:
    """Return the fields of an equilibrium at the Gauss points; the centreline is by the collocation's own quadrature."""
    tables, mesh = basis(equilibrium.degree), equilibrium.mesh
    lengths, d = mesh[1:] - mesh[:-1], equilibrium.inside
    if d is None:
        stations = mesh[:-1, None] + lengths[:, None] * tables.points
        d = equilibrium.directors(stations.ravel()).reshape(*stations.shape, 3, 3)
    inside, whole = (lengths[:, None, None] * (rule @ d[:, :, 2]) for rule in (tables.runge_kutta, tables.weights[None]))
    ends = np.cumsum(whole[:, 0], axis=0)
    inside[1:] += ends[:-1, None]
    origin, gap = _origin(equilibrium.symmetry, ends[-1])
    shape, x, d = inside.shape[:2], (inside + origin).reshape(-1, 3), d.reshape(-1, 3, 3)
    about = cross_matrix(equilibrium.force)
    momentum = equilibrium.moment - about @ origin
    moment = (d @ (momentum + x @ about.T)[:, :, None])[:, :, 0]
    strain, compliance = equilibrium.response(moment)
    free = slice(0, 3, 2 if equilibrium.law.constrained else 1)
    try:
        factor = np.linalg.cholesky(compliance[:, free, free])
    except np.linalg.LinAlgError as error:
        raise ValueError("the energy is not convex in the strains along this equilibrium: it has no index") from error
    u = d[:, free].transpose(0, 2, 1) @ factor
    crossed, turned = (np.concatenate([-x, moment]) @ _CROSS).reshape(2, -1, 3, 3)
    generator = np.concatenate([u, crossed @ u], axis=1)
    rate = (turned @ strain[:, :, None])[:, :, 0] + d @ equilibrium.force @ _CROSS[2].reshape(3, 3)  # M'
    motion = rate[:, None, free] @ factor
    return _Points(lengths, generator.reshape(*shape, 6, -1), motion.reshape(*shape, -1), momentum, gap)


def _origin(symmetry: Symmetry, end) -> tuple[np.ndarray, float]:
    """Return x(0) from a centre of all symmetries, given x(end) - x(0) of the piece; and the gap of the loop."""
    if not symmetry.reverses:
        return np.zeros(3), float(np.linalg.norm(end))
    centring, left = _centring(symmetry)
    return centring @ end, math.hypot(*(left @ end))


@functools.cache
def _centring(symmetry: Symmetry) -> tuple[np.ndarray, np.ndarray]:
    """Return what takes x(end) - x(0) of the piece to x(0), (3, 3), and to what should vanish then at both ends, (6, 3)."""
    rows = np.vstack([np.eye(3) + each[3:, 3:] for each in (_reversal(symmetry), _motion(symmetry) @ _reversal(symmetry))])
    at_end = np.vstack([np.zeros((3, 3)), rows[3:]])
    centring = -np.linalg.pinv(rows, rcond=levels.DEPENDENT) @ at_end
    return centring, rows @ centring + at_end


# --- symmetry -----------------------------------------------------------------------------------------------------------


@functools.cache
def _reversal(symmetry: Symmetry) -> np.ndarray:
    """Return the matrix (6, 6) that takes E'(S) to E'(-S) for perturbations that keep the mirror or axis at S = 0.

    The mirror is normal to e1, or the axis is e1. With X the mirror's matrix, u(-S) = X u(S) for both, x(-S) = X x(S) for the
    mirror and -X x(S) for the axis, so that u x x is multiplied by -X or X.
    """
    return np.kron(np.diag([1.0, -1.0 if symmetry.mirror else 1.0]), np.diag([-1.0, 1.0, 1.0]))


@functools.cache
def _motion(symmetry: Symmetry) -> np.ndarray:
    """Return the matrix T (6, 6) that takes E'(S) to E' one part further for perturbations of class 0; x turns like w."""
    angle = 2 * np.pi * symmetry.winding / symmetry.order
    turn = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
    return np.kron(np.diag([1.0, -1.0 if symmetry.flip else 1.0]), turn)


#: x + i y, x - i y, z on the axes of theta and of w: there T is diagonal.
_CIRCULAR = np.kron(np.eye(2), np.array([[1, 1j, 0], [1, -1j, 0], [0, 0, np.sqrt(2)]]) * np.sqrt(0.5))


@functools.cache
def _phases(symmetry: Symmetry) -> np.ndarray:
    """Return the whole numbers p (6,): T on the circular axes is exp(2 pi i p / order)."""
    turning = np.array([symmetry.winding, -symmetry.winding, 0])
    return np.concatenate([turning, turning + (symmetry.order // 2 if symmetry.flip else 0)])


@functools.cache
def _closing(symmetry: Symmetry) -> tuple[np.ndarray, np.ndarray]:
    """Return Z (J, 6, 6) and rows (J, c, 6) of all classes j: E(0) = Z D, D the increment of E over a part, and rows . D = 0.

    E(0) + D = rho T E(0). Where rho T has the eigenvalue 1, D is zero and E(0) a rigid motion, which has no effect. Rows beyond
    those that a class has are zero.
    """
    phases = (np.arange(symmetry.order // 2 + 1)[:, None] + _phases(symmetry)) % symmetry.order
    factors, rigid = np.exp(2j * np.pi * phases / symmetry.order) - 1, phases == 0
    inverse = np.where(rigid, 0, 1 / np.where(rigid, 1, factors))
    first = np.argsort(~rigid, axis=1, kind="stable")[:, : max(rigid.sum(axis=1).max(), 1)]
    rows = _CIRCULAR[first] * np.take_along_axis(rigid, first, axis=1)[:, :, None]
    return _CIRCULAR.conj().T @ (inverse[:, :, None] * _CIRCULAR), rows


@functools.cache
def _kinds(symmetry: Symmetry) -> tuple[list[tuple[int, str]], np.ndarray, np.ndarray, np.ndarray, int]:
    """Return names, wavenumbers (K,), multiplicities (K, 1) and unknowns (K, 2), and the class of the shift of phase.

    Unknowns are 1 where values with one sign under the reversal, and with the other one, are unknowns of the class. All values
    are of the first kind where nothing reverses the loop.
    """
    kinds: dict[tuple[int, str], tuple[float, float]] = {}
    for j in range(symmetry.order // 2 + 1):
        if not symmetry.reverses or 2 * j % symmetry.order:
            kinds[j, ""] = 1.0, float(symmetry.reverses)
        else:
            kinds[j, "even"], kinds[j, "odd"] = ((1.0, 0.0), (0.0, 1.0)) if j == 0 else ((0.0, 1.0), (1.0, 0.0))
    unknowns, names = np.array(list(kinds.values())), list(kinds)
    shift = names.index((0, "odd" if symmetry.reverses else ""))
    return names, np.array([j for j, _ in names]), unknowns.sum(axis=1, keepdims=True).astype(int), unknowns, shift


@functools.cache
def _couplings(symmetry: Symmetry) -> np.ndarray:
    """Return what takes mu and R, (6,), to N as one row: those parts of it that have the symmetry of the loop, (6, 36)."""
    return np.array([_symmetric(coupling(axis[:3], axis[3:]), symmetry).ravel() for axis in np.eye(6)])


def _symmetric(matrix, symmetry: Symmetry) -> np.ndarray:
    """Return the part of N (6, 6) that has the symmetry of the loop: all of it, except for a state that is not on a branch."""
    phases = _phases(symmetry)
    circular = _CIRCULAR @ matrix @ _CIRCULAR.conj().T
    circular[(phases[:, None] - phases) % symmetry.order != 0] = 0
    matrix = (_CIRCULAR.conj().T @ circular @ _CIRCULAR).real.copy()
    return (matrix - _reversal(symmetry) @ matrix @ _reversal(symmetry)) / 2 if symmetry.reverses else matrix


# --- the form -----------------------------------------------------------------------------------------------------------


def _of_mesh(points: _Points, coupling, degree: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, int]:
    """Return Q on each interval of the mesh (N, m, m), increments (N, 6, m), the shift of phase (N, m), and unknowns in use.

    Unknowns are v at the Gauss points times the roots of their weights. Q is the identity plus l c_ij G_j^T N G_i / 2 between
    the Gauss points j and i, l the length and c_ij = a_ij sqrt(w_i / w_j) - a_ji sqrt(w_j / w_i), with the Runge-Kutta
    method's matrix a and weights w.
    """
    count, _, _, controls = points.generator.shape
    size = degree * controls
    room = max(size, 2 * _RIGID)
    forms, increments, motion = np.zeros((count, room, room)), np.zeros((count, _RIGID, room)), np.zeros((count, room))
    factors, roots = _on_interval(degree, controls)
    generator = points.generator.transpose(0, 2, 1, 3).reshape(count, _RIGID, size)  # columns: Gauss point, function
    half = points.lengths[:, None, None] / 2
    forms[:, :size, :size] = np.eye(size) + half * (generator.transpose(0, 2, 1) @ (coupling @ generator) * factors)
    roots = np.sqrt(points.lengths[:, None]) * roots
    increments[:, :, :size], motion[:, :size] = generator * roots[:, None], points.motion.reshape(count, -1) * roots
    return forms, increments, motion, size


@functools.cache
def _on_interval(degree: int, controls: int) -> tuple[np.ndarray, np.ndarray]:
    """Return c_ij of `_of_mesh`, and the roots of the weights, for so many functions at each Gauss point."""
    tables = basis(degree)
    scaled = tables.runge_kutta * np.sqrt(tables.weights[:, None] / tables.weights)
    return np.kron(scaled.T - scaled, np.ones((controls, controls))), np.repeat(np.sqrt(tables.weights), controls)


class _Form:
    """The second variation on the piece: its matrix and W (6, n), for n unknowns.

    ``eigenvalues`` (K, m) are those of the K classes; ``residual`` is Q of the shift of phase.
    """

    def __init__(self, equilibrium: Equilibrium, points: _Points):
        self.symmetry = equilibrium.symmetry
        self.coupling = (np.append(points.momentum, equilibrium.force) @ _couplings(self.symmetry)).reshape(6, 6)
        forms, increments, motion, size = _of_mesh(points, self.coupling, equilibrium.degree)
        sizes, work = np.full(len(forms), size), np.empty((2, *forms.shape[1:]))
        count = condense_forms(forms, increments, motion, self.coupling, _DEFINITE, sizes, work)
        kept = np.arange(forms.shape[1]) < sizes[:count, None]
        self.increments, self.motion = increments[:count].transpose(1, 0, 2)[:, kept], motion[:count][kept]
        order, first = np.repeat(np.arange(count), sizes[:count]), 0
        self.matrix = self.increments.T @ self.coupling @ self.increments / 2 * np.sign(order - order[:, None])
        for form, size in zip(forms, sizes[:count]):
            own = slice(first, first + size)
            self.matrix[own, own] += (form[:size, :size] + form[:size, :size].T) / 2
            first += size

    def classes(self) -> tuple[SymmetryClass, ...]:
        """Return every class; set ``eigenvalues`` and ``residual``. Unknowns that a class has not are projected out."""
        (names, wavenumbers, multiplicities, unknowns, shift), (forms, rows) = _kinds(self.symmetry), self._parts()
        used, known = np.repeat(unknowns, len(self.motion), axis=1)[:, : len(forms[0])], np.zeros(len(forms[0]))
        known[used[shift] > 0] = self.motion
        forms = forms[wavenumbers] * used[:, :, None] * used[:, None]
        forms.reshape(len(forms), -1)[:, :: used.shape[1] + 1] += 1 - used  # their diagonals
        self.eigenvalues, self.residual = _spectra(forms, rows[wavenumbers] * used[:, None], known, shift)
        found = zip(names, multiplicities[:, 0].tolist(), self.eigenvalues)
        return tuple(SymmetryClass(*name, multiplicity, values) for name, multiplicity, values in found)

    def _parts(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the matrices of all wavenumbers on a part of the loop (J, m, m), and their conditions of closure (J, c, m).

        With a reversal, v on the image of the piece is v on it times 1 or -1. Both kinds are unknowns, the second times i,
        which makes the matrix real; in a class with a parity they do not couple.
        """
        form, increments, (closing, rows) = self.matrix, self.increments, _closing(self.symmetry)
        if self.symmetry.reverses:
            n, image = len(form), _motion(self.symmetry) @ _reversal(self.symmetry)
            across, reflected = increments.T @ (self.coupling @ image) @ increments / 2, image @ increments
            form = np.zeros((2 * n, 2 * n))
            form[:n, :n], form[n:, n:] = self.matrix + across, self.matrix - across
            increments = np.concatenate([increments + reflected, 1j * (increments - reflected)], axis=1) * np.sqrt(0.5)
        closing = closing.conj().transpose(0, 2, 1) @ self.coupling
        forms = form + (increments.conj().T @ ((closing + closing.conj().transpose(0, 2, 1)) / 2) @ increments).real
        conditions = rows @ increments
        return forms, np.concatenate([conditions.real, conditions.imag], axis=1)


def _spectra(forms, rows, known, shift: int) -> tuple[np.ndarray, float]:
    """Return eigenvalues (K, n) of forms under conditions (K, c, n), without one's known zero (n,), and |Q| there."""
    _, sizes, out = np.linalg.svd(rows, full_matrices=False)
    out = np.concatenate([out * (sizes > levels.DEPENDENT)[:, :, None], np.zeros((len(forms), 1, len(known)))], axis=1)
    known = known - out[shift].T @ (out[shift] @ known)
    size = math.sqrt(known @ known)
    if size > levels.DOUBLED:
        out[shift, -1] = known / size
    residual = float(abs(out[shift, -1] @ forms[shift] @ out[shift, -1]))
    across = out.transpose(0, 2, 1)
    image = forms @ across  # between the projectors, and the identity on what they project out
    crossed = (image - across @ ((out @ image + np.eye(out.shape[1])) / 2)) @ out
    return np.linalg.eigvalsh(forms - crossed - crossed.transpose(0, 2, 1)), residual
