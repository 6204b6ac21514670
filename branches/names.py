"""Names of result files. The one place."""

from __future__ import annotations

from branches.config import Config
from contin import exact_text

#: A diagram in its folder, in two formats.
DIAGRAM, GRAPHML = "diagram.json", "diagram.graphml"


def primary_file(config: Config) -> str:
    """The file of a primary branch inside the folder of its diagram; different branches of a scene have different ones."""
    return f"{_stem(config)}.h5"


def secondary_file(config: Config, taken: set[str]) -> str:
    """The file of a secondary branch: that of its primary one, with the place and the domain.

    The place has six digits: it was computed, and the others may differ on another machine. It is told more exactly only where
    another branch of the diagram has the name already.
    """
    kappa_n, kappa_star = exact_text(config.origin.kappa_n), exact_text(config.origin.kappa_star)
    places = (f"{config.origin.kappa_n:.6g}", kappa_n, f"{kappa_n}_{kappa_star}")
    names = [f"{_stem(config)}_from{place}_{config.domain.replace(' ', '_')}.h5" for place in places]
    return next((name for name in names if name not in taken), names[-1])


def _stem(config: Config) -> str:
    law = config.law.replace(" ", "_")
    if config.Gamma is not None:
        law += f"_Gamma{config.Gamma:.12g}"
    return f"{law}_nu{exact_text(config.nu)}_m{config.m}_n{config.n}"
