"""The defining system of a curve of folds in two parameters.

With z all unknowns but the two parameters, the matrix

                                   z     g
                                [ F_z    b ]  [ v ]   [ 0 ]
                                [  c     0 ]  [ g ] = [ 1 ]

is regular along the curve, and g = 0 exactly where F_z is singular (`contin.linalg.border`). The gradient of g is -w.F_zy v,
with w from the transposed matrix.
"""

from __future__ import annotations

import functools
from typing import cast

import numpy as np

from contin.arrays import Array
from contin.core.labels import Label
from contin.core.trial import Event, Trial
from contin.defining.system import Defining, Known
from contin.events.arc import Arc, SpecialPoint
from contin.events.interpolated import meeting
from contin.linalg.border import Bordered, null_vectors

#: w.F_mu is interpolated to the zero of w.F_lambda only where its first estimate there is below this part of its values at the
#: ends of the step; the location decides. Ten times smaller, long steps miss the zero.
_SMALL = 0.3


class FoldCurve(Defining):
    """F = 0 and F_z singular, in the free parameters of ``base``: the last one is the second parameter of the curve.

    Parameters
    ----------
    base : System
        With one free parameter more than a curve of solutions needs: the first is the one of the folds.
    """

    kind = Label.FOLD

    @property
    def _held(self) -> list[int]:
        """Places of both parameters, the second one last, and of those that fix the solution besides."""
        return [self.base.state_size, *range(self.base.equations + 1, self.base.size)]

    def computed(self, x: Array) -> tuple[Bordered, Array]:
        """Return the bordered matrix, with the parameters held where they are, and the residual of F."""
        base, places = self.base, self._held
        held = np.zeros((len(places), base.size + 1))
        held[np.arange(len(places)), places] = 1.0
        shape, residual = (base.equations, base.size), np.empty(0)

        def bordered(b: Array, c: Array) -> Bordered:
            nonlocal residual
            residual, factors = base.linearize(x, np.vstack([held, np.append(c, 0.0)]), b[None, :])
            return Bordered(factors, shape, held=len(places))

        found, self.borders = null_vectors(bordered, shape, self.borders, base.weights)
        return found, residual

    def known(self, x: Array) -> Known:
        """Return the bordered matrix."""
        found, residual = self.at(x)
        return Known(residual, found.factors, found.solutions)

    def null_vectors(self, x: Array) -> tuple[Array, Array]:
        """Return v (size,) and w (equations of F,)."""
        found: Bordered = self.at(x)[0]
        return found.right[0], found.left[0]

    def by_parameters(self, x: Array) -> tuple[float, float]:
        """Return the products of w with the derivatives of F by the parameter of the folds and by the second parameter.

        The rows of the parameters that are held, and c, take up what w F_x leaves there.
        """
        found: Bordered = self.at(x)[0]
        *held, rest = found.transposed[0, self.base.equations :]
        products = -np.array(held) - rest * self.borders[1][self._held]
        return float(products[0]), float(products[-1])

    def own_values(self, x: Array) -> Array:
        """Return g."""
        found: Bordered = self.at(x)[0]
        return found.g[0]

    def own_gradients(self, x: Array) -> Array:
        """Return dg/dx."""
        v, w = self.null_vectors(x)
        return -self.base.bent(x, w, v)[None]

    @property
    def stationary(self) -> str:
        """The parameter of the folds."""
        return "" if self.base.on_curve else self.free[0]

    def events(self) -> list[Event]:
        """Return those of cusps (w.F_zz v v = 0), of folds that meet a branch point (w.F_lambda = 0), and of the kind."""
        return [_CUSP, _MEETS, *super().events(), *self.base.events_on_folds()]


def _bend(trial: Trial) -> float:
    """Return w.F_zz v v."""
    curve = cast(FoldCurve, trial.system)
    return -float(curve.once(curve.own_gradients, trial.x)[0] @ curve.null_vectors(trial.x)[0])


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
    return cast(FoldCurve, trial.system).by_parameters(trial.x)[0]


def _by_last(trial: Trial) -> float:
    """Return w.F_mu of the second parameter."""
    return cast(FoldCurve, trial.system).by_parameters(trial.x)[1]


@functools.lru_cache(maxsize=1)
def _singular_point(arc: Arc) -> list[SpecialPoint] | None:
    """Return the point inside a step where both w.F_lambda and w.F_mu vanish, in a list; None where there is none.

    The defining system is singular there. At a pitchfork the curve turns back as its mirror image, so that the run ends; at a
    transcritical bifurcation it goes on.
    """
    largest = max(abs(_by_last(trial)) for trial in (arc.before, arc.trial))
    stop = "the folds end on a pitchfork: beyond it the curve is its own mirror image"
    return meeting(arc, _MEETS, (_by_first, _by_last), _SMALL * largest, stop)


#: w.F_zz v v = 0.
_CUSP: Event = Event(
    Label.CUSP, "cusp", _bend, search=lambda arc, _: None if _may_be_cusp(arc) else [], asks=lambda arc: arc.passes(_CUSP)
)
#: Where the fold meets a branch point: w.F_lambda = 0.
_MEETS: Event = Event(
    Label.BRANCH_POINT, "fold meets a branch point", _by_first, search=lambda arc, _: _singular_point(arc),
    asks=lambda arc: arc.passes(_MEETS),
)  # fmt: skip
