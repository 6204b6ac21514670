"""The scenes that come with the package."""

from __future__ import annotations

from pathlib import Path

#: The folder of scenes: in an installed package, and in a working copy.
_FOLDERS = Path(__file__).resolve().parents[1] / "configs", Path(__file__).resolve().parents[2] / "configs"


def scenes() -> list[Path]:
    """Return the files of all scenes of the package, by name."""
    return sorted(file for folder in _FOLDERS for file in folder.glob("*.yaml"))


def found(name: str) -> str:
    """Return the file of a scene: the given one, or, where there is none, the scene of the package with this name.

    Examples
    --------
    >>> Path(found("m1_n2")).name, found("no such scene")
    ('m1_n2.yaml', 'no such scene')
    """
    return next((str(file) for file in scenes() if file.stem == name and not Path(name).exists()), name)
