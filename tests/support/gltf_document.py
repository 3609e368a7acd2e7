"""A builder of glTF documents for tests.

NumPy arrays become accessors; all other parts are written as JSON.
"""

from __future__ import annotations

import io
import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import raycam
from PIL import Image

KINDS = {(): "SCALAR", (2,): "VEC2", (3,): "VEC3", (4,): "VEC4", (4, 4): "MAT4"}
COMPONENTS = {"int8": 5120, "uint8": 5121, "int16": 5122, "uint16": 5123, "uint32": 5125, "float32": 5126}

TRIANGLE = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], np.float32)
SQUARE = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], np.float32)
SQUARE_CORNERS = np.array([0, 1, 2, 0, 2, 3], np.uint16)
# v runs downwards, as in glTF: the square's top left corner is (0, 0).
SQUARE_UVS = np.array([[0, 1], [1, 1], [1, 0], [0, 0]], np.float32)
# An image of 2 x 2 pixels without any symmetry.
ARROWS = [[[255, 0, 0], [0, 255, 0]], [[0, 0, 255], [90, 120, 33]]]


class Document:
    """A document under construction; each method returns the index of the added element."""

    def __init__(self) -> None:
        self.json: dict[str, Any] = {"asset": {"version": "2.0"}}
        self.binary = bytearray()

    def add(self, kind: str, **item: Any) -> int:
        """Adds an item to one of the top-level lists."""
        items = self.json.setdefault(kind, [])
        items.append(item)
        return len(items) - 1

    def use(self, *extensions: str, required: bool = False) -> None:
        """Declares extensions."""
        for key in ["extensionsUsed"] + ["extensionsRequired"] * required:
            self.json.setdefault(key, []).extend(extensions)

    def view(self, data: bytes, **keys: Any) -> int:
        """A buffer view of these bytes."""
        self.binary += bytes(-len(self.binary) % 4)
        start = len(self.binary)
        self.binary += data
        return self.add("bufferViews", buffer=0, byteOffset=start, byteLength=len(data), **keys)

    def accessor(self, array: npt.NDArray[Any], *, stride: int = 0, **keys: Any) -> int:
        """Adds an accessor of this array [n, ...], with elements `stride` bytes apart if given."""
        array = np.asarray(array)
        element = array.itemsize * int(np.prod(array.shape[1:]))
        data = array.tobytes()
        view = {}
        if stride:
            rows = [data[i : i + element].ljust(stride, b"\xaa") for i in range(0, len(data), element)]
            data, view = b"".join(rows), {"byteStride": stride}
        return self.describe(array, bufferView=self.view(data, **view), **keys)

    def describe(self, array: npt.NDArray[Any], **keys: Any) -> int:
        """Adds an accessor with the type and bounds of this array, without data."""
        flat = array.reshape(len(array), -1)
        bounds = {"min": flat.min(0).tolist(), "max": flat.max(0).tolist()}
        return self.add(
            "accessors",
            componentType=COMPONENTS[array.dtype.name],
            type=KINDS[array.shape[1:]],
            count=len(array),
            **bounds,
            **keys,
        )

    def mesh(self, attributes: dict[str, Any], indices: Any = None, **keys: Any) -> int:
        """Adds a mesh of one primitive; attributes are arrays or accessors."""
        given = {
            name: value if isinstance(value, int) else self.accessor(value)
            for name, value in attributes.items()
        }
        if indices is not None:
            keys["indices"] = indices if isinstance(indices, int) else self.accessor(indices)
        return self.add("meshes", primitives=[{"attributes": given, **keys}])

    def square(self, **material: Any) -> int:
        """Adds a square mesh from -1 to 1 that faces +z, with texture coordinates."""
        keys = {"material": self.add("materials", **material)} if material else {}
        return self.mesh({"POSITION": SQUARE, "TEXCOORD_0": SQUARE_UVS}, SQUARE_CORNERS, **keys)

    def node(self, **keys: Any) -> int:
        """A node."""
        return self.add("nodes", **keys)

    def glb(self) -> bytes:
        """The document as a GLB file, all root nodes in its scene."""
        if self.binary:
            self.json["buffers"] = [{"byteLength": len(self.binary)}]
        text = json.dumps(self.json).encode()
        text += b" " * (-len(text) % 4)
        binary = bytes(self.binary) + bytes(-len(self.binary) % 4)
        chunks = struct.pack("<I4s", len(text), b"JSON") + text
        if binary:
            chunks += struct.pack("<I4s", len(binary), b"BIN\0") + binary
        return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks

    def save(self, path: Path) -> Path:
        """Writes the GLB."""
        path.write_bytes(self.glb())
        return path


def variant_square() -> Document:
    """A green square that is red in the material variant "red"."""
    document = Document()
    document.use("KHR_materials_variants")
    document.json["extensions"] = {"KHR_materials_variants": {"variants": [{"name": "red"}]}}
    red = document.add("materials", pbrMetallicRoughness={"baseColorFactor": [1, 0, 0, 1]})
    mesh = document.square(pbrMetallicRoughness={"baseColorFactor": [0, 1, 0, 1]})
    mappings = [{"material": red, "variants": [0]}]
    primitive = document.json["meshes"][mesh]["primitives"][0]
    primitive["extensions"] = {"KHR_materials_variants": {"mappings": mappings}}
    document.node(mesh=mesh)
    return document


def parse(data: bytes) -> tuple[dict[str, Any], bytes]:
    """The JSON and the binary chunk of a GLB file."""
    magic, version, length = struct.unpack_from("<4sII", data)
    assert (magic, version, length) == (b"glTF", 2, len(data))
    size, kind = struct.unpack_from("<I4s", data, 12)
    assert kind == b"JSON"
    return json.loads(data[20 : 20 + size]), data[28 + size :]


def values(document: dict[str, Any], binary: bytes, index: int) -> npt.NDArray[Any]:
    """The values [n, ...] of an accessor without sparse or strided data in a GLB file."""
    accessor = document["accessors"][index]
    view = document["bufferViews"][accessor["bufferView"]]
    kinds = {kind: shape for shape, kind in KINDS.items()}
    kind = next(name for name, code in COMPONENTS.items() if code == accessor["componentType"])
    start = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
    shape = (accessor["count"], *kinds[accessor["type"]])
    count = int(np.prod(shape))
    return np.frombuffer(binary, kind, count, start).reshape(shape)


def load(document: Document, path: Path, **keys: Any) -> raycam.World:
    return raycam.load(document.save(path / "model.glb"), **keys)


def png(pixels: Any, **keys: Any) -> bytes:
    file = io.BytesIO()
    Image.fromarray(np.asarray(pixels, np.uint8)).save(file, "PNG", **keys)
    return file.getvalue()


def seen(world: raycam.World, *, size: int = 8, **keys: Any) -> Any:
    """The base colours of the square from -1 to 1, as bytes [size, size, 3], row 0 at its top."""
    camera = raycam.Camera.look_at([0, 0, 2], [0, 0, 0], [0, 1, 0], size=(size, size), fov=2 * 26.5650512)
    frame = raycam.render(world, camera, integrator="flat", samples=1, **keys)
    return frame.to_srgb8()


def animated(document: Document, path: str, times: Any, output: Any, *, node: int, **keys: Any) -> None:
    """An animation of one channel."""
    sampler = {
        "input": document.accessor(np.asarray(times, np.float32)),
        "output": document.accessor(np.asarray(output, np.float32)),
        **keys,
    }
    channel = {"sampler": 0, "target": {"node": node, "path": path}}
    document.add("animations", samplers=[sampler], channels=[channel], name=f"{path} of {node}")
