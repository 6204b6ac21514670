"""Names of result files."""

from __future__ import annotations

from typing import TYPE_CHECKING

from contin.lowlevel import exact_text

if TYPE_CHECKING:  # a question about a diagram needs no scenes, which take 0.1 s to import
    from branches.config import Config

#: The files of a diagram, in two formats.
DIAGRAM, GRAPHML = "diagram.json", "diagram.graphml"


def primary_file(config: Config) -> str:
    """Return the file of a primary branch in the folder of its diagram; each branch of a scene has its own."""
    return f"{_stem(config)}.h5"


def secondary_file(config: Config, taken: set[str]) -> str:
    """Return the file of a secondary branch: that of its primary branch, with the origin and the domain.

    kappa_n of the origin has six digits: it was computed, and further digits may differ on another machine. It has more if
    another branch of the diagram already has this name.
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
