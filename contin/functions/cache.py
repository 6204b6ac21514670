"""The folder for compiled problems and generated code."""

from __future__ import annotations

import contextlib
import functools
import os
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

from contin.errors import ContinError
from contin.files import write_whole

#: The end of every message about a cache that cannot be written.
_ADVICE = "set CONTIN_CACHE_DIR to a folder that can be written"


def cache_directory() -> Path:
    """Return the folder for compiled problems: ``CONTIN_CACHE_DIR``, else the user's cache directory, else a temporary one.

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


def kept_text(name: str) -> str:
    """Return the text that `keep_text` kept under a name, nothing where there is none."""
    try:
        return (cache_directory() / name).read_text(encoding="utf-8")
    except OSError:
        return ""


def keep_text(name: str, text: str) -> None:
    """Keep a short text in the cache directory, if it can be written."""
    with contextlib.suppress(OSError):
        write_whole(cache_directory() / name, text.encode("utf-8"))


def run_kept_source(name: str, derive: Callable[[], str], scope: dict[str, Any]) -> None:
    """Run generated code in a scope: the file of this name in the cache directory, made by ``derive`` the first time.

    Raises
    ------
    ContinError
        There is no place for it.
    """
    path = cache_directory() / name
    try:
        source = path.read_text(encoding="utf-8")
    except OSError:
        source = derive()
        path = write_source(name, source)
    exec(compile(source, str(path), "exec"), scope)


def write_source(name: str, text: str) -> Path:
    """Write generated code to the cache directory or, where that is full, to a temporary one; return its path.

    Raises
    ------
    ContinError
        There is no place for it.
    """
    folder = cache_directory()
    try:
        write_whole(folder / name, text.encode("utf-8"))
        return folder / name
    except OSError:
        path = _temporary_directory() / name
    try:
        write_whole(path, text.encode("utf-8"))
    except OSError as error:
        raise ContinError(f"no place for compiled code: {folder} and {path.parent}: {error.strerror}; {_ADVICE}") from error
    return path
