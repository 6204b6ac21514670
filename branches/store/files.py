"""Write files as a whole: at any time the file on disk has its old content or its new one."""

from __future__ import annotations

import contextlib
import glob
import io
import os
import platform
import time
from collections.abc import Iterator, Sequence
from pathlib import Path

from filelock import FileLock, Timeout

from branches.store import interrupt
from branches.store.command import StoreError, typed
from contin.lowlevel import meant, temporary_name, write_whole

#: Bytes of the smallest result; as many are written to test the disk before a computation.
_SMALLEST = 64 * 1024


#: What can be done where a folder holds another diagram.
ANOTHER_DIAGRAM = "--overwrite replaces its diagram, --out writes elsewhere"


def another_scene(folder: Path, reason: str) -> StoreError:
    """Return what is raised where a folder holds the diagram of another scene."""
    return StoreError(f"{str(folder)!r} holds another scene ({reason}); {ANOTHER_DIAGRAM}")


def write_bytes(path: Path, data: bytes) -> None:
    """Replace a file, or the one it links to, as a whole, with its mode; or leave it unchanged and raise StoreError."""
    try:
        with interrupt.held():
            write_whole(path, data)
    except OSError as error:
        raise StoreError(f"cannot write {str(path)!r}: {error.strerror}") from error


#: The file of a diagram in its folder.
DIAGRAM = "diagram.json"
#: Endings of the files of branches; the first one is that of files which are not named.
BRANCHES = (".h5", ".hdf5")
#: Endings of files: a folder with such a name would be taken for one.
_OF_FILES = (*BRANCHES, ".csv", ".htm", ".html", ".json", ".npz", ".pdf", ".png", ".svg", ".yaml", ".yml")


def check_name(path: Path, endings: Sequence[str], option: str = "--out", instead: str = "") -> None:
    """Raise StoreError if ``path`` has none of these endings, or is no file; ``instead`` says what else could be named."""
    if path.suffix.lower() not in endings:
        known = " or ".join(filter(None, (", ".join(endings[:-1]), endings[-1])))
        raise StoreError(f"{option} {str(path)!r}: must end in {known}{instead}")
    if path.exists() and not path.is_file():
        raise StoreError(f"{option} {str(path)!r}: must be a file")


def check_folder_name(path: Path) -> None:
    """Raise StoreError if ``path`` is no folder and no name for one."""
    if path.exists() and not path.is_dir():
        raise StoreError(f"--out {str(path)!r}: must be a folder, and is a file")
    if path.suffix.lower() in _OF_FILES:
        raise StoreError(f"--out {str(path)!r}: must be a folder, as in {path.stem!r}; this is a name of a file")


def absent(path: Path) -> str:
    """Return that there is no such file, and the one beside it that was probably meant."""
    from branches.scene.parse import scenes

    beside = [one.name for one in path.parent.iterdir()] if path.parent.is_dir() else []
    near = meant(path.name, beside)
    if not near and str(path) in {scene.stem for scene in scenes()}:
        near = f"; it is the name of a scene: {typed('run')} {path}"
    return f"there is no such file{near}"


def no_branch(path: Path) -> str:
    """Return what a path is that is not the file of a branch, and what to do."""
    if not path.exists():
        return absent(path)
    if path.is_dir():
        found = sorted(file for file in path.iterdir() if file.suffix in BRANCHES)
        return f"it is a folder; name one of its branches, such as {found[0]}" if found else "it is a folder, without branches"
    if path.suffix in (".yaml", ".yml"):
        return f"it is a scene; compute its result first: {typed('run')} {path}"
    if path.suffix == ".npz":
        return f"it is a file of contin.save, which {typed('explore')} {path} shows and contin.load(...).plot() draws"
    return "it is not a readable HDF5 file"


def no_diagram(path: Path) -> str:
    """Return what a path is that is not a diagram, and what to do."""
    if path.name == DIAGRAM and path.parent.is_dir() and not path.exists():
        return f"the folder holds no {DIAGRAM}, which a scene of many branches writes"
    if not path.exists():
        return absent(path)
    if path.suffix in BRANCHES:
        return f"it is one branch, not a diagram; {typed('plot')} {path} draws it"
    return "it is not a diagram written by this program"


#: Locks that this process holds, by the file locked.
_held: dict[Path, FileLock] = {}

#: Seconds to wait for a lock. A run that is killed while it forks a worker keeps its lock for up to 11 ms (measured), and
#: a run that ends may be removing its lock file. If it is ten times larger, a refusal takes half a second.
_PATIENCE = 0.05


