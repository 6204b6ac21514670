"""Where Newton's method does not converge from a guess: solutions at which F_x is singular, and the reason otherwise.

In this order:

1. The solution is a fold or a branch point, or so near one that round-off cannot tell. Updates shrink by a factor; the sums of
   these geometric series get there, until F is round-off.
2. Damped steps from the guess, or from beside it where F_x is singular or not finite at it, reach a solution.
3. F or F_x is not finite, at the guess or where the steps end: the operation, its line and the values are named.
4. Newton's method goes round between outcomes of conditions: a branch leads through the corners to the solution.
5. F_x is singular everywhere: conditions follow from others, or jumps decide.
"""

from __future__ import annotations

import contextlib
import dataclasses
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from contin import draws
from contin import errors as checks
from contin.arrays import Array, Indices, Named
from contin.boundary.statement import BoundaryValueProblem, SegmentedProblem
from contin.connections.statement import ConnectionProblem
from contin.continuation.run import Continuation
from contin.core.labels import Label
from contin.core.newton import UNITS, Corrected, Newton, approached, correct
from contin.core.settings import Settings
from contin.core.system import System, usual
from contin.cycles.statement import CycleProblem
from contin.equilibria.dependence import reduced
from contin.equilibria.equations import Algebraic
from contin.equilibria.statement import AlgebraicProblem
from contin.errors import ConvergenceError, ProblemError
from contin.functions.origin import Place, jump, not_finite
from contin.functions.signature import Signature, named_values
from contin.levels import APART, CERTAIN, CORRECTED, DEPENDENT, LAST_PLACES, LOCATED, MOST_STEPS, MOST_UPDATES, ROUGH
from contin.linalg.border import Bordered, cosine, random_rows
from contin.problems.rewriting import returning

#: Null vectors are looked for among so many, at most: a free beam in space has six.
_MOST = 8
#: Updates shrink by a factor between these where F_x is singular at the solution: by 1/2 at a fold, by 2/3 at a pitchfork.
_FACTORS = (0.3, 0.9)
#: Points on the way from a guess through corners.
_MOST_OF_WAY = 300
#: Largest difference of two such factors, one after the other: with more, their series is not a geometric one yet.
_STEADY = 0.05


def recovered(system: System, x: Array, newton: Newton, singular: bool) -> Corrected | None:
    """Return a solution that Newton's method does not find from x itself, ``singular`` ones too if wanted; or None."""
    if singular and (found := _singular_solution(system, x)):
        return found
    starts = [x]
    with np.errstate(all="ignore"):
        if singular and not np.isfinite(_update(system, x)).all():
            starts += [place for place in _beside(system, x) if np.isfinite(_update(system, place)).all()][:1]
    for start in starts:
        for place in approached(system, start):
            with contextlib.suppress(ConvergenceError):
                done = correct(system, place, newton=newton, sizes=system.magnitudes)
                system.check_solution(done.x)
                return looked_at(system, done) if singular else done
    if starts[-1] is not x and (found := _singular_solution(system, starts[-1])):
        return found
    return _through_corners(system, x, newton) if isinstance(system, Algebraic) and system.conditions else None


