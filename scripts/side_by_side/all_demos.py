"""All demos of AUTO-07p's distribution, in alphabetical order."""

from __future__ import annotations

from side_by_side import connections, cycles, driven, maps, statics

DEMOS = sorted(
    [*statics.demos(), *cycles.demos(), *driven.demos(), *maps.demos(), *connections.demos()], key=lambda demo: demo.name
)
