"""Measured points, which pictures draw over computed ones: a table of text whose first line names columns of the result."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from branches.scene.units import UNITS
from branches.store.files import StoreError, absent
from contin.lowlevel import one_of


def read_points(path: str | Path, units: Mapping[str, str]) -> dict[str, np.ndarray]:
    """Return the columns of a table of measured points, by name.

    Parameters
    ----------
    path : path
        A file of lines with commas, semicolons or tabs. The first line names columns, as in ``P [mN],error_P,B_y``: a unit is
        optional, and ``error_P`` are the errors of P. An empty place is a value that was not measured; # begins a comment.
    units : mapping of str to str
        Names of the columns that may stand in it, and their units.

    Raises
    ------
    StoreError
        The file cannot be read, names a column or a unit that the result does not have, or holds what is no finite number.
    """
    what = f"--points {str(path)!r}"
    try:
        text = Path(path).read_text(encoding="utf-8-sig")
        lines = [line for line in enumerate(text.splitlines(), 1) if line[1].strip() and not line[1].startswith("#")]
    except (OSError, UnicodeDecodeError) as error:
        told = absent(Path(path)) if isinstance(error, FileNotFoundError) else "it is not a readable text file"
        raise StoreError(f"{what}: {told}") from error
    if len(lines) < 2:
        raise StoreError(f"{what}: must hold a line of names of columns and lines of numbers; it has {len(lines)} lines")
    split = next((mark for mark in ";\t" if mark in lines[0][1]), ",")
    heads, found = [_head(what, head, units) for head in lines[0][1].split(split)], []
    names = [name for name, _ in heads]
    if twice := [name for name in names if names.count(name) > 1]:
        raise StoreError(f"{what}: the column {twice[0]!r} is named twice")
    for number, line in lines[1:]:
        texts = [text.strip(' "') for text in line.split(split)]
        if len(texts) != len(names):
            raise StoreError(f"{what}: line {number} has {len(texts)} values, and the first line names {len(names)} columns")
        for (name, size), text in zip(heads, texts):
            try:  # a decimal comma, where columns are not split at commas
                found.append(size * float(text.replace(",", ".")) if text else np.nan)
            except ValueError:
                raise StoreError(f"{what}: line {number}: {name}: {text!r} must be a number") from None
            if math.isinf(found[-1]) or (name.startswith("error_") and found[-1] < 0):
                allowed = "at least 0" if name.startswith("error_") else "a finite number"
                raise StoreError(f"{what}: line {number}: {name}: {text} must be {allowed}")
    return dict(zip(names, np.reshape(found, (-1, len(names))).T))


def _head(what: str, head: str, units: Mapping[str, str]) -> tuple[str, float]:
    """Return the name of a column in the first line and the size of its unit; raise StoreError for one of nothing."""
    name, _, unit = (part.strip(' "') for part in head.rstrip('] "').partition("["))
    of = name.removeprefix("error_")
    if of not in units:
        raise StoreError(f"{what}: {one_of(of, units, 'the columns ')}")
    sizes = {"": "1", units[of]: "1"} | UNITS.get(units[of], {})
    if unit not in sizes:
        raise StoreError(f"{what}: {name}: is given in {unit!r}, and must be in {units[of] or 'no unit'}")
    return name, float(sizes[unit])
