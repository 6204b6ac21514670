"""The folder for compiled problems and generated code."""

from __future__ import annotations

import functools
import os
import secrets
import sys
import tempfile
from pathlib import Path

from contin.errors import ContinError

_ADVICE = "set CONTIN_CACHE_DIR to a folder that can be written"


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
    try:
        path = Path(tempfile.mkdtemp(prefix="contin-"))
    except OSError as error:
        raise ContinError(f"no place for compiled code: {error.strerror}; {_ADVICE}") from error
    print(f"contin: no writable cache, compiling into {path}; set CONTIN_CACHE_DIR to keep it", file=sys.stderr)
    return path


def write_bytes(path: Path, data: bytes) -> None:
    """Put a whole file in place of ``path``: no process, and no power cut, ever sees half of it.

    Raises
    ------
    OSError
        It cannot be written; what was there is left as it was.
    """
    temporary = path.with_name(f".{path.name[:50]}.{secrets.token_hex(4)}.part")
    try:
        with open(temporary, "xb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)


def write_source(name: str, text: str) -> Path:
    """Keep generated code in the cache directory or, where that is full, in a temporary one; the path.

    Raises
    ------
    ContinError
        There is no place for it.
    """
    folder = cache_directory()
    try:
        write_bytes(folder / name, text.encode("utf-8"))
        return folder / name
    except OSError:
        path = _temporary_directory() / name
    try:
        write_bytes(path, text.encode("utf-8"))
    except OSError as error:
        raise ContinError(f"no place for compiled code: {folder} and {path.parent}: {error.strerror}; {_ADVICE}") from error
    return path
