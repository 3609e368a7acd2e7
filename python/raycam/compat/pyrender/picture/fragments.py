"""Points and lines in images: the pixels that they cover, and each pixel's position on them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from ..camera import Camera
from ..constants import GLTF, RenderFlags
from ..node import Node
from ..primitive import Primitive
from ..scene import Scene
from .shader import turn_normals

__all__ = ["Fragments", "by_edges", "fragments_of"]

Floats = npt.NDArray[Any]
Whole = npt.NDArray[np.int64]

TIE = 1 + 1e-6
"""Maximum ratio of a line's depth to the surface's depth at which the line is drawn in front."""
NORMALS = 0.05
"""Length of the lines of `VERTEX_NORMALS` and `FACE_NORMALS`, as a fraction of the primitive's size."""
MAX_VERTICES = 1 << 20
"""Maximum number of vertices that are projected at a time."""
BLUE = (0.0, 0.0, 1.0, 1.0)


@dataclass
class Fragments:
    """Pixels [n] at which points or lines of a primitive are the nearest surfaces.

    `places` [n, 4, 4] are the poses of the primitive that the pixels show. Each pixel is between two vertices, `ends`
    [n, 2]; `share` [n] is the weight of the second vertex. `color` is a common colour that replaces the material's
    colour.
    """

    node: Node
    primitive: Primitive
    places: Floats
    rows: Whole
    columns: Whole
    position: Floats
    ends: Whole
    share: Floats
    color: tuple[float, float, float, float] | None = None

    def between(self, values: Floats) -> Floats:
        """Vertex values [v, ...], interpolated at the pixels [n, ...]."""
        share = self.share[:, np.newaxis]
        return np.asarray(values[self.ends[:, 0]] * (1 - share) + values[self.ends[:, 1]] * share)


@dataclass
class _Screen:
    """A camera at its pose, the flags, and the image's depth.

    The depth is 0 for the background. Drawn lines update the depth.
    """

    camera: Camera
    pose: Floats
    flags: int
    depth: npt.NDArray[np.float32]

    def project(self, points: Floats) -> tuple[Floats, Floats, Floats]:
        """Returns the image positions and the depth of points in the world.

        The arrays are columns and rows [n, 2], the homogeneous coordinate [n], and the depth [n].
        """
        height, width = self.depth.shape
        seen = (points - self.pose[:3, 3]) @ np.linalg.inv(self.pose[:3, :3]).T
        matrix = self.camera.get_projection_matrix(width, height)
        clip = np.concatenate([seen, np.ones((len(seen), 1))], axis=1) @ matrix.T
        with np.errstate(divide="ignore", invalid="ignore"):
            x = (clip[:, 0] / clip[:, 3] + 1) / 2 * width
            y = (1 - clip[:, 1] / clip[:, 3]) / 2 * height
        return np.stack([x, y], axis=1), clip[:, 3], -seen[:, 2]

    def reaches(self, depth: Floats) -> npt.NDArray[np.bool_]:
        """True for depths between the camera's planes."""
        far = np.inf if self.camera.zfar is None else self.camera.zfar
        return np.asarray((depth >= self.camera.znear) & (depth <= far))

    def visible(self, pixels: Whole, near: Floats) -> Whole:
        """Returns the indices of the visible candidates, at most one per pixel; writes their depth.

        The candidates have the pixels `pixels` [n, 2] (row, column) and the depths `near` [n]. The nearest candidate of
        a pixel is visible if nothing is in front of it.
        """
        height, width = self.depth.shape
        inside = ((pixels >= 0) & (pixels < [height, width])).all(axis=1) & self.reaches(near)
        which = np.flatnonzero(inside)
        flat = pixels[which, 0] * width + pixels[which, 1]
        order = np.lexsort((which, near[which], flat))
        flat, which = flat[order], which[order]
        first = np.r_[True, flat[1:] != flat[:-1]] if len(flat) else np.zeros(0, bool)
        which = which[first]
        there = self.depth[pixels[which, 0], pixels[which, 1]]
        which = which[(there == 0) | (near[which] <= there * TIE)]
        self.depth[pixels[which, 0], pixels[which, 1]] = near[which]
        return np.asarray(which)


def by_edges(primitive: Primitive, flags: int) -> bool:
    """True if the edges of the triangles are shown instead of their faces."""
    if not primitive.has_faces or flags & (RenderFlags.DEPTH_ONLY | RenderFlags.SEG | RenderFlags.ALL_SOLID):
        return False
    wired = bool(primitive.material.wireframe) != bool(flags & RenderFlags.FLIP_WIREFRAME)
    return wired or bool(flags & RenderFlags.ALL_WIREFRAME)


