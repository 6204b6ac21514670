"""``python -m branches.strip --width ...``: the states of a closed strip of given dimensions, in SI units."""

from __future__ import annotations

from branches import interrupt

if __name__ == "__main__":  # before the imports below, which take a second
    interrupt.begin(interrupt.NO_FILES)

import math
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from branches.display import Parser, complain, survive_any_encoding, write_output
from branches.progress import Progress
from ribbon_model.strip import NAMES, Strip

#: Covering indices considered: odd ones, as a loop can be folded into these; up to the second beyond the natural curvature.
_COVERINGS, _MOST_COVERINGS = 7, 15
#: Branches are followed to this distance from the natural curvature, over 2 pi/L.
_REACH = 40.0
#: Largest difference of thresholds for which a limit law holds, and largest ratio that counts as small.
_AGREES, _SMALL = 0.01, 0.1
#: States whose energies and conjugate curvatures differ by less are the same.
_SAME = 1e-8
_UNITS = {"poisson_ratio": "", "youngs_modulus": "Pa"}


@dataclass(frozen=True)
class State:
    """An equilibrium at the strip's natural curvature.

    Attributes
    ----------
    name : str
    m : int
        Covering index of a circle; 0 for a buckled state.
    index : int or float
        Number of negative directions of the energy, 0 if stable; nan if undecided.
    moment, energy, strain : float
        Magnitude of the internal moment in N m, energy above the natural state in J, largest strain at the surface.
    """

    name: str
    m: int
    index: float
    moment: float
    energy: float
    strain: float

    @property
    def stable(self) -> bool:
        """Return whether the state is a minimum of the energy."""
        return self.index == 0


# --- the states ------------------------------------------------------------------------------------------------------


def coverings(strip: Strip) -> range:
    """Return the covering indices of the circles that are considered."""
    return range(1, max(_COVERINGS, min(_MOST_COVERINGS, 2 * int(strip.kappa_n / 2) + 5)) + 1, 2)


def circles(strip: Strip) -> list[State]:
    """Return the planar circles."""
    from ribbon_model import linear
    from ribbon_model.laws import FINITE_WIDTH

    found = []
    for m in coverings(strip):
        values = linear.circle(FINITE_WIDTH, m, strip.kappa_n, strip.poisson_ratio, strip.Gamma)
        index = linear.index(FINITE_WIDTH, m, strip.kappa_n, strip.poisson_ratio, strip.Gamma)
        strain = float(strip.strain(m - strip.kappa_n))
        name = f"{m}-fold circle" if m > 1 else "single loop"
        found.append(State(name, m, index, abs(values["M1"]) * strip.moment_unit, _energy(strip, values), strain))
    return found


def _energy(strip: Strip, values) -> float:
    """Return the energy above the natural state; the other energies of this package leave kappa_n**2/2 out."""
    return (values["energy"] + strip.kappa_n**2 / 2) * strip.energy_unit


def buckled(strip: Strip, quiet: bool = True) -> tuple[list[State], list[tuple[str, float]]]:
    """Return the states on the primary branches at the strip's natural curvature, and the folds on the branch (1, 2).

    A fold is a pair (name, kappa_n). Unless ``quiet``, a line of progress is shown.
    """
    states, folds, seen = [], [], []
    modes = [(m, n) for m in coverings(strip) for n in range(1, coverings(strip)[-1] + 2) if n != m]
    with Progress("branches", len(modes), quiet) as progress:
        for m, n in modes:
            progress.part(f"({m}, {n})")
            for point, equilibrium in _at_natural_curvature(strip, m, n, folds if (m, n) == (1, 2) else []):
                place = point["energy"], point["kappa_star"]
                if not any(n == other and np.allclose(place, there, rtol=_SAME, atol=_SAME) for other, there in seen):
                    seen.append((n, place))
                    states.append(_state(strip, f"buckled ({m}, {n})", point, equilibrium))
            progress.part_done()
    return states, folds


