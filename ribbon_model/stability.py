"""The index of an equilibrium: negative directions of its energy on closed perturbations, by symmetry class.

The second variation (`ribbon_model.second_variation`) is the identity plus a compact form: in Fourier coefficients on the loop,

    Q = sum over l of |v_l|^2 + sum over p != 0 of (1/p) e_p . (i N) e_p,    e = G v,   e_0 = 0.

It is taken on the v with |l| up to a cutoff. High wavenumbers cannot lower the energy, and raising the cutoff can only raise
the count. A loop of ``order`` equal parts couples only wavenumbers that are equal modulo ``order``: one small matrix for each
class j = 0 ... order/2, real if there is a mirror, in two where the mirror keeps the class. The six conditions e_0 = 0 and the
shift of phase, whose vector C^T M' is known, are projected out. So no eigenvalue is zero but at a bifurcation.

Instead of S the variable is a tau that runs faster where the strip is more curved; that changes nothing but the cutoff needed.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ribbon_model.equilibrium import LENGTH
from ribbon_model.second_variation import Equilibrium, coupling

_CUTOFFS = (6, 9, 13, 19, 28, 42, 63, 94, 141, 212, 318, 477)  # wavenumbers in units of order
_SAMPLES = (128, 256, 512, 1024, 2048, 4096)  # stations on a part
_TAIL = 1e-10  # of the coefficients of G: where the samples are enough
_NEUTRAL = 1e-9  # an eigenvalue below this is zero as far as equilibria are known
_RESIDUAL = 1e-3  # of the known null vector
_NO_MOTION = 1e-8  # below this |C^T M'| the equilibrium is a circle, and a shift of phase a rigid rotation


@dataclass(frozen=True)
class SymmetryClass:
    """Perturbations of one kind under the symmetry of the loop.

    Attributes
    ----------
    wavenumber : int
        j: from one part of the loop to the next the perturbation gains the factor exp(2 pi i j / order), besides the motion
        that takes one part to the next. j = 0 keeps the symmetry.
    parity : str
        'even' or 'odd' under the mirror (or two-fold axis) at S = 0; '' where that takes j to another class, or there is none.
    multiplicity : int
        2 if the class -j, which has the same eigenvalues, is another one: then modes come in pairs.
    eigenvalues : ndarray
        Of Q over int |v|^2, ascending: pure numbers that accumulate at 1. Smooth along a branch where they are simple.
    errors : ndarray
        By how much they fell when the cutoff was last raised.
    floor : float
        What cannot be told from zero: the residual of the known null vector, and round-off.
    """

    wavenumber: int
    parity: str
    multiplicity: int
    eigenvalues: np.ndarray
    errors: np.ndarray
    floor: float

    @property
    def name(self) -> tuple[int, str]:
        """What tells the class from the others of the same loop."""
        return self.wavenumber, self.parity

    @property
    def negative(self) -> int:
        """Number of negative eigenvalues, not multiplied."""
        return int(np.sum(self.eigenvalues < 0))

    @property
    def determinant(self) -> float:
        """The product of the eigenvalues, which converges: analytic along a branch, also where eigenvalues cross each other."""
        return float(np.prod(self.eigenvalues))

    @property
    def nearest(self) -> int:
        """Which eigenvalue is nearest to zero."""
        return int(np.argmin(np.abs(self.eigenvalues)))


@dataclass(frozen=True)
class Stability:
    """Result of `index`.

    Attributes
    ----------
    index : int
        Number of negative directions. 0 is a local minimum of the energy.
    decided : bool
    reason : str
        If not decided: what could not be told.
    cutoff : int
        Largest wavenumber of the perturbations.
    defect : float
        The larger of: mean of d3 (zero on a closed loop), relative residual of the known null vector.
    classes : tuple of SymmetryClass
    """

    index: int
    decided: bool
    reason: str
    cutoff: int
    defect: float
    classes: tuple[SymmetryClass, ...]

    def __getitem__(self, name: tuple[int, str]) -> SymmetryClass:
        """A class by its ``name``."""
        return next(entry for entry in self.classes if entry.name == tuple(name))

    @property
    def critical(self) -> SymmetryClass:
        """The class that has the eigenvalue nearest to zero."""
        return min(self.classes, key=lambda entry: abs(entry.eigenvalues[entry.nearest]))


def index(equilibrium: Equilibrium, accuracy: float | None = None) -> Stability:
    """Number of negative directions of the energy of a closed equilibrium.

    The cutoff is raised until, in every class, the eigenvalue nearest to zero moves by less than a quarter of its distance from
    zero and the count stays; the known null vector leaves a residual below 1e-3; and the wavenumbers left out are those that a
    local estimate says cannot be unstable. Where that cannot be reached, or an eigenvalue is zero, the result is not decided.

    Parameters
    ----------
    accuracy : float, optional
        Besides, in every class the eigenvalue nearest to zero, if below 1/2, moves by less than this: to find roots.

    Raises
    ------
    ValueError
        A loop that is not closed, or an energy that is not convex in the strains at that state: then high wavenumbers lower it
        without end, and there is no index.
    """
    form = _transformed(equilibrium)
    start = min(np.searchsorted(_CUTOFFS, max(form.bandwidth / 2, form.reach)), len(_CUTOFFS) - 2)
    coarse = form.classes(_CUTOFFS[start])
    for cutoff in _CUTOFFS[start + 1 :]:
        fine = form.classes(cutoff)
        result, settled = _compared(form, coarse, fine, cutoff, accuracy)
        if settled:
            break
        coarse = fine
    return result


def _compared(form: _Form, coarse, fine, cutoff, accuracy) -> tuple[Stability, bool]:
    """The result at a cutoff, judged by the one before, and whether a higher cutoff is of no use."""
    classes, doubts, neutral, residual = [], [], [], 0.0
    for (j, parity, multiplicity, low, _), (_, _, _, high, rest) in zip(coarse, fine):
        errors = np.full(len(high), np.inf)
        errors[: len(low)] = np.abs(low - high[: len(low)])
        floor = max(rest, _NEUTRAL)
        entry = SymmetryClass(j, parity, multiplicity, high, errors, floor)
        k, residual = entry.nearest, max(residual, rest)
        distance = abs(high[k])
        label = f"class {j} {parity}".strip()
        if max(distance, errors[k]) <= _NEUTRAL:
            neutral.append(f"{label}: an eigenvalue {high[k]:.1e} cannot be told from zero")
        elif distance <= max(4 * errors[k], floor) or np.sum(low < 0) != entry.negative:
            doubts.append(f"{label}: an eigenvalue {high[k]:.1e} is not known better than {max(errors[k], floor):.1e}")
        if accuracy is not None and errors[k] > accuracy and distance < 0.5:
            doubts.append(f"{label}: an eigenvalue {high[k]:.1e} still moves by {errors[k]:.1e}")
        classes.append(entry)
    if residual > _RESIDUAL:
        doubts.append(f"the shift of phase leaves a residual of {residual:.1e}")
    if cutoff < form.reach:
        doubts.append(f"wavenumbers up to {form.reach * form.order:.0f} may be unstable")
    if form.rank != 6:
        neutral.append(f"{form.rank} of the six conditions of closure are independent")
    total = sum(entry.multiplicity * entry.negative for entry in classes)
    defect = max(form.closure, residual)
    reasons = doubts + neutral
    return Stability(total, not reasons, "; ".join(reasons), cutoff * form.order, defect, tuple(classes)), not doubts


class _Form:
    """The second variation in Fourier coefficients, and its matrices.

    A coefficient of G from column c to row r, at the wavenumber r_shift - c_shift + order * k, is ``generator[k, r, c]``.
    ``reach`` is the largest wavenumber, over order, at which a local estimate finds instability.
    """

    def __init__(self, symmetry, generator, motion, coupling, rows, columns, signs, closure, reach):
        self.symmetry, self.order, self.closure, self.reach = symmetry, symmetry.order, closure, reach / symmetry.order
        self.generator, self.motion, self.coupling = generator, motion, coupling
        self.rows, self.columns, self.signs = rows, columns, signs
        self.coupled = np.flatnonzero(np.abs(coupling).max(axis=0) > 1e-13 * np.abs(coupling).max())
        size = np.abs(generator).max(axis=(1, 2))
        large = np.flatnonzero(size > 1e-3 * size.max())
        self.bandwidth = int(np.minimum(large, len(size) - large).max())
        self.rank = 0
        if np.any(np.abs(coupling[(rows[:, None] - rows) % self.order != 0]) > 1e-6 * (1 + np.abs(coupling).max())):
            raise ValueError("the moment and force do not have the symmetry that the frame has")

    def classes(self, cutoff):
        """(j, parity, multiplicity, eigenvalues, residual) of every class; counts the conditions of closure in ``rank``."""
        a, b = np.arange(-cutoff - 1, cutoff + 2), np.arange(-2 * cutoff - 1, 2 * cutoff + 2)
        k, count = b[:, None] - a, len(self.generator)
        toeplitz = self.generator[k % count]  # (rows' b, columns' a, 6, c)
        toeplitz[np.abs(k) >= count // 2] = 0
        motion = np.where(np.abs(a)[:, None] < count // 2, self.motion[a % count], 0)
        matrix = toeplitz.transpose(2, 0, 3, 1).reshape(6, len(b), -1)  # columns ordered by c, then a
        found, self.rank = [], 0
        for j in range(self.order // 2 + 1):
            wavenumbers = (j + self.columns[:, None] + self.order * a).ravel()
            p = j + self.rows[:, None] + self.order * b
            weights = np.where((p == 0) | (np.abs(p) > self.order * (2 * cutoff + 0.5)), 0.0, 1 / np.where(p == 0, 1, p))
            own = 2 * j % self.order == 0
            for parity in ("even", "odd") if own and self.symmetry.reverses else ("",):
                basis = self._basis(wavenumbers, len(a), cutoff, parity)
                e, conditions = self._combined(matrix[self.coupled], basis), self._combined(matrix[p == 0], basis)
                vector = self._combined(motion.T.ravel(), basis) if j == 0 else np.zeros(0)
                eigenvalues, residual, rank = self._eigenvalues(e, weights[self.coupled], conditions, vector)
                multiplicity = 1 if own else 2
                found.append((j, parity, multiplicity, eigenvalues, residual))
                self.rank += multiplicity * rank
        return found

    def _basis(self, wavenumbers, count, cutoff, parity):
        """Columns of the class up to the cutoff as sums of two: their numbers (2, K) and weights (2, K)."""
        inside = np.flatnonzero(np.abs(wavenumbers) <= self.order * (cutoff + 0.5))
        if not parity:
            return inside, inside, np.ones(len(inside)), np.zeros(len(inside))
        sign = (1 if parity == "even" else -1) * self.signs[inside // count]
        place = {(i // count, wavenumbers[i]): i for i in inside}
        opposite = np.array([place[i // count, -wavenumbers[i]] for i in inside])
        keep = (wavenumbers[inside] > 0) | ((wavenumbers[inside] == 0) & (sign > 0))
        inside, opposite, sign = inside[keep], opposite[keep], sign[keep]
        scale = np.where(inside == opposite, 0.5, math.sqrt(0.5))
        return inside, opposite, scale, scale * sign

    @staticmethod
    def _combined(columns, basis):
        """From columns (..., all) to those of a basis (..., K)."""
        result = columns[..., basis[0]]
        return result if basis[0] is basis[1] else result * basis[2] + columns[..., basis[1]] * basis[3]

    def _eigenvalues(self, e, weights, conditions, vector):
        """Eigenvalues under the conditions, the shift of phase left out; its residual; number of independent conditions."""
        form = np.eye(e.shape[2], dtype=e.dtype)
        strength = self.coupling[np.ix_(self.coupled, self.coupled)]
        for r, s in np.argwhere(np.abs(strength) > 1e-13 * np.abs(strength).max(initial=0.0)):
            form += strength[r, s] * (e[r].conj().T @ (weights[s][:, None] * e[s]))
        basis, sizes, _ = np.linalg.svd(conditions.conj().T, full_matrices=False)
        basis = basis[:, sizes > 1e-9]
        rank, residual = basis.shape[1], 0.0
        length = np.linalg.norm(vector)
        if length > _NO_MOTION:
            vector = vector / length
            against = np.linalg.norm(basis.conj().T @ vector)
            vector = vector - basis @ (basis.conj().T @ vector)
            image = form @ vector
            residual = float(max(against, np.linalg.norm(image - basis @ (basis.conj().T @ image))))
            basis = np.hstack([basis, vector[:, None] / np.linalg.norm(vector)])
        # between the projectors, the directions projected out get the eigenvalue 1, which is where all others accumulate
        image = form @ basis
        crossed = image @ basis.conj().T
        inner = basis @ (basis.conj().T @ image + np.eye(basis.shape[1])) @ basis.conj().T
        return np.linalg.eigvalsh(form - crossed - crossed.conj().T + inner), residual, rank


_CIRCULAR = np.array([[1, 1j, 0], [1, -1j, 0], [0, 0, math.sqrt(2)]]) * math.sqrt(0.5)  # (x + iy, x - iy, z)


@dataclass(frozen=True)
class _Samples:
    """Fields at tau = part * i / count on one part of the loop: S' = dS/dtau, and what `_sampled` finds."""

    tau: np.ndarray
    speed: np.ndarray
    directors: np.ndarray
    centreline: np.ndarray
    momentum: np.ndarray
    moment: np.ndarray
    strain: np.ndarray
    compliance: np.ndarray
    closure: float