def _through_corners(system: Algebraic, x: Array, newton: Newton) -> Corrected | None:
    """Return the solution to which F(x) = (1 - t) F(x0) leads from the guess x0, through corners on the way; or None.

    Newton's method, with the outcomes of each iterate, may go round and round between them (Katzenelson 1965). Raises
    ProblemError where the equations jump on the way.
    """
    problem, names, t = system.problem, system.problem.state_names, "part_of_the_way_"
    if not np.isfinite(system.residual(x)).all():
        return None
    given = returning(problem.residual, Signature(names, tuple(problem.parameters), times=False))
    known = dict(zip(problem.parameters, map(float, system.all_parameters(x))))
    u, p = named_values(names)(*map(float, system.states(x)[0])), named_values(tuple(known))(*known.values())
    missed = [float(value) for value in given(u, p)]

    def residual(u: Named, p: Named) -> list[Any]:
        return [value - (1 - getattr(p, t)) * gap for value, gap in zip(given(u, p), missed)]

    way = AlgebraicProblem(residual, problem.states, {**known, t: 0.0}, dynamics=False, angles=problem.angles)
    guess, ends = np.array([*system.states(x)[0], *(known[name] for name in system.free), 0.0]), list[str]()
    for direction in (1, -1):
        settings = Settings(
            limits={t: (-np.inf, 1.0)}, direction=direction, newton=newton, branch_points=False, errors=False,
            max_points=_MOST_OF_WAY, primary=t,
        )  # fmt: skip
        with contextlib.suppress(ConvergenceError):
            last = list(Continuation(Algebraic(way, [*system.free, t]), guess, settings))[-1]
            if last[t] == 1:
                end = np.append(last.system.states(last.x)[0] / system.scales.states, [last[name] for name in system.free])
                end[system.state_size :] /= system.free_scales
                return looked_at(system, correct(system, end, newton=newton, sizes=system.magnitudes))
            ends += [last.name] if last.label == Label.CORNER else []
    if ends:
        raise ProblemError(f"guess: no solution lies on the way from it: {ends[0]}")
    return None


def looked_at(system: System, done: Corrected) -> Corrected:
    """Return a solution with the error that round-off leaves where F_x is singular beside it, or where terms of F cancel."""
    error = _singular_error(system, done.x) if not _response(system, done) < 1 / APART else None
    if error is None:
        return done if system.intervals else dataclasses.replace(done, error=max(done.error, _cancelled(system, done)))
    return dataclasses.replace(done, error=max(error, done.error), singular=True)


def _cancelled(system: System, done: Corrected) -> float:
    """Return up to which distance from a solution, relative to 1 + |x|, updates lead elsewhere: terms of F cancel there."""
    x, error = done.x, 0.0
    direction = np.abs(x) * np.sign(random_rows(1, x.size)[0])
    with np.errstate(all="ignore"):
        for s in LOCATED * 4.0 ** np.arange(10):
            steps = s * direction, -s * direction
            missed = (np.abs(done.factors.solve(system.residual(x + step)) - step).max() for step in steps)
            if not all(size > s * np.abs(x).max() / 2 for size in missed):
                break
            error = s * float(np.max(np.abs(x) / (1 + np.abs(x))))
    return error


def not_finite_near(system: System, x: Array) -> str:
    """Return which function has no finite value or derivative at a guess x, or where steps from there lead; "" if none."""
    where, following = "guess", x
    with np.errstate(all="ignore"):
        for _ in range(MOST_UPDATES):
            if found := _not_finite(system, following):
                return f"{where}: {found}: give a guess away from there; if the solution lies there, {_advice(found)}"
            where, following = "steps from the guess lead out of the domain", following - _update(system, following)
            if not np.isfinite(following).all():
                break
    return ""


def _advice(found: str) -> str:
    """Return what to write where a function has no finite value or derivative, or raises an error."""
    if " raises " in found:
        return "let the function have values there, too"
    other = "write it in another way, as abs(z) for sqrt(z**2)"
    return other if "derivative" in found else "write its limit, as np.where(abs(z) > 1e-3, quotient, series)"


def doubtful(system: System, done: Corrected) -> str:
    """Return why a solution is none, as a sentence: conditions follow from others, or the equations are not finite; or ""."""
    if not np.isfinite(system.residual(done.x)).all() and (found := _not_finite(system, done.x)):
        return f"solution: {found}: {_advice(found)}"
    return dependence(system, done.x) if not _response(system, done) < 1 / DEPENDENT else ""


def _response(system: System, done: Corrected) -> float:
    """Return about the size of the inverse of F_x or, where it is not small, of that times F_x a little aside."""
    row = random_rows(1, system.size)[0]
    with np.errstate(all="ignore"):
        size = float(np.abs(done.factors.solve(row)).max())
        aside = done.x + ROUGH * (1 + np.abs(done.x)) * np.sign(row)
        return size if size < 1 / ROUGH else size * float(np.abs(system.transposed_product(aside, row)).max())


