"""Branch points inside a step: how many there are, and where.

A branch point changes the sign of the determinant of [F_x; row]; more of them are seen in how those singular values change
that change most (`contin.events.crossings`). Both must agree: where the sign stays and one value passes, another did unseen.
"""

from __future__ import annotations

import contextlib
import functools
from collections.abc import Callable
from typing import Any

import numpy as np

from contin.arrays import Array, ComplexArray
from contin.core.labels import Label
from contin.core.protocol import inner
from contin.core.step import ROUNDS
from contin.core.trial import Trial, same_sign, sign_changed
from contin.errors import ConvergenceError
from contin.events.arc import Arc, SpecialPoint
from contin.events.branch_point import BranchPoint, locate_branch_point
from contin.events.crossings import changes_little, crossings, known_quotients, passed, quotients, quotients_along, shares
from contin.levels import APART
from contin.linalg.blocks import Factors
from contin.linalg.border import smallest_directions
from contin.linalg.orientation import canonical_basis

#: A branch point that the curve passes at a larger distance is none: the branches do not cross. A mesh that is not symmetric
#: parts them by the root of its error; ten times smaller, such branch points of coarse meshes would be lost.
_GAP = 1e-2
#: The same without a mesh, where branches that cross are parted by the root of round-off, 1e-8, or of the last digits of data:
#: ten digits part them by 1e-5. At 1e-2, cycles of maps of period 32 were "branch points" with residuals of 1e-2.
_GAP_WITHOUT_MESH = 1e-5
#: How often the bracket is halved: a branch point closer than 2^-12 of the step to another singular point is not located.
_HALVINGS = 12
#: And how often between two calls of the locator, which takes as long as many halvings where it fails: on a curve in two
#: parameters each of its updates differentiates the equations twice, numerically.
_BETWEEN = 3
#: The smallest singular value is smaller by far than the next one if their quotient is above this. In layers whose steps were
#: divided it is 77 and more; three times larger, the first of these are divided again.
_BY_FAR = 30.0
#: Singular values that vanish together are expected at places no further apart than this part of the step.
_TOGETHER = 0.1


