"""The index of an equilibrium by conjugate points: Jacobi fields integrated along the loop, no basis functions.

Rigid motions have no effect, so E = (theta, w) may be fixed to zero at S = 0, and then also at S = L. This leaves the index
of a problem with fixed ends, which is the number of conjugate points in (0, L) (Morse). With p the momentum of E, Jacobi fields
obey the Hamiltonian system

    E' = A pi,   p' = N A pi / 2,   pi = p + N E / 2,   A = G G^T,

and a conjugate point is where the plane of the six fields with E(0) = 0 has a vector with E = 0. That plane is Lagrangian: the
eigenvalues exp(2 i alpha_k) of W = (p + i E)(p - i E)^-1 lie on the unit circle. They begin at alpha_k = 0, leave upwards, and
pass a multiple of pi upwards at each conjugate point and nowhere else. So the index is the sum of ceil(alpha_k(L)/pi) - 1, got
from one continuous angle, the sum of the alpha_k = arg det(p + i E), and the eigenvalues of W at the end. The plane is made
orthonormal again on the way, which changes neither.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ribbon_model.equilibrium import LENGTH
from ribbon_model.second_variation import Equilibrium, coupling, cross_matrix


@dataclass(frozen=True)
class ConjugatePoints:
    """Result of `conjugate_index`.

    Attributes
    ----------
    index : int
    distance : float
        Distance of alpha_k(L) from a multiple of pi, without the shift of phase: zero if a further mode is neutral.
    defect : float
        The largest of: distance of the count from a whole number, of the shift of phase from the plane of Jacobi fields, gaps
        of the frame between segments and of the centreline at the end.
    decided : bool
        True if ``distance`` exceeds a hundred times the defect.
    """

    index: int
    distance: float
    defect: float
    decided: bool


def conjugate_index(equilibrium: Equilibrium, tolerance: float = 1e-10) -> ConjugatePoints:
    """Return the number of negative directions of the energy of a closed equilibrium, by conjugate points.

    The equilibrium is integrated together with the Jacobi fields, in segments that begin with its own frame, because the
    initial value problem is unstable.

    Parameters
    ----------
    tolerance : float
        Relative tolerance of the integration (DOP853).

    Raises
    ------
    RuntimeError
        If the integration fails.
    """
    from scipy.integrate import solve_ivp

    flow = _Flow(equilibrium)
    centreline, plane, angle, gap = np.zeros(3), np.eye(12)[:, 6:], 0.0, 0.0
    ends = np.linspace(0, LENGTH, 8 * max(2, equilibrium.symmetry.order) + 1)
    frames = equilibrium.directors(ends)
    for span, start, end in zip(zip(ends[:-1], ends[1:]), frames[:-1], frames[1:]):
        y = np.concatenate([start.ravel(), centreline, plane.ravel(), [angle]])
        done = solve_ivp(flow, span, y, method="DOP853", rtol=tolerance, atol=tolerance / 10, first_step=span[1] - span[0])
        if not done.success:
            raise RuntimeError(f"the Jacobi fields could not be integrated: {done.message}")
        frame, centreline, plane, angle = _split(done.y[:, -1])
        plane, gap = np.linalg.qr(plane)[0], max(gap, np.abs(frame - end).max())
    return _count(plane, angle, flow.phase_shift(frames[0]), max(gap, np.abs(centreline).max()))


def _split(y):
    return y[:9].reshape(3, 3), y[9:12], y[12:84].reshape(12, 6), y[84]


class _Flow:
    """The right-hand side; lab axes as the equilibrium's, origin at x(0)."""

    def __init__(self, equilibrium: Equilibrium):
        self.equilibrium = equilibrium
        self.moment, self.force = equilibrium.moment, equilibrium.force
        self.coupling = coupling(self.moment, self.force)

    def __call__(self, s, y):
        frame, centreline, plane, _ = _split(y)
        moment = frame @ (self.moment - np.cross(centreline, self.force))
        strain, compliance = self.equilibrium.response(moment[None])
        spin = cross_matrix(strain[0] @ frame)
        lever = np.hstack([np.eye(3), cross_matrix(centreline)])  # E' = lever^T u
        E, p = plane[:6], plane[6:]
        rate = lever.T @ (frame.T @ compliance[0] @ frame) @ (lever @ (p + self.coupling @ E / 2))
        momentum_rate = self.coupling @ rate / 2
        turning = np.linalg.solve(p + 1j * E, momentum_rate + 1j * rate).trace().imag
        return np.concatenate([(frame @ spin.T).ravel(), frame[2], rate.ravel(), momentum_rate.ravel(), [turning]])

    def phase_shift(self, frame):
        """Momentum at S = L of the Jacobi field of the shift of phase: E = (omega, omega x x - d3) and a rigid motion.

        It is zero on circles, where the shift is a rigid motion itself.
        """
        strain, compliance = self.equilibrium.response((frame @ self.moment)[None])
        E = np.concatenate([strain[0] @ frame, -frame[2]])
        return self.coupling @ E


def _count(plane, angle, shift, gap):
    """Return the index from the plane at S = L and the sum of the angles alpha there."""
    E, p = plane[:6], plane[6:]
    unitary = np.linalg.solve((p - 1j * E).T, (p + 1j * E).T).T
    defect, size, known = gap, np.linalg.norm(shift), 0
    if size > 1e-8:
        shift = shift / size
        defect = max(defect, np.abs(unitary @ shift - shift).max())
        complement = np.linalg.svd(shift[None])[2][1:]
        unitary, known = complement @ unitary @ complement.T, 1
    rest = np.mod(np.angle(np.linalg.eigvals(unitary)) / 2, math.pi)  # in [0, pi)
    distance = float(np.minimum(rest, math.pi - rest).min())
    count = (angle - rest.sum()) / math.pi - known
    index = round(count)
    defect = float(max(defect, abs(count - index)))
    return ConjugatePoints(index, distance, defect, distance > 100 * defect)
