"""All demos of AUTO-07p's distribution, in alphabetical order."""

from __future__ import annotations

from side_by_side import statics

DEMOS = sorted(statics.demos(), key=lambda demo: demo.name)
