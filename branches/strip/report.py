"""What `branches.strip` prints of a closed strip: its law, states, stability and barriers, with cautions."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

from branches.scene.units import STRIP_UNITS, unusual
from branches.strip.states import State, buckled, by_hand, circles, ways_out
from ribbon_model.barriers import Barrier, Folding
from ribbon_model.laws import FINITE_WIDTH, FLAT_ROD, RIBBON
from ribbon_model.linear import energy_interval, thresholds
from ribbon_model.strip import Strip

#: Largest difference of thresholds for which a limit law holds, and largest ratio that counts as small.
_AGREES, _SMALL = 0.01, 0.1


# --- the law ----------------------------------------------------------------------------------------------------------


def deviations(strip: Strip) -> dict[str, float]:
    """Return the largest difference between the thresholds n = m +- 1 of a limit law and the strip's, over |threshold| + m."""
    result = {}
    for law in (FLAT_ROD, RIBBON):
        worst = 0.0
        for m, n in ((1, 2), (3, 2), (3, 4), (5, 4), (5, 6)):
            try:
                own = thresholds(FINITE_WIDTH, m, n, strip.parameters)[0]
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
    others, folds, lost = buckled(strip, quiet)
    states = [*rings, *others]
    barriers = ways_out(states, quiet)
    foldings = by_hand(strip, states, barriers, quiet)
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
        *lost_lines(lost),
        *_fate(rings, [state for state in others if state.stable]),
        "",
        *_ways_out([state for state in states if state.stable], barriers),
        *_by_hand(strip, foldings),
    ]
    return "\n".join(lines) + "\n"


def assumptions(strip: Strip, rings: list[State], yield_strain: float | None = None) -> Iterator[str]:
    """Yield a caution for each assumption that fails, or whose error is not small, with its size."""
    yield from (f"caution: {one}" for one in unusual({name: getattr(strip, name) for name in STRIP_UNITS}))
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
    low, high = (m * end for end in energy_interval(FINITE_WIDTH, m, strip.parameters))
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


def lost_lines(modes: list[tuple[int, int]]) -> Iterator[str]:
    """Yield the branches that were not followed."""
    if modes:
        names = ", ".join(str(mode) for mode in modes)
        yield f"not followed, because the law has two bendings for the moment where they begin: {names}"


def _fate(rings: list[State], stable_others: list[State]) -> Iterator[str]:
    """Yield whether the single loop is stable, and the stable states of less energy; the ways there are not computed."""
    single = rings[0]
    below = sorted(
        (state for state in (*rings[1:], *stable_others) if state.stable and state.energy < single.energy),
        key=lambda state: state.energy,
    )
    ends = ", ".join(f"{state.name} ({single.energy - state.energy:.3g} J less)" for state in below) or "nothing found here"
    if below or not single.stable:
        yield f"the single loop is {'stable' if single.stable else 'unstable'}; stable states of less energy: {ends}"
    else:
        yield "the single loop is stable, and nothing stable has less energy"


def _ways_out(stable: list[State], barriers: Mapping[str, Barrier]) -> Iterator[str]:
    """Yield the energy that each stable state must be given before it leaves, and what it gives back on the way down."""
    energies = {state.name: state.energy for state in stable}
    yield f"{'to leave':18s}  {'push J':>10s}  over the saddle   falls into             released J"
    for state in stable:
        way = barriers.get(state.name)
        if way is None:
            yield f"{state.name:18s}  no saddle beside it was found on the primary branches"
            continue
        behind = "a state not listed here" if way.behind is None else way.behind
        released = "" if way.behind is None else f"{state.energy + way.height - energies[way.behind]:10.4g}"
        yield f"{state.name:18s}  {way.height:10.4g}  {way.saddle:16s}  {behind:23s}{released}".rstrip()


def _by_hand(strip: Strip, foldings: Mapping[str, Folding]) -> Iterator[str]:
    """Yield the couples that take circles to their saddles."""
    if foldings:
        yield ""
        yield "by hand, two opposite points turned against each other about the line between them:"
    for name, path in foldings.items():
        couple, angle, end = path.couples[path.peak] * strip.moment_unit, path.angles[path.peak], path.angles[-1]
        yield (
            f"{name:18s}  {couple:10.4g} N m at most, at {math.degrees(angle):.0f} degrees; "
            f"beyond {math.degrees(end):.0f} degrees it goes on by itself"
        )


def _millimetres(metres: float) -> str:
    return f"{1e3 * metres:.4g} mm"
