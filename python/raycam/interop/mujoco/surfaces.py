"""Computes the colours of a MuJoCo model's surfaces as in MuJoCo's renderer.

Each surface has one colour, multiplied by filtered textures.
"""

from __future__ import annotations

from copy import copy
from typing import Any

import numpy as np
import numpy.typing as npt

from ...arguments import Floats
from ...srgb import linear_from_srgb
from .materials import element_look, is_opaque, surface_values
from .model import BOX, GEOM_OBJECT, PLANE
from .scene_geoms import SceneGeom
from .textures import is_cube, texture_pixels

__all__ = ["Surfaces", "texel_density"]

Single = npt.NDArray[np.float32]
SRGB = 2
"""The value of `mjtColorSpace` for textures that MuJoCo linearises, which makes them darker."""


class Surfaces:
    """Colours and light values of the objects of a world, by the number of the object."""

    def __init__(
        self,
        model: Any,
        elements: list[tuple[int, int]],
        densities: dict[int, tuple[int, Floats]],
        dynamic_alpha: float = 1.0,
    ) -> None:
        """Collects colours and light values of the model's `elements`.

        `densities` contains the texture and the texels per metre of each triangle [t] of textured objects.
        `dynamic_alpha` multiplies the opacity of elements that are not fixed to the world.
        """
        looks = [element_look(model, *element, dynamic_alpha) for element in elements]
        values = [surface_values(model, material) for _, material in looks]
        self._rgb = np.array([np.clip(rgba[:3], 0, 1) for rgba, _ in looks], np.float32).reshape(-1, 3)
        self.alpha = np.array([min(float(rgba[3]), 1.0) for rgba, _ in looks], np.float32)
        """The opacity of each object."""
        self.opaque = [number for number, (rgba, _) in enumerate(looks) if is_opaque(rgba)]
        """The objects without blending."""
        self.transparent = [number for number, (rgba, _) in enumerate(looks) if not is_opaque(rgba)]
        """The objects that are blended with the surfaces behind them."""
        self.emission = np.array([value.emission for value in values], np.float32)
        """The emitted share of the colour."""
        self.specular = np.array([value.specular for value in values], np.float32)
        """The strength of highlights."""
        self.exponent = np.array([128 * value.shininess for value in values], np.float32)
        """The exponent of highlights."""
        self.unlit: npt.NDArray[np.bool_] | None = None
        """True for objects that have their plain colour; None if all objects are lit."""
        self.shadowless: set[int] = set()
        """The objects that cast no shadows."""
        self.mirror: tuple[int, float] | None = None
        """The only object that reflects (the first opaque plane or box with a reflectance), and its reflectance."""
        for number in self.opaque:
            kind, geom = elements[number]
            flat = kind == GEOM_OBJECT and int(model.geom_type[geom]) in (PLANE, BOX)
            if flat and values[number].reflectance > 0:
                self.mirror = (number, values[number].reflectance)
                break
        used = {texture for texture, _ in densities.values()}
        pyramids = {texture: _Pyramid(model, texture) for texture in used}
        self._textures = {
            number: (pyramids[texture], density.astype(np.float32))
            for number, (texture, density) in densities.items()
        }

    def extended(self, geoms: list[SceneGeom]) -> Surfaces:
        """Returns a copy with the surfaces of more objects, which have no textures."""
        found, first = copy(self), len(self.alpha)
        found._rgb = np.concatenate(
            [self._rgb, [np.clip(geom.rgba[:3], 0, 1) for geom in geoms]], dtype=np.float32
        )
        columns = [
            (
                min(float(geom.rgba[3]), 1.0),
                geom.values.emission,
                geom.values.specular,
                128 * geom.values.shininess,
            )
            for geom in geoms
        ]
        more = np.array(columns, np.float32)
        for name, column in zip(("alpha", "emission", "specular", "exponent"), more.T, strict=True):
            setattr(found, name, np.concatenate([getattr(self, name), column]))
        found.unlit = np.concatenate([np.zeros(first, bool), [geom.unlit for geom in geoms]])
        numbers = range(first, first + len(geoms))
        found.shadowless = {i for i in numbers if not geoms[i - first].casts_shadow}
        found.opaque = [*self.opaque, *(i for i in numbers if is_opaque(geoms[i - first].rgba))]
        found.transparent = [*self.transparent, *(i for i in numbers if not is_opaque(geoms[i - first].rgba))]
        return found

    def without(self, numbers: set[int]) -> Surfaces:
        """Returns a copy in which the objects `numbers` are not drawn; the other objects keep their numbers."""
        found = copy(self)
        found.opaque = [number for number in self.opaque if number not in numbers]
        found.transparent = [number for number in self.transparent if number not in numbers]
        found.mirror = None if self.mirror is not None and self.mirror[0] in numbers else self.mirror
        return found

    def colors(self, instance: npt.NDArray[np.int32]) -> Single:
        """Returns the plain sRGB colours [n, 3] of objects [n]."""
        return self._rgb[instance]

    def texture_factors(self, hits: dict[str, Any], footprint: Single) -> Single | None:
        """Returns the sRGB values [n, 3] of the textures at hits, or None if no hit has a texture.

        `footprint` [n] is the size of a pixel on the surface, in metres.
        """
        instance, factors = hits["instance"], None
        for number in np.unique(instance):
            if int(number) not in self._textures:
                continue
            if factors is None:
                factors = np.ones((len(instance), 3), np.float32)
            chosen = np.flatnonzero(instance == number)
            pyramid, density = self._textures[int(number)]
            texels = density[hits["triangle"][chosen]] * footprint[chosen]
            factors[chosen] = pyramid.sample(hits["uv"][chosen], texels)
        return factors


