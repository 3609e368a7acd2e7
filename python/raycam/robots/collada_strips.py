"""Strips and fans of Collada as separate triangles, because pycollada reads neither."""

from __future__ import annotations

import warnings
from typing import Any
from xml.etree import ElementTree

import numpy as np
import numpy.typing as npt

__all__ = ["STRIP_TAGS", "expand_strips"]

STRIP_TAGS = ("tristrips", "trifans")
BLOCK = 1 << 18
"""Number of indices that are written at a time, which limits the memory."""


def expand_strips(node: ElementTree.Element) -> None:
    """Converts an element `<tristrips>` or `<trifans>` to `<triangles>`.

    Triangles with a repeated corner, which join two strips, are omitted. Raises `ValueError` for indices that are not
    integers, and for incomplete corners.
    """
    width = 1 + max((int(each.get("offset", "0")) for each in node.iterfind("input")), default=0)
    parts = [np.zeros((0, 3, max(width, 1)), np.int64)]
    for strip in node.findall("p"):
        indices = _integers(strip.text or "")
        if width < 1 or len(indices) % width:
            raise ValueError(f"<p> has {len(indices)} indices, expected a multiple of {width}")
        corners = indices.reshape(-1, width)
        count = max(len(corners) - 2, 0)
        triangles = _fan(count) if node.tag == "trifans" else _strip(count)
        parts.append(corners[triangles])
        node.remove(strip)
    found = np.concatenate(parts)
    one, two, three = np.moveaxis(found, 1, 0)
    pairs = ((one, two), (two, three), (three, one))
    is_repeated = [(corner == other).all(axis=1) for corner, other in pairs]
    found = found[~np.any(is_repeated, axis=0)]
    node.tag = "triangles"
    node.set("count", str(len(found)))
    new: Any = type(node)("p")
    flat = found.ravel()
    blocks = (flat[first : first + BLOCK].tolist() for first in range(0, len(flat), BLOCK))
    new.text = " ".join(" ".join(map(str, block)) for block in blocks)
    node.append(new)


def _integers(text: str) -> npt.NDArray[np.int64]:
    """Returns the integers in a text; raises `ValueError` for other text."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")  # NumPy warns of text that is not an integer
            return np.fromstring(text, np.int64, sep=" ")
    except (DeprecationWarning, ValueError):
        raise ValueError("indices must be integers") from None


def _strip(count: int) -> npt.NDArray[np.int64]:
    """The corners [count, 3] of a strip's triangles; every second triangle has the reverse order."""
    numbers = np.arange(count)
    odd = numbers % 2
    return np.stack([numbers + odd, numbers + 1 - odd, numbers + 2], axis=1)


def _fan(count: int) -> npt.NDArray[np.int64]:
    """The corners [count, 3] of a fan's triangles."""
    numbers = np.arange(count)
    return np.stack([np.zeros(count, np.int64), numbers + 1, numbers + 2], axis=1)
