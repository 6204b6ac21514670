"""The name that `ribbon_model.section` had in version 0.2; it works for one version."""

from __future__ import annotations

import warnings
from collections.abc import Mapping

from ribbon_model.section import Section, section_of

_NONE: Mapping = {}


def Material(law: str = "flat rod", numbers: Mapping[str, float] = _NONE, along: Mapping[str, str] = _NONE) -> Section:
    """Return the `Section` of a law that is named."""
    warnings.warn("Material('name', ...) is Section(OPEN_LAWS['name'], ...) now", DeprecationWarning, stacklevel=2)
    return section_of(law, numbers, along)
