"""The extended system of a curve of folds in two parameters.

With z all unknowns but the two parameters, the matrix

                                   z     g
                                [ F_z    b ]  [ v ]   [ 0 ]
                                [  c     0 ]  [ g ] = [ 1 ]

is regular along the curve, and g = 0 exactly where F_z is singular (Griewank & Reddien 1984). The extended system is F = 0, g
= 0. The gradient of g is -w.F_zy v, with w from the transposed matrix.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from typing import Any

import numpy as np

from contin.arrays import Array
from contin.core.protocol import Discretization
from contin.core.state import Reason, Stop
from contin.core.system import System
from contin.core.trial import Event, Trial
from contin.defining.extended import FITS, Borders, Extended, cosine
from contin.events.arc import Arc, SpecialPoint
from contin.events.interpolated import interpolated_zero
from contin.linalg.factors import Factors

#: A curve of cycles ends where they are smaller than this part of the reference, an orbit a few steps before; parameters differ
#: from those of the equilibrium by the square of the size. With 1e-3 Newton's method fails: the equations are nearly singular.
_SHRUNK = 0.1
#: w.F_mu is interpolated to the zero of w.F_lambda only where its first estimate there is below this part of its values at the
#: ends of the step; the location decides. Ten times smaller, long steps miss the zero.
_SMALL = 0.3
#: Parameters turn at a point where their part of the unit tangent is below this: interpolated tangents are better known.
_TURNS = 1e-4
#: Vectors are normal to each other where the cosine between them is smaller: their round-off.
NORMAL = 1e-10
#: Rounds of inverse iteration that make borders of random vectors; each is closer by the ratio of the smallest singular values.
_ROUNDS = 3


class FoldCurve(Extended):
    """F = 0 and F_z singular, in the free parameters of ``base``: the last one is the second parameter of the curve.

    Parameters
    ----------
    base : System
        With one free parameter more than a curve of solutions needs: the first is the one of the folds.
    """

    kind = "LP"

    def __init__(self, base: System, borders: Borders | None = None) -> None:
        super().__init__(base, borders)
        self.equations = base.equations + 1

    def on(self, base: System) -> FoldCurve:
        """Return the extended system of another underlying one, with borders of its own."""
        return FoldCurve(base)

    def null_vectors(self, x: Array) -> tuple[Array, Array, float]:
        """Return v (size,), w (equations of F,), and g; borders are made of v and w where there are none."""
        base = self.base
        places = [base.state_size, *range(base.equations + 1, base.size)]  # parameters of the folds, and of the curve
        held = np.zeros((len(places), base.size + 1))  # they stay where they are
        held[np.arange(len(places)), places] = 1.0
        random = np.random.default_rng(11)
        renew = self.borders is None
        b, c = (random.standard_normal(base.equations), random.standard_normal(base.size)) if renew else self.borders
        for _ in range(_ROUNDS if renew else 1):
            _, factors = base.linearize(x, np.vstack([held, np.append(c, 0.0)]), b[None, :])
            unit = np.zeros(base.size + 1)
            unit[-1] = 1.0
            solution = factors.solve(unit)
            w = factors.solve_transposed(unit)[: base.equations]
            v, g = solution[:-1], solution[-1]
            if renew:
                b, c = w / np.linalg.norm(w), base.weights * v / np.sqrt((base.weights * v) @ v)
                self.borders = (b, c)
        return v, w, g

    def borders_fit(self, x: Array) -> bool:
        """Return whether the null vectors have not turned away from the borders."""
        v, w, _ = self.null_vectors(x)
        b, c = self.borders
        root = np.sqrt(self.base.weights)
        return not min(cosine(c / root, v * root), cosine(b, w)) < FITS

    def residual(self, x: Array) -> Array:
        """Return F and g."""
        return np.append(self.base.residual(x), self.null_vectors(x)[2])

    def gradient(self, x: Array, v: Array, w: Array) -> Array:
        """Return dg/dx, shape (size,)."""
        return -self.base.bent(x, w, v)

    def linearize(
        self, x: Array, rows: Sequence[Array] | Array = (), columns: Sequence[Array] | Array = ()
    ) -> tuple[Array, Factors]:
        """Return F and g, and the factored bordered matrix; the row of g comes first among the border rows."""
        v, w, g = self.null_vectors(x)
        return self.with_own_rows(x, (self.gradient(x, v, w)[None], np.array([g])), rows, columns)

    @property
    def stationary(self) -> str:
        """The parameter of the folds."""
        return "" if self.base.on_curve else self.free[0]

    def events(self) -> list[Event]:
        """Return those of cusps (w.F_zz v v = 0), of folds that meet a branch point (w.F_lambda = 0), and of the kind."""
        cusp = Event("CP", "cusp", _bend, search=lambda arc, _: None if _may_be_cusp(arc) else [])
        return [cusp, _MEETS, *self.base.events_on_folds()]


def _bend(trial: Trial) -> float:
    """Return w.F_zz v v."""
    system: Any = trial.system
    v, w, _ = system.null_vectors(trial.x)
    return float(system.gradient(trial.x, v, w) @ v)


def _may_be_cusp(arc: Arc) -> bool:
    """Return whether the parameters reverse inside a step, as they do at a cusp, where they stand still.

    w.F_zz v v vanishes, too, where solutions have v as a symmetry, as the phase of a forced cycle whose forcing vanishes: there
    the parameters go on. At a pitchfork of the folds they reverse as well.
    """
    places = [arc.state.system.state_size, arc.state.system.size - 1]
    before, behind = (trial.tangent[places] for trial in (arc.before, arc.trial))
    return bool(before @ behind < 0) and _singular_point(arc) is None


def _by_first(trial: Trial) -> float:
    """Return w.F_lambda of the parameter of the folds."""
    system: Any = trial.system
    _, w, _ = system.null_vectors(trial.x)
    return float(system.base.transposed_product(trial.x, w)[system.base.state_size])


def _by_last(trial: Trial) -> float:
    """Return w.F_mu of the second parameter."""
    system: Any = trial.system
    _, w, _ = system.null_vectors(trial.x)
    return float(system.base.transposed_product(trial.x, w)[-1])


@functools.lru_cache(maxsize=1)
def _singular_point(arc: Arc) -> list[SpecialPoint] | None:
    """Return the point inside a step where both w.F_lambda and w.F_mu vanish, in a list; None where there is none.

    The extended system is singular there. At a pitchfork the curve turns back as its mirror image, so that the run ends; at a
    transcritical bifurcation it goes on.
    """
    a, b = (trial.value(_MEETS) for trial in (arc.before, arc.trial))
    if not a * b < 0:
        return None
    near = arc.low + (arc.step - arc.low) * a / (a - b)
    largest = max(abs(_by_last(trial)) for trial in (arc.before, arc.trial))
    if abs(_by_last(arc.guessed(near))) > _SMALL * largest:
        return None
    found = interpolated_zero(arc, (_by_first, _by_last), near)
    if found is None:
        return None
    system = arc.state.system
    stop = None
    if turns_back(found.trial, [system.state_size, system.size - 1]):
        stop = Stop(Reason.PITCHFORK, "the folds end on a pitchfork: beyond it the curve is its own mirror image")
    return [SpecialPoint(found.at, _MEETS.label, _MEETS.name, found.trial, stop, found, _MEETS)]


def turns_back(trial: Trial, parameters: Any) -> bool:
    """Return whether the parameters, at these places of x, stand still on a curve: it goes back as its mirror image."""
    return bool(np.abs(trial.tangent[parameters]).max() < _TURNS)


#: Where the fold meets a branch point: w.F_lambda = 0.
_MEETS = Event("BP", "fold meets a branch point", _by_first, search=lambda arc, _: _singular_point(arc))


def shrinking(base: Discretization) -> list[Event]:
    """Return the test function of the end of a curve where cycles shrink onto an equilibrium; beyond it is itself.

    At the equilibrium the equations of the curve are singular, so the run ends a little before. Other solutions do not shrink.
    """

    def amplitude(trial: Trial) -> float:
        system: Any = trial.system
        return float(system.base.amplitude(trial.x[: system.base.size])) - _SHRUNK

    name = "the end, near a Hopf point where the cycles have no size"
    return [Event("EP", name, amplitude, terminal=True)] if base.size_of_solutions is not None else []


def normal_product(v: Array, w: Array, noise: float = NORMAL) -> float:
    """Return the cosine between two vectors; 0 where it is round-off, as all along a curve of a conservative system."""
    cosine = float(v @ w) / float(np.linalg.norm(v) * np.linalg.norm(w))
    return cosine if abs(cosine) > noise else 0.0
