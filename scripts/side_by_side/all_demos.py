"""All demos of AUTO-07p's distribution, in alphabetical order."""

from __future__ import annotations

from side_by_side import connections, cycles, driven, maps, others, statics

MODULES = statics, cycles, driven, maps, connections, others
DEMOS = sorted((demo for module in MODULES for demo in module.demos()), key=lambda demo: demo.name)
