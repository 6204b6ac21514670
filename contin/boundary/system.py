"""A boundary value problem as the continuation sees it: its equations, meshes that suit, and what the statement knows."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from typing import Self

import numpy as np

from contin.arrays import Array
from contin.boundary.equations import BoundaryEquations
from contin.collocation.corners import Selections, breaks_of, selections
from contin.collocation.mesh import MeshControl, adapted_mesh, moved_to_breaks, near, with_breaks
from contin.collocation.switching import NOWHERE, Switching, joined, switching
from contin.core.protocol import Carrier
from contin.core.trial import Event
from contin.events.arc import SpecialPoint
from contin.events.index import Stability
from contin.levels import CORRECTED


class Collocation(BoundaryEquations):
    """A problem discretized on a mesh: what the continuation loop works on.

    A vector ``x`` of unknowns, shape (size,), holds the states at the mesh's nodes in order, (N d + 1, n) flattened,
    then the free parameters. A residual, shape (size - 1,) on a curve, holds collocation (scaled by h), boundary and
    integral conditions.

    Parameters
    ----------
    problem : BoundaryValueProblem
    mesh : ndarray, shape (N + 1,)
        Mesh points, increasing, from one end of the domain to the other.
    degree : int
        Polynomial degree d, 2 to 8 (AUTO's NCOL; N is its NTST).
    free : sequence of str
        The free parameters.
    parameters : mapping of str to float
        Values of all parameters; those of the free ones are ignored.

    Raises
    ------
    ProblemError
        An unknown parameter, a bad mesh or degree.

    Examples
    --------
    >>> from contin import BoundaryValueProblem
    >>> heat = BoundaryValueProblem(lambda t, u, p: (u.v, -p.q), lambda a, b, p: (a.u, b.u), ["u", "v"], {"q": 8.0})
    >>> system = Collocation(heat, [0.0, 0.5, 1.0], 4, ["q"], {})
    >>> system.size, system.nodes.tolist()[::4]  # two states at nine nodes, and q
    (19, [0.0, 0.5, 1.0])
    """

    # --- meshes that suit a solution -----------------------------------------------------------------------------

    def adapted(self, x: Array, control: MeshControl) -> tuple[Self, Carrier] | None:
        """Return the same problem on a better mesh for x, and the carrier; None where this mesh is good enough."""
        mesh = self._better_mesh(x, control)
        return None if mesh is None else self.on_mesh(mesh)

    def _better_mesh(self, x: Array, control: MeshControl) -> Array | None:
        if not control.every:
            return None
        return adapted_mesh(self.basis, self.mesh, self._scaled_states(x), control, self._all_breaks(x, closely=False))

    def on_breaks(self) -> Self:
        """Return the same problem on a mesh of as many intervals, with the breaks among its points."""
        return self.on_mesh(with_breaks(self.mesh, self.breaks))[0] if len(self.breaks) else self

    def on_switches(self, x: Array, closely: bool = False) -> tuple[Self, Carrier] | None:
        """Return the same on a mesh with the places of `switching` among its points; None where they are already.

        ``closely``: up to round-off, as what depends on the place itself needs. A solution depends on its square only.
        """
        breaks = self._all_breaks(x, closely)
        if not breaks.size or near(breaks, self.mesh, self.mesh[-1] - self.mesh[0]).all():
            return None
        return self.on_mesh(moved_to_breaks(self.mesh, breaks))

    def _all_breaks(self, x: Array, closely: bool) -> Array:
        """Return the places where the equations are not smooth; those on mesh points, as far as it matters, are these."""
        moving = self.switching(x)
        if not moving.places.size:
            return self.breaks
        nearest = self.mesh[np.abs(self.mesh - moving.places[:, None]).argmin(axis=1)]
        off = np.abs(nearest - moving.places) > CORRECTED * (self.mesh[-1] - self.mesh[0])
        places = np.where(off if closely else ~moving.settled, moving.places, nearest)
        return np.unique(np.concatenate([self.breaks, places]))

    @property
    def _of_the_mesh(self) -> Sequence[str]:
        """Names of the functions that the mesh matters for."""
        return ("field", "functionals") if self.integrated else ("field",)

    @functools.cached_property
    def breaks(self) -> Array:
        """Places where the equations have jumps or corners in t, whatever the states are: points of a good mesh."""
        given = self.problem.domain, self.parameters, self._free
        return np.unique(np.concatenate([breaks_of(self.problem.batch(name), *given) for name in self._of_the_mesh]))

    @functools.cached_property
    def _selections(self) -> list[tuple[str, Selections]]:
        """Conditions of these functions, by the name of the function."""
        found = [(name, selections(self.problem.batch(name), self._free)) for name in self._of_the_mesh]
        return [(name, each) for name, each in found if each is not None]

    @property
    def has_selections(self) -> bool:
        """Conditions on states or free parameters switch the equations."""
        return bool(self._selections)

    def switching(self, x: Array) -> Switching:
        """Return where conditions on states or free parameters switch along a solution, and the equations are not smooth."""
        if not self._selections:
            return NOWHERE
        if not any(np.array_equal(x, known) for known, _ in self._switchings):
            parts = [switching(self, each, functools.partial(self._sizes_of, name, x), x) for name, each in self._selections]
            self._switchings[:] = [(x.copy(), joined(parts))]
        return self._switchings[0][1]

    @functools.cached_property
    def _switchings(self) -> list[tuple[Array, Switching]]:
        """The solution that was looked at last, and where conditions switch along it: a point is asked for several times."""
        return []

    def _sizes_of(self, name: str, x: Array) -> Array:
        """Return the sizes of what the values of a function are integrated to."""
        with np.errstate(all="ignore"):
            values = np.abs(self.problem.batch(name).values(*self._inside_unscaled(x))).max(axis=0)
        largest: Array = (self.mesh[-1] - self.mesh[0]) * np.nan_to_num(values)
        largest[largest == 0] = 1.0
        if name == "field":
            largest[: self._n] = (self.largest(x)[: self._n] + 1) * self.scales.states
        return largest

    # --- what the statement knows of its branches ----------------------------------------------------------------

    @property
    def is_function_of_t(self) -> bool:
        """Yes."""
        return True

    @property
    def stored(self) -> dict[str, Array]:
        """Mesh, parameters and sizes."""
        return {"mesh": self.mesh, **self._own_arrays}

    def referring_to(self, x: Array, tangent: Array) -> Self:
        """Return the same with a solution as the reference, where the kind has one."""
        return self.with_reference(x)

    def events(self) -> list[Event]:
        """Return those of the statement."""
        return self.problem.events()

    def stability(self, point: SpecialPoint) -> Stability:
        """Return what the statement says."""
        return self.problem.stability(point)

    def degenerate(self, x: Array) -> str:
        """Return what the statement says."""
        return self.problem.degenerate(self, x)

    def undetermined(self, x: Array) -> str:
        """Return what the statement says."""
        return self.problem.undetermined(self, x)

    @property
    def index(self) -> Event | None:
        """That of the statement."""
        return self.problem.index
