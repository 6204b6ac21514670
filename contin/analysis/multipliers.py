"""Multipliers for a guess of the states of a variational problem: least squares of all its equations, the states held."""

from __future__ import annotations

from typing import Any

import numpy as np

from contin.arrays import Array
from contin.discretization.collocation import Collocation
from contin.errors import ProblemError
from contin.problems.statement import multipliers_of
from contin.problems.variational import VariationalProblem

#: Gauss-Newton steps, halvings of one, and the part of the residual that the last one gains: one step does where the energy is
#: quadratic in the controls.
_STEPS, _HALVINGS, _SETTLED = 30, 30, 1e-3
#: Added to the normal equations, relative to their trace: multipliers that nothing determines stay small.
_LITTLE = 1e-13
#: The most intervals on which multipliers are looked for: the equations are solved densely. Newton's method does the rest.
_MOST_INTERVALS = 20


def with_guessed_multipliers(system: Collocation, states: Array) -> Array:
    """Return a vector of unknowns from states (K, n) at the nodes: with the multipliers that fit them best.

    Raises
    ------
    ProblemError
        The energy has no finite value there.
    """
    if system.intervals > _MOST_INTERVALS:
        a, b = system.problem.domain
        mesh = np.linspace(a, b, _MOST_INTERVALS + 1)
        coarse, _ = system.on_mesh(mesh)
        sampled = np.stack([np.interp(coarse.nodes, system.nodes, column) for column in states.T], axis=1)
        fitted = _fitted(coarse, sampled)
        return _packed(
            system, states, coarse.evaluate(fitted, system.nodes)[:, states.shape[1] :], _multipliers(coarse, fitted)
        )
    return _fitted(system, states)


def _multipliers(system: Collocation, x: Array) -> Array:
    values = dict(zip(system.problem.parameters, system.all_parameters(x)))
    return np.array([values[name] for name in multipliers_of(system.problem)])


def _packed(system: Collocation, states: Array, lam: Array, multipliers: Array) -> Array:
    values = dict(zip(system.problem.parameters, system.parameters)) | dict(zip(multipliers_of(system.problem), multipliers))
    return system.pack(np.hstack([states, lam]), values)


def _fitted(system: Collocation, states: Array) -> Array:
    """Return the unknowns that fit the states: multipliers from the rates of the states first, then from all equations.

    The rates are linear in the multipliers where the energy is quadratic in the controls; all equations are not, and far from
    zero their least squares have other minima.
    """
    lam, multipliers = np.zeros_like(states), np.zeros(len(multipliers_of(system.problem)))
    for share in (0.0, 1.0):
        lam, multipliers = _settled(system, states, (lam, multipliers), share)
    return _packed(system, states, lam, multipliers)


def _settled(system: Collocation, states: Array, start: tuple[Array, Array], share: float) -> tuple[Array, Array]:
    """Return the multipliers after damped Gauss-Newton steps, all but the rates of the states weighted by ``share``."""
    lam, multipliers = start
    residual, jacobian = _equations(system, states, lam, multipliers, share)
    if not np.all(np.isfinite(residual)):
        raise ProblemError("guess: the equations have no finite value there (look for what divides by zero, or at `starts`)")
    for _ in range(_STEPS):
        if not np.any(jacobian):
            break
        normal = jacobian.T @ jacobian
        normal[np.diag_indices_from(normal)] += _LITTLE * np.trace(normal)
        step = np.linalg.solve(normal, -(jacobian.T @ residual))
        part = 1.0
        for _ in range(_HALVINGS):
            new_lam = lam + part * step[: lam.size].reshape(lam.shape)
            new_multipliers = multipliers + part * step[lam.size :]
            new = _equations(system, states, new_lam, new_multipliers, share)
            if np.all(np.isfinite(new[1])) and np.linalg.norm(new[0]) <= np.linalg.norm(residual):
                break
            part /= 2
        else:
            break
        gained = np.linalg.norm(residual) - np.linalg.norm(new[0])
        lam, multipliers, (residual, jacobian) = new_lam, new_multipliers, new
        if gained <= _SETTLED * np.linalg.norm(residual) or np.linalg.norm(residual) < _SETTLED:
            break
    return lam, multipliers


def _equations(system: Collocation, states: Array, lam: Array, multipliers: Array, share: float) -> tuple[Array, Array]:
    """Return the residual of all equations, and its derivatives by lam (K, n), flattened, and the multipliers.

    All but the rates of the states are multiplied by ``share``.
    """
    problem: Any = system.problem
    assert isinstance(problem, VariationalProblem)
    n, d, count, basis = problem.dimension, system.degree, system.intervals, system.basis
    u = np.hstack([states, lam])
    p = system.parameters.copy()
    places = [list(problem.parameters).index(name) for name in problem.multipliers]
    p[places] = multipliers
    h = np.diff(system.mesh)
    local = u[d * np.arange(count)[:, None] + np.arange(d + 1)]
    points = np.einsum("ij,ejk->eik", basis.value, local)
    rates = np.einsum("ij,ejk->eik", basis.slope, local) / h[:, None, None]
    batch = problem.batch("field")
    field, by = batch.jacobian(system.gauss_times, points.reshape(-1, 2 * n), u[:0], p, batch.columns(places))
    field, by = field.reshape(count, d, -1), by.reshape(count, d, field.shape[-1], -1)
    weights = np.sqrt(h[:, None] * basis.weights)
    size = lam.size
    rows = np.zeros((count, d, 2 * n, size + len(places)))
    for e in range(count):
        for j in range(d + 1):
            at = n * (e * d + j)
            rows[e, :, :, at : at + n] -= by[e, :, : 2 * n, n : 2 * n] * basis.value[:, j, None, None]
            rows[e, :, n:, at : at + n] += np.eye(n) * basis.slope[:, j, None, None] / h[e]
    rows[:, :, :, size:] -= by[:, :, : 2 * n, 2 * n :]
    residual = (rates - field[:, :, : 2 * n]) * weights[:, :, None]
    rows *= weights[:, :, None, None]
    residual[:, :, n:] *= share if np.all(np.isfinite(residual)) else 1.0
    rows[:, :, n:] *= share
    ends = problem.batch("boundary")
    value, by_ends = ends.jacobian(np.zeros(1), u[:1], u[-1:], p, ends.columns(places))
    last = np.zeros((len(by_ends[0]), size + len(places)))
    last[:, :n] += by_ends[0][:, n : 2 * n]
    last[:, size - n : size] += by_ends[0][:, 3 * n : 4 * n]
    last[:, size:] = by_ends[0][:, 4 * n :]
    return (
        np.concatenate([residual.ravel(), share * value[0]]),
        np.vstack([rows.reshape(-1, size + len(places)), share * last]),
    )  # fmt: skip