def label_of(system: System, x: Array) -> str:
    """Return the label of a solution at which F_x is singular: LP if F bends along the null vector and a parameter moves it.

    BP otherwise: at a transcritical point no parameter moves it, at a pitchfork the even part of F is the smaller one.
    """
    rank = _rank(system, x)
    if rank is None:
        return ""
    w, v = rank.left[-1], ROUGH * rank.right[-1] / np.max(np.abs(rank.right[-1]) / (1 + np.abs(x)))
    ahead, back = (float(w @ system.residual(x + sign * v)) for sign in (1, -1))
    columns = system.parameter_columns(x, tuple(system.problem.parameters))
    moves = np.any(np.abs(w @ columns) > LOCATED * (np.abs(w) @ np.abs(columns)))
    return Label.FOLD if moves and ahead * back > 0 and len(rank.null) < 2 else Label.BRANCH_POINT


# --- solutions at which F_x is singular ----------------------------------------------------------------------------------


def _singular_solution(system: System, x: Array) -> Corrected | None:
    """Return the solution near x at which F_x is singular, with the error that round-off leaves; None where there is none."""
    with np.errstate(all="ignore"):
        z = _summed(system, x)
        if not np.isfinite(z).all() or not _is_solution(system, z, x):
            return None
        error = _singular_error(system, z)
        return None if error is None else Corrected(z, system.linearize(z)[1], 0, error, singular=True)


def _summed(system: System, x: Array) -> Array:
    """Return where Newton's method gets from x; where updates shrink by a steady factor, by the sum of all that follow."""
    before: Array | None = None
    factor = 0.0
    for _ in range(MOST_STEPS):
        update = _update(system, x)
        if not np.isfinite(update).all():
            break
        size = np.abs(update).max(initial=0.0)
        if before is not None:
            last, factor = factor, float(update @ before / (before @ before))
            if size >= np.abs(before).max():
                break
            if _FACTORS[0] < factor < _FACTORS[1] and abs(factor - last) < _STEADY:
                # a little less: round-off would choose between two roots that are close to each other
                update, factor, size = (1 - APART) * update / (1 - factor), 0.0, 0.0
        x, before = x - update, update if size else None
        if np.all(np.abs(update) <= np.finfo(float).eps * np.abs(x)):
            break
    return x


def _update(system: System, x: Array) -> Array:
    residual, factors = system.linearize(x)
    return factors.solve(residual)


def _noise(system: System, x: Array) -> Array:
    """Return by how much each residual changes where x changes by one unit in the last place."""
    residual = system.residual(x)
    return draws.spread("failure of solve", lambda random: system.residual(draws.rounded(random, x)) - residual)


def _is_solution(system: System, z: Array, guess: Array) -> bool:
    """Return whether the residual at z is round-off: of z, or of what it was at the guess."""
    level = UNITS * float(_noise(system, z).max())
    if system.intervals:  # what acts along t is rounded, too
        level += LAST_PLACES * float(np.abs(system.residual(guess)).max())
    return bool(np.isfinite(level) and np.abs(system.residual(z)).max() <= level)


def _singular_error(system: System, x: Array) -> float | None:
    """Return how far round-off of F lets a solution be off where F_x is singular beside it, relative to 1 + |x|; else None.

    Along the null vector w.F is round-off up to that distance, w the left one: other equations have round-off of their own.
    Beyond it w.F grows with a power of it: fast if F_x is singular, with the first power only where it is regular. Where it
    stays round-off, solutions form a curve.
    """
    rank = _rank(system, x)
    if rank is None or _are_many(system, x, rank):
        return None
    v, any_way = (d / np.max(np.abs(d) / (1 + np.abs(x))) for d in (rank.right[-1], random_rows(1, x.size)[0]))

    def size(step: Array, along: bool = True) -> float:
        values = [system.residual(x + sign * step) for sign in (1, -1)]
        return min(float(np.abs(rank.left[-1] @ each if along else each).max()) for each in values)

    with np.errstate(all="ignore"):
        places = 0.5 ** np.arange(52, 6, -1)
        sizes, usual = np.array([(size(s * v), size(s * any_way, False)) for s in places]).T
        positive = sizes[sizes > 0]
        noise = float(np.abs(rank.left[-1]) @ np.maximum(_noise(system, x), np.abs(system.residual(x))))
        level = CERTAIN * max(noise, positive[0] if positive.size else 0.0)
        above = np.flatnonzero((sizes > level) & (sizes > CORRECTED * usual))
        s = float(places[above[0]]) if above.size else 1.0
        return s if s < ROUGH and size(4 * s * v) > 8 * size(s * v) else None


