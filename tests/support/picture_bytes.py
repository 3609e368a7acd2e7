"""Small images whose bytes are equal on every machine, and hashes of their channels."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Any

import numpy as np
import raycam

HASHES = Path(__file__).parents[1] / "data" / "picture_bytes.json"
LIGHTS = {
    "sun": '[[light]]\ntype = "sun"\ndirection = [-1, 1, -2]\nirradiance = [3, 3, 3]\n',
    "bulb": '[[light]]\ntype = "point"\nposition = [1, -2, 3]\nradius = 0.4\nintensity = [40, 30, 20]\n',
    "none": "",
}
MATERIALS = {
    "matte": "color = '#c83c28'",
    "metal": "type = 'metal'\nmetal = 'gold'\nroughness = 0.3",
    "glass": "type = 'glass'\nior = 1.5",
    "lamp": "color = [0.6, 0.5, 0.1]\nemission = 0.7",
    "copper": "type = 'metal'\nmetal = 'copper'\nroughness = 0.15",
    "glossy": "color = [0.2, 0.3, 0.6]\nspecular = [0.3, 0.3, 0.3]\nshininess = 40",
}
OTHERWISE = {"glossy": 0.01, "lamp": 0.2}
"""Fractions of values that may differ by 1e-6, by material: highlights are powers and glowing meshes are chosen by
angles, which mathematical libraries round differently."""
PICTURES = [
    (light, material, integrator, samples)
    for light in LIGHTS
    for material in MATERIALS
    for integrator, samples in (("direct", 4), ("path", 2))
]
Picture = tuple[str, str, str, int]


def world_text(light: str, material: str) -> str:
    """A small world: a ball on a floor."""
    return (
        f"[[object]]\nname = 'ball'\nsphere = {{ radius = 1 }}\nlocation = [0, 0, 1]\n{MATERIALS[material]}\n"
        "[[object]]\nname = 'floor'\ncategory = 'ground'\nplane = { size = [9, 9] }\n"
        f"{LIGHTS[light]}"
        "[camera]\nlocation = [4, -4, 3]\ntarget = [0, 0, 0.6]\nsize = [40, 30]\nfov = 45\n"
    )


def options(number: int) -> dict[str, Any]:
    """The render options of an image."""
    _, _, integrator, samples = PICTURES[number]
    return {"integrator": integrator, "samples": samples, "seed": number}


def render(number: int, folder: Path, **more: Any) -> tuple[raycam.World, raycam.Frame]:
    """An image's world, loaded from a file in a folder, and its frame with all channels."""
    light, material, _, _ = PICTURES[number]
    path = folder / f"{number}.toml"
    path.write_text(world_text(light, material))
    world = raycam.load(path)
    return world, raycam.render(world, channels="all", **options(number), **more)


def may_differ(number: int, channel: str) -> bool:
    """True for channels whose values may differ between machines."""
    return PICTURES[number][1] in OTHERWISE and channel in ("color", "error")


def label(number: int) -> str:
    """The name of an image in the file of hashes."""
    light, material, integrator, samples = PICTURES[number]
    return f"{light}, {material}, {integrator}, {samples}"


def digest(array: np.ndarray[Any, Any]) -> str:
    """A hash of a channel's bytes, with all NaN made equal."""
    if array.dtype.kind == "f":
        array = np.where(np.isnan(array), array.dtype.type(np.nan), array)
    return hashlib.sha256(np.ascontiguousarray(array).tobytes()).hexdigest()[:16]


def digests(number: int, frame: raycam.Frame) -> dict[str, str]:
    """The hashes of the channels that are equal on every machine."""
    return {name: digest(frame[name]) for name in sorted(frame) if not may_differ(number, name)}


def kept() -> dict[str, dict[str, str]]:
    """The hashes in the file."""
    found: dict[str, dict[str, str]] = json.loads(HASHES.read_text(encoding="utf-8"))
    return found