@contextlib.contextmanager
def only_run(path: Path) -> Iterator[None]:
    """Lock ``path`` for this run; another run, of this process or of any other that uses the folder, is refused.

    The lock is the operating system's, on a hidden file beside ``path``. It ends with the process in all cases, and a
    remaining lock file has no effect. On a file system without locks nothing is locked. Raises StoreError where another run
    holds the lock.
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


def _lock(path: Path) -> bool:
    """Take the lock; return False if another run has it.

    Forked workers inherit the lock. Since version 3.30, filelock closes it in them, so that it ends with this process.
    """
    if not os.path.isdir(path.parent):
        return True  # FileLock would make the folder
    lock = FileLock(_lock_file(path), _PATIENCE, thread_local=False, fallback_to_soft=False, on_acquired=_sign)
    try:
        lock.acquire()
    except Timeout:
        return False
    except OSError:
        return True  # a folder that cannot be written, or that has no locks
    _held[path] = lock
    return True


def _sign(descriptor: int) -> None:
    """Write the holder of the lock into the lock file, after its first byte, which Windows does not let others read."""
    with contextlib.suppress(OSError):  # a full disk
        os.ftruncate(descriptor, 0)
        os.write(descriptor, f"\nprocess {os.getpid()} on {platform.node()}".encode())


def _holder(path: Path) -> str:
    """Return the holder of the lock, or 'unknown'."""
    if path in _held:
        return "of this process"
    try:
        with open(_lock_file(path), "rb") as file:
            file.seek(1)
            text = file.read(200).decode("utf-8", "replace")
    except OSError:
        text = ""
    return text if text and text.isprintable() else "unknown"


def _unlock(path: Path) -> None:
    lock = _held.pop(path, None)
    if lock is not None and lock.is_locked:  # a forked worker does not hold it
        with contextlib.suppress(OSError):  # on Windows FileLock removes the file, after it is closed
            _lock_file(path).unlink()
        with contextlib.suppress(OSError):
            lock.release()


def unlock_all() -> None:
    """Release all locks, for a process that ends without unwinding."""
    for path in list(_held):
        _unlock(path)


interrupt.at_last(unlock_all)


def prepare(path: Path) -> None:
    """Make the folder of ``path``, remove files of killed runs; raise StoreError where no result can be written there."""
    path = Path(os.path.realpath(path))
    try:
        if path.parent.exists() and not path.parent.is_dir():
            raise StoreError(f"cannot write {str(path)!r}: {str(path.parent)!r} is not a folder")
        path.parent.mkdir(parents=True, exist_ok=True)
        if path.exists() and not os.access(path, os.W_OK):
            raise StoreError(f"cannot write {str(path)!r}: the file is read-only")
        probe = temporary_name(path)
        with interrupt.held():
            try:
                write_whole(probe, bytes(_SMALLEST))
            finally:
                probe.unlink(missing_ok=True)
        for left in path.parent.glob(f".{glob.escape(path.name[:50])}.????????.part"):
            if time.time() - left.stat().st_mtime > 60:  # no run is writing it now
                left.unlink()
    except OSError as error:
        raise StoreError(f"cannot write {str(path)!r}: {error.strerror}") from error


def check_picture(path: Path, option: str = "--out") -> None:
    """Raise StoreError if ``path`` is not a picture that can be written."""
    check_name(path, (".pdf", ".svg", ".png"), option)
    prepare(path)


#: How pictures are written. PDF: whole fonts (Type 42), which other programs can edit; SVG: letters as outlines, which look the
#: same without the font, and the same names in the file for the same picture. Minus signs are minus signs, not hyphens.
_STYLE = {"pdf.fonttype": 42, "ps.fonttype": 42, "svg.fonttype": "path", "svg.hashsalt": "branches", "axes.unicode_minus": True}


def write_picture(figure, path: Path) -> None:
    """Write a matplotlib figure, the same bytes for the same figure; raise StoreError if it cannot be written."""
    from matplotlib import rc_context

    picture, suffix = io.BytesIO(), path.suffix[1:].lower()
    metadata = {"pdf": {"CreationDate": None}, "svg": {"Date": None}}.get(suffix)
    with rc_context(_STYLE):
        figure.savefig(picture, format=suffix, dpi=160, metadata=metadata)
    write_bytes(path, picture.getvalue())
