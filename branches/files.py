"""Files replaced whole: what is on disk is the old content or the new one, at any instant."""

from __future__ import annotations

import glob
import io
import os
import secrets
import shutil
import time
from pathlib import Path

#: Bytes that the smallest result takes, for a look at the disk before anything is computed.
_SMALLEST = 64 * 1024


class StoreError(Exception):
    """A file that cannot be written or read; the message is one sentence."""


def _temporary(path: Path) -> Path:
    """A hidden name of its own beside ``path``, no longer than names may be."""
    return path.with_name(f".{path.name[:50]}.{secrets.token_hex(4)}.part")


def _write(path: Path, data: bytes) -> None:
    with open(path, "xb") as file:  # its mode is what the umask says
        file.write(data)
        file.flush()
        os.fsync(file.fileno())


def write_bytes(path: Path, data: bytes) -> None:
    """Put a whole file in place of ``path`` (of what it links to), with its mode, or leave everything as it was.

    Raises
    ------
    StoreError
        It cannot be written.
    """
    path = Path(os.path.realpath(path))
    temporary = _temporary(path)
    try:
        try:
            _write(temporary, data)
            if path.exists():
                shutil.copymode(path, temporary)
            os.replace(temporary, path)
        finally:
            temporary.unlink(missing_ok=True)
    except OSError as error:
        raise StoreError(f"cannot write {str(path)!r}: {error.strerror}") from error


def prepare(path: Path) -> None:
    """Make the folder of ``path``, see that a result can be written, and remove what killed runs left behind.

    Raises
    ------
    StoreError
        Nothing can be written there.
    """
    path = Path(os.path.realpath(path))
    try:
        if path.parent.exists() and not path.parent.is_dir():
            raise StoreError(f"cannot write {str(path)!r}: {str(path.parent)!r} is not a folder")
        path.parent.mkdir(parents=True, exist_ok=True)
        if path.exists() and not os.access(path, os.W_OK):
            raise StoreError(f"cannot write {str(path)!r}: the file is read-only")
        probe = _temporary(path)
        try:
            _write(probe, bytes(_SMALLEST))
        finally:
            probe.unlink(missing_ok=True)
        for left in path.parent.glob(f".{glob.escape(path.name[:50])}.????????.part"):
            if time.time() - left.stat().st_mtime > 60:  # not of a run that is writing right now
                left.unlink()
    except OSError as error:
        raise StoreError(f"cannot write {str(path)!r}: {error.strerror}") from error


def check_picture(path: Path) -> None:
    """StoreError if ``path`` names no picture that can be written, before anything is drawn."""
    if path.suffix.lower() not in (".pdf", ".svg", ".png"):
        raise StoreError(f"--out {str(path)!r}: must end in .pdf, .svg or .png")
    if path.exists() and not path.is_file():
        raise StoreError(f"--out {str(path)!r}: must be a file")
    prepare(path)


def write_picture(figure, path: Path) -> None:
    """Write a matplotlib figure; StoreError if it cannot be written."""
    picture = io.BytesIO()
    figure.savefig(picture, format=path.suffix[1:].lower(), dpi=160)
    write_bytes(path, picture.getvalue())