# --- conditions that follow from others ----------------------------------------------------------------------------------


class _Rank(NamedTuple):
    """Null vectors of F_x as rows, the nearest to one last: ``null`` are the numbers of those that are, up to round-off.

    ``smallest`` is the quotient of the smallest and the largest singular value among them.
    """

    right: Array
    left: Array
    null: Indices
    smallest: float


def _rank(system: System, x: Array) -> _Rank | None:
    """Return null vectors from borders of F_x that make it regular, one more than there may be null vectors; None if it is not.

    Where A v + b g = 0 with c v = 1 (see `contin.linalg.border`), A v = 0 for combinations of the v that take g to zero.
    """
    if system.size != system.equations:
        return None
    count = min(len(system.problem.states) + len(system.free) + 1, _MOST, system.size)
    columns, rows = (np.hstack([random_rows(count, system.size), np.zeros((count, k))]) for k in (0, count))
    found = Bordered(system.linearize(x, rows, columns)[1], (system.size, system.size), count, count)
    if not (np.isfinite(found.solutions).all() and np.isfinite(found.transposed).all()):
        return None
    left, values, right = np.linalg.svd(found.g.T)
    null = np.flatnonzero(values <= DEPENDENT * values[0])
    return _Rank(right @ found.right, left.T @ found.left, null, float(values[-1] / (values[0] or 1.0)))


def _nearest(system: System, x: Array, rank: _Rank) -> Array:
    """Return the point that Newton's method reaches from x with the null vectors of F_x held, up to which F can be solved."""
    right, left = rank.right[rank.null], rank.left[rank.null]
    right, left = (rows / np.linalg.norm(rows, axis=1, keepdims=True) for rows in (right, left))
    for _ in range(MOST_UPDATES):
        rows = np.hstack([right, np.zeros((len(right), len(left)))])
        residual, factors = system.linearize(x, rows, left)
        update = factors.solve(np.append(residual, np.zeros(len(rows))))[: system.size]
        if not np.isfinite(update).all():
            break
        x = x - update
        if np.abs(update).max() <= LAST_PLACES * (1 + np.abs(x).max()):
            break
    return x


def _are_many(system: System, x: Array, rank: _Rank) -> bool:
    """Return whether a solution x is one of a curve of solutions: others are reached from beside it."""
    if not rank.null.size:
        return False
    v = rank.right[rank.null].sum(axis=0)
    aside = x + ROUGH * v / np.max(np.abs(v) / (1 + np.abs(x)))
    z = _nearest(system, aside, rank)
    return bool(np.max(np.abs(z - x) / (1 + np.abs(x))) > ROUGH / 2) and _is_solution(system, z, aside)


def _beside(system: System, x: Array) -> Iterator[Array]:
    random = draws.generator("failure of solve")
    for sign in np.repeat((1.0, -1.0), draws.PLACES):
        yield x + sign * draws.ASIDE * (1 + np.abs(x)) * random.uniform(0.1, 1.0, x.size)


def dependence(system: System, x: Array) -> str:
    """Return which conditions of a boundary value problem follow from others or contradict them, as a sentence; or ""."""
    if isinstance(system.problem, (CycleProblem, ConnectionProblem)):
        return _of_orbit(system, x, _rank(system, x))
    if type(system.problem) not in (BoundaryValueProblem, SegmentedProblem):  # a special kind
        return ""
    system, x = _evenly_scaled(system, x)
    if (rank := _rank(system, x)) is None:
        return ""
    if not rank.null.size:
        return _phase(system, x)
    z = _nearest(system, x, rank)
    solved = bool(np.isfinite(z).all()) and _is_solution(system, z, x)
    rank = (_rank(system, z) if solved else _rank(system, next(_beside(system, x)))) or rank
    if not rank.null.size or (solved and not _are_many(system, z, rank)):
        return ""
    return _jumping(system, rank) or _conditions(system, z, rank, solved)