def fragments_of(
    scene: Scene,
    eye: tuple[Camera, Floats],
    flags: int,
    depth: npt.NDArray[np.float32],
    point_size: float,
    shown: set[Node] | None,
) -> list[Fragments]:
    """Returns the pixels of all points and lines of a scene; writes their depth."""
    screen = _Screen(*eye, flags, depth)
    found: list[Fragments] = []
    for node in scene._parents:
        mesh = node.mesh
        if mesh is None or not mesh.is_visible or (shown is not None and node not in shown):
            continue
        pose = scene.get_pose(node)
        for primitive in mesh.primitives:
            for places in _batches(pose @ primitive.places, len(primitive.positions)):
                placed = _Placed(node, primitive, places)
                if primitive.mode == GLTF.POINTS:
                    found.append(_points(placed, screen, point_size))
                elif not primitive.has_faces or by_edges(primitive, flags):
                    found.append(_lines(placed, screen))
                if not flags & (RenderFlags.DEPTH_ONLY | RenderFlags.SEG):
                    found += _normals(placed, screen)
    return found


@dataclass
class _Placed:
    """A primitive with n vertices at k poses `places` [k, 4, 4]."""

    node: Node
    primitive: Primitive
    places: Floats

    @cached_property
    def vertices(self) -> Floats:
        """The vertices of all poses in the world [k n, 3]."""
        return self.move(self.primitive.positions)

    def move(self, points: Floats) -> Floats:
        """Points [m, 3] of the primitive at all poses [k m, 3]."""
        turned = points @ self.places[:, :3, :3].transpose(0, 2, 1)
        return np.asarray((turned + self.places[:, np.newaxis, :3, 3]).reshape(-1, 3))

    def repeat(self, corners: Whole) -> Whole:
        """Vertex indices [m, c] of the primitive as indices [k m, c] into `vertices`."""
        first = len(self.primitive.positions) * np.arange(len(self.places))
        return np.asarray((corners + first[:, np.newaxis, np.newaxis]).reshape(-1, corners.shape[1]))

    def fragments(self, pixels: Whole, position: Floats, ends: Whole, share: Floats) -> Fragments:
        """The fragments between vertices with the indices `ends` [n, 2] into `vertices`."""
        count = max(len(self.primitive.positions), 1)
        places = self.places[ends[:, 0] // count]
        return Fragments(
            self.node, self.primitive, places, pixels[:, 0], pixels[:, 1], position, ends % count, share
        )


def _batches(places: Floats, vertices: int) -> Iterator[Floats]:
    """Yields poses [k, 4, 4] in batches that have at most `MAX_VERTICES` vertices, or one pose."""
    size = max(1, MAX_VERTICES // max(vertices, 1))
    for start in range(0, len(places), size):
        yield places[start : start + size]


def _points(placed: _Placed, screen: _Screen, size: float) -> Fragments:
    world = placed.vertices
    at, weight, near = screen.project(world)
    good = np.flatnonzero((weight > 0) & screen.reaches(near))
    side = max(1, round(size))
    steps = np.arange(side) - side / 2 + 0.5
    offsets = np.stack(np.meshgrid(steps, steps, indexing="ij"), axis=-1).reshape(-1, 2)
    pixels = _pixels((at[good][:, np.newaxis] + offsets[:, ::-1]).reshape(-1, 2))
    which = np.repeat(good, side * side)
    kept = screen.visible(pixels, near[which])
    which, pixels = which[kept], pixels[kept]
    return placed.fragments(pixels, world[which], np.stack([which, which], axis=1), np.zeros(len(which)))


def _lines(placed: _Placed, screen: _Screen) -> Fragments:
    primitive, world = placed.primitive, placed.vertices
    ends = placed.repeat(primitive.segments)
    if primitive.has_faces and not (
        primitive.material.doubleSided or screen.flags & RenderFlags.SKIP_CULL_FACES
    ):
        mirrored = np.repeat(np.linalg.det(placed.places[:, :3, :3]) < 0, len(primitive.faces))
        ends = ends.reshape(-1, 3, 2)[_front(world[placed.repeat(primitive.faces)], screen, mirrored)]
        ends = ends.reshape(-1, 2)
    pixels, which, share, position = _drawn(world[ends], screen)
    return placed.fragments(pixels, position, ends[which], share)


def _front(corners: Floats, screen: _Screen, mirrored: npt.NDArray[np.bool_]) -> npt.NDArray[np.bool_]:
    """Returns True for triangles [m, 3, 3] whose front faces the camera.

    A mirroring pose (`mirrored` [m]) reverses the winding.
    """
    wound = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    starts, ways = screen.camera.rays(np.array([0.0, 1.0]), np.array([0.0, 1.0]), (1, 1))
    parallel = np.ptp(starts) > 0
    along = screen.pose[:3, :3] @ ways[0] if parallel else corners[:, 0] - screen.pose[:3, 3]
    facing = (wound * along).sum(axis=1)
    return np.asarray(np.where(mirrored, facing > 0, facing < 0))


def _normals(placed: _Placed, screen: _Screen) -> list[Fragments]:
    """The lines of the normals requested by the flags."""
    found: list[Fragments] = []
    primitive = placed.primitive
    starts, ways = [], []
    if screen.flags & RenderFlags.VERTEX_NORMALS and primitive.normals is not None:
        starts.append(placed.vertices)
        turns = np.repeat(placed.places[:, :3, :3], len(primitive.normals), axis=0)
        ways.append(turn_normals(np.tile(primitive.normals, (len(placed.places), 1)), turns))
    if screen.flags & RenderFlags.FACE_NORMALS and primitive.has_faces:
        corners = placed.vertices[placed.repeat(primitive.faces)]
        starts.append(corners.mean(axis=1))
        ways.append(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]))
    for start, way in zip(starts, ways, strict=True):
        length = NORMALS * primitive.scale
        unit = way / np.maximum(np.linalg.norm(way, axis=1, keepdims=True), 1e-30)
        pixels, _, share, position = _drawn(np.stack([start, start + length * unit], axis=1), screen)
        ends = np.zeros((len(pixels), 2), np.int64)
        found.append(replace(placed.fragments(pixels, position, ends, share), color=BLUE))
    return found