def _at_natural_curvature(strip: Strip, m: int, n: int, folds: list) -> Iterator[tuple]:
    """Yield the points of a branch at kappa_n, with their equilibria; kappa_n of its folds is added to ``folds``."""
    from contin import Settings, follow
    from ribbon_model import convexity
    from ribbon_model.laws import FINITE_WIDTH
    from ribbon_model.linear import thresholds
    from ribbon_model.seeds import primary_branch
    from ribbon_model.solution import Solution

    kappa_n, nu, Gamma = strip.kappa_n, strip.poisson_ratio, strip.Gamma
    try:
        start = thresholds(FINITE_WIDTH, m, n, nu, Gamma)[0]
    except ValueError:
        return  # no such bifurcation
    limits = {"kappa_n": (min(start, kappa_n) - _REACH, max(start, kappa_n) + _REACH)}
    system, x, tangent = primary_branch(FINITE_WIDTH, m, n, nu, 8, 7, Gamma=Gamma)
    ends = convexity.test_functions(FINITE_WIDTH)
    run = follow(system, x, Settings(trivial="M2", limits=limits, zeros={"kappa_n": [kappa_n]}, test_functions=ends), tangent)
    for point in run:
        if point.label == "LP":
            folds.append((f"fold of ({m}, {n})", point["kappa_n"]))
        if point.label == "UZ":
            yield point, Solution.of(point).equilibrium()


def _state(strip: Strip, name: str, point, equilibrium) -> State:
    from ribbon_model.equilibrium import LENGTH
    from ribbon_model.stability import index

    stability = index(equilibrium)
    directors = equilibrium.directors(np.linspace(0, LENGTH, 400, endpoint=False))
    strains, _ = equilibrium.response(directors @ equilibrium.moment)
    strain = float(strip.strain(strains[:, 0] - strip.kappa_n, strains[:, 2]).max())
    moment = float(np.linalg.norm(equilibrium.moment)) * strip.moment_unit
    return State(name, 0, stability.index if stability.decided else math.nan, moment, _energy(strip, point), strain)


# --- the law ----------------------------------------------------------------------------------------------------------


def deviations(strip: Strip) -> dict[str, float]:
    """Return the largest difference between the thresholds n = m +- 1 of a limit law and the strip's, over |threshold| + m."""
    from ribbon_model.laws import FINITE_WIDTH, FLAT_ROD, RIBBON
    from ribbon_model.linear import thresholds

    result = {}
    for law in (FLAT_ROD, RIBBON):
        worst = 0.0
        for m, n in ((1, 2), (3, 2), (3, 4), (5, 4), (5, 6)):
            try:
                own = thresholds(FINITE_WIDTH, m, n, strip.poisson_ratio, strip.Gamma)[0]
                worst = max(worst, abs(thresholds(law, m, n, strip.poisson_ratio)[0] - own) / (abs(own) + m))
            except ValueError:  # a bifurcation that one of them does not have
                worst = math.inf
        result[law.name] = worst
    return result


def _law(strip: Strip) -> str:
    """Return the law that holds, in words."""
    off = deviations(strip)
    nearer = min(off, key=off.get)
    others = ", ".join(
        f"{name} {100 * value:.2g} %" if value < math.inf else f"{name}: not all exist" for name, value in off.items()
    )
    name = nearer if off[nearer] <= _AGREES else "finite width, between flat rod and ribbon"
    return f"{name} (thresholds against the law of finite width: {others})"


# --- the answer -------------------------------------------------------------------------------------------------------


def answer(strip: Strip, yield_strain: float | None = None, quiet: bool = True) -> str:
    """Return what the command prints, one screen; unless ``quiet``, a line of progress is shown meanwhile."""
    rings = circles(strip)
    others, folds = buckled(strip, quiet)
    lines = [
        f"Gamma = w^2/(h L/2pi) = {strip.Gamma:.4g}, natural curvature kappa_n L/2pi = {strip.kappa_n:.4g}",
        f"law: {_law(strip)}",
        *assumptions(strip, rings, yield_strain),
        "",
        f"{'circle  radius mm  stable for natural radii (mm)':57s}  {'here':14s}  moment N m   energy J  strain",
        *(_circle_line(strip, ring, yield_strain) for ring in rings),
        *(
            f"{name}, where its stable state ends: natural radius {_millimetres(strip.radius(value))}"
            for name, value in folds[:1]
        ),
        "",
        *_buckled_lines(others, yield_strain),
        *_fate(rings, [state for state in others if state.stable]),
    ]
    return "\n".join(lines) + "\n"


def assumptions(strip: Strip, rings: list[State], yield_strain: float | None = None) -> Iterator[str]:
    """Yield a caution for each assumption that fails, or whose error is not small, with its size."""
    if strip.torsion_excess > _SMALL / 2:
        ratio, excess = strip.thickness / strip.width, 100 * strip.torsion_excess
        yield f"caution: h/w = {ratio:.3g} is not thin: a plate's torsional stiffness is too large by about {excess:.0f} %"
    wide = [ring for ring in rings if strip.width / strip.radius(ring.m) > _SMALL]
    if wide:
        ratio, more = strip.width / strip.radius(wide[0].m), " and more with more turns" if len(wide) > 1 else ""
        yield f"caution: not slender: w over the radius is {ratio:.2g} on the {wide[0].name}{more}; errors of that order"
    if yield_strain is not None:
        beyond = [ring.name for ring in rings if ring.strain > yield_strain]
        if beyond:
            yield f"caution: strains beyond the yield strain {yield_strain:g} (marked !): {', '.join(beyond)}"