def _evenly_scaled(system: System, x: Array) -> tuple[System, Array]:
    """Return the system in units in which rates depend evenly on all states, by Curtis & Reid's least squares, and x for it."""
    batch, n = system.problem.batch("field"), len(system.problem.states)
    given = system.nodes, system.states(x), np.empty((0, 0)), system.all_parameters(x)
    slopes = np.abs(batch.jacobian(*given, batch.columns(()))[1][:, :n]).max(axis=0) * (1 - np.eye(n))
    effects, causes = np.nonzero((slopes > 0) & np.isfinite(slopes))
    logarithms, *_ = np.linalg.lstsq(np.eye(n)[effects] - np.eye(n)[causes], np.log(slopes[effects, causes]))
    return system.with_scales(x, usual(np.exp(logarithms), True), system.scales.parameters)


def of_family(system: System, x: Array) -> str:
    """Return why the equations of an orbit are singular at a guess, where its solutions form a family, as a sentence; or "".

    Newton's method would choose one of them by round-off, or lead to an equilibrium.
    """
    rank = _rank(system, x) if isinstance(system.problem, (CycleProblem, ConnectionProblem)) else None
    return _of_orbit(system, x, rank) if rank is not None and rank.null.size else ""


def _of_orbit(system: System, x: Array, rank: _Rank | None) -> str:
    """Return why a cycle or connecting orbit near x is not determined, as a sentence; or ""."""
    idle = [name for name in system.free if not system.parameter_columns(x, (name,)).any()]
    if idle:
        return f"free: {checks.listed(idle)} changes nothing in the equations: free a parameter that the orbit depends on"
    if rank is None:
        return ""
    z = _nearest(system, x, rank._replace(null=np.union1d(rank.null, len(rank.left) - 1)))
    rank = _rank(system, z) if np.isfinite(z).all() and _is_solution(system, z, x) else None
    if rank is None or not _are_many(system, z, rank):
        return ""
    try:
        system.check_solution(z)  # an equilibrium solves the equations of cycles with any period
    except ConvergenceError:
        return ""
    breaking = _acting(system, z, rank.left[rank.null])
    which = f'free "{breaking[0]}", which breaks it,' if breaking else "free a parameter that breaks it, as a damping does,"
    return (
        "free: the orbit is one of a family at the same parameters, as where a quantity is conserved: "
        f"{which} in place of {system.free[0]}"
    )


def _acting(system: System, x: Array, left: Array) -> list[str]:
    """Return which parameters that are not free enter combinations ``left`` (k, equations) of the equations."""
    if not (names := [name for name in system.problem.parameters if name not in system.free]):
        return []
    columns = system.parameter_columns(x, names)
    acting = np.any(np.abs(left @ columns) > LOCATED * (np.abs(left) @ np.abs(columns)), axis=0).tolist()
    return [name for name, acts in zip(names, acting) if acts]


def _jumping(system: System, rank: _Rank) -> str:
    """Return which states act by jumps only, as a sentence; "" if none."""
    if not (switch := jump(system.problem.batch("field"), _moved(system, rank)[1])):
        return ""
    text, one = _named(system, rank)
    return (
        f"rhs: {text} {'acts' if one else 'act'} by a jump only ({switch}), whose derivative is zero, so that Newton's method "
        "does not see it: write it as a smooth step with a parameter eps, such as tanh(z / eps) for sign(z), solve at a large "
        "eps, and follow the solution to a small one (trace)"
    )


