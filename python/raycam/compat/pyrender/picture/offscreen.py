"""Offscreen rendering of pyrender's scenes.

raycam computes exact rays, and the surfaces are shaded as in pyrender's default shader.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from ..camera import Camera
from ..constants import RenderFlags
from ..light import DirectionalLight, PointLight, SpotLight
from ..node import Node
from ..primitive import Primitive
from ..scene import Scene
from .fragments import Fragments, fragments_of
from .instances import SceneWorld
from .path_traced import path_traced_picture
from .shader import PlacedLight, Shadow, Surfaces, bent, shade, surface_values, turn_normals

__all__ = ["OffscreenRenderer", "Renderer"]

Floats = npt.NDArray[Any]
Whole = npt.NDArray[np.int64]

LAYERS = 32
"""Maximum number of cut-away or transparent surfaces along a ray."""
PATTERN = ((-0.125, 0.375), (0.375, 0.125), (-0.375, -0.125), (0.125, -0.375))
"""Offsets of the four samples of an edge from the pixel's centre."""


@dataclass
class Hits:
    """The first surfaces of rays; instance -1 and depth +inf for a miss."""

    instance: Whole
    triangle: Whole
    depth: Floats
    weights: Floats
    normal: Floats


class OffscreenRenderer:
    """Renders scenes into arrays, on the CPU, without a display."""

    def __init__(self, viewport_width: int, viewport_height: int, point_size: float = 1.0) -> None:
        self.viewport_width, self.viewport_height = int(viewport_width), int(viewport_height)
        self.point_size = float(point_size)
        self._scene: Scene | None = None
        self._shown = SceneWorld()

    @property
    def _renderer(self) -> Any:
        """Raises an `AttributeError` that names raycam's channel for normals.

        Programs replace the shaders of pyrender's renderer to render normals.
        """
        raise AttributeError(
            "OffscreenRenderer has no _renderer and no shaders; to render normals, create the same scene "
            'with raycam.World and raycam.Camera, and use raycam.render(world, camera, channels="normal")'
        )

    def delete(self) -> None:
        """Releases the last scene; may be called any number of times."""
        self._scene, self._shown = None, SceneWorld()

    def render(
        self, scene: Scene, flags: int = RenderFlags.NONE, seg_node_map: dict[Node, Any] | None = None
    ) -> Any:
        """Returns the image and the depth.

        The image is uint8 [h, w, 3] ([h, w, 4] with `RGBA`). The depth is float32 [h, w], 0 for the
        background. With `DEPTH_ONLY`, only the depth is returned. With `SEG`, the image shows only the nodes
        of `seg_node_map`, in their colours. Raises `ValueError` for a scene without a camera.
        """
        eye = scene.main_camera_node
        if eye is None or eye.camera is None:
            raise ValueError("the scene has no camera; add one with scene.add(camera, pose=...)")
        if self._scene is not scene:
            self._scene, self._shown = scene, SceneWorld()
        seg = bool(flags & RenderFlags.SEG)
        colors = {node: _seg_color(color) for node, color in (seg_node_map or {}).items()}
        only = set(colors) if seg else None
        self._shown.follow(scene, only, flags)
        view = _View(self._shown, scene.get_pose(eye), eye.camera, flags)
        width, height = self.viewport_width, self.viewport_height
        rows, columns = (axis.ravel() for axis in np.mgrid[0:height, 0:width])
        hits = view.first(columns + 0.5, rows + 0.5, (width, height))
        depth = np.where(np.isfinite(hits.depth), hits.depth, 0).astype(np.float32).reshape(height, width)
        fragments = fragments_of(scene, (view.camera, view.pose), flags, depth, self.point_size, only)
        if flags & RenderFlags.DEPTH_ONLY and not seg:
            return depth
        if seg:
            picture = np.zeros((height, width, 3), np.uint8)
            found = hits.instance >= 0
            shown_colors = np.array(
                [colors.get(instance.node, (0, 0, 0)) for instance in self._shown.instances], np.uint8
            )
            picture.reshape(-1, 3)[found] = shown_colors.reshape(-1, 3)[hits.instance[found]]
        else:
            picture = self._lit(scene, view, hits, (columns, rows))
        for each in fragments:
            shown = colors[each.node] if seg else view.fragment_colors(scene, _placed_lights(scene), each)
            picture[each.rows, each.columns] = shown
        if flags & RenderFlags.RGBA and picture.shape[2] == 3:
            picture = np.concatenate([picture, np.full((height, width, 1), 255, np.uint8)], axis=2)
        return (picture if flags & RenderFlags.RGBA else np.ascontiguousarray(picture[..., :3])), depth

    def _lit(self, scene: Scene, view: _View, hits: Hits, at: tuple[Whole, Whole]) -> npt.NDArray[np.uint8]:
        """The image [h, w, 4] with the shading that the module's setting `shading` selects."""
        shading = sys.modules[__package__.rpartition(".")[0]].shading
        if shading not in ("pyrender", "raycam"):
            raise ValueError(f'shading is {shading!r}: expected "pyrender" or "raycam"')
        if shading == "pyrender" or view.flags & RenderFlags.FLAT:
            return self._colors(scene, view, hits, at)
        return path_traced_picture(scene, view.camera, view.pose, (self.viewport_width, self.viewport_height))

    def _colors(
        self, scene: Scene, view: _View, hits: Hits, at: tuple[Whole, Whole]
    ) -> npt.NDArray[np.uint8]:
        """The image [h, w, 4]; pixels at edges are the mean of four samples."""
        width, height = self.viewport_width, self.viewport_height
        columns, rows = at
        lights = _placed_lights(scene)
        picture = view.colors(scene, lights, hits, columns + 0.5, rows + 0.5, (width, height))
        edges = _edges(hits, (height, width))
        if edges.any():
            x, y = columns[edges] + 0.5, rows[edges] + 0.5
            total = np.zeros((len(x), 4))
            for dx, dy in PATTERN:
                seen = view.first(x + dx, y + dy, (width, height))
                total += view.colors(scene, lights, seen, x + dx, y + dy, (width, height))
            picture[edges] = np.round(total / len(PATTERN))
        return picture.reshape(height, width, 4).astype(np.uint8)


