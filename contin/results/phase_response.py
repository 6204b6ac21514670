"""The phase response of a cycle: by how much a small perturbation makes it early, with errors, and as a picture.

On the unit interval, the part of the cycle that is computed (one n-th of it, with a symmetry), y' = G(y, T) with y the states
divided by their sizes. With M the matrix of the discrete equations, the period T being the only free parameter, the steps are

    1. M^T w = e_T: a source g in the equations at the Gauss points changes the period by the sum of h w_q.g_q;
    2. Z = -w / (n b) at the Gauss points, b their weights: being early by Z.g for each source makes the period shorter;
    3. Z at the first node, from the column of M of that node in the first interval;
    4. Z at all nodes, interval by interval: the polynomial of degree d with Z' = -G_y^T Z at the Gauss points.

Step 3 and the rows of M^T w = e_T say that the end of each polynomial is the beginning of the next one, and that Z is periodic.
Z.F = 1 in the mean at the Gauss points, as the row of the period in M^T w = e_T says.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from contin import errors as checks
from contin.arrays import Array
from contin.core.newton import correct
from contin.cycles.floquet import has_double_one
from contin.errors import ConvergenceError, ProblemError
from contin.problems.statement import PERIOD
from contin.results.marks import PALETTE, Axes, Colour, new_axes


def adjoint(system: Any, x: Array) -> Array:
    """Return Z with Z' = -F_u^T Z and Z.F = 1 at the nodes of an autonomous cycle, in the user's units, shape (K, n)."""
    system, x = system.with_free([PERIOD], x)
    n, d, count = system.states_count, system.degree, system.intervals
    unit = np.zeros(system.size)
    unit[system.parameter_index(PERIOD)] = 1.0
    with np.errstate(all="ignore"):
        sources = system.linearize(x)[1].solve_transposed(unit)[: count * d * n].reshape(count, d, n)
    z = -(system.free_scales[0] / system.order) * sources / system.basis.weights[:, None]
    turned = np.einsum("jqab,jqa->jqb", system.rates_by_states(x, system.at_gauss_points(x)).reshape(count, d, n, n), z)
    turned *= np.diff(system.mesh)[:, None, None]
    basis = system.basis
    weighted = basis.weights[:, None]
    found = np.empty((count * d + 1, n))
    found[0] = basis.value[:, 0] @ (weighted * turned[0]) - basis.slope[:, 0] @ (weighted * z[0])
    inverse = np.linalg.inv(basis.slope[:, 1:])
    for j in range(count):
        found[j * d + 1 : (j + 1) * d + 1] = inverse @ (-turned[j] - np.outer(basis.slope[:, 0], found[j * d]))
    return found / system.scales.states


#: Places at which a response is drawn.
_DRAWN = 800


class PhaseResponse:
    """The gradient Z of the phase on a cycle u(t): after a small change v of the states at t, the motion is early by Z(t).v.

    The phase is a time: Z.F = 1 along the cycle, and Z has the unit of time over that of the state. Times 2 pi / period it is
    that of an angle. To first order in any force g on a cycle that attracts, the phase changes at the rate 1 + Z.g.

    Attributes
    ----------
    names : tuple of str
        Of the states.
    period : float
    times : ndarray, shape (K,)
        Nodes, from 0 to the period; the cycle begins where ``point.system.evaluate`` has it at 0.
    values : ndarray, shape (K, n)
        Z there; ``response["x"]`` is the column of a state.
    errors : dict of str to float
        Of each state, the estimated error: the largest change of Z by halving the mesh. NaN where the cycle was not found on
        that.

    Examples
    --------
    >>> import math, contin
    >>> def field(u, p):
    ...     square = u.x**2 + u.y**2
    ...     return u.x - p.w * u.y - u.x * square, u.y + p.w * u.x - u.y * square
    >>> problem = contin.CycleProblem(field, ["x", "y"], {"w": 2.0})
    >>> orbit = contin.solve(problem, lambda t: (math.cos(2 * math.pi * t), math.sin(2 * math.pi * t)), {"period": 3.0})
    >>> response = orbit.phase_response()
    >>> x, y = orbit.system.evaluate(orbit.x, np.array([0.3]))[0]  # Z = (-y, x) / w
    >>> bool(np.allclose(response(0.3 * response.period), [-y / 2, x / 2])), sorted(response.errors)
    (True, ['x', 'y'])
    """

    def __init__(self, system: Any, x: Array) -> None:
        if not system.is_cycle or not system.intervals or not system.autonomous:
            raise ProblemError("phase_response: the point must be a cycle of an autonomous CycleProblem, which has a phase")
        if has_double_one(system, x):
            raise ProblemError("phase_response: a second multiplier is 1 (a fold, or a family of cycles), so there is no phase")
        system, x = system.with_free([PERIOD], x)
        found, changes = adjoint(system, x), np.full(system.states_count, np.nan)
        finer, carry = system.refined()
        try:
            again = correct(finer, carry(x)).x
        except ConvergenceError:
            pass
        else:
            coarse, found = found, adjoint(finer, again)
            changes = np.abs(coarse - finer.perturbation(_unknowns(finer, found), system.nodes)).max(axis=0)
            system, x = finer, again
        self.names: tuple[str, ...] = system.problem.state_names
        self.period = float(system.duration(x))
        self.errors = dict(zip(self.names, map(float, changes)))
        self._system, self._part = system, _unknowns(system, found)
        parts = np.arange(system.order)[:, None]
        self.times: Array = np.append((parts + system.nodes[:-1]).ravel(), system.order) * self.period / system.order
        self.values: Array = self(self.times)

    def __repr__(self) -> str:
        listed = ", ".join(f"{name} ± {error:.2g}" for name, error in self.errors.items())
        return f"PhaseResponse({listed}; period {self.period:.6g}, {len(self.times)} nodes)"

    def __getitem__(self, name: str) -> Array:
        """Return the response to a state at the nodes, shape (K,).

        Raises
        ------
        KeyError
            There is none of this name.
        """
        if name not in self.names:
            raise KeyError(f"{name!r} is none of {', '.join(self.names)}")
        return self.values[:, self.names.index(name)]

    def __call__(self, t: Any) -> Array:
        """Return Z at times (m,), any number of rounds on, shape (m, n); of one time shape (n,)."""
        system = self._system
        given = checks.array("t", t, np.shape(t)) / self.period * system.order
        times = np.atleast_1d(given).ravel()
        turns = np.floor(times)
        values = system.perturbation(self._part, times - turns)
        turned = np.linalg.inv(system.problem.symmetry).T
        powers = np.array([np.linalg.matrix_power(turned, k) for k in range(system.order)])
        found: Array = np.einsum("mab,mb->ma", powers[turns.astype(int) % system.order], values)
        return found if given.ndim else found[0]

    @checks.arguments
    def plot(self, states: Sequence[str] | None = None, axes: Axes | None = None) -> Any:
        """Draw the response to each state over one period.

        Parameters
        ----------
        states : sequence of str, optional
            All of them, up to seven, without.
        axes : matplotlib.axes.Axes, optional
            Where to draw; a figure of its own without.

        Raises
        ------
        ProblemError
            There is no such state.
        ImportError
            matplotlib is not installed.
        """
        names = self.names if states is None else checks.names("states", states)
        for name in names:
            if name not in self.names:
                raise ProblemError(f"states: {checks.shown(name)} is no state; there are {', '.join(self.names)}")
        axes = new_axes() if axes is None else axes
        t = np.linspace(0, self.period, _DRAWN)
        values = self(t)
        axes.axhline(0.0, lw=0.6, color=Colour.GREY, zorder=1)
        for name, colour in zip(names, PALETTE):
            axes.plot(t, values[:, self.names.index(name)], lw=1.5, color=colour, label=name)
        axes.margins(x=0)
        axes.set(xlabel="t", ylabel=f"time gained per change of {names[0] if len(names) == 1 else 'a state'}")
        if len(names) > 1:
            axes.legend(frameon=False, ncols=min(len(names), 4), loc="lower center", bbox_to_anchor=(0.5, 1.0))
        return axes


def _unknowns(system: Any, values: Array) -> Array:
    return np.append(values.ravel(), np.zeros(system.size - system.state_size))
