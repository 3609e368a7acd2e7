"""The result of baking, and its files."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from .. import _core
from ..arguments import Bools, Floats, real
from ..errors import SettingsError
from ..io.atomic_files import write
from ..one_line import one_line
from ..world import World
from .light import LIGHT_MAPS
from .settings import ID_MAPS

__all__ = ["BakedMaps"]

UNIT_MAPS = ("ao", "roughness", "metallic")
"""Maps of values from 0 to 1, which are PNG files."""
MAX_PNG_ID = 65534
"""Largest id that a PNG file with 16 bits can contain; the value 0 marks texels without a surface."""


@one_line
@dataclass(frozen=True, eq=False)
class BakedMaps(Mapping[str, npt.NDArray[Any]]):
    """The result of `bake`: an object's maps by name, and the covered texels.

    Maps are arrays [h, w] or [h, w, 3]; with `to="vertices"`, they are [v] or [v, 3].

    ============== ========= =======================================================================================
    position       float32   the point in the world, metres
    normal         float32   the face's unit normal in the world
    shading_normal float32   the interpolated unit normal in the world; the face's for flat faces
    tangent_normal float32   the shading normal in MikkTSpace's tangent space: x along u, y up the image as in glTF and
                             OpenGL, or down as in DirectX with `green="down"`
    ao             float32   the cosine-weighted share of the hemisphere around the normal that is free within
                             `distance` metres, from `samples` rays: 1 is open, 0 closed
    bent_normal    float32   the mean free direction, unit; the normal if none is free
    thickness      float32   the mean distance to the next surface inside, cosine-weighted within `cone` degrees around
                             the reversed normal: 180 is the hemisphere, 120 the shape diameter function (Shapira et
                             al. 2008); rays without a hit count as `distance`, or are ignored if it is infinite
    curvature      float32   the mean curvature, 1/metre, positive where convex (Meyer et al. 2003)
    irradiance     float32   all light that arrives around the shading normal, linear, W/m², path traced with `samples`
                             paths of at most `max_depth` segments
    direct         float32   the part of the irradiance that arrives without a bounce
    radiance       float32   the light that leaves along the normal, linear, W/(m² sr)
    albedo         float32   the base colour of `source`, linear
    roughness      float32   the perceptual roughness of `source`; 1 for materials without a glossy lobe
    metallic       float32   1 for metals of `source`
    emission       float32   the emitted radiance of `source`, linear, W/(m² sr)
    instance       int32     the object's id, -1 without a surface
    material       int32     the material's number, as in the channel `material`, -1 without a surface
    triangle       int32     the face's index in the mesh, -1 without a surface
    ============== ========= =======================================================================================
    """

    maps: dict[str, npt.NDArray[Any]] = field(repr=False)
    """The arrays by name."""
    covered: Bools = field(repr=False)
    """True [h, w] for texels whose centre is inside a face, False in gutters; True [v] for vertices."""
    overlapping: int
    """The number of texels that are inside several faces."""
    missed: Bools = field(repr=False)
    """True [h, w] or [v] for points near which the source has no surface; they have the object's own values."""
    vertices: Floats | None = field(default=None, repr=False)
    """Positions of the vertices [v, 3] in the world, metres; None for textures."""
    faces: npt.NDArray[np.int32] | None = field(default=None, repr=False)
    """Vertices of the faces [f, 3]; None for textures."""
    up: Literal["z", "y"] = field(default="z", repr=False)
    """The world's upward axis, "z" or "y"."""

    def __getitem__(self, name: str) -> npt.NDArray[Any]:
        """Returns the map with this name."""
        return self.maps[name]

    def __iter__(self) -> Any:
        """Iterates over the names of the maps."""
        return iter(self.maps)

    def __len__(self) -> int:
        """The number of maps."""
        return len(self.maps)

    def to_world(self, name: str, low: float = 0.0, high: float = 1.0) -> World:
        """Returns a world with the object as an unlit mesh, coloured by the map `name`.

        The map's values become vertex colours and are scaled linearly: `low` becomes 0 (black), `high`
        becomes 1. Requires maps of vertices. Raises `SettingsError` for maps of textures, an unknown map, and
        values outside `low` to `high`.
        """
        if self.vertices is None or self.faces is None:
            raise SettingsError(
                'these maps are textures; vertex colours require to="vertices" (--to vertices)',
                code="missing_value",
            )
        if name not in self.maps:
            raise SettingsError(
                f"map {name!r} is missing; options: {', '.join(self.maps)}", code="unknown_name"
            )
        low, high = real("low", low, what="a number"), real("high", high, what="a number")
        values = self.maps[name].astype(np.float64)
        smallest, largest = float(values.min(initial=np.inf)), float(values.max(initial=-np.inf))
        if not low < high or smallest < low or largest > high:
            raise SettingsError(
                f"map {name!r} has values from {smallest:.6g} to {largest:.6g}, outside the range from low = "
                f"{low:g} to high = {high:g}; use a smaller low or a larger high",
                code="out_of_range",
            )
        shares = (values - low) / (high - low)
        colors = np.repeat(shares[:, None], 3, axis=1) if shares.ndim == 1 else shares
        made = World(self.up)
        made.add_mesh(self.vertices, self.faces, vertex_colors=colors, material={"type": "unlit"})
        return made

    def save(self, folder: str | os.PathLike[str]) -> list[Path]:
        """Writes each map into a folder; returns the paths.

        Textures of `ao`, `roughness`, `metallic` and `tangent_normal` are PNG files with 16 bits; ids are PNG files
        with 16 bits that contain id + 1, and 0 without a surface, or EXR files with int32 values for ids above 65,534;
        all other maps are EXR files with float32 values. Light and emission are the channels R, G and B; light has its
        standard error in the layer `error`. Maps of vertices are glTF files, NAME.glb, with vertex colours; values
        outside 0..1 are scaled to the map's range.
        """
        target = Path(folder)
        target.mkdir(parents=True, exist_ok=True)
        made = []
        for name in self.maps:
            if name.removesuffix("_error") in LIGHT_MAPS and name.endswith("_error"):
                continue
            path = target / f"{name}{self.ending(name)}"
            self.save_map(name, path)
            made.append(path)
        return made

    def ending(self, name: str) -> str:
        """The ending of a map's file: ".png", ".exr" or ".glb"."""
        if self.vertices is not None:
            return ".glb"
        is_id = name in ID_MAPS and self.maps[name].max(initial=-1) <= MAX_PNG_ID
        return ".png" if is_id or name in (*UNIT_MAPS, "tangent_normal") else ".exr"

    def save_map(self, name: str, path: str | os.PathLike[str]) -> None:
        """Writes the map `name` to the file `path`, which must have the ending that `save` uses.

        Raises `SettingsError` for another ending.
        """
        ending = self.ending(name)
        if Path(path).suffix.lower() != ending:
            raise SettingsError(
                f"map {name!r} must be saved as {ending}, got {os.fspath(path)!r}", code="unknown_format"
            )
        if self.vertices is not None:
            values = self.maps[name]
            low, high = min(0.0, float(values.min())), max(1.0, float(values.max()))
            self.to_world(name, low, high).to_gltf(path)
            return
        write(Path(path), bytes(self._encoded(name, ending)))

    def _encoded(self, name: str, ending: str) -> bytes:
        """Returns the bytes of the image file of a map."""
        values = self.maps[name]
        if ending == ".png":
            if name in ID_MAPS:
                return bytes(_core.encode_png((values + 1).astype(np.uint16)))
            shares = (values + 1) / 2 if name == "tangent_normal" else values
            return bytes(_core.encode_png(np.rint(np.clip(shares, 0, 1) * 65535).astype(np.uint16)))
        layer = "color" if name in (*LIGHT_MAPS, "emission") else name
        layers = [(layer, np.ascontiguousarray(values))]
        if name in LIGHT_MAPS:
            layers.append(("error", np.ascontiguousarray(self.maps[f"{name}_error"])))
        return bytes(_core.encode_exr(layers, False, None, []))