class Renderer(OffscreenRenderer):
    """In pyrender the class behind `OffscreenRenderer`; here the same class."""

    def render_text(self, *_arguments: Any, **_options: Any) -> None:
        """Raises `NotImplementedError`, because text is not rendered."""
        raise NotImplementedError(
            "render_text is not supported; draw text on the image, for example with PIL.ImageDraw"
        )

    def read_color_buf(self) -> Any:
        """Raises `NotImplementedError`, because there is no window."""
        raise NotImplementedError(
            "read_color_buf is not supported without a window; render(scene) returns the image"
        )

    def read_depth_buf(self) -> Any:
        """Raises `NotImplementedError`, because there is no window."""
        raise NotImplementedError(
            "read_depth_buf is not supported without a window; render(scene) returns the depth"
        )


class _View:
    """The rays of a camera in a scene's world."""

    def __init__(self, shown: SceneWorld, pose: Floats, camera: Camera, flags: int) -> None:
        self.shown, self.pose, self.camera, self.flags = shown, pose, camera, flags

    def rays(self, x: Floats, y: Floats, size: tuple[int, int]) -> tuple[Floats, Floats]:
        """Origins and directions in the world, scaled so that t is the depth."""
        starts, ways = self.camera.rays(x, y, size)
        turn = self.pose[:3, :3]
        return starts @ turn.T + self.pose[:3, 3], ways @ turn.T

    def first(self, x: Floats, y: Floats, size: tuple[int, int], after: Floats | None = None) -> Hits:
        """The first drawn surfaces between the camera's planes and beyond the depths `after`."""
        origins, directions = self.rays(x, y, size)
        far = np.inf if self.camera.zfar is None else self.camera.zfar
        near = np.full(len(x), self.camera.znear) if after is None else np.nextafter(after, np.inf)
        found = Hits(
            np.full(len(x), -1),
            np.full(len(x), -1),
            np.full(len(x), np.inf),
            np.zeros((len(x), 3)),
            np.zeros((len(x), 3)),
        )
        left = np.arange(len(x))
        for _ in range(LAYERS):
            if len(left) == 0 or not self.shown.instances:
                break
            hits = self.shown.world.cast_rays(origins[left], directions[left], t_min=near[left], t_max=far)
            hit = hits["instance"] >= 0
            corners = self._corners(hits["instance"][hit], hits["triangle"][hit])
            wound = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
            # As in glTF, a mirroring pose swaps the winding of front faces.
            wound[self._mirrored[hits["instance"][hit]]] *= -1
            front = np.einsum("ij,ij->i", wound, directions[left[hit]]) < 0
            drawn = front | self._both_sides(hits["instance"][hit])
            to = left[hit][drawn]
            found.instance[to] = hits["instance"][hit][drawn]
            found.triangle[to] = hits["triangle"][hit][drawn]
            found.depth[to] = hits["t"][hit][drawn]
            found.weights[to] = hits["barycentric"][hit][drawn]
            found.normal[to] = wound[drawn] / np.linalg.norm(wound[drawn], axis=1, keepdims=True)
            culled = left[hit][~drawn]
            near[culled] = np.nextafter(hits["t"][hit][~drawn], np.inf)
            left = culled
        return found

    @cached_property
    def _mirrored(self) -> npt.NDArray[np.bool_]:
        """True for instances with a mirroring pose."""
        return np.asarray(np.linalg.det(self._places[:, :3, :3]) < 0)

    @cached_property
    def _places(self) -> Floats:
        """The instances' poses [k, 4, 4]."""
        return np.array([one.place for one in self.shown.instances]).reshape(-1, 4, 4)

    @cached_property
    def _first_like(self) -> Whole:
        """For each instance [k], the first instance of the same primitive."""
        first: dict[int, int] = {}
        alike = [first.setdefault(id(one.primitive), i) for i, one in enumerate(self.shown.instances)]
        return np.array(alike, dtype=np.int64)

    def _by_primitive(
        self, instance: npt.NDArray[Any]
    ) -> Iterator[tuple[Primitive, npt.NDArray[np.intp], Floats]]:
        """Yields each primitive of hits, with the indices [n] of its hits and their poses [n, 4, 4].

        The running time does not depend on the number of instances.
        """
        if len(instance) == 0:
            return
        alike = self._first_like[instance]
        order = np.argsort(alike, kind="stable")
        numbers, starts = np.unique(alike[order], return_index=True)
        for number, own in zip(numbers, np.split(order, starts[1:]), strict=True):
            yield self.shown.instances[number].primitive, own, self._places[instance[own]]

    def _both_sides(self, instance: npt.NDArray[Any]) -> npt.NDArray[np.bool_]:
        if self.flags & RenderFlags.SKIP_CULL_FACES:
            return np.ones(len(instance), bool)
        sides = np.array([one.primitive.material.doubleSided for one in self.shown.instances])
        return np.asarray(sides[instance])

    def _corners(self, instance: npt.NDArray[Any], triangle: npt.NDArray[Any]) -> Floats:
        corners = np.empty((len(instance), 3, 3))
        for primitive, own, places in self._by_primitive(instance):
            local = primitive.positions[primitive.faces[triangle[own]]]
            corners[own] = local @ places[:, :3, :3].transpose(0, 2, 1) + places[:, np.newaxis, :3, 3]
        return corners

    def colors(
        self, scene: Scene, lights: list[PlacedLight], hits: Hits, x: Floats, y: Floats, size: tuple[int, int]
    ) -> Floats:
        """The colours [n, 4] of pixels (0 to 255), including surfaces behind transparent surfaces."""
        color = np.zeros((len(x), 4))
        through = np.ones(len(x))
        left = np.arange(len(x))
        for _ in range(LAYERS):
            seen = hits.instance >= 0
            behind = left[~seen]
            color[behind] += through[behind, np.newaxis] * scene.bg_color
            through[behind] = 0
            left, hits = left[seen], _select(hits, seen)
            if len(left) == 0:
                break
            shaded, blends = self._shaded(scene, lights, hits, x[left], y[left], size)
            alpha = np.where(blends, shaded[:, 3], 1.0)
            color[left, :3] += (through[left] * alpha)[:, np.newaxis] * shaded[:, :3]
            # Alpha counts twice, as in OpenGL's blending.
            color[left, 3] += through[left] * np.where(blends, alpha**2, shaded[:, 3])
            through[left] *= 1 - alpha
            more = through[left] > 0
            left, after = left[more], hits.depth[more]
            if len(left) == 0:
                break
            hits = self.first(x[left], y[left], size, after)
        return np.floor(255 * np.clip(color, 0, 1) + 0.5)

    def _shaded(
        self, scene: Scene, lights: list[PlacedLight], hits: Hits, x: Floats, y: Floats, size: tuple[int, int]
    ) -> tuple[Floats, npt.NDArray[np.bool_]]:
        """The colours [n, 4] of surfaces, and True for transparent surfaces."""
        origins, directions = self.rays(x, y, size)
        positions = origins + hits.depth[:, np.newaxis] * directions
        colors, blends = np.empty((len(x), 4)), np.zeros(len(x), bool)
        for primitive, own, places in self._by_primitive(hits.instance):
            corners = primitive.faces[hits.triangle[own]]
            weights = hits.weights[own][:, :, np.newaxis]

            def weighted(values: Floats, corners: Any = corners, weights: Floats = weights) -> Floats:
                return np.asarray((values[corners] * weights).sum(axis=1))

            turn = places[:, :3, :3]
            colors[own] = self._values(scene, lights, primitive, turn, positions[own], weighted, corners)
            blends[own] = primitive.material.alphaMode == "BLEND"
        return colors, blends

    def fragment_colors(
        self, scene: Scene, lights: list[PlacedLight], fragments: Fragments
    ) -> npt.NDArray[np.uint8]:
        """The colours [n, 4] of pixels of points and lines (0 to 255)."""
        if fragments.color is not None:
            colors = np.tile(fragments.color, (len(fragments.rows), 1))
        else:
            colors = self._values(
                scene,
                lights,
                fragments.primitive,
                fragments.places[:, :3, :3],
                fragments.position,
                fragments.between,
                None,
            )
        return np.asarray(np.round(255 * np.clip(colors, 0, 1)), dtype=np.uint8)

    def _values(
        self,
        scene: Scene,
        lights: list[PlacedLight],
        primitive: Primitive,
        turn: Floats,
        positions: Floats,
        weighted: Callable[[Floats], Floats],
        corners: Whole | None,
    ) -> Floats:
        """Returns the colours [n, 4] at positions of a primitive.

        `turn` [3, 3] or [n, 3, 3] is the linear part of the pose. `weighted` interpolates vertex values at these
        positions. `corners` [n, 3] are the vertices of each position's triangle, which orient normal textures.
        """
        tint = np.ones((len(positions), 4)) if primitive.color_0 is None else weighted(primitive.color_0)
        uv = None if primitive.texcoord_0 is None else weighted(primitive.texcoord_0)
        flat = bool(self.flags & RenderFlags.FLAT)
        values = surface_values(primitive.material, uv, tint, len(tint), flat)
        alpha = values["base"][:, 3] * tint[:, 3]
        if flat:
            return np.concatenate([values["base"][:, :3] * tint[:, :3], alpha[:, np.newaxis]], axis=1)
        to_eye = self.pose[:3, 3] - positions
        to_eye /= np.maximum(np.linalg.norm(to_eye, axis=1, keepdims=True), 1e-30)
        normal = to_eye
        if primitive.normals is not None:
            normal = turn_normals(weighted(primitive.normals), turn)
        texture = primitive.material.normalTexture
        if texture is not None and uv is not None and corners is not None:
            edges = primitive.positions[corners[:, 1:]] - primitive.positions[corners[:, :1]]
            over = primitive.texcoord_0[corners[:, 1:]] - primitive.texcoord_0[corners[:, :1]]
            grown = edges[:, 0] * over[:, 1, 1:] - edges[:, 1] * over[:, 0, 1:]
            grown *= np.sign(over[:, 0, :1] * over[:, 1, 1:] - over[:, 1, :1] * over[:, 0, 1:])
            normal = bent(normal, (turn @ grown[:, :, np.newaxis])[:, :, 0], texture.lookup(uv))
        surfaces = Surfaces(positions, normal, to_eye, vertex_color=tint, **values)
        rgb = shade(surfaces, lights, scene.ambient_light.astype(np.float64), self._shadow())
        return np.concatenate([rgb, alpha[:, np.newaxis]], axis=1)

    def _shadow(self) -> Shadow | None:
        """The shadow test for the lights that the flags select; None for no shadows."""
        flags = self.flags
        if not flags & RenderFlags.SHADOWS_ALL:
            return None
        world = self.shown.world
        bounds = world.bounds
        margin = 1e-6 * (1.0 if bounds is None else float(np.abs(bounds).max() + np.ptp(bounds)))

        def shadow(placed: PlacedLight, points: Floats) -> npt.NDArray[np.bool_]:
            light = placed.light
            if isinstance(light, DirectionalLight):
                named = flags & RenderFlags.SHADOWS_DIRECTIONAL
                ways, end, start = np.broadcast_to(-placed.direction, points.shape), np.inf, margin
            else:
                named = flags & (
                    RenderFlags.SHADOWS_SPOT if isinstance(light, SpotLight) else RenderFlags.SHADOWS_POINT
                )
                ways, end = placed.position - points, 1.0
                start = margin / np.maximum(np.linalg.norm(ways, axis=1), 1e-30)
            if not named:
                return np.zeros(len(points), bool)
            return world.occluded(points, ways, end, t_min=start)

        return shadow


