"""Multipliers for a guess of the states of a variational problem: least squares of all its equations, the states held."""

from __future__ import annotations

from typing import Any

import numpy as np

from contin.arrays import Array
from contin.boundary.system import Collocation
from contin.errors import ProblemError
from contin.levels import MOST_HALVINGS, MOST_UPDATES, ROUGH, ROUND_OFF
from contin.problems.statement import multipliers_of

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
    residual, gradient, normal = _equations(system, states, lam, multipliers, share)
    if not np.isfinite(residual).all():
        raise ProblemError("guess: the equations have no finite value there (look for what divides by zero, or at `starts`)")
    for _ in range(MOST_UPDATES):
        if not np.any(normal):
            break
        normal[np.diag_indices_from(normal)] += ROUND_OFF * np.trace(normal)
        step = _solved(normal, -gradient, lam.size, (system.degree + 1) * lam.shape[1])
        part = 1.0
        for _ in range(MOST_HALVINGS):
            new_lam = lam + part * step[: lam.size].reshape(lam.shape)
            new_multipliers = multipliers + part * step[lam.size :]
            new = _equations(system, states, new_lam, new_multipliers, share)
            if np.isfinite(new[2]).all() and np.linalg.norm(new[0]) <= np.linalg.norm(residual):
                break
            part /= 2
        else:
            break
        gained = np.linalg.norm(residual) - np.linalg.norm(new[0])
        lam, multipliers, (residual, gradient, normal) = new_lam, new_multipliers, new
        if gained <= ROUGH * np.linalg.norm(residual) or np.linalg.norm(residual) < ROUGH:
            break
    return lam, multipliers


def _solved(normal: Array, right: Array, count: int, width: int) -> Array:
    """Solve with a matrix that couples its first ``count`` unknowns, nodes in order, over less than ``width`` places only."""
    from scipy.linalg import solve_banded  # type: ignore[import-untyped]  # .1 s; only this needs it

    width = min(width, count)
    bands = np.zeros((2 * width - 1, count))
    for offset in range(1 - width, width):
        diagonal = np.diagonal(normal[:count, :count], offset)
        bands[width - 1 - offset, max(offset, 0) : max(offset, 0) + diagonal.size] = diagonal
    border = normal[:count, count:]
    inner = solve_banded((width - 1, width - 1), bands, np.column_stack([right[:count], border]))
    last = np.linalg.solve(normal[count:, count:] - border.T @ inner[:, 1:], right[count:] - border.T @ inner[:, 0])
    return np.append(inner[:, 0] - inner[:, 1:] @ last, last)


def _equations(system: Collocation, states: Array, lam: Array, multipliers: Array, share: float) -> tuple[Array, Array, Array]:
    """Return the residual r of all equations, J.T r and J.T J, with J the derivatives by lam (K, n), flattened, and
    multipliers.

    All but the rates of the states are multiplied by ``share``. J.T J is added up interval by interval, without J itself, which
    has few entries that are not zero.
    """
    problem: Any = system.problem
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
    residual = (rates - field[:, :, : 2 * n]) * weights[:, :, None]
    residual[:, :, n:] *= share if np.isfinite(residual).all() else 1.0
    rows = -np.einsum("eirk,ij->eirjk", by[:, :, : 2 * n, n : 2 * n], basis.value)
    rows[:, :, n:] += np.einsum("rk,ij,e->eirjk", np.eye(n), basis.slope, 1 / h)
    rows = np.concatenate([rows.reshape(count, d, 2 * n, -1), -by[:, :, : 2 * n, 2 * n :]], axis=-1)
    rows *= weights[:, :, None, None]
    rows[:, :, n:] *= share
    ends = problem.batch("boundary")
    value, by_ends = ends.jacobian(np.zeros(1), u[:1], u[-1:], p, ends.columns(places))
    last = share * np.hstack([by_ends[0][:, n : 2 * n], by_ends[0][:, 3 * n :]])
    of_multipliers = lam.size + np.arange(len(places))
    parts = [(residual[e].ravel(), rows[e].reshape(2 * n * d, -1), n * d * e + np.arange(n * (d + 1))) for e in range(count)]
    parts.append((share * value[0], last, np.r_[0:n, lam.size - n : lam.size]))
    gradient, normal = np.zeros(lam.size + len(places)), np.zeros((lam.size + len(places),) * 2)
    with np.errstate(invalid="ignore"):  # the caller looks for values that are not finite
        for part, block, columns in parts:
            at = np.r_[columns, of_multipliers]
            gradient[at] += block.T @ part
            normal[np.ix_(at, at)] += block.T @ block
    return np.concatenate([part for part, _, _ in parts]), gradient, normal
