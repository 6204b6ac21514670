"""Special points on curves of homoclinic orbits (Champneys, Kuznetsov & Sandstede 1996; labels as in MatCont).

The eigenvalues of the saddle are those of the manifold that the orbit enters, m1, m2, ... with the largest real part first,
and those of the manifold that it leaves, l1, l2, ... with the smallest first: the leading ones. Test functions:

    NSS, NSF, NFF   Re m1 + Re l1                            neutral saddle, saddle-focus, bifocus
    DRS, DRU        (m1 - m2)^2, (l1 - l2)^2                 a real leading eigenvalue becomes a complex pair
    NDS, NDU        2 Re m1 + Re l1, Re m1 + 2 Re l1         neutrally divergent saddle-focus (m1, l1 complex)
    NCH, SH         -Re m1, Re l1                            the saddle comes to be a saddle-node, or has a Hopf bifurcation
    OFS, OFU        p.(u(1) - e), q.(u(0) - e)               orbit flips: p, q are left eigenvectors of m1, l1
    IFS, IFU        v.a(0), w.a(1)                           inclination flips: v, w are right eigenvectors of m1, l1

On curves of homoclinic orbits to saddle-nodes, whose slow motion is c' = a c^2, with c = p.(u - e):

    NCH             a c / |a| at u(0), where it is positive, and at u(1), where it is negative: the orbit leaves, or comes back,
                    along another direction than the eigenvector of the eigenvalue zero, and a curve to saddles begins
    CP, BT, ZH      a, a second eigenvalue, or a pair, is zero, or imaginary

In IFS and IFU a solves the adjoint equation; its values at the ends are the multipliers of the projection conditions in the
left null vector of F_z, z all unknowns but the user's parameters. Eigenvectors and null vectors have the signs that they have
at the reference of the discretization.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from contin.arrays import Array, ComplexArray
from contin.core.labels import Label
from contin.core.trial import Event, Trial
from contin.events.arc import SpecialPoint
from contin.events.error import Solution
from contin.levels import CORRECTED, DOUBLED, LOCATED, ROUGH

if TYPE_CHECKING:
    from contin.connections.equations import ConnectionCollocation

#: With a larger gap the orbit is not close to a homoclinic one.
_FAR = 0.2
#: The labels of the test functions whose points `named` calls otherwise.
_LOCATED_AS = {"NSF": "NSS", "NFF": "NSS", "SH": "NCH"}


def homoclinic_points(system: ConnectionCollocation) -> list[Event]:
    """Return the test functions of a curve of homoclinic orbits, those for which there are enough eigenvalues."""
    n, unstable = len(system.problem.state_names), system.problem.unstable
    counts = n - unstable, unstable
    far = "the ends of the orbit are far from the saddle: it needs a longer time"
    near = Event("EP", far, lambda trial: _FAR - trial["gap"], terminal=True)
    if system.problem.saddle_node:
        others = [_second_zero(side) for side in (0, 1) if (unstable if side else n - 1 - unstable)]
        return [near, _NON_CENTRAL[0], _NON_CENTRAL[1], _CUSP, *others]
    found = [
        near,
        Event("NSS", "neutral saddle", lambda trial: _total(_leading(trial, 0)[0].real, _leading(trial, 1)[0].real)),
        *(_ends(side) for side in (0, 1)),
    ]
    for side in (0, 1):
        if counts[side] > 1:
            found += [_double(side), _divergent(side), _orbit_flip(side), _inclination_flip(side)]
    return found


def own_test_of(label: str, system: ConnectionCollocation, x: Array) -> Event | None:
    """Return the test function that labels a special point x of a curve of homoclinic orbits so; None where none does.

    Labels of `named` are those of the function that was located. Where two have the same label it is the one that vanishes.
    """
    trial, located = Trial.without_tangent(system, x), _LOCATED_AS.get(label, label)
    if label in (Label.INCLINATION_FLIP_STABLE, Label.INCLINATION_FLIP_UNSTABLE):
        return _inclination_flip("SU".index(label[-1]), known=True)
    found = [test for test in homoclinic_points(system) if test.label == located != Label.END]
    return min(found, key=lambda test: abs(test.function(trial)), default=None)


def _slow_component(trial: Trial, end: int) -> float:
    """Return c at an end of an orbit to a saddle-node, with the sign of a: positive where the slow motion leaves."""
    p, bend = trial.system.slow_motion(trial.x)
    return float(np.sign(bend) * (p @ trial.system.apart(trial.x)[end]))


#: The test functions of the first and of the last end of an orbit to a saddle-node, positive where it is a central one.
_NON_CENTRAL = tuple(
    Event("NCH", "non-central homoclinic orbit to a saddle-node", function, terminal=True)
    for function in (lambda trial: _slow_component(trial, 0), lambda trial: -_slow_component(trial, 1))
)


def _bend(trial: Trial) -> float:
    """Return a, positive at the reference of the discretization: its sign is that of the eigenvector."""
    system = trial.system
    return float(system.slow_motion(trial.x)[1] * np.sign(system.slow_motion(system.reference)[1]))


#: The test function of a cusp.
_CUSP = Event("CP", "cusp: the saddle-node meets a third equilibrium", _bend, terminal=True)


def _second_zero(side: int) -> Event:
    """Return the test function of a second eigenvalue zero, a stable (0) or unstable one: the sum of both that meet."""

    def total(trial: Trial) -> float:
        system = trial.system
        rates = system.saddle(trial.x).values.real
        first = system.problem.unstable - side
        return float(rates[first] + rates[first + 1]) * (1 if side else -1)

    return Event("BT", "Bogdanov-Takens: the saddle-node has two eigenvalues zero", total, terminal=True)


def crossing(point: Solution) -> tuple[bool, int]:
    """Return, for a point labelled NCH, whether the orbit is then one to a saddle, and the end or side that it is about.

    Of an orbit to a saddle-node, the end that is non-central; of one to a saddle, the side of the eigenvalue that is zero.
    """
    trial = Trial.without_tangent(point.system, point.x)
    if trial.system.problem.saddle_node:
        return False, int(np.argmin([abs(test.function(trial)) for test in _NON_CENTRAL]))
    return True, int(np.argmin([abs(_leading(trial, side)[0].real) for side in (0, 1)]))


def ending(system: ConnectionCollocation, side: int) -> Event:
    """Return the test function NCH of an end (of orbits to a saddle-node) or side; it is positive on the curve."""
    return _NON_CENTRAL[side] if system.problem.saddle_node else _ends(side)


def named(point: SpecialPoint, solution: Trial | None = None) -> SpecialPoint:
    """Return a neutral saddle, or the end of a curve, with label and name by which leading eigenvalues are complex.

    ``solution`` is the orbit, where the point is one of a curve in two parameters.
    """
    names = _own_names(point if solution is None else dataclasses.replace(point, trial=solution))
    return point if names is None else dataclasses.replace(point, label=names[0], name=names[1])


def _own_names(point: SpecialPoint) -> tuple[str, str] | None:
    """Return label and name of a neutral saddle, or of the end of a curve, whose leading eigenvalue is complex; else None."""
    if point.label not in (Label.NEUTRAL_SADDLE, Label.NON_CENTRAL, Label.BOGDANOV_TAKENS) or not point.is_located:
        return None
    if point.trial.system.problem.saddle_node:
        values = point.trial.system.saddle(point.trial.x).values
        critical = np.count_nonzero(np.abs(values.real) < ROUGH * np.abs(values).max())
        has_pair = point.label == Label.BOGDANOV_TAKENS and critical > 2
        return (Label.ZERO_HOPF, "zero-Hopf: the saddle-node has a pair, too") if has_pair else None
    kinds = [_is_complex(_leading(point.trial, side)[0]) for side in (0, 1)]
    if point.label == Label.NEUTRAL_SADDLE and any(kinds):
        return ("NFF", "neutral bifocus") if all(kinds) else ("NSF", "neutral saddle-focus")
    nearest = int(np.argmin([abs(_leading(point.trial, side)[0].real) for side in (0, 1)]))
    return ("SH", "Shilnikov-Hopf") if point.label == Label.NON_CENTRAL and kinds[nearest] else None


def _leading(trial: Trial, side: int) -> ComplexArray:
    """Return the eigenvalues of one side, 0 stable or 1 unstable, the leading one first."""
    system = trial.system
    values, count = system.saddle(trial.x).values, system.problem.unstable
    return values[:count][::-1] if side else values[count:]


def _leading_vectors(trial: Trial, side: int) -> tuple[Array, Array]:
    """Return the eigenvectors, right and left, of a real leading eigenvalue, with the signs of the reference."""
    system = trial.system
    here = system.saddle(trial.x).pair(system.problem.unstable - side)
    signs = [np.sign((vector.conj() @ known).real) for vector, known in zip(here, system.leading_pairs[side])]
    right, left = (sign * vector.real / np.linalg.norm(vector.real) for sign, vector in zip(signs, here))
    return right, left


def _is_complex(value: complex) -> bool:
    return abs(value.imag) > DOUBLED * abs(value)


def _total(first: float, second: float) -> float:
    """Return the sum of two real parts; 0 where it is round-off."""
    total = float(first + second)
    return total if abs(total) > LOCATED * (abs(first) + abs(second)) else 0.0


def _ends(side: int) -> Event:
    """Return the test function that ends a curve: a leading eigenvalue of one side reaches the imaginary axis."""
    sign = 1 if side else -1
    return Event(
        "NCH", "non-central homoclinic orbit to a saddle-node",
        lambda trial: sign * _leading(trial, side)[0].real, terminal=True,
    )  # fmt: skip


def _double(side: int) -> Event:
    return Event(
        "DRU" if side else "DRS", f"double real leading {('stable', 'unstable')[side]} eigenvalue",
        lambda trial: float((np.subtract(*_leading(trial, side)[:2]) ** 2).real),
    )  # fmt: skip


def _divergent(side: int) -> Event:
    return Event(
        "NDU" if side else "NDS", "neutrally divergent saddle-focus",
        lambda trial: _total(2 * _leading(trial, side)[0].real, _leading(trial, 1 - side)[0].real),
        confirm=lambda trial: _is_complex(_leading(trial, side)[0]),
    )  # fmt: skip


def _flip(label: str, name: str, side: int, function: Callable[[Trial], float]) -> Event:
    """Return the test function of a flip: NaN where the leading eigenvalue is complex."""

    return Event(label, name, lambda trial: np.nan if _is_complex(_leading(trial, side)[0]) else function(trial))


def _component(unit: Array, vector: Array) -> float:
    """Return the component of a vector along one of unit length; 0 where it is round-off."""
    component = float(unit @ vector)
    return component if abs(component) > CORRECTED * float(np.linalg.norm(vector)) else 0.0


def _orbit_flip(side: int) -> Event:
    def component(trial: Trial) -> float:
        system, x = trial.system, trial.x
        gap = system.apart(x)[1 - side]
        if not np.linalg.norm(gap) > LOCATED * np.max(np.abs(x[: system.state_size])):  # it has no direction
            return float("nan")
        return _component(_leading_vectors(trial, side)[1], gap)

    return _flip("OFU" if side else "OFS", "orbit flip", side, component)


def _inclination_flip(side: int, known: bool = False) -> Event:
    """Return the test function of an inclination flip; of one that is ``known`` it is followed below round-off, too.

    Right at a flip a(0), or a(1), is as small as its second exponential.
    """

    def component(trial: Trial) -> float:
        system, x = trial.system, trial.x
        if not known:
            there = system.left_null_vector(system.reference, trial.factors)
            if not np.linalg.norm(system.adjoint_at_ends(x, there)[side]) > CORRECTED:
                return float("nan")
        adjoint = system.adjoint_at_ends(x, system.left_null_vector(x, trial.factors))[side]
        unit = _leading_vectors(trial, side)[0]
        return float(unit @ adjoint) if known else _component(unit, adjoint)

    return _flip("IFU" if side else "IFS", "inclination flip", side, component)