class _Pyramid:
    """A texture with its smaller versions, looked up with trilinear interpolation.

    Source: Williams 1983.
    """

    def __init__(self, model: Any, texture: int) -> None:
        pixels: Single = np.asarray(texture_pixels(model, texture)[:, :, :3] / 255, np.float32)
        if int(model.tex_colorspace[texture]) == SRGB:
            pixels = linear_from_srgb(pixels)
        self._cube = is_cube(model, texture)
        level: Single = pixels.reshape(6, -1, pixels.shape[1], 3) if self._cube else pixels[None]
        self._levels = [level]
        while max(level.shape[1:3]) > 1:
            level = _halved(_halved(level, 1), 2)
            self._levels.append(level)

    def sample(self, uv: Floats, texels: Single) -> Single:
        """Returns the values [n, 3] at texture coordinates [n, 2].

        `texels` [n] is the size of a pixel in texels.
        """
        place = np.asarray(uv, np.float64)
        layer = np.zeros(len(place), np.int64)
        if self._cube:
            layer = np.clip((6 * place[:, 1]).astype(np.int64), 0, 5)
            place = np.stack([place[:, 0], 6 * place[:, 1] - layer], axis=1)
        detail = np.clip(np.log2(np.maximum(texels, 1e-12)), 0, len(self._levels) - 1)
        lower = np.minimum(detail.astype(np.int64), len(self._levels) - 1)
        rest = (detail - lower).astype(np.float32)[:, None]
        found = np.zeros((len(place), 3), np.float32)
        for level in np.unique(lower):
            chosen = np.flatnonzero(lower == level)
            value = self._level(int(level), layer[chosen], place[chosen])
            if rest[chosen].any():
                coarse = self._level(min(int(level) + 1, len(self._levels) - 1), layer[chosen], place[chosen])
                value += rest[chosen] * (coarse - value)
            found[chosen] = value
        return found

    def _level(self, level: int, layer: npt.NDArray[np.int64], place: Floats) -> Single:
        """Returns bilinearly interpolated texels of one level at texture coordinates `place` [n, 2].

        Outside 0 to 1, a texture is repeated, but the faces of a cube map are clamped.
        """
        image = self._levels[level]
        height, width = image.shape[1:3]
        x, y = place[:, 0] * width - 0.5, place[:, 1] * height - 0.5
        left, top = np.floor(x).astype(np.int64), np.floor(y).astype(np.int64)
        right_share, lower_share = (x - left).astype(np.float32), (y - top).astype(np.float32)
        flat = image.reshape(-1, 3)
        columns = [self._index(left + step, width) for step in (0, 1)]
        rows = [(layer * height + self._index(top + step, height)) * width for step in (0, 1)]
        upper = flat[rows[0] + columns[0]]
        upper += right_share[:, None] * (flat[rows[0] + columns[1]] - upper)
        below = flat[rows[1] + columns[0]]
        below += right_share[:, None] * (flat[rows[1] + columns[1]] - below)
        return np.asarray(upper + lower_share[:, None] * (below - upper), np.float32)

    def _index(self, index: npt.NDArray[np.int64], count: int) -> npt.NDArray[np.int64]:
        return np.clip(index, 0, count - 1) if self._cube else index % count


MIN_AREA = 1e-20
"""Smallest squared sine of the angle between two edges of a triangle with an area."""


def texel_density(corners: Floats, uvs: Floats, size: tuple[int, int]) -> Floats:
    """Returns the largest number of texels per metre [t] of triangles.

    The triangles have corners [t, 3, 3] and uvs [t, 3, 2]. `size` is the texture's width and height. The
    result is 0 for triangles without area, which no ray hits.
    """
    first, second = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    steps = (uvs[:, 1:] - uvs[:, :1]) * np.asarray(size, np.float64)
    aa, ab, bb = (np.einsum("tc,tc->t", p, q) for p, q in ((first, first), (first, second), (second, second)))
    area = aa * bb - ab * ab
    is_flat = area <= MIN_AREA * aa * bb
    area[is_flat] = np.inf
    gram = np.empty((len(corners), 2, 2))
    gram[:, 0, 0], gram[:, 0, 1], gram[:, 1, 0], gram[:, 1, 1] = bb / area, -ab / area, -ab / area, aa / area
    product = np.einsum("tji,tjk,tkl->til", steps, gram, steps)
    trace = product[:, 0, 0] + product[:, 1, 1]
    determinant = product[:, 0, 0] * product[:, 1, 1] - product[:, 0, 1] * product[:, 1, 0]
    return np.asarray(np.sqrt(np.maximum(trace / 2 + np.sqrt(np.maximum(trace**2 / 4 - determinant, 0)), 0)))


def _halved(levels: Single, axis: int) -> Single:
    """Averages pairs of rows or columns.

    If the number of rows or columns is odd, the last row or column is omitted. A single row or column is returned
    unchanged.
    """
    count = levels.shape[axis]
    if count == 1:
        return levels
    even = levels.take(range(0, count - 1, 2), axis)
    odd = levels.take(range(1, count, 2), axis)
    return np.asarray((even + odd) / 2, np.float32)
