"""Measured points, which pictures draw over computed ones: a table of text whose first line names columns of the result."""

from __future__ import annotations

import csv
import re
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from branches.store.files import StoreError, absent
from contin.lowlevel import one_of


def read_points(path: str | Path, units: Mapping[str, str]) -> dict[str, np.ndarray]:
    """Return the columns of a table of measured points, by name.

    Parameters
    ----------
    path : path
        A file of lines with commas, semicolons or tabs. The first line names columns, as in ``P [N],error_P,B_y``: a unit is
        optional, and ``error_P`` are the errors of P. An empty place is a value that was not measured.
    units : mapping of str to str
        Names of the columns that may stand in it, and their units.

    Raises
    ------
    StoreError
        The file cannot be read, names a column or a unit that the result does not have, or holds text for a number.
    """
    what = f"--points {str(path)!r}"
    try:
        lines = Path(path).read_text(encoding="utf-8-sig").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        told = absent(Path(path)) if isinstance(error, FileNotFoundError) else "it is not a readable text file"
        raise StoreError(f"{what}: {told}") from error
    rows = [(number, line) for number, line in enumerate(lines, 1) if line.strip() and not line.startswith("#")]
    split = next((mark for mark in ";\t" if rows and mark in rows[0][1]), ",")
    table = [(number, [each.strip() for each in row]) for number, line in rows for row in csv.reader([line], delimiter=split)]
    if len(table) < 2:
        raise StoreError(f"{what}: must hold a line of names of columns and lines of numbers; it has {len(table)} lines")
    (_, heads), *body = table
    names = [_name(what, head, units) for head in heads]
    if twice := [name for name in names if names.count(name) > 1]:
        raise StoreError(f"{what}: the column {twice[0]!r} is named twice")
    for number, row in body:
        if len(row) != len(names):
            raise StoreError(f"{what}: line {number} has {len(row)} values, and the first line names {len(names)} columns")
    return {
        name: np.array([_number(f"{what}: line {number}: {name}", row[place], split) for number, row in body])
        for place, name in enumerate(names)
    }


def _name(what: str, head: str, units: Mapping[str, str]) -> str:
    """Return the name of a column in the first line; raise StoreError for one of nothing, or in another unit."""
    name, _, unit = (part.strip() for part in head.rstrip("] ").partition("["))
    of = name.removeprefix("error_")
    if of not in units:
        raise StoreError(f"{what}: {one_of(of, units, 'the columns ')}")
    if unit not in ("", units[of]):
        raise StoreError(f"{what}: {name}: is given in {unit!r}, and must be in {units[of] or 'no unit'}")
    return name


def _number(what: str, text: str, split: str) -> float:
    """Return a number, with a decimal comma where columns are not split at commas; nan for an empty text."""
    try:
        return float(re.sub(r"^([-+]?\d*),(?=\d)", r"\1.", text) if split != "," else text) if text else np.nan
    except ValueError:
        raise StoreError(f"{what}: {text!r} must be a number") from None
