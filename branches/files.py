"""Files replaced whole: what is on disk is the old content or the new one, at any instant."""

from __future__ import annotations

import contextlib
import errno
import glob
import io
import os
import platform
import time
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

from contin import temporary_name, write_whole

#: Bytes that the smallest result takes, for a look at the disk before anything is computed.
_SMALLEST = 64 * 1024


class StoreError(Exception):
    """A file that cannot be written or read; the message is one sentence."""


def write_bytes(path: Path, data: bytes) -> None:
    """Put a whole file in place of ``path`` (of what it links to), with its mode, or leave everything as it was.

    Raises
    ------
    StoreError
        It cannot be written.
    """
    try:
        write_whole(path, data)
    except OSError as error:
        raise StoreError(f"cannot write {str(path)!r}: {error.strerror}") from error


#: Locks that this process holds: the file locked, and the open lock file beside it.
_held: dict[Path, BinaryIO] = {}


@contextlib.contextmanager
def only_run(path: Path) -> Iterator[None]:
    """Be the only run that writes ``path``; another one, of this process or of any other that sees the folder, is refused.

    The lock is the operating system's, on a hidden file beside ``path``: it ends with the process, however that ends, and a
    lock file left behind blocks nobody. Where there are no locks (a file system without them, say) nothing is locked.

    Raises
    ------
    StoreError
        Another run holds the lock.
    """
    path = Path(os.path.realpath(path))
    if path in _held or not _lock(path):
        raise StoreError(
            f"another run ({_holder(path)}) is writing {str(path)!r}; wait for its end, or write elsewhere with --out"
        )
    try:
        yield
    finally:
        _unlock(path)


def _lock_file(path: Path) -> Path:
    return path.with_name(f".{path.name[:50]}.lock")


def _is_open_as(name: Path, file) -> bool:
    """Whether the open file is the one that has this name (now; another process may remove it at any time)."""
    try:
        return os.path.samestat(os.fstat(file.fileno()), name.stat())
    except FileNotFoundError:
        return False


def _lock(path: Path) -> bool:
    """Take the lock; False if another process has it."""
    name = _lock_file(path)
    while True:
        try:
            file = open(name, "a+b")  # noqa: SIM115 - open as long as the lock is held
        except OSError:
            return True  # no folder, or one that cannot be written: there is nothing to protect
        try:
            _lock_open_file(file)
        except OSError as error:
            file.close()
            return error.errno not in (errno.EACCES, errno.EAGAIN, errno.EDEADLK)
        if _is_open_as(name, file):
            break
        file.close()  # the run that had it removed it just now
    with contextlib.suppress(OSError):  # a full disk
        file.truncate(0)
        file.write(f"process {os.getpid()} on {platform.node()}".encode())
        file.flush()
    _held[path] = file
    return True


def _lock_open_file(file: BinaryIO) -> None:
    """OSError if another process has locked it. These locks are not inherited by processes that this one starts."""
    try:
        import fcntl
    except ImportError:  # Windows
        import msvcrt

        file.seek(1_000_000)  # beyond what is written there, which others may then read
        msvcrt.locking(file.fileno(), msvcrt.LK_NBLCK, 1)
    else:
        fcntl.lockf(file, fcntl.LOCK_EX | fcntl.LOCK_NB)


def _unlock(path: Path) -> None:
    file = _held.pop(path, None)
    if file is None:
        return
    name = _lock_file(path)
    with contextlib.suppress(OSError):  # where an open file cannot be removed, after it is closed
        name.unlink()
    with contextlib.suppress(OSError):
        file.close()
        if os.name == "nt":
            name.unlink()


def unlock_all() -> None:
    """Give up all locks, for a process that leaves without unwinding."""
    for path in list(_held):
        _unlock(path)


def _holder(path: Path) -> str:
    """Who has the lock, as far as that is known."""
    if path in _held:  # and is kept: to close the file once more would give the lock up
        return "of this process"
    try:
        text = _lock_file(path).read_bytes()[:200].decode("utf-8", "replace")
    except OSError:
        text = ""
    return text if text and text.isprintable() else "unknown"


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
        probe = temporary_name(path)
        try:
            write_whole(probe, bytes(_SMALLEST))
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
