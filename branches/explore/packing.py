"""Numbers as short text, for the data of the page."""

from __future__ import annotations

import base64

import numpy as np


def quantised(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Whole numbers of 16 bits, and the scales (points, channels) that they are to be multiplied by.

    ``values`` has the shape (points, nodes, channels). The error is at most half a scale, 1.6e-5 of a channel's largest value.
    """
    scale = np.abs(values).max(axis=1) / 32767
    return np.round(values / np.where(scale > 0, scale, 1.0)[:, None]).astype(np.int16), scale


def packed(values, kind: str) -> str:
    """Numbers as base64 text, little-endian."""
    return base64.b64encode(np.ascontiguousarray(values, dtype=kind).tobytes()).decode()