def _sampled(equilibrium: Equilibrium, count: int, stretch) -> _Samples:
    """Frame, centreline (by Fourier series, mean zero), mu, body components of M, strains and compliance."""
    symmetry = equilibrium.symmetry
    tau = np.arange(count) * (LENGTH / symmetry.order / count)
    shift, speed = stretch(count)
    d = equilibrium.directors(tau + shift)
    turns = _shifts(symmetry)[3:]
    carrier = np.exp(1j * turns[:, None] * tau)
    series = np.fft.fft((_CIRCULAR @ (d[:, 2].T * speed)) / carrier) / count
    p = turns[:, None] + symmetry.order * np.fft.fftfreq(count, 1 / count).round().astype(int)
    constant = p == 0
    integral = np.where(constant, 0, series / np.where(constant, 1, 1j * p))
    x = (_CIRCULAR.conj().T @ (np.fft.ifft(integral) * count * carrier)).real.T
    momentum = equilibrium.moment + np.cross(x[0], equilibrium.force)
    moment = np.einsum("kij,kj->ki", d, momentum - np.cross(x, equilibrium.force))
    strain, compliance = equilibrium.response(moment)
    closure = float(np.abs(series[constant]).max(initial=0.0))
    return _Samples(tau, speed, d, x, momentum, moment, strain, compliance, closure)