def _circle_line(strip: Strip, ring: State, yield_strain) -> str:
    radius = 1e3 * strip.radius(ring.m)
    return f"{ring.m:6d}  {radius:9.1f}  {_natural_radii(strip, ring.m):38s}  {_numbers(ring, yield_strain)}"


def _natural_radii(strip: Strip, m: int) -> str:
    """Return the natural radii for which the m-fold circle is stable."""
    from ribbon_model.laws import FINITE_WIDTH
    from ribbon_model.linear import energy_interval

    low, high = (m * end for end in energy_interval(FINITE_WIDTH, m, strip.poisson_ratio, strip.Gamma))
    least = "0" if high == math.inf else f"{1e3 * strip.radius(high):.4g}"
    if low > 0:
        return f"{least} ... {1e3 * strip.radius(low):.4g}"
    reverse = "" if low == -math.inf else f" over {-1e3 * strip.radius(low):.4g}"
    return f"over {least}, straight, reversed{reverse}" if low < 0 else f"over {least}, straight"


def _numbers(state: State, yield_strain) -> str:
    kind = "undecided" if math.isnan(state.index) else "stable" if state.stable else f"unstable, {state.index:g}"
    mark = " !" if yield_strain is not None and state.strain > yield_strain else ""
    return f"{kind:14s}  {state.moment:10.4g} {state.energy:10.4g}  {state.strain:7.3%}{mark}"


def _buckled_lines(others: list[State], yield_strain) -> Iterator[str]:
    rest = [state for state in others if state.index > 0]
    for state in others:
        if state not in rest:  # stable, or not decided
            yield f"{state.name:57s}  {_numbers(state, yield_strain)}"
    if rest:
        names = ", ".join(state.name.removeprefix("buckled ") for state in rest)
        yield f"{len(rest)} unstable buckled states here: {names}"


def _fate(rings: list[State], stable_others: list[State]) -> Iterator[str]:
    """Yield the states into which the single loop can fold: stable states of less energy."""
    single = rings[0]
    below = sorted(
        (state for state in (*rings[1:], *stable_others) if state.stable and state.energy < single.energy),
        key=lambda state: state.energy,
    )
    ends = ", ".join(f"{state.name} ({single.energy - state.energy:.3g} J less)" for state in below) or "nothing found here"
    if not single.stable:
        yield f"the single loop is unstable and folds into {'one of: ' if len(below) > 1 else ''}{ends}"
    elif below:
        yield f"the single loop is stable; pushed far enough it can fold into: {ends}"
    else:
        yield "the single loop is stable, and nothing stable has less energy"


def _millimetres(metres: float) -> str:
    return f"{1e3 * metres:.4g} mm"


# --- the command ------------------------------------------------------------------------------------------------------


def main(argv: Sequence[str] | None = None) -> int:
    """Print the answer; return the exit code: 0, or 2 for an invalid strip."""
    parser = Parser(
        prog="python -m branches.strip",
        description="A strip whose ends are joined: which circles are stable, what else there is, moments, energies, strains. "
        "SI units.",
    )
    for name in NAMES:
        unit = _UNITS.get(name, "m")
        more = ", inf for a straight strip" if name == "natural_radius" else ""
        help_text = f"{unit}{more}" if unit else "Poisson's ratio"
        parser.add_argument(f"--{name.replace('_', '-')}", type=float, required=True, metavar="X", help=help_text)
    parser.add_argument("--yield-strain", type=float, metavar="X", help="mark states with a larger strain")
    parser.add_argument("--quiet", action="store_true", help="show no line of progress")
    options = vars(parser.parse_args(argv))
    survive_any_encoding()
    yield_strain, quiet = options.pop("yield_strain"), options.pop("quiet")
    try:
        if yield_strain is not None and not 0 < yield_strain < math.inf:
            raise ValueError(f"yield_strain: {yield_strain:g} must be positive and finite")
        strip = Strip(**options)
    except ValueError as error:
        complain(f"error: {error}")
        return 2
    from threadpoolctl import threadpool_limits

    with threadpool_limits(1, "blas"):  # the matrices are small
        write_output(answer(strip, yield_strain, quiet))
    return 0


if __name__ == "__main__":
    sys.exit(interrupt.run(main))
