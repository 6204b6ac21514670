"""Where compiled code is kept; nothing here imports numba, so that it can be told in time."""

from __future__ import annotations

import functools
import os
import sys
import tempfile
from pathlib import Path


def cache_directory() -> Path:
    """Where compiled problems are kept: ``CONTIN_CACHE_DIR``, else the user's cache directory, else a temporary one."""
    chosen = os.environ.get("CONTIN_CACHE_DIR")
    if not chosen:
        from platformdirs import user_cache_dir

        chosen = os.path.join(user_cache_dir("contin", appauthor=False), "problems")
    try:
        os.makedirs(chosen, exist_ok=True)
        if os.access(chosen, os.W_OK):
            return Path(chosen)
    except OSError:
        pass
    return _temporary_directory()


@functools.cache
def _temporary_directory() -> Path:
    path = Path(tempfile.mkdtemp(prefix="contin-"))
    print(f"contin: no writable cache, compiling into {path}; set CONTIN_CACHE_DIR to keep it", file=sys.stderr)
    return path


def write_text(path: Path, text: str) -> None:
    """Write a file so that no other process ever sees half of it."""
    handle, temporary = tempfile.mkstemp(dir=path.parent, suffix=".tmp")
    with os.fdopen(handle, "w") as file:
        file.write(text)
    os.replace(temporary, path)


def _tell_numba() -> None:
    """Give numba a place for the engine's kernels where neither the package's folder nor the user's cache can be written."""
    if os.environ.get("NUMBA_CACHE_DIR"):
        return
    package = Path(__file__).resolve().parent
    beside = package / "__pycache__"
    if os.access(beside if beside.exists() else package, os.W_OK):
        return
    os.environ["NUMBA_CACHE_DIR"] = str(cache_directory() / "engine")
    if "numba" in sys.modules:
        sys.modules["numba"].config.CACHE_DIR = os.environ["NUMBA_CACHE_DIR"]


_tell_numba()