def _conditions(system: System, z: Array, rank: _Rank, solved: bool) -> str:
    """Return which conditions follow from the others, or contradict them, and what to put in their place."""
    problem: Any = system.problem
    counts = {"boundary": problem.boundary_size, "integral": problem.integral_size}
    numbered = [f"{kind} condition {i + 1}" for kind, count in counts.items() for i in range(count)]
    left, (moved, _), (text, is_one) = rank.left[rank.null], _moved(system, rank), _named(system, rank)
    rows = reduced(left[:, system.equations - len(numbered) :][:, ::-1])[:, ::-1]
    extra = checks.listed(sorted(numbered[np.flatnonzero(row)[-1]] for row in rows))
    places = [f"{name} at the {end} end" for end in ("first", "second") for name in problem.state_names] + list(system.free)
    ends = reduced(np.hstack([moved[:, 0], moved[:, -1], rank.right[rank.null, system.state_size :]]))
    held = "conditions on " * (len(ends) > 1) + checks.listed(places[np.flatnonzero(row)[0]] for row in ends if row.any())
    held, verb, their = (held, "", "their") if len(ends) > 1 else (f"a condition on {held}", "s", "its")
    if solved and _is_shift(system, z, moved):
        return (
            f"boundary: {text} may be shifted along t, as nothing holds the phase: state a cycle as a CycleProblem, which finds"
            f" its period; or put {held} in the place of {extra}"
        )
    free_ones = f"{text} {'is' if is_one else 'are'} not determined"
    if solved:
        return f"boundary: {extra} follow{verb} from the others and the equations, and {free_ones}: put {held} in {their} place"
    freed = _acting(system, z, left)[: len(ends)]
    advice = f", or add it and free {checks.listed(freed)}" if len(freed) == len(ends) == 1 else ""
    return (
        f"boundary: {extra} contradict{verb} the others and the equations, so there is no solution at these parameters, and "
        f"{free_ones}: put {held} in {their} place{advice}"
    )


def _phase(system: System, x: Array) -> str:
    """Return that only a phase and a period are missing, of periodic boundary conditions near a cycle, as a sentence; or ""."""
    with np.errstate(all="ignore"):
        z = _summed(system, x)
        rank = _rank(system, z) if np.isfinite(z).all() else None
        if rank is None or rank.smallest > ROUGH:
            return ""
        if not _is_shift(system, z, _moved(system, rank._replace(null=np.array([-1])))[0], ROUGH):
            return ""
    return (
        "boundary: the solution nearby may be shifted along t, as nothing holds its phase, and has its own period: state a "
        "cycle as a CycleProblem, which finds its period; or free a parameter and add a condition for the phase"
    )


def _moved(system: System, rank: _Rank) -> tuple[Array, list[int]]:
    """Return the null vectors at the nodes, shape (k, K, n), and the states that they move."""
    moved = rank.right[rank.null, : system.state_size].reshape(len(rank.null), -1, len(system.problem.states))
    sizes = np.abs(moved).max(axis=(0, 1))
    return moved, np.flatnonzero(sizes > LOCATED * sizes.max()).tolist()


def _named(system: System, rank: _Rank) -> tuple[str, bool]:
    """Return the names of these states, and whether it is one."""
    states = _moved(system, rank)[1]
    return checks.listed(system.problem.states[i] for i in states), len(states) == 1


def _is_shift(system: System, z: Array, moved: Array, level: float = APART) -> bool:
    """Return whether the null vector is the derivative of the solution by t."""
    given = system.nodes, system.states(z), moved[0, :0], system.all_parameters(z)
    rates = system.problem.batch("field").values(*given)[:, : moved.shape[2]] / system.scales.states
    return len(moved) == 1 and bool(cosine(rates.ravel(), moved.ravel()) > 1 - level)


def _not_finite(system: System, x: Array) -> str:
    """Return where a function has no finite value or derivative at x, as a sentence; "" where all have."""
    with np.errstate(all="ignore"):
        for batch, times, u, v, p in system.evaluations(x):
            values, slopes = batch.jacobian(times, u, v, p, batch.columns(()))
            finite = np.isfinite(values).all(axis=1) & np.isfinite(slopes).all(axis=(1, 2))
            for i in np.flatnonzero(~finite)[:1]:
                return not_finite(Place(batch, float(times[i]), [*u[i], *(v[i] if len(v) else ()), *p]))
    return ""
