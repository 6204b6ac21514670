"""Numbers as short text, for the data of the page."""

from __future__ import annotations

import base64

import numpy as np

#: Largest error of a compressed value, relative to the largest value of its channel: a tenth of a pixel of a strip a thousand
#: pixels large. With a tenth of it the rounding to 16 bits (3e-5) is in the way; twice as much makes shapes 14 % smaller.
TOLERANCE = 1e-4
#: A product that contributes no more than this is kept in 8 bits a number, with an error of an eighth of `TOLERANCE`.
_SMALL = 127 * TOLERANCE / 8
#: Whole numbers by the letter that names their type on the page.
_WHOLE = {"b": "<i1", "h": "<i2", "i": "<i4"}


def packed(values, kind: str) -> str:
    """Numbers as base64 text, little-endian."""
    return base64.b64encode(np.ascontiguousarray(values, dtype=kind).tobytes()).decode()


def column(values: np.ndarray) -> str | float:
    """Return a column without loss: one number if it is constant, else a letter for the type (d, b, h, i) and base64 text."""
    if len(values) and (values == values[0]).all() and np.isfinite(values[0]):
        return values[0].item()
    if values.dtype.kind != "i":
        return "d" + packed(values, "<f8")
    letter = "bhi"[np.searchsorted([2**7, 2**15], np.abs(values).max(), side="right")]
    return letter + packed(values, _WHOLE[letter])


def compressed(values: np.ndarray, each: bool = False) -> dict:
    """Return values (points, nodes, channels) as sums of few products: a singular value decomposition along two directions.

    Neighbouring points of a branch have almost the same states, and states are smooth along the strip: with a basis of few
    functions of the nodes, and few products of a number for each point and one for each function and channel,

        values[p, i, c] = size[p, c] * sum over k, j of scale[k] left[k, p] right[k, j, c] basis[j, i].

    The size of a channel is its largest value on the branch, or with ``each`` that at each point.

    Returns
    -------
    dict
        ``nodes``, ``channels``; ``functions``, the number of functions; ``basis``, in 16 bits a number; ``products``, their
        number; ``left`` and ``right``, in 16 bits in the first ``wide`` products, in 8 bits in the others; ``scale``; ``size``.
    """
    points, nodes, channels = values.shape
    size = np.abs(values).max(axis=1 if each else (0, 1)).reshape(-1, channels)
    rest = values / np.where(size > 0, size, 1.0)[:, None]
    basis, coefficients = _along_nodes(rest)
    reduced = coefficients.transpose(1, 0, 2).reshape(points, -1)
    _, vectors = np.linalg.eigh(reduced @ reduced.T)  # its square has half the digits, of which four are wanted
    left, right, scale, wide = [], [], [], 0
    for column, row in zip(vectors.T[::-1], (vectors.T @ reduced)[::-1]):
        share = np.abs(column).max() * np.abs(basis.T @ row.reshape(-1, channels)).max()
        if np.abs(rest).max() <= TOLERANCE or share < TOLERANCE / 20:
            break
        wide += int(share > _SMALL)
        (a, by), (b, times) = (_whole(part, 32767 if share > _SMALL else 127) for part in (column, row))
        left.append(a)
        right.append(b)
        scale.append(by * times)
        rest = rest - np.multiply.outer(a * scale[-1], basis.T @ b.reshape(-1, channels))
    return {
        "nodes": nodes, "channels": channels, "functions": len(basis), "basis": packed(np.round(32767 * basis), "<i2"),
        "products": len(scale), "wide": wide, "left": _mixed(left, wide), "right": _mixed(right, wide),
        "scale": packed(scale, "<f8"), "size": packed(size, "<f8"),
    }  # fmt: skip


def _along_nodes(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return functions of the nodes (functions, nodes), in 16 bits, and the coefficients (functions, points, channels)."""
    table = values.transpose(1, 0, 2).reshape(values.shape[1], -1)
    _, vectors = np.linalg.eigh(table @ table.T)
    basis = vectors.T[::-1]
    basis = np.round(32767 * basis / np.abs(basis).max(axis=1, keepdims=True)) / 32767
    for count in range(1, len(basis) + 1):
        coefficients = np.linalg.lstsq(basis[:count].T, table, rcond=None)[0]
        if np.abs(table - basis[:count].T @ coefficients).max() <= TOLERANCE / 2:
            break
    return basis[:count], coefficients.reshape(count, len(values), -1)


def _mixed(rows: list[np.ndarray], wide: int) -> str:
    """Return whole numbers as base64 text, those of the first ``wide`` rows in 16 bits and the others in 8."""
    parts = (np.array(rows[:wide], "<i2"), np.array(rows[wide:], "<i1"))
    return base64.b64encode(b"".join(part.tobytes() for part in parts)).decode()


def _whole(values: np.ndarray, largest: int) -> tuple[np.ndarray, float]:
    """Return whole numbers up to ``largest``, and the scale that they are to be multiplied by."""
    scale = np.abs(values).max() / largest or 1.0
    return np.round(values / scale), scale
