"""The folder for compiled kernels."""

from __future__ import annotations

import functools
import os
import sys
import tempfile
from pathlib import Path

from contin.errors import ContinError

#: The end of every message about a cache that cannot be written.
_ADVICE = "set CONTIN_CACHE_DIR to a folder that can be written"


def cache_directory() -> Path:
    """Return the folder for compiled kernels: ``CONTIN_CACHE_DIR``, else the user's cache directory, else a temporary one.

    Examples
    --------
    >>> cache_directory().is_dir()
    True
    """
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
    try:
        path = Path(tempfile.mkdtemp(prefix="contin-"))
    except OSError as error:
        raise ContinError(f"no place for compiled code: {error.strerror}; {_ADVICE}") from error
    print(f"contin: no writable cache, compiling into {path}; set CONTIN_CACHE_DIR to keep it", file=sys.stderr)
    return path
