"""A plate deformed by a skin and a morph target, as a glTF file and as formulas."""

from __future__ import annotations

import base64
import json
from pathlib import Path

import numpy as np
import raycam

PLATE = np.array([[x, y, 0.0] for y in (0.0, 1.0, 2.0) for x in (-0.5, 0.5)])
FACES = np.array([[0, 1, 3], [0, 3, 2], [2, 3, 5], [2, 5, 4]])
BULGE = np.array([[0, 0, 0], [0, 0, 0], [0, 0, 0.3], [0, 0, 0.3], [0.1, 0, 0.4], [0.1, 0, 0.4]])


def bending_plate(folder: Path) -> raycam.World:
    """A plate that is bent by a joint, bulges and moves to the right.

    The joint at half of the plate's height turns the upper half. From 0 to 1 second, it turns by 90 degrees,
    the morph weight increases from 0 to 1, and the plate moves by 0.8 m.
    """
    half = np.sqrt(0.5)
    weights = np.zeros((6, 4), "<f4")
    weights[:, :2] = [[1, 0]] * 2 + [[0.5, 0.5]] * 2 + [[0, 1]] * 2
    inverse = np.tile(np.eye(4, dtype="<f4"), (2, 1, 1))
    inverse[1, 3, 1] = -1.0  # column major: the joint is at y = 1
    arrays: list[tuple[np.ndarray, int, str]] = [
        (PLATE.astype("<f4"), 5126, "VEC3"),
        (FACES.astype("<u2").ravel(), 5123, "SCALAR"),
        (BULGE.astype("<f4"), 5126, "VEC3"),
        (np.tile([0, 1, 0, 0], (6, 1)).astype("<u2"), 5123, "VEC4"),
        (weights, 5126, "VEC4"),
        (inverse, 5126, "MAT4"),
        (np.array([0.0, 1.0], "<f4"), 5126, "SCALAR"),
        (np.array([[0, 0, 0, 1], [0, 0, half, half]], "<f4"), 5126, "VEC4"),
        (np.array([0.0, 1.0], "<f4"), 5126, "SCALAR"),
        (np.array([[0, 0, 0], [0.8, 0, 0]], "<f4"), 5126, "VEC3"),
    ]
    data, views, accessors = b"", [], []
    for array, kind, shape in arrays:
        views.append({"buffer": 0, "byteOffset": len(data), "byteLength": array.nbytes})
        accessor = {"bufferView": len(views) - 1, "componentType": kind, "type": shape}
        count = array.size if shape == "SCALAR" else len(array)
        flat = array.reshape(count, -1)
        accessors.append(
            {**accessor, "count": count, "min": flat.min(0).tolist(), "max": flat.max(0).tolist()}
        )
        data += array.tobytes() + bytes(-array.nbytes % 4)

    def channel(sampler: int, node: int, path: str) -> dict[str, object]:
        return {"sampler": sampler, "target": {"node": node, "path": path}}

    primitive = {
        "attributes": {"POSITION": 0, "JOINTS_0": 3, "WEIGHTS_0": 4},
        "indices": 1,
        "targets": [{"POSITION": 2}],
    }
    model = {
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": [0, 1]}],
        "nodes": [{"mesh": 0, "skin": 0}, {"children": [2]}, {"translation": [0, 1, 0]}],
        "meshes": [{"primitives": [primitive], "weights": [0]}],
        "skins": [{"joints": [1, 2], "inverseBindMatrices": 5}],
        "animations": [
            {
                "samplers": [{"input": 6, "output": 7}, {"input": 6, "output": 8}, {"input": 6, "output": 9}],
                "channels": [
                    channel(0, 2, "rotation"),
                    channel(1, 0, "weights"),
                    channel(2, 1, "translation"),
                ],
            }
        ],
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [
            {
                "byteLength": len(data),
                "uri": "data:application/octet-stream;base64," + base64.b64encode(data).decode(),
            }
        ],
    }
    (folder / "plate.gltf").write_text(json.dumps(model))
    return raycam.load(folder / "plate.gltf")


def plate_at(time: float) -> np.ndarray:
    """The plate's vertices by the formulas of glTF.

    The morph target is applied first, then the weighted sum of the joint transforms.
    """
    morphed = PLATE + time * BULGE
    angle = np.pi / 2 * time
    turn = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
    upper = (morphed - [0, 1, 0]) @ turn.T + [0, 1, 0]
    weight = np.array([0, 0, 0.5, 0.5, 1, 1])[:, None]
    return (1 - weight) * morphed + weight * upper + [0.8 * time, 0, 0]
