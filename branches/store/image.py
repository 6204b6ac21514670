"""The image of an HDF5 file that is open in memory."""

from __future__ import annotations

import struct

import h5py

#: Bytes of the superblock that its checksum covers (versions 2 and 3, addresses of 8 bytes), where the checksum follows.
_COVERED = 44
#: Words of 32 bits.
_WORD = 0xFFFFFFFF


def image(file: h5py.File) -> bytes:
    """Return the content of a file that was flushed, as it would be on disk.

    HDF5 before 2.0 clears a mark in the superblock of the image, that the file is open, and leaves the checksum as it was with
    the mark: no version opens such a file. It is computed again.

    Examples
    --------
    >>> import io, h5py
    >>> with h5py.File.in_memory(libver="v110") as file:
    ...     file.attrs["n"] = 3
    ...     file.flush()
    ...     found = image(file)
    >>> int(h5py.File(io.BytesIO(found)).attrs["n"])
    3
    """
    found: bytes = file.id.get_file_image()
    return found[:_COVERED] + struct.pack("<I", checksum(found[:_COVERED])) + found[_COVERED + 4 :]


def checksum(data: bytes) -> int:
    """Return the checksum of HDF5's metadata: lookup3 of Bob Jenkins (2006), of data of 12 k + 8 bytes."""
    words = struct.unpack(f"<{len(data) // 4}I", data)
    a = b = c = (0xDEADBEEF + len(data)) & _WORD
    for i in range(0, len(words) - 2, 3):
        a, b, c = a + words[i], b + words[i + 1], c + words[i + 2]
        for turn in (4, 6, 8, 16, 19, 4):
            a, b, c = b, (c + b) & _WORD, ((a - c) & _WORD) ^ _turned(c, turn)
    a, b = a + words[-2], b + words[-1]
    for turn in (14, 11, 25, 16, 4, 14, 24):
        a, b, c = b, ((c ^ b) - _turned(b, turn)) & _WORD, a
    return b


def _turned(word: int, bits: int) -> int:
    word &= _WORD
    return (word << bits | word >> (32 - bits)) & _WORD
