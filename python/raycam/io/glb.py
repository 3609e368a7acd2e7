"""GLB files in memory, through which meshes of other libraries are imported."""

from __future__ import annotations

import json
import struct
from typing import Any

import numpy as np
import numpy.typing as npt

from .. import _core
from ..errors import FormatError

__all__ = ["GlbBuilder", "pack_glb"]

MAX_FILE_BYTES = 2**32 - 1
"""Largest size of a GLB file."""
_ACCESSOR_TYPES = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4"}


class GlbBuilder:
    """A glTF document under construction.

    The methods return the index of the added item (glTF 2.0, chapter 5).
    """

    def __init__(self) -> None:
        self._lists: dict[str, list[dict[str, Any]]] = {}
        self._parts: list[bytes] = []
        self._length = 0

    def add(self, kind: str, **item: Any) -> int:
        """Adds an item to one of the document's lists; keys that are None are omitted."""
        items = self._lists.setdefault(kind, [])
        items.append({key: value for key, value in item.items() if value is not None})
        return len(items) - 1

    def view(self, data: bytes) -> int:
        """Adds a buffer view of bytes."""
        start = self._length
        padded = data + bytes(-len(data) % 4)
        self._parts.append(padded)
        self._length += len(padded)
        return self.add("bufferViews", buffer=0, byteOffset=start, byteLength=len(data))

    def floats(self, values: npt.NDArray[Any]) -> int:
        """Adds an accessor of float32 elements [n, k]."""
        array = np.ascontiguousarray(values, dtype=np.float32)
        return self.add(
            "accessors",
            bufferView=self.view(array.tobytes()),
            componentType=5126,
            count=len(array),
            type=_ACCESSOR_TYPES[array.shape[1]],
            min=array.min(axis=0).tolist(),
            max=array.max(axis=0).tolist(),
        )

    def indices(self, faces: npt.NDArray[Any]) -> int:
        """Adds an accessor of vertex indices of triangles [m, 3]."""
        array = np.ascontiguousarray(faces, dtype=np.uint32).reshape(-1)
        view = self.view(array.tobytes())
        return self.add("accessors", bufferView=view, componentType=5125, count=array.size, type="SCALAR")

    def texture(self, pixels: npt.NDArray[np.uint8], name: str = "") -> int:
        """Adds a texture of an image [height, width, channels].

        The image has 1 to 4 channels; row 0 is the top.
        """
        pixels = np.ascontiguousarray(pixels if pixels.ndim == 3 else pixels[..., None], dtype=np.uint8)
        view = self.view(bytes(_core.encode_png(pixels)))
        image = self.add("images", bufferView=view, mimeType="image/png", name=name or None)
        return self.add("textures", source=image)

    def bytes(self) -> bytes:
        """The bytes of the file; its scene contains all nodes."""
        root: dict[str, Any] = {"asset": {"version": "2.0"}, **self._lists}
        if nodes := self._lists.get("nodes"):
            root |= {"scene": 0, "scenes": [{"nodes": list(range(len(nodes)))}]}
        return pack_glb(root, b"".join(self._parts))


def pack_glb(document: dict[str, Any], binary: bytes) -> bytes:
    """Returns a GLB file with a JSON document and its only buffer.

    The buffer is omitted if `binary` is empty (glTF 2.0, chapter 4). Sets `buffers` of the document unless
    the buffer is omitted. Raises `FormatError` if the file would exceed 4 GiB.
    """
    if binary:
        document["buffers"] = [{"byteLength": len(binary)}]
    text = json.dumps(document, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text
    if binary:
        padded = binary + bytes(-len(binary) % 4)
        chunks += struct.pack("<I4s", len(padded), b"BIN\0") + padded
    size = 12 + len(chunks)
    if size > MAX_FILE_BYTES:
        raise FormatError(f"GLB: the file would have {size} bytes; the maximum is 4 GiB", code="too_large")
    return struct.pack("<4sII", b"glTF", 2, size) + chunks
