"""An algebraic problem as the continuation sees it: its equations, and what it knows of its branches."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from contin.arrays import Array
from contin.core.labels import Label
from contin.core.trial import Event
from contin.defining.hopf_curve import HopfCurve
from contin.equilibria.dependence import dependence
from contin.equilibria.equations import AlgebraicEquations
from contin.equilibria.folds import HOMOCLINIC, events_on_folds
from contin.equilibria.lyapunov import critical_pair, form_of, has_pair
from contin.events.arc import SpecialPoint
from contin.events.coefficient import Coefficient
from contin.events.hopf import hopf
from contin.events.labelled import frequency_of
from contin.events.normal_forms import DenseForm, at_special_point, fold
from contin.functions.batch import Batch


class Algebraic(AlgebraicEquations):
    """An algebraic problem with chosen free parameters, as the continuation sees it.

    Unknowns ``x`` are the states, then the free parameters. The interface is that of
    `contin.lowlevel.Collocation`; there is no mesh to adapt.

    Raises
    ------
    ProblemError
        An unknown parameter.

    Examples
    --------
    >>> from contin import AlgebraicProblem
    >>> system = Algebraic(AlgebraicProblem(lambda u, p: (p.a - u.x**2,), ["x"], {"a": 1.0}), ["a"])
    >>> system.size, system.residual(np.array([2.0, 1.0])).tolist()  # x = 2, a = 1
    (2, [-3.0])
    """

    #: Kinds of curves in two parameters that begin at, or pass, points of codimension two.
    leaving = {
        Label.BOGDANOV_TAKENS: (Label.FOLD, Label.HOPF, HOMOCLINIC),
        Label.GENERALIZED_HOPF: (Label.FOLD,),
        Label.ZERO_HOPF: (Label.FOLD, Label.HOPF, Label.TORUS),
        Label.DOUBLE_HOPF: (Label.HOPF, Label.TORUS),
    }

    def events(self) -> list[Event]:
        """Return the test function of Hopf points, where the states move in time."""
        return [hopf()] if self.problem.dynamics and self.state_size > 1 else []

    @property
    def small_equations(self) -> Batch | None:
        """The residual; None of kinds that are made of this one, whose equations may be others, and with a given Jacobian."""
        known: Batch = self._residual
        return known if type(self) is Algebraic and self.problem.jacobian is None else None

    @property
    def starts_cycles(self) -> bool:
        """Where the states move in time."""
        return bool(self.problem.dynamics)

    @property
    def stored(self) -> dict[str, Array]:
        """Parameters and sizes."""
        return self._own_arrays

    def unstable(self, x: Array) -> int | None:
        """Return the number of unstable eigenvalues; None of large problems, and where nothing moves in time."""
        return None if self.is_sparse or not self.problem.dynamics else int(np.count_nonzero(self.eigenvalues(x).real > 0))

    def undetermined(self, x: Array) -> str:
        """Return which equations are dependent."""
        return dependence(self, x)

    def check_solution(self, x: Array) -> None:
        """Check that totals which were found to be conserved are so at a solution, too."""
        self.problem.check_totals(self.states(x)[0], self.all_parameters(x))

    @property
    def curves(self) -> Mapping[str, type]:
        """That of Hopf points."""
        return {HopfCurve.kind: HopfCurve}

    def defining(self, point: Any, x: Array) -> tuple[HopfCurve, Array] | None:
        """Return that of Hopf points."""
        if point.label != HopfCurve.kind:
            return None
        pair = critical_pair(self.jacobian(x), frequency_of(point))
        return (HopfCurve(self.as_field(), size=pair.frequency**2), np.append(x, 1.0)) if pair.is_critical else None

    def events_on_folds(self) -> list[Event]:
        """Return those of a second eigenvalue zero, or a pair on the imaginary axis."""
        return events_on_folds() if self.problem.dynamics else []

    def form(self, x: Array) -> DenseForm:
        """Return that of an equilibrium."""
        return form_of(self, x)

    def coefficient(self, point: SpecialPoint) -> Coefficient | None:
        """Return the first Lyapunov coefficient at a Hopf point; of folds, which take .3 ms, nothing."""
        if point.test is None or point.test.normal_form is fold:
            return None
        frequency = frequency_of(point)
        is_of_the_field = frequency is None or has_pair(self.jacobian(point.trial.x), frequency)
        return at_special_point(self, point) if is_of_the_field else None