def _shifts(symmetry) -> np.ndarray:
    """Wavenumber modulo ``order`` of the rows (6,) of G v on the circular axes, for v of the class 0."""
    turning = np.array([symmetry.winding, -symmetry.winding, 0])
    return np.concatenate([turning, turning + (symmetry.order // 2 if symmetry.flip else 0)])


def _uniform(count):
    return np.zeros(count), np.ones(count)


def _stretched(equilibrium: Equilibrium, count: int = 512, modes: int = 40):
    """A smooth S(tau), stretch(count) = (S - tau, dS/dtau), with dtau/dS about |omega|^2 over its mean + 0.1."""
    at = _sampled(equilibrium, count, _uniform)
    part = LENGTH / equilibrium.symmetry.order
    density = np.sum(at.strain**2, axis=1)
    density = density / density.mean() + 0.1
    tau = np.concatenate([[0.0], np.cumsum((density + np.roll(density, -1)) / 2)])
    inverse = np.interp(at.tau, part * tau / tau[-1], np.append(at.tau, part))
    series = np.fft.rfft(inverse - at.tau)[:modes] / count * np.exp(-36 * (np.arange(modes) / modes) ** 8)
    if equilibrium.symmetry.reverses:
        series = 1j * series.imag
    slope = series * (2j * math.pi / part * np.arange(modes))

    def stretch(count):
        return np.fft.irfft(series * count, count), 1 + np.fft.irfft(slope * count, count)

    return stretch if stretch(count)[1].min() > 0 else _uniform


def _transformed(equilibrium: Equilibrium) -> _Form:
    """The second variation of an equilibrium in Fourier coefficients, from as many samples as it takes."""
    stretch = _stretched(equilibrium)
    for count in _SAMPLES:
        form = _form(equilibrium, _sampled(equilibrium, count, stretch))
        size = np.abs(form.generator)
        if size[3 * count // 8 : 5 * count // 8].max() < _TAIL * size.max():
            break
    if form.closure > 1e-6:
        raise ValueError(f"the loop is not closed: the mean of d3 is {form.closure:.1e}")
    return form


def _form(equilibrium: Equilibrium, at: _Samples) -> _Form:
    """Fourier coefficients of G, of C^T M' and of N on circular axes, real if there is a mirror."""
    symmetry, d = equilibrium.symmetry, at.directors
    free = np.array([0, 2] if equilibrium.law.constrained else [0, 1, 2])
    try:
        factor = np.linalg.cholesky(at.compliance[:, free][:, :, free])
    except np.linalg.LinAlgError as error:
        raise ValueError("the energy is not convex in the strains along this equilibrium: it has no index") from error
    root = np.sqrt(at.speed)[:, None]
    u = np.einsum("kai,kab->ikb", d[:, free], factor) * root
    w = np.cross(u, at.centreline.T[:, :, None], axis=0)
    fields = np.einsum("ij,fjkb->fikb", _CIRCULAR, [u, w]).reshape(6, len(at.tau), -1)
    rows, columns = _shifts(symmetry), np.array([0, 1, 1])[free] * (symmetry.order // 2 if symmetry.flip else 0)
    carrier = np.exp(-1j * (rows[:, None, None] - columns) * at.tau[:, None])
    generator = np.fft.fft(fields * carrier, axis=1).transpose(1, 0, 2) / len(at.tau)
    force = np.einsum("kij,j->ki", d, equilibrium.force)
    rate = np.cross(at.moment, at.strain) + np.cross(force, [0.0, 0.0, 1.0])  # M'
    motion = np.einsum("kab,ka->kb", factor, rate[:, free]) * root
    motion = np.fft.fft(motion * np.exp(-1j * columns * at.tau[:, None]), axis=0) / len(at.tau)
    circular = np.kron(np.eye(2), _CIRCULAR)
    form = circular @ (1j * coupling(at.momentum, equilibrium.force)) @ circular.conj().T
    signs = np.array([1, -1, 1] if symmetry.axis else [1, 1, -1])[free]  # of the functions v under S -> -S
    if symmetry.reverses:  # phases that make everything real
        row_phase = np.array([-1j, -1j, 1, *((-1j, -1j, 1) if symmetry.axis else (1, 1, -1j))])
        phase = np.where(signs > 0, 1, 1j)
        generator = (row_phase[:, None] * generator * phase).real
        motion = (1j * motion / phase).real
        form = (row_phase[:, None] * form / row_phase).real
    return _Form(symmetry, generator, motion, form, rows, columns, signs, at.closure, _reach(at))


def _reach(at: _Samples) -> float:
    """The wavenumber above which waves on a short piece of the strip cost energy: from |M| and the compliance K there.

    A wave of wavenumber l has theta ~ u/l, so N contributes M_2 |K| / l of the stiffness, and |M| |omega| |K| / l^2 in the next
    order, which on a circle gives the threshold of the linear theory.
    """
    moment, curvature = np.linalg.norm(at.moment, axis=1), np.linalg.norm(at.strain, axis=1)
    softness = np.linalg.norm(at.compliance, axis=(1, 2))
    local = curvature**2 + moment * curvature * softness + (at.moment[:, 1] * softness) ** 2
    return float((at.speed * np.sqrt(local)).max())