def _select(hits: Hits, which: npt.NDArray[np.bool_]) -> Hits:
    return Hits(
        *(getattr(hits, name)[which] for name in ("instance", "triangle", "depth", "weights", "normal"))
    )


def _edges(hits: Hits, shape: tuple[int, int]) -> npt.NDArray[np.bool_]:
    """Returns the edge mask [n] of an image.

    Edges are pixels whose neighbour shows another instance or a surface turned by more than a limit.
    """
    instance, normal = hits.instance.reshape(shape), hits.normal.reshape(*shape, 3)
    edges = np.zeros(shape, bool)
    for axis in (0, 1):
        one = tuple(slice(None, -1) if i == axis else slice(None) for i in (0, 1))
        other = tuple(slice(1, None) if i == axis else slice(None) for i in (0, 1))
        differs = instance[one] != instance[other]
        differs |= (normal[one] * normal[other]).sum(axis=-1) < 0.9
        differs &= (instance[one] >= 0) | (instance[other] >= 0)
        edges[one] |= differs
        edges[other] |= differs
    return edges.ravel()


def _placed_lights(scene: Scene) -> list[PlacedLight]:
    placed = []
    for node in scene._parents:
        if node.light is not None:
            pose = scene.get_pose(node)
            along = -pose[:3, 2] / max(float(np.linalg.norm(pose[:3, 2])), 1e-30)
            placed.append(PlacedLight(node.light, pose[:3, 3], along))
    order = (DirectionalLight, SpotLight, PointLight)
    return sorted(
        placed, key=lambda one: next(i for i, kind in enumerate(order) if isinstance(one.light, kind))
    )


def _seg_color(color: Any) -> npt.NDArray[np.uint8]:
    """Returns three bytes; one number sets all three."""
    return np.asarray(np.clip(np.broadcast_to(np.asarray(color), 3), 0, 255), dtype=np.uint8)
