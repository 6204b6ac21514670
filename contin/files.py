"""Files written whole: on disk there is the old content or the new one, at any instant."""

from __future__ import annotations

import os
import secrets
import shutil
from pathlib import Path

#: Characters of a file's name that the name of its temporary neighbour begins with: names may have 255 bytes in all, and a
#: character has up to four.
_KEPT = 50


def temporary_name(path: Path) -> Path:
    """Return a hidden name of its own beside ``path``, ending in ``.part``.

    Examples
    --------
    >>> name = temporary_name(Path("results") / "m1.h5").name
    >>> name.startswith(".m1.h5."), name.endswith(".part")
    (True, True)
    """
    return path.with_name(f".{path.name[:_KEPT]}.{secrets.token_hex(4)}.part")


def write_whole(path: str | Path, data: bytes) -> None:
    """Put a whole file in place of ``path`` (of what it links to), with its mode, or leave everything as it was.

    No process, and no power cut, ever sees half of it.

    Raises
    ------
    OSError
        It cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_whole(Path(folder) / "answer", b"42")
    ...     (Path(folder) / "answer").read_bytes()
    b'42'
    """
    path = Path(os.path.realpath(path))
    temporary = temporary_name(path)
    try:
        with open(temporary, "xb") as file:  # its mode is what the umask says
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        if path.exists():
            shutil.copymode(path, temporary)
        os.replace(temporary, path)
    except OSError as error:  # it names the neighbour
        raise OSError(error.errno, error.strerror, str(path)) from error
    finally:
        temporary.unlink(missing_ok=True)