class BranchPointSearch:
    """The branch points inside one step."""

    def __init__(self, arc: Arc) -> None:
        self.arc = arc
        self._shares: Array = np.empty(0)  # at which parts of the step branch points are expected, in order

    @property
    def _share(self) -> float:
        """Where branch points are expected, as a part of the step."""
        return float(np.mean(self._shares)) if len(self._shares) else 0.5

    @functools.cached_property
    def count(self) -> tuple[int, bool]:
        """How many branch points the step passes, and whether that is clear."""
        arc, before = self.arc, self.arc.before
        inside = functools.cache(lambda part: self._bordered(part, arc.state.row[None]))
        if before.factors is None and self._cannot_branch:
            return 0, True
        # Kept factors only tell that there is none: where one is expected must not depend on digits that a resumed run has not.
        if before.factors is not None and self._counted(inside) == (0, True):
            return 0, True
        before.refactor(arc.state.row)
        if counted := self._counted(inside):
            return counted
        values = quotients(before.factors, arc.trial.factors, arc.state.system.size)
        count, clear = crossings(values)
        if (count > 1 or not clear) and self._without_smallest is not None:
            return self._without_smallest
        self._shares = np.sort(shares(values[values.real < 0]))
        return count, clear and (not self._says_sign or (count % 2 == 1) == self._sign_changes)

    @functools.cached_property
    def _cannot_branch(self) -> bool:
        """Both ends of the step say that no other branch crosses this one."""
        return same_sign(self.arc.before.sign, self.arc.trial.sign) and self.arc.state.system.cannot_branch(self.arc)

    def _counted(self, inside: Callable[[float], Factors]) -> tuple[int, bool] | None:
        """Return the count, from factors at both ends of the step and ``inside`` it; None if it takes the whole matrices."""
        before, trial, size = self.arc.before, self.arc.trial, self.arc.state.system.size
        known = known_quotients(before.factors, trial.factors, size)
        if known is not None and (decided := self._decided(known, shares(known))):
            return decided
        if self._cannot_branch:
            return 0, True
        if known is not None:
            return None
        ends = {0.0: before.factors, 1.0: trial.factors}
        along = quotients_along(lambda part: ends.get(part) or inside(part))
        if along is not None and (decided := self._decided(*along)):
            return decided
        if same_sign(before.sign, trial.sign) and changes_little(before.factors, trial.factors, size):
            return 0, True
        return self._without_smallest

    def _decided(self, values: ComplexArray, places: Array) -> tuple[int, bool] | None:
        """Return the count, and keep where a branch point is expected, if quotients show one or none, as the sign does."""
        count, clear = crossings(values)
        if not clear or count > 1 or (self._says_sign and (count == 1) != self._sign_changes):
            return None
        self._shares = places[values.real < 0] if count else self._shares
        return count, True

    @functools.cached_property
    def _without_smallest(self) -> tuple[int, bool] | None:
        """The count where one singular value explains the sign of the determinant, and no other one comes near zero.

        None where that is not so; where more singular values change than are watched, nothing is clear.

        Where one is smaller than the others by far, as of a layer that is held in its place by exp(-1 / width) only, inverse
        matrices consist of its singular vectors, and their quotients have negative eigenvalues as soon as these turn. Bordered
        by the vectors at the end of the step, the matrices are regular::

            M = [ A    u ]       M [x; g] = [0; 1],    det A = g det M
                [ v^T  0 ]

        So the sign of A is that of g, as long as no singular value of M passes zero. Two zeros of g in the step would leave its
        sign as it was: it is looked at in the middle, too.
        """
        arc, system = self.arc, self.arc.state.system
        size, unit = system.size, np.zeros(system.size + 1)
        right, left, response = smallest_directions(arc.trial.factors, size, 2)
        inverses = np.sort(np.linalg.svd(response, compute_uv=False)) if np.isfinite(response).all() else np.ones(2)
        if inverses[1] < _BY_FAR * inverses[0]:
            return None
        rows, unit[-1] = np.zeros((2, size + 1)), 1.0
        rows[0, :-1], rows[1, :-1] = arc.state.row, right[0]
        column = left[:1, : system.equations]
        matrix = functools.cache(lambda part: self._bordered(part, rows, column))
        first, last = matrix(0.0), matrix(1.0)
        g = [factors.solve(unit)[-1] for factors in (first, last)]
        changes = sign_changed(g[0], g[1])
        if not np.isfinite(g).all() or (self._says_sign and changes != self._sign_changes):
            return None
        along = quotients_along(matrix)
        values = quotients(first, last, size + 1) if along is None else along[0]
        if not np.isfinite(values).all():
            return 0, False
        if crossings(values) != (0, True) or not same_sign(first.sign, last.sign):
            return None
        if changes:
            self._shares = shares(np.array([g[0] / g[1]]))
            return 1, True
        if np.sign(matrix(0.5).solve(unit)[-1]) == np.sign(g[0]):
            return 0, True
        with contextlib.suppress(ConvergenceError):  # the cubic may lie on the other side of a zero
            middle = system.linearize(arc.at(arc.step / 2).x, rows, column)[1]
            if np.sign(middle.solve(unit)[-1]) == np.sign(g[0]):
                return 0, True
        return None

    def _bordered(self, part: float, rows: Array, columns: Array | tuple[()] = ()) -> Factors:
        """Return the factors of F_x with these rows and columns at a part of the step, inside it on the cubic."""
        arc, ends = self.arc, {0.0: self.arc.before, 1.0: self.arc.trial}
        x = ends[part].x if part in ends else arc.guess(arc.low + part * (arc.step - arc.low))
        return arc.state.system.linearize(x, rows, columns)[1]

    @property
    def _says_sign(self) -> bool:
        """The signs of the determinants are known: all factorizations but those of some users' solvers say it."""
        return not (np.isnan(self.arc.before.sign) and np.isnan(self.arc.trial.sign))

    @property
    def _sign_changes(self) -> bool:
        """The determinant's sign is known, and changes inside the step."""
        return sign_changed(self.arc.before.sign, self.arc.trial.sign)

    @property
    def sign_changes(self) -> bool:
        """The determinant's sign changes inside the step; where it is not known, an odd number of singular values passes."""
        return self._sign_changes if self._says_sign else self.count[0] % 2 == 1

    def _changes_up_to(self, there: Trial) -> bool:
        """Return whether the determinant's sign changes between the start of the step and a place inside it."""
        before, row = self.arc.before, self.arc.state.row
        if self._says_sign:
            return there.sign != before.sign
        for trial in (before, there):
            trial.refactor(row)
        return crossings(quotients(before.factors, there.factors, self.arc.state.system.size))[0] % 2 == 1

    @functools.cached_property
    def simple(self) -> SpecialPoint:
        """The branch point inside the step, its bracket halved until the locator's answer lies inside it."""
        arc, low, high = self.arc, self.arc.low, self.arc.step
        middle = low + self._share * (high - low)
        for number in range(_HALVINGS + 1):
            if number % _BETWEEN == 0:
                with contextlib.suppress(ConvergenceError):
                    if (point := self._located(middle)) is not None:
                        return point
            try:
                changes = self._changes_up_to(arc.at(middle))
            except ConvergenceError:
                break
            low, high = (low, middle) if changes else (middle, high)
            middle = (low + high) / 2
        return SpecialPoint(high, Label.BRANCH_POINT, "", arc.trial, is_located=False)

    def _located(self, middle: float) -> SpecialPoint | None:
        """Return the branch point near a place if it lies inside the step; raises ConvergenceError where there is none."""
        arc, state = self.arc, self.arc.state
        found, system = self._near(middle)
        x = found.x if system is state.system else system.carrier(state.system)(found.x)
        at = inner(state.system, state.tangent, x - state.x)
        inside = arc.low - APART * arc.step <= at <= arc.step * (1 + APART)
        if not (inside and found.gap < (_GAP if state.system.intervals else _GAP_WITHOUT_MESH) and arc.passes_by(x, at)):
            return None
        direction = arc.direction(at) if system is state.system else state.system.carrier(system)(arc.direction(at))
        trial = Trial.without_tangent(system, found.x)
        return SpecialPoint(at, Label.BRANCH_POINT, "", trial, details=found.along(system, direction))

    def _near(self, at: float) -> tuple[BranchPoint, Any]:
        """Return the branch point near a place and its system: where conditions switch, on a mesh with frozen outcomes."""
        system, x = self.arc.state.system, self.arc.guess(at)
        if system.outcomes.size or system.crossed(x, corners=True)[0].outcomes.size:
            there = self.arc.at(at).settled
            system, x = there.system.crossed(there.x, corners=True)
        found = locate_branch_point(system, x, self.arc.newton)
        for _ in range(ROUNDS if system.outcomes.size else 0):
            if (moved := system.on_switches(found.x)) is None:
                break
            system, carry = moved
            found = found.again(system, carry, found.x, self.arc.newton)
        return found, system

    @functools.cached_property
    def multiple(self) -> SpecialPoint:
        """The multiple point inside the step, where several singular values vanish together; "possible" where they do not."""
        from contin.events.multiple_point import MultiplePoint, locate_multiple_point  # most branches have none

        arc, state, step = self.arc, self.arc.state, self.arc.step
        count, middle = self.count[0], arc.low + self._share * (step - arc.low)
        with contextlib.suppress(ConvergenceError):
            if np.ptp(self._shares) < _TOGETHER and not self._apart(middle):
                found = locate_multiple_point(state.system, arc.guess(middle), state.row, count, arc.newton)
                assert found.x is not None
                at = inner(state.system, state.tangent, found.x - state.x)
                if arc.low - APART * step <= at <= step * (1 + APART):
                    trial = Trial.without_tangent(state.system, found.x)
                    return SpecialPoint(at, Label.BRANCH_POINT, f"kernel of dimension {found.dimension}", trial, details=found)
        kernel = smallest_directions(arc.trial.factors, state.system.size, count + 1)[0][:count]
        kernel = canonical_basis(kernel, state.system.weights)
        return SpecialPoint(step, Label.BRANCH_POINT, "", arc.trial, details=MultiplePoint(count, kernel), is_located=False)

    def _apart(self, middle: float) -> bool:
        """Return whether the singular values pass zero at different places, as seen from halfway between the expected ones.

        Raises ConvergenceError where there is none.
        """
        arc, (count, _) = self.arc, self.count
        there = arc.at(middle)
        there.refactor(arc.state.row)
        values = quotients(arc.before.factors, there.factors, arc.state.system.size)
        places = shares(values[np.logical_or(*passed(values))])
        return 0 < len(places) < count or (len(places) == count and float(np.ptp(places)) > _TOGETHER)