def _drawn(segments: Floats, screen: _Screen) -> tuple[Whole, Whole, Floats, Floats]:
    """Returns the pixels [n, 2] of segments, and for each pixel its place on a segment.

    The place consists of the segment [n], the weight of the segment's second end, and the world position
    [n, 3]. Lines are one pixel wide.
    """
    height, width = screen.depth.shape
    flat = segments.reshape(-1, 3)
    _, _, near = screen.project(flat)
    near = near.reshape(-1, 2)
    # Lines are clipped at the near plane, so that both ends can be projected.
    least = max(float(screen.camera.znear), 1e-9)
    with np.errstate(divide="ignore", invalid="ignore"):
        cut = np.clip((least - near[:, 0]) / (near[:, 1] - near[:, 0]), 0, 1)
    low = np.where(near[:, 0] < least, cut, 0.0)
    high = np.where(near[:, 1] < least, cut, 1.0)
    alive = np.flatnonzero((near >= least).any(axis=1) & np.isfinite(segments).all(axis=(1, 2)))
    low, high, segments = low[alive], high[alive], segments[alive]
    ways = segments[:, 1] - segments[:, 0]
    first, last = (segments[:, 0] + side[:, np.newaxis] * ways for side in (low, high))
    (at0, w0, near0), (at1, w1, near1) = screen.project(first), screen.project(last)
    # Lines are clipped at the image border, so that a line has no more steps than pixels.
    enter, leave = np.zeros(len(at0)), np.ones(len(at0))
    for axis, size in ((0, width), (1, height)):
        step = at1[:, axis] - at0[:, axis]
        for bound, sign in ((-1.0, 1.0), (size + 1.0, -1.0)):
            gap = sign * (at0[:, axis] - bound)
            rate = sign * step
            with np.errstate(divide="ignore", invalid="ignore"):
                s = -gap / rate
            enter = np.where((rate > 0) & (gap < 0), np.maximum(enter, s), enter)
            leave = np.where((rate < 0), np.minimum(leave, s), leave)
            leave = np.where((rate == 0) & (gap < 0), -1.0, leave)
    # A step is at the middle of a column, or of a row for steep lines.
    step = at1 - at0
    major = np.abs(step).argmax(axis=1)[:, np.newaxis]
    start, step = (np.take_along_axis(values, major, axis=1)[:, 0] for values in (at0, step))
    reach = np.sort(start + np.stack([enter, np.maximum(leave, enter)]) * step, axis=0)
    first_step, end_step = np.ceil(reach - 0.5)
    count = (end_step - first_step).astype(np.int64)
    which = np.repeat(np.arange(len(count)), count)
    step_of = np.arange(len(which)) - np.repeat(np.cumsum(count) - count, count)
    s = (first_step[which] + step_of + 0.5 - start[which]) / step[which]
    at = at0[which] * (1 - s)[:, np.newaxis] + at1[which] * s[:, np.newaxis]
    u = (s / w1[which]) / ((1 - s) / w0[which] + s / w1[which])
    depth = near0[which] * (1 - u) + near1[which] * u
    pixels = _pixels(at)
    kept = screen.visible(pixels, depth)
    pixels, which, u = pixels[kept], which[kept], u[kept]
    share = low[which] + (high - low)[which] * u
    position = segments[which, 0] + share[:, np.newaxis] * ways[which]
    return pixels, alive[which], share, position


def _pixels(at: Floats) -> Whole:
    """Returns the rows and columns [n, 2] of the pixels that contain image positions.

    The positions are [n, 2]; a position between two rows belongs to the upper row.
    """
    return np.stack([np.ceil(at[:, 1]) - 1, np.floor(at[:, 0])], axis=1).astype(np.int64)
